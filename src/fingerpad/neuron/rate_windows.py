"""Windows in which the two firing rates are counted: given, or at the paper's place within the phases."""

from __future__ import annotations

from collections.abc import Sequence

from fingerpad.core.errors import InputError
from fingerpad.core.phases import HOLD, Phase, phase_named, ramp_and_hold
from fingerpad.data import protocol

Window = tuple[float, ...]
"""Start and end. [ms]"""

Windows = tuple[Window, Window]
"""Windows of the dynamic and of the static rate. [ms]"""

PAPER_WINDOWS_MS: Windows = (protocol.DYNAMIC_WINDOW.value, protocol.STATIC_WINDOW.value)
"""The paper's windows, which belong to its own ramp and hold. [ms]"""

_PAPER_PHASES = ramp_and_hold(protocol.RAMP.value, protocol.RAMP.value + protocol.HOLD.value)


def rate_windows_ms(
    phases: Sequence[Phase], dynamic_ms: Window | None = None, static_ms: Window | None = None
) -> Windows:
    """Return the windows of the dynamic and of the static rate of a touch.

    A window that is not given has the place of the paper's window in its phase: the last 40 % of the ramp,
    and 550 to 900 ms from the start of the hold, or 58 to 95 % of a hold shorter than the paper's 950 ms
    (docs/decisions/rate-windows.md).

    Parameters
    ----------
    phases : sequence of Phase
        Of the touch; those called "ramp" and "hold" are used, the first of each.
    dynamic_ms, static_ms : (float, float), optional
        Windows that are returned as they are. [ms]

    Returns
    -------
    (float, float), (float, float)
        Start and end of the two windows. [ms]

    Raises
    ------
    InputError
        If a window is not given and there is no phase of that name.

    Examples
    --------
    >>> rate_windows_ms(ramp_and_hold(50.0, 1000.0))
    ((30.0, 50.0), (600.0, 950.0))
    >>> rate_windows_ms(ramp_and_hold(200.0, 1150.0))
    ((120.0, 200.0), (750.0, 1100.0))
    >>> rate_windows_ms(ramp_and_hold(50.0, 525.0))
    ((30.0, 50.0), (325.0, 500.0))
    """
    dynamic, static = (
        given or _within(phase_named(phases, paper.name, f"{asks}_window_ms"), paper, window)
        for given, paper, window, asks in zip(
            (dynamic_ms, static_ms), _PAPER_PHASES, PAPER_WINDOWS_MS, ("dynamic", "static"), strict=True
        )
    )
    return dynamic, static


def common_rate_windows_ms(
    touches: Sequence[Sequence[Phase]], dynamic_ms: Window | None = None, static_ms: Window | None = None
) -> Windows:
    """Return the windows that several touches share, each given by its phases, as `rate_windows_ms`.

    Raises
    ------
    InputError
        If their windows differ, or one has none.

    Examples
    --------
    >>> common_rate_windows_ms([ramp_and_hold(50.0, 1000.0), ramp_and_hold(100.0, 1000.0)])
    Traceback (most recent call last):
    fingerpad.core.errors.InputError: Windows of the rates must be given where the phases differ: ...
    """
    found = list(dict.fromkeys(rate_windows_ms(phases, dynamic_ms, static_ms) for phases in touches))
    if len(found) != 1:
        shown = " or ".join(", ".join(f"{start:g}-{end:g} ms" for start, end in windows) for windows in found)
        raise InputError(f"Windows of the rates must be given where the phases differ: got {shown}.")
    return found[0]


def _within(phase: Phase, paper: Phase, window_ms: Window) -> tuple[float, float]:
    """Window of `phase` at the place of `window_ms` in `paper`; its bits where the phases are equal."""
    length, whole = phase.end_ms - phase.start_ms, paper.end_ms - paper.start_ms
    # A response adapts with the time since the ramp, so a longer hold is read at the same time.
    length = min(length, whole) if phase.name == HOLD else length
    start, end = (phase.start_ms + (bound - paper.start_ms) * length / whole for bound in window_ms)
    return start, end
