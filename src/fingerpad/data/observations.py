"""Observations of skin, afferents and participants: one loader per experiment."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from typing import Any

from fingerpad.core.values import FloatArray, TruthVector, Vector, float_array
from fingerpad.data.published import packaged_text


def packaged_table(name: str) -> dict[str, Any]:
    """Columns of numbers of a CSV file of `tables`, whose names carry units, its source and its status."""
    text = packaged_text(f"{name}.csv")
    story = dict(line[2:].split(": ", 1) for line in text.splitlines() if line.startswith("# "))
    header, *rows = csv.reader(line for line in text.splitlines() if not line.startswith("#"))
    columns = {
        column: float_array(column, [float(value) for value in values], 1)
        for column, values in zip(header, zip(*rows, strict=True), strict=True)
    }
    return columns | {label: story[label] for label in ("source", "status")}


@dataclass(frozen=True)
class BarObservations:
    """Firing rates of one SAI afferent under a bar at several lateral positions."""

    shift_mm: FloatArray  #: Position of the bar relative to the centre of the receptive field, (n,). [mm]
    dynamic_rate_hz: FloatArray
    static_rate_hz: FloatArray  #: Observed rates during the ramp and the hold, (n,). [spikes/s]
    source: str
    status: str  #: Publication, and status of the numbers (see `STATUSES`).


@dataclass(frozen=True)
class DeflectionObservations:
    """Deflection of the skin's surface along the finger."""

    distance_mm: Vector  #: Along the finger from the axis of the indenter, (n,). [mm]
    deflection_mm: Vector  #: Towards the bone, (n,). [mm]
    is_artefact: TruthVector  #: Artefacts of the digitisation; leave them out of comparisons, (n,).
    source: str
    status: str  #: Publication, and status of the numbers (see `STATUSES`).


def bar_firing_rates() -> BarObservations:
    """Rates under a 3.0 mm bar at a depth of 1.0 mm and 36 positions (Phillips & Johnson 1981).

    Examples
    --------
    >>> observed = bar_firing_rates()
    >>> observed.shift_mm.size, observed.dynamic_rate_hz.max(), observed.static_rate_hz.max()
    (36, np.float64(210.0), np.float64(61.0))
    """
    return BarObservations(**packaged_table("bar_firing_rates"))


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
    is_artefact = table["is_artefact"] == 1.0
    is_artefact.setflags(write=False)
    return DeflectionObservations(**table | {"is_artefact": is_artefact})
