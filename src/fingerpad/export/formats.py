"""Export of one indentation to another program, by the name of the format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from fingerpad.core.checks import one_of
from fingerpad.core.errors import InputError
from fingerpad.core.files import write_atomically
from fingerpad.export.abaqus import abaqus_deck
from fingerpad.export.calculix import calculix_deck
from fingerpad.export.febio import febio_deck
from fingerpad.export.job import Job, job_of
from fingerpad.export.tables import write_touch_csv, write_touch_npz
from fingerpad.export.vtu import require_vtk, write_vtu_series
from fingerpad.skin.indentation import Touch

DECKS: dict[str, tuple[str, Callable[[Job], str]]] = {
    "abaqus": ("touch.inp", abaqus_deck),
    "calculix": ("touch.inp", calculix_deck),
    "febio": ("touch.feb", febio_deck),
}
"""Name of the input file of each solver, and the function that returns its text."""

TABLES = {"csv": write_touch_csv, "npz": write_touch_npz}
"""Functions that write the result of a touch as one file."""

FORMATS = ("vtu", *TABLES, *DECKS)


def export_touch(
    touch: Touch, folder: Path, format_name: str, elastic_moduli: str | None = None
) -> tuple[Path, ...]:
    """Write an indentation for another program.

    Parameters
    ----------
    touch : Touch
        The indentation to export; "vtu", "csv" and "npz" also solve it.
    folder : Path
        Folder for the files; it is created if needed.
    format_name : str
        One of `FORMATS`.
    elastic_moduli : {"long_term", "instantaneous"}, optional
        For "calculix", which has no relaxation: the moduli of the layers.

    Returns
    -------
    tuple of Path
        The files; open the first one.

    Raises
    ------
    InputError
        If the format is unknown or cannot express this indentation.
    """
    one_of("format", format_name, FORMATS)
    if elastic_moduli is not None and format_name != "calculix":
        raise InputError(
            f"elastic_moduli is for calculix, which has no relaxation, not for {format_name}: leave it out."
        )
    if format_name == "vtu":
        require_vtk()  # first, since solving takes its time
        return write_vtu_series(Path(folder) / "touch.pvd", touch.solve(whole=True))
    if format_name in TABLES:
        return TABLES[format_name](Path(folder) / f"touch.{format_name}", touch.solve())
    name, deck = DECKS[format_name]
    job, path = job_of(touch), Path(folder) / name
    text = deck(job) if elastic_moduli is None else calculix_deck(job, elastic_moduli)
    write_atomically(path, text.encode())
    return (path,)
