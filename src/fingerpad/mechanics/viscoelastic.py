"""Prony series in the convected frame, one step at a time (after Simo 1987; Simo & Hughes 1998, ch. 10).

Every branch i keeps S_i, the stress that it has already relaxed away. With S0 the instantaneous deviatoric
stress, assumed linear within a step of length dt,

    gamma_i = exp(-dt/tau_i),   a_i = 1 - tau_i/dt (1 - gamma_i),   b_i = tau_i/dt (1 - gamma_i) - gamma_i,
    S_i     = a_i g_i S0 + b_i g_i S0_n + gamma_i S_i,n,
    S       = S0 - sum_i S_i = (1 - sum_i a_i g_i) S0 - H,    H = sum_i (b_i g_i S0_n + gamma_i S_i,n).

H is known before the step, so the step has a potential, and its tangent is exact and symmetric.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from fingerpad.core.numba_internals import small_array
from fingerpad.core.threads import run_kernel
from fingerpad.core.values import FloatArray
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.element import N_NODES, N_POINTS, element_state, relaxing_norms, take_nodes
from fingerpad.mechanics.materials import MaterialTable, has_formulas

N_STRESSES = 6 * N_POINTS  # Numbers of an element's stresses at its points, which lie side by side in memory.


def flat(stresses: FloatArray) -> FloatArray:
    """Return the same stresses (..., 8, 6) with those of an element in one row, (..., 48)."""
    return stresses.reshape(*stresses.shape[:-2], N_STRESSES)


@dataclass(frozen=True)
class StepCoefficients:
    """Coefficients of one time step, one row per layer."""

    step_ms: float  # Its length. [ms]
    s: FloatArray  # 1 - sum_i a_i g_i, the factor on the instantaneous energy, (n_layers,).
    new: FloatArray
    old: FloatArray
    decay: FloatArray  # a_i g_i, b_i g_i and gamma_i, (n_layers, n_terms).

    @classmethod
    def of(cls, table: MaterialTable, step_ms: float) -> StepCoefficients:
        decay = np.exp(-step_ms / table.times_ms)
        average = table.times_ms / step_ms * (1.0 - decay)
        new, old = (1.0 - average) * table.shares, (average - decay) * table.shares
        return cls(step_ms, 1.0 - new.sum(axis=1), new, old, decay)


@dataclass(frozen=True)
class StressHistory:
    """Stress state that a step starts from, at every Gauss point of every element."""

    instantaneous: FloatArray  # S0, the instantaneous deviatoric stress, (n_elements, 8, 6). [kPa]
    relaxed: FloatArray
    """S_i, the stress that each branch has relaxed away, (n_terms, n_elements, 8, 6). [kPa]"""

    @classmethod
    def unloaded(cls, n_elements: int, n_terms: int) -> StressHistory:
        return cls(np.zeros((n_elements, N_POINTS, 6)), np.zeros((n_terms, n_elements, N_POINTS, 6)))

    def carried(self, step: StepCoefficients, layer: np.ndarray) -> FloatArray:
        """H of the next step, (n_elements, 8, 6). [kPa]"""
        total = np.empty_like(self.instantaneous)
        before = flat(self.instantaneous), flat(self.relaxed)
        run_kernel(_carry, len(layer), step.old, step.decay, layer, *before, flat(total))
        return total

    def advanced(self, step: StepCoefficients, layer: np.ndarray, instantaneous: FloatArray) -> StressHistory:
        """State at the end of the step, given S0 there."""
        relaxed = np.empty_like(self.relaxed)
        run_kernel(
            _relax, len(layer), step.new, step.old, step.decay, layer, flat(instantaneous),
            flat(self.instantaneous), flat(self.relaxed), flat(relaxed),
        )  # fmt: skip
        return StressHistory(instantaneous, relaxed)


@njit(cache=True, nogil=True)
def _carry(old, decay, layer, instantaneous, relaxed, total, first, last):  # type: ignore[no-untyped-def]
    """Write H = sum_i (b_i g_i S0_n + gamma_i S_i,n)."""
    for e in range(first, last):
        material = layer[e]
        all_old = old[material].sum()
        for k in range(N_STRESSES):
            total[e, k] = all_old * instantaneous[e, k]
        for term in range(relaxed.shape[0]):
            gamma = decay[material, term]
            for k in range(N_STRESSES):
                total[e, k] += gamma * relaxed[term, e, k]


@njit(cache=True, nogil=True)
def _relax(new, old, decay, layer, now, before, relaxed_before, relaxed, first, last):  # type: ignore[no-untyped-def]
    """Write S_i = a_i g_i S0 + b_i g_i S0_n + gamma_i S_i,n."""
    for term in range(relaxed.shape[0]):
        for e in range(first, last):
            a, b, gamma = new[layer[e], term], old[layer[e], term], decay[layer[e], term]
            for k in range(N_STRESSES):
                relaxed[term, e, k] = a * now[e, k] + b * before[e, k] + gamma * relaxed_before[term, e, k]


@njit(cache=True, nogil=True)
def _states(  # type: ignore[no-untyped-def]
    nodes, elements, displacement, layer, law, formulas, stress, energies, volumetric, pressure, dilatation,
    first, last,
):  # fmt: skip
    reference, moved = small_array((N_NODES, 3)), small_array((N_NODES, 3))
    for e in range(first, last):
        take_nodes(nodes, elements[e], reference)
        take_nodes(displacement, elements[e], moved)
        volumetric[e], pressure[e], dilatation[e] = element_state(
            reference, moved, law[layer[e]], stress[e], energies[e], formulas
        )


@njit(cache=True, nogil=True)
def _stored_energy(  # type: ignore[no-untyped-def]
    nodes, elements, displacement, layer, law, shares, instantaneous, relaxed, energies, volumetric, stored,
    first, last,
):  # fmt: skip
    n_terms = relaxed.shape[0]
    tensors, norms = np.empty((n_terms + 1, N_POINTS, 6)), np.empty((n_terms + 1, N_POINTS))
    stresses = tensors.reshape(n_terms + 1, N_STRESSES)
    reference, moved = small_array((N_NODES, 3)), small_array((N_NODES, 3))
    for e in range(first, last):
        for k in range(N_STRESSES):
            stresses[0, k] = instantaneous[e, k]
        for term in range(n_terms):
            share = shares[layer[e], term]
            for k in range(N_STRESSES):
                stresses[term + 1, k] = share * instantaneous[e, k] - relaxed[term, e, k]
        take_nodes(nodes, elements[e], reference)
        take_nodes(displacement, elements[e], moved)
        relaxing_norms(reference, moved, law[layer[e]], tensors, norms)
        total, volume = 0.0, 0.0
        for q in range(N_POINTS):
            share = law[layer[e], 7]
            for term in range(n_terms):
                if shares[layer[e], term] > 0.0 and norms[0, q] > 0.0:
                    share += norms[term + 1, q] / (shares[layer[e], term] * norms[0, q])
            total += energies[e, q, 0] * share * energies[e, q, 1]
            volume += energies[e, q, 0]
        stored[e] = total / volume + volumetric[e]


class InstantaneousState(NamedTuple):
    """What the deformation alone determines, without relaxation."""

    stress_kpa: FloatArray
    """S0, the instantaneous stress that may relax, at each Gauss point, (n_elements, 8, 6). [kPa]"""
    energies: FloatArray
    """Integration weight and instantaneous energy W0 that may relax, (n_elements, 8, 2). [mm³, kPa]"""
    volumetric_kpa: FloatArray
    pressure_kpa: FloatArray
    """U(Jbar) and U'(Jbar); 0 for coupled laws, whose whole stress is in S0, (n_elements,). [kPa]"""
    dilatation: FloatArray


def instantaneous_state(mesh: Mesh, displacement: FloatArray, table: MaterialTable) -> InstantaneousState:
    n = len(mesh.elements)
    state = InstantaneousState(
        np.empty((n, N_POINTS, 6)), np.empty((n, N_POINTS, 2)), np.empty(n), np.empty(n), np.empty(n)
    )
    formulas = has_formulas(table.law)
    run_kernel(
        _states, n, mesh.nodes_mm, mesh.elements, displacement, mesh.layer, table.law, formulas, *state
    )
    return state


def stored_energy_density(
    mesh: Mesh,
    displacement: FloatArray,
    table: MaterialTable,
    history: StressHistory,
    now: InstantaneousState,
) -> FloatArray:
    """Strain energy density that the springs hold now, mean over each element. [kPa]

    The long-term spring holds (1 - sum g_i) W0. Branch i, with stress tau_i out of g_i tau0, holds

        e_i = g_i W0 |tau_i|² / |g_i tau0|²,

    which is exact for a linear law and for an unrelaxed branch of any law (docs/decisions.md#stored-energy).
    The volumetric part does not relax.
    """
    stored = np.empty(len(mesh.elements))
    run_kernel(
        _stored_energy, stored.size, mesh.nodes_mm, mesh.elements, displacement, mesh.layer, table.law,
        table.shares, flat(history.instantaneous), flat(history.relaxed), now.energies, now.volumetric_kpa,
        stored,
    )  # fmt: skip
    return stored
