"""Runs: results against those of the command, traces without a copy, errors, signals."""

import csv
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np
import pandas
import polars

import hpu
from common import HPU, OF_THE_MACHINE, ROOT, options, told, without

# 23 columns, of which each row has a value.
SHORT = {"run.duration": "20 ms"}


def address(array):
    return array.__array_interface__["data"][0]


def resident():
    """Returns the bytes of memory that this process holds."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class Runs(unittest.TestCase):
    def test_a_run_looks_on_after_its_end_as_the_command_does(self):
        command = json.loads(subprocess.check_output([HPU, "run", "hybrid-wall", "--for-ever=3s", "--json"]))
        found = hpu.run("hybrid-wall", for_ever=3).summary["for_ever"]
        self.assertEqual((found, found["kind"]), (command["for_ever"], "repeats"))
        self.assertNotIn("for_ever", hpu.run("hybrid-wall", SHORT).summary)
        for seconds in (-1.0, float("nan"), float("inf")):
            with self.assertRaises(ValueError):
                hpu.run("hybrid-wall", SHORT, for_ever=seconds)

    def test_the_summary_is_that_of_the_command(self):
        cases = [
            ("hybrid-wall", {}),
            ("hybrid-wall", {"wall.stiffness": "6 N.m/rad", "run.duration": "1 s"}),
            ("rail-drop", {}),
            ("phantom-drop", {"run.duration": "20 ms"}),
            ("gimbal-spring", {"run.duration": "20 ms"}),
        ]
        for scene, overrides in cases:
            with self.subTest(scene=scene, overrides=overrides):
                run = hpu.run(scene, overrides)
                command = told("run", scene, *options(overrides))
                self.assertEqual(without(run.summary, *OF_THE_MACHINE), without(command, *OF_THE_MACHINE))
                self.assertEqual(run.verdict, command["outcome"] and command["outcome"]["kind"])
                self.assertEqual(run.contact, command["contact_share"])

    def test_overrides_are_those_of_set(self):
        given = [
            hpu.run("hybrid-wall", {"wall.stiffness": 2, "run.duration": "1 s"}),
            hpu.run("hybrid-wall", wall__stiffness=np.int32(2), run__duration=1),
            hpu.run("hybrid-wall", {"run.duration": 1.0}, wall__stiffness="2 N.m/rad"),
        ]
        command = told("run", "hybrid-wall", "--set", "wall.stiffness=2", "--set", "run.duration=1 s")
        for run in given:
            kept = ("outcome", "energy", "events", "edges", "signals")
            self.assertEqual({key: run.summary[key] for key in kept}, {key: command[key] for key in kept})
        listed = hpu.run("hybrid-wall", {"hand.path": [["0 s", 0], ["1 s", 0.1]]})
        self.assertEqual(listed.contact, 0.0, "the hand never reaches the wall at 1.5 rad")

    def test_a_scene_is_a_name_a_path_or_a_text(self):
        path = Path(__file__).parents[3] / "testbench/scenes/hybrid-wall.toml"
        text = hpu.Scene(path.read_text(), name="mine.toml", folder=str(path.parent))
        energies = [hpu.run(scene, SHORT).summary["energy"] for scene in ("hybrid-wall", path, str(path), text)]
        self.assertEqual(energies, energies[:1] * 4)

    def test_the_trace_is_that_of_the_command(self):
        with tempfile.TemporaryDirectory() as folder:
            words = ["run", "hybrid-wall", *options(SHORT), "-o", folder, "--vcd", "--no-plot"]
            subprocess.run([HPU, *words], check=True, capture_output=True)
            with open(f"{folder}/trace.csv", encoding="ascii") as file:
                names, *rows = csv.reader(file)
            for at_once in (True, False):
                trace = hpu.run("hybrid-wall", SHORT, trace=at_once).trace
                self.assertEqual(list(trace.keys()), names)
                self.assertEqual((len(trace), trace.rows), (len(rows), len(rows)))
                for name, column in zip(names, zip(*rows)):
                    np.testing.assert_array_equal(trace[name], np.array(column, dtype=float), name)
                    self.assertTrue(trace.about[name])
            run = hpu.run("hybrid-wall", SHORT)
            for name in ("wave.fst", "wave.vcd"):
                mine = Path(folder, f"mine-{name}")
                run.save_wave(mine)
                self.assertEqual(mine.read_bytes(), Path(folder, name).read_bytes(), name)
            mine = sorted(path.name for path in Path(folder).glob("mine-*"))
            self.assertEqual(mine, ["mine-wave.fst", "mine-wave.vcd"])

    def test_millions_of_rows_arrive_without_a_copy(self):
        # long.sh takes ten million.
        millions = int(os.environ.get("HPU_MILLIONS", "2"))
        overrides = {"record.plant_rate": "100 MHz", "clock.frequency": "100 MHz"}
        overrides["run.duration"] = f"{10 * millions} ms"
        trace = hpu.run("rail-drop", overrides, trace=True).trace
        rows, before = 1_000_000 * millions + 1, resident()
        self.assertEqual(trace.rows, rows)
        arrays = {name: trace[name] for name in trace.keys()}
        frame = polars.DataFrame(trace)
        table = pandas.DataFrame(dict(trace), copy=False)
        for name, array in arrays.items():
            self.assertEqual((array.dtype, array.shape, array.flags.writeable), (np.float64, (rows,), False))
            others = [trace[name], frame[name].to_numpy(allow_copy=False), table[name].to_numpy()]
            self.assertEqual([address(other) for other in others], [address(array)] * 3, name)
        # A copy of one column would take 8 MB a million.
        self.assertLess(resident() - before, 4e6 * millions)
        self.assertEqual(frame.shape, (rows, len(arrays)))
        # The memory outlives the run and its trace.
        last = {name: array[-1] for name, array in arrays.items()}
        del trace, table
        self.assertEqual({name: array[-1] for name, array in arrays.items()}, last)
        self.assertEqual(frame.row(-1, named=True), last)

    def test_arrow_arrays_that_nobody_takes_are_freed(self):
        trace = hpu.run("hybrid-wall", SHORT).trace
        before = None
        for turn in range(3000):
            trace.__arrow_c_stream__(), trace.__arrow_c_array__(), trace.__arrow_c_schema__()
            polars.DataFrame(trace)
            if turn == 500:
                before = resident()
        self.assertLess(resident() - before, 4e6)

    def test_a_run_costs_at_most_5_ms_more_than_the_engine(self):
        def beyond():
            begin = time.perf_counter()
            wall_s = hpu.run("hybrid-wall").summary["wall_s"]
            return time.perf_counter() - begin - wall_s

        least = min(beyond() for _ in range(20))
        print(f"hpu.run beyond the engine: {1e3 * least:.2f} ms")
        self.assertLess(least, 5e-3)

    def test_results_are_shown_as_text_and_pictures(self):
        run = hpu.run("hybrid-wall")
        self.assertIn("settled", repr(run))
        self.assertTrue(str(run).startswith("scene      hybrid-wall"))
        self.assertEqual(run._repr_png_()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertIn("<pre>scene", run._repr_html_())
        self.assertIn("torque", run.pictures())


class Refused(unittest.TestCase):
    def refused(self, kind, *texts):
        """Returns a context in which this exception is raised with these texts in its message."""
        test = self

        class Context:
            def __enter__(self):
                return self

            def __exit__(self, got, raised, trace):
                test.assertIs(got, kind, raised)
                for text in texts:
                    test.assertIn(text, str(raised))
                self.raised = raised
                return True

        return Context()

    def test_a_scene_that_is_refused_names_file_line_and_what_is_accepted(self):
        text = 'about = "x"\n[device]\nkind = "motor"\n[wall]\nstiffnes = 1\n'
        with self.refused(hpu.SceneError, "stiffnes", "accepted here", "did you mean stiffness?") as refusal:
            hpu.run(hpu.Scene(text, name="mine.toml"))
        self.assertEqual(refusal.raised.file, "mine.toml")
        self.assertIn(f"mine.toml:{refusal.raised.line}:{refusal.raised.column}:", refusal.raised.message)
        for made in (hpu.Plant, hpu.Loop, hpu.fit, hpu.widths, hpu.limits):
            with self.refused(hpu.SceneError, "mine.toml:", "unknown key") as refusal:
                made(hpu.Scene(text, name="mine.toml"))
            self.assertGreater(refusal.raised.line, 0)

    def test_an_override_that_does_not_exist_names_those_that_do(self):
        with self.refused(hpu.SceneError, "wall.stifness", "unknown key", "position, wraps, stiffness") as refusal:
            hpu.run("hybrid-wall", wall__stifness=1)
        self.assertIsNone(refusal.raised.line)
        with self.refused(hpu.SceneError, "no scene `hybrid-wal`", "did you mean hybrid-wall?"):
            hpu.run("hybrid-wal")
        with self.refused(hpu.SceneError, "nowhere.toml"):
            hpu.run(Path("nowhere.toml"))
        with self.refused(hpu.ArgumentError, "accepted: a name, a path, or hpu.Scene(text)"):
            hpu.run(7)
        with self.refused(hpu.ArgumentError, "wall.stiffness", "accepted: bool, int, float, str, or a list"):
            hpu.run("hybrid-wall", wall__stiffness=object())
        with self.refused(hpu.ArgumentError, "accepted: .fst, .vcd"):
            hpu.run("hybrid-wall", SHORT).save_wave("wave.txt")
        with self.refused(hpu.Error, "nowhere"):
            hpu.run("hybrid-wall", SHORT).save_wave("nowhere/wave.fst")
        with self.refused(KeyError, "no column angle", "angle_rad"):
            hpu.run("hybrid-wall", SHORT).trace["angle"]

    def test_a_list_that_contains_itself_or_is_endlessly_deep_is_refused(self):
        own, deep = [], []
        own.extend([own] * 10)
        for _ in range(100_000):
            deep = [deep]
        beyond = ([1], own)
        for value in (own, deep, beyond, tuple([own])):
            for call in (
                lambda: hpu.run("hybrid-wall", {"hand.path": value}),
                lambda: hpu.run("hybrid-wall", hand__path=value),
                lambda: hpu.Plant("hybrid-wall", {"hand.path": value}),
                lambda: hpu.Block("pwm", WIDTH=value),
            ):
                with self.assertRaises(TypeError):
                    call()
        # The same list twice is no list within itself.
        point = [0, 0]
        with self.refused(hpu.SceneError, "times must increase"):
            hpu.run("hybrid-wall", {"hand.path": [point, point]})

    def test_no_call_simulates_a_design_where_that_is_forbidden(self):
        # What a tool of this PATH would be asked for is written down: nothing.
        with tempfile.TemporaryDirectory() as folder:
            tools, design = Path(folder), ROOT / "testbench/dut/knee.toml"
            for name in ("ghdl", "verilator", "yosys", "make", "g++"):
                (tools / name).write_text("#!/bin/sh\n: >\"$0.asked\"\nexit 1\n")
                (tools / name).chmod(0o755)
            kept = {name: os.environ.get(name) for name in ("PATH", "HPU_NO_DUT", "XDG_CACHE_HOME")}
            try:
                os.environ.update(PATH=folder, HPU_NO_DUT="1", XDG_CACHE_HOME=folder)
                axes = {"x": "dut.ports.gain=20..30:2", "y": "hand.stiffness=0.2..0.3 N.m/rad:2"}
                for call in (
                    lambda: hpu.run(design),
                    lambda: hpu.run(design, trace=True),
                    lambda: hpu.run(hpu.Scene(design.read_text(), folder=str(design.parent))),
                    lambda: hpu.map(design, full=True, **axes),
                    lambda: hpu.limits(design, range="20..30"),
                ):
                    with self.refused(hpu.Error, "the design `KneeCtl` is not simulated", "HPU_NO_DUT"):
                        call()
                hpu.run("hybrid-wall", SHORT)
                self.assertEqual([path.name for path in tools.glob("*.asked")], [])
                # The stand-ins are asked where it is allowed.
                os.environ["HPU_NO_DUT"] = "0"
                with self.assertRaises(hpu.Error):
                    hpu.run(design)
                self.assertNotEqual([path.name for path in tools.glob("*.asked")], [])
            finally:
                for name, value in kept.items():
                    os.environ.pop(name, None) if value is None else os.environ.update({name: value})

    def test_a_trace_beyond_all_memory_is_refused(self):
        with self.refused(hpu.Error, "no memory for the trace", "lower record.plant_rate"):
            hpu.run("hybrid-wall", {"run.duration": "900000 s", "record.plant_rate": "50 MHz"}, trace=True)


class Signals(unittest.TestCase):
    LONG = {"run.duration": "1000 s", "model.solver": "clock"}

    def test_ctrl_c_ends_a_run(self):
        # Ignored in a job that a shell has begun in the background.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        begin = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            hpu.run("hybrid-wall", self.LONG)
        self.assertLess(time.monotonic() - begin, 5.0)

    def test_tools_die_with_their_own_process_of_a_python_that_was_forked(self):
        # A compiler that first refuses the design, and then takes for ever.
        tool = """#!/bin/sh
case $1 in --version) echo 'Verilator 5.006 2023-01-22'; exit;; esac
[ -e later ] || exit 1
exec sleep 1000
"""
        program = f"""
import os, pathlib, sys, hpu
design, folder = {str(ROOT / "testbench/dut/knee.toml")!r}, pathlib.Path.cwd()
try:
    hpu.run(design)
except hpu.Error:
    (folder / "later").touch()
child = os.fork()
if child > 0:
    print(child, flush=True)
hpu.run(design)
"""
        with tempfile.TemporaryDirectory() as folder:
            verilator = Path(folder, "verilator")
            verilator.write_text(tool.replace("later", f"{folder}/later"))
            verilator.chmod(0o755)
            mark = f"TMPDIR={folder}".encode()

            def sleeping():
                count = 0
                for place in Path("/proc").glob("[0-9]*"):
                    try:
                        is_marked = mark in (place / "environ").read_bytes().split(b"\0")
                        count += is_marked and (place / "cmdline").read_bytes().startswith(b"sleep\0")
                    except OSError:
                        pass
                return count

            def until(count):
                begin = time.monotonic()
                while sleeping() != count and time.monotonic() - begin < 20:
                    time.sleep(0.01)
                self.assertEqual(sleeping(), count)

            own = {"TMPDIR": folder, "XDG_CACHE_HOME": folder, "PATH": f"{folder}:{os.environ['PATH']}"}
            command = [sys.executable, "-c", program]
            parent = subprocess.Popen(command, env=os.environ | own, cwd=folder, stdout=subprocess.PIPE)
            child = int(parent.stdout.readline())
            try:
                until(2)
                parent.kill()
                until(1)
            finally:
                parent.kill()
                os.kill(child, signal.SIGKILL)
                parent.communicate()
            until(0)

    def test_other_threads_run_beside_a_run_and_its_progress_is_told(self):
        seen, counted, ended = [], [], threading.Event()

        def count():
            while not ended.is_set():
                counted.append(time.monotonic())
                time.sleep(0.001)

        def progress(done, total):
            seen.append((done, total))
            if len(seen) == 5:
                raise StopIteration("enough")

        thread = threading.Thread(target=count)
        thread.start()
        begin = time.monotonic()
        with self.assertRaises(StopIteration):
            hpu.run("hybrid-wall", self.LONG, progress=progress)
        ended.set()
        thread.join()
        self.assertGreater(sum(at > begin for at in counted), 20, "the GIL is released")
        self.assertEqual(seen, sorted(seen))
        self.assertEqual({total for _, total in seen}, {50_000_000_000})
        self.assertGreater(seen[-1][0], 0)
        told = []
        hpu.run("hybrid-wall", progress=lambda done, total: told.append((done, total)))
        self.assertEqual(told[-1], (100_000_000, 100_000_000))


if __name__ == "__main__":
    unittest.main()
