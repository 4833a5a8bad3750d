"""A study: its arms, its folders and the order of its steps."""

import concurrent.futures
import json
import os
import subprocess
import sys
import threading
from dataclasses import dataclass, field
from pathlib import Path

from . import files, reality, synthetic

HERE = Path(__file__).parents[1]


@dataclass
class Study:
    """A study. `cache` holds everything that can be regenerated, `world` the reality."""

    arms: dict
    cache: Path
    world: Path
    program: Path
    # Lists of photos and of backgrounds, where they are not those of the world.
    photos: Path | None = None
    backgrounds: Path | None = None
    # The module that trains.
    trainer: str = "study.train"
    # What each generator made, once it is known: every seed of an arm asks for the same pictures.
    made: dict = field(default_factory=dict)

    @property
    def name(self):
        return self.cache.name

    @property
    def rooms(self):
        return self.arms["reality"]["rooms"]

    @property
    def test_pictures(self):
        """Number of test pictures per room."""
        return self.arms["reality"].get("test_pictures", self.arms["reality"]["pictures"])

    def petcomp(self, *words):
        done = subprocess.run([self.program, "-q", *map(str, words)], capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(f"petcomp {' '.join(map(str, words))}\n{done.stderr}")

    def version(self):
        program = subprocess.run([self.program, "--version"], capture_output=True, text=True).stdout
        commit = subprocess.run(
            ["git", "describe", "--always", "--dirty"], cwd=HERE, capture_output=True, text=True
        ).stdout
        return {"petcomp": program.split()[1], "commit": commit.strip()}

    def synthetic(self, generator):
        if generator not in self.made:
            self.made[generator] = synthetic.pictures(self, generator)
        return self.made[generator]

    def classes(self, arm):
        return self.arms["arms"][arm].get("classes", self.arms["training"]["classes"])

    def training(self, arm):
        """Training settings of an arm."""
        settings = dict(self.arms["training"])
        short = settings.pop("short", {})
        return settings | (short if self.arms["arms"][arm].get("short") else {})

    def seeds(self, arm, chosen=None):
        """Seeds of an arm: those chosen, or as many as the arm has."""
        return chosen or range(self.training(arm)["seeds"])

    def folder(self, arm, seed):
        return self.cache / "runs" / arm / str(seed)

    def weights(self, arm, seed):
        """Path of the last weights, as written by `train.py`."""
        return self.folder(arm, seed) / "detector/weights/last.pt"

    def trained(self):
        """Arms and seeds of all trainings finished here."""
        done = (self.cache / "runs").glob("*/*/training.done.json")
        return {(path.parts[-3], int(path.parts[-2])) for path in done}

    def is_trained(self, arm, seed):
        return (self.folder(arm, seed) / "training.done.json").exists()


def steps(study, names, seeds):
    """Yield the trainings to do: first those that others start from, then the rest."""
    starts = [study.arms["arms"][name].get("start") for name in names]
    yield trainings(study, [name for name in dict.fromkeys(starts) if name], seeds)
    yield trainings(study, names, seeds)


def trainings(study, names, seeds):
    """Trainings to do, seed by seed, so that first results of all arms come before more precise ones."""
    all_of_them = [(seed, place, arm) for place, arm in enumerate(names) for seed in study.seeds(arm, seeds)]
    return [(arm, seed) for seed, _, arm in sorted(all_of_them) if not study.is_trained(arm, seed)]


def train_all(study, todo, processes):
    """Train in `processes` processes of one thread each, rather than in one process of many threads."""
    data = threading.Lock()
    with concurrent.futures.ThreadPoolExecutor(processes) as pool:
        jobs = [pool.submit(train, study, arm, seed, data) for arm, seed in todo]
        for count, job in enumerate(concurrent.futures.as_completed(jobs), 1):
            print(f"{count} of {len(todo)} trainings: {job.result()}", flush=True)


def train(study, arm, seed, data):
    with data:  # two processes of petcomp must not write into one folder
        training = describe(study, arm, seed)
    folder = study.folder(arm, seed)
    path = files.write_json(folder / "training.json", training)
    environment = os.environ | {"OMP_NUM_THREADS": "1", "YOLO_CONFIG_DIR": str(study.cache)}
    with (folder / "log.txt").open("a") as log:
        command = [sys.executable, "-m", study.trainer, path]
        done = subprocess.run(command, cwd=HERE, env=environment, stdout=log, stderr=log)
    if done.returncode != 0:
        raise SystemExit(f"{arm}, seed {seed}: the training failed, see {folder / 'log.txt'}")
    return f"{arm}, seed {seed}"


def describe(study, arm, seed):
    """Everything that a training depends on."""
    options = study.arms["arms"][arm]
    settings = {key: value for key, value in study.training(arm).items() if key != "seeds"}
    share = round(options.get("real", 0) * study.arms["reality"]["pictures"])
    generator = options.get("synthetic")
    pictures, made_by = study.synthetic(generator) if generator else ([], study.version())
    return settings | made_by | {
        "classes": study.classes(arm),
        "images": options.get("images", settings["images"]),
        "seed": seed,
        "start": str(study.weights(options["start"], seed)) if "start" in options else "",
        "threads": 1,
        "mix": options.get("mix", "concatenate"),
        "real": real_pictures(study, options.get("real_rooms", study.rooms), share),
        "synthetic": pictures,
        "test": {str(room): reality.pictures(study.world, room, "test", study.test_pictures) for room in study.rooms},
    }


def real_pictures(study, rooms, count):
    """The first `count` training pictures of each room."""
    return [path for room in rooms for path in reality.pictures(study.world, room, "real", count)]


def tested(study, arm, seed):
    """Number of labels in each picture that a detector was tested on, by room."""
    of_rooms = training_of(study, arm, seed)["test"]
    return {int(room): reality.label_counts(pictures) for room, pictures in of_rooms.items()}


def test_labels(study):
    """Number of labels in each test picture, by room; nothing if the world is not rendered."""
    of_rooms = {room: reality.found(study.world, room, "test", study.test_pictures) for room in study.rooms}
    is_rendered = all(len(pictures) == study.test_pictures for pictures in of_rooms.values())
    return {room: reality.label_counts(pictures) for room, pictures in of_rooms.items()} if is_rendered else {}


def training_of(study, arm, seed):
    folder = study.folder(arm, seed)
    done = json.loads((folder / "training.done.json").read_text())
    return json.loads((folder / "training.json").read_text()) | done
