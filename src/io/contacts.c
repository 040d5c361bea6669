// SPDX-License-Identifier: MIT
//
// Contacts as temporal VTKHDF PolyData in the group `contacts`: one point for each contact at the
// current place of its vertex, with force, gap, mode and the blocks as point data.
//
// The number of contacts changes, so each frame is a part of its own. VTK's reader miscounts empty
// parts: a frame without contacts therefore holds one row with mode -1 and no force.
//
// A frame starts a chunk of its own (unused rows stay empty and cost nothing), so compressed chunks
// are written once and a killed run loses no older frame. Connectivity is 0, 1, 2, ... for every
// frame and is therefore shared by all.

#include "output.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

typedef enum row_shape { POINT3, VECTOR, SCALAR, INDEX, SMALL } row_shape;

// Every array of a contact: dataset, shape, place in nmm_contact_rows.
typedef struct contact_field {
    const char *name;
    row_shape shape;
    size_t offset;
    const char *unit, *meaning;
} contact_field;
#define ROWS(member) offsetof(nmm_contact_rows, member)
static const contact_field contact_array[] = {
    {"Points", POINT3, ROWS(place), "m", "current place of the vertex"},
    {"force", VECTOR, ROWS(force), "N", "force on the vertex"},
    {"normal", VECTOR, ROWS(normal), "", "outward normal of the edge"},
    {"normal_force", SCALAR, ROWS(normal_force), "N", "pressure positive"},
    {"shear_force", SCALAR, ROWS(shear_force), "N", "on the vertex, along the edge"},
    {"gap", SCALAR, ROWS(gap), "m", "negative: overlap"},
    {"slid", SCALAR, ROWS(slid), "m", "length slid since the contact came to be"},
    {"vertex", INDEX, ROWS(vertex), "", "loop vertex"},
    {"edge", INDEX, ROWS(edge), "", "loop edge, row of nmm/outline"},
    {"vertex_block", INDEX, ROWS(vertex_block), "", "block of the vertex"},
    {"edge_block", INDEX, ROWS(edge_block), "", "block of the edge"},
    {"mode", SMALL, ROWS(mode), "", "0 open, 1 slide, 2 stick, -1 no contact in this frame"},
    {"joint", SMALL, ROWS(joint), "", "1: a joint of the scene made the edge"},
};
enum { N_ARRAY = sizeof contact_array / sizeof contact_array[0], N_FIELD = N_ARRAY - 1 };

typedef struct row_storage {
    hid_t stored, memory;
    int width;
    size_t size; // of a row in memory
} row_storage;

static row_storage storage_of(row_shape shape) {
    switch (shape) {
    case POINT3:
        return (row_storage){H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 3, 3 * sizeof(double)};
    case VECTOR:
        return (row_storage){H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, 3, 3 * sizeof(float)};
    case SCALAR:
        return (row_storage){H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, 0, sizeof(float)};
    case INDEX:
        return (row_storage){H5T_STD_I32LE, H5T_NATIVE_INT, 0, sizeof(int)};
    case SMALL:
        return (row_storage){H5T_STD_I8LE, H5T_NATIVE_INT, 0, sizeof(int)};
    }
    return (row_storage){0};
}

static void *rows_of(nmm_contact_rows *rows, const contact_field *array) {
    void *data = NULL;
    memcpy(&data, (char *)rows + array->offset, sizeof data);
    return data;
}

static const char *path_of(char path[256], const contact_field *array) {
    const char *group = array->shape == POINT3 ? NMM_CONTACTS : NMM_CONTACTS "/PointData";
    return nmm_join(path, group, array->name);
}

static nmm_steps contact_steps(const char *field[N_FIELD]) {
    for (int i = 0; i < N_FIELD; i++)
        field[i] = contact_array[i + 1].name;
    return (nmm_steps){
        .group = NMM_CONTACTS, .n_kind = 4, .n_point_field = N_FIELD, .point_field = field};
}

// --- Creation

static const char *const topology[4] = {"Vertices", "Lines", "Polygons", "Strips"};
static const char *const topology_table[4] = {"NumberOfCells", "NumberOfConnectivityIds",
                                              "Connectivity", "Offsets"};

static nmm_status create_ids(nmm_h5 *h5, const char *group, const char *name, hsize_t chunk) {
    char path[256];
    const nmm_h5_table table = {
        .name = nmm_join(path, group, name), .type = H5T_STD_I64LE, .chunk = chunk};
    return nmm_h5_table_create(h5, &table);
}

nmm_status nmm_contacts_create(nmm_output *output, const nmm_sim *sim) {
    nmm_h5 *h5 = &output->h5;
    const int version[2] = {2, 0};
    char path[256];
    TRY(nmm_h5_group_create(h5, NMM_CONTACTS));
    TRY(nmm_h5_attribute_put(h5, NMM_CONTACTS, "Version", H5T_NATIVE_INT, 2, version));
    TRY(nmm_h5_attribute_text(h5, NMM_CONTACTS, "Type", "PolyData", 0));
    // A chunk of about a frame, from the first frame's contacts.
    hsize_t chunk = 64;
    while (chunk < (hsize_t)sim->state.n_contact && chunk < 1 << 16)
        chunk *= 2;
    output->contact_chunk = (long)chunk;
    TRY(create_ids(h5, NMM_CONTACTS, "NumberOfPoints", 256));
    for (int i = 0; i < 4; i++) {
        nmm_join(path, NMM_CONTACTS, topology[i]);
        for (int k = 0; k < 4; k++)
            TRY(create_ids(h5, path, topology_table[k], k < 2 || i > 0 ? 256 : chunk));
    }
    for (int i = 0; i < N_ARRAY; i++) {
        const contact_field *array = &contact_array[i];
        const row_storage storage = storage_of(array->shape);
        const nmm_h5_table table = {.name = path_of(path, array),
                                    .type = storage.stored,
                                    .width = storage.width,
                                    .chunk = chunk,
                                    .compress = true,
                                    .unit = array->unit,
                                    .meaning = array->meaning};
        TRY(nmm_h5_table_create(h5, &table));
    }
    const char *field[N_FIELD];
    const nmm_steps steps = contact_steps(field);
    return nmm_steps_create(h5, &steps);
}

// --- A frame

static nmm_status grow(nmm_output *output, int needed) {
    nmm_contact_rows *rows = &output->rows;
    if (needed <= rows->capacity) return NMM_OK;
    needed += needed / 2;
    for (int i = 0; i < N_ARRAY; i++) {
        int capacity = rows->capacity;
        const size_t size = storage_of(contact_array[i].shape).size;
        char *place = (char *)rows + contact_array[i].offset;
        TRY(nmm_grow(&output->context, place, &capacity, needed, size));
    }
    int capacity = rows->capacity;
    TRY(nmm_grow(&output->context, &rows->sequence, &capacity, needed + 1, sizeof *rows->sequence));
    for (int i = 0; i <= needed; i++)
        rows->sequence[i] = i;
    rows->capacity = needed;
    return NMM_OK;
}

static nmm_vec2 point_at(const nmm_state *state, int p) {
    return (nmm_vec2){state->position[2 * (long)p], state->position[2 * (long)p + 1]};
}

static void set3(float *row, double x, double y) {
    row[0] = (float)x;
    row[1] = (float)y;
    row[2] = 0;
}

static void gather(nmm_contact_rows *rows, long i, const nmm_sim *sim, const nmm_contact *c) {
    const nmm_model *m = &sim->model;
    const nmm_vec2 p0 = point_at(&sim->state, m->vertex_point[c->vertex]);
    const nmm_vec2 p1 = point_at(&sim->state, m->vertex_point[c->edge]);
    const nmm_vec2 p2 = point_at(&sim->state, m->vertex_point[m->vertex_next[c->edge]]);
    const nmm_vec2 along = nmm_vec2_sub(p2, p1);
    const double length = sqrt(nmm_vec2_dot(along, along));
    const nmm_vec2 t = nmm_vec2_scale(length > 0 ? 1 / length : 0, along);
    const double fn = c->normal_force, fs = c->shear_force;
    rows->place[3 * i] = p0.x + m->origin.x;
    rows->place[3 * i + 1] = p0.y + m->origin.y;
    rows->place[3 * i + 2] = 0;
    set3(rows->normal + 3 * i, t.y, -t.x);
    set3(rows->force + 3 * i, fn * t.y + fs * t.x, -fn * t.x + fs * t.y);
    rows->normal_force[i] = (float)fn;
    rows->shear_force[i] = (float)fs;
    rows->gap[i] = (float)c->gap;
    rows->slid[i] = (float)c->slid;
    rows->vertex[i] = c->vertex;
    rows->edge[i] = c->edge;
    rows->vertex_block[i] = m->vertex_block[c->vertex];
    rows->edge_block[i] = m->vertex_block[c->edge];
    rows->mode[i] = (int)c->mode;
    rows->joint[i] = m->edge_interface[c->edge] >= 0;
}

// The row that stands for "no contact".
static void gather_none(nmm_contact_rows *rows, const nmm_sim *sim) {
    for (int i = 0; i < N_ARRAY; i++)
        memset(rows_of(rows, &contact_array[i]), 0, storage_of(contact_array[i].shape).size);
    if (sim->model.n_point > 0) {
        const nmm_vec2 place = point_at(&sim->state, 0);
        rows->place[0] = place.x + sim->model.origin.x;
        rows->place[1] = place.y + sim->model.origin.y;
    }
    rows->vertex[0] = rows->edge[0] = rows->vertex_block[0] = rows->edge_block[0] = -1;
    rows->mode[0] = NMM_MODE_NONE;
}

// Vertices get one cell a point; the other three kinds stay empty but still have an offset.
static nmm_status append_topology(nmm_output *output, int kind, int n) {
    const hsize_t k = (hsize_t)output->n_frame, rows = kind == 0 ? (hsize_t)n : 0;
    const hsize_t before = kind == 0 ? (hsize_t)output->contact_cell : 0;
    const hsize_t most = kind == 0 ? (hsize_t)output->contact_most : 0;
    const int64_t *sequence = output->rows.sequence;
    const int64_t count = (int64_t)rows;
    // Connectivity grows only when there are more contacts than ever.
    const hsize_t longest = rows > most ? rows : most;
    const hsize_t first[4] = {k, k, most, before + k};
    const hsize_t size[4] = {1, 1, longest - most, rows + 1};
    const int64_t *data[4] = {&count, &count, sequence + most, sequence};
    char group[256], path[256];
    nmm_join(group, NMM_CONTACTS, topology[kind]);
    for (int i = 0; i < 4; i++) {
        nmm_join(path, group, topology_table[i]);
        TRY(nmm_h5_put(&output->h5, path, H5T_NATIVE_INT64, first[i], size[i], data[i]));
    }
    return NMM_OK;
}

static nmm_status append_rows(nmm_output *output, int n) {
    nmm_h5 *h5 = &output->h5;
    const int64_t count = n;
    char path[256];
    nmm_join(path, NMM_CONTACTS, "NumberOfPoints");
    TRY(nmm_h5_put(h5, path, H5T_NATIVE_INT64, (hsize_t)output->n_frame, 1, &count));
    for (int i = 0; i < 4; i++)
        TRY(append_topology(output, i, n));
    for (int i = 0; i < N_ARRAY; i++) {
        const contact_field *array = &contact_array[i];
        TRY(nmm_h5_put(h5, path_of(path, array), storage_of(array->shape).memory,
                       (hsize_t)output->contact_row, (hsize_t)n, rows_of(&output->rows, array)));
    }
    return NMM_OK;
}

nmm_status nmm_contacts_append(nmm_output *output, const nmm_sim *sim) {
    const int n = nmm_max_int(sim->state.n_contact, 1);
    TRY(grow(output, n));
    gather_none(&output->rows, sim);
    for (int i = 0; i < sim->state.n_contact; i++)
        gather(&output->rows, i, sim, &sim->state.contact[i]);
    TRY(append_rows(output, n));
    const char *field[N_FIELD];
    const nmm_steps steps = contact_steps(field);
    int64_t first[N_FIELD];
    for (int i = 0; i < N_FIELD; i++)
        first[i] = output->contact_row;
    const nmm_step_row row = {.time = sim->state.time,
                              .part = output->n_frame,
                              .point = output->contact_row,
                              .point_field = first,
                              .cell = {output->contact_cell}};
    return nmm_steps_append(&output->h5, &steps, output->n_frame, &row);
}

void nmm_contacts_advance(nmm_output *output, const nmm_sim *sim) {
    const long n = nmm_max_int(sim->state.n_contact, 1), chunk = output->contact_chunk;
    output->contact_row += (n + chunk - 1) / chunk * chunk;
    output->contact_cell += n;
    if (n > output->contact_most) output->contact_most = n;
}

size_t nmm_contacts_bytes(const nmm_output *output, const nmm_sim *sim) {
    const size_t chunk = (size_t)output->contact_chunk;
    const size_t rows = ((size_t)sim->state.n_contact / chunk + 2) * chunk;
    size_t row = 2 * sizeof(int64_t);
    for (int i = 0; i < N_ARRAY; i++)
        row += storage_of(contact_array[i].shape).size;
    return rows * row + rows * row / 64;
}
