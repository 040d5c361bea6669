// SPDX-License-Identifier: MIT
//
// The uniform grid: cells counted, then filled. Which cells a segment meets is found row by row in
// double precision; the rounding is far below the margin of two units (coordinates stay below 2^40,
// a double holds 53 bits).

#include "grid.h"

#include <math.h>

#define MARGIN 2 // in units, far above the rounding

static int clamp_cell(int64_t offset, int shift, int n) {
    if (offset < 0) return 0;
    const int64_t cell = offset >> shift;
    return cell < n ? (int)cell : n - 1;
}

nmm_span nmm_grid_rows(const nmm_grid *grid, const nmm_isegment *segment) {
    const int64_t ay = segment->a.y - grid->low.y, by = segment->b.y - grid->low.y;
    const int64_t low = ay < by ? ay : by, high = ay < by ? by : ay;
    return (nmm_span){clamp_cell(low - grid->margin, grid->shift, grid->ny),
                      clamp_cell(high + grid->margin, grid->shift, grid->ny) + 1};
}

static double within(double low, double high, double y) {
    return nmm_min(high, nmm_max(low, y));
}

nmm_span nmm_grid_columns(const nmm_grid *grid, const nmm_isegment *segment, int row) {
    const bool upward = segment->a.y <= segment->b.y;
    const nmm_ipoint a = upward ? segment->a : segment->b, b = upward ? segment->b : segment->a;
    const double ax = (double)(a.x - grid->low.x), bx = (double)(b.x - grid->low.x);
    double low = ax, high = bx;
    if (a.y != b.y) {
        // The part of the segment within the row.
        const double ay = (double)(a.y - grid->low.y), by = (double)(b.y - grid->low.y);
        const double bottom = (double)((int64_t)row << grid->shift) - (double)grid->margin;
        const double top = (double)((int64_t)(row + 1) << grid->shift) + (double)grid->margin;
        const double slope = (bx - ax) / (by - ay);
        low = ax + (within(ay, by, bottom) - ay) * slope;
        high = ax + (within(ay, by, top) - ay) * slope;
    }
    const int64_t left = (int64_t)floor(nmm_min(low, high)) - grid->margin;
    const int64_t right = (int64_t)ceil(nmm_max(low, high)) + grid->margin;
    return (nmm_span){clamp_cell(left, grid->shift, grid->nx),
                      clamp_cell(right, grid->shift, grid->nx) + 1};
}

// Cell of a point.
static int point_cell(const nmm_grid *grid, nmm_ipoint p) {
    return nmm_grid_cell(grid, clamp_cell(p.y - grid->low.y, grid->shift, grid->ny),
                         clamp_cell(p.x - grid->low.x, grid->shift, grid->nx));
}

static void include_point(nmm_ipoint p, nmm_ipoint *low, nmm_ipoint *high) {
    if (p.x < low->x) low->x = p.x;
    if (p.y < low->y) low->y = p.y;
    if (p.x > high->x) high->x = p.x;
    if (p.y > high->y) high->y = p.y;
}

// Choose corner, side and number of cells: at most about two cells for each segment.
static void choose_cells(nmm_grid *grid, int n, const nmm_isegment *segment) {
    nmm_ipoint high = segment[0].a;
    grid->low = segment[0].a;
    for (int i = 0; i < n; i++) {
        include_point(segment[i].a, &grid->low, &high);
        include_point(segment[i].b, &grid->low, &high);
    }
    const int64_t width = high.x - grid->low.x, height = high.y - grid->low.y;
    const double most = 2.0 * n + 16;
    grid->shift = 0;
    while (((double)(width >> grid->shift) + 1) * ((double)(height >> grid->shift) + 1) > most)
        grid->shift += 1;
    grid->nx = (int)(width >> grid->shift) + 1;
    grid->ny = (int)(height >> grid->shift) + 1;
}

// Count the segment in its cells (item == NULL), or list it, filling each cell from its end.
static void enter_segment(nmm_grid *grid, const nmm_isegment *segment, int i, int *item) {
    if (nmm_ipoint_equal(segment->a, segment->b)) {
        const int cell = point_cell(grid, segment->a);
        if (item == NULL) grid->start[cell] += 1;
        if (item != NULL) item[--grid->start[cell]] = i;
        return;
    }
    const nmm_span rows = nmm_grid_rows(grid, segment);
    for (int row = rows.first; row < rows.end; row++) {
        const nmm_span columns = nmm_grid_columns(grid, segment, row);
        int *start = grid->start + nmm_grid_cell(grid, row, columns.first);
        const int n = columns.end - columns.first;
        for (int k = 0; k < n; k++) {
            if (item == NULL) start[k] += 1;
            if (item != NULL) item[--start[k]] = i;
        }
    }
}

nmm_status nmm_grid_build(nmm_context *context, nmm_arena *arena, nmm_grid *grid, int n,
                          const nmm_isegment *segment) {
    *grid = (nmm_grid){.margin = MARGIN};
    if (n > 0) choose_cells(grid, n, segment);
    const int n_cell = grid->nx * grid->ny;
    TRY(nmm_arena_take(context, arena, &grid->start, (size_t)n_cell + 1, sizeof(int)));
    for (int i = 0; i < n; i++)
        enter_segment(grid, &segment[i], i, NULL);
    // Ends of the cells; filling backwards moves them to the starts.
    long total = 0;
    for (int c = 0; c < n_cell; c++) {
        total += grid->start[c];
        if (total > INT32_MAX) return nmm_fail(context, NMM_ERROR_INPUT, "too many segments");
        grid->start[c] = (int)total;
    }
    grid->start[n_cell] = (int)total;
    TRY(nmm_arena_take(context, arena, &grid->item, (size_t)total, sizeof(int)));
    for (int i = n - 1; i >= 0; i--)
        enter_segment(grid, &segment[i], i, grid->item);
    return NMM_OK;
}
