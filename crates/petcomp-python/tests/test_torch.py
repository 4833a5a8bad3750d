"""Training loops get the program's samples, from whichever worker."""

import copyreg
import hashlib

import petcomp
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed")

COUNT = 6


def digest(sample):
    return hashlib.sha256(sample.image.tobytes() + sample.boxes.tobytes() + sample.classes.tobytes()).hexdigest()


def itself(sample):
    return sample


def digests(samples):
    return [digest(sample) for sample in samples]


def dataset(recipe, **options):
    from petcomp.torch import Dataset

    return Dataset(recipe, COUNT, seed=5, **options)


@pytest.mark.parametrize("context", ["fork", "spawn", "forkserver"])
def test_workers_make_the_same_samples(recipe, context):
    pipeline = petcomp.Pipeline(recipe, seed=5)
    want = [digest(pipeline[k]) for k in range(COUNT)]
    loader = torch.utils.data.DataLoader(
        dataset(recipe, transform=digest), batch_size=None, num_workers=2, multiprocessing_context=context
    )
    assert list(loader) == want
    assert list(loader) == want, "a second epoch"


def test_workers_share_the_memory_for_cut_outs(recipe, monkeypatch):
    data, shares = dataset(recipe, transform=digest), []
    monkeypatch.setattr(petcomp._petcomp, "share_memory", shares.append)
    monkeypatch.setattr(torch.utils.data, "get_worker_info", lambda: type("Worker", (), {"num_workers": 3}))
    try:
        assert data[0] != data[1]
    finally:
        petcomp.set_threads(0)
        copyreg.dispatch_table.pop(petcomp.Sample)
    assert shares == [3]


def test_a_sample_stays_in_its_worker(recipe):
    data = dataset(recipe, transform=itself)
    options = {"num_workers": 1, "timeout": 120}
    inside = torch.utils.data.DataLoader(data, batch_size=COUNT, collate_fn=digests, **options)
    assert list(inside) == [digests(data[k] for k in range(COUNT))]
    outside = torch.utils.data.DataLoader(data, batch_size=None, **options)
    with pytest.raises(petcomp.errors.ArgumentTypeError, match="transform: a Sample, which cannot leave"):
        list(outside)


def test_samples_are_the_programs_files(recipe, tmp_path, program):
    program("dataset", "generate", recipe, "-n", COUNT, "--seed", 5, "-o", tmp_path / "set", "-q")
    for k, (picture, target) in enumerate(dataset(recipe)):
        path = next(tmp_path.glob(f"set/images/*/{k:06}.png"))
        codes = (picture * 255).round().to(torch.uint8).permute(1, 2, 0).contiguous().numpy()
        petcomp.io.write(tmp_path / "own.png", codes)
        assert (tmp_path / "own.png").read_bytes() == path.read_bytes()
        rows = next(tmp_path.glob(f"set/labels/*/{k:06}.txt")).read_text().splitlines()
        assert len(rows) == len(target["boxes"]) == len(target["labels"])
        assert target["boxes"].dtype == torch.float32 and target["labels"].min() >= 1
        assert target.keys() == {"boxes", "labels", "image_id", "area", "iscrowd"} and target["image_id"] == k


def test_what_is_to_be_ignored_is_not_taught():
    from petcomp.torch import to_tensors

    film = torch.ones(4, 4, 4).numpy()
    cards = tuple(petcomp.Card(i, film, (0.2, 0.1), position=(0, 0, 0.05 * i)) for i in (1, 2))
    camera = petcomp.Camera.looking_down(1.0, 80.0, [64, 48])
    sample = petcomp.render(petcomp.Shot(camera, cards=cards, labels={"obstructed": "ignore"}))
    assert sample.ignored.tolist() == [True, False]
    target = to_tensors(sample)[1]
    assert target["boxes"].tolist() == sample.boxes[1:].tolist()
    assert target["labels"].tolist() == [1] and target["iscrowd"].tolist() == [0] and len(target["area"]) == 1


def test_any_index_any_order(recipe):
    data = dataset(recipe, transform=digest)
    assert len(data) == COUNT and data[-1] == data[COUNT - 1]
    assert data[3] == dataset(recipe, transform=digest)[3]
    with pytest.raises(IndexError):
        data[COUNT]


def test_batches_of_lists(recipe):
    from petcomp.torch import collate

    loader = torch.utils.data.DataLoader(dataset(recipe), batch_size=3, collate_fn=collate, shuffle=True)
    for pictures, targets in loader:
        assert len(pictures) == len(targets) == 3 and pictures[0].shape == (3, 120, 160)
