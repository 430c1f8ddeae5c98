"""Ways to fit recordings of one's own: each a problem, a method, and what its parameters mean."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import Presentations
from fingerpad.core.signals import SpikeTrains
from fingerpad.data import neuron
from fingerpad.experiments.gerling2014 import single_unit, spike_fit
from fingerpad.experiments.gerling2014.single_unit_methods import (
    FIRST_SPREAD,
    MOST_EVALUATIONS,
    Bounds,
    bounds_of,
    by_differences,
)
from fingerpad.inference.any_motion import AnyMotion, AnyMotionInClosedForm, Windows
from fingerpad.inference.fitting import CrossValidation, Fit, Method
from fingerpad.inference.fitting.covariance import jackknife_covariance
from fingerpad.inference.fitting.covariance_adaptation import CovarianceAdaptation
from fingerpad.inference.fitting.least_squares import LeastSquares
from fingerpad.inference.fitting.methods import Continued
from fingerpad.inference.fitting.problem import IntArray, Problem
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, identifiable, six_parameters
from fingerpad.inference.rate_problem import RateProblem, Reparametrised
from fingerpad.inference.recordings import RateRecordings, SpikeRecordings
from fingerpad.inference.spike_fit import fit_spikes
from fingerpad.inference.spike_likelihood import (
    SpikeLikelihood,
    time_rescaling,
)
from fingerpad.inference.spike_parameters import (
    SPIKE_PARAMETER_NAMES,
)
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.escape_rate import EscapeRate
from fingerpad.neuron.spikes import firing_rate_hz
from fingerpad.neuron.transduction import Drive

MethodOf = Callable[[RateProblem, Bounds], Method]

PREDICTED_PRESENTATIONS = 20
"""Presentations whose mean is the rate that an afferent with a soft threshold is said to have."""


@dataclass(frozen=True)
class Prepared:
    """A problem, the method that fits it, and what its parameters mean.

    Parameters
    ----------
    problem : RateProblem
        What is fitted, in the parameters of the method.
    method : Method
        How.
    six : callable
        From those parameters to the paper's six.
    covariance : callable
        From the fit to all and the folds to the covariance (4, 4) of the identifiable numbers, or None.
    spikes : callable
        From the fit to all and the folds to what only spikes tell; an empty dict for rates.
    """

    problem: RateProblem
    method: Method
    six: Callable[[FloatArray], FloatArray]
    covariance: Callable[[Fit, CrossValidation], FloatArray | None]
    spikes: Callable[[Fit, CrossValidation], dict[str, Any]] = lambda fit, folds: {}


def check_spikes(recordings: RateRecordings | SpikeRecordings, n_motions: int) -> SpikeRecordings:
    """Return the recordings if the likelihood of their spikes can be told, else raise `InputError`.

    Parameters
    ----------
    recordings : RateRecordings or SpikeRecordings
        What was recorded.
    n_motions : int
        How many different motions the stimuli have.
    """
    if isinstance(recordings, RateRecordings):
        raise InputError("likelihood needs spike times: got rates, choose another method.")
    if n_motions > 1:
        raise InputError(
            f"likelihood needs stimuli that move alike: got {n_motions} motions, choose another method."
        )
    if recordings.trains.times_ms.size < len(SPIKE_PARAMETER_NAMES):
        raise InputError(
            f"likelihood needs at least {len(SPIKE_PARAMETER_NAMES)} spikes, one per parameter: "
            f"got {recordings.trains.times_ms.size}."
        )
    for presentation, name in enumerate(recordings.stimuli):
        train = recordings.trains[presentation]
        if train.size and train[0] <= 0.0:
            raise InputError(f"likelihood needs spikes after the onset: {name} has one at {train[0]:g} ms.")
        closest = np.diff(train).min(initial=np.inf)
        if closest <= neuron.REFRACTORY.value:
            raise InputError(
                f"likelihood needs spikes more than {neuron.REFRACTORY.value:g} ms apart, the rest after a "
                f"spike: {name} has two that are {closest:.3g} ms apart; sort the unit again, or fit rates."
            )
    return recordings


def _response_surface(
    model: AnyMotion, recordings: RateRecordings | SpikeRecordings, rates: RateRecordings, seed: int
) -> Prepared:
    """Prepare the paper's method in its six parameters."""
    return Prepared(
        RateProblem(model, rates),
        single_unit.response_surface(),
        lambda six: six,
        _scatter_of(lambda six: six),
    )


def _scatter_of(six: Callable[[FloatArray], FloatArray]) -> Callable[[Fit, CrossValidation], Any]:
    """Return what finds the covariance of the four numbers in the fits of the folds."""
    return lambda fit, folds: jackknife_covariance(
        [identifiable(six(fold.fit.parameters)) for fold in folds.folds]
    )


def four_number_problem(model: AnyMotion, rates: RateRecordings) -> RateProblem:
    """Rates to be predicted from the four numbers that firing can tell."""
    return RateProblem(Reparametrised(model, IDENTIFIABLE_NAMES, six_parameters), rates)


def bounds_under(model: AnyMotion) -> Bounds:
    """Bounds of the four numbers under all stimuli, the same for all methods."""
    # They only ask how strong a drive becomes, whatever the motion.
    sed, rate = (
        np.array([[max(float(getattr(group, name).max()) for group in model.drives)]] * 2)
        for name in ("sed_kpa", "rate_kpa_per_ms")
    )
    return bounds_of(Drive(np.array([0.0, 1.0]), sed, rate))


def _four_numbers(model: AnyMotion, rates: RateRecordings, method_of: MethodOf) -> Prepared:
    """Prepare a method for the four numbers that firing can tell."""
    problem = four_number_problem(model, rates)
    return Prepared(
        problem,
        method_of(problem, bounds_under(model)),
        six_parameters,
        _scatter_of(six_parameters),
    )


def _least_squares(
    model: AnyMotion, recordings: RateRecordings | SpikeRecordings, rates: RateRecordings, seed: int
) -> Prepared:
    """Prepare least squares by differences, from starts all over the range."""
    return _four_numbers(model, rates, lambda problem, bounds: by_differences(bounds))


def _closed_form(
    model: AnyMotion, recordings: RateRecordings | SpikeRecordings, rates: RateRecordings, seed: int
) -> Prepared:
    """Prepare least squares along the slopes of the rate in closed form."""
    return _four_numbers(model, rates, lambda problem, bounds: along_slopes(model, problem, bounds))


def along_slopes(model: AnyMotion, problem: RateProblem, bounds: Bounds) -> LeastSquares:
    """Least squares in the four numbers, along the slopes of the rate in closed form."""
    slopes = problem.jacobian_of(AnyMotionInClosedForm(model))
    return replace(by_differences(bounds), jacobian=slopes, name="slopes in closed form")


def _evolution(
    model: AnyMotion, recordings: RateRecordings | SpikeRecordings, rates: RateRecordings, seed: int
) -> Prepared:
    """Prepare CMA-ES from where the slopes in closed form lead."""

    def method_of(problem: RateProblem, bounds: Bounds) -> Method:
        return Continued(
            along_slopes(model, problem, bounds),
            lambda begun: search_from(begun, bounds, seed),
            name="CMA-ES",
        )

    return _four_numbers(model, rates, method_of)


def search_from(begun: FloatArray, bounds: Bounds, seed: int) -> CovarianceAdaptation:
    """CMA-ES that begins where a quicker method ended."""
    return CovarianceAdaptation(
        begun,
        bounds.scales,
        bounds.low,
        bounds.high,
        first_spread=FIRST_SPREAD,
        most_evaluations=MOST_EVALUATIONS,
        seed=seed,
    )


@dataclass(frozen=True)
class SoftAfferent:
    """Mean rates of an afferent with a soft threshold; a `RateModel` in the five numbers that spikes tell.

    Parameters
    ----------
    drive : Drive
        One column per stimulus.
    windows_ms : ((float, float), (float, float))
        Windows of the dynamic and of the static rate. [ms]
    seed : int
        Of the simulated presentations, the same for all parameters.
    """

    drive: Drive
    windows_ms: Windows
    seed: int

    @property
    def names(self) -> tuple[str, ...]:
        """The four identifiable numbers and the width of the threshold."""
        return SPIKE_PARAMETER_NAMES

    @property
    def n_stimuli(self) -> int:
        """Number of columns of the drive."""
        return self.drive.n_sites

    def rates(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Dynamic and static rates, means of simulated presentations. [spikes/s]"""
        afferent = Afferent.from_parameters(six_parameters(parameters[:4]))
        soft = EscapeRate(afferent.membrane, float(parameters[4]))
        presentations = Presentations.of_one_afferent(self.n_stimuli, PREDICTED_PRESENTATIONS)
        trains = soft.spikes(afferent.transduction.current(self.drive), self.seed, presentations)
        dynamic, static = (
            np.bincount(presentations.sites, firing_rate_hz(trains, window)) / PREDICTED_PRESENTATIONS
            for window in self.windows_ms
        )
        return dynamic, static


@dataclass(frozen=True)
class MaximumLikelihood:
    """Fit the soft threshold under which the spikes of the chosen stimuli are most likely.

    Parameters
    ----------
    drive : Drive
        One column per stimulus.
    recordings : SpikeRecordings
        Spikes of all presentations.
    sites : int array (n_presentations,)
        Column of the drive that each presentation belongs to.
    """

    drive: Drive
    recordings: SpikeRecordings
    sites: IntArray
    name: str = "likelihood"

    def of(self, chosen: IntArray) -> SpikeLikelihood:
        """Likelihood of the spikes under the chosen stimuli."""
        rows = np.flatnonzero(np.isin(self.sites, chosen))
        trains = SpikeTrains.from_lists([self.recordings.trains[int(row)] for row in rows])
        return SpikeLikelihood(self.drive, trains, self.sites[rows], self.recordings.duration_ms[rows])

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Climb to the likeliest parameters; the problem only scores them."""
        clock = time.perf_counter()
        found = fit_spikes(self.of(chosen), spike_fit.start())
        seconds = time.perf_counter() - clock
        score = problem.score(found.parameters, chosen)
        return Fit(found.parameters, score, len(found.history), seconds, ())


def _likelihood(
    model: AnyMotion, recordings: RateRecordings | SpikeRecordings, rates: RateRecordings, seed: int
) -> Prepared:
    """Prepare maximum likelihood of spike trains under a soft threshold."""
    trains, (drive,) = check_spikes(recordings, len(model.drives)), model.drives
    sites = np.array([rates.stimuli.index(name) for name in trains.stimuli], dtype=np.int64)
    method = MaximumLikelihood(drive, trains, sites)
    everything = method.of(np.arange(drive.n_sites))

    def covariance(five: FloatArray) -> FloatArray:
        return np.linalg.inv(everything.derivatives(five)[2]).astype(np.float64)

    def told(fit: Fit, folds: CrossValidation) -> dict[str, Any]:
        left_out = [(method.of(fold.testing), fold.fit.parameters) for fold in folds.folds]
        test = time_rescaling(everything, fit.parameters)
        return {
            "n_spikes": everything.n_spikes,
            "log_likelihood": everything.log_likelihood(fit.parameters),
            "log_likelihood_out_of_sample": sum(part.log_likelihood(five) for part, five in left_out),
            "escape_width": fit.parameters[4],
            "escape_width_standard_error": np.sqrt(covariance(fit.parameters)[4, 4]),
            "time_rescaling_distance": test.statistic,
            "time_rescaling_p_value": test.p_value,
        }

    return Prepared(
        RateProblem(SoftAfferent(drive, model.windows_ms, seed), rates),
        method,
        lambda five: six_parameters(five[:4]),
        lambda fit, folds: covariance(fit.parameters)[:4, :4],
        told,
    )


METHODS: dict[str, Callable[[AnyMotion, RateRecordings | SpikeRecordings, RateRecordings, int], Prepared]] = {
    "least_squares": _least_squares,
    "response_surface": _response_surface,
    "closed_form": _closed_form,
    "cma_es": _evolution,
    "likelihood": _likelihood,
}
"""What fits recordings, by the names that the command line gives: from the model under the stimuli, what was
recorded, its rates, and a seed."""
