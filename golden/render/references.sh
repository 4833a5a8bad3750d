#!/bin/sh
# Remakes every golden reference of this stage with Debian's Blender (3.4.1) and python3-numpy.
# Scenes whose quads have no pose yet are dropped first; a pose that exists is kept.
set -eu
cd "$(dirname "$0")"
blend() { blender -b --factory-startup --python-use-system-env -P scene_reference.py -- "$@"; }
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT
for case in ${*:-*/case.toml}; do
    dir=$(dirname "$case")
    if ! grep -q '"pose"' "$dir/scene.json"; then
        blend "$dir/scene.json" --out "$work" --simulate --no-beauty --poses "$work/poses.json"
        python3 - "$dir/scene.json" "$work/poses.json" <<'PY'
import json, sys
scene, poses = (json.load(open(p)) for p in sys.argv[1:])
table = {e["id"]: e["pose"] for e in poses["quads"]}
for quad in scene["quads"]:
    quad["pose"] = [[round(v, 9) for v in row] for row in table[quad["id"]]]
with open(sys.argv[1], "w") as out:
    json.dump(scene, out, indent=1)
    out.write("\n")
PY
    fi
    blend "$dir/scene.json" --out "$work" --golden "$PWD/$dir/reference.exr"
done
