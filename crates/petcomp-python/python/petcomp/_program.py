"""The program ``petcomp``, which is inside the native half."""

from __future__ import annotations

import sys

from . import _petcomp

__all__ = ["main"]


def main() -> None:
    """Runs the command line and ends the process with its status."""
    sys.exit(_petcomp.run_program(["petcomp", *sys.argv[1:]]))
