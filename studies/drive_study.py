"""The whole comparison of drives behind `python -m studies drives`: every quantity, explanation and depth."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import result_class
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.gerling2014 import drive_fits, drive_quantities, single_unit
from fingerpad.experiments.gerling2014.drive_fits import RELATIVE_NAMES, Judged
from fingerpad.experiments.gerling2014.drive_quantities import DriveResult
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import RateRecordings
from studies import drive_depths, dynamic_response
from studies.drive_fits import information, thorough_method
from studies.dynamic_response import EXPLANATIONS, ExplainedModel, Explanation, Patch
from studies.plain_values import plain


@result_class
class DriveStudy:
    """Result of `python -m studies drives`.

    Parameters
    ----------
    quantities : DriveResult
        Every quantity, by both methods.
    explanations : tuple of dict
        See `explained`.
    depths : dict
        See `studies.drive_depths.result`.
    manifest : Manifest
        What ran.
    """

    quantities: DriveResult
    explanations: tuple[dict[str, Any], ...]
    depths: dict[str, Any]
    manifest: Manifest


def run(runner: Runner, conditions: Conditions) -> DriveStudy:
    """Press the bar at all shifts, and compare what may drive the afferent.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.
    conditions : Conditions
        Finger, tissues, resolution and seed.

    Returns
    -------
    DriveStudy

    Raises
    ------
    ConvergenceError
        If an indentation cannot be solved; finished ones stay stored.
    StoreError
        If a stored indentation is damaged or the folder cannot be written.
    """
    touches = dict(enumerate(single_unit.bar_touches(conditions)))
    responses = list(runner.responses({"bar, 36 shifts": touches})["bar, 36 shifts"].values())
    recordings, generator = single_unit.bar_recordings(), np.random.default_rng(conditions.seed)
    with runner.stage("quantities", 1) as advance:
        quantities = drive_quantities.drive_result(
            drive_quantities.quantity_traces(responses),
            recordings,
            generator,
            (*drive_quantities.ALONE, *drive_quantities.APART),
            thorough_method(conditions.seed),
            with_response_surface=True,
        )
        advance()
    with runner.stage("explanations", len(EXPLANATIONS)) as advance:
        patch = dynamic_response.sampled_patch(responses)
        explanations = explained(patch, recordings, conditions.seed, generator, lambda explanation: advance())
    with runner.stage("depths", 1) as advance:
        depths = drive_depths.result(responses, recordings, generator)
        advance()
    return DriveStudy(
        quantities=quantities,
        explanations=tuple(plain(explanations)),
        depths=plain(depths),
        manifest=runner.manifest(conditions),
    )


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
