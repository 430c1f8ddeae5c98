"""Responses as sessions of NWB, and read back from these and from tables; spikes for pynapple and neo."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.displayed import Columns
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, write_atomically
from fingerpad.core.phases import Phase
from fingerpad.core.signals import PLACES, RECEPTOR_COLUMNS, ResponseMap, SpikeTrains
from fingerpad.core.tables import read_csv
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import Finite, FloatArray, NotNegative, positive
from fingerpad.experiments.recording_files import SUFFIXES_OF_NWB, nwb_session, spike_times
from fingerpad.export.results import library, require
from fingerpad.neuron.afferent_types import afferent_types

MEASURED = tuple(part.name for part in fields(ResponseMap) if part.name in RECEPTOR_COLUMNS)
"""Columns from which a response is read back, beside its places and spikes; the others follow from it."""


def response_of(columns: Mapping[str, Any], spikes: Sequence[FloatArray], **known: Any) -> ResponseMap:
    """Make a response of its columns, as `ResponseMap.columns` has them, and its spike trains. [ms]"""
    measured: Any = {name: np.asarray(columns[name]) for name in MEASURED}
    pitches = np.asarray(columns["pitch_mm"])
    response = ResponseMap(
        positions_mm=np.column_stack([columns[place] for place in PLACES[3 if "y_mm" in columns else 2]]),
        pitch_mm=float(pitches.min()),
        spikes=SpikeTrains.from_lists(spikes),
        **measured,
        **known,
    ).of_types(list(columns.get("type", ())), pitches)
    if not response.parts:
        return response
    types = afferent_types()  # say how the rates of each type are measured
    parts = {
        name: replace(
            part,
            rate_measure=getattr(types.get(name), "rate_measure", part.rate_measure),
            quantity=getattr(types.get(name), "static_quantity", part.quantity),
        )
        for name, part in response.parts.items()
    }
    return ResponseMap.joined(parts)


@checked
def read_response_csv(path: Path) -> ResponseMap:
    """Read what `ResponseMap.save` wrote as .csv."""
    rows = read_csv(path_of("path", path), (), prefixes=("",))
    have = rows[0].entries
    for column in ("x_mm", "z_mm", "pitch_mm", *MEASURED, "spike_times_ms"):
        if column not in have:
            needs = f"must have the column {column}, as a response is saved"
            raise InputError(path, needs, ", ".join(have))
    columns: dict[str, list[str] | list[float]] = {}
    if "type" in have:
        columns["type"] = [row.text("type") for row in rows]
    for column in ("pitch_mm", *PLACES[3], *MEASURED):
        if column in have:
            columns[column] = [row.number(column) if row.has(column) else np.nan for row in rows]
    return response_of(columns, [spike_times(row) for row in rows])


def spikes_and_columns(result: Any) -> tuple[SpikeTrains, Columns]:
    """Spike trains of a result, and what is known of each afferent, by name."""
    if isinstance(result, SpikeTrains):
        return result, {}
    columns = result.columns()
    del columns["receptor"]
    return result.spikes, columns


def to_pynapple(result: Any) -> Any:
    """Return spike trains as a group; see `SpikingResult.to_pynapple`."""
    pynapple = library("pynapple", "Groups of spike trains need pynapple", "spikes")
    spikes, columns = spikes_and_columns(result)
    whole = pynapple.IntervalSet(0.0, _end_ms(result, spikes), time_units="ms")
    trains = {number: pynapple.Ts(train, "ms", time_support=whole) for number, train in enumerate(spikes)}
    return pynapple.TsGroup(trains, time_support=whole, metadata=columns or None)


def to_neo(result: Any) -> Any:
    """Return spike trains as a block; see `SpikingResult.to_neo`."""
    neo = library("neo", "Blocks of spike trains need neo", "spikes")
    spikes, columns = spikes_and_columns(result)
    segment, end_ms = neo.Segment(), _end_ms(result, spikes)
    for number, train in enumerate(spikes):
        known = {name: np.asarray(values).tolist()[number] for name, values in columns.items()}
        segment.spiketrains.append(neo.SpikeTrain(train, units="ms", t_stop=end_ms, id=number, **known))
    if phases := getattr(result, "phases", ()):
        windows = np.array([phase.window_ms for phase in phases])
        names = [phase.name for phase in phases]
        segment.epochs.append(neo.Epoch(windows[:, 0], np.diff(windows)[:, 0], names, units="ms"))
    block = neo.Block()
    block.segments.append(segment)
    return block


def _end_ms(result: Any, spikes: SpikeTrains) -> float:
    """End of a touch, or the last spike where that is not known; not 0, which both refuse. [ms]"""
    return float(getattr(result, "duration_ms", None) or spikes.times_ms.max(initial=0.0) or 1.0)


_RESOLUTION_S = 1e-9  # Spike times are roots of a closed form; those of two processors differ by less. [s]

_UNIT_COLUMNS = {
    **{f"{axis}_mm": f"{axis} of the receptor on the undeformed skin, in mm" for axis in "xyz"},
    "pitch_mm": "distance between neighbours of the same type, in mm",
    "type": "type of the afferent",
}
"""What is known of each unit beside its spikes, by the name of the column."""


@checked
def write_responses_nwb(
    path: str | Path,
    responses: Mapping[str, ResponseMap],
    duration_ms: Finite | None = None,
    pause_ms: NotNegative = 1000.0,
    started: datetime | None = None,
) -> Path:
    """Write a session: one trial per touch, one epoch per phase of its motion, one unit per receptor.

    The column `stimulus` of the trials holds the name of the touch, the tags of an epoch are the names of the
    phase and of the touch; a unit has its position, all its spike times, its rates and latency in each trial
    and, in a mixed population, its type. `fingerpad fit` reads the file like recordings, one unit at a time,
    and `read_responses_nwb` as responses. The extra `fingerpad[nwb]` is required.

    Parameters
    ----------
    path : Path
        The file, .nwb, .h5 or .hdf5, written as a whole; folders are created if needed.
    responses : mapping of str to ResponseMap
        Responses of the same receptors, by the names of the touches. Each lasts as long as its motion.
    duration_ms : float, optional
        Duration of all touches, for responses that do not know their own. [ms]
    pause_ms : float, optional
        From the end of a touch to the onset of the next. [ms]
    started : datetime, optional
        Begin of the session, with its time zone. Default: now.

    Raises
    ------
    StoreError
        If the file cannot be written.

    Examples
    --------
    >>> from fingerpad.core.signals import SpikeTrains
    >>> trains = SpikeTrains.from_lists([[12.5, 40.0], []])
    >>> response = ResponseMap([[17.0, 0.5], [17.0, 1.5]], 1.0, trains, [36.4, 0], [0, 0], [12.5, np.nan])
    >>> with TemporaryDirectory() as folder:
    ...     write_responses_nwb(Path(folder) / "session.nwb", {"ball": response}, 1000.0).name
    'session.nwb'
    """
    file = path_of("path", path)
    if file.suffix not in SUFFIXES_OF_NWB:
        raise InputError(f"A session is written as {', '.join(SUFFIXES_OF_NWB)}: got {file.name}.")
    began = started or datetime.now(UTC)
    if began.tzinfo is None:
        raise InputError("started", "must have a time zone, such as datetime.UTC", str(began.isoformat()))
    _same_receptors(responses)
    durations_ms = _durations(responses, duration_ms)
    onsets_ms = np.cumsum(durations_ms + pause_ms) - durations_ms - pause_ms
    # Warnings of the library do not concern the content of the file.
    with warnings.catch_warnings(), TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")
        require("nwb")
        import pynwb

        session = pynwb.NWBFile(
            f"simulated by fingerpad {version('fingerpad')}",
            file.stem,
            began,
            experiment_description="Simulated touch of a fingertip: finite elements and afferents.",
            keywords=["simulation", "touch", "tactile afferents"],
            # A range of ages without bounds: the finger is a model.
            subject=pynwb.file.Subject(
                subject_id="model",
                species="Homo sapiens",
                sex="U",
                age="P0D/",
                description="Finite-element model of a fingertip.",
            ),
        )
        session.add_trial_column("stimulus", "name of the touch")
        trials = zip(responses.items(), onsets_ms, durations_ms, strict=True)
        for (name, answer), onset_ms, lasts_ms in trials:
            session.add_trial(onset_ms / MS_PER_S, (onset_ms + lasts_ms) / MS_PER_S, stimulus=name)
            for phase in answer.phases:
                start, end = ((onset_ms + time_ms) / MS_PER_S for time_ms in phase.window_ms)
                session.add_epoch(start, end, tags=[phase.name, name])
        session.units = pynwb.misc.Units(
            name="units", description="One unit per receptor.", resolution=_RESOLUTION_S
        )
        tables = [response.columns() for response in responses.values()]
        known = [name for name in tables[0] if name not in ("receptor", *RECEPTOR_COLUMNS)]
        for name in known:
            session.add_unit_column(name, _UNIT_COLUMNS[name])
        words = "in each trial, in the unit at the end of the name; NaN if there is none"
        for name, column in RECEPTOR_COLUMNS.items():
            session.add_unit_column(name, f"{column.long_name}, {words}")
        for receptor in range(len(tables[0]["receptor"])):
            trains = [answer.spikes[receptor] for answer in responses.values()]
            times_ms = [onset + train for onset, train in zip(onsets_ms, trains, strict=True)]
            session.add_unit(
                id=receptor,
                spike_times=np.concatenate(times_ms) / MS_PER_S,
                obs_intervals=[[0.0, (onsets_ms[-1] + durations_ms[-1]) / MS_PER_S]],
                **{name: tables[0][name][receptor] for name in known},
                **{name: [float(table[name][receptor]) for table in tables] for name in RECEPTOR_COLUMNS},
            )
        unfinished = Path(folder) / "session.nwb"
        with pynwb.NWBHDF5IO(str(unfinished), mode="w") as opened:
            opened.write(session)
        write_atomically(file, unfinished.read_bytes())
    return file


def to_nwb(result: Any, path: str | Path, touch: str, **options: Any) -> Path:
    """Write one response as a session; see `SpikingResult.to_nwb`."""
    if isinstance(result, SpikeTrains):
        raise InputError("A session needs the places of the afferents: save the ResponseMap of these trains.")
    return write_responses_nwb(path, {touch: result}, **options)


@checked
def read_responses_nwb(path: Path) -> dict[str, ResponseMap]:
    """Read what `write_responses_nwb` wrote."""
    with nwb_session(path_of("path", path)) as session:
        return _responses(session)


def _responses(session: Any) -> dict[str, ResponseMap]:
    units, trials = session.units, session.trials
    columns = {
        name: np.asarray(units[name][:]) for name in (*_UNIT_COLUMNS, *MEASURED) if name in units.colnames
    }
    trains_s = [np.asarray(units["spike_times"][row]) for row in range(len(units))]
    epochs = [] if session.epochs is None else session.epochs[:].itertuples(index=False)
    phases: dict[str, list[Phase]] = {}
    onsets_s = dict(zip(trials["stimulus"][:], trials["start_time"][:], strict=True))
    for epoch in epochs:
        phase, touch = list(epoch.tags)
        window = [round(MS_PER_S * (at - onsets_s[touch]), 6) for at in (epoch.start_time, epoch.stop_time)]
        phases.setdefault(touch, []).append(Phase(phase, *window))
    found = {}
    for number, (name, start) in enumerate(onsets_s.items()):
        stop = trials["stop_time"][number]
        found[str(name)] = response_of(
            columns | {key: columns[key][:, number] for key in MEASURED},
            [MS_PER_S * (train[(train >= start) & (train <= stop)] - start) for train in trains_s],
            duration_ms=MS_PER_S * (stop - start),
            phases=tuple(phases.get(name, ())),
        )
    return found


def _same_receptors(responses: Mapping[str, ResponseMap]) -> None:
    """Raise `InputError` unless all touches have the same receptors."""
    if not responses:
        raise InputError("responses", "must hold at least one touch", remedy="it is empty")
    first = next(iter(responses.values()))
    for name, response in responses.items():
        if not np.array_equal(response.positions_mm, first.positions_mm) or response.types != first.types:
            raise InputError(
                "responses", "must come from the same receptors", remedy=f"those of {name!r} lie elsewhere"
            )


def _durations(responses: Mapping[str, ResponseMap], duration_ms: float | None) -> np.ndarray:
    """Duration of each touch, after a check that its spikes lie within. [ms]"""
    durations_ms = []
    for name, response in responses.items():
        lasts_ms = response.duration_ms if duration_ms is None else duration_ms
        if lasts_ms is None:
            remedy = f"the response to {name!r} does not know its own"
            raise InputError("duration_ms", "must be given", remedy=remedy)
        positive("duration_ms", lasts_ms, "ms")
        latest_ms = max(
            [response.spikes.times_ms.max(initial=0.0), *(each.end_ms for each in response.phases)]
        )
        if latest_ms > lasts_ms:
            must = f"must reach to the last spike and phase, at {latest_ms:g} ms under {name!r}"
            raise InputError("duration_ms", must, f"{lasts_ms:g} ms")
        durations_ms.append(lasts_ms)
    return np.array(durations_ms)
