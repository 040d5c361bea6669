// SPDX-License-Identifier: MIT
//
// Run files from the inside: what the pictures, the exporter and other floors read from them, and
// files written as temporary + rename. Nothing here needs HDF5's header.
//
// A run file is opened for each reading and closed at once, so that a run that still writes it is
// never kept waiting. What is read is checked: every index lies in its range, every number that
// counts something is sane; damage is NMM_ERROR_INPUT.

#ifndef NMM_IO_H
#define NMM_IO_H

#include "geometry.h"

#include <stdio.h>

// --- Files written whole or not at all

/// A file that takes its name only when it is complete.
typedef struct nmm_replacement {
    nmm_context *context;
    char *path, *temporary; // owned
    FILE *stream;
    int error; // errno of the first failed write, 0: none
} nmm_replacement;

/// Start the file `path`. NMM_ERROR_FILE: cannot be made.
nmm_status nmm_replacement_open(nmm_context *context, nmm_replacement *file, const char *path);
/// Append bytes; a failure is told by the commit.
void nmm_replacement_write(nmm_replacement *file, const void *bytes, size_t size);
void nmm_replacement_print(nmm_replacement *file, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/// Give the file its name. NMM_ERROR_FILE: disk full and the like; nothing is left behind then.
nmm_status nmm_replacement_commit(nmm_replacement *file);
/// Give up; harmless after a commit and on a zeroed struct.
void nmm_replacement_drop(nmm_replacement *file);

/// Most memory that a writer of run files had at once, without what HDF5 takes by itself.
size_t nmm_output_peak_bytes(const nmm_output *output);

/// `x` as the shortest text that reads back as the same number, with a point in any locale.
const char *nmm_number_text(char text[32], double x);

// --- What a run file holds

/// A support point, or (`held`) a block held as a whole, at its centroid.
typedef struct nmm_support_row {
    double x, y; // [m] reference place
    int fix_x, fix_y;
    int block, element;
    int held;
} nmm_support_row;

/// A force on a point, before its history.
typedef struct nmm_load_row {
    double x, y;   // [m] reference place
    double fx, fy; // [N]
    int element;
    double length; // [m] boundary whose traction it stands for, 0: a force at a point
    int history;   // number of its history, -1: constant
} nmm_load_row;

/// What does not change over the frames. Scene coordinates (the origin is added).
typedef struct nmm_file_geometry {
    int n_point, n_element, n_corner, n_edge, n_block, n_support, n_load, n_monitor;
    double *point;         // [n_point][2]  m, reference
    int *element_start;    // [n_element + 1]
    int *corner_point;     // [n_corner]
    int *element_block;    // [n_element]
    int *element_material; // [n_element]
    int *edge_point;       // [n_edge][2] loop edges, the block to the left
    int *edge_block;       // [n_edge]
    int *edge_interface;   // [n_edge] -1: no joint made it
    int *edge_mate;        // [n_edge] edge on the other side of its joint at the start, -1: none
    nmm_support_row *support;
    nmm_load_row *load;
    double *monitor_place; // [n_monitor][2]  m, reference
} nmm_file_geometry;

/// Modes as in nmm_contact_mode.
typedef struct nmm_file_contact {
    double place[2];                  // [m] current place of the vertex
    double force[2];                  // [N] on the vertex
    double normal[2];                 // outward normal of the edge
    double normal_force, shear_force; // [N]
    double gap, slid;                 // [m]
    int vertex, edge;                 // loop vertex, loop edge
    int vertex_block, edge_block;
    int mode;  // 0 open, 1 slide, 2 stick
    int joint; // 1: a joint of the scene made the edge
} nmm_file_contact;

/// One frame. Arrays of fields that the file lacks are NULL.
typedef struct nmm_file_frame {
    int index;
    double time;
    double *displacement; // [n_point][2]  m
    double *velocity;     // [n_point][2]  m/s
    double *stress;       // [n_element][6]  Pa  xx yy zz xy yz xz
    double *load_factor;  // [n_load] of the loads' histories at its time
    double *load_most;    // [n_load] largest size of the factor in any frame
    bool has_contact;     // contacts were asked for
    int n_contact;
    nmm_file_contact *contact; // sorted by vertex, then edge
} nmm_file_frame;

/// The context of a file, for the errors of whoever works on it.
nmm_context *nmm_file_context(nmm_file *file);
const char *nmm_file_path(const nmm_file *file);
const char *nmm_file_title(const nmm_file *file);
/// `analysis.kind: static`: times of frames say nothing.
bool nmm_file_is_static(const nmm_file *file);
/// "running", "completed", ... as stored.
const char *nmm_file_state(const nmm_file *file);
bool nmm_file_has(const nmm_file *file, const char *field);

/// The geometry, read at the first call and owned by the file.
nmm_status nmm_file_geometry_read(nmm_file *file, const nmm_file_geometry **geometry);
/// Frame k, 0 <= k < nmm_file_frames. `frame` starts zeroed and is destroyed by its owner.
nmm_status nmm_file_frame_read(nmm_file *file, int k, nmm_file_frame *frame);
void nmm_file_frame_destroy(nmm_file *file, nmm_file_frame *frame);
/// Time of frame k [s].
double nmm_file_time(const nmm_file *file, int k);

/// nmm_file_open with an allocation hook (NULL: the C library); for tests.
nmm_status nmm_file_open_with(nmm_file **file, const char *path, nmm_allocate_hook allocate,
                              void *user);

#endif
