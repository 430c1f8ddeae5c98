"""CalculiX as an oracle: run an exported deck and read forces and energies of every increment."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

PROGRAM = shutil.which("ccx")
LONGEST_S = 900


@dataclass(frozen=True)
class Found:
    """Results of the increments that end at our times.

    Parameters
    ----------
    times_ms : array (n_times,)
        Without 0. [ms]
    force_mn : array (n_times, 3)
        Force that moves the indenter. [mN]
    sed_kpa : array (n_times, n_elements)
        Mean over the points of each element. [kPa]
    """

    times_ms: np.ndarray
    force_mn: np.ndarray
    sed_kpa: np.ndarray


def run(deck: str, folder: Path, n_elements: int, sets: tuple[str, ...]) -> Found:
    """Solve a deck in `folder` and read what it printed for sets of elements."""
    (folder / "job.inp").write_text(deck)
    # One thread: of two, each waits in a loop for the other wherever another process has its core.
    environment = {**os.environ, "OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", "1")}
    done = subprocess.run(
        [PROGRAM or "ccx", "-i", "job"],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
    )
    assert "Job finished" in done.stdout, "\n".join(done.stdout.splitlines()[-15:])
    return read((folder / "job.dat").read_text(), n_elements, sets)


def read(printed: str, n_elements: int, sets: tuple[str, ...]) -> Found:
    """Read the .dat file of a job: totals of RF at the indenter and ENER of elements, by time."""
    number = r"(-?\d\.\d+E[+-]\d+)"
    total = re.compile(r"total force.*?set INDENTER and time\s+(\S+)\s+" + r"\s+".join([number] * 3))
    forces = {float(found[1]): [float(found[n]) for n in (2, 3, 4)] for found in total.finditer(printed)}
    sed = {time: np.zeros(n_elements) for time in forces}
    blocks = re.split(r"^ (?=[a-z])", printed, flags=re.M)
    for block in blocks:
        head, *rows = block.splitlines()
        named = re.match(r"internal energy density .*set (\S+) and time\s+(\S+)", head)
        if not named or named[1] not in [name.upper() for name in sets]:
            continue
        # CalculiX 2.23 names the increment in between.
        values = np.array([row.split() for row in rows if re.match(r"\s*\d", row)], dtype=float)
        element = values[:, 0].astype(int) - 1
        counts = np.bincount(element, minlength=n_elements)
        sums = np.bincount(element, values[:, 2], minlength=n_elements)
        sed[float(named[2])] += np.divide(sums, counts, out=np.zeros(n_elements), where=counts > 0)
    times = sorted(forces)
    return Found(np.array(times), np.array([forces[t] for t in times]), np.array([sed[t] for t in times]))
