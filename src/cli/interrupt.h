// SPDX-License-Identifier: MIT
//
// Ctrl-C and a polite kill: the first asks the run to end after the current step, the second ends
// the program at once. Never in the middle of writing the run file.

#ifndef NMM_CLI_INTERRUPT_H
#define NMM_CLI_INTERRUPT_H

#include <stdbool.h>

/// Start to listen. `path`: the run file, named in the last words; must stay valid.
void interrupt_listen(const char *path);
/// True once the user asked to stop.
bool interrupt_asked(void);
/// Between true and false a second Ctrl-C waits: the run file is being written.
void interrupt_hold(bool writing);

#endif
