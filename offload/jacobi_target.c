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

#include "../src/solve/jacobi_family.inl"

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

// The arrays of a solver with their lengths, for each of which DO is said: those of every solve,
// those of clusters, those of float32.
#define ALL_ARRAYS(DO)                                                                             \
    DO(s, 1);                                                                                      \
    DO(s->own_row_start, n + 1);                                                                   \
    DO(s->own_col, n_block);                                                                       \
    DO(s->own_value, 4 * n_block);                                                                 \
    DO(s->wide.inverse, 4 * n);                                                                    \
    DO(s->wide.f, 2 * n);                                                                          \
    DO(s->wide.u, 2 * n);                                                                          \
    DO(s->wide.r, 2 * n);                                                                          \
    DO(s->wide.p, 2 * n);                                                                          \
    DO(s->wide.q, 2 * n);                                                                          \
    DO(s->wide.z, 2 * n);                                                                          \
    DO(s->part, 2 * n_group);                                                                      \
    DO(s->chunk, 2 * (n_group / NMM_SOLVE_CHUNK + 1));                                             \
    DO(s->state, 1)
#define DENSE_ARRAYS(DO)                                                                           \
    DO(s->dense_room, n_group *NMM_GROUP_UNKNOWNS *NMM_GROUP_UNKNOWNS);                            \
    DO(s->dense_scale, n_group)
#define NARROW_ARRAYS(DO)                                                                          \
    DO(s->narrow.value, 4 * n_block);                                                              \
    DO(s->narrow.inverse, 4 * n);                                                                  \
    DO(s->narrow.f, 2 * n);                                                                        \
    DO(s->narrow.u, 2 * n);                                                                        \
    DO(s->narrow.r, 2 * n);                                                                        \
    DO(s->narrow.p, 2 * n);                                                                        \
    DO(s->narrow.q, 2 * n);                                                                        \
    DO(s->narrow.z, 2 * n)

static void map_arrays(const nmm_solver *s) {
    const long n = s->max_n, n_block = nmm_max_int(s->max_block, 1), n_group = n / NMM_GROUP;
    ALL_ARRAYS(MAP);
}

// What a solve is the first to need.
static void map_more(nmm_solver *s) {
    const long n = s->max_n, n_block = nmm_max_int(s->max_block, 1), n_group = n / NMM_GROUP;
    if (s->dense_room != NULL && !s->dense_mapped) {
        DENSE_ARRAYS(MAP);
        s->dense_mapped = true;
    }
    if (s->narrow.value != NULL && !s->narrow_mapped) {
        NARROW_ARRAYS(MAP);
        s->narrow_mapped = true;
    }
}

static void unmap_all(const nmm_solver *s) {
    const long n = s->max_n, n_block = nmm_max_int(s->max_block, 1), n_group = n / NMM_GROUP;
    if (s->dense_mapped) {
        DENSE_ARRAYS(UNMAP);
    }
    if (s->narrow_mapped) {
        NARROW_ARRAYS(UNMAP);
    }
    ALL_ARRAYS(UNMAP);
}

// --- The backend

static void close_target(nmm_context *context, nmm_solver **solver) {
    if (*solver != NULL) unmap_all(*solver);
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
    map_more(solver);
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

const nmm_solve_backend *nmm_solve_target(void) {
    static const nmm_solve_backend target = {
        .name = "target", .open = open_target, .solve = nmm_solver_solve, .close = close_target};
    return &target;
}

#ifdef NMM_TRANSFER_TEST
int nmm_transfer_count(void) {
    return __COUNTER__;
}
#endif
