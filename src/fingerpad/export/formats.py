"""Export of one indentation to another program, by the name of the format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from fingerpad.core.checks import one_of
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, write_atomically
from fingerpad.core.keywords import known_keywords
from fingerpad.export.abaqus import abaqus_deck
from fingerpad.export.calculix import calculix_deck
from fingerpad.export.dataset import require_netcdf, write_touch
from fingerpad.export.febio import febio_deck
from fingerpad.export.job import Job, job_of
from fingerpad.export.tables import write_touch_csv, write_touch_npz
from fingerpad.export.vtu import require_vtk, write_vtu_series
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse

DECKS: dict[str, tuple[str, Callable[[Job], str]]] = {
    "abaqus": ("touch.inp", abaqus_deck),
    "calculix": ("touch.inp", calculix_deck),
    "febio": ("touch.feb", febio_deck),
}
"""Name of the input file of each solver, and the function that returns its text."""

RESULTS: dict[str, tuple[str, Callable[[Path, SkinResponse], tuple[Path, ...]]]] = {
    "vtu": ("touch.pvd", write_vtu_series),
    "csv": ("touch.csv", write_touch_csv),
    "npz": ("touch.npz", write_touch_npz),
    "netcdf": ("touch.nc", write_touch),
    "zarr": ("touch.zarr", write_touch),
}
"""Name of the file that holds the result of a touch, and the function that writes it."""

REQUIRED = {"vtu": require_vtk, "netcdf": require_netcdf, "zarr": require_netcdf}
"""Formats that hold all nodes and elements over time, and what raises if their library is missing."""

FORMATS = (*RESULTS, *DECKS)


@known_keywords
def export_touch(
    folder: Path, touch: Touch, format_name: str, elastic_moduli: str | None = None
) -> tuple[Path, ...]:
    """Write an indentation for another program.

    Parameters
    ----------
    folder : Path
        Folder for the files; it is created if needed.
    touch : Touch
        The indentation to export; all but the input files of solvers also solve it.
    format_name : str
        One of `FORMATS`.
    elastic_moduli : {"long_term", "instantaneous"}, optional
        For "calculix", which has no relaxation: the moduli of the layers.

    Returns
    -------
    tuple of Path
        The files; open the first one.
    """
    check_format(format_name, elastic_moduli)  # first, since solving takes its time
    if format_name in RESULTS:
        name, write = RESULTS[format_name]
        return write(path_of("folder", folder) / name, touch.solve(whole=format_name in REQUIRED))
    return (write_deck(folder, job_of(touch), format_name, elastic_moduli),)


def check_format(format_name: str, elastic_moduli: str | None = None) -> None:
    """Raise `InputError` if there is no such format, or its library is missing."""
    one_of("format", format_name, FORMATS)
    if elastic_moduli is not None and format_name != "calculix":
        raise InputError(
            f"elastic_moduli is for calculix, which has no relaxation, not for {format_name}: leave it out."
        )
    if format_name in REQUIRED:
        REQUIRED[format_name]()


def write_deck(folder: Path, job: Job, format_name: str, elastic_moduli: str | None = None) -> Path:
    """Write the input file of a solver; arguments as of `export_touch`, with what `job_of` returns."""
    name, deck = DECKS[format_name]
    text = deck(job) if elastic_moduli is None else calculix_deck(job, elastic_moduli)
    write_atomically(path_of("folder", folder) / name, text.encode())
    return path_of("folder", folder) / name
