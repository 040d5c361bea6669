// SPDX-License-Identifier: MIT
//
// Files written whole or not at all: a temporary beside the file, renamed when it is complete.
// A full disk or a kill leaves what was there before.

#include "io.h"

#include <errno.h>
#include <locale.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static nmm_status fail(nmm_replacement *file, int error) {
    return nmm_fail(file->context, NMM_ERROR_FILE, "cannot write %s: %s", file->path,
                    strerror(error));
}

nmm_status nmm_replacement_open(nmm_context *context, nmm_replacement *file, const char *path) {
    const size_t length = strlen(path), room = length + 32;
    *file = (nmm_replacement){.context = context};
    TRY(nmm_allocate(context, &file->path, length + 1, 1));
    memcpy(file->path, path, length + 1);
    TRY(nmm_allocate(context, &file->temporary, room, 1));
    snprintf(file->temporary, room, "%s.%ld.part", path, (long)getpid());
    struct stat about;
    if (stat(path, &about) == 0 && S_ISDIR(about.st_mode)) return fail(file, EISDIR);
    file->stream = fopen(file->temporary, "wbe");
    return file->stream == NULL ? fail(file, errno) : NMM_OK;
}

void nmm_replacement_write(nmm_replacement *file, const void *bytes, size_t size) {
    if (file->error != 0 || size == 0) return;
    errno = 0;
    if (fwrite(bytes, 1, size, file->stream) != size) file->error = errno != 0 ? errno : EIO;
}

void nmm_replacement_print(nmm_replacement *file, const char *format, ...) {
    if (file->error != 0) return;
    va_list arguments;
    va_start(arguments, format);
    errno = 0;
    if (vfprintf(file->stream, format, arguments) < 0) file->error = errno != 0 ? errno : EIO;
    va_end(arguments);
}

nmm_status nmm_replacement_commit(nmm_replacement *file) {
    errno = 0;
    if (fclose(file->stream) != 0 && file->error == 0) file->error = errno != 0 ? errno : EIO;
    file->stream = NULL;
    if (file->error == 0 && rename(file->temporary, file->path) != 0) file->error = errno;
    const nmm_status status = file->error != 0 ? fail(file, file->error) : NMM_OK;
    if (status != NMM_OK) unlink(file->temporary);
    nmm_release(file->context, &file->temporary);
    nmm_release(file->context, &file->path);
    return status;
}

void nmm_replacement_drop(nmm_replacement *file) {
    if (file->context == NULL) return;
    if (file->stream != NULL) {
        fclose(file->stream);
        unlink(file->temporary);
    }
    nmm_release(file->context, &file->temporary);
    nmm_release(file->context, &file->path);
    *file = (nmm_replacement){0};
}

// The host program may have chosen a locale with another decimal point.
static void use_point(char *text) {
    const char *mark = localeconv()->decimal_point;
    const size_t length = strlen(mark);
    char *found = strcmp(mark, ".") != 0 ? strstr(text, mark) : NULL;
    if (found == NULL || length == 0) return;
    *found = '.';
    memmove(found + 1, found + length, strlen(found + length) + 1);
}

const char *nmm_number_text(char text[32], double x) {
    for (int digits = 6; digits <= 17; digits++) {
        snprintf(text, 32, "%.*g", digits, x);
        if (strtod(text, NULL) == x) break;
    }
    use_point(text);
    return text;
}
