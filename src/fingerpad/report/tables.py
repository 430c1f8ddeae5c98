"""The tables of the report: rows of finished text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fingerpad.data import paper
from fingerpad.report import discrimination
from fingerpad.report.formatting import PARAMETER_SYMBOLS, fixed, number, plain, spelled
from fingerpad.report.parts import Row, Table
from fingerpad.report.skin_deflection import INDENTERS, TRIALS

PAPER_FOLD, PAPER_START = 3, 2
UNBROKEN = "\N{NO-BREAK SPACE}"


def skin_deflection(section: Mapping[str, Any]) -> list[Table]:
    """Return fit and force of each material trial."""
    rows = [
        Row(
            (
                f"{name}, {INDENTERS[indenter]}",
                *(fixed(section[trial][indenter].get(key), 3) for key in ("r2", "r2_mirrored")),
                fixed(section[trial][indenter].get("force_mn"), 1),
            )
        )
        for trial, (name, _, _) in TRIALS.items()
        for indenter in INDENTERS
        if indenter in section.get(trial, {})
    ]
    note = "R², mirrored: with the proximal and the distal side of the observations exchanged."
    return [Table("Fit and force", ("trial", "R²", "R², mirrored", "force [mN]"), rows, note)]


def single_unit(section: Mapping[str, Any]) -> list[Table]:
    """Return parameters, folds, the steps of one fit, and modulation."""
    folds, units = section.get("folds") or [], section.get("units") or {}
    tables = [_fit(section), _parameters(section), _folds(folds), _climbs(folds)]
    tables += [
        _history(fold["fold"], climb, units)
        for fold in folds
        for climb in fold.get("climbs") or []
        if (fold["fold"], climb["start"]) == (PAPER_FOLD, PAPER_START)
    ]
    tables.append(_modulation(section.get("modulation") or {}))
    return [table for table in tables if table.rows]


def _fit(section: Mapping[str, Any]) -> Table:
    names = {
        "fss_out_of_sample": ("positions not fitted to, mean of the folds", paper.FSS_OUT_OF_SAMPLE.value),
        "fss_in_sample": ("all positions, dynamic and static weighted 1:3", None),
        "fss_in_sample_dynamic": ("all positions, dynamic rates", None),
        "fss_in_sample_static": ("all positions, static rates", None),
    }
    rows = [
        Row((name, fixed(printed, 2), fixed(section.get(key), 3))) for key, (name, printed) in names.items()
    ]
    return Table("Fractional sum of squares (FSS)", ("over", "paper", "this run"), rows)


def _parameters(section: Mapping[str, Any]) -> Table:
    starts, final, units = (
        section.get("start_points") or [],
        section["parameters"],
        section.get("units") or {},
    )
    rows = [
        Row(
            (
                PARAMETER_SYMBOLS.get(name, spelled(name)),
                *(number(start.get(name)) for start in starts),
                number(value),
                units.get(name, ""),
            )
        )
        for name, value in final.items()
    ]
    columns = ("parameter", *(f"start {index}" for index in range(1, len(starts) + 1)), "fitted", "unit")
    return Table("Parameters of the afferent", columns, rows)


def _folds(folds: Sequence[Mapping[str, Any]]) -> Table:
    rows = [
        Row(
            (
                plain(fold["fold"]),
                ", ".join(f"{shift:+.1f}".replace("-", "−") for shift in fold["testing_shift_mm"]),
                plain(fold.get("start")),
                fixed(fold.get("fss_train"), 3),
                fixed(fold.get("fss_test"), 3),
            )
        )
        for fold in folds
    ]
    columns = ("fold", "positions kept for testing [mm]", "better start", "FSS, training", "FSS, testing")
    return Table("Folds of the cross-validation (the paper's Table 3)", columns, rows)


def _climbs(folds: Sequence[Mapping[str, Any]]) -> Table:
    rows = [
        Row(
            (
                f"{plain(fold['fold'])}, {plain(climb['start'])}",
                fixed(climb["history"][0]["fss"], 3),
                fixed(climb["fss_train"], 3),
                fixed(climb["fss_test"], 3),
                plain(len(climb["history"]) - 1),
                plain(climb["runs"]),
            ),
            "final" if climb["start"] == fold.get("start") else "",
        )
        for fold in folds
        for climb in fold.get("climbs") or []
    ]
    columns = ("fold, start", "FSS at the start", "FSS, training", "FSS, testing", "iterations", "runs")
    note = "In bold: the better start on the training positions, which is the result of the fold."
    return Table("Climbs from both starts", columns, rows, note)


def _history(fold: int, climb: Mapping[str, Any], units: Mapping[str, str]) -> Table:
    history = climb["history"]
    names = list(history[0]["parameters"])
    rows = [
        Row(
            (
                plain(step["iteration"]),
                fixed(step.get("fss"), 3),
                *(number(step["parameters"].get(name)) for name in names),
            ),
            "final" if step is history[-1] else "",
        )
        for step in history
    ]
    note = (
        "The last row, in bold, is final; its FSS on the testing positions is "
        f"{fixed(climb.get('fss_test'), 3)}. The paper's fit rose from "
        f"{number(paper.FOLD_3_FSS_START.value)} to {number(paper.FOLD_3_FSS_FITTED.value)} in "
        f"{number(paper.FOLD_3_ITERATIONS.value)} iterations, and reached "
        f"{number(paper.FOLD_3_FSS_TEST.value)} on its testing positions. The "
        "results hold such steps for each fold and start."
    )
    title = f"Steps of the fit: fold {fold}, start {plain(climb['start'])} (the paper's Table 4)"
    headings = [
        PARAMETER_SYMBOLS.get(name, spelled(name)) + (f" [{units[name]}]" if name in units else "")
        for name in names
    ]
    columns = ("iteration", "FSS, training", *headings)
    return Table(title, columns, rows, note)


def _modulation(modulation: Mapping[str, Any]) -> Table:
    keys = ("maximum_hz", "minimum_hz", "difference_hz", "index")
    rows = [
        Row((f"{phase}, {who}", *(number(modulation[phase].get(source, {}).get(key)) for key in keys)))
        for phase in ("dynamic", "static")
        if phase in modulation
        for who, source in (("observed", "observed"), ("this run", "ours"))
    ]
    note = (
        "All but the index in spikes/s. The paper predicts a dynamic minimum of "
        f"{number(paper.DYNAMIC_RATE_MINIMUM.value)}, maximum of {number(paper.DYNAMIC_RATE_MAXIMUM.value)} "
        f"and difference of {number(paper.DYNAMIC_RATE_DIFFERENCE.value)}, and a static difference of "
        f"{number(paper.STATIC_RATE_DIFFERENCE.value)}; it calls the differences modulation indices."
    )
    columns = ("rates", "maximum", "minimum", "difference", "index, Eq. 11")
    return Table("Modulation at the edge of the bar (the paper's Table 5)", columns, rows, note)


def hit_rates(section: Mapping[str, Any]) -> list[Table]:
    """Return the numbers behind Figures 7 and 8."""
    panels = [*discrimination.observer_panels(dict(section)), *discrimination.criterion_panels(dict(section))]
    rows = [
        Row((title.replace("\n", ", "), place, *_with_spread(rates, suffix)))
        for title, rates in panels
        if rates
        for place, suffix in (("0.0", ""), ("0.2", "_shifted"))
        if rates.get(f"hit_rate{suffix}")
    ]
    columns = (
        "observer",
        "sphere at [mm]",
        *(f"{number(curvature)} 1/m" for curvature in section["curvature_per_m"][1:]),
    )
    return [Table("Hit rates, mean ± standard deviation", columns, rows)] if rows else []


def readings(section: Mapping[str, Any]) -> list[Table]:
    """Return what other readings of the paper's steps would give."""
    rows = [
        Row(
            (
                reading["reading"],
                " / ".join(plain(count) for count in reading["receptors"]),
                " / ".join(fixed(rise, 3) for rise in reading["rise"]),
                fixed(reading["largest_shift"], 3),
                *(fixed(reading[key], 3) for key in ("noise_sigma", "misfit", "own_largest_shift")),
            ),
            "final" if "(used)" in reading["reading"] else "",
        )
        for reading in section.get("reasons", {}).get("readings", [])
    ]
    columns = (
        "reading",
        "receptors",
        "rise of the sum, 287 to 365 1/m",
        "largest change by the shift",
        "noise of its own",
        "rms distance to people with it",
        "largest change by the shift with it",
    )
    note = (
        "Two numbers are for the spheres at 0.0 and at 0.2 mm. The noise is fitted to both positions "
        "together; expected hit rates, without the chance of a session."
    )
    return [Table("Readings of steps that the paper leaves open", columns, rows, note)] if rows else []


def _with_spread(rates: Mapping[str, Any], suffix: str) -> list[str]:
    means = rates[f"hit_rate{suffix}"]
    spreads = rates.get(f"hit_rate{suffix}_sd") or [None] * len(means)
    return [
        fixed(mean, 2)
        + ("" if mean is None or spread is None else f"{UNBROKEN}±{UNBROKEN}{fixed(spread, 2)}")
        for mean, spread in zip(means, spreads, strict=True)
    ]
