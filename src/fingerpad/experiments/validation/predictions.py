"""What the model predicts under each condition of a file of observations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.signals import INTERVAL, Traces
from fingerpad.core.units import MN_PER_N
from fingerpad.core.values import FloatArray
from fingerpad.data import protocol
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.validation.observations import Kind, Value
from fingerpad.experiments.validation.request import QUASI_STATIC, ValidationRequest
from fingerpad.geometry.edged_indenters import Grating
from fingerpad.geometry.indenter_grading import grading_about
from fingerpad.geometry.indenters import Indenter, Plate, Sphere
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import RATE_OF
from fingerpad.skin.indentation import Touch, settings_of, touch_of
from fingerpad.skin.sampling import SkinResponse

QUASI_STATIC_MS = 1e12  # After such a ramp all Prony terms have relaxed to 1 in 10⁶. [ms]


@dataclass(frozen=True)
class Reading:
    """How the prediction of one row is obtained."""

    touch: Touch | None  # What is pressed; None if nothing is, at depth or force 0.
    of: Callable[[SkinResponse | None], float]  # Reads the prediction; None without a touch.


Plan = Reading | InputError  # How a condition is predicted, or why it cannot be pressed.
Condition = tuple[Value, ...]


@dataclass(frozen=True)
class Predictions:
    """Predictions row by row."""

    values: FloatArray  # In the unit of the observations; NaN where there is none, (n_rows,).
    mirrored: FloatArray | None  # With proximal and distal exchanged, for kinds with an axis, (n_rows,).
    reasons: Mapping[int, str]  # Why a row has no prediction.
    meshed: SkinResponse | None  # One of the responses, for its mesh.


def predict(model: ValidationRequest, runner: Runner) -> Predictions:
    """Press what is not stored yet, and read the prediction of every row."""
    observations = model.observed
    kind, axis = observations.kind, observations.kind.axis
    given = {
        row.condition: dict(zip(kind.conditions, row.condition, strict=True)) for row in observations.rows
    }
    plans = {condition: _plan(kind, values, model) for condition, values in given.items()}
    touches = [plan.touch for plan in plans.values() if isinstance(plan, Reading) and plan.touch]
    failed: dict[Touch, ConvergenceError | InputError] = {}
    skins = runner.responses(
        {kind.name: {touch: touch for touch in touches}}, on_failed=failed.__setitem__
    )[kind.name]  # fmt: skip

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
        turned = {
            condition: _plan(kind, each | {axis: -_number(each[axis])}, model)
            for condition, each in given.items()
        }
        mirrored, _ = read(turned)
    return Predictions(values, mirrored, reasons, next(iter(skins.values()), None))


def _plan(kind: Kind, given: Mapping[str, Value], model: ValidationRequest) -> Plan:
    """How a condition is predicted, or why it cannot be pressed."""
    try:
        return _READING[kind.observed](given, model)
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


def _number(value: Value) -> float:
    assert isinstance(value, float)
    return value


def _pressed_to(given: Mapping[str, Value], model: ValidationRequest) -> Touch | None:
    """Touch that reaches a depth, perpendicular to the long axis of the finger; None at depth 0."""
    indenter, depth_mm = model.observed.indenter(str(given["indenter"])), _number(given["depth_mm"])
    if depth_mm == 0.0:
        return None
    conditions = model.settings
    motion, settings = RampAndHold(depth_mm=depth_mm), settings_of(conditions.resolution)
    if model.loading == QUASI_STATIC:
        motion = replace(motion, ramp_ms=QUASI_STATIC_MS)
        settings = replace(settings, hold_steps=1)
    pressed = conditions.finger, indenter, motion, conditions.tissues, conditions.resolution
    return touch_of(*pressed, settings=settings, grading=conditions.grading)


def _force(given: Mapping[str, Value], model: ValidationRequest) -> Reading:
    return Reading(
        _pressed_to(given, model), lambda skin: float(skin.force_mn[-1]) / MN_PER_N if skin else 0.0
    )


def _deflection(given: Mapping[str, Value], model: ValidationRequest) -> Reading:
    """Deflection of the skin at a distance from the indenter's axis, proximal positive. [mm]"""
    distance_mm = _number(given["distance_mm"])

    def read(skin: SkinResponse | None) -> float:
        if skin is None:
            return 0.0
        profile = skin.surface_profile()
        first, last = -profile.distance_mm[-1], -profile.distance_mm[0]
        if not first <= distance_mm <= last:
            raise InputError(
                "distance_mm",
                f"must lie on the finger, from {first:.1f} to {last:.1f} mm",
                f"{distance_mm:g} mm",
            )
        return float(profile.at(-distance_mm))

    return Reading(_pressed_to(given, model), read)


def _rate(given: Mapping[str, Value], model: ValidationRequest) -> Reading:
    """Rate of an afferent at a position from the middle of a touch by force, proximal positive. [spikes/s]"""
    conditions, force_n = model.settings, _number(given["force_n"])
    position_mm = _number(given.get("position_mm", 0.0))
    body: Indenter
    if "ridge_mm" in given:
        ridge_mm, groove_mm = _number(given["ridge_mm"]), _number(given["groove_mm"])
        body = Grating(ridge_mm, groove_mm, min(protocol.LIP_RADIUS.value, ridge_mm / 2))
        position_mm -= body.period_mm * round(position_mm / body.period_mm)
        grading = conditions.grading
    else:
        curvature = _number(given["curvature_per_m"])
        body = Sphere(curvature_per_m=curvature) if curvature > 0.0 else Plate()
        # One mesh for all curvatures, so that no difference between them is one between meshes.
        grading = conditions.grading or grading_about(
            Plate(), conditions.resolution, conditions.receptor_x_mm
        )
    along = np.cos(np.deg2rad(conditions.skin_tilt_deg))
    site = (conditions.receptor_x_mm - position_mm * along, 0.0)
    conditions.finger.skin_point(*site)
    if force_n == 0.0:
        return Reading(None, lambda _: _resting_rate(model))
    motion, tilt_deg = ForceRampAndHold(force_mn=MN_PER_N * force_n), conditions.skin_tilt_deg
    pressed = conditions.finger, body, motion, conditions.tissues, conditions.resolution
    depths_mm = conditions.receptor_depths_mm
    touch = touch_of(*pressed, grading=grading, tilt_deg=tilt_deg, receptor_depths_mm=depths_mm)
    receptor = Population(np.array([site]), 1.0, model.responding, depth_mm=model.depth_mm)

    def read(skin: SkinResponse | None) -> float:
        assert skin is not None
        return float(receptor.respond(skin, static_window_ms=model.static_window_ms).static_rate_hz[0])

    return Reading(touch, read)


def _resting_rate(model: ValidationRequest) -> float:
    """Rate of the afferent without any touch. [spikes/s]"""
    afferent = model.responding
    rest = Traces.at_rest(RampAndHold().end_ms, afferent.dynamic_quantity, afferent.static_quantity)
    measure = getattr(afferent, "rate_measure", INTERVAL)
    return float(RATE_OF[measure](afferent.spikes(rest), model.static_window_ms)[0])


_READING: Mapping[str, Callable[[Mapping[str, Value], ValidationRequest], Reading]] = {
    "force_n": _force,
    "deflection_mm": _deflection,
    "rate_hz": _rate,
}  # By what was observed.
