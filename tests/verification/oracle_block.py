"""The press that other solvers repeat: a layered block under a sphere, half of it.

Layers, moduli and Poisson's ratio are those of the finger's Trial 1 without relaxation, and neo-Hooke is the
one law at finite strain that all three programs have in the same form, C10 (I1-3) + (J-1)²/D1. The mesh has
0.35 mm wide bricks below the sphere, five across the radius of the contact; its own error cancels where the
same mesh and element are compared, and is what is left where they differ.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from fingerpad.core.values import FloatArray
from fingerpad.export.job import Job
from fingerpad.geometry.bodies import Sphere
from fingerpad.geometry.grading import graded_lines
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import RampAndHold, Trajectory
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.materials import Material
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.mechanics.press import Deformation, Specimen, press
from fingerpad.mechanics.press_settings import PressSettings

YOUNG_KPA, POISSON = (136.0, 136.0, 80.0, 34.0), 0.48
LAYERS = (0, 0, 1, 2, 2, 2, 3, 3, 3, 3)
DEPTHS_MM = (0.0, 0.185, 0.371, 0.471, 0.855, 1.24, 1.624, 2.074, 2.724, 3.674, 5.0)
BALL = Sphere(curvature_per_m=287.0)
MOTION = RampAndHold(depth_mm=0.8, ramp_ms=40.0, hold_ms=1.0)
STEPS = 8
LIVING_EPIDERMIS = 1


BACK = Trajectory((0.0, MOTION.ramp_ms, 2 * MOTION.ramp_ms), (0.0, MOTION.depth_mm, 0.0))
"""In and out at the same speed."""


@lru_cache(maxsize=1)
def job() -> Job:
    """The ramp of the press, as it is exported."""
    along, across = (graded_lines(1.8, 0.35, length, 1.35, 1.5) for length in (7.0, 6.0))
    mesh = block_mesh(np.concatenate([-along[:0:-1], along]), DEPTHS_MM, across, LAYERS, symmetric=True)
    materials = tuple(Material.linear_elastic(young, POISSON) for young in YOUNG_KPA)
    placement = place(BALL, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    times = np.linspace(0.0, MOTION.ramp_ms, STEPS + 1)
    return Job(mesh, materials, BALL, placement, times, MOTION.prescribed_at(times))


def coarse_job(times_ms: FloatArray, depths_mm: FloatArray) -> Job:
    """The same layers and sphere on few elements."""
    along, across = (graded_lines(1.8, 0.6, length, 1.5, 2.0) for length in (5.0, 4.0))
    depths = (*DEPTHS_MM[:1], *DEPTHS_MM[2:4], 1.0, DEPTHS_MM[6], 3.0, DEPTHS_MM[-1])
    both = np.concatenate([-along[:0:-1], along])
    mesh = block_mesh(both, depths, across, (0, 1, 2, 2, 3, 3), symmetric=True)
    placement = place(BALL, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    return replace(job(), mesh=mesh, placement=placement, times_ms=times_ms, depths_mm=depths_mm)


@lru_cache(maxsize=1)
def ours() -> Deformation:
    """Our own solution, contact closed to 0.05 % of the depth."""
    settings = PressSettings(STEPS, 1, NewtonSettings(penetration_tolerance=5e-4))
    return press(
        Specimen(job().mesh, job().materials), PlacedIndenter(BALL, job().placement), MOTION, settings
    )


@lru_cache(maxsize=1)
def job_and_back() -> Job:
    """The press and its release in two steps each."""
    times = np.linspace(0.0, 2 * MOTION.ramp_ms, 5)
    return replace(job(), times_ms=times, depths_mm=BACK.prescribed_at(times))


@lru_cache(maxsize=1)
def ours_and_back() -> Deformation:
    """Our own solution of it."""
    settings = PressSettings(2, 1, NewtonSettings(penetration_tolerance=5e-4))
    return press(Specimen(job().mesh, job().materials), PlacedIndenter(BALL, job().placement), BACK, settings)
