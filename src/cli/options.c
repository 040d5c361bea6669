// SPDX-License-Identifier: MIT
//
// Reads a command's words by the option table: --name value, --name=value, -n value, -nvalue and
// "--" before file names that begin with a dash.
//
// A table of our own instead of getopt_long, because parsing, help and suggestions then cannot
// disagree, and because each command takes only its own options.

#include "options.h"

#include "message.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define METHODS "auto, jacobi, chebyshev, pcg, sor, gauss-seidel or direct"
#define BLOCKS "auto, cover, cluster or body"
#define PRECISIONS "auto, double or mixed"
#define STOPS "residual or average_change"

typedef struct option_row {
    const char *name;
    char letter;          // 0: none
    const char *argument; // NULL: a switch
    const char *help;
} option_row;

static const option_row option_table[N_OPTION] = {
    [OPTION_OUTPUT] = {"output", 'o', "FILE", "where to write"},
    [OPTION_SET] = {"set", 's', "KEY=VALUE", "replace a value of the scene; may be repeated"},
    [OPTION_DEVICE] = {"device", 0, "NAME", "where to solve: host, target or auto"},
    [OPTION_THREADS] = {"threads", 't', "N", "host threads (all)"},
    [OPTION_STEPS] = {"steps", 0, "N", "steps to compare (to the scene's end, at most 50)"},
    [OPTION_ALLOW] = {"allow", 0, "DIFFERENCE", "of displacements, over the largest one (1e-9)"},
    [OPTION_DUMP] = {"dump-system", 0, "STEP:ITERATION PREFIX",
                     "write the linear system of that step and open-close iteration, from 1"},
    [OPTION_RHS] = {"rhs", 0, "FILE", "right-hand side (matrix times ones)"},
    [OPTION_GUESS] = {"guess", 0, "FILE", "first guess (zeros)"},
    [OPTION_PLACES] = {"places", 0, "FILE", "x, y and body of each two unknowns"},
    [OPTION_METHOD] = {"method", 0, "NAME", METHODS " (auto)"},
    [OPTION_BLOCKS] = {"blocks", 0, "NAME", "diagonal blocks: " BLOCKS " (auto)"},
    [OPTION_PRECISION] = {"precision", 0, "NAME", PRECISIONS " (auto)"},
    [OPTION_TOLERANCE] = {"tolerance", 0, "R", "relative residual to reach (1e-8)"},
    [OPTION_ABSOLUTE] = {"absolute", 0, "F", "norm of the residual that is small enough (none)"},
    [OPTION_STOP] = {"stop", 0, "TEST", STOPS " (residual)"},
    [OPTION_DAMPING] = {"damping", 0, "D", "of jacobi; 1: plain (from an estimate)"},
    [OPTION_FACTOR] = {"factor", 0, "W", "over-relaxation of sor (1.9)"},
    [OPTION_MAX_ITERATIONS] = {"max-iterations", 0, "N", "more is a failure (by size)"},
    [OPTION_REPEAT] = {"repeat", 'n', "N", "solves to measure, for their median (1)"},
    [OPTION_FRAME] = {"frame", 'f', "K", "frame, from 0, or last (last)"},
    [OPTION_FIELD] = {"field", 0, "NAME", "stress, sxx, syy, sxy, displacement, velocity or block"},
    [OPTION_SCALE] = {"scale", 0, "FACTOR", "factor on displacements (true scale)"},
    [OPTION_WIDTH] = {"width", 0, "PIXELS", "width of the picture (1600)"},
    [OPTION_VTU] = {"vtu", 0, "FOLDER", "write .pvd and one .vtu for each frame there"},
    [OPTION_FOLDER] = {"output", 'o', "FOLDER", "where to write (bench or trade)"},
    [OPTION_THREAD_LIST] = {"threads", 't', "N,N...", "numbers of host threads (one, and all)"},
    [OPTION_SCENES] = {"scenes", 0, "FOLDER", "scenes to compute (examples/paper, or installed)"},
    [OPTION_KNOBS] = {"knobs", 'k', "NAME,NAME...",
                      "size, dt, order, mesh, scheme, tolerance, solver, precision, penalty (all)"},
    [OPTION_QUANTITY] = {"quantity", 0, "NAME",
                         "monitors.NAME.displacement[1], or velocity, stress (first monitor)"},
    [OPTION_EXPECT] = {"expect", 0, "NAME=VALUE", "the quantity and its exact value"},
    [OPTION_WANT] = {"want", 'w', "ERROR", "name the cheapest setting with it: 1% or 0.01"},
    [OPTION_LONGEST] = {"longest", 0, "S", "seconds that one run may take (600; quick 20)"},
    [OPTION_QUICK] = {"quick", 0, NULL, "a short form, in seconds, good for a look only"},
    [OPTION_JSON] = {"json", 0, NULL, "print one JSON object on standard output"},
    [OPTION_QUIET] = {"quiet", 'q', NULL, "print errors only"},
    [OPTION_HELP] = {"help", 'h', NULL, "print this help"},
    [OPTION_VERSION] = {"version", 0, NULL, "print version and build"},
};

static bool allowed(const command *which, int id) {
    return id == OPTION_HELP || id == OPTION_VERSION || (which->options >> id & 1u);
}

// --- Values

static bool read_integer(const char *text, long low, long high, int *value) {
    char *end;
    errno = 0;
    const long number = strtol(text, &end, 10);
    if (errno || end == text || *end || number < low || number > high) return false;
    *value = (int)number;
    return true;
}

/// A number above 0 and below `high`.
static bool read_number(const char *text, double high, double *value) {
    char *end;
    *value = strtod(text, &end);
    return end != text && !*end && isfinite(*value) && *value > 0 && *value < high;
}

/// A word out of a list as it is printed: "a, b or c".
static bool read_word(const char *text, const char *list, const char **value) {
    const size_t length = strlen(text);
    *value = text;
    for (const char *at = list; *at;) {
        const size_t n = strcspn(at, ", ");
        // The word before the last one of the list is no choice.
        const bool joint = n == 2 && !strncmp(at, "or", 2);
        if (!joint && n == length && !strncmp(at, text, n)) return true;
        at += n + strspn(at + n, ", ");
    }
    return false;
}

static bool read_device(const char *text, nmm_device_choice *value) {
    static const char *const name[] = {"auto", "host", "target"};
    for (int i = 0; i < 3; i++)
        if (!strcmp(text, name[i])) {
            *value = (nmm_device_choice)(NMM_DEVICE_CHOOSE + i);
            return true;
        }
    return false;
}

static bool read_frame(const char *text, int *value) {
    if (strcmp(text, "last")) return read_integer(text, 0, 2147483646, value);
    *value = -1;
    return true;
}

static bool read_setting(const char *text, arguments *given) {
    const char *equals = strchr(text, '=');
    if (!equals || equals == text) return false;
    given->set[given->n_set++] = text;
    return true;
}

/// Numbers from 1 with commas between.
static bool read_threads(const char *text, arguments *given) {
    enum { MOST = sizeof given->thread_list / sizeof *given->thread_list };
    char *end;
    for (given->n_thread_list = 0; given->n_thread_list < MOST; text = end + 1) {
        errno = 0;
        const long n = strtol(text, &end, 10);
        if (errno || end == text || n < 1 || n > 4096) return false;
        given->thread_list[given->n_thread_list++] = (int)n;
        if (*end == 0) return true;
        if (*end != ',') return false;
    }
    return false;
}

/// STEP:ITERATION
static bool read_dump(const char *text, arguments *given) {
    char *end;
    errno = 0;
    given->dump_step = strtol(text, &end, 10);
    if (errno || end == text || *end != ':' || given->dump_step < 1) return false;
    return read_integer(end + 1, 1, 1000000, &given->dump_iteration);
}

/// The same as keep_value, for the options of `solve`.
static const char *keep_linear(int id, const char *value, nmm_linear_def *def) {
    switch (id) {
    case OPTION_RHS:
        def->rhs = value;
        return *value ? NULL : "a file name";
    case OPTION_GUESS:
        def->guess = value;
        return *value ? NULL : "a file name";
    case OPTION_PLACES:
        def->places = value;
        return *value ? NULL : "a file name";
    case OPTION_METHOD:
        return read_word(value, METHODS, &def->method) ? NULL : METHODS;
    case OPTION_BLOCKS:
        return read_word(value, BLOCKS, &def->blocks) ? NULL : BLOCKS;
    case OPTION_PRECISION:
        return read_word(value, PRECISIONS, &def->precision) ? NULL : PRECISIONS;
    case OPTION_STOP:
        return read_word(value, STOPS, &def->stop) ? NULL : STOPS;
    case OPTION_TOLERANCE:
        return read_number(value, 1, &def->tolerance) ? NULL : "a number above 0 and below 1";
    case OPTION_ABSOLUTE:
        return read_number(value, INFINITY, &def->absolute) ? NULL : "a number above 0";
    case OPTION_DAMPING:
        return read_number(value, 2, &def->damping) ? NULL : "a number above 0 and below 2";
    case OPTION_FACTOR:
        return read_number(value, 2, &def->sor_factor) ? NULL : "a number above 0 and below 2";
    case OPTION_MAX_ITERATIONS:
        return read_integer(value, 1, 1000000000, &def->max_iterations)
                   ? NULL
                   : "a whole number from 1 to 1e9";
    case OPTION_REPEAT:
        return read_integer(value, 1, 1000000, &def->n_repeat) ? NULL
                                                               : "a whole number from 1 to 1e6";
    default:
        return NULL;
    }
}

/// A part of 1, or of 100 with a percent sign.
static bool read_part(const char *text, double *value) {
    char number[64];
    const size_t length = strlen(text);
    const bool percent = length > 0 && text[length - 1] == '%';
    if (length - percent >= sizeof number) return false;
    snprintf(number, sizeof number, "%.*s", (int)(length - percent), text);
    if (!read_number(number, percent ? 100 : 1, value)) return false;
    if (percent) *value /= 100;
    return true;
}

/// The same, for those of `trade`.
static const char *keep_trade(int id, const char *value, arguments *given) {
    switch (id) {
    case OPTION_KNOBS:
        given->knobs = value;
        return *value ? NULL : "names of knobs with commas between";
    case OPTION_QUANTITY:
        given->quantity = value;
        return *value ? NULL : "as monitors.NAME.displacement[1]";
    case OPTION_EXPECT:
        given->expect = value;
        return strchr(value, '=') ? NULL : "as monitors.NAME.displacement[0]=3.6256";
    case OPTION_WANT:
        return read_part(value, &given->want) ? NULL : "above 0 and below 100%, as 1% or 0.01";
    case OPTION_LONGEST:
        return read_number(value, INFINITY, &given->longest) ? NULL : "a number above 0";
    default:
        return keep_linear(id, value, &given->linear);
    }
}

/// The same, for those of `bench`.
static const char *keep_bench(int id, const char *value, arguments *given) {
    switch (id) {
    case OPTION_FOLDER:
        given->output = value;
        return *value ? NULL : "a folder";
    case OPTION_SCENES:
        given->scenes = value;
        return *value ? NULL : "a folder";
    case OPTION_THREAD_LIST:
        return read_threads(value, given) ? NULL : "up to 16 whole numbers from 1 to 4096, as 1,2";
    default:
        return keep_trade(id, value, given);
    }
}

/// Keep the value of an option; NULL on success, else what would have been right.
static const char *keep_value(int id, const char *value, arguments *given) {
    switch (id) {
    case OPTION_OUTPUT:
        given->output = value;
        return *value ? NULL : "a file name";
    case OPTION_FIELD:
        given->field = value;
        return *value ? NULL : "the name of a field";
    case OPTION_VTU:
        given->vtu = value;
        return *value ? NULL : "a folder";
    case OPTION_SET:
        return read_setting(value, given) ? NULL : "key.path=value, as in --set time.end=2";
    case OPTION_DEVICE:
        return read_device(value, &given->device) ? NULL : "host, target or auto";
    case OPTION_THREADS:
        return read_integer(value, 1, 4096, &given->n_thread) ? NULL
                                                              : "a whole number from 1 to 4096";
    case OPTION_STEPS:
        return read_integer(value, 1, 1000000000, &given->n_step) ? NULL
                                                                  : "a whole number from 1 to 1e9";
    case OPTION_ALLOW:
        return read_number(value, 1, &given->allow) ? NULL : "a number above 0 and below 1";
    case OPTION_DUMP:
        return read_dump(value, given) ? NULL : "STEP:ITERATION, each a whole number from 1";
    case OPTION_FRAME:
        return read_frame(value, &given->frame) ? NULL : "a whole number from 0, or last";
    case OPTION_SCALE:
        return read_number(value, INFINITY, &given->scale) ? NULL : "a number above 0";
    case OPTION_WIDTH:
        return read_integer(value, 100, 20000, &given->width) ? NULL : "100 to 20000 pixels";
    default:
        return keep_bench(id, value, given);
    }
}

static void keep_switch(int id, arguments *given) {
    if (id == OPTION_JSON) given->json = true;
    if (id == OPTION_QUIET) given->quiet = true;
    if (id == OPTION_QUICK) given->quick = true;
    if (id == OPTION_HELP) given->help = true;
    if (id == OPTION_VERSION) given->version = true;
}

// --- Words

/// The option that `word` names, N_OPTION where there is none; *value: what is attached, or NULL.
static int find_option(const command *which, const char *word, const char **value) {
    *value = NULL;
    if (word[1] != '-') {
        for (int id = 0; id < N_OPTION; id++)
            if (allowed(which, id) && option_table[id].letter == word[1]) {
                *value = word[2] ? word + 2 : NULL;
                return id;
            }
        return N_OPTION;
    }
    const size_t length = strcspn(word + 2, "=");
    if (word[2 + length] == '=') *value = word + 2 + length + 1;
    for (int id = 0; id < N_OPTION; id++) {
        const char *name = option_table[id].name;
        if (allowed(which, id) && strlen(name) == length && !strncmp(name, word + 2, length))
            return id;
    }
    return N_OPTION;
}

static void complain_unknown(const command *which, const char *word) {
    const char *names[N_OPTION + 1];
    int n = 0;
    for (int id = 0; id < N_OPTION; id++)
        if (allowed(which, id)) names[n++] = option_table[id].name;
    names[n] = NULL;
    const char *near = word[1] == '-' ? nearest_name(word + 2, names) : NULL;
    if (near)
        message_error("nmm %s: unknown option %s; did you mean --%s?", which->name, word, near);
    else
        message_error("nmm %s: unknown option %s; see nmm %s --help", which->name, word,
                      which->name);
}

/// Take the option at word[*at] and what belongs to it.
static bool take_option(const command *which, int n_word, char **word, int *at, arguments *given) {
    const char *value;
    const int id = find_option(which, word[*at], &value);
    if (id == N_OPTION) {
        complain_unknown(which, word[*at]);
        return false;
    }
    const option_row *row = &option_table[id];
    if (!row->argument) {
        if (value) message_error("nmm %s: --%s takes no value", which->name, row->name);
        keep_switch(id, given);
        return !value;
    }
    if (!value && *at + 1 < n_word) value = word[++*at];
    if (!value) {
        message_error("nmm %s: --%s needs a value: %s", which->name, row->name, row->argument);
        return false;
    }
    const char *wanted = keep_value(id, value, given);
    if (wanted)
        message_error("nmm %s: --%s: found \"%s\", must be %s", which->name, row->name, value,
                      wanted);
    if (wanted || id != OPTION_DUMP) return !wanted;
    // The one option with two values.
    if (*at + 1 < n_word) given->dump = word[++*at];
    if (given->dump && *given->dump && given->dump[0] != '-') return true;
    message_error("nmm %s: --%s %s needs a prefix for the files", which->name, row->name, value);
    return false;
}

static bool take_path(const command *which, const char *word, arguments *given) {
    if (given->path || !*word) {
        message_error("nmm %s: one %s expected, found \"%s\" as well", which->name, which->operand,
                      word);
        return false;
    }
    given->path = word;
    return true;
}

bool options_parse(const command *which, int n_word, char **word, arguments *given) {
    bool only_paths = false;
    for (int at = 0; at < n_word; at++) {
        const bool dash = word[at][0] == '-' && word[at][1];
        if (!only_paths && !strcmp(word[at], "--"))
            only_paths = true;
        else if (dash && !only_paths && !take_option(which, n_word, word, &at, given))
            return false;
        else if ((!dash || only_paths) && !take_path(which, word[at], given))
            return false;
    }
    if (given->path || given->help || given->version) return true;
    message_error("nmm %s: which %s? See nmm %s --help", which->name, which->operand, which->name);
    return false;
}

// --- Help

static void print_options(uint64_t set) {
    for (int id = 0; id < N_OPTION; id++) {
        const option_row *row = &option_table[id];
        if (!(set >> id & 1u)) continue;
        char left[64];
        snprintf(left, sizeof left, "--%s%s%s", row->name, row->argument ? " " : "",
                 row->argument ? row->argument : "");
        if (row->letter)
            printf("  -%c, %-18s %s\n", row->letter, left, row->help);
        else if (strlen(left) <= 18)
            printf("      %-18s %s\n", left, row->help);
        else
            printf("      %s\n%25s%s\n", left, "", row->help);
    }
}

void help_command(const command *which) {
    printf("Usage: nmm %s %s [options]\n\n%s.\n%s", which->name, which->operand, which->purpose,
           which->detail);
    printf("\nOptions:\n");
    print_options(which->options | BIT(OPTION_HELP) | BIT(OPTION_VERSION));
    printf("\nExamples:\n%s", which->examples);
}

void help_program(void) {
    printf("Usage: nmm COMMAND FILE [options]\n\n"
           "Jointed rock and block systems in 2-D with the Numerical Manifold Method.\n\n"
           "Commands:\n");
    for (const command *c = command_table; c->name; c++)
        printf("  %-8s %s\n", c->name, c->purpose);
    printf("\nOptions:\n");
    print_options(BIT(OPTION_HELP) | BIT(OPTION_VERSION));
    printf("\nExamples:\n"
           "  nmm check slope.yaml               see what the scene comes to\n"
           "  nmm run slope.yaml                 compute; results in slope.vtkhdf\n"
           "  nmm plot slope.vtkhdf              draw the last frame into slope.png\n"
           "  nmm run --help                     options and examples of one command\n\n"
           "Exit status: 0 done; 1 the run ended early and said why, results up to there are\n"
           "saved; 2 wrong command line; 3 wrong scene or file; 4 file system or memory;\n"
           "5 the requested device is not there.\n");
}
