// SPDX-License-Identifier: MIT
//
// What ends a step and a run: no unconverged solve is accepted, the floor of dt, the last good
// state, methods that agree, nothing allocated in a steady loop, nothing of contact where nothing
// can meet.

#include "scenes.h"
#include "test.h"

static void test_solver_that_fails_is_never_accepted(void **unused) {
    (void)unused;
    const char *const changes[] = {"solver.max_iterations=1", "time.dt_min=1e-5"};
    nmm_sim *sim = open_scene(SCENE_BLOCK_ON_BASE, 2, changes);
    const nmm_step_report report = take_steps(sim, 1);
    assert_int_equal(report.end, NMM_END_SOLVER_FAILED);
    assert_int_equal(report.step, 0);
    assert_true(report.cuts > 2);
    assert_non_null(strstr(report.reason, "dt_min"));
    assert_non_null(strstr(report.reason, "did not converge"));
    nmm_summary summary;
    nmm_sim_summary(sim, &summary);
    assert_int_equal(summary.end, NMM_END_SOLVER_FAILED);
    assert_true(summary.failed > 2);
    // Displacements as before; a further call does nothing.
    for (int i = 0; i < 2 * sim->model.n_cover; i++)
        assert_true(sim->state.displacement[i] == 0);
    assert_true(sim->state.time == 0);
    assert_int_equal(take_steps(sim, 1).end, NMM_END_SOLVER_FAILED);
    nmm_sim_destroy(sim);
}

static void test_plain_jacobi_cuts_the_step(void **unused) {
    (void)unused;
    // Closed contacts raise lambda_max of D^-1 K far above 2: the plain form diverges, and the step
    // is shortened until the floor (docs/theory/6-solve.md). The damped form goes through.
    const char *const plain[] = {"solver.method=jacobi", "solver.damping=1", "contact.penalty=2000",
                                 "time.dt_min=1e-6"};
    nmm_sim *sim = open_scene(SCENE_BLOCK_ON_BASE, 4, plain);
    const nmm_step_report report = take_steps(sim, 2000);
    assert_int_equal(report.end, NMM_END_SOLVER_FAILED);
    assert_non_null(strstr(report.reason, "diverged"));
    nmm_sim_destroy(sim);
    const char *const damped[] = {"solver.method=jacobi", "time.end=0.02"};
    sim = open_scene(SCENE_BLOCK_ON_BASE, 2, damped);
    assert_int_equal(take_steps(sim, 400).end, NMM_END_COMPLETED);
    nmm_sim_destroy(sim);
}

// Least det F of all elements.
static double least_volume(const nmm_sim *sim) {
    double least = INFINITY;
    for (int e = 0; e < sim->model.n_element; e++) {
        double d[6];
        for (int i = 0; i < 6; i++) {
            const int c = sim->model.element_cover[3 * e + i / 2];
            d[i] = sim->state.displacement[2 * c + i % 2];
        }
        const nmm_tensor H =
            nmm_displacement_gradient(d, sim->model.element_gradient + 6 * (long)e);
        least = nmm_min(least, (1 + H.xx) * (1 + H.yy) - H.xy * H.yx);
    }
    return least;
}

static void test_inside_out_is_never_accepted(void **unused) {
    (void)unused;
    // Far too soft for its weight: the column is crushed.
    const char *const changes[] = {"materials.rock.youngs_modulus=1",
                                   "materials.rock.density=1e5",
                                   "initial_stress.surface=0",
                                   "time.dt=0.01",
                                   "time.dt_min=1e-5",
                                   "covers.size=0.3"};
    nmm_sim *sim = open_scene(SCENE_COLUMN, 6, changes);
    nmm_step_report report = {0};
    double least = 1;
    while (report.end == NMM_END_RUNNING) {
        report = take_steps(sim, 1);
        least = nmm_min(least, least_volume(sim));
    }
    assert_int_equal(report.end, NMM_END_STEP_TOO_SMALL);
    assert_non_null(strstr(report.reason, "an element of block 0"));
    assert_non_null(strstr(report.reason, "turned inside out"));
    assert_true(report.cuts > 0);
    assert_true(least > 0);
    assert_true(least_volume(sim) > 0);
    // The supports gave way too, and the summary says so.
    nmm_summary summary;
    nmm_sim_summary(sim, &summary);
    assert_true(summary.max_support_give > 0.01 * summary.cover_size);
    nmm_sim_destroy(sim);
    sim = open_scene(SCENE_COLUMN, 0, NULL);
    take_steps(sim, 20);
    nmm_sim_summary(sim, &summary);
    assert_true(summary.max_support_give < 1e-4 * summary.cover_size);
    assert_close(summary.cover_size, sim->model.size, 1e-15);
    nmm_sim_destroy(sim);
}

static void test_methods_agree(void **unused) {
    (void)unused;
    const char *const method[] = {"solver.method=pcg", "solver.method=jacobi", "solver.method=sor",
                                  "solver.method=gauss-seidel"};
    double fallen[4];
    for (int k = 0; k < 4; k++) {
        const char *const changes[] = {method[k], "time.end=0.02", "solver.tolerance=1e-10"};
        nmm_sim *sim = open_scene(SCENE_BLOCK_ON_BASE, 3, changes);
        assert_int_equal(take_steps(sim, 100).end, NMM_END_COMPLETED);
        fallen[k] = sim->state.displacement[2 * sim->model.n_cover - 1];
        nmm_sim_destroy(sim);
        assert_true(fallen[0] != 0);
        assert_close(fallen[k], fallen[0], 1e-4);
    }
}

static void test_largest_move(void **unused) {
    (void)unused;
    const char *const changes[] = {"time.max_move=1e-4", "time.dt=0.01", "time.end=0.5"};
    nmm_sim *sim = open_scene(SCENE_FALL, 3, changes);
    nmm_step_report report = {0};
    double last = 0;
    while (report.end == NMM_END_RUNNING) {
        report = take_steps(sim, 1);
        // Half the larger side is 1 m: no step may move further than 1e-4 m.
        const double y = sim->state.displacement[1];
        assert_true(fabs(y - last) <= 1e-4 * (1 + 1e-6));
        last = y;
    }
    assert_int_equal(report.end, NMM_END_COMPLETED);
    assert_close(last, -0.5 * 9.81 * 0.25, 1e-6);
    assert_near(report.time, 0.5, 1e-12);
    nmm_sim_destroy(sim);
}

static void test_floor_of_dt(void **unused) {
    (void)unused;
    const char *const changes[] = {"time.max_move=1e-9", "time.dt=0.01", "time.dt_min=5e-3"};
    nmm_sim *sim = open_scene(SCENE_FALL, 3, changes);
    const nmm_step_report report = take_steps(sim, 3);
    assert_int_equal(report.end, NMM_END_STEP_TOO_SMALL);
    assert_non_null(strstr(report.reason, "moved"));
    nmm_sim_destroy(sim);
}

static void test_initial_stress_is_in_balance(void **unused) {
    (void)unused;
    const char *const changes[] = {"analysis.tolerance=1e-12", "solver.tolerance=1e-13"};
    nmm_sim *sim = open_scene(SCENE_COLUMN, 2, changes);
    take_steps(sim, 10);
    for (int p = 0; p < sim->model.n_point; p++) {
        assert_near(sim->state.position[2 * p], sim->model.point[2 * p], 1e-12);
        assert_near(sim->state.position[2 * p + 1], sim->model.point[2 * p + 1], 1e-12);
    }
    nmm_sim_destroy(sim);
}

static void test_initial_stress_beyond_the_modulus(void **unused) {
    (void)unused;
    const char *const stress[] = {
        "initial_stress={kind: uniform, xx: -0.9e9, yy: 0, xy: 0}",
        "initial_stress={kind: uniform, xx: 0.5e9, yy: 0.5e9, xy: 0.6e9}"};
    for (int k = 0; k < 2; k++) {
        nmm_sim *sim = NULL;
        nmm_sim_def def = nmm_default_sim_def();
        def.path = "test.yaml";
        def.text = SCENE_BLOCK_ON_BASE;
        def.text_length = strlen(def.text);
        def.n_override = 1;
        def.override = &stress[k];
        assert_int_equal(nmm_sim_create(&sim, &def), k == 0 ? NMM_OK : NMM_ERROR_INPUT);
        if (k == 1) assert_non_null(strstr(nmm_sim_error(sim)->message, "youngs_modulus"));
        nmm_sim_destroy(sim);
    }
}

// Springs whose rounding is more than the forces: the end names them.
static void test_springs_too_stiff(void **unused) {
    (void)unused;
    const char *const changes[] = {
        "interfaces.joint={friction_angle: 30, normal_stiffness: 1e21, shear_stiffness: 1e21}",
        "supports=[{segment: [[-2, -1], [4, -1]], fix: xy}]", "materials.rock.youngs_modulus=1e6",
        "time.dt_min=1e-4"};
    nmm_sim *sim = open_scene(SCENE_BLOCK_ON_BASE, 4, changes);
    const nmm_step_report report = take_steps(sim, 1000);
    assert_int_equal(report.end, NMM_END_STEP_TOO_SMALL);
    assert_non_null(strstr(report.reason, "normal_stiffness"));
    nmm_sim_destroy(sim);
}

// Springs of short steps: in a long one, or as stiffer ones, they begin with the force they held.
static void test_springs_keep_their_force(void **unused) {
    (void)unused;
    const char *const changes[] = {"contact.method=augmented"};
    nmm_sim *sim = open_scene(SCENE_BLOCK_ON_BASE, 1, changes);
    take_steps(sim, 1);
    for (int rests = 0; rests < 2; rests++) {
        nmm_contact *c = &sim->state.contact[0], was;
        c->mode = NMM_CONTACT_STICK;
        c->hasty = true;
        c->gap = -1e-7, c->rest = 0, c->carried_normal = 0, c->normal_force = 1e3;
        c->slip = 2e-7, c->carried_shear = 0, c->shear_force = -300;
        c->normal_stiffness = 1e10 * (1 + 1e-12), c->shear_stiffness = 1.5e9;
        was = *c;
        nmm_system_stiffen(
            &sim->system, &sim->model, &sim->state, 10,
            (nmm_carrying){.overlaps = rests == 1 ? NMM_OVERLAPS_AT_REST : NMM_OVERLAPS_GO});
        c = &sim->state.contact[0];
        assert_false(c->hasty);
        const double overlap = c->gap - c->rest;
        if (rests == 1) {
            assert_near(c->slip, was.slip, 0);
            assert_near(overlap, was.gap, 0);
            continue;
        }
        assert_near(c->slip, 0, 0);
        assert_near(c->carried_shear, -300, 0);
        assert_true(c->normal_stiffness >= 1e10 && c->anchor != was.anchor);
        assert_close(c->carried_normal - c->normal_stiffness * overlap, 1e3, 1e-9);
    }
    nmm_sim_destroy(sim);
}

// Augmented contact in steps that are short against a wave's time through a cover: the same answer
// at any penalty, every force carried, and no energy from nowhere.
static void test_short_steps_know_no_penalty(void **unused) {
    (void)unused;
    const char *const penalty[] = {"contact.penalty=1", "contact.penalty=1000"};
    double settled[2] = {0, 0};
    for (int k = 0; k < 2; k++) {
        const char *const changes[] = {"contact.method=augmented", penalty[k], "time.dt=1e-4",
                                       "time.dt_max=1e-4"};
        nmm_sim *sim = open_scene(SCENE_BLOCK_ON_BASE, 4, changes);
        take_steps(sim, 200);
        for (int c = 0; c < sim->model.n_cover; c++)
            settled[k] = nmm_min(settled[k], sim->state.displacement[2 * c + 1]);
        assert_true(sim->summary.pressed > 0);
        assert_int_equal(sim->n_alone, 0);
        assert_true(sim->summary.ledger.gain < 1e-6 * sim->summary.ledger.largest);
        nmm_sim_destroy(sim);
    }
    assert_close(settled[1], settled[0], 1e-4);
}

static void test_steady_loop_allocates_nothing(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_BLOCK_ON_BASE, 0, NULL);
    // By then the solver has tried each of its methods that it ever will.
    take_steps(sim, 350);
    const long calls = sim->context.n_call;
    take_steps(sim, 100);
    assert_int_equal(sim->context.n_call, calls);
    nmm_sim_destroy(sim);
}

static void test_only_what_the_scene_needs(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_FALL, 0, NULL);
    assert_null(sim->search);
    assert_null(sim->system.fixed);
    take_steps(sim, 3);
    assert_int_equal(sim->state.n_contact, 0);
    assert_null(sim->state.contact);
    assert_true(sim->summary.phase_seconds.contact < 1);
    nmm_sim_destroy(sim);
}

static void test_target_that_is_not_there(void **unused) {
    (void)unused;
    if (nmm_solve_target() != NULL && nmm_solve_target_devices() > 0) skip();
    nmm_sim_def def = nmm_default_sim_def();
    def.path = "test.yaml";
    def.text = SCENE_FALL;
    def.text_length = strlen(SCENE_FALL);
    def.device = NMM_DEVICE_TARGET;
    nmm_sim *sim = NULL;
    assert_int_equal(nmm_sim_create(&sim, &def), NMM_ERROR_DEVICE);
    assert_int_equal(nmm_sim_error(sim)->status, NMM_ERROR_DEVICE);
    nmm_sim_destroy(sim);
}

// One way of two has been much slower whenever it was tried: ten steps go the other way, to the
// same bits.
static void take_pace(nmm_sim *sim, int slow, const double *expected) {
    sim->context.n_thread = 2;
    sim->pace = (nmm_pace){.seconds = {1, 1}, .tried = {1, 2}, .tries = 7};
    sim->pace.seconds[slow] = 1e9;
    take_steps(sim, 10);
    assert_true(sim->pace.seconds[slow] == 1e9);
    assert_true(sim->pace.seconds[!slow] < 1);
    assert_int_equal(sim->context.n_thread, 2);
    assert_memory_equal(sim->state.displacement, expected,
                        2 * (size_t)sim->model.n_cover * sizeof *expected);
    nmm_sim_destroy(sim);
}

static void test_pace_of_threads(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_BLOCK_ON_BASE, 0, NULL);
    take_steps(sim, 10);
    for (int slow = 0; slow < 2; slow++)
        take_pace(open_scene(SCENE_BLOCK_ON_BASE, 0, NULL), slow, sim->state.displacement);
    nmm_sim_destroy(sim);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_solver_that_fails_is_never_accepted),
        cmocka_unit_test(test_plain_jacobi_cuts_the_step),
        cmocka_unit_test(test_inside_out_is_never_accepted),
        cmocka_unit_test(test_methods_agree),
        cmocka_unit_test(test_largest_move),
        cmocka_unit_test(test_floor_of_dt),
        cmocka_unit_test(test_initial_stress_is_in_balance),
        cmocka_unit_test(test_initial_stress_beyond_the_modulus),
        cmocka_unit_test(test_springs_keep_their_force),
        cmocka_unit_test(test_springs_too_stiff),
        cmocka_unit_test(test_short_steps_know_no_penalty),
        cmocka_unit_test(test_steady_loop_allocates_nothing),
        cmocka_unit_test(test_only_what_the_scene_needs),
        cmocka_unit_test(test_target_that_is_not_there),
        cmocka_unit_test(test_pace_of_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
