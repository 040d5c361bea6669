// SPDX-License-Identifier: MIT
//
// The target backend of a build without offload: there is none, and it says so.

#include "solve.h"

const nmm_solve_backend *nmm_solve_target(void) {
    return NULL;
}

int nmm_solve_target_devices(void) {
    return 0;
}
