// SPDX-License-Identifier: MIT
//
// Numbers and units. The token's form is checked here, letter by letter; only the conversion of
// digits to a double is left to the C library, in the C locale. Units hold a factor above and one
// below the line, so that 35 mm is the double nearest to 0.035.

#include "number.h"

#include <ctype.h>
#include <errno.h>
#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define PI 3.14159265358979323846

// Standard gravity [m/s2].
#define STANDARD_GRAVITY 9.80665

const nmm_dimension_facts nmm_dimension_table[NMM_N_DIMENSION] = {
    [NMM_PURE] = {"a plain number", "", 1e15},
    [NMM_LENGTH] = {"a length", "m", 1e9},
    [NMM_TIME] = {"a time", "s", 1e12},
    [NMM_ANGLE] = {"an angle", "deg", 360},
    [NMM_DENSITY] = {"a density", "kg/m3", 1e9},
    [NMM_STRESS] = {"a stress", "Pa", 1e18},
    [NMM_FORCE] = {"a force", "N", 1e18},
    [NMM_VELOCITY] = {"a velocity", "m/s", 1e6},
    [NMM_SPIN] = {"an angular velocity", "rad/s", 1e6},
    [NMM_ACCELERATION] = {"an acceleration", "m/s2", 1e6},
    [NMM_RATE] = {"a rate", "1/s", 1e9},
    [NMM_STIFFNESS] = {"a stiffness", "Pa/m", 1e21},
};

const nmm_unit nmm_unit_table[] = {
    {"%", NMM_PURE, 1, 100},
    {"m", NMM_LENGTH, 1, 1},
    {"km", NMM_LENGTH, 1e3, 1},
    {"dm", NMM_LENGTH, 1, 10},
    {"cm", NMM_LENGTH, 1, 100},
    {"mm", NMM_LENGTH, 1, 1e3},
    {"um", NMM_LENGTH, 1, 1e6},
    {"s", NMM_TIME, 1, 1},
    {"ms", NMM_TIME, 1, 1e3},
    {"us", NMM_TIME, 1, 1e6},
    {"min", NMM_TIME, 60, 1},
    {"h", NMM_TIME, 3600, 1},
    {"d", NMM_TIME, 86400, 1},
    {"deg", NMM_ANGLE, 1, 1},
    {"\xc2\xb0", NMM_ANGLE, 1, 1},
    {"rad", NMM_ANGLE, 180, PI},
    {"kg/m3", NMM_DENSITY, 1, 1},
    {"t/m3", NMM_DENSITY, 1e3, 1},
    {"g/cm3", NMM_DENSITY, 1e3, 1},
    {"Pa", NMM_STRESS, 1, 1},
    {"kPa", NMM_STRESS, 1e3, 1},
    {"MPa", NMM_STRESS, 1e6, 1},
    {"GPa", NMM_STRESS, 1e9, 1},
    {"bar", NMM_STRESS, 1e5, 1},
    {"N/m2", NMM_STRESS, 1, 1},
    {"kN/m2", NMM_STRESS, 1e3, 1},
    {"N/mm2", NMM_STRESS, 1e6, 1},
    {"N", NMM_FORCE, 1, 1},
    {"kN", NMM_FORCE, 1e3, 1},
    {"MN", NMM_FORCE, 1e6, 1},
    {"N/m", NMM_FORCE, 1, 1},
    {"kN/m", NMM_FORCE, 1e3, 1},
    {"MN/m", NMM_FORCE, 1e6, 1},
    {"m/s", NMM_VELOCITY, 1, 1},
    {"mm/s", NMM_VELOCITY, 1, 1e3},
    {"cm/s", NMM_VELOCITY, 1, 100},
    {"km/h", NMM_VELOCITY, 1e3, 3600},
    {"rad/s", NMM_SPIN, 1, 1},
    {"deg/s", NMM_SPIN, PI, 180},
    {"m/s2", NMM_ACCELERATION, 1, 1},
    {"cm/s2", NMM_ACCELERATION, 1, 100},
    {"g", NMM_ACCELERATION, STANDARD_GRAVITY, 1},
    {"1/s", NMM_RATE, 1, 1},
    {"Hz", NMM_RATE, 1, 1},
    {"Pa/m", NMM_STIFFNESS, 1, 1},
    {"kPa/m", NMM_STIFFNESS, 1e3, 1},
    {"MPa/m", NMM_STIFFNESS, 1e6, 1},
    {"GPa/m", NMM_STIFFNESS, 1e9, 1},
    {"MPa/mm", NMM_STIFFNESS, 1e9, 1},
    {"N/m3", NMM_STIFFNESS, 1, 1},
    {"kN/m3", NMM_STIFFNESS, 1e3, 1},
    {"MN/m3", NMM_STIFFNESS, 1e6, 1},
    {NULL, NMM_PURE, 0, 1},
};

const nmm_unit *nmm_unit_find(const char *name, nmm_dimension dimension) {
    const nmm_unit *other = NULL;
    for (const nmm_unit *unit = nmm_unit_table; unit->name != NULL; unit++) {
        if (strcmp(unit->name, name) != 0) continue;
        if (unit->dimension == dimension) return unit;
        other = unit;
    }
    return other;
}

static size_t count_digits(const char *text) {
    size_t n = 0;
    while (text[n] >= '0' && text[n] <= '9')
        n += 1;
    return n;
}

// Letters of the number at the start of `text`: [+-] digits [. digits] [e [+-] digits]; 0: none.
static size_t number_length(const char *text) {
    size_t n = text[0] == '+' || text[0] == '-' ? 1 : 0;
    const size_t whole = count_digits(text + n);
    n += whole;
    size_t part = 0;
    if (text[n] == '.') {
        part = count_digits(text + n + 1);
        n += 1 + part;
    }
    if (whole + part == 0) return 0;
    if (text[n] != 'e' && text[n] != 'E') return n;
    const size_t sign = text[n + 1] == '+' || text[n + 1] == '-' ? 1 : 0;
    const size_t digits = count_digits(text + n + 1 + sign);
    return digits > 0 ? n + 1 + sign + digits : n;
}

static bool is_not_finite(const char *text) {
    static const char *const word[] = {"nan", ".nan", "inf", ".inf", "infinity"};
    if (text[0] == '+' || text[0] == '-') text += 1;
    for (size_t i = 0; i < sizeof word / sizeof *word; i++) {
        if (strcasecmp(text, word[i]) == 0) return true;
    }
    return false;
}

// The digits as a double, whatever the locale of the program.
static double convert(const char *digits) {
    const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    const locale_t before = plain != (locale_t)0 ? uselocale(plain) : (locale_t)0;
    const double value = strtod(digits, NULL);
    if (plain != (locale_t)0) {
        uselocale(before);
        freelocale(plain);
    }
    return value;
}

static bool has_digit_above_zero(const char *digits) {
    for (; *digits != 0 && *digits != 'e' && *digits != 'E'; digits++) {
        if (*digits >= '1' && *digits <= '9') return true;
    }
    return false;
}

nmm_number nmm_number_parse(const char *text, nmm_dimension dimension) {
    nmm_number number = {.fault = NMM_NUMBER_NONE, .unit = ""};
    char digits[128];
    const size_t length = number_length(text);
    if (length == 0 && is_not_finite(text)) number.fault = NMM_NUMBER_NOT_FINITE;
    if (length == 0 || length >= sizeof digits) return number;
    memcpy(digits, text, length);
    digits[length] = 0;
    const double value = convert(digits);

    // The rest must be a unit of the right dimension.
    const char *rest = text + length;
    while (*rest == ' ')
        rest += 1;
    number.unit = rest;
    number.fault = NMM_NUMBER_COMMA;
    if (*rest == ',' && rest[1] >= '0' && rest[1] <= '9') return number;
    number.fault = NMM_NUMBER_NONE;
    if (strchr("0123456789+-.,_", *rest) != NULL && *rest != 0 && strcmp(rest, "1/s") != 0)
        return number;
    const nmm_unit *unit = *rest != 0 ? nmm_unit_find(rest, dimension) : NULL;
    number.fault = NMM_NUMBER_UNIT;
    if (*rest != 0 && unit == NULL) return number;
    number.fault = NMM_NUMBER_DIMENSION;
    number.meant = unit;
    if (unit != NULL && unit->dimension != dimension) return number;

    number.value = unit != NULL ? value * unit->multiply / unit->divide : value;
    number.fault = NMM_NUMBER_GOOD;
    if (!isfinite(number.value)) number.fault = NMM_NUMBER_HUGE;
    if (number.value == 0 && has_digit_above_zero(digits)) number.fault = NMM_NUMBER_TINY;
    return number;
}
