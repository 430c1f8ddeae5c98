"""Profile likelihoods and Sobol indices of the four numbers, wherever a fit to rates is shown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes

from fingerpad.report.formatting import IDENTIFIABLE_SYMBOLS, fixed, number
from fingerpad.report.parts import Row, Table
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, numbers

LARGEST_LOSS = 5.0
"""Losses of log likelihood that are drawn."""

ALLOWED_LOSS = 1.92
"""Loss at which an interval of 95 % ends: half the quantile of chi-square with one degree of freedom."""


def draw_profile(
    axes: Axes,
    profile: Mapping[str, Any],
    unit: str,
    fitted: float | None,
    credible: tuple[float | None, float | None] | None = None,
) -> None:
    """Draw one profile: its points, the level at which the interval ends, the fit, the posterior's interval.

    Parameters
    ----------
    axes : Axes
        An empty panel.
    profile : mapping
        `name`, `values` and `losses`.
    unit : str
        Of the number.
    fitted : float or None
        Where the fit lies.
    credible : (float, float), optional
        Ends of the credible interval, where one was drawn.
    """
    axes.plot(numbers(profile["values"]), numbers(profile["losses"]), ".-", color=BLACK, linewidth=1.2)
    axes.axhline(ALLOWED_LOSS, color=GREY, linestyle="--", linewidth=1.0)
    if fitted is not None:
        axes.axvline(fitted, color=ORANGE, linestyle="-.", linewidth=1.4)
    if credible is not None:
        axes.plot(numbers(credible), [-0.25, -0.25], color=BLUE, linewidth=4.0, solid_capstyle="butt")
    axes.set_ylim(-0.5, LARGEST_LOSS)
    axes.set_xlabel(f"{IDENTIFIABLE_SYMBOLS[profile['name']]} [{unit}]")


def profile_ends(profile: Mapping[str, Any]) -> str:
    """Return the interval of a profile in words; an end that the rates do not set is open.

    Examples
    --------
    >>> profile_ends({"low": 0.5, "high": None})
    '0.5 … open'
    """
    return " … ".join("open" if end is None else number(end) for end in (profile["low"], profile["high"]))


def draw_indices(axes: Axes, found: Mapping[str, Any]) -> None:
    """Draw the shares that each number brings alone and with others, as bars with their confidence.

    Parameters
    ----------
    axes : Axes
        An empty panel.
    found : mapping
        `first`, `total` and their half widths, in the order of the four numbers.
    """
    kinds = {"total": ("with others", BLUE, -0.19, ""), "first": ("alone", "white", 0.19, "////")}
    for key, (label, colour, side, hatch) in kinds.items():
        axes.bar(
            [place + side for place in range(len(IDENTIFIABLE_SYMBOLS))],
            numbers(found[key]),
            0.36,
            yerr=numbers(found[f"{key}_half_width"]),
            color=colour,
            edgecolor=BLACK,
            linewidth=0.8,
            hatch=hatch,
            error_kw={"elinewidth": 1.0, "ecolor": BLACK, "capsize": 3.0},
            label=label,
        )
    axes.set_xticks(range(len(IDENTIFIABLE_SYMBOLS)), IDENTIFIABLE_SYMBOLS.values())
    axes.set_xlabel("number")
    axes.set_ylabel("share of the variance of FSS [1]")
    axes.axhline(0.0, color=BLACK, linewidth=0.8)
    axes.legend()


def sensitivity_table(found: Mapping[str, Any], units: Mapping[str, str]) -> Table:
    """Return Sobol's indices of the four numbers and the ranges that they belong to.

    Parameters
    ----------
    found : mapping
        What `studies.rate_uncertainty.sensitivity` returns.
    units : mapping of str to str
        Units of the four numbers.

    Returns
    -------
    Table
    """
    rows = [
        Row(
            (
                f"{symbol} [{units[name]}]",
                f"{number(found['lower'][index])} … {number(found['upper'][index])}",
                f"{fixed(found['first'][index], 2)} ± {fixed(found['first_half_width'][index], 2)}",
                f"{fixed(found['total'][index], 2)} ± {fixed(found['total_half_width'][index], 2)}",
            )
        )
        for index, (name, symbol) in enumerate(IDENTIFIABLE_SYMBOLS.items())
    ]
    note = (
        "Share of the variance of the weighted FSS when each number is uniform within its range: by itself, "
        f"and with all that it does together with others. FSS is {fixed(found['mean_fss'], 3)} ± "
        f"{fixed(found['deviation_fss'], 3)} over the ranges; {number(found['evaluations'])} evaluations."
    )
    columns = ("number", "range", "first-order index", "total index")
    return Table("What the fit is sensitive to (Sobol)", columns, rows, note)
