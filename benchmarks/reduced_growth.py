"""How the time of a step of a reduced touch grows with receptors, modes and poses."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

import fingerpad as fp
from benchmarks.measuring import run_job
from benchmarks.results import Report, Table
from fingerpad.reduction.building import reduce_touch
from fingerpad.reduction.model import ReducedModel
from fingerpad.reduction.training import Axis, ReducedRange, ReducedTraining

THREADS = 2
DEPTH_MM, ASIDE_MM = 1.0, 1.0
RECEPTORS = (100, 1_000, 10_000)
MODES = (10, 20, 40)
ACROSS = (3, 9, 27)
"""Poses across the finger, for each along it."""
WARMING, STEPS, STEP_MS = 50, 400, 1.0


def answer(deepest_mm: float) -> dict[str, Any]:
    """Make a reduced touch, and time steps while one of the sizes changes."""
    touch = fp.touch_of(fp.Fingertip(), fp.Sphere(curvature_per_m=287.0))
    model = reduce_touch(
        ReducedTraining(touch, ReducedRange(deepest_mm, x_mm=(-ASIDE_MM, ASIDE_MM))), calibration=0
    )
    middle = RECEPTORS[1]
    return {
        "modes": len(model.modes),
        "poses": len(model.first_touch_mm),
        "by_receptors": [_step_ms(model, receptors) for receptors in RECEPTORS],
        "by_modes": [_step_ms(_with_modes(model, modes), middle) for modes in MODES],
        "by_poses": [_step_ms(_across(model, across), middle) for across in ACROSS],
    }


def _with_modes(model: ReducedModel, n_modes: int) -> ReducedModel:
    """Model with the first of its modes, or with some of them twice."""
    chosen = np.arange(n_modes) % len(model.modes)
    return replace(model, modes=model.modes[chosen], coefficients=model.coefficients[..., chosen])


def _across(model: ReducedModel, n_poses: int) -> ReducedModel:
    """Model that has its poses also across the finger, all alike."""
    along, _, *others = model.axes
    arrays: dict[str, Any] = {
        name: np.repeat(getattr(model, name), n_poses, axis=0)
        for name in ("first_touch_mm", "middle_mm", "totals", "coefficients")
    }
    return replace(model, axes=(along, Axis("z_mm", -ASIDE_MM, ASIDE_MM, n_poses), *others), **arrays)


def _step_ms(model: ReducedModel, n_receptors: int) -> float:
    """Median time of a step. [ms]"""
    aside_mm = np.random.default_rng(1).uniform(-5.0, 5.0, (n_receptors, 2))
    stream = fp.ReducedTouch(model, np.array(fp.Fingertip().contact_mm) + aside_mm)
    took = []
    for n in range(1, WARMING + STEPS):
        begun = perf_counter()
        stream.step(n * STEP_MS, depth_mm=min(0.01 * n, 0.5), x_mm=ASIDE_MM * n / (WARMING + STEPS))
        took.append(1e3 * (perf_counter() - begun))
    return float(np.median(took[WARMING:]))


def measure() -> Report:
    """Time the steps of one reduced touch in a fresh process."""
    got = run_job("reduced_growth", "answer", THREADS, deepest_mm=DEPTH_MM).answer
    middle = f"{RECEPTORS[1]:,} receptors"
    return Report(
        name="reduced_growth",
        title="Growth of a step of a reduced touch",
        about=(
            f"Median time of {STEPS} steps of {STEP_MS:g} ms of a reduced touch with {got['modes']} modes "
            f"from {got['poses']} poses, a sphere that presses and slides. Sizes are made by leaving out or "
            "repeating modes and poses."
        ),
        tables=[
            Table(
                "Time of a step, ms:",
                ["what", "small", "middle", "large"],
                [
                    [
                        f"{', '.join(f'{size:,}' for size in sizes)} {what}",
                        *(f"{value:.2f}" for value in got[name]),
                    ]
                    for what, sizes, name in (
                        ("receptors", RECEPTORS, "by_receptors"),
                        (f"modes, {middle}", MODES, "by_modes"),
                        (f"poses, {middle}", [got["poses"] * each for each in ACROSS], "by_poses"),
                    )
                ],
            )
        ],
    )
