// SPDX-License-Identifier: MIT
//
// Ctrl-C and a polite kill: the first asks to end after the current step or measurement, the second
// ends the program at once. Never in the middle of writing a file. Signals within a fifth of a
// second count as one: wrappers such as timeout and make pass on what the terminal sends anyway.

#ifndef NMM_CLI_INTERRUPT_H
#define NMM_CLI_INTERRUPT_H

#include <stdbool.h>

/// What a command is asked to end after, and what is lost where it ends at once. A folder that was
/// made for results goes then, if nothing is in it; NULL: there is none.
typedef struct interrupt_words {
    const char *part, *lost, *folder;
} interrupt_words;

/// Start to listen; texts must stay valid.
void interrupt_listen(interrupt_words words);
/// There is a run file now, to be named in the last words; `path` must stay valid.
void interrupt_names(const char *path);
/// True once the user asked to stop.
bool interrupt_asked(void);
/// Between true and false a second Ctrl-C waits: a file is being written.
void interrupt_hold(bool writing);

#endif
