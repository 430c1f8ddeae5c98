"""Observations of skin, afferents and participants: one loader per experiment."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, float_array, number_in, one_of
from fingerpad.data.published import STATUSES


@dataclass(frozen=True)
class Table:
    """Columns of numbers with content, source and status."""

    columns: dict[str, FloatArray]  # Values by column name; the name carries the unit, (n_rows,).
    content: str
    source: str
    status: str  # Observed quantity, publication, and status of the numbers.


def packaged_table(name: str) -> Table:
    """Table `name` of the data that come with the package."""
    return parsed_table(
        name, (files("fingerpad.data") / "tables" / f"{name}.csv").read_text(encoding="utf-8")
    )


def parsed_table(name: str, text: str) -> Table:
    r"""Table from the text of a file with lines `# source: ...`, `# status: ...`, a header and numbers."""
    lines = [line for line in text.splitlines() if line.strip()]
    story = dict(_labelled(line) for line in lines if line.startswith("#"))
    for label in ("content", "source", "status"):
        if not story.get(label):
            raise InputError(name, f"needs a line '# {label}", remedy=f"...': it has {sorted(story)}")
    one_of(f"status of {name}", story["status"], tuple(STATUSES))
    records = list(csv.reader(line for line in lines if not line.startswith("#")))
    if len(records) < 2:
        raise InputError(name, "needs a header and at least one row of numbers", f"{len(records)} line(s)")
    header, *rows = records
    for row in rows:
        if len(row) != len(header):
            raise InputError(name, f"needs {len(header)} entries per row", str(row))
    columns = {
        column: float_array(column, [number_in(f"{column} of {name}", value) for value in values], 1)
        for column, values in zip(header, zip(*rows, strict=True), strict=True)
    }
    return Table(columns, story["content"], story["source"], story["status"])


def _labelled(line: str) -> tuple[str, str]:
    label, _, said = line.removeprefix("#").partition(":")
    return label.strip(), said.strip()


@dataclass(frozen=True)
class BarObservations:
    """Firing rates of one SAI afferent under a bar at several lateral positions."""

    shift_mm: FloatArray  # Position of the bar relative to the centre of the receptive field, (n,). [mm]
    dynamic_rate_hz: FloatArray
    static_rate_hz: FloatArray  # Observed rates during the ramp and the hold, (n,). [spikes/s]
    source: str
    status: str  # Publication, and status of the numbers (see `STATUSES`).


@dataclass(frozen=True)
class DeflectionObservations:
    """Deflection of the skin's surface along the finger."""

    distance_mm: FloatArray  # Along the finger from the axis of the indenter, (n,). [mm]
    deflection_mm: FloatArray  # Towards the bone, (n,). [mm]
    is_artefact: NDArray[np.bool_]  # Artefacts of the digitisation; leave them out of comparisons, (n,).
    source: str
    status: str  # Publication, and status of the numbers (see `STATUSES`).


@dataclass(frozen=True)
class HitRateObservations:
    """Hit rates of participants who discriminate spheres from a standard."""

    standard_per_m: float  # Curvature of the standard sphere. [1/m]
    curvature_per_m: FloatArray  # Curvatures of the comparison spheres, (n,). [1/m]
    hit_rate: FloatArray  # Fraction of correct trials, (n,). [0-1]
    source: str
    status: str  # Publication, and status of the numbers (see `STATUSES`).


def bar_firing_rates() -> BarObservations:
    """Rates under a 3.0 mm bar at a depth of 1.0 mm and 36 positions (Phillips & Johnson 1981).

    Examples
    --------
    >>> observed = bar_firing_rates()
    >>> observed.shift_mm.size, observed.dynamic_rate_hz.max(), observed.static_rate_hz.max()
    (36, np.float64(210.0), np.float64(61.0))
    """
    table = packaged_table("bar_firing_rates")
    return BarObservations(**table.columns, source=table.source, status=table.status)


def cylinder_deflection() -> DeflectionObservations:
    """Deflection under a 3.17 mm cylinder at a depth of 1.0 mm (Dandekar 1995, Srinivasan's laboratory).

    The observations under the 50 µm line, which the paper also uses, are not available to us.

    Examples
    --------
    >>> observed = cylinder_deflection()
    >>> observed.distance_mm[observed.is_artefact].tolist()
    [-9.25]
    """
    table = packaged_table("cylinder_deflection")
    is_artefact = table.columns["is_artefact"] == 1.0
    is_artefact.setflags(write=False)
    columns = table.columns | {"is_artefact": is_artefact}
    return DeflectionObservations(**columns, source=table.source, status=table.status)


def goodwin_hit_rates() -> HitRateObservations:
    """Hit rates of participants who compare spheres with a standard of 287 /m (Goodwin et al. 1991).

    Examples
    --------
    >>> goodwin_hit_rates().hit_rate.tolist()
    [0.58, 0.95]
    """
    table = packaged_table("goodwin_hit_rates")
    standard, curvature, hit_rate = (
        table.columns[name] for name in ("standard_per_m", "curvature_per_m", "hit_rate")
    )
    return HitRateObservations(float(standard[0]), curvature, hit_rate, table.source, table.status)
