// SPDX-License-Identifier: MIT
//
// PETSc in the benchmark, in one process: conjugate gradients with its preconditioners, and
// Cholesky factors, its own and MUMPS's. Settings are the best that were found on these systems:
// incomplete factors of the matrix scaled to a unit diagonal, with 0, 1 or 3 levels of fill, in
// reverse Cuthill-McKee order. The pattern, orderings, symbolic factors and the prolongations of
// GAMG are kept; numbers of preconditioners and factors are made anew by each solve, because the
// matrix is marked as changed. The stopping test is on |r| itself.

#include "bench.h"

#include <petscksp.h>
// Only here does PETSc say how to mark a matrix as changed without touching its numbers.
#include <petsc/private/petscimpl.h>

#include <stdlib.h>
#include <string.h>

#define MAX_ITERATIONS 50000
// An incomplete factor that needs more than this has failed.
#define MAX_ITERATIONS_OF_FACTOR 2000
// Solutions with a whole factor, as with the other libraries' ones: on a system that is singular to
// working precision more of them do not help.
#define MAX_REFINEMENTS 5

enum { BY_NUMBERS, BY_BLOCKS };
enum { JACOBI, BLOCK_JACOBI, INCOMPLETE, MULTIGRID, CHOLESKY, MUMPS };

typedef struct petsc {
    const bench_system *system;
    Mat A;
    Vec f, u;
    KSP ksp;
    int max_iterations;
} petsc;

void bench_petsc_start(void) {
    PetscInitializeNoArguments();
    PetscPushErrorHandler(PetscReturnErrorHandler, NULL);
}

void bench_petsc_stop(void) {
    PetscFinalize();
}

// --- The matrix

static PetscErrorCode insert_blocks(Mat A, const bench_system *s) {
    PetscFunctionBeginUser;
    for (PetscInt row = 0; row < s->n_row; row++) {
        for (int k = s->row_start[row]; k < s->row_start[row + 1]; k++) {
            const PetscInt col = s->col[k];
            PetscCall(
                MatSetValuesBlocked(A, 1, &row, 1, &col, s->value + 4 * (long)k, INSERT_VALUES));
        }
    }
    PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
    PetscFunctionReturn(0);
}

static PetscErrorCode make_matrix(petsc *p, int stored) {
    PetscFunctionBeginUser;
    const bench_system *s = p->system;
    PetscInt *per_row = NULL;
    PetscCall(PetscMalloc1(2 * s->n_row, &per_row));
    const PetscInt n = 2 * s->n_row;
    if (stored == BY_BLOCKS) {
        for (int row = 0; row < s->n_row; row++)
            per_row[row] = s->row_start[row + 1] - s->row_start[row];
        PetscCall(MatCreateSeqBAIJ(PETSC_COMM_SELF, 2, n, n, 0, per_row, &p->A));
    } else {
        for (int i = 0; i < n; i++)
            per_row[i] = 2 * (s->row_start[i / 2 + 1] - s->row_start[i / 2]);
        PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, n, n, 0, per_row, &p->A));
        PetscCall(MatSetBlockSize(p->A, 2));
    }
    PetscCall(PetscFree(per_row));
    PetscCall(MatSetOption(p->A, MAT_SYMMETRIC, PETSC_TRUE));
    PetscCall(MatSetOption(p->A, MAT_SPD, PETSC_TRUE));
    PetscCall(insert_blocks(p->A, s));
    PetscFunctionReturn(0);
}

// --- The method

// GAMG is told the rigid motions.
static PetscErrorCode give_rigid_motions(petsc *p) {
    PetscFunctionBeginUser;
    Vec places;
    MatNullSpace motions;
    PetscCall(
        VecCreateSeqWithArray(PETSC_COMM_SELF, 2, 2 * p->system->n_row, p->system->place, &places));
    PetscCall(MatNullSpaceCreateRigidBody(places, &motions));
    PetscCall(MatSetNearNullSpace(p->A, motions));
    PetscCall(MatNullSpaceDestroy(&motions));
    PetscCall(VecDestroy(&places));
    PetscFunctionReturn(0);
}

static PetscErrorCode choose_preconditioner(petsc *p, PC pc, int kind, int levels) {
    PetscFunctionBeginUser;
    static const PCType type[] = {PCJACOBI, PCPBJACOBI, PCICC, PCGAMG, PCCHOLESKY, PCCHOLESKY};
    PetscCall(PCSetType(pc, type[kind]));
    if (kind == INCOMPLETE) {
        // Without the scaling, shifts that keep pivots positive would be far too large for the
        // softer rows.
        PetscCall(KSPSetDiagonalScale(p->ksp, PETSC_TRUE));
        PetscCall(KSPSetDiagonalScaleFix(p->ksp, PETSC_TRUE));
        PetscCall(PCFactorSetShiftType(pc, MAT_SHIFT_POSITIVE_DEFINITE));
        PetscCall(PCFactorSetMatOrderingType(pc, MATORDERINGRCM));
        PetscCall(PCFactorSetLevels(pc, levels));
    }
    if (kind == MULTIGRID) {
        PetscCall(give_rigid_motions(p));
        PetscCall(PCGAMGSetReuseInterpolation(pc, PETSC_TRUE));
    }
    if (kind == CHOLESKY) PetscCall(PCFactorSetMatOrderingType(pc, MATORDERINGND));
    if (kind == MUMPS) PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
    PetscFunctionReturn(0);
}

// A copy, because the diagonal scaling works in place, there and back.
static PetscErrorCode take_right_hand_side(petsc *p) {
    PetscFunctionBeginUser;
    PetscScalar *values;
    PetscCall(VecGetArray(p->f, &values));
    memcpy(values, p->system->f, 2 * (size_t)p->system->n_row * sizeof *values);
    PetscCall(VecRestoreArray(p->f, &values));
    PetscFunctionReturn(0);
}

// A factor is used in Richardson's iteration, which after one solve asks for the residual, and
// goes on where rounding left too much of it.
static PetscErrorCode make(petsc *p, const bench_method *method) {
    PetscFunctionBeginUser;
    PC pc;
    const bench_system *s = p->system;
    PetscCall(make_matrix(p, method->choice[0]));
    PetscCall(VecCreateSeq(PETSC_COMM_SELF, 2 * s->n_row, &p->f));
    PetscCall(VecDuplicate(p->f, &p->u));
    PetscCall(take_right_hand_side(p));
    PetscCall(KSPCreate(PETSC_COMM_SELF, &p->ksp));
    PetscCall(KSPSetOperators(p->ksp, p->A, p->A));
    PetscCall(KSPSetType(p->ksp, method->family == BENCH_DIRECT ? KSPRICHARDSON : KSPCG));
    PetscCall(KSPSetNormType(p->ksp, KSP_NORM_UNPRECONDITIONED));
    PetscCall(KSPGetPC(p->ksp, &pc));
    PetscCall(choose_preconditioner(p, pc, method->choice[1], method->choice[2]));
    // So that PETSC_OPTIONS can try what is not tried here.
    PetscCall(KSPSetFromOptions(p->ksp));
    PetscFunctionReturn(0);
}

static void close_petsc(void *state) {
    petsc *p = state;
    KSPDestroy(&p->ksp);
    VecDestroy(&p->u);
    VecDestroy(&p->f);
    MatDestroy(&p->A);
    free(p);
}

static void *open_petsc(const bench_system *system, const bench_method *method, int n_thread) {
    (void)n_thread;
    petsc *p = calloc(1, sizeof *p);
    if (p == NULL) return NULL;
    p->system = system;
    const bool incomplete = method->choice[1] == INCOMPLETE;
    p->max_iterations = method->family == BENCH_DIRECT ? MAX_REFINEMENTS
                        : incomplete                   ? MAX_ITERATIONS_OF_FACTOR
                                                       : MAX_ITERATIONS;
    if (make(p, method) == 0) return p;
    close_petsc(p);
    return NULL;
}

// --- A solve

static PetscErrorCode solve(petsc *p, double tolerance, PetscInt *iterations) {
    PetscFunctionBeginUser;
    KSPConvergedReason reason;
    PetscObjectState version;
    PetscCall(KSPSetTolerances(p->ksp, tolerance, 1e-300, 1e30, p->max_iterations));
    // The numbers are new: the set-up must be, too.
    PetscCall(PetscObjectStateGet((PetscObject)p->A, &version));
    PetscCall(PetscObjectStateSet((PetscObject)p->A, version + 1));
    PetscCall(KSPSetOperators(p->ksp, p->A, p->A));
    PetscCall(KSPSolve(p->ksp, p->f, p->u));
    PetscCall(KSPGetConvergedReason(p->ksp, &reason));
    PetscCall(KSPGetIterationNumber(p->ksp, iterations));
    if (reason < 0) *iterations = -1;
    PetscFunctionReturn(0);
}

static int solve_petsc(void *state, double tolerance, double *u) {
    petsc *p = state;
    PetscInt iterations = -1;
    const PetscScalar *values = NULL;
    if (solve(p, tolerance, &iterations) != 0 || iterations < 0) return -1;
    if (VecGetArrayRead(p->u, &values) != 0) return -1;
    memcpy(u, values, 2 * (size_t)p->system->n_row * sizeof *u);
    VecRestoreArrayRead(p->u, &values);
    return (int)iterations;
}

#define PETSC(NAME, FAMILY, LARGEST, STORED, KIND, LEVELS)                                         \
    {                                                                                              \
        .name = NAME, .family = BENCH_##FAMILY, .largest = LARGEST, .threads = KIND == MUMPS,      \
        .open = open_petsc, .solve = solve_petsc, .close = close_petsc, .choice = {                \
            STORED,                                                                                \
            KIND,                                                                                  \
            LEVELS                                                                                 \
        }                                                                                          \
    }

const bench_method *bench_petsc(int *n) {
    static const bench_method list[] = {
        PETSC("petsc-cg-jacobi", ITERATIVE, 0, BY_NUMBERS, JACOBI, 0),
        PETSC("petsc-cg-2x2", ITERATIVE, 0, BY_BLOCKS, BLOCK_JACOBI, 0),
        PETSC("petsc-cg-icc0", ITERATIVE, 0, BY_NUMBERS, INCOMPLETE, 0),
        PETSC("petsc-cg-icc1", ITERATIVE, 0, BY_NUMBERS, INCOMPLETE, 1),
        PETSC("petsc-cg-icc3", ITERATIVE, 0, BY_NUMBERS, INCOMPLETE, 3),
        PETSC("petsc-gamg", ITERATIVE, 0, BY_NUMBERS, MULTIGRID, 0),
        PETSC("petsc-cholesky", DIRECT, 30000, BY_NUMBERS, CHOLESKY, 0),
        PETSC("mumps", DIRECT, 300000, BY_NUMBERS, MUMPS, 0),
    };
    *n = (int)(sizeof list / sizeof *list);
    return list;
}
