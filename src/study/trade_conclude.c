// SPDX-License-Identifier: MIT
//
// What follows from the runs of a trade and its reference: the errors, the Pareto set, the cheapest
// setting with the error wanted.
//
// What a setting is said to have is its error and how well the reference is known. A setting that
// some knob, turned finer by itself, moves by more than what is wanted is near by luck only.

#include "trade.h"

#include <math.h>
#include <string.h>

/// An error that is so many times that of a coarser run is worth a word.
#define GROWS 1.1

/// An error at most so many times another one is no worse, where it takes less time.
#define NEARLY 1.05

// --- Errors and Pareto set

static nmm_status put_errors(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    const double size = nmm_trade_size(trade, trade->result.reference);
    if (trade->result.source == NULL || !(size > 0)) return NMM_OK;
    for (int i = 0; i < bench->n_row; i++) {
        nmm_trade_row *row = &trade->row[i];
        if (!row->completed) continue;
        const double error = nmm_trade_distance(trade, row->value, trade->result.reference) / size;
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
                             "Errors below %.3g %% are the same: so far the reference is "
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

// Ladders on which a finer run ought to be nearer, size and dt first.
static const nmm_trade_knob ladders[] = {NMM_TRADE_BOTH,      NMM_TRADE_SIZE,   NMM_TRADE_DT,
                                         NMM_TRADE_TOLERANCE, NMM_TRADE_SOLVER, NMM_TRADE_PENALTY};
enum { N_LADDER = sizeof ladders / sizeof *ladders, N_REFINED = 3 };

// A finer mesh or step that is further off: then errors cancelled in the coarser run.
static nmm_status say_cancelling(nmm_bench *bench) {
    const nmm_trade *trade = bench->trade;
    for (int k = 0; k < N_REFINED; k++) {
        const nmm_trade_ladder l = nmm_trade_find_ladder(bench, ladders[k]);
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

// Which factor of a ladder a setting has; 0: the runs of that ladder say nothing of it. Whoever
// turns another knob keeps the scene's own size, step, tolerances and penalty.
static double factor_on(const nmm_trade_setting *setting, nmm_trade_knob ladder) {
    const nmm_trade_knob knob = setting->knob;
    const bool of_size = ladder == NMM_TRADE_SIZE || ladder == NMM_TRADE_BOTH;
    const bool of_time = ladder == NMM_TRADE_DT || ladder == NMM_TRADE_BOTH;
    if (knob == ladder) return setting->factor;
    if (of_size && (knob == NMM_TRADE_ORDER || knob == NMM_TRADE_MESH)) return 0;
    if (of_time && knob == NMM_TRADE_SCHEME) return 0;
    if (knob == NMM_TRADE_BOTH && (of_size || of_time)) return setting->factor;
    if (ladder == NMM_TRADE_BOTH && (knob == NMM_TRADE_SIZE || knob == NMM_TRADE_DT)) return 0;
    return 1;
}

// Does a finer run of the ladder move the answer by more than what is wanted? In the setting's own
// ladder it may not be further off than that either.
static bool is_moved(const nmm_bench *bench, int i, const nmm_trade_ladder *l, double factor) {
    const nmm_trade *trade = bench->trade;
    const double most = trade->def.want, size = nmm_trade_size(trade, trade->result.reference);
    int at = 0;
    while (at < l->n && trade->row[l->row[at]].setting->factor != factor)
        at += 1;
    for (int finer = at + 1; finer < l->n; finer++) {
        const nmm_trade_row *own = &trade->row[l->row[at]], *other = &trade->row[l->row[finer]];
        if (l->row[at] == i && other->error > most) return true;
        if (nmm_trade_distance(trade, own->value, other->value) > most * size) return true;
    }
    return false;
}

// The scene itself is the finer run of a looser precision; another order or scheme has a ladder of
// its own.
static bool is_finer_off(const nmm_bench *bench, int i) {
    const nmm_trade *trade = bench->trade;
    const nmm_trade_setting *own = trade->row[i].setting;
    const double want = trade->def.want;
    if (own->knob == NMM_TRADE_PRECISION && trade->scene.precision != NMM_SCENE_MIXED)
        return trade->row[0].error > want;
    const bool has_ladder = own->knob == NMM_TRADE_ORDER || own->knob == NMM_TRADE_SCHEME;
    for (int k = 0; has_ladder && k < bench->n_row; k++) {
        const nmm_trade_setting *other = trade->row[k].setting;
        if (other->knob != own->knob || strcmp(other->override[0], own->override[0]) != 0) continue;
        if (other->factor < own->factor && trade->row[k].error > want) return true;
    }
    return false;
}

// Near by luck: with one knob finer the answer is elsewhere.
static bool is_luck(const nmm_bench *bench, int i) {
    const nmm_trade_setting *setting = bench->trade->row[i].setting;
    for (int k = 0; k < N_LADDER; k++) {
        const nmm_trade_ladder l = nmm_trade_find_ladder(bench, ladders[k]);
        const double factor = factor_on(setting, ladders[k]);
        if (factor > 0 && is_moved(bench, i, &l, factor)) return true;
    }
    return is_finer_off(bench, i);
}

// The fastest with the error wanted, also if the reference is as wrong as it may be, and not by
// luck.
static int find_cheapest(const nmm_bench *bench) {
    const nmm_trade *trade = bench->trade;
    const double most = trade->def.want - trade->result.unsure;
    int cheapest = -1;
    for (int i = 0; i < bench->n_row; i++) {
        const nmm_trade_row *row = &trade->row[i];
        if (!(row->error <= most) || is_luck(bench, i)) continue;
        if (cheapest < 0 || row->seconds < trade->row[cheapest].seconds) cheapest = i;
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
    const double unsure = trade->result.unsure;
    if (least + unsure <= want)
        return nmm_bench_words(bench, &trade->result.why,
                               "settings come within %.3g %% by luck only: with one knob finer "
                               "the answer moves further",
                               100 * want);
    const char *more = "";
    if (unsure > 0)
        TRY(nmm_bench_words(bench, &more, ", of a reference that is known to %.3g %%",
                            100 * unsure));
    return nmm_bench_words(bench, &trade->result.why,
                           "no setting comes within %.3g %%; the nearest has %.3g %%%s", 100 * want,
                           100 * least, more);
}

static nmm_status choose(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    nmm_trade_result *result = &trade->result;
    const double want = trade->def.want;
    if (!(want > 0)) return NMM_OK;
    if (trade->unseen[0] != 0)
        return nmm_bench_words(bench, &result->why,
                               "an error of %.3g %% cannot be told: no run that completed says "
                               "what is due to %s; turn that as well, or give a closed form",
                               100 * want, trade->unseen);
    if (result->unsure > want)
        return nmm_bench_words(bench, &result->why,
                               "an error of %.3g %% cannot be told: the reference is known to "
                               "%.3g %% only; give a closed form, or begin with a finer scene",
                               100 * want, 100 * result->unsure);
    result->cheapest = find_cheapest(bench);
    if (result->cheapest < 0) return explain_none(bench, want);
    return put_choice(bench, trade->row[result->cheapest].setting);
}

nmm_status nmm_trade_conclude(nmm_bench *bench) {
    TRY(nmm_trade_find_reference(bench));
    TRY(put_errors(bench));
    TRY(find_pareto(bench));
    TRY(say_pareto(bench));
    TRY(say_cancelling(bench));
    return choose(bench);
}
