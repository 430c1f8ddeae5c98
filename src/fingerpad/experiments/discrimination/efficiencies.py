"""How much of what a population tells a code makes use of: the ideal observer, and each code beside it."""

from __future__ import annotations

import math

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Vector, result_class
from fingerpad.psychophysics.encoding import distance, gradient_sum
from fingerpad.psychophysics.ideal_observer import Presentation, Statistic, efficiency, present
from fingerpad.psychophysics.noisy_responses import session_trials
from fingerpad.psychophysics.response_models import multiplied_responses

SESSION = 2
"""Session of the random numbers: not that of the hit rates."""

TRIALS = 4000
"""Presentations of either stimulus behind one efficiency."""

LEAST_KNOWN = 10.0
"""How many of its standard errors the ideal observer's d' must have for a share of it to be told."""

SMALLEST_SPREAD = 1.0
"""Noise beside that which multiplies: without it, an afferent that fires nothing would tell a stimulus with
certainty from one that makes it fire (docs/decisions/ideal-observer-of-tasks.md). [spikes/s or ms]"""


@result_class
class IdealObserver:
    """The ideal observer of a population.

    Parameters
    ----------
    hit_rate, hit_rate_sd : array (n_comparisons,)
        Hit rate and its Monte-Carlo error. [0-1]
    d_prime : array (n_comparisons,)
        Infinite where no trial is failed.
    """

    hit_rate: Vector
    hit_rate_sd: Vector
    d_prime: Vector


@result_class
class CodeEfficiency:
    """Efficiency of a code against the ideal observer.

    Parameters
    ----------
    d_prime : array (n_comparisons,)
        Of the code.
    efficiency, efficiency_error : array (n_comparisons,)
        Squared ratio of d' and its standard error; NaN where d' of the ideal observer is not known well
        enough or infinite.
    """

    d_prime: Vector
    efficiency: Vector
    efficiency_error: Vector


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


def ideal_observer(shown: list[Presentation]) -> IdealObserver:
    """Compute how well the ideal observer discriminates each comparison from the standard.

    Parameters
    ----------
    shown : list of Presentation
        From `presentations`.

    Returns
    -------
    IdealObserver
    """
    rates = np.array([presentation.ideal_hit_rate() for presentation in shown])
    return IdealObserver(
        hit_rate=rates,
        hit_rate_sd=np.sqrt(rates * (1.0 - rates) / TRIALS),
        d_prime=np.array([presentation.ideal().d_prime for presentation in shown]),
    )


def efficiencies(
    code: str,
    shown: list[Presentation],
    table: FloatArray,
    neighbours: np.ndarray,
    noise_sigma: float,
    seed: int,
) -> CodeEfficiency:
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
    CodeEfficiency

    Examples
    --------
    Two afferents of which one tells all there is: half of what their difference says is noise of the other.

    >>> table = np.array([[50.0, 50.0], [50.0, 53.0]])
    >>> shown = presentations(table, 0.1, seed=1)
    >>> found = efficiencies("gradient_sum", shown, table, np.array([[0, 1]]), 0.1, seed=1)
    >>> bool(found.efficiency[0] < 0.6)
    True
    """
    statistic = _statistic(code, table, neighbours, noise_sigma, seed)
    rows = []
    for presentation in shown:
        of_code, of_ideal = presentation.of(statistic), presentation.ideal()
        known = LEAST_KNOWN * of_ideal.d_prime_error <= of_ideal.d_prime < math.inf
        rows.append((of_code.d_prime, *(efficiency(of_code, of_ideal) if known else (math.nan, math.nan))))
    d_prime, share, error = np.array(rows).T
    return CodeEfficiency(d_prime=d_prime, efficiency=share, efficiency_error=error)


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
