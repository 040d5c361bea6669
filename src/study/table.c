// SPDX-License-Identifier: MIT
//
// The table of an experiment: rows, words, notes; series, medians and exponents out of it; the CSV
// file.

#include "bench.h"

#include "io.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

// --- Words

nmm_status nmm_bench_keep(nmm_bench *bench, const char **words, const char *text) {
    char *copy = NULL;
    TRY(nmm_arena_text(&bench->context, &bench->arena, &copy, text, strlen(text)));
    *words = copy;
    return NMM_OK;
}

nmm_status nmm_bench_words(nmm_bench *bench, const char **words, const char *format, ...) {
    char text[4096];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    return nmm_bench_keep(bench, words, text);
}

bool nmm_bench_goes_on(nmm_bench *bench, const char *format, ...) {
    char text[256];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    if (bench->def.report != NULL && bench->def.report(bench->def.user, bench, text, -1) != 0)
        bench->stopped = true;
    return !bench->stopped;
}

nmm_status nmm_bench_remark(nmm_bench *bench, const char *format, ...) {
    char text[1024];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    TRY(nmm_grow(&bench->context, &bench->note, &bench->note_room, bench->n_note + 1,
                 sizeof *bench->note));
    TRY(nmm_bench_keep(bench, &bench->note[bench->n_note], text));
    bench->n_note += 1;
    return NMM_OK;
}

// --- Rows

nmm_status nmm_bench_add(nmm_bench *bench) {
    const int n = (bench->n_row + 1) * bench->n_column;
    TRY(nmm_grow(&bench->context, &bench->cell, &bench->cell_room, n, sizeof *bench->cell));
    for (int i = bench->n_row * bench->n_column; i < n; i++)
        bench->cell[i] = (nmm_bench_cell){.number = NAN};
    bench->n_row += 1;
    return NMM_OK;
}

nmm_bench_cell *nmm_bench_cell_of(nmm_bench *bench, int row, int column) {
    NMM_ASSERT(row >= 0 && row < bench->n_row && column < bench->n_column);
    return &bench->cell[(long)row * bench->n_column + column];
}

static nmm_bench_cell *last_cell(nmm_bench *bench, int column) {
    return nmm_bench_cell_of(bench, bench->n_row - 1, column);
}

void nmm_bench_set(nmm_bench *bench, int column, double number) {
    last_cell(bench, column)->number = number;
}

nmm_status nmm_bench_say(nmm_bench *bench, int column, const char *text) {
    return nmm_bench_keep(bench, &last_cell(bench, column)->text, text);
}

void nmm_bench_done(nmm_bench *bench) {
    const nmm_bench_def *def = &bench->def;
    if (def->report != NULL && def->report(def->user, bench, NULL, bench->n_row - 1) != 0)
        bench->stopped = true;
}

// --- Out of the table

bool nmm_bench_matches(const nmm_bench *bench, int row, const nmm_bench_filter filter[2]) {
    for (int k = 0; filter != NULL && k < 2; k++) {
        const nmm_bench_filter *f = &filter[k];
        if (f->text == NULL && f->column <= 0) continue;
        if (f->text != NULL && strcmp(nmm_bench_text(bench, row, f->column), f->text) != 0)
            return false;
        if (f->text == NULL && nmm_bench_number(bench, row, f->column) != f->number) return false;
    }
    return true;
}

nmm_status nmm_bench_series(nmm_bench *bench, nmm_chart_series *series, int x, int y,
                            const nmm_bench_filter filter[2]) {
    double *place[2] = {NULL, NULL};
    const size_t n = (size_t)bench->n_row;
    for (int k = 0; k < 2; k++)
        TRY(nmm_arena_take(&bench->context, &bench->arena, &place[k], n, sizeof(double)));
    series->n = 0;
    for (int row = 0; row < bench->n_row; row++) {
        const double value = nmm_bench_number(bench, row, y);
        if (!nmm_bench_matches(bench, row, filter) || !isfinite(value)) continue;
        place[0][series->n] = nmm_bench_number(bench, row, x);
        place[1][series->n++] = value;
    }
    series->x = place[0];
    series->y = place[1];
    return NMM_OK;
}

nmm_status nmm_bench_values(nmm_bench *bench, double **value, int *n, int column,
                            const nmm_bench_filter filter[2]) {
    *n = 0;
    TRY(nmm_arena_take(&bench->context, &bench->arena, value, (size_t)bench->n_row + 1,
                       sizeof(double)));
    for (int row = 0; row < bench->n_row; row++) {
        const double number = nmm_bench_number(bench, row, column);
        if (nmm_bench_matches(bench, row, filter) && isfinite(number)) (*value)[(*n)++] = number;
    }
    return NMM_OK;
}

double nmm_bench_exponent(const nmm_chart_series *series, double least) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int i = 0; i < series->n; i++) {
        if (!(series->x[i] >= least && series->x[i] > 0 && series->y[i] > 0)) continue;
        const double x = log(series->x[i]), y = log(series->y[i]);
        n += 1;
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
    }
    const double spread = n * sxx - sx * sx;
    return n >= 2 && spread > 1e-12 ? (n * sxy - sx * sy) / spread : NAN;
}

static int compare_numbers(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double nmm_bench_median(int n, double *value) {
    if (n <= 0) return NAN;
    qsort(value, (size_t)n, sizeof *value, compare_numbers);
    return 0.5 * (value[(n - 1) / 2] + value[n / 2]);
}

nmm_status nmm_bench_range(nmm_bench *bench, const char **words, int digits, double low,
                           double high) {
    char first[32], last[32];
    snprintf(first, sizeof first, "%.*g", digits, low);
    snprintf(last, sizeof last, "%.*g", digits, high);
    const bool alike = strcmp(first, last) == 0;
    return nmm_bench_words(bench, words, "%s%s%s", first, alike ? "" : " to ", alike ? "" : last);
}

nmm_status nmm_bench_spread(nmm_bench *bench, const char **words, int n, double *value,
                            const char *unit) {
    const double median = nmm_bench_median(n, value);
    const char *range = NULL;
    TRY(nmm_bench_range(bench, &range, 3, value[0], value[n - 1]));
    return n > 1 ? nmm_bench_words(bench, words, "%s %s, median %.3g", range, unit, median)
                 : nmm_bench_words(bench, words, "%s %s", range, unit);
}

// --- CSV

// In quotes where a separator or a quote is inside (RFC 4180).
static void write_word(nmm_replacement *file, const char *text) {
    if (strpbrk(text, ",\"\r\n") == NULL) {
        nmm_replacement_write(file, text, strlen(text));
        return;
    }
    nmm_replacement_write(file, "\"", 1);
    for (const char *c = text; *c != 0; c++) {
        if (*c == '"') nmm_replacement_write(file, "\"", 1);
        nmm_replacement_write(file, c, 1);
    }
    nmm_replacement_write(file, "\"", 1);
}

static void write_row(const nmm_bench *bench, nmm_replacement *file, int row) {
    char text[32];
    for (int k = 0; k < bench->n_column; k++) {
        if (k > 0) nmm_replacement_write(file, ",", 1);
        const double number = nmm_bench_number(bench, row, k);
        if (bench->kind->column[k].is_text)
            write_word(file, nmm_bench_text(bench, row, k));
        else if (isfinite(number))
            nmm_replacement_print(file, "%s", nmm_number_text(text, number));
    }
    nmm_replacement_write(file, "\n", 1);
}

nmm_status nmm_bench_write_csv(nmm_bench *bench, const char *path) {
    nmm_replacement file = {0};
    nmm_status status = nmm_replacement_open(&bench->context, &file, path);
    if (status == NMM_OK) {
        for (int k = 0; k < bench->n_column; k++)
            nmm_replacement_print(&file, "%s%s", k > 0 ? "," : "", bench->kind->column[k].name);
        nmm_replacement_write(&file, "\n", 1);
        for (int row = 0; row < bench->n_row; row++)
            write_row(bench, &file, row);
        status = nmm_replacement_commit(&file);
    }
    nmm_replacement_drop(&file);
    return status;
}
