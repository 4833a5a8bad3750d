"""One HTML page of a study: tables, plots, and a look at the pictures."""

import base64
import html
import io
from pathlib import Path

import cv2
import matplotlib
import numpy as np

from . import files

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


def write(study, rows, summary, drawn_ratios, path):
    parts = [
        "<h1>Does the data teach a detector?</h1>",
        f"<p>{html.escape(description(study))}</p>",
        "<h2>Goals</h2>",
        table(["ratio of mAP@0.5:0.95", "measured", "95 % interval", "paper", "goal"], ratio_rows(drawn_ratios)),
        "<h2>Arms</h2>",
        arms_plot(summary),
        table(["arm", "seeds", "mAP@0.5:0.95", "95 % interval", "ratio", "95 % interval", "to"], arm_rows(summary)),
        "<h2>Rooms</h2>",
        table(["arm", *map(str, study.rooms)], room_rows(rows, study.rooms)),
        "<h2>The pictures</h2>",
        *sheets(study),
    ]
    text = f"<!doctype html><meta charset=utf-8><title>petcomp: experiments</title><style>{STYLE}</style>"
    files.write_text(path, text + "\n".join(parts) + "\n")


def description(study):
    training, reality = study.arms["training"], study.arms["reality"]
    return (
        f"{training['model']} of Ultralytics from random weights, {training['image_size']} px, "
        f"{training['images']} image iterations of batch {training['batch']}, in every arm. Tested on "
        f"{reality['pictures']} pictures of each of the rooms {', '.join(map(str, study.rooms))}; intervals "
        "are 95 % by bootstrap over pictures and seeds. A difference whose interval holds 0 (a ratio's: 1) is none."
    )


def table(head, rows):
    lines = ["<tr>" + "".join(f"<th>{html.escape(cell)}</th>" for cell in head) + "</tr>"]
    lines += ["<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows]
    return "<table>" + "\n".join(lines) + "</table>"


def ratio_rows(ratios):
    for ratio in ratios:
        measured = f"{ratio['ratio']:.2f}" if "ratio" in ratio else "not measured"
        yield [ratio["name"], measured, span(ratio.get("ratio_interval"), 2), ratio.get("paper", ""), ratio["goal"]]


def arm_rows(summary):
    for arm, one in sorted(summary.items(), key=lambda item: -item[1]["mean"]):
        ratio = f"{one['ratio']:.2f}" if "ratio" in one else ""
        mean = f"{one['mean']:.4f}"
        yield [arm, one["seeds"], mean, span(one["interval"], 4), ratio, span(one.get("ratio_interval"), 2), one.get("against", "")]


def span(interval, digits):
    return f"{interval[0]:.{digits}f} to {interval[1]:.{digits}f}" if interval else ""


def room_rows(rows, rooms):
    arms = dict.fromkeys(row["arm"] for row in rows)
    for arm in arms:
        scores = {room: [float(r["map50_95"]) for r in rows if (r["arm"], r["room"]) == (arm, room)] for room in rooms}
        yield [arm, *(f"{np.mean(scores[room]):.4f}" for room in rooms)]


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


def sheets(study):
    """A few pictures of reality and of each generator that was used."""
    for room in study.rooms:
        yield sheet(f"room {room}", study.world / f"room{room}/real/piles/images")
    for name in study.arms["generators"]:
        yield sheet(name, study.cache / "synthetic" / name / "images/train")


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
