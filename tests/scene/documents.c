// SPDX-License-Identifier: MIT
//
// The JSON Schema and the tables of docs/format.md are made from the key table here, and compared
// with the files in docs/. So schema, documents and reader cannot drift apart.
//
//   scene_documents DOCS            compare
//   scene_documents DOCS --write    write the files anew

#include "keys.h"
#include "raw.h"
#include "test.h"

#include <stdlib.h>

static const char *docs;
static nmm_context context = {.n_thread = 1};

#define ADD(text, ...) assert_int_equal(nmm_text_add(&context, text, __VA_ARGS__), NMM_OK)

// --- JSON Schema

static void add_quoted(nmm_text *out, const char *text) {
    ADD(out, "\"");
    for (; *text != 0; text++)
        ADD(out, *text == '"' || *text == '\\' ? "\\%c" : "%c", *text);
    ADD(out, "\"");
}

static void add_limit(nmm_text *out, const char *name, bool open, double value) {
    char word[24];
    snprintf(word, sizeof word, "%s%c%s", open ? "exclusive" : "", open ? name[0] - 32 : name[0],
             name + 1);
    ADD(out, ", \"%s\": %.17g", word, value);
}

// Name of a dimension among the definitions.
static const char *quantity_name(nmm_dimension dimension) {
    static const char *const name[NMM_N_DIMENSION] = {
        [NMM_PURE] = "plain_number", [NMM_LENGTH] = "length",
        [NMM_TIME] = "time",         [NMM_ANGLE] = "angle",
        [NMM_DENSITY] = "density",   [NMM_STRESS] = "stress",
        [NMM_FORCE] = "force",       [NMM_VELOCITY] = "velocity",
        [NMM_SPIN] = "spin",         [NMM_ACCELERATION] = "acceleration",
        [NMM_RATE] = "rate",         [NMM_STIFFNESS] = "stiffness"};
    return name[dimension];
}

static bool has_range(nmm_range range) {
    return range.low != 0 || range.high != 0;
}

// A number of one column: bare, or as text with a unit.
static void add_number(nmm_text *out, const nmm_key *key, int column) {
    const nmm_range range = key->range;
    ADD(out, "{\"anyOf\": [{\"type\": \"%s\"", key->whole ? "integer" : "number");
    if (has_range(range)) {
        add_limit(out, "minimum", range.low_open, range.low);
        if (range.high < 1e30) add_limit(out, "maximum", range.high_open, range.high);
    }
    ADD(out, "}, {\"$ref\": \"#/definitions/quantity_%s\"}", quantity_name(key->dimension[column]));
    if (key->automatic) ADD(out, ", {\"const\": \"auto\"}");
    ADD(out, "]}");
}

static void add_row(nmm_text *out, const nmm_key *key) {
    ADD(out, "{\"type\": \"array\", \"minItems\": %d, \"maxItems\": %d, \"items\": [", key->width,
        key->width);
    for (int i = 0; i < key->width; i++) {
        if (i > 0) ADD(out, ", ");
        add_number(out, key, i);
    }
    ADD(out, "]}");
}

static void add_rows(nmm_text *out, const nmm_key *key) {
    ADD(out, "{\"type\": \"array\", \"minItems\": %d", key->least_row);
    if (key->most_row > 0) ADD(out, ", \"maxItems\": %d", key->most_row);
    ADD(out, ", \"items\": ");
    add_row(out, key);
    ADD(out, "}");
}

static void add_words(nmm_text *out, const nmm_key *key) {
    ADD(out, "{\"enum\": [");
    bool first = true;
    for (const nmm_word *word = key->word; word->text != NULL; word++) {
        if (word->later) continue;
        // A word made of digits is a number to most readers.
        const bool digits = strspn(word->text, "0123456789") == strlen(word->text);
        ADD(out, "%s%s%s%s", first ? "" : ", ", digits ? "" : "\"", word->text, digits ? "" : "\"");
        first = false;
    }
    ADD(out, "]}");
}

static void add_value(nmm_text *out, const nmm_key *key) {
    switch (key->kind) {
    case NMM_VALUE_NUMBER:
        add_number(out, key, 0);
        break;
    case NMM_VALUE_TEXT:
        ADD(out, "{\"type\": [\"string\", \"number\", \"boolean\", \"null\"]}");
        break;
    case NMM_VALUE_NAME:
        ADD(out, "{\"type\": [\"string\", \"number\", \"boolean\"], \"minLength\": 1}");
        break;
    case NMM_VALUE_CHOICE:
        add_words(out, key);
        break;
    case NMM_VALUE_WORDS:
        ADD(out, "{\"type\": \"array\", \"items\": ");
        add_words(out, key);
        ADD(out, "}");
        break;
    case NMM_VALUE_ROW:
        add_row(out, key);
        break;
    case NMM_VALUE_ROWS:
        add_rows(out, key);
        break;
    case NMM_VALUE_POLYGONS:
        ADD(out, "{\"anyOf\": [");
        add_rows(out, key);
        ADD(out, ", {\"type\": \"array\", \"items\": ");
        add_rows(out, key);
        ADD(out, "}]}");
        break;
    case NMM_VALUE_OBJECT:
        ADD(out, "{\"$ref\": \"#/definitions/%s\"}", key->object->name);
        break;
    case NMM_VALUE_LIST:
        ADD(out, "{\"type\": \"array\", \"items\": {\"$ref\": \"#/definitions/%s\"}}",
            key->object->name);
        break;
    case NMM_VALUE_NAMED:
        ADD(out,
            "{\"type\": \"object\", \"additionalProperties\": {\"$ref\": \"#/definitions/%s\"}}",
            key->object->name);
        break;
    }
}

static void add_property(nmm_text *out, const nmm_key *key) {
    nmm_text words = {0};
    ADD(&words, "%s", key->meaning);
    const char *unit = nmm_dimension_table[key->dimension[0]].unit;
    if (key->kind == NMM_VALUE_NUMBER && *unit != 0) ADD(&words, " [%s]", unit);
    const char *standard = key->standard != NULL ? key->standard : key->computed;
    if (standard != NULL) ADD(&words, "; default: %s", standard);
    ADD(out, "\"%s\": {\"description\": ", key->name);
    add_quoted(out, words.text);
    ADD(out, ", \"allOf\": [");
    add_value(out, key);
    ADD(out, "]}");
    nmm_release(&context, &words.text);
}

// "required": the keys that must be there, or one of a few.
static void add_required(nmm_text *out, const nmm_object *object) {
    int n = 0;
    for (int k = 0; k < object->n_key; k++) {
        if (!object->key[k].required) continue;
        ADD(out, "%s\"%s\"", n++ == 0 ? ", \"required\": [" : ", ", object->key[k].name);
    }
    if (n > 0) ADD(out, "]");
    if (object->one_of == NULL) return;
    ADD(out, ", \"oneOf\": [");
    for (const char *p = object->one_of; *p != 0;) {
        const int length = (int)strcspn(p, ",");
        ADD(out, "%s{\"required\": [\"%.*s\"]}", p == object->one_of ? "" : ", ", length, p);
        p += length;
        p += strspn(p, ", ");
    }
    ADD(out, "]");
}

static void add_object(nmm_text *out, const nmm_object *object, const char *indent) {
    ADD(out, "%s\"description\": ", indent);
    add_quoted(out, object->meaning);
    ADD(out, ",\n%s\"type\": \"object\", \"additionalProperties\": false", indent);
    add_required(out, object);
    ADD(out, ",\n%s\"properties\": {", indent);
    bool first = true;
    for (int k = 0; k < object->n_key; k++) {
        if (object->key[k].later) continue;
        ADD(out, "%s\n%s  ", first ? "" : ",", indent);
        add_property(out, &object->key[k]);
        first = false;
    }
    ADD(out, "\n%s}", indent);
}

// Numbers as text: `5e9`, which some readers of YAML take for text, and `20 GPa`.
static void add_quantity(nmm_text *out, nmm_dimension dimension) {
    ADD(out,
        "    \"quantity_%s\": {\"description\": \"%s as text\", \"type\": \"string\", \"pattern\": "
        "\"^[-+]?([0-9]+\\\\.?[0-9]*|\\\\.[0-9]+)([eE][-+]?[0-9]+)?( *(",
        quantity_name(dimension), nmm_dimension_table[dimension].article);
    bool first = true;
    for (const nmm_unit *unit = nmm_unit_table; unit->name != NULL; unit++) {
        if (unit->dimension != dimension) continue;
        ADD(out, "%s%s", first ? "" : "|", unit->name);
        first = false;
    }
    ADD(out, "))?$\"},\n");
}

static nmm_text make_schema(void) {
    nmm_text out = {0};
    ADD(&out, "{\n  \"$schema\": \"http://json-schema.org/draft-07/schema#\",\n"
              "  \"title\": \"nmm scene\",\n");
    add_object(&out, &nmm_object_scene, "  ");
    // Times are needed by all but statics.
    ADD(&out, ",\n  \"if\": {\"required\": [\"analysis\"], \"properties\": {\"analysis\": "
              "{\"required\": [\"kind\"], \"properties\": {\"kind\": {\"const\": \"static\"}}}}},\n"
              "  \"else\": {\"required\": [\"time\"], \"properties\": {\"time\": "
              "{\"required\": [\"dt\", \"end\"]}}}");
    ADD(&out, ",\n  \"definitions\": {\n");
    for (int d = 0; d < NMM_N_DIMENSION; d++)
        add_quantity(&out, (nmm_dimension)d);
    for (int i = 1; nmm_object_table[i] != NULL; i++) {
        ADD(&out, "    \"%s\": {\n", nmm_object_table[i]->name);
        add_object(&out, nmm_object_table[i], "      ");
        ADD(&out, "\n    }%s\n", nmm_object_table[i + 1] != NULL ? "," : "");
    }
    ADD(&out, "  }\n}\n");
    return out;
}

// --- Tables of the format

static void add_range(nmm_text *out, nmm_range range) {
    if (!has_range(range)) return;
    const bool to = range.high < 1e30;
    if (!range.low_open && !range.high_open && to) {
        ADD(out, ", from %g to %g", range.low, range.high);
        return;
    }
    ADD(out, ", %s %g", range.low_open ? "above" : "at least", range.low);
    if (to) ADD(out, ", %s %g", range.high_open ? "below" : "at most", range.high);
}

static void add_units(nmm_text *out, const nmm_key *key) {
    bool any = false;
    for (int i = 0; i < key->width || i == 0; i++)
        any = any || key->dimension[i] != NMM_PURE;
    if (!any) return;
    ADD(out, " [");
    for (int i = 0; i < key->width || i == 0; i++) {
        const char *unit = nmm_dimension_table[key->dimension[i]].unit;
        ADD(out, "%s%s", i > 0 ? ", " : "", *unit != 0 ? unit : "1");
    }
    ADD(out, "]");
}

static void add_choices(nmm_text *out, const nmm_word *word) {
    bool first = true;
    for (; word->text != NULL; word++) {
        if (word->later) continue;
        ADD(out, "%s`%s`", first ? "" : ", ", word->text);
        first = false;
    }
}

static void add_type(nmm_text *out, const nmm_key *key) {
    switch (key->kind) {
    case NMM_VALUE_NUMBER:
        ADD(out, key->whole ? "whole number" : "number");
        add_units(out, key);
        add_range(out, key->range);
        if (key->automatic) ADD(out, ", or `auto`");
        break;
    case NMM_VALUE_ROW:
        ADD(out, "%d %snumbers", key->width, key->whole ? "whole " : "");
        add_units(out, key);
        add_range(out, key->range);
        break;
    case NMM_VALUE_ROWS:
    case NMM_VALUE_POLYGONS:
        ADD(out, "%s of %d numbers", key->least_row == 2 && key->most_row == 2 ? "2 rows" : "rows",
            key->width);
        add_units(out, key);
        break;
    case NMM_VALUE_CHOICE:
        add_choices(out, key->word);
        break;
    case NMM_VALUE_WORDS:
        ADD(out, "list of ");
        add_choices(out, key->word);
        break;
    case NMM_VALUE_OBJECT:
        ADD(out, "[map](#%s)", key->object->name);
        break;
    case NMM_VALUE_LIST:
        ADD(out, "[list of maps](#%s)", key->object->name);
        break;
    case NMM_VALUE_NAMED:
        ADD(out, "[maps by name](#%s)", key->object->name);
        break;
    default:
        ADD(out, key->kind == NMM_VALUE_NAME ? "name" : "text");
    }
}

static void add_table(nmm_text *out, const nmm_object *object) {
    ADD(out, "%s\n\n| key | value | default | meaning |\n|---|---|---|---|\n", object->meaning);
    for (int k = 0; k < object->n_key; k++) {
        const nmm_key *key = &object->key[k];
        if (key->later) continue;
        ADD(out, "| `%s` | ", key->name);
        add_type(out, key);
        const char *standard = key->computed != NULL ? key->computed : "";
        if (key->standard != NULL)
            ADD(out, " | `%s`", key->standard);
        else
            ADD(out, " | %s", key->required ? "**required**" : standard);
        ADD(out, " | %s |\n", key->meaning);
    }
    if (object->one_of != NULL) ADD(out, "\nExactly one of: %s.\n", object->one_of);
}

static const nmm_object *find_object(const char *name, size_t length) {
    for (int i = 0; nmm_object_table[i] != NULL; i++) {
        const char *other = nmm_object_table[i]->name;
        if (strlen(other) == length && memcmp(other, name, length) == 0) return nmm_object_table[i];
    }
    return NULL;
}

// `old` with all that stands between <!-- keys: NAME --> and <!-- end --> made anew.
static nmm_text make_format(const char *old, int *n_table) {
    static const char begin[] = "<!-- keys: ", end[] = "<!-- end -->";
    nmm_text out = {0};
    *n_table = 0;
    for (const char *p = strstr(old, begin); p != NULL; p = strstr(old, begin)) {
        const char *name = p + strlen(begin);
        const size_t length = strcspn(name, " ");
        const nmm_object *object = find_object(name, length);
        if (object == NULL) fail_msg("docs/format.md: no object %.*s", (int)length, name);
        const char *line = strchr(name, '\n');
        const char *close = strstr(name, end);
        assert_non_null(line);
        assert_non_null(close);
        ADD(&out, "%.*s", (int)(line + 1 - old), old);
        add_table(&out, object);
        *n_table += 1;
        old = close;
    }
    ADD(&out, "%s", old);
    return out;
}

// --- Comparing

static char *read_file(const char *name) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s", docs, name);
    FILE *file = fopen(path, "rb");
    if (file == NULL) return NULL;
    char *text = NULL;
    assert_int_equal(nmm_allocate(&context, &text, 1 << 20, 1), NMM_OK);
    const size_t n = fread(text, 1, (1 << 20) - 1, file);
    fclose(file);
    text[n] = 0;
    return text;
}

static void write_file(const char *name, const nmm_text *text) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s", docs, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text->text, 1, (size_t)text->length, file), (size_t)text->length);
    assert_int_equal(fclose(file), 0);
}

static void compare(const char *name, const char *there, const nmm_text *made) {
    assert_non_null(there);
    if (strcmp(there, made->text) == 0) return;
    int line = 1;
    for (size_t i = 0; there[i] == made->text[i]; i++)
        line += there[i] == '\n' ? 1 : 0;
    fail_msg("docs/%s, line %d, is not what the key table says; run scene_documents docs --write",
             name, line);
}

static void schema_is_up_to_date(void **unused) {
    (void)unused;
    nmm_text made = make_schema();
    char *there = read_file("scene.schema.json");
    compare("scene.schema.json", there, &made);
    nmm_release(&context, &there);
    nmm_release(&context, &made.text);
}

static void format_is_up_to_date(void **unused) {
    (void)unused;
    char *there = read_file("format.md");
    assert_non_null(there);
    int n_table = 0, n_object = 0;
    nmm_text made = make_format(there, &n_table);
    while (nmm_object_table[n_object] != NULL)
        n_object += 1;
    assert_int_equal(n_table, n_object);
    compare("format.md", there, &made);
    nmm_release(&context, &there);
    nmm_release(&context, &made.text);
}

// Every object that a key refers to is in the table of objects, and every default is a good value.
static void objects_are_listed(void **unused) {
    (void)unused;
    for (int i = 0; nmm_object_table[i] != NULL; i++) {
        const nmm_object *object = nmm_object_table[i];
        assert_true(object->n_key <= 64);
        for (int k = 0; k < object->n_key; k++) {
            const nmm_key *key = &object->key[k];
            if (key->later) continue;
            assert_non_null(key->meaning);
            assert_true(key->offset >= sizeof(raw_head) && key->offset < object->size);
            if (key->object != NULL)
                assert_ptr_equal(find_object(key->object->name, strlen(key->object->name)),
                                 key->object);
            if (object->noted && key->standard != NULL) assert_non_null(key->why);
        }
    }
}

static void write_all(void **unused) {
    (void)unused;
    nmm_text schema = make_schema();
    write_file("scene.schema.json", &schema);
    char *there = read_file("format.md");
    int n = 0;
    nmm_text format = make_format(there, &n);
    write_file("format.md", &format);
    nmm_release(&context, &there);
    nmm_release(&context, &schema.text);
    nmm_release(&context, &format.text);
}

int main(int n_argument, char **argument) {
    docs = n_argument > 1 ? argument[1] : "docs";
    const struct CMUnitTest write[] = {cmocka_unit_test(write_all)};
    if (n_argument > 2 && strcmp(argument[2], "--write") == 0)
        return cmocka_run_group_tests(write, NULL, NULL);
    const struct CMUnitTest test[] = {
        cmocka_unit_test(schema_is_up_to_date),
        cmocka_unit_test(format_is_up_to_date),
        cmocka_unit_test(objects_are_listed),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
