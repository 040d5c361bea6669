// SPDX-License-Identifier: MIT
//
// Blocks that overlap. Candidates by boxes in cells: each box lies in the cell of its lower left
// corner on a grid as coarse as the box, so that any mix of sizes costs O(n). Then the outline of
// the common part: each edge is split where others cross it, and a piece belongs to it when the
// common part lies on one side only. Area and length of that outline give the depth. What is nearer
// than a contact counts as touching is one place.

#include "overlap.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

// Parts of the cover size: what counts as one place, as touching (the same as for contacts), and
// what can be carried (contacts deeper than half the cover size are lost).
#define SAME 2.5e-7
#define TOUCH 1e-6
#define CARRIED 0.1
// Part of the smaller block's size: more is not the rounding of a drawing.
#define ROUNDED 0.02
// Mistakes that are told; with so many found the search ends.
enum { MOST_TOLD = 10, MOST_DEEP = 1000 };

// Two areas of a scene that overlap.
typedef struct overlap {
    int first, second; // bodies, see `entry`; first < second
    double area;       // [m2]
    double allowed;    // [m] a larger depth is an error
    double depth;      // [m] mean thickness: that of a strip with this area and this outline
    nmm_vec2 place;    // [m] on its outline
} overlap;

// An area in the index.
typedef struct entry {
    nmm_box box;
    int body;  // k - n_domain: polygon k of the domain, else a block
    int level; // cells of 2^level, at least as large as the box
    long row, column;
} entry;

// An edge of one of the areas that are compared; `set` 0: the first, 1: the second, 2...: holes.
typedef struct side {
    nmm_vec2 a, b;
    int set;
} side;

typedef struct search {
    nmm_context *context;
    nmm_scene *scene;
    nmm_vec2 origin; // of the coordinates below: digits near the scene
    double same;     // [m] what is nearer is one place
    int n_entry;
    entry *entry; // sorted by level, row, column
    int n_level, level[2100];

    nmm_box box; // of the pair that is compared: common part of both boxes
    int n_side, side_capacity;
    side *side;
    int n_set, set_capacity;
    bool *inside; // [n_set] scratch
    int cut_capacity;
    double *cut; // scratch: parameters of an edge

    int n_found, found_capacity, n_deep;
    overlap *found;
} search;

static const nmm_scene_area *area_of(const nmm_scene *scene, int body) {
    return body < 0 ? &scene->domain[body + scene->n_domain] : &scene->block[body].area;
}

// --- Index

static nmm_box box_of(const nmm_scene_area *area, nmm_vec2 origin) {
    nmm_box box = {area->corner[0], area->corner[0]};
    for (int i = 1; i < area->n; i++) {
        const nmm_vec2 p = area->corner[i];
        box.low = (nmm_vec2){nmm_min(box.low.x, p.x), nmm_min(box.low.y, p.y)};
        box.high = (nmm_vec2){nmm_max(box.high.x, p.x), nmm_max(box.high.y, p.y)};
    }
    return (nmm_box){nmm_vec2_sub(box.low, origin), nmm_vec2_sub(box.high, origin)};
}

// Do the boxes share more than touching sides?
static bool boxes_overlap(nmm_box a, nmm_box b, double same) {
    return a.low.x + same < b.high.x && b.low.x + same < a.high.x && a.low.y + same < b.high.y &&
           b.low.y + same < a.high.y;
}

static long cell_of(double place, int level) {
    return (long)floor(ldexp(place, -level));
}

static int compare_entries(const void *a, const void *b) {
    const entry *p = a, *q = b;
    if (p->level != q->level) return p->level < q->level ? -1 : 1;
    if (p->row != q->row) return p->row < q->row ? -1 : 1;
    if (p->column != q->column) return p->column < q->column ? -1 : 1;
    return (p->body > q->body) - (p->body < q->body);
}

static void fill_entry(entry *e, const nmm_scene *scene, int body, nmm_vec2 origin) {
    const nmm_box box = box_of(area_of(scene, body), origin);
    const double size = nmm_max(box.high.x - box.low.x, box.high.y - box.low.y);
    *e = (entry){.box = box, .body = body};
    frexp(size, &e->level);
    e->row = cell_of(box.low.y, e->level);
    e->column = cell_of(box.low.x, e->level);
}

static nmm_status build_index(search *s) {
    const nmm_scene *scene = s->scene;
    const int n = scene->n_domain + scene->n_block;
    TRY(nmm_allocate(s->context, &s->entry, (size_t)n, sizeof *s->entry));
    s->n_entry = n;
    for (int i = 0; i < n; i++)
        fill_entry(&s->entry[i], scene, i - scene->n_domain, s->origin);
    qsort(s->entry, (size_t)n, sizeof *s->entry, compare_entries);
    for (int i = 0; i < n; i++) {
        const int level = s->entry[i].level;
        if (s->n_level == 0 || s->level[s->n_level - 1] != level) s->level[s->n_level++] = level;
    }
    return NMM_OK;
}

// First entry at or behind the cell.
static int find_cell(const search *s, int level, long row, long column) {
    const entry key = {.level = level, .row = row, .column = column, .body = INT32_MIN};
    int low = 0, high = s->n_entry;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (compare_entries(&s->entry[middle], &key) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

// --- The common part of two areas

static nmm_status add_side(search *s, side added) {
    TRY(nmm_grow(s->context, &s->side, &s->side_capacity, s->n_side + 1, sizeof *s->side));
    s->side[s->n_side++] = added;
    return NMM_OK;
}

// Sides that a ray to the right from within the box can cross.
static nmm_status add_area(search *s, const nmm_scene_area *area, nmm_box box) {
    for (int i = 0; i < area->n; i++) {
        const nmm_vec2 a = nmm_vec2_sub(area->corner[i], s->origin);
        const nmm_vec2 b = nmm_vec2_sub(area->corner[i + 1 < area->n ? i + 1 : 0], s->origin);
        if (nmm_max(a.y, b.y) < box.low.y || nmm_min(a.y, b.y) > box.high.y) continue;
        if (nmm_max(a.x, b.x) >= box.low.x) TRY(add_side(s, (side){a, b, s->n_set}));
    }
    s->n_set += 1;
    return NMM_OK;
}

// The sides of both areas, and of the holes where the first is the domain, as far as they matter
// within the box of the pair.
static nmm_status gather_sides(search *s, const entry *first, const entry *second) {
    const nmm_scene *scene = s->scene;
    s->n_side = s->n_set = 0;
    TRY(add_area(s, area_of(scene, first->body), s->box));
    TRY(add_area(s, area_of(scene, second->body), s->box));
    for (int k = 0; k < scene->n_hole && first->body < 0; k++) {
        if (boxes_overlap(box_of(&scene->hole[k], s->origin), s->box, 0))
            TRY(add_area(s, &scene->hole[k], s->box));
    }
    return nmm_grow(s->context, &s->inside, &s->set_capacity, s->n_set, sizeof *s->inside);
}

// Does the place belong to the common part?
static bool is_common(const search *s, nmm_vec2 place) {
    if (!boxes_overlap(s->box, (nmm_box){place, place}, 0)) return false;
    for (int k = 0; k < s->n_set; k++)
        s->inside[k] = false;
    for (int i = 0; i < s->n_side; i++) {
        const side *e = &s->side[i];
        if ((e->a.y > place.y) == (e->b.y > place.y)) continue;
        const double x = e->a.x + (place.y - e->a.y) / (e->b.y - e->a.y) * (e->b.x - e->a.x);
        if (place.x < x) s->inside[e->set] = !s->inside[e->set];
    }
    bool common = s->inside[0] && s->inside[1];
    for (int k = 2; k < s->n_set; k++)
        common = common && !s->inside[k];
    return common;
}

static double distance_to(const side *e, nmm_vec2 place) {
    const nmm_vec2 along = nmm_vec2_sub(e->b, e->a), to = nmm_vec2_sub(place, e->a);
    const double t = nmm_vec2_dot(to, along) / nmm_vec2_dot(along, along);
    const nmm_vec2 off = nmm_vec2_sub(to, nmm_vec2_scale(nmm_max(0, nmm_min(1, t)), along));
    return sqrt(nmm_vec2_dot(off, off));
}

// Add the parameters on edge `e` where edge `o` meets it or ends beside it.
static nmm_status add_cuts(search *s, const side *e, const side *o, int *n) {
    const nmm_vec2 d = nmm_vec2_sub(e->b, e->a);
    const double square = nmm_vec2_dot(d, d);
    const double u = nmm_vec2_cross(d, nmm_vec2_sub(o->a, e->a));
    const double v = nmm_vec2_cross(d, nmm_vec2_sub(o->b, e->a));
    const double t = nmm_vec2_dot(d, nmm_vec2_sub(o->a, e->a)) / square;
    const double w = nmm_vec2_dot(d, nmm_vec2_sub(o->b, e->a)) / square;
    double at[3] = {t, w, 0};
    int n_at = 2;
    if ((u > 0) != (v > 0)) at[n_at++] = t + u / (u - v) * (w - t);
    TRY(nmm_grow(s->context, &s->cut, &s->cut_capacity, *n + n_at, sizeof *s->cut));
    for (int k = 0; k < n_at; k++) {
        if (at[k] > 0 && at[k] < 1) s->cut[(*n)++] = at[k];
    }
    return NMM_OK;
}

static int compare_numbers(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Where an earlier area has an edge at the same place, it stands for this one too.
static bool is_doubled(const search *s, const side *e, nmm_vec2 place) {
    for (int i = 0; i < s->n_side; i++) {
        const side *o = &s->side[i];
        if (o->set < e->set && distance_to(o, place) < s->same) return true;
    }
    return false;
}

// What the outline of a common part adds up to.
typedef struct outline {
    double twice_area, length;
    nmm_vec2 place; // sum of middles times length
} outline;

// The piece a -> b of edge e: part of the outline where the common part lies on one side only.
static void add_piece(const search *s, const side *e, nmm_vec2 a, nmm_vec2 b, outline *sum) {
    const nmm_vec2 d = nmm_vec2_sub(b, a), middle = nmm_vec2_mix(a, b, 0.5);
    const double length = sqrt(nmm_vec2_dot(d, d));
    if (length < s->same) return;
    const nmm_vec2 left = nmm_vec2_scale(s->same / length, (nmm_vec2){-d.y, d.x});
    const bool on_left = is_common(s, nmm_vec2_add(middle, left));
    const bool on_right = is_common(s, nmm_vec2_sub(middle, left));
    if (on_left == on_right || is_doubled(s, e, middle)) return;
    sum->twice_area += (on_left ? 1 : -1) *
                       nmm_vec2_cross(nmm_vec2_sub(a, s->box.low), nmm_vec2_sub(b, s->box.low));
    sum->length += length;
    sum->place = nmm_vec2_add(sum->place, nmm_vec2_scale(length, middle));
}

static nmm_status add_pieces(search *s, const side *e, outline *sum) {
    int n = 0;
    for (int i = 0; i < s->n_side; i++) {
        const side *o = &s->side[i];
        if (o != e && nmm_min(o->a.x, o->b.x) <= s->box.high.x) TRY(add_cuts(s, e, o, &n));
    }
    if (n > 1) qsort(s->cut, (size_t)n, sizeof *s->cut, compare_numbers);
    double last = 0;
    for (int k = 0; k <= n; k++) {
        const double next = k < n ? s->cut[k] : 1;
        add_piece(s, e, nmm_vec2_mix(e->a, e->b, last), nmm_vec2_mix(e->a, e->b, next), sum);
        last = next;
    }
    return NMM_OK;
}

// Thickness of the strip with this area and this length of outline; of a square at most.
static double thickness_of(double area, double length) {
    const double half = length / 2, root = half * half - 4 * area;
    return root > 0 ? 2 * area / (half + sqrt(root)) : half / 2;
}

// Depth that is an error [m]: more than the rounding of a drawing, or than contacts carry.
static double depth_allowed(const search *s, int first, int second) {
    const nmm_scene_area *a = area_of(s->scene, first), *b = area_of(s->scene, second);
    const double smaller = nmm_min(fabs(nmm_polygon_moments(a->n, a->corner).area),
                                   fabs(nmm_polygon_moments(b->n, b->corner).area));
    return nmm_min(ROUNDED * sqrt(smaller), CARRIED / SAME * s->same);
}

// Note the common part of two entries whose boxes overlap, if there is any.
static nmm_status compare_pair(search *s, const entry *first, const entry *second) {
    outline sum = {0};
    const nmm_box a = first->box, b = second->box;
    s->box = (nmm_box){{nmm_max(a.low.x, b.low.x), nmm_max(a.low.y, b.low.y)},
                       {nmm_min(a.high.x, b.high.x), nmm_min(a.high.y, b.high.y)}};
    TRY(gather_sides(s, first, second));
    for (int i = 0; i < s->n_side; i++) {
        const side *e = &s->side[i];
        if (nmm_min(e->a.x, e->b.x) <= s->box.high.x) TRY(add_pieces(s, e, &sum));
    }
    const double area = sum.twice_area / 2;
    const double depth = area > 0 ? thickness_of(area, sum.length) : 0;
    if (depth < TOUCH / SAME * s->same) return NMM_OK;
    TRY(nmm_grow(s->context, &s->found, &s->found_capacity, s->n_found + 1, sizeof *s->found));
    const bool block = second->body >= 0;
    const overlap found = {
        .first = first->body,
        .second = second->body,
        .area = area,
        .allowed = block ? depth_allowed(s, first->body, second->body) : INFINITY,
        .depth = depth,
        .place = nmm_vec2_add(s->origin, nmm_vec2_scale(1 / sum.length, sum.place)),
    };
    s->found[s->n_found++] = found;
    s->n_deep += found.depth > found.allowed;
    return NMM_OK;
}

// --- All pairs

// Polygons of the domain make one body: of them only those of different material matter.
static bool may_not_overlap(const nmm_scene *scene, int a, int b) {
    return a >= 0 || b >= 0 || area_of(scene, a)->material != area_of(scene, b)->material;
}

// Pairs of entry i with those of one level: as coarse as its own or coarser.
static nmm_status search_level(search *s, int i, int level) {
    const entry *e = &s->entry[i];
    const double cell = ldexp(1, level);
    const long last_row = cell_of(e->box.high.y, level), last = cell_of(e->box.high.x, level);
    const long first = cell_of(e->box.low.x - cell, level);
    for (long row = cell_of(e->box.low.y - cell, level); row <= last_row; row++) {
        for (int k = find_cell(s, level, row, first); k < s->n_entry; k++) {
            const entry *o = &s->entry[k];
            if (o->level != level || o->row != row || o->column > last) break;
            // Of two on one level each finds the other.
            if (o->level == e->level && k <= i) continue;
            if (!may_not_overlap(s->scene, e->body, o->body)) continue;
            if (!boxes_overlap(e->box, o->box, s->same)) continue;
            const bool ordered = e->body < o->body;
            TRY(compare_pair(s, ordered ? e : o, ordered ? o : e));
        }
    }
    return NMM_OK;
}

static int compare_overlaps(const void *a, const void *b) {
    const overlap *p = a, *q = b;
    if (p->second != q->second) return p->second < q->second ? -1 : 1;
    return (p->first > q->first) - (p->first < q->first);
}

static nmm_status find_overlaps(search *s) {
    TRY(build_index(s));
    for (int i = 0; i < s->n_entry && s->n_deep <= MOST_DEEP; i++) {
        for (int l = 0; l < s->n_level; l++) {
            if (s->level[l] >= s->entry[i].level) TRY(search_level(s, i, s->level[l]));
        }
    }
    if (s->n_found > 1) qsort(s->found, (size_t)s->n_found, sizeof *s->found, compare_overlaps);
    return NMM_OK;
}

// --- What is told

typedef struct pair_text {
    char text[420];
} pair_text;

// "block 'b' overlaps block 'a' by 0.5 m near (0.5, 0.75)"
static pair_text describe(const nmm_scene *scene, const overlap *o) {
    pair_text told;
    char first[120] = "the domain";
    if (o->first >= 0) snprintf(first, sizeof first, "block '%.80s'", scene->block[o->first].name);
    snprintf(told.text, sizeof told.text, "block '%.80s' overlaps %s by %.3g m near (%.6g, %.6g)",
             scene->block[o->second].name, first, o->depth, o->place.x, o->place.y);
    return told;
}

static nmm_status reject_deep(search *s) {
    int n = 0;
    for (int k = 0; k < s->n_found && n < MOST_TOLD; k++) {
        const overlap *o = &s->found[k];
        if (o->depth <= o->allowed) continue;
        n += 1;
        char more[60] = "";
        if (n == MOST_TOLD && s->n_deep > n)
            snprintf(more, sizeof more, " (and %s%d more pairs)",
                     s->n_deep > MOST_DEEP ? "at least " : "", s->n_deep - n);
        const nmm_status status = nmm_scene_reject(
            s->context, s->scene, s->scene->block[o->second].area.mark,
            "%s; blocks must lie side by side, and no more than %.2g m is taken as rounding%s",
            describe(s->scene, o).text, o->allowed, more);
        if (status != NMM_ERROR_INPUT) return status;
    }
    return n > 0 ? NMM_ERROR_INPUT : NMM_OK;
}

// One warning for all blocks, at the deepest overlap.
static nmm_status warn_blocks(search *s, bool *apart) {
    const overlap *deepest = NULL;
    int n = 0;
    for (int k = 0; k < s->n_found; k++) {
        const overlap *o = &s->found[k];
        if (o->second < 0) continue;
        if (deepest == NULL || o->depth > deepest->depth) deepest = o;
        n += 1;
    }
    *apart = deepest == NULL;
    if (*apart) return NMM_OK;
    char others[60] = "";
    if (n > 1) snprintf(others, sizeof others, ", the deepest of %d overlaps", n);
    return nmm_scene_warn(s->context, s->scene, s->scene->block[deepest->second].area.mark,
                          "%s%s; they start as if they just touched",
                          describe(s->scene, deepest).text, others);
}

static nmm_status warn_domain(search *s) {
    nmm_scene *scene = s->scene;
    int n = 0;
    for (int k = 0; k < s->n_found; k++) {
        const overlap *o = &s->found[k];
        if (o->second >= 0 || ++n > MOST_TOLD) continue;
        const nmm_scene_area *before = area_of(scene, o->first), *after = area_of(scene, o->second);
        TRY(nmm_scene_warn(s->context, scene, after->mark,
                           "this polygon of the domain overlaps the one at line %d over %.3g m2; "
                           "there the later one holds, of '%.60s', not '%.60s'",
                           before->mark.line, o->area, scene->material_name[after->material],
                           scene->material_name[before->material]));
    }
    return NMM_OK;
}

nmm_status nmm_cut_overlaps(nmm_context *context, nmm_scene *scene, double size, nmm_vec2 origin,
                            bool *apart) {
    search s = {.context = context, .scene = scene, .origin = origin, .same = SAME * size};
    const bool single = scene->n_domain + scene->n_block < 2;
    nmm_status status = single ? NMM_OK : find_overlaps(&s);
    if (status == NMM_OK) status = reject_deep(&s);
    if (status == NMM_OK) status = warn_blocks(&s, apart);
    if (status == NMM_OK) status = warn_domain(&s);
    nmm_release(context, &s.entry);
    nmm_release(context, &s.side);
    nmm_release(context, &s.inside);
    nmm_release(context, &s.cut);
    nmm_release(context, &s.found);
    return status;
}
