// SPDX-License-Identifier: MIT
//
// Between the entries of a file and 2x2 blocks. The pattern of the blocks is found by two bucket
// passes, by column and then by row, so that columns come out ascending without a sort; the values
// are then put in their places. Time and memory grow with the number of entries.

#include "linear.h"

#include <math.h>
#include <string.h>

void nmm_linear_destroy(nmm_context *context, nmm_linear *system) {
    nmm_release(context, &system->K.row_start);
    nmm_release(context, &system->K.col);
    nmm_release(context, &system->K.value);
    nmm_release(context, &system->K.diagonal);
    nmm_release(context, &system->f);
    nmm_release(context, &system->guess);
    nmm_release(context, &system->u);
    nmm_release(context, &system->place);
    nmm_release(context, &system->body);
    *system = (nmm_linear){0};
}

// --- Pattern

/// Scratch of the pattern: the block rows that have an entry in a block column, by column.
typedef struct bucket {
    long *start; // [n_row + 1]
    int *row;    // [start[n_row]] may repeat
    int *last;   // [n_row] column a row took last, -1: none
} bucket;

static void release_bucket(nmm_context *context, bucket *b) {
    nmm_release(context, &b->start);
    nmm_release(context, &b->row);
    nmm_release(context, &b->last);
}

// Each entry stands in both halves, each diagonal block is there.
static nmm_status fill_bucket(nmm_context *context, bucket *b, const nmm_coordinates *entries,
                              int n_row) {
    TRY(nmm_allocate(context, &b->start, (size_t)n_row + 2, sizeof(long)));
    TRY(nmm_allocate(context, &b->last, (size_t)n_row, sizeof(int)));
    long *next = b->start + 1; // becomes start when every column is filled
    for (int k = 0; k < entries->n; k++) {
        const int row = entries->entry[k].row / 2, column = entries->entry[k].column / 2;
        if (row == column) continue;
        next[row + 1] += 1;
        next[column + 1] += 1;
    }
    for (int c = 0; c < n_row; c++)
        next[c + 1] += next[c] + 1;
    TRY(nmm_allocate(context, &b->row, (size_t)next[n_row], sizeof(int)));
    for (int c = 0; c < n_row; c++)
        b->row[next[c]++] = c;
    for (int k = 0; k < entries->n; k++) {
        const int row = entries->entry[k].row / 2, column = entries->entry[k].column / 2;
        if (row == column) continue;
        b->row[next[column]++] = row;
        b->row[next[row]++] = column;
    }
    return NMM_OK;
}

// Give each row its columns in ascending order; without `col` they are only counted, in row_start.
static void spread_columns(const bucket *b, nmm_bsr *K, int *next) {
    for (int c = 0; c < K->n_row; c++)
        b->last[c] = -1;
    for (int c = 0; c < K->n_row; c++) {
        for (long k = b->start[c]; k < b->start[c + 1]; k++) {
            const int row = b->row[k];
            if (b->last[row] == c) continue;
            b->last[row] = c;
            if (K->col == NULL) {
                K->row_start[row + 1] += 1;
            } else {
                if (row == c) K->diagonal[c] = next[row];
                K->col[next[row]++] = c;
            }
        }
    }
}

static nmm_status make_pattern(nmm_context *context, nmm_bsr *K, const bucket *b) {
    TRY(nmm_allocate(context, &K->row_start, (size_t)K->n_row + 1, sizeof(int)));
    TRY(nmm_allocate(context, &K->diagonal, (size_t)K->n_row, sizeof(int)));
    spread_columns(b, K, NULL);
    for (int row = 0; row < K->n_row; row++)
        K->row_start[row + 1] += K->row_start[row];
    const size_t n_block = (size_t)K->row_start[K->n_row];
    int *next = NULL;
    TRY(nmm_allocate(context, &next, (size_t)K->n_row, sizeof(int)));
    memcpy(next, K->row_start, (size_t)K->n_row * sizeof(int));
    nmm_status status = nmm_allocate(context, &K->col, n_block, sizeof(int));
    if (status == NMM_OK) spread_columns(b, K, next);
    nmm_release(context, &next);
    TRY(status);
    return nmm_allocate(context, &K->value, n_block, 4 * sizeof(double));
}

static nmm_status build_pattern(nmm_context *context, nmm_bsr *K, const nmm_coordinates *entries) {
    bucket b = {0};
    K->n_row = entries->order / 2 + entries->order % 2;
    nmm_status status = fill_bucket(context, &b, entries, K->n_row);
    if (status == NMM_OK) status = make_pattern(context, K, &b);
    release_bucket(context, &b);
    return status;
}

// --- Values

static int find_block(const nmm_bsr *K, int row, int column) {
    int low = K->row_start[row], high = K->row_start[row + 1] - 1;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (K->col[middle] < column)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static nmm_status twice(nmm_context *context, const nmm_coordinates *entries, int k,
                        const char *path) {
    const nmm_coordinate *entry = &entries->entry[k];
    nmm_fail(context, NMM_ERROR_INPUT, "row %d, column %d is given a second time", entry->row + 1,
             entry->column + 1);
    if (entries->regular) {
        context->error.line = (int)nmm_min((double)(entries->first_line + k), 2147483647.0);
        context->error.column = 1;
        snprintf(context->error.file, sizeof context->error.file, "%s", path);
    }
    return NMM_ERROR_INPUT;
}

// `given` [blocks]: bit 2 i + j says that (i, j) of a block is there already.
static nmm_status put_values(nmm_context *context, nmm_linear *system,
                             const nmm_coordinates *entries, unsigned char *given,
                             const char *path) {
    for (int k = 0; k < entries->n; k++) {
        const nmm_coordinate e = entries->entry[k];
        const int at = find_block(&system->K, e.row / 2, e.column / 2);
        const int part = 2 * (e.row % 2) + e.column % 2;
        if (given[at] >> part & 1) return twice(context, entries, k, path);
        given[at] |= (unsigned char)(1 << part);
        system->K.value[4 * (long)at + part] = e.value;
        system->entries += 1;
        if (!entries->symmetric || e.row == e.column) continue;
        const int mirror = find_block(&system->K, e.column / 2, e.row / 2);
        const int turned = 2 * (e.column % 2) + e.row % 2;
        system->K.value[4 * (long)mirror + turned] = e.value;
        system->entries += 1;
    }
    return NMM_OK;
}

// --- Symmetry

// Do a and b differ by more than rounding, seen from the diagonal entries p and q? Rows that are
// gathered one by one differ from their mirrors in the last digits of what they were summed from.
static bool differ(double a, double b, double p, double q) {
    return fabs(a - b) > 1e-12 * (fabs(a) + fabs(b)) + 1e-13 * sqrt(fabs(p)) * sqrt(fabs(q));
}

/// Two entries that mirror each other and differ.
typedef struct difference {
    int row, column; // from 0, row < column; row -1: none
    double upper, lower;
} difference;

// Compare block k of `row` with its mirror; keep the first difference in the row above the other.
static void compare_blocks(const nmm_bsr *K, int row, const int at[2], difference *first) {
    const int column = K->col[at[0]];
    const double *upper = K->value + 4 * (long)at[0], *lower = K->value + 4 * (long)at[1];
    const double *p = K->value + 4 * (long)K->diagonal[row];
    const double *q = K->value + 4 * (long)K->diagonal[column];
    for (int k = 0; k < 4; k++) {
        const int i = k / 2, j = k % 2, x = 2 * row + i, y = 2 * column + j;
        if (x >= y || !differ(upper[k], lower[2 * j + i], p[3 * i], q[3 * j])) continue;
        if (first->row >= 0 && first->row <= x) continue;
        *first = (difference){x, y, upper[k], lower[2 * j + i]};
    }
}

// The rows are walked downwards, so the mirrors of a row's blocks come in order: one cursor a row.
static void find_difference(const nmm_bsr *K, int *next, difference *first) {
    first->row = -1;
    memcpy(next, K->row_start, (size_t)K->n_row * sizeof(int));
    for (int row = 0; row < K->n_row && first->row < 0; row++) {
        for (int k = K->diagonal[row]; k < K->row_start[row + 1]; k++) {
            const int mirror = next[K->col[k]]++;
            NMM_ASSERT(K->col[mirror] == row);
            compare_blocks(K, row, (const int[]){k, mirror}, first);
        }
    }
}

static nmm_status check_symmetry(nmm_context *context, const nmm_bsr *K, const char *path) {
    int *next = NULL;
    difference first;
    TRY(nmm_allocate(context, &next, (size_t)K->n_row, sizeof(int)));
    find_difference(K, next, &first);
    nmm_release(context, &next);
    if (first.row < 0) return NMM_OK;
    return nmm_fail(context, NMM_ERROR_INPUT,
                    "%s: the matrix must be symmetric: row %d, column %d is %.17g, but row %d, "
                    "column %d is %.17g",
                    path, first.row + 1, first.column + 1, first.upper, first.column + 1,
                    first.row + 1, first.lower);
}

// --- Reading

static nmm_status take_values(nmm_context *context, nmm_linear *system,
                              const nmm_coordinates *entries, const char *path) {
    nmm_bsr *K = &system->K;
    unsigned char *given = NULL;
    TRY(nmm_allocate(context, &given, (size_t)K->row_start[K->n_row], 1));
    const nmm_status status = put_values(context, system, entries, given, path);
    nmm_release(context, &given);
    TRY(status);
    // The unknown that makes an odd order even.
    if (system->order % 2 != 0) K->value[4 * (long)K->diagonal[K->n_row - 1] + 3] = 1;
    return entries->symmetric ? NMM_OK : check_symmetry(context, K, path);
}

nmm_status nmm_linear_read_matrix(nmm_context *context, nmm_linear *system, const char *path) {
    nmm_coordinates entries = {0};
    nmm_status status = nmm_coordinates_read(context, &entries, path);
    if (status == NMM_OK) {
        system->order = entries.order;
        status = build_pattern(context, &system->K, &entries);
    }
    if (status == NMM_OK) status = take_values(context, system, &entries, path);
    nmm_coordinates_destroy(context, &entries);
    return status;
}

// --- Writing

static bool same_bits(double a, double b) {
    uint64_t x, y;
    memcpy(&x, &a, sizeof x);
    memcpy(&y, &b, sizeof y);
    return x == y;
}

// In a matrix with a symmetric pattern.
static bool same_halves(const nmm_bsr *K) {
    for (int row = 0; row < K->n_row; row++) {
        for (int k = K->row_start[row]; k <= K->diagonal[row]; k++) {
            const double *a = K->value + 4 * (long)k;
            const double *b = K->value + 4 * (long)find_block(K, K->col[k], row);
            const double turned[4] = {b[0], b[2], b[1], b[3]};
            for (int i = 0; i < 4; i++)
                if (!same_bits(a[i], turned[i])) return false;
        }
    }
    return true;
}

static void write_row(nmm_replacement *file, const nmm_bsr *K, int x, bool lower) {
    const int row = x / 2;
    for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++) {
        for (int j = 0; j < 2; j++) {
            const int y = 2 * K->col[k] + j;
            if (lower && y > x) return;
            nmm_market_entry(file, x, y, K->value[4 * (long)k + 2 * (x % 2) + j]);
        }
    }
}

nmm_status nmm_linear_write_matrix(nmm_context *context, const nmm_bsr *K, const char *path,
                                   const char *comment) {
    const bool symmetric = same_halves(K);
    const long n = 2 * (long)K->n_row, n_entry = 4 * (long)K->row_start[K->n_row];
    const nmm_market_head head = {.coordinate = true,
                                  .symmetric = symmetric,
                                  .n_row = n,
                                  .n_column = n,
                                  .n_entry = symmetric ? (n_entry + n) / 2 : n_entry,
                                  .comment = comment};
    nmm_replacement file = {0};
    nmm_status status = nmm_market_open(context, &file, path, &head);
    for (int x = 0; status == NMM_OK && x < n; x++)
        write_row(&file, K, x, symmetric);
    if (status == NMM_OK) status = nmm_replacement_commit(&file);
    nmm_replacement_drop(&file);
    return status;
}

nmm_status nmm_linear_write_vector(nmm_context *context, int n, const double *x, const char *path,
                                   const char *comment) {
    const nmm_market_head head = {.n_row = n, .n_column = 1, .comment = comment};
    nmm_replacement file = {0};
    nmm_status status = nmm_market_open(context, &file, path, &head);
    for (int i = 0; status == NMM_OK && i < n; i++)
        nmm_market_value(&file, x[i]);
    if (status == NMM_OK) status = nmm_replacement_commit(&file);
    nmm_replacement_drop(&file);
    return status;
}
