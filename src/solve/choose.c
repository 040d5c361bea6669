// SPDX-License-Identifier: MIT
//
// Which blocks? Each kind has a price to prepare, a price per iteration and a rate of convergence.
// Prices follow from sizes; the rates are learned from solve to solve. A kind never tried is tried
// when the work spent on the next smaller one equals its preparation, so that no choice costs more
// than about twice the best one, and that only now and then.

#include "choose.h"

#include <math.h>

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

// Solves after which rates are measured anew.
#define MEMORY 100

// Iterations that tell a rate, and those before the next kind is thought of.
#define FEW 4

// Part of a preparation that one solve bears, because later ones of a step use most of it again,
// and make some of it anew.
#define BORNE 0.5

// Iterations where the caller sets no limit.
#define MOST_ITERATIONS 20000

// Rate of a kind that failed.
#define HOPELESS 1e-6

typedef struct prices {
    double prepare[NMM_BLOCKS_BODY + 1], iterate[NMM_BLOCKS_BODY + 1];
    nmm_solve_blocks largest;
} prices;

static prices find_prices(const nmm_solver *s, const nmm_bsr *K, bool kept,
                          const nmm_solve_options *options) {
    const double n = K->n_row, n_block = K->n_row > 0 ? K->row_start[K->n_row] : 0;
    const bool reuse = kept && options->reuse;
    prices p = {.largest = NMM_BLOCKS_CLUSTER};
    p.iterate[NMM_BLOCKS_COVER] = PER_BLOCK * n_block + PER_ROW * n;
    p.iterate[NMM_BLOCKS_CLUSTER] = p.iterate[NMM_BLOCKS_COVER] + PER_DENSE_ROW * n;
    double make = 0;
    if (!kept || !s->clusters_found) make += FIND_CLUSTERS * n_block;
    if (!reuse || !s->dense_made) make += INVERT_ROW * n;
    p.prepare[NMM_BLOCKS_CLUSTER] = TAKE_BLOCK * n_block + BORNE * make;
    if (s->staged || options->place == NULL || options->body == NULL) return p;
    p.largest = NMM_BLOCKS_BODY;
    const bool parts = kept && s->parts_found;
    // Before the parts are known: about what they come to.
    const double n_part = parts ? s->coarse.n_part : 0.1 * n;
    const double n_factor = parts ? (double)s->coarse.n_factor : 10 * n;
    const double work = parts ? s->coarse.work : 200 * n;
    p.iterate[NMM_BLOCKS_BODY] =
        p.iterate[NMM_BLOCKS_CLUSTER] + PER_FACTOR * n_factor + PER_PART * n_part + PER_MOVE * n;
    if (!parts) make += DIVIDE_BLOCK * n_block;
    make += PROJECT_BLOCK * n_block + FACTORISE * work;
    p.prepare[NMM_BLOCKS_BODY] = TAKE_BLOCK * n_block + BORNE * make;
    return p;
}

// Work that `blocks` need for `gain` orders of magnitude; infinite where the rate is not known.
static double work_of(const prices *p, const nmm_experience *experience, nmm_solve_blocks blocks,
                      double gain) {
    if (!(experience->rate[blocks] > 0)) return INFINITY;
    return p->prepare[blocks] + gain / experience->rate[blocks] * p->iterate[blocks];
}

static nmm_solve_blocks cheapest(const prices *p, const nmm_experience *experience, double gain) {
    nmm_solve_blocks best = NMM_BLOCKS_COVER;
    // What was never measured from below up is measured first.
    for (int k = NMM_BLOCKS_COVER; k <= (int)p->largest; k++) {
        if (!(experience->rate[k] > 0)) break;
        if (work_of(p, experience, (nmm_solve_blocks)k, gain) <
            work_of(p, experience, best, gain)) {
            best = (nmm_solve_blocks)k;
        }
    }
    return best;
}

// What to turn to when `blocks` turn out slow, and the work it would take: the best of the larger
// kinds, where one not known yet counts with its preparation alone.
static nmm_solve_blocks alternative(const prices *p, const nmm_experience *experience,
                                    nmm_solve_blocks blocks, double gain, double *work) {
    nmm_solve_blocks best = blocks;
    *work = INFINITY;
    for (int k = blocks + 1; k <= (int)p->largest; k++) {
        double there = work_of(p, experience, (nmm_solve_blocks)k, gain);
        const bool unknown = there == INFINITY;
        if (unknown) there = p->prepare[k];
        if (there < *work) {
            *work = there;
            best = (nmm_solve_blocks)k;
        }
        // One unknown kind at a time.
        if (unknown) break;
    }
    return best;
}

// Orders of magnitude to go; the right-hand side counts, not the first guess.
static double gain_wanted(const nmm_bsr *K, const double *f, const nmm_solve_options *options) {
    double square = 0;
    for (int i = 0; i < 2 * K->n_row; i++)
        square += f[i] * f[i];
    const double norm = sqrt(square);
    const double limit = nmm_max(options->tolerance * norm, options->absolute);
    return limit > 0 && limit < norm && norm < INFINITY ? log10(norm / limit) : 1;
}

// The kinds given up on the way to `blocks`, which took `work`: not to be chosen again before the
// memory fades, because their first iterations gain more than later ones.
static void discourage(nmm_experience *experience, const prices *p, nmm_solve_blocks first,
                       nmm_solve_blocks blocks, double gain, double work) {
    for (int k = first; k < (int)blocks; k++) {
        const double rest = nmm_max(1.2 * work - p->prepare[k], p->iterate[k]);
        const double rate = gain * p->iterate[k] / rest;
        experience->rate[k] = nmm_min(experience->rate[k] > 0 ? experience->rate[k] : rate, rate);
    }
}

static void learn(nmm_experience *experience, nmm_solve_blocks blocks, int iterations,
                  double before, double after) {
    if (iterations < FEW || !(after > 0 && after < before)) return;
    experience->rate[blocks] = log10(before / after) / iterations;
}

// One solve on its way through the kinds.
typedef struct search {
    prices price;
    nmm_experience *experience;
    nmm_solve_options now;
    nmm_solve_blocks first; // kind it began with
    double wanted, gain;    // orders of magnitude in all, and to go
    int most;               // iterations allowed
    int iterations, setups; // so far
    bool fell_back;         // larger blocks failed: 2x2 to the end
} search;

static search begin_search(nmm_solver *solver, const nmm_bsr *K, const double *f, bool keep_pattern,
                           const nmm_solve_options *options) {
    nmm_experience *experience = &solver->experience;
    if (++experience->solves % MEMORY == 0) *experience = (nmm_experience){0};
    const bool kept = keep_pattern && solver->n_row == K->n_row;
    search s = {.price = find_prices(solver, K, kept, options),
                .experience = experience,
                .now = *options,
                .wanted = gain_wanted(K, f, options),
                .most = options->max_iterations > 0 ? options->max_iterations : MOST_ITERATIONS};
    s.gain = s.wanted;
    s.now.method = NMM_SOLVE_PCG;
    s.now.blocks = s.first = cheapest(&s.price, experience, s.gain);
    return s;
}

// Iterations for the kind at hand, and the kind to turn to when they do not do.
static nmm_solve_blocks set_budget(search *s) {
    const nmm_solve_blocks here = s->now.blocks;
    double work_there = INFINITY;
    const nmm_solve_blocks next =
        s->fell_back ? here : alternative(&s->price, s->experience, here, s->gain, &work_there);
    const double budget = FEW + work_there / s->price.iterate[here];
    const int left = s->most - s->iterations;
    s->now.max_iterations = budget < left ? (int)budget : left;
    return next;
}

// Take note of a run; true when another one is to follow.
static bool take_note(search *s, const nmm_solver *solver, const nmm_solve_report *report,
                      nmm_solve_blocks next) {
    const nmm_solve_blocks here = s->now.blocks;
    const double before = solver->guess_norm, last = report->residual * solver->norm;
    s->iterations += report->iterations;
    s->setups += report->setups;
    learn(s->experience, here, report->iterations, before, last);
    if (report->end == NMM_SOLVE_CONVERGED || s->iterations >= s->most) return false;
    if (report->end == NMM_SOLVE_TOO_SLOW) {
        if (last > solver->limit && solver->limit > 0) s->gain = log10(last / solver->limit);
        s->now.blocks = next;
        return true;
    }
    // A system that small blocks can do without float32 may be beyond larger ones.
    if (here == NMM_BLOCKS_COVER || report->end == NMM_SOLVE_NOT_FINITE) return false;
    s->experience->rate[here] = HOPELESS;
    s->now.blocks = NMM_BLOCKS_COVER;
    s->fell_back = true;
    return true;
}

nmm_status nmm_choose_blocks(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                             const double *f, double *u, bool keep_pattern,
                             const nmm_solve_options *options, nmm_solve_report *report) {
    TRY(nmm_solver_check(context, solver, K, options));
    search s = begin_search(solver, K, f, keep_pattern, options);
    bool more = true, kept = keep_pattern;
    while (more) {
        const nmm_solve_blocks next = set_budget(&s);
        TRY(solver->run(context, solver, K, f, u, kept, &s.now, report));
        more = take_note(&s, solver, report, next);
        kept = true;
    }
    const nmm_solve_blocks last = s.now.blocks;
    const double work = work_of(&s.price, s.experience, last, s.wanted);
    if (report->end == NMM_SOLVE_CONVERGED && work < INFINITY) {
        discourage(s.experience, &s.price, s.first, last, s.wanted, work);
    }
    report->iterations = s.iterations;
    report->setups = s.setups;
    static const char *const why[] = {"", "2x2 blocks promise the least work",
                                      "clusters promise the least work",
                                      "rigid motions of bodies promise the least work"};
    // What mixed precision fell back to comes first.
    if (report->why[0] == '\0') report->why = why[last];
    return NMM_OK;
}
