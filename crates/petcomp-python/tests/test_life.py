"""Threads, processes, interruption, handles, messages."""

import concurrent.futures
import logging
import multiprocessing
import os
import pickle
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time

import numpy as np
import petcomp
import pytest
from conftest import ROOT, SAMPLES


def picture_of(recipe, k):
    return petcomp.Pipeline(recipe)[k].image


def test_a_fork_makes_the_same_picture(recipe):
    want = picture_of(recipe, 1)
    context = multiprocessing.get_context("fork")
    with context.Pool(2) as pool:
        for image in pool.starmap(picture_of, [(recipe, 1)] * 4):
            assert (image == want).all()


def test_a_fork_does_not_wait_for_a_fall_of_its_parent(recipe):
    belt = {"direction_deg": 0, "exposure_s": 0.004, "frame_rate": 15, "frames": 10, "speed": [0.3, 0.6]}
    pipeline = petcomp.Pipeline(recipe, set={"scene.belt": belt, "scene.objects": 60, "scene.collider": "hull"})
    falling = threading.Thread(target=pipeline.sample, args=(0,))
    falling.start()
    time.sleep(0.1)
    assert falling.is_alive()
    # The same sequence, in a process without the thread that makes it.
    child = multiprocessing.get_context("fork").Process(target=pipeline.sample, args=(1,))
    child.start()
    falling.join()
    child.join(60)
    hangs = child.is_alive()
    child.kill()
    assert not hangs and child.exitcode == 0


def test_a_spawned_process_makes_the_same_picture(recipe):
    pipeline = petcomp.Pipeline(recipe, seed=2, set={"scene.objects": 1})
    again = pickle.loads(pickle.dumps(pipeline))
    assert (again[0].image == pipeline[0].image).all()
    script = (
        "import sys, pickle; pipeline = pickle.load(sys.stdin.buffer); "
        "sys.stdout.buffer.write(pipeline[0].image.tobytes())"
    )
    done = subprocess.run([sys.executable, "-c", script], input=pickle.dumps(pipeline), capture_output=True, check=True)
    assert done.stdout == pipeline[0].image.tobytes()


def test_changes_count_beside_a_quality(recipe):
    with petcomp.Pipeline(recipe, quality="draft", set={"render.subsamples": 4}) as pipeline:
        render = pipeline.config["render"]
    assert (render["subsamples"], render["light_samples"]) == (4, 2)


def test_a_pickled_pipeline_is_the_same(recipe, monkeypatch):
    document = petcomp.Pipeline(recipe).config
    monkeypatch.chdir(recipe.parent)
    pipelines = [petcomp.Pipeline(recipe.name), petcomp.Pipeline(document)]
    document["scene"]["image"] = [32, 24]
    monkeypatch.chdir("/")
    for pipeline in pipelines:
        again = pickle.loads(pickle.dumps(pipeline))
        assert again.config["scene"] == pipeline.config["scene"]


def test_an_open_pipeline_does_not_follow_the_working_folder(recipe, monkeypatch):
    want = picture_of(recipe, 0)
    document = petcomp.Pipeline(recipe).config
    document["assets"] = "assets"
    document["backgrounds"] = os.path.relpath(document["backgrounds"], recipe.parent)
    monkeypatch.chdir(recipe.parent)
    pipelines = [petcomp.Pipeline(recipe.name), petcomp.Pipeline(document)]
    monkeypatch.chdir("/")
    for pipeline in pipelines:
        assert (pipeline[0].image == want).all()
        assert (pickle.loads(pickle.dumps(pipeline))[0].image == want).all()


def test_a_pickled_pipeline_is_the_recipe_that_was_read(recipe):
    own = recipe.with_name("own.toml")
    own.write_text(recipe.read_text())
    pipeline = petcomp.Pipeline(own, set={"render.subsamples": 2}, quality="draft")
    own.write_text(recipe.read_text().replace("objects = [2, 3]", "objects = 9"))
    again = pickle.loads(pickle.dumps(pipeline))
    assert (again[0].image == pipeline[0].image).all()
    assert again.config == pipeline.config and repr(again) == repr(pipeline)


def test_threads_share_a_pipeline(recipe):
    pipeline = petcomp.Pipeline(recipe)
    want = [pipeline[k].image for k in range(4)]
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        for k, sample in zip([0, 1, 2, 3] * 4, pool.map(pipeline.sample, [0, 1, 2, 3] * 4)):
            assert (sample.image == want[k]).all()


def test_one_sample_in_many_threads(recipe):
    sample = petcomp.Pipeline(recipe)[0]
    native = sample._native
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        shown = list(pool.map(lambda i: native.image_linear() if i % 2 else native.image(), range(64)))
    assert all(image is shown[0] for image in shown[::2])
    assert all(image is shown[1] for image in shown[1::2])


def test_many_processes_keep_their_share_in_memory(world, recipe, tmp_path):
    def second_picture(processes):
        assets = tmp_path / str(processes)
        shutil.copytree(world / "assets", assets)
        pipeline = petcomp.Pipeline(recipe, set={"assets": str(assets), "scene.objects": 10})
        petcomp._petcomp.share_memory(processes)
        try:
            assert len({item["asset"] for item in pipeline[0].scene["objects"]}) == 2
            shutil.rmtree(assets)
            return pipeline[0]
        finally:
            petcomp._petcomp.share_memory(1)

    assert second_picture(1).size == (160, 120)
    with pytest.raises(petcomp.errors.FileError):
        second_picture(2**60)


def test_the_interpreter_goes_on_beside_the_work(recipe):
    pipeline = petcomp.Pipeline(recipe, set={"scene.image": [4000, 3000], "render.subsamples": 8})
    steps, done = 0, threading.Event()

    def work():
        pipeline.sample(0)
        done.set()

    threading.Thread(target=work).start()
    while not done.is_set():
        time.sleep(0.001)
        steps += 1
    assert steps > 20


INTERRUPTED = """
import signal, sys, threading, time, os
import petcomp
# Programs in the background of a script are deaf to it.
signal.signal(signal.SIGINT, signal.default_int_handler)
def strike():
    time.sleep(1.5)
    print(time.monotonic(), flush=True)
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=strike, daemon=True).start()
try:
    {work}
except KeyboardInterrupt:
    print(time.monotonic(), flush=True)
"""


@pytest.mark.parametrize(
    "work",
    [
        "petcomp.generate({recipe!r}, 100000, {folder!r})",
        "p = petcomp.Pipeline({recipe!r}, set={{'scene.image': [3000, 3000], 'render.subsamples': 8}})\n"
        "    for k in range(9): p[k]",
        "p = petcomp.Pipeline({recipe!r}, set={{'scene.objects': 40}})\n    for k in range(10**6): p[k]",
    ],
)
def test_ctrl_c_stops_soon(recipe, tmp_path, work):
    folder = str(tmp_path / "set")
    script = INTERRUPTED.format(work=work.format(recipe=str(recipe), folder=folder))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    struck, stopped = map(float, done.stdout.split())
    assert stopped - struck < 5.0, done.stderr


def test_an_interrupted_dataset_goes_on(recipe, tmp_path):
    def stop(progress):
        if progress.made == 2:
            raise StopIteration("enough")

    with pytest.raises(StopIteration, match="enough"):
        petcomp.generate(recipe, 100_000, tmp_path / "set", progress=stop)
    end = time.monotonic() + 20
    while True:
        # The picture in hand may still be written: the folder is its own until then.
        try:
            counts = petcomp.generate(recipe, 100_000, tmp_path / "set", only=3)
            break
        except petcomp.Error:
            assert time.monotonic() < end
            time.sleep(0.1)
    assert 3 <= counts.images < 100_000


def test_a_run_that_stops_does_not_stop_another_of_its_pipeline(recipe, tmp_path):
    pipeline = petcomp.Pipeline(recipe, set={"scene.objects": 40})
    stopped = threading.Event()

    def go_on():
        for k in range(1000, 2000):
            pipeline.sample(k)
            if stopped.is_set():
                return

    def stop(progress):
        if progress.made:
            raise StopIteration("enough")

    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        other = pool.submit(go_on)
        with pytest.raises(StopIteration, match="enough"):
            petcomp.generate(pipeline, 50, tmp_path / "set", progress=stop)
        stopped.set()
        assert other.result() is None


def test_an_interrupted_build_is_resumed(world, tmp_path):
    def stop(done, count):
        if done == 1:
            raise StopIteration("enough")

    petcomp.set_threads(1)
    try:
        with pytest.raises(StopIteration, match="enough"):
            petcomp.asset.build(world / "photos.csv", tmp_path / "assets", progress=stop)
    finally:
        petcomp.set_threads(0)
    # The photo in hand is finished by then.
    time.sleep(3)
    built = petcomp.asset.build(world / "photos.csv", tmp_path / "assets", resume=True)
    assert 1 <= built.kept <= built.photos


ENDED_IN_PYTHON = """
import os, signal, sys, threading, time
import numpy as np
import petcomp
signal.signal(signal.SIGINT, signal.default_int_handler)
def make(k):
    end = time.monotonic() + 2
    while time.monotonic() < end: pass
    return petcomp.Sample.from_masks(np.zeros((8, 8, 3), np.uint8), [], [], ["a"])
threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
petcomp.generate(make, 20, sys.argv[1], classes=["a"])
"""


def test_a_program_that_is_interrupted_in_its_own_function_ends_in_order(tmp_path):
    script = [sys.executable, "-c", ENDED_IN_PYTHON, str(tmp_path / "set")]
    done = subprocess.run(script, capture_output=True, text=True, timeout=120)
    assert done.stderr.endswith("KeyboardInterrupt\n")
    assert done.returncode == -signal.SIGINT


def test_an_exception_of_the_own_function_is_the_callers(tmp_path):
    def make(k):
        raise RuntimeError(f"no picture {k}")

    with pytest.raises(RuntimeError, match="no picture"):
        petcomp.generate(make, 3, tmp_path / "set", classes=["a"])
    with pytest.raises(TypeError, match="expected a Sample"):
        petcomp.generate(lambda k: k, 3, tmp_path / "other", classes=["a"])


def test_a_closed_pipeline_says_so(recipe):
    with petcomp.Pipeline(recipe) as pipeline:
        sample = pipeline[0]
    assert pipeline.closed
    for use in (lambda: pipeline[0], lambda: pipeline.classes, lambda: pipeline.draw(0)):
        with pytest.raises(petcomp.errors.ClosedError, match="the pipeline is closed"):
            use()
    pipeline.close()
    assert sample.image.shape == (120, 160, 3)


def test_closing_beside_the_work_is_harmless(recipe):
    for _ in range(5):
        pipeline = petcomp.Pipeline(recipe)
        with concurrent.futures.ThreadPoolExecutor(3) as pool:
            jobs = [pool.submit(pipeline.sample, k) for k in range(6)]
            pipeline.close()
            for job in jobs:
                error = job.exception()
                assert error is None or isinstance(error, petcomp.errors.ClosedError)


def test_arrays_outlive_their_sample(recipe):
    image, linear = (lambda s: (s.image, s.image_linear))(petcomp.Pipeline(recipe)[0])
    assert image.sum() > 0 and np.isfinite(linear).all()
    linear[:] = 0


def test_warnings_reach_logging(caplog):
    caplog.set_level(logging.WARNING, logger="petcomp")
    corners = [[100, 100], [540, 100], [540, 380], [100, 380]]
    petcomp.Camera.from_rectangle(corners, [0.44, 0.28], [640, 480])
    assert all(record.name == "petcomp" for record in caplog.records)


def test_the_program_is_inside():
    done = subprocess.run([sys.executable, "-m", "petcomp", "--version"], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout == f"petcomp {petcomp.__version__}\n"
    done = subprocess.run(
        [sys.executable, "-m", "petcomp", "asset", "list", "/nowhere"], capture_output=True, text=True
    )
    assert done.returncode == 4 and done.stderr.startswith("error: ")
    done = subprocess.run([sys.executable, "-m", "petcomp", "studio", "--help"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


PROGRAM = [sys.executable, "-m", "petcomp"]


def test_closed_streams_leave_the_files_of_the_program_alone(recipe, tmp_path):
    def files_of(folder, script):
        words = [*PROGRAM, "-vv", "-j", "2", "dataset", "generate", recipe, "-n", "30", "-o", tmp_path / folder]
        subprocess.run(["sh", "-c", script, "sh", *words], capture_output=True, check=True)
        paths = (path for path in (tmp_path / folder).rglob("*") if path.is_file() and path.name != ".runs.jsonl")
        return {path.relative_to(tmp_path / folder): path.read_bytes() for path in paths}

    want = files_of("open", '"$@"')
    assert len(want) > 90
    for closed in (">&- 2>&-", "<&- >&- 2>&-"):
        assert files_of(closed, f'"$@" {closed}') == want


def interrupted(*words):
    """The program with Ctrl-C after two seconds: status, messages, and how long it lasted from then on."""

    # Programs in the background of a script are deaf to it.
    def hear():
        signal.signal(signal.SIGINT, signal.default_int_handler)

    words = [*PROGRAM, "-j", "1", *map(str, words)]
    program = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, preexec_fn=hear)
    try:
        time.sleep(2)
        struck = time.monotonic()
        program.send_signal(signal.SIGINT)
        _, said = program.communicate(timeout=30)
    finally:
        program.kill()
    return program.returncode, said, time.monotonic() - struck


def test_ctrl_c_ends_the_program(recipe, tmp_path):
    for name, confidence in (("truth", ""), ("found", " 0.5")):
        (tmp_path / name).mkdir()
        for k in range(200):
            rows = (f"0 {0.05 * i + 0.02:.2f} 0.5 0.04 0.5{confidence}\n" for i in range(20))
            (tmp_path / name / f"{k}.txt").write_text("".join(rows))
    status, said, lasted = interrupted(
        "eval", tmp_path / "found", tmp_path / "truth", "--size", "640x480", "--rounds", "100000"
    )
    assert (status, "Traceback" in said) == (-signal.SIGINT, False) and lasted < 2, said
    # Commands whose work the next run continues say so.
    rows = (f"{SAMPLES / 'bottles/b0000_0.png'},bottle{i},bottle,0.25\n" for i in range(300))
    (tmp_path / "photos.csv").write_text("file,asset,class,length\n" + "".join(rows))
    for words in (
        ["dataset", "generate", recipe, "-n", "100000", "-o", tmp_path / "set", "--yes"],
        ["asset", "build", tmp_path / "photos.csv", "-o", tmp_path / "assets"],
    ):
        status, said, _ = interrupted(*words)
        assert (status, "Traceback" in said) == (130, False) and "interrupted" in said, said


def test_threads_are_set():
    petcomp.set_threads(1)
    try:
        assert petcomp.matte.key(np.zeros((4, 4, 3), np.float32), screen=(0.1, 0.7, 0.2)).matte.shape == (4, 4)
    finally:
        petcomp.set_threads(0)
    with pytest.raises(ValueError, match="threads: 5000"):
        petcomp.set_threads(5000)


# As a program in C has it, where nothing else was asked for.
READ_TWICE = """
import glob, os, signal, sys, petcomp
signal.signal(signal.SIGPIPE, signal.SIG_DFL)
first = petcomp.io.read(sys.argv[1])
children = " ".join(open(path).read() for path in glob.glob("/proc/self/task/*/children"))
[worker] = map(int, children.split())
os.kill(worker, signal.SIGKILL)
try:
    # Dead, and for petcomp to find so.
    os.waitid(os.P_PID, worker, os.WEXITED | os.WNOWAIT)
except ChildProcessError:
    pass  # It has by now.
assert (petcomp.io.read(sys.argv[1]) == first).all()
"""


def test_a_dead_worker_does_not_end_the_process(tmp_path):
    worker = ROOT / "target/release/petcomp-oiio-worker"
    (tmp_path / "scan.dpx").write_bytes(dpx(64, 48))
    environment = {**os.environ, "PETCOMP_OIIO_WORKER": str(worker)}
    words = [sys.executable, "-c", READ_TWICE, tmp_path / "scan.dpx"]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=60)
    if "built without OpenImageIO" in done.stderr:
        pytest.skip("built without OpenImageIO")
    assert done.returncode == 0, done.stderr


# In each child the parent's worker is idle too, and serves the parent alone.
READ_FORKED = """
import multiprocessing, sys, petcomp
first = petcomp.io.read(sys.argv[1])
paths = sys.argv[1:] * 3
with multiprocessing.get_context("fork").Pool(4) as pool:
    seen = pool.map(petcomp.io.read, paths)
assert len({image[0, 0, 0] for image in seen[: len(sys.argv) - 1]}) == len(sys.argv) - 1
assert all((image == petcomp.io.read(path)).all() for path, image in zip(paths, seen))
"""


def test_workers_of_a_parent_do_not_serve_its_forks(tmp_path):
    worker = ROOT / "target/release/petcomp-oiio-worker"
    paths = [tmp_path / f"{code}.dpx" for code in (40, 90, 140, 190)]
    for path in paths:
        path.write_bytes(dpx(640, 480, int(path.stem)))
    environment = {**os.environ, "PETCOMP_OIIO_WORKER": str(worker)}
    words = [sys.executable, "-c", READ_FORKED, *paths]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=120)
    if "built without OpenImageIO" in done.stderr:
        pytest.skip("built without OpenImageIO")
    assert done.returncode == 0, done.stderr


def dpx(width, height, code=128):
    """A film scan of 8-bit grey, linear, by SMPTE 268M: which only OpenImageIO reads."""
    header = bytearray(b"\xff" * 2048)
    struct.pack_into(">4sI8sI", header, 0, b"SDPX", 2048, b"V1.0", 2048 + 3 * width * height)
    struct.pack_into(">HHII", header, 768, 0, 1, width, height)
    struct.pack_into(">IIfIfBBBBHHIII", header, 780, 0, 0, 0.0, 255, 1.0, 50, 2, 2, 8, 0, 0, 2048, 0, 0)
    return bytes(header) + bytes([code]) * (3 * width * height)
