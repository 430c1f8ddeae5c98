"""A touch in real time: how long a reduced touch takes to make and to evaluate, and how far it is off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any, cast

import numpy as np

import fingerpad as fp
from benchmarks.measuring import run_job
from benchmarks.results import Report, Table
from fingerpad.experiments.runner import Runner
from fingerpad.reduction.building import draw_touch, largest_errors, streamed
from fingerpad.reduction.model import ReducedModel, write_reduced
from fingerpad.reduction.training import ReducedTraining
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

JOBS, HELD_OUT, RATES, SEED = 2, 20, 6, 7
RESOLUTION, DEEPEST_MM, ASIDE_MM = "standard", 1.5, 2.0
AFFERENTS = 955
STEP_MS, DURATION_MS = 1.0, 1000.0
SED_ERROR, FORCE_ERROR = 0.02, 0.01
RATE_ERRORS = (10.0, 3.0)
"""Wanted of dynamic and static rates. [spikes/s]"""
STRESS_CHANGES = (1e-4, 1e-3)
"""Relative changes of the stress of full touches that tell how much of the errors of rates is unavoidable."""


def answer(resolution: str) -> dict[str, Any]:
    """Make the reduced touch, time its steps, and compare it with full touches that it does not know."""
    request = fp.ReductionRequest.read(
        {
            "object": {"kind": "sphere", "curvature_per_m": 287.0},
            "resolution": resolution,
            "range": {"depth_mm": DEEPEST_MM, "x_mm": [-ASIDE_MM, ASIDE_MM]},
        }
    )
    with TemporaryDirectory() as folder:
        runner = Runner(Path(folder), JOBS)
        started = perf_counter()
        model = request.run(runner)
        built_s = perf_counter() - started
        write_reduced(model, Path(folder) / "model.npz")
        size_mb = (Path(folder) / "model.npz").stat().st_size / 1e6
        random = np.random.default_rng(SEED)
        drawn = [draw_touch(request.training, model, random) for _ in range(HELD_OUT)]
        held = [_held(request.training, random) for _ in range(RATES)]
        touches = {"held out": [touch for _, touch in drawn], "rates": held}
        found = runner.responses({stage: dict(enumerate(each)) for stage, each in touches.items()})
    compared = [_errors(model, found["held out"][n], shape) for n, (shape, _) in enumerate(drawn)]
    return {
        "built_s": built_s,
        "size_mb": size_mb,
        "modes": len(model.modes),
        "poses": len(model.first_touch_mm),
        "errors": [(wrong / peaks).tolist() for wrong, peaks, _ in compared],
        "covered": [inside for _, _, inside in compared],
        "rates": [_rate_errors(model, skin) for skin in found["rates"].values()],
        **_step_times(model),
    }


def _errors(
    model: ReducedModel, skin: SkinResponse, shape: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Largest errors and values of quantities and force, and whether the bounds hold."""
    rows = list(streamed(model, skin, shape))
    wrong, known = (np.max([getattr(row, name) for row in rows], axis=0) for name in ("wrong", "known"))
    return wrong, known, bool((largest_errors(model, skin, shape) <= model.error).all())


def _places() -> np.ndarray:
    """Places of the afferents, on a square of the pad, (n, 2)."""
    x, z = fp.Fingertip().contact_mm
    side = int(np.ceil(np.sqrt(AFFERENTS)))
    line = np.linspace(-5.0, 5.0, side)
    return np.stack(np.meshgrid(x + line, z + line), axis=-1).reshape(-1, 2)[:AFFERENTS]


def _step_times(model: ReducedModel) -> dict[str, float]:
    """Seconds of a touch of 1 s, and milliseconds of a step of the skin and of the afferents."""
    sites, afferent, times_ms = _places(), fp.Afferent(), np.arange(STEP_MS, DURATION_MS + STEP_MS, STEP_MS)
    took: dict[str, list[float]] = {}
    forces_mn: list[float] = []
    for way in ("warming up", "depth", "force"):
        stream, responding = fp.ReducedTouch(model, sites), fp.AfferentStream(afferent, len(sites))
        took[way], took["spikes"] = [], []
        for n, time in enumerate(times_ms.tolist()):
            depth_mm, force_mn = (None, forces_mn[n]) if way == "force" else (min(time / 50.0, 1.0), None)
            begun = perf_counter()
            sample = stream.step(time, depth_mm, force_mn, x_mm=0.001 * time)
            solved = perf_counter()
            responding.step(
                time, sample.fields[afferent.static_quantity], sample.fields[afferent.dynamic_quantity]
            )
            took[way].append(1e3 * (solved - begun))
            took["spikes"].append(1e3 * (perf_counter() - solved))
            if way == "depth":
                forces_mn.append(sample.force_mn)
        if way == "depth":
            touch_s = (sum(took[way]) + sum(took["spikes"])) / 1e3
    percentiles = {
        f"{what}_p{p}_ms": float(np.percentile(took[what], p))
        for what in ("depth", "force", "spikes")
        for p in (50, 99)
    }
    return {"touch_s": touch_s, **percentiles}


def _held(training: ReducedTraining, random: np.random.Generator) -> Touch:
    """Draw a ramp and hold."""
    depth_mm, ramp_ms = random.uniform(0.5, 1.4), random.uniform(40.0, 120.0)
    motion = fp.Trajectory((0.0, ramp_ms, 1000.0), depth_mm=(0.0, depth_mm, depth_mm))
    return replace(training.touch_with((), motion), settings=fp.PressSettings(12, 12))


def _rate_errors(model: ReducedModel, skin: SkinResponse) -> list[list[float]]:
    """Errors of dynamic and static rates of a ramp and hold: the largest, and the share within limits.

    First those of the reduced touch, then those of the full touch with its stress changed.
    """
    sites, afferent = _places(), fp.Afferent()
    motion = cast(Touch, skin.touch).stimulus
    stream = fp.ReducedTouch(model, sites)
    fields = [stream.step(float(t), float(motion.prescribed_at(t))).fields for t in skin.times_ms]
    full = skin.sed(sites, afferent.dynamic_quantity, afferent.static_quantity)
    names = afferent.static_quantity, afferent.dynamic_quantity
    values, driving = (np.array([each[name] for each in fields]) for name in names)
    reduced = replace(full, values=values, dynamic=replace(full.dynamic_term, values=driving))
    wanted = np.array(afferent.rates(full))
    errors = []
    for traces in (reduced, *(full.scaled(np.full(len(sites), 1.0 + change)) for change in STRESS_CHANGES)):
        wrong = np.abs(np.array(afferent.rates(traces)) - wanted)
        within = (wrong <= np.array(RATE_ERRORS)[:, None]).mean(axis=1)
        errors.append([*wrong.max(axis=1).tolist(), *within.tolist()])
    return errors


def measure() -> Report:
    """Make and try one reduced touch, in a fresh process."""
    run = run_job("reduced", "answer", JOBS, resolution=RESOLUTION)
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
            f"Sphere of 287 /m at `{RESOLUTION}`, up to {DEEPEST_MM:g} mm deep and {ASIDE_MM:g} mm to either "
            f"side along the finger, {JOBS} processes. Made from {got['poses']} poses of five presses, one "
            f"press that goes deeper and back, and 20 touches for its error; tried on {HELD_OUT} other "
            f"random touches, half of them sliding, and {RATES} by ramp and hold for the rates of "
            f"{AFFERENTS} afferents. Errors are over the peak of each touch."
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
                ["rate", "median of touches", "largest", "allowed", "afferents within"],
                [
                    [
                        f"{name}{of}",
                        f"{np.median(rates[:, row, n]):.1f}",
                        f"{rates[:, row, n].max():.1f}",
                        f"{RATE_ERRORS[n]:g}",
                        f"{rates[:, row, 2 + n].mean():.2%}",
                    ]
                    for row, of in enumerate(
                        ["", *(f", full touch, stress times {1.0 + change:g}" for change in STRESS_CHANGES)]
                    )
                    for n, name in enumerate(("dynamic", "static"))
                ],
            ),
            Table(
                "Time and size:",
                ["what", "median", "99 %"],
                [
                    *(
                        [what, f"{got[f'{name}_p50_ms']:.2f}", f"{got[f'{name}_p99_ms']:.2f}"]
                        for what, name in (
                            ("a step of the skin to a depth, ms", "depth"),
                            ("to a force, ms", "force"),
                            (f"{AFFERENTS} afferents, ms", "spikes"),
                        )
                    ),
                    ["whole touch of 1 s, s", f"{got['touch_s']:.2f}", ""],
                    ["making it, s", f"{got['built_s']:.0f}", ""],
                    ["file, MB", f"{got['size_mb']:.1f}", ""],
                ],
            ),
        ],
        notes=[
            "A rate is read from the spikes in a window: a spike that passes its end, or the second spike of "
            "an afferent near its threshold, changes it at once. The rows of the full touch show by how much "
            "the largest of so many afferents changes if nothing but its stress changes a little."
        ],
        measured={
            "reduced_sed_share": float(within[1]),
            "reduced_force_share": float(within[2]),
            "reduced_coverage": float(np.mean(got["covered"])),
            "reduced_static_rate": float(rates[:, 0, 1].max()),
            "reduced_dynamic_rate": float(rates[:, 0, 0].max()),
            "reduced_step_ms": max(got["depth_p99_ms"], got["force_p99_ms"]),
            "reduced_spikes_ms": got["spikes_p99_ms"],
            "reduced_touch_s": got["touch_s"],
            "reduced_built_s": got["built_s"],
            "reduced_size_mb": got["size_mb"],
        },
    )
