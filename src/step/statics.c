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

// Steps after which there is no equilibrium to be found; sides of a cover that nothing travels.
enum { MOST_STEPS = 1000 };
#define FAR 0.5

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

// The block whose element moved furthest since the start, how far and where to.
static int furthest_block(const nmm_sim *sim, nmm_vec2 *way) {
    const nmm_model *model = &sim->model;
    int furthest = 0;
    double most = -1;
    for (int e = 0; e < model->n_element; e++) {
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

static void say_free(nmm_sim *sim, int block, nmm_vec2 way, double share) {
    const char *name = sim->model.block_name[block];
    const double far = sqrt(nmm_vec2_dot(way, way));
    snprintf(
        sim->report.reason, sizeof sim->report.reason,
        "block %d%s%.60s%s is free to move: it went %.3g m along (%.2f, %.2f) and forces of %.2g "
        "times those that act are still not balanced",
        block, name != NULL ? " '" : "", name != NULL ? name : "", name != NULL ? "'" : "", far,
        way.x / far, way.y / far, share);
}

static void end_with(nmm_sim *sim, nmm_end end) {
    sim->report.end = sim->summary.end = end;
    if (end == NMM_END_COMPLETED) return;
    snprintf(sim->summary.reason, sizeof sim->summary.reason, "%s", sim->report.reason);
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
    // Supports that still give way are raised further in the next step.
    const bool stands = nmm_supports_stand(sim, sim->settings.end);
    sim->raising.n_late += !stands;
    if ((excess <= 1 || at_rest) && stands) {
        sim->state.time = sim->report.time = sim->settings.end;
        end_with(sim, NMM_END_COMPLETED);
        return;
    }
    nmm_vec2 way = {0, 0};
    const int block = furthest_block(sim, &way);
    if (nmm_vec2_dot(way, way) > FAR * FAR * sim->model.size * sim->model.size && share > 1e-3) {
        say_free(sim, block, way, share);
        end_with(sim, NMM_END_NO_EQUILIBRIUM);
    } else if (sim->state.step >= MOST_STEPS) {
        if (!stands)
            snprintf(sim->report.reason, sizeof sim->report.reason,
                     "after %ld steps supports still give way", sim->state.step);
        else
            snprintf(sim->report.reason, sizeof sim->report.reason,
                     "after %ld steps forces of %.2g times those that act are still not balanced",
                     sim->state.step, share);
        end_with(sim, NMM_END_NO_EQUILIBRIUM);
    }
}
