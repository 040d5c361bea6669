// SPDX-License-Identifier: MIT
//
// Domain, holes, regions, and blocks with their repetitions.

#include "build.h"

#include <stdio.h>
#include <string.h>

// --- Domain

// Entries of a list as areas; `material` says whether they have one. *all_good: none was wrong.
static nmm_status build_areas(nmm_builder *b, const raw_list *list, bool material,
                              nmm_scene_area **areas, bool *all_good) {
    nmm_scene_area *area = NULL;
    TRY(nmm_arena_take(b->reader->context, &b->scene->arena, &area, (size_t)list->n, sizeof *area));
    *areas = area;
    const raw_area *raw = list->item;
    *all_good = true;
    for (int i = 0; i < list->n; i++) {
        bool good = false;
        TRY(nmm_build_area(b, &raw[i], &area[i], &good));
        *all_good = *all_good && good;
        const bool readable = raw[i].head.node != NULL && raw[i].head.node->kind == NMM_NODE_MAP;
        if (material && readable)
            TRY(nmm_build_material_of(b, &raw[i].head, raw[i].material, &area[i].material));
    }
    return NMM_OK;
}

// Each area must touch the domain somewhere.
static nmm_status check_inside(nmm_builder *b, int n, const nmm_scene_area *area,
                               const char *what) {
    const nmm_scene *scene = b->scene;
    for (int i = 0; i < n && b->domain_good; i++) {
        bool meets = area[i].n == 0;
        for (int d = 0; d < scene->n_domain && !meets; d++)
            meets = nmm_areas_meet(&scene->domain[d], &area[i]);
        if (!meets)
            TRY(nmm_complain(b->reader, area[i].mark, "this %s lies outside the domain", what));
    }
    return NMM_OK;
}

static nmm_status check_presence(nmm_builder *b) {
    static const char *const part[] = {"holes", "regions", "joints", "joint_sets"};
    const raw_head *head = &b->raw->head;
    const bool domain = raw_given(head, "domain");
    if (domain && raw_good(head, "domain") && b->raw->domain.n == 0)
        TRY(nmm_complain(b->reader, raw_mark(head, "domain"), "the domain is empty"));
    if (!domain && !raw_given(head, "blocks"))
        return nmm_complain(b->reader, head->node->mark,
                            "the scene has no geometry; give it a domain, blocks, or both");
    if (!domain && raw_good(head, "blocks") && b->raw->blocks.n == 0)
        TRY(nmm_complain(b->reader, raw_mark(head, "blocks"), "blocks is empty"));
    for (size_t i = 0; i < sizeof part / sizeof *part && !domain; i++) {
        if (nmm_node_find(head->node, part[i]) != NULL)
            TRY(nmm_complain(b->reader, raw_key_mark(head, part[i]),
                             "%s without a domain; they cut the domain, and there is none",
                             part[i]));
    }
    return NMM_OK;
}

nmm_status nmm_build_domain(nmm_builder *b) {
    nmm_scene *scene = b->scene;
    TRY(check_presence(b));
    bool good = true;
    scene->n_domain = b->raw->domain.n;
    scene->n_hole = b->raw->holes.n;
    scene->n_region = b->raw->regions.n;
    TRY(build_areas(b, &b->raw->domain, true, &scene->domain, &b->domain_good));
    b->domain_good = b->domain_good && scene->n_domain > 0;
    for (int i = 0; i < scene->n_domain; i++)
        b->domain_box =
            nmm_box_join(b->domain_box, nmm_box_of(scene->domain[i].n, scene->domain[i].corner));
    b->box = nmm_box_join(b->box, b->domain_box);
    TRY(build_areas(b, &b->raw->holes, false, &scene->hole, &good));
    TRY(build_areas(b, &b->raw->regions, true, &scene->region, &good));
    TRY(check_inside(b, scene->n_hole, scene->hole, "hole"));
    return check_inside(b, scene->n_region, scene->region, "region");
}

// --- Blocks

static bool repeats(const raw_area *raw) {
    const raw_head *head = &raw->repeat.head;
    return head->node != NULL && raw_good(head, "count") && raw_good(head, "step") &&
           raw_good(head, "shift");
}

// Copies must not lie on each other.
static nmm_status check_step(nmm_builder *b, const raw_repeat *repeat) {
    const double step[2] = {repeat->step.x, repeat->step.y};
    for (int k = 0; k < 2; k++) {
        if (repeat->count[k] < 2 || step[k] != 0) continue;
        return nmm_complain(b->reader, raw_mark(&repeat->head, "step"),
                            "step along %s must not be 0 where count is %g", k == 0 ? "x" : "y",
                            repeat->count[k]);
    }
    return NMM_OK;
}

// Copies of all blocks together; complains where there are too many.
static nmm_status count_blocks(nmm_builder *b, int *total, bool *good) {
    const raw_area *raw = b->raw->blocks.item;
    double sum = 0;
    *good = true;
    for (int i = 0; i < b->raw->blocks.n; i++) {
        if (repeats(&raw[i])) TRY(check_step(b, &raw[i].repeat));
        sum += repeats(&raw[i]) ? raw[i].repeat.count[0] * raw[i].repeat.count[1] : 1;
        if (sum <= NMM_SCENE_MAX) continue;
        *good = false;
        return nmm_complain(b->reader, raw[i].head.node->mark,
                            "the scene comes to %.15g blocks here; at most %d are allowed", sum,
                            NMM_SCENE_MAX);
    }
    *total = (int)sum;
    return NMM_OK;
}

// Block `from` moved into `to`.
static nmm_status copy_block(nmm_builder *b, const nmm_scene_block *from, nmm_vec2 move,
                             nmm_scene_block *to) {
    const int n = from->area.n;
    *to = *from;
    TRY(nmm_arena_take(b->reader->context, &b->scene->arena, &to->area.corner, (size_t)n,
                       sizeof *to->area.corner));
    for (int k = 0; k < n; k++)
        to->area.corner[k] = nmm_vec2_add(from->area.corner[k], move);
    b->box = nmm_box_join(b->box, nmm_box_of(n, to->area.corner));
    return NMM_OK;
}

// All copies of one block, rows from below.
static nmm_status repeat_block(nmm_builder *b, const raw_area *raw, const nmm_scene_block *block) {
    nmm_scene *scene = b->scene;
    const bool many = repeats(raw);
    const raw_repeat *repeat = &raw->repeat;
    const int n_x = many ? (int)repeat->count[0] : 1, n_y = many ? (int)repeat->count[1] : 1;
    for (int j = 0; j < n_y; j++) {
        for (int i = 0; i < n_x; i++) {
            nmm_vec2 move = {0, 0};
            if (many) move = (nmm_vec2){i * repeat->step.x, j * repeat->step.y};
            if (many && j % 2 == 1) move = nmm_vec2_add(move, repeat->shift);
            TRY(copy_block(b, block, move, &scene->block[scene->n_block]));
            scene->n_block += 1;
        }
    }
    return NMM_OK;
}

nmm_status nmm_build_blocks(nmm_builder *b) {
    nmm_scene *scene = b->scene;
    const raw_list *list = &b->raw->blocks;
    const raw_area *raw = list->item;
    int total = 0;
    bool good = false;
    TRY(count_blocks(b, &total, &good));
    if (!good) return NMM_OK;
    TRY(nmm_arena_take(b->reader->context, &scene->arena, &scene->block, (size_t)total,
                       sizeof *scene->block));
    for (int i = 0; i < list->n; i++) {
        if (raw[i].head.node->kind != NMM_NODE_MAP) continue;
        nmm_scene_block block = {0};
        TRY(nmm_build_name(b, raw[i].name, "block", i + 1, &block.name));
        memcpy(block.velocity, raw[i].velocity, sizeof block.velocity);
        bool one = false;
        TRY(nmm_build_area(b, &raw[i], &block.area, &one));
        TRY(nmm_build_material_of(b, &raw[i].head, raw[i].material, &block.area.material));
        TRY(repeat_block(b, &raw[i], &block));
    }
    return NMM_OK;
}
