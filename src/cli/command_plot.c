// SPDX-License-Identifier: MIT
//
// nmm plot: one frame of a run as a picture.

#include "message.h"
#include "options.h"
#include "scene_open.h"

#include <stdio.h>
#include <string.h>

static int draw(nmm_file *file, const arguments *given, const char *path) {
    nmm_plot_def def = nmm_default_plot_def();
    def.frame = given->frame;
    if (given->field) def.field = given->field;
    if (given->scale > 0) def.scale = given->scale;
    if (given->width > 0) def.width = given->width;
    if (nmm_file_plot(file, path, &def) != NMM_OK) {
        const nmm_error *error = nmm_file_error(file);
        // A frame or field that is not there is the run's matter, not the picture's.
        const bool asked = error->status == NMM_ERROR_ARGUMENT || error->status == NMM_ERROR_INPUT;
        const bool of_run = asked && !strstr(error->message, path);
        return message_failure(error, of_run ? given->path : path);
    }
    if (!given->quiet) printf("%s\n", path);
    return EXIT_DONE;
}

int command_plot(const arguments *given) {
    char chosen[4096];
    result_name(chosen, sizeof chosen, given->path, ".png");
    const char *path = given->output ? given->output : chosen;
    if (same_file(path, given->path)) {
        message_error("nmm plot: --output names the run itself, %s", path);
        return EXIT_USAGE;
    }
    nmm_file *file = NULL;
    const int status = nmm_file_open(&file, given->path) == NMM_OK
                           ? draw(file, given, path)
                           : message_failure(nmm_file_error(file), given->path);
    nmm_file_close(file);
    return status;
}
