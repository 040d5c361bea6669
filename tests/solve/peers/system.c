// SPDX-License-Identifier: MIT
//
// System files of the benchmark: a head of fixed size, then the arrays one after the other, in the
// machine's own number format, as they are only kept in a build folder.

#include "bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAGIC "nmmsys2"

typedef struct head {
    char magic[8];
    int n_row, n_block, n_contact, n_closed;
    double dt, courant;
} head;

static void stop(const char *path, const char *why) {
    fprintf(stderr, "%s: %s\n", path, why);
    exit(1);
}

// On cache lines of their own, as the arrays of a run are.
static void *take(FILE *file, const char *path, size_t count, size_t size) {
    void *array = aligned_alloc(64, (count * size / 64 + 1) * 64);
    if (array == NULL || fread(array, size, count, file) != count) stop(path, "cannot be read");
    return array;
}

void bench_system_read(bench_system *s, const char *path) {
    FILE *file = fopen(path, "rb");
    head h;
    if (file == NULL || fread(&h, sizeof h, 1, file) != 1) stop(path, "cannot be read");
    if (memcmp(h.magic, MAGIC, sizeof h.magic) != 0) stop(path, "no system file");
    *s = (bench_system){.n_row = h.n_row,
                        .n_block = h.n_block,
                        .n_contact = h.n_contact,
                        .n_closed = h.n_closed,
                        .dt = h.dt,
                        .courant = h.courant};
    const size_t n = (size_t)h.n_row, m = (size_t)h.n_block;
    s->row_start = take(file, path, n + 1, sizeof(int));
    s->col = take(file, path, m, sizeof(int));
    s->diagonal = take(file, path, n, sizeof(int));
    s->value = take(file, path, m, 4 * sizeof(double));
    s->f = take(file, path, n, 2 * sizeof(double));
    s->place = take(file, path, n, 2 * sizeof(double));
    s->body = take(file, path, n, sizeof(int));
    fclose(file);
}

void bench_system_write(const bench_system *s, const char *path) {
    FILE *file = fopen(path, "wb");
    if (file == NULL) stop(path, "cannot be written");
    head h = {.n_row = s->n_row,
              .n_block = s->n_block,
              .n_contact = s->n_contact,
              .n_closed = s->n_closed,
              .dt = s->dt,
              .courant = s->courant};
    memcpy(h.magic, MAGIC, sizeof h.magic);
    const size_t n = (size_t)s->n_row, m = (size_t)s->n_block;
    fwrite(&h, sizeof h, 1, file);
    fwrite(s->row_start, sizeof(int), n + 1, file);
    fwrite(s->col, sizeof(int), m, file);
    fwrite(s->diagonal, sizeof(int), n, file);
    fwrite(s->value, 4 * sizeof(double), m, file);
    fwrite(s->f, 2 * sizeof(double), n, file);
    fwrite(s->place, 2 * sizeof(double), n, file);
    fwrite(s->body, sizeof(int), n, file);
    if (ferror(file) || fclose(file) != 0) stop(path, "cannot be written");
}

void bench_system_release(bench_system *s) {
    free(s->row_start);
    free(s->col);
    free(s->diagonal);
    free(s->value);
    free(s->f);
    free(s->place);
    free(s->body);
    *s = (bench_system){0};
}

double bench_true_residual(const bench_system *s, const double *u) {
    long double left = 0, all = 0;
    for (int row = 0; row < s->n_row; row++) {
        long double r[2] = {s->f[2 * row], s->f[2 * row + 1]};
        all += r[0] * r[0] + r[1] * r[1];
        for (int k = s->row_start[row]; k < s->row_start[row + 1]; k++) {
            const double *v = s->value + 4 * (long)k, *x = u + 2 * (long)s->col[k];
            r[0] -= (long double)v[0] * x[0] + (long double)v[1] * x[1];
            r[1] -= (long double)v[2] * x[0] + (long double)v[3] * x[1];
        }
        left += r[0] * r[0] + r[1] * r[1];
    }
    return (double)sqrtl(left / all);
}
