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
