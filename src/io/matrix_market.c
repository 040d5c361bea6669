// SPDX-License-Identifier: MIT
//
// Matrix Market files, read line by line from one large buffer and written line by line. The
// common short numbers are converted here, exactly (a mantissa below 2^53 times or over a power of
// ten up to 22 rounds once); the others by the C library in the C locale.

#include "matrix_market.h"

#include <ctype.h>
#include <errno.h>
#include <locale.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

// Bytes read at once; no line may be longer.
#define BUFFER ((size_t)1 << 20)

/// A file, and the line at hand: line_text .. line_end, ended by a zero byte.
typedef struct market_reader {
    nmm_context *context;
    const char *path;
    FILE *stream;
    char *buffer; // [BUFFER + 1]
    size_t used;  // bytes in the buffer
    size_t next;  // where the next line starts
    bool ended;   // the file has no more bytes than are in the buffer
    long line;    // number of the line at hand, from 1
    char *line_text, *line_end;
    char *at; // what comes next on the line
} market_reader;

static nmm_status fail_at(market_reader *reader, const char *place, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static nmm_status fail_at(market_reader *reader, const char *place, const char *format, ...) {
    nmm_context *context = reader->context;
    char message[sizeof context->error.message];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    if (context->error.status != NMM_OK) return NMM_ERROR_INPUT;
    nmm_fail(context, NMM_ERROR_INPUT, "%s", message);
    context->error.line = (int)nmm_min(reader->line, 2147483647.0);
    context->error.column = place != NULL ? (int)(place - reader->line_text) + 1 : 1;
    snprintf(context->error.file, sizeof context->error.file, "%s", reader->path);
    return NMM_ERROR_INPUT;
}

// --- Lines

// More bytes behind those of the line that has begun, which moves to the front.
static nmm_status fill_buffer(market_reader *reader) {
    memmove(reader->buffer, reader->buffer + reader->next, reader->used - reader->next);
    reader->used -= reader->next;
    reader->next = 0;
    errno = 0;
    const size_t n = fread(reader->buffer + reader->used, 1, BUFFER - reader->used, reader->stream);
    reader->used += n;
    if (ferror(reader->stream)) {
        return nmm_fail(reader->context, NMM_ERROR_FILE, "cannot read %s: %s", reader->path,
                        strerror(errno != 0 ? errno : EIO));
    }
    reader->ended = feof(reader->stream) != 0;
    return NMM_OK;
}

// The next line becomes the one at hand; *more is false behind the last.
static nmm_status next_line(market_reader *reader, bool *more) {
    char *begin = reader->buffer + reader->next;
    char *end = memchr(begin, '\n', reader->used - reader->next);
    if (end == NULL && !reader->ended) {
        TRY(fill_buffer(reader));
        begin = reader->buffer;
        end = memchr(begin, '\n', reader->used);
    }
    reader->line += 1;
    reader->line_text = reader->at = begin;
    if (end == NULL && !reader->ended) {
        return fail_at(reader, begin, "a line longer than %zu bytes: this is no Matrix Market file",
                       BUFFER);
    }
    *more = end != NULL || reader->used > reader->next;
    const size_t past = end != NULL;
    if (end == NULL) end = reader->buffer + reader->used;
    reader->next = (size_t)(end - reader->buffer) + past;
    if (end > begin && end[-1] == '\r') end -= 1;
    *end = 0;
    reader->line_end = end;
    return NMM_OK;
}

static void skip_blanks(market_reader *reader) {
    while (*reader->at == ' ' || *reader->at == '\t')
        reader->at += 1;
}

// The next line that holds more than blanks and is no comment.
static nmm_status next_content(market_reader *reader, bool *more) {
    do {
        TRY(next_line(reader, more));
        skip_blanks(reader);
    } while (*more && (reader->at == reader->line_end || *reader->line_text == '%'));
    return NMM_OK;
}

// --- Words and numbers

static bool is_gap(char c) {
    return c == ' ' || c == '\t' || c == 0;
}

// What stands at `at`, for a message: at most 24 printable characters of a word.
static const char *found_word(const market_reader *reader, char word[32]) {
    if (reader->at == reader->line_end) return "the end of the line";
    size_t n = 0;
    word[n++] = '\'';
    for (const char *c = reader->at; n < 25 && c < reader->line_end && !(n > 1 && is_gap(*c)); c++)
        word[n++] = isprint((unsigned char)*c) ? *c : '?';
    word[n++] = '\'';
    word[n] = 0;
    return word;
}

static nmm_status take_integer(market_reader *reader, const char *what, const long range[2],
                               long *value) {
    char word[32];
    skip_blanks(reader);
    const char *c = reader->at;
    long number = 0;
    while (*c >= '0' && *c <= '9' && number <= NMM_MARKET_MOST)
        number = 10 * number + (*c++ - '0');
    if (c == reader->at || !is_gap(*c) || number < range[0] || number > range[1]) {
        return fail_at(reader, reader->at, "%s must be a whole number from %ld to %ld, found %s",
                       what, range[0], range[1], found_word(reader, word));
    }
    reader->at += c - reader->at;
    *value = number;
    return NMM_OK;
}

/// A decimal number as it is written: digits * 10^exponent.
typedef struct decimal {
    uint64_t digits;
    int n_digit; // beyond 19 `digits` is not valid
    int exponent;
} decimal;

static const char *scan_digits(const char *c, decimal *number, int step) {
    for (; *c >= '0' && *c <= '9'; c++) {
        if (number->digits > 0 || *c != '0') number->n_digit += 1;
        if (number->n_digit <= 19) number->digits = 10 * number->digits + (uint64_t)(*c - '0');
        number->exponent -= step;
    }
    return c;
}

// Past a number of the usual form; NULL: it is none.
static const char *scan_decimal(const char *c, decimal *number) {
    const char *begin = c;
    c = scan_digits(c, number, 0);
    bool any = c > begin;
    if (*c == '.') {
        const char *fraction = c + 1;
        c = scan_digits(fraction, number, 1);
        any = any || c > fraction;
    }
    if (!any) return NULL;
    if (*c != 'e' && *c != 'E') return c;
    const bool negative = c[1] == '-';
    c += c[1] == '-' || c[1] == '+' ? 2 : 1;
    int power = 0;
    const char *first = c;
    for (; *c >= '0' && *c <= '9'; c++)
        power = nmm_min_int(10 * power + (*c - '0'), 100000);
    number->exponent += negative ? -power : power;
    return c > first ? c : NULL;
}

static nmm_status take_number(market_reader *reader, double *value) {
    static const double ten[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                 1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    char word[32];
    skip_blanks(reader);
    const bool negative = *reader->at == '-';
    const char *digits = reader->at + (negative || *reader->at == '+');
    decimal number = {0};
    const char *end = scan_decimal(digits, &number);
    if (end == NULL || !is_gap(*end)) {
        return fail_at(reader, reader->at, "a value must be a finite number, found %s",
                       found_word(reader, word));
    }
    const bool is_short = number.n_digit <= 19 && number.digits <= (uint64_t)1 << 53;
    if (is_short && number.exponent >= -22 && number.exponent <= 22) {
        const double x = (double)number.digits;
        *value = number.exponent < 0 ? x / ten[-number.exponent] : x * ten[number.exponent];
    } else {
        *value = strtod(digits, NULL);
    }
    if (!(*value < INFINITY)) {
        return fail_at(reader, reader->at, "a value must be within 1.8e308, found %s",
                       found_word(reader, word));
    }
    if (negative) *value = -*value;
    reader->at += end - reader->at;
    return NMM_OK;
}

static nmm_status take_end(market_reader *reader, const char *what) {
    char word[32];
    skip_blanks(reader);
    if (reader->at == reader->line_end) return NMM_OK;
    return fail_at(reader, reader->at, "%s ends here, found %s", what, found_word(reader, word));
}

// --- The first lines

// One word of the first line out of those allowed (ended by NULL); *which: its place among them.
static nmm_status take_word(market_reader *reader, const char *const *allowed, int *which) {
    skip_blanks(reader);
    size_t length = 0;
    while (!is_gap(reader->at[length]))
        length += 1;
    char list[128] = "", word[32];
    for (int k = 0; allowed[k] != NULL; k++) {
        if (strlen(allowed[k]) == length && strncasecmp(reader->at, allowed[k], length) == 0) {
            *which = k;
            reader->at += length;
            return NMM_OK;
        }
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", k > 0 ? " or " : "", allowed[k]);
    }
    return fail_at(reader, reader->at, "must be %s, found %s", list, found_word(reader, word));
}

// The first line: %%MatrixMarket matrix coordinate real symmetric
static nmm_status take_banner(market_reader *reader, nmm_market_head *head) {
    static const char *const banner[] = {"%%MatrixMarket", NULL};
    static const char *const object[] = {"matrix", NULL};
    static const char *const coordinate[] = {"coordinate", NULL}, *const array[] = {"array", NULL};
    static const char *const field[] = {"real", "integer", NULL};
    static const char *const symmetry[] = {"general", "symmetric", NULL};
    static const char *const general[] = {"general", NULL};
    bool more = false;
    int which = 0;
    TRY(next_line(reader, &more));
    TRY(take_word(reader, banner, &which));
    TRY(take_word(reader, object, &which));
    TRY(take_word(reader, head->coordinate ? coordinate : array, &which));
    TRY(take_word(reader, field, &which));
    TRY(take_word(reader, head->coordinate ? symmetry : general, &which));
    head->symmetric = which == 1;
    return take_end(reader, "the first line");
}

static nmm_status take_sizes(market_reader *reader, nmm_market_head *head) {
    const long size[] = {1, NMM_MARKET_MOST};
    bool more = false;
    TRY(next_content(reader, &more));
    if (!more) return fail_at(reader, NULL, "the file ends before the line of sizes");
    TRY(take_integer(reader, "the number of rows", size, &head->n_row));
    TRY(take_integer(reader, "the number of columns", size, &head->n_column));
    if (!head->coordinate) return take_end(reader, "the line of sizes");
    if (head->n_row != head->n_column) {
        return fail_at(reader, reader->line_text, "the matrix must be square, found %ld by %ld",
                       head->n_row, head->n_column);
    }
    // Fewer entries than rows leave a row empty: no such system has one solution.
    const long entries[] = {head->n_row, NMM_MARKET_MOST};
    TRY(take_integer(reader, "the number of entries", entries, &head->n_entry));
    return take_end(reader, "the line of sizes");
}

// --- Reading

static nmm_status open_reader(market_reader *reader, nmm_context *context, const char *path) {
    *reader = (market_reader){.context = context, .path = path};
    TRY(nmm_allocate(context, &reader->buffer, BUFFER + 1, 1));
    reader->line_text = reader->line_end = reader->at = reader->buffer;
    reader->stream = fopen(path, "rbe");
    if (reader->stream != NULL) return NMM_OK;
    return nmm_fail(context, NMM_ERROR_FILE, "cannot read %s: %s", path, strerror(errno));
}

static void close_reader(market_reader *reader) {
    if (reader->stream != NULL) fclose(reader->stream);
    nmm_release(reader->context, &reader->buffer);
}

static nmm_status take_entry(market_reader *reader, const nmm_coordinates *matrix,
                             nmm_coordinate *entry) {
    long row = 0, column = 0;
    const long rows[] = {1, matrix->order};
    TRY(take_integer(reader, "the row", rows, &row));
    // A symmetric file has the lower half.
    const long columns[] = {1, matrix->symmetric ? row : matrix->order};
    const char *what = "the column";
    if (matrix->symmetric) what = "the column (of the lower half, as the file is symmetric)";
    TRY(take_integer(reader, what, columns, &column));
    TRY(take_number(reader, &entry->value));
    entry->row = (int)row - 1;
    entry->column = (int)column - 1;
    return take_end(reader, "the entry");
}

static nmm_status end_of_file(market_reader *reader, long n) {
    bool more = false;
    TRY(next_content(reader, &more));
    if (!more) return NMM_OK;
    return fail_at(reader, reader->at, "the file goes on after the %ld entries of its sizes", n);
}

static nmm_status read_entries(market_reader *reader, nmm_coordinates *matrix, long n_entry) {
    for (int k = 0; k < (int)n_entry; k++) {
        bool more = false;
        TRY(next_content(reader, &more));
        if (!more) {
            return fail_at(reader, NULL, "the file ends after %d of %ld entries", k, n_entry);
        }
        if (k == 0) matrix->first_line = reader->line;
        matrix->regular = reader->line == matrix->first_line + k;
        TRY(nmm_grow(reader->context, &matrix->entry, &matrix->capacity, k + 1,
                     sizeof *matrix->entry));
        TRY(take_entry(reader, matrix, &matrix->entry[k]));
        matrix->n = k + 1;
    }
    return end_of_file(reader, n_entry);
}

static nmm_status read_matrix(market_reader *reader, nmm_coordinates *matrix) {
    nmm_market_head head = {.coordinate = true};
    TRY(take_banner(reader, &head));
    TRY(take_sizes(reader, &head));
    matrix->order = (int)head.n_row;
    matrix->symmetric = head.symmetric;
    return read_entries(reader, matrix, head.n_entry);
}

static nmm_status read_table(market_reader *reader, nmm_columns *table) {
    nmm_market_head head = {.coordinate = false};
    TRY(take_banner(reader, &head));
    TRY(take_sizes(reader, &head));
    const long n = head.n_row * head.n_column;
    if (n > NMM_MARKET_MOST) {
        return fail_at(reader, reader->line_text, "the table must have at most %ld values",
                       NMM_MARKET_MOST);
    }
    table->n_row = (int)head.n_row;
    table->n_column = (int)head.n_column;
    for (int k = 0; k < (int)n; k++) {
        bool more = false;
        TRY(next_content(reader, &more));
        if (!more) return fail_at(reader, NULL, "the file ends after %d of %ld values", k, n);
        TRY(nmm_grow(reader->context, &table->value, &table->capacity, k + 1, sizeof(double)));
        TRY(take_number(reader, &table->value[k]));
        TRY(take_end(reader, "the line of a value"));
    }
    return end_of_file(reader, n);
}

// Reads one of the two, with a decimal point whatever the program's locale.
static nmm_status read_file(nmm_context *context, const char *path, nmm_coordinates *matrix,
                            nmm_columns *table) {
    const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    const locale_t before = plain != (locale_t)0 ? uselocale(plain) : (locale_t)0;
    market_reader reader;
    nmm_status status = open_reader(&reader, context, path);
    if (status == NMM_OK) {
        status = matrix != NULL ? read_matrix(&reader, matrix) : read_table(&reader, table);
    }
    close_reader(&reader);
    if (plain != (locale_t)0) {
        uselocale(before);
        freelocale(plain);
    }
    return status;
}

nmm_status nmm_coordinates_read(nmm_context *context, nmm_coordinates *matrix, const char *path) {
    return read_file(context, path, matrix, NULL);
}

void nmm_coordinates_destroy(nmm_context *context, nmm_coordinates *matrix) {
    nmm_release(context, &matrix->entry);
    *matrix = (nmm_coordinates){0};
}

nmm_status nmm_columns_read(nmm_context *context, nmm_columns *table, const char *path) {
    return read_file(context, path, NULL, table);
}

void nmm_columns_destroy(nmm_context *context, nmm_columns *table) {
    nmm_release(context, &table->value);
    *table = (nmm_columns){0};
}

// --- Writing

// The shortest of what 17 digits need; returns the length.
static int put_number(char text[40], double x) {
    const int n = snprintf(text, 40, "%.17g", x);
    if (!isfinite(x)) return n;
    // The decimal mark of a locale may be more than one byte.
    int length = 0;
    for (int k = 0; k < n; k++) {
        const char c = text[k];
        const bool plain = (c >= '0' && c <= '9') || c == '-' || c == '+' || c == 'e';
        if (plain)
            text[length++] = c;
        else if (text[length - 1] != '.')
            text[length++] = '.';
    }
    return length;
}

nmm_status nmm_market_open(nmm_context *context, nmm_replacement *file, const char *path,
                           const nmm_market_head *head) {
    TRY(nmm_replacement_open(context, file, path));
    nmm_replacement_print(file, "%%%%MatrixMarket matrix %s real %s\n",
                          head->coordinate ? "coordinate" : "array",
                          head->symmetric ? "symmetric" : "general");
    for (const char *line = head->comment; line != NULL && *line != 0;) {
        const int length = (int)strcspn(line, "\n");
        nmm_replacement_print(file, "%% %.*s\n", length, line);
        line += length + (line[length] == '\n');
    }
    if (head->coordinate)
        nmm_replacement_print(file, "%ld %ld %ld\n", head->n_row, head->n_column, head->n_entry);
    else
        nmm_replacement_print(file, "%ld %ld\n", head->n_row, head->n_column);
    return NMM_OK;
}

void nmm_market_entry(nmm_replacement *file, int row, int column, double value) {
    char line[80];
    int n = snprintf(line, sizeof line, "%d %d ", row + 1, column + 1);
    n += put_number(line + n, value);
    line[n++] = '\n';
    nmm_replacement_write(file, line, (size_t)n);
}

void nmm_market_value(nmm_replacement *file, double value) {
    char line[48];
    int n = put_number(line, value);
    line[n++] = '\n';
    nmm_replacement_write(file, line, (size_t)n);
}
