"""Results that draw themselves and turn into tables: `plot`, a picture in a notebook, pandas and xarray.

What draws and what makes tables lies in packages above, and is loaded when it is first used: the two imports
upwards that the contracts of pyproject.toml allow (docs/decisions.md#results-that-draw).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fingerpad.core.checked import checked_class

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes


class Displayed:
    """Base of values that draw themselves; their methods refuse wrong arguments in one sentence."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        checked_class(cls)

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
        """
        from fingerpad.report.drawing import plot

        return plot(self, axes, what, **options)

    def _repr_html_(self) -> str:
        """Return a small picture and the line of `repr`, for notebooks."""
        from fingerpad.report.drawing import html

        return html(self)


class Result(Displayed):
    """Base of results: they draw themselves, and turn into a table or a labelled data set."""

    def to_pandas(self) -> pandas.DataFrame:
        """Return this result as a table; names of columns carry units.

        Returns
        -------
        pandas.DataFrame
            With the rows that `fingerpad.export.result_tables.TABLES` says.
        """
        from fingerpad.export.result_tables import table

        return table(self)

    def to_xarray(self) -> xarray.Dataset:
        """Return this result as a labelled data set; every variable has an attribute `units`."""
        from fingerpad.export.result_tables import dataset

        return dataset(self)
