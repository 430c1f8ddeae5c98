"""What the page shows of an answer: numbers as plain lists, the map as bytes, and sentences."""

from __future__ import annotations

import base64
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fingerpad.core.values import FloatArray
from fingerpad.lab.answer import Answer, LabState, compared, finger_of, shape_of
from fingerpad.lab.laboratory import Laboratory, Making, alone

OFF_THE_PAD = 255  # Byte of a point beside the pad; the others are shares of the peak, 0 to 254.
OUTLINE_POINTS = 40


@dataclass(frozen=True)
class Shown:
    """An answer, rounded to what a picture shows."""

    times_ms: list[float]
    force_mn: list[float]
    error_mn: list[float]
    area_mm2: list[float]
    largest_kpa: list[float]  #: Force error: 0 if not measured; largest: strain energy density.
    contact_mm: list[list[float]]  #: Middle, half-axes and angle of an ellipse of its area. [mm, rad]
    peak_kpa: float  #: Value of the byte 254 of `frames`. [kPa]
    frames_ms: list[float]  #: Times of the map. [ms]
    frames: str  #: The map at these times, bytes (n_frames, nx, nz) in base 64.
    spikes: list[list[float]]  #: Spike times of each afferent. [ms]


@dataclass(frozen=True)
class View:
    """All that the page shows of a state."""

    answer: Shown  #: The answer of the reduced touch.
    x_mm: list[float]
    z_mm: list[float]  #: Points of the map. [mm]
    pad_mm: list[float]  #: Place of the touch. [mm]
    outline_mm: list[list[float]]  #: x and half-width of the finger. [mm]
    positions_mm: list[list[float]]  #: Afferents. [mm]
    order: list[int]  #: Afferents by their distance from the contact.
    shown_ms: float  #: End of the hold. [ms]
    said: str
    python: str  #: What is pressed, and Python lines that reproduce it.
    other: Shown | None = None
    compared: str = ""  #: What observers say of both.
    exact: Shown | None = None
    difference: str = ""  #: How far the reduced answer is from it.
    making: Making | None = None  #: How far the reduced touch is, while the answer is in full.


def view_of(laboratory: Laboratory, state: LabState, exact: bool = False) -> View | Making:
    """Make the view of a state, or tell how far its presses are."""
    answer = laboratory.poll(state)
    if isinstance(answer, Making):
        return answer
    view = replace(view_of_answer(laboratory, state, answer), making=laboratory.making(state))
    if state.other:
        second = laboratory.poll(replace(state, object=state.other, size=state.other_size))
        if isinstance(second, Making):
            return second
        names = _named(state.object, state.size), _named(state.other, state.other_size)
        view = replace(view, other=_shown(second), compared=comparison(*names, answer, second))
    if exact:
        full = laboratory.poll(state, exact=True)
        if isinstance(full, Making):
            return full
        view = replace(view, exact=_shown(full), difference=difference(answer, full))
    return view


def view_of_answer(
    laboratory: Laboratory, state: LabState, answer: Answer, frames: int | None = None, beside: bool = False
) -> View:
    described = laboratory.described(state)
    touch, finger = described.training.touch, finger_of(described)
    x = np.linspace(0.3, finger.length_mm - 0.3, OUTLINE_POINTS)
    positions = answer.response.positions_mm
    nearest = np.linalg.norm(positions - answer.middle_mm[answer.force_mn.argmax()], axis=1)
    body = described.training.touch_with(shape_of(described, state.size)).indenter
    measuring = laboratory.model(state) is not None and not laboratory.measured(state)
    return View(
        answer=_shown(answer, frames),
        x_mm=_plain(answer.x_mm),
        z_mm=_plain(answer.z_mm),
        pad_mm=list(touch.at_mm),
        outline_mm=_plain(np.column_stack([x, finger.section(x)[2]])),
        positions_mm=_plain(positions),
        order=np.argsort(nearest, kind="stable").tolist(),
        shown_ms=float(answer.times_ms[-1] - state.ramp_ms),
        said=f"{body}, tissues {described.tissues}, {described.resolution} mesh."
        + (" Its error is being measured." if measuring else ""),
        python=python_lines(laboratory, state, beside),
    )


def _named(name: str, size: float) -> str:
    return f"{name} {size:g}" if size else name


def comparison(name: str, other_name: str, answer: Answer, other: Answer) -> str:
    found = compared(answer, other)
    return (
        f"An ideal observer tells {name} from {other_name} in {found.ideal:.0%} of trials of two "
        f"alternatives, an observer of the sum of all spikes in {found.summed:.0%}."
    )


def difference(reduced: Answer, full: Answer) -> str:
    """Say how far a reduced answer is from a full solution, at the times of the latter."""
    peaks = full.force_mn.max(), np.nanmax(full.sed_kpa)
    force = np.abs(np.interp(full.times_ms, reduced.times_ms, reduced.force_mn) - full.force_mn).max()
    at = np.searchsorted(reduced.times_ms, full.times_ms - 1e-6).clip(0, reduced.times_ms.size - 1)
    met = np.abs(reduced.times_ms[at] - full.times_ms) < 1e-3
    sed = np.nanmax(np.abs(reduced.sed_kpa[at[met]] - full.sed_kpa[met]))
    rates = [
        np.abs(getattr(reduced.response, name) - getattr(full.response, name)).max()
        for name in ("dynamic_rate_hz", "static_rate_hz")
    ]
    return (
        f"Largest differences from the full solution: force {force / peaks[0]:.1%} and strain energy density "
        f"{sed / peaks[1]:.1%} of the peak, rates {rates[0]:.1f} (dynamic) and {rates[1]:.1f} spikes/s "
        "(static)."
    )


def _shown(answer: Answer, frames: int | None = None) -> Shown:
    last = answer.times_ms.size - 1
    at = np.unique(np.linspace(0, last, min(frames or last + 1, last + 1)).astype(int))
    peak = float(np.nanmax(answer.sed_kpa)) or 1.0
    shares = np.nan_to_num(254.0 * answer.sed_kpa[at] / peak, nan=OFF_THE_PAD)
    trains = answer.response.spikes
    return Shown(
        times_ms=_plain(answer.times_ms),
        force_mn=_plain(answer.force_mn),
        error_mn=_plain(np.where(np.isfinite(answer.force_error_mn), answer.force_error_mn, 0.0)),
        area_mm2=_plain(answer.contact_area_mm2),
        largest_kpa=_plain(np.nanmax(answer.sed_kpa, axis=(1, 2))),
        contact_mm=[_ellipse(answer, n) for n in range(answer.times_ms.size)],
        peak_kpa=peak,
        frames_ms=_plain(answer.times_ms[at]),
        frames=base64.b64encode(np.rint(shares).astype(np.uint8).tobytes()).decode(),
        spikes=[np.round(trains[n], 2).tolist() for n in range(len(trains))],
    )


def _ellipse(answer: Answer, n: int) -> list[float]:
    """Ellipse of the area of the contact, with the direction and the aspect of the field below it."""
    weight = np.nan_to_num(answer.sed_kpa[n]) ** 2
    x, z = np.meshgrid(answer.x_mm, answer.z_mm, indexing="ij")
    area, total = answer.contact_area_mm2[n], weight.sum()
    if area <= 0.0 or total <= 0.0:
        return [*answer.middle_mm[n].tolist(), 0.0, 0.0, 0.0]
    points = np.stack([x - (weight * x).sum() / total, z - (weight * z).sum() / total])
    spread, axes = np.linalg.eigh(np.einsum("xz,axz,bxz->ab", weight, points, points) / total)
    narrow, wide = np.maximum(spread, 1e-3).tolist()  # of less than a step of the map nothing is known
    aspect = math.sqrt(wide / narrow)
    longer = math.sqrt(area / math.pi * aspect)
    angle = math.atan2(axes[1, 1], axes[0, 1])
    return [round(each, 3) for each in (*answer.middle_mm[n].tolist(), longer, longer / aspect, angle)]


def _plain(values: FloatArray) -> list[Any]:
    return np.round(values, 4).tolist()


SCRIPT = """from pathlib import Path

import fingerpad as fp

laboratory = fp.lab.Laboratory({folder!r}, [Path({source!r})], allow_python={allow_python})
state = fp.lab.{state!r}
answer = laboratory.answer(state)
spikes_ms = list(answer.response.spikes)
print(f"{{answer.force_mn.max():.1f}} mN, {{sum(map(len, spikes_ms))}} spikes")

# The full solution of the same touch; it takes seconds to a minute.
# exact = laboratory.answer(state, exact=True)
"""


def python_lines(laboratory: Laboratory, state: LabState, beside: bool = False) -> str:
    """Write lines that give the answer anew, `beside` the files if they lie in one folder."""
    source, folder = laboratory.source(state), laboratory.folder
    return SCRIPT.format(
        folder="." if beside else str(folder.resolve()),
        source=source.name if beside else str(source.resolve()),
        allow_python=laboratory.allow_python,
        state=alone(state),
    )
