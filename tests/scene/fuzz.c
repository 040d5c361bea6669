// SPDX-License-Identifier: MIT
//
// Good and bad scenes mutated at random (seeded): cut short, bytes changed, lines swapped, words of
// the format put in. Whatever comes out: a scene, or a mistake with a line. Then each allocation of
// a reading fails in turn.

#include "scene.h"
#include "test.h"

#include <dirent.h>
#include <stdlib.h>

enum { MOST_FILES = 400, MOST_BYTES = 65536 };

static const char *folder;
static int n_file, n_good_file;
static char *file_text[MOST_FILES];
static size_t file_length[MOST_FILES];

static void load_folder(const char *name) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    DIR *directory = opendir(path);
    assert_non_null(directory);
    for (const struct dirent *entry = readdir(directory); entry != NULL;
         entry = readdir(directory)) {
        if (strstr(entry->d_name, ".yaml") == NULL) continue;
        char full[800];
        snprintf(full, sizeof full, "%s/%s", path, entry->d_name);
        FILE *file = fopen(full, "rb");
        assert_non_null(file);
        assert_true(n_file < MOST_FILES);
        file_text[n_file] = malloc(MOST_BYTES);
        assert_non_null(file_text[n_file]);
        file_length[n_file] = fread(file_text[n_file], 1, MOST_BYTES, file);
        fclose(file);
        n_file += 1;
    }
    closedir(directory);
}

static int load_all(void **unused) {
    (void)unused;
    load_folder("good");
    n_good_file = n_file;
    load_folder("bad");
    return n_file > 0 ? 0 : 1;
}

static int free_all(void **unused) {
    (void)unused;
    for (int i = 0; i < n_file; i++)
        free(file_text[i]);
    return 0;
}

// --- Mutations

typedef struct buffer {
    char text[MOST_BYTES];
    size_t length;
} buffer;

static size_t pick(nmm_random *random, size_t n) {
    return n > 0 ? (size_t)(nmm_random_next(random) % n) : 0;
}

// `n` bytes at `at` become `m` bytes of `with`.
static void splice(buffer *b, size_t at, size_t n, const char *with, size_t m) {
    if (b->length - n + m > MOST_BYTES) return;
    char kept[64];
    if (m > sizeof kept) m = sizeof kept;
    memcpy(kept, with, m);
    memmove(b->text + at + m, b->text + at + n, b->length - at - n);
    memcpy(b->text + at, kept, m);
    b->length += m;
    b->length -= n;
}

static size_t line_start(const buffer *b, size_t at) {
    while (at > 0 && b->text[at - 1] != '\n')
        at -= 1;
    return at;
}

static void swap_lines(buffer *b, nmm_random *random) {
    if (b->length == 0) return;
    const size_t first = line_start(b, pick(random, b->length));
    size_t second = first;
    while (second < b->length && b->text[second] != '\n')
        second += 1;
    if (second >= b->length) return;
    // Rotate: the line goes behind the next one.
    second += 1;
    size_t end = second;
    while (end < b->length && b->text[end] != '\n')
        end += 1;
    char kept[MOST_BYTES];
    memcpy(kept, b->text + first, second - first);
    memmove(b->text + first, b->text + second, end - second);
    memcpy(b->text + first + (end - second), kept, second - first);
}

static void mutate(buffer *b, nmm_random *random) {
    static const char *const word[] = {
        "[",      "]",   "{",    "}",   ": ",      "\n  ", "-1",      "1e308",         "0",
        "1e-300", "nan", "auto", "nmm", "polygon", "dip",  "block",   "&a ",           "*a",
        "\t",     "\"",  "'",    "#",   "---\n",   "? ",   "4194303", "spacing: 1e-7", "- ",
        ", ",     "!t ", "| \n"};
    const size_t n_word = sizeof word / sizeof *word;
    const size_t at = pick(random, b->length);
    const char *w = word[pick(random, n_word)];
    const char byte = (char)nmm_random_next(random);
    switch (pick(random, 7)) {
    case 0:
        b->length = at;
        break;
    case 1:
        if (b->length > 0) b->text[at] = byte;
        break;
    case 2:
        if (b->length > 0) b->text[at] = (char)(b->text[at] ^ (1 << pick(random, 8)));
        break;
    case 3:
        swap_lines(b, random);
        break;
    case 4:
        splice(b, at, 0, w, strlen(w));
        break;
    case 5:
        if (b->length > 0)
            splice(b, at, 1 + pick(random, (b->length - at < 20 ? b->length - at : 20)), w,
                   strlen(w));
        break;
    default:
        if (b->length > 0) splice(b, at, 1, "", 0);
    }
}

// --- Reading what came out

// Everything that later floors take for granted.
static void check_scene(const nmm_scene *scene) {
    assert_true(scene->n_domain + scene->n_block > 0);
    assert_true(scene->n_interface >= 1 && scene->n_material >= 1);
    for (int i = 0; i < scene->n_domain + scene->n_region + scene->n_block; i++) {
        const int k = i - scene->n_domain, j = k - scene->n_region;
        const nmm_scene_area *area = k < 0   ? &scene->domain[i]
                                     : j < 0 ? &scene->region[k]
                                             : &scene->block[j].area;
        assert_true(area->n >= 3);
        assert_true(area->material >= 0 && area->material < scene->n_material);
        double twice = 0;
        for (int c = 0; c < area->n; c++) {
            const nmm_vec2 p = area->corner[c], q = area->corner[(c + 1) % area->n];
            assert_true(isfinite(p.x) && isfinite(p.y));
            twice +=
                nmm_vec2_cross(nmm_vec2_sub(p, area->corner[0]), nmm_vec2_sub(q, area->corner[0]));
        }
        assert_true(twice > 0);
    }
    for (int i = 0; i < scene->n_joint; i++) {
        assert_true(scene->joint[i].n >= 2 && scene->joint[i].interface < scene->n_interface);
        for (int c = 0; c < scene->joint[i].n; c++)
            assert_true(isfinite(scene->joint[i].corner[c].x) &&
                        isfinite(scene->joint[i].corner[c].y));
    }
    for (int i = 0; i < scene->n_support; i++)
        assert_true(scene->support[i].history < scene->n_history);
    // Statics leave their steps to the model.
    const nmm_scene_settings *s = &scene->settings;
    assert_true(s->is_static ? s->dt >= 0 : s->dt > 0 && s->dt_min < s->dt);
    assert_non_null(scene->defaults);
}

static bool read_buffer(const buffer *b, int n_override, const char *const *override) {
    nmm_context context = {.n_thread = 1};
    nmm_scene scene = {0};
    const nmm_status status =
        nmm_scene_parse(&context, &scene, "fuzz.yaml", b->text, b->length, n_override, override);
    const bool good = status == NMM_OK;
    if (good) {
        check_scene(&scene);
        assert_int_equal(scene.n_error, 0);
    } else {
        assert_int_equal(status, NMM_ERROR_INPUT);
        assert_true(context.error.line > 0 && context.error.column > 0);
        assert_true(strlen(context.error.message) > 0);
        assert_true(scene.n_error > 0);
        assert_non_null(strstr(scene.report, ": error: "));
    }
    nmm_scene_destroy(&context, &scene);
    assert_int_equal(context.n_live, 0);
    return good;
}

static void mutated_scenes_never_crash(void **unused) {
    (void)unused;
    nmm_random random = nmm_random_seed(20240607);
    static buffer b;
    int n_good = 0;
    enum { ROUNDS = 12000 };
    for (int round = 0; round < ROUNDS; round++) {
        // Two of three from good scenes, whose mistakes lie deeper.
        const size_t k = pick(&random, (size_t)(round % 3 > 0 ? n_good_file : n_file));
        memcpy(b.text, file_text[k], file_length[k]);
        b.length = file_length[k];
        const size_t n = 1 + pick(&random, 4);
        for (size_t i = 0; i < n; i++)
            mutate(&b, &random);
        n_good += read_buffer(&b, 0, NULL) ? 1 : 0;
    }
    print_message("%d of %d mutated scenes are still good\n", n_good, ROUNDS);
    // Both ends of the question were asked.
    assert_true(n_good > 100 && n_good < ROUNDS / 2);
}

static void mutated_overrides_never_crash(void **unused) {
    (void)unused;
    static const char *const start[] = {"time.dt=1e-4",
                                        "joint_sets[0].spread={dip: 3}",
                                        "materials.sandstone.density=2 t/m3",
                                        "supports.0.fix=x",
                                        "monitors.crest.record=[stress]",
                                        "loads[2]={point: [20,24], force: [0,1]}"};
    nmm_random random = nmm_random_seed(7);
    static buffer scene, b;
    FILE *file = NULL;
    char path[512];
    snprintf(path, sizeof path, "%s/good/slope.yaml", folder);
    file = fopen(path, "rb");
    assert_non_null(file);
    scene.length = fread(scene.text, 1, MOST_BYTES, file);
    fclose(file);
    int n_good = 0;
    for (int round = 0; round < 1500; round++) {
        const char *from = start[pick(&random, sizeof start / sizeof *start)];
        b.length = strlen(from);
        memcpy(b.text, from, b.length);
        const size_t n = pick(&random, 4);
        for (size_t i = 0; i < n; i++)
            mutate(&b, &random);
        if (b.length >= MOST_BYTES) continue;
        b.text[b.length] = 0;
        const char *const override[] = {b.text};
        n_good += read_buffer(&scene, 1, override) ? 1 : 0;
    }
    assert_true(n_good > 100);
}

// --- Memory

static void every_allocation_may_fail(void **unused) {
    (void)unused;
    const char *const override[] = {"time.end=3"};
    long n_call = 0;
    for (int k = 0; k < n_file; k++) {
        nmm_status status = NMM_ERROR_MEMORY;
        for (long n = 0; status == NMM_ERROR_MEMORY; n++) {
            test_failing hook = {.fail_at = n};
            nmm_context context = {.n_thread = 1, .allocate = test_failing_hook, .user = &hook};
            nmm_scene scene = {0};
            status = nmm_scene_parse(&context, &scene, "memory.yaml", file_text[k], file_length[k],
                                     1, override);
            assert_int_equal(context.error.status, status);
            nmm_scene_destroy(&context, &scene);
            assert_int_equal(context.n_live, 0);
            n_call += 1;
        }
        assert_true(status == NMM_OK || status == NMM_ERROR_INPUT);
    }
    assert_true(n_call > 2 * n_file);
}

int main(int n_argument, char **argument) {
    folder = n_argument > 1 ? argument[1] : ".";
    const struct CMUnitTest test[] = {
        cmocka_unit_test(mutated_scenes_never_crash),
        cmocka_unit_test(mutated_overrides_never_crash),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(test, load_all, free_all);
}
