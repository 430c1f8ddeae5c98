"""The press that fingerpad and its peers repeat: a layered block under a sphere, in one file for all of them.

14 x 12 x 5 mm, clamped at the bottom, three neo-Hookean layers with the finger's moduli, a rigid frictionless
sphere of 3 mm radius, 1.0 mm deep in ten equal increments.
"""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from scipy.optimize import brentq
from threadpoolctl import threadpool_limits

from fingerpad.core.units import MM_PER_M
from fingerpad.export.decks import calculix_deck
from fingerpad.export.job import Job
from fingerpad.geometry.bodies import Sphere
from fingerpad.geometry.mesh import Mesh, block_mesh
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.materials import Material
from fingerpad.mechanics.press import Specimen, press
from fingerpad.mechanics.press_settings import PressSettings

LENGTH_MM, WIDTH_MM = 14.0, 12.0
BORDERS_MM = (0.0, 0.471, 1.624, 5.0)
YOUNG_KPA, POISSON = (136.0, 136.0, 80.0, 34.0), 0.48
"""By layer of a mesh: stratum corneum and living epidermis, which are alike here, dermis and subcutis."""

RADIUS_MM, DEPTH_MM, INCREMENTS = 3.0, 1.0, 10
CORE_MM = 2.5
"""Half of the width within which elements are equally wide."""

SIZES = {"small": ((8, 4), (7, 3), (2, 3, 5)), "large": ((13, 7), (11, 6), (3, 4, 7))}
"""Elements from the middle outwards along and across, in the core and beyond it, and through the layers."""

LIVING_EPIDERMIS, DERMIS = 1, 2


def lines(core: int, outer: int, half_mm: float) -> np.ndarray:
    """Grid lines to both sides of 0: equal steps in the core, then steps that grow by one ratio.

    Examples
    --------
    >>> lines(2, 1, 4.0).tolist()
    [-4.0, -2.5, -1.25, 0.0, 1.25, 2.5, 4.0]
    """
    step, powers = CORE_MM / core, np.arange(1, outer + 1)
    rest = half_mm - CORE_MM
    ratio = brentq(lambda ratio: step * (ratio**powers).sum() - rest, 0.1, 10.0, xtol=1e-15)
    half = np.concatenate([np.linspace(0.0, CORE_MM, core + 1), CORE_MM + np.cumsum(step * ratio**powers)])
    half[-1] = half_mm
    return np.concatenate([-half[:0:-1], half])


def write_block(path: Path, size: str) -> Path:
    """Write mesh, supports, moduli, sphere and increments of the press as one NumPy archive.

    Parameters
    ----------
    path : Path
        File to write.
    size : str
        Key of `SIZES`.
    """
    along, across, (epidermis, dermis, subcutis) = SIZES[size]
    steps = (epidermis, dermis, subcutis)
    depths = [
        np.linspace(top, bottom, n + 1)[1:]
        for top, bottom, n in zip(BORDERS_MM[:-1], BORDERS_MM[1:], steps, strict=True)
    ]
    layers = [0] * (epidermis - 1) + [LIVING_EPIDERMIS] + [DERMIS] * dermis + [3] * subcutis
    mesh = block_mesh(
        lines(*along, LENGTH_MM / 2), np.concatenate([[0.0], *depths]), lines(*across, WIDTH_MM / 2), layers
    )
    np.savez(
        path,
        young_kpa=YOUNG_KPA,
        poisson=POISSON,
        radius_mm=RADIUS_MM,
        depths_mm=np.linspace(0.0, DEPTH_MM, INCREMENTS + 1),
        **{f"mesh_{field.name}": getattr(mesh, field.name) for field in fields(mesh)},
    )
    return path


def read_job(path: Path) -> Job:
    """Read the press from the file, as fingerpad describes it to other solvers."""
    with np.load(path) as stored:
        kept = {name.removeprefix("mesh_"): stored[name] for name in stored.files if name.startswith("mesh_")}
        kept |= {"shape": tuple(kept["shape"].tolist()), "full": bool(kept["full"])}
        mesh = Mesh(**kept)
        materials = tuple(
            Material.linear_elastic(young, float(stored["poisson"])) for young in stored["young_kpa"]
        )
        ball = Sphere(curvature_per_m=MM_PER_M / float(stored["radius_mm"]))
        depths_mm = stored["depths_mm"]
    placement = place(ball, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    return Job(mesh, materials, ball, placement, 10.0 * np.arange(depths_mm.size), depths_mm)


def press_block(block: str, found: str) -> dict[str, Any]:
    """Press with fingerpad.

    Parameters
    ----------
    block : str
        The file with the press.
    found : str
        Where force and SED of every increment go.

    Returns
    -------
    dict
        Seconds of the press from the mesh to all its results, and its work.
    """
    job = read_job(Path(block))
    increments = job.times_ms.size - 1
    motion = RampAndHold(depth_mm=float(job.depths_mm[-1]), ramp_ms=float(job.times_ms[-1]), hold_ms=1.0)
    settings = PressSettings(increments, 1)
    started = perf_counter()
    with threadpool_limits(limits=1):  # as in `Touch.solve`
        done = press(
            Specimen(job.mesh, job.materials), PlacedIndenter(job.indenter, job.placement), motion, settings
        )
    solve_s = perf_counter() - started
    ramp = slice(1, increments + 1)
    np.savez(found, force_mn=done.force_mn[ramp], sed_kpa=done.sed_kpa[increments])
    return {"solve_s": solve_s, "newton_steps": done.newton_steps}


def write_deck(block: str, deck: str) -> dict[str, Any]:
    """Write the press as an input file of CalculiX."""
    job = read_job(Path(block))
    Path(deck).write_text(calculix_deck(job))
    return {"sets": list(job.layer_names.values()), "elements": len(job.mesh.elements)}


def below_the_sphere(mesh: Mesh, reach_mm: float = 2.0) -> np.ndarray:
    """Elements of living epidermis and dermis whose middle lies within `reach_mm` of the sphere's axis."""
    middle = mesh.nodes_mm[mesh.elements].mean(axis=1)
    near = np.hypot(middle[:, 0], middle[:, 2]) < reach_mm
    return np.flatnonzero(near & np.isin(mesh.layer, (LIVING_EPIDERMIS, DERMIS)))
