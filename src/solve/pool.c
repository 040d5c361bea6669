// SPDX-License-Identifier: MIT
//
// The list of blocks in use is short and ascending: the first gap that is large enough is found by
// walking along it, under a lock of a few dozen nanoseconds.

#include "pool.h"

#include "barrier.h"

#include <string.h>

nmm_status nmm_pool_reserve(nmm_context *context, nmm_pool *pool, int n_block) {
    nmm_pool_clear(pool);
    return nmm_grow(context, &pool->used, &pool->capacity, n_block, sizeof *pool->used);
}

void nmm_pool_release(nmm_context *context, nmm_pool *pool) {
    nmm_release(context, &pool->used);
    pool->n_used = pool->capacity = 0;
}

void nmm_pool_clear(nmm_pool *pool) {
    pool->n_used = 0;
}

static void enter(nmm_pool *pool) {
    for (int spin = 0; atomic_exchange_explicit(&pool->busy, 1, memory_order_acquire); spin++)
        nmm_barrier_pause(spin);
}

static void leave(nmm_pool *pool) {
    atomic_store_explicit(&pool->busy, 0, memory_order_release);
}

long nmm_pool_take(nmm_pool *pool, long n) {
    enter(pool);
    NMM_ASSERT(n > 0 && pool->n_used < pool->capacity);
    long first = 0;
    int k = 0;
    for (; k < pool->n_used && pool->used[k].first - first < n; k++)
        first = pool->used[k].end;
    nmm_pool_block *block = pool->used + k;
    memmove(block + 1, block, (size_t)(pool->n_used++ - k) * sizeof *block);
    *block = (nmm_pool_block){first, first + n};
    leave(pool);
    return first;
}

void nmm_pool_give(nmm_pool *pool, long first) {
    enter(pool);
    int k = 0;
    while (k < pool->n_used && pool->used[k].first != first)
        k++;
    NMM_ASSERT(k < pool->n_used);
    nmm_pool_block *block = pool->used + k;
    memmove(block, block + 1, (size_t)(--pool->n_used - k) * sizeof *block);
    leave(pool);
}
