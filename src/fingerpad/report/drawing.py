"""What `plot` of results draws, and the pictures of results in notebooks."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from inspect import signature
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.displayed import Displayed
from fingerpad.core.errors import InputError
from fingerpad.core.values import one_of
from fingerpad.report import nerve, percept, skin
from fingerpad.report.page import DRAWINGS
from fingerpad.report.style import new_figure, png

LEVELS = (skin, nerve, percept)  # To load them enters their drawings.

IN_NOTEBOOKS = {"SkinResponse": "section"}  # Drawings in notebooks that are not the default.


def plot(result: Displayed, axes: Axes | None = None, what: str | None = None, **options: Any) -> Axes:
    """Draw a result; see `Displayed.plot`."""
    drawings = {name: draw for (kind, name), draw in DRAWINGS.items() if kind == type(result).__name__}
    name = one_of("what", next(iter(drawings)) if what is None else what, tuple(drawings))
    draw = drawings[name]
    known = list(signature(draw).parameters)[2:]
    for option in options.keys() - known:
        allowed = ", ".join(known) or "none"
        raise InputError(f"Options of the drawing {name} are: {allowed}; got {option}.")
    if axes is not None and not isinstance(axes, Axes):
        raise InputError("axes", "must be axes of Matplotlib", f"{axes!r:.60}", "name a drawing by what=")
    if axes is None:
        # Only a figure of pyplot is shown by a notebook or a window.
        from matplotlib import pyplot

        axes = pyplot.subplots(layout="constrained")[1]
    draw(axes, result, **options)
    return axes


def html(result: Displayed) -> str:
    """Return a picture and the line of `repr` in HTML; see `Displayed`."""

    def draw() -> Figure:
        figure = new_figure(4.5, 2.6)
        plot(result, figure.add_subplot(), IN_NOTEBOOKS.get(type(result).__name__))
        return figure

    picture = b64encode(png(draw)).decode()
    return (
        f'<figure style="margin:0"><img width="450" alt="" src="data:image/png;base64,{picture}">'
        f"<figcaption>{escape(repr(result))}</figcaption></figure>"
    )
