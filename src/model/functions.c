// SPDX-License-Identifier: MIT
//
// The functions of an element with covers of order 0, 1, 2, from its linear functions w_0, w_1,
// w_2, eq. (2.15):
//
//   order 0   w_i                                      at the nodes
//   order 1   and w_i w_j                              at the edges of the triangle
//   order 2   and w_i w_j (w_i - w_j), w_0 w_1 w_2     at the edges and at the triangle
//
// They span all polynomials of degree order + 1 and are independent on any piece of the triangle.
// An edge has a direction, from its lower node number to the higher one, so that the cubic function
// is the same seen from both triangles.

#include "model.h"

// Sign of edge a of an element: its nodes are a and a + 1 in the element's order.
static double edge_sign(const nmm_model *model, int e, int a) {
    const int *cover = model->element_cover + model->n_local * (long)e;
    const int from = model->cover_node[cover[a]], to = model->cover_node[cover[(a + 1) % 3]];
    return from < to ? 1 : -1;
}

void nmm_functions_value(const nmm_model *model, int e, const double linear[3], double *value) {
    const double *w = linear;
    for (int i = 0; i < 3; i++)
        value[i] = w[i];
    if (model->order == 0) return;
    for (int a = 0; a < 3; a++)
        value[3 + a] = w[a] * w[(a + 1) % 3];
    if (model->order == 1) return;
    for (int a = 0; a < 3; a++)
        value[6 + a] = edge_sign(model, e, a) * value[3 + a] * (w[a] - w[(a + 1) % 3]);
    value[9] = w[0] * w[1] * w[2];
}

void nmm_functions_gradient(const nmm_model *model, int e, const double linear[3],
                            double *gradient) {
    const double *w = linear, *g = model->element_gradient + 6 * (long)e;
    for (int i = 0; i < 6; i++)
        gradient[i] = g[i];
    if (model->order == 0) return;
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        const double s = model->order > 1 ? edge_sign(model, e, a) : 0;
        for (int x = 0; x < 2; x++) {
            const double ga = g[2 * a + x], gb = g[2 * b + x];
            gradient[2 * (3 + a) + x] = w[a] * gb + w[b] * ga;
            if (model->order == 1) continue;
            gradient[2 * (6 + a) + x] =
                s * ((2 * w[a] - w[b]) * w[b] * ga + (w[a] - 2 * w[b]) * w[a] * gb);
            if (a == 0)
                gradient[2 * 9 + x] =
                    w[b] * w[c] * ga + w[a] * w[c] * gb + w[a] * w[b] * g[2 * c + x];
        }
    }
}
