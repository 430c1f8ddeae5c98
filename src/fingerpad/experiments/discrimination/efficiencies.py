"""How much of what a population tells a code makes use of: the ideal observer, and each code beside it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.psychophysics import Presentation, efficiency, multiplied_responses, present
from fingerpad.psychophysics.encoding import distance, gradient_sum
from fingerpad.psychophysics.ideal_observer import Statistic
from fingerpad.psychophysics.noisy_responses import session_trials

SESSION = 2
"""Session of the random numbers: not that of the hit rates."""

TRIALS = 4000
"""Presentations of either stimulus behind one efficiency."""

LEAST_KNOWN = 10.0
"""How many of its standard errors the ideal observer's d' must have for a share of it to be told."""

SMALLEST_SPREAD = 1.0
"""Noise beside that which multiplies: without it, an afferent that fires nothing would tell a stimulus with
certainty from one that makes it fire (docs/decisions/ideal-observer-of-tasks.md). [spikes/s or ms]"""


def presentations(table: FloatArray, noise_sigma: float, seed: int) -> list[Presentation]:
    """Draw responses to the standard and to each comparison, and what the ideal observer makes of them.

    Parameters
    ----------
    table : array (n_stimuli, n_receptors)
        One measure of every receptor, the standard first. [spikes/s or ms]
    noise_sigma : float
        Standard deviation of the multiplicative noise, above 0.
    seed : int
        Of the random numbers.

    Returns
    -------
    list of Presentation
        One per comparison.
    """
    models = [multiplied_responses(responses, noise_sigma, SMALLEST_SPREAD) for responses in table]
    return [present(models[0], model, seed, TRIALS, SESSION) for model in models[1:]]


def ideal_observer(shown: list[Presentation]) -> dict[str, Any]:
    """Return how often, and with which d', the ideal observer tells each comparison from the standard.

    Parameters
    ----------
    shown : list of Presentation
        From `presentations`.

    Returns
    -------
    dict of str to array (n_comparisons,)
        `hit_rate`, `hit_rate_sd` (its Monte-Carlo error) and `d_prime`, infinite where no trial is failed.
    """
    rates = np.array([presentation.ideal_hit_rate() for presentation in shown])
    return {
        "hit_rate": rates,
        "hit_rate_sd": np.sqrt(rates * (1.0 - rates) / TRIALS),
        "d_prime": np.array([presentation.ideal().d_prime for presentation in shown]),
    }


def efficiencies(
    code: str,
    shown: list[Presentation],
    table: FloatArray,
    neighbours: np.ndarray,
    noise_sigma: float,
    seed: int,
) -> dict[str, Any]:
    """Compare a code with the ideal observer, comparison by comparison.

    Parameters
    ----------
    code : {"gradient_sum", "euclidean"}
        How the population is read.
    shown : list of Presentation
        From `presentations`.
    table, noise_sigma, seed
        As there.
    neighbours : int array (n_pairs, 2)
        Who is whose neighbour.

    Returns
    -------
    dict of str to list (n_comparisons,)
        `d_prime` of the code, `efficiency` and `efficiency_error`; None where the ideal observer nearly
        guesses or never fails. Empty where nothing is shown.

    Examples
    --------
    Two afferents of which one tells all there is: half of what their difference says is noise of the other.

    >>> table = np.array([[50.0, 50.0], [50.0, 53.0]])
    >>> shown = presentations(table, 0.1, seed=1)
    >>> found = efficiencies("gradient_sum", shown, table, np.array([[0, 1]]), 0.1, seed=1)
    >>> found["efficiency"][0] < 0.6
    True
    """
    found: dict[str, Any] = {"d_prime": [], "efficiency": [], "efficiency_error": []}
    if not shown:
        return found
    statistic = _statistic(code, table, neighbours, noise_sigma, seed)
    for presentation in shown:
        of_code, of_ideal = presentation.of(statistic), presentation.ideal()
        known = LEAST_KNOWN * of_ideal.d_prime_error <= of_ideal.d_prime < math.inf
        share, error = efficiency(of_code, of_ideal) if known else (None, None)
        found["d_prime"].append(of_code.d_prime)
        found["efficiency"].append(share)
        found["efficiency_error"].append(error)
    return found


def _statistic(
    code: str, table: FloatArray, neighbours: np.ndarray, noise_sigma: float, seed: int
) -> Statistic:
    """Return what makes one number of each of the responses (n_trials, n_receptors)."""
    if code == "gradient_sum":
        return lambda responses: gradient_sum(responses, neighbours)
    # A distance needs a standard to compare with, as noisy as what is compared: of trials of its own.
    own = session_trials(SESSION, 3, TRIALS)[2]
    memory = multiplied_responses(table[0], noise_sigma, SMALLEST_SPREAD).draw(seed, own)
    return lambda responses: distance(responses, memory)
