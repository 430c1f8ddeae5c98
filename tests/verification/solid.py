"""Boundary-value problems that a press does not offer: given displacements and nodal loads, no contact.

The product's kernel adds up forces and tangent; Newton's method and the sparse factor are plain SciPy, so
that nothing of the product's own solver stands between a wrong kernel and a wrong answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.sparse.linalg import splu

from fingerpad.geometry.mesh import CORNERS, Mesh
from fingerpad.mechanics.assembly import Sparsity, assemble
from fingerpad.mechanics.materials import Material, MaterialTable
from fingerpad.mechanics.viscoelastic import StepCoefficients, StressHistory

POINTS = CORNERS / np.sqrt(3.0)


@dataclass(frozen=True)
class Solid:
    """A mesh with its materials.

    Parameters
    ----------
    mesh : Mesh
        Nodes and bricks.
    materials : tuple of Material
        One per layer.
    """

    mesh: Mesh
    materials: tuple[Material, ...]

    @cached_property
    def table(self) -> MaterialTable:
        """Materials as the kernel reads them."""
        return MaterialTable.of(self.materials)

    @cached_property
    def sparsity(self) -> Sparsity:
        """Pattern of the tangent."""
        return Sparsity.of(self.mesh.elements, len(self.mesh.nodes_mm))

    def evaluate(self, displacement, with_tangent=False, step=None, history=None):
        """Potential [µJ], internal forces [mN] and tangent blocks [mN/mm]; elastic if no step is given."""
        mesh = self.mesh
        if step is None:
            step = StepCoefficients.of(self.table, 1e-9)
        if history is None:
            history = StressHistory.unloaded(len(mesh.elements), self.table.shares.shape[1])
        force = np.empty_like(mesh.nodes_mm)
        blocks = np.empty((self.sparsity.column.size, 3, 3))
        potential = assemble(
            mesh, displacement, self.table.law, step.s,
            history.carried(step, mesh.layer), self.sparsity, with_tangent, force, blocks,
        )  # fmt: skip
        return potential, force, blocks

    def solve(self, given, values=0.0, load=0.0, steps=1, tolerance=1e-10):
        """Equilibrium under given displacements and dead nodal loads.

        Parameters
        ----------
        given : bool array (n_nodes, 3)
            Which displacements are prescribed.
        values, load : array (n_nodes, 3)
            Prescribed displacements [mm] and nodal forces [mN], both reached in equal `steps`.

        Returns
        -------
        array (n_nodes, 3)
            Displacements. [mm]
        """
        values, load = (np.broadcast_to(field, self.mesh.nodes_mm.shape) for field in (values, load))
        given = given.ravel().copy()
        unused = np.ones(len(self.mesh.nodes_mm), dtype=bool)
        unused[self.mesh.elements] = False  # nodes that a seam or an axis left over
        given[np.repeat(unused, 3)] = True
        free = np.flatnonzero(~given)
        displacement = np.zeros(self.mesh.nodes_mm.shape)
        before = displacement
        for n in range(1, steps + 1):
            share = n / steps
            # Extrapolated, since Newton's method overshoots from afar where volume can hardly change.
            displacement, before = 2 * displacement - before, displacement
            move = np.where(given, share * values.ravel() - displacement.ravel(), 0.0)
            for iteration in range(60):
                potential, force, blocks = self.evaluate(displacement, True)
                potential -= share * (load * displacement).sum()
                residual = (share * load - force).ravel()
                scale = max(np.abs(force).max(), np.abs(load).max(), 1e-300)
                if iteration and np.abs(residual[free]).max() <= tolerance * scale:
                    break
                tangent = self.sparsity.matrix(blocks).tocsc()
                right = (residual - tangent @ move)[free]
                factor = splu(
                    tangent[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                    options={"SymmetricMode": True},
                )  # fmt: skip
                prescribed = move.any()
                move[free] = factor.solve(right)
                move = move.reshape(displacement.shape)
                # Down the potential by halving, unless the boundary moves; round-off may lift it a little.
                highest = np.inf if prescribed else potential + 1e-10 * abs(potential)
                for length in 0.5 ** np.arange(12):
                    trial = displacement + length * move
                    if self.evaluate(trial)[0] - share * (load * trial).sum() <= highest:
                        break
                displacement = trial
                move = np.where(given, share * values.ravel() - displacement.ravel(), 0.0)
            else:
                largest = np.abs(residual[free]).max()
                raise AssertionError(f"no equilibrium at {share:.0%} of the load: {largest:.1e} mN left")
        return displacement


def shape_functions(points):
    """Values (n_points, 8) and local slopes (n_points, 8, 3) of the trilinear brick."""
    factors = 1.0 + points[:, None, :] * CORNERS
    slopes = np.stack(
        [CORNERS[:, axis] * np.delete(factors, axis, axis=2).prod(axis=2) / 8.0 for axis in range(3)], axis=-1
    )
    return factors.prod(axis=2) / 8.0, slopes


def gauss(order):
    """Points (order³, 3) and weights of the product rule on the brick [-1, 1]³."""
    point, weight = np.polynomial.legendre.leggauss(order)
    points = np.array(list(product(point, repeat=3)))
    return points, np.array([np.prod(w) for w in product(weight, repeat=3)])


def at_points(mesh, displacement, points=POINTS, weights=None):
    """Positions (e, q, 3), weights (e, q), displacements (e, q, 3) and gradients F (e, q, 3, 3)."""
    values, slopes = shape_functions(points)
    corners, moved = mesh.nodes_mm[mesh.elements], displacement[mesh.elements]
    jacobian = np.einsum("eai,qaj->eqij", corners, slopes)
    inverse = np.linalg.inv(jacobian)
    gradient = np.eye(3) + np.einsum("eai,qak,eqkj->eqij", moved, slopes, inverse, optimize=True)
    volume = np.linalg.det(jacobian) * (1.0 if weights is None else weights)
    return (
        np.einsum("eai,qa->eqi", corners, values),
        volume,
        np.einsum("eai,qa->eqi", moved, values),
        gradient,
    )


def mean_dilatation(mesh, displacement):
    """Jbar of every element: present over reference volume, (n_elements,)."""
    _, weights, _, gradient = at_points(mesh, displacement)
    return (weights * np.linalg.det(gradient)).sum(axis=1) / weights.sum(axis=1)


def rotation(seed=5):
    """A rotation matrix about no special axis."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)
