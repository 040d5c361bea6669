// SPDX-License-Identifier: MIT
//
// Writing into an open HDF5 file: tables that grow, texts, attributes.
//
// Rows are put at a given place, not at the end: writing a frame twice gives the same file. No
// object carries a time stamp, so that equal runs give equal datasets.

#include "h5.h"

#include <string.h>

static hid_t link_properties(void) {
    const hid_t link = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(link, 1);
    return link;
}

// --- Attributes

// Create or open attribute `name` and write it; all handles are closed here.
bool nmm_h5_attribute_write(hid_t object, const char *name, hid_t type, hid_t space,
                            const void *value) {
    hid_t attribute = H5I_INVALID_HID;
    if (H5Aexists(object, name) > 0)
        attribute = H5Aopen(object, name, H5P_DEFAULT);
    else
        attribute = H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    if (attribute < 0) return false;
    const bool written = H5Awrite(attribute, type, value) >= 0;
    return H5Aclose(attribute) >= 0 && written;
}

hid_t nmm_h5_text_type(size_t size) {
    const hid_t type = H5Tcopy(H5T_C_S1);
    if (type < 0) return type;
    H5Tset_size(type, size > 0 ? size : 1);
    H5Tset_strpad(type, H5T_STR_NULLPAD);
    return type;
}

static bool is_ascii(const char *text, size_t length) {
    for (size_t i = 0; i < length; i++) {
        if ((unsigned char)text[i] > 127) return false;
    }
    return true;
}

static bool write_text_attribute(hid_t object, const char *name, const char *text, size_t room) {
    char small[256] = {0};
    const size_t length = strlen(text);
    const hid_t type = nmm_h5_text_type(room > length ? room : length);
    const hid_t space = H5Screate(H5S_SCALAR);
    if (!is_ascii(text, length)) H5Tset_cset(type, H5T_CSET_UTF8);
    // Room behind the text is filled with zeros; only short texts ask for room.
    NMM_ASSERT(room < sizeof small);
    const char *bytes = text;
    if (length < sizeof small) bytes = memcpy(small, text, length);
    const bool written = type >= 0 && nmm_h5_attribute_write(object, name, type, space, bytes);
    H5Sclose(space);
    H5Tclose(type);
    return written;
}

nmm_status nmm_h5_attribute_text(nmm_h5 *h5, const char *object, const char *name, const char *text,
                                 size_t room) {
    const hid_t place = H5Oopen(h5->file, object, H5P_DEFAULT);
    const bool written = place >= 0 && write_text_attribute(place, name, text, room);
    if (place >= 0) H5Oclose(place);
    return written ? NMM_OK : nmm_h5_fail_write(h5, name);
}

nmm_status nmm_h5_attribute_put(nmm_h5 *h5, const char *object, const char *name, hid_t type, int n,
                                const void *value) {
    const hsize_t size = (hsize_t)n;
    const hid_t place = H5Oopen(h5->file, object, H5P_DEFAULT);
    const hid_t space = n > 0 ? H5Screate_simple(1, &size, NULL) : H5Screate(H5S_SCALAR);
    const bool written = place >= 0 && nmm_h5_attribute_write(place, name, type, space, value);
    H5Sclose(space);
    if (place >= 0) H5Oclose(place);
    return written ? NMM_OK : nmm_h5_fail_write(h5, name);
}

// --- Tables

nmm_status nmm_h5_group_create(nmm_h5 *h5, const char *name) {
    const hid_t link = link_properties();
    const hid_t group = H5Gcreate2(h5->file, name, link, H5P_DEFAULT, H5P_DEFAULT);
    if (group < 0) TRY(nmm_h5_fail_write(h5, name));
    H5Pclose(link);
    H5Gclose(group);
    return NMM_OK;
}

// A dataset of no rows that can grow.
static hid_t create_growing(hid_t file, const nmm_h5_table *table) {
    const int rank = table->width > 0 ? 2 : 1;
    const hsize_t width = (hsize_t)table->width;
    const hsize_t size[2] = {0, width}, most[2] = {H5S_UNLIMITED, width};
    const hsize_t chunk[2] = {table->chunk, width};
    const hid_t space = H5Screate_simple(rank, size, most);
    const hid_t create = H5Pcreate(H5P_DATASET_CREATE);
    const hid_t link = link_properties();
    H5Pset_obj_track_times(create, false);
    H5Pset_chunk(create, rank, chunk);
    if (table->compress && H5Zfilter_avail(H5Z_FILTER_DEFLATE) > 0) {
        H5Pset_shuffle(create);
        H5Pset_deflate(create, 1);
    }
    const hid_t dataset =
        H5Dcreate2(file, table->name, table->type, space, link, create, H5P_DEFAULT);
    H5Pclose(link);
    H5Pclose(create);
    H5Sclose(space);
    return dataset;
}

nmm_status nmm_h5_table_create(nmm_h5 *h5, const nmm_h5_table *table) {
    NMM_ASSERT(table->chunk > 0);
    const hid_t dataset = create_growing(h5->file, table);
    if (dataset < 0) return nmm_h5_fail_write(h5, table->name);
    bool written = true;
    if (table->unit != NULL) written = write_text_attribute(dataset, "unit", table->unit, 0);
    if (written && table->meaning != NULL)
        written = write_text_attribute(dataset, "meaning", table->meaning, 0);
    written = H5Dclose(dataset) >= 0 && written;
    return written ? NMM_OK : nmm_h5_fail_write(h5, table->name);
}

// The last `n` rows from `first` on, of a dataset that ends there. The error is told here, while
// HDF5 still knows it.
static nmm_status write_rows(nmm_h5 *h5, const char *name, hid_t dataset, hid_t memory,
                             const hsize_t range[2], const void *data) {
    const hid_t space = H5Dget_space(dataset);
    hsize_t size[2] = {0, 0};
    const int rank = H5Sget_simple_extent_dims(space, size, NULL);
    const hsize_t start[2] = {range[0], 0}, count[2] = {range[1], size[1]};
    const hid_t rows = H5Screate_simple(rank, count, NULL);
    nmm_status status = NMM_OK;
    if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL) < 0 ||
        H5Dwrite(dataset, memory, rows, space, h5->transfer, data) < 0)
        status = nmm_h5_fail_write(h5, name);
    H5Sclose(rows);
    H5Sclose(space);
    return status;
}

static nmm_status put_rows(nmm_h5 *h5, const char *name, hid_t dataset, hid_t memory,
                           const hsize_t range[2], const void *data) {
    const hid_t space = H5Dget_space(dataset);
    hsize_t size[2] = {0, 0};
    const int rank = H5Sget_simple_extent_ndims(space);
    if (rank == 1 || rank == 2) H5Sget_simple_extent_dims(space, size, NULL);
    H5Sclose(space);
    size[0] = range[0] + range[1];
    if (rank < 1 || rank > 2 || H5Dset_extent(dataset, size) < 0)
        return nmm_h5_fail_write(h5, name);
    if (range[1] == 0) return NMM_OK;
    return write_rows(h5, name, dataset, memory, range, data);
}

nmm_status nmm_h5_put(nmm_h5 *h5, const char *name, hid_t memory, hsize_t first, hsize_t n,
                      const void *data) {
    const hid_t dataset = H5Dopen2(h5->file, name, H5P_DEFAULT);
    if (dataset < 0) return nmm_h5_fail_write(h5, name);
    const hsize_t range[2] = {first, n};
    const nmm_status status = put_rows(h5, name, dataset, memory, range, data);
    if (H5Dclose(dataset) < 0 && status == NMM_OK) return nmm_h5_fail_write(h5, name);
    return status;
}

// --- Texts

hid_t nmm_h5_scalar_create(hid_t file, const char *name, hid_t type) {
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t create = H5Pcreate(H5P_DATASET_CREATE);
    const hid_t link = link_properties();
    H5Pset_obj_track_times(create, false);
    // Space is taken now: later writes only change bytes in place.
    H5Pset_alloc_time(create, H5D_ALLOC_TIME_EARLY);
    const hid_t dataset = H5Dcreate2(file, name, type, space, link, create, H5P_DEFAULT);
    H5Pclose(link);
    H5Pclose(create);
    H5Sclose(space);
    return dataset;
}

nmm_status nmm_h5_text_create(nmm_h5 *h5, const char *name, const char *text, size_t length) {
    // Marked as ASCII even where it is UTF-8: Octave refuses others, and the whole group with them.
    const hid_t type = nmm_h5_text_type(length);
    const hid_t dataset = nmm_h5_scalar_create(h5->file, name, type);
    const bool written = dataset >= 0 && H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, h5->transfer,
                                                  length > 0 ? text : "") >= 0;
    const nmm_status status = written ? NMM_OK : nmm_h5_fail_write(h5, name);
    if (dataset >= 0) H5Dclose(dataset);
    H5Tclose(type);
    return status;
}
