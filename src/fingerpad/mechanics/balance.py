"""The energy balance of a press: what the indenter gave is stored, spent, or held by the contact's springs.

    external = stored + dissipated + contact                                        [µJ = mN mm = kPa mm³]

Each term is computed independently, so their balance is a check of the indentation:

- external: the force of the indenter over its path, integral of F dd, also aside, and its torque over its
  rotations;
- stored: the energy that springs hold now, summed over the elements (`viscoelastic.stored_energy_density`);
- dissipated: the work of the stress on the tissue less the change of what is stored, and what friction turns
  into heat. With S = S0 - sum S_i the stress does the work dW0 + dU - sum S_i : dE, so that relaxation turns
  d(W0 + U - stored) - sum S_i : dE into heat;
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

from fingerpad.core.numba_internals import small_array
from fingerpad.core.threads import run_kernel
from fingerpad.core.values import FloatArray
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.element import N_NODES, N_POINTS, strain_changes, take_nodes
from fingerpad.mechanics.materials import MaterialTable
from fingerpad.mechanics.viscoelastic import N_STRESSES, InstantaneousState, StressHistory, flat

FEW_STEPS = 3  # Points of a phase below which a cubic cannot be drawn and straight lines take its place.

_SERIES_BELOW = 1e-2
_GAUSS_POINTS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True)
class EnergyBalance:
    """Energies over time, of the whole body also when half of it is solved."""

    times_ms: FloatArray  # From 0, the unloaded state, (n_times,). [ms]
    external_uj: FloatArray  # Work of the indenter since then, (n_times,). [µJ]
    stored_uj: FloatArray  # Energy in the springs of the tissue, (n_times,). [µJ]
    dissipated_uj: FloatArray  # Energy that relaxation and friction have turned into heat, (n_times,). [µJ]
    contact_uj: FloatArray  # Energy in the springs of the contact's penalty, (n_times,). [µJ]

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
        row = np.searchsorted(self.times_ms, times_ms)
        return EnergyBalance(
            self.times_ms[row], self.external_uj[row], self.stored_uj[row], self.dissipated_uj[row],
            self.contact_uj[row],
        )  # fmt: skip


class Entry(NamedTuple):
    """State and energies at the end of one step; the first is the unloaded body."""

    time_ms: float = 0.0
    way: tuple[float, ...] = (0.0,) * 5
    force: tuple[float, ...] = (0.0,) * 5
    """The indenter's advance, ways along x and z [mm] and rotations [radians], and the forces [mN] and
    torques [mN mm] that do work on them."""
    stored_uj: float = 0.0
    dissipated_uj: float = 0.0
    contact_uj: float = 0.0
    """As in `EnergyBalance`; dissipated and contact are sums over all steps up to here. [µJ]"""
    lost_uj: float = 0.0  # What would be stored if nothing had relaxed, less what is. [µJ]


class TissueEnergies(NamedTuple):
    """Energies of the body as it is meshed at the end of a step."""

    stored_uj: float  # Held by its springs. [µJ]
    instantaneous_uj: float  # What they would hold if nothing had relaxed, see `instantaneous_energy`. [µJ]
    relaxed_work_uj: float  # See `relaxed_work`; of this step. [µJ]


def energy_balance(entries: Sequence[Entry], kinks_ms: Sequence[float]) -> EnergyBalance:
    times, ways, forces, stored, dissipated, contact, _ = (
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

    Between kinks the force is a cubic spline of the way, or, where the way turns back, both are of time: a
    trapezium over the five ramp steps of a sphere errs by 2 %, and splines of time under a growing force by
    1 %, since the depth grows as a root of it. Either would hide what the balance shall show.
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
    forth = np.sign(depth[-1] - depth[0])
    if times.size < FEW_STEPS:
        steps = 0.5 * (force[1:] + force[:-1]) * np.diff(depth)
    elif (forth * np.diff(depth) > 0.0).all():
        return forth * CubicSpline(forth * depth, force).antiderivative()(forth * depth)
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
    """
    way = np.where(pressed_now > 0.0, gap_now, 0.0) - np.where(pressed_before > 0.0, gap_before, 0.0)
    return float(-0.5 * ((pressed_before + pressed_now) * way).sum())


@dataclass(frozen=True)
class MeanRelaxed:
    """Mean of the stress that a branch has relaxed away over a step, by its values at both ends.

    With S0 linear in the step, S_i' = (g_i S0 - S_i) / tau_i gives g_i (new S0 + old S0_n) + kept S_i,n,

        kept = (1 - exp(-x)) / x,   new = 1/2 - (1 - kept) / x,   old = 1 - kept - new,   x = dt / tau_i.
    """

    new: FloatArray
    old: FloatArray
    kept: FloatArray  # Shares g_i times `new` and `old`, and `kept`, (n_layers, n_terms).

    @classmethod
    def of(cls, table: MaterialTable, step_ms: float) -> MeanRelaxed:
        x = step_ms / table.times_ms
        kept = -np.expm1(-x) / x
        # In short steps the terms of `new` cancel down to x/6; its series is then good to 12 digits.
        series = x / 6.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 * (1.0 - x / 7.0))))
        new = np.where(x < _SERIES_BELOW, series, 0.5 - (1.0 - kept) / x)
        return cls(table.shares * new, table.shares * (1.0 - kept - new), kept)


@njit(cache=True, nogil=True)
def _relaxed_work(  # type: ignore[no-untyped-def]
    nodes, elements, before, now, layer, law, new, old, kept, stress_before, relaxed_before, stress_now,
    first, last,
):  # fmt: skip
    """Return the sum over elements of w_q S : 1/2 (C_n+1 - C_n), S being the mean relaxed stress."""
    reference, start, end = (
        small_array((N_NODES, 3)), small_array((N_NODES, 3)), small_array((N_NODES, 3)),
    )  # fmt: skip
    weights, changes, means = small_array((N_POINTS,)), small_array((6, N_POINTS)), small_array((N_STRESSES,))
    total = 0.0
    for e in range(first, last):
        material = layer[e]
        take_nodes(nodes, elements[e], reference)
        take_nodes(before, elements[e], start)
        take_nodes(now, elements[e], end)
        strain_changes(reference, start, end, law[material], weights, changes)
        all_new, all_old = new[material].sum(), old[material].sum()
        for k in range(N_STRESSES):
            means[k] = all_new * stress_now[e, k] + all_old * stress_before[e, k]
        for term in range(relaxed_before.shape[0]):
            share = kept[material, term]
            for k in range(N_STRESSES):
                means[k] += share * relaxed_before[term, e, k]
        for q in range(N_POINTS):
            for k in range(6):
                total += (1.0 if k < 3 else 2.0) * weights[q] * means[6 * q + k] * changes[k, q]
    return total


def relaxed_work(
    mesh: Mesh,
    before_mm: FloatArray,
    now_mm: FloatArray,
    table: MaterialTable,
    step_ms: float,
    before: StressHistory,
    now: InstantaneousState,
) -> float:
    """Work that the relaxed stress would have done in one step: the integral of sum_i S_i : dE.

    The mean of S_i is exact if S0 is linear in the step, as the stress update takes it.
    """
    mean = MeanRelaxed.of(table, step_ms)
    return sum(run_kernel(
        _relaxed_work, len(mesh.elements), mesh.nodes_mm, mesh.elements, before_mm, now_mm, mesh.layer,
        table.law, mean.new, mean.old, mean.kept, flat(before.instantaneous), flat(before.relaxed),
        flat(now.stress_kpa),
    ))  # fmt: skip


def instantaneous_energy(now: InstantaneousState) -> float:
    """Energy that the tissue would hold if nothing had relaxed, sum of W0 + U over the elements. [µJ]"""
    weights, isochoric = now.energies[:, :, 0], now.energies[:, :, 1]
    return float((weights * isochoric).sum() + weights.sum(axis=1) @ now.volumetric_kpa)
