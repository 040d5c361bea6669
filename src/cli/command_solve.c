// SPDX-License-Identifier: MIT
//
// nmm solve: one linear system from Matrix Market files, by any method, with times.

#include "json.h"
#include "message.h"
#include "options.h"

#include <math.h>
#include <stdio.h>

// Iterations and residual, where there is one.
static const char *progress_of(const nmm_linear_report *r, char text[80]) {
    const int n =
        snprintf(text, 80, "%d iteration%s", r->iterations, r->iterations == 1 ? "" : "s");
    if (r->residual >= 0)
        snprintf(text + n, 80 - (size_t)n, ", relative residual %.3g", r->residual);
    return text;
}

static void print_report(const arguments *given, const nmm_linear_report *r) {
    printf("%s: order %d, %ld entries%s\n", given->path, r->order, r->entries,
           r->padded ? "; one decoupled unknown more, as the order is odd" : "");
    printf("  %s, %s blocks, %s precision, on %s, %d thread%s\n", r->method, r->blocks,
           r->precision, r->device, r->n_thread, r->n_thread > 1 ? "s" : "");
    if (r->why[0]) printf("  %s\n", r->why);
    char progress[80];
    printf("  %s%s: %s", r->reason,
           r->by_average_change ? " by the average change of the unknowns, not the residual" : "",
           progress_of(r, progress));
    if (r->lambda_max > 0) printf(", lambda_max %.6g", r->lambda_max);
    printf("\n  %.4g s for setup and solve", r->seconds);
    if (given->linear.n_repeat > 1)
        printf(" (median of %d; least %.4g s)", given->linear.n_repeat, r->least_seconds);
    printf("; files read in %.3g s\n", r->read_seconds);
    if (r->solution_norm < INFINITY)
        printf("  |u| = %.9g", r->solution_norm);
    else
        printf("  |u| is beyond 1.8e308, its numbers are within");
    if (r->error >= 0) printf("; right-hand side: matrix times ones, largest error %.3g", r->error);
    printf("\n");
    if (given->output && r->converged) printf("Solution in %s\n", given->output);
}

static void json_report(const arguments *given, const nmm_linear_report *r) {
    json out = {.file = stdout};
    json_open(&out, NULL);
    json_text(&out, "matrix", given->path);
    json_text(&out, "rhs", given->linear.rhs);
    json_text(&out, "output", r->converged ? given->output : NULL);
    json_integer(&out, "order", r->order);
    json_integer(&out, "padded", r->padded);
    json_integer(&out, "entries", r->entries);
    json_text(&out, "method", r->method);
    json_text(&out, "blocks", r->blocks);
    json_text(&out, "precision", r->precision);
    json_text(&out, "why", r->why);
    json_text(&out, "device", r->device);
    json_boolean(&out, "on_device", r->on_device);
    json_integer(&out, "threads", r->n_thread);
    json_boolean(&out, "converged", r->converged);
    json_text(&out, "end", r->end);
    json_text(&out, "reason", r->reason);
    json_integer(&out, "row", r->row);
    json_integer(&out, "setups", r->setups);
    json_integer(&out, "iterations", r->iterations);
    json_integer(&out, "transfers", r->transfers);
    json_number(&out, "transfer_bytes", r->transfer_bytes);
    json_number(&out, "transfer_seconds", r->transfer_seconds);
    json_boolean(&out, "by_average_change", r->by_average_change);
    json_number(&out, "residual", r->residual >= 0 ? r->residual : NAN);
    json_number(&out, "lambda_min", r->lambda_min);
    json_number(&out, "lambda_max", r->lambda_max);
    json_number(&out, "solution_norm", r->solution_norm);
    if (r->error >= 0) json_number(&out, "error", r->error);
    json_integer(&out, "repeat", given->linear.n_repeat);
    json_number(&out, "seconds", r->seconds);
    json_number(&out, "least_seconds", r->least_seconds);
    json_number(&out, "read_seconds", r->read_seconds);
    json_close(&out);
}

static void complain(const char *path, const nmm_linear_report *r) {
    char row[64] = "", progress[80];
    if (r->row > 0) snprintf(row, sizeof row, "; see rows %d and %d", r->row, r->row + 1);
    message_error("%s: not solved: %s (%s)%s", path, r->reason, progress_of(r, progress), row);
}

int command_solve(const arguments *given) {
    nmm_linear_report report;
    nmm_linear_def def = given->linear;
    def.matrix = given->path;
    def.output = given->output;
    def.n_thread = given->n_thread;
    def.device = given->device;
    if (nmm_linear_solve(&def, &report) != NMM_OK)
        return message_failure(&report.error_of_call, given->path);
    if (!report.converged) complain(given->path, &report);
    if (given->json)
        json_report(given, &report);
    else if (!given->quiet)
        print_report(given, &report);
    return report.converged ? EXIT_DONE : EXIT_EARLY;
}
