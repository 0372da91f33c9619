"""The command, which is the oracle of the package. `HPU` names it."""

import hashlib
import json
import os
import struct
import subprocess
from pathlib import Path

HPU = os.environ["HPU"]
# The project's folder.
ROOT = Path(__file__).parents[3]
# Figures of the machine, not of the run.
OF_THE_MACHINE = ("wall_s", "edges_per_s")


def told(*words):
    """Returns what the command says of these words, as JSON."""
    ran = subprocess.run([HPU, *words, "--json"], capture_output=True, text=True, check=False)
    assert ran.stdout, ran.stderr
    return json.loads(ran.stdout)


def options(overrides):
    """Returns overrides as options of the command."""
    return [f"--set={key}={value}" for key, value in overrides.items()]


def without(summary, *names):
    """Returns a summary without these keys."""
    return {key: value for key, value in summary.items() if key not in names}


def digest(rows):
    """Returns the SHA-256 of rows of numbers, each by its 64 bits."""
    return hashlib.sha256(b"".join(struct.pack("<d", value) for row in rows for value in row)).hexdigest()
