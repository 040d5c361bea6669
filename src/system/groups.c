// SPDX-License-Identifier: MIT
//
// Groups of supports that share one carried traction, eq. (4.7). To raise it point by point would
// lock the covers that a supported line cuts: there are as many points as unknowns. Groups divide
// what a block has of the line, not the line itself: a joint would leave remnants shorter than a
// cover, which together with the group beside them would lock the covers that they share.

#include "system.h"

#include <math.h>

// Points of a supported line share their carried traction over this many cover sizes.
#define GROUP_LENGTH 1.5

// What a block and material have of a line. Materials have groups of their own: pressures on them
// are far apart where stiffnesses are.
typedef struct reach {
    int block, material;
    double low, high; // [m] along the line
    int first, n;     // groups
} reach;

typedef struct reaches {
    nmm_context *context;
    nmm_model *model;
    nmm_vec2 a, b; // the line
    reach *reach;
    int n, capacity;
} reaches;

static double place_along(const reaches *r, nmm_vec2 place) {
    const nmm_vec2 ab = nmm_vec2_sub(r->b, r->a), off = nmm_vec2_sub(place, r->a);
    const double length = sqrt(nmm_vec2_dot(ab, ab));
    return length > 0 ? nmm_vec2_dot(ab, off) / length : 0;
}

// The reach that a support belongs to, most often the last one; NULL: none so far.
static reach *reach_of(const reaches *r, const nmm_support *support) {
    const int block = r->model->element_block[support->element];
    const int material = r->model->element_material[support->element];
    for (int k = r->n - 1; k >= 0; k--)
        if (r->reach[k].block == block && r->reach[k].material == material) return &r->reach[k];
    return NULL;
}

static nmm_status widen(reaches *r, const nmm_support *support) {
    const double along = place_along(r, support->place);
    reach *own = reach_of(r, support);
    if (own == NULL) {
        TRY(nmm_grow(r->context, &r->reach, &r->capacity, r->n + 1, sizeof *r->reach));
        own = &r->reach[r->n++];
        *own = (reach){.block = r->model->element_block[support->element],
                       .material = r->model->element_material[support->element],
                       .low = along,
                       .high = along};
    }
    own->low = nmm_min(own->low, along);
    own->high = nmm_max(own->high, along);
    return NMM_OK;
}

static void number_groups(reaches *r) {
    nmm_model *model = r->model;
    for (int k = 0; k < r->n; k++) {
        reach *own = &r->reach[k];
        own->first = model->n_support_group;
        own->n = nmm_max_int(1, (int)((own->high - own->low) / (GROUP_LENGTH * model->size)));
        model->n_support_group += own->n;
    }
}

static void join_group(const reaches *r, nmm_support *support) {
    const reach *own = reach_of(r, support);
    const double length = own->high - own->low, along = place_along(r, support->place) - own->low;
    const int part = length > 0 ? (int)(own->n * (along / length)) : 0;
    support->group = own->first + nmm_min_int(own->n - 1, part);
}

nmm_status nmm_supports_group(nmm_context *context, nmm_model *model, nmm_vec2 a, nmm_vec2 b,
                              int first) {
    reaches r = {.context = context, .model = model, .a = a, .b = b};
    nmm_status status = NMM_OK;
    for (int s = first; s < model->n_support && status == NMM_OK; s++)
        status = widen(&r, &model->support[s]);
    if (status == NMM_OK) {
        number_groups(&r);
        for (int s = first; s < model->n_support; s++)
            join_group(&r, &model->support[s]);
    }
    nmm_release(context, &r.reach);
    return status;
}
