// SPDX-License-Identifier: MIT
//
// Which blocks, or a factor of the whole matrix? Each kind has a price to prepare, a price per
// iteration and a rate of convergence. Prices follow from sizes; the rates are learned from solve
// to solve. A kind never tried is tried when the work spent on the next smaller one equals its
// preparation, so that no choice costs more than about twice the best one, and that only now and
// then.

#include "choose.h"
#include "coarse.h"
#include "direct.h"
#include "gauss.h"

#include <math.h>
#include <string.h>

// Prices in nanoseconds of one core of about 3 GHz; only their ratios matter.
#define PER_BLOCK 0.50     // a 2x2 block in a product
#define PER_ROW 2.5        // vectors of a row
#define PER_DENSE_ROW 2.0  // its share of a dense block
#define PER_FACTOR 0.4     // an entry of the coarse factor, twice
#define PER_PART 30.0      // its three rows, twice
#define PER_MOVE 2.5       // restriction and prolongation of a row
#define FIND_CLUSTERS 11.0 // by block
#define TAKE_BLOCK 1.0     // copy
#define INVERT_ROW 150.0
#define DIVIDE_BLOCK 6.0
#define PROJECT_BLOCK 8.0
#define FACTORISE 0.15 // by multiplication

// What is swept over once per iteration and is larger than a cache comes from memory: bytes that
// stay in one, and the price of a byte that does not.
#define CACHE 2e7
#define PER_FAR_BYTE 0.027
#define BYTES_OF_BLOCK 36.0
#define BYTES_OF_ROW 112.0
#define BYTES_OF_DENSE_ROW 128.0

// The same in float32, where the blocks of clusters are in any case; a block's copy, iterations for
// one in float64, and orders of magnitude of a round, which ends with a residual in float64.
#define BYTES_OF_NARROW_BLOCK 20.0
#define BYTES_OF_NARROW_ROW 56.0
#define TAKE_NARROW 2.0
#define NARROW_MORE 1.1
#define NARROW_ROUND 5.0

// No round in float32 takes more than this part of the iterations allowed.
#define NARROW_PART 0.25

// Solves after which rates are measured anew.
#define MEMORY 100

// Iterations that tell a rate, and those before the next kind is thought of.
#define FEW 4

// Part of a preparation that one solve bears, because later ones of a step use most of it again,
// and make some of it anew.
#define BORNE 0.5

// Solves that a pattern is thought to serve at least.
#define LEAST_LIFE 2

// Iterations where the caller sets no limit.
#define MOST_ITERATIONS 20000

// Iterations that a kind not known yet has in any case: fewer tell little of its rate.
#define TRIAL 40

// Iterations with the smallest blocks that a solve takes in any case, nearly.
#define LEAST_TRIAL 20

// Orders of magnitude that a run counts for at least.
#define LEAST_GAIN 0.25

// Rate of a kind that failed.
#define HOPELESS 1e-6

// The kinds are those of nmm_solve_blocks, and the direct method.
enum { DIRECT = NMM_BLOCKS_BODY + 1, KINDS };

typedef struct prices {
    double prepare[KINDS], iterate[KINDS];
    bool narrow[KINDS]; // iterations in float32 inside a correction in float64
    int largest;        // kind of blocks
    bool has_direct;
} prices;

typedef struct coarse_size {
    double n_part, n_factor, work;
} coarse_size;

// What the parts come to before they are found: no fewer than bodies, and a factor as wide as a row
// of parts across the scene.
static coarse_size guess_coarse(const nmm_bsr *K, const nmm_solve_options *options) {
    int n_body = 0;
    for (int i = 0; i < K->n_row; i++)
        n_body = nmm_max_int(n_body, options->body[i] + 1);
    const double n_part = nmm_max(n_body, K->n_row / nmm_coarse_rows_of_part(K->n_row));
    const double width = 4.5 * sqrt(n_part);
    return (coarse_size){n_part, 3 * n_part * width, 1.5 * n_part * width * width};
}

// Of an iteration that reads so many bytes; between one cache and two, part of it.
static double far(double bytes) {
    return PER_FAR_BYTE * bytes * nmm_max(0, nmm_min((bytes - CACHE) / CACHE, 1));
}

static prices find_prices(const nmm_solver *s, const nmm_bsr *K, bool kept,
                          const nmm_solve_options *options) {
    const double n = K->n_row, n_block = K->n_row > 0 ? K->row_start[K->n_row] : 0;
    const bool reuse = kept && options->reuse;
    prices p = {.largest = NMM_BLOCKS_CLUSTER};
    const double bytes = BYTES_OF_BLOCK * n_block + BYTES_OF_ROW * n;
    const double per_iteration = PER_BLOCK * n_block + PER_ROW * n;
    p.iterate[NMM_BLOCKS_COVER] = per_iteration + far(bytes);
    p.iterate[NMM_BLOCKS_CLUSTER] =
        per_iteration + PER_DENSE_ROW * n + far(bytes + BYTES_OF_DENSE_ROW * n);
    double make = 0;
    if (!kept || !s->clusters_found) make += FIND_CLUSTERS * n_block;
    if (!reuse || !s->dense_made) make += INVERT_ROW * n;
    p.prepare[NMM_BLOCKS_CLUSTER] = TAKE_BLOCK * n_block + BORNE * make;
    if (s->staged) return p;
    // A pattern will last as long as it has lasted, or as those before did.
    const nmm_experience *experience = &s->experience;
    const double life = nmm_max(nmm_max(LEAST_LIFE, experience->life), experience->n_kept);
    double analysis = 0;
    p.has_direct = options->method == NMM_SOLVE_AUTO;
    p.iterate[DIRECT] = nmm_direct_work(s, K, &analysis);
    p.prepare[DIRECT] = p.iterate[DIRECT] + analysis / life;
    if (options->place == NULL || options->body == NULL) return p;
    p.largest = NMM_BLOCKS_BODY;
    // Those of another pattern of the same rows are much the same.
    const bool known = s->coarse.n_part > 0 && s->n_row == K->n_row;
    const coarse_size coarse =
        known ? (coarse_size){s->coarse.n_part, (double)s->coarse.n_factor, s->coarse.work}
              : guess_coarse(K, options);
    p.iterate[NMM_BLOCKS_BODY] = p.iterate[NMM_BLOCKS_CLUSTER] + PER_FACTOR * coarse.n_factor +
                                 PER_PART * coarse.n_part + PER_MOVE * n;
    if (!kept || !s->parts_found) make += DIVIDE_BLOCK * n_block;
    make += PROJECT_BLOCK * n_block + FACTORISE * coarse.work;
    p.prepare[NMM_BLOCKS_BODY] = TAKE_BLOCK * n_block + BORNE * make;
    return p;
}

// Where an iteration reads what lies in memory, float32 halves that. It pays by as many iterations
// as make up for the copy and the residuals between the rounds. Only once all kinds are known: the
// budget of one that is to be compared with an unknown one would cut the rounds short.
static void consider_float32(prices *p, const nmm_experience *experience, const nmm_bsr *K,
                             double gain) {
    const double n = K->n_row, n_block = K->n_row > 0 ? K->row_start[K->n_row] : 0;
    const double wide = BYTES_OF_BLOCK * n_block + BYTES_OF_ROW * n;
    const double narrow = BYTES_OF_NARROW_BLOCK * n_block + BYTES_OF_NARROW_ROW * n;
    for (int k = NMM_BLOCKS_COVER; k <= p->largest; k++)
        if (!(experience->rate[k] > 0)) return;
    for (int k = NMM_BLOCKS_COVER; k <= p->largest; k++) {
        const double dense = k == NMM_BLOCKS_COVER ? 0 : BYTES_OF_DENSE_ROW * n;
        const double iterate = p->iterate[k] - far(wide + dense) + far(narrow + dense);
        const double prepare = TAKE_NARROW * n_block + gain / NARROW_ROUND * p->iterate[k];
        const double iterations = gain / experience->rate[k];
        if (prepare + NARROW_MORE * iterations * iterate >= iterations * p->iterate[k]) continue;
        p->narrow[k] = true;
        p->prepare[k] += prepare;
        p->iterate[k] = iterate;
    }
}

// Work that a kind needs for `gain` orders of magnitude; infinite where the rate is not known.
static double work_of(const prices *p, const nmm_experience *experience, int kind, double gain) {
    if (kind == DIRECT) return p->has_direct ? p->prepare[DIRECT] : INFINITY;
    if (!(experience->rate[kind] > 0)) return INFINITY;
    return p->prepare[kind] + gain / experience->rate[kind] * p->iterate[kind];
}

static int cheapest(const prices *p, const nmm_experience *experience, double gain) {
    int best = NMM_BLOCKS_COVER;
    const double direct = work_of(p, experience, DIRECT, gain);
    // What was never measured from below up is measured first, but where a factor costs no more
    // than the measurement.
    if (!(experience->rate[best] > 0)) {
        return direct < LEAST_TRIAL * p->iterate[best] ? DIRECT : best;
    }
    for (int k = best + 1; k <= p->largest && experience->rate[k] > 0; k++) {
        if (work_of(p, experience, k, gain) < work_of(p, experience, best, gain)) best = k;
    }
    return direct < work_of(p, experience, best, gain) ? DIRECT : best;
}

// What to turn to when a kind turns out slow, and the work it would take: the best of the larger
// ones, where one not known yet counts with its preparation alone; or the direct method, whose work
// is known, so that beside it one not known counts with some iterations.
static int alternative(const prices *p, const nmm_experience *experience, int kind, double gain,
                       double *work) {
    int best = kind;
    *work = INFINITY;
    if (kind == DIRECT) return best;
    bool known = true;
    // One unknown kind at a time.
    for (int k = kind + 1; k <= p->largest && known; k++) {
        double there = work_of(p, experience, k, gain);
        known = there < INFINITY;
        if (!known) there = p->prepare[k];
        if (there >= *work) continue;
        *work = there;
        best = k;
    }
    const double direct = work_of(p, experience, DIRECT, gain);
    if (direct >= *work + (known ? 0 : LEAST_TRIAL * p->iterate[best])) return best;
    *work = direct;
    return DIRECT;
}

// Orders of magnitude to go; the right-hand side counts, not the first guess.
static double gain_wanted(const nmm_bsr *K, const double *f, const nmm_solve_options *options) {
    const double norm = sqrt(nmm_sum_product(2 * K->n_row, f, f, 1));
    const double limit = nmm_max(options->tolerance * norm, options->absolute);
    return limit > 0 && limit < norm && norm < INFINITY ? log10(norm / limit) : 1;
}

// 2x2 blocks that were given up on the way to `kind`, which took `work`: not to be chosen again
// before the memory fades, because their first iterations gain more than later ones. Those of
// larger blocks do not.
static void discourage(nmm_experience *experience, const prices *p, int first, int kind,
                       double gain, double work) {
    const int k = NMM_BLOCKS_COVER;
    if (first != k || kind == k) return;
    const double rest = nmm_max(1.2 * work - p->prepare[k], p->iterate[k]);
    const double rate = gain * p->iterate[k] / rest;
    experience->rate[k] = nmm_min(experience->rate[k] > 0 ? experience->rate[k] : rate, rate);
}

// Conjugate gradients may gain nothing for a while and then all at once: a kind that gained nothing
// yet is taken for slow, not for hopeless.
static void learn(nmm_experience *experience, int kind, int iterations, double before,
                  double after) {
    if (kind == DIRECT || iterations < FEW) return;
    const bool gained = after > 0 && after < before;
    const double gain = gained ? log10(before / after) : 0;
    experience->rate[kind] = nmm_max(gain, LEAST_GAIN) / iterations;
}

// One solve on its way through the kinds.
typedef struct search {
    prices price;
    nmm_experience *experience;
    nmm_solve_options now;
    nmm_solve_precision asked;
    int first, kind;        // it began with, and at hand
    double wanted, gain;    // orders of magnitude in all, and to go
    int most;               // iterations allowed
    int iterations, setups; // so far
    double work;            // so far
    bool to_the_end;        // nothing to turn to: larger blocks failed, or mixed was asked for
} search;

// A solve begins: rates fade, patterns come and go.
static void remember(nmm_experience *experience, bool kept) {
    if (++experience->solves % MEMORY == 0) {
        memset(experience->rate, 0, sizeof experience->rate);
        experience->wide_only = false;
    }
    if (!kept) {
        experience->life = 0.5 * (experience->life + experience->n_kept);
        experience->n_kept = 0;
    }
    experience->n_kept++;
}

static search begin_search(nmm_solver *solver, const nmm_bsr *K, const double *f, bool keep_pattern,
                           const nmm_solve_options *options) {
    nmm_experience *experience = &solver->experience;
    const bool kept = keep_pattern && solver->n_row == K->n_row;
    remember(experience, kept);
    search s = {.price = find_prices(solver, K, kept, options),
                .asked = options->precision,
                .experience = experience,
                .now = *options,
                .wanted = gain_wanted(K, f, options),
                .most = options->max_iterations > 0 ? options->max_iterations : MOST_ITERATIONS};
    s.gain = s.wanted;
    const bool free = options->precision == NMM_PRECISION_AUTO && !solver->staged;
    if (free && !experience->wide_only) consider_float32(&s.price, experience, K, s.gain);
    s.kind = cheapest(&s.price, experience, s.gain);
    // A budget would cut float32 short: the largest blocks, to the end.
    s.to_the_end = options->precision == NMM_PRECISION_MIXED;
    if (s.to_the_end) s.kind = s.price.largest;
    s.first = s.kind;
    return s;
}

// Iterations for the kind at hand, and the kind to turn to when they do not do.
static int set_budget(search *s) {
    double work_there = INFINITY;
    int next = s->kind;
    if (!s->to_the_end) {
        next = alternative(&s->price, s->experience, s->kind, s->gain, &work_there);
    }
    const bool known = s->kind == DIRECT || s->experience->rate[s->kind] > 0;
    const bool narrow = s->price.narrow[s->kind] && !s->to_the_end;
    const double enough = work_there / s->price.iterate[s->kind];
    double budget = known ? FEW + enough : nmm_max(TRIAL, FEW + enough);
    if (narrow) budget /= NARROW_PART;
    const int left = s->most - s->iterations;
    s->now.max_iterations = budget < left ? (int)budget : left;
    s->now.method = s->kind == DIRECT ? NMM_SOLVE_DIRECT : NMM_SOLVE_PCG;
    s->now.blocks = s->kind == DIRECT ? NMM_BLOCKS_COVER : (nmm_solve_blocks)s->kind;
    s->now.precision = narrow ? NMM_PRECISION_MIXED : s->asked;
    return next;
}

// Take note of a run; true when another one is to follow.
static bool take_note(search *s, const nmm_solver *solver, const nmm_solve_report *report,
                      int next) {
    const double before = solver->guess_norm, last = report->residual * solver->norm;
    s->iterations += report->iterations;
    s->setups += report->setups;
    s->work += s->price.prepare[s->kind];
    if (s->kind != DIRECT) s->work += report->iterations * s->price.iterate[s->kind];
    learn(s->experience, s->kind, report->iterations, before, last);
    // Where float32 did not do once, it is not tried before the memory fades.
    const bool narrow = s->now.precision == NMM_PRECISION_MIXED;
    if (narrow && report->precision == NMM_PRECISION_DOUBLE) s->experience->wide_only = true;
    if (report->end == NMM_SOLVE_CONVERGED || s->iterations >= s->most) return false;
    if (report->end == NMM_SOLVE_TOO_SLOW) {
        if (last > solver->limit && solver->limit > 0) s->gain = log10(last / solver->limit);
        s->kind = next;
        return true;
    }
    // A system that small blocks can do without float32 may be beyond larger ones; what rounding
    // leaves after a factor of the matrix itself is left by any kind.
    if (s->kind == NMM_BLOCKS_COVER || report->end == NMM_SOLVE_NOT_FINITE) return false;
    if (s->kind == DIRECT && report->end == NMM_SOLVE_STAGNATED) return false;
    if (s->kind != DIRECT) s->experience->rate[s->kind] = HOPELESS;
    s->kind = NMM_BLOCKS_COVER;
    s->to_the_end = true;
    return true;
}

// A factor that served none of the last solves only takes memory.
static void drop_factor(nmm_context *context, nmm_solver *solver) {
    if (solver->experience.undirected >= MEMORY) nmm_direct_destroy(context, &solver->direct);
}

nmm_status nmm_choose_blocks(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                             const double *f, double *u, bool keep_pattern,
                             const nmm_solve_options *options, nmm_solve_report *report) {
    drop_factor(context, solver);
    search s = begin_search(solver, K, f, keep_pattern, options);
    bool more = true, kept = keep_pattern;
    s.experience->undirected += 1;
    while (more) {
        const int next = set_budget(&s);
        if (s.kind == DIRECT) s.experience->undirected = 0;
        TRY(solver->run(context, solver, K, f, u, kept, &s.now, report));
        more = take_note(&s, solver, report, next);
        kept = true;
    }
    const double work = work_of(&s.price, s.experience, s.kind, s.wanted);
    if (report->end == NMM_SOLVE_CONVERGED && work < INFINITY) {
        discourage(s.experience, &s.price, s.first, s.kind, s.wanted, work);
    }
    report->iterations = s.iterations;
    report->setups = s.setups;
    report->work = s.work;
    static const char *const why[] = {
        "", "2x2 blocks promise the least work", "clusters promise the least work",
        "rigid motions of bodies promise the least work", "a direct solve promises the least work"};
    // What mixed precision fell back to comes first.
    if (report->why[0] == '\0') report->why = why[s.kind];
    return NMM_OK;
}

nmm_status nmm_solver_solve(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                            const double *f, double *u, bool keep_pattern,
                            const nmm_solve_options *options, nmm_solve_report *report) {
    TRY(nmm_solver_check(context, solver, K, options));
    // A method, limits and precision that were asked for are those of the symmetric systems.
    const bool free = options->method == NMM_SOLVE_AUTO && options->max_iterations == 0 &&
                      options->blocks == NMM_BLOCKS_AUTO &&
                      options->precision != NMM_PRECISION_MIXED;
    report->coupled = false;
    double in_vain = 0;
    const bool kept = nmm_solver_keeps(solver, K, keep_pattern);
    solver->pattern += !kept || solver->pattern == 0;
    if (options->coupling != NULL && free && !solver->staged) {
        TRY(nmm_gauss_solve(context, solver, K, f, u, keep_pattern, options, report));
        in_vain = solver->gauss->work;
    }
    if (report->coupled) return NMM_OK;
    nmm_solve_run *run = nmm_solver_chooses(options) ? nmm_choose_blocks : solver->run;
    *solver->traffic = (nmm_traffic){0};
    TRY(run(context, solver, K, f, u, keep_pattern, options, report));
    report->transfers = solver->traffic->transfers;
    report->transfer_bytes = solver->traffic->bytes;
    report->transfer_seconds = solver->traffic->seconds;
    report->work += in_vain;
    return NMM_OK;
}
