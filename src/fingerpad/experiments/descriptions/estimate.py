"""Time and memory of a described touch, from its mesh and its steps, without pressing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.experiments.descriptions.touch import DescribedTouch
from fingerpad.mechanics.press_settings import MOST_SOLVED
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
    """Size of the mesh, and number of steps that are solved at least."""
    elements: int
    """Size of the mesh, and number of steps that are solved at least."""
    steps: int
    """Size of the mesh, and number of steps that are solved at least."""
    time_s: float
    """Time on two cores with compiled kernels, and memory of the process. [s], [MB]"""
    memory_mb: float
    """Time on two cores with compiled kernels, and memory of the process. [s], [MB]"""
    by_force: bool = False
    """Whether the force is given, so that the depth is not known before the press."""

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


def estimate_press(described: DescribedTouch) -> PressEstimate:
    """Estimate a press from the sizes of its mesh and its steps; the mesh is built for it."""
    touch, _ = described.touch, described.population
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
