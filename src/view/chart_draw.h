// SPDX-License-Identifier: MIT
//
// Inside of the charts: one panel with its scales and its place on the page.

#ifndef NMM_CHART_DRAW_H
#define NMM_CHART_DRAW_H

#include "chart.h"
#include "view.h"

/// Texts of a chart, in units of design (1600 make the width of the page).
enum {
    NMM_CHART_TICK = 22,      // numbers at the ticks
    NMM_CHART_LABEL = 24,     // titles of axes, legend
    NMM_CHART_LINE_SKIP = 36, // from one line of a legend to the next
};

/// Range of an axis; on a logarithmic one in powers of ten.
typedef struct nmm_chart_scale {
    bool log;
    double low, high;
} nmm_chart_scale;

typedef struct nmm_chart_view {
    const nmm_chart_panel *panel;
    cairo_t *cairo;
    double unit;
    nmm_rect room; // of the whole panel
    nmm_rect plot; // inside of the axes
    nmm_rect legend;
    nmm_chart_scale x, y;
} nmm_chart_view;

/// Place of a value on a scale, 0 .. 1; not finite where there is none.
double nmm_chart_part(nmm_chart_scale scale, double value);
nmm_chart_scale nmm_chart_scale_x(const nmm_chart_panel *panel);
nmm_chart_scale nmm_chart_scale_y(const nmm_chart_panel *panel);

/// Ticks of a scale: values and whether they have a number. Returns how many, at most
/// NMM_MOST_TICK.
enum { NMM_MOST_TICK = 96 };
typedef struct nmm_chart_tick {
    double value;
    char text[32]; // empty: a small tick
} nmm_chart_tick;
int nmm_chart_ticks(nmm_chart_scale scale, int at_most, nmm_chart_tick tick[NMM_MOST_TICK]);

void nmm_chart_colour(cairo_t *cairo, int k);

/// Is the name of a level better at its left end, because curves are in its way at the right one?
bool nmm_chart_level_left(const nmm_chart_view *view, const nmm_chart_level *level);
/// Page units left of the plot, for numbers or names.
double nmm_chart_left(const nmm_chart_view *view);
/// Height that the panel's content asks for.
double nmm_chart_height(const nmm_chart_view *view, int n_panel);

/// Legend inside view->legend; returns its lines.
int nmm_chart_legend(const nmm_chart_view *view, bool draw);

void nmm_chart_draw_curves(const nmm_chart_view *view);
void nmm_chart_draw_bars(const nmm_chart_view *view);

#endif
