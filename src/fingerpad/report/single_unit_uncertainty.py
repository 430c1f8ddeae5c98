"""Level 2: what the rates under the bar determine of the afferent, and what they leave open."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from fingerpad.data import protocol
from fingerpad.report.formatting import ABSENT, IDENTIFIABLE_SYMBOLS, PHASES, fixed, number, whole_percent
from fingerpad.report.parts import Row, Table
from fingerpad.report.rate_uncertainty import draw_profile, profile_ends, sensitivity_table
from fingerpad.report.style import BLACK, BLUE, PALE, new_figure, numbers

GAINS = {
    "intercept_ma": ("β", "mA"),
    "dynamic_gain": ("k_d", "mA ms/kPa"),
    "static_gain": ("k_s", "mA/kPa"),
}


def draw(section: Mapping[str, Any]) -> Figure:
    """Draw the bands of predicted rates and of new recordings, and the profile of each number.

    Parameters
    ----------
    section : dict
        `results["single_unit_uncertainty"]`.

    Returns
    -------
    Figure
    """
    figure = new_figure(10.0, 7.5)
    grid = figure.add_gridspec(2, 4)
    shift = numbers(section["shift_mm"])
    for column, (phase, name) in enumerate(PHASES.items()):
        if phase not in section["rates"]:
            continue
        names = ("observed_hz", "median_hz", "low_hz", "high_hz", "new_low_hz", "new_high_hz")
        rates = {key: numbers(section["rates"][phase][key]) for key in names}
        axes = figure.add_subplot(grid[0, 2 * column : 2 * column + 2])
        bands = {"new recording": ("new_", PALE, 1.0), "prediction": ("", BLUE, 0.45)}
        for label, (kind, colour, alpha) in bands.items():
            low, high = rates[f"{kind}low_hz"], rates[f"{kind}high_hz"]
            axes.fill_between(shift, low, high, color=colour, alpha=alpha, linewidth=0.0, label=label)
        axes.plot(shift, rates["median_hz"], color=BLUE, label="median")
        points: dict[str, Any] = {"color": BLACK, "markerfacecolor": "white", "markersize": 4.5}
        axes.plot(shift, rates["observed_hz"], "o", label="observed", **points)
        axes.set_title(f"({'ab'[column]}) {name}")
        axes.set_xlabel("position of the bar, proximal positive [mm]")
        axes.set_ylabel("firing rate [spikes/s]")
        axes.set_ylim(bottom=0.0)
        if column == 0:
            figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    for column, profile in enumerate(section["profiles"]):
        axes, name = figure.add_subplot(grid[1, column]), profile["name"]
        found = section["posterior"][name]
        ends = (found["low"], found["high"])
        draw_profile(axes, profile, section["units"][name], section["fit"][name], ends)
        axes.set_title(f"({'cdef'[column]}) {IDENTIFIABLE_SYMBOLS[name]}")
        if column == 0:
            axes.set_ylabel("loss of log likelihood")
    return figure


def caption(section: Mapping[str, Any]) -> str:
    """Say what the bands, the profiles and their marks are."""
    level = whole_percent(section["level"])
    within = ", ".join(
        f"{whole_percent(rates['share_within_new'])} of the {phase} ones"
        for phase, rates in section["rates"].items()
    )
    return (
        f"What {len(section['shift_mm'])} positions of a bar {protocol.BAR_WIDTH.value} mm wide tell of one "
        f"afferent. (a, b) {level} bands: blue, of the rates that the posterior predicts; pale, of a new "
        f"recording, which departs from them as the observed one does. Of the observed rates {within} lie "
        "within. (c-f) Loss of log likelihood with one number held and the others fitted anew; points below "
        f"the dashed line are within the {level} interval, the bar beneath is that of the posterior, and the "
        "orange line is the fit by response surfaces, which weighs phases differently. Profiles have lumps "
        "since rates jump where a spike enters a window."
    )


def tables(section: Mapping[str, Any]) -> list[Table]:
    """Return the numbers in both forms, the residuals, the sensitivity and the convergence."""
    return [
        _determined(section),
        _residuals(section),
        sensitivity_table(section["sensitivity"], section["units"]),
        _convergence(section),
    ]


def _determined(section: Mapping[str, Any]) -> Table:
    profiles = {profile["name"]: profile for profile in section["profiles"]}
    rows = [
        Row(
            (
                f"{symbol} [{section['units'][name]}]",
                number(section["fit"][name]),
                *_interval(section["posterior"][name]),
                profile_ends(profiles[name]),
            )
        )
        for name, symbol in IDENTIFIABLE_SYMBOLS.items()
    ]
    rows += [
        Row((f"{symbol} [{unit}]", ABSENT, *_interval(section["posterior"][name]), ABSENT))
        for name, (symbol, unit) in GAINS.items()
    ]
    rows.append(Row(("β τ/(C v) [1]", ABSENT, *_interval(section["posterior"]["resting_share"]), ABSENT)))
    level = whole_percent(section["level"])
    rank = section["identifiability"]["rank"] or 0
    smallest = numbers(section["identifiability"]["relative_singular_values"])
    note = (
        "Spikes tell four numbers. β, k_d, k_s, C and v are known only up to a common scale; the three gains "
        f"are given for C = {number(section['capacitance_mf'])} mF and v = {number(section['threshold_mv'])} "
        f"mV, as fitted. Of the six singular values of the rates' Jacobian {rank} are not zero; relative to "
        f"the largest they are {', '.join(number(value, 2) for value in smallest[:rank])}, and the others at "
        f"most {number(float(smallest[rank:].max()), 1) if rank < smallest.size else ABSENT}."
    )
    columns = ("number", "fit", "median", f"{level} credible interval", f"{level} by profile likelihood")
    return Table("What the rates determine", columns, rows, note)


def _interval(found: Mapping[str, Any]) -> tuple[str, str]:
    return number(found["median"]), f"{number(found['low'])} … {number(found['high'])}"


def _residuals(section: Mapping[str, Any]) -> Table:
    rows = [
        Row(
            (
                PHASES[phase],
                *_interval(rates["residual_deviation_hz"]),
                *_interval(rates["residual_length_mm"]),
                number(rates["probability_of_independence"], 2),
                fixed(rates["share_within_new"], 2),
            )
        )
        for phase, rates in section["rates"].items()
    ]
    columns = (
        "phase", "standard deviation [spikes/s]", "interval", "alike over [mm]", "interval",
        "probability of independence", "observed within the band",
    )  # fmt: skip
    note = (
        "Residuals of neighbouring positions are alike. That they may be raises the largest log likelihood "
        f"by {number(section['evidence_for_alike_residuals'])}."
    )
    return Table("What the model leaves over", columns, rows, note)


def _convergence(section: Mapping[str, Any]) -> Table:
    names = {
        "ensembles": "independent ensembles",
        "walkers": "walkers of each",
        "draws": "draws kept",
        "evaluations": "evaluations of the model",
        "acceptance": "share of moves taken",
        "r_hat": "largest split R-hat",
        "effective_draws": "effective draws, at least",
        "effective_draws_of_tails": "effective draws of the tails, at least",
        "draws_per_effective_draw": "autocorrelation, draws per effective one, at most",
    }
    found = section["convergence"]
    rows = [Row((text, number(found[key], 4 if key == "r_hat" else 3))) for key, text in names.items()]
    return Table("Convergence of the posterior", ("measure", "value"), rows)
