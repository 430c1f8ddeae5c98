"""Bounds and scales of the parameters of a fit, and points spread between the bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from fingerpad.core.checks import FloatArray, float_array
from fingerpad.core.errors import InputError


@dataclass(frozen=True)
class Bounds:
    """Bounds and scales of the parameters of a fit."""

    scales: FloatArray
    """Typical changes of the parameters, the units of the steps of a method, (n_parameters,)."""
    low: FloatArray = -np.inf  # type: ignore[assignment]
    high: FloatArray = np.inf  # type: ignore[assignment]
    """Limits; -inf and inf for none, (n_parameters,)."""

    def __post_init__(self) -> None:
        scales = float_array("scales", self.scales, 1)
        low, high = (np.broadcast_to(side, scales.shape) for side in (self.low, self.high))
        if (scales <= 0.0).any() or not (low < high).all():
            raise InputError(
                "Bounds need scales above 0 and lower limits below the upper ones: "
                f"got scales {scales.tolist()}, limits {low.tolist()} and {high.tolist()}."
            )
        for name, value in (("scales", scales), ("low", low), ("high", high)):
            object.__setattr__(self, name, value)

    def and_one(self, scale: float, low: float, high: float) -> Bounds:
        """Return the bounds of the same parameters and one more."""
        further = ((self.scales, scale), (self.low, low), (self.high, high))
        return Bounds(*(np.append(side, entry) for side, entry in further))

    def spread(self, number: int) -> FloatArray:
        """Points of a Halton sequence between the bounds, (number, n_parameters); deterministic."""
        return self.low + halton(number, self.scales.size) * (self.high - self.low)

    def rows(self, name: str, points: ArrayLike) -> FloatArray:
        """Return points (n_points, n_parameters), or raise `InputError` if they have other parameters."""
        rows = float_array(name, points, 2)
        if rows.shape[1:] != self.scales.shape:
            raise InputError(
                f"{name} must have one entry per scale: got {rows.shape[1]} for {self.scales.size}."
            )
        return rows


def halton(number: int, dimensions: int) -> FloatArray:
    """Return points of a Halton sequence in the unit cube, (number, dimensions); deterministic."""
    points: FloatArray = qmc.Halton(dimensions, scramble=False).random(number + 1)
    return points[1:]  # the first is a corner
