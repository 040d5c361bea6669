// SPDX-License-Identifier: MIT
//
// Ticks at round numbers and their texts.

#include "view.h"

#include <locale.h>
#include <math.h>
#include <string.h>

nmm_ticks nmm_ticks_of(double low, double high, int at_most) {
    nmm_ticks ticks = {low, 1, 0};
    const double span = high - low;
    if (!(span > 0) || !isfinite(span) || at_most < 1) return ticks;
    const double power = pow(10, floor(log10(span / at_most)));
    static const double round[] = {1, 2, 5, 10, 20};
    for (int i = 0; i < 5; i++) {
        ticks.step = round[i] * power;
        ticks.first = ceil(low / ticks.step - 1e-9) * ticks.step;
        ticks.n = (int)floor((high - ticks.first) / ticks.step + 1e-9) + 1;
        if (ticks.n <= at_most) break;
    }
    return ticks;
}

const char *nmm_tick_text(char text[32], double value, double step) {
    // What rounding left of a zero.
    if (fabs(value) < 1e-9 * step) value = 0;
    const int decimals = (int)nmm_max(0, ceil(-log10(step) - 1e-9));
    if (decimals <= 5 && fabs(value) < 1e9)
        snprintf(text, 32, "%.*f", decimals, value);
    else
        snprintf(text, 32, "%.3g", value);
    // The host program may have chosen a locale with a comma.
    const char *mark = localeconv()->decimal_point;
    char *comma = strcmp(mark, ".") != 0 && strlen(mark) == 1 ? strchr(text, mark[0]) : NULL;
    if (comma != NULL) *comma = '.';
    // A true minus sign.
    if (text[0] == '-' && strlen(text) < 29) {
        memmove(text + 3, text + 1, strlen(text));
        memcpy(text, "\xe2\x88\x92", 3);
    }
    return text;
}
