"""What Python makes is what the program makes."""

import hashlib
import json
import shutil

import numpy as np
import petcomp
import pytest
from conftest import SAMPLES

COUNT = 4


def files_of(folder):
    """Digests of all files but the clock's."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name not in {".runs.jsonl", ".lock", ".inputs.json"}:
            found[str(path.relative_to(folder))] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


@pytest.fixture(scope="module")
def written(recipe, tmp_path_factory, program):
    folder = tmp_path_factory.mktemp("written") / "set"
    program("dataset", "generate", recipe, "-n", COUNT, "--seed", 5, "-o", folder, "-q")
    return folder


def test_generate_writes_the_programs_files(recipe, written, tmp_path):
    steps = []
    counts = petcomp.generate(recipe, COUNT, tmp_path / "set", seed=5, progress=steps.append)
    ours, theirs = files_of(tmp_path / "set"), files_of(written)
    assert ours == theirs
    assert counts.images == COUNT and counts.made == COUNT
    assert [step.done for step in steps] == list(range(COUNT + 1))
    assert all(step.count == COUNT for step in steps)


def test_a_second_call_makes_nothing(recipe, tmp_path):
    petcomp.generate(recipe, 2, tmp_path / "set")
    assert petcomp.generate(recipe, 2, tmp_path / "set").made == 0


def test_a_sample_is_the_programs_picture(recipe, written):
    pipeline = petcomp.Pipeline(recipe, seed=5)
    for k in range(COUNT):
        path = next(written.glob(f"images/*/{k:06}.png"))
        sample = pipeline[k]
        petcomp.io.write(written.parent / "own.png", sample.image)
        assert (written.parent / "own.png").read_bytes() == path.read_bytes()


def test_labels_are_the_programs(recipe, written):
    pipeline = petcomp.Pipeline(recipe, seed=5)
    for k in range(COUNT):
        sample = pipeline[k]
        record = json.loads(next(written.glob(f"scenes/*/{k:06}.json")).read_text())
        assert sample.labels == record["labels"]
        assert sample.scene.to_dict() == record["scene"]
        assert sample.object_ids.tolist() == record["labelled"]
        assert sample.draws == record["draws"]
        rows = next(written.glob(f"labels/*/{k:06}.txt")).read_text().splitlines()
        width, height = sample.size
        ours = {
            f"{c} {(b[0] + b[2]) / 2 / width:.6f} {(b[1] + b[3]) / 2 / height:.6f} "
            f"{(b[2] - b[0]) / width:.6f} {(b[3] - b[1]) / height:.6f}"
            for c, b in zip(sample.classes, sample.boxes)
        }
        assert ours == set(rows)


def test_a_sample_is_the_programs_jpeg(recipe, tmp_path):
    changes = {"format": "jpg", "jpeg_quality": [20, 60], "jpeg_chroma": ["4:2:0", "4:4:4"]}
    lossy = petcomp.Pipeline(recipe, seed=5, set={f"pictures.{key}": value for key, value in changes.items()})
    petcomp.generate(lossy, 2, tmp_path / "set")
    for k in range(2):
        sample, whole = lossy[k], petcomp.Pipeline(recipe, seed=5)[k]
        petcomp.io.write(tmp_path / "own.png", sample.image)
        path = next(tmp_path.glob(f"set/images/*/{k:06}.jpg"))
        assert (petcomp.io.read(tmp_path / "own.png") == petcomp.io.read(path)).all()
        assert (sample.image != whole.image).any()
        assert (sample.image_linear == whole.image_linear).all()


def test_boxes_are_those_of_the_layout_that_is_written(recipe):
    changes = {"labels.formats": ["coco"], "labels.coco.boxes": "visible", "labels.obstructed": "keep"}
    sample = petcomp.Pipeline(recipe, seed=5, set={**changes, "scene.objects": 10})[0]
    objects = [o for o in sample.labels["objects"] if o["id"] in sample.object_ids]
    visible, amodal = ([list(o[name].values()) for o in objects] for name in ("visible_box", "amodal_box"))
    assert sample.boxes.tolist() == visible != amodal


def test_masks_boxes_and_depth_agree(recipe):
    sample = petcomp.Pipeline(recipe, seed=5)[1]
    masks = sample.mask_arrays()
    assert masks.shape == (len(sample), sample.size[1], sample.size[0])
    for mask, box, run in zip(masks, sample.boxes, sample.masks):
        rows, columns = np.nonzero(mask)
        assert box.tolist() == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
        assert run["size"] == [sample.size[1], sample.size[0]]
    assert ((sample.ids > 0) == np.isfinite(sample.depth)).all()
    assert set(np.unique(sample.ids)) - {0} <= {o["id"] for o in sample.labels["objects"]}


def test_image_is_the_linear_one_encoded(recipe):
    sample = petcomp.Pipeline(recipe)[0]
    linear = sample.image_linear
    assert linear.dtype == np.float32 and linear.shape == (120, 160, 4)
    assert sample.image.dtype == np.uint8 and sample.image.shape == (120, 160, 3)
    light = np.clip(linear[..., :3].astype(np.float64), 0, 1)
    codes = 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    assert np.abs(codes - sample.image).max() <= 0.51


def test_take_renders_what_was_drawn(recipe):
    pipeline = petcomp.Pipeline(recipe, seed=5)
    drawn = pipeline.draw(2)
    assert (pipeline.take(drawn).image == pipeline[2].image).all()
    solved = pipeline.resolve(drawn)
    assert solved == pipeline[2].scene
    assert petcomp.Scene.from_dict(solved.to_dict()) == solved


@pytest.mark.parametrize("name", ["scene.toml", "scene.json"])
def test_scenes_are_the_programs_files(recipe, tmp_path, program, name):
    program("scene", "draw", recipe, "-k", 1, "-o", tmp_path / name)
    scene = petcomp.Scene.read(tmp_path / name)
    drawn = petcomp.Pipeline(recipe).draw(1)
    assert scene.replace(files=None, settings={}) == drawn.replace(files=None, settings={})
    scene.write(tmp_path / f"again-{name}")
    assert petcomp.Scene.read(tmp_path / f"again-{name}") == scene
    with pytest.raises(petcomp.errors.FileError, match="no such file"):
        petcomp.Scene.read(tmp_path / "none.toml")


def test_a_recipe_may_be_plain_data(recipe):
    document = petcomp.Pipeline(recipe).config
    document.pop("folder", None)
    one = petcomp.Pipeline(document, seed=3)[0]
    assert (one.image == petcomp.Pipeline(recipe, seed=3)[0].image).all()


def test_set_changes_a_value(recipe):
    pipeline = petcomp.Pipeline(recipe, set={"scene.objects": 1, "scene.image": [80, 60]})
    assert pipeline[0].size == (80, 60)
    assert len(pipeline[0].scene["objects"]) == 1


def test_set_changes_a_file_and_a_dict_alike(world, recipe):
    lit = world / "lit.toml"
    lit.write_text(recipe.read_text() + "[[scene.lights]]\n[[scene.lights]]\n")
    document = petcomp.Pipeline(lit).config
    for source in (lit, document):
        lights = petcomp.Pipeline(source, set={"scene.lights[1].power": 5}).config["scene"]["lights"]
        assert [light["power"] == lights[1]["power"] for light in lights] == [False, True]


def test_own_samples_become_a_dataset(tmp_path, program):
    def make(k):
        image = np.full((24, 32, 3), 40 * k, np.uint8)
        mask = np.zeros((24, 32), bool)
        mask[3 : 10 + k, 5:20] = True
        return petcomp.Sample.from_masks(image, [mask], [1], ["a", "b"])

    counts = petcomp.generate(make, 3, tmp_path / "set", classes=["a", "b"], labels={"formats": ["yolo", "coco"]})
    assert counts.images == 3 and counts.labelled == 3
    row = (tmp_path / "set/labels/val/000000.txt").read_text().split()
    assert row == ["1", "0.390625", "0.270833", "0.468750", "0.291667"]
    program("dataset", "check", tmp_path / "set")


def test_a_policy_of_the_samples_is_not_lost(recipe, tmp_path):
    changes = {"labels.obstructed": "keep", "labels.yolo.boxes": "visible"}
    pipeline = petcomp.Pipeline(recipe, set=changes)

    def make(folder, **labels):
        return petcomp.generate(lambda k: pipeline[k], 2, tmp_path / folder, classes=pipeline.classes, labels=labels)

    says = 'labels.obstructed: not given, so "drop", but sample 0 was made with "keep"'
    with pytest.raises(ValueError, match=says):
        make("a")
    with pytest.raises(ValueError, match='labels.yolo.boxes: not given, so "amodal"'):
        make("b", obstructed="keep")
    assert make("c", obstructed="drop", yolo={"boxes": "amodal"}).policy == "drop"
    make("d", obstructed="keep", yolo={"boxes": "visible"})
    petcomp.generate(recipe, 2, tmp_path / "e", set=changes)
    rows = [{path.name: path.read_text() for path in (tmp_path / f).glob("labels/*/*.txt")} for f in "de"]
    assert rows[0] == rows[1] and any(rows[0].values())


def test_classes_of_own_samples_are_those_of_the_dataset(tmp_path):
    def make(names):
        image, mask = np.zeros((24, 32, 3), np.uint8), np.ones((24, 32), bool)
        return lambda k: petcomp.Sample.from_masks(image, [mask], [0], names)

    says = r'classes: \["bottle", "can"\], but sample 0 has \["can", "bottle"\]'
    with pytest.raises(ValueError, match=says):
        petcomp.generate(make(["can", "bottle"]), 1, tmp_path / "wrong", classes=["bottle", "can"])
    assert petcomp.generate(make(["a", "b"]), 1, tmp_path / "set", classes=["a", "b"]).images == 1


def test_a_label_file_is_solved_as_by_the_program(tmp_path, program):
    for name in ("bg0000.jpg", "bg0000.label.json"):
        shutil.copy(SAMPLES / "backgrounds" / name, tmp_path)
    label = tmp_path / "bg0000.label.json"
    solution = petcomp.camera.solve(label)
    program("camera", "solve", label)
    written = label.with_name("bg0000.camera.json")
    assert solution.file == json.loads(written.read_text())
    assert petcomp.Camera.read(written) == solution.camera
    with pytest.raises(petcomp.errors.FileError, match="none.json"):
        petcomp.Camera.read(tmp_path / "none.json")


def test_shards_are_merged_to_the_whole(recipe, written, tmp_path, program):
    for i in (1, 2):
        petcomp.generate(recipe, COUNT, tmp_path / "parts", seed=5, shard=(i, 2))
    parts = sorted(path for path in (tmp_path / "parts").iterdir())
    program("dataset", "merge", *parts, "-o", tmp_path / "whole", "-q")
    ours, theirs = files_of(tmp_path / "whole"), files_of(written)
    assert {k: v for k, v in ours.items() if "/" in k} == {k: v for k, v in theirs.items() if "/" in k}
