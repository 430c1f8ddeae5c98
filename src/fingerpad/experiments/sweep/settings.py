"""The settings of a sweep: what they will take, what a worker does with them, what observers find in them."""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.signals import ResponseMap
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.experiments.discrimination.analysis import SESSION, silent_stimuli
from fingerpad.experiments.requests.afferents import population_neighbours
from fingerpad.experiments.requests.touch import estimate_press
from fingerpad.experiments.sweep.request import ObserverSettings, SweepRequest
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import noise_offset, taking_part
from fingerpad.psychophysics.observer import ENCODERS, compare_observers
from fingerpad.skin.fields import FIELDS, Place, stored_fields, watched_elements
from fingerpad.skin.sampling import SkinResponse
from fingerpad.skin.store import Store

MEASURED = {"static": "static_rate_hz", "dynamic": "dynamic_rate_hz", "latency": "first_spike_latency_ms"}
"""Where a data set has each measure."""

TRACES = ("times_ms", "force_mn", "depth_mm", "contact_area_mm2")  # Fields that every sweep keeps.

PLACES_MM: dict[Place, tuple[str, Callable[[SkinResponse], np.ndarray]]] = {
    Place.NODE: ("node_mm", lambda skin: skin.mesh.nodes_mm),
    Place.SKIN_NODE: ("skin_node_mm", lambda skin: skin.mesh.nodes_mm[skin.mesh.skin_nodes]),
    Place.ELEMENT: ("element_mm", lambda skin: skin.mesh.nodes_mm[skin.mesh.elements].mean(axis=1)),
    Place.WATCHED: (
        "sheet_mm",
        lambda skin: skin.mesh.nodes_mm[skin.mesh.elements[skin.watched_elements]].mean(axis=1),
    ),
}  # Where the values of fields are, undeformed: name of the positions, and the positions. [mm]


@dataclass(frozen=True)
class Case:
    """One press with the settings that are wanted of it."""

    sweep: bytes  #: The pickled request.
    press: int
    settings: tuple[int, ...]  #: Numbers of the settings, all of this press.
    store: Path  #: Folder of stored indentations.


@dataclass(frozen=True)
class Settled:
    """What became of a case."""

    press: int
    pressed: bool  #: Whether it was pressed, and not loaded.
    seconds: float  #: Time of the press. [s]
    skin: Mapping[str, np.ndarray] = field(default_factory=dict)  #: By name; empty if it failed.
    responses: Mapping[int, ResponseMap] = field(default_factory=dict)  #: By number of the setting.
    failures: Mapping[int, str] = field(default_factory=dict)  #: Why there is no response, by setting.


def settle(case: Case, threads: int | None = None) -> Settled:
    """Press, or load what is stored, and let the afferents of every setting respond."""
    sweep = _sweep(case.sweep)
    began = time.perf_counter()
    first = case.settings[0]
    try:
        described = sweep.described(first)
        touch, store = described.touch, Store(case.store)
        pressed = bool(store.missing([touch]))
        if pressed:
            store.save(touch, touch.solve(threads))
        # In the single precision of the store: a sweep that goes on has the bits of one that did not stop.
        skin = store.load(touch)
    except (InputError, ConvergenceError) as error:
        return Settled(
            case.press, False, time.perf_counter() - began, failures=dict.fromkeys(case.settings, str(error))
        )
    seconds = time.perf_counter() - began
    responses, failures = {}, {}
    for setting in case.settings:
        try:
            responses[setting] = sweep.described(setting).pressed_as(described).respond(skin)
        except InputError as error:
            failures[setting] = str(error)
    names = dict.fromkeys((*TRACES, *sweep.fields))
    kept = {name: skin.fields[name] for name in names}
    places = dict.fromkeys(FIELDS[name].place for name in names)
    kept |= {PLACES_MM[place][0]: PLACES_MM[place][1](skin) for place in places if place in PLACES_MM}
    return Settled(case.press, pressed, seconds, kept, responses, failures)


@lru_cache(maxsize=2)
def _sweep(pickled: bytes) -> SweepRequest:
    """Read a sweep once per process."""
    return pickle.loads(pickled)


def unsettled(sweep: SweepRequest, done: np.ndarray, store: Path) -> Sequence[Case]:
    """Cases of a sweep of which some settings are not done and meet the constraints."""
    pickled = pickle.dumps(sweep.changed())  # without what it has computed
    cases = []
    for press in range(sweep.presses):
        wanted = tuple(setting for setting in sweep.settings_of(press) if not done[setting])
        if wanted:
            cases.append(Case(pickled, press, wanted, store.absolute()))
    return cases


def observe(
    sweep: SweepRequest,
    responses: Mapping[str, FloatArray],
    done: np.ndarray,
    on_finished: Callable[[], None],
) -> FloatArray:
    observers = sweep.observers
    along, _ = sweep.stimuli_axis(observers[0])
    found = np.full((*sweep.shape, len(observers)), np.nan)
    by_stimulus = np.moveaxis(found, along, -2)
    known: dict[str, tuple[IntArray, Population]] = {}
    for place in np.ndindex(by_stimulus.shape[:-2]):
        index = (*place[:along], slice(None), *place[along:])
        if done[index].all():
            pairs, population = _neighbours(sweep, index, along, known)
            tables = {name: values[index][:, : len(population)] for name, values in responses.items()}
            by_stimulus[place] = _group(sweep, tables, pairs, population, observers)
        on_finished()
    return found.reshape(*sweep.shape, *sweep.observer_shape)


def _neighbours(
    sweep: SweepRequest,
    index: Sequence[int | slice],
    along: int,
    known: dict[str, tuple[IntArray, Population]],
) -> tuple[IntArray, Population]:
    """Pairs of neighbours and population of a group; found once for equal afferents."""
    place = [0 if number == along else int(where) for number, where in enumerate(index)]  # type: ignore[arg-type]
    described = sweep.described(int(np.ravel_multi_index(place, sweep.shape)))
    key = f"{described.finger!r} {described.afferents!r}"
    if key not in known:
        known[key] = (population_neighbours(described.afferents, described.population), described.population)
    return known[key]


def _group(
    sweep: SweepRequest,
    tables: Mapping[str, FloatArray],
    pairs: IntArray,
    population: Population,
    observers: Sequence[ObserverSettings],
) -> FloatArray:
    """Hit rates of all observers of one group, (n_stimuli, n_observers)."""
    n_stimuli = len(next(iter(tables.values())))
    found = np.full((n_stimuli, len(observers)), np.nan)
    alike: dict[tuple[str, str, float | None, int, int], list[int]] = {}
    for number, one in enumerate(observers):
        standard = sweep.stimuli_axis(one)[1]
        key = (one.code, one.measure, one.latest_ms, standard, one.experiment.seed)
        alike.setdefault(key, []).append(number)
    for (code, measure, latest_ms, standard, seed), numbers in alike.items():
        table = tables[MEASURED[measure]]
        if measure == "latency" and latest_ms is not None:
            table = np.fmin(table, latest_ms)
        if silent_stimuli(table, measure, latest_ms).size:
            continue
        order = np.concatenate([[standard], np.delete(np.arange(n_stimuli), standard)])
        encoded = taking_part(table[order], pairs, noise_offset(measure, population.noise_offset_hz))
        plans = [(encoded.noise(observers[n].noise), observers[n].experiment.plan) for n in numbers]
        code_of_pairs = ENCODERS[code](encoded.neighbours)
        hits = compare_observers(code_of_pairs, encoded.responses, plans, seed, session=SESSION)
        for number, each in zip(numbers, hits, strict=True):
            found[order[1:], number] = each.hit_rate
    return found


MOST_LOOKED_AT = 8  # Presses whose meshes are built for the estimate, spread evenly over the sweep.
CORES = 2  # Cores that the time of a single press is for. On one of them it takes twice as long at most.


@dataclass(frozen=True)
class SweepEstimate:
    """What a sweep will take if nothing of it is stored yet."""

    settings: int
    presses: int  #: How many, without those that are left out.
    looked_at: int  #: Presses that the estimate is from.
    time_s: float
    memory_mb: float
    disk_mb: float  #: Time on the clock, memory of all processes, and stored indentations. [s], [MB], [MB]
    processes: int  #: How many press at a time.

    @property
    def lines(self) -> tuple[str, ...]:
        return (
            f"{self.settings} settings, {self.presses} presses.",
            f"If none is stored: about {_spelled(self.time_s)} with {self.processes} process(es), "
            f"{self.memory_mb:.0f} MB of memory, {self.disk_mb:.0f} MB on the disk (from {self.looked_at} of "
            "the presses).",
        )


def estimate_sweep(sweep: SweepRequest, processes: int) -> SweepEstimate:
    kept = [press for press in range(sweep.presses) if any(map(sweep.allowed, sweep.settings_of(press)))]
    chosen = [kept[n] for n in np.unique(np.linspace(0, len(kept) - 1, MOST_LOOKED_AT).round().astype(int))]
    found, bytes_each = [], []
    for press in chosen:
        described = sweep.described(next(filter(sweep.allowed, sweep.settings_of(press))))
        try:
            found.append(estimate_press(described.touch))
        except InputError:
            continue  # it fails at once, and its reason is in the result
        mesh = described.touch.mesh
        watched = watched_elements(mesh, described.touch.receptor_depths_mm)
        bytes_each.append(
            sum(
                np.prod(field.shape(mesh, found[-1].steps + 1, watched.size), dtype=float)
                * (8 if field.place is Place.PRESS else 4)
                for field in stored_fields()
            )
        )
    if not found:
        raise InputError(
            f"{sweep.origin.name} must have a press that is possible: none of {len(chosen)} looked at is."
        )
    at_once = min(processes, len(kept))
    each_s = float(np.mean([one.time_s for one in found])) * (CORES if at_once > 1 else 1)
    return SweepEstimate(
        settings=sum(map(sweep.allowed, range(sweep.size))) if sweep.where else sweep.size,
        presses=len(kept),
        looked_at=len(found),
        time_s=each_s * len(kept) / at_once,
        memory_mb=max(one.memory_mb for one in found) * (at_once + (at_once > 1)),
        disk_mb=float(np.mean(bytes_each)) * len(kept) / 1e6,
        processes=at_once,
    )


def _spelled(seconds: float) -> str:
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.0f} s"
