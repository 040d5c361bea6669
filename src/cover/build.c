// SPDX-License-Identifier: MIT
//
// From scene to model: choose the lattices, cut the domain and then each separate block, and write
// the draft into the model's tables. Bodies follow in scene order, so do blocks; within a body
// covers are numbered by row and column of the mesh.

#include "cut.h"
#include "overlap.h"

#include <string.h>

// --- Bodies

static nmm_status check_body(nmm_cut *cut) {
    const nmm_body *body = &cut->body;
    const int crossed = body->arrangement.crossed;
    if (crossed >= 0) {
        return nmm_scene_reject(cut->context, cut->scene, body->area[crossed].area->mark,
                                "the outline crosses itself");
    }
    return NMM_OK;
}

// Cut the body that is set up in cut->body.
static nmm_status cut_body(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    TRY(nmm_cut_outline(cut));
    TRY(nmm_arrangement_build(cut->context, &body->arrangement, body->n_segment, body->segment,
                              cut->lattice.reach));
    TRY(check_body(cut));
    TRY(nmm_cut_faces(cut));
    if (body->n_element == 0) {
        return nmm_scene_reject(cut->context, cut->scene, body->area[0].area->mark,
                                "nothing is left of the domain: holes cover all of it");
    }
    TRY(nmm_cut_patches(cut));
    TRY(nmm_cut_measure_trimmed(cut));
    TRY(nmm_cut_points(cut));
    TRY(nmm_cut_corners(cut));
    return nmm_cut_loops(cut);
}

static nmm_status cut_domain(nmm_cut *cut) {
    const nmm_scene *scene = cut->scene;
    nmm_body *body = &cut->body;
    if (scene->n_domain == 0) {
        if (scene->n_hole == 0) return NMM_OK;
        return nmm_scene_reject(cut->context, cut->scene, scene->hole[0].mark,
                                "there is a hole, but no domain that it could be in");
    }
    const int n_area = scene->n_domain + scene->n_hole + scene->n_region;
    TRY(nmm_arena_take(cut->context, &body->arena, &body->area, (size_t)n_area,
                       sizeof *body->area));
    for (int k = 0; k < scene->n_domain; k++)
        body->area[body->n_area++] = (nmm_body_area){NMM_AREA_DOMAIN, &scene->domain[k]};
    for (int k = 0; k < scene->n_hole; k++)
        body->area[body->n_area++] = (nmm_body_area){NMM_AREA_HOLE, &scene->hole[k]};
    for (int k = 0; k < scene->n_region; k++)
        body->area[body->n_area++] = (nmm_body_area){NMM_AREA_REGION, &scene->region[k]};
    body->n_joint = scene->n_joint;
    body->from = -1;
    return cut_body(cut);
}

static nmm_status cut_block(nmm_cut *cut, const nmm_scene_block *block) {
    nmm_body *body = &cut->body;
    nmm_arena_reset(cut->context, &body->arena);
    TRY(nmm_arena_take(cut->context, &body->arena, &body->area, 1, sizeof *body->area));
    body->area[0] = (nmm_body_area){NMM_AREA_DOMAIN, &block->area};
    body->n_area = 1;
    body->n_joint = 0;
    body->name = block->name;
    body->from = (int)(block - cut->scene->block);
    return cut_body(cut);
}

// --- Joints that cut nothing

// Warnings of single joints that are written out.
enum { MOST_TOLD = 8 };

// Traces begin .. end - 1 of a joint set. It covers the box of the domain, which a slope does not
// fill: that some miss is no mistake.
static nmm_status warn_set(nmm_cut *cut, int begin, int end) {
    const nmm_scene_joint *joint = &cut->scene->joint[begin];
    int n = 0;
    for (int k = begin; k < end; k++)
        n += !cut->touched[k];
    if (n < end - begin) return NMM_OK;
    return nmm_scene_warn(cut->context, cut->scene, joint->mark,
                          "'%.60s': all traces of this joint set, %d, lie outside the domain and "
                          "cut nothing",
                          joint->name != NULL ? joint->name : "", n);
}

static nmm_status warn_joint(nmm_cut *cut, int k, int before) {
    const nmm_scene_joint *joint = &cut->scene->joint[k];
    if (before > MOST_TOLD) return NMM_OK;
    if (before == MOST_TOLD) {
        return nmm_scene_warn(cut->context, cut->scene, joint->mark,
                              "more joints from here on lie outside the domain and cut nothing");
    }
    return nmm_scene_warn(cut->context, cut->scene, joint->mark,
                          "'%.60s': this joint lies outside the domain and cuts nothing",
                          joint->name != NULL ? joint->name : "");
}

// The traces of a set follow each other.
static nmm_status warn_outside(nmm_cut *cut) {
    const nmm_scene *scene = cut->scene;
    int n = 0;
    for (int k = 0, end; k < scene->n_joint; k = end) {
        const int set = scene->joint[k].set;
        for (end = k + 1; set >= 0 && end < scene->n_joint && scene->joint[end].set == set;)
            end += 1;
        if (set >= 0)
            TRY(warn_set(cut, k, end));
        else if (!cut->touched[k])
            TRY(warn_joint(cut, k, n++));
        for (int i = k; i < end; i++)
            cut->report->n_joint_outside += !cut->touched[i];
    }
    return NMM_OK;
}

static nmm_status cut_scene(nmm_cut *cut) {
    const nmm_scene *scene = cut->scene;
    TRY(nmm_lattice_choose(cut->context, cut->scene, &cut->lattice));
    TRY(nmm_cut_overlaps(cut->context, cut->scene, (double)cut->lattice.side * cut->lattice.spacing,
                         cut->lattice.origin, &cut->apart));
    TRY(nmm_allocate(cut->context, &cut->touched, (size_t)scene->n_joint, sizeof(bool)));
    TRY(cut_domain(cut));
    for (int k = 0; k < scene->n_block; k++)
        TRY(cut_block(cut, &scene->block[k]));
    TRY(warn_outside(cut));
    cut->report->snap = cut->lattice.spacing;
    cut->report->weld = (double)cut->lattice.reach * cut->lattice.spacing;
    cut->report->size_chosen = (double)cut->lattice.side * cut->lattice.spacing;
    return NMM_OK;
}

static void destroy_cut(nmm_cut *cut) {
    nmm_context *context = cut->context;
    nmm_release(context, &cut->body.segment);
    nmm_release(context, &cut->body.line);
    nmm_arrangement_destroy(context, &cut->body.arrangement);
    nmm_arena_destroy(context, &cut->body.arena);
    nmm_release(context, &cut->draft.element);
    nmm_release(context, &cut->draft.element_cover);
    nmm_release(context, &cut->draft.piece_start);
    nmm_release(context, &cut->draft.piece);
    nmm_release(context, &cut->draft.corner);
    nmm_release(context, &cut->draft.cover);
    nmm_release(context, &cut->draft.point);
    nmm_release(context, &cut->draft.vertex);
    nmm_release(context, &cut->draft.block_name);
    nmm_release(context, &cut->draft.block_scene);
    nmm_release(context, &cut->touched);
}

nmm_status nmm_cover_build(nmm_context *context, nmm_scene *scene, nmm_model *model,
                           nmm_cover_report *report) {
    nmm_cover_report unread;
    if (report == NULL) report = &unread;
    *report = (nmm_cover_report){0};
    nmm_cut cut = {.context = context, .scene = scene, .report = report};
    nmm_status status = cut_scene(&cut);
    if (status == NMM_OK) status = nmm_cut_fill_model(&cut, model);
    destroy_cut(&cut);
    if (status == NMM_OK) NMM_VALIDATE(nmm_cover_check(context, model) == NMM_OK);
    return status;
}
