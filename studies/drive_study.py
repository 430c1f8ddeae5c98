"""The whole comparison of drives behind `python -m studies drives`: every quantity, explanation and depth."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Number, result_class
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.gerling2014 import single_unit
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import RateRecordings
from studies import drive_depths, drive_fits, drive_quantities, dynamic_response
from studies.drive_depths import DepthStudy
from studies.drive_fits import RELATIVE_NAMES, DriveFit, Judged, information, thorough_method
from studies.drive_quantities import DriveResult
from studies.dynamic_response import EXPLANATIONS, ExplainedModel, Explanation, Patch


@result_class
class ExplanationFit:
    """Fit of one explanation of the dynamic rates.

    Parameters
    ----------
    name : str
        Of the explanation.
    free_numbers : int
        How many numbers are fitted.
    added : dict of str to float
        Those that the explanation adds, by name.
    fit : DriveFit
        Its gain is over the first explanation.
    aic, bic : float
        Information criteria, see `studies.drive_fits.information`.
    aic_difference, bic_difference : float
        From the first explanation.
    """

    name: str
    free_numbers: int
    added: dict[str, Number]
    fit: DriveFit
    aic: Number
    bic: Number
    aic_difference: Number
    bic_difference: Number


@result_class
class DriveStudy:
    """Result of `python -m studies drives`.

    Parameters
    ----------
    quantities : DriveResult
        Every quantity, by both methods.
    explanations : tuple of ExplanationFit
        Of the dynamic rates, the paper's model first.
    depths : DepthStudy
        By layer of elements.
    manifest : Manifest
        What ran.
    """

    quantities: DriveResult
    explanations: tuple[ExplanationFit, ...]
    depths: DepthStudy
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
        explanations=explanations,
        depths=depths,
        manifest=runner.manifest(conditions),
    )


def explained(
    patch: Patch,
    recordings: RateRecordings,
    seed: int,
    generator: np.random.Generator,
    on_finished: Callable[[str], None] = lambda part: None,
    explanations: tuple[Explanation, ...] = EXPLANATIONS,
) -> tuple[ExplanationFit, ...]:
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
    tuple of ExplanationFit
    """
    rows: list[ExplanationFit] = []
    baseline: Judged | None = None
    for explanation in explanations:
        model = ExplainedModel.from_start(explanation, patch)
        method = thorough_method(seed, len(explanation.added))
        judged = drive_fits.judge(RateProblem(model, recordings), method)
        baseline = baseline or judged
        free = len(RELATIVE_NAMES) + len(explanation.added)
        found = information(judged.in_sample["total"], recordings.n_rates, free)
        first = rows[0] if rows else None
        rows.append(
            ExplanationFit(
                name=explanation.name,
                free_numbers=free,
                added=_added(explanation, model.numbers(judged.fit.parameters)),
                fit=drive_fits.drive_fit(judged, baseline, recordings, generator),
                **found,
                aic_difference=found["aic"] - first.aic if first else 0.0,
                bic_difference=found["bic"] - first.bic if first else 0.0,
            )
        )
        on_finished(explanation.name)
    return tuple(rows)


def _added(explanation: Explanation, numbers: FloatArray) -> dict[str, float]:
    return {added.name: float(value) for added, value in zip(explanation.added, numbers, strict=True)}
