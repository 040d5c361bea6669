// SPDX-License-Identifier: MIT
//
// Numbers of a scene: a whole token in the C locale or an error, with an optional unit that is
// checked for its dimension. Values come out in SI, angles in degrees.

#ifndef NMM_SCENE_NUMBER_H
#define NMM_SCENE_NUMBER_H

#include "base.h"

typedef enum nmm_dimension {
    NMM_PURE, // no unit, or %
    NMM_LENGTH,
    NMM_TIME,
    NMM_ANGLE,
    NMM_DENSITY,
    NMM_STRESS,
    NMM_FORCE, // of a slice 1 m thick
    NMM_VELOCITY,
    NMM_SPIN,
    NMM_ACCELERATION,
    NMM_RATE,
    NMM_STIFFNESS, // stress over length
    NMM_N_DIMENSION
} nmm_dimension;

typedef struct nmm_dimension_facts {
    const char *article; // "a stress"
    const char *unit;    // of bare numbers
    double limit;        // no number may be larger
} nmm_dimension_facts;
extern const nmm_dimension_facts nmm_dimension_table[NMM_N_DIMENSION];

/// value in SI = number * multiply / divide. Ends with a NULL name.
typedef struct nmm_unit {
    const char *name;
    nmm_dimension dimension;
    double multiply, divide;
} nmm_unit;
extern const nmm_unit nmm_unit_table[];

/// The unit of that name which serves `dimension`, else any of that name, else NULL.
const nmm_unit *nmm_unit_find(const char *name, nmm_dimension dimension);

typedef enum nmm_number_fault {
    NMM_NUMBER_GOOD,
    NMM_NUMBER_NONE,       // not a number at all
    NMM_NUMBER_COMMA,      // a decimal comma
    NMM_NUMBER_NOT_FINITE, // nan, inf
    NMM_NUMBER_HUGE,       // beyond the range of a double
    NMM_NUMBER_TINY,       // not zero, but too small for a double
    NMM_NUMBER_UNIT,       // a unit that is not known
    NMM_NUMBER_DIMENSION   // a unit of another dimension
} nmm_number_fault;

typedef struct nmm_number {
    nmm_number_fault fault;
    double value;          // SI, degrees
    const char *unit;      // rest of the token, empty: bare
    const nmm_unit *meant; // of another dimension
} nmm_number;
nmm_number nmm_number_parse(const char *text, nmm_dimension dimension);

#endif
