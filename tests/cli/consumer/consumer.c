// SPDX-License-Identifier: MIT
//
// A program of somebody else: runs a scene with the library alone and checks that a block falls as
// it should.

#include <nmm/nmm.h>

#include <math.h>
#include <stdio.h>

int main(int n_argument, char **argument) {
    nmm_sim_def def = nmm_default_sim_def();
    def.path = n_argument > 1 ? argument[1] : "fall.yaml";
    nmm_sim *sim = NULL;
    nmm_step_report report = {.end = NMM_END_RUNNING};
    nmm_status status = nmm_sim_create(&sim, &def);
    while (status == NMM_OK && report.end == NMM_END_RUNNING)
        status = nmm_sim_step(sim, &report);

    nmm_reading reading = {.name = NULL};
    if (status == NMM_OK) status = nmm_sim_monitor(sim, 0, &reading);
    if (status != NMM_OK) fprintf(stderr, "%s\n", nmm_sim_error(sim)->message);
    nmm_sim_destroy(sim);
    printf("%g s: velocity %g m/s\n", report.time, reading.velocity[1]);
    return status == NMM_OK && fabs(reading.velocity[1] + 10 * report.time) < 1e-6 ? 0 : 1;
}
