"""A fit to recordings of one's own: observed and predicted rates, residuals, and one page about them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.report import recording_extras
from fingerpad.report.formatting import ABSENT, IDENTIFIABLE_SYMBOLS, PHASES, fixed, number, plain
from fingerpad.report.manifest import manifest_chapter
from fingerpad.report.page import write_html
from fingerpad.report.parts import Chapter, Drawing, Page, Row, Table
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, new_figure, numbers
from fingerpad.report.tables import PARAMETERS

PAGE = "fit.html"
IDENTIFIABLE = IDENTIFIABLE_SYMBOLS | {"time_constant_ms": "time constant τ"}
LONGEST_LABEL = 12
"""Names of stimuli are cut to so many letters at an axis."""


def draw(section: dict[str, Any]) -> Figure:
    """Draw observed rates with the prediction fitted to all, and that made without each stimulus.

    Parameters
    ----------
    section : dict
        `results["fit"]` of `studies.recording_fit.run`, or what `fit_recordings` returns.

    Returns
    -------
    Figure
    """
    figure = new_figure(10.0, 4.5)
    phases = _recorded(section)
    where, order = _places(section)
    for axes, phase in zip(np.ravel(figure.subplots(1, len(phases))), phases, strict=True):
        band = ((section["posterior"] or {}).get("bands") or {}).get(phase)
        if band:
            low, high = (numbers(band["predicted"][end])[order] for end in ("low_hz", "high_hz"))
            label = f"{section['posterior']['level']:.0%} credible"
            axes.fill_between(where, low, high, color=BLUE, alpha=0.2, linewidth=0.0, label=label)
        axes.plot(where, numbers(section[f"{phase}_rate_hz"])[order], color=BLUE, label="fitted to all")
        axes.plot(
            where,
            numbers(section[f"out_of_sample_{phase}_rate_hz"])[order],
            "x",
            color=ORANGE,
            label="predicted without its fold",
        )
        axes.plot(
            where,
            numbers(section[f"observed_{phase}_rate_hz"])[order],
            "o",
            color=BLACK,
            markerfacecolor="none",
            markersize=5.0,
            label="observed",
        )
        axes.set_title(f"{PHASES[phase]}, FSS = {section[f'fss_in_sample_{phase}']:.2f}")
        axes.set_ylabel("firing rate [spikes/s]")
        axes.set_ylim(bottom=0.0)
        _name_places(axes, section)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def draw_residuals(section: dict[str, Any]) -> Figure:
    """Draw what the predictions miss: observed less predicted rates, in and out of sample.

    Parameters
    ----------
    section : dict
        As in `draw`.

    Returns
    -------
    Figure
    """
    figure = new_figure(10.0, 4.0)
    phases = _recorded(section)
    where, order = _places(section)
    for axes, phase in zip(np.ravel(figure.subplots(1, len(phases))), phases, strict=True):
        observed = numbers(section[f"observed_{phase}_rate_hz"])[order]
        left = observed - numbers(section[f"{phase}_rate_hz"])[order]
        left_out = observed - numbers(section[f"out_of_sample_{phase}_rate_hz"])[order]
        axes.axhline(0.0, color=GREY, linewidth=1.0)
        axes.vlines(where, 0.0, left, color=BLUE, linewidth=1.2)
        axes.plot(where, left, "o", color=BLUE, markersize=4.0, label="fitted to all")
        axes.plot(where, left_out, "x", color=ORANGE, label="predicted without its fold")
        axes.set_title(f"{PHASES[phase]}, observed less predicted")
        axes.set_ylabel("residual [spikes/s]")
        _name_places(axes, section)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def caption(section: Mapping[str, Any]) -> str:
    """Say what the first figure shows."""
    return (
        "Firing rates of the recorded afferent under each stimulus, mean of its presentations. Line: the "
        "afferent fitted to all stimuli. Crosses: each stimulus predicted by the fit that did not use its "
        f"fold; over them the fractional sum of squares is {fixed(section['fss_out_of_sample'], 2)}, mean of "
        f"{len(section['folds'])} folds."
    )


def caption_residuals(section: Mapping[str, Any]) -> str:
    """Say what the second figure shows."""
    worst = {
        phase: max(
            zip(section["stimulus"], _misses(section, phase), strict=True), key=lambda pair: abs(pair[1])
        )
        for phase in _recorded(section)
    }
    said = "; ".join(f"{PHASES[phase]}: {name}, {number(miss)}" for phase, (name, miss) in worst.items())
    return (
        "What the predictions miss. Where neighbours lie on one side of zero, the model lacks something that "
        f"noise does not explain. Largest misses out of sample [spikes/s]: {said}."
    )


def fit_tables(section: Mapping[str, Any]) -> list[Table]:
    """Return scores, parameters in both forms, folds and rates."""
    spikes = [_spikes(section["spikes"])] if section["spikes"] else []
    return [
        _scores(section),
        *spikes,
        _identifiable(section),
        _parameters(section),
        _folds(section),
        _rates(section),
    ]


def _chapters(section: dict[str, Any]) -> list[Chapter]:
    """Return the fit itself, and what was asked for beside it."""
    fitted = [
        Drawing("fit", "Observed and predicted rates", partial(draw, section), caption(section), 1),
        Drawing("residuals", "Residuals", partial(draw_residuals, section), caption_residuals(section), 2),
    ]
    chapters = [Chapter("The fit", [*fitted, *fit_tables(section)])]
    for key, chapter, title, draw_it, caption_of, tables_of in (
        (
            "profiles",
            "How far each number may move",
            "Profile likelihoods",
            recording_extras.draw_profiles,
            recording_extras.caption_profiles,
            recording_extras.profile_tables,
        ),
        (
            "sensitivity",
            "What the fit is sensitive to",
            "Sobol's indices",
            recording_extras.draw_sensitivity,
            recording_extras.caption_sensitivity,
            recording_extras.sensitivity_tables,
        ),
        (
            "offset",
            "The place of the receptor",
            "A receptor beside its place",
            recording_extras.draw_offset,
            recording_extras.caption_offset,
            recording_extras.offset_tables,
        ),
    ):
        if section.get(key):
            drawing = Drawing(
                key, title, partial(draw_it, section), caption_of(section), len(chapters) + len(fitted)
            )
            chapters.append(Chapter(chapter, [drawing, *tables_of(section)]))
    return chapters


def write_fit_page(results: Mapping[str, Any], folder: Path) -> Path:
    """Write the page of a fit, `fit.html`, and its figures.

    Parameters
    ----------
    results : mapping
        What `studies.recording_fit.run` returns.
    folder : Path
        Where; made if needed.

    Returns
    -------
    Path
        The page.
    """
    page = Page(
        "An afferent fitted to recordings",
        "Strain energy density in a finite-element fingertip drives a leaky integrate-and-fire "
        "afferent, after Gerling et al. 2014.",
        summary(results["fit"]),
        [*_chapters(results["fit"]), manifest_chapter(results["manifest"])],
    )
    return write_html(page, Path(folder) / PAGE)


def summary(section: Mapping[str, Any]) -> list[str]:
    """Return what was found, in a few sentences.

    Examples
    --------
    >>> summary({
    ...     "method": "response_surface", "stimulus": ["a", "b"], "folds": [{}, {}],
    ...     "fss_in_sample": 0.9, "fss_out_of_sample": 0.8, "identifiable_covariance": None,
    ... })[0]
    'Fitted to 2 stimuli by response surface: FSS 0.900 in sample, 0.800 out of sample (mean of 2 folds).'
    """
    method = section["method"].replace("_", " ")
    found = [
        f"Fitted to {len(section['stimulus'])} stimuli by {method}: FSS "
        f"{fixed(section['fss_in_sample'], 3)} in sample, {fixed(section['fss_out_of_sample'], 3)} out of "
        f"sample (mean of {len(section['folds'])} folds)."
    ]
    if section["identifiable_covariance"] is None:
        found.append(
            "No standard errors are given: they come from the scatter of the folds' fits, and four numbers "
            "need five folds or more."
        )
    return found


def _recorded(section: Mapping[str, Any]) -> list[str]:
    return [phase for phase in PHASES if section[f"observed_{phase}_rate_hz"] is not None]


def _misses(section: Mapping[str, Any], phase: str) -> FloatArray:
    return numbers(section[f"observed_{phase}_rate_hz"]) - numbers(section[f"out_of_sample_{phase}_rate_hz"])


def _places(section: Mapping[str, Any]) -> tuple[FloatArray, np.ndarray]:
    """Where each stimulus stands along an axis, and the order of the stimuli from left to right."""
    shifts = section.get("shift_mm")
    places = np.arange(len(section["stimulus"]), dtype=np.float64) if shifts is None else numbers(shifts)
    order = np.argsort(places, kind="stable")
    return places[order], order


def _name_places(axes: Axes, section: Mapping[str, Any]) -> None:
    if section.get("shift_mm") is not None:
        axes.set_xlabel("shift, proximal positive [mm]")
        return
    names = [name[:LONGEST_LABEL] for name in section["stimulus"]]
    axes.set_xticks(range(len(names)), names, rotation=90)
    axes.set_xlabel("stimulus")


def _scores(section: Mapping[str, Any]) -> Table:
    names = {
        "fss_out_of_sample": "stimuli not fitted to, mean of the folds",
        "fss_training_mean": "training sets, mean of the folds",
        "fss_in_sample": "all stimuli",
        "fss_in_sample_dynamic": "all stimuli, dynamic rates",
        "fss_in_sample_static": "all stimuli, static rates",
    }
    rows = [Row((said, fixed(section[key], 3))) for key, said in names.items()]
    return Table("Fractional sum of squares (FSS)", ("over", "FSS"), rows)


def _spikes(told: Mapping[str, Any]) -> Table:
    names = {
        "n_spikes": "spikes",
        "log_likelihood": "log likelihood of all",
        "log_likelihood_out_of_sample": "log likelihood of each fold, fitted without it",
        "escape_width": "width of the threshold over the threshold",
        "escape_width_standard_error": "its standard error",
        "time_rescaling_distance": "Kolmogorov-Smirnov distance of rescaled intervals",
        "time_rescaling_p_value": "chance of a larger distance",
    }
    rows = [Row((said, number(told[key]))) for key, said in names.items()]
    return Table("What the spikes tell of a soft threshold", ("", ""), rows)


def _identifiable(section: Mapping[str, Any]) -> Table:
    units, errors = section["identifiable_units"], section["identifiable_standard_error"]
    intervals = (section["posterior"] or {}).get("interval")
    rows = [
        Row(
            (
                said,
                number(section["identifiable"][name]),
                number(errors[name]),
                *([" … ".join(number(end) for end in intervals[name])] if intervals else []),
                units[name],
            )
        )
        for name, said in IDENTIFIABLE.items()
    ]
    note = (
        "All that spikes can tell: gains, capacitance C and threshold v are known only up to a common scale. "
        "Standard errors come from the scatter of the folds' fits (jackknife), or from the information in "
        "spikes."
    )
    credible = [f"{section['posterior']['level']:.0%} credible"] if intervals else []
    columns = ("", "fitted", "standard error", *credible, "unit")
    return Table("The four numbers that are determined", columns, rows, note)


def _parameters(section: Mapping[str, Any]) -> Table:
    rows = [
        Row((PARAMETERS[name], number(value), section["units"][name]))
        for name, value in section["parameters"].items()
    ]
    note = "One of the many sets of six that fire alike."
    return Table("The same as parameters of the paper", ("parameter", "fitted", "unit"), rows, note)


def _folds(section: Mapping[str, Any]) -> Table:
    rows = [
        Row(
            (
                plain(fold["fold"]),
                ", ".join(fold["stimuli"]),
                fixed(fold["fss_train"], 3),
                fixed(fold["fss_test"], 3),
                *(number(fold["identifiable"][name]) for name in IDENTIFIABLE),
                number(fold["n_evaluations"]),
                fixed(fold["seconds"], 2),
            )
        )
        for fold in section["folds"]
    ]
    units = section["identifiable_units"]
    headings = (f"{said} [{units[name]}]" for name, said in IDENTIFIABLE.items())
    columns = (
        "fold", "stimuli kept for testing", "FSS, training", "FSS, testing", *headings, "evaluations",
        "time [s]",
    )  # fmt: skip
    return Table("Folds of the cross-validation", columns, rows)


def _rates(section: Mapping[str, Any]) -> Table:
    phases = _recorded(section)
    presentations = section.get("presentations")
    rows = [
        Row(
            (
                name,
                plain(section["fold"][row]),
                number(presentations[row]) if presentations else ABSENT,
                *_rates_of(section, phases, row),
            )
        )
        for row, name in enumerate(section["stimulus"])
    ]
    headings = (
        f"{phase}, {what}" for phase in phases for what in ("observed", "fitted to all", "without its fold")
    )
    columns = ("stimulus", "fold", "presentations", *headings)
    return Table("Rates [spikes/s]", columns, rows)


def _rates_of(section: Mapping[str, Any], phases: Sequence[str], row: int) -> list[str]:
    return [
        fixed(section[f"{kind}{phase}_rate_hz"][row], 1)
        for phase in phases
        for kind in ("observed_", "", "out_of_sample_")
    ]
