"""Observations to judge results by; no model reads them on its own."""

from fingerpad.reference.observations import (
    BarObservations,
    DeflectionObservations,
    HitRateObservations,
    bar_firing_rates,
    cylinder_deflection,
    goodwin_hit_rates,
)

__all__ = [
    "BarObservations",
    "DeflectionObservations",
    "HitRateObservations",
    "bar_firing_rates",
    "cylinder_deflection",
    "goodwin_hit_rates",
]
