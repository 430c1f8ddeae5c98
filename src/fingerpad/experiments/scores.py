"""Scores of predictions: how near they are to what was observed."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.values import FloatArray, float_array


def coefficient_of_determination(observed: ArrayLike, predicted: ArrayLike) -> float:
    """R² = 1 - sum (observed - predicted)² / sum (observed - mean)²; NaN if all observations are equal."""
    o, p = np.asarray(observed, dtype=float), np.asarray(predicted, dtype=float)
    if not _varies(o):
        return np.nan
    return float(1.0 - ((o - p) ** 2).sum() / ((o - o.mean()) ** 2).sum())


def gain_through_origin(observed: ArrayLike, predicted: ArrayLike) -> float:
    """Factor on the predictions with the least squares, sum o p / sum p²; NaN if all predictions are 0."""
    o, p = np.asarray(observed, dtype=float), np.asarray(predicted, dtype=float)
    return float((o * p).sum() / (p * p).sum()) if p.any() else np.nan


def correlation(observed: ArrayLike, predicted: ArrayLike) -> float:
    """Pearson's correlation; NaN if all observations or all predictions are equal."""
    o, p = np.asarray(observed, dtype=float), np.asarray(predicted, dtype=float)
    return float(np.corrcoef(o, p)[0, 1]) if _varies(o) and _varies(p) else np.nan


def _varies(values: FloatArray) -> bool:
    return values.size > 1 and float(np.ptp(values)) > 0.0


@dataclass(frozen=True)
class ObservedRanges:
    """Lowest and highest observation under each condition."""

    low: FloatArray
    high: FloatArray  # Of the condition of each row, (n_rows,).
    first: tuple[int, ...]  # First row of each condition.
    repeated: np.ndarray
    """Whether the condition of a row was observed at least twice, so that its range can judge, (n_rows,)."""

    def inside(self, predicted: FloatArray) -> list[bool | None]:
        """Whether each prediction lies in its range; None where the range or the prediction is missing."""
        return [
            bool(low <= value <= high) if repeated and np.isfinite(value) else None
            for low, value, high, repeated in zip(self.low, predicted, self.high, self.repeated, strict=True)
        ]


def observed_ranges(conditions: Sequence[Hashable], observed: ArrayLike) -> ObservedRanges:
    """Group observations by their conditions."""
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
