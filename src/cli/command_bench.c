// SPDX-License-Identifier: MIT
//
// nmm bench: the experiments of the documentation. Each prints its table and writes NAME.csv,
// NAME.svg and NAME.png into a folder; the first Ctrl-C ends after the measurement under way, and
// what was measured is written.

#include "bench_table.h"
#include "folder.h"
#include "message.h"
#include "options.h"
#include "progress.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define SCENES "examples/paper"

enum { MOST_NAMES = 16 };

/// The command's settings, completed.
typedef struct job {
    const arguments *given;
    const char *folder;
    char scenes[PATH_MAX + 256];
    json out;
    progress line;
} job;

// --- Names

static int complain_name(const char *word) {
    const char *names[MOST_NAMES + 2] = {"all"};
    char list[256] = "all";
    for (int k = 0; k < MOST_NAMES && nmm_bench_list(k).name; k++) {
        names[k + 1] = nmm_bench_list(k).name;
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, ", %s", names[k + 1]);
    }
    const char *near = nearest_name(word, names);
    if (near)
        message_error("nmm bench: no experiment %s; did you mean %s?", word, near);
    else
        message_error("nmm bench: no experiment %s; there are %s", word, list);
    return EXIT_USAGE;
}

static bool is_wanted(const job *j, nmm_bench_name name) {
    return !strcmp(j->given->path, "all") || !strcmp(j->given->path, name.name);
}

// --- Folders

/// The folder of scenes that is installed with this program; "" where that is not known.
static void installed_scenes(char *path, size_t room) {
    char program[PATH_MAX];
    const ssize_t n = readlink("/proc/self/exe", program, sizeof program - 1);
    path[0] = 0;
    if (n <= 0) return;
    program[n] = 0;
    char *slash = strrchr(program, '/');
    if (!slash) return;
    *slash = 0;
    snprintf(path, room, "%s/" NMM_SHARE "/nmm/" SCENES, program);
}

static int find_scenes(job *j) {
    const char *asked = j->given->scenes;
    if (asked) {
        snprintf(j->scenes, sizeof j->scenes, "%s", asked);
        if (is_folder(asked)) return EXIT_DONE;
        message_error("nmm bench: no folder of scenes at %s", asked);
        return EXIT_SYSTEM;
    }
    snprintf(j->scenes, sizeof j->scenes, SCENES);
    if (is_folder(j->scenes)) return EXIT_DONE;
    installed_scenes(j->scenes, sizeof j->scenes);
    if (is_folder(j->scenes)) return EXIT_DONE;
    message_error("nmm bench: no folder of scenes; looked for " SCENES
                  " in the current folder, and for %s; name one with --scenes FOLDER",
                  j->scenes);
    return EXIT_SYSTEM;
}

// --- One experiment

static int show(job *j, nmm_bench *bench, const char *name) {
    if (j->given->json) {
        if (!strcmp(j->given->path, "all")) json_open(&j->out, NULL);
        json_text(&j->out, "bench", name);
        json_boolean(&j->out, "quick", j->given->quick);
        bench_table_json(&j->out, bench);
        if (!strcmp(j->given->path, "all")) json_close(&j->out);
    } else if (!j->given->quiet) {
        bench_table_print(bench);
    }
    if (nmm_bench_rows(bench) == 0) return EXIT_DONE;
    return bench_table_write(bench, j->folder, name, !j->given->json && !j->given->quiet);
}

/// What went wrong, with every mistake where a scene is to blame.
static int complain_bench(const nmm_bench *bench, const char *name) {
    const char *mistakes = nmm_bench_mistakes(bench);
    const nmm_error *error = nmm_bench_error(bench);
    if (!mistakes) return message_failure(error, name);
    fprintf(stderr, "%s%s", mistakes, mistakes[strlen(mistakes) - 1] == '\n' ? "" : "\n");
    return exit_status_of(error->status);
}

static int run_one(job *j, const char *name) {
    const arguments *given = j->given;
    nmm_bench *bench = NULL;
    nmm_bench_def def = nmm_default_bench_def();
    def.name = name;
    def.scenes = j->scenes;
    def.n_thread = given->n_thread_list;
    def.thread = given->thread_list;
    if (given->device != NMM_DEVICE_SCENE) def.device = given->device;
    def.quick = given->quick;
    def.report = progress_measuring;
    def.user = &j->line;
    const nmm_status status = nmm_bench_run(&bench, &def);
    progress_clear(&j->line);
    int end = status == NMM_OK ? show(j, bench, name) : complain_bench(bench, name);
    if (end == EXIT_DONE && nmm_bench_stopped(bench)) {
        message_note("%s: ended early, on request", name);
        end = EXIT_EARLY;
    }
    nmm_bench_destroy(bench);
    return end;
}

// --- The command

static int run_all(job *j) {
    int end = EXIT_DONE, done = 0;
    for (int k = 0; end == EXIT_DONE && nmm_bench_list(k).name; k++) {
        if (!is_wanted(j, nmm_bench_list(k))) continue;
        if (done > 0 && !j->given->json && !j->given->quiet) printf("\n\n");
        end = run_one(j, nmm_bench_list(k).name);
        fflush(stdout);
        done += 1;
    }
    return end;
}

int command_bench(const arguments *given) {
    job j = {.given = given, .folder = given->output ? given->output : "bench"};
    bool known = false, needs_scenes = false;
    j.out.file = stdout;
    j.line = progress_start(0, given->quiet);
    for (int k = 0; nmm_bench_list(k).name; k++) {
        known = known || is_wanted(&j, nmm_bench_list(k));
        needs_scenes =
            needs_scenes || (is_wanted(&j, nmm_bench_list(k)) && nmm_bench_list(k).needs_scenes);
    }
    if (!known) return complain_name(given->path);
    if (given->scenes && !needs_scenes) {
        message_error("nmm bench %s: --scenes has no effect here; it computes scenes of its own",
                      given->path);
        return EXIT_USAGE;
    }
    // What is wrong with folders is told before minutes of measuring.
    const bool there = is_folder(j.folder);
    int end = needs_scenes ? find_scenes(&j) : EXIT_DONE;
    if (end == EXIT_DONE) end = folder_make(j.folder);
    if (end != EXIT_DONE) return end;
    bench_table_listen(there ? NULL : j.folder);
    if (given->json) {
        json_open(&j.out, NULL);
        if (!strcmp(given->path, "all")) json_open_array(&j.out, "benches");
    }
    end = run_all(&j);
    if (given->json) {
        if (!strcmp(given->path, "all")) json_close_array(&j.out);
        json_close(&j.out);
    }
    // Nothing is left behind where nothing was measured.
    if (end != EXIT_DONE && !there) folder_remove_empty(j.folder);
    return end;
}
