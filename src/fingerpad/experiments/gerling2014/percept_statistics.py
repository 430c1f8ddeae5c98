"""One number, and its Monte-Carlo error, for each thing that the paper says about the percept.

Every statistic is computed session by session (`percept_sessions`); its value is the mean over the sessions
and its error the standard deviation of that mean. Where a statistic is the largest of several differences,
the differences are averaged over the sessions first: the largest of noisy numbers would grow with the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.experiments.gerling2014 import goodwin
from fingerpad.experiments.gerling2014.percept_sessions import CRITERION_SIGMAS, FEW, SWEPT_NOISE, Observers

CHANCE = 0.5

Estimate = dict[str, float]


def estimate(by_session: FloatArray) -> Estimate:
    """Mean over sessions and standard error of that mean.

    Examples
    --------
    >>> estimate(np.array([1.0, 2.0, 3.0]))["value"]
    2.0
    """
    by_session = np.asarray(by_session, dtype=np.float64)
    return {
        "value": float(by_session.mean()),
        "error": float(by_session.std(ddof=1) / np.sqrt(by_session.size)),
    }


def extreme(by_session: FloatArray, pick: Any) -> Estimate:
    """Estimate the one of several quantities whose mean over the sessions `pick` chooses.

    Parameters
    ----------
    by_session : array (n_sessions, n_quantities)
        The quantities.
    pick : callable
        Such as `np.argmin`; called with the means.

    Examples
    --------
    >>> extreme(np.array([[1.0, 5.0], [3.0, 5.0]]), np.argmin)
    {'value': 2.0, 'error': 1.0}
    """
    return estimate(by_session[:, int(pick(by_session.mean(axis=0)))])


def statistics(
    observers: Observers, curvature_per_m: Sequence[float], measures: Sequence[str]
) -> dict[str, Any]:
    """Say in numbers what the paper says in words.

    Parameters
    ----------
    observers : Observers
        Of all sessions.
    curvature_per_m : sequence of float
        The seven spheres, the standard first. [1/m]
    measures : sequence of str
        Response measures that the Gradient Sum was made of, "static" among them.

    Returns
    -------
    dict
        `misfit`: root mean square distance to Goodwin's points, by code.
        `misfit_above_static`: by how much that of every other code is larger.
        `shift`: largest change of a hit rate by the shift, by code; `shift_above_static` likewise.
        `smallest_rise`: smallest step from one sphere to the next, by code and position.
        `noise_lowers`: fall of the mean hit rate from each swept noise to the next.
        `ten_matrices`, `criterion`: ratio of the error bars, and largest change of a mean.
        `unsteadiness`: standard deviation of a mean of ten and of a hundred hit rates, and their ratio.
        `sweep`: misfit of each swept noise at each position.
        `targets`: hit rates at Goodwin's points and distance from the line in z, at both positions.
    """
    codes = [*measures, "euclidean"]
    columns = [list(curvature_per_m).index(curvature) - 1 for curvature in goodwin.CURVATURES]
    mean, spread = observers.mean, observers.spread
    missed = {name: mean[name][..., columns] - np.array(goodwin.HIT_RATES) for name in codes}
    misfit = {name: np.sqrt(np.square(error).mean(axis=(1, 2))) for name, error in missed.items()}
    change = {name: mean[name][:, 1] - mean[name][:, 0] for name in codes}
    shift = {name: _largest(change[name]) for name in codes}
    others = [name for name in codes if name != "static"]
    levels = [mean[f"sigma_{sigma:g}"].mean(axis=(1, 2)) for sigma in SWEPT_NOISE]
    little, much = (f"criterion_{sigma:g}" for sigma in CRITERION_SIGMAS)
    unsteadiness = {count: moved.mean(axis=1) for count, moved in observers.unsteadiness.items()}
    few, many = (unsteadiness[count] for count in sorted(unsteadiness))
    return {
        "misfit": {name: estimate(misfit[name]) for name in codes},
        "misfit_above_static": {name: estimate(misfit[name] - misfit["static"]) for name in others},
        "shift": shift,
        "shift_above_static": {name: _difference(shift[name], shift["static"]) for name in others},
        "smallest_rise": {name: [_smallest_rise(one) for one in mean[name].swapaxes(0, 1)] for name in codes},
        "noise_lowers": {
            "noise_sigma": SWEPT_NOISE,
            "smallest_fall": extreme(np.transpose([a - b for a, b in pairwise(levels)]), np.argmin),
        },
        "ten_matrices": _wider(spread["ten_matrices"], spread["static"])
        | {"change": _largest(_over_positions(mean["ten_matrices"] - mean["static"]))},
        "criterion": _wider(spread[much], spread[little])
        | {"change": _largest(_over_positions(mean[much] - mean[little]))},
        "unsteadiness": {
            "hit_rates": [FEW, max(unsteadiness)],
            "few": estimate(few),
            "many": estimate(many),
            "ratio": estimate(few / many),
        },
        "sweep": {
            "noise_sigma": SWEPT_NOISE,
            "misfit": [
                [_misfit_at(mean[f"sigma_{sigma:g}"][:, place][:, columns]) for sigma in SWEPT_NOISE]
                for place in range(mean["static"].shape[1])
            ],
        },
        "targets": [_targets(one, columns, curvature_per_m) for one in mean["static"].swapaxes(0, 1)],
    }


def _misfit_at(hit_rates: FloatArray) -> Estimate:
    """Root mean square distance of (n_sessions, n_points) hit rates to Goodwin's."""
    return estimate(np.sqrt(np.square(hit_rates - goodwin.HIT_RATES).mean(axis=1)))


def _over_positions(values: FloatArray) -> FloatArray:
    """Quantities of both positions side by side, (n_sessions, n_positions x n_comparisons)."""
    return values.reshape(len(values), -1)


def _largest(changes: FloatArray) -> Estimate:
    """Absolute size of the largest of several changes (n_sessions, n_changes)."""
    found = extreme(changes, lambda means: np.abs(means).argmax())
    return found | {"value": abs(found["value"])}


def _difference(one: Estimate, other: Estimate) -> Estimate:
    return {"value": one["value"] - other["value"], "error": float(np.hypot(one["error"], other["error"]))}


def _smallest_rise(hit_rates: FloatArray) -> Estimate:
    """Smallest step of the curve (n_sessions, n_comparisons), the first one up from chance."""
    steps = np.diff(hit_rates, axis=1, prepend=CHANCE)
    return extreme(steps, np.argmin)


def _wider(spread: FloatArray, reference: FloatArray) -> dict[str, Estimate]:
    """How many times longer error bars are on average."""
    return {"ratio": estimate(spread.mean(axis=(1, 2)) / reference.mean(axis=(1, 2)))}


def _targets(hit_rates: FloatArray, columns: list[int], curvature_per_m: Sequence[float]) -> dict[str, Any]:
    """Hit rates (n_sessions, n_comparisons) of one position at Goodwin's points, and away from the line."""
    comparison = np.array(curvature_per_m[1:])
    between = [index for index in range(comparison.size) if index not in columns]
    away = hit_rates - goodwin.line_in_z(comparison)
    return {
        "at_goodwin": [estimate(hit_rates[:, column]) for column in columns],
        "from_line": [estimate(away[:, index]) for index in range(comparison.size)],
        "largest_from_line": _largest(away[:, between]),
    }
