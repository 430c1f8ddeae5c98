"""Time, memory and disk of a press and of a sweep, before they start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.experiments.requests.touch import TouchRequest
from fingerpad.experiments.sweep.request import SweepRequest
from fingerpad.mechanics.press_settings import MOST_SOLVED
from fingerpad.skin.fields import Place, stored_fields, watched_elements
from fingerpad.skin.indentation import Touch

STEP_S = 1.8e-5
"""Time of a step per node, by depth, straight and without friction, on two cores with compiled kernels: mean
of benchmarks/results/growth.json. [s]"""

BY_FORCE, WITH_FRICTION, ASIDE, ASIDE_WITH_FRICTION = 3.0, 3.1, 3.2, 5.1
"""Factors of that time for a press by force, with friction, and aside; measured on ten presses."""

BASE_MB, NODE_MB, NODE_EXPONENT = 200.0, 0.043, 0.865
"""Memory of a process: with its libraries, and of n nodes, `NODE_MB` n^`NODE_EXPONENT`. [MB]"""

OWN_NODES, OWN_NODE_MB, OWN_EXPONENT = 1200.0, 2.8e-3, 4 / 3
"""A mesh of one's own is solved by elimination: its time grows by the number of nodes over `OWN_NODES`, and
its memory by `OWN_NODE_MB` n^`OWN_EXPONENT`; measured at 3,249, 4,797 and 6,813 nodes. [MB]"""


@dataclass(frozen=True)
class PressEstimate:
    """What a press will take."""

    nodes: int
    elements: int
    steps: int  # Size of the mesh, and number of steps that are solved at least.
    time_s: float
    memory_mb: float  # Time on two cores with compiled kernels, and memory of the process. [s], [MB]
    by_force: bool = False  # Whether the force is given, so that the depth is not known before the press.

    @property
    def lines(self) -> tuple[str, ...]:
        """The estimate in words."""
        depth = " How deep this force presses, and whether into the bone, only the press shows."
        return (
            f"The touch is possible: {self.nodes} nodes, {self.elements} elements, {self.steps} steps.",
            f"A press will take about {self.time_s:.0f} s on two idle cores and {self.memory_mb:.0f} MB."
            f"{depth if self.by_force else ''}",
        )


def _interpolated_steps(touch: Touch) -> int:
    """Count the steps of equal cycles that are interpolated, at most."""
    cycles = touch.stimulus.cycles
    if cycles is None or cycles.count <= MOST_SOLVED:
        return 0
    if touch.friction or touch.settings.cycle_tolerance is None:
        return 0
    times_ms = touch.settings.steps_ms(touch.stimulus)
    inside = np.count_nonzero((times_ms > cycles.start_ms) & (times_ms <= cycles.end_ms))
    return int(inside * (cycles.count - MOST_SOLVED) / cycles.count)


def estimate_press(request: TouchRequest) -> PressEstimate:
    """Estimate a press from the sizes of its mesh and its steps; the mesh is built for it."""
    touch = request.touch
    nodes = len(touch.mesh.nodes_mm)
    steps = touch.settings.steps_ms(touch.stimulus).size - 1 - _interpolated_steps(touch)
    factor = BY_FORCE if touch.stimulus.by_force else 1.0
    if touch.friction:
        factor *= WITH_FRICTION if touch.stimulus.stays else ASIDE_WITH_FRICTION
    elif not touch.stimulus.stays:
        factor *= ASIDE
    own = touch.finger.own_mesh is not None
    if own:
        factor *= max(1.0, nodes / OWN_NODES)
    return PressEstimate(
        nodes=nodes,
        elements=len(touch.mesh.elements),
        steps=steps,
        time_s=STEP_S * nodes * steps * factor,
        memory_mb=(
            BASE_MB + NODE_MB * nodes**NODE_EXPONENT + (OWN_NODE_MB * nodes**OWN_EXPONENT if own else 0.0)
        ),
        by_force=touch.stimulus.by_force,
    )


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
