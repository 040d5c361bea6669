// SPDX-License-Identifier: MIT
//
// Exact predicates on integer points: crossing, rounded crossing, pixels, angles. Products are
// formed in 128 bits; with coordinates up to 2^40 nothing overflows (integer.h).

#include "integer.h"

bool nmm_isegment_cross(nmm_isegment s, nmm_isegment t) {
    const int ta = nmm_orientation(s.a, s.b, t.a), tb = nmm_orientation(s.a, s.b, t.b);
    if (ta * tb >= 0) return false;
    return nmm_orientation(t.a, t.b, s.a) * nmm_orientation(t.a, t.b, s.b) < 0;
}

// Largest integer that is not above n / d, d > 0.
static nmm_int128 divide_down(nmm_int128 n, nmm_int128 d) {
    const nmm_int128 quotient = n / d;
    return quotient * d > n ? quotient - 1 : quotient;
}

nmm_ipoint nmm_isegment_crossing(nmm_isegment s, nmm_isegment t) {
    // s.a + (n / d) (s.b - s.a), with n and d twice the areas over t's direction.
    const int64_t sx = s.b.x - s.a.x, sy = s.b.y - s.a.y;
    const int64_t tx = t.b.x - t.a.x, ty = t.b.y - t.a.y;
    nmm_int128 d = (nmm_int128)sx * ty - (nmm_int128)sy * tx;
    nmm_int128 n = (nmm_int128)(t.a.x - s.a.x) * ty - (nmm_int128)(t.a.y - s.a.y) * tx;
    NMM_ASSERT(d != 0);
    if (d < 0) {
        d = -d;
        n = -n;
    }
    const nmm_int128 x = divide_down(2 * n * sx + d, 2 * d);
    const nmm_int128 y = divide_down(2 * n * sy + d, 2 * d);
    return (nmm_ipoint){s.a.x + (int64_t)x, s.a.y + (int64_t)y};
}

bool nmm_isegment_meets_pixel(nmm_ipoint a, nmm_ipoint b, nmm_ipoint p) {
    // Separating axes x and y: ends are integers, so they are never on the pixel's border.
    if ((a.x < p.x && b.x < p.x) || (a.x > p.x && b.x > p.x)) return false;
    if ((a.y < p.y && b.y < p.y) || (a.y > p.y && b.y > p.y)) return false;
    // The segment's normal: twice the offset of p against the half width of the pixel.
    const int64_t dx = b.x - a.x, dy = b.y - a.y;
    const nmm_int128 offset = 2 * nmm_icross(a, b, p);
    const nmm_int128 reach = (nmm_int128)(dx < 0 ? -dx : dx) + (dy < 0 ? -dy : dy);
    if (offset > -reach && offset < reach) return true;
    if (offset != reach && offset != -reach) return false;
    // It only touches a corner; of the four only the lower left one belongs to the pixel:
    // (b - a) x (p - a) = (b - a) x (1/2, 1/2).
    return offset == (nmm_int128)dx - dy;
}

// 0: angle in [0, pi), 1: angle in [pi, 2 pi).
static int half_plane(nmm_ipoint o, nmm_ipoint a) {
    if (a.y != o.y) return a.y < o.y;
    return a.x < o.x;
}

int nmm_ipoint_compare_angle(nmm_ipoint o, nmm_ipoint a, nmm_ipoint b) {
    const int half_a = half_plane(o, a), half_b = half_plane(o, b);
    if (half_a != half_b) return half_a < half_b ? -1 : 1;
    return -nmm_orientation(o, a, b);
}

nmm_int128 nmm_ipolygon_area(int n, const nmm_ipoint *corner) {
    nmm_int128 sum = 0;
    for (int i = 1; i + 1 < n; i++)
        sum += nmm_icross(corner[0], corner[i], corner[i + 1]);
    return sum;
}

// Merge the sorted runs from[low, middle) and from[middle, high) into to[low, high).
static void merge_runs(const nmm_ipoint *from, nmm_ipoint *to, int low, int middle, int high) {
    int i = low, j = middle;
    for (int k = low; k < high; k++) {
        const bool left = i < middle && (j >= high || nmm_ipoint_compare(from[i], from[j]) <= 0);
        to[k] = left ? from[i++] : from[j++];
    }
}

nmm_ipoint *nmm_ipoint_sort(int n, nmm_ipoint *point, nmm_ipoint *spare) {
    for (int64_t run = 1; run < n; run *= 2) {
        for (int64_t low = 0; low < n; low += 2 * run) {
            const int64_t middle = low + run < n ? low + run : n;
            const int64_t high = low + 2 * run < n ? low + 2 * run : n;
            merge_runs(point, spare, (int)low, (int)middle, (int)high);
        }
        nmm_ipoint *swap = point;
        point = spare;
        spare = swap;
    }
    return point;
}
