"""Figure 3: the steps from responses to a hit rate, with the letters of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from fingerpad.experiments.gerling2014.sphere_discrimination import ObserverHitRates, SphereDiscrimination
from fingerpad.report.formatting import fixed, number
from fingerpad.report.style import BLACK, BLUE, ORANGE, PALE, new_figure

ROWS = {"gradient": 3.0, "start": 1.75, "euclidean": 0.5}
"""Heights of the boxes of the two codes and of what they share."""

GRADIENT = (
    "(b) gradient of\neach receptor: sum of\n|differences| from\nits neighbours",
    "(c) sum over the\n18 receptors:\none gradient sum",
    "(d, e) 100 sums for\neach of 7 spheres:\n700 sums; μ₂ and σ₂\nof each sphere",
    "(f) 100 times:\n100 pairs of μ₂, σ₂\nfor each sphere",
    "(g, h) signal detection\nof a random pair against\none of the standard,\nβ = 0.5: one hit rate",
    "(i, j) 100 hit rates for\neach of 6 spheres\n(k) μ₃ ± σ₃",
)
EUCLIDEAN = (
    "(b*) one set:\n18 noisy values",
    "(c*) 100 sets\nof one sphere",
    "(d*) 700 sets,\n100 for each\nof 7 spheres",
    "(e*) set of a sphere less\nset of the standard: sum\nof 18 |differences|",
    "(f*) 100 sums of one sphere\n(g*) 700 sums, 100 for\neach of 7 spheres",
    "(h*) hit or miss: side\nof the middle between\nthe two means;\n100 hit rates: μ₃ ± σ₃",
)


def draw_steps(sets: Mapping[str, SphereDiscrimination]) -> Figure:
    """Draw Figure 3: what each code does, from left to right, and the hit rates of each set of tissues."""
    figure = new_figure(12.4, 4.4)
    figure.set_layout_engine("none")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, 12.4), ylim=(-0.45, 4.0))
    axes.set_axis_off()
    names = [f"σ₁ = {number(section.noise_sigma)} ({name})" for name, section in sets.items()]
    x, y = np.meshgrid(np.linspace(0.4, 1.3, 6), np.linspace(2.45, 2.85, 3))
    axes.scatter(x, y, s=45.0, facecolors=PALE, edgecolors=BLACK, linewidths=1.0)
    axes.text(0.85, 3.2, "18 receptors,\n100 per cm²", ha="center", va="center", fontsize=8.5)
    start = [
        "static rate,\ndynamic rate or\nfirst-spike latency\nof each receptor,\n7 spheres",
        "\n".join(["(a) each value times", "Normal(1, σ₁)", *names]),
    ]
    noisy = _row(axes, start, (0.85, 2.4), "start", BLACK)[-1]
    for row, texts, places, colour in (
        ("gradient", GRADIENT, (3.3, 4.95, 6.6, 8.25, 9.9, 11.6), BLUE),
        ("euclidean", EUCLIDEAN, (3.3, 4.65, 6.0, 7.7, 9.6, 11.45), ORANGE),
    ):
        first = _row(axes, texts, places, row, colour)[0]
        _arrow(axes, noisy, first)
    for name, height, code, colour in (
        ("Gradient Sum", 3.8, "gradient_sum", BLUE),
        ("Euclidean Distance", -0.25, "euclidean", ORANGE),
    ):
        place: Any = {"va": "center", "color": colour}
        axes.text(2.7, height, name, fontweight="bold", fontsize=11.0, **place)
        axes.text(5.0, height, _found(sets, code), fontsize=8.5, **place)
    return figure


def _found(sets: Mapping[str, SphereDiscrimination], code: str) -> str:
    """List the hit rates of the ends of the range, a line per set."""
    lines = []
    for name, section in sets.items():
        low, high = (f"{number(curvature)} 1/m" for curvature in section.curvature_per_m[[1, -1]])
        found = [f"{measure} {_ends(rates)}" for measure, rates in getattr(section, code).items()]
        lines.append(
            f"{name}, {low} and {high}: {'; '.join(found) or 'no hit rates: the population is silent'}"
        )
    return "\n".join(lines)


def _ends(rates: ObserverHitRates) -> str:
    return " and ".join(fixed(rates.hit_rate[end], 2) for end in (0, -1))


def _row(axes: Axes, texts: Sequence[str], places: Any, row: str, colour: str) -> list[Text]:
    """Draw boxes side by side, with an arrow from each to the next."""
    box = {"boxstyle": "round,pad=0.4", "facecolor": PALE, "edgecolor": colour, "linewidth": 1.4}
    boxes = [
        axes.text(x, ROWS[row], text, ha="center", va="center", fontsize=7.5, bbox=box)
        for x, text in zip(places, texts, strict=True)
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


def caption_steps(sets: Mapping[str, SphereDiscrimination]) -> str:
    """Caption of Figure 3."""
    standard = next(iter(sets.values())).curvature_per_m[0]
    return (
        "Steps from the responses of 18 receptors to hit rates, with the letters of the paper's section "
        "2.2.3; its figure is not in the copy that we worked from. The standard has "
        f"{number(standard)} 1/m. Numbers are of this run: spheres at 0.0 mm, first session."
    )
