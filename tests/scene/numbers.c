// SPDX-License-Identifier: MIT
//
// Numbers and units: every form, every fault, and the same bits as were printed.

#include "number.h"
#include "test.h"

#include <stdlib.h>

#define PI 3.14159265358979323846

static void plain_numbers(void **unused) {
    (void)unused;
    static const struct {
        const char *text;
        double value;
    } good[] = {{"0", 0},        {"-0.0", 0},
                {"5", 5},        {"+5", 5},
                {"-2.5", -2.5},  {".5", .5},
                {"5.", 5},       {"1e9", 1e9},
                {"5E9", 5e9},    {"1e+3", 1e3},
                {"1.e-3", 1e-3}, {"007", 7},
                {"0.1", 0.1},    {"1e308", 1e308},
                {"0e999", 0},    {"2.2250738585072014e-308", 2.2250738585072014e-308}};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        const nmm_number n = nmm_number_parse(good[i].text, NMM_PURE);
        assert_int_equal(n.fault, NMM_NUMBER_GOOD);
        assert_near(n.value, good[i].value, 0);
    }
}

static void wrong_numbers(void **unused) {
    (void)unused;
    static const struct {
        const char *text;
        nmm_number_fault fault;
    } bad[] = {{"", NMM_NUMBER_NONE},
               {".", NMM_NUMBER_NONE},
               {"-", NMM_NUMBER_NONE},
               {"e5", NMM_NUMBER_NONE},
               {"--5", NMM_NUMBER_NONE},
               {"1.2.3", NMM_NUMBER_NONE},
               {"1 000", NMM_NUMBER_NONE},
               {"1_000", NMM_NUMBER_NONE},
               {"5-3", NMM_NUMBER_NONE},
               {"1,5", NMM_NUMBER_COMMA},
               {"nan", NMM_NUMBER_NOT_FINITE},
               {".NaN", NMM_NUMBER_NOT_FINITE},
               {"-.inf", NMM_NUMBER_NOT_FINITE},
               {"Infinity", NMM_NUMBER_NOT_FINITE},
               {"1e309", NMM_NUMBER_HUGE},
               {"-1e999", NMM_NUMBER_HUGE},
               {"1e-400", NMM_NUMBER_TINY},
               {"0x10", NMM_NUMBER_UNIT},
               {"1e", NMM_NUMBER_UNIT},
               {"1f", NMM_NUMBER_UNIT},
               {"5 m m", NMM_NUMBER_UNIT},
               {"5 m", NMM_NUMBER_DIMENSION},
               {"0.5 g", NMM_NUMBER_DIMENSION}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const nmm_number n = nmm_number_parse(bad[i].text, NMM_PURE);
        if (n.fault != bad[i].fault) print_error("'%s'\n", bad[i].text);
        assert_int_equal(n.fault, bad[i].fault);
    }
    assert_int_equal(nmm_number_parse("1e308 km", NMM_LENGTH).fault, NMM_NUMBER_HUGE);
    // A number longer than any double needs is no number.
    char longer[200];
    memset(longer, '1', sizeof longer - 1);
    longer[sizeof longer - 1] = 0;
    assert_int_equal(nmm_number_parse(longer, NMM_PURE).fault, NMM_NUMBER_NONE);
}

static void units_convert_exactly(void **unused) {
    (void)unused;
    static const struct {
        const char *text;
        nmm_dimension dimension;
        double value;
    } good[] = {{"20 GPa", NMM_STRESS, 20e9},
                {"5mm", NMM_LENGTH, 0.005},
                {"35 mm", NMM_LENGTH, 0.035},
                {"57 cm", NMM_LENGTH, 0.57},
                {"2.5 km", NMM_LENGTH, 2500},
                {"28 deg", NMM_ANGLE, 28},
                {"28\xc2\xb0", NMM_ANGLE, 28},
                {"2.7 t/m3", NMM_DENSITY, 2700},
                {"2.7 g/cm3", NMM_DENSITY, 2700},
                {"0.5 g", NMM_ACCELERATION, 0.5 * 9.80665},
                {"3 kN", NMM_FORCE, 3000},
                {"3 kN/m", NMM_FORCE, 3000},
                {"10 kPa", NMM_STRESS, 1e4},
                {"10 kN/m2", NMM_STRESS, 1e4},
                {"3 ms", NMM_TIME, 0.003},
                {"2 min", NMM_TIME, 120},
                {"36 km/h", NMM_VELOCITY, 10},
                {"80 %", NMM_PURE, 0.8},
                {"80%", NMM_PURE, 0.8},
                {"5 1/s", NMM_RATE, 5},
                {"1e3 MPa/m", NMM_STIFFNESS, 1e9},
                {"1e9 Pa", NMM_STRESS, 1e9}};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        const nmm_number n = nmm_number_parse(good[i].text, good[i].dimension);
        if (n.fault != NMM_NUMBER_GOOD) print_error("'%s'\n", good[i].text);
        assert_int_equal(n.fault, NMM_NUMBER_GOOD);
        assert_near(n.value, good[i].value, 0);
    }
    assert_near(nmm_number_parse("1 rad", NMM_ANGLE).value, 180 / PI, 1e-13);
    assert_near(nmm_number_parse("180 deg/s", NMM_SPIN).value, PI, 1e-15);
    // Every unit is refused where another dimension is meant.
    for (const nmm_unit *unit = nmm_unit_table; unit->name != NULL; unit++) {
        char text[40];
        snprintf(text, sizeof text, "1 %s", unit->name);
        for (int d = 0; d < NMM_N_DIMENSION; d++) {
            const nmm_number n = nmm_number_parse(text, (nmm_dimension)d);
            const bool same = (int)unit->dimension == d;
            assert_int_equal(n.fault, same ? NMM_NUMBER_GOOD : NMM_NUMBER_DIMENSION);
        }
    }
}

static void printed_numbers_come_back(void **unused) {
    (void)unused;
    nmm_random random = nmm_random_seed(3);
    int n_tried = 0;
    while (n_tried < 20000) {
        const uint64_t bits = nmm_random_next(&random);
        double value;
        memcpy(&value, &bits, sizeof value);
        if (!isnormal(value)) continue;
        char text[40];
        snprintf(text, sizeof text, "%.17g", value);
        const nmm_number n = nmm_number_parse(text, NMM_PURE);
        assert_int_equal(n.fault, NMM_NUMBER_GOOD);
        assert_memory_equal(&n.value, &value, sizeof value);
        n_tried += 1;
    }
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(plain_numbers),
        cmocka_unit_test(wrong_numbers),
        cmocka_unit_test(units_convert_exactly),
        cmocka_unit_test(printed_numbers_come_back),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
