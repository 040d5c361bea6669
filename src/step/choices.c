// SPDX-License-Identifier: MIT
//
// The text of nmm_sim_choices: each default that was chosen, and each feature of the program that
// this scene needs or does without.

#include "step.h"

#include <stdio.h>
#include <string.h>

typedef struct text {
    char *at;
    size_t size, used;
} text;

static void say(text *out, const char *what, bool on, const char *why) {
    const int n = snprintf(out->at + out->used, out->size - out->used, "%s %-16s %s\n",
                           on ? "on " : "off", what, why);
    const size_t room = out->size - out->used - 1;
    if (n > 0) out->used += (size_t)n < room ? (size_t)n : room;
}

nmm_status nmm_sim_describe(nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    const nmm_scene *scene = &sim->scene;
    const size_t length = scene->defaults != NULL ? strlen(scene->defaults) : 0;
    text out = {.size = length + 2048};
    TRY(nmm_arena_take(&sim->context, &sim->scene.arena, &out.at, out.size, 1));
    if (length > 0) memcpy(out.at, scene->defaults, length);
    out.used = length;
    const bool augmented = sim->settings.contact_method == NMM_CONTACT_AUGMENTED;
    bool strong = false;
    for (int k = 0; k < model->n_interface; k++) {
        strong =
            strong || model->interface[k].cohesion > 0 || model->interface[k].tensile_strength > 0;
    }
    say(&out, "contact", sim->search != NULL,
        sim->search != NULL ? "boundaries can meet: several blocks, or a crack"
                            : "one block without a crack: no search, no contact memory");
    say(&out, "augmentation", augmented && sim->search != NULL,
        augmented ? "contact.method augmented" : "contact.method penalty");
    say(&out, "bonds", strong,
        strong ? "an interface has cohesion or tensile strength"
               : "no interface has cohesion or tensile strength");
    say(&out, "point supports", model->n_support > 0,
        model->n_support > 0 ? "springs with carried forces" : "no point, segment or box is held");
    say(&out, "held covers", model->n_hold > 0,
        model->n_hold > 0 ? "removed from the system exactly" : "no whole block is held");
    say(&out, "loads", model->n_load > 0, model->n_load > 0 ? "in the scene" : "none in the scene");
    say(&out, "base motion", model->base_motion.n > 0,
        model->base_motion.n > 0 ? "in the scene" : "none in the scene");
    say(&out, "initial stress", scene->initial.kind != NMM_INITIAL_NONE,
        scene->initial.kind != NMM_INITIAL_NONE ? "in the scene" : "none in the scene");
    say(&out, "damping", sim->settings.damping > 0,
        sim->settings.damping > 0 ? "analysis.damping" : "analysis.damping is 0");
    say(&out, "monitors", model->n_monitor > 0,
        model->n_monitor > 0 ? "read at each step" : "none in the scene");
    sim->choices = out.at;
    return NMM_OK;
}

const char *nmm_sim_choices(const nmm_sim *sim) {
    return sim->choices != NULL ? sim->choices : "";
}
