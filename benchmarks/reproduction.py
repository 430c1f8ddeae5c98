"""The whole paper: `fingerpad reproduce` from an empty store, figures and report included."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.measuring import Run, run, run_job
from benchmarks.results import Report, Table

JOBS = 2
RESOLUTIONS = ("quick", "standard")


def reproduce(resolution: str) -> tuple[Run, dict[str, float]]:
    """Run the command into an empty folder.

    Returns
    -------
    Run, dict
        What it took, and the seconds of its parts.
    """
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "fingerpad", "reproduce", "--resolution", resolution]
        done = run([*command, "--out", folder, "--jobs", str(JOBS)], threads=JOBS)
        manifest = json.loads((Path(folder) / "results.json").read_text(encoding="utf-8"))["manifest"]
    return done, seconds_of_parts(manifest, done.wall_s)


def seconds_of_parts(manifest: Mapping[str, Any], whole_s: float) -> dict[str, float]:
    """Seconds of each part of a reproduction.

    Parameters
    ----------
    manifest : mapping
        As `fingerpad reproduce` writes it: stages, of which those with indentations read what is stored.
    whole_s : float
        Time of the whole command. [s]

    Returns
    -------
    dict
        Seconds by part.

    Examples
    --------
    >>> stages = [{"name": "fit", "wall_s": 2.0}, {"name": "bars", "wall_s": 1.0, "indentations": 36}]
    >>> seconds_of_parts({"wall_s": 4.0, "stages": stages}, whole_s=9.0)
    {'fit': 2.0, 'loading stored indentations': 1.0, 'rest of the study': 1.0,
     'imports, figures and report': 5.0}
    """
    stages = manifest["stages"]
    work = {stage["name"]: stage["wall_s"] for stage in stages if stage.get("indentations") is None}
    reading_s = sum(stage["wall_s"] for stage in stages if stage.get("indentations") is not None)
    return {
        **work,
        "loading stored indentations": reading_s,
        "rest of the study": manifest["wall_s"] - sum(work.values()) - reading_s,
        "imports, figures and report": whole_s - manifest["wall_s"],
    }


def measure(resolutions: Sequence[str] = RESOLUTIONS) -> Report:
    """Reproduce at every resolution, each from nothing."""
    run_job("pressing", "press", JOBS, resolution="quick")  # compiles kernels, if that is still to be done
    found = {resolution: reproduce(resolution) for resolution in resolutions}
    parts = list(dict.fromkeys(part for _, spent in found.values() for part in spent))
    rows: list[list[Any]] = [[part, *(spent.get(part) for _, spent in found.values())] for part in parts]
    rows.append(["the whole command, s", *(done.wall_s for done, _ in found.values())])
    rows.append(["cores used", *(done.cores for done, _ in found.values())])
    rows.append(["memory, MB", *(done.peak_mb for done, _ in found.values())])
    measured = {f"reproduce_{resolution}_s": done.wall_s for resolution, (done, _) in found.items()}
    if "standard" in found:
        measured["reproduce_standard_gb"] = found["standard"][0].peak_mb / 1000.0
    return Report(
        name="reproduction",
        title="The whole reproduction",
        about=(
            "`fingerpad reproduce --jobs 2` into an empty folder: all indentations, fits, observers, figures "
            "and the report. One run each; the time is that of the whole command, including imports."
        ),
        tables=[Table("Seconds of each part:", ["part", *resolutions], rows)],
        measured=measured,
        notes=[
            "Memory is the sum over the command and its processes; shared memory counts for each of them."
        ],
    )
