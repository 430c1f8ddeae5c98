"""The whole comparison of material sets: three levels, order of the trials, Wu's tissues as polynomials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fingerpad.core.checks import one_of
from fingerpad.core.results import Vector, result_class
from fingerpad.data import paper
from fingerpad.data import tissues as published
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from studies import trial_order
from studies.hyperfoam_fit import polynomial_of_hyperfoam
from studies.material_candidates import candidates, deflection_candidates
from studies.material_sets import (
    GOODWIN,
    DeflectedSet,
    Effort,
    EvaluatedSet,
    UnsolvedSet,
    compare,
    deflections,
    pareto_front,
)

LEAST_R2 = 0.96
"""R² under the cylinder from which the first level counts as met."""

LARGEST_HIT_RATE_ERROR = 0.05
"""Each hit rate must come this close to Goodwin's at the paper's noise for the third level."""

COMPRESSIONS = (0.3, 0.5)
"""Shortenings up to which Wu's stress is fitted; the second is used."""


@result_class
class Polynomial:
    """A polynomial fitted to one of Wu's hyperfoams.

    Parameters
    ----------
    layer : str
        Of the skin.
    poisson, compression : float
        Poisson ratio, and the shortening up to which the stress is fitted. [1]
    coefficients_kpa : array (5,)
        C10, C01, C20, C11, C02. [kPa]
    misfit : float
        Root mean square of the stress error over the largest stress. [1]
    """

    layer: str
    poisson: float
    compression: float
    coefficients_kpa: Vector
    misfit: float


@result_class
class Targets:
    """When a level counts as met: R² from `r2` on, hit rates within `hit_rate_error` of Goodwin's. [1]"""

    r2: float = LEAST_R2
    hit_rate_error: float = LARGEST_HIT_RATE_ERROR


@result_class
class LevelsMet:
    """Which levels a material set meets with the afferent of its joint fit, see `Targets`."""

    deflection: bool
    firing: bool
    discrimination: bool

    @property
    def all(self) -> bool:
        """Whether every level is met."""
        return self.deflection and self.firing and self.discrimination


@result_class
class MaterialStudy:
    """Result of `python -m studies materials`.

    Parameters
    ----------
    sets : tuple of EvaluatedSet or UnsolvedSet
        One per candidate.
    meets : dict of LevelsMet
        By name of each set that was solved.
    pareto : tuple of str
        Sets that no other beats in R² under the cylinder, FSS and hit-rate error of the joint fit.
    deflection_only : tuple of DeflectedSet
        Candidates evaluated with the cylinder alone.
    order : TrialOrder
        Of the three trials.
    polynomials : tuple of Polynomial
        Wu's tissues.
    targets : Targets
        Of the levels.
    shifted_bars : bool
        Whether the bar was indented at all shifts.
    manifest : Manifest
        What ran.
    """

    sets: tuple[EvaluatedSet | UnsolvedSet, ...]
    meets: dict[str, LevelsMet]
    pareto: tuple[str, ...]
    deflection_only: tuple[DeflectedSet, ...]
    order: trial_order.TrialOrder
    polynomials: tuple[Polynomial, ...]
    targets: Targets
    shifted_bars: bool
    manifest: Manifest


NAMES = tuple(candidate.name for candidate in candidates())
"""Candidates that are compared."""


def run(
    runner: Runner,
    conditions: Conditions,
    effort: Effort | None = None,
    names: Sequence[str] = NAMES,
) -> MaterialStudy:
    """Compare candidates on all levels, and the trials in their order.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.
    conditions : Conditions
        Finger, resolution and seed; its materials are not used.
    effort : Effort, optional
        Indentations of the bar, and length of the search.
    names : sequence of str, optional
        Candidates to compare; all by default.

    Returns
    -------
    MaterialStudy

    Raises
    ------
    InputError
        If a name is unknown.
    ConvergenceError
        If an indentation by the cylinder alone, or of the trials' order, cannot be solved.
    StoreError
        If a stored indentation is damaged or the folder cannot be written.
    """
    effort = effort or Effort()
    for name in names:
        one_of("each of names", name, NAMES)
    chosen = [candidate for candidate in candidates() if candidate.name in names]
    rows = compare(chosen, runner, conditions, effort)
    solved = [row for row in rows if isinstance(row, EvaluatedSet)]
    merits = np.array([[row.deflection.r2, row.joint.fss, -row.joint.percept_error] for row in solved])
    alone = deflections(deflection_candidates(), runner, conditions)
    order = runner.responses({"order of the trials": trial_order.touches(conditions)})
    return MaterialStudy(
        sets=tuple(rows),
        meets={row.name: meets(row) for row in solved},
        pareto=tuple(row.name for row, best in zip(solved, pareto_front(merits), strict=True) if best),
        deflection_only=tuple(alone),
        order=trial_order.result(order["order of the trials"]),
        polynomials=polynomials(),
        targets=Targets(),
        shifted_bars=effort.shifted_bars,
        manifest=runner.manifest(conditions),
    )


def meets(row: EvaluatedSet) -> LevelsMet:
    """Return the levels that a set meets with the afferent of its joint fit.

    Deflection: R² of at least `LEAST_R2`. Firing: FSS, in sample, of at least what the paper reports out of
    sample. Discrimination: both hit rates close to Goodwin's at the paper's noise.
    """
    error = np.abs(row.joint.hit_rate - GOODWIN).max()
    return LevelsMet(
        deflection=row.deflection.r2 >= LEAST_R2,
        firing=row.joint.fss >= paper.FSS_OUT_OF_SAMPLE.value,
        discrimination=error <= LARGEST_HIT_RATE_ERROR,
    )


def polynomials() -> tuple[Polynomial, ...]:
    """Coefficients of the polynomials that stand for Wu's hyperfoams, and how well they do. [kPa]"""
    layers = {
        "dermis": (published.WU_SKIN_HYPERFOAM_MU.value, published.WU_SKIN_HYPERFOAM_ALPHA.value),
        "subcutis": (published.WU_SUBCUTIS_HYPERFOAM_MU.value, published.WU_SUBCUTIS_HYPERFOAM_ALPHA.value),
    }
    poissons: Sequence[float] = (published.WU_HYPERFOAM_POISSON.value, published.POISSON_RATIO.value)
    rows = []
    for layer, (mu, alpha) in layers.items():
        for poisson in poissons:
            for compression in COMPRESSIONS:
                coefficients, misfit = polynomial_of_hyperfoam(mu, alpha, poisson, compression)
                rows.append(
                    Polynomial(
                        layer=layer,
                        poisson=poisson,
                        compression=compression,
                        coefficients_kpa=coefficients,
                        misfit=misfit,
                    )
                )
    return tuple(rows)
