"""The energy balance of a press: what the indenter gave is stored, spent, or held by the contact's springs.

    external = stored + dissipated + contact                                        [µJ = mN mm = kPa mm³]

Each term is computed independently, so their balance is a check of the indentation:

- external: the force of the indenter over its path, integral of F dd, also aside, and its torque over its
  rotations;
- stored: the energy that springs hold now, summed over the elements (`viscoelastic.stored_energy_density`);
- dissipated: what flows in the dampers of the Prony series, at 2 e_i / tau_i for a branch that holds e_i, and
  what friction turns into heat;
- contact: what closed the springs of the penalty, -integral of lambda dg over pressed nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.interpolate import CubicSpline

from fingerpad.core.checks import FloatArray
from fingerpad.core.numba_internals import small_array
from fingerpad.core.threads import run_kernel
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.element import N_NODES, N_POINTS, frame_scale, gradients_at_points, take_nodes
from fingerpad.mechanics.materials import COUPLED, MaterialTable
from fingerpad.mechanics.tensors import invert, push_forward
from fingerpad.mechanics.viscoelastic import InstantaneousState, StressHistory

FEW_STEPS = 3
"""Points of a phase below which a cubic cannot be drawn and straight lines take its place."""

_SERIES_BELOW = 1e-2
_GAUSS_POINTS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True)
class EnergyBalance:
    """Energies over time, of the whole body also when half of it is solved.

    Parameters
    ----------
    times_ms : array (n_times,)
        From 0, the unloaded state. [ms]
    external_uj : array (n_times,)
        Work of the indenter since then. [µJ]
    stored_uj : array (n_times,)
        Energy in the springs of the tissue. [µJ]
    dissipated_uj : array (n_times,)
        Energy that relaxation and friction have turned into heat. [µJ]
    contact_uj : array (n_times,)
        Energy in the springs of the contact's penalty. [µJ]

    Examples
    --------
    >>> balance = EnergyBalance(*np.array([[0.0, 1.0], [0.0, 10.0], [0.0, 8.0], [0.0, 1.5], [0.0, 0.4]]))
    >>> balance.imbalance_uj.round(3).tolist(), round(balance.relative_imbalance, 3)
    ([0.0, 0.1], 0.01)
    """

    times_ms: FloatArray
    external_uj: FloatArray
    stored_uj: FloatArray
    dissipated_uj: FloatArray
    contact_uj: FloatArray

    @property
    def imbalance_uj(self) -> FloatArray:
        """What the four terms leave over, (n_times,). [µJ]"""
        return self.external_uj - self.stored_uj - self.dissipated_uj - self.contact_uj

    @property
    def relative_imbalance(self) -> float:
        """Largest imbalance at any time over the largest external work."""
        largest = float(np.abs(self.external_uj).max())
        return float(np.abs(self.imbalance_uj).max()) / largest if largest > 0.0 else 0.0

    def at(self, times_ms: FloatArray) -> EnergyBalance:
        """Return the balance at some of its times. [ms]"""
        row = np.searchsorted(self.times_ms, times_ms)
        return EnergyBalance(
            self.times_ms[row], self.external_uj[row], self.stored_uj[row], self.dissipated_uj[row],
            self.contact_uj[row],
        )  # fmt: skip


class Entry(NamedTuple):
    """State and energies at the end of one step; the first is the unloaded body.

    Parameters
    ----------
    time_ms : float
        End of the step. [ms]
    way, force : tuple of 5 floats
        The indenter's advance, ways along x and z [mm] and rotations [radians], and the forces [mN] and
        torques [mN mm] that do work on them.
    stored_uj, dissipated_uj, contact_uj : float
        As in `EnergyBalance`; dissipated and contact are sums over all steps up to here. [µJ]
    """

    time_ms: float = 0.0
    way: tuple[float, ...] = (0.0,) * 5
    force: tuple[float, ...] = (0.0,) * 5
    stored_uj: float = 0.0
    dissipated_uj: float = 0.0
    contact_uj: float = 0.0


def energy_balance(entries: Sequence[Entry], kinks_ms: Sequence[float]) -> EnergyBalance:
    """Balance of all steps of a press.

    Parameters
    ----------
    entries : sequence of Entry
        One per step, from the unloaded state.
    kinks_ms : sequence of float
        Times at which the motion changes its speed abruptly: the end of the ramp. [ms]

    Returns
    -------
    EnergyBalance
        One row per entry.
    """
    times, ways, forces, stored, dissipated, contact = (
        np.array(column).T for column in zip(*entries, strict=True)
    )
    external = np.zeros(times.size)
    for way, force in zip(ways, forces, strict=True):
        if way.any():
            external += indenter_work(times, way, force, kinks_ms)
    return EnergyBalance(times, external, stored, dissipated, contact)


def indenter_work(
    times_ms: FloatArray, depth_mm: FloatArray, force_mn: FloatArray, kinks_ms: Sequence[float]
) -> FloatArray:
    """Work of a force over its path since the first time, cumulative.

    Force and depth are cubic splines of time between kinks and the integral of F dd/dt is exact for them.
    A trapezium over the five ramp steps of a sphere errs by 2 % and would hide what the balance shall show.

    Parameters
    ----------
    times_ms, depth_mm, force_mn : array (n_times,)
        Increasing times, depth and force. [ms, mm, mN]
    kinks_ms : sequence of float
        Those of the times where neither is smooth. [ms]

    Returns
    -------
    array (n_times,)
        [µJ]

    Examples
    --------
    >>> depth = np.linspace(0.0, 1.0, 5)
    >>> indenter_work(depth, depth, 3.0 * depth**2, kinks_ms=()).round(9).tolist()
    [0.0, 0.015625, 0.125, 0.421875, 1.0]
    """
    borders = np.flatnonzero(np.isin(times_ms, kinks_ms))
    borders = np.unique(np.concatenate([[0], borders, [times_ms.size - 1]]))
    done = np.zeros(times_ms.size)
    for first, last in pairwise(borders):
        phase = slice(first, last + 1)
        done[phase] = done[first] + _phase_work(times_ms[phase], depth_mm[phase], force_mn[phase])
    return done


def _phase_work(times: FloatArray, depth: FloatArray, force: FloatArray) -> FloatArray:
    """Cumulative work within one phase."""
    if times.size < FEW_STEPS:
        steps = 0.5 * (force[1:] + force[:-1]) * np.diff(depth)
    else:
        half, middle = 0.5 * np.diff(times)[:, None], 0.5 * (times[1:] + times[:-1])[:, None]
        points = middle + half * _GAUSS_POINTS
        power = CubicSpline(times, force)(points) * CubicSpline(times, depth)(points, 1)
        steps = (half * _GAUSS_WEIGHTS * power).sum(axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def contact_energy(
    gap_before: FloatArray, pressed_before: FloatArray, gap_now: FloatArray, pressed_now: FloatArray
) -> float:
    """Energy that a step puts into the springs of the penalty, -integral of lambda dg.

    Only the part of the way on which a node is pressed counts: a node without force is taken to lie on the
    indenter's surface, whatever its gap.

    Parameters
    ----------
    gap_before, gap_now : array (n,)
        Signed gaps of the candidate nodes at the ends of the step. [mm]
    pressed_before, pressed_now : array (n,)
        Their contact forces lambda. [mN]

    Returns
    -------
    float
        [µJ]

    Examples
    --------
    >>> contact_energy(np.array([0.2]), np.array([0.0]), np.array([-0.01]), np.array([4.0]))
    0.02
    """
    way = np.where(pressed_now > 0.0, gap_now, 0.0) - np.where(pressed_before > 0.0, gap_before, 0.0)
    return float(-0.5 * ((pressed_before + pressed_now) * way).sum())


@dataclass(frozen=True)
class DissipationCoefficients:
    """How the energy spent in a step depends on the branch's stress before and its increment.

    A branch starts with the stress q and the instantaneous stress grows evenly by d = g (S0 - S0_n); then
    q(t) = q exp(-t/tau) + d tau/dt (1 - exp(-t/tau)), and with c |q|² its energy, 2 c/tau times the integral
    of |q(t)|² over the step is

        c (A |q|² + B q.d + C |d|²),    x = dt/tau,   gamma = exp(-x),
        A = 1 - gamma²,   B = 2 (1 - gamma)²/x,   C = (2 x - 4 (1 - gamma) + 1 - gamma²)/x².

    Parameters
    ----------
    before, mixed, increment : array (n_layers, n_terms)
        A, B and C.
    """

    before: FloatArray
    mixed: FloatArray
    increment: FloatArray

    @classmethod
    def of(cls, table: MaterialTable, step_ms: float) -> DissipationCoefficients:
        """Coefficients of a step of `step_ms`. [ms]"""
        x = step_ms / table.times_ms
        lost, lost_twice = -np.expm1(-x), -np.expm1(-2.0 * x)
        # In short steps the terms of C cancel down to 2 x/3; its series is then good to 12 digits.
        series = x * (2.0 / 3.0 + x * (-0.5 + x * (7.0 / 30.0 + x * (-1.0 / 12.0 + x * 31.0 / 1260.0))))
        exact = (2.0 * x - 4.0 * lost + lost_twice) / x**2
        return cls(lost_twice, 2.0 * lost**2 / x, np.where(x < _SERIES_BELOW, series, exact))


@njit(cache=True, nogil=True)
def _dissipated(  # type: ignore[no-untyped-def]
    nodes, elements, displacement, layer, law, shares, before, mixed, increment, old, relaxed, new, energies,
    first, last,
):  # fmt: skip
    n_terms = relaxed.shape[0]
    weights, slopes = small_array((N_POINTS,)), small_array((N_POINTS, N_NODES, 3))
    gradients, inverse = small_array((N_POINTS, 3, 3)), small_array((3, 3))
    jacobians, spatial = small_array((N_POINTS,)), np.empty((n_terms + 2, 6))
    reference, moved = small_array((N_NODES, 3)), small_array((N_NODES, 3))
    total = 0.0
    for e in range(first, last):
        material = layer[e]
        take_nodes(nodes, elements[e], reference)
        take_nodes(displacement, elements[e], moved)
        volume = gradients_at_points(reference, moved, weights, slopes, gradients)
        present_volume = 0.0
        for q in range(N_POINTS):
            jacobians[q] = invert(gradients[q], inverse)
            present_volume += weights[q] * jacobians[q]
        for q in range(N_POINTS):
            scale = frame_scale(law[material], jacobians[q], present_volume / volume)
            push_forward(gradients[q], scale, new[e, q], spatial[0])
            push_forward(gradients[q], scale, old[e, q], spatial[1])
            for term in range(n_terms):
                push_forward(gradients[q], scale, relaxed[term, e, q], spatial[term + 2])
            for n in range(n_terms + 2):
                if law[material, 8] != COUPLED:  # only the deviator relaxes then
                    mean = (spatial[n, 0] + spatial[n, 1] + spatial[n, 2]) / 3.0
                    for k in range(3):
                        spatial[n, k] -= mean
            norm = 0.0
            for k in range(6):
                norm += (1.0 if k < 3 else 2.0) * spatial[0, k] * spatial[0, k]
            if not norm > 0.0:
                continue
            for term in range(n_terms):
                share = shares[material, term]
                if share > 0.0:
                    spent = 0.0
                    for k in range(6):
                        start = share * spatial[1, k] - spatial[term + 2, k]
                        grown = share * (spatial[0, k] - spatial[1, k])
                        rate = before[material, term] * start * start
                        rate += mixed[material, term] * start * grown
                        rate += increment[material, term] * grown * grown
                        spent += (1.0 if k < 3 else 2.0) * rate
                    total += weights[q] * energies[e, q, 1] / (share * norm) * spent
    return total


def dissipated_energy(
    mesh: Mesh,
    displacement: FloatArray,
    table: MaterialTable,
    step_ms: float,
    before: StressHistory,
    now: InstantaneousState,
) -> float:
    """Energy that relaxation turns into heat in one step, all elements together.

    Branch i holds e_i = c |tau_i|² with c = W0 / (g_i |tau0|²), as in `stored_energy_density`, and loses
    2 e_i / tau_i per time. Within the step its stress follows the exponentials that the stress update uses.
    This is exact for a linear law. For others c and the frame of the stresses are those of the step's end,
    and the loss rate is itself that of a linear law: docs/decisions/energy-balance.md says what that costs.

    Parameters
    ----------
    mesh : Mesh
        The undeformed body.
    displacement : array (n_nodes, 3)
        Displacements at the end of the step. [mm]
    table : MaterialTable
        Laws.
    step_ms : float
        Length of the step. [ms]
    before : StressHistory
        State at its start.
    now : InstantaneousState
        State at its end.

    Returns
    -------
    float
        [µJ]
    """
    c = DissipationCoefficients.of(table, step_ms)
    return sum(run_kernel(
        _dissipated, len(mesh.elements), mesh.nodes_mm, mesh.elements, displacement, mesh.layer, table.law,
        table.shares, c.before, c.mixed, c.increment, before.instantaneous, before.relaxed, now.stress_kpa,
        now.energies,
    ))  # fmt: skip
