"""Likelihood of spike trains under an afferent with a soft threshold (`fingerpad.neuron.escape_rate`).

With the potential u and the width w, both over the threshold,

    log L = sum over spikes of ln h(u) - integral of h over the time outside refractory periods,
    ln h  = (u - 1)/w - ln tau_e.

Given the spikes, u is a sum of the responses to a constant 1, to U' and to U, weighted by the gains:

    u = a X1 + b X2 + c X3,    (a, b, c) = (beta, k_d, k_s)/(C v).

In the parameters A = a/w, B = b/w, C = c/w and G = 1/w, ln h is linear and log L is concave for any given
tau. Its derivatives are computed in the same pass over the data: with the gradient g of ln h,

    gradient    = sum over spikes of g - integral of h g,
    information = integral of h g g',

exact except for the quadrature. The trains are divided once into intervals between knots and spikes.

`fit_spikes` maximises log L by Newton's method with the expected curvature (Fisher scoring) and
Levenberg-Marquardt damping. For a given tau, log L is concave in the other four parameters, so the fit
converges from a distant start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from scipy.stats import kstest

from fingerpad.core.checked import checked, value_class
from fingerpad.core.displayed import Columns, Result
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.random_streams import Presentations
from fingerpad.core.signals import SpikeTrains
from fingerpad.core.threads import in_blocks
from fingerpad.core.units import units_of
from fingerpad.core.values import Count, FiniteArray, FloatArray, Indices, Number, Numbers, Positive, Whole
from fingerpad.data import neuron
from fingerpad.inference.identifiable import (
    N_PARAMETERS,
    SPIKE_PARAMETER_NAMES,
    canonical,
    canonical_jacobian,
    checked_spike_parameters,
    from_canonical,
    six_parameters,
)
from fingerpad.inference.rate_model import Rates
from fingerpad.inference.recordings import check_trains
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.escape_rate import ESCAPE_TIME_MS, NODES, WEIGHTS, EscapeRate, panels
from fingerpad.neuron.spikes import Windows, firing_rate_hz
from fingerpad.neuron.transduction import Drive


@njit(cache=True, error_model="numpy", nogil=True)
def cut(
    times: FloatArray,
    rates: FloatArray,
    seds: FloatArray,
    sites: np.ndarray,
    ends: FloatArray,
    spikes: FloatArray,
    offsets: np.ndarray,
    refractory: float,
) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """Divide trains into intervals without knots or spikes inside, without refractory periods."""
    most = sites.size * (times.size + 1) + 2 * spikes.size
    values = np.empty((most, 5))
    flags = np.zeros((most, 2), dtype=np.bool_)
    firsts = np.zeros(sites.size + 1, dtype=np.int64)
    count = 0
    for train in range(sites.size):
        site, spike, time = sites[train], offsets[train], times[0]
        values[count] = 0.0, rates[0, site], rates[0, site], seds[0, site], seds[0, site]
        flags[count, 0] = True
        fresh = False
        count += 1
        for knot in range(times.size - 1):
            first, last = times[knot], min(times[knot + 1], ends[train])
            while time < last:
                fires = spike < offsets[train + 1] and spikes[spike] <= last
                until = spikes[spike] if fires else last
                if time < until:
                    values[count, 0] = until - time
                    for end in range(2):
                        share = ((until if end else time) - first) / (times[knot + 1] - first)
                        values[count, 1 + end] = rates[knot, site] + share * (
                            rates[knot + 1, site] - rates[knot, site]
                        )
                        values[count, 3 + end] = seds[knot, site] + share * (
                            seds[knot + 1, site] - seds[knot, site]
                        )
                    flags[count, 0], flags[count, 1] = fresh, fires
                    fresh = False
                    count += 1
                time = until
                if fires:
                    time = until + refractory
                    spike += 1
                    fresh = True
        firsts[train + 1] = count
    return values[:count].copy(), flags[:count].copy(), firsts


@njit(cache=True, error_model="numpy", nogil=True)
def accumulate(
    intervals: FloatArray,
    flags: np.ndarray,
    numbers: FloatArray,
    escape: float,
    gradient: FloatArray,
    information: FloatArray,
) -> float:
    """Return log L without the constant ln tau_e of each spike; add to its gradient and information.

    z is the derivative of the potential with respect to ln tau. In x = s/tau it follows dz/dx = u - z, so
    that from z0, and u = p + q x + r e^-x,

        z = z0 e^-x + p g + q (x - g) + r x e^-x,    g = 1 - e^-x.
    """
    a, b, c, sharpness = numbers[0], numbers[1], numbers[2], numbers[3]
    tau = math.exp(numbers[4])
    value = 0.0
    x1 = x2 = x3 = z = 0.0
    slopes = np.empty(5)
    slopes[3] = -1.0
    for n in range(intervals.shape[0]):
        if flags[n, 0]:
            x1 = x2 = x3 = z = 0.0
        length = intervals[n, 0] / tau
        if length == 0.0:  # at rest, as `initial_potentials` of the exact spikes
            rest = a * tau + b * tau * intervals[n, 1] + c * tau * intervals[n, 3]
            if rest < sharpness:
                x1, x2, x3, z = tau, tau * intervals[n, 1], tau * intervals[n, 3], rest
            continue
        w2, w3 = tau * intervals[n, 1], tau * intervals[n, 3]
        drift2 = (tau * intervals[n, 2] - w2) / length
        drift3 = (tau * intervals[n, 4] - w3) / length
        u = a * x1 + b * x2 + c * x3
        q = b * drift2 + c * drift3
        p = a * tau + b * w2 + c * w3 - q
        r = u - p
        n_panels = panels(length, u, p + q, q, 1.0)
        scale = length / n_panels * tau / escape
        for panel in range(n_panels):
            for node in range(5):
                x = length * (panel + NODES[node]) / n_panels
                gone = -math.expm1(-x)
                lag = x - gone
                slopes[0] = x1 + (tau - x1) * gone
                slopes[1] = x2 + (w2 - x2) * gone + drift2 * lag
                slopes[2] = x3 + (w3 - x3) * gone + drift3 * lag
                slopes[4] = z + (p - z) * gone + q * lag + r * x * (1.0 - gone)
                log_hazard = a * slopes[0] + b * slopes[1] + c * slopes[2] - sharpness
                expected = scale * WEIGHTS[node] * math.exp(log_hazard)
                value -= expected
                for i in range(5):
                    weighted = expected * slopes[i]
                    gradient[i] -= weighted
                    for j in range(i, 5):
                        information[i, j] += weighted * slopes[j]
            if value == -math.inf:  # impossible parameters, for which further panels are costly
                return value
        gone = -math.expm1(-length)
        lag = length - gone
        z = z + (p - z) * gone + q * lag + r * length * (1.0 - gone)
        x1 = x1 + (tau - x1) * gone
        x2 = x2 + (w2 - x2) * gone + drift2 * lag
        x3 = x3 + (w3 - x3) * gone + drift3 * lag
        if flags[n, 1]:
            value += a * x1 + b * x2 + c * x3 - sharpness
            slopes[0], slopes[1], slopes[2], slopes[4] = x1, x2, x3, z
            gradient += slopes
    return value


@njit(cache=True, error_model="numpy", nogil=True)
def operational_times(
    intervals: FloatArray, flags: np.ndarray, numbers: FloatArray, escape: float
) -> FloatArray:
    """Integral of the hazard up to the end of each interval with a spike."""
    found = np.empty(flags[:, 1].sum())
    gradient, information = np.zeros(5), np.zeros((5, 5))
    count, first = 0, 0
    for n in range(intervals.shape[0]):
        if flags[n, 1]:
            accumulate(intervals[first : n + 1], flags[first : n + 1], numbers, escape, gradient, information)
            first = n + 1
            count += 1
            # d log L/dG is the integral minus one for each spike.
            found[count - 1] = gradient[3] + count
    return found


_TRAINS_PER_BLOCK = 8
"""Trains that one thread evaluates at a time; sums are taken block by block on any number of threads."""


@value_class
class SpikeLikelihood:
    """Likelihood of parameters, given spike trains of one afferent under known drives.

    Examples
    --------
    Without a stimulus, with an intercept that keeps the potential at the threshold: 1 spike per tau_e.

    >>> nothing = Drive([0.0, 1e4], [[0.0], [0.0]], [[0.0], [0.0]])
    >>> recorded = SpikeLikelihood(nothing, SpikeTrains.from_lists([[9000.0]]))
    >>> round(recorded.log_likelihood([10.0, 0.0, 0.0, 0.1, 1.0]), 1)
    -9998.8
    """

    drive: Drive  #: Strain energy density U and its rate U' at each stimulus, one column per stimulus.
    trains: SpikeTrains  #: One train per presentation. [ms]
    sites: Indices | None = None  #: Column of the drive of each train. Default: in order, (n_trains,).
    duration_ms: FiniteArray | None = None
    """End of each recording. Default: the end of the drive, (n_trains,). [ms]"""
    refractory_ms: Positive = neuron.REFRACTORY.value  #: Refractory period, which is not fitted. [ms]
    escape_ms: Positive = ESCAPE_TIME_MS  #: tau_e, a convention. [ms]
    _intervals: tuple[FloatArray, np.ndarray, np.ndarray] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        n_trains, times = len(self.trains), self.drive.times_ms
        sites = np.arange(n_trains) if self.sites is None else self.sites
        if sites.shape != (n_trains,) or (
            n_trains and not 0 <= sites.min() <= sites.max() < self.drive.n_sites
        ):
            raise InputError(
                "sites",
                f"must name one of {self.drive.n_sites} columns of the drive for each of {n_trains} "
                "trains, from 0",
                str(sites),
            )
        given = times[-1] if self.duration_ms is None else self.duration_ms
        ends = np.broadcast_to(given, n_trains)
        if n_trains and (ends.min() <= times[0] or ends.max() > times[-1]):
            raise InputError(
                "duration_ms", f"must lie within the drive, {times[0]:g} ... {times[-1]:g} ms", str(given)
            )
        check_trains(self.trains, times[0], ends, self.refractory_ms)
        driven = self.drive.rate_per_ms, self.drive.values
        spikes = self.trains.times_ms, self.trains.offsets
        intervals = cut(times, *driven, sites, ends, *spikes, self.refractory_ms)
        for name, value in (("sites", sites), ("duration_ms", ends), ("_intervals", intervals)):
            object.__setattr__(self, name, value)

    @property
    def n_spikes(self) -> int:
        """Number of spikes in all trains."""
        return self.trains.times_ms.size

    def log_likelihood(self, parameters: ArrayLike) -> float:
        """Logarithm of the likelihood.

        Parameters
        ----------
        parameters : array_like (5,)
            beta/(C v) [1/ms], k_d/(C v) [1/kPa], k_s/(C v) [1/(kPa ms)], tau [ms] and the width of the
            threshold over the threshold [1].
        """
        return self.derivatives(parameters)[0]

    def derivatives(self, parameters: ArrayLike) -> tuple[float, FloatArray, FloatArray]:
        """Logarithm of the likelihood, its gradient, and the Fisher information.

        Returns
        -------
        value : float
        gradient : array (5,)
            With respect to the parameters, per unit of each.
        information : array (5, 5)
            Fisher information given the spikes; its inverse estimates the covariance of a fit.
        """
        natural = checked_spike_parameters(parameters)
        value, gradient, information = self.canonical_derivatives(canonical(natural))
        jacobian = canonical_jacobian(natural)
        return value, jacobian.T @ gradient, jacobian.T @ information @ jacobian

    def canonical_derivatives(self, numbers: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Return the same in the parameters (A, B, C, G, ln tau) of fits, without checks."""

        def block(trains: slice) -> tuple[float, FloatArray, FloatArray]:
            gradient, information = np.zeros(N_PARAMETERS), np.zeros((N_PARAMETERS, N_PARAMETERS))
            value = accumulate(*self._part(trains), numbers, float(self.escape_ms), gradient, information)
            return value, gradient, information

        blocks = in_blocks(block, len(self.trains), _TRAINS_PER_BLOCK)
        value = math.fsum(part[0] for part in blocks) - self.n_spikes * math.log(self.escape_ms)
        gradient = np.sum([part[1] for part in blocks], axis=0)
        half = np.sum([part[2] for part in blocks], axis=0)
        return value, gradient, half + np.triu(half, 1).T

    def operational_times(self, parameters: ArrayLike) -> FloatArray:
        """Integral (n_spikes,) of the hazard up to each spike, over all trains in sequence.

        Under the true parameters these are the events of a Poisson process of rate 1: their differences are
        independent and exponential with mean 1, also across the ends of recordings.
        """
        numbers = canonical(checked_spike_parameters(parameters))
        return operational_times(*self._part(slice(0, len(self.trains))), numbers, float(self.escape_ms))

    def _part(self, trains: slice) -> tuple[FloatArray, np.ndarray]:
        values, flags, offsets = self._intervals
        intervals = slice(offsets[trains.start], offsets[trains.stop])
        return values[intervals], flags[intervals]


@dataclass(frozen=True)
class TimeRescaling:
    """Goodness-of-fit test of spikes by the time-rescaling theorem (Brown et al. 2002)."""

    quantiles: FloatArray
    """1 - exp(-rescaled interval) of each interval, sorted: uniform under the model, (n_spikes,)."""
    statistic: float  #: Kolmogorov-Smirnov distance between their distribution and the uniform one.
    p_value: float
    """Probability of a larger distance under the true parameters; for fitted ones it is too large."""


@checked
def time_rescaling(recorded: SpikeLikelihood, parameters: ArrayLike) -> TimeRescaling:
    """Test a model on spike trains.

    Parameters
    ----------
    recorded : SpikeLikelihood
        The trains.
    parameters : array_like (5,)
        As in `SpikeLikelihood.log_likelihood`.

    Examples
    --------
    >>> nothing = Drive([0.0, 9.0], [[0.0], [0.0]], [[0.0], [0.0]])
    >>> recorded = SpikeLikelihood(nothing, SpikeTrains.from_lists([[1.0, 3.0, 5.5]]), refractory_ms=1e-9)
    >>> time_rescaling(recorded, [100.0, 0.0, 0.0, 0.01, 1.0]).quantiles.round(2).tolist()
    [0.63, 0.86, 0.92]
    """
    if recorded.n_spikes == 0:
        raise InputError("time_rescaling", "needs at least one spike", "none")
    intervals = np.diff(recorded.operational_times(parameters), prepend=0.0)
    quantiles = np.sort(-np.expm1(-intervals))
    test = kstest(quantiles, "uniform")
    return TimeRescaling(quantiles, float(test.statistic), float(test.pvalue))


NARROWEST = 1.0e-3  # Width below which the threshold is considered hard and log L unbounded.
SMALLEST_GAIN = 1.0e-6  # A fit ends when the predicted gain of log L of a step is at most this.

_FIRST_DAMPING, _MOST_DAMPING = 1.0e-3, 1.0e12
_LONGEST_STEP_OF_LOG_TAU = 1.0


@value_class
class SpikeFit(Result):
    """Maximum-likelihood parameters and their covariance."""

    parameters: FloatArray  #: In the order of `fingerpad.inference.identifiable.SPIKE_PARAMETER_NAMES`, (5,).
    covariance: FloatArray  #: Inverse of the Fisher information, (5, 5).
    log_likelihood: Number  #: At the parameters.
    n_spikes: Whole  #: In all trains.
    history: Numbers  #: log L at the start and after each step.

    def __repr__(self) -> str:
        (memory_ms, width), (memory_error, width_error) = self.parameters[3:], self.standard_errors[3:]
        return (
            f"SpikeFit({self.n_spikes} spikes, log L = {self.log_likelihood:.4g}, time constant "
            f"{memory_ms:.3g} ± {memory_error:.1g} ms, threshold width {width:.2g} ± {width_error:.1g})"
        )

    def columns(self) -> Columns:
        """Value, standard error and unit, by parameter."""
        return {
            "parameter": self.names,
            "value": self.parameters,
            "standard_error": self.standard_errors,
            "unit": list(units_of(self.names).values()),
        }

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return SPIKE_PARAMETER_NAMES

    @property
    def standard_errors(self) -> FloatArray:
        """Square roots of the variances (5,), in the units of the parameters."""
        return np.sqrt(np.diag(self.covariance))


@checked
def fit_spikes(recorded: SpikeLikelihood, start: ArrayLike, most_steps: Count = 100) -> SpikeFit:
    """Fit parameters to recorded spikes by maximum likelihood.

    Parameters
    ----------
    recorded : SpikeLikelihood
        The spikes and their drives.
    start : array_like (5,)
        Start, in the order of `SPIKE_PARAMETER_NAMES`; a wide threshold (0.5) is robust.
    most_steps : int, optional
        Largest number of steps.

    Raises
    ------
    ConvergenceError
        If the fit does not converge or has no maximum: perfectly regular spikes determine no width, and equal
        stimuli do not determine all gains.

    Examples
    --------
    `tests/test_estimation_spikes.py` recovers an afferent from its own spikes.
    """
    if recorded.n_spikes < N_PARAMETERS:
        raise InputError(
            f"a fit of {N_PARAMETERS} parameters needs at least as many spikes: got {recorded.n_spikes}."
        )
    here = canonical(checked_spike_parameters(start))
    value = recorded.canonical_derivatives(here)[0]
    if not np.isfinite(value):
        raise InputError(
            "start", "must make the spikes possible", remedy=f"log L is {value}; take a wider threshold"
        )
    history = [value]
    # Far from the maximum, steps of tau are unreliable: fit the four concave parameters first.
    for free in (slice(0, 4), slice(0, N_PARAMETERS)):
        here, information = _maximise(recorded, here, free, history, most_steps)
    parameters = from_canonical(here)
    to_natural = np.linalg.inv(canonical_jacobian(parameters))
    covariance = to_natural @ np.linalg.inv(information) @ to_natural.T
    return SpikeFit(parameters, covariance, history[-1], recorded.n_spikes, tuple(history))


def _maximise(
    recorded: SpikeLikelihood, start: FloatArray, free: slice, history: list[float], most_steps: int
) -> tuple[FloatArray, FloatArray]:
    """Maximise log L in the free parameters; append each value to the history."""
    here = start
    value, gradient, information = recorded.canonical_derivatives(here)
    damping = _FIRST_DAMPING
    for _ in range(most_steps):
        slopes, curvature = gradient[free], information[free, free]
        if _promised_gain(slopes, curvature, history) <= SMALLEST_GAIN:
            return here, information
        while True:
            there = here.copy()
            step = np.linalg.solve(curvature + damping * np.diag(np.diag(curvature)), slopes)
            step *= min(1.0, _LONGEST_STEP_OF_LOG_TAU / max(np.abs(step[4:]).max(initial=0.0), 1e-300))
            there[free] += step
            if there[3] > 0.0:
                trial = recorded.canonical_derivatives(there)
                if np.isfinite(trial[0]) and trial[0] > value:
                    break
            damping *= 10.0
            if damping > _MOST_DAMPING:
                raise ConvergenceError(
                    "fit_spikes found no step that raises log L: give another start=.", _lines(history)
                )
        here, (value, gradient, information) = there, trial
        damping = max(0.1 * damping, 1e-12)
        history.append(value)
        if here[3] > 1.0 / NARROWEST:
            raise ConvergenceError(
                f"fit_spikes made the threshold narrower than {NARROWEST:g}: the spikes are too regular to "
                "determine its width; fit rates instead.",
                _lines(history),
            )
    raise ConvergenceError(
        f"fit_spikes has not converged after {most_steps} steps: give more, most_steps={10 * most_steps}.",
        _lines(history),
    )


def _promised_gain(gradient: FloatArray, information: FloatArray, history: list[float]) -> float:
    """Return the gain of log L of a full step in the quadratic approximation, g' J^-1 g / 2."""
    scale = np.sqrt(np.diag(information))
    # Scaled to a unit diagonal, the condition number shows whether the information can be inverted.
    known = bool((scale > 0.0).all()) and np.isfinite(information).all()
    scaled = information / np.outer(scale, scale) if known else information
    if not known or np.linalg.cond(scaled) > 1.0 / np.finfo(np.float64).eps:
        raise ConvergenceError(
            "fit_spikes needs spikes that determine all parameters: these do not; record more, or more "
            "different, stimuli.",
            _lines(history),
        )
    slopes = gradient / scale
    return 0.5 * float(slopes @ np.linalg.solve(scaled, slopes))


def _lines(history: list[float]) -> tuple[str, ...]:
    return tuple(f"step {number}: log L = {value:.6g}" for number, value in enumerate(history))


PREDICTED_PRESENTATIONS = 20
"""Presentations whose mean is the predicted rate of an afferent with a soft threshold."""


def soft_spikes(
    driven: Drive, parameters: FloatArray, presentations: Presentations, seed: int
) -> SpikeTrains:
    """Simulate the spikes of an afferent with a soft threshold."""
    afferent = Afferent.from_parameters(six_parameters(parameters[:4]))
    membrane = EscapeRate(afferent.membrane, float(parameters[4]))
    return membrane.spikes(afferent.transduction.current(driven), seed, presentations)


@dataclass(frozen=True)
class SoftAfferent:
    """Mean rates of an afferent with a soft threshold; a `RateModel` in the five parameters of its spikes."""

    drive: Drive  #: One column per stimulus.
    windows_ms: Windows  #: Windows of the dynamic and of the static rate. [ms]
    seed: int  #: Seed of the simulated presentations, the same for all parameters.

    @property
    def n_stimuli(self) -> int:
        return self.drive.n_sites

    def evaluate(self, parameters: FloatArray) -> Rates:
        """Dynamic and static rates, means of simulated presentations. [spikes/s]"""
        presentations = Presentations.of_one_afferent(self.n_stimuli, PREDICTED_PRESENTATIONS)
        trains = soft_spikes(self.drive, parameters, presentations, self.seed)
        dynamic, static = (
            np.bincount(presentations.sites, firing_rate_hz(trains, window)) / PREDICTED_PRESENTATIONS
            for window in self.windows_ms
        )
        return dynamic, static
