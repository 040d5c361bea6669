// SPDX-License-Identifier: MIT
//
// Loads as arrows, with the factor that their history has at the frame's time. Forces at points
// are shown by their force, tractions by the traction, not by the parts in which the mesh takes
// it up. Loads at one place that point nearly the same way are one arrow, their sum; others have
// an arrow each.
//
// An arrow's length is measured by the largest load of its kind in any frame, so that pictures of
// one run compare.

#include "view.h"

#include <math.h>
#include <stdlib.h>

static const nmm_colour load_colour = {0.72, 0.05, 0.38};

// --- Arrows of a frame

// Within 18 degrees of one another.
static bool alike(nmm_vec2 a, nmm_vec2 b) {
    return nmm_vec2_dot(a, b) > 0.95 * hypot(a.x, a.y) * hypot(b.x, b.y);
}

static int compare_numbers(double a, double b) {
    return (a > b) - (a < b);
}

// By kind and place; `x` and `y` are whole numbers of a small length for the time being.
static int compare_places(const void *first, const void *second) {
    const nmm_arrow *a = first, *b = second;
    if (a->kind != b->kind) return a->kind < b->kind ? -1 : 1;
    if (a->x != b->x) return compare_numbers(a->x, b->x);
    if (a->y != b->y) return compare_numbers(a->y, b->y);
    return (a->row > b->row) - (a->row < b->row);
}

static int compare_rows(const void *first, const void *second) {
    const nmm_arrow *a = first, *b = second;
    if (a->kind != b->kind) return a->kind < b->kind ? -1 : 1;
    return (a->row > b->row) - (a->row < b->row);
}

// Loads that are not zero now, in steps of `step` metres.
static void list_loads(nmm_picture *picture, double step) {
    const nmm_file_geometry *g = picture->geometry;
    for (int i = 0; i < g->n_load; i++) {
        const nmm_load_row *l = &g->load[i];
        const nmm_load_kind kind = l->length > 0 ? NMM_LOAD_TRACTION : NMM_LOAD_FORCE;
        const double each = kind == NMM_LOAD_TRACTION ? 1 / l->length : 1;
        const double size = each * hypot(l->fx, l->fy);
        const double peak = picture->frame.load_most[i] * size;
        const double factor = each * picture->frame.load_factor[i];
        picture->load_peak[kind] = nmm_max(picture->load_peak[kind], peak);
        // Less is what rounding left of a zero.
        if (!(fabs(picture->frame.load_factor[i]) * size > 1e-9 * peak)) continue;
        picture->arrow[picture->n_arrow++] = (nmm_arrow){.row = i,
                                                         .kind = kind,
                                                         .x = rint(l->x / step),
                                                         .y = rint(l->y / step),
                                                         .value = {factor * l->fx, factor * l->fy}};
    }
}

// Arrow i joins one of arrows first .. n - 1, or comes behind them. Returns their number.
static int join_arrow(nmm_picture *picture, int first, int n, int i) {
    nmm_arrow *arrow = picture->arrow;
    for (int k = first; k < n; k++) {
        if (!alike(arrow[k].value, arrow[i].value)) continue;
        arrow[k].value = nmm_vec2_add(arrow[k].value, arrow[i].value);
        picture->load_summed[arrow[k].kind] = true;
        return n;
    }
    arrow[n] = arrow[i];
    return n + 1;
}

static void join_places(nmm_picture *picture) {
    nmm_arrow *arrow = picture->arrow;
    int n = 0, first = 0;
    for (int i = 0; i < picture->n_arrow; i++) {
        const bool same = n > 0 && arrow[i].kind == arrow[first].kind &&
                          arrow[i].x == arrow[first].x && arrow[i].y == arrow[first].y;
        if (!same) first = n;
        n = join_arrow(picture, first, n, i);
    }
    picture->n_arrow = n;
}

nmm_status nmm_loads_gather(nmm_picture *picture, double side) {
    const nmm_file_geometry *g = picture->geometry;
    nmm_context *context = nmm_file_context(picture->file);
    TRY(nmm_allocate(context, &picture->arrow, (size_t)g->n_load, sizeof *picture->arrow));
    list_loads(picture, side > 0 ? 1e-7 * side : 1);
    if (picture->n_arrow == 0) return NMM_OK;
    qsort(picture->arrow, (size_t)picture->n_arrow, sizeof *picture->arrow, compare_places);
    join_places(picture);
    qsort(picture->arrow, (size_t)picture->n_arrow, sizeof *picture->arrow, compare_rows);
    for (int i = 0; i < picture->n_arrow; i++) {
        nmm_arrow *a = &picture->arrow[i];
        a->x = g->load[a->row].x;
        a->y = g->load[a->row].y;
        const double size = hypot(a->value.x, a->value.y);
        picture->load_largest[a->kind] = nmm_max(picture->load_largest[a->kind], size);
    }
    return NMM_OK;
}

// --- Drawing

void nmm_draw_arrow(cairo_t *cairo, nmm_vec2 tip, nmm_vec2 along, double length, double width) {
    const double head = nmm_min(5 * width, 0.6 * length), wide = 0.45 * head;
    const nmm_vec2 base = nmm_vec2_sub(tip, nmm_vec2_scale(head, along));
    cairo_move_to(cairo, tip.x - along.x * length, tip.y - along.y * length);
    cairo_line_to(cairo, base.x, base.y);
    nmm_draw_cased(cairo, load_colour, width, 0.3 * width);
    cairo_move_to(cairo, tip.x, tip.y);
    cairo_line_to(cairo, base.x - along.y * wide, base.y + along.x * wide);
    cairo_line_to(cairo, base.x + along.y * wide, base.y - along.x * wide);
    cairo_close_path(cairo);
    cairo_set_source_rgb(cairo, load_colour.r, load_colour.g, load_colour.b);
    cairo_fill(cairo);
}

static void draw_load(const nmm_picture *picture, const nmm_arrow *a, nmm_vec2 at) {
    const double size = hypot(a->value.x, a->value.y), u = picture->unit;
    const double most = nmm_max(picture->load_peak[a->kind], picture->load_largest[a->kind]);
    const nmm_vec2 along = {a->value.x / size, -a->value.y / size};
    nmm_draw_arrow(picture->cairo, at, along, (18 + 32 * size / most) * u,
                   nmm_load_width(a->kind) * u);
}

double nmm_load_width(nmm_load_kind kind) {
    return kind == NMM_LOAD_FORCE ? 3.2 : 2.2;
}

// Tractions drawn so far.
enum { MOST_DRAWN = 600 };
typedef struct drawn_arrows {
    int n;
    nmm_vec2 at[MOST_DRAWN], value[MOST_DRAWN];
} drawn_arrows;

// Tractions stand for themselves at some distance only; arrows behind each other need more of it
// than arrows side by side.
static bool has_room(drawn_arrows *drawn, const nmm_arrow *a, nmm_vec2 at, double u) {
    const nmm_vec2 to = {a->value.x, -a->value.y};
    const double size = hypot(to.x, to.y);
    for (int i = 0; i < drawn->n; i++) {
        if (!alike(drawn->value[i], a->value)) continue;
        const nmm_vec2 off = nmm_vec2_sub(at, drawn->at[i]);
        const double length = hypot(off.x, off.y);
        const bool behind = fabs(nmm_vec2_cross(off, to)) < 0.5 * length * size;
        if (length < (behind ? 66 : 26) * u) return false;
    }
    if (drawn->n == MOST_DRAWN) return false;
    drawn->at[drawn->n] = at;
    drawn->value[drawn->n++] = a->value;
    return true;
}

void nmm_draw_loads(const nmm_picture *picture) {
    drawn_arrows drawn = {.n = 0};
    // Tractions come first, forces over them.
    for (int i = 0; i < picture->n_arrow; i++) {
        const nmm_arrow *a = &picture->arrow[i];
        const nmm_vec2 at =
            nmm_moved_place(picture, picture->geometry->load[a->row].element, a->x, a->y);
        if (a->kind == NMM_LOAD_TRACTION && !has_room(&drawn, a, at, picture->unit)) continue;
        draw_load(picture, a, at);
    }
}
