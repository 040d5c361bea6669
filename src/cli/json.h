// SPDX-License-Identifier: MIT
//
// A small writer of JSON: one object, indented, written as it goes.
//
// Always holds: valid UTF-8 and valid escapes whatever the bytes given; numbers in the shortest
// form that reads back to the same bits; a number that is not finite becomes null.

#ifndef NMM_CLI_JSON_H
#define NMM_CLI_JSON_H

#include <stdint.h>
#include <stdio.h>

typedef struct json {
    FILE *file;
    int depth;  // objects and arrays open
    int n_item; // items written in the innermost one
} json;

/// Open an object: the outermost with `key` NULL, else under `key`.
void json_open(json *out, const char *key);
void json_close(json *out);
/// An array of texts or numbers: items are written with `key` NULL.
void json_open_array(json *out, const char *key);
void json_close_array(json *out);

void json_text(json *out, const char *key, const char *value); ///< NULL becomes null
void json_integer(json *out, const char *key, long value);
void json_boolean(json *out, const char *key, int value);
void json_number(json *out, const char *key, double value);
void json_numbers(json *out, const char *key, int n, const double *value); ///< an array on one line
void json_hash(json *out, const char *key, uint64_t value); ///< 16 hexadecimal digits

#endif
