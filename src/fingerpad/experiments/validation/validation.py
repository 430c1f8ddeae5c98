"""Score observations that a user brings: read, press, predict, compare, record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Literal

import numpy as np

from fingerpad.core.checked import checked, result_class, value_class
from fingerpad.core.engine import Engine, engine_of
from fingerpad.core.progress import Progress
from fingerpad.core.values import AnyPath, Number, Whole
from fingerpad.data import fingertip
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.scores import (
    coefficient_of_determination,
    correlation,
    gain_through_origin,
    observed_ranges,
)
from fingerpad.experiments.validation.observations import Observations
from fingerpad.experiments.validation.predictions import FingertipModel, predict
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.tissues import named_tissues


@result_class
class Prediction:
    """One row of the file with its prediction. Conditions that the kind does not have are null."""

    line: int
    indenter: str | None = None  # As it is written in the file.
    depth_mm: float | None = None
    distance_mm: float | None = None  # Depth, and distance from the indenter's axis, proximal positive. [mm]
    force_n: float | None = None  # Force that presses. [N]
    curvature_per_m: float | None = None  # Of the sphere. [1/m]
    ridge_mm: float | None = None
    groove_mm: float | None = None  # Of the grating. [mm]
    position_mm: float | None = None  # Of the receptor from the middle of the touch, proximal positive. [mm]
    observed: float
    predicted: Number  # In the unit of the kind; no prediction where a touch failed.
    observed_low: float
    observed_high: float  # Lowest and highest observation of this condition.
    inside_range: bool | None  # Whether the prediction lies between them; null with fewer than two.
    reason: str | None = None  # Why there is no prediction.


@result_class
class ValidationFile:
    """The file `validate.json`."""

    format: Literal["fingerpad validation"] = "fingerpad validation"
    format_version: Literal[1] = 1
    kind: str
    unit: str  # What was observed, and its unit.
    resolution: str
    tissues: str  # Accuracy and tissues of the prediction.
    loading: str | None = None  # How depths were reached, for force and deflection.
    afferent: dict[str, float | str | None] | None = None  # Parameters of the afferent, for rates.
    ramp_ms: float | None = None
    hold_ms: float | None = None  # Motion of the force, for rates. [ms]
    static_window_ms: tuple[float, ...] | None = None  # Window of the rates. [ms]
    receptor_depth_mm: float | None = None  # Depth of the receptor below the skin, for rates. [mm]
    n_rows: int
    n_predicted: int  # Rows of the file, and those with a prediction. Scores are over the latter.
    r2: Number  # 1 - sum (o - p)² / sum (o - mean of o)², with observations o and predictions p.
    correlation: Number  # Pearson's correlation of o and p.
    gain: Number  # sum o p / sum p², the factor on p with the least squares.
    r2_after_gain: Number  # r2 of gain times p.
    r2_mirrored: Number  # r2 with distances or positions reversed; null for kinds without either.
    inside_range: bool | None  # Whether all that can be judged lie in their observed range.
    n_judged: int  # Conditions with a prediction and at least two observations.
    share_inside: Number  # Share of these with a prediction inside the observed range.
    predictions: tuple[Prediction, ...]
    manifest: Manifest


@value_class
class ValidationRequest:
    """Observations with all that it takes to score them.

    Parameters
    ----------
    observations : Observations
        From `read_observations`.
    model : FingertipModel
        Finger, tissues, afferent, loading.
    folder : Path
        Where finished indentations are stored.
    jobs : int or Engine
        Processes, or the engine that solves the indentations; the numbers do not depend on it.
    """

    observations: Observations
    model: FingertipModel
    folder: AnyPath
    jobs: Whole | Engine = 1

    def __post_init__(self) -> None:
        engine_of(self.jobs)
        if isinstance(self.model.conditions.tissues, str):
            named_tissues(self.model.conditions.tissues)


@checked
def validate(
    request: ValidationRequest,
    progress: Progress | None = None,
    command: str | None = None,
    inputs: Mapping[str, str] | None = None,
) -> ValidationFile:
    """Predict every row of a file of observations, and score the predictions.

    Parameters
    ----------
    request : ValidationRequest
        Observations, model and folder.
    progress : Progress, optional
        Shown each finished indentation.
    command : str, optional
        The command line, for the manifest.
    inputs : mapping of str to str, optional
        SHA-256 of the input files, by name.

    Returns
    -------
    ValidationFile
        Rows whose touch cannot be solved have a reason instead of a prediction.

    Raises
    ------
    StoreError
        If a stored indentation is damaged or the folder cannot be written.
    """
    observations, model = request.observations, request.model
    kind, observed = observations.kind, observations.observed
    runner = Runner(request.folder, request.jobs, progress)
    found = predict(observations, model, runner)
    predicted, ranges = found.values, observed_ranges(observations.conditions, observed)
    inside = ranges.inside(predicted)
    judged = [each for row in ranges.first if (each := inside[row]) is not None]
    known = np.isfinite(predicted)
    scored = observed[known], predicted[known]
    gain = gain_through_origin(*scored)
    manifest = runner.manifest(
        model.conditions,
        {kind.name: found.meshed.mesh} if found.meshed else {},
        command=command,
        inputs=inputs,
    )
    r2_mirrored = np.nan
    if found.mirrored is not None:
        turned = np.isfinite(found.mirrored)
        r2_mirrored = coefficient_of_determination(observed[turned], found.mirrored[turned])
    motion = RampAndHold()
    of_rates = {
        "afferent": asdict(model.responding),
        "ramp_ms": motion.ramp_ms,
        "hold_ms": motion.hold_ms,
        "static_window_ms": model.static_window_ms,
        "receptor_depth_mm": fingertip.RECEPTOR_DEPTH.value,
    }
    return ValidationFile(
        kind=kind.name,
        unit=kind.unit,
        resolution=model.conditions.resolution,
        tissues=manifest.materials,
        **(of_rates if kind.is_rate else {"loading": model.loading}),
        n_rows=observed.size,
        n_predicted=int(known.sum()),
        r2=coefficient_of_determination(*scored),
        correlation=correlation(*scored),
        gain=gain,
        r2_after_gain=coefficient_of_determination(scored[0], gain * scored[1]),
        r2_mirrored=r2_mirrored,
        inside_range=all(judged) if judged else None,
        n_judged=len(judged),
        share_inside=sum(judged) / len(judged) if judged else np.nan,
        predictions=tuple(
            Prediction(
                line=row.line,
                **dict(zip(kind.conditions, row.condition, strict=True)),  # type: ignore[arg-type]
                observed=row.observed,
                predicted=predicted[number],
                observed_low=ranges.low[number],
                observed_high=ranges.high[number],
                inside_range=inside[number],
                reason=found.reasons.get(number),
            )
            for number, row in enumerate(observations.rows)
        ),
        manifest=manifest,
    )
