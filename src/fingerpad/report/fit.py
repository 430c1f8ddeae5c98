"""The page of a fit to recordings, and Figure 11: what rates determine of one afferent."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checked import checked
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.units import gain_unit, unit_of
from fingerpad.core.values import FloatArray
from fingerpad.data import protocol
from fingerpad.experiments.fit.request import FitFile
from fingerpad.experiments.fit.results import (
    FitResult,
    FssSensitivity,
    ParameterProfile,
    PhaseRates,
    UncertaintyResult,
)
from fingerpad.report.nerve import ALONG
from fingerpad.report.page import both, figure, write_result_page
from fingerpad.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREY,
    ORANGE,
    PALE,
    draw_rates,
    fill_band,
    new_figure,
    shared_legend,
)
from fingerpad.report.tables import (
    ABSENT,
    IDENTIFIABLE_SYMBOLS,
    PARAMETER_SYMBOLS,
    PHASE_LABELS,
    Column,
    Row,
    Table,
    fixed,
    listed,
    number,
    span,
    table,
    whole_percent,
    with_error,
)

LONGEST_LABEL = 12  # Names of stimuli are cut to so many letters at an axis.
LARGEST_LOSS = 5.0  # Losses of log likelihood that are drawn.
ALLOWED_LOSS = 1.92  # Loss at the ends of a 95 % interval: half the quantile of chi-square, 1 degree.


@checked
def write_fit_page(results: FitFile, folder: Path) -> Path:
    """Write the page of a fit from `run_fit`, `fit.html`, and its figures; return its path."""
    terms = (
        "strain energy density" if quantity == STORED_ENERGY else quantity.replace("_", " ")
        for quantity in (results.dynamic_quantity, results.static_quantity)
    )
    about = (
        "A finite-element fingertip drives a leaky integrate-and-fire afferent, after Gerling et al. 2014: "
        f"its dynamic term follows {next(terms)}, its static term {next(terms)}."
    )
    heading, said = "An afferent fitted to recordings", fit_summary(results.fit)
    return write_result_page("fit", results.fit, heading, about, said, results.manifest, folder)


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


def recorded(found: FitResult) -> dict[str, tuple[PhaseRates, FloatArray]]:
    """Phases that were recorded, with their rates and what was observed. [spikes/s]"""
    phases = ((phase, found.phases[phase]) for phase in PHASE_LABELS)
    return {
        phase: (rates, rates.observed_hz) for phase, rates in phases if rates.observed_hz is not None
    }  # fmt: skip


def _places(found: FitResult) -> tuple[FloatArray, np.ndarray]:
    """Where each stimulus stands along an axis, and the order of the stimuli from left to right."""
    places = np.arange(len(found.stimulus), dtype=np.float64) if found.shift_mm is None else -found.shift_mm
    order = np.argsort(places, kind="stable")
    return places[order], order


def _name_places(axes: Axes, found: FitResult) -> None:
    axes.set_xlabel("stimulus" if found.shift_mm is None else "shift, distal [mm]")
    if found.shift_mm is None:
        names = [name[:LONGEST_LABEL] for name in found.stimulus]
        axes.set_xticks(range(len(names)), names, rotation=90)


CAPTION_FIT = (
    "Firing rates of the recorded afferent under each stimulus, mean of its presentations. Line: the "
    "afferent fitted to all stimuli. Crosses: each stimulus predicted by the fit that did not use its "
    "fold; over them the fractional sum of squares is {fss_out_of_sample:2}, mean of "
    "{folds:n} folds."
)


@figure("fit", "Fit", 1, "fit", "Observed and predicted rates", CAPTION_FIT)
def draw_fit(found: FitResult) -> Figure:
    drawn, phases = new_figure(10.0, 4.5), recorded(found)
    for axes, phase in zip(np.ravel(drawn.subplots(1, len(phases))), phases, strict=True):
        draw_phase(axes, found, phase)
    shared_legend(drawn, [axes], columns=4)
    return drawn


def draw_phase(axes: Axes, found: FitResult, phase: str) -> None:
    """Draw the observed rates of one phase, the fitted ones, and those predicted without each fold."""
    where, order = _places(found)
    rates, observed_hz = recorded(found)[phase]
    if found.posterior and phase in found.posterior.bands:
        band, label = found.posterior.bands[phase].predicted, f"{found.posterior.level:.0%} credible"
        fill_band(axes, where, band.low_hz[order], band.high_hz[order], BLUE, 0.2, label)
    without = rates.out_of_sample_hz[order]
    axes.plot(where, without, "x", color=ORANGE, zorder=3, label="predicted without its fold")
    # Stimuli without a place on an axis have no order: no line joins them.
    has_axis = found.shift_mm is not None
    draw_rates(axes, where, rates.fitted_hz[order], observed_hz[order], "fitted to all", line=has_axis)
    axes.set_title(f"{PHASE_LABELS[phase]}, FSS = {rates.fss_in_sample:.2f}")
    _name_places(axes, found)


def caption_fit_residuals(found: FitResult) -> str:
    worst = []
    for phase, (rates, observed_hz) in recorded(found).items():
        residual = observed_hz - rates.out_of_sample_hz
        row = int(np.argmax(np.abs(residual)))
        worst.append(f"{PHASE_LABELS[phase]} under {found.stimulus[row]}: {number(residual[row])}")
    return (
        "Where adjacent residuals have the same sign, the misfit is systematic and not noise. "
        f"Largest residuals out of sample [spikes/s]: {'; '.join(worst)}."
    )


def fit_tables(found: FitResult) -> list[Table]:
    """Return scores, the spikes where they were fitted, both sets of parameters, folds and rates."""
    phases, spikes, posterior, units = found.phases, found.spikes, found.posterior, found.identifiable_units
    scores = {
        "stimuli not fitted to, mean of the folds": found.fss_out_of_sample,
        "training sets, mean of the folds": found.fss_training_mean,
        "all stimuli": found.fss_in_sample,
        "all stimuli, dynamic rates": phases["dynamic"].fss_in_sample,
        "all stimuli, static rates": phases["static"].fss_in_sample,
    }
    likelihood = spikes and {
        "spikes": spikes.n_spikes,
        "log likelihood of all": spikes.log_likelihood,
        "log likelihood of each fold, fitted without it": spikes.log_likelihood_out_of_sample,
        "width of the threshold over the threshold": spikes.escape_width,
        "its standard error": spikes.escape_width_standard_error,
        "Kolmogorov-Smirnov distance of rescaled intervals": spikes.time_rescaling_distance,
        "probability of a larger distance": spikes.time_rescaling_p_value,
    }
    symbols = IDENTIFIABLE_SYMBOLS | {"time_constant_ms": "time constant τ"}
    heading = f"{posterior.level:.0%} credible" if posterior else ""
    credible = [Column(posterior.interval.get, heading, span)] if posterior else []
    rates = [
        (f"{phase}, {what}", values)
        for phase, (each, observed_hz) in recorded(found).items()
        for what, values in (
            ("observed", observed_hz), ("fitted to all", each.fitted_hz),
            ("without its fold", each.out_of_sample_hz),
        )
    ]  # fmt: skip
    presentations = found.presentations or [None] * len(found.stimulus)
    stimuli = zip(
        found.stimulus, found.fold.tolist(), presentations, *(values for _, values in rates), strict=True
    )
    return [
        listed("Fractional sum of squares (FSS)", scores, ("over", "FSS"), form=3),
        *([listed("Fit of a soft threshold to the spikes", likelihood)] if likelihood else []),
        table(
            "The four identifiable numbers", symbols,
            [
                Column(symbols.get, ""), Column(found.identifiable.get, "fitted"),
                Column(found.identifiable_standard_error.get, "standard error"),
                *credible,
                Column(units.get, "unit"),
            ],
            "All that spikes identify: gains, capacitance C and threshold v are known only up to a common "
            "scale. Standard errors come from the scatter of the folds' fits (jackknife), or from the "
            "information in spikes.",
        ),
        table(
            "The same as parameters of the paper", found.parameters,
            (
                Column(PARAMETER_SYMBOLS.get, "parameter"), Column(found.parameters.get, "fitted"),
                Column(found.units.get, "unit"),
            ),
            "One of the many sets of six with the same firing.",
        ),
        table(
            "Folds of the cross-validation", found.folds,
            [
                Column("fold"), Column("stimuli", "stimuli kept for testing", ", ".join),
                Column("fss_train", "FSS, training", 3), Column("fss_test", "FSS, testing", 3),
                *_columns_of_four("identifiable", symbols, units),
                Column("n_evaluations", "evaluations"), Column("seconds", "time [s]", 2),
            ],
        ),
        table(
            "Rates [spikes/s]", stimuli,
            [
                Column("0", "stimulus"), Column("1", "fold"), Column("2", "presentations"),
                *(Column(str(place), name, 1) for place, (name, _) in enumerate(rates, start=3)),
            ],
        ),
    ]  # fmt: skip


def _columns_of_four(path: str, symbols: Mapping[str, str], units: Mapping[str, str]) -> list[Column]:
    return [Column(f"{path}.{name}", f"{symbol} [{units[name]}]") for name, symbol in symbols.items()]


@figure("fit", "Fit", 2, "residuals", "Residuals", caption_fit_residuals, tables=fit_tables)
def draw_fit_residuals(found: FitResult) -> Figure:
    drawn, phases, (where, order) = new_figure(10.0, 4.0), recorded(found), _places(found)
    panels = np.ravel(drawn.subplots(1, len(phases)))
    for axes, (phase, (rates, observed_hz)) in zip(panels, phases.items(), strict=True):
        left = (observed_hz - rates.fitted_hz)[order]
        left_out = (observed_hz - rates.out_of_sample_hz)[order]
        axes.axhline(0.0, color=GREY, linewidth=1.0)
        axes.vlines(where, 0.0, left, color=BLUE, linewidth=1.2)
        axes.plot(where, left, "o", color=BLUE, markersize=4.0, label="fitted to all")
        axes.plot(where, left_out, "x", color=ORANGE, label="predicted without its fold")
        axes.set(title=f"{PHASE_LABELS[phase]}, observed less predicted", ylabel="residual [spikes/s]")
        _name_places(axes, found)
    shared_legend(drawn, [axes], columns=2)
    return drawn


def draw_profile(
    axes: Axes, profile: ParameterProfile, unit: str, fitted: float, credible: tuple[float, float] | None
) -> None:
    """Draw one profile: its points, the level of the interval, the fit, the posterior's interval."""
    axes.plot(profile.values, profile.losses, ".-", color=BLACK, linewidth=1.2)
    axes.axhline(ALLOWED_LOSS, color=GREY, linestyle="--", linewidth=1.0)
    axes.axvline(fitted, color=ORANGE, linestyle="-.", linewidth=1.4)
    if credible is not None:
        axes.plot(credible, [-0.25, -0.25], color=BLUE, linewidth=4.0, solid_capstyle="butt")
    axes.set(ylim=(-0.5, LARGEST_LOSS), xlabel=f"{IDENTIFIABLE_SYMBOLS[profile.name]} [{unit}]")


def profile_ends(profile: ParameterProfile) -> str:
    """Return the interval of a profile as text; an end that the rates do not set is open."""
    return span((profile.low, profile.high), "open")


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
    symbols = {
        name: f"{IDENTIFIABLE_SYMBOLS[name]} [{unit}]" for name, unit in found.identifiable_units.items()
    }
    ends = {profile.name: profile_ends(profile) for profile in found.profiles or ()}
    columns = (
        Column(symbols.get, "number"), Column(found.identifiable.get, "fitted"),
        Column(ends.get, "95 % interval"),
    )  # fmt: skip
    return [table("Intervals by profile likelihood", ends, columns)]


@figure(
    "fit", "Profile likelihoods", 3, "profiles", "Profile likelihoods", caption_profiles, needs="profiles",
    tables=profile_tables,
)  # fmt: skip
def draw_profiles(found: FitResult) -> Figure:
    drawn, profiles = new_figure(10.0, 3.2), found.profiles or ()
    intervals = found.posterior.interval if found.posterior else {}
    panels = drawn.subplots(1, len(profiles), sharey=True)
    for axes, profile in zip(panels, profiles, strict=True):
        unit, fitted = found.identifiable_units[profile.name], found.identifiable[profile.name]
        draw_profile(axes, profile, unit, fitted, intervals.get(profile.name))
    panels[0].set_ylabel("loss of log likelihood")
    return drawn


def sensitivity_table(found: FssSensitivity, units: Mapping[str, str]) -> Table:
    """Return Sobol's indices of the four numbers and the ranges that they belong to."""
    rows = [
        (
            f"{symbol} [{units[name]}]", span((found.lower[each], found.upper[each])),
            with_error(found.first[each], found.first_half_width[each], space=" "),
            with_error(found.total[each], found.total_half_width[each], space=" "),
        )
        for each, (name, symbol) in enumerate(IDENTIFIABLE_SYMBOLS.items())
    ]  # fmt: skip
    headings = ("number", "range", "first-order index", "total index")
    note = (
        "Share of the variance of the weighted FSS when each number is uniform within its range: alone, and "
        f"in interaction with others. FSS is {with_error(found.mean_fss, found.deviation_fss, 3, ' ')} over "
        f"the ranges; {number(found.evaluations)} evaluations."
    )
    return Table("Sensitivity of FSS (Sobol)", headings, [Row(row) for row in rows], note)


def caption_sensitivity(found: FitResult) -> str:
    assert found.sensitivity is not None
    most = list(IDENTIFIABLE_SYMBOLS.values())[int(np.argmax(found.sensitivity.total))]
    return (
        "Share of the variance of FSS due to each parameter if all are uniform within a quarter of their "
        f"fitted values: hatched, alone (first-order index); filled, with all interactions (total index). "
        f"Whiskers are 95 % intervals of the estimate. The largest total index is that of {most}."
    )


def sensitivity_tables(found: FitResult) -> list[Table]:
    return [sensitivity_table(found.sensitivity, found.identifiable_units)] if found.sensitivity else []


@figure(
    "fit", "Sensitivity of the fit", 4, "sensitivity", "Sobol indices", caption_sensitivity,
    needs="sensitivity", tables=sensitivity_tables,
)  # fmt: skip
def draw_sensitivity(fit: FitResult) -> Figure:
    assert fit.sensitivity is not None
    drawn, found, places = new_figure(6.5, 3.8), fit.sensitivity, np.arange(len(IDENTIFIABLE_SYMBOLS))
    axes = drawn.subplots()
    bars: Any = {"edgecolor": BLACK, "linewidth": 0.8}
    bars["error_kw"] = {"elinewidth": 1.0, "ecolor": BLACK, "capsize": 3.0}
    for indices, half_width, label, colour, side, hatch in (
        (found.total, found.total_half_width, "with others", BLUE, -0.19, ""),
        (found.first, found.first_half_width, "alone", "white", 0.19, "////"),
    ):
        axes.bar(
            places + side, indices, 0.36, yerr=half_width, color=colour, hatch=hatch, label=label, **bars
        )
    axes.set_xticks(places, IDENTIFIABLE_SYMBOLS.values())
    axes.set(xlabel="number", ylabel="share of the variance of FSS [1]")
    axes.axhline(0.0, color=BLACK, linewidth=0.8)
    axes.legend()
    return drawn


def caption_offset(found: FitResult) -> str:
    """Caption of the offset: which part of the residual it explains."""
    offset, residual = found.offset, 1.0 - found.fss_in_sample
    assert offset is not None
    taken = (offset.fss_in_sample - found.fss_in_sample) / residual if residual > 0.0 else 0.0
    return (
        "The receptor's offset along the finger as one more parameter. Line: best FSS over all stimuli with "
        f"the receptor held at each offset. The fitted offset is {number(offset.offset_mm)} mm; it explains "
        f"{whole_percent(taken)} of the residual in sample. Out of sample FSS is "
        f"{fixed(offset.fss_out_of_sample, 3)} instead of {fixed(found.fss_out_of_sample, 3)}. A gain in "
        "sample alone is no evidence for an offset."
    )


def offset_tables(found: FitResult) -> list[Table]:
    offset = found.offset
    assert offset is not None
    at_zero = {phase: rates.fss_in_sample for phase, rates in found.phases.items()}
    rows = (
        ("at 0 mm", 0.0, None, found, at_zero),
        ("offset fitted", offset.offset_mm, offset.standard_error_mm, offset, offset.fss_by_phase),
    )
    columns = [
        Column("0", "receptor"), Column("1", "offset [mm]"), Column("2", "standard error [mm]"),
        Column("3.fss_in_sample", "FSS, all stimuli", 3), Column("4.dynamic", "dynamic", 3),
        Column("4.static", "static", 3), Column("3.fss_out_of_sample", "out of sample", 3),
        *_columns_of_four("3.identifiable", IDENTIFIABLE_SYMBOLS, found.identifiable_units),
    ]  # fmt: skip
    note = (
        "Standard error: from the scatter of the folds' fits. Offsets end at "
        f"{number(offset.held.offset_mm[0])} and {number(offset.held.offset_mm[-1])} mm, where the skin was "
        "sampled."
    )
    return [table("Offset of the receptor", rows, columns, note)]


@figure(
    "fit", "Offset of the receptor", 5, "offset", "FSS by offset of the receptor", caption_offset,
    needs="offset", tables=offset_tables,
)  # fmt: skip
def draw_offset(found: FitResult) -> Figure:
    drawn, offset = new_figure(6.5, 3.8), found.offset
    assert offset is not None
    axes = drawn.subplots()
    axes.axvline(0.0, color=GREY, linewidth=1.0)
    axes.plot(offset.held.offset_mm, offset.held.fss_in_sample, "o-", color=BLACK, label="held there")
    best: Any = {"color": ORANGE, "markersize": 7.0, "label": "fitted to all"}
    axes.plot([offset.offset_mm], [offset.fss_in_sample], "D", **best)
    low = axes.get_ylim()[0]
    ticks: Any = {"color": BLUE, "markersize": 14.0, "markeredgewidth": 2.0, "clip_on": False}
    axes.plot(offset.folds_mm, [low] * len(offset.folds_mm), "|", label="fitted without a fold", **ticks)
    axes.set_ylim(bottom=low)
    axes.set(xlabel="offset of the receptor, distal positive [mm]", ylabel="FSS in sample [1]")
    axes.legend()
    return drawn


CAPTION_UNCERTAINTY = (
    f"Uncertainty of one afferent given its rates under a bar {protocol.BAR_WIDTH.value} mm wide at "
    "{shift_mm:n} positions, observed in one afferent of a monkey (Phillips & Johnson 1981; circles). "
    "(a, b) {level:p} bands: blue, of the rates that the posterior predicts; pale, of a new recording with "
    "residuals like those observed. (c-f) Loss of log likelihood with one parameter held and the others "
    "fitted again; points below the dashed line are within the {level:p} interval, the bar below is that "
    "of the posterior, and the orange line is the response-surface fit, with other weights of phases. "
    "Profiles are not smooth, because rates are discontinuous where a spike enters a window."
)


def uncertainty_tables(section: UncertaintyResult) -> list[Table]:
    level, convergence, posterior = whole_percent(section.level), section.convergence, section.posterior
    profiles = {profile.name: profile_ends(profile) for profile in section.profiles}
    names = {name: (symbol, section.units[name]) for name, symbol in IDENTIFIABLE_SYMBOLS.items()} | {
        "intercept_ma": ("β", unit_of("intercept_ma")),
        "dynamic_gain": ("k_d", gain_unit("dynamic_gain", STORED_ENERGY)),
        "static_gain": ("k_s", gain_unit("static_gain", STORED_ENERGY)),
        "resting_share": ("β τ/(C v)", "1"),
    }
    determined = (
        Column(lambda name: "{} [{}]".format(*names[name]), "number"), Column(section.fit.get, "fit"),
        Column(lambda name: posterior[name].median, "median"),
        Column(lambda name: _interval(posterior[name]), f"{level} credible interval"),
        Column(lambda name: profiles.get(name, ABSENT), f"{level} by profile likelihood"),
    )  # fmt: skip
    smallest, rank = section.identifiability.relative_singular_values, section.identifiability.rank
    note = (
        "Spikes determine four parameters. β, k_d, k_s, C and v are known only up to a common scale; the "
        f"gains are given for C = {number(section.capacitance_mf)} mF and v = {number(section.threshold_mv)} "
        f"mV, as fitted. Of the six singular values of the rates' Jacobian {rank} are not zero; relative to "
        f"the largest they are {', '.join(number(value, 2) for value in smallest[:rank])}, and the others at "
        f"most {number(float(smallest[rank:].max()), 1) if rank < smallest.size else ABSENT}."
    )
    residuals = (
        Column(lambda row: PHASE_LABELS[row[0]], "phase"),
        Column("1.residual_deviation_hz.median", "standard deviation [spikes/s]"),
        Column("1.residual_deviation_hz", "interval [spikes/s]", _interval),
        Column("1.residual_length_mm.median", "correlation length [mm]"),
        Column("1.residual_length_mm", "interval [mm]", _interval),
        Column("1.probability_of_independence", form=partial(number, digits=2)),
        Column("1.share_within_new", "observed within the band", 2),
    )
    correlated = (
        "Residuals of neighbouring positions may be correlated. This raises the largest log likelihood "
        f"by {number(section.evidence_for_alike_residuals)}."
    )
    facts = {
        "independent ensembles": convergence.ensembles,
        "walkers of each": convergence.walkers,
        "draws kept": convergence.draws,
        "evaluations of the model": convergence.evaluations,
        "share of accepted proposals": convergence.acceptance,
        "largest split R-hat": number(convergence.r_hat, 4),
        "smallest effective sample size": convergence.effective_draws,
        "smallest effective sample size of the tails": convergence.effective_draws_of_tails,
        "largest autocorrelation time, draws": convergence.draws_per_effective_draw,
    }
    return [
        table("Numbers that the rates determine", names, determined, note),
        table("Residuals", section.rates.items(), residuals, correlated),
        sensitivity_table(section.sensitivity, section.units),
        listed("Convergence of the posterior", facts, ("measure", "value")),
    ]


def _interval(found: Any) -> str:
    return span((found.low, found.high))


@figure(
    "reproduction", "Beyond the paper", 11, "figure_11_uncertainty", "Uncertainty of the fit",
    CAPTION_UNCERTAINTY, of=both("single_unit_uncertainty"), tables=uncertainty_tables,
)  # fmt: skip
def draw_uncertainty(section: UncertaintyResult) -> Figure:
    drawn = new_figure(COLUMN_IN, 7.5)
    panels = drawn.subplots(3, 2).ravel()
    for axes, letter, (phase, rates) in zip(panels, "ab", section.rates.items(), strict=False):
        where = -section.shift_mm
        fill_band(axes, where, rates.new_low_hz, rates.new_high_hz, PALE, 1.0, "new recording")
        fill_band(axes, where, rates.low_hz, rates.high_hz, BLUE, 0.45, "prediction")
        draw_rates(axes, where, rates.median_hz, rates.observed_hz, "median")
        axes.set(title=f"({letter}) {PHASE_LABELS[phase]}", xlabel=ALONG)
    drawn.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    for axes, letter, profile in zip(panels[2:], "cdef", section.profiles, strict=True):
        name, found = profile.name, section.posterior[profile.name]
        draw_profile(axes, profile, section.units[name], section.fit[name], (found.low, found.high))
        axes.set_title(f"({letter}) {IDENTIFIABLE_SYMBOLS[name]}")
    for axes in panels[2::2]:
        axes.set_ylabel("loss of log likelihood")
    return drawn
