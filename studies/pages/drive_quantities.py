"""Quantity that drives the afferent: rates by quantity, and tables."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.report.formatting import ABSENT, PHASE_LABELS, fixed
from fingerpad.report.parts import Row, Table
from fingerpad.report.single_unit import BAR_HALF_WIDTH_MM
from fingerpad.report.style import BLACK, BLUE, GREY, PALE, new_figure
from studies.drive_fits import DriveFit
from studies.drive_quantities import DriveCandidate, DriveResult

QUANTITIES = {
    "stored": "strain energy density",
    "instantaneous": "instantaneous energy density",
    "work": "work density",
    "von_mises": "von Mises stress",
    "compressive_stress": "compressive stress",
    "compressive_strain": "compressive strain",
}
_DECIMALS = 3


def draw_drive_quantities(section: DriveResult) -> Figure:
    """Draw rates against the position of the bar: a column per candidate, the ramp above the hold."""
    candidates = section.candidates
    figure = new_figure(2.6 * len(candidates), 5.4)
    grid = figure.subplots(len(PHASE_LABELS), len(candidates), sharex=True, sharey="row", squeeze=False)
    for candidate, ramp, hold in zip(candidates, *grid, strict=True):
        _draw_rates(
            ramp,
            section.shift_mm,
            candidate.dynamic_rate_hz,
            candidate.left_out_dynamic_rate_hz,
            section.observed_dynamic_rate_hz,
            candidate.fit.fss_out_of_sample_dynamic,
        )
        _draw_rates(
            hold,
            section.shift_mm,
            candidate.static_rate_hz,
            candidate.left_out_static_rate_hz,
            section.observed_static_rate_hz,
            candidate.fit.fss_out_of_sample_static,
        )
        ramp.set_title(drivers_label(candidate, ";\ndynamic: "), fontsize=9.0)
        hold.set_xlabel("position of the bar [mm]")
    for phase, (first, *_) in zip(PHASE_LABELS.values(), grid, strict=True):
        first.set_ylabel(f"{phase}\nfiring rate [spikes/s]")
        first.set_ylim(bottom=0.0)
    figure.legend(*hold.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _draw_rates(
    axes: Axes,
    shift_mm: FloatArray,
    fitted_hz: FloatArray,
    left_out_hz: FloatArray,
    observed_hz: FloatArray,
    fss: float,
) -> None:
    axes.axvspan(-BAR_HALF_WIDTH_MM, BAR_HALF_WIDTH_MM, color=PALE, zorder=0)
    axes.plot(shift_mm, fitted_hz, color=BLUE, label="fitted to all positions")
    axes.plot(
        shift_mm,
        left_out_hz,
        linestyle="none",
        marker="x",
        markersize=4.5,
        color=BLACK,
        label="not fitted to this position",
    )
    axes.plot(
        shift_mm,
        observed_hz,
        "o",
        color=GREY,
        markerfacecolor="white",
        markersize=4.5,
        zorder=1.5,
        label="observed",
    )
    axes.text(0.03, 0.97, f"FSS {fixed(fss, 2)}", transform=axes.transAxes, va="top", fontsize=8.5)


def caption_drive_quantities(section: DriveResult) -> str:
    """Describe the figure and name the quantity with the best prediction."""
    paper, *_ = section.candidates
    best = max(section.candidates, key=lambda candidate: candidate.fit.fss_out_of_sample)
    return (
        "Rates of one afferent under the bar, by the quantity that drives it; proximal positions are "
        "positive, shaded ones cover the receptor. Lines are fitted to all positions; each cross is "
        "predicted by the fit of a fold that did not use its position, and the fractional sum of squares "
        "(FSS) is the mean of the folds. Four numbers are free in every column. Best out of sample: "
        f"{drivers_label(best)}, FSS {fixed(best.fit.fss_out_of_sample, _DECIMALS)}, against "
        f"{fixed(paper.fit.fss_out_of_sample, _DECIMALS)} with {drivers_label(paper)}."
    )


def drive_tables(section: DriveResult) -> list[Table]:
    """Return FSS by quantity, a table per method."""
    fits = [(drivers_label(candidate), candidate.fit) for candidate in section.candidates]
    surfaces = [
        (drivers_label(candidate), candidate.response_surface)
        for candidate in section.candidates
        if candidate.response_surface is not None
    ]
    return [
        Table(f"By quantity, {method}", _COLUMNS, [_row(name, fit) for name, fit in fitted], _NOTE)
        for method, fitted in ((section.method, fits), ("response surface", surfaces))
        if fitted
    ]


_COLUMNS = (
    "quantity of the current",
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
    "the first row, by a bootstrap over blocks of three shifts; if the interval excludes 0, the difference "
    "does not depend on single shifts."
)


def _row(name: str, fit: DriveFit) -> Row:
    scores = (
        fit.fss_in_sample,
        fit.fss_in_sample_dynamic,
        fit.fss_in_sample_static,
        fit.fss_out_of_sample,
        fit.fss_out_of_sample_dynamic,
        fit.fss_out_of_sample_static,
    )
    spread = " … ".join(fixed(fss, 2) for fss in (fit.fss_folds.min(), fit.fss_folds.max()))
    return Row((name, *(fixed(score, _DECIMALS) for score in scores), spread, gain(fit.gain_interval)))


def gain(bounds: tuple[float, float]) -> str:
    """Return an interval of what is gained, with its signs.

    Examples
    --------
    >>> gain((-0.02, 0.1)), gain((0.0, 0.0))
    ('−0.020 … +0.100', '–')
    """
    low, high = bounds
    # The row that others are compared with has no gain, and an empty row has none that is known.
    if not abs(low) + abs(high) > 0.0:
        return ABSENT
    return f"{_signed(low)} … {_signed(high)}"


def _signed(value: float) -> str:
    text = fixed(value, _DECIMALS)
    return text if value < 0.0 else f"+{text}"


def drivers_label(candidate: DriveCandidate, between: str = ", dynamic term ") -> str:
    """Return the quantities of both terms as text."""
    static, dynamic = QUANTITIES[candidate.static], QUANTITIES[candidate.dynamic]
    return static if static == dynamic else f"{static}{between}{dynamic}"
