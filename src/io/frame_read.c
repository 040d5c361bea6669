// SPDX-License-Identifier: MIT
//
// One frame of a run file: fields of points and elements, contacts. Rows are found by the offsets
// of the time step, and every number is checked.

#include "file.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

// First row of a field at step k: Steps/<group>/<field>[k].
static nmm_status find_row(nmm_h5 *h5, const char *grid, const char *field, int k, long *row) {
    char steps[256], path[256];
    int64_t first = -1;
    nmm_join(steps, grid, "Steps");
    nmm_join(path, steps, field);
    TRY(nmm_h5_get(h5, path, H5T_NATIVE_INT64, 0, (const long[2]){k, 1}, &first));
    if (first < 0 || first > INT64_MAX / 64) return nmm_h5_fail_read(h5, path, "negative offset");
    *row = (long)first;
    return NMM_OK;
}

static bool all_finite(long n, const double *x) {
    double sum = 0;
    for (long i = 0; i < n; i++)
        sum += x[i] - x[i];
    return sum == 0;
}

// Rows of `width` numbers; the first `keep` of each stay.
static nmm_status read_field(nmm_file *file, nmm_h5 *h5, const char *name, const char *offsets,
                             const int shape[3], double **field) {
    const int k = shape[0], n = shape[1], width = shape[2];
    char path[256];
    long row = 0;
    TRY(find_row(h5, NMM_GRID, offsets, k, &row));
    TRY(nmm_allocate(&file->context, field, (size_t)n * (size_t)width, sizeof **field));
    nmm_join(path, NMM_GRID, name);
    TRY(nmm_h5_get(h5, path, H5T_NATIVE_DOUBLE, width, (const long[2]){row, n}, *field));
    if (!all_finite((long)n * width, *field))
        return nmm_h5_fail_read(h5, path, "a value is no number");
    // Vectors lose their z.
    if (width != 3) return NMM_OK;
    for (long i = 0; i < n; i++) {
        (*field)[2 * i] = (*field)[3 * i];
        (*field)[2 * i + 1] = (*field)[3 * i + 1];
    }
    return NMM_OK;
}

// --- Contacts

// Where each array goes in nmm_file_contact. Width 3: x and y are kept. Width 0: one number.
typedef struct contact_part {
    const char *name;
    int width;
    bool whole; // an int
    size_t offset;
} contact_part;
#define AT(name) offsetof(nmm_file_contact, name)
static const contact_part contact_member[] = {
    {NMM_CONTACTS "/Points", 3, false, AT(place)},
    {NMM_CONTACTS "/PointData/force", 3, false, AT(force)},
    {NMM_CONTACTS "/PointData/normal", 3, false, AT(normal)},
    {NMM_CONTACTS "/PointData/normal_force", 0, false, AT(normal_force)},
    {NMM_CONTACTS "/PointData/shear_force", 0, false, AT(shear_force)},
    {NMM_CONTACTS "/PointData/gap", 0, false, AT(gap)},
    {NMM_CONTACTS "/PointData/slid", 0, false, AT(slid)},
    {NMM_CONTACTS "/PointData/vertex", 0, true, AT(vertex)},
    {NMM_CONTACTS "/PointData/edge", 0, true, AT(edge)},
    {NMM_CONTACTS "/PointData/vertex_block", 0, true, AT(vertex_block)},
    {NMM_CONTACTS "/PointData/edge_block", 0, true, AT(edge_block)},
    {NMM_CONTACTS "/PointData/mode", 0, true, AT(mode)},
    {NMM_CONTACTS "/PointData/joint", 0, true, AT(joint)},
};

// Rows `range` of one array into the contacts; `scratch` has room for three doubles a contact.
static nmm_status read_member(nmm_h5 *h5, const contact_part *member, const long range[2],
                              void *scratch, nmm_file_contact *contact) {
    const hid_t memory = member->whole ? H5T_NATIVE_INT : H5T_NATIVE_DOUBLE;
    const size_t size = member->whole ? sizeof(int) : sizeof(double);
    const size_t stride = member->width == 3 ? 3 * size : size;
    const size_t keep = member->width == 3 ? 2 * size : size;
    TRY(nmm_h5_get(h5, member->name, memory, member->width, range, scratch));
    if (!member->whole && !all_finite(range[1] * (member->width == 3 ? 3 : 1), scratch))
        return nmm_h5_fail_read(h5, member->name, "a value is no number");
    for (long i = 0; i < range[1]; i++) {
        memcpy((char *)&contact[i] + member->offset, (const char *)scratch + (size_t)i * stride,
               keep);
    }
    return NMM_OK;
}

// Drop the row that stands for "no contact"; check the others.
static nmm_status settle_contacts(nmm_h5 *h5, const nmm_file_geometry *g, nmm_file_frame *frame) {
    int n = 0;
    for (int i = 0; i < frame->n_contact; i++) {
        const nmm_file_contact *c = &frame->contact[i];
        if (c->mode == NMM_MODE_NONE) continue;
        const bool fits = c->mode >= 0 && c->mode <= NMM_CONTACT_STICK && c->vertex >= 0 &&
                          c->vertex < g->n_edge && c->edge >= 0 && c->edge < g->n_edge &&
                          c->vertex_block >= 0 && c->vertex_block < g->n_block &&
                          c->edge_block >= 0 && c->edge_block < g->n_block;
        if (!fits) return nmm_h5_fail_read(h5, NMM_CONTACTS, "a value is out of range");
        frame->contact[n++] = *c;
    }
    frame->n_contact = n;
    return NMM_OK;
}

static nmm_status read_contacts(nmm_file *file, nmm_h5 *h5, nmm_file_frame *frame) {
    long row = 0, total = 0;
    int64_t n = 0;
    TRY(find_row(h5, NMM_CONTACTS, "PointOffsets", frame->index, &row));
    TRY(nmm_h5_rows(h5, NMM_CONTACTS "/Points", 3, &total));
    TRY(nmm_h5_get(h5, NMM_CONTACTS "/NumberOfPoints", H5T_NATIVE_INT64, 0,
                   (const long[2]){frame->index, 1}, &n));
    if (n < 0 || row > total || n > total - row)
        return nmm_h5_fail_read(h5, NMM_CONTACTS "/NumberOfPoints", "does not fit");
    frame->has_contact = true;
    frame->n_contact = (int)n;
    TRY(nmm_allocate(&file->context, &frame->contact, (size_t)n, sizeof *frame->contact));
    double *scratch = NULL;
    TRY(nmm_allocate(&file->context, &scratch, (size_t)n * 3, sizeof *scratch));
    const long range[2] = {row, (long)n};
    nmm_status status = NMM_OK;
    for (size_t i = 0; status == NMM_OK && i < sizeof contact_member / sizeof *contact_member; i++)
        status = read_member(h5, &contact_member[i], range, scratch, frame->contact);
    nmm_release(&file->context, &scratch);
    return status == NMM_OK ? settle_contacts(h5, &file->geometry, frame) : status;
}

// --- A frame

static nmm_status read_frame(nmm_file *file, nmm_h5 *h5, nmm_file_frame *frame) {
    const int points[3] = {frame->index, file->n_point, 3};
    const int elements[3] = {frame->index, file->n_element, 6};
    TRY(nmm_file_begin(file, h5));
    if (file->displacement)
        TRY(read_field(file, h5, "PointData/displacement", "PointDataOffsets/displacement", points,
                       &frame->displacement));
    if (file->velocity)
        TRY(read_field(file, h5, "PointData/velocity", "PointDataOffsets/velocity", points,
                       &frame->velocity));
    if (file->stress)
        TRY(read_field(file, h5, "CellData/stress", "CellDataOffsets/stress", elements,
                       &frame->stress));
    if (file->contact) TRY(read_contacts(file, h5, frame));
    return NMM_OK;
}

// Factors of the loads' histories at the time of the frame, and the largest of all frames.
static nmm_status find_factors(nmm_file *file, nmm_file_frame *frame) {
    const nmm_file_geometry *g = &file->geometry;
    const size_t n = (size_t)g->n_load;
    double *most = NULL;
    TRY(nmm_allocate(&file->context, &frame->load_factor, n, sizeof *frame->load_factor));
    TRY(nmm_allocate(&file->context, &frame->load_most, n, sizeof *frame->load_most));
    TRY(nmm_allocate(&file->context, &most, (size_t)file->n_history, sizeof *most));
    for (int h = 0; h < file->n_history; h++) {
        for (int k = 0; k < file->n_frame && file->history[h].n > 0; k++) {
            double factor = 0;
            nmm_history_value(&file->history[h], file->time[k], &factor);
            most[h] = nmm_max(most[h], fabs(factor));
        }
    }
    for (int i = 0; i < g->n_load; i++) {
        const int h = g->load[i].history;
        frame->load_factor[i] = 1;
        frame->load_most[i] = h >= 0 ? most[h] : 1;
        if (h >= 0) nmm_history_value(&file->history[h], frame->time, &frame->load_factor[i]);
    }
    nmm_release(&file->context, &most);
    return NMM_OK;
}

nmm_status nmm_file_frame_read(nmm_file *file, int k, nmm_file_frame *frame) {
    const nmm_file_geometry *geometry = NULL;
    if (k < 0 || k >= file->n_frame) {
        return nmm_fail(&file->context, NMM_ERROR_ARGUMENT, "%s: frame %d is not there, it has %d",
                        file->path, k, file->n_frame);
    }
    TRY(nmm_file_geometry_read(file, &geometry));
    frame->index = k;
    frame->time = file->time[k];
    TRY(find_factors(file, frame));
    nmm_h5 h5 = {0};
    const nmm_h5_quiet quiet = nmm_h5_quiet_begin();
    const nmm_status status = nmm_file_end(&h5, read_frame(file, &h5, frame));
    nmm_h5_quiet_end(quiet);
    return status;
}

void nmm_file_frame_destroy(nmm_file *file, nmm_file_frame *frame) {
    nmm_release(&file->context, &frame->displacement);
    nmm_release(&file->context, &frame->velocity);
    nmm_release(&file->context, &frame->stress);
    nmm_release(&file->context, &frame->contact);
    nmm_release(&file->context, &frame->load_factor);
    nmm_release(&file->context, &frame->load_most);
    *frame = (nmm_file_frame){0};
}
