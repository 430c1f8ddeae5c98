"""Level 2: uncertainty of the afferent given the rates under the shifted bar."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import result_class
from fingerpad.core.signals import Traces
from fingerpad.core.units import units_of
from fingerpad.core.values import FloatArray, Number, Vector
from fingerpad.data import bar_firing_rates
from fingerpad.experiments.fit.rate_uncertainty import LEVEL, SEEDS_OF_PROFILES, fss_sensitivity, profiles
from fingerpad.experiments.fit.results import FssSensitivity, ParameterProfile
from fingerpad.experiments.gerling2014 import single_unit
from fingerpad.inference.fitting.posterior import credible_band
from fingerpad.inference.fitting.sensitivity import identifiability
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, identifiable
from fingerpad.inference.problem import RateProblem
from fingerpad.inference.rate_model import AfferentModel, four_number_model
from fingerpad.inference.rate_posterior import (
    INDEPENDENT,
    AfferentPosterior,
    RateLikelihood,
    ResidualDraws,
    afferent_posterior,
)
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.neuron.transduction import drive

PIECES = 8
"""Linear pieces of the drive between two given times. Rates differ by less than 0.01 spikes/s on average from
those with 32, and an evaluation takes two thirds of the time."""

THOROUGH = partial(afferent_posterior, smallest_effective_size=200.0)
"""Sampler of a result: the error of the ends of a 95 % interval is a seventh of a standard deviation."""

QUICK = partial(afferent_posterior, n_walkers=100, smallest_effective_size=100.0, largest_r_hat=1.02)
"""Sampler of a quick result: the error of the ends is a fifth of a standard deviation."""


@result_class
class CredibleInterval:
    """Posterior median and ends of the credible interval of one number, in its unit."""

    median: Number
    low: Number
    high: Number


@result_class
class ParameterIdentifiability:
    """Directions of the six parameters that the rates determine."""

    rank: int  # Singular values of the Jacobian of the rates that are not zero.
    relative_singular_values: Vector  # Over the largest, (6,). [1]
    silent_directions: tuple[dict[str, Number], ...]  # They do not change the rates; by parameter.


@result_class
class PosteriorConvergence:
    """Size and convergence of the MCMC ensembles."""

    ensembles: int
    walkers: int  # Independent ensembles, and walkers of each.
    draws: int
    evaluations: int  # Draws kept, and evaluations of the likelihood.
    acceptance: Number  # Share of accepted proposals. [1]
    r_hat: Number  # Largest split R-hat. [1]
    effective_draws: Number
    effective_draws_of_tails: Number  # Smallest effective sample sizes.
    draws_per_effective_draw: Number  # Largest autocorrelation time, in draws.


@result_class
class PhasePrediction:
    """Posterior prediction of the rates of one phase, shift by shift."""

    observed_hz: Vector
    median_hz: Vector
    low_hz: Vector
    high_hz: Vector  # Observed; median and credible band of predicted rates, (n_shifts,). [spikes/s]
    new_low_hz: Vector
    new_high_hz: Vector  # Credible band of a new recording, (n_shifts,). [spikes/s]
    share_within_new: Number  # Share of the observed rates within that band. [1]
    residual_deviation_hz: CredibleInterval
    residual_length_mm: CredibleInterval  # Of the residuals; length: of their correlation.
    probability_of_independence: Number  # That residuals of neighbouring shifts are independent. [1]


@result_class
class UncertaintyResult:
    """Uncertainty of the fit to the rates under the bar."""

    level: Number  # Probability within each interval and band.
    seed: int  # Of the random numbers.
    names: tuple[str, ...]  # The four identifiable numbers.
    units: dict[str, str]
    fit: dict[str, Number]
    capacitance_mf: Number
    threshold_mv: Number  # Of the fit; they set the common scale of the gains in `posterior`. [mF], [mV]
    identifiability: ParameterIdentifiability  # Of the six parameters.
    posterior: dict[str, CredibleInterval]  # Of numbers, gains, and resting potential over threshold.
    convergence: PosteriorConvergence
    shift_mm: Vector  # Shifts of the bar, (n_shifts,). [mm]
    rates: dict[str, PhasePrediction]
    evidence_for_alike_residuals: Number  # Gain of the largest log likelihood by correlated residuals.
    profiles: tuple[ParameterProfile, ...]  # Of the four numbers.
    sensitivity: FssSensitivity  # Of FSS to the four numbers.


def uncertainty_result(
    traces: Traces, fitted: ArrayLike, seed: int, *, quick: bool = False, initial_mv: float | None = None
) -> UncertaintyResult:
    recordings, shift_mm = single_unit.bar_recordings(), bar_firing_rates().shift_mm
    six_model = AfferentModel.of_drive(drive(traces, pieces=PIECES), initial_mv=initial_mv)
    model = four_number_model(six_model)
    six = np.asarray(fitted, dtype=np.float64)
    four = identifiable(six)
    alike, independent = RateLikelihood(model, recordings, shift_mm), RateLikelihood(model, recordings)
    posterior = (QUICK if quick else THOROUGH)(alike, four, seed=seed)
    some = posterior.four[np.linspace(0, len(posterior.four) - 1, SEEDS_OF_PROFILES).astype(np.int64)]
    return UncertaintyResult(
        level=LEVEL,
        seed=seed,
        names=IDENTIFIABLE_NAMES,
        units=units_of(IDENTIFIABLE_NAMES),
        fit=dict(zip(IDENTIFIABLE_NAMES, four.tolist(), strict=True)),
        capacitance_mf=six[4],
        threshold_mv=six[5],
        identifiability=_identifiability(six_model, six),
        posterior=_intervals(posterior, six),
        convergence=_convergence(posterior),
        shift_mm=shift_mm,
        rates={
            phase: _prediction(drawn, getattr(recordings, f"{phase}_rate_hz"))
            for phase, drawn in posterior.rates.items()
        },
        evidence_for_alike_residuals=(
            alike.log_likelihood(some).max() - independent.log_likelihood(some).max()
        ),
        profiles=profiles(alike, some),
        sensitivity=fss_sensitivity(RateProblem(model, recordings), four, seed),
    )


def _identifiability(model: AfferentModel, six: FloatArray) -> ParameterIdentifiability:
    found = identifiability(lambda values: np.concatenate(model.evaluate(values)), six, PARAMETER_NAMES)
    return ParameterIdentifiability(
        rank=found.rank,
        relative_singular_values=found.singular_values / found.singular_values[0],
        silent_directions=tuple(
            dict(zip(PARAMETER_NAMES, direction.tolist(), strict=True))
            for direction in found.silent_directions
        ),
    )


def _intervals(posterior: AfferentPosterior, six: FloatArray) -> dict[str, CredibleInterval]:
    """Return intervals of the four numbers, and of the gains with the fit's capacitance and threshold."""
    gains = posterior.six(float(six[4]), float(six[5]))[:, :3]
    draws = dict(zip(IDENTIFIABLE_NAMES, posterior.four.T, strict=True))
    draws |= dict(zip(PARAMETER_NAMES[:3], gains.T, strict=True))
    draws["resting_share"] = posterior.chains.flat[:, 0]
    return {name: _interval(values) for name, values in draws.items()}


def _interval(draws: FloatArray) -> CredibleInterval:
    low, high = credible_band(draws, LEVEL)
    return CredibleInterval(median=float(np.median(draws)), low=float(low), high=float(high))


def _convergence(posterior: AfferentPosterior) -> PosteriorConvergence:
    chains = posterior.chains
    return PosteriorConvergence(
        ensembles=chains.draws.shape[0],
        walkers=chains.draws.shape[2],
        draws=len(posterior.four),
        evaluations=chains.n_evaluations,
        acceptance=chains.acceptance,
        r_hat=chains.r_hat.max(),
        effective_draws=chains.effective_sizes.min(),
        effective_draws_of_tails=chains.tail_effective_sizes.min(),
        draws_per_effective_draw=chains.autocorrelation_steps.max(),
    )


def _prediction(drawn: ResidualDraws, observed_hz: FloatArray) -> PhasePrediction:
    low, high = credible_band(drawn.predicted_hz, LEVEL)
    new_low, new_high = credible_band(drawn.new_hz, LEVEL)
    return PhasePrediction(
        observed_hz=observed_hz,
        median_hz=np.median(drawn.predicted_hz, axis=0),
        low_hz=low,
        high_hz=high,
        new_low_hz=new_low,
        new_high_hz=new_high,
        share_within_new=((new_low <= observed_hz) & (observed_hz <= new_high)).mean(),
        residual_deviation_hz=_interval(drawn.deviation_hz),
        residual_length_mm=_interval(drawn.length_mm),
        probability_of_independence=(drawn.length_mm == INDEPENDENT).mean(),
    )
