// SPDX-License-Identifier: MIT
//
// Matrix Market files: every number comes back bit for bit, every mistake is told with line and
// column, nothing is left behind when memory ends.

#include "matrix_market.h"
#include "test.h"

#include <stdlib.h>
#include <unistd.h>

static char path[64];
static nmm_context context;

static int start(void **unused) {
    (void)unused;
    context = (nmm_context){.n_thread = 1};
    snprintf(path, sizeof path, "matrix_market_%ld.mtx", (long)getpid());
    return 0;
}

static int stop(void **unused) {
    (void)unused;
    unlink(path);
    assert_int_equal(context.n_live, 0);
    return 0;
}

static void write_text(const char *text, size_t length) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, length, file), length);
    assert_int_equal(fclose(file), 0);
}

static double from_bits(uint64_t bits) {
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static void assert_same_bits(const double *a, const double *b, int n) {
    for (int i = 0; i < n; i++) {
        if (memcmp(&a[i], &b[i], sizeof *a) == 0) continue;
        print_error("number %d: %.17g, expected %.17g\n", i, a[i], b[i]);
        fail();
    }
}

// --- Round trips

enum { MANY = 20000 };
static double number[MANY];

// Any bits that are a finite number, short decimals, and the ends of the range.
static void make_numbers(void) {
    nmm_random random = nmm_random_seed(1);
    for (int i = 0; i < MANY; i++) {
        number[i] = from_bits(nmm_random_next(&random));
        if (!isfinite(number[i])) number[i] = 0;
        if (i % 3 == 0) number[i] = (double)(int)(2000 * nmm_random_unit(&random) - 1000) / 8;
        if (i % 7 == 0) number[i] = nmm_random_unit(&random);
    }
    const double edge[] = {0.0,
                           -0.0,
                           1,
                           -1,
                           0.1,
                           5e-324,
                           -2.2250738585072014e-308,
                           1.7976931348623157e308,
                           1e22,
                           1e23,
                           9007199254740993.0};
    memcpy(number, edge, sizeof edge);
}

static void write_array(int n_row, int n_column) {
    const nmm_market_head head = {.n_row = n_row, .n_column = n_column, .comment = "a\nb c\n"};
    nmm_replacement file = {0};
    assert_int_equal(nmm_market_open(&context, &file, path, &head), NMM_OK);
    for (int i = 0; i < n_row * n_column; i++)
        nmm_market_value(&file, number[i]);
    assert_int_equal(nmm_replacement_commit(&file), NMM_OK);
}

static void arrays_come_back(void **unused) {
    (void)unused;
    make_numbers();
    write_array(MANY / 2, 2);
    nmm_columns table = {0};
    assert_int_equal(nmm_columns_read(&context, &table, path), NMM_OK);
    assert_int_equal(table.n_row, MANY / 2);
    assert_int_equal(table.n_column, 2);
    assert_same_bits(table.value, number, MANY);
    nmm_columns_destroy(&context, &table);
}

static void matrices_come_back(void **unused) {
    (void)unused;
    make_numbers();
    for (int symmetric = 0; symmetric < 2; symmetric++) {
        const nmm_market_head head = {true, symmetric, 1000, 1000, MANY, NULL};
        nmm_replacement file = {0};
        assert_int_equal(nmm_market_open(&context, &file, path, &head), NMM_OK);
        for (int i = 0; i < MANY; i++)
            nmm_market_entry(&file, 999 - i % 100, i % 900, number[i]);
        assert_int_equal(nmm_replacement_commit(&file), NMM_OK);
        nmm_coordinates matrix = {0};
        assert_int_equal(nmm_coordinates_read(&context, &matrix, path), NMM_OK);
        assert_int_equal(matrix.symmetric, symmetric);
        assert_int_equal(matrix.n, MANY);
        assert_true(matrix.regular);
        assert_int_equal(matrix.first_line, 3);
        for (int i = 0; i < MANY; i++) {
            assert_int_equal(matrix.entry[i].row, 999 - i % 100);
            assert_int_equal(matrix.entry[i].column, i % 900);
            assert_same_bits(&matrix.entry[i].value, &number[i], 1);
        }
        nmm_coordinates_destroy(&context, &matrix);
    }
}

// Short and long decimals are read as the C library reads them.
static void decimals_are_rounded_once(void **unused) {
    (void)unused;
    enum { N = 4000 };
    static char text[N * 48];
    static double expected[N];
    nmm_random random = nmm_random_seed(7);
    int used = snprintf(text, sizeof text, "%%%%MatrixMarket matrix array real general\n%d 1\n", N);
    for (int i = 0; i < N; i++) {
        char digits[48];
        const uint64_t a = nmm_random_next(&random) >> (nmm_random_next(&random) % 64);
        const int power = (int)(nmm_random_next(&random) % 60) - 30;
        const char *form[] = {"%llu.%llue%d", "+0%llu.%03llue%+d", "-%llu.0%llu0E%d"};
        snprintf(digits, sizeof digits, form[i % 3], (unsigned long long)a,
                 (unsigned long long)(a % 977), power);
        expected[i] = strtod(digits, NULL);
        used += snprintf(text + used, sizeof text - (size_t)used, "%s\n", digits);
    }
    write_text(text, (size_t)used);
    nmm_columns table = {0};
    assert_int_equal(nmm_columns_read(&context, &table, path), NMM_OK);
    assert_same_bits(table.value, expected, N);
    nmm_columns_destroy(&context, &table);
}

static void forms_of_files(void **unused) {
    (void)unused;
    static const char *const form[] = {
        // Windows ends of lines, no last end, capitals, blanks, comments, empty lines, tabs.
        "%%MatrixMarket matrix coordinate real general\r\n2 2 3\r\n1 1 4\r\n2 1 .5\r\n2 2 5.",
        "%%matrixmarket MATRIX Coordinate Integer General\n%\n% 1 2 3\n\n 2 2 3 \n1 1 4\n"
        "% between\n\n  2\t1  5e-1\n2 2 +5\n\n%end\n \n",
    };
    for (int k = 0; k < 2; k++) {
        write_text(form[k], strlen(form[k]));
        nmm_coordinates matrix = {0};
        assert_int_equal(nmm_coordinates_read(&context, &matrix, path), NMM_OK);
        assert_int_equal(matrix.n, 3);
        assert_int_equal(matrix.regular, k == 0);
        const double value[] = {matrix.entry[0].value, matrix.entry[1].value,
                                matrix.entry[2].value};
        assert_same_bits(value, (const double[]){4, 0.5, 5}, 3);
        nmm_coordinates_destroy(&context, &matrix);
    }
}

// --- Mistakes

#define GENERAL "%%MatrixMarket matrix coordinate real general\n"
#define SYMMETRIC "%%MatrixMarket matrix coordinate real symmetric\n"
#define ARRAY "%%MatrixMarket matrix array real general\n"

static const struct {
    const char *text;
    int line, column;
    const char *words;
} wrong[] = {
    {"", 1, 1, "must be %%MatrixMarket, found the end of the line"},
    {"1 1 1\n1 1 1\n", 1, 1, "found '1'"},
    {"%%MatrixMarket vector coordinate real general\n", 1, 16, "must be matrix, found 'vector'"},
    {"%%MatrixMarket matrix coordinates real general\n", 1, 23, "found 'coordinates'"},
    {ARRAY "1 1\n1\n", 1, 23, "must be coordinate, found 'array'"},
    {"%%MatrixMarket matrix coordinate complex general\n", 1, 34, "must be real or integer"},
    {"%%MatrixMarket matrix coordinate pattern general\n", 1, 34, "found 'pattern'"},
    {"%%MatrixMarket matrix coordinate real hermitian\n", 1, 39, "must be general or symmetric"},
    {"%%MatrixMarket matrix coordinate real skew-symmetric\n", 1, 39, "found 'skew-symmetric'"},
    {"%%MatrixMarket matrix coordinate real\n", 1, 38, "found the end of the line"},
    {"%%MatrixMarket matrix coordinate real general 7\n", 1, 47, "ends here, found '7'"},
    {GENERAL, 2, 1, "ends before the line of sizes"},
    {GENERAL "% only comments\n%\n", 4, 1, "ends before the line of sizes"},
    {GENERAL "2 2\n", 2, 4, "the number of entries must be a whole number"},
    {GENERAL "-2 2 2\n", 2, 1, "the number of rows must be a whole number from 1"},
    {GENERAL "0 0 0\n", 2, 1, "found '0'"},
    {GENERAL "2 2.0 2\n", 2, 3, "found '2.0'"},
    {GENERAL "2 2 2 2\n1 1 1\n2 2 1\n", 2, 7, "the line of sizes ends here, found '2'"},
    {GENERAL "99999999999999999999999 2 2\n", 2, 1, "from 1 to 500000000"},
    {GENERAL "2 2 1\n1 1 1\n", 2, 5, "the number of entries must be a whole number from 2"},
    {GENERAL "500000000 500000000 5\n", 2, 21, "from 500000000"},
    {GENERAL "2 3 3\n", 2, 1, "must be square, found 2 by 3"},
    {GENERAL "2 2 2\n0 1 1\n2 2 1\n", 3, 1, "the row must be a whole number from 1 to 2"},
    {GENERAL "2 2 2\n1 1 1\n3 2 1\n", 4, 1, "found '3'"},
    {GENERAL "2 2 2\n1 1 1\n2 3 1\n", 4, 3, "the column must be a whole number from 1 to 2"},
    {GENERAL "2 2 2\n1 1 1\n2\n", 4, 2, "the column must be a whole number"},
    {GENERAL "2 2 2\n1 1 1\n2 2\n", 4, 4, "a value must be a finite number, found the end"},
    {GENERAL "2 2 2\n1 1 one\n2 2 1\n", 3, 5, "found 'one'"},
    {GENERAL "2 2 2\n1 1 nan\n2 2 1\n", 3, 5, "a value must be a finite number, found 'nan'"},
    {GENERAL "2 2 2\n1 1 -inf\n2 2 1\n", 3, 5, "found '-inf'"},
    {GENERAL "2 2 2\n1 1 1e999\n2 2 1\n", 3, 5, "within 1.8e308, found '1e999'"},
    {GENERAL "2 2 2\n1 1 0x10\n2 2 1\n", 3, 5, "found '0x10'"},
    {GENERAL "2 2 2\n1 1 1,5\n2 2 1\n", 3, 5, "found '1,5'"},
    {GENERAL "2 2 2\n1 1 1e\n2 2 1\n", 3, 5, "found '1e'"},
    {GENERAL "2 2 2\n1 1 --1\n2 2 1\n", 3, 5, "found '--1'"},
    {GENERAL "2 2 2\n1 1 .\n2 2 1\n", 3, 5, "found '.'"},
    {GENERAL "2 2 2\n1 1 1 0\n2 2 1\n", 3, 7, "the entry ends here, found '0'"},
    {GENERAL "2 2 2\n1 1 1\n", 4, 1, "ends after 1 of 2 entries"},
    {GENERAL "2 2 2\n1 1 1\n2 2 1\n\n1 2 1\n", 6, 1, "goes on after the 2 entries"},
    {SYMMETRIC "2 2 3\n1 1 1\n1 2 1\n2 2 1\n", 4, 3, "of the lower half"},
    {"\xef\xbb\xbf" GENERAL "1 1 1\n1 1 1\n", 1, 1, "found '???%%MatrixMarket'"},
};

static void mistakes_are_told(void **unused) {
    (void)unused;
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        nmm_coordinates matrix = {0};
        write_text(wrong[k].text, strlen(wrong[k].text));
        nmm_context_clear(&context);
        const nmm_status status = nmm_coordinates_read(&context, &matrix, path);
        nmm_coordinates_destroy(&context, &matrix);
        const nmm_error *error = &context.error;
        const bool right = status == NMM_ERROR_INPUT && error->line == wrong[k].line &&
                           error->column == wrong[k].column &&
                           strstr(error->message, wrong[k].words) != NULL &&
                           strcmp(error->file, path) == 0;
        if (right) continue;
        print_error("%s\nfound    %d:%d: %s\nexpected %d:%d: %s\n", wrong[k].text, error->line,
                    error->column, error->message, wrong[k].line, wrong[k].column, wrong[k].words);
        fail();
    }
}

static void mistakes_of_arrays_are_told(void **unused) {
    (void)unused;
    static const struct {
        const char *text, *place, *words;
    } bad[] = {
        {GENERAL "1 1 1\n1 1 1\n", "1:23", "must be array, found 'coordinate'"},
        {"%%MatrixMarket matrix array real symmetric\n", "1:34", "must be general"},
        {ARRAY "3\n1\n2\n3\n", "2:2", "the number of columns"},
        {ARRAY "3 1\n1\n2\n", "5:1", "ends after 2 of 3 values"},
        {ARRAY "2 1\n1\n2\n3\n", "5:1", "goes on after the 2"},
        {ARRAY "2 1\n1 2\n", "3:3", "ends here, found '2'"},
        {ARRAY "1000000 1000000\n1\n", "2:1", "at most 500000000 values"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        nmm_columns table = {0};
        char place[32];
        write_text(bad[k].text, strlen(bad[k].text));
        nmm_context_clear(&context);
        assert_int_equal(nmm_columns_read(&context, &table, path), NMM_ERROR_INPUT);
        nmm_columns_destroy(&context, &table);
        snprintf(place, sizeof place, "%d:%d", context.error.line, context.error.column);
        assert_string_equal(place, bad[k].place);
        assert_non_null(strstr(context.error.message, bad[k].words));
    }
    nmm_context_clear(&context);
}

static void lines_without_end_and_zero_bytes(void **unused) {
    (void)unused;
    static char junk[3 << 20];
    nmm_coordinates matrix = {0};
    memset(junk, 'x', sizeof junk);
    memcpy(junk, GENERAL "1 1 1\n", sizeof GENERAL - 1 + 6);
    write_text(junk, sizeof junk);
    nmm_context_clear(&context);
    assert_int_equal(nmm_coordinates_read(&context, &matrix, path), NMM_ERROR_INPUT);
    assert_int_equal(context.error.line, 3);
    assert_non_null(strstr(context.error.message, "a line longer than 1048576 bytes"));
    nmm_context_clear(&context);
    static const char zero[] = GENERAL "1 1 1\n1 1 1\0 5\n";
    write_text(zero, sizeof zero - 1);
    assert_int_equal(nmm_coordinates_read(&context, &matrix, path), NMM_ERROR_INPUT);
    assert_int_equal(context.error.line, 3);
    nmm_coordinates_destroy(&context, &matrix);
    nmm_context_clear(&context);
}

static void trouble_with_the_file_system(void **unused) {
    (void)unused;
    nmm_coordinates matrix = {0};
    nmm_context_clear(&context);
    assert_int_equal(nmm_coordinates_read(&context, &matrix, "none.mtx"), NMM_ERROR_FILE);
    nmm_context_clear(&context);
    assert_int_equal(nmm_coordinates_read(&context, &matrix, "."), NMM_ERROR_FILE);
    nmm_coordinates_destroy(&context, &matrix);
    nmm_context_clear(&context);
    const nmm_market_head head = {.n_row = 1, .n_column = 1};
    nmm_replacement file = {0};
    assert_int_equal(nmm_market_open(&context, &file, "none/a.mtx", &head), NMM_ERROR_FILE);
    nmm_replacement_drop(&file);
    nmm_context_clear(&context);
}

// --- Memory

static void memory_may_end(void **unused) {
    (void)unused;
    make_numbers();
    write_array(MANY, 1);
    for (int allowed = 0;; allowed++) {
        test_failing hook = {.fail_at = allowed};
        nmm_context poor = {.n_thread = 1, .allocate = test_failing_hook, .user = &hook};
        nmm_columns table = {0};
        const nmm_status status = nmm_columns_read(&poor, &table, path);
        nmm_columns_destroy(&poor, &table);
        assert_int_equal(poor.n_live, 0);
        if (status == NMM_OK) {
            assert_true(allowed > 5);
            return;
        }
        assert_int_equal(status, NMM_ERROR_MEMORY);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arrays_come_back),
        cmocka_unit_test(matrices_come_back),
        cmocka_unit_test(decimals_are_rounded_once),
        cmocka_unit_test(forms_of_files),
        cmocka_unit_test(mistakes_are_told),
        cmocka_unit_test(mistakes_of_arrays_are_told),
        cmocka_unit_test(lines_without_end_and_zero_bytes),
        cmocka_unit_test(trouble_with_the_file_system),
        cmocka_unit_test(memory_may_end),
    };
    return cmocka_run_group_tests(tests, start, stop);
}
