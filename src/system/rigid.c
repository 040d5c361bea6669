// SPDX-License-Identifier: MIT
//
// Springs of augmented contact. Carried forces take over what the springs hold, a share of
// k / (k + K) at a time, where K is the stiffness of the bodies beside; so k is a multiple of that
// at least, whatever penalty the scene gives. It goes by the length that a contact stands for, as
// the penalty does: else a uniform pressure would bring forces about that are far from uniform. In
// short steps K is mostly inertia, and k grows with it: carried forces that follow slowly, over
// many steps, would do work that nothing has stored. Where joints cross they stay as they are, and
// so they do in short steps whose passes find no end. Equation (5.14) of docs/theory/5-contact.md.

#include "system.h"

#include <math.h>

// Stiffness per length at least, as a multiple of the modulus of a confined body over the size.
#define LEAST 10.0

// Contacts of lengths below this part of the size, or this multiple of their overlap, stand for
// nothing but a crossing of joints.
#define SHORT 1e-5
#define DEEP 10.0

// Inertia over the stiffness of the covers, up to which a step is slow.
#define SLOW 0.01

// Stiffness of the local function i of element e, whose linear functions have the gradients g; of a
// curved one the order of magnitude.
static double stiffness_of(const nmm_elastic *elastic, double area, const double g[6], int i) {
    double square = 0;
    for (int k = 0; k < 6; k++)
        square += i >= 3 || k / 2 == i ? g[k] * g[k] : 0;
    return area * (2 * elastic->mu + nmm_max(0, elastic->lambda)) * square;
}

// The functions of a whole block have directions of their own, its stiffness must not: all three
// of them have the modulus over the radius of gyration squared, as they have a third of the mass.
static void stiffen_block(nmm_system *system, const nmm_model *model, int c) {
    double area = 0, moment = 0, modulus = 0, sum[2] = {0, 0};
    for (int k = model->cover_start[c]; k < model->cover_start[c + 1]; k++) {
        const int e = model->cover_element[k] / model->n_local;
        const nmm_elastic elastic = system->elastic[model->element_material[e]];
        const double A = model->element_area[e], *I = model->element_moment + 3 * (long)e;
        // Seen from the cover's own place: places far from the origin have fewer digits.
        const double x = model->element_centre[2 * (long)e] - model->cover_place[2 * (long)c];
        const double y =
            model->element_centre[2 * (long)e + 1] - model->cover_place[2 * (long)c + 1];
        area += A;
        sum[0] += A * x;
        sum[1] += A * y;
        moment += I[0] + I[2] + A * (x * x + y * y);
        modulus += A * (2 * elastic.mu + nmm_max(0, elastic.lambda));
    }
    moment -= (sum[0] * sum[0] + sum[1] * sum[1]) / area;
    system->cover_give[2 * (long)c] = modulus * area / moment;
}

nmm_status nmm_system_measure(nmm_context *context, nmm_system *system, const nmm_model *model) {
    TRY(nmm_allocate(context, &system->cover_give, 2 * (size_t)model->n_cover, sizeof(double)));
    for (int k = 0; k < model->n_local * model->n_element; k++) {
        const int e = k / model->n_local;
        const double *g = model->element_gradient + 6 * (long)e;
        system->cover_give[2 * (long)model->element_cover[k]] +=
            stiffness_of(&system->elastic[model->element_material[e]], model->element_area[e], g,
                         k % model->n_local);
    }
    for (int c = 0; c < model->n_cover && model->whole_blocks; c++)
        stiffen_block(system, model, c);
    for (int c = 0; c < model->n_cover; c++) {
        for (int k = system->base_start[c]; k < system->base_start[c + 1]; k++)
            if (system->base_col[k] == c)
                system->cover_give[2 * (long)c + 1] = system->base_mass[k];
    }
    return NMM_OK;
}

double nmm_system_carrying_step(const nmm_system *system, int n_cover) {
    double longest = 0;
    for (int c = 0; c < n_cover && system->cover_give != NULL; c++) {
        if (system->fixed != NULL && system->fixed[c] == 3) continue;
        const double *give = system->cover_give + 2 * (long)c;
        longest = nmm_max(longest, 2 * give[1] / (SLOW * give[0]));
    }
    return sqrt(longest);
}

// How far a place gives under a unit force, cover by cover, if only elasticity or only inertia
// resists [m/N]; held covers do not.
typedef struct give {
    double elastic, inertial;
} give;

static void add_give(const nmm_system *system, const nmm_model *model, int v, double along,
                     give *all) {
    const int n = model->n_local;
    const double *weight = model->edge_weight + 2L * n * v;
    for (int i = 0; i < n; i++) {
        const int c = model->element_cover[n * (long)model->edge_element[v] + i];
        if (system->fixed != NULL && system->fixed[c] == 3) continue;
        const double w = (1 - along) * weight[i] + along * weight[n + i];
        all->elastic += w * w / system->cover_give[2 * (long)c];
        all->inertial += w * w / system->cover_give[2 * (long)c + 1];
    }
}

// A short step after long ones may begin with the force of an impact, which in a long step is more
// than anything will hold: what is carried on is no more than was held twice.
static void limit_carried(nmm_contact *contact) {
    const double carried = contact->carried_normal;
    const double held = nmm_min(contact->normal_force, contact->force_before);
    if (contact->bonded || !(carried > 0 && held < carried)) return;
    contact->carried_normal = nmm_max(0, held);
    contact->carried_shear *= contact->carried_normal / carried;
}

// After a short step springs hold forces. Stiffer ones hold the same by less of a way: else they
// would do a work that nothing has stored. And what gave way along the edge has been gone: carried
// forces, which know no energy, must not take it back.
static void keep_forces(const nmm_model *model, const nmm_state *state, nmm_contact *contact,
                        nmm_overlaps overlaps) {
    if (contact->mode == NMM_CONTACT_OPEN) return;
    if (!contact->hasty) contact->carried_shear = contact->shear_force;
    if (!contact->hasty && overlaps == NMM_OVERLAPS_STAY)
        contact->carried_normal = contact->normal_force;
    nmm_contact_keep(model, state, contact, contact->gap);
}

// Of a confined body, and what inertia [1/s2] adds to it over the size of a cover.
static double confined_modulus(const nmm_system *system, const nmm_model *model, int edge,
                               double inertia) {
    const int m = model->element_material[model->edge_element[edge]];
    const nmm_elastic *elastic = &system->elastic[m];
    return 2 * elastic->mu + nmm_max(0, elastic->lambda) +
           inertia * model->material[m].density * model->size * model->size;
}

static double least_stiffness(const nmm_system *system, const nmm_model *model,
                              const nmm_contact *contact, double inertia) {
    const int v = contact->vertex;
    const double both =
        nmm_contact_modulus(confined_modulus(system, model, v, inertia),
                            confined_modulus(system, model, model->vertex_prev[v], inertia),
                            confined_modulus(system, model, contact->edge, inertia));
    return LEAST * both * contact->spring_length / model->size;
}

// Where joints cross, the blocks across share no more than a rounding or what they overlap by. To
// keep such places apart for certain asks for forces of any size, one against the other; as in the
// penalty method, springs in proportion to the length are enough.
static bool is_crossing(const nmm_model *model, const nmm_contact *contact) {
    const double overlap = fabs(contact->gap - contact->rest);
    return contact->spring_length < nmm_max(SHORT * model->size, DEEP * overlap);
}

// The step is short where inertia holds the covers rather than their stiffness does, or more than
// the springs do (a hard body on a soft one that is held).
static bool is_short(const give *all, double inertia, double least) {
    return inertia * all->elastic > SLOW * all->inertial || inertia > least * all->inertial;
}

nmm_carried nmm_system_stiffen(const nmm_system *system, const nmm_model *model, nmm_state *state,
                               double h, nmm_carrying how) {
    nmm_carried carried = {false, false};
    if (system->cover_give == NULL) return carried;
    const double inertia = 2 / (h * h) + 2 * system->damping / h;
    for (int k = 0; k < state->n_contact; k++) {
        nmm_contact *contact = &state->contact[k];
        give all = {0, 0};
        add_give(system, model, contact->vertex, 0, &all);
        add_give(system, model, contact->edge, nmm_max(0, nmm_min(1, contact->anchor)), &all);
        // Between what is held there is nothing to hold.
        if (!(all.elastic > 0)) continue;
        double least = least_stiffness(system, model, contact, 0);
        const bool quick = is_short(&all, inertia, least), was_hasty = contact->hasty;
        contact->hasty = (quick && how.alone) || is_crossing(model, contact);
        if (quick && !contact->hasty) least = least_stiffness(system, model, contact, inertia);
        const bool softened = how.gentle && !contact->hasty;
        const double own[2] = {softened ? 0 : contact->normal_stiffness,
                               softened ? 0 : contact->shear_stiffness};
        carried.stiff |= !contact->hasty && own[0] > least;
        carried.quick |= quick && !contact->hasty;
        contact->normal_stiffness = nmm_max(own[0], least);
        contact->shear_stiffness = nmm_max(own[1], least / 2.5);
        if (was_hasty && how.overlaps != NMM_OVERLAPS_AT_REST)
            keep_forces(model, state, contact, quick ? NMM_OVERLAPS_STAY : how.overlaps);
        if (contact->hasty) limit_carried(contact);
        contact->force_before = contact->normal_force;
    }
    return carried;
}
