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
    """Identifiable directions of parameters."""

    names: tuple[str, ...]
    """Names of the parameters."""
    singular_values: FloatArray
    """Change of the outputs per unit step along each direction, largest first, (n_parameters,)."""
    directions: FloatArray
    """One unit direction per row, in units of the scales; those with singular value 0 are last,
    (n_parameters, n_parameters).
    """
    rank: int
    """Number of singular values above zero, the number of identifiable combinations."""

    @property
    def silent_directions(self) -> FloatArray:
        """Directions along which no output changes, (n_parameters - rank, n_parameters)."""
        return self.directions[self.rank :]


def jacobian(
    answer: Answer, parameters: ArrayLike, scales: ArrayLike, step: float = JACOBIAN_STEP
) -> FloatArray:
    """Change of every output per scale of every parameter, by central differences."""
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
    """Find the combinations of parameters on which outputs depend, and those on which they do not."""
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
