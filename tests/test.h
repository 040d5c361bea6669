// SPDX-License-Identifier: MIT
//
// What every test needs: cmocka with its prerequisites, comparisons of floating point numbers that
// print both sides, and memory that fails.

#ifndef NMM_TEST_H
#define NMM_TEST_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/// |actual - expected| <= tolerance; NaN fails.
#define assert_near(actual, expected, tolerance)                                                   \
    do {                                                                                           \
        const double near_a = (actual), near_e = (expected), near_t = (tolerance);                 \
        if (!(fabs(near_a - near_e) <= near_t)) {                                                  \
            print_error("%s:%d: %s = %.17g, expected %.17g within %.3g, off by %.3g\n", __FILE__,  \
                        __LINE__, #actual, near_a, near_e, near_t, near_a - near_e);               \
            fail();                                                                                \
        }                                                                                          \
    } while (0)

/// Relative form: |actual - expected| <= tolerance * |expected|.
#define assert_close(actual, expected, tolerance)                                                  \
    assert_near(actual, expected, (tolerance)*fabs(expected))

/// Memory of a context (nmm_context.allocate, with a failing as its user) that fails once, at call
/// number `fail_at`, counted from 0; -1: never. Counts calls, and blocks not given back.
typedef struct test_failing {
    long calls, fail_at, live;
} test_failing;

static inline void *test_failing_hook(void *user, void *old, size_t size) {
    test_failing *f = user;
    if (size == 0) {
        f->live -= old != NULL;
        free(old);
        return NULL;
    }
    if (f->calls++ == f->fail_at) return NULL;
    void *block = realloc(old, size);
    f->live += old == NULL && block != NULL;
    return block;
}

#endif
