/* Dermis: forces from the normal stress of a tactile array, and the packets of a board's link.
 *
 * Written by cbindgen from sim/c/src; do not edit: DERMIS_ACCEPT=1 make c writes it anew.
 *
 * Functions return a dermis_status, or what they are asked for. The text of the last error on the same thread names field
 * and value: dermis_last_error(). A pointer that must not be NULL and is, a wrong length and a number that is not finite
 * are errors; a pointer to memory that is not there cannot be told apart from a good one.
 *
 * Memory: what a function gives through a pointer to a pointer belongs to the caller, who ends it with the function named
 * there; arrays belong to the caller and are neither kept nor freed; texts that are returned belong to the library.
 *
 * Units are mm, N and MPa; compression is positive. Arrays are row-major: taxel (row, col) has index row * cols + col.
 */

#ifndef DERMIS_H
#define DERMIS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/**
 * A limitation of a result, one bit of dermis_result_flags; the guide's page on robustness says when each is raised.
 */
typedef enum {
  /**
   * `no-contact`
   */
  DERMIS_FLAG_NO_CONTACT = (1 << 0),
  /**
   * `no-compression`
   */
  DERMIS_FLAG_NO_COMPRESSION = (1 << 1),
  /**
   * `condition-unmet`
   */
  DERMIS_FLAG_CONDITION_UNMET = (1 << 2),
  /**
   * `saturated`
   */
  DERMIS_FLAG_SATURATED = (1 << 3),
  /**
   * `load-outside`
   */
  DERMIS_FLAG_LOAD_OUTSIDE = (1 << 4),
  /**
   * `medium-mismatch`
   */
  DERMIS_FLAG_MEDIUM_MISMATCH = (1 << 5),
  /**
   * `shear-unreliable`
   */
  DERMIS_FLAG_SHEAR_UNRELIABLE = (1 << 6),
  /**
   * `coefficients-damaged`
   */
  DERMIS_FLAG_COEFFICIENTS_DAMAGED = (1 << 7),
  /**
   * `mu-at-bound`
   */
  DERMIS_FLAG_MU_AT_BOUND = (1 << 8),
  /**
   * `implausible-stress`
   */
  DERMIS_FLAG_IMPLAUSIBLE_STRESS = (1 << 9),
  /**
   * `load-mismatch`
   */
  DERMIS_FLAG_LOAD_MISMATCH = (1 << 10),
  /**
   * `shape-mismatch`
   */
  DERMIS_FLAG_SHAPE_MISMATCH = (1 << 11),
  /**
   * `shear-not-resolved`
   */
  DERMIS_FLAG_SHEAR_NOT_RESOLVED = (1 << 12),
  /**
   * `misfit`
   */
  DERMIS_FLAG_MISFIT = (1 << 13),
  /**
   * `too-many-contacts`
   */
  DERMIS_FLAG_TOO_MANY_CONTACTS = (1 << 14),
  /**
   * `tables-incomplete`
   */
  DERMIS_FLAG_TABLES_INCOMPLETE = (1 << 15),
  /**
   * `tables-refused`
   */
  DERMIS_FLAG_TABLES_REFUSED = (1 << 16),
  /**
   * `wrong-channel`
   */
  DERMIS_FLAG_WRONG_CHANNEL = (1 << 17),
  /**
   * `clipped`
   */
  DERMIS_FLAG_CLIPPED = (1 << 18),
  /**
   * `line-fault`
   */
  DERMIS_FLAG_LINE_FAULT = (1 << 19),
  /**
   * `taxel-constant`
   */
  DERMIS_FLAG_TAXEL_CONSTANT = (1 << 20),
  /**
   * `torn-frame`
   */
  DERMIS_FLAG_TORN_FRAME = (1 << 21),
  /**
   * `estimate-failed`
   */
  DERMIS_FLAG_ESTIMATE_FAILED = (1 << 22),
  /**
   * `taxel-suspect`
   */
  DERMIS_FLAG_TAXEL_SUSPECT = (1 << 23),
  /**
   * `estimates-differ`
   */
  DERMIS_FLAG_ESTIMATES_DIFFER = (1 << 24),
  /**
   * `noise-not-stated`
   */
  DERMIS_FLAG_NOISE_NOT_STATED = (1 << 25),
  /**
   * `score-low`
   */
  DERMIS_FLAG_SCORE_LOW = (1 << 26),
  /**
   * `taxel-missing`
   */
  DERMIS_FLAG_TAXEL_MISSING = (1 << 27),
  /**
   * `zero-limit`
   */
  DERMIS_FLAG_ZERO_LIMIT = (1 << 28),
  /**
   * `tare-suspect`
   */
  DERMIS_FLAG_TARE_SUSPECT = (1 << 29),
  /**
   * `negative-pressure`
   */
  DERMIS_FLAG_NEGATIVE_PRESSURE = (1 << 30),
} dermis_flag;


/**
 * Cross-check in a thread of its own, always the newest result, so that no result waits for it.
 */
#define DERMIS_CROSS_CHECK_BESIDE 18446744073709551615ull

/**
 * What became of a call.
 */
typedef enum {
  /**
   * Done.
   */
  DERMIS_STATUS_OK = 0,
  /**
   * An argument, scene or frame cannot be used.
   */
  DERMIS_STATUS_INPUT = 1,
  /**
   * The result does not have what was asked for.
   */
  DERMIS_STATUS_ABSENT = 2,
  /**
   * Bytes from the link are not a valid packet; the next ones are read.
   */
  DERMIS_STATUS_DAMAGED = 3,
  /**
   * The board was built for another scene or version, or does not answer.
   */
  DERMIS_STATUS_BOARD = 4,
  /**
   * A defect of Dermis.
   */
  DERMIS_STATUS_INTERNAL = 5,
} dermis_status;

/**
 * What dermis_link_receive found.
 */
typedef enum {
  /**
   * No packet is complete yet.
   */
  DERMIS_ANSWER_NONE = 0,
  /**
   * The board is the scene's.
   */
  DERMIS_ANSWER_IDENTITY = 1,
  /**
   * The result of a frame.
   */
  DERMIS_ANSWER_RESULT = 2,
  /**
   * An answer to no open request, such as a late one to a request that was made again; ignore it.
   */
  DERMIS_ANSWER_OTHER = 3,
} dermis_answer;

/**
 * A board that answers. One thread at a time may use it.
 */
typedef struct dermis_board dermis_board;

/**
 * The host end of a board's link. One thread at a time may use it.
 */
typedef struct dermis_link dermis_link;

/**
 * The forces of one frame. Any number of threads may read one at the same time.
 */
typedef struct dermis_result dermis_result;

/**
 * A sensor and the method that reconstructs its forces. Any number of threads may use one at the same time.
 */
typedef struct dermis_scene dermis_scene;

/**
 * The frames of a sensor in the order of time, and what they show of it. One thread at a time may use it.
 */
typedef struct dermis_stream dermis_stream;

/**
 * One contact of a result. A figure counts where its marker is true; else it is NaN.
 */
typedef struct {
  /**
   * Force in N: x, y, normal.
   */
  double force_N[3];
  /**
   * Standard deviation of the shear in N: x, y.
   */
  double shear_sigma_N[2];
  /**
   * Standard deviation of the normal force in N.
   */
  double normal_sigma_N;
  /**
   * Ratio of shear to normal force: x, y.
   */
  double mu[2];
  /**
   * Standard deviation of mu: x, y.
   */
  double mu_sigma[2];
  /**
   * Centre of pressure in mm from the array's centre: x, y.
   */
  double centre_mm[2];
  /**
   * Whether the estimator gives shear_sigma_N.
   */
  bool has_shear_sigma_N;
  /**
   * Whether the estimator gives normal_sigma_N.
   */
  bool has_normal_sigma_N;
  /**
   * Whether the estimator gives mu_sigma.
   */
  bool has_mu_sigma;
  /**
   * Whether there are compressive forces, which have a centre.
   */
  bool has_centre_mm;
} dermis_contact;

/**
 * Where the results of dermis_reconstruct_many are written, one after the other. An array that is NULL is left out.
 */
typedef struct {
  /**
   * Number of results, for which the arrays have room.
   */
  size_t results;
  /**
   * Sum of the forces in N, x, y and normal: 3 values for each result.
   */
  double *resultant_N;
  /**
   * Standard deviation of that in N: 3 values for each result, NaN where the estimator gives none.
   */
  double *sigma_N;
  /**
   * Limitations of the result, a sum of dermis_flag: 1 value for each result.
   */
  uint32_t *flags;
  /**
   * Force along x on each taxel in N: rows * cols values for each result.
   */
  double *fx_N;
  /**
   * Force along y on each taxel in N: rows * cols values for each result.
   */
  double *fy_N;
  /**
   * Normal force on each taxel in N: rows * cols values for each result.
   */
  double *fz_N;
} dermis_batch;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The text of the last error on this thread, with field and value; empty if there was none. It is overwritten by the next
 * error on the same thread, and not freed.
 */
const char *dermis_last_error(void);

/**
 * The version of the library, as in Cargo.toml; not freed.
 */
const char *dermis_version(void);

/**
 * Load a scene by built-in name or by the path of its file, as the commands take it. The scene belongs to the caller:
 * dermis_scene_free. After an error *scene is NULL.
 */
dermis_status dermis_scene_load(const char *name, dermis_scene **scene);

/**
 * Make a scene from the text of a scene file. origin is the path that stands in errors, and beside which the files are that
 * the scene names. The scene belongs to the caller: dermis_scene_free. After an error *scene is NULL.
 */
dermis_status dermis_scene_parse(const char *toml,
                                 const char *origin,
                                 dermis_scene **scene);

/**
 * Free a scene; NULL is allowed. Its results and links stay valid.
 */
void dermis_scene_free(dermis_scene *scene);

/**
 * Number of rows, along y; 0 after an error.
 */
size_t dermis_scene_rows(const dermis_scene *scene);

/**
 * Number of columns, along x; 0 after an error.
 */
size_t dermis_scene_cols(const dermis_scene *scene);

/**
 * Number of frames that one result takes: 2^average of a block, 1 of a sliding mean; 0 after an error. A sliding mean and a
 * running zero take all frames since the start.
 */
size_t dermis_scene_frames_per_result(const dermis_scene *scene);

/**
 * Reconstruct the forces of a frame, or of the frames of one result in the order of time.
 *
 * engine is "golden", the floating-point model, or "fixed", the integers of the hardware bit for bit. stress_MPa has count
 * values, frame after frame of rows * cols; readings if the scene names a calibration or tare file; NaN where a reading is
 * missing. With cross_check the estimator evidence reads the frames too, where the engine has another one, and flags what
 * noise, baseline or a faulty taxel hides from that: as `dermis reconstruct` does. It takes longer than a search.
 *
 * The result belongs to the caller: dermis_result_free. After an error *result is NULL. The first call for a scene and engine
 * builds the model, which takes longer than the others.
 */
dermis_status dermis_reconstruct(const dermis_scene *scene,
                                 const char *engine,
                                 const double *stress_MPa,
                                 size_t count,
                                 bool cross_check,
                                 dermis_result **result);

/**
 * Free a result; NULL is allowed. Its JSON is freed with it.
 */
void dermis_result_free(dermis_result *result);

/**
 * Write the sum of the forces in N, x, y and normal, to the 3 values of force_N.
 */
dermis_status dermis_result_resultant(const dermis_result *result, double *force_N);

/**
 * Write when the last frame of the result was acquired to time_ns, as dermis_stream_push_at was told; of a block it is the last
 * of its frames. DERMIS_STATUS_ABSENT if that was not stated.
 */
dermis_status dermis_result_time(const dermis_result *result,
                                 int64_t *time_ns);

/**
 * Write the force on each taxel in N to fx_N, fy_N and fz_N, which have room for as many values as there are taxels.
 * DERMIS_STATUS_ABSENT if the result has resultants only: output.forces = "resultants" in the scene, or a frame sent for its
 * resultants.
 */
dermis_status dermis_result_forces(const dermis_result *result,
                                   double *fx_N,
                                   double *fy_N,
                                   double *fz_N,
                                   size_t taxels);

/**
 * Write the contacts, at most capacity of them, and the number that the result has to count. With capacity 0, contacts may be
 * NULL. DERMIS_STATUS_ABSENT, and a count of 0, if the result does not tell contacts apart: those of the estimators
 * with evidence and of partition.case = "contacts" do.
 */
dermis_status dermis_result_contacts(const dermis_result *result,
                                     dermis_contact *contacts,
                                     size_t capacity,
                                     size_t *count);

/**
 * Write the limitations of the result to flags, a sum of dermis_flag.
 */
dermis_status dermis_result_flags(const dermis_result *result, uint32_t *flags);

/**
 * The result as `dermis reconstruct --json` prints it, or for a frame sent for its resultants as a line of
 * `dermis host --stream`: subarrays, figures behind the flags and all else. The text belongs to the result; NULL after an
 * error.
 */
const char *dermis_result_json(const dermis_result *result);

/**
 * Reconstruct frames that do not depend on each other, on all cores, into arrays of the caller.
 *
 * engine, stress_MPa and cross_check are as for dermis_reconstruct: count values, frame after frame of rows * cols; the stress is
 * read where it stands. batch->results is the number of results, count / (rows * cols) / dermis_scene_frames_per_result.
 * Results are those of dermis_reconstruct of each frame alone, in the order of the frames; the frames of a sensor in the order of
 * time show more, and take less time with evidence: dermis_stream. DERMIS_STATUS_INPUT for a sliding mean and a running zero, whose
 * results depend on the frames before; DERMIS_STATUS_ABSENT for forces of taxels of output.forces = "resultants". After an error what
 * the arrays hold is not defined.
 */
dermis_status dermis_reconstruct_many(const dermis_scene *scene,
                                      const char *engine,
                                      const double *stress_MPa,
                                      size_t count,
                                      bool cross_check,
                                      const dermis_batch *batch);

/**
 * Compute the stress that forces on the surface cause in the scene's medium, for any number of frames, on all cores.
 *
 * forces_N has count values, frame after frame of rows * cols * 3: x, y and normal force on each taxel's cell in N, over which
 * it is spread evenly. stress_MPa has room for count / 3 values, frame after frame of rows * cols: normal stress in MPa,
 * compression positive, of the medium, without the noise and codes of a sensor. After an error what stress_MPa holds is not
 * defined. The first call for a scene builds the model, which takes longer than the others.
 */
dermis_status dermis_stress(const dermis_scene *scene,
                            const double *forces_N,
                            size_t count,
                            double *stress_MPa);

/**
 * Compute the stress that forces on points of the surface cause in the scene's medium.
 *
 * at_mm has points * 2 values, x and y of each point in mm from the array's centre, also beside the array; forces_N has
 * points * 3 values, x, y and normal force in N. stress_MPa has room for rows * cols values, as dermis_stress has them.
 */
dermis_status dermis_stress_of_points(const dermis_scene *scene,
                                      const double *at_mm,
                                      const double *forces_N,
                                      size_t points,
                                      double *stress_MPa);

/**
 * Begin a stream of frames of a scene. It belongs to the caller: dermis_stream_free; the scene may be freed before it. After
 * an error *stream is NULL; DERMIS_STATUS_INPUT for a scene that the engine refuses.
 *
 * engine is "golden" or "fixed", as for dermis_reconstruct. cross_check says which results the estimator evidence reads too,
 * where the engine has another one: every so many, from the first one on, before they are given; 0: none;
 * DERMIS_CROSS_CHECK_BESIDE: the newest ones, as often as there is time. A finding is in the results up to the next one;
 * checks.cross_check_age in the text of dermis_result_json says how many results ago.
 */
dermis_status dermis_stream_new(const dermis_scene *scene,
                                const char *engine,
                                uint64_t cross_check,
                                dermis_stream **stream);

/**
 * Free a stream; NULL is allowed. Results that it gave stay valid.
 */
void dermis_stream_free(dermis_stream *stream);

/**
 * Take the next frame: count = rows * cols values, as for dermis_reconstruct. *result belongs to the caller:
 * dermis_result_free; it is NULL after an error, and where input.average = k until the last of 2^k frames.
 *
 * A frame that is refused for its values has no part in the results; one that the engine refuses ends its block. Either way the
 * stream goes on with the next frame.
 */
dermis_status dermis_stream_push(dermis_stream *stream,
                                 const double *stress_MPa,
                                 size_t count,
                                 dermis_result **result);

/**
 * As dermis_stream_push, of a frame that was acquired at time_ns: nanoseconds since 1970, or of any clock of the caller's.
 * dermis_result_time gives it back to the nanosecond.
 */
dermis_status dermis_stream_push_at(dermis_stream *stream,
                                    const double *stress_MPa,
                                    size_t count,
                                    int64_t time_ns,
                                    dermis_result **result);

/**
 * Open the board at a port that was built for a scene. It belongs to the caller: dermis_board_free; the scene may be freed before
 * it. After an error *board is NULL.
 *
 * port is the path of a serial port, such as "/dev/ttyUSB0", at the bit rate of the scene's board, or "udp:192.168.1.50", the
 * address of a core behind Ethernet, of several arrays with a number as in "udp:192.168.1.50#3". A request is made again after timeout_ms without an answer, up to eight times.
 * cross_check is that of dermis_stream_new: the frames that are answered are a stream.
 *
 * DERMIS_STATUS_BOARD: no answer, or a board of another scene or version.
 */
dermis_status dermis_board_open(const dermis_scene *scene,
                                const char *port,
                                uint64_t timeout_ms,
                                uint64_t cross_check,
                                dermis_board **board);

/**
 * Close a board; NULL is allowed. Results that it gave stay valid.
 */
void dermis_board_free(dermis_board *board);

/**
 * Send a frame and wait for its forces: count = rows * cols values, as for dermis_reconstruct. *result belongs to the caller:
 * dermis_result_free; it is NULL after an error. Of a core behind Ethernet dermis_result_time says when the core had the frame,
 * nanoseconds since 1970, and error_ns, which may be NULL, by how much that may be wrong; of another board error_ns is 0.
 */
dermis_status dermis_board_frame(dermis_board *board,
                                 const double *stress_MPa,
                                 size_t count,
                                 dermis_result **result,
                                 uint64_t *error_ns);

/**
 * Make the host end of the link of a board that was built for a scene. It belongs to the caller: dermis_link_free; the scene
 * may be freed before it. After an error *link is NULL; DERMIS_STATUS_INPUT for a scene whose hardware cannot have a link.
 * cross_check is that of dermis_stream_new: the frames that are answered are a stream.
 */
dermis_status dermis_link_new(const dermis_scene *scene,
                              uint64_t cross_check,
                              dermis_link **link);

/**
 * Free a link; NULL is allowed. Results that it gave stay valid.
 */
void dermis_link_free(dermis_link *link);

/**
 * The largest number of bytes that a request has on the wire; 0 after an error.
 */
size_t dermis_link_capacity(const dermis_link *link);

/**
 * Write the request for the board's identity to wire, which has room for capacity bytes, and their number to size. Send it
 * first: its answer tells whether the board was built for the scene.
 */
dermis_status dermis_link_identify(dermis_link *link,
                                   uint8_t *wire,
                                   size_t capacity,
                                   size_t *size);

/**
 * Write the request for the forces of a frame, or with forces = false for its resultants, to wire, which has room for
 * capacity bytes, and their number to size. stress_MPa has count = rows * cols values, as for dermis_reconstruct. A board
 * takes up to three requests before it has answered the first.
 */
dermis_status dermis_link_frame(dermis_link *link,
                                const double *stress_MPa,
                                size_t count,
                                bool forces,
                                uint8_t *wire,
                                size_t capacity,
                                size_t *size);

/**
 * Take the next bytes from the board, as many as are there. Writes to used how many were taken: all, or those up to the end
 * of a packet; call it again with the others. answer says what the packet is. With DERMIS_ANSWER_RESULT *result belongs to
 * the caller: dermis_result_free; else it is NULL.
 *
 * DERMIS_STATUS_DAMAGED: a packet was damaged on the wire; make the request again. DERMIS_STATUS_BOARD: the board was built
 * for another scene or version. Both leave used written, and the link goes on.
 */
dermis_status dermis_link_receive(dermis_link *link,
                                  const uint8_t *bytes,
                                  size_t count,
                                  size_t *used,
                                  dermis_answer *answer,
                                  dermis_result **result);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* DERMIS_H */
