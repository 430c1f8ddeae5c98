"""Export of one indentation to another program, by the name of the format."""

from __future__ import annotations

from pathlib import Path

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, write_atomically
from fingerpad.core.values import one_of
from fingerpad.export.decks import DECKS, calculix_deck
from fingerpad.export.job import Job, job_of
from fingerpad.export.results import library
from fingerpad.export.vtu import require_vtk
from fingerpad.skin.indentation import Touch

RESULTS: dict[str, str] = {
    "vtu": "touch.pvd",
    "csv": "touch.csv",
    "npz": "touch.npz",
    "netcdf": "touch.nc",
    "zarr": "touch.zarr",
}
"""Name of the file that `SkinResponse.save` writes for each format."""


def require_netcdf() -> None:
    """Raise `InputError` if a library that writes data sets is not installed."""
    for name in ("xarray", "h5netcdf", "zarr"):
        library(name)


REQUIRED = {"vtu": require_vtk, "netcdf": require_netcdf, "zarr": require_netcdf}
"""Formats that hold all nodes and elements over time, and what raises if their library is missing."""

FORMATS = (*RESULTS, *DECKS)


@checked
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
        The file to open.
    """
    check_format(format_name, elastic_moduli)  # first, since solving takes its time
    if format_name in RESULTS:
        skin = touch.solve(whole=format_name in REQUIRED)
        return (skin.save(path_of("folder", folder) / RESULTS[format_name]),)
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
