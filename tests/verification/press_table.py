"""Every kind of press that must not fail: `python -m tests.verification.press_table [quick] [standard]`.

A spanning set of bodies, friction, tissues and places rather than all combinations: each body once under the
default tissues without and with friction, and the hardest of them under other tissues and at other places.
It prints one line per press. The presses of `small_bodies` on the page are among them.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

from fingerpad.core.errors import FingerpadError
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.geometry.edged_indenters import Edge, Gap, Grating
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import Bar, Cylinder, FlatPunch, Indenter, Line, Sphere
from fingerpad.geometry.motion import RampAndHold
from fingerpad.skin.indentation import CONTACT_POINT_MM, touch_of

DEPTH_MM, DEEP_MM = 2.0, 3.5
WIDE_MM = 1.5
"""Radius from which a body is pressed to `DEEP_MM`. [mm]"""

SHARP_MM = 0.05
BODIES: tuple[Indenter, ...] = (
    *(Sphere(1000.0 / radius_mm) for radius_mm in (0.25, 0.5, 1.0, 1.5, 3.5, 20.0)),
    *(FlatPunch(diameter, SHARP_MM) for diameter in (0.5, 1.0, 3.0, 10.0)),
    FlatPunch(1.0, 0.1),
    FlatPunch(3.0, 0.3),
    FlatPunch(6.35, 0.3),
    Bar(3.0, SHARP_MM),
    Bar(),
    Cylinder(0.5),
    Cylinder(),
    Edge(SHARP_MM),
    Gap(1.0, fillet_mm=SHARP_MM, lip_mm=SHARP_MM),
    Grating(1.0, 1.0, SHARP_MM),
    Line(),
    Line(0.3),
)
HARD = (Sphere(2000.0), FlatPunch(1.0, 0.1), Bar(3.0, SHARP_MM))
TISSUES = (
    "paper", "trial1", "trial2", "trial3", "trial2_wu", "trial3_wu", "trial3_stiffening", "maeno1998",
    "wu2007", "gerling2014_fit",
)  # fmt: skip
PLACES_MM = ((8.0, 0.0), (29.0, 0.0), (17.37, 3.5), (25.0, 7.0))


@dataclass(frozen=True)
class Press:
    """One press of the table."""

    body: Indenter
    friction: float = 0.0
    tissues: str = DEFAULT_TISSUES
    at_mm: tuple[float, float] = CONTACT_POINT_MM


@dataclass(frozen=True)
class Outcome:
    """Largest force [mN], largest SED of the living epidermis [kPa], energy imbalance and time [s]."""

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
        yield from (Press(body, tissues=tissues) for tissues in TISSUES)
        yield from (Press(body, at_mm=at_mm) for at_mm in PLACES_MM)


def depth_of(press: Press) -> float:
    """Depth of a press: 0.8 of the way to the bone at most, which `check_path` allows. [mm]"""
    wide = press.body.half_width_mm >= WIDE_MM
    to_bone_mm = float(Fingertip().depth_available_mm(*press.at_mm))
    return min(DEEP_MM if wide else DEPTH_MM, 0.79 * to_bone_mm)


def solved(press: Press, resolution: str, depth_mm: float | None = None) -> Outcome:
    """Solve one press of the table."""
    start = time.perf_counter()
    skin = touch_of(
        Fingertip(), press.body, RampAndHold(depth_mm=depth_mm or depth_of(press)), press.tissues, resolution,
        press.at_mm, friction=press.friction,
    ).solve()  # fmt: skip
    sed_kpa = skin.sed_kpa[:, skin.mesh.living_epidermis.ravel()].max()
    seconds = time.perf_counter() - start
    return Outcome(float(skin.force_mn.max()), float(sed_kpa), float(skin.energy_imbalance), seconds)


def main(resolutions: list[str]) -> int:
    """Print the table; return the number of presses that failed."""
    failed = 0
    print("| press | resolution | force [mN] | SED [kPa] | energy imbalance | time [s] |")
    for press in presses():
        for resolution in resolutions or ["quick", "standard"]:
            how = f"mu {press.friction:g}, {press.tissues}, {press.at_mm}, {depth_of(press):.3g} mm"
            name = f"{press.body}, {how}"
            try:
                done = solved(press, resolution)
            except FingerpadError as error:
                failed += 1
                print(f"| {name} | {resolution} | FAILS: {error} |", flush=True)
                continue
            print(
                f"| {name} | {resolution} | {done.force_mn:.5g} | {done.sed_kpa:.4g} | "
                f"{done.energy_imbalance:.1e} | {done.seconds:.0f} |",
                flush=True,
            )
    return failed


if __name__ == "__main__":
    sys.exit(1 if main(sys.argv[1:]) else 0)
