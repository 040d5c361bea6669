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

static inline void motion_give(nmm_sim *sim, motion_field field) {
    nmm_model *model = &sim->model;
    const size_t n = (size_t)model->n_support;
    nmm_history *history = NULL;
    assert_int_equal(nmm_allocate(&sim->context, &history, n, sizeof *history), NMM_OK);
    for (size_t k = 0; k < n; k++) {
        nmm_support *support = &model->support[k];
        const nmm_vec2 u = field(nmm_vec2_add(support->place, model->origin));
        history[k] = (nmm_history){.n = 1, .width = 2};
        assert_int_equal(
            nmm_arena_take(&sim->context, &model->arena, &history[k].entry, 3, sizeof(double)),
            NMM_OK);
        history[k].entry[0] = 0;
        history[k].entry[1] = u.x;
        history[k].entry[2] = u.y;
        support->history = (int)k;
    }
    // Loads of these scenes are constant: no other history is in use.
    nmm_release(&sim->context, &model->history);
    model->history = history;
    model->n_history = (int)n;
}

#endif
