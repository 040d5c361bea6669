// SPDX-License-Identifier: MIT
//
// The field that colours the elements: its values, its unit and the range of the colours.
//
// Few elements with extreme values (at the tip of a joint, at a point load) must not take the
// colours from all others: when the range of 99 % of the area is less than two thirds of the whole
// range, the colours cover that, and the colour bar ends in points.

#include "view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef enum quantity {
    MEAN_STRESS,
    STRESS_XX,
    STRESS_YY,
    STRESS_XY,
    DISPLACEMENT,
    VELOCITY,
    BLOCK
} quantity;

static const struct {
    const char *name, *title, *file_field;
    const char *unit; // "Pa", "m", "m/s"
} field_table[] = {
    [MEAN_STRESS] = {"stress", "mean stress (xx + yy) / 2", "stress", "Pa"},
    [STRESS_XX] = {"sxx", "stress xx", "stress", "Pa"},
    [STRESS_YY] = {"syy", "stress yy", "stress", "Pa"},
    [STRESS_XY] = {"sxy", "shear stress xy", "stress", "Pa"},
    [DISPLACEMENT] = {"displacement", "displacement", "displacement", "m"},
    [VELOCITY] = {"velocity", "velocity", "velocity", "m/s"},
    [BLOCK] = {"block", "blocks", NULL, ""},
};
enum { N_FIELD = sizeof field_table / sizeof field_table[0] };

// --- Choice

static double largest_length(int n, const double *vector) {
    double most = 0;
    for (long i = 0; i < n; i++)
        most = nmm_max(most, vector[2 * i] * vector[2 * i] + vector[2 * i + 1] * vector[2 * i + 1]);
    return sqrt(most);
}

// Blocks that move far are shown by their displacement, others by their stress.
static const char *choose(nmm_file *file, const nmm_file_frame *frame, const nmm_file_geometry *g) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (long p = 0; p < g->n_point; p++) {
        for (int k = 0; k < 2; k++) {
            low[k] = nmm_min(low[k], g->point[2 * p + k]);
            high[k] = nmm_max(high[k], g->point[2 * p + k]);
        }
    }
    const double side = nmm_max(high[0] - low[0], high[1] - low[1]);
    const bool moved = frame->displacement != NULL &&
                       largest_length(g->n_point, frame->displacement) > 0.01 * side;
    if (moved) return "displacement";
    if (nmm_file_has(file, "stress")) return "stress";
    if (nmm_file_has(file, "displacement")) return "displacement";
    return nmm_file_has(file, "velocity") ? "velocity" : "block";
}

nmm_status nmm_shade_name(nmm_file *file, const nmm_file_frame *frame,
                          const nmm_file_geometry *geometry, const char *asked, const char **name) {
    *name = asked != NULL ? asked : choose(file, frame, geometry);
    for (int i = 0; i < N_FIELD; i++) {
        if (strcmp(field_table[i].name, *name) != 0) continue;
        const char *needed = field_table[i].file_field;
        if (needed == NULL || nmm_file_has(file, needed)) return NMM_OK;
        return nmm_fail(nmm_file_context(file), NMM_ERROR_INPUT,
                        "%s holds no %s: the scene's output.fields does not ask for it",
                        nmm_file_path(file), needed);
    }
    return nmm_fail(nmm_file_context(file), NMM_ERROR_ARGUMENT,
                    "unknown field '%s': known are stress, sxx, syy, sxy, displacement, velocity, "
                    "block",
                    *name);
}

// --- Values

static const double *vector_of(const nmm_file_frame *frame, quantity kind) {
    if (kind == DISPLACEMENT) return frame->displacement;
    return kind == VELOCITY ? frame->velocity : NULL;
}

// Mean of a vector's length over the corners of element e.
static double mean_length(const nmm_file_geometry *g, int e, const double *vector) {
    const int begin = g->element_start[e], end = g->element_start[e + 1];
    double sum = 0;
    for (int k = begin; k < end; k++) {
        const double *v = vector + 2 * (long)g->corner_point[k];
        sum += sqrt(v[0] * v[0] + v[1] * v[1]);
    }
    return end > begin ? sum / (end - begin) : 0;
}

static double value_of(const nmm_file_frame *frame, const nmm_file_geometry *g, quantity kind,
                       int e) {
    static const double none[6];
    const double *s = frame->stress != NULL ? frame->stress + 6 * (long)e : none;
    switch (kind) {
    case MEAN_STRESS:
        return (s[0] + s[1]) / 2;
    case STRESS_XX:
        return s[0];
    case STRESS_YY:
        return s[1];
    case STRESS_XY:
        return s[3];
    case DISPLACEMENT:
    case VELOCITY:
        return mean_length(g, e, vector_of(frame, kind));
    case BLOCK:
        return g->element_block[e];
    }
    return 0;
}

static double area_of(const nmm_file_geometry *g, int e) {
    const int begin = g->element_start[e], end = g->element_start[e + 1];
    double sum = 0;
    for (int k = begin + 1; k + 1 < end; k++) {
        const double *a = g->point + 2 * (long)g->corner_point[begin];
        const double *b = g->point + 2 * (long)g->corner_point[k];
        const double *c = g->point + 2 * (long)g->corner_point[k + 1];
        sum += (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    }
    return fabs(sum) / 2;
}

// --- Range

typedef struct weighed {
    double value, area;
} weighed;

static int compare_values(const void *a, const void *b) {
    const double x = ((const weighed *)a)->value, y = ((const weighed *)b)->value;
    return (x > y) - (x < y);
}

// Value below which `part` of the area lies; `item` is sorted.
static double quantile(int n, const weighed *item, double total, double part) {
    double sum = 0;
    for (int i = 0; i < n; i++) {
        sum += item[i].area;
        if (sum >= part * total) return item[i].value;
    }
    return n > 0 ? item[n - 1].value : 0;
}

static void set_range(nmm_shade *shade, int n, weighed *item) {
    double total = 0;
    for (int i = 0; i < n; i++)
        total += item[i].area;
    qsort(item, (size_t)n, sizeof *item, compare_values);
    const double least = n > 0 ? item[0].value : 0, most = n > 0 ? item[n - 1].value : 0;
    const double low = quantile(n, item, total, 0.005), high = quantile(n, item, total, 0.995);
    const bool clip = high > low && (high - low) < 2 * (most - least) / 3;
    shade->low = clip ? low : least;
    shade->high = clip ? high : most;
    shade->below = shade->low > least;
    shade->above = shade->high < most;
}

// Signed fields: zero is white, and both signs fade alike; the colour bar shows what occurs.
static void centre_range(nmm_shade *shade) {
    const double most = nmm_max(fabs(shade->low), fabs(shade->high));
    shade->full_low = -most;
    shade->full_high = most;
    shade->low = nmm_min(0, shade->low);
    shade->high = nmm_max(0, shade->high);
}

// Magnitudes: from zero on, unless all are far from it.
static void start_range(nmm_shade *shade) {
    if (shade->low < 0.5 * shade->high) {
        shade->low = 0;
        shade->below = false;
    }
    shade->full_low = shade->low;
    shade->full_high = shade->high;
}

static const struct {
    const char *base, *unit;
    double factor;
} unit_table[] = {
    {"Pa", "GPa", 1e9},    {"Pa", "MPa", 1e6},        {"Pa", "kPa", 1e3},    {"Pa", "Pa", 0},
    {"m", "m", 0.1},       {"m", "mm", 1e-3},         {"m", "\xc2\xb5m", 0}, {"m/s", "m/s", 0.1},
    {"m/s", "mm/s", 1e-3}, {"m/s", "\xc2\xb5m/s", 0}, {"", "", 0},
};

// The largest unit that leaves numbers of 1 and more (of 0.1 m and more).
static void set_unit(nmm_shade *shade, const char *base) {
    const double most = nmm_max(fabs(shade->low), fabs(shade->high));
    for (size_t i = 0; i < sizeof unit_table / sizeof *unit_table; i++) {
        if (strcmp(unit_table[i].base, base) != 0) continue;
        if (most < unit_table[i].factor) continue;
        shade->unit = unit_table[i].unit;
        break;
    }
    static const struct {
        const char *unit;
        double factor;
    } factor[] = {{"GPa", 1e9},        {"MPa", 1e6},   {"kPa", 1e3},         {"mm", 1e-3},
                  {"\xc2\xb5m", 1e-6}, {"mm/s", 1e-3}, {"\xc2\xb5m/s", 1e-6}};
    shade->factor = 1;
    for (size_t i = 0; i < sizeof factor / sizeof *factor; i++) {
        if (strcmp(factor[i].unit, shade->unit) == 0) shade->factor = factor[i].factor;
    }
}

static nmm_status find_range(nmm_file *file, const nmm_file_geometry *g, nmm_shade *shade,
                             quantity kind) {
    weighed *item = NULL;
    TRY(nmm_allocate(nmm_file_context(file), &item, (size_t)g->n_element, sizeof *item));
    for (int e = 0; e < g->n_element; e++)
        item[e] = (weighed){shade->value[e], area_of(g, e)};
    set_range(shade, g->n_element, item);
    nmm_release(nmm_file_context(file), &item);
    // Less than this is the rounding of zero.
    const double tiny = field_table[kind].unit[0] == 'P' ? 1e-6 : 1e-12;
    if (nmm_max(fabs(shade->low), fabs(shade->high)) < tiny) shade->low = 0, shade->high = 1;
    if (shade->colours == NMM_COLOURS_DIVERGING)
        centre_range(shade);
    else
        start_range(shade);
    return NMM_OK;
}

nmm_status nmm_shade_make(nmm_file *file, const nmm_file_frame *frame,
                          const nmm_file_geometry *geometry, const char *name, nmm_shade *shade) {
    nmm_context *context = nmm_file_context(file);
    int i = 0;
    while (strcmp(field_table[i].name, name) != 0)
        i += 1;
    const quantity kind = (enum quantity)i;
    const int n = geometry->n_element;
    shade->title = field_table[i].title;
    shade->colours = kind == BLOCK         ? NMM_COLOURS_BLOCKS
                     : kind < DISPLACEMENT ? NMM_COLOURS_DIVERGING
                                           : NMM_COLOURS_RISING;
    TRY(nmm_allocate(context, &shade->value, (size_t)n, sizeof *shade->value));
    for (int e = 0; e < n; e++)
        shade->value[e] = value_of(frame, geometry, kind, e);
    shade->unit = "";
    shade->factor = 1;
    if (kind == BLOCK) return NMM_OK;
    TRY(find_range(file, geometry, shade, kind));
    set_unit(shade, field_table[i].unit);
    if (vector_of(frame, kind) == NULL) return NMM_OK;
    return nmm_allocate(context, &shade->slope, (size_t)n * 2, sizeof *shade->slope);
}

// The plane that fits the lengths at the corners best.
static void fit_slope(const nmm_file_geometry *g, int e, const double *vector, const double *page,
                      double slope[2]) {
    const int begin = g->element_start[e], n = g->element_start[e + 1] - begin;
    double mx = 0, my = 0, mv = 0, xx = 0, xy = 0, yy = 0, xv = 0, yv = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < n; k++) {
            const long p = g->corner_point[begin + k];
            const double length = hypot(vector[2 * p], vector[2 * p + 1]);
            const double x = page[2 * p] - mx, y = page[2 * p + 1] - my, v = length - mv;
            xx += x * x, xy += x * y, yy += y * y, xv += x * v, yv += y * v;
        }
        if (pass == 1) break;
        for (int k = 0; k < n; k++) {
            const long p = g->corner_point[begin + k];
            mx += page[2 * p] / n, my += page[2 * p + 1] / n;
            mv += hypot(vector[2 * p], vector[2 * p + 1]) / n;
        }
        xx = xy = yy = xv = yv = 0;
    }
    const double det = xx * yy - xy * xy;
    if (!(det > 1e-9 * (xx + yy) * (xx + yy))) return;
    slope[0] = (yy * xv - xy * yv) / det;
    slope[1] = (xx * yv - xy * xv) / det;
}

void nmm_shade_slopes(const nmm_file_frame *frame, const nmm_file_geometry *geometry,
                      const double *page, nmm_shade *shade) {
    if (shade->slope == NULL) return;
    const bool displaced = strcmp(shade->title, "displacement") == 0;
    const double *vector = displaced ? frame->displacement : frame->velocity;
    for (int e = 0; e < geometry->n_element; e++)
        fit_slope(geometry, e, vector, page, shade->slope + 2 * (long)e);
}
