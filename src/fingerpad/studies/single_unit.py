"""Level 2: one afferent under a shifted bar, fitted and cross-validated (paper, 2.2.2, 3.2 and Figure 5)."""

from __future__ import annotations

from typing import Any

import numpy as np

from fingerpad.afferent import PARAMETER_NAMES, Afferent
from fingerpad.checks import FloatArray
from fingerpad.fitting import (
    CrossValidation,
    ResponseSurfaceFit,
    coding_increments,
    cross_validate,
    fractional_sum_of_squares,
    interleaved_folds,
    maximise,
    weighted_fractional_sum_of_squares,
)
from fingerpad.indenters import Bar
from fingerpad.parameters import neuron, protocol
from fingerpad.reference import bar_firing_rates
from fingerpad.sampling import SkinResponse
from fingerpad.signals import SedTraces
from fingerpad.spikes import modulation_difference, modulation_index
from fingerpad.studies.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.transduction import Drive, drive

INCREMENT = 0.01
"""Coding increment over the start value; the paper's are "typically two orders of magnitude smaller"."""

UNITS = ("mA", "mA ms/kPa", "mA/kPa", "ms", "mF", "mV")
LOWEST_SHARE = 0.05
"""Time constant, capacitance and threshold stay above this share of their start, to stay physical."""


def touches(conditions: Conditions) -> list[Touch]:
    """36 touches of the bar, shifted along the finger.

    Its flat face stays parallel to the skin at the receptor (docs/decisions/bar-orientation.md). A positive
    shift moves the bar towards the proximal end (docs/decisions/bar-shift.md).
    """
    tilt = conditions.skin_tilt_deg
    grading = conditions.bar_grading()
    return [
        conditions.touch(
            Bar(), RECEPTOR_X_MM - shift * float(np.cos(np.deg2rad(tilt))), grading, tilt_deg=tilt
        )
        for shift in protocol.BAR_SHIFTS.value
    ]


def receptor_sed(responses: list[SkinResponse]) -> SedTraces:
    """Strain energy density at the one receptor, one column per shift of the bar."""
    traces = [skin.sed([[RECEPTOR_X_MM, 0.0]]) for skin in responses]
    return SedTraces(traces[0].times_ms, np.hstack([trace.sed_kpa for trace in traces]), traces[0].kinks_ms)


def start_points() -> FloatArray:
    """Both start points of the paper, (2, 6), the printed dynamic gains rescaled.

    See docs/decisions for why the printed k_d is multiplied by one factor in both.
    """
    scale = neuron.DYNAMIC_GAIN_SCALE.value
    shared = (neuron.TIME_CONSTANT.value, neuron.CAPACITANCE.value, neuron.THRESHOLD.value)
    return np.array(
        [
            [neuron.INTERCEPT_START.value, scale * dynamic.value, static.value, *shared]
            for dynamic, static in (
                (neuron.DYNAMIC_GAIN_START_1, neuron.STATIC_GAIN_START_1),
                (neuron.DYNAMIC_GAIN_START_2, neuron.STATIC_GAIN_START_2),
            )
        ]
    )


def increments(starts: FloatArray) -> FloatArray:
    """Coding increments of both start points (2, 6); that of the intercept is a share of the rheobase."""
    time_constant, capacitance, threshold = starts[0, 3:]
    rheobase = capacitance * threshold / time_constant
    where_zero = np.full(6, INCREMENT * rheobase)
    return np.array([coding_increments(start, INCREMENT, where_zero) for start in starts])


class Recordings:
    """Observed rates at all shifts and the drive that the model answers; scores parameters against them."""

    def __init__(self, sed: SedTraces):
        observed = bar_firing_rates()
        self.drive: Drive = drive(sed)
        self.shift_mm = observed.shift_mm
        self.dynamic, self.static = observed.dynamic_rate_hz, observed.static_rate_hz

    def predict(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Dynamic and static rates at all shifts. [spikes/s]"""
        return Afferent.from_parameters(parameters).rates(self.drive)

    def score(self, parameters: FloatArray, chosen: np.ndarray) -> float:
        """Weighted FSS of Eqs. 12-14 over some shifts."""
        dynamic, static = self.predict(parameters)
        return weighted_fractional_sum_of_squares(
            self.dynamic[chosen], dynamic[chosen], self.static[chosen], static[chosen]
        )


def fit(recordings: Recordings) -> tuple[ResponseSurfaceFit, CrossValidation]:
    """Best fit to all shifts from both start points, and the six folds."""
    starts = start_points()
    steps = increments(starts)
    bounds = np.array([-np.inf, 0.0, 0.0, *(LOWEST_SHARE * starts[0, 3:])])
    everything = np.arange(recordings.shift_mm.size)
    climbs = [
        maximise(lambda parameters: recordings.score(parameters, everything), start, step, bounds)
        for start, step in zip(starts, steps, strict=True)
    ]
    folds = cross_validate(recordings.score, starts, steps, interleaved_folds(everything.size), bounds)
    return max(climbs, key=lambda climb: climb.objective), folds


def result(recordings: Recordings, best: ResponseSurfaceFit, folds: CrossValidation) -> dict[str, Any]:
    """Rates, fits and modulation, ready for the report."""
    dynamic, static = recordings.predict(best.parameters)
    return {
        "fss_in_sample": best.objective,
        "fss_in_sample_dynamic": fractional_sum_of_squares(recordings.dynamic, dynamic),
        "fss_in_sample_static": fractional_sum_of_squares(recordings.static, static),
        "fss_out_of_sample": folds.fss_test,
        "fss_training_mean": folds.fss_train,
        "parameters": _named(best.parameters),
        "units": dict(zip(PARAMETER_NAMES, UNITS, strict=True)),
        "shift_mm": recordings.shift_mm,
        "dynamic_rate_hz": dynamic,
        "static_rate_hz": static,
        "observed_dynamic_rate_hz": recordings.dynamic,
        "observed_static_rate_hz": recordings.static,
        "start_points": [_named(start) for start in start_points()],
        "folds": [
            {
                "fold": fold.fold + 1,
                "start": fold.start + 1,
                "testing_shift_mm": recordings.shift_mm[fold.testing],
                "fss_start": [climb.history[0].objective for climb in fold.fits],
                "fss_train": fold.fss_train,
                "fss_test": fold.fss_test,
                "parameters": _named(fold.parameters),
                "history": [
                    {"iteration": number, "fss": row.objective, "parameters": _named(row.parameters)}
                    for number, row in enumerate(fold.history)
                ],
            }
            for fold in folds.folds
        ],
        "modulation": {
            "dynamic": {
                "observed": _modulation(recordings.shift_mm, recordings.dynamic),
                "ours": _modulation(recordings.shift_mm, dynamic),
            },
            "static": {
                "observed": _modulation(recordings.shift_mm, recordings.static),
                "ours": _modulation(recordings.shift_mm, static),
            },
        },
    }


def _named(parameters: FloatArray) -> dict[str, float]:
    return {name: float(value) for name, value in zip(PARAMETER_NAMES, parameters, strict=True)}


def _modulation(shift_mm: FloatArray, rate_hz: FloatArray) -> dict[str, float | None]:
    """Largest rate against the smallest with the bar's flat face over the receptor (Eq. 11)."""
    under_flat = np.abs(shift_mm) < protocol.BAR_WIDTH.value / 2 - protocol.BAR_FILLET.value
    largest, smallest = float(rate_hz.max()), float(rate_hz[under_flat].min())
    return {
        "maximum_hz": largest,
        "minimum_hz": smallest,
        "difference_hz": float(modulation_difference(largest, smallest)),
        "index": float(modulation_index(largest, smallest)) if largest > 0.0 else None,
    }
