// SPDX-License-Identifier: MIT
//
// Minimal residuals for a system with a coupling, preconditioned by one symmetric Gauss-Seidel
// sweep: x = (D + U)^-1 D y, where y leaves least of (D + L)^-1 (f - K x), after Saad and Schultz
// (1986) and Eisenstat (1981). D, L and U are of the symmetric part; rows of a body that has three
// are eliminated as one, and the coupling is in their blocks. A coupling may leave a system that no
// iteration gets far with: then this gives up after a few, says so, and is left out for some
// solves. Sweeps by lumps are in float32, the residual that counts is in float64. What always
// holds: solved means that |f - K u| was measured, the coupling included.

#include "gauss.h"

#include "direct.h"

#include <math.h>
#include <string.h>

// Part of the residual allowed at which the iteration ends: what it measures is not the true one.
#define MARGIN 0.35

// Part of the tolerance of a coupling that lumps go to.
#define CLOSER 0.3

// Gain that a round in float32 may ask for.
#define NARROW_GAIN 1e-5

// Solves that are left out after failures, at most.
#define LONGEST_PAUSE 64

// A pivot below this part of its diagonal element counts as none.
#define SINGULAR 1e-14

// Prices in nanoseconds of one core of about 3 GHz, as in choose.c.
#define PER_BLOCK 0.7   // a 2x2 block in a product, forward and backward
#define PER_ROW 50.0    // waits for the one before, twice; and its share of directions
#define PER_NARROW 0.22 // the two of lumps, in float32
#define PER_LUMP 9.0
#define TAKE_LUMPS 2.0 // by block, once
#define LESS_EXACT 8e3 // next to a factor, which leaves nothing, for the passes that this saves
#define PER_NUMBER 0.2 // of the factor, twice for each solve with it
#define PER_FAR 0.6    // the same of a factor with more numbers than CACHE, which lies in memory
#define CACHE 1e6
#define ANALYSE 30.0 // by block

// Work of a factor from which on threads share it.
#define LEAST_SHARED 1e6

// Orders of magnitude that an iteration gains where nothing is known, and solves after which that
// counts again.
#define RATE_OF_SWEEPS 0.2
#define RATE_OF_FACTOR 0.6
#define RATE_OF_KEPT 0.4
#define MEMORY 100

// --- Memory

static void release(nmm_context *context, nmm_gauss *g) {
    double **const owned[] = {&g->basis, &g->t, &g->ahead, &g->extra};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++)
        nmm_release(context, owned[k]);
    g->capacity = 0;
}

void nmm_gauss_destroy(nmm_context *context, nmm_gauss **gauss) {
    if (*gauss == NULL) return;
    release(context, *gauss);
    nmm_lumps_destroy(context, &(*gauss)->lumps);
    nmm_factor_destroy(context, &(*gauss)->factor);
    nmm_release(context, gauss);
}

static nmm_status reserve(nmm_context *context, nmm_gauss **gauss, int n_row) {
    if (*gauss == NULL) TRY(nmm_allocate(context, gauss, 1, sizeof **gauss));
    nmm_gauss *g = *gauss;
    if (n_row <= g->capacity) return NMM_OK;
    release(context, g);
    const size_t n = (size_t)n_row, pair = 2 * sizeof(double);
    TRY(nmm_allocate(context, &g->basis, n * (NMM_GAUSS_MOST + 1), pair));
    TRY(nmm_allocate(context, &g->t, n, pair));
    TRY(nmm_allocate(context, &g->ahead, n, pair));
    TRY(nmm_allocate(context, &g->extra, n, pair));
    g->capacity = n_row;
    return NMM_OK;
}

// --- Minimal residuals

// The small least squares problem: rotations that make the matrix of parts a triangle.
typedef struct triangle {
    double part[NMM_GAUSS_MOST][NMM_GAUSS_MOST + 1]; // by columns
    double cosine[NMM_GAUSS_MOST], sine[NMM_GAUSS_MOST];
    double rest[NMM_GAUSS_MOST + 1];
    int n;
} triangle;

static void rotate(triangle *r, int k) {
    double *h = r->part[k];
    for (int j = 0; j < k; j++) {
        const double a = h[j], b = h[j + 1];
        h[j] = r->cosine[j] * a + r->sine[j] * b;
        h[j + 1] = r->cosine[j] * b - r->sine[j] * a;
    }
    const double length = sqrt(h[k] * h[k] + h[k + 1] * h[k + 1]);
    r->cosine[k] = length > 0 ? h[k] / length : 1;
    r->sine[k] = length > 0 ? h[k + 1] / length : 0;
    h[k] = length;
    r->rest[k + 1] = -r->sine[k] * r->rest[k];
    r->rest[k] *= r->cosine[k];
    r->n = k + 1;
}

// The preconditioned residual, the first direction.
static void begin(const nmm_solver *s, nmm_gauss *g, int kind) {
    const size_t size = 2 * (size_t)s->n * sizeof(double);
    if (kind != NMM_GAUSS_SWEEPS) {
        memcpy(g->basis, s->wide.r, size);
        return;
    }
    // (D + L)^-1 r is the forward half of a product whose t and v are zero.
    memset(g->t, 0, size);
    s->variant->gauss_forward(s, g, g->t, g->t, s->wide.r, g->ahead, g->basis);
}

// w = preconditioned product with v. With the factor of K itself that is v and the coupling's part.
static void multiply(const nmm_solver *s, nmm_gauss *g, int kind, const double *v, double *w) {
    if (kind != NMM_GAUSS_SWEEPS) {
        nmm_factor_fastest()->apply(&g->factor, v, g->t);
        s->variant->couple(s->options.coupling, s->n, g->t, g->extra);
        if (kind == NMM_GAUSS_KEPT)
            s->variant->multiply(s, g->t, w);
        else
            memcpy(w, v, 2 * (size_t)s->n * sizeof(double));
        for (int i = 0; i < 2 * s->n; i++)
            w[i] += g->extra[i];
        return;
    }
    s->variant->gauss_backward(s, g, v, g->t);
    s->variant->couple(s->options.coupling, s->n, g->t, g->extra);
    s->variant->gauss_forward(s, g, v, g->t, g->extra, g->ahead, w);
}

// u += what the sum of m directions, part[j] of each, stands for.
static void add_parts(const nmm_solver *s, nmm_gauss *g, int kind, const double *part, int m) {
    const int n = 2 * s->n;
    memset(g->ahead, 0, (size_t)n * sizeof(double));
    for (int j = 0; j < m; j++)
        for (int i = 0; i < n; i++)
            g->ahead[i] += part[j] * g->basis[(long)j * n + i];
    if (kind == NMM_GAUSS_SWEEPS)
        s->variant->gauss_backward(s, g, g->ahead, g->t);
    else
        nmm_factor_fastest()->apply(&g->factor, g->ahead, g->t);
    for (int i = 0; i < n; i++)
        s->wide.u[i] += g->t[i];
}

static void scale(double *x, int n, double factor) {
    for (int i = 0; i < n; i++)
        x[i] *= factor;
}

// --- The same by lumps

static bool by_lumps(const nmm_gauss *g, int kind) {
    return kind == NMM_GAUSS_SWEEPS && g->lump == 3;
}

static float *narrow(double *x) {
    return (float *)(void *)x;
}

static void begin_lumps(const nmm_solver *s, nmm_gauss *g) {
    float *load = narrow(g->extra);
    g->largest = nmm_lumps_fastest()->load(&g->lumps, s->wide.r, load);
    nmm_lumps_fastest()->begin(&g->lumps, load, narrow(g->basis));
}

static void multiply_lumps(nmm_gauss *g, const float *v, float *w) {
    float *t = narrow(g->t);
    nmm_lumps_fastest()->backward(&g->lumps, v, t);
    nmm_lumps_fastest()->forward(&g->lumps, v, t, narrow(g->ahead), w);
}

static void add_parts_lumps(const nmm_solver *s, nmm_gauss *g, const double *part, int m) {
    const nmm_lumps_kernels *kernels = nmm_lumps_fastest();
    float *sum = narrow(g->ahead), *t = narrow(g->t);
    kernels->combine(narrow(g->basis), m, 8 * (long)g->lumps.n, part, sum);
    kernels->backward(&g->lumps, sum, t);
    kernels->add(&g->lumps, t, g->largest, s->wide.u);
}

// --- The iteration

// Direction k + 1 from direction k, or the first for k = -1: of length 1 after what it has of those
// before was taken out of it, part[j] of direction j. Its length before that.
static double next_direction(const nmm_solver *s, nmm_gauss *g, int kind, int k, double *part) {
    double length;
    if (by_lumps(g, kind)) {
        const nmm_lumps_kernels *kernels = nmm_lumps_fastest();
        const long n = 8 * (long)g->lumps.n;
        float *basis = narrow(g->basis), *w = basis + (k + 1) * n;
        if (k < 0)
            begin_lumps(s, g);
        else
            multiply_lumps(g, w - n, w);
        length = kernels->orthogonalise(basis, k + 1, n, w, part);
        if (length > 0 && length < INFINITY) kernels->scale(w, n, 1 / length);
        return length;
    }
    const int n = 2 * s->n;
    double *w = g->basis + (long)(k + 1) * n;
    if (k < 0)
        begin(s, g, kind);
    else
        multiply(s, g, kind, w - n, w);
    length = s->variant->orthogonalise(g->basis, k + 1, n, w, part);
    if (length > 0 && length < INFINITY) scale(w, n, 1 / length);
    return length;
}

// u += what the best combination of the directions stands for.
static void add_best(const nmm_solver *s, nmm_gauss *g, int kind, const triangle *r) {
    double part[NMM_GAUSS_MOST];
    for (int i = r->n - 1; i >= 0; i--) {
        part[i] = r->rest[i];
        for (int j = i + 1; j < r->n; j++)
            part[i] -= r->part[j][i] * part[j];
        part[i] = r->part[i][i] > 0 ? part[i] / r->part[i][i] : 0;
    }
    if (by_lumps(g, kind))
        add_parts_lumps(s, g, part, r->n);
    else
        add_parts(s, g, kind, part, r->n);
}

static double true_norm(const nmm_solver *s, nmm_gauss *g) {
    const int n = 2 * s->n;
    s->variant->couple(s->options.coupling, s->n, s->wide.u, g->extra);
    if (g->lump == 3) {
        nmm_lumps_fastest()->residual(s, g->extra);
    } else {
        s->variant->multiply(s, s->wide.u, s->wide.r);
        for (int i = 0; i < n; i++)
            s->wide.r[i] = s->wide.f[i] - s->wide.r[i] - g->extra[i];
    }
    return sqrt(nmm_sum_product(n, s->wide.r, s->wide.r, 1));
}

// From the residual in wide.r, until it should be `gain` times smaller, `most` iterations at most.
static int minimise(const nmm_solver *s, nmm_gauss *g, int kind, double gain, int most) {
    triangle r = {.n = 0};
    const double first = next_direction(s, g, kind, -1, NULL);
    if (!(first > 0 && first < INFINITY)) return 0;
    r.rest[0] = first;
    for (int k = 0; k < most && fabs(r.rest[k]) > gain * first; k++) {
        const double length = next_direction(s, g, kind, k, r.part[k]);
        r.part[k][k + 1] = length;
        rotate(&r, k);
        if (!(length > 0 && length < INFINITY)) break;
    }
    add_best(s, g, kind, &r);
    return r.n;
}

// --- Control

// Nanoseconds that a kind takes for so many iterations.
static double work_of(const nmm_gauss *g, const nmm_bsr *K, int kind, double iterations) {
    const double n_block = K->row_start[K->n_row], n = K->n_row;
    const bool lumps = g->lump == 3;
    const double sweeps =
        lumps ? PER_NARROW * n_block + PER_LUMP / 3 * n : PER_BLOCK * n_block + PER_ROW * n;
    const double per_number = g->factor.n_number > CACHE ? PER_FAR : PER_NUMBER;
    const double apply = 2 * per_number * g->factor.n_number;
    if (kind == NMM_GAUSS_SWEEPS) return (lumps ? TAKE_LUMPS * n_block : 0) + iterations * sweeps;
    if (kind == NMM_GAUSS_KEPT) return (apply + PER_BLOCK * n_block) * (1 + iterations);
    if (nmm_factor_knows(&g->factor, K)) return g->factor.work + apply * (1 + iterations);
    // Not known yet: what a direct solve of such a size is thought to take.
    double analysis = 0;
    const double work = nmm_direct_work(NULL, K, &analysis);
    return work + analysis / nmm_max_int(2, g->n_kept);
}

// What each kind promises for `gain` orders of magnitude; infinite where it cannot be.
static void price(const nmm_gauss *g, const nmm_bsr *K, double gain, bool reuse, double *work) {
    for (int kind = 0; kind < NMM_GAUSS_KINDS; kind++)
        work[kind] = work_of(g, K, kind, gain / g->rate[kind]);
    const bool kept = reuse && g->made && nmm_factor_knows(&g->factor, K);
    if (!kept) work[NMM_GAUSS_KEPT] = INFINITY;
    if (g->lump == 3) work[NMM_GAUSS_SWEEPS] += LESS_EXACT;
}

// The kind that promises the least work.
static int choose(const nmm_gauss *g, const nmm_bsr *K, double gain, bool reuse) {
    double work[NMM_GAUSS_KINDS];
    int best = NMM_GAUSS_SWEEPS;
    price(g, K, gain, reuse, work);
    for (int kind = 0; kind < NMM_GAUSS_KINDS; kind++)
        if (work[kind] < work[best]) best = kind;
    return best;
}

static void remember(nmm_gauss *g, bool kept) {
    if (g->solves++ % MEMORY == 0) {
        g->rate[NMM_GAUSS_SWEEPS] = RATE_OF_SWEEPS;
        g->rate[NMM_GAUSS_FACTOR] = RATE_OF_FACTOR;
        g->rate[NMM_GAUSS_KEPT] = RATE_OF_KEPT;
    }
    g->n_kept = kept ? g->n_kept + 1 : 0;
}

// What the kind needs of the matrix; *made: it is there.
static nmm_status prepare(nmm_context *context, nmm_solver *s, nmm_gauss *g, const nmm_bsr *K,
                          int kind, nmm_solve_report *report, bool *made) {
    if (kind == NMM_GAUSS_SWEEPS && g->lump == 3) {
        const nmm_coupling *coupling = s->options.coupling;
        bool fit = false;
        TRY(nmm_lumps_couple(context, &g->lumps, coupling, &fit));
        *made = fit && nmm_lumps_fastest()->take(&g->lumps, K, coupling);
        if (*made) return NMM_OK;
        g->lump = 1;
    }
    if (kind == NMM_GAUSS_SWEEPS) {
        *made = nmm_solver_check_numbers(s, K, report);
        return NMM_OK;
    }
    if (kind == NMM_GAUSS_KEPT) {
        *made = true;
        return NMM_OK;
    }
    const double *place = s->options.body != NULL ? s->options.place : NULL;
    g->made = false;
    TRY(nmm_factor_analyse(context, &g->factor, K, place));
    const int n_thread = g->factor.work < LEAST_SHARED ? 1 : g->n_thread;
    TRY(nmm_factor_reserve(context, &g->factor, n_thread));
    *made = g->made = nmm_factor_fastest()->make(&g->factor, K->value) < 0;
    return NMM_OK;
}

// The residual reached, and how many iterations that took.
static int iterate(nmm_solver *s, nmm_gauss *g, int kind, double *norm) {
    const bool lumps = by_lumps(g, kind);
    const int most = lumps ? 2 * NMM_GAUSS_MOST : NMM_GAUSS_MOST;
    int n = 0;
    memset(s->wide.u, 0, 2 * (size_t)s->n * sizeof(double));
    memcpy(s->wide.r, s->wide.f, 2 * (size_t)s->n * sizeof(double));
    *norm = s->norm;
    double before = INFINITY;
    while (*norm > s->limit && *norm < 0.5 * before && n < most) {
        const double gain = MARGIN * s->limit / *norm;
        before = *norm;
        n += minimise(s, g, kind, lumps ? nmm_max(gain, NARROW_GAIN) : gain,
                      nmm_min_int(most - n, NMM_GAUSS_MOST));
        *norm = true_norm(s, g);
    }
    if (!(*norm < s->norm)) *norm = s->norm;
    const double gain = *norm > 0 ? log10(s->norm / *norm) : 0;
    if (n > 0) g->rate[kind] = nmm_max(gain, 0.1) / n;
    return n;
}

// After a failure some solves are left out, twice as many each time.
static void judge(nmm_gauss *g, bool solved) {
    if (solved) {
        g->next_pause = 0;
        return;
    }
    g->pause = g->next_pause;
    g->next_pause = nmm_min_int(2 * g->next_pause + 1, LONGEST_PAUSE);
}

static nmm_status try_kind(nmm_context *context, nmm_solver *s, nmm_gauss *g, const nmm_bsr *K,
                           int kind, nmm_solve_report *report, double *norm) {
    bool made = false;
    const bool known = kind == NMM_GAUSS_SWEEPS || nmm_factor_knows(&g->factor, K);
    *norm = INFINITY;
    TRY(prepare(context, s, g, K, kind, report, &made));
    const int iterations = made ? iterate(s, g, kind, norm) : 0;
    report->iterations += iterations;
    g->work += work_of(g, K, kind, iterations);
    if (!known) g->work += ANALYSE * K->row_start[K->n_row];
    return NMM_OK;
}

// After sweeps by lumps that missed: does a factor cost no more than they did, or not much?
static bool pays_to_factor(const nmm_solver *s, nmm_gauss *g, const nmm_bsr *K, int kind,
                           double gain) {
    if (!by_lumps(g, kind)) return false;
    double work[NMM_GAUSS_KINDS];
    g->rate[NMM_GAUSS_SWEEPS] = gain / (4 * NMM_GAUSS_MOST);
    price(g, K, gain, s->options.reuse, work);
    return work[NMM_GAUSS_FACTOR] <= work[NMM_GAUSS_SWEEPS];
}

// Iterations by lumps are so cheap that a smaller residual saves more in passes than it costs.
static void ask_for_more(nmm_solver *s) {
    const double part = nmm_max(CLOSER * s->options.coupling->tolerance, s->options.tolerance);
    const double absolute = ldexp(s->options.absolute, -s->exponent);
    s->limit = nmm_max(part * s->norm, absolute);
}

static nmm_status run(nmm_context *context, nmm_solver *s, nmm_gauss *g, const nmm_bsr *K,
                      double *u, nmm_solve_report *report) {
    double norm = 0;
    g->diagonal = K->diagonal;
    if (g->pattern != s->pattern) TRY(nmm_lumps_find(context, &g->lumps, K, s->options.body));
    g->pattern = s->pattern;
    g->lump = g->lumps.known ? 3 : 1;
    const double limit = s->limit;
    if (g->lump == 3) ask_for_more(s);
    const double gain = s->limit < s->norm ? log10(s->norm / s->limit) : 0.1;
    int kind = choose(g, K, gain, s->options.reuse);
    TRY(try_kind(context, s, g, K, kind, report, &norm));
    s->limit = limit;
    if (!(norm <= s->limit) && (kind == NMM_GAUSS_KEPT || pays_to_factor(s, g, K, kind, gain))) {
        kind = NMM_GAUSS_FACTOR;
        TRY(try_kind(context, s, g, K, kind, report, &norm));
    }
    if (!(norm <= s->limit)) {
        judge(g, false);
        return NMM_OK;
    }
    judge(g, true);
    s->guess_norm = s->norm;
    nmm_solver_finish(s, norm, u, report);
    static const char *const why[NMM_GAUSS_KINDS] = {
        [NMM_GAUSS_SWEEPS] = "minimal residuals with Gauss-Seidel sweeps promise the least work",
        [NMM_GAUSS_FACTOR] = "minimal residuals with a new factor promise the least work",
        [NMM_GAUSS_KEPT] =
            "minimal residuals with the factor of an earlier pass promise the least work",
    };
    report->method = kind == NMM_GAUSS_SWEEPS ? NMM_SOLVE_PCG : NMM_SOLVE_DIRECT;
    report->why = why[kind];
    report->work = g->work;
    report->coupled = report->end == NMM_SOLVE_CONVERGED;
    return NMM_OK;
}

nmm_status nmm_gauss_solve(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                           const double *f, double *u, bool keep_pattern,
                           const nmm_solve_options *options, nmm_solve_report *report) {
    report->coupled = false;
    TRY(reserve(context, &solver->gauss, solver->max_row));
    nmm_gauss *g = solver->gauss;
    g->work = 0;
    if (g->pause > 0) {
        g->pause -= 1;
        return NMM_OK;
    }
    nmm_solve_options own = *options;
    own.method = NMM_SOLVE_PCG;
    own.blocks = NMM_BLOCKS_COVER;
    own.precision = NMM_PRECISION_DOUBLE;
    own.n_thread = 1;
    g->n_thread = nmm_max_int(options->n_thread > 0 ? options->n_thread : context->n_thread, 1);
    own.tolerance = nmm_max(own.tolerance, options->coupling->tolerance);
    TRY(nmm_solver_prepare(context, solver, K, keep_pattern, &own));
    remember(g, solver->pattern_kept);
    bool ready = false;
    // Sweeps by lumps and factors do without, others make them in time.
    solver->without_inverses = true;
    const nmm_status status = nmm_solver_start(context, solver, K, f, u, report, &ready);
    solver->without_inverses = false;
    TRY(status);
    solver->options.tolerance = options->tolerance;
    if (ready) TRY(run(context, solver, g, K, u, report));
    return NMM_OK;
}
