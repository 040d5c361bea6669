// SPDX-License-Identifier: MIT
//
// Reading from an open HDF5 file that may be damaged or somebody else's: every dataset is checked
// for rank, width, class and size before a byte is read, and nothing is believed.

#include "h5.h"

#include <stdio.h>
#include <string.h>

// Texts longer than this are damage, not scenes.
#define MAX_TEXT ((size_t)1 << 28)

// Does every part of the path exist as a link?
bool nmm_h5_exists(nmm_h5 *h5, const char *name) {
    char part[256];
    const size_t length = strlen(name);
    if (length >= sizeof part) return false;
    for (size_t i = 1; i <= length; i++) {
        if (name[i] != '/' && name[i] != 0) continue;
        memcpy(part, name, i);
        part[i] = 0;
        if (H5Lexists(h5->file, part, H5P_DEFAULT) <= 0) return false;
    }
    return H5Oexists_by_name(h5->file, name, H5P_DEFAULT) > 0;
}

static nmm_status open_dataset(nmm_h5 *h5, const char *name, hid_t *dataset) {
    *dataset = H5I_INVALID_HID;
    if (!nmm_h5_exists(h5, name)) return nmm_h5_fail_read(h5, name, "not there");
    *dataset = H5Dopen2(h5->file, name, H5P_DEFAULT);
    return *dataset < 0 ? nmm_h5_fail_read(h5, name, NULL) : NMM_OK;
}

// Rows of a dataset of numbers with `width` numbers in a row (0: rank 1); -1: another shape.
static long count_rows(hid_t dataset, int width) {
    hsize_t size[2] = {0, 0};
    const hid_t space = H5Dget_space(dataset);
    if (space < 0) return -1;
    const int rank = H5Sget_simple_extent_ndims(space);
    const bool fits = rank == (width > 0 ? 2 : 1) &&
                      H5Sget_simple_extent_dims(space, size, NULL) == rank &&
                      size[1] == (hsize_t)width && size[0] < INT32_MAX;
    H5Sclose(space);
    return fits ? (long)size[0] : -1;
}

static H5T_class_t class_of(hid_t dataset) {
    const hid_t type = H5Dget_type(dataset);
    if (type < 0) return H5T_NO_CLASS;
    const H5T_class_t class = H5Tget_class(type);
    H5Tclose(type);
    return class;
}

// Can the rows be in the file? gzip makes nothing smaller than a thousandth.
static bool is_plausible(nmm_h5 *h5, hid_t dataset, long rows) {
    hsize_t size = 0;
    const hsize_t stored = H5Dget_storage_size(dataset);
    if (H5Fget_filesize(h5->file, &size) < 0 || stored > size) return false;
    return (hsize_t)rows <= 1100 * stored + 1024;
}

nmm_status nmm_h5_rows(nmm_h5 *h5, const char *name, int width, long *rows) {
    hid_t dataset = H5I_INVALID_HID;
    TRY(open_dataset(h5, name, &dataset));
    *rows = count_rows(dataset, width);
    const bool plausible = *rows >= 0 && is_plausible(h5, dataset, *rows);
    H5Dclose(dataset);
    if (*rows < 0) return nmm_h5_fail_read(h5, name, "wrong shape");
    return plausible ? NMM_OK : nmm_h5_fail_read(h5, name, "more rows than the file can hold");
}

static nmm_status read_rows(nmm_h5 *h5, const char *name, hid_t dataset, hid_t memory,
                            const hsize_t range[3], void *data) {
    const int rank = range[2] > 0 ? 2 : 1;
    const hsize_t start[2] = {range[0], 0}, count[2] = {range[1], range[2]};
    const hid_t space = H5Dget_space(dataset);
    const hid_t rows = H5Screate_simple(rank, count, NULL);
    nmm_status status = NMM_OK;
    if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL) < 0 ||
        H5Dread(dataset, memory, rows, space, H5P_DEFAULT, data) < 0)
        status = nmm_h5_fail_read(h5, name, NULL);
    H5Sclose(rows);
    H5Sclose(space);
    return status;
}

nmm_status nmm_h5_get(nmm_h5 *h5, const char *name, hid_t memory, int width, long first, long n,
                      void *data) {
    hid_t dataset = H5I_INVALID_HID;
    TRY(open_dataset(h5, name, &dataset));
    const long rows = count_rows(dataset, width);
    const H5T_class_t class = class_of(dataset);
    nmm_status status = NMM_OK;
    if (class != H5T_INTEGER && class != H5T_FLOAT) {
        status = nmm_h5_fail_read(h5, name, "holds no numbers");
    } else if (rows < 0) {
        status = nmm_h5_fail_read(h5, name, "wrong shape");
    } else if (first < 0 || n < 0 || first > rows - n) {
        status = nmm_h5_fail_read(h5, name, "too few rows");
    } else if (n > 0) {
        const hsize_t range[3] = {(hsize_t)first, (hsize_t)n, (hsize_t)width};
        status = read_rows(h5, name, dataset, memory, range, data);
    }
    H5Dclose(dataset);
    return status;
}

// --- Records
// -------------------------------------------------------------------------------------

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

hid_t nmm_h5_record_type(const nmm_h5_record *record, const bool *keep) {
    const hid_t type = H5Tcreate(H5T_COMPOUND, record->size);
    for (int i = 0; type >= 0 && i < record->n; i++) {
        if (keep != NULL && !keep[i]) continue;
        const hid_t part = column_type(&record->column[i]);
        H5Tinsert(type, record->column[i].name, record->column[i].offset, part);
        H5Tclose(part);
    }
    return type;
}

// A column of the file must be of the class that we expect: text is not read as a number.
static bool columns_agree(hid_t stored, const nmm_h5_record *record) {
    if (H5Tget_class(stored) != H5T_COMPOUND) return false;
    for (int i = 0; i < record->n; i++) {
        const int k = H5Tget_member_index(stored, record->column[i].name);
        if (k < 0) continue;
        const H5T_class_t class = H5Tget_member_class(stored, (unsigned)k);
        const bool number = class == H5T_INTEGER || class == H5T_FLOAT;
        if (record->column[i].kind == 's' ? class != H5T_STRING : !number) return false;
    }
    return true;
}

static nmm_status read_record(nmm_h5 *h5, const char *name, const nmm_h5_record *record,
                              hid_t dataset, const hsize_t range[3], void *rows) {
    const hid_t stored = H5Dget_type(dataset);
    const bool agreed = stored >= 0 && columns_agree(stored, record);
    if (stored >= 0) H5Tclose(stored);
    if (!agreed) return nmm_h5_fail_read(h5, name, "unexpected columns");
    const hid_t type = nmm_h5_record_type(record, NULL);
    nmm_status status = NMM_OK;
    if (range[1] == 0) {
        if (H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows) < 0)
            status = nmm_h5_fail_read(h5, name, NULL);
    } else {
        status = read_rows(h5, name, dataset, type, range, rows);
    }
    H5Tclose(type);
    return status;
}

static bool is_scalar(hid_t dataset) {
    const hid_t space = H5Dget_space(dataset);
    if (space < 0) return false;
    const bool scalar = H5Sget_simple_extent_type(space) == H5S_SCALAR;
    H5Sclose(space);
    return scalar;
}

nmm_status nmm_h5_record_get(nmm_h5 *h5, const char *name, const nmm_h5_record *record, long first,
                             long n, void *rows) {
    hid_t dataset = H5I_INVALID_HID;
    TRY(open_dataset(h5, name, &dataset));
    nmm_status status = NMM_OK;
    const bool scalar = is_scalar(dataset);
    const long found = scalar ? 1 : count_rows(dataset, 0);
    if (found < 0 || first < 0 || n < 0 || first > found - n) {
        status = nmm_h5_fail_read(h5, name, "too few rows");
    } else if (n > 0) {
        const hsize_t range[3] = {(hsize_t)first, scalar ? 0 : (hsize_t)n, 0};
        status = read_record(h5, name, record, dataset, range, rows);
    }
    H5Dclose(dataset);
    return status;
}

bool nmm_h5_record_has(nmm_h5 *h5, const char *name, const char *column) {
    hid_t dataset = H5I_INVALID_HID;
    if (!nmm_h5_exists(h5, name)) return false;
    dataset = H5Dopen2(h5->file, name, H5P_DEFAULT);
    if (dataset < 0) return false;
    const hid_t type = H5Dget_type(dataset);
    const bool has =
        type >= 0 && H5Tget_class(type) == H5T_COMPOUND && H5Tget_member_index(type, column) >= 0;
    if (type >= 0) H5Tclose(type);
    H5Dclose(dataset);
    return has;
}

// --- Texts and attributes
// ------------------------------------------------------------------------

// Size of the fixed-length text type of a dataset or attribute; 0: not such a text.
static size_t text_size(hid_t type) {
    if (type < 0 || H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0) return 0;
    const size_t size = H5Tget_size(type);
    return size <= MAX_TEXT ? size : 0;
}

static nmm_status read_text(nmm_h5 *h5, nmm_arena *arena, const char *name, hid_t dataset,
                            char **text) {
    const hid_t type = H5Dget_type(dataset);
    const size_t size = text_size(type);
    nmm_status status = NMM_OK;
    if (size == 0 || !is_scalar(dataset)) status = nmm_h5_fail_read(h5, name, "no text");
    if (status == NMM_OK) status = nmm_arena_take(h5->context, arena, text, size + 1, 1);
    if (status == NMM_OK && H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, *text) < 0)
        status = nmm_h5_fail_read(h5, name, NULL);
    if (type >= 0) H5Tclose(type);
    return status;
}

nmm_status nmm_h5_text_get(nmm_h5 *h5, nmm_arena *arena, const char *name, char **text,
                           size_t *length) {
    hid_t dataset = H5I_INVALID_HID;
    TRY(open_dataset(h5, name, &dataset));
    const nmm_status status = read_text(h5, arena, name, dataset, text);
    H5Dclose(dataset);
    if (status == NMM_OK && length != NULL) *length = strlen(*text);
    return status;
}

static bool read_text_attribute(hid_t attribute, char *text, size_t size) {
    const hid_t stored = H5Aget_type(attribute);
    const hid_t space = H5Aget_space(attribute);
    bool fits = text_size(stored) > 0 && H5Sget_simple_extent_type(space) == H5S_SCALAR;
    if (fits) {
        // The library converts to our length and ends the text.
        const hid_t type = H5Tcopy(stored);
        H5Tset_size(type, size);
        H5Tset_strpad(type, H5T_STR_NULLTERM);
        fits = H5Aread(attribute, type, text) >= 0;
        text[size - 1] = 0;
        H5Tclose(type);
    }
    if (space >= 0) H5Sclose(space);
    if (stored >= 0) H5Tclose(stored);
    return fits;
}

static hid_t open_attribute(nmm_h5 *h5, const char *object, const char *name) {
    if (strcmp(object, "/") != 0 && !nmm_h5_exists(h5, object)) return H5I_INVALID_HID;
    if (H5Aexists_by_name(h5->file, object, name, H5P_DEFAULT) <= 0) return H5I_INVALID_HID;
    return H5Aopen_by_name(h5->file, object, name, H5P_DEFAULT, H5P_DEFAULT);
}

nmm_status nmm_h5_attribute_text_get(nmm_h5 *h5, const char *object, const char *name, char *text,
                                     size_t size) {
    const hid_t attribute = open_attribute(h5, object, name);
    if (attribute < 0) return nmm_h5_fail_read(h5, name, "attribute not there");
    const bool fits = read_text_attribute(attribute, text, size);
    H5Aclose(attribute);
    return fits ? NMM_OK : nmm_h5_fail_read(h5, name, "no text");
}

nmm_status nmm_h5_attribute_get(nmm_h5 *h5, const char *object, const char *name, hid_t memory,
                                int n, void *value) {
    const hid_t attribute = open_attribute(h5, object, name);
    if (attribute < 0) return nmm_h5_fail_read(h5, name, "attribute not there");
    const hid_t space = H5Aget_space(attribute);
    const hid_t type = H5Aget_type(attribute);
    const H5T_class_t class = type >= 0 ? H5Tget_class(type) : H5T_NO_CLASS;
    const bool fits = (class == H5T_INTEGER || class == H5T_FLOAT) &&
                      H5Sget_simple_extent_npoints(space) == (n > 0 ? n : 1) &&
                      H5Aread(attribute, memory, value) >= 0;
    if (type >= 0) H5Tclose(type);
    if (space >= 0) H5Sclose(space);
    H5Aclose(attribute);
    return fits ? NMM_OK : nmm_h5_fail_read(h5, name, "wrong attribute");
}
