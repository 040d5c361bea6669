// SPDX-License-Identifier: MIT
//
// Element matrices and the material law: pure functions on small values, section 3 of
// docs/theory/3-mechanics.md.
//
// The element is hyperelastic: W(F) = lambda/2 (tr e)^2 + mu e:e + s0:e with the Biot strain
// e = U - I, F = R U. In two dimensions R and U follow from sums and one root, nothing is
// incremental, and rigid turns of any size give zero strain. Forces are the exact derivative of W.

#ifndef NMM_MECHANICS_H
#define NMM_MECHANICS_H

#include "model.h"

#include <math.h>
#include <string.h>

/// Lame constants of the plane state [Pa]; plane stress has its own lambda.
typedef struct nmm_elastic {
    double lambda, mu;
} nmm_elastic;
nmm_elastic nmm_elastic_of(const nmm_material *material);

/// A 2x2 tensor by components.
typedef struct nmm_tensor {
    double xx, xy, yx, yy;
} nmm_tensor;

/// Polar decomposition of F, eq. (3.3) to (3.6).
typedef struct nmm_strain {
    nmm_tensor H;         // F - I
    double c, s;          // cosine, sine of the rotation R
    double stretch;       // tr U
    double exx, eyy, exy; // Biot strain U - I in the turned frame, exy tensor component
} nmm_strain;

/// Displacement gradient sum_i d_i (x) grad w_i; displacements d[3][2] [m] of the element's covers,
/// gradient[3][2] [1/m].
static inline nmm_tensor nmm_displacement_gradient(const double d[6], const double gradient[6]) {
    // The gradients add to zero: differences keep the digits of small strains.
    const double ax = d[2] - d[0], ay = d[3] - d[1];
    const double bx = d[4] - d[0], by = d[5] - d[1];
    const double *g = gradient;
    return (nmm_tensor){
        .xx = ax * g[2] + bx * g[4],
        .xy = ax * g[3] + bx * g[5],
        .yx = ay * g[2] + by * g[4],
        .yy = ay * g[3] + by * g[5],
    };
}

/// Strain at a displacement gradient. Digits of small strains survive large turns.
static inline nmm_strain nmm_strain_at(nmm_tensor H) {
    const double sum = 2 + H.xx + H.yy, turn = H.yx - H.xy;
    const double stretch = sqrt(sum * sum + turn * turn);
    const double c = sum / stretch, s = turn / stretch;
    // c - 1 as (|c| - 1) + (c - |c|), the first without cancellation, the second 0 but for turns
    // beyond 90 degrees; no branch, so that several elements go side by side.
    const double less = -s * turn / (stretch + fabs(sum)) + (c - fabs(c));
    return (nmm_strain){
        .H = H,
        .c = c,
        .s = s,
        .stretch = stretch,
        .exx = less + c * H.xx + s * H.yx,
        .eyy = less + c * H.yy - s * H.xy,
        .exy = 0.5 * (c * (H.xy + H.yx) + s * (H.yy - H.xx)),
    };
}

/// Strain of an element. Digits of small strains survive large displacements and turns.
static inline nmm_strain nmm_strain_of(const double d[6], const double gradient[6]) {
    return nmm_strain_at(nmm_displacement_gradient(d, gradient));
}

/// Biot stress D e + s0 in the turned frame [Pa]: stress[3] = xx, yy, xy.
static inline void nmm_biot_of(nmm_elastic elastic, const nmm_strain *e, const double initial[3],
                               double stress[3]) {
    const double volume = elastic.lambda * (e->exx + e->eyy);
    stress[0] = volume + 2 * elastic.mu * e->exx + initial[0];
    stress[1] = volume + 2 * elastic.mu * e->eyy + initial[1];
    stress[2] = 2 * elastic.mu * e->exy + initial[2];
}

/// R (T + kappa J): the skew part keeps P F^T symmetric where T[3] is not coaxial with U, eq.
/// (3.9), for the part `apart` of T that is not.
static inline nmm_tensor nmm_turned_of(const nmm_strain *strain, const double T[3],
                                       const double apart[3]) {
    const double kappa =
        -(apart[2] * (strain->exx - strain->eyy) + (apart[1] - apart[0]) * strain->exy) /
        strain->stretch;
    const double c = strain->c, s = strain->s;
    const double qxy = T[2] - kappa, qyx = T[2] + kappa;
    return (nmm_tensor){
        .xx = c * T[0] - s * qyx,
        .xy = c * qxy - s * T[1],
        .yx = s * T[0] + c * qyx,
        .yy = s * qxy + c * T[1],
    };
}

/// First Piola-Kirchhoff stress dW/dF [Pa], eq. (3.8); initial[3] = xx, yy, xy in the turned frame.
static inline nmm_tensor nmm_piola_of(nmm_elastic elastic, const nmm_strain *strain,
                                      const double initial[3]) {
    double T[3];
    nmm_biot_of(elastic, strain, initial, T);
    return nmm_turned_of(strain, T, initial);
}

/// W(F) [J/m3], eq. (3.7); zero at F = I.
double nmm_strain_energy_of(nmm_elastic elastic, const nmm_strain *strain, const double initial[3]);

/// Cauchy stress P F^T / det F along the fixed axes: stress[3] = xx, yy, xy.
void nmm_cauchy_of(const nmm_strain *strain, nmm_tensor piola, double stress[3]);

/// Stress and inner forces of all elements: those at the end of a step, or means over it.
typedef struct nmm_inner {
    double *piola;       // [n_element][4] Pa, eq. (3.8); order > 0: NULL
    double *force;       // [n_element][n_local][2] N on the covers
    const double *start; // [n_element, order > 0: n_sample][3] Pa, Biot stress before the step;
                         // NULL: no means
    const double *moved; // [n_cover][2] m, displacement of the step
    double share;        // of the end of the step in its means
} nmm_inner;

/// Fills the elements first .. end - 1 at state->displacement, several at a time;
/// elastic[n_material]. Means, eq. (4.13): of the Biot stresses at both ends, turned as the element
/// is half way; such forces have no moment about the places half way.
void nmm_inner_fill(const nmm_model *model, const nmm_state *state, const nmm_elastic *elastic,
                    const nmm_inner *inner, int first, int end);

/// What the stiffness of an element needs, computed once per pass, eq. (3.10): K_ij of the element
/// is  a (g_i . g_j) I + b q_i q_j^T + t p_i p_j^T  with q_i = R g_i, p_i = q_i turned by 90
/// degrees.
typedef struct nmm_stiffness {
    double q[3][2];           // turned gradients [1/m]
    double shear, bulk, turn; // a = 2 mu A, b = lambda A, t >= -mu A: never indefinite [N m2 / m]
} nmm_stiffness;
nmm_stiffness nmm_stiffness_of(nmm_elastic elastic, const nmm_strain *strain, double initial_mean,
                               double area, const double gradient[6]);

/// Adds the block [2][2] of the functions with turned gradients a and b to `block` [N/m]; all four
/// numbers at once.
static inline void nmm_stiffness_block(const nmm_stiffness *k, const double a[2], const double b[2],
                                       double block[4]) {
    typedef double four __attribute__((vector_size(32)));
    const double diagonal = k->shear * (a[0] * b[0] + a[1] * b[1]);
    const four along = {a[0], a[0], a[1], a[1]}, across = {a[1], -a[1], -a[0], a[0]};
    const four of_b = {b[0], b[1], b[0], b[1]}, swapped = {b[1], b[0], b[1], b[0]};
    const four sum =
        (four){diagonal, 0, 0, diagonal} + k->bulk * along * of_b + k->turn * across * swapped;
    four old;
    memcpy(&old, block, sizeof old);
    old += sum;
    memcpy(block, &old, sizeof old);
}

/// Adds block (i, j) [2][2] of the stiffness to `block` [N/m].
static inline void nmm_stiffness_add(const nmm_stiffness *k, int i, int j, double block[4]) {
    nmm_stiffness_block(k, k->q[i], k->q[j], block);
}

/// Order > 0: the strain, and what follows from it, changes within an element; it is integrated
/// over the element's samples (src/mechanics/curved.c).

/// nmm_inner_fill for elements with covers of order > 0.
void nmm_curved_inner_fill(const nmm_model *model, const nmm_state *state,
                           const nmm_elastic *elastic, const nmm_inner *inner, int first, int end);

/// Stiffness of element e, `share` of it: K[n_local][n_local][2][2] [N/m].
void nmm_curved_stiffness(const nmm_model *model, const nmm_state *state, nmm_elastic elastic,
                          int e, double share, double *K);

/// Biot stress at the samples of element e: stress[n_sample][3], of all elements [Pa].
void nmm_curved_biot(const nmm_model *model, const nmm_state *state, nmm_elastic elastic, int e,
                     double *stress);

/// Energy of element e [J per m].
double nmm_curved_energy(const nmm_model *model, const nmm_state *state, nmm_elastic elastic,
                         int e);

/// Mean Cauchy stress of element e [Pa], and cosine and sine of its mean rotation.
void nmm_curved_mean(const nmm_model *model, const nmm_state *state, nmm_elastic elastic, int e,
                     double stress[3], double rotation[2]);

/// Cauchy stress of element e at a place [Pa], with the initial stress there.
void nmm_curved_stress_at(const nmm_model *model, const nmm_state *state, nmm_elastic elastic,
                          const nmm_monitor *at, double stress[3]);

/// Smallest det F at the samples of element e.
double nmm_curved_least_volume(const nmm_model *model, const nmm_state *state, int e);

/// Consistent mass of an element [kg]: m[6] = 00, 01, 02, 11, 12, 22; eq. (3.12). Scalar: the
/// block is m I.
void nmm_mass_of(double density, double area, const double moment[3], const double weight[3],
                 const double gradient[6], double m[6]);

#endif
