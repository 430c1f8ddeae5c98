"""How a response to a pose relaxes: one first-order filter per time constant of the tissues.

Each branch i of the tissues' Prony series has relaxed a stress S_i away (`fingerpad.mechanics.viscoelastic`)
that follows tau_i dS_i/dt = g_i S0 - S_i. While the deformation follows the pose p alone, any quantity that
is linear in the stress therefore is

    y(t) = Y(p(t)) - sum_i m_i(t),    tau_i dm_i/dt = D_i(p(t)) - m_i,

with Y the response at once and D_i what branch i relaxes in a long hold of the pose. As in the full solver,
D_i is linear within a step, and then the steps are exact. Two corrections matter
(docs/decisions/reduced-touch.md):

- The stored energy is quadratic. Each branch holds an energy E_i = r_i^2 of a strain r_i, so r_i is filtered,
  and the branch has lost r_i^2 - (r_i - m_i)^2.
- Stress that relaxed at one depth counts less when the indenter has gone deeper, and more when it has come
  back: m_i filters s(d) D_i and counts as m_i / s(d), with s a power of the depth. At one depth s cancels.

`Springs` are for contact that retreats: skin that has relaxed stays behind the indenter. On the way down,
each ring of skin meets the indenter at a level e of the depth below first touch and follows it from then on.
A response Y(d) to the depth d is therefore that of springs, one per level, of the ways u_e = d - e (method of
dimensionality reduction: Popov & Hess, Method of Dimensionality Reduction in Contact Mechanics and Friction,
2015):

    Y(d) = sum_e s_e u_e,    s_e the change of the slope of Y at e.

Each spring relaxes as the force does: it presses with f_e = u_e - sum_i m_ie, where branch i of the tissues
filters g_i u_e. On the way up it follows the indenter while f_e > 0. Then it is free and recovers with f_e =
0, until the indenter meets it again. While no spring is free this changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.core.values import FloatArray


def filter_step(step_ms: float, times_ms: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Factors a, b and gamma of m = a D + b D_before + gamma m_before, (n_branches,) each."""
    if step_ms == 0.0:
        return np.zeros(times_ms.size), np.zeros(times_ms.size), np.ones(times_ms.size)
    gamma = np.exp(-step_ms / times_ms)
    average = times_ms / step_ms * (1.0 - gamma)
    return 1.0 - average, average - gamma, gamma


SHALLOWEST = 0.4  # Share of the largest depth up to which what has relaxed counts alike.


def depth_scale(depth_mm: float, deepest_mm: float, exponents: FloatArray) -> FloatArray:
    """Scale s of what relaxes at a depth, of the shape of the exponents; 1 at the largest depth."""
    return np.asarray(max(depth_mm / deepest_mm, SHALLOWEST) ** exponents)


def amplitudes(values: FloatArray, squared: FloatArray) -> FloatArray:
    """Return what relaxes linearly: values, or roots of those that are squares, (..., n_quantities, n)."""
    found = values.copy()
    found[..., squared, :] = np.sqrt(np.maximum(values[..., squared, :], 0.0))
    return found


def lost(amplitude: FloatArray, relaxed: FloatArray, squared: FloatArray) -> FloatArray:
    """Values that are lost when amplitudes have relaxed by `relaxed`, (..., n_quantities, n)."""
    found = relaxed.copy()
    found[..., squared, :] *= 2.0 * amplitude[..., squared, :] - relaxed[..., squared, :]
    return found


def filtered(times_ms: FloatArray, values: FloatArray, constant_ms: float) -> FloatArray:
    """Filter values over time that start from rest."""
    found = np.zeros_like(values)
    for now in range(1, times_ms.size):
        a, b, gamma = filter_step(times_ms[now] - times_ms[now - 1], np.array([constant_ms]))
        found[now] = a * values[now] + b * values[now - 1] + gamma * found[now - 1]
    return found


LEVELS = 48


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

    way_mm: FloatArray  # u, at most 0 before the first touch of a level, (n_levels,). [mm]
    relaxed_mm: FloatArray  # m, (n_branches, n_levels). [mm]

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
