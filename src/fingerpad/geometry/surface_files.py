"""Surfaces from STL, OBJ and PLY, and height maps from PNG, TIFF, NPY and CSV."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray, finite, one_of, positive
from fingerpad.core.errors import InputError
from fingerpad.geometry.surface import Surface, height_surface

UNITS_MM = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1000.0, "inch": 25.4}
"""Units of length of a file. [mm]"""

MESHES = (".stl", ".obj", ".ply")
MAPS = (".png", ".tif", ".tiff", ".npy", ".csv")

MOST_HEIGHTS = 2_000_000
"""Largest number of heights in a map."""

_AXES = {
    sign + axis: (number, 1.0 if sign == "+" else -1.0)
    for number, axis in enumerate("xyz")
    for sign in ("+", "-")
}


def read_surface(
    path: str | Path,
    unit: str = "mm",
    scale: float = 1.0,
    up: str = "+z",
    at_mm: tuple[float, float] = (0, 0),
) -> Surface:
    """Read a rigid body of triangles, watertight or open.

    It needs the extra `pip install 'fingerpad[surfaces]'`, which is trimesh.

    Parameters
    ----------
    path : str or Path
        STL, OBJ or PLY.
    unit : {"mm", "um", "cm", "m", "inch"}
        Unit of the file's coordinates; the files do not say.
    scale : float
        Factor on all coordinates.
    up : {"+x", "-x", "+y", "-y", "+z", "-z"}
        Axis of the file that points to the skin. The file's other axes stay right-handed; the first of them
        in the order x, y, z lies along the finger. `Touch.spin_deg` turns the body about this axis.
    at_mm : (float, float)
        Where the middle of the body's extent lies, along and across the finger, from the indenter's axis.

    Returns
    -------
    Surface

    Raises
    ------
    InputError
        If the file cannot be read as triangles, has vertices that are not finite, or is of an unlikely size.
    """
    file = Path(path)
    factor = UNITS_MM[one_of("unit", unit, tuple(UNITS_MM))] * positive("scale", scale)
    number, sign = _AXES[one_of("up", up, tuple(_AXES))]
    _check_file(file, MESHES)
    try:
        import trimesh
    except ImportError as error:
        raise InputError("Reading surfaces needs trimesh: pip install 'fingerpad[surfaces]'.") from error
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh: Any = trimesh.load(file, force="mesh", process=False)
            vertices, faces = np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)
    except Exception as error:  # a file of unknown content may fail in any way
        raise InputError(
            f"{file.name} cannot be read as {file.suffix[1:].upper()}: {_said(error)}."
        ) from error
    if not len(faces):
        raise InputError(f"{file.name} must hold at least one triangle: got none.")
    wrong = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if wrong.size:
        raise InputError(
            f"{file.name} must have finite vertices: {wrong.size} of {len(vertices)} are not, first number "
            f"{wrong[0] + 1}."
        )
    vertices, welded = np.unique(vertices, axis=0, return_inverse=True)
    # x, y, z of the indenter from the file's axes; a rotation keeps the side of the triangles.
    turned = np.zeros((3, 3))
    turned[0 if number != 0 else 1, 0] = 1.0
    turned[number, 1] = sign
    turned[:, 2] = np.cross(turned[:, 0], turned[:, 1])
    placed = factor * vertices @ turned
    middle = 0.5 * (placed.min(axis=0) + placed.max(axis=0))
    x, z = (finite("at_mm", value, "mm") for value in at_mm)
    try:
        return Surface(placed - middle + [x, 0.0, z], welded.ravel()[faces])
    except InputError as error:
        raise InputError(f"{file.name}: {error}") from error


def read_height_map(path: str | Path, pitch_mm: float, height_mm: float = 1.0) -> Surface:
    """Read a map of heights towards the skin, centred on the indenter's axis.

    Rows run across the finger and columns along it.

    Parameters
    ----------
    path : str or Path
        PNG or TIFF, 8 or 16 bit or float, colours as their brightness; NPY or CSV with numbers.
    pitch_mm : float
        Distance between neighbouring heights. [mm]
    height_mm : float
        Height of one unit of NPY, CSV and float TIFF; of white above black in the other images. [mm]

    Returns
    -------
    Surface
        Open: it has no sides and no back.

    Raises
    ------
    InputError
        If the file cannot be read, is no plane of finite numbers, or has more than 2,000,000 heights.
    """
    file = Path(path)
    positive("pitch_mm", pitch_mm, "mm")
    positive("height_mm", height_mm, "mm")
    _check_file(file, MAPS)
    try:
        heights = _heights(file)
    except InputError:
        raise
    except Exception as error:  # a file of unknown content may fail in any way
        raise InputError(f"{file.name} cannot be read as a height map: {_said(error)}.") from error
    if heights.ndim != 2:
        raise InputError(f"{file.name} must hold rows and columns of heights: got shape {heights.shape}.")
    _check_size(file, heights.size)
    wrong = np.argwhere(~np.isfinite(heights))
    if len(wrong):
        raise InputError(
            f"{file.name} must hold finite heights: {len(wrong)} are not, first in row {wrong[0][0] + 1} and "
            f"column {wrong[0][1] + 1}."
        )
    try:
        return height_surface(height_mm * heights, pitch_mm)
    except InputError as error:
        raise InputError(f"{file.name}: {error}") from error


def _heights(file: Path) -> FloatArray:
    """Numbers of a file, from 0 to 1 for the shades of an image."""
    if file.suffix.lower() == ".npy":
        stored = np.load(file, mmap_mode="r", allow_pickle=False)
        _check_size(file, stored.size)
        return np.array(stored, dtype=np.float64)
    if file.suffix.lower() == ".csv":
        return np.loadtxt(file, delimiter=",", ndmin=2, dtype=np.float64)
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        try:
            opened = Image.open(file)
        except Image.DecompressionBombError as error:
            raise InputError(
                f"{file.name} must have at most {MOST_HEIGHTS:,} heights: got far more; crop it."
            ) from error
        with opened as image:
            _check_size(file, image.width * image.height)
            if image.mode == "F":
                return np.array(image, dtype=np.float64)
            if image.mode.startswith("I"):
                return np.array(image, dtype=np.float64) / 65535.0
            return np.array(image.convert("L"), dtype=np.float64) / 255.0


def _check_file(file: Path, endings: tuple[str, ...]) -> None:
    if file.suffix.lower() not in endings:
        raise InputError(f"The file must end in {', '.join(endings)}: got {file.name}.")
    if not file.is_file():
        raise InputError(f"The file {file} does not exist.")
    if not file.stat().st_size:
        raise InputError(f"{file.name} is empty.")


def _check_size(file: Path, heights: int) -> None:
    if heights > MOST_HEIGHTS:
        raise InputError(
            f"{file.name} must have at most {MOST_HEIGHTS:,} heights: got {heights:,}; crop it or take every "
            "second row and column with twice the pitch."
        )


def _said(error: Exception) -> str:
    return " ".join(str(error).split())[:200].rstrip(".") or type(error).__name__
