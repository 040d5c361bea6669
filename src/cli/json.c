// SPDX-License-Identifier: MIT
//
// A small writer of JSON: commas, indentation, escapes and shortest numbers.
//
// A 64-bit hash is written as a text of hexadecimal digits, because most readers keep numbers as
// doubles and would lose its last bits.

#include "json.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

/// Length of the valid UTF-8 character at `s`, 0 where there is none (RFC 3629).
static int character_length(const unsigned char *s) {
    if (s[0] < 0x80) return 1;
    const int n = s[0] >= 0xf0 ? 4 : s[0] >= 0xe0 ? 3 : 2;
    if (s[0] < 0xc2 || s[0] > 0xf4) return 0;
    for (int i = 1; i < n; i++)
        if ((s[i] & 0xc0) != 0x80) return 0;
    // Overlong forms, surrogates and values above U+10FFFF.
    if (s[0] == 0xe0 && s[1] < 0xa0) return 0;
    if (s[0] == 0xed && s[1] > 0x9f) return 0;
    if (s[0] == 0xf0 && s[1] < 0x90) return 0;
    if (s[0] == 0xf4 && s[1] > 0x8f) return 0;
    return n;
}

static void put_ascii(FILE *file, unsigned char c) {
    if (c == '"' || c == '\\')
        fprintf(file, "\\%c", c);
    else if (c == '\n')
        fputs("\\n", file);
    else if (c == '\t')
        fputs("\\t", file);
    else if (c < 0x20 || c == 0x7f)
        fprintf(file, "\\u%04x", c);
    else
        fputc(c, file);
}

static void put_text(FILE *file, const char *text) {
    const unsigned char *s = (const unsigned char *)text;
    fputc('"', file);
    while (*s) {
        const int n = character_length(s);
        // A byte that is no character becomes the replacement character.
        if (n == 0)
            fputs("\\ufffd", file);
        else if (n == 1)
            put_ascii(file, *s);
        else
            fwrite(s, 1, (size_t)n, file);
        s += n ? n : 1;
    }
    fputc('"', file);
}

static void put_number(FILE *file, double value) {
    char text[40];
    if (!isfinite(value)) {
        fputs("null", file);
        return;
    }
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value) break;
    }
    fputs(text, file);
}

/// Comma, new line, indentation and key of the next item.
static void begin_item(json *out, const char *key) {
    if (out->depth > 0) fputs(out->n_item ? ",\n" : "\n", out->file);
    for (int i = 0; i < out->depth; i++)
        fputs("  ", out->file);
    out->n_item++;
    if (!key) return;
    put_text(out->file, key);
    fputs(": ", out->file);
}

static void open_with(json *out, const char *key, char bracket) {
    begin_item(out, key);
    fputc(bracket, out->file);
    out->depth++;
    out->n_item = 0;
}

static void close_with(json *out, char bracket) {
    out->depth--;
    if (out->n_item) {
        fputc('\n', out->file);
        for (int i = 0; i < out->depth; i++)
            fputs("  ", out->file);
    }
    fputc(bracket, out->file);
    out->n_item = 1; // the one just closed counts in the one around it
    if (out->depth == 0) fputc('\n', out->file);
}

void json_open(json *out, const char *key) {
    open_with(out, key, '{');
}

void json_close(json *out) {
    close_with(out, '}');
}

void json_open_array(json *out, const char *key) {
    open_with(out, key, '[');
}

void json_close_array(json *out) {
    close_with(out, ']');
}

void json_text(json *out, const char *key, const char *value) {
    begin_item(out, key);
    if (value)
        put_text(out->file, value);
    else
        fputs("null", out->file);
}

void json_integer(json *out, const char *key, long value) {
    begin_item(out, key);
    fprintf(out->file, "%ld", value);
}

void json_boolean(json *out, const char *key, int value) {
    begin_item(out, key);
    fputs(value ? "true" : "false", out->file);
}

void json_number(json *out, const char *key, double value) {
    begin_item(out, key);
    put_number(out->file, value);
}

void json_numbers(json *out, const char *key, int n, const double *value) {
    begin_item(out, key);
    fputc('[', out->file);
    for (int i = 0; i < n; i++) {
        if (i) fputs(", ", out->file);
        put_number(out->file, value[i]);
    }
    fputc(']', out->file);
}

void json_hash(json *out, const char *key, uint64_t value) {
    char text[20];
    snprintf(text, sizeof text, "%016" PRIx64, value);
    json_text(out, key, text);
}
