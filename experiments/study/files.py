"""Atomic writing of files."""

import json
import os
from pathlib import Path

CLASSES = ["cap_label", "cap", "label", "none"]


def write_text(path, text):
    return write_bytes(path, text.encode())


def write_bytes(path, data):
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_bytes(data)
    os.replace(part, path)
    return path


def write_json(path, value):
    return write_text(path, json.dumps(value, indent=1) + "\n")


def label_of(picture):
    """Path of a picture's labels by YOLO's rule: the last `images` becomes `labels`."""
    before, after = str(picture).rsplit("/images/", 1)
    return Path(before, "labels", after).with_suffix(".txt")
