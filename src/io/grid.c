// SPDX-License-Identifier: MIT
//
// The blocks as temporal VTKHDF UnstructuredGrid: the reference geometry once, then for each frame
// the displacement and velocity of the points and the stress of the elements as float32.
//
// Topology is written once, so PartOffsets, PointOffsets and CellOffsets are 0 at every step and
// NumberOfPoints, NumberOfCells and NumberOfConnectivityIds have one entry: otherwise viewers show
// later steps empty.

#include "output.h"

#include <math.h>

// --- Topology

typedef struct fixed_column {
    const char *name;
    hid_t stored, memory;
    int width;
    long n;
    const void *data;
    const char *unit, *meaning;
} fixed_column;

static nmm_status write_column(nmm_h5 *h5, const fixed_column *column) {
    const long most = 1 << 20;
    const long chunk = column->n < 1 ? 1 : column->n < most ? column->n : most;
    const nmm_h5_table table = {.name = column->name,
                                .type = column->stored,
                                .width = column->width,
                                .chunk = (hsize_t)chunk,
                                .compress = column->n > 64,
                                .unit = column->unit,
                                .meaning = column->meaning};
    TRY(nmm_h5_table_create(h5, &table));
    return nmm_h5_put(h5, column->name, column->memory, 0, (hsize_t)column->n, column->data);
}

// Reference places of the points in scene coordinates.
static nmm_status write_points(nmm_output *output, const nmm_model *m) {
    double *place = NULL;
    TRY(nmm_allocate(&output->context, &place, (size_t)m->n_point * 3, sizeof *place));
    for (int p = 0; p < m->n_point; p++) {
        place[3 * p] = m->point[2 * p] + m->origin.x;
        place[3 * p + 1] = m->point[2 * p + 1] + m->origin.y;
    }
    const fixed_column points = {
        NMM_GRID "/Points", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 3, m->n_point, place, "m",
        "reference places"};
    const nmm_status status = write_column(&output->h5, &points);
    nmm_release(&output->context, &place);
    return status;
}

static nmm_status write_cells(nmm_output *output, const nmm_model *m) {
    nmm_h5 *h5 = &output->h5;
    const int64_t count[3] = {m->n_point, m->n_element, m->n_corner};
    const char *const name[3] = {NMM_GRID "/NumberOfPoints", NMM_GRID "/NumberOfCells",
                                 NMM_GRID "/NumberOfConnectivityIds"};
    for (int i = 0; i < 3; i++) {
        const fixed_column part = {name[i], H5T_STD_I64LE, H5T_NATIVE_INT64, 0, 1, &count[i],
                                   NULL,    NULL};
        TRY(write_column(h5, &part));
    }
    const fixed_column ids[4] = {
        {NMM_GRID "/Connectivity", H5T_STD_I64LE, H5T_NATIVE_INT, 0, m->n_corner, m->corner_point,
         NULL, "points of each element's polygon, counter-clockwise"},
        {NMM_GRID "/Offsets", H5T_STD_I64LE, H5T_NATIVE_INT, 0, m->n_element + 1, m->element_start,
         NULL, "first entry of each element in Connectivity"},
        {NMM_GRID "/CellData/block_id", H5T_STD_I32LE, H5T_NATIVE_INT, 0, m->n_element,
         m->element_block, NULL, "block of an element"},
        {NMM_GRID "/CellData/material", H5T_STD_I32LE, H5T_NATIVE_INT, 0, m->n_element,
         m->element_material, NULL, "material of an element"},
    };
    for (int i = 0; i < 4; i++)
        TRY(write_column(h5, &ids[i]));
    unsigned char *kind = NULL;
    TRY(nmm_allocate(&output->context, &kind, (size_t)m->n_element, 1));
    for (int e = 0; e < m->n_element; e++)
        kind[e] = NMM_VTK_POLYGON;
    const fixed_column types = {
        NMM_GRID "/Types", H5T_STD_U8LE, H5T_NATIVE_UCHAR, 0, m->n_element, kind, NULL, NULL};
    const nmm_status status = write_column(h5, &types);
    nmm_release(&output->context, &kind);
    return status;
}

// --- Fields

static const char *const all_cell_field[] = {"block_id", "material", "stress"};

// The fields that were asked for; `name` keeps them.
static nmm_steps steps_of(const nmm_output *output, const char *point_field[2]) {
    nmm_steps steps = {.group = NMM_GRID, .n_kind = 1, .cell_field = all_cell_field};
    if (output->displacement) point_field[steps.n_point_field++] = "displacement";
    if (output->velocity) point_field[steps.n_point_field++] = "velocity";
    steps.point_field = point_field;
    steps.n_cell_field = output->stress ? 3 : 2;
    return steps;
}

// One chunk a frame, so that a frame is read without touching another.
static nmm_status create_field(nmm_h5 *h5, const char *name, int width, int n, const char *unit,
                               const char *meaning) {
    const nmm_h5_table table = {.name = name,
                                .type = H5T_IEEE_F32LE,
                                .width = width,
                                .chunk = (hsize_t)nmm_max_int(n, 1),
                                .compress = true,
                                .unit = unit,
                                .meaning = meaning};
    return nmm_h5_table_create(h5, &table);
}

nmm_status nmm_grid_create(nmm_output *output, const nmm_sim *sim) {
    nmm_h5 *h5 = &output->h5;
    const nmm_model *m = &sim->model;
    const int version[2] = {2, 0};
    TRY(nmm_h5_group_create(h5, NMM_GRID));
    TRY(nmm_h5_attribute_put(h5, NMM_GRID, "Version", H5T_NATIVE_INT, 2, version));
    TRY(nmm_h5_attribute_text(h5, NMM_GRID, "Type", "UnstructuredGrid", 0));
    TRY(write_points(output, m));
    TRY(write_cells(output, m));
    if (output->displacement)
        TRY(create_field(h5, NMM_GRID "/PointData/displacement", 3, m->n_point, "m",
                         "displacement since the start"));
    if (output->velocity)
        TRY(create_field(h5, NMM_GRID "/PointData/velocity", 3, m->n_point, "m/s", "velocity"));
    if (output->stress)
        TRY(create_field(h5, NMM_GRID "/CellData/stress", 6, m->n_element, "Pa",
                         "xx yy zz xy yz xz, tension positive"));
    const char *point_field[2];
    const nmm_steps steps = steps_of(output, point_field);
    return nmm_steps_create(h5, &steps);
}

// Velocity of the points from that of the covers.
static void gather_velocity(const nmm_model *m, const nmm_state *state, float *row) {
    for (int p = 0; p < m->n_point; p++) {
        const int *c = m->element_cover + m->n_local * (long)m->point_element[p];
        const double *w = m->point_weight + m->n_local * (long)p;
        for (int k = 0; k < 2; k++) {
            double sum = 0;
            for (int i = 0; i < m->n_local; i++)
                sum += w[i] * state->velocity[2 * (long)c[i] + k];
            row[3 * (long)p + k] = (float)sum;
        }
        row[3 * (long)p + 2] = 0;
    }
}

static void gather_displacement(const nmm_model *m, const nmm_state *state, float *row) {
    for (long p = 0; p < m->n_point; p++) {
        for (int k = 0; k < 2; k++)
            row[3 * p + k] = (float)(state->position[2 * p + k] - m->point[2 * p + k]);
        row[3 * p + 2] = 0;
    }
}

// In VTK's order of a symmetric tensor.
static void gather_stress(const nmm_model *m, const nmm_state *state, float *row) {
    for (long e = 0; e < m->n_element; e++) {
        const double *s = state->stress + 3 * e;
        const nmm_material *material = &m->material[m->element_material[e]];
        const bool strain = material->plane == NMM_PLANE_STRAIN;
        const double zz = strain ? material->poissons_ratio * (s[0] + s[1]) : 0;
        const double value[6] = {s[0], s[1], zz, s[2], 0, 0};
        for (int i = 0; i < 6; i++)
            row[6 * e + i] = (float)value[i];
    }
}

// Nothing that is not a number gets into a file.
static nmm_status put_field(nmm_output *output, const char *name, int width, int n) {
    float sum = 0;
    const long size = (long)width * n;
    for (long i = 0; i < size; i++)
        sum += output->row[i] - output->row[i];
    if (sum != 0) {
        return nmm_fail(&output->context, NMM_ERROR_NUMERIC,
                        "output: %s is not finite or too large for single precision", name);
    }
    return nmm_h5_put(&output->h5, name, H5T_NATIVE_FLOAT, (hsize_t)output->n_frame * (hsize_t)n,
                      (hsize_t)n, output->row);
}

size_t nmm_grid_bytes(const nmm_output *output, const nmm_model *m) {
    const size_t vectors = (size_t)output->displacement + (size_t)output->velocity;
    const size_t points = vectors * 3 * (size_t)m->n_point;
    const size_t cells = output->stress ? 6 * (size_t)m->n_element : 0;
    const size_t bytes = (points + cells) * sizeof(float);
    // gzip makes nothing larger by more than this.
    return bytes + bytes / 64;
}

nmm_status nmm_grid_append(nmm_output *output, const nmm_sim *sim) {
    const nmm_model *m = &sim->model;
    if (output->displacement) {
        gather_displacement(m, &sim->state, output->row);
        TRY(put_field(output, NMM_GRID "/PointData/displacement", 3, m->n_point));
    }
    if (output->velocity) {
        gather_velocity(m, &sim->state, output->row);
        TRY(put_field(output, NMM_GRID "/PointData/velocity", 3, m->n_point));
    }
    if (output->stress) {
        gather_stress(m, &sim->state, output->row);
        TRY(put_field(output, NMM_GRID "/CellData/stress", 6, m->n_element));
    }
    const char *point_field[2];
    const nmm_steps steps = steps_of(output, point_field);
    const int64_t point_row = (int64_t)output->n_frame * m->n_point;
    const int64_t points[2] = {point_row, point_row};
    const int64_t cells[3] = {0, 0, (int64_t)output->n_frame * m->n_element};
    const nmm_step_row row = {.time = sim->state.time, .point_field = points, .cell_field = cells};
    return nmm_steps_append(&output->h5, &steps, output->n_frame, &row);
}
