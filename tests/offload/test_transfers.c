// SPDX-License-Identifier: MIT
//
// Does every map and update of the target backend matter, and do kernels keep to device memory?
// The program calls itself once for each transfer with that one left out: each such run must fail,
// by a wrong bit or a crash. While kernels run the host's copies of the device arrays are taken
// away (PROT_NONE), so a kernel that reads one of them dies; a run that touches one on purpose
// shows that the guard is there.
//
//   test_transfers            all of it
//   test_transfers K          one run without transfer K; -1: none
//   test_transfers guard      one run that touches a guarded array

#define _GNU_SOURCE

#include "agreement.h"
#include "solver.h"
#include "transfer_test.h"

#include <omp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

int nmm_transfer_left_out = -1;

// --- Guarded memory

// Exit status where nothing could be tested.
#define NO_DEVICE 77

// Seconds for one run: without some transfers the host waits for ever.
#define TIME_LIMIT 4

// Blocks from this size on are guarded; the solver object and its scalars are smaller.
#define GUARDED_FROM 3000
#define PAGE ((size_t)4096)
#define MAX_GUARDED 64

typedef struct guarded_block {
    char *start;
    size_t size;
} guarded_block;

static guarded_block block[MAX_GUARDED];
static int n_block;
static bool touch;

int nmm_guard(int on) {
    for (int k = 0; k < n_block; k++)
        mprotect(block[k].start, block[k].size, on ? PROT_NONE : PROT_READ | PROT_WRITE);
    if (on && touch && n_block > 0) block[0].start[PAGE] = 1;
    return on;
}

static void *take_guarded(size_t size) {
    if (n_block == MAX_GUARDED) return NULL;
    const size_t whole = (size / PAGE + 1) * PAGE;
    char *start = mmap(NULL, whole, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (start == MAP_FAILED) return NULL;
    block[n_block++] = (guarded_block){start, whole};
    return start;
}

static void *guarding_hook(void *user, void *old, size_t size) {
    (void)user;
    if (size >= GUARDED_FROM) return take_guarded(size);
    if (size > 0) return malloc(size);
    for (int k = 0; k < n_block; k++) {
        if (block[k].start != old) continue;
        munmap(block[k].start, block[k].size);
        block[k] = block[--n_block];
        return NULL;
    }
    free(old);
    return NULL;
}

// --- One run

// Arrays that are still known on the device after close.
static int count_left_behind(void) {
    nmm_context context = {.n_thread = 1};
    nmm_solver *solver = NULL;
    if (nmm_solve_target()->open(&context, &solver, 700, 9000) != NMM_OK) return -1;
    const nmm_solver copy = *solver;
    const void *const array[] = {copy.row_start, copy.col,     copy.value, copy.inverse,
                                 copy.f,         copy.u,       copy.r,     copy.p,
                                 copy.q,         copy.product, copy.part,  copy.state};
    int count = 0;
    nmm_solve_target()->close(&context, &solver);
    for (size_t k = 0; k < sizeof array / sizeof *array; k++)
        count += omp_target_is_present(array[k], omp_get_default_device()) != 0;
    return count;
}

static int run_once(bool loud) {
    nmm_context context = {.n_thread = 1, .allocate = guarding_hook};
    const int differing = test_agreement(&context, loud);
    const int left = count_left_behind();
    if (loud) printf("%d cases differ, %d arrays left behind\n", differing, left);
    return differing == 0 && left == 0 && context.n_live == 0 && n_block == 0 ? 0 : 1;
}

// --- All runs

// Exit status of this program with an argument; 256 or more: a signal.
static int status_of(const char *program, const char *argument, bool quiet) {
    fflush(stdout);
    const pid_t child = fork();
    if (child < 0) return -1;
    if (child == 0) {
        const struct rlimit no_core = {0, 0};
        setrlimit(RLIMIT_CORE, &no_core);
        if (quiet && freopen("/dev/null", "w", stderr) == NULL) _exit(0);
        if (quiet && freopen("/dev/null", "w", stdout) == NULL) _exit(0);
        alarm(TIME_LIMIT);
        execl(program, program, argument, (char *)NULL);
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 256 + WTERMSIG(status);
}

static int run_all(const char *program) {
    if (status_of(program, "-1", true) == NO_DEVICE) {
        printf("skipped: no device\n");
        return NO_DEVICE;
    }
    if (status_of(program, "-1", false) != 0) {
        printf("the run with all transfers fails\n");
        return 1;
    }
    const int guard = status_of(program, "guard", true);
    printf("a touched host array is %s (status %d)\n", guard != 0 ? "noticed" : "MISSED", guard);
    const int n = nmm_transfer_count();
    int noticed = 0, hanging = 0;
    for (int k = 0; k < n; k++) {
        char argument[16];
        snprintf(argument, sizeof argument, "%d", k);
        const int status = status_of(program, argument, true);
        noticed += status != 0;
        hanging += status == 256 + SIGALRM;
        if (status == 0) printf("transfer %d left out: MISSED\n", k);
    }
    printf("transfers left out one by one: %d of %d noticed, %d of them by the time limit\n",
           noticed, n, hanging);
    return noticed == n && n > 0 && guard != 0 ? 0 : 1;
}

int main(int argc, char **argv) {
    if (argc < 2) return run_all("/proc/self/exe");
    if (nmm_solve_target_devices() == 0) {
        printf("no device\n");
        return NO_DEVICE;
    }
    touch = strcmp(argv[1], "guard") == 0;
    if (!touch) nmm_transfer_left_out = (int)strtol(argv[1], NULL, 10);
    return run_once(nmm_transfer_left_out < 0);
}
