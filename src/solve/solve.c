// SPDX-License-Identifier: MIT
//
// What all methods share: options, the solver object, and what comes before and after the
// iteration. Before: the system is checked, scaled by a power of two (which rounds nothing) and its
// 2x2 diagonal blocks are inverted. After: the result is judged by its true residual and written
// back. Wrong systems end with a report that names the row; the iteration never sees them.

#include "barrier.h"
#include "direct.h"
#include "gauss.h"

#include <math.h>
#include <string.h>

// Below this many rows one thread is fastest on any machine; above it the pace decides.
#define ROWS_FOR_THREADS 1000

// A diagonal block whose second pivot is below this part of its diagonal counts as singular.
#define SINGULAR 1e-14

// Rows of the matrix that a thread looks at at a time.
#define ROWS_AT_A_TIME 256

nmm_solve_options nmm_default_solve_options(void) {
    return (nmm_solve_options){
        .method = NMM_SOLVE_AUTO, .precision = NMM_PRECISION_AUTO, .tolerance = 1e-8};
}

const char *const nmm_solve_method_word[] = {[NMM_SOLVE_AUTO] = "auto",
                                             [NMM_SOLVE_JACOBI] = "jacobi",
                                             [NMM_SOLVE_PCG] = "pcg",
                                             [NMM_SOLVE_SOR] = "sor",
                                             [NMM_SOLVE_GAUSS_SEIDEL] = "gauss-seidel",
                                             [NMM_SOLVE_CHEBYSHEV] = "chebyshev",
                                             [NMM_SOLVE_DIRECT] = "direct",
                                             NULL};

const char *const nmm_solve_blocks_word[] = {[NMM_BLOCKS_AUTO] = "auto",
                                             [NMM_BLOCKS_COVER] = "cover",
                                             [NMM_BLOCKS_CLUSTER] = "cluster",
                                             [NMM_BLOCKS_BODY] = "body",
                                             NULL};

const char *const nmm_solve_precision_word[] = {[NMM_PRECISION_DOUBLE] = "double",
                                                [NMM_PRECISION_MIXED] = "mixed",
                                                [NMM_PRECISION_AUTO] = "auto",
                                                NULL};

const char *nmm_solve_method_name(nmm_solve_method method) {
    const bool known = (int)method >= NMM_SOLVE_AUTO && (int)method <= NMM_SOLVE_DIRECT;
    return known ? nmm_solve_method_word[method] : "unknown";
}

const char *nmm_solve_blocks_name(nmm_solve_blocks blocks) {
    const bool known = (int)blocks >= NMM_BLOCKS_AUTO && (int)blocks <= NMM_BLOCKS_BODY;
    return known ? nmm_solve_blocks_word[blocks] : "unknown";
}

const char *nmm_solve_end_name(nmm_solve_end end) {
    switch (end) {
    case NMM_SOLVE_CONVERGED:
        return "converged";
    case NMM_SOLVE_DIVERGED:
        return "diverged";
    case NMM_SOLVE_TOO_SLOW:
        return "not converged within the allowed iterations";
    case NMM_SOLVE_INDEFINITE:
        return "matrix not positive definite";
    case NMM_SOLVE_NOT_FINITE:
        return "matrix or right-hand side not finite";
    case NMM_SOLVE_STAGNATED:
        return "stagnated above the tolerance (rounding, or singular)";
    case NMM_SOLVE_BAD_PATTERN:
        return "matrix pattern broken";
    case NMM_SOLVE_OUT_OF_RANGE:
        return "the solution is beyond the range of numbers";
    }
    return "unknown";
}

// --- The object

nmm_status nmm_solver_create(nmm_context *context, nmm_solver **solver, int max_row, int max_block,
                             bool staged) {
    *solver = NULL;
    if (max_row < 0 || max_block < 0) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT, "solver opened for %d rows and %d blocks",
                        max_row, max_block);
    }
    TRY(nmm_allocate(context, solver, 1, sizeof **solver));
    nmm_solver *s = *solver;
    s->max_row = max_row;
    s->max_block = max_block;
    s->max_n = nmm_clusters_room(max_row);
    s->staged = staged;
    const size_t n = (size_t)s->max_n, n_group = n / NMM_GROUP;
    nmm_wide *w = &s->wide;
    double **const vector[] = {&w->f, &w->u, &w->r, &w->p, &w->q, &w->z};
    for (size_t k = 0; k < sizeof vector / sizeof *vector; k++)
        TRY(nmm_allocate(context, vector[k], n, 2 * sizeof(double)));
    TRY(nmm_allocate(context, &w->inverse, n, 4 * sizeof(double)));
    TRY(nmm_allocate(context, &s->next, (size_t)max_row, sizeof(int)));
    TRY(nmm_allocate(context, &s->part, n_group, 2 * sizeof(double)));
    TRY(nmm_allocate(context, &s->chunk, n_group / NMM_SOLVE_CHUNK + 1, 2 * sizeof(double)));
    TRY(nmm_allocate(context, &s->state, 1, sizeof *s->state));
    TRY(nmm_allocate(context, &s->barrier, 1, sizeof *s->barrier));
    TRY(nmm_allocate(context, &s->traffic, 1, sizeof *s->traffic));
    if (!staged) return NMM_OK;
    TRY(nmm_allocate(context, &s->newer_row, n, 1));
    return nmm_solver_own_matrix(context, s);
}

nmm_status nmm_solver_own_matrix(nmm_context *context, nmm_solver *s) {
    if (s->own_value != NULL) return NMM_OK;
    const size_t n_block = (size_t)nmm_max_int(s->max_block, 1);
    if (s->own_row_start == NULL) {
        TRY(nmm_allocate(context, &s->own_row_start, (size_t)s->max_n + 1, sizeof(int)));
    }
    if (s->own_col == NULL) TRY(nmm_allocate(context, &s->own_col, n_block, sizeof(int)));
    return nmm_allocate(context, &s->own_value, n_block, 4 * sizeof(double));
}

nmm_status nmm_solver_own_narrow(nmm_context *context, nmm_solver *s) {
    if (s->narrow.value != NULL) return NMM_OK;
    const size_t n = (size_t)s->max_n, n_block = (size_t)nmm_max_int(s->max_block, 1);
    nmm_narrow *w = &s->narrow;
    float **const vector[] = {&w->f, &w->u, &w->r, &w->p, &w->q, &w->z};
    for (size_t k = 0; k < sizeof vector / sizeof *vector; k++)
        if (*vector[k] == NULL) TRY(nmm_allocate(context, vector[k], n, 2 * sizeof(float)));
    if (w->inverse == NULL) TRY(nmm_allocate(context, &w->inverse, n, 4 * sizeof(float)));
    return nmm_allocate(context, &w->value, n_block, 4 * sizeof(float));
}

nmm_status nmm_solver_own_dense(nmm_context *context, nmm_solver *s) {
    if (s->dense_room != NULL) return NMM_OK;
    const size_t n_group = (size_t)s->max_n / NMM_GROUP;
    if (s->dense_scale == NULL) {
        TRY(nmm_allocate(context, &s->dense_scale, n_group, sizeof(double)));
    }
    return nmm_allocate(context, &s->dense_room, n_group,
                        NMM_GROUP_UNKNOWNS * NMM_GROUP_UNKNOWNS * sizeof(float));
}

void nmm_solver_destroy(nmm_context *context, nmm_solver **solver) {
    nmm_solver *s = *solver;
    if (s == NULL) return;
    nmm_wide *w = &s->wide;
    nmm_narrow *v = &s->narrow;
    double **const wide[] = {&w->f,       &w->u,    &w->r,     &w->p,           &w->q,        &w->z,
                             &w->inverse, &s->part, &s->chunk, &s->dense_scale, &s->own_value};
    for (size_t k = 0; k < sizeof wide / sizeof *wide; k++)
        nmm_release(context, wide[k]);
    float **const narrow[] = {&v->f, &v->u,       &v->r,     &v->p,         &v->q,
                              &v->z, &v->inverse, &v->value, &s->dense_room};
    for (size_t k = 0; k < sizeof narrow / sizeof *narrow; k++)
        nmm_release(context, narrow[k]);
    nmm_release(context, &s->state);
    nmm_release(context, &s->barrier);
    nmm_release(context, &s->traffic);
    nmm_release(context, &s->next);
    nmm_release(context, &s->own_row_start);
    nmm_release(context, &s->own_col);
    nmm_release(context, &s->newer_row);
    nmm_clusters_destroy(context, &s->clusters);
    nmm_coarse_destroy(context, &s->coarse);
    nmm_direct_destroy(context, &s->direct);
    nmm_gauss_destroy(context, &s->gauss);
    nmm_release(context, solver);
}

// --- Options and sizes

static int chosen_iterations(nmm_solve_method method, int n_row) {
    const bool pcg = method == NMM_SOLVE_PCG;
    const long some = 10 * (long)n_row + 1000;
    const long most = pcg ? 20000 : 200000;
    const long wanted = pcg ? some : 100 * some;
    return (int)(wanted < most ? wanted : most);
}

// Every 0 by what it stands for.
static nmm_solve_options complete_options(const nmm_context *context, bool staged,
                                          const nmm_solve_options *options, int n_row) {
    nmm_solve_options o = *options;
    if (o.method == NMM_SOLVE_AUTO) o.method = NMM_SOLVE_PCG;
    if (o.blocks == NMM_BLOCKS_AUTO) {
        const bool dense = o.method == NMM_SOLVE_PCG || o.method == NMM_SOLVE_CHEBYSHEV;
        o.blocks = dense ? NMM_BLOCKS_CLUSTER : NMM_BLOCKS_COVER;
    }
    const bool sweeps = o.method == NMM_SOLVE_JACOBI || o.method == NMM_SOLVE_CHEBYSHEV;
    if (!sweeps && o.method != NMM_SOLVE_PCG) o.blocks = NMM_BLOCKS_COVER;
    // The coarse correction is one of conjugate gradients on the host, and needs places and bodies.
    const bool coarse = o.method == NMM_SOLVE_PCG && !staged && o.place != NULL && o.body != NULL;
    if (o.blocks == NMM_BLOCKS_BODY && !coarse) o.blocks = NMM_BLOCKS_CLUSTER;
    const bool narrow = sweeps || o.method == NMM_SOLVE_PCG;
    if (!narrow || o.precision == NMM_PRECISION_AUTO) o.precision = NMM_PRECISION_DOUBLE;
    if (o.sor_factor == 0) o.sor_factor = 1.9;
    if (o.method == NMM_SOLVE_GAUSS_SEIDEL) o.sor_factor = 1;
    if (o.max_iterations == 0) o.max_iterations = chosen_iterations(o.method, n_row);
    if (o.n_thread == 0) o.n_thread = nmm_max_int(context->n_thread, 1);
    return o;
}

static bool has_avx2(void) {
#if defined(__x86_64__)
    return __builtin_cpu_supports("avx2");
#else
    return false;
#endif
}

void nmm_solver_use_threads(nmm_solver *solver, int n_thread) {
    const bool wide = has_avx2();
    solver->n_thread = n_thread;
    if (n_thread > 1) {
        solver->variant = wide ? &nmm_variant_threads_avx2 : &nmm_variant_threads;
    } else {
        solver->variant = wide ? &nmm_variant_serial_avx2 : &nmm_variant_serial;
    }
}

// Why clusters are taken where bodies were asked for.
static const char *why_not_body(const nmm_solver *solver, const nmm_solve_options *options) {
    if (options->blocks != NMM_BLOCKS_BODY || solver->options.blocks != NMM_BLOCKS_CLUSTER) {
        return "";
    }
    if (solver->options.method != NMM_SOLVE_PCG) return "clusters: blocks body are for pcg";
    if (solver->staged) return "clusters: blocks body run on the host only";
    return "clusters: blocks body need places and bodies of the rows";
}

nmm_status nmm_solver_prepare(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                              bool keep_pattern, const nmm_solve_options *options) {
    const int n_block = K->n_row > 0 ? K->row_start[K->n_row] : 0;
    solver->options = complete_options(context, solver->staged, options, K->n_row);
    const nmm_solve_blocks blocks = solver->options.blocks;
    const bool reordered = blocks >= NMM_BLOCKS_CLUSTER;
    const bool was_reordered = solver->blocks >= NMM_BLOCKS_CLUSTER;
    const bool kept = nmm_solver_keeps(solver, K, keep_pattern);
    solver->pattern_kept = kept && reordered == was_reordered;
    if (!kept) solver->clusters_found = solver->parts_found = false;
    if (!kept || !options->reuse) solver->dense_made = solver->coarse_made = false;
    solver->blocks = blocks;
    solver->why_blocks = why_not_body(solver, options);
    solver->n_row = K->n_row;
    solver->n_block = n_block;
    nmm_solver_use_threads(solver, K->n_row < ROWS_FOR_THREADS ? 1 : solver->options.n_thread);
    if (solver->options.precision == NMM_PRECISION_MIXED) {
        TRY(nmm_solver_own_narrow(context, solver));
    }
    if (!reordered) return NMM_OK;
    TRY(nmm_solver_own_dense(context, solver));
    return nmm_solver_own_matrix(context, solver);
}

// --- Numbers of the system

// Sum of 0 * x over the blocks of a row: 0, or NaN when one number is not finite.
static double not_finite(const nmm_bsr *K, int row) {
    double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++) {
        const double *v = K->value + 4 * (long)k;
        s0 += 0 * v[0];
        s1 += 0 * v[1];
        s2 += 0 * v[2];
        s3 += 0 * v[3];
    }
    return (s0 + s1) + (s2 + s3);
}

// Inverse of a block by two pivots, so that no product over- or underflows; false: not positive.
static bool invert_block(const double *v, double *inverse) {
    const double left = v[2] / v[0], up = v[1] / v[0];
    const double pivot = v[3] - left * v[1];
    if (!(v[0] > 0 && pivot > SINGULAR * v[3])) return false;
    inverse[3] = 1 / pivot;
    inverse[1] = -up * inverse[3];
    inverse[2] = -left * inverse[3];
    inverse[0] = 1 / v[0] - up * inverse[2];
    return 0 * (inverse[0] + inverse[3]) == 0;
}

// Has a block an inverse for sure? Without divisions; not told for numbers of extreme size.
static bool is_surely_positive(const double *v) {
    const double product = v[0] * v[3];
    const bool ordinary = v[0] > 1e-120 && v[0] < 1e120 && v[3] > 1e-120 && v[3] < 1e120;
    return ordinary && product - v[1] * v[2] > 2 * SINGULAR * product;
}

// Lowest troubled row of each kind; n_row: none.
typedef struct trouble {
    int infinite, indefinite;
} trouble;

static trouble take_rows_between(const nmm_solver *s, const nmm_bsr *K, bool all, int first,
                                 int end) {
    trouble t = {K->n_row, K->n_row};
    for (int at = first; at < end; at++) {
        const int row = nmm_solver_row(s, at);
        double not_kept[4], *inverse = all ? s->wide.inverse + 4 * (long)at : not_kept;
        if (row < 0) {
            memset(inverse, 0, 4 * sizeof(double));
            continue;
        }
        const double *block = K->value + 4 * (long)K->diagonal[row];
        if (!all && is_surely_positive(block)) continue;
        if (all && not_finite(K, row) != 0) t.infinite = nmm_min_int(t.infinite, row);
        if (!invert_block(block, inverse)) t.indefinite = nmm_min_int(t.indefinite, row);
    }
    return t;
}

// One pass over the matrix, or over its diagonal alone: for a method that does without the inverses
// and ends with a residual in which each number of the matrix has its part.
static nmm_solve_end take_rows(nmm_solver *s, const nmm_bsr *K, bool all, int *row_of_trouble) {
    const int n_piece = (s->n + ROWS_AT_A_TIME - 1) / ROWS_AT_A_TIME;
    int infinite = K->n_row, indefinite = K->n_row;
    if (s->n_thread == 1) {
        const trouble t = take_rows_between(s, K, all, 0, s->n);
        infinite = t.infinite;
        indefinite = t.indefinite;
    } else {
#pragma omp parallel for num_threads(s->n_thread) schedule(static)                                 \
    reduction(min                                                                                  \
              : infinite, indefinite)
        for (int k = 0; k < n_piece; k++) {
            const int first = k * ROWS_AT_A_TIME, end = nmm_min_int(first + ROWS_AT_A_TIME, s->n);
            const trouble t = take_rows_between(s, K, all, first, end);
            infinite = nmm_min_int(infinite, t.infinite);
            indefinite = nmm_min_int(indefinite, t.indefinite);
        }
    }
    *row_of_trouble = infinite < K->n_row ? infinite : indefinite;
    if (infinite < K->n_row) return NMM_SOLVE_NOT_FINITE;
    return indefinite < K->n_row ? NMM_SOLVE_INDEFINITE : NMM_SOLVE_CONVERGED;
}

// --- First guess

double nmm_solver_first_norm(nmm_solver *solver, const double *u,
                             double (*true_norm)(const nmm_solver *)) {
    nmm_solver_load_guess(solver, u);
    double norm = true_norm(solver);
    if (!(norm <= NMM_GUESS_MARGIN * solver->norm)) {
        solver->guess_dropped = true;
        memset(solver->wide.u, 0, 2 * (size_t)solver->n_row * sizeof(double));
        norm = true_norm(solver);
    }
    solver->guess_norm = norm;
    return norm;
}

// --- The matrix

// The pattern: a pointer to the caller's, a copy, or a copy in the order of the clusters.
static nmm_status take_pattern(nmm_context *context, nmm_solver *s, const nmm_bsr *K) {
    const bool reordered = s->blocks >= NMM_BLOCKS_CLUSTER;
    s->dense = reordered ? s->dense_room : NULL;
    if (!reordered && !s->staged) {
        s->row_start = K->row_start;
        s->col = K->col;
        s->n = K->n_row;
        return NMM_OK;
    }
    s->row_start = s->own_row_start;
    s->col = s->own_col;
    if (reordered) {
        const bool known = s->clusters_found;
        if (!known) TRY(nmm_clusters_find(context, &s->clusters, K));
        s->clusters_found = true;
        s->n = s->clusters.n_group * NMM_GROUP;
        if (!known || !s->pattern_kept) {
            nmm_clusters_pattern(&s->clusters, K, s->row_start, s->col);
        }
        return NMM_OK;
    }
    s->n = K->n_row;
    if (s->pattern_kept) return NMM_OK;
    memcpy(s->row_start, K->row_start, ((size_t)K->n_row + 1) * sizeof(int));
    memcpy(s->col, K->col, (size_t)s->n_block * sizeof(int));
    return NMM_OK;
}

static void take_values(nmm_solver *s, const nmm_bsr *K) {
    const bool reordered = s->blocks >= NMM_BLOCKS_CLUSTER;
    s->wide.value = reordered || s->staged ? s->own_value : K->value;
    if (s->staged)
        nmm_newer_take(s, K);
    else if (reordered)
        nmm_clusters_take(&s->clusters, K, s->n_thread, s->wide.value);
}

// Float32 copies; false where a number is beyond float32, squares of quotients included.
static bool take_narrow(nmm_solver *s) {
    const long n_value = 4 * (long)s->n_block, n_inverse = 4 * (long)s->n;
    const double *value = s->wide.value, *inverse = s->wide.inverse;
    float *narrow_value = s->narrow.value, *narrow_inverse = s->narrow.inverse;
    double largest = 0;
    const int n_thread = s->n_thread;
#pragma omp parallel for num_threads(n_thread) schedule(static)                                    \
    reduction(max                                                                                  \
              : largest) if (n_thread > 1)
    for (long k = 0; k < n_value; k++) {
        narrow_value[k] = (float)value[k];
        largest = nmm_max(largest, fabs(value[k]));
    }
    for (long k = 0; k < n_inverse; k++) {
        narrow_inverse[k] = (float)inverse[k];
        largest = nmm_max(largest, fabs(inverse[k]));
    }
    return largest < 1e25;
}

static bool dense_fits(const nmm_solver *s) {
    for (int g = 0; g < s->clusters.n_group; g++)
        if (s->dense_scale[g] == 0) return false;
    return true;
}

// Inverted clusters and coarse factor, where there are none to reuse.
static nmm_status make_blocks(nmm_context *context, nmm_solver *s, nmm_solve_report *report) {
    if (s->blocks < NMM_BLOCKS_CLUSTER) return NMM_OK;
    const int made = s->variant->invert(&s->clusters, s->row_start, s->col, s->wide.value,
                                        s->n_thread, s->dense_made, s->dense_room, s->dense_scale);
    s->dense_made = true;
    report->setups += made > 0;
    if (!dense_fits(s)) {
        s->dense = NULL;
        report->why = "2x2 blocks, because rows of a cluster differ too much in scale for float32";
    }
    // Springs that closed or opened change the coarse system as well.
    if (made > 0) s->coarse_made = false;
    if (s->blocks < NMM_BLOCKS_BODY || s->coarse_made) return NMM_OK;
    const nmm_coarse_source source = {.n = s->n,
                                      .n_thread = s->n_thread,
                                      .row_start = s->row_start,
                                      .col = s->col,
                                      .value = s->wide.value,
                                      .order = s->clusters.order,
                                      .place = s->options.place,
                                      .body = s->options.body};
    if (!s->parts_found) TRY(nmm_coarse_divide(context, &s->coarse, &source));
    s->parts_found = true;
    s->variant->make_coarse(&s->coarse, &source);
    s->coarse_made = true;
    report->setups += 1;
    return NMM_OK;
}

// --- Before and after

static void end_early(nmm_solver *s, nmm_solve_report *report, nmm_solve_end end, int row) {
    report->end = end;
    report->row = row;
    // What was sent before cannot be trusted to match what comes next.
    s->n_row = -1;
}

bool nmm_solver_check_numbers(nmm_solver *solver, const nmm_bsr *K, nmm_solve_report *report) {
    int row = -1;
    if (take_rows(solver, K, true, &row) != NMM_SOLVE_NOT_FINITE) return true;
    report->setups = report->iterations = 0;
    end_early(solver, report, NMM_SOLVE_NOT_FINITE, row);
    return false;
}

nmm_status nmm_solver_start(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                            const double *f, double *u, nmm_solve_report *report, bool *ready) {
    *report = (nmm_solve_report){.method = solver->options.method,
                                 .blocks = solver->blocks,
                                 .precision = solver->options.precision,
                                 .n_thread = solver->n_thread,
                                 .why = solver->why_blocks,
                                 .row = -1,
                                 .residual = -1};
    *ready = false;
    solver->guess_dropped = false;
    memset(solver->state, 0, sizeof *solver->state);
    if (K->n_row > 0 && !(solver->pattern_kept || solver->clusters_found)) {
        const int row = nmm_solver_bad_row(K, solver->n_block, solver->next);
        if (row >= 0) {
            end_early(solver, report, NMM_SOLVE_BAD_PATTERN, row);
            return NMM_OK;
        }
    }
    TRY(take_pattern(context, solver, K));
    const int row_of_f = nmm_solver_take_force(solver, f);
    int row = -1;
    if (row_of_f >= 0) {
        end_early(solver, report, NMM_SOLVE_NOT_FINITE, row_of_f);
        return NMM_OK;
    }
    // No load, no displacement, if the matrix holds numbers.
    if (solver->norm == 0) {
        if (!nmm_solver_check_numbers(solver, K, report)) return NMM_OK;
        for (int i = 0; i < 2 * K->n_row; i++)
            u[i] = 0;
        report->residual = 0;
        end_early(solver, report, NMM_SOLVE_CONVERGED, -1);
        return NMM_OK;
    }
    const bool all = solver->options.method != NMM_SOLVE_DIRECT && !solver->without_inverses;
    nmm_solve_end end = take_rows(solver, K, all, &row);
    // What is not finite is named first.
    if (end != NMM_SOLVE_CONVERGED && !all) end = take_rows(solver, K, true, &row);
    if (end != NMM_SOLVE_CONVERGED) {
        end_early(solver, report, end, row);
        return NMM_OK;
    }
    const double least = nmm_solver_least_norm(solver, K);
    solver->least = least > solver->limit ? least : 0;
    if (least > solver->limit) {
        solver->limit = least;
        report->why = "loads so small that displacements are next to the smallest number";
    }
    take_values(solver, K);
    if (report->precision == NMM_PRECISION_MIXED && !take_narrow(solver)) {
        report->precision = NMM_PRECISION_DOUBLE;
        report->fell_back = true;
        report->why = "numbers beyond float32";
    }
    TRY(make_blocks(context, solver, report));
    *ready = true;
    return NMM_OK;
}

void nmm_solver_finish(nmm_solver *solver, double norm, double *u, nmm_solve_report *report) {
    report->residual = nmm_max(norm, nmm_min(solver->least, solver->norm)) / solver->norm;
    const bool kept = solver->options.keep_last || report->end == NMM_SOLVE_CONVERGED;
    if (kept || norm <= solver->guess_norm) {
        if (nmm_solver_write_back(solver, u)) return;
        report->end = NMM_SOLVE_OUT_OF_RANGE;
    }
    // Failed and worse than the first guess: that is still in u, unless zero was better than it.
    report->residual = solver->guess_norm / solver->norm;
    for (int i = 0; solver->guess_dropped && i < 2 * solver->n_row; i++)
        u[i] = 0;
}
