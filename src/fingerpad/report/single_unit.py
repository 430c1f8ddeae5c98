"""Level 2, Figure 5: firing rates of one afferent as a bar moves across its receptive field."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from fingerpad.data import paper, protocol
from fingerpad.report.formatting import PHASES, fixed, number
from fingerpad.report.style import BLACK, BLUE, new_figure, numbers

BAR_HALF_WIDTH_MM = protocol.BAR_WIDTH.value / 2.0


def draw(section: dict[str, Any]) -> Figure:
    """Draw Figure 5: dynamic rates on the left, static rates on the right.

    Parameters
    ----------
    section : dict
        `results["single_unit"]`.

    Returns
    -------
    Figure
    """
    figure = new_figure(10.0, 4.5)
    shift = numbers(section["shift_mm"])
    for axes, (phase, name) in zip(figure.subplots(1, 2), PHASES.items(), strict=True):
        fit = section.get(f"fss_in_sample_{phase}")
        axes.axvspan(-BAR_HALF_WIDTH_MM, BAR_HALF_WIDTH_MM, color="#f3f1ea", zorder=0)
        axes.plot(
            shift,
            numbers(section[f"{phase}_rate_hz"]),
            color=BLUE,
            label="predicted",
        )
        axes.plot(
            shift,
            numbers(section[f"observed_{phase}_rate_hz"]),
            "o",
            color=BLACK,
            markerfacecolor="white",
            markersize=5.0,
            label="observed",
        )
        axes.set_title(f"({'ab'[phase == 'static']}) {name}" + ("" if fit is None else f", FSS = {fit:.2f}"))
        axes.set_xlabel("position of the bar, proximal positive [mm]")
        axes.set_ylabel("firing rate [spikes/s]")
        axes.set_ylim(bottom=0.0)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def caption(section: dict[str, Any]) -> str:
    """Say what Figure 5 shows and what the paper found."""
    ours = section.get("fss_out_of_sample")
    return (
        f"Firing rate of one SAI afferent under a bar {protocol.BAR_WIDTH.value} mm wide, pressed in by "
        f"{protocol.DEPTH.value} mm at {len(section['shift_mm'])} positions relative to the centre of its "
        "receptive field; shaded: positions at which the bar covers the centre. Observed: Phillips & "
        "Johnson 1981. The line is predicted with the parameters below. Fractional sum of squares (FSS, 1 "
        f"is perfect) on positions that were not used for fitting: {fixed(ours, 2)} here, "
        f"{fixed(paper.FSS_OUT_OF_SAMPLE.value, 2)} in the paper. The paper's dynamic rates run from "
        f"{number(paper.DYNAMIC_RATE_MINIMUM.value)} to {number(paper.DYNAMIC_RATE_MAXIMUM.value)} spikes/s."
    )
