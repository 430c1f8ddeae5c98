"""Fit an afferent with a soft threshold to spike trains by maximum likelihood.

Newton's method with the expected curvature (Fisher scoring) and Levenberg-Marquardt damping, in the
parameters (A, B, C, G, ln tau) of `fingerpad.inference.identifiable`. For a given tau, log L is concave in
the other four, so the fit converges from a distant start.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked, value_class
from fingerpad.core.displayed import Columns, Result
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.random_streams import Presentations
from fingerpad.core.signals import SpikeTrains, Traces
from fingerpad.core.units import units_of
from fingerpad.core.values import Count, FloatArray, Number, Numbers, Whole
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
from fingerpad.inference.spike_likelihood import SpikeLikelihood
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.escape_rate import EscapeRate
from fingerpad.neuron.spikes import Windows, firing_rate_hz
from fingerpad.neuron.transduction import Drive

NARROWEST = 1.0e-3  # Width below which the threshold is considered hard and log L unbounded.
SMALLEST_GAIN = 1.0e-6  # A fit ends when the predicted gain of log L of a step is at most this.

_FIRST_DAMPING, _MOST_DAMPING = 1.0e-3, 1.0e12
_LONGEST_STEP_OF_LOG_TAU = 1.0


@value_class
class SpikeFit(Result):
    """Maximum-likelihood parameters and their covariance."""

    parameters: FloatArray  # In the order of `fingerpad.inference.identifiable.SPIKE_PARAMETER_NAMES`, (5,).
    covariance: FloatArray  # Inverse of the Fisher information, (5, 5).
    log_likelihood: Number  # At the parameters.
    n_spikes: Whole  # In all trains.
    history: Numbers  # log L at the start and after each step.

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
    return _finished(recorded, here, information, history)


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


def _finished(
    recorded: SpikeLikelihood, numbers: FloatArray, information: FloatArray, history: list[float]
) -> SpikeFit:
    parameters = from_canonical(numbers)
    to_natural = np.linalg.inv(canonical_jacobian(parameters))
    return SpikeFit(
        parameters=parameters,
        covariance=to_natural @ np.linalg.inv(information) @ to_natural.T,
        log_likelihood=history[-1],
        n_spikes=recorded.n_spikes,
        history=tuple(history),
    )


def _lines(history: list[float]) -> tuple[str, ...]:
    return tuple(f"step {number}: log L = {value:.6g}" for number, value in enumerate(history))


PREDICTED_PRESENTATIONS = 20
"""Presentations whose mean is the predicted rate of an afferent with a soft threshold."""


def soft_membrane(driven: Drive, parameters: FloatArray) -> tuple[EscapeRate, Traces]:
    afferent = Afferent.from_parameters(six_parameters(parameters[:4]))
    return EscapeRate(afferent.membrane, float(parameters[4])), afferent.transduction.current(driven)


def soft_spikes(
    driven: Drive, parameters: FloatArray, presentations: Presentations, seed: int
) -> SpikeTrains:
    """Simulate the spikes of an afferent with a soft threshold."""
    membrane, current = soft_membrane(driven, parameters)
    return membrane.spikes(current, seed, presentations)


@dataclass(frozen=True)
class SoftAfferent:
    """Mean rates of an afferent with a soft threshold; a `RateModel` in the five parameters of its spikes."""

    drive: Drive  # One column per stimulus.
    windows_ms: Windows  # Windows of the dynamic and of the static rate. [ms]
    seed: int  # Seed of the simulated presentations, the same for all parameters.

    @property
    def names(self) -> tuple[str, ...]:
        """The four identifiable parameters and the width of the threshold."""
        return SPIKE_PARAMETER_NAMES

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
