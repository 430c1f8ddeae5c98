"""Results that draw themselves: `plot` for figures, and a picture with one line in a notebook."""

from __future__ import annotations

from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DRAWING = "fingerpad.report.drawing"
"""Module that draws: named here, and loaded when something is drawn (docs/decisions/results-that-draw.md)."""


class Displayed:
    """Base of results that draw themselves."""

    def plot(self, axes: Axes | None = None, what: str | None = None, **options: Any) -> Axes:
        """Draw this result.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Where; by default those of a new figure.
        what : str, optional
            Which of the drawings of `fingerpad.report.drawing.DRAWINGS`; by default the first.
        **options
            Of the drawing, such as the `quantity` of a map.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        InputError
            If there is no such drawing.
        """
        drawn: Axes = resolve_name(f"{DRAWING}:plot")(self, axes, what, **options)
        return drawn

    def _repr_html_(self) -> str:
        """Return a small picture and the line of `repr`, for notebooks."""
        shown: str = resolve_name(f"{DRAWING}:html")(self)
        return shown
