"""One press of a sweep with all its settings: what a worker does, and what it hands back."""

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
from fingerpad.experiments.requests.touch import TouchRequest
from fingerpad.experiments.sweep.request import SweepRequest
from fingerpad.skin.fields import FIELDS, Place
from fingerpad.skin.sampling import SkinResponse
from fingerpad.skin.store import Store

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

    sweep: bytes  # The pickled request.
    press: int
    settings: tuple[int, ...]  # Numbers of the settings, all of this press.
    store: Path  # Folder of stored indentations.


@dataclass(frozen=True)
class Settled:
    """What became of a case."""

    press: int
    pressed: bool  # Whether it was pressed, and not loaded.
    seconds: float  # Time of the press. [s]
    skin: Mapping[str, np.ndarray] = field(default_factory=dict)  # By name; empty if it failed.
    responses: Mapping[int, ResponseMap] = field(default_factory=dict)  # By number of the setting.
    failures: Mapping[int, str] = field(default_factory=dict)  # Why there is no response, by setting.


def settle(case: Case, threads: int | None = None) -> Settled:
    """Press, or load what is stored, and let the afferents of every setting respond."""
    sweep = _sweep(case.sweep)
    began = time.perf_counter()
    first = case.settings[0]
    try:
        described = sweep.described(first)
        skin, pressed = skin_of(described, Store(case.store), threads)
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


def skin_of(described: TouchRequest, store: Store, threads: int | None) -> tuple[SkinResponse, bool]:
    """Response of the skin to a touch, and whether it was pressed for it."""
    if not store.missing([described.touch]):
        return store.load(described.touch), False
    skin = described.touch.solve(threads)
    store.save(described.touch, skin)
    # What was stored is in single precision: a sweep that goes on has the same bits as one that did not stop.
    return store.load(described.touch), True


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
