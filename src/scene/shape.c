// SPDX-License-Identifier: MIT
//
// Polygons and circles: distinct corners, no crossing edges, no zero area; turned
// counter-clockwise. Crossings are sought among edges sorted by their left end, so that long
// outlines stay cheap. Orientation is judged in doubles about a corner of the edge; the cover
// floor, which works on an integer lattice, has the last word on the rest.

#include "build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define FEWEST_SEGMENTS 48 // of a circle whose number is chosen: 0.3 % of its area is missing
#define MOST_SEGMENTS 10000

// --- Boxes

nmm_box nmm_box_empty(void) {
    return (nmm_box){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
}

nmm_box nmm_box_join(nmm_box a, nmm_box b) {
    return (nmm_box){{nmm_min(a.low.x, b.low.x), nmm_min(a.low.y, b.low.y)},
                     {nmm_max(a.high.x, b.high.x), nmm_max(a.high.y, b.high.y)}};
}

nmm_box nmm_box_of(int n, const nmm_vec2 *corner) {
    nmm_box box = nmm_box_empty();
    for (int i = 0; i < n; i++)
        box = nmm_box_join(box, (nmm_box){corner[i], corner[i]});
    return box;
}

bool nmm_boxes_meet(nmm_box a, nmm_box b) {
    return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y;
}

// --- Segments

// Which side of a -> b the point c lies on: sign of (b - a) x (c - a).
static int side_of(nmm_vec2 a, nmm_vec2 b, nmm_vec2 c) {
    const double cross = nmm_vec2_cross(nmm_vec2_sub(b, a), nmm_vec2_sub(c, a));
    return (cross > 0) - (cross < 0);
}

// Do the closed segments a b and c d have a point in common?
static bool segments_meet(nmm_vec2 a, nmm_vec2 b, nmm_vec2 c, nmm_vec2 d) {
    const nmm_vec2 first[2] = {a, b}, second[2] = {c, d};
    if (!nmm_boxes_meet(nmm_box_of(2, first), nmm_box_of(2, second))) return false;
    return side_of(a, b, c) * side_of(a, b, d) <= 0 && side_of(c, d, a) * side_of(c, d, b) <= 0;
}

// --- Areas

bool nmm_area_holds(const nmm_scene_area *area, nmm_vec2 point) {
    bool inside = false;
    for (int i = 0, j = area->n - 1; i < area->n; j = i++) {
        const nmm_vec2 a = area->corner[i], b = area->corner[j];
        if ((a.y > point.y) == (b.y > point.y)) continue;
        if (point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)) inside = !inside;
    }
    return inside;
}

bool nmm_areas_meet(const nmm_scene_area *a, const nmm_scene_area *b) {
    const nmm_box box = nmm_box_of(b->n, b->corner);
    if (!nmm_boxes_meet(nmm_box_of(a->n, a->corner), box)) return false;
    if (nmm_area_holds(a, b->corner[0]) || nmm_area_holds(b, a->corner[0])) return true;
    for (int i = 0; i < a->n; i++) {
        const nmm_vec2 edge[2] = {a->corner[i], a->corner[(i + 1) % a->n]};
        if (!nmm_boxes_meet(nmm_box_of(2, edge), box)) continue;
        for (int j = 0; j < b->n; j++) {
            if (segments_meet(edge[0], edge[1], b->corner[j], b->corner[(j + 1) % b->n]))
                return true;
        }
    }
    return false;
}

// --- Polygons

typedef struct edge_span {
    double low, high; // along x
    int edge;
} edge_span;

static int compare_spans(const void *a, const void *b) {
    const edge_span *p = a, *q = b;
    if (p->low != q->low) return p->low < q->low ? -1 : 1;
    return (p->edge > q->edge) - (p->edge < q->edge);
}

// Do edges i and j of a closed polygon meet where they must not?
static bool edges_clash(int n, const nmm_vec2 *corner, int i, int j) {
    if (i > j) {
        const int kept = i;
        i = j;
        j = kept;
    }
    const nmm_vec2 a = corner[i], c = corner[j];
    const nmm_vec2 b = corner[(i + 1) % n], d = corner[(j + 1) % n];
    // Neighbours share a corner; they clash only where the second runs back over the first.
    if (j == i + 1)
        return side_of(a, b, d) == 0 && nmm_vec2_dot(nmm_vec2_sub(a, b), nmm_vec2_sub(d, b)) > 0;
    if (i == 0 && j == n - 1)
        return side_of(c, a, b) == 0 && nmm_vec2_dot(nmm_vec2_sub(c, a), nmm_vec2_sub(b, a)) > 0;
    return segments_meet(a, b, c, d);
}

// The first pair of edges found to clash; false: none.
static nmm_status find_clash(nmm_reader *reader, int n, const nmm_vec2 *corner, int pair[2]) {
    edge_span *span = NULL;
    TRY(nmm_arena_take(reader->context, &reader->arena, &span, (size_t)n, sizeof *span));
    for (int i = 0; i < n; i++) {
        const double x = corner[i].x, next = corner[(i + 1) % n].x;
        span[i] = (edge_span){nmm_min(x, next), nmm_max(x, next), i};
    }
    qsort(span, (size_t)n, sizeof *span, compare_spans);
    pair[0] = -1;
    for (int i = 0; i < n && pair[0] < 0; i++) {
        for (int j = i + 1; j < n && span[j].low <= span[i].high; j++) {
            if (!edges_clash(n, corner, span[i].edge, span[j].edge)) continue;
            pair[0] = nmm_min_int(span[i].edge, span[j].edge);
            pair[1] = nmm_max_int(span[i].edge, span[j].edge);
            break;
        }
    }
    return NMM_OK;
}

static double signed_area(int n, const nmm_vec2 *corner) {
    double twice = 0;
    for (int i = 1; i + 1 < n; i++) {
        twice += nmm_vec2_cross(nmm_vec2_sub(corner[i], corner[0]),
                                nmm_vec2_sub(corner[i + 1], corner[0]));
    }
    return 0.5 * twice;
}

static void reverse(int n, nmm_vec2 *corner) {
    for (int i = 0, j = n - 1; i < j; i++, j--) {
        const nmm_vec2 kept = corner[i];
        corner[i] = corner[j];
        corner[j] = kept;
    }
}

static bool same_point(nmm_vec2 a, nmm_vec2 b) {
    return a.x == b.x && a.y == b.y;
}

static nmm_status check_polygon(nmm_builder *b, const raw_rows *rows, int n, nmm_vec2 *corner,
                                bool *good) {
    *good = false;
    if (n < 3)
        return nmm_complain(b->reader, rows->node->mark,
                            "a polygon needs at least 3 different corners, found %d", n);
    for (int i = 0; i < n; i++) {
        const int next = (i + 1) % n;
        if (same_point(corner[i], corner[next]))
            return nmm_complain(b->reader, nmm_node_at(rows->node, next)->mark,
                                "corner %d of the polygon repeats corner %d", next + 1, i + 1);
    }
    int pair[2];
    TRY(find_clash(b->reader, n, corner, pair));
    if (pair[0] >= 0)
        return nmm_complain(b->reader, nmm_node_at(rows->node, pair[1])->mark,
                            "edges of the polygon cross or touch: the one from corner %d and the "
                            "one from corner %d; the outline must be simple",
                            pair[0] + 1, pair[1] + 1);
    const nmm_box box = nmm_box_of(n, corner);
    const double size = nmm_max(box.high.x - box.low.x, box.high.y - box.low.y);
    const double area = signed_area(n, corner);
    if (!(fabs(area) > 1e-14 * size * size))
        return nmm_complain(b->reader, rows->node->mark, "the polygon has no area");
    if (area < 0) reverse(n, corner);
    *good = true;
    return NMM_OK;
}

nmm_status nmm_build_polygon(nmm_builder *b, const raw_rows *rows, nmm_scene_area *area,
                             bool *good) {
    NMM_ASSERT(rows->width == 2);
    nmm_vec2 *corner = NULL;
    TRY(nmm_arena_take(b->reader->context, &b->scene->arena, &corner, (size_t)rows->n,
                       sizeof *corner));
    for (int i = 0; i < rows->n; i++)
        corner[i] = (nmm_vec2){rows->value[2 * i], rows->value[2 * i + 1]};
    // A closing corner says nothing new.
    int n = rows->n;
    if (n > 1 && same_point(corner[0], corner[n - 1])) n -= 1;
    TRY(check_polygon(b, rows, n, corner, good));
    area->n = *good ? n : 0;
    area->corner = corner;
    area->material = -1;
    return NMM_OK;
}

// Sides of a circle that follow from the mesh: as long as a cover at order 0, an eighth of it at
// order 2, and 48 at least. A polygon is short of its circle by the square of the length of its
// sides; so it adds a part to the error of the mesh. A size that is chosen from the scene comes to
// at most 48 covers around a circle in it.
static int choose_segments(const nmm_builder *b, double radius) {
    static const double side_of_order[] = {1, 0.25, 0.125}; // over the size
    const raw_covers *covers = &b->raw->covers;
    const raw_head *head = &covers->head;
    const bool good = raw_good(head, "mesh") && raw_good(head, "order") && raw_good(head, "size");
    if (!good || covers->mesh == NMM_MESH_BLOCK) return FEWEST_SEGMENTS;
    const double side = side_of_order[nmm_max_int(0, covers->order)];
    const double around = covers->size > 0 ? 2 * PI * radius / covers->size : FEWEST_SEGMENTS;
    const double n = nmm_min(ceil(around / side), MOST_SEGMENTS);
    return nmm_max_int(FEWEST_SEGMENTS, (int)n);
}

static nmm_status build_circle(nmm_builder *b, const raw_circle *circle, nmm_scene_area *area) {
    const bool chosen = circle->segments == 0;
    const int n = chosen ? choose_segments(b, circle->radius) : (int)circle->segments;
    if (chosen) b->most_segments = nmm_max_int(b->most_segments, n);
    TRY(nmm_arena_take(b->reader->context, &b->scene->arena, &area->corner, (size_t)n,
                       sizeof *area->corner));
    area->n = n;
    area->material = -1;
    for (int i = 0; i < n; i++) {
        const double angle = 2 * PI * i / n;
        area->corner[i] = (nmm_vec2){circle->center.x + circle->radius * cos(angle),
                                     circle->center.y + circle->radius * sin(angle)};
    }
    return NMM_OK;
}

nmm_status nmm_build_area(nmm_builder *b, const raw_area *raw, nmm_scene_area *area, bool *good) {
    *good = false;
    if (raw->head.node == NULL) return NMM_OK;
    area->mark = raw->head.node->mark;
    if (raw_good(&raw->head, "polygon")) {
        TRY(nmm_build_polygon(b, &raw->polygon, area, good));
    } else if (raw_good(&raw->head, "circle")) {
        const raw_head *head = &raw->circle.head;
        *good = raw_good(head, "center") && raw_good(head, "radius") && raw_good(head, "segments");
        if (!*good) return NMM_OK;
        TRY(build_circle(b, &raw->circle, area));
        // A radius that drowns in the coordinates leaves corners that coincide.
        *good =
            signed_area(area->n, area->corner) > 0 && !same_point(area->corner[0], area->corner[1]);
        if (!*good) {
            area->n = 0;
            return nmm_complain(b->reader, raw_mark(head, "radius"),
                                "radius is too small for these coordinates");
        }
    }
    return NMM_OK;
}
