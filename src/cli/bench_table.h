// SPDX-License-Identifier: MIT
//
// The table of an experiment as text and as JSON.

#ifndef NMM_CLI_BENCH_TABLE_H
#define NMM_CLI_BENCH_TABLE_H

#include "json.h"

#include "nmm/study.h"

/// Title, table and notes on standard output.
void bench_table_print(const nmm_bench *bench);

/// The same as members of an object: columns, rows, notes.
void bench_table_json(json *out, const nmm_bench *bench);

#endif
