// SPDX-License-Identifier: MIT
//
// The constant-strain element: strain, energy, force, stiffness and mass against closed forms,
// finite differences and invariances.

#include "mechanics.h"
#include "test.h"

// A triangle (0,0) (1,0) (0,1), scaled: gradients of its weights.
static const double GRADIENT[6] = {-1, -1, 1, 0, 0, 1};
static const nmm_elastic STEEL = {.lambda = 1.2, .mu = 0.8};

static double energy(const double d[6], const double initial[3]) {
    const nmm_strain strain = nmm_strain_of(d, GRADIENT);
    return nmm_strain_energy_of(STEEL, &strain, initial);
}

static void some_displacement(nmm_random *random, double size, double d[6]) {
    for (int i = 0; i < 6; i++)
        d[i] = size * (2 * nmm_random_unit(random) - 1);
}

// Displacements that turn the reference by `angle` about the origin after stretching it.
static void turned(double angle, double stretch, double d[6]) {
    const double X[6] = {0, 0, 1, 0, 0, 1};
    for (int i = 0; i < 3; i++) {
        const double x = (1 + stretch) * X[2 * i], y = (1 + stretch) * X[2 * i + 1];
        d[2 * i] = cos(angle) * x - sin(angle) * y - X[2 * i];
        d[2 * i + 1] = sin(angle) * x + cos(angle) * y - X[2 * i + 1];
    }
}

static void test_lame(void **unused) {
    (void)unused;
    const nmm_material strain = {2500, 1e9, 0.25, NMM_PLANE_STRAIN};
    const nmm_material stress = {2500, 1e9, 0.25, NMM_PLANE_STRESS};
    // Confined modulus E (1 - nu) / (1 + nu) / (1 - 2 nu) = 1.2e9.
    const nmm_elastic a = nmm_elastic_of(&strain), b = nmm_elastic_of(&stress);
    assert_close(a.lambda + 2 * a.mu, 1.2e9, 1e-14);
    // Uniaxial plane stress gives E back.
    assert_close(4 * b.mu * (b.lambda + b.mu) / (b.lambda + 2 * b.mu), 1e9, 1e-14);
}

static void test_rigid_turn_is_free(void **unused) {
    (void)unused;
    const double none[3] = {0, 0, 0};
    for (int k = -40; k <= 40; k++) {
        double d[6];
        turned(0.3 * k, 0, d);
        const nmm_strain strain = nmm_strain_of(d, GRADIENT);
        assert_near(strain.exx, 0, 1e-15);
        assert_near(strain.eyy, 0, 1e-15);
        assert_near(strain.exy, 0, 1e-15);
        assert_near(strain.c, cos(0.3 * k), 1e-14);
        assert_near(strain.s, sin(0.3 * k), 1e-14);
        assert_near(energy(d, none), 0, 1e-29);
    }
}

static void test_stretch_after_turn(void **unused) {
    (void)unused;
    double d[6];
    turned(2.5, 1e-3, d);
    const nmm_strain strain = nmm_strain_of(d, GRADIENT);
    assert_close(strain.exx, 1e-3, 1e-12);
    assert_close(strain.eyy, 1e-3, 1e-12);
    // Equal stretch: pressure 2 (lambda + mu) e, whatever the turn.
    const double none[3] = {0, 0, 0};
    double stress[3];
    nmm_cauchy_of(&strain, nmm_piola_of(STEEL, &strain, none), stress);
    assert_close(stress[0], 2 * (1.2 + 0.8) * 1e-3 / 1.001, 1e-12);
    assert_close(stress[1], stress[0], 1e-12);
    assert_near(stress[2], 0, 1e-16);
}

static void test_small_strain_keeps_digits(void **unused) {
    (void)unused;
    // A strain of 1e-13 is not lost in 1 + 1e-13.
    const double d[6] = {0, 0, 1e-13, 0, 0, 0};
    const nmm_strain strain = nmm_strain_of(d, GRADIENT);
    assert_close(strain.exx, 1e-13, 1e-14);
    assert_near(strain.eyy, 0, 1e-27);
}

static void test_force_is_derivative_of_energy(void **unused) {
    (void)unused;
    nmm_random random = nmm_random_seed(1);
    const double initial[3] = {0.3, -0.2, 0.15};
    for (int trial = 0; trial < 200; trial++) {
        double d[6];
        some_displacement(&random, 0.3, d);
        const nmm_strain strain = nmm_strain_of(d, GRADIENT);
        const nmm_tensor P = nmm_piola_of(STEEL, &strain, initial);
        for (int i = 0; i < 6; i++) {
            const double step = 1e-6, kept = d[i];
            d[i] = kept + step;
            const double up = energy(d, initial);
            d[i] = kept - step;
            const double down = energy(d, initial);
            d[i] = kept;
            const double *g = GRADIENT + 2 * (i / 2);
            const double force = i % 2 == 0 ? P.xx * g[0] + P.xy * g[1] : P.yx * g[0] + P.yy * g[1];
            assert_near(force, (up - down) / (2 * step), 1e-8);
        }
    }
}

static void test_moment_balance(void **unused) {
    (void)unused;
    // P F^T symmetric: internal forces have no moment, initial stress included.
    nmm_random random = nmm_random_seed(2);
    const double initial[3] = {0.5, -0.1, 0.4};
    for (int trial = 0; trial < 200; trial++) {
        double d[6];
        some_displacement(&random, 0.4, d);
        const nmm_strain s = nmm_strain_of(d, GRADIENT);
        const nmm_tensor P = nmm_piola_of(STEEL, &s, initial);
        const double xy = P.xx * s.H.yx + P.xy * (1 + s.H.yy);
        const double yx = P.yx * (1 + s.H.xx) + P.yy * s.H.xy;
        assert_near(xy, yx, 1e-14);
    }
}

static void full_stiffness(const nmm_stiffness *k, double K[6][6]) {
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double block[4] = {0};
            nmm_stiffness_add(k, i, j, block);
            for (int x = 0; x < 4; x++)
                K[2 * i + x / 2][2 * j + x % 2] = block[x];
        }
    }
}

static void test_stiffness(void **unused) {
    (void)unused;
    const double none[3] = {0, 0, 0};
    nmm_random random = nmm_random_seed(3);
    for (int trial = 0; trial < 100; trial++) {
        double d[6], K[6][6];
        turned(6.3 * nmm_random_unit(&random), 0, d);
        const nmm_strain strain = nmm_strain_of(d, GRADIENT);
        const nmm_stiffness k = nmm_stiffness_of(STEEL, &strain, 0, 1, GRADIENT);
        full_stiffness(&k, K);
        for (int i = 0; i < 6; i++) {
            // Column i is the change of force with displacement i.
            double up[6], step = 1e-6;
            memcpy(up, d, sizeof up);
            up[i] += step;
            const nmm_strain moved = nmm_strain_of(up, GRADIENT);
            const nmm_tensor P = nmm_piola_of(STEEL, &moved, none);
            for (int j = 0; j < 6; j++) {
                const double *g = GRADIENT + 2 * (j / 2);
                const double force =
                    j % 2 == 0 ? P.xx * g[0] + P.xy * g[1] : P.yx * g[0] + P.yy * g[1];
                assert_near(K[j][i], force / step, 1e-5);
                assert_near(K[j][i], K[i][j], 1e-14);
            }
        }
        // Rigid motions, the turned one included, cost nothing; nothing is negative.
        double x[6];
        for (int mode = 0; mode < 40; mode++) {
            some_displacement(&random, 1, x);
            double product = 0;
            for (int i = 0; i < 36; i++)
                product += x[i / 6] * K[i / 6][i % 6] * x[i % 6];
            assert_true(product > -1e-13);
        }
        for (int i = 0; i < 6; i++) {
            assert_near(K[i][0] + K[i][2] + K[i][4], 0, 1e-14);
            assert_near(K[i][1] + K[i][3] + K[i][5], 0, 1e-14);
        }
    }
}

static void test_mass(void **unused) {
    (void)unused;
    // The whole reference triangle: A/12 (1 + delta_ij), density 3, area 1/2.
    const double moment[3] = {1.0 / 36, -1.0 / 72, 1.0 / 36};
    const double weight[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3};
    double m[6];
    nmm_mass_of(3, 0.5, moment, weight, GRADIENT, m);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            assert_close(m[nmm_pair_index(3, i, j)], 3 * 0.5 / 12 * (i == j ? 2 : 1), 1e-14);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lame),
        cmocka_unit_test(test_rigid_turn_is_free),
        cmocka_unit_test(test_stretch_after_turn),
        cmocka_unit_test(test_small_strain_keeps_digits),
        cmocka_unit_test(test_force_is_derivative_of_energy),
        cmocka_unit_test(test_moment_balance),
        cmocka_unit_test(test_stiffness),
        cmocka_unit_test(test_mass),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
