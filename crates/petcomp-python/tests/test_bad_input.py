"""Whatever comes in: an answer or a clear exception, never a crash."""

import json
import logging
import math
import os
import random
import re
from pathlib import Path

import numpy as np
import petcomp
import pytest
from petcomp import errors

GREEN = (0.1, 0.75, 0.2)
PHOTO = np.full((6, 8, 3), 0.3, np.float32)

#: So many random calls; CI makes a tenth, `PETCOMP_CALLS=100000` all.
CALLS = int(os.environ.get("PETCOMP_CALLS", "10000"))


def key(image, screen=GREEN, **options):
    return petcomp.matte.key(image, screen=screen, **options)


@pytest.mark.parametrize(
    ("image", "kind", "says"),
    [
        (PHOTO.astype(np.float64), TypeError, "image: dtype float64, expected float32 (scene-linear) or uint8 (sRGB)"),
        (PHOTO.astype(">f4"), TypeError, "image: dtype >f4"),
        (PHOTO.astype(np.complex64), TypeError, "image: dtype complex64"),
        (PHOTO.astype(object), TypeError, "image: dtype object"),
        (np.zeros((4, 4, 3), "U3"), TypeError, "image: dtype <U3"),
        ([[[0.1, 0.2, 0.3]]], TypeError, "image: <class 'list'>, expected a NumPy array"),
        (None, TypeError, "image: <class 'NoneType'>"),
        (PHOTO[..., 0], ValueError, "image: shape [6, 8], expected (height, width, 3) or (height, width, 4)"),
        (PHOTO[..., :2], ValueError, "image: shape [6, 8, 2]"),
        (PHOTO[None], ValueError, "image: shape [1, 6, 8, 3]"),
        (PHOTO[:0], ValueError, "image: 8 x 0 pixels, expected at least 1 x 1"),
        (np.float32(1), TypeError, "image: <class 'numpy.float32'>"),
        (np.broadcast_to(np.float32(0.5), (10**6, 10**6, 3)), ValueError, "image: 1000000 x 1000000 pixels"),
        (np.broadcast_to(np.float32(0.5), (32768, 32768, 3)), ValueError, "at most 32768 a side and 134217728 in total"),
    ],
)
def test_a_wrong_array_is_named(image, kind, says):
    with pytest.raises(kind) as raised:
        key(image)
    assert says in str(raised.value)
    assert isinstance(raised.value, petcomp.Error) and raised.value.at == "image"


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_none_is_named_by_its_place(bad):
    photo = PHOTO.copy()
    photo[2, 5, 1] = bad
    with pytest.raises(ValueError, match="image: not finite in column 5, row 2"):
        key(photo)
    with pytest.raises(ValueError, match="screen: "):
        key(PHOTO, screen=(0.1, bad, 0.2))


def test_sizes_that_do_not_fit_are_named():
    with pytest.raises(ValueError, match="garbage"):
        key(PHOTO, garbage=np.zeros((5, 8), bool))
    with pytest.raises(ValueError, match="core: 2 at column 0, row 0, expected 0 to 1"):
        key(PHOTO, core=np.full((6, 8), 2, np.float32))
    with pytest.raises(ValueError, match="^screen: 8 x 5 pixels, expected the photo's 8 x 6"):
        key(PHOTO, screen=np.zeros((5, 8, 3), np.float32))
    with pytest.raises(ValueError, match="^screen: no pixel's "):
        key(PHOTO, screen=PHOTO, profile="robust")
    with pytest.raises(TypeError, match="screen: expected three numbers"):
        key(PHOTO, screen="green")
    with pytest.raises(TypeError, match="screen: dtype float64"):
        key(PHOTO, screen=np.array(GREEN))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"clip_black": 2.0}, "key.clip_black: 2, expected 0 to 1"),
        ({"clip_blak": 0.1}, 'options: unknown key "clip_blak", did you mean "clip_black"?'),
        ({"profile": "blender-9"}, "unknown variant `blender-9`"),
        ({"blur_pre": -1}, "options.blur_pre: invalid value: integer `-1`"),
        ({"clip_black": math.nan}, "options.clip_black: nan, expected a finite number"),
    ],
)
def test_a_wrong_option_is_named(options, says):
    with pytest.raises(ValueError, match=re.escape(says)):
        key(PHOTO, **options)


def test_a_wrong_value_in_a_document_is_named_with_its_place():
    scene = {**SCENE, "lights": [{**SCENE["lights"][0], "power": "x"}]}
    for make, document, says in (
        (petcomp.Scene.from_dict, scene, "scene.lights[0].power: invalid type: string"),
        (petcomp.Scene.from_dict, {**SCENE, "lihgts": []}, 'scene: unknown key "lihgts", did you mean "lights"?'),
        (petcomp.Camera.from_dict, {}, "camera: missing key"),
    ):
        with pytest.raises(errors.InvalidValueError, match="^" + re.escape(says)):
            make(document)


def test_every_kind_of_error_has_its_class(tmp_path):
    with pytest.raises(errors.FileError, match="no such file") as raised:
        petcomp.Pipeline(tmp_path / "none.toml")
    assert raised.value.path == str(tmp_path / "none.toml") and isinstance(raised.value, OSError)
    (tmp_path / "bad.toml").write_text("[scene]\nobject = 3\n")
    with pytest.raises(petcomp.Error, match='did you mean "objects"'):
        petcomp.Pipeline(tmp_path / "bad.toml")
    (tmp_path / "bad.toml").write_text("[render]\nsubsamples = 0\n")
    with pytest.raises(errors.FieldError, match="render.subsamples: 0") as raised:
        petcomp.Pipeline(tmp_path / "bad.toml")
    assert raised.value.at == "render.subsamples" and isinstance(raised.value, ValueError)
    with pytest.raises(errors.PhotoError, match="^no cut-out: "):
        petcomp.matte.cut_out(np.full((64, 64, 3), 0.3, np.float32))
    with pytest.raises(errors.CameraError) as raised:
        petcomp.Camera.from_rectangle([[0, 0], [1, 1], [2, 2], [3, 3]], [0.6, 0.4], [640, 480])
    assert raised.value.at == "surface.corners_px" and raised.value.what in str(raised.value)
    with pytest.raises(errors.InvalidValueError):
        petcomp.Scene(image=[0, 0], surface={"size": [1, 1]}, camera=petcomp.Camera.looking_down(1, 80, [64, 48]))


def test_the_sentence_is_the_programs(tmp_path):
    import subprocess
    import sys

    recipe = tmp_path / "recipe.toml"
    recipe.write_text("[scene]\nobjects = -1\n")
    words = [sys.executable, "-m", "petcomp", "dataset", "generate", recipe, "-n", "1", "-o", tmp_path / "set"]
    theirs = subprocess.run(words, capture_output=True, text=True).stderr
    with pytest.raises(petcomp.Error) as raised:
        petcomp.Pipeline(recipe)
    assert theirs == f"error: {raised.value}\n"


def test_errors_travel_between_processes():
    import pickle

    with pytest.raises(petcomp.Error) as raised:
        key(PHOTO, clip_black=2.0)
    again = pickle.loads(pickle.dumps(raised.value))
    assert type(again) is type(raised.value) and str(again) == str(raised.value) and again.at == "key.clip_black"


@pytest.mark.parametrize("k", [-1, 2**64, 1.5, "0", None])
def test_a_number_of_a_sample_is_a_whole_one(recipe, k):
    with pytest.raises((ValueError, TypeError), match="^k: "):
        petcomp.Pipeline(recipe)[k]


def test_the_last_sample_is_one_like_others(recipe):
    assert petcomp.Pipeline(recipe)[2**64 - 1].size == (160, 120)


def test_a_pipeline_is_not_iterated(recipe):
    with pytest.raises(TypeError):
        iter(petcomp.Pipeline(recipe))


def test_a_shot_that_cannot_be_is_refused():
    camera = petcomp.Camera.looking_down(1.0, 80.0, [64, 48])
    film = np.zeros((4, 4, 4), np.float32)
    card = petcomp.Card(1, film, (0.2, 0.1))
    good = petcomp.Shot(camera).with_card(card)
    assert petcomp.render(good).size == (64, 48)
    bad = [
        (good.with_card(card), "a unique id above 0"),
        (petcomp.Shot(camera).with_card(petcomp.Card(0, film, (0.2, 0.1))), "a unique id above 0"),
        (petcomp.Shot(camera).with_card(petcomp.Card(1, film, (0.0, 0.1))), r"cards\[0\].size"),
        (petcomp.Shot(camera).with_card(petcomp.Card(1, film + 2, (0.2, 0.1))), "alpha 2"),
        (petcomp.Shot(camera).with_card(petcomp.Card(1, film, (0.2, 0.1), class_=3)), "class 3"),
        (petcomp.Shot(camera).with_card(petcomp.Card(1, film, (0.2, 0.1), rotation=np.ones((3, 3)))), "rotation"),
        (petcomp.Shot(camera).with_card(petcomp.Card(1, film, (0.2, 0.1), position=(0, 0, math.nan))), "position"),
        (good.with_plate(np.zeros((5, 5, 3), np.float32)), "plate: 5 x 5 pixels"),
        (good.with_light({"position": [0, 0, 1], "size": [1, 1], "power": -1}), r"lights\[0\].power"),
        (good.with_light({"position": [0, 0, 1], "size": [1, 1]}), r'shot.lights\[0\]: missing key "power"'),
        (petcomp.Shot(camera, exposure=math.nan), "exposure: nan"),
        (petcomp.Shot(camera, options={"subsamples": 10**6}), "render.subsamples"),
    ]
    for shot, says in bad:
        with pytest.raises((ValueError, TypeError), match=says):
            petcomp.render(shot)


def test_alpha_that_cannot_be_is_refused(tmp_path):
    image = np.full((4, 4, 4), 0.5, np.float32)
    image[1, 2, 3] = 2
    with pytest.raises(errors.InvalidValueError, match="^image: alpha 2 in column 2, row 1, expected 0 to 1"):
        petcomp.Sample.from_masks(image, [], [], ["a"])
    image[1, 2, 3] = 1
    sample = petcomp.Sample.from_masks(image, [], [], ["a"])
    sample.image_linear[3, 0, 3] = -1
    with pytest.raises(errors.InvalidValueError, match="^image_linear: alpha -1 in column 0, row 3"):
        petcomp.generate(lambda k: sample, 1, tmp_path / "set", classes=["a"])
    image[1, 2, 3] = np.nextafter(np.float32(1), np.float32(2))
    petcomp.io.write(tmp_path / "rounded.exr", image)
    petcomp.Sample.from_masks(image, [], [], ["a"])


def test_a_texture_seen_edge_on_or_from_behind_is_fine():
    camera = petcomp.Camera.looking_down(1.0, 80.0, [64, 48])
    film = np.full((4, 4, 4), 0.5, np.float32)
    for turn in (math.pi / 2, math.pi, 0.3):
        petcomp.render(petcomp.Shot(camera).with_card(petcomp.Card(1, film, (0.2, 0.1), rotation=(turn, 0, 0)))).image
    high = petcomp.Card(1, film, (0.2, 0.1), position=(0, 0, 5.0))
    assert len(petcomp.render(petcomp.Shot(camera).with_card(high))) == 0


def test_cameras_that_cannot_be_are_refused():
    for make in (
        lambda: petcomp.Camera.looking_down(math.nan, 80, [64, 48]),
        lambda: petcomp.Camera.looking_down(0, 80, [64, 48]),
        lambda: petcomp.Camera.looking_down(1, -80, [64, 48]),
        lambda: petcomp.Camera.looking_down(1, 80, [0, 48]),
        lambda: petcomp.Camera.looking_down(1, 80, [10**9, 10**9]),
        lambda: petcomp.Camera.look_at([0, 0, 1], [0, 0, 1], 80, [64, 48]),
        lambda: petcomp.Camera.from_dict({}),
        lambda: petcomp.Camera.from_rectangle([[0, 0]], [1, 1], [640, 480]),
        lambda: petcomp.Camera.from_rectangle([[0, 0], [9, 0], [9, 9], [0, 9]], [-1, 1], [640, 480]),
        lambda: petcomp.Camera("camera"),
    ):
        with pytest.raises((ValueError, TypeError, errors.CameraError)):
            make()


def test_no_camera_looks_down_from_below_the_surface():
    with pytest.raises(errors.InvalidValueError, match=re.escape("height: -1, expected above 0 (metres)")):
        petcomp.Camera.looking_down(-1, 80, [64, 48])


def test_a_number_out_of_range_is_an_error_of_petcomp():
    with pytest.raises(errors.InvalidValueError, match="^threads: -1, expected 0 or more"):
        petcomp.set_threads(-1)
    for size, expected in (
        ((2**40, 48), "two whole numbers from 1 to 2147483648"),
        (("640", "480"), "numbers of shape"),
        (np.array(["640", "480"], dtype=object), "numbers of shape"),
        ((10**400, 48), "numbers of shape"),
    ):
        with pytest.raises(errors.InvalidValueError, match=f"^size: .*, expected {expected}"):
            petcomp.evaluate("none.json", "none", size=size)


def test_a_wrong_type_is_a_type_error(recipe):
    for use in (
        lambda: petcomp.set_threads("1"),
        lambda: petcomp.Pipeline(recipe, quality=3),
        lambda: petcomp.Camera.looking_down("1", 80, [64, 48]),
        lambda: petcomp.io.read("none.png", 3),
    ):
        with pytest.raises(TypeError):
            use()


def test_a_mask_of_an_array_is_not_lost():
    def masked(array):
        return np.ma.masked_array(array, np.zeros_like(array, bool))

    camera, plain = petcomp.Camera.looking_down(1, 80, [64, 48]), np.zeros((6, 8), bool)
    boxes = {"boxes": masked(np.zeros((1, 4))), "classes": [0]}
    for at, use in (
        ("image", lambda: key(masked(PHOTO))),
        ("screen", lambda: key(PHOTO, screen=masked(np.float32(GREEN)))),
        ("garbage", lambda: key(PHOTO, garbage=masked(plain))),
        ("masks", lambda: petcomp.Sample.from_masks(PHOTO, [masked(plain)], [0], ["a"])),
        ("points", lambda: camera.project(masked(np.zeros((1, 3))))),
        ("truth[0].boxes", lambda: petcomp.evaluate([{**boxes, "scores": [1]}], [boxes])),
        ("scene.image", lambda: petcomp.Scene.from_dict({"image": masked(np.array([8, 6]))})),
    ):
        with pytest.raises(errors.ArgumentTypeError, match=re.escape(f"{at}: a masked array, expected a plain one")):
            use()


def test_a_rectangle_in_millimetres_is_no_rectangle_in_metres():
    corners = [[236, 239], [1020, 216], [1009, 701], [276, 739]]
    for unit, says in ((1000, "^surface.width_m: 560"), (80, "the camera would be .* m away")):
        with pytest.raises(errors.InvalidValueError, match=says):
            petcomp.Camera.from_rectangle(corners, [0.56 * unit, 0.37 * unit], [1280, 853])


def test_a_lens_that_folds_the_picture_over_needs_force():
    corners = [[235.8, 239.2], [1019.7, 215.7], [1008.9, 701.2], [275.6, 738.8]]
    label = {
        "format": "plane-label",
        "version": 1,
        "image": {"file": "", "width": 1280, "height": 960, "cropped": False},
        "surface": {"id": "tray", "width_m": 0.56, "height_m": 0.37, "corners_px": corners},
        "camera": {"k1": -5},
    }
    with pytest.raises(errors.InvalidValueError, match="^camera.k1: -5, expected at least -1.4"):
        petcomp.camera.solve(label)
    assert petcomp.camera.solve(label, force=True).camera.image == (1280, 960)


def test_what_a_function_would_not_hear_is_refused(tmp_path):
    sample = petcomp.Sample.from_masks(np.zeros((4, 4, 3), np.uint8), [np.ones((4, 4), bool)], [0], ["a"])
    for arguments, says in (
        ({"set": {"scene.objects": 3}}, "set, quality: apply only to recipes"),
        ({"quality": "draft"}, "set, quality: apply only to recipes"),
        ({"labels": {"min_visible": 0.5}}, "labels.min_visible: acts when labels are made"),
        ({"labels": {"alpha_threshold": 0.5}}, "labels.alpha_threshold: acts when labels are made"),
        ({"labels": {"formats": ["webdataset"]}}, "labels.formats: only webdataset"),
    ):
        with pytest.raises(errors.InvalidValueError, match=says):
            petcomp.generate(lambda k: sample, 1, tmp_path / "set", classes=["a"], **arguments)
    layers = {"formats": ["layers"]}
    with pytest.raises(errors.InvalidValueError, match='labels.formats: "layers", but the sample was not rendered'):
        petcomp.generate(lambda k: sample, 1, tmp_path / "layers", classes=["a"], labels=layers)
    both = {"formats": ["voc", "webdataset"]}
    assert petcomp.generate(lambda k: sample, 1, tmp_path / "both", classes=["a"], labels=both).labelled == 1


def test_samples_that_cannot_be_are_refused():
    image, mask = np.zeros((12, 12, 3), np.uint8), np.ones((12, 12), bool)
    make = petcomp.Sample.from_masks
    for arguments in (
        (image, [mask], [1], ["a"]),
        (image, [mask], [0, 0], ["a"]),
        (image, [mask[:5]], [0], ["a"]),
        (image, [mask], [-1], ["a"]),
        (image, [mask.astype(np.int64)], [0], ["a"]),
        (image.astype(np.int8), [mask], [0], ["a"]),
    ):
        with pytest.raises((ValueError, TypeError)):
            make(*arguments)
    assert len(make(image, [], [], [])) == 0
    nothing = make(image, [~mask], [0], ["a"])
    assert len(nothing) == 0 and nothing.boxes.shape == (0, 4)


def test_evaluation_of_what_cannot_be_is_refused():
    truth = {"boxes": [[0, 0, 5, 5]], "classes": [0]}
    found = {**truth, "scores": [0.5]}
    two = {"boxes": np.zeros((4, 2)), "classes": [0, 0], "scores": [1, 1]}
    assert petcomp.evaluate([found], [truth]).map > 0.9
    for predictions, theirs, says in (
        ([found], [], "1 images, but the truth has 0"),
        ("folder", [truth], "expected a path or a list"),
        ([{**found, "boxes": [[5, 0, 0, 5]]}], [truth], "expected x0 <= x1"),
        ([{**found, "scores": [math.nan]}], [truth], "scores: NaN"),
        ([{**found, "scores": np.array([0.9 + 1j])}], [truth], "scores: not real numbers"),
        ([{**found, "scores": ["0.9"]}], [truth], "scores: not real numbers"),
        ([{**found, "scores": [10**400]}], [truth], "scores: .*expected numbers"),
        ([{**found, "scores": [87.5]}], [truth], "scores: 87.5, expected a confidence, 0 to 1"),
        ([{**found, "boxes": [[0, 0, math.inf, 5]]}], [truth], "expected x0 <= x1"),
        ([{**found, "classes": [-1]}], [truth], "classes: -1, expected whole numbers"),
        ([{**found, "classes": [0.9]}], [truth], "classes: 0.9, expected whole numbers"),
        ([two], [truth], r"boxes: shape \(4, 2\), expected \(n, 4\)"),
        ([{"boxes": []}], [truth], "scores: missing"),
        ([found], [{**truth, "iscrowd": [1]}], "unknown key 'iscrowd'"),
        ([found], [found], r"truth\[0\]: unknown key 'scores', expected boxes, classes and ignored"),
        ([{**found, "ignored": [0]}], [truth], r"predictions\[0\]: unknown key 'ignored'"),
        ([found], [{**truth, "ignored": [0.5]}], "ignored: 0.5"),
        ([found], [{**truth, "ignored": [False, True]}], "one number for each of 1 boxes"),
        (3, [truth], "expected a path or a list"),
    ):
        with pytest.raises((ValueError, TypeError), match=says):
            petcomp.evaluate(predictions, theirs)
    for argument in ({"output": "folder"}, {"size": (9, 9)}, {"rounds": 10**9}):
        with pytest.raises(errors.InvalidValueError, match=next(iter(argument))):
            petcomp.evaluate([found], [truth], **argument)


def test_evaluation_of_files_takes_nothing_in_vain(tmp_path, monkeypatch, caplog):
    monkeypatch.chdir(tmp_path)
    Path("truth.json").write_text('{"images": [{"id": 1, "file_name": "a.png"}], "annotations": [], "categories": []}')
    Path("metrics.json").write_text("[]")
    for options, says in (
        ({"output": "."}, "metrics.json: is an input and would be overwritten"),
        ({"size": (64, 48)}, "size: given without a folder of YOLO labels"),
        ({"output": "s3://bucket/page"}, "output: s3://bucket/page is a URL, expected a folder"),
    ):
        with pytest.raises(petcomp.Error, match=says):
            petcomp.evaluate("metrics.json", "truth.json", **options)
    assert Path("metrics.json").read_text() == "[]"
    caplog.set_level(logging.WARNING, logger="petcomp")
    petcomp.evaluate("metrics.json", "truth.json")
    assert "truth.json: no object" in caplog.text


def test_assets_go_into_a_folder(world):
    with pytest.raises(errors.InvalidValueError, match="folder: s3://bucket/assets is a URL, expected a folder"):
        petcomp.asset.build(world / "photos.csv", "s3://bucket/assets")


@pytest.mark.parametrize("classes", [[""], [" a "], ["a\nb"], ["\x01"], ["x" * 121]])
def test_class_names_fit_every_format(tmp_path, classes):
    sample = petcomp.Sample.from_masks(np.zeros((4, 4, 3), np.uint8), [], [], ["a"])
    for use in (
        lambda: petcomp.generate(lambda k: sample, 1, tmp_path / "set", classes=classes),
        lambda: petcomp.Sample.from_masks(np.zeros((4, 4, 3), np.uint8), [], [], classes),
    ):
        with pytest.raises(errors.InvalidValueError, match="^classes: .*expected a name on one line") as refused:
            use()
        assert refused.value.at == "classes" and refused.value.what.endswith("spaces")


@pytest.mark.parametrize("classes", ["bottle", ["a", "a"], ["a", 1], 3])
def test_classes_are_names_of_their_own(tmp_path, classes):
    sample = petcomp.Sample.from_masks(np.zeros((4, 4, 3), np.uint8), [], [], ["a"])
    shot = petcomp.Shot(petcomp.Camera.looking_down(1.0, 80.0, [16, 12]), classes=classes)
    for use in (
        lambda: petcomp.generate(lambda k: sample, 1, tmp_path / "set", classes=classes),
        lambda: petcomp.Sample.from_masks(np.zeros((4, 4, 3), np.uint8), [], [], classes),
        lambda: petcomp.evaluate([], [], classes=classes),
        lambda: petcomp.render(shot),
    ):
        with pytest.raises((errors.ArgumentTypeError, errors.InvalidValueError), match="^classes: "):
            use()


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({5: 1}, "set: key 5, expected text"),
        ({"a=b": 1}, "set: key 'a=b'"),
        ({"scene.objects": None}, "set.scene.objects: None"),
        ({"scene.image[7]": 1}, "no such entry in the list"),
        ({"scene.image.x": 1}, "leads through a value that is not a table"),
        ({"assets": "/nowhere/\U0001f600"}, "/nowhere/\U0001f600/assets.toml: no such file"),
        ([1], "set: list, expected a dict"),
    ],
)
def test_a_change_of_a_file_and_of_a_dict_is_refused_alike(recipe, changes, says):
    document = petcomp.Pipeline(recipe).config
    for source in (recipe, document):
        with pytest.raises(petcomp.Error, match=re.escape(says)):
            petcomp.Pipeline(source, set=changes)


#: What a random call is made of.
VALUES = [
    None,
    True,
    0,
    -1,
    3,
    2**63,
    2**64,
    10**30,
    0.5,
    -0.0,
    math.nan,
    math.inf,
    1e300,
    "",
    "a",
    "robust",
    "\0",
    "ü" * 50,
    b"x",
    [],
    [1],
    [1, 2],
    [1.0, 2.0, 3.0],
    [[0, 0], [9, 1], [8, 9], [1, 8]],
    (),
    (0.1, 0.7, 0.2),
    {},
    {"size": [1, 1]},
    {"known": 3},
    {"a": {"b": [1, None]}},
    {1: 2},
    object(),
    np.float32(1),
    np.int64(3),
    np.array(3.0),
    PHOTO,
    PHOTO[:1, :1],
    PHOTO[::-1],
    PHOTO[..., :1],
    PHOTO.astype(np.uint8),
    PHOTO.astype(np.float64),
    PHOTO.T,
    np.zeros((0, 3, 3), np.float32),
    np.zeros((3, 4), bool),
    np.zeros((6, 8), np.float32),
    np.full((6, 8, 4), np.nan, np.float32),
    np.zeros((6, 8, 4), np.uint8),
    np.zeros(3),
    np.zeros((2, 3)),
    np.array(["a"]),
    np.array([object()]),
    np.broadcast_to(np.float32(1), (70000, 70000, 3)),
    np.lib.stride_tricks.as_strided(PHOTO, (2, 2, 3), (0, 4, 0)),
    lambda *a: None,
    range(3),
    set(),
    iter([]),
    float,
    petcomp,
]


def callables(recipe, folder):
    pipeline = petcomp.Pipeline(recipe, set={"scene.image": [64, 48], "scene.objects": 1})
    closed = petcomp.Pipeline(recipe)
    closed.close()
    camera = petcomp.Camera.looking_down(1.0, 80.0, [16, 12])
    sample = petcomp.render(petcomp.Shot(camera))
    return [
        (
            petcomp.matte.key,
            ["image", "screen", "profile", "garbage", "core", "clip_black", "blur_pre", "feather_distance"],
        ),
        (petcomp.matte.cut_out, ["image", "empty", "method", "margin_px", "segment"]),
        (petcomp.Camera.from_rectangle, ["corners", "size", "image", "focal_px"]),
        (petcomp.Camera.looking_down, ["height", "focal_px", "image"]),
        (petcomp.Camera.look_at, ["eye", "target", "focal_px", "image"]),
        (petcomp.Camera.from_dict, ["document"]),
        (petcomp.Camera, ["native"]),
        (petcomp.Camera.read, ["path"]),
        (camera.project, ["points"]),
        (camera.rays, ["pixels"]),
        (camera.resized, ["image"]),
        (petcomp.camera.solve, ["label", "force"]),
        (petcomp.Scene, ["image", "surface", "camera", "objects", "lights"]),
        (petcomp.Scene.from_dict, ["document"]),
        (petcomp.Pipeline, ["recipe", "seed", "set", "quality"]),
        (pipeline.take, ["scene"]),
        (pipeline.resolve, ["scene"]),
        (closed.sample, ["k", "seed"]),
        (petcomp.Sample.from_masks, ["image", "masks", "object_classes", "classes"]),
        (sample._native.mask, ["place"]),
        (
            lambda **f: petcomp.Card(**{"id": 1, "texture": PHOTO, "size": (0.1, 0.1), **f}),
            ["id", "texture", "size", "position", "rotation", "class_"],
        ),
        (
            lambda **f: petcomp.render(petcomp.Shot(**{"camera": camera, **f})),
            ["camera", "plate", "cards", "lights", "ambient", "exposure", "classes", "options", "labels"],
        ),
        (
            lambda **f: petcomp.render(
                petcomp.Shot(camera).with_card(petcomp.Card(**{"id": 1, "texture": PHOTO, "size": (0.1, 0.1), **f}))
            ),
            ["id", "texture", "size", "position", "rotation", "class_"],
        ),
        (petcomp.evaluate, ["predictions", "truth", "classes", "size", "images", "rounds", "seed"]),
        (petcomp.set_threads, ["count"]),
        (petcomp.io.read, ["path", "alpha"]),
        (lambda **f: petcomp.io.write(**{"path": folder / "x.png", "image": PHOTO, **f}), ["image"]),
        (
            lambda **f: petcomp.generate(**{"source": 3, "count": 0, "folder": folder / "set", **f}),
            ["source", "count", "seed", "only", "shard", "classes", "labels", "split"],
        ),
    ]


#: What a call may raise: those that Python itself raises for wrong arguments, and petcomp's.
EXPECTED = (TypeError, ValueError, KeyError, IndexError, OverflowError, AttributeError, OSError, petcomp.Error)


@pytest.mark.filterwarnings("ignore")
def test_random_calls_never_crash(recipe, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    random_ = random.Random(0)
    functions = callables(recipe, tmp_path)
    answered = 0
    for _ in range(CALLS):
        function, names = random_.choice(functions)
        chosen = [name for name in names if random_.random() < 0.7]
        arguments = {name: random_.choice(VALUES) for name in chosen}
        try:
            function(**arguments)
            answered += 1
        except errors.InternalError as error:
            pytest.fail(f"{function} {arguments}: {error}")
        except EXPECTED:
            pass
    petcomp.set_threads(0)
    assert answered > CALLS / 100


hypothesis = pytest.importorskip("hypothesis")
st = hypothesis.strategies
TREES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)


@hypothesis.settings(deadline=None, max_examples=200)
@hypothesis.given(TREES)
def test_any_document_is_a_scene_or_refused(tree):
    for make in (petcomp.Scene.from_dict, petcomp.Camera.from_dict, petcomp.camera.solve):
        with pytest.raises((petcomp.Error, TypeError)):
            make(tree)


SCENE = {
    "image": [16, 12],
    "surface": {"size": [1.0, 1.0]},
    "camera": {"known": petcomp.Camera.looking_down(1.0, 80.0, [16, 12]).to_dict()},
    "lights": [{"position": [0.0, 0.0, 1.0], "size": [0.1, 0.1], "power": 1.0}],
}


@hypothesis.settings(deadline=None, max_examples=200)
@hypothesis.given(st.data())
def test_a_scene_with_a_wrong_leaf_is_taken_or_refused(data):
    document = json.loads(json.dumps(SCENE))
    table = document
    while True:
        place = data.draw(st.sampled_from(sorted(table) if isinstance(table, dict) else list(range(len(table)))))
        if not isinstance(table[place], (dict, list)) or not table[place] or data.draw(st.booleans()):
            break
        table = table[place]
    table[place] = data.draw(TREES)
    try:
        scene = petcomp.Scene.from_dict(document)
        assert petcomp.Scene.from_dict(scene.to_dict()) == scene
    except (petcomp.Error, TypeError) as error:
        assert not isinstance(error, errors.InternalError)


ARRAYS = st.tuples(
    st.lists(st.integers(0, 6), max_size=4),
    st.sampled_from(["f4", "f8", "f2", "u1", "i4", "?", ">f4", "c8", "O"]),
    st.sampled_from(["C", "F", "reversed", "strided", "transposed"]),
)


@hypothesis.settings(deadline=None, max_examples=300)
@hypothesis.given(ARRAYS)
def test_any_array_is_keyed_or_refused(array):
    shape, dtype, layout = array
    values = np.ones([*shape[:2], 3, *shape[2:]] if len(shape) == 2 else shape, dtype)
    views = {
        "C": lambda: values,
        "F": lambda: np.asfortranarray(values),
        "reversed": lambda: values[::-1] if values.ndim else values,
        "strided": lambda: values[::2] if values.ndim else values,
        "transposed": lambda: values.T,
    }
    given = views[layout]()
    try:
        matte = key(given).matte
        assert matte.shape == given.shape[:2]
    except (petcomp.Error, TypeError) as error:
        assert not isinstance(error, errors.InternalError)
