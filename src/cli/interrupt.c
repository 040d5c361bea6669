// SPDX-License-Identifier: MIT
//
// Ctrl-C (SIGINT) and a polite kill (SIGTERM), counted in the handler.
//
// The run file is whole between two writes, because each frame is flushed; so ending at once is
// safe as soon as no write is under way. A handler can reach nothing but file-level variables: the
// only ones of the program.

#include "interrupt.h"

#include "options.h"

#include <signal.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static volatile sig_atomic_t asked;   // times the user asked
static volatile sig_atomic_t writing; // the run file is being written
static const char *volatile run_path; // NULL: there is no run file yet
static interrupt_words said;          // how the command names what it does
static struct timespec first;         // when the user asked first

static void put(const char *text) {
    // Nothing can be done where even this fails.
    if (write(STDERR_FILENO, text, strlen(text)) < 0) return;
}

static void leave(void) {
    if (said.folder) (void)rmdir(said.folder);
    put("\nended at once; ");
    put(run_path ? run_path : said.lost);
    put(run_path ? " holds the run up to its last frame\n" : "\n");
    _exit(EXIT_EARLY);
}

static double seconds_since_first(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)(now.tv_sec - first.tv_sec) + 1e-9 * (double)(now.tv_nsec - first.tv_nsec);
}

static void on_signal(int signal_number) {
    (void)signal_number;
    if (asked == 0) {
        clock_gettime(CLOCK_MONOTONIC, &first);
        asked = 1;
        put("\nending after this ");
        put(said.part);
        put("; once more ends at once\n");
    } else if (seconds_since_first() > 0.2) {
        asked = 2;
        if (!writing) leave();
    }
}

/// Listen to one signal, unless whoever started the program had it ignored (nohup, a job in the
/// background).
static void listen_to(int signal_number) {
    struct sigaction action, before;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaddset(&action.sa_mask, SIGINT);
    sigaddset(&action.sa_mask, SIGTERM);
    if (sigaction(signal_number, NULL, &before) == 0 && before.sa_handler != SIG_IGN)
        sigaction(signal_number, &action, NULL);
}

void interrupt_listen(interrupt_words words) {
    said = words;
    listen_to(SIGINT);
    listen_to(SIGTERM);
}

void interrupt_names(const char *path) {
    run_path = path;
}

bool interrupt_asked(void) {
    return asked > 0;
}

void interrupt_hold(bool now_writing) {
    writing = now_writing;
    // What came in meanwhile is answered now.
    if (!now_writing && asked > 1) leave();
}
