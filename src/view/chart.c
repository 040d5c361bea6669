// SPDX-License-Identifier: MIT
//
// A chart's page: titles above, panels side by side, under each its legend; from there to the file.
//
//     title
//     subtitle
//     panel title                    panel title
//     y |-----------|                y |-----------|
//       |-----------|                  |-----------|
//           x                              x
//     legend                         legend

#include "chart.h"

#include "chart_draw.h"

#include <math.h>

enum { MARGIN = 28, MOST_PANELS = 4 };

typedef struct page {
    const nmm_chart *chart;
    double width, height, unit;
    nmm_chart_view view[MOST_PANELS];
} page;

// The plot inside the panel's room, and the end of the panel below it.
static double lay_out_panel(nmm_chart_view *view, int n_panel) {
    const double u = view->unit;
    view->x = nmm_chart_scale_x(view->panel);
    if (view->panel->bars == NULL) view->y = nmm_chart_scale_y(view->panel);
    const bool has_names = view->panel->bars != NULL && view->panel->n_level > 0;
    view->plot.y =
        view->room.y + (view->panel->title != NULL ? 44 : 10) * u + (has_names ? 26 * u : 0);
    view->plot.height = nmm_chart_height(view, n_panel);
    const double left = nmm_chart_left(view), right = (view->panel->bars != NULL ? 44 : 30) * u;
    view->plot.x = view->room.x + left;
    view->plot.width = nmm_max(40 * u, view->room.width - left - right);
    const double bottom = view->plot.y + view->plot.height + (42 + NMM_CHART_LABEL + 24) * u;
    view->legend = (nmm_rect){view->plot.x, bottom, view->plot.width, 0};
    int lines = nmm_chart_legend(view, false);
    if (lines > 1) {
        // More room from the edge of the panel on.
        view->legend.x = view->room.x + 20 * u;
        view->legend.width = view->room.width - 20 * u;
        lines = nmm_chart_legend(view, false);
    }
    return bottom + lines * NMM_CHART_LINE_SKIP * u;
}

static void lay_out(void *user, cairo_t *cairo) {
    page *p = user;
    const nmm_chart *chart = p->chart;
    const double u = p->unit, margin = MARGIN * u;
    double top = margin;
    if (chart->title != NULL) top += 46 * u;
    if (chart->subtitle != NULL) top += 36 * u;
    const double room = (p->width - 2 * margin) / chart->n_panel;
    p->height = top;
    for (int k = 0; k < chart->n_panel; k++) {
        nmm_chart_view *view = &p->view[k];
        *view = (nmm_chart_view){.panel = &chart->panel[k],
                                 .cairo = cairo,
                                 .unit = u,
                                 .room = {margin + k * room, top, room, 0}};
        p->height = nmm_max(p->height, lay_out_panel(view, chart->n_panel));
        view->cairo = NULL;
    }
    p->height = ceil(p->height + margin);
}

static void draw_titles(const page *p, cairo_t *cairo) {
    const double u = p->unit;
    double y = MARGIN * u;
    cairo_set_source_rgb(cairo, 1, 1, 1);
    cairo_paint(cairo);
    cairo_set_source_rgb(cairo, 0.13, 0.13, 0.15);
    if (p->chart->title != NULL) {
        nmm_draw_text(cairo, MARGIN * u, y, p->chart->title,
                      (nmm_text_style){.size = 32 * u, .bold = true, .across = -1, .up = 2});
        y += 46 * u;
    }
    if (p->chart->subtitle != NULL)
        nmm_draw_text(cairo, MARGIN * u, y, p->chart->subtitle,
                      (nmm_text_style){.size = 22 * u, .across = -1, .up = 2});
}

static void draw(void *user, cairo_t *cairo) {
    page *p = user;
    draw_titles(p, cairo);
    for (int k = 0; k < p->chart->n_panel; k++) {
        nmm_chart_view *view = &p->view[k];
        view->cairo = cairo;
        if (view->panel->title != NULL) {
            cairo_set_source_rgb(cairo, 0.13, 0.13, 0.15);
            nmm_draw_text(
                cairo, view->plot.x, view->room.y, view->panel->title,
                (nmm_text_style){.size = 24 * p->unit, .bold = true, .across = -1, .up = 2});
        }
        if (view->panel->bars != NULL)
            nmm_chart_draw_bars(view);
        else
            nmm_chart_draw_curves(view);
        nmm_chart_legend(view, true);
        view->cairo = NULL;
    }
}

nmm_status nmm_chart_write(nmm_context *context, const nmm_chart *chart, const char *path,
                           int width) {
    nmm_kind kind = NMM_KIND_PNG;
    TRY(nmm_kind_of(context, path, &kind));
    if (width == 0) width = 1600;
    if (width < 200 || width > 16000 || chart->n_panel < 1 || chart->n_panel > MOST_PANELS) {
        return nmm_fail(
            context, NMM_ERROR_ARGUMENT,
            "a chart must be 200 to 16000 wide and have 1 to %d panels; found %d and %d",
            MOST_PANELS, width, chart->n_panel);
    }
    page p = {.chart = chart, .width = width, .unit = width / 1600.0};
    nmm_page sheet = {.context = context, .user = &p, .draw = draw, .width = width};
    TRY(nmm_page_measure(&sheet, lay_out));
    sheet.height = p.height;
    return nmm_page_write(&sheet, path, kind);
}
