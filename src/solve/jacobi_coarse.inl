// SPDX-License-Identifier: MIT
//
// The coarse correction of conjugate gradients: rigid motions of parts of bodies, eq. (6.11). On
// the host only; the words are those of jacobi_kernels.inl, which includes this for each precision.

// load = P^T r, one part after the other.
static void NAME(restrict_residual)(const nmm_solver *s) {
    const int n_part = s->coarse.n_part;
    const int *start = s->coarse.start, *rows = s->coarse.row;
    const double *arm = s->coarse.arm;
    double *load = s->coarse.load;
    const REAL *r = s->ARRAYS.r;
    const nmm_iteration *state = s->state;
    PARALLEL_FOR
    for (int p = 0; p < n_part; p++) {
        if (state->stop != NMM_STOP_NONE) continue;
        double x = 0, y = 0, turn = 0;
        for (int k = start[p]; k < start[p + 1]; k++) {
            const long i = 2 * (long)rows[k];
            const double rx = (double)r[i], ry = (double)r[i + 1];
            x += rx;
            y += ry;
            turn += ry * arm[i] - rx * arm[i + 1];
        }
        load[3 * (long)p] = x;
        load[3 * (long)p + 1] = y;
        load[3 * (long)p + 2] = turn;
    }
    JOIN;
}

// z += P move.
static void NAME(prolong_move)(const nmm_solver *s) {
    const int n = s->n;
    const int *part_of = s->coarse.part;
    const double *arm = s->coarse.arm, *move = s->coarse.move;
    REAL *z = s->ARRAYS.z;
    const nmm_iteration *state = s->state;
    PARALLEL_FOR
    for (int row = 0; row < n; row++) {
        if (state->stop != NMM_STOP_NONE || part_of[row] < 0) continue;
        const double *m = move + 3 * (long)part_of[row];
        const long i = 2 * (long)row;
        z[i] += (REAL)(m[0] - m[2] * arm[i + 1]);
        z[i + 1] += (REAL)(m[1] + m[2] * arm[i]);
    }
    JOIN;
}

// z += P A^-1 P^T r, and what that adds to r.z.
static void NAME(correct_coarse)(const nmm_solver *s) {
    NAME(restrict_residual)(s);
    nmm_iteration *state = s->state;
    SINGLE {
        if (state->stop == NMM_STOP_NONE) {
            solve_coarse(&s->coarse);
            double sum = 0;
            for (int i = 0; i < 3 * s->coarse.n_part; i++)
                sum += s->coarse.load[i] * s->coarse.move[i];
            state->sum[0] += sum;
        }
    }
    JOIN;
    NAME(prolong_move)(s);
}
