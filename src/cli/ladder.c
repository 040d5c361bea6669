// SPDX-License-Identifier: MIT
//
// The ladder of sizes of nmm compare; see ladder.h.

#include "ladder.h"

#include "message.h"
#include "options.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/// Unknowns of the first rung; a rung longer than this is the last [s].
#define FIRST_RUNG 512
#define RUNG_SECONDS 0.3

static const char *const runner_name[RUNNERS] = {"host pcg", "target pcg", "host auto"};

// --- Solves

static void end_ladder(ladder *l, int unknowns, int runner, nmm_status status,
                       const nmm_linear_report *report) {
    l->status = status == NMM_OK ? EXIT_EARLY : exit_status_of(status);
    l->failed_unknowns = unknowns;
    l->failed = runner_name[runner];
    snprintf(l->reason, sizeof l->reason, "%.199s",
             status == NMM_OK ? report->reason : report->error_of_call.message);
}

// All to the same tolerance and from the start: the system and its load are the same ones each
// time, the solver is a new one.
static bool measure_rung(ladder *l, int unknowns, int n_thread) {
    rung *r = &l->rung[l->n_rung];
    for (int runner = 0; runner < RUNNERS; runner++) {
        nmm_linear_report report;
        nmm_linear_def def = nmm_default_linear_def();
        def.generate = unknowns;
        if (runner != HOST_AUTO) {
            def.method = "pcg";
            def.blocks = "cluster";
        }
        def.n_repeat = 3;
        def.n_thread = n_thread;
        def.device = runner == TARGET_PCG ? NMM_DEVICE_TARGET : NMM_DEVICE_HOST;
        const nmm_status status = nmm_linear_solve(&def, &report);
        if (status != NMM_OK || !report.converged) {
            end_ladder(l, unknowns, runner, status, &report);
            return false;
        }
        r->unknowns = report.order;
        r->seconds[runner] = report.seconds;
        if (runner != HOST_AUTO) r->iterations = report.iterations;
        const bool direct = !strcmp(report.method, "direct");
        snprintf(r->best, sizeof r->best, "%s%s%s", report.method, direct ? "" : ", ",
                 direct ? "" : report.blocks);
    }
    return true;
}

// --- Break-even

// Where two straight lines through both rungs cross; 0: beyond the second one nowhere.
static double crossing(const rung *a, const rung *b, int rival) {
    const double before = a->seconds[TARGET_PCG] - a->seconds[rival];
    const double after = b->seconds[TARGET_PCG] - b->seconds[rival];
    if (!(before > after)) return 0;
    return b->unknowns + after / (before - after) * (b->unknowns - a->unknowns);
}

// After the last size at which the rival is no slower, where the target is faster at the end; else
// beyond all sizes.
static break_even find_break_even(const ladder *l, int rival) {
    int first = l->n_rung;
    while (first > 0 && l->rung[first - 1].seconds[TARGET_PCG] < l->rung[first - 1].seconds[rival])
        first--;
    if (first == 0 && l->n_rung > 0) return (break_even){.unknowns = l->rung[0].unknowns};
    if (l->n_rung < 2) return (break_even){0};
    const int second = first < l->n_rung ? first : first - 1;
    return (break_even){.unknowns = crossing(&l->rung[second - 1], &l->rung[second], rival),
                        .is_estimated = true};
}

void ladder_climb(ladder *l, int n_thread) {
    double longest = 0;
    for (int size = FIRST_RUNG; l->n_rung < RUNGS && longest < RUNG_SECONDS; size *= 4) {
        const rung *r = &l->rung[l->n_rung];
        if (!measure_rung(l, size, n_thread)) break;
        l->n_rung += 1;
        for (int runner = 0; runner < RUNNERS; runner++)
            longest = fmax(longest, r->seconds[runner]);
    }
    l->against_pcg = find_break_even(l, HOST_PCG);
    l->against_auto = find_break_even(l, HOST_AUTO);
}

// --- Text

static void print_verdict(const ladder *l, const break_even *b, const char *rival) {
    printf("  against %s the target ", rival);
    if (b->unknowns > 0)
        printf("pays from %s%.3g unknowns on%s\n", b->is_estimated ? "about " : "at most ",
               b->unknowns, b->is_estimated ? " (estimate, by straight lines)" : "");
    else if (l->n_rung == 0)
        printf("was not measured\n");
    else if (l->n_rung == 1)
        printf("does not pay at the only size measured\n");
    else
        printf("does not pay at the largest size measured, nor gains with size\n");
}

void ladder_print(const ladder *l) {
    printf("\nOne solve of a generated system to 1e-8 [s], setup and transfers included\n");
    printf("  unknowns  iterations  host pcg  target pcg  host auto\n");
    for (int k = 0; k < l->n_rung; k++) {
        const rung *r = &l->rung[k];
        printf("  %8d  %10d %9.3g %11.3g %10.3g  (%s)\n", r->unknowns, r->iterations,
               r->seconds[HOST_PCG], r->seconds[TARGET_PCG], r->seconds[HOST_AUTO], r->best);
    }
    if (l->status != EXIT_DONE)
        printf("  ended at %d unknowns, where %s failed: %s\n", l->failed_unknowns, l->failed,
               l->reason);
    print_verdict(l, &l->against_pcg, "the host's pcg");
    print_verdict(l, &l->against_auto, "the host's own choice");
}

// --- JSON

static void json_verdict(json *out, const break_even *b) {
    // JSON knows no infinity: null where the target never pays.
    json_number(out, "unknowns", b->unknowns > 0 ? b->unknowns : INFINITY);
    json_boolean(out, "estimated", b->is_estimated);
}

static void json_rung(json *out, const rung *r) {
    json_open(out, NULL);
    json_integer(out, "unknowns", r->unknowns);
    json_integer(out, "iterations", r->iterations);
    json_number(out, "host_seconds", r->seconds[HOST_PCG]);
    json_number(out, "target_seconds", r->seconds[TARGET_PCG]);
    json_number(out, "host_auto_seconds", r->seconds[HOST_AUTO]);
    json_text(out, "host_auto", r->best);
    json_close(out);
}

void ladder_json(const ladder *l, json *out) {
    json_open(out, "break_even");
    json_verdict(out, &l->against_pcg);
    json_open(out, "against_auto");
    json_verdict(out, &l->against_auto);
    json_close(out);
    json_open_array(out, "measured");
    for (int k = 0; k < l->n_rung; k++)
        json_rung(out, &l->rung[k]);
    json_close_array(out);
    json_text(out, "failed", l->failed);
    json_integer(out, "failed_unknowns", l->failed_unknowns);
    json_text(out, "failed_reason", l->failed != NULL ? l->reason : NULL);
    json_close(out);
}
