"""FElupe as an oracle: the same job by its mean-dilatation bricks and a penalty at the nodes.

FElupe is GPL: it is imported by tests only, here.
"""

from __future__ import annotations

import felupe
import numpy as np
from felupe.mechanics import ContactRigidBase
from scipy.sparse.linalg import splu

from fingerpad.export.job import Job

NODE_STIFFNESS_MN_PER_MM = 1e4
"""Penalty of a node; those under the sphere carry up to 10 mN, so they penetrate by a micron."""


class _Ball(ContactRigidBase):
    """Rigid frictionless sphere around a point of the mesh."""

    def __init__(self, field, nodes, centre, radius):
        self.radius = radius
        super().__init__(field, nodes, centre, multiplier=NODE_STIFFNESS_MN_PER_MM)

    def _kinematics(self, offset):
        distance = np.linalg.norm(offset, axis=1)
        normal = offset / distance[:, None]
        slope = (np.eye(3) - normal[:, :, None] * normal[:, None, :]) / distance[:, None, None]
        return distance - self.radius, normal, slope


def press(job: Job) -> tuple[np.ndarray, np.ndarray]:
    """Solve a job of neo-Hookean layers under a sphere.

    Returns
    -------
    array (n_times,), array (n_elements,)
        Force on the meshed body along the axis at each time after 0 [mN], and SED at the end [kPa].
    """
    mesh, radius = job.mesh, job.indenter.radius_mm
    centre = job.placement.origin_mm - radius * job.placement.axis
    points = np.vstack([mesh.nodes_mm, centre])
    whole = felupe.Mesh(points, np.array(mesh.elements), "hexahedron")
    whole.update(cells=whole.cells)
    region = felupe.RegionHexahedron(whole)
    displacement = felupe.Field(region, dim=3)
    field = felupe.FieldContainer([displacement])
    shear = np.array([material.shear_modulus_kpa for material in job.materials])
    bulk = np.array([material.bulk_modulus_kpa for material in job.materials])
    bodies = []
    for layer in job.layer_names:
        part = felupe.Mesh(whole.points, np.array(mesh.elements[mesh.layer == layer]), "hexahedron")
        own = felupe.FieldContainer([felupe.Field(felupe.RegionHexahedron(part), dim=3)])
        law = felupe.NeoHooke(mu=shear[layer])
        bodies.append(felupe.SolidBodyNearlyIncompressible(law, own, bulk=bulk[layer]))
    ball = _Ball(field, job.touching_nodes, len(mesh.nodes_mm), radius)

    def mask(nodes):
        return np.isin(np.arange(len(points)), nodes)

    at_centre = mask(len(mesh.nodes_mm))
    held = {
        "fixed": felupe.Boundary(displacement, mask=mask(mesh.fixed_nodes)),
        "symmetry": felupe.Boundary(displacement, mask=mask(mesh.symmetry_nodes), skip=(1, 1, 0)),
        "beside": felupe.Boundary(displacement, mask=at_centre, skip=(0, 1, 0)),
        "down": felupe.Boundary(displacement, mask=at_centre, skip=(1, 0, 1)),
    }
    step = felupe.Step([*bodies, ball], ramp={held["down"]: job.depths_mm[1:]}, boundaries=held)
    force = []

    def record(context, _state):
        residual = context.substep.fun
        residual = residual.toarray() if hasattr(residual, "toarray") else np.asarray(residual)
        force.append(float(residual.reshape(-1, 3)[-1] @ job.placement.axis))

    felupe.Job([step], plugins=[record]).evaluate(x0=field, verbose=0, solver=_solved, tol=1e-7, maxiter=40)
    return np.array(force), _energy_density(field, region, shear[mesh.layer], bulk[mesh.layer])


def _solved(stiffness, load):
    """Solution of a linear system; an ordering for symmetric matrices takes a quarter of the time."""
    symmetric = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    return splu(stiffness.tocsc(), **symmetric).solve(load)


def _energy_density(field, region, shear, bulk):
    """Element means of mu/2 (I1-3) + K/2 (J-1)², J being that of the element."""
    gradient = field.extract()[0]
    volume = np.linalg.det(np.moveaxis(gradient, (0, 1), (-2, -1)))
    first = (gradient**2).sum((0, 1)) * volume ** (-2 / 3)
    size = region.dV.sum(0)
    shape = (shear / 2 * (first - 3) * region.dV).sum(0) / size
    return shape + bulk / 2 * ((volume * region.dV).sum(0) / size - 1) ** 2
