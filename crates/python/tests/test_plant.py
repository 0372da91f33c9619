"""The plant and the loop: motion against C, against a whole run, and handles that are misused."""

import csv
import os
import signal
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import hpu
from common import HPU, ROOT, digest, options

# The folder of libhpu.
LIBRARY = os.environ["LIBHPU"]


def signed(word):
    return ((word + 2048) & 4095) - 2048


def limited(value, least, most):
    return max(least, min(most, value))


def close(plant, look=lambda: None):
    """Closes the hybrid wall around a plant, to the end of its scene, by the logic of crates/capi/examples/motor.c.

    Calls `look` at each clock edge once the device is driven.
    """
    reference, stiffness, damping, period = (plant[name] for name in ("reference", "stiffness", "damping", "period"))
    fraction = next(signal.format[2] for signal in plant.inputs if signal.name == "damping")
    stage = lines = previous = settled = step = position = sampled = velocity = countdown = phase = held = 0
    forward = (1, 3, 0, 2)
    try:
        while True:
            plant.advance()
            a_pin, b_pin = plant.read()[:2]
            penetration, torque = signed(position - reference), 0
            if penetration >= 0:
                spring = limited(penetration * stiffness, 0, 4095)
                torque = spring + limited((velocity * damping) >> fraction, -4096, 4095)
            if phase == 0:
                held = limited(torque, -4095, 4095)
            active = phase < abs(held)
            high_a, high_b = int(active and held > 0), int(active and held < 0)
            phase = (phase + 1) % 4096
            if countdown == 0:
                velocity, sampled, countdown = signed(position - sampled), position, max(period, 1)
            countdown -= 1
            position, step = (position + step) & 4095, 0
            if settled == 3:
                step = (lines == forward[previous]) - (previous == forward[lines])
            else:
                settled += 1
            previous, lines, stage = lines, stage, 2 * a_pin + b_pin
            plant.drive(high_a, 1 - high_a, high_b, 1 - high_b)
            look()
    except hpu.EndError:
        return position


class Plants(unittest.TestCase):
    def test_the_hybrid_wall_in_python_moves_as_in_c_to_the_bit(self):
        # The device begins inside the wall.
        overrides = {"run.duration": "4 ms", "wall.position": "-0.05 rad"}
        with hpu.Plant("hybrid-wall", overrides) as plant:
            self.assertTrue(plant.contact)
            position = close(plant)
            mine = {"edge": plant.edge, "time_s": plant.seconds, "position": position} | plant.states
            mine |= {name: plant.energy[name] for name in ("supplied_j", "stored_j", "dissipated_j")}
        with tempfile.TemporaryDirectory() as folder:
            example = ROOT / "crates/capi/examples/motor.c"
            include = f"-I{ROOT / 'crates/capi/include'}"
            command = ["cc", "-O2", include, "-o", f"{folder}/motor", example, f"-L{LIBRARY}", "-lhpu"]
            subprocess.run(command, check=True)
            words = [f"{key}={value}" for key, value in overrides.items()]
            library = {**os.environ, "LD_LIBRARY_PATH": LIBRARY}
            command = [f"{folder}/motor", "hybrid-wall", *words]
            ran = subprocess.run(command, env=library, capture_output=True, check=True)
        pairs = (line.split(" ") for line in ran.stdout.decode().splitlines())
        in_c = {name: float(value) for name, value in pairs if name != "cycles_per_s"}
        self.assertEqual(mine, in_c)
        self.assertEqual(plant_edges(overrides), 200_000)
        self.assertNotEqual(mine["speed_rad_per_s"], 0.0)

    def test_rows_of_a_run_are_the_states_of_the_plant_by_their_hash(self):
        overrides = {"run.duration": "4 ms", "wall.position": "-0.05 rad"}
        # Clock cycles between rows: 50 MHz over 10 kHz.
        seen, stride = [], 5000
        with hpu.Plant("hybrid-wall", overrides) as plant:
            names = list(plant.states)

            def look():
                if plant.edge % stride == 0:
                    seen.append(tuple(plant.states.values()))

            look()
            close(plant, look)
        trace = hpu.run("hybrid-wall", overrides, trace=True).trace
        rows = list(zip(*(trace[name] for name in names), strict=True))
        self.assertEqual(len(seen), 41)
        self.assertEqual(digest(rows), digest(seen))
        for driver in ("events", "clock"):
            with tempfile.TemporaryDirectory() as folder:
                command = [HPU, "run", "hybrid-wall", *options(overrides), "--driver", driver]
                subprocess.run([*command, "--no-plot", "-o", folder], capture_output=True, check=True)
                with open(Path(folder, "trace.csv"), encoding="ascii") as file:
                    told = [[float(row[name]) for name in names] for row in csv.DictReader(file)]
            self.assertEqual(digest(told), digest(seen), driver)

    def test_a_plant_alone_moves_as_that_of_a_scene_with_a_method(self):
        alone = """
            about = "A motor in the loop of a logic that no scene names."
            [device]
            kind = "motor"
            motor = "vasudevan_2007"
            initial_speed = "30 rad/s"
            [encoder]
            lines = 1024
            [hand]
            kind = "none"
            [clock]
            frequency = "50 MHz"
            [run]
            duration = "2 ms"
        """
        method = """
            [method]
            kind = "hybrid"
            sample_rate = "1 kHz"
            [wall]
            position = "0.01 rad"
            stiffness = "1 N.m/rad"
            damping = 0
        """
        ends = []
        with tempfile.TemporaryDirectory() as folder:
            for text in (alone, alone + method):
                path = Path(folder) / "plant.toml"
                path.write_text(text)
                with hpu.Plant(path) as plant:
                    lines = []
                    while plant.edge < plant.edges:
                        plant.advance(100)
                        lines.append(plant.read()[:2])
                        forward = plant["count"] % 2
                        plant.drive(forward, 1 - forward, 1 - forward, forward)
                    ends.append((plant.states, plant.energy, lines))
            path.write_text(alone)
            with self.assertRaises(hpu.SceneError) as refusal:
                hpu.run(path)
        self.assertEqual(ends[0], ends[1])
        self.assertGreater(len(set(ends[0][2])), 3)
        self.assertIn("hpu.Plant in Python", str(refusal.exception))

    def test_time_is_counted_in_whole_edges(self):
        with hpu.Plant("hybrid-wall") as plant:
            self.assertEqual((plant.clock_hz, plant.edges), (50_000_000, 100_000_000))
            plant.advance(7)
            for _ in range(3):
                plant.advance(ns=33)  # 4.95 edges in all
            self.assertEqual((plant.edge, plant.seconds), (11, 220e-9))
            self.assertEqual(plant.pins["count"], plant["count"])
            self.assertEqual(plant.read(), tuple(plant.pins.values()))
            self.assertEqual(plant.state("angle_rad"), plant.states["angle_rad"])

    def test_bad_input_is_refused_with_what_is_accepted(self):
        plant = hpu.Plant("hybrid-wall", {"run.duration": "1 ms"})
        cases = [
            (lambda: plant.drive(1, 0), hpu.ArgumentError, "2 words; accepted: 4, one an output: a_high, a_low"),
            (lambda: plant.drive(a_hihg=1), hpu.ArgumentError, "no output a_hihg; accepted: a_high"),
            (lambda: plant.drive(a_high=2), hpu.ArgumentError, "a_high is 2; accepted: 0 to 1"),
            (lambda: plant.drive(a_high=0.5), hpu.ArgumentError, "accepted: a whole number"),
            (lambda: plant.drive(1, 1, 0, 0), hpu.ArgumentError, "both switches of leg a are closed"),
            (lambda: plant["a"], hpu.ArgumentError, "no pin a; accepted: a_pin"),
            (lambda: plant.state("angle"), hpu.ArgumentError, "accepted: current_a"),
            (lambda: plant.advance(1, ns=1), hpu.ArgumentError, "accepted: one of both"),
            (lambda: plant.advance(-1), OverflowError, ""),
            (lambda: plant.advance(10**9), hpu.EndError, "the scene ends at clock edge 50000"),
            (lambda: hpu.Plant("hybrid-wall", model__solver="rk4"), hpu.SceneError, "model.solver"),
        ]
        for call, kind, text in cases:
            with self.subTest(text=text):
                with self.assertRaises(kind) as refusal:
                    call()
                self.assertIn(text, str(refusal.exception))
        self.assertEqual(plant.edge, 50_000)

    def test_a_handle_is_refused_after_close(self):
        plant, loop = hpu.Plant("hybrid-wall"), hpu.Loop("hybrid-wall")
        plant.close(), plant.close(), loop.close()
        calls = [
            plant.advance, plant.read, plant.drive, lambda: plant.pins, lambda: plant.states, lambda: plant.energy,
            lambda: plant.edge, lambda: plant.contact, loop.step, lambda: loop.words, lambda: loop.energy,
        ]  # fmt: skip
        for call in calls:
            with self.assertRaises(hpu.HandleError) as refusal:
                call()
            self.assertIn("was closed; open another", str(refusal.exception))
        self.assertIn("closed", repr(plant))

    def test_a_second_thread_is_refused_while_the_first_is_inside(self):
        refused = 0
        # On a busy machine the first thread may be done before this one has its turn.
        for _ in range(50):
            plant = hpu.Plant("hybrid-wall", {"run.duration": "1000 s", "hand.path": [["0 s", 0], ["1000 s", 1]]})
            plant.drive(a_high=1, b_low=1)
            inside = threading.Thread(target=plant.advance, args=(10**9,))
            inside.start()
            while inside.is_alive():
                try:
                    plant.close() if refused else plant.read()
                    time.sleep(1e-4)
                except hpu.HandleError as refusal:
                    self.assertIn("another thread is inside a call", str(refusal))
                    refused += 1
            inside.join()
            if refused:
                break
        self.assertGreater(refused, 0)


def plant_edges(overrides):
    with hpu.Plant("hybrid-wall", overrides) as plant:
        return plant.edges


class Signals(unittest.TestCase):
    def answers(self, call):
        """Asserts that an exception comes within 0.1 s of Ctrl-C: in one of some tries, for other work's sake."""
        # Ignored in a job that a shell has begun in the background.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        times, sent = [], []

        def press():
            sent.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

        while len(times) < 5 and min(times, default=1) >= 0.1:
            threading.Timer(0.2, press).start()
            with self.assertRaises(KeyboardInterrupt):
                call()
            times.append(time.monotonic() - sent[-1])
        self.assertLess(min(times), 0.1)

    def test_ctrl_c_ends_an_advance_at_an_edge(self):
        overrides = {"run.duration": "10000000 s", "hand.path": [["0 s", 0], ["1000000 s", 1000]]}
        with hpu.Plant("hybrid-wall", overrides) as plant:
            for advance in (lambda: plant.advance(4 * 10**14), lambda: plant.advance(ns=10**18)):
                self.answers(advance)
            reached = plant.edge
            self.assertGreater(reached, 0)
            # The plant goes on, and is where one that was never stopped is.
            plant.advance(10**6)
            with hpu.Plant("hybrid-wall", overrides) as other:
                other.advance(reached + 10**6)
                self.assertEqual((plant.states, plant.read()), (other.states, other.read()))

    def test_ctrl_c_ends_the_ticks_of_a_block(self):
        # The quickest block on an array that takes long to copy, and one of the slowest.
        block = hpu.Block("truncating_multiplier")
        words = np.full(100_000_000, 60)
        self.answers(lambda: block.tick(words, b=70))
        self.assertEqual(block.tick(60, 70), {"product": 4095})
        engine = hpu.Block("phantom_engine")
        words = {signal.name: np.broadcast_to(signal.max, 20_000_000) for signal in engine.inputs}
        self.answers(lambda: engine.tick(**words))


class Loops(unittest.TestCase):
    def test_a_loop_in_steps_moves_as_the_whole_run_to_the_bit(self):
        for scene, duration in [("hybrid-wall", "300 ms"), ("friction-wall", "100 ms"), ("phantom-drop", "50 ms")]:
            with self.subTest(scene=scene):
                run = hpu.run(scene, {"run.duration": duration}, trace=True)
                trace, last = run.trace, run.trace.rows - 1
                loop = hpu.Loop(scene, {"run.duration": duration})
                columns = [name for name in loop.states if name in trace]
                self.assertGreater(len(columns), 2)
                stride = loop.edges // last
                row = 0
                for rows in (0, 1, 1, 7, last // 2):
                    row += rows
                    loop.step(rows * stride)
                    self.assertEqual(loop.edge, row * stride)
                    for name in columns:
                        self.assertEqual(loop.states[name], trace[name][row], (name, row))
                # Steps of 1 edge, of a prime number of edges, and past the rest at once.
                for edges in (1, 1, 1, 9973, loop.edges - loop.edge - 9976):
                    words = loop.step(edges)
                self.assertEqual(words, loop.words)
                for name in columns:
                    self.assertEqual(loop.states[name], trace[name][last], name)
                self.assertEqual(loop.energy, run.summary["energy"])
                with self.assertRaises(hpu.EndError):
                    loop.step()

    def test_words_are_those_of_the_blocks(self):
        loop = hpu.Loop("hybrid-wall", {"run.duration": "200 ms"})
        trace = hpu.run("hybrid-wall", {"run.duration": "200 ms"}).trace
        loop.step(loop.edges)
        self.assertEqual(loop["penetration"], trace["penetration_count"][-1])
        self.assertGreater(loop["penetration"], 0)
        self.assertEqual(signed(loop["position"]), trace["position_count"][-1])
        with self.assertRaises(hpu.ArgumentError) as refusal:
            loop["penetratoin"]
        self.assertIn("accepted: ", str(refusal.exception))

    def test_a_scene_without_blocks_or_clock_is_refused(self):
        design = ROOT / "testbench/dut/rim.toml"
        with self.assertRaises(hpu.Error) as refusal:
            hpu.Loop(design)
        self.assertIn("a design of yours", str(refusal.exception))
        with hpu.Plant(design) as plant:
            plant.advance(10)


if __name__ == "__main__":
    unittest.main()
