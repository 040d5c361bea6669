// SPDX-License-Identifier: MIT
//
// The checked scene from the raw one, part by part; the settings, and defaults that depend on other
// values, with a note on each.

#include "build.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static nmm_status note_number(nmm_builder *b, const char *path, double value, const char *why) {
    char text[32];
    snprintf(text, sizeof text, "%.6g", value);
    return nmm_note(b->reader, path, text, why);
}

// --- Settings

// Statics need no times of their own.
static nmm_status require_time(nmm_builder *b) {
    const raw_head *scene = &b->raw->head, *head = &b->raw->time.head;
    if (!raw_given(scene, "time")) {
        return nmm_complain(b->reader, scene->node->mark,
                            "required key 'time' is missing in the scene (time steps)");
    }
    static const char *const key[][2] = {{"dt", "first step"}, {"end", "end of the run"}};
    for (int i = 0; i < 2 && head->node != NULL && head->node->kind == NMM_NODE_MAP; i++) {
        if (raw_given(head, key[i][0])) continue;
        TRY(nmm_complain(b->reader, head->node->mark, "required key '%s' is missing in time (%s)",
                         key[i][0], key[i][1]));
    }
    return NMM_OK;
}

static nmm_status check_time(nmm_builder *b) {
    const raw_time *raw = &b->raw->time;
    const raw_head *head = &raw->head;
    if (b->raw->analysis.kind == 0) TRY(require_time(b));
    if (!raw_good(head, "dt")) return NMM_OK;
    if (raw_good(head, "end") && raw->dt > raw->end)
        TRY(nmm_complain(b->reader, raw_mark(head, "dt"),
                         "dt must not be above end (%g s), found %g s", raw->end, raw->dt));
    if (raw_good(head, "dt_min") && raw->dt_min >= raw->dt)
        TRY(nmm_complain(b->reader, raw_mark(head, "dt_min"),
                         "dt_min must be below dt (%g s), found %g s", raw->dt, raw->dt_min));
    if (raw_good(head, "dt_max") && raw->dt_max < raw->dt)
        TRY(nmm_complain(b->reader, raw_mark(head, "dt_max"),
                         "dt_max must not be below dt (%g s), found %g s", raw->dt, raw->dt_max));
    return NMM_OK;
}

// When all histories have come to their end.
static double end_of_histories(const nmm_scene *scene) {
    double end = 1;
    for (int k = 0; k < scene->n_history; k++) {
        const nmm_history *history = &scene->history[k];
        if (history->n == 0) continue;
        end = nmm_max(end, history->entry[(history->n - 1) * (1 + history->width)]);
    }
    return end;
}

// What is for motion only may stay in a scene that is analysed both ways, but not in silence.
static nmm_status warn_of_motion(nmm_builder *b) {
    nmm_context *context = b->reader->context;
    if (b->raw->analysis.damping != 0)
        TRY(nmm_scene_warn(context, b->scene, raw_mark(&b->raw->analysis.head, "damping"),
                           "damping has no effect with kind: static"));
    const raw_area *block = b->raw->blocks.item;
    for (int i = 0; i < b->raw->blocks.n; i++) {
        const double *v = block[i].velocity;
        if (v[0] == 0 && v[1] == 0 && v[2] == 0) continue;
        TRY(nmm_scene_warn(context, b->scene, raw_mark(&block[i].head, "velocity"),
                           "velocity has no effect with kind: static"));
        return NMM_OK;
    }
    return NMM_OK;
}

// Steps of a static analysis are no times: the first is chosen by the model, and they grow.
static nmm_status build_static(nmm_builder *b) {
    const raw_time *raw = &b->raw->time;
    nmm_scene_settings *s = &b->scene->settings;
    const bool has_end = raw_given(&raw->head, "end");
    s->is_static = true;
    s->dt = raw_given(&raw->head, "dt") ? raw->dt : 0;
    s->end = has_end ? raw->end : end_of_histories(b->scene);
    s->dt_min = raw_given(&raw->head, "dt_min") ? raw->dt_min : 0;
    s->dt_max = raw_given(&raw->head, "dt_max") ? raw->dt_max : 0;
    if (!has_end) {
        TRY(note_number(b, "time.end", s->end, "loads as they are at the end of all histories"));
    }
    s->output_every = raw_given(&b->raw->output.head, "every") ? b->raw->output.every : s->end / 10;
    TRY(warn_of_motion(b));
    if (!b->raw->analysis.scheme) return NMM_OK;
    return nmm_complain(b->reader, raw_mark(&b->raw->analysis.head, "scheme"),
                        "scheme: newmark has no meaning with kind: static");
}

static nmm_status build_time(nmm_builder *b) {
    const raw_time *raw = &b->raw->time;
    const raw_head *head = &raw->head;
    nmm_scene_settings *s = &b->scene->settings;
    TRY(check_time(b));
    s->dt = raw->dt;
    s->end = raw->end;
    s->max_move = raw->max_move;
    if (b->raw->analysis.kind == 1) return build_static(b);
    s->dt_min = raw_given(head, "dt_min") ? raw->dt_min : raw->dt * 1e-6;
    s->dt_max = raw_given(head, "dt_max") ? raw->dt_max : raw->dt;
    if (!raw_good(head, "dt") || !raw_good(head, "end")) return NMM_OK;
    if (!raw_given(head, "dt_min"))
        TRY(note_number(b, "time.dt_min", s->dt_min,
                        "dt / 1e6; a shorter step would gain nothing"));
    if (!raw_given(head, "dt_max"))
        TRY(note_number(b, "time.dt_max", s->dt_max, "dt; a shortened step grows back to it"));
    s->output_every = b->raw->output.every;
    if (raw_given(&b->raw->output.head, "every")) return NMM_OK;
    s->output_every = s->end / 100;
    return note_number(b, "output.every", s->output_every, "end / 100; about a hundred frames");
}

// Linear functions for whole blocks, any order on the lattice.
static nmm_status check_covers(nmm_builder *b) {
    const raw_covers *raw = &b->raw->covers;
    const raw_head *head = &raw->head;
    if (!raw_good(head, "mesh") || !raw_good(head, "order")) return NMM_OK;
    const bool lumped = b->raw->analysis.mass == NMM_MASS_LUMPED;
    if (raw->mesh == NMM_MESH_LATTICE && raw->order > 0 && lumped) {
        return nmm_complain(b->reader, raw_mark(&b->raw->analysis.head, "mass"),
                            "a lumped mass belongs to covers of order 0; with covers.order: %d it "
                            "is consistent",
                            raw->order);
    }
    if (raw->mesh == NMM_MESH_LATTICE) return NMM_OK;
    if (raw->order == 0 || raw->order == 2) {
        TRY(nmm_complain(b->reader, raw_mark(head, "order"),
                         raw->order == 0
                             ? "a cover of order 0 cannot turn; with mesh: block the order is 1"
                             : "with mesh: block the order is 1: uniform strain in each block"));
    }
    if (!raw_given(head, "size") || raw->size <= 0) return NMM_OK;
    return nmm_complain(b->reader, raw_key_mark(head, "size"),
                        "'size' belongs to mesh: lattice; with mesh: block a cover is as large as "
                        "its block: leave size out or say auto");
}

// Members of Newmark's family with gamma = 2 beta, from average acceleration to Shi's.
static nmm_status build_scheme(nmm_builder *b) {
    const raw_analysis *raw = &b->raw->analysis;
    const raw_head *head = &raw->head;
    nmm_scene_settings *s = &b->scene->settings;
    s->newmark = raw->scheme == 1;
    s->beta = 0.5;
    if (!raw_good(head, "scheme")) return NMM_OK;
    static const char *const key[] = {"beta", "gamma"};
    for (int i = 0; i < 2 && !s->newmark; i++) {
        if (!raw_given(head, key[i])) continue;
        TRY(nmm_complain(b->reader, raw_key_mark(head, key[i]),
                         "'%s' belongs to scheme: newmark, but scheme is shi", key[i]));
    }
    if (!s->newmark) return NMM_OK;
    const bool has_beta = raw_given(head, "beta"), has_gamma = raw_given(head, "gamma");
    if ((has_beta && !raw_good(head, "beta")) || (has_gamma && !raw_good(head, "gamma"))) {
        return NMM_OK;
    }
    s->beta = has_beta ? raw->beta : has_gamma ? raw->gamma / 2 : 0.25;
    if (!has_gamma || fabs(raw->gamma - 2 * s->beta) <= 1e-9) return NMM_OK;
    return nmm_complain(b->reader, raw_mark(head, "gamma"),
                        "gamma must be twice beta (%g), found %g", 2 * s->beta, raw->gamma);
}

static void copy_settings(nmm_builder *b) {
    const raw_scene *raw = b->raw;
    nmm_scene_settings *s = &b->scene->settings;
    s->cover_size = raw->covers.size;
    s->size_mark = raw_mark(&raw->covers.head, "size");
    s->mesh = (nmm_mesh)raw->covers.mesh;
    s->order = s->mesh == NMM_MESH_BLOCK ? 1 : nmm_max_int(0, raw->covers.order);
    s->penalty = raw->contact.penalty;
    s->contact_method = (nmm_contact_method)raw->contact.method;
    s->damping = raw->analysis.damping;
    s->mass = (nmm_mass)raw->analysis.mass;
    s->tolerance = raw->analysis.tolerance;
    s->method = (nmm_method)raw->solver.method;
    s->blocks = (nmm_scene_blocks)raw->solver.blocks;
    s->precision = (nmm_scene_precision)raw->solver.precision;
    s->solver_tolerance = raw->solver.tolerance;
    s->stop = (nmm_stop)raw->solver.stop;
    s->jacobi_damping = raw->solver.damping;
    s->sor_factor = raw->solver.factor;
    s->max_iterations = (int)raw->solver.max_iterations;
    s->device = (nmm_device_choice)raw->solver.device;
    s->out_displacement = (raw->output.fields & 1) != 0;
    s->out_velocity = (raw->output.fields & 2) != 0;
    s->out_stress = (raw->output.fields & 4) != 0;
    s->out_contact = (raw->output.fields & 8) != 0;
}

// What a method has no use for may stay, so that methods can be compared, but not in silence.
static nmm_status warn_of_solver(nmm_builder *b) {
    static const struct {
        const char *name;
        bool blocks, narrow, changes; // has a form for: blocks, float32, the test of changes
    } method[] = {
        [NMM_METHOD_AUTO] = {"auto", true, true, false},
        [NMM_METHOD_JACOBI] = {"jacobi", true, true, true},
        [NMM_METHOD_PCG] = {"pcg", true, true, false},
        [NMM_METHOD_SOR] = {"sor", false, false, true},
        [NMM_METHOD_GAUSS_SEIDEL] = {"gauss-seidel", false, false, true},
        [NMM_METHOD_CHEBYSHEV] = {"chebyshev", true, true, true},
        [NMM_METHOD_DIRECT] = {"direct", false, false, false},
    };
    const nmm_scene_settings *s = &b->scene->settings;
    const raw_head *head = &b->raw->solver.head;
    if (s->precision == NMM_SCENE_MIXED && !method[s->method].narrow)
        TRY(nmm_scene_warn(b->reader->context, b->scene, raw_mark(head, "precision"),
                           "precision: mixed has no effect: %s has no single precision form and "
                           "solves in double",
                           method[s->method].name));
    if (s->stop == NMM_STOP_AVERAGE_CHANGE && !method[s->method].changes)
        TRY(nmm_scene_warn(b->reader->context, b->scene, raw_mark(head, "stop"),
                           "stop: average_change has no effect: %s tests the residual; jacobi, "
                           "chebyshev, sor and gauss-seidel can test the change",
                           method[s->method].name));
    if (s->blocks != NMM_SCENE_BLOCKS_AUTO && !method[s->method].blocks)
        TRY(nmm_scene_warn(b->reader->context, b->scene, raw_mark(head, "blocks"),
                           "blocks has no effect: %s inverts none", method[s->method].name));
    return NMM_OK;
}

// --- Initial stress and base motion

// Keys of one kind of initial stress do not go with the other.
static nmm_status check_initial(nmm_builder *b, const raw_head *head, bool gravity) {
    static const char *const key[] = {"surface", "k0", "xx", "yy", "xy"};
    for (int i = 0; i < 5; i++) {
        const bool belongs = gravity ? i < 2 : i >= 2;
        if (belongs || !raw_given(head, key[i])) continue;
        TRY(nmm_complain(b->reader, raw_key_mark(head, key[i]),
                         "'%s' belongs to kind: %s, but kind is %s", key[i],
                         gravity ? "uniform" : "gravity", gravity ? "gravity" : "uniform"));
    }
    return NMM_OK;
}

static nmm_status build_initial(nmm_builder *b) {
    const raw_initial *raw = &b->raw->initial_stress;
    if (!raw_good(&raw->head, "kind")) return NMM_OK;
    const bool gravity = raw->kind == NMM_INITIAL_GRAVITY;
    TRY(check_initial(b, &raw->head, gravity));
    nmm_scene_initial *initial = &b->scene->initial;
    *initial = (nmm_scene_initial){.kind = (nmm_initial_kind)raw->kind,
                                   .xx = raw->xx,
                                   .yy = raw->yy,
                                   .xy = raw->xy,
                                   .surface = raw->surface,
                                   .k0 = raw->k0,
                                   .mark = raw->head.node->mark};
    if (!gravity) return NMM_OK;
    if (!raw_given(&raw->head, "surface")) {
        initial->surface = b->box.high.y;
        TRY(note_number(b, "initial_stress.surface", initial->surface, "highest corner"));
    }
    if (raw_given(&raw->head, "k0")) return NMM_OK;
    initial->k0 = 0.5;
    return note_number(b, "initial_stress.k0", 0.5, "common in shallow rock");
}

static nmm_status build_base_motion(nmm_builder *b) {
    const raw_base *raw = &b->raw->base_motion;
    if (!raw_good(&raw->head, "acceleration")) return NMM_OK;
    TRY(nmm_build_history(b, &raw->acceleration, "acceleration", &b->scene->base_motion));
    if (raw_given(&b->raw->head, "supports") && b->raw->supports.n > 0) return NMM_OK;
    return nmm_scene_warn(b->reader->context, b->scene, raw->head.node->mark,
                          "base_motion without supports: nothing is tied to the ground, so it acts "
                          "as a force on all that is there");
}

// --- Supports

// A block by itself is one that is meant to fall.
static nmm_status warn_of_fall(nmm_builder *b) {
    const nmm_vec2 g = b->scene->gravity;
    const bool held = raw_given(&b->raw->head, "supports") && b->raw->supports.n > 0;
    const bool alone = raw_given(&b->raw->head, "blocks") && b->raw->blocks.n == 1;
    if (held || alone || raw_given(&b->raw->head, "base_motion") || (g.x == 0 && g.y == 0))
        return NMM_OK;
    return nmm_scene_warn(b->reader->context, b->scene, b->raw->head.node->mark,
                          "no supports: nothing is held, and gravity moves all that is there");
}

// --- All

static nmm_status note_filled(nmm_builder *b) {
    char why[80];
    if (b->most_segments > 0)
        TRY(note_number(b, "circle.segments", b->most_segments,
                        "sides no longer than a cover, shorter with covers.order"));
    if (b->n_filled_material > 0 && b->scene->n_material == 1) {
        snprintf(why, sizeof why, "the only material; areas that name none: %d",
                 b->n_filled_material);
        TRY(nmm_note(b->reader, "material", b->scene->material_name[0], why));
    }
    if (b->n_filled_interface == 0) return NMM_OK;
    snprintf(why, sizeof why, "the scene's interface; joints and sets that name none: %d",
             b->n_filled_interface);
    return nmm_note(b->reader, "joints", b->scene->interface_name[0], why);
}

nmm_status nmm_scene_build(nmm_reader *reader, const raw_scene *raw) {
    nmm_builder b = {.reader = reader,
                     .raw = raw,
                     .scene = reader->scene,
                     .domain_box = nmm_box_empty(),
                     .box = nmm_box_empty()};
    if (raw->head.node->kind != NMM_NODE_MAP) return NMM_OK;
    b.scene->title = raw->title != NULL ? raw->title : "";
    b.scene->gravity = raw->gravity;
    TRY(nmm_build_materials(&b));
    TRY(nmm_build_interfaces(&b));
    TRY(nmm_build_domain(&b));
    TRY(nmm_build_joints(&b));
    TRY(nmm_build_blocks(&b));
    TRY(nmm_build_places(&b));
    TRY(build_initial(&b));
    TRY(build_base_motion(&b));
    TRY(nmm_build_warn_materials(&b));
    TRY(warn_of_fall(&b));
    TRY(check_covers(&b));
    TRY(build_scheme(&b));
    copy_settings(&b);
    TRY(warn_of_solver(&b));
    TRY(build_time(&b));
    return note_filled(&b);
}
