/* Drives the plant of a scene without a method, and that of the same scene with one, by the same logic. Pins, states
 * and energies must be equal to the bit.
 *
 *     alone ALONE.toml METHOD.toml
 */
#include <hpu.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static hpu_error error;

static void must(int32_t status, const char *what)
{
    if (status != HPU_OK) {
        fprintf(stderr, "%s: %s\n", what, error.text);
        exit(1);
    }
}

static void same(const void *one, const void *other, size_t bytes, const char *what)
{
    if (memcmp(one, other, bytes) != 0) {
        fprintf(stderr, "%s differ\n", what);
        exit(1);
    }
}

int main(int count, char **paths)
{
    if (count != 3) {
        return 2;
    }
    hpu_handle alone, method;
    must(hpu_open(paths[1], NULL, 0, &alone, &error), "the plant alone");
    must(hpu_open(paths[2], NULL, 0, &method, &error), "the scene with a method");
    size_t inputs, place;
    must(hpu_count(alone, HPU_INPUT, &inputs, &error), "inputs");
    must(hpu_find(alone, HPU_OUTPUT, "b_low", &place, &error), "the last gate");
    if (inputs != 5 || place != 3) {
        return 1;
    }
    int64_t pins[2][2];
    unsigned long edges = 0;
    for (;;) {
        int32_t moved = hpu_advance(alone, 1, &error);
        if (moved != hpu_advance(method, 1, NULL)) {
            return 1;
        }
        if (moved == HPU_END) {
            break;
        }
        must(moved, "an edge");
        edges += 1;
        must(hpu_read(alone, pins[0], 2, &error), "pins");
        must(hpu_read(method, pins[1], 2, &error), "pins");
        same(pins[0], pins[1], sizeof pins[0], "pins");
        /* Against the motion for a quarter of 4096 edges, and by which leg the lines say. */
        int64_t active = edges % 4096 < 1024, leg = pins[0][0] ^ pins[0][1];
        int64_t a = active && leg, b = active && !leg;
        int64_t gates[4] = {a, 1 - a, b, 1 - b};
        must(hpu_drive(alone, gates, 4, &error), "gates");
        must(hpu_drive(method, gates, 4, &error), "gates");
    }
    for (size_t state = 0; state < 4; state++) {
        double values[2];
        must(hpu_state(alone, state, &values[0], &error), "a state");
        must(hpu_state(method, state, &values[1], &error), "a state");
        same(&values[0], &values[1], sizeof values[0], "states");
    }
    hpu_energy energies[2];
    must(hpu_energies(alone, &energies[0], &error), "energies");
    must(hpu_energies(method, &energies[1], &error), "energies");
    same(&energies[0], &energies[1], sizeof energies[0], "energies");
    must(hpu_close(alone, &error), "close");
    must(hpu_close(method, &error), "close");
    if (!(energies[0].exchanged_j > 0.0)) {
        return 1;
    }
    printf("same after %lu edges\n", edges);
    return 0;
}
