/* Calls that the library refuses, and those from two threads. Ends with 1 at the first that differs. */
#include <hpu.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static hpu_error error;

static void refused(int line, int32_t found, int32_t wanted, const char *text) {
    if (found == wanted && error.status == wanted && strstr(error.text, text)) {
        memset(&error, 0, sizeof error);
        return;
    }
    fprintf(stderr, "line %d: status %d, wanted %d with `%s`: %s\n", line, found, wanted, text, error.text);
    exit(1);
}

static void fine(int line, int32_t found) {
    if (found == HPU_OK && error.status == HPU_OK) return;
    fprintf(stderr, "line %d: status %d: %s\n", line, found, error.text);
    exit(1);
}

#define REFUSED(call, status, text) refused(__LINE__, call, status, text)
#define FINE(call) fine(__LINE__, call)
#define HOLDS(condition) fine(__LINE__, (condition) ? HPU_OK : -1)

static const char *set(const char *pair) {
    static const char *pairs[1];
    pairs[0] = pair;
    return (const char *)pairs;
}
#define OVERRIDE(pair) (const char *const *)set(pair), 1

static hpu_handle shared;
static atomic_bool over;

static void *moves(void *unused) {
    int64_t gates[4] = {0, 1, 1, 0};
    (void)unused;
    while (!atomic_load(&over)) {
        if (hpu_advance(shared, 1 << 20, NULL) == HPU_END) break;
        gates[0] = !gates[0], gates[1] = !gates[1], gates[2] = !gates[2], gates[3] = !gates[3];
        hpu_drive(shared, gates, 4, NULL);
    }
    return NULL;
}

int main(void) {
    hpu_handle plant = 7, block, many[64];
    int64_t words[16] = {0}, gates[4] = {0};
    size_t index, count;
    uint64_t edge, edges, frequency_hz;
    double seconds, value;
    hpu_signal signal;
    hpu_energy energy;

    HOLDS(hpu_version() == HPU_VERSION);

    /* Before anything is open, and null. */
    REFUSED(hpu_read(0, words, 2, &error), HPU_CLOSED, "handle 0 is not open");
    REFUSED(hpu_advance(0, 1, &error), HPU_CLOSED, "not open");
    REFUSED(hpu_close(0xffffffffffffffff, &error), HPU_CLOSED, "not open");
    REFUSED(hpu_open(NULL, NULL, 0, &plant, &error), HPU_ARGUMENT, "scene is null");
    REFUSED(hpu_open("hybrid-wall", NULL, 0, NULL, &error), HPU_ARGUMENT, "handle is null");
    REFUSED(hpu_open("hybrid-wall", NULL, 3, &plant, &error), HPU_ARGUMENT, "overrides is null, with 3 elements");
    REFUSED(hpu_open("hybrid-wall\xff", NULL, 0, &plant, &error), HPU_ARGUMENT, "scene is no UTF-8");
    HOLDS(hpu_open("nothing", NULL, 0, &plant, NULL) == HPU_REFUSED && plant == 0);

    /* Scenes. */
    REFUSED(hpu_open("hybrid-wal", NULL, 0, &plant, &error), HPU_REFUSED, "hybrid-wall");
    REFUSED(hpu_open("no/such.toml", NULL, 0, &plant, &error), HPU_REFUSED, "no/such.toml: ");
    REFUSED(hpu_open("hybrid-wall", OVERRIDE("wall.stifness=2"), &plant, &error), HPU_REFUSED,
            "did you mean stiffness?");
    REFUSED(hpu_open("hybrid-wall", OVERRIDE("wall.stiffness=soft"), &plant, &error), HPU_REFUSED,
            "--set wall.stiffness=soft: wall.stiffness: ");
    REFUSED(hpu_open("hybrid-wall", OVERRIDE("stiffer"), &plant, &error), HPU_ARGUMENT,
            "overrides[0] is `stiffer`; accepted: KEY=VALUE");
    REFUSED(hpu_open_text("about = \"x\"\n[device]\nkind = \"moter\"\n", "mine.toml", ".", NULL, 0, &plant, &error),
            HPU_REFUSED, "mine.toml:3:8: device.kind: ");

    /* Signals. */
    FINE(hpu_open("hybrid-wall", NULL, 0, &plant, &error));
    REFUSED(hpu_count(plant, 3, &count, &error), HPU_ARGUMENT, "HPU_INPUT, HPU_OUTPUT, and HPU_STATE");
    REFUSED(hpu_find(plant, HPU_INPUT, "c_pin", &index, &error), HPU_ARGUMENT, "accepted: a_pin, b_pin, reference");
    REFUSED(hpu_describe(plant, HPU_OUTPUT, 4, &signal, &error), HPU_ARGUMENT, "no signal 4; accepted: 0 to 3");
    REFUSED(hpu_state(plant, 4, &value, &error), HPU_ARGUMENT, "no state 4; accepted: 0 to 3");
    REFUSED(hpu_state(plant, 0, NULL, &error), HPU_ARGUMENT, "value is null");
    FINE(hpu_count(plant, HPU_INPUT, &count, &error));
    FINE(hpu_read(plant, words, count, &error));
    REFUSED(hpu_read(plant, words, count + 1, &error), HPU_ARGUMENT, "accepted: 0 to 10");
    REFUSED(hpu_read(plant, NULL, 2, &error), HPU_ARGUMENT, "words is null");
    FINE(hpu_describe(plant, HPU_INPUT, 3, &signal, &error));
    HOLDS(!strcmp(signal.name, "stiffness") && signal.width == 12 && signal.fraction == 0 && !signal.is_signed);
    HOLDS(words[3] == 36);

    /* Outputs. */
    gates[0] = 2;
    REFUSED(hpu_drive(plant, gates, 4, &error), HPU_ARGUMENT, "output a_high is 2; accepted: 0 to 1");
    gates[0] = gates[1] = 1;
    REFUSED(hpu_drive(plant, gates, 4, &error), HPU_ARGUMENT, "leg a are closed at clock edge 0, which shorts");
    REFUSED(hpu_drive(plant, gates, 3, &error), HPU_ARGUMENT, "3 words; accepted: 4, one an output: a_high, a_low");
    REFUSED(hpu_step(plant, gates, 4, words, 2, &error), HPU_ARGUMENT,
            "leg a are closed at clock edge 0, which shorts");
    REFUSED(hpu_step(plant, NULL, 4, words, 2, &error), HPU_ARGUMENT, "outputs is null, with 4 elements");
    REFUSED(hpu_step(plant, gates, 4, NULL, 2, &error), HPU_ARGUMENT, "inputs is null, with 2 elements");
    REFUSED(hpu_tick(plant, words, 1, words, 1, &error), HPU_ARGUMENT, "the handle is a plant; accepted: a block");
    REFUSED(hpu_quiet(plant, NULL, &error), HPU_ARGUMENT, "edges is null");
    REFUSED(hpu_quiet(0, &edges, &error), HPU_CLOSED, "not open");

    /* Time: 50 MHz, so 30 ns are an edge and a half. */
    FINE(hpu_clock(plant, &frequency_hz, &edges, &error));
    HOLDS(frequency_hz == 50000000 && edges == 100000000);
    FINE(hpu_advance_ns(plant, 30, &error));
    FINE(hpu_now(plant, &edge, &seconds, &error));
    HOLDS(edge == 1 && seconds == 20e-9);
    FINE(hpu_advance_ns(plant, 30, &error));
    FINE(hpu_now(plant, &edge, &seconds, &error));
    HOLDS(edge == 3);
    REFUSED(hpu_advance(plant, UINT64_MAX, &error), HPU_END, "ends at clock edge 100000000; a longer run.duration");
    FINE(hpu_now(plant, &edge, &seconds, &error));
    HOLDS(edge == edges && seconds == 2.0);
    REFUSED(hpu_advance(plant, 1, &error), HPU_END, "");
    FINE(hpu_energies(plant, &energy, &error));
    HOLDS(energy.source_j == 0 && energy.hand_j > 0 && energy.hand_j == energy.supplied_j);

    /* After close: the place is given to others under other handles. */
    FINE(hpu_close(plant, &error));
    REFUSED(hpu_close(plant, &error), HPU_CLOSED, "not open");
    REFUSED(hpu_read(plant, words, 2, &error), HPU_CLOSED, "not open");
    for (int i = 0; i < 64; i++) FINE(hpu_open("hybrid-wall", NULL, 0, &many[i], &error));
    REFUSED(hpu_now(plant, &edge, &seconds, &error), HPU_CLOSED, "not open");
    FINE(hpu_advance(many[5], 1000, &error));
    FINE(hpu_now(many[6], &edge, &seconds, &error));
    HOLDS(edge == 0);
    for (int i = 0; i < 64; i++) FINE(hpu_close(many[i], &error));

    /* Two threads. */
    FINE(hpu_open("free-motion", OVERRIDE("run.duration=1e5"), &shared, &error));
    pthread_t other;
    HOLDS(pthread_create(&other, NULL, moves, NULL) == 0);
    int32_t status;
    do status = hpu_now(shared, &edge, &seconds, &error);
    while (status == HPU_OK);
    REFUSED(status, HPU_BUSY, "one thread at a time");
    atomic_store(&over, 1);
    pthread_join(other, NULL);
    FINE(hpu_close(shared, &error));

    /* Blocks. */
    REFUSED(hpu_open_block("pwn", NULL, 0, &block, &error), HPU_REFUSED, "no block `pwn`; there are synchronizer, ");
    REFUSED(hpu_open_block("pwm", OVERRIDE("DEPTH=3"), &block, &error), HPU_REFUSED, "WIDTH, ANTIPHASE");
    REFUSED(hpu_open_block("pwm", OVERRIDE("WIDTH=wide"), &block, &error), HPU_REFUSED, "WIDTH is wide; accepted: a");
    REFUSED(hpu_open_block("pwm", OVERRIDE("WIDTH=99"), &block, &error), HPU_REFUSED, "WIDTH is 99");
    FINE(hpu_open_block("pwm", OVERRIDE("WIDTH=3"), &block, &error));
    REFUSED(hpu_advance(block, 1, &error), HPU_ARGUMENT, "the handle is a block; accepted: a plant");
    REFUSED(hpu_count(block, HPU_STATE, &count, &error), HPU_ARGUMENT, "HPU_STATE of a plant");
    REFUSED(hpu_tick(block, words, 2, gates, 4, &error), HPU_ARGUMENT, "2 words; accepted: 1, one an input: command");
    REFUSED(hpu_tick(block, words, 1, gates, 3, &error), HPU_ARGUMENT, "output_count is 3; accepted: 4");
    words[0] = 9;
    REFUSED(hpu_tick(block, words, 1, gates, 4, &error), HPU_ARGUMENT, "input command is 9; accepted: -8 to 7");
    /* A duty of 5 of 8: leg A is high for 5 clocks, then low for 3. */
    words[0] = 5;
    for (int phase = 0; phase < 16; phase++) {
        FINE(hpu_tick(block, words, 1, gates, 4, &error));
        int high = phase % 8 < 5;
        HOLDS(gates[0] == high && gates[1] == !high && gates[2] == 0 && gates[3] == 1);
    }
    FINE(hpu_reset(block, gates, 4, &error));
    HOLDS(!gates[0] && !gates[1] && !gates[2] && !gates[3]);
    FINE(hpu_close(block, &error));
    return 0;
}
