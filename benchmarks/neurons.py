"""fingerpad beside Brian2, in one run: the same leaky integrate-and-fire afferents."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.installing import environment_of
from benchmarks.measuring import run_job
from benchmarks.results import Report, Table

THREADS = 2
AFFERENTS = 100_000

JUDGED_STEP_MS = 0.1
BRIAN2_RUNS = (("cython", JUDGED_STEP_MS), ("standalone", JUDGED_STEP_MS), ("cython", 0.01))
"""How Brian2 runs, and its step. [ms]"""


def neurons(afferents: int, threads: int) -> tuple[list[list[Any]], dict[str, float], str]:
    """Fire the same afferents with fingerpad and Brian2.

    Returns
    -------
    list of lists, dict, str
        Rows of the table, numbers that have targets, and what checks our spike times.
    """
    from benchmarks.peer_neurons import STEPS_MS, write_currents

    python = environment_of("brian2")
    with TemporaryDirectory() as name:
        currents = str(write_currents(Path(name) / "currents.npz", afferents))
        found, theirs = str(Path(name) / "ours.npz"), str(Path(name) / "theirs.npz")
        mine = run_job("peer_neurons", "fire", threads, currents=currents, found=found).answer
        checked = run_job("peer_neurons", "check", 1, currents=currents, every=max(afferents // 20, 1)).answer
        rows: list[list[Any]] = [["fingerpad", None, mine["spikes"], mine["solve_s"], None, None, None, None]]
        ratios, errors_ms = [], []
        for mode, step_ms in BRIAN2_RUNS:
            fired = run_job(
                "peer_brian2", "fire", threads, python,
                currents=currents, found=theirs, step_ms=step_ms, mode=mode, cores=threads,
            ).answer  # fmt: skip
            off = run_job("peer_neurons", "timing", 1, ours=found, theirs=theirs).answer
            ratios.append(fired["solve_s"] / mine["solve_s"])
            errors_ms.append(off["largest_ms"])
            told = [f"{fired['version']}, {mode}", step_ms, fired["spikes"], fired["solve_s"], ratios[-1]]
            rows.append([*told, off["rms_ms"], off["largest_ms"], off["same_count_percent"]])
    exact_ms = checked["differences_ms"]
    left = ", ".join(f"{off:.2g} ms at {step:g} ms" for off, step in zip(exact_ms, STEPS_MS, strict=True))
    note = (
        f"Our spike times compared with Runge-Kutta on {checked['afferents']} of the afferents: the largest "
        f"difference is {left}. It decreases with the step, because Runge-Kutta delays each spike by up to "
        "one step."
    )
    judged = [n for n, (_, step_ms) in enumerate(BRIAN2_RUNS) if step_ms == JUDGED_STEP_MS]
    measured = {
        "brian2_ratio": min(ratios[n] for n in judged),
        # What is left at the smallest step is Runge-Kutta's own error: ours is at most that.
        "brian2_timing_ratio": exact_ms[-1] / min(errors_ms[n] for n in judged),
    }
    return rows, measured, note


def measure(afferents: int = AFFERENTS, threads: int = THREADS) -> Report:
    """Fire with both programs."""
    rows, measured, note = neurons(afferents, threads)
    return Report(
        name="neurons",
        title="Comparison with another neuron simulator",
        about=(
            f"{afferents:,} leaky integrate-and-fire afferents for 1 s. Both programs read the same file of "
            f"currents and may use {threads} threads."
        ),
        tables=[
            Table(
                "Timing: differences between spikes of the same index in the same train:",
                [
                    "program", "step, ms", "spikes", "s", "times our time", "timing, RMS, ms",
                    "largest, ms", "same number of spikes, %",
                ],
                rows,
            )
        ],
        measured=measured,
        notes=[
            "Times exclude imports and compilation.",
            note,
            "Brian2 records spikes at its time steps and starts the refractory period one step early; these "
            "errors accumulate. The target uses its fastest mode at 0.1 ms. Its time is proportional to the "
            "number of steps, ours to the number of spikes.",
        ],
    )  # fmt: skip
