// SPDX-License-Identifier: MIT
//
// The group `Steps` of the temporal VTKHDF 2.0 layout: for every step its time and the first row
// of its parts, points, cells and fields. The attribute NSteps is written elsewhere, last.
//
// Chunks that several frames share are not compressed: rows are added in place, so that a killed
// run never leaves a half-written chunk with older rows in it.

#include "output.h"

#include <string.h>

enum { STEP_CHUNK = 256 };

const char *nmm_join(char path[256], const char *group, const char *name) {
    // Every name is one of ours, or cut to 80 bytes.
    const size_t before = strlen(group), after = strlen(name);
    NMM_ASSERT(before + after + 2 <= 256);
    memcpy(path, group, before);
    path[before] = '/';
    memcpy(path + before + 1, name, after + 1);
    return path;
}

// The tables that every kind of data has.
static const char *const plain_table[] = {"PartOffsets", "NumberOfParts", "PointOffsets"};
static const char *const kind_table[] = {"CellOffsets", "ConnectivityIdOffsets"};

static nmm_status create_offsets(nmm_h5 *h5, const char *group, const char *name, int width) {
    char path[256];
    const nmm_h5_table table = {.name = nmm_join(path, group, name),
                                .type = H5T_STD_I64LE,
                                .width = width,
                                .chunk = STEP_CHUNK};
    return nmm_h5_table_create(h5, &table);
}

nmm_status nmm_steps_create(nmm_h5 *h5, const nmm_steps *steps) {
    char group[256], path[256];
    nmm_join(group, steps->group, "Steps");
    TRY(nmm_h5_group_create(h5, group));
    const nmm_h5_table time = {.name = nmm_join(path, group, "Values"),
                               .type = H5T_IEEE_F64LE,
                               .chunk = STEP_CHUNK,
                               .unit = "s",
                               .meaning = "simulated time of a frame"};
    TRY(nmm_h5_table_create(h5, &time));
    for (int i = 0; i < 3; i++)
        TRY(create_offsets(h5, group, plain_table[i], 0));
    for (int i = 0; i < 2; i++)
        TRY(create_offsets(h5, group, kind_table[i], steps->n_kind));
    nmm_join(path, group, "PointDataOffsets");
    if (steps->n_point_field > 0) TRY(nmm_h5_group_create(h5, path));
    for (int i = 0; i < steps->n_point_field; i++)
        TRY(create_offsets(h5, path, steps->point_field[i], 0));
    nmm_join(path, group, "CellDataOffsets");
    if (steps->n_cell_field > 0) TRY(nmm_h5_group_create(h5, path));
    for (int i = 0; i < steps->n_cell_field; i++)
        TRY(create_offsets(h5, path, steps->cell_field[i], 0));
    const int none = 0;
    return nmm_h5_attribute_put(h5, group, "NSteps", H5T_NATIVE_INT, 0, &none);
}

static nmm_status append_offset(nmm_h5 *h5, const char *group, const char *name, int k,
                                const int64_t *value) {
    char path[256];
    return nmm_h5_put(h5, nmm_join(path, group, name), H5T_NATIVE_INT64, (hsize_t)k, 1, value);
}

nmm_status nmm_steps_append(nmm_h5 *h5, const nmm_steps *steps, int k, const nmm_step_row *row) {
    char group[256], path[256];
    const int64_t one = 1;
    nmm_join(group, steps->group, "Steps");
    nmm_join(path, group, "Values");
    TRY(nmm_h5_put(h5, path, H5T_NATIVE_DOUBLE, (hsize_t)k, 1, &row->time));
    TRY(append_offset(h5, group, "PartOffsets", k, &row->part));
    TRY(append_offset(h5, group, "NumberOfParts", k, &one));
    TRY(append_offset(h5, group, "PointOffsets", k, &row->point));
    TRY(append_offset(h5, group, "CellOffsets", k, row->cell));
    TRY(append_offset(h5, group, "ConnectivityIdOffsets", k, row->connectivity));
    nmm_join(path, group, "PointDataOffsets");
    for (int i = 0; i < steps->n_point_field; i++)
        TRY(append_offset(h5, path, steps->point_field[i], k, &row->point_field[i]));
    nmm_join(path, group, "CellDataOffsets");
    for (int i = 0; i < steps->n_cell_field; i++)
        TRY(append_offset(h5, path, steps->cell_field[i], k, &row->cell_field[i]));
    return NMM_OK;
}
