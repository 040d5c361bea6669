// SPDX-License-Identifier: MIT
//
// Does every map, update and attached pointer of the target backend matter, and do kernels keep to
// device memory?
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

// Number of the first transfer of jacobi_team.c.
#define TEAM_BASE 1000

// Seconds of processor time for a run with all transfers, and how many times what that took on one
// thread the others get: without some transfers the host waits for ever.
#define WHOLE_LIMIT 300
#define TIMES_WHOLE 2

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

#define MAX_ARRAY 40

// A solver that has used every array; their addresses.
static int open_and_close(const void *array[MAX_ARRAY]) {
    nmm_context context = {.n_thread = 1};
    const nmm_solve_backend *target = nmm_solve_target();
    nmm_solver *solver = NULL;
    int row_start[] = {0, 1}, col[] = {0}, diagonal[] = {0};
    double value[] = {4, 1, 1, 3}, f[] = {1, 2}, u[] = {0, 0};
    const nmm_bsr K = {1, row_start, col, value, diagonal};
    nmm_solve_options options = nmm_default_solve_options();
    options.blocks = NMM_BLOCKS_CLUSTER;
    options.precision = NMM_PRECISION_MIXED;
    nmm_solve_report report;
    if (target->open(&context, &solver, 700, 9000) != NMM_OK) return 0;
    if (target->solve(&context, solver, &K, f, u, false, &options, &report) != NMM_OK) return 0;
    const nmm_solver s = *solver;
    const nmm_wide w = s.wide;
    const nmm_narrow v = s.narrow;
    const void *const all[] = {solver,        s.own_row_start,
                               s.own_col,     s.own_value,
                               w.inverse,     w.f,
                               w.u,           w.r,
                               w.p,           w.q,
                               w.z,           v.inverse,
                               v.f,           v.u,
                               v.r,           v.p,
                               v.q,           v.z,
                               v.value,       s.part,
                               s.dense_scale, s.dense_room,
                               s.chunk,       s.state};
    const int n = (int)(sizeof all / sizeof *all);
    memcpy(array, all, sizeof all);
    target->close(&context, &solver);
    return n;
}

// Arrays that are still known on the device after close; -1: not all were there before.
static int count_left_behind(void) {
    const void *array[MAX_ARRAY] = {0};
    const int n = open_and_close(array);
    int count = 0;
    for (int k = 0; k < n; k++) {
        if (array[k] == NULL) return -1;
        count += omp_target_is_present(array[k], omp_get_default_device()) != 0;
    }
    return n > 0 ? count : -1;
}

// Both ways, first the one whose transfer is left out.
static int run_once(bool loud) {
    nmm_context context = {.n_thread = 1, .allocate = guarding_hook};
    const int left = count_left_behind();
    if (loud) printf("%d arrays left behind\n", left);
    int differing = left != 0;
    for (int k = 0; k < 2 && (loud || differing == 0); k++) {
        const bool launches = (nmm_transfer_left_out < TEAM_BASE) == (k == 0);
        const agreement how = {.launches = launches, .stop_early = !loud};
        const int n = test_agreement(&context, &how);
        if (loud) printf("%s: %d cases differ\n", launches ? "launches" : "one team", n);
        differing += n;
    }
    return differing == 0 && context.n_live == 0 && n_block == 0 ? 0 : 1;
}

// --- All runs

// Exit status of this program with an argument; 256 or more: a signal.
static int status_of(const char *program, const char *argument, bool quiet, rlim_t seconds) {
    fflush(stdout);
    const pid_t child = fork();
    if (child < 0) return -1;
    if (child == 0) {
        const struct rlimit no_core = {0, 0};
        setrlimit(RLIMIT_CORE, &no_core);
        if (quiet && freopen("/dev/null", "w", stderr) == NULL) _exit(0);
        if (quiet && freopen("/dev/null", "w", stdout) == NULL) _exit(0);
        // On one thread, which is enough to see what is missing, where many runs go one by one.
        if (quiet) setenv("OMP_NUM_THREADS", "1", 1);
        const struct rlimit time_limit = {seconds, seconds + 1};
        setrlimit(RLIMIT_CPU, &time_limit);
        execl(program, program, argument, (char *)NULL);
        _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 256 + WTERMSIG(status);
}

typedef struct tally {
    int all, noticed;
} tally;

// Seconds of processor time that runs without a transfer get, after one with all of them.
static rlim_t limit_of_others(void) {
    struct rusage all_runs;
    getrusage(RUSAGE_CHILDREN, &all_runs);
    return TIMES_WHOLE * (rlim_t)(all_runs.ru_utime.tv_sec + all_runs.ru_stime.tv_sec + 2);
}

static tally leave_out(const char *program, const char *file, int base, int n, rlim_t seconds) {
    tally result = {.all = n};
    int hanging = 0;
    for (int k = base; k < base + n; k++) {
        char argument[16];
        snprintf(argument, sizeof argument, "%d", k);
        const int status = status_of(program, argument, true, seconds);
        result.noticed += status != 0;
        hanging += status == 256 + SIGXCPU;
        if (status == 0) printf("transfer %d left out: MISSED\n", k);
    }
    printf("%s: %d of %d noticed, %d of them by the time limit\n", file, result.noticed, n,
           hanging);
    return result;
}

static int run_all(const char *program) {
    if (status_of(program, "-1", true, WHOLE_LIMIT) == NO_DEVICE) {
        printf("skipped: no device\n");
        return NO_DEVICE;
    }
    const rlim_t seconds = limit_of_others();
    if (status_of(program, "-1", false, WHOLE_LIMIT) != 0) {
        printf("the run with all transfers fails\n");
        return 1;
    }
    const int guard = status_of(program, "guard", true, seconds);
    printf("a touched host array is %s (status %d)\n", guard != 0 ? "noticed" : "MISSED", guard);
    const tally launches = leave_out(program, "jacobi_target.c", 0, nmm_transfer_count(), seconds);
    const tally team =
        leave_out(program, "jacobi_team.c", TEAM_BASE, nmm_transfer_count_team(), seconds);
    const int n = launches.all + team.all, noticed = launches.noticed + team.noticed;
    printf("transfers left out one by one: %d of %d noticed\n", noticed, n);
    return noticed == n && launches.all > 0 && team.all > 0 && guard != 0 ? 0 : 1;
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
