"""The manifest of a run: what ran, on what, from what and for how long."""

from __future__ import annotations

import hashlib
import platform
import resource
import sys
from importlib.metadata import version
from pathlib import Path
from typing import TypedDict

import numpy as np

from fingerpad import __version__
from fingerpad.core.checked import result_class
from fingerpad.core.values import Number
from fingerpad.geometry.mesh import Mesh
from fingerpad.geometry.mesh_checks import jacobian_at_gauss, scaled_jacobian
from fingerpad.skin.code_hash import code_hash

PACKAGES = ("numpy", "scipy", "numba", "matplotlib")  # Packages on which the numbers of a run depend.

_BYTES_PER_KIB = 1024


@result_class
class MeshSummary:
    """Size and quality of one mesh."""

    nodes: int
    elements: int  # How many.
    smallest_gauss_jacobian_mm3: Number  # Smallest determinant of the Jacobian at a Gauss point. [mm³]
    smallest_scaled_jacobian: Number  # Smallest scaled Jacobian of an element, 1 for a cube.


@result_class
class StageSummary:
    """One stage of a run."""

    name: str  # What was done.
    wall_s: float  # Time on the clock. [s]
    indentations: int | None = None
    computed: int | None = None  # How many indentations the stage read, and how many of them this run solved.
    largest_force_imbalance: float | None = None
    largest_energy_imbalance: float | None = None
    """Largest relative imbalance of the forces and of the energies of an indentation."""
    linear_solvers: tuple[str, ...] = ()  # Which solvers served the Newton steps.
    caveats: tuple[str, ...] = ()  # Where indentations lie outside of what was verified, each sentence once.


@result_class
class Manifest:
    """What ran, so that a run can be repeated and its meshes judged."""

    version: str
    code_hash: str
    python: str
    platform: str  # The program, the code behind stored indentations, and the machine's system.
    packages: dict[str, str]  # Versions of the packages on which the numbers depend.
    resolution: str  # How fine meshes and steps are.
    materials: str  # Tissues: their name, or how they are written in Python.
    seed: int  # Seed of all random numbers.
    started: str  # Date and time, UTC.
    wall_s: float
    peak_memory_mb: float  # Time on the clock and largest resident memory of a process. [s], [MB]
    stages: tuple[StageSummary, ...]  # In the order of the run.
    meshes: dict[str, MeshSummary]  # By what is pressed.
    half_model: bool | None = None  # Whether the finger is cut at its plane of symmetry.
    command: str | None = None  # The command line.
    inputs: dict[str, str]  # SHA-256 of the input files, by name.

    @property
    def caveats(self) -> tuple[str, ...]:
        """Where the results lie outside of what was verified, each sentence once."""
        return tuple(dict.fromkeys(text for stage in self.stages for text in stage.caveats))


class Software(TypedDict):
    """Program and system that compute something, by the names of the fields of a `Manifest`."""

    version: str
    code_hash: str
    python: str
    platform: str
    packages: dict[str, str]


def software() -> Software:
    """Fields of a `Manifest` that name the program and the system."""
    return {
        "version": __version__,
        "code_hash": code_hash(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": {name: version(name) for name in PACKAGES},
    }


def mesh_summary(mesh: Mesh) -> MeshSummary:
    """Count and judge a mesh."""
    return MeshSummary(
        nodes=len(mesh.nodes_mm),
        elements=len(mesh.elements),
        smallest_gauss_jacobian_mm3=float(jacobian_at_gauss(mesh).min()),
        smallest_scaled_jacobian=float(np.nanmin(scaled_jacobian(mesh))),
    )


def sha256(path: Path) -> str:
    """SHA-256 of a file's content, 64 hexadecimal digits."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def peak_memory_mb() -> float:
    """Largest resident memory of this process or of one of its workers. [MB]"""
    unit = 1 if sys.platform == "darwin" else _BYTES_PER_KIB
    peak = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return round(peak * unit / 1e6, 1)
