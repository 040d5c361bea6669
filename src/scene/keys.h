// SPDX-License-Identifier: MIT
//
// The key table: every key of a scene file in one line, with its type, dimension, range, default
// and meaning. It drives reading (value.c), the notes on defaults, the JSON Schema and the tables
// of docs/format.md (tests/scene/documents.c).

#ifndef NMM_SCENE_KEYS_H
#define NMM_SCENE_KEYS_H

#include "number.h"

typedef enum nmm_value_kind {
    NMM_VALUE_NUMBER,   // double
    NMM_VALUE_TEXT,     // const char *
    NMM_VALUE_NAME,     // const char *, not empty
    NMM_VALUE_CHOICE,   // int, one of `word`
    NMM_VALUE_WORDS,    // int, bit mask of `word`
    NMM_VALUE_ROW,      // double[width]
    NMM_VALUE_ROWS,     // raw_rows
    NMM_VALUE_POLYGONS, // raw_polygons: one polygon or a list of them
    NMM_VALUE_OBJECT,   // the object's struct
    NMM_VALUE_LIST,     // raw_list of objects
    NMM_VALUE_NAMED     // raw_list of objects, from a map of name and object
} nmm_value_kind;

/// A word that may stand for a value.
typedef struct nmm_word {
    const char *text; // NULL ends a list
    int value;
    bool later; // known, not supported yet
} nmm_word;

/// Allowed numbers; low = high = 0: only the dimension's limit counts.
typedef struct nmm_range {
    double low, high;
    bool low_open, high_open;
} nmm_range;

typedef struct nmm_object nmm_object;

typedef struct nmm_key {
    const char *name;
    nmm_value_kind kind;
    size_t offset; // in the object's struct
    nmm_dimension dimension[3];
    int width;     // ROW, ROWS
    int least_row; // ROWS
    int most_row;  // ROWS; 0: NMM_SCENE_MAX
    nmm_range range;
    const nmm_word *word;
    const nmm_object *object;
    bool required;
    bool later;           // known, not supported yet
    bool whole;           // a whole number
    bool automatic;       // the word `auto` is allowed and gives 0
    bool always;          // OBJECT: its defaults count when it is not in the file
    const char *unit_key; // bare accelerations are in the unit that this key names
    const char *standard; // default, as it would be written
    const char *computed; // how a default is found that is not a constant, for documents
    const char *why;      // why this default
    const char *meaning;
} nmm_key;

struct nmm_object {
    const char *name; // title in the documents
    const nmm_key *key;
    int n_key; // at most 64
    size_t size;
    const char *one_of; // exactly one of these keys, "a, b"; NULL: no such rule
    bool noted;         // its defaults are listed by `nmm check`
    const char *meaning;
};

extern const nmm_object nmm_object_scene;

/// All objects of the format, for documents; ends with NULL.
extern const nmm_object *const nmm_object_table[];

/// Index of a key in its object, -1: none.
int nmm_key_index(const nmm_object *object, const char *name);

#endif
