"""The page of a fit to recordings: observed and predicted rates, residuals, parameters and folds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.core.keywords import known_keywords
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.experiments.fit.results import FitResult, PhaseRates, SpikeFitSummary
from fingerpad.experiments.fit.session import FitFile
from fingerpad.report.formatting import (
    ABSENT,
    IDENTIFIABLE_SYMBOLS,
    PARAMETER_SYMBOLS,
    PHASE_LABELS,
    fixed,
    number,
    plain,
)
from fingerpad.report.manifest import edition, manifest_chapter
from fingerpad.report.page import write_html
from fingerpad.report.parts import Chapter, Page, Row, Table, illustrated
from fingerpad.report.recording_extras import (
    caption_offset,
    caption_profiles,
    caption_sensitivity,
    draw_offset,
    draw_profiles,
    draw_sensitivity,
    offset_tables,
    profile_tables,
    sensitivity_tables,
)
from fingerpad.report.style import BLUE, GREY, ORANGE, draw_rates, new_figure

_PAGE = "fit.html"
IDENTIFIABLE = IDENTIFIABLE_SYMBOLS | {"time_constant_ms": "time constant τ"}
LONGEST_LABEL = 12
"""Names of stimuli are cut to so many letters at an axis."""


def draw_fit(found: FitResult) -> Figure:
    """Draw observed rates with the prediction fitted to all, and that made without each stimulus."""
    figure = new_figure(10.0, 4.5)
    phases = recorded_phases(found)
    for axes, phase in zip(np.ravel(figure.subplots(1, len(phases))), phases, strict=True):
        draw_phase(axes, found, phase)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def recorded_phases(found: FitResult) -> list[str]:
    """Names of the phases whose rates were recorded."""
    return [phase for phase, *_ in _recorded(found)]


def draw_phase(axes: Axes, found: FitResult, phase: str) -> None:
    """Draw the observed rates of one phase, the fitted ones, and those predicted without each fold."""
    where, order = _places(found)
    rates, observed_hz = next((rates, hz) for name, rates, hz in _recorded(found) if name == phase)
    if found.posterior and phase in found.posterior.bands:
        band = found.posterior.bands[phase].predicted
        label = f"{found.posterior.level:.0%} credible"
        axes.fill_between(
            where, band.low_hz[order], band.high_hz[order], color=BLUE, alpha=0.2, linewidth=0.0, label=label
        )
    without = rates.out_of_sample_hz[order]
    axes.plot(where, without, "x", color=ORANGE, zorder=3, label="predicted without its fold")
    # Stimuli without a place on an axis have no order: no line joins them.
    has_axis = found.shift_mm is not None
    draw_rates(axes, where, rates.fitted_hz[order], observed_hz[order], "fitted to all", line=has_axis)
    axes.set_title(f"{PHASE_LABELS[phase]}, FSS = {rates.fss_in_sample:.2f}")
    _name_places(axes, found)


def draw_fit_residuals(found: FitResult) -> Figure:
    """Draw the residuals: observed less predicted rates, in and out of sample."""
    figure = new_figure(10.0, 4.0)
    phases = _recorded(found)
    where, order = _places(found)
    for axes, (phase, rates, observed_hz) in zip(
        np.ravel(figure.subplots(1, len(phases))), phases, strict=True
    ):
        observed = observed_hz[order]
        left = observed - rates.fitted_hz[order]
        left_out = observed - rates.out_of_sample_hz[order]
        axes.axhline(0.0, color=GREY, linewidth=1.0)
        axes.vlines(where, 0.0, left, color=BLUE, linewidth=1.2)
        axes.plot(where, left, "o", color=BLUE, markersize=4.0, label="fitted to all")
        axes.plot(where, left_out, "x", color=ORANGE, label="predicted without its fold")
        axes.set_title(f"{PHASE_LABELS[phase]}, observed less predicted")
        axes.set_ylabel("residual [spikes/s]")
        _name_places(axes, found)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def caption_fit(found: FitResult) -> str:
    """Caption of the rates."""
    return (
        "Firing rates of the recorded afferent under each stimulus, mean of its presentations. Line: the "
        "afferent fitted to all stimuli. Crosses: each stimulus predicted by the fit that did not use its "
        f"fold; over them the fractional sum of squares is {fixed(found.fss_out_of_sample, 2)}, mean of "
        f"{len(found.folds)} folds."
    )


def caption_fit_residuals(found: FitResult) -> str:
    worst = []
    for phase, rates, observed_hz in _recorded(found):
        residual = observed_hz - rates.out_of_sample_hz
        row = int(np.argmax(np.abs(residual)))
        worst.append(f"{PHASE_LABELS[phase]} under {found.stimulus[row]}: {number(residual[row])}")
    return (
        "Where adjacent residuals have the same sign, the misfit is systematic and not noise. "
        f"Largest residuals out of sample [spikes/s]: {'; '.join(worst)}."
    )


def fit_tables(found: FitResult) -> list[Table]:
    """Return scores, parameters in both forms, folds and rates."""
    spikes = [_spikes(found.spikes)] if found.spikes else []
    return [
        _scores(found),
        *spikes,
        _identifiable(found),
        _parameters(found),
        _folds(found),
        _rates(found),
    ]


def _chapters(found: FitResult) -> list[Chapter]:
    """Return the fit itself, and what was asked for beside it."""
    chapters = {
        "Fit": illustrated(
            found,
            fit_tables,
            (1, "fit", "Observed and predicted rates", draw_fit, caption_fit),
            (2, "residuals", "Residuals", draw_fit_residuals, caption_fit_residuals),
        ),
        "Profile likelihoods": illustrated(
            found if found.profiles else None,
            profile_tables,
            (3, "profiles", "Profile likelihoods", draw_profiles, caption_profiles),
        ),
        "Sensitivity of the fit": illustrated(
            found if found.sensitivity else None,
            sensitivity_tables,
            (4, "sensitivity", "Sobol indices", draw_sensitivity, caption_sensitivity),
        ),
        "Offset of the receptor": illustrated(
            found if found.offset else None,
            offset_tables,
            (5, "offset", "FSS by offset of the receptor", draw_offset, caption_offset),
        ),
    }
    return [Chapter(title, parts) for title, parts in chapters.items() if parts]


@known_keywords
def write_fit_page(results: FitFile, folder: Path) -> Path:
    """Write the page of a fit, `fit.html`, and its figures.

    Parameters
    ----------
    results : FitFile
        From `run_fit`.
    folder : Path
        Where; made if needed.

    Returns
    -------
    Path
        The page.
    """
    page = Page(
        "An afferent fitted to recordings",
        "A finite-element fingertip drives a leaky integrate-and-fire afferent, after Gerling et al. 2014: "
        f"its dynamic term follows {_in_words(results.dynamic_quantity)}, its static term "
        f"{_in_words(results.static_quantity)}. {edition(results.manifest)}",
        fit_summary(results.fit),
        [*_chapters(results.fit), manifest_chapter(results.manifest)],
    )
    return write_html(page, Path(folder) / _PAGE)


def _in_words(quantity: str) -> str:
    return "strain energy density" if quantity == STORED_ENERGY else quantity.replace("_", " ")


def fit_summary(found: FitResult) -> list[str]:
    """Summarise a fit in a few sentences."""
    method = found.method.replace("_", " ")
    said = [
        f"Fitted to {len(found.stimulus)} stimuli by {method}: FSS {fixed(found.fss_in_sample, 3)} in "
        f"sample, {fixed(found.fss_out_of_sample, 3)} out of sample (mean of {len(found.folds)} folds)."
    ]
    if found.identifiable_covariance is None:
        said.append(
            "No standard errors are given: they come from the scatter of the folds' fits, and four numbers "
            "need five folds or more."
        )
    return said


def _recorded(found: FitResult) -> list[tuple[str, PhaseRates, FloatArray]]:
    """Phases that were recorded, with their rates and what was observed. [spikes/s]"""
    return [
        (phase, found.phases[phase], observed_hz)
        for phase in PHASE_LABELS
        if (observed_hz := found.phases[phase].observed_hz) is not None
    ]


def _places(found: FitResult) -> tuple[FloatArray, np.ndarray]:
    """Where each stimulus stands along an axis, and the order of the stimuli from left to right."""
    places = np.arange(len(found.stimulus), dtype=np.float64) if found.shift_mm is None else -found.shift_mm
    order = np.argsort(places, kind="stable")
    return places[order], order


def _name_places(axes: Axes, found: FitResult) -> None:
    if found.shift_mm is not None:
        axes.set_xlabel("shift, distal [mm]")
        return
    names = [name[:LONGEST_LABEL] for name in found.stimulus]
    axes.set_xticks(range(len(names)), names, rotation=90)
    axes.set_xlabel("stimulus")


def _scores(found: FitResult) -> Table:
    scores = {
        "stimuli not fitted to, mean of the folds": found.fss_out_of_sample,
        "training sets, mean of the folds": found.fss_training_mean,
        "all stimuli": found.fss_in_sample,
        "all stimuli, dynamic rates": found.phases["dynamic"].fss_in_sample,
        "all stimuli, static rates": found.phases["static"].fss_in_sample,
    }
    rows = [Row((over, fixed(score, 3))) for over, score in scores.items()]
    return Table("Fractional sum of squares (FSS)", ("over", "FSS"), rows)


def _spikes(found: SpikeFitSummary) -> Table:
    values = {
        "spikes": found.n_spikes,
        "log likelihood of all": found.log_likelihood,
        "log likelihood of each fold, fitted without it": found.log_likelihood_out_of_sample,
        "width of the threshold over the threshold": found.escape_width,
        "its standard error": found.escape_width_standard_error,
        "Kolmogorov-Smirnov distance of rescaled intervals": found.time_rescaling_distance,
        "probability of a larger distance": found.time_rescaling_p_value,
    }
    rows = [Row((name, number(value))) for name, value in values.items()]
    return Table("Fit of a soft threshold to the spikes", ("", ""), rows)


def _identifiable(found: FitResult) -> Table:
    posterior = found.posterior
    rows = [
        Row(
            (
                symbol,
                number(found.identifiable[name]),
                number(found.identifiable_standard_error[name]),
                *([" … ".join(number(end) for end in posterior.interval[name])] if posterior else []),
                found.identifiable_units[name],
            )
        )
        for name, symbol in IDENTIFIABLE.items()
    ]
    note = (
        "All that spikes identify: gains, capacitance C and threshold v are known only up to a common scale. "
        "Standard errors come from the scatter of the folds' fits (jackknife), or from the information in "
        "spikes."
    )
    credible = [f"{posterior.level:.0%} credible"] if posterior else []
    columns = ("", "fitted", "standard error", *credible, "unit")
    return Table("The four identifiable numbers", columns, rows, note)


def _parameters(found: FitResult) -> Table:
    rows = [
        Row((PARAMETER_SYMBOLS[name], number(value), found.units[name]))
        for name, value in found.parameters.items()
    ]
    note = "One of the many sets of six with the same firing."
    return Table("The same as parameters of the paper", ("parameter", "fitted", "unit"), rows, note)


def _folds(found: FitResult) -> Table:
    rows = [
        Row(
            (
                plain(fold.fold),
                ", ".join(fold.stimuli),
                fixed(fold.fss_train, 3),
                fixed(fold.fss_test, 3),
                *(number(fold.identifiable[name]) for name in IDENTIFIABLE),
                number(fold.n_evaluations),
                fixed(fold.seconds, 2),
            )
        )
        for fold in found.folds
    ]
    headings = (f"{symbol} [{found.identifiable_units[name]}]" for name, symbol in IDENTIFIABLE.items())
    columns = (
        "fold", "stimuli kept for testing", "FSS, training", "FSS, testing", *headings, "evaluations",
        "time [s]",
    )  # fmt: skip
    return Table("Folds of the cross-validation", columns, rows)


def _rates(found: FitResult) -> Table:
    recorded = _recorded(found)
    rows = [
        Row(
            (
                name,
                plain(int(found.fold[row])),
                number(found.presentations[row]) if found.presentations else ABSENT,
                *(
                    fixed(value, 1)
                    for _, rates, observed_hz in recorded
                    for value in (observed_hz[row], rates.fitted_hz[row], rates.out_of_sample_hz[row])
                ),
            )
        )
        for row, name in enumerate(found.stimulus)
    ]
    headings = (
        f"{phase}, {what}"
        for phase, _, _ in recorded
        for what in ("observed", "fitted to all", "without its fold")
    )
    columns = ("stimulus", "fold", "presentations", *headings)
    return Table("Rates [spikes/s]", columns, rows)
