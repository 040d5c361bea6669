// SPDX-License-Identifier: MIT
//
// A scene pays only for what is in it: calls of floors that it does not need are counted (the
// linker puts these functions before the real ones), and bytes by the context.

#include "scenes.h"
#include "test.h"

static int n_contact_call, n_mixing_call;

#define COUNTED(function)                                                                          \
    extern __typeof__(nmm_##function) real_##function __asm__("__real_nmm_" #function);            \
    extern __typeof__(nmm_##function) counted_##function __asm__("__wrap_nmm_" #function)

COUNTED(contact_open);
COUNTED(contact_find);
COUNTED(contact_evaluate);
COUNTED(contact_commit);
COUNTED(mixing_take);

nmm_status counted_contact_open(nmm_context *context, const nmm_model *model,
                                const nmm_contact_options *options, nmm_contact_search **search) {
    n_contact_call += 1;
    return real_contact_open(context, model, options, search);
}

nmm_status counted_contact_find(nmm_context *context, nmm_contact_search *search,
                                const nmm_model *model, nmm_state *state, double reach) {
    n_contact_call += 1;
    return real_contact_find(context, search, model, state, reach);
}

nmm_contact_verdict counted_contact_evaluate(const nmm_contact_search *search,
                                             const nmm_model *model, nmm_state *state,
                                             int n_thread) {
    n_contact_call += 1;
    return real_contact_evaluate(search, model, state, n_thread);
}

void counted_contact_commit(const nmm_contact_search *search, const nmm_model *model,
                            nmm_state *state, nmm_contact_energy *energy) {
    n_contact_call += 1;
    real_contact_commit(search, model, state, energy);
}

bool counted_mixing_take(nmm_mixing *mixing, const double *place, double *change, bool mix,
                         int n_thread) {
    n_mixing_call += 1;
    return real_mixing_take(mixing, place, change, mix, n_thread);
}

static nmm_sim *start(const char *text, bool search_always) {
    nmm_sim_def def = nmm_default_sim_def();
    def.path = "test.yaml";
    def.text = text;
    def.text_length = strlen(text);
    def.n_thread = 1;
    def.search_always = search_always;
    nmm_sim *sim = NULL;
    n_contact_call = n_mixing_call = 0;
    assert_int_equal(nmm_sim_create(&sim, &def), NMM_OK);
    return sim;
}

// --- Contact

static void one_block_never_searches(void **unused) {
    (void)unused;
    const char *const text[] = {SCENE_FALL, SCENE_COLUMN};
    for (int k = 0; k < 2; k++) {
        nmm_sim *sim = start(text[k], false);
        take_steps(sim, 5);
        assert_int_equal(sim->state.step, 5);
        assert_int_equal(n_contact_call + n_mixing_call, 0);
        const void *const none[] = {
            sim->search,       sim->start_contact,     sim->state.contact,
            sim->mixing.place, sim->mixing.places[0],  sim->system.spring,
            sim->system.pull,  sim->system.edge_force, sim->system.contact_force,
        };
        for (size_t i = 0; i < sizeof none / sizeof *none; i++)
            assert_null(none[i]);
        nmm_sim_destroy(sim);
    }
}

static void two_blocks_do(void **unused) {
    (void)unused;
    nmm_sim *sim = start(SCENE_BLOCK_ON_BASE, false);
    take_steps(sim, 5);
    assert_true(n_contact_call >= 1 + 3 * 5);
    assert_non_null(sim->mixing.place);
    assert_non_null(sim->system.contact_force);
    nmm_sim_destroy(sim);
}

// A block that is not convex is searched where sides of it face each other, and only there.
static void sides_that_face_each_other_are_searched(void **unused) {
    (void)unused;
    static const struct {
        const char *shape;
        bool faced;
    } block[] = {
        {"polygon: [[0,0],[2,0],[2,1],[1,1],[1,2],[0,2]]", false},
        {"polygon: [[0,0],[1,0],[1,1],[2,1],[2,2],[-1,2],[-1,1],[0,1]]", false},
        {"polygon: [[0,0],[1,0],[1,4],[0.55,4],[0.55,0.5],[0.45,0.5],[0.45,4],[0,4]]", true},
    };
    for (size_t k = 0; k < sizeof block / sizeof *block; k++) {
        char text[600];
        snprintf(text, sizeof text,
                 "nmm: 1\n"
                 "blocks: [{name: b, %s}]\n"
                 "materials: {m: {density: 2500, youngs_modulus: 1e8, poissons_ratio: 0.2}}\n"
                 "interfaces: {c: {friction_angle: 20}}\ninterface: c\n"
                 "covers: {size: 0.5}\ntime: {dt: 1e-3, end: 1}\n",
                 block[k].shape);
        nmm_sim *sim = start(text, false);
        assert_int_equal(sim->search != NULL, block[k].faced);
        nmm_sim_destroy(sim);
    }
}

// Prongs 0.1 m apart, pressed together by 70 times what bends them that far: they meet halfway.
static void prongs_meet(void **unused) {
    (void)unused;
    nmm_reading left, right;
    nmm_sim *sim =
        start("nmm: 1\n"
              "gravity: [0, 0]\n"
              "blocks:\n"
              "  - {name: fork,"
              " polygon: [[0,0],[1,0],[1,4],[0.55,4],[0.55,0.5],[0.45,0.5],[0.45,4],[0,4]]}\n"
              "materials: {m: {density: 2500, youngs_modulus: 1e8, poissons_ratio: 0.2}}\n"
              "interfaces: {c: {friction_angle: 20}}\n"
              "interface: c\n"
              "covers: {size: 0.2}\n"
              "supports: [{segment: [[0,0],[1,0]], fix: xy}]\n"
              "loads:\n"
              "  - {point: [0,4], force: [2e5,0], history: [[0,0],[0.2,1]]}\n"
              "  - {point: [1,4], force: [-2e5,0], history: [[0,0],[0.2,1]]}\n"
              "analysis: {damping: 10}\n"
              "time: {dt: 1e-3, end: 0.4}\n"
              "monitors:\n"
              "  - {name: left, point: [0.45,4], record: [displacement]}\n"
              "  - {name: right, point: [0.55,4], record: [displacement]}\n",
              false);
    take_steps(sim, 1000);
    assert_near(sim->state.time, 0.4, 1e-12);
    assert_int_equal(nmm_sim_monitor(sim, 0, &left), NMM_OK);
    assert_int_equal(nmm_sim_monitor(sim, 1, &right), NMM_OK);
    assert_near(left.displacement[0], 0.05, 2e-3);
    assert_near(right.displacement[0], -0.05, 2e-3);
    nmm_sim_destroy(sim);
}

// Forced on it changes nothing, and what the check says it takes is what it takes.
static void the_search_left_out_is_of_no_use(void **unused) {
    (void)unused;
    nmm_sim *sim[2];
    nmm_check check;
    for (int on = 0; on < 2; on++) {
        sim[on] = start(SCENE_COLUMN, on);
        take_steps(sim[on], 20);
        assert_int_equal(sim[on]->state.step, 20);
        assert_int_equal(n_contact_call > 0, on);
        assert_int_equal(sim[on]->state.n_contact, 0);
    }
    for (int i = 0; i < 2 * sim[0]->model.n_cover; i++)
        assert_near(sim[1]->state.displacement[i], sim[0]->state.displacement[i], 1e-15);
    const double more = (double)sim[1]->context.live_bytes - (double)sim[0]->context.live_bytes;
    assert_int_equal(nmm_sim_check(sim[0], &check), NMM_OK);
    assert_close(sim[0]->costs.contact_bytes, more, 0.2);
    assert_true(sim[0]->costs.contact_seconds > 0);
    for (int on = 0; on < 2; on++)
        nmm_sim_destroy(sim[on]);
}

// --- Other features

static void order_0_has_no_samples(void **unused) {
    (void)unused;
    const char *const one[] = {"covers.order=1"};
    nmm_check check;
    nmm_sim *plain = open_scene(SCENE_COLUMN, 0, NULL), *curved = open_scene(SCENE_COLUMN, 1, one);
    const void *const none[] = {plain->model.element_gram,      plain->model.sample_area,
                                plain->model.sample_linear,     plain->state.sample_initial,
                                plain->system.curved_stiffness, curved->system.piola,
                                curved->system.stiffness};
    for (size_t i = 0; i < sizeof none / sizeof *none; i++)
        assert_null(none[i]);
    assert_non_null(curved->model.element_gram);
    assert_non_null(curved->system.curved_stiffness);
    assert_int_equal(nmm_sim_check(plain, &check), NMM_OK);
    const double least = check.memory_bytes;
    assert_int_equal(nmm_sim_check(curved, &check), NMM_OK);
    assert_true(curved->costs.curved_bytes > 0);
    assert_true(check.memory_bytes > least + curved->costs.curved_bytes);
    nmm_sim_destroy(plain);
    nmm_sim_destroy(curved);
}

static void means_are_kept_for_newmark_only(void **unused) {
    (void)unused;
    const char *const newmark[] = {"analysis.scheme=newmark"};
    nmm_check check;
    nmm_sim *sim = open_scene(SCENE_COLUMN, 0, NULL), *other = open_scene(SCENE_COLUMN, 1, newmark);
    assert_null(sim->system.start_stress);
    assert_null(sim->system.start_load);
    assert_null(sim->system.start_reaction);
    assert_null(sim->free_body);
    assert_non_null(other->system.start_stress);
    const double more = (double)other->context.live_bytes - (double)sim->context.live_bytes;
    assert_int_equal(nmm_sim_check(sim, &check), NMM_OK);
    assert_close(sim->costs.mean_bytes, more, 0.02);
    nmm_sim_destroy(sim);
    nmm_sim_destroy(other);
}

static void what_is_not_held_has_no_reaction(void **unused) {
    (void)unused;
    nmm_sim *fall = open_scene(SCENE_FALL, 0, NULL),
            *base = open_scene(SCENE_BLOCK_ON_BASE, 0, NULL);
    assert_null(fall->system.fixed);
    assert_null(fall->system.reaction);
    assert_null(fall->system.support_force);
    assert_null(fall->start_support);
    assert_null(fall->model.load);
    assert_null(fall->model.monitor);
    assert_non_null(base->system.fixed);
    nmm_sim_destroy(fall);
    nmm_sim_destroy(base);
}

// Room is made in the first steps; then a step asks for nothing. The solver is a fixed one: auto
// may make a factor at any step.
static void steps_allocate_nothing(void **unused) {
    (void)unused;
    const char *const text[] = {SCENE_FALL, SCENE_COLUMN, SCENE_BLOCK_ON_BASE};
    const char *const fixed[] = {"solver.method=pcg", "solver.blocks=cover"};
    for (int k = 0; k < 3; k++) {
        nmm_sim *sim = open_scene(text[k], 2, fixed);
        take_steps(sim, 20);
        const long calls = sim->context.n_call;
        const size_t bytes = sim->context.live_bytes;
        take_steps(sim, 20);
        assert_int_equal(sim->context.n_call - calls, 0);
        assert_int_equal(sim->context.live_bytes, bytes);
        nmm_sim_destroy(sim);
    }
}

// The list of features names each once, and says what it takes or saves.
static void the_list_tells_bytes(void **unused) {
    (void)unused;
    nmm_check check;
    nmm_sim *sim = open_scene(SCENE_COLUMN, 0, NULL);
    assert_null(strstr(nmm_sim_choices(sim), "saves"));
    assert_int_equal(nmm_sim_check(sim, &check), NMM_OK);
    const char *words = nmm_sim_choices(sim);
    const char *contact = strstr(words, "off contact ");
    assert_non_null(contact);
    assert_null(strstr(contact + 1, "off contact "));
    const char *end = strchr(contact, '\n'), *saves = strstr(contact, "; saves ");
    assert_true(saves != NULL && saves < end);
    double kilobytes = 0;
    assert_int_equal(sscanf(saves, "; saves %lf kB", &kilobytes), 1);
    assert_close(1e3 * kilobytes, sim->costs.contact_bytes, 0.01);
    nmm_sim_destroy(sim);
}

// What order 1 would bring along is counted, not tried.
static void order_1_is_counted(void **unused) {
    (void)unused;
    const char *const one[] = {"covers.order=1"};
    const char *const text[] = {SCENE_COLUMN, SCENE_BLOCK_ON_BASE};
    nmm_check check;
    for (int k = 0; k < 2; k++) {
        nmm_sim *plain = open_scene(text[k], 0, NULL), *curved = open_scene(text[k], 1, one);
        assert_int_equal(nmm_sim_check(plain, &check), NMM_OK);
        assert_int_equal(nmm_sim_check(curved, &check), NMM_OK);
        const int more = 2 * (curved->model.n_cover - plain->model.n_cover);
        assert_int_equal(plain->costs.curved_unknowns, more);
        const double samples = 7 * sizeof(double) * (double)curved->model.n_sample;
        assert_near(plain->costs.curved_bytes, curved->costs.curved_bytes - samples, 0);
        nmm_sim_destroy(plain);
        nmm_sim_destroy(curved);
    }
}

// A feature that is off has its cost, or words that say why there is none.
static void each_feature_has_its_cost(void **unused) {
    (void)unused;
    static const char *const reason[] = {"; saves ", "nothing", "need none", "no memory"};
    const char *const text[] = {SCENE_FALL, SCENE_COLUMN, SCENE_BLOCK_ON_BASE};
    nmm_check check;
    for (int k = 0; k < 3; k++) {
        nmm_sim *sim = open_scene(text[k], 0, NULL);
        assert_int_equal(nmm_sim_check(sim, &check), NMM_OK);
        int n = 0;
        for (const char *at = nmm_sim_choices(sim); at != NULL; n++) {
            at = strstr(at, "\noff ");
            if (at == NULL) break;
            at += 1;
            bool found = false;
            for (size_t i = 0; i < sizeof reason / sizeof *reason; i++) {
                const char *words = strstr(at, reason[i]);
                found = found || (words != NULL && words < strchr(at, '\n'));
            }
            if (!found) fail_msg("%.*s", (int)(strchr(at, '\n') - at), at);
        }
        assert_true(n > 5);
        nmm_sim_destroy(sim);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_block_never_searches),
        cmocka_unit_test(two_blocks_do),
        cmocka_unit_test(sides_that_face_each_other_are_searched),
        cmocka_unit_test(prongs_meet),
        cmocka_unit_test(the_search_left_out_is_of_no_use),
        cmocka_unit_test(order_0_has_no_samples),
        cmocka_unit_test(means_are_kept_for_newmark_only),
        cmocka_unit_test(what_is_not_held_has_no_reaction),
        cmocka_unit_test(steps_allocate_nothing),
        cmocka_unit_test(the_list_tells_bytes),
        cmocka_unit_test(order_1_is_counted),
        cmocka_unit_test(each_feature_has_its_cost),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
