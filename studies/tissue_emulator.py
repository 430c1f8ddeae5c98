"""An emulator of presses: principal components of each output, and a Gaussian process for each component.

A component is a smooth function of the parameters. Its prior is Gaussian with zero mean after
standardisation, and the covariance

    k(x, x') = a^2 (1 + (x - 1/2) (x' - 1/2)) + s^2 exp(-sum_i (x_i - x'_i)^2 / 2 l_i^2) + n^2 (x = x'),

a linear trend, smooth departures from it with one length per parameter, and the scatter n of the meshes.
The numbers a, s, l_i and n maximise the marginal likelihood (Rasmussen & Williams 2006, chapters 2 and 5)
with weak priors on their logarithms.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_solve, solve_triangular
from scipy.optimize import minimize

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray, float_array, whole

KEPT = 0.99999
"""Share of the variance of an output over the design that its components keep."""

MOST_COMPONENTS = 8

FEWEST_POINTS = 4

_LOG_MEAN = {"linear": 0.0, "smooth": -0.7, "length": 0.3, "scatter": -4.5}
_LOG_SPREAD = {"linear": 1.0, "smooth": 1.0, "length": 0.8, "scatter": 1.5}
"""Priors of the logarithms of a, s, l_i (parameters run from 0 to 1) and n, for standardised outputs."""


@dataclass(frozen=True)
class GaussianProcess:
    """A number as a smooth function of parameters, from its values at some points.

    Values (n_points,) are known at points (n_points, n_parameters). The numbers of the covariance are the
    logarithms of a, s, n and the lengths, (3 + n_parameters,).

    Examples
    --------
    >>> points = np.linspace(0.0, 1.0, 9)[:, None]
    >>> process = GaussianProcess.fit(points, np.sin(3.0 * points[:, 0]))
    >>> mean, deviation = process.predict(np.array([[0.3]]))
    >>> bool(abs(mean[0] - np.sin(0.9)) < 1e-2), bool(deviation[0] < 0.05)
    (True, True)
    """

    points: FloatArray
    values: FloatArray
    logarithms: FloatArray

    def __post_init__(self) -> None:
        points = float_array("points", self.points, 2)
        values = float_array("values", self.values, 1)
        if len(points) != values.size:
            raise InputError(f"values needs one entry per point: got {values.size} for {len(points)} points.")

    @cached_property
    def _factor(self) -> FloatArray:
        return np.asarray(np.linalg.cholesky(_covariance(self.points, self.logarithms)), dtype=np.float64)

    @cached_property
    def _mean(self) -> float:
        return float(self.values.mean())

    @cached_property
    def _spread(self) -> float:
        return float(self.values.std()) or 1.0

    @cached_property
    def _weights(self) -> FloatArray:
        return np.asarray(cho_solve((self._factor, True), (self.values - self._mean) / self._spread))

    @classmethod
    def fit(cls, points: ArrayLike, values: ArrayLike) -> GaussianProcess:
        """Choose the numbers of the covariance that explain the values best."""
        at, known = float_array("points", points, 2), float_array("values", values, 1)
        standard = (known - known.mean()) / (known.std() or 1.0)
        n_parameters = at.shape[1]
        centre, spread = (
            np.array([kind["linear"], kind["smooth"], kind["scatter"], *[kind["length"]] * n_parameters])
            for kind in (_LOG_MEAN, _LOG_SPREAD)
        )

        def cost(logarithms: FloatArray) -> float:
            try:
                factor = np.linalg.cholesky(_covariance(at, logarithms))
            except np.linalg.LinAlgError:
                return 1e10
            white = solve_triangular(factor, standard, lower=True)
            evidence = -0.5 * float(white @ white) - float(np.log(np.diagonal(factor)).sum())
            return 0.5 * float(np.square((logarithms - centre) / spread).sum()) - evidence

        bounds = list(zip(centre - 4.0 * spread, centre + 4.0 * spread, strict=True))
        found = minimize(cost, centre, method="L-BFGS-B", bounds=bounds)
        return cls(at, known, np.asarray(found.x))

    def predict(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and standard deviation (n,) at points (n, n_parameters), the scatter not included."""
        cross = _kernel(points, self.points, self.logarithms)
        mean = cross @ self._weights
        white = solve_triangular(self._factor, cross.T, lower=True)
        variance = _prior_variance(points, self.logarithms) - np.square(white).sum(axis=0)
        return self._mean + self._spread * mean, self._spread * np.sqrt(np.maximum(variance, 0.0))

    def mean(self, points: FloatArray) -> FloatArray:
        """Mean (n,) at points (n, n_parameters), faster than with its deviation."""
        return self._mean + self._spread * (_kernel(points, self.points, self.logarithms) @ self._weights)


def _kernel(first: FloatArray, second: FloatArray, logarithms: FloatArray) -> FloatArray:
    linear, smooth = np.exp(2.0 * logarithms[:2])
    lengths = np.exp(logarithms[3:])
    scaled, other = first / lengths, second / lengths
    squares = np.square(scaled).sum(axis=1)[:, None] + np.square(other).sum(axis=1) - 2.0 * scaled @ other.T
    trend = linear * (1.0 + (first - 0.5) @ (second - 0.5).T)
    return np.asarray(trend + smooth * np.exp(-0.5 * np.maximum(squares, 0.0)))


def _covariance(points: FloatArray, logarithms: FloatArray) -> FloatArray:
    kernel = _kernel(points, points, logarithms)
    kernel[np.diag_indices(len(points))] += np.exp(2.0 * logarithms[2])
    return kernel


def _prior_variance(points: FloatArray, logarithms: FloatArray) -> FloatArray:
    linear, smooth = np.exp(2.0 * logarithms[:2])
    return np.asarray(linear * (1.0 + np.square(points - 0.5).sum(axis=1)) + smooth)


@dataclass(frozen=True)
class Components:
    """Principal components of an output, each a Gaussian process.

    An output of a shape has a mean (n_values,) over the design and orthonormal directions (n_components,
    n_values).
    """

    shape: tuple[int, ...]
    mean: FloatArray
    directions: FloatArray
    processes: tuple[GaussianProcess, ...]

    @classmethod
    def fit(cls, points: FloatArray, values: FloatArray) -> Components:
        """Decompose outputs (n_points, ...), and fit a process to each component that is kept."""
        rows = values.reshape(len(values), -1)
        mean = rows.mean(axis=0)
        _, sizes, directions = np.linalg.svd(rows - mean, full_matrices=False)
        shares = np.cumsum(np.square(sizes)) / max(float(np.square(sizes).sum()), np.finfo(float).tiny)
        count = min(int(np.searchsorted(shares, KEPT)) + 1, MOST_COMPONENTS, len(sizes))
        scores = (rows - mean) @ directions[:count].T
        processes = tuple(GaussianProcess.fit(points, column) for column in scores.T)
        return cls(values.shape[1:], mean, directions[:count], processes)

    def predict(self, points: FloatArray) -> FloatArray:
        """Return outputs (n, ...) at points (n, n_parameters)."""
        scores = np.stack([process.mean(points) for process in self.processes], axis=1)
        return (self.mean + scores @ self.directions).reshape(len(points), *self.shape)


@dataclass(frozen=True)
class Emulator:
    """Several outputs, by name, as functions of the same parameters.

    Examples
    --------
    >>> points = np.random.default_rng(1).uniform(size=(24, 2))
    >>> lines = points[:, :1] + np.outer(points[:, 1], [1.0, 2.0, 3.0])
    >>> emulator = Emulator.fit(points, {"line": lines})
    >>> emulator.predict(np.array([[0.5, 0.5]]))["line"].round(2).tolist()
    [[1.0, 1.5, 2.0]]
    """

    outputs: Mapping[str, Components]

    @classmethod
    def fit(cls, points: ArrayLike, outputs: Mapping[str, FloatArray]) -> Emulator:
        """Fit every output (n_points, ...) at points (n_points, n_parameters), each parameter from 0 to 1."""
        at = float_array("points", points, 2)
        if len(at) < FEWEST_POINTS:
            raise InputError(f"points needs at least {FEWEST_POINTS} rows: got {len(at)}.")
        for name, values in outputs.items():
            if len(values) != len(at):
                raise InputError(f"{name} needs one row per point: got {len(values)} for {len(at)}.")
        return cls({name: Components.fit(at, values) for name, values in outputs.items()})

    def predict(self, points: FloatArray) -> dict[str, FloatArray]:
        """Return outputs (n, ...) at points (n, n_parameters), by name."""
        return {name: components.predict(points) for name, components in self.outputs.items()}


def left_out(
    points: FloatArray, outputs: Mapping[str, FloatArray], n_folds: int
) -> tuple[list[Emulator], IntArray]:
    """Fit one emulator per fold to the points outside of it; every n-th point is in the same fold.

    Also return the number of the emulator that has not seen each point, (n_points,).
    """
    unseen = np.arange(len(points)) % whole("n_folds", n_folds, at_least=2)
    emulators = []
    for number in range(n_folds):
        others = unseen != number
        emulators.append(Emulator.fit(points[others], {name: each[others] for name, each in outputs.items()}))
    return emulators, unseen
