"""The page of `python -m studies population-timing`: order of first spikes and population rate."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.data import protocol
from fingerpad.report.formatting import fixed, number
from fingerpad.report.manifest import edition, manifest_chapter
from fingerpad.report.parts import Chapter, Drawing, Page, Row, Table
from fingerpad.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    LineStyle,
    new_figure,
    say_nothing_to_draw,
)
from studies.population_timing import (
    AfferentRecruitment,
    PopulationRates,
    PopulationTimingStudy,
    Recruitment,
)

CONTOURS_MS = (10.0, 20.0, 30.0, 50.0, 100.0, 200.0)
LEAST_FOR_CONTOURS = 12
LINES: tuple[LineStyle, ...] = (
    {"color": BLUE, "linestyle": "-"},
    {"color": ORANGE, "linestyle": "--"},
    {"color": GREEN, "linestyle": ":"},
    {"color": BLACK, "linestyle": "-."},
)
MARKERS = ("o", "+", "x", "^")


def draw_recruitment(section: Recruitment) -> Figure:
    """Draw the order of first spikes: ranks on the skin, recruitment over time, latencies of two touches."""
    figure = new_figure(11.0, 9.0)
    panels = figure.subplots(2, 2)
    positions, shown = section.positions_mm, section.afferents
    window = _window(positions, shown)
    for axes, letter, touch in zip(panels[0], "ab", shown, strict=False):
        _ranks(axes, positions, touch, window)
        axes.set_title(f"({letter}) order of first spikes, {touch.name}")
    if len(shown) < 2:
        say_nothing_to_draw(panels[0, 1], "no other touch")
    _over_time(panels[1, 0], section)
    panels[1, 0].set_title("(c) recruited skin")
    _beside(panels[1, 1], shown)
    panels[1, 1].set_title("(d) first spikes, touch by touch")
    return figure


def _window(positions: FloatArray, shown: Sequence[AfferentRecruitment]) -> FloatArray:
    """Return the square about all afferents that fire, rows x and z, columns low and high. [mm]"""
    fires = np.any([np.isfinite(touch.recruitment_rank) for touch in shown], axis=0)
    plane = positions[fires if fires.any() else slice(None)][:, [0, -1]]
    low, high = plane.min(axis=0), plane.max(axis=0)
    reach = 0.55 * max(float((high - low).max()), 1.0)
    middle = 0.5 * (low + high)
    return np.stack([middle - reach, middle + reach], axis=1)


def _ranks(axes: Axes, positions: FloatArray, touch: AfferentRecruitment, window: FloatArray) -> None:
    """Colour each afferent by its place in the order, with lines of equal latency."""
    x, z = positions[:, 0], positions[:, -1]
    rank, latency = touch.recruitment_rank, touch.first_spike_latency_ms
    fires = np.isfinite(rank)
    inside = (positions[:, [0, -1]] >= window[:, 0]) & (positions[:, [0, -1]] <= window[:, 1])
    size = _dot(int(inside.all(axis=1).sum()))
    axes.scatter(x[~fires], z[~fires], s=size, color=PALE, linewidths=0.0)
    axes.set_aspect("equal")
    axes.set(xlim=window[0], ylim=window[1])
    axes.grid(visible=False)
    axes.set_xlabel("along the finger, x [mm]")
    axes.set_ylabel("across, z [mm]")
    if not fires.any():
        axes.text(0.5, 0.5, "no afferent fires", ha="center", color=GREY, transform=axes.transAxes)
        return
    dots = axes.scatter(x[fires], z[fires], s=size, c=rank[fires], cmap="viridis_r", linewidths=0.0, vmin=1.0)
    axes.figure.colorbar(dots, ax=axes, label="rank in the order", shrink=0.85)
    levels = [level for level in CONTOURS_MS if latency[fires].min() < level < latency[fires].max()]
    if levels and fires.sum() >= LEAST_FOR_CONTOURS:
        lines = axes.tricontour(x[fires], z[fires], latency[fires], levels, colors=BLACK, linewidths=0.8)
        axes.clabel(lines, fmt="%g ms", fontsize=8)


def _dot(count: int) -> float:
    """Area of a dot: smaller for more dots, within limits. [points2]"""
    return float(np.clip(30_000.0 / max(count, 1), 8.0, 120.0))


def _over_time(axes: Axes, section: Recruitment) -> None:
    area = section.area_per_afferent_mm2
    for line, touch in zip(LINES, section.afferents, strict=False):
        latency = np.sort(touch.first_spike_latency_ms)
        latency = latency[np.isfinite(latency)]
        axes.step(latency, area * np.arange(1, latency.size + 1), where="post", label=touch.name, **line)
    axes.axvline(protocol.RAMP.value, color=GREY, linewidth=0.8)
    axes.text(
        protocol.RAMP.value, 0.02, " end of ramp", transform=axes.get_xaxis_transform(), color=GREY, size=8
    )
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("time from onset [ms]")
    axes.set_ylabel("skin whose afferents have fired [mm²]\n= afferents at 100 per cm²")
    axes.legend(loc="upper left")


def _beside(axes: Axes, shown: Sequence[AfferentRecruitment]) -> None:
    if len(shown) < 2:
        say_nothing_to_draw(axes, "no other touch")
        return
    first = shown[0].first_spike_latency_ms
    for line, marker, touch in zip(LINES[1:], MARKERS[1:], shown[1:], strict=False):
        other = touch.first_spike_latency_ms
        axes.plot(first, other, marker, markersize=3.5, color=line["color"], label=touch.name)
    known = first[np.isfinite(first)]
    if known.size:
        span = [known.min(), known.max()]
        axes.plot(span, span, color=BLACK, linewidth=0.8, label="no change")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_major_formatter("{x:g}")
    axes.set_xlabel(f"latency under {shown[0].name} [ms]")
    axes.set_ylabel("latency under another touch [ms]")
    axes.legend(loc="upper left")


def caption_recruitment(section: Recruitment) -> str:
    """Caption of the figure, with the changes of the order."""
    first, *others = section.touches
    changes = "; ".join(
        f"{touch.name}: rank correlation {fixed(touch.rank_correlation, 3)}, "
        f"{percent(touch.swapped)} of the pairs in reversed order"
        for touch in others
        if touch.name in {shown.name for shown in section.afferents}
    )
    return (
        "Recruitment by first spikes; one dot per afferent of a dense layout. (a, b) Rank in the order, the "
        "first in yellow, with lines through afferents that fire at the same time; pale ones are not "
        "recruited. (c) Skin whose afferents have fired. (d) Latency of each afferent under two touches: "
        "equal on the line; the order differs only where the dots scatter about an increasing curve. "
        + (f"Against {first.name}: {changes}. " if changes else "")
        + resting_note(
            section.resting_latency_ms,
            "They count as recruited if their latency under touch is at most half of that. ",
        )
        + "The paper mentions the order of first spikes as a code (section 4.2) and does not use it."
    )


def recruitment_tables(section: Recruitment) -> list[Table]:
    """Return recruitment under every touch, and how its order differs from that under the first."""
    rows = [
        Row(
            (
                touch.name,
                fixed(touch.recruited_mm2, 1),
                fixed(touch.recruited_in_ramp_mm2, 1),
                fixed(touch.first_ms, 1),
                fixed(touch.median_ms, 1),
                fixed(touch.rank_correlation, 3),
                percent(touch.swapped),
            )
        )
        for touch in section.touches
    ]
    first = section.touches[0].name
    return [
        Table(
            "Recruitment by first spikes",
            (
                "touch",
                "skin recruited, mm²",
                "by the end of the ramp, mm²",
                "first spike, ms",
                "median first spike, ms",
                f"rank correlation with {first}",
                "pairs in reversed order",
            ),
            rows,
            "At 100 afferents per cm², 1 mm² of skin has one afferent. Orders are compared over the "
            "afferents that both touches recruit.",
        )
    ]


def resting_note(latency_ms: float, then: str) -> str:
    """Return a sentence on the latency without touch and a second one; nothing if afferents are silent.

    Examples
    --------
    >>> resting_note(258.3, "So they do.")
    'Without touch these afferents first fire at 258 ms. So they do.'
    >>> resting_note(np.nan, "So they do.")
    ''
    """
    if not np.isfinite(latency_ms):
        return ""
    return f"Without touch these afferents first fire at {number(latency_ms)} ms. {then}"


def percent(share: float | None) -> str:
    """Return a share in percent with one decimal, or a dash.

    Examples
    --------
    >>> percent(0.0127), percent(None)
    ('1.3 %', '– %')
    """
    return f"{fixed(None if share is None else 100.0 * share, 1)} %"


RING_LINES: tuple[LineStyle, ...] = (
    {"color": BLACK, "linestyle": "-"},
    {"color": BLUE, "linestyle": "--"},
    {"color": ORANGE, "linestyle": "-."},
    {"color": GREEN, "linestyle": ":"},
    {"color": GREY, "linestyle": "-"},
)
EARLY_MS = 150.0
"""End of the left column, where most happens. [ms]"""


def draw_population_rate(section: PopulationRates) -> Figure:
    """Draw the rate of each ring, the share of it that fires, and the rate of all rings under every touch."""
    figure = new_figure(12.0, 10.0)
    panels = figure.subplots(3, 2, width_ratios=(1.4, 1.0), sharey="row")
    edges, active_edges, first = section.edges_ms, section.active_edges_ms, section.touches[0]
    names = [f"{number(inner)} to {number(outer)} mm" for inner, outer in pairwise(section.radii_mm)]
    for axes in panels[0]:
        _steps(axes, edges, first.rate_hz, names)
    for axes in panels[1]:
        _steps(axes, active_edges, first.active_fraction, names)
    together = np.array([touch.together_per_cm2_hz for touch in section.touches])
    for axes in panels[2]:
        _steps(axes, edges, together / 1000.0, [touch.name for touch in section.touches])
    for (early, late), letter, what in zip(
        panels, "abc", ("rate of a ring", "share that fires", "rate of all rings"), strict=True
    ):
        early.set_title(f"({letter}) {what}" + (f", {first.name}" if letter != "c" else ""))
        early.set_xlim(0.0, EARLY_MS)
        late.set_xlim(EARLY_MS, edges[-1])
        early.axvline(protocol.RAMP.value, color=GREY, linewidth=0.8)
        early.set_ylim(bottom=0.0)
        early.legend(loc="upper right")
    panels[0, 0].set_ylabel("rate per afferent [spikes/s]")
    per_cm2 = section.density_per_cm2 / 1000.0
    beside = panels[0, 1].secondary_yaxis(
        "right", functions=(lambda rate: rate * per_cm2, lambda rate: rate / per_cm2)
    )
    beside.set_ylabel(f"at {number(section.density_per_cm2)} per cm² [1000 spikes/s per cm²]")
    panels[1, 0].set_ylabel(f"afferents that fire within {number(active_edges[1] - active_edges[0])} ms")
    panels[2, 0].set_ylabel("rate of skin [1000 spikes/s per cm²]")
    for axes in panels[2]:
        axes.set_xlabel("time from onset [ms]")
    return figure


def _steps(axes: Axes, edges: FloatArray, rows: FloatArray, names: list[str]) -> None:
    for row, (values, name) in enumerate(zip(rows, names, strict=True)):
        axes.stairs(
            values, edges, baseline=None, label=name, linewidth=1.6, **RING_LINES[row % len(RING_LINES)]
        )


def caption_population_rate(section: PopulationRates) -> str:
    """Caption of the figure."""
    inner, outer = section.radii_mm[0], section.radii_mm[-1]
    return (
        "Population rate over time: all spikes of the afferents at a distance from the middle of the "
        f"contact, per bin, smoothed by a normal density of {number(section.smoothing_ms)} ms that preserves "
        "their number. Left: ramp and start of the hold; right: rest of the hold. (a) Per afferent, silent "
        f"ones included, and per area of skin at {number(section.density_per_cm2)} afferents per cm². (b) "
        "Share of the afferents that fire at least once in a bin. (c) All afferents from "
        f"{number(inner)} to {number(outer)} mm together, under "
        + " and ".join(touch.name for touch in section.touches)
        + ". The model has no noise here, so neighbours fire almost synchronously, which causes ripples. "
        + resting_note(
            section.resting_latency_ms,
            "All start at onset: peaks shortly before its multiples are not caused by the touch.",
        )
    )


def population_timing_page(result: PopulationTimingStudy) -> Page:
    """Return the page of `python -m studies population-timing`."""
    order, rates = result.timing.recruitment, result.timing.rates
    return Page(
        "Population over time",
        f"Order of first spikes and population rate under the paper's spheres. {edition(result.manifest)}.",
        [],
        [
            Chapter(
                "Order of first spikes",
                [
                    Drawing(
                        "recruitment",
                        "Order of first spikes",
                        partial(draw_recruitment, order),
                        caption_recruitment(order),
                    ),
                    *recruitment_tables(order),
                ],
            ),
            Chapter(
                "Population rate",
                [
                    Drawing(
                        "population_rate",
                        "Population rate",
                        partial(draw_population_rate, rates),
                        caption_population_rate(rates),
                    )
                ],
            ),
            manifest_chapter(result.manifest),
        ],
    )
