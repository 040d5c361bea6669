// SPDX-License-Identifier: MIT
//
// Writes the fixture's run file and its export, for the layout tests in Python:
// write_fixture FOLDER.

#include "fixture.h"

#include <stdio.h>

int main(int n_argument, char **argument) {
    char path[512];
    fixture f;
    nmm_output *output = NULL;
    nmm_file *file = NULL;
    nmm_step_report report;
    if (n_argument != 2) return 2;
    snprintf(path, sizeof path, "%s/run.vtkhdf", argument[1]);
    fixture_create(&f, 4, 2);
    nmm_status status = nmm_output_create(&output, f.sim, path);
    for (int i = 0; i < 10 && status == NMM_OK; i++) {
        fixture_step(&f, 0.01, &report);
        status = nmm_output_step(output, f.sim, &report);
    }
    f.sim->summary.end = NMM_END_COMPLETED;
    if (status == NMM_OK) status = nmm_output_finish(output, f.sim);
    if (status != NMM_OK) fprintf(stderr, "%s\n", nmm_output_error(output)->message);
    nmm_output_destroy(output);
    fixture_destroy(&f);
    if (status == NMM_OK) status = nmm_file_open(&file, path);
    snprintf(path, sizeof path, "%s/vtu", argument[1]);
    if (status == NMM_OK) status = nmm_file_export_vtu(file, path);
    if (status != NMM_OK) fprintf(stderr, "%s\n", nmm_file_error(file)->message);
    nmm_file_close(file);
    return status == NMM_OK ? 0 : 1;
}
