"""Draw from any density of a few parameters, and stop only when the draws can be trusted.

Several ensembles of walkers start from scattered points and never hear of each other. Within an ensemble one
half moves by what the other half knows, by turns:

- stretch: along the line to a walker of the other half (Goodman & Weare 2010),
- leap: from wherever the walker is to the neighbourhood of any walker of the other half. The other half is a
  sketch of the density, so that many leaps succeed, and walkers exchange places that no path joins.

Both leave the density as it is, whatever its shape, since the half that moves is unknown to what proposes.
Both look the same in any units of the parameters. Steps of a density are no obstacle: nothing is
differentiated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import logsumexp

from fingerpad.checks import FloatArray, finite, float_array, positive, whole
from fingerpad.errors import ConvergenceError, InputError
from fingerpad.fitting.convergence import effective_size, split_r_hat, tail_effective_size

LogDensity = Callable[[FloatArray], FloatArray]
"""Called with points (n_points, n_parameters); returns their log densities up to a constant, -inf outside."""

LONGEST_STRETCH = 2.0
DEGREES_OF_FREEDOM = 5.0
"""Of the Student distributions: tails heavy enough for walkers that lag behind."""

LUMPINESS = 0.6
"""Bandwidth of the sketch over the one that suits a normal density; those of rates have many lumps. [1]"""

TRIES = 200


@dataclass(frozen=True)
class Chains:
    """Draws from a density, converged, and how we know.

    Parameters
    ----------
    names : tuple of str
        Names of the parameters.
    draws : array (n_ensembles, n_steps, n_walkers, n_parameters)
        The second half of all steps, from which results are taken.
    log_densities : array (n_ensembles, n_steps, n_walkers)
        Up to a constant.
    r_hat : array (n_parameters,)
        Split R-hat over the ensembles. [1]
    effective_sizes, tail_effective_sizes : array (n_parameters,)
        Independent draws that would tell the mean, and the ends of a 95 % interval, as well. [1]
    autocorrelation_steps : array (n_parameters,)
        Draws made per effective one. [1]
    acceptance : float
        Share of the moves that were taken. [0-1]
    n_evaluations : int
        Evaluations of the density, those of the discarded first half included.
    seed : int
        Of the random numbers; the same one gives the same bits.
    history : tuple of str
        One line per look at convergence.
    """

    names: tuple[str, ...]
    draws: FloatArray
    log_densities: FloatArray
    r_hat: FloatArray
    effective_sizes: FloatArray
    tail_effective_sizes: FloatArray
    autocorrelation_steps: FloatArray
    acceptance: float
    n_evaluations: int
    seed: int
    history: tuple[str, ...]

    @property
    def flat(self) -> FloatArray:
        """All draws (n_draws, n_parameters)."""
        return self.draws.reshape(-1, self.draws.shape[-1])

    @property
    def mean(self) -> FloatArray:
        """Mean of the draws (n_parameters,)."""
        return self.flat.mean(axis=0)

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the draws (n_parameters, n_parameters)."""
        return np.cov(self.flat, rowvar=False).reshape(len(self.names), len(self.names))

    def interval(self, level: float = 0.95) -> FloatArray:
        """Return the central credible interval of each parameter, (2, n_parameters).

        Parameters
        ----------
        level : float, optional
            Probability within. [0-1]
        """
        return credible_band(self.flat, level)

    def spread_out(self, n_draws: int) -> FloatArray:
        """Return some of the draws (n_draws, n_parameters), as far apart along the chains as can be.

        Parameters
        ----------
        n_draws : int
            All draws if there are fewer.
        """
        count = min(whole("n_draws", n_draws, at_least=1), len(self.flat))
        return self.flat[np.linspace(0, len(self.flat) - 1, count).round().astype(np.int64)]


def credible_band(draws: FloatArray, level: float = 0.95) -> FloatArray:
    """Return the central interval that holds a share `level` of the draws, for each column.

    Parameters
    ----------
    draws : array (n_draws, ...)
        Any quantities, one row per draw.
    level : float, optional
        Probability within. [0-1]

    Returns
    -------
    array (2, ...)
        Lower and upper end.

    Raises
    ------
    InputError
        If the level is not between 0 and 1.

    Examples
    --------
    >>> credible_band(np.arange(101.0), 0.5).tolist()
    [25.0, 75.0]
    """
    if not 0.0 < finite("level", level) < 1.0:
        raise InputError(f"level must lie between 0 and 1: got {level!r}.")
    return np.quantile(draws, [0.5 - level / 2.0, 0.5 + level / 2.0], axis=0)


def sample(
    log_density: LogDensity,
    centre: ArrayLike,
    spread: ArrayLike,
    names: Sequence[str],
    *,
    seed: int,
    n_ensembles: int = 4,
    n_walkers: int = 80,
    n_steps: int = 40,
    most_steps: int = 1280,
    largest_r_hat: float = 1.01,
    smallest_effective_size: float = 400.0,
) -> Chains:
    """Draw from a density until the ensembles agree and enough draws are effective.

    Parameters
    ----------
    log_density : callable
        `log_density(points)` for points (n_points, n_parameters): their log densities up to a constant,
        -inf where a point is impossible.
    centre, spread : array (n_parameters,)
        Walkers start at normal points about the centre; make the spread wider than the density.
    names : sequence of str
        Names of the parameters.
    seed : int
        Seed of the random numbers.
    n_ensembles, n_walkers : int, optional
        Independent ensembles, at least two, and walkers of each, an even number of at least four per
        parameter.
    n_steps, most_steps : int, optional
        Steps before the first look at convergence; they double until `most_steps`. The first half of the
        steps is discarded at every look.
    largest_r_hat, smallest_effective_size : float, optional
        Converged is what stays below the first and reaches the second, in the mean and in the tails of all
        parameters.

    Returns
    -------
    Chains

    Raises
    ------
    InputError
        If sizes disagree, the density is impossible at the start, or it returns NaN.
    ConvergenceError
        If it has not converged after `most_steps`; the looks are its history.

    Examples
    --------
    >>> def normal(points):
    ...     return -0.5 * ((points - [1.0, -2.0]) ** 2).sum(axis=1)
    >>> chains = sample(normal, [0.0, 0.0], [2.0, 2.0], ("a", "b"), seed=1)
    >>> chains.mean.round(1).tolist(), (chains.interval() - chains.mean).round(0).tolist()
    ([1.0, -2.0], [[-2.0, -2.0], [2.0, 2.0]])
    """
    labels = tuple(names)
    middle, scale = float_array("centre", centre, 1), float_array("spread", spread, 1)
    _check_sizes(middle, scale, labels)
    whole("n_ensembles", n_ensembles, at_least=2)
    whole("n_walkers", n_walkers, at_least=4 * len(labels))
    if n_walkers % 2:
        raise InputError(f"n_walkers must be even: got {n_walkers}.")
    whole("n_steps", n_steps, at_least=8)
    whole("most_steps", most_steps, at_least=n_steps)
    positive("smallest_effective_size", smallest_effective_size)
    random = np.random.Generator(np.random.Philox(whole("seed", seed, at_least=0)))
    density = _Counted(log_density)

    walkers, heights = _start(density, middle, scale, (n_ensembles, n_walkers), random)
    places: list[FloatArray] = []
    levels: list[FloatArray] = []
    taken: list[float] = []
    history: list[str] = []
    wanted = n_steps
    while True:
        while len(places) < wanted:
            move = _stretch if len(places) % 2 else _leap
            walkers, heights, share = _step(move, density, walkers, heights, random)
            places.append(walkers)
            levels.append(heights)
            taken.append(share)
        # (n_steps, n_ensembles, n_walkers, ...) as they came; ensembles first as they are told.
        kept = np.swapaxes(np.array(places[wanted // 2 :]), 0, 1)
        r_hat = _per_parameter(split_r_hat, kept)
        bulk, tail = _per_parameter(effective_size, kept), _per_parameter(tail_effective_size, kept)
        history.append(
            f"{wanted} steps: R-hat at most {r_hat.max():.4f}, effective draws at least {bulk.min():.0f} in "
            f"the mean and {tail.min():.0f} in the tails, of {kept[..., 0].size}"
        )
        if r_hat.max() <= largest_r_hat and min(bulk.min(), tail.min()) >= smallest_effective_size:
            return Chains(
                names=labels,
                draws=kept,
                log_densities=np.swapaxes(np.array(levels[wanted // 2 :]), 0, 1),
                r_hat=r_hat,
                effective_sizes=bulk,
                tail_effective_sizes=tail,
                autocorrelation_steps=kept[..., 0].size / bulk,
                acceptance=float(np.mean(taken[wanted // 2 :])),
                n_evaluations=density.count,
                seed=seed,
                history=tuple(history),
            )
        if wanted == most_steps:
            slowest = np.minimum(bulk, tail)
            raise ConvergenceError(
                f"The draws have not converged after {most_steps} steps: {labels[int(r_hat.argmax())]} has "
                f"R-hat {r_hat.max():.3f} (wanted: at most {largest_r_hat:g}), and of "
                f"{labels[int(slowest.argmin())]} only {slowest.min():.0f} draws are effective (wanted: "
                f"{smallest_effective_size:g}). Raise most_steps, or look whether the data tell these "
                "parameters at all.",
                tuple(history),
            )
        wanted = min(2 * wanted, most_steps)


class _Counted:
    """A density that counts its evaluations and refuses NaN."""

    def __init__(self, log_density: LogDensity):
        self.log_density = log_density
        self.count = 0

    def __call__(self, points: FloatArray) -> FloatArray:
        flat = points.reshape(-1, points.shape[-1])
        heights = np.asarray(self.log_density(flat), dtype=np.float64)
        if heights.shape != flat.shape[:1]:
            raise InputError(f"log_density must return one number per point: got {heights.shape}.")
        # +inf would hold a walker for ever.
        if np.isnan(heights).any() or (heights == np.inf).any():
            wrong = flat[np.isnan(heights) | (heights == np.inf)][0]
            raise InputError(f"log_density must be a number or -inf: it is not at {wrong.tolist()}.")
        self.count += len(flat)
        return heights.reshape(points.shape[:-1])


def _check_sizes(centre: FloatArray, spread: FloatArray, names: tuple[str, ...]) -> None:
    if not centre.size == spread.size == len(names) or not names:
        raise InputError(
            "centre, spread and names must have one entry per parameter: "
            f"got {centre.size}, {spread.size} and {len(names)}."
        )
    if (spread <= 0.0).any():
        raise InputError(f"spread must be greater than 0 for every parameter: got {spread.tolist()}.")


def _start(
    density: _Counted,
    centre: FloatArray,
    spread: FloatArray,
    shape: tuple[int, int],
    random: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Scatter the walkers; those at impossible points are scattered again."""
    walkers = centre + spread * random.normal(size=(*shape, centre.size))
    heights = density(walkers)
    for _ in range(TRIES):
        lost = ~np.isfinite(heights)
        if not lost.any():
            return walkers, heights
        walkers[lost] = centre + spread * random.normal(size=(int(lost.sum()), centre.size))
        heights[lost] = density(walkers[lost])
    raise InputError(
        f"log_density must be finite near the centre: of {TRIES} points about {centre.tolist()} none was. "
        "Move the centre, or make the spread smaller."
    )


Move = Callable[[FloatArray, FloatArray, np.random.Generator], tuple[FloatArray, FloatArray]]
"""From walkers and those that guide them to proposed points and the logarithm of Hastings' ratio."""


def _step(
    move: Move, density: _Counted, walkers: FloatArray, heights: FloatArray, random: np.random.Generator
) -> tuple[FloatArray, FloatArray, float]:
    """Move either half of every ensemble once; also return the share of walkers that moved."""
    walkers, heights = walkers.copy(), heights.copy()
    half = walkers.shape[1] // 2
    taken = 0
    for moving, guiding in ((slice(0, half), slice(half, None)), (slice(half, None), slice(0, half))):
        proposed, log_ratio = move(walkers[:, moving], walkers[:, guiding], random)
        there = density(proposed)
        accepted = np.log(random.uniform(size=there.shape)) < there - heights[:, moving] + log_ratio
        walkers[:, moving] = np.where(accepted[..., None], proposed, walkers[:, moving])
        heights[:, moving] = np.where(accepted, there, heights[:, moving])
        taken += int(accepted.sum())
    return walkers, heights, taken / heights.size


def _stretch(
    walkers: FloatArray, guides: FloatArray, random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Goodman & Weare's move: z of density 1/sqrt(z) between 1/a and a, y = guide + z (x - guide)."""
    n_parameters = walkers.shape[-1]
    partners = np.take_along_axis(
        guides, random.integers(guides.shape[1], size=(*walkers.shape[:2], 1)), axis=1
    )
    a = LONGEST_STRETCH
    z = ((a - 1.0) * random.uniform(size=walkers.shape[:2]) + 1.0) ** 2 / a
    return partners + z[..., None] * (walkers - partners), (n_parameters - 1.0) * np.log(z)


def _leap(
    walkers: FloatArray, guides: FloatArray, random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Propose near any of the guides: from a mixture of Student distributions, one about each of them.

    Their scale is the guides' covariance, shrunk as for an estimate of a density from so few points.
    """
    n_guides, n_parameters = guides.shape[1:]
    bandwidth = LUMPINESS * (4.0 / (n_guides * (n_parameters + 2.0))) ** (1.0 / (n_parameters + 4.0))
    deviations = guides - guides.mean(axis=1, keepdims=True)
    covariance = np.swapaxes(deviations, 1, 2) @ deviations / (n_guides - 1)
    factor = bandwidth * np.linalg.cholesky(covariance)
    chosen = random.integers(n_guides, size=(*walkers.shape[:2], 1))
    chi_square = random.chisquare(DEGREES_OF_FREEDOM, size=chosen.shape)
    student = random.normal(size=walkers.shape) / np.sqrt(chi_square / DEGREES_OF_FREEDOM)
    proposed = np.take_along_axis(guides, chosen, axis=1) + student @ np.swapaxes(factor, 1, 2)
    return proposed, _log_mixture(walkers, guides, factor) - _log_mixture(proposed, guides, factor)


def _log_mixture(points: FloatArray, guides: FloatArray, factor: FloatArray) -> FloatArray:
    """Log density of the mixture about the guides, up to a constant that the points share."""
    offsets = points[:, :, None, :] - guides[:, None, :, :]
    standard = np.linalg.solve(factor[:, None, None], offsets[..., None])[..., 0]
    degrees = DEGREES_OF_FREEDOM + points.shape[-1]
    return logsumexp(-0.5 * degrees * np.log1p((standard**2).sum(axis=-1) / DEGREES_OF_FREEDOM), axis=-1)


def _per_parameter(measure: Callable[[FloatArray], float], draws: FloatArray) -> FloatArray:
    return np.array([measure(draws[..., index]) for index in range(draws.shape[-1])])
