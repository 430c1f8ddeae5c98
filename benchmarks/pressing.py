"""The press that most benchmarks measure, one sphere into a finger of some resolution, and a few others."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import psutil

if TYPE_CHECKING:  # a benchmark is listed and reported without importing what it measures
    from fingerpad.skin.indentation import Touch
    from fingerpad.skin.sampling import SkinResponse

CURVATURE_PER_M = 287.0
PRESSED = f"A sphere of {CURVATURE_PER_M:g} per m indented by 1.0 mm, ramp of 50 ms and hold of 950 ms"
CASES = {
    "sphere": "sphere of 287 per m, 1 mm",
    "cylinder": "cylinder of 3.17 mm, 1 mm",
    "bar": "bar of 3 mm, 1 mm",
    "force": "sphere of 287 per m, 0.5 N",
    "slide": "sphere of 287 per m, 1 mm, slides 2 mm with friction 0.5",
    "punch": "punch of 1 mm, 1 mm, with friction 0.5",
}
"""Presses at `quick`."""

COLUMNS = ("nodes", "elements", "Newton steps", "factors")
"""Headings of what `work` tells."""

BASE_GROWTH = 1.25
"""Ratio of neighbouring elements where the factor of refinement is 1; the finer, the closer to 1."""


def press(
    resolution: str, refinement: float | None = None, layers: tuple[int, int, int, int] = (4, 1, 4, 4)
) -> dict[str, Any]:
    """Press the sphere as the paper does: 1.0 mm within 50 ms, then hold for 950 ms.

    Parameters
    ----------
    resolution : str
        "quick", "standard" or "paper": mesh and steps.
    refinement : float, optional
        Divides all sizes of elements on the skin of that mesh.
    layers : (int, int, int, int)
        With a refinement, the elements through stratum corneum, living epidermis, dermis and subcutis.

    Returns
    -------
    dict
        Seconds of `Touch.solve`, meshing included; memory before it, size, work and two results.
    """
    touch = touch_of_sphere(resolution, refinement, layers)
    before_mb = psutil.Process().memory_info().rss / 1e6
    started = perf_counter()
    skin = touch.solve()
    return {"solve_s": perf_counter() - started, "before_mb": before_mb, **summary(skin)}


def press_case(case: str) -> dict[str, Any]:
    """Make one of the presses of `CASES` at `quick`, and return its seconds, size and work."""
    touch = touch_of_case(case)
    started = perf_counter()
    skin = touch.solve()
    return {"solve_s": perf_counter() - started, **summary(skin)}


def touch_of_case(case: str) -> Touch:
    """Describe a press of `CASES`.

    Examples
    --------
    >>> [touch_of_case(case).friction for case in CASES]
    [0.0, 0.0, 0.0, 0.0, 0.5, 0.5]
    """
    import fingerpad as fp

    sphere = fp.Sphere(curvature_per_m=CURVATURE_PER_M)
    slide = fp.stroke(depth_mm=1.0, speed_mm_per_s=20.0, x_mm=[2.0])
    press: dict[str, tuple[Any, Any, float]] = {
        "sphere": (sphere, fp.RampAndHold(1.0), 0.0),
        "cylinder": (fp.Cylinder(), fp.RampAndHold(1.0), 0.0),
        "bar": (fp.Bar(3.0), fp.RampAndHold(1.0), 0.0),
        "force": (sphere, fp.ForceRampAndHold(500.0), 0.0),
        "slide": (sphere, slide, 0.5),
        "punch": (fp.FlatPunch(1.0), fp.RampAndHold(1.0), 0.5),
    }
    body, motion, friction = press[case]
    return fp.touch_of(fp.Fingertip(), body, motion, friction=friction, resolution="quick")


def touch_of_sphere(
    resolution: str, refinement: float | None = None, layers: tuple[int, int, int, int] = (4, 1, 4, 4)
) -> Touch:
    """Describe the press; arguments as in `press`.

    Examples
    --------
    >>> touch_of_sphere("standard", 2.0, (8, 2, 8, 8)).grading.size_x_mm
    0.125
    """
    from fingerpad import Fingertip, Sphere, touch_of

    touch = touch_of(Fingertip(), Sphere(curvature_per_m=CURVATURE_PER_M), resolution=resolution)
    if refinement is None:
        return touch
    coarse, (corneum, living, dermis, subcutis) = touch.grading, layers
    return replace(
        touch,
        grading=replace(
            coarse,
            size_x_mm=coarse.size_x_mm / refinement,
            size_z_mm=coarse.size_z_mm / refinement,
            largest_mm=coarse.largest_mm / refinement,
            growth=BASE_GROWTH ** (1.0 / refinement),
            stratum_corneum=corneum,
            living_epidermis=living,
            dermis=dermis,
            subcutis=subcutis,
        ),
    )


def work(found: dict[str, Any]) -> list[int]:
    """Size of the mesh and work of a press that `press` tells of."""
    return [found[name] for name in ("nodes", "elements", "newton_steps", "factorisations")]


def summary(skin: SkinResponse) -> dict[str, Any]:
    """Size and work of a press, and two of its results, by which runs can be told to agree."""
    return {
        "nodes": len(skin.mesh.nodes_mm),
        "elements": len(skin.mesh.elements),
        "steps": skin.times_ms.size - 1,
        "newton_steps": skin.newton_steps,
        "factorisations": skin.factorisations,
        "force_mn": float(skin.force_mn[-1]),
        "sed_kpa": float(skin.sed_kpa.max()),
    }
