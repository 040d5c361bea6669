// SPDX-License-Identifier: MIT
//
// Errors, allocation through the hook, growable arrays, clock, hash, chunked sums.
// Every block carries its size in front, so that live bytes are known without a table.

#include "base.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

#define NMM_ALIGNMENT 64

// Bytes of a large page of memory, and of the blocks that ask for such pages.
#define LARGE_PAGE ((uintptr_t)1 << 21)
#define LARGE_BLOCK ((size_t)1 << 22)

void nmm_assert_failed(const char *condition, const char *file, int line) {
    fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, condition);
    abort();
}

nmm_status nmm_fail(nmm_context *context, nmm_status status, const char *format, ...) {
    NMM_ASSERT(status != NMM_OK);
    if (context->error.status != NMM_OK) return status;
    context->error.status = status;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(context->error.message, sizeof context->error.message, format, arguments);
    va_end(arguments);
    return status;
}

void nmm_context_clear(nmm_context *context) {
    memset(&context->error, 0, sizeof context->error);
}

// --- Memory

// In front of every block: what the hook gave, and the size asked for.
typedef struct block_head {
    void *raw;
    size_t size;
} block_head;

static block_head *head_of(void *block) {
    return (block_head *)(void *)((char *)block - sizeof(block_head));
}

// Large arrays in large pages: fewer faults when they are filled, and fewer looks for where a page
// is when they are read here and there. No more than a wish: where there are none nothing is lost.
static void wish_large_pages(void *raw, size_t size) {
#ifdef MADV_HUGEPAGE
    const uintptr_t mask = LARGE_PAGE - 1, start = (uintptr_t)raw;
    const uintptr_t begin = (start + mask) & ~mask, end = (start + size) & ~mask;
    if (raw != NULL && size >= LARGE_BLOCK && end > begin)
        (void)madvise((char *)raw + (begin - start), end - begin, MADV_HUGEPAGE);
#else
    (void)raw;
    (void)size;
#endif
}

// Bytes that are all 0, by the hook or by the library.
static char *take_zeros(nmm_context *context, size_t size) {
    if (context->allocate != NULL) {
        char *raw = context->allocate(context->user, NULL, size);
        if (raw != NULL) memset(raw, 0, size);
        return raw;
    }
    char *raw = calloc(size, 1);
    wish_large_pages(raw, size);
    return raw;
}

static void give_back(nmm_context *context, void *raw) {
    if (context->allocate != NULL)
        context->allocate(context->user, raw, 0);
    else
        free(raw);
}

nmm_status nmm_allocate(nmm_context *context, void *block, size_t count, size_t size) {
    void *none = NULL;
    memcpy(block, &none, sizeof none);
    if (count == 0 || size == 0) return NMM_OK;
    context->n_call += 1;
    const size_t extra = NMM_ALIGNMENT + sizeof(block_head);
    if (count > (SIZE_MAX - extra) / size) {
        return nmm_fail(context, NMM_ERROR_MEMORY, "out of memory: %zu items of %zu bytes", count,
                        size);
    }
    char *raw = take_zeros(context, count * size + extra);
    if (raw == NULL) {
        return nmm_fail(context, NMM_ERROR_MEMORY, "out of memory: %zu bytes", count * size);
    }
    // Align, leaving room for the head.
    const uintptr_t start = (uintptr_t)raw + sizeof(block_head);
    const size_t shift = (NMM_ALIGNMENT - start % NMM_ALIGNMENT) % NMM_ALIGNMENT;
    char *aligned = raw + sizeof(block_head) + shift;
    *head_of(aligned) = (block_head){.raw = raw, .size = count * size};
    context->n_live += 1;
    context->live_bytes += count * size;
    if (context->live_bytes > context->peak_bytes) context->peak_bytes = context->live_bytes;
    void *result = aligned;
    memcpy(block, &result, sizeof result);
    return NMM_OK;
}

nmm_status nmm_grow(nmm_context *context, void *array, int *capacity, int needed, size_t size) {
    if (needed <= *capacity) return NMM_OK;
    void *old = NULL;
    memcpy(&old, array, sizeof old);
    const int larger = *capacity < INT32_MAX / 2 ? *capacity + *capacity / 2 + 8 : INT32_MAX;
    const int count = nmm_max_int(needed, larger);
    void *grown = NULL;
    TRY(nmm_allocate(context, &grown, (size_t)count, size));
    if (old != NULL) memcpy(grown, old, (size_t)*capacity * size);
    nmm_release(context, &old);
    memcpy(array, &grown, sizeof grown);
    *capacity = count;
    return NMM_OK;
}

void nmm_release(nmm_context *context, void *block) {
    void *old = NULL;
    memcpy(&old, block, sizeof old);
    if (old == NULL) return;
    const block_head head = *head_of(old);
    context->n_live -= 1;
    context->live_bytes -= head.size;
    give_back(context, head.raw);
    old = NULL;
    memcpy(block, &old, sizeof old);
}

// --- Sums, clock, hash

// Sum over first .. end - 1, from left to right.
static double sum_in_order(const double *x, const double *y, long first, long end) {
    double sum = 0;
    for (long i = first; i < end; i++)
        sum += x[i] * y[i];
    return sum;
}

// Sums over chunks first .. first + n_chunk - 1, side by side, so that none waits for another.
#define CHUNKS 4
static void sum_chunks(int n, const double *x, const double *y, long first, double *part) {
    const long begin = first * NMM_CHUNK;
    double sum[CHUNKS] = {0};
    if (begin + CHUNKS * NMM_CHUNK <= n) {
        for (long i = begin; i < begin + NMM_CHUNK; i++)
            for (int k = 0; k < CHUNKS; k++)
                sum[k] += x[i + k * NMM_CHUNK] * y[i + k * NMM_CHUNK];
    } else {
        for (int k = 0; k < CHUNKS; k++) {
            const long from = begin + k * NMM_CHUNK, end = from + NMM_CHUNK;
            sum[k] = sum_in_order(x, y, from, end < n ? end : n);
        }
    }
    memcpy(part, sum, sizeof sum);
}

double nmm_sum_product(int n, const double *x, const double *y, int n_thread) {
    // Chunks are summed in groups that fit on the stack, so nothing is allocated.
    enum { GROUP = 64 };
    double total = 0;
    for (long group = 0; group * GROUP * NMM_CHUNK < n; group++) {
        double part[GROUP];
        const long first = group * GROUP, n_chunk = (n - 1) / NMM_CHUNK + 1 - first;
        const int n_part = n_chunk < GROUP ? (int)n_chunk : GROUP;
        if (n_thread > 1 && n_part > 8) {
#pragma omp parallel for num_threads(n_thread) schedule(static)
            for (int p = 0; p < n_part; p += CHUNKS)
                sum_chunks(n, x, y, first + p, part + p);
        } else {
            for (int p = 0; p < n_part; p += CHUNKS)
                sum_chunks(n, x, y, first + p, part + p);
        }
        for (int p = 0; p < n_part; p++)
            total += part[p];
    }
    return total;
}

double nmm_clock(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

uint64_t nmm_hash(uint64_t hash, const void *bytes, size_t size) {
    const unsigned char *byte = bytes;
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ byte[i]) * UINT64_C(1099511628211);
    return hash;
}
