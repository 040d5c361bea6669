// SPDX-License-Identifier: MIT
//
// The table of an experiment as text, as JSON, and as files.

#ifndef NMM_CLI_BENCH_TABLE_H
#define NMM_CLI_BENCH_TABLE_H

#include "json.h"

#include "nmm/study.h"

#include <stdbool.h>

/// Title, table and notes on standard output.
void bench_table_print(const nmm_bench *bench);

/// The same as members of an object: columns, rows, notes.
void bench_table_json(json *out, const nmm_bench *bench);

/// Listen to Ctrl-C while measuring. `made`: the folder that was made for what comes, NULL where it
/// was there before.
void bench_table_listen(const char *made);

/// FOLDER/NAME.csv, .svg and .png; where `told`, standard output says so. Returns the exit status.
int bench_table_write(nmm_bench *bench, const char *folder, const char *name, bool told);

#endif
