"""What recorded rates leave uncertain: credible intervals of the four numbers, and bands of rates."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.checks import FloatArray
from fingerpad.estimation.afferent_posterior import afferent_posterior, four_number_model
from fingerpad.estimation.any_motion import WINDOWS_MS, AnyMotion
from fingerpad.estimation.identifiable import IDENTIFIABLE_NAMES, identifiable
from fingerpad.estimation.rate_likelihood import RateLikelihood
from fingerpad.estimation.rate_problem import AfferentModel, RateModel
from fingerpad.estimation.recordings import RateRecordings
from fingerpad.fitting.posterior import credible_band
from fingerpad.studies import single_unit

LEVEL = 0.95
"""Probability within every interval and band."""


def posterior(
    model: AnyMotion,
    rates: RateRecordings,
    four: ArrayLike,
    seed: int,
    positions_mm: ArrayLike | None = None,
    **settings: Any,
) -> dict[str, Any]:
    """Draw the four identifiable numbers from what the rates leave possible.

    Parameters
    ----------
    model : AnyMotion
        The afferent under all stimuli.
    rates : RateRecordings
        What was observed.
    four : array_like (4,)
        A fit, near which the draws begin.
    seed : int
        Of the random numbers.
    positions_mm : array_like (n_stimuli,), optional
        Where along a line each stimulus was: residuals of neighbours may then be alike. [mm]
    **settings
        Those of `fingerpad.fitting.posterior.sample`.

    Returns
    -------
    dict
        Median and ends of the credible interval of each number, their covariance, and by phase the bands of
        predicted rates and of new recordings, `low_hz` and `high_hz`.

    Raises
    ------
    ConvergenceError
        If the draws have not converged.
    """
    fitted = np.asarray(four, dtype=np.float64)
    # A gain that ended at its bound, 0, has no logarithm to begin at.
    begin = np.where(
        (fitted > 0.0) | (np.arange(4) == 0), fitted, identifiable(single_unit.start_points()[0])
    )
    places = None if positions_mm is None else np.asarray(positions_mm, dtype=np.float64)
    likelihood = RateLikelihood(four_number_model(_fastest(model)), rates, places)
    found = afferent_posterior(likelihood, begin, seed=seed, **settings)
    return {
        "level": LEVEL,
        "seed": seed,
        "n_draws": len(found.four),
        "n_evaluations": found.chains.n_evaluations,
        "largest_r_hat": found.chains.r_hat.max(),
        "smallest_effective_size": found.chains.effective_sizes.min(),
        "median": dict(zip(IDENTIFIABLE_NAMES, np.median(found.four, axis=0), strict=True)),
        "interval": dict(zip(IDENTIFIABLE_NAMES, credible_band(found.four, LEVEL).T, strict=True)),
        "covariance": np.cov(found.four, rowvar=False),
        "bands": {
            phase: {"predicted": _band(drawn.predicted_hz), "new": _band(drawn.new_hz)}
            for phase, drawn in found.rates.items()
        },
    }


def _fastest(model: AnyMotion) -> RateModel:
    """Return the same model in the form that is quickest over many parameters."""
    if len(model.drives) > 1 or model.windows_ms != WINDOWS_MS:
        return model
    return AfferentModel(model.drives[0], model.refractory_ms)


def _band(draws_hz: FloatArray) -> dict[str, FloatArray]:
    low, high = credible_band(draws_hz, LEVEL)
    return {"low_hz": low, "high_hz": high}
