// SPDX-License-Identifier: MIT
//
// The way of least counted work. Now and then another way than the usual one is tried, step by step
// in turns with it, so that both have the same of a motion that becomes easier or harder; the one
// that takes less by a margin is the usual one from then on.

#include "friction.h"

#include "base.h"

// Rows from which on most steps have so many contacts that only just touch that a close tolerance
// pays from the start.
#define MANY_ROWS 4000

// Work of a pass beside its solve [ns], by row: contacts, residual, changes of the matrix.
#define PASS_ROW 350.0

// Steps to the first trial of each way, and from one to the next, where it came near and where not.
enum { FIRST_WAIT = 3, APART_WAIT = 20, SHORT_WAIT = 60, LONG_WAIT = 180 };

// What another way gained in a pair of steps, from -1 to 1: on average above the first it is taken,
// below the second the next trial waits long: works of 0.82 and of 1.25 to one. And the sum over
// pairs below which a trial is cut short.
#define BETTER 0.1
#define WORSE (-0.11)
#define IN_VAIN (-0.22)

// At most of a pair.
#define MOST 0.25

// Steps of a trial, in pairs and by turns that leave out what grows evenly; true: the other way.
static const bool turn[] = {false, true, true, false, true, false, false, true};
enum { TRIAL = sizeof turn / sizeof *turn };

void nmm_friction_begin(nmm_friction *friction, int n_row) {
    friction->work = 0;
    friction->slides = false;
    if (friction->begun) return;
    friction->begun = true;
    friction->usual = n_row >= MANY_ROWS ? NMM_FRICTION_CLOSE : NMM_FRICTION_LOOSE;
    friction->way = friction->usual;
    for (int way = 0; way < NMM_FRICTION_WAYS; way++)
        friction->wait[way] = way == NMM_FRICTION_APART ? APART_WAIT : FIRST_WAIT;
}

void nmm_friction_pass(nmm_friction *friction, int n_row, double work, bool slides) {
    friction->work += work + PASS_ROW * n_row;
    friction->slides = friction->slides || slides;
}

// A step of a trial has ended. A pair counts no more than another, however hard one step was.
static void take_note(nmm_friction *friction) {
    friction->pair[turn[friction->tried]] = friction->work;
    friction->tried += 1;
    const double *pair = friction->pair, both = pair[0] + pair[1];
    if (friction->tried % 2 == 1 || !(both > 0)) return;
    friction->gain += nmm_max(-MOST, nmm_min((pair[0] - pair[1]) / both, MOST));
}

// After a pair: is the trial over, and is the other way to be the usual one?
static void judge(nmm_friction *friction) {
    if (friction->tried < TRIAL && friction->gain >= IN_VAIN) return;
    const double gain = friction->gain / (friction->tried / 2);
    friction->trying = false;
    friction->wait[friction->other] = gain < WORSE ? LONG_WAIT : SHORT_WAIT;
    if (gain <= BETTER) return;
    friction->wait[friction->usual] = -gain < WORSE ? LONG_WAIT : SHORT_WAIT;
    friction->usual = friction->other;
}

// The usual way went on: begins a trial of one whose time has come.
static void look_round(nmm_friction *friction) {
    for (int way = 0; way < NMM_FRICTION_WAYS; way++) {
        if (way == (int)friction->usual) continue;
        friction->wait[way] = nmm_max_int(0, friction->wait[way] - 1);
        if (friction->wait[way] > 0 || friction->trying) continue;
        friction->trying = true;
        friction->other = (nmm_friction_way)way;
        friction->tried = 0;
        friction->gain = 0;
    }
}

void nmm_friction_end(nmm_friction *friction) {
    // Without friction there is nothing to compare.
    if (!friction->slides) return;
    if (friction->trying) {
        take_note(friction);
        if (friction->tried % 2 == 0) judge(friction);
    } else {
        look_round(friction);
    }
    const bool differs = friction->trying && turn[friction->tried];
    friction->way = differs ? friction->other : friction->usual;
}
