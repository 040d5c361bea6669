// SPDX-License-Identifier: MIT
//
// Values of one key by its line in the key table. Kinds OBJECT, LIST and NAMED are object.c's.

#ifndef NMM_SCENE_VALUE_H
#define NMM_SCENE_VALUE_H

#include "raw.h"

/// Read the value at `node` into *target (its type follows from key->kind). Complains where it is
/// wrong; then *good is false.
nmm_status nmm_value_read(nmm_reader *reader, const nmm_key *key, const nmm_node *node,
                          void *target, bool *good);

#endif
