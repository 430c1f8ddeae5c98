"""The paper's claims: the rows of `claims.toml`, judged for one set of tissues.

About discrimination each verdict compares a statistic with a bound, or two statistics with each other. Where
chance could decide, a difference counts if it exceeds two Monte-Carlo errors; closer to its bound a statement
is not decidable.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from functools import partial
from importlib.resources import files
from string import Formatter
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerpad import data
from fingerpad.core.checked import result_class
from fingerpad.core.values import Number
from fingerpad.experiments.gerling2014.percept import SWEPT_NOISE, USED
from fingerpad.experiments.gerling2014.skin import SkinDeflectionResult
from fingerpad.experiments.gerling2014.thresholds import LAYOUTS, STANDARDS_PER_M
from fingerpad.experiments.scores import (
    Estimate,
    Verdict,
    above,
    all_or_none,
    below,
    difference,
    every,
    of_truth,
)
from fingerpad.inference.fitting.methods import ResponseSurface

if TYPE_CHECKING:
    from fingerpad.experiments.gerling2014.nerve import Search
    from fingerpad.experiments.gerling2014.reproduction import SetResult

Values = tuple[Any, ...]  # What is judged, and what the texts of a row tell.


class Group(StrEnum):
    """What a row can show."""

    STATEMENT = "statement"  # A statement of the paper that can fail; nothing was fitted to it.
    FITTED = "fitted"  # A number that was fitted, or by which something was chosen in sample.
    DEFINITION = "definition"  # A consequence of definitions: it holds for nearly any model.
    ADDITION = "addition"  # Our own addition, of which the paper says nothing that could be judged.


@result_class
class ClaimRow:
    """A claim of the paper beside this run."""

    group: Group
    section: str = ""  #: Section of the paper; empty for our own additions.
    quantity: str
    paper: str
    ours: str  #: As they are printed.
    status: str = ""  #: How far the inputs can be trusted.
    verdict: Verdict
    fitted_to: str = ""  #: What was fitted to the number or chosen by it; in the group `FITTED` alone.
    note: str = ""


@result_class
class Statement:
    """A statement of the paper beside both sets."""

    section: str
    statement: str
    published: str  #: Where the paper says it, what it says, and the number that it prints.
    paper: str
    human: str  #: Ours, by the set.
    verdict_paper: Verdict
    verdict_human: Verdict
    fitted_paper: str
    fitted_human: str  #: What was fitted to it; empty where nothing was.


Summary = dict[str, Number | tuple[Number, ...]]
"""Numbers of one set by the names of the rows `summary`."""

ABSENT = "–"


def paired(paper: Sequence[ClaimRow], human: Sequence[ClaimRow]) -> tuple[Statement, ...]:
    """Join the rows of both sets that can fail with at least one of them, in the order of the sections."""
    ranked = sorted((*paper, *human), key=lambda row: [int(part) for part in row.section.split(".") if part])
    asked: dict[str, ClaimRow] = {}
    for row in ranked:
        if row.group is Group.STATEMENT:
            asked.setdefault(row.quantity, row)
    sets = {"paper": {row.quantity: row for row in paper}, "human": {row.quantity: row for row in human}}
    found = []
    for quantity, known in asked.items():
        both: dict[str, Any] = {}
        for name, rows in sets.items():
            ours = rows.get(quantity)
            both[name] = ours.ours if ours else ABSENT
            both[f"verdict_{name}"] = ours.verdict if ours else Verdict.NOT_APPLICABLE
            both[f"fitted_{name}"] = ours.fitted_to if ours else ""
        found.append(Statement(section=known.section, statement=quantity, published=known.paper, **both))
    return tuple(found)


# The rows

_FILE = tomllib.loads((files(__package__) / "claims.toml").read_text(encoding="utf-8"))

REGIONS_MM = ((0.0, 0.5), (0.5, 5.0))  # Of the paper's section 3.1, by distance from the indenter.
MEASURES = ("static", "dynamic", "latency")
PLACES = ("0.0 mm", "0.2 mm")
SESSION_START = 2  # Start point of the session of fold 3 that the paper tells of, counted from 1.
SAME = 1e-9  # Changes of hit rates that differ by less are those of one reading.


class _Writer(Formatter):
    """Numbers without a format have the two digits that another machine reproduces."""

    def format_field(self, value: Any, format_spec: str) -> str:
        value = value.value if isinstance(value, Estimate) else value
        short = isinstance(value, float) and not format_spec
        return two_digits(value) if short else format(value, format_spec)


def two_digits(value: float) -> str:
    return ABSENT if math.isnan(value) else f"{float(f'{value:.2g}'):g}"


def summary(found: SetResult) -> Summary:
    """Collect the numbers of the rows `summary`; a threshold that does not exist is NaN."""
    thresholds = found.curvature_thresholds
    standards = thresholds.populations[0].standards if thresholds else ()
    fractions = dict.fromkeys(STANDARDS_PER_M, np.nan)
    fractions |= {one.standard_per_m: one.weber_fraction for one in standards}
    known = vars(found) | {"statistics": found.discrimination.statistics, "weber_fractions": fractions}

    def number(path: str) -> float:
        return float(Formatter().get_field(path, (), known)[0])

    return {
        name: number(paths) if isinstance(paths, str) else tuple(map(number, paths))
        for name, paths in _FILE["summary"].items()
    }


def judged(found: SetResult, trials: SkinDeflectionResult) -> tuple[ClaimRow, ...]:
    """Judge all claims for one set of tissues; a row is left out where there is nothing to compare."""
    known = vars(found) | {"trials": trials, "line_excess_mm": _line_excess_mm(trials)}
    known |= {"data": data, "statistics": found.discrimination.statistics, **_texts(found)}
    known |= {"swept": (SWEPT_NOISE[0], SWEPT_NOISE[-1])}
    rows = [_row(claim, found, known) for claim in _FILE["claims"]]
    return tuple(row for row in rows if row is not None)


def _row(claim: Mapping[str, Any], found: SetResult, known: Mapping[str, Any]) -> ClaimRow | None:
    writer, where, bound = _Writer(), claim["where"], claim.get("bound")
    try:
        values = (
            READERS[where](found)
            if isinstance(where, str)
            else [writer.get_field(path, (), known)[0] for path in where]
        )
    except KeyError:  # a measure to which the population stays silent
        return None
    if values is None:
        return None
    if isinstance(bound, str):
        bound = writer.get_field(bound, (), known)[0]
    verdict = RULES[claim["rule"]](bound, *values)
    texts = {"ours": "{0}", **claim, "status": "{assumed}" + claim.get("status", "")}
    named = ("section", "quantity", "paper", "ours", "note", "status", "fitted_to")
    row = {name: writer.vformat(texts.get(name, ""), values, {**known, "bound": bound}) for name in named}
    group = Group.FITTED if row["fitted_to"] else Group(claim.get("group", "statement"))
    return ClaimRow(
        group=group, verdict=verdict if isinstance(verdict, Verdict) else of_truth(verdict), **row
    )


def _texts(found: SetResult) -> dict[str, str | float]:
    """Texts that depend on the tissues."""
    texts = dict(_FILE["texts"])
    for case in _FILE["cases"]:
        texts |= case.get("then" if found.tissues in case["tissues"] else "otherwise", {})
    return texts


# Rules

CLOSE, CLOSE_POINTS = _FILE["texts"]["close"], _FILE["texts"]["close_points"]


def _readings_agree(bound: float, least: float, most: float, *_: object) -> Verdict:
    # The paper does not say what a silent receptor counts as. The verdict holds if the readings can be told
    # apart and agree (docs/decisions/silent-receptors.md).
    told_apart = most - least > SAME
    return all_or_none(np.nextafter(bound, np.inf), least, most) if told_apart else Verdict.NOT_DECIDABLE


RULES: dict[str, Callable[..., Verdict | bool]] = {
    "more": lambda bound, ours, *_: ours > bound,
    "at least": lambda bound, ours, *_: ours >= bound,
    "at least, after steps": lambda bound, ours, steps, *_: ours >= bound and steps > 0,
    "both at least, or none": all_or_none,
    "close to": lambda bound, ours, *_: abs(ours - bound) <= CLOSE * bound,
    "between": lambda bound, ours, *_: bound[0] <= ours <= bound[1],
    "less": lambda _, one, other, *__: one < other,
    "above, then below": lambda bound, one, other, *_: one > bound > other,
    "two below and two above": lambda bound, *four: max(four[:2]) < bound < min(four[2:]),
    "both met": lambda _, one, other, *__: every(one, other),
    "below": lambda bound, ours, *_: below(ours, bound),
    "above": lambda bound, ours, *_: above(ours, bound),
    "near": lambda bound, *rates: every(
        *(below(Estimate(value=abs(each.value - bound), error=each.error), CLOSE_POINTS) for each in rates)
    ),
    "above, and more than static": lambda bound, ours, more: every(above(more), above(ours, bound)),
    "below, and others farther": lambda bound, ours, _, *others: every(
        below(ours, bound), *map(above, others)
    ),
    "every step above": lambda bound, _, __, *steps: every(*(above(step, bound) for step in steps)),
    "all above, or none": _readings_agree,
    "per cent within": lambda bound, _, __, missed, *fractions: (
        bool(fractions) and not missed and all(bound[0] <= round(one, 2) <= bound[1] for one in fractions)
    ),
}


# Where the values stand, if they are not single fields


def _line_excess_mm(trials: SkinDeflectionResult) -> list[float]:
    """Mean deflection above Trial 3's, of Trials 1 and 2 in both regions, over nodes that both have. [mm]"""
    third = trials.trial3["line"]
    distance = np.abs(third.distance_mm)
    excess = [one["line"].deflection_mm - third.deflection_mm for one in (trials.trial1, trials.trial2)]
    near = [(distance >= start) & (distance <= end) for start, end in REGIONS_MM]
    return [float(more[region].mean()) for more in excess for region in near]


def _sessions(found: SetResult) -> list[Search] | None:
    """Return the paper's session of fold 3; a fit without its second start point has no such session."""
    # The shifts of the paper's fold 3 are lost, so that any of our folds may be it (docs/decisions.md#folds).
    unit = found.single_unit
    sessions = [climb for fold in unit.folds for climb in fold.climbs if climb.start == SESSION_START]
    return sessions if sessions and unit.method == ResponseSurface.name else None


def _fold_3_training(found: SetResult) -> Values | None:
    if not (sessions := _sessions(found)):
        return None
    steps, begun = zip(*((len(one.history) - 1, one.history[0].fss) for one in sessions), strict=True)
    lowest = min(one.fss_train for one in sessions)
    return lowest, min(steps), max(steps), min(begun), max(begun)


def _fold_3_testing(found: SetResult) -> Values | None:
    tested = [one.fss_test for one in _sessions(found) or ()]
    return (min(tested), max(tested)) if tested else None


def _dynamic_shares(found: SetResult) -> Values:
    fires, firing = found.firing.fires, found.firing
    ramp, hold = (np.median(share[fires]) for share in (firing.dynamic_share_ramp, firing.dynamic_share_hold))
    return float(ramp), float(hold), int(fires.sum())


def _peaks_in_window(found: SetResult) -> Values:
    (start_ms, end_ms), peak_ms = found.firing.window_ms, found.firing.peak_ms
    within, fires = int(((peak_ms >= start_ms) & (peak_ms <= end_ms)).sum()), int(found.firing.fires.sum())
    return 100 * within / max(fires, 1), within, fires, int((peak_ms < start_ms).sum())


def _noise_and_rises(found: SetResult) -> Values:
    reasons = found.discrimination.reasons
    used = next(reading for reading in reasons.readings if reading.reading == USED["static"])
    both = (used.rise, reasons.rise_for_paper_noise["static"])
    texts = (" and ".join("none" if math.isnan(one) else f"{one:.0%}" for one in rises) for rises in both)
    return found.discrimination.noise_sigma, *texts


def _farthest_from_line(found: SetResult) -> Values:
    targets = found.discrimination.statistics.targets
    return (max((place.largest_from_line for place in targets), key=lambda one: one.value),)


def _misfits(found: SetResult) -> Values:
    """Verdicts of the three measures at one noise, and each at the noise that fits it best; their numbers."""
    statistics = found.discrimination.statistics
    readings = {reading.reading: reading for reading in found.discrimination.reasons.readings}
    at_own = {name: readings[USED[name]] for name in MEASURES if USED[name] in readings}
    farther = [statistics.misfit_above_static[name] for name in MEASURES[1:] if name in statistics.misfit]
    # A measure that no noise fits has no misfit of its own, and fits worse than any other.
    own = {name: np.nan_to_num(reading.misfit, nan=np.inf) for name, reading in at_own.items()}
    best = all(own["static"] < misfit for name, misfit in own.items() if name != "static")
    numbers = (
        {name: statistics.misfit[name].value for name in MEASURES if name in statistics.misfit},
        {name: reading.misfit for name, reading in at_own.items()},
        {name: reading.noise_sigma for name, reading in at_own.items()},
    )
    listed = (", ".join(f"{name} {_or_none(value)}" for name, value in each.items()) for each in numbers)
    return every(*map(above, farther), Verdict.MET), of_truth(best), *listed


def _latency_shifts(found: SetResult) -> Values | None:
    """Smallest and largest shift of latencies over the readings of silent receptors; which are known."""
    readings = [one for one in found.discrimination.reasons.readings if one.reading.startswith("latency")]
    if not readings:
        return None
    shifts = {one.reading.removeprefix("latency").strip(" ,"): one.own_largest_shift for one in readings}
    # A reading that no noise fits has no shift.
    known = [shift for shift in shifts.values() if not math.isnan(shift)] or [0.0]
    least, most = min(known), max(known)
    why = "all readings agree"
    if most - least <= SAME:
        why = "the reading of silent receptors could decide, but the readings cannot be told apart here"
    elif _readings_agree(CLOSE_POINTS, least, most) is Verdict.NOT_DECIDABLE:
        why = "the reading of silent receptors decides"
    return least, most, why, "; ".join(f"{name} {_or_none(shift)}" for name, shift in shifts.items())


def _rises(measure: str, found: SetResult) -> Values:
    """Where hit rates rise, hit rates, and their smallest steps from sphere to sphere at both positions."""
    drawn = found.discrimination.gradient_sum[measure]
    steps = found.discrimination.statistics.smallest_rise[measure]
    at = [place for place, step in zip(PLACES, steps, strict=True) if above(step) is Verdict.MET]
    rises = "rises" if len(at) == len(PLACES) else f"rises at {at[0]} only" if at else "does not"
    curves = (
        f"at {place} {', '.join(f'{rate:.2f}' for rate in rates)} (smallest step {two_digits(step.value)})"
        for place, rates, step in zip(PLACES, (drawn.hit_rate, drawn.hit_rate_shifted), steps, strict=True)
    )
    return rises, "; ".join(curves), *steps


def _euclidean_misfit(found: SetResult) -> Values:
    """Misfit of the Euclidean Distance, a noise of its own, and how much farther the other measures are."""
    misfit, own = found.discrimination.statistics.misfit, found.discrimination.reasons.euclidean
    alone = f"with a separate noise of {own['noise_sigma']:.3f}: {own['misfit']:.3f}"
    if math.isnan(own["noise_sigma"]):
        alone = "no separate noise fits the points"
    ours = misfit["euclidean"]
    return ours, alone, *(difference(misfit[name], ours) for name in MEASURES[1:] if name in misfit)


def _weber_fractions(layout: str, found: SetResult) -> Values | None:
    populations = found.curvature_thresholds.populations if found.curvature_thresholds else ()
    population = next((one for one in populations if one.layout == layout), None)
    if population is None:
        return None
    missed = [missing.why_not for missing in population.without_threshold]
    at = ", ".join(f"{threshold.standard_per_m:g}" for threshold in population.standards)
    fractions = [threshold.weber_fraction for threshold in population.standards]
    told = "; ".join([f"{at} /m; judged in whole per cent", *missed])
    return ", ".join(f"{fraction:.1%}" for fraction in fractions), told, missed, *fractions


def _or_none(value: float) -> str:
    return "none" if math.isnan(value) else two_digits(value)


READERS: dict[str, Callable[[SetResult], Values | None]] = {
    "fold 3, training": _fold_3_training,
    "fold 3, testing": _fold_3_testing,
    "dynamic shares": _dynamic_shares,
    "peaks in window": _peaks_in_window,
    "mean rates": lambda found: tuple(
        float(getattr(found.single_unit, f"{phase}_rate_hz").mean()) for phase in ("static", "dynamic")
    ),
    "noise and rises": _noise_and_rises,
    "farthest from line": _farthest_from_line,
    "misfits": _misfits,
    "latency shifts": _latency_shifts,
    **{f"rises, {measure}": partial(_rises, measure) for measure in MEASURES},
    "euclidean misfit": _euclidean_misfit,
    **{f"weber fractions, {layout}": partial(_weber_fractions, layout) for layout in LAYOUTS},
}
