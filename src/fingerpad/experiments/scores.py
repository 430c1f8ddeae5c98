"""Scores of predictions: how near they are to what was observed."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, float_array


def coefficient_of_determination(observed: ArrayLike, predicted: ArrayLike) -> float:
    """R² = 1 - sum (observed - predicted)² / sum (observed - mean)²; NaN if all observations are equal.

    Examples
    --------
    >>> coefficient_of_determination([0.0, 1.0, 2.0], [0.0, 1.0, 2.0])
    1.0
    """
    o, p = np.asarray(observed, dtype=float), np.asarray(predicted, dtype=float)
    if not _varies(o):
        return np.nan
    return float(1.0 - ((o - p) ** 2).sum() / ((o - o.mean()) ** 2).sum())


def gain_through_origin(observed: ArrayLike, predicted: ArrayLike) -> float:
    """Factor on the predictions with the least squares, sum o p / sum p²; NaN if all predictions are 0.

    Examples
    --------
    >>> gain_through_origin([2.0, 4.0], [1.0, 2.0])
    2.0
    """
    o, p = np.asarray(observed, dtype=float), np.asarray(predicted, dtype=float)
    return float((o * p).sum() / (p * p).sum()) if p.any() else np.nan


def correlation(observed: ArrayLike, predicted: ArrayLike) -> float:
    """Pearson's correlation; NaN if all observations or all predictions are equal.

    Examples
    --------
    >>> round(correlation([1.0, 2.0, 4.0], [5.0, 4.0, 2.0]), 12)
    -1.0
    """
    o, p = np.asarray(observed, dtype=float), np.asarray(predicted, dtype=float)
    return float(np.corrcoef(o, p)[0, 1]) if _varies(o) and _varies(p) else np.nan


def _varies(values: FloatArray) -> bool:
    return values.size > 1 and float(np.ptp(values)) > 0.0


@dataclass(frozen=True)
class ObservedRanges:
    """Lowest and highest observation under each condition.

    Parameters
    ----------
    low, high : array (n_rows,)
        Of the condition of each row.
    first : tuple of int
        First row of each condition.
    repeated : bool array (n_rows,)
        Whether the condition of a row was observed at least twice, so that its range can judge.
    """

    low: FloatArray
    high: FloatArray
    first: tuple[int, ...]
    repeated: np.ndarray

    def inside(self, predicted: FloatArray) -> list[bool | None]:
        """Whether each prediction lies in its range; None where the range or the prediction is missing."""
        return [
            bool(low <= value <= high) if repeated and np.isfinite(value) else None
            for low, value, high, repeated in zip(self.low, predicted, self.high, self.repeated, strict=True)
        ]


def observed_ranges(conditions: Sequence[Hashable], observed: ArrayLike) -> ObservedRanges:
    """Group observations by their conditions.

    Parameters
    ----------
    conditions : sequence of hashable (n_rows,)
        What each row was observed under; equal values are one condition.
    observed : array_like (n_rows,)
        What was observed.

    Returns
    -------
    ObservedRanges

    Examples
    --------
    >>> ranges = observed_ranges(["1 mm", "2 mm", "1 mm"], [0.11, 0.5, 0.23])
    >>> ranges.low.tolist(), ranges.first, ranges.inside(np.array([0.2, 0.6, 0.2]))
    ([0.11, 0.5, 0.11], (0, 1), [True, None, True])
    """
    values = float_array("observed", observed, 1)
    rows: dict[Hashable, list[int]] = {}
    for row, condition in enumerate(conditions):
        rows.setdefault(condition, []).append(row)
    low, high = values.copy(), values.copy()
    repeated = np.zeros(values.size, dtype=bool)
    for same in rows.values():
        low[same], high[same] = values[same].min(), values[same].max()
        repeated[same] = len(same) > 1
    return ObservedRanges(low, high, tuple(same[0] for same in rows.values()), repeated)
