// SPDX-License-Identifier: MIT
//
// nmm trade: speed against accuracy of a scene. Prints the table, writes SCENE.csv, SCENE.svg and
// SCENE.png into a folder, and with --want names the cheapest setting, ready to be used.
//
// The first Ctrl-C ends the trade within a step; what was measured is printed and written.

#include "bench_table.h"
#include "folder.h"
#include "message.h"
#include "options.h"
#include "progress.h"
#include "scene_open.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>

/// The command's settings, completed.
typedef struct job {
    const arguments *given;
    const char *folder;
    progress line;
} job;

// --- What is printed

/// A word as the shell reads it.
static void print_quoted(const char *word) {
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                "_-+=.,:/%@";
    if (*word && strspn(word, plain) == strlen(word)) {
        fputs(word, stdout);
        return;
    }
    putchar('\'');
    for (const char *c = word; *c; c++)
        fputs(*c == '\'' ? "'\\''" : (char[]){*c, 0}, stdout);
    putchar('\'');
}

static void print_choice(const job *j, const nmm_bench *bench, const nmm_trade_result *result) {
    const arguments *given = j->given;
    int seconds = 0, error = 0;
    for (int k = 0; nmm_bench_column_of(bench, k).name; k++) {
        if (!strcmp(nmm_bench_column_of(bench, k).name, "seconds")) seconds = k;
        if (!strcmp(nmm_bench_column_of(bench, k).name, "error")) error = k;
    }
    printf("\nCheapest with an error of at most %.3g %%: %.3g s, %.3g %%", 100 * given->want,
           nmm_bench_number(bench, result->cheapest, seconds),
           nmm_bench_number(bench, result->cheapest, error));
    if (result->unsure > 0)
        printf(" of a reference that is known to %.3g %%", 100 * result->unsure);
    printf(".\n\n  nmm run ");
    print_quoted(given->path);
    for (int k = 0; k < given->n_set; k++) {
        fputs(" --set ", stdout);
        print_quoted(given->set[k]);
    }
    printf("%s%s\n", result->options[0] ? " " : "", result->options);
    if (!result->lines[0]) return;
    printf("\nIn the scene, as keys of these sections:\n\n  ");
    for (const char *c = result->lines; *c; c++)
        fputs(*c == '\n' ? "\n  " : (char[]){*c, 0}, stdout);
    putchar('\n');
}

static void print_json(const job *j, const nmm_bench *bench, const nmm_trade_result *result) {
    const arguments *given = j->given;
    json out = {.file = stdout};
    json_open(&out, NULL);
    json_text(&out, "scene", given->path);
    json_boolean(&out, "quick", given->quick);
    json_text(&out, "quantity", result->quantity);
    json_text(&out, "unit", result->unit);
    if (result->source[0])
        json_numbers(&out, "reference", result->width, result->reference);
    else
        json_text(&out, "reference", NULL);
    json_text(&out, "source", result->source);
    json_number(&out, "unsure_percent", 100 * result->unsure);
    if (given->want > 0) {
        json_number(&out, "want_percent", 100 * given->want);
        json_integer(&out, "cheapest", result->cheapest);
        json_text(&out, "options", result->cheapest < 0 ? NULL : result->options);
        json_text(&out, "lines", result->cheapest < 0 ? NULL : result->lines);
        json_text(&out, "why", result->why[0] ? result->why : NULL);
    }
    bench_table_json(&out, bench);
    json_close(&out);
}

/// Scenes that are called scene.yaml, as the examples, go by the name of their folder.
static void trade_name(char name[NAME_MAX + 1], const char *path) {
    char folder[PATH_MAX];
    const char *slash = strrchr(path, '/');
    result_name(name, NAME_MAX + 1, path, "");
    if (strcmp(name, "scene") != 0 || !slash) return;
    snprintf(folder, sizeof folder, "%.*s", (int)(slash - path), path);
    const char *last = strrchr(folder, '/') ? strrchr(folder, '/') + 1 : folder;
    if (*last && *last != '.') snprintf(name, NAME_MAX + 1, "%.200s", last);
}

static int write_files(const job *j, nmm_bench *bench) {
    char name[NAME_MAX + 1];
    trade_name(name, j->given->path);
    return bench_table_write(bench, j->folder, name, !j->given->json && !j->given->quiet);
}

static int show(const job *j, nmm_bench *bench) {
    const arguments *given = j->given;
    const nmm_trade_result result = nmm_trade_result_of(bench);
    const bool found = result.cheapest >= 0;
    if (given->json)
        print_json(j, bench, &result);
    else if (!given->quiet && nmm_bench_rows(bench) > 0)
        bench_table_print(bench);
    if (!given->json && found) print_choice(j, bench, &result);
    int end = nmm_bench_rows(bench) > 0 ? write_files(j, bench) : EXIT_DONE;
    if (end == EXIT_DONE && nmm_bench_stopped(bench)) {
        message_note("%s: ended early, on request", given->path);
        end = EXIT_EARLY;
    }
    if (end != EXIT_DONE || given->want == 0 || found) return end;
    message_error("%s: %s", given->path, result.why);
    return EXIT_EARLY;
}

// --- The command

static int complain(const nmm_bench *bench, const char *path) {
    const char *mistakes = nmm_bench_mistakes(bench);
    const nmm_error *error = nmm_bench_error(bench);
    if (!mistakes && error->status == NMM_ERROR_ARGUMENT) {
        message_error("nmm trade: %s", error->message);
        return EXIT_USAGE;
    }
    if (!mistakes) return message_failure(error, path);
    fprintf(stderr, "%s%s", mistakes, mistakes[strlen(mistakes) - 1] == '\n' ? "" : "\n");
    return exit_status_of(error->status);
}

static nmm_trade_def definition(job *j) {
    const arguments *given = j->given;
    nmm_trade_def def = nmm_default_trade_def();
    def.path = given->path;
    def.n_override = given->n_set;
    def.override = given->set;
    def.knobs = given->knobs;
    def.quantity = given->quantity;
    def.expect = given->expect;
    def.want = given->want;
    def.longest = given->longest;
    def.quick = given->quick;
    def.n_thread = given->n_thread;
    def.device = given->device;
    def.report = progress_measuring;
    def.user = &j->line;
    return def;
}

int command_trade(const arguments *given) {
    job j = {.given = given, .folder = given->output ? given->output : "trade"};
    nmm_bench *bench = NULL;
    j.line = progress_start(0, given->quiet);
    if (is_standard_input(given->path)) {
        message_error("nmm trade: the scene is read many times, so it must be a file");
        return EXIT_USAGE;
    }
    // What is wrong with the folder is told before minutes of measuring.
    const bool there = is_folder(j.folder);
    const int made = folder_make(j.folder);
    if (made != EXIT_DONE) return made;
    bench_table_listen(there ? NULL : j.folder);
    const nmm_trade_def def = definition(&j);
    const nmm_status status = nmm_trade_run(&bench, &def);
    progress_clear(&j.line);
    const int end = status == NMM_OK ? show(&j, bench) : complain(bench, given->path);
    nmm_bench_destroy(bench);
    // Nothing is left behind where nothing was measured.
    if (end != EXIT_DONE && !there) folder_remove_empty(j.folder);
    return end;
}
