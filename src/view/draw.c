// SPDX-License-Identifier: MIT
//
// The page itself: blocks with their field and outlines, axes, colour bar, titles.

#include "view.h"

#include <math.h>
#include <string.h>

// Beyond this many elements their edges are not drawn, and colours are flat inside an element.
enum { MOST_EDGES = 6000, MOST_SLOPES = 20000 };

static const nmm_colour ink = {0.13, 0.13, 0.15};

static void set_colour(cairo_t *cairo, nmm_colour colour) {
    cairo_set_source_rgb(cairo, colour.r, colour.g, colour.b);
}

// --- Text

static void select_font(cairo_t *cairo, double size, bool bold) {
    cairo_select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo, size);
}

double nmm_text_width(cairo_t *cairo, const char *text, double size, bool bold) {
    cairo_text_extents_t extents;
    select_font(cairo, size, bold);
    cairo_text_extents(cairo, text, &extents);
    return extents.x_advance;
}

void nmm_draw_text(cairo_t *cairo, double x, double y, const char *text, nmm_text_style style) {
    const double width = nmm_text_width(cairo, text, style.size, style.bold);
    // The height of a digit, so that rows of numbers stand on one line.
    const double down = style.up == 2 ? 0.73 * style.size : style.up == 1 ? 0.36 * style.size : 0;
    cairo_save(cairo);
    cairo_translate(cairo, x, y);
    if (style.upright) cairo_rotate(cairo, -1.5707963267948966);
    cairo_move_to(cairo, -width * (style.across + 1) / 2, down);
    cairo_show_text(cairo, text);
    cairo_restore(cairo);
}

// --- Blocks

static void trace_element(const nmm_picture *picture, int e) {
    const nmm_file_geometry *g = picture->geometry;
    const int begin = g->element_start[e], end = g->element_start[e + 1];
    for (int k = begin; k < end; k++) {
        const double *p = picture->page + 2 * (long)g->corner_point[k];
        if (k == begin)
            cairo_move_to(picture->cairo, p[0], p[1]);
        else
            cairo_line_to(picture->cairo, p[0], p[1]);
    }
    cairo_close_path(picture->cairo);
}

static nmm_colour colour_of(const nmm_shade *shade, double value) {
    if (shade->colours == NMM_COLOURS_BLOCKS) return nmm_colour_at(shade->colours, value);
    const double span = shade->full_high - shade->full_low;
    const double inside = nmm_min(shade->high, nmm_max(shade->low, value));
    return nmm_colour_at(shade->colours, span > 0 ? (inside - shade->full_low) / span : 0.5);
}

// A field that changes linearly inside the element, as a gradient between its corners; NULL where
// one colour does.
static cairo_pattern_t *slope_pattern(const nmm_picture *picture, int e) {
    const nmm_file_geometry *g = picture->geometry;
    const nmm_shade *shade = &picture->shade;
    if (shade->slope == NULL || g->n_element > MOST_SLOPES) return NULL;
    const double *slope = shade->slope + 2 * (long)e;
    const double steep = slope[0] * slope[0] + slope[1] * slope[1];
    const int begin = g->element_start[e], end = g->element_start[e + 1];
    double mx = 0, my = 0, low = 0, high = 0;
    for (int k = begin; k < end; k++) {
        mx += picture->page[2 * (long)g->corner_point[k]] / (end - begin);
        my += picture->page[2 * (long)g->corner_point[k] + 1] / (end - begin);
    }
    for (int k = begin; k < end; k++) {
        const double *p = picture->page + 2 * (long)g->corner_point[k];
        const double rise = slope[0] * (p[0] - mx) + slope[1] * (p[1] - my);
        low = nmm_min(low, rise);
        high = nmm_max(high, rise);
    }
    if (!(high - low > (shade->high - shade->low) / 256) || !(steep > 0)) return NULL;
    cairo_pattern_t *pattern =
        cairo_pattern_create_linear(mx + slope[0] * low / steep, my + slope[1] * low / steep,
                                    mx + slope[0] * high / steep, my + slope[1] * high / steep);
    const int parts = nmm_max_int(1, (int)(16 * (high - low) / (shade->high - shade->low)));
    for (int i = 0; i <= nmm_min_int(parts, 32); i++) {
        const double t = (double)i / nmm_min_int(parts, 32);
        const nmm_colour c = colour_of(shade, shade->value[e] + low + t * (high - low));
        cairo_pattern_add_color_stop_rgb(pattern, t, c.r, c.g, c.b);
    }
    return pattern;
}

// Neighbours are drawn a hair too wide, or the white between them would show.
static void fill_elements(const nmm_picture *picture) {
    cairo_t *cairo = picture->cairo;
    cairo_set_line_width(cairo, 0.8 * picture->unit);
    for (int e = 0; e < picture->geometry->n_element; e++) {
        cairo_pattern_t *pattern = slope_pattern(picture, e);
        if (pattern != NULL)
            cairo_set_source(cairo, pattern);
        else
            set_colour(cairo, colour_of(&picture->shade, picture->shade.value[e]));
        trace_element(picture, e);
        cairo_fill_preserve(cairo);
        cairo_stroke(cairo);
        if (pattern != NULL) cairo_pattern_destroy(pattern);
    }
}

// Faint, and only where elements are large enough to be told apart: on the page, and in pixels
// (about 8 across).
static void draw_element_edges(const nmm_picture *picture) {
    const int n = picture->geometry->n_element;
    const double area = picture->plot.width * picture->plot.height / nmm_max_int(n, 1);
    if (n > MOST_EDGES || area < nmm_max(150 * picture->unit * picture->unit, 32)) return;
    cairo_set_source_rgba(picture->cairo, 0, 0, 0, 0.16);
    cairo_set_line_width(picture->cairo, 0.9 * picture->unit);
    for (int e = 0; e < n; e++)
        trace_element(picture, e);
    cairo_stroke(picture->cairo);
}

void nmm_draw_blocks(const nmm_picture *picture) {
    const nmm_file_geometry *g = picture->geometry;
    cairo_t *cairo = picture->cairo;
    cairo_set_line_join(cairo, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_cap(cairo, CAIRO_LINE_CAP_ROUND);
    fill_elements(picture);
    draw_element_edges(picture);
    // Outlines get thinner where blocks are many.
    const double crowd = g->n_block > 400 ? 1.2 : g->n_block > 60 ? 1.6 : 2.2;
    cairo_set_line_width(cairo, crowd * picture->unit);
    set_colour(cairo, ink);
    for (int i = 0; i < g->n_edge; i++) {
        const double *a = picture->page + 2 * (long)g->edge_point[2 * i];
        const double *b = picture->page + 2 * (long)g->edge_point[2 * i + 1];
        cairo_move_to(cairo, a[0], a[1]);
        cairo_line_to(cairo, b[0], b[1]);
    }
    cairo_stroke(cairo);
}

// --- Axes

static void draw_line(cairo_t *cairo, double x0, double y0, double x1, double y1) {
    cairo_move_to(cairo, x0, y0);
    cairo_line_to(cairo, x1, y1);
    cairo_stroke(cairo);
}

static void draw_axes(const nmm_picture *picture) {
    cairo_t *cairo = picture->cairo;
    const nmm_rect plot = picture->plot;
    const double u = picture->unit, bottom = plot.y + plot.height;
    char text[32];
    set_colour(cairo, ink);
    cairo_set_line_width(cairo, 1.5 * u);
    cairo_rectangle(cairo, plot.x, plot.y, plot.width, plot.height);
    cairo_stroke(cairo);
    const nmm_text_style below = {.size = 24 * u, .across = 0, .up = 2};
    for (int i = 0; i < picture->tick_x.n; i++) {
        const double value = picture->tick_x.first + i * picture->tick_x.step;
        const double x = nmm_layout_place(picture, value, 0).x;
        draw_line(cairo, x, bottom, x, bottom + 8 * u);
        nmm_tick_text(text, value, picture->tick_x.step);
        nmm_draw_text(cairo, x, bottom + 14 * u, text, below);
    }
    const nmm_text_style left = {.size = 24 * u, .across = 1, .up = 1};
    double widest = 0;
    for (int i = 0; i < picture->tick_y.n; i++) {
        const double value = picture->tick_y.first + i * picture->tick_y.step;
        const double y = nmm_layout_place(picture, 0, value).y;
        draw_line(cairo, plot.x, y, plot.x - 8 * u, y);
        nmm_tick_text(text, value, picture->tick_y.step);
        nmm_draw_text(cairo, plot.x - 14 * u, y, text, left);
        widest = nmm_max(widest, nmm_text_width(cairo, text, 24 * u, false));
    }
    const nmm_text_style label = {.size = 26 * u, .across = 0, .up = 2};
    nmm_draw_text(cairo, plot.x + plot.width / 2, bottom + 44 * u, "x [m]", label);
    const nmm_text_style side = {.size = 26 * u, .across = 0, .up = 0, .upright = true};
    nmm_draw_text(cairo, plot.x - 30 * u - widest, plot.y + plot.height / 2, "y [m]", side);
}

// --- Colour bar

// Thin strips: a gradient would not follow the colour list exactly in every program.
static void fill_bar(const nmm_picture *picture) {
    enum { STRIPS = 256 };
    const nmm_shade *shade = &picture->shade;
    const nmm_rect bar = picture->bar;
    cairo_t *cairo = picture->cairo;
    for (int i = 0; i < STRIPS; i++) {
        const double t = (i + 0.5) / STRIPS;
        set_colour(cairo, colour_of(shade, shade->low + t * (shade->high - shade->low)));
        // Each strip reaches under the next, so that no line shows between them.
        const double more = i + 1 < STRIPS ? 2 : 1;
        if (picture->bar_upright) {
            const double step = bar.height / STRIPS;
            cairo_rectangle(cairo, bar.x, bar.y + bar.height - (i + more) * step, bar.width,
                            more * step);
        } else {
            const double step = bar.width / STRIPS;
            cairo_rectangle(cairo, bar.x + i * step, bar.y, more * step, bar.height);
        }
        cairo_fill(cairo);
    }
}

// A pointed end says that values lie beyond.
static void draw_point(const nmm_picture *picture, bool above) {
    const nmm_rect bar = picture->bar;
    const nmm_shade *shade = &picture->shade;
    cairo_t *cairo = picture->cairo;
    const double tip = 26 * picture->unit;
    if (picture->bar_upright) {
        const double y = above ? bar.y : bar.y + bar.height;
        cairo_move_to(cairo, bar.x, y);
        cairo_line_to(cairo, bar.x + bar.width / 2, above ? y - tip : y + tip);
        cairo_line_to(cairo, bar.x + bar.width, y);
    } else {
        const double x = above ? bar.x + bar.width : bar.x;
        cairo_move_to(cairo, x, bar.y);
        cairo_line_to(cairo, above ? x + tip : x - tip, bar.y + bar.height / 2);
        cairo_line_to(cairo, x, bar.y + bar.height);
    }
    cairo_close_path(cairo);
    set_colour(cairo, colour_of(shade, above ? shade->high : shade->low));
    cairo_fill_preserve(cairo);
    set_colour(cairo, ink);
    cairo_stroke(cairo);
}

static void draw_bar_ticks(const nmm_picture *picture) {
    const nmm_shade *shade = &picture->shade;
    const nmm_rect bar = picture->bar;
    const nmm_ticks ticks = picture->tick_bar;
    cairo_t *cairo = picture->cairo;
    const double u = picture->unit, low = shade->low / shade->factor;
    const double span = shade->high / shade->factor - low;
    char text[32];
    for (int i = 0; i < ticks.n; i++) {
        const double value = ticks.first + i * ticks.step, t = (value - low) / span;
        nmm_tick_text(text, value, ticks.step);
        if (picture->bar_upright) {
            const double x = bar.x + bar.width, y = bar.y + bar.height * (1 - t);
            draw_line(cairo, x, y, x + 7 * u, y);
            nmm_draw_text(cairo, x + 14 * u, y, text,
                          (nmm_text_style){.size = 24 * u, .across = -1, .up = 1});
        } else {
            const double x = bar.x + bar.width * t, y = bar.y + bar.height;
            draw_line(cairo, x, y, x, y + 7 * u);
            nmm_draw_text(cairo, x, y + 12 * u, text, (nmm_text_style){.size = 24 * u, .up = 2});
        }
    }
}

static double widest_bar_tick(const nmm_picture *picture) {
    double most = 0;
    char text[32];
    for (int i = 0; i < picture->tick_bar.n; i++) {
        nmm_tick_text(text, picture->tick_bar.first + i * picture->tick_bar.step,
                      picture->tick_bar.step);
        most = nmm_max(most, nmm_text_width(picture->cairo, text, 24 * picture->unit, false));
    }
    return most;
}

static void draw_bar(const nmm_picture *picture) {
    const nmm_shade *shade = &picture->shade;
    const nmm_rect bar = picture->bar;
    cairo_t *cairo = picture->cairo;
    const double u = picture->unit;
    char label[96];
    if (shade->colours == NMM_COLOURS_BLOCKS) return;
    fill_bar(picture);
    cairo_set_line_width(cairo, 1.5 * u);
    if (shade->below) draw_point(picture, false);
    if (shade->above) draw_point(picture, true);
    set_colour(cairo, ink);
    cairo_rectangle(cairo, bar.x, bar.y, bar.width, bar.height);
    cairo_stroke(cairo);
    draw_bar_ticks(picture);
    snprintf(label, sizeof label, "%s [%s]", shade->title, shade->unit);
    if (picture->bar_upright) {
        const double x = bar.x + bar.width + (14 + 16) * u + widest_bar_tick(picture);
        nmm_draw_text(cairo, x, bar.y + bar.height / 2, label,
                      (nmm_text_style){.size = 26 * u, .up = 2, .upright = true});
    } else {
        nmm_draw_text(cairo, bar.x + bar.width / 2, bar.y + bar.height + 44 * u, label,
                      (nmm_text_style){.size = 26 * u, .up = 2});
    }
}

// --- Titles

// Smaller down to 70 %, then cut.
static void draw_title(const nmm_picture *picture, const char *text, double y, double size,
                       bool bold) {
    const double room = picture->width - 56 * picture->unit;
    char cut[260];
    snprintf(cut, sizeof cut, "%s", text);
    double width = nmm_text_width(picture->cairo, cut, size, bold);
    if (width > room) size = nmm_max(0.7 * size, size * room / width);
    for (size_t n = strlen(cut); n > 4; n--) {
        if (nmm_text_width(picture->cairo, cut, size, bold) <= room) break;
        // Whole UTF-8 characters go, an ellipsis comes.
        while (n > 4 && ((unsigned char)cut[n - 4] & 0xc0) == 0x80)
            n -= 1;
        memcpy(cut + n - 4, "\xe2\x80\xa6", 4);
    }
    width = nmm_text_width(picture->cairo, cut, size, bold);
    // Above the plot's left edge where there is room, else in the middle of the page.
    double x = picture->plot.x;
    if (x + width > picture->width - 28 * picture->unit) x = (picture->width - width) / 2;
    nmm_draw_text(picture->cairo, x, y, cut,
                  (nmm_text_style){.size = size, .bold = bold, .across = -1});
}

void nmm_draw_page(nmm_picture *picture) {
    cairo_t *cairo = picture->cairo;
    const double u = picture->unit;
    cairo_set_source_rgb(cairo, 1, 1, 1);
    cairo_paint(cairo);
    cairo_save(cairo);
    cairo_rectangle(cairo, picture->plot.x, picture->plot.y, picture->plot.width,
                    picture->plot.height);
    cairo_clip(cairo);
    nmm_draw_blocks(picture);
    nmm_draw_marks(picture);
    cairo_restore(cairo);
    draw_axes(picture);
    draw_bar(picture);
    set_colour(cairo, ink);
    draw_title(picture, picture->title, (28 + 27) * u, 34 * u, true);
    draw_title(picture, picture->subtitle, (28 + 34 + 14 + 20) * u, 25 * u, false);
    nmm_draw_legend(picture, true);
}
