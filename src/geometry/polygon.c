// SPDX-License-Identifier: MIT
//
// Area, centroid and moments of polygons by simplex integration (Shi 1996; eq. (2.9) to (2.12)):
// the polygon is the signed sum of the triangles that its edges make with a corner, and a monomial
// has a closed integral over each. Cross products are rounded once (a fused multiply-add recovers
// the rounding of a product), so thin polygons keep their digits.

#include "geometry.h"

#include <math.h>

// a x b with an error of about one rounding, by Kahan's scheme.
static double accurate_cross(nmm_vec2 a, nmm_vec2 b) {
    const double product = a.y * b.x;
    const double lost = fma(-a.y, b.x, product);
    return fma(a.x, b.y, -product) + lost;
}

static nmm_vec2 mean_of(int n, const nmm_vec2 *corner) {
    nmm_vec2 sum = {0, 0};
    for (int i = 0; i < n; i++)
        sum = nmm_vec2_add(sum, nmm_vec2_sub(corner[i], corner[0]));
    return nmm_vec2_add(corner[0], nmm_vec2_scale(1.0 / n, sum));
}

nmm_moments nmm_polygon_moments(int n, const nmm_vec2 *corner) {
    nmm_moments moments = {0};
    if (n == 0) return moments;
    // About the first corner: its own two edges drop out.
    double twice = 0;
    nmm_vec2 first = {0, 0};
    for (int i = 1; i + 1 < n; i++) {
        const nmm_vec2 a = nmm_vec2_sub(corner[i], corner[0]);
        const nmm_vec2 b = nmm_vec2_sub(corner[i + 1], corner[0]);
        const double J = accurate_cross(a, b);
        twice += J;
        first = nmm_vec2_add(first, nmm_vec2_scale(J, nmm_vec2_add(a, b)));
        moments.xx += J / 12 * (a.x * a.x + a.x * b.x + b.x * b.x);
        moments.yy += J / 12 * (a.y * a.y + a.y * b.y + b.y * b.y);
        moments.xy += J / 24 * (2 * a.x * a.y + a.x * b.y + b.x * a.y + 2 * b.x * b.y);
    }
    if (twice == 0) return (nmm_moments){.centre = mean_of(n, corner)};
    // To the centroid, by the parallel axis theorem, eq. (2.11).
    const nmm_vec2 c = nmm_vec2_scale(1 / (3 * twice), first);
    moments.area = twice / 2;
    moments.centre = nmm_vec2_add(corner[0], c);
    moments.xx -= moments.area * c.x * c.x;
    moments.xy -= moments.area * c.x * c.y;
    moments.yy -= moments.area * c.y * c.y;
    return moments;
}

static double binomial(int n, int k) {
    double value = 1;
    for (int i = 1; i <= k; i++)
        value = value * (n - k + i) / i;
    return value;
}

// Powers 0..8 of x.
static void fill_powers(double x, double power[9]) {
    power[0] = 1;
    for (int k = 1; k < 9; k++)
        power[k] = power[k - 1] * x;
}

// The double sum of eq. (2.12) for one edge a -> b, without the factor in front.
static double edge_term(nmm_vec2 a, nmm_vec2 b, int p, int q) {
    double ax[9], ay[9], bx[9], by[9];
    fill_powers(a.x, ax);
    fill_powers(a.y, ay);
    fill_powers(b.x, bx);
    fill_powers(b.y, by);
    double sum = 0;
    for (int k = 0; k <= p; k++) {
        for (int l = 0; l <= q; l++) {
            const double factor = binomial(k + l, l) * binomial(p + q - k - l, q - l);
            sum += factor * bx[k] * ax[p - k] * by[l] * ay[q - l];
        }
    }
    return accurate_cross(a, b) * sum;
}

double nmm_polygon_integral(int n, const nmm_vec2 *corner, nmm_vec2 origin, int p, int q) {
    NMM_ASSERT(p >= 0 && q >= 0 && p + q <= 8);
    double sum = 0;
    for (int i = 0; i < n; i++) {
        const nmm_vec2 a = nmm_vec2_sub(corner[i], origin);
        const nmm_vec2 b = nmm_vec2_sub(corner[i + 1 < n ? i + 1 : 0], origin);
        sum += edge_term(a, b, p, q);
    }
    return sum / ((p + q + 2.0) * (p + q + 1.0) * binomial(p + q, p));
}
