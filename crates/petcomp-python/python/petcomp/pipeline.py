"""The pipeline: recipe and number in, labelled picture out."""

from __future__ import annotations

import operator
import os
from collections.abc import Mapping
from typing import Any, SupportsIndex

from . import _petcomp
from ._documents import dumped, loaded, overrides, path_of, plain
from .errors import ArgumentTypeError, InvalidValueError
from .sample import Sample
from .scene import Scene

__all__ = ["Pipeline"]

_MOST = 2**64


def _number(name: str, value: Any) -> int:
    """A whole number that the native half can hold."""
    try:
        number = operator.index(value)
    except TypeError:
        raise ArgumentTypeError(f"{name}: {type(value).__name__}, expected a whole number") from None
    if 0 <= number < _MOST:
        return number
    raise InvalidValueError(f"{name}: {number}, expected 0 or more, below 2^64")


class Pipeline:
    """Everything that pictures are made from, opened once: ``Pipeline("recipe.toml")[k]``.

    ``recipe`` is a recipe file, or the same as plain data (its paths then relative to the working
    folder). ``set`` changes values of it: ``{"scene.objects": 3}``. ``quality`` is ``draft``, ``normal``
    or ``reference``. Picture ``k`` depends on nothing but the recipe, ``seed`` and ``k``, and is that of
    ``petcomp dataset generate``. May be used from any thread, sent to other processes (which open the
    same recipe anew, as it was read here), and is a context manager.
    """

    def __init__(
        self,
        recipe: str | os.PathLike[str] | Mapping[str, Any],
        *,
        seed: int = 0,
        set: Mapping[str, Any] | None = None,
        quality: str | None = None,
    ) -> None:
        self._seed = _number("seed", seed)
        is_data = isinstance(recipe, Mapping)
        # Data is named from the working folder.
        path = "" if is_data else path_of("recipe", recipe)
        self._name = "recipe" if is_data else os.path.abspath(path)
        self._native = _petcomp.Pipeline(
            path,
            dumped("recipe", recipe) if is_data else None,
            overrides(plain("set", set or {})),
            quality,
        )

    @property
    def seed(self) -> int:
        """Seed of its pictures."""
        return self._seed

    @property
    def classes(self) -> list[str]:
        """Names of the classes of its labels, in order."""
        return self._native.class_names()

    @property
    def config(self) -> dict[str, Any]:
        """The recipe with every default, as plain data."""
        config: dict[str, Any] = loaded(self._native.config_json())
        return config

    def __getitem__(self, k: SupportsIndex) -> Sample:
        return self.sample(k)

    def sample(self, k: SupportsIndex, seed: int | None = None) -> Sample:
        """Sample ``k``; of another seed where one is given."""
        seed = self._seed if seed is None else _number("seed", seed)
        return Sample(self._native.sample(seed, _number("k", k)))

    def draw(self, k: SupportsIndex, seed: int | None = None) -> Scene:
        """Scene ``k`` as the recipe draws it: objects not settled yet, exposure still open."""
        seed = self._seed if seed is None else _number("seed", seed)
        return Scene.from_dict(loaded(self._native.draw(seed, _number("k", k))))

    def take(self, scene: Scene | Mapping[str, Any]) -> Sample:
        """Finds out what is unknown in a scene, renders it and labels it."""
        return Sample(self._native.take(dumped("scene", scene)))

    def resolve(self, scene: Scene | Mapping[str, Any]) -> Scene:
        """The scene with nothing left open: camera, resting poses, exposure."""
        return Scene.from_dict(loaded(self._native.resolve(dumped("scene", scene))))

    def close(self) -> None:
        """Lets go of assets and photos; what is asked of it after that raises ``ClosedError``."""
        self._native.close()

    @property
    def closed(self) -> bool:
        """Whether it is closed."""
        return self._native.is_closed()

    def __enter__(self) -> Pipeline:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # An iteration would never end.
    __iter__ = None

    def __reduce__(self) -> tuple[Any, ...]:
        # What was read, whatever became of the file.
        return _opened_anew, (self._name, self._native.folder(), self._native.config_json(), self._seed)

    def __repr__(self) -> str:
        return f"Pipeline({self._name!r}, seed={self._seed})"


def _opened_anew(name: str, folder: str, recipe: str, seed: int) -> Pipeline:
    pipeline = Pipeline.__new__(Pipeline)
    pipeline._name, pipeline._seed = name, seed
    pipeline._native = _petcomp.Pipeline(folder, recipe, [], None)
    return pipeline
