// SPDX-License-Identifier: MIT
//
// Wrong scenes: every mistake that bad/index.txt lists for a file must be reported at its line and
// column, in file order, with the words listed, and no other. Good scenes must be read.

#include "cover.h"
#include "test.h"

#include <dirent.h>
#include <stdlib.h>

static const char *folder;

typedef struct expectation {
    char file[80], words[120];
    int line, column;
} expectation;

static int read_index(expectation *list, int most) {
    char path[512], line[512];
    snprintf(path, sizeof path, "%s/bad/index.txt", folder);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    int n = 0;
    while (fgets(line, sizeof line, file) != NULL) {
        expectation *e = &list[n];
        if (line[0] == '#') continue;
        assert_true(n < most);
        assert_int_equal(
            sscanf(line, "%79s %d:%d %119[^\n]", e->file, &e->line, &e->column, e->words), 4);
        n += 1;
    }
    fclose(file);
    return n;
}

// Position and message of the next mistake in a report; NULL: none. *at moves behind it.
static const char *next_mistake(const char **at, const char *path, int *line, int *column) {
    const size_t length = strlen(path);
    for (const char *p = *at; p != NULL && *p != 0; p = strchr(p, '\n')) {
        if (*p == '\n') p += 1;
        if (strncmp(p, path, length) != 0) continue;
        if (sscanf(p + length, ":%d:%d: error: ", line, column) != 2) continue;
        *at = p + length;
        return strstr(p, "error: ");
    }
    return NULL;
}

static int check_mistakes(const char *path, const nmm_scene *scene, const expectation *e, int n) {
    int n_wrong = 0, line = 0, column = 0;
    const char *at = scene->report;
    for (int i = 0; i < n; i++) {
        const char *message = next_mistake(&at, path, &line, &column);
        const char *found = message != NULL ? strstr(message, e[i].words) : NULL;
        const bool same_line =
            found != NULL && memchr(message, '\n', (size_t)(found - message)) == NULL;
        if (same_line && line == e[i].line && column == e[i].column) continue;
        print_error("%s: expected %d:%d %s\n", e[i].file, e[i].line, e[i].column, e[i].words);
        n_wrong += 1;
    }
    if (n_wrong == 0 && scene->n_error != n) {
        print_error("%s: expected %d mistakes, found %d\n", e->file, n, scene->n_error);
        n_wrong = 1;
    }
    if (n_wrong > 0) print_error("%s\n", scene->report != NULL ? scene->report : "(no report)");
    return n_wrong;
}

static int check_bad(const expectation *e, int n) {
    char path[512];
    snprintf(path, sizeof path, "%s/bad/%s", folder, e->file);
    nmm_context context = {.n_thread = 1};
    nmm_scene scene = {0};
    // What reads well is refused when it is cut.
    nmm_model model = {0};
    nmm_status status = nmm_scene_read(&context, &scene, path, 0, NULL);
    if (status == NMM_OK) status = nmm_cover_build(&context, &scene, &model, NULL);
    assert_int_equal(status, NMM_ERROR_INPUT);
    nmm_model_destroy(&context, &model);
    const int n_wrong = check_mistakes(path, &scene, e, n);
    // The context holds the first of them.
    if (n_wrong == 0) {
        assert_int_equal(context.error.status, NMM_ERROR_INPUT);
        assert_string_equal(context.error.file, path);
        assert_int_equal(context.error.line, e->line);
        assert_int_equal(context.error.column, e->column);
        assert_non_null(strstr(context.error.message, e->words));
    }
    nmm_scene_destroy(&context, &scene);
    assert_int_equal(context.n_live, 0);
    return n_wrong;
}

static int count_files(const char *name) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    DIR *directory = opendir(path);
    assert_non_null(directory);
    int n = 0;
    for (const struct dirent *entry = readdir(directory); entry != NULL; entry = readdir(directory))
        n += strstr(entry->d_name, ".yaml") != NULL ? 1 : 0;
    closedir(directory);
    return n;
}

static void bad_scenes_are_rejected(void **unused) {
    (void)unused;
    enum { MOST = 1000 };
    static expectation list[MOST];
    const int n = read_index(list, MOST);
    int n_file = 0, n_wrong = 0;
    for (int i = 0, next; i < n; i = next) {
        next = i + 1;
        while (next < n && strcmp(list[next].file, list[i].file) == 0)
            next += 1;
        n_wrong += check_bad(&list[i], next - i);
        n_file += 1;
    }
    assert_int_equal(n_wrong, 0);
    // No file of the corpus is forgotten.
    assert_int_equal(n_file, count_files("bad"));
    assert_true(n_file >= 70);
}

static void good_scenes_are_read(void **unused) {
    (void)unused;
    char path[512];
    snprintf(path, sizeof path, "%s/good", folder);
    DIR *directory = opendir(path);
    assert_non_null(directory);
    for (const struct dirent *entry = readdir(directory); entry != NULL;
         entry = readdir(directory)) {
        if (strstr(entry->d_name, ".yaml") == NULL) continue;
        char name[800];
        snprintf(name, sizeof name, "%s/%s", path, entry->d_name);
        nmm_context context = {.n_thread = 1};
        nmm_scene scene = {0};
        const nmm_status status = nmm_scene_read(&context, &scene, name, 0, NULL);
        if (status != NMM_OK) print_error("%s\n", scene.report != NULL ? scene.report : name);
        assert_int_equal(status, NMM_OK);
        nmm_scene_destroy(&context, &scene);
        assert_int_equal(context.n_live, 0);
    }
    closedir(directory);
}

static void missing_file_is_no_scene(void **unused) {
    (void)unused;
    nmm_context context = {.n_thread = 1};
    nmm_scene scene = {0};
    assert_int_equal(nmm_scene_read(&context, &scene, "no/such/file.yaml", 0, NULL),
                     NMM_ERROR_FILE);
    assert_non_null(strstr(context.error.message, "no/such/file.yaml"));
    nmm_scene_destroy(&context, &scene);
    nmm_context_clear(&context);
    // A folder opens, but cannot be read.
    assert_int_equal(nmm_scene_read(&context, &scene, folder, 0, NULL), NMM_ERROR_FILE);
    nmm_scene_destroy(&context, &scene);
    assert_int_equal(context.n_live, 0);
}

int main(int n_argument, char **argument) {
    folder = n_argument > 1 ? argument[1] : ".";
    const struct CMUnitTest test[] = {
        cmocka_unit_test(bad_scenes_are_rejected),
        cmocka_unit_test(good_scenes_are_read),
        cmocka_unit_test(missing_file_is_no_scene),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
