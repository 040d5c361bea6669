// SPDX-License-Identifier: MIT
//
// Inner forces of many elements: the functions of one element, in groups of LANES elements side by
// side, so that the compiler turns each operation into one on several elements. A group that is not
// full repeats its last element. The numbers are those of one element at a time.

#include "mechanics.h"

enum { LANES = 8 };

// What a group reads and writes, by quantity.
typedef struct group {
    double d[6][LANES], gradient[6][LANES], initial[3][LANES];
    double lambda[LANES], mu[LANES], area[LANES];
    double piola[4][LANES], force[6][LANES];
} group;

static void take_element(group *g, int lane, const nmm_model *model, const nmm_state *state,
                         const nmm_elastic *elastic, int e) {
    const int *cover = model->element_cover + 3 * (long)e;
    const nmm_elastic *of_material = &elastic[model->element_material[e]];
    for (int i = 0; i < 3; i++) {
        const double *d = state->displacement + 2 * (long)cover[i];
        g->d[2 * i][lane] = d[0];
        g->d[2 * i + 1][lane] = d[1];
        g->initial[i][lane] = state->initial_stress[3 * (long)e + i];
    }
    for (int i = 0; i < 6; i++)
        g->gradient[i][lane] = model->element_gradient[6 * (long)e + i];
    g->lambda[lane] = of_material->lambda;
    g->mu[lane] = of_material->mu;
    g->area[lane] = model->element_area[e];
}

// Force of the stress P on a cover whose weight has the gradient (gx, gy), times the area.
static inline nmm_vec2 force_of(const nmm_tensor *P, double gx, double gy) {
    return (nmm_vec2){P->xx * gx + P->xy * gy, P->yx * gx + P->yy * gy};
}

// Written without inner loops and branches, or the compiler would go element by element.
static void fill_group(group *restrict g) {
    for (int l = 0; l < LANES; l++) {
        const double d[6] = {g->d[0][l], g->d[1][l], g->d[2][l],
                             g->d[3][l], g->d[4][l], g->d[5][l]};
        const double gradient[6] = {g->gradient[0][l], g->gradient[1][l], g->gradient[2][l],
                                    g->gradient[3][l], g->gradient[4][l], g->gradient[5][l]};
        const double initial[3] = {g->initial[0][l], g->initial[1][l], g->initial[2][l]};
        const nmm_elastic elastic = {.lambda = g->lambda[l], .mu = g->mu[l]};
        const nmm_strain strain = nmm_strain_of(d, gradient);
        const nmm_tensor P = nmm_piola_of(elastic, &strain, initial);
        const double area = g->area[l];
        const nmm_vec2 a = force_of(&P, area * gradient[0], area * gradient[1]);
        const nmm_vec2 b = force_of(&P, area * gradient[2], area * gradient[3]);
        const nmm_vec2 c = force_of(&P, area * gradient[4], area * gradient[5]);
        g->piola[0][l] = P.xx, g->piola[1][l] = P.xy;
        g->piola[2][l] = P.yx, g->piola[3][l] = P.yy;
        g->force[0][l] = a.x, g->force[1][l] = a.y;
        g->force[2][l] = b.x, g->force[3][l] = b.y;
        g->force[4][l] = c.x, g->force[5][l] = c.y;
    }
}

void nmm_inner_fill(const nmm_model *model, const nmm_state *state, const nmm_elastic *elastic,
                    const nmm_inner *inner, int first, int end) {
    group g;
    for (int begin = first; begin < end; begin += LANES) {
        const int n = nmm_min_int(LANES, end - begin);
        for (int l = 0; l < LANES; l++)
            take_element(&g, l, model, state, elastic, begin + nmm_min_int(l, n - 1));
        fill_group(&g);
        for (int l = 0; l < n; l++) {
            for (int i = 0; i < 4; i++)
                inner->piola[4 * (long)(begin + l) + i] = g.piola[i][l];
            for (int i = 0; i < 6; i++)
                inner->force[6 * (long)(begin + l) + i] = g.force[i][l];
        }
    }
}
