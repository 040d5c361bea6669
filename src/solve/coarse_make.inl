// SPDX-License-Identifier: MIT
//
// The coarse matrix and its Cholesky factor; compiled once for each kind of processor.

// A pivot below this part of its diagonal: the motion moves nothing that others do not.
#define IDLE_PIVOT 1e-10

// Part J's motion of row j, projected on part I's motion of row i, eq. (6.11).
static void project_block(const double *v, const double *arm_i, const double *arm_j,
                          double a[3][3]) {
    for (int x = 0; x < 2; x++) {
        a[x][0] = v[2 * x];
        a[x][1] = v[2 * x + 1];
        a[x][2] = v[2 * x + 1] * arm_j[0] - v[2 * x] * arm_j[1];
    }
    for (int k = 0; k < 3; k++)
        a[2][k] = a[1][k] * arm_i[0] - a[0][k] * arm_i[1];
}

// Rows of the projected matrix for one part; the diagonal into c->inverse.
static void project_part(nmm_coarse *c, const nmm_coarse_source *s, int p) {
    for (int r = 3 * p; r < 3 * p + 3; r++) {
        memset(c->factor + c->offset[r] + c->first[r], 0,
               (size_t)(r - c->first[r]) * sizeof(double));
        c->inverse[r] = 0;
    }
    for (int k = c->start[p]; k < c->start[p + 1]; k++) {
        const int i = c->row[k];
        for (int e = s->row_start[i]; e < s->row_start[i + 1]; e++) {
            const int j = s->col[e], q = c->part[j];
            if (q < 0 || q > p) continue;
            double a[3][3];
            project_block(s->value + 4 * (long)e, c->arm + 2 * (long)i, c->arm + 2 * (long)j, a);
            for (int x = 0; x < 3; x++) {
                double *row = c->factor + c->offset[3 * p + x] + 3 * q;
                const int n = q < p ? 3 : x;
                for (int y = 0; y < n; y++)
                    row[y] += a[x][y];
                if (q == p) c->inverse[3 * p + x] += a[x][x];
            }
        }
    }
}

// The rows of the factor that belong to part p, all beginning at the same column `first`.
typedef struct part_rows {
    double *row[3]; // entry of column j at row[x][j]
    int first;
} part_rows;

static part_rows rows_of(const nmm_coarse *c, int p) {
    part_rows rows = {.first = c->first[3 * (long)p]};
    for (int x = 0; x < 3; x++)
        rows.row[x] = c->factor + c->offset[3 * (long)p + x];
    return rows;
}

// sum[x][y] = row x of a . row y of b over columns begin .. end - 1: nine sums side by side, four
// lanes each.
static void multiply_rows(const part_rows *a, const part_rows *b, int begin, int end,
                          double sum[3][3]) {
    wide_lanes lanes[3][3] = {{{0}}};
    int k = begin;
    for (; k + 4 <= end; k += 4) {
        wide_lanes u[3], v[3];
        for (int x = 0; x < 3; x++) {
            memcpy(&u[x], a->row[x] + k, sizeof u[x]);
            memcpy(&v[x], b->row[x] + k, sizeof v[x]);
        }
        for (int x = 0; x < 3; x++)
            for (int y = 0; y < 3; y++)
                lanes[x][y] += u[x] * v[y];
    }
    for (int x = 0; x < 3; x++) {
        for (int y = 0; y < 3; y++) {
            const wide_lanes l = lanes[x][y];
            sum[x][y] = (l[0] + l[1]) + (l[2] + l[3]);
            for (int rest = k; rest < end; rest++)
                sum[x][y] += a->row[x][rest] * b->row[y][rest];
        }
    }
}

// The diagonal block of a part: its three rows one after the other.
static void factorise_part(nmm_coarse *c, int p, const part_rows *rows) {
    const int i = 3 * p;
    double sum[3][3];
    multiply_rows(rows, rows, rows->first, i, sum);
    for (int x = 0; x < 3; x++) {
        double square = sum[x][x];
        for (int y = 0; y < x; y++) {
            double entry = rows->row[x][i + y] - sum[x][y];
            for (int k = 0; k < y; k++)
                entry -= rows->row[x][i + k] * rows->row[y][i + k];
            entry *= c->inverse[i + y];
            rows->row[x][i + y] = entry;
            square += entry * entry;
        }
        const double diagonal = c->inverse[i + x], pivot = diagonal - square;
        c->inverse[i + x] = pivot > IDLE_PIVOT * diagonal ? 1 / sqrt(pivot) : 0;
    }
}

static void factorise(nmm_coarse *c) {
    for (int p = 0; p < c->n_part; p++) {
        const part_rows rows = rows_of(c, p);
        for (int q = rows.first / 3; q < p; q++) {
            const part_rows other = rows_of(c, q);
            const int j = 3 * q;
            double sum[3][3];
            multiply_rows(&rows, &other, nmm_max_int(rows.first, other.first), j, sum);
            for (int x = 0; x < 3; x++) {
                for (int y = 0; y < 3; y++) {
                    double entry = rows.row[x][j + y] - sum[x][y];
                    for (int k = 0; k < y; k++)
                        entry -= rows.row[x][j + k] * other.row[y][j + k];
                    rows.row[x][j + y] = entry * c->inverse[j + y];
                }
            }
        }
        factorise_part(c, p, &rows);
    }
}

// A power of two that brings the largest number on the factor's diagonal next to 1.
static double unit_of_factor(const nmm_coarse *c) {
    double least = INFINITY;
    for (int i = 0; i < 3 * c->n_part; i++)
        if (c->inverse[i] > 0) least = nmm_min(least, c->inverse[i]);
    int exponent = 0;
    if (least < INFINITY) frexp(least, &exponent);
    return ldexp(1, exponent);
}

static void make_coarse(nmm_coarse *coarse, const nmm_coarse_source *source) {
    const int n_part = coarse->n_part, n_thread = source->n_thread;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1)
    for (int p = 0; p < n_part; p++)
        project_part(coarse, source, p);
    factorise(coarse);
    // In this unit the factor is within float32, whatever the scale of the matrix.
    const double unit = unit_of_factor(coarse);
    coarse->unit = unit;
    for (int i = 0; i < 3 * n_part; i++)
        coarse->inverse[i] /= unit;
    const long n_factor = coarse->n_factor;
    const double *factor = coarse->factor;
    float *lower = coarse->lower;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1)
    for (long k = 0; k < n_factor; k++)
        lower[k] = (float)(unit * factor[k]);
}
