"""Profile likelihoods and Sobol indices of the four numbers, for every page of a fit to rates."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from fingerpad.experiments.fit.results import FssSensitivity, ParameterProfile
from fingerpad.report.formatting import IDENTIFIABLE_SYMBOLS, fixed, number
from fingerpad.report.parts import Row, Table
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE

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
