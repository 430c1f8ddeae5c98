"""Which quantity drives the afferent: rates by quantity as small multiples, and tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.report.formatting import ABSENT, PHASES, fixed
from fingerpad.report.parts import Row, Table
from fingerpad.report.single_unit import BAR_HALF_WIDTH_MM
from fingerpad.report.style import BLACK, BLUE, GREY, PALE, new_figure, numbers

QUANTITIES = {
    "stored": "strain energy density",
    "instantaneous": "instantaneous energy density",
    "work": "work density",
    "von_mises": "von Mises stress",
    "compressive_stress": "compressive stress",
    "compressive_strain": "compressive strain",
}
FSS = ("fss_in_sample", "fss_out_of_sample")
_DECIMALS = 3


def draw(section: Mapping[str, Any]) -> Figure:
    """Draw rates against the position of the bar: a column per candidate, the ramp above the hold.

    Parameters
    ----------
    section : dict
        What `studies.drive_quantities.result` returns.

    Returns
    -------
    Figure
    """
    candidates = section["candidates"]
    figure = new_figure(2.6 * len(candidates), 5.4)
    grid = figure.subplots(len(PHASES), len(candidates), sharex=True, sharey="row", squeeze=False)
    for phase, row in zip(PHASES, grid, strict=True):
        for candidate, axes in zip(candidates, row, strict=True):
            _panel(axes, section, candidate, phase)
        row[0].set_ylabel(f"{PHASES[phase]}\nfiring rate [spikes/s]")
        row[0].set_ylim(bottom=0.0)
    for candidate, top, axes in zip(candidates, *grid, strict=True):
        top.set_title(_words(candidate, ";\ndynamic: "), fontsize=9.0)
        axes.set_xlabel("position of the bar [mm]")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _panel(axes: Axes, section: Mapping[str, Any], candidate: Mapping[str, Any], phase: str) -> None:
    shift_mm = numbers(section["shift_mm"])
    axes.axvspan(-BAR_HALF_WIDTH_MM, BAR_HALF_WIDTH_MM, color=PALE, zorder=0)
    axes.plot(shift_mm, numbers(candidate[f"{phase}_rate_hz"]), color=BLUE, label="fitted to all positions")
    axes.plot(
        shift_mm,
        numbers(candidate[f"left_out_{phase}_rate_hz"]),
        linestyle="none",
        marker="x",
        markersize=4.5,
        color=BLACK,
        label="not fitted to this position",
    )
    axes.plot(
        shift_mm,
        numbers(section[f"observed_{phase}_rate_hz"]),
        "o",
        color=GREY,
        markerfacecolor="white",
        markersize=4.5,
        zorder=1.5,
        label="observed",
    )
    axes.text(
        0.03,
        0.97,
        f"FSS {fixed(candidate['fit'][f'fss_out_of_sample_{phase}'], 2)}",
        transform=axes.transAxes,
        va="top",
        fontsize=8.5,
    )


def caption(section: Mapping[str, Any]) -> str:
    """Say what is shown and which quantity predicts best."""
    candidates = section["candidates"]
    best = max(candidates, key=lambda candidate: candidate["fit"]["fss_out_of_sample"] or 0.0)
    paper = candidates[0]
    return (
        "Rates of one afferent under the bar, by the quantity that drives it; proximal positions are "
        "positive, shaded ones cover the receptor. Lines are fitted to all positions; each cross is "
        "predicted by the fit of a fold that did not know its position, and the fractional sum of squares "
        "(FSS) is the mean of the folds. Four numbers "
        f"are free in every column. Best predicts: {_words(best)}, FSS "
        f"{fixed(best['fit']['fss_out_of_sample'], _DECIMALS)} on positions that were not fitted to, against "
        f"{fixed(paper['fit']['fss_out_of_sample'], _DECIMALS)} with {_words(paper)}."
    )


def table(section: Mapping[str, Any]) -> list[Table]:
    """Return FSS by quantity, a table per method."""
    methods = {"fit": section["method"], "response_surface": "response surface"}
    return [
        Table(f"By quantity, {name}", _QUANTITY_COLUMNS, [_quantity_row(one, key) for one in fitted], _NOTE)
        for key, name in methods.items()
        if (fitted := [candidate for candidate in section["candidates"] if key in candidate])
    ]


_QUANTITY_COLUMNS = (
    "the current follows",
    "FSS in sample",
    "dynamic",
    "static",
    "out of sample",
    "dynamic",
    "static",
    "folds",
    "gain, 95 %",
)
_NOTE = (
    "Out of sample: mean over the folds; folds: the smallest and the largest. Gain: FSS out of sample over "
    "the first row, by a bootstrap over blocks of three shifts; an interval beside 0 is a difference that "
    "does not hang on single shifts."
)


def _quantity_row(candidate: Mapping[str, Any], key: str) -> Row:
    fit = candidate[key]
    scores = [fixed(fit[name + phase], _DECIMALS) for name in FSS for phase in ("", "_dynamic", "_static")]
    folds = sorted(score for score in fit["fss_folds"] if score is not None)
    spread = f"{fixed(folds[0], 2)} … {fixed(folds[-1], 2)}" if folds else ABSENT
    return Row((_words(candidate), *scores, spread, gain(fit["gain_interval"])))


def gain(bounds: Any) -> str:
    """Return an interval of what is gained, with its signs.

    Examples
    --------
    >>> gain((-0.02, 0.1)), gain((0.0, 0.0))
    ('−0.020 … +0.100', '–')
    """
    low, high = bounds
    # The row that others are compared with gains nothing, and nothing is known of an empty one.
    if not low and not high:
        return ABSENT
    return f"{_signed(low)} … {_signed(high)}"


def _signed(value: float) -> str:
    text = fixed(value, _DECIMALS)
    return text if value < 0.0 else f"+{text}"


def _words(candidate: Mapping[str, Any], between: str = ", dynamic term ") -> str:
    static, dynamic = (QUANTITIES.get(candidate[term], candidate[term]) for term in ("static", "dynamic"))
    return static if static == dynamic else f"{static}{between}{dynamic}"
