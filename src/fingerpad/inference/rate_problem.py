"""Firing rates to be fitted: a model of an afferent under known stimuli, and the rates that were observed.

The model is one small contract, so that its variants are short: the paper's six parameters, other numbers
that stand for them, a receptor whose place is not known, another dynamic response.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fingerpad.core.checks import FloatArray, not_negative
from fingerpad.core.errors import InputError
from fingerpad.data import neuron, protocol
from fingerpad.inference.fitting import fractional_sum_of_squares
from fingerpad.inference.fitting.problem import IntArray
from fingerpad.inference.quick_rates import rates_under
from fingerpad.inference.recordings import RateRecordings
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.neuron.transduction import Drive


class RateModel(Protocol):
    """Anything that predicts the dynamic and static rate under every stimulus from a few numbers."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in their order."""
        ...

    @property
    def n_stimuli(self) -> int:
        """Number of stimuli."""
        ...

    def rates(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Dynamic and static rates, (n_stimuli,) each. [spikes/s]"""
        ...


class SmoothRateModel(RateModel, Protocol):
    """A model of rates that knows its slopes."""

    def slopes(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Slopes of dynamic and static rates along the parameters, (n_stimuli, n_parameters) each."""
        ...


@dataclass(frozen=True)
class AfferentModel:
    """The paper's model: one afferent, its six parameters free.

    Parameters
    ----------
    drive : Drive
        Strain energy density and its rate of change, or that of what the dynamic term follows instead, one
        column per stimulus.
    refractory_ms : float
        Rest after each spike, which is not fitted. [ms]

    Examples
    --------
    >>> from fingerpad.neuron.afferent import Afferent
    >>> from fingerpad.core.signals import SedTraces
    >>> from fingerpad.neuron.transduction import drive
    >>> sed = SedTraces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> dynamic_hz, static_hz = AfferentModel(drive(sed)).rates(Afferent().parameters)
    >>> dynamic_hz.round().tolist(), static_hz.round().tolist()
    ([217.0], [63.0])
    """

    drive: Drive
    refractory_ms: float = neuron.REFRACTORY.value

    def __post_init__(self) -> None:
        not_negative("refractory_ms", self.refractory_ms, "ms")

    @property
    def names(self) -> tuple[str, ...]:
        """beta, k_d, k_s, tau, C, v under their full names."""
        return PARAMETER_NAMES

    @property
    def n_stimuli(self) -> int:
        """Number of columns of the drive."""
        return self.drive.n_sites

    def rates(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Dynamic and static rates of the afferent with these six parameters. [spikes/s]"""
        return rates_under(self.drive, self.refractory_ms)(parameters)


@dataclass(frozen=True)
class Reparametrised:
    """The same model in other numbers.

    Parameters
    ----------
    model : RateModel
        What predicts.
    names : tuple of str
        Names of the new parameters.
    translated : callable
        From the new parameters to those of `model`.

    Examples
    --------
    A model that has only its static gain free:

    >>> from fingerpad.core.signals import SedTraces
    >>> from fingerpad.neuron.transduction import drive
    >>> sed = SedTraces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> model = Reparametrised(
    ...     AfferentModel(drive(sed)),
    ...     ("static_gain",),
    ...     lambda gain: np.array([0.0, 1e-4, gain[0], 70.0, 1e-6, 50.0]),
    ... )
    >>> [model.rates(np.array([gain]))[1].round().tolist() for gain in (5e-7, 2e-6)]
    [[11.0], [68.0]]
    """

    model: RateModel
    names: tuple[str, ...]
    translated: Callable[[FloatArray], FloatArray]

    @property
    def n_stimuli(self) -> int:
        """Number of stimuli."""
        return self.model.n_stimuli

    def rates(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Dynamic and static rates. [spikes/s]"""
        return self.model.rates(self.translated(parameters))


@dataclass(frozen=True)
class RateProblem:
    """Observed rates under some stimuli and the model that is to predict them.

    Parameters
    ----------
    model : RateModel
        Predicts the rates under all stimuli, in the order of the recordings.
    recordings : RateRecordings
        Observed rates. A phase that was not recorded has no part in the score.
    dynamic_weight, static_weight : float
        Weights of the two phases where both were recorded, Eq. 12. [1]

    Raises
    ------
    InputError
        If model and recordings differ in the number of stimuli, or a weight is negative.

    Notes
    -----
    Gerling et al. 2014, Eqs. 12-14. The sums run over the chosen stimuli.

    Examples
    --------
    >>> from fingerpad.neuron.afferent import Afferent
    >>> from fingerpad.core.signals import SedTraces
    >>> from fingerpad.neuron.transduction import drive
    >>> sed = SedTraces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> problem = RateProblem(AfferentModel(drive(sed)), RateRecordings(("flat",), [217.0], [126.0]))
    >>> round(problem.score(Afferent().parameters, np.array([0])), 2)  # static rates half as observed
    0.81
    """

    model: RateModel
    recordings: RateRecordings
    dynamic_weight: float = protocol.DYNAMIC_WEIGHT.value
    static_weight: float = protocol.STATIC_WEIGHT.value

    def __post_init__(self) -> None:
        observed = len(self.recordings.stimuli)
        if observed != self.model.n_stimuli:
            raise InputError(
                "recordings needs one stimulus per column of the model's drive: "
                f"got {observed} for {self.model.n_stimuli}."
            )
        not_negative("dynamic_weight", self.dynamic_weight)
        not_negative("static_weight", self.static_weight)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the model's parameters."""
        return self.model.names

    @property
    def n_observations(self) -> int:
        """Number of stimuli, whether one or two rates were recorded under each."""
        return self.model.n_stimuli

    def residuals(self, parameters: FloatArray, chosen: IntArray) -> FloatArray:
        """Differences of the recorded phases, scaled so that FSS = 1 - residuals @ residuals.

        r_i = sqrt(w / sum f^2) (f_i - p_i), with the weight w, observed f and predicted p of each phase.
        """
        return np.concatenate(
            [
                np.sqrt(weight / (observed @ observed)) * (observed - predicted)
                for weight, observed, predicted in self._phases(parameters, chosen)
            ]
        )

    def jacobian_of(self, model: SmoothRateModel) -> Callable[[FloatArray, IntArray], FloatArray]:
        """Slopes of the residuals if `model` predicted, as a function; (n_residuals, n_parameters)."""

        def jacobian(parameters: FloatArray, chosen: IntArray) -> FloatArray:
            return np.concatenate(
                [
                    -np.sqrt(weight / (observed @ observed)) * slopes[chosen]
                    for weight, observed, slopes in self._recorded(chosen, model.slopes(parameters))
                ]
            )

        return jacobian

    def score(self, parameters: FloatArray, chosen: IntArray) -> float:
        """FSS of Eqs. 12-14 over the chosen stimuli, weighted where both phases were recorded."""
        return self.score_of(self.model.rates(parameters), chosen)

    def score_of(self, rates: tuple[FloatArray, FloatArray], chosen: IntArray) -> float:
        """FSS over the chosen stimuli of dynamic and static rates that were predicted before."""
        return sum(
            weight * fractional_sum_of_squares(observed, predicted[chosen])
            for weight, observed, predicted in self._recorded(chosen, rates)
        )

    def score_by_phase(self, parameters: FloatArray, chosen: IntArray) -> dict[str, float]:
        """FSS of "dynamic" and "static" rates by themselves, of those that were recorded (Eqs. 13, 14)."""
        scores = (
            fractional_sum_of_squares(observed, predicted)
            for _, observed, predicted in self._phases(parameters, chosen)
        )
        return dict(zip(self.recordings.phases, scores, strict=True))

    def _phases(
        self, parameters: FloatArray, chosen: IntArray
    ) -> Iterator[tuple[float, FloatArray, FloatArray]]:
        """Weight, observed and predicted rates of each phase that was recorded."""
        for weight, observed, predicted in self._recorded(chosen, self.model.rates(parameters)):
            yield weight, observed, predicted[chosen]

    def _recorded(
        self, chosen: IntArray, of_phases: tuple[FloatArray, FloatArray]
    ) -> Iterator[tuple[float, FloatArray, FloatArray]]:
        """Weight and observed rates of each phase that was recorded, with what is given for it."""
        alone = len(self.recordings.phases) == 1
        weights = (self.dynamic_weight, self.static_weight)
        observed = (self.recordings.dynamic_rate_hz, self.recordings.static_rate_hz)
        for weight, rates, given in zip(weights, observed, of_phases, strict=True):
            if rates is not None:
                yield 1.0 if alone else weight, rates[chosen], given
