"""Level 2: uncertainty of the afferent given the rates under the bar."""

from __future__ import annotations

from matplotlib.figure import Figure

from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.units import gain_unit, unit_of
from fingerpad.data import protocol
from fingerpad.experiments.gerling2014.single_unit_uncertainty import (
    CredibleInterval,
    PosteriorConvergence,
    UncertaintyResult,
)
from fingerpad.report.formatting import (
    ABSENT,
    IDENTIFIABLE_SYMBOLS,
    PHASE_LABELS,
    fixed,
    number,
    whole_percent,
)
from fingerpad.report.parts import Row, Table
from fingerpad.report.rate_uncertainty import draw_profile, profile_ends, sensitivity_table
from fingerpad.report.single_unit import ALONG
from fingerpad.report.style import BLUE, COLUMN_IN, PALE, draw_rates, new_figure

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
        for label, low, high, colour, alpha in (
            ("new recording", rates.new_low_hz, rates.new_high_hz, PALE, 1.0),
            ("prediction", rates.low_hz, rates.high_hz, BLUE, 0.45),
        ):
            axes.fill_between(
                -section.shift_mm, low, high, color=colour, alpha=alpha, linewidth=0.0, label=label
            )
        draw_rates(axes, -section.shift_mm, rates.median_hz, rates.observed_hz, "median")
        axes.set_title(f"({'ab'[column]}) {PHASE_LABELS[phase]}")
        axes.set_xlabel(ALONG)
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
    """Describe the bands, the profiles and their marks."""
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
    """Return the numbers in both forms, the residuals, the sensitivity and the convergence."""
    return [
        _determined(section),
        _residuals(section),
        sensitivity_table(section.sensitivity, section.units),
        _convergence(section.convergence),
    ]


def _determined(section: UncertaintyResult) -> Table:
    profiles = {profile.name: profile for profile in section.profiles}
    rows = [
        Row(
            (
                f"{symbol} [{section.units[name]}]",
                number(section.fit[name]),
                *_interval(section.posterior[name]),
                profile_ends(profiles[name]),
            )
        )
        for name, symbol in IDENTIFIABLE_SYMBOLS.items()
    ]
    rows += [
        Row((f"{symbol} [{unit}]", ABSENT, *_interval(section.posterior[name]), ABSENT))
        for name, (symbol, unit) in GAINS.items()
    ]
    rows.append(Row(("β τ/(C v) [1]", ABSENT, *_interval(section.posterior["resting_share"]), ABSENT)))
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
        Row(
            (
                PHASE_LABELS[phase],
                *_interval(rates.residual_deviation_hz),
                *_interval(rates.residual_length_mm),
                number(rates.probability_of_independence, 2),
                fixed(rates.share_within_new, 2),
            )
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
    return Table("Convergence of the posterior", ("measure", "value"), [Row(fact) for fact in facts.items()])
