"""The whole comparison of drives behind `python -m studies drives`: every quantity, explanation and depth."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad import __version__
from fingerpad.core.checks import FloatArray, whole
from fingerpad.core.results import to_json
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.gerling2014 import drive_fits, drive_quantities, single_unit
from fingerpad.experiments.gerling2014.drive_fits import RELATIVE_NAMES, Judged
from fingerpad.experiments.runner import STORE_FOLDER
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import RateRecordings
from fingerpad.skin.behaviour import code_hash
from fingerpad.skin.store import Store, solve_missing
from studies import drive_depths, dynamic_response
from studies.drive_fits import information, thorough_method
from studies.dynamic_response import EXPLANATIONS, ExplainedModel, Explanation, Patch
from studies.plain_values import plain


@dataclass(frozen=True)
class DriveStudy:
    """A run of the comparison.

    Parameters
    ----------
    conditions : Conditions
        Finger, tissues, resolution and seed.
    folder : Path
        Where finished presses are stored.
    jobs : int
        Processes to press with; the numbers do not depend on it.

    Raises
    ------
    InputError
        If `jobs` is below 1.
    """

    conditions: Conditions
    folder: Path
    jobs: int = 1

    def __post_init__(self) -> None:
        whole("jobs", self.jobs, at_least=1)


def study_drives(study: DriveStudy, on_finished: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Press the bar at all shifts, and compare what may drive the afferent.

    Parameters
    ----------
    study : DriveStudy
        What to run and where to keep finished presses.
    on_finished : callable, optional
        Called with the name of each finished part.

    Returns
    -------
    dict
        Plain numbers, strings and lists: the fields of `drive_quantities.DriveResult`, `explanations`,
        `depths` and `manifest`.

    Raises
    ------
    ConvergenceError
        If a press cannot be solved; finished ones stay stored.
    StoreError
        If a stored press is damaged or the folder cannot be written.
    """

    def finished(part: str) -> None:
        if on_finished:
            on_finished(part)

    conditions = study.conditions
    store, touches = Store(study.folder / STORE_FOLDER), single_unit.bar_touches(conditions)
    solve_missing(touches, store, study.jobs)
    responses = [store.load(touch) for touch in touches]
    finished("presses")
    recordings, generator = single_unit.bar_recordings(), np.random.default_rng(conditions.seed)
    quantities = drive_quantities.drive_result(
        drive_quantities.quantity_traces(responses),
        recordings,
        generator,
        (*drive_quantities.ALONE, *drive_quantities.APART),
        thorough_method(conditions.seed),
        with_response_surface=True,
    )
    results: dict[str, Any] = json.loads(to_json(quantities))
    finished("quantities")
    patch = dynamic_response.sampled_patch(responses)
    results["explanations"] = explained(patch, recordings, conditions.seed, generator, finished)
    results["depths"] = drive_depths.result(responses, recordings, generator)
    finished("depths")
    results["manifest"] = {
        "date": datetime.now(UTC).date().isoformat(),
        "version": __version__,
        "code_hash": code_hash(),
        "resolution": conditions.resolution,
        "seed": conditions.seed,
    }
    return plain(results)


def explained(
    patch: Patch,
    recordings: RateRecordings,
    seed: int,
    generator: np.random.Generator,
    on_finished: Callable[[str], None] = lambda part: None,
    explanations: tuple[Explanation, ...] = EXPLANATIONS,
) -> list[dict[str, Any]]:
    """Fit every explanation of the dynamic rates in the same way.

    Parameters
    ----------
    patch : Patch
        Quantities about the receptor.
    recordings : RateRecordings
        Observed rates.
    seed : int
        Of the search.
    generator : numpy.random.Generator
        Draws the bootstrap.
    on_finished : callable, optional
        Called with the name of each.
    explanations : tuple of Explanation, optional
        The first is the one that others are compared with.

    Returns
    -------
    list of dict
        Per explanation its name, numbers, the fields of `drive_fits.DriveFit`, "aic" and "bic", and their
        differences from the first.
    """
    rows: list[dict[str, Any]] = []
    baseline: Judged | None = None
    for explanation in explanations:
        model = ExplainedModel.from_start(explanation, patch)
        method = thorough_method(seed, len(explanation.added))
        judged = drive_fits.judge(RateProblem(model, recordings), method)
        baseline = baseline or judged
        free = len(RELATIVE_NAMES) + len(explanation.added)
        rows.append(
            {
                "name": explanation.name,
                "free_numbers": free,
                "added": _added(explanation, model.numbers(judged.fit.parameters)),
                **vars(drive_fits.drive_fit(judged, baseline, recordings, generator)),
                **information(judged.in_sample["total"], recordings.n_rates, free),
            }
        )
        on_finished(explanation.name)
    for criterion in ("aic", "bic"):
        first = rows[0][criterion]
        for row in rows:
            row[f"{criterion}_difference"] = row[criterion] - first
    return rows


def _added(explanation: Explanation, numbers: FloatArray) -> dict[str, float]:
    return {added.name: float(value) for added, value in zip(explanation.added, numbers, strict=True)}
