// SPDX-License-Identifier: MIT
//
// Supports, loads, monitors, and the histories that drive them.

#include "build.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// --- Histories

nmm_status nmm_build_history(nmm_builder *b, const raw_rows *rows, const char *key,
                             nmm_history *history) {
    const int stride = rows->width;
    for (int i = 1; i < rows->n; i++) {
        const double before = rows->value[(i - 1) * stride], time = rows->value[i * stride];
        if (time > before) continue;
        return nmm_complain(b->reader, nmm_node_at(rows->node, i)->mark,
                            "times in %s must ascend, found %g s after %g s", key, time, before);
    }
    *history = (nmm_history){.n = rows->n, .width = stride - 1};
    const size_t n = (size_t)rows->n * (size_t)stride;
    TRY(nmm_arena_take(b->reader->context, &b->scene->arena, &history->entry, n,
                       sizeof *history->entry));
    if (n > 0) memcpy(history->entry, rows->value, n * sizeof *history->entry);
    return NMM_OK;
}

// The history of a support or load as the next of the scene's; -1 where there is none.
static nmm_status take_history(nmm_builder *b, const raw_place *raw, const char *key, int *index) {
    *index = -1;
    if (!raw_good(&raw->head, key)) return NMM_OK;
    nmm_history *history = &b->scene->history[b->scene->n_history];
    TRY(nmm_build_history(b, &raw->history, key, history));
    if (history->n == 0) return NMM_OK;
    *index = b->scene->n_history;
    b->scene->n_history += 1;
    return NMM_OK;
}

// --- Places

static nmm_status check_ends(nmm_builder *b, const raw_place *raw, const char *key, nmm_vec2 p,
                             nmm_vec2 q) {
    const bool box = strcmp(key, "box") == 0;
    const bool flat = box ? p.x == q.x || p.y == q.y : p.x == q.x && p.y == q.y;
    if (!flat) return NMM_OK;
    return nmm_complain(b->reader, raw_mark(&raw->head, key), "the %s has no %s", key,
                        box ? "area; its corners must be opposite" : "length");
}

static bool has_block(const nmm_builder *b, const char *name) {
    for (int i = 0; i < b->scene->n_block; i++) {
        if (strcmp(b->scene->block[i].name, name) == 0) return true;
    }
    return false;
}

static nmm_status check_block(nmm_builder *b, const raw_place *raw) {
    const raw_list *list = &b->raw->blocks;
    const bool unread = raw_given(&b->raw->head, "blocks") && b->scene->n_block == 0;
    if (unread || has_block(b, raw->block)) return NMM_OK;
    const char **candidate = NULL;
    TRY(nmm_arena_take(b->reader->context, &b->reader->arena, &candidate, (size_t)list->n,
                       sizeof *candidate));
    for (int i = 0; i < list->n; i++)
        candidate[i] = ((const raw_area *)list->item)[i].name;
    return nmm_complain(b->reader, raw_mark(&raw->head, "block"), "no block is named '%s'%s",
                        nmm_excerpt_of(raw->block).text,
                        nmm_hint(raw->block, list->n, candidate).text);
}

typedef struct place {
    nmm_place_kind kind;
    nmm_vec2 a, b;
} place;

// The place of a support or load; keys that it may not have are never good.
static nmm_status read_place(nmm_builder *b, const raw_place *raw, bool load, place *found) {
    const raw_head *head = &raw->head;
    if (raw_good(head, "point")) *found = (place){NMM_PLACE_POINT, raw->point, raw->point};
    if (raw_good(head, "segment")) {
        const double *v = raw->segment.value;
        *found = (place){NMM_PLACE_SEGMENT, {v[0], v[1]}, {v[2], v[3]}};
        TRY(check_ends(b, raw, "segment", found->a, found->b));
    }
    if (load) return NMM_OK;
    if (raw_good(head, "box")) {
        const double *v = raw->box.value;
        const nmm_vec2 corner[2] = {{v[0], v[1]}, {v[2], v[3]}};
        const nmm_box box = nmm_box_of(2, corner);
        *found = (place){NMM_PLACE_BOX, box.low, box.high};
        TRY(check_ends(b, raw, "box", box.low, box.high));
    }
    if (!raw_good(head, "block")) return NMM_OK;
    found->kind = NMM_PLACE_BLOCK;
    return check_block(b, raw);
}

// --- Supports

// A motion along a direction that is free would be lost.
static nmm_status check_motion(nmm_builder *b, const raw_place *raw) {
    for (int i = 0; i < raw->history.n; i++) {
        const double *row = raw->history.value + 3 * i;
        const bool lost_x = row[1] != 0 && (raw->fix & 1) == 0;
        const bool lost_y = row[2] != 0 && (raw->fix & 2) == 0;
        if (!lost_x && !lost_y) continue;
        const nmm_node *node = nmm_node_at(raw->history.node, i);
        return nmm_complain(b->reader, nmm_node_at(node, lost_x ? 1 : 2)->mark,
                            "motion along %s, but fix is %s; it must be xy or %s",
                            lost_x ? "x" : "y", lost_x ? "y" : "x", lost_x ? "x" : "y");
    }
    return NMM_OK;
}

static nmm_status build_support(nmm_builder *b, const raw_place *raw) {
    nmm_scene_support support = {.history = -1, .mark = raw->head.node->mark};
    if (raw->head.node->kind != NMM_NODE_MAP) return NMM_OK;
    place where = {0};
    TRY(read_place(b, raw, false, &where));
    support.kind = where.kind;
    support.a = where.a;
    support.b = where.b;
    support.block = raw->block;
    support.fix_x = (raw->fix & 1) != 0;
    support.fix_y = (raw->fix & 2) != 0;
    if (raw_good(&raw->head, "motion") && raw_good(&raw->head, "fix")) TRY(check_motion(b, raw));
    TRY(take_history(b, raw, "motion", &support.history));
    b->scene->support[b->scene->n_support++] = support;
    return NMM_OK;
}

static int compare_points(nmm_vec2 a, nmm_vec2 b) {
    if (a.x != b.x) return a.x < b.x ? -1 : 1;
    return (a.y > b.y) - (a.y < b.y);
}

// Order of supports by their places; 0: the same place, a segment either way round.
static int compare_places(const nmm_scene_support *s, const nmm_scene_support *t) {
    if (s->kind != t->kind) return s->kind < t->kind ? -1 : 1;
    if (s->kind == NMM_PLACE_BLOCK) return strcmp(s->block, t->block);
    const bool s_turned = compare_points(s->a, s->b) > 0, t_turned = compare_points(t->a, t->b) > 0;
    const int first = compare_points(s_turned ? s->b : s->a, t_turned ? t->b : t->a);
    return first != 0 ? first : compare_points(s_turned ? s->a : s->b, t_turned ? t->a : t->b);
}

typedef struct support_entry {
    const nmm_scene_support *support;
} support_entry;

static int compare_supports(const void *a, const void *b) {
    const nmm_scene_support *s = ((const support_entry *)a)->support;
    const nmm_scene_support *t = ((const support_entry *)b)->support;
    const int places = compare_places(s, t);
    return places != 0 ? places : (s > t) - (s < t);
}

// Is the motion along direction k (0: x, 1: y) the same? No history is a motion of 0.
static bool same_motion(const nmm_scene *scene, const nmm_scene_support *s,
                        const nmm_scene_support *t, int k) {
    static const nmm_history rest = {0};
    const nmm_history *p = s->history >= 0 ? &scene->history[s->history] : &rest;
    const nmm_history *q = t->history >= 0 ? &scene->history[t->history] : &rest;
    const int n = nmm_max_int(p->n, q->n);
    for (int i = 0; i < n; i++) {
        const bool timed = i < p->n && i < q->n && p->entry[3 * i] == q->entry[3 * i];
        const double u = i < p->n ? p->entry[3 * i + 1 + k] : 0;
        const double v = i < q->n ? q->entry[3 * i + 1 + k] : 0;
        if (u != v || (u != 0 && !timed)) return false;
    }
    return true;
}

static nmm_status warn_conflict(nmm_builder *b, const nmm_scene_support *before,
                                const nmm_scene_support *after) {
    nmm_scene *scene = b->scene;
    const bool x = before->fix_x && after->fix_x && !same_motion(scene, before, after, 0);
    const bool y = before->fix_y && after->fix_y && !same_motion(scene, before, after, 1);
    if (!x && !y) return NMM_OK;
    return nmm_scene_warn(b->reader->context, scene, after->mark,
                          "this support and the one at line %d hold the same place along %s with "
                          "different motions; it will follow neither",
                          before->mark.line,
                          x && y ? "x and y"
                          : x    ? "x"
                                 : "y");
}

// Supports of one place that ask for different motions.
static nmm_status check_supports(nmm_builder *b) {
    nmm_scene *scene = b->scene;
    support_entry *sorted = NULL;
    const size_t n = (size_t)scene->n_support;
    TRY(nmm_arena_take(b->reader->context, &b->reader->arena, &sorted, n, sizeof *sorted));
    for (size_t i = 0; i < n; i++)
        sorted[i].support = &scene->support[i];
    if (n > 1) qsort(sorted, n, sizeof *sorted, compare_supports);
    for (size_t i = 1; i < n; i++) {
        const nmm_scene_support *before = sorted[i - 1].support, *after = sorted[i].support;
        if (compare_places(before, after) == 0) TRY(warn_conflict(b, before, after));
    }
    return NMM_OK;
}

// --- Loads

// A force belongs to a point, a traction to a segment.
static nmm_status check_value(nmm_builder *b, const raw_place *raw, bool point) {
    const char *wanted = point ? "force" : "traction", *other = point ? "traction" : "force";
    const char *where = point ? "point" : "segment";
    const raw_head *head = &raw->head;
    if (raw_given(head, other))
        return nmm_complain(b->reader, raw_key_mark(head, other), "%s does not go with %s; use %s",
                            other, where, wanted);
    if (raw_given(head, wanted)) return NMM_OK;
    return nmm_complain(b->reader, head->node->mark, "a load at a %s needs a %s", where, wanted);
}

static nmm_status build_load(nmm_builder *b, const raw_place *raw) {
    nmm_scene_load load = {.history = -1, .mark = raw->head.node->mark};
    if (raw->head.node->kind != NMM_NODE_MAP) return NMM_OK;
    const bool point = raw_given(&raw->head, "point");
    if (point != raw_given(&raw->head, "segment")) TRY(check_value(b, raw, point));
    place where = {0};
    TRY(read_place(b, raw, true, &where));
    load.kind = where.kind;
    load.a = where.a;
    load.b = where.b;
    load.value = point ? raw->force : raw->traction;
    TRY(take_history(b, raw, "history", &load.history));
    b->scene->load[b->scene->n_load++] = load;
    return NMM_OK;
}

// --- Monitors

static nmm_status build_monitor(nmm_builder *b, const raw_monitor *raw, int number) {
    if (raw->head.node->kind != NMM_NODE_MAP) return NMM_OK;
    nmm_scene_monitor monitor = {.point = raw->point,
                                 .displacement = (raw->record & 1) != 0,
                                 .velocity = (raw->record & 2) != 0,
                                 .stress = (raw->record & 4) != 0,
                                 .mark = raw->head.node->mark};
    TRY(nmm_build_name(b, raw->name, "monitor", number, &monitor.name));
    if (raw_good(&raw->head, "record") && raw->record == 0)
        return nmm_complain(b->reader, raw_mark(&raw->head, "record"),
                            "record is empty; leave it out to record everything");
    b->scene->monitor[b->scene->n_monitor++] = monitor;
    return NMM_OK;
}

// --- All

static nmm_status make_room(nmm_builder *b) {
    nmm_context *context = b->reader->context;
    nmm_scene *scene = b->scene;
    const size_t n_support = (size_t)b->raw->supports.n, n_load = (size_t)b->raw->loads.n;
    const size_t n_monitor = (size_t)b->raw->monitors.n;
    TRY(nmm_arena_take(context, &scene->arena, &scene->support, n_support, sizeof *scene->support));
    TRY(nmm_arena_take(context, &scene->arena, &scene->load, n_load, sizeof *scene->load));
    TRY(nmm_arena_take(context, &scene->arena, &scene->monitor, n_monitor, sizeof *scene->monitor));
    return nmm_arena_take(context, &scene->arena, &scene->history, n_support + n_load,
                          sizeof *scene->history);
}

nmm_status nmm_build_places(nmm_builder *b) {
    const raw_scene *raw = b->raw;
    TRY(make_room(b));
    for (int i = 0; i < raw->supports.n; i++)
        TRY(build_support(b, (const raw_place *)raw->supports.item + i));
    TRY(check_supports(b));
    for (int i = 0; i < raw->loads.n; i++)
        TRY(build_load(b, (const raw_place *)raw->loads.item + i));
    TRY(nmm_build_check_names(b, &raw->monitors, offsetof(raw_monitor, name)));
    for (int i = 0; i < raw->monitors.n; i++)
        TRY(build_monitor(b, (const raw_monitor *)raw->monitors.item + i, i + 1));
    return NMM_OK;
}
