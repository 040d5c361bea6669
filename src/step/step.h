// SPDX-License-Identifier: MIT
//
// The simulation: one time step as a short function, step-size control, the energy ledger.

#ifndef NMM_STEP_H
#define NMM_STEP_H

#include "balance.h"
#include "contact.h"
#include "cover.h"
#include "friction.h"
#include "mixing.h"
#include "motion.h"
#include "nearby.h"
#include "pace.h"
#include "scene.h"
#include "solve.h"
#include "system.h"
#include "watch.h"

/// Work of the unbalanced forces along a correction, at its end over that at its beginning, which
/// may be left.
#define NMM_OVERSHOOT 0.3

/// How far covers may go at most, as a part of their size, before all of the matrix is made anew.
#define NMM_DRIFT 1e-2

/// Augmented contact: part of a force that a spring may hold beside the carried force, in long
/// steps and in short ones, whose forces change from step to step; and which may be left where
/// neither raising nor stiffer springs gain more.
#define NMM_SPRING_SHARE 1e-5
#define NMM_SPRING_SHARE_QUICK 1e-4
#define NMM_SPRING_SHARE_LEFT 1e-2

/// Augmented contact: where a round leaves more than this part of what springs held, they become
/// stiffer by a factor, up to the last one over what they were.
#define NMM_SPRING_GAIN 0.25
#define NMM_SPRING_STIFFER 10.0
#define NMM_SPRING_STIFFEST 1000.0

/// What rounding may make of a force in springs that become stiffer.
#define NMM_SPRING_ROUNDING 1e-3

/// Rounding of a gap and of a slip where passes of statics gain nothing more, in rounding errors of
/// the scene's size: of three places, each a sum over its covers, and of their differences. Springs
/// stiff enough change their mode by it, pass after pass. In motion what is left would add up in
/// the ledger, and inertia stands against such changes.
#define NMM_GAP_ROUNDING 16

/// Part of the forces of a block that this rounding may be in statics.
#define NMM_CLOUDED 1e-2

/// Part of the force of a group of supports that their springs may hold beside the carried force:
/// at rest, and in motion, where forces change in each step and a closer share would take rounds in
/// all.
#define NMM_SUPPORT_SHARE 1e-3
#define NMM_SUPPORT_SHARE_MOVING 0.1

/// Residual of a linear solve over that before, where it knows of friction: passes in which
/// contacts change mode gain no more, and when none did the pass gains nearly all that the solve
/// does.
#define NMM_COUPLED_TOLERANCE 1e-3
#define NMM_QUIET_TOLERANCE 1e-4

/// The same in the first pass of a step: what is left there is strewn over contacts that only just
/// touch, and takes passes to be gathered in again.
#define NMM_FIRST_TOLERANCE 3e-4

/// Part of these that a close following of friction asks for.
#define NMM_CLOSE_PART 0.1

/// Unbalanced forces over those before that a pass which knows of friction may leave, not to be in
/// vain.
#define NMM_GAINED 0.8

/// Part of the unbalanced forces allowed that a first pass may leave along the motion, where that
/// goes on.
#define NMM_FIRST_PASS 0.03

/// With scheme newmark nothing fades: the first passes go on while unbalanced forces do more work
/// in a step than this part of the largest energy, and this part of the rounding of the ledger.
#define NMM_SWING_PASSES 3
#define NMM_LEFT_WORK 1e-9
#define NMM_LEFT_ROUNDING 1e-3

/// Unbalanced forces over all of them that a pass may leave aside, to solve only for the rows that
/// have the others and those near by. A first pass, and a later one: so many times what the pass
/// before left, within bounds, where contacts change mode in all of them and none gains much; twice
/// as much and so on to the most where that are too many rows.
#define NMM_FIRST_LEFT 1e-4
#define NMM_LEFT_OF_GAIN 0.15
#define NMM_LEAST_LEFT 1e-2
#define NMM_LEFT 0.2
#define NMM_MOST_LEFT 0.4

/// Part of what may be left in the end that a later pass may leave aside in any case.
#define NMM_LEFT_ALLOWED 0.5

/// Part of the forces allowed to be left that rounding may be, not to be looked at in each pass.
#define NMM_ROUNDED 0.1

/// Limits of one step.
enum {
    NMM_NEAR_ROWS = 300, // rows from which on solves may be for part of them
    NMM_MAX_PASS = 40,   // open-close passes of one try
    NMM_ROUND_AGAIN = 4, // passes after which rounding is looked at again
    NMM_MAX_LOOK = 8,    // looks along one correction
    NMM_MAX_RAISE = 30,  // times carried forces are raised in one try
};

/// Why a try of a step was given up.
typedef enum nmm_try {
    NMM_TRY_SETTLED,
    NMM_TRY_MOVED,      // beyond max_move
    NMM_TRY_FLIPS,      // contacts keep changing mode
    NMM_TRY_FORCES,     // modes settled, forces do not balance
    NMM_TRY_CARRIED,    // carried forces do not come to rest
    NMM_TRY_SOLVER,     // the linear solver missed its tolerance
    NMM_TRY_INSIDE_OUT, // an element has no area left, or turned inside out
} nmm_try;

/// A system that the caller wants to have written (nmm_sim_dump_system). `write` is called before
/// each linear solve, when matrix, right-hand side and first guess stand; NULL: nothing is wanted.
typedef struct nmm_dump {
    nmm_status (*write)(nmm_sim *sim, const nmm_solve_options *options);
    long step;          // from 1
    int iteration;      // of the open-close loop, from 1
    const char *prefix; // of the files
    int n_written;      // tries of the step that came so far
    void *user;         // of `write`
} nmm_dump;

/// What features cost, whether the scene has them or not.
typedef struct nmm_costs {
    bool known;                    // weighed, which nmm_sim_check does
    double curved_bytes;           // stiffness, products of functions, samples; of order 1 at least
    int curved_unknowns;           // more of order 1 where the order is 0; otherwise 0
    double tie_bytes;              // of ties of slivers; none: what the first one takes at least
    double contact_bytes;          // search and mixing of passes, without forces and springs
    double contact_seconds;        // of one search
    double mean_bytes, hold_bytes; // start of a step; held covers
    double support_bytes, load_bytes, monitor_bytes; // of all; none: of one
    double initial_bytes;                            // kept as zeros where there is none
    // Of a frame of the run file.
    double displacement_bytes, velocity_bytes, stress_bytes, contact_rows;
} nmm_costs;

/// Supports that are raised together.
typedef struct nmm_support_group {
    double error[2], length; // mean distance from their place, boundary length [m]
    double stiffness, force; // [N/m, N] of all, forces before they cancel
    double raised[2];        // [m] how far in this try
    double weight;           // [1/m] of distances, next to the forces that the try began with
    int block;               // that they hold
} nmm_support_group;

/// How supports are raised: from what the last rounds changed follows what the next one is to.
typedef struct nmm_raising {
    nmm_support_group *group; // [n_support_group]
    double *largest;          // [n_block] N, force of a group on the blocks that may touch
    double *place, *change;   // [n_support_group][2] of the mixing, weighted
    nmm_mixing mixing;
    int n_late; // steps of statics that ended before all stood
} nmm_raising;

/// What is left of the forces on a body that nothing holds, as a whole, and what resists.
typedef struct nmm_free_body {
    bool free;
    double mass, inertia; // [kg, kg m2]
    nmm_vec2 centre;      // half way through the step
    nmm_vec2 push;        // [N]
    double torque;        // [N m] about the centre
} nmm_free_body;

/// A sentence of auto's, and for how many solves it said so.
typedef struct nmm_reason {
    const char *text;
    long solves;
} nmm_reason;

struct nmm_sim {
    nmm_context context;
    nmm_pace pace;      // contact, assembly and all else but solves: one thread or all
    int solver_threads; // of solves
    nmm_scene scene;
    nmm_scene_settings settings; // the scene's, completed: nothing is left on auto
    nmm_model model;
    nmm_state state;
    nmm_cover_report cover;
    nmm_contact_search *search; // NULL: the scene needs no contact
    nmm_system system;
    const nmm_solve_backend *backend;
    nmm_solver *solver;
    bool comparable;                // nmm_sim_def.comparable
    int solver_rows, solver_blocks; // sizes the solver is open for
    double allowed;                 // [m] largest displacement of any step
    double allowed_now;             // [m] of this step: contacts are listed for no more

    // Displacement of the step by itself: end minus start would lose its digits in short steps.
    double *moved; // [n_cover][2]

    nmm_mixing mixing;     // of the passes; open where there is contact
    nmm_motion motion;     // the same
    nmm_friction friction; // how closely passes follow it
    nmm_nearby nearby;     // of solves for part of the rows; open from the first that may be

    nmm_balance balance;      // of the forces, block by block
    nmm_free_body *free_body; // [n_block]; NULL: the scheme does not keep momenta
    nmm_raising raising;      // of supports
    double speed;             // [m/s] largest motion of a point in the last step

    // The state at the start of the step, to go back to.
    double *start_displacement, *start_velocity; // [n_cover][2]
    double *start_position;                      // [n_point][2]
    double *start_support;                       // [n_support][2]
    const nmm_contact *start_contact;            // the search has it
    nmm_carrying carrying;                       // of augmented contacts, in this try
    nmm_carried carried;                         // in the last one
    int n_alone, left_alone; // short steps left to springs the last time, and still
    bool tried;              // this step: the state may be that of a try

    // Stored energies at the last accepted state [J].
    double kinetic, strain, support, contact;
    double kinetic0, strain0;
    nmm_contact_energy contact_energy;
    nmm_energy energy;
    nmm_watch watch;   // of the ledger
    nmm_energy judged; // statics: the same after the step before
    bool overlaps;     // statics: augmented contacts of the last try have not come to rest
    int n_free;        // last steps in which a block seemed to be free

    nmm_summary summary;    // running totals
    nmm_reason reason[8];   // what auto said, in the order in which it did first
    nmm_step_report report; // of the last step
    double phase_mark;      // clock at the last change of phase
    double started;         // clock at creation
    nmm_dump dump;
    nmm_costs costs;
    char *choices; // text of nmm_sim_choices, in the scene's arena
};

/// Time that loads and supports follow after a step of length h: in statics always the end.
static inline double nmm_sim_time_after(const nmm_sim *sim, double h) {
    return sim->settings.is_static ? sim->settings.end : sim->state.time + h;
}

/// Are contact springs too stiff for the digits of places? Then the words for it, else "".
void nmm_say_clouded(const nmm_sim *sim, char *text, size_t size);

/// Statics: has the state that was just accepted come to rest, or is there no equilibrium? Sets end
/// and reason of report and summary.
void nmm_static_judge(nmm_sim *sim, double h);

/// Room to raise supports in.
nmm_status nmm_raising_open(nmm_context *context, nmm_raising *raising, const nmm_model *model);
void nmm_raising_close(nmm_context *context, nmm_raising *raising);

/// A try begins: what supports were raised by in others counts no more.
void nmm_supports_begin(nmm_sim *sim);

/// Raise the carried forces of supports, eq. (4.7), which the last rounds tell how to where nothing
/// else was raised (`alone`); false when none gave way, or the step is too short for it.
bool nmm_supports_raise(nmm_sim *sim, const nmm_step_state *step, bool alone);

/// Do supports stand where they should at the time `end`, in the state as it is?
bool nmm_supports_stand(nmm_sim *sim, double end);

/// Which of them does so least, after the last look, in words.
void nmm_supports_say(const nmm_sim *sim, char *text, size_t size);

/// Youngs modulus over density, the square of a wave's speed, [m2/s2]: smallest and largest.
void nmm_wave_squares(const nmm_model *model, double *slowest, double *fastest);

/// Change of time since the last call of it is added to *phase.
void nmm_sim_clock(nmm_sim *sim, double *phase);

/// Sets sim->choices, with costs where they are known.
nmm_status nmm_sim_describe(nmm_sim *sim);

/// Weigh what features cost, by a search for contacts in the first configuration.
nmm_status nmm_costs_weigh(nmm_sim *sim, nmm_costs *costs);

/// Method of the linear solver. A run that is to be compared keeps to what devices have as well.
nmm_solve_method nmm_step_method(const nmm_sim *sim);

/// Precision of the linear solver, as it was asked for.
nmm_solve_precision nmm_step_precision(const nmm_sim *sim);

/// The backend for a device. NMM_ERROR_DEVICE: there is no such device.
nmm_status nmm_step_backend(nmm_context *context, nmm_device_choice device,
                            const nmm_solve_backend **backend);

/// Book a linear solve; how it ended, in words that follow "the solver".
void nmm_solves_count(nmm_sim *sim, const nmm_solve_report *report);
const char *nmm_solves_end(nmm_solve_end end);

/// Room for solves of part of the rows, where there may be any, from the first contact on.
nmm_status nmm_solves_open_nearby(nmm_sim *sim);

/// Try one step of length h from the saved start: the open-close loop.
nmm_status nmm_step_try(nmm_sim *sim, double h, nmm_try *outcome);

/// A try of length h settled: moves bodies that nothing holds rigidly until no push and no torque
/// is left on them as wholes.
void nmm_free_balance(nmm_sim *sim, double h);

/// Energies of the state as it is: sets sim->kinetic0, strain0 and the stored ones; once, at the
/// start.
void nmm_ledger_start(nmm_sim *sim);

/// Book the step of length h that was just accepted, its velocities and contacts included.
void nmm_ledger_step(nmm_sim *sim, double h, nmm_contact_energy before);

/// The ledger begins, and the step of length h was booked with these losses: is energy from nowhere
/// in it, does it close?
void nmm_watch_start(nmm_sim *sim);
void nmm_watch_step(nmm_sim *sim, const nmm_losses *losses);

/// What passed its limit, in words, into summary.ledger.
void nmm_watch_tell(nmm_sim *sim);

/// What the scheme loses in the bodies in this try [J]: the first bracket of eq. (4.10).
double nmm_ledger_lost_in_bodies(const nmm_sim *sim);

/// Strain energy that an element stores in the state as it is [J]; *work: of its inner forces over
/// the step [J], from the last residual.
double nmm_ledger_strain(const nmm_sim *sim, int element, double *work);

/// "block 3 'slider' near (1.2, 3.4)", the place of an element.
void nmm_element_place(const nmm_sim *sim, int element, char *text, size_t size);

/// Work of the contact forces on the covers over the step [J], from the last residual.
double nmm_ledger_contact_work(const nmm_sim *sim);

#endif
