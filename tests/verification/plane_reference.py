"""An independent reference for plane strain: high-order finite elements of neo-Hooke, in NumPy.

Displacement elements of order 6 and more do not lock at nu = 0.4999, need no pressure of their own and share
nothing with the product: other shape functions, other quadrature, stress and tangent written out as

    P = G J^(-2/3) (F - I1/3 F^-T) + K (J - 1) J F^-T,    I1 = F : F + 1.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre
from scipy import sparse
from scipy.sparse.linalg import splu


def lobatto(order):
    """Gauss-Lobatto points of an element of this order."""
    inner = legendre.Legendre.basis(order).deriv().roots()
    return np.concatenate([[-1.0], np.sort(inner.real), [1.0]])


def lagrange(nodes, points):
    """Values and slopes (n_points, n_nodes) of the Lagrange polynomials through `nodes`."""
    powers = np.linalg.inv(np.vander(nodes, increasing=True))
    degree = np.arange(len(nodes))
    values = points[:, None] ** degree
    slopes = degree * points[:, None] ** np.maximum(degree - 1, 0)
    return values @ powers, slopes @ powers


class PlaneBody:
    """Plane strain of a mapped rectangle.

    Parameters
    ----------
    x_edges, y_edges : array
        Element borders on the unit square.
    order : int
        Degree of the displacements.
    mapping : callable
        From points (n, 2) of the unit square to the body. [mm]
    """

    def __init__(self, x_edges, y_edges, order, mapping):
        nodes = lobatto(order)
        lines = []
        for edges in (x_edges, y_edges):
            inside = [a + (b - a) * (nodes[1:] + 1) / 2 for a, b in pairwise(edges)]
            lines.append(np.concatenate([edges[:1], *inside]))
        self.shape = tuple(len(line) for line in lines)
        unit = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
        self.nodes_mm = mapping(unit)
        self.unit = unit
        starts = [np.arange(0, size - 1, order) for size in self.shape]
        local = np.arange(order + 1)
        rows = starts[0][:, None, None, None] + local[None, None, :, None]
        columns = starts[1][None, :, None, None] + local[None, None, None, :]
        self.elements = (rows * self.shape[1] + columns).reshape(-1, (order + 1) ** 2)
        points, weights = legendre.leggauss(order + 2)
        values, slopes = lagrange(nodes, points)
        dx = np.einsum("pa,qb->pqab", slopes, values).reshape(len(points) ** 2, -1)
        dy = np.einsum("pa,qb->pqab", values, slopes).reshape(len(points) ** 2, -1)
        local_slopes = np.stack([dx, dy], axis=-1)
        jacobian = np.einsum("eai,qaj->eqij", self.nodes_mm[self.elements], local_slopes)
        self.slopes = np.einsum("qaj,eqjk->eqak", local_slopes, np.linalg.inv(jacobian))
        self.weights = np.outer(weights, weights).ravel() * np.linalg.det(jacobian)

    def solve(self, shear, bulk, fixed, load, steps):
        """Displacements (n_nodes, 2) under dead nodal forces `load` with nodes `fixed`. [mm]"""
        moved = np.zeros_like(self.nodes_mm)
        free = np.flatnonzero(np.repeat(~fixed, 2))
        dofs = (2 * self.elements[:, :, None] + np.arange(2)).reshape(len(self.elements), -1)
        row, column = (
            np.broadcast_to(index, (*dofs.shape, dofs.shape[1])).ravel()
            for index in (dofs[:, :, None], dofs[:, None, :])
        )
        before = moved
        for n in range(1, steps + 1):
            # Extrapolated, since Newton's method overshoots from afar where volume can hardly change.
            moved, before = 2 * moved - before, moved
            for iteration in range(60):
                force, stiffness = self._system(moved, shear, bulk)
                total = np.zeros(moved.size)
                np.add.at(total, dofs.ravel(), force.ravel())
                residual = (n / steps * load.ravel() - total)[free]
                if iteration and np.abs(residual).max() <= 1e-8 * np.abs(total).max():
                    break
                matrix = sparse.csc_matrix((stiffness.ravel(), (row, column)), shape=2 * (moved.size,))
                step = np.zeros(moved.size)
                step[free] = splu(matrix[free][:, free]).solve(residual)
                step, work = step.reshape(moved.shape), n / steps * load
                start = self._potential(moved, shear, bulk, work)
                for length in 0.5 ** np.arange(12):
                    if self._potential(moved + length * step, shear, bulk, work) <= start + 1e-10 * abs(
                        start
                    ):
                        break
                moved = moved + length * step
            else:
                raise AssertionError("the plane reference found no equilibrium")
        return moved

    def _potential(self, moved, shear, bulk, load):
        """Energy less work of the load; NaN where the body is inside out. [µJ]"""
        f = np.eye(2) + np.einsum("eai,eqaj->eqij", moved[self.elements], self.slopes)
        j = np.linalg.det(f)
        if not (j > 0).all():
            return np.nan
        first = (f**2).sum(axis=(-1, -2)) + 1.0
        energy = shear / 2 * (j ** (-2 / 3) * first - 3) + bulk / 2 * (j - 1) ** 2
        return (self.weights * energy).sum() - (load * moved).sum()

    def _system(self, moved, shear, bulk):
        """Element forces (e, 2 n) and stiffness (e, 2 n, 2 n)."""
        f = np.eye(2) + np.einsum("eai,eqaj->eqij", moved[self.elements], self.slopes)
        j = np.linalg.det(f)[..., None, None]
        g = np.linalg.inv(f).swapaxes(-1, -2)
        first = (f**2).sum(axis=(-1, -2), keepdims=True) + 1.0
        scale = shear * j ** (-2 / 3)
        stress = scale * (f - first / 3 * g) + bulk * (j - 1) * j * g
        scale, first, j = (value[..., None, None] for value in (scale, first, j))

        def outer(a, b):
            return a[..., :, :, None, None] * b[..., None, None, :, :]

        crossed = np.einsum("eqil,eqkj->eqijkl", g, g)
        same = np.einsum("ik,jl->ijkl", np.eye(2), np.eye(2))
        moduli = scale * (
            same - 2 / 3 * (outer(f, g) + outer(g, f)) + 2 / 9 * first * outer(g, g) + first / 3 * crossed
        ) + bulk * j * ((2 * j - 1) * outer(g, g) - (j - 1) * crossed)
        force = np.einsum("eq,eqij,eqaj->eai", self.weights, stress, self.slopes, optimize=True)
        weighted = self.weights[..., None, None, None, None] * moduli
        right = np.einsum("eqijkl,eqbl->eqjikb", weighted, self.slopes)
        elements, _, n_nodes, _ = self.slopes.shape
        left = self.slopes.transpose(0, 2, 1, 3).reshape(elements, n_nodes, -1)
        stiffness = left @ right.reshape(elements, left.shape[2], -1)
        stiffness = stiffness.reshape(elements, n_nodes, 2, 2, n_nodes).transpose(0, 1, 2, 4, 3)
        size = 2 * self.elements.shape[1]
        return force.reshape(-1, size), stiffness.reshape(-1, size, size)
