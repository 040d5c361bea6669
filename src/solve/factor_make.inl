// SPDX-License-Identifier: MIT
//
// The numbers of a factor; compiled once for each kind of processor. All work on a front is done by
// one kernel, a tile of 4 columns and a few rows that stays in registers while the columns to its
// left are taken off. Each number is a sum in the order of the columns, whatever the tile, the
// block and the thread, so bits do not depend on them.

// Columns eliminated and taken off at a time, so that what is read stays in a cache: in a front of
// so many columns; rows and columns of a block that they are taken off.
#define FEW_COLUMNS 256
#define SHALLOW 32
#define DEPTH 64
#define BLOCK 64

// Fewer rows are added one by one: what runs are there is hard to foresee.
#define FEW_ROWS 24

// Blocks of K fetched ahead, which lie anywhere.
#define BLOCKS_AHEAD 12

// Block columns of a front that a thread assembles at a time, where threads share it.
#define STRIP 8

// --- Tiles

// A place in the columns of a front, from one column to the next `stride` numbers.
typedef struct tile {
    double *at; // its first number
    long stride;
    const double *left; // rows of the tile in the columns to be taken off
    const double *up;   // rows that are the columns of the tile, in the same columns
    long left_stride;
    int depth; // how many columns
} tile;

#define TAKE_OFF take_off
#define TILE_SLOT lane_slot
#define TILE_LANE LANE
#include "factor_tile.inl"

#ifdef __AVX512F__
#define TAKE_OFF take_off_wide
#define TILE_SLOT wide_slot
#define TILE_LANE 8
#include "factor_tile.inl"
#endif

// A column of tiles, n_row rows, a multiple of 4.
static void take_off_rows(tile t, int n_row, const double *corner) {
    int i = 0;
#ifdef __AVX512F__
    for (; n_row - i >= 16; i += 16)
        take_off_wide(&t, 2, corner, i);
    if (n_row - i >= 8) {
        take_off_wide(&t, 1, corner, i);
        i += 8;
    }
#else
    for (; n_row - i >= 2 * LANE; i += 2 * LANE)
        take_off(&t, 2, corner, i);
#endif
    if (i < n_row) take_off(&t, 1, corner, i);
}

// --- Pivots

// Cholesky's method on the triangle of n columns at `corner`, 2 or 4, which stays in registers;
// false where a pivot is not positive, *broken is then its column. The diagonal takes inverses.
static inline __attribute__((always_inline)) bool factorise_corner(double *corner, long stride,
                                                                   const int n, int *broken) {
    double c[4][4];
    UNROLL
    for (int j = 0; j < n; j++)
        UNROLL
    for (int i = j; i < n; i++)
        c[j][i] = corner[j * stride + i];
    UNROLL
    for (int j = 0; j < n; j++) {
        UNROLL
        for (int k = 0; k < j; k++)
            UNROLL
        for (int i = j; i < n; i++)
            c[j][i] -= c[k][i] * c[k][j];
        const double inverse = 1 / sqrt(c[j][j]);
        *broken = j;
        // Not for zero, for what is negative, nor for what is no number.
        if (!(inverse > 0 && inverse <= 1.7976931348623157e308)) return false;
        c[j][j] = inverse;
        UNROLL
        for (int i = j + 1; i < n; i++)
            c[j][i] *= inverse;
    }
    UNROLL
    for (int j = 0; j < n; j++)
        UNROLL
    for (int i = j; i < n; i++)
        corner[j * stride + i] = c[j][i];
    return true;
}

// The first two columns, where the number of columns is not a multiple of 4: rows from .. to - 1.
static void divide_pair(double *panel, long stride, int from, int to) {
    const double inverse[2] = {panel[0], panel[stride + 1]}, lower = panel[1];
    double *a = panel, *b = panel + stride;
    for (int i = from; i < to; i += LANE) {
        const lane_slot x = SLOT(a + i) * inverse[0];
        SLOT(a + i) = x;
        SLOT(b + i) = (SLOT(b + i) - x * lower) * inverse[1];
    }
}

// Some columns of a front, from which those to their left were taken off.
typedef struct strip {
    double *panel; // the front's first column
    long stride;
    int first, end;
} strip;

// Eliminate the columns, in the rows down to n_row; column of a pivot that is not positive, -1:
// none.
static int eliminate_strip(const strip *s, int n_row) {
    const long stride = s->stride;
    int broken = 0, j = s->first;
    if ((s->end - j) % 4 != 0) {
        if (!factorise_corner(s->panel, stride, 2, &broken)) return broken;
        divide_pair(s->panel, stride, 2, n_row);
        j += 2;
    }
    for (; j < s->end; j += 4) {
        double *corner = s->panel + j * stride + j;
        const double *left = s->panel + s->first * stride + j;
        tile t = {corner, stride, left, left, stride, j - s->first};
        take_off(&t, 4 / LANE, NULL, 0);
        if (!factorise_corner(corner, stride, 4, &broken)) return j + broken;
        t.at += 4;
        t.left += 4;
        take_off_rows(t, n_row - j - 4, corner);
    }
    return -1;
}

// The same in rows from .. to - 1 below the triangle, which is done.
static void divide_strip(const strip *s, int from, int to) {
    const long stride = s->stride;
    int j = s->first;
    if ((s->end - j) % 4 != 0) {
        divide_pair(s->panel, stride, from, to);
        j += 2;
    }
    for (; j < s->end; j += 4) {
        const double *left = s->panel + s->first * stride;
        const tile t = {
            s->panel + j * stride + from, stride, left + from, left + j, stride, j - s->first};
        take_off_rows(t, to - from, s->panel + j * stride + j);
    }
}

// A block of a symmetric matrix whose first number is at `at`: columns first .. end - 1, on and
// below the diagonal, in rows from .. to - 1.
typedef struct tile_block {
    double *at;
    long stride;
    int first, end, from, to;
} tile_block;

// Take columns off the block. Their numbers in its first row and column are at `left`.
static void take_off_block(const tile_block *b, const double *left, long left_stride, int depth) {
    for (int j = b->first; j < b->end; j += 4) {
        const int from = nmm_max_int(j, b->from);
        const tile t = {
            b->at + j * b->stride + from, b->stride, left + from, left + j, left_stride, depth};
        take_off_rows(t, b->to - from, NULL);
    }
}

// The blocks of columns first .. n - 1 down to row n_row, in order: false after the last one.
// Begins with first = end = from = to.
static bool next_block(tile_block *b, int n, int n_row, int width) {
    b->from = b->to;
    if (b->to == n_row || b->end == b->first) {
        b->first = b->from = b->end;
        if (b->first >= n) return false;
        b->end = b->to = nmm_min_int(b->first + width, n);
        return true;
    }
    b->to = nmm_min_int(b->from + BLOCK, n_row);
    return true;
}

// Columns first .. end - 1 off those to their right. The first block is the triangle that comes
// next: who takes it goes on to eliminate it.
static int take_off_strip(const strip *s, const strip *next, int n, int n_row, nmm_hand *h) {
    const int width = next->end - next->first;
    const double *left = s->panel + s->first * s->stride;
    tile_block b = {s->panel, s->stride, s->end, s->end, s->end, s->end};
    if (h->n == 1 && n_row <= FEW_COLUMNS / 2) {
        b.end = n;
        b.to = n_row;
        take_off_block(&b, left, s->stride, s->end - s->first);
        return -1;
    }
    int turn = 0, broken = -1;
    for (int mine = nmm_hand_take(h); next_block(&b, n, n_row, width); turn++) {
        if (turn != mine) continue;
        take_off_block(&b, left, s->stride, s->end - s->first);
        if (turn == 0 && h->n > 1) broken = eliminate_strip(next, next->end);
        mine = nmm_hand_take(h);
    }
    nmm_hand_join(h, turn);
    return broken;
}

// A pivot is not positive: the first one in order of elimination counts.
static void report_pivot(nmm_team *team, int pivot) {
    int least = atomic_load_explicit(&team->least, memory_order_relaxed);
    while (pivot < least && !atomic_compare_exchange_weak(&team->least, &least, pivot)) {
    }
}

// Is there one before this one? The same for all threads if none of them can find one there before
// they join again.
static bool is_broken(const nmm_team *team, int pivot) {
    return atomic_load_explicit(&team->least, memory_order_relaxed) < pivot;
}

// Columns of L of a front, from left to right; false where a pivot is not positive.
static bool factorise_pivots(nmm_team *team, const nmm_front *front, double *panel, nmm_hand *h) {
    const int n = 2 * front->n_pivot, n_all = n + front->padded;
    const int width = n < FEW_COLUMNS ? SHALLOW : DEPTH;
    strip s = {panel, front->stride, 0, nmm_min_int(width + n % 4, n)};
    int broken = -1;
    for (int k = nmm_hand_take(h); k < 1; k = nmm_hand_take(h))
        broken = eliminate_strip(&s, h->n > 1 ? s.end : n_all);
    nmm_hand_join(h, 1);
    for (;;) {
        if (broken >= 0) report_pivot(team, front->first + broken / 2);
        if (h->n > 1) {
            const int n_block = (n_all - s.end + BLOCK - 1) / BLOCK;
            for (int k = nmm_hand_take(h); k < n_block; k = nmm_hand_take(h))
                divide_strip(&s, s.end + k * BLOCK, nmm_min_int(s.end + (k + 1) * BLOCK, n_all));
            nmm_hand_join(h, n_block);
        }
        if (h->n > 1 ? is_broken(team, front->first + front->n_pivot) : broken >= 0) return false;
        if (s.end == n) return true;
        const strip next = {panel, s.stride, s.end, nmm_min_int(s.end + width, n)};
        broken = take_off_strip(&s, &next, n, n_all, h);
        s = next;
        if (h->n == 1) broken = eliminate_strip(&s, n_all);
    }
}

// What the pivots leave of the rest of a front.
static void reduce_rest(const nmm_front *front, const double *panel, double *rest, nmm_hand *h) {
    const int n = 2 * front->n_pivot, m = front->padded;
    const int width = h->n == 1 && m <= FEW_COLUMNS / 2 ? m : BLOCK;
    tile_block b = {.at = rest, .stride = m};
    int turn = 0;
    for (int mine = nmm_hand_take(h); next_block(&b, m, m, width); turn++) {
        if (turn != mine) continue;
        for (int k = 0; k < n; k += DEPTH) {
            const double *left = panel + (long)k * front->stride + n;
            take_off_block(&b, left, front->stride, nmm_min_int(DEPTH, n - k));
        }
        mine = nmm_hand_take(h);
    }
    nmm_hand_join(h, turn);
}

// --- Assembly

// First of the rows of a child at this place of its parent or behind it.
static int first_at(const int *place, int n, int wanted) {
    int low = 0;
    while (low < n) {
        const int middle = low + (n - low) / 2;
        if (place[middle] < wanted) low = middle + 1;
        if (place[middle] >= wanted) n = middle;
    }
    return low;
}

// n is even.
static void add_numbers(double *to, const double *from, int n) {
    int i = 0;
    for (; i + LANE <= n; i += LANE)
        SLOT(to + i) += SLOT_OF(from + i);
    if (i < n) add_pair(to + i, from + i);
}

// A front while columns first .. end - 1 of it are put together, in block columns.
typedef struct assembly {
    const nmm_factor *f;
    const nmm_front *front;
    double *panel, *rest;
    int first, end;
} assembly;

// What is left of a child into the columns, run by run of rows that follow one another there too.
static void add_child(const assembly *a, const nmm_front *child, const double *left) {
    const nmm_front *front = a->front;
    const int *place = a->f->place + child->row, *run = a->f->run + child->row, n = child->n_row;
    for (int j = first_at(place, n, a->first); j < n && place[j] < a->end; j++) {
        const bool pivot = place[j] < front->n_pivot;
        const long stride = pivot ? front->stride : front->padded;
        const int above = pivot ? 0 : front->n_pivot;
        double *to = (pivot ? a->panel : a->rest) + 2 * (place[j] - above) * stride - 2 * above;
        double *to_next = to + stride;
        const double *column = left + 2 * (long)j * child->padded, *next = column + child->padded;
        if (n < FEW_ROWS) {
            for (int i = j; i < n; i++) {
                const long at = 2L * place[i];
                add_pair(to + at, column + 2L * i);
                add_pair(to_next + at, next + 2L * i);
            }
            continue;
        }
        for (int i = j; i < n; i += run[i]) {
            const long at = 2L * place[i];
            add_numbers(to + at, column + 2L * i, 2 * run[i]);
            add_numbers(to_next + at, next + 2L * i, 2 * run[i]);
        }
    }
}

// Columns of a front before anything is added. Tiles begin up to two numbers above the diagonal.
static void clear_columns(const assembly *a) {
    const nmm_front *front = a->front;
    const long n = 2 * front->n_pivot, m = front->padded;
    const int n_column = front->n_pivot + front->n_row;
    if (n + m <= FEW_COLUMNS / 2 && a->first == 0 && a->end == n_column) {
        memset(a->panel, 0, (size_t)(n * front->stride - n % 4) * sizeof(double));
        memset(a->rest, 0, (size_t)(m * m) * sizeof(double));
        return;
    }
    const long first = 2 * a->first, end = a->end == n_column ? n + m : 2 * a->end;
    for (long j = first; j < end; j++) {
        const bool pivot = j < n;
        const long top = pivot ? (j < 2 ? 0 : j / 2 * 2 - 2) : (j - n) / 4 * 4;
        double *column = pivot ? a->panel + j * front->stride : a->rest + (j - n) * m;
        memset(column + top, 0, (size_t)((pivot ? n + m : m) - top) * sizeof *column);
    }
}

// Blocks of K; those of a front come by columns.
static void add_entries(const assembly *a, const double *value) {
    const nmm_front *front = a->front;
    const nmm_front_entry *entry = a->f->entry + front->entry;
    const long stride = front->stride, first = 2 * a->first * stride, end = 2 * a->end * stride;
    int k = 0;
    if (a->first > 0)
        for (int n = front->n_entry; k < n;) {
            const int middle = k + (n - k) / 2;
            if (entry[middle].at < first) k = middle + 1;
            if (entry[middle].at >= first) n = middle;
        }
    const long last = (a->f->n_block + a->f->n_row) / 2 - front->entry - 1;
    for (; k < front->n_entry && entry[k].at < end; k++) {
        const long later = k + BLOCKS_AHEAD < last ? k + BLOCKS_AHEAD : last;
        __builtin_prefetch(value + 4 * (long)entry[later].block);
        const double *block = value + 4 * (long)entry[k].block;
        double *to = a->panel + entry[k].at;
        memcpy(to, block, 2 * sizeof(double));
        memcpy(to + stride, block + 2, 2 * sizeof(double));
    }
}

static void assemble_columns(const assembly *a, const double *value, const own_stacks *own) {
    const nmm_factor *f = a->f;
    clear_columns(a);
    if (a->first < a->front->n_pivot) add_entries(a, value);
    for (int c = a->front->child; c >= 0; c = f->front[c].sibling)
        add_child(a, &f->front[c], rest_of(f, &f->front[c], own, 0));
}

// --- Fronts

// One front; false where a pivot is not positive.
static bool make_front(const nmm_factor *f, const nmm_front *front, const double *value,
                       const own_stacks *own, nmm_hand *h) {
    const int n_column = front->n_pivot + front->n_row, width = h->n > 1 ? STRIP : n_column;
    const int n_strip = (n_column + width - 1) / width;
    assembly a = {f, front, f->value + front->column, rest_of(f, front, own, 0), 0, 0};
    for (int k = nmm_hand_take(h); k < n_strip; k = nmm_hand_take(h)) {
        a.first = k * width;
        a.end = nmm_min_int(a.first + width, n_column);
        assemble_columns(&a, value, own);
    }
    nmm_hand_join(h, n_strip);
    if (!factorise_pivots(f->team, front, a.panel, h)) return false;
    reduce_rest(front, a.panel, a.rest, h);
    return true;
}

// A place for what is left of a front.
static void take_place(nmm_factor *f, nmm_front *front) {
    front->rest[0] = f->stack[0].n_top + nmm_pool_take(&f->pool, nmm_front_rest(front, 0));
}

// What other parts left for this front is taken.
static void give_places(nmm_factor *f, const nmm_front *front) {
    for (int c = front->child; c >= 0; c = f->front[c].sibling)
        if (f->front[c].kept) nmm_pool_give(&f->pool, f->front[c].rest[0] - f->stack[0].n_top);
}

// Fronts for one thread, and L^-1 x as soon as columns of L are there, while they are in a cache.
// None where a pivot before them is not positive: what they would take may not be there.
static void make_part(nmm_factor *f, const nmm_factor_part *part, const double *value, bool forward,
                      const own_stacks *own) {
    nmm_hand alone = {.n = 1};
    if (is_broken(f->team, f->front[part->first].first)) return;
    for (int i = part->first; i < part->end; i++) {
        if (f->front[i].kept) take_place(f, &f->front[i]);
        if (!make_front(f, &f->front[i], value, own, &alone)) return;
        give_places(f, &f->front[i]);
        if (forward) go_forward(f, &f->front[i], own);
    }
}

// A front above the parts: by all threads, or by the first that comes. Rests are kept.
static void make_top(const nmm_factor *f, const nmm_front *front, const double *value,
                     nmm_hand *h) {
    if (nmm_front_work(front->n_pivot, front->n_row) >= NMM_SMALL_FRONT) {
        make_front(f, front, value, NULL, h);
        return;
    }
    nmm_hand alone = {.n = 1};
    for (int k = nmm_hand_take(h); k < 1; k = nmm_hand_take(h))
        make_front(f, front, value, NULL, &alone);
    nmm_hand_join(h, 1);
}

// A thread's part of it: parts, then its share of the fronts above them. With r the numbers of
// L^-1 P r are made on the way, and with z the solution after it.
static void make_share(nmm_factor *f, const double *value, const double *r, double *z, nmm_hand *h,
                       int thread) {
    const own_stacks own = stacks_of(f, thread);
    if (r != NULL) move_rows(f, r, f->x, true, h);
    int first = 0;
    for (int k = take_part(f, false, &first); k >= 0; k = take_part(f, false, &first)) {
        make_part(f, &f->part[k], value, r != NULL, &own);
        finish_part(f, false, k);
    }
    nmm_hand_wait(h);
    // A thread may be at work on a front before the last one gets there.
    for (int k = 0; k < f->n_top && !is_broken(f->team, f->front[f->top[k]].first); k++) {
        make_top(f, &f->front[f->top[k]], value, h);
        if (r != NULL) share_forward(f, &f->top[k], 1, h);
    }
    if (r != NULL && !is_broken(f->team, f->n_row)) share_way_back(f, z, h, &own);
}

// The numbers of the factor; z = K^-1 r as well unless r is NULL.
static int make_and_apply(nmm_factor *f, const double *value, const double *r, double *z) {
    nmm_team *team = f->team;
    const int n_thread = f->n_thread;
    atomic_store(&team->ticket, 0);
    atomic_store(&team->least, INT_MAX);
    nmm_pool_clear(&f->pool);
    open_parts(f, false);
    open_parts(f, true);
    if (n_thread == 1) {
        nmm_hand alone = {.team = team, .n = 1};
        make_share(f, value, r, z, &alone, 0);
    } else {
#pragma omp parallel num_threads(n_thread)
        {
            nmm_hand h = {.team = team, .n = omp_get_num_threads()};
            make_share(f, value, r, z, &h, omp_get_thread_num());
        }
    }
    const int least = atomic_load(&team->least);
    return least == INT_MAX ? -1 : f->order[least];
}

static int make_factor(nmm_factor *f, const double *value) {
    return make_and_apply(f, value, NULL, NULL);
}
