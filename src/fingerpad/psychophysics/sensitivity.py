"""d': difference between two stimuli in standard deviations, independent of response bias.

    d' = z(H) - z(F)                            equal spread
    d_a = sqrt(2 / (1 + s^2)) (z(H) - s z(F))   spread of no signal over that of signal, s
    c  = -(z(H) + z(F)) / 2                     criterion, from midway

H and F are the rates of hits and false alarms, z the inverse of the normal distribution. The proportion
correct in a task, for an observer without bias, is

    yes-no                                 Phi(d'/2)
    one of two (2AFC)                      Phi(d'/sqrt 2)
    one of m (mAFC)                        integral of phi(x - d') Phi(x)^(m - 1) dx
    same-different, two looks compared     (Phi((d' - k)/sqrt 2) + Phi((-d' - k)/sqrt 2)
      (differencing)                        + 2 Phi(k/sqrt 2) - 1) / 2,    k the best
    same-different, each look judged       Phi(d'/2)^2 + Phi(-d'/2)^2
      (independent observations)

Phi and phi are the normal distribution and its density. Source: Macmillan & Creelman 2005, Detection Theory,
chapters 1, 3, 7, 9 and 10.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.values import (
    Finite,
    FloatArray,
    IntArray,
    NotNegative,
    Positive,
    Several,
    Whole,
    choice,
    whole,
)
from fingerpad.psychophysics.encoding import Noise
from fingerpad.psychophysics.observer import expected_hit_rates

CORRECTIONS = ("log-linear", "half", "none")


@dataclass(frozen=True)
class Sensitivity:
    """Detectability of a signal, and criterion of the observer."""

    d_prime: float  #: d', or d_a where the spreads differ. [standard deviations]
    criterion: float  #: c; positive for a conservative observer. [standard deviations]
    hit_rate: float
    false_alarm_rate: float
    """As corrected. [0-1]"""


@checked
def sensitivity(
    n_hits: Whole,
    n_signals: Whole,
    n_false_alarms: Whole,
    n_others: Whole,
    *,
    correction: Annotated[str, choice(CORRECTIONS)] = "log-linear",
    spread_ratio: Positive = 1.0,
) -> Sensitivity:
    """Return d' from hits and false alarms of a detection task.

    Parameters
    ----------
    n_hits, n_signals : int
        Responses "yes", and presentations, of the signal or the comparison.
    n_false_alarms, n_others : int
        Responses "yes", and presentations, without the signal or of the standard.
    correction : {"log-linear", "half", "none"}, optional
        Correction of rates of 0 and 1, for which d' is infinite: (k + 1/2) / (n + 1) for every rate (Hautus
        1995), 1/2 in place of a count of 0 and n - 1/2 in place of n, or none: then such rates are refused.
    spread_ratio : float, optional
        s, standard deviation without the signal over that with it: 1 gives d', others d_a.

    Examples
    --------
    >>> found = sensitivity(84, 100, 16, 100, correction="none")
    >>> round(found.d_prime, 2), abs(round(found.criterion, 2))
    (1.99, 0.0)
    """
    s = spread_ratio
    hits = _rate("n_hits", n_hits, "n_signals", n_signals, correction)
    false_alarms = _rate("n_false_alarms", n_false_alarms, "n_others", n_others, correction)
    z_hits, z_false_alarms = float(ndtri(hits)), float(ndtri(false_alarms))
    return Sensitivity(
        d_prime=math.sqrt(2.0 / (1.0 + s**2)) * (z_hits - s * z_false_alarms),
        criterion=-0.5 * (z_hits + z_false_alarms),
        hit_rate=hits,
        false_alarm_rate=false_alarms,
    )


def _rate(of: str, count: int, among: str, total: int, correction: str) -> float:
    k, n = whole(of, count, 0), whole(among, total, 1)
    if k > n:
        raise InputError(of, f"must not exceed {among}", f"{k} of {n}")
    if correction == "log-linear":
        return (k + 0.5) / (n + 1.0)
    if correction == "half":
        return min(max(k, 0.5), n - 0.5) / n
    if k in (0, n):
        raise InputError(
            f"{of} is {k} of {n}, for which d' is infinite: choose the correction 'log-linear' or 'half'."
        )
    return k / n


LARGEST_D_PRIME = 20.0  # Above it the proportion correct is 1 in double precision.

_REACH, _POINTS = 9.0, 361
"""Of the integral: the error of the trapezium rule on a normal density is below round-off."""


@checked
def yes_no(d_prime: NotNegative) -> float:
    """Proportion correct in yes-no: one look is judged "standard" or "comparison". [0.5-1]

    Examples
    --------
    >>> round(yes_no(2.0), 4)
    0.8413
    """
    return float(ndtr(0.5 * d_prime))


@checked
def forced_choice(d_prime: NotNegative, alternatives: Several = 2) -> float:
    """Proportion correct in forced choice: one of m alternatives is the comparison. [1/m-1]

    Examples
    --------
    >>> round(forced_choice(1.0), 4), round(forced_choice(0.0, 4), 4)
    (0.7602, 0.25)
    """
    d, m = d_prime, alternatives
    if m == 2:
        return float(ndtr(d / math.sqrt(2.0)))
    around = np.linspace(-_REACH, _REACH, _POINTS)
    density = np.exp(-0.5 * np.square(around)) / math.sqrt(2.0 * math.pi)
    return float(np.trapezoid(density * ndtr(around + d) ** (m - 1), around))


@checked
def same_different_by_difference(d_prime: NotNegative, criterion: NotNegative | None = None) -> float:
    """Proportion correct in "same or different?" by the difference of the two looks. [0.5-1 at the best k]

    The observer says "different" if the looks differ by more than k, either way.

    Parameters
    ----------
    d_prime : float
        Not negative. [standard deviations]
    criterion : float, optional
        k. Default: the optimum, at which both responses are equally likely. [standard deviations]

    Examples
    --------
    >>> round(same_different_by_difference(2.0), 3)
    0.68
    """
    d = d_prime
    k = best_difference(d) if criterion is None else criterion
    if math.isinf(k):
        return 0.5
    root = math.sqrt(2.0)
    hits = ndtr((d - k) / root) + ndtr((-d - k) / root)
    correct_rejections = 2.0 * ndtr(k / root) - 1.0
    return float(0.5 * (hits + correct_rejections))


@checked
def best_difference(d_prime: NotNegative) -> float:
    """Return the difference k above which "different" is more likely.

    exp(-d'^2 / 4) cosh(d' k / 2) = 1,    k = (2 / d') arcosh(exp(d'^2 / 4))
    """
    d = d_prime
    exponent = 0.25 * d * d
    if exponent < _SMALL:
        return math.sqrt(2.0)
    # ln(e^x + sqrt(e^2x - 1)) without overflow.
    return 2.0 / d * (exponent + math.log1p(math.sqrt(-math.expm1(-2.0 * exponent))))


_SMALL = 1e-12


def same_different_by_looks(d_prime: float) -> float:
    """Proportion correct in "same or different?" where each look is judged by itself. [0.5-1]

    This is optimal if the two stimuli are the same in every trial.

    Examples
    --------
    >>> round(same_different_by_looks(2.0), 3)
    0.733
    """
    right = yes_no(d_prime)
    return right**2 + (1.0 - right) ** 2


TASKS: dict[str, Callable[[float], float]] = {
    "yes-no": yes_no,
    "2afc": forced_choice,
    "same-different by difference": same_different_by_difference,
    "same-different by looks": same_different_by_looks,
}
"""Proportion correct of d', by the name of the task."""


@checked
def d_prime_of_proportion(
    proportion_correct: Finite, task: Callable[[float], float] = forced_choice
) -> float:
    """Return the d' for which a task has a proportion correct. [standard deviations]

    Parameters
    ----------
    proportion_correct : float
        At least the chance level, below 1. [0-1]
    task : callable, optional
        One of `TASKS`, or any increasing function of d'.

    Examples
    --------
    >>> round(d_prime_of_proportion(0.75), 4), round(d_prime_of_proportion(0.75, yes_no), 4)
    (0.9539, 1.349)
    """
    guessing, never_failed = task(0.0), task(LARGEST_D_PRIME)
    if not guessing - _SMALL <= proportion_correct < never_failed:
        wanted = f"must lie between the chance level, {guessing:g}, and 1"
        raise InputError("proportion_correct", wanted, f"{proportion_correct:g}")
    if proportion_correct <= guessing:
        return 0.0
    if task is forced_choice:
        return float(math.sqrt(2.0) * ndtri(proportion_correct))
    return float(brentq(lambda d: task(d) - proportion_correct, 0.0, LARGEST_D_PRIME, xtol=1e-12))


@dataclass(frozen=True)
class InterpolatedObserver:
    """Discriminates stimuli of any level by the Gradient Sum of interpolated responses.

    Between the levels a response is a monotone cubic in the logarithm of the level.
    """

    levels: FloatArray  #: Of the stimuli whose responses are known, increasing, (n_levels,).
    table: FloatArray  #: Responses to these, (n_levels, n_receptors).
    neighbours: IntArray  #: Pairs of the Gradient Sum, (n_pairs, 2).
    noise: float | Noise  #: Of the responses; a number for noise that multiplies.
    draws: FloatArray  #: Common random presentations, (n_draws, n_receptors).

    @cached_property
    def _curve(self) -> PchipInterpolator:
        return PchipInterpolator(np.log(self.levels), self.table)

    @property
    def highest(self) -> float:
        """Largest level at which responses are known."""
        return float(np.exp(self._curve.x[-1]))

    def responses(self, level: float) -> FloatArray:
        return self._curve(np.log(level))

    def slopes(self, level: float) -> FloatArray:
        """Return the derivatives of the responses (n_receptors,) by the level."""
        return self._curve(np.log(level), 1) / level

    def hit_rate(self, standard: float, comparison: float) -> float:
        pair = [self.responses(standard), self.responses(comparison)]
        return float(expected_hit_rates(pair, self.neighbours, self.noise, self.draws)[0])

    def difference(self, standard: float, proportion: float = 0.75) -> float:
        """Return how much higher a level must be for that hit rate; NaN if it is beyond the highest."""

        def missing(comparison: float) -> float:
            return self.hit_rate(standard, comparison) - proportion

        if missing(self.highest) <= 0.0:
            return math.nan
        return float(brentq(missing, standard, self.highest, xtol=1e-3)) - standard
