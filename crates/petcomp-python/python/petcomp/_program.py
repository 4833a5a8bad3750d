"""The program ``petcomp``, part of the native module."""

from __future__ import annotations

import os
import sys

from . import _petcomp

__all__ = ["main"]


def main() -> None:
    """Run the command line and exit with its status."""
    _open_streams()
    sys.exit(_petcomp.run_program(["petcomp", *sys.argv[1:]]))


def _open_streams() -> None:
    """Open standard streams that are closed: a file would get their number, and messages would go into it."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
