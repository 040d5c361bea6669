// SPDX-License-Identifier: MIT
//
// The three linear functions of a block that is one cover (covers.mesh: block), eq. (2.13):
//
//   w_i(x) = 1/3 + g_i . (x - centre),   g_i = sqrt(2 A / 9) J^(-1/2) e_i,   e_i at 120 degrees
//
// A is the area of the block, J the tensor of its second moments about the centroid. They add to
// one, and over the block the integral of w_i w_j is A / 3 for i = j and zero otherwise: the mass
// matrix of the block is diagonal, whatever its shape. All blocks of one shape have the same.

#include "cut.h"

#include <math.h>

// Share of the moments that is added to both axes: the functions of a sliver stay finite.
#define THIN 1e-14

// Area, centroid and moments of a block, summed over its elements.
typedef struct block_sums {
    double area, x, y, xx, xy, yy;
} block_sums;

static void sum_areas(const nmm_model *model, block_sums *sums) {
    for (int e = 0; e < model->n_element; e++) {
        block_sums *s = &sums[model->element_block[e]];
        s->area += model->element_area[e];
        s->x += model->element_area[e] * model->element_centre[2 * e];
        s->y += model->element_area[e] * model->element_centre[2 * e + 1];
    }
    for (int b = 0; b < model->n_block; b++) {
        sums[b].x /= sums[b].area;
        sums[b].y /= sums[b].area;
    }
}

static void sum_moments(const nmm_model *model, block_sums *sums) {
    for (int e = 0; e < model->n_element; e++) {
        block_sums *s = &sums[model->element_block[e]];
        const double area = model->element_area[e], *moment = model->element_moment + 3 * (long)e;
        const double x = model->element_centre[2 * e] - s->x;
        const double y = model->element_centre[2 * e + 1] - s->y;
        s->xx += moment[0] + area * x * x;
        s->xy += moment[1] + area * x * y;
        s->yy += moment[2] + area * y * y;
    }
}

// With J^(1/2) = (J + sqrt(det J) I) / sqrt(tr J + 2 sqrt(det J)), whose inverse is taken of what
// it rounded to: then nodes and gradients belong together also where det J has lost its digits.
static nmm_frame frame_of(const block_sums *s) {
    static const double direction[3][2] = {
        {0.86602540378443865, -0.5}, {0, 1}, {-0.86602540378443865, -0.5}};
    // Where the integrals of a sliver drowned in rounding: a square of the same area.
    const bool lost = !(s->xx + s->yy > 0);
    const double least = lost ? s->area * s->area / 12 : THIN * (s->xx + s->yy);
    const double xx = s->xx + least, yy = s->yy + least;
    const double xy = lost ? 0 : s->xy;
    const double root = sqrt(nmm_max(xx * yy - xy * xy, least * least));
    const double scale = 1 / sqrt(xx + yy + 2 * root);
    const double a = (xx + root) * scale, b = xy * scale, d = (yy + root) * scale;
    const double far = sqrt(2 / s->area), steep = sqrt(2 * s->area) / (3 * (a * d - b * b));
    nmm_frame frame = {.centre = {s->x, s->y}};
    for (int i = 0; i < 3; i++) {
        const double *e = direction[i];
        frame.node[i].x = s->x + far * (a * e[0] + b * e[1]);
        frame.node[i].y = s->y + far * (b * e[0] + d * e[1]);
        frame.gradient[2 * i] = steep * (d * e[0] - b * e[1]);
        frame.gradient[2 * i + 1] = steep * (a * e[1] - b * e[0]);
    }
    // They add to zero in every digit.
    for (int k = 0; k < 2; k++)
        frame.gradient[4 + k] = -(frame.gradient[k] + frame.gradient[2 + k]);
    return frame;
}

nmm_status nmm_frames_build(nmm_context *context, nmm_arena *arena, const nmm_model *model,
                            nmm_frame **frame) {
    const size_t n = (size_t)model->n_block;
    block_sums *sums = NULL;
    TRY(nmm_arena_take(context, arena, frame, n, sizeof **frame));
    TRY(nmm_arena_take(context, arena, &sums, n, sizeof *sums));
    sum_areas(model, sums);
    sum_moments(model, sums);
    for (size_t b = 0; b < n; b++)
        (*frame)[b] = frame_of(&sums[b]);
    return NMM_OK;
}

void nmm_frame_weights(const nmm_frame *frame, nmm_vec2 place, double weight[3]) {
    const double x = place.x - frame->centre.x, y = place.y - frame->centre.y;
    for (int i = 0; i < 2; i++)
        weight[i] = 1.0 / 3 + frame->gradient[2 * i] * x + frame->gradient[2 * i + 1] * y;
    weight[2] = 1 - weight[0] - weight[1];
}
