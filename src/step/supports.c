// SPDX-License-Identifier: MIT
//
// Supports are raised: when forces balance, carried forces take over what springs hold, group by
// group, until none is off its place on average, eq. (4.7). A round is a linear map of the carried
// forces while contacts keep their modes; groups that can hardly move, or move each other, would
// follow it slowly, so that rounds are mixed as passes are, eq. (4.15).

#include "step.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// Groups that bear next to nothing count as bearing this part of the largest force on blocks that
// may touch. The more once so many steps of statics ended before all stood: a thin block that
// neighbours clamp hardly moves by its own supports, and to put it back exactly would take forces
// of any size.
#define LEAST_FORCE 1e-3
#define LEAST_FORCE_LATE 0.1
enum { LATE = 4, VERY_LATE = 10 };

nmm_status nmm_raising_open(nmm_context *context, nmm_raising *raising, const nmm_model *model) {
    const int n = model->n_support_group;
    if (n == 0) return NMM_OK;
    TRY(nmm_allocate(context, &raising->group, (size_t)n, sizeof *raising->group));
    TRY(nmm_allocate(context, &raising->largest, (size_t)model->n_block, sizeof(double)));
    TRY(nmm_allocate(context, &raising->place, 2 * (size_t)n, sizeof(double)));
    TRY(nmm_allocate(context, &raising->change, 2 * (size_t)n, sizeof(double)));
    for (int s = 0; s < model->n_support; s++) {
        const nmm_support *support = &model->support[s];
        if (support->group < 0) continue;
        raising->group[support->group].block = model->element_block[support->element];
    }
    return nmm_mixing_open(context, &raising->mixing, 2 * n);
}

void nmm_raising_close(nmm_context *context, nmm_raising *raising) {
    nmm_release(context, &raising->group);
    nmm_release(context, &raising->largest);
    nmm_release(context, &raising->place);
    nmm_release(context, &raising->change);
    nmm_mixing_close(context, &raising->mixing);
    *raising = (nmm_raising){0};
}

// --- Do they stand?

static double larger(const double v[2]) {
    return nmm_max(fabs(v[0]), fabs(v[1]));
}

static void add_support(nmm_sim *sim, int s, double end) {
    const nmm_support *support = &sim->model.support[s];
    if (support->group < 0) return;
    nmm_support_group *group = &sim->raising.group[support->group];
    const nmm_vec2 error = nmm_support_error(&sim->model, &sim->state, s, end);
    const nmm_vec2 force = nmm_support_reaction(&sim->model, &sim->state, s, error);
    group->error[0] += support->length * error.x;
    group->error[1] += support->length * error.y;
    group->length += support->length;
    group->stiffness += support->stiffness;
    group->force += nmm_max(fabs(force.x), fabs(force.y));
}

// Mean distance of each group of supports from its place, weighted by length; its stiffness and the
// forces it bears, and the largest of these among blocks that may touch.
static void measure_groups(nmm_sim *sim, double end) {
    const int n = sim->model.n_support_group;
    if (n == 0) return;
    memset(sim->raising.largest, 0, (size_t)sim->model.n_block * sizeof(double));
    for (int g = 0; g < n; g++) {
        nmm_support_group *group = &sim->raising.group[g];
        group->error[0] = group->error[1] = 0;
        group->length = group->stiffness = group->force = 0;
    }
    for (int s = 0; s < sim->model.n_support; s++)
        add_support(sim, s, end);
    for (int g = 0; g < n; g++) {
        nmm_support_group *group = &sim->raising.group[g];
        // Where a line leaves a block for longer than a group there is no point in it.
        if (group->length == 0) continue;
        group->error[0] /= group->length;
        group->error[1] /= group->length;
        double *largest = &sim->raising.largest[sim->balance.group[group->block]];
        *largest = nmm_max(*largest, group->force);
    }
}

// Force that the distances of a group are compared with. In statics no less than makes the share
// what the balance leaves: where no group bears anything springs hold that, one way in one round
// and another in the next.
static double force_of(const nmm_sim *sim, const nmm_support_group *group) {
    const double part = sim->raising.n_late < LATE ? LEAST_FORCE : LEAST_FORCE_LATE;
    const double least = part * sim->raising.largest[sim->balance.group[group->block]];
    const double force = nmm_max(group->force, least);
    if (!sim->settings.is_static) return force;
    const double left = nmm_balance_allowed(&sim->balance, group->block, sim->settings.tolerance);
    return nmm_max(force, left / NMM_SUPPORT_SHARE);
}

// The mean distance, next to the scene and to what the springs would give under the whole force,
// over what it may be.
static double excess_of(const nmm_sim *sim, const nmm_support_group *group) {
    const double error = larger(group->error), height = sim->model.height;
    const double of_place = error / (0.1 * sim->settings.tolerance * height);
    if (error <= 1e-14 * height) return of_place;
    const bool rests = sim->settings.is_static;
    const double share = rests ? NMM_SUPPORT_SHARE : NMM_SUPPORT_SHARE_MOVING;
    const double of_force = group->stiffness * error / (share * force_of(sim, group));
    return nmm_max(of_place, of_force);
}

static bool all_stand(const nmm_sim *sim) {
    for (int g = 0; g < sim->model.n_support_group; g++)
        if (excess_of(sim, &sim->raising.group[g]) > 1) return false;
    return true;
}

bool nmm_supports_stand(nmm_sim *sim, double end) {
    measure_groups(sim, end);
    return all_stand(sim);
}

// The middle of a group as the scene has it.
static nmm_vec2 middle_of(const nmm_model *model, int group) {
    nmm_vec2 sum = {0, 0};
    int n = 0;
    for (int s = 0; s < model->n_support; s++) {
        if (model->support[s].group != group) continue;
        sum = nmm_vec2_add(sum, model->support[s].place);
        n += 1;
    }
    return nmm_vec2_add(model->origin, nmm_vec2_scale(1 / (double)n, sum));
}

void nmm_supports_say(const nmm_sim *sim, char *text, size_t size) {
    const nmm_support_group *group = sim->raising.group;
    int worst = 0;
    for (int g = 1; g < sim->model.n_support_group; g++)
        if (excess_of(sim, &group[g]) > excess_of(sim, &group[worst])) worst = g;
    const nmm_vec2 place = middle_of(&sim->model, worst);
    snprintf(text, size, "the support near (%.6g, %.6g) still gives way, by %.2g m", place.x,
             place.y, larger(group[worst].error));
}

// --- A round

// Is the step long against the time a wave takes through a cover? Only then are the points beside a
// support at rest when it is put back; in a short step that would be a kick of 2 e / h.
static bool is_slow(const nmm_sim *sim, double h) {
    double slowest, fastest;
    nmm_wave_squares(&sim->model, &slowest, &fastest);
    return h * h * slowest > 40 * sim->model.size * sim->model.size;
}

void nmm_supports_begin(nmm_sim *sim) {
    nmm_mixing_reset(&sim->raising.mixing);
    for (int g = 0; g < sim->model.n_support_group; g++) {
        nmm_support_group *group = &sim->raising.group[g];
        group->raised[0] = group->raised[1] = group->weight = 0;
    }
}

// Distances count by what they are of those that the springs of the group would give.
static double weight_of(const nmm_sim *sim, const nmm_support_group *group) {
    const double force = force_of(sim, group);
    return force > 0 && group->stiffness > 0 ? group->stiffness / force : 1;
}

// The distances become those that the groups are to be raised by.
static void mix_round(nmm_sim *sim, bool alone) {
    nmm_raising *raising = &sim->raising;
    for (int g = 0; g < sim->model.n_support_group; g++) {
        nmm_support_group *group = &raising->group[g];
        if (group->weight == 0) group->weight = weight_of(sim, group);
        for (int x = 0; x < 2; x++) {
            raising->place[2 * g + x] = group->weight * group->raised[x];
            raising->change[2 * g + x] = group->weight * group->error[x];
        }
    }
    nmm_mixing_take(&raising->mixing, raising->place, raising->change, alone, 1);
    // What else was raised changes the next distances as well.
    if (!alone) nmm_mixing_reset(&raising->mixing);
    for (int g = 0; g < sim->model.n_support_group; g++) {
        nmm_support_group *group = &raising->group[g];
        for (int x = 0; x < 2; x++) {
            group->error[x] = raising->change[2 * g + x] / group->weight;
            group->raised[x] += group->error[x];
        }
    }
}

// Statics know no kick, but in a short step inertia stands against the way back: where bodies go
// too far as soon as steps are long, one round in each.
static bool may_raise(const nmm_sim *sim, double h) {
    const bool stressed = sim->state.step == 0 && sim->scene.initial.kind != NMM_INITIAL_NONE;
    if (stressed || is_slow(sim, h)) return true;
    return sim->raising.n_late >= VERY_LATE && sim->raising.group[0].weight == 0;
}

bool nmm_supports_raise(nmm_sim *sim, const nmm_step_state *step, bool alone) {
    const nmm_model *model = &sim->model;
    if (model->n_support_group == 0 || !may_raise(sim, step->h)) return false;
    measure_groups(sim, step->end);
    if (all_stand(sim)) return false;
    mix_round(sim, alone);
    for (int s = 0; s < model->n_support; s++) {
        const nmm_support *support = &model->support[s];
        if (support->group < 0) continue;
        const double *way = sim->raising.group[support->group].error;
        sim->state.support_force[2 * s] -= support->stiffness * way[0];
        sim->state.support_force[2 * s + 1] -= support->stiffness * way[1];
    }
    return true;
}
