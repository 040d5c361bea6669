// SPDX-License-Identifier: MIT
//
// Solving with a factor; compiled once for each kind of processor. Forward from the leaves to the
// top, what is left of a front's right-hand side waiting where what is left of its matrix was;
// back from the top to the leaves. Threads take the parts of the factor, then share large fronts;
// each number is one sum in an order that fronts alone decide.

// Numbers of L in a front that is worth sharing; rows and columns that a thread takes at a time.
#define LARGE_FRONT 40000
#define SOME_ROWS 128
#define SOME_COLUMNS 16

// Numbers of L fetched ahead on the way back, where processors do not see what comes next.
#define BACK_AHEAD 768

// Rows or unknowns copied at a time.
#define SOME_UNKNOWNS 4096

// --- Parts of a front

// x = L^-1 x for the pivots; below -= L x in the first m rows below them.
static void solve_forward(const nmm_front *front, const double *panel, double *x, double *below,
                          int m) {
    const int n = 2 * front->n_pivot;
    for (int j = 0; j < n; j += 2) {
        const double *a = panel + j * (long)front->stride, *b = a + front->stride;
        const double u = x[j] * a[j], v = (x[j + 1] - a[j + 1] * u) * b[j + 1];
        x[j] = u;
        x[j + 1] = v;
        int row = j + 2;
        for (; row + LANE <= n; row += LANE)
            SLOT(x + row) = SLOT(x + row) - SLOT_OF(a + row) * u - SLOT_OF(b + row) * v;
        if (row < n) PAIR(x + row) = PAIR(x + row) - PAIR_OF(a + row) * u - PAIR_OF(b + row) * v;
        a += n;
        b += n;
        for (int i = 0; i < m; i += LANE)
            SLOT(below + i) = SLOT(below + i) - SLOT_OF(a + i) * u - SLOT_OF(b + i) * v;
    }
}

// below -= L x in rows from .. to - 1 below the pivots.
static void take_off_below(const nmm_front *front, const double *panel, const double *x,
                           double *below, int from, int to) {
    const int n = 2 * front->n_pivot;
    for (int j = 0; j < n; j += 2) {
        const double *a = panel + j * (long)front->stride + n, *b = a + front->stride;
        const double u = x[j], v = x[j + 1];
        for (int i = from; i < to; i += LANE)
            SLOT(below + i) = SLOT(below + i) - SLOT_OF(a + i) * u - SLOT_OF(b + i) * v;
    }
}

// Sum of n products, n a multiple of 4, in four running sums.
static inline double dot_below(const double *a, const double *below, int n) {
    lane_slot sum[4 / LANE] = {{0}};
    for (int i = 0; i < n; i += 4)
        for (int k = 0; k < 4 / LANE; k++)
            sum[k] += SLOT_OF(a + i + LANE * k) * SLOT_OF(below + i + LANE * k);
    double all[4];
    memcpy(all, sum, sizeof all);
    return (all[0] + all[1]) + (all[2] + all[3]);
}

// x -= L^T below for pivots from .. to - 1.
static void take_off_pivots(const nmm_front *front, const double *panel, double *x,
                            const double *below, int from, int to) {
    for (int j = from; j < to; j++) {
        const double *a = panel + j * (long)front->stride + 2 * front->n_pivot;
        x[j] -= dot_below(a, below, front->padded);
    }
}

// x = L^-T (x - L^T below) with the first m rows below, from the last pivots to the first.
static void solve_backward(const nmm_front *front, const double *panel, double *x,
                           const double *below, int m) {
    const int n = 2 * front->n_pivot;
    for (int j = n - 2; j >= 0; j -= 2) {
        const double *a = panel + j * (long)front->stride, *b = a + front->stride;
        // The columns to the left, and those of the front before. Of shared ones only triangles are
        // wanted.
        for (long i = 0; i < (m > 0 ? 2L * front->stride : 0); i += 8)
            __builtin_prefetch(a + i - BACK_AHEAD);
        double u = x[j] - dot_below(a + n, below, m), v = x[j + 1] - dot_below(b + n, below, m);
        for (int i = j + 2; i < n; i++) {
            u -= a[i] * x[i];
            v -= b[i] * x[i];
        }
        x[j + 1] = v * b[j + 1];
        x[j] = (u - a[j + 1] * x[j + 1]) * a[j];
    }
}

// --- Fronts

// What is left of the children's right-hand sides, into that of the pivots and below them.
static void gather_below(const nmm_factor *f, const nmm_front *front, const own_stacks *own,
                         double *x, double *below) {
    memset(below, 0, (size_t)front->padded * sizeof(double));
    for (int c = front->child; c >= 0; c = f->front[c].sibling) {
        const nmm_front *child = &f->front[c];
        const int *place = f->place + child->row;
        const double *left = rest_of(f, child, own, 1);
        int k = 0;
        for (; k < child->n_row && place[k] < front->n_pivot; k++)
            add_pair(x + 2 * place[k], left + 2 * k);
        for (; k < child->n_row; k++)
            add_pair(below + 2 * (place[k] - front->n_pivot), left + 2 * k);
    }
}

static void go_forward(const nmm_factor *f, const nmm_front *front, const own_stacks *own) {
    const double *panel = f->value + front->column;
    double *x = f->x + 2 * (long)front->first, *below = rest_of(f, front, own, 1);
    gather_below(f, front, own, x, below);
    solve_forward(front, panel, x, below, front->padded);
}

// What is known already of the rows below the pivots.
static void fetch_below(const nmm_factor *f, const nmm_front *front, double *below) {
    const int *row = f->row + front->row;
    for (int k = 0; k < front->n_row; k++)
        memcpy(below + 2 * k, f->x + 2 * (long)row[k], 2 * sizeof(double));
    if (front->padded > 2 * front->n_row) memset(below + 2 * front->n_row, 0, 16);
}

static void go_back(const nmm_factor *f, const nmm_front *front, const own_stacks *own) {
    const double *panel = f->value + front->column;
    double *x = f->x + 2 * (long)front->first, *below = rest_of(f, front, own, 1);
    fetch_below(f, front, below);
    solve_backward(front, panel, x, below, front->padded);
}

// --- Fronts that threads share: several that do not need each other at a time

static bool is_large(const nmm_front *front) {
    const double n = 2.0 * front->n_pivot;
    return n * (0.5 * n + front->padded) > LARGE_FRONT;
}

// Turns that the rows below a front's pivots are worth, or its columns; a small one is done whole.
static int turns_of(const nmm_front *front, bool back) {
    if (!is_large(front)) return 0;
    return back ? (2 * front->n_pivot + SOME_COLUMNS - 1) / SOME_COLUMNS
                : (front->padded + SOME_ROWS - 1) / SOME_ROWS;
}

// What is below the pivots of a large front, in one of its turns.
static void take_turn(const nmm_factor *f, const nmm_front *front, int turn, bool back) {
    const double *panel = f->value + front->column;
    double *x = f->x + 2 * (long)front->first, *below = rest_of(f, front, NULL, 1);
    if (back) {
        const int end = nmm_min_int((turn + 1) * SOME_COLUMNS, 2 * front->n_pivot);
        take_off_pivots(front, panel, x, below, turn * SOME_COLUMNS, end);
    } else {
        const int end = nmm_min_int((turn + 1) * SOME_ROWS, front->padded);
        take_off_below(front, panel, x, below, turn * SOME_ROWS, end);
    }
}

// The turns of all these fronts; false: there are none.
static bool share_turns(const nmm_factor *f, const int *list, int n, bool back, nmm_hand *h) {
    int n_turn = 0, first = 0, k = 0;
    for (int i = 0; i < n; i++)
        n_turn += turns_of(&f->front[list[i]], back);
    if (n_turn == 0) return false;
    for (int mine = nmm_hand_take(h); mine < n_turn; mine = nmm_hand_take(h)) {
        while (mine >= first + turns_of(&f->front[list[k]], back))
            first += turns_of(&f->front[list[k++]], back);
        take_turn(f, &f->front[list[k]], mine - first, back);
    }
    nmm_hand_join(h, n_turn);
    return true;
}

static void share_forward(const nmm_factor *f, const int *list, int n, nmm_hand *h) {
    for (int k = nmm_hand_take(h); k < n; k = nmm_hand_take(h)) {
        const nmm_front *front = &f->front[list[k]];
        double *x = f->x + 2 * (long)front->first, *below = rest_of(f, front, NULL, 1);
        gather_below(f, front, NULL, x, below);
        solve_forward(front, f->value + front->column, x, below,
                      is_large(front) ? 0 : front->padded);
    }
    nmm_hand_join(h, n);
    share_turns(f, list, n, false, h);
}

static void share_back(const nmm_factor *f, const int *list, int n, nmm_hand *h) {
    for (int k = nmm_hand_take(h); k < n; k = nmm_hand_take(h)) {
        const nmm_front *front = &f->front[list[k]];
        if (is_large(front)) fetch_below(f, front, rest_of(f, front, NULL, 1));
        if (!is_large(front)) go_back(f, front, NULL);
    }
    nmm_hand_join(h, n);
    if (!share_turns(f, list, n, true, h)) return;
    for (int k = nmm_hand_take(h); k < n; k = nmm_hand_take(h)) {
        const nmm_front *front = &f->front[list[k]];
        double *x = f->x + 2 * (long)front->first, *below = rest_of(f, front, NULL, 1);
        if (is_large(front)) solve_backward(front, f->value + front->column, x, below, 0);
    }
    nmm_hand_join(h, n);
}

// The fronts of a round.
static void pass_round(const nmm_factor *f, int round, bool back, nmm_hand *h) {
    const int *list = f->round_front + f->round_start[round];
    const int n = f->round_start[round + 1] - f->round_start[round];
    (back ? share_back : share_forward)(f, list, n, h);
}

// --- Parts: threads take those that do not wait for others, first those with a long way to go

// States of parts that nobody needs to take.
enum { PART_TAKEN = -1, PART_DONE = -2 };

static atomic_int *states_of(const nmm_factor *f, bool back) {
    return f->part_state + (back ? f->n_part : 0);
}

// Before threads begin.
static void open_parts(const nmm_factor *f, bool back) {
    atomic_int *state = states_of(f, back);
    for (int k = 0; k < f->n_part; k++)
        atomic_store_explicit(&state[k], back ? 0 : f->part[k].n_below, memory_order_relaxed);
}

// Is what this part needs done? On the way back that is the part above it.
static bool take_ready(const nmm_factor *f, atomic_int *state, int k, bool back) {
    const int above = f->part[k].above;
    if (back && above >= 0 &&
        atomic_load_explicit(&state[above], memory_order_acquire) != PART_DONE) {
        return false;
    }
    int ready = 0;
    return atomic_compare_exchange_strong_explicit(&state[k], &ready, PART_TAKEN,
                                                   memory_order_acquire, memory_order_relaxed);
}

// The next part for a thread, -1: all are taken. Those before `*first` were.
static int take_part(const nmm_factor *f, bool back, int *first) {
    atomic_int *state = states_of(f, back);
    for (int spin = 0; *first < f->n_part; spin++) {
        for (int k = *first; k < f->n_part; k++) {
            const bool taken = atomic_load_explicit(&state[k], memory_order_relaxed) < 0;
            if (taken && k == *first) ++*first;
            if (!taken && take_ready(f, state, k, back)) return k;
        }
        nmm_barrier_pause(spin);
    }
    return -1;
}

static void finish_part(const nmm_factor *f, bool back, int k) {
    atomic_int *state = states_of(f, back);
    const int above = f->part[k].above;
    if (back) {
        atomic_store_explicit(&state[k], PART_DONE, memory_order_release);
    } else if (above >= 0) {
        atomic_fetch_sub_explicit(&state[above], 1, memory_order_acq_rel);
    }
}

// --- All of it

// Rows of one order into the other, some at a time.
static void move_rows(const nmm_factor *f, const double *from, double *to, bool in, nmm_hand *h) {
    const int n_turn = (f->n_row + SOME_UNKNOWNS - 1) / SOME_UNKNOWNS;
    for (int turn = nmm_hand_take(h); turn < n_turn; turn = nmm_hand_take(h)) {
        const int end = nmm_min_int((turn + 1) * SOME_UNKNOWNS, f->n_row);
        for (int k = turn * SOME_UNKNOWNS; k < end; k++) {
            const long there = 2 * (long)f->order[k], here = 2 * (long)k;
            memcpy(to + (in ? here : there), from + (in ? there : here), 2 * sizeof(double));
        }
    }
    nmm_hand_join(h, n_turn);
}

// A thread's part of the way up; x is P r already.
static void share_way_up(const nmm_factor *f, nmm_hand *h, const own_stacks *own) {
    int first = 0;
    for (int k = take_part(f, false, &first); k >= 0; k = take_part(f, false, &first)) {
        for (int i = f->part[k].first; i < f->part[k].end; i++)
            go_forward(f, &f->front[i], own);
        finish_part(f, false, k);
    }
    nmm_hand_wait(h);
    for (int round = 0; round < f->n_round; round++)
        pass_round(f, round, false, h);
}

// A thread's part of the way back, from L^-1 P r in x.
static void share_way_back(const nmm_factor *f, double *z, nmm_hand *h, const own_stacks *own) {
    for (int round = f->n_round - 1; round >= 0; round--)
        pass_round(f, round, true, h);
    int first = 0;
    for (int k = take_part(f, true, &first); k >= 0; k = take_part(f, true, &first)) {
        for (int i = f->part[k].end - 1; i >= f->part[k].first; i--)
            go_back(f, &f->front[i], own);
        finish_part(f, true, k);
    }
    nmm_hand_wait(h);
    move_rows(f, f->x, z, false, h);
}

static void apply_share(const nmm_factor *f, const double *r, double *z, nmm_hand *h, int thread) {
    const own_stacks own = stacks_of(f, thread);
    move_rows(f, r, f->x, true, h);
    share_way_up(f, h, &own);
    share_way_back(f, z, h, &own);
}

static void apply_factor(const nmm_factor *f, const double *r, double *z) {
    nmm_team *team = f->team;
    const int n_thread = f->n_thread;
    atomic_store(&team->ticket, 0);
    open_parts(f, false);
    open_parts(f, true);
    if (n_thread == 1) {
        nmm_hand alone = {.team = team, .n = 1};
        apply_share(f, r, z, &alone, 0);
        return;
    }
#pragma omp parallel num_threads(n_thread)
    {
        nmm_hand h = {.team = team, .n = omp_get_num_threads()};
        apply_share(f, r, z, &h, omp_get_thread_num());
    }
}
