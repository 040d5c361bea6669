// SPDX-License-Identifier: MIT
//
// Export for viewers that do not read temporal VTKHDF (ParaView before 5.12): a .pvd that lists one
// .vtu for each frame, and the same for the contacts with .vtp.
//
// Arrays stand in the files as base64, byte count in front: appended raw data is refused by some
// XML parsers. Numbers are those of the run file, single precision where it has single precision.

#include "file.h"

#include <errno.h>
#include <string.h>
#include <sys/stat.h>

// --- Base64

// Bytes that wait for a group of three.
typedef struct base64 {
    nmm_replacement *file;
    unsigned char held[3];
    int n_held;
    char text[1024];
    int n_text;
} base64;

static void put_group(base64 *b, int n) {
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const unsigned bits = (unsigned)b->held[0] << 16 | (unsigned)b->held[1] << 8 | b->held[2];
    if (b->n_text + 4 > (int)sizeof b->text) {
        nmm_replacement_write(b->file, b->text, (size_t)b->n_text);
        b->n_text = 0;
    }
    for (int i = 0; i < 4; i++)
        b->text[b->n_text++] = i <= n ? digit[bits >> (18 - 6 * i) & 63] : '=';
    memset(b->held, 0, sizeof b->held);
    b->n_held = 0;
}

static void put_bytes(base64 *b, const void *bytes, size_t size) {
    const unsigned char *byte = bytes;
    for (size_t i = 0; i < size; i++) {
        b->held[b->n_held++] = byte[i];
        if (b->n_held == 3) put_group(b, 3);
    }
}

static void finish_bytes(base64 *b) {
    if (b->n_held > 0) put_group(b, b->n_held);
    nmm_replacement_write(b->file, b->text, (size_t)b->n_text);
}

// --- Arrays

typedef enum number { FLOAT32, FLOAT64, INT32, INT64, UINT8 } number;

// `width` numbers a row; the source is doubles or ints with `stride` bytes between the rows.
typedef struct array_source {
    const char *name;
    number number;
    int width;
    long n;
    const void *data;
    size_t stride;
    int given;  // numbers a row has in the source; the others are 0
    bool whole; // ints, not doubles
} array_source;

static void put_number(base64 *b, number kind, double x) {
    const float f = (float)x;
    const int32_t i = kind == INT32 ? (int32_t)x : 0;
    const int64_t l = kind == INT64 ? (int64_t)x : 0;
    const uint8_t u = kind == UINT8 ? (uint8_t)x : 0;
    switch (kind) {
    case FLOAT32:
        put_bytes(b, &f, sizeof f);
        return;
    case FLOAT64:
        put_bytes(b, &x, sizeof x);
        return;
    case INT32:
        put_bytes(b, &i, sizeof i);
        return;
    case INT64:
        put_bytes(b, &l, sizeof l);
        return;
    case UINT8:
        put_bytes(b, &u, sizeof u);
        return;
    }
}

static double source_value(const array_source *source, long row, int k) {
    if (k >= source->given) return 0;
    const char *at = (const char *)source->data + (size_t)row * source->stride;
    if (source->whole) {
        int value = 0;
        memcpy(&value, at + (size_t)k * sizeof value, sizeof value);
        return value;
    }
    double value = 0;
    memcpy(&value, at + (size_t)k * sizeof value, sizeof value);
    return value;
}

static void put_array(nmm_replacement *file, const array_source *source) {
    static const struct {
        const char *name;
        size_t size;
    } kind[] = {[FLOAT32] = {"Float32", 4},
                [FLOAT64] = {"Float64", 8},
                [INT32] = {"Int32", 4},
                [INT64] = {"Int64", 8},
                [UINT8] = {"UInt8", 1}};
    const uint64_t size = (uint64_t)source->n * (uint64_t)source->width * kind[source->number].size;
    nmm_replacement_print(file,
                          "<DataArray type=\"%s\" Name=\"%s\" NumberOfComponents=\"%d\" "
                          "format=\"binary\">\n",
                          kind[source->number].name, source->name, source->width);
    base64 b = {.file = file};
    put_bytes(&b, &size, sizeof size);
    for (long i = 0; i < source->n; i++) {
        for (int k = 0; k < source->width; k++)
            put_number(&b, source->number, source_value(source, i, k));
    }
    finish_bytes(&b);
    nmm_replacement_print(file, "\n</DataArray>\n");
}

static void put_vector(nmm_replacement *file, const char *name, number kind, int n,
                       const double *xy) {
    if (n > 0 && xy == NULL) return;
    put_array(file, &(array_source){name, kind, 3, n, xy, 2 * sizeof *xy, 2, false});
}

static void put_index(nmm_replacement *file, const char *name, number kind, int n,
                      const int *index) {
    put_array(file, &(array_source){name, kind, 1, n, index, sizeof *index, 1, true});
}

// --- Files

static void put_head(nmm_replacement *file, const char *type) {
    const uint16_t probe = 1;
    unsigned char first = 0;
    memcpy(&first, &probe, 1);
    nmm_replacement_print(file,
                          "<?xml version=\"1.0\"?>\n<VTKFile type=\"%s\" version=\"1.0\" "
                          "byte_order=\"%s\" header_type=\"UInt64\">\n",
                          type, first == 1 ? "LittleEndian" : "BigEndian");
}

static void put_grid(nmm_replacement *file, const nmm_file_geometry *g,
                     const nmm_file_frame *frame) {
    put_head(file, "UnstructuredGrid");
    nmm_replacement_print(file,
                          "<UnstructuredGrid>\n<Piece NumberOfPoints=\"%d\" "
                          "NumberOfCells=\"%d\">\n<PointData>\n",
                          g->n_point, g->n_element);
    if (frame->displacement != NULL)
        put_vector(file, "displacement", FLOAT32, g->n_point, frame->displacement);
    if (frame->velocity != NULL) put_vector(file, "velocity", FLOAT32, g->n_point, frame->velocity);
    nmm_replacement_print(file, "</PointData>\n<CellData>\n");
    put_index(file, "block_id", INT32, g->n_element, g->element_block);
    put_index(file, "material", INT32, g->n_element, g->element_material);
    if (frame->stress != NULL) {
        put_array(file, &(array_source){"stress", FLOAT32, 6, g->n_element, frame->stress,
                                        6 * sizeof(double), 6, false});
    }
    nmm_replacement_print(file, "</CellData>\n<Points>\n");
    put_vector(file, "Points", FLOAT64, g->n_point, g->point);
    nmm_replacement_print(file, "</Points>\n<Cells>\n");
    put_index(file, "connectivity", INT64, g->n_corner, g->corner_point);
    // Ends of the cells, without the zero in front; every cell is a polygon.
    put_index(file, "offsets", INT64, g->n_element, g->element_start + 1);
    const int polygon = NMM_VTK_POLYGON;
    put_array(file, &(array_source){"types", UINT8, 1, g->n_element, &polygon, 0, 1, true});
    nmm_replacement_print(file, "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
}

// Places and vectors of the contacts are pairs inside the struct.
static void put_contact(nmm_replacement *file, const char *name, number kind, int width,
                        const nmm_file_frame *frame, const void *first) {
    const bool whole = kind == INT32;
    put_array(file, &(array_source){name, kind, width, frame->n_contact, first,
                                    sizeof(nmm_file_contact), width == 3 ? 2 : 1, whole});
}

static void put_contacts(nmm_replacement *file, const nmm_file_frame *frame, const int *sequence) {
    static const nmm_file_contact none;
    const nmm_file_contact *c = frame->n_contact > 0 ? frame->contact : &none;
    put_head(file, "PolyData");
    nmm_replacement_print(file,
                          "<PolyData>\n<Piece NumberOfPoints=\"%d\" NumberOfVerts=\"%d\">\n"
                          "<PointData>\n",
                          frame->n_contact, frame->n_contact);
    put_contact(file, "force", FLOAT32, 3, frame, c->force);
    put_contact(file, "normal", FLOAT32, 3, frame, c->normal);
    put_contact(file, "normal_force", FLOAT32, 1, frame, &c->normal_force);
    put_contact(file, "shear_force", FLOAT32, 1, frame, &c->shear_force);
    put_contact(file, "gap", FLOAT32, 1, frame, &c->gap);
    put_contact(file, "slid", FLOAT32, 1, frame, &c->slid);
    put_contact(file, "vertex_block", INT32, 1, frame, &c->vertex_block);
    put_contact(file, "edge_block", INT32, 1, frame, &c->edge_block);
    put_contact(file, "mode", INT32, 1, frame, &c->mode);
    put_contact(file, "joint", INT32, 1, frame, &c->joint);
    nmm_replacement_print(file, "</PointData>\n<Points>\n");
    put_contact(file, "Points", FLOAT64, 3, frame, c->place);
    nmm_replacement_print(file, "</Points>\n<Verts>\n");
    put_index(file, "connectivity", INT64, frame->n_contact, sequence);
    put_index(file, "offsets", INT64, frame->n_contact, sequence + 1);
    nmm_replacement_print(file, "</Verts>\n</Piece>\n</PolyData>\n</VTKFile>\n");
}

// --- Export

typedef struct export {
    nmm_file *file;
    const nmm_file_geometry *geometry;
    const char *folder;
    char stem[200]; // file names start with it
    char *path;     // scratch
    size_t room;
    int *sequence; // 0, 1, 2, ... for the contacts
    int capacity;
}
export;

static const char *path_of(export *e, const char *middle, int frame, const char *ending) {
    if (frame < 0)
        snprintf(e->path, e->room, "%s/%s%s%s", e->folder, e->stem, middle, ending);
    else
        snprintf(e->path, e->room, "%s/%s%s_%05d%s", e->folder, e->stem, middle, frame, ending);
    return e->path;
}

static nmm_status write_frame(export *e, int k, const nmm_file_frame *frame) {
    nmm_context *context = &e->file->context;
    nmm_replacement out = {0};
    nmm_status status = nmm_replacement_open(context, &out, path_of(e, "", k, ".vtu"));
    if (status == NMM_OK) {
        put_grid(&out, e->geometry, frame);
        status = nmm_replacement_commit(&out);
    }
    nmm_replacement_drop(&out);
    if (status != NMM_OK || !frame->has_contact) return status;
    TRY(nmm_grow(context, &e->sequence, &e->capacity, frame->n_contact + 1, sizeof *e->sequence));
    for (int i = 0; i <= frame->n_contact; i++)
        e->sequence[i] = i;
    status = nmm_replacement_open(context, &out, path_of(e, "_contacts", k, ".vtp"));
    if (status == NMM_OK) {
        put_contacts(&out, frame, e->sequence);
        status = nmm_replacement_commit(&out);
    }
    nmm_replacement_drop(&out);
    return status;
}

// Characters that XML keeps for itself.
static void print_escaped(nmm_replacement *out, const char *text) {
    for (const char *c = text; *c != 0; c++) {
        const char *as = *c == '&' ? "&amp;" : *c == '<' ? "&lt;" : *c == '"' ? "&quot;" : NULL;
        if (as != NULL)
            nmm_replacement_print(out, "%s", as);
        else
            nmm_replacement_write(out, c, 1);
    }
}

// The list of frames is written last: it names only files that are there.
static nmm_status write_list(export *e, const char *middle, const char *ending) {
    char time[32];
    nmm_replacement out = {0};
    nmm_status status =
        nmm_replacement_open(&e->file->context, &out, path_of(e, middle, -1, ".pvd"));
    if (status == NMM_OK) {
        put_head(&out, "Collection");
        nmm_replacement_print(&out, "<Collection>\n");
        for (int k = 0; k < e->file->n_frame; k++) {
            nmm_replacement_print(&out, "<DataSet timestep=\"%s\" part=\"0\" file=\"",
                                  nmm_number_text(time, e->file->time[k]));
            print_escaped(&out, e->stem);
            nmm_replacement_print(&out, "%s_%05d%s\"/>\n", middle, k, ending);
        }
        nmm_replacement_print(&out, "</Collection>\n</VTKFile>\n");
        status = nmm_replacement_commit(&out);
    }
    nmm_replacement_drop(&out);
    return status;
}

static nmm_status make_folder(nmm_context *context, const char *folder) {
    struct stat about;
    if (mkdir(folder, 0777) == 0) return NMM_OK;
    const int error = errno;
    if (error == EEXIST && stat(folder, &about) == 0 && S_ISDIR(about.st_mode)) return NMM_OK;
    return nmm_fail(context, NMM_ERROR_FILE, "cannot make the folder %s: %s", folder,
                    strerror(error == EEXIST ? ENOTDIR : error));
}

static nmm_status write_all(export *e) {
    nmm_context *context = &e->file->context;
    TRY(nmm_file_geometry_read(e->file, &e->geometry));
    TRY(make_folder(context, e->folder));
    e->room = strlen(e->folder) + sizeof e->stem + 64;
    TRY(nmm_allocate(context, &e->path, e->room, 1));
    for (int k = 0; k < e->file->n_frame; k++) {
        nmm_file_frame frame = {0};
        nmm_status status = nmm_file_frame_read(e->file, k, &frame);
        if (status == NMM_OK) status = write_frame(e, k, &frame);
        nmm_file_frame_destroy(e->file, &frame);
        TRY(status);
    }
    TRY(write_list(e, "", ".vtu"));
    return e->file->contact ? write_list(e, "_contacts", ".vtp") : NMM_OK;
}

nmm_status nmm_file_export_vtu(nmm_file *file, const char *folder) {
    export e = {.file = file, .folder = folder};
    const char *slash = strrchr(file->path, '/');
    const char *base = slash != NULL ? slash + 1 : file->path;
    const char *dot = strrchr(base, '.');
    const int length = dot != NULL && dot > base ? (int)(dot - base) : (int)strlen(base);
    snprintf(e.stem, sizeof e.stem, "%.*s", nmm_min_int(length, 190), base);
    const nmm_status status = write_all(&e);
    nmm_release(&file->context, &e.path);
    nmm_release(&file->context, &e.sequence);
    return status;
}
