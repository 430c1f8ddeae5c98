"""The psychometric function: proportion of correct, or "yes", judgements against the level of the stimulus.

    psi(x) = gamma + (1 - gamma - lambda) F(x; m, w)
    F(x; m, w) = S(s_50 + (s_95 - s_05) (c(x) - c(m)) / w),    s_q = S^-1(q)

gamma is the guess rate, lambda the lapse rate, m the threshold, at which F is one half, and w the width, over
which F increases from 5 to 95 %. Every shape S has these two parameters, so shapes can be compared. The
coordinate c(x) is x itself, and ln x for Weibull's function: its width is that of ln x.

Source: Wichmann & Hill 2001, Perception & Psychophysics 63; threshold and width as in Schuett, Harmeling,
Macke & Wichmann 2016, Vision Research 122.

The probability of a count of judgements at a level is

    P(k | n, p)      = C(n, k) p^k (1 - p)^(n - k)                      binomial
    P(k | n, p, rho) = C(n, k) B(k + p v, n - k + (1 - p) v) / B(p v, (1 - p) v),    v = (1 - rho) / rho

The beta-binomial distribution is for correlated judgements. Any two judgements of one level have the
correlation rho, and the variance of their count is larger by the factor 1 + (n - 1) rho.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import betaln, expit, gammaln, logit, ndtr, ndtri, xlog1py, xlogy
from scipy.stats import binomtest

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import (
    Finite,
    FiniteVector,
    FloatArray,
    NotNegative,
    Positive,
    choice,
    finite,
    float_array,
    positive,
)

Curve = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Sigmoid:
    """A shape S of the psychometric function."""

    cumulative: Curve
    density: Curve
    quantile: Curve  #: S, its derivative and its inverse.
    logarithmic: bool = False  #: Whether the coordinate is ln x instead of x.

    def coordinate(self, levels: ArrayLike) -> FloatArray:
        """c(x)."""
        return np.log(levels) if self.logarithmic else np.asarray(levels, dtype=np.float64)

    def level(self, coordinate: FloatArray) -> FloatArray:
        """Inverse of c."""
        return np.exp(coordinate) if self.logarithmic else coordinate

    @property
    def half(self) -> float:
        """s_50."""
        return float(self.quantile(np.asarray(0.5)))

    @property
    def stretch(self) -> float:
        """s_95 - s_05, the width of S itself."""
        lower, upper = self.quantile(np.array([0.05, 0.95]))
        return float(upper - lower)

    def argument(self, coordinate: FloatArray, middle: ArrayLike, width: ArrayLike) -> FloatArray:
        """Return the argument of S: s_50 + (s_95 - s_05) (c(x) - c(m)) / w."""
        return self.half + self.stretch * (coordinate - np.asarray(middle)) / np.asarray(width)


def _normal_density(t: FloatArray) -> FloatArray:
    return np.exp(-0.5 * np.square(t)) / np.sqrt(2.0 * np.pi)


def _logistic_density(t: FloatArray) -> FloatArray:
    return expit(t) * expit(-t)


def _gumbel(t: FloatArray) -> FloatArray:
    return -np.expm1(-np.exp(np.minimum(t, _LARGEST_EXPONENT)))


def _gumbel_density(t: FloatArray) -> FloatArray:
    clipped = np.minimum(t, _LARGEST_EXPONENT)
    return np.exp(clipped - np.exp(clipped))


def _gumbel_quantile(share: FloatArray) -> FloatArray:
    return np.log(-np.log1p(-share))


_LARGEST_EXPONENT = 50.0  # Above it the function is 1 in double precision, and exp would overflow.

SIGMOIDS = {
    "normal": Sigmoid(ndtr, _normal_density, ndtri),
    "logistic": Sigmoid(expit, _logistic_density, logit),
    "gumbel": Sigmoid(_gumbel, _gumbel_density, _gumbel_quantile),
    "weibull": Sigmoid(_gumbel, _gumbel_density, _gumbel_quantile, logarithmic=True),
}
"""Shapes by name. Gumbel is that of smallest extremes, 1 - exp(-exp t); Weibull is the same over ln x."""


def proportion(sigmoid: Sigmoid, levels: ArrayLike, parameters: ArrayLike) -> FloatArray:
    """psi(x) of functions; the first axis of `parameters` holds threshold, width, guess and lapse."""
    m, w, gamma, lapse = np.asarray(parameters, dtype=np.float64)
    share = sigmoid.cumulative(sigmoid.argument(sigmoid.coordinate(levels), sigmoid.coordinate(m), w))
    return gamma + (1.0 - gamma - lapse) * share


def level_at(sigmoid: Sigmoid, proportion_correct: ArrayLike, parameters: ArrayLike) -> FloatArray:
    """Inverse of `proportion`: level at which psi has a value; -inf or inf if psi does not reach it."""
    m, w, gamma, lapse = np.asarray(parameters, dtype=np.float64)
    share = np.clip((np.asarray(proportion_correct) - gamma) / (1.0 - gamma - lapse), 0.0, 1.0)
    with np.errstate(divide="ignore"):
        beyond_half = sigmoid.quantile(share) - sigmoid.half
    return sigmoid.level(sigmoid.coordinate(m) + w * beyond_half / sigmoid.stretch)


@value_class
class PsychometricFunction:
    """One psychometric function.

    Examples
    --------
    >>> judged = PsychometricFunction(threshold=319.0, width=80.0, guess=0.5, lapse=0.02)
    >>> judged.predict([287.0, 319.0, 400.0]).round(2).tolist()
    [0.55, 0.74, 0.98]
    >>> round(judged.level_at(0.75), 1)
    320.3
    """

    threshold: Finite  #: Level m at which F is one half. [unit of the levels]
    width: Positive
    """Distance w over which F rises from 5 to 95 %. [unit of the levels; of their logarithm for "weibull"]"""
    guess: Finite = 0.5  #: Rate gamma at levels far below the threshold. [0-1]
    lapse: NotNegative = 0.0  #: Difference lambda of psi to 1 far above the threshold. [0-1]
    sigmoid: Annotated[str, choice(SIGMOIDS)] = "normal"  #: Shape of F.

    def __post_init__(self) -> None:
        check = positive if self.shape.logarithmic else finite
        object.__setattr__(self, "threshold", check("threshold", self.threshold))
        if self.guess + self.lapse >= 1.0:
            raise InputError(
                f"guess and lapse must sum to less than 1: got {self.guess:g} and {self.lapse:g}."
            )

    @property
    def shape(self) -> Sigmoid:
        """The function S."""
        return SIGMOIDS[self.sigmoid]

    @property
    def parameters(self) -> tuple[float, float, float, float]:
        """Threshold, width, guess and lapse."""
        return self.threshold, self.width, self.guess, self.lapse

    def predict(self, levels: ArrayLike) -> FloatArray:
        """Psi (n_levels,) at levels of the stimulus. [0-1]"""
        return proportion(self.shape, checked_levels(levels, self.sigmoid), self.parameters)

    def level_at(self, proportion_correct: Finite | None = None) -> float:
        """Level at which psi has a value. [unit of the levels]

        Parameters
        ----------
        proportion_correct : float, optional
            Between guess and 1 - lapse; by default half-way between them, where the threshold is. [0-1]
        """
        if proportion_correct is None:
            return self.threshold
        if not self.guess < proportion_correct < 1.0 - self.lapse:
            wanted = f"must lie between guess and 1 - lapse, {self.guess:g} ... {1.0 - self.lapse:g}"
            raise InputError("proportion_correct", wanted, f"{proportion_correct:g}")
        return float(level_at(self.shape, proportion_correct, self.parameters))

    def slope(self, proportion_correct: Finite | None = None) -> float:
        """Slope of psi, its derivative by the level, as in `level_at`. [1/unit of the levels]

        Examples
        --------
        >>> steep = PsychometricFunction(threshold=0.0, width=2.0, guess=0.0, sigmoid="logistic")
        >>> round(steep.slope(0.5), 4)
        0.7361
        """
        x = self.level_at(proportion_correct)
        t = self.shape.argument(self.shape.coordinate(x), self.shape.coordinate(self.threshold), self.width)
        per_coordinate = self.shape.density(t) * self.shape.stretch / self.width
        per_level = per_coordinate / x if self.shape.logarithmic else per_coordinate
        return float((1.0 - self.guess - self.lapse) * per_level)


def checked_levels(levels: ArrayLike, sigmoid: str) -> FloatArray:
    """Return levels as an array if they are in the domain of `sigmoid`, else raise `InputError`."""
    checked = float_array("levels", levels, 1)
    if SIGMOIDS[sigmoid].logarithmic and (checked <= 0.0).any():
        said = f"the smallest is {checked.min():g}; shift them, or choose another sigmoid"
        raise InputError("levels", f"must be greater than 0 for {sigmoid!r}", remedy=said)
    return checked


SMALLEST_OVERDISPERSION = 1e-5
"""Below it the beta-binomial formula loses precision and the binomial one is used."""

NEARLY_NEVER = 1e-12  # Proportion that takes the place of 0.
LARGEST_LEVEL = 1e9  # Largest level of a stimulus; the fit loses its digits with far larger numbers.


@value_class
class JudgementCounts:
    """Numbers of judgements at each level that were correct, or "yes".

    Examples
    --------
    >>> JudgementCounts([296.0, 365.0], [58, 95], [100, 100]).proportion.tolist()
    [0.58, 0.95]
    """

    levels: FiniteVector  #: Increasing, (n_levels,). [any unit]
    n_correct: FiniteVector
    n_trials: FiniteVector
    """Whole numbers, (n_levels,)."""

    def __post_init__(self) -> None:
        levels, correct, trials = self.levels, self.n_correct, self.n_trials
        if not levels.size == correct.size == trials.size or levels.size == 0:
            got = f"{levels.size}, {correct.size} and {trials.size}"
            raise InputError(f"levels, n_correct and n_trials must have one entry per level: got {got}.")
        if np.abs(levels).max() > LARGEST_LEVEL:
            raise InputError(
                "levels", f"must lie within {LARGEST_LEVEL:g}", str(levels.tolist()), "change the unit"
            )
        if (np.diff(levels) <= 0.0).any():
            raise InputError("levels", "must increase strictly, each level once", str(levels.tolist()))
        if (correct != np.floor(correct)).any() or (trials != np.floor(trials)).any():
            raise InputError("n_correct and n_trials must be whole numbers: multiply rates by their trials.")
        if (trials < 1.0).any() or (correct < 0.0).any() or (correct > trials).any():
            wanted = "must be at least 1 and n_correct within 0 ... n_trials"
            raise InputError("n_trials", wanted, f"{correct.tolist()} of {trials.tolist()}")

    @property
    def proportion(self) -> FloatArray:
        """n_correct / n_trials."""
        return self.n_correct / self.n_trials


def log_probability(
    n_correct: ArrayLike, n_trials: ArrayLike, proportion: ArrayLike, overdispersion: ArrayLike = 0.0
) -> FloatArray:
    """Logarithm of the probability of a count; all arguments broadcast."""
    k, n = np.asarray(n_correct, dtype=np.float64), np.asarray(n_trials, dtype=np.float64)
    p, rho = np.asarray(proportion, dtype=np.float64), np.asarray(overdispersion, dtype=np.float64)
    ways = gammaln(n + 1.0) - gammaln(k + 1.0) - gammaln(n - k + 1.0)
    if not (rho >= SMALLEST_OVERDISPERSION).any():
        return ways + xlogy(k, p) + xlog1py(n - k, -p)
    v = (1.0 - rho) / np.maximum(rho, SMALLEST_OVERDISPERSION)
    # Both arguments of the beta function must be positive, so 0 and 1 are replaced by close values.
    inside = np.clip(p, NEARLY_NEVER, 1.0 - NEARLY_NEVER)
    return ways + betaln(k + inside * v, n - k + (1.0 - inside) * v) - betaln(inside * v, (1.0 - inside) * v)


def binomial_interval(proportion: ArrayLike, trials: int) -> tuple[FloatArray, FloatArray]:
    """Exact 95 % confidence interval of an observed proportion (Clopper & Pearson 1934)."""
    successes = np.rint(np.asarray(proportion, dtype=np.float64) * trials).astype(np.int64)
    intervals = [binomtest(int(count), trials).proportion_ci(0.95) for count in successes.ravel()]
    low, high = np.moveaxis(np.reshape(intervals, (*successes.shape, 2)), -1, 0)
    return low, high
