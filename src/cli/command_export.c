// SPDX-License-Identifier: MIT
//
// nmm export: a run in the files of other programs.

#include "message.h"
#include "options.h"

#include <stdio.h>

int command_export(const arguments *given) {
    if (!given->vtu) {
        message_error("nmm export: to what? For example --vtu FOLDER; see nmm export --help");
        return EXIT_USAGE;
    }
    nmm_file *file = NULL;
    int status = EXIT_DONE;
    if (nmm_file_open(&file, given->path) != NMM_OK)
        status = message_failure(nmm_file_error(file), given->path);
    else if (nmm_file_export_vtu(file, given->vtu) != NMM_OK)
        status = message_failure(nmm_file_error(file), given->vtu);
    else if (!given->quiet)
        printf("%s: %d frames\n", given->vtu, nmm_file_frames(file));
    nmm_file_close(file);
    return status;
}
