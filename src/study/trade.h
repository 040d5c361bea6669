// SPDX-License-Identifier: MIT
//
// Inside of a trade (nmm_trade_run): settings of a scene, a run for each, the reference that their
// errors are measured against. The table is that of an nmm_bench; its row k is run k.

#ifndef NMM_TRADE_H
#define NMM_TRADE_H

#include "bench.h"

/// Settings of a trade, overrides of a setting: at most.
enum { NMM_TRADE_SETTINGS = 48, NMM_TRADE_OVERRIDES = 3 };

/// Orders of cover functions that are tried: 0, 1, 2.
enum { NMM_TRADE_ORDERS = 3 };

typedef enum nmm_trade_knob {
    NMM_TRADE_SCENE, // the scene as it stands
    NMM_TRADE_SIZE,
    NMM_TRADE_DT,
    NMM_TRADE_BOTH, // size and dt by the same factor
    NMM_TRADE_ORDER,
    NMM_TRADE_MESH,
    NMM_TRADE_SCHEME,
    NMM_TRADE_TOLERANCE,
    NMM_TRADE_SOLVER,
    NMM_TRADE_PRECISION,
    NMM_TRADE_PENALTY,
    NMM_TRADE_KNOBS
} nmm_trade_knob;
/// "size with dt"
const char *nmm_trade_knob_name(int knob);

typedef struct nmm_trade_setting {
    nmm_trade_knob knob;
    double factor; // on what makes the error; the finest has the smallest
    int n_override;
    const char *override[NMM_TRADE_OVERRIDES]; // in the arena
} nmm_trade_setting;

enum {
    NMM_TRADE_COLUMN_KNOB,
    NMM_TRADE_COLUMN_SETTING,
    NMM_TRADE_COLUMN_UNKNOWNS,
    NMM_TRADE_COLUMN_STEPS,
    NMM_TRADE_COLUMN_SECONDS,
    NMM_TRADE_COLUMN_VALUE,
    NMM_TRADE_COLUMN_ERROR,
    NMM_TRADE_COLUMN_PARETO,
    NMM_TRADE_COLUMN_END,
    NMM_TRADE_N_COLUMN
};

typedef struct nmm_trade_row {
    const nmm_trade_setting *setting;
    bool completed, pareto;
    double value[3], seconds;
    double error; // a part of 1; NaN: not known
} nmm_trade_row;

/// Numbers at the end of a run.
typedef struct nmm_trade_quantity {
    const char *words, *monitor; // in the arena
    int field;                   // 0 displacement, 1 velocity, 2 stress
    int first, width;            // components
} nmm_trade_quantity;

struct nmm_trade {
    nmm_trade_def def;
    double longest;
    nmm_trade_quantity quantity;
    bool has_expectation;
    double expectation[3];
    nmm_scene_settings scene; // of the scene as it stands, completed
    int unknowns;             // of the scene as it stands
    bool has_contact, keeps_dt_max;
    bool allows_order[NMM_TRADE_ORDERS];      // other orders than the scene's own
    bool mesh_resets_size, mesh_resets_order; // the other mesh needs these on auto
    int n_setting;
    nmm_trade_setting setting[NMM_TRADE_SETTINGS];
    nmm_trade_row row[NMM_TRADE_SETTINGS]; // [bench->n_row]
    nmm_trade_knob ladder;                 // that the reference comes from; NMM_TRADE_SCENE: none
    double order_off;                      // of the sizes of order 2, where they are the reference
    bool too_long;                         // some run was
    int reference_row;                     // a run that is the reference itself; -1: none
    const char *unseen;                    // what the reference knows nothing of: "dt, scheme"
    nmm_trade_result result;
};

extern const nmm_bench_kind nmm_bench_trade;

/// Open the scene with the overrides of all runs and those of a setting (NULL: none). *sim is to be
/// closed in any case; errors stay there.
nmm_status nmm_trade_open(nmm_bench *bench, nmm_sim **sim, const nmm_trade_setting *setting);

/// Read quantity and expectation; the first monitor where nothing is said. NMM_ERROR_ARGUMENT.
nmm_status nmm_trade_find_quantity(nmm_bench *bench, const nmm_sim *sim);
/// Its numbers now.
void nmm_trade_read(const nmm_trade *trade, const nmm_sim *sim, double value[3]);

/// All settings, the scene's own first, each ladder from coarse to fine. NMM_ERROR_ARGUMENT.
nmm_status nmm_trade_find_settings(nmm_bench *bench);

/// Length of a quantity, and of what two of them differ by.
double nmm_trade_size(const nmm_trade *trade, const double *a);
double nmm_trade_distance(const nmm_trade *trade, const double *a, const double *b);

/// Completed runs of a knob and the scene's own, from coarse to fine.
typedef struct nmm_trade_ladder {
    int n, row[NMM_TRADE_SETTINGS];
} nmm_trade_ladder;
nmm_trade_ladder nmm_trade_find_ladder(const nmm_bench *bench, nmm_trade_knob knob);

/// The reference, how well it is known, what nobody asked; notes on them.
nmm_status nmm_trade_find_reference(nmm_bench *bench);

/// Reference, errors, Pareto set, the cheapest with the error wanted, and notes on them.
nmm_status nmm_trade_conclude(nmm_bench *bench);

/// Error against time.
nmm_status nmm_trade_draw(nmm_bench *bench, const char *path);

#endif
