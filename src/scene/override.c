// SPDX-License-Identifier: MIT
//
// Overrides: a path of keys parted by dots, list entries as [i] or .i from 0, or by their name;
// then
// `=` and a value in YAML. Missing maps on the way are made; an entry is replaced in its place, or
// added at the end.

#include "override.h"

#include <stdlib.h>
#include <string.h>

// One step of a path.
typedef struct path_step {
    const char *name; // key or name
    int index;        // of a list entry, -1: not a number
    nmm_mark mark;
} path_step;

// The next step at *at, which moves on; false where the path is not well formed.
static bool next_step(const char *text, size_t end, size_t *at, char name[128], path_step *step) {
    const bool bracket = text[*at] == '[';
    if (bracket) *at += 1;
    step->mark.column = (int)*at + 1;
    size_t n = 0;
    while (*at < end && strchr(bracket ? "]" : ".[", text[*at]) == NULL && n < 127)
        name[n++] = text[(*at)++];
    name[n] = 0;
    step->name = name;
    step->index = -1;
    if (n == 0 || n == 127) return false;
    if (strspn(name, "0123456789") == n && n < 9) step->index = atoi(name);
    if (bracket && (step->index < 0 || *at >= end)) return false;
    if (bracket) *at += 1;
    if (*at < end && text[*at] == '.') {
        *at += 1;
        return *at < end;
    }
    return *at >= end || text[*at] == '[';
}

// The entry a step leads to; NULL: none yet.
static nmm_node *follow(const nmm_node *parent, const path_step *step) {
    if (parent->kind == NMM_NODE_MAP) return nmm_node_find(parent, step->name);
    if (parent->kind != NMM_NODE_LIST) return NULL;
    if (step->index >= 0) return nmm_node_at(parent, step->index);
    for (nmm_node *entry = parent->first; entry != NULL; entry = entry->next) {
        const nmm_node *name = nmm_node_find(entry, "name");
        if (name != NULL && name->kind == NMM_NODE_SCALAR && strcmp(name->text, step->name) == 0)
            return entry;
    }
    return NULL;
}

// A new entry for a step; *made stays NULL after a complaint.
static nmm_status add_entry(nmm_reader *reader, nmm_node *parent, const path_step *step,
                            nmm_node **made) {
    if (parent->kind == NMM_NODE_SCALAR || parent->kind == NMM_NODE_WRONG)
        return nmm_complain(reader, step->mark, "'%s' leads into %s, which has no keys",
                            nmm_excerpt_of(step->name).text, nmm_node_describe(parent).text);
    if (parent->kind == NMM_NODE_LIST && step->index != parent->n)
        return nmm_complain(reader, step->mark,
                            "no entry '%s'; the list has %d, counted from 0 (%d adds one)",
                            nmm_excerpt_of(step->name).text, parent->n, parent->n);
    nmm_node *node = NULL;
    TRY(nmm_arena_take(reader->context, &reader->arena, &node, 1, sizeof *node));
    char *key = NULL;
    TRY(nmm_arena_text(reader->context, &reader->arena, &key, step->name, strlen(step->name)));
    *node = (nmm_node){.kind = NMM_NODE_MAP, .mark = step->mark, .key_mark = step->mark};
    if (parent->kind == NMM_NODE_MAP) node->key = key;
    nmm_node_append(parent, node);
    *made = node;
    return NMM_OK;
}

// What `node` is becomes that of `value`; its place among its neighbours stays.
static void replace(nmm_node *node, const nmm_node *value, nmm_mark key_mark) {
    const nmm_node kept = *node;
    *node = *value;
    node->key = kept.key;
    node->key_mark = key_mark;
    node->parent = kept.parent;
    node->next = kept.next;
    for (nmm_node *child = node->first; child != NULL; child = child->next)
        child->parent = node;
}

// Walk the path, making what is missing, and put the value at its end.
static nmm_status put(nmm_reader *reader, nmm_node *root, const char *text, size_t end,
                      const nmm_node *value) {
    nmm_node *node = root;
    path_step step = {.mark = {.line = 1, .source = value->mark.source}};
    for (size_t at = 0; at < end;) {
        char name[128];
        if (!next_step(text, end, &at, name, &step))
            return nmm_complain(reader, step.mark,
                                "the path must be keys parted by dots, as in time.dt or "
                                "joint_sets[0].dip");
        nmm_node *entry = follow(node, &step);
        if (entry == NULL) TRY(add_entry(reader, node, &step, &entry));
        if (entry == NULL) return NMM_OK;
        node = entry;
    }
    replace(node, value, step.mark);
    return NMM_OK;
}

nmm_status nmm_override_apply(nmm_reader *reader, nmm_node *root, int source) {
    const char *text = reader->scene->override[source - 1];
    nmm_mark mark = {.line = 1, .column = 1, .source = source};
    const char *equals = strchr(text, '=');
    if (equals == NULL || equals == text)
        return nmm_complain(reader, mark, "must be key.path=value, found '%s'",
                            nmm_excerpt_of(text).text);
    const size_t end = (size_t)(equals - text);
    mark.column = (int)end + 2;
    if (equals[1] == 0) return nmm_complain(reader, mark, "there is no value behind '='");
    nmm_node *value = NULL;
    TRY(nmm_tree_parse(reader, equals + 1, strlen(equals + 1), mark, &value));
    if (value == NULL) return NMM_OK;
    return put(reader, root, text, end, value);
}
