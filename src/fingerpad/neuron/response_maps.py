"""Order of recruitment and population rate.

The order of first spikes is a code that needs no rates (Johansson & Birznieks 2004). The population rate is
the histogram of all spikes over time, of all afferents or by rings about the contact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr
from scipy.stats import rankdata

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.signals import SpikeTrains
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import FloatArray, NotNegative, float_array, increasing, positive, vector

NO_GROUP = -1  # Group number of an afferent that is in no group.

_LEAST_SMOOTHING = 1e-6
_PAIRS_AT_A_TIME = 4_000_000


def recruitment_rank(latency_ms: ArrayLike) -> FloatArray:
    """Rank of every afferent in the order of first spikes."""
    latency = _latencies("latency_ms", latency_ms)
    fires = ~np.isnan(latency)
    rank = np.full(latency.size, np.nan)
    rank[fires] = rankdata(latency[fires])
    return rank


@checked
def recruited(latency_ms: ArrayLike, times_ms: ArrayLike) -> np.ndarray:
    """Count the afferents that have fired their first spike by each time.

    Parameters
    ----------
    latency_ms : array_like (n_afferents,)
        First-spike latencies; NaN for a silent afferent. [ms]
    times_ms : array_like (...)
        Times. [ms]

    Returns
    -------
    int array (...)
        Afferents with a latency up to that time.

    Examples
    --------
    >>> recruited([12.0, np.nan, 7.0, 30.0], [0.0, 7.0, 20.0, 1000.0]).tolist()
    [0, 1, 2, 3]
    """
    latency = _latencies("latency_ms", latency_ms)
    in_order = np.sort(latency[~np.isnan(latency)])
    return np.searchsorted(in_order, np.asarray(times_ms, dtype=np.float64), side="right")


@checked
def evoked_latency_ms(latency_ms: ArrayLike, resting_latency_ms: float) -> FloatArray:
    """Select first spikes that are evoked by a stimulus, for afferents that also fire at rest.

    A first spike counts as evoked if its latency is at most half of the latency at rest, where the afferent
    fires at least twice as fast as at rest.
    """
    latency = _latencies("latency_ms", latency_ms)
    if resting_latency_ms < 0.0:
        raise InputError("resting_latency_ms", "must not be negative [ms]", repr(resting_latency_ms))
    latest_ms = np.inf if np.isnan(resting_latency_ms) else 0.5 * resting_latency_ms
    return np.where(latency <= latest_ms, latency, np.nan)


@dataclass(frozen=True)
class OrderChange:
    """Difference of the order of first spikes between two stimuli."""

    both: int
    either: int  # Afferents that fire under both stimuli, and under at least one.
    rank_correlation: float
    """Spearman's coefficient of the two orders, over afferents that fire under both: 1 for the same order, -1
    for the reverse. NaN for fewer than two of them, or if all tie under one stimulus. [1]"""
    swapped: float
    """Share of their pairs whose order is reversed; a pair with a tie is not. NaN without a pair. [0-1]"""


@checked
def order_change(latency_ms: ArrayLike, other_latency_ms: ArrayLike) -> OrderChange:
    """Compare the order of recruitment under two stimuli.

    With the ranks r and s of the afferents that fire under both stimuli:

        rank correlation = sum (r_i - mean r) (s_i - mean s) / sqrt(sum (r_i - mean r)^2 sum (s_i - mean s)^2)
        swapped = share of pairs i < j with (r_i - r_j) (s_i - s_j) < 0

    Parameters
    ----------
    latency_ms, other_latency_ms : array_like (n_afferents,)
        First-spike latencies of the same afferents; NaN for a silent one. [ms]

    Examples
    --------
    The first two of four are swapped, which is one pair of six:

    >>> change = order_change([5.0, 6.0, 7.0, 8.0, np.nan], [6.0, 5.0, 7.0, 8.0, 9.0])
    >>> change.both, change.either, round(change.rank_correlation, 3), round(change.swapped, 3)
    (4, 5, 0.8, 0.167)
    """
    first, second = _latencies("latency_ms", latency_ms), _latencies("other_latency_ms", other_latency_ms)
    if first.size != second.size:
        raise InputError("order_change", "needs the same afferents twice", f"{first.size} and {second.size}")
    fires, fires_too = ~np.isnan(first), ~np.isnan(second)
    both = fires & fires_too
    r, s = rankdata(first[both]), rankdata(second[both])
    return OrderChange(
        both=int(both.sum()),
        either=int((fires | fires_too).sum()),
        rank_correlation=_correlation(r, s),
        swapped=_swapped(r, s),
    )


def _latencies(name: str, values: ArrayLike) -> FloatArray:
    latency = vector(name, values)
    if np.isinf(latency).any():
        raise InputError(name, "must be times, NaN if silent", "infinite times")
    return latency


def _correlation(r: FloatArray, s: FloatArray) -> float:
    if r.size < 2:
        return float("nan")
    r, s = r - r.mean(), s - s.mean()
    scale = np.sqrt(np.square(r).sum() * np.square(s).sum())
    return float((r * s).sum() / scale) if scale > 0.0 else float("nan")


def _swapped(r: FloatArray, s: FloatArray) -> float:
    n = r.size
    if n < 2:
        return float("nan")
    # In blocks of rows: 10,000 afferents have 50 million pairs, too many for the memory.
    rows = max(1, _PAIRS_AT_A_TIME // n)
    reversed_twice = sum(
        np.count_nonzero((r[start : start + rows, None] - r) * (s[start : start + rows, None] - s) < 0.0)
        for start in range(0, n, rows)
    )
    return float(reversed_twice / (n * (n - 1)))


@dataclass(frozen=True)
class PopulationRate:
    """Spike counts of groups of afferents over time."""

    edges_ms: FloatArray  # Edges of the bins, increasing, (n_bins + 1,). [ms]
    spikes: FloatArray  # Spikes of each group in each bin; whole numbers unless smoothed, (n_groups, n_bins).
    active: np.ndarray  # Afferents of each group with at least one spike in the bin, (n_groups, n_bins).
    n_afferents: np.ndarray  # Size of each group, including silent afferents, (n_groups,).

    @property
    def times_ms(self) -> FloatArray:
        """Centres of the bins, (n_bins,). [ms]"""
        return 0.5 * (self.edges_ms[1:] + self.edges_ms[:-1])

    @property
    def rate_hz(self) -> FloatArray:
        """Rate per afferent, (n_groups, n_bins); NaN for an empty group. [spikes/s]"""
        return MS_PER_S * self._per_afferent(self.spikes) / np.diff(self.edges_ms)

    @property
    def active_fraction(self) -> FloatArray:
        """Share of the afferents that fire in each bin, (n_groups, n_bins); NaN if empty. [0-1]"""
        return self._per_afferent(self.active)

    def rate_per_area(self, density_per_cm2: float) -> FloatArray:
        """Rate per area of skin: the rate per afferent times the density."""
        return self.rate_hz * positive("density_per_cm2", density_per_cm2, "1/cm2")

    def _per_afferent(self, counts: np.ndarray) -> FloatArray:
        sizes = np.where(self.n_afferents > 0, self.n_afferents, np.nan)
        return counts / sizes[:, np.newaxis]


@checked
def population_rate(
    spikes: SpikeTrains, edges_ms: ArrayLike, groups: ArrayLike | None = None, smoothing_ms: NotNegative = 0.0
) -> PopulationRate:
    """Compute the peristimulus histogram of a population.

    A bin excludes its start and includes its end, as the windows of `firing_rate_hz` do. Smoothing convolves
    the counts n_j, taken as uniform within bin j, with a normal density phi:

        n_i <- sum_j K_ij n_j,    K_ij ~ integral over t in bin i, s in bin j of phi(t - s),    sum_i K_ij = 1

    The weights of each spike add up to 1, so smoothing conserves the number of spikes, also at the ends of
    the histogram. The numbers of active afferents are not smoothed.

    Parameters
    ----------
    spikes : SpikeTrains
        One train per afferent.
    edges_ms : array_like (n_bins + 1,)
        Edges of the bins, increasing. [ms]
    groups : int array_like (n_afferents,), optional
        Group of each afferent, from 0, or `NO_GROUP`, such as those of `rings`. Default: one group.
    smoothing_ms : float, optional
        Standard deviation of phi; 0 for no smoothing. [ms]

    Examples
    --------
    >>> trains = SpikeTrains.from_lists([[2.0, 4.0, 12.0], [10.0], []])
    >>> found = population_rate(trains, [0.0, 10.0, 20.0])
    >>> found.spikes.tolist(), found.rate_hz.tolist(), found.active_fraction.round(2).tolist()
    ([[3.0, 1.0]], [[100.0, 33.33...]], [[0.67, 0.33]])
    """
    edges = increasing("edges_ms", float_array("edges_ms", edges_ms, 1))
    if edges.size < 2:
        raise InputError("edges_ms", "must hold the two edges of at least one bin", f"{edges.size} numbers")
    group = _groups(groups, len(spikes))
    n_groups, n_bins = int(group.max(initial=0)) + 1, edges.size - 1

    owner = np.repeat(np.arange(len(spikes)), np.diff(spikes.offsets))
    place = np.searchsorted(edges, spikes.times_ms, side="left") - 1
    counted = (place >= 0) & (place < n_bins) & (group[owner] != NO_GROUP)
    owner, place = owner[counted], place[counted]

    # Trains and the spikes within them are in order: the spikes of an afferent in one bin are adjacent.
    again = np.zeros(owner.size, dtype=bool)
    again[1:] = (owner[1:] == owner[:-1]) & (place[1:] == place[:-1])
    cell = group[owner] * n_bins + place
    count = np.bincount(cell, minlength=n_groups * n_bins).reshape(n_groups, n_bins).astype(np.float64)
    active = np.bincount(cell[~again], minlength=n_groups * n_bins).reshape(n_groups, n_bins)
    if smoothing_ms > 0.0:
        count = count @ _kernel(edges, smoothing_ms).T
    return PopulationRate(
        edges_ms=edges,
        spikes=count,
        active=active,
        n_afferents=np.bincount(group[group != NO_GROUP], minlength=n_groups),
    )


def _groups(groups: ArrayLike | None, n_afferents: int) -> np.ndarray:
    if groups is None:
        return np.zeros(n_afferents, dtype=np.int64)
    group = np.asarray(groups)
    if group.shape != (n_afferents,) or not np.issubdtype(group.dtype, np.integer):
        raise InputError(
            "groups",
            f"must be one whole number per afferent, {n_afferents} in all",
            f"{group.dtype} of shape {group.shape}",
        )
    if (group < NO_GROUP).any():
        raise InputError("groups", f"must count from 0, {NO_GROUP} for none", str(group.min()))
    return group.astype(np.int64)


def _kernel(edges: FloatArray, smoothing_ms: float) -> FloatArray:
    """Weights K_ij of the counts of bin j in bin i, (n_bins, n_bins)."""
    # The double integral of phi is G(x) = x Phi(x) + phi(x), with signs, at the four pairs of edges.
    # A density much narrower than the bins has no effect, and its square overflows.
    scale_ms = max(smoothing_ms, _LEAST_SMOOTHING * np.diff(edges).min())
    x = (edges[:, np.newaxis] - edges) / scale_ms
    integral = x * ndtr(x) + np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi)
    shares = np.maximum(-np.diff(np.diff(integral, axis=0), axis=1), 0.0)
    return shares / shares.sum(axis=0)


def rings(positions_mm: ArrayLike, centre_mm: ArrayLike, radii_mm: ArrayLike) -> np.ndarray:
    """Assign receptors to rings about a point, such as the centre of the contact.

    Parameters
    ----------
    positions_mm : array_like (n_receptors, 2 or 3)
        Positions of the receptors. [mm]
    centre_mm : array_like (2 or 3,)
        The point, in the same coordinates. [mm]
    radii_mm : array_like (n_rings + 1,)
        Inner radius of the first ring, then the outer radius of each, increasing. [mm]

    Returns
    -------
    int array (n_receptors,)
        Ring of each receptor from 0, including its inner radius and excluding its outer one; `NO_GROUP`
        outside of all rings.

    Examples
    --------
    >>> rings([[17.0, 0.0], [18.0, 0.0], [17.0, 2.5]], [17.0, 0.0], [0.0, 1.0, 2.0]).tolist()
    [0, 1, -1]
    """
    positions, centre = float_array("positions_mm", positions_mm, 2), float_array("centre_mm", centre_mm, 1)
    if positions.shape[1] != centre.size:
        raise InputError(
            "centre_mm",
            "must have the coordinates of the positions",
            f"{centre.size} for {positions.shape[1]}",
        )
    radii = increasing("radii_mm", float_array("radii_mm", radii_mm, 1))
    if radii.size < 2 or radii[0] < 0.0:
        raise InputError("radii_mm", "must be at least two distances, none negative", repr(radii_mm))
    away = np.linalg.norm(positions - centre, axis=1)
    ring = np.searchsorted(radii, away, side="right") - 1
    return np.where(ring < radii.size - 1, ring, NO_GROUP)
