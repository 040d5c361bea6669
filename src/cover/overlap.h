// SPDX-License-Identifier: MIT
//
// Overlap of areas that should lie side by side: entries of `blocks` among each other and on the
// domain without its holes. An overlap at the start carries no force and would pass in silence.

#ifndef NMM_OVERLAP_H
#define NMM_OVERLAP_H

#include "scene.h"

/// Reject blocks that overlap deeper than a drawing's rounding or than the contacts can carry, warn
/// of the others. `size` is that of the covers, `origin` a place in the scene. `apart`: no block
/// overlaps another, nor the domain.
nmm_status nmm_cut_overlaps(nmm_context *context, nmm_scene *scene, double size, nmm_vec2 origin,
                            bool *apart);

#endif
