"""Level 2: what the rates under the shifted bar determine of the afferent, and what they leave open."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray
from fingerpad.core.signals import SedTraces
from fingerpad.data import bar_firing_rates
from fingerpad.experiments.fit.rate_uncertainty import LEVEL, SEEDS_OF_PROFILES, profiles, sensitivity
from fingerpad.experiments.gerling2014 import single_unit
from fingerpad.inference.afferent_posterior import AfferentPosterior, afferent_posterior
from fingerpad.inference.fitting.identifiability import identifiability
from fingerpad.inference.fitting.posterior import credible_band
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, IDENTIFIABLE_UNITS, identifiable
from fingerpad.inference.rate_likelihood import INDEPENDENT, RateLikelihood, ResidualDraws
from fingerpad.inference.rate_model import AfferentModel, four_number_model
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.neuron.transduction import drive

PIECES = 8
"""Linear pieces of the drive between two given times. Rates differ by less than 0.01 spikes/s on average from
those with 32, and an evaluation takes two thirds of the time."""

THOROUGH: dict[str, Any] = {"smallest_effective_size": 200.0}
"""Settings of the sampler: the ends of a 95 % interval err by a seventh of a standard deviation."""

QUICK: dict[str, Any] = {"n_walkers": 100, "smallest_effective_size": 100.0, "largest_r_hat": 1.02}
"""Settings for a look: the ends err by a fifth of a standard deviation."""


def result(sed: SedTraces, fitted: ArrayLike, seed: int, *, quick: bool = False) -> dict[str, Any]:
    """Find what the rates determine: identifiable numbers, posterior, profiles and sensitivity.

    Parameters
    ----------
    sed : SedTraces
        Strain energy density at the receptor, one column per shift of the bar.
    fitted : array_like (6,)
        A fit, in the order of `fingerpad.neuron.afferent.PARAMETER_NAMES`: where the draws begin, and about
        which
        sensitivity is asked for.
    seed : int
        Of the random numbers.
    quick : bool, optional
        Whether half as many effective draws will do.

    Returns
    -------
    dict
        Plain numbers with units in their names, ready for the report.

    Raises
    ------
    ConvergenceError
        If draws or profiles do not converge.
    """
    recordings, shift_mm = single_unit.bar_recordings(), bar_firing_rates().shift_mm
    six_model = AfferentModel.of_drive(drive(sed, pieces=PIECES))
    model = four_number_model(six_model)
    six = np.asarray(fitted, dtype=np.float64)
    four = identifiable(six)
    alike, independent = RateLikelihood(model, recordings, shift_mm), RateLikelihood(model, recordings)
    posterior = afferent_posterior(alike, four, seed=seed, **(QUICK if quick else THOROUGH))
    some = posterior.four[np.linspace(0, len(posterior.four) - 1, SEEDS_OF_PROFILES).astype(np.int64)]
    return {
        "level": LEVEL,
        "seed": seed,
        "names": list(IDENTIFIABLE_NAMES),
        "units": dict(zip(IDENTIFIABLE_NAMES, IDENTIFIABLE_UNITS, strict=True)),
        "fit": dict(zip(IDENTIFIABLE_NAMES, four, strict=True)),
        "capacitance_mf": six[4],
        "threshold_mv": six[5],
        "identifiability": _identifiability(six_model, six),
        "posterior": _numbers(posterior, six),
        "convergence": _convergence(posterior),
        "shift_mm": shift_mm,
        "rates": {
            phase: _phase(drawn, getattr(recordings, f"{phase}_rate_hz"))
            for phase, drawn in posterior.rates.items()
        },
        "evidence_for_alike_residuals": (
            alike.log_likelihood(some).max() - independent.log_likelihood(some).max()
        ),
        "profiles": profiles(alike, some),
        "sensitivity": sensitivity(RateProblem(model, recordings), four, seed),
    }


def _identifiability(model: AfferentModel, six: FloatArray) -> dict[str, Any]:
    """Singular values of the rates' Jacobian in shares of the six parameters."""
    found = identifiability(lambda values: np.concatenate(model.evaluate(values)), six, PARAMETER_NAMES)
    return {
        "rank": found.rank,
        "relative_singular_values": found.singular_values / found.singular_values[0],
        "silent_directions": [
            dict(zip(PARAMETER_NAMES, direction, strict=True)) for direction in found.silent_directions
        ],
    }


def _numbers(posterior: AfferentPosterior, six: FloatArray) -> dict[str, Any]:
    """Median and interval of the four numbers, and of the gains with the fit's capacitance and threshold."""
    gains = posterior.six(float(six[4]), float(six[5]))[:, :3]
    draws = dict(zip(IDENTIFIABLE_NAMES, posterior.four.T, strict=True))
    draws |= dict(zip(PARAMETER_NAMES[:3], gains.T, strict=True))
    draws["resting_share"] = posterior.chains.flat[:, 0]
    return {name: _summary(values) for name, values in draws.items()}


def _summary(draws: FloatArray) -> dict[str, float]:
    low, high = credible_band(draws, LEVEL)
    return {"median": float(np.median(draws)), "low": float(low), "high": float(high)}


def _convergence(posterior: AfferentPosterior) -> dict[str, Any]:
    chains = posterior.chains
    return {
        "ensembles": chains.draws.shape[0],
        "walkers": chains.draws.shape[2],
        "draws": len(posterior.four),
        "evaluations": chains.n_evaluations,
        "acceptance": chains.acceptance,
        "r_hat": chains.r_hat.max(),
        "effective_draws": chains.effective_sizes.min(),
        "effective_draws_of_tails": chains.tail_effective_sizes.min(),
        "draws_per_effective_draw": chains.autocorrelation_steps.max(),
    }


def _phase(drawn: ResidualDraws, observed_hz: FloatArray) -> dict[str, Any]:
    """Bands of one phase, and how far the observed rates lie within them."""
    low, high = credible_band(drawn.predicted_hz, LEVEL)
    new_low, new_high = credible_band(drawn.new_hz, LEVEL)
    return {
        "observed_hz": observed_hz,
        "median_hz": np.median(drawn.predicted_hz, axis=0),
        "low_hz": low,
        "high_hz": high,
        "new_low_hz": new_low,
        "new_high_hz": new_high,
        "share_within_new": ((new_low <= observed_hz) & (observed_hz <= new_high)).mean(),
        "residual_deviation_hz": _summary(drawn.deviation_hz),
        "residual_length_mm": _summary(drawn.length_mm),
        "probability_of_independence": (drawn.length_mm == INDEPENDENT).mean(),
    }
