"""Figure 3: the steps from firing rates to a hit rate, with the letters of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from fingerpad.experiments.gerling2014.sphere_discrimination import SphereDiscrimination
from fingerpad.report.formatting import fixed, number
from fingerpad.report.style import BLACK, BLUE, ORANGE, PALE, new_figure

COLUMNS = (0.0, 1.05, 2.2, 3.4, 4.7, 5.95)
ROWS = {"gradient": 2.0, "start": 1.0, "euclidean": 0.0}
"""Places of the boxes: heights are those of the two codes and of what they share."""


def draw_steps(section: SphereDiscrimination) -> Figure:
    """Draw Figure 3: what each code does, from left to right.

    Parameters
    ----------
    section : SphereDiscrimination
        Of a run.

    Returns
    -------
    Figure
    """
    figure = new_figure(10.6, 3.3)
    axes = figure.add_subplot()
    axes.set(xlim=(-0.45, 6.5), ylim=(-0.85, 2.85))
    axes.set_axis_off()
    standard, *_, last = section.gradient_sums["static"][0]
    start = [
        f"static rates of all\nafferents, {section.curvature_per_m.size} spheres",
        f"(a) each rate times\nNormal(1, σ₁)\nσ₁ = {number(section.noise_sigma)}",
    ]
    gradient = [
        "(b) absolute differences\nfrom the neighbours",
        f"(c) sum over afferents\nwithout noise {number(standard)} …\n{number(last)} spikes/s",
        "(d-h) 100 sums per sphere:\nμ₂ and σ₂; signal detection\nagainst the standard, β = 0.5",
        _hit_rates(section, "gradient_sum"),
    ]
    euclidean = [
        "(b*, c*) 100 sets\nof noisy rates per sphere",
        "(d*-f*) absolute differences\nfrom a set of the standard,\nsummed; 100 sums per sphere",
        "(g*, h*) decision point\nhalf-way between the means\nof sphere and standard",
        _hit_rates(section, "euclidean"),
    ]
    noisy = _row(axes, start, 0, "start", BLACK)[-1]
    for row, texts, colour in (("gradient", gradient, BLUE), ("euclidean", euclidean, ORANGE)):
        _arrow(axes, noisy, _row(axes, texts, len(start), row, colour)[0])
    for name, height, colour in (("Gradient Sum", 2.6, BLUE), ("Euclidean Distance", -0.6, ORANGE)):
        axes.text(COLUMNS[2], height, name, color=colour, fontweight="bold", ha="center", va="center")
    return figure


def _hit_rates(section: SphereDiscrimination, code: str) -> str:
    found = {"gradient_sum": section.gradient_sum, "euclidean": section.euclidean}[code].get("static")
    if found is None:
        return "no hit rates:\nthe population is silent"
    ends = zip(
        section.curvature_per_m[[1, -1]], found.hit_rate[[0, -1]], found.hit_rate_sd[[0, -1]], strict=True
    )
    lines = [f"{number(at)} 1/m: {fixed(mean, 2)} ± {fixed(spread, 2)}" for at, mean, spread in ends]
    return "\n".join(["(i-k) 100 hit rates: μ₃ ± σ₃", *lines])


def _row(axes: Axes, texts: Sequence[str], first: int, row: str, colour: str) -> list[Text]:
    """Draw boxes from a column on, with an arrow from each to the next."""
    box = {"boxstyle": "round,pad=0.45", "facecolor": PALE, "edgecolor": colour, "linewidth": 1.4}
    boxes = [
        axes.text(x, ROWS[row], text, ha="center", va="center", fontsize=8.0, bbox=box)
        for x, text in zip(COLUMNS[first:], texts, strict=False)
    ]
    for before, after in pairwise(boxes):
        _arrow(axes, before, after)
    return boxes


def _arrow(axes: Axes, start: Text, end: Text) -> None:
    """Draw an arrow from the edge of one box to that of another."""
    axes.annotate(
        "", end.get_position(), start.get_position(),
        arrowprops={
            "arrowstyle": "-|>", "color": BLACK, "linewidth": 1.2, "shrinkA": 0.0, "shrinkB": 0.0,
            "patchA": start.get_bbox_patch(), "patchB": end.get_bbox_patch(),
        },
    )  # fmt: skip


def caption_steps(section: SphereDiscrimination) -> str:
    """Caption of Figure 3."""
    return (
        "Steps from firing rates to hit rates. Letters are those of the paper's text; its figure is not in "
        "the copy that we worked from. Each sphere is compared with the standard of "
        f"{number(section.curvature_per_m[0])} 1/m. Numbers are of this run: spheres at 0.0 mm, static "
        "rates, mean and standard deviation of the first session."
    )
