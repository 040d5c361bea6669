// SPDX-License-Identifier: MIT
//
// Names of the machines that measured: the processor from /proc/cpuinfo, an NVIDIA GPU from what
// its driver says there. Where neither is, a plain word.

#include "bench.h"

#include <glob.h>
#include <stdio.h>
#include <string.h>

// The text behind `key` and a colon, of the first line that has it.
static bool find_value(const char *path, const char *key, char *value, size_t room) {
    char line[512];
    bool found = false;
    FILE *file = fopen(path, "re");
    if (file == NULL) return false;
    while (!found && fgets(line, sizeof line, file) != NULL) {
        const char *colon = strchr(line, ':');
        if (colon == NULL || strncmp(line, key, strlen(key)) != 0) continue;
        const char *from = colon + 1 + strspn(colon + 1, " \t");
        snprintf(value, room, "%.*s", (int)strcspn(from, "\n"), from);
        found = value[0] != 0;
    }
    fclose(file);
    return found;
}

nmm_status nmm_bench_host(nmm_bench *bench, const char **name) {
    char value[128];
    const bool found = find_value("/proc/cpuinfo", "model name", value, sizeof value);
    return nmm_bench_words(bench, name, "%s", found ? value : "host");
}

nmm_status nmm_bench_target(nmm_bench *bench, const char **name) {
    char value[128];
    glob_t list = {0};
    bool found = false;
    if (glob("/proc/driver/nvidia/gpus/*/information", 0, NULL, &list) == 0 && list.gl_pathc > 0)
        found = find_value(list.gl_pathv[0], "Model", value, sizeof value);
    globfree(&list);
    // The preset fake-device, or a device without such a driver.
    return nmm_bench_words(bench, name, "%s", found ? value : "target device (not a known GPU)");
}

nmm_status nmm_bench_say_machine(nmm_bench *bench, int column, bool on_target) {
    const char *name = NULL;
    TRY(on_target ? nmm_bench_target(bench, &name) : nmm_bench_host(bench, &name));
    return nmm_bench_say(bench, column, name);
}
