/* The hybrid wall in C: the logic of hdl/hybrid_loop.vhd, pin by pin, around the plant of a scene with that method.
 *
 *     cargo build --release -p hpu-capi
 *     cc -O2 -Icrates/capi/include -o motor crates/capi/examples/motor.c -Ltarget/release -lhpu
 *     LD_LIBRARY_PATH=target/release ./motor hybrid-wall wall.stiffness=2
 *
 * It runs the scene to its end and prints the states, the energies, and the clock cycles a second of wall time.
 */
#include <hpu.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { POSITION = 12, PWM = 12 }; /* bits, as in the scene */

/* The words that the scene sets. */
typedef struct { int64_t reference, stiffness, damping, period; int damping_fraction; } words;

/* The registers of the loop; all are 0 after the reset. */
typedef struct {
    int stage, lines, previous, settled; /* line A in bit 1, line B in bit 0 */
    int64_t step, position, sampled, velocity, countdown, phase, held;
} registers;

static int64_t limited(int64_t value, int64_t least, int64_t most) {
    return value < least ? least : value > most ? most : value;
}

/* A word of the position's width, read as two's complement. */
static int64_t as_signed(int64_t word) {
    int64_t half = 1 << (POSITION - 1);
    return ((word + half) & (2 * half - 1)) - half;
}

/* One clock edge: every register from the words before the edge. */
static void tick(registers *r, const words *w, const int64_t pins[2], int64_t gates[4]) {
    const int64_t full = 1 << PWM;

    int64_t penetration = as_signed(r->position - w->reference), torque = 0;
    if (penetration >= 0) {
        int64_t spring = limited(penetration * w->stiffness, 0, full - 1);
        torque = spring + limited((r->velocity * w->damping) >> w->damping_fraction, -full, full - 1);
    }
    if (r->phase == 0) r->held = limited(torque, 1 - full, full - 1);
    int active = r->phase < llabs(r->held);
    gates[0] = active && r->held > 0;
    gates[1] = !gates[0];
    gates[2] = active && r->held < 0;
    gates[3] = !gates[2];
    r->phase = (r->phase + 1) % full;

    if (r->countdown == 0) {
        r->velocity = as_signed(r->position - r->sampled);
        r->sampled = r->position;
        r->countdown = w->period > 1 ? w->period : 1;
    }
    r->countdown--;

    r->position = (r->position + r->step) & (full - 1);
    static const int forward[4] = {1, 3, 0, 2}; /* 00 01 11 10 */
    r->step = 0;
    if (r->settled == 3) r->step = (r->lines == forward[r->previous]) - (r->previous == forward[r->lines]);
    else r->settled++;
    r->previous = r->lines;
    r->lines = r->stage;
    r->stage = (int)(2 * pins[0] + pins[1]);
}

static hpu_error error;

static void must(int32_t status) {
    if (status == HPU_OK) return;
    fprintf(stderr, "error: %s\n", error.text);
    exit(1);
}

static int64_t word(hpu_handle plant, const char *name, int *fraction) {
    size_t index;
    hpu_signal signal;
    int64_t all[16];
    must(hpu_find(plant, HPU_INPUT, name, &index, &error));
    must(hpu_describe(plant, HPU_INPUT, index, &signal, &error));
    must(hpu_read(plant, all, index + 1, &error));
    if (fraction) *fraction = signal.fraction;
    return all[index];
}

int main(int count, char **arguments) {
    if (count < 2) {
        fprintf(stderr, "usage: motor SCENE [KEY=VALUE]...\n");
        return 2;
    }
    hpu_handle plant;
    must(hpu_open(arguments[1], (const char *const *)arguments + 2, (size_t)count - 2, &plant, &error));
    words w = {.reference = word(plant, "reference", NULL), .stiffness = word(plant, "stiffness", NULL),
               .period = word(plant, "period", NULL)};
    w.damping = word(plant, "damping", &w.damping_fraction);

    registers r = {0};
    int64_t pins[2], gates[4];
    int32_t status;
    clock_t began = clock();
    while ((status = hpu_advance(plant, 1, &error)) == HPU_OK) {
        must(hpu_read(plant, pins, 2, &error));
        tick(&r, &w, pins, gates);
        must(hpu_drive(plant, gates, 4, &error));
    }
    double wall_s = (double)(clock() - began) / CLOCKS_PER_SEC;
    if (status != HPU_END) must(status);

    uint64_t edge;
    double seconds, value;
    size_t states;
    hpu_signal signal;
    hpu_energy energy;
    must(hpu_now(plant, &edge, &seconds, &error));
    printf("edge %llu\ntime_s %.17g\nposition %lld\n", (unsigned long long)edge, seconds, (long long)r.position);
    must(hpu_count(plant, HPU_STATE, &states, &error));
    for (size_t index = 0; index < states; index++) {
        must(hpu_describe(plant, HPU_STATE, index, &signal, &error));
        must(hpu_state(plant, index, &value, &error));
        printf("%s %.17g\n", signal.name, value);
    }
    must(hpu_energies(plant, &energy, &error));
    printf("supplied_j %.17g\nstored_j %.17g\ndissipated_j %.17g\n", energy.supplied_j, energy.stored_j,
           energy.dissipated_j);
    must(hpu_close(plant, &error));
    printf("cycles_per_s %.3g\n", (double)edge / wall_s);
    return 0;
}
