// SPDX-License-Identifier: MIT
//
// A scene file as a checked description: everything in SI, angles in radians, names resolved to
// indices, joint sets and repeated blocks expanded. Nothing is cut or meshed here.
//
// docs/format.md describes the file; keys.c holds its keys. A value's place in the file travels
// along as `nmm_mark`, so that later stages (a support that touches nothing, a joint outside the
// domain) can still name line and column.

#ifndef NMM_SCENE_H
#define NMM_SCENE_H

#include "model.h"

typedef struct nmm_mark {
    int line, column; // from 1; 0: not in the file
    int source;       // 0: the scene file; k: override k, from 1
} nmm_mark;

/// A closed polygon, counter-clockwise, simple, without repeated last corner.
typedef struct nmm_scene_area {
    int n;
    nmm_vec2 *corner; // [n]
    int material;     // -1 where none is meant (holes)
    nmm_mark mark;
} nmm_scene_area;

typedef struct nmm_scene_joint {
    const char *name;
    int n;            // corners of the polyline, at least 2
    nmm_vec2 *corner; // [n]
    int interface;    // index, 0: the scene's default interface
    int set;          // joint set that made it, -1: listed by hand
    nmm_mark mark;
} nmm_scene_joint;

typedef struct nmm_scene_block {
    const char *name; // several blocks may share one, repeated ones do
    nmm_scene_area area;
    double velocity[3]; // [m/s] vx, vy of the centroid; [1/s] spin
} nmm_scene_block;

typedef enum nmm_place_kind {
    NMM_PLACE_POINT,
    NMM_PLACE_SEGMENT,
    NMM_PLACE_BOX,
    NMM_PLACE_BLOCK
} nmm_place_kind;

typedef struct nmm_scene_support {
    nmm_place_kind kind;
    nmm_vec2 a, b;     // point: a; segment: a, b; box: low, high corner
    const char *block; // block: name, all blocks of that name
    bool fix_x, fix_y;
    int history; // displacement history of width 2, -1: none
    nmm_mark mark;
} nmm_scene_support;

typedef struct nmm_scene_load {
    nmm_place_kind kind; // point or segment
    nmm_vec2 a, b;
    nmm_vec2 value; // point: force [N]; segment: traction [Pa] along x and y
    int history;    // factor history of width 1, -1: constant
    nmm_mark mark;
} nmm_scene_load;

typedef enum nmm_initial_kind {
    NMM_INITIAL_NONE,
    NMM_INITIAL_UNIFORM,
    NMM_INITIAL_GRAVITY
} nmm_initial_kind;

typedef struct nmm_scene_initial {
    nmm_initial_kind kind;
    double xx, yy, xy; // uniform [Pa]
    double surface;    // gravity: level of the free surface [m]
    double k0;         // gravity: horizontal over vertical stress
    nmm_mark mark;
} nmm_scene_initial;

typedef struct nmm_scene_monitor {
    const char *name;
    nmm_vec2 point;
    bool displacement, velocity, stress;
    nmm_mark mark;
} nmm_scene_monitor;

typedef enum nmm_contact_method { NMM_CONTACT_PENALTY, NMM_CONTACT_AUGMENTED } nmm_contact_method;
/// Mathematical mesh: regular triangles, or one cover of order 1 for each block of rock.
typedef enum nmm_mesh { NMM_MESH_LATTICE, NMM_MESH_BLOCK } nmm_mesh;
typedef enum nmm_mass { NMM_MASS_CONSISTENT, NMM_MASS_LUMPED } nmm_mass;
typedef enum nmm_method {
    NMM_METHOD_AUTO,
    NMM_METHOD_JACOBI,
    NMM_METHOD_PCG,
    NMM_METHOD_SOR,
    NMM_METHOD_GAUSS_SEIDEL,
    NMM_METHOD_CHEBYSHEV,
    NMM_METHOD_DIRECT
} nmm_method;
/// Diagonal blocks of the linear solver (not blocks of rock).
typedef enum nmm_scene_blocks {
    NMM_SCENE_BLOCKS_AUTO,
    NMM_SCENE_BLOCKS_COVER,
    NMM_SCENE_BLOCKS_CLUSTER,
    NMM_SCENE_BLOCKS_BODY
} nmm_scene_blocks;
typedef enum nmm_scene_precision {
    NMM_SCENE_DOUBLE,
    NMM_SCENE_MIXED,
    NMM_SCENE_PRECISION_AUTO
} nmm_scene_precision;
typedef enum nmm_stop { NMM_STOP_RESIDUAL, NMM_STOP_AVERAGE_CHANGE } nmm_stop;

/// Everything a user can set that is not geometry. Filled with defaults; `nmm check` prints them.
typedef struct nmm_scene_settings {
    double cover_size;  // covers.size [m]; 0: chosen from the scene
    nmm_mark size_mark; // of covers.size
    nmm_mesh mesh;      // covers.mesh
    int order;          // covers.order: 0, 1, 2; 1 for whole blocks
    double penalty;     // contact.penalty, times Young's modulus; 0: auto
    nmm_contact_method contact_method;
    bool is_static;        // analysis.kind
    bool newmark;          // analysis.scheme
    double beta;           // analysis.beta; gamma is twice that; 1/2 in Shi's scheme
    double damping;        // analysis.damping [1/s]
    nmm_mass mass;         // analysis.mass
    double tolerance;      // analysis.tolerance: force balance of a step, relative
    double dt, end;        // time.dt, time.end [s]
    double dt_min, dt_max; // time.dt_min, time.dt_max [s]; from dt where not given
    double max_move;   // time.max_move: largest displacement of a step over half the larger side
    nmm_method method; // solver.method
    nmm_scene_blocks blocks;       // solver.blocks
    nmm_scene_precision precision; // solver.precision
    double solver_tolerance;       // solver.tolerance
    nmm_stop stop;                 // solver.stop
    double jacobi_damping;         // solver.damping; 0: from an estimate of lambda_max; 1: plain
    double sor_factor;             // solver.factor
    int max_iterations;            // solver.max_iterations; 0: chosen
    nmm_device_choice device;      // solver.device; auto = NMM_DEVICE_CHOOSE
    double output_every;           // output.every [s]; 0: every step
    bool out_displacement, out_velocity, out_stress, out_contact; // output.fields
} nmm_scene_settings;

typedef struct nmm_scene {
    const char *path; // as given
    const char *text; // the file's text, `text_length` bytes
    size_t text_length;
    const char *title;
    nmm_vec2 gravity; // [m/s2]
    int n_domain, n_hole, n_region, n_joint, n_block, n_material, n_interface;
    int n_support, n_load, n_monitor, n_history;
    nmm_scene_area *domain, *hole, *region;
    nmm_scene_joint *joint; // joint sets expanded
    nmm_scene_block *block; // repeats expanded
    nmm_material *material;
    const char **material_name;
    nmm_interface *interface; // entry 0: the scene's default
    const char **interface_name;
    nmm_scene_support *support;
    nmm_scene_load *load;
    nmm_scene_monitor *monitor;
    nmm_history *history;
    nmm_history base_motion; // ground acceleration, width 2 [m/s2]; n = 0: none
    nmm_scene_initial initial;
    nmm_scene_settings settings;
    nmm_arena arena; // owns all of the above
    int n_override;
    const char **override; // as given, for messages
    int n_error;           // mistakes found
    char *report;          // all mistakes of the file as text to print, one block each; NULL: none
    char *warnings;        // a line for each: file:line:column: warning: ...; NULL: none
    char *defaults;        // for `nmm check`: a line for each default chosen and why
} nmm_scene;

/// Read and check the scene at `path`. Each of `override` is "key.path=value", as given on the
/// command line; it replaces or adds what the file says.
/// NMM_ERROR_FILE: the file cannot be read. NMM_ERROR_INPUT: the scene is wrong; then scene->report
/// holds every mistake and context->error the first one, with file, line and column.
/// NMM_ERROR_MEMORY. The scene must start zeroed, and must be destroyed in any case. Nothing is
/// shared between scenes: different contexts may read on different threads at once.
nmm_status nmm_scene_read(nmm_context *context, nmm_scene *scene, const char *path, int n_override,
                          const char *const *override);

/// The same from text in memory; `path` only names it in messages.
nmm_status nmm_scene_parse(nmm_context *context, nmm_scene *scene, const char *path,
                           const char *text, size_t length, int n_override,
                           const char *const *override);

/// Add a mistake found by a later stage at `mark` to scene->report (and to the context, if it is
/// the first), in the same form as the reader's own, and return NMM_ERROR_INPUT.
nmm_status nmm_scene_reject(nmm_context *context, nmm_scene *scene, nmm_mark mark,
                            const char *format, ...) __attribute__((format(printf, 4, 5)));

/// Add a line to scene->warnings: allowed, but hardly meant. NMM_ERROR_MEMORY.
nmm_status nmm_scene_warn(nmm_context *context, nmm_scene *scene, nmm_mark mark, const char *format,
                          ...) __attribute__((format(printf, 4, 5)));

void nmm_scene_destroy(nmm_context *context, nmm_scene *scene);

#endif
