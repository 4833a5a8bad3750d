"""Tables of a study: every score with the data needed to reproduce it, and means with intervals."""

import csv
import io

import numpy as np

from . import archive, bootstrap, files, reality, score, study as studies

COLUMNS = (
    "arm seed room pictures map50 map50_95 classes real synthetic mix images model image_size device "
    "cpu_seconds petcomp commit ultralytics torch"
).split()
SWITCH_COLUMNS = "switch ratio low high".split()
SUMMARY_COLUMNS = "arm seeds mean low high against ratio ratio_low ratio_high".split()


def check(study, folder, planned=()):
    """Check that all scores are on the same test pictures, and that every row of `results.csv` is still known or
    belongs to a planned training."""
    tested = {key: archive.tested(matches) for key, (_, matches) in archive.read(folder).items()}
    tested |= {key: studies.tested(study, *key) for key in study.trained()}
    tested = {(arm, seed): labels for (arm, seed), labels in tested.items() if arm in study.arms["arms"]}
    check_kept(folder, tested.keys() | set(planned))
    kept = {key: labels for key, labels in tested.items() if key not in planned}
    expected = studies.test_labels(study) or next(iter(kept.values()), {})
    for key, labels in kept.items():
        check_number(study, key, {room: len(of_room) for room, of_room in labels.items()})
        check_labels(study, key, labels, expected)


def check_number(study, key, pictures):
    expected = dict.fromkeys(study.rooms, study.test_pictures)
    if pictures != expected:
        raise SystemExit(
            f"{study.name}: {key}: tested on so many pictures of each room: {pictures}, expected {expected}; see "
            "--test-pictures, --rooms and --name"
        )


def check_labels(study, key, labels, expected):
    """Check that the pictures are the expected ones: another world may have as many."""
    for room, of_room in labels.items():
        if of_room != expected[room]:
            raise SystemExit(
                f"{study.name}: {key}: tested on pictures of another world: room {room} had so many labels: {of_room}, "
                f"expected {expected[room]}; train it again, or see --name"
            )


def check_kept(folder, known):
    lost = {(row["arm"], row["seed"]) for row in archive.rows(folder)} - known
    if lost:
        raise SystemExit(
            f"{folder}: {min(lost)} and {len(lost) - 1} more would be lost: they are in arms.toml no longer, or neither "
            f"trained here nor in {archive.FILE}; take another --name"
        )


def scored(study, folder):
    """Rows of `results.csv`, and matches by arm, seed and room, of all finished trainings: those here and those that
    the results in the folder come from."""
    rows, matches, archived, trained = [], {}, archive.read(folder), study.trained()
    for arm in study.arms["arms"]:
        for seed in sorted(seed for name, seed in archived.keys() | trained if name == arm):
            of_rooms = matches.setdefault(arm, {}).setdefault(seed, {})
            if (arm, seed) in trained:
                rows += [room_row(study, arm, seed, room, of_rooms) for room in study.rooms]
            else:
                own_rows, found = archived[arm, seed]
                rows += own_rows
                of_rooms |= found
    return rows, matches


def room_row(study, arm, seed, room, of_rooms):
    folder, classes = study.folder(arm, seed), study.classes(arm)
    count = study.test_pictures
    truth = reality.truth(study.world, room, count, classes, study.cache / f"truth/{room}_{classes}_{count}")
    found = score.score(
        study, folder / "predictions" / str(room), truth, reality.SIZE, classes, folder / f"eval/{room}"
    )
    (map50, map50_95), of_rooms[str(room)] = found
    training = studies.training_of(study, arm, seed)
    known = {key: training[key] for key in COLUMNS if key in training and not isinstance(training[key], list)}
    return known | {
        "arm": arm,
        "room": room,
        "pictures": count,
        "map50": f"{map50:.6f}",
        "map50_95": f"{map50_95:.6f}",
        "real": len(training["real"]),
        "synthetic": len(training["synthetic"]),
    }


def over_pictures(matches):
    """mAP@0.5:0.95 of each arm in each round of the bootstrap over pictures."""
    return {arm: bootstrap.samples(of_arm) for arm, of_arm in matches.items()}


def with_chance(drawn, matches):
    """The same with the random variation of trainings."""
    return {arm: of_trainings(arm, rounds, matches[arm]) for arm, rounds in drawn.items()}


def of_trainings(arm, rounds, seeds):
    rooms = len(next(iter(seeds.values())))
    return bootstrap.with_chance(arm, rounds, len(seeds), rooms)


def means(matches):
    """mAP@0.5:0.95 of each arm, over seeds and rooms."""
    return {arm: mean_score(of_arm) for arm, of_arm in matches.items()}


def summary(study, matches, means, drawn):
    """Mean of mAP@0.5:0.95 over seeds and rooms of each arm, its interval, and its ratio to the arm that
    it is compared with."""
    return {
        arm: {
            "seeds": len(matches[arm]),
            "mean": means[arm],
            "interval": bootstrap.interval(drawn[arm], means[arm]),
            **against(arm, study.arms["arms"][arm].get("against", "real"), means, drawn),
        }
        for arm in matches
    }


def ratios(study, means, drawn):
    """Ratios of the headline, as far as their arms are trained."""
    return [one | against(*one["arms"], means, drawn) for one in study.arms["ratios"]]


def against(arm, other, means, drawn):
    """Ratio of two arms, if both exist and the other one found anything."""
    if arm == other or arm not in means or means.get(other, 0) == 0:
        return {}
    rounds = drawn[arm] / np.maximum(drawn[other], np.finfo(float).tiny)
    ratio = means[arm] / means[other]
    return {"against": other, "ratio": ratio, "ratio_interval": bootstrap.interval(rounds, ratio)}


def mean_score(of_arm):
    of_rooms = [
        bootstrap.map_of(matches, np.ones_like(matches[0].truths))
        for rooms in of_arm.values()
        for matches in rooms.values()
    ]
    return float(np.mean(of_rooms))


def summary_rows(summary):
    for arm, one in summary.items():
        low, high = one["interval"]
        ratio_low, ratio_high = one.get("ratio_interval", ("", ""))
        yield {"arm": arm, "low": low, "high": high, "ratio_low": ratio_low, "ratio_high": ratio_high} | one


def write_csv(path, columns, rows):
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n", restval="", extrasaction="ignore")
    writer.writeheader()
    writer.writerows(rows)
    return files.write_text(path, text.getvalue())
