// SPDX-License-Identifier: MIT
//
// "Did you mean": the nearest name by edit distance (insertions, deletions, changes and swaps of
// neighbours each cost 1; Damerau 1964 in its restricted form).

#include "options.h"

#include <string.h>

enum { LONGEST = 32 };

static int smaller(int a, int b) {
    return a < b ? a : b;
}

/// Edit distance of two words; words longer than LONGEST are far from everything.
static int edit_distance(const char *a, const char *b) {
    const int n = (int)strnlen(a, LONGEST + 1), m = (int)strnlen(b, LONGEST + 1);
    int cost[LONGEST + 1][LONGEST + 1];
    if (n > LONGEST || m > LONGEST) return LONGEST;
    for (int i = 0; i <= n; i++)
        for (int j = 0; j <= m; j++) {
            if (i == 0 || j == 0) {
                cost[i][j] = i + j;
                continue;
            }
            const int changed = cost[i - 1][j - 1] + (a[i - 1] != b[j - 1]);
            cost[i][j] = smaller(changed, 1 + smaller(cost[i - 1][j], cost[i][j - 1]));
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                cost[i][j] = smaller(cost[i][j], 1 + cost[i - 2][j - 2]);
        }
    return cost[n][m];
}

const char *nearest_name(const char *word, const char *const *names) {
    const char *best = NULL;
    int least = 3; // more than two slips is another word
    for (int k = 0; names[k]; k++) {
        const int distance = edit_distance(word, names[k]);
        // Short words: at least half of the letters must be right.
        if (distance < least && 2 * distance <= (int)strlen(names[k])) {
            least = distance;
            best = names[k];
        }
    }
    return best;
}
