// SPDX-License-Identifier: MIT
//
// The progress line: percent of the scene's time, time left, length of a step, none of them in
// statics; steps, open-close passes, solver iterations. Written to standard error, so that results
// may be piped.

#include "progress.h"

#include "interrupt.h"
#include "message.h"

#include <stdio.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

double clock_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

progress progress_start(double end_time, bool quiet) {
    progress line = {.end_time = end_time, .started = clock_seconds()};
    line.shown = !quiet && is_terminal(stderr);
    return line;
}

static int terminal_columns(void) {
    struct winsize size;
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
    return 80;
}

static void write_line(const char *text) {
    fprintf(stderr, "\r%.*s\033[K", terminal_columns() - 1, text);
    fflush(stderr);
}

/// "47 s", "3 min 20 s", "2 h 5 min".
static void write_duration(char *text, size_t room, double seconds) {
    const long s = seconds < 1e9 ? (long)(seconds + 0.5) : 1000000000L;
    if (s < 60)
        snprintf(text, room, "%ld s", s);
    else if (s < 3600)
        snprintf(text, room, "%ld min %ld s", s / 60, s % 60);
    else
        snprintf(text, room, "%ld h %ld min", s / 3600, s / 60 % 60);
}

void progress_step(progress *line, const nmm_step_report *report) {
    const double now = clock_seconds();
    if (!line->shown || (now - line->drawn < 0.1 && report->end == NMM_END_RUNNING)) return;
    line->drawn = now;
    char text[256], left[32] = "", dt[32] = "";
    int length = 0;
    if (line->end_time > 0 && report->time > 0) {
        const double done = report->time / line->end_time;
        write_duration(left, sizeof left, (now - line->started) * (1 - done) / done);
        length = snprintf(text, sizeof text, "%3.0f %%  %.4g of %.4g s  %s left  ", 100 * done,
                          report->time, line->end_time, left);
        snprintf(dt, sizeof dt, "  dt %.2g s", report->dt);
    }
    snprintf(text + length, sizeof text - (size_t)length, "step %ld%s  open-close %d  solver %d",
             report->step, dt, report->passes, report->solver_iterations);
    write_line(text);
}

int progress_measuring(void *user, const nmm_bench *bench, const char *what, int row) {
    const progress *line = user;
    (void)bench;
    (void)row;
    if (what && line->shown) write_line(what);
    return interrupt_asked();
}

void progress_clear(const progress *line) {
    if (!line->shown) return;
    fputs("\r\033[K", stderr);
    fflush(stderr);
}
