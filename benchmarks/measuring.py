"""Run a job in a process of its own, and tell how long it took and how much memory it needed.

A fresh process owes nothing to the one before: its peak of memory is its own, and the number of threads,
which libraries read once, is what it was asked for. A job is a function of a benchmark that times what it
means by itself, so that starting Python and importing do not count, and returns a dict of plain values.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import psutil

ROOT = Path(__file__).parents[1]

SAMPLE_EVERY_S = 0.05
"""Time between two looks at the memory of a process and its descendants. [s]"""

THREAD_COUNTS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS", "CCX_NPROC_EQUATION_SOLVER")
"""What the libraries of the jobs call their number of threads."""


@dataclass(frozen=True)
class Run:
    """What one run of a command took.

    Parameters
    ----------
    printed : str
        Its standard output.
    wall_s, cpu_s : float
        Time on the clock, and of all processors, descendants included. [s]
    peak_mb : float
        Largest sum of the resident memory of the process and its descendants; pages that they share count for
        each. [MB, 10^6 bytes]
    """

    printed: str
    wall_s: float
    cpu_s: float
    peak_mb: float

    @property
    def cores(self) -> float:
        """Cores that it kept busy, on average over its whole life."""
        return self.cpu_s / self.wall_s

    @property
    def answer(self) -> dict[str, Any]:
        """Last line of the output, read as JSON."""
        return json.loads(self.printed.splitlines()[-1])


class FailedRunError(RuntimeError):
    """A command came back with an error, so there is nothing to report."""


@dataclass(frozen=True)
class Spread:
    """Median and range of a repeated measurement.

    Examples
    --------
    >>> str(Spread.of([3.0, 1.0, 1.25]))
    '1.25 (1 to 3)'
    >>> str(Spread.of([2.0]))
    '2'
    """

    median: float
    smallest: float
    largest: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Summarise values."""
        return cls(statistics.median(values), min(values), max(values))

    def __str__(self) -> str:
        if self.smallest == self.largest:
            return f"{self.median:.3g}"
        return f"{self.median:.3g} ({self.smallest:.3g} to {self.largest:.3g})"


def run(
    command: Sequence[str | Path],
    threads: int,
    folder: Path = ROOT,
    environment: Mapping[str, str] | None = None,
) -> Run:
    """Run a command to its end and measure it.

    Parameters
    ----------
    command : sequence of str
        Program and arguments.
    threads : int
        Threads that its libraries may use.
    folder : Path
        Where it runs.
    environment : mapping, optional
        Variables to set besides those of the threads.

    Returns
    -------
    Run

    Raises
    ------
    FailedRunError
        If its exit status is not 0; the message ends with what it wrote last.

    Examples
    --------
    >>> run([sys.executable, "-c", "print('{}')"], threads=1).answer
    {}
    """
    variables = {**os.environ, **{name: str(threads) for name in THREAD_COUNTS}, **(environment or {})}
    started = perf_counter()
    process = psutil.Popen(
        [str(part) for part in command],
        cwd=folder, env=variables, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    ended = threading.Event()
    peaks: list[float] = [0.0]
    processors: list[float] = [0.0]
    watch = threading.Thread(target=_watch, args=(process.pid, ended, peaks, processors), daemon=True)
    watch.start()
    try:
        printed, complaint = process.communicate()
    finally:
        ended.set()
        watch.join()
        if process.poll() is None:
            process.kill()
    wall_s = perf_counter() - started
    if process.returncode:
        last = "\n".join([*printed.splitlines()[-5:], *complaint.splitlines()[-15:]])
        raise FailedRunError(f"{Path(command[0]).name} ended with status {process.returncode}:\n{last}")
    return Run(printed, wall_s, processors[0], peaks[0])


def _watch(pid: int, ended: threading.Event, peaks: list[float], processors: list[float]) -> None:
    """Keep the largest memory and the last sum of processor time; what has ended counts as last seen."""
    spent: dict[int, float] = {}
    try:
        process = psutil.Process(pid)
    except psutil.NoSuchProcess:
        return
    while not ended.is_set():
        resident = 0
        try:
            family = [process, *process.children(recursive=True)]
        except psutil.Error:
            return
        for member in family:
            try:
                with member.oneshot():
                    resident += member.memory_info().rss
                    times = member.cpu_times()
                    spent[member.pid] = times.user + times.system
            except psutil.Error:  # it has just ended
                continue
        peaks[0] = max(peaks[0], resident / 1e6)
        processors[0] = sum(spent.values())
        ended.wait(SAMPLE_EVERY_S)


def run_job(
    module: str, function: str, threads: int, python: str | Path = sys.executable, **arguments: Any
) -> Run:
    """Call a function of a module of `benchmarks` in a fresh process.

    Parameters
    ----------
    module, function : str
        Name of the module within `benchmarks`, and of its function; it returns a dict fit for JSON.
    threads : int
        Threads that its libraries may use.
    python : str or Path
        Interpreter, if another than this one's.
    **arguments
        Of the function, fit for JSON.

    Returns
    -------
    Run
        Its `answer` is what the function returned.

    Examples
    --------
    >>> run_job("measuring", "doubled", threads=1, number=2).answer
    {'doubled': 4}
    """
    command = [python, "-m", "benchmarks.job", module, function, json.dumps(arguments)]
    return run(command, threads, environment={"PYTHONPATH": os.pathsep.join(map(str, (ROOT / "src", ROOT)))})


def doubled(number: int) -> dict[str, int]:
    """Do next to nothing: the smallest job, by which a run is checked.

    Examples
    --------
    >>> doubled(2)
    {'doubled': 4}
    """
    return {"doubled": 2 * number}
