// SPDX-License-Identifier: MIT
//
// xoshiro256** by Blackman and Vigna (2018), seeded by splitmix64: 64-bit integers only, so the
// numbers are the same on every machine.

#include "base.h"

static uint64_t rotate(uint64_t x, int k) {
    return (x << k) | (x >> (64 - k));
}

nmm_random nmm_random_seed(uint64_t seed) {
    nmm_random random;
    for (int i = 0; i < 4; i++) {
        seed += UINT64_C(0x9e3779b97f4a7c15);
        uint64_t z = seed;
        z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
        z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
        random.state[i] = z ^ (z >> 31);
    }
    return random;
}

uint64_t nmm_random_next(nmm_random *random) {
    uint64_t *s = random->state;
    const uint64_t result = rotate(s[1] * 5, 7) * 9;
    const uint64_t t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotate(s[3], 45);
    return result;
}

double nmm_random_unit(nmm_random *random) {
    return (double)(nmm_random_next(random) >> 11) * 0x1p-53;
}
