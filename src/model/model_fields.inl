// SPDX-License-Identifier: MIT
//
// The constant arrays of a model, one line each: FIELD(type, name, count, width, unit, meaning).
// The table drives allocation, release, the finiteness check, output and docs/fields.md.
// All coordinates are relative to nmm_model.origin.

//    type    name                count            width unit     meaning
FIELD(int,    cover_node,         n_cover,         1, "",       "lattice node of a physical cover; of other functions a number for their place")
FIELD(int,    cover_block,        n_cover,         1, "",       "block of a cover")
FIELD(double, cover_place,        n_cover,         2, "m",      "place of the cover's lattice node, middle of its edge or triangle")
FIELD(int,    cover_start,        n_cover + 1,     1, "",       "first entry of a cover in cover_element")
FIELD(int,    cover_element,      n_local * n_element, 1, "",   "n_local * element + place of the cover in it, sorted by cover then element")

FIELD(int,    element_cover,      n_element,       n_local, "", "physical covers of an element: of its nodes, then of edges and triangle")
FIELD(int,    element_block,      n_element,       1, "",       "block of an element")
FIELD(int,    element_material,   n_element,       1, "",       "material of an element")
FIELD(double, element_area,       n_element,       1, "m2",     "area")
FIELD(double, element_centre,     n_element,       2, "m",      "centroid")
FIELD(double, element_moment,     n_element,       3, "m4",     "second moments about the centroid: xx, xy, yy")
FIELD(double, element_weight,     n_element,       3, "",       "the three linear functions at the centroid")
FIELD(double, element_gradient,   n_element,       6, "1/m",    "gradients of the linear functions: g0x, g0y, g1x, ...")
FIELD(int,    element_start,      n_element + 1,   1, "",       "first entry of an element in corner_point")
FIELD(int,    corner_point,       n_corner,        1, "",       "points of an element's polygon, counter-clockwise; holes joined by a cut")

FIELD(double, element_gram,       n_curved,        n_gram, "m2", "order > 0: integrals of products of an element's functions: 00, 01, .., 11, 12, ..")
FIELD(int,    sample_start,       n_curved + 1,    1, "",       "order > 0: first sample of an element")
FIELD(double, sample_area,        n_sample,        1, "m2",     "area that a sample stands for")
FIELD(double, sample_linear,      n_sample,        3, "",       "the three linear functions at a sample")

FIELD(double, point,              n_point,         2, "m",      "material points: corners of elements, one for each side of a joint")
FIELD(int,    point_element,      n_point,         1, "",       "an element of a point")
FIELD(double, point_weight,       n_point,         n_local, "", "weights of that element's covers at the point")

FIELD(int,    vertex_point,       n_vertex,        1, "",       "point of a loop vertex; vertex v starts loop edge v")
FIELD(int,    vertex_next,        n_vertex,        1, "",       "next vertex of the loop: block to the left, so counter-clockwise outside, clockwise round holes")
FIELD(int,    vertex_prev,        n_vertex,        1, "",       "previous vertex of the loop")
FIELD(int,    vertex_block,       n_vertex,        1, "",       "block of a loop vertex and of the edge that starts there")
FIELD(int,    edge_element,       n_vertex,        1, "",       "element behind loop edge v")
FIELD(double, edge_weight,        n_vertex,        2 * n_local, "", "weights of that element's covers at the start and at the end of the edge")
FIELD(int,    edge_interface,     n_vertex,        1, "",       "interface of the joint the edge lies on; -1 where no joint made it")
FIELD(int,    edge_mate,          n_vertex,        1, "",       "loop edge on the other side of the joint at the start, same end points; -1: none")
