// SPDX-License-Identifier: MIT
//
// What the host knows newer than the device: marks on rows and clusters, set where numbers change
// and taken away when they are sent. Between the passes of a step few rows change, those of
// contacts that open, close or begin to slide.

#ifndef NMM_NEWER_H
#define NMM_NEWER_H

#include <stdbool.h>

/// Marks of a row: its blocks in float64 and in float32. Clusters have the first.
enum { NMM_NEWER_WIDE = 1, NMM_NEWER_NARROW = 2 };

/// Rows (clusters) between two marked ones that are sent with them, because a copy of their own
/// would take longer: about 10 microseconds, or 100 kB. An estimate: see docs/offload.md.
#define NMM_GAP_ROWS 256
#define NMM_GAP_CLUSTERS 64

/// Items begin .. end - 1.
typedef struct nmm_range {
    int begin, end;
} nmm_range;

/// The next marked items of n after `range`, {0} at first; their marks are taken away. Gaps of up
/// to `gap` items are included. False: no more, or `mark` is NULL.
bool nmm_newer_next(unsigned char *mark, int n, int bit, int gap, nmm_range *range);

struct nmm_solver;
struct nmm_bsr;

/// The values of K into the solver's own matrix, in its order; marks the rows that change.
void nmm_newer_take(struct nmm_solver *solver, const struct nmm_bsr *K);

#endif
