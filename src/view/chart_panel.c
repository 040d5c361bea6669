// SPDX-License-Identifier: MIT
//
// Content of a chart's panel: axes with grid, curves, levels, bars, and the legend.
//
// Each curve has a colour and a mark of its own, so that it can be told in grey print too.

#include "chart_draw.h"

#include <math.h>

enum { BAR = 24, BETWEEN_CATEGORIES = 16 };

static const nmm_colour ink = {0.13, 0.13, 0.15};

static void set_colour(cairo_t *cairo, nmm_colour colour) {
    cairo_set_source_rgb(cairo, colour.r, colour.g, colour.b);
}

void nmm_chart_colour(cairo_t *cairo, int k) {
    // Told apart with the common forms of colour blindness (after Okabe and Ito, and Tol).
    static const nmm_colour list[] = {{0.00, 0.40, 0.70}, {0.84, 0.37, 0.00}, {0.00, 0.56, 0.42},
                                      {0.75, 0.20, 0.45}, {0.45, 0.33, 0.72}, {0.55, 0.42, 0.10},
                                      {0.30, 0.62, 0.85}, {0.35, 0.37, 0.40}};
    set_colour(cairo, list[k % 8]);
}

static void line(cairo_t *cairo, double x0, double y0, double x1, double y1) {
    cairo_move_to(cairo, x0, y0);
    cairo_line_to(cairo, x1, y1);
    cairo_stroke(cairo);
}

static double place_x(const nmm_chart_view *view, double value) {
    return view->plot.x + view->plot.width * nmm_chart_part(view->x, value);
}

static double place_y(const nmm_chart_view *view, double value) {
    return view->plot.y + view->plot.height * (1 - nmm_chart_part(view->y, value));
}

// --- Axes

static int ticks_x(const nmm_chart_view *view, nmm_chart_tick *tick) {
    return nmm_chart_ticks(view->x, nmm_max_int(2, (int)(view->plot.width / (130 * view->unit))),
                           tick);
}

static int ticks_y(const nmm_chart_view *view, nmm_chart_tick *tick) {
    return nmm_chart_ticks(view->y, nmm_max_int(2, (int)(view->plot.height / (60 * view->unit))),
                           tick);
}

static void grid_line(const nmm_chart_view *view, bool strong, nmm_vec2 a, nmm_vec2 b) {
    cairo_set_source_rgba(view->cairo, 0, 0, 0, strong ? 0.16 : 0.06);
    cairo_set_line_width(view->cairo, view->unit);
    line(view->cairo, a.x, a.y, b.x, b.y);
}

static void draw_axis_x(const nmm_chart_view *view) {
    nmm_chart_tick tick[NMM_MOST_TICK];
    const nmm_rect plot = view->plot;
    const double u = view->unit, bottom = plot.y + plot.height;
    const int n = ticks_x(view, tick);
    for (int i = 0; i < n; i++) {
        const double x = place_x(view, tick[i].value);
        grid_line(view, tick[i].text[0] != 0, (nmm_vec2){x, plot.y}, (nmm_vec2){x, bottom});
        set_colour(view->cairo, ink);
        cairo_set_line_width(view->cairo, 1.5 * u);
        line(view->cairo, x, bottom, x, bottom + (tick[i].text[0] != 0 ? 8 : 4) * u);
        nmm_draw_text(view->cairo, x, bottom + 13 * u, tick[i].text,
                      (nmm_text_style){.size = NMM_CHART_TICK * u, .up = 2});
    }
    set_colour(view->cairo, ink);
    nmm_draw_text(view->cairo, plot.x + plot.width / 2, bottom + 42 * u, view->panel->x.title,
                  (nmm_text_style){.size = NMM_CHART_LABEL * u, .up = 2});
}

static void draw_axis_y(const nmm_chart_view *view) {
    nmm_chart_tick tick[NMM_MOST_TICK];
    const nmm_rect plot = view->plot;
    const double u = view->unit;
    const int n = ticks_y(view, tick);
    for (int i = 0; i < n; i++) {
        const double y = place_y(view, tick[i].value);
        grid_line(view, tick[i].text[0] != 0, (nmm_vec2){plot.x, y},
                  (nmm_vec2){plot.x + plot.width, y});
        set_colour(view->cairo, ink);
        cairo_set_line_width(view->cairo, 1.5 * u);
        line(view->cairo, plot.x, y, plot.x - (tick[i].text[0] != 0 ? 8 : 4) * u, y);
        nmm_draw_text(view->cairo, plot.x - 13 * u, y, tick[i].text,
                      (nmm_text_style){.size = NMM_CHART_TICK * u, .across = 1, .up = 1});
    }
    set_colour(view->cairo, ink);
    nmm_draw_text(view->cairo, view->room.x + (NMM_CHART_LABEL + 2) * u, plot.y + plot.height / 2,
                  view->panel->y.title,
                  (nmm_text_style){.size = NMM_CHART_LABEL * u, .upright = true});
}

static void draw_frame(const nmm_chart_view *view) {
    set_colour(view->cairo, ink);
    cairo_set_line_width(view->cairo, 1.5 * view->unit);
    cairo_rectangle(view->cairo, view->plot.x, view->plot.y, view->plot.width, view->plot.height);
    cairo_stroke(view->cairo);
}

// --- Curves

static void draw_mark(cairo_t *cairo, int k, double x, double y, double size) {
    const double s = size;
    cairo_new_path(cairo);
    switch (k % 4) {
    case 0:
        cairo_arc(cairo, x, y, s, 0, 6.283185307179586);
        break;
    case 1:
        cairo_rectangle(cairo, x - 0.9 * s, y - 0.9 * s, 1.8 * s, 1.8 * s);
        break;
    case 2:
        cairo_move_to(cairo, x, y - 1.2 * s);
        cairo_line_to(cairo, x + 1.1 * s, y + 0.9 * s);
        cairo_line_to(cairo, x - 1.1 * s, y + 0.9 * s);
        break;
    default:
        cairo_move_to(cairo, x, y - 1.3 * s);
        cairo_line_to(cairo, x + 1.3 * s, y);
        cairo_line_to(cairo, x, y + 1.3 * s);
        cairo_line_to(cairo, x - 1.3 * s, y);
        break;
    }
    cairo_close_path(cairo);
    cairo_fill(cairo);
}

static void set_stroke(const nmm_chart_view *view, nmm_chart_style style, int colour) {
    const double u = view->unit, dash[2] = {10 * u, 8 * u};
    cairo_set_line_join(view->cairo, CAIRO_LINE_JOIN_ROUND);
    cairo_set_dash(view->cairo, dash, style == NMM_CHART_SLOPE ? 2 : 0, 0);
    cairo_set_line_width(view->cairo, (style == NMM_CHART_SLOPE ? 1.6 : 3) * u);
    if (style == NMM_CHART_SLOPE)
        cairo_set_source_rgb(view->cairo, 0.5, 0.5, 0.52);
    else
        nmm_chart_colour(view->cairo, colour);
}

// Points that have no place interrupt the line.
static void draw_series(const nmm_chart_view *view, const nmm_chart_series *s, int colour) {
    set_stroke(view, s->style, colour);
    bool on_line = false;
    for (int i = 0; i < s->n && s->style != NMM_CHART_MARKS; i++) {
        const double x = place_x(view, s->x[i]), y = place_y(view, s->y[i]);
        const bool placed = isfinite(x) && isfinite(y) && fabs(x) < 1e6 && fabs(y) < 1e6;
        if (placed && on_line) cairo_line_to(view->cairo, x, y);
        if (placed && !on_line) cairo_move_to(view->cairo, x, y);
        on_line = placed;
    }
    cairo_stroke(view->cairo);
    cairo_set_dash(view->cairo, NULL, 0, 0);
    if (s->style != NMM_CHART_LINE && s->style != NMM_CHART_MARKS) return;
    for (int i = 0; i < s->n; i++) {
        const double x = place_x(view, s->x[i]), y = place_y(view, s->y[i]);
        if (isfinite(x) && isfinite(y) && fabs(x) < 1e6 && fabs(y) < 1e6)
            draw_mark(view->cairo, colour, x, y, 6.5 * view->unit);
    }
}

// Marks and corners of curves within a part of the page.
static int points_within(const nmm_chart_view *view, nmm_rect part) {
    int n = 0;
    for (int k = 0; k < view->panel->n_series; k++) {
        const nmm_chart_series *s = &view->panel->series[k];
        for (int i = 0; i < s->n; i++) {
            const double x = place_x(view, s->x[i]), y = place_y(view, s->y[i]);
            const bool across = x >= part.x && x <= part.x + part.width;
            n += across && y >= part.y && y <= part.y + part.height;
        }
    }
    return n;
}

bool nmm_chart_level_left(const nmm_chart_view *view, const nmm_chart_level *level) {
    // The name over its line with room for marks around it, at the right end and at the left one.
    const double u = view->unit;
    const double width = nmm_text_width(view->cairo, level->name, 20 * u, false) + 20 * u;
    nmm_rect part = {view->plot.x + view->plot.width - width, place_y(view, level->y) - 32 * u,
                     width, 36 * u};
    const int right = points_within(view, part);
    part.x = view->plot.x;
    return right > points_within(view, part);
}

static void draw_levels(const nmm_chart_view *view) {
    const double u = view->unit;
    for (int i = 0; i < view->panel->n_level; i++) {
        const nmm_chart_level *level = &view->panel->level[i];
        const double y = place_y(view, level->y);
        set_stroke(view, NMM_CHART_SLOPE, 0);
        line(view->cairo, view->plot.x, y, view->plot.x + view->plot.width, y);
        cairo_set_dash(view->cairo, NULL, 0, 0);
        cairo_set_source_rgb(view->cairo, 0.3, 0.3, 0.32);
        const bool left = nmm_chart_level_left(view, level);
        const double x = left ? view->plot.x + 8 * u : view->plot.x + view->plot.width - 8 * u;
        nmm_draw_text(view->cairo, x, y - 7 * u, level->name,
                      (nmm_text_style){.size = 20 * u, .across = left ? -1 : 1});
    }
}

void nmm_chart_draw_curves(const nmm_chart_view *view) {
    draw_axis_x(view);
    draw_axis_y(view);
    cairo_save(view->cairo);
    cairo_rectangle(view->cairo, view->plot.x, view->plot.y, view->plot.width, view->plot.height);
    cairo_clip(view->cairo);
    cairo_new_path(view->cairo);
    draw_levels(view);
    int colour = 0;
    for (int k = 0; k < view->panel->n_series; k++) {
        const nmm_chart_series *s = &view->panel->series[k];
        draw_series(view, s, colour);
        colour += s->style != NMM_CHART_SLOPE;
    }
    cairo_restore(view->cairo);
    draw_frame(view);
}

// --- Bars

static double category_height(const nmm_chart_bars *bars) {
    return bars->n_bar * BAR + BETWEEN_CATEGORIES;
}

// Where bars begin, across.
static double bar_start(const nmm_chart_view *view) {
    return place_x(view, view->x.log ? pow(10, view->x.low) : 0);
}

static double bar_top(const nmm_chart_view *view, int category, int bar) {
    const double above = category * category_height(view->panel->bars) + BETWEEN_CATEGORIES / 2.0;
    return view->plot.y + (above + bar * BAR) * view->unit;
}

static void draw_bar(const nmm_chart_view *view, const double *value, double top, int colour) {
    const nmm_chart_bars *bars = view->panel->bars;
    double sum = 0, from = bar_start(view);
    for (int part = 0; part < bars->n_part; part++) {
        if (!isfinite(value[part]) || value[part] <= 0) continue;
        sum += value[part];
        const double to = place_x(view, sum);
        nmm_chart_colour(view->cairo, bars->part != NULL ? part : colour);
        cairo_rectangle(view->cairo, from, top, nmm_max(0, to - from), (BAR - 4) * view->unit);
        cairo_fill(view->cairo);
        from = to;
    }
}

// The value behind a bar of one part; three digits, on white, so that no level strikes it out.
static void draw_value(const nmm_chart_view *view, double y, double value) {
    char text[32];
    const double u = view->unit, size = fabs(value);
    const double x = value > 0 ? place_x(view, value) : bar_start(view);
    nmm_tick_text(text, value, size >= 100 ? 1 : size >= 10 ? 0.1 : 0.01);
    cairo_set_source_rgb(view->cairo, 1, 1, 1);
    cairo_rectangle(view->cairo, x + 4 * u, y - 11 * u,
                    nmm_text_width(view->cairo, text, 19 * u, false) + 8 * u, 22 * u);
    cairo_fill(view->cairo);
    set_colour(view->cairo, ink);
    nmm_draw_text(view->cairo, x + 8 * u, y, text,
                  (nmm_text_style){.size = 19 * u, .across = -1, .up = 1});
}

static void draw_values(const nmm_chart_view *view) {
    const nmm_chart_bars *bars = view->panel->bars;
    for (int k = 0; bars->n_part == 1 && k < bars->n_category * bars->n_bar; k++) {
        const double top = bar_top(view, k / bars->n_bar, k % bars->n_bar);
        if (isfinite(bars->value[k]))
            draw_value(view, top + (BAR - 4) * view->unit / 2, bars->value[k]);
    }
}

static void draw_category(const nmm_chart_view *view, int category) {
    const nmm_chart_bars *bars = view->panel->bars;
    const double u = view->unit, height = category_height(bars) * u;
    const double top = bar_top(view, category, 0);
    const double middle = top + (height - BETWEEN_CATEGORIES * u) / 2;
    double left = view->plot.x - 12 * u;
    for (int bar = 0; bar < bars->n_bar; bar++) {
        const double y = bar_top(view, category, bar);
        const long at = ((long)category * bars->n_bar + bar) * bars->n_part;
        draw_bar(view, bars->value + at, y, bar);
        if (bars->bar == NULL || bars->part == NULL) continue;
        set_colour(view->cairo, ink);
        nmm_draw_text(view->cairo, left, y + (BAR - 4) * u / 2, bars->bar[bar],
                      (nmm_text_style){.size = 17 * u, .across = 1, .up = 1});
    }
    for (int bar = 0; bars->bar != NULL && bars->part != NULL && bar < bars->n_bar; bar++) {
        const double width = nmm_text_width(view->cairo, bars->bar[bar], 17 * u, false);
        left = nmm_min(left, view->plot.x - 12 * u - width - 14 * u);
    }
    set_colour(view->cairo, ink);
    nmm_draw_text(view->cairo, left, middle - 2 * u, bars->category[category],
                  (nmm_text_style){.size = 21 * u, .across = 1, .up = 1});
}

static void draw_upright_levels(const nmm_chart_view *view) {
    const double u = view->unit;
    for (int i = 0; i < view->panel->n_level; i++) {
        const nmm_chart_level *level = &view->panel->level[i];
        const double x = place_x(view, level->y);
        set_stroke(view, NMM_CHART_SLOPE, 0);
        line(view->cairo, x, view->plot.y, x, view->plot.y + view->plot.height);
        cairo_set_dash(view->cairo, NULL, 0, 0);
        cairo_set_source_rgb(view->cairo, 0.3, 0.3, 0.32);
        nmm_draw_text(view->cairo, x, view->plot.y - 8 * u, level->name,
                      (nmm_text_style){.size = 18 * u, .across = 0});
    }
}

void nmm_chart_draw_bars(const nmm_chart_view *view) {
    draw_axis_x(view);
    for (int category = 0; category < view->panel->bars->n_category; category++)
        draw_category(view, category);
    draw_upright_levels(view);
    draw_values(view);
    draw_frame(view);
}

// --- Room

static double widest(const nmm_chart_view *view, int n, const char *const *name, double size) {
    double most = 0;
    for (int i = 0; name != NULL && i < n; i++)
        most = nmm_max(most, nmm_text_width(view->cairo, name[i], size * view->unit, false));
    return most;
}

double nmm_chart_left(const nmm_chart_view *view) {
    const nmm_chart_bars *bars = view->panel->bars;
    const double u = view->unit;
    if (bars != NULL) {
        const double names = bars->part != NULL ? widest(view, bars->n_bar, bars->bar, 17) : 0;
        return 20 * u + widest(view, bars->n_category, bars->category, 21) +
               (names > 0 ? names + 14 * u : 0);
    }
    nmm_chart_tick tick[NMM_MOST_TICK];
    double most = 0;
    const int n = ticks_y(view, tick);
    for (int i = 0; i < n; i++)
        most = nmm_max(most, nmm_text_width(view->cairo, tick[i].text, NMM_CHART_TICK * u, false));
    return (NMM_CHART_LABEL + 26) * u + most;
}

double nmm_chart_height(const nmm_chart_view *view, int n_panel) {
    const nmm_chart_bars *bars = view->panel->bars;
    if (bars == NULL) return (n_panel == 1 ? 860 : 680) * view->unit;
    return nmm_max_int(1, bars->n_category) * category_height(bars) * view->unit;
}

// --- Legend

static void draw_symbol(const nmm_chart_view *view, int k, int colour, double x, double y) {
    const double u = view->unit;
    if (view->panel->bars != NULL) {
        nmm_chart_colour(view->cairo, colour);
        cairo_rectangle(view->cairo, x + 6 * u, y - 10 * u, 32 * u, 20 * u);
        cairo_fill(view->cairo);
        return;
    }
    const nmm_chart_style style = view->panel->series[k].style;
    set_stroke(view, style, colour);
    if (style != NMM_CHART_MARKS) line(view->cairo, x, y, x + 46 * u, y);
    cairo_set_dash(view->cairo, NULL, 0, 0);
    if (style == NMM_CHART_LINE || style == NMM_CHART_MARKS)
        draw_mark(view->cairo, colour, x + 23 * u, y, 6.5 * u);
}

// Entry k, or NULL: nothing to explain.
static const char *legend_name(const nmm_chart_panel *panel, int k) {
    const nmm_chart_bars *bars = panel->bars;
    if (bars == NULL) return panel->series[k].name;
    if (bars->part != NULL) return bars->part[k];
    return bars->bar != NULL ? bars->bar[k] : NULL;
}

static int legend_entries(const nmm_chart_panel *panel) {
    const nmm_chart_bars *bars = panel->bars;
    if (bars == NULL) return panel->n_series;
    return bars->part != NULL ? bars->n_part : bars->n_bar;
}

int nmm_chart_legend(const nmm_chart_view *view, bool draw) {
    const double u = view->unit;
    const nmm_rect room = view->legend;
    double x = room.x;
    int lines = 0, colour = 0;
    for (int k = 0; k < legend_entries(view->panel); k++) {
        const char *name = legend_name(view->panel, k);
        const int own = colour;
        colour += view->panel->bars != NULL || view->panel->series[k].style != NMM_CHART_SLOPE;
        if (name == NULL) continue;
        const double width = 56 * u + nmm_text_width(view->cairo, name, NMM_CHART_TICK * u, false);
        if (lines == 0) lines = 1;
        if (x > room.x && x + width > room.x + room.width) {
            x = room.x;
            lines += 1;
        }
        const double y = room.y + (lines - 0.5) * NMM_CHART_LINE_SKIP * u;
        if (draw) {
            draw_symbol(view, k, own, x, y);
            set_colour(view->cairo, ink);
            nmm_draw_text(view->cairo, x + 56 * u, y, name,
                          (nmm_text_style){.size = NMM_CHART_TICK * u, .across = -1, .up = 1});
        }
        x += width + 36 * u;
    }
    return lines;
}
