// SPDX-License-Identifier: MIT
//
// The target backend: the kernel text of src/solve with `omp target`, and nothing else of its own
// but where the data live. The solver's arrays are mapped from open to close; a solve sends the
// values, the right-hand side and, when it changed, the pattern, and fetches the scalars every few
// iterations and the result at the end. Whether a device does the work is asked inside a kernel:
// OpenMP runs target regions on the host without a word where there is no device.

#include "solver.h"

#include <math.h>
#include <omp.h>
#include <string.h>

// The pointer is copied first: a map of a struct's member would map the member as well; (void),
// because gcc does not count a directive as a use. Each transfer has a number, so that a test can
// leave out one of them (docs/offload.md).
#ifdef NMM_TRANSFER_TEST
#include "transfer_test.h"
#else
#define TRANSFER_MADE(number) true
#define BATCH
#endif
#define TRANSFER(directive, pointer, length)                                                       \
    do {                                                                                           \
        __typeof__(*(pointer)) *data = (pointer);                                                  \
        const long count = (length);                                                               \
        (void)data;                                                                                \
        if (TRANSFER_MADE(__COUNTER__)) {                                                          \
            directive                                                                              \
        }                                                                                          \
    } while (0)

#define PARALLEL_FOR _Pragma("omp target teams distribute parallel for")
#define SINGLE _Pragma("omp target")
#define SEND(p, n) TRANSFER(_Pragma("omp target update to(data[0 : count])"), p, n)
#define FETCH(p, n) TRANSFER(_Pragma("omp target update from(data[0 : count])"), p, n)
#define MAP(p, n) TRANSFER(_Pragma("omp target enter data map(alloc : data[0 : count])"), p, n)
#define UNMAP(p, n) TRANSFER(_Pragma("omp target exit data map(delete : data[0 : count])"), p, n)
#define ON_DEVICE (!omp_is_initial_device())

#include "../src/solve/jacobi_kernels.inl"

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
    const long n = nmm_max_int(s->max_row, 1), n_block = nmm_max_int(s->max_block, 1);
    MAP(s->row_start, n + 1);
    MAP(s->col, n_block);
    MAP(s->value, 4 * n_block);
    MAP(s->inverse, 4 * n);
    MAP(s->f, 2 * n);
    MAP(s->u, 2 * n);
    MAP(s->r, 2 * n);
    MAP(s->p, 2 * n);
    MAP(s->q, 2 * n);
    MAP(s->product, 2 * n);
    MAP(s->part, 2 * (n / NMM_SOLVE_CHUNK + 1));
    MAP(s->state, 1);
}

static void unmap_arrays(const nmm_solver *s) {
    const long n = nmm_max_int(s->max_row, 1), n_block = nmm_max_int(s->max_block, 1);
    UNMAP(s->row_start, n + 1);
    UNMAP(s->col, n_block);
    UNMAP(s->value, 4 * n_block);
    UNMAP(s->inverse, 4 * n);
    UNMAP(s->f, 2 * n);
    UNMAP(s->u, 2 * n);
    UNMAP(s->r, 2 * n);
    UNMAP(s->p, 2 * n);
    UNMAP(s->q, 2 * n);
    UNMAP(s->product, 2 * n);
    UNMAP(s->part, 2 * (n / NMM_SOLVE_CHUNK + 1));
    UNMAP(s->state, 1);
}

// --- The backend

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
    map_arrays(*solver);
    return NMM_OK;
}

static void close_target(nmm_context *context, nmm_solver **solver) {
    if (*solver != NULL) unmap_arrays(*solver);
    nmm_solver_destroy(context, solver);
}

static nmm_status solve_target(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                               const double *f, double *u, bool keep_pattern,
                               const nmm_solve_options *options, nmm_solve_report *report) {
    TRY(nmm_solver_prepare(context, solver, K, keep_pattern, options));
    const nmm_solve_method method = solver->options.method;
    if (method == NMM_SOLVE_SOR || method == NMM_SOLVE_GAUSS_SEIDEL) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT, "solver method %s runs on the host only",
                        nmm_solve_method_name(method));
    }
    if (!nmm_solver_start(solver, K, f, u, report)) return NMM_OK;
    const double norm = run_method(solver, u, report);
    nmm_solver_finish(solver, norm, u, report);
    return NMM_OK;
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
