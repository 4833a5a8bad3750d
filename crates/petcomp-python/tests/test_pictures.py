"""Keying, cut-outs, cameras, shots, evaluation: the library's answers in arrays."""

import json
import math
import os
import pickle
import shutil
import subprocess
import sys

import numpy as np
import petcomp
import pytest
from conftest import SAMPLES

GREEN = (0.1, 0.75, 0.2)
PHOTO = sorted((SAMPLES / "bottles").glob("*.png"))[0]


@pytest.fixture(scope="module")
def photo():
    return petcomp.io.read(PHOTO)


def test_a_pixel_is_keyed_as_in_the_documentation():
    photo = np.array([[[0.3, 0.55, 0.25]]], np.float32)
    keyed = petcomp.matte.key(photo, screen=GREEN)
    assert keyed.matte[0, 0] == np.float32(0.609068632)


def test_key_is_the_programs(photo, tmp_path, program):
    screen = ",".join(map(str, GREEN))
    program(
        "matte",
        "key",
        PHOTO,
        "--screen",
        screen,
        "--profile",
        "blender-4.5",
        "--set",
        "key.clip_black=0.1",
        "-o",
        tmp_path / "a.tif",
    )
    keyed = petcomp.matte.key(photo, screen=GREEN, profile="blender-4.5", clip_black=0.1)
    petcomp.io.write(tmp_path / "b.tif", keyed.cutout)
    assert (tmp_path / "a.tif").read_bytes() == (tmp_path / "b.tif").read_bytes()


def test_layouts_give_the_same_matte(photo):
    want = petcomp.matte.key(photo, screen=GREEN).matte
    turned = np.asfortranarray(photo)
    padded = np.zeros((photo.shape[0], photo.shape[1] + 3, 3), np.float32)
    padded[:, :-3] = photo
    flipped = photo[::-1].copy()[::-1]
    shifted = np.frombuffer(b"x" + photo.tobytes(), np.uint8)[1:].view(np.float32).reshape(photo.shape)
    assert not shifted.flags.aligned
    for other in (turned, padded[:, :-3], flipped, shifted, photo.astype(np.float32).copy()):
        assert (petcomp.matte.key(other, screen=GREEN).matte == want).all()


def test_a_contiguous_photo_is_not_copied(photo):
    import tracemalloc

    owners = photo.__array_interface__["data"][0]
    tracemalloc.start()
    petcomp.matte.key(photo, screen=GREEN)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # NumPy tells tracemalloc of its arrays: a copy would be photo.nbytes.
    assert peak < photo.nbytes / 4
    assert photo.__array_interface__["data"][0] == owners


def test_masks_are_not_copied():
    script = (
        "import numpy as np, petcomp\n"
        "image, mask = np.zeros((1000, 1000, 3), np.uint8), np.ones((1000, 1000), bool)\n"
        "make = lambda count: petcomp.Sample.from_masks(image, [mask] * count, [0] * count, ['a'])\n"
        "peak_kib = lambda: int(open('/proc/self/status').read().split('VmHWM:')[1].split()[0])\n"
        "make(1)\nbefore = peak_kib()\nmake(100)\nprint(peak_kib() - before)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    # Copies of 100 masks of 1 MB as numbers would be 400 MB.
    assert int(done.stdout) < 100 * 1000


def test_codes_are_decoded_as_files_are(tmp_path):
    random = np.random.default_rng(0)
    codes = random.integers(0, 256, (20, 30, 4), dtype=np.uint8)
    petcomp.io.write(tmp_path / "a.tif", codes)
    petcomp.io.write(tmp_path / "b.png", codes[..., :3].copy())
    linear = petcomp.io.read(tmp_path / "b.png")
    assert linear.shape == (20, 30, 3)
    screens = [petcomp.matte.key(image, screen=GREEN).matte for image in (linear, codes[..., :3])]
    assert (screens[0] == screens[1]).all()


def test_an_exr_loses_nothing(tmp_path):
    random = np.random.default_rng(0)
    for channels in (3, 4):
        light = random.uniform(0, 1, (5, 6, channels)).astype(np.float32)
        light[..., :3] *= 1e5
        petcomp.io.write(tmp_path / "a.EXR", light)
        assert (petcomp.io.read(tmp_path / "a.EXR", alpha=channels == 4) == light).all()


def test_a_plate_of_one_colour_is_that_colour(photo):
    plate = np.broadcast_to(np.array(GREEN, np.float32), photo.shape)
    assert np.allclose(
        petcomp.matte.key(photo, screen=plate).matte, petcomp.matte.key(photo, screen=GREEN).matte, atol=1e-6
    )


def test_a_pixel_of_the_photo_is_its_screen():
    codes = np.full((6, 8, 3), (60, 180, 70), np.uint8)
    codes[2:4] = (200, 60, 60)
    linear = petcomp.matte.key(codes, screen=(0.04518620, 0.45641103, 0.06124605)).matte
    assert np.allclose(petcomp.matte.key(codes, screen=codes[0, 0]).matte, linear, atol=1e-5)
    photo = np.full((6, 8, 3), GREEN, np.float32)
    assert (petcomp.matte.key(photo, screen=photo[0, 0]).matte == petcomp.matte.key(photo, screen=GREEN).matte).all()


def test_garbage_and_core_hold(photo):
    where = np.zeros(photo.shape[:2], bool)
    where[:50] = True
    assert (petcomp.matte.key(photo, screen=GREEN, garbage=where).matte[:50] == 0).all()
    assert (petcomp.matte.key(photo, screen=GREEN, core=where.astype(np.float32)).matte[:50] == 1).all()


def test_a_photo_is_cut_out(photo):
    cut = petcomp.matte.cut_out(photo)
    assert cut.rgba.shape[2] == 4 and cut.rgba.shape[:2] == cut.transmittance.shape[:2]
    assert cut.rgba[..., 3].max() > 0.5 and cut.hull.shape[1] == 2
    assert cut._repr_png_().startswith(b"\x89PNG")


def test_assets_are_built_as_by_the_program(world, tmp_path):
    steps = []
    built = petcomp.asset.build(world / "photos.csv", tmp_path / "assets", progress=lambda *s: steps.append(s))
    assert built.photos == 2 and built.classes == ["bottle"]
    assert steps[0] == (0, 2) and max(steps) == (2, 2)
    ours, theirs = tmp_path / "assets/assets.toml", world / "assets/assets.toml"
    assert ours.read_text() == theirs.read_text()
    assert petcomp.asset.list_folder(tmp_path / "assets")["classes"] == ["bottle"]
    assert built.unlisted == [] and built.rejected == 0
    head, first, *_ = (world / "photos.csv").read_text().splitlines()
    (tmp_path / "one.csv").write_text(f"{head}\n{first}\n")
    (left,) = petcomp.asset.build(tmp_path / "one.csv", tmp_path / "assets").unlisted
    assert left.startswith("bottle1/")
    shutil.copytree(world / "assets", tmp_path / "longer")
    (tmp_path / "other.csv").write_text(f"{head}\n{first.replace('0.25', '0.3')}\n")
    assert (tmp_path / "longer/contact_sheet.png").exists()
    petcomp.asset.build(tmp_path / "other.csv", tmp_path / "longer")
    assert not (tmp_path / "longer/contact_sheet.png").exists()


def test_a_rectangle_gives_its_camera():
    true = petcomp.Camera.look_at([0.1, -0.7, 0.8], [0, 0, 0], 800.0, [640, 480])
    corners = [[-0.3, 0.2, 0], [0.3, 0.2, 0], [0.3, -0.2, 0], [-0.3, -0.2, 0]]
    seen = true.project(corners)[:, :2]
    found = petcomp.Camera.from_rectangle(seen, [0.6, 0.4], [640, 480], focal_px=800.0)
    assert np.abs(found.project(corners)[:, :2] - seen).max() < 0.5
    assert abs(found.tilt - true.tilt) < math.radians(0.5)


def test_a_camera_projects_as_its_matrices_say():
    camera = petcomp.Camera.look_at([0.3, -0.7, 0.8], [0.1, 0, 0], 700.0, [640, 480])
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (50, 3))
    inside = np.c_[points, np.ones(50)] @ camera.camera_from_world.T[:, :3]
    pixels = inside @ camera.intrinsics.T
    seen = camera.project(points)
    assert np.allclose(seen[:, :2], pixels[:, :2] / pixels[:, 2:], atol=1e-9)
    assert np.allclose(seen[:, 2], inside[:, 2])
    ends = camera.center + camera.rays(seen[:, :2]) * seen[:, 2:]
    assert np.allclose(ends, points, atol=1e-9)
    assert np.isnan(camera.project([2 * camera.center - points[0]])).all()
    assert pickle.loads(pickle.dumps(camera)) == camera
    assert camera.resized([320, 240]).focal_px == (350.0, 350.0)


def test_rays_of_every_pixel_of_a_large_picture():
    camera = petcomp.Camera.looking_down(1.0, 1600.0, [2400, 2100])
    pixels = np.stack(np.meshgrid(np.arange(2400) + 0.5, np.arange(2100) + 0.5), axis=-1).reshape(-1, 2)
    rays = camera.rays(pixels)
    assert rays.shape == (2400 * 2100, 3) and rays.dtype == np.float64
    ends = camera.center + rays[::99999] * 1.5
    assert np.allclose(camera.project(ends[::-1])[::-1, :2], pixels[::99999])
    assert camera.project(np.zeros((0, 3))).shape == (0, 3)


def shot(**fields):
    film = np.zeros((8, 8, 4), np.float32)
    film[:] = [0.3, 0.05, 0.05, 0.5]
    camera = petcomp.Camera.looking_down(1.0, 80.0, [64, 48])
    card = petcomp.Card(id=1, texture=film, size=(0.2, 0.1), position=(0, 0, 0.05))
    plate = np.full((48, 64, 3), 0.5, np.float32)
    return petcomp.Shot(camera, **fields).with_plate(plate).with_card(card).with_ambient(1.0)


def test_a_shot_is_rendered_and_labelled():
    sample = petcomp.render(shot())
    red, green = sample.image_linear[24, 32, :2]
    # Film of 0.3 over a plate of 0.5 that it half hides, in its own shadow.
    assert 0.3 < red < 0.3 + 0.25 + 1e-6 and red > green
    pixels = 80.0 / 0.95
    want = [32 - 0.1 * pixels, 24 - 0.05 * pixels, 32 + 0.1 * pixels, 24 + 0.05 * pixels]
    assert np.abs(sample.boxes[0] - want).max() < 1.0
    assert abs(sample.depth[24, 32] - 0.95) < 1e-6 and sample.ids[24, 32] == 1
    assert sample.scene is None and "Sample(64 x 48, 1 labels)" == repr(sample)


def test_ids_of_masks_are_those_of_the_last_one_there():
    masks = np.zeros((2, 3, 4), bool)
    masks[0, :2, :3] = masks[1, 1:, 1:] = True
    sample = petcomp.Sample.from_masks(np.zeros((3, 4, 3), np.uint8), list(masks), [0, 0], ["a"])
    assert sample.ids.tolist() == [[1, 1, 1, 0], [1, 2, 2, 2], [0, 2, 2, 2]]
    assert np.isinf(sample.depth).all()


def test_masks_behind_others_are_hidden_there():
    masks = np.zeros((3, 3, 4), bool)
    masks[0, 1, 1] = masks[1, :2, :3] = masks[2, 1:, 1:] = True
    sample = petcomp.Sample.from_masks(np.zeros((3, 4, 3), np.uint8), list(masks), [0, 0, 0], ["a"])
    shares = [found["visible_fraction"] for found in sample.labels["objects"]]
    assert np.allclose(shares, [0, 4 / 6, 1])
    for found in sample.labels["objects"]:
        box = [found["visible_box"][edge] for edge in ("x0", "y0", "x1", "y1")]
        seen = np.argwhere(sample.ids == found["id"])
        assert seen.size == 0 or box == [*seen.min(0)[::-1], *(seen.max(0) + 1)[::-1]]


def test_masks_behind_others_are_obstructed(tmp_path):
    masks = np.zeros((3, 12, 16), bool)
    masks[0, 1:6, 1:9] = masks[1, 5:11, 8:15] = masks[2, 8:11, 1:6] = True
    sample = petcomp.Sample.from_masks(np.zeros((12, 16, 3), np.uint8), list(masks), [0, 1, 0], ["a", "b"])
    assert [found["covered_by"] for found in sample.labels["objects"]] == [[2], [], []]
    assert sample.classes.tolist() == [0, 1, 0]

    def written(obstructed):
        """Class and whether ignored in COCO, and the classes in YOLO."""
        labels = {"formats": ["yolo", "coco"], "obstructed": obstructed}
        folder, all_train = tmp_path / obstructed, {"val_percent": 0}
        petcomp.generate(lambda k: sample, 1, folder, classes=["a", "b"], labels=labels, split=all_train)
        coco = json.loads((folder / "annotations/instances_train.json").read_text())
        first = coco["categories"][0]["id"]
        found = [(one["category_id"] - first, one["iscrowd"]) for one in coco["annotations"]]
        rows = (folder / "labels/train/000000.txt").read_text().splitlines()
        return sorted(found), sorted(int(row.split()[0]) for row in rows)

    assert written("drop") == ([(0, 0), (1, 0)], [0, 1])
    assert written("keep") == ([(0, 0), (0, 0), (1, 0)], [0, 0, 1])
    assert written("ignore") == ([(0, 0), (0, 1), (1, 0)], [0, 1])
    assert written("class") == ([(0, 0), (1, 0), (2, 0)], [0, 1, 2])


def test_a_card_above_covers_the_one_below():
    two = shot().with_card(
        petcomp.Card(id=2, texture=np.full((4, 4, 3), 200, np.uint8), size=(0.2, 0.1), position=(0, 0, 0.1))
    )
    sample = petcomp.render(two)
    assert sample.object_ids.tolist() == [2]
    kept = petcomp.render(petcomp.Shot(**{**vars(two), "labels": {"obstructed": "keep"}}))
    assert kept.object_ids.tolist() == [1, 2]
    assert kept.labels["objects"][0]["covered_by"] == [2]
    apart = petcomp.render(petcomp.Shot(**{**vars(two), "labels": {"obstructed": "class"}}))
    assert apart.class_names == ["object", "obstructed"] and apart.classes.tolist() == [1, 0]


def test_evaluation_in_memory_is_that_of_files(tmp_path, program):
    random = np.random.default_rng(0)
    truth, found = [], []
    for folder in ("truth", "found/labels"):
        (tmp_path / folder).mkdir(parents=True)
    for i in range(6):
        corner = random.uniform(0, 50, (3, 2))
        boxes = np.c_[corner, corner + random.uniform(10, 40, (3, 2))]
        moved = boxes + random.uniform(-3, 3, (3, 1))
        classes, scores = random.integers(0, 2, 3), random.uniform(0.3, 1, 3)
        write(tmp_path / f"truth/{i:06}.txt", classes, boxes)
        write(tmp_path / f"found/labels/{i:06}.txt", classes, moved, scores)
        truth.append({"boxes": boxes, "classes": classes})
        found.append({"boxes": moved, "classes": classes, "scores": scores})
    labels = tmp_path / "found/labels"
    files = petcomp.evaluate(labels, tmp_path / "truth", size=(100, 100), output=tmp_path / "page")
    program("eval", labels, tmp_path / "truth", "--size", "100x100", "-o", tmp_path / "theirs")
    metrics = json.loads((tmp_path / "theirs/metrics.json").read_text())
    assert files.to_dict() == (metrics[0] if isinstance(metrics, list) else metrics)
    assert (tmp_path / "page/eval.html").exists()
    (tmp_path / "photos").mkdir()
    for i in range(6):
        petcomp.io.write(tmp_path / f"photos/{i:06}.png", np.zeros((100, 100, 3), np.uint8))
    assert petcomp.evaluate(labels, tmp_path / "truth", images=tmp_path / "photos").map == files.map
    memory = petcomp.evaluate(found, truth)
    assert abs(memory.map - files.map) < 1e-3 and 0 < memory.map < 1
    for few in (petcomp.evaluate(found, truth, rounds=39), petcomp.evaluate(found[:1], truth[:1])):
        assert few.interval is None and few.to_dict()["map"] == {"value": few.map}
    assert memory.interval[0] <= memory.map <= memory.interval[1] and len(memory.by_class) == 2


def test_what_is_to_be_ignored_is_neither_found_nor_missed():
    truth = {"boxes": [[0, 0, 10, 10], [20, 20, 40, 40]], "classes": [0, 0], "ignored": np.array([False, True])}
    alone = {"boxes": [[0, 0, 10, 10]], "classes": [0]}
    found = {**alone, "scores": [0.9]}
    assert petcomp.evaluate([found], [truth]).map == petcomp.evaluate([found], [alone]).map


def test_each_object_is_labelled_obstructed_or_left_out():
    images = dict(asked=1, images=1, val=0, made=1, counted=1, knotted=0, retries=0, classes=[], for_trainers=[])
    for policy, labelled in (("drop", 5), ("ignore", 5), ("keep", 8), ("class", 8)):
        counts = petcomp.DatasetCounts(objects=10, labelled=labelled, obstructed=3, policy=policy, **images)
        assert counts.left_out == 2


def write(path, classes, boxes, scores=None):
    rows = []
    for i, (number, (x0, y0, x1, y1)) in enumerate(zip(classes, boxes)):
        row = f"{number} {(x0 + x1) / 200:.9f} {(y0 + y1) / 200:.9f} {(x1 - x0) / 100:.9f} {(y1 - y0) / 100:.9f}"
        rows.append(row if scores is None else f"{row} {scores[i]:.9f}")
    path.write_text("\n".join(rows) + "\n")


def test_notebooks_see_pictures_and_tables(recipe):
    sample = petcomp.Pipeline(recipe)[0]
    assert sample._repr_png_().startswith(b"\x89PNG")
    assert "<img" in sample._repr_html_() and "<table>" in sample._repr_html_()
    assert "focal length" in petcomp.Camera.looking_down(1, 80, [64, 48])._repr_html_()
    keyed = petcomp.matte.key(np.full((4, 4, 3), 0.5, np.float32), screen=GREEN)
    assert keyed._repr_png_().startswith(b"\x89PNG") and keyed._repr_html_().count("<img") == 2


def test_a_png_for_notebooks_is_the_picture(tmp_path):
    from petcomp._show import png

    codes = np.random.default_rng(0).integers(0, 256, (7, 5, 3), dtype=np.uint8)
    (tmp_path / "a.png").write_bytes(png(codes))
    petcomp.io.write(tmp_path / "b.png", codes)
    assert (petcomp.io.read(tmp_path / "a.png") == petcomp.io.read(tmp_path / "b.png")).all()


def test_a_recipe_is_laid_over_its_preset_in_a_file_and_in_a_dict(world, recipe):
    preset = world / "preset.toml"
    preset.write_text('preset = "real"\n' + recipe.read_text())
    plain = petcomp.Pipeline(recipe).config
    folders = {name: os.path.abspath(plain[name]) for name in ("assets", "backgrounds")}
    data = {"preset": "real", "scene": {"image": [160, 120], "objects": [2, 3]}}
    of_file = petcomp.Pipeline(preset).config["scene"]
    assert of_file == petcomp.Pipeline(data | folders).config["scene"]
    assert of_file["lights"] == [] != plain["scene"]["lights"]
