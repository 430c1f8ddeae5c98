"""How time and memory grow with the mesh: the same finger and sphere, every element refined alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.measuring import Run, run_job
from benchmarks.pressing import COLUMNS, PRESSED, work
from benchmarks.results import Report, Table

THREADS = 2

SIZES = (
    (0.9, (2, 1, 3, 3)),
    (1.25, (4, 1, 4, 4)),
    (1.5, (6, 2, 6, 6)),
    (2.0, (8, 2, 8, 8)),
    (3.8, (13, 3, 13, 13)),
)
"""By what elements on the skin are smaller than those of `standard`, and elements through each layer."""


def exponent(nodes: Sequence[float], spent: Sequence[float]) -> float:
    """Slope of a straight line through the logarithms: spent ~ nodes ** exponent.

    Examples
    --------
    >>> round(exponent([10, 100, 1000], [2.0, 2.0e3, 2.0e6]), 9)
    3.0
    """
    return float(np.polyfit(np.log(nodes), np.log(spent), 1)[0])


def measure(sizes: Sequence[tuple[float, tuple[int, int, int, int]]] = SIZES) -> Report:
    """Press once at every size, and fit the exponents.

    Parameters
    ----------
    sizes : sequence of (float, (int, int, int, int))
        As `SIZES`; others try the script.
    """
    run_job("pressing", "press", THREADS, resolution="quick")  # compiles kernels, if that is still to be done
    runs = [
        run_job("pressing", "press", THREADS, resolution="standard", refinement=factor, layers=layers)
        for factor, layers in sizes
    ]
    nodes = [run.answer["nodes"] for run in runs]
    time_exponent = exponent(nodes, [run.answer["solve_s"] for run in runs])
    memory_exponent = exponent(nodes, [_needed_mb(run) for run in runs])
    return Report(
        name="growth",
        title="Scaling with the mesh size",
        about=(
            f"{PRESSED} in the steps of `standard`; half a finger, {THREADS} threads, one run each. Every "
            "element is refined by about the same factor in all directions."
        ),
        tables=[
            Table(
                f"Fitted: time ~ nodes^{time_exponent:.3f}, memory ~ nodes^{memory_exponent:.3f}.",
                [*COLUMNS, "solve, s", "ms per node", "memory, MB", "kB per node", "force, mN"],
                [_row(run) for run in runs],
            )
        ],
        measured={"growth_time_exponent": time_exponent, "growth_memory_exponent": memory_exponent},
        notes=[
            "The exponent of memory, and kB per node, are of the memory that an indentation adds to a "
            "process that has imported fingerpad. The memory of Python itself would reduce the exponent."
        ],
    )


def _needed_mb(run: Run) -> float:
    return run.peak_mb - run.answer["before_mb"]


def _row(run: Run) -> list[float]:
    found = run.answer
    nodes, solve_s = found["nodes"], found["solve_s"]
    needed = [solve_s, 1e3 * solve_s / nodes, run.peak_mb, 1e3 * _needed_mb(run) / nodes]
    return [*work(found), *needed, found["force_mn"]]
