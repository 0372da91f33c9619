"""The command that the package installs: the same as the program, also where it starts itself and is interrupted."""

import re
import signal
import stat
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

from common import HPU

# As pip writes it.
ENTRY = """#!{python}
import sys
from hpu._command import main
if __name__ == "__main__":
    sys.exit(main())
"""

STUDY = """
name = "small"
title = "Four walls"
[map]
scene = "hybrid-wall"
x = "wall.stiffness=1..2 N.m/rad:2"
y = "wall.damping=0..1 mN.m.s/rad:2"
"""
# A hand that has a plan to the end: without one the motion repeats, and the rest is over at once.
PLANNED = 'hand.path=[["0 s", 0], ["150 ms", 1.4], ["250 ms", 1.9], ["100000 s", 1.8]]'
TIMES = re.compile(r"in \S+ \S+ by \w+: \S+ edges/s")


def ran(*words, **options):
    """Returns how a command ends, and what it says."""
    done = subprocess.run(words, capture_output=True, text=True, check=False, **options)
    return done.returncode, done.stdout, done.stderr


class Commands(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.own = self.folder / "hpu"
        self.own.write_text(ENTRY.format(python=sys.executable))
        self.own.chmod(self.own.stat().st_mode | stat.S_IXUSR)

    def test_it_says_what_the_program_says_and_ends_as_it(self):
        unmet = ["--quiet", "run", "hybrid-wall", "--set", "expect.outcome=diverged"]
        cases = [(["--help"], 0), (["--version"], 0), (["vectors", "pwm", "--count", "5"], 0), (unmet, 1), (["run"], 2),
                 (["run", "no-such-scene"], 4)]
        for words, code in cases:
            mine, theirs = ran(self.own, *words), ran(HPU, *words)
            self.assertEqual(mine[0], code, mine)
            self.assertEqual([TIMES.sub("", text) for text in mine[1:]], [TIMES.sub("", text) for text in theirs[1:]])
            self.assertEqual(mine[0], theirs[0], words)

    def test_a_sweep_starts_it_once_a_shard(self):
        (self.folder / "small.toml").write_text(STUDY)
        words = ["--quiet", "sweep", "run", "../small.toml", "--shard-points", "2", "-o", "swept"]
        rows = []
        for program, name in [(self.own, "mine"), (HPU, "theirs")]:
            (self.folder / name).mkdir()
            code, _, errors = ran(program, *words, cwd=self.folder / name)
            self.assertEqual(code, 0, errors)
            rows.append((self.folder / name / "swept" / "gathered.csv").read_bytes())
        self.assertEqual(rows[0], rows[1])

    def test_ctrl_c_ends_it(self):
        words = ["--quiet", "run", "hybrid-wall", "--set", PLANNED, "--set", "run.duration=100000 s"]
        run = subprocess.Popen([self.own, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        # Until it listens for signals, in a thread of that name.
        tasks = Path(f"/proc/{run.pid}/task")
        for _ in range(1000):
            if "signals\n" in [(task / "comm").read_text() for task in tasks.iterdir()]:
                break
            time.sleep(0.02)
        run.send_signal(signal.SIGINT)
        said, errors = run.communicate(timeout=20)
        self.assertEqual((run.returncode, errors), (130, ""))
        self.assertIn("stopped before its end", said)


if __name__ == "__main__":
    unittest.main()
