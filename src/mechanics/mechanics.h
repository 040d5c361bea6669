// SPDX-License-Identifier: MIT
//
// Element matrices and the material law: pure functions on small values, equations (3.x) of
// docs/theory.md.

#ifndef NMM_MECHANICS_H
#define NMM_MECHANICS_H

#include "model.h"

/// Lame constants for the plane state: plane strain (lambda, mu), plane stress (lambda*, mu). [Pa]
typedef struct nmm_elastic {
    double lambda, mu;
} nmm_elastic;
nmm_elastic nmm_elastic_of(const nmm_material *material);

/// Deformation gradient and what follows from it.
typedef struct nmm_strain {
    double c, s;          // cosine, sine of the rotation R
    double stretch;       // tr U
    double exx, eyy, exy; // Biot strain U - I in the turned frame (exy tensor component)
} nmm_strain;

/// Polar decomposition of F = I + sum_i d_i (x) grad w_i; d[i][2], gradient[i][2].
nmm_strain nmm_strain_of(const double d[6], const double gradient[6]);

#endif
