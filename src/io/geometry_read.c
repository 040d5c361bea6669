// SPDX-License-Identifier: MIT
//
// What does not change over the frames of a run file, checked: every index in its range, every
// place a number.

#include "file.h"

#include <math.h>

static nmm_status take(nmm_file *file, void *array, size_t count, size_t size) {
    return nmm_arena_take(&file->context, &file->arena, array, count, size);
}

static nmm_status read_points(nmm_file *file, nmm_h5 *h5, nmm_file_geometry *g) {
    const char *name = NMM_GRID "/Points";
    double *place = NULL;
    TRY(take(file, &place, (size_t)g->n_point * 3, sizeof *place));
    TRY(nmm_h5_get(h5, name, H5T_NATIVE_DOUBLE, 3, (const long[2]){0, g->n_point}, place));
    for (long p = 0; p < g->n_point; p++) {
        if (!isfinite(place[3 * p]) || !isfinite(place[3 * p + 1]))
            return nmm_h5_fail_read(h5, name, "a place is no number");
        place[2 * p] = place[3 * p];
        place[2 * p + 1] = place[3 * p + 1];
    }
    g->point = place;
    return NMM_OK;
}

// Whole numbers of a dataset, all of them 0 <= x < high.
static nmm_status read_indices(nmm_file *file, nmm_h5 *h5, const char *name, long n, int high,
                               int **index) {
    TRY(take(file, index, (size_t)n, sizeof **index));
    TRY(nmm_h5_get(h5, name, H5T_NATIVE_INT, 0, (const long[2]){0, n}, *index));
    for (long i = 0; i < n; i++) {
        if ((*index)[i] < 0 || (*index)[i] >= high)
            return nmm_h5_fail_read(h5, name, "an index is out of range");
    }
    return NMM_OK;
}

static nmm_status read_cells(nmm_file *file, nmm_h5 *h5, nmm_file_geometry *g) {
    const int n = g->n_element;
    TRY(read_indices(file, h5, NMM_GRID "/Offsets", n + 1, g->n_corner + 1, &g->element_start));
    TRY(read_indices(file, h5, NMM_GRID "/Connectivity", g->n_corner, g->n_point,
                     &g->corner_point));
    TRY(read_indices(file, h5, NMM_GRID "/CellData/block_id", n, n, &g->element_block));
    TRY(read_indices(file, h5, NMM_GRID "/CellData/material", n, n + (1 << 16),
                     &g->element_material));
    bool rises = g->element_start[0] == 0 && g->element_start[n] == g->n_corner;
    for (int e = 0; e < n; e++) {
        rises = rises && g->element_start[e] <= g->element_start[e + 1];
        g->n_block = nmm_max_int(g->n_block, g->element_block[e] + 1);
    }
    return rises ? NMM_OK : nmm_h5_fail_read(h5, NMM_GRID "/Offsets", "does not rise");
}

static nmm_status read_outline(nmm_file *file, nmm_h5 *h5, nmm_file_geometry *g) {
    const char *name = NMM_META "/outline";
    long rows = 0;
    int *row = NULL;
    TRY(nmm_h5_rows(h5, name, 5, &rows));
    g->n_edge = (int)rows;
    TRY(take(file, &row, (size_t)rows * 5, sizeof *row));
    TRY(take(file, &g->edge_point, (size_t)rows * 2, sizeof *g->edge_point));
    TRY(take(file, &g->edge_block, (size_t)rows, sizeof *g->edge_block));
    TRY(take(file, &g->edge_interface, (size_t)rows, sizeof *g->edge_interface));
    TRY(take(file, &g->edge_mate, (size_t)rows, sizeof *g->edge_mate));
    TRY(nmm_h5_get(h5, name, H5T_NATIVE_INT, 5, (const long[2]){0, rows}, row));
    for (long i = 0; i < rows; i++) {
        const int *r = row + 5 * i;
        const bool inside = r[0] >= 0 && r[0] < g->n_point && r[1] >= 0 && r[1] < g->n_point &&
                            r[2] >= 0 && r[2] < g->n_block && r[4] >= -1 && r[4] < rows;
        if (!inside) return nmm_h5_fail_read(h5, name, "an index is out of range");
        g->edge_point[2 * i] = r[0];
        g->edge_point[2 * i + 1] = r[1];
        g->edge_block[i] = r[2];
        g->edge_interface[i] = r[3];
        g->edge_mate[i] = r[4];
    }
    return NMM_OK;
}

static nmm_status read_supports(nmm_file *file, nmm_h5 *h5, nmm_file_geometry *g) {
    const char *name = NMM_META "/supports";
    long rows = 0;
    TRY(nmm_h5_record_rows(h5, name, &rows));
    TRY(take(file, &g->support, (size_t)rows, sizeof *g->support));
    TRY(nmm_h5_record_get(h5, name, &nmm_record_support, 0, rows, g->support));
    for (long i = 0; i < rows; i++) {
        const nmm_support_row *s = &g->support[i];
        const bool fits = isfinite(s->x) && isfinite(s->y) && s->block >= 0 &&
                          s->block < g->n_block && s->element >= -1 && s->element < g->n_element;
        if (!fits) return nmm_h5_fail_read(h5, name, "a value is out of range");
    }
    g->n_support = (int)rows;
    return NMM_OK;
}

// Rows of one history follow each other.
static nmm_status sort_history(nmm_file *file, nmm_h5 *h5, const char *name, long rows,
                               const nmm_history_row *row) {
    double *entry = NULL;
    int n = 0;
    for (long i = 0; i < rows; i++) {
        const bool next = i == 0 || row[i].history > row[i - 1].history;
        const bool fits =
            isfinite(row[i].factor) && row[i].history >= 0 && row[i].history < 1 << 24;
        if (!fits ||
            !(next || (row[i].history == row[i - 1].history && row[i].time >= row[i - 1].time)))
            return nmm_h5_fail_read(h5, name, "a value is out of range");
        n = row[i].history + 1;
    }
    TRY(take(file, &file->history, (size_t)n, sizeof *file->history));
    TRY(take(file, &entry, (size_t)rows, 2 * sizeof *entry));
    for (long i = 0; i < rows; i++) {
        nmm_history *history = &file->history[row[i].history];
        if (history->n == 0) *history = (nmm_history){.width = 1, .entry = entry + 2 * i};
        history->n += 1;
        entry[2 * i] = row[i].time;
        entry[2 * i + 1] = row[i].factor;
    }
    file->n_history = n;
    return NMM_OK;
}

// Files of older versions have none.
static nmm_status read_histories(nmm_file *file, nmm_h5 *h5) {
    const char *name = NMM_META "/histories";
    nmm_history_row *row = NULL;
    long rows = 0;
    file->n_history = 0;
    if (!nmm_h5_exists(h5, name)) return NMM_OK;
    TRY(nmm_h5_record_rows(h5, name, &rows));
    TRY(take(file, &row, (size_t)rows, sizeof *row));
    TRY(nmm_h5_record_get(h5, name, &nmm_record_history, 0, rows, row));
    return sort_history(file, h5, name, rows, row);
}

static nmm_status read_loads(nmm_file *file, nmm_h5 *h5, nmm_file_geometry *g) {
    const char *name = NMM_META "/loads";
    long rows = 0;
    TRY(nmm_h5_record_rows(h5, name, &rows));
    TRY(take(file, &g->load, (size_t)rows, sizeof *g->load));
    // Columns that an older file lacks: forces at points, constant.
    for (long i = 0; i < rows; i++)
        g->load[i].history = -1;
    TRY(nmm_h5_record_get(h5, name, &nmm_record_load, 0, rows, g->load));
    for (long i = 0; i < rows; i++) {
        const nmm_load_row *l = &g->load[i];
        const bool known = l->history >= 0 && l->history < file->n_history;
        const bool fits = isfinite(l->x) && isfinite(l->y) && isfinite(l->fx) && isfinite(l->fy) &&
                          l->element >= -1 && l->element < g->n_element && l->length >= 0 &&
                          (l->history == -1 || (known && file->history[l->history].n > 0));
        if (!fits) return nmm_h5_fail_read(h5, name, "a value is out of range");
    }
    g->n_load = (int)rows;
    return NMM_OK;
}

static nmm_status read_monitor_places(nmm_file *file, nmm_h5 *h5, nmm_file_geometry *g) {
    TRY(take(file, &g->monitor_place, (size_t)file->n_monitor * 2, sizeof *g->monitor_place));
    for (int k = 0; k < file->n_monitor; k++) {
        double *place = g->monitor_place + 2 * (long)k;
        TRY(nmm_h5_attribute_get(h5, file->monitor[k].table, "place", H5T_NATIVE_DOUBLE, 2, place));
        if (!isfinite(place[0]) || !isfinite(place[1]))
            return nmm_h5_fail_read(h5, file->monitor[k].table, "a place is no number");
    }
    g->n_monitor = file->n_monitor;
    return NMM_OK;
}

static nmm_status read_geometry(nmm_file *file, nmm_h5 *h5) {
    nmm_file_geometry *g = &file->geometry;
    *g = (nmm_file_geometry){
        .n_point = file->n_point, .n_element = file->n_element, .n_corner = file->n_corner};
    TRY(nmm_file_begin(file, h5));
    TRY(read_points(file, h5, g));
    TRY(read_cells(file, h5, g));
    TRY(read_outline(file, h5, g));
    TRY(read_supports(file, h5, g));
    TRY(read_histories(file, h5));
    TRY(read_loads(file, h5, g));
    TRY(read_monitor_places(file, h5, g));
    file->has_geometry = true;
    return NMM_OK;
}

nmm_status nmm_file_geometry_read(nmm_file *file, const nmm_file_geometry **geometry) {
    *geometry = &file->geometry;
    if (file->has_geometry) return NMM_OK;
    nmm_h5 h5 = {0};
    const nmm_h5_quiet quiet = nmm_h5_quiet_begin();
    const nmm_status status = nmm_file_end(&h5, read_geometry(file, &h5));
    nmm_h5_quiet_end(quiet);
    return status;
}
