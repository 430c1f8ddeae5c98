"""Sobol indices: the share of the variance of a quantity that each parameter explains, alone and in total.

`identifiability` finds the combinations of parameters that data determine, by the singular values of the
Jacobian of a model's outputs by shares of the parameters. Data cannot determine the parameters along a
direction with a singular value of zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.special import ndtri

from fingerpad.core.checked import result_class
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import generator
from fingerpad.core.values import FloatArray, IntArray, Number, Vector, float_array

BatchObjective = Callable[[FloatArray], FloatArray]
"""Called with points (n_points, n_parameters); returns one number for each."""

SOBOL_RESAMPLES = 200  # Bootstrap resamples behind the confidence intervals of the indices.


@result_class
class SobolIndices:
    """Shares of the variance of an objective, of parameters that are uniform within ranges."""

    lower: Vector
    upper: Vector  #: Range of each parameter, (n_parameters,).
    first: Vector
    first_half_width: Vector
    """First-order index, what a parameter explains alone, and half of its confidence interval. [1]"""
    total: Vector
    total_half_width: Vector  #: The share explained alone and in interaction with others, likewise. [1]
    mean: Number
    standard_deviation: Number  #: Of the objective over the ranges.
    evaluations: int


def sobol_indices(
    objective: BatchObjective,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    seed: int,
    n_base: int = 512,
    level: float = 0.95,
) -> SobolIndices:
    """Estimate first-order and total Sobol indices with `scipy.stats.sobol_indices`.

    Saltelli et al. 2010. SciPy's own bootstrap of the indices takes no seed, so the points of the design are
    resampled here; a half width is that of a normal interval with the bootstrap's standard error.
    """
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    random = generator(seed)
    values: list[FloatArray] = []  # at A, at B, and at A with each column of B: parts of Saltelli's design

    def evaluate(points: FloatArray) -> FloatArray:
        values.append(float_array("objective", objective(np.ascontiguousarray(points.T)), 1))
        return values[-1].copy()  # SciPy subtracts the mean in place

    uniform = [stats.uniform(*side) for side in zip(low, high - low, strict=True)]
    found = stats.sobol_indices(func=evaluate, n=n_base, dists=uniform, rng=random)
    everything = np.concatenate(values)
    if np.ptp(everything) == 0.0:
        raise InputError("objective", "must vary within the ranges", remedy="it is constant")
    at_a, at_b = values[0][None], values[1][None]
    at_ab = np.moveaxis(values[2].reshape(n_base, low.size), -1, 0)[:, None]

    def resampled(rows: IntArray) -> FloatArray:
        parts = {"f_A": at_a[:, rows], "f_B": at_b[:, rows], "f_AB": at_ab[..., rows]}
        again = stats.sobol_indices(func=parts, n=n_base)
        return np.stack([again.first_order, again.total_order])

    settings = {"vectorized": False, "n_resamples": SOBOL_RESAMPLES, "method": "percentile", "rng": random}
    spread = stats.bootstrap((np.arange(n_base),), resampled, **settings).standard_error
    half_widths = ndtri(0.5 + 0.5 * level) * spread
    return SobolIndices(
        lower=low,
        upper=high,
        first=found.first_order,
        first_half_width=half_widths[0],
        total=found.total_order,
        total_half_width=half_widths[1],
        mean=everything.mean(),
        standard_deviation=everything.std(),
        evaluations=everything.size,
    )


Answer = Callable[[FloatArray], FloatArray]
"""From parameters (n_parameters,) to observable outputs (n_answers,)."""

JACOBIAN_STEP = 1e-6  # Step over the parameter: so small that outputs with jumps rarely jump within it. [1]

ZERO = 1e-5
"""Singular values below this share of the largest count as zero: above the round-off of such steps. [1]"""


@dataclass(frozen=True)
class Identifiability:
    """Identifiable directions of parameters."""

    names: tuple[str, ...]
    singular_values: FloatArray
    """Change of the outputs per unit step along each direction, largest first, (n_parameters,)."""
    directions: FloatArray
    """One unit direction per row, in shares, singular value 0 last, (n_parameters, n_parameters)."""
    rank: int  #: Number of singular values above zero, the number of identifiable combinations.

    @property
    def silent_directions(self) -> FloatArray:
        """Directions along which no output changes, (n_parameters - rank, n_parameters)."""
        return self.directions[self.rank :]


def identifiability(answer: Answer, parameters: ArrayLike, names: Sequence[str]) -> Identifiability:
    """Find the combinations of parameters on which outputs depend, and those on which they do not."""
    centre, labels = float_array("parameters", parameters, 1), tuple(names)
    if not centre.all():
        raise InputError("parameters", "must not be 0, since steps are shares of them", str(centre.tolist()))
    # The Jacobian: change of every output per share of every parameter, by central differences.
    columns = [
        (float_array("answer", answer(centre + move), 1) - float_array("answer", answer(centre - move), 1))
        / (2.0 * JACOBIAN_STEP)
        for move in np.diag(JACOBIAN_STEP * np.abs(centre))
    ]
    table = np.stack(columns, axis=1)
    _, values, directions = np.linalg.svd(table, full_matrices=False)
    rank = int((values > ZERO * values[0]).sum()) if values[0] > 0.0 else 0
    return Identifiability(labels, values, directions, rank)
