"""The pipeline turns a recipe and a sample number into a labelled image."""

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
    """Check a whole number that fits into 64 bits."""
    try:
        number = operator.index(value)
    except TypeError:
        raise ArgumentTypeError(f"{name}: {type(value).__name__}, expected a whole number") from None
    if 0 <= number < _MOST:
        return number
    raise InvalidValueError(f"{name}: {number}, expected 0 or more, below 2^64")


class Pipeline:
    """An opened recipe, from which samples are generated: ``Pipeline("recipe.toml")[k]``.

    ``recipe`` is a recipe file, or plain data in its format (paths are then relative to the working folder).
    ``set`` changes its values: ``{"scene.objects": 3}``. ``quality`` is ``draft``, ``normal`` or ``reference``.

    Image ``k`` depends only on the recipe, ``seed`` and ``k``, and equals that of ``petcomp dataset generate``.
    A pipeline may be used from any thread and sent to other processes, which reopen the recipe as it was read
    here. It is a context manager.
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
        # Paths in plain data are relative to the working folder.
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
        """Seed of the samples."""
        return self._seed

    @property
    def classes(self) -> list[str]:
        """Names of the classes, in order."""
        return self._native.class_names()

    @property
    def config(self) -> dict[str, Any]:
        """The recipe including its preset and most defaults, as plain data; some unset keys are absent."""
        config: dict[str, Any] = loaded(self._native.config_json())
        return config

    def __getitem__(self, k: SupportsIndex) -> Sample:
        return self.sample(k)

    def sample(self, k: SupportsIndex, seed: int | None = None) -> Sample:
        """Generate sample ``k``, optionally with another seed."""
        seed = self._seed if seed is None else _number("seed", seed)
        return Sample(self._native.sample(seed, _number("k", k)))

    def draw(self, k: SupportsIndex, seed: int | None = None) -> Scene:
        """Draw scene ``k`` of the recipe, with objects not yet settled and exposure not yet set."""
        seed = self._seed if seed is None else _number("seed", seed)
        return Scene.from_dict(loaded(self._native.draw(seed, _number("k", k))))

    def take(self, scene: Scene | Mapping[str, Any]) -> Sample:
        """Resolve the unknowns of a scene, render it and label it."""
        return Sample(self._native.take(dumped("scene", scene)))

    def resolve(self, scene: Scene | Mapping[str, Any]) -> Scene:
        """Resolve all unknowns of a scene: camera, resting poses, exposure."""
        return Scene.from_dict(loaded(self._native.resolve(dumped("scene", scene))))

    def close(self) -> None:
        """Release assets and photos; any later use raises ``ClosedError``."""
        self._native.close()

    @property
    def closed(self) -> bool:
        """Whether the pipeline is closed."""
        return self._native.is_closed()

    def __enter__(self) -> Pipeline:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # An iteration would never end.
    __iter__ = None

    def __reduce__(self) -> tuple[Any, ...]:
        # The recipe as it was read, even if the file has changed since.
        return _opened_anew, (self._name, self._native.folder(), self._native.config_json(), self._seed)

    def __repr__(self) -> str:
        return f"Pipeline({self._name!r}, seed={self._seed})"


def _opened_anew(name: str, folder: str, recipe: str, seed: int) -> Pipeline:
    pipeline = Pipeline.__new__(Pipeline)
    pipeline._name, pipeline._seed = name, seed
    pipeline._native = _petcomp.Pipeline(folder, recipe, [], None)
    return pipeline
