"""The loop of a device: samples of a motion come in line by line, and spikes of all types go out."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator

import numpy as np

from fingerpad.core.checked import checked_class
from fingerpad.core.errors import InputError
from fingerpad.core.signals import SpikeTrains
from fingerpad.core.values import Finite, FloatArray, number_in, one_of
from fingerpad.neuron.afferent import type_of
from fingerpad.neuron.afferent_stream import AfferentStream
from fingerpad.neuron.population import Population
from fingerpad.reduction.model import ReducedModel
from fingerpad.reduction.streaming import ReducedTouch

SAMPLE = ("time_ms", "depth_mm", "force_mn", "x_mm", "z_mm", "tilt_deg")
"""Columns of samples: the time, a depth or a force, and the pose, which is 0 by default."""
SPIKE = ("type", "afferent", "time_ms")  # Columns of spikes.


@checked_class
class SpikeStream:
    """Afferents of one or several types that respond to a reduced touch as the samples come.

    Parameters
    ----------
    model : ReducedModel
        From `fingerpad.read_reduced` or `fingerpad.reduce`.
    population : Population
        On the same finger; the model keeps what its types follow.

    Examples
    --------
    >>> import fingerpad as fp
    >>> model = fp.reduce(object=fp.Sphere(radius_mm=4), range={"depth_mm": 0.4}, calibration=0)
    >>> stream = fp.SpikeStream(model, fp.Population.grid(afferent=fp.RA()))
    >>> fired = [stream.step(float(time), 0.01 * time)["RA"] for time in range(1, 31)]
    >>> sum(trains.times_ms.size for trains in fired) > 1
    True
    """

    def __init__(self, model: ReducedModel, population: Population):
        if population.depth_mm is not None:
            raise InputError("depth_mm", "must be left out: a reduced touch keeps one depth", "a depth")
        self.parts = dict(population.parts) or {type_of(population.afferent): population}
        for name, part in self.parts.items():
            for quantity in part.quantities:
                if quantity not in model.quantities:
                    kept = ", ".join(model.quantities)
                    words = f"must be kept by the reduced touch, because {name} afferents follow it"
                    raise InputError(quantity, words, f"a touch that keeps {kept}", "reduce it for them")
        sites = np.concatenate([part.sites_mm[:, [0, -1]] for part in self.parts.values()])
        self._touch = ReducedTouch(model, sites)
        self._streams = {name: AfferentStream(part.afferent, len(part)) for name, part in self.parts.items()}

    def step(
        self,
        time_ms: Finite,
        depth_mm: Finite | None = None,
        force_mn: Finite | None = None,
        x_mm: Finite = 0.0,
        z_mm: Finite = 0.0,
        tilt_deg: Finite = 0.0,
    ) -> dict[str, SpikeTrains]:
        """Go to a later time and pose, as `ReducedTouch.step`, and return the spikes since then by type."""
        fields = self._touch.step(time_ms, depth_mm, force_mn, x_mm, z_mm, tilt_deg).fields
        fired, start = {}, 0
        for name, part in self.parts.items():
            here = slice(start, start + len(part.sites_mm))
            dynamic, static = (_of_afferents(part, fields[quantity][here]) for quantity in part.quantities)
            same = len(set(part.quantities)) == 1
            fired[name] = self._streams[name].step(time_ms, static, None if same else dynamic)
            start = here.stop
        return fired

    def warmed(self) -> SpikeStream:
        """Return this stream after a copy of it has taken a step, so that all its code is compiled."""
        copy.deepcopy(self).step(1.0, depth_mm=0.0)
        return self


def _of_afferents(part: Population, values: FloatArray) -> FloatArray:
    """Return what each afferent follows, from the values at its end organs."""
    if part.branches is not None:
        values = part.branches.of_afferents(values[None])[0]
    return values if part.sensitivity is None else values * part.sensitivity


def answered(stream: SpikeStream, lines: Iterable[str]) -> Iterator[str]:
    """Yield the header of spikes, then after each line of samples the lines of the spikes it brings.

    The first line names the columns, of `SAMPLE`; empty lines are passed over. The touch begins at the time
    of the first sample, with nothing pressed; spikes have the clock of the samples.
    """
    columns: list[str] | None = None
    start_ms: float | None = None
    yield ",".join(SPIKE) + "\n"
    for number, line in enumerate(lines, 1):
        entries = [entry.strip() for entry in line.split(",")]
        if entries == [""]:
            continue
        try:
            if columns is None:
                columns = [one_of("column", entry, SAMPLE) for entry in entries]
                if "time_ms" not in columns:
                    raise InputError("columns", "must have time_ms", ", ".join(columns))
                continue
            if len(entries) != len(columns):
                raise InputError("entries", f"must be {len(columns)}, one per column", str(len(entries)))
            given = {name: number_in(name, entry) for name, entry in zip(columns, entries, strict=True)}
            if start_ms is None:
                start_ms = given["time_ms"]
                continue
            fired = stream.step(**given | {"time_ms": given["time_ms"] - start_ms})
        except InputError as error:
            raise InputError(f"line {number}: {error}") from error
        yield "".join(
            f"{name},{afferent},{start_ms + time_ms:.4f}\n"
            for name, trains in fired.items()
            for afferent, train in enumerate(trains)
            for time_ms in train
        )
