// SPDX-License-Identifier: MIT
//
// `key.path=value` from the command line into the tree, before it is read.

#ifndef NMM_SCENE_OVERRIDE_H
#define NMM_SCENE_OVERRIDE_H

#include "tree.h"

/// Put override `source` (from 1) of the scene into the tree at `root`.
nmm_status nmm_override_apply(nmm_reader *reader, nmm_node *root, int source);

#endif
