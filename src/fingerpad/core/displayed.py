"""Results that draw themselves, turn into tables and data sets, and save themselves.

What draws and what writes lies in packages above, and is loaded when it is first used: the two imports
upwards that the contracts of pyproject.toml allow (docs/decisions.md#results-that-draw).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, get_args, get_origin, get_type_hints

import numpy as np

from fingerpad.core.checked import checked_class
from fingerpad.core.units import QUANTITY_UNITS, unit_of

if TYPE_CHECKING:
    import neo
    import pandas
    import pynapple
    import xarray
    from matplotlib.axes import Axes

Columns = dict[Any, Any]  # Columns of a table by name, the index first; names carry units.

Attributes = dict[str, Any]  # Of a variable or a data set, by name, as xarray takes them.

Variable = tuple[tuple[str, ...], np.ndarray, Attributes]
"""Variable of a data set: dimensions, values and attributes, as xarray takes them."""

Contents = tuple[dict[str, Variable], Attributes]  # Variables and attributes of a data set, by name.

_UDUNITS = {
    "": "1", "mm²": "mm2", "mm³": "mm3", "µJ": "uJ", "degrees": "degree", "spikes/s": "s-1", "Hz": "s-1",
    "1/m": "m-1", "1/mm": "mm-1", "1/cm²": "cm-2", "mm/s": "mm s-1",
}  # fmt: skip
"""Units that UDUNITS spells otherwise."""


def udunits(unit: str) -> str:
    """Return a unit as UDUNITS reads it, "1" of a pure number."""
    return _UDUNITS.get(unit, unit)


@dataclass(frozen=True)
class Column:
    """Annotation of a field or property with one number per row: every table, file and data set has it."""

    long_name: str
    holes: bool = False  #: Whether it may be NaN.


def columns_of(kind: type) -> dict[str, Column]:
    """Columns that the fields of a class are annotated with, then those of its properties."""
    hints = get_type_hints(kind, include_extras=True)
    hints = {part.name: hints[part.name] for part in fields(kind)}
    for name, member in vars(kind).items():
        if isinstance(member, property):
            hints[name] = get_type_hints(member.fget, include_extras=True).get("return")
    return {
        name: note
        for name, hint in hints.items()
        if get_origin(hint) is Annotated
        for note in get_args(hint)
        if isinstance(note, Column)
    }


def dataset_of(contents: Contents) -> xarray.Dataset:
    """Make a data set of its variables and attributes."""
    from fingerpad.export.results import dataset

    return dataset(contents)


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
    """Base of results: they draw themselves, turn into a table or a data set, and save themselves."""

    whole_as_json: ClassVar[bool] = False  #: If JSON holds all fields, as `core/result_files` writes them.

    def columns(self) -> Columns:
        """Columns of the table of this result by name, the index first; by default its lists of numbers."""
        values = {part.name: getattr(self, part.name) for part in fields(self)}  # type: ignore[arg-type]
        return {name: value for name, value in values.items() if np.ndim(value) == 1}

    def contents(self) -> Contents:
        """Variables and attributes of the data set of this result; by default the columns of its table."""
        found: dict[str, Variable] = {}
        for name, values in self.columns().items():
            column = np.asarray(values)
            if column.dtype.kind == "U":  # as formats of files have texts
                column = column.astype(object)
            number = column.dtype.kind in "fiu"
            unit = QUANTITY_UNITS.get(str(name).removesuffix("_error")) or unit_of(str(name))
            found[str(name)] = (("row",), column, {"units": udunits(unit)} if number else {})
        return found, {}

    def to_frame(self) -> pandas.DataFrame:
        """Return this result as a table; names of columns carry units.

        Returns
        -------
        pandas.DataFrame
            One row per time, afferent, spike, stimulus or parameter, which the index names.

        Examples
        --------
        >>> from fingerpad.core.signals import HitRates
        >>> HitRates([0.6, 0.9], [0.05, 0.02]).to_frame().hit_rate.tolist()
        [0.6, 0.9]
        """
        from fingerpad.export.results import frame

        return frame(self)

    def to_dataset(self) -> xarray.Dataset:
        """Return this result as a labelled data set; every variable of numbers has an attribute `units`.

        Examples
        --------
        >>> import fingerpad as fp
        >>> fp.Traces([0.0, 50.0], [[0.0], [2.0]]).to_dataset().stored.units
        'kPa'
        """
        return dataset_of(self.contents())

    def save(self, path: str | Path, **options: Any) -> Path:
        """Write this result; the ending of the name says how.

        Parameters
        ----------
        path : str or Path
            Ends in .csv or .parquet (the table), .json, .npz, .nc or .zarr (the data set), .nwb (a response),
            .vtu or .pvd (all nodes and elements of a touch), or .png, .pdf or .svg (the drawing).
        **options
            Of `to_dataset`, of `to_nwb`, or of `plot`.

        Returns
        -------
        Path
            The file; it is written as a whole, and folders are created if needed.

        Raises
        ------
        InputError
            If this result has no such form.
        StoreError
            If the file cannot be written.

        Examples
        --------
        >>> from tempfile import TemporaryDirectory
        >>> from fingerpad.core.signals import HitRates
        >>> with TemporaryDirectory() as folder:
        ...     path = HitRates([0.6, 0.9], [0.05, 0.02]).save(Path(folder) / "rates.csv")
        ...     print(path.read_text(), end="")
        comparison,hit_rate,hit_rate_sd
        1,0.6,0.05
        2,0.9,0.02
        """
        from fingerpad.export.results import save

        return save(self, path, **options)


class SpikingResult(Result):
    """Base of results with spike trains: programs that analyse spikes take them."""

    def to_nwb(self, path: str | Path, touch: str = "touch", **options: Any) -> Path:
        """Write a response as a session of NWB with one trial; `write_responses_nwb` writes several.

        Parameters
        ----------
        path : str or Path
            The file, .nwb, .h5 or .hdf5.
        touch : str
            Name of the touch.
        **options
            Of `write_responses_nwb`.

        Examples
        --------
        >>> from tempfile import TemporaryDirectory
        >>> import fingerpad as fp
        >>> trains = fp.SpikeTrains.from_lists([[12.5, 40.0]])
        >>> response = fp.ResponseMap([[17.0, 0.5]], 1.0, trains, [36.4], [0], [12.5])
        >>> with TemporaryDirectory() as folder:
        ...     response.to_nwb(Path(folder) / "touch.nwb", duration_ms=1000.0).name
        'touch.nwb'
        """
        from fingerpad.export.responses import to_nwb

        return to_nwb(self, path, touch, **options)

    def to_pynapple(self) -> pynapple.TsGroup:
        """Return the spike trains as a group of pynapple, with what is known of each afferent as metadata.

        Examples
        --------
        >>> import fingerpad as fp
        >>> fp.SpikeTrains.from_lists([[12.5, 40.0], [7.0]]).to_pynapple()[0].times("ms").tolist()
        [12.5, 40.0]
        """
        from fingerpad.export.responses import to_pynapple

        return to_pynapple(self)

    def to_neo(self) -> neo.Block:
        """Return the spike trains as a block of neo with one segment, which elephant takes.

        Examples
        --------
        >>> import fingerpad as fp
        >>> block = fp.SpikeTrains.from_lists([[12.5, 40.0], [7.0]]).to_neo()
        >>> block.segments[0].spiketrains[0].magnitude.tolist()
        [12.5, 40.0]
        """
        from fingerpad.export.responses import to_neo

        return to_neo(self)
