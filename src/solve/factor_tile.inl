// SPDX-License-Identifier: MIT
//
// The kernel of a factor: a tile of 4 columns and up to two registers of rows, from which columns
// to its left are taken off. The includer defines TAKE_OFF, its name, TILE_SLOT, what a register
// holds, and TILE_LANE, how many numbers that is. Each number is one sum in the order of the
// columns.

// In rows from `row` of the tile on: at -= left * up^T; divided by the triangle at `corner` unless
// that is NULL, whose diagonal holds inverses. `n`: rows, in lanes.
static inline __attribute__((always_inline)) void TAKE_OFF(const tile *t, int n,
                                                           const double *corner, int row) {
    TILE_SLOT sum[4][2];
    double *at = t->at + row;
    UNROLL
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < n; i++)
            sum[j][i] = *(TILE_SLOT *)(at + j * t->stride + TILE_LANE * i);
    const double *left = t->left + row, *up = t->up;
    for (int k = 0; k < t->depth; k++) {
        TILE_SLOT l[2];
        for (int i = 0; i < n; i++)
            l[i] = *(const TILE_SLOT *)(left + TILE_LANE * i);
        UNROLL
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < n; i++)
                sum[j][i] -= l[i] * up[j];
        left += t->left_stride;
        up += t->left_stride;
    }
    if (corner != NULL) {
        UNROLL
        for (int j = 0; j < 4; j++) {
            for (int i = 0; i < n; i++) {
                for (int k = 0; k < j; k++)
                    sum[j][i] -= sum[k][i] * corner[k * t->stride + j];
                sum[j][i] *= corner[j * t->stride + j];
            }
        }
    }
    UNROLL
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < n; i++)
            *(TILE_SLOT *)(at + j * t->stride + TILE_LANE * i) = sum[j][i];
}

#undef TAKE_OFF
#undef TILE_SLOT
#undef TILE_LANE
