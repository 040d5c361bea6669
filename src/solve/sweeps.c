// SPDX-License-Identifier: MIT
//
// Chebyshev's weights by the three-term recursion, eq. (6.12). A residual that falls slower than
// the bounds allow has a part outside of them, and tells where: the bounds are corrected, eq.
// (6.13). Only square roots, so that the bits do not depend on a mathematics library.

#include "sweeps.h"

#include <math.h>

// Sweeps over which progress is measured: 2^LOG_WINDOW.
#define LOG_WINDOW 5
#define WINDOW 32

// Windows in a row that gain nothing: rounding has the last word.
#define IDLE_WINDOWS 6

// A residual that has grown by this factor has no way back.
#define BEYOND_ALL_BOUNDS 1e10

// The smallest eigenvalue is never taken for less than this part of the largest.
#define SMALLEST 1e-12

void plan_start(sweeps *plan, double norm, double weighted) {
    plan->rho = 0;
    plan->lowest = weighted;
    plan->largest = BEYOND_ALL_BOUNDS * norm;
    plan->mark = norm;
    plan->n_window = 0;
    plan->n_idle = 0;
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
}

// After a window in which the residual changed by `factor`: bounds that explain it, where those in
// use do not.
static void correct_bounds(sweeps *plan, double factor) {
    const double middle = 0.5 * (plan->bounds[1] + plan->bounds[0]);
    const double radius = 0.5 * (plan->bounds[1] - plan->bounds[0]);
    const double ratio = middle / radius;
    const double wanted = ratio - sqrt(ratio * ratio - 1);
    double had = factor;
    for (int k = 0; k < LOG_WINDOW; k++)
        had = sqrt(had);
    if (had * had <= wanted) return;
    // An eigenvalue at distance x radius from the middle grows by w = x + sqrt(x x - 1) per sweep.
    const double w = had / wanted;
    const double distance = 0.5 * (w + 1 / w) * radius;
    if (had < 1) {
        plan->bounds[0] = nmm_max(0.8 * (middle - distance), SMALLEST * plan->bounds[1]);
    } else {
        plan->bounds[1] = 1.1 * (middle + distance);
    }
    plan->rho = 0;
}

sweeps_verdict plan_judge(sweeps *plan, double norm, double weighted) {
    if (!(norm <= plan->largest)) return SWEEPS_DIVERGE;
    // For a fixed damping r.D^-1 r is a sum of powers of the number of sweeps, which is convex:
    // once it has grown, it grows for ever.
    if (!plan->chebyshev && !(weighted <= 2 * plan->lowest)) return SWEEPS_DIVERGE;
    plan->lowest = nmm_min(plan->lowest, weighted);
    if (plan->n_window < WINDOW) return SWEEPS_GO_ON;
    plan->n_idle = norm < plan->mark ? 0 : plan->n_idle + 1;
    if (plan->chebyshev) correct_bounds(plan, norm / plan->mark);
    plan->mark = norm;
    plan->n_window = 0;
    return plan->n_idle < IDLE_WINDOWS ? SWEEPS_GO_ON : SWEEPS_STAGNATE;
}
