"""Responses of a population as a CSV table."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, read_text, write_atomically
from fingerpad.core.keywords import known_keywords
from fingerpad.core.signals import ResponseMap, SpikeTrains
from fingerpad.neuron.mixed_population import MixedResponse, one_map
from fingerpad.neuron.response_maps import recruitment_rank

PLACES = {2: ("x_mm", "z_mm"), 3: ("x_mm", "y_mm", "z_mm")}
"""Columns of a position by the number of its coordinates."""

ANSWERS = (
    "dynamic_rate_hz",
    "static_rate_hz",
    "dynamic_count_hz",
    "static_count_hz",
    "spike_count",
    "first_spike_latency_ms",
    "recruitment_rank",
    "spike_times_ms",
)
"""Columns of the response of a receptor."""

TYPE, PITCH, SPIKES = "type", "pitch_mm", "spike_times_ms"
"""Columns of the type of an afferent, of the distance between neighbours of this type, and of spikes."""

MEASURED = ("dynamic_rate_hz", "static_rate_hz", "first_spike_latency_ms")
"""Columns from which a response is read back, beside its places and spikes."""


@known_keywords
def write_response_csv(path: Path, response: ResponseMap | MixedResponse) -> Path:
    """Write one row per receptor: position, rates, latency of the first spike, and all spike times.

    Spike times are one entry, separated by spaces, as `fingerpad fit` reads them. A value that does not
    exist, such as the latency of a silent receptor, is an empty entry. Numbers have all their digits
    and are read back without rounding. Receptors of a mixed population have a column with their type.

    Parameters
    ----------
    path : Path
        The file, in UTF-8, written as a whole; folders are created if needed.
    response : ResponseMap or MixedResponse
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
    joined = one_map(response)
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    kind = (TYPE,) if joined.types else ()
    places = PLACES[joined.positions_mm.shape[1]]
    table.writerow(("receptor", *kind, *places, PITCH, *ANSWERS))
    table.writerows(_rows(joined, pitches_mm(response)))
    write_atomically(path_of("path", path), text.getvalue().encode())
    return path_of("path", path)


def pitches_mm(response: ResponseMap | MixedResponse) -> FloatArray:
    """Distance between neighbours of the same type, of every receptor, (n_receptors,). [mm]"""
    maps = list(response.maps.values()) if isinstance(response, MixedResponse) else [response]
    return np.repeat([each.pitch_mm for each in maps], [len(each.spikes) for each in maps])


def by_type(response: ResponseMap, pitches: FloatArray) -> ResponseMap | MixedResponse:
    """Return what was written: the map, or parts of it with their pitches where it has types."""
    if not response.types:
        return response
    of_type = dict(zip(response.types, pitches.tolist(), strict=True))
    return MixedResponse(
        {
            name: replace(part, pitch_mm=of_type[name])
            for name, part in MixedResponse.of(response).maps.items()
        }
    )


def _rows(response: ResponseMap, pitches: FloatArray) -> Iterator[list[object]]:
    ranked = {"recruitment_rank": recruitment_rank(response.first_spike_latency_ms)}
    columns = [pitches]
    columns += [ranked[name] if name in ranked else getattr(response, name) for name in ANSWERS[:-1]]
    places = zip(response.positions_mm.tolist(), *(column.tolist() for column in columns), strict=True)
    for receptor, (place, *row) in enumerate(places):
        times = " ".join(map(repr, response.spikes[receptor].tolist()))
        kind = response.types[receptor : receptor + 1]
        yield [receptor, *kind, *("" if np.isnan(number) else number for number in (*place, *row)), times]


@known_keywords
def read_response_csv(path: Path) -> ResponseMap | MixedResponse:
    """Read what `write_response_csv` wrote."""
    rows = list(csv.DictReader(io.StringIO(read_text(path_of("path", path)))))
    have = list(rows[0]) if rows else []
    for column in ("x_mm", "z_mm", PITCH, *MEASURED, SPIKES):
        if column not in have:
            raise InputError(
                f"{path} must have the column {column}, as write_response_csv writes it: got "
                f"{', '.join(have) or 'no row'}."
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
        types=tuple(row[TYPE] for row in rows) if TYPE in have else (),
        **measured,
    )
    return by_type(response, pitches)
