"""A touch in real time: how long a reduced touch takes to make and to evaluate, and how far it is off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

import fingerpad as fp
from benchmarks.measuring import run_job
from benchmarks.results import Report, Table
from fingerpad.reduction.building import draw_touch, streamed
from fingerpad.reduction.training import ReducedRange, ReducedTraining

THREADS, HELD_OUT, RATES, SEED = 2, 20, 6, 7
RANGE = ReducedRange(depth_mm=1.5, x_mm=(-2.0, 2.0))
AFFERENTS = 955
STEP_MS, DURATION_MS = 1.0, 1000.0
SED_ERROR, FORCE_ERROR = 0.02, 0.01


def answer(resolution: str) -> dict[str, Any]:
    """Make the reduced touch, time its steps, and compare it with full touches that it does not know."""
    finger, ball = fp.Fingertip(), fp.Sphere(curvature_per_m=287.0)
    touch = fp.touch_of(finger, ball, fp.RampAndHold(depth_mm=0.3))
    touch.solve(threads=THREADS)  # loads kernels
    training = ReducedTraining(touch, RANGE, resolution)
    started = perf_counter()
    model = fp.reduce_touch(training)
    built_s = perf_counter() - started
    with TemporaryDirectory() as folder:
        fp.write_reduced(model, Path(folder) / "model.npz")
        size_mb = (Path(folder) / "model.npz").stat().st_size / 1e6
    random = np.random.default_rng(SEED)
    errors, covered = [], []
    for _ in range(HELD_OUT):
        shape, drawn = draw_touch(training, model, random)
        wrong, peaks, inside = streamed(model, drawn.solve(threads=THREADS), shape)
        errors.append((wrong / peaks).tolist())
        covered.append(bool(inside))
    return {
        "built_s": built_s,
        "size_mb": size_mb,
        "modes": len(model.modes),
        "poses": len(model.first_touch_mm),
        "errors": errors,
        "covered": covered,
        "rates": _rate_errors(training, model, random),
        **_step_times(model, finger),
    }


def _places(finger: fp.Fingertip) -> np.ndarray:
    """Places of the afferents, on a square of the pad, (n, 2)."""
    x, z = finger.contact_mm
    side = int(np.ceil(np.sqrt(AFFERENTS)))
    line = np.linspace(-5.0, 5.0, side)
    return np.stack(np.meshgrid(x + line, z + line), axis=-1).reshape(-1, 2)[:AFFERENTS]


def _step_times(model: fp.ReducedModel, finger: fp.Fingertip) -> dict[str, float]:
    """Seconds of a touch of 1 s, and milliseconds of a step of the skin and of the afferents."""
    sites, afferent = _places(finger), fp.Afferent()
    skin_ms, spikes_ms = [], []
    for measured in (False, True):
        stream, responding = fp.ReducedTouch(model, sites), fp.AfferentStream(afferent, len(sites))
        for time in np.arange(STEP_MS, DURATION_MS + STEP_MS, STEP_MS).tolist():
            begun = perf_counter()
            sample = stream.step(time, depth_mm=min(time / 50.0, 1.0), x_mm=0.001 * time)
            solved = perf_counter()
            responding.step(time, sample.fields[afferent.static_quantity])
            if measured:
                skin_ms.append(1e3 * (solved - begun))
                spikes_ms.append(1e3 * (perf_counter() - solved))
    return {
        "touch_s": (sum(skin_ms) + sum(spikes_ms)) / 1e3,
        **{f"step_p{p}_ms": float(np.percentile(skin_ms, p)) for p in (50, 99)},
        **{f"spikes_p{p}_ms": float(np.percentile(spikes_ms, p)) for p in (50, 99)},
    }


def _rate_errors(
    training: ReducedTraining, model: fp.ReducedModel, random: np.random.Generator
) -> list[list[float]]:
    """Largest errors of dynamic and static rates at any afferent, of touches by ramp and hold."""
    finger = fp.Fingertip()
    sites, afferent, found = _places(finger), fp.Afferent(), []
    quantity = afferent.static_quantity
    for _ in range(RATES):
        depth_mm, ramp_ms = random.uniform(0.5, 1.4), random.uniform(40.0, 120.0)
        motion = fp.Trajectory((0.0, ramp_ms, 1000.0), depth_mm=(0.0, depth_mm, depth_mm))
        touch = training.touch_with((), motion)
        skin = replace(touch, settings=fp.PressSettings(12, 12)).solve(threads=THREADS)
        stream = fp.ReducedTouch(model, sites)
        values = [
            stream.step(float(t), float(motion.prescribed_at(t))).fields[quantity] for t in skin.times_ms
        ]
        full = skin.sed(sites, quantity, quantity)
        reduced = replace(full, sed_kpa=np.array(values))
        rates = [np.array(afferent.rates(traces)) for traces in (full, reduced)]
        found.append(np.abs(rates[1] - rates[0]).max(axis=1).tolist())
    return found


def measure() -> Report:
    """Make and try one reduced touch, in a fresh process."""
    run = run_job("reduced", "answer", THREADS, resolution="quick")
    got = run.answer
    errors = np.array(got["errors"])
    names = ("compressive stress", "SED", "force")
    allowed = (SED_ERROR, SED_ERROR, FORCE_ERROR)
    rates = np.array(got["rates"])
    within = [(column <= limit).mean() for column, limit in zip(errors.T, allowed, strict=True)]
    return Report(
        name="reduced",
        title="A touch in real time",
        about=(
            f"Sphere of 287 /m at `quick`, up to {RANGE.depth_mm:g} mm deep and 2 mm to either side along "
            f"the finger, {THREADS} threads. Made from {got['poses']} poses of five presses and 20 touches "
            f"for its error; tried on {HELD_OUT} other random touches, half of them sliding, and {RATES} by "
            f"ramp and hold for the rates of {AFFERENTS} afferents. Errors are over the peak of each touch."
        ),
        tables=[
            Table(
                "Errors of touches that were not used:",
                ["quantity", "median", "95 %", "largest", "allowed", "touches within"],
                [
                    [
                        name,
                        f"{np.median(column):.2%}",
                        f"{np.percentile(column, 95):.2%}",
                        f"{column.max():.2%}",
                        f"{limit:.0%}",
                        f"{share:.0%}",
                    ]
                    for name, column, limit, share in zip(names, errors.T, allowed, within, strict=True)
                ],
            ),
            Table(
                "Largest errors of rates, spikes/s:",
                ["rate", "median of touches", "largest"],
                [
                    [name, f"{np.median(column):.1f}", f"{column.max():.1f}"]
                    for name, column in zip(("dynamic", "static"), rates.T, strict=True)
                ],
            ),
            Table(
                "Time and size:",
                ["what", "median", "99 %"],
                [
                    ["a step of the skin, ms", f"{got['step_p50_ms']:.2f}", f"{got['step_p99_ms']:.2f}"],
                    [
                        f"{AFFERENTS} afferents, ms",
                        f"{got['spikes_p50_ms']:.3f}",
                        f"{got['spikes_p99_ms']:.3f}",
                    ],
                    ["whole touch of 1 s, s", f"{got['touch_s']:.2f}", ""],
                    ["making it, s", f"{got['built_s']:.0f}", ""],
                    ["file, MB", f"{got['size_mb']:.1f}", ""],
                ],
            ),
        ],
        measured={
            "reduced_sed_share": float(within[1]),
            "reduced_force_share": float(within[2]),
            "reduced_coverage": float(np.mean(got["covered"])),
            "reduced_static_rate": float(rates[:, 1].max()),
            "reduced_dynamic_rate": float(rates[:, 0].max()),
            "reduced_step_ms": got["step_p99_ms"],
            "reduced_spikes_ms": got["spikes_p99_ms"],
            "reduced_touch_s": got["touch_s"],
            "reduced_built_s": got["built_s"],
            "reduced_size_mb": got["size_mb"],
        },
    )
