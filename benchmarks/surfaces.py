"""A body of a million triangles from a file: reading and pressing it, beside its analytic twin."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

import fingerpad as fp
from benchmarks.measuring import run_job
from benchmarks.results import Report, Table
from fingerpad.geometry.surface import Surface

HEIGHTS, HALF_MM, THREADS, DEPTH_MM = 708, 3.0, 2, 1.0
BALL = fp.Sphere(curvature_per_m=287.0)


def _write(path: Path) -> None:
    """Write the cap of a ball as binary STL, two triangles per square."""
    import trimesh

    line = np.linspace(-HALF_MM, HALF_MM, HEIGHTS)
    heights = np.sqrt(np.maximum(BALL.radius_mm**2 - line**2 - line[:, None] ** 2, 0.0))
    cap = fp.height_surface(heights, pitch_mm=2 * HALF_MM / (HEIGHTS - 1))
    trimesh.Trimesh(cap.vertices_mm, cap.faces, process=False).export(path)


def answer(from_file: bool) -> dict[str, Any]:
    """Read the cap and press it, or press the sphere; seconds of each."""
    finger, motion = fp.Fingertip(), fp.RampAndHold(depth_mm=DEPTH_MM)
    fp.touch_of(finger, fp.Plate(), motion).solve(threads=THREADS)  # loads kernels
    with TemporaryDirectory() as folder:
        body: fp.Indenter = BALL
        read_s = 0.0
        if from_file:
            _write(Path(folder) / "cap.stl")
            started = perf_counter()
            body = fp.read_surface(Path(folder) / "cap.stl", up="+y")
            read_s = perf_counter() - started
    started = perf_counter()
    skin = replace(fp.touch_of(finger, BALL, motion), indenter=body).solve(threads=THREADS)
    return {
        "read_s": read_s,
        "press_s": perf_counter() - started,
        "triangles": len(body.faces) if isinstance(body, Surface) else 0,
        "newton_steps": skin.newton_steps,
        "force_mn": float(skin.force_mn.max()),
    }


def measure() -> Report:
    """Press both once, each in a fresh process."""
    runs = {
        name: run_job("surfaces", "answer", THREADS, from_file=from_file)
        for name, from_file in (("triangles of a binary STL", True), ("analytic sphere", False))
    }
    read, exact = (run.answer for run in runs.values())
    return Report(
        name="surfaces",
        title="A body of a million triangles",
        about=(
            f"Cap of a sphere of {BALL.radius_mm:.2f} mm, pressed {DEPTH_MM:g} mm at `quick`, {THREADS} "
            "threads, one run each in a fresh process, on the mesh of the sphere. Pressing a surface "
            "includes its tree, its features and its symmetry."
        ),
        tables=[
            Table(
                "Reading and pressing:",
                ["body", "triangles", "read, s", "press, s", "Newton steps", "force, mN", "memory, MB"],
                [
                    [
                        name,
                        run.answer["triangles"],
                        f"{run.answer['read_s']:.1f}",
                        f"{run.answer['press_s']:.1f}",
                        run.answer["newton_steps"],
                        f"{run.answer['force_mn']:.1f}",
                        f"{run.peak_mb:.0f}",
                    ]
                    for name, run in runs.items()
                ],
            )
        ],
        measured={"million_triangles_s": read["read_s"] + read["press_s"] - exact["press_s"]},
    )
