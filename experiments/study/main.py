"""The work of `experiments/run`, once the Python packages are installed."""

import dataclasses
import importlib.util
import shutil
import subprocess
import sys
import tomllib

from . import archive, files, page, results, screening, study as studies

HERE = studies.HERE


def run(options, cache, program):
    study = smoke(cache / "smoke", program) if options.smoke else full(options, cache, program)
    if options.smoke and not options.write:
        shutil.rmtree(study.cache, ignore_errors=True)
    names = chosen(options, study.arms)
    folder = study.cache / "results" if options.smoke else kept(study)
    if not options.write:
        check_planned(study, folder, names, options.seeds)
        for step in studies.steps(study, names, options.seeds):
            studies.train_all(study, step, options.processes)
    means = write(study, folder)
    if options.smoke:
        check_parts()
        check_archive(study, folder, means)
        check_refusals(study, folder)


def full(options, cache, program):
    """The full study. Other rooms make another study, of which nothing was seen while choosing."""
    arms = read_arms()
    if options.screening:
        arms["reality"] |= screening.chosen(arms, options.screening).get("reality", {})
    arms["reality"]["rooms"] = options.rooms or arms["reality"]["rooms"]
    if options.test_pictures:
        arms["reality"]["test_pictures"] = options.test_pictures
    name = options.name or "rooms_" + "_".join(map(str, arms["reality"]["rooms"]))
    if options.gpu:
        train_on_gpu(arms)
        name = f"gpu_{name}"
    return studies.Study(arms, cache / name, cache / "world", program)


def train_on_gpu(arms):
    """Switch to the detector for GPUs and scale the lengths of all trainings by the same factor."""
    training, on_gpu = arms["training"], arms["on_gpu"]
    factor = on_gpu["images"] / training["images"]
    for settings in (training["short"], *arms["arms"].values()):
        if "images" in settings:
            settings["images"] = round(factor * settings["images"])
    training |= on_gpu


def kept(study):
    return HERE / "results" / study.name


def smoke(cache, program):
    """The study with tiny sizes."""
    arms = read_arms()
    tiny = arms["smoke"]
    for part in ("training", "reality", "synthetic"):
        arms[part] |= tiny[part]
    arms["arms"] = {name: arms["arms"][name] for name in tiny["arms"]}
    world, photos, backgrounds = ((HERE / tiny[name]).resolve() for name in ("world", "photos", "backgrounds"))
    return studies.Study(arms, cache, world, program, photos, backgrounds, tiny_trainer(arms))


def tiny_trainer(arms):
    if importlib.util.find_spec("ultralytics"):
        return "study.train"
    print("no PyTorch here: nothing is trained, boxes near the true ones stand in for a detector's")
    arms["training"]["model"] = "stand-in"
    return "study.stand_in"


def read_arms():
    arms = tomllib.loads((HERE / "arms.toml").read_text())
    screening.add_arms(arms)
    return arms


def chosen(options, arms):
    if options.headline:
        return [name for name, arm in arms["arms"].items() if arm.get("headline")]
    if options.screening:
        return screening.runs(options.screening)
    for name in options.arms or []:
        if name not in arms["arms"]:
            raise SystemExit(f"--arms: no arm {name}, expected some of {', '.join(arms['arms'])}")
    return options.arms or list(arms["arms"])


def check_planned(study, folder, names, seeds):
    """Check before training, so that hours of it do not end in an error."""
    results.check(study, folder, [(arm, seed) for arm in names for seed in study.seeds(arm, seeds)])


def check_parts():
    if subprocess.run([sys.executable, "-m", "unittest", "-q", "study.tests"], cwd=HERE).returncode != 0:
        raise SystemExit("study/tests.py: failed")


def check_archive(study, folder, means):
    """Check that the results stay the same without the trainings that they come from."""
    shutil.rmtree(study.cache / "runs", ignore_errors=True)
    _, archived = results.scored(study, folder)
    if results.means(archived) != means:
        raise SystemExit(f"{folder / archive.FILE}: other scores than those of the trainings")


def check_refusals(study, folder):
    """Check that scores on other test pictures are not mixed in, and that no rows get lost."""
    reality = study.arms["reality"] | {"test_pictures": study.test_pictures - 1}
    check_refused(dataclasses.replace(study, arms=study.arms | {"reality": reality}), folder)
    alone = files.write_text(study.cache / "rows_alone/results.csv", (folder / "results.csv").read_text())
    check_refused(study, alone.parent)


def check_refused(study, folder):
    try:
        results.check(study, folder)
    except SystemExit:
        return
    raise SystemExit(f"{folder}: should be refused")


def write(study, folder):
    """Write tables and page; return the mean score of each arm."""
    results.check(study, folder)
    rows, matches = results.scored(study, folder)
    if not rows:
        raise SystemExit("nothing is trained yet")
    means, over_pictures = results.means(matches), results.over_pictures(matches)
    drawn = results.with_chance(over_pictures, matches)
    summary = results.summary(study, matches, means, drawn)
    ratios = results.ratios(study, means, drawn)
    # Their own error has the chance of trainings in it.
    effects = screening.effects(study, means, over_pictures)
    archive.write(folder, matches)
    results.write_csv(folder / "results.csv", results.COLUMNS, rows)
    results.write_csv(folder / "summary.csv", results.SUMMARY_COLUMNS, results.summary_rows(summary))
    results.write_csv(folder / "switches.csv", results.SWITCH_COLUMNS, [row for rows in effects.values() for row in rows])
    page.write(study, rows, summary, ratios, effects, folder / "index.html")
    print(f"see {folder / 'index.html'}")
    return means
