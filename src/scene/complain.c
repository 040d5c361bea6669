// SPDX-License-Identifier: MIT
//
// Mistakes of a scene: collected, sorted into file order, printed like a compiler's with the source
// line and a caret; the nearest known word for a misspelt one (smallest edit distance).

#include "reader.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// So many are kept, and so many printed; the rest is only counted.
#define MAX_KEPT 1000
#define MAX_PRINTED 50

// Columns of a source line that are shown.
#define LINE_WIDTH 100

// --- Collecting

nmm_status nmm_complain(nmm_reader *reader, nmm_mark mark, const char *format, ...) {
    reader->scene->n_error += 1;
    if (reader->n_complaint >= MAX_KEPT) return NMM_OK;
    char message[700];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    char *copy = NULL;
    TRY(nmm_arena_text(reader->context, &reader->arena, &copy, message, strlen(message)));
    TRY(nmm_grow(reader->context, &reader->complaint, &reader->complaint_capacity,
                 reader->n_complaint + 1, sizeof *reader->complaint));
    reader->complaint[reader->n_complaint] =
        (nmm_complaint){.mark = mark, .order = reader->n_complaint, .text = copy};
    reader->n_complaint += 1;
    return NMM_OK;
}

nmm_status nmm_text_add(nmm_context *context, nmm_text *text, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const int more = vsnprintf(NULL, 0, format, arguments);
    va_end(arguments);
    NMM_ASSERT(more >= 0);
    if (more > INT32_MAX - 1 - text->length) {
        return nmm_fail(context, NMM_ERROR_MEMORY, "out of memory: text too long");
    }
    TRY(nmm_grow(context, &text->text, &text->capacity, text->length + more + 1, 1));
    va_start(arguments, format);
    vsnprintf(text->text + text->length, (size_t)more + 1, format, arguments);
    va_end(arguments);
    text->length += more;
    return NMM_OK;
}

nmm_status nmm_note(nmm_reader *reader, const char *path, const char *value, const char *why) {
    return nmm_text_add(reader->context, &reader->note, "%s = %s: %s\n", path, value, why);
}

// --- Words

nmm_excerpt nmm_excerpt_of(const char *text) {
    enum { SHOWN = 40 };
    nmm_excerpt excerpt = {{0}};
    size_t length = strlen(text);
    const bool cut = length > SHOWN;
    if (cut) length = SHOWN;
    // Do not cut inside a UTF-8 sequence.
    while (cut && length > 0 && ((unsigned char)text[length] & 0xc0) == 0x80)
        length -= 1;
    for (size_t i = 0; i < length; i++) {
        const unsigned char c = (unsigned char)text[i];
        excerpt.text[i] = c < 0x20 || c == 0x7f ? ' ' : text[i];
    }
    if (cut) memcpy(excerpt.text + length, "...", 4);
    return excerpt;
}

// Edit distance (insert, delete, replace, swap of neighbours) of words up to 40 letters.
static int edit_distance(const char *a, const char *b) {
    enum { MOST = 40 };
    const int n_a = (int)strnlen(a, MOST + 1), n_b = (int)strnlen(b, MOST + 1);
    if (n_a > MOST || n_b > MOST) return MOST;
    int row[MOST + 1][MOST + 1];
    for (int j = 0; j <= n_b; j++)
        row[0][j] = j;
    for (int i = 1; i <= n_a; i++) {
        row[i][0] = i;
        for (int j = 1; j <= n_b; j++) {
            const int replace = row[i - 1][j - 1] + (a[i - 1] != b[j - 1]);
            int best = nmm_min_int(replace, nmm_min_int(row[i - 1][j], row[i][j - 1]) + 1);
            const bool swap = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            if (swap) best = nmm_min_int(best, row[i - 2][j - 2] + 1);
            row[i][j] = best;
        }
    }
    return row[n_a][n_b];
}

const char *nmm_nearest(const char *text, int n, const char *const *candidate) {
    const char *nearest = NULL;
    int least = nmm_max_int(1, (int)strnlen(text, 60) / 3) + 1;
    for (int i = 0; i < n; i++) {
        if (candidate[i] == NULL) continue;
        const int distance = edit_distance(text, candidate[i]);
        if (distance >= least || distance >= (int)strlen(candidate[i])) continue;
        least = distance;
        nearest = candidate[i];
    }
    return nearest;
}

nmm_excerpt nmm_hint(const char *text, int n, const char *const *candidate) {
    nmm_excerpt hint = {{0}};
    const char *nearest = nmm_nearest(text, n, candidate);
    if (nearest != NULL) {
        snprintf(hint.text, sizeof hint.text, " (did you mean '%.43s'?)",
                 nmm_excerpt_of(nearest).text);
    }
    return hint;
}

// --- Printing

// Text of the file or of an override, without a byte order mark.
static const char *source_text(const nmm_scene *scene, nmm_mark mark, size_t *length) {
    const char *text = scene->text;
    *length = scene->text_length;
    if (mark.source > 0) {
        text = scene->override[mark.source - 1];
        *length = strlen(text);
    }
    if (*length >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) {
        text += 3;
        *length -= 3;
    }
    return text;
}

// Begin of line `line` (from 1) in *start, its bytes in *length; false: there is no such line.
static bool find_line(const char *text, size_t size, int line, const char **start, size_t *length) {
    size_t i = 0;
    for (int k = 1; k < line; k++) {
        while (i < size && text[i] != '\n' && text[i] != '\r')
            i += 1;
        if (i >= size) return false;
        i += i + 1 < size && text[i] == '\r' && text[i + 1] == '\n' ? 2 : 1;
    }
    *start = text + i;
    *length = 0;
    while (i + *length < size && text[i + *length] != '\n' && text[i + *length] != '\r')
        *length += 1;
    return true;
}

// Bytes of the first `column` characters.
static size_t bytes_of(const char *line, size_t length, int column) {
    size_t i = 0;
    for (int k = 0; k < column && i < length; k++) {
        i += 1;
        while (i < length && ((unsigned char)line[i] & 0xc0) == 0x80)
            i += 1;
    }
    return i;
}

// The part of the line round the column, then a caret under the column.
static nmm_status print_line(nmm_context *context, const char *line, size_t length, int column,
                             nmm_text *text) {
    const int first = column > LINE_WIDTH - 10 ? column - LINE_WIDTH / 2 : 0;
    const size_t begin = bytes_of(line, length, first);
    const size_t end = bytes_of(line, length, first + LINE_WIDTH);
    const size_t mark = bytes_of(line, length, column - 1);
    TRY(nmm_text_add(context, text, "    %s", begin > 0 ? "..." : ""));
    for (size_t i = begin; i < end;) {
        unsigned code = 0;
        const int n = nmm_utf8_decode(line + i, length - i, &code);
        const bool shown = n > 0 && (code >= 0x20 || code == '\t') && code != 0x7f;
        TRY(nmm_text_add(context, text, "%.*s", shown ? n : 1, shown ? line + i : "?"));
        i += n > 0 ? (size_t)n : 1;
    }
    TRY(nmm_text_add(context, text, "%s\n    %s", end < length ? "..." : "",
                     begin > 0 ? "   " : ""));
    // Tabs stay tabs, so that the caret stands where the eye expects it.
    for (size_t i = begin; i < mark; i++) {
        const bool inside = ((unsigned char)line[i] & 0xc0) == 0x80;
        if (!inside) TRY(nmm_text_add(context, text, "%c", line[i] == '\t' ? '\t' : ' '));
    }
    return nmm_text_add(context, text, "^\n");
}

static nmm_status print_place(nmm_context *context, const nmm_scene *scene, nmm_mark mark,
                              nmm_text *text) {
    if (mark.source > 0) {
        const nmm_excerpt shown = nmm_excerpt_of(scene->override[mark.source - 1]);
        TRY(nmm_text_add(context, text, "--set %s", shown.text));
    } else {
        TRY(nmm_text_add(context, text, "%s", scene->path));
    }
    if (mark.line > 0) TRY(nmm_text_add(context, text, ":%d:%d", mark.line, mark.column));
    return NMM_OK;
}

nmm_status nmm_complaint_print(nmm_context *context, const nmm_scene *scene, nmm_mark mark,
                               const char *message, nmm_text *text) {
    TRY(print_place(context, scene, mark, text));
    TRY(nmm_text_add(context, text, ": error: %s\n", message));
    size_t size = 0, length = 0;
    const char *line = NULL, *source = source_text(scene, mark, &size);
    if (mark.line < 1 || !find_line(source, size, mark.line, &line, &length)) return NMM_OK;
    return print_line(context, line, length, mark.column, text);
}

// --- The end

static int compare_complaints(const void *a, const void *b) {
    const nmm_complaint *p = a, *q = b;
    if (p->mark.source != q->mark.source) return p->mark.source < q->mark.source ? -1 : 1;
    if (p->mark.line != q->mark.line) return p->mark.line < q->mark.line ? -1 : 1;
    if (p->mark.column != q->mark.column) return p->mark.column < q->mark.column ? -1 : 1;
    return (p->order > q->order) - (p->order < q->order);
}

// The first complaint as the context's error, if that has none yet.
static void set_error(nmm_context *context, const nmm_scene *scene, nmm_mark mark,
                      const char *message) {
    if (context->error.status != NMM_OK) return;
    nmm_fail(context, NMM_ERROR_INPUT, "%s", message);
    nmm_error *error = &context->error;
    const bool override = mark.source > 0;
    snprintf(error->file, sizeof error->file, "%s%s", override ? "--set " : "",
             override ? scene->override[mark.source - 1] : scene->path);
    error->line = mark.line;
    error->column = mark.column;
}

static nmm_status print_all(nmm_reader *reader, nmm_text *text) {
    const int n = nmm_min_int(reader->n_complaint, MAX_PRINTED);
    for (int i = 0; i < n; i++) {
        const nmm_complaint *c = &reader->complaint[i];
        TRY(nmm_complaint_print(reader->context, reader->scene, c->mark, c->text, text));
    }
    const int more = reader->scene->n_error - n;
    if (more > 0) {
        TRY(nmm_text_add(reader->context, text, "%s: and %d more\n", reader->scene->path, more));
    }
    return nmm_arena_text(reader->context, &reader->scene->arena, &reader->scene->report,
                          text->text, (size_t)text->length);
}

nmm_status nmm_complaints_finish(nmm_reader *reader) {
    if (reader->n_complaint == 0) return NMM_OK;
    qsort(reader->complaint, (size_t)reader->n_complaint, sizeof *reader->complaint,
          compare_complaints);
    nmm_text text = {0};
    const nmm_status status = print_all(reader, &text);
    nmm_release(reader->context, &text.text);
    TRY(status);
    set_error(reader->context, reader->scene, reader->complaint[0].mark, reader->complaint[0].text);
    return NMM_ERROR_INPUT;
}

static nmm_status append_report(nmm_context *context, nmm_scene *scene, nmm_mark mark,
                                const char *message, nmm_text *text) {
    if (scene->report != NULL) TRY(nmm_text_add(context, text, "%s", scene->report));
    TRY(nmm_complaint_print(context, scene, mark, message, text));
    return nmm_arena_text(context, &scene->arena, &scene->report, text->text, (size_t)text->length);
}

nmm_status nmm_scene_reject(nmm_context *context, nmm_scene *scene, nmm_mark mark,
                            const char *format, ...) {
    char message[700];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    scene->n_error += 1;
    nmm_text text = {0};
    const nmm_status status = append_report(context, scene, mark, message, &text);
    nmm_release(context, &text.text);
    TRY(status);
    set_error(context, scene, mark, message);
    return NMM_ERROR_INPUT;
}

static nmm_status append_warning(nmm_context *context, nmm_scene *scene, nmm_mark mark,
                                 const char *message, nmm_text *text) {
    if (scene->warnings != NULL) TRY(nmm_text_add(context, text, "%s", scene->warnings));
    TRY(print_place(context, scene, mark, text));
    TRY(nmm_text_add(context, text, ": warning: %s\n", message));
    return nmm_arena_text(context, &scene->arena, &scene->warnings, text->text,
                          (size_t)text->length);
}

nmm_status nmm_scene_warn(nmm_context *context, nmm_scene *scene, nmm_mark mark, const char *format,
                          ...) {
    char message[700];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    nmm_text text = {0};
    const nmm_status status = append_warning(context, scene, mark, message, &text);
    nmm_release(context, &text.text);
    return status;
}
