// SPDX-License-Identifier: MIT
//
// The rows of a run file's tables as C structs, and the descriptions that both the writer and the
// reader use: one line a column, with name, place, unit and meaning.

#ifndef NMM_IO_RECORDS_H
#define NMM_IO_RECORDS_H

#include "h5.h"
#include "io.h"

typedef struct nmm_monitor_row {
    long step;
    double time;
    double displacement[2], velocity[2], stress[3];
} nmm_monitor_row;

/// An entry of the history of a load: linear between entries, constant before and after them.
typedef struct nmm_history_row {
    int history;
    double time, factor;
} nmm_history_row;

extern const nmm_h5_record nmm_record_step;    // nmm_step_report: the ledger
extern const nmm_h5_record nmm_record_summary; // nmm_summary
extern const nmm_h5_record nmm_record_monitor;
extern const nmm_h5_record nmm_record_support;
extern const nmm_h5_record nmm_record_load;
extern const nmm_h5_record nmm_record_history;

/// Columns of nmm_record_monitor from `..._DISPLACEMENT` on: two, two and three.
enum {
    NMM_MONITOR_DISPLACEMENT = 2,
    NMM_MONITOR_VELOCITY = 4,
    NMM_MONITOR_STRESS = 6,
    NMM_MONITOR_COLUMNS = 9
};

#endif
