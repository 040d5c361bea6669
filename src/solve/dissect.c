// SPDX-License-Identifier: MIT
//
// Cuts by straight lines. Where a line of one direction is best is found in one pass over the
// entries: a row separates all lines between itself and its farthest neighbour. Lines in a few
// directions are tried; the one with few rows on it and halves of like size is taken.

#include "dissect.h"

#include <math.h>
#include <string.h>

// Rows of a part that is not cut any more.
#define LEAF 500

// Places of a line, and part of the rows that is left on either side at least.
#define LINES 128
#define LEAST_SIDE 0.3

// Part of the rows on a line at most: in the plane they are few.
#define MOST_ON_LINE 0.2

// Directions of lines: across, up, and the two between.
#define DIRECTIONS 2

// A part of the rows: to be cut; or one stage as it is.
typedef struct part {
    int begin, end;
    bool whole;
} part;

// More parts than are ever waiting: each cut halves a part, more or less, and adds two.
#define DEEPEST 200

typedef struct dissection {
    const int *row_start, *col;
    const double *place;
    int *row;     // [n_row] rows of a part follow one another
    int *strip;   // [n_row] of a line's direction that a row is in
    int *inside;  // [n_row] number of the part a row is in
    int part;     // number of the part at hand
    int *scratch; // [n_row]
} dissection;

typedef struct line {
    double direction[2], first, scale; // strip of a place: scale * (place . direction - first)
    int strip;                         // first one on the right
    bool left;                         // rows on its left side separate, else on its right
    double cost;
} line;

void nmm_dissect_release(nmm_context *context, nmm_dissect_room *room) {
    nmm_release(context, &room->number);
    *room = (nmm_dissect_room){0};
}

static double along(const double direction[2], const double *place) {
    return direction[0] * place[0] + direction[1] * place[1];
}

// Strips of equal width, from the first to the last row of a part.
static void find_strips(dissection *d, const part *p, line *l) {
    double least = INFINITY, most = -INFINITY;
    for (int k = p->begin; k < p->end; k++) {
        const double x = along(l->direction, d->place + 2 * (long)d->row[k]);
        least = nmm_min(least, x);
        most = nmm_max(most, x);
    }
    l->first = least;
    l->scale = most > least ? LINES * (1 - 1e-9) / (most - least) : 0;
    for (int k = p->begin; k < p->end; k++) {
        const double x = along(l->direction, d->place + 2 * (long)d->row[k]);
        d->strip[d->row[k]] = (int)(l->scale * (x - l->first));
    }
}

// The best line of a direction.
static void find_line(dissection *d, const part *p, line *l) {
    int rows[LINES + 1] = {0}, left[LINES + 1] = {0}, right[LINES + 1] = {0};
    find_strips(d, p, l);
    for (int k = p->begin; k < p->end; k++) {
        const int i = d->row[k], own = d->strip[i];
        int first = own, last = own;
        for (int e = d->row_start[i]; e < d->row_start[i + 1]; e++) {
            const int other = d->col[e];
            if (d->inside[other] != d->part) continue;
            first = nmm_min_int(first, d->strip[other]);
            last = nmm_max_int(last, d->strip[other]);
        }
        // Lines before strip own + 1 .. last have it on their left with a neighbour on the right.
        rows[own + 1]++;
        left[own + 1]++;
        left[last + 1]--;
        right[first + 1]++;
        right[own + 1]--;
    }
    const double n = p->end - p->begin;
    l->cost = INFINITY;
    for (int s = 1, n_left = 0, on_left = 0, on_right = 0; s < LINES; s++) {
        n_left += rows[s];
        on_left += left[s];
        on_right += right[s];
        const int on = nmm_min_int(on_left, on_right);
        const double part_left = n_left / n;
        if (part_left < LEAST_SIDE || part_left > 1 - LEAST_SIDE) continue;
        const double skew = 2 * part_left - 1;
        const double cost = on * (1 + 2 * skew * skew);
        if (cost >= l->cost || on > MOST_ON_LINE * n) continue;
        l->cost = cost;
        l->strip = s;
        l->left = on_left <= on_right;
    }
}

static bool separates(const dissection *d, const line *l, int i) {
    if ((d->strip[i] < l->strip) != l->left) return false;
    for (int e = d->row_start[i]; e < d->row_start[i + 1]; e++) {
        const int other = d->col[e];
        if (d->inside[other] == d->part && (d->strip[other] < l->strip) != l->left) return true;
    }
    return false;
}

// Rows on the left, on the right, and on the line, in this order; the first of each in begin.
static void divide(dissection *d, const part *p, const line *l, int begin[3]) {
    int *side = d->scratch, n[3] = {0};
    for (int k = p->begin; k < p->end; k++) {
        const int i = d->row[k];
        side[k] = separates(d, l, i) ? 2 : d->strip[i] >= l->strip;
        n[side[k]]++;
    }
    begin[0] = p->begin;
    begin[1] = begin[0] + n[0];
    begin[2] = begin[1] + n[1];
    int at[3] = {begin[0], begin[1], begin[2]};
    // Strips have served.
    int *moved = d->strip;
    for (int k = p->begin; k < p->end; k++)
        moved[at[side[k]]++] = d->row[k];
    memcpy(d->row + p->begin, moved + p->begin, (size_t)(p->end - p->begin) * sizeof(int));
}

// False: no line is worth it.
static bool cut(dissection *d, const part *p, int begin[3]) {
    static const double direction[DIRECTIONS][2] = {{1, 0}, {0, 1}};
    line best = {.cost = INFINITY};
    d->part++;
    for (int k = p->begin; k < p->end; k++)
        d->inside[d->row[k]] = d->part;
    for (int k = 0; k < DIRECTIONS; k++) {
        line l = {.direction = {direction[k][0], direction[k][1]}};
        find_line(d, p, &l);
        if (l.cost < best.cost) best = l;
    }
    if (!(best.cost < INFINITY)) return false;
    line l = best;
    find_strips(d, p, &l);
    divide(d, p, &best, begin);
    return true;
}

nmm_status nmm_dissect(nmm_context *context, nmm_dissect_room *room, int n_row,
                       const int *row_start, const int *col, const double *place,
                       nmm_stages *stages) {
    TRY(nmm_grow(context, &room->number, &room->capacity, 5 * n_row + 1, sizeof(int)));
    int *number = room->number;
    dissection d = {.row_start = row_start,
                    .col = col,
                    .place = place,
                    .row = number,
                    .strip = number + n_row,
                    .inside = number + 2 * (long)n_row,
                    .scratch = number + 3 * (long)n_row};
    *stages = (nmm_stages){.row = d.row, .start = number + 4 * (long)n_row};
    for (int i = 0; i < n_row; i++) {
        d.row[i] = i;
        d.inside[i] = 0;
    }
    part waiting[DEEPEST];
    int n_waiting = 1;
    waiting[0] = (part){0, n_row, false};
    while (n_waiting > 0) {
        const part p = waiting[--n_waiting];
        int begin[3];
        if (p.whole || p.end - p.begin <= LEAF || n_waiting + 3 > DEEPEST || !cut(&d, &p, begin)) {
            if (p.end > p.begin) stages->start[stages->n++] = p.begin;
            continue;
        }
        waiting[n_waiting++] = (part){begin[2], p.end, true};
        waiting[n_waiting++] = (part){begin[1], begin[2], false};
        waiting[n_waiting++] = (part){begin[0], begin[1], false};
    }
    stages->start[stages->n] = n_row;
    return NMM_OK;
}
