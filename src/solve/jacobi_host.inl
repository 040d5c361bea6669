// SPDX-License-Identifier: MIT
//
// The Jacobi family on the host, one variant: the includer defines VARIANT, the name of the
// table of its functions, and THREADS where loops are to be shared. With threads a batch is one
// parallel region, so that threads start once for several iterations; inside it loops are shared by
// `omp for`, whose barrier separates kernels. Nothing is sent or fetched. Not `omp target` without
// a device: each such region builds and destroys its threads anew.

#include "gauss.h"
#include "sweeps.h"

#include <math.h>
#include <string.h>

#ifdef THREADS
#include "barrier.h"
#define PARALLEL_FOR _Pragma("omp for schedule(static) nowait")
#define PARALLEL_FOR_LATE _Pragma("omp for schedule(dynamic, 32) nowait")
#define SINGLE _Pragma("omp master")
#define JOIN nmm_barrier_wait(s->barrier)
#define BATCH _Pragma("omp parallel num_threads(s->n_thread)")
#define SHARED_ROWS                                                                                \
    _Pragma("omp parallel for schedule(static) num_threads(s->n_thread) if (s->n > 4000)")
#else
#define PARALLEL_FOR
#define PARALLEL_FOR_LATE
#define SINGLE
#define JOIN
#define BATCH
#define SHARED_ROWS
#endif
#define SEND(p, n) ((void)(n))
#define FETCH(p, n) ((void)(n))
#define ON_DEVICE 0
#define HAS_COARSE

// Vectors of GNU C: without AVX the compiler makes two halves of them.
#define LANES
typedef double wide_lanes __attribute__((vector_size(32)));
typedef double pair_wide __attribute__((vector_size(16)));
typedef float pair_narrow __attribute__((vector_size(8)));
typedef float lanes_narrow __attribute__((vector_size(16)));
typedef float dense_lanes __attribute__((vector_size(32)));
typedef wide_lanes lanes_wide;

#include "coarse_solve.inl"
#include "jacobi_family.inl"

#include "clusters_invert.inl"
#include "coarse_make.inl"
#include "gauss.inl"

// y = K x.
static void multiply_all(const nmm_solver *s, const double *x, double *y) {
    SHARED_ROWS
    for (int row = 0; row < s->n; row++)
        multiply_row_wide(s->row_start, s->col, s->wide.value, x, row, far_row(s->n),
                          y + 2 * (long)row);
}

const nmm_variant VARIANT = {.run = run_method,
                             .invert = invert_clusters,
                             .make_coarse = make_coarse,
                             .multiply = multiply_all,
                             .gauss_backward = gauss_backward,
                             .gauss_forward = gauss_forward,
                             .couple = couple,
                             .orthogonalise = orthogonalise};
