"""What all figures share: colours that survive greyscale, sizes, and how a figure becomes bytes."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from fingerpad.core.checked import checked
from fingerpad.core.files import write_atomically
from fingerpad.core.units import with_unit
from fingerpad.core.values import FloatArray
from fingerpad.report.tables import in_words

RESOLUTION_DPI = 150
COLUMN_IN = 6.4  # Width of a figure of one set of tissues; two of them stand side by side. [in]

# Three hues that differ for any colour vision, and in grey.
BLACK = "#1a1a1a"
BLUE = "#0a5c99"
ORANGE = "#d9650a"
GREEN = "#3fae8a"
GREY = "#8a8a8a"
PALE = "#e9e9e6"

Style = dict[str, Any]  # How a line is drawn: keywords of matplotlib.
SERIES: tuple[Style, ...] = tuple(
    {"color": colour, "marker": marker, "linestyle": dashes}
    for colour, marker, dashes in (
        (BLUE, "o", "-"),
        (ORANGE, "^", ":"),
        (BLACK, "s", "--"),
        (GREEN, "D", "-."),
        (GREY, "v", (0, (8, 2, 1, 2, 1, 2))),
        (BLUE, "P", (0, (2, 1, 2, 3))),
    )
)
"""What is drawn side by side: any two differ in marker and in dashes, the first five in colour, too."""

NO_MARKER: Any = {"marker": ""}

# Untyped, since Matplotlib lists every setting by name in the type that it asks for.
STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#dcdcd8",
    "grid.linewidth": 0.6,
    "legend.fontsize": 9.0,
    "legend.frameon": False,
    "lines.linewidth": 1.8,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "hatch.linewidth": 0.6,
    "savefig.dpi": RESOLUTION_DPI,
}

PEOPLE: Any = {
    "color": BLACK, "markerfacecolor": "none", "markeredgewidth": 1.6, "markersize": 7.5, "zorder": 5,
}  # fmt: skip
"""How observations of people are drawn: open diamonds before all else."""

MAP_AXES: Any = {"xlabel": "x, distal [mm]", "ylabel": "z, lateral [mm]", "aspect": "equal"}
"""Axes of a map of the pad: distal is to the right."""

CHANCE = 0.5
NANOAMPERE_PER_MA = 1e6


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure with constrained layout, drawn without a window system. [in]"""
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def png(draw: Callable[..., Figure], *parts: Any) -> bytes:
    """Return what `draw` makes of its arguments, as PNG; settings elsewhere stay as they are."""
    buffer = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure = draw(*parts)
        for text in figure.findobj(Text):
            # A dollar stands in a name that somebody gave. The ticks of scales are not written yet.
            text.set_parse_math("$" not in text.get_text())
        figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


@checked
def write_png(path: Path, draw: Callable[..., Figure], *parts: Any) -> Path:
    """Write what `draw` makes of its arguments as PNG; the file is there whole or not at all."""
    write_atomically(path, png(draw, *parts))
    return path


def name_panel(axes: Axes, title: str, xlabel: str, ylabel: str) -> None:
    axes.set_title(title, fontsize=10.0)
    axes.set(xlabel=xlabel, ylabel=ylabel)


def draw_chance(axes: Axes, label: str | None = None) -> None:
    axes.axhline(CHANCE, color=GREY, linewidth=1.0, linestyle=(0, (6, 3)), label=label)


def quantity_label(quantity: str) -> str:
    """Name a quantity at an end organ in words, with its unit."""
    return with_unit(in_words(quantity), quantity)


def fill_band(
    axes: Axes, x: FloatArray, low: Any, high: Any, color: str, alpha: float, label: str = ""
) -> None:
    axes.fill_between(x, low, high, color=color, alpha=alpha, linewidth=0.0, label=label or None)


def draw_rates(
    axes: Axes, where: FloatArray, predicted_hz: FloatArray, observed_hz: FloatArray, label: str,
    line: bool = True,
) -> None:  # fmt: skip
    """Draw predicted firing rates as a line or as dashes, and the observed ones as open circles."""
    dashes: Any = {"linestyle": "none", "marker": "_", "markersize": 12.0, "markeredgewidth": 2.0}
    axes.plot(where, predicted_hz, color=BLUE, label=label, **({} if line else dashes))
    draw_observed_rates(axes, where, observed_hz)
    axes.set_ylabel("firing rate [spikes/s]")
    axes.set_ylim(bottom=0.0)


def draw_observed_rates(axes: Axes, where: FloatArray, observed_hz: FloatArray) -> None:
    open_circles: Any = {"color": BLACK, "markerfacecolor": "white", "markersize": 5.0}
    axes.plot(where, observed_hz, "o", label="observed", **open_circles)


def shared_legend(figure: Figure, panels: Iterable[Axes], columns: int | None = None) -> None:
    """Put one legend below all panels, each label once; by default in one row."""
    handles: dict[str, Artist] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    if handles:
        ncols = min(columns or len(handles), len(handles))
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=ncols)


def say_nothing_to_draw(axes: Axes, text: str) -> None:
    """Write in an empty panel why it is empty."""
    axes.set_axis_off()
    axes.text(0.5, 0.5, text, ha="center", va="center", color=GREY, transform=axes.transAxes)
