// SPDX-License-Identifier: MIT
//
// A uniform grid over integer segments (or points: segments without length), about one cell for
// each item. A segment is listed in all cells that it comes within `margin` of, a point in its own
// cell only. Cells are square with a power of two as side.

#ifndef NMM_GRID_H
#define NMM_GRID_H

#include "integer.h"

typedef struct nmm_grid {
    nmm_ipoint low; // lower left corner of cell (0, 0)
    int shift;      // the side of a cell is 2^shift
    int nx, ny;
    int64_t margin; // how near counts; two units after the build
    int *start;     // [nx * ny + 1]
    int *item;      // [start[nx * ny]] indices of segments, ascending within a cell
} nmm_grid;

/// Build the grid of `n` segments; memory from the arena, nothing to destroy.
nmm_status nmm_grid_build(nmm_context *context, nmm_arena *arena, nmm_grid *grid, int n,
                          const nmm_isegment *segment);

/// Cells [first, end) of a row or column of cells.
typedef struct nmm_span {
    int first, end;
} nmm_span;

/// Rows that the segment comes within `margin` of.
nmm_span nmm_grid_rows(const nmm_grid *grid, const nmm_isegment *segment);
/// Cells of `row` that the part of the segment near the row comes within `margin` of.
nmm_span nmm_grid_columns(const nmm_grid *grid, const nmm_isegment *segment, int row);

/// Items of a cell are item[start[cell]] .. item[start[cell + 1] - 1].
static inline int nmm_grid_cell(const nmm_grid *grid, int row, int column) {
    return row * grid->nx + column;
}

#endif
