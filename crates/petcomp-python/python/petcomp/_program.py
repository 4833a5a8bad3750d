"""The program ``petcomp``, part of the native module."""

from __future__ import annotations

import os
import signal
import sys

from . import _petcomp

__all__ = ["main"]


def main() -> None:
    """Run the command line and exit with its status."""
    _open_streams()
    # Python's handler would act only when the program has ended, and with a traceback.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_petcomp.run_program(["petcomp", *sys.argv[1:]]))


def _open_streams() -> None:
    """Open standard streams that are closed: a file would get their number, and messages would go into it."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
