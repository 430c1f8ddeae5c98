"""Uncertainty of a fit to rates: credible intervals and profiles of the four numbers, and bands of rates."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray
from fingerpad.experiments.fit.rate_uncertainty import LEVEL, admissible, likely_points, profiles
from fingerpad.experiments.fit.results import ParameterProfile, PhaseBands, RateBand, RatePosterior
from fingerpad.inference.afferent_posterior import afferent_posterior
from fingerpad.inference.fitting.posterior import credible_band
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES
from fingerpad.inference.rate_likelihood import RateLikelihood
from fingerpad.inference.rate_model import AfferentModel, four_number_model
from fingerpad.inference.recordings import RateRecordings


def rate_posterior(
    model: AfferentModel,
    rates: RateRecordings,
    four: ArrayLike,
    seed: int,
    positions_mm: ArrayLike | None = None,
    **settings: Any,
) -> RatePosterior:
    """Draw the four identifiable numbers from their posterior given the rates."""
    likelihood = _likelihood(model, rates, positions_mm)
    found = afferent_posterior(likelihood, admissible(four), seed=seed, **settings)
    ends = credible_band(found.four, LEVEL).T
    return RatePosterior(
        level=LEVEL,
        seed=seed,
        n_draws=len(found.four),
        n_evaluations=found.chains.n_evaluations,
        largest_r_hat=found.chains.r_hat.max(),
        smallest_effective_size=found.chains.effective_sizes.min(),
        median=dict(zip(IDENTIFIABLE_NAMES, np.median(found.four, axis=0).tolist(), strict=True)),
        interval=dict(zip(IDENTIFIABLE_NAMES, (tuple(pair) for pair in ends.tolist()), strict=True)),
        covariance=np.cov(found.four, rowvar=False),
        bands={
            phase: PhaseBands(predicted=_band(drawn.predicted_hz), new=_band(drawn.new_hz))
            for phase, drawn in found.rates.items()
        },
    )


def profiled(
    model: AfferentModel, rates: RateRecordings, four: ArrayLike, positions_mm: ArrayLike | None = None
) -> tuple[ParameterProfile, ...]:
    """Profile the likelihood of each of the four identifiable numbers."""
    likelihood = _likelihood(model, rates, positions_mm)
    return profiles(likelihood, likely_points(likelihood, admissible(four)))


def _likelihood(
    model: AfferentModel, rates: RateRecordings, positions_mm: ArrayLike | None
) -> RateLikelihood:
    places = None if positions_mm is None else np.asarray(positions_mm, dtype=np.float64)
    return RateLikelihood(four_number_model(model), rates, places)


def _band(draws_hz: FloatArray) -> RateBand:
    low, high = credible_band(draws_hz, LEVEL)
    return RateBand(low_hz=low, high_hz=high)
