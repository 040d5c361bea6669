// SPDX-License-Identifier: MIT
//
// PNG files with a palette: a third of the size of full colour, for drawings have few colours and
// many shades of their edges.
//
// Pixels are gathered in cells of the colour cube, 64 to a side. The palette starts with the
// commonest cell and takes in turn the one that is farthest from all before it, the more so the
// commoner it is; so rare but strong colours stay, and a picture with few colours keeps them all.
// Every pixel gets the nearest one. The same picture is the same file.

#include "view.h"

#include <png.h>

enum { SIDE = 64, CELLS = SIDE * SIDE * SIDE, PALETTE = 256 };

// A used cell of the colour cube, and the entry of the palette nearest to it so far.
typedef struct colour_cell {
    int cell;
    double count;
    double sum[3];   // then the mean colour, 0 .. 255
    double distance; // squared
    int nearest;
} colour_cell;

typedef struct palette {
    nmm_context *context;
    int *number; // [CELLS] of a cell among the used ones, -1: not used
    int n;       // used cells
    int capacity;
    colour_cell *cell;
    int n_colour;
    unsigned char colour[PALETTE][3];
} palette;

static int cell_of(uint32_t pixel) {
    const uint32_t r = pixel >> 18 & 63, g = pixel >> 10 & 63, b = pixel >> 2 & 63;
    return (int)((r * SIDE + g) * SIDE + b);
}

static nmm_status count_pixels(palette *p, const nmm_pixels *image) {
    for (int c = 0; c < CELLS; c++)
        p->number[c] = -1;
    for (int y = 0; y < image->height; y++) {
        const uint32_t *row = image->pixel + (size_t)y * image->stride;
        for (int x = 0; x < image->width; x++) {
            const int c = cell_of(row[x]);
            if (p->number[c] < 0) {
                TRY(nmm_grow(p->context, &p->cell, &p->capacity, p->n + 1, sizeof *p->cell));
                p->cell[p->n] = (colour_cell){.cell = c, .distance = 3.0 * 256 * 256};
                p->number[c] = p->n++;
            }
            colour_cell *cell = &p->cell[p->number[c]];
            cell->count += 1;
            cell->sum[0] += row[x] >> 16 & 255;
            cell->sum[1] += row[x] >> 8 & 255;
            cell->sum[2] += row[x] & 255;
        }
    }
    for (int i = 0; i < p->n; i++) {
        for (int k = 0; k < 3; k++)
            p->cell[i].sum[k] /= p->cell[i].count;
    }
    return NMM_OK;
}

// Take cell `i` as the next colour; cells that it is nearest to remember it.
static void add_colour(palette *p, int i) {
    unsigned char *colour = p->colour[p->n_colour];
    for (int k = 0; k < 3; k++)
        colour[k] = (unsigned char)(p->cell[i].sum[k] + 0.5);
    for (int j = 0; j < p->n; j++) {
        colour_cell *cell = &p->cell[j];
        double distance = 0;
        for (int k = 0; k < 3; k++)
            distance += (cell->sum[k] - colour[k]) * (cell->sum[k] - colour[k]);
        if (j != i && distance >= cell->distance) continue;
        cell->distance = j == i ? 0 : distance;
        cell->nearest = p->n_colour;
    }
    p->n_colour += 1;
}

static void choose_colours(palette *p) {
    while (p->n_colour < PALETTE) {
        int best = -1;
        double most = 0;
        for (int i = 0; i < p->n; i++) {
            const double want = p->cell[i].distance * p->cell[i].count;
            if (want <= most) continue;
            most = want;
            best = i;
        }
        if (best < 0) break;
        add_colour(p, best);
    }
}

static nmm_status write_indices(const palette *p, const nmm_pixels *image, nmm_replacement *file) {
    png_image png = {.version = PNG_IMAGE_VERSION,
                     .width = (png_uint_32)image->width,
                     .height = (png_uint_32)image->height,
                     .format = PNG_FORMAT_RGB_COLORMAP,
                     .colormap_entries = (png_uint_32)p->n_colour};
    const size_t width = (size_t)image->width, n = width * (size_t)image->height;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
    unsigned char *index = NULL, *bytes = NULL;
    TRY(nmm_allocate(p->context, &index, n, 1));
    nmm_status status = nmm_allocate(p->context, &bytes, size, 1);
    for (size_t i = 0; status == NMM_OK && i < n; i++) {
        const uint32_t pixel = image->pixel[i / width * image->stride + i % width];
        index[i] = (unsigned char)p->cell[p->number[cell_of(pixel)]].nearest;
    }
    if (status == NMM_OK) {
        if (png_image_write_to_memory(&png, bytes, &size, 0, index, image->width, p->colour))
            nmm_replacement_write(file, bytes, size);
        else
            status =
                nmm_fail(p->context, NMM_ERROR_MEMORY, "cannot write the picture: %s", png.message);
    }
    png_image_free(&png);
    nmm_release(p->context, &bytes);
    nmm_release(p->context, &index);
    return status;
}

nmm_status nmm_png_write(nmm_context *context, const nmm_pixels *image, nmm_replacement *file) {
    palette p = {.context = context};
    nmm_status status = nmm_allocate(context, &p.number, CELLS, sizeof *p.number);
    if (status == NMM_OK) status = count_pixels(&p, image);
    if (status == NMM_OK) {
        choose_colours(&p);
        status = write_indices(&p, image, file);
    }
    nmm_release(context, &p.cell);
    nmm_release(context, &p.number);
    return status;
}
