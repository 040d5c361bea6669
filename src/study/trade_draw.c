// SPDX-License-Identifier: MIT
//
// The picture of a trade: error against time, both logarithmic, a colour and mark for each kind of
// knob, the Pareto set joined by a line, the error wanted as a level.

#include "trade.h"

#include <math.h>

/// Knobs by what they have in common, as there are eight colours. The scene's own mark comes last,
/// so that it lies on top.
enum { N_GROUP = 8 };
static const char *const group_name[N_GROUP] = {
    "size",  "dt",      "size with dt",          "mesh, scheme", "tolerances, precision",
    "order", "penalty", "the scene as it stands"};

static int group_of(nmm_trade_knob knob) {
    static const int group[NMM_TRADE_KNOBS] = {
        [NMM_TRADE_SIZE] = 0,    [NMM_TRADE_DT] = 1,        [NMM_TRADE_BOTH] = 2,
        [NMM_TRADE_MESH] = 3,    [NMM_TRADE_SCHEME] = 3,    [NMM_TRADE_TOLERANCE] = 4,
        [NMM_TRADE_SOLVER] = 4,  [NMM_TRADE_PRECISION] = 4, [NMM_TRADE_ORDER] = 5,
        [NMM_TRADE_PENALTY] = 6, [NMM_TRADE_SCENE] = 7};
    return group[knob];
}

static nmm_status make_room(nmm_bench *bench, double *place[2]) {
    for (int k = 0; k < 2; k++)
        TRY(nmm_arena_take(&bench->context, &bench->arena, &place[k], (size_t)bench->n_row,
                           sizeof(double)));
    return NMM_OK;
}

// The Pareto set where `group` is below 0.
static nmm_status take_series(nmm_bench *bench, int group, nmm_chart_series *series) {
    double *place[2] = {NULL, NULL};
    TRY(make_room(bench, place));
    int n = 0;
    for (int i = 0; i < bench->n_row; i++) {
        const nmm_trade_row *row = &bench->trade->row[i];
        const bool wanted = group < 0 ? row->pareto : group_of(row->setting->knob) == group;
        if (!wanted || !isfinite(row->error)) continue;
        // By time, as a line joins them.
        int at = n++;
        for (; at > 0 && place[0][at - 1] > row->seconds; at--) {
            place[0][at] = place[0][at - 1];
            place[1][at] = place[1][at - 1];
        }
        place[0][at] = row->seconds;
        place[1][at] = 100 * row->error;
    }
    series->x = place[0];
    series->y = place[1];
    series->n = n;
    return NMM_OK;
}

// The first note, but short.
static nmm_status say_subtitle(nmm_bench *bench, const char **words) {
    const nmm_trade_result *result = &bench->trade->result;
    if (!(result->unsure > 0)) return nmm_bench_words(bench, words, "%s", nmm_bench_note(bench, 0));
    return nmm_bench_words(bench, words, "Error of %s at the end; reference: %s, known to %.3g %%.",
                           result->quantity, result->source, 100 * result->unsure);
}

nmm_status nmm_trade_draw(nmm_bench *bench, const char *path) {
    const nmm_trade *trade = bench->trade;
    nmm_chart_series series[N_GROUP + 1] = {{.name = "Pareto set", .style = NMM_CHART_SLOPE}};
    nmm_chart_level level = {"wanted", 100 * trade->def.want};
    int n = 1;
    TRY(take_series(bench, -1, &series[0]));
    // A knob that was not turned keeps its colour.
    for (int group = 0; group < N_GROUP; group++, n++) {
        series[n].style = NMM_CHART_MARKS;
        TRY(take_series(bench, group, &series[n]));
        if (series[n].n > 0) series[n].name = group_name[group];
    }
    const nmm_chart_panel panel = {.x = {"wall time of the run [s]", true, 0, 0},
                                   .y = {"error [%]", true, 0, 0},
                                   .n_series = n,
                                   .series = series,
                                   .n_level = trade->def.want > 0 ? 1 : 0,
                                   .level = &level};
    const char *title = NULL, *subtitle = NULL;
    TRY(say_subtitle(bench, &subtitle));
    TRY(nmm_bench_words(bench, &title, "Speed against accuracy: %s", trade->def.path));
    const nmm_chart chart = {.title = title, .subtitle = subtitle, .n_panel = 1, .panel = &panel};
    return nmm_chart_write(&bench->context, &chart, path, 0);
}
