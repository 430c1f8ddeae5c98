"""Further parts of the page of a fit: profile likelihoods, sensitivity, and offset of the receptor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from matplotlib.figure import Figure

from fingerpad.experiments.fit.results import FitResult, OffsetFit
from fingerpad.report.formatting import ABSENT, IDENTIFIABLE_SYMBOLS, fixed, number
from fingerpad.report.parts import Row, Table
from fingerpad.report.rate_uncertainty import draw_indices, draw_profile, profile_ends, sensitivity_table
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, new_figure

_Part = TypeVar("_Part")


def draw_profiles(found: FitResult) -> Figure:
    """Draw the profile of each of the four numbers."""
    figure = new_figure(10.0, 3.2)
    intervals = found.posterior.interval if found.posterior else {}
    panels = figure.subplots(1, len(_present(found.profiles)), sharey=True)
    for axes, profile in zip(panels, _present(found.profiles), strict=True):
        name = profile.name
        unit = found.identifiable_units[name]
        draw_profile(axes, profile, unit, found.identifiable[name], intervals.get(name))
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
    """Tables of the intervals of the profiles."""
    rows = [
        Row(
            (
                f"{IDENTIFIABLE_SYMBOLS[profile.name]} [{found.identifiable_units[profile.name]}]",
                number(found.identifiable[profile.name]),
                profile_ends(profile),
            )
        )
        for profile in _present(found.profiles)
    ]
    return [Table("Intervals by profile likelihood", ("number", "fitted", "95 % interval"), rows)]


def draw_sensitivity(found: FitResult) -> Figure:
    """Draw the Sobol indices of the four numbers."""
    figure = new_figure(6.5, 3.8)
    draw_indices(figure.subplots(), _present(found.sensitivity))
    return figure


def caption_sensitivity(found: FitResult) -> str:
    """Caption of the Sobol indices."""
    total = _present(found.sensitivity).total
    most = max(zip(total, IDENTIFIABLE_SYMBOLS.values(), strict=True), key=lambda pair: pair[0])[1]
    return (
        "Share of the variance of FSS due to each parameter if all are uniform within a quarter of their "
        f"fitted values: hatched, alone (first-order index); filled, with all interactions (total index). "
        f"Whiskers are 95 % intervals of the estimate. The largest total index is that of {most}."
    )


def sensitivity_tables(found: FitResult) -> list[Table]:
    """Tables of the indices and their ranges."""
    return [sensitivity_table(_present(found.sensitivity), found.identifiable_units)]


def draw_offset(found: FitResult) -> Figure:
    """Draw the best FSS with the receptor held at each offset, and the offsets of the fit and the folds."""
    offset = _present(found.offset)
    figure = new_figure(6.5, 3.8)
    axes = figure.subplots()
    axes.axvline(0.0, color=GREY, linewidth=1.0)
    axes.plot(offset.held.offset_mm, offset.held.fss_in_sample, "o-", color=BLACK, label="held there")
    axes.plot(
        [offset.offset_mm],
        [offset.fss_in_sample],
        "D",
        color=ORANGE,
        markersize=7.0,
        label="fitted to all",
    )
    low = axes.get_ylim()[0]
    axes.plot(
        offset.folds_mm,
        [low] * len(offset.folds_mm),
        "|",
        color=BLUE,
        markersize=14.0,
        markeredgewidth=2.0,
        label="fitted without a fold",
        clip_on=False,
    )
    axes.set_ylim(bottom=low)
    axes.set_xlabel("offset of the receptor, distal positive [mm]")
    axes.set_ylabel("FSS in sample [1]")
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
    """Tables of both fits side by side."""
    offset, units, phases = _present(found.offset), found.identifiable_units, ("dynamic", "static")

    def cells(fit: FitResult | OffsetFit, fss_by_phase: Sequence[float | None]) -> list[str]:
        scores = (fit.fss_in_sample, *fss_by_phase, fit.fss_out_of_sample)
        four = (number(fit.identifiable[name]) for name in IDENTIFIABLE_SYMBOLS)
        return [*(fixed(score, 3) for score in scores), *four]

    at_zero = cells(found, [found.phases[phase].fss_in_sample for phase in phases])
    fitted = cells(offset, [offset.fss_by_phase.get(phase) for phase in phases])
    rows = [
        Row(("at 0 mm", number(0.0), ABSENT, *at_zero)),
        Row(("offset fitted", number(offset.offset_mm), number(offset.standard_error_mm), *fitted)),
    ]
    columns = (
        "receptor",
        "offset [mm]",
        "standard error [mm]",
        "FSS, all stimuli",
        "dynamic",
        "static",
        "out of sample",
        *(f"{symbol} [{units[name]}]" for name, symbol in IDENTIFIABLE_SYMBOLS.items()),
    )
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
