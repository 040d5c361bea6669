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

/// A feature that a scene may need or not.
typedef struct feature {
    const char *name;
    bool on;
    int unknowns;               // where it is off: more of them
    const char *if_on, *if_off; // of what costs nothing, `if_off` says why
    double bytes, seconds;      // what it takes or would take; 0: nothing
    const char *each;           // where it is off: what the bytes are for, NULL: all of it
} feature;

static void say_bytes(text *out, double bytes) {
    if (bytes < 1e3)
        say(out, "%.3g B", bytes);
    else if (bytes < 1e6)
        say(out, "%.3g kB", 1e-3 * bytes);
    else
        say(out, "%.3g MB", 1e-6 * bytes);
}

static void say_feature(text *out, const feature *f, const char *per) {
    say(out, "%s %-16s %s", f->on ? "on " : "off", f->name, f->on ? f->if_on : f->if_off);
    if (f->bytes > 0) {
        say(out, "; %s ", f->on ? "takes" : "saves");
        if (f->unknowns > 0 && !f->on) say(out, "%d unknowns and ", f->unknowns);
        say_bytes(out, f->bytes);
        say(out, "%s%s", per, f->each != NULL && !f->on ? f->each : "");
    }
    if (f->seconds > 0) say(out, " and %.2g ms a step", 1e3 * f->seconds);
    say(out, "\n");
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
    say(out, "chosen: solver %s on the %s with up to %d thread%s%s\n", sim->summary.method,
        sim->summary.device, sim->context.n_thread, sim->context.n_thread > 1 ? "s" : "",
        nmm_step_method(sim) == NMM_SOLVE_AUTO
            ? ": direct, or conjugate gradients with 2x2 blocks, clusters or bodies, in each solve "
              "what promises the least work; nmm run tells what it was"
            : "");
    if (sim->search != NULL) {
        say(out, "chosen: contact springs of %g times Young's modulus over the cover size\n",
            sim->settings.penalty);
    }
}

// What the order of the covers brings along.
static void say_order(text *out, const nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    const nmm_costs *costs = &sim->costs;
    const bool curved = model->order > 0;
    char ties[64];
    snprintf(ties, sizeof ties, "%d slivers are tied to their neighbours", model->n_tie);
    const feature list[] = {
        {"curved elements", curved, costs->curved_unknowns,
         "covers.order above 0: strain varies within elements",
         model->whole_blocks ? "whole blocks have linear functions: there is no more to leave out"
                             : "linear functions, one strain for each element",
         costs->curved_bytes, 0, " of elements against order 1"},
        {"ties", model->n_tie > 0, 0, ties,
         curved ? "no slivers of curved elements"
                : "no curved elements: slivers of linear ones need none",
         costs->tie_bytes, 0, NULL},
    };
    for (size_t k = 0; k < sizeof list / sizeof *list; k++)
        say_feature(out, &list[k], "");
}

static void say_contact(text *out, const nmm_sim *sim) {
    const nmm_costs *costs = &sim->costs;
    const bool contact = sim->search != NULL;
    const bool augmented = contact && sim->settings.contact_method == NMM_CONTACT_AUGMENTED;
    char raised[180] = "contact.method augmented: further rounds of passes, no memory";
    if (augmented && !sim->settings.is_static)
        snprintf(raised, sizeof raised,
                 "contact.method augmented: forces are carried, by further rounds of passes; where "
                 "steps below %.2g s do not settle so, they leave them to the penalty",
                 nmm_system_carrying_step(&sim->system, sim->model.n_cover));
    const feature list[] = {
        {"contact", contact, 0,
         "boundaries can meet: several blocks, a crack, or sides that face each other",
         "one block, no sides face each other: no search, no contact memory", costs->contact_bytes,
         costs->contact_seconds, NULL},
        {"augmentation", augmented, 0, raised,
         contact ? "contact.method penalty: no further rounds of passes; it takes no memory"
                 : "no contact: nothing to leave out",
         0, 0, NULL},
        {"bonds", nmm_contact_may_bond(&sim->model), 0,
         "an interface has cohesion or tensile strength",
         contact ? "no interface has cohesion or tensile strength, which saves nothing: each "
                   "contact has "
                   "room for it"
                 : "no contact: nothing to leave out",
         0, 0, NULL},
    };
    for (size_t k = 0; k < sizeof list / sizeof *list; k++)
        say_feature(out, &list[k], "");
}

static void say_actions(text *out, const nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    const nmm_scene_settings *set = &sim->settings;
    const nmm_costs *costs = &sim->costs;
    const feature list[] = {
        {"point supports", model->n_support > 0, 0, "springs with carried forces",
         "no point, segment or box is held", costs->support_bytes, 0, " for each point held"},
        {"held covers", model->n_hold > 0, 0, "removed from the system exactly",
         "no whole block is held", costs->hold_bytes, 0, NULL},
        {"loads", model->n_load > 0, 0, "in the scene", "none in the scene", costs->load_bytes, 0,
         " for each point loaded"},
        {"base motion", model->base_motion.n > 0, 0, "in the scene",
         "none in the scene: it is added to gravity, which costs nothing", 0, 0, NULL},
        {"initial stress", sim->scene.initial.kind != NMM_INITIAL_NONE, 0, "in the scene",
         "none in the scene, which saves nothing: it is kept as zeros",
         sim->scene.initial.kind != NMM_INITIAL_NONE ? costs->initial_bytes : 0, 0, NULL},
        {"damping", set->damping > 0, 0, "analysis.damping",
         "analysis.damping is 0: a factor on masses, which costs nothing", 0, 0, NULL},
        {"mean forces", set->newmark, 0, "analysis.scheme newmark: the start of a step is kept",
         "analysis.scheme shi: nothing of the start of a step is kept", costs->mean_bytes, 0, NULL},
        {"monitors", model->n_monitor > 0, 0, "read at each step", "none in the scene",
         costs->monitor_bytes, 0, " for each, and its reading at each step"},
    };
    for (size_t k = 0; k < sizeof list / sizeof *list; k++)
        say_feature(out, &list[k], "");
}

// Fields of the run file; bytes before they are compressed.
static void say_fields(text *out, const nmm_sim *sim) {
    const nmm_scene_settings *set = &sim->settings;
    const nmm_costs *costs = &sim->costs;
    const bool contact = sim->search != NULL;
    static const char on[] = "in output.fields: written", off[] = "not in output.fields";
    const feature list[] = {
        {"displacement", set->out_displacement, 0, on, off, costs->displacement_bytes, 0, NULL},
        {"velocity", set->out_velocity, 0, on, off, costs->velocity_bytes, 0, NULL},
        {"stress", set->out_stress, 0, on, off, costs->stress_bytes, 0, NULL},
        {"contacts", set->out_contact && contact, 0, on,
         contact ? off : "no contact: nothing to leave out", costs->contact_rows, 0, NULL},
    };
    for (size_t k = 0; k < sizeof list / sizeof *list; k++)
        say_feature(out, &list[k], " a frame");
}

nmm_status nmm_sim_describe(nmm_sim *sim) {
    const char *defaults = sim->scene.defaults != NULL ? sim->scene.defaults : "";
    text out = {.size = strlen(defaults) + 4096};
    TRY(nmm_arena_take(&sim->context, &sim->scene.arena, &out.at, out.size, 1));
    say(&out, "%s", defaults);
    say_numbers(&out, sim);
    say_order(&out, sim);
    say_contact(&out, sim);
    say_actions(&out, sim);
    say_fields(&out, sim);
    sim->choices = out.at;
    return NMM_OK;
}

const char *nmm_sim_choices(const nmm_sim *sim) {
    return sim->choices != NULL ? sim->choices : "";
}
