"""Efficiency of a code: its d' relative to that of the ideal observer of the same responses.

The paper's noise is proportional to the response mu of a receptor. A noise floor s is added to it:

    r ~ Normal(mu, (sigma_1 mu)^2 + s^2)

Without the floor a receptor that responds weakly or not at all has hardly any noise, and one that begins to
respond identifies the stimulus with certainty (docs/decisions.md#ideal-observer).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from numpy.typing import ArrayLike

from fingerpad.core.checked import checked
from fingerpad.core.values import Finite, Matrix, Whole, choice
from fingerpad.psychophysics.encoding import distance, gradient_sum
from fingerpad.psychophysics.ideal_observer import (
    Discriminability,
    Presentation,
    ResponseModel,
    Statistic,
    efficiency,
    multiplied_responses,
    present,
)
from fingerpad.psychophysics.noisy_responses import session_trials

POPULATION_CODES = ("gradient_sum", "euclidean")
SMALLEST_SPREAD = 1.0  # Noise floor s. [spikes/s or ms]
EFFICIENCY_TRIALS = 4000  # Presentations of either stimulus behind one efficiency.

LEAST_KNOWN = 10.0
"""Ratio of the ideal observer's d' to its standard error from which on an efficiency is reported."""


@dataclass(frozen=True)
class CodeEfficiency:
    """A code and the ideal observer of the same responses.

    Parameters
    ----------
    code, ideal : Discriminability
        Of either.
    efficiency, efficiency_error : float
        Squared ratio of d' and its standard error. NaN where the ideal observer is always correct, or its d'
        is below `LEAST_KNOWN` standard errors.
    """

    code: Discriminability
    ideal: Discriminability
    efficiency: float
    efficiency_error: float


@checked
def noisy_presentations(
    table: Matrix, noise_sigma: Finite, seed: Whole, session: Whole = 0
) -> list[Presentation]:
    """Draw responses to the standard and to each comparison.

    Parameters
    ----------
    table : array (n_stimuli, n_receptors)
        One measure of every receptor without noise, the standard first. [spikes/s or ms]
    noise_sigma : float
        Standard deviation sigma_1 of the multiplicative noise, above 0.
    seed, session : int
        Of the random numbers.
    """
    standard, *comparisons = (multiplied_responses(row, noise_sigma, SMALLEST_SPREAD) for row in table)
    return [present(standard, comparison, seed, EFFICIENCY_TRIALS, session) for comparison in comparisons]


@checked
def code_statistic(
    code: Annotated[str, choice(POPULATION_CODES)],
    standard: ResponseModel,
    neighbours: ArrayLike,
    seed: Whole,
    session: Whole = 0,
) -> Statistic:
    """Return what a code computes from the responses of one trial.

    Parameters
    ----------
    code : {"gradient_sum", "euclidean"}
        The code.
    standard : ResponseModel
        Responses to the standard. A distance is taken from a presentation of it in a trial of its own.
    neighbours : int array (n_pairs, 2)
        Pairs of the Gradient Sum.
    seed, session : int
        As in `noisy_presentations`.
    """
    if code == "gradient_sum":
        return lambda responses: gradient_sum(responses, neighbours)
    memory = standard.draw(seed, session_trials(session, 3, EFFICIENCY_TRIALS)[2])
    return lambda responses: distance(responses, memory)


@checked
def code_efficiency(shown: Presentation, statistic: Statistic) -> CodeEfficiency:
    """Compare a code, by `code_statistic`, with the ideal observer of the same presentations.

    Examples
    --------
    Of two afferents one changes its rate. The Gradient Sum also contains the noise of the other:

    >>> import numpy as np
    >>> table = np.array([[50.0, 50.0], [50.0, 53.0]])
    >>> (shown,) = noisy_presentations(table, 0.1, seed=1)
    >>> standard = multiplied_responses(table[0], 0.1, SMALLEST_SPREAD)
    >>> found = code_efficiency(shown, code_statistic("gradient_sum", standard, np.array([[0, 1]]), seed=1))
    >>> bool(found.efficiency < 0.6)
    True
    """
    code, ideal = shown.of(statistic), shown.ideal()
    # Equal stimuli have a d' of 0 without any error.
    known = 0.0 < ideal.d_prime < math.inf and ideal.d_prime >= LEAST_KNOWN * ideal.d_prime_error
    share, error = efficiency(code, ideal) if known else (math.nan, math.nan)
    return CodeEfficiency(code, ideal, share, error)
