"""Stubs and help are what the module is."""

import ast
import importlib
import inspect
import pkgutil
import subprocess
import sys
from pathlib import Path

import petcomp
import pytest
from petcomp import _petcomp

PACKAGE = Path(petcomp.__file__).parent
MODULES = [m.name for m in pkgutil.iter_modules([str(PACKAGE)]) if m.name not in {"torch", "__main__"}]


def stub():
    return ast.parse((PACKAGE / "_petcomp.pyi").read_text())


def public(names):
    return {name for name in names if not name.startswith("_")}


def test_the_stub_names_what_the_module_has():
    told = public(n.name for n in stub().body if isinstance(n, (ast.FunctionDef, ast.ClassDef)))
    assert told == public(dir(_petcomp))


def test_the_stub_has_every_method_and_argument():
    for node in stub().body:
        if isinstance(node, ast.FunctionDef):
            assert arguments(node) == list(inspect.signature(getattr(_petcomp, node.name)).parameters), node.name
        if isinstance(node, ast.ClassDef):
            real = getattr(_petcomp, node.name)
            methods = {n.name: n for n in node.body if isinstance(n, ast.FunctionDef)}
            assert public(methods) == public(dir(real)), node.name
            for name in public(methods):
                attribute = inspect.getattr_static(real, name)
                if callable(getattr(real, name)) and not inspect.isgetsetdescriptor(attribute):
                    want = list(inspect.signature(getattr(real, name)).parameters)
                    assert arguments(methods[name]) == want, name


def arguments(node):
    return [argument.arg for argument in node.args.args + node.args.kwonlyargs]


def test_everything_public_has_help():
    for name in [m for m in MODULES if not m.startswith("_")]:
        module = importlib.import_module(f"petcomp.{name}")
        assert module.__doc__, name
        for word in module.__all__:
            thing = getattr(module, word)
            assert thing.__doc__, word
            if inspect.isclass(thing):
                missing = [
                    n for n, m in vars(thing).items() if not n.startswith("_") and needs_help(m) and not m.__doc__
                ]
                assert not missing, (word, missing)


def needs_help(member):
    return inspect.isfunction(member) or isinstance(member, (property, classmethod))


def test_arrays_are_told_with_shape_and_kind():
    for thing in (petcomp.Sample.image, petcomp.Sample.image_linear, petcomp.Sample.depth, petcomp.Sample.boxes):
        text = thing.__doc__
        assert "x" in text and any(kind in text for kind in ("uint8", "float32", "float64")), text
    for word in ("height x width", "float32", "uint8", "scene-linear"):
        assert word in petcomp.matte.key.__doc__


def run_mypy(folder, *words):
    pytest.importorskip("mypy")
    done = subprocess.run([sys.executable, "-m", *words], capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr


def test_mypy_is_content(tmp_path):
    words = ["--strict", "--ignore-missing-imports", "--disable-error-code=import-not-found"]
    modules = [f"petcomp.{name}" for name in MODULES]
    run_mypy(tmp_path, "mypy", *words, *[word for module in modules for word in ("-m", module)])


def test_the_stub_passes_stubtest(tmp_path):
    run_mypy(tmp_path, "mypy.stubtest", "petcomp._petcomp", "--ignore-disjoint-bases")


def test_torch_is_imported_by_its_module_alone():
    script = "import sys, petcomp; assert 'torch' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", script]).returncode == 0
