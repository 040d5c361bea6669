// SPDX-License-Identifier: MIT
//
// Blocks that overlap are refused, with names and depth; what a rounded drawing leaves is a
// warning; what only touches is neither. Depths against closed forms; cost of many blocks.

#include "overlap.h"
#include "stage.h"

// Depth that error or warning tells of the scene that stands in `s`; 0: neither. Closes it.
static double told_depth(stage *s, nmm_status expected, const char *words) {
    double depth = 0;
    const nmm_status status = nmm_cover_build(&s->context, &s->scene, &s->model, &s->report);
    assert_int_equal(status, expected);
    const char *text = status == NMM_OK ? s->scene.warnings : s->context.error.message;
    const char *by = text != NULL ? strstr(text, " by ") : NULL;
    if (by != NULL) assert_int_equal(sscanf(by, " by %lf m", &depth), 1);
    if (words != NULL && (text == NULL || strstr(text, words) == NULL)) {
        print_error("expected '%s' in: %s\n", words, text != NULL ? text : "nothing");
        fail();
    }
    nmm_context_clear(&s->context);
    stage_close(s);
    return depth;
}

static void open_square(stage *s, double size) {
    stage_open(s, size);
    stage_block(s, 4, (double[]){0, 0, 1, 0, 1, 1, 0, 1}, "a");
}

static void rectangles(void **state) {
    (void)state;
    const struct {
        double x0, y0, x1, y1, depth;
    } b[] = {
        {0, 0.5, 1, 1.5, 0.5},     // sunk in from above
        {0, 0, 1, 1, 1},           // the same again
        {0.3, 0.3, 0.6, 0.6, 0.3}, // swallowed
        {0.4, -1, 0.6, 2, 0.2},    // across
        {-9, -9, 9, 9, 1},         // around
        {0.7, 0.8, 2, 2, 0.2},     // corner to corner
    };
    for (size_t k = 0; k < sizeof b / sizeof *b; k++) {
        stage s;
        open_square(&s, 0.3);
        const double corner[] = {b[k].x0, b[k].y0, b[k].x1, b[k].y0,
                                 b[k].x1, b[k].y1, b[k].x0, b[k].y1};
        stage_block(&s, 4, corner, "b");
        s.scene.block[1].area.mark = (nmm_mark){.line = 4, .column = 5};
        assert_close(told_depth(&s, NMM_ERROR_INPUT, "block 'b' overlaps block 'a' by"), b[k].depth,
                     1e-2);
    }
}

// Rounding of a drawing to millimetres is carried, to centimetres it is for blocks of this size
// too.
static void rounded_drawing(void **state) {
    (void)state;
    const double depth[] = {1e-2, 1.5e-3, 1e-5, 1e-6, 1e-8, 0, -1e-3};
    for (size_t k = 0; k < sizeof depth / sizeof *depth; k++) {
        stage s;
        open_square(&s, 0.3);
        const double y = 1 - depth[k];
        stage_block(&s, 4, (double[]){0.1, y, 1.1, y, 1.1, y + 1, 0.1, y + 1}, "b");
        const bool told = depth[k] > 3e-7;
        const double found = told_depth(&s, NMM_OK, told ? "'b' overlaps block 'a'" : NULL);
        assert_near(found, told ? depth[k] : 0.0, 1e-6 + 1e-2 * fabs(depth[k]));
    }
    // Covers far smaller than the blocks carry less.
    stage s;
    open_square(&s, 0.05);
    stage_block(&s, 4, (double[]){0, 0.99, 1, 0.99, 1, 2, 0, 2}, "b");
    assert_near(told_depth(&s, NMM_ERROR_INPUT, "0.005 m is taken"), 0.01, 1e-6);
}

// The domain counts without its holes.
static void domain_and_hole(void **state) {
    (void)state;
    for (int k = 0; k < 3; k++) {
        stage s;
        stage_open(&s, 0.5);
        stage_rectangle(&s, 0, 0, 6, 6);
        stage_hole(&s, 4, (double[]){2, 2, 4, 2, 4, 4, 2, 4});
        // On its floor; sunk into it; on the surface.
        const double y = k == 0 ? 2 : k == 1 ? 1.75 : 6;
        stage_block(&s, 4, (double[]){2.5, y, 3.5, y, 3.5, y + 1, 2.5, y + 1}, "stone");
        if (k == 1)
            assert_close(told_depth(&s, NMM_ERROR_INPUT, "'stone' overlaps the domain by"), 0.25,
                         1e-2);
        else
            assert_true(told_depth(&s, NMM_OK, NULL) == 0);
    }
}

// A block in the notch of another, and its mirror image pushed in.
static void notch(void **state) {
    (void)state;
    for (int k = 0; k < 2; k++) {
        stage s;
        stage_open(&s, 0.5);
        stage_block(&s, 7, (double[]){0, 0, 4, 0, 4, 3, 3, 3, 2, 1, 1, 3, 0, 3}, "cup");
        const double y = k == 0 ? 1 : 0.8;
        stage_block(&s, 3, (double[]){2, y, 3, y + 2, 1, y + 2}, "wedge");
        if (k == 0)
            assert_true(told_depth(&s, NMM_OK, NULL) == 0);
        else
            // 0.2 m down means 0.2 / sqrt(5) across each side.
            assert_close(told_depth(&s, NMM_ERROR_INPUT, "'wedge' overlaps block 'cup'"),
                         0.2 / sqrt(5), 0.1);
    }
}

// Neighbours that share their edges, at any angle, are never told.
static void shared_edges(void **state) {
    (void)state;
    enum { N = 12 };
    nmm_random random = nmm_random_seed(4);
    double p[N + 1][N + 1][2];
    for (int i = 0; i <= N; i++) {
        for (int j = 0; j <= N; j++) {
            p[i][j][0] = 3e5 + i + 0.4 * nmm_random_unit(&random);
            p[i][j][1] = 5e6 + j + 0.4 * nmm_random_unit(&random);
        }
    }
    stage s;
    stage_open(&s, 0.7);
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < N; j++) {
            const double *a = p[i][j], *b = p[i + 1][j], *c = p[i + 1][j + 1], *d = p[i][j + 1];
            stage_block(&s, 4, (double[]){a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1]}, "stone");
        }
    }
    assert_true(told_depth(&s, NMM_OK, NULL) == 0);
}

// Stones of all sizes apart from each other, and one pair that overlaps: found whatever their
// order.
static void mixed_sizes(void **state) {
    (void)state;
    for (int turn = 0; turn < 2; turn++) {
        stage s;
        stage_open(&s, 4);
        double x = 0;
        for (int k = 0; k < 40; k++) {
            const double side = ldexp(1, k % 8 - 4);
            const double start = k == 30 ? x - 0.5 * side : x;
            const double low = turn == 0 ? start : -start - side, high = low + side;
            const char *name = k == 30 ? "deep" : "stone";
            stage_block(&s, 4, (double[]){low, 0, high, 0, high, side, low, side}, name);
            x = start + side;
        }
        assert_close(told_depth(&s, NMM_ERROR_INPUT, "'deep' overlaps block 'stone'"), 2.0, 0.01);
    }
}

static void domain_of_two_materials(void **state) {
    (void)state;
    for (int k = 0; k < 3; k++) {
        stage s;
        stage_open(&s, 0.5);
        stage_domain(&s, 4, (double[]){0, 0, 4, 0, 4, 2, 0, 2}, 0);
        // Overlapping, of the other material or the same; side by side.
        const double y = k == 2 ? 2 : 1;
        stage_domain(&s, 4, (double[]){0, y, 4, y, 4, 4, 0, 4}, k == 1 ? 0 : 1);
        s.scene.domain[1].mark = (nmm_mark){.line = 9, .column = 5};
        told_depth(&s, NMM_OK, k == 0 ? "9:5: warning: this polygon of the domain overlaps" : NULL);
    }
}

// A pile of copies: told without comparing all pairs.
static void many_copies(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 0.3);
    for (int k = 0; k < 20000; k++)
        stage_block(&s, 4, (double[]){0, 0, 1, 0, 1, 1, 0, 1}, "copy");
    told_depth(&s, NMM_ERROR_INPUT, "block 'copy' overlaps block 'copy' by 1 m");
}

static void many_blocks(void **state) {
    (void)state;
    enum { N = 100 };
    stage s;
    stage_open(&s, 50);
    for (int k = 0; k < N * N; k++) {
        const double x = 0.5 * (k % N) + 0.25 * (k / N % 2), y = 0.2 * floor((double)k / N);
        stage_block(&s, 4, (double[]){x, y, x + 0.5, y, x + 0.5, y + 0.2, x, y + 0.2}, "brick");
    }
    const double start = nmm_clock();
    bool apart = false;
    assert_int_equal(nmm_cut_overlaps(&s.context, &s.scene, 50, (nmm_vec2){0, 0}, &apart), NMM_OK);
    assert_true(apart);
    print_message("%d blocks: %.3f s\n", N * N, nmm_clock() - start);
    assert_null(s.scene.warnings);
    stage_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rectangles),
        cmocka_unit_test(rounded_drawing),
        cmocka_unit_test(notch),
        cmocka_unit_test(domain_and_hole),
        cmocka_unit_test(shared_edges),
        cmocka_unit_test(mixed_sizes),
        cmocka_unit_test(many_blocks),
        cmocka_unit_test(many_copies),
        cmocka_unit_test(domain_of_two_materials),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
