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

nmm_status nmm_h5_dataset_open(nmm_h5 *h5, const char *name, hid_t *dataset) {
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
    TRY(nmm_h5_dataset_open(h5, name, &dataset));
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

nmm_status nmm_h5_get(nmm_h5 *h5, const char *name, hid_t memory, int width, const long range[2],
                      void *data) {
    const long first = range[0], n = range[1];
    hid_t dataset = H5I_INVALID_HID;
    TRY(nmm_h5_dataset_open(h5, name, &dataset));
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
        const hsize_t place[3] = {(hsize_t)first, (hsize_t)n, (hsize_t)width};
        status = read_rows(h5, name, dataset, memory, place, data);
    }
    H5Dclose(dataset);
    return status;
}

// --- Texts and attributes

// Size of the fixed-length text type of a dataset or attribute; 0: not such a text.
static size_t text_size(hid_t type) {
    if (type < 0 || H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0) return 0;
    const size_t size = H5Tget_size(type);
    return size <= MAX_TEXT ? size : 0;
}

static bool is_scalar(hid_t dataset) {
    const hid_t space = H5Dget_space(dataset);
    if (space < 0) return false;
    const bool scalar = H5Sget_simple_extent_type(space) == H5S_SCALAR;
    H5Sclose(space);
    return scalar;
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
    TRY(nmm_h5_dataset_open(h5, name, &dataset));
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

bool nmm_h5_attribute_exists(nmm_h5 *h5, const char *object, const char *name) {
    if (strcmp(object, "/") != 0 && !nmm_h5_exists(h5, object)) return false;
    return H5Aexists_by_name(h5->file, object, name, H5P_DEFAULT) > 0;
}

static hid_t open_attribute(nmm_h5 *h5, const char *object, const char *name) {
    if (!nmm_h5_attribute_exists(h5, object, name)) return H5I_INVALID_HID;
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
