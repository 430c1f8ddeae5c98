"""Fitting one afferent to its rates under a bar, given strain energy density, the paper's way and others."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.measuring import Spread, run_job
from benchmarks.results import Report, Table
from fingerpad.core.signals import Traces
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.fit.fit import prepare
from fingerpad.experiments.gerling2014 import nerve
from fingerpad.inference.afferent_fit import response_surface, start_points
from fingerpad.inference.fitting.methods import Method, cross_validate, interleaved_folds
from fingerpad.inference.rate_model import AfferentModel, RateProblem
from fingerpad.neuron.afferent import Afferent
from fingerpad.skin.store import Store, solve_missing

JOBS, REPEATS = 2, 3
RESOLUTION = "quick"
"""Of the presses, which are not timed: a fit takes as long on the finest mesh, for it sees one receptor."""


def press(folder: str, traces: str) -> dict[str, Any]:
    """Press the bar at all shifts and keep what the receptor feels.

    Parameters
    ----------
    folder, traces : str
        Where presses are stored, and the file to be written.

    Returns
    -------
    dict
        Number of times and of shifts.
    """
    touches, store = Conditions(resolution=RESOLUTION).bar_touches(), Store(Path(folder))
    solve_missing(store.missing(touches), JOBS)
    sed = nerve.sed_at_receptor([store.load(touch) for touch in touches])
    np.savez(traces, times_ms=sed.times_ms, sed_kpa=sed.values, kinks_ms=sed.kinks_ms)
    return {"times": sed.times_ms.size, "shifts": sed.n_sites}


def fit(traces: str) -> dict[str, Any]:
    """Fit all folds by every method, one thread.

    Parameters
    ----------
    traces : str
        Written by `press`.

    Returns
    -------
    dict
        By method: seconds, runs of the model and FSS on the testing positions; seconds of one run.
    """
    with np.load(traces) as stored:
        sed = Traces(stored["times_ms"], stored["sed_kpa"], stored["kinks_ms"])
    model = AfferentModel.of_traces(sed)
    six = nerve.rate_problem(sed, Afferent.for_tissues("paper"))
    folds = interleaved_folds(six.n_observations)
    cases: list[tuple[RateProblem, Method]] = [(six, response_surface())]
    for name in ("least_squares", "closed_form", "cma_es"):
        prepared = prepare(name, model, six.recordings, six.recordings, 0)
        cases.append((prepared.problem, prepared.method))
    start = start_points()[0]
    six.score(start, np.arange(six.n_observations))  # loads compiled kernels
    found: dict[str, Any] = {}
    for problem, method in cases:
        started = perf_counter()
        crossed = cross_validate(problem, method, folds)
        found[method.name] = {
            "seconds": perf_counter() - started,
            "runs": sum(fold.fit.n_evaluations for fold in crossed.folds),
            "fss": crossed.score_test,
        }
    return found


def measure() -> Report:
    """Press once, then fit in fresh processes."""
    with TemporaryDirectory() as name:
        traces = str(Path(name) / "traces.npz")
        run_job("fitting", "press", 1, folder=str(Path(name) / "indentations"), traces=traces)
        runs = [run_job("fitting", "fit", 1, traces=traces).answer for _ in range(REPEATS)]
    seconds = {method: Spread.of([run[method]["seconds"] for run in runs]) for method in runs[0]}
    paper = response_surface().name
    return Report(
        name="fitting",
        title="Fits",
        about=(
            "One afferent, 36 positions of a bar, six folds, given the SED at the receptor; one thread, "
            f"{REPEATS} runs each in fresh processes: median (smallest to largest)."
        ),
        tables=[
            Table(
                "All six folds:",
                ["method", "s", "runs of the model", "ms per run", "FSS on testing positions"],
                [
                    [
                        method,
                        str(spread),
                        runs[0][method]["runs"],
                        round(1000.0 * spread.median / runs[0][method]["runs"], 3),
                        round(runs[0][method]["fss"], 3),
                    ]
                    for method, spread in seconds.items()
                ],
            )
        ],
        measured={"session_s": seconds[paper].median},
        notes=[
            f"The {paper} method is the paper's, from its two starts, with six parameters; "
            "the others fit four.",
            f"The SED is from {RESOLUTION} resolution; the FSS at standard is in docs/results.md.",
        ],
    )
