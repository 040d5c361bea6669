// SPDX-License-Identifier: MIT
//
// What the parts of the scene floor share while one scene is read: the mistakes found so far, the
// notes on defaults, scratch memory.
//
//   text --tree--> nodes --override--> nodes --values by the key table--> raw scene --build-->
//   scene
//
// A mistake is collected and reading goes on, so that all are reported in one go; a function here
// fails only when memory runs out. What could not be read is marked as not good, and later stages
// pass over it in silence.

#ifndef NMM_SCENE_READER_H
#define NMM_SCENE_READER_H

#include "scene.h"

/// No list, expanded joint set or repeated block may have more entries than this.
#define NMM_SCENE_MAX 250000

typedef struct nmm_complaint {
    nmm_mark mark;
    int order; // in which it was found, for equal marks
    const char *text;
} nmm_complaint;

/// Text that grows; owned by the context's hook.
typedef struct nmm_text {
    char *text;
    int length, capacity;
} nmm_text;

typedef struct nmm_reader {
    nmm_context *context;
    nmm_scene *scene;
    nmm_arena arena; // scratch: nodes, raw values, texts of complaints
    int n_complaint, complaint_capacity;
    nmm_complaint *complaint;
    nmm_text note;            // a line for each default chosen
    double bare_acceleration; // factor of accelerations without a unit
} nmm_reader;

/// Bytes of the UTF-8 character at `bytes` and its code; 0: `left` bytes hold none.
int nmm_utf8_decode(const char *bytes, size_t left, unsigned *code);

// --- Mistakes and notes

/// Collect a mistake at `mark` (printf format).
nmm_status nmm_complain(nmm_reader *reader, nmm_mark mark, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/// Add to a text (printf format).
nmm_status nmm_text_add(nmm_context *context, nmm_text *text, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/// A line about a default: "path = value: why".
nmm_status nmm_note(nmm_reader *reader, const char *path, const char *value, const char *why);

/// `text` fit for a message: one line, no control characters, at most about 40 characters.
typedef struct nmm_excerpt {
    char text[64];
} nmm_excerpt;
nmm_excerpt nmm_excerpt_of(const char *text);

/// The one of `candidate[n]` that `text` was most likely meant to be; NULL: none is near.
const char *nmm_nearest(const char *text, int n, const char *const *candidate);

/// " (did you mean 'x'?)" in *hint, or an empty text.
nmm_excerpt nmm_hint(const char *text, int n, const char *const *candidate);

/// One complaint as text to print: file:line:column, message, source line, caret.
nmm_status nmm_complaint_print(nmm_context *context, const nmm_scene *scene, nmm_mark mark,
                               const char *message, nmm_text *text);

/// Sort the complaints, write scene->report and the context's error. NMM_ERROR_INPUT if there are
/// any.
nmm_status nmm_complaints_finish(nmm_reader *reader);

#endif
