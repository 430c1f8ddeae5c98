"""Mixed afferents of one finger: from the solved skin to all spikes of 1 s of touch."""

from __future__ import annotations

from time import perf_counter, process_time
from typing import Any

import numpy as np

import fingerpad as fp
from benchmarks.measuring import Spread, run_job
from benchmarks.results import Report, Table
from fingerpad.core.regions import Ellipse
from fingerpad.neuron.population import PUBLISHED_DENSITIES

AFFERENTS, THREADS, REPEATS = 4000, 2, 5
DISC = Ellipse(5.0, 5.0, centre_mm=(17.37, 0.0))
SPHERE_PER_M = 287.0
TOUCHES: dict[str, tuple[str, dict[str, float]]] = {
    "press of 1 mm and hold": ("RampAndHold", {"depth_mm": 1.0}),
    "vibration of 40 Hz on a hold": (
        "sine",
        {"depth_mm": 0.8, "amplitude_mm": 0.05, "frequency_hz": 40.0, "cycles": 32, "hold_ms": 150.0},
    ),
    "vibration of 200 Hz on a hold": (
        "sine",
        {"depth_mm": 0.5, "amplitude_mm": 0.01, "frequency_hz": 200.0, "cycles": 100, "hold_ms": 450.0},
    ),
}


def crowd(afferents: int = AFFERENTS) -> fp.Population:
    """Afferents of the four types, at a multiple of the published densities, on a disc of the pad."""
    densities = PUBLISHED_DENSITIES
    factor = afferents / (sum(densities.values()) * DISC.area_mm2 / 100.0)
    return fp.Population.at_densities(DISC, {name: factor * each for name, each in densities.items()})


def answer(kind: str) -> dict[str, Any]:
    """Let them answer a touch, once for the kernels, then measured; seconds and processor seconds."""
    motion, numbers = TOUCHES[kind]
    skin = fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=SPHERE_PER_M), getattr(fp, motion)(**numbers))
    population = crowd()
    windows = (30.0, 50.0), (600.0, 950.0)
    response = population.respond(skin, *windows)
    seconds, processor = [], []
    for _ in range(REPEATS):
        started, used = perf_counter(), process_time()
        response = population.respond(skin, *windows)
        seconds.append(perf_counter() - started)
        processor.append(process_time() - used)
    return {
        "seconds": seconds,
        "processor": processor,
        "afferents": len(population),
        "spikes": int(response.spikes.times_ms.size),
        "times": int(skin.times_ms.size),
        "end_ms": float(np.max(skin.times_ms)),
    }


def measure() -> Report:
    """Measure all touches, each in a fresh process."""
    answers = {kind: run_job("mixed_population", "answer", THREADS, kind=kind).answer for kind in TOUCHES}
    seconds, processor = (
        {kind: Spread.of(found[name]) for kind, found in answers.items()} for name in ("seconds", "processor")
    )
    return Report(
        name="mixed_population",
        title="Mixed afferents of one finger",
        about=f"{REPEATS} answers each, {THREADS} threads: median (smallest to largest). Processor time, of "
        "both threads, hardly depends on other programs.",
        tables=[
            Table(
                "Four types, at a multiple of the published densities, from the solved skin to all spikes:",
                ["touch", "afferents", "times of the skin", "touch, ms", "s", "processor, s", "spikes"],
                [
                    [
                        kind,
                        found["afferents"],
                        found["times"],
                        f"{found['end_ms']:.0f}",
                        str(seconds[kind]),
                        str(processor[kind]),
                        found["spikes"],
                    ]
                    for kind, found in answers.items()
                ],
            )
        ],
        measured={"mixed_s": max(spread.median for spread in seconds.values())},
    )
