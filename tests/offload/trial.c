// SPDX-License-Identifier: MIT
//
// Exit status 0 where a target region runs on something that is not the host: asked at configure
// time, because OpenMP itself falls back to the host without a word.

#include <omp.h>

int main(void) {
    int elsewhere = 0;
#pragma omp target map(from : elsewhere)
    elsewhere = !omp_is_initial_device();
    return elsewhere ? 0 : 1;
}
