"""One number with its Monte-Carlo error for each statement of the paper about discrimination.

Every statistic is computed session by session (`discrimination_sessions`). Its value is the mean over the
sessions and its error the standard deviation of that mean. Where a statistic is the largest of several
differences, the differences are averaged over the sessions first: the largest of noisy numbers grows with
the noise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Number, Vector, WholeVector, result_class
from fingerpad.experiments.gerling2014.discrimination_sessions import (
    CRITERION_SIGMAS,
    FEW,
    SWEPT_NOISE,
    Observers,
)
from fingerpad.experiments.gerling2014.goodwin import goodwin_columns, goodwin_misfit, line_in_z

CHANCE = 0.5


@result_class
class Estimate:
    """A mean over sessions and its standard error."""

    value: Number
    error: Number


@result_class
class NoiseEffect:
    """How the mean hit rate falls with the noise."""

    noise_sigma: Vector
    """Noise sigma_1, (n_levels,)."""
    smallest_fall: Estimate
    """From one level to the next. [0-1]"""


@result_class
class ErrorBarChange:
    """How a variant of the protocol changes the error bars."""

    ratio: Estimate
    """Mean error bar over that of the reference. [1]"""
    change: Estimate
    """Largest change of a mean hit rate. [0-1]"""


@result_class
class MeanStability:
    """Standard deviation of a mean hit rate when the same sums are judged again."""

    hit_rates: WholeVector
    """Hit rates behind a mean, (2,)."""
    few: Estimate
    many: Estimate
    """Standard deviation with either number. [0-1]"""
    ratio: Estimate
    """The first over the second. [1]"""


@result_class
class NoiseSweep:
    """Misfit of the static Gradient Sum over the noise."""

    noise_sigma: Vector
    """Noise sigma_1, (n_levels,)."""
    misfit: tuple[tuple[Estimate, ...], ...]
    """Root mean square distance to Goodwin's points. [0-1]"""


@result_class
class TargetDistances:
    """Static hit rates of one position beside people's."""

    at_goodwin: tuple[Estimate, ...]
    """Hit rates at Goodwin's spheres. [0-1]"""
    from_line: tuple[Estimate, ...]
    """Distance from the line in z. [0-1]"""
    largest_from_line: Estimate
    """Largest distance between Goodwin's points. [0-1]"""


@result_class
class DiscriminationStatistics:
    """Statistics behind the paper's statements; dictionaries go by code."""

    misfit: dict[str, Estimate]
    misfit_above_static: dict[str, Estimate]
    """Root mean square distance to Goodwin's points, and what it has above that of static rates. [0-1]"""
    shift: dict[str, Estimate]
    shift_above_static: dict[str, Estimate]
    """Largest change of a hit rate by the shift, and what it has above that of static rates. [0-1]"""
    smallest_rise: dict[str, tuple[Estimate, ...]]
    """Smallest step of the hit rate from one sphere to the next. [0-1]"""
    noise_lowers: NoiseEffect
    """More noise, lower hit rates."""
    ten_matrices: ErrorBarChange
    criterion: ErrorBarChange
    """10 noise matrices instead of 100; a criterion that varies more."""
    unsteadiness: MeanStability
    """Means of 10 and of 100 hit rates."""
    sweep: NoiseSweep
    """Misfit over the noise."""
    targets: tuple[TargetDistances, ...]
    """Distances from people."""


def estimate(by_session: FloatArray) -> Estimate:
    """Mean over sessions and standard error of that mean."""
    by_session = np.asarray(by_session, dtype=np.float64)
    return Estimate(
        value=float(by_session.mean()), error=float(by_session.std(ddof=1) / np.sqrt(by_session.size))
    )


def extreme(by_session: FloatArray, pick: Callable[[FloatArray], np.intp]) -> Estimate:
    """Estimate the one of several quantities that `pick` chooses by their means over the sessions."""
    return estimate(by_session[:, int(pick(by_session.mean(axis=0)))])


def discrimination_statistics(
    observers: Observers, curvature_per_m: Sequence[float], measures: Sequence[str]
) -> DiscriminationStatistics:
    """Compute the statistics behind the paper's statements."""
    codes = [*measures, "euclidean"]
    others = [name for name in codes if name != "static"]
    columns = goodwin_columns(curvature_per_m)
    mean = observers.mean
    misfit = {name: goodwin_misfit(mean[name][..., columns], axis=(1, 2)) for name in codes}
    shift = {name: _largest(mean[name][:, 1] - mean[name][:, 0]) for name in codes}
    levels = [mean[f"sigma_{sigma:g}"].mean(axis=(1, 2)) for sigma in SWEPT_NOISE]
    little, much = (f"criterion_{sigma:g}" for sigma in CRITERION_SIGMAS)
    unsteadiness = {count: moved.mean(axis=1) for count, moved in observers.unsteadiness.items()}
    few, many = (unsteadiness[count] for count in sorted(unsteadiness))
    return DiscriminationStatistics(
        misfit={name: estimate(misfit[name]) for name in codes},
        misfit_above_static={name: estimate(misfit[name] - misfit["static"]) for name in others},
        shift=shift,
        shift_above_static={name: _difference(shift[name], shift["static"]) for name in others},
        smallest_rise={
            name: tuple(_smallest_rise(one) for one in mean[name].swapaxes(0, 1)) for name in codes
        },
        noise_lowers=NoiseEffect(
            noise_sigma=np.array(SWEPT_NOISE),
            smallest_fall=extreme(np.transpose([a - b for a, b in pairwise(levels)]), np.argmin),
        ),
        ten_matrices=_error_bars(observers, "ten_matrices", "static"),
        criterion=_error_bars(observers, much, little),
        unsteadiness=MeanStability(
            hit_rates=np.array([FEW, max(unsteadiness)]),
            few=estimate(few),
            many=estimate(many),
            ratio=estimate(few / many),
        ),
        sweep=NoiseSweep(
            noise_sigma=np.array(SWEPT_NOISE),
            misfit=tuple(
                tuple(
                    estimate(goodwin_misfit(mean[f"sigma_{sigma:g}"][:, place][:, columns], axis=1))
                    for sigma in SWEPT_NOISE
                )
                for place in range(mean["static"].shape[1])
            ),
        ),
        targets=tuple(_targets(one, columns, curvature_per_m) for one in mean["static"].swapaxes(0, 1)),
    )


def _largest(changes: FloatArray) -> Estimate:
    """Absolute size of the largest of several changes (n_sessions, n_changes)."""
    found = extreme(changes, lambda means: np.abs(means).argmax())
    return Estimate(value=abs(found.value), error=found.error)


def _difference(one: Estimate, other: Estimate) -> Estimate:
    return Estimate(value=one.value - other.value, error=float(np.hypot(one.error, other.error)))


def _smallest_rise(hit_rates: FloatArray) -> Estimate:
    """Smallest step of the curve (n_sessions, n_comparisons), the first one up from chance."""
    return extreme(np.diff(hit_rates, axis=1, prepend=CHANCE), np.argmin)


def _error_bars(observers: Observers, variant: str, reference: str) -> ErrorBarChange:
    """How many times longer error bars are on average, and the largest change of a mean."""
    wide, usual = (observers.spread[name].mean(axis=(1, 2)) for name in (variant, reference))
    change = observers.mean[variant] - observers.mean[reference]
    return ErrorBarChange(ratio=estimate(wide / usual), change=_largest(change.reshape(len(change), -1)))


def _targets(hit_rates: FloatArray, columns: list[int], curvature_per_m: Sequence[float]) -> TargetDistances:
    """Hit rates (n_sessions, n_comparisons) of one position at Goodwin's points, and away from the line."""
    comparison = np.array(curvature_per_m[1:])
    between = [index for index in range(comparison.size) if index not in columns]
    away = hit_rates - line_in_z(comparison)
    return TargetDistances(
        at_goodwin=tuple(estimate(hit_rates[:, column]) for column in columns),
        from_line=tuple(estimate(column) for column in away.T),
        largest_from_line=_largest(away[:, between]),
    )
