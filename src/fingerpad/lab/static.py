"""The laboratory as one file that needs no server: answers are computed beforehand."""

from __future__ import annotations

import base64
import gzip
import json
from dataclasses import asdict, replace
from importlib import resources
from pathlib import Path

import numpy as np

from fingerpad.core.files import write_atomically
from fingerpad.core.progress import NoProgress, Progress
from fingerpad.core.units import unit_of
from fingerpad.lab.answer import LabState
from fingerpad.lab.laboratory import Laboratory
from fingerpad.lab.server import CONTROLS as ALL
from fingerpad.lab.view import comparison, view_of_answer

AFFERENTS = ("SAI", "RA")  # Who responds: each type makes the file as much longer.
DEPTHS, PLACES = 6, 5  # Depths, and places along the finger, of every object.
FRAMES = 24  # Pictures of the skin over time in each answer.
CONTROLS = [each for each in ALL if each[0] in ("object", "depth_mm", "x_mm", "other", "afferent")]


def write_static(laboratory: Laboratory, folder: Path, progress: Progress | None = None) -> Path:
    """Compute answers over a grid of states, and write `index.html`, which opens without a server."""
    progress = progress or NoProgress()
    objects = dict(each for name in laboratory.names for each in _sizes(laboratory, name))
    known = {label: _grid(laboratory, state) for label, state in objects.items()}
    views = {}
    total = len(AFFERENTS) * sum(len(depths) * len(places) for depths, places in known.values())
    for state in objects.values():
        if not laboratory.measured(state):
            laboratory.make(state, with_error=True, told=progress)
    with progress.stage("answers", total) as advance:
        for afferent in AFFERENTS:
            answers = {}
            for label, state in objects.items():
                for i, depth in enumerate(known[label][0]):
                    for j, x in enumerate(known[label][1]):
                        at = replace(state, afferent=afferent, depth_mm=depth, x_mm=x)
                        answers[label, i, j] = at, laboratory.answer(at)
                        advance()
            for (label, i, j), (state, answer) in answers.items():
                others = {}
                for other, (_, places) in known.items():
                    second = answers[other, i, min(j, len(places) - 1)][1]
                    others[other] = comparison(label, other, answer, second)
                view = view_of_answer(laboratory, state, answer, FRAMES, beside=True)
                views["|".join([label, afferent, str(i), str(j)])] = asdict(view) | {"comparisons": others}
    content = json.dumps({"spec": _spec(objects, known), "views": views}, separators=(",", ":"))
    here = resources.files("fingerpad.lab")
    page = (here / "static.html").read_text("utf-8")
    page = page.replace("{{ page }}", (here / "page.js").read_text("utf-8"))
    packed = base64.b64encode(gzip.compress(content.encode(), mtime=0)).decode()
    path = folder / "index.html"
    write_atomically(path, page.replace("{{ data }}", packed).encode())
    return path


def _sizes(laboratory: Laboratory, name: str) -> list[tuple[str, LabState]]:
    """Name an object; of a family, its two ends and the described one."""
    training = laboratory.described(LabState(name)).training
    parameter = training.range.parameter
    if parameter is None or training.range.values is None:
        return [(name, LabState(name))]
    low, high = training.range.values
    sizes = sorted({low, float(getattr(training.touch.indenter, parameter)), high})
    return [(f"{name} {parameter.split('_')[0]} {size:g}", LabState(name, size=size)) for size in sizes]


def _grid(laboratory: Laboratory, state: LabState) -> tuple[list[float], list[float]]:
    range_ = laboratory.described(state).training.range
    depths = np.round(range_.depth_mm * np.arange(1, DEPTHS + 1) / DEPTHS, 4).tolist()
    places = np.linspace(*range_.x_mm, PLACES).tolist() if range_.x_mm[0] < range_.x_mm[1] else [0.0]
    return depths, places


def _spec(
    objects: dict[str, LabState], known: dict[str, tuple[list[float], list[float]]]
) -> dict[str, object]:
    labels = list(objects)
    depths, places = known[labels[0]]
    steps = {"depth_mm": depths[0], "x_mm": max(np.diff(places), default=0.0)}
    return {
        "controls": [(name, label, unit_of(name), steps.get(name, 0)) for name, label, _ in CONTROLS],
        "objects": {
            label: {
                "depth_mm": [depths[0], depths[-1]],
                "x_mm": [places[0], places[-1]],
                "z_mm": [0, 0],
                "steps": {"depth_mm": depths, "x_mm": places},
            }
            for label, (depths, places) in known.items()
        },
        "choices": {"object": labels, "other": ["", *labels], "afferent": AFFERENTS},
        "empty": {"other": "nothing"},
        "start": {
            "object": labels[0], "other": "", "afferent": AFFERENTS[0],
            "depth_mm": depths[len(depths) // 2], "x_mm": places[len(places) // 2], "z_mm": 0,
        },
        "exact": False,
    }  # fmt: skip
