// SPDX-License-Identifier: MIT
//
// Scenes built in memory, cut and measured.

#include "stage.h"

#include <stdlib.h>

void stage_open(stage *s, double cover_size) {
    memset(s, 0, sizeof *s);
    s->context.n_thread = 1;
    s->scene.settings.cover_size = cover_size;
    nmm_context *context = &s->context;
    nmm_scene *scene = &s->scene;
    assert_int_equal(
        nmm_arena_take(context, &scene->arena, &scene->material, 3, sizeof *scene->material),
        NMM_OK);
    assert_int_equal(
        nmm_arena_take(context, &scene->arena, &scene->interface, 3, sizeof *scene->interface),
        NMM_OK);
    assert_int_equal(nmm_arena_take(context, &scene->arena, &scene->material_name, 3,
                                    sizeof *scene->material_name),
                     NMM_OK);
    scene->n_material = scene->n_interface = 3;
    for (int k = 0; k < 3; k++)
        scene->material_name[k] = "rock";
    for (int k = 0; k < 3; k++)
        scene->material[k] = (nmm_material){2500, 1e9, 0.25, NMM_PLANE_STRAIN};
}

void stage_forget(stage *s) {
    nmm_model_destroy(&s->context, &s->model);
}

void stage_close(stage *s) {
    nmm_context *context = &s->context;
    stage_forget(s);
    nmm_release(context, &s->scene.domain);
    nmm_release(context, &s->scene.hole);
    nmm_release(context, &s->scene.region);
    nmm_release(context, &s->scene.joint);
    nmm_release(context, &s->scene.block);
    nmm_arena_destroy(context, &s->scene.arena);
    assert_int_equal(context->n_live, 0);
}

static nmm_vec2 *copy_corners(stage *s, int n, const double *corner) {
    nmm_vec2 *copy = NULL;
    assert_int_equal(nmm_arena_take(&s->context, &s->scene.arena, &copy, (size_t)n, sizeof *copy),
                     NMM_OK);
    memcpy(copy, corner, (size_t)n * sizeof *copy);
    return copy;
}

static void add_area(stage *s, nmm_scene_area **list, int *n_list, int *room, nmm_scene_area area) {
    assert_int_equal(nmm_grow(&s->context, list, room, *n_list + 1, sizeof area), NMM_OK);
    (*list)[(*n_list)++] = area;
}

void stage_domain(stage *s, int n, const double *corner, int material) {
    nmm_scene *scene = &s->scene;
    const nmm_scene_area area = {
        .n = n, .corner = copy_corners(s, n, corner), .material = material};
    add_area(s, &scene->domain, &scene->n_domain, &s->domain_room, area);
}

void stage_hole(stage *s, int n, const double *corner) {
    nmm_scene *scene = &s->scene;
    const nmm_scene_area area = {.n = n, .corner = copy_corners(s, n, corner), .material = -1};
    add_area(s, &scene->hole, &scene->n_hole, &s->hole_room, area);
}

void stage_region(stage *s, int n, const double *corner, int material) {
    nmm_scene *scene = &s->scene;
    const nmm_scene_area area = {
        .n = n, .corner = copy_corners(s, n, corner), .material = material};
    add_area(s, &scene->region, &scene->n_region, &s->region_room, area);
}

void stage_joint(stage *s, int n, const double *corner, int interface) {
    nmm_scene *scene = &s->scene;
    assert_int_equal(nmm_grow(&s->context, &scene->joint, &s->joint_room, scene->n_joint + 1,
                              sizeof *scene->joint),
                     NMM_OK);
    scene->joint[scene->n_joint++] = (nmm_scene_joint){
        .n = n, .corner = copy_corners(s, n, corner), .interface = interface, .set = -1};
}

void stage_block(stage *s, int n, const double *corner, const char *name) {
    nmm_scene *scene = &s->scene;
    assert_int_equal(nmm_grow(&s->context, &scene->block, &s->block_room, scene->n_block + 1,
                              sizeof *scene->block),
                     NMM_OK);
    scene->block[scene->n_block++] =
        (nmm_scene_block){.name = name, .area = {.n = n, .corner = copy_corners(s, n, corner)}};
}

void stage_rectangle(stage *s, double x0, double y0, double x1, double y1) {
    stage_domain(s, 4, (double[]){x0, y0, x1, y0, x1, y1, x0, y1}, 0);
}

void stage_line(stage *s, double x0, double y0, double x1, double y1) {
    stage_joint(s, 2, (double[]){x0, y0, x1, y1}, 1);
}

void stage_build(stage *s) {
    nmm_context *context = &s->context;
    const nmm_status built = nmm_cover_build(context, &s->scene, &s->model, &s->report);
    if (built != NMM_OK) print_error("cutting: %s\n", context->error.message);
    assert_int_equal(built, NMM_OK);
    const nmm_status checked = nmm_cover_check(context, &s->model);
    if (checked != NMM_OK) print_error("check: %s\n", context->error.message);
    assert_int_equal(checked, NMM_OK);
}

// --- What does not depend on numbering

// Sums of hashes do not depend on the order in which things are visited.
static uint64_t hash_doubles(int n, const double *x) {
    return nmm_hash(NMM_HASH_START, x, (size_t)n * sizeof *x);
}

uint64_t stage_hash(const stage *s) {
    const nmm_model *m = &s->model;
    uint64_t sum = 0;
    for (int e = 0; e < m->n_element; e++) {
        sum += hash_doubles(1, &m->element_area[e]);
        sum += 3 * hash_doubles(2, &m->element_centre[2 * e]);
        for (int i = 0; i < 3; i++) {
            const int c = m->element_cover[3 * e + i];
            const double piece[] = {m->element_centre[2 * e], m->element_centre[2 * e + 1],
                                    m->cover_place[2 * c], m->cover_place[2 * c + 1],
                                    m->cover_start[c + 1] - m->cover_start[c]};
            sum += 5 * hash_doubles(5, piece);
        }
    }
    for (int p = 0; p < m->n_point; p++)
        sum += 7 * hash_doubles(2, &m->point[2 * p]);
    for (int v = 0; v < m->n_vertex; v++) {
        const double *p = m->point + 2 * m->vertex_point[v];
        const double *q = m->point + 2 * m->vertex_point[m->vertex_next[v]];
        const double edge[] = {p[0], p[1], q[0], q[1], m->edge_interface[v], m->edge_mate[v] < 0};
        sum += 11 * hash_doubles(6, edge);
    }
    return sum;
}

int stage_loops(const stage *s) {
    const nmm_model *m = &s->model;
    bool *seen = calloc((size_t)m->n_vertex, sizeof *seen);
    int n = 0;
    for (int v = 0; v < m->n_vertex; v++) {
        if (seen[v]) continue;
        n += 1;
        for (int w = v; !seen[w]; w = m->vertex_next[w])
            seen[w] = true;
    }
    free(seen);
    return n;
}

int stage_covers_at(const stage *s, double x, double y) {
    const nmm_model *m = &s->model;
    int nearest = -1, n = 0;
    double least = INFINITY;
    for (int c = 0; c < m->n_cover; c++) {
        const double d = hypot(m->cover_place[2 * c] - x, m->cover_place[2 * c + 1] - y);
        if (d < least) nearest = m->cover_node[c];
        least = fmin(least, d);
    }
    for (int c = 0; c < m->n_cover; c++)
        n += m->cover_node[c] == nearest;
    return n;
}
