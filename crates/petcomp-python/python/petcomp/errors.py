"""What can go wrong: a class for each kind, with the same sentence as the program's.

Every error has ``path`` (which file), ``at`` (which value, as ``objects[3].size``) and ``what`` (the
offending value and what was expected), as far as they are known.
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
    """Something that petcomp could not do."""

    path: str | None = None
    at: str | None = None
    what: str | None = None


class FileError(Error, OSError):
    """A file that cannot be read, understood or written."""

    # OSError would print its own fields.
    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class FieldError(Error, ValueError):
    """A value in a document that is well-formed but cannot be right."""


class InvalidValueError(Error, ValueError):
    """An argument, a scene or an option that cannot be right."""


class ArgumentTypeError(Error, TypeError):
    """An argument of the wrong type, or an array of the wrong dtype."""


class PhotoError(Error):
    """A photo in which no usable object was found."""


class CameraError(Error):
    """A rectangle that no camera can have seen."""


class UnsettledError(Error):
    """Dropped objects that would not come to rest."""


class InterruptedError(Error):
    """The work was stopped before its end; the same call goes on."""


class ClosedError(Error, ValueError):
    """The use of something that was closed."""


class InternalError(Error, RuntimeError):
    """A bug in petcomp: please report it."""
