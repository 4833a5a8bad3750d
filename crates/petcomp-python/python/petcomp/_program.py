"""The program ``petcomp``, part of the native module."""

from __future__ import annotations

import sys

from . import _petcomp

__all__ = ["main"]


def main() -> None:
    """Run the command line and exit with its status."""
    sys.exit(_petcomp.run_program(["petcomp", *sys.argv[1:]]))
