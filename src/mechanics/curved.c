// SPDX-License-Identifier: MIT
//
// Elements with covers of order > 0. The displacement is a polynomial of degree order + 1, so
// strain and stress change within the element: the law of section 3.2 is taken at each sample of
// the element and summed up, eq. (3.13). The three linear functions add to one and the others
// vanish at the nodes, so rigid motions are motions of the linear functions alone and small strains
// keep their digits.

#include "mechanics.h"

#include <string.h>

// Displacements of an element's covers, and the functions' gradients at one of its samples.
typedef struct curved_element {
    int m;
    double d[2 * NMM_MOST_LOCAL];        // [m][2]
    double gradient[2 * NMM_MOST_LOCAL]; // [m][2]
} curved_element;

static void take_covers(const nmm_model *model, const double *from, int e, double *d) {
    const int *cover = model->element_cover + model->n_local * (long)e;
    for (int i = 0; i < 2 * model->n_local; i++)
        d[i] = from[2 * (long)cover[i / 2] + i % 2];
}

static curved_element element_of(const nmm_model *model, const nmm_state *state, int e) {
    curved_element element = {.m = model->n_local};
    take_covers(model, state->displacement, e, element.d);
    return element;
}

static nmm_tensor gradient_of(int m, const double *d, const double *g) {
    nmm_tensor H = nmm_displacement_gradient(d, g);
    for (int i = 6; i < 2 * m; i += 2) {
        H.xx += d[i] * g[i];
        H.xy += d[i] * g[i + 1];
        H.yx += d[i + 1] * g[i];
        H.yy += d[i + 1] * g[i + 1];
    }
    return H;
}

// Strain at sample s of element e; leaves the gradients there in `element`.
static nmm_strain strain_at(const nmm_model *model, curved_element *element, int e, int s) {
    nmm_functions_gradient(model, e, model->sample_linear + 3 * (long)s, element->gradient);
    return nmm_strain_at(gradient_of(element->m, element->d, element->gradient));
}

// --- Forces

// Stress of the mean over the step, eq. (4.13), at a sample.
static nmm_tensor mean_piola(const nmm_inner *inner, const curved_element *element,
                             const double *moved, const double at_end[3], const double start[3]) {
    double middle[2 * NMM_MOST_LOCAL], T[3];
    for (int i = 0; i < 2 * element->m; i++)
        middle[i] = element->d[i] - 0.5 * moved[i];
    for (int i = 0; i < 3; i++)
        T[i] = inner->share * at_end[i] + (1 - inner->share) * start[i];
    const nmm_strain half = nmm_strain_at(gradient_of(element->m, middle, element->gradient));
    return nmm_turned_of(&half, T, T);
}

static void fill_element(const nmm_model *model, const nmm_state *state, nmm_elastic elastic,
                         const nmm_inner *inner, int e) {
    curved_element element = element_of(model, state, e);
    double moved[2 * NMM_MOST_LOCAL];
    if (inner->start != NULL) take_covers(model, inner->moved, e, moved);
    const int m = element.m;
    double *force = inner->force + 2 * m * (long)e;
    memset(force, 0, 2 * (size_t)m * sizeof *force);
    for (int s = model->sample_start[e]; s < model->sample_start[e + 1]; s++) {
        const nmm_strain strain = strain_at(model, &element, e, s);
        const double *initial = state->sample_initial + 3 * (long)s;
        nmm_tensor P = nmm_piola_of(elastic, &strain, initial);
        if (inner->start != NULL) {
            double at_end[3];
            nmm_biot_of(elastic, &strain, initial, at_end);
            P = mean_piola(inner, &element, moved, at_end, inner->start + 3 * (long)s);
        }
        const double area = model->sample_area[s];
        for (int i = 0; i < m; i++) {
            const double gx = area * element.gradient[2 * i],
                         gy = area * element.gradient[2 * i + 1];
            force[2 * i] += P.xx * gx + P.xy * gy;
            force[2 * i + 1] += P.yx * gx + P.yy * gy;
        }
    }
}

void nmm_curved_inner_fill(const nmm_model *model, const nmm_state *state,
                           const nmm_elastic *elastic, const nmm_inner *inner, int first, int end) {
    for (int e = first; e < end; e++)
        fill_element(model, state, elastic[model->element_material[e]], inner, e);
}

// --- Stiffness

// The upper half of the blocks at one sample.
static void add_stiffness(const nmm_stiffness *k, const nmm_strain *strain,
                          const curved_element *element, double *K) {
    const int m = element->m;
    double q[NMM_MOST_LOCAL][2];
    for (int i = 0; i < m; i++) {
        const double gx = element->gradient[2 * i], gy = element->gradient[2 * i + 1];
        q[i][0] = strain->c * gx - strain->s * gy;
        q[i][1] = strain->s * gx + strain->c * gy;
    }
    for (int i = 0; i < m; i++) {
        for (int j = i; j < m; j++)
            nmm_stiffness_block(k, q[i], q[j], K + 4 * (long)(m * i + j));
    }
}

static void mirror(int m, double *K) {
    for (int i = 0; i < m; i++) {
        for (int j = 0; j < i; j++) {
            const double *from = K + 4 * (long)(m * j + i);
            const double block[4] = {from[0], from[2], from[1], from[3]};
            memcpy(K + 4 * (long)(m * i + j), block, sizeof block);
        }
    }
}

void nmm_curved_stiffness(const nmm_model *model, const nmm_state *state, nmm_elastic elastic,
                          int e, double share, double *K) {
    curved_element element = element_of(model, state, e);
    memset(K, 0, 4 * (size_t)element.m * (size_t)element.m * sizeof *K);
    for (int s = model->sample_start[e]; s < model->sample_start[e + 1]; s++) {
        const nmm_strain strain = strain_at(model, &element, e, s);
        const double *initial = state->sample_initial + 3 * (long)s;
        const nmm_stiffness k = nmm_stiffness_of(elastic, &strain, 0.5 * (initial[0] + initial[1]),
                                                 share * model->sample_area[s], element.gradient);
        add_stiffness(&k, &strain, &element, K);
    }
    mirror(element.m, K);
}

// --- Questions

void nmm_curved_biot(const nmm_model *model, const nmm_state *state, nmm_elastic elastic, int e,
                     double *stress) {
    curved_element element = element_of(model, state, e);
    for (int s = model->sample_start[e]; s < model->sample_start[e + 1]; s++) {
        const nmm_strain strain = strain_at(model, &element, e, s);
        nmm_biot_of(elastic, &strain, state->sample_initial + 3 * (long)s, stress + 3 * (long)s);
    }
}

double nmm_curved_energy(const nmm_model *model, const nmm_state *state, nmm_elastic elastic,
                         int e) {
    curved_element element = element_of(model, state, e);
    double sum = 0;
    for (int s = model->sample_start[e]; s < model->sample_start[e + 1]; s++) {
        const nmm_strain strain = strain_at(model, &element, e, s);
        const double *initial = state->sample_initial + 3 * (long)s;
        sum += model->sample_area[s] * nmm_strain_energy_of(elastic, &strain, initial);
    }
    return sum;
}

void nmm_curved_mean(const nmm_model *model, const nmm_state *state, nmm_elastic elastic, int e,
                     double stress[3], double rotation[2]) {
    curved_element element = element_of(model, state, e);
    double sum[3] = {0, 0, 0}, c = 0, s = 0, area = 0;
    for (int k = model->sample_start[e]; k < model->sample_start[e + 1]; k++) {
        const nmm_strain strain = strain_at(model, &element, e, k);
        const nmm_tensor P = nmm_piola_of(elastic, &strain, state->sample_initial + 3 * (long)k);
        const double a = model->sample_area[k];
        double here[3];
        nmm_cauchy_of(&strain, P, here);
        for (int i = 0; i < 3; i++)
            sum[i] += a * here[i];
        c += a * strain.c, s += a * strain.s, area += a;
    }
    const double turn = sqrt(c * c + s * s);
    rotation[0] = turn > 0 ? c / turn : 1;
    rotation[1] = turn > 0 ? s / turn : 0;
    for (int i = 0; i < 3; i++)
        stress[i] = sum[i] / area;
}

void nmm_curved_stress_at(const nmm_model *model, const nmm_state *state, nmm_elastic elastic,
                          const nmm_monitor *at, double stress[3]) {
    curved_element element = element_of(model, state, at->element);
    double linear[3];
    nmm_element_linear(model, at->element, at->place, linear);
    nmm_functions_gradient(model, at->element, linear, element.gradient);
    const nmm_strain strain = nmm_strain_at(gradient_of(element.m, element.d, element.gradient));
    nmm_cauchy_of(&strain, nmm_piola_of(elastic, &strain, at->initial), stress);
}

double nmm_curved_least_volume(const nmm_model *model, const nmm_state *state, int e) {
    curved_element element = element_of(model, state, e);
    double least = INFINITY;
    for (int s = model->sample_start[e]; s < model->sample_start[e + 1]; s++) {
        const nmm_tensor H = strain_at(model, &element, e, s).H;
        const double volume = (1 + H.xx) * (1 + H.yy) - H.xy * H.yx;
        // Not a number counts as none left.
        if (!(volume >= least)) least = volume;
    }
    return least;
}
