// SPDX-License-Identifier: MIT
//
// Where everything stands on the page, from the scene's shape and the widths of the texts, so that
// nothing overlaps:
//
//     title                                         wide scenes (aspect > 2.2) have the bar below:
//     subtitle
//     y [m] |-----------------|  |bar| ticks        |-------------------------|
//           |      plot       |  |   | name         |          plot           |
//           |-----------------|  |   |              |-------------------------|
//                x [m]                                   x [m]
//     legend                                          [======= bar ========]   legend

#include "view.h"

#include <math.h>

enum { TICK_SIZE = 24, LABEL_SIZE = 26, MARGIN = 28, MOST_TICKS = 9 };

static double widest_tick(const nmm_picture *picture, nmm_ticks ticks, double factor) {
    double most = 0;
    char text[32];
    for (int i = 0; i < ticks.n; i++) {
        const double value = (ticks.first + i * ticks.step) / factor;
        nmm_tick_text(text, value, ticks.step / factor);
        most =
            nmm_max(most, nmm_text_width(picture->cairo, text, TICK_SIZE * picture->unit, false));
    }
    return most;
}

// What the axes show: the deformed points and a margin, at least 1:25 in shape.
static void find_box(nmm_picture *picture, const double *place) {
    nmm_box box = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (long p = 0; p < picture->geometry->n_point; p++) {
        box.low.x = nmm_min(box.low.x, place[2 * p]);
        box.low.y = nmm_min(box.low.y, place[2 * p + 1]);
        box.high.x = nmm_max(box.high.x, place[2 * p]);
        box.high.y = nmm_max(box.high.y, place[2 * p + 1]);
    }
    if (picture->geometry->n_point == 0) box = (nmm_box){{0, 0}, {1, 1}};
    const double side = nmm_max(box.high.x - box.low.x, box.high.y - box.low.y);
    // Arrows of loads stand outside of the blocks.
    const double part = picture->geometry->n_load > 0 ? 0.075 : 0.045;
    const double margin = side > 0 ? part * side : 0.5;
    const double grow_x = nmm_max(0, side / 25 - (box.high.x - box.low.x)) / 2 + margin;
    const double grow_y = nmm_max(0, side / 25 - (box.high.y - box.low.y)) / 2 + margin;
    picture->box = (nmm_box){{box.low.x - grow_x, box.low.y - grow_y},
                             {box.high.x + grow_x, box.high.y + grow_y}};
}

// Ticks of both axes with one step where both have two or more.
static void choose_ticks(nmm_picture *picture) {
    const nmm_box box = picture->box;
    const double u = picture->unit, width = picture->plot.width, height = picture->plot.height;
    const int room_y = nmm_min_int(MOST_TICKS, (int)(height / (2.2 * TICK_SIZE * u)));
    nmm_ticks y = nmm_ticks_of(box.low.y, box.high.y, nmm_max_int(2, room_y));
    int room_x = MOST_TICKS;
    nmm_ticks x = nmm_ticks_of(box.low.x, box.high.x, room_x);
    while (room_x > 2 && x.n * (widest_tick(picture, x, 1) + 1.2 * TICK_SIZE * u) > width)
        x = nmm_ticks_of(box.low.x, box.high.x, --room_x);
    const double step = nmm_max(x.step, y.step);
    nmm_ticks *finer = x.step < y.step ? &x : &y;
    const double low = finer == &x ? box.low.x : box.low.y;
    const double high = finer == &x ? box.high.x : box.high.y;
    const double first = ceil(low / step - 1e-9) * step;
    const int n = (int)floor((high - first) / step + 1e-9) + 1;
    if (n >= 2) *finer = (nmm_ticks){first, step, n};
    picture->tick_x = x;
    picture->tick_y = y;
}

static void choose_bar_ticks(nmm_picture *picture, double length) {
    nmm_shade *shade = &picture->shade;
    if (shade->colours == NMM_COLOURS_BLOCKS) return;
    const double low = shade->low / shade->factor, high = shade->high / shade->factor;
    const double u = picture->unit;
    int room = picture->bar_upright ? nmm_max_int(2, (int)(length / (2.4 * TICK_SIZE * u))) : 9;
    room = nmm_min_int(room, MOST_TICKS);
    nmm_ticks ticks = nmm_ticks_of(low, high, room);
    while (!picture->bar_upright && room > 2 &&
           ticks.n * (widest_tick(picture, ticks, 1) + 1.2 * TICK_SIZE * u) > length)
        ticks = nmm_ticks_of(low, high, --room);
    picture->tick_bar = ticks;
}

// Width of the space right of the plot.
static double right_space(const nmm_picture *picture) {
    const double u = picture->unit;
    if (!picture->bar_upright || picture->shade.colours == NMM_COLOURS_BLOCKS) return 44 * u;
    return (30 + 34 + 14 + 16 + LABEL_SIZE + MARGIN) * u +
           widest_tick(picture, picture->tick_bar, 1);
}

// The plot keeps the shape of the box inside the given room.
static void fit_plot(nmm_picture *picture, double left, double right) {
    const nmm_box box = picture->box;
    const double shape = (box.high.x - box.low.x) / (box.high.y - box.low.y);
    const double room = picture->width - left - right, most = 1.15 * picture->width;
    picture->plot.width = room;
    picture->plot.height = room / shape;
    if (picture->plot.height > most) {
        picture->plot.height = most;
        picture->plot.width = most * shape;
    }
    // A narrow plot stands in the middle, with what belongs to it.
    picture->plot.x = left + (room - picture->plot.width) / 2;
    picture->ratio = picture->plot.width / (box.high.x - box.low.x);
}

static double top_space(const nmm_picture *picture) {
    return (MARGIN + 34 + 14 + 25 + 26) * picture->unit;
}

// The colour bar and the height of the page, once the plot stands.
static void place_bar(nmm_picture *picture) {
    const double u = picture->unit;
    const nmm_rect plot = picture->plot;
    double y = plot.y + plot.height + (10 + TICK_SIZE + 10 + LABEL_SIZE) * u;
    const bool has_bar = picture->shade.colours != NMM_COLOURS_BLOCKS;
    if (has_bar && picture->bar_upright) {
        const double height = nmm_min(plot.height, 900 * u);
        picture->bar = (nmm_rect){plot.x + plot.width + 30 * u, plot.y + (plot.height - height) / 2,
                                  34 * u, height};
    } else if (has_bar) {
        const double width = nmm_min(plot.width, 1000 * u);
        picture->bar = (nmm_rect){plot.x + (plot.width - width) / 2, y + 30 * u, width, 30 * u};
        y += (30 + 30 + 12 + TICK_SIZE + 10 + LABEL_SIZE) * u;
    }
    // Under the plot where it fits on one line there.
    const double right = picture->width - MARGIN * u;
    picture->legend = (nmm_rect){plot.x, y + 30 * u, right - plot.x, 40 * u};
    int lines = nmm_draw_legend(picture, false);
    if (lines > 1) {
        const double left = nmm_min(plot.x, 0.1 * picture->width);
        picture->legend = (nmm_rect){left, y + 30 * u, right - left, 40 * u};
        lines = nmm_draw_legend(picture, false);
    }
    picture->height = y + (lines > 0 ? 30 + 40 * lines : 0) * u + MARGIN * u;
}

void nmm_layout_make(nmm_picture *picture, double width) {
    const nmm_file_geometry *g = picture->geometry;
    const double u = width / 1600;
    picture->width = width;
    picture->unit = u;
    // The deformed places are kept where the page places will be.
    for (long i = 0; i < 2L * g->n_point; i++) {
        const double moved =
            picture->frame.displacement != NULL ? picture->frame.displacement[i] : 0;
        picture->page[i] = g->point[i] + picture->scale * moved;
    }
    find_box(picture, picture->page);
    const nmm_box box = picture->box;
    picture->bar_upright = (box.high.x - box.low.x) < 2.2 * (box.high.y - box.low.y);
    // Texts need ticks, ticks need a size: two rounds settle both.
    picture->plot = (nmm_rect){0, 0, 0.8 * width, 0.8 * width};
    for (int round = 0; round < 2; round++) {
        choose_ticks(picture);
        choose_bar_ticks(picture, picture->bar_upright ? nmm_min(picture->plot.height, 900 * u)
                                                       : nmm_min(picture->plot.width, 1000 * u));
        const double left =
            (MARGIN + LABEL_SIZE + 12 + 12) * u + widest_tick(picture, picture->tick_y, 1);
        fit_plot(picture, left, right_space(picture));
        picture->plot.y = top_space(picture);
    }
    choose_ticks(picture);
    place_bar(picture);
    for (long p = 0; p < g->n_point; p++) {
        const nmm_vec2 at =
            nmm_layout_place(picture, picture->page[2 * p], picture->page[2 * p + 1]);
        picture->page[2 * p] = at.x;
        picture->page[2 * p + 1] = at.y;
    }
}

nmm_vec2 nmm_layout_place(const nmm_picture *picture, double x, double y) {
    const nmm_rect plot = picture->plot;
    return (nmm_vec2){plot.x + picture->ratio * (x - picture->box.low.x),
                      plot.y + plot.height - picture->ratio * (y - picture->box.low.y)};
}
