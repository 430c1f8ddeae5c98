"""A validation: what is asked, and its run, which reads, presses, predicts, compares and records."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from fingerpad.core.checked import result_class
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.regions import around_zero
from fingerpad.core.signals import COUNT, INTERVAL, Traces
from fingerpad.core.units import MN_PER_N, MS_PER_S, unit_of
from fingerpad.core.values import FloatArray, Number, Pair, Positive, Text, choice
from fingerpad.data import fingertip, protocol
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.receptive_field import PROBE, afferents_at, field_of, places_about, probing
from fingerpad.experiments.requests.afferents import (
    DEFAULT,
    AfferentChoice,
    chosen_afferent,
    files_of,
    parameters_of,
)
from fingerpad.experiments.requests.parts import at, object_of_python
from fingerpad.experiments.requests.stimulus import (
    FINGER_OBJECTS,
    FingerRequest,
    ObjectPart,
    named_files,
    object_of,
)
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.experiments.scores import (
    coefficient_of_determination,
    correlation,
    gain_through_origin,
    observed_ranges,
)
from fingerpad.experiments.validation.observations import WORDS, Kind, Observations, Value, read_observations
from fingerpad.geometry.bodies import Dots, FlatPunch, Grating, Plate, Sphere
from fingerpad.geometry.grading import RESOLUTIONS, resolution_grading
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold, Trajectory
from fingerpad.geometry.motions import stroke
from fingerpad.neuron.afferent import AnyAfferent, type_of
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import RATE_OF
from fingerpad.skin.indentation import Touch, settings_of, touch_of
from fingerpad.skin.sampling import SkinResponse

RAMP_AND_HOLD, QUASI_STATIC = "ramp_and_hold", "quasi_static"
LOADINGS = (RAMP_AND_HOLD, QUASI_STATIC)  # Read at the end of the paper's hold, or with relaxed tissues.
QUASI_STATIC_MS = 1e12  # After such a ramp all Prony terms have relaxed to 1 in 10⁶. [ms]

DOT_MM, DOTS_MM = 1.0, (8.0, 6.0)
"""Diameter of the dots, half of which they are high; the lattice reaches so far along and across."""
DOTS_STEP_MM, DOTS_HELD_MS, DOTS_MS = 0.25, 150.0, 1000.0
"""Way of the lattice in one step, how long it is held before it moves, and how long spikes are counted."""
DOTS_LINES = 4  # Lines across half a spacing on which afferents lie.
STEADY, HELD_STEPS = FlatPunch(2.0), 12  # Probe of adaptation, assumed, and the steps of its hold.


class ValidationRequest(FingerRequest):
    """A validation, as `fingerpad.validate` runs it and a file or a command describes it."""

    word: ClassVar[str] = "validation"
    main: ClassVar[str] = "observations"
    python: ClassVar[tuple[str, ...]] = (*FINGER_OBJECTS, "afferent")

    observations: Text | Path | object_of_python(Observations)  # type: ignore[valid-type]
    """A CSV file (docs/validate.md), or what `read_observations` returns."""
    objects: dict[str, ObjectPart] = Field(default={})
    """Objects by the names that the column `indenter` has for them, beside `sphere:287` and the like."""
    afferent: AfferentChoice = DEFAULT
    """Whose rates are predicted: "default", that of the tissues; a type; a file of results; or numbers."""
    depth_mm: Positive | None = None
    """Depth of the receptor below the skin; by default the border of epidermis and dermis. [mm]"""
    loading: Annotated[str, choice(LOADINGS)] = RAMP_AND_HOLD
    """How a depth of force or deflection is reached: read at the end of the paper's ramp and hold, or with
    relaxed tissues."""
    static_window_ms: Pair = (protocol.STATIC_WINDOW.value[0], protocol.STATIC_WINDOW.value[1])
    """Window of the rates, within the paper's ramp and hold. [ms]"""
    resolution: Annotated[str, choice(RESOLUTIONS)] = "standard"
    """As of `FingerDescription`; "standard" by default."""

    @cached_property
    def observed(self) -> Observations:
        """The observations."""
        with self.origin.located():
            if isinstance(self.observations, Observations):
                return self.observations
            own = {}
            for name, part in self.objects.items():
                with at("objects", name):
                    own[name] = object_of(part, self.beside)
            return read_observations(self.beside / self.observations, own)

    @cached_property
    def settings(self) -> Conditions:
        """Finger, tissues and accuracy."""
        with self.origin.located():
            depths_mm = () if self.depth_mm is None else (self.depth_mm,)
            return self.conditions(self.pressed_finger, depths_mm=depths_mm)

    @cached_property
    def responding(self) -> AnyAfferent:
        """The afferent that responds."""
        with self.origin.located(), at("afferent"):
            return chosen_afferent(self.afferent, self.tissues, self.beside)

    def check(self) -> None:
        """Raise `InputError` if the validation is impossible; before anything is solved."""
        self.observed, self.settings, self.responding  # noqa: B018
        (start, end), end_ms = self.static_window_ms, RampAndHold().end_ms
        if not 0.0 <= start < end <= end_ms:
            with self.origin.located():
                raise InputError(
                    "static_window_ms",
                    f"must be a start from 0 on and a later end, at most {end_ms:g} ms, where the hold ends",
                    f"{start:g}, {end:g}",
                )

    def further_files(self) -> list[Path]:
        """Files of the observations, the objects and the afferent."""
        own = [self.beside / self.observations] if isinstance(self.observations, str | Path) else []
        of_objects = [file for part in self.objects.values() for file in named_files(part, self.beside)]
        return [*own, *of_objects, *files_of(self.afferent, self.beside)]


@result_class
class Prediction:
    """One row of the file with its prediction. Conditions that the kind does not have are null."""

    line: int
    indenter: str | None = None  #: As it is written in the file.
    afferent: str | None = None  #: Type of the afferent.
    layer: str | None = None  #: Layer of the skin.
    depth_mm: float | None = None
    distance_mm: float | None = None  #: Depth, and distance from the indenter's axis, proximal positive. [mm]
    time_ms: float | None = None  #: From the start of the hold. [ms]
    force_n: float | None = None  #: Force that presses. [N]
    curvature_per_m: float | None = None  #: Of the sphere. [1/m]
    ridge_mm: float | None = None
    groove_mm: float | None = None  #: Of the grating. [mm]
    spacing_mm: float | None = None  #: Of the dots, along and across. [mm]
    speed_mm_s: float | None = None  #: Of the dots, along the finger. [mm/s]
    position_mm: float | None = None  #: Of the receptor from the middle of the touch, proximal positive. [mm]
    observed: float
    predicted: Number  #: In the unit of the kind; no prediction where a touch failed.
    observed_low: float
    observed_high: float  #: Lowest and highest observation of this condition.
    inside_range: bool | None  #: Whether the prediction lies between them; null with fewer than two.
    reason: str | None = None  #: Why there is no prediction.


@result_class
class ValidationFile:
    """The file `validate.json`."""

    format: Literal["fingerpad validation"] = "fingerpad validation"
    format_version: Literal[1] = 1
    kind: str
    unit: str  #: What was observed, and its unit.
    resolution: str
    tissues: str  #: Accuracy and tissues of the prediction.
    loading: str | None = None  #: How depths were reached, for force and deflection.
    afferent: dict[str, float | str | None] | None = None  #: Parameters of the afferent, for rates.
    ramp_ms: float | None = None
    hold_ms: float | None = None  #: Motion of the force, for rates. [ms]
    static_window_ms: tuple[float, ...] | None = None  #: Window of the rates. [ms]
    receptor_depth_mm: float | None = None  #: Depth of the receptor below the skin, for rates. [mm]
    n_rows: int
    n_predicted: int  #: Rows of the file, and those with a prediction. Scores are over the latter.
    r2: Number  #: 1 - sum (o - p)² / sum (o - mean of o)², with observations o and predictions p.
    correlation: Number  #: Pearson's correlation of o and p.
    gain: Number  #: sum o p / sum p², the factor on p with the least squares.
    r2_after_gain: Number  #: r2 of gain times p.
    r2_mirrored: Number  #: r2 with distances or positions reversed; null for kinds without either.
    inside_range: bool | None  #: Whether all that can be judged lie in their observed range.
    n_judged: int  #: Conditions with a prediction and at least two observations.
    share_inside: Number  #: Share of these with a prediction inside the observed range.
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
    loading = {"loading": request.loading}
    of_afferent = {
        "afferent": parameters_of(Population(np.zeros((1, 2)), 1.0, request.responding)),
        "receptor_depth_mm": request.depth_mm or fingertip.RECEPTOR_DEPTH.value,
    }
    of_rates = of_afferent | {
        "ramp_ms": motion.ramp_ms,
        "hold_ms": motion.hold_ms,
        "static_window_ms": request.static_window_ms,
    }
    told = {
        "force": loading,
        "deflection": loading,
        "receptive_field": of_afferent,
        "dots": of_afferent,
        "adaptation": of_afferent,
        "strain": {},
    }
    return ValidationFile(
        kind=kind.name,
        unit=unit_of(kind.observed),
        resolution=request.resolution,
        tissues=manifest.materials,
        **told.get(kind.name, of_rates),
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


@dataclass(frozen=True)
class Reading:
    """How the prediction of one row is obtained."""

    touch: Touch | None  #: What is pressed; None if nothing is, at depth or force 0.
    of: Callable[[SkinResponse | None], float]  #: Reads the prediction; None without a touch.


Plan = Reading | InputError  # How a condition is predicted, or why it cannot be pressed.
Condition = tuple[Value, ...]
Given = Mapping[str, Any]  # Values of a condition by their columns.


@dataclass(frozen=True)
class Predictions:
    """Predictions row by row."""

    values: FloatArray  #: In the unit of the observations; NaN where there is none, (n_rows,).
    mirrored: FloatArray | None  #: With proximal and distal exchanged, for kinds with an axis, (n_rows,).
    reasons: Mapping[int, str]  #: Why a row has no prediction.
    meshed: SkinResponse | None  #: One of the responses, for its mesh.


def predict(model: ValidationRequest, runner: Runner) -> Predictions:
    """Press what is not stored yet, and read the prediction of every row."""
    observations = model.observed
    kind, axis = observations.kind, observations.kind.axis
    given: dict[Condition, Given] = {
        row.condition: dict(zip(kind.conditions, row.condition, strict=True)) for row in observations.rows
    }
    plans = {condition: planned(kind, values, model) for condition, values in given.items()}
    touches = [plan.touch for plan in plans.values() if isinstance(plan, Reading) and plan.touch]
    failed: dict[Touch, ConvergenceError | InputError] = {}
    wanted = {kind.name: {touch: touch for touch in touches}}
    skins = runner.responses(wanted, on_failed=failed.__setitem__)[kind.name]

    def read(plans: Mapping[Condition, Plan]) -> tuple[FloatArray, dict[int, str]]:
        found = {condition: _value(plan, skins, failed) for condition, plan in plans.items()}
        rows = [found[row.condition] for row in observations.rows]
        return (
            np.array([value for value, _ in rows]),
            {row: reason for row, (_, reason) in enumerate(rows) if reason},
        )

    values, reasons = read(plans)
    mirrored = None
    if axis:
        turned = {key: planned(kind, {**each, axis: -each[axis]}, model) for key, each in given.items()}
        mirrored, _ = read(turned)
    return Predictions(values, mirrored, reasons, next(iter(skins.values()), None))


def planned(kind: Kind, given: Given, model: ValidationRequest) -> Plan:
    """Return how the prediction of a condition is obtained, or why it cannot be."""
    try:
        return _READING[kind.name](given, model)
    except InputError as error:
        return error


def _value(
    plan: Plan, skins: Mapping[Touch, SkinResponse], failed: Mapping[Touch, ConvergenceError | InputError]
) -> tuple[float, str | None]:
    """Prediction of a condition; NaN and why where there is none."""
    try:
        if isinstance(plan, InputError):
            raise plan
        if plan.touch is not None and plan.touch in failed:
            raise failed[plan.touch]
        return plan.of(skins[plan.touch] if plan.touch else None), None
    except (ConvergenceError, InputError) as error:
        return np.nan, str(error)


def _pressed_to(given: Given, model: ValidationRequest) -> Touch | None:
    """Touch that reaches a depth, perpendicular to the long axis of the finger; None at depth 0."""
    indenter, depth_mm = model.observed.indenter(str(given["indenter"])), given["depth_mm"]
    if depth_mm == 0.0:
        return None
    conditions = model.settings
    motion, settings = RampAndHold(depth_mm=depth_mm), settings_of(conditions.resolution)
    if model.loading == QUASI_STATIC:
        motion = replace(motion, ramp_ms=QUASI_STATIC_MS)
        settings = replace(settings, hold_steps=1)
    pressed = conditions.finger, indenter, motion, conditions.tissues, conditions.resolution
    return touch_of(*pressed, settings=settings, grading=conditions.grading)


def _force(given: Given, model: ValidationRequest) -> Reading:
    return Reading(
        _pressed_to(given, model), lambda skin: float(skin.force_mn[-1]) / MN_PER_N if skin else 0.0
    )


def _deflection(given: Given, model: ValidationRequest) -> Reading:
    """Deflection of the skin at a distance from the indenter's axis, proximal positive. [mm]"""
    distance_mm = given["distance_mm"]

    def read(skin: SkinResponse | None) -> float:
        if skin is None:
            return 0.0
        profile = skin.surface_profile()
        first, last = -profile.distance_mm[-1], -profile.distance_mm[0]
        if not first <= distance_mm <= last:
            words = f"must lie on the finger, from {first:.1f} to {last:.1f} mm"
            raise InputError("distance_mm", words, f"{distance_mm:g} mm")
        return float(profile.at(-distance_mm))

    return Reading(_pressed_to(given, model), read)


def _rate(given: Given, model: ValidationRequest) -> Reading:
    """Rate of an afferent at a position from the middle of a touch by force, proximal positive. [spikes/s]"""
    conditions, force_n = model.settings, given["force_n"]
    position_mm = given.get("position_mm", 0.0)
    body: Indenter
    if "ridge_mm" in given:
        ridge_mm, groove_mm = given["ridge_mm"], given["groove_mm"]
        body = Grating(ridge_mm, groove_mm, min(protocol.LIP_RADIUS.value, ridge_mm / 2))
        position_mm -= body.period_mm * round(position_mm / body.period_mm)
        grading = conditions.grading
    else:
        curvature = given["curvature_per_m"]
        body = Sphere(curvature_per_m=curvature) if curvature > 0.0 else Plate()
        # One mesh for all curvatures, so that no difference between them is one between meshes.
        grading = conditions.grading or resolution_grading(
            conditions.resolution, conditions.receptor_x_mm, half_width_mm=5.0
        )
    site = (conditions.receptor_x_mm - position_mm * conditions.along_skin, 0.0)
    conditions.finger.skin_point(*site)
    if force_n == 0.0:
        return Reading(None, lambda _: _resting_rate(model))
    touch = model.settings.probe_touch(body, ForceRampAndHold(force_mn=MN_PER_N * force_n), grading=grading)
    receptor = Population(np.array([site]), 1.0, model.responding, depth_mm=model.depth_mm)

    def read(skin: SkinResponse | None) -> float:
        assert skin is not None
        return float(receptor.respond(skin, static_window_ms=model.static_window_ms).static_rate_hz[0])

    return Reading(touch, read)


def _area(given: Given, model: ValidationRequest) -> Reading:
    """Area within which a probe elicits a tenth of the spikes at the most sensitive place. [mm²]"""
    depth_mm, name = given["depth_mm"], str(given["afferent"])
    if depth_mm == 0.0:
        return Reading(None, lambda _: 0.0)
    touch, places_mm = model.settings.probe_touch(PROBE, probing(depth_mm)), places_about()
    population = afferents_at(model.settings, places_mm, _of_type(name, model), model.depth_mm)

    def read(skin: SkinResponse | None) -> float:
        assert skin is not None
        return field_of(skin, population, places_mm).area_mm2

    return Reading(touch, read)


def _of_type(name: str, model: ValidationRequest) -> AnyAfferent:
    """Return the afferent whose rates are asked for: the one given, or that of its tissues and type."""
    own = model.responding
    return own if type_of(own) == name else chosen_afferent(name, model.tissues)


def lattice_of_dots(spacing_mm: float, along_mm: float, across_mm: float) -> Dots:
    """Return half balls on a square lattice that reaches so far to both sides."""
    x, z = (spacing_mm * around_zero(2 * int(reach // spacing_mm) + 1) for reach in (along_mm, across_mm))
    return Dots(tuple((float(at), float(beside)) for at in x for beside in z), DOT_MM, DOT_MM / 2)


def scanning(spacing_mm: float, speed_mm_per_s: float, force_mn: float) -> Trajectory:
    """Motion of a lattice of dots by two spacings at a constant force, after a hold."""
    steps = 2 * math.ceil(spacing_mm / DOTS_STEP_MM)
    way_mm = 2 * spacing_mm * np.arange(1, steps + 1) / steps
    return stroke(
        force_mn=force_mn, speed_mm_per_s=speed_mm_per_s, x_mm=way_mm.tolist(), hold_ms=DOTS_HELD_MS
    )


def _dots(given: Given, model: ValidationRequest) -> Reading:
    """Mean rate while a lattice of dots moves over the skin, over places across a spacing. [spikes/s]"""
    spacing_mm, force_n = given["spacing_mm"], given["force_n"]
    afferent = _of_type(str(given["afferent"]), model)
    if force_n == 0.0:
        return Reading(None, lambda _: _resting_rate(model))
    if spacing_mm <= DOT_MM:
        raise InputError(
            "spacing_mm", f"must be above {DOT_MM:g} mm, the diameter of the dots", f"{spacing_mm:g}"
        )
    body = lattice_of_dots(spacing_mm, DOTS_MM[0] + 2 * spacing_mm, DOTS_MM[1])
    motion = scanning(spacing_mm, given["speed_mm_s"], MN_PER_N * force_n)
    touch = model.settings.probe_touch(body, motion)
    across = spacing_mm / 2 * (np.arange(DOTS_LINES) + 0.5) / DOTS_LINES
    places = np.column_stack([np.full(DOTS_LINES, model.settings.receptor_x_mm), across])
    receptors = Population(places, spacing_mm, afferent, depth_mm=model.depth_mm)
    period_ms = MS_PER_S * spacing_mm / given["speed_mm_s"]
    settling, counted = (math.ceil(of_ms / period_ms) for of_ms in (DOTS_HELD_MS, DOTS_MS))

    def read(skin: SkinResponse | None) -> float:
        assert skin is not None
        again = receptors.followed(skin).repeated(motion.end_ms - period_ms, settling + counted)
        spikes = afferent.spikes(again)
        window_ms = settling * period_ms, (settling + counted) * period_ms
        return float(RATE_OF[COUNT](spikes, window_ms).mean())

    return Reading(touch, read)


def _adapted(given: Given, model: ValidationRequest) -> Reading:
    """One over the interval between spikes that holds a time of a hold. [spikes/s]"""
    depth_mm, time_ms = given["depth_mm"], given["time_ms"]
    if depth_mm == 0.0:
        return Reading(None, lambda _: _resting_rate(model))
    depth, time = (model.observed.kind.conditions.index(name) for name in ("depth_mm", "time_ms"))
    longest_ms = max(
        float(row.condition[time]) for row in model.observed.rows if row.condition[depth] == depth_mm
    )
    # Slow spikes need a while until the interval of the last time is closed.
    motion = RampAndHold(depth_mm, hold_ms=longest_ms + MS_PER_S)
    touch = model.settings.probe_touch(STEADY, motion, HELD_STEPS)
    site = np.array([(model.settings.receptor_x_mm, 0.0)])
    receptor = Population(site, 1.0, model.responding, depth_mm=model.depth_mm)

    def read(skin: SkinResponse | None) -> float:
        assert skin is not None
        spikes_ms, at_ms = receptor.respond(skin).spikes[0], motion.ramp_ms + time_ms
        after = int(np.searchsorted(spikes_ms, at_ms))
        if not 0 < after < spikes_ms.size:
            return 0.0
        return float(MS_PER_S / (spikes_ms[after] - spikes_ms[after - 1]))

    return Reading(touch, read)


def _strain(given: Given, model: ValidationRequest) -> Reading:
    """Share by which a layer below a flat plate is thinner, at the end of the paper's ramp and hold. [1]"""
    force_n = given["force_n"]
    if force_n == 0.0:
        return Reading(None, lambda _: 0.0)
    finger = model.settings.finger
    borders = (0.0, *finger.layer_depths_mm)
    middles_mm = tuple(0.5 * (above + below) for above, below in pairwise(borders))
    depth_mm = middles_mm[WORDS["layer"].index(str(given["layer"]))]
    motion = ForceRampAndHold(force_mn=MN_PER_N * force_n)
    touch = model.settings.probe_touch(Plate(), motion, depths_mm=middles_mm)  # the same for all layers

    def read(skin: SkinResponse | None) -> float:
        assert skin is not None
        site = [(model.settings.receptor_x_mm, 0.0)]
        return 1.0 - float(np.exp(-skin.sample("compressive_strain", site, depth_mm)[-1, 0]))

    return Reading(touch, read)


def _resting_rate(model: ValidationRequest) -> float:
    """Rate of the afferent without any touch. [spikes/s]"""
    afferent = model.responding
    rest = Traces.at_rest(RampAndHold().end_ms, afferent.dynamic_quantity, afferent.static_quantity)
    measure = getattr(afferent, "rate_measure", INTERVAL)
    return float(RATE_OF[measure](afferent.spikes(rest), model.static_window_ms)[0])


_READING: Mapping[str, Callable[[Given, ValidationRequest], Reading]] = {
    "force": _force,
    "deflection": _deflection,
    "rate_curvature": _rate,
    "rate_position": _rate,
    "grating": _rate,
    "receptive_field": _area,
    "dots": _dots,
    "adaptation": _adapted,
    "strain": _strain,
}  # By the kind.
