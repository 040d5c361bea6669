// SPDX-License-Identifier: MIT
//
// The shape of a factor: order, fronts, and the place of everything. Fronts begin as the steps of
// the order and are joined with their parents where that promises less work, a few zeros more but
// fewer and larger fronts. Liu, SIAM Review 34 (1992) 82.

#include "factor.h"

#include <string.h>

// Nanoseconds of one core of about 3 GHz, between those with AVX2 and those with AVX-512.
#define PER_FRONT 48.0
#define PER_ROW 3.2   // of a front
#define PER_PLACE 0.8 // of a front, both of 2x2 blocks
#define PER_PRODUCT 0.048

// Blocks of a row from which on cuts gain more than they cost.
#define BLOCKS_TO_CUT 6

// By steps of the order, later by fronts, or by rows in order of elimination.
typedef struct tree {
    nmm_order order;
    int *n_pivot;         // rows of the front that ends with this step; 0: it is part of another
    int *top;             // last step of its front
    int *child, *sibling; // first child; next child of its parent; -1: none
    int *first;           // first pivot of a front by its top
    int *front;           // number of a front by its top, or by a row
    int *mark;            // scratch
} tree;

static nmm_status place_tree(nmm_context *context, nmm_factor *f, tree *t) {
    int **const array[] = {&t->order.row, &t->order.size, &t->order.n_below, &t->order.parent,
                           &t->n_pivot,   &t->top,        &t->child,         &t->sibling,
                           &t->first,     &t->front,      &t->mark};
    const int n_array = sizeof array / sizeof *array;
    TRY(nmm_grow(context, &f->tree, &f->tree_capacity, n_array * f->n_row, sizeof(int)));
    for (int k = 0; k < n_array; k++)
        *array[k] = f->tree + (long)k * f->n_row;
    return NMM_OK;
}

// --- Memory

static void forget_pattern(nmm_factor *f) {
    f->n_row = f->n_block = -1;
}

bool nmm_factor_knows(const nmm_factor *factor, const nmm_bsr *K) {
    const int n_block = K->n_row > 0 ? K->row_start[K->n_row] : 0;
    return factor->row_start != NULL && factor->n_row == K->n_row && factor->n_block == n_block &&
           memcmp(factor->row_start, K->row_start, ((size_t)K->n_row + 1) * sizeof(int)) == 0 &&
           memcmp(factor->col, K->col, (size_t)n_block * sizeof(int)) == 0;
}

static void release_rows(nmm_context *context, nmm_factor *f) {
    nmm_release(context, &f->row_start);
    nmm_release(context, &f->order);
    nmm_release(context, &f->rank);
    nmm_release(context, &f->front);
    nmm_release(context, &f->x);
    f->row_capacity = 0;
}

void nmm_factor_destroy(nmm_context *context, nmm_factor *factor) {
    release_rows(context, factor);
    nmm_release(context, &factor->col);
    nmm_release(context, &factor->entry);
    nmm_release(context, &factor->row);
    nmm_release(context, &factor->place);
    nmm_release(context, &factor->run);
    nmm_release(context, &factor->value);
    for (int k = 0; k < 2; k++)
        nmm_release(context, &factor->stack[k].number);
    nmm_release(context, &factor->tree);
    nmm_release(context, &factor->part);
    nmm_release(context, &factor->part_state);
    nmm_release(context, &factor->top);
    nmm_release(context, &factor->team);
    nmm_pool_release(context, &factor->pool);
    nmm_dissect_release(context, &factor->stage_room);
    nmm_order_release(context, &factor->room);
    *factor = (nmm_factor){0};
}

static nmm_status reserve_rows(nmm_context *context, nmm_factor *f, int n) {
    if (n <= f->row_capacity) return NMM_OK;
    release_rows(context, f);
    const size_t rows = (size_t)n + 1;
    TRY(nmm_allocate(context, &f->row_start, rows, sizeof(int)));
    TRY(nmm_allocate(context, &f->order, rows, sizeof(int)));
    TRY(nmm_allocate(context, &f->rank, rows, sizeof(int)));
    TRY(nmm_allocate(context, &f->front, rows, sizeof *f->front));
    TRY(nmm_allocate(context, &f->x, rows, 2 * sizeof(double)));
    f->row_capacity = n;
    return NMM_OK;
}

// Numbers need not survive a new pattern. A little more, for patterns that change a little.
#define MORE_AT_MOST 1000000
static nmm_status reserve_numbers(nmm_context *context, double **array, long *capacity, long n) {
    if (n <= *capacity) return NMM_OK;
    nmm_release(context, array);
    *capacity = 0;
    const long more = n / 4 < MORE_AT_MOST ? n / 4 : MORE_AT_MOST;
    TRY(nmm_allocate(context, array, (size_t)(n + more), sizeof(double)));
    *capacity = n + more;
    return NMM_OK;
}

// --- Fronts

double nmm_front_work(int n_pivot, int n_row) {
    const double n = 2.0 * n_pivot, m = 2.0 * n_row, rows = n_pivot + n_row;
    const double product = n * (n * n / 6 + 0.5 * m * n + 0.5 * m * m);
    return PER_FRONT + PER_ROW * rows + PER_PLACE * 0.5 * rows * rows + PER_PRODUCT * product;
}

// A child and its parent become one front where that is less work.
static void join_fronts(tree *t) {
    const int n = t->order.n_step, *parent = t->order.parent, *n_below = t->order.n_below;
    for (int k = 0; k < n; k++)
        t->child[k] = -1;
    for (int k = n - 1; k >= 0; k--) {
        t->sibling[k] = parent[k] >= 0 ? t->child[parent[k]] : -1;
        if (parent[k] >= 0) t->child[parent[k]] = k;
    }
    for (int p = 0; p < n; p++) {
        t->n_pivot[p] = t->order.size[p];
        t->top[p] = p;
        for (int c = t->child[p]; c >= 0; c = t->sibling[c]) {
            const double apart = nmm_front_work(t->n_pivot[c], n_below[c]) +
                                 nmm_front_work(t->n_pivot[p], n_below[p]);
            if (nmm_front_work(t->n_pivot[c] + t->n_pivot[p], n_below[p]) > apart) continue;
            t->n_pivot[p] += t->n_pivot[c];
            t->n_pivot[c] = 0;
            t->top[c] = p;
        }
    }
    for (int k = n - 1; k >= 0; k--)
        t->top[k] = t->top[t->top[k]];
}

// The top of the front that takes what is left of the one with this top; -1: none.
static int parent_top(const tree *t, int top) {
    const int parent = t->order.parent[top];
    return parent < 0 ? -1 : t->top[parent];
}

// Number the fronts so that those of a subtree follow one another, its top last, and the pivots
// with them: sizes of subtrees from below, then places from above. Until all fronts below one have
// their places, `first` and `front` of it are where the next subtree goes.
static void number_fronts(nmm_factor *f, tree *t) {
    const int n = t->order.n_step;
    int *row_inside = t->child, *front_inside = t->sibling; // free by now
    memset(row_inside, 0, (size_t)n * sizeof(int));
    memset(front_inside, 0, (size_t)n * sizeof(int));
    for (int k = 0; k < n; k++) {
        if (t->n_pivot[k] == 0) continue;
        row_inside[k] += t->n_pivot[k];
        front_inside[k] += 1;
        const int p = parent_top(t, k);
        if (p < 0) continue;
        row_inside[p] += row_inside[k];
        front_inside[p] += front_inside[k];
    }
    int next_row = 0, next_front = 0;
    for (int k = n - 1; k >= 0; k--) {
        if (t->n_pivot[k] == 0) continue;
        const int p = parent_top(t, k);
        int *row = p < 0 ? &next_row : &t->first[p], *front = p < 0 ? &next_front : &t->front[p];
        t->first[k] = *row;
        t->front[k] = *front;
        *row += row_inside[k];
        *front += front_inside[k];
    }
    f->n_front = next_front;
    for (int k = 0; k < n; k++) {
        if (t->n_pivot[k] == 0) continue;
        const int p = parent_top(t, k);
        f->front[t->front[k]] = (nmm_front){.first = t->first[k],
                                            .n_pivot = t->n_pivot[k],
                                            .n_row = t->order.n_below[k],
                                            .parent = p < 0 ? -1 : t->front[p],
                                            .child = -1};
    }
}

// The order of elimination that the fronts ask for.
static void rank_rows(nmm_factor *f, tree *t) {
    const int *row = t->order.row;
    for (int k = 0; k < t->order.n_step; k++) {
        int *first = &t->first[t->top[k]];
        for (int i = 0; i < t->order.size[k]; i++)
            f->order[(*first)++] = *row++;
    }
    for (int k = 0; k < f->n_row; k++)
        f->rank[f->order[k]] = k;
    for (int i = 0; i < f->n_front; i++)
        for (int k = 0; k < f->front[i].n_pivot; k++)
            t->front[f->front[i].first + k] = i;
}

// Children of each front; rows below the pivots, ascending because rows come in order.
static void list_rows(nmm_factor *f, tree *t) {
    int *filled = t->top, *mark = t->mark, n_list = 0;
    for (int i = 0; i < f->n_front; i++) {
        filled[i] = f->front[i].row = n_list;
        mark[i] = -1;
        n_list += f->front[i].n_row;
    }
    for (int i = f->n_front - 1; i >= 0; i--) {
        const int p = f->front[i].parent;
        f->front[i].sibling = p < 0 ? -1 : f->front[p].child;
        if (p >= 0) f->front[p].child = i;
    }
    for (int k = 0; k < f->n_row; k++) {
        const int row = f->order[k], own = t->front[k];
        mark[own] = k;
        for (int e = f->row_start[row]; e < f->row_start[row + 1]; e++) {
            const int other = f->rank[f->col[e]];
            if (other >= k) continue;
            for (int i = t->front[other]; mark[i] != k; i = f->front[i].parent) {
                f->row[filled[i]++] = k;
                mark[i] = k;
            }
        }
    }
}

// Where the rows of a front are in its parent's.
static void find_places(nmm_factor *f, const nmm_front *front) {
    if (front->parent < 0) return;
    const nmm_front *p = &f->front[front->parent];
    const int *row = f->row + front->row, *above = f->row + p->row;
    int *place = f->place + front->row;
    for (int k = 0, m = 0; k < front->n_row; k++) {
        if (row[k] < p->first + p->n_pivot) {
            place[k] = row[k] - p->first;
            continue;
        }
        while (above[m] < row[k])
            m++;
        place[k] = p->n_pivot + m;
    }
    int *run = f->run + front->row;
    for (int k = front->n_row - 1; k >= 0; k--) {
        const bool follows = k + 1 < front->n_row && place[k + 1] == place[k] + 1;
        run[k] = follows ? run[k + 1] + 1 : 1;
    }
}

// Blocks of K in the columns of the pivots, on and below the diagonal. The block of the other half
// is taken, whose rows are the columns of the front.
static int find_entries(nmm_factor *f, nmm_front *front, int n_entry, int *where) {
    const int *row = f->row + front->row;
    for (int k = 0; k < front->n_row; k++)
        where[row[k]] = front->n_pivot + k;
    front->entry = n_entry;
    for (int j = 0; j < front->n_pivot; j++) {
        const int own = f->order[front->first + j];
        for (int e = f->row_start[own]; e < f->row_start[own + 1]; e++) {
            const int k = f->rank[f->col[e]];
            if (k < front->first + j) continue;
            const int place = k < front->first + front->n_pivot ? k - front->first : where[k];
            f->entry[n_entry++] = (nmm_front_entry){e, 2 * j * front->stride + 2 * place};
        }
    }
    front->n_entry = n_entry - front->entry;
    return n_entry;
}

// Columns of the pivots: the rows from the last pair of pivots on begin at multiples of 4 numbers.
static void lay_out_columns(nmm_factor *f) {
    f->n_value = 0;
    f->n_number = f->work = 0;
    for (int i = 0; i < f->n_front; i++) {
        nmm_front *front = &f->front[i];
        const int n = 2 * front->n_pivot, skew = n % 4;
        front->padded = (2 * front->n_row + 3) / 4 * 4;
        front->stride = skew + n + front->padded;
        front->column = f->n_value + skew;
        f->n_value += (long)n * front->stride;
        f->n_number += n * (0.5 * (n + 1) + 2.0 * front->n_row);
        f->work += nmm_front_work(front->n_pivot, front->n_row);
    }
}

// --- All of it

static nmm_status find_order(nmm_context *context, nmm_factor *f, const double *place, tree *t) {
    nmm_stages stages = {0};
    const bool cut =
        place != NULL && f->n_row >= NMM_ROWS_TO_CUT && f->n_block / f->n_row >= BLOCKS_TO_CUT;
    if (cut) {
        TRY(nmm_dissect(context, &f->stage_room, f->n_row, f->row_start, f->col, place, &stages));
    }
    return nmm_order_find(context, &f->room, f->n_row, f->row_start, f->col, cut ? &stages : NULL,
                          &t->order);
}

static nmm_status build(nmm_context *context, nmm_factor *f, const double *place, tree *t) {
    TRY(place_tree(context, f, t));
    TRY(find_order(context, f, place, t));
    join_fronts(t);
    number_fronts(f, t);
    rank_rows(f, t);
    int n_list = 0;
    for (int i = 0; i < f->n_front; i++)
        n_list += f->front[i].n_row;
    TRY(nmm_grow(context, &f->row, &f->list_capacity, n_list, sizeof(int)));
    TRY(nmm_grow(context, &f->place, &f->place_capacity, n_list, sizeof(int)));
    TRY(nmm_grow(context, &f->run, &f->run_capacity, n_list, sizeof(int)));
    list_rows(f, t);
    lay_out_columns(f);
    for (int i = 0, n_entry = 0; i < f->n_front; i++) {
        find_places(f, &f->front[i]);
        n_entry = find_entries(f, &f->front[i], n_entry, t->top);
    }
    return NMM_OK;
}

nmm_status nmm_factor_analyse(nmm_context *context, nmm_factor *factor, const nmm_bsr *K,
                              const double *place) {
    if (nmm_factor_knows(factor, K)) return NMM_OK;
    const int n_block = K->n_row > 0 ? K->row_start[K->n_row] : 0;
    forget_pattern(factor);
    TRY(reserve_rows(context, factor, K->n_row));
    TRY(nmm_grow(context, &factor->col, &factor->col_capacity, n_block, sizeof(int)));
    TRY(nmm_grow(context, &factor->entry, &factor->entry_capacity, n_block, sizeof *factor->entry));
    memcpy(factor->row_start, K->row_start, ((size_t)K->n_row + 1) * sizeof(int));
    memcpy(factor->col, K->col, (size_t)n_block * sizeof(int));
    factor->n_row = K->n_row;
    factor->n_block = n_block;
    factor->n_thread = 0;
    tree t = {0};
    const nmm_status status = build(context, factor, place, &t);
    if (status != NMM_OK) forget_pattern(factor);
    return status;
}

nmm_status nmm_factor_reserve(nmm_context *context, nmm_factor *f, int n_thread) {
    if (f->team == NULL) TRY(nmm_allocate(context, &f->team, 1, sizeof *f->team));
    TRY(nmm_factor_share(context, f, n_thread));
    for (int k = 0; k < 2; k++) {
        nmm_factor_stack *stack = &f->stack[k];
        const long n = stack->n_kept + n_thread * stack->n_own + 1; // never without memory
        TRY(reserve_numbers(context, &stack->number, &stack->capacity, n));
    }
    return reserve_numbers(context, &f->value, &f->value_capacity, f->n_value);
}

const nmm_factor_kernels *nmm_factor_fastest(void) {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f")) return &nmm_factor_avx512;
    if (__builtin_cpu_supports("avx2")) return &nmm_factor_avx2;
#endif
    return &nmm_factor_plain;
}
