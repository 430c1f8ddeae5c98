"""Hit rates of the observers of a sweep, from the responses that its settings gave."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fingerpad.core.values import FloatArray, IntArray
from fingerpad.experiments.discrimination.decoding import SESSION, silent_stimuli
from fingerpad.experiments.requests.afferents import population_neighbours
from fingerpad.experiments.sweep.request import ObserverSettings, SweepRequest
from fingerpad.psychophysics.encoding import taking_part
from fingerpad.psychophysics.observer import ENCODERS, compare_observers

MEASURED = {"static": "static_rate_hz", "dynamic": "dynamic_rate_hz", "latency": "first_spike_latency_ms"}
"""Where a data set has each measure."""


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
    known: dict[str, tuple[IntArray, int]] = {}
    for place in np.ndindex(by_stimulus.shape[:-2]):
        index = (*place[:along], slice(None), *place[along:])
        if done[index].all():
            pairs, count = _neighbours(sweep, index, along, known)
            tables = {name: values[index][:, :count] for name, values in responses.items()}
            by_stimulus[place] = _group(sweep, tables, pairs, observers)
        on_finished()
    return found.reshape(*sweep.shape, *sweep.observer_shape)


def _neighbours(
    sweep: SweepRequest, index: Sequence[int | slice], along: int, known: dict[str, tuple[IntArray, int]]
) -> tuple[IntArray, int]:
    """Pairs of neighbours and number of receptors of a group; found once for equal afferents."""
    place = [0 if number == along else int(where) for number, where in enumerate(index)]  # type: ignore[arg-type]
    described = sweep.described(int(np.ravel_multi_index(place, sweep.shape)))
    key = f"{described.finger!r} {described.afferents!r}"
    if key not in known:
        known[key] = (
            population_neighbours(described.afferents, described.population),
            len(described.population),
        )
    return known[key]


def _group(
    sweep: SweepRequest,
    tables: Mapping[str, FloatArray],
    pairs: IntArray,
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
        encoded, neighbours = taking_part(table[order], pairs)
        plans = [(observers[n].noise, observers[n].experiment.plan) for n in numbers]
        hits = compare_observers(ENCODERS[code](neighbours), encoded, plans, seed, session=SESSION)
        for number, each in zip(numbers, hits, strict=True):
            found[order[1:], number] = each.hit_rate
    return found
