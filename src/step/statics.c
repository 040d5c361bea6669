// SPDX-License-Identifier: MIT
//
// analysis.kind: static. Steps of growing length from rest: what inertia is left in an accepted
// step is the unbalanced force of statics, and it holds the step together as long as there is some.
// It vanishes where there is an equilibrium; where a block is free it does not, and the block
// travels.

#include "step.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// Steps after which there is no equilibrium to be found, and where rounding clouds it; in a row, to
// call a block free. Sides of a cover that nothing travels unless it bends.
enum { MOST_STEPS = 1000, MOST_CLOUDED = 300, FREE_STEPS = 3 };
#define FAR 0.5

// What may be left of the forces of a block that is not free, next to them.
#define BALANCED 1e-3

// Cosine of the angle between parts of a block that bends, not moves as a whole.
#define BENT 0.95

// Inertia forces of the last step, where the next pass keeps its change.
static const double *inertia_of(nmm_sim *sim) {
    nmm_system *system = &sim->system;
    double *inertia = system->change;
    memset(inertia, 0, 2 * (size_t)sim->model.n_cover * sizeof *inertia);
    for (int c = 0; c < sim->model.n_cover; c++) {
        for (int k = system->base_start[c]; k < system->base_start[c + 1]; k++) {
            const double *a = system->acceleration + 2 * (long)system->base_col[k];
            inertia[2 * c] += system->base_mass[k] * a[0];
            inertia[2 * c + 1] += system->base_mass[k] * a[1];
        }
        for (int x = 0; x < 2 && system->fixed != NULL; x++)
            if (system->fixed[c] >> x & 1) inertia[2 * c + x] = 0;
    }
    return inertia;
}

// What is left of the forces of a block, next to them; from the last call of nmm_balance_worst_of.
static double share_of(const nmm_sim *sim, int block) {
    const nmm_balance_sums *sums = &sim->balance.block[block];
    return sums->force > 0 ? sqrt(sums->left / sums->force) : 0;
}

// Of the blocks of whose own forces more than a part does not balance the one whose element moved
// furthest since the start, how far and where to; -1: all balance.
static int furthest_block(const nmm_sim *sim, double part, nmm_vec2 *way) {
    const nmm_model *model = &sim->model;
    int furthest = -1;
    double most = -1;
    for (int e = 0; e < model->n_element; e++) {
        if (share_of(sim, model->element_block[e]) <= part) continue;
        nmm_vec2 d = {0, 0};
        for (int i = 0; i < 3; i++) {
            const int c = model->element_cover[model->n_local * e + i];
            const double w = model->element_weight[3 * e + i];
            d.x += w * sim->state.displacement[2 * c];
            d.y += w * sim->state.displacement[2 * c + 1];
        }
        const double square = nmm_vec2_dot(d, d);
        if (square <= most) continue;
        most = square;
        furthest = model->element_block[e];
        *way = d;
    }
    return furthest;
}

// A point inside a block as the scene has it: the centre of its largest element.
static nmm_vec2 point_inside(const nmm_model *model, int block) {
    nmm_vec2 point = {0, 0};
    double largest = -1;
    for (int e = 0; e < model->n_element; e++) {
        if (model->element_block[e] != block || model->element_area[e] <= largest) continue;
        largest = model->element_area[e];
        point.x = model->element_centre[2 * (long)e] + model->origin.x;
        point.y = model->element_centre[2 * (long)e + 1] + model->origin.y;
    }
    return point;
}

// Blocks cut by joints have no name: a place tells which one it is.
static void name_block(const nmm_model *model, int block, char *text, size_t size) {
    const char *name = model->block_name[block];
    const nmm_vec2 point = point_inside(model, block);
    if (name != NULL)
        snprintf(text, size, "block %d '%.60s'", block, name);
    else
        snprintf(text, size, "block %d, which has the point (%.6g, %.6g),", block, point.x,
                 point.y);
}

// By how much parts of a block have turned against its first element at most: cosine.
static double least_alignment(const nmm_sim *sim, int block) {
    const double *first = NULL;
    double least = 1;
    for (int e = 0; e < sim->model.n_element; e++) {
        if (sim->model.element_block[e] != block) continue;
        const double *rotation = sim->state.rotation + 2 * (long)e;
        if (first == NULL) first = rotation;
        least = nmm_min(least, first[0] * rotation[0] + first[1] * rotation[1]);
    }
    return least;
}

// What is free moves as a whole; what is held and goes far has buckled.
static void say_free(nmm_sim *sim, int block, nmm_vec2 way, double share) {
    const double far = sqrt(nmm_vec2_dot(way, way)), aligned = least_alignment(sim, block);
    char name[100];
    name_block(&sim->model, block, name, sizeof name);
    if (aligned < BENT) {
        snprintf(
            sim->report.reason, sizeof sim->report.reason,
            "%s buckles: it went %.3g m along (%.2f, %.2f), parts of it turned by %.0f degrees "
            "against each other, and no stable equilibrium is near",
            name, far, way.x / far, way.y / far, acos(nmm_max(-1, aligned)) * (180 / M_PI));
        return;
    }
    snprintf(sim->report.reason, sizeof sim->report.reason,
             "%s is free to move: it went %.3g m along (%.2f, %.2f) and forces of %.2g "
             "times those that act are still not balanced",
             name, far, way.x / far, way.y / far, share);
}

static void end_with(nmm_sim *sim, nmm_end end) {
    sim->report.end = sim->summary.end = end;
    if (end == NMM_END_COMPLETED) return;
    snprintf(sim->summary.reason, sizeof sim->summary.reason, "%s", sim->report.reason);
}

// Part of the work of the loads in the last step that bodies, contacts and supports stored. On the
// way to an equilibrium without friction it rises from nothing to the whole, in proportion to the
// way; what moves freely stores nothing.
static double stored_part(nmm_sim *sim) {
    const nmm_energy *now = &sim->energy, *before = &sim->judged;
    const double stored = now->strain + now->contact + now->support -
                          (before->strain + before->contact + before->support);
    const double external = now->external - before->external;
    sim->judged = *now;
    return external > 0 ? stored / external : 0;
}

// Far from where it began, and nothing that gives way resists so that it would come to rest within
// the scene: a beam that bends goes far as well.
static bool is_free(const nmm_sim *sim, nmm_vec2 way, double stored) {
    const double far = sqrt(nmm_vec2_dot(way, way));
    return far > FAR * sim->model.size && stored * 10 * sim->model.height < far;
}

// Stiffest closed contact [N/m].
static double stiffest_contact(const nmm_sim *sim) {
    double stiffest = 0;
    for (int k = 0; k < sim->state.n_contact; k++) {
        const nmm_contact *contact = &sim->state.contact[k];
        if (contact->mode != NMM_CONTACT_OPEN)
            stiffest = nmm_max(stiffest, contact->normal_stiffness);
    }
    return stiffest;
}

// Is the rounding of displacements, in the springs of contacts, what a block is out of balance by;
// or, where all balance, so much that this is not certain?
static bool clouds_balance(const nmm_sim *sim) {
    const double tolerance = sim->settings.tolerance;
    bool balances = true;
    for (int b = 0; b < sim->balance.n_block; b++) {
        if (share_of(sim, b) <= tolerance) continue;
        balances = false;
        if (nmm_balance_clouded_in(&sim->balance, b, tolerance, NMM_GAP_ROUNDING)) return true;
    }
    return balances && nmm_balance_clouded(&sim->balance, NMM_CLOUDED, 1);
}

void nmm_say_clouded(const nmm_sim *sim, char *text, size_t size) {
    text[0] = 0;
    if (!clouds_balance(sim)) return;
    const double stiffest = stiffest_contact(sim);
    if (stiffest == 0) return;
    snprintf(text, size,
             ": contact springs of %.2g N/m make more of the rounding of places than "
             "analysis.tolerance allows; lower contact.penalty or normal_stiffness",
             stiffest);
}

// Who is not in balance, and where it went: slowly driven, or it would have been called free. What
// is rounding leads nowhere.
static void say_unbalanced(const nmm_sim *sim, double share, bool clouded, char *text,
                           size_t size) {
    nmm_vec2 way = {0, 0};
    const int block = furthest_block(sim, sim->settings.tolerance, &way);
    const double far = sqrt(nmm_vec2_dot(way, way));
    if (clouded || block < 0 || far == 0) {
        snprintf(text, size, "forces of %.2g times those that act are still not balanced", share);
        return;
    }
    char name[100];
    name_block(&sim->model, block, name, sizeof name);
    snprintf(text, size,
             "%s went %.3g m along (%.2f, %.2f) and forces of %.2g times those that act are still "
             "not balanced",
             name, far, way.x / far, way.y / far, share_of(sim, block));
}

static void say_unsettled(nmm_sim *sim, double share, bool stands) {
    char what[240], why[148] = "";
    if (sim->system.cover_give == NULL) nmm_say_clouded(sim, why, sizeof why);
    if (sim->overlaps)
        snprintf(what, sizeof what, "%.239s", sim->report.reason);
    else if (stands)
        say_unbalanced(sim, share, why[0] != 0, what, sizeof what);
    else
        nmm_supports_say(sim, what, sizeof what);
    if (why[0] != 0)
        snprintf(sim->report.reason, sizeof sim->report.reason, "after %ld steps %.74s%s",
                 sim->state.step, what, why);
    else
        snprintf(sim->report.reason, sizeof sim->report.reason, "after %ld steps %.220s",
                 sim->state.step, what);
}

void nmm_static_judge(nmm_sim *sim, double h) {
    const double *inertia = inertia_of(sim);
    const double excess = nmm_balance_worst_of(&sim->balance, &sim->system, &sim->model, inertia,
                                               sim->settings.tolerance);
    // Next to the forces that act on the block.
    const double share = nmm_balance_worst_of(&sim->balance, &sim->system, &sim->model, inertia, 1);
    // Where nothing moves any more, what is left of inertia is rounding.
    const bool at_rest = h >= sim->settings.dt_max &&
                         sim->report.move * sim->allowed_now <= 1e-13 * sim->model.height;
    // Supports that still give way, and contacts, are raised further in the next step.
    const bool stands = nmm_supports_stand(sim, sim->settings.end);
    // Augmented contact chooses its springs by the same measure.
    const bool chosen = sim->system.cover_give != NULL;
    const bool certain = chosen || !nmm_balance_clouded(&sim->balance, NMM_CLOUDED, 1);
    const bool settled = stands && !sim->overlaps && certain;
    const double stored = stored_part(sim);
    sim->raising.n_late += !stands;
    if ((excess <= 1 || at_rest) && settled) {
        sim->state.time = sim->report.time = sim->settings.end;
        end_with(sim, NMM_END_COMPLETED);
        return;
    }
    nmm_vec2 way = {0, 0};
    const int block = furthest_block(sim, BALANCED, &way);
    const bool clouded = !chosen && clouds_balance(sim);
    sim->n_free = block >= 0 && is_free(sim, way, stored) ? sim->n_free + 1 : 0;
    if (sim->n_free >= FREE_STEPS) {
        say_free(sim, block, way, share_of(sim, block));
        end_with(sim, NMM_END_NO_EQUILIBRIUM);
    } else if (sim->state.step >= (clouded ? MOST_CLOUDED : MOST_STEPS)) {
        say_unsettled(sim, share, stands);
        end_with(sim, NMM_END_NO_EQUILIBRIUM);
    }
}
