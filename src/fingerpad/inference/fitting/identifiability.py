"""Identifiable combinations of parameters: singular values of the Jacobian of a model's outputs.

Derivatives are with respect to the parameters over their scales. Data cannot determine the parameters along a
direction with a singular value of zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, float_array, positive
from fingerpad.core.errors import InputError

Answer = Callable[[FloatArray], FloatArray]
"""From parameters (n_parameters,) to observable outputs (n_answers,)."""

JACOBIAN_STEP = 1e-6
"""Step over the scale of a parameter: so small that outputs with jumps rarely jump within it. [1]"""

ZERO = 1e-5
"""Singular values below this share of the largest count as zero: above the round-off of such steps. [1]"""


@dataclass(frozen=True)
class Identifiability:
    """Identifiable directions of parameters.

    Parameters
    ----------
    names : tuple of str
        Names of the parameters.
    singular_values : array (n_parameters,)
        Change of the outputs per unit step along each direction, largest first.
    directions : array (n_parameters, n_parameters)
        One unit direction per row, in units of the scales; those with singular value 0 are last.
    rank : int
        Number of singular values above zero, the number of identifiable combinations.
    """

    names: tuple[str, ...]
    singular_values: FloatArray
    directions: FloatArray
    rank: int

    @property
    def silent_directions(self) -> FloatArray:
        """Directions along which no output changes, (n_parameters - rank, n_parameters)."""
        return self.directions[self.rank :]


def jacobian(
    answer: Answer, parameters: ArrayLike, scales: ArrayLike, step: float = JACOBIAN_STEP
) -> FloatArray:
    """Change of every output per scale of every parameter, by central differences.

    Parameters
    ----------
    answer : callable
        From parameters (n_parameters,) to outputs (n_answers,).
    parameters, scales : array (n_parameters,)
        The point, and the scale of each parameter, such as |parameters|.
    step : float, optional
        Half width of a difference over the scale. A wide one averages over jumps of the outputs.

    Returns
    -------
    array (n_answers, n_parameters)

    Raises
    ------
    InputError
        If a scale or the step is not positive, or an output is not finite.

    Examples
    --------
    >>> jacobian(lambda p: np.array([p[0] * p[1], p[0] ** 2]), [2.0, 3.0], [1.0, 1.0]).round(6).tolist()
    [[3.0, 2.0], [4.0, 0.0]]
    """
    centre, units = float_array("parameters", parameters, 1), float_array("scales", scales, 1)
    if centre.shape != units.shape or (units <= 0.0).any():
        raise InputError(
            f"scales must be greater than 0, one for each of {centre.size} parameters: got {units.tolist()}."
        )
    width = positive("step", step)
    columns = [
        (float_array("answer", answer(centre + move), 1) - float_array("answer", answer(centre - move), 1))
        / (2.0 * width)
        for move in np.diag(width * units)
    ]
    return np.stack(columns, axis=1)


def identifiability(
    answer: Answer,
    parameters: ArrayLike,
    names: Sequence[str],
    scales: ArrayLike | None = None,
    *,
    step: float = JACOBIAN_STEP,
    zero: float = ZERO,
) -> Identifiability:
    """Find the combinations of parameters on which outputs depend, and those on which they do not.

    Parameters
    ----------
    answer : callable
        From parameters (n_parameters,) to answers (n_answers,), at least as many as parameters.
    parameters : array (n_parameters,)
        Where to look: a fit.
    names : sequence of str
        Names of the parameters.
    scales : array (n_parameters,), optional
        One unit of each parameter; by default its own size, so that none may be 0.
    step : float, optional
        Half width of the differences over the scales.
    zero : float, optional
        Singular values below this share of the largest are zero.

    Returns
    -------
    Identifiability

    Raises
    ------
    InputError
        If sizes disagree, a scale is 0, or there are fewer answers than parameters.

    Examples
    --------
    Only the product of two parameters is seen: one direction is silent, up with one and down with the other.

    >>> found = identifiability(lambda p: p[0] * p[1] * np.array([1.0, 2.0]), [2.0, 3.0], ("a", "b"))
    >>> found.rank, (found.silent_directions[0] / found.silent_directions[0][0]).round(6).tolist()
    (1, [1.0, -1.0])
    """
    centre = float_array("parameters", parameters, 1)
    labels = tuple(names)
    if len(labels) != centre.size:
        raise InputError(f"names must name {centre.size} parameters: got {len(labels)}.")
    table = jacobian(answer, centre, np.abs(centre) if scales is None else scales, step)
    if len(table) < centre.size:
        raise InputError(f"answer must give at least {centre.size} numbers: got {len(table)}.")
    _, values, directions = np.linalg.svd(table, full_matrices=False)
    rank = int((values > zero * values[0]).sum()) if values[0] > 0.0 else 0
    return Identifiability(labels, values, directions, rank)
