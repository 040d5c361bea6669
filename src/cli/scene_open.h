// SPDX-License-Identifier: MIT
//
// What `run` and `check` share: from the command line to a simulation, its mistakes and warnings.

#ifndef NMM_CLI_SCENE_OPEN_H
#define NMM_CLI_SCENE_OPEN_H

#include "options.h"

/// Create the simulation of given->path, and print every mistake where it fails. *sim is to be
/// destroyed in any case. Returns the exit status.
int scene_open(nmm_sim **sim, const arguments *given);

/// "-" stands for standard input.
bool is_standard_input(const char *path);

/// Warnings about a scene, as lines; at most `room` of them. Returns their number.
enum { WARNING_LENGTH = 256, MOST_WARNINGS = 4 };
int scene_warnings(const nmm_check *check, char warning[][WARNING_LENGTH]);

/// Name of a file for the results of `path` in the current folder: its base with another ending.
/// `name` has room for `room` bytes; longer names are cut.
void result_name(char *name, size_t room, const char *path, const char *ending);

/// True where both names lead to one file.
bool same_file(const char *a, const char *b);

#endif
