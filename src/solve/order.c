// SPDX-License-Identifier: MIT
//
// Approximate minimum degree. Elimination is followed on a graph of two kinds of nodes: variables,
// rows still there, and elements, rows eliminated, each of which stands for all pairs of the
// variables it joins. Variables that have become alike go on as one. Degrees are bounds from above.
// Amestoy, Davis and Duff, SIAM J. Matrix Anal. Appl. 17 (1996) 886.

#include "order.h"

#include <limits.h>

// A node's list holds its elements first, then its variables; an element's list variables alone.
typedef struct graph {
    int n;
    int *list, capacity, end;         // all lists; numbers used
    int *start, *n_element, *n_entry; // [n] of a node's list
    int *weight; // [n] rows a variable stands for, negative while in the pivot's element; 0: gone
    int *degree; // [n] rows joined to a variable, or of an element
    int *heir;   // [n] variable or pivot that a variable became part of, -1: none
    int *stamp;  // [n] of an element: mark + rows outside of the pivot's element; 0: gone
    int *head;   // [n] first variable of a degree, -1: none
    int *next, *previous; // [n] in the lists by degree; while in the pivot's element: by hash
    int *bucket;          // [n] first variable with a hash, -1: none
    int *turn;            // [n] step of a pivot
    int *parent;          // of a step, as in nmm_order
    int mark;             // larger than all stamps before
    int least;            // no smaller degree has variables
    int n_done;           // rows eliminated
    int *stage;           // [n] of a variable, or of the first of those that became part of it
    int now;              // stage at hand: only its variables are in the lists by degree
    int n_linked;         // variables in those
} graph;

void nmm_order_release(nmm_context *context, nmm_order_room *room) {
    nmm_release(context, &room->row);
    nmm_release(context, &room->list);
    *room = (nmm_order_room){0};
}

// The arrays of a graph of n rows, in room for all of them.
static nmm_status place_graph(nmm_context *context, graph *g, nmm_order_room *room, int n) {
    int **const array[] = {&g->start,  &g->n_element, &g->n_entry, &g->weight, &g->degree,
                           &g->heir,   &g->stamp,     &g->head,    &g->next,   &g->previous,
                           &g->bucket, &g->turn,      &g->stage};
    const int n_array = sizeof array / sizeof *array;
    TRY(nmm_grow(context, &room->row, &room->row_capacity, n_array * n, sizeof(int)));
    for (int k = 0; k < n_array; k++)
        *array[k] = room->row + (long)k * n;
    g->n = n;
    return NMM_OK;
}

// --- Lists by degree

static void link_variable(graph *g, int i) {
    if (g->stage[i] > g->now) return;
    const int degree = g->degree[i], other = g->head[degree];
    g->n_linked++;
    g->next[i] = other;
    g->previous[i] = -1;
    if (other >= 0) g->previous[other] = i;
    g->head[degree] = i;
    g->least = nmm_min_int(g->least, degree);
}

static void unlink_variable(graph *g, int i) {
    if (g->stage[i] > g->now) return;
    const int after = g->next[i], before = g->previous[i];
    g->n_linked--;
    if (after >= 0) g->previous[after] = before;
    if (before >= 0) g->next[before] = after;
    if (before < 0) g->head[g->degree[i]] = after;
}

static void fill_graph(graph *g, const int *row_start, const int *col) {
    g->mark = 1;
    g->least = g->n;
    for (int i = 0; i < g->n; i++) {
        g->head[i] = g->bucket[i] = g->heir[i] = -1;
        g->weight[i] = 1;
        g->n_element[i] = g->stamp[i] = 0;
        g->start[i] = g->end;
        for (int k = row_start[i]; k < row_start[i + 1]; k++)
            if (col[k] != i) g->list[g->end++] = col[k];
        g->n_entry[i] = g->degree[i] = g->end - g->start[i];
    }
}

static void begin_stage(graph *g, const nmm_stages *stages) {
    g->least = g->n;
    if (stages == NULL) {
        for (int i = g->n - 1; i >= 0; i--)
            link_variable(g, i);
        return;
    }
    for (int k = stages->start[g->now + 1] - 1; k >= stages->start[g->now]; k--) {
        const int i = stages->row[k];
        if (g->weight[i] > 0 && g->stage[i] == g->now) link_variable(g, i);
    }
}

// --- One elimination

static int take_pivot(graph *g) {
    while (g->head[g->least] < 0)
        g->least++;
    const int pivot = g->head[g->least];
    unlink_variable(g, pivot);
    return pivot;
}

// Variables of a list that are not in the pivot's element yet: into it, at the end of all lists.
static int join_variables(graph *g, int begin, int end) {
    int rows = 0;
    for (int k = begin; k < end; k++) {
        const int i = g->list[k];
        if (g->weight[i] <= 0) continue;
        rows += g->weight[i];
        g->weight[i] = -g->weight[i];
        g->list[g->end++] = i;
        unlink_variable(g, i);
    }
    return rows;
}

// All that an element joins the pivot's does.
static void absorb_element(graph *g, int e, int pivot) {
    g->stamp[e] = 0;
    g->parent[g->turn[e]] = g->turn[pivot];
}

// The pivot becomes an element: all variables that it or its elements join. Those are gone then.
static nmm_status make_element(nmm_context *context, graph *g, int pivot) {
    const int begin = g->start[pivot], n_element = g->n_element[pivot];
    const int end = begin + g->n_entry[pivot];
    int room = g->n_entry[pivot] - n_element;
    for (int k = begin; k < begin + n_element; k++)
        room += g->n_entry[g->list[k]];
    TRY(nmm_grow(context, &g->list, &g->capacity, g->end + room, sizeof *g->list));
    const int first = g->end;
    int rows = 0;
    g->weight[pivot] = -g->weight[pivot];
    for (int k = begin; k < begin + n_element; k++) {
        const int e = g->list[k];
        rows += join_variables(g, g->start[e], g->start[e] + g->n_entry[e]);
        absorb_element(g, e, pivot);
    }
    rows += join_variables(g, begin + n_element, end);
    g->start[pivot] = first;
    g->n_entry[pivot] = g->end - first;
    g->n_element[pivot] = 0;
    g->degree[pivot] = rows;
    return NMM_OK;
}

// A mark that leaves room for `rows` above it.
static void raise_mark(graph *g, int rows) {
    if (g->mark > INT_MAX - 2 * rows - 2) {
        for (int i = 0; i < g->n; i++)
            g->stamp[i] = g->stamp[i] != 0;
        g->mark = 1;
    }
    g->mark += rows + 1;
}

// Rows of each element outside of the pivot's, as a stamp.
static void measure_elements(graph *g, int pivot) {
    raise_mark(g, g->n);
    for (int k = g->start[pivot]; k < g->start[pivot] + g->n_entry[pivot]; k++) {
        const int i = g->list[k], rows = -g->weight[i];
        for (int m = g->start[i]; m < g->start[i] + g->n_element[i]; m++) {
            const int e = g->list[m];
            if (g->stamp[e] == 0) continue;
            const int outside = g->stamp[e] < g->mark ? g->mark + g->degree[e] : g->stamp[e];
            g->stamp[e] = outside - rows;
        }
    }
}

// The list of a variable in the pivot's element, without what is gone, behind the pivot; rows that
// it joins outside. Elements with nothing outside are gone. The sum of the list is its hash.
static int shorten_list(graph *g, int pivot, int i, unsigned *hash) {
    const int begin = g->start[i], middle = begin + g->n_element[i], end = begin + g->n_entry[i];
    int rows = 0, at = begin;
    *hash = 0;
    for (int k = begin; k < middle; k++) {
        const int e = g->list[k];
        if (g->stamp[e] == 0) continue;
        if (g->stamp[e] == g->mark) {
            absorb_element(g, e, pivot);
            continue;
        }
        rows += g->stamp[e] - g->mark;
        *hash += (unsigned)e;
        g->list[at++] = e;
    }
    const int first = at;
    for (int k = middle; k < end; k++) {
        const int j = g->list[k];
        if (g->weight[j] <= 0) continue;
        rows += g->weight[j];
        *hash += (unsigned)j;
        g->list[at++] = j;
    }
    // What joined it to the pivot is gone, so there is room for one more.
    g->list[at] = g->list[first];
    g->list[first] = g->list[begin];
    g->list[begin] = pivot;
    g->n_element[i] = first - begin + 1;
    g->n_entry[i] = at - begin + 1;
    return rows;
}

// Variables of the pivot's element: degrees, and those that nothing else joins go with the pivot.
static void update_variables(graph *g, int pivot) {
    for (int k = g->start[pivot]; k < g->start[pivot] + g->n_entry[pivot]; k++) {
        const int i = g->list[k];
        unsigned hash = 0;
        const int rows = shorten_list(g, pivot, i, &hash);
        if (rows == 0) {
            g->weight[pivot] += g->weight[i];
            g->degree[pivot] += g->weight[i];
            g->weight[i] = 0;
            g->heir[i] = pivot;
            continue;
        }
        g->degree[i] = nmm_min_int(g->degree[i], rows);
        const int b = (int)(hash % (unsigned)g->n);
        g->next[i] = g->bucket[b];
        g->previous[i] = b;
        g->bucket[b] = i;
    }
}

// Does the list of j hold what is stamped, and no more?
static bool same_list(const graph *g, int i, int j) {
    if (g->n_entry[i] != g->n_entry[j] || g->n_element[i] != g->n_element[j]) return false;
    for (int k = g->start[j] + 1; k < g->start[j] + g->n_entry[j]; k++)
        if (g->stamp[g->list[k]] != g->mark) return false;
    return true;
}

// Variables of a bucket with the list of i become part of it.
static void join_alike(graph *g, int i) {
    raise_mark(g, 0);
    for (int k = g->start[i] + 1; k < g->start[i] + g->n_entry[i]; k++)
        g->stamp[g->list[k]] = g->mark;
    for (int before = i, j = g->next[i]; j >= 0; j = g->next[j]) {
        if (!same_list(g, i, j)) {
            before = j;
            continue;
        }
        g->weight[i] += g->weight[j];
        g->weight[j] = 0;
        g->heir[j] = i;
        if (g->stage[j] <= g->now) g->stage[i] = g->now;
        g->next[before] = g->next[j];
    }
}

static void find_alike(graph *g, int pivot) {
    raise_mark(g, g->n);
    for (int k = g->start[pivot]; k < g->start[pivot] + g->n_entry[pivot]; k++) {
        const int first = g->list[k];
        if (g->weight[first] == 0) continue;
        int i = g->bucket[g->previous[first]];
        g->bucket[g->previous[first]] = -1;
        for (; i >= 0 && g->next[i] >= 0; i = g->next[i])
            join_alike(g, i);
    }
}

// Variables back to the lists by degree; what is left of the pivot's element.
static void finish_element(graph *g, int pivot) {
    g->n_done -= g->weight[pivot];
    const int begin = g->start[pivot], end = begin + g->n_entry[pivot];
    const int rows = g->degree[pivot], left = g->n - g->n_done;
    int at = begin;
    for (int k = begin; k < end; k++) {
        const int i = g->list[k];
        if (g->weight[i] == 0) continue;
        g->weight[i] = -g->weight[i];
        g->degree[i] = nmm_min_int(g->degree[i] + rows, left) - g->weight[i];
        link_variable(g, i);
        g->list[at++] = i;
    }
    g->n_entry[pivot] = at - begin;
    g->stamp[pivot] = at > begin ? g->mark : 0;
    g->weight[pivot] = 0;
    g->end = at;
}

// Rows in order of their pivots, those of one pivot ascending.
static void list_rows(graph *g, int n_pivot, int *order) {
    int *place = g->head; // all its lists are empty by now
    for (int k = 0; k < n_pivot; k++)
        place[k] = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < g->n; i++) {
            int pivot = i;
            while (g->heir[pivot] >= 0)
                pivot = g->heir[pivot];
            const int turn = g->turn[pivot];
            if (pass == 1) order[place[turn]++] = i;
            if (pass == 0 && turn + 1 < n_pivot) place[turn + 1]++;
        }
        for (int k = 1; pass == 0 && k < n_pivot; k++)
            place[k] += place[k - 1];
    }
}

static nmm_status eliminate(nmm_context *context, graph *g, const nmm_stages *stages,
                            nmm_order *order) {
    g->now = -1;
    while (g->n_done < g->n) {
        if (g->n_linked == 0) {
            g->now++;
            begin_stage(g, stages);
            continue;
        }
        const int pivot = take_pivot(g), step = order->n_step++;
        g->turn[pivot] = step;
        g->parent[step] = -1;
        TRY(make_element(context, g, pivot));
        measure_elements(g, pivot);
        update_variables(g, pivot);
        find_alike(g, pivot);
        order->size[step] = -g->weight[pivot];
        order->n_below[step] = g->degree[pivot];
        finish_element(g, pivot);
    }
    list_rows(g, order->n_step, order->row);
    return NMM_OK;
}

nmm_status nmm_order_find(nmm_context *context, nmm_order_room *room, int n_row,
                          const int *row_start, const int *col, const nmm_stages *stages,
                          nmm_order *order) {
    order->n_step = 0;
    if (n_row == 0) return NMM_OK;
    graph g = {.parent = order->parent};
    TRY(place_graph(context, &g, room, n_row));
    TRY(nmm_grow(context, &room->list, &room->list_capacity, row_start[n_row], sizeof(int)));
    g.list = room->list;
    g.capacity = room->list_capacity;
    fill_graph(&g, row_start, col);
    for (int i = 0; i < n_row; i++)
        g.stage[i] = 0;
    for (int k = 0; stages != NULL && k < stages->n; k++)
        for (int m = stages->start[k]; m < stages->start[k + 1]; m++)
            g.stage[stages->row[m]] = k;
    const nmm_status status = eliminate(context, &g, stages, order);
    // It may have grown.
    room->list = g.list;
    room->list_capacity = g.capacity;
    return status;
}
