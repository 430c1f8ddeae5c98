"""fingerpad beside other finite elements, in one run: FElupe and CalculiX on a layered block."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.installing import calculix, environment_of
from benchmarks.measuring import FailedRunError, Run, run, run_job
from benchmarks.results import Report, Table

THREADS = 2
SIZES = ("small", "large")
FELUPE, CALCULIX = "FElupe", "CalculiX"


@dataclass(frozen=True)
class Solution:
    """A press of one program.

    Parameters
    ----------
    solve_s, peak_mb, processor_s : float
        Time on the clock, memory, and processor time of the whole process.
    iterations : int
        Newton iterations.
    force_mn : array (n_increments,)
        Force of the sphere. [mN]
    sed_kpa : array (n_elements,)
        The SED is from the end, element means. [kPa]
    version : str
        Of the program.
    """

    solve_s: float
    peak_mb: float
    processor_s: float
    iterations: int
    force_mn: np.ndarray
    sed_kpa: np.ndarray
    version: str


def ours(block: Path, folder: Path, threads: int) -> Solution:
    """Press the block with fingerpad."""
    done = run_job("peer_block", "press_block", threads, block=str(block), found=str(folder / "ours.npz"))
    return _solution(done, folder / "ours.npz", "fingerpad")


def felupe(block: Path, folder: Path, threads: int) -> Solution:
    """Press the block with FElupe, in its own environment."""
    done = run_job(
        "peer_felupe", "press_block", threads, environment_of("felupe"),
        block=str(block), found=str(folder / "felupe.npz"),
    )  # fmt: skip
    return _solution(done, folder / "felupe.npz", done.answer["version"])


def _solution(done: Run, found: Path, version: str) -> Solution:
    with np.load(found) as stored:
        force_mn, sed_kpa = stored["force_mn"], stored["sed_kpa"]
    told = done.answer
    spent = told["solve_s"], done.peak_mb, done.cpu_s, told["newton_steps"]
    return Solution(*spent, force_mn, sed_kpa, version)


def calculix_solution(block: Path, folder: Path, threads: int) -> Solution:
    """Press the block with CalculiX, from the deck that `fingerpad export` would write."""
    from tests.verification.calculix import read

    program = calculix()
    deck = run_job("peer_block", "write_deck", 1, block=str(block), deck=str(folder / "job.inp")).answer
    done = run([program, "-i", "job"], threads, folder=folder)
    found = read((folder / "job.dat").read_text(), deck["elements"], tuple(deck["sets"]))
    if "Job finished" not in done.printed:
        raise FailedRunError("ccx did not finish:\n" + "\n".join(done.printed.splitlines()[-15:]))
    told = re.search(r"Version ([\d.]*\d)", done.printed)
    iterations = sum(int(row.split()[3]) for row in (folder / "job.sta").read_text().splitlines()[2:])
    return Solution(
        done.wall_s, done.peak_mb, done.cpu_s, iterations,
        found.force_mn[:, 1], found.sed_kpa[-1], f"CalculiX {told[1] if told else ''}".strip(),
    )  # fmt: skip


def compared(mine: Solution, theirs: Solution, region: np.ndarray) -> tuple[float, float]:
    """Largest differences in percent: of force at any increment, and of SED in a region over its largest.

    Examples
    --------
    >>> mine = Solution(1.0, 1.0, 1.0, 1, np.array([1.0, 2.02]), np.array([4.0, 1.1, 9.0]), "")
    >>> theirs = Solution(1.0, 1.0, 1.0, 1, np.array([1.0, 2.0]), np.array([4.0, 1.0, 1.0]), "")
    >>> [round(percent, 9) for percent in compared(mine, theirs, np.array([0, 1]))]
    [1.0, 2.5]
    """
    force = np.abs(mine.force_mn / theirs.force_mn - 1.0).max()
    difference = np.abs(mine.sed_kpa[region] - theirs.sed_kpa[region]).max()
    return 100.0 * float(force), 100.0 * float(difference / theirs.sed_kpa[region].max())


def blocks(sizes: Sequence[str], threads: int) -> tuple[list[list[Any]], dict[str, float]]:
    """Press every block with every program.

    Returns
    -------
    list of lists, dict
        Rows of the table, and the numbers that have targets: those of the last block.
    """
    from benchmarks.peer_block import below_the_sphere, read_job, write_block

    rows: list[list[Any]] = []
    measured: dict[str, float] = {}
    for size in sizes:
        with TemporaryDirectory() as name:
            folder = Path(name)
            block = write_block(folder / "block.npz", size)
            mesh = read_job(block).mesh
            region = below_the_sphere(mesh)
            ours(block, folder, threads)  # compiles kernels, if that is still to be done
            mine = ours(block, folder, threads)
            others = {
                FELUPE: felupe(block, folder, threads),
                CALCULIX: calculix_solution(block, folder, threads),
            }
            rows.append(_row(mesh, mine) + [None] * 4)
            for program, theirs in others.items():
                force, sed = compared(mine, theirs, region)
                ratios = theirs.solve_s / mine.solve_s, theirs.processor_s / mine.processor_s
                rows.append([*_row(mesh, theirs), *ratios, force, sed])
                key = program.lower()
                # On a busy machine the clock favours whoever ran in a quiet minute.
                measured[f"{key}_ratio"] = min(ratios)
                measured[f"{key}_force_percent"], measured[f"{key}_sed_percent"] = force, sed
    return rows, measured


def _row(mesh: Any, solution: Solution) -> list[Any]:
    spent = [solution.solve_s, solution.processor_s, solution.peak_mb]
    return [len(mesh.nodes_mm), solution.version, solution.iterations, *spent, float(solution.force_mn[-1])]


def measure(sizes: Sequence[str] = SIZES, threads: int = THREADS) -> Report:
    """Run every program on the same jobs; with CalculiX on the large block this takes half an hour."""
    of_block, block_numbers = blocks(sizes, threads)
    return Report(
        name="peers",
        title="Comparison with other finite-element programs",
        about=(
            "A layered block, 14 x 12 x 5 mm, under a rigid frictionless sphere of 3 mm radius, 1.0 mm in "
            "ten equal increments, neo-Hookean layers with nu = 0.48. Every program reads the same file and "
            f"may use {threads} threads."
        ),
        tables=[
            Table(
                "Block. Largest differences: of the force at any increment, and of the SED in living "
                "epidermis and dermis within 2 mm of the axis, as a share of its largest value:",
                [
                    "nodes", "program", "iterations", "s", "processor, s", "memory, MB", "force, mN",
                    "times our time", "times our processor time", "force, %", "SED, %",
                ],
                of_block,
            ),
        ],
        measured=block_numbers,
        notes=[
            "Times exclude imports and compilation. For CalculiX they are those of its whole process, "
            "including its files but not the writing of the deck.",
            "Solvers have their default tolerances, FElupe 1e-6; ours is 1e-5 of the contact force.",
            "FElupe uses the same element, mean dilatation, with a penalty at the nodes and PARDISO. "
            "CalculiX uses incompatible modes (C3D8I), its most similar element, and SPOOLES.",
            "The target is compared with the smaller of the two ratios. Processor time is that of the whole "
            "process, including imports and loading of kernels.",
        ],
    )  # fmt: skip
