// SPDX-License-Identifier: MIT
//
// Matrix Market files (Boisvert, Pozo and Remington, NISTIR 5935, 1996): `coordinate real` for
// square matrices, general or symmetric, and `array real general` for vectors and tables. Numbers
// are written with 17 digits, so that they come back bit for bit, with a point in any locale. What
// is read is finite and in range; a mistake is NMM_ERROR_INPUT with line and column.

#ifndef NMM_IO_MATRIX_MARKET_H
#define NMM_IO_MATRIX_MARKET_H

#include "io.h"

/// Largest order and number of entries of a file: both halves still count in an int.
#define NMM_MARKET_MOST 500000000L

typedef struct nmm_coordinate {
    int row, column; // from 0
    double value;
} nmm_coordinate;

/// A square matrix as the file has it; places may repeat, which is for the user to judge.
typedef struct nmm_coordinates {
    int order;
    bool symmetric; // only row >= column is given
    int n, capacity;
    nmm_coordinate *entry; // [n] in the order of the file
    long first_line;       // of the entries
    bool regular;          // one line each from there: entry k lies on line first_line + k
} nmm_coordinates;

/// A table by columns, as the format has it.
typedef struct nmm_columns {
    int n_row, n_column;
    int capacity;
    double *value; // [n_column][n_row]
} nmm_columns;

/// NMM_ERROR_FILE: cannot be read. NMM_ERROR_INPUT: not such a file. The structs start zeroed and
/// are destroyed by their owner in any case.
nmm_status nmm_coordinates_read(nmm_context *context, nmm_coordinates *matrix, const char *path);
void nmm_coordinates_destroy(nmm_context *context, nmm_coordinates *matrix);
nmm_status nmm_columns_read(nmm_context *context, nmm_columns *table, const char *path);
void nmm_columns_destroy(nmm_context *context, nmm_columns *table);

/// First lines of a file.
typedef struct nmm_market_head {
    bool coordinate; // else array
    bool symmetric;
    long n_row, n_column;
    long n_entry;        // coordinate only
    const char *comment; // lines, each ended by a newline; NULL: none
} nmm_market_head;

/// Start a file; then append n_entry entries, or n_row * n_column values column by column, and
/// commit or drop it (io.h).
nmm_status nmm_market_open(nmm_context *context, nmm_replacement *file, const char *path,
                           const nmm_market_head *head);
/// Row and column from 0.
void nmm_market_entry(nmm_replacement *file, int row, int column, double value);
void nmm_market_value(nmm_replacement *file, double value);

#endif
