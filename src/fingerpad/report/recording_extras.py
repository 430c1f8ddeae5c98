"""What a fit to recordings tells beside itself: profiles, sensitivity, and the place of the receptor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from fingerpad.report.formatting import ABSENT, IDENTIFIABLE_SYMBOLS, fixed, number
from fingerpad.report.parts import Row, Table
from fingerpad.report.rate_uncertainty import draw_indices, draw_profile, profile_ends, sensitivity_table
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, new_figure, numbers

FSS = ("fss_in_sample", "fss_in_sample_dynamic", "fss_in_sample_static", "fss_out_of_sample")


def draw_profiles(section: Mapping[str, Any]) -> Figure:
    """Draw the profile of each of the four numbers.

    Parameters
    ----------
    section : dict
        `results["fit"]` of `studies.recording_session.run`.

    Returns
    -------
    Figure
    """
    figure = new_figure(10.0, 3.2)
    intervals = (section["posterior"] or {}).get("interval") or {}
    panels = figure.subplots(1, len(section["profiles"]), sharey=True)
    for axes, profile in zip(panels, section["profiles"], strict=True):
        name = profile["name"]
        unit = section["identifiable_units"][name]
        draw_profile(axes, profile, unit, section["identifiable"][name], intervals.get(name))
    panels[0].set_ylabel("loss of log likelihood")
    return figure


def caption_profiles(section: Mapping[str, Any]) -> str:
    """Say what a profile is and what is marked."""
    beneath = ", the bar beneath is the credible interval" if section["posterior"] else ""
    return (
        "Loss of log likelihood with one number held and the others fitted anew. Values below the dashed "
        "line are within the 95 % interval; a side that never crosses it is open: the rates do not bound the "
        f"number there. The orange line is the fit{beneath}. The fit maximises FSS, which weighs phases and "
        "neighbours otherwise than the likelihood does, and may lie beside the least loss. Profiles have "
        "lumps since rates jump where a spike enters a window."
    )


def profile_tables(section: Mapping[str, Any]) -> list[Table]:
    """Return the intervals of the profiles beside the fit."""
    rows = [
        Row(
            (
                f"{IDENTIFIABLE_SYMBOLS[profile['name']]} [{section['identifiable_units'][profile['name']]}]",
                number(section["identifiable"][profile["name"]]),
                profile_ends(profile),
            )
        )
        for profile in section["profiles"]
    ]
    return [Table("Intervals by profile likelihood", ("number", "fitted", "95 % interval"), rows)]


def draw_sensitivity(section: Mapping[str, Any]) -> Figure:
    """Draw Sobol's indices of the four numbers; the section is that of `draw_profiles`."""
    figure = new_figure(6.5, 3.8)
    draw_indices(figure.subplots(), section["sensitivity"])
    return figure


def caption_sensitivity(section: Mapping[str, Any]) -> str:
    """Say which number moves FSS most."""
    total = section["sensitivity"]["total"]
    most = max(zip(total, IDENTIFIABLE_SYMBOLS.values(), strict=True), key=lambda pair: pair[0] or 0.0)[1]
    return (
        "Share of the variance of FSS that each number brings when all are uniform within a quarter of their "
        f"fitted values to either side: hatched, by itself; filled, with all that it does together with "
        f"others. Whiskers are 95 % intervals of the estimate. Most depends on {most}."
    )


def sensitivity_tables(section: Mapping[str, Any]) -> list[Table]:
    """Return the indices and their ranges."""
    return [sensitivity_table(section["sensitivity"], section["identifiable_units"])]


def draw_offset(section: Mapping[str, Any]) -> Figure:
    """Draw the best FSS with the receptor held beside its place, and where fit and folds put it.

    Parameters
    ----------
    section : dict
        As in `draw_profiles`.

    Returns
    -------
    Figure
    """
    found = section["offset"]
    figure = new_figure(6.5, 3.8)
    axes = figure.subplots()
    axes.axvline(0.0, color=GREY, linewidth=1.0)
    held = found["held"]
    axes.plot(
        numbers(held["offset_mm"]), numbers(held["fss_in_sample"]), "o-", color=BLACK, label="held there"
    )
    axes.plot(
        [found["offset_mm"]],
        [found["fss_in_sample"]],
        "D",
        color=ORANGE,
        markersize=7.0,
        label="fitted to all",
    )
    low = axes.get_ylim()[0]
    axes.plot(
        numbers(found["folds_mm"]),
        [low] * len(found["folds_mm"]),
        "|",
        color=BLUE,
        markersize=14.0,
        markeredgewidth=2.0,
        label="fitted without a fold",
        clip_on=False,
    )
    axes.set_ylim(bottom=low)
    axes.set_xlabel("place of the receptor, distal positive [mm]")
    axes.set_ylabel("FSS in sample [1]")
    axes.legend()
    return figure


def caption_offset(section: Mapping[str, Any]) -> str:
    """Say what the place of the receptor takes of the residual."""
    found = section["offset"]
    residual = 1.0 - section["fss_in_sample"]
    taken = (found["fss_in_sample"] - section["fss_in_sample"]) / residual if residual > 0.0 else 0.0
    return (
        "The receptor's place along the finger as one more number. Line: best FSS over all stimuli with the "
        f"receptor held at each place. It is fitted at {number(found['offset_mm'])} mm, which takes "
        f"{fixed(100.0 * taken, 0)} % of the residual in sample; "
        f"out of sample FSS is {fixed(found['fss_out_of_sample'], 3)} instead of "
        f"{fixed(section['fss_out_of_sample'], 3)}. What is gained in sample alone is no evidence that the "
        "receptor lies there."
    )


def offset_tables(section: Mapping[str, Any]) -> list[Table]:
    """Return both fits side by side."""
    found, units = section["offset"], section["identifiable_units"]

    def row(said: str, fit: Mapping[str, Any], offset: str, error: str) -> Row:
        scores = (fixed(fit.get(key), 3) for key in FSS)
        four = (number(fit["identifiable"][name]) for name in IDENTIFIABLE_SYMBOLS)
        return Row((said, offset, error, *scores, *four))

    rows = [
        row("in its place", section, number(0.0), ABSENT),
        row("fitted as well", found, number(found["offset_mm"]), number(found["standard_error_mm"])),
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
        f"{number(found['held']['offset_mm'][0])} and {number(found['held']['offset_mm'][-1])} mm, where the "
        "skin was sampled."
    )
    return [Table("The place of the receptor", columns, rows, note)]
