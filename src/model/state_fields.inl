// SPDX-License-Identifier: MIT
//
// The changing arrays of a state, one line each: FIELD(type, name, count, width, unit, meaning).

//    type    name                count            width unit     meaning
FIELD(double, displacement,       n_cover,         2, "m",      "total displacement of a cover since the start")
FIELD(double, velocity,           n_cover,         2, "m/s",    "velocity of a cover")
FIELD(double, mean_velocity,      n_cover,         2, "m/s",    "velocity of a cover on average over the last step")
FIELD(double, position,           n_point,         2, "m",      "current place of a point, follows from displacement")
FIELD(double, shift,              n_point,         2, "m",      "displacement of a point, to more digits than its place has")
FIELD(double, rotation,           n_element,       2, "",       "cosine and sine of an element's rotation")
FIELD(double, stress,             n_element,       3, "Pa",     "sxx, syy, sxy along the fixed axes; tension positive")
FIELD(double, initial_stress,     n_element,       3, "Pa",     "stress at zero strain, in the element's own frame")
FIELD(double, sample_initial,     n_sample,        3, "Pa",     "order > 0: initial stress at a sample")
FIELD(double, support_force,      n_support,       2, "N",      "carried reaction of a support point")
