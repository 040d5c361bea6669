// SPDX-License-Identifier: MIT
//
// One team of a device walks through a batch of kernels in one launch: threads share the rounds of
// a loop, a barrier separates kernels, as threads do on the host. For systems too small for all
// teams, whose iterations would cost less than the launches.
//
// The kernels find their arrays through the solver object, so a copy of it lives on the device
// whose pointers are those of the device: `attach` writes it.

#define TRANSFER_BASE 1000

#include "sweeps.h"
#include "target.h"

#include <math.h>
#include <omp.h>
#include <string.h>

#define PARALLEL_FOR _Pragma("omp for schedule(static)")
#define SINGLE _Pragma("omp single")
#define JOIN
#define BATCH                                                                                      \
    attach(s);                                                                                     \
    GUARDED _Pragma("omp target parallel")
#define ON_DEVICE (!omp_is_initial_device())

// One thing that kernels look up in `s`: a transfer like the others, made on the device.
#define ATTACH(member, value)                                                                      \
    if (TRANSFER_NUMBER != left_out) s->member = (value)

static void attach(const nmm_solver *solver) {
    nmm_solver *s = (nmm_solver *)solver;
    const int left_out = TRANSFER_LEFT_OUT, n = s->n;
    int *row_start = s->row_start, *col = s->col;
    const nmm_wide w = s->wide;
    const nmm_narrow v = s->narrow;
    double *value = w.value, *inverse = w.inverse, *f = w.f, *u = w.u, *r = w.r;
    double *p = w.p, *q = w.q, *z = w.z;
    float *value4 = v.value, *inverse4 = v.inverse, *f4 = v.f, *u4 = v.u, *r4 = v.r;
    float *p4 = v.p, *q4 = v.q, *z4 = v.z, *dense = s->dense;
    double *scale = s->dense_scale, *part = s->part, *chunk = s->chunk;
    nmm_iteration *state = s->state;
    // On the device a pointer to nothing need not be NULL.
    const bool has_dense = dense != NULL;
#pragma omp target
    {
        ATTACH(n, n);
        ATTACH(row_start, row_start);
        ATTACH(col, col);
        ATTACH(wide.value, value);
        ATTACH(wide.inverse, inverse);
        ATTACH(wide.f, f);
        ATTACH(wide.u, u);
        ATTACH(wide.r, r);
        ATTACH(wide.p, p);
        ATTACH(wide.q, q);
        ATTACH(wide.z, z);
        ATTACH(narrow.value, value4);
        ATTACH(narrow.inverse, inverse4);
        ATTACH(narrow.f, f4);
        ATTACH(narrow.u, u4);
        ATTACH(narrow.r, r4);
        ATTACH(narrow.p, p4);
        ATTACH(narrow.q, q4);
        ATTACH(narrow.z, z4);
        ATTACH(dense, has_dense ? dense : NULL);
        ATTACH(dense_scale, scale);
        ATTACH(part, part);
        ATTACH(chunk, chunk);
        ATTACH(state, state);
    }
}

#include "../src/solve/jacobi_family.inl"

double nmm_target_team(nmm_solver *solver, const double *u, nmm_solve_report *report) {
    return run_method(solver, u, report);
}

#ifdef NMM_TRANSFER_TEST
int nmm_transfer_count_team(void) {
    return __COUNTER__;
}
#endif
