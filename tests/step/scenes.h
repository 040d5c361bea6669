// SPDX-License-Identifier: MIT
//
// Small scenes for tests of the step floor, as text.

#ifndef NMM_TEST_SCENES_H
#define NMM_TEST_SCENES_H

#include "step.h"

/// A block on a held base, friction 30 degrees, at rest.
extern const char *const SCENE_BLOCK_ON_BASE;
/// The same on a block that only its bottom edge holds: springs move both.
extern const char *const SCENE_BLOCK_ON_BED;
/// One block that falls: no contact, no support.
extern const char *const SCENE_FALL;
/// A column on a supported bottom edge, gravity as initial stress.
extern const char *const SCENE_COLUMN;

/// A simulation of `text` with the overrides given; asserts that it could be made.
nmm_sim *open_scene(const char *text, int n_override, const char *const *override);

/// Steps until the run ends or `n` are done; the last report.
nmm_step_report take_steps(nmm_sim *sim, int n);

#endif
