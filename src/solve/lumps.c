// SPDX-License-Identifier: MIT
//
// What sweeps by lumps need: whether the matrix has lumps, the order of the waves, the places of
// blocks and of the terms of a coupling, and vectors, scaled. A lump is in the wave after the last
// one of those before it in the matrix with which it has a block; in waves lumps keep their order.
// Either sweep in this order, or back, finds each lump as the matrix' own order does.

#include "lumps.h"

#include <math.h>
#include <string.h>

// --- Memory

void nmm_lumps_destroy(nmm_context *context, nmm_lumps *lumps) {
    void *owned[] = {
        &lumps->order,   &lumps->place,  &lumps->before_start, &lumps->behind_start,
        &lumps->before,  &lumps->behind, &lumps->before_value, &lumps->behind_value,
        &lumps->inverse, &lumps->scale,  &lumps->own,          &lumps->changed,
        &lumps->half,    &lumps->first,  &lumps->next,         &lumps->cross,
    };
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        nmm_release(context, owned[i]);
    *lumps = (nmm_lumps){0};
}

static nmm_status reserve(nmm_context *context, nmm_lumps *lumps, int n, int n_side) {
    int room[9];
    for (int i = 0; i < 9; i++)
        room[i] = lumps->capacity;
    // What does not fit any more holds nothing that will be needed.
    TRY(nmm_grow(context, &lumps->order, &room[0], n + 1, sizeof(int)));
    TRY(nmm_grow(context, &lumps->place, &room[1], n + 1, 2 * sizeof(int)));
    TRY(nmm_grow(context, &lumps->before_start, &room[2], n + 1, sizeof(int)));
    TRY(nmm_grow(context, &lumps->behind_start, &room[3], n + 1, sizeof(int)));
    TRY(nmm_grow(context, &lumps->inverse, &room[4], n + 1, 48 * sizeof(float)));
    TRY(nmm_grow(context, &lumps->scale, &room[5], n + 1, 8 * sizeof(double)));
    TRY(nmm_grow(context, &lumps->own, &room[6], n + 1, 48 * sizeof(double)));
    TRY(nmm_grow(context, &lumps->changed, &room[7], n + 1, sizeof(nmm_lump_change)));
    TRY(nmm_grow(context, &lumps->first, &room[8], n + 1, sizeof(int)));
    lumps->capacity = room[8];
    int side[4];
    for (int i = 0; i < 4; i++)
        side[i] = lumps->block_capacity;
    TRY(nmm_grow(context, &lumps->before, &side[0], n_side, sizeof(int)));
    TRY(nmm_grow(context, &lumps->behind, &side[1], n_side, sizeof(int)));
    TRY(nmm_grow(context, &lumps->before_value, &side[2], n_side, 48 * sizeof(float)));
    TRY(nmm_grow(context, &lumps->behind_value, &side[3], n_side, 48 * sizeof(float)));
    lumps->block_capacity = side[3];
    return NMM_OK;
}

// --- The pattern

static bool same_columns(const nmm_bsr *K, int a, int b) {
    const int n = K->row_start[a + 1] - K->row_start[a];
    const int *col = K->col;
    if (n != K->row_start[b + 1] - K->row_start[b]) return false;
    return memcmp(col + K->row_start[a], col + K->row_start[b], (size_t)n * sizeof *col) == 0;
}

// By the symmetry of the pattern columns come in threes then, too.
static bool has_threes(const nmm_bsr *K, const int *body) {
    if (body == NULL || K->n_row % 3 != 0) return false;
    for (int row = 0; row < K->n_row; row++) {
        const int i = row % 3, first = K->diagonal[row] - i;
        if (body[row] < 0 || body[row] != body[row - i]) return false;
        if (first < K->row_start[row] || first + 3 > K->row_start[row + 1]) return false;
        if (K->col[first] != row - i || K->col[first + 2] != row - i + 2) return false;
        if (!same_columns(K, row, row - i)) return false;
    }
    return true;
}

// Waves by lump of the matrix into `wave`; how many there are.
static int find_waves(const nmm_bsr *K, int *wave) {
    int most = 0;
    for (int lump = 0; lump < K->n_row / 3; lump++) {
        wave[lump] = 0;
        for (int k = K->row_start[3 * lump]; k < K->diagonal[3 * lump]; k += 3)
            wave[lump] = nmm_max_int(wave[lump], wave[K->col[k] / 3] + 1);
        most = nmm_max_int(most, wave[lump]);
    }
    return most + 1;
}

// Sorts lumps by waves, by counting; `start` is scratch.
static void sort_waves(nmm_lumps *lumps, const int *wave, int n_wave, int *start) {
    memset(start, 0, ((size_t)n_wave + 1) * sizeof *start);
    for (int lump = 0; lump < lumps->n; lump++)
        start[wave[lump] + 1] += 1;
    for (int k = 0; k < n_wave; k++)
        start[k + 1] += start[k];
    for (int lump = 0; lump < lumps->n; lump++) {
        lumps->place[lump] = start[wave[lump]]++;
        lumps->order[lumps->place[lump]] = lump;
    }
}

static void list_blocks(nmm_lumps *lumps, const nmm_bsr *K) {
    int n_before = 0, n_behind = 0;
    for (int i = 0; i < lumps->n; i++) {
        const int row = 3 * lumps->order[i];
        lumps->before_start[i] = n_before;
        for (int k = K->row_start[row]; k < K->diagonal[row]; k += 3)
            lumps->before[n_before++] = lumps->place[K->col[k] / 3];
    }
    lumps->before_start[lumps->n] = n_before;
    for (int i = lumps->n - 1; i >= 0; i--) {
        const int row = 3 * lumps->order[i];
        lumps->behind_start[i + 1] = n_behind;
        for (int k = K->diagonal[row] + 3; k < K->row_start[row + 1]; k += 3)
            lumps->behind[n_behind++] = lumps->place[K->col[k] / 3];
    }
    lumps->behind_start[0] = n_behind;
}

static void forget_terms(nmm_lumps *lumps) {
    lumps->n_term = 0;
    for (int i = 0; i < lumps->n; i++)
        lumps->first[i] = -1;
}

nmm_status nmm_lumps_find(nmm_context *context, nmm_lumps *lumps, const nmm_bsr *K,
                          const int *body) {
    lumps->known = has_threes(K, body);
    if (!lumps->known) return NMM_OK;
    const int n = K->n_row / 3;
    lumps->known = false;
    TRY(reserve(context, lumps, n, (K->row_start[K->n_row] / 9 - n) / 2 + 1));
    lumps->n = n;
    int *wave = lumps->place + n;
    const int n_wave = find_waves(K, wave);
    sort_waves(lumps, wave, n_wave, lumps->before_start);
    list_blocks(lumps, K);
    // Inverses are of other lumps.
    memset(lumps->scale, 0, (size_t)n * 8 * sizeof(double));
    forget_terms(lumps);
    lumps->known = true;
    return NMM_OK;
}

// --- Terms and vectors

// Half of a term: three rows, which have to be those of a lump unless all is zero.
static bool take_half(nmm_lumps *lumps, const nmm_coupling *coupling, int half) {
    const int *row = coupling->row + 3 * (long)half;
    const double *push = coupling->push + 6 * (long)half, *pull = coupling->pull + 6 * (long)half;
    bool any = false;
    for (int j = 0; j < 6; j++)
        any = any || push[j] != 0 || pull[j] != 0;
    lumps->half[half] = -1;
    if (!any) return true;
    if (row[0] % 3 != 0 || row[1] != row[0] + 1 || row[2] != row[0] + 2) return false;
    const int i = lumps->place[row[0] / 3];
    lumps->half[half] = i;
    lumps->next[half] = lumps->first[i];
    lumps->first[i] = half;
    return true;
}

// Place of the block of lumps i and j; -1: none.
static int place_of_block(const nmm_lumps *lumps, int i, int j) {
    const int *list = j < i ? lumps->before : lumps->behind;
    const int begin = j < i ? lumps->before_start[i] : lumps->behind_start[i + 1];
    const int end = j < i ? lumps->before_start[i + 1] : lumps->behind_start[i];
    for (int k = begin; k < end; k++)
        if (list[k] == j) return k;
    return -1;
}

// Both halves of a term, and where its blocks off the diagonal are.
static bool take_term(nmm_lumps *lumps, const nmm_coupling *coupling, int term) {
    const int a = 2 * term, b = a + 1;
    if (!take_half(lumps, coupling, b) || !take_half(lumps, coupling, a)) return false;
    const int i = lumps->half[a], j = lumps->half[b];
    if (i < 0 || j < 0) return true;
    lumps->cross[a] = place_of_block(lumps, i, j);
    lumps->cross[b] = place_of_block(lumps, j, i);
    return lumps->cross[a] >= 0;
}

nmm_status nmm_lumps_couple(nmm_context *context, nmm_lumps *lumps, const nmm_coupling *coupling,
                            bool *fit) {
    int room[3] = {lumps->term_capacity, lumps->term_capacity, lumps->term_capacity};
    forget_terms(lumps);
    *fit = coupling->n == 0 || coupling->n_row == 6;
    if (!*fit) return NMM_OK;
    TRY(nmm_grow(context, &lumps->half, &room[0], coupling->n, 2 * sizeof(int)));
    TRY(nmm_grow(context, &lumps->next, &room[1], coupling->n, 2 * sizeof(int)));
    TRY(nmm_grow(context, &lumps->cross, &room[2], coupling->n, 2 * sizeof(int)));
    lumps->term_capacity = room[2];
    lumps->n_term = coupling->n;
    // From the last one on, so that those of a lump are in order.
    for (int k = coupling->n - 1; *fit && k >= 0; k--)
        *fit = take_term(lumps, coupling, k);
    return NMM_OK;
}

const nmm_lumps_kernels *nmm_lumps_fastest(void) {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f")) return &nmm_lumps_avx512;
    if (__builtin_cpu_supports("avx2")) return &nmm_lumps_avx2;
#endif
    return &nmm_lumps_plain;
}
