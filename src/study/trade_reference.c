// SPDX-License-Identifier: MIT
//
// The reference of a trade, and how well it is known.
//
// Reference: the closed form; else the ladder that refines most at once, its last three runs
// extrapolated (Richardson) where they converge regularly, else its finest run. How well it is
// known is what all knobs say: a ladder by its own last differences, the mesh also by covers of
// higher order, time also by the other scheme, which both come to the same limit another way, and
// the other knobs by how far their finest setting moves the scene. Only limits that several ways
// lead to can be told; two wrong ones may agree along one way.

#include "trade.h"

#include <math.h>
#include <string.h>

/// Differences of three runs count as regular where they point the same way and shrink so.
#define SAME_WAY 0.9
#define LEAST_RATIO 1.4
#define MOST_RATIO 64

// --- Vectors

static double dot(const nmm_trade *trade, const double *a, const double *b) {
    double sum = 0;
    for (int k = 0; k < trade->quantity.width; k++)
        sum += a[k] * b[k];
    return sum;
}

double nmm_trade_size(const nmm_trade *trade, const double *a) {
    return sqrt(dot(trade, a, a));
}

double nmm_trade_distance(const nmm_trade *trade, const double *a, const double *b) {
    double difference[3] = {0};
    for (int k = 0; k < trade->quantity.width; k++)
        difference[k] = a[k] - b[k];
    return nmm_trade_size(trade, difference);
}

// --- Ladders

// Add row i, from coarse to fine.
static void climb(const nmm_bench *bench, nmm_trade_ladder *l, int i) {
    int at = l->n++;
    for (; at > 0; at--) {
        const nmm_trade_row *before = &bench->trade->row[l->row[at - 1]];
        if (before->setting->factor >= bench->trade->row[i].setting->factor) break;
        l->row[at] = l->row[at - 1];
    }
    l->row[at] = i;
}

nmm_trade_ladder nmm_trade_find_ladder(const nmm_bench *bench, nmm_trade_knob knob) {
    nmm_trade_ladder l = {0};
    for (int i = 0; i < bench->n_row; i++) {
        const nmm_trade_row *row = &bench->trade->row[i];
        const nmm_trade_knob own = row->setting->knob;
        if (row->completed && (own == knob || own == NMM_TRADE_SCENE)) climb(bench, &l, i);
    }
    return l;
}

// Sizes of another order than the scene's own.
static nmm_trade_ladder ladder_of_order(const nmm_bench *bench, const char *order) {
    nmm_trade_ladder l = {0};
    for (int i = 0; i < bench->n_row; i++) {
        const nmm_trade_row *row = &bench->trade->row[i];
        if (!row->completed || row->setting->knob != NMM_TRADE_ORDER) continue;
        if (strcmp(row->setting->override[0], order) == 0) climb(bench, &l, i);
    }
    return l;
}

/// What a ladder comes to.
typedef struct limit {
    bool regular;
    double value[3]; // extrapolated where it is regular, else of the finest run
    double order;    // where it is regular
    double off;      // by so much the finest run may be off; 0: a single run
} limit;

// True: the last three runs of the ladder converge regularly; value and order are set.
static bool extrapolate(const nmm_trade *trade, const nmm_trade_row *const row[3], limit *out) {
    const double ratio = row[1]->setting->factor / row[2]->setting->factor;
    if (fabs(row[0]->setting->factor / row[1]->setting->factor - ratio) > 1e-6) return false;
    double first[3], last[3];
    for (int k = 0; k < 3; k++) {
        first[k] = row[1]->value[k] - row[0]->value[k];
        last[k] = row[2]->value[k] - row[1]->value[k];
    }
    const double a = nmm_trade_size(trade, first), b = nmm_trade_size(trade, last);
    if (!(b > 0) || dot(trade, first, last) < SAME_WAY * a * b) return false;
    if (a < LEAST_RATIO * b || a > MOST_RATIO * b) return false;
    for (int k = 0; k < 3; k++)
        out->value[k] = row[2]->value[k] + last[k] / (a / b - 1);
    if (!(nmm_trade_size(trade, out->value) > 0)) return false;
    out->order = log(a / b) / log(ratio);
    return true;
}

// The finest run is never nearer than its last difference: three runs may look regular by chance.
// Where they are not, a small last difference may be chance as well, and the larger one counts.
static limit limit_of(const nmm_trade *trade, const nmm_trade_ladder *l) {
    limit out = {0};
    if (l->n < 1) return out;
    const nmm_trade_row *row[3] = {NULL};
    const int n = l->n < 3 ? l->n : 3;
    for (int k = 0; k < n; k++)
        row[3 - n + k] = &trade->row[l->row[l->n - n + k]];
    const double *finest = row[2]->value;
    memcpy(out.value, finest, sizeof out.value);
    if (n < 2) return out;
    out.off = nmm_trade_distance(trade, finest, row[1]->value);
    if (n < 3) return out;
    out.regular = extrapolate(trade, row, &out);
    const double other = out.regular ? nmm_trade_distance(trade, finest, out.value)
                                     : nmm_trade_distance(trade, row[1]->value, row[0]->value);
    out.off = nmm_max(out.off, other);
    return out;
}

// --- What the knobs say of the reference

// The completed run of a knob that refines most, or -1.
static int finest_of(const nmm_bench *bench, nmm_trade_knob knob) {
    const nmm_trade *trade = bench->trade;
    int finest = -1;
    for (int i = 0; i < bench->n_row; i++) {
        const nmm_trade_setting *setting = trade->row[i].setting;
        if (!trade->row[i].completed || setting->knob != knob) continue;
        // Orders come from low to high; on a coarser lattice they say nothing of the scene's own,
        // and lower orders than the scene's do not either.
        const bool is_order = knob == NMM_TRADE_ORDER;
        const double unknowns = nmm_bench_number(bench, i, NMM_TRADE_COLUMN_UNKNOWNS);
        if (is_order && (setting->factor != 1 || unknowns < trade->unknowns)) continue;
        if (finest < 0 || setting->factor <= trade->row[finest].setting->factor) finest = i;
    }
    return finest;
}

// Another way to the limit of a ladder: what the finest run of another order or scheme differs from
// it, and what that run may be off itself, if its own error falls at least as its size or step.
static double off_by_check(const nmm_bench *bench, nmm_trade_knob knob, const double value[3]) {
    const nmm_trade *trade = bench->trade;
    const int check = finest_of(bench, knob);
    if (check < 0) return 0;
    const nmm_trade_row *own = &trade->row[check], *before = NULL;
    for (int i = 0; i < bench->n_row; i++) {
        const nmm_trade_row *row = &trade->row[i];
        if (!row->completed || row->setting->knob != knob) continue;
        if (strcmp(row->setting->override[0], own->setting->override[0]) != 0) continue;
        if (row->setting->factor <= own->setting->factor) continue;
        if (before == NULL || row->setting->factor < before->setting->factor) before = row;
    }
    const double away = nmm_trade_distance(trade, own->value, value);
    if (before == NULL) return away;
    return away + nmm_trade_distance(trade, own->value, before->value) /
                      (before->setting->factor / own->setting->factor - 1);
}

// Of the mesh or of time: the ladder's own, and the other way to the same limit. A reference that
// keeps the scene's own size or step is as far off as that limit, too.
static double off_by_ladder(const nmm_bench *bench, nmm_trade_knob knob, nmm_trade_knob other) {
    const nmm_trade *trade = bench->trade;
    const nmm_trade_ladder l = nmm_trade_find_ladder(bench, knob);
    const limit found = limit_of(trade, &l);
    if (l.n < 1) return 0;
    double off = nmm_max(found.off, off_by_check(bench, other, found.value));
    if (trade->ladder != NMM_TRADE_BOTH && trade->ladder != knob)
        off += nmm_trade_distance(trade, trade->row[0].value, found.value);
    return off;
}

// Of the other knobs: how far the finest moves the scene, or the last one but the scene's own.
static double off_by_knob(const nmm_bench *bench, nmm_trade_knob knob) {
    const nmm_trade *trade = bench->trade;
    const nmm_trade_ladder l = nmm_trade_find_ladder(bench, knob);
    if (l.n < 2) return 0;
    const int finest = l.row[l.n - 1];
    return nmm_trade_distance(trade, trade->row[0].value,
                              trade->row[finest != 0 ? finest : l.row[l.n - 2]].value);
}

// Of those with two settings, where the scene has the one that is worth less.
static double off_by_better(const nmm_bench *bench, nmm_trade_knob knob) {
    const nmm_trade *trade = bench->trade;
    const bool is_mesh = knob == NMM_TRADE_MESH;
    const bool has_better =
        is_mesh ? trade->scene.mesh != NMM_MESH_LATTICE : trade->scene.precision == NMM_SCENE_MIXED;
    const int other = finest_of(bench, knob);
    if (!has_better || other < 0) return 0;
    return nmm_trade_distance(trade, trade->row[0].value, trade->row[other].value);
}

// What may be off without a word from any run: "dt, scheme"; "": nothing.
static nmm_status find_unseen(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    const bool lattice = trade->scene.mesh == NMM_MESH_LATTICE, moves = !trade->scene.is_static;
    const bool both = nmm_trade_find_ladder(bench, NMM_TRADE_BOTH).n > 1;
    const bool sizes = both || nmm_trade_find_ladder(bench, NMM_TRADE_SIZE).n > 1;
    const bool times = both || nmm_trade_find_ladder(bench, NMM_TRADE_DT).n > 1;
    const struct {
        bool unseen;
        const char *words;
    } part[] = {{!trade->row[0].completed, "the scene as it stands"},
                {lattice && !sizes, "size"},
                {!lattice && finest_of(bench, NMM_TRADE_MESH) < 0, "mesh"},
                {moves && !times, "dt"},
                {moves && finest_of(bench, NMM_TRADE_SCHEME) < 0, "scheme"}};
    char text[128] = "";
    for (size_t k = 0; k < sizeof part / sizeof *part; k++) {
        const size_t used = strlen(text);
        if (part[k].unseen)
            snprintf(text + used, sizeof text - used, "%s%s", used > 0 ? ", " : "", part[k].words);
    }
    return nmm_bench_words(bench, &trade->unseen, "%s", text);
}

/// Knobs that are asked, in the order of the note, with mesh and time first.
enum { N_PART = 8 };
static const struct {
    nmm_trade_knob knob;
    const char *words;
} part[N_PART] = {{NMM_TRADE_BOTH, "size with dt"},
                  {NMM_TRADE_SIZE, "mesh"},
                  {NMM_TRADE_DT, "time"},
                  {NMM_TRADE_MESH, "strain of blocks"},
                  {NMM_TRADE_TOLERANCE, "tolerance"},
                  {NMM_TRADE_SOLVER, "solver"},
                  {NMM_TRADE_PRECISION, "precision"},
                  {NMM_TRADE_PENALTY, "penalty"}};

static double off_by(const nmm_bench *bench, nmm_trade_knob knob) {
    switch (knob) {
    case NMM_TRADE_BOTH: {
        const nmm_trade_ladder l = nmm_trade_find_ladder(bench, knob);
        return limit_of(bench->trade, &l).off;
    }
    case NMM_TRADE_SIZE:
        if (bench->trade->ladder == NMM_TRADE_ORDER) return bench->trade->order_off;
        return off_by_ladder(bench, knob, NMM_TRADE_ORDER);
    case NMM_TRADE_DT:
        return off_by_ladder(bench, knob, NMM_TRADE_SCHEME);
    case NMM_TRADE_MESH:
    case NMM_TRADE_PRECISION:
        return off_by_better(bench, knob);
    default:
        return off_by_knob(bench, knob);
    }
}

// Mesh and time add up, unless both at once say more; the rest comes on top.
static nmm_status find_unsure(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    const double size = nmm_trade_size(trade, trade->result.reference);
    double off[N_PART], sum = 0;
    char text[256] = "";
    TRY(find_unseen(bench));
    for (int k = 0; k < N_PART; k++) {
        const size_t used = strlen(text);
        off[k] = trade->row[0].completed || k == 0 ? off_by(bench, part[k].knob) / size : 0;
        if (off[k] > 0)
            snprintf(text + used, sizeof text - used, "%s%s %.2g %%", used > 0 ? ", " : "",
                     part[k].words, 100 * off[k]);
        if (k > 2) sum += off[k];
    }
    trade->result.unsure = nmm_max(off[0], off[1] + off[2]) + sum;
    return nmm_bench_remark(bench, "The reference is known to %.3g %%: %s%s%s.",
                            100 * trade->result.unsure, text[0] != 0 ? text : "all runs agree",
                            trade->unseen[0] != 0 ? "; not in it: " : "", trade->unseen);
}

// --- The reference

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

// True: there are two runs to compare, and their limit is the reference.
static bool take_ladder(nmm_bench *bench, nmm_trade_knob knob, limit *found) {
    nmm_trade *trade = bench->trade;
    const nmm_trade_ladder l = nmm_trade_find_ladder(bench, knob);
    if (l.n < 2) return false;
    *found = limit_of(trade, &l);
    if (!(nmm_trade_size(trade, found->value) > 0)) return false;
    memcpy(trade->result.reference, found->value, sizeof found->value);
    trade->ladder = knob;
    trade->result.source = found->regular ? "extrapolated" : "finest run";
    if (!found->regular) trade->reference_row = l.row[l.n - 1];
    return true;
}

// True: orders 1 and 2 agree with each other more closely than the sizes of order 0 know their
// limit, and with that limit as far as it is known. Then order 2 is the reference, and how far
// order 1 is from it says how well it is known: two ways to one answer again.
static bool take_orders(nmm_bench *bench, limit *found) {
    nmm_trade *trade = bench->trade;
    const nmm_trade_ladder lower = ladder_of_order(bench, "covers.order=1");
    const nmm_trade_ladder upper = ladder_of_order(bench, "covers.order=2");
    if (lower.n < 3 || upper.n < 3) return false;
    const limit one = limit_of(trade, &lower), two = limit_of(trade, &upper);
    const double off = nmm_max(two.off, nmm_trade_distance(trade, one.value, two.value));
    if (!(nmm_trade_size(trade, two.value) > 0)) return false;
    if (off >= off_by_ladder(bench, NMM_TRADE_SIZE, NMM_TRADE_ORDER)) return false;
    if (nmm_trade_distance(trade, found->value, two.value) > found->off + off) return false;
    *found = two;
    memcpy(trade->result.reference, two.value, sizeof two.value);
    trade->ladder = NMM_TRADE_ORDER;
    trade->order_off = off;
    trade->result.source = two.regular ? "extrapolated" : "finest run";
    trade->reference_row = two.regular ? -1 : upper.row[upper.n - 1];
    return true;
}

nmm_status nmm_trade_find_reference(nmm_bench *bench) {
    // The ladder that refines most at once comes first.
    static const nmm_trade_knob ladders[] = {NMM_TRADE_BOTH,   NMM_TRADE_SIZE,
                                             NMM_TRADE_DT,     NMM_TRADE_TOLERANCE,
                                             NMM_TRADE_SOLVER, NMM_TRADE_PENALTY};
    nmm_trade *trade = bench->trade;
    nmm_trade_result *result = &trade->result;
    const char *how = NULL;
    trade->reference_row = -1;
    trade->unseen = "";
    if (trade->has_expectation) {
        memcpy(result->reference, trade->expectation, sizeof result->reference);
        result->source = "closed form";
        return say_reference(bench, "the value given");
    }
    for (size_t k = 0; k < sizeof ladders / sizeof *ladders; k++) {
        const char *name = nmm_trade_knob_name((int)ladders[k]);
        limit found;
        if (!take_ladder(bench, ladders[k], &found)) continue;
        if (ladders[k] == NMM_TRADE_SIZE && take_orders(bench, &found)) name = "size with order 2";
        if (found.regular)
            TRY(nmm_bench_words(bench, &how,
                                "extrapolated from the last three runs of %s, which converge with "
                                "order %.1f",
                                name, found.order));
        else
            TRY(nmm_bench_words(bench, &how,
                                "the finest run of %s, as those do not converge regularly", name));
        TRY(say_reference(bench, how));
        return find_unsure(bench);
    }
    return nmm_bench_remark(bench, "Errors are not known: no ladder of size, dt, tolerance or "
                                   "penalty has two runs that completed, and no closed form was "
                                   "given; turn size or dt as well, or say --expect.");
}
