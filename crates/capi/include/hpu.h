/* libhpu: the plant of a haptic device in the loop of your own logic, and hpu's blocks as golden models.
 *
 *     hpu_handle plant;
 *     hpu_error error;
 *     if (hpu_open("hybrid-wall", NULL, 0, &plant, &error) != HPU_OK) { puts(error.text); return 1; }
 *     int64_t pins[2], gates[4] = {0};
 *     while (hpu_advance(plant, 1, NULL) == HPU_OK) {
 *         hpu_read(plant, pins, 2, NULL);
 *         ... your logic's clock edge: from the pins to the gates ...
 *         hpu_drive(plant, gates, 4, NULL);
 *     }
 *     hpu_close(plant, NULL);
 *
 * A plant is everything outside the FPGA: device, encoders, bridge or amplifier, hand. It stands at a clock edge.
 * There the logic reads its inputs as the plant is at that instant; the outputs that it then drives hold until the
 * next edge. Words are whole numbers: a word times 2^-fraction is the value in the signal's unit. All states are in SI
 * units.
 *
 * Errors. A function that can fail returns HPU_OK or another status. Its last argument, if it is not NULL, receives
 * status and message on failure and is left alone on success. A function that fails changes nothing, but for
 * hpu_advance and hpu_advance_ns (see there), and for a handle that an hpu_open function sets to 0. No function ends
 * the program; a fault of the library itself (HPU_BROKEN) also writes a line to standard error. A NULL pointer is
 * refused; any other pointer must be valid, as anywhere in C. What a call writes to must not overlap what it reads, nor
 * anything else that it writes to.
 *
 * Threads. Handles may be used from any thread, but one handle by one thread at a time: a second call at the same time
 * is refused with HPU_BUSY. Different handles are independent. The library has no setting that handles share, and
 * reads no environment variable. Up to HPU_MOST handles can be open.
 *
 * Versions. A minor version adds functions and status codes only. Compare HPU_VERSION with hpu_version() to find a
 * header that is newer than the library.
 */
#ifndef HPU_H
#define HPU_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define HPU_VERSION_MAJOR 0
#define HPU_VERSION_MINOR 1
#define HPU_VERSION_PATCH 0
#define HPU_VERSION (HPU_VERSION_MAJOR * 1000000 + HPU_VERSION_MINOR * 1000 + HPU_VERSION_PATCH)

/* Handles that can be open at once. */
#define HPU_MOST 4096

/* Status codes. */
#define HPU_OK 0
#define HPU_ARGUMENT 1 /* an argument is NULL, out of range, or has the wrong length */
#define HPU_CLOSED 2   /* the handle was closed, or was never opened */
#define HPU_BUSY 3     /* another thread is inside a call with the same handle */
#define HPU_REFUSED 4  /* the scene, the block, or one of its overrides is refused */
#define HPU_END 5      /* the scene ends at the present clock edge */
#define HPU_OVER 6     /* the run cannot go on: the device has left the modelled range */
#define HPU_FULL 7     /* HPU_MOST handles are open */
#define HPU_BROKEN 8   /* a fault of the library itself; the handle can only be closed */

/* Kinds of signals. Inputs and outputs are those of the logic, or of a block. */
#define HPU_INPUT 0  /* what a plant gives: the encoders' lines, then the words that its scene sets */
#define HPU_OUTPUT 1 /* what drives a plant: the gates of a bridge, or the word of an averaged one or of an amplifier */
#define HPU_STATE 2  /* the continuous states of a plant */

/* An open plant or block; 0 is never one. */
typedef uint64_t hpu_handle;

/* An error: its status and its message, which ends with a zero. A message that is too long is cut. */
typedef struct hpu_error {
    int32_t status;
    char text[4092];
} hpu_error;

/* A signal. The name of a state ends in its SI unit, as in angle_rad; it has no word, so its width is 0. */
typedef struct hpu_signal {
    char name[64];
    char unit[32]; /* of the value; "1" without one */
    char doc[256];
    int32_t is_signed;
    int32_t width;    /* bits of the word */
    int32_t fraction; /* bits of the word behind the binary point; may be negative */
} hpu_signal;

/* Energies since the start, in J. */
typedef struct hpu_energy {
    double source_j;       /* supplied by the source, or by motors that are driven as torques */
    double hand_j;         /* supplied by the hand */
    double supplied_j;     /* supplied by both */
    double stored_j;       /* stored in inductance and inertia, minus the energy stored at the start */
    double copper_j;       /* dissipated in winding and switches */
    double diodes_j;       /* dissipated in diodes */
    double viscous_j;      /* dissipated in viscous friction */
    double coulomb_j;      /* dissipated in Coulomb friction */
    double transmission_j; /* dissipated in the damping of a flexible transmission */
    double dissipated_j;   /* dissipated in all of these */
    double exchanged_j;    /* sum of the sizes of all flows */
    double residual_j;     /* supplied minus stored minus dissipated: zero but for rounding */
} hpu_energy;

/* Returns the version of the library, in the form of HPU_VERSION. */
uint32_t hpu_version(void);

/* Opens the plant of a scene at clock edge 0. `scene` is the path of a file, which has a slash or ends in .toml, or
 * the name of a shipped scene (`hpu scenes` lists them). Each of the `count` overrides is KEY=VALUE, as after
 * --set. A scene with a [method] gives the words of its method as inputs, but its blocks do not run; a design named
 * by a [dut] is not built. The scene of a motor may have neither: device, encoder, bridge, hand and clock are then the
 * whole scene, its pins are a_pin and b_pin, a_high to b_low, and without a [wall] contact stays 0. HPU_REFUSED: the
 * message has file, line, column and what is accepted. */
int32_t hpu_open(const char *scene, const char *const *overrides, size_t count, hpu_handle *handle, hpu_error *error);

/* Opens the plant of a scene by its text. Messages name it `name`; its data files are in `folder`. */
int32_t hpu_open_text(const char *scene, const char *name, const char *folder, const char *const *overrides,
                      size_t count, hpu_handle *handle, hpu_error *error);

/* Opens a block in its state after reset, bit by bit as its VHDL. Each of the `count` generics is NAME=VALUE; the
 * others have their defaults (`hpu block NAME` lists them). */
int32_t hpu_open_block(const char *name, const char *const *generics, size_t count, hpu_handle *handle,
                       hpu_error *error);

/* Closes a plant or a block. Its handle is refused from then on. */
int32_t hpu_close(hpu_handle handle, hpu_error *error);

/* Tells the number of signals of a kind. */
int32_t hpu_count(hpu_handle handle, int32_t kind, size_t *count, hpu_error *error);

/* Describes a signal. The indices begin at 0. */
int32_t hpu_describe(hpu_handle handle, int32_t kind, size_t index, hpu_signal *signal, hpu_error *error);

/* Finds a signal by its name. HPU_ARGUMENT: the message lists the names. */
int32_t hpu_find(hpu_handle handle, int32_t kind, const char *name, size_t *index, hpu_error *error);

/* Reads the first `count` inputs of a plant at the present edge. The lines of an axis are a_pin and b_pin, those of an
 * arm a1_pin, b1_pin and so on; behind the scene's words, an axis has index, count (the encoder's, from 0 at the start)
 * and contact (1 while that count is beyond the wall's). With a [dut] they are the inputs of the design that the scene
 * connects, by the names of its ports, then these three; a port whose connection has no width has 64 bits, signed. */
int32_t hpu_read(hpu_handle handle, int64_t *words, size_t count, hpu_error *error);

/* Sets all outputs of a plant from the present edge on; they are 0 at the start. The gates of a bridge are a_high,
 * a_low, b_high and b_low; both switches of a leg must not be closed. A positive `command` pushes against the
 * positive direction, as in hpu's loops. With a [dut] they are the outputs of the design that drive the device. */
int32_t hpu_drive(hpu_handle handle, const int64_t *words, size_t count, hpu_error *error);

/* Sets one output of a plant from the present edge on; the others stay. */
int32_t hpu_set(hpu_handle handle, size_t output, int64_t word, hpu_error *error);

/* Moves a plant on by clock edges. HPU_END and HPU_OVER: it stands at the edge at which that happened. */
int32_t hpu_advance(hpu_handle handle, uint64_t edges, hpu_error *error);

/* Sets all `count` outputs of a plant, moves it on by one clock edge, and reads its `first` inputs there: hpu_drive,
 * hpu_advance and hpu_read in one call, which is the quickest way to close a loop edge by edge. Errors as theirs. */
int32_t hpu_step(hpu_handle handle, const int64_t *outputs, size_t count, int64_t *inputs, size_t first,
                 hpu_error *error);

/* Tells a number of clock edges for which the inputs of a plant certainly keep their words, if its outputs keep theirs.
 * A loop that counts them need not call the library before they are over or an output changes; it then moves the plant
 * on by the edges that it has counted. */
int32_t hpu_quiet(hpu_handle handle, uint64_t *edges, hpu_error *error);

/* Moves a plant on by nanoseconds. The edges of all such calls together are those of the sum of their times, rounded
 * down. Errors as of hpu_advance. */
int32_t hpu_advance_ns(hpu_handle handle, uint64_t nanoseconds, hpu_error *error);

/* Tells the present clock edge of a plant, and its time in seconds. */
int32_t hpu_now(hpu_handle handle, uint64_t *edge, double *seconds, hpu_error *error);

/* Tells the frequency of a plant's clock in Hz, and the edge at which its scene ends. */
int32_t hpu_clock(hpu_handle handle, uint64_t *frequency_hz, uint64_t *edges, hpu_error *error);

/* Reads a state of a plant at the present edge. */
int32_t hpu_state(hpu_handle handle, size_t index, double *value, hpu_error *error);

/* Reads the energies of a plant from the start to the present edge. */
int32_t hpu_energies(hpu_handle handle, hpu_energy *energy, hpu_error *error);

/* Computes one clock edge of a block with these words at its inputs, and tells the outputs after it. A block without a
 * clock answers its inputs. */
int32_t hpu_tick(hpu_handle handle, const int64_t *inputs, size_t input_count, int64_t *outputs, size_t output_count,
                 hpu_error *error);

/* Computes one clock edge of a block with its reset active, and tells the outputs after it. */
int32_t hpu_reset(hpu_handle handle, int64_t *outputs, size_t output_count, hpu_error *error);

#ifdef __cplusplus
}
#endif

#endif
