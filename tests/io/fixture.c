// SPDX-License-Identifier: MIT
//
// The fixture, and stand-ins for the few functions of the step floor that the writer calls.

#include "fixture.h"

#include <assert.h>
#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char scene_text[] = "nmm: 1\ntitle: Two blocks on a bench, \xc3\xa9tude\n# the rest "
                                 "of the scene is the fixture's\n";

#define MUST(call) must((call), #call)
static void must(nmm_status status, const char *what) {
    if (status == NMM_OK) return;
    fprintf(stderr, "fixture: %s failed with %d\n", what, (int)status);
    abort();
}

// --- Stand-ins

void nmm_sim_summary(nmm_sim *sim, nmm_summary *summary) {
    *summary = sim->summary;
    summary->steps = sim->state.step;
    summary->time = sim->state.time;
    summary->blocks = sim->model.n_block;
    summary->elements = sim->model.n_element;
    summary->covers = sim->model.n_cover;
    summary->unknowns = 2 * sim->model.n_cover;
    summary->contacts = sim->state.n_contact;
    summary->state_hash = nmm_state_hash(&sim->model, &sim->state);
}

nmm_status nmm_sim_monitor(const nmm_sim *sim, int k, nmm_reading *reading) {
    const nmm_monitor *monitor = &sim->model.monitor[k];
    *reading = (nmm_reading){.name = monitor->name,
                             .has_displacement = monitor->displacement,
                             .has_velocity = monitor->velocity,
                             .has_stress = monitor->stress};
    for (int i = 0; i < 2; i++) {
        if (monitor->displacement) reading->displacement[i] = sim->state.displacement[i];
        if (monitor->velocity) reading->velocity[i] = sim->state.velocity[i];
    }
    for (int i = 0; i < 3; i++) {
        if (monitor->stress) reading->stress[i] = sim->state.stress[i];
    }
    return NMM_OK;
}

// --- Model

// Weights of the affine triangle a, b, c and its gradients.
static void set_element(nmm_model *m, int e, const int cover[3], const nmm_vec2 corner[3]) {
    const nmm_vec2 ab = nmm_vec2_sub(corner[1], corner[0]), ac = nmm_vec2_sub(corner[2], corner[0]);
    const double det = nmm_vec2_cross(ab, ac);
    double *g = m->element_gradient + 6 * (long)e;
    for (int i = 0; i < 3; i++) {
        const nmm_vec2 p = corner[(i + 1) % 3], q = corner[(i + 2) % 3];
        g[2 * i] = (p.y - q.y) / det;
        g[2 * i + 1] = (q.x - p.x) / det;
        m->element_cover[3 * e + i] = cover[i];
    }
}

// Area, centroid and the weights there, from the element's polygon.
static void finish_element(nmm_model *m, int e, nmm_vec2 first) {
    nmm_vec2 corner[16];
    const int begin = m->element_start[e], n = m->element_start[e + 1] - begin;
    assert(n <= 16);
    for (int k = 0; k < n; k++) {
        const double *p = m->point + 2 * (long)m->corner_point[begin + k];
        corner[k] = (nmm_vec2){p[0], p[1]};
    }
    const nmm_moments moments = nmm_polygon_moments(n, corner);
    m->element_area[e] = moments.area;
    m->element_centre[2 * e] = moments.centre.x;
    m->element_centre[2 * e + 1] = moments.centre.y;
    const nmm_vec2 off = nmm_vec2_sub(moments.centre, first);
    const double *g = m->element_gradient + 6 * (long)e;
    for (int i = 0; i < 3; i++)
        m->element_weight[3 * e + i] = (i == 0) + g[2 * i] * off.x + g[2 * i + 1] * off.y;
}

static int node_of(int nx, int i, int j) {
    return j * (nx + 1) + i;
}

// The large block: [0,8] x [-2,0] in nx * ny cells.
static void make_bench(nmm_model *m, int nx, int ny) {
    for (int j = 0; j <= ny; j++) {
        for (int i = 0; i <= nx; i++) {
            double *p = m->point + 2 * (long)node_of(nx, i, j);
            p[0] = 8.0 * i / nx;
            p[1] = -2.0 + 2.0 * j / ny;
        }
    }
    int e = 0;
    for (int j = 0; j < ny; j++) {
        for (int i = 0; i < nx; i++) {
            const int a = node_of(nx, i, j), b = node_of(nx, i + 1, j);
            const int c = node_of(nx, i + 1, j + 1), d = node_of(nx, i, j + 1);
            const int triangle[2][3] = {{a, b, c}, {a, c, d}};
            for (int t = 0; t < 2; t++, e++) {
                nmm_vec2 corner[3];
                for (int k = 0; k < 3; k++) {
                    const double *p = m->point + 2 * (long)triangle[t][k];
                    corner[k] = (nmm_vec2){p[0], p[1]};
                    m->corner_point[3 * e + k] = triangle[t][k];
                    m->point_element[triangle[t][k]] = e;
                    for (int w = 0; w < 3; w++)
                        m->point_weight[3 * triangle[t][k] + w] = w == k;
                }
                m->element_start[e + 1] = 3 * (e + 1);
                set_element(m, e, triangle[t], corner);
                finish_element(m, e, corner[0]);
            }
        }
    }
}

// A loose block of one polygon, with covers of its own.
static void make_loose(nmm_model *m, int block, int e, int n, const nmm_vec2 *corner) {
    const int start = m->element_start[e], p0 = m->n_point, c0 = m->n_cover;
    const nmm_vec2 frame[3] = {
        corner[0], {corner[0].x + 2, corner[0].y}, {corner[0].x, corner[0].y + 2}};
    const int cover[3] = {c0, c0 + 1, c0 + 2};
    set_element(m, e, cover, frame);
    for (int k = 0; k < n; k++) {
        m->point[2 * (p0 + k)] = corner[k].x;
        m->point[2 * (p0 + k) + 1] = corner[k].y;
        m->corner_point[start + k] = p0 + k;
        m->point_element[p0 + k] = e;
    }
    m->element_start[e + 1] = start + n;
    m->element_block[e] = block;
    m->element_material[e] = 1;
    finish_element(m, e, corner[0]);
    for (int k = 0; k < n; k++)
        nmm_element_weights(m, e, corner[k], m->point_weight + 3 * (long)(p0 + k));
    for (int i = 0; i < 3; i++)
        m->cover_block[c0 + i] = block;
    m->n_point += n;
    m->n_cover += 3;
}

// The outline of `n` points in order.
static void make_loop(nmm_model *m, int block, int n, const int *point) {
    const int v0 = m->n_vertex;
    for (int k = 0; k < n; k++) {
        m->vertex_point[v0 + k] = point[k];
        m->vertex_next[v0 + k] = v0 + (k + 1) % n;
        m->vertex_prev[v0 + k] = v0 + (k + n - 1) % n;
        m->vertex_block[v0 + k] = block;
        m->edge_interface[v0 + k] = block == 2 ? 1 : -1;
        m->edge_mate[v0 + k] = -1;
        m->edge_element[v0 + k] = m->point_element[point[k]];
    }
    m->n_vertex += n;
}

static void make_outlines(nmm_model *m, int nx, int ny) {
    int point[4096], n = 0;
    assert(2 * (nx + ny) < 4096);
    for (int i = 0; i < nx; i++)
        point[n++] = node_of(nx, i, 0);
    for (int j = 0; j < ny; j++)
        point[n++] = node_of(nx, nx, j);
    for (int i = nx; i > 0; i--)
        point[n++] = node_of(nx, i, ny);
    for (int j = ny; j > 0; j--)
        point[n++] = node_of(nx, 0, j);
    make_loop(m, 0, n, point);
    const int p0 = (nx + 1) * (ny + 1);
    make_loop(m, 1, 4, (const int[4]){p0, p0 + 1, p0 + 2, p0 + 3});
    make_loop(m, 2, 5, (const int[5]){p0 + 4, p0 + 5, p0 + 6, p0 + 7, p0 + 8});
}

// Sizes first, then the tables are filled and the sizes counted up again.
static void make_model(nmm_sim *sim, int nx, int ny) {
    nmm_model *m = &sim->model;
    const int n_node = (nx + 1) * (ny + 1), n_triangle = 2 * nx * ny;
    m->n_block = 3;
    m->n_cover = n_node + 6;
    m->n_point = n_node + 9;
    m->n_element = n_triangle + 2;
    m->n_local = 3;
    m->n_corner = 3 * n_triangle + 9;
    m->n_vertex = 2 * (nx + ny) + 9;
    m->n_support = nx + 1;
    m->n_load = 1;
    m->n_monitor = 2;
    m->n_hold = 3;
    m->n_material = 2;
    m->origin = (nmm_vec2){1000, 2000};
    m->size = 8.0 / nx;
    m->height = 4;
    MUST(nmm_model_allocate(&sim->context, m));
    MUST(nmm_allocate(&sim->context, &m->support, (size_t)m->n_support, sizeof *m->support));
    MUST(nmm_allocate(&sim->context, &m->hold, (size_t)m->n_hold, sizeof *m->hold));
    MUST(nmm_allocate(&sim->context, &m->load, (size_t)m->n_load, sizeof *m->load));
    MUST(nmm_allocate(&sim->context, &m->monitor, (size_t)m->n_monitor, sizeof *m->monitor));
    MUST(nmm_allocate(&sim->context, &m->material, 2, sizeof *m->material));
    m->n_cover = m->n_point = n_node;
    m->n_vertex = 0;
    make_bench(m, nx, ny);
    make_loose(m, 1, n_triangle, 4, (const nmm_vec2[4]){{1, 0}, {3, 0}, {3, 1}, {1, 1}});
    make_loose(m, 2, n_triangle + 1, 5,
               (const nmm_vec2[5]){{4, 0}, {6, 0}, {6.5, 1}, {5, 2}, {3.5, 1}});
    make_outlines(m, nx, ny);
}

static void make_conditions(nmm_model *m, int nx) {
    m->material[0] = (nmm_material){2500, 5e9, 0.25, NMM_PLANE_STRAIN};
    m->material[1] = (nmm_material){2500, 5e9, 0.25, NMM_PLANE_STRESS};
    for (int i = 0; i <= nx; i++) {
        m->support[i] = (nmm_support){.element = 0,
                                      .place = {8.0 * i / nx, -2},
                                      .fix_x = i == 0,
                                      .fix_y = true,
                                      .length = 1,
                                      .history = -1};
    }
    m->load[0] =
        (nmm_load){.element = m->n_element - 1, .place = {5, 2}, .force = {0, -1e5}, .history = -1};
    m->monitor[0] = (nmm_monitor){
        .name = "crest", .place = {8, 0}, .displacement = true, .velocity = true, .stress = true};
    m->monitor[1] = (nmm_monitor){.name = "a/b", .place = {0, 0}, .displacement = true};
    // All covers of the block at the left are held.
    for (int i = 0; i < 3; i++)
        m->hold[i] =
            (nmm_hold){.cover = m->n_cover - 6 + i, .fix_x = true, .fix_y = true, .history = -1};
}

void fixture_create(fixture *f, int nx, int ny) {
    static const char *material[2] = {"bench", "block"};
    f->sim = calloc(1, sizeof *f->sim);
    f->speed = 0.5;
    nmm_sim *sim = f->sim;
    sim->context.n_thread = 1;
    sim->scene.path = "fixture.yaml";
    sim->scene.text = scene_text;
    sim->scene.text_length = sizeof scene_text - 1;
    sim->scene.title = "Two blocks on a bench, \xc3\xa9tude";
    sim->scene.n_material = 2;
    sim->scene.material_name = material;
    sim->settings.output_every = 0.02;
    sim->settings.out_displacement = sim->settings.out_velocity = true;
    sim->settings.out_stress = sim->settings.out_contact = true;
    static int searching;
    sim->search = (nmm_contact_search *)(void *)&searching; // never followed
    make_model(sim, nx, ny);
    make_conditions(&sim->model, nx);
    MUST(nmm_state_create(&sim->context, &sim->model, &sim->state));
    sim->state.dt = 0.01;
}

// --- Motion

static void move(fixture *f) {
    nmm_sim *sim = f->sim;
    const nmm_model *m = &sim->model;
    const double t = sim->state.time;
    for (int c = 0; c < m->n_cover; c++) {
        double *d = sim->state.displacement + 2 * (long)c, *v = sim->state.velocity + 2 * (long)c;
        const bool bench = m->cover_block[c] == 0;
        const double x = bench ? m->point[2 * c] / 8 : 1;
        const double depth = bench ? 1 + m->point[2 * c + 1] / 2 : 1;
        if (m->cover_block[c] == 1) continue;
        v[0] = bench ? 0.02 * f->speed * x * depth : f->speed;
        v[1] = bench ? -0.05 * f->speed * x * depth : 0.2 * f->speed;
        d[0] = v[0] * t;
        d[1] = v[1] * t;
    }
    nmm_state_place(m, &sim->state, 1);
    for (int e = 0; e < m->n_element; e++) {
        const double *c = m->element_centre + 2 * (long)e;
        double *s = sim->state.stress + 3 * (long)e;
        s[0] = 1e5 * c[1] + 2e5 * t * (c[0] - 4);
        s[1] = 4e5 * c[1];
        s[2] = 1e4 * c[0];
    }
}

// Two contacts, none, three, two, none, ... of the loose blocks with the bench.
static void touch(fixture *f) {
    nmm_sim *sim = f->sim;
    const nmm_model *m = &sim->model;
    nmm_state *state = &sim->state;
    static const int pattern[3] = {2, 0, 3};
    const int n = pattern[state->step % 3];
    MUST(nmm_grow(&sim->context, &state->contact, &state->contact_capacity, n,
                  sizeof *state->contact));
    state->n_contact = n;
    for (int i = 0; i < n; i++) {
        state->contact[i] = (nmm_contact){.vertex = m->n_vertex - 9 + (i < 2 ? i : 4),
                                          .edge = m->n_vertex - 9 - 3,
                                          .mode = (nmm_contact_mode)(i % 3),
                                          .gap = -1e-5 * i,
                                          .normal_force = 1e4 * i,
                                          .shear_force = 3e3 * i,
                                          .slid = 0.01 * i};
    }
}

void fixture_step(fixture *f, double dt, nmm_step_report *report) {
    nmm_sim *sim = f->sim;
    sim->state.step += 1;
    sim->state.time += dt;
    move(f);
    touch(f);
    *report = (nmm_step_report){.step = sim->state.step,
                                .time = sim->state.time,
                                .dt = dt,
                                .passes = 3,
                                .contacts = sim->state.n_contact,
                                .penetration = 1e-5,
                                .energy = {.kinetic = 1.5 * (double)sim->state.step}};
    snprintf(sim->summary.method, sizeof sim->summary.method, "pcg");
    snprintf(sim->summary.device, sizeof sim->summary.device, "host");
}

void fixture_destroy(fixture *f) {
    if (f->sim == NULL) return;
    nmm_state_destroy(&f->sim->context, &f->sim->state);
    nmm_model_destroy(&f->sim->context, &f->sim->model);
    assert(f->sim->context.n_live == 0);
    free(f->sim);
    f->sim = NULL;
}

// --- Files

static char folder[400];

const char *fixture_path(char path[512], const char *name) {
    if (folder[0] == 0) {
        const char *base = getenv("TMPDIR");
        snprintf(folder, sizeof folder, "%s/nmm_io_XXXXXX", base != NULL ? base : "/tmp");
        if (mkdtemp(folder) == NULL) abort();
    }
    snprintf(path, 512, "%s/%s", folder, name);
    return path;
}

static void remove_folder(const char *path, int depth) {
    char entry[1024];
    DIR *list = opendir(path);
    for (struct dirent *e = list ? readdir(list) : NULL; e != NULL; e = readdir(list)) {
        if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0) continue;
        snprintf(entry, sizeof entry, "%.500s/%.500s", path, e->d_name);
        if (unlink(entry) != 0 && depth < 3) remove_folder(entry, depth + 1);
    }
    if (list != NULL) closedir(list);
    rmdir(path);
}

int fixture_clean(void **unused) {
    (void)unused;
    if (folder[0] != 0) remove_folder(folder, 0);
    folder[0] = 0;
    return 0;
}
