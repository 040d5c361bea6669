// SPDX-License-Identifier: MIT
//
// Supports, loads, monitors, initial stress and initial velocity of the scene, placed on the model.
// A support of a whole block holds its covers exactly; others are points with stiff springs whose
// carried forces are raised until they stay on average over GROUP covers (docs/theory/4-time.md,
// eq. (4.6)).

#include "system.h"

#include <math.h>
#include <string.h>

// Support springs: so many times Young's modulus over the cover size, by order. Stiffer ones would
// lock covers of order 0; higher orders give way in more places, and need it for what they can
// tell.
static const double support_penalty[] = {50, 1000, 20000};

// Lengths below this part of the cover size count as touching.
#define TOUCH 1e-6

static nmm_vec2 point_of(const nmm_model *model, int p) {
    return (nmm_vec2){model->point[2 * (long)p], model->point[2 * (long)p + 1]};
}

static nmm_vec2 start_of(const nmm_model *model, int v) {
    return point_of(model, model->vertex_point[v]);
}

// Distance of p from the segment a-b.
static double distance_to_segment(nmm_vec2 p, nmm_vec2 a, nmm_vec2 b) {
    const nmm_vec2 ab = nmm_vec2_sub(b, a), ap = nmm_vec2_sub(p, a);
    const double length = nmm_vec2_dot(ab, ab);
    const double t = length > 0 ? nmm_min(1, nmm_max(0, nmm_vec2_dot(ap, ab) / length)) : 0;
    const nmm_vec2 off = nmm_vec2_sub(ap, nmm_vec2_scale(t, ab));
    return sqrt(nmm_vec2_dot(off, off));
}

// --- Supports

typedef struct placing {
    nmm_context *context;
    nmm_model *model;
    int support_capacity, hold_capacity, load_capacity;
    double touch;         // [m]
    unsigned char *nodal; // [n_cover] the cover is one of a node, not of an edge or triangle
} placing;

static double modulus_of(const nmm_model *model, int element) {
    return model->material[model->element_material[element]].youngs_modulus;
}

static nmm_status add_support(placing *p, const nmm_scene_support *from, int element,
                              nmm_vec2 place, double length) {
    nmm_model *model = p->model;
    TRY(nmm_grow(p->context, &model->support, &p->support_capacity, model->n_support + 1,
                 sizeof(nmm_support)));
    nmm_support *support = &model->support[model->n_support];
    *support = (nmm_support){.element = element, .place = place, .length = length, .group = -1};
    nmm_element_weights(model, element, place, support->weight);
    support->fix_x = from->fix_x;
    support->fix_y = from->fix_y;
    support->history = from->history;
    support->stiffness =
        support_penalty[model->order] * modulus_of(model, element) * length / model->size;
    model->n_support += 1;
    return NMM_OK;
}

static nmm_status add_hold(placing *p, const nmm_scene_support *from, int cover) {
    nmm_model *model = p->model;
    TRY(nmm_grow(p->context, &model->hold, &p->hold_capacity, model->n_hold + 1, sizeof(nmm_hold)));
    // A rigid motion is one of the nodes alone.
    const int history = p->nodal[cover] ? from->history : -1;
    model->hold[model->n_hold++] = (nmm_hold){cover, from->fix_x, from->fix_y, history};
    return NMM_OK;
}

static nmm_status support_block(placing *p, const nmm_scene_support *from) {
    const nmm_model *model = p->model;
    for (int c = 0; c < model->n_cover; c++) {
        const char *name = model->block_name[model->cover_block[c]];
        if (name != NULL && strcmp(name, from->block) == 0) TRY(add_hold(p, from, c));
    }
    return NMM_OK;
}

// Parts of an edge that its ends and its middle stand for: the trapezoid rule for the linear
// functions of order 0, Simpson's for higher ones.
static double share_of_end(const nmm_model *model) {
    return model->order == 0 ? 0.5 : 1.0 / 6;
}

// What a loop vertex on a segment stands for: its parts of the two edges that run along it, each
// with the modulus behind it. So a strain that is the same on both sides of a border gives all
// springs the same way.
typedef struct share {
    double length;
    double modulus; // mean over the length [Pa]
    int element;    // behind the stiffer edge
} share;

static share share_along(const placing *p, int v, const nmm_scene_support *from) {
    const nmm_model *model = p->model;
    const int other[2] = {model->vertex_next[v], model->vertex_prev[v]};
    const int element[2] = {model->edge_element[v], model->edge_element[other[1]]};
    share all = {.element = element[0]};
    double sum = 0, stiffest = 0;
    for (int k = 0; k < 2; k++) {
        const nmm_vec2 end = start_of(model, other[k]);
        if (distance_to_segment(end, from->a, from->b) > p->touch) continue;
        const nmm_vec2 along = nmm_vec2_sub(end, start_of(model, v));
        const double half = share_of_end(model) * sqrt(nmm_vec2_dot(along, along));
        const double modulus = modulus_of(model, element[k]);
        all.length += half;
        sum += half * modulus;
        if (modulus > stiffest) all.element = element[k];
        stiffest = nmm_max(stiffest, modulus);
    }
    all.modulus = all.length > 0 ? sum / all.length : modulus_of(model, all.element);
    // A vertex that only touches the segment.
    all.length = nmm_max(all.length, 1e-3 * model->size);
    return all;
}

// Initial stress xx, yy, xy at a place of element e.
static void initial_stress_at(const nmm_scene *scene, const nmm_model *model, int e, nmm_vec2 place,
                              double stress[3]) {
    const nmm_scene_initial *initial = &scene->initial;
    stress[0] = initial->xx, stress[1] = initial->yy, stress[2] = initial->xy;
    if (initial->kind != NMM_INITIAL_GRAVITY) return;
    // The weight above presses; nothing above the surface.
    const double depth = nmm_max(0, initial->surface - (place.y + model->origin.y));
    stress[1] = model->material[model->element_material[e]].density * model->gravity.y * depth;
    stress[0] = initial->k0 * stress[1];
    stress[2] = 0;
}

// A stress as large as the modulus is that of a body stretched to twice its length or pressed to
// nothing: let go, its elements turn inside out.
static nmm_status check_initial_stress(const placing *p, nmm_scene *scene) {
    const nmm_model *model = p->model;
    for (int e = 0; e < model->n_element && scene->initial.kind != NMM_INITIAL_NONE; e++) {
        const nmm_vec2 centre = {model->element_centre[2 * (long)e],
                                 model->element_centre[2 * (long)e + 1]};
        double s[3];
        initial_stress_at(scene, model, e, centre, s);
        const double mean = 0.5 * (s[0] + s[1]), half = 0.5 * (s[0] - s[1]);
        const double principal = fabs(mean) + sqrt(half * half + s[2] * s[2]);
        const int material = model->element_material[e];
        const double modulus = model->material[material].youngs_modulus;
        if (principal < modulus) continue;
        return nmm_scene_reject(p->context, scene, scene->initial.mark,
                                "the initial stress near (%.6g, %.6g), %.3g Pa, is %.3g times "
                                "youngs_modulus of material '%s' there; strains as large as 1 are "
                                "beyond linear elasticity: elements would turn inside out",
                                centre.x + model->origin.x, centre.y + model->origin.y, principal,
                                principal / modulus, scene->material_name[material]);
    }
    return NMM_OK;
}

// The traction of the initial stress on the segment's edges, at two Gauss points each: exact for a
// stress linear in depth, so that a scene in balance does not move. Springless supports carry it.
static nmm_status carry_initial_stress(placing *p, const nmm_scene *scene,
                                       const nmm_scene_support *from) {
    nmm_model *model = p->model;
    if (scene->initial.kind == NMM_INITIAL_NONE) return NMM_OK;
    for (int v = 0; v < model->n_vertex; v++) {
        const nmm_vec2 a = start_of(model, v), b = start_of(model, model->vertex_next[v]);
        if (model->edge_mate[v] >= 0 || distance_to_segment(a, from->a, from->b) > p->touch ||
            distance_to_segment(b, from->a, from->b) > p->touch) {
            continue;
        }
        const nmm_vec2 normal = {b.y - a.y, a.x - b.x}; // outward, as long as the edge
        for (int k = -1; k <= 1; k += 2) {
            const nmm_vec2 place = nmm_vec2_mix(a, b, 0.5 + k * 0.5 / sqrt(3.0));
            double s[3];
            initial_stress_at(scene, model, model->edge_element[v], place, s);
            TRY(add_support(p, from, model->edge_element[v], place, 0));
            nmm_support *support = &model->support[model->n_support - 1];
            support->carried.x = from->fix_x ? 0.5 * (s[0] * normal.x + s[2] * normal.y) : 0;
            support->carried.y = from->fix_y ? 0.5 * (s[2] * normal.x + s[1] * normal.y) : 0;
        }
    }
    return NMM_OK;
}

// Middles of the loop edges along the segment.
static nmm_status support_middles(placing *p, const nmm_scene_support *from) {
    const nmm_model *model = p->model;
    for (int v = 0; v < model->n_vertex; v++) {
        const nmm_vec2 a = start_of(model, v), b = start_of(model, model->vertex_next[v]);
        if (distance_to_segment(a, from->a, from->b) > p->touch ||
            distance_to_segment(b, from->a, from->b) > p->touch) {
            continue;
        }
        const nmm_vec2 along = nmm_vec2_sub(b, a);
        const double length = (1 - 2 * share_of_end(model)) * sqrt(nmm_vec2_dot(along, along));
        TRY(add_support(p, from, model->edge_element[v], nmm_vec2_mix(a, b, 0.5), length));
    }
    return NMM_OK;
}

// Loop vertices on the segment; each stands for its share of the length.
static nmm_status support_segment(placing *p, const nmm_scene *scene,
                                  const nmm_scene_support *from) {
    const nmm_model *model = p->model;
    const int before = model->n_support;
    for (int v = 0; v < model->n_vertex; v++) {
        const nmm_vec2 place = start_of(model, v);
        if (distance_to_segment(place, from->a, from->b) > p->touch) continue;
        const share own = share_along(p, v, from);
        TRY(add_support(p, from, own.element, place, own.length));
        model->support[model->n_support - 1].stiffness =
            support_penalty[model->order] * own.modulus * own.length / model->size;
    }
    if (model->n_support > before) {
        if (model->order > 0) TRY(support_middles(p, from));
        TRY(nmm_supports_group(p->context, p->model, from->a, from->b, before));
        return carry_initial_stress(p, scene, from);
    }
    // Nothing of the boundary: hold points along the segment, inside or between vertices.
    const nmm_vec2 along = nmm_vec2_sub(from->b, from->a);
    const double length = sqrt(nmm_vec2_dot(along, along));
    const int n = 1 + (int)nmm_min(1e6, 2 * length / model->size);
    for (int k = 0; k <= n; k++) {
        const nmm_vec2 place = nmm_vec2_mix(from->a, from->b, (double)k / n);
        const int e = nmm_model_find_element(model, place, p->touch);
        if (e >= 0) TRY(add_support(p, from, e, place, length / n));
    }
    return nmm_supports_group(p->context, p->model, from->a, from->b, before);
}

static bool inside_box(const placing *p, nmm_vec2 place, const nmm_scene_support *box) {
    return place.x >= box->a.x - p->touch && place.x <= box->b.x + p->touch &&
           place.y >= box->a.y - p->touch && place.y <= box->b.y + p->touch;
}

// The stiffest of the elements round each point: the same whatever the order they come in.
static void find_stiffest(const nmm_model *model, int *stiffest) {
    for (int k = 0; k < model->n_point; k++)
        stiffest[k] = model->point_element[k];
    for (int e = 0; e < model->n_element; e++) {
        for (int k = model->element_start[e]; k < model->element_start[e + 1]; k++) {
            int *best = &stiffest[model->corner_point[k]];
            if (modulus_of(model, e) > modulus_of(model, *best)) *best = e;
        }
    }
}

// Every material point inside the box; covers that lie wholly inside are held exactly.
static nmm_status support_box(placing *p, const nmm_scene_support *from) {
    nmm_model *model = p->model;
    unsigned char *outside = NULL;
    int *stiffest = NULL;
    TRY(nmm_allocate(p->context, &outside, (size_t)model->n_cover, 1));
    nmm_status status = nmm_allocate(p->context, &stiffest, (size_t)model->n_point, sizeof(int));
    if (status == NMM_OK) find_stiffest(model, stiffest);
    for (int e = 0; e < model->n_element; e++) {
        bool inside = true;
        for (int k = model->element_start[e]; k < model->element_start[e + 1]; k++) {
            inside = inside && inside_box(p, point_of(model, model->corner_point[k]), from);
        }
        for (int i = 0; i < model->n_local && !inside; i++)
            outside[model->element_cover[model->n_local * e + i]] = 1;
    }
    for (int c = 0; c < model->n_cover && status == NMM_OK; c++) {
        if (!outside[c]) status = add_hold(p, from, c);
    }
    for (int k = 0; k < model->n_point && status == NMM_OK; k++) {
        const int e = stiffest[k];
        const int *cover = model->element_cover + model->n_local * (long)e;
        if (!inside_box(p, point_of(model, k), from)) continue;
        bool held = true;
        for (int i = 0; i < model->n_local; i++)
            held = held && !outside[cover[i]];
        if (held) continue;
        status = add_support(p, from, e, point_of(model, k), 0.5 * model->size);
    }
    nmm_release(p->context, &outside);
    nmm_release(p->context, &stiffest);
    return status;
}

static nmm_status place_support(placing *p, nmm_scene *scene, const nmm_scene_support *given) {
    nmm_model *model = p->model;
    nmm_scene_support from = *given;
    from.a = nmm_vec2_sub(given->a, model->origin);
    from.b = nmm_vec2_sub(given->b, model->origin);
    const int before = model->n_support + model->n_hold;
    if (from.kind == NMM_PLACE_POINT) {
        const int e = nmm_model_find_element(model, from.a, p->touch);
        const int s = model->n_support;
        if (e >= 0) TRY(add_support(p, &from, e, from.a, model->size));
        TRY(nmm_supports_group(p->context, model, from.a, from.a, s));
    } else if (from.kind == NMM_PLACE_SEGMENT) {
        TRY(support_segment(p, scene, &from));
    } else if (from.kind == NMM_PLACE_BOX) {
        TRY(support_box(p, &from));
    } else {
        TRY(support_block(p, &from));
    }
    if (model->n_support + model->n_hold > before) return NMM_OK;
    return nmm_scene_reject(p->context, scene, given->mark,
                            "this support touches no block; move it onto the material");
}

// --- Loads and monitors

static nmm_status add_load(placing *p, const nmm_scene_load *from, int element, nmm_vec2 place,
                           double length) {
    nmm_model *model = p->model;
    TRY(nmm_grow(p->context, &model->load, &p->load_capacity, model->n_load + 1, sizeof(nmm_load)));
    nmm_load *load = &model->load[model->n_load];
    *load = (nmm_load){.element = element,
                       .place = place,
                       .force = nmm_vec2_scale(length > 0 ? length : 1, from->value),
                       .length = length,
                       .history = from->history};
    nmm_element_weights(model, element, place, load->weight);
    model->n_load += 1;
    return NMM_OK;
}

// The force of a traction on the part low .. high [m] of its segment a - b, on an element: where
// the functions are linear its middle carries it exactly, else two Gauss points do.
static nmm_status load_part(placing *p, const nmm_scene_load *from, int element, double low,
                            double high) {
    const nmm_vec2 a = nmm_vec2_sub(from->a, p->model->origin);
    const nmm_vec2 b = nmm_vec2_sub(from->b, p->model->origin), ab = nmm_vec2_sub(b, a);
    const double length = sqrt(nmm_vec2_dot(ab, ab)), middle = 0.5 * (low + high) / length;
    const double off = 0.5 / sqrt(3.0) * (high - low) / length;
    if (p->model->order == 0)
        return add_load(p, from, element, nmm_vec2_mix(a, b, middle), high - low);
    for (int k = -1; k <= 1; k += 2) {
        const nmm_vec2 place = nmm_vec2_mix(a, b, middle + k * off);
        TRY(add_load(p, from, element, place, 0.5 * (high - low)));
    }
    return NMM_OK;
}

// A traction acts on the parts of the outer boundary that lie on the segment.
static nmm_status load_segment(placing *p, const nmm_scene_load *from) {
    const nmm_model *model = p->model;
    const nmm_vec2 a = nmm_vec2_sub(from->a, model->origin);
    const nmm_vec2 b = nmm_vec2_sub(from->b, model->origin);
    const nmm_vec2 ab = nmm_vec2_sub(b, a);
    const double length = sqrt(nmm_vec2_dot(ab, ab));
    for (int v = 0; v < model->n_vertex; v++) {
        if (model->edge_mate[v] >= 0) continue;
        const nmm_vec2 q = nmm_vec2_sub(start_of(model, v), a);
        const nmm_vec2 r = nmm_vec2_sub(start_of(model, model->vertex_next[v]), a);
        if (fabs(nmm_vec2_cross(ab, q)) > p->touch * length) continue;
        if (fabs(nmm_vec2_cross(ab, r)) > p->touch * length) continue;
        const double s = nmm_vec2_dot(ab, q) / length, t = nmm_vec2_dot(ab, r) / length;
        const double low = nmm_max(0, nmm_min(s, t)), high = nmm_min(length, nmm_max(s, t));
        if (high - low <= 0) continue;
        TRY(load_part(p, from, model->edge_element[v], low, high));
    }
    return NMM_OK;
}

static nmm_status place_load(placing *p, nmm_scene *scene, const nmm_scene_load *from) {
    nmm_model *model = p->model;
    const int before = model->n_load;
    if (from->kind == NMM_PLACE_POINT) {
        const nmm_vec2 place = nmm_vec2_sub(from->a, model->origin);
        const int e = nmm_model_find_element(model, place, p->touch);
        if (e >= 0) TRY(add_load(p, from, e, place, 0));
    } else {
        TRY(load_segment(p, from));
    }
    if (model->n_load > before) return NMM_OK;
    return nmm_scene_reject(p->context, scene, from->mark,
                            from->kind == NMM_PLACE_POINT
                                ? "this load acts on a point outside of every block"
                                : "no part of the boundary lies on this load's segment");
}

static nmm_status place_monitors(placing *p, nmm_scene *scene) {
    nmm_model *model = p->model;
    TRY(nmm_allocate(p->context, &model->monitor, (size_t)scene->n_monitor, sizeof(nmm_monitor)));
    for (int k = 0; k < scene->n_monitor; k++) {
        const nmm_scene_monitor *from = &scene->monitor[k];
        const nmm_vec2 place = nmm_vec2_sub(from->point, model->origin);
        const int e = nmm_model_find_element(model, place, p->touch);
        if (e < 0) {
            return nmm_scene_reject(p->context, scene, from->mark,
                                    "monitor '%s' lies outside of every block", from->name);
        }
        nmm_monitor *monitor = &model->monitor[model->n_monitor++];
        *monitor = (nmm_monitor){.element = e, .place = place};
        char *name = NULL;
        TRY(nmm_arena_text(p->context, &model->arena, &name, from->name, strlen(from->name)));
        monitor->name = name;
        nmm_element_weights(model, e, place, monitor->weight);
        monitor->displacement = from->displacement;
        monitor->velocity = from->velocity;
        monitor->stress = from->stress;
        initial_stress_at(scene, model, e, place, monitor->initial);
    }
    return NMM_OK;
}

static nmm_status copy_histories(placing *p, const nmm_scene *scene) {
    nmm_model *model = p->model;
    const size_t n = (size_t)scene->n_history;
    TRY(nmm_allocate(p->context, &model->history, n, sizeof(nmm_history)));
    for (int k = 0; k < scene->n_history; k++) {
        const nmm_history *from = &scene->history[k];
        const size_t count = (size_t)from->n * (size_t)(1 + from->width);
        nmm_history *to = &model->history[k];
        *to = (nmm_history){.n = from->n, .width = from->width};
        TRY(nmm_arena_take(p->context, &model->arena, &to->entry, count, sizeof(double)));
        memcpy(to->entry, from->entry, count * sizeof(double));
    }
    model->n_history = scene->n_history;
    return NMM_OK;
}

// Which covers are those of nodes.
static nmm_status mark_nodal(placing *p) {
    const nmm_model *model = p->model;
    TRY(nmm_allocate(p->context, &p->nodal, (size_t)model->n_cover, 1));
    for (int k = 0; k < 3 * model->n_element; k++)
        p->nodal[model->element_cover[model->n_local * (long)(k / 3) + k % 3]] = 1;
    return NMM_OK;
}

static nmm_status place_all(placing *p, nmm_scene *scene) {
    TRY(mark_nodal(p));
    TRY(copy_histories(p, scene));
    TRY(check_initial_stress(p, scene));
    for (int k = 0; k < scene->n_support; k++)
        TRY(place_support(p, scene, &scene->support[k]));
    for (int k = 0; k < scene->n_load; k++)
        TRY(place_load(p, scene, &scene->load[k]));
    return place_monitors(p, scene);
}

nmm_status nmm_loads_place(nmm_context *context, nmm_scene *scene, nmm_model *model) {
    placing p = {.context = context, .model = model, .touch = TOUCH * model->size};
    const nmm_status status = place_all(&p, scene);
    nmm_release(context, &p.nodal);
    return status;
}

// --- Start

// Order > 0: at the samples of element e.
static void start_samples(const nmm_scene *scene, const nmm_model *model, int e, nmm_state *state) {
    const int *node = model->element_cover + model->n_local * (long)e;
    for (int s = model->sample_start[e]; s < model->sample_start[e + 1]; s++) {
        nmm_vec2 place = {0, 0};
        for (int i = 0; i < 3; i++) {
            const double w = model->sample_linear[3 * (long)s + i];
            place.x += w * model->cover_place[2 * (long)node[i]];
            place.y += w * model->cover_place[2 * (long)node[i] + 1];
        }
        initial_stress_at(scene, model, e, place, state->sample_initial + 3 * (long)s);
    }
}

static void start_stress(const nmm_scene *scene, const nmm_model *model, nmm_state *state) {
    for (int e = 0; e < model->n_element && scene->initial.kind != NMM_INITIAL_NONE; e++) {
        const double *centre = model->element_centre + 2 * (long)e;
        double *stress = state->initial_stress + 3 * (long)e;
        initial_stress_at(scene, model, e, (nmm_vec2){centre[0], centre[1]}, stress);
        memcpy(state->stress + 3 * (long)e, stress, 3 * sizeof *stress);
        if (model->order > 0) start_samples(scene, model, e, state);
    }
    for (int s = 0; s < model->n_support; s++) {
        state->support_force[2 * s] = model->support[s].carried.x;
        state->support_force[2 * s + 1] = model->support[s].carried.y;
    }
}

// Centroid of a block from its elements.
static nmm_vec2 block_centre(const nmm_model *model, int block) {
    double area = 0;
    nmm_vec2 sum = {0, 0};
    for (int e = 0; e < model->n_element; e++) {
        if (model->element_block[e] != block) continue;
        area += model->element_area[e];
        sum.x += model->element_area[e] * model->element_centre[2 * e];
        sum.y += model->element_area[e] * model->element_centre[2 * e + 1];
    }
    return nmm_vec2_scale(area > 0 ? 1 / area : 0, sum);
}

static void start_velocity(const nmm_scene_block *from, const nmm_model *model, int block,
                           nmm_state *state) {
    const nmm_vec2 centre = block_centre(model, block);
    const double *v = from->velocity;
    for (int k = 0; k < 3 * model->n_element; k++) {
        if (model->element_block[k / 3] != block) continue;
        // Linear in the place of the node: a rigid motion exactly, without covers of edges.
        const int c = model->element_cover[model->n_local * (long)(k / 3) + k % 3];
        state->velocity[2 * c] = v[0] - v[2] * (model->cover_place[2 * c + 1] - centre.y);
        state->velocity[2 * c + 1] = v[1] + v[2] * (model->cover_place[2 * c] - centre.x);
    }
}

void nmm_loads_start(const nmm_scene *scene, const nmm_model *model, nmm_state *state) {
    start_stress(scene, model, state);
    for (int b = 0; b < model->n_block; b++) {
        const int from = model->block_scene[b];
        if (from < 0) continue;
        const double *v = scene->block[from].velocity;
        if (v[0] == 0 && v[1] == 0 && v[2] == 0) continue;
        start_velocity(&scene->block[from], model, b, state);
    }
}
