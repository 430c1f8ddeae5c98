"""MCMC sampling of any density of a few parameters; draws are returned only once they have converged.

Several independent ensembles of walkers are sampled with emcee (Foreman-Mackey et al. 2013) from scattered
starts. Each step of an ensemble moves one half of its walkers, then the other, by one of two proposals, drawn
at random:

- `StretchMove`: along the line to a walker of the other half (Goodman & Weare 2010),
- `KDEMove`: to a draw from a kernel density estimate of the other half, so that a walker forgets its start
  soon and moves between modes that no path of high density joins.

Both are invariant under linear transformations of the parameters and need no derivatives. The first half of
all steps is discarded. Convergence is judged by split R-hat over the ensembles and by effective sample sizes.
The walkers of one ensemble are not independent chains, but the ensembles are. R-hat therefore compares halves
of ensembles, and the autocorrelation is that of the mean of an ensemble over the steps, which includes the
correlation between its walkers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import emcee
import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri
from scipy.stats import rankdata
from threadpoolctl import threadpool_limits

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.random_streams import Key, emcee_state, generator, independent_keys
from fingerpad.core.values import FloatArray

TAILS = (0.025, 0.975)  # Quantiles of the effective sample size of the tails: the ends of a 95 % interval.


def split_r_hat(draws: FloatArray) -> float:
    """Return split R-hat of draws (n_ensembles, n_steps, n_walkers): 1 if all halves are alike, else larger.

    R-hat = sqrt(((n - 1)/n W + B)/W) with W the mean variance within halves of n draws, and B the variance
    of their means, both of rank-normalised draws (Vehtari, Gelman, Simpson, Carpenter & Bürkner 2021).
    """
    distances = np.abs(draws - np.median(draws))
    return max(_r_hat(_normal_scores(draws)), _r_hat(_normal_scores(distances)))


def effective_size(draws: FloatArray) -> float:
    """Return the effective sample size of the mean.

    The series of each ensemble is the mean of its walkers. The variance of the mean of such series is
    var (1 + 2 sum rho_t)/(n_ensembles n_steps). The sum of autocorrelations is truncated at the first pair
    that is not positive, and pairs are made monotone (Geyer 1992).
    """
    variance = float(draws.var())
    if variance == 0.0:
        return float(draws.size)
    series = draws.mean(axis=2)
    n_ensembles, n_steps = series.shape
    correlations, spread = _autocorrelations(series)
    pairs = correlations[: n_steps // 2 * 2].reshape(-1, 2).sum(axis=1)
    positive = int(np.argmax(pairs <= 0.0)) if (pairs <= 0.0).any() else pairs.size
    # An estimate above that of independent draws, as for antithetic chains, is not reliable.
    time = max(2.0 * float(np.minimum.accumulate(pairs[:positive]).sum()) - 1.0, 1.0 / draws.shape[2])
    variance_of_mean = spread * time / (n_ensembles * n_steps)
    return float(min(variance / variance_of_mean, draws.size))


def effective_sizes(draws: FloatArray) -> tuple[float, float]:
    """Return the effective sample sizes of the centre and of the tails.

    Vehtari, Gelman, Simpson, Carpenter & Bürkner 2021.
    """
    tails = (draws <= end for end in np.quantile(draws, TAILS))
    return effective_size(_normal_scores(draws)), min(effective_size(1.0 * tail) for tail in tails)


def _normal_scores(values: FloatArray) -> FloatArray:
    ranks = rankdata(values, axis=None).reshape(values.shape)
    return ndtri((ranks - 0.375) / (values.size + 0.25))


def _r_hat(values: FloatArray) -> float:
    half = values.shape[1] // 2
    chains = np.concatenate([values[:, :half], values[:, -half:]]).reshape(2 * values.shape[0], -1)
    n = chains.shape[1]
    within = float(chains.var(axis=1, ddof=1).mean())
    if within == 0.0:
        return 1.0 if float(np.ptp(chains)) == 0.0 else float("inf")
    between = float(chains.mean(axis=1).var(ddof=1))
    return float(np.sqrt(((n - 1) / n * within + between) / within))


def _autocorrelations(series: FloatArray) -> tuple[FloatArray, float]:
    """Autocorrelations of several series of one distribution, (n_steps,), and their variance."""
    # Differences between the means of the series count as correlation at all lags.
    n_series, n_steps = series.shape
    centred = series - series.mean(axis=1, keepdims=True)
    spectrum = np.abs(np.fft.rfft(centred, 2 * n_steps, axis=1)) ** 2
    covariances = np.fft.irfft(spectrum, axis=1)[:, :n_steps].mean(axis=0) / n_steps
    within = covariances[0] * n_steps / (n_steps - 1)
    spread = float(covariances[0] + series.mean(axis=1).var(ddof=1)) if n_series > 1 else float(within)
    correlations = 1.0 - (within - covariances) / spread
    correlations[0] = 1.0
    return correlations, spread


LogDensity = Callable[[FloatArray], FloatArray]
"""From points (n_points, n_parameters) to their log densities up to a constant, -inf outside."""

BANDWIDTH = 0.5  # Bandwidth of the kernel density estimate, in standard deviations of the walkers. [1]
MOST_TRIES = 200  # Times that a start at an impossible point is drawn again.


@dataclass(frozen=True)
class Chains:
    """Converged draws from a density, and the measures of convergence."""

    draws: FloatArray  #: The second half of all steps, (n_ensembles, n_steps, n_walkers, n_parameters).
    log_densities: FloatArray  #: Up to a constant, (n_ensembles, n_steps, n_walkers).
    r_hat: FloatArray  #: Split R-hat over the ensembles, (n_parameters,). [1]
    effective_sizes: FloatArray
    tail_effective_sizes: FloatArray
    """Effective sample sizes for the middle and for the ends of a 95 % interval, (n_parameters,). [1]"""
    autocorrelation_steps: FloatArray  #: Draws made per effective one, (n_parameters,). [1]
    acceptance: float  #: Accepted share of the proposals. [0-1]
    n_evaluations: int  #: Evaluations of the density, those of the discarded first half included.

    @property
    def flat(self) -> FloatArray:
        """All draws (n_draws, n_parameters)."""
        return self.draws.reshape(-1, self.draws.shape[-1])

    def spread_out(self, n_draws: int) -> FloatArray:
        """Return some of the draws (n_draws, n_parameters), evenly spaced along the chains."""
        count = min(n_draws, len(self.flat))
        return self.flat[np.linspace(0, len(self.flat) - 1, count).round().astype(np.int64)]


def credible_band(draws: FloatArray, level: float = 0.95) -> FloatArray:
    """Return the central interval that contains a share `level` of the draws, for each column."""
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
    """Sample a density until the ensembles agree and the effective sample sizes suffice."""
    middle, scale = np.asarray(centre, dtype=np.float64), np.asarray(spread, dtype=np.float64)
    density = _Checked(log_density)
    usual = [(emcee.moves.StretchMove(), 0.5), (emcee.moves.KDEMove(bw_method=BANDWIDTH), 0.5)]

    def ensemble(key: Key) -> tuple[emcee.EnsembleSampler, emcee.State]:
        """Walkers with random numbers of their own, and their start at scattered points."""
        start, proposals = independent_keys(key, 2)
        walkers, heights = _start(density, middle, scale, n_walkers, generator(start))
        chosen = list(moves or usual)
        sampler = emcee.EnsembleSampler(n_walkers, middle.size, density, moves=chosen, vectorize=True)
        sampler.random_state = emcee_state(proposals)
        return sampler, emcee.State(walkers, log_prob=heights, random_state=sampler.random_state)

    ensembles = [ensemble(key) for key in independent_keys(seed, n_ensembles)]
    history: list[str] = []
    done, wanted = 0, n_steps
    while True:
        # On several threads, BLAS takes a hundred times as long for the small systems of KDEMove.
        with threadpool_limits(limits=1):
            for sampler, start in ensembles:
                sampler.run_mcmc(None if done else start, wanted - done)
        done = wanted
        draws = np.array([sampler.get_chain(discard=done // 2) for sampler, _ in ensembles])
        each = np.moveaxis(draws, -1, 0)
        r_hat = np.array([split_r_hat(one) for one in each])
        bulk, tail = np.array([effective_sizes(one) for one in each]).T
        history.append(
            f"{done} steps: R-hat at most {r_hat.max():.4f}, effective sample size at least {bulk.min():.0f} "
            f"in the middle and {tail.min():.0f} in the tails, of {draws[..., 0].size} draws"
        )
        if r_hat.max() <= largest_r_hat and min(bulk.min(), tail.min()) >= smallest_effective_size:
            return Chains(
                draws=draws,
                log_densities=np.array([sampler.get_log_prob(discard=done // 2) for sampler, _ in ensembles]),
                r_hat=r_hat,
                effective_sizes=bulk,
                tail_effective_sizes=tail,
                autocorrelation_steps=draws[..., 0].size / bulk,
                # A walker is proposed one move per step, and an accepted one changes its position.
                acceptance=float(np.any(np.diff(draws, axis=1) != 0.0, axis=-1).mean()),
                n_evaluations=density.count,
            )
        if done == most_steps:
            smaller = np.minimum(bulk, tail)
            raise ConvergenceError(
                f"The draws have not converged after {most_steps} steps: {names[int(r_hat.argmax())]} has "
                f"R-hat {r_hat.max():.3f} (wanted: at most {largest_r_hat:g}), and the effective sample size "
                f"of {names[int(smaller.argmin())]} is only {smaller.min():.0f} (wanted: "
                f"{smallest_effective_size:g}). Raise most_steps, or check whether the data determine these "
                "parameters.",
                tuple(history),
            )
        wanted = min(2 * done, most_steps)


class _Checked:
    """A density that counts its evaluations and rejects what is no log density."""

    def __init__(self, log_density: LogDensity):
        self.log_density = log_density
        self.count = 0

    def __call__(self, points: FloatArray) -> FloatArray:
        heights = np.asarray(self.log_density(points), dtype=np.float64)
        if heights.shape != points.shape[:1]:
            raise InputError("log_density", "must return one number per point", str(heights.shape))
        # A walker at +inf would never move again.
        wrong = np.isnan(heights) | (heights == np.inf)
        if wrong.any():
            raise InputError(
                "log_density", "must be a number or -inf", remedy=f"it is not at {points[wrong][0].tolist()}"
            )
        self.count += len(points)
        return heights


def _start(
    density: _Checked, centre: FloatArray, spread: FloatArray, n_walkers: int, random: np.random.Generator
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
        "log_density",
        "must be finite near the centre",
        remedy=f"of {MOST_TRIES} points about {centre.tolist()} none was. Move the centre, or make the "
        "spread smaller",
    )
