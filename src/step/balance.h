// SPDX-License-Identifier: MIT
//
// Do forces balance? Asked of each block by its own forces, so that a body a million times lighter
// than another of the same scene is looked at as well, and of blocks that may press on each other
// together, eq. (4.5). A linear system is weighted likewise where forces of blocks are far apart,
// by powers of two, which round nothing.

#ifndef NMM_BALANCE_H
#define NMM_BALANCE_H

#include "system.h"

/// Classes of blocks by the size of their forces, a thousand between one and the next.
enum { NMM_FORCE_CLASSES = 5, NMM_FORCE_CLASS_BITS = 10 };

/// Sums of squares over the covers of a block, or over the blocks of a group [N2].
typedef struct nmm_balance_sums {
    double force;    // all forces, taken before they cancel
    double left;     // what does not balance
    double rounding; // what rounding leaves, next to the forces that make the sum up
    double gaps;     // the part of it that springs of contacts make of places
    double way;      // of the covers in a change [m2]
    double work;     // of what does not balance along it, no square [N m]
    double allowed;  // [N] that a group may leave as a whole
    double load;
    double moved; // displacements of the covers [m2]
} nmm_balance_sums;

typedef struct nmm_balance {
    int n_block;
    bool *held;              // [n_block] all covers are held: there is nothing to balance
    long list;               // nmm_couples.list that the groups follow from
    int *group;              // [n_block] blocks that may touch in this step: the first one of them
    int *count;              // [n_block] blocks of the group that begins here
    nmm_balance_sums *block; // [n_block]
    nmm_balance_sums *whole; // [n_block] of the group that begins here
    double *allowed;         // [n_block] N
    double *stiffness;       // [n_block] N/m, against a strain over the whole scene
    int *exponent;           // [n_block] rows and columns of the linear system times 2^exponent
    double *weight;          // [n_block] 2^exponent
    bool weighted;           // some exponent is not 0
    double gap_rounding;     // of gaps and slips, in rounding errors of displacements
    int n_class;             // 1: forces of all blocks are of one class
} nmm_balance;

nmm_status nmm_balance_open(nmm_context *context, nmm_balance *balance, const nmm_model *model,
                            const nmm_system *system);
void nmm_balance_close(nmm_context *context, nmm_balance *balance);

/// A step begins: groups of blocks that the contacts join, which the couples are those of.
void nmm_balance_group(nmm_balance *balance, const nmm_couples *couples, const nmm_model *model);

/// What rounding leaves of the forces, at the last matrix. The step's length is `h`, no point
/// is meant to go further than `reach` [m]; velocities are those of its start.
void nmm_balance_round(nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                       const nmm_state *state, double h, double reach);

/// What is left of the forces of the last residual over what is allowed, at worst: 1 and below
/// counts as settled.
double nmm_balance_worst(nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                         double tolerance);

/// What is left of the forces of a group along its way in the step, over what is allowed, at worst;
/// after nmm_balance_worst.
double nmm_balance_along(nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                         const double *moved);

/// The same of other forces, by cover [n_cover][2], next to those of the last residual.
double nmm_balance_worst_of(nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                            const double *left, double tolerance);

/// What may be left of the forces of a block, by the sums of the last call [N].
double nmm_balance_allowed(const nmm_balance *balance, int block, double tolerance);

/// Is what so many times the rounding of displacements leaves in the contacts of a block more than
/// the tolerance allows it? Where nothing acts any more next to the forces that its displacements
/// would make as strains.
bool nmm_balance_clouded_in(const nmm_balance *balance, int block, double tolerance,
                            double rounding);

/// The same of any block.
bool nmm_balance_clouded(const nmm_balance *balance, double tolerance, double rounding);

/// Weights of the blocks in linear systems, from what is allowed; not `wanted`: none.
void nmm_balance_weigh(nmm_balance *balance, bool wanted);

/// Norm of the residual, weighted [N].
double nmm_balance_norm(const nmm_balance *balance, const nmm_system *system,
                        const nmm_model *model, int n_thread);

/// The norm of what a linear solve may leave, weighted, so that no block has more than allowed [N].
double nmm_balance_limit(const nmm_balance *balance);

/// Those of the blocks [n_block]; NULL: none are wanted or worth it.
const double *nmm_balance_weights(const nmm_balance *balance);

/// A coupling made anew, weighted.
void nmm_balance_weigh_coupling(const nmm_balance *balance, nmm_coupling *coupling,
                                const nmm_model *model);

/// Residual and change, weighted; as they were.
void nmm_balance_put_weights(const nmm_balance *balance, nmm_system *system,
                             const nmm_model *model);
void nmm_balance_take_weights(const nmm_balance *balance, nmm_system *system,
                              const nmm_model *model);

/// Work of the unbalanced forces along the change, by class of forces.
void nmm_balance_work(const nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                      int n_thread, double work[NMM_FORCE_CLASSES]);

/// The work that forces as large as allowed may do along the change, 0 where there is one class:
/// less than that tells nothing.
void nmm_balance_least_work(nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                            double least[NMM_FORCE_CLASSES]);

#endif
