"""One touch in the format of another program, by the format's name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from fingerpad.core.checks import one_of
from fingerpad.core.errors import InputError
from fingerpad.export.abaqus import write_abaqus
from fingerpad.export.calculix import write_calculix
from fingerpad.export.febio import write_febio
from fingerpad.export.job import job_of
from fingerpad.export.vtu import load_vtk, write_vtu_series
from fingerpad.skin.indentation import Touch


def _vtu(touch: Touch, folder: Path) -> tuple[Path, ...]:
    load_vtk()  # first, since solving takes its time
    return write_vtu_series(folder / "touch.pvd", touch.deform(), touch.mesh)


def _abaqus(touch: Touch, folder: Path) -> tuple[Path, ...]:
    return (write_abaqus(folder / "touch.inp", job_of(touch)),)


def _calculix(touch: Touch, folder: Path, elastic_moduli: str | None = None) -> tuple[Path, ...]:
    return (write_calculix(folder / "touch.inp", job_of(touch), elastic_moduli),)


def _febio(touch: Touch, folder: Path) -> tuple[Path, ...]:
    return (write_febio(folder / "touch.feb", job_of(touch)),)


FORMATS: dict[str, Callable[[Touch, Path], tuple[Path, ...]]] = {
    "vtu": _vtu,
    "abaqus": _abaqus,
    "calculix": _calculix,
    "febio": _febio,
}
"""Writers by name: each takes a touch and a folder and returns its files, the one to open first."""


def export_touch(
    touch: Touch, folder: Path, format_name: str, elastic_moduli: str | None = None
) -> tuple[Path, ...]:
    """Write a touch for another program.

    Parameters
    ----------
    touch : Touch
        What to export; "vtu" also solves it.
    folder : Path
        Where the files shall be; made as needed.
    format_name : str
        One of `FORMATS`.
    elastic_moduli : {"long_term", "instantaneous"}, optional
        For "calculix", which cannot relax: the moduli to press with.

    Returns
    -------
    tuple of Path
        The files, the one to open first.

    Raises
    ------
    InputError
        If the format is unknown or cannot hold this touch.
    """
    one_of("format", format_name, tuple(FORMATS))
    if format_name == "calculix":
        return _calculix(touch, Path(folder), elastic_moduli)
    if elastic_moduli is not None:
        raise InputError(f"elastic_moduli is for calculix, and {format_name} relaxes tissue: leave it out.")
    return FORMATS[format_name](touch, Path(folder))
