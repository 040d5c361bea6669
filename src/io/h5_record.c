// SPDX-License-Identifier: MIT
//
// Records of a C struct in an HDF5 file: tables that grow, as doubles [rows][columns] with the
// names of the columns beside them, and single records with texts, as a compound.
//
// Tables are no compounds because Octave and others do not read those; whole numbers of a table
// stay below 2^53, so a double holds them.

#include "h5.h"

#include <math.h>
#include <string.h>

// --- Columns

static double get_value(const nmm_h5_column *column, const void *row) {
    const char *at = (const char *)row + column->offset;
    double d = 0;
    long l = 0;
    int i = 0;
    switch (column->kind) {
    case 'i':
        memcpy(&i, at, sizeof i);
        return i;
    case 'l':
        memcpy(&l, at, sizeof l);
        return (double)l;
    default:
        NMM_ASSERT(column->kind == 'd');
        memcpy(&d, at, sizeof d);
        return d;
    }
}

// False where the number does not fit the column.
static bool set_value(const nmm_h5_column *column, void *row, double value) {
    char *at = (char *)row + column->offset;
    const double most = column->kind == 'i' ? 2147483647.0 : 9e15;
    if (!isfinite(value)) return false;
    if (column->kind != 'd' && fabs(value) > most) return false;
    const int i = column->kind == 'i' ? (int)value : 0;
    const long l = column->kind == 'l' ? (long)value : 0;
    if (column->kind == 'i')
        memcpy(at, &i, sizeof i);
    else if (column->kind == 'l')
        memcpy(at, &l, sizeof l);
    else
        memcpy(at, &value, sizeof value);
    return true;
}

static int count_columns(const nmm_h5_record *record, const bool *keep) {
    int n = 0;
    for (int i = 0; i < record->n; i++)
        n += keep == NULL || keep[i];
    return n;
}

// --- Tables

typedef char column_texts[NMM_H5_COLUMNS][NMM_H5_TEXT];

static bool describe_columns(hid_t dataset, const nmm_h5_record *record, const bool *keep) {
    column_texts name = {{0}}, unit = {{0}}, meaning = {{0}};
    hsize_t n = 0;
    for (int i = 0; i < record->n; i++) {
        if (keep != NULL && !keep[i]) continue;
        strncpy(name[n], record->column[i].name, NMM_H5_TEXT - 1);
        strncpy(unit[n], record->column[i].unit, NMM_H5_TEXT - 1);
        strncpy(meaning[n], record->column[i].meaning, NMM_H5_TEXT - 1);
        n += 1;
    }
    const hid_t type = nmm_h5_text_type(NMM_H5_TEXT);
    const hid_t space = H5Screate_simple(1, &n, NULL);
    const bool written = nmm_h5_attribute_write(dataset, "columns", type, space, name) &&
                         nmm_h5_attribute_write(dataset, "unit", type, space, unit) &&
                         nmm_h5_attribute_write(dataset, "meaning", type, space, meaning);
    H5Sclose(space);
    H5Tclose(type);
    return written;
}

nmm_status nmm_h5_record_create(nmm_h5 *h5, const char *name, const nmm_h5_record *record,
                                const bool *keep, hsize_t chunk) {
    NMM_ASSERT(record->n <= NMM_H5_COLUMNS);
    const nmm_h5_table table = {
        .name = name, .type = H5T_IEEE_F64LE, .width = count_columns(record, keep), .chunk = chunk};
    TRY(nmm_h5_table_create(h5, &table));
    const hid_t dataset = H5Dopen2(h5->file, name, H5P_DEFAULT);
    const bool written = dataset >= 0 && describe_columns(dataset, record, keep);
    const nmm_status status = written ? NMM_OK : nmm_h5_fail_write(h5, name);
    if (dataset >= 0) H5Dclose(dataset);
    return status;
}

nmm_status nmm_h5_record_put(nmm_h5 *h5, const char *name, const nmm_h5_record *record,
                             const bool *keep, const hsize_t range[2], const void *rows) {
    const size_t width = (size_t)count_columns(record, keep);
    double *value = NULL;
    TRY(nmm_allocate(h5->context, &value, (size_t)range[1] * width, sizeof *value));
    double *next = value;
    for (size_t r = 0; r < range[1]; r++) {
        const char *row = (const char *)rows + r * record->size;
        for (int i = 0; i < record->n; i++) {
            if (keep == NULL || keep[i]) *next++ = get_value(&record->column[i], row);
        }
    }
    const nmm_status status = nmm_h5_put(h5, name, H5T_NATIVE_DOUBLE, range[0], range[1], value);
    nmm_release(h5->context, &value);
    return status;
}

// Names of a table's columns from the attribute `columns`; 0: no such table.
static int read_names(nmm_h5 *h5, const char *name, column_texts text) {
    if (!nmm_h5_exists(h5, name)) return 0;
    if (H5Aexists_by_name(h5->file, name, "columns", H5P_DEFAULT) <= 0) return 0;
    const hid_t attribute = H5Aopen_by_name(h5->file, name, "columns", H5P_DEFAULT, H5P_DEFAULT);
    if (attribute < 0) return 0;
    const hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
    const hssize_t n = space >= 0 ? H5Sget_simple_extent_npoints(space) : 0;
    const bool fits = type >= 0 && H5Tget_class(type) == H5T_STRING &&
                      H5Tis_variable_str(type) <= 0 && H5Tget_size(type) == NMM_H5_TEXT && n > 0 &&
                      n <= NMM_H5_COLUMNS && H5Aread(attribute, type, text) >= 0;
    for (hssize_t i = 0; fits && i < n; i++)
        text[i][NMM_H5_TEXT - 1] = 0;
    if (type >= 0) H5Tclose(type);
    if (space >= 0) H5Sclose(space);
    H5Aclose(attribute);
    return fits ? (int)n : 0;
}

static int find_name(int n, column_texts text, const char *name) {
    for (int i = 0; i < n; i++) {
        if (strcmp(text[i], name) == 0) return i;
    }
    return -1;
}

bool nmm_h5_record_has(nmm_h5 *h5, const char *name, const char *column) {
    column_texts text;
    return find_name(read_names(h5, name, text), text, column) >= 0;
}

nmm_status nmm_h5_record_rows(nmm_h5 *h5, const char *name, long *rows) {
    column_texts text;
    const int width = read_names(h5, name, text);
    if (width == 0) return nmm_h5_fail_read(h5, name, "no table with named columns");
    return nmm_h5_rows(h5, name, width, rows);
}

nmm_status nmm_h5_record_get(nmm_h5 *h5, const char *name, const nmm_h5_record *record, long first,
                             long n, void *rows) {
    column_texts text;
    const int width = read_names(h5, name, text);
    double *value = NULL;
    if (width == 0) return nmm_h5_fail_read(h5, name, "no table with named columns");
    TRY(nmm_allocate(h5->context, &value, (size_t)n * (size_t)width, sizeof *value));
    nmm_status status =
        nmm_h5_get(h5, name, H5T_NATIVE_DOUBLE, width, (const long[2]){first, n}, value);
    for (int i = 0; status == NMM_OK && i < record->n; i++) {
        const int k = find_name(width, text, record->column[i].name);
        bool fits = true;
        for (long r = 0; k >= 0 && fits && r < n; r++) {
            fits = set_value(&record->column[i], (char *)rows + (size_t)r * record->size,
                             value[r * width + k]);
        }
        if (!fits) status = nmm_h5_fail_read(h5, name, "a number is out of range");
    }
    nmm_release(h5->context, &value);
    return status;
}

// --- Single records

static hid_t column_type(const nmm_h5_column *column) {
    if (column->kind == 's') {
        const hid_t text = H5Tcopy(H5T_C_S1);
        if (text >= 0) H5Tset_size(text, column->size);
        return text;
    }
    switch (column->kind) {
    case 'i':
        return H5Tcopy(H5T_NATIVE_INT);
    case 'l':
        return H5Tcopy(H5T_NATIVE_LONG);
    case 'u':
        return H5Tcopy(H5T_NATIVE_UINT64);
    default:
        return H5Tcopy(H5T_NATIVE_DOUBLE);
    }
}

static hid_t compound_type(const nmm_h5_record *record) {
    const hid_t type = H5Tcreate(H5T_COMPOUND, record->size);
    for (int i = 0; type >= 0 && i < record->n; i++) {
        const hid_t part = column_type(&record->column[i]);
        H5Tinsert(type, record->column[i].name, record->column[i].offset, part);
        H5Tclose(part);
    }
    return type;
}

nmm_status nmm_h5_single_create(nmm_h5 *h5, const char *name, const nmm_h5_record *record) {
    const hid_t type = compound_type(record);
    if (type < 0) return nmm_h5_fail_write(h5, name);
    H5Tpack(type);
    const hid_t dataset = nmm_h5_scalar_create(h5->file, name, type);
    const nmm_status status = dataset >= 0 ? NMM_OK : nmm_h5_fail_write(h5, name);
    if (dataset >= 0) H5Dclose(dataset);
    H5Tclose(type);
    return status;
}

nmm_status nmm_h5_single_set(nmm_h5 *h5, const char *name, const nmm_h5_record *record,
                             const void *row) {
    const hid_t type = compound_type(record);
    const hid_t dataset = H5Dopen2(h5->file, name, H5P_DEFAULT);
    const bool written = type >= 0 && dataset >= 0 &&
                         H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, h5->transfer, row) >= 0;
    const nmm_status status = written ? NMM_OK : nmm_h5_fail_write(h5, name);
    if (dataset >= 0) H5Dclose(dataset);
    if (type >= 0) H5Tclose(type);
    return status;
}

// A member of the file must be of the class that we expect: text is not read as a number.
static bool members_agree(hid_t dataset, const nmm_h5_record *record) {
    const hid_t stored = H5Dget_type(dataset);
    bool agreed = stored >= 0 && H5Tget_class(stored) == H5T_COMPOUND;
    for (int i = 0; agreed && i < record->n; i++) {
        const int k = H5Tget_member_index(stored, record->column[i].name);
        if (k < 0) continue;
        const H5T_class_t class = H5Tget_member_class(stored, (unsigned)k);
        const bool number = class == H5T_INTEGER || class == H5T_FLOAT;
        agreed = record->column[i].kind == 's' ? class == H5T_STRING : number;
    }
    if (stored >= 0) H5Tclose(stored);
    return agreed;
}

nmm_status nmm_h5_single_get(nmm_h5 *h5, const char *name, const nmm_h5_record *record, void *row) {
    hid_t dataset = H5I_INVALID_HID;
    TRY(nmm_h5_dataset_open(h5, name, &dataset));
    const hid_t space = H5Dget_space(dataset);
    const bool scalar = space >= 0 && H5Sget_simple_extent_type(space) == H5S_SCALAR;
    const hid_t type = compound_type(record);
    nmm_status status = NMM_OK;
    if (!scalar || !members_agree(dataset, record)) {
        status = nmm_h5_fail_read(h5, name, "unexpected members");
    } else if (H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, row) < 0) {
        status = nmm_h5_fail_read(h5, name, NULL);
    }
    if (type >= 0) H5Tclose(type);
    if (space >= 0) H5Sclose(space);
    H5Dclose(dataset);
    return status;
}
