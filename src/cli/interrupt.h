// SPDX-License-Identifier: MIT
//
// Ctrl-C and a polite kill: the first asks the run to end after the current step, the second ends
// the program at once. Never in the middle of writing the run file. Signals within a fifth of a
// second count as one: wrappers such as timeout and make pass on what the terminal sends anyway.

#ifndef NMM_CLI_INTERRUPT_H
#define NMM_CLI_INTERRUPT_H

#include <stdbool.h>

/// Start to listen.
void interrupt_listen(void);
/// There is a run file now, to be named in the last words; `path` must stay valid.
void interrupt_names(const char *path);
/// True once the user asked to stop.
bool interrupt_asked(void);
/// Between true and false a second Ctrl-C waits: the run file is being written.
void interrupt_hold(bool writing);

#endif
