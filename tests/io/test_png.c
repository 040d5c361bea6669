// SPDX-License-Identifier: MIT
//
// Palettes of PNG files, read back by libpng: few colours stay as they are, many are near, rare
// strong ones are not lost; the sizes of drawings; memory.

#include "test.h"

#include "fixture.h"
#include "view.h"

#include <png.h>
#include <stdlib.h>

enum { WIDTH = 150, HEIGHT = 120, STRIDE = 157 };

static uint32_t pixel[HEIGHT][STRIDE];
static unsigned char back[HEIGHT][WIDTH][3];

static nmm_status write(nmm_context *context, const char *path) {
    const nmm_pixels image = {&pixel[0][0], WIDTH, HEIGHT, STRIDE};
    nmm_replacement file = {0};
    nmm_status status = nmm_replacement_open(context, &file, path);
    if (status == NMM_OK) status = nmm_png_write(context, &image, &file);
    if (status == NMM_OK) status = nmm_replacement_commit(&file);
    nmm_replacement_drop(&file);
    return status;
}

// Write the pixels and read them back.
static void write_and_read(const char *name) {
    char path[512];
    nmm_context context = {.n_thread = 1};
    png_image image = {.version = PNG_IMAGE_VERSION};
    assert_int_equal(write(&context, fixture_path(path, name)), NMM_OK);
    assert_int_equal(context.n_live, 0);
    assert_true(png_image_begin_read_from_file(&image, path));
    assert_true((image.format & PNG_FORMAT_FLAG_COLORMAP) != 0);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.height, HEIGHT);
    image.format = PNG_FORMAT_RGB;
    assert_true(png_image_finish_read(&image, NULL, back, 0, NULL));
}

// Largest difference of a channel of pixel (x, y).
static int error_at(int x, int y) {
    int most = 0;
    for (int k = 0; k < 3; k++) {
        const int wanted = (int)(pixel[y][x] >> (16 - 8 * k) & 255);
        most = nmm_max_int(most, abs(back[y][x][k] - wanted));
    }
    return most;
}

// 256 colours of one cell each are kept; what lies beyond the width is not looked at, nor the
// byte above the colour.
static void test_few_colours(void **state) {
    (void)state;
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < STRIDE; x++) {
            const uint32_t i = (uint32_t)(x * 7 + y * 13) % 256;
            pixel[y][x] = 0xab000000 | (i % 8 * 33) << 16 | (i / 8 % 8 * 35) << 8 | i / 64 * 77;
            if (x >= WIDTH) pixel[y][x] = 0x102030 * (uint32_t)(x * y);
        }
    }
    write_and_read("few.png");
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++)
            assert_int_equal(error_at(x, y), 0);
    }
}

// Thousands of shades of blue, and one red pixel.
static void test_many_colours(void **state) {
    (void)state;
    nmm_random random = nmm_random_seed(5);
    double sum = 0;
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            const uint32_t r = (uint32_t)(80 * nmm_random_unit(&random));
            const uint32_t g = (uint32_t)(256 * nmm_random_unit(&random));
            pixel[y][x] = r << 16 | g << 8 | 0xc0;
        }
    }
    pixel[60][70] = 0xfa1030;
    write_and_read("many.png");
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            assert_true(error_at(x, y) <= 12);
            sum += error_at(x, y);
        }
    }
    assert_true(sum / (WIDTH * HEIGHT) < 6);
    assert_int_equal(error_at(70, 60), 0);
}

static void test_one_colour(void **state) {
    (void)state;
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++)
            pixel[y][x] = 0xffffffff;
    }
    write_and_read("one.png");
    assert_int_equal(error_at(3, 4), 0);
}

static void test_no_memory(void **state) {
    (void)state;
    char path[512];
    fixture_path(path, "memory.png");
    for (long fail_at = 0;; fail_at++) {
        test_failing hook = {.fail_at = fail_at};
        nmm_context context = {.allocate = test_failing_hook, .user = &hook, .n_thread = 1};
        const nmm_status status = write(&context, path);
        assert_int_equal(hook.live, 0);
        if (status == NMM_OK) break;
        assert_int_equal(status, NMM_ERROR_MEMORY);
        assert_true(fail_at < 50);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_few_colours),
        cmocka_unit_test(test_many_colours),
        cmocka_unit_test(test_one_colour),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, fixture_clean);
}
