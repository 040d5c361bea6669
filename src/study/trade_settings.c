// SPDX-License-Identifier: MIT
//
// Settings of a trade: each knob turned by itself around the scene's own setting, and cover size
// with dt together. Each ladder goes from coarse to fine by factors of two where the error is one
// of mesh or time, by decades where it is one of a tolerance.

#include "trade.h"

#include <stdlib.h>
#include <string.h>

/// Factors of a ladder, in its full form and in its quick one; 0: no more.
enum { MOST_FACTORS = 4 };
static const double by_two[2][MOST_FACTORS] = {{4, 2, 0.5, 0.25}, {2, 0.5}};
static const double coarser[2][MOST_FACTORS] = {{4, 2, 1}, {2, 1}};
static const double by_decades[2][MOST_FACTORS] = {{1e6, 1e4, 1e2, 1e-2}, {1e4, 1e2}};
static const double stiffer[2][MOST_FACTORS] = {{0.1, 10, 100}, {0.1, 10}};

/// Beyond these a tolerance means nothing.
#define LOOSEST 1e-2
#define TIGHTEST 1e-13

/// Standard value of solver.tolerance.
#define STANDARD "1e-08"

/// Range of contact.penalty in a scene.
#define SOFTEST 1e-3
#define STIFFEST 1e7

// As in the command line, but for the two that no one names.
static const char *const knob_word[NMM_TRADE_KNOBS] = {
    "scene",  "size",      "dt",     "size with dt", "order",  "mesh",
    "scheme", "tolerance", "solver", "precision",    "penalty"};

const char *nmm_trade_knob_name(int knob) {
    return knob >= 0 && knob < NMM_TRADE_KNOBS ? knob_word[knob] : "";
}

// --- Which knobs

static bool can_be_named(int knob) {
    return knob != NMM_TRADE_SCENE && knob != NMM_TRADE_BOTH;
}

static nmm_status take_word(nmm_bench *bench, const char *word, size_t length,
                            bool wanted[NMM_TRADE_KNOBS]) {
    char list[160] = "";
    for (int k = 0; k < NMM_TRADE_KNOBS; k++) {
        if (!can_be_named(k)) continue;
        if (strlen(knob_word[k]) == length && strncmp(knob_word[k], word, length) == 0) {
            wanted[k] = true;
            return NMM_OK;
        }
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", used > 0 ? ", " : "", knob_word[k]);
    }
    return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT, "no knob '%.*s'; there are %s",
                    (int)nmm_min(64, (double)length), word, list);
}

static nmm_status find_knobs(nmm_bench *bench, bool wanted[NMM_TRADE_KNOBS]) {
    const char *at = bench->trade->def.knobs;
    for (int k = 0; k < NMM_TRADE_KNOBS; k++)
        wanted[k] = at == NULL;
    while (at != NULL) {
        const size_t length = strcspn(at, ",");
        TRY(take_word(bench, at, length, wanted));
        at = at[length] == ',' ? at + length + 1 : NULL;
    }
    wanted[NMM_TRADE_BOTH] = wanted[NMM_TRADE_SIZE] && wanted[NMM_TRADE_DT];
    return NMM_OK;
}

// --- Their settings

static nmm_trade_setting *add(nmm_trade *trade, nmm_trade_knob knob, double factor) {
    NMM_ASSERT(trade->n_setting < NMM_TRADE_SETTINGS);
    nmm_trade_setting *setting = &trade->setting[trade->n_setting++];
    *setting = (nmm_trade_setting){.knob = knob, .factor = factor};
    return setting;
}

static nmm_status put(nmm_bench *bench, nmm_trade_setting *setting, const char *key,
                      const char *value) {
    NMM_ASSERT(setting->n_override < NMM_TRADE_OVERRIDES);
    return nmm_bench_words(bench, &setting->override[setting->n_override++], "%s=%s", key, value);
}

// Rounding of units is no part of the setting.
static nmm_status put_number(nmm_bench *bench, nmm_trade_setting *setting, const char *key,
                             double value) {
    char text[32];
    snprintf(text, sizeof text, "%.9g", value);
    return put(bench, setting, key, text);
}

// Tolerances and penalties are worth two digits.
static nmm_status put_rounded(nmm_bench *bench, nmm_trade_setting *setting, const char *key,
                              double value) {
    char text[32];
    snprintf(text, sizeof text, "%.1e", value);
    return put_number(bench, setting, key, strtod(text, NULL));
}

// dt, and dt_max where the scene gives it.
static nmm_status put_time(nmm_bench *bench, nmm_trade_setting *setting, double factor) {
    const nmm_scene_settings *scene = &bench->trade->scene;
    TRY(put_number(bench, setting, "time.dt", factor * scene->dt));
    if (!bench->trade->keeps_dt_max) return NMM_OK;
    return put_number(bench, setting, "time.dt_max", factor * scene->dt_max);
}

static nmm_status add_mesh_and_time(nmm_bench *bench, nmm_trade_knob knob) {
    nmm_trade *trade = bench->trade;
    const nmm_scene_settings *scene = &trade->scene;
    const bool sizes = knob != NMM_TRADE_DT, times = knob != NMM_TRADE_SIZE;
    if (sizes && scene->mesh != NMM_MESH_LATTICE) return NMM_OK;
    if (times && scene->is_static) return NMM_OK;
    const double *factor = by_two[trade->def.quick != 0];
    for (int k = 0; k < MOST_FACTORS && factor[k] > 0; k++) {
        const double f = factor[k];
        // A step beyond the end is cut to it.
        if (times && f > 1 && f * scene->dt > scene->end) continue;
        nmm_trade_setting *setting = add(trade, knob, f);
        if (sizes) TRY(put_number(bench, setting, "covers.size", f * scene->cover_size));
        if (times) TRY(put_time(bench, setting, f));
    }
    return NMM_OK;
}

// Other orders of the cover functions, on the scene's own lattice and on coarser ones, which is
// what higher orders are for.
static nmm_status add_orders(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    const double *factor = coarser[trade->def.quick != 0];
    for (int order = 0; order < NMM_TRADE_ORDERS; order++) {
        for (int k = 0; trade->allows_order[order] && k < MOST_FACTORS && factor[k] > 0; k++) {
            const char digit[2] = {(char)('0' + order), 0};
            nmm_trade_setting *setting = add(trade, NMM_TRADE_ORDER, factor[k]);
            TRY(put(bench, setting, "covers.order", digit));
            if (factor[k] != 1)
                TRY(put_number(bench, setting, "covers.size", factor[k] * trade->scene.cover_size));
            // Who asks for the last digit of one order would not get it of another.
            if (trade->scene.solver_tolerance < TIGHTEST)
                TRY(put(bench, setting, "solver.tolerance", STANDARD));
        }
    }
    return NMM_OK;
}

static nmm_status add_mesh(nmm_bench *bench) {
    const nmm_trade *trade = bench->trade;
    nmm_trade_setting *setting = add(bench->trade, NMM_TRADE_MESH, 1);
    const bool lattice = trade->scene.mesh == NMM_MESH_LATTICE;
    TRY(put(bench, setting, "covers.mesh", lattice ? "block" : "lattice"));
    // What the scene gives belongs to its own mesh.
    if (trade->mesh_resets_size) TRY(put(bench, setting, "covers.size", "auto"));
    return trade->mesh_resets_order ? put(bench, setting, "covers.order", "auto") : NMM_OK;
}

// With the scene's own step, and with the finest: there both schemes should agree.
static nmm_status add_scheme(nmm_bench *bench, bool with_dt) {
    nmm_trade *trade = bench->trade;
    const char *other = trade->scene.newmark ? "shi" : "newmark";
    const double factor[2] = {1, trade->def.quick != 0 ? 0.5 : 0.25};
    for (int k = 0; !trade->scene.is_static && k < (with_dt ? 2 : 1); k++) {
        nmm_trade_setting *setting = add(trade, NMM_TRADE_SCHEME, factor[k]);
        TRY(put(bench, setting, "analysis.scheme", other));
        if (factor[k] < 1) TRY(put_time(bench, setting, factor[k]));
    }
    return NMM_OK;
}

static nmm_status add_tolerances(nmm_bench *bench, nmm_trade_knob knob) {
    nmm_trade *trade = bench->trade;
    const bool of_solver = knob == NMM_TRADE_SOLVER;
    const double own = of_solver ? trade->scene.solver_tolerance : trade->scene.tolerance;
    const char *key = of_solver ? "solver.tolerance" : "analysis.tolerance";
    const double *factor = by_decades[trade->def.quick != 0];
    for (int k = 0; k < MOST_FACTORS && factor[k] > 0; k++) {
        const double f = factor[k];
        const double value = f * own;
        if (value > LOOSEST * 1.001 || value < TIGHTEST) continue;
        TRY(put_rounded(bench, add(trade, knob, f), key, value));
    }
    return NMM_OK;
}

static nmm_status add_precision(nmm_bench *bench) {
    nmm_trade_setting *setting = add(bench->trade, NMM_TRADE_PRECISION, 1);
    const bool mixed = bench->trade->scene.precision == NMM_SCENE_MIXED;
    return put(bench, setting, "solver.precision", mixed ? "double" : "mixed");
}

static nmm_status add_penalties(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    if (!trade->has_contact || !(trade->scene.penalty > 0)) return NMM_OK;
    const double *factor = stiffer[trade->def.quick != 0];
    for (int k = 0; k < MOST_FACTORS && factor[k] > 0; k++) {
        const double f = factor[k];
        const double value = f * trade->scene.penalty;
        if (value < SOFTEST || value > STIFFEST) continue;
        TRY(put_rounded(bench, add(trade, NMM_TRADE_PENALTY, 1 / f), "contact.penalty", value));
    }
    return NMM_OK;
}

static nmm_status add_knob(nmm_bench *bench, nmm_trade_knob knob,
                           const bool wanted[NMM_TRADE_KNOBS]) {
    switch (knob) {
    case NMM_TRADE_SIZE:
    case NMM_TRADE_DT:
    case NMM_TRADE_BOTH:
        return add_mesh_and_time(bench, knob);
    case NMM_TRADE_ORDER:
        return add_orders(bench);
    case NMM_TRADE_MESH:
        return add_mesh(bench);
    case NMM_TRADE_SCHEME:
        return add_scheme(bench, wanted[NMM_TRADE_DT]);
    case NMM_TRADE_TOLERANCE:
    case NMM_TRADE_SOLVER:
        return add_tolerances(bench, knob);
    case NMM_TRADE_PRECISION:
        return add_precision(bench);
    case NMM_TRADE_PENALTY:
        return add_penalties(bench);
    default:
        return NMM_OK;
    }
}

nmm_status nmm_trade_find_settings(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    bool wanted[NMM_TRADE_KNOBS];
    TRY(find_knobs(bench, wanted));
    add(trade, NMM_TRADE_SCENE, 1);
    for (int k = 1; k < NMM_TRADE_KNOBS; k++)
        if (wanted[k]) TRY(add_knob(bench, (nmm_trade_knob)k, wanted));
    if (trade->n_setting > 1) return NMM_OK;
    return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT,
                    "nothing to be traded: no knob out of '%s' means anything in this scene",
                    trade->def.knobs != NULL ? trade->def.knobs : "all");
}
