// SPDX-License-Identifier: MIT
//
// Chebyshev's weights by the three-term recursion, eq. (6.12). A residual that falls slower than
// the bounds allow, from the recursion's start to now, has a part outside of them, and tells where:
// the bounds are corrected, eq. (6.13). From window to window it may well grow, because each part
// swings. Only square roots, so that the bits do not depend on a mathematics library.

#include "sweeps.h"

#include <math.h>

// Sweeps between two judgements.
#define WINDOW 32

// Windows in a row that gain nothing: rounding has the last word.
#define IDLE_WINDOWS 6

// Change of the residual in a window, as a part of it, that is no change: what is left cannot be
// solved. The slowest part that converges changes more under a fixed damping, and swings through
// more under Chebyshev's weights.
#define STILL 1e-12
#define STILL_SWING 1e-9

// Where r.D^-1 r has grown by this factor there is no way back. |r| may grow as much for a while
// where the scales of rows lie far apart.
#define BEYOND_ALL_BOUNDS 1e20

// Growth of r.D^-1 r that only an eigenvalue above the bounds can cause, rounding cannot.
#define GROWTH 4

// The smallest eigenvalue is never taken for less than this part of the largest.
#define SMALLEST 1e-12

void plan_start(sweeps *plan, double norm, double weighted) {
    plan->rho = 0;
    plan->began = weighted;
    plan->n_since = 0;
    plan->lowest = weighted;
    plan->largest = BEYOND_ALL_BOUNDS * weighted;
    plan->least = norm;
    plan->mark = norm;
    plan->gained = false;
    plan->n_window = 0;
    plan->n_idle = 0;
    plan->n_still = 0;
}

static void next_weights(sweeps *plan, double weight[2]) {
    const double middle = 0.5 * (plan->bounds[1] + plan->bounds[0]);
    const double radius = 0.5 * (plan->bounds[1] - plan->bounds[0]);
    if (plan->rho == 0) {
        plan->rho = radius / middle;
        weight[0] = 0;
        weight[1] = 1 / middle;
        return;
    }
    const double next = 1 / (2 * middle / radius - plan->rho);
    weight[0] = next * plan->rho;
    weight[1] = 2 * next / radius;
    plan->rho = next;
}

void plan_batch(sweeps *plan, int n, double (*weight)[2]) {
    for (int k = 0; k < n; k++) {
        weight[k][0] = 0;
        weight[k][1] = plan->damping;
        if (plan->chebyshev) next_weights(plan, weight[k]);
    }
    plan->n_window += n;
    plan->n_since += n;
}

static double power(double x, int n) {
    double result = 1;
    for (; n > 0; n /= 2, x *= x)
        if (n % 2 == 1) result *= x;
    return result;
}

// The y >= 1 for which (y^n + y^-n) / 2, Chebyshev's polynomial of (y + 1/y) / 2, is `value`.
static double root_of_chebyshev(double value, int n) {
    const double wanted = value * (1 + sqrt(1 - 1 / value / value));
    double low = 1, high = 2;
    while (power(high, n) < wanted)
        high *= 2;
    for (int round = 0; round < 50; round++) {
        const double middle = 0.5 * (low + high);
        if (power(middle, n) < wanted) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return high;
}

// Bounds that explain the progress since the recursion began, where those in use do not.
static void correct_bounds(sweeps *plan, double weighted) {
    const double middle = 0.5 * (plan->bounds[1] + plan->bounds[0]);
    const double radius = 0.5 * (plan->bounds[1] - plan->bounds[0]);
    const double ratio = middle / radius;
    const double fall = power(ratio - sqrt(ratio * ratio - 1), plan->n_since);
    // What the square root of r.D^-1 r must have come down to, and what it has.
    const double bound = 2 * fall / (1 + fall * fall), had = sqrt(weighted / plan->began);
    const bool grown = weighted > plan->began;
    // A part in a hundred million would hide behind rounding.
    const bool too_long = bound < 1e-16;
    if (had * had > bound && (!grown || weighted > GROWTH * plan->began) && !too_long) {
        const double y = root_of_chebyshev(nmm_max(had / bound, 1), plan->n_since);
        const double distance = 0.5 * (y + 1 / y) * radius;
        if (grown) {
            plan->bounds[1] = 1.1 * (middle + distance);
        } else {
            plan->bounds[0] = nmm_max(0.8 * (middle - distance), SMALLEST * plan->bounds[1]);
        }
    } else if (!too_long) {
        return;
    }
    plan->rho = 0;
    plan->began = weighted;
    plan->n_since = 0;
}

sweeps_verdict plan_judge(sweeps *plan, double norm, double weighted) {
    if (!(weighted <= plan->largest && norm < INFINITY)) return SWEEPS_DIVERGE;
    // For a fixed damping r.D^-1 r is a sum of powers of the number of sweeps, which is convex:
    // once it has grown, it grows for ever.
    if (!plan->chebyshev && !(weighted <= 2 * plan->lowest)) return SWEEPS_DIVERGE;
    // |r| may grow for a while under a fixed damping that converges; r.D^-1 r may not.
    if (plan->chebyshev ? norm < plan->least : weighted < plan->lowest) plan->gained = true;
    plan->lowest = nmm_min(plan->lowest, weighted);
    plan->least = nmm_min(plan->least, norm);
    if (plan->n_window < WINDOW) return SWEEPS_GO_ON;
    plan->n_idle = plan->gained ? 0 : plan->n_idle + 1;
    const double still = (plan->chebyshev ? STILL_SWING : STILL) * norm;
    plan->n_still = fabs(norm - plan->mark) <= still ? plan->n_still + 1 : 0;
    if (plan->chebyshev) correct_bounds(plan, weighted);
    plan->mark = norm;
    plan->gained = false;
    plan->n_window = 0;
    if (plan->n_still == IDLE_WINDOWS) return SWEEPS_STAGNATE;
    if (plan->n_idle < IDLE_WINDOWS) return SWEEPS_GO_ON;
    plan->n_idle = 0;
    return plan->chebyshev ? SWEEPS_DOUBT : SWEEPS_STAGNATE;
}
