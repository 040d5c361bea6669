// SPDX-License-Identifier: MIT
//
// From a scene's geometry to the model's blocks, physical covers, manifold elements, points and
// boundary loops.
//
//   snap to an integer lattice -> arrange boundary, joints, region borders and mesh lines
//   -> faces = elements -> pieces of each star joined across uncut edges = physical covers
//
// The domain is arranged once with all its joints; each entry of `blocks` is arranged by itself.

#ifndef NMM_COVER_H
#define NMM_COVER_H

#include "scene.h"

/// What the cutting found, for `nmm check`.
typedef struct nmm_cover_report {
    int n_trimmed;          // joint ends that were cut back to an element's edge
    double trimmed_length;  // [m] in all
    double longest_trimmed; // [m]
    int n_joint_outside;    // joints that do not touch the domain
    int n_region_outside;   // regions that do not touch the domain
    double smallest_area;   // [m2] smallest element
    double mean_area;       // [m2]
    int smallest_element;
    double area;        // [m2] all elements
    double snap;        // [m] spacing of the integer lattice
    double weld;        // [m] what is nearer than this became one
    double size_chosen; // [m] cover size used
} nmm_cover_report;

/// Build all tables of model_fields.inl, origin, size, height, box, materials, interfaces, block
/// names, gravity and base motion from the scene. Supports, loads and monitors are the system
/// floor's. Wrong geometry (empty domain, crossing polygon, hole outside, ...) is rejected with its
/// line and column through nmm_scene_reject.
nmm_status nmm_cover_build(nmm_context *context, nmm_scene *scene, nmm_model *model,
                           nmm_cover_report *report);

/// Check every invariant of the tables (areas, loops closed, weights sum to one, ...); for tests
/// and NMM_VALIDATE.
nmm_status nmm_cover_check(nmm_context *context, const nmm_model *model);

#endif
