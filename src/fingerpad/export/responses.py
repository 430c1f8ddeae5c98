"""Responses of a population as a CSV table, or of several touches as a session of NWB."""

from __future__ import annotations

import csv
import io
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, read_text, write_atomically
from fingerpad.core.phases import Phase
from fingerpad.core.signals import ResponseMap, SpikeTrains
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import Finite, FloatArray, NotNegative, instance, positive
from fingerpad.experiments.recording_files import SUFFIXES_OF_NWB
from fingerpad.export.dataset import library
from fingerpad.neuron.afferent_types import afferent_types
from fingerpad.neuron.response_maps import recruitment_rank

PLACES = {2: ("x_mm", "z_mm"), 3: ("x_mm", "y_mm", "z_mm")}
"""Columns of a position by the number of its coordinates."""

ANSWERS = (
    "dynamic_rate_hz", "static_rate_hz", "dynamic_count_hz", "static_count_hz", "spike_count",
    "first_spike_latency_ms", "recruitment_rank", "spike_times_ms",
)  # fmt: skip
"""Columns of the response of a receptor."""

TYPE, PITCH, SPIKES = "type", "pitch_mm", "spike_times_ms"
"""Columns of the type of an afferent, of the distance between neighbours of this type, and of spikes."""

MEASURED = ("dynamic_rate_hz", "static_rate_hz", "first_spike_latency_ms")
"""Columns from which a response is read back, beside its places and spikes."""


@checked
def write_response_csv(path: Path, response: ResponseMap) -> Path:
    """Write one row per receptor: position, rates, latency of the first spike, and all spike times.

    Spike times are one entry, separated by spaces, as `fingerpad fit` reads them. A value that does not
    exist, such as the latency of a silent receptor, is an empty entry. Numbers have all their digits
    and are read back without rounding. Receptors of a mixed population have a column with their type.

    Parameters
    ----------
    path : Path
        The file, in UTF-8, written as a whole; folders are created if needed.
    response : ResponseMap
        Responses of a population to one indentation.

    Raises
    ------
    StoreError
        If the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> trains = SpikeTrains.from_lists([[12.5, 40.0], []])
    >>> response = ResponseMap([[17.0, 0.5], [17.0, 1.5]], 1.0, trains, [36.4, 0], [0, 0], [12.5, np.nan])
    >>> with TemporaryDirectory() as folder:
    ...     print(write_response_csv(Path(folder) / "response.csv", response).read_text(encoding="utf-8"))
    receptor,x_mm,z_mm,pitch_mm,dynamic_rate_hz,static_rate_hz,dynamic_count_hz,static_count_hz,spike_count,...
    0,17.0,0.5,1.0,36.4,0.0,,,2,12.5,1.0,12.5 40.0
    1,17.0,1.5,1.0,0.0,0.0,,,0,,,
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    kind = (TYPE,) if response.types else ()
    places = PLACES[response.positions_mm.shape[1]]
    table.writerow(("receptor", *kind, *places, PITCH, *ANSWERS))
    table.writerows(_rows(response))
    write_atomically(path_of("path", path), text.getvalue().encode())
    return path_of("path", path)


def by_type(response: ResponseMap, types: Sequence[str], pitches_mm: FloatArray) -> ResponseMap:
    """Part what was read by the types of the afferents, whose rates are measured as those of each type."""
    parted = response.of_types(types, pitches_mm)
    if not parted.parts:
        return parted
    known = afferent_types()
    return ResponseMap.joined(
        {
            name: replace(
                part,
                rate_measure=getattr(known.get(name), "rate_measure", part.rate_measure),
                quantity=getattr(known.get(name), "static_quantity", part.quantity),
            )
            for name, part in parted.parts.items()
        }
    )


def _rows(response: ResponseMap) -> Iterator[list[object]]:
    ranked = {"recruitment_rank": recruitment_rank(response.first_spike_latency_ms)}
    columns = [response.pitches_mm]
    columns += [ranked[name] if name in ranked else getattr(response, name) for name in ANSWERS[:-1]]
    places = zip(response.positions_mm.tolist(), *(column.tolist() for column in columns), strict=True)
    for receptor, (place, *row) in enumerate(places):
        times = " ".join(map(repr, response.spikes[receptor].tolist()))
        kind = response.types[receptor : receptor + 1]
        yield [receptor, *kind, *("" if np.isnan(number) else number for number in (*place, *row)), times]


@checked
def read_response_csv(path: Path) -> ResponseMap:
    """Read what `write_response_csv` wrote."""
    rows = list(csv.DictReader(io.StringIO(read_text(path_of("path", path)))))
    have = list(rows[0]) if rows else []
    for column in ("x_mm", "z_mm", PITCH, *MEASURED, SPIKES):
        if column not in have:
            raise InputError(
                path,
                f"must have the column {column}, as write_response_csv writes it",
                str(", ".join(have) or "no row"),
            )

    def numbers(column: str) -> FloatArray:
        try:
            return np.array([float(row[column] or "nan") for row in rows])
        except (TypeError, ValueError) as error:
            raise InputError(f"{path}: {column} must hold numbers: {error}.") from error

    places, pitches = PLACES[3 if "y_mm" in have else 2], numbers(PITCH)
    try:
        spikes = SpikeTrains.from_lists([[float(time) for time in row[SPIKES].split()] for row in rows])
    except (AttributeError, ValueError) as error:
        raise InputError(f"{path}: {SPIKES} must hold times that spaces separate: {error}.") from error
    measured: dict[str, Any] = {column: numbers(column) for column in MEASURED}
    response = ResponseMap(
        positions_mm=np.column_stack([numbers(column) for column in places]),
        pitch_mm=float(pitches.min()),
        spikes=spikes,
        **measured,
    )
    return by_type(response, [row[TYPE] for row in rows] if TYPE in have else (), pitches)


_RESOLUTION_S = 1e-9  # Spike times are roots of a closed form; those of two processors differ by less. [s]


@checked
def write_responses_nwb(
    path: Path,
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
    instance("responses", responses, Mapping)
    began = started or datetime.now(UTC)
    if began.tzinfo is None:
        raise InputError("started", "must have a time zone, such as datetime.UTC", str(began.isoformat()))
    touches = dict(responses)
    positions_mm, durations_ms = _places(touches), _durations(touches, duration_ms)
    first = next(iter(touches.values()))
    onsets_ms = np.cumsum(durations_ms + pause_ms) - durations_ms - pause_ms
    # Warnings of the library do not concern the content of the file.
    with warnings.catch_warnings(), TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")
        pynwb = require_pynwb()
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
        for (name, answer), onset_ms, lasts_ms in zip(touches.items(), onsets_ms, durations_ms, strict=True):
            session.add_trial(onset_ms / MS_PER_S, (onset_ms + lasts_ms) / MS_PER_S, stimulus=name)
            for phase in answer.phases:
                start, end = ((onset_ms + time_ms) / MS_PER_S for time_ms in phase.window_ms)
                session.add_epoch(start, end, tags=[phase.name, name])
        session.units = pynwb.misc.Units(
            name="units", description="One unit per receptor.", resolution=_RESOLUTION_S
        )
        columns = PLACES[positions_mm.shape[1]]
        for column in columns:
            session.add_unit_column(column, f"{column[0]} of the receptor on the undeformed skin, in mm")
        session.add_unit_column(PITCH, "distance between neighbours of the same type, in mm")
        if first.types:
            session.add_unit_column(TYPE, "type of the afferent")
        for name in first.measures:
            session.add_unit_column(
                name, "in each trial, in the unit at the end of the name; NaN if there is none"
            )
        pitches = next(iter(responses.values())).pitches_mm
        for receptor, place in enumerate(positions_mm.tolist()):
            trains = [answer.spikes[receptor] for answer in touches.values()]
            times_ms = [onset + train for onset, train in zip(onsets_ms, trains, strict=True)]
            session.add_unit(
                id=receptor,
                spike_times=np.concatenate(times_ms) / MS_PER_S,
                obs_intervals=[[0.0, (onsets_ms[-1] + durations_ms[-1]) / MS_PER_S]],
                pitch_mm=float(pitches[receptor]),
                **dict(zip(columns, place, strict=True)),
                **({TYPE: first.types[receptor]} if first.types else {}),
                **{
                    name: [answer.measures[name][receptor] for answer in touches.values()]
                    for name in first.measures
                },
            )
        unfinished = Path(folder) / "session.nwb"
        with pynwb.NWBHDF5IO(str(unfinished), mode="w") as opened:
            opened.write(session)
        write_atomically(file, unfinished.read_bytes())
    return file


@checked
def read_responses_nwb(path: Path) -> dict[str, ResponseMap]:
    """Read what `write_responses_nwb` wrote."""
    pynwb = require_pynwb()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with pynwb.NWBHDF5IO(str(path_of("path", path)), mode="r") as opened:
                return _responses(opened.read())
    except InputError:
        raise
    except Exception as error:  # a file of any other kind may fail in any way
        said = " ".join(str(error).split()).rstrip(".")
        raise InputError(
            path, "must be a session of write_responses_nwb", remedy=f"it cannot be read as one ({said})"
        ) from error


def _responses(session: Any) -> dict[str, ResponseMap]:
    units, trials = session.units, session.trials
    places = PLACES[3 if "y_mm" in units.colnames else 2]
    known = {"spike_times", "obs_intervals", TYPE, PITCH, *places}
    measured = {name: np.asarray(units[name][:]) for name in units.colnames if name not in known}
    trains_s = [np.asarray(units["spike_times"][row]) for row in range(len(units))]
    epochs = [] if session.epochs is None else session.epochs[:].itertuples(index=False)
    phases: dict[str, list[Phase]] = {}
    onsets_s = dict(zip(trials["stimulus"][:], trials["start_time"][:], strict=True))
    for epoch in epochs:
        phase, touch = list(epoch.tags)
        window = [round(MS_PER_S * (at - onsets_s[touch]), 6) for at in (epoch.start_time, epoch.stop_time)]
        phases.setdefault(touch, []).append(Phase(phase, *window))
    found = {}
    for number, (name, start, stop) in enumerate(
        zip(*(trials[key][:] for key in ("stimulus", "start_time", "stop_time")), strict=True)
    ):
        measures: dict[str, Any] = {key: values[:, number] for key, values in measured.items()}
        response = ResponseMap(
            positions_mm=np.column_stack([units[place][:] for place in places]),
            pitch_mm=float(units[PITCH][:].min()),
            spikes=SpikeTrains.from_lists(
                [MS_PER_S * (train[(train >= start) & (train <= stop)] - start) for train in trains_s]
            ),
            duration_ms=MS_PER_S * (stop - start),
            phases=tuple(phases.get(name, ())),
            **measures,
        )
        types = list(units[TYPE][:]) if TYPE in units.colnames else ()
        found[str(name)] = by_type(response, types, np.asarray(units[PITCH][:]))
    return found


def _places(responses: Mapping[str, ResponseMap]) -> np.ndarray:
    """Places of the receptors, after a check that all touches have the same ones. [mm]"""
    if not responses:
        raise InputError("responses", "must hold at least one touch", remedy="it is empty")
    first = next(iter(responses.values()))
    for name, response in responses.items():
        instance(f"responses[{name!r}]", response, ResponseMap)
        if not np.array_equal(response.positions_mm, first.positions_mm) or response.types != first.types:
            raise InputError(
                "responses", "must come from the same receptors", remedy=f"those of {name!r} lie elsewhere"
            )
    return first.positions_mm


def _durations(responses: Mapping[str, ResponseMap], duration_ms: float | None) -> np.ndarray:
    """Duration of each touch, after a check that its spikes lie within. [ms]"""
    durations_ms = []
    for name, response in responses.items():
        lasts_ms = response.duration_ms if duration_ms is None else duration_ms
        if lasts_ms is None:
            raise InputError(
                "duration_ms", "must be given", remedy=f"the response to {name!r} does not know its own"
            )
        positive("duration_ms", lasts_ms, "ms")
        latest_ms = max(
            response.spikes.times_ms.max(initial=0.0), *(phase.end_ms for phase in response.phases), 0.0
        )
        if latest_ms > lasts_ms:
            raise InputError(
                "duration_ms",
                f"must reach to the last spike and phase, at {latest_ms:g} ms under {name!r}",
                f"{lasts_ms:g} ms",
            )
        durations_ms.append(lasts_ms)
    return np.array(durations_ms)


def require_pynwb() -> Any:
    """Return the package pynwb, or raise `InputError` if it is not installed."""
    return library("pynwb", "NWB files need pynwb", "nwb")
