"""The state of the laboratory, and its answer: fields over the skin, contact, force and spikes over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, cast

import numpy as np
from threadpoolctl import ThreadpoolController

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.signals import STORED_ENERGY, ResponseMap, Traces
from fingerpad.core.values import FloatArray, Text, Whole, choice, limits, number_in
from fingerpad.data import psychophysics
from fingerpad.data.afferents import TYPES
from fingerpad.experiments.requests.touch import ReductionRequest
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.motion import Pose, Trajectory
from fingerpad.neuron.afferent import Afferent, AnyAfferent, type_of
from fingerpad.neuron.afferent_types import afferent_of
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.ideal_observer import multiplied_responses, present
from fingerpad.reduction.model import ON_THE_PAD, ReducedModel
from fingerpad.reduction.streaming import ReducedTouch
from fingerpad.reduction.training import first_touch_mm
from fingerpad.skin.sampling import SkinResponse

OF_RANGE = "range"  # Name of the afferents that the file of a range describes.
AFFERENTS = (*TYPES, OF_RANGE)  # Who may respond.

BOUNDS = {
    "depth_mm": (0.05, 5.0),
    "x_mm": (-20.0, 20.0),
    "z_mm": (-20.0, 20.0),
    "tilt_deg": (-45.0, 45.0),
    "slide_mm": (-20.0, 20.0),
    "ramp_ms": (20.0, 1000.0),
    "hold_ms": (50.0, 2000.0),
    "size": (0.0, 1e6),
    "other_size": (0.0, 1e6),
}
"""Widest bounds of the numbers; those of a reduced touch are mostly narrower."""


@value_class
class LabState:
    """What is pressed, how, and by whom it is felt."""

    object: Text  #: Name of what is pressed in.
    other: str = ""  #: What it is compared with, pressed in the same way; empty for nothing.
    size: Annotated[float, limits(*BOUNDS["size"])] = 0.0
    other_size: Annotated[float, limits(*BOUNDS["other_size"])] = 0.0
    """The parameter of both that varies, such as the curvature; 0 for that of the range's middle."""
    finger: str = ""
    tissues: str = ""  #: By name; empty for those of the range.
    afferent: Annotated[str, choice(AFFERENTS)] = "SAI"
    x_mm: Annotated[float, limits(*BOUNDS["x_mm"])] = 0.0
    z_mm: Annotated[float, limits(*BOUNDS["z_mm"])] = 0.0
    tilt_deg: Annotated[float, limits(*BOUNDS["tilt_deg"])] = 0.0
    """Pose of the object, from its place and direction. [mm, degrees]"""
    depth_mm: Annotated[float, limits(*BOUNDS["depth_mm"])] = 1.0  #: Below first touch. [mm]
    slide_mm: Annotated[float, limits(*BOUNDS["slide_mm"])] = 0.0  #: Along the finger in the hold. [mm]
    ramp_ms: Annotated[float, limits(*BOUNDS["ramp_ms"])] = 100.0  #: Of the press and of the lift. [ms]
    hold_ms: Annotated[float, limits(*BOUNDS["hold_ms"])] = 500.0


@checked
def state_of(asked: Mapping[str, Any]) -> LabState:
    """Read a state from plain values, such as the texts in the address of the page."""
    numbers = {
        name: number_in(name, value)
        for name, value in asked.items()
        if name in BOUNDS and isinstance(value, str)
    }
    return LabState(**{**asked, **numbers})


ABOVE_MS = 10.0  # Time to move aside above the skin, and time to approach it. [ms]
CLEARANCE_MM = 0.5  # How far above the skin the object moves aside. [mm]
RAMP_PARTS, HOLD_PARTS = 20, 25  # Samples of the ramp, of the lift and of the hold.

MAP_MM, MAP_STEP_MM = (8.0, 7.0), 0.5
"""Half-extent of the map about the middle of the pad, along and across, and distance of its points. [mm]"""

ROWS, COLUMNS = 15, 13  # Afferents along and across, 1 mm apart.
TRIALS = 1000  # Presentations of each object to an observer.
SPREAD_SPIKES = 1.0  # Standard deviation of the number of spikes that does not depend on it; assumed.


@dataclass(frozen=True)
class Answer:
    """A touch over time."""

    times_ms: FloatArray
    depth_mm: FloatArray
    force_mn: FloatArray
    force_error_mn: FloatArray
    contact_area_mm2: FloatArray
    """Depth below the first touch of the range, force, what it lies within for 95 % of touches (0 in full,
    infinite if not measured), and undeformed skin in contact, (n_times,). [mm, mN, mN, mm²]"""
    middle_mm: FloatArray  #: Middle of the contact, x and z, (n_times, 2). [mm]
    x_mm: FloatArray
    z_mm: FloatArray  #: Points of the map, (nx,). [mm]
    sed_kpa: FloatArray  #: Energy density at the end organs; NaN off the pad, (n_times, nx, nz). [kPa]
    response: ResponseMap  #: Spikes and rates of the afferents.


def shape_of(described: ReductionRequest, size: float) -> tuple[float, ...]:
    """Value of the parameter of the object that varies, if one does; 0 is that of the description."""
    name = described.training.range.parameter
    if name is None:
        return ()
    return (size or float(getattr(described.training.touch.indenter, name)),)


def motion_of(
    described: ReductionRequest, model: ReducedModel | None, state: LabState
) -> tuple[Trajectory, tuple[float, ...]]:
    """Press, hold and perhaps slide, lift; and the shape of the object.

    Without a reduced touch, first touches are found from the shapes of object and finger.
    """
    training = described.training
    if state.depth_mm > training.range.depth_mm:
        must = f"must be at most {training.range.depth_mm:g}, the depth of this reduced touch"
        raise InputError("depth_mm", must, f"{state.depth_mm:g}")
    shape = shape_of(described, state.size)
    ways = (state.x_mm, state.x_mm + state.slide_mm)
    poses = [(x, state.z_mm, state.tilt_deg, *shape) for x in ways]
    if model is not None:
        meets = [float(model.pose_weights(pose) @ model.first_touch_mm) for pose in poses]
        highest = float(model.first_touch_mm.min())
    else:
        for pose in poses:
            for axis, value in zip(training.range.axes, pose, strict=True):
                axis.weights(value)  # refuses what lies out of the range
        touch = training.touch_with(shape)
        meets = [first_touch_mm(touch, Pose(*pose[:3])) for pose in poses]
        highest = min(meets)
    above = min(0.0, *meets, highest) - CLEARANCE_MM
    times = np.cumsum([0.0, ABOVE_MS, ABOVE_MS, state.ramp_ms, state.hold_ms, state.ramp_ms])
    depth = [above, above, meets[0], meets[0] + state.depth_mm, meets[1] + state.depth_mm, meets[1]]
    return Trajectory(
        tuple(times.tolist()),
        depth_mm=tuple(depth),
        x_mm=(0.0, *[ways[0]] * 3, ways[1], ways[1]),
        z_mm=(0.0, *[state.z_mm] * 5),
        tilt_deg=(0.0, *[state.tilt_deg] * 5),
    ), shape


def sample_times_ms(motion: Trajectory) -> FloatArray:
    """Return the times of a motion at which the reduced touch is evaluated."""
    parts = (1, 1, RAMP_PARTS, HOLD_PARTS, RAMP_PARTS)
    ends = zip(motion.times_ms[:-1], motion.times_ms[1:], parts, strict=True)
    return np.concatenate([[0.0], *(a + (b - a) * np.arange(1, n + 1) / n for a, b, n in ends)])


def population_of(described: ReductionRequest, state: LabState) -> Population:
    """Afferents of one type or several in the pad, each 1 mm apart."""
    finger = finger_of(described)
    grid = Population.grid(psychophysics.RECEPTOR_DENSITY.value, ROWS, COLUMNS, finger=finger)
    positions = grid.positions_mm[_on_pad(finger, *grid.positions_mm.T)]
    parts = {
        name: Population(positions, grid.pitch_mm, afferent)
        for name, afferent in afferents_in(described, state).items()
    }
    return Population.mixed(parts) if len(parts) > 1 else next(iter(parts.values()))


def afferents_in(described: ReductionRequest, state: LabState) -> Mapping[str, AnyAfferent]:
    """Afferents of a state by type: of one type by its name, or those of the range.

    Here SAI is the afferent that was fitted with the tissues, without the low pass of `fp.SAI()`.
    """
    if state.afferent == OF_RANGE:
        laid = described.population
        return {name: part.afferent for name, part in (laid.parts or {type_of(laid.afferent): laid}).items()}
    if state.afferent == "SAI":
        return {"SAI": Afferent.for_tissues(described.tissues)}
    return {state.afferent: afferent_of(state.afferent, described.tissues)}


def _on_pad(finger: Fingertip, x_mm: FloatArray, z_mm: FloatArray) -> FloatArray:
    """Whether places lie where fields are known."""
    inside = np.asarray((x_mm > 1.0) & (x_mm < finger.length_mm - 1.0))
    widest = ON_THE_PAD * finger.section(np.where(inside, x_mm, 0.5 * finger.length_mm))[2]
    return np.asarray(inside & (np.abs(z_mm) < widest))


def one_thread() -> AbstractContextManager[object]:
    """Limit the threads of NumPy: matrices are small, and on busy cores threads wait for each other."""
    return _controller().limit(limits=1)


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


def finger_of(described: ReductionRequest) -> Fingertip:
    """Return the finger that is pressed; only a `Fingertip` can be reduced."""
    return cast(Fingertip, described.training.touch.finger)


def map_axes(described: ReductionRequest) -> tuple[FloatArray, FloatArray]:
    middle = described.training.touch.finger.contact_mm
    along, across = (
        centre + np.arange(-reach, reach + 0.5 * MAP_STEP_MM, MAP_STEP_MM)
        for centre, reach in zip(middle, MAP_MM, strict=True)
    )
    return along, across


def reduced_answer(described: ReductionRequest, model: ReducedModel, state: LabState) -> Answer:
    motion, shape = motion_of(described, model, state)
    population = population_of(described, state)
    stream = ReducedTouch(model, _sites(described, population), *shape)
    weights, samples = [], []
    with one_thread():
        for time in sample_times_ms(motion).tolist():
            pose, depth = motion.pose_at(time), float(motion.prescribed_at(time))
            weights.append(model.pose_weights((pose.x_mm, pose.z_mm, pose.tilt_deg, *shape)))
            samples.append(stream.step(time, depth, None, pose.x_mm, pose.z_mm, pose.tilt_deg))
    fields = {name: np.stack([sample.fields[name] for sample in samples]) for name in samples[0].fields}
    names = ("time_ms", "depth_mm", "force_mn", "force_error_mn", "contact_area_mm2")
    totals = [np.array([getattr(sample, name) for sample in samples]) for name in names]
    return _answer(described, motion, population, fields, np.array(weights) @ model.middle_mm, totals)


def in_full(described: ReductionRequest, motion: Trajectory, state: LabState, skin: SkinResponse) -> Answer:
    """Answer by a full solution of the same motion."""
    population = population_of(described, state)
    sites = _sites(described, population)
    followed = [name for part in population.parts.values() or [population] for name in part.quantities]
    fields = {name: skin.sample(name, sites) for name in {STORED_ENERGY, *followed}}
    no_error_mn = np.zeros(skin.times_ms.size)
    totals = skin.times_ms, skin.depth_mm, skin.force_mn, no_error_mn, skin.contact_area_mm2
    nodes_mm = skin.mesh.nodes_mm[skin.mesh.skin_nodes]
    weight = skin.contact_pressure_kpa * skin.mesh.skin_area_mm2
    total = weight.sum(axis=1, keepdims=True)
    middles_mm = (weight @ nodes_mm[:, [0, 2]]) / np.where(total > 0.0, total, 1.0)
    if skin.touch is not None and not skin.touch.grading.full:
        middles_mm[:, 1] = 0.0
    return _answer(described, motion, population, fields, middles_mm, totals)


def _sites(described: ReductionRequest, population: Population) -> FloatArray:
    """Points of the map that lie on the pad, then the afferents."""
    x, z = (grid.ravel() for grid in np.meshgrid(*map_axes(described), indexing="ij"))
    inside = _on_pad(finger_of(described), x, z)
    return np.vstack([np.column_stack([x, z])[inside], population.sites_mm])


def _answer(
    described: ReductionRequest,
    motion: Trajectory,
    population: Population,
    fields: dict[str, FloatArray],
    middles_mm: FloatArray,
    totals: Sequence[FloatArray],
) -> Answer:
    """Answer of the fields at `_sites` over time; `totals` are the first five fields of an `Answer`."""
    times, depth, force, error, area = totals
    x, z = map_axes(described)
    on_skin = _on_pad(finger_of(described), *np.meshgrid(x, z, indexing="ij"))
    sed = np.full((times.size, x.size, z.size), np.nan)
    n_map = np.count_nonzero(on_skin)
    sed[:, on_skin] = fields[STORED_ENERGY][:, :n_map]
    start, held, ends = motion.times_ms[2:5]
    kinks_ms, first = np.intersect1d(motion.times_ms[1:-1], times), n_map
    maps = {}
    for name, part in (population.parts or {"": population}).items():
        here = slice(first, first + len(part.sites_mm))
        dynamic, static = (fields[quantity][:, here] for quantity in part.quantities)
        other, quantity = part.quantities
        rate_of = None if other == quantity else Traces(times, dynamic, quantity=other)
        traces = Traces(times, static, kinks_ms, quantity, rate_of)
        maps[name], first = part.respond_to(traces, (start, held), (held, ends)), here.stop
    response = ResponseMap.joined(maps) if population.parts else maps[""]
    return Answer(times, depth, force, error, area, middles_mm, x, z, sed, response)


@dataclass(frozen=True)
class Comparison:
    """What observers say about two touches, in trials of two alternatives."""

    ideal: float
    summed: float
    """Proportion correct of the observer that knows every afferent, and of the one that knows the sum of all
    spikes. [0-1]"""


@checked
def compared(one: Answer, other: Answer, seed: Whole = 1) -> Comparison:
    """Compare two touches by the spikes that each afferent fires.

    Numbers of spikes have the multiplicative noise of the paper and a further spread of one spike.
    """
    counts = [each.response.spike_count.astype(float) for each in (one, other)]
    if (counts[0] == counts[1]).all():
        return Comparison(0.5, 0.5)
    # Whoever is silent for both tells nothing.
    firing = counts[0] + counts[1] > 0.0
    first, second = (
        multiplied_responses(each[firing], psychophysics.NOISE_SIGMA.value, SPREAD_SPIKES) for each in counts
    )
    with one_thread():
        shown = present(first, second, seed, TRIALS)
        return Comparison(
            shown.ideal().proportion_correct,
            shown.of(lambda responses: responses.sum(axis=1)).proportion_correct,
        )
