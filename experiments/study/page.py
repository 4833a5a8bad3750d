"""The HTML page of a study: tables, plots and sample pictures."""

import base64
import html
import io
import re
from pathlib import Path

import cv2
import matplotlib
import numpy as np

from . import bootstrap, files

matplotlib.use("svg")
from matplotlib import pyplot

matplotlib.rcParams["svg.hashsalt"] = "petcomp"
STYLE = """
body { font: 15px/1.5 sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222 }
table { border-collapse: collapse; margin: 1em 0 } td, th { padding: .15em .8em; text-align: right; border-bottom: 1px solid #ddd }
td:first-child, th:first-child { text-align: left } svg, img { max-width: 100% }
"""
SHEET = (4, 2)
THUMBNAIL = (240, 180)


def write(study, rows, summary, drawn_ratios, effects, path):
    parts = [
        "<h1>Does the data teach a detector?</h1>",
        f"<p>{html.escape(description(study, rows))}</p>",
        *goals(drawn_ratios),
        *shares(study, summary),
        "<h2>Arms</h2>",
        arms_plot(summary),
        table(["arm", "seeds", "mAP@0.5:0.95", "95 % interval", "ratio", "95 % interval", "to"], arm_rows(summary)),
        *switches(study, effects),
        "<h2>Rooms</h2>",
        table(["arm", *map(str, study.rooms)], room_rows(rows, study.rooms)),
        table(["ratio", *map(str, study.rooms)], room_ratio_rows(rows, study)),
        "<h2>The pictures</h2>",
        *sheets(study, earlier_sheets(path)),
    ]
    text = f"<!doctype html><meta charset=utf-8><title>petcomp: experiments</title><style>{STYLE}</style>"
    files.write_text(path, text + "\n".join(parts) + "\n")


def description(study, rows):
    training = study.arms["training"]
    detector = f"{training['model']} of Ultralytics, not pretrained"
    if training["model"] == "stand-in":
        detector = "No detector, but boxes near the true ones"
    lengths = " or ".join(map(str, sorted({int(row["images"]) for row in rows})))
    return (
        f"{detector}, {training['image_size']} px, "
        f"{lengths} image iterations of batch {training['batch']}. Tested on "
        f"{study.test_pictures} pictures of each of the rooms {', '.join(map(str, study.rooms))}; intervals "
        "are 95 %, by bootstrap over pictures and with the chance of each training, a standard deviation of "
        f"{bootstrap.deviation(len(study.rooms)) * 100:.0f} % as after 40,000 images (shorter ones have more). "
        "A difference whose interval holds 0 (a ratio's: 1) is none. "
        f"The trainings took {cpu_hours(rows):.1f} CPU hours."
    )


def cpu_hours(rows):
    trainings = {(row["arm"], row["seed"]): row["cpu_seconds"] for row in rows}
    return sum(trainings.values()) / 3600


def table(head, rows):
    lines = ["<tr>" + "".join(f"<th>{html.escape(cell)}</th>" for cell in head) + "</tr>"]
    lines += ["<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows]
    return "<table>" + "\n".join(lines) + "</table>"


def goals(ratios):
    if not any("ratio" in ratio for ratio in ratios):
        return []
    head = ["ratio of mAP@0.5:0.95", "measured", "95 % interval", "paper", "goal"]
    return ["<h2>Goals</h2>", table(head, ratio_rows(ratios))]


def ratio_rows(ratios):
    for ratio in ratios:
        measured = f"{ratio['ratio']:.2f}" if "ratio" in ratio else "not measured"
        yield [ratio["name"], measured, span(ratio.get("ratio_interval"), 2), ratio.get("paper", ""), ratio.get("goal", "")]


def arm_rows(summary):
    for arm, one in sorted(summary.items(), key=lambda item: -item[1]["mean"]):
        ratio = f"{one['ratio']:.2f}" if "ratio" in one else ""
        mean = f"{one['mean']:.4f}"
        yield [arm, one["seeds"], mean, span(one["interval"], 4), ratio, span(one.get("ratio_interval"), 2), one.get("against", "")]


def switches(study, effects):
    """Effect of each switch, in a design where each is on in half of the generators."""
    if not effects:
        return []
    tables = [part for name, rows in effects.items() for part in screened(study.arms["screenings"][name], rows)]
    return ["<h2>Switches</h2>", *tables]


def screened(screening, effects):
    rows = [
        [one["switch"], f"{one['ratio']:.2f}", span([one["low"], one["high"]], 2)]
        for one in sorted(effects, key=lambda one: -one["ratio"])
    ]
    begun = f", from the weights of {screening['start']}" if "start" in screening else ""
    said = f"On top of {screening['base']}, each on in half of the trainings of {screening['images']} images{begun}."
    return [f"<p>{html.escape(said)}</p>", table(["switch", "on / off", "95 % interval"], rows)]


def span(interval, digits):
    return f"{interval[0]:.{digits}f} to {interval[1]:.{digits}f}" if interval else ""


def room_rows(rows, rooms):
    for arm in dict.fromkeys(row["arm"] for row in rows):
        yield [arm, *(f"{room_mean(rows, arm, room):.4f}" for room in rooms)]


def room_ratio_rows(rows, study):
    trained = {row["arm"] for row in rows}
    for ratio in study.arms["ratios"]:
        if trained.issuperset(ratio["arms"]):
            means = [[room_mean(rows, arm, room) for arm in ratio["arms"]] for room in study.rooms]
            yield [ratio["name"], *(f"{a / b:.2f}" if b else "" for a, b in means)]


def room_mean(rows, arm, room):
    return np.mean([float(row["map50_95"]) for row in rows if (row["arm"], row["room"]) == (arm, room)])


def shares(study, summary):
    lines = by_generator(study, summary)
    return ["<h2>Shares of the real pictures</h2>", shares_plot(study, summary, lines)] if lines else []


def shares_plot(study, summary, lines):
    """Plot of the score by share of the real pictures, alone and with each generator."""
    figure, axes = pyplot.subplots(figsize=(8, 4))
    for generator, arms in lines.items():
        of_real = [study.arms["arms"][arm].get("real", 0) for arm in arms]
        intervals = np.array([summary[arm]["interval"] for arm in arms])
        line = axes.plot(of_real, [summary[arm]["mean"] for arm in arms], "o-", label=generator or "real only")
        axes.fill_between(of_real, *intervals.T, alpha=0.15, color=line[0].get_color())
    axes.set_ylim(bottom=0)
    axes.set_xlabel("share of the real pictures")
    axes.set_ylabel("mAP@0.5:0.95")
    axes.legend()
    axes.grid(alpha=0.3)
    return svg(figure)


def by_generator(study, summary):
    """Arms of the default classes, length and rooms whose batches have a share of each source, by generator, ordered by
    their share of the real pictures."""
    lines = {}
    for arm in sorted(summary, key=lambda arm: study.arms["arms"][arm].get("real", 0)):
        options = study.arms["arms"][arm]
        has_shares = options.get("mix") not in ("concatenate", "equation2", "fine_tune")
        if has_shares and not {"classes", "images", "short", "real_rooms"} & options.keys():
            lines.setdefault(options.get("synthetic"), []).append(arm)
    return {generator: arms for generator, arms in lines.items() if len(arms) > 1}


def arms_plot(summary):
    arms = sorted(summary, key=lambda arm: summary[arm]["mean"])
    figure, axes = pyplot.subplots(figsize=(8, 0.3 * len(arms) + 1))
    for k, arm in enumerate(arms):
        low, high = summary[arm]["interval"]
        axes.plot([low, high], [k, k], color="#4477aa", lw=3, alpha=0.5)
        axes.plot(summary[arm]["mean"], k, "o", color="#4477aa")
    axes.set_yticks(range(len(arms)), arms)
    axes.set_xlim(left=0)
    axes.set_xlabel("mAP@0.5:0.95, mean over rooms and seeds, 95 % interval")
    axes.grid(axis="x", alpha=0.3)
    return svg(figure)


def svg(figure):
    out = io.StringIO()
    figure.savefig(out, format="svg", bbox_inches="tight", metadata={"Date": None})
    pyplot.close(figure)
    text = out.getvalue()
    return text[text.index("<svg") :]


def earlier_sheets(path):
    """The sheets of the page as it is, by name: they outlive the cache."""
    text = path.read_text() if path.exists() else ""
    return {name: part for part, name in re.findall(r'(<h3>([^<]*)</h3><img alt="" [^>]*>)', text)}


def sheets(study, earlier):
    """A few pictures of reality and of each generator used."""
    folders = {f"room {room}": study.world / f"room{room}/real/piles/images" for room in study.rooms}
    folders |= {name: study.cache / "synthetic" / name / "images/train" for name in study.arms["generators"]}
    for name, folder in folders.items():
        yield sheet(name, folder) or earlier.get(name, "")


def sheet(name, folder):
    found = sorted(Path(folder).glob("*.jpg"))[: SHEET[0] * SHEET[1]]
    if not found:
        return ""
    small = [cv2.resize(cv2.imread(str(path)), THUMBNAIL, interpolation=cv2.INTER_AREA) for path in found]
    small += [np.full_like(small[0], 255)] * (SHEET[0] * SHEET[1] - len(small))
    rows = [np.hstack(small[k : k + SHEET[0]]) for k in range(0, len(small), SHEET[0])]
    data = cv2.imencode(".jpg", np.vstack(rows), [cv2.IMWRITE_JPEG_QUALITY, 80])[1]
    encoded = base64.b64encode(data.tobytes()).decode()
    return f'<h3>{html.escape(name)}</h3><img alt="" src="data:image/jpeg;base64,{encoded}">'
