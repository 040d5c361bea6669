// SPDX-License-Identifier: MIT
//
// The columns of a run file's tables.

#include "records.h"

#define COLUMN(type, kind, member, unit, meaning)                                                  \
    { #member, kind, offsetof(type, member), sizeof(((type *)0)->member), unit, meaning }
#define NAMED(type, name, kind, member, unit, meaning)                                             \
    { name, kind, offsetof(type, member), sizeof(((type *)0)->member), unit, meaning }
#define RECORD(type, columns)                                                                      \
    { sizeof(type), (int)(sizeof(columns) / sizeof(columns[0])), columns }

// Energies stand under their own names.
#define ENERGY_COLUMNS(type)                                                                       \
    NAMED(type, "kinetic", 'd', energy.kinetic, "J", "change of kinetic energy"),                  \
        NAMED(type, "strain", 'd', energy.strain, "J", "change of strain energy"),                 \
        NAMED(type, "contact", 'd', energy.contact, "J", "change of energy in contact springs"),   \
        NAMED(type, "friction", 'd', energy.friction, "J", "lost in sliding since the start"),     \
        NAMED(type, "fracture", 'd', energy.fracture, "J", "lost in broken bonds"),                \
        NAMED(type, "support", 'd', energy.support, "J", "change of energy in support springs"),   \
        NAMED(type, "damping", 'd', energy.damping, "J", "lost in damping"),                       \
        NAMED(type, "external", 'd', energy.external, "J", "work of loads, gravity, moved bases"), \
        NAMED(type, "numerical", 'd', energy.numerical, "J", "lost in the time scheme"),           \
        NAMED(type, "residual", 'd', energy.residual, "J", "external less all others")

#define STEP(kind, member, unit, meaning) COLUMN(nmm_step_report, kind, member, unit, meaning)
static const nmm_h5_column step_column[] = {
    STEP('l', step, "", "accepted steps so far"),
    STEP('d', time, "s", "at the end of the step"),
    STEP('d', dt, "s", "length of the step"),
    STEP('i', cuts, "", "times this step was shortened"),
    STEP('i', passes, "", "open-close passes of the accepted try"),
    STEP('i', solver_iterations, "", "iterations of the linear solver, all passes and tries"),
    STEP('i', contacts, "", "contacts found"),
    STEP('i', closed, "", "contacts closed at the end"),
    STEP('d', move, "", "largest displacement over the allowed one"),
    STEP('d', penetration, "m", "largest overlap at the end"),
    ENERGY_COLUMNS(nmm_step_report),
};
const nmm_h5_record nmm_record_step = RECORD(nmm_step_report, step_column);

#define SUMMARY(kind, member, unit, meaning) COLUMN(nmm_summary, kind, member, unit, meaning)
#define LEDGER(name, kind, member, unit, meaning)                                                  \
    NAMED(nmm_summary, name, kind, ledger.member, unit, meaning)
#define PHASE(name, unit, meaning)                                                                 \
    NAMED(nmm_summary, "seconds_" #name, 'd', phase_seconds.name, unit, meaning)
static const nmm_h5_column summary_column[] = {
    SUMMARY('i', blocks, "", "blocks"),
    SUMMARY('i', elements, "", "manifold elements"),
    SUMMARY('i', covers, "", "physical covers"),
    SUMMARY('i', unknowns, "", "unknowns of the linear system"),
    SUMMARY('i', contacts, "", "contacts of the last step"),
    SUMMARY('l', steps, "", "accepted steps"),
    SUMMARY('d', time, "s", "simulated"),
    SUMMARY('i', end, "", "1 completed, 0 running, -1 step too small, -2 solver, -3 interrupted"),
    SUMMARY('s', reason, "", "why the run ended"),
    SUMMARY('d', wall_seconds, "s", "wall time"),
    PHASE(contact, "s", "wall time in the contact search"),
    PHASE(assemble, "s", "wall time in assembly"),
    PHASE(solve, "s", "wall time in the linear solver"),
    PHASE(advance, "s", "wall time in the update of the state"),
    PHASE(output, "s", "wall time in output"),
    SUMMARY('s', method, "", "method of the linear solver"),
    SUMMARY('s', device, "", "host, or the device"),
    SUMMARY('i', on_device, "", "1: seen inside a target region"),
    SUMMARY('s', precision, "", "precision of the linear solver, as used"),
    SUMMARY('s', precision_asked, "", "the same as asked for"),
    SUMMARY('l', with_mixed, "", "solves in mixed precision to their end"),
    SUMMARY('l', fell_back, "", "solves in which float64 had to go on after float32"),
    SUMMARY('s', fall_back, "", "why the last of those did"),
    SUMMARY('i', solve_threads, "", "most threads of a solve"),
    SUMMARY('s', why, "", "why auto chose what it chose most often"),
    SUMMARY('l', why_solves, "", "solves for which it said so"),
    SUMMARY('l', by_average_change, "", "solves that ended by the average change"),
    SUMMARY('l', solves, "", "linear systems solved"),
    SUMMARY('l', iterations, "", "iterations of the linear solver"),
    SUMMARY('l', failed, "", "solves that missed their tolerance"),
    SUMMARY('l', with_cover, "", "solves with 2x2 blocks"),
    SUMMARY('l', with_cluster, "", "solves with clusters"),
    SUMMARY('l', with_body, "", "solves with clusters and rigid motions of bodies"),
    SUMMARY('l', with_direct, "", "solves by the direct method"),
    SUMMARY('l', with_friction, "", "solves with friction's coupling, by minimal residuals"),
    SUMMARY('l', setups, "", "times blocks or factors were made anew"),
    SUMMARY('l', transfers, "", "transfers to and from the device"),
    SUMMARY('d', transfer_bytes, "B", "their size"),
    SUMMARY('d', transfer_seconds, "s", "their time"),
    SUMMARY('l', dt_cuts, "", "times a step was shortened"),
    SUMMARY('l', open_close_iterations, "", "open-close passes"),
    ENERGY_COLUMNS(nmm_summary),
    LEDGER("largest_energy", 'd', largest, "J", "largest energy of any term of the ledger"),
    LEDGER("gain", 'd', gain, "J", "largest fall of numerical: energy from nowhere"),
    LEDGER("gain_step", 'l', gain_step, "", "step since which its limit is passed, 0: it is not"),
    LEDGER("gain_time", 'd', gain_time, "s", "end of that step"),
    LEDGER("largest_residual", 'd', residual, "J", "largest residual of the ledger"),
    LEDGER("residual_step", 'l', residual_step, "", "the same of the residual"),
    LEDGER("residual_time", 'd', residual_time, "s", "end of that step"),
    LEDGER("rounding", 'd', rounding, "J", "what rounding may make of gain and residual"),
    LEDGER("ledger_warning", 's', warning, "", "limits that are passed, since when, where"),
    SUMMARY('l', pressed, "", "closed contacts of method augmented, summed over the steps"),
    SUMMARY('l', not_raised, "", "of them those whose forces springs alone held"),
    SUMMARY('d', max_penetration, "m", "largest overlap of the run"),
    SUMMARY('d', max_support_give, "m", "largest distance of a held point from its place"),
    SUMMARY('d', cover_size, "m", "distance of neighbouring lattice nodes"),
    SUMMARY('u', state_hash, "", "hash of the last state"),
};
const nmm_h5_record nmm_record_summary = RECORD(nmm_summary, summary_column);

#define MONITOR(name, kind, member, unit, meaning)                                                 \
    NAMED(nmm_monitor_row, name, kind, member, unit, meaning)
static const nmm_h5_column monitor_column[] = {
    MONITOR("step", 'l', step, "", "accepted steps so far"),
    MONITOR("time", 'd', time, "s", "simulated"),
    MONITOR("displacement_x", 'd', displacement[0], "m", "displacement along x"),
    MONITOR("displacement_y", 'd', displacement[1], "m", "displacement along y"),
    MONITOR("velocity_x", 'd', velocity[0], "m/s", "velocity along x"),
    MONITOR("velocity_y", 'd', velocity[1], "m/s", "velocity along y"),
    MONITOR("stress_xx", 'd', stress[0], "Pa", "stress xx, tension positive"),
    MONITOR("stress_yy", 'd', stress[1], "Pa", "stress yy, tension positive"),
    MONITOR("stress_xy", 'd', stress[2], "Pa", "stress xy"),
};
const nmm_h5_record nmm_record_monitor = RECORD(nmm_monitor_row, monitor_column);

#define SUPPORT(kind, member, unit, meaning) COLUMN(nmm_support_row, kind, member, unit, meaning)
static const nmm_h5_column support_column[] = {
    SUPPORT('d', x, "m", "reference place along x"),
    SUPPORT('d', y, "m", "reference place along y"),
    SUPPORT('i', fix_x, "", "1: held along x"),
    SUPPORT('i', fix_y, "", "1: held along y"),
    SUPPORT('i', block, "", "block"),
    SUPPORT('i', element, "", "element"),
    SUPPORT('i', held, "", "1: the whole block is held"),
};
const nmm_h5_record nmm_record_support = RECORD(nmm_support_row, support_column);

#define LOAD(kind, member, unit, meaning) COLUMN(nmm_load_row, kind, member, unit, meaning)
static const nmm_h5_column load_column[] = {
    LOAD('d', x, "m", "reference place along x"),
    LOAD('d', y, "m", "reference place along y"),
    LOAD('d', fx, "N", "force along x, before its history"),
    LOAD('d', fy, "N", "force along y, before its history"),
    LOAD('i', element, "", "element"),
    LOAD('d', length, "m", "boundary whose traction it stands for, 0: a force at a point"),
    LOAD('i', history, "", "history of its factor, -1: constant"),
};
const nmm_h5_record nmm_record_load = RECORD(nmm_load_row, load_column);

#define HISTORY(kind, member, unit, meaning) COLUMN(nmm_history_row, kind, member, unit, meaning)
static const nmm_h5_column history_column[] = {
    HISTORY('i', history, "", "number of the history"),
    HISTORY('d', time, "s", "of this entry, rising inside a history"),
    HISTORY('d', factor, "", "on the load; linear between entries, constant before and after"),
};
const nmm_h5_record nmm_record_history = RECORD(nmm_history_row, history_column);

const char *nmm_end_name(nmm_end end) {
    switch (end) {
    case NMM_END_RUNNING:
        return "running";
    case NMM_END_COMPLETED:
        return "completed";
    case NMM_END_STEP_TOO_SMALL:
        return "step_too_small";
    case NMM_END_SOLVER_FAILED:
        return "solver_failed";
    case NMM_END_INTERRUPTED:
        return "interrupted";
    case NMM_END_NO_EQUILIBRIUM:
        return "no_equilibrium";
    }
    return "unknown";
}
