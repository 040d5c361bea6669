// SPDX-License-Identifier: MIT
//
// The picture of one frame: reads it, chooses the field, marks the joints that opened or slid, and
// hands it to the layout and the drawing.

#include "view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

nmm_plot_def nmm_default_plot_def(void) {
    return (nmm_plot_def){.frame = -1};
}

// --- State of the joints

// Size of the scene [m]: slips below a part of it are not shown.
static double scene_side(const nmm_file_geometry *g) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (long i = 0; i < 2L * g->n_point; i++) {
        low[i % 2] = nmm_min(low[i % 2], g->point[i]);
        high[i % 2] = nmm_max(high[i % 2], g->point[i]);
    }
    return g->n_point > 0 ? nmm_max(high[0] - low[0], high[1] - low[1]) : 0;
}

// What the contacts say of a loop edge.
typedef struct tally {
    int face, ends; // closed contacts on it; closed contacts of its two ends
    bool slid;
} tally;

static void count_contacts(nmm_picture *picture, const int *edge_before, tally *edge) {
    const nmm_file_geometry *g = picture->geometry;
    const nmm_file_frame *frame = &picture->frame;
    const double least = 5e-5 * scene_side(g);
    for (int i = 0; i < frame->n_contact; i++) {
        const nmm_file_contact *c = &frame->contact[i];
        const double force = hypot(c->force[0], c->force[1]);
        picture->force_most = nmm_max(picture->force_most, force);
        if (c->mode == 0) continue;
        const int before = edge_before[g->edge_point[2 * c->vertex]];
        edge[c->edge].face += 1;
        edge[c->edge].slid |= c->slid > least;
        edge[c->vertex].ends += 1;
        edge[c->vertex].slid |= c->slid > least;
        if (before < 0) continue;
        edge[before].ends += 1;
        edge[before].slid |= c->slid > least;
    }
}

// How far the mate of a joint's edge went off: apart along the edge's outward normal, and along it.
typedef struct offset {
    double apart, along, length;
} offset;

static offset find_offset(const nmm_picture *picture, int i) {
    const nmm_file_geometry *g = picture->geometry;
    const double *d = picture->frame.displacement;
    const int p = g->edge_point[2 * i], q = g->edge_point[2 * i + 1], mate = g->edge_mate[i];
    const int r = g->edge_point[2 * mate], s = g->edge_point[2 * mate + 1];
    double along[2], off[2];
    for (int k = 0; k < 2; k++) {
        along[k] = g->point[2 * q + k] + d[2 * q + k] - g->point[2 * p + k] - d[2 * p + k];
        off[k] = (d[2 * r + k] + d[2 * s + k] - d[2 * p + k] - d[2 * q + k]) / 2;
    }
    const double length = hypot(along[0], along[1]);
    if (!(length > 0)) return (offset){0};
    const double tx = along[0] / length, ty = along[1] / length;
    return (offset){off[0] * ty - off[1] * tx, fabs(off[0] * tx + off[1] * ty), length};
}

// Joints by their two sides as long as they are opposite each other, all other edges by their
// contacts. What is less than 1/20000 of the scene is neither open nor slid.
static void judge_edges(nmm_picture *picture, const tally *edge) {
    const nmm_file_geometry *g = picture->geometry;
    const double least = 5e-5 * scene_side(g);
    for (int i = 0; i < g->n_edge; i++) {
        const bool closed = edge[i].face > 0 || edge[i].ends > 1;
        int state = closed && edge[i].slid ? NMM_EDGE_SLID : NMM_EDGE_PLAIN;
        if (g->edge_mate[i] >= 0 && picture->frame.displacement != NULL) {
            const offset off = find_offset(picture, i);
            const bool opposite = off.along < off.length;
            if (opposite ? off.apart > least : !closed)
                state = NMM_EDGE_OPEN;
            else if (off.along > least)
                state = NMM_EDGE_SLID;
        }
        picture->edge_state[i] = state;
        picture->n_open += state == NMM_EDGE_OPEN;
        picture->n_slid += state == NMM_EDGE_SLID;
    }
}

static nmm_status find_edge_states(nmm_picture *picture) {
    nmm_context *context = nmm_file_context(picture->file);
    const nmm_file_geometry *g = picture->geometry;
    int *edge_before = NULL;
    tally *edge = NULL;
    if (!picture->frame.has_contact) return NMM_OK;
    nmm_status status =
        nmm_allocate(context, &edge_before, (size_t)g->n_point, sizeof *edge_before);
    if (status == NMM_OK) status = nmm_allocate(context, &edge, (size_t)g->n_edge, sizeof *edge);
    if (status == NMM_OK) {
        for (int p = 0; p < g->n_point; p++)
            edge_before[p] = -1;
        for (int i = 0; i < g->n_edge; i++)
            edge_before[g->edge_point[2 * i + 1]] = i;
        count_contacts(picture, edge_before, edge);
        judge_edges(picture, edge);
    }
    nmm_release(context, &edge);
    nmm_release(context, &edge_before);
    return status;
}

// --- Titles

// Bytes of the character at `c`; 0: none that may be shown, or no UTF-8.
static int character_size(const unsigned char *c) {
    if (c[0] < 0x80) return c[0] >= ' ' ? 1 : 0;
    const int size = c[0] >= 0xf0 ? 4 : c[0] >= 0xe0 ? 3 : 2;
    if (c[0] < 0xc2 || c[0] > 0xf4) return 0;
    for (int i = 1; i < size; i++) {
        if ((c[i] & 0xc0) != 0x80) return 0;
    }
    // Overlong forms, surrogates, beyond the last code point.
    const unsigned start = (unsigned)c[0] << 8 | c[1];
    const bool wrong = (start >= 0xe000 && start < 0xe0a0) || (start >= 0xeda0 && start < 0xee00) ||
                       (start >= 0xf000 && start < 0xf090) || start >= 0xf490;
    return wrong ? 0 : size;
}

// Cairo refuses text that is not UTF-8: other bytes become question marks.
static void clean_text(char *text) {
    for (unsigned char *c = (unsigned char *)text; *c != 0;) {
        const int size = character_size(c);
        if (size == 0) *c = '?';
        c += size > 0 ? size : 1;
    }
}

// Five significant digits.
static double round_digits(double x) {
    char text[32];
    snprintf(text, sizeof text, "%.4e", x);
    return strtod(text, NULL);
}

static void write_titles(nmm_picture *picture) {
    const nmm_file_frame *frame = &picture->frame;
    char when[64] = "static", scale[64];
    snprintf(picture->title, sizeof picture->title, "%.250s", nmm_file_title(picture->file));
    // A cut in the middle of a character is mended too.
    clean_text(picture->title);
    char text[32];
    if (!nmm_file_is_static(picture->file))
        snprintf(when, sizeof when, "t = %s s", nmm_number_text(text, round_digits(frame->time)));
    if (frame->displacement == NULL)
        snprintf(scale, sizeof scale, "reference shape");
    else if (picture->scale == 1)
        snprintf(scale, sizeof scale, "displacements true to scale");
    else
        snprintf(scale, sizeof scale, "displacements \xc3\x97 %s",
                 nmm_number_text(text, picture->scale));
    snprintf(picture->subtitle, sizeof picture->subtitle, "%s,  frame %d of %d,  %s", when,
             frame->index, nmm_file_frames(picture->file) - 1, scale);
}

// --- The picture

static nmm_status draw(nmm_picture *picture, const char *path, const nmm_plot_def *def) {
    nmm_context *context = nmm_file_context(picture->file);
    nmm_file *file = picture->file;
    const int last = nmm_file_frames(file) - 1;
    const char *field = NULL;
    nmm_kind kind = NMM_KIND_PNG;
    TRY(nmm_kind_of(context, path, &kind));
    const int width = def->width == 0 ? 1600 : def->width;
    if (width < 200 || width > 16000 || !isfinite(def->scale) || def->scale < 0) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT,
                        "plot: width must be 200 to 16000 and scale at least 0");
    }
    TRY(nmm_file_frame_read(file, def->frame < 0 ? last : def->frame, &picture->frame));
    TRY(nmm_file_geometry_read(file, &picture->geometry));
    const nmm_file_geometry *g = picture->geometry;
    picture->scale = def->scale > 0 ? def->scale : 1;
    TRY(nmm_allocate(context, &picture->page, (size_t)g->n_point * 2, sizeof *picture->page));
    TRY(nmm_allocate(context, &picture->edge_state, (size_t)g->n_edge,
                     sizeof *picture->edge_state));
    TRY(find_edge_states(picture));
    TRY(nmm_loads_gather(picture, scene_side(g)));
    TRY(nmm_shade_name(file, &picture->frame, g, def->field, &field));
    TRY(nmm_shade_make(file, &picture->frame, g, field, &picture->shade));
    write_titles(picture);
    return nmm_surface_write(picture, path, kind, width);
}

nmm_status nmm_file_plot(nmm_file *file, const char *path, const nmm_plot_def *def) {
    nmm_context *context = nmm_file_context(file);
    nmm_picture picture = {.file = file};
    const nmm_status status = draw(&picture, path, def);
    nmm_file_frame_destroy(file, &picture.frame);
    nmm_release(context, &picture.page);
    nmm_release(context, &picture.edge_state);
    nmm_release(context, &picture.arrow);
    nmm_release(context, &picture.shade.value);
    nmm_release(context, &picture.shade.slope);
    return status;
}
