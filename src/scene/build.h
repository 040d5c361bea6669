// SPDX-License-Identifier: MIT
//
// From the scene as written to the checked scene: names to indices, angles to tangents and
// directions, polygons counter-clockwise, joint sets and repeated blocks expanded. What depends on
// a value that was wrong is passed over, so that one mistake gives one message.

#ifndef NMM_SCENE_BUILD_H
#define NMM_SCENE_BUILD_H

#include "raw.h"

typedef struct nmm_builder {
    nmm_reader *reader;
    const raw_scene *raw;
    nmm_scene *scene;
    bool domain_good;       // every area of the domain was read
    nmm_box domain_box;     // of the areas that were read
    nmm_box box;            // of domain and blocks
    int n_filled_material;  // areas that take the only material
    int n_filled_interface; // interface of joints left to the default
    int most_segments;      // of the circles whose number of sides is chosen; 0: none
} nmm_builder;

/// The checked scene from the raw one; mistakes are collected.
nmm_status nmm_scene_build(nmm_reader *reader, const raw_scene *raw);

// --- names.c

nmm_status nmm_build_materials(nmm_builder *b);
nmm_status nmm_build_warn_materials(nmm_builder *b); // after the blocks: weight needs the box
/// Interfaces; entry 0 is the scene's default.
nmm_status nmm_build_interfaces(nmm_builder *b);
/// Index of the material of an area; the only one where none is named.
nmm_status nmm_build_material_of(nmm_builder *b, const raw_head *head, const char *name,
                                 int *index);
/// Index of an interface; 0, the default, where none is named.
nmm_status nmm_build_interface_of(nmm_builder *b, const raw_head *head, const char *name,
                                  int *index);
/// Complain where two entries of the list bear one name; `name_offset` is that of their name.
nmm_status nmm_build_check_names(nmm_builder *b, const raw_list *list, size_t name_offset);
/// `name`, or "what 3" in the scene's arena.
nmm_status nmm_build_name(nmm_builder *b, const char *name, const char *what, int number,
                          const char **result);

// --- shape.c

/// A polygon's rows as a simple counter-clockwise area; *good is false after a complaint.
nmm_status nmm_build_polygon(nmm_builder *b, const raw_rows *rows, nmm_scene_area *area,
                             bool *good);
/// Polygon or circle of a domain, hole, region or block.
nmm_status nmm_build_area(nmm_builder *b, const raw_area *raw, nmm_scene_area *area, bool *good);
nmm_box nmm_box_of(int n, const nmm_vec2 *corner);
nmm_box nmm_box_join(nmm_box a, nmm_box b);
nmm_box nmm_box_empty(void);
bool nmm_boxes_meet(nmm_box a, nmm_box b);
bool nmm_area_holds(const nmm_scene_area *area, nmm_vec2 point);
/// Do two areas have a point in common?
bool nmm_areas_meet(const nmm_scene_area *a, const nmm_scene_area *b);

// --- joints.c, blocks.c, places.c

nmm_status nmm_build_joints(nmm_builder *b);
nmm_status nmm_build_domain(nmm_builder *b);
nmm_status nmm_build_blocks(nmm_builder *b);
nmm_status nmm_build_places(nmm_builder *b);
/// Rows of a history, checked to ascend in time, into the scene's arena.
nmm_status nmm_build_history(nmm_builder *b, const raw_rows *rows, const char *key,
                             nmm_history *history);

#endif
