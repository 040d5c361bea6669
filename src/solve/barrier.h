// SPDX-License-Identifier: MIT
//
// A barrier for the threads of one OpenMP region: threads wait for each other some hundred thousand
// times a second here. It spins for about ten microseconds and then yields the processor, so that
// it is quick on idle cores and does no harm on busy ones, where spinning threads keep from work
// those that they wait for.

#ifndef NMM_BARRIER_H
#define NMM_BARRIER_H

#include <omp.h>
#include <sched.h>
#include <stdatomic.h>

/// Zero before first use. On cache lines of their own.
typedef struct nmm_barrier {
    _Alignas(64) atomic_int n_waiting;
    _Alignas(64) atomic_int round;
} nmm_barrier;

/// A thread has looked for something in vain, for the spin-th time.
static inline void nmm_barrier_pause(int spin) {
    if (spin < 400) {
#if defined(__x86_64__)
        __builtin_ia32_pause();
#endif
    } else {
        sched_yield();
    }
}

/// Returns when all threads of the region have called it. What they wrote before is known to all
/// after.
static inline void nmm_barrier_wait(nmm_barrier *barrier) {
    const int round = atomic_load_explicit(&barrier->round, memory_order_acquire);
    const int last = omp_get_num_threads() - 1;
    if (atomic_fetch_add_explicit(&barrier->n_waiting, 1, memory_order_acq_rel) == last) {
        atomic_store_explicit(&barrier->n_waiting, 0, memory_order_relaxed);
        atomic_store_explicit(&barrier->round, round + 1, memory_order_release);
        return;
    }
    for (int spin = 0; atomic_load_explicit(&barrier->round, memory_order_acquire) == round; spin++)
        nmm_barrier_pause(spin);
}

#endif
