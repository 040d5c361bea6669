// SPDX-License-Identifier: MIT
//
// Passes for part of the rows: what a move of some covers touches gives the same bits as all of it;
// rows are chosen by what may be left aside; where few are out of balance a run ends where one that
// solves for all rows does, and small systems are solved as a whole.

#include "scenes.h"
#include "test.h"

#include <stdlib.h>

#define DRY_STONES                                                                                 \
    "materials:\n"                                                                                 \
    "  stone: {density: 2500, youngs_modulus: 1e9, poissons_ratio: 0.25}\n"                        \
    "interfaces: {dry: {friction_angle: 30}}\n"                                                    \
    "interface: dry\n"                                                                             \
    "covers: {mesh: block}\n"                                                                      \
    "supports: [{block: base, fix: xy}]\n"

// Blocks in a row, and one that comes from the left.
static const char *const SCENE_ROW =
    "nmm: 1\n"
    "gravity: [0, -9.81]\n"
    "blocks:\n"
    "  - {name: base, polygon: [[-2, -1], [101, -1], [101, 0], [-2, 0]]}\n"
    "  - {polygon: [[0, 0], [1, 0], [1, 0.5], [0, 0.5]], repeat: {count: [100, 1], step: [1, 1]}}\n"
    "  - {name: hammer, polygon: [[-1.04, 0], [-0.04, 0], [-0.04, 0.5], [-1.04, 0.5]],\n"
    "     velocity: [1, 0, 0]}\n" DRY_STONES
    "monitors: [{name: first, point: [0.5, 0.25]}, {name: tenth, point: [9.5, 0.25]}]\n"
    "time: {dt: 1e-3, end: 0.06}\n";

// Bricks on each other, with lattice covers where asked for.
static const char *const SCENE_BRICKS =
    "nmm: 1\n"
    "gravity: [0, -9.81]\n"
    "blocks:\n"
    "  - {name: base, polygon: [[-2, -1], [8, -1], [8, 0], [-2, 0]]}\n"
    "  - {polygon: [[0, 0], [1, 0], [1, 0.5], [0, 0.5]], repeat: {count: [6, 2], step: [1, 1]}}\n"
    "  - {polygon: [[0.5, 0.5], [1.5, 0.5], [1.5, 1], [0.5, 1]],\n"
    "     repeat: {count: [5, 2], step: [1, 1]}}\n" DRY_STONES "time: {dt: 1e-3, end: 1}\n";

// A wall that gravity takes at once: a few rows at its foot hold most of what does not balance, and
// next to nothing is strewn over all others.
static const char *const SCENE_WALL =
    "nmm: 1\n"
    "gravity: [0, -9.81]\n"
    "blocks:\n"
    "  - {name: base, polygon: [[-2, -1], [18, -1], [18, 0], [-2, 0]]}\n"
    "  - {polygon: [[0, 0], [1, 0], [1, 0.5], [0, 0.5]], repeat: {count: [16, 18], step: [1, 1]}}\n"
    "  - {polygon: [[0.5, 0.5], [1.5, 0.5], [1.5, 1], [0.5, 1]],\n"
    "     repeat: {count: [15, 18], step: [1, 1]}}\n" DRY_STONES "time: {dt: 1e-3, end: 1}\n";

// --- What a move touches

typedef struct copy {
    double *residual, *scale, *position;
    nmm_contact *contact;
} copy;

static void *copy_of(const void *from, size_t size) {
    void *to = malloc(size);
    assert_non_null(to);
    memcpy(to, from, size);
    return to;
}

static copy copy_state(const nmm_sim *sim) {
    const size_t n = (size_t)sim->model.n_cover;
    return (copy){copy_of(sim->system.residual, 2 * n * sizeof(double)),
                  copy_of(sim->system.scale, n * sizeof(double)),
                  copy_of(sim->state.position, 2 * (size_t)sim->model.n_point * sizeof(double)),
                  copy_of(sim->state.contact, (size_t)sim->state.n_contact * sizeof(nmm_contact))};
}

static void check_same(const nmm_sim *sim, const copy *before) {
    const size_t n = (size_t)sim->model.n_cover, n_point = (size_t)sim->model.n_point;
    assert_memory_equal(before->residual, sim->system.residual, 2 * n * sizeof(double));
    assert_memory_equal(before->scale, sim->system.scale, n * sizeof(double));
    assert_memory_equal(before->position, sim->state.position, 2 * n_point * sizeof(double));
    for (int k = 0; k < sim->state.n_contact; k++) {
        const nmm_contact *a = &before->contact[k], *b = &sim->state.contact[k];
        assert_true(a->mode == b->mode && a->gap == b->gap && a->slip == b->slip);
        assert_true(a->normal_force == b->normal_force && a->shear_force == b->shear_force);
    }
}

static nmm_contact_verdict evaluate(nmm_sim *sim, const nmm_touched *touched) {
    const nmm_step_state step = {1e-3, sim->state.time + 1e-3, sim->moved};
    nmm_contact_verdict verdict;
    if (touched == NULL) {
        nmm_state_place(&sim->model, &sim->state, 1);
        verdict = nmm_contact_evaluate(sim->search, &sim->model, &sim->state, 1);
    } else {
        nmm_state_place_some(&sim->model, &sim->state, touched->point.item, touched->point.n, 1);
        verdict = nmm_contact_evaluate_some(&sim->model, &sim->state, touched->contact.item,
                                            touched->contact.n, 1);
    }
    nmm_system_residual(&sim->context, &sim->system, &sim->model, &sim->state, &step, touched);
    return verdict;
}

// Covers first, first + stride, .. by some part of a thousandth of the size.
static int move_some(nmm_sim *sim, int first, int stride, int *moved) {
    int n = 0;
    for (int c = first; c < sim->model.n_cover; c += stride) {
        if (sim->system.fixed != NULL && sim->system.fixed[c] == 3) continue;
        for (int x = 0; x < 2; x++) {
            const double way = 1e-3 * sim->model.size * ((c * 7 + x * 3) % 11 - 5) / 5;
            sim->state.displacement[2 * c + x] += way;
            sim->moved[2 * c + x] += way;
        }
        moved[n++] = c;
    }
    return n;
}

static void check_touched(const char *covers, const char *scheme) {
    const char *const changes[] = {covers, scheme};
    nmm_sim *sim = open_scene(SCENE_BRICKS, 2, changes);
    take_steps(sim, 3);
    assert_int_equal(nmm_contact_find(&sim->context, sim->search, &sim->model, &sim->state, 0.05),
                     NMM_OK);
    assert_int_equal(nmm_system_pattern(&sim->context, &sim->system, &sim->model, &sim->state),
                     NMM_OK);
    nmm_touched touched = {0};
    assert_int_equal(nmm_touched_open(&sim->context, &touched, &sim->model), NMM_OK);
    int *moved = calloc((size_t)sim->model.n_cover, sizeof *moved), n_flip = 0;
    evaluate(sim, NULL);
    for (int stride = 3; stride < 40; stride += 9) {
        const int before = evaluate(sim, NULL).n_sliding;
        const int n = move_some(sim, stride % 5, stride, moved);
        assert_int_equal(nmm_touched_by(&sim->context, &touched, &sim->system, &sim->model,
                                        &sim->state, moved, n),
                         NMM_OK);
        assert_true(stride < 12 || touched.row.n < sim->model.n_cover);
        const nmm_contact_verdict part = evaluate(sim, &touched);
        n_flip += part.n_opened + part.n_closed + part.n_slipped + part.n_stuck;
        copy here = copy_state(sim);
        // All of it, from scratch, finds nothing else.
        const nmm_contact_verdict all = evaluate(sim, NULL);
        assert_int_equal(all.n_opened + all.n_closed + all.n_slipped + all.n_stuck, 0);
        assert_int_equal(before + part.n_sliding - part.n_slid, all.n_sliding);
        check_same(sim, &here);
        free(here.residual), free(here.scale), free(here.position), free(here.contact);
    }
    assert_true(n_flip > 10);
    free(moved);
    nmm_touched_close(&sim->context, &touched);
    nmm_sim_destroy(sim);
}

static void test_touched(void **unused) {
    (void)unused;
    check_touched("covers={mesh: block}", "analysis.scheme=shi");
    check_touched("covers={size: 0.4}", "analysis.scheme=newmark");
    check_touched("covers={size: 0.6, order: 1}", "analysis.scheme=shi");
}

// --- Rows

static void set_residual(nmm_sim *sim, double everywhere, int row, double there) {
    for (int i = 0; i < 2 * sim->model.n_cover; i++)
        sim->system.residual[i] = everywhere;
    sim->system.residual[2 * row] = there;
}

static void test_choice(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_ROW, 0, NULL);
    take_steps(sim, 1);
    nmm_nearby *nearby = &sim->nearby;
    const int row = 3 * 50, n = sim->model.n_cover;
    // Nothing to do, all to do, something that is no number.
    set_residual(sim, 0, row, 0);
    assert_false(nmm_nearby_choose(nearby, &sim->system, 1, 0, 1e-3));
    set_residual(sim, 1, row, 1);
    assert_false(nmm_nearby_choose(nearby, &sim->system, 1, 0, 1e-3));
    set_residual(sim, 0, row, NAN);
    assert_false(nmm_nearby_choose(nearby, &sim->system, 1, 0, 1e-3));
    // One row, the others together below what may be left: five rings on both sides.
    set_residual(sim, 1e-3, row, 100);
    assert_true(nmm_nearby_choose(nearby, &sim->system, 1, 0, 1e-3));
    assert_true(nearby->place[row] >= 0 && nearby->n_row >= 30 && nearby->n_row <= 36);
    for (int i = 1; i < nearby->n_row; i++)
        assert_true(nearby->row[i] > nearby->row[i - 1]);
    for (int c = 0; c < n; c++)
        assert_true(nearby->place[c] < 0 || nearby->row[nearby->place[c]] == c);
    // What is held has no row.
    assert_true(nearby->place[0] < 0);
    // The others are more than may be left; a step so long that everything is near.
    assert_false(nmm_nearby_choose(nearby, &sim->system, 1e-4, 0, 1e-3));
    assert_false(nmm_nearby_choose(nearby, &sim->system, 1, 0, 1));
    nmm_sim_destroy(sim);
}

// --- Runs

// Runs one that solves for part of the rows beside one that does not, and compares their ends: in
// at least `least` steps the last solve was for fewer than `rows`.
static void check_same_end(const char *scene, int n_step, int rows, int least) {
    const char *const close[] = {"analysis.tolerance=1e-9", "solver.method=direct"};
    nmm_sim *part = open_scene(scene, 1, close), *all = open_scene(scene, 2, close);
    assert_null(all->nearby.model);
    int few = 0;
    for (int k = 0; k < n_step; k++) {
        part->nearby.n_row = 0;
        assert_true(take_steps(part, 1).end <= NMM_END_COMPLETED);
        few += part->nearby.n_row > 0 && part->nearby.n_row < rows;
    }
    take_steps(all, n_step);
    assert_true(few >= least);
    double largest = 0;
    for (int i = 0; i < 2 * part->model.n_cover; i++)
        largest = fmax(largest, fabs(all->state.displacement[i]));
    assert_true(largest > 1e-5);
    for (int i = 0; i < 2 * part->model.n_cover; i++)
        assert_near(part->state.displacement[i], all->state.displacement[i], 1e-5 * largest);
    nmm_sim_destroy(part);
    nmm_sim_destroy(all);
}

// A hammer on a row of blocks that has come to rest: few rows are out of balance.
static void test_same_end(void **unused) {
    (void)unused;
    check_same_end(SCENE_ROW, 60, 100, 10);
}

static void test_strewn(void **unused) {
    (void)unused;
    check_same_end(SCENE_WALL, 6, 500, 4);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_touched), cmocka_unit_test(test_choice),
        cmocka_unit_test(test_same_end), cmocka_unit_test(test_strewn)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
