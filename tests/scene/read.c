// SPDX-License-Identifier: MIT
//
// Good scenes: what a key in the file becomes in the scene, defaults, units, overrides, the form of
// messages.

#include "scene.h"
#include "test.h"

#include <locale.h>

#define PI 3.14159265358979323846
#define HEAD                                                                                       \
    "nmm: 1\n"                                                                                     \
    "domain: [{polygon: [[0,0],[0,3],[4,3],[4,0],[0,0]]}]\n"                                       \
    "materials: {rock: {density: 2500, youngs_modulus: 5e9, poissons_ratio: 0.25}}\n"              \
    "time: {dt: 1e-3, end: 1}\n"

static nmm_context context = {.n_thread = 1};
static nmm_scene scene;

static nmm_status parse_with(const char *text, int n_override, const char *const *override) {
    nmm_scene_destroy(&context, &scene);
    nmm_context_clear(&context);
    return nmm_scene_parse(&context, &scene, "test.yaml", text, strlen(text), n_override, override);
}

static nmm_status parse(const char *text) {
    return parse_with(text, 0, NULL);
}

// Parse what must be right.
static void parse_good(const char *text) {
    if (parse(text) == NMM_OK) return;
    fail_msg("%s", scene.report != NULL ? scene.report : context.error.message);
}

static int close_scene(void **unused) {
    (void)unused;
    nmm_scene_destroy(&context, &scene);
    nmm_context_clear(&context);
    return context.n_live == 0 ? 0 : 1;
}

// --- Defaults

static void minimal_scene_has_defaults(void **unused) {
    (void)unused;
    parse_good(HEAD);
    assert_int_equal(scene.n_domain, 1);
    assert_int_equal(scene.domain[0].material, 0);
    assert_int_equal(scene.n_interface, 1);
    assert_near(scene.interface[0].friction, tan(30 * PI / 180), 1e-15);
    assert_near(scene.interface[0].cohesion, 0, 0);
    assert_near(scene.gravity.x, 0, 0);
    assert_near(scene.gravity.y, -9.81, 0);
    assert_int_equal(scene.material[0].plane, NMM_PLANE_STRAIN);
    assert_int_equal(scene.initial.kind, NMM_INITIAL_NONE);
    assert_int_equal(scene.base_motion.n, 0);
    assert_string_equal(scene.title, "");
    const nmm_scene_settings *s = &scene.settings;
    assert_near(s->dt_min, 1e-9, 1e-24);
    assert_near(s->dt_max, 1e-3, 0);
    assert_near(s->max_move, 0.01, 0);
    assert_near(s->output_every, 0.01, 1e-17);
    assert_near(s->penalty, 0, 0);
    assert_near(s->tolerance, 1e-6, 0);
    assert_near(s->solver_tolerance, 1e-8, 0);
    assert_int_equal(s->contact_method, NMM_CONTACT_PENALTY);
    assert_int_equal(s->mass, NMM_MASS_CONSISTENT);
    assert_int_equal(s->method, NMM_METHOD_AUTO);
    assert_int_equal(s->blocks, NMM_SCENE_BLOCKS_AUTO);
    assert_int_equal(s->precision, NMM_SCENE_PRECISION_AUTO);
    assert_int_equal(s->device, NMM_DEVICE_CHOOSE);
    assert_true(s->out_displacement && s->out_velocity && s->out_stress && s->out_contact);
    assert_null(scene.report);
}

static void words_of_the_solver_arrive(void **unused) {
    (void)unused;
    static const struct {
        const char *text;
        int method, blocks, precision;
    } word[] = {
        {"{method: chebyshev, blocks: cluster, precision: mixed}", NMM_METHOD_CHEBYSHEV,
         NMM_SCENE_BLOCKS_CLUSTER, NMM_SCENE_MIXED},
        {"{method: direct, blocks: cover}", NMM_METHOD_DIRECT, NMM_SCENE_BLOCKS_COVER,
         NMM_SCENE_PRECISION_AUTO},
        {"{method: pcg, blocks: body, precision: double}", NMM_METHOD_PCG, NMM_SCENE_BLOCKS_BODY,
         NMM_SCENE_DOUBLE},
    };
    for (size_t k = 0; k < sizeof word / sizeof *word; k++) {
        char text[512];
        snprintf(text, sizeof text, "%ssolver: %s\n", HEAD, word[k].text);
        parse_good(text);
        assert_int_equal(scene.settings.method, word[k].method);
        assert_int_equal(scene.settings.blocks, word[k].blocks);
        assert_int_equal(scene.settings.precision, word[k].precision);
    }
}

static void defaults_are_noted_once(void **unused) {
    (void)unused;
    parse_good(HEAD);
    assert_non_null(strstr(scene.defaults, "time.dt_min = 1e-09: dt / 1e6"));
    assert_non_null(strstr(scene.defaults, "solver.tolerance = 1e-8: "));
    assert_non_null(strstr(scene.defaults, "material = rock: the only material"));
    const char *gravity = strstr(scene.defaults, "gravity = [0, -9.81]: ");
    assert_non_null(gravity);
    assert_null(strstr(gravity + 1, "gravity"));
    // What is given is no default.
    parse_good(HEAD "solver: {tolerance: 1e-8}\ngravity: [0, 0]\n");
    assert_null(strstr(scene.defaults, "solver.tolerance"));
    assert_null(strstr(scene.defaults, "gravity"));
    assert_near(scene.gravity.y, 0, 0);
}

static void only_interface_is_the_default(void **unused) {
    (void)unused;
    parse_good(HEAD "interfaces: {clean: {friction_angle: 45}}\n");
    assert_int_equal(scene.n_interface, 1);
    assert_near(scene.interface[0].friction, 1, 1e-15);
    assert_near(scene.interface[0].residual_friction, 1, 1e-15);
    // The default comes first, the others follow in the order of the file.
    parse_good(
        HEAD "interfaces: {a: {friction_angle: 10}, b: {friction_angle: 20, "
             "residual_friction_angle: 15}, c: {friction_angle: 30}}\n"
             "interface: b\n"
             "joints: [{polyline: [[0,1],[4,1]], interface: c}, {polyline: [[0,2],[4,2]]},"
             "{polyline: [[0,2],[4,1]], interface: a}, {polyline: [[1,2],[4,1]], interface: b}]\n");
    assert_int_equal(scene.n_interface, 3);
    assert_string_equal(scene.interface_name[0], "b");
    assert_string_equal(scene.interface_name[1], "a");
    assert_string_equal(scene.interface_name[2], "c");
    assert_near(scene.interface[0].residual_friction, tan(15 * PI / 180), 1e-15);
    const int expected[] = {2, 0, 1, 0};
    for (int i = 0; i < 4; i++)
        assert_int_equal(scene.joint[i].interface, expected[i]);
    // Several and none chosen: the built-in one, which no name reaches.
    parse_good(HEAD "interfaces: {a: {friction_angle: 10}, b: {friction_angle: 20}}\n");
    assert_int_equal(scene.n_interface, 3);
    assert_near(scene.interface[0].friction, tan(30 * PI / 180), 1e-15);
    assert_string_equal(scene.interface_name[1], "a");
}

// --- Geometry

static void polygons_turn_counter_clockwise(void **unused) {
    (void)unused;
    parse_good(HEAD "holes: [{circle: {center: [2,1], radius: 0.5, segments: 4}}]\n"
                    "regions: [{polygon: [[0,0],[4,0],[4,1]], material: rock}]\n");
    // Clockwise and closed in the file.
    assert_int_equal(scene.domain[0].n, 4);
    assert_int_equal(scene.domain[0].mark.line, 2);
    assert_int_equal(scene.domain[0].mark.column, 10);
    const nmm_vec2 *c = scene.domain[0].corner;
    assert_near(nmm_vec2_cross(nmm_vec2_sub(c[1], c[0]), nmm_vec2_sub(c[2], c[1])), 12, 0);
    assert_int_equal(scene.hole[0].n, 4);
    assert_int_equal(scene.hole[0].material, -1);
    assert_near(scene.hole[0].corner[1].x, 2, 1e-15);
    assert_near(scene.hole[0].corner[1].y, 1.5, 1e-15);
    assert_int_equal(scene.region[0].material, 0);
}

// None longer than a cover, or a part of it for higher orders; 48 at least, unless given.
static void circles_follow_the_mesh(void **unused) {
    (void)unused;
    const struct {
        const char *covers, *segments;
        int n;
    } c[] = {
        {"", "", 48},
        {"covers: {size: 0.1}\n", "", 48},
        {"covers: {size: 0.01}\n", "", 315},
        {"covers: {size: 0.01}\n", ", segments: auto", 315},
        {"covers: {size: 0.01}\n", ", segments: 7", 7},
        {"covers: {size: 0.1, order: 1}\n", "", 126},
        {"covers: {size: 0.1, order: 2}\n", "", 252},
        {"covers: {order: 2}\n", "", 384},
        {"covers: {mesh: block}\n", "", 48},
        {"covers: {size: 1e-6}\n", "", 10000},
    };
    for (size_t k = 0; k < sizeof c / sizeof *c; k++) {
        char text[512];
        snprintf(text, sizeof text, HEAD "holes: [{circle: {center: [2,1], radius: 0.5%s}}]\n%s",
                 c[k].segments, c[k].covers);
        parse_good(text);
        assert_int_equal(scene.hole[0].n, c[k].n);
        char note[64];
        snprintf(note, sizeof note, "circle.segments = %d:", c[k].n);
        const bool chosen = c[k].n != 7;
        assert_true((strstr(scene.defaults, note) != NULL) == chosen);
    }
}

static void blocks_repeat_in_bond(void **unused) {
    (void)unused;
    parse_good(HEAD "blocks:\n"
                    "  - {name: brick, polygon: [[5,0],[6,0],[6,1],[5,1]], velocity: [1,2,3],\n"
                    "     repeat: {count: [3, 4], step: [1, 2], shift: [0.5, 0.25]}}\n"
                    "  - {circle: {center: [9,9], radius: 1}}\n");
    assert_int_equal(scene.n_block, 13);
    for (int j = 0; j < 4; j++) {
        for (int i = 0; i < 3; i++) {
            const nmm_scene_block *block = &scene.block[3 * j + i];
            assert_string_equal(block->name, "brick");
            assert_near(block->area.corner[0].x, 5 + i + (j % 2) * 0.5, 0);
            assert_near(block->area.corner[0].y, 2 * j + (j % 2) * 0.25, 0);
            assert_near(block->velocity[2], 3, 0);
            assert_int_equal(block->area.mark.line, 6);
        }
    }
    assert_string_equal(scene.block[12].name, "block 2");
    assert_int_equal(scene.block[12].area.n, 48);
}

static void places_and_histories_arrive(void **unused) {
    (void)unused;
    parse_good(HEAD "supports:\n"
                    "  - {segment: [[0,0],[4,0]], fix: xy}\n"
                    "  - {box: [[4,3],[3,1]], fix: x, motion: [[0,0,0],[1 min, 2 mm, 0]]}\n"
                    "  - {point: [1,2], fix: y}\n"
                    "  - {block: b, fix: xy}\n"
                    "blocks: [{name: b, polygon: [[5,0],[6,0],[6,1]]}]\n"
                    "loads:\n"
                    "  - {point: [4,3], force: [0, -1 kN], history: [[0,0],[0.1,1]]}\n"
                    "  - {segment: [[0,3],[4,3]], traction: [1 MPa, -2]}\n"
                    "monitors: [{point: [1,1]}, {name: 7, point: [2,1], record: [stress]}]\n"
                    "base_motion: {acceleration: [[0,1,2 m/s2],[1,0,1 g]], unit: g}\n"
                    "initial_stress: {kind: gravity}\n");
    assert_int_equal(scene.n_support, 4);
    assert_int_equal(scene.support[0].kind, NMM_PLACE_SEGMENT);
    assert_true(scene.support[0].fix_x && scene.support[0].fix_y);
    assert_int_equal(scene.support[1].kind, NMM_PLACE_BOX);
    assert_near(scene.support[1].a.x, 3, 0);
    assert_near(scene.support[1].b.y, 3, 0);
    assert_false(scene.support[1].fix_y);
    const nmm_history *motion = &scene.history[scene.support[1].history];
    assert_int_equal(motion->width, 2);
    assert_near(motion->entry[3], 60, 0);
    assert_near(motion->entry[4], 0.002, 0);
    assert_int_equal(scene.support[2].kind, NMM_PLACE_POINT);
    assert_int_equal(scene.support[3].kind, NMM_PLACE_BLOCK);
    assert_string_equal(scene.support[3].block, "b");
    assert_near(scene.load[0].value.y, -1000, 0);
    assert_int_equal(scene.history[scene.load[0].history].width, 1);
    assert_near(scene.load[1].value.x, 1e6, 0);
    assert_int_equal(scene.load[1].history, -1);
    assert_string_equal(scene.monitor[0].name, "monitor 1");
    assert_true(scene.monitor[0].velocity);
    assert_string_equal(scene.monitor[1].name, "7");
    assert_false(scene.monitor[1].velocity);
    // In the unit of the object, but a unit of its own wins.
    assert_near(scene.base_motion.entry[1], 9.80665, 0);
    assert_near(scene.base_motion.entry[2], 2, 0);
    assert_near(scene.base_motion.entry[5], 9.80665, 0);
    assert_near(scene.initial.surface, 3, 0);
    assert_near(scene.initial.k0, 0.5, 0);
}

// --- Overrides

static void overrides_replace_and_add(void **unused) {
    (void)unused;
    const char *const override[] = {"time.end=5",
                                    "materials.rock.youngs_modulus=8 GPa",
                                    "joint_sets[0].dip=35",
                                    "joint_sets.b.spacing=2",
                                    "joint_sets.1.seed=9",
                                    "solver.method=pcg",
                                    "gravity=[0, -1.62]",
                                    "gravity[0]=0.5",
                                    "monitors=[]",
                                    "monitors[0]={name: top, point: [1,3]}",
                                    "title=a: b"};
    const char *text = HEAD "joint_sets:\n"
                            "  - {name: a, dip: 0, spacing: 1}\n"
                            "  - {name: b, dip: 90, spacing: 1}\n";
    // The last one is a map to YAML.
    assert_int_equal(parse_with(text, 11, override), NMM_ERROR_INPUT);
    assert_string_equal(context.error.file, "--set title=a: b");
    assert_int_equal(context.error.line, 1);
    assert_int_equal(context.error.column, 7);
    assert_int_equal(scene.n_error, 1);
    assert_int_equal(parse_with(text, 10, override), NMM_OK);
    assert_near(scene.settings.end, 5, 0);
    assert_near(scene.material[0].youngs_modulus, 8e9, 0);
    assert_int_equal(scene.settings.method, NMM_METHOD_PCG);
    assert_near(scene.gravity.x, 0.5, 0);
    assert_near(scene.gravity.y, -1.62, 0);
    assert_int_equal(scene.n_monitor, 1);
    const nmm_scene_joint *first = &scene.joint[0], *last = &scene.joint[scene.n_joint - 1];
    const nmm_vec2 way = nmm_vec2_sub(first->corner[1], first->corner[0]);
    assert_near(way.y / way.x, tan(35 * PI / 180), 1e-12);
    assert_near(last->corner[0].x, 2, 1e-12);
}

static void override_mistakes_name_the_override(void **unused) {
    (void)unused;
    static const struct {
        const char *override, *words;
        int column;
    } wrong[] = {
        {"time.dt=abc", "dt must be a number", 9},
        {"time.dt", "key.path=value", 1},
        {"=3", "key.path=value", 1},
        {"time.dt=", "no value", 9},
        {"time..dt=1", "parted by dots", 6},
        {"time.=1", "parted by dots", 1},
        {"time[x]=1", "parted by dots", 6},
        {"time[0=1", "parted by dots", 6},
        {"time.dt.x=1", "has no keys", 9},
        {"domain[3].material=rock", "the list has 1", 8},
        {"domain.hill.material=rock", "no entry 'hill'", 8},
        {"tiem.dt=1", "did you mean 'time'", 1},
        {"time.dt=1 MPa", "MPa is a stress", 9},
        {"time.dt=\xff", "UTF-8", 9},
        {"time.dt=[1", "syntax", 11},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        const char *const override[] = {"title=x", wrong[i].override};
        assert_int_equal(parse_with(HEAD, 2, override), NMM_ERROR_INPUT);
        const bool found = strstr(context.error.message, wrong[i].words) != NULL;
        if (!found) print_error("%s: %s\n", wrong[i].override, scene.report);
        assert_true(found);
        assert_memory_equal(context.error.file, "--set ", 6);
        assert_string_equal(context.error.file + 6, wrong[i].override);
        if (context.error.column != wrong[i].column) print_error("%s\n", scene.report);
        assert_int_equal(context.error.column, wrong[i].column);
    }
}

// --- Messages

static void messages_look_like_a_compilers(void **unused) {
    (void)unused;
    assert_int_equal(parse(HEAD "interfaces:\n"
                                "\tclean: {friction_angle: 340}\n"),
                     NMM_ERROR_INPUT);
    assert_string_equal(scene.report,
                        "test.yaml:6:1: error: syntax: a tab cannot indent; use spaces\n"
                        "    \tclean: {friction_angle: 340}\n"
                        "    ^\n");
    assert_int_equal(parse(HEAD "interfaces: {\xc3\xa9t\xc3\xa9: {friction_angle: 340}}\n"),
                     NMM_ERROR_INPUT);
    assert_string_equal(
        scene.report, "test.yaml:5:36: error: friction_angle must be at least 0 and below 90 deg, "
                      "found '340'\n"
                      "    interfaces: {\xc3\xa9t\xc3\xa9: {friction_angle: 340}}\n"
                      "                                       ^\n");
}

static void long_lines_are_shown_in_part(void **unused) {
    (void)unused;
    static char text[6000];
    int n = snprintf(text, sizeof text, "%scovers: {size: 1,", HEAD);
    for (int i = 0; i < 5000; i++)
        text[n++] = ' ';
    snprintf(text + n, sizeof text - (size_t)n, "ordr: 0}\n");
    assert_int_equal(parse(text), NMM_ERROR_INPUT);
    assert_int_equal(context.error.column, 5018);
    assert_true(strlen(scene.report) < 500);
    const char *key = strstr(scene.report, "ordr: 0"), *caret = strrchr(scene.report, '^');
    assert_non_null(key);
    // The caret stands under the key.
    const char *line = strstr(scene.report, "    ..."), *below = strrchr(scene.report, '\n');
    while (below > scene.report && below[-1] != '\n')
        below -= 1;
    assert_int_equal(strstr(line, "ordr") - line, caret - below);
}

static void later_stages_reject_in_the_same_form(void **unused) {
    (void)unused;
    parse_good(HEAD);
    const nmm_mark mark = scene.domain[0].mark;
    assert_int_equal(nmm_scene_reject(&context, &scene, mark, "area %d is bad", 7),
                     NMM_ERROR_INPUT);
    assert_string_equal(scene.report, "test.yaml:2:10: error: area 7 is bad\n"
                                      "    domain: [{polygon: [[0,0],[0,3],[4,3],[4,0],[0,0]]}]\n"
                                      "             ^\n");
    assert_int_equal(context.error.line, 2);
    assert_string_equal(context.error.file, "test.yaml");
    // A second one is added, and the error stays the first.
    assert_int_equal(nmm_scene_reject(&context, &scene, (nmm_mark){0}, "worse"), NMM_ERROR_INPUT);
    assert_non_null(strstr(scene.report, "test.yaml: error: worse\n"));
    assert_string_equal(context.error.message, "area 7 is bad");
    assert_int_equal(scene.n_error, 2);
}

static void many_mistakes_are_counted(void **unused) {
    (void)unused;
    static char text[60000];
    int n = snprintf(text, sizeof text, "%sjoints:\n", HEAD);
    for (int i = 0; i < 1200; i++)
        n += snprintf(text + n, sizeof text - (size_t)n, "  - {polyline: [[0,0],[1,x]]}\n");
    assert_int_equal(parse(text), NMM_ERROR_INPUT);
    assert_int_equal(scene.n_error, 1200);
    assert_int_equal(context.error.line, 6);
    assert_non_null(strstr(scene.report, "test.yaml: and 1150 more\n"));
}

// Numbers are read in the C locale, whatever the program's.
static void locale_plays_no_part(void **unused) {
    (void)unused;
    static const char *const name[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "de_DE"};
    const char *set = NULL;
    for (size_t i = 0; i < sizeof name / sizeof *name && set == NULL; i++)
        set = setlocale(LC_ALL, name[i]);
    if (set == NULL) {
        print_message("no locale with a decimal comma is installed: not tested\n");
        skip();
    }
    const nmm_status status = parse(HEAD);
    setlocale(LC_ALL, "C");
    assert_int_equal(status, NMM_OK);
    assert_near(scene.settings.dt, 1e-3, 0);
    assert_near(scene.material[0].poissons_ratio, 0.25, 0);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(minimal_scene_has_defaults),
        cmocka_unit_test(words_of_the_solver_arrive),
        cmocka_unit_test(defaults_are_noted_once),
        cmocka_unit_test(only_interface_is_the_default),
        cmocka_unit_test(polygons_turn_counter_clockwise),
        cmocka_unit_test(circles_follow_the_mesh),
        cmocka_unit_test(blocks_repeat_in_bond),
        cmocka_unit_test(places_and_histories_arrive),
        cmocka_unit_test(overrides_replace_and_add),
        cmocka_unit_test(override_mistakes_name_the_override),
        cmocka_unit_test(messages_look_like_a_compilers),
        cmocka_unit_test(long_lines_are_shown_in_part),
        cmocka_unit_test(later_stages_reject_in_the_same_form),
        cmocka_unit_test(many_mistakes_are_counted),
        cmocka_unit_test(locale_plays_no_part),
    };
    return cmocka_run_group_tests(test, NULL, close_scene);
}
