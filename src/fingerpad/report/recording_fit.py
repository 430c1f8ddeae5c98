"""The page of a fit to recordings: observed and predicted rates, residuals, parameters and folds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checked import checked
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.values import FloatArray
from fingerpad.experiments.fit.request import FitFile
from fingerpad.experiments.fit.results import FitResult, OffsetFit, PhaseRates, SpikeFitSummary
from fingerpad.report.formatting import (
    ABSENT,
    IDENTIFIABLE_SYMBOLS,
    PARAMETER_SYMBOLS,
    PHASE_LABELS,
    fixed,
    number,
    plain,
)
from fingerpad.report.parts import (
    Chapter,
    Page,
    Row,
    Table,
    edition,
    illustrated,
    listed,
    manifest_chapter,
    write_html,
)
from fingerpad.report.single_unit import draw_indices, draw_profile, profile_ends, sensitivity_table
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, draw_rates, new_figure

IDENTIFIABLE = IDENTIFIABLE_SYMBOLS | {"time_constant_ms": "time constant τ"}
LONGEST_LABEL = 12  # Names of stimuli are cut to so many letters at an axis.


def draw_fit(found: FitResult) -> Figure:
    """Draw observed rates with the prediction fitted to all, and that made without each stimulus."""
    figure = new_figure(10.0, 4.5)
    phases = recorded_phases(found)
    for axes, phase in zip(np.ravel(figure.subplots(1, len(phases))), phases, strict=True):
        draw_phase(axes, found, phase)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def recorded_phases(found: FitResult) -> list[str]:
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
    figure, phases, (where, order) = new_figure(10.0, 4.0), _recorded(found), _places(found)
    panels = np.ravel(figure.subplots(1, len(phases)))
    for axes, (phase, rates, observed_hz) in zip(panels, phases, strict=True):
        left = (observed_hz - rates.fitted_hz)[order]
        left_out = (observed_hz - rates.out_of_sample_hz)[order]
        axes.axhline(0.0, color=GREY, linewidth=1.0)
        axes.vlines(where, 0.0, left, color=BLUE, linewidth=1.2)
        axes.plot(where, left, "o", color=BLUE, markersize=4.0, label="fitted to all")
        axes.plot(where, left_out, "x", color=ORANGE, label="predicted without its fold")
        axes.set(title=f"{PHASE_LABELS[phase]}, observed less predicted", ylabel="residual [spikes/s]")
        _name_places(axes, found)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def caption_fit(found: FitResult) -> str:
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
    spikes = [_spikes(found.spikes)] if found.spikes else []
    return [_scores(found), *spikes, _identifiable(found), _parameters(found), _folds(found), _rates(found)]


def _chapters(found: FitResult) -> list[Chapter]:
    """Return the fit itself, and what was asked for beside it."""
    chapters = [
        Chapter(
            "Fit",
            illustrated(
                found,
                fit_tables,
                (1, "fit", "Observed and predicted rates", draw_fit, caption_fit),
                (2, "residuals", "Residuals", draw_fit_residuals, caption_fit_residuals),
            ),
        )
    ]
    if found.profiles:
        figure = (3, "profiles", "Profile likelihoods", draw_profiles, caption_profiles)
        chapters.append(Chapter("Profile likelihoods", illustrated(found, profile_tables, figure)))
    if found.sensitivity:
        drawn = (4, "sensitivity", "Sobol indices", draw_sensitivity, caption_sensitivity)
        chapters.append(Chapter("Sensitivity of the fit", illustrated(found, sensitivity_tables, drawn)))
    if found.offset:
        shown = (5, "offset", "FSS by offset of the receptor", draw_offset, caption_offset)
        chapters.append(Chapter("Offset of the receptor", illustrated(found, offset_tables, shown)))
    return chapters


@checked
def write_fit_page(results: FitFile, folder: Path) -> Path:
    """Write the page of a fit from `run_fit`, `fit.html`, and its figures; return its path."""
    page = Page(
        "An afferent fitted to recordings",
        "A finite-element fingertip drives a leaky integrate-and-fire afferent, after Gerling et al. 2014: "
        f"its dynamic term follows {_in_words(results.dynamic_quantity)}, its static term "
        f"{_in_words(results.static_quantity)}. {edition(results.manifest)}",
        fit_summary(results.fit),
        [*_chapters(results.fit), manifest_chapter(results.manifest)],
    )
    return write_html(page, Path(folder) / "fit.html")


def _in_words(quantity: str) -> str:
    return "strain energy density" if quantity == STORED_ENERGY else quantity.replace("_", " ")


def fit_summary(found: FitResult) -> list[str]:
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
    cells = {over: fixed(score, 3) for over, score in scores.items()}
    return listed("Fractional sum of squares (FSS)", cells, ("over", "FSS"))


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
    return listed("Fit of a soft threshold to the spikes", {name: number(values[name]) for name in values})


def _identifiable(found: FitResult) -> Table:
    posterior = found.posterior
    rows = [
        Row.of(
            symbol,
            number(found.identifiable[name]),
            number(found.identifiable_standard_error[name]),
            *([" … ".join(number(end) for end in posterior.interval[name])] if posterior else []),
            found.identifiable_units[name],
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
        Row.of(PARAMETER_SYMBOLS[name], number(value), found.units[name])
        for name, value in found.parameters.items()
    ]
    note = "One of the many sets of six with the same firing."
    return Table("The same as parameters of the paper", ("parameter", "fitted", "unit"), rows, note)


def _folds(found: FitResult) -> Table:
    rows = [
        Row.of(
            plain(fold.fold),
            ", ".join(fold.stimuli),
            fixed(fold.fss_train, 3),
            fixed(fold.fss_test, 3),
            *(number(fold.identifiable[name]) for name in IDENTIFIABLE),
            number(fold.n_evaluations),
            fixed(fold.seconds, 2),
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
        Row.of(
            name,
            plain(int(found.fold[row])),
            number(found.presentations[row]) if found.presentations else ABSENT,
            *(
                fixed(value, 1)
                for _, rates, observed_hz in recorded
                for value in (observed_hz[row], rates.fitted_hz[row], rates.out_of_sample_hz[row])
            ),
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


_Part = TypeVar("_Part")


def draw_profiles(found: FitResult) -> Figure:
    figure = new_figure(10.0, 3.2)
    intervals = found.posterior.interval if found.posterior else {}
    panels = figure.subplots(1, len(_present(found.profiles)), sharey=True)
    for axes, profile in zip(panels, _present(found.profiles), strict=True):
        unit, fitted = found.identifiable_units[profile.name], found.identifiable[profile.name]
        draw_profile(axes, profile, unit, fitted, intervals.get(profile.name))
    panels[0].set_ylabel("loss of log likelihood")
    return figure


def caption_profiles(found: FitResult) -> str:
    beneath = ", the bar below it the credible interval" if found.posterior else ""
    return (
        "Loss of log likelihood with one parameter held and the others fitted again. Values below the dashed "
        "line are within the 95 % interval; where the profile does not cross it the rates do not bound the "
        f"parameter. The orange line is the fit{beneath}. The fit maximises FSS, which has other weights of "
        "phases and neighbours than the likelihood, and may differ from the minimum. Profiles have local "
        "minima, because rates are discontinuous where a spike enters a window."
    )


def profile_tables(found: FitResult) -> list[Table]:
    rows = [
        Row.of(
            f"{IDENTIFIABLE_SYMBOLS[profile.name]} [{found.identifiable_units[profile.name]}]",
            number(found.identifiable[profile.name]),
            profile_ends(profile),
        )
        for profile in _present(found.profiles)
    ]
    return [Table("Intervals by profile likelihood", ("number", "fitted", "95 % interval"), rows)]


def draw_sensitivity(found: FitResult) -> Figure:
    figure = new_figure(6.5, 3.8)
    draw_indices(figure.subplots(), _present(found.sensitivity))
    return figure


def caption_sensitivity(found: FitResult) -> str:
    total = _present(found.sensitivity).total
    most = max(zip(total, IDENTIFIABLE_SYMBOLS.values(), strict=True), key=lambda pair: pair[0])[1]
    return (
        "Share of the variance of FSS due to each parameter if all are uniform within a quarter of their "
        f"fitted values: hatched, alone (first-order index); filled, with all interactions (total index). "
        f"Whiskers are 95 % intervals of the estimate. The largest total index is that of {most}."
    )


def sensitivity_tables(found: FitResult) -> list[Table]:
    return [sensitivity_table(_present(found.sensitivity), found.identifiable_units)]


def draw_offset(found: FitResult) -> Figure:
    """Draw the best FSS with the receptor held at each offset, and the offsets of the fit and the folds."""
    offset = _present(found.offset)
    figure = new_figure(6.5, 3.8)
    axes = figure.subplots()
    axes.axvline(0.0, color=GREY, linewidth=1.0)
    axes.plot(offset.held.offset_mm, offset.held.fss_in_sample, "o-", color=BLACK, label="held there")
    axes.plot(
        [offset.offset_mm], [offset.fss_in_sample], "D", color=ORANGE, markersize=7.0, label="fitted to all"
    )
    low = axes.get_ylim()[0]
    ticks: Any = {"color": BLUE, "markersize": 14.0, "markeredgewidth": 2.0, "clip_on": False}
    axes.plot(offset.folds_mm, [low] * len(offset.folds_mm), "|", label="fitted without a fold", **ticks)
    axes.set_ylim(bottom=low)
    axes.set(xlabel="offset of the receptor, distal positive [mm]", ylabel="FSS in sample [1]")
    axes.legend()
    return figure


def caption_offset(found: FitResult) -> str:
    """Caption of the offset: which part of the residual it explains."""
    offset = _present(found.offset)
    residual = 1.0 - found.fss_in_sample
    taken = (offset.fss_in_sample - found.fss_in_sample) / residual if residual > 0.0 else 0.0
    return (
        "The receptor's offset along the finger as one more parameter. Line: best FSS over all stimuli with "
        f"the receptor held at each offset. The fitted offset is {number(offset.offset_mm)} mm; it explains "
        f"{fixed(100.0 * taken, 0)} % of the residual in sample. Out of sample FSS is "
        f"{fixed(offset.fss_out_of_sample, 3)} instead of {fixed(found.fss_out_of_sample, 3)}. A gain in "
        "sample alone is no evidence for an offset."
    )


def offset_tables(found: FitResult) -> list[Table]:
    offset, units, phases = _present(found.offset), found.identifiable_units, ("dynamic", "static")

    def cells(fit: FitResult | OffsetFit, fss_by_phase: Sequence[float | None]) -> list[str]:
        scores = (fit.fss_in_sample, *fss_by_phase, fit.fss_out_of_sample)
        four = (number(fit.identifiable[name]) for name in IDENTIFIABLE_SYMBOLS)
        return [*(fixed(score, 3) for score in scores), *four]

    at_zero = cells(found, [found.phases[phase].fss_in_sample for phase in phases])
    fitted = cells(offset, [offset.fss_by_phase.get(phase) for phase in phases])
    rows = [
        Row.of("at 0 mm", number(0.0), ABSENT, *at_zero),
        Row.of("offset fitted", number(offset.offset_mm), number(offset.standard_error_mm), *fitted),
    ]
    columns = (
        "receptor", "offset [mm]", "standard error [mm]", "FSS, all stimuli", "dynamic", "static",
        "out of sample", *(f"{symbol} [{units[name]}]" for name, symbol in IDENTIFIABLE_SYMBOLS.items()),
    )  # fmt: skip
    note = (
        "Standard error: from the scatter of the folds' fits. Offsets end at "
        f"{number(offset.held.offset_mm[0])} and {number(offset.held.offset_mm[-1])} mm, where the skin was "
        "sampled."
    )
    return [Table("Offset of the receptor", columns, rows, note)]


def _present(part: _Part | None) -> _Part:
    """Return a part of a fit; a chapter is only drawn where its part is there."""
    assert part is not None
    return part
