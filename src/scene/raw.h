// SPDX-License-Identifier: MIT
//
// A scene as it is written: what the key table fills, before names are resolved and geometry is
// checked. Every object begins with a head that tells which keys were read without a mistake.
// Numbers are SI, angles degrees.

#ifndef NMM_SCENE_RAW_H
#define NMM_SCENE_RAW_H

#include "keys.h"
#include "tree.h"

typedef struct raw_head {
    const nmm_object *object;
    const nmm_node *node; // NULL: not in the file
    const char *name;     // of an entry of a named map, or its key
    const char *path;     // "materials.sandstone"
    uint64_t good;        // bit k: key k of the object was read, or has its default
    uint64_t given;       // bit k: key k is in the file
} raw_head;

typedef struct raw_list {
    int n;
    void *item; // [n] of the object's struct
} raw_list;

typedef struct raw_rows {
    int n, width;
    double *value; // [n][width]
    const nmm_node *node;
} raw_rows;

typedef struct raw_polygons {
    int n;
    raw_rows *polygon;
} raw_polygons;

typedef struct raw_circle {
    raw_head head;
    nmm_vec2 center;
    double radius, segments;
} raw_circle;

typedef struct raw_repeat {
    raw_head head;
    double count[2];
    nmm_vec2 step, shift;
} raw_repeat;

// Domain, hole, region or block.
typedef struct raw_area {
    raw_head head;
    const char *name, *material;
    raw_rows polygon;
    raw_circle circle;
    double velocity[3];
    raw_repeat repeat;
} raw_area;

typedef struct raw_joint {
    raw_head head;
    const char *name, *interface;
    raw_rows polyline;
} raw_joint;

typedef struct raw_spread {
    raw_head head;
    double dip, spacing, position;
} raw_spread;

typedef struct raw_set {
    raw_head head;
    const char *name, *interface;
    double dip, spacing, persistence, trace_length, seed;
    nmm_vec2 origin;
    raw_spread spread;
    raw_polygons inside;
} raw_set;

typedef struct raw_material {
    raw_head head;
    double density, youngs_modulus, poissons_ratio;
    int plane;
} raw_material;

typedef struct raw_interface {
    raw_head head;
    double friction_angle, residual_friction_angle, cohesion, tensile_strength;
    double normal_stiffness, shear_stiffness;
} raw_interface;

typedef struct raw_covers {
    raw_head head;
    double size;
    int order, mesh;
} raw_covers;

// Support or load.
typedef struct raw_place {
    raw_head head;
    nmm_vec2 point, force, traction;
    raw_rows segment, box, history;
    const char *block;
    int fix;
} raw_place;

typedef struct raw_initial {
    raw_head head;
    int kind;
    double xx, yy, xy, surface, k0;
} raw_initial;

typedef struct raw_base {
    raw_head head;
    raw_rows acceleration;
    int unit;
} raw_base;

typedef struct raw_contact {
    raw_head head;
    double penalty;
    int method;
} raw_contact;

typedef struct raw_analysis {
    raw_head head;
    int kind, scheme, mass;
    double beta, gamma, damping, tolerance;
} raw_analysis;

typedef struct raw_time {
    raw_head head;
    double dt, end, dt_min, dt_max, max_move;
} raw_time;

typedef struct raw_solver {
    raw_head head;
    int method, blocks, stop, device, precision;
    double tolerance, damping, factor, max_iterations;
} raw_solver;

typedef struct raw_monitor {
    raw_head head;
    const char *name;
    nmm_vec2 point;
    int record;
} raw_monitor;

typedef struct raw_output {
    raw_head head;
    double every;
    int fields;
} raw_output;

typedef struct raw_scene {
    raw_head head;
    int version;
    const char *title, *interface;
    nmm_vec2 gravity;
    raw_list domain, holes, regions, joints, joint_sets, blocks, materials, interfaces;
    raw_list supports, loads, monitors;
    raw_covers covers;
    raw_initial initial_stress;
    raw_base base_motion;
    raw_contact contact;
    raw_analysis analysis;
    raw_time time;
    raw_solver solver;
    raw_output output;
} raw_scene;

/// Was key `key` of the object at `head` read without a mistake (or has it its default)?
bool raw_good(const raw_head *head, const char *key);
/// Is key `key` in the file, rightly spelt or not?
bool raw_given(const raw_head *head, const char *key);
/// Place of the key's value; of the object where the key is not in the file.
nmm_mark raw_mark(const raw_head *head, const char *key);
/// Place of the key itself.
nmm_mark raw_key_mark(const raw_head *head, const char *key);

/// Fill *raw from the root of the tree by the key table.
nmm_status raw_scene_read(nmm_reader *reader, const nmm_node *root, raw_scene *raw);

#endif
