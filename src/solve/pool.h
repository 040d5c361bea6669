// SPDX-License-Identifier: MIT
//
// Places in one array for blocks of numbers that threads take and give back while they work. A
// block takes the lowest place that is free: what was given back a moment ago is used again while
// it is in a cache, and memory that is never needed at the same time is never touched. Blocks end
// no farther than at the sum of the sizes of all that were taken.

#ifndef NMM_POOL_H
#define NMM_POOL_H

#include "base.h"

#include <stdatomic.h>

typedef struct nmm_pool_block {
    long first, end;
} nmm_pool_block;

/// Zero before first use.
typedef struct nmm_pool {
    atomic_int busy;      // a thread is at the list
    nmm_pool_block *used; // [n_used] ascending
    int n_used, capacity;
} nmm_pool;

/// All is free; room for so many blocks at a time. NMM_ERROR_MEMORY.
nmm_status nmm_pool_reserve(nmm_context *context, nmm_pool *pool, int n_block);
void nmm_pool_release(nmm_context *context, nmm_pool *pool);

/// All is free. Not while threads are at work.
void nmm_pool_clear(nmm_pool *pool);

/// First of n numbers, n above 0.
long nmm_pool_take(nmm_pool *pool, long n);

/// The block that begins here.
void nmm_pool_give(nmm_pool *pool, long first);

#endif
