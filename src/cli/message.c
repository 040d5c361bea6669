// SPDX-License-Identifier: MIT
//
// Messages on standard error. Colour only on a terminal, never with NO_COLOR (no-color.org) or
// TERM=dumb.

#include "message.h"

#include "options.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool is_terminal(FILE *file) {
    const char *term = getenv("TERM");
    return isatty(fileno(file)) && term && strcmp(term, "dumb");
}

static bool in_colour(void) {
    const char *off = getenv("NO_COLOR");
    return is_terminal(stderr) && !(off && *off);
}

static void put_word(const char *word, const char *colour) {
    if (in_colour())
        fprintf(stderr, "\033[1;%sm%s:\033[0m ", colour, word);
    else
        fprintf(stderr, "%s: ", word);
}

static void put_line(const char *format, va_list list) {
    vfprintf(stderr, format, list);
    fputc('\n', stderr);
}

void message_error(const char *format, ...) {
    va_list list;
    va_start(list, format);
    put_word("error", "31");
    put_line(format, list);
    va_end(list);
}

void message_warning(const char *format, ...) {
    va_list list;
    va_start(list, format);
    put_word("warning", "33");
    put_line(format, list);
    va_end(list);
}

void message_note(const char *format, ...) {
    va_list list;
    va_start(list, format);
    put_line(format, list);
    va_end(list);
}

int exit_status_of(nmm_status status) {
    switch (status) {
    case NMM_OK:
        return EXIT_DONE;
    case NMM_ERROR_INPUT:
        return EXIT_SCENE;
    case NMM_ERROR_DEVICE:
        return EXIT_DEVICE;
    case NMM_ERROR_NUMERIC:
        return EXIT_EARLY;
    case NMM_ERROR_ARGUMENT:
        return EXIT_USAGE;
    default:
        return EXIT_SYSTEM;
    }
}

int message_failure(const nmm_error *error, const char *path) {
    if (!error || error->status == NMM_OK) {
        message_error("%s: failed without a reason; please report this", path);
        return EXIT_SYSTEM;
    }
    if (error->line > 0)
        fprintf(stderr, "%s:%d:%d: ", error->file[0] ? error->file : path, error->line,
                error->column);
    // The file's name is part of most messages already.
    if (error->line > 0 || strstr(error->message, path))
        message_error("%s", error->message);
    else
        message_error("%s: %s", path, error->message);
    return exit_status_of(error->status);
}
