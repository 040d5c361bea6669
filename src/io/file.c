// SPDX-License-Identifier: MIT
//
// Run files opened for reading: is it one, how many frames, which fields, title, summary, monitors.
// The HDF5 file is opened for each reading only, so the run that writes it never waits for long.

#include "file.h"

#include <errno.h>
#include <math.h>
#include <string.h>
#include <sys/stat.h>

// --- A reading

nmm_status nmm_file_begin(nmm_file *file, nmm_h5 *h5) {
    struct stat about;
    *h5 = (nmm_h5){.context = &file->context, .path = file->path, .name = file->path};
    TRY(nmm_h5_open(h5, NMM_H5_READ));
    if (stat(file->path, &about) != 0) {
        return nmm_fail(&file->context, NMM_ERROR_FILE, "cannot read %s: %s", file->path,
                        strerror(errno));
    }
    if (about.st_dev == file->device && about.st_ino == file->inode) return NMM_OK;
    return nmm_fail(&file->context, NMM_ERROR_FILE, "%s was replaced since it was opened",
                    file->path);
}

nmm_status nmm_file_end(nmm_h5 *h5, nmm_status status) {
    nmm_h5_drop(h5);
    return status;
}

// --- Opening

static nmm_status check_kind(nmm_file *file, nmm_h5 *h5) {
    int format = 0, version[2] = {0, 0};
    char type[32];
    if (!nmm_h5_exists(h5, NMM_META) || !nmm_h5_exists(h5, NMM_GRID)) {
        return nmm_fail(&file->context, NMM_ERROR_INPUT,
                        "%s is an HDF5 file but no run file: it has no groups nmm and VTKHDF",
                        file->path);
    }
    TRY(nmm_h5_attribute_get(h5, NMM_META, "format", H5T_NATIVE_INT, 0, &format));
    if (format != 1) {
        return nmm_fail(&file->context, NMM_ERROR_INPUT,
                        "%s has format %d, this program reads format 1", file->path, format);
    }
    TRY(nmm_h5_attribute_get(h5, NMM_GRID, "Version", H5T_NATIVE_INT, 2, version));
    TRY(nmm_h5_attribute_text_get(h5, NMM_GRID, "Type", type, sizeof type));
    if (version[0] != 2 || strcmp(type, "UnstructuredGrid") != 0)
        return nmm_h5_fail_read(h5, NMM_GRID, "not the expected layout");
    TRY(nmm_h5_attribute_text_get(h5, NMM_META, "title", file->title, sizeof file->title));
    TRY(nmm_h5_attribute_text_get(h5, NMM_META, "scene_path", file->scene_path,
                                  sizeof file->scene_path));
    TRY(nmm_h5_attribute_text_get(h5, NMM_META, "status", file->state, sizeof file->state));
    // Run files of before do not know, and count as dynamic.
    char kind[32] = "dynamic";
    if (nmm_h5_attribute_exists(h5, NMM_META, "kind"))
        TRY(nmm_h5_attribute_text_get(h5, NMM_META, "kind", kind, sizeof kind));
    file->is_static = strcmp(kind, "static") == 0;
    return NMM_OK;
}

static nmm_status read_sizes(nmm_file *file, nmm_h5 *h5) {
    long points = 0, corners = 0, elements = 0;
    TRY(nmm_h5_rows(h5, NMM_GRID "/Points", 3, &points));
    TRY(nmm_h5_rows(h5, NMM_GRID "/Connectivity", 0, &corners));
    TRY(nmm_h5_rows(h5, NMM_GRID "/Offsets", 0, &elements));
    file->n_point = (int)points;
    file->n_corner = (int)corners;
    file->n_element = (int)elements - 1;
    if (file->n_element < 0) return nmm_h5_fail_read(h5, NMM_GRID "/Offsets", "empty");
    file->displacement = nmm_h5_exists(h5, NMM_GRID "/PointData/displacement");
    file->velocity = nmm_h5_exists(h5, NMM_GRID "/PointData/velocity");
    file->stress = nmm_h5_exists(h5, NMM_GRID "/CellData/stress");
    file->contact = nmm_h5_exists(h5, NMM_CONTACTS);
    return NMM_OK;
}

static nmm_status read_times(nmm_file *file, nmm_h5 *h5) {
    const char *name = NMM_GRID "/Steps/Values";
    long rows = 0;
    TRY(nmm_h5_attribute_get(h5, NMM_GRID "/Steps", "NSteps", H5T_NATIVE_INT, 0, &file->n_frame));
    TRY(nmm_h5_rows(h5, name, 0, &rows));
    if (file->n_frame < 1 || file->n_frame > rows)
        return nmm_h5_fail_read(h5, NMM_GRID "/Steps", "NSteps does not fit");
    TRY(nmm_arena_take(&file->context, &file->arena, &file->time, (size_t)file->n_frame,
                       sizeof *file->time));
    TRY(nmm_h5_get(h5, name, H5T_NATIVE_DOUBLE, 0, (const long[2]){0, file->n_frame}, file->time));
    for (int k = 0; k < file->n_frame; k++) {
        if (!isfinite(file->time[k]) || (k > 0 && file->time[k] < file->time[k - 1]))
            return nmm_h5_fail_read(h5, name, "times do not rise");
    }
    return NMM_OK;
}

static nmm_status read_monitor_head(nmm_file *file, nmm_h5 *h5, nmm_file_monitor_head *head) {
    char name[256];
    char *copy = NULL;
    TRY(nmm_h5_attribute_text_get(h5, head->table, "name", name, sizeof name));
    TRY(nmm_arena_text(&file->context, &file->arena, &copy, name, strlen(name)));
    head->name = copy;
    head->displacement = nmm_h5_record_has(h5, head->table, "displacement_x");
    head->velocity = nmm_h5_record_has(h5, head->table, "velocity_x");
    head->stress = nmm_h5_record_has(h5, head->table, "stress_xx");
    return NMM_OK;
}

// The datasets of the monitors stand one a line.
static nmm_status read_monitors(nmm_file *file, nmm_h5 *h5) {
    char *text = NULL;
    size_t length = 0;
    TRY(nmm_h5_text_get(h5, &file->arena, NMM_META "/monitor_tables", &text, &length));
    int n = 0;
    for (size_t i = 0; i < length; i++)
        n += text[i] == '\n';
    TRY(nmm_arena_take(&file->context, &file->arena, &file->monitor, (size_t)n,
                       sizeof *file->monitor));
    for (int k = 0; k < n; k++) {
        char *end = strchr(text, '\n');
        *end = 0;
        file->monitor[k].table = text;
        TRY(read_monitor_head(file, h5, &file->monitor[k]));
        text = end + 1;
    }
    file->n_monitor = n;
    return NMM_OK;
}

static nmm_status read_heads(nmm_file *file, nmm_h5 *h5) {
    TRY(check_kind(file, h5));
    TRY(read_sizes(file, h5));
    TRY(read_times(file, h5));
    TRY(nmm_h5_text_get(h5, &file->arena, NMM_META "/scene", &file->scene, NULL));
    return read_monitors(file, h5);
}

static nmm_status open_file(nmm_file *file, const char *path) {
    struct stat about;
    char *copy = NULL;
    TRY(nmm_arena_text(&file->context, &file->arena, &copy, path, strlen(path)));
    file->path = copy;
    if (stat(path, &about) != 0) {
        return nmm_fail(&file->context, NMM_ERROR_FILE, "cannot read %s: %s", path,
                        strerror(errno));
    }
    file->device = about.st_dev;
    file->inode = about.st_ino;
    nmm_h5 h5 = {0};
    nmm_status status = nmm_file_begin(file, &h5);
    if (status == NMM_OK) status = read_heads(file, &h5);
    return nmm_file_end(&h5, status);
}

nmm_status nmm_file_open_with(nmm_file **file, const char *path, nmm_allocate_hook allocate,
                              void *user) {
    nmm_context context = {.allocate = allocate, .user = user, .n_thread = 1};
    TRY(nmm_allocate(&context, file, 1, sizeof **file));
    (*file)->context = context;
    const nmm_h5_quiet quiet = nmm_h5_quiet_begin();
    const nmm_status status = open_file(*file, path);
    nmm_h5_quiet_end(quiet);
    return status;
}

nmm_status nmm_file_open(nmm_file **file, const char *path) {
    return nmm_file_open_with(file, path, NULL, NULL);
}

void nmm_file_close(nmm_file *file) {
    if (file == NULL) return;
    nmm_context context = file->context;
    nmm_arena_destroy(&context, &file->arena);
    nmm_release(&context, &file);
}

// --- Questions

const nmm_error *nmm_file_error(const nmm_file *file) {
    static const nmm_error no_memory = {.status = NMM_ERROR_MEMORY, .message = "out of memory"};
    return file != NULL ? &file->context.error : &no_memory;
}

nmm_context *nmm_file_context(nmm_file *file) {
    return &file->context;
}

const char *nmm_file_path(const nmm_file *file) {
    return file->path;
}

const char *nmm_file_title(const nmm_file *file) {
    return file->title;
}

bool nmm_file_is_static(const nmm_file *file) {
    return file->is_static;
}

const char *nmm_file_state(const nmm_file *file) {
    return file->state;
}

int nmm_file_frames(const nmm_file *file) {
    return file->n_frame;
}

double nmm_file_time(const nmm_file *file, int k) {
    NMM_ASSERT(k >= 0 && k < file->n_frame);
    return file->time[k];
}

bool nmm_file_has(const nmm_file *file, const char *field) {
    if (strcmp(field, "displacement") == 0) return file->displacement;
    if (strcmp(field, "velocity") == 0) return file->velocity;
    if (strcmp(field, "stress") == 0) return file->stress;
    return strcmp(field, "contact") == 0 && file->contact;
}

const char *nmm_file_scene_path(const nmm_file *file) {
    return file->scene_path;
}

const char *nmm_file_scene_text(nmm_file *file) {
    return file->scene;
}

int nmm_file_monitors(const nmm_file *file) {
    return file->n_monitor;
}

static nmm_status read_summary(nmm_file *file, nmm_h5 *h5, nmm_summary *summary) {
    const char *name = NMM_META "/summary";
    TRY(nmm_file_begin(file, h5));
    TRY(nmm_h5_single_get(h5, name, &nmm_record_summary, summary));
    const int end = (int)summary->end;
    if (end < NMM_END_NO_EQUILIBRIUM || end > NMM_END_COMPLETED)
        return nmm_h5_fail_read(h5, name, "end out of range");
    summary->is_static = file->is_static;
    return NMM_OK;
}

nmm_status nmm_file_summary(nmm_file *file, nmm_summary *summary) {
    *summary = (nmm_summary){0};
    nmm_h5 h5 = {0};
    const nmm_h5_quiet quiet = nmm_h5_quiet_begin();
    const nmm_status status = nmm_file_end(&h5, read_summary(file, &h5, summary));
    nmm_h5_quiet_end(quiet);
    return status;
}

static nmm_status read_last_row(nmm_file *file, nmm_h5 *h5, int k, nmm_monitor_row *row) {
    const char *table = file->monitor[k].table;
    long rows = 0;
    TRY(nmm_file_begin(file, h5));
    TRY(nmm_h5_record_rows(h5, table, &rows));
    // No step yet: at rest.
    if (rows == 0) return NMM_OK;
    return nmm_h5_record_get(h5, table, &nmm_record_monitor, rows - 1, 1, row);
}

nmm_status nmm_file_monitor(nmm_file *file, int k, nmm_reading *reading) {
    if (k < 0 || k >= file->n_monitor) {
        return nmm_fail(&file->context, NMM_ERROR_ARGUMENT, "monitor %d of %d", k, file->n_monitor);
    }
    nmm_monitor_row row = {0};
    nmm_h5 h5 = {0};
    const nmm_h5_quiet quiet = nmm_h5_quiet_begin();
    const nmm_status status = nmm_file_end(&h5, read_last_row(file, &h5, k, &row));
    nmm_h5_quiet_end(quiet);
    const nmm_file_monitor_head *head = &file->monitor[k];
    *reading = (nmm_reading){.name = head->name,
                             .has_displacement = head->displacement,
                             .has_velocity = head->velocity,
                             .has_stress = head->stress};
    memcpy(reading->displacement, row.displacement, sizeof row.displacement);
    memcpy(reading->velocity, row.velocity, sizeof row.velocity);
    memcpy(reading->stress, row.stress, sizeof row.stress);
    return status;
}
