"""Level 2, Figure 5: firing rates of one afferent as a bar moves, and uncertainty of its fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.units import gain_unit, unit_of
from fingerpad.data import paper, protocol
from fingerpad.experiments.fit.results import FssSensitivity, ParameterProfile
from fingerpad.experiments.gerling2014.single_unit import (
    FoldResult,
    Modulation,
    RateModulation,
    Search,
    SingleUnitResult,
)
from fingerpad.experiments.gerling2014.single_unit_uncertainty import (
    CredibleInterval,
    PosteriorConvergence,
    UncertaintyResult,
)
from fingerpad.report.formatting import (
    ABSENT,
    IDENTIFIABLE_SYMBOLS,
    PARAMETER_SYMBOLS,
    PHASE_LABELS,
    fixed,
    number,
    spelled,
    whole_percent,
)
from fingerpad.report.parts import Row, Table, listed
from fingerpad.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREY,
    ORANGE,
    PALE,
    draw_rates,
    new_figure,
    shared_legend,
)

LARGEST_LOSS = 5.0  # Losses of log likelihood that are drawn.
ALLOWED_LOSS = 1.92  # Loss at the ends of a 95 % interval: half the quantile of chi-square, 1 degree.


def draw_profile(
    axes: Axes,
    profile: ParameterProfile,
    unit: str,
    fitted: float | None,
    credible: tuple[float, float] | None = None,
) -> None:
    """Draw one profile: its points, the level of the interval, the fit, the posterior's interval."""
    axes.plot(profile.values, profile.losses, ".-", color=BLACK, linewidth=1.2)
    axes.axhline(ALLOWED_LOSS, color=GREY, linestyle="--", linewidth=1.0)
    if fitted is not None:
        axes.axvline(fitted, color=ORANGE, linestyle="-.", linewidth=1.4)
    if credible is not None:
        axes.plot(credible, [-0.25, -0.25], color=BLUE, linewidth=4.0, solid_capstyle="butt")
    axes.set(ylim=(-0.5, LARGEST_LOSS), xlabel=f"{IDENTIFIABLE_SYMBOLS[profile.name]} [{unit}]")


def profile_ends(profile: ParameterProfile) -> str:
    """Return the interval of a profile as text; an end that the rates do not set is open."""
    return " … ".join("open" if end is None else number(end) for end in (profile.low, profile.high))


def draw_indices(axes: Axes, found: FssSensitivity) -> None:
    """Draw first-order and total indices of each number, as bars with their confidence intervals."""
    places = np.arange(len(IDENTIFIABLE_SYMBOLS))
    for indices, half_width, label, colour, side, hatch in (
        (found.total, found.total_half_width, "with others", BLUE, -0.19, ""),
        (found.first, found.first_half_width, "alone", "white", 0.19, "////"),
    ):
        axes.bar(
            places + side, indices, 0.36, yerr=half_width, color=colour, edgecolor=BLACK, linewidth=0.8,
            hatch=hatch, error_kw={"elinewidth": 1.0, "ecolor": BLACK, "capsize": 3.0}, label=label,
        )  # fmt: skip
    axes.set_xticks(places, IDENTIFIABLE_SYMBOLS.values())
    axes.set(xlabel="number", ylabel="share of the variance of FSS [1]")
    axes.axhline(0.0, color=BLACK, linewidth=0.8)
    axes.legend()


def sensitivity_table(found: FssSensitivity, units: Mapping[str, str]) -> Table:
    """Return Sobol's indices of the four numbers and the ranges that they belong to."""
    rows = [
        Row.of(
            f"{symbol} [{units[name]}]",
            f"{number(found.lower[index])} … {number(found.upper[index])}",
            f"{fixed(found.first[index], 2)} ± {fixed(found.first_half_width[index], 2)}",
            f"{fixed(found.total[index], 2)} ± {fixed(found.total_half_width[index], 2)}",
        )
        for index, (name, symbol) in enumerate(IDENTIFIABLE_SYMBOLS.items())
    ]
    note = (
        "Share of the variance of the weighted FSS when each number is uniform within its range: alone, and "
        f"in interaction with others. FSS is {fixed(found.mean_fss, 3)} ± "
        f"{fixed(found.deviation_fss, 3)} over the ranges; {number(found.evaluations)} evaluations."
    )
    columns = ("number", "range", "first-order index", "total index")
    return Table("Sensitivity of FSS (Sobol)", columns, rows, note)


BAR_HALF_WIDTH_MM = protocol.BAR_WIDTH.value / 2.0
STATIC_MARK_MM = 2.9  # Position at which the paper's static difference is drawn, where no rates are. [mm]
ALONG = "place of the bar, distal [mm]"  # Figures have the distal side on the right; results do not.
FITTED = "model (fitted)"  # Name of the line of the model, whose afferent was fitted to what was observed.
PAPER_FOLD, PAPER_START = 3, 2  # Fold and start point whose steps the paper's Table 4 lists.


def draw_single_unit(section: SingleUnitResult) -> Figure:
    """Draw Figure 5: dynamic rates on the left, static rates on the right."""
    figure = new_figure(COLUMN_IN, 4.0)
    dynamic, static = figure.subplots(1, 2)
    for axes, letter, phase in ((dynamic, "a", "dynamic"), (static, "b", "static")):
        rate_hz, observed_hz = (getattr(section, f"{of}{phase}_rate_hz") for of in ("", "observed_"))
        fss = fixed(getattr(section, f"fss_in_sample_{phase}"), 2)
        axes.axvspan(-BAR_HALF_WIDTH_MM, BAR_HALF_WIDTH_MM, color="#f3f1ea", zorder=0)
        draw_rates(axes, -section.shift_mm, rate_hz, observed_hz, FITTED)
        axes.set_title(f"({letter}) {PHASE_LABELS[phase]}, FSS = {fss}", fontsize=10.0)
        axes.set_xlabel(ALONG)
    _mark_dynamic_rates(dynamic, section.modulation.dynamic.observed)
    _mark_static_difference(static, section.modulation.static.ours.minimum_hz)
    shared_legend(figure, figure.axes, columns=2)
    return figure


def _mark_dynamic_rates(axes: Axes, observed: Modulation) -> None:
    """Draw the rates under the flat face and at the edge that the paper predicts, and the observed ones."""
    printed = (paper.DYNAMIC_RATE_MINIMUM.value, paper.DYNAMIC_RATE_MAXIMUM.value)
    marks = (
        (printed, ORANGE, (0, (6, 3)), "predicted by the paper, lowest and highest"),
        ((observed.minimum_hz, observed.maximum_hz), BLACK, (0, (1, 2)), "observed, lowest and highest"),
    )
    low, high = axes.get_xlim()
    sides = ((low, "left", "bottom"), (high, "right", "top"))
    for (place, side, edge), (levels, colour, dashes, label) in zip(sides, marks, strict=True):
        for level in levels:
            axes.axhline(level, color=colour, linestyle=dashes, linewidth=1.2, label=label, zorder=1)
            text: Any = {"ha": side, "va": edge, "color": colour, "fontsize": 9.0}
            axes.text(place, level, f" {number(level)} ", **text)
    axes.set_xlim(low, high)
    axes.set_ylim(top=1.1 * max(*printed, axes.get_ylim()[1] / 1.05))


def _mark_static_difference(axes: Axes, lowest_hz: float) -> None:
    """Draw the difference that the paper predicts, from our lowest rate: it prints no static rates."""
    difference = paper.STATIC_RATE_DIFFERENCE.value
    place, bar = (STATIC_MARK_MM, lowest_hz + 0.5 * difference), 0.5 * difference
    label = "difference predicted by the paper"
    axes.errorbar(*place, yerr=bar, color=ORANGE, capsize=5.0, elinewidth=1.8, label=label)
    text: Any = {"ha": "left", "va": "center", "color": ORANGE, "fontsize": 9.0}
    axes.text(*place, f" {number(difference)}", **text)


def caption_single_unit(section: SingleUnitResult) -> str:
    observed = section.modulation.dynamic.observed
    return (
        f"Firing rate of one SAI afferent under a bar {protocol.BAR_WIDTH.value} mm wide, pressed in by "
        f"{protocol.DEPTH.value} mm at {section.shift_mm.size} positions relative to the centre of its "
        "receptive field; shaded: positions at which the bar covers the centre. Circles: observed in one "
        "afferent of a monkey (Phillips & Johnson 1981); the finger of the model is human. Blue line: rates "
        "of the model, whose afferent was fitted to these circles; its fractional sum of squares (FSS, "
        "1 is perfect) is in the titles. (a) Lines: lowest rate under the flat face and highest rate, "
        f"{number(paper.DYNAMIC_RATE_MINIMUM.value)} and {number(paper.DYNAMIC_RATE_MAXIMUM.value)} spikes/s "
        f"as the paper's model predicts them (dashed), and {number(observed.minimum_hz)} and "
        f"{number(observed.maximum_hz)} spikes/s as observed (dotted). (b) Bar: the difference of "
        f"{number(paper.STATIC_RATE_DIFFERENCE.value)} spikes/s between them that the paper's model "
        "predicts, drawn from the lowest rate of the line; it prints no static rates."
    )


SPECIES = (
    "The recordings are from afferents of monkeys (the paper, section 2.2.2: primate), the finger is human "
    "(section 2.1.1). The fit of the afferent takes up what differs between the two, which is not known."
)
"""What the paper combines; see docs/single-unit.md."""


def single_unit_tables(section: SingleUnitResult) -> list[Table]:
    """Return scores, parameters, folds, the steps of one search, and modulation."""
    search = section.folds[PAPER_FOLD - 1].climbs[-1]
    as_printed = search.start == len(section.start_points)
    return [
        _scores(section),
        _parameters(section, section.start_points if as_printed else ()),
        _folds(section.folds),
        _searches(section.folds),
        _steps(search, section, as_printed),
        _modulation(section.modulation),
    ]


def _scores(section: SingleUnitResult) -> Table:
    rows = (
        ("out of sample, mean of the folds", paper.FSS_OUT_OF_SAMPLE.value, section.fss_out_of_sample),
        ("all positions, dynamic and static weighted 1:3", None, section.fss_in_sample),
        ("all positions, dynamic rates", None, section.fss_in_sample_dynamic),
        ("all positions, static rates", None, section.fss_in_sample_static),
    )
    return Table(
        "Fractional sum of squares (FSS)",
        ("over", "paper", "this run"),
        [Row.of(name, fixed(printed, 2), fixed(ours, 3)) for name, printed, ours in rows],
        SPECIES,
    )


def _parameters(section: SingleUnitResult, start_points: Sequence[Mapping[str, float]]) -> Table:
    """Return the fitted parameters beside the paper's start points, where the fit begins with these."""
    rows = [
        Row.of(
            PARAMETER_SYMBOLS.get(name, spelled(name)),
            *(number(start.get(name)) for start in start_points),
            number(value),
            section.units.get(name, ""),
        )
        for name, value in section.parameters.items()
    ]
    starts = (f"start {index}" for index in range(1, len(start_points) + 1))
    return Table("Parameters of the afferent", ("parameter", *starts, "fitted", "unit"), rows)


def _folds(folds: Sequence[FoldResult]) -> Table:
    rows = [
        Row.of(
            str(fold.fold),
            ", ".join(f"{shift:+.1f}".replace("-", "−") for shift in fold.testing_shift_mm),
            str(fold.start),
            fixed(fold.fss_train, 3),
            fixed(fold.fss_test, 3),
        )
        for fold in folds
    ]
    columns = ("fold", "positions kept for testing [mm]", "better start", "FSS, training", "FSS, testing")
    return Table("Folds of the cross-validation (the paper's Table 3)", columns, rows)


def _searches(folds: Sequence[FoldResult]) -> Table:
    rows = [
        Row.of(
            f"{fold.fold}, {search.start}",
            fixed(search.history[0].fss, 3),
            fixed(search.fss_train, 3),
            fixed(search.fss_test, 3),
            str(len(search.history) - 1),
            number(search.runs),
            kind="final" if search.start == fold.start else "",
        )
        for fold in folds
        for search in fold.climbs
    ]
    columns = (
        "fold, start", "FSS at the start", "FSS, training", "FSS, testing", "iterations", "evaluations",
    )  # fmt: skip
    note = "In bold: the better start on the training positions, which is the result of the fold."
    return Table("Searches of every fold", columns, rows, note)


def _steps(search: Search, section: SingleUnitResult, as_printed: bool) -> Table:
    """Return the steps of one search, beside the paper's session if it has the same start point."""
    names = list(search.history[0].parameters)
    rows = [
        Row.of(
            str(step.iteration),
            fixed(step.fss, 3),
            *(number(step.parameters[name]) for name in names),
            kind="final" if step is search.history[-1] else "",
        )
        for step in search.history
    ]
    note = (
        "The last row, in bold, is final; its FSS on the testing positions is "
        f"{fixed(search.fss_test, 3)}. results.json holds these steps for each fold and start."
    )
    title = f"Steps of the fit: fold {PAPER_FOLD}, start {search.start}"
    title += f" (the paper's Table 4{'' if as_printed else ', from another start'})"
    if as_printed:
        note += (
            f" In the paper FSS rose from {number(paper.FOLD_3_FSS_START.value)} to "
            f"{number(paper.FOLD_3_FSS_FITTED.value)} in {number(paper.FOLD_3_ITERATIONS.value)} iterations, "
            f"and was {number(paper.FOLD_3_FSS_TEST.value)} on its testing positions, which are unknown."
        )
    headings = [
        PARAMETER_SYMBOLS.get(name, spelled(name))
        + (f" [{section.units[name]}]" if name in section.units else "")
        for name in names
    ]
    return Table(title, ("iteration", "FSS, training", *headings), rows, note)


def _modulation(modulation: RateModulation) -> Table:
    rows = [
        Row.of(
            f"{phase}, {source}",
            number(found.maximum_hz),
            number(found.minimum_hz),
            number(found.difference_hz),
            number(found.index),
        )
        for phase, both in (("dynamic", modulation.dynamic), ("static", modulation.static))
        for source, found in (("observed", both.observed), ("this run", both.ours))
    ]
    note = (
        "All but the index in spikes/s. The paper predicts a dynamic minimum of "
        f"{number(paper.DYNAMIC_RATE_MINIMUM.value)}, maximum of {number(paper.DYNAMIC_RATE_MAXIMUM.value)} "
        f"and difference of {number(paper.DYNAMIC_RATE_DIFFERENCE.value)}, and a static difference of "
        f"{number(paper.STATIC_RATE_DIFFERENCE.value)}; it calls the differences modulation indices."
    )
    columns = ("rates", "maximum", "minimum", "difference", "index, Eq. 11")
    return Table("Modulation at the edge of the bar (the paper's Table 5)", columns, rows, note)


GAINS = {
    "intercept_ma": ("β", unit_of("intercept_ma")),
    "dynamic_gain": ("k_d", gain_unit("dynamic_gain", STORED_ENERGY)),
    "static_gain": ("k_s", gain_unit("static_gain", STORED_ENERGY)),
}


def draw_uncertainty(section: UncertaintyResult) -> Figure:
    """Draw the bands of predicted rates and of new recordings, and the profile of each parameter."""
    figure = new_figure(COLUMN_IN, 7.5)
    grid = figure.add_gridspec(3, 2)
    for column, (phase, rates) in enumerate(section.rates.items()):
        axes = figure.add_subplot(grid[0, column])
        new: Any = {"color": PALE, "alpha": 1.0, "linewidth": 0.0, "label": "new recording"}
        axes.fill_between(-section.shift_mm, rates.new_low_hz, rates.new_high_hz, **new)
        band: Any = {"color": BLUE, "alpha": 0.45, "linewidth": 0.0, "label": "prediction"}
        axes.fill_between(-section.shift_mm, rates.low_hz, rates.high_hz, **band)
        draw_rates(axes, -section.shift_mm, rates.median_hz, rates.observed_hz, "median")
        axes.set(title=f"({'ab'[column]}) {PHASE_LABELS[phase]}", xlabel=ALONG)
        if column == 0:
            figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    for column, profile in enumerate(section.profiles):
        axes, name = figure.add_subplot(grid[1 + column // 2, column % 2]), profile.name
        found = section.posterior[name]
        draw_profile(axes, profile, section.units[name], section.fit[name], (found.low, found.high))
        axes.set_title(f"({'cdef'[column]}) {IDENTIFIABLE_SYMBOLS[name]}")
        if column % 2 == 0:
            axes.set_ylabel("loss of log likelihood")
    return figure


def caption_uncertainty(section: UncertaintyResult) -> str:
    level = whole_percent(section.level)
    return (
        f"Uncertainty of one afferent given its rates under a bar {protocol.BAR_WIDTH.value} mm wide at "
        f"{section.shift_mm.size} positions, observed in one afferent of a monkey (Phillips & Johnson 1981; "
        f"circles). (a, b) {level} bands: blue, of the rates that the posterior "
        "predicts; pale, of a new recording with residuals like those observed. "
        "(c-f) Loss of log likelihood with one parameter held and the others "
        f"fitted again; points below the dashed line are within the {level} interval, the bar below is that "
        "of the posterior, and the orange line is the response-surface fit, with other weights of phases. "
        "Profiles are not smooth, because rates are discontinuous where a spike enters a window."
    )


def uncertainty_tables(section: UncertaintyResult) -> list[Table]:
    return [
        _determined(section),
        _residuals(section),
        sensitivity_table(section.sensitivity, section.units),
        _convergence(section.convergence),
    ]


def _determined(section: UncertaintyResult) -> Table:
    profiles = {profile.name: profile for profile in section.profiles}
    rows = [
        Row.of(
            f"{symbol} [{section.units[name]}]",
            number(section.fit[name]),
            *_interval(section.posterior[name]),
            profile_ends(profiles[name]),
        )
        for name, symbol in IDENTIFIABLE_SYMBOLS.items()
    ]
    rows += [
        Row.of(f"{symbol} [{unit}]", ABSENT, *_interval(section.posterior[name]), ABSENT)
        for name, (symbol, unit) in GAINS.items()
    ]
    rows.append(Row.of("β τ/(C v) [1]", ABSENT, *_interval(section.posterior["resting_share"]), ABSENT))
    level = whole_percent(section.level)
    rank = section.identifiability.rank
    smallest = section.identifiability.relative_singular_values
    note = (
        "Spikes determine four parameters. β, k_d, k_s, C and v are known only up to a common scale; the "
        f"gains are given for C = {number(section.capacitance_mf)} mF and v = {number(section.threshold_mv)} "
        f"mV, as fitted. Of the six singular values of the rates' Jacobian {rank} are not zero; relative to "
        f"the largest they are {', '.join(number(value, 2) for value in smallest[:rank])}, and the others at "
        f"most {number(float(smallest[rank:].max()), 1) if rank < smallest.size else ABSENT}."
    )
    columns = ("number", "fit", "median", f"{level} credible interval", f"{level} by profile likelihood")
    return Table("Numbers that the rates determine", columns, rows, note)


def _interval(found: CredibleInterval) -> tuple[str, str]:
    return number(found.median), f"{number(found.low)} … {number(found.high)}"


def _residuals(section: UncertaintyResult) -> Table:
    rows = [
        Row.of(
            PHASE_LABELS[phase],
            *_interval(rates.residual_deviation_hz),
            *_interval(rates.residual_length_mm),
            number(rates.probability_of_independence, 2),
            fixed(rates.share_within_new, 2),
        )
        for phase, rates in section.rates.items()
    ]
    columns = (
        "phase", "standard deviation [spikes/s]", "interval", "correlation length [mm]", "interval",
        "probability of independence", "observed within the band",
    )  # fmt: skip
    note = (
        "Residuals of neighbouring positions may be correlated. This raises the largest log likelihood "
        f"by {number(section.evidence_for_alike_residuals)}."
    )
    return Table("Residuals", columns, rows, note)


def _convergence(found: PosteriorConvergence) -> Table:
    facts = {
        "independent ensembles": number(found.ensembles),
        "walkers of each": number(found.walkers),
        "draws kept": number(found.draws),
        "evaluations of the model": number(found.evaluations),
        "share of accepted proposals": number(found.acceptance),
        "largest split R-hat": number(found.r_hat, 4),
        "smallest effective sample size": number(found.effective_draws),
        "smallest effective sample size of the tails": number(found.effective_draws_of_tails),
        "largest autocorrelation time, draws": number(found.draws_per_effective_draw),
    }
    return listed("Convergence of the posterior", facts, ("measure", "value"))
