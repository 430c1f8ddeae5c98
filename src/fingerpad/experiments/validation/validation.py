"""Score observations that a user brings: read, press, predict, compare, record."""

from __future__ import annotations

from typing import Literal

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.values import Number
from fingerpad.data import fingertip
from fingerpad.experiments.requests.afferents import parameters_of
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.experiments.scores import (
    coefficient_of_determination,
    correlation,
    gain_through_origin,
    observed_ranges,
)
from fingerpad.experiments.validation.predictions import predict
from fingerpad.experiments.validation.request import ValidationRequest
from fingerpad.geometry.motion import RampAndHold
from fingerpad.neuron.population import Population


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


def validate(request: ValidationRequest, runner: Runner) -> ValidationFile:
    """Predict every row of a file of observations, and score the predictions.

    Rows whose touch cannot be solved have a reason instead of a prediction.
    """
    request.check()
    observations = request.observed
    kind, observed = observations.kind, observations.observed
    found = predict(request, runner)
    predicted, ranges = found.values, observed_ranges(observations.conditions, observed)
    inside = ranges.inside(predicted)
    judged = [each for row in ranges.first if (each := inside[row]) is not None]
    known = np.isfinite(predicted)
    scored = observed[known], predicted[known]
    gain = gain_through_origin(*scored)
    manifest = runner.manifest(
        request.settings,
        {kind.name: found.meshed.mesh} if found.meshed else {},
        inputs=request.input_hashes(),
    )
    r2_mirrored = np.nan
    if found.mirrored is not None:
        turned = np.isfinite(found.mirrored)
        r2_mirrored = coefficient_of_determination(observed[turned], found.mirrored[turned])
    motion = RampAndHold()
    of_rates = {
        "afferent": parameters_of(Population(np.zeros((1, 2)), 1.0, request.responding)),
        "ramp_ms": motion.ramp_ms,
        "hold_ms": motion.hold_ms,
        "static_window_ms": request.static_window_ms,
        "receptor_depth_mm": request.depth_mm or fingertip.RECEPTOR_DEPTH.value,
    }
    return ValidationFile(
        kind=kind.name,
        unit=kind.unit,
        resolution=request.resolution,
        tissues=manifest.materials,
        **(of_rates if kind.is_rate else {"loading": request.loading}),
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
