// SPDX-License-Identifier: MIT
//
// Single joints, and joint sets expanded into traces.
//
//      line k:  ---====---====---====      trace t, gap g, persistence = t / (t + g)
//      line k+1: ==---====---====---       odd lines are shifted by half of t + g
//      spacing between lines, across them; line 0 passes through `origin`, where a trace begins
//
// The random numbers of a trace depend on seed, line and place along the line only, so that a
// larger domain keeps the joints that a smaller one had.

#include "build.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

// What a set is laid out by: its directions, the box it must fill, and what bounds it.
typedef struct layout {
    const raw_set *raw;
    int set, interface;
    const char *name;
    nmm_vec2 origin, along, across; // unit vectors
    nmm_box box;                    // to be covered
    double reach;                   // half the box's diagonal
    double first_along, last_along; // the box, seen from the origin along the lines
    double period, trace;           // of the pattern on a line; 0: through-going
    int n_inside;
    nmm_scene_area *inside; // traces are cut to these; none: not cut
    bool full;              // the limit was met
} layout;

// --- Traces

// Part of the segment a + t (b - a) inside the box, in t[2]; false: nothing.
static bool clip_to_box(nmm_box box, nmm_vec2 a, nmm_vec2 b, double t[2]) {
    const double from[2] = {a.x, a.y}, way[2] = {b.x - a.x, b.y - a.y};
    const double low[2] = {box.low.x, box.low.y}, high[2] = {box.high.x, box.high.y};
    t[0] = 0;
    t[1] = 1;
    for (int k = 0; k < 2; k++) {
        if (way[k] == 0) {
            if (from[k] < low[k] || from[k] > high[k]) return false;
            continue;
        }
        const double enter = ((way[k] > 0 ? low[k] : high[k]) - from[k]) / way[k];
        const double leave = ((way[k] > 0 ? high[k] : low[k]) - from[k]) / way[k];
        t[0] = nmm_max(t[0], enter);
        t[1] = nmm_min(t[1], leave);
    }
    return t[0] <= t[1];
}

static nmm_box widen(nmm_box box, double margin) {
    return (nmm_box){{box.low.x - margin, box.low.y - margin},
                     {box.high.x + margin, box.high.y + margin}};
}

static nmm_status add_joint(nmm_builder *b, int *capacity, nmm_scene_joint joint) {
    TRY(nmm_grow(b->reader->context, &b->scene->joint, capacity, b->scene->n_joint + 1,
                 sizeof joint));
    b->scene->joint[b->scene->n_joint] = joint;
    b->scene->n_joint += 1;
    return NMM_OK;
}

static nmm_status too_many(nmm_builder *b, const layout *set, double count) {
    return nmm_complain(b->reader, raw_mark(&set->raw->head, "spacing"),
                        "this joint set comes to about %.3g traces in a box of %g by %g m; at most "
                        "%d are allowed in all; enlarge spacing or trace_length",
                        count, set->box.high.x - set->box.low.x, set->box.high.y - set->box.low.y,
                        NMM_SCENE_MAX);
}

static nmm_status add_trace(nmm_builder *b, layout *set, int *capacity, nmm_vec2 from,
                            nmm_vec2 to) {
    set->full = b->scene->n_joint >= NMM_SCENE_MAX;
    if (set->full) return too_many(b, set, b->scene->n_joint + 1.0);
    nmm_scene_joint joint = {.name = set->name,
                             .n = 2,
                             .interface = set->interface,
                             .set = set->set,
                             .mark = set->raw->head.node->mark};
    TRY(nmm_arena_take(b->reader->context, &b->scene->arena, &joint.corner, 2,
                       sizeof *joint.corner));
    joint.corner[0] = from;
    joint.corner[1] = to;
    return add_joint(b, capacity, joint);
}

// Parameters t where the segment crosses edges of the inside polygons, ascending, into cut[*n].
static nmm_status find_cuts(nmm_builder *b, const layout *set, nmm_vec2 from, nmm_vec2 to,
                            double **cut, int *n) {
    int most = 2;
    for (int i = 0; i < set->n_inside; i++)
        most += set->inside[i].n;
    TRY(nmm_arena_take(b->reader->context, &b->reader->arena, cut, (size_t)most, sizeof **cut));
    double *t = *cut;
    *n = 2;
    t[1] = 1;
    const nmm_vec2 way = nmm_vec2_sub(to, from);
    for (int i = 0; i < set->n_inside; i++) {
        const nmm_scene_area *area = &set->inside[i];
        for (int k = 0; k < area->n; k++) {
            const nmm_vec2 p = area->corner[k], q = area->corner[(k + 1) % area->n];
            const nmm_vec2 edge = nmm_vec2_sub(q, p), off = nmm_vec2_sub(p, from);
            const double cross = nmm_vec2_cross(way, edge);
            if (cross == 0) continue;
            const double s = nmm_vec2_cross(off, edge) / cross;
            const double r = nmm_vec2_cross(off, way) / cross;
            if (s > 0 && s < 1 && r >= 0 && r <= 1) t[(*n)++] = s;
        }
    }
    // Few cuts: insertion sort.
    for (int i = 1; i < *n; i++) {
        const double value = t[i];
        int k = i;
        for (; k > 0 && t[k - 1] > value; k--)
            t[k] = t[k - 1];
        t[k] = value;
    }
    return NMM_OK;
}

static bool inside_any(const layout *set, nmm_vec2 point) {
    for (int i = 0; i < set->n_inside; i++) {
        if (nmm_area_holds(&set->inside[i], point)) return true;
    }
    return false;
}

// The parts of a trace inside the polygons; parts that follow each other stay one.
static nmm_status cut_trace(nmm_builder *b, layout *set, int *capacity, nmm_vec2 from,
                            nmm_vec2 to) {
    if (set->n_inside == 0) return add_trace(b, set, capacity, from, to);
    double *t = NULL;
    int n = 0;
    TRY(find_cuts(b, set, from, to, &t, &n));
    const double least = 1e-9 * set->reach / nmm_max(set->trace, set->reach);
    int begin = -1;
    for (int i = 0; i < n && !set->full; i++) {
        const bool last = i + 1 == n;
        const double middle = last ? 0 : 0.5 * (t[i] + t[i + 1]);
        const bool inside = !last && inside_any(set, nmm_vec2_mix(from, to, middle));
        if (inside && begin < 0) begin = i;
        if (inside || begin < 0) continue;
        if (t[i] - t[begin] > least)
            TRY(add_trace(b, set, capacity, nmm_vec2_mix(from, to, t[begin]),
                          nmm_vec2_mix(from, to, t[i])));
        begin = -1;
    }
    return NMM_OK;
}

// --- Lines

// Evenly distributed between -1 and 1; depends on seed, line, trace and purpose only.
static double random_of(const layout *set, double line, double trace, int purpose) {
    const double key[4] = {set->raw->seed, line + 0.0, trace + 0.0, purpose};
    nmm_random random = nmm_random_seed(nmm_hash(NMM_HASH_START, key, sizeof key));
    return 2 * nmm_random_unit(&random) - 1;
}

// (cos, sin) of an angle in degrees, exact at multiples of 90.
static nmm_vec2 direction(double degrees) {
    static const nmm_vec2 quarter[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    if (fmod(degrees, 90) == 0) return quarter[((int)(degrees / 90) + 8) % 4];
    return (nmm_vec2){cos(degrees * (PI / 180)), sin(degrees * (PI / 180))};
}

// One trace about its middle, turned at random; kept when it passes through the box.
static nmm_status lay_trace(nmm_builder *b, layout *set, int *capacity, double place[2],
                            double ids[2]) {
    const double turn = set->raw->spread.dip * random_of(set, ids[0], ids[1], 2);
    const nmm_vec2 way = turn == 0 ? set->along : direction(set->raw->dip + turn);
    const double half = set->trace > 0 ? 0.5 * set->trace : 3 * set->reach;
    const nmm_vec2 middle =
        nmm_vec2_add(set->origin, nmm_vec2_add(nmm_vec2_scale(place[0], set->across),
                                               nmm_vec2_scale(place[1], set->along)));
    nmm_vec2 from = nmm_vec2_sub(middle, nmm_vec2_scale(half, way));
    nmm_vec2 to = nmm_vec2_add(middle, nmm_vec2_scale(half, way));
    // A trace that only follows the box's edge, or misses the box, is none.
    double t[2];
    if (!clip_to_box(widen(set->box, -1e-9 * set->reach), from, to, t)) return NMM_OK;
    if (set->trace == 0 && clip_to_box(widen(set->box, 0.02 * set->reach), from, to, t)) {
        const nmm_vec2 first = from;
        from = nmm_vec2_mix(first, to, t[0]);
        to = nmm_vec2_mix(first, to, t[1]);
    }
    return cut_trace(b, set, capacity, from, to);
}

static nmm_status lay_line(nmm_builder *b, layout *set, int *capacity, double line) {
    const raw_spread *spread = &set->raw->spread;
    double place[2] = {line * set->raw->spacing, 0};
    if (spread->spacing > 0) place[0] += 0.5 * spread->spacing * random_of(set, line, 0, 0);
    if (set->trace == 0) {
        double ids[2] = {line, 0};
        place[1] = 0.5 * (set->first_along + set->last_along);
        return lay_trace(b, set, capacity, place, ids);
    }
    double shift = fmod(line, 2) != 0 ? 0.5 * set->period : 0;
    if (spread->position > 0) shift += spread->position * random_of(set, line, 0, 1);
    const double first = floor((set->first_along - shift - set->trace) / set->period);
    const double last = ceil((set->last_along - shift) / set->period);
    for (double m = first; m <= last && !set->full; m++) {
        double ids[2] = {line, m};
        place[1] = m * set->period + shift + 0.5 * set->trace;
        TRY(lay_trace(b, set, capacity, place, ids));
    }
    return NMM_OK;
}

// The box as seen from the origin along one of the directions.
static void project(const layout *set, nmm_vec2 direction_, double range[2]) {
    range[0] = INFINITY;
    range[1] = -INFINITY;
    for (int i = 0; i < 4; i++) {
        const nmm_vec2 corner = {i % 2 == 0 ? set->box.low.x : set->box.high.x,
                                 i / 2 == 0 ? set->box.low.y : set->box.high.y};
        const double p = nmm_vec2_dot(nmm_vec2_sub(corner, set->origin), direction_);
        range[0] = nmm_min(range[0], p);
        range[1] = nmm_max(range[1], p);
    }
}

static nmm_status lay_set(nmm_builder *b, layout *set, int *capacity) {
    const raw_set *raw = set->raw;
    // Turned traces reach into the box from outside.
    const double half = set->trace > 0 ? 0.5 * set->trace : 1.5 * set->reach;
    const double slope = sin(nmm_min(45, raw->spread.dip) * (PI / 180));
    const double margin = half * slope + raw->spread.spacing;
    double range[2], along[2];
    project(set, set->across, range);
    project(set, set->along, along);
    set->first_along = along[0];
    set->last_along = along[1];
    const double first = ceil((range[0] - margin) / raw->spacing);
    const double last = floor((range[1] + margin) / raw->spacing);
    const double per_line = set->trace > 0 ? (along[1] - along[0]) / set->period + 1 : 1;
    const double count = (last - first + 1) * per_line;
    if (!(count <= 4.0 * NMM_SCENE_MAX)) return too_many(b, set, count);
    const int before = b->scene->n_joint, n_error = b->scene->n_error;
    for (double line = first; line <= last && !set->full; line++)
        TRY(lay_line(b, set, capacity, line));
    if (b->scene->n_joint > before || b->scene->n_error > n_error) return NMM_OK;
    return nmm_complain(b->reader, raw->head.node->mark,
                        "this joint set makes no trace %s; spacing is %g m, the box is %g by %g m",
                        set->n_inside > 0 ? "inside its polygons" : "in the domain", raw->spacing,
                        set->box.high.x - set->box.low.x, set->box.high.y - set->box.low.y);
}

// --- Sets

static nmm_status read_inside(nmm_builder *b, layout *set, bool *good) {
    const raw_set *raw = set->raw;
    *good = !raw_given(&raw->head, "inside");
    if (*good || !raw_good(&raw->head, "inside")) return NMM_OK;
    set->n_inside = raw->inside.n;
    TRY(nmm_arena_take(b->reader->context, &b->reader->arena, &set->inside, (size_t)set->n_inside,
                       sizeof *set->inside));
    set->box = nmm_box_empty();
    bool all = true;
    for (int i = 0; i < set->n_inside; i++) {
        bool one = false;
        TRY(nmm_build_polygon(b, &raw->inside.polygon[i], &set->inside[i], &one));
        all = all && one;
        set->box = nmm_box_join(set->box, nmm_box_of(set->inside[i].n, set->inside[i].corner));
    }
    *good = all;
    if (all && !nmm_boxes_meet(set->box, b->domain_box)) {
        *good = false;
        return nmm_complain(b->reader, raw_mark(&raw->head, "inside"),
                            "inside lies outside the domain");
    }
    return NMM_OK;
}

// What must fit together in a set.
static nmm_status check_set(nmm_builder *b, const raw_set *raw, bool *good) {
    const raw_head *head = &raw->head;
    const raw_head *spread = &raw->spread.head;
    *good = raw_good(head, "dip") && raw_good(head, "spacing") && raw_good(head, "persistence") &&
            raw_good(head, "seed") && raw_given(head, "origin") == raw_good(head, "origin") &&
            raw_given(head, "trace_length") == raw_good(head, "trace_length") &&
            raw_good(spread, "dip") && raw_good(spread, "spacing") && raw_good(spread, "position");
    if (!*good) return NMM_OK;
    *good = false;
    if (raw->persistence < 1 && !raw_given(head, "trace_length"))
        return nmm_complain(b->reader, raw_mark(head, "persistence"),
                            "persistence below 1 needs a trace_length");
    if (raw->spread.spacing >= raw->spacing)
        return nmm_complain(b->reader, raw_mark(spread, "spacing"),
                            "spread of spacing must be below spacing (%g m), found %g m",
                            raw->spacing, raw->spread.spacing);
    *good = true;
    return NMM_OK;
}

static nmm_status build_set(nmm_builder *b, int k, int *capacity) {
    const raw_set *raw = (const raw_set *)b->raw->joint_sets.item + k;
    layout set = {.raw = raw, .set = k, .box = b->domain_box};
    if (raw->head.node->kind != NMM_NODE_MAP) return NMM_OK;
    TRY(nmm_build_name(b, raw->name, "joint set", k + 1, &set.name));
    TRY(nmm_build_interface_of(b, &raw->head, raw->interface, &set.interface));
    bool good = false, inside = false;
    TRY(check_set(b, raw, &good));
    TRY(read_inside(b, &set, &inside));
    if (!good || !inside || !b->domain_good) return NMM_OK;
    set.origin = raw_given(&raw->head, "origin") ? raw->origin : b->domain_box.low;
    set.along = direction(raw->dip);
    set.across = (nmm_vec2){-set.along.y, set.along.x};
    const double width = set.box.high.x - set.box.low.x, height = set.box.high.y - set.box.low.y;
    set.reach = 0.5 * sqrt(width * width + height * height);
    if (raw->persistence < 1) {
        set.trace = raw->trace_length;
        set.period = raw->trace_length / raw->persistence;
    }
    return lay_set(b, &set, capacity);
}

// --- Single joints

static nmm_status check_polyline(nmm_builder *b, const raw_rows *rows,
                                 const nmm_scene_joint *joint) {
    bool meets = false;
    for (int i = 0; i + 1 < joint->n; i++) {
        const nmm_vec2 from = joint->corner[i], to = joint->corner[i + 1];
        double t[2];
        meets = meets || clip_to_box(b->domain_box, from, to, t);
        if (from.x == to.x && from.y == to.y)
            return nmm_complain(b->reader, nmm_node_at(rows->node, i + 1)->mark,
                                "corner %d of the polyline repeats corner %d", i + 2, i + 1);
    }
    if (meets || !b->domain_good) return NMM_OK;
    const nmm_box box = b->domain_box;
    return nmm_complain(b->reader, joint->mark,
                        "this joint lies outside the domain, whose box is x %g to %g, y %g to %g",
                        box.low.x, box.high.x, box.low.y, box.high.y);
}

static nmm_status build_joint(nmm_builder *b, int k, int *capacity) {
    const raw_joint *raw = (const raw_joint *)b->raw->joints.item + k;
    if (raw->head.node->kind != NMM_NODE_MAP) return NMM_OK;
    nmm_scene_joint joint = {.n = raw->polyline.n, .set = -1, .mark = raw->head.node->mark};
    TRY(nmm_build_name(b, raw->name, "joint", k + 1, &joint.name));
    TRY(nmm_build_interface_of(b, &raw->head, raw->interface, &joint.interface));
    if (!raw_good(&raw->head, "polyline")) return NMM_OK;
    TRY(nmm_arena_take(b->reader->context, &b->scene->arena, &joint.corner, (size_t)joint.n,
                       sizeof *joint.corner));
    for (int i = 0; i < joint.n; i++)
        joint.corner[i] = (nmm_vec2){raw->polyline.value[2 * i], raw->polyline.value[2 * i + 1]};
    TRY(check_polyline(b, &raw->polyline, &joint));
    return add_joint(b, capacity, joint);
}

static nmm_status build_all(nmm_builder *b, int *capacity) {
    for (int k = 0; k < b->raw->joints.n; k++)
        TRY(build_joint(b, k, capacity));
    for (int k = 0; k < b->raw->joint_sets.n; k++)
        TRY(build_set(b, k, capacity));
    return NMM_OK;
}

// The joints grow in a block of their own, then move into the scene's arena.
nmm_status nmm_build_joints(nmm_builder *b) {
    nmm_scene *scene = b->scene;
    TRY(nmm_build_check_names(b, &b->raw->joints, offsetof(raw_joint, name)));
    TRY(nmm_build_check_names(b, &b->raw->joint_sets, offsetof(raw_set, name)));
    int capacity = 0;
    nmm_status status = build_all(b, &capacity);
    nmm_scene_joint *grown = scene->joint;
    scene->joint = NULL;
    const size_t n = (size_t)scene->n_joint;
    if (status == NMM_OK) {
        status = nmm_arena_take(b->reader->context, &scene->arena, &scene->joint, n,
                                sizeof *scene->joint);
    }
    if (status == NMM_OK && n > 0) memcpy(scene->joint, grown, n * sizeof *grown);
    nmm_release(b->reader->context, &grown);
    return status;
}
