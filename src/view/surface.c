// SPDX-License-Identifier: MIT
//
// PNG, SVG and PDF from one drawing. A page is laid out on a surface that only measures text, then
// drawn on one of the right size, whose bytes go into a temporary that takes the picture's name
// when it is whole.
//
// Vector pages are 160 mm wide at the default width, a text column of a paper.

#include "view.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <string.h>
#include <strings.h>

// Points of a page unit: 160 mm for 1600 units.
#define POINTS (160 / 25.4 * 72 / 1600)

nmm_status nmm_kind_of(nmm_context *context, const char *path, nmm_kind *kind) {
    static const char *const ending[3] = {".png", ".svg", ".pdf"};
    const size_t length = strlen(path);
    for (int i = 0; i < 3; i++) {
        if (length < 4 || strcasecmp(path + length - 4, ending[i]) != 0) continue;
        *kind = (nmm_kind)i;
        return NMM_OK;
    }
    return nmm_fail(context, NMM_ERROR_ARGUMENT, "%s: a picture's name ends in .png, .svg or .pdf",
                    path);
}

static cairo_status_t write_bytes(void *user, const unsigned char *bytes, unsigned size) {
    nmm_replacement *file = user;
    nmm_replacement_write(file, bytes, size);
    return file->error != 0 ? CAIRO_STATUS_WRITE_ERROR : CAIRO_STATUS_SUCCESS;
}

static cairo_surface_t *create_surface(const nmm_page *page, nmm_kind kind, nmm_replacement *file) {
    const double width = page->width, height = page->height;
    cairo_surface_t *surface = NULL;
    switch (kind) {
    case NMM_KIND_PNG:
        return cairo_image_surface_create(CAIRO_FORMAT_RGB24, (int)width, (int)(height + 0.5));
    case NMM_KIND_SVG:
        return cairo_svg_surface_create_for_stream(write_bytes, file, width * POINTS,
                                                   height * POINTS);
    case NMM_KIND_PDF:
        surface =
            cairo_pdf_surface_create_for_stream(write_bytes, file, width * POINTS, height * POINTS);
        // The same picture is the same file, whenever it is made.
        cairo_pdf_surface_set_metadata(surface, CAIRO_PDF_METADATA_CREATE_DATE,
                                       "2000-01-01T00:00:00Z");
        return surface;
    }
    return NULL;
}

static nmm_status fail_cairo(nmm_context *context, cairo_status_t status) {
    const nmm_status kind = status == CAIRO_STATUS_NO_MEMORY ? NMM_ERROR_MEMORY : NMM_ERROR_FILE;
    return nmm_fail(context, kind, "cannot draw the picture: %s", cairo_status_to_string(status));
}

// Text is measured on a surface of the same kind of scaling, without output.
nmm_status nmm_page_measure(const nmm_page *page, void (*measure)(void *user, cairo_t *cairo)) {
    cairo_surface_t *surface = cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1);
    cairo_t *cairo = cairo_create(surface);
    cairo_font_options_t *options = cairo_font_options_create();
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_set_font_options(cairo, options);
    cairo_font_options_destroy(options);
    measure(page->user, cairo);
    const cairo_status_t status = cairo_status(cairo);
    cairo_destroy(cairo);
    cairo_surface_destroy(surface);
    return status == CAIRO_STATUS_SUCCESS ? NMM_OK : fail_cairo(page->context, status);
}

static nmm_status write_image(nmm_context *context, cairo_surface_t *surface,
                              nmm_replacement *file) {
    cairo_surface_flush(surface);
    const nmm_pixels image = {.pixel = (const void *)cairo_image_surface_get_data(surface),
                              .width = cairo_image_surface_get_width(surface),
                              .height = cairo_image_surface_get_height(surface),
                              .stride = (size_t)cairo_image_surface_get_stride(surface) / 4};
    return nmm_png_write(context, &image, file);
}

static nmm_status draw(const nmm_page *page, nmm_kind kind, nmm_replacement *file) {
    cairo_surface_t *surface = create_surface(page, kind, file);
    cairo_t *cairo = cairo_create(surface);
    cairo_font_options_t *options = cairo_font_options_create();
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_set_font_options(cairo, options);
    cairo_font_options_destroy(options);
    if (kind != NMM_KIND_PNG) cairo_scale(cairo, POINTS, POINTS);
    page->draw(page->user, cairo);
    cairo_status_t drawn = cairo_status(cairo);
    nmm_status status = NMM_OK;
    cairo_destroy(cairo);
    if (drawn == CAIRO_STATUS_SUCCESS && kind == NMM_KIND_PNG)
        status = write_image(page->context, surface, file);
    cairo_surface_finish(surface);
    if (drawn == CAIRO_STATUS_SUCCESS) drawn = cairo_surface_status(surface);
    cairo_surface_destroy(surface);
    // A failed write is told by the commit, with the system's reason.
    if (drawn != CAIRO_STATUS_SUCCESS && file->error == 0) return fail_cairo(page->context, drawn);
    return status;
}

nmm_status nmm_page_write(const nmm_page *page, const char *path, nmm_kind kind) {
    nmm_replacement file = {0};
    nmm_status status = nmm_replacement_open(page->context, &file, path);
    if (status == NMM_OK) status = draw(page, kind, &file);
    if (status == NMM_OK) status = nmm_replacement_commit(&file);
    nmm_replacement_drop(&file);
    return status;
}

// --- The picture of a frame

static void lay_out_picture(void *user, cairo_t *cairo) {
    nmm_picture *picture = user;
    picture->cairo = cairo;
    nmm_layout_make(picture, picture->width);
    nmm_shade_slopes(&picture->frame, picture->geometry, picture->page, &picture->shade);
    picture->cairo = NULL;
}

static void draw_picture(void *user, cairo_t *cairo) {
    nmm_picture *picture = user;
    picture->cairo = cairo;
    nmm_draw_page(picture);
    picture->cairo = NULL;
}

nmm_status nmm_surface_write(nmm_picture *picture, const char *path, nmm_kind kind, double width) {
    nmm_page page = {
        .context = nmm_file_context(picture->file), .user = picture, .draw = draw_picture};
    picture->width = width;
    TRY(nmm_page_measure(&page, lay_out_picture));
    page.width = picture->width;
    page.height = picture->height;
    return nmm_page_write(&page, path, kind);
}
