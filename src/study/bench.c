// SPDX-License-Identifier: MIT
//
// Life of an experiment: its settings are checked, it measures, it is asked for rows, files and
// pictures.

#include "bench.h"

#include <math.h>
#include <omp.h>
#include <string.h>

// In the order in which `all` measures them.
static const nmm_bench_kind *kind_at(int k) {
    switch (k) {
    case 0:
        return &nmm_bench_table1;
    case 1:
        return &nmm_bench_fig6;
    case 2:
        return &nmm_bench_fig7;
    case 3:
        return &nmm_bench_contact;
    case 4:
        return &nmm_bench_wall;
    case 5:
        return &nmm_bench_growth;
    case 6:
        return &nmm_bench_only;
    default:
        return NULL;
    }
}

nmm_bench_name nmm_bench_list(int k) {
    const nmm_bench_kind *kind = kind_at(k);
    return kind != NULL ? kind->name : (nmm_bench_name){0};
}

nmm_bench_def nmm_default_bench_def(void) {
    return (nmm_bench_def){.device = NMM_DEVICE_CHOOSE};
}

// --- Settings

void nmm_bench_take_kind(nmm_bench *bench, const nmm_bench_kind *kind) {
    bench->kind = kind;
    while (kind->column[bench->n_column].name != NULL)
        bench->n_column += 1;
    NMM_ASSERT(bench->n_column <= NMM_BENCH_COLUMNS);
}

static nmm_status find_kind(nmm_bench *bench) {
    char list[128] = "";
    for (int k = 0; kind_at(k) != NULL; k++) {
        const char *name = kind_at(k)->name.name;
        if (bench->def.name != NULL && strcmp(name, bench->def.name) == 0) bench->kind = kind_at(k);
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", k > 0 ? ", " : "", name);
    }
    if (bench->kind == NULL) {
        return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT, "no experiment '%s'; there are %s",
                        bench->def.name != NULL ? bench->def.name : "", list);
    }
    nmm_bench_take_kind(bench, bench->kind);
    return NMM_OK;
}

static nmm_status take_threads(nmm_bench *bench) {
    const nmm_bench_def *def = &bench->def;
    const int all = nmm_max_int(1, omp_get_max_threads());
    const int chosen[2] = {1, all};
    const int *thread = def->n_thread > 0 ? def->thread : chosen;
    const int n = def->n_thread > 0 ? def->n_thread : all > 1 ? 2 : 1;
    for (int i = 0; i < n; i++) {
        if (thread[i] < 1 || n > NMM_BENCH_THREADS) {
            return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT,
                            "%d numbers of threads, one of them %d: there must be at most %d, each "
                            "at least 1",
                            n, thread[i], NMM_BENCH_THREADS);
        }
        // In order, each once.
        int at = bench->n_thread;
        while (at > 0 && bench->thread[at - 1] > thread[i])
            at -= 1;
        if (at > 0 && bench->thread[at - 1] == thread[i]) continue;
        memmove(bench->thread + at + 1, bench->thread + at,
                (size_t)(bench->n_thread - at) * sizeof(int));
        bench->thread[at] = thread[i];
        bench->n_thread += 1;
    }
    return NMM_OK;
}

static nmm_status take_device(nmm_bench *bench) {
    const nmm_device_choice device = bench->def.device;
    if (device == NMM_DEVICE_HOST || device == NMM_DEVICE_SCENE) return NMM_OK;
    bench->target = nmm_solve_target() != NULL && nmm_solve_target_devices() > 0;
    if (bench->target || device == NMM_DEVICE_CHOOSE) return NMM_OK;
    return nmm_fail(&bench->context, NMM_ERROR_DEVICE, "%s",
                    nmm_solve_target() == NULL
                        ? "no target device: this build of nmm has no offload backend"
                        : "no target device: the runtime ran a target region on the host");
}

static nmm_status run(nmm_bench *bench) {
    TRY(find_kind(bench));
    TRY(take_threads(bench));
    TRY(take_device(bench));
    return bench->kind->measure(bench);
}

// --- Life

nmm_status nmm_bench_create(nmm_bench **bench, const nmm_bench_def *def) {
    // The handle itself comes from the hook too, through a context that it then takes over.
    nmm_context context = {.allocate = def->allocate, .user = def->allocate_user};
    context.n_thread = nmm_max_int(1, omp_get_max_threads());
    TRY(nmm_allocate(&context, bench, 1, sizeof **bench));
    (*bench)->context = context;
    (*bench)->def = *def;
    return NMM_OK;
}

nmm_status nmm_bench_run(nmm_bench **bench, const nmm_bench_def *def) {
    TRY(nmm_bench_create(bench, def));
    return run(*bench);
}

void nmm_bench_destroy(nmm_bench *bench) {
    if (bench == NULL) return;
    nmm_context *context = &bench->context;
    nmm_release(context, &bench->cell);
    nmm_release(context, &bench->note);
    nmm_arena_destroy(context, &bench->arena);
    nmm_context last = *context;
    nmm_release(&last, &bench);
}

const nmm_error *nmm_bench_error(const nmm_bench *bench) {
    static const nmm_error no_memory = {.status = NMM_ERROR_MEMORY, .message = "out of memory"};
    return bench != NULL ? &bench->context.error : &no_memory;
}

const char *nmm_bench_mistakes(const nmm_bench *bench) {
    return bench != NULL ? bench->mistakes : NULL;
}

int nmm_bench_stopped(const nmm_bench *bench) {
    return bench->stopped;
}

// --- Questions

nmm_bench_column nmm_bench_column_of(const nmm_bench *bench, int k) {
    return k >= 0 && k < bench->n_column ? bench->kind->column[k] : (nmm_bench_column){0};
}

int nmm_bench_rows(const nmm_bench *bench) {
    return bench->n_row;
}

static const nmm_bench_cell *find_cell(const nmm_bench *bench, int row, int column) {
    const bool there = row >= 0 && row < bench->n_row && column >= 0 && column < bench->n_column;
    return there ? &bench->cell[(long)row * bench->n_column + column] : NULL;
}

double nmm_bench_number(const nmm_bench *bench, int row, int column) {
    const nmm_bench_cell *cell = find_cell(bench, row, column);
    return cell != NULL ? cell->number : NAN;
}

const char *nmm_bench_text(const nmm_bench *bench, int row, int column) {
    const nmm_bench_cell *cell = find_cell(bench, row, column);
    return cell != NULL && cell->text != NULL ? cell->text : "";
}

const char *nmm_bench_title(const nmm_bench *bench) {
    return bench->kind != NULL ? bench->kind->title : "";
}

const char *nmm_bench_note(const nmm_bench *bench, int k) {
    return k >= 0 && k < bench->n_note ? bench->note[k] : NULL;
}

nmm_status nmm_bench_plot(nmm_bench *bench, const char *path) {
    if (bench->kind == NULL || bench->n_row == 0) {
        return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT, "%s: nothing was measured to be drawn",
                        path);
    }
    return bench->kind->draw(bench, path);
}
