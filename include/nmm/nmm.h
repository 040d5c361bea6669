// SPDX-License-Identifier: MIT
//
// nmm: the Numerical Manifold Method in 2-D. The public interface of the library.
//
// Handles are opaque. Settings are plain structs, filled by nmm_default_..._def(), changed by the
// user and copied on creation. The library has no globals; it never prints, aborts or exits.
// Different handles may be used on different threads at once; one handle on one thread at a time.
// SI units, x to the right, y up, angles in radians, stress positive in tension, 1 m thick.

#ifndef NMM_H
#define NMM_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(NMM_BUILDING) && defined(__GNUC__)
#define NMM_API __attribute__((visibility("default")))
#else
#define NMM_API
#endif

// --- Status and error

/// What a call came to. The command line's exit status follows from it.
typedef enum nmm_status {
    NMM_OK = 0,
    NMM_ERROR_MEMORY,   ///< no memory (exit 4)
    NMM_ERROR_INPUT,    ///< a wrong scene, setting or file content (exit 3)
    NMM_ERROR_FILE,     ///< the file system: missing, unwritable, full (exit 4)
    NMM_ERROR_DEVICE,   ///< the requested device is not there (exit 5)
    NMM_ERROR_NUMERIC,  ///< a number that is not finite; the message names stage, array and index
    NMM_ERROR_ARGUMENT, ///< a wrong argument of a call
} nmm_status;

/// The first error of a handle. `line` and `column` count from 1; 0 where no text is meant.
typedef struct nmm_error {
    nmm_status status;
    int line;
    int column;
    char file[256];
    char message[1024];
} nmm_error;

// --- Simulation

/// A scene, its model and its state: from the file to the end of the run.
typedef struct nmm_sim nmm_sim;

typedef enum nmm_device_choice {
    NMM_DEVICE_SCENE = 0, ///< as the scene says
    NMM_DEVICE_CHOOSE,    ///< auto: a target where it is there and pays, else the host
    NMM_DEVICE_HOST,
    NMM_DEVICE_TARGET, ///< never falls back: NMM_ERROR_DEVICE where there is none
} nmm_device_choice;

/// Settings of a simulation.
typedef struct nmm_sim_def {
    const char *path;            ///< scene file; also names the scene when `text` is given
    const char *text;            ///< scene text in memory, or NULL to read `path`
    size_t text_length;          ///< bytes of `text`
    int n_override;              ///< entries of `override`
    const char *const *override; ///< "key.path=value", as of `nmm run --set`
    int n_thread;                ///< host threads; 0: all
    int comparable;              ///< 1: the solver keeps to what host and target both have
    int search_always;           ///< 1: looks for contacts also where nothing can touch, to measure
                                 ///< what leaving it out saves
    nmm_device_choice device;
    void *(*allocate)(void *user, void *old, size_t size); ///< realloc-like hook; NULL: C library
    void *user;                                            ///< given to the hook
} nmm_sim_def;
NMM_API nmm_sim_def nmm_default_sim_def(void);

/// Why a run goes on or ended. Negative: early.
typedef enum nmm_end {
    NMM_END_RUNNING = 0,
    NMM_END_COMPLETED = 1,
    NMM_END_STEP_TOO_SMALL = -1, ///< dt_min reached: open-close or largest move did not settle, or
                                 ///< an element turned inside out
    NMM_END_SOLVER_FAILED = -2,  ///< dt_min reached: the linear solver did not converge
    NMM_END_INTERRUPTED = -3,    ///< the caller stopped
    NMM_END_NO_EQUILIBRIUM = -4, ///< statics: a block is free to move, or forces stay unbalanced
} nmm_end;
/// As run files and JSON spell it: "running", "completed", "step_too_small", ...
NMM_API const char *nmm_end_name(nmm_end end);

/// Energies [J] since the start. external = kinetic + strain + contact + friction + fracture +
/// support + damping + numerical + residual. Kinetic, strain, contact and support are changes of
/// stored energy; the others are sums over the steps.
typedef struct nmm_energy {
    double kinetic, strain, contact, friction, fracture, support, damping;
    double external;  ///< work of loads, gravity, base motion, moved supports
    double numerical; ///< loss of the time scheme, known in closed form step by step
    double residual;  ///< what is left over
} nmm_energy;

/// Does the ledger close, and does energy come from nowhere? Kept over the whole run.
typedef struct nmm_ledger {
    double largest;                  ///< [J] largest energy of any term
    double gain;                     ///< [J] largest fall of `numerical`: energy from nowhere
    double residual;                 ///< [J] largest residual
    double rounding;                 ///< [J] what rounding may make of both
    long gain_step, residual_step;   ///< since which step a limit is passed; 0: it is not
    double gain_time, residual_time; ///< [s] end of that step
    char warning[640];               ///< limits that are passed, since when, where; may be empty
} nmm_ledger;

/// Wall seconds by phase.
typedef struct nmm_phases {
    double contact, assemble, solve, advance, output;
} nmm_phases;

/// What one step did.
typedef struct nmm_step_report {
    nmm_end end;           ///< NMM_END_RUNNING: there is more to do
    long step;             ///< accepted steps so far
    double time, dt;       ///< [s] at the end of the step; its length
    int cuts;              ///< times this step was shortened
    int passes;            ///< open-close passes of the accepted try
    int solver_iterations; ///< of all passes and tries
    int contacts, closed;  ///< contacts found; of them closed at the end
    double move;           ///< largest displacement over the allowed one
    double penetration;    ///< [m] largest overlap at the end
    nmm_energy energy;     ///< ledger since the start
    char reason[256];      ///< why the last cut, or the end, came about; may be empty
} nmm_step_report;

/// A run as a whole, as `nmm run --json` prints it.
typedef struct nmm_summary {
    int blocks, elements, covers, unknowns, contacts;
    int is_static; ///< 1: `analysis.kind: static`, where `time` says nothing
    long steps;
    double time; ///< [s]
    nmm_end end;
    char reason[256];
    double wall_seconds;
    nmm_phases phase_seconds;
    char method[32];    ///< solver method asked for; the counts below tell what was used
    char device[64];    ///< "host" or the device
    int on_device;      ///< 1 when seen inside a target region
    char precision[16]; ///< used: "mixed" when some solve was mixed to its end, else "double"
    char precision_asked[16];
    long with_mixed;        ///< solves in mixed precision to their end
    long fell_back;         ///< solves that began in mixed precision, and double had to go on
    char fall_back[64];     ///< why the last of those did; may be empty
    int solve_threads;      ///< most threads of a solve
    char why[96];           ///< why `auto` chose what it chose most often; may be empty
    long why_solves;        ///< solves for which it said so
    long by_average_change; ///< solves that ended by the average change, whatever their residual
    long solves, iterations, failed;
    long with_cover, with_cluster, with_body; ///< solves by the diagonal blocks they ended with
    long with_direct;                         ///< solves that ended with the direct method
    long with_friction; ///< solves with friction's coupling, by minimal residuals (GMRES)
    long setups;        ///< times blocks or factors were made anew
    long transfers;     ///< copies to and from the device
    double transfer_bytes, transfer_seconds; ///< their size and time
    long dt_cuts, open_close_iterations;
    nmm_energy energy;
    nmm_ledger ledger;
    long pressed;    ///< closed contacts of `contact.method: augmented`, summed over the steps;
                     ///< in statics those of the last step
    long not_raised; ///< of them those whose force the springs held alone
    double max_penetration;  ///< [m] over the whole run
    double max_support_give; ///< [m] largest distance of a held point from its prescribed place
    double cover_size;       ///< [m]
    uint64_t state_hash;
} nmm_summary;

/// What the scene came to before the first step (`nmm check`).
typedef struct nmm_check {
    int blocks, elements, covers, unknowns, points, vertices;
    int contacts;                          ///< found in the first configuration
    int trimmed;                           ///< joint ends cut back to an element's edge
    double trimmed_length;                 ///< [m]
    int joints_outside;                    ///< joints that miss the domain
    double area, mean_area, smallest_area; ///< [m2]
    int whole_blocks;                      ///< 1: one cover for each block
    double cover_size;                     ///< [m]; of whole blocks the side of the median one
    double memory_bytes;                   ///< of model, state, system and solver
} nmm_check;

/// A read-only array: `count` rows of `width` numbers; valid until the next call on that handle.
typedef struct nmm_view {
    const double *data; ///< NULL: no such field
    int count, width;
    const char *unit;
} nmm_view;

/// What a monitor sees now. Parts that are not recorded are zero.
typedef struct nmm_reading {
    const char *name;
    int has_displacement, has_velocity, has_stress;
    double displacement[2], velocity[2], stress[3]; ///< [m] [m/s] [Pa] (xx, yy, xy)
} nmm_reading;

/// Read and check the scene, cut it into covers and elements. *sim is given even on failure, to ask
/// for its error; destroy it in any case.
NMM_API nmm_status nmm_sim_create(nmm_sim **sim, const nmm_sim_def *def);
NMM_API void nmm_sim_destroy(nmm_sim *sim);
/// The first error of the simulation; status NMM_OK when there is none.
NMM_API const nmm_error *nmm_sim_error(const nmm_sim *sim);
/// All mistakes of the scene as text to print, or NULL.
NMM_API const char *nmm_sim_mistakes(const nmm_sim *sim);
/// What is allowed but hardly meant, a line for each: file:line:column: warning: ...; may be empty.
NMM_API const char *nmm_sim_warnings(const nmm_sim *sim);
/// Each default chosen and why, each feature on or off and why: lines of text.
NMM_API const char *nmm_sim_choices(const nmm_sim *sim);
NMM_API nmm_status nmm_sim_check(nmm_sim *sim, nmm_check *check);
/// One time step. On an error the state is that of the last good step.
NMM_API nmm_status nmm_sim_step(nmm_sim *sim, nmm_step_report *report);
/// Tell the simulation that the caller stops here (summary.end becomes interrupted).
NMM_API void nmm_sim_interrupt(nmm_sim *sim);
NMM_API void nmm_sim_summary(nmm_sim *sim, nmm_summary *summary);
/// "displacement", "velocity" (covers), "position" (points), "stress" (elements).
NMM_API nmm_view nmm_sim_view(const nmm_sim *sim, const char *field);
NMM_API int nmm_sim_monitors(const nmm_sim *sim);
NMM_API nmm_status nmm_sim_monitor(const nmm_sim *sim, int k, nmm_reading *reading);
/// End of the scene's time [s].
NMM_API double nmm_sim_end_time(const nmm_sim *sim);
NMM_API const char *nmm_sim_title(const nmm_sim *sim);

// --- Linear systems

/// Write the linear system of a step (from 1) and open-close iteration (from 1) as Matrix Market
/// files: PREFIX.mtx, PREFIX_rhs.mtx, PREFIX_guess.mtx (first guess of the solve),
/// PREFIX_places.mtx (x, y and block of each cover). Call before that step. Where a step is tried
/// again with a shorter dt, the last try that came so far counts. Trouble with the files is an
/// error of the step.
NMM_API nmm_status nmm_sim_dump_system(nmm_sim *sim, long step, int iteration, const char *prefix);
/// Times the files were written so far; 0: the run did not come there.
NMM_API int nmm_sim_dumped(const nmm_sim *sim);

/// One linear system and how to solve it. Words are those of `solver:` in a scene.
typedef struct nmm_linear_def {
    const char *matrix; ///< Matrix Market: coordinate real, symmetric or general
    int generate;       ///< with `matrix` NULL: a plate of about so many unknowns, in a step
    const char *rhs;    ///< array real; NULL: matrix times ones, so that the solution is known;
                        ///< of a generated system loads at random, always the same
    const char *guess;  ///< array real; NULL: zeros
    const char *places; ///< array real, x, y, body of each two unknowns; NULL: not known
    const char *output; ///< solution, written when it converged; NULL: nowhere
    const char *method, *blocks, *precision, *stop;
    double tolerance;   ///< relative residual to reach
    double absolute;    ///< [N] residual that is small enough in any case; 0: none
    double damping;     ///< jacobi; 0: from an estimate
    double sor_factor;  ///< 0: 1.9
    int max_iterations; ///< 0: chosen
    int n_thread;       ///< 0: all
    int n_repeat;       ///< solves to measure, each from the start with its setup; at least 1
    nmm_device_choice device;
    void *(*allocate)(void *user, void *old, size_t size); ///< as in nmm_sim_def
    void *user;
} nmm_linear_def;
/// auto everywhere, double, residual test to 1e-8, one solve.
NMM_API nmm_linear_def nmm_default_linear_def(void);

/// How it went. A solve that does not converge is no error: see `converged`.
typedef struct nmm_linear_report {
    int order, padded; ///< of the matrix; 1 where a decoupled unknown made an odd order even
    long entries;      ///< of both halves
    int converged;
    /// "converged", "diverged", "too_slow", "indefinite", "not_finite", "stagnated", "bad_pattern",
    /// "out_of_range"
    char end[24];
    char reason[64]; ///< the same in words
    int row;         ///< first of the two rows (from 1) that cause the trouble; 0: none named
    char method[16], blocks[16], precision[16], device[16];
    int on_device; ///< seen inside a target region
    char why[256]; ///< what `auto` chose and why; may be empty
    int n_thread, setups, iterations;
    long transfers;                          ///< of the last solve, to and from the device
    double transfer_bytes, transfer_seconds; ///< their size and time
    int by_average_change;         ///< 1: ended by the average change, whatever `residual` is
    double residual;               ///< |f - K u| / |f|; -1: not measured
    double lambda_min, lambda_max; ///< estimates for D^-1 K; 0: not made
    double solution_norm;          ///< |u|; infinite where it alone is beyond 1.8e308
    double error;                  ///< largest |u - 1| where the solution is all ones; else -1
    double read_seconds;           ///< reading or generating
    double seconds, least_seconds; ///< setup and solve: median and least of n_repeat
    nmm_error error_of_call;       ///< of a call that returns an error
} nmm_linear_report;
/// Read (or generate) and solve.
NMM_API nmm_status nmm_linear_solve(const nmm_linear_def *def, nmm_linear_report *report);

// --- Run files

/// Writes a run file beside the run: frames, monitors, ledger, contacts.
typedef struct nmm_output nmm_output;

/// Create the file (a temporary that is renamed when its first frame is whole) and write frame 0.
NMM_API nmm_status nmm_output_create(nmm_output **output, nmm_sim *sim, const char *path);
/// After each step: ledger and monitors, and a frame when one is due.
NMM_API nmm_status nmm_output_step(nmm_output *output, nmm_sim *sim, const nmm_step_report *report);
/// Last frame, summary, status. Then destroy.
NMM_API nmm_status nmm_output_finish(nmm_output *output, nmm_sim *sim);
NMM_API const nmm_error *nmm_output_error(const nmm_output *output);
NMM_API void nmm_output_destroy(nmm_output *output);

/// A run file opened for reading.
typedef struct nmm_file nmm_file;
NMM_API nmm_status nmm_file_open(nmm_file **file, const char *path);
NMM_API void nmm_file_close(nmm_file *file);
NMM_API const nmm_error *nmm_file_error(const nmm_file *file);
NMM_API int nmm_file_frames(const nmm_file *file);
NMM_API nmm_status nmm_file_summary(nmm_file *file, nmm_summary *summary);
/// Name of the scene file, as it was given to the run.
NMM_API const char *nmm_file_scene_path(const nmm_file *file);
NMM_API const char *nmm_file_scene_text(nmm_file *file);
NMM_API int nmm_file_monitors(const nmm_file *file);
/// The last reading of monitor k.
NMM_API nmm_status nmm_file_monitor(nmm_file *file, int k, nmm_reading *reading);
/// .pvd and one .vtu for each frame into `folder`, for viewers that do not read temporal VTKHDF.
NMM_API nmm_status nmm_file_export_vtu(nmm_file *file, const char *folder);

typedef struct nmm_plot_def {
    int frame;         ///< -1: last
    const char *field; ///< "stress" (mean), "sxx", "syy", "sxy", "displacement", "velocity",
                       ///< "block"; NULL: chosen
    double scale;      ///< factor on displacements; 0: true scale
    int width;         ///< [pixels], 0: 1600
} nmm_plot_def;
NMM_API nmm_plot_def nmm_default_plot_def(void);
/// A picture; the ending of `path` says which kind: png, svg or pdf.
NMM_API nmm_status nmm_file_plot(nmm_file *file, const char *path, const nmm_plot_def *def);

/// "nmm 0.1.0 (gcc 12.2.0, ...)".
NMM_API const char *nmm_version(void);

#ifdef __cplusplus
}
#endif
#endif
