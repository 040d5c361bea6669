// SPDX-License-Identifier: MIT
//
// The coarse system: parts by a grid over each body, unknowns in reverse Cuthill-McKee order, a
// Cholesky factor stored by rows from the first nonzero on. Serial where the order of additions
// matters, so one result for any number of threads.

#include "coarse.h"

#include <math.h>
#include <string.h>

// Rows of a part: about this times the square root of all rows, which makes the factor cost as much
// as some ten iterations; at least LEAST_ROWS.
#define PART_SHARE 0.2
#define LEAST_ROWS 10

// --- Memory

static void release_rows(nmm_context *context, nmm_coarse *c) {
    int **const integer[] = {&c->part, &c->start, &c->row, &c->first, &c->rank, &c->queue};
    for (size_t k = 0; k < sizeof integer / sizeof *integer; k++)
        nmm_release(context, integer[k]);
    double **const number[] = {&c->arm, &c->inverse, &c->load, &c->move};
    for (size_t k = 0; k < sizeof number / sizeof *number; k++)
        nmm_release(context, number[k]);
    nmm_release(context, &c->offset);
    c->capacity = 0;
}

void nmm_coarse_destroy(nmm_context *context, nmm_coarse *coarse) {
    release_rows(context, coarse);
    nmm_release(context, &coarse->factor);
    nmm_release(context, &coarse->lower);
    *coarse = (nmm_coarse){0};
}

static nmm_status reserve_rows(nmm_context *context, nmm_coarse *c, int n) {
    if (n <= c->capacity) return NMM_OK;
    release_rows(context, c);
    const size_t rows = (size_t)n + 1;
    TRY(nmm_allocate(context, &c->part, rows, sizeof(int)));
    TRY(nmm_allocate(context, &c->start, rows, sizeof(int)));
    TRY(nmm_allocate(context, &c->row, rows, sizeof(int)));
    TRY(nmm_allocate(context, &c->rank, rows, sizeof(int)));
    TRY(nmm_allocate(context, &c->queue, rows, sizeof(int)));
    TRY(nmm_allocate(context, &c->first, rows, 3 * sizeof(int)));
    TRY(nmm_allocate(context, &c->offset, rows, 3 * sizeof(long)));
    TRY(nmm_allocate(context, &c->arm, rows, 2 * sizeof(double)));
    TRY(nmm_allocate(context, &c->inverse, rows, 3 * sizeof(double)));
    TRY(nmm_allocate(context, &c->load, rows, 3 * sizeof(double)));
    TRY(nmm_allocate(context, &c->move, rows, 3 * sizeof(double)));
    c->capacity = n;
    return NMM_OK;
}

// --- Parts

// Row of the caller for a row of the iteration; -1: empty, or it has no part in rigid motions.
static int row_of(const nmm_coarse_source *s, int i) {
    const int row = s->order != NULL ? s->order[i] : i;
    return row >= 0 && s->body[row] >= 0 ? row : -1;
}

typedef struct body_box {
    double low[2], high[2];
    int n_row, across, up, base; // cells of a grid over the body; number of its first cell
} body_box;

static void measure_bodies(const nmm_coarse_source *s, body_box *box) {
    for (int i = 0; i < s->n; i++) {
        const int row = row_of(s, i);
        if (row < 0) continue;
        body_box *b = &box[s->body[row]];
        for (int x = 0; x < 2; x++) {
            const double at = s->place[2 * (long)row + x];
            b->low[x] = b->n_row == 0 ? at : nmm_min(b->low[x], at);
            b->high[x] = b->n_row == 0 ? at : nmm_max(b->high[x], at);
        }
        b->n_row += 1;
    }
}

// Cells for the parts of each body, about square; their number.
static int divide_bodies(body_box *box, int n_body, double rows_of_part) {
    int n_cell = 0;
    for (int k = 0; k < n_body; k++) {
        body_box *b = &box[k];
        const double width = b->high[0] - b->low[0], height = b->high[1] - b->low[1];
        const double wanted = nmm_max(1, (double)b->n_row / rows_of_part);
        const double across = height > 0 ? sqrt(wanted * width / height) : wanted;
        b->across = (int)nmm_max(1, nmm_min(wanted, across) + 0.5);
        b->up = (int)nmm_max(1, wanted / b->across + 0.5);
        b->base = n_cell;
        n_cell += b->n_row > 0 ? b->across * b->up : 0;
    }
    return n_cell;
}

static int cell_of(const body_box *b, const double *place) {
    const double width = b->high[0] - b->low[0], height = b->high[1] - b->low[1];
    const double x = width > 0 ? (place[0] - b->low[0]) / width : 0;
    const double y = height > 0 ? (place[1] - b->low[1]) / height : 0;
    const int across = nmm_min_int((int)(x * b->across), b->across - 1);
    const int up = nmm_min_int((int)(y * b->up), b->up - 1);
    return b->base + up * b->across + across;
}

// c->part of each row, parts numbered as they are met.
static nmm_status find_parts(nmm_context *context, nmm_coarse *c, const nmm_coarse_source *s,
                             body_box *box, int n_body, double rows_of_part) {
    const int n_cell = divide_bodies(box, n_body, rows_of_part);
    int *number = NULL;
    TRY(nmm_allocate(context, &number, (size_t)n_cell + 1, sizeof(int)));
    for (int k = 0; k < n_cell; k++)
        number[k] = -1;
    c->n_part = 0;
    for (int i = 0; i < s->n; i++) {
        const int row = row_of(s, i);
        c->part[i] = -1;
        if (row < 0) continue;
        const int cell = cell_of(&box[s->body[row]], s->place + 2 * (long)row);
        if (number[cell] < 0) number[cell] = c->n_part++;
        c->part[i] = number[cell];
    }
    nmm_release(context, &number);
    return NMM_OK;
}

static void list_rows(nmm_coarse *c, int n) {
    memset(c->start, 0, ((size_t)c->n_part + 1) * sizeof(int));
    for (int i = 0; i < n; i++)
        if (c->part[i] >= 0) c->start[c->part[i] + 1] += 1;
    for (int p = 0; p < c->n_part; p++)
        c->start[p + 1] += c->start[p];
    int *filled = c->queue;
    memcpy(filled, c->start, (size_t)c->n_part * sizeof(int));
    for (int i = 0; i < n; i++)
        if (c->part[i] >= 0) c->row[filled[c->part[i]]++] = i;
}

static const double *place_of(const nmm_coarse_source *s, int i) {
    return s->place + 2 * (long)row_of(s, i);
}

// Arms of the rows of a part from their mean place; the sum of their squares.
static double measure_part(nmm_coarse *c, const nmm_coarse_source *s, int p) {
    const int begin = c->start[p], end = c->start[p + 1];
    double centre[2] = {0, 0}, square = 0;
    for (int k = begin; k < end; k++) {
        const double *place = place_of(s, c->row[k]);
        centre[0] += place[0] / (end - begin);
        centre[1] += place[1] / (end - begin);
    }
    for (int k = begin; k < end; k++) {
        const double *place = place_of(s, c->row[k]);
        double *arm = c->arm + 2 * (long)c->row[k];
        arm[0] = place[0] - centre[0];
        arm[1] = place[1] - centre[1];
        square += arm[0] * arm[0] + arm[1] * arm[1];
    }
    return square;
}

// Arms over the root mean square of their lengths.
static void measure_arms(nmm_coarse *c, const nmm_coarse_source *s) {
    const int n_row = c->start[c->n_part];
    double square = 0;
    for (int p = 0; p < c->n_part; p++)
        square += measure_part(c, s, p);
    c->length = square > 0 ? sqrt(square / n_row) : 1;
    for (int k = 0; k < n_row; k++) {
        c->arm[2 * (long)c->row[k]] /= c->length;
        c->arm[2 * (long)c->row[k] + 1] /= c->length;
    }
}

// --- Order of the parts

// Parts in order of distance from `from`, into queue[begin ..]; the end. Met parts get `mark`.
static int visit(const nmm_coarse *c, const nmm_coarse_source *s, int from, int begin, int mark,
                 int *met) {
    int end = begin;
    c->queue[end++] = from;
    met[from] = mark;
    for (int at = begin; at < end; at++) {
        const int p = c->queue[at];
        for (int k = c->start[p]; k < c->start[p + 1]; k++) {
            const int i = c->row[k];
            for (int e = s->row_start[i]; e < s->row_start[i + 1]; e++) {
                const int q = c->part[s->col[e]];
                if (q < 0 || met[q] >= mark) continue;
                met[q] = mark;
                c->queue[end++] = q;
            }
        }
    }
    return end;
}

// Reverse Cuthill-McKee, each connected set from a part at its edge: the last one met from anywhere
// is far away. c->rank becomes the new number of a part.
static void rank_parts(nmm_coarse *c, const nmm_coarse_source *s) {
    int *met = c->first; // not in use yet
    for (int p = 0; p < c->n_part; p++)
        met[p] = 0;
    int done = 0;
    for (int p = 0; p < c->n_part; p++) {
        if (met[p] == 3) continue;
        int end = visit(c, s, p, done, 1, met);
        end = visit(c, s, c->queue[end - 1], done, 2, met);
        done = visit(c, s, c->queue[end - 1], done, 3, met);
    }
    for (int k = 0; k < c->n_part; k++)
        c->rank[c->queue[k]] = c->n_part - 1 - k;
}

// --- Pattern of the factor

static void outline_factor(nmm_coarse *c, const nmm_coarse_source *s) {
    c->n_factor = 0;
    c->work = 0;
    for (int p = 0; p < c->n_part; p++) {
        int least = p;
        for (int k = c->start[p]; k < c->start[p + 1]; k++) {
            const int i = c->row[k];
            for (int e = s->row_start[i]; e < s->row_start[i + 1]; e++) {
                const int q = c->part[s->col[e]];
                if (q >= 0) least = nmm_min_int(least, q);
            }
        }
        for (int r = 3 * p; r < 3 * p + 3; r++) {
            const double length = r - 3 * least;
            c->first[r] = 3 * least;
            c->offset[r] = c->n_factor - 3 * least;
            c->n_factor += r - 3 * least;
            c->work += 0.5 * length * length;
        }
    }
}

double nmm_coarse_rows_of_part(int n_row) {
    return nmm_max(LEAST_ROWS, PART_SHARE * sqrt((double)n_row));
}

static nmm_status divide(nmm_context *context, nmm_coarse *c, const nmm_coarse_source *s,
                         body_box *box, int n_body) {
    int n_row = 0;
    for (int k = 0; k < n_body; k++)
        n_row += box[k].n_row;
    TRY(find_parts(context, c, s, box, n_body, nmm_coarse_rows_of_part(n_row)));
    list_rows(c, s->n);
    rank_parts(c, s);
    for (int i = 0; i < s->n; i++)
        if (c->part[i] >= 0) c->part[i] = c->rank[c->part[i]];
    list_rows(c, s->n);
    measure_arms(c, s);
    outline_factor(c, s);
    if (c->n_factor <= c->factor_capacity) return NMM_OK;
    nmm_release(context, &c->factor);
    nmm_release(context, &c->lower);
    c->factor_capacity = 0;
    TRY(nmm_allocate(context, &c->factor, (size_t)c->n_factor, sizeof(double)));
    TRY(nmm_allocate(context, &c->lower, (size_t)c->n_factor, sizeof(float)));
    c->factor_capacity = c->n_factor;
    return NMM_OK;
}

nmm_status nmm_coarse_divide(nmm_context *context, nmm_coarse *coarse,
                             const nmm_coarse_source *source) {
    TRY(reserve_rows(context, coarse, source->n));
    int n_body = 0;
    for (int i = 0; i < source->n; i++) {
        const int row = row_of(source, i);
        if (row >= 0) n_body = nmm_max_int(n_body, source->body[row] + 1);
    }
    body_box *box = NULL;
    TRY(nmm_allocate(context, &box, (size_t)n_body + 1, sizeof *box));
    measure_bodies(source, box);
    const nmm_status status = divide(context, coarse, source, box, n_body);
    nmm_release(context, &box);
    return status;
}
