// SPDX-License-Identifier: MIT
//
// Reading a scene: file -> text -> tree -> overrides -> raw scene -> checked scene. Scratch memory
// is the reader's and goes with it; all that lasts is in the scene's arena.

#include "scene.h"

#include "build.h"
#include "override.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

// A scene file has at most this many bytes.
#define MAX_FILE ((size_t)64 << 20)

static nmm_status keep_arguments(nmm_context *context, nmm_scene *scene, const char *path,
                                 int n_override, const char *const *override) {
    char *copy = NULL;
    if (path == NULL) path = "scene";
    TRY(nmm_arena_text(context, &scene->arena, &copy, path, strlen(path)));
    scene->path = copy;
    TRY(nmm_arena_take(context, &scene->arena, &scene->override, (size_t)n_override,
                       sizeof *scene->override));
    scene->n_override = n_override;
    for (int i = 0; i < n_override; i++) {
        TRY(nmm_arena_text(context, &scene->arena, &copy, override[i], strlen(override[i])));
        scene->override[i] = copy;
    }
    return NMM_OK;
}

static nmm_status read_all(nmm_reader *reader) {
    nmm_scene *scene = reader->scene;
    nmm_node *root = NULL;
    const nmm_mark start = {.line = 1, .column = 1};
    TRY(nmm_tree_parse(reader, scene->text, scene->text_length, start, &root));
    if (root == NULL) return NMM_OK;
    for (int i = 0; i < scene->n_override; i++)
        TRY(nmm_override_apply(reader, root, i + 1));
    raw_scene *raw = NULL;
    TRY(nmm_arena_take(reader->context, &reader->arena, &raw, 1, sizeof *raw));
    TRY(raw_scene_read(reader, root, raw));
    return nmm_scene_build(reader, raw);
}

static nmm_status read_and_report(nmm_reader *reader) {
    TRY(read_all(reader));
    TRY(nmm_complaints_finish(reader));
    nmm_scene *scene = reader->scene;
    return nmm_arena_text(reader->context, &scene->arena, &scene->defaults, reader->note.text,
                          (size_t)reader->note.length);
}

static void close_reader(nmm_reader *reader) {
    nmm_release(reader->context, &reader->complaint);
    nmm_release(reader->context, &reader->note.text);
    nmm_arena_destroy(reader->context, &reader->arena);
}

nmm_status nmm_scene_parse(nmm_context *context, nmm_scene *scene, const char *path,
                           const char *text, size_t length, int n_override,
                           const char *const *override) {
    TRY(keep_arguments(context, scene, path, n_override, override));
    char *copy = NULL;
    TRY(nmm_arena_text(context, &scene->arena, &copy, text, length));
    scene->text = copy;
    scene->text_length = length;
    nmm_reader reader = {.context = context, .scene = scene};
    const nmm_status status = read_and_report(&reader);
    close_reader(&reader);
    return status;
}

// --- Files

// `path` at the head of the context's error.
static nmm_status fail_file(nmm_context *context, const char *path, const char *what) {
    if (context->error.status == NMM_OK)
        snprintf(context->error.file, sizeof context->error.file, "%s", path);
    return nmm_fail(context, NMM_ERROR_FILE, "cannot read the scene '%.200s': %s", path, what);
}

static nmm_status read_file(nmm_context *context, FILE *file, const char *path, nmm_text *text) {
    for (;;) {
        TRY(nmm_grow(context, &text->text, &text->capacity, text->length + 65536, 1));
        const size_t n = fread(text->text + text->length, 1, 65536, file);
        text->length += (int)n;
        if (ferror(file)) return fail_file(context, path, strerror(errno));
        if ((size_t)text->length > MAX_FILE)
            return fail_file(context, path, "the file is larger than 64 MiB");
        if (n == 0) return NMM_OK;
    }
}

nmm_status nmm_scene_read(nmm_context *context, nmm_scene *scene, const char *path, int n_override,
                          const char *const *override) {
    FILE *file = fopen(path, "rb");
    if (file == NULL) return fail_file(context, path, strerror(errno));
    nmm_text text = {0};
    nmm_status status = read_file(context, file, path, &text);
    fclose(file);
    if (status == NMM_OK) {
        status = nmm_scene_parse(context, scene, path, text.text, (size_t)text.length, n_override,
                                 override);
    }
    nmm_release(context, &text.text);
    return status;
}

void nmm_scene_destroy(nmm_context *context, nmm_scene *scene) {
    nmm_arena_destroy(context, &scene->arena);
    *scene = (nmm_scene){0};
}
