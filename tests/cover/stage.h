// SPDX-License-Identifier: MIT
//
// Scenes built in memory, cut and measured: what the tests of the cutting share.

#ifndef NMM_TEST_STAGE_H
#define NMM_TEST_STAGE_H

#include "test.h"

#include "cover.h"

/// A scene under construction, and what it was cut into. Start with stage_open.
typedef struct stage {
    nmm_context context;
    nmm_scene scene;
    nmm_model model;
    nmm_cover_report report;
    int domain_room, hole_room, region_room, joint_room, block_room;
} stage;

void stage_open(stage *s, double cover_size);
void stage_close(stage *s);

/// Add what has `n` corners: x, y, x, y, ...
void stage_domain(stage *s, int n, const double *corner, int material);
void stage_hole(stage *s, int n, const double *corner);
void stage_region(stage *s, int n, const double *corner, int material);
void stage_joint(stage *s, int n, const double *corner, int interface);
void stage_block(stage *s, int n, const double *corner, const char *name);
/// Shorter: an axis-parallel rectangle as domain, a joint with two corners.
void stage_rectangle(stage *s, double x0, double y0, double x1, double y1);
void stage_line(stage *s, double x0, double y0, double x1, double y1);

/// Cut, check all invariants, fail the test otherwise.
void stage_build(stage *s);
/// Forget the model, keep the scene.
void stage_forget(stage *s);

/// A hash of what does not depend on numbering: areas, centroids, covers and blocks per element,
/// points, loops.
uint64_t stage_hash(const stage *s);
/// Number of loops, over all blocks.
int stage_loops(const stage *s);
/// Number of covers at the lattice node nearest to a place in model coordinates.
int stage_covers_at(const stage *s, double x, double y);

#define STAGE_JOINT(s, interface, ...)                                                             \
    stage_joint(s, (int)(sizeof((double[]){__VA_ARGS__}) / sizeof(double) / 2),                    \
                (double[]){__VA_ARGS__}, interface)

#endif
