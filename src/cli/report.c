// SPDX-License-Identifier: MIT
//
// A run as text and as JSON, on standard output.
//
// The names in the JSON object are a promise to other programs: they may be added to, never
// renamed. Without a recorded end (a killed program, or one that still runs) a run counts as
// interrupted.

#include "report.h"

#include "json.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *end_name(nmm_end end) {
    return nmm_end_name(end == NMM_END_RUNNING ? NMM_END_INTERRUPTED : end);
}

void reached(char text[REACHED_LENGTH], const nmm_summary *s) {
    if (!s->is_static)
        snprintf(text, REACHED_LENGTH, "%ld steps to %.9g s", s->steps, s->time);
    else
        snprintf(text, REACHED_LENGTH, "%ld steps%s", s->steps,
                 s->end == NMM_END_COMPLETED ? " to equilibrium" : "");
}

static const char *reason_of(const nmm_summary *s) {
    if (s->reason[0]) return s->reason;
    return s->end == NMM_END_RUNNING ? "no end was recorded: still running, or killed" : "";
}

// --- Text

static double part(double value, double whole) {
    return whole > 0 ? 100 * value / whole : 0;
}

static void print_phases(const nmm_summary *s) {
    const nmm_phases *p = &s->phase_seconds;
    const struct {
        const char *name;
        double seconds;
    } row[] = {{"contact", p->contact},
               {"assemble", p->assemble},
               {"solve", p->solve},
               {"advance", p->advance},
               {"output", p->output}};
    printf("\nTime by phase           s     %%\n");
    for (int i = 0; i < 5; i++)
        printf("  %-12s %10.3f %5.1f\n", row[i].name, row[i].seconds,
               part(row[i].seconds, s->wall_seconds));
    printf("  %-12s %10.3f\n", "whole run", s->wall_seconds);
}

static void print_energy(const nmm_energy *e) {
    const struct {
        const char *name;
        double joule;
    } row[] = {{"kinetic", e->kinetic},   {"strain", e->strain},       {"contact", e->contact},
               {"friction", e->friction}, {"fracture", e->fracture},   {"support", e->support},
               {"damping", e->damping},   {"numerical", e->numerical}, {"residual", e->residual}};
    double scale = fabs(e->external);
    for (int i = 0; i < 8; i++)
        scale = fmax(scale, fabs(row[i].joule));
    printf("\nEnergy                  J     %% of the largest\n");
    printf("  %-12s %10.4g %6.2f   work put in; it went into:\n", "external", e->external,
           part(e->external, scale));
    for (int i = 0; i < 9; i++)
        printf("  %-12s %10.4g %6.2f\n", row[i].name, row[i].joule, part(row[i].joule, scale));
}

static void print_ledger(const nmm_ledger *ledger) {
    const double scale = ledger->largest;
    printf("  largest energy %.4g J; of it from nowhere %.2g %%, residual %.2g %%\n", scale,
           part(ledger->gain, scale), part(ledger->residual, scale));
    if (ledger->warning[0]) printf("  warning: %s\n", ledger->warning);
}

static void print_monitor(const nmm_reading *r) {
    printf("  %-12s", r->name);
    if (r->has_displacement)
        printf(" displacement %.4g %.4g m ", r->displacement[0], r->displacement[1]);
    if (r->has_velocity) printf(" velocity %.4g %.4g m/s ", r->velocity[0], r->velocity[1]);
    if (r->has_stress)
        printf(" stress xx %.4g yy %.4g xy %.4g Pa", r->stress[0], r->stress[1], r->stress[2]);
    printf("\n");
}

static void print_monitors(const run_report *report) {
    if (report->n_monitor > 0) printf("\nMonitors at the end\n");
    for (int k = 0; k < report->n_monitor; k++) {
        nmm_reading reading;
        if (report->reading(report, k, &reading) == NMM_OK) print_monitor(&reading);
    }
}

// Of a method without a float32 form nothing else tells that mixed precision was not used.
static void print_precision(const nmm_summary *s) {
    if (s->with_mixed > 0 && s->with_mixed < s->solves)
        printf("  mixed precision in %ld solves, double in %ld\n", s->with_mixed,
               s->solves - s->with_mixed);
    if (s->fell_back > 0)
        printf("  in %ld solves double went on after single precision; the last: %s\n",
               s->fell_back, s->fall_back);
    if (!strcmp(s->precision_asked, "mixed") && s->with_mixed + s->fell_back == 0)
        printf("  mixed precision was asked for and not used: %s\n",
               s->solves > 0 ? "the method has no single precision form" : "nothing was solved");
}

// Where augmented contact did nothing, or not all: the answer goes by the penalty there.
static void print_carried(const nmm_summary *s) {
    if (s->not_raised == 0) return;
    printf("  augmented contact carried %s: in %ld of %ld closed contacts of all steps springs of "
           "the penalty alone act: the contact is too short for more, or a short step did not "
           "settle otherwise\n",
           s->not_raised == s->pressed ? "nothing" : "only part", s->not_raised, s->pressed);
}

// Kinds of solves, where there is more to tell than the method's name.
static void print_solves(const nmm_summary *s) {
    const struct {
        const char *name;
        long n;
    } kind[] = {{"direct", s->with_direct},
                {"2x2 blocks", s->with_cover},
                {"clusters", s->with_cluster},
                {"clusters and bodies", s->with_body},
                {"friction's coupling, by minimal residuals (GMRES)", s->with_friction}};
    int n = 0;
    for (int k = 0; k < 5 && (s->with_cover < s->solves || s->why_solves > 0); k++)
        if (kind[k].n > 0)
            printf("%s%s in %ld", n++ == 0 ? "  solved with " : ", ", kind[k].name, kind[k].n);
    if (n > 0) printf("\n");
    if (s->why_solves > 0) printf("  why, in %ld solves: %s\n", s->why_solves, s->why);
    print_precision(s);
    if (s->by_average_change > 0)
        printf("  %ld solves ended by the average change, whatever their residual\n",
               s->by_average_change);
}

static void print_steps(const nmm_summary *s) {
    const double steps = s->steps > 0 ? (double)s->steps : 1,
                 solves = s->solves > 0 ? s->solves : 1;
    char way[REACHED_LENGTH];
    reached(way, s);
    printf("  %s in %.3g s of wall time; %ld shortened; %.2f open-close passes a step\n", way,
           s->wall_seconds, s->dt_cuts, s->open_close_iterations / steps);
    printf("  solver %s on %s, %s precision: %ld solves, %.1f iterations each, %ld failed",
           s->method, s->device, s->precision, s->solves, s->iterations / solves, s->failed);
    // Run files of before do not know.
    if (s->solve_threads > 0)
        printf("; up to %d thread%s", s->solve_threads, s->solve_threads > 1 ? "s" : "");
    printf("\n");
    print_solves(s);
    if (s->transfers > 0) {
        printf("  %ld transfers to and from the device, %.3g MB, %.3g s: a solve %.1f, %.3g kB\n",
               s->transfers, 1e-6 * s->transfer_bytes, s->transfer_seconds,
               (double)s->transfers / solves, 1e-3 * s->transfer_bytes / solves);
    }
}

void report_print(const run_report *report) {
    const nmm_summary *s = &report->summary;
    const char *reason = reason_of(s);
    printf("%s: %s%s%s\n", report->scene, end_name(s->end), *reason ? ": " : "", reason);
    printf("  %d blocks, %d elements, %d covers, %d unknowns, %d contacts\n", s->blocks,
           s->elements, s->covers, s->unknowns, s->contacts);
    print_steps(s);
    printf("  worst penetration %.3g m; largest give of a support %.3g m\n", s->max_penetration,
           s->max_support_give);
    print_carried(s);
    print_phases(s);
    print_energy(&s->energy);
    // Run files of before do not know.
    if (s->ledger.largest > 0) print_ledger(&s->ledger);
    print_monitors(report);
    if (report->n_frame >= 0)
        printf("\nResults in %s, %d frames\n", report->path, report->n_frame);
    else
        printf("\nResults in %s\n", report->path);
}

// --- JSON

static void json_counts(json *out, const nmm_summary *s) {
    json_integer(out, "blocks", s->blocks);
    json_integer(out, "elements", s->elements);
    json_integer(out, "covers", s->covers);
    json_integer(out, "unknowns", s->unknowns);
    json_integer(out, "contacts", s->contacts);
    json_text(out, "kind", s->is_static ? "static" : "dynamic");
    json_integer(out, "steps", s->steps);
    json_number(out, "time", s->time);
    json_text(out, "end", end_name(s->end));
    json_text(out, "reason", reason_of(s));
}

void json_phases(json *out, const nmm_summary *s) {
    json_open(out, "phase_seconds");
    json_number(out, "contact", s->phase_seconds.contact);
    json_number(out, "assemble", s->phase_seconds.assemble);
    json_number(out, "solve", s->phase_seconds.solve);
    json_number(out, "advance", s->phase_seconds.advance);
    json_number(out, "output", s->phase_seconds.output);
    json_close(out);
}

void json_solver(json *out, const nmm_summary *s) {
    json_open(out, "solver");
    json_text(out, "method", s->method);
    json_text(out, "device", s->device);
    json_boolean(out, "on_device", s->on_device);
    json_text(out, "precision", s->precision);
    json_text(out, "precision_asked", s->precision_asked);
    json_integer(out, "mixed", s->with_mixed);
    json_integer(out, "fell_back", s->fell_back);
    json_text(out, "fall_back", s->fall_back);
    json_integer(out, "threads", s->solve_threads);
    json_text(out, "why", s->why);
    json_integer(out, "why_solves", s->why_solves);
    json_integer(out, "by_average_change", s->by_average_change);
    json_integer(out, "solves", s->solves);
    json_integer(out, "iterations", s->iterations);
    json_integer(out, "failed", s->failed);
    json_integer(out, "setups", s->setups);
    json_open(out, "blocks");
    json_integer(out, "cover", s->with_cover);
    json_integer(out, "cluster", s->with_cluster);
    json_integer(out, "body", s->with_body);
    json_integer(out, "direct", s->with_direct);
    json_integer(out, "friction", s->with_friction);
    json_close(out);
    json_integer(out, "transfers", s->transfers);
    json_number(out, "transfer_bytes", s->transfer_bytes);
    json_number(out, "transfer_seconds", s->transfer_seconds);
    json_close(out);
}

static void json_energy(json *out, const nmm_energy *e) {
    json_open(out, "energy");
    json_number(out, "kinetic", e->kinetic);
    json_number(out, "strain", e->strain);
    json_number(out, "contact", e->contact);
    json_number(out, "friction", e->friction);
    json_number(out, "fracture", e->fracture);
    json_number(out, "support", e->support);
    json_number(out, "damping", e->damping);
    json_number(out, "external", e->external);
    json_number(out, "numerical", e->numerical);
    json_number(out, "residual", e->residual);
    json_close(out);
}

static void json_ledger(json *out, const nmm_ledger *ledger) {
    json_open(out, "ledger");
    json_number(out, "largest_energy", ledger->largest);
    json_number(out, "gain", ledger->gain);
    json_integer(out, "gain_step", ledger->gain_step);
    json_number(out, "gain_time", ledger->gain_time);
    json_number(out, "largest_residual", ledger->residual);
    json_integer(out, "residual_step", ledger->residual_step);
    json_number(out, "residual_time", ledger->residual_time);
    json_number(out, "rounding", ledger->rounding);
    json_text(out, "warning", ledger->warning);
    json_close(out);
}

static void json_monitors(json *out, const run_report *report) {
    json_open(out, "monitors");
    for (int k = 0; k < report->n_monitor; k++) {
        nmm_reading r;
        if (report->reading(report, k, &r) != NMM_OK) continue;
        json_open(out, r.name);
        if (r.has_displacement) json_numbers(out, "displacement", 2, r.displacement);
        if (r.has_velocity) json_numbers(out, "velocity", 2, r.velocity);
        if (r.has_stress) json_numbers(out, "stress", 3, r.stress);
        json_close(out);
    }
    json_close(out);
}

void report_json(const run_report *report) {
    const nmm_summary *s = &report->summary;
    json out = {.file = stdout};
    json_open(&out, NULL);
    json_text(&out, "scene", report->scene);
    json_text(&out, "output", report->path);
    json_counts(&out, s);
    json_number(&out, "wall_seconds", s->wall_seconds);
    json_phases(&out, s);
    json_solver(&out, s);
    json_integer(&out, "dt_cuts", s->dt_cuts);
    json_integer(&out, "open_close_iterations", s->open_close_iterations);
    json_energy(&out, &s->energy);
    json_ledger(&out, &s->ledger);
    json_integer(&out, "pressed", s->pressed);
    json_integer(&out, "not_raised", s->not_raised);
    json_number(&out, "max_penetration", s->max_penetration);
    json_number(&out, "max_support_give", s->max_support_give);
    json_number(&out, "cover_size", s->cover_size);
    json_monitors(&out, report);
    json_hash(&out, "state_hash", s->state_hash);
    json_close(&out);
}
