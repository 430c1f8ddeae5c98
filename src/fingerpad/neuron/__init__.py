"""Transduction, membrane, noise, spikes, afferents, populations and their response maps."""

from fingerpad.neuron.end_organs import EndOrgans
from fingerpad.neuron.escape_rate import EscapeRate
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.neuron.population import sensitivities
from fingerpad.neuron.response_maps import (
    evoked_latency_ms,
    order_change,
    population_rate,
    recruited,
    recruitment_rank,
    rings,
)
from fingerpad.neuron.transduction import Transduction, drive
from fingerpad.neuron.tuning import tuning_curve

__all__ = [
    "EndOrgans", "EscapeRate", "LeakyIntegrateAndFire", "Transduction", "drive", "evoked_latency_ms",
    "order_change", "population_rate", "recruited", "recruitment_rank", "rings", "sensitivities",
    "tuning_curve",
]  # fmt: skip
