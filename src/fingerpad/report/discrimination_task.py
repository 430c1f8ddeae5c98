"""A question of one's own, answered on one page: what was found, thresholds, hit rates and efficiencies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fingerpad.report import tables
from fingerpad.report.discrimination_task_figures import (
    CODES,
    caption_curves,
    caption_responses,
    caption_statistics,
    draw_curves,
    draw_responses,
    draw_statistics,
    main_reading,
    titled,
    why_silent,
)
from fingerpad.report.formatting import ABSENT, fixed, joined, number, plain, whole_percent
from fingerpad.report.page import Chapter, Drawing, write_page
from fingerpad.report.tables import Row, Table

PAGE = "discriminate.html"
SEVERAL = {"static": "static rates", "dynamic": "dynamic rates", "latency": "first-spike latencies"}


def answer_tables(section: Mapping[str, Any]) -> list[Table]:
    """Return thresholds, hit rates, statistics and the population."""
    every = (_thresholds(section), _hit_rates(section), _efficiencies(section), _population(section))
    return [table for table in every if table.rows]


CHAPTERS = (
    Chapter(
        "discrimination",
        "The answer",
        (
            Drawing(1, "curves", "How often stimuli are told apart", draw_curves, caption_curves),
            Drawing(2, "statistics", "What the observer compares", draw_statistics, caption_statistics),
            Drawing(3, "responses", "What the population answers", draw_responses, caption_responses),
        ),
        answer_tables,
    ),
    Chapter("manifest", "How this was made", (), tables.manifest),
)


def write_discrimination_page(results: Mapping[str, Any], folder: Path) -> Path:
    """Write the page of a question, `discriminate.html`, and its figures.

    Parameters
    ----------
    results : mapping
        What `studies.discriminate.run` returns.
    folder : Path
        Where; made if needed.

    Returns
    -------
    Path
        The page.
    """
    return write_page(
        results,
        CHAPTERS,
        Path(folder) / PAGE,
        heading=results["discrimination"]["question"],
        subtitle="A finite-element fingertip, a population of slowly adapting afferents and an observer, "
        "after Gerling et al. 2014.",
        paragraphs=summary(results["discrimination"]),
    )


def summary(section: Mapping[str, Any]) -> list[str]:
    """Return what was found, in a few sentences.

    Examples
    --------
    >>> summary({
    ...     "stimulus": ["287", "365"], "level": [287.0, 365.0], "axis": "curvature [1/m]",
    ...     "noise": {"sigma": 0.137, "fitted_to": None},
    ...     "readings": [{"code": "gradient_sum", "measure": "static", "hit_rate": [0.93], "curves": []}],
    ... })
    ['Gradient Sum of static rates tells 365 from 287 in 93 % of trials (curvature [1/m]), with noise
    σ₁ = 0.137.']
    """
    main, noise = main_reading(section), section["noise"]
    standard, *others = section["stimulus"]
    rates = [(name, whole_percent(rate)) for name, rate in zip(others, main["hit_rate"], strict=True)]
    fitted = (
        f", fitted to {joined([str(name) for name in noise['fitted_to']['stimulus']])}"
        if noise["fitted_to"]
        else ""
    )
    (nearest, rate), *farther = rates
    told = joined([f"{nearest} from {standard} in {rate}", *(f"{name} in {rate}" for name, rate in farther)])
    of = "" if section["level"] is None else f" ({section['axis']})"
    found = [
        f"{CODES[main['code']]} of {SEVERAL[main['measure']]} tells {told} of trials{of}, with noise "
        f"σ₁ = {number(noise['sigma'])}{fitted}."
    ]
    return found + [_threshold_sentence(section, side) for side in main["curves"]]


def _threshold_sentence(section: Mapping[str, Any], side: Mapping[str, Any]) -> str:
    if "why_not" in side:
        return f"There is no threshold {side['side']} the standard: {side['why_not']}"
    threshold = side["threshold"]
    share = threshold["over_standard"]
    return (
        f"{whole_percent(threshold['proportion'])} are reached {number(threshold['difference'])} "
        f"{side['side']} the standard, at {number(threshold['level'])} ({section['axis']})"
        + (f", {whole_percent(share)} of it" if share else "")
        + f"; 95 % credible {_interval(threshold['posterior_interval'])} with "
        f"{number(side['trials'])} trials per comparison."
    )


def _with_error(value: float | None, error: float | None) -> str:
    return ABSENT if value is None else f"{fixed(value, 3)} ± {fixed(error, 3)}"


def _interval(ends: Sequence[float | None]) -> str:
    return " … ".join(number(end) for end in ends)


def _thresholds(section: Mapping[str, Any]) -> Table:
    rows = []
    for reading in section["readings"]:
        for side in reading.get("curves") or []:
            if "why_not" in side:
                cells = [titled(reading), side["side"], side["why_not"], "", "", "", "", ""]
            else:
                threshold = side["threshold"]
                cells = [
                    titled(reading),
                    side["side"],
                    number(threshold["level"]),
                    number(threshold["difference"]),
                    _interval(threshold["posterior_interval"]),
                    _interval(threshold["bootstrap_interval"]),
                    ABSENT
                    if threshold["over_standard"] is None
                    else whole_percent(threshold["over_standard"]),
                    number(side["slope"]),
                ]
            rows.append(Row(cells))
    columns = (
        "reading", "side", f"threshold, {section['axis']}", "difference", "95 % credible",
        "95 %, bootstrap", "of the standard", "slope",
    )  # fmt: skip
    note = (
        "Difference: from the standard to the threshold, with intervals of an experiment of as many trials "
        "per comparison as the question says. Slope: of the hit rate there, per unit."
    )
    return Table("Thresholds", columns, rows, note)


def _hit_rates(section: Mapping[str, Any]) -> Table:
    rows = [
        Row(
            (
                titled(reading),
                *(
                    _with_error(mean, spread)
                    for mean, spread in zip(reading["hit_rate"], reading["hit_rate_sd"], strict=True)
                ),
            )
        )
        for reading in section["readings"]
        if reading["hit_rate"] is not None
    ]
    silent = [
        f"{titled(reading)}: none, the population is {why_silent(reading)}"
        for reading in section["readings"]
        if reading["hit_rate"] is None
    ]
    columns = ("reading", *section["stimulus"][1:])
    return Table("Hit rates, mean ± standard deviation", columns, rows, "; ".join(silent))


def _efficiencies(section: Mapping[str, Any]) -> Table:
    rows = [
        Row(
            (
                titled(reading),
                *(
                    _with_error(share, error)
                    for share, error in zip(reading["efficiency"], reading["efficiency_error"], strict=True)
                ),
            )
        )
        for reading in section["readings"]
        if reading.get("efficiency")
    ]
    note = (
        "The share of its trials that the ideal observer would need to judge as well as the code; a dash "
        "where the ideal observer nearly guesses or never fails."
    )
    return Table("Efficiency ± standard error", ("reading", *section["stimulus"][1:]), rows, note)


def _population(section: Mapping[str, Any]) -> Table:
    facts = {key: value for key, value in section["population"].items() if key not in ("positions_mm",)}
    return Table(
        "The population", ("", ""), [Row((tables.spelled(key), plain(value))) for key, value in facts.items()]
    )
