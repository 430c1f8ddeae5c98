"""Motion of the indenter: ramp and hold of its depth or of its force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, positive
from fingerpad.data import protocol

MOTION_UNITS = {"depth_mm": "mm", "force_mn": "mN", "ramp_ms": "ms", "hold_ms": "ms"}
"""Units of the parameters of motions."""


class Motion:
    """A ramp at a constant rate from 0, then a hold: common part of all motions of the indenter."""

    ramp_ms: float
    hold_ms: float

    def __post_init__(self) -> None:
        for name, unit in MOTION_UNITS.items():
            if hasattr(self, name):
                positive(name, getattr(self, name), unit)

    @property
    def end_ms(self) -> float:
        """End of the hold. [ms]"""
        return self.ramp_ms + self.hold_ms

    def share_at(self, times_ms: ArrayLike) -> FloatArray:
        """Completed share of the ramp at `times_ms`, any shape: 0 at the start, 1 in the hold."""
        return np.clip(np.asarray(times_ms, dtype=float) / self.ramp_ms, 0.0, 1.0)

    def times_ms(self, ramp_steps: int, hold_steps: int) -> FloatArray:
        """List the times to solve at: 0, equal ramp steps, hold steps that grow geometrically. [ms]

        The first hold step is as long as a ramp step, or shorter for a short hold, because relaxation is
        fastest right after the ramp.

        Examples
        --------
        >>> RampAndHold().times_ms(2, 3).round(1).tolist()
        [0.0, 25.0, 50.0, 75.0, 204.1, 1000.0]
        """
        ramp = np.linspace(0.0, self.ramp_ms, ramp_steps + 1)
        first = min(self.ramp_ms / ramp_steps, self.hold_ms / hold_steps)
        since_ramp = np.geomspace(first, self.hold_ms, hold_steps)
        since_ramp[-1] = self.hold_ms
        return np.concatenate([ramp, self.ramp_ms + since_ramp])


@dataclass(frozen=True)
class RampAndHold(Motion):
    """Indent at constant speed to a depth, then hold it.

    Parameters
    ----------
    depth_mm : float
        Depth of the hold, from first touch of the undeformed skin along the direction of pressing. [mm]
    ramp_ms : float
        Duration of the ramp. [ms]
    hold_ms : float
        Duration of the hold. [ms]

    Raises
    ------
    InputError
        If a value is not a finite number above zero.

    Examples
    --------
    >>> RampAndHold(depth_mm=1.0, ramp_ms=50.0, hold_ms=950.0).depth_at([0.0, 25.0, 50.0, 400.0]).tolist()
    [0.0, 0.5, 1.0, 1.0]
    """

    depth_mm: float = protocol.DEPTH.value
    ramp_ms: float = protocol.RAMP.value
    hold_ms: float = protocol.HOLD.value

    def depth_at(self, times_ms: ArrayLike) -> FloatArray:
        """Depth at `times_ms`, any shape. [mm]"""
        return self.depth_mm * self.share_at(times_ms)


@dataclass(frozen=True)
class ForceRampAndHold(Motion):
    """Press with a force that grows at a constant rate, then hold it: the skin creeps.

    Parameters
    ----------
    force_mn : float
        Force of the hold along the direction of pressing, on the whole finger. [mN]
    ramp_ms : float
        Duration of the ramp. [ms]
    hold_ms : float
        Duration of the hold. [ms]

    Raises
    ------
    InputError
        If a value is not a finite number above zero.

    Examples
    --------
    >>> ForceRampAndHold(force_mn=100.0, ramp_ms=50.0, hold_ms=950.0).force_at([0.0, 25.0, 400.0]).tolist()
    [0.0, 50.0, 100.0]
    """

    force_mn: float
    ramp_ms: float = protocol.RAMP.value
    hold_ms: float = protocol.HOLD.value

    def force_at(self, times_ms: ArrayLike) -> FloatArray:
        """Force at `times_ms`, any shape. [mN]"""
        return self.force_mn * self.share_at(times_ms)


Stimulus = RampAndHold | ForceRampAndHold
"""A motion by depth or by force."""
