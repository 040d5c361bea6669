// SPDX-License-Identifier: MIT
//
// Who makes which fronts of a factor, and where their rests wait. From the top of the tree down,
// the largest subtree is opened until all are small. What lies below is divided into parts, whole
// subtrees; of the fronts that were opened, each is a part of its own, which waits for those below
// it, but for the few at the top that all threads share, because too few others are left beside
// them. Geist and Ng, Int. J. Parallel Programming 18 (1989) 291.

#include "factor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Nanoseconds that threads wait for each other.
#define PER_WAIT 2000.0

// Unknowns from one waiting to the next in a shared front, about; what is lost there besides.
#define PER_PANEL 32
#define SHARED_LOSS 1.2

// Parts for each thread, about: as many as let them end at about the same time.
#define PARTS 16

// The largest subtree that is not opened, as part of a thread's work; subtrees opened at most, for
// each thread.
#define LARGEST (1.0 / 12)
#define OPENED 16

// Marks of fronts above subtrees until parts are numbered.
enum { SHARED = -1, ALONE = -2 };

// Subtrees on the way down.
typedef struct cut {
    double *work;   // [n_front] of the subtree below and with a front
    double *path;   // [n_front] of opened fronts: work from there until shared fronts are left
    int *candidate; // tops of subtrees to be opened
    int n_candidate;
    int *opened; // tops of those opened, in this order
    int n_opened;
} cut;

static double work_of(const nmm_factor *f, int front) {
    return nmm_front_work(f->front[front].n_pivot, f->front[front].n_row);
}

static void measure_subtrees(const nmm_factor *f, double *work) {
    for (int i = 0; i < f->n_front; i++)
        work[i] = 0;
    for (int i = 0; i < f->n_front; i++) {
        const int parent = f->front[i].parent;
        work[i] += work_of(f, i);
        if (parent >= 0) work[parent] += work[i];
    }
}

// --- Fronts above subtrees

static void add_candidate(cut *c, int front, double enough) {
    if (c->work[front] > enough) c->candidate[c->n_candidate++] = front;
}

static int take_largest(cut *c) {
    int at = 0;
    for (int k = 1; k < c->n_candidate; k++)
        if (c->work[c->candidate[k]] > c->work[c->candidate[at]]) at = k;
    const int front = c->candidate[at];
    c->candidate[at] = c->candidate[--c->n_candidate];
    return front;
}

static void open_subtrees(const nmm_factor *f, cut *c, int n_thread) {
    const double enough = LARGEST * f->work / n_thread;
    for (int i = 0; i < f->n_front; i++)
        if (f->front[i].parent < 0) add_candidate(c, i, enough);
    while (c->n_candidate > 0 && c->n_opened < OPENED * n_thread) {
        const int i = take_largest(c);
        c->opened[c->n_opened++] = i;
        for (int k = f->front[i].child; k >= 0; k = f->front[k].sibling)
            add_candidate(c, k, enough);
    }
}

// Time of a front that threads share.
static double shared_time(const nmm_factor *f, int front, int n_thread) {
    const double work = work_of(f, front);
    if (work < NMM_SMALL_FRONT) return work;
    return SHARED_LOSS * work / n_thread +
           PER_WAIT * (4 + 4.0 * f->front[front].n_pivot / PER_PANEL);
}

// Time until only the first `n_shared` opened fronts are left, at least: no thread is done before
// what is below a front is, and then what is above it.
static double time_of_parts(const nmm_factor *f, cut *c, int n_shared, int n_thread) {
    double all = f->work, time = 0;
    for (int k = 0; k < n_shared; k++) {
        c->path[c->opened[k]] = 0;
        all -= work_of(f, c->opened[k]);
    }
    for (int k = n_shared; k < c->n_opened; k++) {
        const int i = c->opened[k], parent = f->front[i].parent;
        const double own = work_of(f, i);
        c->path[i] = own + (parent >= 0 ? c->path[parent] : 0);
        time = nmm_max(time, c->path[i] + (c->work[i] - own) / n_thread);
    }
    return nmm_max(time, all / n_thread);
}

// How many of the opened fronts the threads share; the time that this promises.
static int find_shared(const nmm_factor *f, cut *c, int n_thread, double *time) {
    int best = 0;
    double above = 0;
    *time = f->work;
    for (int k = 0; k <= c->n_opened; k++) {
        const double all = time_of_parts(f, c, k, n_thread) + above;
        if (all < *time) {
            *time = all;
            best = k;
        }
        if (k < c->n_opened) above += shared_time(f, c->opened[k], n_thread);
    }
    time_of_parts(f, c, best, n_thread);
    return best;
}

// --- Parts

static int by_path(const void *a, const void *b) {
    const nmm_factor_part *p = a, *q = b;
    if (p->path != q->path) return p->path > q->path ? -1 : 1;
    return (p->first > q->first) - (p->first < q->first);
}

static bool is_opened(const nmm_factor *f, int front) {
    return front < 0 || f->front[front].part < 0;
}

static nmm_status close_part(nmm_context *context, nmm_factor *f, nmm_factor_part *open) {
    if (open->end == open->first) return NMM_OK;
    TRY(nmm_grow(context, &f->part, &f->part_capacity, f->n_part + 1, sizeof *f->part));
    f->part[f->n_part++] = *open;
    *open = (nmm_factor_part){0};
    return NMM_OK;
}

// Fronts first .. end - 1, a whole subtree or one opened front: with those before them where they
// leave what is left to the same front. Until parts are numbered `above` is that front.
static nmm_status add_fronts(nmm_context *context, nmm_factor *f, const cut *c,
                             nmm_factor_part *open, nmm_factor_part piece) {
    const int parent = f->front[piece.end - 1].parent;
    if (open->above != parent) TRY(close_part(context, f, open));
    if (open->end == open->first) open->first = piece.first;
    open->end = piece.end;
    open->above = parent;
    open->work += piece.work;
    open->path = open->work + (parent >= 0 ? c->path[parent] : 0);
    return NMM_OK;
}

// The fronts that are not shared, in pieces that end where a subtree does, and the shared ones.
static nmm_status list_parts(nmm_context *context, nmm_factor *f, const cut *c, double enough) {
    nmm_factor_part open = {0};
    int first = 0;
    f->n_top = f->n_part = 0;
    for (int i = 0; i < f->n_front; i++) {
        const int mark = f->front[i].part;
        if (mark < 0) TRY(close_part(context, f, &open));
        if (mark == SHARED) f->top[f->n_top++] = i;
        const double work = mark == ALONE ? work_of(f, i) : c->work[i];
        if (mark != SHARED && is_opened(f, f->front[i].parent)) {
            TRY(add_fronts(context, f, c, &open, (nmm_factor_part){first, i + 1, .work = work}));
        }
        if (open.work >= enough || mark == ALONE) TRY(close_part(context, f, &open));
        if (is_opened(f, i) || is_opened(f, f->front[i].parent)) first = i + 1;
    }
    return close_part(context, f, &open);
}

// Numbers of parts, those with long ways to go first, so that each comes before the one above it.
static nmm_status number_parts(nmm_context *context, nmm_factor *f) {
    qsort(f->part, (size_t)f->n_part, sizeof *f->part, by_path);
    for (int k = 0; k < f->n_part; k++)
        for (int i = f->part[k].first; i < f->part[k].end; i++)
            f->front[i].part = k;
    for (int k = 0; k < f->n_part; k++) {
        nmm_factor_part *part = &f->part[k];
        part->above = part->above < 0 ? -1 : f->front[part->above].part;
        if (part->above >= 0) f->part[part->above].n_below++;
    }
    return nmm_grow(context, &f->part_state, &f->state_capacity, 2 * f->n_part,
                    sizeof *f->part_state);
}

// The parts, and the fronts above them in order.
static nmm_status divide(nmm_context *context, nmm_factor *f, int n_thread) {
    cut c = {
        .work = f->x, .path = f->x + f->n_row, .candidate = f->tree, .opened = f->tree + f->n_row};
    measure_subtrees(f, c.work);
    if (n_thread > 1) open_subtrees(f, &c, n_thread);
    const int n_shared = find_shared(f, &c, n_thread, &f->time);
    TRY(nmm_grow(context, &f->top, &f->top_capacity, 3 * n_shared + 1, sizeof(int)));
    double below = f->work;
    for (int i = 0; i < f->n_front; i++)
        f->front[i].part = 0;
    for (int k = 0; k < c.n_opened; k++) {
        f->front[c.opened[k]].part = k < n_shared ? SHARED : ALONE;
        below -= work_of(f, c.opened[k]);
    }
    TRY(list_parts(context, f, &c, n_thread > 1 ? below / (PARTS * n_thread) : INFINITY));
    return number_parts(context, f);
}

static bool is_in_top(const nmm_factor *f, int front) {
    return front >= 0 && f->front[front].part == SHARED;
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

// The front takes what its children left, and leaves its own.
static void pile_up(nmm_factor *f, int i, const unsigned char *side, pair_of_stacks *s) {
    nmm_front *front = &f->front[i];
    const int own = side[i];
    if (!front->kept) {
        front->rest[s->kind] = s->top[own];
        s->top[own] += nmm_front_rest(front, s->kind);
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

// What is kept has a place of its own, from n on: matrices if all were kept at the same time.
static long keep_all(nmm_factor *f, int kind, long n) {
    for (int i = 0; i < f->n_front; i++) {
        nmm_front *front = &f->front[i];
        if (!front->kept) continue;
        front->rest[kind] = n;
        n += nmm_front_rest(front, kind);
    }
    return n;
}

static int count_kept(const nmm_factor *f) {
    int n = 0;
    for (int i = 0; i < f->n_front; i++)
        n += f->front[i].kept;
    return n;
}

static nmm_status lay_out_stacks(nmm_context *context, nmm_factor *f) {
    unsigned char *side = (unsigned char *)f->tree;
    for (int i = f->n_front - 1; i >= 0; i--) {
        nmm_front *front = &f->front[i];
        const int p = front->parent;
        side[i] = p < 0 ? 0 : (unsigned char)(1 - side[p]);
        front->kept = front->part >= 0 && p >= 0 && f->front[p].part != front->part;
    }
    for (int kind = 0; kind < 2; kind++) {
        nmm_factor_stack *stack = &f->stack[kind];
        stack->n_own = 0;
        for (int k = 0; k < f->n_part; k++) {
            const long n = pile_up_part(f, &f->part[k], side, kind);
            stack->n_own = n > stack->n_own ? n : stack->n_own;
        }
    }
    TRY(nmm_pool_reserve(context, &f->pool, count_kept(f)));
    f->stack[0].n_top = pile_up_top(f, side);
    f->stack[0].n_kept = keep_all(f, 0, f->stack[0].n_top);
    for (int k = 0; k < f->n_top; k++)
        f->front[f->top[k]].kept = true;
    // Vectors are small: each front of the top has a place of its own, so that rounds can be.
    f->stack[1].n_kept = keep_all(f, 1, 0);
    return NMM_OK;
}

nmm_status nmm_factor_share(nmm_context *context, nmm_factor *factor, int n_thread) {
    if (factor->n_thread == n_thread) return NMM_OK;
    // Until all is done.
    factor->n_thread = 0;
    TRY(divide(context, factor, n_thread));
    list_rounds(factor);
    TRY(lay_out_stacks(context, factor));
    factor->n_thread = n_thread;
    return NMM_OK;
}
