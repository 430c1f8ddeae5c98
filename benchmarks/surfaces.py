"""Surfaces from files: a million triangles beside their analytic twin, and presses of foreign surfaces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

import fingerpad as fp
from benchmarks.foreign_surfaces import BODIES, read
from benchmarks.measuring import run_job
from benchmarks.results import Report, Table
from fingerpad.geometry.surface import Surface

HEIGHTS, HALF_MM, THREADS, DEPTH_MM = 708, 3.0, 2, 1.0
FOREIGN_DEPTH_MM = 0.6
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


def press(name: str) -> dict[str, Any]:
    """Press one of the foreign surfaces at `quick`: nodes, seconds and force, or why it was refused."""
    touch = fp.touch_of(fp.Fingertip(), fp.Plate(), fp.RampAndHold(depth_mm=FOREIGN_DEPTH_MM))
    touch.solve(threads=THREADS)  # loads kernels
    found: dict[str, Any] = {"nodes": None, "press_s": None, "force_mn": None, "said": ""}
    started = perf_counter()
    try:
        with TemporaryDirectory() as folder:
            body = read(name, Path(folder))
        touch = fp.touch_of(fp.Fingertip(), body, touch.stimulus)
        found["nodes"] = len(touch.mesh.nodes_mm)
        skin = touch.solve(threads=THREADS)
        found |= {
            "press_s": round(perf_counter() - started, 1),
            "force_mn": float(skin.force_mn.max().round(1)),
        }
    except (fp.InputError, fp.ConvergenceError) as error:
        found["said"] = str(error)
    return found


def measure() -> Report:
    """Press each once in a fresh process."""
    foreign = {name: run_job("surfaces", "press", THREADS, name=name).answer for name in BODIES}
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
            ),
            Table(
                f"Foreign surfaces (benchmarks/foreign_surfaces.py), pressed {FOREIGN_DEPTH_MM:g} mm:",
                ["body", "nodes", "read and press, s", "force, mN", "refused"],
                [[name, *found.values()] for name, found in foreign.items()],
            ),
        ],
        measured={"million_triangles_s": read["read_s"] + read["press_s"] - exact["press_s"]},
    )
