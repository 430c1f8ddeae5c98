"""Fit with the receptor's offset from the middle of its receptive field as a further parameter.

The middle of the field is read from the recordings. The offset shows how much of the residual an error of
that reading explains.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fingerpad.core.checks import FloatArray, IntArray, one_of
from fingerpad.core.errors import InputError
from fingerpad.core.signals import Traces
from fingerpad.experiments.fit.methods import FOUR_NUMBER_METHODS, prepare
from fingerpad.experiments.fit.results import HeldOffset, OffsetFit
from fingerpad.inference.afferent_methods import (
    and_offset,
    bounds_of,
    fitted_four,
    five_number_problem,
    four_number_problem,
    search_from,
)
from fingerpad.inference.fitting.covariance import jackknife_covariance
from fingerpad.inference.fitting.cross_validation import cross_validate
from fingerpad.inference.fitting.least_squares import LeastSquares
from fingerpad.inference.fitting.methods import Continued, Method
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES
from fingerpad.inference.receptor_offset import ReceptorOffset
from fingerpad.inference.recordings import RateRecordings
from fingerpad.neuron.rate_windows import Windows

Beside = Mapping[float, Traces | Sequence[Traces]]
"""Strain energy density by offset from the believed place, distal positive [mm], one column per stimulus."""


def check_offset(method: str, places_mm: Sequence[float]) -> None:
    """Raise `InputError` if a receptor's offset cannot be determined."""
    if method not in OFFSET_METHODS:
        raise InputError(f"offset needs a method that fits it, {' or '.join(OFFSET_METHODS)}: got {method}.")
    if len(set(places_mm)) < 2:
        raise InputError(
            "offset needs stimuli at several places along the finger, as those of the shifted bar are: all "
            f"are at {places_mm[0]:g} mm, leave it out."
        )


def check_beside(beside: Beside) -> FloatArray:
    """Return the places in order (n_places,) [mm], or raise `InputError` if they miss a side."""
    beside_mm = np.array(sorted(beside), dtype=np.float64)
    if not (beside_mm.size and beside_mm[0] < 0.0 < beside_mm[-1]):
        raise InputError(
            "beside needs energy density on both sides of the receptor, at offsets below and above 0 mm: "
            f"got {', '.join(f'{offset:g}' for offset in beside_mm) or 'none'}."
        )
    return beside_mm


def fit_offset(
    beside: Beside,
    rates: RateRecordings,
    memberships: IntArray,
    method: str,
    windows_ms: Windows | None,
    seed: int = 0,
) -> OffsetFit:
    """Fit the four numbers and the receptor's offset together, on the same folds."""
    beside_mm = check_beside(beside)
    roving = ReceptorOffset.of_traces({offset: beside[offset] for offset in beside_mm}, windows_ms)
    problem, everything = five_number_problem(roving, rates), np.arange(roving.n_stimuli)
    searching = _continued(roving, rates, one_of("method", method, tuple(OFFSET_METHODS)), seed)
    best = searching.fit(problem, everything)
    crossed = cross_validate(problem, searching, memberships)
    four, offset_mm = fitted_four(best.parameters[:4]).tolist(), float(best.parameters[-1])
    folds_mm = [float(fold.fit.parameters[-1]) for fold in crossed.folds]
    error = jackknife_covariance(np.reshape(folds_mm, (-1, 1)))
    held = [prepare(method, place, rates, rates, seed) for place in roving.models]
    return OffsetFit(
        offset_mm=offset_mm,
        standard_error_mm=np.nan if error is None else np.sqrt(error[0, 0]),
        folds_mm=np.array(folds_mm),
        identifiable=dict(zip(IDENTIFIABLE_NAMES, four, strict=True)),
        fss_in_sample=best.score,
        fss_out_of_sample=crossed.score_test,
        fss_by_phase=problem.score_by_phase(best.parameters, everything),
        n_evaluations=best.n_evaluations,
        seconds=best.seconds,
        held=HeldOffset(
            offset_mm=beside_mm,
            fss_in_sample=np.array([one.method.fit(one.problem, everything).score for one in held]),
        ),
    )


def _continued(roving: ReceptorOffset, rates: RateRecordings, method: str, seed: int) -> Continued:
    """Fit a receptor in its place, then let it move from the best fit, which it can only improve."""
    centre = roving.at(0.0)
    problem, of_four = four_number_problem(centre, rates), bounds_of(*centre.drives)
    low_mm, *inner_mm, high_mm = roving.offsets_mm.tolist()
    bounds = and_offset(of_four, low_mm, high_mm)

    def moving(begun: FloatArray) -> Method:
        if method == "cma_es":
            return search_from(np.append(begun, 0.0), bounds, seed)
        within = np.clip(begun, of_four.low, of_four.high)  # round-off at a bound
        starts = [np.append(within, offset) for offset in sorted({0.0, *inner_mm})]
        return LeastSquares(starts, bounds, n_refined=2)

    in_place = FOUR_NUMBER_METHODS[OFFSET_METHODS[method]](centre, problem, of_four, seed)
    return Continued(in_place, moving, problem)


OFFSET_METHODS = {"least_squares": "least_squares", "cma_es": "closed_form"}
"""Methods that an offset can be added to, each with the method that first fits a receptor in its place."""
