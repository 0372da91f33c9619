/* libhpu for simulators of hardware: the functions of hpu_plant.vhd (GHDL, by VHPIDIRECT) and hpu_plant.sv (DPI-C).
 *
 * All arguments are integers of 32 bits, texts that end with a zero, and doubles. A function that fails writes the
 * message to standard error and returns the status code as a negative number.
 */
#include <hpu.h>
#include <stdio.h>
#include <string.h>

/* Verilator compiles this file as C++. */
#ifdef __cplusplus
extern "C" {
#endif

static int32_t failed(const hpu_error *error) {
    fprintf(stderr, "libhpu: %s\n", error->text);
    return -error->status;
}

/* Opens the plant of a scene. `text` is the scene, then KEY=VALUE, each after a semicolon. Returns its handle. */
int32_t hpu_sim_open(const char *text) {
    enum { MOST = 64 };
    char parts[4096];
    const char *all[MOST];
    size_t count = 0;
    hpu_handle plant;
    hpu_error error = {HPU_ARGUMENT, "the scene and its overrides are too long"};
    if (strlen(text) >= sizeof parts) return failed(&error);
    strcpy(parts, text);
    for (char *part = parts; part;) {
        if (count == MOST) return failed(&error);
        all[count++] = part;
        part = strchr(part, ';');
        if (part) *part++ = 0;
    }
    if (hpu_open(all[0], all + 1, count - 1, &plant, &error)) return failed(&error);
    if (plant <= INT32_MAX) return (int32_t)plant;
    hpu_close(plant, NULL);
    error.status = HPU_FULL;
    strcpy(error.text, "this process has opened too many handles for 32 bits");
    return failed(&error);
}

/* Drives the four gates of a bridge, moves on by a clock edge, and returns the encoder's lines there: A in bit 1,
 * B in bit 0.
 * `gates` has a_high in bit 3, a_low in bit 2, b_high in bit 1, b_low in bit 0. Returns -HPU_END without a message
 * at the end. */
int32_t hpu_sim_step(int32_t plant, int32_t gates) {
    hpu_handle handle = (hpu_handle)plant;
    int64_t lines[2], outputs[4] = {gates >> 3 & 1, gates >> 2 & 1, gates >> 1 & 1, gates & 1};
    hpu_error error;
    int32_t status = hpu_step(handle, outputs, 4, lines, 2, &error);
    if (status == HPU_END) return -HPU_END;
    if (status) return failed(&error);
    return (int32_t)(2 * lines[0] + lines[1]);
}

/* Returns the index of an output by its name, for hpu_sim_set. */
int32_t hpu_sim_output(int32_t plant, const char *name) {
    size_t index;
    hpu_error error;
    if (hpu_find((hpu_handle)plant, HPU_OUTPUT, name, &index, &error)) return failed(&error);
    return (int32_t)index;
}

/* Sets an output by its index from the present edge on: a gate, a duty, a force, a command. */
int32_t hpu_sim_set(int32_t plant, int32_t output, int32_t word) {
    hpu_error error;
    return hpu_set((hpu_handle)plant, (size_t)output, word, &error) ? failed(&error) : HPU_OK;
}

/* Moves on by this number of clock edges. Returns -HPU_END without a message at the end. */
int32_t hpu_sim_advance(int32_t plant, int32_t edges) {
    hpu_error error;
    int32_t status = hpu_advance((hpu_handle)plant, (uint64_t)edges, &error);
    return status && status != HPU_END ? failed(&error) : -status;
}

/* Returns for how many clock edges the inputs keep their words if the outputs keep theirs, 0 after an error. */
int32_t hpu_sim_quiet(int32_t plant) {
    uint64_t edges;
    if (hpu_quiet((hpu_handle)plant, &edges, NULL)) return 0;
    return edges < INT32_MAX ? (int32_t)edges : INT32_MAX;
}

/* Returns the word of an input by its name, such as the wall's stiffness. */
int32_t hpu_sim_input(int32_t plant, const char *name) {
    hpu_handle handle = (hpu_handle)plant;
    int64_t words[64];
    size_t index;
    hpu_error error;
    if (hpu_find(handle, HPU_INPUT, name, &index, &error)) return failed(&error);
    if (hpu_read(handle, words, index + 1, &error)) return failed(&error);
    return (int32_t)words[index];
}

/* Returns a state by its name, in SI units. */
double hpu_sim_state(int32_t plant, const char *name) {
    size_t index;
    double value = 0;
    hpu_error error;
    if (hpu_find((hpu_handle)plant, HPU_STATE, name, &index, &error) ||
        hpu_state((hpu_handle)plant, index, &value, &error))
        failed(&error);
    return value;
}

/* Closes the plant. */
int32_t hpu_sim_close(int32_t plant) {
    hpu_error error;
    return hpu_close((hpu_handle)plant, &error) ? failed(&error) : HPU_OK;
}

#ifdef __cplusplus
}
#endif
