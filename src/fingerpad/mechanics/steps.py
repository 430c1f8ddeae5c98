"""Time steps of a press: at given times, cut where they fail, or as long as an error bound on SED allows.

Without friction, the only error in time is that stress and energy are taken as linear within a step: without
relaxation the equilibrium at its end does not depend on the path, and a relaxed stress is an average of past
stress with weights that sum to less than 1 (see `viscoelastic`). So the error of a whole press is that of its
worst step, and the error of a step is that of linear interpolation,

    e = h²/4 |w[t-, t, t+]|,    w[t-, t, t+] = (w[t, t+] - w[t-, t]) / (h- + h),

with SED w, its divided differences over the last two steps, and their lengths h- and h. If the step is
shorter than the one before, h is used instead of h-: SED may have a kink in the step, for example at first
touch, which would be underestimated after a long step.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np

from fingerpad.core.errors import ConvergenceError
from fingerpad.core.values import FloatArray

LOGGER = logging.getLogger(__name__)

SMALLEST_CUT = 1.0 / 32  # Shortest step that is tried, over the step asked for.
LENGTHEN_AFTER = 2  # Steps in a row that must converge after a cut before their length is doubled.
SMALLEST_SHARE = 1.0 / 4096  # Shortest adaptive step, over the phase that it belongs to.

SMOOTH_SHARE = 0.5
"""Share of the tolerance that the estimated error may take. The rest is for kinks of SED within a step, where
a node comes to touch: an estimate for smooth curves gives only a part of their error."""

SAFETY, SHORTEN, LENGTHEN = 0.85, 0.25, 2.0
"""Aim below the tolerance, and bounds on how much one step's length may differ from the last one's."""


@runtime_checkable
class Solved(Protocol):
    """A solved time; the next step starts from it and leaves it as it is."""

    @property
    def time_ms(self) -> float: ...

    @property
    def sed_kpa(self) -> FloatArray:
        """Strain energy density (n_elements,). [kPa]"""
        ...


Reached = TypeVar("Reached", bound=Solved)
Step = Callable[[Reached, float], Reached]  # Solves from a moment to a time [ms]; raises ConvergenceError.

Stop = Callable[[Reached, tuple[str, ...], str], ConvergenceError]
"""Error for a press that gets no further than a moment, from the history of attempts and the last cause."""


def steps_at(
    start: Reached,
    times_ms: Sequence[float] | FloatArray,
    step: Step[Reached],
    stop: Stop[Reached],
    parts: Callable[[float, float], int] = lambda begin_ms, end_ms: 1,
    last_resort: Step[Reached] | None = None,
) -> Iterator[Reached]:
    """Reach each of the given times, in one step if it converges, else in halves, quarters ... of it.

    After a cut the steps stay short, over the next times too, until some in a row converge.
    """
    moment, share, converged = start, 1.0, 0
    attempts: list[str] = []
    for until_ms in times_ms:
        whole_ms = (until_ms - moment.time_ms) / parts(moment.time_ms, until_ms)
        while moment.time_ms < until_ms:
            target_ms = moment.time_ms + share * whole_ms
            if target_ms >= until_ms - 1e-9 * whole_ms:
                target_ms = float(until_ms)
            solve = step if share > SMALLEST_CUT or last_resort is None else last_resort
            try:
                moment = solve(moment, target_ms)
            except ConvergenceError as error:
                attempts.append(_attempt(moment, target_ms, error))
                LOGGER.debug("%s", attempts[-1])
                share, converged = share / 2, 0
                if share < SMALLEST_CUT:
                    raise stop(moment, tuple(attempts), error.args[0]) from None
                continue
            converged += 1
            if share < 1.0 and converged == LENGTHEN_AFTER:
                share, converged = 2 * share, 0
            if share == 1.0:
                attempts.clear()
        yield moment


def _attempt(moment: Solved, target_ms: float, error: ConvergenceError) -> str:
    """One line of history for a step that did not converge."""
    last = error.history[-1] if error.history else "no iteration"
    return f"step from {moment.time_ms:.4g} to {target_ms:.4g} ms: {error.args[0]} Last: {last}."


@dataclass(frozen=True)
class Phase:
    """A part of the motion at constant speed, within which SED is smooth in time."""

    end_ms: float
    first_ms: float  # Length of the first step to try. [ms]
    loading: bool
    """Whether SED grows to the end. Errors then are relative to the largest SED expected there, by growth in
    proportion to time: no step is small beside what it has reached from nothing."""


def adaptive_steps(
    start: Reached,
    phases: Sequence[Phase],
    tolerance: float,
    where: np.ndarray,
    step: Step[Reached],
    stop: Stop[Reached],
) -> Iterator[Reached]:
    """Choose steps so that the error of SED stays below a tolerance."""
    last, largest_kpa = start, 0.0
    for phase in phases:
        for moment in _adapt(last, phase, tolerance, largest_kpa, where, step, stop):
            last, largest_kpa = moment, max(largest_kpa, _largest(moment, where))
            yield moment


def _largest(moment: Solved, where: np.ndarray) -> float:
    return float(moment.sed_kpa[where].max(initial=0.0))


def _adapt(
    start: Reached,
    phase: Phase,
    tolerance: float,
    largest_kpa: float,
    where: np.ndarray,
    step: Step[Reached],
    stop: Stop[Reached],
) -> Iterator[Reached]:
    # The first two are equal and judged together: it takes three moments to see a curvature, and the speed
    # changes at the start of a phase.
    whole_ms = phase.end_ms - start.time_ms
    step_ms = min(phase.first_ms, whole_ms / 2)
    before: Reached | None = None
    moment, judged = start, False
    attempts: list[str] = []
    cause = ""
    while moment.time_ms < phase.end_ms:
        if step_ms < SMALLEST_SHARE * whole_ms:
            raise stop(moment, tuple(attempts), cause)
        target_ms = _target(moment.time_ms, step_ms, phase.end_ms)
        taken_ms = target_ms - moment.time_ms
        try:
            found = step(moment, target_ms)
        except ConvergenceError as error:
            attempts.append(_attempt(moment, target_ms, error))
            cause = error.args[0]
            step_ms = taken_ms / 2
            continue
        if before is None:
            before, moment, step_ms = moment, found, taken_ms
            continue
        growth = whole_ms / (target_ms - start.time_ms) if phase.loading else 1.0
        largest_kpa = max(largest_kpa, _largest(moment, where))
        allowed_kpa = SMOOTH_SHARE * tolerance * max(largest_kpa, growth * _largest(found, where))
        error_kpa = interpolation_error(before, moment, found, where, both=not judged)
        step_ms = taken_ms * change_of_length(error_kpa, allowed_kpa)
        if error_kpa > allowed_kpa:
            cause = "SED jumps in time, so that no step meets sed_tolerance."
            attempts.append(
                f"step from {moment.time_ms:.4g} to {target_ms:.4g} ms: "
                f"error of SED {error_kpa:.3g} kPa, allowed {allowed_kpa:.3g} kPa."
            )
            if not judged:
                before, moment = None, start
            continue
        if not judged:
            yield moment
        yield found
        before, moment, judged, attempts = moment, found, True, []


def _target(time_ms: float, step_ms: float, end_ms: float) -> float:
    """End of a step of about `step_ms`: the last two before the end are equal, none is a sliver."""
    left_ms = end_ms - time_ms
    if left_ms <= step_ms * (1 + 1e-9):
        return end_ms
    return time_ms + (left_ms / 2 if left_ms < 2 * step_ms else step_ms)


def change_of_length(error_kpa: float, allowed_kpa: float, lengthen: float = LENGTHEN) -> float:
    """Factor from a step's length to the next one's: the error grows as the square of the length."""
    if error_kpa <= 0.0:
        return lengthen
    return float(np.clip(SAFETY * np.sqrt(allowed_kpa / error_kpa), SHORTEN, lengthen))


def interpolation_error(
    before: Solved, moment: Solved, after: Solved, where: np.ndarray, both: bool = False
) -> float:
    """Largest error of linear interpolation of SED from `moment` to `after`."""
    earlier_ms, later_ms = moment.time_ms - before.time_ms, after.time_ms - moment.time_ms
    slope_before = (moment.sed_kpa[where] - before.sed_kpa[where]) / earlier_ms
    slope_after = (after.sed_kpa[where] - moment.sed_kpa[where]) / later_ms
    divided = np.abs(slope_after - slope_before) / (later_ms + min(earlier_ms, later_ms))
    longest_ms = max(earlier_ms, later_ms) if both else later_ms
    return float(longest_ms**2 / 4 * divided.max(initial=0.0))
