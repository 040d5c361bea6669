// SPDX-License-Identifier: MIT
//
// Included by offload/target.h where NMM_TRANSFER_TEST is defined: the words with which a test
// leaves out one transfer, and takes the host's arrays away while kernels run.

#ifndef NMM_TRANSFER_TEST_H
#define NMM_TRANSFER_TEST_H

/// The transfer that is left out; -1: none. Set before the first use.
extern int nmm_transfer_left_out;

/// Transfers in the text of the backend: those of offload/jacobi_target.c, numbered from 0, and of
/// offload/jacobi_team.c, numbered from 1000.
int nmm_transfer_count(void);
int nmm_transfer_count_team(void);

/// Take the large host arrays away (1, returns 1) or give them back (0, returns 0).
int nmm_guard(int on);

#define TRANSFER_LEFT_OUT nmm_transfer_left_out
#define GUARDED for (int guarded = nmm_guard(1); guarded; guarded = nmm_guard(0))

#endif
