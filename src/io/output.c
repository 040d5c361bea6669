// SPDX-License-Identifier: MIT
//
// The writer of run files: creation as temporary + rename, a frame when one is due, the last frame
// and the summary at the end.
//
// For every writing the file is opened, appended to and closed, so that others can look on, and a
// killed run leaves a file whose frames are whole: NSteps is written after everything it counts.
// Ledger and monitors are gathered in memory and written with a frame, or after a second.

#include "output.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

// Seconds after which gathered rows are written even without a frame.
#define WRITE_EVERY 1.0

// --- Lock and names

static nmm_status fail_file(nmm_output *output, int error) {
    return nmm_fail(&output->context, NMM_ERROR_FILE, "cannot write %s: %s", output->path,
                    strerror(error));
}

static nmm_status add_ending(nmm_output *output, const char **text, const char *ending) {
    char *copy = NULL;
    const size_t length = strlen(output->path);
    TRY(nmm_arena_take(&output->context, &output->arena, &copy, length + strlen(ending) + 1, 1));
    memcpy(copy, output->path, length);
    memcpy(copy + length, ending, strlen(ending));
    *text = copy;
    return NMM_OK;
}

// One run a file. The lock goes with the process, so a killed run leaves none behind.
static nmm_status take_lock(nmm_output *output) {
    struct stat mine, there;
    if (stat(output->path, &there) == 0 && S_ISDIR(there.st_mode)) return fail_file(output, EISDIR);
    for (;;) {
        output->lock = open(output->lock_path, O_CREAT | O_RDWR | O_CLOEXEC, 0666);
        if (output->lock < 0) return fail_file(output, errno);
        if (flock(output->lock, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
            close(output->lock);
            output->lock = -1;
            return nmm_fail(&output->context, NMM_ERROR_FILE,
                            "cannot write %s: another run is writing it", output->path);
        }
        // The run before may have removed the file that we opened.
        if (fstat(output->lock, &mine) != 0 || stat(output->lock_path, &there) != 0 ||
            mine.st_ino == there.st_ino)
            return NMM_OK;
        close(output->lock);
    }
}

static void drop_lock(nmm_output *output) {
    if (output->lock < 0) return;
    unlink(output->lock_path);
    close(output->lock);
    output->lock = -1;
}

// --- Frames and rows

static nmm_status append_frame(nmm_output *output, nmm_sim *sim) {
    nmm_h5 *h5 = &output->h5;
    TRY(nmm_grid_append(output, sim));
    if (output->contact) TRY(nmm_contacts_append(output, sim));
    // Everything the new frame needs is on its way to the file before the frame counts.
    TRY(nmm_h5_flush(h5));
    const int n_frame = output->n_frame + 1;
    TRY(nmm_h5_attribute_put(h5, NMM_GRID "/Steps", "NSteps", H5T_NATIVE_INT, 0, &n_frame));
    if (output->contact)
        TRY(nmm_h5_attribute_put(h5, NMM_CONTACTS "/Steps", "NSteps", H5T_NATIVE_INT, 0, &n_frame));
    output->n_frame = n_frame;
    if (output->contact) nmm_contacts_advance(output, sim);
    output->frame_step = sim->state.step;
    return NMM_OK;
}

static nmm_status append_monitors(nmm_output *output, const nmm_model *model) {
    const int n = output->n_ledger;
    TRY(nmm_grow(&output->context, &output->column, &output->column_capacity, n,
                 sizeof *output->column));
    for (int k = 0; k < output->n_monitor; k++) {
        for (int i = 0; i < n; i++)
            output->column[i] = output->monitor[(long)i * output->n_monitor + k];
        bool keep[NMM_MONITOR_COLUMNS];
        const hsize_t range[2] = {(hsize_t)output->table_row, (hsize_t)n};
        nmm_monitor_keep(&model->monitor[k], keep);
        TRY(nmm_h5_record_put(&output->h5, output->monitor_table[k], &nmm_record_monitor, keep,
                              range, output->column));
    }
    return NMM_OK;
}

// Rows gathered since the last writing, and the summary as it stands.
static nmm_status append_tables(nmm_output *output, nmm_sim *sim) {
    nmm_h5 *h5 = &output->h5;
    if (output->n_ledger > 0) {
        const hsize_t range[2] = {(hsize_t)output->table_row, (hsize_t)output->n_ledger};
        TRY(nmm_h5_record_put(h5, NMM_META "/ledger", &nmm_record_step, NULL, range,
                              output->ledger));
        TRY(append_monitors(output, &sim->model));
        output->table_row += output->n_ledger;
        output->n_ledger = 0;
    }
    nmm_summary summary = {0};
    nmm_sim_summary(sim, &summary);
    return nmm_h5_single_set(h5, NMM_META "/summary", &nmm_record_summary, &summary);
}

// What a writing needs at most; tables grow by whole chunks.
static size_t bytes_needed(const nmm_output *output, const nmm_sim *sim, bool frame) {
    const size_t rows = (size_t)output->n_ledger + 256, slack = 1 << 19;
    const size_t monitors = (size_t)output->n_monitor * rows * sizeof(nmm_monitor_row);
    const size_t tables = rows * sizeof(nmm_step_report) + monitors + slack;
    if (!frame) return tables;
    const size_t contacts = output->contact ? nmm_contacts_bytes(output, sim) : 0;
    return tables + nmm_grid_bytes(output, &sim->model) + contacts;
}

// Open, append, close. `state` is the status to store, NULL: as before.
static nmm_status write_now(nmm_output *output, nmm_sim *sim, bool frame, const char *state) {
    nmm_h5 *h5 = &output->h5;
    TRY(nmm_h5_reserve(h5, bytes_needed(output, sim, frame)));
    TRY(nmm_h5_open(h5, NMM_H5_APPEND));
    TRY(append_tables(output, sim));
    if (frame) TRY(append_frame(output, sim));
    if (state != NULL) TRY(nmm_h5_attribute_text(h5, NMM_META, "status", state, 32));
    TRY(nmm_h5_close(h5));
    output->written = nmm_clock();
    return NMM_OK;
}

static nmm_status gather_row(nmm_output *output, nmm_sim *sim, const nmm_step_report *report) {
    const int n = output->n_ledger;
    TRY(nmm_grow(&output->context, &output->ledger, &output->ledger_capacity, n + 1,
                 sizeof *output->ledger));
    TRY(nmm_grow(&output->context, &output->monitor, &output->monitor_capacity,
                 (n + 1) * output->n_monitor, sizeof *output->monitor));
    for (int k = 0; k < output->n_monitor; k++) {
        nmm_reading reading = {0};
        const nmm_status status = nmm_sim_monitor(sim, k, &reading);
        if (status != NMM_OK)
            return nmm_fail(&output->context, status, "output: no reading of monitor %d", k);
        nmm_monitor_row *row = &output->monitor[(long)n * output->n_monitor + k];
        *row = (nmm_monitor_row){.step = report->step, .time = report->time};
        memcpy(row->displacement, reading.displacement, sizeof row->displacement);
        memcpy(row->velocity, reading.velocity, sizeof row->velocity);
        memcpy(row->stress, reading.stress, sizeof row->stress);
    }
    output->ledger[n] = *report;
    output->n_ledger = n + 1;
    output->ledger_step = report->step;
    return NMM_OK;
}

// Has the time passed a multiple of `every` since the last frame?
static bool is_due(nmm_output *output, double time) {
    if (!(output->every > 0)) return true;
    // A rounding error before the multiple still counts.
    const double due = time / output->every + 1e-9;
    const double passed = due < 9e15 ? (double)(long long)due : due;
    if (passed <= output->due) return false;
    output->due = passed;
    return true;
}

// --- Creation

// A small file beside the run's that viewers open as the contacts.
static nmm_status write_pointer(nmm_output *output) {
    const char *slash = strrchr(output->path, '/');
    const char *base = slash != NULL ? slash + 1 : output->path;
    const char *dot = strrchr(base, '.');
    const int stem =
        (int)(dot != NULL && dot > base ? dot - output->path : (long)strlen(output->path));
    char *path = NULL, *temporary = NULL;
    const size_t room = strlen(output->path) + 32;
    TRY(nmm_arena_take(&output->context, &output->arena, &path, room, 1));
    TRY(nmm_arena_take(&output->context, &output->arena, &temporary, room, 1));
    snprintf(path, room, "%.*s.contacts.vtkhdf", stem, output->path);
    snprintf(temporary, room, "%.*s.contacts.part", stem, output->path);
    output->h5.path = temporary;
    TRY(nmm_h5_open(&output->h5, NMM_H5_CREATE));
    const hid_t file = output->h5.file;
    if (H5Lcreate_external(base, "/" NMM_CONTACTS, file, NMM_GRID, H5P_DEFAULT, H5P_DEFAULT) < 0)
        return nmm_h5_fail_write(&output->h5, "external link");
    TRY(nmm_h5_close(&output->h5));
    if (rename(temporary, path) != 0) return fail_file(output, errno);
    return NMM_OK;
}

static nmm_status write_first(nmm_output *output, nmm_sim *sim) {
    nmm_h5 *h5 = &output->h5;
    h5->path = output->temporary;
    TRY(nmm_h5_open(h5, NMM_H5_CREATE));
    TRY(nmm_manifest_write(output, sim));
    TRY(nmm_grid_create(output, sim));
    if (output->contact) TRY(nmm_contacts_create(output, sim));
    TRY(append_tables(output, sim));
    TRY(append_frame(output, sim));
    TRY(nmm_h5_close(h5));
    if (rename(output->temporary, output->path) != 0) return fail_file(output, errno);
    output->renamed = true;
    if (output->contact) TRY(write_pointer(output));
    h5->path = output->path;
    output->written = nmm_clock();
    return NMM_OK;
}

static nmm_status start(nmm_output *output, nmm_sim *sim, const char *path) {
    const nmm_scene_settings *settings = &sim->settings;
    const nmm_model *m = &sim->model;
    char *copy = NULL;
    TRY(nmm_arena_text(&output->context, &output->arena, &copy, path, strlen(path)));
    output->path = copy;
    output->h5 = (nmm_h5){.context = &output->context, .path = copy, .name = copy};
    TRY(add_ending(output, &output->temporary, ".part"));
    TRY(add_ending(output, &output->lock_path, ".lock"));
    output->displacement = settings->out_displacement;
    output->velocity = settings->out_velocity;
    output->stress = settings->out_stress;
    output->contact = settings->out_contact && sim->search != NULL;
    output->every = settings->output_every;
    output->n_monitor = m->n_monitor;
    const int width = nmm_max_int(3 * m->n_point, 6 * m->n_element);
    TRY(nmm_allocate(&output->context, &output->row, (size_t)width, sizeof *output->row));
    TRY(take_lock(output));
    output->ledger_step = sim->state.step;
    is_due(output, sim->state.time);
    return write_first(output, sim);
}

// Since `start` the run waited for its file.
static void book_time(nmm_sim *sim, double start) {
    sim->summary.phase_seconds.output += nmm_clock() - start;
}

// A failed writing ends the use of the file: what is in it stays.
static nmm_status settle(nmm_output *output, nmm_status status) {
    if (status == NMM_OK) return NMM_OK;
    nmm_h5_drop(&output->h5);
    if (output->temporary != NULL && !output->renamed) unlink(output->temporary);
    drop_lock(output);
    return status;
}

nmm_status nmm_output_create(nmm_output **output, nmm_sim *sim, const char *path) {
    nmm_context context = {.allocate = sim->context.allocate,
                           .user = sim->context.user,
                           .n_thread = sim->context.n_thread};
    TRY(nmm_allocate(&context, output, 1, sizeof **output));
    (*output)->context = context;
    (*output)->lock = -1;
    const double before = nmm_clock();
    const nmm_h5_quiet quiet = nmm_h5_quiet_begin();
    const nmm_status status = settle(*output, start(*output, sim, path));
    nmm_h5_quiet_end(quiet);
    book_time(sim, before);
    return status;
}

nmm_status nmm_output_step(nmm_output *output, nmm_sim *sim, const nmm_step_report *report) {
    if (output->context.error.status != NMM_OK) return output->context.error.status;
    // A try that was given up is no step.
    if (report->step <= output->ledger_step) return NMM_OK;
    TRY(gather_row(output, sim, report));
    const bool frame = is_due(output, sim->state.time);
    const double before = nmm_clock();
    if (!frame && before - output->written < WRITE_EVERY) return NMM_OK;
    const nmm_h5_quiet quiet = nmm_h5_quiet_begin();
    const nmm_status status = settle(output, write_now(output, sim, frame, NULL));
    nmm_h5_quiet_end(quiet);
    book_time(sim, before);
    return status;
}

nmm_status nmm_output_finish(nmm_output *output, nmm_sim *sim) {
    if (output->context.error.status != NMM_OK) return output->context.error.status;
    nmm_summary summary = {0};
    nmm_sim_summary(sim, &summary);
    // Stopping without a word is an interruption.
    const nmm_end end = summary.end == NMM_END_RUNNING ? NMM_END_INTERRUPTED : summary.end;
    const bool frame = output->frame_step != sim->state.step;
    const nmm_h5_quiet quiet = nmm_h5_quiet_begin();
    const nmm_status status = settle(output, write_now(output, sim, frame, nmm_end_name(end)));
    nmm_h5_quiet_end(quiet);
    drop_lock(output);
    return status;
}

const nmm_error *nmm_output_error(const nmm_output *output) {
    static const nmm_error no_memory = {.status = NMM_ERROR_MEMORY, .message = "out of memory"};
    return output != NULL ? &output->context.error : &no_memory;
}

size_t nmm_output_peak_bytes(const nmm_output *output) {
    return output->context.peak_bytes;
}

static void destroy_rows(nmm_context *context, nmm_contact_rows *rows) {
    void *member[] = {
        &rows->place,      &rows->force, &rows->normal, &rows->normal_force, &rows->shear_force,
        &rows->gap,        &rows->slid,  &rows->vertex, &rows->edge,         &rows->vertex_block,
        &rows->edge_block, &rows->mode,  &rows->joint,  &rows->sequence};
    for (size_t i = 0; i < sizeof member / sizeof member[0]; i++)
        nmm_release(context, member[i]);
}

void nmm_output_destroy(nmm_output *output) {
    if (output == NULL) return;
    const nmm_h5_quiet quiet = nmm_h5_quiet_begin();
    nmm_h5_drop(&output->h5);
    nmm_h5_quiet_end(quiet);
    drop_lock(output);
    nmm_context context = output->context;
    nmm_release(&context, &output->ledger);
    nmm_release(&context, &output->monitor);
    nmm_release(&context, &output->column);
    nmm_release(&context, &output->row);
    destroy_rows(&context, &output->rows);
    nmm_arena_destroy(&context, &output->arena);
    nmm_release(&context, &output);
}
