// SPDX-License-Identifier: MIT
//
// The simulation: one time step as a short function, step-size control, the energy ledger.

#ifndef NMM_STEP_H
#define NMM_STEP_H

#include "contact.h"
#include "cover.h"
#include "scene.h"
#include "solve.h"
#include "system.h"

struct nmm_sim {
    nmm_context context;
    nmm_scene scene;
    nmm_scene_settings settings; // the scene's, completed: nothing is left on auto
    nmm_model model;
    nmm_state state;
    nmm_cover_report cover;
    nmm_contact_search *search; // NULL: the scene needs no contact
    nmm_system system;
    const nmm_solve_backend *backend;
    nmm_solver *solver;
    nmm_contact_energy contact_energy;
    nmm_energy energy;
    nmm_summary summary;    // running totals
    nmm_step_report report; // of the last step
    char *choices;          // text of nmm_sim_choices
    double started;         // clock
};

#endif
