// SPDX-License-Identifier: MIT
//
// The group `nmm` of a run file: where the run came from (scene text and hash, version, compiler,
// machine, settings chosen), what holds and loads the model, the outlines of the blocks, and the
// tables that grow with the steps (ledger, monitors, summary).

#include "output.h"

#include <string.h>
#include <sys/utsname.h>

// --- Provenance

static nmm_status put_text(nmm_h5 *h5, const char *name, const char *text) {
    char path[256], cut[1024];
    if (text == NULL) text = "";
    nmm_join(path, NMM_META, name);
    snprintf(cut, sizeof cut, "%s", text);
    return nmm_h5_attribute_text(h5, NMM_META, name, cut, 0);
}

static const char *build_text(void) {
#ifdef __OPTIMIZE__
    return "optimised";
#else
    return "debug";
#endif
}

static nmm_status write_machine(nmm_h5 *h5) {
    struct utsname about;
    char text[512] = "unknown";
    if (uname(&about) == 0) {
        snprintf(text, sizeof text, "%.120s %.120s %.120s", about.sysname, about.release,
                 about.machine);
    }
    return put_text(h5, "machine", text);
}

static nmm_status write_origin(nmm_output *output, const nmm_sim *sim) {
    nmm_h5 *h5 = &output->h5;
    const nmm_scene *scene = &sim->scene;
    const int format = 1, threads = sim->context.n_thread;
    char hash[20];
    snprintf(hash, sizeof hash, "%016llx",
             (unsigned long long)nmm_hash(NMM_HASH_START, scene->text, scene->text_length));
    TRY(nmm_h5_group_create(h5, NMM_META));
    TRY(nmm_h5_attribute_put(h5, NMM_META, "format", H5T_NATIVE_INT, 0, &format));
    TRY(put_text(h5, "title", scene->title));
    TRY(put_text(h5, "kind", sim->settings.is_static ? "static" : "dynamic"));
    TRY(put_text(h5, "scene_path", scene->path));
    TRY(put_text(h5, "scene_hash", hash));
    TRY(put_text(h5, "version", nmm_version()));
    TRY(put_text(h5, "compiler", __VERSION__));
    TRY(put_text(h5, "build", build_text()));
    TRY(write_machine(h5));
    TRY(nmm_h5_attribute_put(h5, NMM_META, "threads", H5T_NATIVE_INT, 0, &threads));
    TRY(nmm_h5_attribute_text(h5, NMM_META, "status", nmm_end_name(NMM_END_RUNNING), 32));
    TRY(nmm_h5_attribute_put(h5, NMM_META, "origin", H5T_NATIVE_DOUBLE, 2,
                             (const double[2]){sim->model.origin.x, sim->model.origin.y}));
    TRY(nmm_h5_text_create(h5, NMM_META "/scene", scene->text, scene->text_length));
    const char *choices = sim->choices != NULL ? sim->choices : "";
    return nmm_h5_text_create(h5, NMM_META "/choices", choices, strlen(choices));
}

// Names of an array, one a line; entries may be NULL.
static nmm_status write_names(nmm_output *output, const char *path, int n,
                              const char *const *name) {
    size_t size = 1;
    for (int i = 0; i < n; i++)
        size += (name[i] != NULL ? strlen(name[i]) : 0) + 1;
    char *text = NULL;
    TRY(nmm_allocate(&output->context, &text, size, 1));
    size_t used = 0;
    for (int i = 0; i < n; i++) {
        const char *entry = name[i] != NULL ? name[i] : "";
        memcpy(text + used, entry, strlen(entry));
        used += strlen(entry);
        text[used++] = '\n';
    }
    const nmm_status status = nmm_h5_text_create(&output->h5, path, text, used);
    nmm_release(&output->context, &text);
    return status;
}

// --- Supports, loads, outlines

// What is needed to tell whether a block is held as a whole.
typedef struct block_sum {
    int n_cover, n_held;
    bool fix_x, fix_y;
    double area, x, y;
} block_sum;

static void sum_blocks(const nmm_model *m, block_sum *sum) {
    for (int c = 0; c < m->n_cover; c++)
        sum[m->cover_block[c]].n_cover += 1;
    for (int i = 0; i < m->n_hold; i++) {
        block_sum *block = &sum[m->cover_block[m->hold[i].cover]];
        block->n_held += 1;
        block->fix_x |= m->hold[i].fix_x;
        block->fix_y |= m->hold[i].fix_y;
    }
    for (int e = 0; e < m->n_element; e++) {
        block_sum *block = &sum[m->element_block[e]];
        block->area += m->element_area[e];
        block->x += m->element_area[e] * m->element_centre[2 * e];
        block->y += m->element_area[e] * m->element_centre[2 * e + 1];
    }
}

// Support points, then blocks all of whose covers are held. Returns the number of rows.
static int gather_supports(const nmm_model *m, const block_sum *sum, nmm_support_row *row) {
    int n = 0;
    for (int i = 0; i < m->n_support; i++) {
        const nmm_support *s = &m->support[i];
        row[n++] = (nmm_support_row){.x = s->place.x + m->origin.x,
                                     .y = s->place.y + m->origin.y,
                                     .fix_x = s->fix_x,
                                     .fix_y = s->fix_y,
                                     .block = m->element_block[s->element],
                                     .element = s->element};
    }
    for (int b = 0; b < m->n_block; b++) {
        if (sum[b].n_held == 0 || sum[b].n_held < sum[b].n_cover || !(sum[b].area > 0)) continue;
        row[n++] = (nmm_support_row){.x = sum[b].x / sum[b].area + m->origin.x,
                                     .y = sum[b].y / sum[b].area + m->origin.y,
                                     .fix_x = sum[b].fix_x,
                                     .fix_y = sum[b].fix_y,
                                     .block = b,
                                     .element = -1,
                                     .held = 1};
    }
    return n;
}

static nmm_status write_supports(nmm_output *output, const nmm_model *m) {
    const char *name = NMM_META "/supports";
    block_sum *sum = NULL;
    nmm_support_row *row = NULL;
    nmm_status status = nmm_allocate(&output->context, &sum, (size_t)m->n_block, sizeof *sum);
    if (status == NMM_OK)
        status =
            nmm_allocate(&output->context, &row, (size_t)(m->n_support + m->n_block), sizeof *row);
    if (status == NMM_OK) {
        sum_blocks(m, sum);
        const int n = gather_supports(m, sum, row);
        status = nmm_h5_record_create(&output->h5, name, &nmm_record_support, NULL, 256);
        if (status == NMM_OK)
            status = nmm_h5_record_put(&output->h5, name, &nmm_record_support, NULL,
                                       (const hsize_t[2]){0, (hsize_t)n}, row);
    }
    nmm_release(&output->context, &row);
    nmm_release(&output->context, &sum);
    return status;
}

static nmm_status write_loads(nmm_output *output, const nmm_model *m) {
    const char *name = NMM_META "/loads";
    nmm_load_row *row = NULL;
    TRY(nmm_h5_record_create(&output->h5, name, &nmm_record_load, NULL, 256));
    TRY(nmm_allocate(&output->context, &row, (size_t)m->n_load, sizeof *row));
    for (int i = 0; i < m->n_load; i++) {
        const nmm_load *load = &m->load[i];
        row[i] = (nmm_load_row){.x = load->place.x + m->origin.x,
                                .y = load->place.y + m->origin.y,
                                .fx = load->force.x,
                                .fy = load->force.y,
                                .element = load->element,
                                .length = load->length,
                                .history = load->history};
    }
    const nmm_status status = nmm_h5_record_put(&output->h5, name, &nmm_record_load, NULL,
                                                (const hsize_t[2]){0, (hsize_t)m->n_load}, row);
    nmm_release(&output->context, &row);
    return status;
}

// Factors on loads; displacements of supports (width 2) are not among them.
static nmm_status write_histories(nmm_output *output, const nmm_model *m) {
    const char *name = NMM_META "/histories";
    nmm_history_row *row = NULL;
    size_t n = 0;
    for (int k = 0; k < m->n_history; k++)
        n += (size_t)(m->history[k].width == 1 ? m->history[k].n : 0);
    TRY(nmm_h5_record_create(&output->h5, name, &nmm_record_history, NULL, 256));
    TRY(nmm_allocate(&output->context, &row, n, sizeof *row));
    n = 0;
    for (int k = 0; k < m->n_history; k++) {
        const nmm_history *history = &m->history[k];
        for (int i = 0; history->width == 1 && i < history->n; i++)
            row[n++] = (nmm_history_row){k, history->entry[2 * i], history->entry[2 * i + 1]};
    }
    const nmm_status status = nmm_h5_record_put(&output->h5, name, &nmm_record_history, NULL,
                                                (const hsize_t[2]){0, (hsize_t)n}, row);
    nmm_release(&output->context, &row);
    return status;
}

// Loop edges: their two points, block and interface.
static nmm_status write_outline(nmm_output *output, const nmm_model *m) {
    const nmm_h5_table table = {.name = NMM_META "/outline",
                                .type = H5T_STD_I32LE,
                                .width = 5,
                                .chunk = (hsize_t)nmm_max_int(1, nmm_min_int(m->n_vertex, 1 << 20)),
                                .compress = true,
                                .meaning =
                                    "loop edges: two points, block to the left, interface, mate"};
    int *row = NULL;
    TRY(nmm_h5_table_create(&output->h5, &table));
    TRY(nmm_allocate(&output->context, &row, (size_t)m->n_vertex * 5, sizeof *row));
    for (long v = 0; v < m->n_vertex; v++) {
        row[5 * v] = m->vertex_point[v];
        row[5 * v + 1] = m->vertex_point[m->vertex_next[v]];
        row[5 * v + 2] = m->vertex_block[v];
        row[5 * v + 3] = m->edge_interface[v];
        row[5 * v + 4] = m->edge_mate[v];
    }
    const nmm_status status =
        nmm_h5_put(&output->h5, table.name, H5T_NATIVE_INT, 0, (hsize_t)m->n_vertex, row);
    nmm_release(&output->context, &row);
    return status;
}

// --- Tables that grow with the steps

// A dataset's name from a monitor's: no slash, nothing invisible, not too long, none twice.
static nmm_status name_monitor(nmm_output *output, const nmm_model *m, int k) {
    char name[80];
    snprintf(name, sizeof name, "%.48s", m->monitor[k].name != NULL ? m->monitor[k].name : "");
    for (char *c = name; *c != 0; c++) {
        if (*c == '/' || (unsigned char)*c < ' ') *c = '_';
    }
    bool taken = name[0] == 0 || name[0] == '.';
    for (int i = 0; i < k && !taken; i++)
        taken = strcmp(strrchr(output->monitor_table[i], '/') + 1, name) == 0;
    const size_t used = strlen(name);
    if (taken) snprintf(name + used, sizeof name - used, "_%d", k);
    char path[256], *copy = NULL;
    nmm_join(path, NMM_META "/monitors", name);
    TRY(nmm_arena_text(&output->context, &output->arena, &copy, path, strlen(path)));
    output->monitor_table[k] = copy;
    return NMM_OK;
}

void nmm_monitor_keep(const nmm_monitor *monitor, bool keep[NMM_MONITOR_COLUMNS]) {
    for (int i = 0; i < NMM_MONITOR_COLUMNS; i++) {
        keep[i] = i < NMM_MONITOR_DISPLACEMENT ? true
                  : i < NMM_MONITOR_VELOCITY   ? monitor->displacement
                  : i < NMM_MONITOR_STRESS     ? monitor->velocity
                                               : monitor->stress;
    }
}

static nmm_status create_monitor(nmm_output *output, const nmm_model *m, int k) {
    const nmm_monitor *monitor = &m->monitor[k];
    const double place[2] = {monitor->place.x + m->origin.x, monitor->place.y + m->origin.y};
    bool keep[NMM_MONITOR_COLUMNS];
    nmm_monitor_keep(monitor, keep);
    TRY(name_monitor(output, m, k));
    const char *path = output->monitor_table[k];
    TRY(nmm_h5_record_create(&output->h5, path, &nmm_record_monitor, keep, 256));
    const char *name = monitor->name != NULL ? monitor->name : "";
    TRY(nmm_h5_attribute_text(&output->h5, path, "name", name, 0));
    return nmm_h5_attribute_put(&output->h5, path, "place", H5T_NATIVE_DOUBLE, 2, place);
}

static nmm_status create_monitors(nmm_output *output, const nmm_model *m) {
    TRY(nmm_h5_group_create(&output->h5, NMM_META "/monitors"));
    TRY(nmm_arena_take(&output->context, &output->arena, &output->monitor_table,
                       (size_t)m->n_monitor, sizeof *output->monitor_table));
    for (int k = 0; k < m->n_monitor; k++)
        TRY(create_monitor(output, m, k));
    return write_names(output, NMM_META "/monitor_tables", m->n_monitor, output->monitor_table);
}

nmm_status nmm_manifest_write(nmm_output *output, nmm_sim *sim) {
    const nmm_model *m = &sim->model;
    nmm_h5 *h5 = &output->h5;
    TRY(write_origin(output, sim));
    TRY(write_names(output, NMM_META "/overrides", sim->scene.n_override, sim->scene.override));
    TRY(write_names(output, NMM_META "/materials", sim->scene.n_material,
                    sim->scene.material_name));
    if (m->block_name != NULL)
        TRY(write_names(output, NMM_META "/block_names", m->n_block, m->block_name));
    TRY(write_supports(output, m));
    TRY(write_loads(output, m));
    TRY(write_histories(output, m));
    TRY(write_outline(output, m));
    TRY(nmm_h5_record_create(h5, NMM_META "/ledger", &nmm_record_step, NULL, 256));
    TRY(nmm_h5_single_create(h5, NMM_META "/summary", &nmm_record_summary));
    return create_monitors(output, m);
}
