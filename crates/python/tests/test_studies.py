"""Studies against the command's, and what bad options say."""

import os
import signal
import tempfile
import threading
import time
import unittest
from pathlib import Path

import hpu
from common import options, told, without

SHORT = {"run.duration": "1 s"}


class Studies(unittest.TestCase):
    def test_a_map_is_that_of_the_command(self):
        axes = {"x": "wall.stiffness=0.5..6:4", "y": "wall.damping=0..0.4 mN.m.s/rad:3"}
        seen = []
        study = hpu.map("hybrid-wall", SHORT, **axes, full=True, progress=lambda *counts: seen.append(counts))
        words = [f"--{name}={axis}" for name, axis in axes.items()]
        command = told("map", "hybrid-wall", *words, *options(SHORT), "--full")
        self.assertEqual(study.summary, command)
        self.assertEqual(len(study.summary["cells"]), 12)
        self.assertEqual(seen[-1], (12, 12))
        self.assertEqual(study._repr_png_()[:4], b"\x89PNG")
        self.assertIn("<img", study._repr_html_())
        self.assertIn("settled", str(study))

    def test_limits_are_those_of_the_command(self):
        study = hpu.limits("hybrid-wall", range="2..4 N.m/rad", phases=1, words=4)
        command = told("limits", "hybrid-wall", "--range=2..4 N.m/rad", "--phases=1", "--words=4")
        self.assertEqual(without(study.summary, "files"), without(command, "files"))
        self.assertEqual(list(study.pictures()), ["limits"])
        touch = hpu.limits("gimbal-switch")
        self.assertEqual(touch.summary, told("limits", "gimbal-switch"))
        self.assertIsNone(touch._repr_png_())

    def test_widths_are_those_of_the_command(self):
        study = hpu.widths(["hybrid-wall", "stiff-hybrid"], SHORT, no_trials=True)
        self.assertEqual(study.summary, told("widths", "hybrid-wall", "stiff-hybrid", *options(SHORT), "--no-trials"))
        self.assertEqual(list(study.pictures()), ["ranges"])

    def test_the_least_model_is_that_of_the_command(self):
        short = {"run.duration": "300 ms"}
        study = hpu.fit("conventional-wall-100hz", short, within=0.02)
        command = told("fit", "conventional-wall-100hz", *options(short), "--within=0.02")
        kept = ("scene", "within", "judged", "contact_share")
        self.assertEqual(study.summary.keys(), command.keys())
        self.assertEqual({key: study.summary[key] for key in kept}, {key: command[key] for key in kept})
        self.assertIsNone(study._repr_png_())

    def test_keys_are_identified_as_by_the_command(self):
        text = """about = "A shorted motor runs down."
clock.frequency = "1 MHz"
device = { kind = "motor", motor = "vasudevan_2007", initial_speed = "60 rad/s" }
method = { kind = "hybrid", sample_rate = "1 kHz", damping_format = "(0,8,4)" }
wall = { position = "3 rad", stiffness = 0 }
hand.kind = "none"
run.duration = "40 ms"
"""
        with tempfile.TemporaryDirectory() as folder:
            scene, logs = Path(folder) / "motor.toml", []
            scene.write_text(text)
            for resistance in (2.5, 2.6):
                run = hpu.run(scene, {"device.resistance": resistance}, trace=True).trace
                rows = zip(run["time_s"][:-1], run["angle_rad"][:-1])
                logs.append(Path(folder) / f"{resistance}.csv")
                logs[-1].write_text("time_s,angle_rad\n" + "".join(f"{time},{angle}\n" for time, angle in rows))
            study = hpu.identify(scene, logs[:1], free=["device.resistance"], held=logs[1:])
            command = told("identify", str(scene), str(logs[0]), "--free=device.resistance", f"--held={logs[1]}")
            self.assertEqual(study.summary, command)
            self.assertAlmostEqual(study.summary["keys"][0]["value"], 2.5, places=3)
            self.assertEqual(len(study.pictures()), 2)
            with self.assertRaises(hpu.Error) as refusal:
                hpu.identify(scene, logs[:1], free="device.resistanc")
            self.assertIn("did you mean device.resistance?", str(refusal.exception))

    def test_keys_and_scenes_are_those_of_the_command(self):
        self.assertEqual(hpu.keys(), told("keys")["keys"])
        self.assertEqual(hpu.keys("method.pwm"), told("keys", "method.pwm")["keys"])
        self.assertEqual(list(hpu.scenes()), [scene["name"] for scene in told("scenes")["scenes"]])
        with self.assertRaises(hpu.ArgumentError) as refusal:
            hpu.keys("wlal")
        self.assertIn("did you mean wall?", str(refusal.exception))

    def test_bad_options_are_refused_with_what_is_accepted(self):
        axis = "wall.damping=0..1e-4:3"
        cases = [
            (lambda: hpu.map("hybrid-wall", x="wall.stiffness", y=axis), "KEY=FROM..TO"),
            (lambda: hpu.map("hybrid-wall", x="wall.stifness=1..2", y=axis), "stifness"),
            (lambda: hpu.map("hybrid-wall", x=axis, y=axis, jobs=0), "a whole number from 1"),
            (lambda: hpu.limits("hybrid-wall", range="3..1"), "A below B"),
            (lambda: hpu.limits("hybrid-wall", phases=65), "65"),
            (lambda: hpu.fit("hybrid-wall", within=2), "a share between 0 and 1"),
            (lambda: hpu.widths([]), "accepted: one scene, or a list"),
            (lambda: hpu.widths("hybrid-wall", random=1, within=0.1), "cannot be used with"),
        ]
        for call, text in cases:
            with self.subTest(text=text):
                with self.assertRaises(hpu.Error) as refusal:
                    call()
                self.assertIn(text, str(refusal.exception))
        with self.assertRaises(TypeError):
            hpu.map("hybrid-wall", x=axis)

    def test_ctrl_c_ends_a_map(self):
        # Ignored in a job that a shell has begun in the background.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        begin = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            hpu.map("hybrid-wall", x="wall.stiffness=0.1..6:200", y="wall.damping=0..1e-4:200", full=True)
        self.assertLess(time.monotonic() - begin, 10.0)


if __name__ == "__main__":
    unittest.main()
