// SPDX-License-Identifier: MIT
//
// A scene file as a small tree: maps, lists and scalars, each with line and column of key and
// value. Refused with their place: text that is not UTF-8, NUL bytes, syntax errors, duplicate
// keys, anchors, aliases, tags, several documents, depth over 64, absurd sizes.

#ifndef NMM_SCENE_TREE_H
#define NMM_SCENE_TREE_H

#include "reader.h"

typedef enum nmm_node_kind {
    NMM_NODE_MAP,
    NMM_NODE_LIST,
    NMM_NODE_SCALAR,
    NMM_NODE_WRONG // already complained about; readers pass over it
} nmm_node_kind;

typedef struct nmm_node nmm_node;
struct nmm_node {
    nmm_node_kind kind;
    bool quoted;       // scalar in quotes
    const char *text;  // scalar: its text, without zero bytes
    nmm_mark mark;     // of the value
    const char *key;   // in a map
    nmm_mark key_mark; // in a map
    int n;             // entries of a map or list
    nmm_node *parent, *next, *first, *last;
};

/// Parse YAML. `start` names the source; line 1 of the text begins at start.column. *root is NULL
/// when the text could not be made into a tree; then there is a complaint.
nmm_status nmm_tree_parse(nmm_reader *reader, const char *text, size_t length, nmm_mark start,
                          nmm_node **root);

/// Put `node` at the end of `parent`.
void nmm_node_append(nmm_node *parent, nmm_node *node);

/// Entry of a map; NULL: none, or no map.
nmm_node *nmm_node_find(const nmm_node *map, const char *key);

/// Entry of a list, from 0; NULL: none.
nmm_node *nmm_node_at(const nmm_node *list, int index);

/// A plain scalar without content: nothing, ~ or null.
bool nmm_node_empty(const nmm_node *node);

/// What a node is, for messages: "a map", "a list", "'text'", "nothing".
nmm_excerpt nmm_node_describe(const nmm_node *node);

/// Refuse bytes that are not UTF-8 or not text; *clean is false after a complaint.
nmm_status nmm_utf8_check(nmm_reader *reader, const char *text, size_t length, nmm_mark start,
                          bool *clean);

#endif
