"""Numbers and pictures of docs/afferents.md.

`python -m studies.afferents_page` presses a probe, a ball and a stroke, and writes them anew (five minutes);
with names of parts ("mixed") only those.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

import fingerpad as fp
from fingerpad.core.errors import InertiaWarning
from fingerpad.core.regions import Ellipse
from fingerpad.report.mixed_responses import draw_mixed_responses
from fingerpad.report.style import write_png

IMAGES = Path(__file__).parents[1] / "docs" / "images"
DISC = Ellipse(5.0, 5.0, centre_mm=(17.37, 0.0))
BALL = fp.Sphere(curvature_per_m=287)
TOUCHES = {
    "press of 1 mm": fp.RampAndHold(depth_mm=1.0, hold_ms=350.0),
    "vibration of 40 Hz, amplitude 50 µm": fp.sine(
        depth_mm=0.5, amplitude_mm=0.05, frequency_hz=40.0, cycles=8, hold_ms=100.0
    ),
    "stroke of 20 mm/s": fp.stroke(depth_mm=0.5, speed_mm_per_s=20.0, x_mm=3.0, strokes=1, hold_ms=100.0),
}


def indented(indenter: fp.Indenter, motion: object, materials: str = "human") -> fp.SkinResponse:
    """Press at quick resolution, without the warning of inertia, about which the page speaks."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        return fp.indent(fp.Fingertip(), indenter, motion, materials)  # type: ignore[arg-type]


def mixed() -> None:
    """Draw a mixed population under a press, a vibration and a stroke."""
    population = fp.MixedPopulation.at_densities(DISC, seed=1)
    windows = (0.0, 50.0), (100.0, 300.0)
    maps = {
        name: population.respond(indented(BALL, motion), *windows).maps for name, motion in TOUCHES.items()
    }
    write_png(draw_mixed_responses, maps, IMAGES / "mixed_responses.png")


PARTS = {"mixed": mixed}


def main(names: Sequence[str]) -> None:
    """Make all parts, or the named ones."""
    for name in names or PARTS:
        PARTS[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
