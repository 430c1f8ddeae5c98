"""Fit with the receptor's offset from the middle of its receptive field as a further parameter.

The middle of the field is read from the recordings. The offset shows how much of the residual an error of
that reading explains.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fingerpad.core.checks import FloatArray, IntArray, one_of
from fingerpad.core.errors import InputError
from fingerpad.core.signals import SedTraces
from fingerpad.experiments.fit.methods import METHODS
from fingerpad.experiments.fit.results import HeldOffset, OffsetFit
from fingerpad.inference.afferent_methods import (
    Bounds,
    along_slopes,
    bounds_of,
    by_differences,
    five_number_problem,
    four_number_problem,
    search_from,
)
from fingerpad.inference.closed_form import ClosedFormModel
from fingerpad.inference.fitting.covariance import jackknife_covariance
from fingerpad.inference.fitting.cross_validation import cross_validate
from fingerpad.inference.fitting.least_squares import LeastSquares
from fingerpad.inference.fitting.methods import Continued, Method
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES
from fingerpad.inference.rate_model import Windows
from fingerpad.inference.receptor_offset import ReceptorOffset
from fingerpad.inference.recordings import RateRecordings

Beside = Mapping[float, SedTraces | Sequence[SedTraces]]
"""Strain energy density by offset from the believed place, distal positive [mm], one column per stimulus."""


def check_offset(method: str, places_mm: Sequence[float]) -> None:
    """Raise `InputError` if a receptor's offset cannot be determined.

    Parameters
    ----------
    method : str
        How the recordings are fitted.
    places_mm : sequence of float
        Where along the finger each stimulus was. [mm]
    """
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
    windows_ms: Windows,
    seed: int = 0,
) -> OffsetFit:
    """Fit the four numbers and the receptor's offset together, on the same folds.

    Parameters
    ----------
    beside : mapping of float to SedTraces or to a sequence of SedTraces
        Strain energy density at a receptor in each place, two places or more on both sides of 0. [mm]
    rates : RateRecordings
        What was observed.
    memberships : int array (n_stimuli,)
        Fold of each stimulus.
    method : str
        One of `OFFSET_METHODS`.
    windows_ms : ((float, float), (float, float))
        Windows of the dynamic and of the static rate. [ms]
    seed : int, optional
        Of methods that draw.

    Returns
    -------
    OffsetFit

    Raises
    ------
    InputError
        If the places do not lie on both sides of 0, or disagree in their stimuli.
    """
    beside_mm = check_beside(beside)
    roving = ReceptorOffset.of_traces({offset: beside[offset] for offset in beside_mm}, windows_ms)
    problem, everything = five_number_problem(roving, rates), np.arange(roving.n_stimuli)
    searching = OFFSET_METHODS[one_of("method", method, tuple(OFFSET_METHODS))](roving, rates, seed)
    best = searching.fit(problem, everything)
    crossed = cross_validate(problem, searching, memberships)
    *four, offset_mm = best.parameters.tolist()
    folds_mm = [float(fold.fit.parameters[-1]) for fold in crossed.folds]
    error = jackknife_covariance(np.reshape(folds_mm, (-1, 1)))
    held = [METHODS[method](place, rates, rates, seed) for place in roving.models]
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


def _least_squares(roving: ReceptorOffset, rates: RateRecordings, seed: int) -> Method:
    """Least squares from the best fit of a receptor in its place, which it can only gain on."""
    bounds = _bounds(roving)
    begin_mm = sorted({0.0, *roving.offsets_mm[1:-1].tolist()})

    def beside(begun: FloatArray) -> Method:
        starts = [np.append(begun, offset) for offset in begin_mm]
        return LeastSquares(starts, bounds.scales, bounds.low, bounds.high, n_refined=2)

    return _continued(roving, rates, by_differences, beside)


def _evolution(roving: ReceptorOffset, rates: RateRecordings, seed: int) -> Method:
    """CMA-ES from where the slopes in closed form lead with the receptor in its place."""
    bounds, centre = _bounds(roving), roving.at(0.0)

    def quick(of_four: Bounds) -> Method:
        return along_slopes(ClosedFormModel(centre), four_number_problem(centre, rates), of_four)

    return _continued(roving, rates, quick, lambda begun: search_from(np.append(begun, 0.0), bounds, seed))


def _continued(
    roving: ReceptorOffset,
    rates: RateRecordings,
    first: Callable[[Bounds], Method],
    second: Callable[[FloatArray], Method],
) -> Continued:
    """Fit a receptor in its place, then let it move."""
    centre = roving.at(0.0)
    return Continued(first(bounds_of(*centre.drives)), second, four_number_problem(centre, rates))


def _bounds(roving: ReceptorOffset) -> Bounds:
    low_mm, *_, high_mm = roving.offsets_mm.tolist()
    return bounds_of(*roving.at(0.0).drives).and_offset(low_mm, high_mm)


OFFSET_METHODS: dict[str, Callable[[ReceptorOffset, RateRecordings, int], Method]] = {
    "least_squares": _least_squares,
    "cma_es": _evolution,
}
"""Methods of `fingerpad.experiments.fit.methods.METHODS` that an offset can be added to."""
