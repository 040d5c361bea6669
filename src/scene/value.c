// SPDX-License-Identifier: MIT
//
// Values of one key by its line in the key table: numbers with range and unit, words, rows of
// numbers, polygons. A value that is wrong is complained about and not good; its target keeps zero.

#include "value.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// --- Messages

// What a message calls a number of the key.
static nmm_excerpt label_of(const nmm_key *key) {
    nmm_excerpt label = {{0}};
    const bool lone = key->kind == NMM_VALUE_NUMBER;
    snprintf(label.text, sizeof label.text, "%s%.40s", lone ? "" : "a number in ", key->name);
    return label;
}

// "from 0 to below 90 degrees" and the like.
static nmm_excerpt describe_range(const nmm_key *key, nmm_dimension dimension) {
    const nmm_range range = key->range;
    const char *unit = nmm_dimension_table[dimension].unit;
    const char *blank = *unit != 0 ? " " : "";
    nmm_excerpt text = {{0}};
    const size_t size = sizeof text.text;
    if (range.high >= 1e30) {
        snprintf(text.text, size, "%s %g%s%s", range.low_open ? "above" : "at least", range.low,
                 blank, unit);
    } else if (range.low_open || range.high_open) {
        snprintf(text.text, size, "%s %g and %s %g%s%s", range.low_open ? "above" : "at least",
                 range.low, range.high_open ? "below" : "at most", range.high, blank, unit);
    } else {
        snprintf(text.text, size, "from %g to %g%s%s", range.low, range.high, blank, unit);
    }
    return text;
}

static bool has_range(const nmm_key *key) {
    return key->range.low != 0 || key->range.high != 0;
}

static bool in_range(nmm_range range, double value) {
    const bool low = range.low_open ? value > range.low : value >= range.low;
    const bool high = range.high_open ? value < range.high : value <= range.high;
    return low && high;
}

// Names of the words of a key; `later` ones only when asked for.
static nmm_status list_words(nmm_reader *reader, const nmm_word *word, const char **list) {
    nmm_text text = {0};
    nmm_status status = NMM_OK;
    for (const nmm_word *w = word; w->text != NULL && status == NMM_OK; w++) {
        if (w->later) continue;
        status = nmm_text_add(reader->context, &text, "%s%s", text.length > 0 ? ", " : "", w->text);
    }
    char *copy = NULL;
    if (status == NMM_OK) {
        status =
            nmm_arena_text(reader->context, &reader->arena, &copy, text.text, (size_t)text.length);
    }
    nmm_release(reader->context, &text.text);
    *list = copy;
    return status;
}

// --- Numbers

// A unit that is not known: which are, and which one was probably meant.
static nmm_status complain_unit(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                                nmm_dimension dimension, const char *found) {
    const char *candidate[64];
    char list[300] = "";
    int n = 0;
    for (const nmm_unit *unit = nmm_unit_table; unit->name != NULL && n < 64; unit++) {
        if (unit->dimension != dimension) continue;
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", n > 0 ? ", " : "", unit->name);
        candidate[n++] = unit->name;
    }
    return nmm_complain(reader, node->mark, "%s: unit '%s' is not known%s; %s is written in: %s",
                        label_of(key).text, nmm_excerpt_of(found).text,
                        nmm_hint(found, n, candidate).text, nmm_dimension_table[dimension].article,
                        list);
}

static nmm_status complain_number(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                                  nmm_dimension dimension, nmm_number number) {
    const char *article = nmm_dimension_table[dimension].article;
    const nmm_excerpt found = nmm_node_describe(node);
    switch (number.fault) {
    case NMM_NUMBER_COMMA:
        return nmm_complain(reader, node->mark,
                            "%s must be a number, found %s; write the decimals behind a point",
                            label_of(key).text, found.text);
    case NMM_NUMBER_NOT_FINITE:
        return nmm_complain(reader, node->mark, "%s must be a finite number, found %s",
                            label_of(key).text, found.text);
    case NMM_NUMBER_HUGE:
    case NMM_NUMBER_TINY:
        return nmm_complain(reader, node->mark, "%s: %s is too %s for a number", label_of(key).text,
                            found.text, number.fault == NMM_NUMBER_HUGE ? "large" : "small");
    case NMM_NUMBER_UNIT:
        return complain_unit(reader, key, node, dimension, number.unit);
    case NMM_NUMBER_DIMENSION:
        return nmm_complain(reader, node->mark, "%s must be %s, %s is %s", label_of(key).text,
                            article, number.meant->name,
                            nmm_dimension_table[number.meant->dimension].article);
    default:
        return nmm_complain(reader, node->mark, "%s must %s (%s%s%s), found %s", key->name,
                            key->kind == NMM_VALUE_NUMBER ? "be a number" : "hold numbers", article,
                            key->automatic ? ", or auto" : "", key->whole ? ", whole" : "",
                            found.text);
    }
}

static nmm_status check_number(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                               nmm_dimension dimension, double value, bool *good) {
    const nmm_excerpt found = nmm_node_describe(node);
    const nmm_dimension_facts *facts = &nmm_dimension_table[dimension];
    *good = false;
    if (key->whole && value != floor(value))
        return nmm_complain(reader, node->mark, "%s must be a whole number, found %s",
                            label_of(key).text, found.text);
    if (has_range(key) && !in_range(key->range, value))
        return nmm_complain(reader, node->mark, "%s must be %s, found %s", label_of(key).text,
                            describe_range(key, dimension).text, found.text);
    if (fabs(value) > facts->limit)
        return nmm_complain(reader, node->mark, "%s must be from %g to %g %s, found %s",
                            label_of(key).text, -facts->limit, facts->limit, facts->unit,
                            found.text);
    *good = true;
    return NMM_OK;
}

static nmm_status read_number(nmm_reader *reader, const nmm_key *key, int column,
                              const nmm_node *node, double *value, bool *good) {
    const nmm_dimension dimension = key->dimension[column];
    *good = false;
    if (node->kind == NMM_NODE_WRONG) return NMM_OK;
    nmm_number number = {.fault = NMM_NUMBER_NONE};
    if (node->kind == NMM_NODE_SCALAR) {
        if (key->automatic && strcmp(node->text, "auto") == 0) {
            *value = 0;
            *good = true;
            return NMM_OK;
        }
        number = nmm_number_parse(node->text, dimension);
    }
    if (number.fault != NMM_NUMBER_GOOD)
        return complain_number(reader, key, node, dimension, number);
    if (dimension == NMM_ACCELERATION && *number.unit == 0)
        number.value *= reader->bare_acceleration;
    *value = number.value;
    return check_number(reader, key, node, dimension, number.value, good);
}

// --- Rows of numbers

static nmm_status read_row(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                           double *value, bool *good) {
    *good = false;
    if (node->kind == NMM_NODE_WRONG) return NMM_OK;
    if (node->kind != NMM_NODE_LIST || node->n != key->width) {
        char count[40] = "";
        if (node->kind == NMM_NODE_LIST) snprintf(count, sizeof count, " of %d", node->n);
        return nmm_complain(reader, node->mark, "%s%s must be a list of %d numbers, found %s%s",
                            key->kind == NMM_VALUE_ROW ? "" : "a row of ", key->name, key->width,
                            nmm_node_describe(node).text, count);
    }
    int column = 0, n_good = 0;
    for (const nmm_node *entry = node->first; entry != NULL; entry = entry->next, column++) {
        bool number_good = false;
        TRY(read_number(reader, key, column, entry, &value[column], &number_good));
        n_good += number_good ? 1 : 0;
    }
    *good = n_good == key->width;
    return NMM_OK;
}

static nmm_status read_rows(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                            raw_rows *rows, bool *good) {
    *good = false;
    if (node->kind == NMM_NODE_WRONG) return NMM_OK;
    if (node->kind != NMM_NODE_LIST)
        return nmm_complain(reader, node->mark, "%s must be a list of rows of %d numbers, found %s",
                            key->name, key->width, nmm_node_describe(node).text);
    const int most = key->most_row > 0 ? key->most_row : NMM_SCENE_MAX;
    if (node->n < key->least_row || node->n > most) {
        if (key->least_row == most)
            return nmm_complain(reader, node->mark, "%s must have %d rows, found %d", key->name,
                                most, node->n);
        return nmm_complain(reader, node->mark,
                            "%s must have at least %d and at most %d rows, found %d", key->name,
                            key->least_row, most, node->n);
    }
    *rows = (raw_rows){.n = node->n, .width = key->width, .node = node};
    TRY(nmm_arena_take(reader->context, &reader->arena, &rows->value,
                       (size_t)node->n * (size_t)key->width, sizeof(double)));
    bool all = true;
    double *row = rows->value;
    for (const nmm_node *entry = node->first; entry != NULL; entry = entry->next) {
        bool row_good = false;
        TRY(read_row(reader, key, entry, row, &row_good));
        all = all && row_good;
        row += key->width;
    }
    *good = all;
    return NMM_OK;
}

// One polygon [[x, y], ...] or a list of polygons.
static nmm_status read_polygons(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                                raw_polygons *polygons, bool *good) {
    *good = false;
    if (node->kind == NMM_NODE_WRONG) return NMM_OK;
    const nmm_node *entry = node->first;
    const nmm_node *inner = entry != NULL && entry->kind == NMM_NODE_LIST ? entry->first : NULL;
    const bool several = inner != NULL && inner->kind == NMM_NODE_LIST;
    polygons->n = several ? node->n : 1;
    TRY(nmm_arena_take(reader->context, &reader->arena, &polygons->polygon, (size_t)polygons->n,
                       sizeof *polygons->polygon));
    if (!several) return read_rows(reader, key, node, polygons->polygon, good);
    bool all = true;
    for (int i = 0; i < polygons->n; i++, entry = entry->next) {
        bool one = false;
        TRY(read_rows(reader, key, entry, &polygons->polygon[i], &one));
        all = all && one;
    }
    *good = all;
    return NMM_OK;
}

// --- Words

static nmm_status read_text(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                            const char **value, bool *good) {
    *good = false;
    if (node->kind == NMM_NODE_WRONG) return NMM_OK;
    const bool name = key->kind == NMM_VALUE_NAME;
    const bool text = node->kind == NMM_NODE_SCALAR && (!name || !nmm_node_empty(node));
    if (!text || (name && (*node->text == 0 || strlen(node->text) > 200)))
        return nmm_complain(reader, node->mark, "%s must be a %s, found %s", key->name,
                            name ? "name" : "text", nmm_node_describe(node).text);
    char *copy = NULL;
    TRY(nmm_arena_text(reader->context, &reader->scene->arena, &copy, node->text,
                       strlen(node->text)));
    *value = copy;
    *good = true;
    return NMM_OK;
}

static nmm_status read_word(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                            int *value, bool *good) {
    *good = false;
    if (node->kind == NMM_NODE_WRONG) return NMM_OK;
    const char *candidate[16];
    int n = 0;
    const nmm_word *found = NULL;
    const char *text = node->kind == NMM_NODE_SCALAR ? node->text : "";
    for (const nmm_word *word = key->word; word->text != NULL; word++) {
        if (strcmp(word->text, text) == 0) found = word;
        if (!word->later && n < 16) candidate[n++] = word->text;
    }
    *good = found != NULL && !found->later;
    if (*good) {
        *value = found->value;
        return NMM_OK;
    }
    const char *list = NULL;
    TRY(list_words(reader, key->word, &list));
    if (found != NULL)
        return nmm_complain(reader, node->mark, "%s: %s is not supported yet; allowed: %s",
                            key->name, text, list);
    return nmm_complain(reader, node->mark, "%s must be %s%s, found %s%s", key->name,
                        n > 1 ? "one of " : "", list, nmm_node_describe(node).text,
                        nmm_hint(text, n, candidate).text);
}

static nmm_status read_words(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                             int *mask, bool *good) {
    *good = false;
    *mask = 0;
    if (node->kind == NMM_NODE_WRONG) return NMM_OK;
    if (node->kind != NMM_NODE_LIST) {
        const char *list = NULL;
        TRY(list_words(reader, key->word, &list));
        return nmm_complain(reader, node->mark, "%s must be a list of words from %s, found %s",
                            key->name, list, nmm_node_describe(node).text);
    }
    bool all = true;
    for (const nmm_node *entry = node->first; entry != NULL; entry = entry->next) {
        int value = 0;
        bool one = false;
        TRY(read_word(reader, key, entry, &value, &one));
        *mask |= value;
        all = all && one;
    }
    *good = all;
    return NMM_OK;
}

// --- Any

nmm_status nmm_value_read(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                          void *target, bool *good) {
    switch (key->kind) {
    case NMM_VALUE_NUMBER:
        return read_number(reader, key, 0, node, target, good);
    case NMM_VALUE_TEXT:
    case NMM_VALUE_NAME:
        return read_text(reader, key, node, target, good);
    case NMM_VALUE_CHOICE:
        return read_word(reader, key, node, target, good);
    case NMM_VALUE_WORDS:
        return read_words(reader, key, node, target, good);
    case NMM_VALUE_ROW:
        return read_row(reader, key, node, target, good);
    case NMM_VALUE_ROWS:
        return read_rows(reader, key, node, target, good);
    default:
        NMM_ASSERT(key->kind == NMM_VALUE_POLYGONS);
        return read_polygons(reader, key, node, target, good);
    }
}
