"""Responses of a population as a CSV table."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fingerpad.core.checks import instance
from fingerpad.core.files import path_of, write_atomically
from fingerpad.core.keywords import known_keywords
from fingerpad.core.signals import ResponseMap
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


@known_keywords
def write_response_csv(path: Path, response: ResponseMap) -> Path:
    """Write one row per receptor: position, rates, latency of the first spike, and all spike times.

    Spike times are one entry, separated by spaces, as `fingerpad fit` reads them. A value that does not
    exist, such as the latency of a silent receptor, is an empty entry. Numbers have all their digits
    and are read back without rounding.

    Parameters
    ----------
    path : Path
        The file, in UTF-8, written as a whole; folders are created if needed.
    response : ResponseMap
        Responses of a population to one indentation.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If `response` is not a `ResponseMap`.
    StoreError
        If the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from fingerpad.core.signals import SpikeTrains
    >>> trains = SpikeTrains.from_lists([[12.5, 40.0], []])
    >>> response = ResponseMap([[17.0, 0.5], [17.0, 1.5]], 1.0, trains, [36.4, 0], [0, 0], [12.5, np.nan])
    >>> with TemporaryDirectory() as folder:
    ...     print(write_response_csv(Path(folder) / "response.csv", response).read_text(encoding="utf-8"))
    receptor,x_mm,z_mm,dynamic_rate_hz,static_rate_hz,dynamic_count_hz,static_count_hz,spike_count,...
    0,17.0,0.5,36.4,0.0,,,2,12.5,1.0,12.5 40.0
    1,17.0,1.5,0.0,0.0,,,0,,,
    """
    instance("response", response, ResponseMap)
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(("receptor", *PLACES[response.positions_mm.shape[1]], *ANSWERS))
    table.writerows(_rows(response))
    write_atomically(path_of("path", path), text.getvalue().encode())
    return path_of("path", path)


def _rows(response: ResponseMap) -> Iterator[list[object]]:
    ranked = {"recruitment_rank": recruitment_rank(response.first_spike_latency_ms)}
    columns = [ranked[name] if name in ranked else getattr(response, name) for name in ANSWERS[:-1]]
    places = zip(response.positions_mm.tolist(), *(column.tolist() for column in columns), strict=True)
    for receptor, (place, *row) in enumerate(places):
        times = " ".join(map(repr, response.spikes[receptor].tolist()))
        yield [receptor, *("" if np.isnan(number) else number for number in (*place, *row)), times]
