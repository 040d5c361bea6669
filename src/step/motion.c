// SPDX-License-Identifier: MIT
//
// Steady accelerations, block by block: what a step changed of the mean velocities, and what that
// differs from the change before it. Steps of another length than the last are steady for none.

#include "motion.h"

#include <string.h>

// Square of the difference of two changes over that of the later one, below which they are alike.
#define ALIKE 0.01

nmm_status nmm_motion_open(nmm_context *context, nmm_motion *motion, const nmm_model *model) {
    const size_t n_block = (size_t)model->n_block;
    TRY(nmm_allocate(context, &motion->before, 2 * (size_t)model->n_cover, sizeof(double)));
    TRY(nmm_allocate(context, &motion->steady, n_block, sizeof(bool)));
    return nmm_allocate(context, &motion->sum, n_block, sizeof *motion->sum);
}

void nmm_motion_close(nmm_context *context, nmm_motion *motion) {
    nmm_release(context, &motion->before);
    nmm_release(context, &motion->steady);
    nmm_release(context, &motion->sum);
}

void nmm_motion_take(nmm_motion *motion, const nmm_model *model, const nmm_state *state,
                     const int *group, const double *moved, double h) {
    double(*sum)[2] = motion->sum;
    memset(sum, 0, (size_t)model->n_block * sizeof *sum);
    // Covers of a group follow each other: their sums are kept at hand.
    double all[2] = {0, 0};
    int of = 0;
    for (int c = 0; c < model->n_cover; c++) {
        const int next = group[model->cover_block[c]];
        if (next != of) {
            memcpy(sum[of], all, sizeof all);
            memcpy(all, sum[next], sizeof all);
            of = next;
        }
        for (int i = 2 * c; i < 2 * c + 2; i++) {
            const double last = state->mean_velocity[i];
            const double change = moved[i] / h - last, more = change - (last - motion->before[i]);
            all[0] += change * change;
            all[1] += more * more;
            motion->before[i] = last;
        }
    }
    memcpy(sum[of], all, sizeof all);
    for (int b = 0; b < model->n_block; b++)
        motion->steady[b] = h == motion->length && sum[group[b]][1] <= ALIKE * sum[group[b]][0];
    motion->length = h;
}
