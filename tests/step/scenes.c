// SPDX-License-Identifier: MIT
//
// The scenes of the step tests.

#include "scenes.h"
#include "test.h"

// A block on one below it, named and held as told.
#define BLOCK_ON(below, support)                                                                   \
    "nmm: 1\n"                                                                                     \
    "blocks:\n"                                                                                    \
    "  - {name: " below ", polygon: [[-2, -1], [4, -1], [4, 0], [-2, 0]]}\n"                       \
    "  - {name: top, polygon: [[0, 0], [1.1, 0], [1.1, 0.9], [0, 0.9]]}\n"                         \
    "materials:\n"                                                                                 \
    "  rock: {density: 2500, youngs_modulus: 1e9, poissons_ratio: 0.25}\n"                         \
    "interfaces:\n"                                                                                \
    "  joint: {friction_angle: 30}\n"                                                              \
    "covers: {size: 0.7}\n"                                                                        \
    "supports:\n"                                                                                  \
    "  - {" support ", fix: xy}\n"                                                                 \
    "time: {dt: 1e-3, end: 1}\n"

const char *const SCENE_BLOCK_ON_BASE = BLOCK_ON("base", "block: base");

const char *const SCENE_BLOCK_ON_BED = BLOCK_ON("bed", "segment: [[-2, -1], [4, -1]]");

const char *const SCENE_FALL =
    "nmm: 1\n"
    "blocks:\n"
    "  - {name: body, polygon: [[0, 0], [2, 0], [2, 1], [0, 1]]}\n"
    "materials:\n"
    "  rock: {density: 2500, youngs_modulus: 1e9, poissons_ratio: 0.25}\n"
    "covers: {size: 0.6}\n"
    "time: {dt: 1e-3, end: 1}\n";

const char *const SCENE_COLUMN =
    "nmm: 1\n"
    "domain:\n"
    "  - {polygon: [[0, 0], [2, 0], [2, 6], [0, 6]]}\n"
    "materials:\n"
    "  rock: {density: 2500, youngs_modulus: 1e9, poissons_ratio: 0.25}\n"
    "covers: {size: 1.1}\n"
    "supports:\n"
    "  - {segment: [[0, 0], [2, 0]], fix: xy}\n"
    "initial_stress: {kind: gravity, surface: 6, k0: 0}\n"
    "time: {dt: 1e-3, end: 1}\n";

nmm_sim *open_scene(const char *text, int n_override, const char *const *override) {
    nmm_sim_def def = nmm_default_sim_def();
    def.path = "test.yaml";
    def.text = text;
    def.text_length = strlen(text);
    def.n_override = n_override;
    def.override = override;
    def.n_thread = 1;
    nmm_sim *sim = NULL;
    const nmm_status status = nmm_sim_create(&sim, &def);
    if (status != NMM_OK) print_error("%s\n", nmm_sim_error(sim)->message);
    assert_int_equal(status, NMM_OK);
    return sim;
}

nmm_step_report take_steps(nmm_sim *sim, int n) {
    nmm_step_report report = {0};
    for (int k = 0; k < n && report.end == NMM_END_RUNNING; k++) {
        const nmm_status status = nmm_sim_step(sim, &report);
        if (status != NMM_OK) print_error("%s\n", nmm_sim_error(sim)->message);
        assert_int_equal(status, NMM_OK);
    }
    return report;
}
