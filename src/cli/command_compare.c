// SPDX-License-Identifier: MIT
//
// nmm compare: the same steps on host and on target, side by side. Equal in every bit, or how far
// apart; times by phase and by iteration, and what was copied; and from which size on the target
// pays (ladder.h).

#include "ladder.h"
#include "message.h"
#include "options.h"
#include "report.h"
#include "scene_open.h"

#include <math.h>
#include <stdio.h>

/// Steps where the user does not say.
enum { STEPS = 50 };

enum { HOST, TARGET, SIDES };
static const char *const side_name[SIDES] = {"host", "target"};

typedef struct comparison {
    nmm_sim *sim[SIDES];
    nmm_summary summary[SIDES];
    bool equal;      // every bit of the state, at every step
    long first;      // step at which it was not; 0: none
    double distance; // largest difference of displacements over the largest displacement
    double allowed;
    bool agree;
    ladder ladder;
} comparison;

// --- The steps

static int open_sides(comparison *c, const arguments *given) {
    for (int side = HOST; side < SIDES; side++) {
        arguments one = *given;
        one.device = side == HOST ? NMM_DEVICE_HOST : NMM_DEVICE_TARGET;
        one.comparable = 1;
        const int status = scene_open(&c->sim[side], &one);
        if (status == EXIT_DEVICE)
            message_note("A build with the preset fake-device has a target that needs no GPU; see "
                         "docs/offload.md.");
        if (status != EXIT_DONE) return status;
    }
    return EXIT_DONE;
}

// Numbers that are not finite are infinitely far apart.
static double distance_of(const nmm_sim *a, const nmm_sim *b) {
    const nmm_view x = nmm_sim_view(a, "displacement"), y = nmm_sim_view(b, "displacement");
    double largest = 0, apart = 0;
    for (int i = 0; i < x.count * x.width; i++) {
        const double d = fabs(x.data[i] - y.data[i]);
        if (!(d < INFINITY)) return INFINITY;
        apart = fmax(apart, d);
        largest = fmax(largest, fmax(fabs(x.data[i]), fabs(y.data[i])));
    }
    return apart > 0 ? apart / largest : 0;
}

static void compare_states(comparison *c) {
    for (int side = HOST; side < SIDES; side++)
        nmm_sim_summary(c->sim[side], &c->summary[side]);
    const nmm_summary *a = &c->summary[HOST], *b = &c->summary[TARGET];
    c->distance = fmax(c->distance, distance_of(c->sim[HOST], c->sim[TARGET]));
    const bool equal = a->state_hash == b->state_hash && a->iterations == b->iterations &&
                       a->end == b->end && a->dt_cuts == b->dt_cuts;
    if (!equal && c->equal) c->first = a->steps;
    c->equal = c->equal && equal;
}

static int take_steps(comparison *c, const arguments *given) {
    nmm_step_report report[SIDES] = {{.end = NMM_END_RUNNING}, {.end = NMM_END_RUNNING}};
    const int most = given->n_step > 0 ? given->n_step : STEPS;
    c->equal = true;
    for (int k = 0; k < most; k++) {
        for (int side = HOST; side < SIDES; side++) {
            if (nmm_sim_step(c->sim[side], &report[side]) != NMM_OK)
                return message_failure(nmm_sim_error(c->sim[side]), given->path);
        }
        compare_states(c);
        if (report[HOST].end != NMM_END_RUNNING || report[TARGET].end != NMM_END_RUNNING) break;
    }
    c->allowed = given->allow > 0 ? given->allow : 1e-9;
    // Where only one side ended, or their times differ, the answers differ whatever the distance.
    c->agree = c->equal || (c->distance <= c->allowed && report[HOST].end == report[TARGET].end &&
                            c->summary[HOST].time == c->summary[TARGET].time);
    return EXIT_DONE;
}

static double iteration_seconds(const nmm_summary *s) {
    return s->iterations > 0 ? s->phase_seconds.solve / (double)s->iterations : 0;
}

// --- Text

static void print_answers(const comparison *c) {
    const nmm_summary *s = &c->summary[HOST];
    if (c->equal)
        printf("  answers: equal in every bit, state hash %016llx\n",
               (unsigned long long)s->state_hash);
    else
        printf("  answers: bits differ from step %ld on; displacements by %.3g of the largest, "
               "allowed %.3g: %s\n",
               c->first, c->distance, c->allowed, c->agree ? "they agree" : "they DIFFER");
}

static void print_times(const comparison *c) {
    const nmm_phases *p[SIDES] = {&c->summary[HOST].phase_seconds,
                                  &c->summary[TARGET].phase_seconds};
    const struct {
        const char *name;
        double seconds[SIDES];
    } row[] = {{"contact", {p[HOST]->contact, p[TARGET]->contact}},
               {"assemble", {p[HOST]->assemble, p[TARGET]->assemble}},
               {"solve", {p[HOST]->solve, p[TARGET]->solve}},
               {"advance", {p[HOST]->advance, p[TARGET]->advance}}};
    printf("\nTime [s]               host     target\n");
    for (int k = 0; k < 4; k++)
        printf("  %-14s %10.4f %10.4f\n", row[k].name, row[k].seconds[HOST],
               row[k].seconds[TARGET]);
    printf("  %-14s %10.3g %10.3g\n", "one iteration", iteration_seconds(&c->summary[HOST]),
           iteration_seconds(&c->summary[TARGET]));
}

// Copies to and from the device, in all, by solve and by step.
static void print_transfers(const comparison *c) {
    const nmm_summary *s = &c->summary[TARGET];
    const struct {
        const char *name;
        long n;
    } row[] = {{"in all", 1}, {"one solve", s->solves}, {"one step", s->steps}};
    printf("\nTransfers               number        kB          s\n");
    for (int k = 0; k < 3; k++) {
        const double n = row[k].n > 0 ? (double)row[k].n : 1;
        printf("  %-14s %13.1f %9.4g %10.3g\n", row[k].name, (double)s->transfers / n,
               1e-3 * s->transfer_bytes / n, s->transfer_seconds / n);
    }
}

static void print_comparison(const comparison *c, const char *path) {
    const nmm_summary *s = c->summary;
    char way[REACHED_LENGTH];
    reached(way, &s[HOST]);
    printf("%s: %s, %d unknowns, %d contacts\n", path, way, s[HOST].unknowns, s[HOST].contacts);
    for (int side = HOST; side < SIDES; side++)
        printf("  %s: solver %s, %s precision, %ld solves, %ld iterations\n", side_name[side],
               s[side].method, s[side].precision, s[side].solves, s[side].iterations);
    for (int side = HOST; side < SIDES; side++)
        if (s[side].end < 0)
            printf("  %s: ended early, %s: %s\n", side_name[side], nmm_end_name(s[side].end),
                   s[side].reason);
    print_answers(c);
    print_times(c);
    print_transfers(c);
    ladder_print(&c->ladder);
}

// --- JSON

static void json_transfers(json *out, const char *name, const nmm_summary *s, long n) {
    const double part = n > 0 ? 1.0 / (double)n : 1;
    json_open(out, name);
    json_number(out, "transfers", part * (double)s->transfers);
    json_number(out, "bytes", part * s->transfer_bytes);
    json_number(out, "seconds", part * s->transfer_seconds);
    json_close(out);
}

static void json_side(json *out, const comparison *c, int side) {
    const nmm_summary *s = &c->summary[side];
    json_open(out, side_name[side]);
    json_integer(out, "steps", s->steps);
    json_number(out, "time", s->time);
    json_text(out, "end", nmm_end_name(s->end));
    json_text(out, "reason", s->reason);
    json_phases(out, s);
    json_solver(out, s);
    json_number(out, "seconds_per_iteration", iteration_seconds(s));
    json_transfers(out, "transfers_per_solve", s, s->solves);
    json_transfers(out, "transfers_per_step", s, s->steps);
    json_hash(out, "state_hash", s->state_hash);
    json_close(out);
}

static void json_comparison(const comparison *c, const char *path) {
    json out = {.file = stdout};
    json_open(&out, NULL);
    json_text(&out, "scene", path);
    json_integer(&out, "steps", c->summary[HOST].steps);
    json_integer(&out, "unknowns", c->summary[HOST].unknowns);
    json_integer(&out, "contacts", c->summary[HOST].contacts);
    json_boolean(&out, "equal_bits", c->equal);
    json_integer(&out, "first_difference_step", c->first);
    json_number(&out, "difference", c->distance);
    json_number(&out, "allowed", c->allowed);
    json_boolean(&out, "agree", c->agree);
    json_side(&out, c, HOST);
    json_side(&out, c, TARGET);
    ladder_json(&c->ladder, &out);
    json_close(&out);
}

// --- The command

static int judge(const comparison *c, const char *path) {
    const nmm_summary *target = &c->summary[TARGET];
    if (target->iterations > 0 && !target->on_device) {
        message_error("%s: the target's solves were not seen to run on a device", path);
        return EXIT_DEVICE;
    }
    if (!c->agree) {
        char way[SIDES][REACHED_LENGTH];
        for (int side = HOST; side < SIDES; side++)
            reached(way[side], &c->summary[side]);
        message_error("%s: host and target differ: displacements by %.3g of the largest, allowed "
                      "%.3g; %s and %s",
                      path, c->distance, c->allowed, way[HOST], way[TARGET]);
        return EXIT_EARLY;
    }
    if (target->end < 0) {
        message_error("%s: host and target agree and ended early, %s: %s", path,
                      nmm_end_name(target->end), target->reason);
        return EXIT_EARLY;
    }
    const ladder *l = &c->ladder;
    if (l->status != EXIT_DONE)
        message_error("a generated system of %d unknowns was not solved by %s: %s",
                      l->failed_unknowns, l->failed, l->reason);
    return l->status;
}

int command_compare(const arguments *given) {
    comparison c = {0};
    if (is_standard_input(given->path)) {
        message_error("nmm compare: the scene is read twice, so it must be a file");
        return EXIT_USAGE;
    }
    int status = open_sides(&c, given);
    if (status == EXIT_DONE) status = take_steps(&c, given);
    if (status == EXIT_DONE) {
        ladder_climb(&c.ladder, given->n_thread);
        if (given->json)
            json_comparison(&c, given->path);
        else
            print_comparison(&c, given->path);
        fflush(stdout);
        status = judge(&c, given->path);
    }
    for (int side = HOST; side < SIDES; side++)
        nmm_sim_destroy(c.sim[side]);
    return status;
}
