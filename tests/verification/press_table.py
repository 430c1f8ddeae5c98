"""Every kind of press that must not fail, and docs/presses.md, the page that lists them.

A spanning set of bodies, friction, tissues and places rather than all combinations: each body once under the
default tissues without and with friction, the hardest of them under other tissues and at other places, and
some bodies that press lightly, slide and roll. Presses without a row of this code take hours; each row is
kept in docs/verification/presses.csv as soon as it is known.
`python -m tests.verification.press_table quick` presses at one resolution.
"""

from __future__ import annotations

import csv
import io
import re
import signal
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from fingerpad.core.errors import FingerpadError
from fingerpad.core.files import write_atomically
from fingerpad.core.values import FloatArray
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.geometry.bodies import Bar, Cylinder, Edge, FlatPunch, Gap, Grating, Line, Sphere
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import LAYERS, Mesh
from fingerpad.geometry.motion import RampAndHold, Trajectory
from fingerpad.geometry.size_field import half_width_mm
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.skin.caveats import LARGEST_IMBALANCE
from fingerpad.skin.code_hash import code_hash
from fingerpad.skin.indentation import CONTACT_POINT_MM, touch_of

from .page import PAGE

ROWS, TABLE_PAGE = PAGE.parent / "verification" / "presses.csv", PAGE.parent / "presses.md"
MOST_SECONDS = 3600
"""Longest time of a press; one that takes longer counts as failed. [s]"""

DEPTH_MM, DEEP_MM = 2.0, 3.5
WIDE_MM = 1.5
"""Radius from which a body is pressed to `DEEP_MM`. [mm]"""

SHARP_MM = 0.05
BODIES: tuple[Indenter, ...] = (
    *(Sphere(curvature_per_m=1000.0 / radius_mm) for radius_mm in (0.25, 0.5, 1.0, 1.5, 3.5, 20.0)),
    *(FlatPunch(diameter, SHARP_MM) for diameter in (0.5, 1.0, 3.0, 10.0)),
    FlatPunch(1.0, 0.1),
    FlatPunch(3.0, 0.3),
    FlatPunch(6.35, 0.3),
    Bar(3.0, SHARP_MM),
    Bar(),
    Cylinder(0.05),
    Cylinder(0.5),
    Cylinder(),
    Edge(SHARP_MM),
    Gap(1.0, fillet_mm=SHARP_MM, lip_mm=SHARP_MM),
    Grating(1.0, 1.0, SHARP_MM),
    Line(),
    Line(0.3),
)
HARD = (Sphere(curvature_per_m=2000.0), FlatPunch(1.0, 0.1), Bar(3.0, SHARP_MM))
TISSUES = (
    "paper", "trial1", "trial2", "trial3", "trial2_wu", "trial3_wu", "trial3_stiffening", "maeno1998",
    "wu2007", "gerling2014_fit",
)  # fmt: skip
PLACES_MM = ((8.0, 0.0), (29.0, 0.0), (17.37, 3.5), (25.0, 7.0))

SLIDE_SPEED_MM_PER_MS = 0.02
ROLLER_MM, ROLLED_DEG, ROLL_SPEED_DEG_PER_MS = 7.0, 20.0, 0.08


def moved(way: FloatArray, speed: float, **course: Any) -> Trajectory:
    """Ramp of 50 ms, hold of 100 ms, then along a way; each part of the course is a number or of each way."""
    n = 3 + way.size
    columns = {name: np.array(np.broadcast_to(value, n)) for name, value in course.items()}
    for name in columns.keys() & {"depth_mm", "force_mn"}:
        columns[name][0] = 0.0
    return Trajectory(np.concatenate([[0.0, 50.0, 150.0], 150.0 + way / speed]), **columns)


def slide(axis: str, length_mm: float, **pressed: float) -> Trajectory:
    """Slide along or across the finger, sampled finely at its onset."""
    way = np.array([0.05, 0.1, 0.2, 0.4, *np.arange(1.0, length_mm + 0.5)])
    return moved(way, SLIDE_SPEED_MM_PER_MS, **{axis: np.concatenate([np.zeros(3), way])}, **pressed)


def roll(depth_mm: float) -> Trajectory:
    """Roll a cylinder over the pad without slip, were the skin flat."""
    way = np.linspace(0.0, ROLLED_DEG, 6)[1:]
    tilt = np.concatenate([np.zeros(3), way])
    x_mm = -ROLLER_MM / 2 * np.deg2rad(tilt)
    return moved(way, ROLL_SPEED_DEG_PER_MS, depth_mm=depth_mm, tilt_deg=tilt, x_mm=x_mm)


MOTIONS = {
    "0.6 mm": moved(np.empty(0), 1.0, depth_mm=0.6),
    "60 mN, slides 5 mm along": slide("x_mm", 5.0, force_mn=60.0),
    "60 mN, slides 5 mm across": slide("z_mm", 5.0, force_mn=60.0),
    "0.6 mm, slides 2 mm along": slide("x_mm", 2.0, depth_mm=0.6),
    "0.8 mm, rolls by 20 degrees": roll(0.8),
}
"""Presses of 50 ms with a hold of 100 ms and what comes after, by their names in the column of depths."""

BY_MOTION: tuple[tuple[Indenter, str, tuple[float, float]], ...] = (
    (Bar(), "0.6 mm", CONTACT_POINT_MM),
    (Edge(), "0.6 mm", CONTACT_POINT_MM),
    (Gap(1.0), "0.6 mm", CONTACT_POINT_MM),
    (Grating(1.0, 1.0), "0.6 mm", CONTACT_POINT_MM),
    (Grating(1.0, 1.0), "0.6 mm", (25.0, 0.0)),
    (Sphere(curvature_per_m=287.0), "60 mN, slides 5 mm along", (12.0, 0.0)),
    (Sphere(curvature_per_m=287.0), "60 mN, slides 5 mm across", (17.37, -2.5)),
    (Bar(), "0.6 mm, slides 2 mm along", (14.0, 0.0)),
    (Grating(1.0, 1.0), "0.6 mm, slides 2 mm along", (15.0, 0.0)),
    (Cylinder(ROLLER_MM), "0.8 mm, rolls by 20 degrees", (17.37, 0.0)),
)
MOVING_STEPS = PressSettings(ramp_steps=6, hold_steps=2)

RESOLUTIONS = ("quick", "standard")


@dataclass(frozen=True)
class Press:
    """One press of the table."""

    body: Indenter
    friction: float = 0.0
    tissues: str = DEFAULT_TISSUES
    at_mm: tuple[float, float] = CONTACT_POINT_MM
    motion: str = ""

    @property
    def cells(self) -> tuple[str, ...]:
        """Body, friction, tissues, place and depth as text; no other press has the same."""
        place = f"{self.at_mm[0]:g}, {self.at_mm[1]:g}"
        body = re.sub(r"\d+\.\d+", lambda size: f"{float(size[0]):.4g}", str(self.body))
        return body, f"{self.friction:g}", self.tissues, place, self.motion or f"{depth_of(self):.3g}"


@dataclass(frozen=True)
class Outcome:
    """Largest force [mN] and SED through the living epidermis [kPa], energy imbalance, processor time [s]."""

    force_mn: float
    sed_kpa: float
    energy_imbalance: float
    seconds: float


def presses() -> Iterator[Press]:
    """List the presses of the table."""
    for body in BODIES:
        yield Press(body)
        if not body.grips:
            yield Press(body, friction=0.5)
    for body in HARD:
        for tissues in TISSUES:
            yield from (Press(body, friction, tissues) for friction in (0.0, 0.5))
        yield from (Press(body, at_mm=at_mm) for at_mm in PLACES_MM)
    yield from (Press(body, friction=0.5, at_mm=at_mm, motion=motion) for body, motion, at_mm in BY_MOTION)


def depth_of(press: Press) -> float:
    """Depth of a press: 0.8 of the way to the bone at most, which `check_path` allows. [mm]"""
    wide = half_width_mm(press.body) >= WIDE_MM
    to_bone_mm = float(Fingertip().depth_available_mm(*press.at_mm))
    return min(DEEP_MM if wide else DEPTH_MM, 0.79 * to_bone_mm)


def solved(press: Press, resolution: str, depth_mm: float | None = None) -> Outcome:
    """Solve one press of the table."""
    if press.motion:
        motion, settings = MOTIONS[press.motion], MOVING_STEPS
    else:
        motion, settings = RampAndHold(depth_mm=depth_mm or depth_of(press)), None
    touch = touch_of(
        Fingertip(), press.body, motion, press.tissues, resolution, press.at_mm, settings=settings,
        friction=press.friction,
    )  # fmt: skip
    start = time.process_time()
    skin = touch.solve()
    seconds = time.process_time() - start
    sed_kpa = float(through_epidermis(skin.mesh, skin.sed_kpa).max())
    return Outcome(float(skin.force_mn.max()), sed_kpa, float(skin.energy_imbalance), seconds)


def through_epidermis(mesh: Mesh, of_elements: FloatArray) -> FloatArray:
    """Mean through the living epidermis, which is one element at quick and standard, (n_times, n_columns).

    Its elements are about equally thick, and numbered one below the other.
    """
    inside = np.flatnonzero(mesh.layer == LAYERS.index("living epidermis"))
    columns = inside.reshape(mesh.living_epidermis.size, -1)
    assert (columns[:, -1] == mesh.living_epidermis.ravel()).all()
    return of_elements[:, columns].mean(axis=2)


COLUMNS = (
    "body", "friction", "tissues", "place_mm", "depth_mm", "resolution",
    "force_mn", "sed_kpa", "energy_imbalance", "seconds", "failure", "code",
)  # fmt: skip
KEYS = 6
"""The first columns name a press at a resolution."""

Rows = dict[tuple[str, ...], dict[str, str]]


def read_rows() -> Rows:
    """Rows that are known, by body, friction, tissues, place, depth and resolution."""
    if not ROWS.exists():
        return {}
    lines = list(csv.DictReader(io.StringIO(ROWS.read_text(encoding="utf-8"))))
    return {tuple(line[name] for name in COLUMNS[:KEYS]): line for line in lines}


def row_of(press: Press, resolution: str) -> dict[str, str]:
    """Press once, and return the row with the result or the failure."""
    row = dict.fromkeys(COLUMNS, "") | dict(zip(COLUMNS, (*press.cells, resolution), strict=False))
    row["code"] = code_hash()
    try:
        with limited_to(MOST_SECONDS):
            done = solved(press, resolution)
    except (FingerpadError, TimeoutError) as error:
        return row | {"failure": str(error)}
    return row | {
        "force_mn": f"{done.force_mn:.5g}",
        "sed_kpa": f"{done.sed_kpa:.4g}",
        "energy_imbalance": f"{done.energy_imbalance:.1e}",
        "seconds": f"{done.seconds:.0f}",
    }


@contextmanager
def limited_to(seconds: int) -> Iterator[None]:
    """Raise `TimeoutError` in what takes longer."""

    def stop(*_: object) -> None:
        raise TimeoutError(f"not finished in {seconds} s")

    signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)


def press_all(resolutions: Sequence[str], part: int = 0, parts: int = 1) -> int:
    """Press what has no row of this code, keep each row, write the page; return the number of failures.

    Processes that press different parts at a time keep their rows in one file.
    """
    failed = 0
    for number, press in enumerate(presses()):
        for resolution in resolutions if number % parts == part else ():
            key = (*press.cells, resolution)
            row = read_rows().get(key)
            if row is None or row["code"] != code_hash():
                row = row_of(press, resolution)
                keep(key, row)
            failed += bool(row["failure"])
            print(" | ".join(row[name] for name in COLUMNS[:-1]), flush=True)
    TABLE_PAGE.write_text(page_text(read_rows()), encoding="utf-8")
    return failed


def keep(key: tuple[str, ...], row: Mapping[str, str]) -> None:
    """Add a row to the file, in the order of the table."""
    order = {press.cells: number for number, press in enumerate(presses())}
    rows = {each: line for each, line in (read_rows() | {key: dict(row)}).items() if each[:-1] in order}
    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(
        line for _, line in sorted(rows.items(), key=lambda item: (order[item[0][:-1]], item[0][-1]))
    )
    write_atomically(ROWS, out.getvalue().encode())


INTRODUCTION = """\
# Presses that must not fail

Each body is pressed 2 mm deep, or 3.5 mm where its radius is at least 1.5 mm, but at most 0.79 of the way to
the bone: by the paper's ramp of 50 ms, with the hold of 950 ms. Others press lightly, slide or roll. Bodies,
friction, tissues and places are a spanning set. [presses.csv](verification/presses.csv) has every press with
its largest force, largest strain energy density (SED) of the living epidermis, energy imbalance, time of the
processor and the code that pressed it. `make verification` presses what has no row of the present code, and
writes this page. [Small bodies](decisions/small-bodies.md) tells how such bodies are meshed.

| resolution | presses | with the present tissues | reach their depth | energy imbalance: median, largest |
|---|---|---|---|---|
"""
BETWEEN = """
The same presses on both meshes: wanted of `quick` are 5 % of force and 10 % of SED.
[Mesh resolutions](decisions/mesh-resolutions.md) compares both with a finer mesh.

| presses | force: median, largest difference | SED: median, largest | within both |
|---|---|---|---|
"""
WANTED = 0.05, 0.1
SNAPPED = """
These leave more than 0.5 % of the indenter's work unexplained, since the skin snaps from one state to another
within a step, or stiffens much in it: below balls and cylinders 16 steps of the ramp leave less than a tenth
of that. Their results have a caveat that says so.

| body | friction | tissues | x, z [mm] | depth [mm] | resolution | energy imbalance |
|---|---|---|---|---|---|---|
"""
STOPPED = """
These do not reach their depth. A press that stops ends in an error, and nothing is stored.

| body | friction | tissues | x, z [mm] | depth [mm] | resolution | why |
|---|---|---|---|---|---|---|
"""


def page_text(rows: Rows) -> str:
    """docs/presses.md from the rows."""
    lines, wanted = [], len(list(presses()))
    for name in RESOLUTIONS:
        pressed = [row for key, row in rows.items() if key[-1] == name]
        missing = [float(row["energy_imbalance"]) for row in pressed if not row["failure"]]
        counts = f"{wanted} | {len(pressed)} | {len(missing)}"
        lines.append(f"| {name} | {counts} | {np.median(missing):.1e}, {max(missing):.1e} |\n")
    found = np.array([each for press in presses() if (each := differences(rows, press))])
    middle, most = np.median(found, axis=0), found.max(axis=0)
    cells = [f"{100 * middle[n]:.1f} %, {100 * most[n]:.1f} %" for n in (0, 1)]
    within = (found <= WANTED).all(axis=1).sum()
    between = f"| {len(found)} | {cells[0]} | {cells[1]} | {within} |\n"
    stopped = [
        "| " + " | ".join([*key, row["failure"].partition(" (stratum")[0].partition(", where")[0]]) + " |\n"
        for key, row in rows.items()
        if row["failure"]
    ]
    snapped = [
        "| " + " | ".join([*key, row["energy_imbalance"]]) + " |\n"
        for key, row in rows.items()
        if not row["failure"] and float(row["energy_imbalance"]) > LARGEST_IMBALANCE
    ]
    return "".join([INTRODUCTION, *lines, BETWEEN, between, SNAPPED, *snapped, STOPPED, *stopped])


def differences(rows: Rows, press: Press) -> tuple[float, float] | None:
    """Force and SED at quick less those at standard, as shares; none if one of them is missing."""
    one, other = (rows.get((*press.cells, name)) for name in RESOLUTIONS)
    if one is None or other is None or one["failure"] or other["failure"]:
        return None
    force, sed = (abs(float(one[name]) / float(other[name]) - 1) for name in ("force_mn", "sed_kpa"))
    return force, sed


if __name__ == "__main__":
    resolutions = [word for word in sys.argv[1:] if not word.isdigit()]
    halves = [int(word) for word in sys.argv[1:] if word.isdigit()]
    sys.exit(1 if press_all(resolutions or RESOLUTIONS, *halves) else 0)
