"""Fits by the likelihood of spikes, and what the likelihood of rates says of a fit: intervals, profiles."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from fingerpad.core.errors import ConvergenceError
from fingerpad.core.signals import SpikeTrains
from fingerpad.core.units import units_of
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.experiments.fit import results
from fingerpad.experiments.fit.fit import Prepared, Recordings, check_spikes
from fingerpad.inference.afferent_fit import spike_start, start_points
from fingerpad.inference.fitting.methods import CrossValidation, Fit, Problem, halton
from fingerpad.inference.fitting.posterior import credible_band
from fingerpad.inference.fitting.profile_likelihood import ProfileLikelihood, profile_likelihoods
from fingerpad.inference.fitting.sensitivity import SobolIndices, identifiability, sobol_indices
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, identifiable, six_parameters
from fingerpad.inference.rate_model import AfferentModel, RateProblem, four_number_model
from fingerpad.inference.rate_posterior import (
    INDEPENDENT,
    AfferentPosterior,
    CorrelatedResiduals,
    RateLikelihood,
    ResidualDraws,
    afferent_posterior,
    from_coordinates,
    to_coordinates,
)
from fingerpad.inference.recordings import RateRecordings, SpikeRecordings
from fingerpad.inference.spike_likelihood import SoftAfferent, SpikeLikelihood, fit_spikes, time_rescaling
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.neuron.transduction import Drive

LEVEL = 0.95  # Probability within every interval and band.
SEEDS_OF_PROFILES = 300  # Draws from the posterior that profiles start from.

CLOUDS, POINTS_OF_CLOUD, BEST_POINTS, MOST_LOSS = 5, 1200, 150, 4.0
"""Of `likely_points`: nine draws of ten from a posterior of four numbers lose less than that."""

FIRST_CLOUD = (0.05, 0.4, 0.2, 0.5)  # Standard deviations, in the coordinates of the posterior.
SENSITIVITY_SHARE = 0.25  # Sobol's ranges reach from this share below the fit to this share above. [1]
SENSITIVITY_POINTS = 512  # Base points of Sobol's design.
MOST_RESTING_SHARE = 0.9  # At most, where a search begins: untouched skin elicits no spike.


def admissible(four: ArrayLike) -> FloatArray:
    """Return the numbers of a fit, moved to where a search of the likelihood can begin.

    A gain at its bound, 0, has no logarithm; the paper's start replaces it. An intercept that would elicit
    spikes without touch is lowered.
    """
    fitted = np.array(four, dtype=np.float64)
    usual = identifiable(start_points()[0])
    fitted[1:] = np.where(fitted[1:] > 0.0, fitted[1:], usual[1:])
    fitted[0] = min(fitted[0], MOST_RESTING_SHARE / fitted[3])
    return fitted


def likely_points(likelihood: RateLikelihood, four: ArrayLike) -> FloatArray:
    """Find points over the whole region that is likely given the rates; the design is not random.

    A likelihood of rates has many local maxima, and the fit may be at a low one. Clouds of points are laid
    about the best points of all clouds before; points that are not much less likely than the best are kept.
    """
    middle, reach = to_coordinates(four), np.diag(FIRST_CLOUD)
    design = norm.ppf(halton(CLOUDS * POINTS_OF_CLOUD, middle.size))
    points, heights = middle[None], likelihood.log_likelihood(from_coordinates(middle[None]))
    for offsets in np.split(design, CLOUDS):
        cloud = middle + offsets @ reach.T
        cloud = cloud[cloud[:, 0] < 1.0]  # untouched skin elicits no spike
        points = np.vstack([points, cloud])
        heights = np.append(heights, likelihood.log_likelihood(from_coordinates(cloud)))
        best = points[np.argsort(-heights, kind="stable")[:BEST_POINTS]]
        # Wider than the best points, so that the next cloud can find better ones beside them.
        middle, reach = best.mean(axis=0), np.linalg.cholesky(2.0 * np.cov(best, rowvar=False))
    return from_coordinates(points[heights >= heights.max() - MOST_LOSS])


def profiles(likelihood: RateLikelihood, starts: FloatArray) -> tuple[results.ParameterProfile, ...]:
    """Profile the likelihood of the four numbers; those that are positive in their logarithm."""

    def log_likelihood(points: FloatArray) -> FloatArray:
        numbers = np.concatenate([points[:, :1], np.exp(points[:, 1:])], axis=1)
        heights = np.full(len(points), -np.inf)
        # As in the prior: untouched skin elicits no spike.
        silent = numbers[:, 0] * numbers[:, 3] < 1.0
        if silent.any():
            heights[silent] = likelihood.log_likelihood(numbers[silent])
        return heights

    begun = np.concatenate([starts[:, :1], np.log(starts[:, 1:])], axis=1)
    found = profile_likelihoods(log_likelihood, begun, begun.std(axis=0), IDENTIFIABLE_NAMES, level=LEVEL)
    return tuple(_profile(profile, logarithm=index > 0) for index, profile in enumerate(found))


def _profile(profile: ProfileLikelihood, logarithm: bool) -> results.ParameterProfile:
    """Return a profile in the unit of its number; an end that is not finite is open."""
    low, high = (float(np.exp(end) if logarithm else end) for end in profile.interval)
    return results.ParameterProfile(
        name=profile.name,
        values=np.exp(profile.values) if logarithm else profile.values,
        losses=profile.losses,
        low=low if np.isfinite(profile.interval[0]) else None,
        high=high if np.isfinite(profile.interval[1]) else None,
    )


def fss_sensitivity(problem: RateProblem, four: ArrayLike, seed: int) -> SobolIndices:
    """Compute Sobol indices of FSS, each number within `SENSITIVITY_SHARE` below and above the fit."""
    fitted, sizes = np.asarray(four, dtype=np.float64), identifiable(start_points()[0])
    sizes[0] = 1.0 / sizes[3]  # beta tau/(C v) = 1 just fires
    reach = SENSITIVITY_SHARE * np.where(fitted == 0.0, sizes, np.abs(fitted))
    return sobol_indices(
        problem.score_batch,
        # A gain is never negative.
        np.maximum(fitted - reach, [-np.inf, 0.0, 0.0, 0.0]),
        fitted + reach,
        seed=seed,
        n_base=SENSITIVITY_POINTS,
        level=LEVEL,
    )


def rate_posterior(
    model: AfferentModel,
    rates: RateRecordings,
    four: ArrayLike,
    seed: int,
    positions_mm: ArrayLike | None = None,
    **settings: Any,
) -> results.RatePosterior:
    likelihood = _likelihood(model, rates, positions_mm)
    found = afferent_posterior(likelihood, admissible(four), seed=seed, **settings)
    return results.RatePosterior(
        level=LEVEL,
        seed=seed,
        numbers=_intervals(dict(zip(IDENTIFIABLE_NAMES, found.four.T, strict=True))),
        covariance=np.cov(found.four, rowvar=False),
        convergence=results.PosteriorConvergence.of(found.chains),
        rates=_predictions(found, rates),
    )


def profiled(
    model: AfferentModel, rates: RateRecordings, four: ArrayLike, positions_mm: ArrayLike | None = None
) -> tuple[results.ParameterProfile, ...]:
    likelihood = _likelihood(model, rates, positions_mm)
    return profiles(likelihood, likely_points(likelihood, admissible(four)))


def _likelihood(
    model: AfferentModel, rates: RateRecordings, positions_mm: ArrayLike | None
) -> RateLikelihood:
    residuals = CorrelatedResiduals(len(rates.stimuli), positions_mm)  # type: ignore[arg-type]
    return RateLikelihood(four_number_model(model), rates, residuals)


def uncertainty(
    six_model: AfferentModel,
    recordings: RateRecordings,
    fitted: ArrayLike,
    shift_mm: FloatArray,
    seed: int,
    **settings: Any,
) -> results.UncertaintyResult:
    """Find what rates determine of six fitted parameters, with stimuli at places along a line."""
    model, six = four_number_model(six_model), np.asarray(fitted, dtype=np.float64)
    four, capacitance_mf, threshold_mv = identifiable(six), float(six[4]), float(six[5])
    alike, independent = (_likelihood(six_model, recordings, places_mm) for places_mm in (shift_mm, None))
    posterior = afferent_posterior(alike, four, seed=seed, **settings)
    chains, gains = posterior.chains, six_parameters(posterior.four, capacitance_mf, threshold_mv)[:, :3]
    draws = dict(zip((*IDENTIFIABLE_NAMES, *PARAMETER_NAMES[:3]), (*posterior.four.T, *gains.T), strict=True))
    draws["resting_share"] = chains.flat[:, 0]
    some = posterior.four[np.linspace(0, len(posterior.four) - 1, SEEDS_OF_PROFILES).astype(np.int64)]
    local = identifiability(lambda values: np.concatenate(six_model.evaluate(values)), six, PARAMETER_NAMES)
    return results.UncertaintyResult(
        level=LEVEL,
        seed=seed,
        units=units_of(IDENTIFIABLE_NAMES),
        fit=dict(zip(IDENTIFIABLE_NAMES, four.tolist(), strict=True)),
        capacitance_mf=capacitance_mf,
        threshold_mv=threshold_mv,
        identifiability=results.ParameterIdentifiability(
            rank=local.rank, relative_singular_values=local.singular_values / local.singular_values[0]
        ),
        posterior=_intervals(draws),
        convergence=results.PosteriorConvergence.of(chains),
        shift_mm=shift_mm,
        rates=_predictions(posterior, recordings),
        evidence_for_alike_residuals=(
            alike.log_likelihood(some).max() - independent.log_likelihood(some).max()
        ),
        profiles=profiles(alike, some),
        sensitivity=fss_sensitivity(RateProblem(model, recordings), four, seed),
    )


def interval(draws: FloatArray) -> results.CredibleInterval:
    low, high = credible_band(draws, LEVEL)
    return results.CredibleInterval(median=float(np.median(draws)), low=float(low), high=float(high))


def _intervals(draws: Mapping[str, FloatArray]) -> dict[str, results.CredibleInterval]:
    return {name: interval(values) for name, values in draws.items()}


def _predictions(found: AfferentPosterior, recordings: RateRecordings) -> dict[str, results.PhasePrediction]:
    return {
        phase: _prediction(drawn, getattr(recordings, f"{phase}_rate_hz"))
        for phase, drawn in found.rates.items()
    }


def _prediction(drawn: ResidualDraws, observed_hz: FloatArray) -> results.PhasePrediction:
    low, high = credible_band(drawn.predicted_hz, LEVEL)
    new_low, new_high = credible_band(drawn.new_hz, LEVEL)
    return results.PhasePrediction(
        observed_hz=observed_hz,
        median_hz=np.median(drawn.predicted_hz, axis=0),
        low_hz=low,
        high_hz=high,
        new_low_hz=new_low,
        new_high_hz=new_high,
        share_within_new=((new_low <= observed_hz) & (observed_hz <= new_high)).mean(),
        residual_deviation_hz=interval(drawn.deviation_hz),
        residual_length_mm=interval(drawn.length_mm),
        probability_of_independence=(drawn.length_mm == INDEPENDENT).mean(),
    )


@dataclass(frozen=True)
class MaximumLikelihood:
    """Fit the soft threshold under which the spikes of the chosen stimuli are most likely."""

    drive: Drive  #: One column per stimulus.
    recordings: SpikeRecordings  #: Spikes of all presentations.
    sites: IntArray  #: Column of the drive that each presentation belongs to, (n_presentations,).
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
    everything: SpikeLikelihood  #: Likelihood of all spikes.

    def covariance(self, fit: Fit, folds: CrossValidation) -> FloatArray:
        """Covariance (4, 4) of the identifiable numbers: part of the inverse of the Fisher information."""
        return self._covariance(fit)[:4, :4]

    def spikes(self, fit: Fit, folds: CrossValidation) -> results.SpikeFitSummary:
        left_out = [(self.method.of(fold.testing), fold.fit.parameters) for fold in folds.folds]
        test = time_rescaling(self.everything, fit.parameters)
        return results.SpikeFitSummary(
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
