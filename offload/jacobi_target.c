// SPDX-License-Identifier: MIT
//
// The target backend: the kernel text of src/solve with `omp target`, one launch for each kernel,
// and where the data live. The solver's arrays are mapped from open to close, or from the first
// solve that needs them; a solve sends the values, the right-hand side and, when they changed, the
// pattern and the clusters, and fetches the scalars every few iterations and the result at the end.
// Whether a device does the work is asked inside a kernel: OpenMP runs target regions on the host
// without a word where there is no device.

#define TRANSFER_BASE 0

#include "choose.h"
#include "sweeps.h"
#include "target.h"

#include <math.h>
#include <omp.h>
#include <string.h>

// Up to so many rows one team does a whole batch; more rows keep all teams busy. An estimate: see
// docs/offload.md.
#define TEAM_ROWS 4000

#define PARALLEL_FOR _Pragma("omp target teams distribute parallel for")
#define SINGLE _Pragma("omp target")
#define JOIN
#define BATCH GUARDED
#define ON_DEVICE (!omp_is_initial_device())

#include "../src/solve/jacobi_scalars.inl"

#define REAL double
#define ARRAYS wide
#define NAME(x) x##_wide
#include "../src/solve/jacobi_kernels.inl"
#undef REAL
#undef ARRAYS
#undef NAME

#define REAL float
#define ARRAYS narrow
#define NAME(x) x##_narrow
#include "../src/solve/jacobi_kernels.inl"
#undef REAL
#undef ARRAYS
#undef NAME

#include "../src/solve/jacobi_methods.inl"

double nmm_target_launches(nmm_solver *solver, const double *u, nmm_solve_report *report) {
    return run_method(solver, u, report);
}

// --- Devices

// True where a target region sent to `device` runs on something that is not the host.
static bool device_runs(int device) {
    int elsewhere = 0;
#pragma omp target map(from : elsewhere) device(device)
    elsewhere = !omp_is_initial_device();
    return elsewhere != 0;
}

int nmm_solve_target_devices(void) {
    int count = 0;
    for (int device = 0; device < omp_get_num_devices(); device++)
        count += device_runs(device);
    return count;
}

// --- Data

static void map_arrays(const nmm_solver *s) {
    const long n = s->max_n, n_block = nmm_max_int(s->max_block, 1), n_group = n / NMM_GROUP;
    MAP(s, 1);
    MAP(s->own_row_start, n + 1);
    MAP(s->own_col, n_block);
    MAP(s->own_value, 4 * n_block);
    MAP(s->wide.inverse, 4 * n);
    MAP(s->wide.f, 2 * n);
    MAP(s->wide.u, 2 * n);
    MAP(s->wide.r, 2 * n);
    MAP(s->wide.p, 2 * n);
    MAP(s->wide.q, 2 * n);
    MAP(s->wide.z, 2 * n);
    MAP(s->part, 2 * n_group);
    MAP(s->chunk, 2 * (n_group / NMM_SOLVE_CHUNK + 1));
    MAP(s->state, 1);
}

static void unmap_arrays(const nmm_solver *s) {
    const long n = s->max_n, n_block = nmm_max_int(s->max_block, 1), n_group = n / NMM_GROUP;
    UNMAP(s, 1);
    UNMAP(s->own_row_start, n + 1);
    UNMAP(s->own_col, n_block);
    UNMAP(s->own_value, 4 * n_block);
    UNMAP(s->wide.inverse, 4 * n);
    UNMAP(s->wide.f, 2 * n);
    UNMAP(s->wide.u, 2 * n);
    UNMAP(s->wide.r, 2 * n);
    UNMAP(s->wide.p, 2 * n);
    UNMAP(s->wide.q, 2 * n);
    UNMAP(s->wide.z, 2 * n);
    UNMAP(s->part, 2 * n_group);
    UNMAP(s->chunk, 2 * (n_group / NMM_SOLVE_CHUNK + 1));
    UNMAP(s->state, 1);
}

static void map_dense(const nmm_solver *s) {
    const long n_group = s->max_n / NMM_GROUP;
    MAP(s->dense_room, n_group * NMM_GROUP_UNKNOWNS * NMM_GROUP_UNKNOWNS);
    MAP(s->dense_scale, n_group);
}

static void unmap_dense(const nmm_solver *s) {
    const long n_group = s->max_n / NMM_GROUP;
    UNMAP(s->dense_room, n_group * NMM_GROUP_UNKNOWNS * NMM_GROUP_UNKNOWNS);
    UNMAP(s->dense_scale, n_group);
}

static void map_narrow(const nmm_solver *s) {
    const long n = s->max_n, n_block = nmm_max_int(s->max_block, 1);
    MAP(s->narrow.value, 4 * n_block);
    MAP(s->narrow.inverse, 4 * n);
    MAP(s->narrow.f, 2 * n);
    MAP(s->narrow.u, 2 * n);
    MAP(s->narrow.r, 2 * n);
    MAP(s->narrow.p, 2 * n);
    MAP(s->narrow.q, 2 * n);
    MAP(s->narrow.z, 2 * n);
}

static void unmap_narrow(const nmm_solver *s) {
    const long n = s->max_n, n_block = nmm_max_int(s->max_block, 1);
    UNMAP(s->narrow.value, 4 * n_block);
    UNMAP(s->narrow.inverse, 4 * n);
    UNMAP(s->narrow.f, 2 * n);
    UNMAP(s->narrow.u, 2 * n);
    UNMAP(s->narrow.r, 2 * n);
    UNMAP(s->narrow.p, 2 * n);
    UNMAP(s->narrow.q, 2 * n);
    UNMAP(s->narrow.z, 2 * n);
}

// --- The backend

static void close_target(nmm_context *context, nmm_solver **solver) {
    nmm_solver *s = *solver;
    if (s != NULL) {
        if (s->dense_mapped) unmap_dense(s);
        if (s->narrow_mapped) unmap_narrow(s);
        unmap_arrays(s);
    }
    nmm_solver_destroy(context, solver);
}

static nmm_status run_target(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                             const double *f, double *u, bool keep_pattern,
                             const nmm_solve_options *options, nmm_solve_report *report) {
    const nmm_solve_method asked = options->method;
    if (asked == NMM_SOLVE_SOR || asked == NMM_SOLVE_GAUSS_SEIDEL || asked == NMM_SOLVE_DIRECT) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT, "solver method %s runs on the host only",
                        nmm_solve_method_name(asked));
    }
    TRY(nmm_solver_prepare(context, solver, K, keep_pattern, options));
    // What this solve is the first to need.
    if (solver->dense_room != NULL && !solver->dense_mapped) map_dense(solver);
    solver->dense_mapped = solver->dense_room != NULL;
    if (solver->narrow.value != NULL && !solver->narrow_mapped) map_narrow(solver);
    solver->narrow_mapped = solver->narrow.value != NULL;
    bool ready = false;
    TRY(nmm_solver_start(context, solver, K, f, u, report, &ready));
    if (!ready) return NMM_OK;
    const bool team = solver->n <= solver->team_rows;
    const double norm =
        team ? nmm_target_team(solver, u, report) : nmm_target_launches(solver, u, report);
    nmm_solver_finish(solver, norm, u, report);
    return NMM_OK;
}

static nmm_status open_target(nmm_context *context, nmm_solver **solver, int max_row,
                              int max_block) {
    *solver = NULL;
    if (omp_get_num_devices() == 0 || !device_runs(omp_get_default_device())) {
        return nmm_fail(context, NMM_ERROR_DEVICE, "no device runs a target region (%d named)",
                        omp_get_num_devices());
    }
    const nmm_status status = nmm_solver_create(context, solver, max_row, max_block, true);
    if (status != NMM_OK) {
        nmm_solver_destroy(context, solver);
        return status;
    }
    (*solver)->team_rows = TEAM_ROWS;
    (*solver)->run = run_target;
    map_arrays(*solver);
    return NMM_OK;
}

static nmm_status solve_target(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                               const double *f, double *u, bool keep_pattern,
                               const nmm_solve_options *options, nmm_solve_report *report) {
    if (nmm_solver_chooses(options)) {
        return nmm_choose_blocks(context, solver, K, f, u, keep_pattern, options, report);
    }
    return run_target(context, solver, K, f, u, keep_pattern, options, report);
}

const nmm_solve_backend *nmm_solve_target(void) {
    static const nmm_solve_backend target = {
        .name = "target", .open = open_target, .solve = solve_target, .close = close_target};
    return &target;
}

#ifdef NMM_TRANSFER_TEST
int nmm_transfer_count(void) {
    return __COUNTER__;
}
#endif
