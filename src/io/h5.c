// SPDX-License-Identifier: MIT
//
// Files of the HDF5 library: open with the locks as other processes need them, close, and turn
// HDF5's error stack into one sentence with the system's reason.
//
// Library bounds EARLIEST..V18: a file of a killed run opens again without repair, which newer
// formats refuse.

#include "h5.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

// The cache of chunks that each open table has.
enum { CHUNK_SLOTS = 17, CHUNK_BYTES = 1 << 20 };

// The buffer in which numbers change their type, made and cleared for each writing that needs one.
enum { BUFFER_BYTES = 1 << 16 };

nmm_h5_quiet nmm_h5_quiet_begin(void) {
    nmm_h5_quiet quiet = {0};
    H5Eget_auto2(H5E_DEFAULT, &quiet.print, &quiet.data);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return quiet;
}

void nmm_h5_quiet_end(nmm_h5_quiet quiet) {
    H5Eset_auto2(H5E_DEFAULT, quiet.print, quiet.data);
}

// --- Reasons

// What the error stack says: the system's message where there is one, else the innermost entry.
typedef struct reason {
    char text[200];
    bool from_system;
    bool locked;
} reason;

static herr_t read_entry(unsigned n, const H5E_error2_t *entry, void *user) {
    reason *found = user;
    const char *text = entry->desc != NULL ? entry->desc : "";
    if (n == 0 && !found->from_system) snprintf(found->text, sizeof found->text, "%s", text);
    if (strstr(text, "unable to lock file") != NULL) found->locked = true;
    const char *mark = "error message = '";
    const char *message = strstr(text, mark);
    if (message == NULL || found->from_system) return 0;
    message += strlen(mark);
    const char *end = strchr(message, '\'');
    const int length = end != NULL ? (int)(end - message) : (int)strlen(message);
    snprintf(found->text, sizeof found->text, "%.*s", length, message);
    found->from_system = true;
    return 0;
}

static reason last_reason(void) {
    reason found = {0};
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, read_entry, &found);
    if (found.text[0] == 0) snprintf(found.text, sizeof found.text, "the HDF5 library failed");
    return found;
}

nmm_status nmm_h5_fail_write(nmm_h5 *h5, const char *what) {
    const reason why = last_reason();
    return nmm_fail(h5->context, NMM_ERROR_FILE, "cannot write %s: %s (%s)", h5->name, why.text,
                    what);
}

nmm_status nmm_h5_fail_read(nmm_h5 *h5, const char *what, const char *why) {
    const reason deeper = last_reason();
    if (why == NULL) why = deeper.text;
    return nmm_fail(h5->context, NMM_ERROR_INPUT, "%s is damaged or no run file: %s: %s", h5->name,
                    what, why);
}

// --- Open and close

static hid_t access_properties(bool with_locks) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    if (access < 0) return access;
    H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_V18);
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
    H5Pset_file_locking(access, with_locks, true);
    // A writing touches one chunk or two of a table, and clears these slots for each.
    H5Pset_cache(access, 0, CHUNK_SLOTS, CHUNK_BYTES, 0.75);
    return access;
}

// *why is told when there is no file.
static hid_t open_once(const nmm_h5 *h5, nmm_h5_mode mode, bool with_locks, reason *why) {
    const hid_t access = access_properties(with_locks);
    if (access < 0) return access;
    hid_t file = H5I_INVALID_HID;
    if (mode == NMM_H5_CREATE) {
        const hid_t create = H5Pcreate(H5P_FILE_CREATE);
        H5Pset_obj_track_times(create, false);
        file = H5Fcreate(h5->path, H5F_ACC_TRUNC, create, access);
        if (file < 0) *why = last_reason();
        H5Pclose(create);
    } else {
        file = H5Fopen(h5->path, mode == NMM_H5_APPEND ? H5F_ACC_RDWR : H5F_ACC_RDONLY, access);
        if (file < 0) *why = last_reason();
    }
    H5Pclose(access);
    return file;
}

// What the system alone can say: missing, a folder, not readable.
static nmm_status check_readable(nmm_h5 *h5) {
    struct stat about;
    const int descriptor = open(h5->path, O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
        return nmm_fail(h5->context, NMM_ERROR_FILE, "cannot read %s: %s", h5->name,
                        strerror(errno));
    }
    const bool known = fstat(descriptor, &about) == 0;
    close(descriptor);
    if (known && S_ISREG(about.st_mode)) return NMM_OK;
    const char *why = known && S_ISDIR(about.st_mode) ? strerror(EISDIR) : "not a regular file";
    return nmm_fail(h5->context, NMM_ERROR_FILE, "cannot read %s: %s", h5->name, why);
}

static nmm_status fail_open(nmm_h5 *h5, nmm_h5_mode mode, reason why) {
    if (mode != NMM_H5_READ) {
        return nmm_fail(h5->context, NMM_ERROR_FILE, "cannot write %s: %s", h5->name, why.text);
    }
    if (why.locked) {
        return nmm_fail(h5->context, NMM_ERROR_FILE,
                        "cannot read %s: another program has kept it locked for %g s", h5->name,
                        NMM_H5_PATIENCE);
    }
    if (H5Fis_hdf5(h5->path) <= 0) {
        return nmm_fail(h5->context, NMM_ERROR_INPUT, "%s is not an HDF5 file", h5->name);
    }
    return nmm_fail(h5->context, NMM_ERROR_INPUT, "%s is damaged: %s", h5->name, why.text);
}

static nmm_status open_transfer(nmm_h5 *h5) {
    h5->transfer = H5Pcreate(H5P_DATASET_XFER);
    if (h5->transfer < 0 || H5Pset_buffer(h5->transfer, BUFFER_BYTES, NULL, NULL) < 0)
        return nmm_h5_fail_write(h5, "transfer");
    return NMM_OK;
}

static herr_t close_file(nmm_h5 *h5) {
    if (h5->transfer > 0) H5Pclose(h5->transfer);
    const herr_t closed = H5Fclose(h5->file);
    h5->file = h5->transfer = 0;
    return closed;
}

nmm_status nmm_h5_open(nmm_h5 *h5, nmm_h5_mode mode) {
    NMM_ASSERT(h5->file == 0);
    if (mode == NMM_H5_READ) TRY(check_readable(h5));
    const double start = nmm_clock();
    bool with_locks = true;
    for (;;) {
        reason why = {0};
        const hid_t file = open_once(h5, mode, with_locks, &why);
        if (file >= 0) {
            h5->file = file;
            return mode == NMM_H5_READ ? NMM_OK : open_transfer(h5);
        }
        if (!why.locked || !with_locks) return fail_open(h5, mode, why);
        if (nmm_clock() - start < NMM_H5_PATIENCE) {
            nanosleep(&(struct timespec){.tv_nsec = 20 * 1000 * 1000}, NULL);
        } else if (mode == NMM_H5_APPEND) {
            with_locks = false;
        } else {
            return fail_open(h5, mode, why);
        }
    }
}

nmm_status nmm_h5_reserve(nmm_h5 *h5, size_t bytes) {
    NMM_ASSERT(h5->file == 0);
    struct stat about = {0};
    const int descriptor = open(h5->path, O_WRONLY | O_CLOEXEC);
    int error = descriptor < 0 || fstat(descriptor, &about) != 0 ? errno : 0;
    if (error == 0) {
        // HDF5 cuts the file back to what it needs when it closes it.
        error = posix_fallocate(descriptor, about.st_size, (off_t)bytes);
        if (error != 0 && ftruncate(descriptor, about.st_size) != 0) error = errno;
    }
    if (descriptor >= 0) close(descriptor);
    // Some file systems cannot reserve.
    if (error == 0 || error == EOPNOTSUPP || error == EINVAL) return NMM_OK;
    return nmm_fail(h5->context, NMM_ERROR_FILE, "cannot write %s: %s", h5->name, strerror(error));
}

nmm_status nmm_h5_flush(nmm_h5 *h5) {
    if (H5Fflush(h5->file, H5F_SCOPE_GLOBAL) < 0) return nmm_h5_fail_write(h5, "flush");
    return NMM_OK;
}

nmm_status nmm_h5_close(nmm_h5 *h5) {
    if (h5->file == 0) return NMM_OK;
    return close_file(h5) < 0 ? nmm_h5_fail_write(h5, "close") : NMM_OK;
}

void nmm_h5_drop(nmm_h5 *h5) {
    if (h5->file != 0) close_file(h5);
}
