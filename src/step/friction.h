// SPDX-License-Identifier: MIT
//
// How closely the passes of a step follow friction: by solves that know how it changes with
// pressure, to a loose tolerance or to a close one, or by solves that do not. Chosen by the counted
// work of the steps before, never by a clock: the same on any machine and any number of threads.

#ifndef NMM_FRICTION_H
#define NMM_FRICTION_H

#include <stdbool.h>

/// The ways there are.
typedef enum nmm_friction_way {
    NMM_FRICTION_LOOSE, // with the coupling, as far as a pass gains where few contacts only touch
    NMM_FRICTION_CLOSE, // with the coupling, so closely that those which only touch feel it
    NMM_FRICTION_APART, // symmetric systems: friction follows pass by pass
    NMM_FRICTION_WAYS
} nmm_friction_way;

/// What the steps of a run have shown; zero at its beginning.
typedef struct nmm_friction {
    bool begun;
    nmm_friction_way way;   // of this step
    nmm_friction_way usual; // outside of trials
    bool trying;
    nmm_friction_way other;      // that is tried
    int tried;                   // steps of the trial so far
    double pair[2];              // [ns] counted of the last one of the usual way, of the other
    double gain;                 // of the other, sum over pairs of what it took less over both
    int wait[NMM_FRICTION_WAYS]; // steps to the next trial of a way
    double work;                 // [ns] of this step so far
    bool slides;                 // contacts slid in it
} nmm_friction;

/// A step of a system of n_row block rows begins.
void nmm_friction_begin(nmm_friction *friction, int n_row);

/// A pass of it has solved for n_row rows by so much work [ns]. `slides`: contacts did.
void nmm_friction_pass(nmm_friction *friction, int n_row, double work, bool slides);

/// It has ended: which way is the next one to go?
void nmm_friction_end(nmm_friction *friction);

#endif
