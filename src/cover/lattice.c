// SPDX-License-Identifier: MIT
//
// Origin, spacing and mesh of a scene, and the linear weight functions of the mesh. The spacing is
// a power of two, so that going between integers and metres loses nothing; it is about 2^-39 of the
// scene's size, but not finer than the coordinates themselves can be. What is nearer than about
// 2^-28 of the scene's size is one thing.

#include "lattice.h"

#include <math.h>

// Integer coordinates of the scene and its surroundings span at most 2^41.
#define SPAN_BITS 41
// Welding reaches this far at least [spacing]; a side is this much longer.
#define SMALLEST_REACH 8
#define SMALLEST_RATIO 16384
#define LARGEST_RATIO 1000.0
#define MOST_ELEMENTS 8e6

// --- Box and area

static nmm_status check_corners(nmm_context *context, nmm_scene *scene, int n,
                                const nmm_vec2 *corner, nmm_mark mark) {
    for (int i = 0; i < n; i++) {
        if (isfinite(corner[i].x) && isfinite(corner[i].y)) continue;
        return nmm_scene_reject(context, scene, mark,
                                "corner %d is (%g, %g), but coordinates must be finite numbers",
                                i + 1, corner[i].x, corner[i].y);
    }
    return NMM_OK;
}

static nmm_status check_finite(nmm_context *context, nmm_scene *scene) {
    const nmm_scene_area *area[] = {scene->domain, scene->hole, scene->region};
    const int n_area[] = {scene->n_domain, scene->n_hole, scene->n_region};
    for (int kind = 0; kind < 3; kind++) {
        for (int k = 0; k < n_area[kind]; k++) {
            const nmm_scene_area *a = &area[kind][k];
            TRY(check_corners(context, scene, a->n, a->corner, a->mark));
        }
    }
    for (int k = 0; k < scene->n_block; k++) {
        const nmm_scene_area *a = &scene->block[k].area;
        TRY(check_corners(context, scene, a->n, a->corner, a->mark));
    }
    for (int k = 0; k < scene->n_joint; k++) {
        const nmm_scene_joint *j = &scene->joint[k];
        TRY(check_corners(context, scene, j->n, j->corner, j->mark));
    }
    return NMM_OK;
}

static void include_area(nmm_lattice *lattice, const nmm_scene_area *area) {
    nmm_vec2 *low = &lattice->box.low, *high = &lattice->box.high;
    for (int i = 0; i < area->n; i++) {
        low->x = nmm_min(low->x, area->corner[i].x);
        low->y = nmm_min(low->y, area->corner[i].y);
        high->x = nmm_max(high->x, area->corner[i].x);
        high->y = nmm_max(high->y, area->corner[i].y);
    }
    lattice->area += fabs(nmm_polygon_moments(area->n, area->corner).area);
}

static void measure_scene(const nmm_scene *scene, nmm_lattice *lattice) {
    *lattice = (nmm_lattice){0};
    lattice->box.low = (nmm_vec2){INFINITY, INFINITY};
    lattice->box.high = (nmm_vec2){-INFINITY, -INFINITY};
    for (int k = 0; k < scene->n_domain; k++)
        include_area(lattice, &scene->domain[k]);
    for (int k = 0; k < scene->n_block; k++)
        include_area(lattice, &scene->block[k].area);
}

// --- Choice of the lattices

// About twelve triangles along a square of the scene's area; a whole number of them along the box.
// Without triangles, where each block is one cover, the size of a body: what tolerances go by.
static double choose_size(const nmm_scene *scene, const nmm_lattice *lattice) {
    if (scene->settings.mesh == NMM_MESH_BLOCK) {
        return sqrt(lattice->area / (scene->n_domain + scene->n_block));
    }
    const double size = sqrt(lattice->area) / 12;
    const double width = lattice->box.high.x - lattice->box.low.x;
    return width > size ? width / floor(width / size + 0.5) : size;
}

// The power of two at or above x > 0.
static double power_above(double x) {
    int exponent = 0;
    const double fraction = frexp(x, &exponent);
    return ldexp(1, fraction == 0.5 ? exponent - 1 : exponent);
}

// What is left of `half` beyond the last of the lines at offset + k * period.
static int64_t remainder_of(int64_t half, int64_t offset, int64_t period) {
    return ((half - offset) % period + period) % period;
}

// Where a family of lines is put, so that what remains at both sides of a box of twice `half` is
// nothing or as thick as possible: slivers along straight sides are avoided.
static int64_t choose_offset(int64_t half, int64_t period) {
    const int64_t without = remainder_of(half, 0, period);
    const int64_t with = remainder_of(half, period / 2, period);
    if (without == 0) return 0;
    if (with == 0) return period / 2;
    return with > without ? period / 2 : 0;
}

// The integer point (0, 0) is the centre of the box.
static void place_mesh(nmm_lattice *lattice) {
    const int64_t side = lattice->side, rise = lattice->rise;
    const nmm_ipoint half = nmm_lattice_snap(lattice, lattice->box.high);
    // A box that fits into one triangle goes into the middle of it.
    const double above = (double)(2 * rise / 3 - half.y);
    const double room = (double)(side / 2) * above / (double)rise;
    if (half.y < rise / 3 - 2 && (double)half.x < room - 2) {
        lattice->base = (nmm_ipoint){-side / 2, -rise / 3};
        return;
    }
    lattice->base = (nmm_ipoint){choose_offset(half.x, side / 2), choose_offset(half.y, rise)};
}

static nmm_status check_size(nmm_context *context, nmm_scene *scene, const nmm_lattice *lattice,
                             double size) {
    const double width = lattice->box.high.x - lattice->box.low.x;
    const double height = lattice->box.high.y - lattice->box.low.y;
    const double larger = nmm_max(width, height);
    const nmm_mark mark = scene->settings.size_mark;
    if (!isfinite(size) || size < 0) {
        return nmm_scene_reject(context, scene, mark,
                                "covers.size is %g m, but must be a positive number", size);
    }
    if (size > LARGEST_RATIO * larger) {
        return nmm_scene_reject(
            context, scene, mark,
            "covers.size is %g m, more than %g times the size of the scene (%g m)", size,
            LARGEST_RATIO, larger);
    }
    const double n_element = lattice->area / (sqrt(3) / 4 * size * size);
    if (n_element > MOST_ELEMENTS) {
        return nmm_scene_reject(context, scene, mark,
                                "covers.size is %g m: this gives about %.0f elements, more than "
                                "%.0f; use at least %.3g m",
                                size, n_element, MOST_ELEMENTS,
                                size * sqrt(n_element / MOST_ELEMENTS));
    }
    return NMM_OK;
}

nmm_status nmm_lattice_choose(nmm_context *context, nmm_scene *scene, nmm_lattice *lattice) {
    const nmm_mark nowhere = {0};
    TRY(check_finite(context, scene));
    measure_scene(scene, lattice);
    if (scene->n_domain + scene->n_block == 0 || !(lattice->area > 0)) {
        return nmm_scene_reject(context, scene, nowhere,
                                "the scene holds no material: neither domain nor blocks");
    }
    const double chosen = scene->settings.cover_size;
    const double size = chosen == 0 ? choose_size(scene, lattice) : chosen;
    TRY(check_size(context, scene, lattice, size));

    // Room for the surroundings: joints reach beyond the box, triangles too.
    const nmm_vec2 low = lattice->box.low, high = lattice->box.high;
    const double extent = nmm_max(high.x - low.x, high.y - low.y);
    const double farthest =
        nmm_max(nmm_max(fabs(low.x), fabs(high.x)), nmm_max(fabs(low.y), fabs(high.y)));
    const double digit = ldexp(farthest, -51);
    lattice->origin = nmm_vec2_mix(low, high, 0.5);
    lattice->spacing = power_above(nmm_max(ldexp(1.25 * extent + 4 * size, -SPAN_BITS), digit));
    lattice->side = 2 * llround(size / (2 * lattice->spacing));
    lattice->rise = 2 * llround((double)lattice->side * sqrt(3) / 4);
    const double fine = nmm_min(ldexp(extent, -28), ldexp(size, -16));
    const double reach = nmm_max(fine, 8 * digit) / lattice->spacing;
    lattice->reach = reach > SMALLEST_REACH ? (int64_t)reach : SMALLEST_REACH;
    if (lattice->side < SMALLEST_RATIO * lattice->reach) {
        return nmm_scene_reject(context, scene, scene->settings.size_mark,
                                "covers.size is %g m, too small for a scene of %g m at "
                                "coordinates of %g m",
                                size, extent, farthest);
    }
    place_mesh(lattice);
    return NMM_OK;
}

// --- Places and weights

nmm_ipoint nmm_lattice_snap(const nmm_lattice *lattice, nmm_vec2 place) {
    const double x = (place.x - lattice->origin.x) / lattice->spacing;
    const double y = (place.y - lattice->origin.y) / lattice->spacing;
    return (nmm_ipoint){llround(x), llround(y)};
}

nmm_vec2 nmm_lattice_place(const nmm_lattice *lattice, nmm_ipoint p) {
    return (nmm_vec2){(double)p.x * lattice->spacing, (double)p.y * lattice->spacing};
}

nmm_ipoint nmm_lattice_node(const nmm_lattice *lattice, nmm_node node) {
    return (nmm_ipoint){
        lattice->base.x + node.i * lattice->side + node.j * (lattice->side / 2),
        lattice->base.y + node.j * lattice->rise,
    };
}

nmm_vec2 nmm_lattice_between(const nmm_lattice *lattice, nmm_node sixth) {
    // Six times the place is a whole number: at a node the division is exact.
    const int64_t x = 6 * lattice->base.x + sixth.i * lattice->side + sixth.j * (lattice->side / 2);
    const int64_t y = 6 * lattice->base.y + sixth.j * lattice->rise;
    return (nmm_vec2){(double)x / 6 * lattice->spacing, (double)y / 6 * lattice->spacing};
}

void nmm_triangle_nodes(nmm_triangle t, nmm_node node[3]) {
    node[0] = (nmm_node){t.i + t.down, t.j};
    node[1] = (nmm_node){t.i + 1, t.j + t.down};
    node[2] = (nmm_node){t.i, t.j + 1};
}

void nmm_lattice_weights(const nmm_lattice *lattice, nmm_triangle t, nmm_ipoint p,
                         double weight[3]) {
    const nmm_ipoint corner = nmm_lattice_node(lattice, (nmm_node){t.i, t.j + t.down});
    const double side = (double)lattice->side;
    const double y = (double)(p.y - corner.y) / (double)lattice->rise;
    const double x = (double)(p.x - corner.x) / side;
    if (t.down == 0) {
        // corner = node 0; node 1 to its right, node 2 above.
        weight[2] = y;
        weight[1] = x - y / 2;
        weight[0] = 1 - weight[1] - weight[2];
    } else {
        // corner = node 2; node 1 to its right, node 0 below.
        weight[0] = -y;
        weight[1] = x + y / 2;
        weight[2] = 1 - weight[0] - weight[1];
    }
}

void nmm_lattice_gradient(const nmm_lattice *lattice, nmm_triangle t, double gradient[6]) {
    const double across = 1 / ((double)lattice->side * lattice->spacing);
    const double up = 1 / ((double)lattice->rise * lattice->spacing);
    const double sign = t.down == 0 ? 1 : -1;
    // The node alone in its row, the one to the right and the one to the left of the other row.
    const int alone = t.down == 0 ? 2 : 0, left = t.down == 0 ? 0 : 2;
    gradient[2 * alone] = 0;
    gradient[2 * alone + 1] = sign * up;
    gradient[2] = across;
    gradient[3] = -sign * up / 2;
    gradient[2 * left] = -across;
    gradient[2 * left + 1] = -sign * up / 2;
}

nmm_isegment nmm_mesh_line_segment(const nmm_lattice *lattice, nmm_mesh_line line) {
    const nmm_node from = {line.i + (line.direction == 2), line.j};
    const nmm_node to = {line.i + (line.direction == 0), line.j + (line.direction != 0)};
    return (nmm_isegment){.a = nmm_lattice_node(lattice, from),
                          .b = nmm_lattice_node(lattice, to),
                          .family = NMM_FAMILY_MESH,
                          .rank = NMM_RANK_MESH};
}

nmm_triangle nmm_mesh_line_triangle(nmm_mesh_line line, int side) {
    const nmm_triangle up = {line.i, line.j, 0};
    switch (line.direction) {
    case 0:
        return side == 0 ? up : (nmm_triangle){line.i, line.j - 1, 1};
    case 1:
        return side == 0 ? (nmm_triangle){line.i - 1, line.j, 1} : up;
    default:
        return side == 0 ? up : (nmm_triangle){line.i, line.j, 1};
    }
}
