"""Transduction, membrane, noise, spikes, afferents, and populations of them."""

from fingerpad.neuron.afferent_types import afferent_of
from fingerpad.neuron.end_organs import EndOrgans
from fingerpad.neuron.escape_rate import EscapeRate
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.neuron.population import sensitivities
from fingerpad.neuron.transduction import Transduction, drive
from fingerpad.neuron.tuning import tuning_curve

__all__ = [
    "EndOrgans", "EscapeRate", "LeakyIntegrateAndFire", "Transduction", "afferent_of", "drive",
    "sensitivities", "tuning_curve",
]  # fmt: skip
