// SPDX-License-Identifier: MIT
//
// Speed against accuracy: a scene is run with one knob turned at a time, each run is timed from
// reading the scene to its end and gives one quantity at its end.
//
// Short runs are repeated and the least time counts, because what disturbs only adds. A run that
// ends early, takes too long or has a setting that the scene does not allow becomes a row that says
// so; only a lack of memory, or trouble with the scene as it stands, ends the trade.

#include "trade.h"

#include <math.h>
#include <omp.h>
#include <string.h>

/// Runs are repeated until they have taken so long in all [s], or so often.
enum { MOST_REPEATS = 5 };
#define ENOUGH 0.4

/// Longest run [s] where nothing is said; time between two looks at the caller's wish to stop [s].
#define LONGEST 600
#define LONGEST_QUICK 20
#define BETWEEN_LOOKS 0.1

static const nmm_bench_column columns[] = {
    [NMM_TRADE_COLUMN_KNOB] = {"knob", "knob", "", 1, 0},
    [NMM_TRADE_COLUMN_SETTING] = {"setting", "setting", "", 1, 0},
    [NMM_TRADE_COLUMN_UNKNOWNS] = {"unknowns", "unknowns", "", 0, 0},
    [NMM_TRADE_COLUMN_STEPS] = {"steps", "steps", "", 0, 0},
    [NMM_TRADE_COLUMN_SECONDS] = {"seconds", "time", "s", 0, 3},
    [NMM_TRADE_COLUMN_VALUE] = {"value", "value", "", 1, 0},
    [NMM_TRADE_COLUMN_ERROR] = {"error", "error", "%", 0, 3},
    [NMM_TRADE_COLUMN_PARETO] = {"pareto", "Pareto", "", 1, 0},
    [NMM_TRADE_COLUMN_END] = {"end", "end", "", 1, 0},
    [NMM_TRADE_N_COLUMN] = {0},
};

const nmm_bench_kind nmm_bench_trade = {
    .name = {"trade", "speed against accuracy of a scene", 0},
    .title = "Speed against accuracy",
    .column = columns,
    .draw = nmm_trade_draw,
};

nmm_trade_def nmm_default_trade_def(void) {
    return (nmm_trade_def){.device = NMM_DEVICE_SCENE};
}

// --- Runs

nmm_status nmm_trade_open(nmm_bench *bench, nmm_sim **sim, const nmm_trade_setting *setting) {
    const nmm_trade_def *own = &bench->trade->def;
    const int n_own = own->n_override, n_more = setting != NULL ? setting->n_override : 0;
    const char **override = NULL;
    TRY(nmm_arena_take(&bench->context, &bench->arena, &override, (size_t)(n_own + n_more) + 1,
                       sizeof *override));
    for (int k = 0; k < n_own; k++)
        override[k] = own->override[k];
    for (int k = 0; k < n_more; k++)
        override[n_own + k] = setting->override[k];
    nmm_sim_def def = nmm_default_sim_def();
    def.path = own->path;
    def.n_override = n_own + n_more;
    def.override = override;
    def.n_thread = own->n_thread;
    def.device = own->device;
    def.allocate = own->allocate;
    def.user = own->allocate_user;
    return nmm_sim_create(sim, &def);
}

// Of opening or stepping; also where there was no memory to begin with.
static nmm_error error_of(const nmm_bench *bench, const nmm_sim *sim) {
    const bool own = bench->context.error.status != NMM_OK;
    return own ? bench->context.error : *nmm_sim_error(sim);
}

/// How a run went.
typedef struct outcome {
    nmm_status status;
    nmm_error error;
    nmm_summary summary;
    double value[3], seconds;
    bool too_long;
} outcome;

// All steps, until they take too long or the caller wants to stop.
static nmm_status take_steps(nmm_bench *bench, nmm_sim *sim, const char *words, outcome *out) {
    const double started = nmm_clock() - out->seconds;
    double looked = started;
    nmm_step_report report = {.end = NMM_END_RUNNING};
    while (report.end == NMM_END_RUNNING) {
        TRY(nmm_sim_step(sim, &report));
        const double now = nmm_clock();
        out->seconds = now - started;
        out->too_long = report.end == NMM_END_RUNNING && out->seconds > bench->trade->longest;
        if (out->too_long) return NMM_OK;
        if (now - looked < BETWEEN_LOOKS) continue;
        looked = now;
        const double part = 100 * report.time / nmm_sim_end_time(sim);
        if (!nmm_bench_goes_on(bench, "trade: %s, %.0f %%", words, part)) return NMM_OK;
    }
    return NMM_OK;
}

static void run_once(nmm_bench *bench, const nmm_trade_setting *setting, const char *words,
                     outcome *out) {
    nmm_sim *sim = NULL;
    const double started = nmm_clock();
    *out = (outcome){.status = nmm_trade_open(bench, &sim, setting)};
    out->seconds = nmm_clock() - started;
    if (out->status == NMM_OK) out->status = take_steps(bench, sim, words, out);
    if (out->status == NMM_OK) {
        nmm_sim_summary(sim, &out->summary);
        nmm_trade_read(bench->trade, sim, out->value);
    } else {
        out->error = error_of(bench, sim);
    }
    nmm_bench_close(&sim);
}

// The least time of a few runs, where they are short. Results are the same in each.
static void run_repeatedly(nmm_bench *bench, const nmm_trade_setting *setting, const char *words,
                           outcome *out) {
    run_once(bench, setting, words, out);
    double taken = out->seconds;
    for (int k = 1; k < MOST_REPEATS && taken < ENOUGH; k++) {
        if (out->status != NMM_OK || bench->stopped) return;
        outcome again;
        run_once(bench, setting, words, &again);
        taken += again.seconds;
        const double least = nmm_min(out->seconds, again.seconds);
        *out = again;
        out->seconds = least;
    }
}

// --- Rows

static nmm_status put_words(nmm_bench *bench, const nmm_trade_setting *setting) {
    char text[512] = "";
    for (int k = 0; k < setting->n_override; k++) {
        const size_t used = strlen(text);
        snprintf(text + used, sizeof text - used, "%s%s", k > 0 ? " " : "", setting->override[k]);
    }
    TRY(nmm_bench_say(bench, NMM_TRADE_COLUMN_KNOB, nmm_trade_knob_name((int)setting->knob)));
    return nmm_bench_say(bench, NMM_TRADE_COLUMN_SETTING,
                         setting->n_override > 0 ? text : "as it stands");
}

static nmm_status put_end(nmm_bench *bench, const outcome *out) {
    char text[1200];
    const nmm_summary *s = &out->summary;
    if (out->status != NMM_OK)
        snprintf(text, sizeof text, "error: %s", out->error.message);
    else if (out->too_long)
        snprintf(text, sizeof text, "took longer than %.3g s", bench->trade->longest);
    else
        snprintf(text, sizeof text, "%s%s%s", nmm_end_name(s->end), s->reason[0] != 0 ? ": " : "",
                 s->reason);
    return nmm_bench_say(bench, NMM_TRADE_COLUMN_END, text);
}

static nmm_status put_value(nmm_bench *bench, const double value[3]) {
    char text[128] = "";
    for (int k = 0; k < bench->trade->quantity.width; k++) {
        const size_t used = strlen(text);
        snprintf(text + used, sizeof text - used, "%s%.7g", k > 0 ? " " : "", value[k]);
    }
    return nmm_bench_say(bench, NMM_TRADE_COLUMN_VALUE, text);
}

static nmm_trade_row *new_row(nmm_bench *bench, const nmm_trade_setting *setting) {
    nmm_trade_row *row = &bench->trade->row[bench->n_row - 1];
    *row = (nmm_trade_row){.setting = setting, .error = NAN};
    return row;
}

static nmm_status put_row(nmm_bench *bench, const nmm_trade_setting *setting, const outcome *out) {
    TRY(nmm_bench_add(bench));
    nmm_trade_row *row = new_row(bench, setting);
    TRY(put_words(bench, setting));
    TRY(put_end(bench, out));
    if (out->status == NMM_OK) {
        row->completed = out->summary.end == NMM_END_COMPLETED && !out->too_long;
        bench->trade->too_long = bench->trade->too_long || out->too_long;
        row->seconds = out->seconds;
        memcpy(row->value, out->value, sizeof row->value);
        nmm_bench_set(bench, NMM_TRADE_COLUMN_UNKNOWNS, out->summary.unknowns);
        nmm_bench_set(bench, NMM_TRADE_COLUMN_STEPS, (double)out->summary.steps);
        nmm_bench_set(bench, NMM_TRADE_COLUMN_SECONDS, out->seconds);
    }
    if (row->completed) TRY(put_value(bench, row->value));
    nmm_bench_done(bench);
    return NMM_OK;
}

// A finer setting takes longer still, so it is not tried.
static nmm_status put_left_out(nmm_bench *bench, const nmm_trade_setting *setting) {
    TRY(nmm_bench_add(bench));
    new_row(bench, setting);
    TRY(put_words(bench, setting));
    TRY(nmm_bench_say(bench, NMM_TRADE_COLUMN_END,
                      "left out: a coarser one, or one of lower order, took too long"));
    nmm_bench_done(bench);
    return NMM_OK;
}

// --- The trade

static bool is_mesh_or_time(nmm_trade_knob knob) {
    return knob == NMM_TRADE_SIZE || knob == NMM_TRADE_DT || knob == NMM_TRADE_BOTH;
}

static nmm_status run_all(nmm_bench *bench) {
    const nmm_trade *trade = bench->trade;
    double too_long[NMM_TRADE_KNOBS] = {0}; // coarsest factor that was; 0: none
    for (int k = 0; k < trade->n_setting; k++) {
        const nmm_trade_setting *setting = &trade->setting[k];
        const nmm_trade_knob knob = setting->knob;
        const char *words = setting->n_override > 0 ? setting->override[0] : "the scene";
        outcome out;
        if (!nmm_bench_goes_on(bench, "trade: run %d of %d, %s", k + 1, trade->n_setting, words))
            return NMM_OK;
        const bool is_ladder =
            is_mesh_or_time(knob) || knob == NMM_TRADE_ORDER || knob == NMM_TRADE_SCHEME;
        if (is_ladder &&
            (setting->factor <= too_long[knob] || setting->factor < too_long[NMM_TRADE_SCENE])) {
            TRY(put_left_out(bench, setting));
            continue;
        }
        run_repeatedly(bench, setting, words, &out);
        if (out.status == NMM_ERROR_MEMORY) {
            bench->context.error = out.error;
            return out.status;
        }
        if (bench->stopped) return NMM_OK;
        TRY(put_row(bench, setting, &out));
        if (out.too_long) too_long[knob] = nmm_max(too_long[knob], setting->factor);
    }
    return NMM_OK;
}

/// What a look at the scene with other settings tells.
typedef struct look {
    bool allowed;
    int unknowns;
    double dt_max;
} look;

// Whether the scene can be opened so, without a step. Only a lack of memory is an error.
static nmm_status look_at(nmm_bench *bench, look *out, int n, const char *const *override) {
    nmm_trade_setting setting = {.n_override = n};
    nmm_sim *sim = NULL;
    for (int k = 0; k < n; k++)
        setting.override[k] = override[k];
    *out = (look){0};
    nmm_status status = nmm_trade_open(bench, &sim, &setting);
    if (status == NMM_OK) {
        *out = (look){true, 2 * sim->model.n_cover, sim->settings.dt_max};
    } else if (status == NMM_ERROR_MEMORY) {
        bench->context.error = error_of(bench, sim);
    }
    nmm_bench_close(&sim);
    return status == NMM_ERROR_MEMORY ? status : NMM_OK;
}

// Does the scene give dt_max itself, so that it has to be changed with dt?
static nmm_status look_at_time(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    const char *half = NULL;
    look seen;
    if (trade->scene.is_static) return NMM_OK;
    TRY(nmm_bench_words(bench, &half, "time.dt=%.17g", 0.5 * trade->scene.dt));
    TRY(look_at(bench, &seen, 1, &half));
    trade->keeps_dt_max = seen.allowed && seen.dt_max > 0.75 * trade->scene.dt;
    return NMM_OK;
}

// Which orders are there, and are others than the scene's own? Those have other unknowns.
static nmm_status look_at_orders(nmm_bench *bench) {
    static const char *const order[NMM_TRADE_ORDERS] = {"covers.order=0", "covers.order=1",
                                                        "covers.order=2"};
    nmm_trade *trade = bench->trade;
    if (trade->scene.mesh != NMM_MESH_LATTICE) return NMM_OK;
    for (int k = 0; k < NMM_TRADE_ORDERS; k++) {
        look seen;
        TRY(look_at(bench, &seen, 1, &order[k]));
        trade->allows_order[k] = seen.allowed && seen.unknowns != trade->unknowns;
    }
    return NMM_OK;
}

// What has to go on auto, so that the other mesh is allowed.
static nmm_status look_at_mesh(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    const bool lattice = trade->scene.mesh == NMM_MESH_LATTICE;
    const char *const override[3] = {lattice ? "covers.mesh=block" : "covers.mesh=lattice",
                                     "covers.size=auto", "covers.order=auto"};
    look seen = {0};
    int n = 0;
    while (n < 3 && !seen.allowed)
        TRY(look_at(bench, &seen, ++n, override));
    trade->mesh_resets_size = n > 1;
    trade->mesh_resets_order = n > 2;
    return NMM_OK;
}

// The scene as it stands: what it needs, which quantity it has.
static nmm_status look_at_scene(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    nmm_sim *sim = NULL;
    nmm_status status = nmm_trade_open(bench, &sim, NULL);
    if (status == NMM_OK) {
        trade->scene = sim->settings;
        trade->unknowns = 2 * sim->model.n_cover;
        trade->has_contact = sim->search != NULL;
        status = nmm_trade_find_quantity(bench, sim);
    } else {
        bench->context.error = error_of(bench, sim);
        const char *mistakes = sim != NULL ? nmm_sim_mistakes(sim) : NULL;
        if (mistakes != NULL && *mistakes != 0)
            status = nmm_bench_words(bench, &bench->mistakes, "%s", mistakes) == NMM_OK
                         ? status
                         : NMM_ERROR_MEMORY;
    }
    nmm_bench_close(&sim);
    return status;
}

static nmm_status run(nmm_bench *bench) {
    nmm_trade *trade = bench->trade;
    const nmm_trade_def *def = &trade->def;
    if (def->path == NULL)
        return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT, "a trade needs the path of a scene");
    if (!(def->want >= 0 && def->want < 1) || !(def->longest >= 0)) {
        return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT,
                        "the error wanted must be from 0 to below 1, the longest run not below 0; "
                        "found %.3g and %.3g s",
                        def->want, def->longest);
    }
    trade->longest = def->longest > 0 ? def->longest : (def->quick != 0 ? LONGEST_QUICK : LONGEST);
    TRY(look_at_scene(bench));
    TRY(look_at_time(bench));
    TRY(look_at_orders(bench));
    TRY(look_at_mesh(bench));
    TRY(nmm_trade_find_settings(bench));
    TRY(run_all(bench));
    return nmm_trade_conclude(bench);
}

nmm_status nmm_trade_run(nmm_bench **bench, const nmm_trade_def *def) {
    const nmm_bench_def table = {.name = "trade",
                                 .quick = def->quick,
                                 .report = def->report,
                                 .user = def->user,
                                 .allocate = def->allocate,
                                 .allocate_user = def->allocate_user};
    TRY(nmm_bench_create(bench, &table));
    nmm_bench *b = *bench;
    nmm_bench_take_kind(b, &nmm_bench_trade);
    TRY(nmm_arena_take(&b->context, &b->arena, &b->trade, 1, sizeof *b->trade));
    b->trade->def = *def;
    b->trade->result.cheapest = -1;
    return run(b);
}

nmm_trade_result nmm_trade_result_of(const nmm_bench *bench) {
    nmm_trade_result none = {.cheapest = -1};
    nmm_trade_result result = bench != NULL && bench->trade != NULL ? bench->trade->result : none;
    const char **const text[] = {&result.quantity, &result.unit,  &result.source,
                                 &result.options,  &result.lines, &result.why};
    for (size_t k = 0; k < sizeof text / sizeof *text; k++)
        if (*text[k] == NULL) *text[k] = "";
    return result;
}
