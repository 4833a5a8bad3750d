"""Every example of examples/python runs, and does what it says."""

import hashlib
import os
import subprocess
import sys

import petcomp
import pytest
from conftest import ROOT, SAMPLES

EXAMPLES = ROOT / "examples/python"


def run(name, *words):
    done = subprocess.run(
        [sys.executable, EXAMPLES / name, *map(str, words)], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_key_photo(tmp_path):
    photo = sorted((SAMPLES / "bottles").glob("*.png"))[2]
    assert "on average" in run("key_photo.py", photo, tmp_path)
    for name in ("keyed.exr", "cut_out.exr"):
        assert petcomp.io.read(tmp_path / name, alpha=True)[..., 3].max() > 0.5


def test_own_generator(tmp_path):
    assert "10 images, 10 labels" in run("own_generator.py", tmp_path / "set")
    assert len(list(tmp_path.glob("set/labels/*/*.txt"))) == 10


def test_train_loop(recipe):
    pytest.importorskip("torch", reason="PyTorch is not installed")
    assert "step 1: loss" in run("train_loop.py", recipe, 2)


def test_ray_generate(recipe, tmp_path):
    pytest.importorskip("ray", reason="Ray is not installed")
    assert "one of which was killed" in run("ray_generate.py", recipe, 12, tmp_path)
    assert (tmp_path / "struck-2").exists()
    petcomp.generate(recipe, 12, tmp_path / "alone", seed=1)
    kinds = ("images", "labels", "scenes")
    assert digests(tmp_path / "dataset", kinds) == digests(tmp_path / "alone", kinds)


def digests(folder, kinds):
    files = sorted(path for kind in kinds for path in folder.glob(f"{kind}/*/*"))
    assert files
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_first_look(recipe, monkeypatch):
    nbformat = pytest.importorskip("nbformat", reason="no notebooks here")
    nbclient = pytest.importorskip("nbclient", reason="no notebooks here")
    monkeypatch.setenv("PETCOMP_RECIPE", str(recipe))
    notebook = nbformat.read(EXAMPLES / "first_look.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    kinds = [kind for cell in notebook.cells for output in cell.get("outputs", []) for kind in output.get("data", {})]
    assert "text/html" in kinds and "image/png" in kinds


def test_without_torch_and_ray_they_say_so(recipe, tmp_path):
    hidden = "import sys; sys.modules['torch'] = sys.modules['ray'] = None; import runpy; runpy.run_path(sys.argv.pop(1), run_name='__main__')"
    for name, words in (("train_loop.py", [recipe]), ("ray_generate.py", [recipe, "1", tmp_path])):
        done = subprocess.run([sys.executable, "-c", hidden, EXAMPLES / name, *words], capture_output=True, text=True)
        assert done.returncode == 0 and "is not installed: nothing is" in done.stdout, done.stderr
    assert os.listdir(tmp_path) == []
