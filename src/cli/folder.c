// SPDX-License-Identifier: MIT
//
// Folders that results go to: made with those above them, and told about before minutes of
// computing where that is not possible.

#include "folder.h"

#include "message.h"
#include "options.h"

#include <errno.h>
#include <limits.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool is_folder(const char *path) {
    struct stat about;
    return stat(path, &about) == 0 && S_ISDIR(about.st_mode);
}

int folder_make(const char *path) {
    char part[PATH_MAX];
    const size_t length = strlen(path);
    if (length >= sizeof part) {
        message_error("%s: %s", path, strerror(ENAMETOOLONG));
        return EXIT_SYSTEM;
    }
    for (size_t n = 1; n <= length; n++) {
        if (path[n] != '/' && path[n] != 0) continue;
        snprintf(part, sizeof part, "%.*s", (int)n, path);
        if (mkdir(part, 0777) != 0 && errno != EEXIST) {
            message_error("cannot make the folder %s: %s", part, strerror(errno));
            return EXIT_SYSTEM;
        }
    }
    if (!is_folder(path))
        errno = ENOTDIR;
    else if (access(path, W_OK | X_OK) == 0)
        return EXIT_DONE;
    message_error("cannot write into %s: %s", path, strerror(errno));
    return EXIT_SYSTEM;
}

void folder_remove_empty(const char *path) {
    (void)rmdir(path);
}
