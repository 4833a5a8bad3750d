#!/bin/sh
# Remakes every reference in golden/ with the program that it comes from; `git diff --stat golden` then shows what moved.
# Debian's Blender is expected to be there (`make golden` installs it); Python packages go into target/golden-tools.
set -eu
cd "$(dirname "$0")/.."
tools=target/golden-tools

# An environment of its own for each Python package: environment NAME PACKAGE...
environment() {
    name=$1
    shift
    [ -x "$tools/$name/bin/python" ] || python3 -m venv "$tools/$name"
    "$tools/$name/bin/python" -m pip install --quiet "$@"
}
blend() { blender -b --factory-startup --python-use-system-env -noaudio -P "$@"; }

environment colour colour-science==0.4.7 numpy
environment likeness scikit-image==0.26.0 flip-evaluator==1.7 numpy
environment eval numpy pycocotools==2.0.11 yolov5==7.0.14 'setuptools<80'
environment bpy42 bpy==4.2.0
environment bpy45 bpy==4.5.15

echo "references by:"
blender --version | head -n 1
for name in colour bpy42 bpy45; do "$tools/$name/bin/python" -m pip freeze | grep -iE '^(bpy|colour-science)=='; done

echo "colour"
"$tools/colour/bin/python" golden/color/reference.py
blend golden/color/shift_hsv.py
echo "diff: these two numbers stand in the tests of src/diff"
"$tools/likeness/bin/python" golden/diff/reference.py
echo "eval"
"$tools/eval/bin/python" golden/eval/reference.py
echo "camera"
blend golden/camera/camera_reference.py -- --per-case 16 --seed 1 --out golden/camera
echo "matte"
python3 golden/matte/make_cases.py --blender blender --bpy42 "$tools/bpy42/bin/python" --bpy45 "$tools/bpy45/bin/python"
"$tools/bpy45/bin/python" golden/matte/keying_screen_reference.py
echo "render"
golden/render/references.sh
echo "capture"
"$tools/bpy45/bin/python" experiments/world/world.py displays --out target/displays --library-seed 2500 --count 12 --spp 56
cp -r target/displays/soft target/displays/window golden/capture/
