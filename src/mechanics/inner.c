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
    double moved[6][LANES], start[3][LANES]; // for means
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

static void take_start(group *g, int lane, const nmm_model *model, const nmm_inner *inner, int e) {
    for (int i = 0; i < 3; i++) {
        const double *moved = inner->moved + 2 * (long)model->element_cover[3 * (long)e + i];
        g->moved[2 * i][lane] = moved[0];
        g->moved[2 * i + 1][lane] = moved[1];
        g->start[i][lane] = inner->start[3 * (long)e + i];
    }
}

// Stress P and the forces on the covers: the stress times gradient and area.
static inline void put_lane(group *g, int l, nmm_tensor P) {
    const double area = g->area[l];
    const double ax = area * g->gradient[0][l], ay = area * g->gradient[1][l];
    const double bx = area * g->gradient[2][l], by = area * g->gradient[3][l];
    const double cx = area * g->gradient[4][l], cy = area * g->gradient[5][l];
    g->piola[0][l] = P.xx, g->piola[1][l] = P.xy;
    g->piola[2][l] = P.yx, g->piola[3][l] = P.yy;
    g->force[0][l] = P.xx * ax + P.xy * ay, g->force[1][l] = P.yx * ax + P.yy * ay;
    g->force[2][l] = P.xx * bx + P.xy * by, g->force[3][l] = P.yx * bx + P.yy * by;
    g->force[4][l] = P.xx * cx + P.xy * cy, g->force[5][l] = P.yx * cx + P.yy * cy;
}

// Both kernels are written without inner loops and branches, or the compiler would go element by
// element.
static inline __attribute__((always_inline)) void fill_ends(group *restrict g) {
    for (int l = 0; l < LANES; l++) {
        const double d[6] = {g->d[0][l], g->d[1][l], g->d[2][l],
                             g->d[3][l], g->d[4][l], g->d[5][l]};
        const double gradient[6] = {g->gradient[0][l], g->gradient[1][l], g->gradient[2][l],
                                    g->gradient[3][l], g->gradient[4][l], g->gradient[5][l]};
        const double initial[3] = {g->initial[0][l], g->initial[1][l], g->initial[2][l]};
        const nmm_elastic elastic = {.lambda = g->lambda[l], .mu = g->mu[l]};
        const nmm_strain strain = nmm_strain_of(d, gradient);
        put_lane(g, l, nmm_piola_of(elastic, &strain, initial));
    }
}

static inline __attribute__((always_inline)) void fill_means(group *restrict g, double share) {
    for (int l = 0; l < LANES; l++) {
        const double d[6] = {g->d[0][l], g->d[1][l], g->d[2][l],
                             g->d[3][l], g->d[4][l], g->d[5][l]};
        const double middle[6] = {d[0] - 0.5 * g->moved[0][l], d[1] - 0.5 * g->moved[1][l],
                                  d[2] - 0.5 * g->moved[2][l], d[3] - 0.5 * g->moved[3][l],
                                  d[4] - 0.5 * g->moved[4][l], d[5] - 0.5 * g->moved[5][l]};
        const double gradient[6] = {g->gradient[0][l], g->gradient[1][l], g->gradient[2][l],
                                    g->gradient[3][l], g->gradient[4][l], g->gradient[5][l]};
        const double initial[3] = {g->initial[0][l], g->initial[1][l], g->initial[2][l]};
        const nmm_elastic elastic = {.lambda = g->lambda[l], .mu = g->mu[l]};
        const nmm_strain end = nmm_strain_of(d, gradient), half = nmm_strain_of(middle, gradient);
        double at_end[3];
        nmm_biot_of(elastic, &end, initial, at_end);
        const double T[3] = {share * at_end[0] + (1 - share) * g->start[0][l],
                             share * at_end[1] + (1 - share) * g->start[1][l],
                             share * at_end[2] + (1 - share) * g->start[2][l]};
        put_lane(g, l, nmm_turned_of(&half, T, T));
    }
}

static inline __attribute__((always_inline)) void fill_lanes(group *g, const nmm_inner *inner) {
    if (inner->start != NULL)
        fill_means(g, inner->share);
    else
        fill_ends(g);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void fill_wide(group *g, const nmm_inner *inner) {
    fill_lanes(g, inner);
}
#endif

// With AVX2 four elements at once, and the same bits.
static void fill_group(group *g, const nmm_inner *inner) {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) {
        fill_wide(g, inner);
        return;
    }
#endif
    fill_lanes(g, inner);
}

// Results of the first n lanes to the elements from `first` on.
static void give_elements(const group *g, const nmm_inner *inner, int first, int n) {
    for (int l = 0; l < n; l++) {
        for (int i = 0; i < 4; i++)
            inner->piola[4 * (long)(first + l) + i] = g->piola[i][l];
        for (int i = 0; i < 6; i++)
            inner->force[6 * (long)(first + l) + i] = g->force[i][l];
    }
}

void nmm_inner_fill(const nmm_model *model, const nmm_state *state, const nmm_elastic *elastic,
                    const nmm_inner *inner, int first, int end) {
    group g;
    for (int begin = first; begin < end; begin += LANES) {
        const int n = nmm_min_int(LANES, end - begin);
        for (int l = 0; l < LANES; l++) {
            const int e = begin + nmm_min_int(l, n - 1);
            take_element(&g, l, model, state, elastic, e);
            if (inner->start != NULL) take_start(&g, l, model, inner, e);
        }
        fill_group(&g, inner);
        give_elements(&g, inner, begin, n);
    }
}
