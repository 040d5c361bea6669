// SPDX-License-Identifier: MIT
//
// The constant-strain manifold element at finite rotation: strain, stress, energy, stiffness, mass.
// Source of the polar form: in two dimensions tr U = |(F11 + F22, F21 - F12)|, whose derivative by
// F is R itself, so energy, force and tangent are closed expressions (docs/theory/3-mechanics.md).

#include "mechanics.h"

#include <math.h>

nmm_elastic nmm_elastic_of(const nmm_material *material) {
    const double E = material->youngs_modulus, nu = material->poissons_ratio;
    const double mu = E / (2 * (1 + nu));
    const double lambda = material->plane == NMM_PLANE_STRAIN ? E * nu / ((1 + nu) * (1 - 2 * nu))
                                                              : E * nu / (1 - nu * nu);
    return (nmm_elastic){.lambda = lambda, .mu = mu};
}

nmm_tensor nmm_displacement_gradient(const double d[6], const double gradient[6]) {
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

nmm_strain nmm_strain_of(const double d[6], const double gradient[6]) {
    const nmm_tensor H = nmm_displacement_gradient(d, gradient);
    const double sum = 2 + H.xx + H.yy, turn = H.yx - H.xy;
    const double stretch = sqrt(sum * sum + turn * turn);
    const double c = sum / stretch, s = turn / stretch;
    // c - 1 without cancellation; for turns beyond 90 degrees the plain difference is exact enough.
    const double less = sum > 0 ? -turn * turn / (stretch * (stretch + sum)) : c - 1;
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

// Biot stress D e + s0 in the turned frame.
static void biot_stress(nmm_elastic elastic, const nmm_strain *e, const double initial[3],
                        double T[3]) {
    const double volume = elastic.lambda * (e->exx + e->eyy);
    T[0] = volume + 2 * elastic.mu * e->exx + initial[0];
    T[1] = volume + 2 * elastic.mu * e->eyy + initial[1];
    T[2] = 2 * elastic.mu * e->exy + initial[2];
}

nmm_tensor nmm_piola_of(nmm_elastic elastic, const nmm_strain *strain, const double initial[3]) {
    double T[3];
    biot_stress(elastic, strain, initial, T);
    // Initial stress need not be coaxial with U: the skew part keeps P F^T symmetric, eq. (3.9).
    const double kappa =
        -(initial[2] * (strain->exx - strain->eyy) + (initial[1] - initial[0]) * strain->exy) /
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

void nmm_element_pull(const nmm_model *model, nmm_elastic elastic, const double initial[3], int e,
                      const double d[6], double piola[4], double force[6]) {
    const double *gradient = model->element_gradient + 6 * (long)e;
    const nmm_strain strain = nmm_strain_of(d, gradient);
    const nmm_tensor P = nmm_piola_of(elastic, &strain, initial);
    const double area = model->element_area[e];
    piola[0] = P.xx, piola[1] = P.xy, piola[2] = P.yx, piola[3] = P.yy;
    for (int i = 0; i < 3; i++) {
        const double gx = area * gradient[2 * i], gy = area * gradient[2 * i + 1];
        force[2 * i] = P.xx * gx + P.xy * gy;
        force[2 * i + 1] = P.yx * gx + P.yy * gy;
    }
}

double nmm_strain_energy_of(nmm_elastic elastic, const nmm_strain *strain,
                            const double initial[3]) {
    const double x = strain->exx, y = strain->eyy, xy = strain->exy;
    return 0.5 * elastic.lambda * (x + y) * (x + y) + elastic.mu * (x * x + y * y + 2 * xy * xy) +
           initial[0] * x + initial[1] * y + 2 * initial[2] * xy;
}

void nmm_cauchy_of(const nmm_strain *strain, nmm_tensor piola, double stress[3]) {
    const nmm_tensor *H = &strain->H;
    const double fxx = 1 + H->xx, fyy = 1 + H->yy;
    const double volume = fxx * fyy - H->xy * H->yx;
    stress[0] = (piola.xx * fxx + piola.xy * H->xy) / volume;
    stress[1] = (piola.yx * H->yx + piola.yy * fyy) / volume;
    stress[2] = (piola.xx * H->yx + piola.xy * fyy) / volume;
}

nmm_stiffness nmm_stiffness_of(nmm_elastic elastic, const nmm_strain *strain, double initial_mean,
                               double area, const double gradient[6]) {
    nmm_stiffness k = {.shear = 2 * elastic.mu * area, .bulk = elastic.lambda * area};
    // Exact in tension; in compression the negative geometric part is left out, so that the matrix
    // stays semidefinite: a Newton matrix, not the residual.
    const double turn =
        (elastic.lambda * (strain->exx + strain->eyy) + initial_mean - 2 * elastic.mu) /
        strain->stretch;
    k.turn = area * nmm_max(turn, -elastic.mu);
    for (int i = 0; i < 3; i++) {
        const double gx = gradient[2 * i], gy = gradient[2 * i + 1];
        k.q[i][0] = strain->c * gx - strain->s * gy;
        k.q[i][1] = strain->s * gx + strain->c * gy;
    }
    return k;
}

void nmm_mass_of(double density, double area, const double moment[3], const double weight[3],
                 const double gradient[6], double m[6]) {
    int k = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = i; j < 3; j++) {
            const double *a = gradient + 2 * i, *b = gradient + 2 * j;
            const double second = moment[0] * a[0] * b[0] + moment[2] * a[1] * b[1] +
                                  moment[1] * (a[0] * b[1] + a[1] * b[0]);
            m[k++] = density * (weight[i] * weight[j] * area + second);
        }
    }
}
