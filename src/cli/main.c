// SPDX-License-Identifier: MIT
//
// nmm, the command line: finds the command, reads its words, runs it.
//
// Results go to standard output, messages to standard error; the exit status tells what failed.
// Only the headers of include/nmm are used, so whatever this program does, any other program can
// do.

#include "message.h"
#include "options.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const command command_table[] = {
    {"run", "SCENE", "Compute a scene and write its run file",
     "The run file is SCENE with the ending .vtkhdf, in the current folder, unless -o says\n"
     "otherwise; SCENE - is standard input. ParaView opens it. Ctrl-C ends the run after the "
     "current step with a whole file;\n"
     "a second Ctrl-C ends it at once. --device target never falls back to the host.\n",
     "  nmm run slope.yaml\n"
     "  nmm run slope.yaml -o steep.vtkhdf --set gravity=[1,-9.81] --set time.end=2\n"
     "  nmm run slope.yaml --json --quiet > slope.json\n"
     "  nmm run slope.yaml --dump-system 20:1 slope20\n",
     BIT(OPTION_OUTPUT) | BIT(OPTION_SET) | BIT(OPTION_DEVICE) | BIT(OPTION_THREADS) |
         BIT(OPTION_DUMP) | BIT(OPTION_JSON) | BIT(OPTION_QUIET),
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
    {"compare", "SCENE", "Compute the same steps on host and target and compare",
     "Are the answers equal, how long did each phase take, from which size on does the target "
     "pay?\n"
     "Exit status 1 where the answers differ by more than --allow, both runs ended early or a\n"
     "solve failed, 5 where there is no target; a build with the preset fake-device has one that\n"
     "needs no GPU (docs/offload.md).\n",
     "  nmm compare slope.yaml\n"
     "  nmm compare slope.yaml --steps 10 --set solver.method=jacobi --json\n",
     BIT(OPTION_SET) | BIT(OPTION_THREADS) | BIT(OPTION_STEPS) | BIT(OPTION_ALLOW) |
         BIT(OPTION_JSON),
     command_compare},
    {"solve", "SYSTEM", "Solve one linear system with any method",
     "Files are Matrix Market: coordinate real, symmetric or general, for the matrix, array real "
     "for\n"
     "vectors. nmm run --dump-system writes such systems. Without --rhs the solution is all ones.\n"
     "Exit status 1 where the solve does not converge, with the reason.\n",
     "  nmm solve slope20.mtx --rhs slope20_rhs.mtx --places slope20_places.mtx\n"
     "  nmm solve slope20.mtx --method jacobi --stop average_change\n"
     "  nmm solve slope20.mtx --method pcg --blocks cluster --repeat 9 --threads 1 --json\n",
     BIT(OPTION_OUTPUT) | BIT(OPTION_DEVICE) | BIT(OPTION_THREADS) | BIT(OPTION_RHS) |
         BIT(OPTION_GUESS) | BIT(OPTION_PLACES) | BIT(OPTION_METHOD) | BIT(OPTION_BLOCKS) |
         BIT(OPTION_PRECISION) | BIT(OPTION_TOLERANCE) | BIT(OPTION_ABSOLUTE) | BIT(OPTION_STOP) |
         BIT(OPTION_DAMPING) | BIT(OPTION_FACTOR) | BIT(OPTION_MAX_ITERATIONS) |
         BIT(OPTION_REPEAT) | BIT(OPTION_JSON) | BIT(OPTION_QUIET),
     command_solve},
    {"bench", "NAME", "Measure what the documentation tells, as tables and pictures",
     "NAME is one of\n"
     "  table1   shares of contact, assembly and solver; whole steps against SOR\n"
     "  fig6     error against iteration of each method at one step of a tunnel (without\n"
     "           that scene in the folder: of its largest)\n"
     "  fig7     speed-up of a solve against order, by threads and device\n"
     "  contact  contact search against the number of blocks, up to 10^6 edges\n"
     "  wall     a brick wall, one cover a block, beside a public DDA program\n"
     "  growth   time by phase and memory from 10^3 to 10^6 unknowns\n"
     "  only     what features cost that a scene can do without\n"
     "  all      each of them\n"
     "Each prints its table and writes NAME.csv, NAME.svg and NAME.png. Ctrl-C ends after the\n"
     "measurement under way and writes what is there. Times are worth what else the machine "
     "does.\n",
     "  nmm bench table1\n"
     "  nmm bench fig7 --threads 1,2,4 -o results\n"
     "  nmm bench all --quick\n",
     BIT(OPTION_FOLDER) | BIT(OPTION_SCENES) | BIT(OPTION_DEVICE) | BIT(OPTION_THREAD_LIST) |
         BIT(OPTION_QUICK) | BIT(OPTION_JSON) | BIT(OPTION_QUIET),
     command_bench},
    {"trade", "SCENE", "Measure speed against accuracy of a scene and name the best settings",
     "Runs the scene with one knob turned at a time: cover size, dt, both together, order, mesh,\n"
     "time scheme, tolerances, precision, penalty. Errors are those of one quantity at the end,\n"
     "against --expect, or else against what the finest runs converge to. Prints a table and "
     "writes\n"
     "SCENE.csv, SCENE.svg and SCENE.png. With --want the cheapest setting that is so near is "
     "named,\n"
     "as options of nmm run and as lines of the scene; exit status 1 where there is none.\n",
     "  nmm trade slope.yaml\n"
     "  nmm trade slope.yaml --want 1% --knobs size,dt\n"
     "  nmm trade incline.yaml --expect 'monitors.slider.displacement[0]=3.625629'\n",
     BIT(OPTION_FOLDER) | BIT(OPTION_SET) | BIT(OPTION_DEVICE) | BIT(OPTION_THREADS) |
         BIT(OPTION_KNOBS) | BIT(OPTION_QUANTITY) | BIT(OPTION_EXPECT) | BIT(OPTION_WANT) |
         BIT(OPTION_LONGEST) | BIT(OPTION_QUICK) | BIT(OPTION_JSON) | BIT(OPTION_QUIET),
     command_trade},
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
    arguments given = {.frame = -1, .device = NMM_DEVICE_SCENE, .linear = nmm_default_linear_def()};
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
