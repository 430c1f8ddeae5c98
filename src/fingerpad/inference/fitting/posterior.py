"""Draw from any density of a few parameters, and stop only when the draws can be trusted.

Several ensembles of walkers start from scattered points and never hear of each other. An ensemble moves by
turns in one of two ways:

- stretch: one half of the walkers, each along the line to a walker of the other half (Goodman & Weare 2010),
- leap: from wherever a walker is to the neighbourhood of any place where its ensemble was during steps that
  are discarded. These places are a sketch of the density, so that many leaps succeed, a walker soon forgets
  where it started, and walkers exchange places that no path joins.

Both leave the density as it is, whatever its shape: what proposes a stretch knows nothing of the half that
moves, and a sketch stays as it is through all the steps that are kept. Both look the same in any units of the
parameters. Steps of a density are no obstacle: nothing is differentiated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist

from fingerpad.core.checks import FloatArray, finite, float_array, positive, whole
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.inference.fitting.convergence import bulk_effective_size, split_r_hat, tail_effective_size

LogDensity = Callable[[FloatArray], FloatArray]
"""Called with points (n_points, n_parameters); returns their log densities up to a constant, -inf outside."""

LONGEST_STRETCH = 2.0
DEGREES_OF_FREEDOM = 5.0
"""Of the Student distributions: tails heavy enough for walkers that lag behind."""

LUMPINESS = 0.6
"""Bandwidth of the sketch over the one that suits a normal density; those of rates have many lumps. [1]"""

PLACES = 400
"""Places that the sketch of one ensemble is made of."""

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
        Independent draws that would tell the middle, and the ends of a 95 % interval, as well. [1]
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
        Walkers start at normal points about the centre; make the spread wider than the density, or walkers
        that agree on where they started pass for converged.
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
        Converged is what stays below the first and reaches the second, in the middle and in the tails of all
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
    >>> chains.mean.round(0).tolist(), (chains.interval() - chains.mean).round(0).tolist()
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
    sketch: _Sketch | None = None
    while True:
        while len(places) < wanted:
            if sketch is None and len(places) >= wanted // 2:
                sketch = _Sketch(_spread_out(places[len(places) // 2 :]))
            if sketch is None or len(places) % 2:
                walkers, heights, share = _stretch(density, walkers, heights, random)
            else:
                walkers, heights, share = _leap(density, walkers, heights, sketch, random)
            places.append(walkers)
            levels.append(heights)
            taken.append(share)
        # (n_steps, n_ensembles, n_walkers, ...) as they came; ensembles first as they are told.
        kept = np.swapaxes(np.array(places[wanted // 2 :]), 0, 1)
        r_hat = _per_parameter(split_r_hat, kept)
        bulk, tail = _per_parameter(bulk_effective_size, kept), _per_parameter(tail_effective_size, kept)
        history.append(
            f"{wanted} steps: R-hat at most {r_hat.max():.4f}, effective draws at least {bulk.min():.0f} in "
            f"the middle and {tail.min():.0f} in the tails, of {kept[..., 0].size}"
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
        # What is kept from now on begins here, or was discarded before: time for a better sketch.
        wanted, sketch = min(2 * wanted, most_steps), None


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


def _stretch(
    density: _Counted, walkers: FloatArray, heights: FloatArray, random: np.random.Generator
) -> tuple[FloatArray, FloatArray, float]:
    """Move either half once; also return the share of walkers that moved.

    Proposed is y = g + z (x - g), with g any walker of the other half, and z of density 1/sqrt(z) between 1/a
    and a.
    """
    walkers, heights = walkers.copy(), heights.copy()
    n_ensembles, n_walkers, n_parameters = walkers.shape
    half, a = n_walkers // 2, LONGEST_STRETCH
    shares = []
    for moving, guiding in ((slice(0, half), slice(half, None)), (slice(half, None), slice(0, half))):
        which = random.integers(half, size=(n_ensembles, half, 1))
        x, g = walkers[:, moving], np.take_along_axis(walkers[:, guiding], which, axis=1)
        z = ((a - 1.0) * random.uniform(size=(n_ensembles, half)) + 1.0) ** 2 / a
        y, log_ratio = g + z[..., None] * (x - g), (n_parameters - 1.0) * np.log(z)
        walkers[:, moving], heights[:, moving], share = _moved(
            density, x, heights[:, moving], y, log_ratio, random
        )
        shares.append(share)
    return walkers, heights, float(np.mean(shares))


def _leap(
    density: _Counted, walkers: FloatArray, heights: FloatArray, sketch: _Sketch, random: np.random.Generator
) -> tuple[FloatArray, FloatArray, float]:
    """Let every walker leap to anywhere in the sketch; also return the share of those that did."""
    proposed = sketch.draw(walkers.shape[1], random)
    log_ratio = sketch.log_density(walkers) - sketch.log_density(proposed)
    return _moved(density, walkers, heights, proposed, log_ratio, random)


def _moved(
    density: _Counted,
    walkers: FloatArray,
    heights: FloatArray,
    proposed: FloatArray,
    log_ratio: FloatArray,
    random: np.random.Generator,
) -> tuple[FloatArray, FloatArray, float]:
    """Take what is proposed as often as Metropolis and Hastings say; also return the share that was taken.

    `log_ratio` is the logarithm of how much rather the way back is proposed than the way there.
    """
    there = density(proposed)
    taken = np.log(random.uniform(size=there.shape)) < there - heights + log_ratio
    return np.where(taken[..., None], proposed, walkers), np.where(taken, there, heights), float(taken.mean())


class _Sketch:
    """A density of each ensemble's own: a mixture of Student distributions, one about each of its places.

    Their scale is the covariance of the places, shrunk as for an estimate of a density from so many.

    Parameters
    ----------
    places : array (n_ensembles, n_places, n_parameters)
        Where walkers were.
    """

    def __init__(self, places: FloatArray):
        self.places = places
        n_places, n_parameters = places.shape[1:]
        bandwidth = LUMPINESS * (4.0 / (n_places * (n_parameters + 2.0))) ** (1.0 / (n_parameters + 4.0))
        deviations = places - places.mean(axis=1, keepdims=True)
        covariance = np.swapaxes(deviations, 1, 2) @ deviations / (n_places - 1)
        self.factor = bandwidth * np.swapaxes(np.linalg.cholesky(covariance), 1, 2)
        self.inverse = np.linalg.inv(self.factor)

    def draw(self, n_draws: int, random: np.random.Generator) -> FloatArray:
        """So many draws for each ensemble, (n_ensembles, n_draws, n_parameters)."""
        n_ensembles, n_places, n_parameters = self.places.shape
        chosen = random.integers(n_places, size=(n_ensembles, n_draws, 1))
        chi_square = random.chisquare(DEGREES_OF_FREEDOM, size=chosen.shape)
        normal = random.normal(size=(n_ensembles, n_draws, n_parameters))
        student = normal / np.sqrt(chi_square / DEGREES_OF_FREEDOM)
        return np.take_along_axis(self.places, chosen, axis=1) + student @ self.factor

    def log_density(self, points: FloatArray) -> FloatArray:
        """Logarithm up to a constant, (n_ensembles, n_points)."""
        white, centres = points @ self.inverse, self.places @ self.inverse
        squares = np.array([cdist(*pair, "sqeuclidean") for pair in zip(white, centres, strict=True)])
        power = -0.5 * (DEGREES_OF_FREEDOM + points.shape[-1])
        return np.log(((1.0 + squares / DEGREES_OF_FREEDOM) ** power).sum(axis=-1))


def _spread_out(steps: list[FloatArray]) -> FloatArray:
    """Return `PLACES` of each ensemble, (n_ensembles, n_places, n_parameters), out of all steps alike."""
    places = np.concatenate(steps, axis=1)
    count = min(PLACES, places.shape[1])
    return places[:, np.linspace(0, places.shape[1] - 1, count).round().astype(np.int64)]


def _per_parameter(measure: Callable[[FloatArray], float], draws: FloatArray) -> FloatArray:
    return np.array([measure(draws[..., index]) for index in range(draws.shape[-1])])
