// SPDX-License-Identifier: MIT
//
// Points and segments on the integer lattice, and the exact questions asked about them.
//
// Coordinates stay within +-NMM_COORDINATE_MAX = 2^40. Then a cross product needs at most 83 bits
// and a rounded crossing at most 126, so everything here is exact in 128 bits: there is no
// tolerance, and the answer does not depend on the order or the direction of the segments.

#ifndef NMM_INTEGER_H
#define NMM_INTEGER_H

#include "base.h"

__extension__ typedef __int128 nmm_int128;

#define NMM_COORDINATE_MAX (INT64_C(1) << 40)

typedef struct nmm_ipoint {
    int64_t x, y;
} nmm_ipoint;

/// Two segments of one family >= 0 are not meant to cross; NMM_FAMILY_MESH: they are known not to,
/// and are not tested against each other; NMM_FAMILY_NONE: nothing is known.
enum { NMM_FAMILY_NONE = -1, NMM_FAMILY_MESH = -2 };

typedef struct nmm_isegment {
    nmm_ipoint a, b;
    int family;
    int rank; // what is welded keeps the place of the lowest rank
} nmm_isegment;

static inline bool nmm_ipoint_equal(nmm_ipoint a, nmm_ipoint b) {
    return a.x == b.x && a.y == b.y;
}

/// -1, 0, 1: order by x, then by y.
static inline int nmm_ipoint_compare(nmm_ipoint a, nmm_ipoint b) {
    if (a.x != b.x) return a.x < b.x ? -1 : 1;
    return (a.y > b.y) - (a.y < b.y);
}

/// (a - o) x (b - o): twice the signed area of the triangle o, a, b.
static inline nmm_int128 nmm_icross(nmm_ipoint o, nmm_ipoint a, nmm_ipoint b) {
    return (nmm_int128)(a.x - o.x) * (b.y - o.y) - (nmm_int128)(a.y - o.y) * (b.x - o.x);
}

/// 1: c lies to the left of a -> b; -1: to the right; 0: on the line.
static inline int nmm_orientation(nmm_ipoint a, nmm_ipoint b, nmm_ipoint c) {
    const nmm_int128 cross = nmm_icross(a, b, c);
    return (cross > 0) - (cross < 0);
}

/// Do the segments cross in one point that is inside both? Touching ends do not count.
bool nmm_isegment_cross(nmm_isegment s, nmm_isegment t);

/// The lattice point nearest to the crossing of two segments that cross; halves are rounded up.
nmm_ipoint nmm_isegment_crossing(nmm_isegment s, nmm_isegment t);

/// Does the closed segment a, b meet the pixel [x - 1/2, x + 1/2) x [y - 1/2, y + 1/2) of `p`?
bool nmm_isegment_meets_pixel(nmm_ipoint a, nmm_ipoint b, nmm_ipoint p);

/// Order of the directions o -> a and o -> b by angle from the positive x axis, counter-clockwise:
/// -1, 0, 1.
int nmm_ipoint_compare_angle(nmm_ipoint o, nmm_ipoint a, nmm_ipoint b);

/// Sort points by x, then y, by merging. Returns the array that holds the result: `point` or
/// `spare`, both [n].
nmm_ipoint *nmm_ipoint_sort(int n, nmm_ipoint *point, nmm_ipoint *spare);

/// Twice the signed area of a polygon, exactly.
nmm_int128 nmm_ipolygon_area(int n, const nmm_ipoint *corner);

#endif
