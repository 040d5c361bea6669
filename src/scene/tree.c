// SPDX-License-Identifier: MIT
//
// YAML text to nodes by libyaml's event interface, with a loop and parent pointers instead of
// recursion. What YAML offers and a scene does not need (aliases, anchors, tags, many documents) is
// refused, because it would make places in the file ambiguous. A duplicate key is complained about
// and dropped, and reading goes on; a syntax error ends it.

#include "tree.h"

#include <stdio.h>
#include <string.h>
#include <yaml.h>

#define MAX_DEPTH 64
#define MAX_NODES 5000000
#define MAX_KEYS 1000
#define MAX_BYTES ((size_t)64 << 20)

typedef struct builder {
    nmm_reader *reader;
    nmm_mark start;
    nmm_node *root;
    nmm_node *open;  // container that takes the next node
    const char *key; // read, its value comes next
    nmm_mark key_mark;
    int depth, n_node, n_document;
    bool done; // the stream ended, or had to be given up
    bool wrong;
} builder;

// --- Nodes

void nmm_node_append(nmm_node *parent, nmm_node *node) {
    node->parent = parent;
    node->next = NULL;
    if (parent->last != NULL) parent->last->next = node;
    if (parent->first == NULL) parent->first = node;
    parent->last = node;
    parent->n += 1;
}

nmm_node *nmm_node_find(const nmm_node *map, const char *key) {
    if (map == NULL || map->kind != NMM_NODE_MAP) return NULL;
    nmm_node *node = map->first;
    while (node != NULL && strcmp(node->key, key) != 0)
        node = node->next;
    return node;
}

nmm_node *nmm_node_at(const nmm_node *list, int index) {
    nmm_node *node = list != NULL ? list->first : NULL;
    for (int i = 0; i < index && node != NULL; i++)
        node = node->next;
    return node;
}

bool nmm_node_empty(const nmm_node *node) {
    if (node->kind != NMM_NODE_SCALAR || node->quoted) return false;
    const char *text = node->text;
    return *text == 0 || strcmp(text, "~") == 0 || strcmp(text, "null") == 0;
}

nmm_excerpt nmm_node_describe(const nmm_node *node) {
    nmm_excerpt shown = {{0}};
    if (node->kind == NMM_NODE_SCALAR && !nmm_node_empty(node)) {
        snprintf(shown.text, sizeof shown.text, "'%.60s'", nmm_excerpt_of(node->text).text);
        return shown;
    }
    const char *name = node->kind == NMM_NODE_MAP    ? "a map"
                       : node->kind == NMM_NODE_LIST ? "a list"
                                                     : "nothing";
    snprintf(shown.text, sizeof shown.text, "%s", name);
    return shown;
}

// --- Building

static nmm_mark place_of(const builder *b, yaml_mark_t mark) {
    nmm_mark place = {.source = b->start.source};
    place.line = b->start.line + (int)mark.line;
    place.column = (int)mark.column + (mark.line == 0 ? b->start.column : 1);
    return place;
}

static nmm_status give_up(builder *b, nmm_mark mark, const char *message) {
    b->done = true;
    b->wrong = true;
    return nmm_complain(b->reader, mark, "%s", message);
}

// A scalar where a key must stand.
static nmm_status take_key(builder *b, const char *text, nmm_mark mark) {
    char *copy = NULL;
    TRY(nmm_arena_text(b->reader->context, &b->reader->arena, &copy, text, strlen(text)));
    b->key = copy;
    b->key_mark = mark;
    return NMM_OK;
}

// A new node into the open container; a duplicate stays outside, but is read to its end.
static nmm_status add_node(builder *b, nmm_node_kind kind, nmm_mark mark, nmm_node **added) {
    nmm_node *node = NULL;
    TRY(nmm_arena_take(b->reader->context, &b->reader->arena, &node, 1, sizeof *node));
    *node = (nmm_node){.kind = kind, .mark = mark, .key = b->key, .key_mark = b->key_mark};
    *added = node;
    b->key = NULL;
    b->n_node += 1;
    if (b->n_node > MAX_NODES) return give_up(b, mark, "the file has more than 5000000 values");
    if (b->open == NULL) {
        b->root = node;
        return NMM_OK;
    }
    const nmm_node *same = node->key != NULL ? nmm_node_find(b->open, node->key) : NULL;
    if (same != NULL) {
        node->parent = b->open;
        return nmm_complain(b->reader, node->key_mark,
                            "key '%s' appears twice, first in line %d; once is allowed",
                            nmm_excerpt_of(node->key).text, same->key_mark.line);
    }
    if (node->key != NULL && b->open->n >= MAX_KEYS)
        return give_up(b, node->key_mark, "a map has more than 1000 keys");
    nmm_node_append(b->open, node);
    return NMM_OK;
}

// Anchors and tags are complained about, and otherwise passed over.
static nmm_status refuse_extras(builder *b, nmm_mark mark, const void *anchor, const void *tag) {
    if (anchor != NULL) {
        b->wrong = true;
        TRY(nmm_complain(b->reader, mark, "anchors (&name) are not allowed in a scene"));
    }
    if (tag != NULL) {
        b->wrong = true;
        TRY(nmm_complain(b->reader, mark, "tags (!name) are not allowed in a scene"));
    }
    return NMM_OK;
}

static bool wants_key(const builder *b) {
    return b->open != NULL && b->open->kind == NMM_NODE_MAP && b->key == NULL;
}

static nmm_status take_scalar(builder *b, const yaml_event_t *event) {
    const nmm_mark mark = place_of(b, event->start_mark);
    const char *text = (const char *)event->data.scalar.value;
    const size_t length = event->data.scalar.length;
    TRY(refuse_extras(b, mark, event->data.scalar.anchor, event->data.scalar.tag));
    if (strlen(text) != length) return give_up(b, mark, "a text holds a NUL byte");
    if (wants_key(b)) return take_key(b, text, mark);
    nmm_node *node = NULL;
    TRY(add_node(b, NMM_NODE_SCALAR, mark, &node));
    node->quoted = event->data.scalar.style != YAML_PLAIN_SCALAR_STYLE;
    char *copy = NULL;
    TRY(nmm_arena_text(b->reader->context, &b->reader->arena, &copy, text, length));
    node->text = copy;
    return NMM_OK;
}

static nmm_status take_start(builder *b, nmm_node_kind kind, const yaml_event_t *event) {
    const nmm_mark mark = place_of(b, event->start_mark);
    const bool map = kind == NMM_NODE_MAP;
    TRY(refuse_extras(b, mark,
                      map ? event->data.mapping_start.anchor : event->data.sequence_start.anchor,
                      map ? event->data.mapping_start.tag : event->data.sequence_start.tag));
    if (wants_key(b)) return give_up(b, mark, "a key must be a word, found a map or a list");
    if (b->depth >= MAX_DEPTH) return give_up(b, mark, "nested deeper than 64 levels");
    nmm_node *node = NULL;
    TRY(add_node(b, kind, mark, &node));
    // A root has no parent; a dropped duplicate has one, so that its end leads back.
    b->open = node;
    b->depth += 1;
    return NMM_OK;
}

static nmm_status take_alias(builder *b, const yaml_event_t *event) {
    const nmm_mark mark = place_of(b, event->start_mark);
    b->wrong = true;
    TRY(nmm_complain(b->reader, mark, "aliases (*name) are not allowed in a scene"));
    if (wants_key(b)) return take_key(b, "*", mark);
    nmm_node *node = NULL;
    return add_node(b, NMM_NODE_WRONG, mark, &node);
}

static nmm_status take_event(builder *b, const yaml_event_t *event) {
    switch (event->type) {
    case YAML_SCALAR_EVENT:
        return take_scalar(b, event);
    case YAML_MAPPING_START_EVENT:
        return take_start(b, NMM_NODE_MAP, event);
    case YAML_SEQUENCE_START_EVENT:
        return take_start(b, NMM_NODE_LIST, event);
    case YAML_ALIAS_EVENT:
        return take_alias(b, event);
    case YAML_MAPPING_END_EVENT:
    case YAML_SEQUENCE_END_EVENT:
        b->open = b->open->parent;
        b->depth -= 1;
        return NMM_OK;
    case YAML_DOCUMENT_START_EVENT:
        b->n_document += 1;
        if (b->n_document == 1) return NMM_OK;
        return give_up(b, place_of(b, event->start_mark),
                       "a second document begins here; one is allowed");
    case YAML_STREAM_END_EVENT:
        b->done = true;
        return NMM_OK;
    default:
        return NMM_OK;
    }
}

// --- Syntax errors

// Behind the last character that is not blank.
static nmm_mark end_of(const builder *b, const char *text, size_t length) {
    nmm_mark mark = b->start;
    while (length > 0 && strchr(" \t\r\n", text[length - 1]) != NULL)
        length -= 1;
    const bool marked = length >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0;
    for (size_t i = marked ? 3 : 0; i < length; i++) {
        const bool ends = text[i] == '\n' || (text[i] == '\r' && text[i + 1] != '\n');
        const bool inside = ((unsigned char)text[i] & 0xc0) == 0x80;
        if (!inside) mark.column = ends ? 1 : mark.column + 1;
        mark.line += ends ? 1 : 0;
    }
    return mark;
}

// libyaml's words are kept, except where a user needs plainer ones.
static nmm_status complain_syntax(builder *b, const yaml_parser_t *parser, const char *text,
                                  size_t length) {
    b->done = true;
    b->wrong = true;
    if (parser->error == YAML_MEMORY_ERROR)
        return nmm_fail(b->reader->context, NMM_ERROR_MEMORY, "out of memory: YAML parser");
    const bool marked = parser->error != YAML_READER_ERROR;
    nmm_mark mark = marked ? place_of(b, parser->problem_mark) : b->start;
    const char *problem = parser->problem != NULL ? parser->problem : "unreadable";
    // Marks count characters, without a byte order mark.
    size_t at = length >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
    for (size_t k = 0; marked && k < parser->problem_mark.index && at < length; k++) {
        at += 1;
        while (at < length && ((unsigned char)text[at] & 0xc0) == 0x80)
            at += 1;
    }
    if (at >= length) mark = end_of(b, text, length);
    if (marked && at < length && text[at] == '\t')
        return nmm_complain(b->reader, mark, "syntax: a tab cannot indent; use spaces");
    const char *context = parser->context != NULL ? parser->context : "";
    const int line = b->start.line + (int)parser->context_mark.line;
    if (*context == 0 || line == mark.line)
        return nmm_complain(b->reader, mark, "syntax: %s%s%s", problem, *context ? " " : "",
                            context);
    const bool block = strstr(context, "block mapping") || strstr(context, "block collection");
    return nmm_complain(b->reader, mark, "syntax: %s %s that began in line %d%s", problem, context,
                        line,
                        block ? "; keys of one map begin in the same column, entries of one list "
                                "with '-' in the same column"
                              : "");
}

static nmm_status build(builder *b, yaml_parser_t *parser, const char *text, size_t length) {
    while (!b->done) {
        yaml_event_t event;
        if (!yaml_parser_parse(parser, &event)) return complain_syntax(b, parser, text, length);
        const nmm_status status = take_event(b, &event);
        yaml_event_delete(&event);
        TRY(status);
    }
    return NMM_OK;
}

nmm_status nmm_tree_parse(nmm_reader *reader, const char *text, size_t length, nmm_mark start,
                          nmm_node **root) {
    *root = NULL;
    if (length > MAX_BYTES)
        return nmm_complain(reader, start, "%zu bytes are too much; at most %zu are allowed",
                            length, MAX_BYTES);
    bool clean = false;
    TRY(nmm_utf8_check(reader, text, length, start, &clean));
    if (!clean) return NMM_OK;
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser))
        return nmm_fail(reader->context, NMM_ERROR_MEMORY, "out of memory: YAML parser");
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, length);
    builder b = {.reader = reader, .start = start};
    const nmm_status status = build(&b, &parser, text, length);
    yaml_parser_delete(&parser);
    TRY(status);
    if (b.root == NULL && !b.wrong) return nmm_complain(reader, start, "there is no content");
    // A syntax error leaves half a tree, which would only bring more complaints.
    if (b.open == NULL) *root = b.root;
    return NMM_OK;
}
