// SPDX-License-Identifier: MIT
//
// The quantity of a trade, what a monitor shows at the end: "monitors.NAME.displacement" with all
// its components or "...[K]" with one, and its closed form where the caller knows it.

#include "trade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const field_word[3] = {"displacement", "velocity", "stress"};
static const char *const field_unit[3] = {"m", "m/s", "Pa"};
static const int field_width[3] = {2, 2, 3};

static bool has_field(const nmm_reading *reading, int field) {
    const int has[3] = {reading->has_displacement, reading->has_velocity, reading->has_stress};
    return has[field] != 0;
}

static nmm_status complain(nmm_bench *bench, const char *words, const char *what) {
    return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT,
                    "quantity '%.200s': %s; must be monitors.NAME.displacement, .velocity or "
                    ".stress, with [0], [1] (or [2] of stress) for one component",
                    words, what);
}

// "displacement", "displacement[1]"
static bool read_field(const char *words, nmm_trade_quantity *quantity) {
    const size_t length = strcspn(words, "[");
    for (int f = 0; f < 3; f++) {
        if (strlen(field_word[f]) != length || strncmp(words, field_word[f], length) != 0) continue;
        quantity->field = f;
        quantity->first = 0;
        quantity->width = field_width[f];
        if (words[length] == 0) return true;
        const int k = words[length + 1] - '0';
        quantity->first = k;
        quantity->width = 1;
        return k >= 0 && k < field_width[f] && strcmp(words + length + 2, "]") == 0;
    }
    return false;
}

static nmm_status find_monitor(nmm_bench *bench, const nmm_sim *sim,
                               const nmm_trade_quantity *quantity) {
    char list[512] = "";
    for (int k = 0; k < nmm_sim_monitors(sim); k++) {
        nmm_reading reading;
        TRY(nmm_sim_monitor(sim, k, &reading));
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", used > 0 ? ", " : "", reading.name);
        if (strcmp(reading.name, quantity->monitor) != 0) continue;
        if (has_field(&reading, quantity->field)) return NMM_OK;
        return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT,
                        "quantity '%s': the scene's monitor %s does not record %s", quantity->words,
                        reading.name, field_word[quantity->field]);
    }
    return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT,
                    "quantity '%s': no monitor '%s' in the scene; there are: %s", quantity->words,
                    quantity->monitor, list);
}

static nmm_status read_quantity(nmm_bench *bench, const nmm_sim *sim, const char *words,
                                size_t length) {
    static const char head[] = "monitors.";
    nmm_trade_quantity *quantity = &bench->trade->quantity;
    TRY(nmm_bench_words(bench, &quantity->words, "%.*s", (int)nmm_min(400, (double)length), words));
    const char *dot = strrchr(quantity->words, '.');
    if (strncmp(quantity->words, head, sizeof head - 1) != 0 ||
        dot < quantity->words + sizeof head - 1)
        return complain(bench, quantity->words, "not one of a monitor");
    const char *name = quantity->words + sizeof head - 1;
    TRY(nmm_bench_words(bench, &quantity->monitor, "%.*s", (int)(dot - name), name));
    if (!read_field(dot + 1, quantity))
        return complain(bench, quantity->words, "no such field or component");
    return find_monitor(bench, sim, quantity);
}

// The first monitor's displacement, or what else it records.
static nmm_status choose_quantity(nmm_bench *bench, const nmm_sim *sim) {
    nmm_reading reading;
    const char *words = NULL;
    if (nmm_sim_monitors(sim) == 0) {
        return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT,
                        "nothing to compare: the scene has no monitor; add one where the answer "
                        "matters, as monitors: [{point: [x, y]}]");
    }
    TRY(nmm_sim_monitor(sim, 0, &reading));
    int field = 0;
    while (field < 2 && !has_field(&reading, field))
        field += 1;
    TRY(nmm_bench_words(bench, &words, "monitors.%s.%s", reading.name, field_word[field]));
    return read_quantity(bench, sim, words, strlen(words));
}

// "1.5" or "[1.5, 2]"; returns how many numbers, 0: not that.
static int read_numbers(const char *words, double value[3]) {
    const bool is_list = *words == '[';
    const char *at = words + is_list;
    int n = 0;
    while (n < 3) {
        char *end;
        value[n] = strtod(at, &end);
        if (end == at || !isfinite(value[n])) return 0;
        n += 1;
        at = end + strspn(end, " ");
        if (!is_list || *at != ',') break;
        at += 1;
    }
    const bool closed = is_list ? at[0] == ']' && at[1] == 0 : at[0] == 0;
    return closed ? n : 0;
}

static nmm_status read_expectation(nmm_bench *bench, const nmm_sim *sim, const char *words) {
    nmm_trade *trade = bench->trade;
    const char *equals = strrchr(words, '=');
    if (equals == NULL)
        return complain(bench, words, "an expectation is QUANTITY=NUMBER or QUANTITY=[X,Y]");
    const size_t length = (size_t)(equals - words);
    const char *other = trade->def.quantity;
    if (other != NULL && (strlen(other) != length || strncmp(other, words, length) != 0))
        return complain(bench, other, "another quantity than the one expected");
    TRY(read_quantity(bench, sim, words, length));
    const int n = read_numbers(equals + 1, trade->expectation);
    if (n != trade->quantity.width) {
        return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT,
                        "expected value '%.100s' of %s: must be %s", equals + 1,
                        trade->quantity.words,
                        trade->quantity.width == 1   ? "one number"
                        : trade->quantity.width == 2 ? "two numbers, [X,Y]"
                                                     : "three numbers, [XX,YY,XY]");
    }
    double size = 0;
    for (int k = 0; k < n; k++)
        size = nmm_max(size, fabs(trade->expectation[k]));
    trade->has_expectation = true;
    if (size > 0) return NMM_OK;
    return nmm_fail(&bench->context, NMM_ERROR_ARGUMENT,
                    "expected value of %s is 0: there is no error relative to it",
                    trade->quantity.words);
}

nmm_status nmm_trade_find_quantity(nmm_bench *bench, const nmm_sim *sim) {
    nmm_trade *trade = bench->trade;
    const nmm_trade_def *def = &trade->def;
    if (def->expect != NULL)
        TRY(read_expectation(bench, sim, def->expect));
    else if (def->quantity != NULL)
        TRY(read_quantity(bench, sim, def->quantity, strlen(def->quantity)));
    else
        TRY(choose_quantity(bench, sim));
    trade->result.quantity = trade->quantity.words;
    trade->result.unit = field_unit[trade->quantity.field];
    trade->result.width = trade->quantity.width;
    return NMM_OK;
}

void nmm_trade_read(const nmm_trade *trade, const nmm_sim *sim, double value[3]) {
    const nmm_trade_quantity *quantity = &trade->quantity;
    for (int k = 0; k < nmm_sim_monitors(sim); k++) {
        nmm_reading reading;
        if (nmm_sim_monitor(sim, k, &reading) != NMM_OK ||
            strcmp(reading.name, quantity->monitor) != 0)
            continue;
        const double *field[3] = {reading.displacement, reading.velocity, reading.stress};
        for (int i = 0; i < quantity->width; i++)
            value[i] = field[quantity->field][quantity->first + i];
        return;
    }
}
