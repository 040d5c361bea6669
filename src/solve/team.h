// SPDX-License-Identifier: MIT
//
// Threads of one OpenMP region that share loops, some of them all together and some each by itself,
// with the same text for one thread alone. Turns of a loop are taken one after the other as threads
// get to them, so that one that is kept from work by others holds up little. What a turn computes
// must not depend on who takes it.

#ifndef NMM_TEAM_H
#define NMM_TEAM_H

#include "barrier.h"

/// Numbers of a vector that several threads are worth.
#define NMM_MANY_NUMBERS 8000

/// A statement for each i of 0 .. n - 1, on threads where these are many. A region would cost a
/// quarter of a microsecond even on one thread, much of a small solve.
// clang-format off
#define NMM_SHARED_LOOP(n, n_thread, ...)                                                          \
    do {                                                                                           \
        const int n_turn = (n), n_hand = (n_thread);                                               \
        if (n_hand > 1 && n_turn > NMM_MANY_NUMBERS) {                                             \
            _Pragma("omp parallel for num_threads(n_hand) schedule(static)")                       \
            for (int i = 0; i < n_turn; i++) { __VA_ARGS__; }                                      \
        } else {                                                                                   \
            for (int i = 0; i < n_turn; i++) { __VA_ARGS__; }                                      \
        }                                                                                          \
    } while (0)
// clang-format on

/// Zero before each region.
typedef struct nmm_team {
    nmm_barrier barrier;
    _Alignas(64) atomic_int ticket;
    _Alignas(64) atomic_int least; // what threads found, see nmm_team_report
} nmm_team;

/// A thread's place in its team. n = 1: alone, without a team.
typedef struct nmm_hand {
    nmm_team *team;
    int n;
    int base; // tickets of the loops before
} nmm_hand;

/// A shared loop: for (int k = nmm_hand_take(h); k < n; k = nmm_hand_take(h)) ...; then
/// nmm_hand_join(h, n), which returns when all turns of all threads are done.
static inline int nmm_hand_take(nmm_hand *hand) {
    if (hand->n == 1) return hand->base++;
    return atomic_fetch_add_explicit(&hand->team->ticket, 1, memory_order_relaxed) - hand->base;
}

/// Returns when all threads of the team have called it.
static inline void nmm_hand_wait(const nmm_hand *hand) {
    if (hand->n > 1) nmm_barrier_wait(&hand->team->barrier);
}

static inline void nmm_hand_join(nmm_hand *hand, int n) {
    if (hand->n == 1) {
        hand->base = 0;
        return;
    }
    // Each thread has taken one ticket too many.
    hand->base += n + hand->n;
    nmm_hand_wait(hand);
}

#endif
