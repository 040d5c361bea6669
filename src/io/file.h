// SPDX-License-Identifier: MIT
//
// Parts of the reader of run files, shared by its source files only: file.c (what the file is),
// geometry.c and frame.c (what it holds), vtu.c (the export).

#ifndef NMM_IO_FILE_H
#define NMM_IO_FILE_H

#include "output.h"

#include <sys/types.h>

/// What is known of a monitor without reading its rows.
typedef struct nmm_file_monitor_head {
    const char *table, *name;
    bool displacement, velocity, stress;
} nmm_file_monitor_head;

struct nmm_file {
    nmm_context context;
    nmm_arena arena; // paths, texts, names, geometry
    const char *path;
    dev_t device; // which file it was when it was opened
    ino_t inode;
    char title[1024], scene_path[1024];
    char state[32];
    char *scene;
    int n_frame;
    double *time; // [n_frame]
    int n_point, n_element, n_corner;
    bool is_static;
    bool displacement, velocity, stress, contact;
    int n_monitor;
    nmm_file_monitor_head *monitor; // [n_monitor]
    bool has_geometry;
    int n_history;
    nmm_history *history; // [n_history] factors of loads, by their numbers; n = 0: none
    nmm_file_geometry geometry;
};

/// Open for a reading; NMM_ERROR_FILE when the file is another one by now.
nmm_status nmm_file_begin(nmm_file *file, nmm_h5 *h5);
/// Close, and hand the reading's status on.
nmm_status nmm_file_end(nmm_h5 *h5, nmm_status status);

#endif
