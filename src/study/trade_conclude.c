// SPDX-License-Identifier: MIT
//
// What follows from the runs of a trade: the reference, the errors, the Pareto set, the cheapest
// setting with the error wanted.
//
// Reference: the closed form; else Richardson's extrapolation of the last three runs of a ladder
// that converges regularly; else the finest run. By how much a reference may itself be wrong is
// told, and an error wanted below that is refused: nobody could tell whether it is reached.

#include "trade.h"

#include <math.h>
#include <string.h>

/// Differences of three runs count as regular where they point the same way and shrink so.
#define SAME_WAY 0.9
#define LEAST_RATIO 1.4
#define MOST_RATIO 64

/// An error that is so many times that of a coarser run is worth a word.
#define GROWS 1.1

/// An error at most so many times another one is no worse, where it takes less time.
#define NEARLY 1.05

// --- Vectors

static double dot(const nmm_trade *trade, const double *a, const double *b) {
    double sum = 0;
    for (int k = 0; k < trade->quantity.width; k++)
        sum += a[k] * b[k];
    return sum;
}

static double size_of(const nmm_trade *trade, const double *a) {
    return sqrt(dot(trade, a, a));
}

static double distance(const nmm_trade *trade, const double *a, const double *b) {
    double difference[3] = {0};
    for (int k = 0; k < trade->quantity.width; k++)
        difference[k] = a[k] - b[k];
    return size_of(trade, difference);
}

// --- The reference

/// Completed runs of a ladder, from coarse to fine.
typedef struct ladder {
    int n, row[NMM_TRADE_SETTINGS];
} ladder;

static ladder find_ladder(const nmm_bench *bench, nmm_trade_knob knob) {
    ladder l = {0};
    for (int i = 0; i < bench->n_row; i++) {
        const nmm_trade_row *row = &bench->trade->row[i];
        const nmm_trade_knob own = row->setting->knob;
        if (!row->completed || (own != knob && own != NMM_TRADE_SCENE)) continue;
        int at = l.n++;
        for (; at > 0; at--) {
            const nmm_trade_row *before = &bench->trade->row[l.row[at - 1]];
            if (before->setting->factor >= row->setting->factor) break;
            l.row[at] = l.row[at - 1];
        }
        l.row[at] = i;
    }
    return l;
}

// True: the last three runs of the ladder converge regularly; the reference is set.
static bool extrapolate(nmm_trade *trade, const ladder *l, double *order) {
    if (l->n < 3) return false;
    const nmm_trade_row *row[3];
    for (int k = 0; k < 3; k++)
        row[k] = &trade->row[l->row[l->n - 3 + k]];
    const double ratio = row[1]->setting->factor / row[2]->setting->factor;
    if (fabs(row[0]->setting->factor / row[1]->setting->factor - ratio) > 1e-6) return false;
    double first[3], last[3];
    for (int k = 0; k < 3; k++) {
        first[k] = row[1]->value[k] - row[0]->value[k];
        last[k] = row[2]->value[k] - row[1]->value[k];
    }
    const double a = size_of(trade, first), b = size_of(trade, last);
    if (!(b > 0) || dot(trade, first, last) < SAME_WAY * a * b) return false;
    if (a < LEAST_RATIO * b || a > MOST_RATIO * b) return false;
    nmm_trade_result *result = &trade->result;
    for (int k = 0; k < 3; k++)
        result->reference[k] = row[2]->value[k] + last[k] / (a / b - 1);
    const double size = size_of(trade, result->reference);
    if (!(size > 0)) return false;
    *order = log(a / b) / log(ratio);
    result->unsure = distance(trade, result->reference, row[2]->value) / size;
    result->source = "extrapolated";
    return true;
}

// True: there are two runs to compare; the finer one is the reference.
static bool take_finest(nmm_bench *bench, const ladder *l) {
    nmm_trade *trade = bench->trade;
    if (l->n < 2) return false;
    const int at = l->row[l->n - 1];
    const nmm_trade_row *last = &trade->row[at], *before = &trade->row[l->row[l->n - 2]];
    const double size = size_of(trade, last->value);
    if (!(size > 0)) return false;
    memcpy(trade->result.reference, last->value, sizeof last->value);
    trade->result.unsure = distance(trade, last->value, before->value) / size;
    trade->result.source = "finest run";
    trade->reference_row = at;
    return true;
}

// Ladders by what they say about the answer.
static const nmm_trade_knob ladders[] = {NMM_TRADE_BOTH,      NMM_TRADE_SIZE,   NMM_TRADE_DT,
                                         NMM_TRADE_TOLERANCE, NMM_TRADE_SOLVER, NMM_TRADE_PENALTY};
enum { N_LADDER = sizeof ladders / sizeof *ladders, N_REGULAR = 3 };

static nmm_status say_reference(nmm_bench *bench, const char *how) {
    const nmm_trade *trade = bench->trade;
    const nmm_trade_result *result = &trade->result;
    char value[128] = "";
    for (int k = 0; k < result->width; k++) {
        const size_t used = strlen(value);
        snprintf(value + used, sizeof value - used, "%s%.7g", k > 0 ? ", " : "",
                 result->reference[k]);
    }
    return nmm_bench_remark(bench, "Error: difference of %s at the end from %s %s, %s.",
                            result->quantity, value, result->unit, how);
}

// What a ladder cannot see.
static const char *unseen(const nmm_trade *trade, nmm_trade_knob knob) {
    if (knob == NMM_TRADE_BOTH || (knob == NMM_TRADE_SIZE && trade->scene.is_static)) return "";
    if (knob == NMM_TRADE_SIZE) return "; the error of dt is not in it";
    if (knob == NMM_TRADE_DT) return "; the error of the mesh is not in it";
    return "; errors of mesh and dt are not in it";
}

static nmm_status find_reference(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    nmm_trade_result *result = &trade->result;
    double order = 0;
    const char *how = NULL;
    trade->reference_row = -1;
    if (trade->has_expectation) {
        memcpy(result->reference, trade->expectation, sizeof result->reference);
        result->source = "closed form";
        return say_reference(bench, "the value given");
    }
    for (int k = 0; k < N_REGULAR; k++) {
        const ladder l = find_ladder(bench, ladders[k]);
        if (!extrapolate(trade, &l, &order)) continue;
        trade->ladder = ladders[k];
        TRY(nmm_bench_words(bench, &how,
                            "extrapolated from the last three runs of %s, which converge with "
                            "order %.1f; the finest of them differs by %.2g %%%s",
                            nmm_trade_knob_name((int)ladders[k]), order, 100 * result->unsure,
                            unseen(trade, ladders[k])));
        return say_reference(bench, how);
    }
    for (int k = 0; k < N_LADDER; k++) {
        const ladder l = find_ladder(bench, ladders[k]);
        if (!take_finest(bench, &l)) continue;
        trade->ladder = ladders[k];
        TRY(nmm_bench_words(bench, &how,
                            "the finest run of %s; runs do not converge regularly, and the one "
                            "before differs by %.2g %%%s",
                            nmm_trade_knob_name((int)ladders[k]), 100 * result->unsure,
                            unseen(trade, ladders[k])));
        return say_reference(bench, how);
    }
    return nmm_bench_remark(bench, "Errors are not known: no ladder of size, dt, tolerance or "
                                   "penalty has two runs that completed, and no closed form was "
                                   "given; turn size or dt as well, or say --expect.");
}

// The run of the highest other order on the scene's own mesh knows nothing of a ladder of meshes:
// where it is elsewhere, the reference is not known better than that. A ladder of time has another
// dt in the end.
static nmm_status check_by_order(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    nmm_trade_result *result = &trade->result;
    int other = -1;
    for (int i = 0; i < bench->n_row; i++) {
        const nmm_trade_setting *setting = trade->row[i].setting;
        if (trade->row[i].completed && setting->knob == NMM_TRADE_ORDER && setting->factor == 1)
            other = i;
    }
    const double size = size_of(trade, result->reference);
    if (other < 0 || trade->ladder != NMM_TRADE_SIZE || !(size > 0)) return NMM_OK;
    const double away = distance(trade, trade->row[other].value, result->reference) / size;
    if (!(away > result->unsure)) return NMM_OK;
    result->unsure = away;
    return nmm_bench_remark(bench, "The run with %s is %.2g %% away from that.",
                            nmm_bench_text(bench, other, NMM_TRADE_COLUMN_SETTING), 100 * away);
}

// --- Errors and Pareto set

static nmm_status put_errors(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    const double size = size_of(trade, trade->result.reference);
    if (trade->result.source == NULL || !(size > 0)) return NMM_OK;
    for (int i = 0; i < bench->n_row; i++) {
        nmm_trade_row *row = &trade->row[i];
        if (!row->completed) continue;
        const double error = distance(trade, row->value, trade->result.reference) / size;
        // The reference has no error of its own to show.
        if (i == trade->reference_row) {
            TRY(nmm_bench_keep(bench, &nmm_bench_cell_of(bench, i, NMM_TRADE_COLUMN_END)->text,
                               "completed: the reference"));
            continue;
        }
        row->error = error;
        nmm_bench_cell_of(bench, i, NMM_TRADE_COLUMN_ERROR)->number = 100 * error;
    }
    return NMM_OK;
}

// Errors below what the reference is known to are the same, and so are those that a slower run
// betters by next to nothing.
static bool dominates(const nmm_trade_row *a, const nmm_trade_row *b, double unsure) {
    const double e = nmm_max(a->error, unsure), f = nmm_max(b->error, unsure);
    if (!isfinite(a->error)) return false;
    if (a->seconds < b->seconds) return e <= NEARLY * f;
    return a->seconds <= b->seconds && e < f;
}

static nmm_status find_pareto(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    for (int i = 0; i < bench->n_row; i++) {
        nmm_trade_row *row = &trade->row[i];
        row->pareto = isfinite(row->error);
        for (int k = 0; row->pareto && k < bench->n_row; k++)
            row->pareto = !dominates(&trade->row[k], row, trade->result.unsure);
        if (row->pareto)
            TRY(nmm_bench_keep(bench, &nmm_bench_cell_of(bench, i, NMM_TRADE_COLUMN_PARETO)->text,
                               "yes"));
    }
    return NMM_OK;
}

// The fastest run of the Pareto set that is slower than `after`; -1: none.
static int next_of_pareto(const nmm_bench *bench, double after) {
    int next = -1;
    for (int i = 0; i < bench->n_row; i++) {
        const nmm_trade_row *row = &bench->trade->row[i];
        if (row->pareto && row->seconds > after &&
            (next < 0 || row->seconds < bench->trade->row[next].seconds))
            next = i;
    }
    return next;
}

static nmm_status say_pareto(nmm_bench *bench) {
    int i = next_of_pareto(bench, -1);
    if (i < 0) return NMM_OK;
    const double unsure = bench->trade->result.unsure;
    if (unsure > 0)
        TRY(nmm_bench_remark(bench,
                             "Errors below %.2g %% are the same: so far the reference is "
                             "known.",
                             100 * unsure));
    TRY(nmm_bench_remark(bench, "Pareto set, nothing is both faster and nearer:"));
    for (; i >= 0; i = next_of_pareto(bench, bench->trade->row[i].seconds)) {
        const nmm_trade_row *row = &bench->trade->row[i];
        TRY(nmm_bench_remark(bench, "  %.3g s, %.3g %%: %s", row->seconds, 100 * row->error,
                             nmm_bench_text(bench, i, NMM_TRADE_COLUMN_SETTING)));
    }
    return NMM_OK;
}

// A finer mesh or step that is further off: then errors cancelled in the coarser run.
static nmm_status say_cancelling(nmm_bench *bench) {
    const nmm_trade *trade = bench->trade;
    for (int k = 0; k < N_REGULAR; k++) {
        const ladder l = find_ladder(bench, ladders[k]);
        for (int i = 1; i < l.n; i++) {
            const double coarse = trade->row[l.row[i - 1]].error, fine = trade->row[l.row[i]].error;
            if (!(fine > GROWS * coarse) || !(fine > 2 * trade->result.unsure)) continue;
            TRY(nmm_bench_remark(bench,
                                 "With finer %s the error grows, from %.3g to %.3g %%: errors of "
                                 "different kinds cancel in the coarser run, which is luck.",
                                 nmm_trade_knob_name((int)ladders[k]), 100 * coarse, 100 * fine));
            break;
        }
    }
    return NMM_OK;
}

// --- The error wanted

// "--set a.b=1 --set a.c=2" and "a: {b: 1, c: 2}"
static nmm_status put_choice(nmm_bench *bench, const nmm_trade_setting *setting) {
    char options[512] = "", lines[512] = "";
    for (int k = 0; k < setting->n_override; k++) {
        const char *own = setting->override[k], *dot = strchr(own, '.'), *equals = strchr(own, '=');
        const char *before = k > 0 ? setting->override[k - 1] : "";
        const int section = (int)(dot - own);
        const bool same = strncmp(before, own, (size_t)section + 1) == 0;
        size_t used = strlen(options);
        snprintf(options + used, sizeof options - used, "%s--set %s", k > 0 ? " " : "", own);
        used = strlen(lines);
        if (same)
            snprintf(lines + used, sizeof lines - used, ", ");
        else
            snprintf(lines + used, sizeof lines - used, "%s%.*s: {", k > 0 ? "}\n" : "", section,
                     own);
        used = strlen(lines);
        snprintf(lines + used, sizeof lines - used, "%.*s: %s", (int)(equals - dot - 1), dot + 1,
                 equals + 1);
    }
    const char *end = setting->n_override > 0 ? "}" : "";
    TRY(nmm_bench_words(bench, &bench->trade->result.options, "%s", options));
    return nmm_bench_words(bench, &bench->trade->result.lines, "%s%s", lines, end);
}

// A finer run of the same ladder is further off than what is wanted: this one is near by luck.
static bool is_luck(const nmm_bench *bench, int i, double want) {
    const nmm_trade *trade = bench->trade;
    for (int k = 0; k < N_REGULAR; k++) {
        const ladder l = find_ladder(bench, ladders[k]);
        int at = 0;
        while (at < l.n && l.row[at] != i)
            at += 1;
        for (int finer = at + 1; finer < l.n; finer++)
            if (trade->row[l.row[finer]].error > want) return true;
    }
    return false;
}

// The fastest with the error wanted, and not by luck.
static int find_cheapest(const nmm_bench *bench, double want) {
    int cheapest = -1;
    for (int i = 0; i < bench->n_row; i++) {
        const nmm_trade_row *row = &bench->trade->row[i];
        if (!(row->error <= want) || is_luck(bench, i, want)) continue;
        if (cheapest < 0 || row->seconds < bench->trade->row[cheapest].seconds) cheapest = i;
    }
    return cheapest;
}

static nmm_status explain_none(nmm_bench *bench, double want) {
    nmm_trade *trade = bench->trade;
    double least = INFINITY;
    for (int i = 0; i < bench->n_row; i++)
        if (trade->row[i].error < least) least = trade->row[i].error;
    if (!isfinite(least))
        return nmm_bench_words(bench, &trade->result.why,
                               "no error is known: too few runs completed to compare%s",
                               trade->too_long ? "; give them longer (--longest)" : "");
    if (least <= want)
        return nmm_bench_words(bench, &trade->result.why,
                               "settings come within %.3g %% by luck only: finer mesh or steps "
                               "are further off",
                               100 * want);
    return nmm_bench_words(bench, &trade->result.why,
                           "no setting comes within %.3g %%; the nearest has %.3g %%", 100 * want,
                           100 * least);
}

static nmm_status choose(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    nmm_trade_result *result = &trade->result;
    const double want = trade->def.want;
    if (!(want > 0)) return NMM_OK;
    if (result->unsure > want)
        return nmm_bench_words(bench, &result->why,
                               "an error of %.3g %% cannot be told: the reference is known to "
                               "%.3g %% only; give a closed form, or begin with a finer scene",
                               100 * want, 100 * result->unsure);
    result->cheapest = find_cheapest(bench, want);
    if (result->cheapest < 0) return explain_none(bench, want);
    return put_choice(bench, trade->row[result->cheapest].setting);
}

nmm_status nmm_trade_conclude(nmm_bench *bench) {
    TRY(find_reference(bench));
    TRY(check_by_order(bench));
    TRY(put_errors(bench));
    TRY(find_pareto(bench));
    TRY(say_pareto(bench));
    TRY(say_cancelling(bench));
    return choose(bench);
}
