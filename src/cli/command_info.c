// SPDX-License-Identifier: MIT
//
// nmm info: what happened in a run, from its file.

#include "message.h"
#include "options.h"
#include "report.h"

static nmm_status read_monitor(const run_report *report, int k, nmm_reading *reading) {
    return nmm_file_monitor(report->source, k, reading);
}

int command_info(const arguments *given) {
    nmm_file *file = NULL;
    run_report report = {.scene = given->path, .path = given->path};
    int status = EXIT_DONE;
    if (nmm_file_open(&file, given->path) != NMM_OK ||
        nmm_file_summary(file, &report.summary) != NMM_OK) {
        status = message_failure(nmm_file_error(file), given->path);
    } else {
        report.source = file;
        report.scene = nmm_file_scene_path(file);
        report.reading = read_monitor;
        report.n_monitor = nmm_file_monitors(file);
        report.n_frame = nmm_file_frames(file);
        (given->json ? report_json : report_print)(&report);
    }
    nmm_file_close(file);
    return status;
}
