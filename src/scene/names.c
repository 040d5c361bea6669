// SPDX-License-Identifier: MIT
//
// Materials, interfaces and the names that refer to them. Where one material (or interface) is all
// there is, it serves whoever names none.

#include "build.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

// The friction of contacts when a scene says nothing [degrees].
#define DEFAULT_FRICTION 30.0

// --- Materials

nmm_status nmm_build_materials(nmm_builder *b) {
    nmm_context *context = b->reader->context;
    nmm_scene *scene = b->scene;
    const raw_list *list = &b->raw->materials;
    if (raw_good(&b->raw->head, "materials") && list->n == 0)
        TRY(nmm_complain(b->reader, raw_mark(&b->raw->head, "materials"),
                         "materials is empty; at least one material is needed"));
    TRY(nmm_arena_take(context, &scene->arena, &scene->material, (size_t)list->n,
                       sizeof *scene->material));
    TRY(nmm_arena_take(context, &scene->arena, &scene->material_name, (size_t)list->n,
                       sizeof *scene->material_name));
    scene->n_material = list->n;
    const raw_material *raw = list->item;
    for (int i = 0; i < list->n; i++) {
        scene->material[i] = (nmm_material){.density = raw[i].density,
                                            .youngs_modulus = raw[i].youngs_modulus,
                                            .poissons_ratio = raw[i].poissons_ratio,
                                            .plane = (nmm_plane)raw[i].plane};
        TRY(nmm_build_name(b, raw[i].head.name, "material", i + 1, &scene->material_name[i]));
    }
    return NMM_OK;
}

// Cork and osmium: densities between them are common.
#define LEAST_DENSITY 100.0
#define MOST_DENSITY 25000.0

// What the stress of the own weight over the scene strains, where small strains end.
#define MOST_WEIGHT 0.1

// From here on triangles of uniform strain are far too stiff in plane strain: beams of four covers
// bend three times as far off as at 0.25, and ten times at 0.499.
#define MOST_POISSON 0.48

// What hardly changes its volume leaves linear functions too little freedom.
static bool is_locked(const raw_scene *raw, const nmm_material *m) {
    return raw->covers.mesh == NMM_MESH_LATTICE && raw->covers.order <= 0 &&
           m->plane == NMM_PLANE_STRAIN && m->poissons_ratio > MOST_POISSON;
}

// A number without its unit: t/m3 or kN/m3 of a density, GPa or MPa of a modulus.
nmm_status nmm_build_warn_materials(nmm_builder *b) {
    nmm_scene *scene = b->scene;
    const raw_material *raw = b->raw->materials.item;
    const nmm_vec2 g = scene->gravity;
    const double depth =
        fabs(g.x) * (b->box.high.x - b->box.low.x) + fabs(g.y) * (b->box.high.y - b->box.low.y);
    for (int i = 0; i < scene->n_material; i++) {
        const nmm_material *m = &scene->material[i];
        if (!raw_good(&raw[i].head, "density") || !raw_good(&raw[i].head, "youngs_modulus"))
            continue;
        if (m->density < LEAST_DENSITY || m->density > MOST_DENSITY)
            TRY(nmm_scene_warn(b->reader->context, scene, raw_mark(&raw[i].head, "density"),
                               "density of %g kg/m3: no rock, soil or metal has it; another unit "
                               "is written behind the number, as in 2.6 t/m3",
                               m->density));
        const double strain = m->density * depth / m->youngs_modulus;
        if (strain > MOST_WEIGHT)
            TRY(nmm_scene_warn(
                b->reader->context, scene, raw_mark(&raw[i].head, "youngs_modulus"),
                "youngs_modulus of %g Pa: weight over the height of the scene is %.2g "
                "of it; another unit is written behind the number, as in 5 GPa",
                m->youngs_modulus, strain));
        if (raw_good(&raw[i].head, "poissons_ratio") && is_locked(b->raw, m))
            TRY(nmm_scene_warn(b->reader->context, scene, raw_mark(&raw[i].head, "poissons_ratio"),
                               "poissons_ratio of %g with covers.order 0: triangles of uniform "
                               "strain that keep their area are too stiff (locking), so what "
                               "bends or shears moves too little; covers.order 1 is right",
                               m->poissons_ratio));
    }
    return NMM_OK;
}

// "; defined: a, b, c" for messages, cut where it gets long.
typedef struct name_list {
    char text[160];
} name_list;

static name_list list_names(int n, const char *const *name) {
    name_list list = {"; none is defined"};
    size_t used = 0;
    for (int i = 0; i < n && used < 100; i++) {
        const int wrote = snprintf(list.text + used, sizeof list.text - used, "%s%.50s",
                                   i == 0 ? "; defined: " : ", ", nmm_excerpt_of(name[i]).text);
        used += (size_t)wrote;
        if (i + 1 < n && used >= 100) snprintf(list.text + used, sizeof list.text - used, ", ...");
    }
    return list;
}

static int find_name(int n, const char *const *name, const char *wanted) {
    for (int i = 0; i < n; i++) {
        if (strcmp(name[i], wanted) == 0) return i;
    }
    return -1;
}

nmm_status nmm_build_material_of(nmm_builder *b, const raw_head *head, const char *name,
                                 int *index) {
    const nmm_scene *scene = b->scene;
    *index = 0;
    // Without materials one complaint is enough; a name that is wrong has its own.
    if (!raw_good(&b->raw->head, "materials") || scene->n_material == 0) return NMM_OK;
    if (raw_given(head, "material") && name == NULL) return NMM_OK;
    if (name == NULL) {
        b->n_filled_material += 1;
        if (scene->n_material == 1) return NMM_OK;
        return nmm_complain(b->reader, head->node->mark,
                            "'material' is missing; it may be left out only where one material is "
                            "defined, and there are %d",
                            scene->n_material);
    }
    *index = find_name(scene->n_material, scene->material_name, name);
    if (*index >= 0) return NMM_OK;
    return nmm_complain(b->reader, raw_mark(head, "material"), "no material is named '%s'%s%s",
                        nmm_excerpt_of(name).text,
                        nmm_hint(name, scene->n_material, scene->material_name).text,
                        list_names(scene->n_material, scene->material_name).text);
}

// --- Interfaces

static double tangent(double degrees) {
    return tan(degrees * (PI / 180));
}

static nmm_status convert_interface(nmm_builder *b, const raw_interface *raw, int index) {
    const bool residual = raw_given(&raw->head, "residual_friction_angle");
    nmm_interface *interface = &b->scene->interface[index];
    *interface = (nmm_interface){.friction = tangent(raw->friction_angle),
                                 .cohesion = raw->cohesion,
                                 .tensile_strength = raw->tensile_strength,
                                 .normal_stiffness = raw->normal_stiffness,
                                 .shear_stiffness = raw->shear_stiffness};
    interface->residual_friction =
        residual ? tangent(raw->residual_friction_angle) : interface->friction;
    TRY(nmm_build_name(b, raw->head.name, "interface", index, &b->scene->interface_name[index]));
    if (residual || !raw_good(&raw->head, "friction_angle")) return NMM_OK;
    char path[120], value[32];
    snprintf(path, sizeof path, "%.60s.residual_friction_angle", raw->head.path);
    snprintf(value, sizeof value, "%g", raw->friction_angle);
    return nmm_note(b->reader, path, value, "friction does not change when the bond breaks");
}

// Which named interface is the default: the one asked for, the only one, or none (-1).
static nmm_status choose_default(nmm_builder *b, int *chosen) {
    const raw_list *list = &b->raw->interfaces;
    const raw_interface *raw = list->item;
    const char *wanted = b->raw->interface;
    *chosen = -1;
    if (wanted == NULL) {
        if (list->n == 1) {
            *chosen = 0;
            return nmm_note(b->reader, "interface", raw[0].head.name, "the only interface");
        }
        if (raw_given(&b->raw->head, "interface")) return NMM_OK;
        return nmm_note(b->reader, "interface", "friction 30 degrees, cohesion 0",
                        "contacts that no joint names; nothing else is given");
    }
    const char **candidate = NULL;
    TRY(nmm_arena_take(b->reader->context, &b->reader->arena, &candidate, (size_t)list->n,
                       sizeof *candidate));
    for (int i = 0; i < list->n; i++)
        candidate[i] = raw[i].head.name;
    *chosen = find_name(list->n, candidate, wanted);
    const bool known = raw_good(&b->raw->head, "interfaces");
    if (*chosen >= 0 || (!known && raw_given(&b->raw->head, "interfaces"))) return NMM_OK;
    return nmm_complain(b->reader, raw_mark(&b->raw->head, "interface"),
                        "no interface is named '%s'%s%s", nmm_excerpt_of(wanted).text,
                        nmm_hint(wanted, list->n, candidate).text,
                        list_names(list->n, candidate).text);
}

nmm_status nmm_build_interfaces(nmm_builder *b) {
    nmm_scene *scene = b->scene;
    const raw_list *list = &b->raw->interfaces;
    const raw_interface *raw = list->item;
    int chosen = -1;
    TRY(choose_default(b, &chosen));
    const int n = list->n + (chosen < 0 ? 1 : 0);
    TRY(nmm_arena_take(b->reader->context, &scene->arena, &scene->interface, (size_t)n,
                       sizeof *scene->interface));
    TRY(nmm_arena_take(b->reader->context, &scene->arena, &scene->interface_name, (size_t)n,
                       sizeof *scene->interface_name));
    scene->n_interface = n;
    // Entry 0 is the default; the others follow in the order of the file.
    int next = 1;
    for (int i = 0; i < list->n; i++)
        TRY(convert_interface(b, &raw[i], i == chosen ? 0 : next++));
    if (chosen >= 0) return NMM_OK;
    const double friction = tangent(DEFAULT_FRICTION);
    scene->interface[0] = (nmm_interface){.friction = friction, .residual_friction = friction};
    scene->interface_name[0] = "default";
    return NMM_OK;
}

nmm_status nmm_build_interface_of(nmm_builder *b, const raw_head *head, const char *name,
                                  int *index) {
    const nmm_scene *scene = b->scene;
    *index = 0;
    if (name == NULL) {
        b->n_filled_interface += 1;
        return NMM_OK;
    }
    const bool known = raw_good(&b->raw->head, "interfaces");
    if (!known && raw_given(&b->raw->head, "interfaces")) return NMM_OK;
    // Without any interfaces the built-in default has no name to be used.
    const int n = known ? scene->n_interface : 0;
    *index = find_name(n, scene->interface_name, name);
    if (*index >= 0) return NMM_OK;
    *index = 0;
    return nmm_complain(b->reader, raw_mark(head, "interface"), "no interface is named '%s'%s%s",
                        nmm_excerpt_of(name).text, nmm_hint(name, n, scene->interface_name).text,
                        list_names(n, scene->interface_name).text);
}

// --- Names of entries

typedef struct name_place {
    const char *name;
    nmm_mark mark;
} name_place;

static int compare_names(const void *a, const void *b) {
    const name_place *p = a, *q = b;
    const int order = strcmp(p->name, q->name);
    if (order != 0) return order;
    if (p->mark.source != q->mark.source) return p->mark.source < q->mark.source ? -1 : 1;
    if (p->mark.line != q->mark.line) return p->mark.line < q->mark.line ? -1 : 1;
    return (p->mark.column > q->mark.column) - (p->mark.column < q->mark.column);
}

nmm_status nmm_build_check_names(nmm_builder *b, const raw_list *list, size_t name_offset) {
    name_place *place = NULL;
    TRY(nmm_arena_take(b->reader->context, &b->reader->arena, &place, (size_t)list->n,
                       sizeof *place));
    int n = 0;
    const char *item = list->item;
    for (int i = 0; i < list->n; i++) {
        const raw_head *head = (const raw_head *)(const void *)item;
        const size_t size = head->object->size;
        const char *name = NULL;
        memcpy(&name, item + name_offset, sizeof name);
        if (name != NULL) place[n++] = (name_place){name, raw_mark(head, "name")};
        item += size;
    }
    if (n > 1) qsort(place, (size_t)n, sizeof *place, compare_names);
    for (int i = 1; i < n; i++) {
        if (strcmp(place[i - 1].name, place[i].name) != 0) continue;
        TRY(nmm_complain(b->reader, place[i].mark, "name '%s' is already taken in line %d",
                         nmm_excerpt_of(place[i].name).text, place[i - 1].mark.line));
    }
    return NMM_OK;
}

nmm_status nmm_build_name(nmm_builder *b, const char *name, const char *what, int number,
                          const char **result) {
    char made[60];
    snprintf(made, sizeof made, "%s %d", what, number);
    if (name == NULL) name = made;
    char *copy = NULL;
    TRY(nmm_arena_text(b->reader->context, &b->scene->arena, &copy, name, strlen(name)));
    *result = copy;
    return NMM_OK;
}
