// SPDX-License-Identifier: MIT
//
// How long the search takes, and what memory it holds, from 10^2 to 10^5 blocks. Not a test.
// bench_contact [threads]: a wall of bricks in running bond that shakes a little in each step.

#include "bodies.h"

#include <stdlib.h>

typedef struct wall {
    int n;
    loop *loops;
    nmm_vec2 *corner; // [n][8]
} wall;

// Square walls; each brick 1 x 0.5 has a cut in the middle of its long sides.
static wall make_wall(int n) {
    wall w = {.n = n, .loops = calloc((size_t)n, sizeof(loop))};
    w.corner = calloc(6 * (size_t)n, sizeof(nmm_vec2));
    const int columns = (int)sqrt(0.5 * n) + 1;
    for (int k = 0; k < n; k++) {
        const int row = k / columns;
        const double x = k % columns + (row % 2) * 0.37, y = 0.5 * row;
        nmm_vec2 *c = w.corner + 6 * (long)k;
        const nmm_vec2 brick[6] = {{x, y},           {x + 0.5, y},       {x + 1, y},
                                   {x + 1, y + 0.5}, {x + 0.5, y + 0.5}, {x, y + 0.5}};
        memcpy(c, brick, sizeof brick);
        w.loops[k] = (loop){k, 6, c};
    }
    return w;
}

typedef struct timing {
    double first, rebuild, reuse, evaluate, commit; // [s]
    int pairs, contacts;
    double bytes;
} timing;

static timing measure(const wall *w, int n_thread) {
    bodies b = {.context.n_thread = n_thread};
    nmm_random random = nmm_random_seed(1);
    timing t = {.rebuild = INFINITY, .reuse = INFINITY, .evaluate = INFINITY, .commit = INFINITY};
    assert_int_equal(bodies_open(&b, w->n, w->loops, 0.5), NMM_OK);
    const size_t model_bytes = b.context.live_bytes;
    for (int k = 0; k < 9; k++) {
        const double at = b.search->built_at[0], begin = nmm_clock();
        // Every third step looks further than the index reaches.
        bodies_find(&b, k % 3 == 0 ? 0.01 + 0.12 * k : 0.01);
        const double found = nmm_clock() - begin;
        if (k == 0)
            t.first = found;
        else if (b.search->built_at[0] != at)
            t.rebuild = nmm_min(t.rebuild, found);
        else
            t.reuse = nmm_min(t.reuse, found);
        bodies_shake(&b, &random, 1e-4);
        const double moved = nmm_clock();
        bodies_evaluate(&b);
        const double judged = nmm_clock();
        bodies_commit(&b, NULL);
        t.evaluate = nmm_min(t.evaluate, judged - moved);
        t.commit = nmm_min(t.commit, nmm_clock() - judged);
    }
    t.pairs = b.search->n_pair;
    t.contacts = b.state.n_contact;
    t.bytes = (double)(b.context.live_bytes - model_bytes);
    bodies_close(&b);
    return t;
}

int main(int n_argument, char **argument) {
    const int n_thread = n_argument > 1 ? atoi(argument[1]) : 1;
    printf("%d threads; times in ms\n", n_thread);
    printf("%8s %9s %9s %9s %9s %9s %9s %9s %9s\n", "blocks", "pairs", "contacts", "first",
           "rebuild", "reuse", "evaluate", "commit", "MB");
    for (int n = 100; n <= 100000; n *= 10) {
        const wall w = make_wall(n);
        const timing t = measure(&w, n_thread);
        printf("%8d %9d %9d %9.3f %9.3f %9.3f %9.3f %9.3f %9.2f\n", n, t.pairs, t.contacts,
               1e3 * t.first, 1e3 * t.rebuild, 1e3 * t.reuse, 1e3 * t.evaluate, 1e3 * t.commit,
               1e-6 * t.bytes);
        free(w.loops);
        free(w.corner);
    }
    return 0;
}
