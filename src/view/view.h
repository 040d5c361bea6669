// SPDX-License-Identifier: MIT
//
// Parts of the picture of one frame, shared by the source files of this floor: the field that
// colours the blocks, the layout of the page, colours, and the drawing of each layer.
//
// All drawing is done in page units (pixels of a PNG); model places are turned into page places
// once. One code draws PNG, SVG and PDF.

#ifndef NMM_VIEW_H
#define NMM_VIEW_H

#include "io.h"

#include <cairo.h>

// --- Colours

typedef struct nmm_colour {
    double r, g, b;
} nmm_colour;

typedef enum nmm_colours {
    NMM_COLOURS_RISING,    // magnitudes: viridis
    NMM_COLOURS_DIVERGING, // signed: blue, white, red
    NMM_COLOURS_BLOCKS     // names: eight soft colours in turn
} nmm_colours;

/// Colour at t in [0, 1] (NMM_COLOURS_BLOCKS: colour number t); outside is clamped.
nmm_colour nmm_colour_at(nmm_colours colours, double t);

// --- The field

/// What colours the elements.
typedef struct nmm_shade {
    const char *title; // "mean stress (xx + yy) / 2"
    const char *unit;  // "MPa"; "" for blocks
    double factor;     // value of one unit, SI
    nmm_colours colours;
    double low, high;           // range of the colours, SI
    double full_low, full_high; // range of a whole colour scale: wider for one-signed stress
    bool below, above;          // values beyond the range exist
    double *value;              // [n_element] at the element's middle
    double *slope;              // [n_element][2] change of the value by page x and y, or NULL
} nmm_shade;

/// Chosen field for `asked` NULL; NMM_ERROR_INPUT: unknown name, or not in the file.
nmm_status nmm_shade_name(nmm_file *file, const nmm_file_frame *frame,
                          const nmm_file_geometry *geometry, const char *asked, const char **name);
/// Values and range. `page` [n_point][2]: page places of the points, for the slopes.
nmm_status nmm_shade_make(nmm_file *file, const nmm_file_frame *frame,
                          const nmm_file_geometry *geometry, const char *name, nmm_shade *shade);
void nmm_shade_slopes(const nmm_file_frame *frame, const nmm_file_geometry *geometry,
                      const double *page, nmm_shade *shade);

// --- Scales

/// Ticks first, first + step, ... (n of them) inside [low, high]; step is 1, 2 or 5 times a power
/// of ten.
typedef struct nmm_ticks {
    double first, step;
    int n;
} nmm_ticks;
nmm_ticks nmm_ticks_of(double low, double high, int at_most);
/// The text of a tick: as many decimals as the step needs.
const char *nmm_tick_text(char text[32], double value, double step);

// --- The page

typedef struct nmm_rect {
    double x, y, width, height; // page; y points down
} nmm_rect;

/// What a load is given as.
typedef enum nmm_load_kind { NMM_LOAD_TRACTION, NMM_LOAD_FORCE } nmm_load_kind;
enum { NMM_LOAD_KINDS = 2 };

/// A load at the frame's time.
typedef struct nmm_arrow {
    nmm_load_kind kind;
    int row;        // of the file's loads: the first one that it shows
    double x, y;    // [m] reference place
    nmm_vec2 value; // [N] or [Pa]
} nmm_arrow;

typedef struct nmm_picture {
    nmm_file *file;
    const nmm_file_geometry *geometry;
    nmm_file_frame frame;
    nmm_shade shade;
    double scale; // factor on displacements
    double *page; // [n_point][2] page places of the deformed points
    nmm_box box;  // [m] what the axes show
    cairo_t *cairo;
    double unit;          // page units of one unit of design (1/1600 of the width)
    double width, height; // of the page
    nmm_rect plot, bar;   // inside of the axes; colour bar
    bool bar_upright;
    nmm_rect legend; // its first line
    nmm_ticks tick_x, tick_y, tick_bar;
    double ratio;      // page units of a metre
    double force_most; // [N] largest contact force of the frame
    int *edge_state;   // [n_edge] nmm_edge_state
    int n_open, n_slid, n_force;
    int n_arrow;
    nmm_arrow *arrow;                    // [n_arrow] tractions, then forces; none of them zero
    double load_largest[NMM_LOAD_KINDS]; // of this frame
    double load_peak[NMM_LOAD_KINDS];    // of one load in any frame
    bool load_summed[NMM_LOAD_KINDS];    // an arrow shows the sum of several
    char title[256], subtitle[256];
} nmm_picture;

typedef enum nmm_edge_state { NMM_EDGE_PLAIN, NMM_EDGE_OPEN, NMM_EDGE_SLID } nmm_edge_state;

/// Sizes of everything on the page, page->cairo being any surface to measure text on.
void nmm_layout_make(nmm_picture *picture, double width);
/// Page place of a scene place.
nmm_vec2 nmm_layout_place(const nmm_picture *picture, double x, double y);

/// The arrows of the frame's loads into the picture; `side` [m] is the size of the scene.
nmm_status nmm_loads_gather(nmm_picture *picture, double side);

void nmm_draw_page(nmm_picture *picture);
void nmm_draw_blocks(const nmm_picture *picture);
void nmm_draw_marks(const nmm_picture *picture);
void nmm_draw_loads(const nmm_picture *picture);
/// An arrow with its tip at `tip`, along a unit vector (page, y down).
void nmm_draw_arrow(cairo_t *cairo, nmm_vec2 tip, nmm_vec2 along, double length, double width);
/// Width of its line, in units of design.
double nmm_load_width(nmm_load_kind kind);
/// The path in `colour` on a white line, so that it shows on every ground.
void nmm_draw_cased(cairo_t *cairo, nmm_colour colour, double width, double casing);
/// Page place of a reference place in an element (-1: the place itself).
nmm_vec2 nmm_moved_place(const nmm_picture *picture, int element, double x, double y);

/// Text with its anchor at (x, y): across -1 left, 0 centre, 1 right; up 0 baseline, 1 middle,
/// 2 top.
typedef struct nmm_text_style {
    double size; // page units
    bool bold;
    double across;
    int up;
    bool upright; // turned by 90 degrees, reading upwards
} nmm_text_style;
void nmm_draw_text(cairo_t *cairo, double x, double y, const char *text, nmm_text_style style);
double nmm_text_width(cairo_t *cairo, const char *text, double size, bool bold);

/// One row of the legend, laid out from left to right; returns the lines it needs.
int nmm_draw_legend(const nmm_picture *picture, bool draw);

// --- Files

typedef enum nmm_kind { NMM_KIND_PNG, NMM_KIND_SVG, NMM_KIND_PDF } nmm_kind;
/// NMM_ERROR_ARGUMENT with the known endings in the message.
nmm_status nmm_kind_of(nmm_context *context, const char *path, nmm_kind *kind);

/// Anything drawn on one page, in page units (pixels of a PNG).
typedef struct nmm_page {
    nmm_context *context;
    void *user;
    void (*draw)(void *user, cairo_t *cairo);
    double width, height;
} nmm_page;
/// Call `measure` with a surface that only measures text, to lay out what page->user holds.
nmm_status nmm_page_measure(const nmm_page *page, void (*measure)(void *user, cairo_t *cairo));
/// Draw and write the page.
nmm_status nmm_page_write(const nmm_page *page, const char *path, nmm_kind kind);

/// An image in memory, rows from the top; a pixel is 0x..RRGGBB.
typedef struct nmm_pixels {
    const uint32_t *pixel;
    int width, height;
    size_t stride; // pixels from row to row
} nmm_pixels;
/// Into `file` as a PNG with at most 256 colours.
nmm_status nmm_png_write(nmm_context *context, const nmm_pixels *image, nmm_replacement *file);

/// Lay out, draw and write the picture.
nmm_status nmm_surface_write(nmm_picture *picture, const char *path, nmm_kind kind, double width);

#endif
