// SPDX-License-Identifier: MIT
//
// Small geometry: vectors, boxes, polygons and their moments by simplex integration, exact
// orientation tests on integer points, and planar arrangements of integer segments.

#ifndef NMM_GEOMETRY_H
#define NMM_GEOMETRY_H

#include "base.h"

typedef struct nmm_vec2 {
    double x, y; // [m]
} nmm_vec2;

typedef struct nmm_box {
    nmm_vec2 low, high; // [m]
} nmm_box;

static inline nmm_vec2 nmm_vec2_add(nmm_vec2 a, nmm_vec2 b) {
    return (nmm_vec2){a.x + b.x, a.y + b.y};
}
static inline nmm_vec2 nmm_vec2_sub(nmm_vec2 a, nmm_vec2 b) {
    return (nmm_vec2){a.x - b.x, a.y - b.y};
}
static inline nmm_vec2 nmm_vec2_scale(double s, nmm_vec2 a) {
    return (nmm_vec2){s * a.x, s * a.y};
}
/// a + t (b - a).
static inline nmm_vec2 nmm_vec2_mix(nmm_vec2 a, nmm_vec2 b, double t) {
    return (nmm_vec2){a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)};
}
static inline double nmm_vec2_dot(nmm_vec2 a, nmm_vec2 b) {
    return a.x * b.x + a.y * b.y;
}
/// z of a x b.
static inline double nmm_vec2_cross(nmm_vec2 a, nmm_vec2 b) {
    return a.x * b.y - a.y * b.x;
}

/// Area and moments of a polygon about its own centroid, by simplex integration (Shi 1996).
typedef struct nmm_moments {
    double area;       // [m2] positive when counter-clockwise
    nmm_vec2 centre;   // [m] centroid
    double xx, xy, yy; // [m4] second moments about the centroid
} nmm_moments;

/// Moments of the polygon of `n` corners; integrates about its first corner, so that far
/// coordinates cost no digits. Zero area gives the mean of the corners as centre.
nmm_moments nmm_polygon_moments(int n, const nmm_vec2 *corner);

/// Integral of x^p y^q over the polygon about `origin`, p + q <= 8 (facts: simplex formula).
double nmm_polygon_integral(int n, const nmm_vec2 *corner, nmm_vec2 origin, int p, int q);

#endif
