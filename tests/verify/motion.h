// SPDX-License-Identifier: MIT
//
// Gives every support point of an opened simulation its own displacement, from a field: what a
// scene file would need one entry per point for.

#ifndef NMM_VERIFY_MOTION_H
#define NMM_VERIFY_MOTION_H

#include "step.h"

#include "test.h"

/// u(X), X in the coordinates of the scene.
typedef nmm_vec2 (*motion_field)(nmm_vec2 X);

/// Each support point goes to u(X) on a straight line until time `ramp`; 0: at once.
static inline void motion_give(nmm_sim *sim, motion_field field, double ramp) {
    nmm_model *model = &sim->model;
    const size_t n = (size_t)model->n_support;
    nmm_history *history = NULL;
    assert_int_equal(nmm_allocate(&sim->context, &history, n, sizeof *history), NMM_OK);
    for (size_t k = 0; k < n; k++) {
        nmm_support *support = &model->support[k];
        const nmm_vec2 u = field(nmm_vec2_add(support->place, model->origin));
        const double entry[6] = {0, 0, 0, ramp, u.x, u.y};
        history[k] = (nmm_history){.n = ramp > 0 ? 2 : 1, .width = 2};
        assert_int_equal(
            nmm_arena_take(&sim->context, &model->arena, &history[k].entry, 6, sizeof(double)),
            NMM_OK);
        memcpy(history[k].entry, ramp > 0 ? entry : entry + 3, (ramp > 0 ? 6 : 3) * sizeof(double));
        support->history = (int)k;
    }
    // Loads of these scenes are constant: no other history is in use.
    nmm_release(&sim->context, &model->history);
    model->history = history;
    model->n_history = (int)n;
}

/// Holds each support point by itself, by stiffer springs: enough for linear displacements. By
/// default points of a line are held in the mean of groups.
static inline void motion_hold_each(nmm_sim *sim) {
    nmm_model *model = &sim->model;
    model->n_support_group = model->n_support;
    for (int k = 0; k < model->n_support; k++) {
        model->support[k].group = k;
        model->support[k].stiffness *= 1000;
    }
    nmm_raising_close(&sim->context, &sim->raising);
    assert_int_equal(nmm_raising_open(&sim->context, &sim->raising, model), NMM_OK);
}

#endif
