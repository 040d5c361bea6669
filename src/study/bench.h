// SPDX-License-Identifier: MIT
//
// Inside of the experiments: the table that each fills row by row, the runs and solves it measures,
// and series of the table for its picture. The functions for users are in include/nmm/study.h.
//
// An experiment is a bench_kind: its columns, a function that measures, a function that draws. Both
// get the nmm_bench and nothing else, so that any table can be drawn again.

#ifndef NMM_BENCH_H
#define NMM_BENCH_H

#include "nmm/study.h"

#include "chart.h"
#include "linear.h"
#include "step.h"

/// Columns of a table, series of a picture, thread counts of an experiment: at most.
enum { NMM_BENCH_COLUMNS = 24, NMM_BENCH_SERIES = 12, NMM_BENCH_THREADS = 16 };

typedef struct nmm_bench_kind {
    nmm_bench_name name;
    const char *title;
    const nmm_bench_column *column; // ended by an entry without name
    nmm_status (*measure)(nmm_bench *bench);
    nmm_status (*draw)(nmm_bench *bench, const char *path);
} nmm_bench_kind;

/// The trade of a scene, inside trade.c and its neighbours.
typedef struct nmm_trade nmm_trade;

extern const nmm_bench_kind nmm_bench_table1, nmm_bench_fig6, nmm_bench_fig7, nmm_bench_contact,
    nmm_bench_wall, nmm_bench_growth, nmm_bench_only;

typedef struct nmm_bench_cell {
    double number;
    const char *text; // in the arena
} nmm_bench_cell;

struct nmm_bench {
    nmm_context context;
    nmm_arena arena; // words of the table, series of the picture
    nmm_bench_def def;
    const nmm_bench_kind *kind; // NULL: unknown name
    int n_column, n_row, n_cell, cell_room;
    nmm_bench_cell *cell; // [n_row][n_column]
    int n_note, note_room;
    const char **note;
    int n_thread, thread[NMM_BENCH_THREADS]; // from the settings, or chosen; ascending
    const char *mistakes;                    // of a scene, in the arena; NULL: none
    nmm_trade *trade;                        // in the arena; NULL: an experiment
    bool target;                             // a target is there and wanted
    bool stopped;
};

/// An empty handle, from the hook, with its settings.
nmm_status nmm_bench_create(nmm_bench **bench, const nmm_bench_def *def);
/// Columns of the table from now on.
void nmm_bench_take_kind(nmm_bench *bench, const nmm_bench_kind *kind);

// --- The table

/// Tell the caller what comes next. False: it wants to stop.
bool nmm_bench_goes_on(nmm_bench *bench, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/// A new row; its cells are empty.
nmm_status nmm_bench_add(nmm_bench *bench);
/// Cells of the last row.
void nmm_bench_set(nmm_bench *bench, int column, double number);
/// A cell of any row.
nmm_bench_cell *nmm_bench_cell_of(nmm_bench *bench, int row, int column);
nmm_status nmm_bench_say(nmm_bench *bench, int column, const char *text);
/// The last row is complete: tell the caller.
void nmm_bench_done(nmm_bench *bench);
nmm_status nmm_bench_remark(nmm_bench *bench, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/// Rows where column `column` holds `text` (not NULL) or else `number`; column -1: all rows.
typedef struct nmm_bench_filter {
    int column;
    const char *text;
    double number;
} nmm_bench_filter;
bool nmm_bench_matches(const nmm_bench *bench, int row, const nmm_bench_filter filter[2]);
/// The rows that match both filters, column y against column x, in the arena.
nmm_status nmm_bench_series(nmm_bench *bench, nmm_chart_series *series, int x, int y,
                            const nmm_bench_filter filter[2]);
/// Column x or y of the rows that match both, those that are finite; returns how many.
nmm_status nmm_bench_values(nmm_bench *bench, double **value, int *n, int column,
                            const nmm_bench_filter filter[2]);
/// Exponent p of y ~ x^p by least squares of logarithms, over x from `least` on; NaN: no two
/// points.
double nmm_bench_exponent(const nmm_chart_series *series, double least);

/// A copy of `text`, alive as long as the bench.
nmm_status nmm_bench_keep(nmm_bench *bench, const char **words, const char *text);
/// Words of printf form, alive as long as the bench.
nmm_status nmm_bench_words(nmm_bench *bench, const char **words, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/// Middle of n numbers, which are sorted by it; NaN for none.
double nmm_bench_median(int n, double *value);
/// "2 to 5" in so many digits; "2" where both read alike.
nmm_status nmm_bench_range(nmm_bench *bench, const char **words, int digits, double low,
                           double high);
/// What n > 0 numbers come to, which are sorted by it: "2 to 5 UNIT, median 3"; one: "2 UNIT".
nmm_status nmm_bench_spread(nmm_bench *bench, const char **words, int n, double *value,
                            const char *unit);

// --- Machines

/// Name of the host's processor, or of the device that a target run uses.
nmm_status nmm_bench_host(nmm_bench *bench, const char **name);
nmm_status nmm_bench_target(nmm_bench *bench, const char **name);
/// The one or the other, into a cell of the last row.
nmm_status nmm_bench_say_machine(nmm_bench *bench, int column, bool on_target);

// --- Scenes

/// Folders with a scene, by their number of unknowns, then by name.
typedef struct nmm_bench_scene {
    const char *name, *path;
    int blocks, unknowns;
    double size;       // [m] of covers
    bool whole_blocks; // one cover for each block, of no size that could be set
    bool is_static;
} nmm_bench_scene;
typedef struct nmm_bench_scenes {
    int n, room;
    nmm_bench_scene *scene;
} nmm_bench_scenes;
/// All scenes of the folder. The list is released with nmm_release(..., &scenes->scene).
nmm_status nmm_bench_find_scenes(nmm_bench *bench, nmm_bench_scenes *scenes);
/// The setting with which a scene on a lattice has nearest to `times` times its unknowns.
nmm_status nmm_bench_enlarge(nmm_bench *bench, const nmm_bench_scene *scene, double times,
                             const char **setting);
/// A note with the names of the scenes for which `is_out` holds, and why; none: no note.
nmm_status nmm_bench_left_out(nmm_bench *bench, const nmm_bench_scenes *scenes,
                              bool (*is_out)(const nmm_bench_scene *scene), const char *why);

/// A scene to run: a file, or a text in memory.
typedef struct nmm_bench_source {
    const char *path, *text;
    int n_thread;
    nmm_device_choice device;
    int n_override;
    const char *override[4];
    bool search_always; // as in nmm_sim_def
} nmm_bench_source;
nmm_status nmm_bench_open(nmm_bench *bench, nmm_sim **sim, const nmm_bench_source *source);
void nmm_bench_close(nmm_sim **sim);

/// Text of a wall in running bond: `courses` courses of `columns` bricks, on a fixed base.
nmm_status nmm_bench_wall_text(nmm_bench *bench, const char **text, int columns, int courses,
                               const char *covers);
/// Text of a slope `height` m high in rock with two joint sets of 4 m spacing.
nmm_status nmm_bench_slope_text(nmm_bench *bench, const char **text, double height);

// --- Runs

/// Until which step, which time of the scene [s] or which duration [s] a run goes; 0: no limit.
typedef struct nmm_bench_limit {
    long steps;
    double time, seconds;
} nmm_bench_limit;

enum { NMM_PHASE_CONTACT, NMM_PHASE_ASSEMBLY, NMM_PHASE_SOLVER, NMM_PHASE_REST, NMM_PHASES };

/// What a run took.
typedef struct nmm_bench_timing {
    double seconds, phase[NMM_PHASES]; // of all steps
    long steps, cuts;
    double time; // [s] reached in the scene
} nmm_bench_timing;
nmm_status nmm_bench_steps(nmm_bench *bench, nmm_sim *sim, nmm_bench_limit limit,
                           nmm_bench_timing *run);

// --- Linear systems

/// The system of a run's step, as its solver got it.
typedef struct nmm_bench_system {
    nmm_linear system;
    nmm_solve_options options;
    int unknowns;
} nmm_bench_system;
/// First open-close pass of that step (from 1).
nmm_status nmm_bench_capture(nmm_bench *bench, const nmm_bench_source *source, long step,
                             nmm_bench_system *captured);
void nmm_bench_system_destroy(nmm_bench *bench, nmm_bench_system *captured);

/// A solver that is kept over several solves of one system.
typedef struct nmm_bench_solver {
    const nmm_solve_backend *backend;
    nmm_solver *solver;
    nmm_solve_options options;
    nmm_solve_report report; // of the last solve
    double seconds;          // of the last solve, setup included
} nmm_bench_solver;
nmm_status nmm_bench_solver_open(nmm_bench *bench, nmm_bench_solver *solver,
                                 const nmm_bench_system *captured, bool on_target);
/// From the system's first guess; the result is in captured->system.u.
nmm_status nmm_bench_solve(nmm_bench *bench, nmm_bench_solver *solver, nmm_bench_system *captured);
void nmm_bench_solver_close(nmm_bench *bench, nmm_bench_solver *solver);

#endif
