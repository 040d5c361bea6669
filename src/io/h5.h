// SPDX-License-Identifier: MIT
//
// A thin layer on the HDF5 C library for the io floor: files, tables that grow by rows, records
// (compound rows straight from a C struct), texts, attributes.
//
// Every function opens and closes its own handles, so an early return leaks nothing. Failures to
// write are NMM_ERROR_FILE with the system's reason; what a reader finds wrong in a file is
// NMM_ERROR_INPUT with the dataset's name. HDF5's own printing is off between nmm_h5_quiet_begin
// and nmm_h5_quiet_end, and the caller's setting is put back.

#ifndef NMM_IO_H5_H
#define NMM_IO_H5_H

#include "base.h"

#include <hdf5.h>

/// An open HDF5 file. Starts zeroed; `context` and `path` are set by the owner and outlive it.
typedef struct nmm_h5 {
    nmm_context *context;
    const char *path; // as opened
    const char *name; // as told to the user: the final name while `path` is a temporary
    hid_t file;       // 0: closed
    hid_t transfer;   // how rows are written, while the file is open to be written
} nmm_h5;

typedef struct nmm_h5_quiet {
    H5E_auto2_t print;
    void *data;
} nmm_h5_quiet;
/// Switch HDF5's printing of errors off for this thread, and back on as it was.
nmm_h5_quiet nmm_h5_quiet_begin(void);
void nmm_h5_quiet_end(nmm_h5_quiet quiet);

typedef enum nmm_h5_mode { NMM_H5_CREATE, NMM_H5_APPEND, NMM_H5_READ } nmm_h5_mode;

/// Seconds to wait for another process that holds the file's lock.
#define NMM_H5_PATIENCE 2.0

/// Open h5->path. A lock held by another process is waited for; then an append goes on without
/// locks (only readers can hold it: runs have a lock of their own), a read is NMM_ERROR_FILE.
nmm_status nmm_h5_open(nmm_h5 *h5, nmm_h5_mode mode);
/// Make sure that `bytes` more fit on the disk, before the file is opened to append: HDF5 does not
/// survive a full disk, this does. NMM_ERROR_FILE: they do not fit; the file is as before.
nmm_status nmm_h5_reserve(nmm_h5 *h5, size_t bytes);
/// Write everything out. NMM_ERROR_FILE: disk full and the like.
nmm_status nmm_h5_flush(nmm_h5 *h5);
nmm_status nmm_h5_close(nmm_h5 *h5);
/// Close without a word, after another failure.
void nmm_h5_drop(nmm_h5 *h5);

/// NMM_ERROR_FILE "cannot write NAME: reason", the reason taken from HDF5's error stack.
nmm_status nmm_h5_fail_write(nmm_h5 *h5, const char *what);
/// NMM_ERROR_INPUT "NAME: WHAT: why".
nmm_status nmm_h5_fail_read(nmm_h5 *h5, const char *what, const char *why);

// --- Writing

/// A dataset of rows that grows. Shape [rows] when width is 0, else [rows][width].
typedef struct nmm_h5_table {
    const char *name; // path inside the file; groups on the way are made
    hid_t type;       // of one number, as stored
    int width;
    hsize_t chunk; // rows of a chunk, at least 1
    bool compress; // shuffle and gzip 1: only where a chunk is written once
    const char *unit, *meaning;
} nmm_h5_table;
nmm_status nmm_h5_table_create(nmm_h5 *h5, const nmm_h5_table *table);

/// Rows first .. first + n - 1 of a dataset; it grows (or shrinks) to end there.
nmm_status nmm_h5_put(nmm_h5 *h5, const char *name, hid_t memory, hsize_t first, hsize_t n,
                      const void *data);

/// One column of a record: where it lies in the C struct, and its type: 'i' int, 'l' long,
/// 'd' double, 'u' uint64_t, 's' char[size].
typedef struct nmm_h5_column {
    const char *name;
    char kind;
    size_t offset, size;
    const char *unit, *meaning;
} nmm_h5_column;

/// A row as a C struct.
typedef struct nmm_h5_record {
    size_t size; // of the struct
    int n;
    const nmm_h5_column *column; // [n], at most NMM_H5_COLUMNS
} nmm_h5_record;
enum { NMM_H5_COLUMNS = 96, NMM_H5_TEXT = 96 }; // texts of a column's name, unit, meaning

/// A table of records that grows: doubles [rows][columns], which every program reads, with the
/// attributes columns, unit and meaning. `keep` [record->n] says which columns are stored, NULL:
/// all. Texts have no place in it.
nmm_status nmm_h5_record_create(nmm_h5 *h5, const char *name, const nmm_h5_record *record,
                                const bool *keep, hsize_t chunk);
nmm_status nmm_h5_record_put(nmm_h5 *h5, const char *name, const nmm_h5_record *record,
                             const bool *keep, const hsize_t range[2], const void *rows);

/// A single record with texts, as an HDF5 compound; written over in place.
nmm_status nmm_h5_single_create(nmm_h5 *h5, const char *name, const nmm_h5_record *record);
nmm_status nmm_h5_single_set(nmm_h5 *h5, const char *name, const nmm_h5_record *record,
                             const void *row);

nmm_status nmm_h5_group_create(nmm_h5 *h5, const char *name);
/// A dataset of one value whose space is taken at once; < 0: failed.
hid_t nmm_h5_scalar_create(hid_t file, const char *name, hid_t type);
/// Create or overwrite an attribute of an open object.
bool nmm_h5_attribute_write(hid_t object, const char *name, hid_t type, hid_t space,
                            const void *value);
/// A fixed-length text type, filled up with zeros.
hid_t nmm_h5_text_type(size_t size);
nmm_status nmm_h5_text_create(nmm_h5 *h5, const char *name, const char *text, size_t length);
/// A fixed-length ASCII or UTF-8 attribute; `room` bytes are kept for later texts (0: as long as
/// the text).
nmm_status nmm_h5_attribute_text(nmm_h5 *h5, const char *object, const char *name, const char *text,
                                 size_t room);
/// Numbers: `n` 0 is a scalar. Written over where the attribute is there already.
nmm_status nmm_h5_attribute_put(nmm_h5 *h5, const char *object, const char *name, hid_t type, int n,
                                const void *value);

// --- Reading

bool nmm_h5_exists(nmm_h5 *h5, const char *name);
/// Open a dataset that must be there; the caller closes it.
nmm_status nmm_h5_dataset_open(nmm_h5 *h5, const char *name, hid_t *dataset);
/// Rows of a dataset whose rows must have `width` numbers (0: rank 1).
nmm_status nmm_h5_rows(nmm_h5 *h5, const char *name, int width, long *rows);
/// Rows range[0] .. range[0] + range[1] - 1; NMM_ERROR_INPUT when they are not there or are no
/// numbers.
nmm_status nmm_h5_get(nmm_h5 *h5, const char *name, hid_t memory, int width, const long range[2],
                      void *data);
/// Rows of a table of records.
nmm_status nmm_h5_record_rows(nmm_h5 *h5, const char *name, long *rows);
/// Rows first .. first + n - 1. Columns that the file lacks keep what `rows` held.
nmm_status nmm_h5_record_get(nmm_h5 *h5, const char *name, const nmm_h5_record *record, long first,
                             long n, void *rows);
/// Is there a table of records with this column?
bool nmm_h5_record_has(nmm_h5 *h5, const char *name, const char *column);
nmm_status nmm_h5_single_get(nmm_h5 *h5, const char *name, const nmm_h5_record *record, void *row);
/// A text into `arena`.
nmm_status nmm_h5_text_get(nmm_h5 *h5, nmm_arena *arena, const char *name, char **text,
                           size_t *length);
bool nmm_h5_attribute_exists(nmm_h5 *h5, const char *object, const char *name);
nmm_status nmm_h5_attribute_text_get(nmm_h5 *h5, const char *object, const char *name, char *text,
                                     size_t size);
nmm_status nmm_h5_attribute_get(nmm_h5 *h5, const char *object, const char *name, hid_t memory,
                                int n, void *value);

#endif
