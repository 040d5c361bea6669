// SPDX-License-Identifier: MIT
//
// The arena: chunks that grow, freed together. After a reset one chunk as large as all the old ones
// is left, so a loop that asks for the same memory in each round allocates nothing after the first.

#include "base.h"

#include <string.h>

struct nmm_arena_chunk {
    nmm_arena_chunk *older;
    size_t size; // bytes behind this head
};

// The head is padded, so that what lies behind it keeps the alignment of the block.
#define HEAD ((sizeof(nmm_arena_chunk) + 15) / 16 * 16)
#define FIRST_CHUNK ((size_t)16384)

static nmm_status add_chunk(nmm_context *context, nmm_arena *arena, size_t size) {
    nmm_arena_chunk *chunk = NULL;
    TRY(nmm_allocate(context, &chunk, HEAD + size, 1));
    chunk->older = arena->chunk;
    chunk->size = size;
    arena->chunk = chunk;
    arena->used = 0;
    return NMM_OK;
}

nmm_status nmm_arena_take(nmm_context *context, nmm_arena *arena, void *block, size_t count,
                          size_t size) {
    if (size > 0 && count > (SIZE_MAX / 4) / size) {
        return nmm_fail(context, NMM_ERROR_MEMORY, "out of memory: %zu items of %zu bytes", count,
                        size);
    }
    const size_t bytes = (count * size + 15) / 16 * 16;
    if (arena->chunk == NULL || bytes > arena->chunk->size - arena->used) {
        const size_t twice = arena->chunk != NULL ? 2 * arena->chunk->size : FIRST_CHUNK;
        TRY(add_chunk(context, arena, bytes > twice ? bytes : twice));
    }
    char *taken = (char *)arena->chunk + HEAD + arena->used;
    memset(taken, 0, bytes);
    arena->used += bytes;
    void *result = taken;
    memcpy(block, &result, sizeof result);
    return NMM_OK;
}

nmm_status nmm_arena_text(nmm_context *context, nmm_arena *arena, char **copy, const char *text,
                          size_t length) {
    TRY(nmm_arena_take(context, arena, copy, length + 1, 1));
    if (length > 0) memcpy(*copy, text, length);
    return NMM_OK;
}

void nmm_arena_reset(nmm_context *context, nmm_arena *arena) {
    if (arena->chunk == NULL) return;
    if (arena->chunk->older != NULL) {
        size_t total = 0;
        for (const nmm_arena_chunk *c = arena->chunk; c != NULL; c = c->older)
            total += c->size;
        nmm_arena_destroy(context, arena);
        // A failure here is no error: the next take asks again.
        const nmm_error kept = context->error;
        if (add_chunk(context, arena, total) != NMM_OK) context->error = kept;
    }
    arena->used = 0;
}

void nmm_arena_destroy(nmm_context *context, nmm_arena *arena) {
    while (arena->chunk != NULL) {
        nmm_arena_chunk *chunk = arena->chunk;
        arena->chunk = chunk->older;
        nmm_release(context, &chunk);
    }
    arena->used = 0;
}
