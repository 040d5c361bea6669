// SPDX-License-Identifier: MIT
//
// What every floor needs: status and error, the allocation hook, the arena, growable arrays, a
// clock, a seeded random generator, deterministic sums. Nothing here knows of blocks or covers.
//
// Every fallible function takes the `nmm_context` first, returns `nmm_status` and is called through
// TRY. The context carries the allocation hook, the number of threads and the first error.

#ifndef NMM_BASE_H
#define NMM_BASE_H

#include "nmm/nmm.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// --- Checks

#ifdef NMM_DEBUG
#define NMM_ASSERT(condition)                                                                      \
    ((condition) ? (void)0 : nmm_assert_failed(#condition, __FILE__, __LINE__))
#else
#define NMM_ASSERT(condition) ((void)0)
#endif

#ifdef NMM_VALIDATE_ON
#define NMM_VALIDATE(condition) NMM_ASSERT(condition)
#else
#define NMM_VALIDATE(condition) ((void)0)
#endif

/// Stop a debug build: a bug of ours, never wrong input.
void nmm_assert_failed(const char *condition, const char *file, int line);

// --- Context: hook, threads, error

/// realloc-like hook: `size` 0 frees `old`; returns NULL when it cannot serve.
typedef void *(*nmm_allocate_hook)(void *user, void *old, size_t size);

typedef struct nmm_context {
    nmm_allocate_hook allocate; // NULL: the C library
    void *user;                 // given to the hook
    int n_thread;               // threads of a parallel loop, at least 1
    long n_call;                // allocations asked for so far
    long n_live;                // blocks not yet released
    size_t live_bytes;          // bytes in live blocks
    size_t peak_bytes;          // largest `live_bytes` so far
    nmm_error error;            // the first error; status NMM_OK when there is none
} nmm_context;

/// Record the first error of the context (printf format) and return `status`.
nmm_status nmm_fail(nmm_context *context, nmm_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/// Forget the error, so that the context can be used on.
void nmm_context_clear(nmm_context *context);

#define TRY(call)                                                                                  \
    do {                                                                                           \
        const nmm_status try_status = (call);                                                      \
        if (try_status != NMM_OK) return try_status;                                               \
    } while (0)

// --- Memory

/// `count * size` zeroed bytes, 64-byte aligned, into *block (a pointer to a pointer). Count 0
/// gives NULL. Serial code only. NMM_ERROR_MEMORY with the size in the message.
nmm_status nmm_allocate(nmm_context *context, void *block, size_t count, size_t size);

/// Let *array (a pointer to a pointer) hold at least `needed` items of `size` bytes; grows by half
/// again, keeps the content, new bytes are zero, updates *capacity.
nmm_status nmm_grow(nmm_context *context, void *array, int *capacity, int needed, size_t size);

/// Release what the two above gave; *block becomes NULL. NULL is accepted.
void nmm_release(nmm_context *context, void *block);

/// A bump allocator: many small things, freed together.
typedef struct nmm_arena_chunk nmm_arena_chunk;
typedef struct nmm_arena {
    nmm_arena_chunk *chunk; // newest first
    size_t used;            // bytes used in the newest chunk
} nmm_arena;

/// `count * size` zeroed bytes, 16-byte aligned, alive until the arena is reset or destroyed.
nmm_status nmm_arena_take(nmm_context *context, nmm_arena *arena, void *block, size_t count,
                          size_t size);
/// A copy of `length` bytes of `text`, ended by a zero byte.
nmm_status nmm_arena_text(nmm_context *context, nmm_arena *arena, char **copy, const char *text,
                          size_t length);
/// Forget all; the memory is kept as one chunk, so a steady loop stops allocating.
void nmm_arena_reset(nmm_context *context, nmm_arena *arena);
void nmm_arena_destroy(nmm_context *context, nmm_arena *arena);

// --- Sums, clock, random numbers

/// Sums that decide anything run over chunks of this many items, then over the chunks in order, so
/// that the number of threads does not change a bit.
#define NMM_CHUNK 1024

/// Sum of x[i] * y[i], i < n, by chunks; same bits for any `n_thread`.
double nmm_sum_product(int n, const double *x, const double *y, int n_thread);

/// Seconds on a clock that never goes back.
double nmm_clock(void);

/// xoshiro256** (Blackman and Vigna 2018): the same numbers on every machine.
typedef struct nmm_random {
    uint64_t state[4];
} nmm_random;
nmm_random nmm_random_seed(uint64_t seed);
uint64_t nmm_random_next(nmm_random *random);
/// Uniform in [0, 1).
double nmm_random_unit(nmm_random *random);

/// 64-bit FNV-1a hash of `size` bytes, continuing from `hash` (start with NMM_HASH_START).
#define NMM_HASH_START UINT64_C(14695981039346656037)
uint64_t nmm_hash(uint64_t hash, const void *bytes, size_t size);

static inline double nmm_min(double a, double b) {
    return a < b ? a : b;
}
static inline double nmm_max(double a, double b) {
    return a > b ? a : b;
}
static inline int nmm_min_int(int a, int b) {
    return a < b ? a : b;
}
static inline int nmm_max_int(int a, int b) {
    return a > b ? a : b;
}

#endif
