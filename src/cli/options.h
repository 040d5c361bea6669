// SPDX-License-Identifier: MIT
//
// The command line as data: one table of options, one table of commands; parsing, help texts and
// suggestions all follow from the two.

#ifndef NMM_CLI_OPTIONS_H
#define NMM_CLI_OPTIONS_H

#include "nmm/nmm.h"

#include <stdbool.h>

/// Exit status of the program, as docs and --help say.
enum {
    EXIT_DONE = 0,
    EXIT_EARLY = 1,  ///< the run ended early and said why; results up to there are saved
    EXIT_USAGE = 2,  ///< wrong command line
    EXIT_SCENE = 3,  ///< wrong scene or file content
    EXIT_SYSTEM = 4, ///< file system or memory
    EXIT_DEVICE = 5, ///< the requested device is not there
};

typedef enum option_id {
    OPTION_OUTPUT,
    OPTION_SET,
    OPTION_DEVICE,
    OPTION_THREADS,
    OPTION_STEPS,
    OPTION_ALLOW,
    OPTION_DUMP,
    OPTION_RHS,
    OPTION_GUESS,
    OPTION_PLACES,
    OPTION_METHOD,
    OPTION_BLOCKS,
    OPTION_PRECISION,
    OPTION_TOLERANCE,
    OPTION_ABSOLUTE,
    OPTION_STOP,
    OPTION_DAMPING,
    OPTION_FACTOR,
    OPTION_MAX_ITERATIONS,
    OPTION_REPEAT,
    OPTION_FRAME,
    OPTION_FIELD,
    OPTION_SCALE,
    OPTION_WIDTH,
    OPTION_VTU,
    OPTION_FOLDER,
    OPTION_THREAD_LIST,
    OPTION_SCENES,
    OPTION_KNOBS,
    OPTION_QUANTITY,
    OPTION_EXPECT,
    OPTION_WANT,
    OPTION_LONGEST,
    OPTION_QUICK,
    OPTION_JSON,
    OPTION_QUIET,
    OPTION_HELP,
    OPTION_VERSION,
    N_OPTION
} option_id;

/// A set of options is one bit for each.
#define BIT(option) (UINT64_C(1) << (option))

/// What the user asked for. `set` is the caller's memory, room for one entry per argument.
typedef struct arguments {
    const char *path;   // the one file a command works on
    const char *output; // NULL: chosen
    int n_set;
    const char **set;
    nmm_device_choice device;
    int comparable; // not an option: compare sets it
    int n_thread;   // 0: all
    int frame;      // -1: last
    const char *field;
    double scale;
    int width;
    const char *vtu;
    const char *scenes; // folder; NULL: found
    int n_thread_list;  // 0: chosen
    int thread_list[16];
    const char *knobs, *quantity, *expect; // of `trade`; NULL: chosen
    double want, longest;                  // 0: none, chosen
    int n_step;                            // 0: chosen
    double allow;                          // 0: chosen
    long dump_step;                        // 0: no system is to be written
    int dump_iteration;                    // from 1
    const char *dump;                      // prefix of its files
    nmm_linear_def linear; // of `solve`; path, device, threads and output stand above
    bool json, quiet, quick, help, version;
} arguments;

typedef struct command {
    const char *name;
    const char *operand;                // name of the file in the usage line
    const char *purpose;                // one line
    const char *detail;                 // more, whole lines
    const char *examples;               // whole lines
    uint64_t options;                   // bit set of option_id
    int (*run)(const arguments *given); // returns the exit status
} command;

/// The commands, ended by an entry without name.
extern const command command_table[];

int command_run(const arguments *given);
int command_check(const arguments *given);
int command_info(const arguments *given);
int command_plot(const arguments *given);
int command_export(const arguments *given);
int command_compare(const arguments *given);
int command_solve(const arguments *given);
int command_bench(const arguments *given);
int command_trade(const arguments *given);

/// The command of that name, or NULL.
const command *command_find(const char *name);

/// Read the words behind the command's name. False: wrong, and a message was printed.
bool options_parse(const command *which, int n_word, char **word, arguments *given);

/// Help on standard output: of the program, or of one command.
void help_program(void);
void help_command(const command *which);

/// The entry of `names` (ended by NULL) nearest to `word`, NULL where none is near.
const char *nearest_name(const char *word, const char *const *names);

#endif
