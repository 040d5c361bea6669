// SPDX-License-Identifier: MIT
//
// Colour scales, each a short list of colours at equal distances with straight lines between.
// viridis (S. van der Walt and N. Smith, CC0) rises evenly in lightness, so it survives grey
// printing and colour blindness; blue - white - red shows the sign.

#include "view.h"

static const unsigned viridis[] = {0x440154, 0x482475, 0x414487, 0x355f8d, 0x2a788e, 0x21918c,
                                   0x22a884, 0x44bf70, 0x7ad151, 0xbddf26, 0xfde725};
static const unsigned diverging[] = {0x14316b, 0x2c6fb0, 0x6aaed6, 0xb9d9eb, 0xf7f7f5,
                                     0xf6c9b0, 0xe58368, 0xc43b40, 0x7a0c26};
static const unsigned blocks[] = {0xa9c9e8, 0xf4d6a0, 0xb8dcb0, 0xe7b9c2,
                                  0xcfc3e6, 0xd9d0b4, 0xa8ddd6, 0xf0c3a2};

static nmm_colour unpack(unsigned colour) {
    return (nmm_colour){(colour >> 16 & 255) / 255.0, (colour >> 8 & 255) / 255.0,
                        (colour & 255) / 255.0};
}

static nmm_colour between(const unsigned *colour, int n, double t) {
    const double place = nmm_min(1, nmm_max(0, t)) * (n - 1);
    const int k = nmm_min_int((int)place, n - 2);
    const double s = place - k;
    const nmm_colour a = unpack(colour[k]), b = unpack(colour[k + 1]);
    return (nmm_colour){a.r + s * (b.r - a.r), a.g + s * (b.g - a.g), a.b + s * (b.b - a.b)};
}

// A little white, so that dark outlines show on the dark end too.
static nmm_colour lighten(nmm_colour c) {
    const double part = 0.22;
    return (nmm_colour){c.r + part * (1 - c.r), c.g + part * (1 - c.g), c.b + part * (1 - c.b)};
}

nmm_colour nmm_colour_at(nmm_colours colours, double t) {
    switch (colours) {
    case NMM_COLOURS_RISING:
        return lighten(between(viridis, sizeof viridis / sizeof *viridis, t));
    case NMM_COLOURS_DIVERGING:
        return between(diverging, sizeof diverging / sizeof *diverging, t);
    case NMM_COLOURS_BLOCKS:
        return unpack(blocks[(int)nmm_max(0, t) % (int)(sizeof blocks / sizeof *blocks)]);
    }
    return (nmm_colour){0};
}
