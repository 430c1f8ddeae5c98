"""Methods of fitting recordings: each a problem, a method, and the meaning of its parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pkgutil import resolve_name

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.data import neuron
from fingerpad.experiments.fit.results import SpikeFitSummary
from fingerpad.inference.afferent_methods import (
    Bounds,
    along_slopes,
    bounds_of,
    by_differences,
    four_number_problem,
    search_from,
)
from fingerpad.inference.closed_form import ClosedFormModel
from fingerpad.inference.fitting.covariance import jackknife_covariance
from fingerpad.inference.fitting.cross_validation import CrossValidation
from fingerpad.inference.fitting.methods import Continued, Fit, Method
from fingerpad.inference.identifiable import identifiable, six_parameters
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import RateRecordings, SpikeRecordings
from fingerpad.inference.spike_parameters import SPIKE_PARAMETER_NAMES
from fingerpad.inference.start_points import response_surface

MethodOf = Callable[[RateProblem, Bounds], Method]


@dataclass(frozen=True)
class Prepared:
    """A problem, the method that fits it, and the meaning of its parameters.

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
        From the fit to all and the folds to the summary of a fit to spikes; None for rates.
    """

    problem: RateProblem
    method: Method
    six: Callable[[FloatArray], FloatArray]
    covariance: Callable[[Fit, CrossValidation], FloatArray | None]
    spikes: Callable[[Fit, CrossValidation], SpikeFitSummary | None] = lambda fit, folds: None


def check_spikes(recordings: RateRecordings | SpikeRecordings, n_motions: int) -> SpikeRecordings:
    """Return the recordings if the likelihood of their spikes is defined, else raise `InputError`.

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
    model: AfferentModel, recordings: RateRecordings | SpikeRecordings, rates: RateRecordings, seed: int
) -> Prepared:
    """Prepare the paper's method in its six parameters."""
    return Prepared(
        RateProblem(model, rates),
        response_surface(),
        lambda six: six,
        _scatter_of(lambda six: six),
    )


def _scatter_of(
    six: Callable[[FloatArray], FloatArray],
) -> Callable[[Fit, CrossValidation], FloatArray | None]:
    """Return what finds the covariance of the four numbers in the fits of the folds."""
    return lambda fit, folds: jackknife_covariance(
        [identifiable(six(fold.fit.parameters)) for fold in folds.folds]
    )


def _four_numbers(model: AfferentModel, rates: RateRecordings, method_of: MethodOf) -> Prepared:
    """Prepare a method for the four identifiable parameters."""
    problem = four_number_problem(model, rates)
    return Prepared(
        problem,
        method_of(problem, bounds_of(*model.drives)),
        six_parameters,
        _scatter_of(six_parameters),
    )


def _least_squares(
    model: AfferentModel, recordings: RateRecordings | SpikeRecordings, rates: RateRecordings, seed: int
) -> Prepared:
    """Prepare least squares by differences, from starts all over the range."""
    return _four_numbers(model, rates, lambda problem, bounds: by_differences(bounds))


def _closed_form(
    model: AfferentModel, recordings: RateRecordings | SpikeRecordings, rates: RateRecordings, seed: int
) -> Prepared:
    """Prepare least squares along the slopes of the rate in closed form."""
    return _four_numbers(
        model, rates, lambda problem, bounds: along_slopes(ClosedFormModel(model), problem, bounds)
    )


def _evolution(
    model: AfferentModel, recordings: RateRecordings | SpikeRecordings, rates: RateRecordings, seed: int
) -> Prepared:
    """Prepare CMA-ES from where the slopes in closed form lead."""

    def method_of(problem: RateProblem, bounds: Bounds) -> Method:
        return Continued(
            along_slopes(ClosedFormModel(model), problem, bounds),
            lambda begun: search_from(begun, bounds, seed),
            name="CMA-ES",
        )

    return _four_numbers(model, rates, method_of)


def _likelihood(
    model: AfferentModel, recordings: RateRecordings | SpikeRecordings, rates: RateRecordings, seed: int
) -> Prepared:
    """Prepare maximum likelihood of spike trains, whose module and kernels only this method loads."""
    prepare = resolve_name("fingerpad.experiments.fit.spike_method:prepare")
    prepared: Prepared = prepare(model, recordings, rates, seed)
    return prepared


METHODS: dict[
    str, Callable[[AfferentModel, RateRecordings | SpikeRecordings, RateRecordings, int], Prepared]
] = {
    "least_squares": _least_squares,
    "response_surface": _response_surface,
    "closed_form": _closed_form,
    "cma_es": _evolution,
    "likelihood": _likelihood,
}
"""What fits recordings, by the names that the command line gives: from the model under the stimuli, what was
recorded, its rates, and a seed."""
