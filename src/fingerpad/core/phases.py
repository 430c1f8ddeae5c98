"""Named phases of a touch, such as ramp and hold, in which responses are read."""

from __future__ import annotations

from collections.abc import Sequence

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Finite

RAMP, HOLD = "ramp", "hold"  # Names of the phases in which the two rates of the paper are counted.
RELEASE, VIBRATION = "release", "vibration"  # The indenter goes back; it goes to and fro while it touches.


@value_class
class Phase:
    """A named part of a touch."""

    name: str
    start_ms: Finite  #: Since the start of the touch. [ms]
    end_ms: Finite  #: Since the start of the touch. [ms]

    def __post_init__(self) -> None:
        if not self.name or not 0.0 <= self.start_ms < self.end_ms:
            raise InputError(
                f"A phase needs a name, a start from 0 on and a later end: got {self.name!r}, "
                f"{self.start_ms:g} and {self.end_ms:g} ms."
            )

    @property
    def length_ms(self) -> float:
        """How long it lasts. [ms]"""
        return self.end_ms - self.start_ms

    @property
    def window_ms(self) -> tuple[float, float]:
        """Start and end. [ms]"""
        return self.start_ms, self.end_ms


def ramp_and_hold_phases(
    ramp_end_ms: float, hold_end_ms: float, onset_ms: float = 0.0
) -> tuple[Phase, Phase]:
    """Phases of a ramp from first touch and of the hold after it. [ms]"""
    return Phase(RAMP, onset_ms, ramp_end_ms), Phase(HOLD, ramp_end_ms, hold_end_ms)


def from_onset(phases: Sequence[Phase], onset_ms: float) -> tuple[Phase, ...]:
    """Cut a phase that begins before first touch and ends after it: it begins there."""
    return tuple(
        Phase(phase.name, onset_ms, phase.end_ms) if phase.start_ms < onset_ms < phase.end_ms else phase
        for phase in phases
    )


def phase_named(phases: Sequence[Phase], name: str, asks: str = "phase") -> Phase:
    """Return the first phase with a name, or raise `InputError` that says who asks."""
    for phase in phases:
        if phase.name == name:
            return phase
    names = ", ".join(phase.name for phase in phases) or "none"
    must = f"must be given where no phase is called {name!r}"
    raise InputError(asks, must, remedy=f"the phases are {names}")
