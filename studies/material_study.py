"""The whole comparison of material sets: three levels, order of the trials, Wu's tissues as polynomials."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad import __version__
from fingerpad.core.checks import one_of, whole
from fingerpad.data import paper
from fingerpad.data import tissues as published
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.runner import STORE_FOLDER
from fingerpad.skin.behaviour import code_hash
from fingerpad.skin.store import Store, solve_missing
from studies import trial_order
from studies.hyperfoam_fit import polynomial_of_hyperfoam
from studies.material_candidates import candidates, deflection_candidates
from studies.material_sets import GOODWIN, Effort, compare, deflections, pareto_front
from studies.plain_values import plain

LEAST_R2 = 0.96
"""R² under the cylinder from which the first level counts as met."""

LARGEST_HIT_RATE_ERROR = 0.05
"""Each hit rate must come this close to Goodwin's at the paper's noise for the third level."""

COMPRESSIONS = (0.3, 0.5)
"""Shortenings up to which Wu's stress is fitted; the second is used."""


@dataclass(frozen=True)
class MaterialStudy:
    """A run of the comparison.

    Parameters
    ----------
    conditions : Conditions
        Finger, resolution and seed; its materials are not used.
    folder : Path
        Where finished presses are stored.
    jobs : int
        Processes to press with; the numbers do not depend on it.
    effort : Effort
        How much of each level is looked at.
    names : tuple of str
        Candidates to compare; all by default.

    Raises
    ------
    InputError
        If `jobs` is below 1 or a name is unknown.
    """

    conditions: Conditions
    folder: Path
    jobs: int = 1
    effort: Effort = field(default_factory=Effort)
    names: tuple[str, ...] = tuple(candidate.name for candidate in candidates())

    def __post_init__(self) -> None:
        whole("jobs", self.jobs, at_least=1)
        for name in self.names:
            one_of("each of names", name, [candidate.name for candidate in candidates()])


def study_materials(study: MaterialStudy, on_finished: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Compare candidates on all levels, and the trials in their order.

    Parameters
    ----------
    study : MaterialStudy
        What to run and where to keep finished presses.
    on_finished : callable, optional
        Called with the name of each finished part.

    Returns
    -------
    dict
        Plain numbers, strings and lists: `sets`, `pareto`, `deflection_only`, `order`, `polynomials`,
        `targets` and `manifest`.

    Raises
    ------
    ConvergenceError
        If a press by the cylinder alone, or of the trials' order, cannot be solved.
    StoreError
        If a stored press is damaged or the folder cannot be written.
    """
    store = Store(study.folder / STORE_FOLDER)
    chosen = [candidate for candidate in candidates() if candidate.name in study.names]
    rows = compare(chosen, study.conditions, store, study.jobs, study.effort, on_finished)
    for row in rows:
        row["meets"] = meets(row)
    alone = deflections(deflection_candidates(), study.conditions, store, study.jobs)
    if on_finished:
        on_finished("deflection alone")
    pressed = trial_order.touches(study.conditions)
    solve_missing(list(pressed.values()), store, study.jobs)
    order = trial_order.result({key: store.load(touch) for key, touch in pressed.items()})
    if on_finished:
        on_finished("order of the trials")
    return plain(
        {
            "sets": rows,
            "pareto": pareto_front(rows),
            "deflection_only": alone,
            "order": order,
            "polynomials": polynomials(),
            "targets": {"r2": LEAST_R2, "hit_rate_error": LARGEST_HIT_RATE_ERROR},
            "manifest": {
                "date": datetime.now(UTC).date().isoformat(),
                "version": __version__,
                "code_hash": code_hash(),
                "resolution": study.conditions.resolution,
                "seed": study.conditions.seed,
                "shifted_bars": study.effort.shifted_bars,
            },
        }
    )


def meets(row: Mapping[str, Any]) -> dict[str, bool]:
    """Which levels a candidate meets, with the afferent of its joint fit.

    Deflection: R² of at least `LEAST_R2`. Firing: FSS, in sample, of at least what the paper reports out of
    sample. Discrimination: both hit rates close to Goodwin's at the paper's noise.
    """
    if "unsolved" in row:
        return dict.fromkeys(("deflection", "firing", "discrimination"), False)
    joint = row["joint"]
    error = np.abs(np.asarray(joint["hit_rate"]) - GOODWIN).max()
    return {
        "deflection": bool(row["deflection"]["r2"] >= LEAST_R2),
        "firing": bool(joint["fss"] >= paper.FSS_OUT_OF_SAMPLE.value),
        "discrimination": bool(error <= LARGEST_HIT_RATE_ERROR),
    }


def polynomials() -> list[dict[str, Any]]:
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
                    {
                        "layer": layer,
                        "poisson": poisson,
                        "compression": compression,
                        "coefficients_kpa": coefficients,
                        "misfit": misfit,
                    }
                )
    return rows
