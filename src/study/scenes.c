// SPDX-License-Identifier: MIT
//
// Scenes that experiments compute: those of a folder, and walls and slopes of any size as texts.

#include "bench.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/// Sizes that are tried for a number of unknowns, and how near [logarithm] is near enough.
enum { ENLARGE_TRIES = 8 };
#define ENLARGE_NEAR 0.02

// --- Opening

nmm_status nmm_bench_open(nmm_bench *bench, nmm_sim **sim, const nmm_bench_source *source) {
    nmm_sim_def def = nmm_default_sim_def();
    def.path = source->path;
    def.text = source->text;
    def.text_length = source->text != NULL ? strlen(source->text) : 0;
    def.n_override = source->n_override;
    def.override = source->override;
    def.n_thread = source->n_thread;
    def.device = source->device;
    def.search_always = source->search_always;
    def.allocate = bench->def.allocate;
    def.user = bench->def.allocate_user;
    const nmm_status status = nmm_sim_create(sim, &def);
    if (status == NMM_OK) return NMM_OK;
    bench->context.error = *nmm_sim_error(*sim);
    const char *mistakes = nmm_sim_mistakes(*sim);
    char *copy = NULL;
    if (mistakes == NULL || *mistakes == 0) return status;
    const size_t length = strlen(mistakes);
    if (nmm_arena_text(&bench->context, &bench->arena, &copy, mistakes, length) == NMM_OK)
        bench->mistakes = copy;
    return status;
}

void nmm_bench_close(nmm_sim **sim) {
    nmm_sim_destroy(*sim);
    *sim = NULL;
}

// --- A folder

static int compare_scenes(const void *a, const void *b) {
    const nmm_bench_scene *x = a, *y = b;
    if (x->unknowns != y->unknowns) return x->unknowns < y->unknowns ? -1 : 1;
    return strcmp(x->name, y->name);
}

// What the scene says of itself, with a setting or as it is (NULL).
static nmm_status count_scene(nmm_bench *bench, nmm_bench_scene *scene, const char *setting) {
    const nmm_bench_source source = {.path = scene->path,
                                     .n_thread = 1,
                                     .device = NMM_DEVICE_HOST,
                                     .n_override = setting != NULL,
                                     .override = {setting}};
    nmm_sim *sim = NULL;
    nmm_summary summary;
    const nmm_status status = nmm_bench_open(bench, &sim, &source);
    if (status == NMM_OK) {
        nmm_sim_summary(sim, &summary);
        scene->blocks = summary.blocks;
        scene->unknowns = summary.unknowns;
        scene->size = summary.cover_size;
        scene->whole_blocks = sim->model.whole_blocks;
        scene->is_static = sim->settings.is_static;
    }
    nmm_bench_close(&sim);
    return status;
}

static nmm_status add_scene(nmm_bench *bench, nmm_bench_scenes *scenes, const char *name) {
    const char *path = NULL;
    TRY(nmm_bench_words(bench, &path, "%s/%s/scene.yaml", bench->def.scenes, name));
    if (name[0] == '.' || access(path, R_OK) != 0) return NMM_OK;
    TRY(nmm_grow(&bench->context, &scenes->scene, &scenes->room, scenes->n + 1,
                 sizeof *scenes->scene));
    nmm_bench_scene *scene = &scenes->scene[scenes->n];
    *scene = (nmm_bench_scene){.path = path};
    TRY(nmm_bench_words(bench, &scene->name, "%s", name));
    TRY(count_scene(bench, scene, NULL));
    scenes->n += 1;
    return NMM_OK;
}

nmm_status nmm_bench_find_scenes(nmm_bench *bench, nmm_bench_scenes *scenes) {
    const char *path = bench->def.scenes != NULL ? bench->def.scenes : "";
    DIR *folder = opendir(path);
    if (folder == NULL) {
        return nmm_fail(&bench->context, NMM_ERROR_FILE, "no folder of scenes '%s': %s", path,
                        strerror(errno));
    }
    nmm_status status = NMM_OK;
    for (struct dirent *entry = readdir(folder); entry != NULL && status == NMM_OK;
         entry = readdir(folder))
        status = add_scene(bench, scenes, entry->d_name);
    closedir(folder);
    if (status == NMM_OK && scenes->n == 0) {
        return nmm_fail(&bench->context, NMM_ERROR_FILE,
                        "no scenes in '%s': there must be folders with a file scene.yaml in each",
                        path);
    }
    if (scenes->n > 0)
        qsort(scenes->scene, (size_t)scenes->n, sizeof *scenes->scene, compare_scenes);
    return status;
}

nmm_status nmm_bench_enlarge(nmm_bench *bench, const nmm_bench_scene *scene, double times,
                             const char **setting) {
    double size = scene->size / sqrt(times), nearest = INFINITY;
    // In a plane there are as many nodes as the inverse square of their distance, along edges and
    // joints fewer.
    for (int i = 0; i < ENLARGE_TRIES && nearest > ENLARGE_NEAR; i++) {
        nmm_bench_scene larger = *scene;
        char words[48];
        snprintf(words, sizeof words, "covers.size=%.4g", size);
        TRY(count_scene(bench, &larger, words));
        const double part = larger.unknowns / (times * scene->unknowns);
        if (fabs(log(part)) < nearest) TRY(nmm_bench_keep(bench, setting, words));
        nearest = nmm_min(nearest, fabs(log(part)));
        size *= sqrt(part);
    }
    return NMM_OK;
}

nmm_status nmm_bench_left_out(nmm_bench *bench, const nmm_bench_scenes *scenes,
                              bool (*is_out)(const nmm_bench_scene *scene), const char *why) {
    const char *names = NULL;
    for (int i = 0; i < scenes->n; i++) {
        const nmm_bench_scene *scene = &scenes->scene[i];
        if (!is_out(scene)) continue;
        TRY(nmm_bench_words(bench, &names, "%s%s%s", names != NULL ? names : "",
                            names != NULL ? ", " : "", scene->name));
    }
    return names != NULL ? nmm_bench_remark(bench, "%s: %s.", why, names) : NMM_OK;
}

// --- Texts

// Bricks of 1 x 0.5 m; every other course begins and ends with half a brick. `covers` is what
// stands behind that key.
nmm_status nmm_bench_wall_text(nmm_bench *bench, const char **text, int columns, int courses,
                               const char *covers) {
    const int even = (courses + 1) / 2, odd = courses / 2;
    static const char *const head = "nmm: 1\n"
                                    "title: Brick wall in running bond\n"
                                    "gravity: [0, -9.81]\n"
                                    "materials:\n"
                                    "  brick: {density: 2500, youngs_modulus: 1e9, "
                                    "poissons_ratio: 0.25}\n"
                                    "interfaces: {dry: {friction_angle: 30}}\n"
                                    "interface: dry\n"
                                    "time: {dt: 1e-3, end: 10}\n"
                                    "supports: [{block: base, fix: xy}]\n";
    return nmm_bench_words(bench, text,
                           "%scovers: %s\n"
                           "blocks:\n"
                           "  - {name: base, polygon: [[-2, -1], [%d, -1], [%d, 0], [-2, 0]]}\n"
                           "  - {polygon: [[0, 0], [1, 0], [1, 0.5], [0, 0.5]],"
                           " repeat: {count: [%d, %d], step: [1, 1]}}\n"
                           "  - {polygon: [[0.5, 0.5], [1.5, 0.5], [1.5, 1], [0.5, 1]],"
                           " repeat: {count: [%d, %d], step: [1, 1]}}\n"
                           "  - {polygon: [[0, 0.5], [0.5, 0.5], [0.5, 1], [0, 1]],"
                           " repeat: {count: [2, %d], step: [%d.5, 1]}}\n",
                           head, covers, columns + 2, columns + 2, columns, even, columns - 1, odd,
                           odd, columns - 1);
}

nmm_status nmm_bench_slope_text(nmm_bench *bench, const char **text, double height) {
    const double h = height;
    return nmm_bench_words(
        bench, text,
        "nmm: 1\n"
        "title: Jointed rock slope\n"
        "gravity: [0, -9.81]\n"
        "domain: [{polygon: [[0, 0], [%.3f, 0], [%.3f, %.3f], [%.3f, %.3f], [%.3f, %.3f],"
        " [0, %.3f]]}]\n"
        "joint_sets:\n"
        "  - {dip: 25, spacing: 4, origin: [0.3, 0.2]}\n"
        "  - {dip: 115, spacing: 4, origin: [0.3, 0.2]}\n"
        "materials: {rock: {density: 2500, youngs_modulus: 5e9, poissons_ratio: 0.25}}\n"
        "interfaces: {joint: {friction_angle: 35}}\n"
        "interface: joint\n"
        "covers: {size: 1.5}\n"
        "supports:\n"
        "  - {segment: [[0, 0], [%.3f, 0]], fix: xy}\n"
        "  - {segment: [[0, 0], [0, %.3f]], fix: x}\n"
        "  - {segment: [[%.3f, 0], [%.3f, %.3f]], fix: x}\n"
        "time: {dt: 1e-3, end: 10}\n",
        2 * h, 2 * h, 0.4 * h, 1.4 * h, 0.4 * h, 0.9 * h, h, h, 2 * h, h, 2 * h, 2 * h, 0.4 * h);
}
