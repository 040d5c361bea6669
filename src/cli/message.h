// SPDX-License-Identifier: MIT
//
// Messages on standard error, in colour where a terminal is and NO_COLOR is not set.

#ifndef NMM_CLI_MESSAGE_H
#define NMM_CLI_MESSAGE_H

#include "nmm/nmm.h"

#include <stdbool.h>
#include <stdio.h>

/// A line "error: ...".
void message_error(const char *format, ...) __attribute__((format(printf, 1, 2)));
/// A line "warning: ...".
void message_warning(const char *format, ...) __attribute__((format(printf, 1, 2)));
/// A plain line.
void message_note(const char *format, ...) __attribute__((format(printf, 1, 2)));

/// An error of the library, with file, line and column where it has them. Returns the exit status.
int message_failure(const nmm_error *error, const char *path);

/// Exit status of a status of the library.
int exit_status_of(nmm_status status);

/// True where cursor movements make sense on `file`.
bool is_terminal(FILE *file);

#endif
