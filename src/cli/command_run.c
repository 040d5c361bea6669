// SPDX-License-Identifier: MIT
//
// nmm run: from the scene file to the run file, step by step.
//
// The run file is whole after each step, whatever ends the run: the scene's end, a step that
// cannot be solved, Ctrl-C, a full disk.

#include "interrupt.h"
#include "message.h"
#include "options.h"
#include "progress.h"
#include "report.h"
#include "scene_open.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

static nmm_status read_monitor(const run_report *report, int k, nmm_reading *reading) {
    return nmm_sim_monitor(report->source, k, reading);
}

static nmm_status write_step(nmm_output *output, nmm_sim *sim, const nmm_step_report *report) {
    interrupt_hold(true);
    const nmm_status status = nmm_output_step(output, sim, report);
    interrupt_hold(false);
    return status;
}

static nmm_status write_end(nmm_output *output, nmm_sim *sim) {
    interrupt_hold(true);
    const nmm_status status = nmm_output_finish(output, sim);
    interrupt_hold(false);
    return status;
}

/// All steps. Returns the exit status; the run file then lacks only its end.
static int take_steps(nmm_sim *sim, nmm_output *output, const char *path, const arguments *given) {
    nmm_summary start;
    nmm_sim_summary(sim, &start);
    progress line = progress_start(start.is_static ? 0 : nmm_sim_end_time(sim), given->quiet);
    nmm_step_report report = {.end = NMM_END_RUNNING};
    while (report.end == NMM_END_RUNNING && !interrupt_asked()) {
        // A failed step leaves the state of the last good one, so what follows still saves it.
        const bool stepped = nmm_sim_step(sim, &report) == NMM_OK;
        const bool written = stepped && write_step(output, sim, &report) == NMM_OK;
        if (!written) {
            progress_clear(&line);
            return stepped ? message_failure(nmm_output_error(output), path)
                           : message_failure(nmm_sim_error(sim), given->path);
        }
        progress_step(&line, &report);
    }
    progress_clear(&line);
    if (report.end == NMM_END_RUNNING) nmm_sim_interrupt(sim);
    return report.end == NMM_END_COMPLETED ? EXIT_DONE : EXIT_EARLY;
}

// Supports are springs: where one gives way visibly, the answer is not that of the scene.
static void warn_of_supports(const nmm_summary *s, const char *path) {
    if (s->max_support_give > 0.01 * s->cover_size)
        message_warning("%s: a support gave way by %.3g m, %.2g %% of the cover size: the material "
                        "is too soft for its loads, or the step too short for the supports to "
                        "follow",
                        path, s->max_support_give, 100 * s->max_support_give / s->cover_size);
}

// What energy came from nowhere, and what the equations leave, says how far the answer goes.
static void warn_of_ledger(const nmm_summary *s, const char *path) {
    if (s->ledger.warning[0]) message_warning("%s: %s", path, s->ledger.warning);
}

static void print_end(nmm_sim *sim, const arguments *given, const char *path, int status) {
    run_report report = {.scene = given->path, .path = path, .n_frame = -1, .source = sim};
    report.reading = read_monitor;
    report.n_monitor = nmm_sim_monitors(sim);
    nmm_sim_summary(sim, &report.summary);
    if (status == EXIT_EARLY) {
        char way[REACHED_LENGTH];
        reached(way, &report.summary);
        message_error("%s: ended early, %s%s%s; results of %s are in %s", given->path,
                      end_name(report.summary.end), report.summary.reason[0] ? ": " : "",
                      report.summary.reason, way, path);
    }
    if (!given->quiet) warn_of_supports(&report.summary, given->path);
    if (!given->quiet) warn_of_ledger(&report.summary, given->path);
    if (given->json)
        report_json(&report);
    else if (!given->quiet)
        report_print(&report);
}

// What was asked for and did not come is told.
static int check_dump(const nmm_sim *sim, const arguments *given) {
    if (!given->dump || nmm_sim_dumped(sim) > 0) return EXIT_DONE;
    message_error("nmm run: --dump-system %ld:%d: the run had no such step or iteration; nothing "
                  "was written",
                  given->dump_step, given->dump_iteration);
    return EXIT_EARLY;
}

static int run_scene(nmm_sim *sim, nmm_output **output, const arguments *given, const char *path) {
    interrupt_hold(true);
    const nmm_status created = nmm_output_create(output, sim, path);
    if (created == NMM_OK) interrupt_names(path);
    interrupt_hold(false);
    if (created != NMM_OK) return message_failure(nmm_output_error(*output), path);
    if (given->dump &&
        nmm_sim_dump_system(sim, given->dump_step, given->dump_iteration, given->dump) != NMM_OK)
        return message_failure(nmm_sim_error(sim), given->dump);
    int status = take_steps(sim, *output, path, given);
    // A failed step is an early end of the caller's making.
    if (status > EXIT_EARLY) nmm_sim_interrupt(sim);
    if (status != EXIT_SYSTEM && write_end(*output, sim) != NMM_OK)
        status = message_failure(nmm_output_error(*output), path);
    print_end(sim, given, path, status);
    return status == EXIT_DONE ? check_dump(sim, given) : status;
}

static void print_warnings(nmm_sim *sim) {
    fputs(nmm_sim_warnings(sim), stderr);
    nmm_check check;
    char warning[MOST_WARNINGS][WARNING_LENGTH];
    if (nmm_sim_check(sim, &check) != NMM_OK) return;
    const int n = scene_warnings(&check, warning);
    for (int i = 0; i < n; i++)
        message_warning("%s", warning[i]);
}

/// Is the run file's name one that a slip of the hand would give? Says so.
static bool is_wrong_output(const arguments *given, const char *path) {
    if (same_file(path, given->path)) {
        message_error("nmm run: --output names the scene itself, %s", path);
        return true;
    }
    static const struct {
        const char *ending, *hint;
    } other[] = {{".png", "a picture; nmm plot draws one from the run file"},
                 {".svg", "a picture; nmm plot draws one from the run file"},
                 {".pdf", "a picture; nmm plot draws one from the run file"},
                 {".vtu", "a file that nmm export writes from the run file"},
                 {".yaml", "a scene"},
                 {".yml", "a scene"}};
    const char *dot = strrchr(path, '.');
    for (size_t k = 0; dot && k < sizeof other / sizeof *other; k++)
        if (!strcasecmp(dot, other[k].ending)) {
            message_error("nmm run: --output %s has the ending of %s; run files end in .vtkhdf",
                          path, other[k].hint);
            return true;
        }
    if (!given->output && is_standard_input(given->path)) {
        message_error("nmm run: a scene from standard input needs --output");
        return true;
    }
    return false;
}

int command_run(const arguments *given) {
    char chosen[4096];
    result_name(chosen, sizeof chosen, given->path, ".vtkhdf");
    const char *path = given->output ? given->output : chosen;
    if (is_wrong_output(given, path)) return EXIT_USAGE;
    interrupt_listen((interrupt_words){"step", "before the first frame, nothing was saved", NULL});
    nmm_sim *sim = NULL;
    nmm_output *output = NULL;
    int status = scene_open(&sim, given);
    if (status == EXIT_DONE && !given->quiet) print_warnings(sim);
    if (status == EXIT_DONE) status = run_scene(sim, &output, given, path);
    nmm_output_destroy(output);
    nmm_sim_destroy(sim);
    return status;
}
