// SPDX-License-Identifier: MIT
//
// The two ways in which the kernel text runs on a device: one launch for each kernel, all teams; or
// one team that walks through many kernels in one launch, for systems too small to fill a device.

#ifndef NMM_TARGET_H
#define NMM_TARGET_H

#include "solver.h"

/// Each transfer has a number, so that a test can leave out one of them (docs/offload.md). The
/// pointer is copied first: a map of a struct's member would map the member as well; (void),
/// because gcc does not count a directive as a use. No other place copies arrays to or from a
/// device, so `s->traffic` counts them all; a map that only makes room moves nothing.
#ifdef NMM_TRANSFER_TEST
#include "transfer_test.h"
#else
#define TRANSFER_LEFT_OUT (-1)
#define GUARDED
#endif
#define TRANSFER_NUMBER (TRANSFER_BASE + __COUNTER__)
#define TRANSFER(directive, pointer, length, moves)                                                \
    do {                                                                                           \
        __typeof__(*(pointer)) *data = (pointer);                                                  \
        const long count = (length);                                                               \
        const double began = nmm_clock();                                                          \
        (void)data;                                                                                \
        if (TRANSFER_NUMBER != TRANSFER_LEFT_OUT) {                                                \
            directive                                                                              \
        }                                                                                          \
        if (moves) nmm_traffic_note(s->traffic, count *(long)sizeof *data, began);                 \
    } while (0)

#define SEND(p, n) TRANSFER(_Pragma("omp target update to(data[0 : count])"), p, n, true)
#define FETCH(p, n) TRANSFER(_Pragma("omp target update from(data[0 : count])"), p, n, true)
#define MAP(p, n)                                                                                  \
    TRANSFER(_Pragma("omp target enter data map(alloc : data[0 : count])"), p, n, false)
#define UNMAP(p, n)                                                                                \
    TRANSFER(_Pragma("omp target exit data map(delete : data[0 : count])"), p, n, false)

/// One copy that took from `began` to now.
static inline void nmm_traffic_note(nmm_traffic *traffic, long bytes, double began) {
    traffic->transfers += 1;
    traffic->bytes += (double)bytes;
    traffic->seconds += nmm_clock() - began;
}

/// One prepared solve, from the first guess u; the true residual norm. The result is in
/// solver->wide.u.
nmm_jacobi_run nmm_target_launches, nmm_target_team;

#endif
