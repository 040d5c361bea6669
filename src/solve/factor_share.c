// SPDX-License-Identifier: MIT
//
// Who makes which fronts of a factor, and where their rests wait. From the top of the tree down,
// the largest subtree is opened, its top front becoming one that all threads share, as long as that
// promises an earlier end. What lies below is divided into parts, whole subtrees, of which each
// thread takes one after the other. Geist and Ng, Int. J. Parallel Programming 18 (1989) 291.

#include "factor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Nanoseconds that threads wait for each other.
#define PER_WAIT 2000.0

// Unknowns from one waiting to the next in a shared front, about.
#define PER_PANEL 32

// Parts for each thread, about: as many as let them end at about the same time.
#define PARTS 16

// Subtrees opened at most, for each thread.
#define OPENED 16

// Subtrees on the way down.
typedef struct cut {
    double *work;   // [n_front] of the subtree below and with a front
    int *candidate; // tops of subtrees not opened that are worth it
    int n_candidate;
    int *opened; // tops of those opened, in this order
    int n_opened;
    double below, above; // work in subtrees; time of shared fronts
} cut;

// Time of a front that threads share.
static double shared_time(const nmm_front *front, int n_thread) {
    const double work = nmm_front_work(front->n_pivot, front->n_row);
    if (work < NMM_SMALL_FRONT) return work;
    return work / n_thread + PER_WAIT * (4 + 4.0 * front->n_pivot / PER_PANEL);
}

static void add_candidate(cut *c, int front, double least) {
    if (c->work[front] >= least) c->candidate[c->n_candidate++] = front;
}

// -1: none is left.
static int take_largest(cut *c) {
    if (c->n_candidate == 0) return -1;
    int at = 0;
    for (int k = 1; k < c->n_candidate; k++)
        if (c->work[c->candidate[k]] > c->work[c->candidate[at]]) at = k;
    const int front = c->candidate[at];
    c->candidate[at] = c->candidate[--c->n_candidate];
    return front;
}

// The number of subtrees to open; the time that this promises.
static int open_subtrees(const nmm_factor *f, cut *c, int n_thread, double *time) {
    const double least = f->work / (4 * PARTS * n_thread);
    for (int i = 0; i < f->n_front; i++)
        if (f->front[i].parent < 0) add_candidate(c, i, least);
    int best = 0;
    *time = f->work;
    for (;;) {
        const int i = take_largest(c);
        // No thread is done before the largest part is, and the last part comes late.
        const double largest = i < 0 ? 0 : c->work[i];
        const double end = nmm_max(largest, c->below / n_thread + 0.1 * largest) + c->above;
        if (end < *time) {
            *time = end;
            best = c->n_opened;
        }
        if (i < 0 || c->n_opened == OPENED * n_thread) return best;
        c->opened[c->n_opened++] = i;
        c->below -= nmm_front_work(f->front[i].n_pivot, f->front[i].n_row);
        c->above += shared_time(&f->front[i], n_thread);
        for (int k = f->front[i].child; k >= 0; k = f->front[k].sibling)
            add_candidate(c, k, least);
    }
}

static void measure_subtrees(const nmm_factor *f, double *work) {
    for (int i = 0; i < f->n_front; i++)
        work[i] = 0;
    for (int i = 0; i < f->n_front; i++) {
        const nmm_front *front = &f->front[i];
        work[i] += nmm_front_work(front->n_pivot, front->n_row);
        if (front->parent >= 0) work[front->parent] += work[i];
    }
}

// --- Parts

static int by_work(const void *a, const void *b) {
    const nmm_factor_part *p = a, *q = b;
    if (p->work != q->work) return p->work > q->work ? -1 : 1;
    return (p->first > q->first) - (p->first < q->first);
}

static nmm_status close_part(nmm_context *context, nmm_factor *f, nmm_factor_part *open) {
    if (open->end == open->first) return NMM_OK;
    TRY(nmm_grow(context, &f->part, &f->part_capacity, f->n_part + 1, sizeof *f->part));
    f->part[f->n_part++] = *open;
    *open = (nmm_factor_part){0};
    return NMM_OK;
}

static bool is_in_top(const nmm_factor *f, int front) {
    return front < 0 || f->front[front].part < 0;
}

// The fronts between those of the top, in pieces that end where a subtree does.
static nmm_status list_parts(nmm_context *context, nmm_factor *f, const double *work,
                             double enough) {
    nmm_factor_part open = {0};
    f->n_top = f->n_part = 0;
    for (int i = 0; i < f->n_front; i++) {
        if (is_in_top(f, i)) {
            TRY(close_part(context, f, &open));
            f->top[f->n_top++] = i;
            continue;
        }
        if (open.end == open.first) open.first = i;
        open.end = i + 1;
        if (!is_in_top(f, f->front[i].parent)) continue;
        open.work += work[i];
        if (open.work >= enough) TRY(close_part(context, f, &open));
    }
    TRY(close_part(context, f, &open));
    qsort(f->part, (size_t)f->n_part, sizeof *f->part, by_work);
    for (int k = 0; k < f->n_part; k++)
        for (int i = f->part[k].first; i < f->part[k].end; i++)
            f->front[i].part = k;
    return NMM_OK;
}

// The parts, and the fronts above them in order.
static nmm_status divide(nmm_context *context, nmm_factor *f) {
    const int n_thread = f->n_thread;
    cut c = {.work = f->x, .below = f->work, .candidate = f->tree, .opened = f->tree + f->n_row};
    measure_subtrees(f, c.work);
    f->time = f->work;
    const int n_top = n_thread > 1 ? open_subtrees(f, &c, n_thread, &f->time) : 0;
    TRY(nmm_grow(context, &f->top, &f->top_capacity, 3 * n_top + 1, sizeof(int)));
    double below = f->work;
    for (int i = 0; i < f->n_front; i++)
        f->front[i].part = 0;
    for (int k = 0; k < n_top; k++) {
        f->front[c.opened[k]].part = -1;
        below -= nmm_front_work(f->front[c.opened[k]].n_pivot, f->front[c.opened[k]].n_row);
    }
    const double enough = n_thread > 1 ? below / (PARTS * n_thread) : INFINITY;
    return list_parts(context, f, c.work, enough);
}

// Fronts of the top by how many of them lie below them at most: rounds.
static void list_rounds(nmm_factor *f) {
    int *height = f->tree;
    f->round_front = f->top + f->n_top;
    f->round_start = f->round_front + f->n_top;
    f->n_round = 0;
    for (int k = 0; k < f->n_top; k++) {
        const nmm_front *front = &f->front[f->top[k]];
        int *own = &height[f->top[k]];
        *own = 0;
        for (int c = front->child; c >= 0; c = f->front[c].sibling)
            if (is_in_top(f, c)) *own = nmm_max_int(*own, height[c] + 1);
        f->n_round = nmm_max_int(f->n_round, *own + 1);
    }
    int n = 0;
    for (int round = 0; round < f->n_round; round++) {
        f->round_start[round] = n;
        for (int k = 0; k < f->n_top; k++)
            if (height[f->top[k]] == round) f->round_front[n++] = f->top[k];
    }
    f->round_start[f->n_round] = n;
}

// --- The stacks

// Two stacks: what is left of a front is on the other one than what is left of its children, so
// that all that a front takes lies on top.
typedef struct pair_of_stacks {
    int kind; // what it is for: matrices 0, vectors 1
    long top[2], most[2];
} pair_of_stacks;

static long size_of_rest(const nmm_front *front, int kind) {
    return kind == 0 ? (long)front->padded * front->padded : front->padded;
}

// The front takes what its children left, and leaves its own.
static void pile_up(nmm_factor *f, int i, const unsigned char *side, pair_of_stacks *s) {
    nmm_front *front = &f->front[i];
    const int own = side[i];
    if (!front->kept) {
        front->rest[s->kind] = s->top[own];
        s->top[own] += size_of_rest(front, s->kind);
        s->most[own] = s->top[own] > s->most[own] ? s->top[own] : s->most[own];
    }
    // The first of those that came from here lies lowest.
    for (int c = front->child; c >= 0; c = f->front[c].sibling) {
        if (f->front[c].part != front->part) continue;
        s->top[1 - own] = f->front[c].rest[s->kind];
        return;
    }
}

// The second stack begins where the first may end.
static void place_second(nmm_factor *f, int i, const unsigned char *side, const pair_of_stacks *s) {
    if (side[i] == 1 && !f->front[i].kept) f->front[i].rest[s->kind] += s->most[0];
}

static long pile_up_part(nmm_factor *f, const nmm_factor_part *part, const unsigned char *side,
                         int kind) {
    pair_of_stacks s = {.kind = kind};
    for (int i = part->first; i < part->end; i++)
        pile_up(f, i, side, &s);
    for (int i = part->first; i < part->end; i++)
        place_second(f, i, side, &s);
    return s.most[0] + s.most[1];
}

static long pile_up_top(nmm_factor *f, const unsigned char *side) {
    pair_of_stacks s = {0};
    for (int k = 0; k < f->n_top; k++)
        pile_up(f, f->top[k], side, &s);
    for (int k = 0; k < f->n_top; k++)
        place_second(f, f->top[k], side, &s);
    return s.most[0] + s.most[1];
}

// What parts leave for the top stays until the end, behind what the top piles up.
static long keep_all(nmm_factor *f, int kind, long n) {
    for (int i = 0; i < f->n_front; i++) {
        nmm_front *front = &f->front[i];
        if (!front->kept) continue;
        front->rest[kind] = n;
        n += size_of_rest(front, kind);
    }
    return n;
}

static void lay_out_stacks(nmm_factor *f) {
    unsigned char *side = (unsigned char *)f->tree;
    for (int i = f->n_front - 1; i >= 0; i--) {
        nmm_front *front = &f->front[i];
        const int p = front->parent;
        side[i] = p < 0 ? 0 : (unsigned char)(1 - side[p]);
        front->kept = front->part >= 0 && p >= 0 && is_in_top(f, p);
    }
    for (int kind = 0; kind < 2; kind++) {
        nmm_factor_stack *stack = &f->stack[kind];
        stack->n_own = 0;
        for (int k = 0; k < f->n_part; k++) {
            const long n = pile_up_part(f, &f->part[k], side, kind);
            stack->n_own = n > stack->n_own ? n : stack->n_own;
        }
    }
    f->stack[0].n_kept = keep_all(f, 0, pile_up_top(f, side));
    for (int k = 0; k < f->n_top; k++)
        f->front[f->top[k]].kept = true;
    // Vectors are small: each front of the top has a place of its own, so that rounds can be.
    f->stack[1].n_kept = keep_all(f, 1, 0);
}

nmm_status nmm_factor_share(nmm_context *context, nmm_factor *factor, int n_thread) {
    if (factor->n_thread == n_thread) return NMM_OK;
    factor->n_thread = n_thread;
    const nmm_status status = divide(context, factor);
    if (status == NMM_OK) {
        list_rounds(factor);
        lay_out_stacks(factor);
    } else {
        factor->n_thread = 0;
    }
    return status;
}
