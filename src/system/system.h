// SPDX-License-Identifier: MIT
//
// The system of equations of one pass: sparsity pattern, assembly of the matrix and the residual at
// the end configuration, supports and loads.

#ifndef NMM_SYSTEM_H
#define NMM_SYSTEM_H

#include "contact.h"
#include "mechanics.h"
#include "scene.h"
#include "solve.h"

/// Pattern, matrix, right-hand side and what is constant over the run.
typedef struct nmm_system {
    nmm_bsr K;
    int max_block; // blocks that K has room for
} nmm_system;

/// Supports, held blocks, loads, monitors and initial stress of the scene onto the model's points
/// and edges. What touches nothing is rejected with its line and column.
nmm_status nmm_loads_place(nmm_context *context, nmm_scene *scene, nmm_model *model);

#endif
