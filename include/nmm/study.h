// SPDX-License-Identifier: MIT
//
// Studies on top of nmm.h: the experiments of docs/experiments.md, and speed against accuracy of a
// scene (docs/trade.md), each a table of what was measured and a picture drawn from it.
//
// As in nmm.h: no globals, nothing is printed; one handle on one thread at a time. Times are those
// of the wall clock, so they are worth what the machine was doing meanwhile.

#ifndef NMM_STUDY_H
#define NMM_STUDY_H

#include "nmm/nmm.h"

#ifdef __cplusplus
extern "C" {
#endif

/// One experiment, done or under way.
typedef struct nmm_bench nmm_bench;

/// Name and meaning of an experiment.
typedef struct nmm_bench_name {
    const char *name;    ///< "table1", "fig6", "fig7", "contact", "wall", "growth", "only"
    const char *purpose; ///< one line
    int needs_scenes;    ///< 1: computes scenes out of nmm_bench_def.scenes
} nmm_bench_name;
/// Entry k of the list; name NULL behind its end.
NMM_API nmm_bench_name nmm_bench_list(int k);

/// Settings of an experiment.
typedef struct nmm_bench_def {
    const char *name;
    const char *scenes; ///< folder with one folder for each scene, in it scene.yaml
    int n_thread;       ///< entries of `thread`; 0: one thread, and all
    const int *thread;  ///< numbers of host threads to measure with, each at least 1
    /// CHOOSE: the target as well where there is one; TARGET: NMM_ERROR_DEVICE where there is none.
    nmm_device_choice device;
    int quick; ///< 1: a short form, of seconds; its numbers are good for a look only
    /// Called before each measurement with words on it (`row` -1), and after each new row of the
    /// table (`what` NULL). Not 0: end here; what is there is kept. NULL: not called.
    int (*report)(void *user, const nmm_bench *bench, const char *what, int row);
    void *user;
    void *(*allocate)(void *user, void *old, size_t size); ///< as in nmm_sim_def
    void *allocate_user;                                   ///< given to the hook
} nmm_bench_def;
/// NAME to be set; device CHOOSE.
NMM_API nmm_bench_def nmm_default_bench_def(void);

/// Measure. *bench is given even on failure, to ask for its error and for the rows before it;
/// destroy it in any case. NMM_ERROR_ARGUMENT: an unknown name; NMM_ERROR_FILE: no folder of scenes
/// there, or none with a scene; errors of the scenes themselves.
NMM_API nmm_status nmm_bench_run(nmm_bench **bench, const nmm_bench_def *def);
NMM_API void nmm_bench_destroy(nmm_bench *bench);
/// The first error; status NMM_OK when there is none.
NMM_API const nmm_error *nmm_bench_error(const nmm_bench *bench);
/// All mistakes of the scene that ended it, as text to print, or NULL.
NMM_API const char *nmm_bench_mistakes(const nmm_bench *bench);
/// 1: `report` asked for an early end.
NMM_API int nmm_bench_stopped(const nmm_bench *bench);

/// A column of the table.
typedef struct nmm_bench_column {
    const char *name;  ///< in the CSV file: "solver_share"
    const char *title; ///< for people: "solver"
    const char *unit;  ///< "ms", "%"; "" where there is none
    int is_text;       ///< words instead of numbers
    int digits;        ///< significant digits worth printing; 0: a whole number
} nmm_bench_column;
/// Column k; name NULL behind the last.
NMM_API nmm_bench_column nmm_bench_column_of(const nmm_bench *bench, int k);
NMM_API int nmm_bench_rows(const nmm_bench *bench);
/// Number in the table; NaN where nothing was measured, or the column holds words.
NMM_API double nmm_bench_number(const nmm_bench *bench, int row, int column);
/// Words in the table; "" where there are none.
NMM_API const char *nmm_bench_text(const nmm_bench *bench, int row, int column);
/// Title of the table.
NMM_API const char *nmm_bench_title(const nmm_bench *bench);
/// What follows from the table, a sentence each: medians, fitted exponents; NULL behind the last.
NMM_API const char *nmm_bench_note(const nmm_bench *bench, int k);

/// The table as a CSV file: names of the columns, then the rows; empty where nothing was measured.
NMM_API nmm_status nmm_bench_write_csv(nmm_bench *bench, const char *path);
/// The picture; the ending of `path` says which kind: png, svg or pdf.
NMM_API nmm_status nmm_bench_plot(nmm_bench *bench, const char *path);

// --- Speed against accuracy

/// Settings of a trade: one scene, run with one knob turned at a time.
typedef struct nmm_trade_def {
    const char *path; ///< scene file
    int n_override;
    const char *const *override; ///< "key.path=value", for all runs
    /// Knobs with commas between, out of size, dt, order, mesh, scheme, tolerance, solver,
    /// precision, penalty; NULL: all that mean something in the scene. With size and dt also both
    /// at once.
    const char *knobs;
    /// What is compared at the end: "monitors.NAME.displacement", one component "...[1]", or
    /// velocity or stress; NULL: displacement of the first monitor.
    const char *quantity;
    /// Its closed form, "QUANTITY=NUMBER" or "QUANTITY=[NUMBER,NUMBER]"; NULL: the finest runs.
    const char *expect;
    double want;    ///< error wanted, as a part of 1; 0: none
    double longest; ///< [s] a run that takes longer is left out; 0: 600, quick 20
    int quick;      ///< 1: fewer values of each knob
    int n_thread;   ///< host threads; 0: all
    nmm_device_choice device;
    int (*report)(void *user, const nmm_bench *bench, const char *what, int row); ///< as above
    void *user;
    void *(*allocate)(void *user, void *old, size_t size); ///< as in nmm_sim_def
    void *allocate_user;
} nmm_trade_def;
/// PATH to be set; the scene's device.
NMM_API nmm_trade_def nmm_default_trade_def(void);

/// Run the scene. The table, its notes, files and picture are asked for as those of an experiment.
/// A run that ends early, or a setting that the scene does not allow, is a row that says so.
/// NMM_ERROR_ARGUMENT: wrong knobs, quantity or expectation; errors of the scene as it stands.
NMM_API nmm_status nmm_trade_run(nmm_bench **bench, const nmm_trade_def *def);

/// What came out.
typedef struct nmm_trade_result {
    const char *quantity; ///< "monitors.slider.displacement[0]"
    const char *unit;     ///< of the quantity
    int width;            ///< its numbers
    double reference[3];
    const char *source;  ///< "closed form", "extrapolated", "finest run"; "" where there is none
    double unsure;       ///< part of 1 by which the reference itself may be wrong; 0: closed form
    int cheapest;        ///< row of the fastest run with the error wanted; -1: none
    const char *options; ///< of nmm run, for that row: "--set time.dt=0.01"; "": scene as it is
    const char *lines;   ///< the same as keys of the scene: "time: {dt: 0.01}"
    const char *why;     ///< why there is none; "" where there is one, or none was wanted
} nmm_trade_result;
/// Texts live as long as the bench.
NMM_API nmm_trade_result nmm_trade_result_of(const nmm_bench *bench);

#ifdef __cplusplus
}
#endif
#endif
