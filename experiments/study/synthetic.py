"""Synthetic pictures, from petcomp with a recipe or from naive cut-and-paste."""

import json

from . import distractors, files, naive, reality


def pictures(study, name):
    """Pictures of a generator, generated if missing, and the version that made them."""
    generator = described(study.arms["generators"], name)
    folder = study.cache / "synthetic" / name
    count = generator.get("pictures", study.arms["synthetic"]["pictures"])
    assets = build_assets(study, generator)
    backgrounds = study.backgrounds or place_photos(study, generator.get("albedo", ""))
    if generator.get("program") == "naive":
        naive.generate(assets, backgrounds, count, study.arms["synthetic"]["seed"], folder)
    else:
        generate(study, generator, assets, backgrounds, count, folder)
    made_by = folder / "made_by.json"
    if not made_by.exists():
        files.write_json(made_by, study.version())
    return [str(path) for path in sorted((folder / "images").rglob("*.jpg"))], json.loads(made_by.read_text())


def described(generators, name):
    """A generator including everything that it inherits from its `base`."""
    own = generators[name]
    if "base" not in own:
        return own
    base = described(generators, own["base"])
    kept = [change for change in base.get("set", []) if change.split("=")[0] not in own.get("without", [])]
    return base | own | {"set": kept + own.get("set", [])}


def place_photos(study, albedo):
    folder = study.cache / "_".join(["backgrounds", *([albedo] if albedo else [])])
    return reality.backgrounds(study.world, study.rooms, albedo, folder)


def build_assets(study, generator):
    cut_out, thickness = generator.get("cut_out", {}), generator.get("thickness", 0)
    kinds = [*cut_out.values(), *(["distractors"] if generator.get("distractors") else [])]
    kinds += [f"thickness_{thickness}"] if thickness else []
    count = generator.get("bottles", study.arms["reality"]["bottles"])
    kinds += [str(count)] if "bottles" in generator else []
    name = "_".join(kinds) or "default"
    folder = study.cache / "assets" / name
    listed = study.cache / "photos" / name
    beside = distractors.entries(listed) if generator.get("distractors") else []
    photos = study.photos or reality.photo_list(study.world, count, cut_out, thickness, beside, listed)
    study.petcomp("asset", "build", photos, "-o", folder)
    return folder


def generate(study, generator, assets, backgrounds, count, folder):
    recipe = files.write_text(
        study.cache / "recipes" / f"{folder.name}.toml",
        f"assets = {json.dumps(str(assets))}\nbackgrounds = {json.dumps(str(backgrounds))}\n",
    )
    changes = study.arms["synthetic"]["set"] + generator.get("set", [])
    options = [word for change in changes for word in ("--set", change)]
    seed = study.arms["synthetic"]["seed"]
    study.petcomp("dataset", "generate", recipe, *options, "-n", count, "--seed", seed, "--yes", "-o", folder)
