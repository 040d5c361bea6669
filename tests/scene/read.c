// SPDX-License-Identifier: MIT
//
// Good scenes: what a key in the file becomes in the scene, defaults, units, overrides.

#include "scene.h"
#include "test.h"

static const char minimal[] = "nmm: 1\n"
                              "domain: [{polygon: [[0,0],[2,0],[2,1],[0,1]]}]\n"
                              "materials:\n"
                              "  rock: {density: 2500, youngs_modulus: 5e9, poissons_ratio: 0.25}\n"
                              "time: {dt: 1e-3, end: 1}\n";

static void minimal_scene_has_defaults(void **unused) {
    (void)unused;
    nmm_context context = {.n_thread = 1};
    nmm_scene scene = {0};
    assert_int_equal(
        nmm_scene_parse(&context, &scene, "minimal", minimal, sizeof minimal - 1, 0, NULL), NMM_OK);
    assert_int_equal(scene.n_domain, 1);
    assert_int_equal(scene.domain[0].n, 4);
    assert_int_equal(scene.domain[0].material, 0);
    assert_int_equal(scene.n_interface, 1);
    assert_near(scene.interface[0].friction, tan(30 * 3.14159265358979323846 / 180), 1e-15);
    assert_near(scene.gravity.y, -9.81, 0);
    assert_near(scene.settings.dt_min, 1e-9, 1e-24);
    assert_near(scene.settings.output_every, 0.01, 1e-17);
    assert_int_equal(scene.settings.device, NMM_DEVICE_CHOOSE);
    assert_null(scene.report);
    assert_non_null(strstr(scene.defaults, "time.dt_min = 1e-09: "));
    nmm_scene_destroy(&context, &scene);
    assert_int_equal(context.n_live, 0);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(minimal_scene_has_defaults),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
