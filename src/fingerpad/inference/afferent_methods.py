"""Methods that fit one afferent to firing rates: bounds, scales, starts and parameters.

All but the paper's method (`response_surface`) fit four numbers, optionally
with the offset of the receptor along the finger, within the same bounds. The four are the identifiable ones
with the potential at rest over the threshold, beta tau/(C v), in the place of beta/(C v): its bound keeps the
afferent silent at rest (docs/decisions.md#silent-at-rest).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.core.signals import Traces
from fingerpad.core.values import FloatArray, finite, float_array, increasing
from fingerpad.data import neuron
from fingerpad.inference.fitting.covariance_adaptation import CovarianceAdaptation
from fingerpad.inference.fitting.least_squares import LeastSquares
from fingerpad.inference.fitting.methods import Bounds
from fingerpad.inference.fitting.response_surface import ResponseSurface, coding_increments
from fingerpad.inference.identifiable import (
    IDENTIFIABLE_NAMES,
    LARGEST_RESTING_SHARE,
    identifiable,
    silent_at_rest,
    six_parameters,
)
from fingerpad.inference.rate_model import (
    AfferentModel,
    RateModel,
    Rates,
    Reparametrised,
    SmoothRateModel,
    evaluate_rows,
)
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import RateRecordings
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.neuron.spikes import Windows
from fingerpad.neuron.transduction import Drive

OFFSET_NAME = "offset_mm"  # Name of the parameter; positive is distal. [mm]


@dataclass(frozen=True)
class ReceptorOffset:
    """The paper's model with the offset of the receptor as a seventh parameter; a `RateModel`.

    Between two sampled offsets the drive is interpolated linearly.
    """

    offsets_mm: FloatArray
    """Offsets at which the drive is sampled, distal positive, increasing, (n_offsets,). [mm]"""
    models: Sequence[AfferentModel]  # The model at each offset, all with the same stimuli and times.

    def __post_init__(self) -> None:
        offsets = increasing("offsets_mm", float_array("offsets_mm", self.offsets_mm, 1))
        kinds = {
            tuple(
                (columns.tobytes(), driven.times_ms.tobytes())
                for columns, driven in zip(model.stimuli, model.drives, strict=True)
            )
            for model in self.models
        }
        if offsets.size < 2 or offsets.size != len(self.models) or len(kinds) > 1:
            raise InputError(
                "ReceptorOffset needs at least two offsets, each with a model of the same stimuli and times: "
                f"got {offsets.size} offsets and {len(self.models)} models of {len(kinds)} kinds."
            )
        object.__setattr__(self, "offsets_mm", offsets)

    @classmethod
    def of_traces(
        cls, traces: Mapping[float, Traces | Sequence[Traces]], windows_ms: Windows | None = None
    ) -> ReceptorOffset:
        """Make the model from what drives the afferent at each offset."""
        return cls(
            np.array(list(traces), dtype=np.float64),
            [AfferentModel.of_traces(each, windows_ms) for each in traces.values()],
        )

    @property
    def names(self) -> tuple[str, ...]:
        return (*PARAMETER_NAMES, OFFSET_NAME)

    @property
    def n_stimuli(self) -> int:
        return self.models[0].n_stimuli

    def at(self, offset_mm: float) -> AfferentModel:
        offset = finite(OFFSET_NAME, offset_mm, "mm")
        if not self.offsets_mm[0] <= offset <= self.offsets_mm[-1]:
            raise InputError(
                f"{OFFSET_NAME} must lie within {self.offsets_mm[0]:g} ... {self.offsets_mm[-1]:g} mm, "
                f"where the skin was sampled: got {offset:g}."
            )
        before = min(int(np.searchsorted(self.offsets_mm, offset, "right")) - 1, len(self.models) - 2)
        share = (offset - self.offsets_mm[before]) / (self.offsets_mm[before + 1] - self.offsets_mm[before])
        near, far = self.models[before], self.models[before + 1]
        return replace(
            near, drives=tuple(_between(*pair, share) for pair in zip(near.drives, far.drives, strict=True))
        )

    def evaluate(self, parameters: FloatArray) -> Rates:
        return self.at(parameters[-1]).evaluate(parameters[:-1])

    def evaluate_batch(self, points: FloatArray) -> Rates:
        """Rates (n_points, n_stimuli) for rows of seven parameters, bit-equal to `evaluate`. [spikes/s]"""
        return evaluate_rows(self, points)


def _between(near: Drive, far: Drive, share: float) -> Drive:
    """Drive interpolated linearly: `near` for a share of 0, `far` for 1."""
    return replace(
        near,
        values=(1.0 - share) * near.values + share * far.values,
        rate_per_ms=(1.0 - share) * near.rate_per_ms + share * far.rate_per_ms,
    )


INCREMENT = 0.01
"""Coding increment over the start value; the paper's are "typically two orders of magnitude smaller"."""

LOWEST_SHARE = 0.05  # Lower bound of time constant, capacitance and threshold over their start.
START_WIDTH = 0.5  # Width of the threshold over the threshold at the start of fits to spikes. [1]


def printed_starts() -> FloatArray:
    """Both start points of the paper as printed, (2, 6), with energy density in kPa."""
    shared = (neuron.TIME_CONSTANT.value, neuron.CAPACITANCE.value, neuron.THRESHOLD.value)
    return np.array(
        [
            [neuron.INTERCEPT_START.value, dynamic.value, static.value, *shared]
            for dynamic, static in (
                (neuron.DYNAMIC_GAIN_START_1, neuron.STATIC_GAIN_START_1),
                (neuron.DYNAMIC_GAIN_START_2, neuron.STATIC_GAIN_START_2),
            )
        ]
    )


def start_points() -> FloatArray:
    """Both start points of the paper, (2, 6), with rescaled gains.

    One factor of k_d and one of k_s hold for both, see docs/decisions.md#dynamic-gain-rescaled.
    """
    scales = [1.0, neuron.DYNAMIC_GAIN_SCALE.value, neuron.STATIC_GAIN_SCALE.value, 1.0, 1.0, 1.0]
    return printed_starts() * scales


def spike_start() -> FloatArray:
    """Start of every fit to spikes: the paper's first start point with a soft threshold."""
    return np.array([*identifiable(start_points()[0]), START_WIDTH])


def increments(starts: FloatArray) -> FloatArray:
    """Coding increments of both start points (2, 6); that of the intercept is a share of the rheobase."""
    time_constant, capacitance, threshold = starts[0, 3:]
    rheobase = capacitance * threshold / time_constant
    where_zero = np.full(6, INCREMENT * rheobase)
    return np.array([coding_increments(start, INCREMENT, where_zero) for start in starts])


def response_surface(starts: FloatArray | None = None) -> ResponseSurface:
    """Return the paper's method, silent at rest, with gains and parameters of the membrane bounded below."""
    starts = start_points() if starts is None else starts
    bounds = np.array([-np.inf, 0.0, 0.0, *(LOWEST_SHARE * starts[0, 3:])])
    return ResponseSurface(starts, increments(starts), bounds, restrict=silent_at_rest)


OFFSETS_MM = (-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3)
"""Offsets from the receptor at which the drive is sampled. The paper's bar moves in steps of 0.2 mm. [mm]"""

FITTED_NAMES = ("resting_share", *IDENTIFIABLE_NAMES[1:])
"""The four numbers of a fit: beta tau/(C v) [1], k_d/(C v), k_s/(C v) and tau."""

LOWEST = (-1.5, 0.0, 0.0, 3.0)
HIGHEST = (LARGEST_RESTING_SHARE, 0.6, 0.2, 300.0)
SCALES = (0.3, 0.05, 0.02, 20.0)
"""Bounds and scales of a fit: the potential at rest over the threshold [1], the largest values of the dynamic
and the static term under all stimuli [1/ms], and tau [ms]. A drive of 0.2/ms elicits up to 200 spikes/s,
three times the largest static rate."""

OFFSET_SCALE_MM = 0.1

N_STARTS, N_REFINED = 32, 8
"""Starts that are scored, and starts from which least squares continues: two of them end up to 0.003 of FSS
below the best, since intercept and time constant of a membrane at rest trade off along a valley."""

MOST_EVALUATIONS = 600


def fitted_four(numbers: FloatArray) -> FloatArray:
    return np.array([numbers[0] / numbers[3], *numbers[1:]])


def fitted_six(numbers: FloatArray) -> FloatArray:
    return six_parameters(fitted_four(numbers))


def four_number_problem(model: RateModel, recordings: RateRecordings) -> RateProblem:
    """Make the problem of fitting recorded rates in the four numbers of `FITTED_NAMES`."""
    return RateProblem(Reparametrised(model, FITTED_NAMES, fitted_six), recordings)


def five_number_problem(model: RateModel, recordings: RateRecordings) -> RateProblem:
    """Make the problem of fitting recorded rates in the four numbers of `FITTED_NAMES` and the offset."""

    def seven(numbers: FloatArray) -> FloatArray:
        return np.append(fitted_six(numbers[:4]), numbers[4])

    return RateProblem(Reparametrised(model, (*FITTED_NAMES, OFFSET_NAME), seven), recordings)


def bounds_of(*drives: Drive) -> Bounds:
    """Bounds of the four numbers of a fit: those of `LOWEST`, `HIGHEST` and `SCALES`."""
    rate, value = (
        max(float(getattr(driven, name).max()) for driven in drives) for name in ("rate_per_ms", "values")
    )
    strongest = np.array([1.0, rate, value, 1.0])
    return Bounds(*(np.array(terms) / strongest for terms in (SCALES, LOWEST, HIGHEST)))


def and_offset(bounds: Bounds, low_mm: float = OFFSETS_MM[0], high_mm: float = OFFSETS_MM[-1]) -> Bounds:
    return bounds.and_one(OFFSET_SCALE_MM, low_mm, high_mm)


def by_differences(bounds: Bounds) -> LeastSquares:
    return LeastSquares(bounds.spread(N_STARTS), bounds, n_refined=N_REFINED)


def along_slopes(smooth: SmoothRateModel, problem: RateProblem, bounds: Bounds) -> LeastSquares:
    """Make the method of least squares with the derivatives of a smooth model."""

    def slopes(numbers: FloatArray) -> Rates:
        # By the chain rule: beta/(C v) is the first number over the last, tau.
        share, _, _, tau = numbers
        four_by_numbers = np.diag([1.0 / tau, 1.0, 1.0, 1.0])
        four_by_numbers[0, 3] = -share / tau**2
        dynamic, static = smooth.slopes(fitted_four(numbers))
        return dynamic @ four_by_numbers, static @ four_by_numbers

    jacobian = problem.jacobian_of(slopes)
    return replace(by_differences(bounds), jacobian=jacobian, name="slopes in closed form")


def search_from(begun: FloatArray, bounds: Bounds, seed: int = 0) -> CovarianceAdaptation:
    """Make CMA-ES from the result of a faster method."""
    return CovarianceAdaptation(begun, bounds, most_evaluations=MOST_EVALUATIONS, seed=seed)
