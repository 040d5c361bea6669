// SPDX-License-Identifier: MIT
//
// From the command line to a simulation, its mistakes and warnings; names of result files.

#include "scene_open.h"

#include "message.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

bool is_standard_input(const char *path) {
    return !strcmp(path, "-");
}

/// All of standard input into *text, to be freed in any case. Returns the exit status.
static int read_standard_input(char **text, size_t *length) {
    enum { MOST = 64 << 20 };
    size_t room = 0;
    *length = 0;
    for (;;) {
        if (*length == room) {
            room = 2 * room + 65536;
            char *grown = realloc(*text, room);
            if (!grown) {
                message_error("no memory for the scene on standard input");
                return EXIT_SYSTEM;
            }
            *text = grown;
        }
        const size_t n = fread(*text + *length, 1, room - *length, stdin);
        *length += n;
        if (n == 0 || *length > MOST) break;
    }
    if (!ferror(stdin) && *length <= MOST) return EXIT_DONE;
    message_error("standard input: %s",
                  *length > MOST ? "the scene is larger than 64 MiB" : "cannot be read");
    return EXIT_SYSTEM;
}

static int open_def(nmm_sim **sim, const arguments *given, nmm_sim_def def) {
    def.path = def.text ? "<stdin>" : given->path;
    def.n_override = given->n_set;
    def.override = given->set;
    def.n_thread = given->n_thread;
    def.device = given->device;
    def.comparable = given->comparable;
    const nmm_status status = nmm_sim_create(sim, &def);
    if (status == NMM_OK) return EXIT_DONE;
    const char *mistakes = nmm_sim_mistakes(*sim);
    if (!mistakes || !*mistakes) return message_failure(nmm_sim_error(*sim), given->path);
    fputs(mistakes, stderr);
    if (mistakes[strlen(mistakes) - 1] != '\n') fputc('\n', stderr);
    return exit_status_of(status);
}

int scene_open(nmm_sim **sim, const arguments *given) {
    nmm_sim_def def = nmm_default_sim_def();
    if (!is_standard_input(given->path)) return open_def(sim, given, def);
    char *text = NULL;
    int status = read_standard_input(&text, &def.text_length);
    def.text = text;
    if (status == EXIT_DONE) status = open_def(sim, given, def);
    free(text);
    return status;
}

int scene_warnings(const nmm_check *check, char warning[][WARNING_LENGTH]) {
    int n = 0;
    if (check->trimmed > 0)
        snprintf(warning[n++], WARNING_LENGTH,
                 "%d joint end%s cut back to the edge of an element, %.3g m in all: a joint "
                 "ends where it leaves an element; smaller covers lose less",
                 check->trimmed, check->trimmed == 1 ? " was" : "s were", check->trimmed_length);
    // A sliver, as the step calls it. Solvers do not mind; large strains do.
    if (check->elements > 0 && check->smallest_area < 1e-6 * check->mean_area)
        snprintf(warning[n++], WARNING_LENGTH,
                 "smallest element %.3g m2 is a sliver (mean %.3g m2): large strains may turn it "
                 "inside out; another covers.size or joints that meet in a point help",
                 check->smallest_area, check->mean_area);
    return n;
}

void result_name(char *name, size_t room, const char *path, const char *ending) {
    const char *slash = strrchr(path, '/');
    const char *base = slash ? slash + 1 : path;
    const char *dot = strrchr(base, '.');
    const size_t length = dot && dot != base ? (size_t)(dot - base) : strlen(base);
    snprintf(name, room, "%.*s%s", (int)length, base, ending);
}

bool same_file(const char *a, const char *b) {
    struct stat first, second;
    if (stat(a, &first) != 0 || stat(b, &second) != 0) return false;
    return first.st_dev == second.st_dev && first.st_ino == second.st_ino;
}
