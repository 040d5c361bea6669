// SPDX-License-Identifier: MIT
//
// Parts of the writer of run files, shared by its source files only: output.c (life of the file),
// manifest.c (what is written once), grid.c and contacts.c (what grows with the frames).

#ifndef NMM_IO_OUTPUT_H
#define NMM_IO_OUTPUT_H

#include "io.h"
#include "records.h"
#include "step.h"

/// Where the parts of a run file lie; docs/output.md describes them.
#define NMM_GRID "VTKHDF"
#define NMM_CONTACTS "contacts"
#define NMM_META "nmm"

/// Cell types and modes as stored.
enum { NMM_VTK_POLYGON = 7, NMM_MODE_NONE = -1 };

/// Contacts of a frame, one array for each dataset, at least one row (see contacts.c).
typedef struct nmm_contact_rows {
    int capacity;
    double *place;       // [n][3]  m
    float *force;        // [n][3]  N
    float *normal;       // [n][3]
    float *normal_force; // [n]  N
    float *shear_force;  // [n]  N
    float *gap;          // [n]  m
    float *slid;         // [n]  m
    int *vertex, *edge;  // [n]
    int *vertex_block;   // [n]
    int *edge_block;     // [n]
    int *mode, *joint;   // [n]
    int64_t *sequence;   // [n + 1]  0, 1, 2, ...
} nmm_contact_rows;

struct nmm_output {
    nmm_context context;
    nmm_arena arena; // paths, names
    nmm_h5 h5;
    const char *path;      // of the run file
    const char *temporary; // its name until the first frame is whole
    const char *lock_path;
    int lock; // descriptor of the run's lock, -1: none
    bool displacement, velocity, stress, contact;
    bool renamed;
    double every;       // [s] between frames; 0: each step
    double due;         // multiples of `every` passed so far
    int n_frame;        // whole frames in the file
    long ledger_step;   // step of the newest row of ledger and monitors
    long frame_step;    // step of the newest frame
    long contact_row;   // where the contacts of the next frame start
    long contact_cell;  // contacts written so far
    long contact_chunk; // rows of a chunk of contacts
    long contact_most;  // most contacts of a frame so far
    long table_row;     // rows of ledger and monitors written so far
    int n_ledger, ledger_capacity;
    nmm_step_report *ledger; // [n_ledger] not yet written
    int n_monitor, monitor_capacity;
    nmm_monitor_row *monitor; // [n_ledger][n_monitor] not yet written
    nmm_monitor_row *column;  // scratch of one monitor
    int column_capacity;
    const char **monitor_table; // [n_monitor] dataset of a monitor
    double written;             // clock of the last writing
    float *row;                 // scratch of one field of one frame
    nmm_contact_rows rows;
};

/// Scene, settings, machine, supports, loads; the empty ledger and monitors.
nmm_status nmm_manifest_write(nmm_output *output, nmm_sim *sim);

/// Columns of a monitor's table that are stored.
void nmm_monitor_keep(const nmm_monitor *monitor, bool keep[NMM_MONITOR_COLUMNS]);

/// Points and elements, and the empty tables of the fields.
nmm_status nmm_grid_create(nmm_output *output, const nmm_sim *sim);
/// Fields and offsets of the next frame; it does not count before nmm_frame_count.
nmm_status nmm_grid_append(nmm_output *output, const nmm_sim *sim);

nmm_status nmm_contacts_create(nmm_output *output, const nmm_sim *sim);
nmm_status nmm_contacts_append(nmm_output *output, const nmm_sim *sim);
/// The appended frame counts: move on to the place of the next one.
void nmm_contacts_advance(nmm_output *output, const nmm_sim *sim);

/// Bytes that the next frame needs at most.
size_t nmm_grid_bytes(const nmm_output *output, const nmm_model *model);
size_t nmm_contacts_bytes(const nmm_output *output, const nmm_sim *sim);

/// Names of the datasets of VTKHDF's time steps under `group`, for `n_field` fields.
typedef struct nmm_steps {
    const char *group;
    int n_kind; // 1 for a grid, 4 for PolyData: numbers in a row of CellOffsets
    int n_point_field, n_cell_field;
    const char *const *point_field, *const *cell_field;
} nmm_steps;
nmm_status nmm_steps_create(nmm_h5 *h5, const nmm_steps *steps);

/// One row for step k of the time steps: offsets of parts, points, and of each field.
typedef struct nmm_step_row {
    double time;
    int64_t part, point;
    const int64_t *point_field, *cell_field; // [n_..._field] first row of each field
    int64_t cell[4], connectivity[4];
} nmm_step_row;
nmm_status nmm_steps_append(nmm_h5 *h5, const nmm_steps *steps, int k, const nmm_step_row *row);

/// `group/name` in a buffer of the caller.
const char *nmm_join(char path[256], const char *group, const char *name);

#endif
