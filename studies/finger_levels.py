"""From what a press gives to what is observed: deflection, force, rates under the bar, hit rates of spheres.

The outputs of presses are the same whether they were pressed or emulated. Stress is stored relative to its
largest value under the bar, so that a gain times that value is the current that the bar causes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.core.units import MN_PER_N
from fingerpad.core.values import FloatArray
from fingerpad.data import cylinder_deflection, neuron, protocol
from fingerpad.experiments.conditions import POSITIONS_MM, Conditions
from fingerpad.experiments.gerling2014.nerve import PIECES
from fingerpad.experiments.gerling2014.percept import draws_of
from fingerpad.experiments.gerling2014.skin import PLATE_DEPTHS_MM
from fingerpad.geometry.bodies import Cylinder
from fingerpad.inference.afferent_fit import CHANCE
from fingerpad.neuron.exact_spikes import exact_trains
from fingerpad.neuron.spikes import PAPER_WINDOWS_MS, window_rates_hz
from fingerpad.neuron.transduction import Drive, drive
from fingerpad.psychophysics.observer import expected_euclidean_hit_rates, expected_hit_rates
from fingerpad.skin.sampling import SkinResponse
from studies.tissue_candidates import Candidate
from studies.tissue_design import REFERENCE_KPA
from studies.tissue_search import SPHERES_PER_M, Key, Receptors, bar_traces, driven

N_DRAWS = 500
"""Presentations behind an expected hit rate; the sampling error of the noise is three per cent."""

SEED = 0
"""Of these presentations, the same for every point."""

RAMP_MS = float(protocol.RAMP.value)
"""Time by which rates of change are multiplied, so that both parts of an output have one size. [ms]"""

Outputs = Mapping[str, FloatArray]
"""By name, (n_points, ...) each: "deflection" [mm], "log_force" and "log_stress" (logarithms of N and kPa
with the subcutis of `REFERENCE_KPA`), "bars", "standard" and "comparisons"."""


class Sites(Receptors):
    """Receptors of the population on one side of the midline, and how they stand for all of them."""

    @cached_property
    def draws(self) -> FloatArray:
        """Presentations, (N_DRAWS, n_receptors)."""
        return draws_of(self.population, SEED, N_DRAWS)

    @cached_property
    def _both(self) -> tuple[FloatArray, np.ndarray]:
        x, z = self.population.positions_mm.T
        positions = np.column_stack([x, np.abs(z)])
        found, number = np.unique(positions.round(9), axis=0, return_inverse=True)
        return found, number.ravel()

    @property
    def half_mm(self) -> FloatArray:
        """Places with z of at least 0, (n_half, 2). [mm]"""
        return self._both[0]

    @property
    def mirrored(self) -> np.ndarray:
        """Number of the place among `half_mm` that has the stress of each receptor, (n_receptors,)."""
        return self._both[1]


SITES = Sites()


def outputs_of(
    responses: Mapping[Key, SkinResponse], candidate: Candidate, conditions: Conditions
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Read from one candidate's presses the times of the drives (n_times,) [ms], and one point of `Outputs`.

    The responses are those of `studies.tissue_search.touches`, the bar pressed once.
    """
    profile = responses["cylinder", Cylinder().diameter_mm, 0.0].surface_profile()
    force_n = [responses["plate", depth, 0.0].force_mn[-1] / MN_PER_N for depth in PLATE_DEPTHS_MM]
    (bars,) = bar_traces(responses, candidate, conditions)
    bar = drive(bars, pieces=PIECES)
    largest = float(bar.values.max())
    spheres = [
        [
            drive(driven(responses["sphere", curvature, at], candidate, SITES.half_mm), pieces=PIECES)
            for at in POSITIONS_MM
        ]
        for curvature in SPHERES_PER_M
    ]
    if any(not np.array_equal(one.times_ms, bar.times_ms) for row in spheres for one in row):
        raise InputError("responses must have the same times under bar and spheres: they differ.")
    relative = np.array([[_relative(one, largest) for one in row] for row in spheres])
    factor = candidate.tissues.subcutis.shear_modulus_kpa / REFERENCE_KPA
    return bar.times_ms, {
        "deflection": profile.at(-deflection_distances_mm()),
        "log_force": np.log(np.array(force_n) / factor),
        "log_stress": np.log([largest / factor]),
        "bars": _relative(bar, largest),
        "standard": relative[0],
        "comparisons": relative[1:] - relative[0],
    }


def _relative(driven_by: Drive, largest: float) -> FloatArray:
    """Stress and its rate of change over the ramp's time, (2, n_times, n_sites), over the largest stress."""
    return np.array([driven_by.values, RAMP_MS * driven_by.rate_per_ms]) / largest


def deflection_distances_mm() -> FloatArray:
    """Distances of the observed deflection that are compared, proximal positive. [mm]"""
    observed = cylinder_deflection()
    return observed.distance_mm[~observed.is_artefact]


@dataclass(frozen=True)
class Afferents:
    """One afferent per point, in units in which C v is 1 and the largest stress under the bar is 1."""

    resting_share: FloatArray  #: Potential at rest over the threshold, beta tau/(C v), (n_points,). [1]
    dynamic_gain: FloatArray
    static_gain: FloatArray  #: k_d/(C v) [1] and k_s/(C v) [1/ms], times the largest stress, (n_points,).
    time_constant_ms: FloatArray  #: tau, (n_points,). [ms]

    def rates(self, number: int, times_ms: FloatArray, relative: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Dynamic and static rates (n_sites,) of one point, from (2, n_times, n_sites). [spikes/s]"""
        tau = float(self.time_constant_ms[number])
        current = (
            self.resting_share[number] / tau
            + self.static_gain[number] * relative[0]
            + self.dynamic_gain[number] / RAMP_MS * relative[1]
        )
        trains = exact_trains(times_ms, current, (tau, 1.0, 1.0, neuron.REFRACTORY.value, np.nan))
        dynamic, static = (window_rates_hz(*trains, *window) for window in PAPER_WINDOWS_MS)
        return dynamic, static


def bar_rates(afferents: Afferents, times_ms: FloatArray, outputs: Outputs) -> FloatArray:
    """Dynamic and static rates under the bar, (2, n_points, n_shifts). [spikes/s]"""
    found = [afferents.rates(row, times_ms, bars) for row, bars in enumerate(outputs["bars"])]
    return np.moveaxis(np.array(found), 1, 0)


def sphere_rates(afferents: Afferents, times_ms: FloatArray, outputs: Outputs) -> FloatArray:
    """Return static rates of the population, (n_points, n_positions, n_spheres, n_receptors). [spikes/s]"""
    standard = outputs["standard"][:, np.newaxis]
    relative = np.concatenate([standard, standard + outputs["comparisons"]], axis=1)
    n_points, n_spheres, n_positions, _, n_times, n_half = relative.shape
    # One simulation per point: all sites in a row.
    columns = np.moveaxis(relative, (3, 4), (1, 2)).reshape(n_points, 2, n_times, -1)
    static = np.array([afferents.rates(row, times_ms, one)[1] for row, one in enumerate(columns)])
    by_sphere = static.reshape(n_points, n_spheres, n_positions, n_half)[..., SITES.mirrored]
    return np.swapaxes(by_sphere, 1, 2)


def gradient_hit_rates(static_hz: FloatArray, noise_sigma: FloatArray) -> FloatArray:
    """Compute expected hit rates of the Gradient Sum, (n_points, n_positions, n_spheres - 1).

    Static rates are (n_points, n_positions, n_spheres, n_receptors), the standard first [spikes/s]; the noise
    is (n_points,).
    """
    return _hit_rates(
        static_hz,
        noise_sigma,
        lambda table, sigma: expected_hit_rates(table, SITES.neighbours, sigma, SITES.draws),
    )


def euclidean_hit_rates(static_hz: FloatArray, noise_sigma: FloatArray) -> FloatArray:
    """Compute expected hit rates of the Euclidean Distance; as `gradient_hit_rates`."""
    return _hit_rates(static_hz, noise_sigma, expected_euclidean_hit_rates)


def _hit_rates(static_hz: FloatArray, noise_sigma: FloatArray, code) -> FloatArray:  # type: ignore[no-untyped-def]
    found = np.full((*static_hz.shape[:2], static_hz.shape[2] - 1), CHANCE)
    for row, (tables, sigma) in enumerate(zip(static_hz, noise_sigma.tolist(), strict=True)):
        for position, table in enumerate(tables):
            # An observer of silent receptors guesses.
            if table.any():
                found[row, position] = code(table, sigma)
    return found


def plate_force_n(outputs: Outputs, subcutis_kpa: FloatArray) -> FloatArray:
    """Force of the plate at `PLATE_DEPTHS_MM` for each point's modulus, (n_points, n_depths). [N]"""
    return np.exp(outputs["log_force"]) * (subcutis_kpa / REFERENCE_KPA)[:, np.newaxis]


def largest_stress_kpa(outputs: Outputs, subcutis_kpa: FloatArray) -> FloatArray:
    """Largest stress under the bar for each point's modulus, (n_points,). [kPa]"""
    return np.exp(outputs["log_stress"][:, 0]) * subcutis_kpa / REFERENCE_KPA
