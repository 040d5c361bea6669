// SPDX-License-Identifier: MIT
//
// Charts: panels side by side on one page, each with curves over linear or logarithmic axes, or
// with horizontal bars by category. The same chart is the same picture, whenever it is made.
//
// A chart is data only and belongs to the caller; numbers that are not finite, or not above 0 on a
// logarithmic axis, are left out of the picture.

#ifndef NMM_CHART_H
#define NMM_CHART_H

#include "base.h"

typedef enum nmm_chart_style {
    NMM_CHART_LINE,  // a line with a mark at each point
    NMM_CHART_PLAIN, // a line
    NMM_CHART_MARKS, // marks
    NMM_CHART_SLOPE  // a thin grey dashed line, without a colour of its own: for comparison
} nmm_chart_style;

typedef struct nmm_chart_series {
    const char *name;    // in the legend; NULL: not there
    const double *x, *y; // [n]
    int n;
    nmm_chart_style style;
} nmm_chart_series;

/// A horizontal line across the panel, its name on it.
typedef struct nmm_chart_level {
    const char *name;
    double y;
} nmm_chart_level;

typedef struct nmm_chart_axis {
    const char *title;
    bool log;
    double low, high; // both 0: from the data
} nmm_chart_axis;

/// Values of bars: [category][bar][part]. The parts of a bar stand behind each other; the bars of a
/// category one below the other.
typedef struct nmm_chart_bars {
    int n_category, n_bar, n_part;
    const char *const *category; // [n_category]
    const char *const *bar;      // [n_bar]; NULL: one bar without a name
    const char *const *part;     // [n_part]; NULL: one part without a name
    const double *value;         // [n_category][n_bar][n_part]
} nmm_chart_bars;

typedef struct nmm_chart_panel {
    const char *title;
    nmm_chart_axis x, y; // bars: values go along x, y has no numbers
    int n_series;
    const nmm_chart_series *series;
    int n_level;
    const nmm_chart_level *level; // bars: vertical lines at x
    const nmm_chart_bars *bars;   // NULL: curves
} nmm_chart_panel;

typedef struct nmm_chart {
    const char *title, *subtitle;
    int n_panel;
    const nmm_chart_panel *panel;
} nmm_chart;

/// Draw into `path`, whose ending says which kind: png, svg or pdf. `width` in pixels of a PNG; 0:
/// 1600. NMM_ERROR_ARGUMENT: another ending or width; NMM_ERROR_FILE: cannot be written.
nmm_status nmm_chart_write(nmm_context *context, const nmm_chart *chart, const char *path,
                           int width);

#endif
