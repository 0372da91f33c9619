#!/usr/bin/env python3
"""Builds every Rust test and runs each in a process of its own, on all cores; tells the slowest and each binary's time.

Cargo runs one test binary after another, and at the end of each one core waits for the other. Here all tests are one
queue, and those that were slow in the run on record (record/tests.txt, written by --update) start first. Programs that
keep one core busy for long are in the queue too: the check of the VHDL, outside.sh, and the examples in documentation.

Usage: testbench/tests.py [--update] [TEXT]: only tests whose names contain TEXT.
Exit codes: 0 all passed, 1 a test failed, 101 something does not compile.
"""

import json
import os
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RECORD = ROOT / "testbench" / "record" / "tests.txt"
# No test takes this long: one that does hangs.
LIMIT_S = 900
SLOW_S = 2.0
# Programs in the queue that are no Rust tests, by name. Their output is shown at the end.
#
# The VHDL: blocks on their vectors, loops closed around the plant, edge by edge. Beside the directed rows the check
# takes a twentieth of the random ones, and of each scene two fifths of the edges, in which each that has a wall touches
# it, and each block in its default configuration: most blocks are proved too, and long.sh runs the whole check. The
# build of the tests has made the program; `cargo run` would build half of it once more, with fewer features of its
# dependencies. On Debian, `ghdl` starts the back end that GHDL_BACKEND names: LLVM's takes about half the time. All
# other tests have the usual one.
HPU = (ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / "release" / "hpu").as_posix()
OTHERS = {
    "the VHDL in GHDL": [
        *("env", "GHDL_BACKEND=llvm", HPU, "check", "--variant", "default"),
        *("--rows", "100", "--edges", "60000", "--jobs", "1"),
    ],
    "other tools and Python": ["testbench/outside.sh"],
    "examples in documentation": ["cargo", "test", "--locked", "--release", "--workspace", "--doc", "--quiet"],
}


def environment():
    """The environment of tests. Many build the same design of Verilator, each in a cache of its own: with ccache, the
    compiler meets a source once, and cxx.sh has it compile fast."""
    caches, compiler = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", ROOT / "testbench" / "cxx.sh"
    found = {"OBJCACHE": shlex.quote(str(compiler)), "CCACHE_MAXSIZE": "500M"}
    found["CCACHE_DIR"] = str(Path(caches) / "hpu" / "ccache")
    return {**os.environ, **(found if shutil.which("ccache") else {})}


def built():
    """Every test binary: its package, its name, its path."""
    command = ["cargo", "test", "--locked", "--release", "--workspace", "--tests", "--no-run"]
    command.append("--message-format=json-render-diagnostics")
    wrapped = {"RUSTC_WRAPPER": (ROOT / "testbench" / "rustc.sh").as_posix(), **os.environ}
    build = subprocess.run(command, cwd=ROOT, env=wrapped, stdout=subprocess.PIPE)
    if build.returncode != 0:
        sys.exit(build.returncode)
    for line in build.stdout.splitlines():
        message = json.loads(line)
        if message["reason"] == "compiler-artifact" and message["profile"]["test"] and message["executable"]:
            package = Path(message["manifest_path"]).parent
            yield package, message["target"]["name"], message["executable"]


def listed(package, binary, *only):
    """Names of the tests of a binary."""
    command = [binary, "--list", "--format", "terse", *only]
    lines = subprocess.run(command, cwd=package, stdout=subprocess.PIPE, check=True).stdout.decode().splitlines()
    return [line.removesuffix(": test") for line in lines if line.endswith(": test")]


def tests_of(package, name, binary):
    """Every test of a binary but those marked `ignore`, which long.sh runs: name for people, folder, command."""
    ignored = set(listed(package, binary, "--ignored"))
    for test in listed(package, binary):
        if test not in ignored:
            yield f"{package.name} {name} {test}", package, [binary, "--exact", test, "--nocapture"]


def processor_s():
    """Seconds of a core that all programs have taken that have ended."""
    taken = resource.getrusage(resource.RUSAGE_CHILDREN)
    return taken.ru_utime + taken.ru_stime


def recorded():
    """Seconds of the slow tests on record, by name."""
    lines = RECORD.read_text().splitlines() if RECORD.exists() else []
    pairs = (line.split(" ", 1) for line in lines if not line.startswith("#"))
    return {name: float(seconds) for seconds, name in pairs}


def passes(command, ran):
    """Whether a test has passed; a binary of tests that runs none has not."""
    return ran.returncode == 0 and (command in OTHERS.values() or b"test result: ok. 1 passed" in ran.stdout)


class Queue:
    """Tests to run, and what came of them."""

    def __init__(self, tests):
        self.left = list(reversed(tests))
        self.lock = threading.Lock()
        self.took = []
        self.failed = []
        self.said = {}
        self.told = time.monotonic()
        self.environment = environment()

    def work(self):
        while True:
            with self.lock:
                if not self.left:
                    return
                name, package, command = self.left.pop()
            begin = time.monotonic()
            own = {} if name in OTHERS else {"CARGO_MANIFEST_DIR": str(package)}
            try:
                ran = subprocess.run(
                    command,
                    cwd=package,
                    env={**self.environment, **own},
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    timeout=LIMIT_S,
                )
                said, passed = ran.stdout.decode(errors="replace"), passes(command, ran)
            except subprocess.TimeoutExpired as late:
                said = f"{(late.stdout or b'').decode(errors='replace')}\nstill running after {LIMIT_S} s"
                passed = False
            self.done(name, time.monotonic() - begin, said, passed)

    def done(self, name, seconds, said, passed):
        with self.lock:
            self.took.append((seconds, name))
            if not passed:
                self.failed.append(name)
                print(f"--- {name} ---\n{said.rstrip()}", flush=True)
            elif name in OTHERS:
                self.said[name] = said
            if time.monotonic() - self.told > 10 or not self.left:
                self.told = time.monotonic()
                print(f"{len(self.took)} tests done, {len(self.left)} to begin, {len(self.failed)} failed", flush=True)


def main():
    update, text = "--update" in sys.argv, next((word for word in sys.argv[1:] if not word.startswith("--")), "")
    slow = recorded()
    # A job that a shell has begun in the background ignores it, as would the commands that tests end by it.
    signal.signal(signal.SIGQUIT, signal.SIG_DFL)
    begun = time.monotonic()
    binaries = list(built())
    built_s, building_s = time.monotonic() - begun, processor_s()
    tests = [(name, ROOT, command) for name, command in OTHERS.items()]
    tests += [test for binary in binaries for test in tests_of(*binary)]
    tests = [test for test in tests if text in test[0]]
    tests.sort(key=lambda test: -slow.get(test[0], 0.0))
    if not tests:
        sys.exit(f"error: no test has `{text}` in its name")
    queue = Queue(tests)
    threads = [threading.Thread(target=queue.work) for _ in range(len(os.sched_getaffinity(0)))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for name, said in queue.said.items():
        print(f"--- {name} ---\n{said.rstrip()}")
    print("the ten slowest tests:")
    for seconds, name in sorted(queue.took, reverse=True)[:10]:
        print(f"{seconds:8.2f} s  {name}")
    sums = {}
    for seconds, name in queue.took:
        binary = name if name in OTHERS else " ".join(name.split(" ")[:2])
        count, total = sums.get(binary, (0, 0.0))
        sums[binary] = (count + 1, total + seconds)
    for binary, (count, total) in sorted(sums.items(), key=lambda one: -one[1][1]):
        print(f"{total:8.2f} s  {binary}: {count} tests")
    print(f"{built_s:8.2f} s  builds, {building_s:.0f} s of a core")
    print(f"{time.monotonic() - begun - built_s:8.2f} s  tests, {processor_s() - building_s:.0f} s of a core")
    if update:
        slowest = [f"{seconds:.0f} {name}\n" for seconds, name in sorted(queue.took, reverse=True) if seconds > SLOW_S]
        head = "# Seconds of the slow tests, by testbench/tests.py --update; those start first.\n"
        RECORD.write_text(head + "".join(slowest))
    for name in queue.failed:
        print(f"failed: {name}")
    failed = len(queue.failed)
    print(f"test result: {'FAILED' if failed else 'ok'}. {len(queue.took) - failed} passed; {failed} failed")
    sys.exit(1 if queue.failed else 0)


main()
