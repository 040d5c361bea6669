// SPDX-License-Identifier: MIT
//
// Scales of charts: ranges from the data, round ticks on linear axes, and on logarithmic ones
// powers of ten or, over a short range, 1, 2 and 5 times them.

#include "chart_draw.h"

#include <math.h>

double nmm_chart_part(nmm_chart_scale scale, double value) {
    const double at = scale.log ? (value > 0 ? log10(value) : NAN) : value;
    return (at - scale.low) / (scale.high - scale.low);
}

// --- Ranges

static void widen(nmm_chart_scale *scale, double value) {
    const double at = scale->log ? (value > 0 ? log10(value) : NAN) : value;
    if (!isfinite(at)) return;
    scale->low = nmm_min(scale->low, at);
    scale->high = nmm_max(scale->high, at);
}

// A margin, so that no mark stands on the frame; a linear axis begins at 0 where the data are near.
static nmm_chart_scale finish(nmm_chart_scale scale, const nmm_chart_axis *axis) {
    if (axis->low != axis->high) {
        const bool log = axis->log && axis->low > 0;
        return (nmm_chart_scale){axis->log, log ? log10(axis->low) : axis->low,
                                 log ? log10(axis->high) : axis->high};
    }
    if (!(scale.low <= scale.high)) return (nmm_chart_scale){scale.log, 0, 1};
    const bool from_zero = !scale.log && scale.low >= 0 && scale.low < 0.5 * scale.high;
    if (from_zero) scale.low = 0;
    double span = scale.high - scale.low;
    if (!(span > 0)) span = scale.log ? 1 : nmm_max(1e-300, fabs(scale.high));
    if (!from_zero) scale.low -= 0.04 * span;
    scale.high += 0.04 * span;
    return scale;
}

static nmm_chart_scale empty(const nmm_chart_axis *axis) {
    return (nmm_chart_scale){axis->log, INFINITY, -INFINITY};
}

// Longest bar, its parts behind each other.
static nmm_chart_scale scale_of_bars(const nmm_chart_panel *panel) {
    const nmm_chart_bars *bars = panel->bars;
    nmm_chart_scale scale = empty(&panel->x);
    widen(&scale, scale.log ? 1 : 0);
    for (int k = 0; k < bars->n_category * bars->n_bar; k++) {
        double sum = 0;
        for (int part = 0; part < bars->n_part; part++) {
            const double value = bars->value[(long)k * bars->n_part + part];
            if (isfinite(value)) sum += value;
        }
        widen(&scale, sum);
    }
    for (int i = 0; i < panel->n_level; i++)
        widen(&scale, panel->level[i].y);
    // The numbers behind the bars need room.
    if (bars->n_part == 1 && scale.high > scale.low) scale.high += 0.12 * (scale.high - scale.low);
    return finish(scale, &panel->x);
}

nmm_chart_scale nmm_chart_scale_x(const nmm_chart_panel *panel) {
    if (panel->bars != NULL) return scale_of_bars(panel);
    nmm_chart_scale scale = empty(&panel->x);
    for (int k = 0; k < panel->n_series; k++) {
        const nmm_chart_series *s = &panel->series[k];
        for (int i = 0; i < s->n && s->style != NMM_CHART_SLOPE; i++)
            widen(&scale, s->x[i]);
    }
    return finish(scale, &panel->x);
}

nmm_chart_scale nmm_chart_scale_y(const nmm_chart_panel *panel) {
    nmm_chart_scale scale = empty(&panel->y);
    for (int k = 0; k < panel->n_series; k++) {
        const nmm_chart_series *s = &panel->series[k];
        for (int i = 0; i < s->n && s->style != NMM_CHART_SLOPE; i++)
            widen(&scale, s->y[i]);
    }
    for (int i = 0; i < panel->n_level; i++)
        widen(&scale, panel->level[i].y);
    return finish(scale, &panel->y);
}

// --- Ticks

// "1000" or, with `raised`, 10 with its exponent above the line.
static void write_power(char text[32], int exponent, bool raised) {
    static const char *const digit[] = {
        "\xe2\x81\xb0", "\xc2\xb9",     "\xc2\xb2",     "\xc2\xb3",     "\xe2\x81\xb4",
        "\xe2\x81\xb5", "\xe2\x81\xb6", "\xe2\x81\xb7", "\xe2\x81\xb8", "\xe2\x81\xb9"};
    if (!raised) {
        nmm_tick_text(text, pow(10, exponent), exponent < 0 ? pow(10, exponent) : 1);
        return;
    }
    const int size = exponent < 0 ? -exponent : exponent;
    const char *minus = exponent < 0 ? "\xe2\x81\xbb" : "";
    if (size < 0 || size >= 100)
        snprintf(text, 32, "1e%d", exponent);
    else if (size >= 10)
        snprintf(text, 32, "10%s%s%s", minus, digit[size / 10], digit[size % 10]);
    else
        snprintf(text, 32, "10%s%s", minus, digit[size]);
}

// Over less than two powers of ten: 1, 2 and 5 times each.
static int short_log_ticks(nmm_chart_scale scale, nmm_chart_tick *tick) {
    int n = 0;
    for (int power = (int)floor(scale.low); power <= scale.high && n + 9 <= NMM_MOST_TICK;
         power++) {
        for (int digit = 1; digit < 10; digit++) {
            const double value = digit * pow(10, power);
            if (log10(value) < scale.low - 1e-9 || log10(value) > scale.high + 1e-9) continue;
            tick[n].value = value;
            tick[n].text[0] = 0;
            const double step = power < 0 ? pow(10, power) : 1;
            if (digit == 1 || digit == 2 || digit == 5) nmm_tick_text(tick[n].text, value, step);
            n += 1;
        }
    }
    return n;
}

static int log_ticks(nmm_chart_scale scale, int at_most, nmm_chart_tick *tick) {
    if (scale.high - scale.low < 2) return short_log_ticks(scale, tick);
    const int first = (int)ceil(scale.low - 1e-9), last = (int)floor(scale.high + 1e-9);
    const int skip = (last - first) / nmm_max_int(1, at_most) + 1;
    const bool raised = first < -3 || last > 3;
    int n = 0;
    for (int power = first - 1; power <= last && n + 9 <= NMM_MOST_TICK; power++) {
        // Small ticks between, where they have room.
        for (int digit = 1; digit < (skip == 1 ? 10 : 2); digit++) {
            const double at = power + log10(digit);
            if (at < scale.low - 1e-9 || at > scale.high + 1e-9) continue;
            tick[n].value = digit * pow(10, power);
            tick[n].text[0] = 0;
            if (digit == 1 && (power - first) % skip == 0) write_power(tick[n].text, power, raised);
            n += 1;
        }
    }
    return n;
}

int nmm_chart_ticks(nmm_chart_scale scale, int at_most, nmm_chart_tick tick[NMM_MOST_TICK]) {
    if (scale.log) return log_ticks(scale, at_most, tick);
    const nmm_ticks ticks = nmm_ticks_of(scale.low, scale.high, at_most);
    const int n = nmm_min_int(ticks.n, NMM_MOST_TICK);
    for (int i = 0; i < n; i++) {
        tick[i].value = ticks.first + i * ticks.step;
        nmm_tick_text(tick[i].text, tick[i].value, ticks.step);
    }
    return n;
}
