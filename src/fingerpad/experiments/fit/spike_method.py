"""Maximum likelihood of spike trains, the method "likelihood" of a fit to recordings."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from fingerpad.core.errors import ConvergenceError
from fingerpad.core.signals import SpikeTrains
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.experiments.fit.methods import Prepared, Recordings, check_spikes
from fingerpad.experiments.fit.results import SpikeFitSummary
from fingerpad.inference.afferent_fit import spike_start
from fingerpad.inference.fitting.methods import CrossValidation, Fit, Problem
from fingerpad.inference.identifiable import six_parameters
from fingerpad.inference.rate_model import AfferentModel, RateProblem
from fingerpad.inference.recordings import RateRecordings, SpikeRecordings
from fingerpad.inference.spike_likelihood import SoftAfferent, SpikeLikelihood, fit_spikes, time_rescaling
from fingerpad.neuron.transduction import Drive


@dataclass(frozen=True)
class MaximumLikelihood:
    """Fit the soft threshold under which the spikes of the chosen stimuli are most likely."""

    drive: Drive  # One column per stimulus.
    recordings: SpikeRecordings  # Spikes of all presentations.
    sites: IntArray  # Column of the drive that each presentation belongs to, (n_presentations,).
    name: str = "likelihood"

    def of(self, chosen: IntArray) -> SpikeLikelihood:
        rows = np.flatnonzero(np.isin(self.sites, chosen))
        trains = SpikeTrains.from_lists([self.recordings.trains[int(row)] for row in rows])
        return SpikeLikelihood(self.drive, trains, self.sites[rows], self.recordings.duration_ms[rows])

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Climb to the likeliest parameters; the problem only scores them."""
        clock = time.perf_counter()
        try:
            found = fit_spikes(self.of(chosen), spike_start())
        except ConvergenceError as error:
            raise ConvergenceError(
                f"likelihood is not determined by the spikes of {len(chosen)} stimuli "
                f"({str(error).partition(':')[0]}): record each stimulus more than once, or choose another "
                "method, such as least_squares.",
                error.history,
            ) from error
        seconds = time.perf_counter() - clock
        score = problem.score(found.parameters, chosen)
        return Fit(found.parameters, score, len(found.history), seconds, ())


@dataclass(frozen=True)
class PreparedSpikes(Prepared):
    """The likelihood of spikes, the method that maximises it, and the meaning of its parameters."""

    method: MaximumLikelihood
    everything: SpikeLikelihood  # Likelihood of all spikes.

    def covariance(self, fit: Fit, folds: CrossValidation) -> FloatArray:
        """Covariance (4, 4) of the identifiable numbers: part of the inverse of the Fisher information."""
        return self._covariance(fit)[:4, :4]

    def spikes(self, fit: Fit, folds: CrossValidation) -> SpikeFitSummary:
        left_out = [(self.method.of(fold.testing), fold.fit.parameters) for fold in folds.folds]
        test = time_rescaling(self.everything, fit.parameters)
        return SpikeFitSummary(
            n_spikes=self.everything.n_spikes,
            log_likelihood=self.everything.log_likelihood(fit.parameters),
            log_likelihood_out_of_sample=sum(part.log_likelihood(five) for part, five in left_out),
            escape_width=fit.parameters[4],
            escape_width_standard_error=np.sqrt(self._covariance(fit)[4, 4]),
            time_rescaling_distance=test.statistic,
            time_rescaling_p_value=test.p_value,
        )

    def _covariance(self, fit: Fit) -> FloatArray:
        return np.linalg.inv(self.everything.derivatives(fit.parameters)[2]).astype(np.float64)


def prepare_spikes(
    model: AfferentModel, recordings: Recordings, rates: RateRecordings, seed: int
) -> PreparedSpikes:
    trains, (drive,) = check_spikes(recordings, len(model.drives)), model.drives
    sites = np.array([rates.stimuli.index(name) for name in trains.stimuli], dtype=np.int64)
    method = MaximumLikelihood(drive, trains, sites)
    return PreparedSpikes(
        RateProblem(SoftAfferent(drive, model.used_windows_ms, seed), rates),
        method,
        lambda five: six_parameters(five[:4]),
        method.of(np.arange(drive.n_sites)),
    )
