"""Exceptions: a class for each kind of error, with the program's message.

Every error has ``path`` (the file), ``at`` (the value, e.g. ``objects[3].size``) and ``what`` (the invalid
value and what was expected), as far as they are known.
"""

from __future__ import annotations

__all__ = [
    "ArgumentTypeError",
    "CameraError",
    "ClosedError",
    "Error",
    "FieldError",
    "FileError",
    "InternalError",
    "InterruptedError",
    "InvalidValueError",
    "PhotoError",
    "UnsettledError",
]


class Error(Exception):
    """Base class of all errors of petcomp."""

    path: str | None = None
    at: str | None = None
    what: str | None = None


class _OfValue(Error):
    """An error whose message names the value, then says what is wrong with it."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.at, _, self.what = message.partition(": ")


class FileError(Error, OSError):
    """A file that cannot be read, parsed or written."""

    # OSError would print its own fields.
    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class FieldError(Error, ValueError):
    """An invalid value in a well-formed document."""


class InvalidValueError(_OfValue, ValueError):
    """An invalid argument, scene or option."""


class ArgumentTypeError(_OfValue, TypeError):
    """An argument of the wrong type, or an array of the wrong dtype."""


class PhotoError(Error):
    """A photo without a usable object."""


class CameraError(Error):
    """A rectangle that no camera can have seen."""


class UnsettledError(Error):
    """Dropped objects that did not come to rest."""


class InterruptedError(Error):
    """Work that was stopped early; repeat the call of ``generate`` to resume."""


class ClosedError(Error, ValueError):
    """Use of a closed object."""


class InternalError(Error, RuntimeError):
    """A bug in petcomp: please report it."""
