// SPDX-License-Identifier: MIT
//
// Arrangements of random segments on small lattices, where everything that can coincide does,
// checked against slow reference code: all pairs for crossings, point in polygon for islands.

#include "test.h"

#include "arrangement.h"

enum { MOST = 64 };

typedef struct work {
    nmm_context context;
    nmm_arrangement a;
    int n;
    nmm_isegment segment[MOST];
} work;

static void work_open(work *w) {
    memset(w, 0, sizeof *w);
    w->context.n_thread = 1;
}

static void work_close(work *w) {
    nmm_arrangement_destroy(&w->context, &w->a);
    assert_int_equal(w->context.n_live, 0);
}

static void work_build(work *w) {
    assert_int_equal(nmm_arrangement_build(&w->context, &w->a, w->n, w->segment, 0), NMM_OK);
}

static void add(work *w, int64_t ax, int64_t ay, int64_t bx, int64_t by) {
    w->segment[w->n++] = (nmm_isegment){{ax, ay}, {bx, by}, NMM_FAMILY_NONE, 0};
}

static void add_square(work *w, int64_t x, int64_t y, int64_t side) {
    add(w, x, y, x + side, y);
    add(w, x + side, y, x + side, y + side);
    add(w, x + side, y + side, x, y + side);
    add(w, x, y + side, x, y);
}

// --- Reference

static nmm_ipoint start_of(const nmm_arrangement *a, int half) {
    return a->vertex[a->edge[half]];
}

// No two edges cross, no vertex lies on an edge that it does not end.
static void check_planar(const nmm_arrangement *a) {
    for (int e = 0; e < a->n_edge; e++) {
        const nmm_isegment s = {start_of(a, 2 * e), start_of(a, 2 * e + 1), 0, 0};
        assert_true(a->edge[2 * e] < a->edge[2 * e + 1]);
        for (int f = 0; f < e; f++) {
            const nmm_isegment t = {start_of(a, 2 * f), start_of(a, 2 * f + 1), 0, 0};
            assert_false(nmm_isegment_cross(s, t));
        }
        for (int v = 0; v < a->n_vertex; v++) {
            if (v == a->edge[2 * e] || v == a->edge[2 * e + 1]) continue;
            assert_false(nmm_isegment_meets_pixel(s.a, s.b, a->vertex[v]));
        }
    }
    for (int v = 1; v < a->n_vertex; v++)
        assert_true(nmm_ipoint_compare(a->vertex[v - 1], a->vertex[v]) < 0);
}

// Twice the area that the cycles of a face enclose.
static nmm_int128 face_area(const nmm_arrangement *a, int face) {
    nmm_int128 sum = 0;
    const nmm_ipoint zero = {0, 0};
    for (int c = a->face_start[face]; c < a->face_start[face + 1]; c++) {
        int h = a->cycle[c];
        do {
            assert_int_equal(a->face[h], face);
            assert_false(a->bridge[h / 2]);
            assert_int_equal(a->edge[a->next[h]], a->edge[h ^ 1]);
            sum += nmm_icross(zero, start_of(a, h), start_of(a, h ^ 1));
            h = a->next[h];
        } while (h != a->cycle[c]);
    }
    return sum;
}

// Is p inside the outer cycle of the face? p is no vertex of it and on no edge of it.
static bool in_outer_cycle(const nmm_arrangement *a, int face, nmm_ipoint p) {
    bool inside = false;
    int h = a->cycle[a->face_start[face]];
    do {
        nmm_ipoint q = start_of(a, h), r = start_of(a, h ^ 1);
        if (nmm_ipoint_equal(p, q)) return false;
        if ((q.y <= p.y) != (r.y <= p.y)) {
            const bool upward = q.y < r.y;
            if (nmm_orientation(upward ? q : r, upward ? r : q, p) < 0) inside = !inside;
        }
        h = a->next[h];
    } while (h != a->cycle[a->face_start[face]]);
    return inside;
}

// Faces: areas positive and summing up; Euler's formula; each half-edge in the smallest outer cycle
// that holds it.
static void check_faces(const nmm_arrangement *a) {
    nmm_int128 bounded = 0;
    for (int f = 1; f < a->n_face; f++) {
        assert_true(a->face_start[f] < a->face_start[f + 1]);
        const nmm_int128 area = face_area(a, f);
        assert_true(area > 0);
        bounded += area;
    }
    assert_true(face_area(a, 0) == -bounded);
    int parent[4096];
    assert_true(a->n_vertex < 4096);
    for (int v = 0; v < a->n_vertex; v++)
        parent[v] = v;
    for (int e = 0; e < a->n_edge; e++)
        nmm_set_join(parent, a->edge[2 * e], a->edge[2 * e + 1]);
    int n_part = 0;
    for (int v = 0; v < a->n_vertex; v++)
        n_part += nmm_set_root(parent, v) == v;
    assert_int_equal(a->n_vertex - a->n_edge + a->n_face, 1 + n_part);
    for (int e = 0; e < a->n_edge; e++) {
        const bool same = a->face[2 * e] == a->face[2 * e + 1];
        assert_int_equal(same, a->bridge[e]);
    }
}

// The lowest vertex of each connected part lies in the face that its outside belongs to.
static void check_islands(const nmm_arrangement *a) {
    int parent[4096], lowest[4096];
    for (int v = 0; v < a->n_vertex; v++)
        parent[v] = v;
    for (int e = 0; e < a->n_edge; e++)
        nmm_set_join(parent, a->edge[2 * e], a->edge[2 * e + 1]);
    for (int v = 0; v < a->n_vertex; v++)
        lowest[v] = nmm_set_root(parent, v) == v; // roots are the smallest: the lowest vertices
    for (int h = 0; h < 2 * a->n_edge; h++) {
        const int v = a->edge[h];
        if (!lowest[v]) continue;
        lowest[v] = 0;
        // Of the half-edges that leave the lowest vertex, the outside is left of the last one
        // counter-clockwise: directions there span less than half a turn, to the right.
        int last = h;
        for (int g = 0; g < 2 * a->n_edge; g++) {
            if (a->edge[g] != v) continue;
            const nmm_ipoint p = start_of(a, last ^ 1), q = start_of(a, g ^ 1);
            if (nmm_orientation(a->vertex[v], p, q) > 0) last = g;
        }
        int expected = 0;
        nmm_int128 least = 0;
        for (int f = 1; f < a->n_face; f++) {
            const nmm_int128 area = face_area(a, f);
            const bool own = nmm_set_root(parent, a->edge[a->cycle[a->face_start[f]]]) == v;
            if (own || !in_outer_cycle(a, f, a->vertex[v])) continue;
            if (expected == 0 || area < least) expected = f;
            if (expected == f) least = area;
        }
        assert_int_equal(a->face[last], expected);
    }
}

static void check_all(const nmm_arrangement *a) {
    check_planar(a);
    check_faces(a);
    check_islands(a);
}

// --- Hand-made

static void cross(void **state) {
    (void)state;
    work w;
    work_open(&w);
    add(&w, 0, 0, 10, 10);
    add(&w, 0, 10, 10, 0);
    work_build(&w);
    check_all(&w.a);
    assert_int_equal(w.a.n_vertex, 5);
    assert_int_equal(w.a.n_edge, 4);
    assert_int_equal(w.a.n_face, 1);
    for (int e = 0; e < 4; e++)
        assert_true(w.a.bridge[e]);
    work_close(&w);
}

static void nested_squares(void **state) {
    (void)state;
    work w;
    work_open(&w);
    add_square(&w, 40, 40, 20);
    add_square(&w, 0, 0, 100);
    add_square(&w, 20, 20, 60);
    add(&w, 45, 45, 50, 55);   // loose inside the innermost
    add(&w, -5, 50, 10, 50);   // dangles from the outermost on both sides
    add(&w, 200, 200, 220, 0); // alone outside
    work_build(&w);
    check_all(&w.a);
    assert_int_equal(w.a.n_face, 4);
    int n_bridge = 0;
    for (int e = 0; e < w.a.n_edge; e++)
        n_bridge += w.a.bridge[e];
    assert_int_equal(n_bridge, 4);
    work_close(&w);
}

static void overlaps_are_merged(void **state) {
    (void)state;
    work w;
    work_open(&w);
    add(&w, 0, 0, 100, 0);
    add(&w, 60, 0, 20, 0);
    add(&w, 100, 0, 0, 0);
    add(&w, 5, 5, 5, 5);
    work_build(&w);
    assert_int_equal(w.a.n_edge, 3);
    assert_int_equal(w.a.n_vertex, 4);
    // The middle edge knows all three, the second and third run backwards.
    assert_int_equal(w.a.source_start[2] - w.a.source_start[1], 3);
    const int *source = w.a.source + w.a.source_start[1];
    assert_int_equal(source[0], 0);
    assert_int_equal(source[1], 3);
    assert_int_equal(source[2], 5);
    work_close(&w);
}

static void families_that_cross(void **state) {
    (void)state;
    work w;
    work_open(&w);
    add(&w, 0, 0, 10, 10);
    add(&w, 0, 10, 10, 0);
    w.segment[0].family = 4;
    w.segment[1].family = 5;
    work_build(&w);
    assert_int_equal(w.a.crossed, -1);
    w.segment[1].family = 4;
    work_build(&w);
    assert_int_equal(w.a.crossed, 4);
    work_close(&w);
}

// --- Welding

static void work_weld(work *w, int64_t reach) {
    assert_int_equal(nmm_arrangement_build(&w->context, &w->a, w->n, w->segment, reach), NMM_OK);
}

// An outline of rank 0 stays where it is; ends of rank 2 just short of it or beyond move onto it.
static void ends_move_to_the_outline(void **state) {
    (void)state;
    const int64_t off[] = {-5, 0, 5};
    for (int k = 0; k < 3; k++) {
        work w;
        work_open(&w);
        add(&w, 0, 0, 1000, 0);
        add(&w, 500, 700, 403, off[k]);
        w.segment[1].rank = 2;
        work_weld(&w, 8);
        check_all(&w.a);
        assert_int_equal(w.a.n_edge, 3);
        assert_int_equal(w.a.n_vertex, 4);
        for (int v = 0; v < w.a.n_vertex; v++)
            assert_true(w.a.vertex[v].y == 0 || w.a.vertex[v].y == 700);
        // Out of reach: nothing moves.
        work_weld(&w, 4);
        assert_int_equal(w.a.n_edge, k == 0 ? 4 : k == 1 ? 3 : 2);
        work_close(&w);
    }
}

// Of vertices near each other the most rigid stays, whatever the order.
static void the_most_rigid_stays(void **state) {
    (void)state;
    for (int turn = 0; turn < 3; turn++) {
        work w;
        work_open(&w);
        for (int k = 0; k < 3; k++) {
            const int rank = (k + turn) % 3;
            add(&w, 1000 + 3 * rank, 1000 - rank, rank == 0 ? 2000 : -2000 * rank, 5000);
            w.segment[k].rank = 2 - rank;
        }
        work_weld(&w, 10);
        assert_int_equal(w.a.n_vertex, 4);
        int found = 0;
        for (int v = 0; v < 4; v++)
            found += w.a.vertex[v].x == 1006 && w.a.vertex[v].y == 998;
        assert_int_equal(found, 1);
        work_close(&w);
    }
}

// Where welding swaps the order of an edge's ends, its source still runs the way it ran.
static void sources_keep_their_direction(void **state) {
    (void)state;
    work w;
    work_open(&w);
    add(&w, 4, 0, 2000, 0);
    add(&w, 0, 0, 1, 1000);
    w.segment[1].rank = 2;
    work_weld(&w, 6);
    assert_int_equal(w.a.n_edge, 2);
    // The edge (1, 1000) - (4, 0) comes first; segment 1 runs from its higher vertex.
    assert_int_equal(w.a.source[w.a.source_start[0]], 2 * 1 + 1);
    assert_int_equal(w.a.source[w.a.source_start[1]], 0);
    work_close(&w);
}

// Two segments nearly on one line become one wherever they are near.
static void nearly_parallel(void **state) {
    (void)state;
    work w;
    work_open(&w);
    add(&w, 0, 0, 100000, 0);
    add(&w, 20000, 3, 80000, -2);
    for (int k = 1; k < 10; k++)
        add(&w, 10000 * k, -500, 10000 * k + 7, 600);
    work_weld(&w, 16);
    check_all(&w.a);
    assert_int_equal(w.a.n_face, 1);
    work_close(&w);
}

// Random segments welded with a reach far above the unit are planar too, in any order.
static uint64_t arrangement_hash(const nmm_arrangement *a);
static void shuffle(work *w, nmm_random *random);
static void welded_at_random(void **state) {
    (void)state;
    work w;
    work_open(&w);
    nmm_random random = nmm_random_seed(9);
    for (int k = 0; k < 300; k++) {
        w.n = 0;
        for (int i = 0; i < 12; i++) {
            int64_t c[4];
            for (int j = 0; j < 4; j++) {
                // Near the points of a raster.
                c[j] = 1000 * (int64_t)(nmm_random_next(&random) % 6);
                c[j] += (int64_t)(nmm_random_next(&random) % 21) - 10;
            }
            add(&w, c[0], c[1], c[2], c[3]);
            w.segment[i].rank = i % 3;
        }
        work_weld(&w, 30);
        check_all(&w.a);
        const uint64_t hash = arrangement_hash(&w.a);
        shuffle(&w, &random);
        work_weld(&w, 30);
        assert_true(hash == arrangement_hash(&w.a));
    }
    work_close(&w);
}

static void nothing(void **state) {
    (void)state;
    work w;
    work_open(&w);
    work_build(&w);
    assert_int_equal(w.a.n_edge, 0);
    assert_int_equal(w.a.n_face, 1);
    add(&w, 3, 3, 3, 3);
    work_build(&w);
    assert_int_equal(w.a.n_edge, 0);
    work_close(&w);
}

// --- Random

static int64_t random_below(nmm_random *random, int64_t n) {
    return (int64_t)(nmm_random_next(random) % (uint64_t)n);
}

static void random_segments(work *w, nmm_random *random, int n, int64_t size) {
    w->n = 0;
    for (int i = 0; i < n; i++) {
        add(w, random_below(random, size), random_below(random, size), random_below(random, size),
            random_below(random, size));
    }
}

static void random_arrangements(void **state) {
    (void)state;
    work w;
    work_open(&w);
    nmm_random random = nmm_random_seed(2);
    for (int k = 0; k < 400; k++) {
        const int n = 1 + (int)random_below(&random, 14);
        random_segments(&w, &random, n, 4 + random_below(&random, 30));
        work_build(&w);
        check_all(&w.a);
    }
    work_close(&w);
}

// Many small loops and loose pieces: islands in islands.
static void random_islands(void **state) {
    (void)state;
    work w;
    work_open(&w);
    nmm_random random = nmm_random_seed(3);
    for (int k = 0; k < 200; k++) {
        w.n = 0;
        for (int i = 0; i < 12; i++) {
            add_square(&w, random_below(&random, 40), random_below(&random, 40),
                       1 + random_below(&random, 25));
        }
        add(&w, random_below(&random, 40), random_below(&random, 40), random_below(&random, 40),
            random_below(&random, 40));
        work_build(&w);
        check_all(&w.a);
    }
    work_close(&w);
}

static uint64_t arrangement_hash(const nmm_arrangement *a) {
    uint64_t hash = NMM_HASH_START;
    hash = nmm_hash(hash, a->vertex, (size_t)a->n_vertex * sizeof *a->vertex);
    hash = nmm_hash(hash, a->edge, 2 * (size_t)a->n_edge * sizeof(int));
    hash = nmm_hash(hash, a->face, 2 * (size_t)a->n_edge * sizeof(int));
    return nmm_hash(hash, a->cycle, (size_t)a->face_start[a->n_face] * sizeof(int));
}

// Another order, and other directions.
static void shuffle(work *w, nmm_random *random) {
    for (int i = w->n - 1; i > 0; i--) {
        const int j = (int)random_below(random, i + 1);
        const nmm_isegment moved = w->segment[i];
        w->segment[i] = w->segment[j];
        w->segment[j] = (nmm_isegment){moved.b, moved.a, moved.family, moved.rank};
    }
}

// Same bits for any order and direction of the segments.
static void order_and_direction(void **state) {
    (void)state;
    work w;
    work_open(&w);
    nmm_random random = nmm_random_seed(4);
    for (int k = 0; k < 300; k++) {
        random_segments(&w, &random, 20, k % 2 == 0 ? 24 : INT64_C(1) << 40);
        work_build(&w);
        const uint64_t hash = arrangement_hash(&w.a);
        shuffle(&w, &random);
        work_build(&w);
        assert_true(hash == arrangement_hash(&w.a));
    }
    work_close(&w);
}

// Each edge stays near the segments that it came from, even where all pixels are hot.
static void edges_stay_near(void **state) {
    (void)state;
    work w;
    work_open(&w);
    nmm_random random = nmm_random_seed(6);
    for (int k = 0; k < 200; k++) {
        random_segments(&w, &random, 24, 60);
        work_build(&w);
        for (int e = 0; e < w.a.n_edge; e++) {
            for (int s = w.a.source_start[e]; s < w.a.source_start[e + 1]; s++) {
                const nmm_isegment t = w.segment[w.a.source[s] / 2];
                const double length = hypot((double)(t.b.x - t.a.x), (double)(t.b.y - t.a.y));
                for (int end = 0; end < 2; end++) {
                    const nmm_ipoint p = start_of(&w.a, 2 * e + end);
                    const double off = fabs((double)nmm_icross(t.a, t.b, p)) / length;
                    assert_true(off <= 3);
                }
            }
        }
    }
    work_close(&w);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cross),
        cmocka_unit_test(nested_squares),
        cmocka_unit_test(overlaps_are_merged),
        cmocka_unit_test(families_that_cross),
        cmocka_unit_test(ends_move_to_the_outline),
        cmocka_unit_test(the_most_rigid_stays),
        cmocka_unit_test(sources_keep_their_direction),
        cmocka_unit_test(nearly_parallel),
        cmocka_unit_test(welded_at_random),
        cmocka_unit_test(nothing),
        cmocka_unit_test(random_arrangements),
        cmocka_unit_test(random_islands),
        cmocka_unit_test(order_and_direction),
        cmocka_unit_test(edges_stay_near),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
