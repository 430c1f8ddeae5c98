"""MCMC sampling of any density of a few parameters; draws are returned only once they have converged.

Several independent ensembles of walkers are sampled with emcee (Foreman-Mackey et al. 2013) from scattered
starts. Each step of an ensemble moves one half of its walkers, then the other, by one of two proposals, drawn
at random:

- `StretchMove`: along the line to a walker of the other half (Goodman & Weare 2010),
- `KDEMove`: to a draw from a kernel density estimate of the other half, so that a walker forgets its start
  soon and moves between modes that no path of high density joins.

Both are invariant under linear transformations of the parameters and need no derivatives. The first half of
all steps is discarded. Convergence is judged by split R-hat over the ensembles and by effective sample sizes
(`fingerpad.inference.fitting.convergence`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import emcee
import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from fingerpad.core.checks import FloatArray, finite, float_array, positive, whole
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.inference.fitting.convergence import effective_sizes, split_r_hat

LogDensity = Callable[[FloatArray], FloatArray]
"""From points (n_points, n_parameters) to their log densities up to a constant, -inf outside."""

BANDWIDTH = 0.5
"""Bandwidth of the kernel density estimate, in standard deviations of the walkers. [1]"""

MOST_TRIES = 200
"""Times that a start at an impossible point is drawn again."""


@dataclass(frozen=True)
class Chains:
    """Converged draws from a density, and the measures of convergence.

    Parameters
    ----------
    names : tuple of str
        Names of the parameters.
    draws : array (n_ensembles, n_steps, n_walkers, n_parameters)
        The second half of all steps.
    log_densities : array (n_ensembles, n_steps, n_walkers)
        Up to a constant.
    r_hat : array (n_parameters,)
        Split R-hat over the ensembles. [1]
    effective_sizes, tail_effective_sizes : array (n_parameters,)
        Effective sample sizes for the middle and for the ends of a 95 % interval. [1]
    autocorrelation_steps : array (n_parameters,)
        Draws made per effective one. [1]
    acceptance : float
        Accepted share of the proposals. [0-1]
    n_evaluations : int
        Evaluations of the density, those of the discarded first half included.
    seed : int
        Of the random numbers; the same seed gives the same bits.
    history : tuple of str
        One line per check of convergence.
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

    def spread_out(self, n_draws: int) -> FloatArray:
        """Return some of the draws (n_draws, n_parameters), evenly spaced along the chains.

        Parameters
        ----------
        n_draws : int
            All draws if there are fewer.
        """
        count = min(whole("n_draws", n_draws, at_least=1), len(self.flat))
        return self.flat[np.linspace(0, len(self.flat) - 1, count).round().astype(np.int64)]


def credible_band(draws: FloatArray, level: float = 0.95) -> FloatArray:
    """Return the central interval that contains a share `level` of the draws, for each column.

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
    n_walkers: int = 200,
    n_steps: int = 80,
    most_steps: int = 1280,
    largest_r_hat: float = 1.01,
    smallest_effective_size: float = 400.0,
    moves: Sequence[tuple[Any, float]] | None = None,
) -> Chains:
    """Sample a density until the ensembles agree and the effective sample sizes suffice.

    Parameters
    ----------
    log_density : callable
        `log_density(points)` for points (n_points, n_parameters): their log densities up to a constant,
        -inf where a point is impossible.
    centre, spread : array (n_parameters,)
        Walkers start at normally distributed points about the centre. The spread must be wider than the
        density: walkers that share a start too close to each other pass for converged.
    names : sequence of str
        Names of the parameters.
    seed : int
        Seed of the random numbers.
    n_ensembles, n_walkers : int, optional
        Independent ensembles, at least two, and walkers of each, an even number of at least four per
        parameter.
    n_steps, most_steps : int, optional
        Steps before the first check of convergence; the number doubles until `most_steps`. The first half of
        the steps is discarded at every check.
    largest_r_hat, smallest_effective_size : float, optional
        Limits of convergence: R-hat at most the first, effective sample sizes at least the second, for the
        middle and the tails of all parameters.
    moves : sequence of (emcee.moves.Move, float), optional
        Proposals and how often each is made. Default: both of this module, equally often.

    Returns
    -------
    Chains

    Raises
    ------
    InputError
        If sizes disagree, the density is impossible at the start, or it returns NaN.
    ConvergenceError
        If it has not converged after `most_steps`; its history has one line per check.

    Examples
    --------
    >>> def normal(points):
    ...     return -0.5 * ((points - [1.0, -2.0]) ** 2).sum(axis=1)
    >>> chains = sample(normal, [0.0, 0.0], [2.0, 2.0], ("a", "b"), seed=1)
    >>> chains.flat.mean(axis=0).round(0).tolist()
    [1.0, -2.0]
    >>> (credible_band(chains.flat) - [1.0, -2.0]).round(0).tolist()
    [[-2.0, -2.0], [2.0, 2.0]]
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
    density = _Checked(log_density)
    seeds = np.random.SeedSequence(whole("seed", seed, at_least=0)).spawn(n_ensembles)
    proposals = list(moves) if moves is not None else _moves()
    ensembles = [_ensemble(density, middle, scale, n_walkers, one, proposals) for one in seeds]
    history: list[str] = []
    done, wanted = 0, n_steps
    while True:
        # On several threads, BLAS takes a hundred times as long for the small systems of KDEMove.
        with threadpool_limits(limits=1):
            for ensemble in ensembles:
                ensemble.run(wanted - done)
        done = wanted
        draws = np.array([ensemble.sampler.get_chain(discard=done // 2) for ensemble in ensembles])
        each = np.moveaxis(draws, -1, 0)
        r_hat = np.array([split_r_hat(one) for one in each])
        bulk, tail = np.array([effective_sizes(one) for one in each]).T
        history.append(
            f"{done} steps: R-hat at most {r_hat.max():.4f}, effective sample size at least {bulk.min():.0f} "
            f"in the middle and {tail.min():.0f} in the tails, of {draws[..., 0].size} draws"
        )
        if r_hat.max() <= largest_r_hat and min(bulk.min(), tail.min()) >= smallest_effective_size:
            return Chains(
                names=labels,
                draws=draws,
                log_densities=np.array(
                    [ensemble.sampler.get_log_prob(discard=done // 2) for ensemble in ensembles]
                ),
                r_hat=r_hat,
                effective_sizes=bulk,
                tail_effective_sizes=tail,
                autocorrelation_steps=draws[..., 0].size / bulk,
                # A walker is proposed one move per step, and an accepted one changes its position.
                acceptance=float(np.any(np.diff(draws, axis=1) != 0.0, axis=-1).mean()),
                n_evaluations=density.count,
                seed=seed,
                history=tuple(history),
            )
        if done == most_steps:
            smaller = np.minimum(bulk, tail)
            raise ConvergenceError(
                f"The draws have not converged after {most_steps} steps: {labels[int(r_hat.argmax())]} has "
                f"R-hat {r_hat.max():.3f} (wanted: at most {largest_r_hat:g}), and the effective sample size "
                f"of {labels[int(smaller.argmin())]} is only {smaller.min():.0f} (wanted: "
                f"{smallest_effective_size:g}). Raise most_steps, or check whether the data determine these "
                "parameters.",
                tuple(history),
            )
        wanted = min(2 * done, most_steps)


def _moves() -> list[tuple[Any, float]]:
    return [(emcee.moves.StretchMove(), 0.5), (emcee.moves.KDEMove(bw_method=BANDWIDTH), 0.5)]


@dataclass
class _Ensemble:
    """A sampler and its present state."""

    sampler: emcee.EnsembleSampler
    state: emcee.State

    def run(self, n_steps: int) -> None:
        self.state = self.sampler.run_mcmc(self.state, n_steps)


def _ensemble(
    density: _Checked,
    centre: FloatArray,
    spread: FloatArray,
    n_walkers: int,
    seed: np.random.SeedSequence,
    proposals: list[tuple[Any, float]],
) -> _Ensemble:
    """Start an ensemble at scattered points, with random numbers of its own."""
    start, moves = seed.spawn(2)
    walkers, heights = _start(
        density, centre, spread, n_walkers, np.random.Generator(np.random.Philox(start))
    )
    sampler = emcee.EnsembleSampler(
        n_walkers,
        centre.size,
        density,
        moves=proposals,
        vectorize=True,
    )
    sampler.random_state = np.random.RandomState(np.random.MT19937(moves)).get_state()
    return _Ensemble(sampler, emcee.State(walkers, log_prob=heights, random_state=sampler.random_state))


class _Checked:
    """A density that counts its evaluations and rejects what is no log density."""

    def __init__(self, log_density: LogDensity):
        self.log_density = log_density
        self.count = 0

    def __call__(self, points: FloatArray) -> FloatArray:
        heights = np.asarray(self.log_density(points), dtype=np.float64)
        if heights.shape != points.shape[:1]:
            raise InputError(f"log_density must return one number per point: got {heights.shape}.")
        # A walker at +inf would never move again.
        wrong = np.isnan(heights) | (heights == np.inf)
        if wrong.any():
            raise InputError(
                f"log_density must be a number or -inf: it is not at {points[wrong][0].tolist()}."
            )
        self.count += len(points)
        return heights


def _check_sizes(centre: FloatArray, spread: FloatArray, names: tuple[str, ...]) -> None:
    if not centre.size == spread.size == len(names) or not names:
        raise InputError(
            "centre, spread and names must have one entry per parameter: "
            f"got {centre.size}, {spread.size} and {len(names)}."
        )
    if (spread <= 0.0).any():
        raise InputError(f"spread must be greater than 0 for every parameter: got {spread.tolist()}.")


def _start(
    density: _Checked,
    centre: FloatArray,
    spread: FloatArray,
    n_walkers: int,
    random: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Draw normally distributed starts; those at impossible points are drawn again."""
    walkers = centre + spread * random.normal(size=(n_walkers, centre.size))
    heights = density(walkers)
    for _ in range(MOST_TRIES):
        lost = ~np.isfinite(heights)
        if not lost.any():
            return walkers, heights
        walkers[lost] = centre + spread * random.normal(size=(int(lost.sum()), centre.size))
        heights[lost] = density(walkers[lost])
    raise InputError(
        f"log_density must be finite near the centre: of {MOST_TRIES} points about {centre.tolist()} none "
        "was. Move the centre, or make the spread smaller."
    )
