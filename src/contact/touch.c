// SPDX-License-Identifier: MIT
//
// From one pair of near edges to raw contacts.
//
//   edge-edge: two edges that face each other share an interval; each of its ends is a vertex of
//   one on the other, and stands for half of it. Summed over pairs this is the trapezoid rule on
//   the union of both sides' vertices: a uniform pressure passes exactly, eq. (5.2).
//
//      a1 <-------------- a0            ends of the shared interval: a0 on the lower edge,
//             b0 ------------------> b1                              b0 on the upper edge
//
//   corner: a convex corner in front of an edge that is not parallel, or in front of its end.
//
// An overlap that was not pressed in the last step is looked at again: is it the far side of
// something thin, or of a corner that is left by another side?

#include "search.h"

#include <math.h>
#include <string.h>

static const nmm_edge_line *line_of(const nmm_narrowing *now, int e) {
    return &now->line[e];
}

static bool is_tiny(const nmm_narrowing *now, const nmm_edge_line *line) {
    return line->length <= NMM_TINY * now->model->size;
}

static int pass_tiny(const nmm_narrowing *now, int v, const int *step) {
    v = step[v];
    for (int k = 0; k < 8 && is_tiny(now, line_of(now, v)); k++)
        v = step[v];
    return v;
}

int nmm_vertex_behind(const nmm_narrowing *now, int v) {
    return pass_tiny(now, v, now->model->vertex_next);
}

int nmm_vertex_before(const nmm_narrowing *now, int v) {
    return pass_tiny(now, v, now->model->vertex_prev);
}

nmm_vec2 nmm_vertex_inward(const nmm_narrowing *now, int v) {
    const nmm_edge_line *out = line_of(now, v), *in = line_of(now, nmm_vertex_before(now, v));
    const nmm_vec2 along = nmm_vec2_sub(out->t, in->t), off = nmm_vec2_add(out->n, in->n);
    return nmm_vec2_sub(along, off);
}

// 1: edge-edge, 0: corner, between: both in part. Of a right angle the cosine has any sign.
static double share_parallel(const nmm_edge_line *f, const nmm_edge_line *e) {
    const double sine = fabs(nmm_vec2_cross(f->t, e->t));
    if (sine >= NMM_SLANTED || nmm_vec2_dot(f->t, e->t) >= 0) return 0;
    return nmm_min(1, nmm_max(0, (NMM_SLANTED - sine) / (NMM_SLANTED - NMM_PARALLEL)));
}

// --- Listing

// Is the place inside the block, as far as the loop of `edge` tells? Odd crossings of a loop that
// runs counter-clockwise, even ones of a hole.
static bool inside_loop(const nmm_narrowing *now, int edge, nmm_vec2 place) {
    bool odd = false;
    double area = 0;
    int e = edge;
    do {
        const nmm_vec2 p = nmm_vec2_sub(nmm_vertex_place(now->model, now->state, e), place);
        e = now->model->vertex_next[e];
        const nmm_vec2 q = nmm_vec2_sub(nmm_vertex_place(now->model, now->state, e), place);
        area += nmm_vec2_cross(p, q);
        if ((p.y > 0) != (q.y > 0) && p.x + p.y / (p.y - q.y) * (q.x - p.x) > 0) odd = !odd;
    } while (e != edge);
    return odd == (area > 0);
}

// A raw contact before it is listed: of two sides, or of a corner.
typedef struct candidate {
    int vertex, edge;
    int facing; // edge of the vertex's block that faces the edge, -1: the vertex is a corner
    int sides;  // as of nmm_raw
    double gap;
    double shared; // [m] by two sides that face each other
} candidate;

static double gap_of(const nmm_edge_line *e, nmm_vec2 place) {
    return nmm_vec2_dot(e->n, nmm_vec2_sub(place, e->p));
}

// A place on the facing side, a twentieth of the interval away from its end, moved into the block
// by a twentieth of the overlap: sides of a joint lie on the border of the block beside.
static nmm_vec2 place_on_side(const nmm_narrowing *now, const candidate *c) {
    const nmm_edge_line *f = line_of(now, c->facing);
    const nmm_vec2 off = nmm_vec2_scale(0.05 * c->shared, f->t);
    const nmm_vec2 on = c->vertex == c->facing ? nmm_vec2_add(f->p, off) : nmm_vec2_sub(f->q, off);
    return nmm_vec2_add(on, nmm_vec2_scale(0.05 * nmm_min(c->gap, 0), f->n));
}

// A place in the vertex's block, a tenth of the overlap from the vertex: that itself may lie on the
// border of the other block, beside it.
static nmm_vec2 place_within(const nmm_narrowing *now, int vertex, double overlap) {
    const nmm_vec2 way = nmm_vec2_scale(0.05 * overlap, nmm_vertex_inward(now, vertex));
    return nmm_vec2_add(line_of(now, vertex)->p, way);
}

// The first edge beyond `edge` (in one direction) that is not in line with it.
static int edge_round_the_corner(const nmm_narrowing *now, int edge, const nmm_edge_line *e,
                                 const int *step) {
    int other = step[edge];
    for (int k = 0; k < 16 && other != edge; k++, other = step[other]) {
        const nmm_edge_line *o = line_of(now, other);
        if (is_tiny(now, o)) continue;
        if (fabs(nmm_vec2_cross(e->t, o->t)) > 1e-3 || nmm_vec2_dot(e->t, o->t) < 0) break;
    }
    return other;
}

// How deep a vertex may be behind an edge before a side of a convex corner is the nearer way out;
// negative where it is in front of that side, and not in the block at all.
static double room_behind(const nmm_narrowing *now, int edge, nmm_vec2 place) {
    const nmm_edge_line *e = line_of(now, edge);
    const int *step[2] = {now->model->vertex_next, now->model->vertex_prev};
    double room = INFINITY;
    for (int k = 0; k < 2; k++) {
        const int other = edge_round_the_corner(now, edge, e, step[k]);
        const nmm_edge_line *o = line_of(now, other);
        const double turn = nmm_vec2_cross(e->t, o->t);
        const bool convex = k == 0 ? turn > 0 : turn < 0;
        if (convex) room = nmm_min(room, -gap_of(o, place));
    }
    return room;
}

// Is an overlap a real one? Then a place in the vertex's block, near the vertex, is inside the
// other block; and a corner that is deeper than the room there would be left sideways.
static bool overlaps(const nmm_narrowing *now, const candidate *c) {
    if (c->facing >= 0) return inside_loop(now, c->edge, place_on_side(now, c));
    if (-c->gap > room_behind(now, c->edge, line_of(now, c->vertex)->p)) return false;
    return inside_loop(now, c->edge, place_within(now, c->vertex, -c->gap));
}

// Near enough, and a real overlap if there is one. Of what is deeper than `near` only some pairs
// are known: those whose boxes happen to be near. What two sides share is the way past each other,
// pressed before or not.
static bool listed(const nmm_narrowing *now, const candidate *c) {
    const nmm_model *model = now->model;
    if (c->gap > now->reach || c->gap < -nmm_min(now->near, NMM_DEEPEST * model->size))
        return false;
    if (c->facing >= 0 && -c->gap > c->shared) return false;
    if (c->gap >= -NMM_TOUCH * model->size) return true;
    const nmm_contact *old = nmm_contact_history(now, c->vertex, c->edge);
    if (old != NULL && old->mode != NMM_CONTACT_OPEN) return true;
    if (model->vertex_block[c->vertex] == model->vertex_block[c->edge]) return false;
    return overlaps(now, c);
}

// NULL: it is not listed, or there is no room for it.
static nmm_raw *add_raw(nmm_narrowing *now, const candidate *c) {
    // The tip of a crack ends both edges there.
    if (c->vertex == c->edge || c->vertex == nmm_vertex_behind(now, c->edge)) return NULL;
    if (!listed(now, c)) return NULL;
    now->n += 1;
    if (now->n > now->room) return NULL;
    nmm_raw *raw = &now->out[now->n - 1];
    *raw = (nmm_raw){.vertex = c->vertex,
                     .edge = c->edge,
                     .facing = c->facing,
                     .sides = c->sides,
                     .gap = c->gap};
    return raw;
}

// --- Edge on edge

// One end of the shared interval: the end `u` of edge f lies `ahead` of the end `w` of edge e, seen
// from inside the interval: then w is the end, on f; behind: u is, on e. Where they nearly coincide
// the one that was listed stays, so that elastic slip does not change the list in every step; of
// both the longer one: the other may stand for the little that two blocks share beyond a crossing.
typedef struct interval_end {
    int u, e, w, f;
    int sides;
    double ahead;
} interval_end;

// Of two ends at one place: does `u` stand for both? The one on the side of the middle of all does;
// what the mesh numbers first must not matter. Two edges that lean have a line between them, whose
// sides are theirs. Where the middle is on it the block that was listed first has it.
static bool comes_first(const nmm_narrowing *now, const interval_end *end) {
    const nmm_vec2 from_f = nmm_vec2_sub(line_of(now, end->e)->n, line_of(now, end->f)->n);
    const nmm_vec2 way = nmm_vec2_sub(now->middle, line_of(now, end->u)->p);
    const double off = 0.5 * nmm_vec2_dot(from_f, way), far = sqrt(nmm_vec2_dot(way, way));
    if (fabs(off) > NMM_EQUAL * far) return off > 0;
    const int of_u = now->model->vertex_block[end->u], of_w = now->model->vertex_block[end->w];
    return of_u != of_w ? of_u < of_w : end->u < end->w;
}

// Of the last list, 0: not listed.
static double last_length(const nmm_narrowing *now, int vertex, int edge) {
    const nmm_contact *last = nmm_contact_lookup(&now->last, vertex, edge);
    return last != NULL ? last->length : 0;
}

static void add_end(nmm_narrowing *now, const interval_end *end, double shared, double share) {
    const double size = now->model->size;
    bool take_u = fabs(end->ahead) <= NMM_EXACT * size ? comes_first(now, end) : end->ahead < 0;
    if (fabs(end->ahead) <= NMM_SAME * size) {
        const double had_u = last_length(now, end->u, end->e);
        const double had_w = last_length(now, end->w, end->f);
        if (had_u != had_w) take_u = had_u > had_w;
    }
    candidate c = {.vertex = take_u ? end->u : end->w,
                   .edge = take_u ? end->e : end->f,
                   .facing = take_u ? end->f : end->e,
                   .sides = end->sides,
                   .shared = shared};
    const nmm_edge_line *facing = line_of(now, c.facing);
    c.gap = gap_of(line_of(now, c.edge), c.vertex == c.facing ? facing->p : facing->q);
    nmm_raw *raw = add_raw(now, &c);
    if (raw == NULL) return;
    raw->length = 0.5 * share * shared;
    raw->shared = 0.5 * shared;
}

static void edge_edge(nmm_narrowing *now, nmm_edge_pair pair, double share) {
    const int f = pair.a, e = pair.b, sides = pair.sides;
    const nmm_edge_line *lf = line_of(now, f), *le = line_of(now, e);
    // Along the mean direction, whichever is named first: e runs from 0 to c, f from a (its start,
    // further) to b (its end).
    const nmm_vec2 both = nmm_vec2_sub(le->t, lf->t);
    const nmm_vec2 t = nmm_vec2_scale(1 / sqrt(nmm_vec2_dot(both, both)), both);
    const double a = nmm_vec2_dot(t, nmm_vec2_sub(lf->p, le->p));
    const double b = nmm_vec2_dot(t, nmm_vec2_sub(lf->q, le->p));
    const double c = nmm_vec2_dot(t, nmm_vec2_sub(le->q, le->p));
    const double shared = nmm_min(a, c) - nmm_max(b, 0);
    if (shared <= NMM_EXACT * now->model->size) return;
    const int next_e = nmm_vertex_behind(now, e), next_f = nmm_vertex_behind(now, f);
    const interval_end high = {.u = f, .e = e, .w = next_e, .f = f, .sides = sides, .ahead = a - c};
    const interval_end low = {.u = next_f, .e = e, .w = e, .f = f, .sides = sides, .ahead = -b};
    add_end(now, &high, shared, share);
    add_end(now, &low, shared, share);
}

// --- Corner on edge

// The edge that arrives at a vertex.
static const nmm_edge_line *line_before(const nmm_narrowing *now, int vertex) {
    return line_of(now, nmm_vertex_before(now, vertex));
}

// Both edges at the vertex lie in front of the line of e, and none is parallel to it; *share is how
// far they are. Where both run the same way as e the vertex is one of a side that is flush with it,
// and its block beside that of e, not in front. In a notch the block is behind its vertex as well:
// that meets nothing, and least of all the sides of its own notch.
static bool admissible(const nmm_narrowing *now, int vertex, const nmm_edge_line *e,
                       double *share) {
    const nmm_edge_line *out = line_of(now, vertex), *in = line_before(now, vertex);
    if (nmm_vec2_dot(out->t, e->n) < -NMM_SLANTED || nmm_vec2_dot(in->t, e->n) > NMM_SLANTED) {
        return false;
    }
    if (nmm_vec2_dot(out->t, e->t) > 0 && nmm_vec2_dot(in->t, e->t) > 0) return false;
    if (nmm_vec2_cross(in->t, out->t) < -NMM_SLANTED) return false;
    *share = nmm_max(share_parallel(out, e), share_parallel(in, e));
    return *share < 1;
}

// Beyond an end of e: still in front of it? In front of a convex corner, yes; behind its line only
// in a notch, where the next side is what overlaps.
static bool meets_beyond(const nmm_narrowing *now, int edge, const nmm_edge_line *e, double along,
                         double gap) {
    if (gap >= 0) return true;
    const nmm_edge_line *next =
        along < 0 ? line_before(now, edge) : line_of(now, nmm_vertex_behind(now, edge));
    const double turn = nmm_vec2_cross(e->t, next->t);
    return along < 0 ? turn > 0 : turn < 0;
}

static void corner(nmm_narrowing *now, int vertex, int edge, const nmm_edge_line *e) {
    const double size = now->model->size;
    const nmm_vec2 place = line_of(now, vertex)->p;
    const double along = nmm_vec2_dot(e->t, nmm_vec2_sub(place, e->p)), gap = gap_of(e, place);
    double beyond = nmm_max(-along, along - e->length);
    if (beyond <= NMM_EXACT * size) beyond = 0;
    if (beyond > now->reach || gap > now->reach || gap < -NMM_DEEPEST * size) return;
    double share = 0;
    if (!admissible(now, vertex, e, &share)) return;
    if (beyond > 0 && !meets_beyond(now, edge, e, along, gap)) return;
    const candidate c = {.vertex = vertex, .edge = edge, .facing = -1, .sides = -1, .gap = gap};
    nmm_raw *raw = add_raw(now, &c);
    if (raw == NULL) return;
    raw->corner_length = (1 - share) * NMM_CORNER * size;
    raw->beyond = beyond;
    raw->corner = true;
}

// The vertices of edge a on edge b. Each vertex comes with the edge that begins there; where that
// one cannot meet b, because it is of the same block, it comes with the edge that ends there.
static void corners_of(nmm_narrowing *now, int a, int b) {
    const nmm_model *model = now->model;
    const nmm_edge_line *e = line_of(now, b);
    corner(now, a, b, e);
    if (model->vertex_block[a] != model->vertex_block[b]) return;
    const int end = nmm_vertex_behind(now, a);
    if (end != b && !nmm_edges_can_meet(model, end, b)) corner(now, end, b, e);
}

void nmm_touch(nmm_narrowing *now, nmm_edge_pair pair) {
    const nmm_edge_line *a = line_of(now, pair.a), *b = line_of(now, pair.b);
    // The vertex of a tiny edge is stood for by the one behind it.
    if (is_tiny(now, a) || is_tiny(now, b)) return;
    const double share = share_parallel(a, b);
    if (share > 0) edge_edge(now, pair, share);
    // Of sides that are parallel no vertex is a corner.
    if (share == 1) return;
    // Of two that are not one leads away from the other's line, and only it may begin in front.
    const double turn = nmm_vec2_cross(a->t, b->t);
    const int away = turn < 0 ? pair.b : pair.a, other = turn < 0 ? pair.a : pair.b;
    corners_of(now, away, other);
    const bool slanted = fabs(turn) > NMM_SLANTED;
    const bool same = now->model->vertex_block[away] == now->model->vertex_block[other];
    if (!slanted || same) corners_of(now, other, away);
}

// --- Rest

// Angle by which two edges turn against each other, at most, while their ends move by `way`:
// asin x <= 1.6 x.
static double most_turn(const nmm_edge_line *a, const nmm_edge_line *b, double way) {
    return 3.2 * way * (1 / a->length + 1 / b->length);
}

static bool stays_parallel(const nmm_edge_line *f, const nmm_edge_line *e, double way) {
    return fabs(nmm_vec2_cross(f->t, e->t)) < NMM_PARALLEL - most_turn(f, e, way) &&
           nmm_vec2_dot(f->t, e->t) < -0.5;
}

static bool stays_away(nmm_vec2 place, const nmm_edge_line *e, double distance) {
    const nmm_vec2 off = nmm_vec2_sub(place, e->p);
    const double part = nmm_max(0, nmm_min(e->length, nmm_vec2_dot(off, e->t)));
    const nmm_vec2 rest = nmm_vec2_sub(off, nmm_vec2_scale(part, e->t));
    return nmm_vec2_dot(rest, rest) > distance * distance;
}

// Stays a vertex not admissible on e? Or further away than a corner may be: as far beyond the end
// as it is above or below.
static bool corner_rests(const nmm_narrowing *now, int vertex, const nmm_edge_line *e, double near,
                         double way) {
    const nmm_edge_line *out = line_of(now, vertex);
    const nmm_edge_line *in = line_of(now, now->model->vertex_prev[vertex]);
    if (stays_away(out->p, e, 1.5 * near + 2 * way)) return true;
    // An edge this short may be passed over, or no more.
    if (in->length <= NMM_TINY * now->model->size + 4 * way) return false;
    return stays_parallel(out, e, way) || stays_parallel(in, e, way) ||
           nmm_vec2_dot(out->t, e->n) < -NMM_SLANTED - most_turn(out, e, way) ||
           nmm_vec2_dot(in->t, e->n) > NMM_SLANTED + most_turn(in, e, way);
}

bool nmm_touch_rests(const nmm_narrowing *now, nmm_edge_pair pair, double near, double way) {
    const int *block = now->model->vertex_block;
    if (block[pair.a] == block[pair.b]) return false;
    const nmm_edge_line *a = line_of(now, pair.a), *b = line_of(now, pair.b);
    const double turn = nmm_vec2_cross(a->t, b->t);
    if (!(fabs(turn) > NMM_SLANTED + most_turn(a, b, way))) return false;
    return turn < 0 ? corner_rests(now, pair.b, a, near, way)
                    : corner_rests(now, pair.a, b, near, way);
}
