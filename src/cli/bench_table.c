// SPDX-License-Identifier: MIT
//
// Tables with columns as wide as their content: words to the left, numbers to the right; empty
// where nothing was measured. The same as JSON, and as files: the table and its picture.

#include "bench_table.h"

#include "interrupt.h"
#include "message.h"
#include "options.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { LONGEST = 96 };

/// As many digits as are worth it, without an exponent where that reads well.
static void write_number(char text[LONGEST], double value, int digits) {
    const double size = fabs(value);
    text[0] = 0;
    if (!isfinite(value)) return;
    if (digits == 0 || value == 0) {
        snprintf(text, LONGEST, "%.0f", value);
    } else if (size < 1e-4 || size >= 1e7) {
        snprintf(text, LONGEST, "%.*e", digits - 1, value);
    } else {
        const int decimals = digits - 1 - (int)floor(log10(size));
        snprintf(text, LONGEST, "%.*f", decimals > 0 ? decimals : 0, value);
    }
}

static const char *cell_text(const nmm_bench *bench, int row, int column, char text[LONGEST]) {
    const nmm_bench_column c = nmm_bench_column_of(bench, column);
    if (c.is_text) return nmm_bench_text(bench, row, column);
    write_number(text, nmm_bench_number(bench, row, column), c.digits);
    return text;
}

/// Width of a column: of its title, its unit and all its cells.
static int column_width(const nmm_bench *bench, int column) {
    const nmm_bench_column c = nmm_bench_column_of(bench, column);
    char text[LONGEST];
    size_t width = strlen(c.title) > strlen(c.unit) ? strlen(c.title) : strlen(c.unit);
    for (int row = 0; row < nmm_bench_rows(bench); row++) {
        const size_t n = strlen(cell_text(bench, row, column, text));
        if (n > width) width = n;
    }
    return (int)width;
}

/// A word of column k in its width; the last one is not filled up.
static void put_word(const nmm_bench *bench, int k, const char *word) {
    const nmm_bench_column c = nmm_bench_column_of(bench, k);
    const int width = column_width(bench, k);
    const int last = nmm_bench_column_of(bench, k + 1).name == NULL;
    printf("  %*s", !c.is_text ? width : last ? 0 : -width, word);
}

static void put_head(const nmm_bench *bench, int units) {
    for (int k = 0; nmm_bench_column_of(bench, k).name; k++) {
        const nmm_bench_column c = nmm_bench_column_of(bench, k);
        put_word(bench, k, units ? c.unit : c.title);
    }
    putchar('\n');
}

void bench_table_print(const nmm_bench *bench) {
    char text[LONGEST];
    printf("%s\n\n", nmm_bench_title(bench));
    put_head(bench, 0);
    put_head(bench, 1);
    for (int row = 0; row < nmm_bench_rows(bench); row++) {
        for (int k = 0; nmm_bench_column_of(bench, k).name; k++)
            put_word(bench, k, cell_text(bench, row, k, text));
        putchar('\n');
    }
    if (nmm_bench_note(bench, 0)) putchar('\n');
    for (int k = 0; nmm_bench_note(bench, k); k++)
        printf("%s\n", nmm_bench_note(bench, k));
}

void bench_table_json(json *out, const nmm_bench *bench) {
    json_text(out, "title", nmm_bench_title(bench));
    json_open(out, "units");
    for (int k = 0; nmm_bench_column_of(bench, k).name; k++) {
        const nmm_bench_column c = nmm_bench_column_of(bench, k);
        if (c.unit[0]) json_text(out, c.name, c.unit);
    }
    json_close(out);
    json_open_array(out, "rows");
    for (int row = 0; row < nmm_bench_rows(bench); row++) {
        json_open(out, NULL);
        for (int k = 0; nmm_bench_column_of(bench, k).name; k++) {
            const nmm_bench_column c = nmm_bench_column_of(bench, k);
            if (c.is_text)
                json_text(out, c.name, nmm_bench_text(bench, row, k));
            else
                json_number(out, c.name, nmm_bench_number(bench, row, k));
        }
        json_close(out);
    }
    json_close_array(out);
    json_open_array(out, "notes");
    for (int k = 0; nmm_bench_note(bench, k); k++)
        json_text(out, NULL, nmm_bench_note(bench, k));
    json_close_array(out);
}

void bench_table_listen(const char *made) {
    interrupt_listen(
        (interrupt_words){"measurement", "nothing of this measurement was written", made});
}

int bench_table_write(nmm_bench *bench, const char *folder, const char *name, bool told) {
    static const char *const ending[] = {"csv", "svg", "png"};
    char path[3][PATH_MAX + NAME_MAX + 8];
    for (int k = 0; k < 3; k++) {
        snprintf(path[k], sizeof path[k], "%s/%s.%s", folder, name, ending[k]);
        interrupt_hold(true);
        const nmm_status status =
            k == 0 ? nmm_bench_write_csv(bench, path[k]) : nmm_bench_plot(bench, path[k]);
        interrupt_hold(false);
        if (status != NMM_OK) return message_failure(nmm_bench_error(bench), path[k]);
    }
    if (told) printf("\nWritten: %s, %s, %s\n", path[0], path[1], path[2]);
    return EXIT_DONE;
}
