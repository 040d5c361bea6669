// SPDX-License-Identifier: MIT
//
// nmm, the command line: finds the command, reads its words, runs it.
//
// Results go to standard output, messages to standard error; the exit status tells what failed.
// Only include/nmm/nmm.h is used, so whatever this program does, any other program can do.

#include "message.h"
#include "options.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BIT(option) (1u << (option))

const command command_table[] = {
    {"run", "SCENE", "Compute a scene and write its run file",
     "The run file is SCENE with the ending .vtkhdf, in the current folder, unless -o says\n"
     "otherwise. ParaView opens it. Ctrl-C ends the run after the current step with a whole file;\n"
     "a second Ctrl-C ends it at once. --device target never falls back to the host.\n",
     "  nmm run slope.yaml\n"
     "  nmm run slope.yaml -o steep.vtkhdf --set gravity=[1,-9.81] --set time.end=2\n"
     "  nmm run slope.yaml --json --quiet > slope.json\n",
     BIT(OPTION_OUTPUT) | BIT(OPTION_SET) | BIT(OPTION_DEVICE) | BIT(OPTION_THREADS) |
         BIT(OPTION_JSON) | BIT(OPTION_QUIET),
     command_run},
    {"check", "SCENE", "Say what a scene comes to, without computing it",
     "Counts, every default chosen and why, memory, and warnings. Nothing is written.\n",
     "  nmm check slope.yaml\n"
     "  nmm check slope.yaml --set covers.size=0.5\n",
     BIT(OPTION_SET) | BIT(OPTION_DEVICE) | BIT(OPTION_THREADS) | BIT(OPTION_JSON) |
         BIT(OPTION_QUIET),
     command_check},
    {"info", "RUN", "Say what happened in a run",
     "Steps, time by phase, why it ended, energy, worst penetration, monitors.\n",
     "  nmm info slope.vtkhdf\n"
     "  nmm info slope.vtkhdf --json\n",
     BIT(OPTION_JSON), command_info},
    {"plot", "RUN", "Draw one frame of a run",
     "The ending of the output says which kind: png, svg or pdf. Without -o it is RUN.png in the\n"
     "current folder.\n",
     "  nmm plot slope.vtkhdf\n"
     "  nmm plot slope.vtkhdf -o early.svg --frame 10 --field displacement --scale 50\n",
     BIT(OPTION_OUTPUT) | BIT(OPTION_FRAME) | BIT(OPTION_FIELD) | BIT(OPTION_SCALE) |
         BIT(OPTION_WIDTH) | BIT(OPTION_QUIET),
     command_plot},
    {"export", "RUN", "Write a run for other programs",
     "For viewers that do not read temporal VTKHDF, such as ParaView before 5.12.\n",
     "  nmm export slope.vtkhdf --vtu slope-vtu\n", BIT(OPTION_VTU) | BIT(OPTION_QUIET),
     command_export},
    {NULL, NULL, NULL, NULL, NULL, 0, NULL}};

const command *command_find(const char *name) {
    for (const command *c = command_table; c->name; c++)
        if (!strcmp(c->name, name)) return c;
    return NULL;
}

static int complain_command(const char *word) {
    const char *names[sizeof command_table / sizeof *command_table + 1] = {NULL};
    int n = 0;
    for (const command *c = command_table; c->name; c++)
        names[n++] = c->name;
    names[n++] = "help";
    const char *near = nearest_name(word, names);
    if (near)
        message_error("unknown command %s; did you mean nmm %s?", word, near);
    else
        message_error("unknown command %s; nmm --help lists the commands", word);
    return EXIT_USAGE;
}

static int run_command(const command *which, int n_word, char **word) {
    arguments given = {.frame = -1, .device = NMM_DEVICE_SCENE};
    given.set = calloc((size_t)n_word + 1, sizeof *given.set);
    if (!given.set) {
        message_error("no memory");
        return EXIT_SYSTEM;
    }
    int status = EXIT_USAGE;
    const bool right = options_parse(which, n_word, word, &given);
    if (given.help) {
        help_command(which);
        status = EXIT_DONE;
    } else if (right && given.version) {
        printf("%s\n", nmm_version());
        status = EXIT_DONE;
    } else if (right) {
        status = which->run(&given);
    }
    free(given.set);
    return status;
}

static int answer_help(int n_word, char **word) {
    const command *which = n_word > 0 ? command_find(word[0]) : NULL;
    if (n_word > 0 && !which) return complain_command(word[0]);
    if (which)
        help_command(which);
    else
        help_program();
    return EXIT_DONE;
}

static int answer(int n_word, char **word) {
    if (n_word == 0) {
        message_error("which command? nmm --help lists them");
        return EXIT_USAGE;
    }
    if (!strcmp(word[0], "-h") || !strcmp(word[0], "--help") || !strcmp(word[0], "help"))
        return answer_help(n_word - 1, word + 1);
    if (!strcmp(word[0], "--version")) {
        printf("%s\n", nmm_version());
        return EXIT_DONE;
    }
    const command *which = command_find(word[0]);
    return which ? run_command(which, n_word - 1, word + 1) : complain_command(word[0]);
}

int main(int n_argument, char **argument) {
    // A full quota shows as a failed write, with its message, not as a killed program.
    signal(SIGXFSZ, SIG_IGN);
    const int status = answer(n_argument - 1, argument + 1);
    // A result that could not be written is not a result.
    if (fflush(stdout) != 0 || ferror(stdout)) {
        message_error("standard output could not be written");
        return EXIT_SYSTEM;
    }
    // HDF5 1.10 crashes on its way out when a file could not be closed for want of space.
    if (status == EXIT_SYSTEM) _Exit(status);
    return status;
}
