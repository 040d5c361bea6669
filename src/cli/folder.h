// SPDX-License-Identifier: MIT
//
// Folders that results go to.

#ifndef NMM_CLI_FOLDER_H
#define NMM_CLI_FOLDER_H

#include <stdbool.h>

bool is_folder(const char *path);

/// Make the folder and those above it, where they are not there yet. Returns the exit status.
int folder_make(const char *path);

/// Remove it, if nothing is inside.
void folder_remove_empty(const char *path);

#endif
