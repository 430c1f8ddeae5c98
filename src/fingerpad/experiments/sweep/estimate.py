"""Time, memory and disk of a sweep, from a few of its presses, before it starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.experiments.requests.touch import estimate_press
from fingerpad.experiments.sweep.request import SweepRequest
from fingerpad.skin.fields import Place, stored_fields, watched_elements

MOST_LOOKED_AT = 8  # Presses whose meshes are built for the estimate, spread evenly over the sweep.
CORES = 2  # Cores that the time of a single press is for. On one of them it takes twice as long at most.


@dataclass(frozen=True)
class SweepEstimate:
    """What a sweep will take if nothing of it is stored yet."""

    settings: int
    presses: int  # How many, without those that are left out.
    looked_at: int  # Presses that the estimate is from.
    time_s: float
    memory_mb: float
    disk_mb: float  # Time on the clock, memory of all processes, and stored indentations. [s], [MB], [MB]
    processes: int  # How many press at a time.

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
            found.append(estimate_press(described))
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
