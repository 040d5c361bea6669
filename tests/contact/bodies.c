// SPDX-License-Identifier: MIT
//
// Models of the contact tests, made by hand.

#include "bodies.h"

#include <stdlib.h>

// --- Making

// The triangle around block k: an equilateral one about the middle of its box, twice as large as
// needed; its corners are the nodes of the three covers.
static void make_triangle(nmm_model *m, int k, nmm_box box) {
    const nmm_vec2 c = nmm_vec2_mix(box.low, box.high, 0.5);
    const nmm_vec2 half = nmm_vec2_sub(box.high, c);
    const double r = 4 * sqrt(nmm_vec2_dot(half, half)), q = 0.5 * sqrt(3);
    const nmm_vec2 node[3] = {
        {c.x, c.y + r}, {c.x - q * r, c.y - 0.5 * r}, {c.x + q * r, c.y - 0.5 * r}};
    const double area2 =
        nmm_vec2_cross(nmm_vec2_sub(node[1], node[0]), nmm_vec2_sub(node[2], node[0]));
    m->element_centre[2 * k] = c.x;
    m->element_centre[2 * k + 1] = c.y;
    for (int i = 0; i < 3; i++) {
        const nmm_vec2 a = node[(i + 1) % 3], b = node[(i + 2) % 3];
        m->cover_place[6 * k + 2 * i] = node[i].x;
        m->cover_place[6 * k + 2 * i + 1] = node[i].y;
        m->cover_block[3 * k + i] = k;
        m->element_cover[3 * k + i] = 3 * k + i;
        m->element_weight[3 * k + i] = 1.0 / 3;
        m->element_gradient[6 * k + 2 * i] = (a.y - b.y) / area2;
        m->element_gradient[6 * k + 2 * i + 1] = (b.x - a.x) / area2;
    }
    m->element_block[k] = k;
}

static nmm_box box_of_block(int n_loop, const loop *loops, int block) {
    nmm_box box = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (int l = 0; l < n_loop; l++) {
        for (int i = 0; i < loops[l].n && loops[l].block == block; i++) {
            const nmm_vec2 p = loops[l].corner[i];
            box.low = (nmm_vec2){nmm_min(box.low.x, p.x), nmm_min(box.low.y, p.y)};
            box.high = (nmm_vec2){nmm_max(box.high.x, p.x), nmm_max(box.high.y, p.y)};
        }
    }
    return box;
}

static void make_loop(nmm_model *m, const loop *l, int first) {
    for (int i = 0; i < l->n; i++) {
        const int v = first + i;
        m->element_area[l->block] += 0.5 * nmm_vec2_cross(l->corner[i], l->corner[(i + 1) % l->n]);
        m->point[2 * v] = l->corner[i].x;
        m->point[2 * v + 1] = l->corner[i].y;
        m->point_element[v] = l->block;
        nmm_element_weights(m, l->block, l->corner[i], m->point_weight + 3 * (long)v);
        m->vertex_point[v] = v;
        m->vertex_next[v] = first + (i + 1) % l->n;
        m->vertex_prev[v] = first + (i + l->n - 1) % l->n;
        m->vertex_block[v] = l->block;
        m->edge_element[v] = l->block;
        m->edge_interface[v] = -1;
        m->edge_mate[v] = -1;
        memcpy(m->edge_weight + 6 * (long)v, m->point_weight + 3 * (long)v, 3 * sizeof(double));
        nmm_element_weights(m, l->block, l->corner[(i + 1) % l->n],
                            m->edge_weight + 6 * (long)v + 3);
    }
}

static nmm_status make_tables(bodies *b) {
    nmm_model *m = &b->model;
    m->n_material = 1;
    m->n_interface = 2;
    TRY(nmm_allocate(&b->context, &m->material, 1, sizeof(nmm_material)));
    TRY(nmm_allocate(&b->context, &m->interface, 2, sizeof(nmm_interface)));
    TRY(nmm_allocate(&b->context, &m->block_name, (size_t)m->n_block, sizeof(char *)));
    m->material[0] = (nmm_material){.density = 2500, .youngs_modulus = BODY_MODULUS};
    m->interface[0] = (nmm_interface){.friction = 0.5, .residual_friction = 0.5};
    m->interface[1] = m->interface[0];
    return NMM_OK;
}

nmm_status bodies_open(bodies *b, int n_loop, const loop *loops, double size) {
    nmm_model *m = &b->model;
    if (b->context.n_thread == 0) b->context.n_thread = 1;
    m->size = size;
    m->height = 1;
    for (int l = 0; l < n_loop; l++) {
        m->n_vertex += loops[l].n;
        m->n_block = nmm_max_int(m->n_block, loops[l].block + 1);
    }
    m->n_point = m->n_corner = m->n_vertex;
    m->n_element = m->n_block;
    m->n_cover = 3 * m->n_block;
    m->n_local = 3;
    TRY(nmm_model_allocate(&b->context, m));
    TRY(make_tables(b));
    for (int l = 0, first = 0; l < n_loop; first += loops[l].n, l++) {
        if (l == 0 || loops[l].block != loops[l - 1].block) {
            make_triangle(m, loops[l].block, box_of_block(n_loop, loops, loops[l].block));
        }
        make_loop(m, &loops[l], first);
    }
    TRY(nmm_state_create(&b->context, m, &b->state));
    b->options = (nmm_contact_options){.penalty = BODY_PENALTY};
    return nmm_contact_open(&b->context, m, &b->options, &b->search);
}

void bodies_close(bodies *b) {
    nmm_contact_close(&b->context, &b->search);
    nmm_state_destroy(&b->context, &b->state);
    nmm_model_destroy(&b->context, &b->model);
}

void bodies_options(bodies *b, nmm_contact_options options) {
    b->options = options;
    nmm_contact_close(&b->context, &b->search);
    assert_int_equal(nmm_contact_open(&b->context, &b->model, &options, &b->search), NMM_OK);
}

void bodies_join(bodies *b, int interface) {
    nmm_model *m = &b->model;
    for (int e = 0; e < m->n_vertex; e++) {
        for (int f = 0; f < m->n_vertex; f++) {
            const double *p = m->point + 2 * (long)e, *q = m->point + 2 * (long)m->vertex_next[e];
            const double *r = m->point + 2 * (long)f, *s = m->point + 2 * (long)m->vertex_next[f];
            if (p[0] != s[0] || p[1] != s[1] || q[0] != r[0] || q[1] != r[1]) continue;
            m->edge_mate[e] = f;
            m->edge_interface[e] = interface;
        }
    }
}

// --- Moving

void bodies_put(bodies *b, int block, double x, double y, double angle) {
    const double *c = b->model.element_centre + 2 * (long)block;
    for (int i = 3 * block; i < 3 * block + 3; i++) {
        const double rx = b->model.cover_place[2 * i] - c[0];
        const double ry = b->model.cover_place[2 * i + 1] - c[1];
        b->state.displacement[2 * i] = x + (cos(angle) - 1) * rx - sin(angle) * ry;
        b->state.displacement[2 * i + 1] = y + sin(angle) * rx + (cos(angle) - 1) * ry;
    }
    nmm_state_place(&b->model, &b->state, 1);
}

void bodies_shake(bodies *b, nmm_random *random, double amount) {
    for (int i = 0; i < 2 * b->model.n_cover; i++) {
        b->state.displacement[i] += amount * (2 * nmm_random_unit(random) - 1);
    }
    nmm_state_place(&b->model, &b->state, 1);
}

void bodies_find(bodies *b, double reach) {
    assert_int_equal(nmm_contact_find(&b->context, b->search, &b->model, &b->state, reach), NMM_OK);
}

nmm_contact_verdict bodies_evaluate(bodies *b) {
    nmm_contact_verdict verdict =
        nmm_contact_evaluate(b->search, &b->model, &b->state, b->context.n_thread);
    while (nmm_contact_break(&b->model, &b->state) > 0) {
        verdict = nmm_contact_evaluate(b->search, &b->model, &b->state, b->context.n_thread);
    }
    return verdict;
}

void bodies_commit(bodies *b, nmm_contact_energy *energy) {
    nmm_contact_energy unused = {0};
    nmm_contact_commit(b->search, &b->model, &b->state, energy != NULL ? energy : &unused);
    b->state.step += 1;
}

// --- Asking

int bodies_vertex(const bodies *b, int block) {
    int v = 0;
    while (b->model.vertex_block[v] != block)
        v += 1;
    return v;
}

nmm_contact *bodies_contact(bodies *b, int vertex, int edge) {
    for (int k = 0; k < b->state.n_contact; k++) {
        nmm_contact *c = &b->state.contact[k];
        if (c->vertex == vertex && c->edge == edge) return c;
    }
    return NULL;
}

// 1: vertex of a on edge of b, -1: the other way round, 0: neither.
static int role_of(const bodies *b, const nmm_contact *c, int block_a, int block_b) {
    const int v = b->model.vertex_block[c->vertex], e = b->model.vertex_block[c->edge];
    return v == block_a && e == block_b ? 1 : v == block_b && e == block_a ? -1 : 0;
}

int bodies_count(const bodies *b, int block_a, int block_b) {
    int n = 0;
    for (int k = 0; k < b->state.n_contact; k++)
        n += role_of(b, &b->state.contact[k], block_a, block_b) != 0;
    return n;
}

double bodies_length(const bodies *b, int block_a, int block_b) {
    double sum = 0;
    for (int k = 0; k < b->state.n_contact; k++) {
        const nmm_contact *c = &b->state.contact[k];
        if (role_of(b, c, block_a, block_b) != 0) sum += c->length;
    }
    return sum;
}

nmm_vec2 bodies_force(const bodies *b, int block_a, int block_b) {
    nmm_vec2 sum = {0, 0};
    for (int k = 0; k < b->state.n_contact; k++) {
        const nmm_contact *c = &b->state.contact[k];
        const int role = role_of(b, c, block_a, block_b);
        if (role == 0) continue;
        const nmm_contact_row row = nmm_contact_row_of(&b->model, &b->state, c);
        // The covers of block a are the first three for its vertex, the last three for its edge.
        for (int i = 0; i < 3; i++) {
            const int k6 = role > 0 ? i : 3 + i;
            sum.x += c->normal_force * row.normal[k6][0] + c->shear_force * row.shear[k6][0];
            sum.y += c->normal_force * row.normal[k6][1] + c->shear_force * row.shear[k6][1];
        }
    }
    return sum;
}
