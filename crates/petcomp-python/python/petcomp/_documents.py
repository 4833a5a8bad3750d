"""Plain data as JSON, the form in which documents reach the native module."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ._petcomp import is_class_name
from .errors import ArgumentTypeError, InvalidValueError

__all__ = [
    "check_array",
    "class_names",
    "dumped",
    "folder_of",
    "label_names",
    "loaded",
    "numbers_in",
    "overrides",
    "path_of",
    "plain",
]

_MOST_LEVELS = 60
#: Characters of a wrong name.
_MOST_SHOWN = 120
#: An array that only claims to be large, as by broadcasting, must not be written out.
_MOST_NUMBERS = 10_000_000


def check_array(name: str, value: Any, most: int = _MOST_NUMBERS) -> None:
    """Reject masked arrays and those with more than ``most`` numbers, before reading any."""
    if isinstance(value, np.ma.MaskedArray):
        raise ArgumentTypeError(f"{name}: a masked array, expected a plain one")
    size = getattr(value, "size", 0)
    if isinstance(size, int) and size > most:
        raise InvalidValueError(f"{name}: {size} numbers, expected at most {most}")


def loaded(text: str) -> Any:
    """Parse a document from the native module."""
    return json.loads(text)


def dumped(name: str, value: Any) -> str:
    """Write plain data as JSON; it may contain NumPy numbers, tuples and objects with ``to_dict``."""
    return json.dumps(plain(name, value))


def plain(name: str, value: Any) -> Any:
    """Copy the data into Python's own types."""
    return _plain(name, value, 0)


def _plain(at: str, value: Any, level: int) -> Any:
    if level > _MOST_LEVELS:
        raise InvalidValueError(f"{at}: nested more than {_MOST_LEVELS} deep")
    if value is None or isinstance(value, (bool, str)):
        return value
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {_key(at, key): _plain(f"{at}.{key}", item, level + 1) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(f"{at}[{i}]", item, level + 1) for i, item in enumerate(value)]
    return _plain_scalar(at, value, level)


def _key(at: str, key: Any) -> str:
    if isinstance(key, str):
        return key
    raise ArgumentTypeError(f"{at}: key {key!r}, expected text")


def _plain_scalar(at: str, value: Any, level: int) -> Any:
    if hasattr(value, "tolist"):
        check_array(at, value)
        return _plain(at, value.tolist(), level + 1)
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, int):
        return value
    if isinstance(value, float):
        if math.isfinite(value):
            return value
        raise InvalidValueError(f"{at}: {value}, expected a finite number")
    raise ArgumentTypeError(f"{at}: {type(value).__name__}, expected numbers, text, lists and dicts")


def overrides(values: Any) -> list[str]:
    """Convert changes to a recipe (plain data) to the form of ``--set``."""
    if not isinstance(values, dict):
        raise ArgumentTypeError(f"set: {type(values).__name__}, expected a dict")
    return [_override(key, value) for key, value in values.items()]


def _override(key: str, value: Any) -> str:
    if not key or "=" in key:
        raise InvalidValueError(f"set: key {key!r}, expected one such as scene.objects")
    return f"{key}={_toml(f'set.{key}', value)}"


def _toml(at: str, value: Any) -> str:
    if value is None:
        raise InvalidValueError(f"{at}: None, expected a value")
    if isinstance(value, dict):
        items = ", ".join(f"{_toml(at, key)} = {_toml(at, item)}" for key, item in value.items())
        return f"{{ {items} }}"
    if isinstance(value, list):
        return f"[{', '.join(_toml(at, item) for item in value)}]"
    # TOML allows neither surrogate pairs nor an unescaped DEL.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def numbers_in(value: Any) -> npt.NDArray[Any]:
    """Convert to an array; fail for what NumPy would convert to numbers: texts, dates, complex numbers."""
    given = np.asarray(value)
    texts = given.dtype == object and any(isinstance(one, (str, bytes)) for one in given.flat)
    if texts or given.dtype.kind not in "biufO":
        raise TypeError(f"not real numbers: {given.dtype}")
    return given


def class_names(value: Any) -> list[str]:
    """Check a list of class names, which must be unique."""
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise ArgumentTypeError(f"classes: {value!r}, expected a list of names")
    names = list(value)
    for name in names:
        if not isinstance(name, str):
            raise ArgumentTypeError(f"classes: {type(name).__name__}, expected names")
    if len(set(names)) < len(names):
        raise InvalidValueError(f"classes: {names}, expected each name once")
    return names


def label_names(value: Any) -> list[str]:
    """Check a list of class names that are to be written."""
    names = class_names(value)
    for name in names:
        if not is_class_name(name):
            what = "expected a name on one line without leading or trailing spaces"
            raise InvalidValueError(f"classes: {name[:_MOST_SHOWN]!r}, {what}")
    return names


def path_of(name: str, value: Any) -> str:
    """Convert a path argument to text."""
    try:
        path = os.fspath(value)
    except TypeError:
        raise ArgumentTypeError(f"{name}: {type(value).__name__}, expected a path") from None
    path = os.fsdecode(path)
    if "\0" in path:
        raise InvalidValueError(f"{name}: a null character in a path, expected none")
    return path


def folder_of(name: str, value: Any) -> str:
    """Convert the path of a local folder to write into."""
    path = path_of(name, value)
    if "://" in path:
        raise InvalidValueError(f"{name}: {path} is a URL, expected a folder")
    return path
