// SPDX-License-Identifier: MIT
//
// The whole Jacobi family, put together: scalars, the kernels in float64 and in float32, methods.
// The includer defines the words of jacobi_kernels.inl but REAL, ARRAYS and NAME.

#include "jacobi_scalars.inl"

// Rows whose matrix fits into a cache, about; beyond, numbers of it that are fetched ahead, and
// rows of vectors. Numbers of dense blocks always are.
#define ROWS_IN_CACHE 30000
#define AHEAD 1024
#define ROWS_AHEAD 32
#define INVERSE_AHEAD 256
#define DENSE_AHEAD 1024

// The last row, where the matrix does not fit into a cache, else 0.
static inline int far_row(int n) {
    return n > ROWS_IN_CACHE ? n - 1 : 0;
}

static nmm_solve_end end_of_sweeps(const nmm_solver *s, const sweeps *plan, sweeps_verdict verdict,
                                   double norm, bool wide);

#define REAL double
#define ARRAYS wide
#define NAME(x) x##_wide
#include "jacobi_kernels.inl"
#undef REAL
#undef ARRAYS
#undef NAME

#define REAL float
#define ARRAYS narrow
#define NAME(x) x##_narrow
#include "jacobi_kernels.inl"
#undef REAL
#undef ARRAYS
#undef NAME

#include "jacobi_methods.inl"
