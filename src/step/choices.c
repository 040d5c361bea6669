// SPDX-License-Identifier: MIT
//
// The text of nmm_sim_choices: each default that was chosen, and each feature of the program that
// this scene needs or does without.

#include "step.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

typedef struct text {
    char *at;
    size_t size, used;
} text;

// Append a line of printf form.
static void say(text *out, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void say(text *out, const char *format, ...) {
    const size_t room = out->size - out->used - 1;
    va_list arguments;
    va_start(arguments, format);
    const int n = vsnprintf(out->at + out->used, room + 1, format, arguments);
    va_end(arguments);
    if (n > 0) out->used += (size_t)n < room ? (size_t)n : room;
}

static void say_feature(text *out, const char *what, bool on, const char *if_on,
                        const char *if_off) {
    say(out, "%s %-16s %s\n", on ? "on " : "off", what, on ? if_on : if_off);
}

// What was left on auto, as numbers.
static void say_numbers(text *out, const nmm_sim *sim) {
    if (sim->model.whole_blocks) {
        say(out,
            "chosen: one cover for each block; lengths are measured by %g m, the side of a square "
            "as large as the median block\n",
            sim->model.size);
    } else {
        say(out, "chosen: covers of %g m\n", sim->model.size);
    }
    say(out, "chosen: no point moves further than %g m in a step\n", sim->allowed);
    say(out, "chosen: solver %s on the %s with %d thread%s\n", sim->summary.method,
        sim->summary.device, sim->context.n_thread, sim->context.n_thread > 1 ? "s" : "");
    if (sim->search != NULL) {
        say(out, "chosen: contact springs of %g times Young's modulus over the cover size\n",
            sim->settings.penalty);
    }
}

static void say_features(text *out, const nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    const bool augmented = sim->settings.contact_method == NMM_CONTACT_AUGMENTED;
    bool strong = false;
    for (int k = 0; k < model->n_interface; k++) {
        strong =
            strong || model->interface[k].cohesion > 0 || model->interface[k].tensile_strength > 0;
    }
    say_feature(out, "contact", sim->search != NULL,
                "boundaries can meet: several blocks, or a crack",
                "one block without a crack: no search, no contact memory");
    say_feature(out, "augmentation", augmented && sim->search != NULL, "contact.method augmented",
                "contact.method penalty, or no contact");
    say_feature(out, "bonds", strong, "an interface has cohesion or tensile strength",
                "no interface has cohesion or tensile strength");
    say_feature(out, "point supports", model->n_support > 0, "springs with carried forces",
                "no point, segment or box is held");
    say_feature(out, "held covers", model->n_hold > 0, "removed from the system exactly",
                "no whole block is held");
    say_feature(out, "loads", model->n_load > 0, "in the scene", "none in the scene");
    say_feature(out, "base motion", model->base_motion.n > 0, "in the scene", "none in the scene");
    say_feature(out, "initial stress", sim->scene.initial.kind != NMM_INITIAL_NONE, "in the scene",
                "none in the scene");
    say_feature(out, "damping", sim->settings.damping > 0, "analysis.damping",
                "analysis.damping is 0");
    say_feature(out, "mean forces", sim->settings.newmark, "analysis.scheme newmark",
                "analysis.scheme shi: nothing of the start of a step is kept");
    say_feature(out, "monitors", model->n_monitor > 0, "read at each step", "none in the scene");
}

nmm_status nmm_sim_describe(nmm_sim *sim) {
    const char *defaults = sim->scene.defaults != NULL ? sim->scene.defaults : "";
    text out = {.size = strlen(defaults) + 2048};
    TRY(nmm_arena_take(&sim->context, &sim->scene.arena, &out.at, out.size, 1));
    say(&out, "%s", defaults);
    say_numbers(&out, sim);
    say_features(&out, sim);
    sim->choices = out.at;
    return NMM_OK;
}

const char *nmm_sim_choices(const nmm_sim *sim) {
    return sim->choices != NULL ? sim->choices : "";
}
