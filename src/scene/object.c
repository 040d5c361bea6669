// SPDX-License-Identifier: MIT
//
// Objects of the scene file by the key table: unknown and missing keys, "exactly one of", defaults
// with a note on each, lists and named maps of objects. Recursion follows the table, whose objects
// nest four deep; the file's own depth plays no part.

#include "value.h"

#include <stdio.h>
#include <string.h>

static nmm_status read_object(nmm_reader *reader, const nmm_object *object, const nmm_node *node,
                              const char *path, raw_head *target);

// --- Heads

static uint64_t bit_of(const raw_head *head, const char *key) {
    const int k = nmm_key_index(head->object, key);
    NMM_ASSERT(k >= 0 && k < 64);
    return UINT64_C(1) << k;
}

bool raw_good(const raw_head *head, const char *key) {
    return head->object != NULL && (head->good & bit_of(head, key)) != 0;
}

bool raw_given(const raw_head *head, const char *key) {
    return head->object != NULL && (head->given & bit_of(head, key)) != 0;
}

nmm_mark raw_mark(const raw_head *head, const char *key) {
    const nmm_node *node = nmm_node_find(head->node, key);
    if (node != NULL) return node->mark;
    return head->node != NULL ? head->node->mark : (nmm_mark){0};
}

nmm_mark raw_key_mark(const raw_head *head, const char *key) {
    const nmm_node *node = nmm_node_find(head->node, key);
    return node != NULL ? node->key_mark : head->node->mark;
}

static void *at(raw_head *head, const nmm_key *key) {
    return (char *)head + key->offset;
}

static nmm_status join(nmm_reader *reader, const char *path, const char *key, const char **joined) {
    char *copy = NULL;
    const size_t n_path = strlen(path), n_key = strlen(key);
    TRY(nmm_arena_take(reader->context, &reader->arena, &copy, n_path + n_key + 2, 1));
    snprintf(copy, n_path + n_key + 2, "%s%s%s", path, n_path > 0 && *key != '[' ? "." : "", key);
    *joined = copy;
    return NMM_OK;
}

// --- Defaults

// A default's text as a node: a scalar, or a flat list in brackets.
static nmm_status make_node(nmm_reader *reader, const char *text, nmm_node **made) {
    nmm_node *node = NULL;
    TRY(nmm_arena_take(reader->context, &reader->arena, &node, 1, sizeof *node));
    *node = (nmm_node){.kind = NMM_NODE_SCALAR, .text = text};
    *made = node;
    if (*text != '[') return NMM_OK;
    node->kind = NMM_NODE_LIST;
    for (const char *p = text + 1; *p != 0 && *p != ']';) {
        const size_t length = strcspn(p, ",]");
        nmm_node *entry = NULL;
        char *copy = NULL;
        TRY(nmm_arena_take(reader->context, &reader->arena, &entry, 1, sizeof *entry));
        TRY(nmm_arena_text(reader->context, &reader->arena, &copy, p, length));
        *entry = (nmm_node){.kind = NMM_NODE_SCALAR, .text = copy};
        nmm_node_append(node, entry);
        p += length;
        p += strspn(p, ", ");
    }
    return NMM_OK;
}

static nmm_status set_default(nmm_reader *reader, const nmm_key *key, raw_head *head) {
    nmm_node *node = NULL;
    bool good = false;
    TRY(make_node(reader, key->standard, &node));
    const double bare = reader->bare_acceleration;
    reader->bare_acceleration = 1;
    TRY(nmm_value_read(reader, key, node, at(head, key), &good));
    reader->bare_acceleration = bare;
    NMM_ASSERT(good);
    head->good |= bit_of(head, key->name);
    if (!head->object->noted) return NMM_OK;
    const char *path = NULL;
    TRY(join(reader, head->path, key->name, &path));
    return nmm_note(reader, path, key->standard, key->why);
}

static nmm_status set_defaults(nmm_reader *reader, raw_head *head) {
    for (int k = 0; k < head->object->n_key; k++) {
        const nmm_key *key = &head->object->key[k];
        if ((head->given & (UINT64_C(1) << k)) != 0) continue;
        if (key->standard != NULL) TRY(set_default(reader, key, head));
        if (key->kind == NMM_VALUE_OBJECT && key->always && !key->required) {
            const char *path = NULL;
            TRY(join(reader, head->path, key->name, &path));
            TRY(read_object(reader, key->object, NULL, path, at(head, key)));
        }
    }
    return NMM_OK;
}

// --- Keys

// A misspelt key counts as given, so that it is not called missing too.
static nmm_status complain_unknown(nmm_reader *reader, raw_head *head, const nmm_node *node) {
    const nmm_object *object = head->object;
    const char *candidate[64];
    char list[400] = "";
    int n = 0;
    for (int k = 0; k < object->n_key; k++) {
        if (object->key[k].later) continue;
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", n > 0 ? ", " : "", object->key[k].name);
        candidate[n++] = object->key[k].name;
    }
    const char *nearest = nmm_nearest(node->key, n, candidate);
    if (nearest != NULL) head->given |= bit_of(head, nearest);
    if (node->key[strspn(node->key, "0123456789.eE+-")] == 0)
        return nmm_complain(reader, node->key_mark,
                            "unknown key '%s'; a comma begins a new key: a number has a decimal "
                            "point, and none between thousands",
                            nmm_excerpt_of(node->key).text);
    return nmm_complain(reader, node->key_mark, "unknown key '%s'%s; allowed in %s: %s",
                        nmm_excerpt_of(node->key).text, nmm_hint(node->key, n, candidate).text,
                        object->name, list);
}

static bool in_list(const char *list, const char *word) {
    const size_t length = strlen(word);
    if (length == 0) return false;
    for (const char *p = strstr(list, word); p != NULL; p = strstr(p + 1, word)) {
        const bool begins = p == list || p[-1] == ' ';
        if (begins && (p[length] == ',' || p[length] == 0)) return true;
    }
    return false;
}

static nmm_status check_one_of(nmm_reader *reader, const raw_head *head) {
    if (head->object->one_of == NULL) return NMM_OK;
    int n = 0;
    const char *first = NULL;
    const nmm_node *second = NULL;
    for (const nmm_node *entry = head->node->first; entry != NULL; entry = entry->next) {
        if (!in_list(head->object->one_of, entry->key)) continue;
        n += 1;
        if (n == 1) first = entry->key;
        if (n == 2) second = entry;
    }
    for (int k = 0; k < head->object->n_key && n == 0; k++) {
        const bool given = (head->given & (UINT64_C(1) << k)) != 0;
        if (given && in_list(head->object->one_of, head->object->key[k].name)) return NMM_OK;
    }
    if (n == 0)
        return nmm_complain(reader, head->node->mark, "%s entry needs one of: %s",
                            head->object->name, head->object->one_of);
    if (n == 1) return NMM_OK;
    return nmm_complain(reader, second->key_mark,
                        "'%s' besides '%s'; only one of these is allowed: %s", second->key, first,
                        head->object->one_of);
}

static nmm_status check_required(nmm_reader *reader, const raw_head *head) {
    for (int k = 0; k < head->object->n_key; k++) {
        const nmm_key *key = &head->object->key[k];
        if (!key->required || (head->given & (UINT64_C(1) << k)) != 0) continue;
        TRY(nmm_complain(reader, head->node->mark, "required key '%s' is missing in %s (%s)",
                         key->name, *head->path != 0 ? head->path : "the scene", key->meaning));
    }
    return NMM_OK;
}

// --- Lists and named maps

static nmm_status read_list(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                            raw_list *list, bool *good) {
    const bool named = key->kind == NMM_VALUE_NAMED;
    *good = false;
    if (node->kind == NMM_NODE_WRONG) return NMM_OK;
    if (node->kind != (named ? NMM_NODE_MAP : NMM_NODE_LIST))
        return nmm_complain(reader, node->mark, "%s must be a %s, found %s", key->name,
                            named ? "map of names and what they stand for"
                                  : "list (entries begin with '- ')",
                            nmm_node_describe(node).text);
    if (node->n > NMM_SCENE_MAX)
        return nmm_complain(reader, node->mark, "%s has %d entries; at most %d are allowed",
                            key->name, node->n, NMM_SCENE_MAX);
    const size_t size = key->object->size;
    char *item = NULL;
    TRY(nmm_arena_take(reader->context, &reader->arena, &item, (size_t)node->n, size));
    *list = (raw_list){.n = node->n, .item = item};
    int i = 0;
    for (const nmm_node *entry = node->first; entry != NULL; entry = entry->next, i++) {
        char number[24];
        snprintf(number, sizeof number, "[%d]", i);
        const char *path = NULL;
        TRY(join(reader, key->name, named ? entry->key : number, &path));
        TRY(read_object(reader, key->object, entry, path, (raw_head *)(void *)item));
        item += size;
    }
    *good = true;
    return NMM_OK;
}

static nmm_status read_key(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                           raw_head *head, bool *good) {
    if (key->kind == NMM_VALUE_LIST || key->kind == NMM_VALUE_NAMED)
        return read_list(reader, key, node, at(head, key), good);
    if (key->kind == NMM_VALUE_OBJECT) {
        const char *path = NULL;
        TRY(join(reader, head->path, key->name, &path));
        *good = node->kind == NMM_NODE_MAP;
        return read_object(reader, key->object, node, path, at(head, key));
    }
    // Bare accelerations in the unit that another key of this object names.
    const nmm_node *unit = key->unit_key != NULL ? nmm_node_find(head->node, key->unit_key) : NULL;
    if (unit != NULL && unit->kind == NMM_NODE_SCALAR) {
        const nmm_unit *found = nmm_unit_find(unit->text, NMM_ACCELERATION);
        if (found != NULL) reader->bare_acceleration = found->multiply / found->divide;
    }
    TRY(nmm_value_read(reader, key, node, at(head, key), good));
    reader->bare_acceleration = 1;
    return NMM_OK;
}

static nmm_status read_entry(nmm_reader *reader, raw_head *head, const nmm_node *entry) {
    const int k = nmm_key_index(head->object, entry->key);
    if (k < 0) return complain_unknown(reader, head, entry);
    const nmm_key *key = &head->object->key[k];
    if (key->later)
        return nmm_complain(reader, entry->key_mark, "%s is not supported yet; leave it out",
                            key->name);
    head->given |= UINT64_C(1) << k;
    bool good = false;
    TRY(read_key(reader, key, entry, head, &good));
    if (good) head->good |= UINT64_C(1) << k;
    return NMM_OK;
}

static nmm_status read_object(nmm_reader *reader, const nmm_object *object, const nmm_node *node,
                              const char *path, raw_head *target) {
    raw_head *head = target;
    *head = (raw_head){.object = object, .node = node, .path = path};
    if (node == NULL) return set_defaults(reader, head);
    head->name = node->key;
    if (node->kind == NMM_NODE_WRONG) return NMM_OK;
    if (node->kind != NMM_NODE_MAP)
        return nmm_complain(reader, node->mark, "%s must be a map of key: value, found %s",
                            *path != 0 ? path : "a scene", nmm_node_describe(node).text);
    for (const nmm_node *entry = node->first; entry != NULL; entry = entry->next)
        TRY(read_entry(reader, head, entry));
    TRY(check_one_of(reader, head));
    TRY(check_required(reader, head));
    return set_defaults(reader, head);
}

nmm_status raw_scene_read(nmm_reader *reader, const nmm_node *root, raw_scene *raw) {
    reader->bare_acceleration = 1;
    return read_object(reader, &nmm_object_scene, root, "", &raw->head);
}
