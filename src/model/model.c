// SPDX-License-Identifier: MIT
//
// Life of models and states, driven by the two field tables; small look-ups on them.

#include "model.h"

#include <math.h>
#include <string.h>

nmm_status nmm_model_allocate(nmm_context *context, nmm_model *model) {
    const nmm_model *m = model;
    const int n_gram = m->n_local * (m->n_local + 1) / 2;
    const int n_curved = m->order > 0 ? m->n_element : 0;
#define n_cover m->n_cover
#define n_element m->n_element
#define n_local m->n_local
#define n_sample m->n_sample
#define n_corner m->n_corner
#define n_point m->n_point
#define n_vertex m->n_vertex
#define FIELD(type, name, count, width, unit, meaning)                                             \
    TRY(nmm_allocate(context, &model->name, (size_t)(count) * (size_t)(width), sizeof(type)));
#include "model_fields.inl"
#undef FIELD
#undef n_cover
#undef n_element
#undef n_local
#undef n_sample
#undef n_corner
#undef n_point
#undef n_vertex
    return NMM_OK;
}

void nmm_model_destroy(nmm_context *context, nmm_model *model) {
#define FIELD(type, name, count, width, unit, meaning) nmm_release(context, &model->name);
#include "model_fields.inl"
#undef FIELD
    nmm_release(context, &model->tie_element);
    nmm_release(context, &model->tie_gram);
    nmm_release(context, &model->material);
    nmm_release(context, &model->interface);
    nmm_release(context, &model->support);
    nmm_release(context, &model->hold);
    nmm_release(context, &model->load);
    nmm_release(context, &model->monitor);
    nmm_release(context, &model->history);
    nmm_release(context, &model->block_name);
    nmm_release(context, &model->block_scene);
    nmm_arena_destroy(context, &model->arena);
    *model = (nmm_model){0};
}

nmm_status nmm_state_create(nmm_context *context, const nmm_model *model, nmm_state *state) {
    const int n_cover = model->n_cover, n_element = model->n_element, n_point = model->n_point;
    const int n_support = model->n_support, n_sample = model->n_sample;
#define FIELD(type, name, count, width, unit, meaning)                                             \
    TRY(nmm_allocate(context, &state->name, (size_t)(count) * (width), sizeof(type)));
#include "state_fields.inl"
#undef FIELD
    for (int e = 0; e < n_element; e++)
        state->rotation[2 * e] = 1;
    nmm_state_place(model, state, 1);
    return NMM_OK;
}

void nmm_state_destroy(nmm_context *context, nmm_state *state) {
#define FIELD(type, name, count, width, unit, meaning) nmm_release(context, &state->name);
#include "state_fields.inl"
#undef FIELD
    nmm_release(context, &state->contact);
    *state = (nmm_state){0};
}

// Place of point p of an element with m functions; a constant m makes straight code of it.
static inline void place_point(const nmm_model *model, nmm_state *state, int p, int m) {
    const int *c = model->element_cover + m * (long)model->point_element[p];
    const double *w = model->point_weight + m * (long)p, *d = state->displacement;
    typedef double both __attribute__((vector_size(16))); // components at once
    both shift = {0, 0}, place;
    for (int i = 0; i < m; i++) {
        memcpy(&place, d + 2 * (long)c[i], sizeof place);
        shift += w[i] * place;
    }
    memcpy(state->shift + 2 * (long)p, &shift, sizeof shift);
    memcpy(&place, model->point + 2 * (long)p, sizeof place);
    place += shift;
    memcpy(state->position + 2 * (long)p, &place, sizeof place);
}

void nmm_state_place_some(const nmm_model *model, nmm_state *state, const int *point, int n,
                          int n_thread) {
    const int m = model->n_local;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 4096)
    for (int i = 0; i < n; i++) {
        const int p = point != NULL ? point[i] : i;
        if (m == 3)
            place_point(model, state, p, 3);
        else
            place_point(model, state, p, m);
    }
}

void nmm_state_place(const nmm_model *model, nmm_state *state, int n_thread) {
    nmm_state_place_some(model, state, NULL, model->n_point, n_thread);
}

static nmm_status check_finite(nmm_context *context, const char *stage, const char *name, long n,
                               const double *x) {
    // A sum of x - x is zero when all are finite, and not a number otherwise; several side by side.
    double sum[8] = {0}, rest = 0;
    for (long i = 0; i < n / 8; i++)
        for (int k = 0; k < 8; k++)
            sum[k] += x[8 * i + k] - x[8 * i + k];
    for (long i = n - n % 8; i < n; i++)
        rest += x[i] - x[i];
    for (int k = 0; k < 8; k++)
        rest += sum[k];
    if (rest == 0) return NMM_OK;
    long i = 0;
    while (isfinite(x[i]))
        i += 1;
    return nmm_fail(context, NMM_ERROR_NUMERIC, "%s: %s[%ld] is not a finite number", stage, name,
                    i);
}

nmm_status nmm_state_check(nmm_context *context, const nmm_model *model, const nmm_state *state,
                           const char *stage) {
    const int n_cover = model->n_cover, n_element = model->n_element, n_point = model->n_point;
    const int n_support = model->n_support, n_sample = model->n_sample;
#define FIELD(type, name, count, width, unit, meaning)                                             \
    TRY(check_finite(context, stage, #name, (long)(count) * (width), state->name));
#include "state_fields.inl"
#undef FIELD
    return NMM_OK;
}

uint64_t nmm_state_hash(const nmm_model *model, const nmm_state *state) {
    const size_t pair = 2 * sizeof(double);
    uint64_t hash = nmm_hash(NMM_HASH_START, &state->time, sizeof state->time);
    hash = nmm_hash(hash, state->displacement, (size_t)model->n_cover * pair);
    hash = nmm_hash(hash, state->velocity, (size_t)model->n_cover * pair);
    hash = nmm_hash(hash, state->stress, (size_t)model->n_element * 3 * sizeof(double));
    for (int i = 0; i < state->n_contact; i++) {
        const nmm_contact *c = &state->contact[i];
        const int identity[3] = {c->vertex, c->edge, (int)c->mode};
        const double force[2] = {c->normal_force, c->shear_force};
        hash = nmm_hash(hash, identity, sizeof identity);
        hash = nmm_hash(hash, force, sizeof force);
    }
    return hash;
}

void nmm_history_value(const nmm_history *history, double time, double *value) {
    const int stride = 1 + history->width;
    const double *entry = history->entry;
    NMM_ASSERT(history->n > 0);
    int k = 0;
    while (k < history->n && entry[k * stride] <= time)
        k += 1;
    // Constant outside, linear between entry k - 1 and entry k.
    const double *after = entry + stride * nmm_min_int(k, history->n - 1);
    const double *before = entry + stride * nmm_max_int(k - 1, 0);
    const double length = after[0] - before[0];
    const double t = length > 0 ? (time - before[0]) / length : 0;
    for (int i = 1; i <= history->width; i++)
        value[i - 1] = before[i] + t * (after[i] - before[i]);
}

void nmm_element_linear(const nmm_model *model, int e, nmm_vec2 place, double linear[3]) {
    const double x = place.x - model->element_centre[2 * e];
    const double y = place.y - model->element_centre[2 * e + 1];
    const double *g = model->element_gradient + 6 * (long)e;
    for (int i = 0; i < 3; i++) {
        linear[i] = model->element_weight[3 * e + i] + g[2 * i] * x + g[2 * i + 1] * y;
    }
}

void nmm_element_weights(const nmm_model *model, int e, nmm_vec2 place, double *weight) {
    double linear[3];
    nmm_element_linear(model, e, place, linear);
    nmm_functions_value(model, e, linear, weight);
}

// Squared distance of `place` from the polygon of element e, 0 inside.
static double distance_to_element(const nmm_model *model, int e, nmm_vec2 place) {
    const int begin = model->element_start[e], end = model->element_start[e + 1];
    bool inside = false;
    double nearest = INFINITY;
    for (int k = begin; k < end; k++) {
        const double *p = model->point + 2 * (long)model->corner_point[k];
        const double *q = model->point + 2 * (long)model->corner_point[k + 1 < end ? k + 1 : begin];
        const nmm_vec2 a = {p[0], p[1]}, b = {q[0], q[1]};
        const nmm_vec2 ab = nmm_vec2_sub(b, a), ap = nmm_vec2_sub(place, a);
        if ((a.y > place.y) != (b.y > place.y)) {
            if (place.x < a.x + (place.y - a.y) / ab.y * ab.x) inside = !inside;
        }
        const double length = nmm_vec2_dot(ab, ab);
        double t = length > 0 ? nmm_vec2_dot(ap, ab) / length : 0;
        t = nmm_min(1, nmm_max(0, t));
        const nmm_vec2 off = nmm_vec2_sub(ap, nmm_vec2_scale(t, ab));
        nearest = nmm_min(nearest, nmm_vec2_dot(off, off));
    }
    return inside ? 0 : nearest;
}

int nmm_model_find_element(const nmm_model *model, nmm_vec2 place, double reach) {
    int found = -1;
    double nearest = reach * reach;
    // Elements of a lattice end within two sides of their centres; whole blocks end anywhere.
    const double far = model->whole_blocks ? INFINITY : 2 * model->size + reach;
    for (int e = 0; e < model->n_element; e++) {
        const double dx = place.x - model->element_centre[2 * e];
        const double dy = place.y - model->element_centre[2 * e + 1];
        if (dx * dx + dy * dy > far * far) continue;
        const double distance = distance_to_element(model, e, place);
        // The first of equals wins; a place inside wins over one on the edge.
        if (distance < nearest || (found < 0 && distance <= nearest)) {
            nearest = distance;
            found = e;
        }
        if (distance == 0) break;
    }
    return found;
}
