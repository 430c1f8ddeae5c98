"""Many equal cycles: some are solved, and those between are interpolated, phase by phase.

Over one cycle of a vibration of period T, the stress h that a branch of the Prony series has relaxed away
changes linearly: with q = exp(-T / tau) and c, what the stress within the cycle adds,

    h_1 = q h_0 + c.

Of a solved cycle c is known, c = h_1 - q h_0. Over n cycles that are not solved, c goes on changing by d per
cycle as it did between the last two that were, so that their sum has a closed form:

    h_n = q^n h_0 + sum_k q^(n-k) (c + k d) = q^n h_0 + A c + B d,    k = 1 ... n,
    A = (1 - q^n) / (1 - q),    B = (n - q A) / (1 - q).

The next solved cycle starts from h_n, with contact and all nonlinearity. How far away it may lie follows from
two errors of the stored energy: that of linear interpolation between solved cycles, and that of h_n, which is
known as soon as c of the cycle after the gap is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from fingerpad.core.errors import ConvergenceError
from fingerpad.core.values import FloatArray
from fingerpad.mechanics.materials import MaterialTable
from fingerpad.mechanics.moments import Moment
from fingerpad.mechanics.steps import Step, Stop, change_of_length, interpolation_error, steps_at
from fingerpad.mechanics.viscoelastic import StressHistory

SOLVED_FIRST = 3  # Cycles that are solved before the first gap: contact and shape settle in them.

FIRST_GAP, LENGTHEN_GAP = 5, 4.0
"""Periods from the last of them to the next solved cycle, and the most by which the next gap is longer."""

SETTLING_SHARE = 1e-3
"""Length of the step that lets the shape follow the stress after a gap, over that of the next step."""

NOT_BLENDED = frozenset({
    "history", "ledger", "step_mm", "advance", "reached", "stiffness", "multipliers_mn",
    "anchors", "convected_kpa", "friction",
})  # fmt: skip
"""Parts of a moment that only the next step needs; none starts from a moment that is interpolated."""


@dataclass(frozen=True)
class PronyCycle:
    """Relaxation over equal cycles, for each branch and element."""

    period_over_tau: FloatArray  # Period over relaxation time, (n_terms, n_elements, 1, 1).

    @classmethod
    def of(cls, table: MaterialTable, layer: np.ndarray, period_ms: float) -> PronyCycle:
        """Relaxation over a period [ms] in elements of these layers."""
        return cls((period_ms / table.times_ms[layer].T)[:, :, None, None])

    def added(self, before: FloatArray, after: FloatArray) -> FloatArray:
        """Return what one cycle adds, c = h_1 - q h_0, from the relaxed stress at its ends. [kPa]"""
        return after - np.exp(-self.period_over_tau) * before

    def after(self, relaxed: FloatArray, cycles: int, added: FloatArray, drift: FloatArray) -> FloatArray:
        """Relaxed stress h_n after a number of cycles, see the head of this module. [kPa]"""
        per_cycle, drifting = self._sums(cycles)
        left = np.exp(-cycles * self.period_over_tau)
        return left * relaxed + per_cycle * added + drifting * drift

    def misled(self, cycles: int, drift: FloatArray) -> FloatArray:
        """How much h_n changes if d changes by `drift`. [kPa]"""
        return self._sums(cycles)[1] * drift

    def _sums(self, cycles: int) -> tuple[FloatArray, FloatArray]:
        lost = -np.expm1(-self.period_over_tau)
        per_cycle = -np.expm1(-cycles * self.period_over_tau) / lost
        return per_cycle, (cycles - (1.0 - lost) * per_cycle) / lost


@dataclass(frozen=True)
class _Cycle:
    """A solved cycle: its number, the moment before it, its moments, and c."""

    number: int
    start: Moment
    moments: tuple[Moment, ...]
    added: FloatArray


class _Totals(NamedTuple):
    """What a press sums up over all steps: it grows from cycle to cycle."""

    dissipated_uj: float
    contact_uj: float
    work_kpa: FloatArray

    @classmethod
    def of(cls, moment: Moment) -> _Totals:
        entry = moment.ledger[-1]
        return cls(entry.dissipated_uj, entry.contact_uj, moment.fields.values.work_kpa)

    def plus(self, share: float, late: Moment, early: Moment) -> _Totals:
        """Add a share of what came between two moments."""
        after, before = _Totals.of(late), _Totals.of(early)
        return _Totals(
            self.dissipated_uj + share * (after.dissipated_uj - before.dissipated_uj),
            self.contact_uj + share * (after.contact_uj - before.contact_uj),
            self.work_kpa + share * (after.work_kpa - before.work_kpa),
        )

    def put_in(self, moment: Moment, before: Moment) -> Moment:
        """Return the moment with these totals, its ledger going on from that of the moment before."""
        entry = moment.ledger[-1]._replace(
            time_ms=moment.time_ms, dissipated_uj=self.dissipated_uj, contact_uj=self.contact_uj
        )
        values = moment.fields.values._replace(work_kpa=self.work_kpa)
        ledger = (*before.ledger, entry)
        return replace(moment, ledger=ledger, fields=replace(moment.fields, values=values))


@dataclass(frozen=True)
class CycleJumps:
    """Steps through many equal cycles, few of which are solved."""

    times_ms: FloatArray
    """Times to solve at in each cycle; its last one is its end, (n_cycles, n_steps). [ms]"""
    tolerance: float  # Largest error of SED by what is not solved, over the largest SED.
    where: np.ndarray  # Elements that count for it.
    table: MaterialTable
    layer: np.ndarray  # Row of the table of each element, (n_elements,).
    step: Step[Moment]
    stop: Stop[Moment]  # Solve a step; make the final error, as in `steps_at`.

    def moments(self, start: Moment) -> Iterator[Moment]:
        count, gap = len(self.times_ms), 1
        prony = PronyCycle.of(self.table, self.layer, self.times_ms[1, -1] - self.times_ms[0, -1])
        before, last = None, self.solved(0, start, prony)
        yield from last.moments
        largest_kpa = max(float(each.sed_kpa[self.where].max()) for each in (start, *last.moments))
        while last.number < count - 1:
            number = min(last.number + gap, count - 1)
            drift = np.zeros_like(last.added)
            if before is not None:
                drift = (last.added - before.added) / (last.number - before.number)
            try:
                found = self.solved(number, self.resumed(last, number, prony, drift), prony)
            except ConvergenceError:
                if number == last.number + 1:
                    raise
                gap = (number - last.number) // 2
                continue
            longer, allowed_kpa = 1.0, self.tolerance * largest_kpa
            if before is not None:
                error_kpa = self.error_kpa(before, last, found, prony, drift)
                longer = change_of_length(error_kpa, allowed_kpa, LENGTHEN_GAP)
                if error_kpa > allowed_kpa and number > last.number + 1:
                    gap = max(1, int(longer * (number - last.number)))
                    continue
            previous = last.moments[-1]
            for previous in self.between(last, found):
                yield previous
            found = self.following(previous, found)
            yield from found.moments
            largest_kpa = max(largest_kpa, *(float(each.sed_kpa[self.where].max()) for each in found.moments))
            if number >= SOLVED_FIRST:
                gap = max(1, int(longer * (number - last.number)))
            elif number == SOLVED_FIRST - 1:
                gap = FIRST_GAP
            before, last = last, found

    def solved(self, number: int, start: Moment, prony: PronyCycle) -> _Cycle:
        moments = tuple(steps_at(start, self.times_ms[number], self.step, self.stop))
        return _Cycle(number, start, moments, prony.added(start.history.relaxed, moments[-1].history.relaxed))

    def resumed(self, last: _Cycle, number: int, prony: PronyCycle, drift: FloatArray) -> Moment:
        """Moment before a later cycle: that at the end of the last solved one, its stress relaxed meanwhile.

        A step of hardly any length lets the shape follow the relaxed stress, so that what the press sums up
        over the cycle is that of the cycle alone.
        """
        end, skipped = last.moments[-1], number - last.number - 1
        if skipped == 0:
            return end
        start_ms = float(self.times_ms[number - 1, -1])
        relaxed = prony.after(end.history.relaxed, skipped, last.added, drift)
        history = StressHistory(end.history.instantaneous, relaxed)
        settling_ms = SETTLING_SHARE * (self.times_ms[number, 0] - start_ms)
        before = replace(end, time_ms=start_ms - settling_ms, history=history)
        settled = self.step(before, start_ms)
        return replace(settled, step_mm=end.step_mm, advance=end.advance)

    def error_kpa(
        self, before: _Cycle, last: _Cycle, found: _Cycle, prony: PronyCycle, drift: FloatArray
    ) -> float:
        """Largest error of SED between the last two cycles, and by what the last one began with. [kPa]"""
        rows = zip(before.moments, last.moments, found.moments, strict=True)
        between_kpa = max(interpolation_error(*row, self.where) for row in rows)
        periods = found.number - last.number
        if periods == 1:
            return between_kpa
        change = (found.added - last.added) / periods - drift
        misled = np.abs(prony.misled(periods - 1, change).sum(axis=0)[self.where]).max(axis=(1, 2))
        end = found.moments[-1]
        stress = np.abs(end.history.instantaneous[self.where]).max(axis=(1, 2))
        # SED is quadratic in stress.
        share = np.divide(2.0 * misled, stress, out=np.zeros_like(misled), where=stress > 0.0)
        return between_kpa + float((share * end.sed_kpa[self.where]).max(initial=0.0))

    def between(self, last: _Cycle, found: _Cycle) -> Iterator[Moment]:
        """Moments of the cycles between two solved ones, interpolated at equal phase."""
        previous = last.moments[-1]
        for number in range(last.number + 1, found.number):
            share = (number - last.number) / (found.number - last.number)
            base = _Totals.of(previous)
            for time_ms, early, late in zip(self.times_ms[number], last.moments, found.moments, strict=True):
                totals = base.plus(1.0 - share, early, last.start).plus(share, late, found.start)
                moment = replace(blended(early, late, share), time_ms=float(time_ms))
                ledger = (blended(early.ledger[-1], late.ledger[-1], share),)
                previous = totals.put_in(replace(moment, ledger=ledger), previous)
                yield previous

    def following(self, previous: Moment, found: _Cycle) -> _Cycle:
        """Return a solved cycle whose totals go on from those of the moment before it."""
        base, start, moments = _Totals.of(previous), found.start, [previous]
        for moment in found.moments:
            moments.append(base.plus(1.0, moment, start).put_in(moment, moments[-1]))
        start = replace(base.put_in(start, previous), ledger=previous.ledger)
        return replace(found, start=start, moments=tuple(moments[1:]))


def blended(early: Any, late: Any, share: float) -> Any:
    """Interpolate all numbers of two values of one type, `share` of the way from the first to the second."""
    if is_dataclass(early) and not isinstance(early, type):
        changed = {
            field.name: blended(getattr(early, field.name), getattr(late, field.name), share)
            for field in fields(early)
            if field.name not in NOT_BLENDED
        }
        return replace(early, **changed)
    if isinstance(early, tuple):
        parts = (blended(*pair, share) for pair in zip(early, late, strict=True))
        return type(early)(*parts) if hasattr(early, "_fields") else tuple(parts)
    if isinstance(early, float | np.ndarray):
        return (1.0 - share) * early + share * late
    return early
