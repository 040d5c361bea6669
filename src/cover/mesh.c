// SPDX-License-Identifier: MIT
//
// Which triangles of the mesh a body needs, found strip by strip: the triangles along its outline,
// and between them those that the middle line of the strip meets inside. Triangles are counted
// along a strip by m = 2 i + down; triangle m reaches from m half sides to m + 2 half sides. A
// margin of a few units keeps all that snap rounding may move within the triangles taken.
//
//      \  1  /\  3  /
//       \  /   \   /       strip j, m = 0, 1, 2, 3
//     0  \/  2  \/

#include "cut.h"

#include <math.h>

#define MARGIN 8

// Triangles first..first + length of a strip, as a point that can be sorted: x the strip,
// y = first * 2^32 + length.
typedef struct stripe_list {
    int n, capacity;
    nmm_ipoint *item;
    int n_crossing, crossing_capacity;
    nmm_ipoint *crossing; // x the strip, y the place where an outline crosses its middle line
} stripe_list;

static int64_t divide_down(int64_t n, int64_t d) {
    const int64_t quotient = n / d;
    return quotient * d > n ? quotient - 1 : quotient;
}

static int64_t row_level(const nmm_lattice *lattice, int64_t j) {
    return lattice->base.y + j * lattice->rise;
}

// Half sides from the start of strip j to x.
static int64_t half_sides(const nmm_lattice *lattice, int64_t j, int64_t x) {
    const int64_t half = lattice->side / 2;
    return divide_down(x - lattice->base.x - j * half, half);
}

static nmm_status add_stripe(nmm_cut *cut, stripe_list *stripes, int64_t j, int64_t low,
                             int64_t high) {
    const int64_t first = half_sides(&cut->lattice, j, low - MARGIN) - 1;
    const int64_t last = half_sides(&cut->lattice, j, high + MARGIN);
    TRY(nmm_grow(cut->context, &stripes->item, &stripes->capacity, stripes->n + 1,
                 sizeof(nmm_ipoint)));
    const int64_t packed = first * (INT64_C(1) << 32) + (last - first);
    stripes->item[stripes->n++] = (nmm_ipoint){j, packed};
    return NMM_OK;
}

static double clamp(double low, double high, double y) {
    return nmm_min(high, nmm_max(low, y));
}

// The triangles along one edge of the outline.
static nmm_status follow_edge(nmm_cut *cut, stripe_list *stripes, nmm_isegment s) {
    const nmm_lattice *lattice = &cut->lattice;
    const bool upward = s.a.y <= s.b.y;
    const nmm_ipoint a = upward ? s.a : s.b, b = upward ? s.b : s.a;
    const int64_t first = divide_down(a.y - MARGIN - lattice->base.y, lattice->rise);
    const int64_t last = divide_down(b.y + MARGIN - lattice->base.y, lattice->rise);
    const double slope = a.y == b.y ? 0 : (double)(b.x - a.x) / (double)(b.y - a.y);
    const double height = (double)(b.y - a.y);
    for (int64_t j = first; j <= last; j++) {
        const double bottom = (double)(row_level(lattice, j) - MARGIN - a.y);
        const double top = (double)(row_level(lattice, j + 1) + MARGIN - a.y);
        int64_t from = a.x, to = b.x;
        if (a.y != b.y) {
            from = a.x + llround(slope * clamp(0, height, bottom));
            to = a.x + llround(slope * clamp(0, height, top));
        }
        TRY(add_stripe(cut, stripes, j, from < to ? from : to, from < to ? to : from));
        // Crossing with the middle line; the upper end does not count.
        const int64_t middle = row_level(lattice, j) + lattice->rise / 2;
        if ((a.y <= middle) == (b.y <= middle)) continue;
        TRY(nmm_grow(cut->context, &stripes->crossing, &stripes->crossing_capacity,
                     stripes->n_crossing + 1, sizeof(nmm_ipoint)));
        stripes->crossing[stripes->n_crossing++] =
            (nmm_ipoint){j, a.x + llround(slope * (double)(middle - a.y))};
    }
    return NMM_OK;
}

static nmm_status sort_list(nmm_cut *cut, int n, nmm_ipoint *list) {
    nmm_ipoint *spare = NULL;
    TRY(nmm_arena_take(cut->context, &cut->body.arena, &spare, (size_t)n, sizeof *spare));
    const nmm_ipoint *sorted = nmm_ipoint_sort(n, list, spare);
    for (int i = 0; i < n && sorted != list; i++)
        list[i] = sorted[i];
    return NMM_OK;
}

// The triangles of one domain polygon: segments first..end of the body.
static nmm_status follow_area(nmm_cut *cut, stripe_list *stripes, int first, int end) {
    stripes->n_crossing = 0;
    for (int i = first; i < end; i++)
        TRY(follow_edge(cut, stripes, cut->body.segment[i]));
    TRY(sort_list(cut, stripes->n_crossing, stripes->crossing));
    for (int i = 0; i + 1 < stripes->n_crossing; i += 2) {
        const nmm_ipoint in = stripes->crossing[i], out = stripes->crossing[i + 1];
        TRY(add_stripe(cut, stripes, in.x, in.y, out.y));
    }
    return NMM_OK;
}

static int first_of(nmm_ipoint stripe) {
    return (int)divide_down(stripe.y, INT64_C(1) << 32);
}
static int last_of(nmm_ipoint stripe) {
    return first_of(stripe) + (int)(stripe.y - first_of(stripe) * (INT64_C(1) << 32));
}

// Sort the stripes and join those that touch.
static nmm_status merge_stripes(nmm_cut *cut, stripe_list *stripes) {
    TRY(sort_list(cut, stripes->n, stripes->item));
    int n = 0;
    for (int i = 0; i < stripes->n; i++) {
        const nmm_ipoint next = stripes->item[i];
        nmm_ipoint *last = n > 0 ? &stripes->item[n - 1] : NULL;
        if (last == NULL || last->x != next.x || first_of(next) > last_of(*last) + 1) {
            stripes->item[n++] = next;
        } else if (last_of(next) > last_of(*last)) {
            last->y += last_of(next) - last_of(*last);
        }
    }
    stripes->n = n;
    return NMM_OK;
}

static nmm_status add_line(nmm_cut *cut, int64_t i, int64_t j, int direction) {
    nmm_body *body = &cut->body;
    const int n = body->n_segment + 1;
    TRY(nmm_grow(cut->context, &body->segment, &body->segment_capacity, n, sizeof(nmm_isegment)));
    TRY(nmm_grow(cut->context, &body->line, &body->line_capacity, n, sizeof(nmm_line)));
    const nmm_mesh_line line = {(int)i, (int)j, direction};
    body->segment[n - 1] = nmm_mesh_line_segment(&cut->lattice, line);
    body->line[n - 1] = (nmm_line){.kind = NMM_LINE_MESH, .mesh = line};
    body->n_segment = n;
    return NMM_OK;
}

// The slanted sides of a stripe, and its level ones into level[*n_level..).
static nmm_status add_slanted(nmm_cut *cut, nmm_ipoint stripe, int *n_level, nmm_ipoint *level) {
    const int j = (int)stripe.x, first = first_of(stripe), last = last_of(stripe);
    for (int m = first; m <= last + 1; m++) {
        const int down = m & 1, i = (m - down) / 2;
        TRY(add_line(cut, i, j, down == 0 ? 1 : 2));
        if (m <= last) level[(*n_level)++] = (nmm_ipoint){j + down, i};
    }
    return NMM_OK;
}

static nmm_status add_lines(nmm_cut *cut, const stripe_list *stripes) {
    size_t n_triangle = 0;
    for (int k = 0; k < stripes->n; k++) {
        n_triangle += (size_t)(last_of(stripes->item[k]) - first_of(stripes->item[k])) + 1;
    }
    if (n_triangle > INT32_MAX / 8) {
        return nmm_scene_reject(cut->context, cut->scene, (nmm_mark){0},
                                "covers.size is too small: %zu triangles", n_triangle);
    }
    int n_level = 0;
    nmm_ipoint *level = NULL;
    TRY(nmm_arena_take(cut->context, &cut->body.arena, &level, n_triangle, sizeof *level));
    for (int k = 0; k < stripes->n; k++)
        TRY(add_slanted(cut, stripes->item[k], &n_level, level));
    // Level sides belong to two strips: once each.
    TRY(sort_list(cut, n_level, level));
    for (int k = 0; k < n_level; k++) {
        if (k > 0 && nmm_ipoint_equal(level[k - 1], level[k])) continue;
        TRY(add_line(cut, level[k].y, level[k].x, 0));
    }
    return NMM_OK;
}

static nmm_status collect_lines(nmm_cut *cut, stripe_list *stripes) {
    const nmm_body *body = &cut->body;
    // Segments of one area follow each other.
    for (int first = 0; first < body->n_segment;) {
        const nmm_line line = body->line[first];
        int end = first + 1;
        while (end < body->n_segment && body->line[end].kind == line.kind &&
               body->line[end].index == line.index) {
            end += 1;
        }
        const bool material =
            line.kind == NMM_LINE_AREA && body->area[line.index].kind == NMM_AREA_DOMAIN;
        if (material) TRY(follow_area(cut, stripes, first, end));
        first = end;
    }
    TRY(merge_stripes(cut, stripes));
    return add_lines(cut, stripes);
}

nmm_status nmm_cut_mesh(nmm_cut *cut) {
    stripe_list stripes = {0};
    const nmm_status status = collect_lines(cut, &stripes);
    nmm_release(cut->context, &stripes.item);
    nmm_release(cut->context, &stripes.crossing);
    return status;
}
