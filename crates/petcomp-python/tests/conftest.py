"""What the tests of the package are made on: the sample photographs, once cut out by the program."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

# Nothing is left in the repository.
os.environ.setdefault("HYPOTHESIS_STORAGE_DIRECTORY", tempfile.gettempdir())

ROOT = Path(__file__).resolve().parents[3]
SAMPLES = ROOT / "tests/samples"


def run_program(*words):
    """The program of the package, in a process of its own."""
    done = subprocess.run([sys.executable, "-m", "petcomp", *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def program():
    return run_program


@pytest.fixture(scope="session")
def world(tmp_path_factory):
    """A folder with assets and a small, quick recipe."""
    folder = tmp_path_factory.mktemp("world")
    photos = SAMPLES / "bottles"
    names = sorted(path.name for path in photos.glob("*.png"))[:2]
    rows = [f"{photos / name},bottle{i},bottle,0.25" for i, name in enumerate(names)]
    (folder / "photos.csv").write_text("\n".join(["file,asset,class,length", *rows, ""]))
    run_program("asset", "build", folder / "photos.csv", "-o", folder / "assets", "-q")
    backgrounds = os.path.relpath(SAMPLES / "backgrounds", folder)
    (folder / "recipe.toml").write_text(
        f'assets = "assets"\nbackgrounds = "{backgrounds}"\n'
        "[scene]\nimage = [160, 120]\nobjects = [2, 3]\n[render]\nsubsamples = 1\nambient_samples = 8\n"
    )
    return folder


@pytest.fixture(scope="session")
def recipe(world):
    return world / "recipe.toml"
