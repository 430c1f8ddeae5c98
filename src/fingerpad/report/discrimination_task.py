"""The page of a discrimination task: thresholds, hit rates, efficiencies and their figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from fingerpad.experiments.discrimination.analysis import ForcedChoice, TaskResult
from fingerpad.experiments.discrimination.decoding import SideCurve
from fingerpad.experiments.discrimination.run import DiscriminationFile
from fingerpad.report.discrimination_task_figures import (
    CODE_LABELS,
    caption_task_curves,
    caption_task_responses,
    caption_task_statistics,
    draw_task_curves,
    draw_task_responses,
    draw_task_statistics,
    main_decoding,
    titled,
    why_silent,
)
from fingerpad.report.formatting import ABSENT, fixed, joined, number, whole_percent
from fingerpad.report.manifest import edition, manifest_chapter
from fingerpad.report.page import write_html
from fingerpad.report.parts import Chapter, Page, Row, Table, illustrated

_PAGE = "discriminate.html"
SEVERAL = {"static": "static rates", "dynamic": "dynamic rates", "latency": "first-spike latencies"}


def task_tables(found: TaskResult) -> list[Table]:
    """Tables of thresholds, hit rates, efficiencies and the population."""
    every = (
        _thresholds(found),
        _hit_rates(found),
        _forced_choices(found),
        _efficiencies(found),
        _population(found),
    )
    return [table for table in every if table.rows]


def write_task_page(results: DiscriminationFile, folder: Path) -> Path:
    """Write the page of a task, `discriminate.html`, and its figures."""
    found = results.discrimination
    parts = illustrated(
        found,
        task_tables,
        (1, "curves", "Hit rates and psychometric curves", draw_task_curves, caption_task_curves),
        (2, "statistics", "Statistics of the codes", draw_task_statistics, caption_task_statistics),
        (3, "responses", "Responses of the population", draw_task_responses, caption_task_responses),
    )
    page = Page(
        found.question,
        "A finite-element fingertip, a population of slowly adapting afferents and an observer, "
        f"after Gerling et al. 2014. {edition(results.manifest)}",
        task_summary(found),
        [Chapter("Results", parts), manifest_chapter(results.manifest)],
    )
    return write_html(page, Path(folder) / _PAGE)


def task_summary(found: TaskResult) -> list[str]:
    """Summarise a task in a few sentences: hit rates of the main decoding, and its thresholds."""
    main, noise = main_decoding(found), found.noise
    assert main.hit_rate is not None
    standard, *others = found.stimulus
    rates = [
        f"{name} from {standard} in {whole_percent(rate)}"
        for name, rate in zip(others, main.hit_rate, strict=True)
    ]
    fitted = f", fitted to {joined(list(noise.fitted_to.stimulus))}" if noise.fitted_to else ""
    of = "" if found.level is None else f" ({found.axis})"
    sentence = (
        f"{CODE_LABELS[main.code]} of {SEVERAL[main.measure]} discriminates {joined(rates)} of trials{of}, "
        f"with noise σ₁ = {number(noise.sigma)}{fitted}."
    )
    choice = main.forced_choice
    answers = [_forced_choice_sentence(found, choice)] if choice and len(others) == 1 else []
    return [sentence, *answers, *(_threshold_sentence(found, side) for side in main.curves)]


def _forced_choice_sentence(found: TaskResult, choice: ForcedChoice) -> str:
    """Say what a two-alternative forced choice between two stimuli would find."""
    standard, comparison = found.stimulus
    rate, low, high = (whole_percent(share) for share in choice.proportions[:, 0])
    d_prime, d_low, d_high = (number(value) for value in choice.d_primes[:, 0])
    return (
        f"In a two-alternative forced choice between {standard} and {comparison} it is correct in {rate} of "
        f"trials ({low} … {high}), d′ = {d_prime} ({d_low} … {d_high}); 95 % intervals of "
        f"{number(choice.trials)} trials."
    )


def _threshold_sentence(found: TaskResult, side: SideCurve) -> str:
    if side.fit is None:
        return f"There is no threshold {side.side} the standard: {side.why_not}"
    threshold = side.fit.threshold
    share = f", {whole_percent(threshold.over_standard)} of it" if threshold.over_standard else ""
    return (
        f"{whole_percent(threshold.proportion)} are reached {number(threshold.difference)} {side.side} the "
        f"standard, at {number(threshold.level)} ({found.axis}){share}; 95 % credible interval "
        f"{_interval(threshold.posterior_interval)} with {number(side.fit.trials)} trials per comparison."
    )


def _with_error(value: float, error: float) -> str:
    return ABSENT if math.isnan(value) else f"{fixed(value, 3)} ± {fixed(error, 3)}"


def _interval(ends: Sequence[float] | None) -> str:
    return ABSENT if ends is None else " … ".join(number(end) for end in ends)


def _thresholds(found: TaskResult) -> Table:
    rows = [
        Row((titled(decoding), side.side, *_threshold_cells(side)))
        for decoding in found.decodings
        for side in decoding.curves
    ]
    columns = (
        "decoding", "side", f"threshold, {found.axis}", "difference", "95 % credible",
        "95 %, bootstrap", "of the standard", "slope",
    )  # fmt: skip
    note = (
        "Difference: from the standard to the threshold. Intervals: of an experiment with the trials per "
        "comparison of the task. Slope: of the hit rate at the threshold, per unit. Where bootstrap "
        "and slope are missing, the curve rises between two comparisons: add some between them."
    )
    return Table("Thresholds", columns, rows, note)


def _threshold_cells(side: SideCurve) -> tuple[str, ...]:
    if side.fit is None:
        return (side.why_not or "", "", "", "", "", "")
    threshold = side.fit.threshold
    share = threshold.over_standard
    return (
        number(threshold.level),
        number(threshold.difference),
        _interval(threshold.posterior_interval),
        _interval(threshold.bootstrap_interval),
        ABSENT if share is None else whole_percent(share),
        ABSENT if math.isnan(side.fit.slope) else number(side.fit.slope),
    )


def _hit_rates(found: TaskResult) -> Table:
    rows = [
        Row((titled(decoding), *map(_with_error, decoding.hit_rate, decoding.hit_rate_sd)))
        for decoding in found.decodings
        if decoding.hit_rate is not None and decoding.hit_rate_sd is not None
    ]
    silent = [
        f"{titled(decoding)}: none, the population is {why_silent(decoding)}"
        for decoding in found.decodings
        if decoding.hit_rate is None
    ]
    columns = ("decoding", *found.stimulus[1:])
    return Table("Hit rates, mean ± standard deviation", columns, rows, "; ".join(silent))


def _forced_choices(found: TaskResult) -> Table:
    rows = []
    for decoding in found.decodings:
        if decoding.forced_choice is None:
            continue
        shares, d_primes = decoding.forced_choice.proportions.T, decoding.forced_choice.d_primes.T
        for name, share, d_prime in zip(found.stimulus[1:], shares, d_primes, strict=True):
            within = (" … ".join(fixed(end, 3) for end in share[1:]), _interval(d_prime[1:]))
            cells = (fixed(share[0], 3), within[0], number(d_prime[0]), within[1])
            rows.append(Row((titled(decoding), name, *cells)))
    columns = ("decoding", "comparison", "proportion correct", "95 %", "d′", "95 %")
    note = (
        "Each trial presents the standard and the comparison once. Intervals: exact, of an experiment with "
        "the trials per comparison of the task. A dash where d′ is infinite."
    )
    return Table("Two-alternative forced choice", columns, rows, note)


def _efficiencies(found: TaskResult) -> Table:
    rows = [
        Row((titled(decoding), *map(_with_error, decoding.efficiency, decoding.efficiency_error)))
        for decoding in found.decodings
        if decoding.efficiency is not None and decoding.efficiency_error is not None
    ]
    note = (
        "The share of its trials that the ideal observer needs to perform as the code does; a dash where d' "
        "of the ideal observer is not known well enough or infinite."
    )
    return Table("Efficiency ± standard error", ("decoding", *found.stimulus[1:]), rows, note)


def _population(found: TaskResult) -> Table:
    population = found.population
    facts = {
        "layout": population.layout,
        "receptors": number(population.n_receptors),
        "pitch [mm]": number(population.pitch_mm),
        "density [1/cm²]": number(population.density_per_cm2),
        "sensitivity": ABSENT
        if population.sensitivity is None
        else f"{number(population.sensitivity.min())} … {number(population.sensitivity.max())}",
    }
    return Table("The population", ("", ""), [Row(fact) for fact in facts.items()])
