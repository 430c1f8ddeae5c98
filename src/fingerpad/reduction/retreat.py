"""Contact that retreats: skin that has relaxed stays behind the indenter.

On the way down, each ring of skin meets the indenter at a level e of the depth below first touch and follows
it from then on. A response Y(d) to the depth d is therefore that of springs, one per level, of the ways
u_e = d - e (method of dimensionality reduction: Popov & Hess, Method of Dimensionality Reduction in Contact
Mechanics and Friction, 2015):

    Y(d) = sum_e s_e u_e,    s_e the change of the slope of Y at e.

Each spring relaxes as the force does: it presses with f_e = u_e - sum_i m_ie, where branch i of the tissues
filters g_i u_e. On the way up it follows the indenter while f_e > 0. Then it is free and recovers with
f_e = 0, until the indenter meets it again. While no spring is free this changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.reduction.relaxation import filter_step

LEVELS = 48
"""Number of springs."""


def levels_mm(deepest_mm: float) -> FloatArray:
    """Levels of the springs, (LEVELS,), denser where contact begins. [mm]"""
    return np.asarray(deepest_mm * (np.arange(LEVELS) / LEVELS) ** 1.5)


def slope_changes(levels: FloatArray, deepest_mm: float, values: FloatArray) -> FloatArray:
    """Weights s_e of the springs, (n_levels, n), of functions with values (n_levels + 1, n).

    The values are those at the levels and at the largest depth; between them the functions are linear.
    """
    slopes = np.diff(values, axis=0) / np.diff(np.append(levels, deepest_mm))[:, None]
    return np.diff(slopes, axis=0, prepend=0.0)


@dataclass(frozen=True)
class Springs:
    """Ways of the springs, and what their branches have relaxed."""

    way_mm: FloatArray
    """u, at most 0 before the first touch of a level, (n_levels,). [mm]"""
    relaxed_mm: FloatArray
    """m, (n_branches, n_levels). [mm]"""

    @classmethod
    def at_rest(cls, n_branches: int) -> Springs:
        """Springs that nothing has touched."""
        return cls(np.zeros(LEVELS), np.zeros((n_branches, LEVELS)))

    def followed(
        self,
        step_ms: float,
        followed_mm: FloatArray,
        times_ms: FloatArray,
        shares: FloatArray,
        kept: float = 1.0,
    ) -> Springs:
        a, b, gamma = (each[:, None] for each in filter_step(step_ms, times_ms))
        known = kept * (b * shares[:, None] * self.way_mm + gamma * self.relaxed_mm)
        now = a * shares[:, None]
        free_mm = known.sum(axis=0) / (1.0 - now.sum())
        way_mm = np.maximum(followed_mm, free_mm)
        return Springs(way_mm, now * way_mm + known)
