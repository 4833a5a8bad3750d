#!/usr/bin/env python3
"""Packs a wheel of the extension that cargo has built already: for tests, which then compile nothing twice.

    pack.py LIBRARY FOLDER

Releases are made by maturin (`make wheel`).
"""

import base64
import hashlib
import re
import shutil
import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent


def main():
    library, folder = Path(sys.argv[1]), Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    print(pack(library, folder))


def pack(library, folder):
    project = (HERE / "pyproject.toml").read_text()
    version = re.search(r'^version = "(.*)"', project, re.MULTILINE)[1]
    info = f"petcomp-{version}.dist-info"
    tag = "cp310-abi3-linux_x86_64"
    files = {f"petcomp/{file.name}": file.read_bytes() for file in sources()}
    files["petcomp/_petcomp.abi3.so"] = library.read_bytes()
    files[f"{info}/METADATA"] = metadata(project, version)
    files[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: pack\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
    files[f"{info}/entry_points.txt"] = b"[console_scripts]\npetcomp=petcomp._program:main\n"
    record = [f"{name},{digest(data)},{len(data)}" for name, data in files.items()]
    files[f"{info}/RECORD"] = "\n".join([*record, f"{info}/RECORD,,", ""]).encode()
    wheel = folder / f"petcomp-{version}-{tag}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return wheel


def sources():
    folder = HERE / "python/petcomp"
    return sorted(file for file in folder.iterdir() if file.suffix in {".py", ".pyi"} or file.name == "py.typed")


def metadata(project, version):
    needed = re.search(r'^dependencies = \["(.*)"\]', project, re.MULTILINE)[1]
    lines = ["Metadata-Version: 2.1", "Name: petcomp", f"Version: {version}", f"Requires-Dist: {needed}", ""]
    return "\n".join(lines).encode()


def digest(data):
    code = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=")
    return f"sha256={code.decode()}"


if __name__ == "__main__":
    main()
