"""The whole paper: `fingerpad reproduce` from an empty store, figures and report included."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.measuring import Run, run, run_job
from benchmarks.results import Report, Table

JOBS = 2
RESOLUTIONS = ("quick", "standard")


def reproduce(resolution: str) -> tuple[Run, list[dict[str, Any]]]:
    """Run the command into an empty folder.

    Returns
    -------
    Run, list of dict
        What it took, and its stages with their seconds, as the command tells them.
    """
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "fingerpad", "reproduce", "--resolution", resolution]
        done = run([*command, "--out", folder, "--jobs", str(JOBS)], threads=JOBS)
        stages = json.loads((Path(folder) / "results.json").read_text(encoding="utf-8"))["manifest"]["stages"]
    return done, stages


def measure(resolutions: Sequence[str] = RESOLUTIONS) -> Report:
    """Reproduce at every resolution, each from nothing."""
    run_job("pressing", "press", JOBS, resolution="quick")  # compiles kernels, if that is still to be done
    found = {resolution: reproduce(resolution) for resolution in resolutions}
    names = list(dict.fromkeys(stage["name"] for _, stages in found.values() for stage in stages))
    spent = {
        resolution: {stage["name"]: stage["wall_s"] for stage in stages}
        for resolution, (_, stages) in found.items()
    }
    rows: list[list[Any]] = [[name, *(spent[one].get(name) for one in resolutions)] for name in names]
    rows.append(["the whole command, s", *(done.wall_s for done, _ in found.values())])
    rows.append(["cores used", *(done.cores for done, _ in found.values())])
    rows.append(["memory, MB", *(done.peak_mb for done, _ in found.values())])
    measured = {}
    for resolution, (done, _) in found.items():
        measured[f"reproduce_{resolution}_s"] = done.wall_s
        if resolution == "standard":
            measured["reproduce_standard_gb"] = done.peak_mb / 1000.0
    return Report(
        name="reproduction",
        title="The whole reproduction",
        about=(
            "`fingerpad reproduce --jobs 2` into an empty folder: all presses, fits, observers, figures and "
            "the report. One run each; the time is that of the whole command, imports included."
        ),
        tables=[Table("Seconds of each stage, as the command tells them:", ["stage", *resolutions], rows)],
        measured=measured,
        notes=[
            "Memory is the sum over the command and its processes; what they share counts for each of them."
        ],
    )
