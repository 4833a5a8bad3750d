"""Plain data as JSON, which is how documents cross the border to the native half."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import Any

from .errors import ArgumentTypeError, InvalidValueError

__all__ = ["check_count", "dumped", "loaded", "overrides", "path_of"]

_MOST_LEVELS = 60
#: An array that only says that it is large must not be written out.
_MOST_NUMBERS = 10_000_000


def check_count(name: str, value: Any) -> None:
    """Refuses arrays with more numbers than a document may have, before any is looked at."""
    size = getattr(value, "size", 0)
    if isinstance(size, int) and size > _MOST_NUMBERS:
        raise InvalidValueError(f"{name}: {size} numbers, expected at most {_MOST_NUMBERS}")


def loaded(text: str) -> Any:
    """The data of a document of the native half."""
    return json.loads(text)


def dumped(name: str, value: Any) -> str:
    """The document of plain data; numbers of NumPy, tuples and whatever has ``to_dict`` may be in it."""
    return json.dumps(_plain(name, value, 0))


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
        check_count(at, value)
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


def overrides(values: Mapping[str, Any] | None) -> list[str]:
    """Values of a recipe to be changed, as ``--set`` has them."""
    return [f"{key}={_toml(f'set[{key!r}]', value)}" for key, value in (values or {}).items()]


def _toml(at: str, value: Any) -> str:
    if isinstance(value, Mapping):
        items = ", ".join(f"{json.dumps(_key(at, key))} = {_toml(at, item)}" for key, item in value.items())
        return f"{{ {items} }}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_toml(at, item) for item in value)}]"
    return json.dumps(_plain(at, value, 0))


def path_of(name: str, value: Any) -> str:
    """A path of an argument."""
    try:
        path = os.fspath(value)
    except TypeError:
        raise ArgumentTypeError(f"{name}: {type(value).__name__}, expected a path") from None
    path = os.fsdecode(path)
    if "\0" in path:
        raise InvalidValueError(f"{name}: a zero in a path, expected none")
    return path
