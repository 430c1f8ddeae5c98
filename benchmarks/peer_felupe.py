"""The press by FElupe, from the common file: its bricks of mean dilatation, a penalty at the skin's nodes.

Runs in an environment of its own, without fingerpad.
"""

from __future__ import annotations

import sys
from importlib.metadata import version
from time import perf_counter
from typing import Any

import felupe
import numpy as np
from felupe.mechanics import ContactRigidBase

NODE_STIFFNESS_MN_PER_MM = 1e4
"""Penalty of a node of the skin: at 10 mN it penetrates by a micron."""

TOLERANCE, MOST_ITERATIONS = 1e-6, 40


class Ball(ContactRigidBase):
    """Rigid frictionless sphere around a point of the mesh, which carries it."""

    def __init__(self, field: Any, skin_nodes: np.ndarray, centre: int, radius_mm: float):
        self._radius_mm = radius_mm
        super().__init__(field, skin_nodes, centre, multiplier=NODE_STIFFNESS_MN_PER_MM)

    def _kinematics(self, offset: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        distance = np.linalg.norm(offset, axis=1)
        normal = offset / distance[:, None]
        tangential = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        return distance - self._radius_mm, normal, tangential / distance[:, None, None]


def press_block(block: str, found: str) -> dict[str, Any]:
    """Press; arguments and answer as in `peer_block.press_block`."""
    from pypardiso import spsolve  # only in the environment of this program

    with np.load(block) as stored:
        job = {name: stored[name] for name in stored.files}
    started = perf_counter()
    points, cells, layer = job["mesh_nodes_mm"], job["mesh_elements"], job["mesh_layer"]
    radius_mm, depths_mm = float(job["radius_mm"]), job["depths_mm"]
    shear_kpa = job["young_kpa"] / (2.0 * (1.0 + job["poisson"]))
    bulk_kpa = job["young_kpa"] / (3.0 * (1.0 - 2.0 * job["poisson"]))

    # The skin faces -y, so the sphere stands before it and moves along +y; its centre is the last point.
    mesh = felupe.Mesh(np.vstack([points, [0.0, -radius_mm, 0.0]]), cells, "hexahedron")
    mesh.update(cells=mesh.cells)
    region = felupe.RegionHexahedron(mesh)
    displacement = felupe.Field(region, dim=3)
    field = felupe.FieldContainer([displacement])
    bodies = []
    for index in np.unique(layer):
        part = felupe.Mesh(mesh.points, cells[layer == index], "hexahedron")
        own = felupe.FieldContainer([felupe.Field(felupe.RegionHexahedron(part), dim=3)])
        law = felupe.NeoHooke(mu=shear_kpa[index])
        bodies.append(felupe.SolidBodyNearlyIncompressible(law, own, bulk=bulk_kpa[index]))

    skin = np.unique(job["mesh_skin_grid"])
    reachable = skin[np.hypot(points[skin, 0], points[skin, 2]) < radius_mm + depths_mm[-1]]
    ball = Ball(field, reachable, len(points), radius_mm)

    is_centre = np.arange(len(mesh.points)) == len(points)
    is_bottom = np.isin(np.arange(len(mesh.points)), job["mesh_bone_nodes"])
    held = {
        "bottom": felupe.Boundary(displacement, mask=is_bottom),
        "beside": felupe.Boundary(displacement, mask=is_centre, skip=(0, 1, 0)),
        "down": felupe.Boundary(displacement, mask=is_centre, skip=(1, 0, 1)),
    }
    step = felupe.Step([*bodies, ball], ramp={held["down"]: depths_mm[1:]}, boundaries=held)
    force_mn: list[float] = []
    iterations: list[int] = []

    def record(context: Any, _state: Any) -> None:
        residual = context.substep.fun
        residual = residual.toarray() if hasattr(residual, "toarray") else np.asarray(residual)
        force_mn.append(float(residual.reshape(-1, 3)[-1, 1]))
        iterations.append(int(context.substep.iterations))

    felupe.Job([step], plugins=[record]).evaluate(
        x0=field, verbose=0, solver=spsolve, tol=TOLERANCE, maxiter=MOST_ITERATIONS
    )
    solve_s = perf_counter() - started
    sed_kpa = energy_density(field.extract()[0], region.dV, shear_kpa[layer], bulk_kpa[layer])
    np.savez(found, force_mn=force_mn, sed_kpa=sed_kpa)
    return {
        "solve_s": solve_s,
        "newton_steps": sum(iterations),
        "version": f"FElupe {version('felupe')}, NumPy {np.__version__}, Python {sys.version.split()[0]}",
    }


def energy_density(
    gradient: np.ndarray, volume_mm3: np.ndarray, shear_kpa: np.ndarray, bulk_kpa: np.ndarray
) -> np.ndarray:
    """Element means of mu/2 (I1 - 3) + K/2 (J - 1)^2, J being the element's mean. [kPa]

    Parameters
    ----------
    gradient : array (3, 3, n_points, n_elements)
        Deformation gradient.
    volume_mm3 : array (n_points, n_elements)
        Undeformed volume of each point. [mm3]
    shear_kpa, bulk_kpa : array (n_elements,)
        Moduli. [kPa]

    Examples
    --------
    >>> simple_shear = np.array([[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).reshape(3, 3, 1, 1)
    >>> energy_density(simple_shear, np.ones((1, 1)), np.array([20.0]), np.array([400.0])).round(9).tolist()
    [0.1]
    """
    size = volume_mm3.sum(axis=0)
    jacobian = np.linalg.det(np.moveaxis(gradient, (0, 1), (-2, -1)))
    first_invariant = (gradient**2).sum(axis=(0, 1)) * jacobian ** (-2.0 / 3.0)
    mean_jacobian = (jacobian * volume_mm3).sum(axis=0) / size
    isochoric = (shear_kpa / 2.0 * (first_invariant - 3.0) * volume_mm3).sum(axis=0) / size
    return isochoric + bulk_kpa / 2.0 * (mean_jacobian - 1.0) ** 2
