"""An afferent with a soft threshold in the five parameters that spikes determine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.random_streams import Presentations
from fingerpad.core.signals import SpikeTrains, Traces
from fingerpad.inference.identifiable import six_parameters
from fingerpad.inference.rate_model import Rates, evaluate_rows
from fingerpad.inference.spike_parameters import SPIKE_PARAMETER_NAMES
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.escape_rate import EscapeRate
from fingerpad.neuron.rate_windows import Windows
from fingerpad.neuron.spikes import firing_rate_hz
from fingerpad.neuron.transduction import Drive

PREDICTED_PRESENTATIONS = 20
"""Presentations whose mean is the predicted rate of an afferent with a soft threshold."""


def soft_membrane(driven: Drive, parameters: FloatArray) -> tuple[EscapeRate, Traces]:
    """Return the membrane and the current of an afferent with a soft threshold."""
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

    drive: Drive
    """One column per stimulus."""
    windows_ms: Windows
    """Windows of the dynamic and of the static rate. [ms]"""
    seed: int
    """Seed of the simulated presentations, the same for all parameters."""

    @property
    def names(self) -> tuple[str, ...]:
        """The four identifiable parameters and the width of the threshold."""
        return SPIKE_PARAMETER_NAMES

    @property
    def n_stimuli(self) -> int:
        """Number of columns of the drive."""
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

    def evaluate_batch(self, points: FloatArray) -> Rates:
        """Rates (n_points, n_stimuli) for rows of parameters, bit-equal to `evaluate`. [spikes/s]"""
        return evaluate_rows(self, points)
