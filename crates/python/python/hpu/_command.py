"""The command ``hpu``: the entry point of the package."""

import os
import shutil
import signal
import sys

from . import _hpu


def main():
    """Runs the command with the arguments of this process and returns its exit code."""
    # The command handles Ctrl-C itself.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    # A sweep starts the command again, once a shard. On Windows its file has an ending.
    starter = os.path.abspath(sys.argv[0])
    return _hpu._command(sys.argv, shutil.which(starter) or starter, _hpu.__file__)
