// SPDX-License-Identifier: MIT
//
// The key table of the scene format, one line or two for each key. A key that is known but not
// supported yet is marked `later`: using it is an error that says so.

#include "keys.h"

#include "raw.h"

#include <string.h>

#define KEY(type, member) .offset = offsetof(type, member)
#define OBJECT(title, keys, type, ...)                                                             \
    {                                                                                              \
        .name = title, .key = keys, .n_key = sizeof keys / sizeof *keys, .size = sizeof(type),     \
        __VA_ARGS__                                                                                \
    }
#define ABOVE(a)                                                                                   \
    { .low = a, .high = HUGE_LIMIT, .low_open = true }
#define AT_LEAST(a)                                                                                \
    { .low = a, .high = HUGE_LIMIT }
#define FROM_TO(a, b)                                                                              \
    { .low = a, .high = b }
#define ABOVE_TO(a, b)                                                                             \
    { .low = a, .high = b, .low_open = true }
#define FROM_BELOW(a, b)                                                                           \
    { .low = a, .high = b, .high_open = true }
#define BETWEEN(a, b)                                                                              \
    { .low = a, .high = b, .low_open = true, .high_open = true }
#define HUGE_LIMIT 1e30
#define POINT .kind = NMM_VALUE_ROW, .width = 2, .dimension = {NMM_LENGTH, NMM_LENGTH}
#define POINTS(least, most)                                                                        \
    .kind = NMM_VALUE_ROWS, .width = 2, .least_row = least, .most_row = most,                      \
    .dimension = {NMM_LENGTH, NMM_LENGTH}

#define MAX_CORNERS 20000

// --- Geometry

static const nmm_key circle_keys[] = {
    {"center", KEY(raw_circle, center), POINT, .required = true, .meaning = "centre"},
    {"radius", KEY(raw_circle, radius), .dimension = {NMM_LENGTH}, .range = ABOVE(0),
     .required = true, .meaning = "radius; the corners lie on the circle"},
    {"segments", KEY(raw_circle, segments), .whole = true, .range = FROM_TO(3, 10000),
     .automatic = true, .standard = "auto", .why = "sides no longer than a cover",
     .meaning = "straight sides; `auto`: 48 or more, as the mesh needs"},
};
static const nmm_object circle_object =
    OBJECT("circle", circle_keys, raw_circle, .meaning = "A circle, as a regular polygon.");

#define SHAPE_KEYS                                                                                 \
    {"polygon", KEY(raw_area, polygon), POINTS(3, MAX_CORNERS),                                    \
     .meaning = "corners in order, either way round; edges must not cross"},                       \
    {                                                                                              \
        "circle", KEY(raw_area, circle), .kind = NMM_VALUE_OBJECT, .object = &circle_object,       \
                                         .meaning = "a circle instead of a polygon"                \
    }
#define MATERIAL_KEY                                                                               \
    {                                                                                              \
        "material", KEY(raw_area, material), .kind = NMM_VALUE_NAME,                               \
                                             .computed = "the only material",                      \
                                             .meaning = "name of a material"                       \
    }

static const nmm_key domain_keys[] = {SHAPE_KEYS, MATERIAL_KEY};
static const nmm_object domain_object =
    OBJECT("domain", domain_keys, raw_area, .one_of = "polygon, circle",
           .meaning = "Rock that joints cut into blocks.");

static const nmm_key hole_keys[] = {SHAPE_KEYS};
static const nmm_object hole_object =
    OBJECT("holes", hole_keys, raw_area, .one_of = "polygon, circle",
           .meaning = "Openings in the domain. A hole that reaches over the edge takes a bite.");

static const nmm_object region_object =
    OBJECT("regions", domain_keys, raw_area, .one_of = "polygon, circle",
           .meaning = "Parts of the domain with another material; later entries win.");

static const nmm_key repeat_keys[] = {
    {"count", KEY(raw_repeat, count), .kind = NMM_VALUE_ROW, .width = 2, .whole = true,
     .range = FROM_TO(1, NMM_SCENE_MAX), .required = true, .meaning = "copies along x and y"},
    {"step", KEY(raw_repeat, step), POINT, .required = true,
     .meaning = "distance from copy to copy along x and y"},
    {"shift", KEY(raw_repeat, shift), POINT, .standard = "[0, 0]",
     .meaning = "further move of every second row"},
};
static const nmm_object repeat_object =
    OBJECT("repeat", repeat_keys, raw_repeat,
           .meaning = "Copy (i, j) of a block is moved by (i dx, j dy); odd rows j also by shift.");

static const nmm_key block_keys[] = {
    {"name", KEY(raw_area, name), .kind = NMM_VALUE_NAME, .computed = "block 1, block 2, ...",
     .meaning = "for supports and messages; blocks may share a name, as a group"},
    SHAPE_KEYS,
    MATERIAL_KEY,
    {"velocity", KEY(raw_area, velocity), .kind = NMM_VALUE_ROW, .width = 3,
     .dimension = {NMM_VELOCITY, NMM_VELOCITY, NMM_SPIN}, .standard = "[0, 0, 0]",
     .meaning = "at the start: vx, vy of the centroid, spin (counter-clockwise)"},
    {"repeat", KEY(raw_area, repeat), .kind = NMM_VALUE_OBJECT, .object = &repeat_object,
     .meaning = "copies in rows and columns"},
};
static const nmm_object block_object =
    OBJECT("blocks", block_keys, raw_area, .one_of = "polygon, circle",
           .meaning = "Blocks that are not cut from a domain; they may touch or be apart.");

static const nmm_key joint_keys[] = {
    {"name", KEY(raw_joint, name), .kind = NMM_VALUE_NAME, .computed = "joint 1, joint 2, ...",
     .meaning = "for messages"},
    {"polyline", KEY(raw_joint, polyline), POINTS(2, MAX_CORNERS), .required = true,
     .meaning = "corners in order; it may reach over the domain's edge"},
    {"interface", KEY(raw_joint, interface), .kind = NMM_VALUE_NAME,
     .computed = "the scene's `interface`", .meaning = "name of an interface"},
};
static const nmm_object joint_object =
    OBJECT("joints", joint_keys, raw_joint, .meaning = "Single joints and faults in the domain.");

static const nmm_key spread_keys[] = {
    {"dip", KEY(raw_spread, dip), .dimension = {NMM_ANGLE}, .range = FROM_TO(0, 45),
     .standard = "0", .meaning = "each trace is turned about its middle by at most this"},
    {"spacing", KEY(raw_spread, spacing), .dimension = {NMM_LENGTH}, .range = AT_LEAST(0),
     .standard = "0", .meaning = "the distance of neighbouring lines differs by at most this"},
    {"position", KEY(raw_spread, position), .dimension = {NMM_LENGTH}, .range = AT_LEAST(0),
     .standard = "0", .meaning = "the traces of a line are moved along it by at most this"},
};
static const nmm_object spread_object =
    OBJECT("spread", spread_keys, raw_spread,
           .meaning = "Random differences, evenly distributed between minus and plus the number.");

static const nmm_key set_keys[] = {
    {"name", KEY(raw_set, name), .kind = NMM_VALUE_NAME,
     .computed = "joint set 1, joint set 2, ...", .meaning = "for messages"},
    {"dip", KEY(raw_set, dip), .dimension = {NMM_ANGLE}, .range = FROM_TO(-180, 180),
     .required = true,
     .meaning = "angle of the traces from the x axis, counter-clockwise positive"},
    {"spacing", KEY(raw_set, spacing), .dimension = {NMM_LENGTH}, .range = ABOVE(0),
     .required = true, .meaning = "distance of neighbouring lines, across them"},
    {"persistence", KEY(raw_set, persistence), .range = ABOVE_TO(0, 1), .standard = "1",
     .meaning = "trace / (trace + gap); 1: through-going"},
    {"trace_length", KEY(raw_set, trace_length), .dimension = {NMM_LENGTH}, .range = ABOVE(0),
     .computed = "needed where persistence is below 1", .meaning = "length of a trace"},
    {"origin", KEY(raw_set, origin), POINT, .computed = "lower left corner of the domain's box",
     .meaning = "a point where a trace of a line begins"},
    {"spread", KEY(raw_set, spread), .kind = NMM_VALUE_OBJECT, .object = &spread_object,
     .always = true, .meaning = "random differences"},
    {"seed", KEY(raw_set, seed), .whole = true, .range = FROM_TO(0, 1e15), .standard = "1",
     .meaning = "of the random numbers; the same seed gives the same joints"},
    {"interface", KEY(raw_set, interface), .kind = NMM_VALUE_NAME,
     .computed = "the scene's `interface`", .meaning = "name of an interface"},
    {"inside", KEY(raw_set, inside), .kind = NMM_VALUE_POLYGONS, .width = 2, .least_row = 3,
     .most_row = MAX_CORNERS, .dimension = {NMM_LENGTH, NMM_LENGTH}, .computed = "the domain's box",
     .meaning = "polygon, or list of polygons, to which the traces are cut"},
};
static const nmm_object set_object =
    OBJECT("joint_sets", set_keys, raw_set,
           .meaning = "Parallel joints over the domain, or over part of it.");

// --- Materials

static const nmm_word plane_words[] = {
    {"strain", NMM_PLANE_STRAIN, false}, {"stress", NMM_PLANE_STRESS, false}, {NULL, 0, false}};

static const nmm_key material_keys[] = {
    {"density", KEY(raw_material, density), .dimension = {NMM_DENSITY}, .range = ABOVE(0),
     .required = true, .meaning = "mass per volume"},
    {"youngs_modulus", KEY(raw_material, youngs_modulus), .dimension = {NMM_STRESS},
     .range = ABOVE(0), .required = true, .meaning = "Young's modulus"},
    {"poissons_ratio", KEY(raw_material, poissons_ratio), .range = BETWEEN(-1, 0.5),
     .required = true, .meaning = "Poisson's ratio"},
    {"plane", KEY(raw_material, plane), .kind = NMM_VALUE_CHOICE, .word = plane_words,
     .standard = "strain", .why = "a slice of a long body", .meaning = "plane strain or stress"},
};
static const nmm_object material_object = OBJECT("materials", material_keys, raw_material,
                                                 .noted = true, .meaning = "Elastic materials.");

#define FRICTION_RANGE FROM_BELOW(0, 90)
static const nmm_key interface_keys[] = {
    {"friction_angle", KEY(raw_interface, friction_angle), .dimension = {NMM_ANGLE},
     .range = FRICTION_RANGE, .required = true, .meaning = "angle of friction"},
    {"cohesion", KEY(raw_interface, cohesion), .dimension = {NMM_STRESS}, .range = AT_LEAST(0),
     .standard = "0", .why = "an open joint", .meaning = "shear strength without pressure"},
    {"tensile_strength", KEY(raw_interface, tensile_strength), .dimension = {NMM_STRESS},
     .range = AT_LEAST(0), .standard = "0", .why = "an open joint",
     .meaning = "tension that it bears"},
    {"residual_friction_angle", KEY(raw_interface, residual_friction_angle),
     .dimension = {NMM_ANGLE}, .range = FRICTION_RANGE, .computed = "friction_angle",
     .meaning = "angle of friction after cohesion and tensile strength are broken"},
    {"normal_stiffness", KEY(raw_interface, normal_stiffness), .dimension = {NMM_STIFFNESS},
     .range = ABOVE(0), .automatic = true, .standard = "auto", .why = "from contact.penalty",
     .meaning = "pressure over closure"},
    {"shear_stiffness", KEY(raw_interface, shear_stiffness), .dimension = {NMM_STIFFNESS},
     .range = ABOVE(0), .automatic = true, .standard = "auto", .why = "normal stiffness / 2.5",
     .meaning = "shear stress over shear displacement"},
    {"dilation_angle", .later = true},
};
static const nmm_object interface_object = OBJECT(
    "interfaces", interface_keys, raw_interface, .noted = true,
    .meaning = "Mohr-Coulomb laws of joints and contacts. Cohesion and tensile strength hold "
               "until they are broken for the first time.");

// --- Covers, supports, loads

static const nmm_word order_words[] = {
    {"auto", -1, false}, {"0", 0, false}, {"1", 1, false}, {"2", 2, false}, {NULL, 0, false}};
static const nmm_word mesh_words[] = {
    {"lattice", NMM_MESH_LATTICE, false}, {"block", NMM_MESH_BLOCK, false}, {NULL, 0, false}};
static const nmm_key covers_keys[] = {
    {"size", KEY(raw_covers, size), .dimension = {NMM_LENGTH}, .range = ABOVE(0), .automatic = true,
     .standard = "auto", .why = "chosen from the size of the scene, or of its blocks",
     .meaning = "distance of neighbouring lattice nodes; not with `mesh: block`"},
    {"order", KEY(raw_covers, order), .kind = NMM_VALUE_CHOICE, .word = order_words,
     .standard = "auto", .why = "0 on a lattice, 1 for whole blocks",
     .meaning =
         "order of the cover functions: 0, 1 or 2 on a lattice (displacements of degree 1, 2, "
         "3), 1 with `mesh: block`"},
    {"mesh", KEY(raw_covers, mesh), .kind = NMM_VALUE_CHOICE, .word = mesh_words,
     .standard = "lattice", .why = "regular triangles",
     .meaning =
         "mathematical mesh; `block`: one cover for each block, six unknowns, uniform strain"},
};
static const nmm_object covers_object =
    OBJECT("covers", covers_keys, raw_covers, .noted = true, .meaning = "The mathematical mesh.");

static const nmm_word fix_words[] = {
    {"x", 1, false}, {"y", 2, false}, {"xy", 3, false}, {NULL, 0, false}};
static const nmm_key support_keys[] = {
    {"point", KEY(raw_place, point), POINT, .meaning = "one point"},
    {"segment", KEY(raw_place, segment), POINTS(2, 2),
     .meaning = "all of the boundary on this line"},
    {"box", KEY(raw_place, box), POINTS(2, 2), .meaning = "all in this box; two opposite corners"},
    {"block", KEY(raw_place, block), .kind = NMM_VALUE_NAME,
     .meaning = "whole blocks, by their name"},
    {"fix", KEY(raw_place, fix), .kind = NMM_VALUE_CHOICE, .word = fix_words, .required = true,
     .meaning = "directions that are held"},
    {"motion", KEY(raw_place, history), .kind = NMM_VALUE_ROWS, .width = 3, .least_row = 1,
     .dimension = {NMM_TIME, NMM_LENGTH, NMM_LENGTH}, .computed = "at rest",
     .meaning = "displacement over time: rows of t, ux, uy; straight between rows, constant before "
                "and after"},
};
static const nmm_object support_object =
    OBJECT("supports", support_keys, raw_place, .one_of = "point, segment, box, block",
           .meaning = "What is held, or moved along a given path.");

static const nmm_key load_keys[] = {
    {"point", KEY(raw_place, point), POINT, .meaning = "where a force acts"},
    {"segment", KEY(raw_place, segment), POINTS(2, 2),
     .meaning = "part of the boundary where a traction acts"},
    {"force", KEY(raw_place, force), .kind = NMM_VALUE_ROW, .width = 2,
     .dimension = {NMM_FORCE, NMM_FORCE}, .meaning = "with point: force along x and y"},
    {"traction", KEY(raw_place, traction), .kind = NMM_VALUE_ROW, .width = 2,
     .dimension = {NMM_STRESS, NMM_STRESS},
     .meaning = "with segment: force per area along x and y, whatever way the segment runs"},
    {"history", KEY(raw_place, history), .kind = NMM_VALUE_ROWS, .width = 2, .least_row = 1,
     .dimension = {NMM_TIME, NMM_PURE}, .computed = "constant",
     .meaning = "factor over time: rows of t, factor; straight between rows, constant before and "
                "after"},
};
static const nmm_object load_object =
    OBJECT("loads", load_keys, raw_place, .one_of = "point, segment",
           .meaning = "Forces and tractions, dead: they keep their direction.");

static const nmm_word initial_words[] = {{"gravity", NMM_INITIAL_GRAVITY, false},
                                         {"uniform", NMM_INITIAL_UNIFORM, false},
                                         {NULL, 0, false}};
static const nmm_key initial_keys[] = {
    {"kind", KEY(raw_initial, kind), .kind = NMM_VALUE_CHOICE, .word = initial_words,
     .required = true, .meaning = "grows with depth, or the same everywhere"},
    {"surface", KEY(raw_initial, surface), .dimension = {NMM_LENGTH},
     .computed = "highest corner of domain and blocks",
     .meaning = "gravity: level y of the free surface"},
    {"k0", KEY(raw_initial, k0), .range = FROM_TO(0, 10), .computed = "0.5",
     .meaning = "gravity: horizontal over vertical stress"},
    {"xx", KEY(raw_initial, xx), .dimension = {NMM_STRESS}, .computed = "0",
     .meaning = "uniform: stress, tension positive"},
    {"yy", KEY(raw_initial, yy), .dimension = {NMM_STRESS}, .computed = "0",
     .meaning = "uniform: stress, tension positive"},
    {"xy", KEY(raw_initial, xy), .dimension = {NMM_STRESS}, .computed = "0",
     .meaning = "uniform: shear stress"},
};
static const nmm_object initial_object =
    OBJECT("initial_stress", initial_keys, raw_initial, .meaning = "Stress before the first step.");

static const nmm_word unit_words[] = {{"m/s2", 0, false}, {"g", 1, false}, {NULL, 0, false}};
static const nmm_key base_keys[] = {
    {"acceleration", KEY(raw_base, acceleration), .kind = NMM_VALUE_ROWS, .width = 3,
     .least_row = 1, .dimension = {NMM_TIME, NMM_ACCELERATION, NMM_ACCELERATION},
     .unit_key = "unit", .required = true,
     .meaning = "of the ground: rows of t, ax, ay; straight between rows"},
    {"unit", KEY(raw_base, unit), .kind = NMM_VALUE_CHOICE, .word = unit_words, .standard = "m/s2",
     .meaning = "of accelerations without a unit; g is 9.80665 m/s2"},
};
static const nmm_object base_object =
    OBJECT("base_motion", base_keys, raw_base, .meaning = "An earthquake at all supports.");

// --- Settings

static const nmm_word contact_words[] = {{"penalty", NMM_CONTACT_PENALTY, false},
                                         {"augmented", NMM_CONTACT_AUGMENTED, false},
                                         {NULL, 0, false}};
static const nmm_key contact_keys[] = {
    {"penalty", KEY(raw_contact, penalty), .range = FROM_TO(1e-3, 1e7), .automatic = true,
     .standard = "auto", .why = "chosen for small overlap at a well-conditioned system",
     .meaning = "stiffness of contacts as a multiple of youngs_modulus"},
    {"method", KEY(raw_contact, method), .kind = NMM_VALUE_CHOICE, .word = contact_words,
     .standard = "penalty", .why = "fewest passes", .meaning = "how overlap is prevented"},
};
static const nmm_object contact_object = OBJECT("contact", contact_keys, raw_contact, .noted = true,
                                                .meaning = "How contacts are computed.");

static const nmm_word kind_words[] = {
    {"dynamic", 0, false}, {"static", 1, false}, {NULL, 0, false}};
static const nmm_word scheme_words[] = {{"shi", 0, false}, {"newmark", 1, false}, {NULL, 0, false}};
static const nmm_word mass_words[] = {{"consistent", NMM_MASS_CONSISTENT, false},
                                      {"lumped", NMM_MASS_LUMPED, false},
                                      {NULL, 0, false}};
static const nmm_key analysis_keys[] = {
    {"kind", KEY(raw_analysis, kind), .kind = NMM_VALUE_CHOICE, .word = kind_words,
     .standard = "dynamic", .why = "blocks may move",
     .meaning = "dynamic: motion in time; static: the equilibrium under the loads at time.end"},
    {"scheme", KEY(raw_analysis, scheme), .kind = NMM_VALUE_CHOICE, .word = scheme_words,
     .standard = "shi", .why = "stable with contacts that open and close",
     .meaning = "time integration; shi: equilibrium at the end of the step, which damps; newmark: "
                "average acceleration, which does not"},
    {"beta", KEY(raw_analysis, beta), .range = FROM_TO(0.25, 0.5), .computed = "0.25",
     .meaning = "of scheme: newmark; above a quarter it damps"},
    {"gamma", KEY(raw_analysis, gamma), .range = FROM_TO(0.5, 1), .computed = "2 beta",
     .meaning = "of scheme: newmark; always twice beta"},
    {"damping", KEY(raw_analysis, damping), .dimension = {NMM_RATE}, .range = AT_LEAST(0),
     .standard = "0", .why = "no damping beside that of the time scheme",
     .meaning = "mass-proportional damping"},
    {"mass", KEY(raw_analysis, mass), .kind = NMM_VALUE_CHOICE, .word = mass_words,
     .standard = "consistent", .why = "exact for the cover functions", .meaning = "mass matrix"},
    {"tolerance", KEY(raw_analysis, tolerance), .range = FROM_TO(1e-14, 0.1), .standard = "1e-6",
     .why = "forces balance to a millionth",
     .meaning = "unbalanced over acting forces at which a step is settled"},
};
static const nmm_object analysis_object =
    OBJECT("analysis", analysis_keys, raw_analysis, .noted = true, .meaning = "What is computed.");

static const nmm_key time_keys[] = {
    {"dt", KEY(raw_time, dt), .dimension = {NMM_TIME}, .range = ABOVE(0),
     .computed = "**required**; with `kind: static` what a wave takes through a cover",
     .meaning = "first step"},
    {"end", KEY(raw_time, end), .dimension = {NMM_TIME}, .range = ABOVE(0),
     .computed = "**required**; with `kind: static` the end of all histories",
     .meaning = "end of the run"},
    {"dt_min", KEY(raw_time, dt_min), .dimension = {NMM_TIME}, .range = ABOVE(0),
     .computed = "dt / 1e6", .meaning = "the run ends when a step would have to be shorter"},
    {"dt_max", KEY(raw_time, dt_max), .dimension = {NMM_TIME}, .range = ABOVE(0), .computed = "dt",
     .meaning = "longest step"},
    {"max_move", KEY(raw_time, max_move), .range = ABOVE_TO(0, 1), .standard = "0.01",
     .why = "the usual limit of the method",
     .meaning = "largest displacement of a step over half the larger side of the scene"},
};
static const nmm_object time_object =
    OBJECT("time", time_keys, raw_time, .noted = true, .meaning = "Time steps.");

static const nmm_word method_words[] = {{"auto", NMM_METHOD_AUTO, false},
                                        {"jacobi", NMM_METHOD_JACOBI, false},
                                        {"pcg", NMM_METHOD_PCG, false},
                                        {"sor", NMM_METHOD_SOR, false},
                                        {"gauss-seidel", NMM_METHOD_GAUSS_SEIDEL, false},
                                        {"chebyshev", NMM_METHOD_CHEBYSHEV, false},
                                        {"direct", NMM_METHOD_DIRECT, false},
                                        {NULL, 0, false}};
static const nmm_word stop_words[] = {{"residual", NMM_STOP_RESIDUAL, false},
                                      {"average_change", NMM_STOP_AVERAGE_CHANGE, false},
                                      {NULL, 0, false}};
static const nmm_word device_words[] = {{"auto", NMM_DEVICE_CHOOSE, false},
                                        {"host", NMM_DEVICE_HOST, false},
                                        {"target", NMM_DEVICE_TARGET, false},
                                        {NULL, 0, false}};
static const nmm_word blocks_words[] = {{"auto", NMM_SCENE_BLOCKS_AUTO, false},
                                        {"cover", NMM_SCENE_BLOCKS_COVER, false},
                                        {"cluster", NMM_SCENE_BLOCKS_CLUSTER, false},
                                        {"body", NMM_SCENE_BLOCKS_BODY, false},
                                        {NULL, 0, false}};
static const nmm_word precision_words[] = {{"auto", NMM_SCENE_PRECISION_AUTO, false},
                                           {"double", NMM_SCENE_DOUBLE, false},
                                           {"mixed", NMM_SCENE_MIXED, false},
                                           {"single", -1, true},
                                           {NULL, 0, false}};
static const nmm_key solver_keys[] = {
    {"method", KEY(raw_solver, method), .kind = NMM_VALUE_CHOICE, .word = method_words,
     .standard = "auto", .why = "chosen by size, contacts and device", .meaning = "linear solver"},
    {"blocks", KEY(raw_solver, blocks), .kind = NMM_VALUE_CHOICE, .word = blocks_words,
     .standard = "auto", .why = "chosen by size and contacts",
     .meaning = "jacobi, chebyshev, pcg: diagonal blocks that are inverted, one for each cover or "
                "each cluster of covers; body: clusters and the rigid motions of parts of blocks"},
    {"tolerance", KEY(raw_solver, tolerance), .range = FROM_TO(1e-15, 0.1), .standard = "1e-8",
     .why = "well below the force balance asked for",
     .meaning = "of the stopping test; passes of auto that follow friction have their own, 1e-3 to "
                "1e-5, or this one where it is looser"},
    {"stop", KEY(raw_solver, stop), .kind = NMM_VALUE_CHOICE, .word = stop_words,
     .standard = "residual", .why = "measures the error of the equations",
     .meaning = "stopping test: relative residual, or average change of the unknowns in a sweep "
                "(jacobi, chebyshev, sor, gauss-seidel)"},
    {"damping", KEY(raw_solver, damping), .range = BETWEEN(0, 2), .automatic = true,
     .standard = "auto", .why = "from an estimate of the largest eigenvalue",
     .meaning = "jacobi: factor on each correction; 1: plain"},
    {"factor", KEY(raw_solver, factor), .range = BETWEEN(0, 2), .standard = "1.9",
     .why = "that of the paper", .meaning = "sor: over-relaxation"},
    {"max_iterations", KEY(raw_solver, max_iterations), .whole = true, .range = FROM_TO(1, 1e9),
     .automatic = true, .standard = "auto", .why = "chosen by size and method",
     .meaning = "a solve that needs more has failed; then the step is shortened"},
    {"device", KEY(raw_solver, device), .kind = NMM_VALUE_CHOICE, .word = device_words,
     .standard = "auto", .why = "the host; a target is asked for by name",
     .meaning = "where the solver runs; target never falls back to the host"},
    {"precision", KEY(raw_solver, precision), .kind = NMM_VALUE_CHOICE, .word = precision_words,
     .standard = "auto", .why = "mixed where the method is chosen and a large system gains by it",
     .meaning = "of the solver; mixed: iterations in single precision inside a correction in "
                "double, to the same tolerance (pcg, jacobi, chebyshev)"},
};
static const nmm_object solver_object =
    OBJECT("solver", solver_keys, raw_solver, .noted = true, .meaning = "The linear solver.");

static const nmm_word record_words[] = {
    {"displacement", 1, false}, {"velocity", 2, false}, {"stress", 4, false}, {NULL, 0, false}};
static const nmm_key monitor_keys[] = {
    {"name", KEY(raw_monitor, name), .kind = NMM_VALUE_NAME,
     .computed = "monitor 1, monitor 2, ...", .meaning = "in the results"},
    {"point", KEY(raw_monitor, point), POINT, .required = true,
     .meaning = "place in the undeformed scene; it moves with the material"},
    {"record", KEY(raw_monitor, record), .kind = NMM_VALUE_WORDS, .word = record_words,
     .standard = "[displacement, velocity, stress]", .meaning = "what is recorded at each step"},
};
static const nmm_object monitor_object =
    OBJECT("monitors", monitor_keys, raw_monitor, .meaning = "Points whose motion is recorded.");

static const nmm_word field_words[] = {{"displacement", 1, false},
                                       {"velocity", 2, false},
                                       {"stress", 4, false},
                                       {"contact", 8, false},
                                       {NULL, 0, false}};
static const nmm_key output_keys[] = {
    {"every", KEY(raw_output, every), .dimension = {NMM_TIME}, .range = AT_LEAST(0),
     .computed = "end / 100", .meaning = "time between frames; 0: every step"},
    {"fields", KEY(raw_output, fields), .kind = NMM_VALUE_WORDS, .word = field_words,
     .standard = "[displacement, velocity, stress, contact]", .why = "all there are",
     .meaning = "what a frame holds"},
};
static const nmm_object output_object =
    OBJECT("output", output_keys, raw_output, .noted = true, .meaning = "The run file.");

// --- The whole

static const nmm_word version_words[] = {{"1", 1, false}, {NULL, 0, false}};

#define LIST_OF(member, what) KEY(raw_scene, member), .kind = NMM_VALUE_LIST, .object = &what
#define ALWAYS(member, what)                                                                       \
    KEY(raw_scene, member), .kind = NMM_VALUE_OBJECT, .object = &what, .always = true

static const nmm_key scene_keys[] = {
    {"nmm", KEY(raw_scene, version), .kind = NMM_VALUE_CHOICE, .word = version_words,
     .required = true, .meaning = "version of the format"},
    {"title", KEY(raw_scene, title), .kind = NMM_VALUE_TEXT, .computed = "none",
     .meaning = "for pictures and reports"},
    {"gravity", KEY(raw_scene, gravity), .kind = NMM_VALUE_ROW, .width = 2,
     .dimension = {NMM_ACCELERATION, NMM_ACCELERATION}, .standard = "[0, -9.81]",
     .why = "on Earth, y up", .meaning = "acceleration along x and y"},
    {"domain", LIST_OF(domain, domain_object), .meaning = "outer boundary, one or more areas"},
    {"holes", LIST_OF(holes, hole_object), .meaning = "openings in the domain"},
    {"regions", LIST_OF(regions, region_object), .meaning = "parts with another material"},
    {"joints", LIST_OF(joints, joint_object), .meaning = "single joints"},
    {"joint_sets", LIST_OF(joint_sets, set_object), .meaning = "sets of parallel joints"},
    {"blocks", LIST_OF(blocks, block_object), .meaning = "blocks that are not cut from a domain"},
    {"materials", KEY(raw_scene, materials), .kind = NMM_VALUE_NAMED, .object = &material_object,
     .required = true, .meaning = "materials by name"},
    {"interfaces", KEY(raw_scene, interfaces), .kind = NMM_VALUE_NAMED, .object = &interface_object,
     .meaning = "interfaces by name"},
    {"interface", KEY(raw_scene, interface), .kind = NMM_VALUE_NAME,
     .computed = "the only interface, else 30 degrees of friction without cohesion",
     .meaning = "interface of contacts that no joint names"},
    {"covers", ALWAYS(covers, covers_object), .meaning = "mathematical mesh"},
    {"supports", LIST_OF(supports, support_object), .meaning = "what is held or moved"},
    {"loads", LIST_OF(loads, load_object), .meaning = "forces and tractions"},
    {"initial_stress", KEY(raw_scene, initial_stress), .kind = NMM_VALUE_OBJECT,
     .object = &initial_object, .computed = "none", .meaning = "stress before the first step"},
    {"base_motion", KEY(raw_scene, base_motion), .kind = NMM_VALUE_OBJECT, .object = &base_object,
     .computed = "none", .meaning = "earthquake"},
    {"contact", ALWAYS(contact, contact_object), .meaning = "how contacts are computed"},
    {"analysis", ALWAYS(analysis, analysis_object), .meaning = "what is computed"},
    {"time", ALWAYS(time, time_object), .computed = "**required**; not with `kind: static`",
     .meaning = "time steps"},
    {"solver", ALWAYS(solver, solver_object), .meaning = "linear solver"},
    {"monitors", LIST_OF(monitors, monitor_object), .meaning = "recorded points"},
    {"output", ALWAYS(output, output_object), .meaning = "run file"},
    {"stages", .later = true},
};
const nmm_object nmm_object_scene =
    OBJECT("scene", scene_keys, raw_scene, .noted = true, .meaning = "The whole file.");

const nmm_object *const nmm_object_table[] = {
    &nmm_object_scene, &domain_object,  &circle_object,   &hole_object,
    &region_object,    &joint_object,   &set_object,      &spread_object,
    &block_object,     &repeat_object,  &material_object, &interface_object,
    &covers_object,    &support_object, &load_object,     &initial_object,
    &base_object,      &contact_object, &analysis_object, &time_object,
    &solver_object,    &monitor_object, &output_object,   NULL};

int nmm_key_index(const nmm_object *object, const char *name) {
    for (int i = 0; i < object->n_key; i++) {
        if (strcmp(object->key[i].name, name) == 0) return i;
    }
    return -1;
}
