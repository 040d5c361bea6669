// SPDX-License-Identifier: MIT
//
// Segments of a body: outlines of its domain polygons, holes and regions, counter-clockwise;
// joints. Holes, regions and joints that reach far beyond the scene are clipped to its
// surroundings, where there is no material. Each joint end gets a tail of about 2^-30 of the
// scene's size, so that a joint that misses its neighbour by rounding still meets it; a tail that
// meets nothing is trimmed. The lines of the mesh follow, unless each block is one cover.

#include "cut.h"

static nmm_status add_segment(nmm_cut *cut, nmm_isegment segment, nmm_line line) {
    nmm_body *body = &cut->body;
    if (nmm_ipoint_equal(segment.a, segment.b)) return NMM_OK;
    const int n = body->n_segment + 1;
    TRY(nmm_grow(cut->context, &body->segment, &body->segment_capacity, n, sizeof(nmm_isegment)));
    TRY(nmm_grow(cut->context, &body->line, &body->line_capacity, n, sizeof(nmm_line)));
    body->segment[n - 1] = segment;
    body->line[n - 1] = line;
    body->n_segment = n;
    return NMM_OK;
}

// --- Clipping to the surroundings

// The scene's box, grown by an eighth of its size on each side.
static nmm_box surroundings(const nmm_lattice *lattice) {
    const nmm_box box = lattice->box;
    const double d = nmm_max(box.high.x - box.low.x, box.high.y - box.low.y) / 8;
    return (nmm_box){{box.low.x - d, box.low.y - d}, {box.high.x + d, box.high.y + d}};
}

// Signed distance of p to the inside of side 0..3 of the box.
static double inside_of(const nmm_box *box, int side, nmm_vec2 p) {
    switch (side) {
    case 0:
        return p.x - box->low.x;
    case 1:
        return box->high.x - p.x;
    case 2:
        return p.y - box->low.y;
    default:
        return box->high.y - p.y;
    }
}

// Cut the part of a -> b outside the box away; false: nothing is left.
static bool clip_segment(const nmm_box *box, nmm_vec2 *a, nmm_vec2 *b) {
    for (int side = 0; side < 4; side++) {
        const double da = inside_of(box, side, *a), db = inside_of(box, side, *b);
        if (da < 0 && db < 0) return false;
        if (da < 0) *a = nmm_vec2_mix(*a, *b, da / (da - db));
        if (db < 0) *b = nmm_vec2_mix(*a, *b, da / (da - db));
    }
    return true;
}

// Clip a polygon by one side of the box (Sutherland and Hodgman): from[n] to to[], returns the
// number of corners, at most 2 n.
static int clip_side(const nmm_box *box, int side, int n, const nmm_vec2 *from, nmm_vec2 *to) {
    int n_to = 0;
    for (int i = 0; i < n; i++) {
        const nmm_vec2 a = from[i], b = from[i + 1 < n ? i + 1 : 0];
        const double da = inside_of(box, side, a), db = inside_of(box, side, b);
        if (da >= 0) to[n_to++] = a;
        if ((da < 0) != (db < 0)) to[n_to++] = nmm_vec2_mix(a, b, da / (da - db));
    }
    return n_to;
}

// The corners of an area within the box, in *corner (arena).
static nmm_status clip_area(nmm_cut *cut, const nmm_box *box, const nmm_scene_area *area, int *n,
                            nmm_vec2 **corner) {
    nmm_vec2 *spare = NULL;
    const size_t most = 16 * (size_t)area->n;
    TRY(nmm_arena_take(cut->context, &cut->body.arena, corner, most, sizeof **corner));
    TRY(nmm_arena_take(cut->context, &cut->body.arena, &spare, most, sizeof *spare));
    for (int i = 0; i < area->n; i++)
        (*corner)[i] = area->corner[i];
    *n = area->n;
    for (int side = 0; side < 4; side++) {
        bool all_inside = true;
        for (int i = 0; i < *n; i++)
            all_inside = all_inside && inside_of(box, side, (*corner)[i]) >= 0;
        if (all_inside) continue;
        *n = clip_side(box, side, *n, *corner, spare);
        nmm_vec2 *swap = *corner;
        *corner = spare;
        spare = swap;
    }
    return NMM_OK;
}

// --- Areas

static const char *area_word(const nmm_cut *cut, int k) {
    static const char *const word[] = {"domain polygon", "hole", "region"};
    if (cut->body.n_joint == 0 && cut->body.name != NULL) return "block";
    return word[cut->body.area[k].kind];
}

static nmm_status add_area(nmm_cut *cut, const nmm_box *box, int k) {
    const nmm_scene_area *area = cut->body.area[k].area;
    const nmm_area_kind kind = cut->body.area[k].kind;
    int n = 0;
    nmm_vec2 *corner = NULL;
    nmm_ipoint *snapped = NULL;
    TRY(clip_area(cut, box, area, &n, &corner));
    TRY(nmm_arena_take(cut->context, &cut->body.arena, &snapped, (size_t)n, sizeof *snapped));
    for (int i = 0; i < n; i++)
        snapped[i] = nmm_lattice_snap(&cut->lattice, corner[i]);
    const nmm_int128 size = nmm_ipolygon_area(n, snapped);
    if (size == 0 && kind == NMM_AREA_DOMAIN) {
        return nmm_scene_reject(cut->context, cut->scene, area->mark,
                                "%s with %d corners has no area", area_word(cut, k), area->n);
    }
    // Clockwise outlines are turned.
    for (int i = 0; i < n; i++) {
        const nmm_ipoint a = snapped[i], b = snapped[i + 1 < n ? i + 1 : 0];
        const nmm_line line = {.kind = NMM_LINE_AREA, .index = k};
        const int rank = kind == NMM_AREA_REGION ? NMM_RANK_REGION : NMM_RANK_OUTLINE;
        const nmm_isegment side = {size > 0 ? a : b, size > 0 ? b : a, k, rank};
        TRY(add_segment(cut, side, line));
    }
    return NMM_OK;
}

// --- Joints

static nmm_status add_joint(nmm_cut *cut, const nmm_box *box, int k) {
    const nmm_scene_joint *joint = &cut->scene->joint[k];
    const nmm_line line = {.kind = NMM_LINE_JOINT, .index = k};
    for (int i = 0; i + 1 < joint->n; i++) {
        nmm_vec2 p = joint->corner[i], q = joint->corner[i + 1];
        if (!clip_segment(box, &p, &q)) continue;
        const nmm_ipoint a = nmm_lattice_snap(&cut->lattice, p);
        const nmm_ipoint b = nmm_lattice_snap(&cut->lattice, q);
        TRY(add_segment(cut, (nmm_isegment){a, b, NMM_FAMILY_NONE, NMM_RANK_JOINT}, line));
    }
    return NMM_OK;
}

nmm_status nmm_cut_outline(nmm_cut *cut) {
    const nmm_box box = surroundings(&cut->lattice);
    cut->body.n_segment = 0;
    for (int k = 0; k < cut->body.n_area; k++)
        TRY(add_area(cut, &box, k));
    for (int k = 0; k < cut->body.n_joint; k++)
        TRY(add_joint(cut, &box, k));
    return nmm_cut_whole_blocks(cut) ? NMM_OK : nmm_cut_mesh(cut);
}
