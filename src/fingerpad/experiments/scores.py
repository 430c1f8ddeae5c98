"""Scores of predictions, estimates from sessions with their errors, and verdicts on bounds."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import result_class
from fingerpad.core.values import FloatArray, Number, float_array


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
    high: FloatArray  #: Of the condition of each row, (n_rows,).
    first: tuple[int, ...]  #: First row of each condition.
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


@result_class
class Estimate:
    """A mean over sessions and its standard error."""

    value: Number
    error: Number


def estimate(by_session: FloatArray) -> Estimate:
    by_session = np.asarray(by_session, dtype=np.float64)
    error = float(by_session.std(ddof=1) / np.sqrt(by_session.size))
    return Estimate(value=float(by_session.mean()), error=error)


def extreme(by_session: FloatArray, pick: Callable[[FloatArray], np.intp]) -> Estimate:
    """Estimate the one of several quantities that `pick` chooses by their means over the sessions."""
    return estimate(by_session[:, int(pick(by_session.mean(axis=0)))])


def largest(changes: FloatArray) -> Estimate:
    """Absolute size of the largest of several changes (n_sessions, n_changes)."""
    found = extreme(changes, lambda means: np.abs(means).argmax())
    return Estimate(value=abs(found.value), error=found.error)


def difference(one: Estimate, other: Estimate) -> Estimate:
    """Subtract the second from the first, whose errors are independent."""
    return Estimate(value=one.value - other.value, error=float(np.hypot(one.error, other.error)))


ERRORS = 2.0  # Monte-Carlo errors by which two numbers must differ for the difference to count.


class Verdict(StrEnum):
    """Whether a claim is met."""

    MET = "met"
    MISSED = "missed"
    NOT_DECIDABLE = "not decidable"  # Chance decides, or an interpretation of what is claimed.
    NOT_APPLICABLE = "does not apply"  # There is nothing to compare.


def of_truth(met: bool) -> Verdict:
    return Verdict.MET if met else Verdict.MISSED


def below(estimate: Estimate, bound: float) -> Verdict:
    """Verdict of a bound from above; not decidable within two Monte-Carlo errors of it."""
    if abs(estimate.value - bound) <= ERRORS * estimate.error:
        return Verdict.NOT_DECIDABLE
    return of_truth(estimate.value < bound)


def above(estimate: Estimate, bound: float = 0.0) -> Verdict:
    """Verdict of a bound from below, as `below`."""
    return below(Estimate(value=-estimate.value, error=estimate.error), -bound)


def every(*verdicts: Verdict) -> Verdict:
    """Missed if one is, else not decidable if one is, else met."""
    return min(verdicts, key=(Verdict.MISSED, Verdict.NOT_DECIDABLE, Verdict.MET).index)


def all_or_none(bound: float, least: float, most: float, *_: object) -> Verdict:
    """Verdict of several numbers that decide only if they agree."""
    return Verdict.NOT_DECIDABLE if least < bound <= most else of_truth(least >= bound)
