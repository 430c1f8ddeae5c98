"""Several end organs per afferent: an RA or SAI fibre branches and ends at several places of the skin."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import Purpose, uniforms
from fingerpad.core.regions import Place
from fingerpad.core.signals import Traces
from fingerpad.core.values import Check, Count, FiniteArray, FloatArray, Positive, Whole, choice, float_array

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
_SUM_TOLERANCE = 1e-6


@value_class
class EndOrgans:
    """Positions and weights of the end organs of every afferent.

    What the afferent follows is the weighted sum of what its end organs follow, or what the strongest of them
    follows, as if the branch that first elicits a spike resets the others.

    Examples
    --------
    >>> ends = EndOrgans([[[17.0, 0.0], [18.0, 0.0]]], weights=[0.75, 0.25])
    >>> ends.combined(Traces([0.0, 50.0], [[0.0, 0.0], [2.0, 4.0]])).values.tolist()
    [[0.0], [2.5]]
    """

    positions_mm: Annotated[FloatArray, Check(partial(float_array, ndim=3), {})]
    """x and z of each end organ on the volar side, or x, y and z of the skin above it, (n_afferents, n_ends,
    2 or 3). [mm]"""
    weights: FiniteArray | None = None
    """Share of each end organ, not negative, (n_ends,) or (n_afferents, n_ends); those of an afferent sum to
    1. Default: equal. [1]"""
    combine: Annotated[str, choice(("sum", "largest"))] = "sum"
    """"sum", weighted; or "largest" of the quantities, each times its weight over the largest weight."""

    def __post_init__(self) -> None:
        n_afferents, n_ends, columns = self.positions_mm.shape
        if columns not in (2, 3) or self.positions_mm.size == 0:
            raise InputError(
                "positions_mm of EndOrgans must be afferents by end organs by x, z, or x, y, z: got shape "
                f"{self.positions_mm.shape}."
            )
        shares = np.full(n_ends, 1.0 / n_ends) if self.weights is None else self.weights
        weights = float_array("weights", np.atleast_2d(shares), 2)
        if weights.shape not in ((1, n_ends), (n_afferents, n_ends)):
            wanted = f"needs one number per end organ, {n_ends}, or a row of them per afferent, {n_afferents}"
            raise InputError("weights", wanted, f"shape {weights.shape}")
        if (weights < 0.0).any():
            raise InputError("weights", "must not be negative", remedy=f"the smallest is {weights.min():g}")
        totals = weights.sum(axis=1)
        if (np.abs(totals - 1.0) > _SUM_TOLERANCE).any():
            worst = totals[np.argmax(np.abs(totals - 1.0))]
            raise InputError(
                f"weights of an afferent must sum to 1: got {worst:g}; divide them by their sum."
            )
        object.__setattr__(self, "weights", np.broadcast_to(weights, (n_afferents, n_ends)))

    def __len__(self) -> int:
        return len(self.positions_mm)

    @classmethod
    def scattered(
        cls,
        places_mm: ArrayLike,
        count: Count,
        reach_mm: Positive,
        seed: Whole,
        place: Place | None = None,
        combine: str = "sum",
    ) -> EndOrgans:
        """Scatter end organs about the places of afferents, uniformly within a disc.

        Parameters
        ----------
        places_mm : array_like (n_afferents, 2)
            In the plane of the layout. [mm]
        count : int
            End organs per afferent.
        reach_mm : float
            Radius of the disc. [mm]
        seed : int
            Seed of the random numbers; those of an afferent depend on its number only.
        place : callable, optional
            From the plane to points of the skin, as in `Population.of_layout`.
        combine : {"sum", "largest"}, optional
            As in `EndOrgans`.

        Examples
        --------
        >>> EndOrgans.scattered([[17.0, 0.0], [18.0, 0.0]], count=5, reach_mm=1.5, seed=1).positions_mm.shape
        (2, 5, 2)
        """
        centres = float_array("places_mm", places_mm, 2)
        drawn = uniforms(seed, 1, len(centres), Purpose.END_ORGAN, 2 * count)[0]
        distance, angle = reach_mm * np.sqrt(drawn[:, :count]), 2.0 * np.pi * drawn[:, count:]
        offsets = np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=-1)
        return cls._at(centres, offsets, place, combine)

    @classmethod
    def about(
        cls, places_mm: ArrayLike, count: Count, reach_mm: Positive, place: Place | None = None
    ) -> EndOrgans:
        """Spread end organs evenly over a disc about the place of each afferent, as seeds of a sunflower.

        All afferents have the same pattern, so that no two differ by chance.

        Parameters
        ----------
        places_mm, count, reach_mm, place
            As in `scattered`.

        Examples
        --------
        >>> ends = EndOrgans.about([[17.0, 0.0]], count=6, reach_mm=0.5)
        >>> ends.positions_mm.mean(axis=1).round(9).tolist()
        [[17.0, 0.0]]
        """
        numbers = np.arange(count)
        distance, angle = reach_mm * np.sqrt((numbers + 0.5) / count), GOLDEN_ANGLE * numbers
        offsets = np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=-1)
        return cls._at(places_mm, offsets - offsets.mean(axis=0), place)

    @classmethod
    def _at(
        cls, places_mm: ArrayLike, offsets: FloatArray, place: Place | None, combine: str = "sum"
    ) -> EndOrgans:
        """End organs so far from the places of their afferents, (n_afferents or none, n_ends, 2). [mm]"""
        ends = float_array("places_mm", places_mm, 2)[:, None] + offsets
        if place is not None:
            ends = place(ends.reshape(-1, 2)).reshape(*ends.shape[:2], 3)
        return cls(ends, combine=combine)

    @property
    def sites_mm(self) -> FloatArray:
        """All end organs, afferent by afferent, (n_afferents n_ends, 2 or 3). [mm]"""
        return self.positions_mm.reshape(-1, self.positions_mm.shape[-1])

    def combined(self, traces: Traces) -> Traces:
        """Traces of the afferents from those of `sites_mm`."""
        return traces.with_values(self.of_afferents)

    def of_afferents(self, values: FloatArray) -> FloatArray:
        """Values of the afferents (n_times, n_afferents) from those at `sites_mm` (n_times, n_sites)."""
        weights = np.asarray(self.weights)
        if self.combine == "largest":
            weights = weights / weights.max(axis=1, keepdims=True)
        together = np.sum if self.combine == "sum" else np.max
        return together(values.reshape(len(values), *self.positions_mm.shape[:2]) * weights, axis=2)
