// SPDX-License-Identifier: MIT
//
// Part of a system: rows by the size of their residuals, rings of neighbours in the pattern of the
// matrix, and a copy of what these rows have to do with each other. Serial, in the order of the
// rows: the same bits for any number of threads.

#include "nearby.h"

#include "step.h"

#include <math.h>
#include <string.h>

// Part of all rows up to which it is worth while.
#define MOST_PART 0.3

// Rings of neighbours over one cover more than the fastest wave passes in the step, and at most.
#define RINGS 2.5
#define MOST_RINGS 100

// Powers of two of squares that are told apart, below the largest one.
enum { N_BIN = 128 };

nmm_status nmm_nearby_open(nmm_context *context, nmm_nearby *nearby, const nmm_model *model) {
    const size_t n = (size_t)model->n_cover;
    nearby->model = model;
    double slowest, fastest;
    nmm_wave_squares(model, &slowest, &fastest);
    nearby->speed = sqrt(fastest);
    TRY(nmm_allocate(context, &nearby->row, n, sizeof(int)));
    TRY(nmm_allocate(context, &nearby->place, n, sizeof(int)));
    TRY(nmm_allocate(context, &nearby->body, n, sizeof(int)));
    TRY(nmm_allocate(context, &nearby->first, (size_t)model->n_block, sizeof(int)));
    TRY(nmm_allocate(context, &nearby->at, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &nearby->residual, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &nearby->change, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &nearby->K.row_start, n + 1, sizeof(int)));
    TRY(nmm_touched_open(context, &nearby->touched, model));
    return nmm_allocate(context, &nearby->K.diagonal, n, sizeof(int));
}

void nmm_nearby_close(nmm_context *context, nmm_nearby *nearby) {
    nmm_solve_host()->close(context, &nearby->solver);
    nmm_touched_close(context, &nearby->touched);
    nmm_release(context, &nearby->row);
    nmm_release(context, &nearby->place);
    nmm_release(context, &nearby->body);
    nmm_release(context, &nearby->first);
    nmm_release(context, &nearby->at);
    nmm_release(context, &nearby->residual);
    nmm_release(context, &nearby->change);
    nmm_release(context, &nearby->K.row_start);
    nmm_release(context, &nearby->K.diagonal);
    nmm_release(context, &nearby->K.col);
    nmm_release(context, &nearby->K.value);
    nmm_release(context, &nearby->coupling.row);
    nmm_release(context, &nearby->coupling.push);
    nmm_release(context, &nearby->coupling.pull);
    *nearby = (nmm_nearby){0};
}

// --- Rows

static double square_of(const nmm_system *system, int c) {
    const double *r = system->residual + 2 * (long)c;
    return r[0] * r[0] + r[1] * r[1];
}

// As frexp has it, of a positive number; of the smallest ones one that is small enough.
static int exponent_of(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (int)(bits >> 52 & 0x7ff) - 1022;
}

// Bin of a square next to the largest one's exponent: 0 for the largest.
static int bin_of(double square, int most) {
    return nmm_max_int(0, nmm_min_int(most - exponent_of(square), N_BIN - 1));
}

// Squares of the residuals by bins, below the largest one.
typedef struct bin_sums {
    int most; // exponent of the largest
    double sum[N_BIN];
    int count[N_BIN];
} bin_sums;

// False: there are none, or some that are no numbers.
static bool fill_bins(bin_sums *bins, const nmm_system *system) {
    double largest = 0;
    for (int c = 0; c < system->K.n_row; c++)
        largest = nmm_max(largest, square_of(system, c));
    if (!(largest > 0 && largest < INFINITY)) return false;
    memset(bins, 0, sizeof *bins);
    bins->most = exponent_of(largest);
    for (int c = 0; c < system->K.n_row; c++) {
        const double square = square_of(system, c);
        if (!(square > 0)) continue;
        const int bin = bin_of(square, bins->most);
        bins->sum[bin] += square;
        bins->count[bin] += 1;
    }
    return true;
}

// The first bin whose rows, with those of all bins behind, have no more than `left` together; *n:
// rows of the bins before.
static int first_bin_left(const bin_sums *bins, double left, int *n) {
    double behind = 0;
    int end = 0;
    for (int bin = N_BIN - 1; bin >= 0 && end == 0; bin--) {
        behind += bins->sum[bin];
        if (behind > left * left) end = bin + 1;
    }
    *n = 0;
    for (int bin = 0; bin < end; bin++)
        *n += bins->count[bin];
    return end;
}

static bool is_held(const nmm_system *system, int c) {
    return system->fixed != NULL && system->fixed[c] == 3;
}

// Takes row c in, if it is not yet.
static int take_row(nmm_nearby *nearby, const nmm_system *system, int c, int n) {
    if (nearby->place[c] >= 0 || is_held(system, c)) return n;
    nearby->place[c] = n;
    nearby->row[n] = c;
    return n + 1;
}

// Rows with a residual of a bin before end_bin; how many.
static int take_worst(nmm_nearby *nearby, const nmm_system *system, int most, int end_bin) {
    const double least = end_bin < N_BIN ? ldexp(1, most - end_bin) : 0;
    int n = 0;
    for (int c = 0; c < system->K.n_row; c++)
        nearby->place[c] = -1;
    for (int c = 0; c < system->K.n_row; c++) {
        const double square = square_of(system, c);
        if (square > 0 && square >= least) n = take_row(nearby, system, c, n);
    }
    return n;
}

// Neighbours of the n rows, rings of them, while there are no more than `most` in all; how many.
static int take_rings(nmm_nearby *nearby, const nmm_system *system, int n, double rings, int most) {
    const nmm_bsr *K = &system->K;
    int begin = 0;
    for (int ring = 0; ring < rings && n <= most; ring++) {
        const int end = n;
        for (; begin < end && n <= most; begin++) {
            const int c = nearby->row[begin];
            for (int k = K->row_start[c]; k < K->row_start[c + 1]; k++)
                n = take_row(nearby, system, K->col[k], n);
        }
    }
    return n;
}

static void sort_rows(nmm_nearby *nearby) {
    nearby->n_row = 0;
    for (int c = 0; c < nearby->model->n_cover; c++) {
        if (nearby->place[c] < 0) continue;
        nearby->place[c] = nearby->n_row;
        nearby->row[nearby->n_row++] = c;
    }
}

// Rows of the bins that leave no more than `left`, and rings of neighbours, while there are no more
// than `most` in all; how many.
static int take_near(nmm_nearby *nearby, const nmm_system *system, const bin_sums *bins,
                     double left, double rings, int most) {
    int n = 0;
    const int end_bin = first_bin_left(bins, left, &n);
    if (n == 0 || n > most) return n;
    n = take_worst(nearby, system, bins->most, end_bin);
    return take_rings(nearby, system, n, rings, most);
}

bool nmm_nearby_choose(nmm_nearby *nearby, const nmm_system *system, double left, double most_left,
                       double h) {
    const double rings = RINGS * (1 + h * nearby->speed / nearby->model->size);
    const int most_rows = (int)(MOST_PART * system->K.n_row);
    bin_sums bins;
    if (!(rings <= MOST_RINGS) || !fill_bins(&bins, system)) return false;
    // The more is left, the fewer rows: most often even the most that may be left is too little.
    int times = 0;
    while (left > 0 && ldexp(left, times + 1) <= most_left)
        times++;
    if (times > 0 &&
        take_near(nearby, system, &bins, ldexp(left, times), rings, most_rows) > most_rows)
        return false;
    for (int k = 0; k <= times; k++) {
        const int n = take_near(nearby, system, &bins, ldexp(left, k), rings, most_rows);
        if (n == 0 || n > most_rows) continue;
        sort_rows(nearby);
        return true;
    }
    return false;
}

// --- The system of these rows

static nmm_status take_matrix(nmm_context *context, nmm_nearby *nearby, const nmm_bsr *whole) {
    nmm_bsr *K = &nearby->K;
    int n_block = 0, n = 0;
    for (int i = 0; i < nearby->n_row; i++)
        n_block += whole->row_start[nearby->row[i] + 1] - whole->row_start[nearby->row[i]];
    int capacity[2] = {nearby->capacity, nearby->capacity};
    TRY(nmm_grow(context, &K->col, &capacity[0], n_block, sizeof(int)));
    TRY(nmm_grow(context, &K->value, &capacity[1], n_block, 4 * sizeof(double)));
    nearby->capacity = capacity[0];
    K->n_row = nearby->n_row;
    for (int i = 0; i < nearby->n_row; i++) {
        const int c = nearby->row[i];
        for (int k = whole->row_start[c]; k < whole->row_start[c + 1]; k++) {
            const int col = nearby->place[whole->col[k]];
            if (col < 0) continue;
            if (col == i) K->diagonal[i] = n;
            K->col[n] = col;
            memcpy(K->value + 4 * (long)n, whole->value + 4 * (long)k, 4 * sizeof(double));
            n += 1;
        }
        K->row_start[i + 1] = n;
    }
    return NMM_OK;
}

static void take_rows(nmm_nearby *nearby, const nmm_system *system, const nmm_model *model) {
    const int *body = nmm_system_body(system, model);
    int n_body = 0;
    for (int b = 0; b < model->n_block; b++)
        nearby->first[b] = -1;
    for (int i = 0; i < nearby->n_row; i++) {
        const int c = nearby->row[i], b = body[c];
        if (b >= 0 && nearby->first[b] < 0) nearby->first[b] = n_body++;
        nearby->body[i] = b >= 0 ? nearby->first[b] : -1;
        for (int x = 0; x < 2; x++) {
            nearby->at[2 * i + x] = model->cover_place[2 * (long)c + x];
            nearby->residual[2 * i + x] = system->residual[2 * (long)c + x];
            nearby->change[2 * i + x] = 0;
        }
    }
}

// Terms that have to do with these rows; what they do to others is left out.
static nmm_status take_coupling(nmm_context *context, nmm_nearby *nearby,
                                const nmm_coupling *whole) {
    nmm_coupling *part = &nearby->coupling;
    const int m = whole->n_row;
    int capacity[3] = {nearby->coupling_capacity, nearby->coupling_capacity,
                       nearby->coupling_capacity};
    TRY(nmm_grow(context, &part->row, &capacity[0], whole->n, (size_t)m * sizeof(int)));
    TRY(nmm_grow(context, &part->push, &capacity[1], whole->n, 2 * (size_t)m * sizeof(double)));
    TRY(nmm_grow(context, &part->pull, &capacity[2], whole->n, 2 * (size_t)m * sizeof(double)));
    nearby->coupling_capacity = capacity[0];
    part->n = 0;
    part->n_row = m;
    part->tolerance = whole->tolerance;
    for (int k = 0; k < whole->n; k++) {
        const long from = (long)m * k, to = (long)m * part->n;
        bool any = false;
        for (int i = 0; i < m; i++) {
            const int row = nearby->place[whole->row[from + i]];
            part->row[to + i] = nmm_max_int(0, row);
            for (int x = 0; x < 2; x++) {
                part->push[2 * (to + i) + x] = row >= 0 ? whole->push[2 * (from + i) + x] : 0;
                part->pull[2 * (to + i) + x] = row >= 0 ? whole->pull[2 * (from + i) + x] : 0;
            }
            any = any || row >= 0;
        }
        part->n += any;
    }
    return NMM_OK;
}

static nmm_status open_solver(nmm_context *context, nmm_nearby *nearby) {
    const int n_row = nearby->K.n_row, n_block = nearby->K.row_start[n_row];
    if (nearby->solver != NULL && n_row <= nearby->solver_rows && n_block <= nearby->solver_blocks)
        return NMM_OK;
    const nmm_solve_backend *host = nmm_solve_host();
    host->close(context, &nearby->solver);
    nearby->solver_rows = n_row + n_row / 2;
    nearby->solver_blocks = n_block + n_block / 2;
    return host->open(context, &nearby->solver, nearby->solver_rows, nearby->solver_blocks);
}

nmm_status nmm_nearby_solve(nmm_context *context, nmm_nearby *nearby, nmm_system *system,
                            const nmm_state *state, const nmm_solve_options *options,
                            nmm_solve_report *report) {
    const nmm_model *model = nearby->model;
    const size_t pair = 2 * sizeof(double);
    nmm_solve_options own = *options;
    TRY(take_matrix(context, nearby, &system->K));
    take_rows(nearby, system, model);
    if (options->coupling != NULL) {
        TRY(take_coupling(context, nearby, options->coupling));
        own.coupling = &nearby->coupling;
    }
    TRY(open_solver(context, nearby));
    own.place = options->place != NULL ? nearby->at : NULL;
    own.body = options->body != NULL ? nearby->body : NULL;
    own.reuse = false;
    TRY(nmm_solve_host()->solve(context, nearby->solver, &nearby->K, nearby->residual,
                                nearby->change, false, &own, report));
    memset(system->change, 0, (size_t)model->n_cover * pair);
    for (int i = 0; i < nearby->n_row; i++)
        memcpy(system->change + 2 * (long)nearby->row[i], nearby->change + 2 * (long)i, pair);
    return nmm_touched_by(context, &nearby->touched, system, model, state, nearby->row,
                          nearby->n_row);
}
