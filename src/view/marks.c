// SPDX-License-Identifier: MIT
//
// What is drawn over the blocks: joints that opened or slid, contact forces, supports (loads are in
// loads.c); and the legend that explains those that are there.

#include "view.h"

#include <math.h>

static const nmm_colour ink = {0.13, 0.13, 0.15};
static const nmm_colour open_colour = {0.05, 0.72, 0.95};  // joint that opened
static const nmm_colour slid_colour = {0.98, 0.45, 0.05};  // joint that slid
static const nmm_colour force_colour = {0.10, 0.10, 0.12}; // contact force
static const nmm_colour support_colour = {0.10, 0.42, 0.24};

static void set_colour(cairo_t *cairo, nmm_colour colour) {
    cairo_set_source_rgb(cairo, colour.r, colour.g, colour.b);
}

void nmm_draw_cased(cairo_t *cairo, nmm_colour colour, double width, double casing) {
    cairo_set_source_rgba(cairo, 1, 1, 1, 0.85);
    cairo_set_line_width(cairo, width + 2 * casing);
    cairo_stroke_preserve(cairo);
    set_colour(cairo, colour);
    cairo_set_line_width(cairo, width);
    cairo_stroke(cairo);
}

// --- Joints and contacts

static void draw_joints(const nmm_picture *picture, int state, nmm_colour colour) {
    const nmm_file_geometry *g = picture->geometry;
    cairo_t *cairo = picture->cairo;
    const double u = picture->unit;
    for (int i = 0; i < g->n_edge; i++) {
        if (picture->edge_state[i] != state) continue;
        const double *a = picture->page + 2 * (long)g->edge_point[2 * i];
        const double *b = picture->page + 2 * (long)g->edge_point[2 * i + 1];
        cairo_move_to(cairo, a[0], a[1]);
        cairo_line_to(cairo, b[0], b[1]);
    }
    nmm_draw_cased(cairo, colour, (g->n_block > 400 ? 2.2 : 3.6) * u, 0.8 * u);
}

// Forces smaller than this part of the largest are not drawn.
#define LEAST_FORCE 0.02

static double force_of(const nmm_file_contact *c) {
    return hypot(c->force[0], c->force[1]);
}

// Lines get shorter and thinner where they are many.
static double crowding(const nmm_picture *picture) {
    int n = 0;
    for (int i = 0; i < picture->frame.n_contact; i++)
        n += force_of(&picture->frame.contact[i]) > 0.1 * picture->force_most;
    return nmm_max(0.45, nmm_min(1, sqrt(120.0 / nmm_max_int(n, 1))));
}

// Along the force, centred at the contact; length and thickness grow with it.
static void draw_forces(const nmm_picture *picture) {
    const nmm_file_frame *frame = &picture->frame;
    const nmm_file_geometry *g = picture->geometry;
    const double u = picture->unit, most = picture->force_most;
    if (!(most > 0)) return;
    const double crowd = crowding(picture),
                 side = nmm_min(picture->plot.width, picture->plot.height);
    const double longest = crowd * nmm_min(100 * u, 0.16 * side + 30 * u);
    for (int i = 0; i < frame->n_contact; i++) {
        const nmm_file_contact *c = &frame->contact[i];
        const double force = force_of(c), part = force / most;
        if (part < LEAST_FORCE) continue;
        const double *at = picture->page + 2 * (long)g->edge_point[2 * c->vertex];
        const double half = 0.5 * longest * part / force;
        cairo_move_to(picture->cairo, at[0] - half * c->force[0], at[1] + half * c->force[1]);
        cairo_line_to(picture->cairo, at[0] + half * c->force[0], at[1] - half * c->force[1]);
        const double width = 1.2 + crowd * (0.6 + 4.2 * part);
        nmm_draw_cased(picture->cairo, force_colour, width * u, (0.5 + 0.5 * crowd * part) * u);
    }
}

// --- Supports

// The shift is that of the element's nearest corner.
nmm_vec2 nmm_moved_place(const nmm_picture *picture, int e, double x, double y) {
    const nmm_file_geometry *g = picture->geometry;
    long nearest = -1;
    double least = INFINITY;
    for (int k = e >= 0 ? g->element_start[e] : 0; e >= 0 && k < g->element_start[e + 1]; k++) {
        const long p = g->corner_point[k];
        const double off = hypot(g->point[2 * p] - x, g->point[2 * p + 1] - y);
        if (off < least) {
            least = off;
            nearest = p;
        }
    }
    if (nearest >= 0 && picture->frame.displacement != NULL) {
        x += picture->scale * picture->frame.displacement[2 * nearest];
        y += picture->scale * picture->frame.displacement[2 * nearest + 1];
    }
    return nmm_layout_place(picture, x, y);
}

// A triangle whose tip is at `tip`, pointing along (dx, dy); a roller gets a line behind it.
static void draw_support(cairo_t *cairo, nmm_vec2 tip, double dx, double dy, double size,
                         bool roller) {
    const double bx = tip.x - dx * size, by = tip.y - dy * size;
    const double wx = -dy * size * 0.55, wy = dx * size * 0.55;
    cairo_move_to(cairo, tip.x, tip.y);
    cairo_line_to(cairo, bx + wx, by + wy);
    cairo_line_to(cairo, bx - wx, by - wy);
    cairo_close_path(cairo);
    cairo_set_line_width(cairo, 0.12 * size);
    if (roller)
        cairo_set_source_rgb(cairo, 1, 1, 1);
    else
        set_colour(cairo, support_colour);
    cairo_fill_preserve(cairo);
    set_colour(cairo, support_colour);
    cairo_stroke(cairo);
    if (!roller) return;
    cairo_move_to(cairo, bx + wx - dx * size * 0.22, by + wy - dy * size * 0.22);
    cairo_line_to(cairo, bx - wx - dx * size * 0.22, by - wy - dy * size * 0.22);
    cairo_stroke(cairo);
}

// Distance of (x, y) from the segment a b.
static double segment_distance(const double *a, const double *b, double x, double y) {
    const double dx = b[0] - a[0], dy = b[1] - a[1], length = dx * dx + dy * dy;
    double t = length > 0 ? ((x - a[0]) * dx + (y - a[1]) * dy) / length : 0;
    t = nmm_min(1, nmm_max(0, t));
    return hypot(x - a[0] - t * dx, y - a[1] - t * dy);
}

// Direction from outside onto the boundary at a support (page, y down): of the edges it lies on
// the one whose direction is most like `like` (an axis: either way); (0, 0) away from all edges.
static nmm_vec2 inward_normal(const nmm_picture *picture, const nmm_support_row *s, nmm_vec2 like) {
    const nmm_file_geometry *g = picture->geometry;
    const double reach = 4 * picture->unit / picture->ratio;
    nmm_vec2 best = {0, 0};
    double agreement = -INFINITY;
    for (int i = 0; i < g->n_edge; i++) {
        const double *a = g->point + 2 * (long)g->edge_point[2 * i];
        const double *b = g->point + 2 * (long)g->edge_point[2 * i + 1];
        if (g->edge_block[i] != s->block || g->edge_mate[i] >= 0) continue;
        if (segment_distance(a, b, s->x, s->y) > reach) continue;
        const double length = hypot(b[0] - a[0], b[1] - a[1]);
        if (!(length > 0)) continue;
        // The block lies to the left of the edge; page y points down.
        const nmm_vec2 inward = {-(b[1] - a[1]) / length, -(b[0] - a[0]) / length};
        const double agrees = like.x == 0   ? fabs(inward.y)
                              : like.y == 0 ? fabs(inward.x)
                                            : nmm_vec2_dot(inward, like);
        if (agrees > agreement + 1e-9) {
            agreement = agrees;
            best = inward;
        }
    }
    return best;
}

static nmm_vec2 support_direction(const nmm_picture *picture, const nmm_support_row *s,
                                  nmm_vec2 like) {
    const nmm_vec2 prefer = s->fix_y && !s->fix_x   ? (nmm_vec2){0, -1}
                            : s->fix_x && !s->fix_y ? (nmm_vec2){like.x < 0 ? -1 : 1, 0}
                                                    : like;
    const nmm_vec2 inward = inward_normal(picture, s, prefer);
    // A roller stands along the direction it holds.
    if (s->fix_y && !s->fix_x) return (nmm_vec2){0, inward.y > 0.1 ? 1 : -1};
    if (s->fix_x && !s->fix_y) return (nmm_vec2){inward.x < -0.1 ? -1 : 1, 0};
    return inward.x == 0 && inward.y == 0 ? (nmm_vec2){0, -1} : inward;
}

// What was drawn so far, to keep marks apart.
enum { MOST_DRAWN = 400 };
typedef struct placed_marks {
    int n;
    nmm_vec2 place[MOST_DRAWN];
    int kind[MOST_DRAWN];
} placed_marks;

static bool has_room(placed_marks *drawn, nmm_vec2 at, int kind, double apart) {
    for (int i = 0; i < drawn->n; i++) {
        const double off = hypot(at.x - drawn->place[i].x, at.y - drawn->place[i].y);
        if (off < (drawn->kind[i] == kind ? apart : 0.1 * apart)) return false;
    }
    if (drawn->n == MOST_DRAWN) return false;
    drawn->kind[drawn->n] = kind;
    drawn->place[drawn->n++] = at;
    return true;
}

// Many supports of a line stand for themselves at some distance only.
static void draw_supports(const nmm_picture *picture) {
    const nmm_file_geometry *g = picture->geometry;
    const double size = 19 * picture->unit, apart = 30 * picture->unit;
    nmm_vec2 like = {0, -1};
    placed_marks drawn = {.n = 0};
    for (int i = 0; i < g->n_support; i++) {
        const nmm_support_row *s = &g->support[i];
        const int kind = (s->fix_x != 0) + 2 * (s->fix_y != 0);
        if (s->held || kind == 0) continue;
        const nmm_vec2 at = nmm_moved_place(picture, s->element, s->x, s->y);
        if (!has_room(&drawn, at, kind, apart)) continue;
        like = support_direction(picture, s, like);
        draw_support(picture->cairo, at, like.x, like.y, size, kind != 3);
    }
}

// Blocks held as a whole are hatched.
static void draw_held(const nmm_picture *picture) {
    const nmm_file_geometry *g = picture->geometry;
    const nmm_rect plot = picture->plot;
    cairo_t *cairo = picture->cairo;
    bool any = false;
    cairo_save(cairo);
    for (int i = 0; i < g->n_support; i++) {
        if (!g->support[i].held) continue;
        any = true;
        for (int e = 0; e < g->n_element; e++) {
            if (g->element_block[e] != g->support[i].block) continue;
            for (int k = g->element_start[e]; k < g->element_start[e + 1]; k++) {
                const double *p = picture->page + 2 * (long)g->corner_point[k];
                if (k == g->element_start[e])
                    cairo_move_to(cairo, p[0], p[1]);
                else
                    cairo_line_to(cairo, p[0], p[1]);
            }
            cairo_close_path(cairo);
        }
    }
    cairo_clip(cairo);
    const double step = 16 * picture->unit;
    for (double x = -plot.height; any && x < plot.width; x += step) {
        cairo_move_to(cairo, plot.x + x, plot.y + plot.height);
        cairo_line_to(cairo, plot.x + x + plot.height, plot.y);
    }
    nmm_draw_cased(cairo, support_colour, 1.6 * picture->unit, 0.7 * picture->unit);
    cairo_restore(cairo);
}

void nmm_draw_marks(const nmm_picture *picture) {
    draw_held(picture);
    if (picture->n_open > 0) draw_joints(picture, NMM_EDGE_OPEN, open_colour);
    if (picture->n_slid > 0) draw_joints(picture, NMM_EDGE_SLID, slid_colour);
    draw_forces(picture);
    draw_supports(picture);
    nmm_draw_loads(picture);
}

// --- Legend

typedef enum symbol { FORCE, OPEN, SLID, SUPPORT, HELD, LOAD, TRACTION } symbol;

static void draw_symbol(const nmm_picture *picture, symbol kind, double x, double y) {
    cairo_t *cairo = picture->cairo;
    const double u = picture->unit;
    cairo_move_to(cairo, x, y);
    cairo_line_to(cairo, x + 44 * u, y);
    switch (kind) {
    case FORCE:
        nmm_draw_cased(cairo, force_colour, 6 * u, 0);
        return;
    case OPEN:
        nmm_draw_cased(cairo, open_colour, 4 * u, 0);
        return;
    case SLID:
        nmm_draw_cased(cairo, slid_colour, 4 * u, 0);
        return;
    case SUPPORT:
        cairo_new_path(cairo);
        draw_support(cairo, (nmm_vec2){x + 22 * u, y - 10 * u}, 0, -1, 19 * u, false);
        return;
    case HELD:
        cairo_new_path(cairo);
        set_colour(cairo, support_colour);
        cairo_set_line_width(cairo, 1.6 * u);
        cairo_rectangle(cairo, x + 4 * u, y - 12 * u, 36 * u, 24 * u);
        for (int i = 0; i < 3; i++) {
            cairo_move_to(cairo, x + (4 + 12 * i) * u, y + 12 * u);
            cairo_line_to(cairo, x + (4 + 12 * i + 12) * u, y - 12 * u);
        }
        cairo_stroke(cairo);
        return;
    case LOAD:
        cairo_new_path(cairo);
        nmm_draw_arrow(cairo, (nmm_vec2){x + 44 * u, y}, (nmm_vec2){1, 0}, 40 * u,
                       nmm_load_width(NMM_LOAD_FORCE) * u);
        return;
    case TRACTION:
        cairo_new_path(cairo);
        for (int i = 0; i < 3; i++) {
            nmm_draw_arrow(cairo, (nmm_vec2){x + (6 + 16 * i) * u, y + 13 * u}, (nmm_vec2){0, 1},
                           26 * u, nmm_load_width(NMM_LOAD_TRACTION) * u);
        }
        return;
    }
}

// "contact force (largest 12.2 kN)".
static void amount_text(char text[96], const char *what, double amount, const char *unit) {
    const double factor = amount >= 1e9 ? 1e9 : amount >= 1e6 ? 1e6 : amount >= 1e3 ? 1e3 : 1;
    const char *prefix = factor == 1e9 ? "G" : factor == 1e6 ? "M" : factor == 1e3 ? "k" : "";
    char number[32];
    const double rounded = amount / factor;
    nmm_tick_text(number, rounded, rounded >= 100 ? 1 : rounded >= 10 ? 0.1 : 0.01);
    snprintf(text, 96, "%s %s %s%s)", what, number, prefix, unit);
}

// Where loads of one place were added up, the largest is a sum.
static bool load_text(const nmm_picture *picture, nmm_load_kind kind, char text[96]) {
    const char *const what[2][2] = {
        [NMM_LOAD_TRACTION] = {"traction (largest", "traction (largest sum"},
        [NMM_LOAD_FORCE] = {"load (largest", "load (largest sum at a point"}};
    const double largest = picture->load_largest[kind];
    amount_text(text, what[kind][picture->load_summed[kind]], largest,
                kind == NMM_LOAD_FORCE ? "N" : "Pa");
    return largest > 0;
}

// Is there an entry for the symbol? Then its text.
static bool legend_text(const nmm_picture *picture, symbol kind, char text[96]) {
    const nmm_file_geometry *g = picture->geometry;
    int held = 0;
    for (int i = 0; i < g->n_support; i++)
        held += g->support[i].held != 0;
    switch (kind) {
    case FORCE:
        amount_text(text, "contact force (largest", picture->force_most, "N");
        return picture->force_most > 0;
    case OPEN:
        snprintf(text, 96, "open joint");
        return picture->n_open > 0;
    case SLID:
        snprintf(text, 96, "slid contact");
        return picture->n_slid > 0;
    case SUPPORT:
        snprintf(text, 96, "support");
        return g->n_support > held;
    case HELD:
        snprintf(text, 96, "held block");
        return held > 0;
    case LOAD:
        return load_text(picture, NMM_LOAD_FORCE, text);
    case TRACTION:
        return load_text(picture, NMM_LOAD_TRACTION, text);
    }
    return false;
}

int nmm_draw_legend(const nmm_picture *picture, bool draw) {
    const double u = picture->unit, line = 40 * u;
    const nmm_rect room = picture->legend;
    double x = room.x;
    int lines = 0;
    char text[96];
    for (int i = FORCE; i <= TRACTION; i++) {
        if (!legend_text(picture, (enum symbol)i, text)) continue;
        const double width = 56 * u + nmm_text_width(picture->cairo, text, 24 * u, false) + 40 * u;
        if (lines == 0) lines = 1;
        if (x > room.x && x + width - 40 * u > room.x + room.width) {
            x = room.x;
            lines += 1;
        }
        const double y = room.y + (lines - 1) * line + line / 2;
        if (draw) {
            draw_symbol(picture, (enum symbol)i, x, y);
            set_colour(picture->cairo, ink);
            nmm_draw_text(picture->cairo, x + 56 * u, y, text,
                          (nmm_text_style){.size = 24 * u, .across = -1, .up = 1});
        }
        x += width;
    }
    return lines;
}
