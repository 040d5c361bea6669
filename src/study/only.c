// SPDX-License-Identifier: MIT
//
// What a feature costs a scene that does not need it: the same steps without and with it, taking
// turns; the least time of a few runs counts, because what disturbs only adds. Memory is the peak
// of what passes the allocation hook, that of the run file's writer with it.

#include "bench.h"

#include "io.h"

#include <math.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

enum { REPEATS = 5, REPEATS_QUICK = 1, STEPS = 100, STEPS_QUICK = 5 };

/// Unknowns of the beam, about; columns and courses of the wall.
enum { BEAM = 4000, BEAM_QUICK = 400, WALL = 12, WALL_QUICK = 4 };

typedef enum place { BEAM_OF_ONE_BLOCK, BRICK_WALL } place;
static const char *const place_name[] = {"beam of one block", "brick wall"};

/// How a scene is run: settings, and what no setting can ask for.
typedef struct way {
    const char *setting[2];
    bool search_always, writes;
} way;

/// A feature, and the scene without and with it.
static const struct {
    const char *name;
    place place;
    way way[2];
} feature[] = {
    {"contact search", BEAM_OF_ONE_BLOCK, {{{0}, false, false}, {{0}, true, false}}},
    {"means over the step",
     BEAM_OF_ONE_BLOCK,
     {{{"analysis.scheme=shi"}, false, false}, {{"analysis.scheme=newmark"}, false, false}}},
    {"run file, a frame in ten steps",
     BEAM_OF_ONE_BLOCK,
     {{{0}, false, false}, {{"output.every=0.01"}, false, true}}},
    {"velocity and stress in it",
     BEAM_OF_ONE_BLOCK,
     {{{"output.every=0.01", "output.fields=[displacement]"}, false, true},
      {{"output.every=0.01"}, false, true}}},
    {"covers of order 1",
     BEAM_OF_ONE_BLOCK,
     {{{"covers.order=0"}, false, false}, {{"covers.order=1"}, false, false}}},
    {"augmentation",
     BRICK_WALL,
     {{{"contact.method=penalty"}, false, false}, {{"contact.method=augmented"}, false, false}}},
    {"a lattice in each block",
     BRICK_WALL,
     {{{"covers.mesh=block"}, false, false},
      {{"covers.mesh=lattice", "covers.size=1.2"}, false, false}}},
};
enum { FEATURES = sizeof feature / sizeof *feature };

enum {
    FEATURE,
    SCENE,
    UNKNOWNS,
    STEPS_DONE,
    WITHOUT,
    WITH,
    TIME_SAVED,
    MEMORY_WITHOUT,
    MEMORY_WITH,
    MEMORY_SAVED,
    FILE_WITHOUT,
    FILE_WITH,
    N_COLUMN
};

static const nmm_bench_column columns[] = {
    [FEATURE] = {"feature", "feature", "", 1, 0},
    [SCENE] = {"scene", "scene", "", 1, 0},
    [UNKNOWNS] = {"unknowns", "unknowns", "", 0, 0},
    [STEPS_DONE] = {"steps", "steps", "", 0, 0},
    [WITHOUT] = {"without_ms", "a step without", "ms", 0, 3},
    [WITH] = {"with_ms", "with", "ms", 0, 3},
    [TIME_SAVED] = {"time_saved", "saved", "%", 0, 2},
    [MEMORY_WITHOUT] = {"without_mb", "memory without", "MB", 0, 3},
    [MEMORY_WITH] = {"with_mb", "with", "MB", 0, 3},
    [MEMORY_SAVED] = {"memory_saved", "saved", "%", 0, 2},
    [FILE_WITHOUT] = {"file_without_mb", "file without", "MB", 0, 3},
    [FILE_WITH] = {"file_with_mb", "with", "MB", 0, 3},
    [N_COLUMN] = {0},
};

/// What a run took.
typedef struct outcome {
    double seconds, bytes, file_bytes;
    long steps;
    int unknowns;
} outcome;

// --- Scenes

// 10 x 1 m, held at one end; a lattice of about so many unknowns.
static nmm_status beam_text(nmm_bench *bench, const char **text, int unknowns) {
    return nmm_bench_words(bench, text,
                           "nmm: 1\n"
                           "title: Beam of one block\n"
                           "gravity: [0, -9.81]\n"
                           "domain: [{polygon: [[0, 0], [10, 0], [10, 1], [0, 1]]}]\n"
                           "materials: {rock: {density: 2500, youngs_modulus: 1e9, "
                           "poissons_ratio: 0.25}}\n"
                           "supports: [{segment: [[0, 0], [0, 1]], fix: xy}]\n"
                           "covers: {size: %.4g}\n"
                           "time: {dt: 1e-3, end: 10}\n",
                           sqrt(23.0 / unknowns));
}

static nmm_status make_text(nmm_bench *bench, const char **text, place where) {
    const bool quick = bench->def.quick != 0;
    const int side = quick ? WALL_QUICK : WALL;
    if (where == BRICK_WALL) return nmm_bench_wall_text(bench, text, side, side, "{mesh: block}");
    return beam_text(bench, text, quick ? BEAM_QUICK : BEAM);
}

// --- Runs

// A file of its own among the temporary ones.
static nmm_status name_file(nmm_bench *bench, const char **path) {
    const char *folder = getenv("TMPDIR");
    return nmm_bench_words(bench, path, "%s/nmm-bench-only-%ld.vtkhdf",
                           folder != NULL && *folder != 0 ? folder : "/tmp", (long)getpid());
}

static double file_bytes(const char *path) {
    struct stat about;
    return stat(path, &about) == 0 ? (double)about.st_size : 0;
}

static nmm_status write_step(nmm_output *output, nmm_sim *sim, const nmm_step_report *report) {
    return output != NULL ? nmm_output_step(output, sim, report) : NMM_OK;
}

// The steps, with their output; what is set up before is not measured.
static nmm_status take_steps(nmm_bench *bench, nmm_sim *sim, nmm_output *output, outcome *out) {
    const long most = bench->def.quick ? STEPS_QUICK : STEPS;
    nmm_step_report report = {.end = NMM_END_RUNNING};
    const double start = nmm_clock();
    for (long k = 0; k < most && report.end == NMM_END_RUNNING; k++) {
        const nmm_status status = nmm_sim_step(sim, &report);
        if (status != NMM_OK) bench->context.error = *nmm_sim_error(sim);
        TRY(status);
        const nmm_status written = write_step(output, sim, &report);
        if (written != NMM_OK) bench->context.error = *nmm_output_error(output);
        TRY(written);
    }
    out->seconds = nmm_clock() - start;
    out->steps = report.step;
    return NMM_OK;
}

static nmm_status run_with_file(nmm_bench *bench, nmm_sim *sim, outcome *out) {
    const char *path = NULL;
    nmm_output *output = NULL;
    TRY(name_file(bench, &path));
    nmm_status status = nmm_output_create(&output, sim, path);
    if (status != NMM_OK) bench->context.error = *nmm_output_error(output);
    if (status == NMM_OK) status = take_steps(bench, sim, output, out);
    if (status == NMM_OK) status = nmm_output_finish(output, sim);
    if (status == NMM_OK) {
        out->bytes = (double)nmm_output_peak_bytes(output);
        out->file_bytes = file_bytes(path);
    }
    nmm_output_destroy(output);
    unlink(path);
    return status;
}

static nmm_status run_once(nmm_bench *bench, const char *text, int k, int side, outcome *out) {
    const way *how = &feature[k].way[side];
    nmm_bench_source source = {.path = place_name[feature[k].place],
                               .text = text,
                               .n_thread = 1,
                               .device = NMM_DEVICE_HOST,
                               .search_always = how->search_always};
    for (int i = 0; i < 2 && how->setting[i] != NULL; i++)
        source.override[source.n_override++] = how->setting[i];
    nmm_sim *sim = NULL;
    *out = (outcome){.seconds = NAN};
    nmm_status status = nmm_bench_open(bench, &sim, &source);
    if (status == NMM_OK)
        status = how->writes ? run_with_file(bench, sim, out) : take_steps(bench, sim, NULL, out);
    if (status == NMM_OK) {
        out->bytes += (double)sim->context.peak_bytes;
        out->unknowns = 2 * sim->model.n_cover;
    }
    nmm_bench_close(&sim);
    return status;
}

// --- Rows

static double saved(double without, double with) {
    return 100 * (with - without) / with;
}

static nmm_status write_row(nmm_bench *bench, int k, const outcome out[2]) {
    const double ms[2] = {1e3 * out[0].seconds / (double)out[0].steps,
                          1e3 * out[1].seconds / (double)out[1].steps};
    TRY(nmm_bench_add(bench));
    TRY(nmm_bench_say(bench, FEATURE, feature[k].name));
    TRY(nmm_bench_say(bench, SCENE, place_name[feature[k].place]));
    nmm_bench_set(bench, UNKNOWNS, out[0].unknowns);
    nmm_bench_set(bench, STEPS_DONE, (double)out[0].steps);
    nmm_bench_set(bench, TIME_SAVED, saved(ms[0], ms[1]));
    nmm_bench_set(bench, MEMORY_SAVED, saved(out[0].bytes, out[1].bytes));
    for (int side = 0; side < 2; side++) {
        nmm_bench_set(bench, WITHOUT + side, ms[side]);
        nmm_bench_set(bench, MEMORY_WITHOUT + side, 1e-6 * out[side].bytes);
        if (out[side].file_bytes > 0)
            nmm_bench_set(bench, FILE_WITHOUT + side, 1e-6 * out[side].file_bytes);
    }
    nmm_bench_done(bench);
    return NMM_OK;
}

static nmm_status measure_feature(nmm_bench *bench, int k) {
    const int repeats = bench->def.quick ? REPEATS_QUICK : REPEATS;
    const char *text = NULL;
    outcome least[2] = {{.seconds = INFINITY}, {.seconds = INFINITY}};
    TRY(make_text(bench, &text, feature[k].place));
    for (int i = 0; i < 2 * repeats; i++) {
        outcome out;
        TRY(run_once(bench, text, k, i % 2, &out));
        if (out.seconds < least[i % 2].seconds) least[i % 2] = out;
    }
    return write_row(bench, k, least);
}

static nmm_status measure(nmm_bench *bench) {
    for (int k = 0; k < FEATURES; k++) {
        if (!nmm_bench_goes_on(bench, "only: %s", feature[k].name)) return NMM_OK;
        TRY(measure_feature(bench, k));
    }
    return NMM_OK;
}

// --- The picture

static nmm_status draw(nmm_bench *bench, const char *path) {
    static const char *const bar[2] = {"time of a step", "memory"};
    const char *name[FEATURES];
    double value[FEATURES][2];
    for (int row = 0; row < bench->n_row; row++) {
        name[row] = nmm_bench_text(bench, row, FEATURE);
        // What differs by chance may come out below zero.
        value[row][0] = nmm_max(0, nmm_bench_number(bench, row, TIME_SAVED));
        value[row][1] = nmm_max(0, nmm_bench_number(bench, row, MEMORY_SAVED));
    }
    const nmm_chart_bars bars = {bench->n_row, 2, 1, name, bar, NULL, &value[0][0]};
    const nmm_chart_panel panel = {.x = {"saved [%]", false, 0, 100}, .bars = &bars};
    const nmm_chart chart = {.title = "What a scene saves that does without",
                             .subtitle = "Parts of the time and memory of the same steps with the "
                                         "feature.",
                             .n_panel = 1,
                             .panel = &panel};
    return nmm_chart_write(&bench->context, &chart, path, 0);
}

const nmm_bench_kind nmm_bench_only = {
    .name = {"only", "time and memory of scenes without and with features they can do without", 0},
    .title = "Only what the scene requires",
    .column = columns,
    .measure = measure,
    .draw = draw,
};
