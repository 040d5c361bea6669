// SPDX-License-Identifier: MIT
//
// How the motion goes on, where the passes of a step begin: each unknown with its mean velocity of
// the last step, and with the change of that as well in blocks whose acceleration was steady, such
// as those that fall. Contacts then have the modes that they will have, where nothing new happens.

#ifndef NMM_MOTION_H
#define NMM_MOTION_H

#include "model.h"

typedef struct nmm_motion {
    double *before;   // [n_cover][2] m/s, mean velocities of the step before the last
    double length;    // [s] of the last step
    bool *steady;     // [n_block] the acceleration of the last step was that of the one before
    double (*sum)[2]; // [n_block] scratch
} nmm_motion;

nmm_status nmm_motion_open(nmm_context *context, nmm_motion *motion, const nmm_model *model);
void nmm_motion_close(nmm_context *context, nmm_motion *motion);

/// Mean velocity that unknown i may have in a step of length h [m/s].
static inline double nmm_motion_goes_on(const nmm_motion *motion, const nmm_model *model,
                                        const nmm_state *state, double h, int i) {
    const double last = state->mean_velocity[i];
    const bool steady = h == motion->length && motion->steady[model->cover_block[i / 2]];
    return steady ? last + (last - motion->before[i]) : last;
}

/// A step of length h is accepted: `moved` [n_cover][2] in it; state->mean_velocity still is that
/// of the step before.
void nmm_motion_take(nmm_motion *motion, const nmm_model *model, const nmm_state *state,
                     const int *group, const double *moved, double h);

#endif
