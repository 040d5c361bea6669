// SPDX-License-Identifier: MIT
//
// The scalars of the Jacobi family: sums over groups and chunks, steps and turns of conjugate
// gradients, stops. The same words as in jacobi_kernels.inl, which is included after this.

// Part of the limit at which the recursion of pcg stops, so that the true residual passes as well.
#define RECURSION_MARGIN 0.9

static inline int chunks_of(int n_group) {
    return (n_group + NMM_SOLVE_CHUNK - 1) / NMM_SOLVE_CHUNK;
}

// Sums of the terms over each chunk.
static void sum_chunks(const nmm_solver *s) {
    const int n_group = nmm_groups_of(s->n), n_chunk = chunks_of(n_group);
    const double *part = s->part;
    double *chunk = s->chunk;
    nmm_iteration *state = s->state;
    PARALLEL_FOR
    for (int k = 0; k < n_chunk; k++) {
        const int begin = k * NMM_SOLVE_CHUNK;
        const int end = begin + NMM_SOLVE_CHUNK < n_group ? begin + NMM_SOLVE_CHUNK : n_group;
        double sum0 = 0, sum1 = 0;
        for (int group = begin; group < end; group++) {
            sum0 += part[2 * (long)group];
            sum1 += part[2 * (long)group + 1];
        }
        chunk[2 * (long)k] = sum0;
        chunk[2 * (long)k + 1] = sum1;
        if (k == 0) state->on_device = ON_DEVICE;
    }
    JOIN;
}

static inline void add_chunks(const double *chunk, int n_chunk, double sum[2]) {
    double sum0 = 0, sum1 = 0;
    for (int k = 0; k < n_chunk; k++) {
        sum0 += chunk[2 * (long)k];
        sum1 += chunk[2 * (long)k + 1];
    }
    sum[0] = sum0;
    sum[1] = sum1;
}

static inline int is_finite(double x) {
    return 0 * x == 0;
}

// The two sums.
static void total(const nmm_solver *s) {
    const int n_chunk = chunks_of(nmm_groups_of(s->n));
    const double *chunk = s->chunk;
    nmm_iteration *state = s->state;
    SINGLE {
        add_chunks(chunk, n_chunk, state->sum);
    }
    JOIN;
}

// The recursion of conjugate gradients begins from r.z and r.r.
static void begin_recursion(const nmm_solver *s) {
    const int n_chunk = chunks_of(nmm_groups_of(s->n));
    const double *chunk = s->chunk;
    nmm_iteration *state = s->state;
    SINGLE {
        add_chunks(chunk, n_chunk, state->sum);
        state->rho = 0;
        state->stop = NMM_STOP_NONE;
        if (state->sum[1] <= state->limit) state->stop = NMM_STOP_SMALL;
        if (!is_finite(state->sum[0] + state->sum[1])) state->stop = NMM_STOP_BROKEN;
    }
    JOIN;
}

// beta = new rho / rho, eq. (6.7); none before the first direction.
static void find_turn(const nmm_solver *s) {
    nmm_iteration *state = s->state;
    SINGLE {
        if (state->stop == NMM_STOP_NONE) {
            state->beta = state->rho > 0 ? state->sum[0] / state->rho : 0;
            state->rho = state->sum[0];
            const int before = state->iterations - 1;
            if (before >= 0 && before < NMM_LANCZOS) state->history[before][1] = state->beta;
            if (!is_finite(state->beta)) state->stop = NMM_STOP_BROKEN;
        }
    }
    JOIN;
}

// alpha = rho / p.q, eq. (6.6).
static void find_step(const nmm_solver *s) {
    const int n_chunk = chunks_of(nmm_groups_of(s->n));
    const double *chunk = s->chunk;
    nmm_iteration *state = s->state;
    SINGLE {
        if (state->stop == NMM_STOP_NONE) {
            add_chunks(chunk, n_chunk, state->sum);
            const double curvature = state->sum[0];
            if (!(curvature > 0)) state->stop = NMM_STOP_CURVATURE;
            if (!is_finite(curvature)) state->stop = NMM_STOP_BROKEN;
            state->alpha = state->rho / curvature;
        }
    }
    JOIN;
}

// Is the residual small enough?
static void look_at_residual(const nmm_solver *s) {
    const int n_chunk = chunks_of(nmm_groups_of(s->n));
    const double *chunk = s->chunk;
    nmm_iteration *state = s->state;
    SINGLE {
        if (state->stop == NMM_STOP_NONE) {
            add_chunks(chunk, n_chunk, state->sum);
            if (state->iterations < NMM_LANCZOS) {
                state->history[state->iterations][0] = state->alpha;
                state->history[state->iterations][1] = 0;
            }
            state->iterations += 1;
            const double margin = RECURSION_MARGIN * RECURSION_MARGIN;
            if (state->sum[1] <= margin * state->limit) state->stop = NMM_STOP_SMALL;
            if (!is_finite(state->sum[0] + state->sum[1])) state->stop = NMM_STOP_BROKEN;
        }
    }
    JOIN;
}
