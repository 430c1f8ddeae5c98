"""Methods of fitting recordings: each a problem, a method, and the meaning of its parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray, one_of
from fingerpad.core.errors import InputError
from fingerpad.data import neuron
from fingerpad.experiments.fit.results import SpikeFitSummary
from fingerpad.inference.afferent_methods import (
    along_slopes,
    bounds_of,
    by_differences,
    fitted_six,
    four_number_problem,
    search_from,
)
from fingerpad.inference.closed_form import ClosedFormModel
from fingerpad.inference.fitting.cross_validation import CrossValidation, jackknife_covariance
from fingerpad.inference.fitting.methods import Bounds, Continued, Fit, Method
from fingerpad.inference.identifiable import SPIKE_PARAMETER_NAMES, identifiable
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import RateRecordings, SpikeRecordings
from fingerpad.inference.start_points import response_surface

Recordings = RateRecordings | SpikeRecordings
MethodOf = Callable[[AfferentModel, RateProblem, Bounds, int], Method]


@dataclass(frozen=True)
class Prepared:
    """A problem, the method that fits it, and the meaning of its parameters."""

    problem: RateProblem
    """What is fitted, in the parameters of the method."""
    method: Method
    """How."""
    six: Callable[[FloatArray], FloatArray]
    """From those parameters to the paper's six."""

    def covariance(self, fit: Fit, folds: CrossValidation) -> FloatArray | None:
        """Covariance (4, 4) of the identifiable numbers, from the fits of the folds; None for few folds."""
        return jackknife_covariance([identifiable(self.six(fold.fit.parameters)) for fold in folds.folds])

    def spikes(self, fit: Fit, folds: CrossValidation) -> SpikeFitSummary | None:
        """Summary of a fit to spikes; None for a fit to rates."""
        return None


def check_spikes(recordings: Recordings, n_motions: int) -> SpikeRecordings:
    """Return the recordings if the likelihood of their spikes is defined, else raise `InputError`."""
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


def _evolution(model: AfferentModel, problem: RateProblem, bounds: Bounds, seed: int) -> Method:
    """CMA-ES from where the slopes in closed form lead."""
    return Continued(
        along_slopes(ClosedFormModel(model), problem, bounds),
        lambda begun: search_from(begun, bounds, seed),
        name="CMA-ES",
    )


FOUR_NUMBER_METHODS: dict[str, MethodOf] = {
    "least_squares": lambda model, problem, bounds, seed: by_differences(bounds),
    "closed_form": lambda model, problem, bounds, seed: along_slopes(ClosedFormModel(model), problem, bounds),
    "cma_es": _evolution,
}
"""Methods that fit four numbers, by name."""

METHODS = ("least_squares", "response_surface", "closed_form", "cma_es", "likelihood")
"""Methods that fit recordings, by the names that the command line gives."""


def prepare(
    method: str, model: AfferentModel, recordings: Recordings, rates: RateRecordings, seed: int
) -> Prepared:
    """Prepare a method of fitting recordings."""
    one_of("method", method, METHODS)
    if method == "likelihood":
        # Only this method loads the module and its kernels.
        from fingerpad.experiments.fit.spike_method import prepare_spikes

        return prepare_spikes(model, recordings, rates, seed)
    if method == "response_surface":
        return Prepared(RateProblem(model, rates), response_surface(), lambda six: six)
    problem = four_number_problem(model, rates)
    fitting = FOUR_NUMBER_METHODS[method](model, problem, bounds_of(*model.drives), seed)
    return Prepared(problem, fitting, fitted_six)
