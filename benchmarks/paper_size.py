"""The paper's size: one sphere into the whole finger at about 282,000 nodes, on one and two threads."""

from __future__ import annotations

from benchmarks.measuring import run_job
from benchmarks.pressing import COLUMNS, PRESSED, work
from benchmarks.results import Report, Table

RESOLUTION = "paper"


def what_limits(both_s: float, cores: float, one_s: float, cores_of_one: float) -> str:
    r"""Say what keeps two threads from twice the speed of one, from times and cores used.

    Examples
    --------
    >>> print(what_limits(60.0, 1.75, 100.0, 1.0).replace(". ", ".\n"))
    For 15 s of the 60 s on two threads one of them waits: serial parts.
    Both take 5 s more processor time than one: memory bandwidth and locks.
    Without the serial parts the factor would be 1.90, without the other 1.74.
    """
    serial_s, work_s = (2.0 - cores) * both_s, cores_of_one * one_s
    more_s = cores * both_s - work_s
    without_serial = work_s / (0.5 * cores * both_s)
    without_more = work_s / (serial_s + 0.5 * (work_s - serial_s))
    return (
        f"For {serial_s:.0f} s of the {both_s:.0f} s on two threads one of them waits: serial parts. "
        f"Both take {more_s:.0f} s more processor time than one: memory bandwidth and locks. "
        f"Without the serial parts the factor would be {without_serial:.2f}, without the other "
        f"{without_more:.2f}."
    )


def measure(resolution: str = RESOLUTION) -> Report:
    """Press once on two threads and once on one.

    Parameters
    ----------
    resolution : str
        Another one tries the script; its numbers answer no target.
    """
    run_job("pressing", "press", 2, resolution="quick")  # compiles kernels, if that is still to be done
    runs = {threads: run_job("pressing", "press", threads, resolution=resolution) for threads in (2, 1)}
    rows = []
    for threads, run in runs.items():
        found = run.answer
        taken = [found["solve_s"], run.cores, run.peak_mb]
        rows.append([threads, *work(found), *taken, found["force_mn"], found["sed_kpa"]])
    both, one = runs[2].answer, runs[1].answer
    same = both["force_mn"] == one["force_mn"] and both["sed_kpa"] == one["sed_kpa"]
    return Report(
        name="paper_size",
        title="Mesh of the paper's size",
        about=(
            f"{PRESSED} in {both['steps']} steps, each to a residual of 1e-5 of the contact force. The whole "
            "finger, no symmetry used; one run each."
        ),
        tables=[
            Table(
                f"`touch_of(Fingertip(), Sphere(curvature_per_m=287), resolution='{resolution}').solve()`:",
                [
                    "threads",
                    *COLUMNS,
                    "solve, s",
                    "cores used",
                    "memory, MB",
                    "force, mN",
                    "largest SED, kPa",
                ],
                rows,
            )
        ],
        measured={
            "paper_size_s": both["solve_s"],
            "paper_size_gb": runs[2].peak_mb / 1000.0,
            "paper_size_nodes": both["nodes"],
            "paper_size_speedup": one["solve_s"] / both["solve_s"],
        },
        notes=[
            f"Force and largest SED on one and two threads: {'equal bits' if same else 'not equal'}.",
            what_limits(both["solve_s"], runs[2].cores, one["solve_s"], runs[1].cores),
            "The time is that of `solve`; it includes meshing and loading of compiled kernels and "
            "excludes imports.",
        ],
    )
