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

// z = D^-1 r; terms of r.z. Groups are handed out one after the other, because the first thread
// comes late.
static void NAME(apply_blocks)(const nmm_solver *s) {
    const int n = s->n, n_group = nmm_groups_of(n);
    const REAL *inverse = s->ARRAYS.inverse, *r = s->ARRAYS.r;
    REAL *z = s->ARRAYS.z;
    const float *dense = s->dense;
    const double *scale = s->dense_scale;
    double *part = s->part;
    const nmm_iteration *state = s->state;
    PARALLEL_FOR_LATE
    for (int group = 0; group < n_group; group++) {
        if (state->stop != NMM_STOP_NONE) continue;
        const long at = 2 * (long)NMM_GROUP * group;
        NAME(apply_group)(inverse, dense, scale, group, NMM_GROUP, r + at, z + at);
        part[2 * (long)group] = NAME(dot_group)(r + at, z + at, NMM_GROUP_UNKNOWNS);
        part[2 * (long)group + 1] = 0;
    }
    JOIN;
}

// z = D^-1 r + P A^-1 P^T r, and r.z in sum[0]. One thread solves the coarse system while the
// others apply the blocks.
static void NAME(correct_coarse)(const nmm_solver *s) {
    NAME(restrict_residual)(s);
    nmm_iteration *state = s->state;
    const nmm_coarse *coarse = &s->coarse;
    SINGLE {
        if (state->stop == NMM_STOP_NONE) solve_coarse(coarse);
    }
    NAME(apply_blocks)(s);
    sum_chunks(s);
    const int n_chunk = chunks_of(nmm_groups_of(s->n));
    const double *chunk = s->chunk;
    SINGLE {
        if (state->stop == NMM_STOP_NONE) {
            double sum[2];
            add_chunks(chunk, n_chunk, sum);
            for (int i = 0; i < 3 * coarse->n_part; i++)
                sum[0] += coarse->load[i] * coarse->move[i];
            state->sum[0] = sum[0];
        }
    }
    NAME(prolong_move)(s);
}
