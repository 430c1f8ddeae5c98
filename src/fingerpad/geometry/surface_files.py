"""Surfaces from STL, OBJ and PLY, and height maps from PNG, TIFF, NPY and CSV."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray, IntArray, float_array, one_of, positive
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of
from fingerpad.core.keywords import known_keywords
from fingerpad.geometry.surface import LARGEST_MM, SMALLEST_MM, SMOOTH_BELOW_DEG, Surface, height_surface

UNITS_MM = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1000.0, "inch": 25.4}
"""Units of length of a file. [mm]"""

MESHES = (".stl", ".obj", ".ply")
IMAGES = (".png", ".tif", ".tiff")
MAPS = (*IMAGES, ".npy", ".csv")

MOST_HEIGHTS = 2_000_000
"""Largest number of heights in a map."""

_AXES = {
    sign + axis: (number, 1.0 if sign == "+" else -1.0)
    for number, axis in enumerate("xyz")
    for sign in ("+", "-")
}


@known_keywords
def read_surface(
    path: str | Path,
    unit: str = "mm",
    scale: float = 1.0,
    up: str = "+z",
    at_mm: tuple[float, float] = (0, 0),
    smooth_below_deg: float = SMOOTH_BELOW_DEG,
    edge_radius_mm: float = 0.0,
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
    smooth_below_deg : float
        Hollow creases between triangles of a smaller angle are rounded; see `Surface`. [degrees]

    Returns
    -------
    Surface

    Raises
    ------
    InputError
        If the file cannot be read as triangles, has vertices that are not finite, or is of an unlikely size.
    """
    file = path_of("path", path)
    factor = UNITS_MM[one_of("unit", unit, tuple(UNITS_MM))] * positive("scale", scale)
    number, sign = _AXES[one_of("up", up, tuple(_AXES))]
    at = float_array("at_mm", at_mm, 1)
    if at.shape != (2,):
        raise InputError(f"at_mm must be two numbers, along and across the finger in mm: got {at_mm!r}.")
    _check_file(file, MESHES)
    try:
        import trimesh
    except ImportError as error:
        raise InputError("Reading surfaces needs trimesh: pip install 'fingerpad[surfaces]'.") from error
    _check_length(file)
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
    if vertices.shape[1:] != (3,):
        raise InputError(f"{file.name} must have vertices with x, y and z: got shape {vertices.shape}.")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(
            f"{file.name} must have triangles of its vertices, 0 to {len(vertices) - 1}: got numbers "
            f"{faces.min()} to {faces.max()}."
        )
    wrong = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if wrong.size:
        raise InputError(
            f"{file.name} must have finite vertices: {wrong.size} of {len(vertices)} are not, first number "
            f"{wrong[0] + 1}."
        )
    vertices, faces = _welded(vertices, faces)
    # x, y, z of the indenter from the file's axes; a rotation keeps the side of the triangles.
    turned = np.zeros((3, 3))
    turned[0 if number != 0 else 1, 0] = 1.0
    turned[number, 1] = sign
    turned[:, 2] = np.cross(turned[:, 0], turned[:, 1])
    placed = factor * vertices @ turned
    middle = 0.5 * (placed.min(axis=0) + placed.max(axis=0))
    try:
        return Surface(placed - middle + [at[0], 0.0, at[1]], faces, smooth_below_deg, edge_radius_mm)
    except InputError as error:
        raise InputError(f"{file.name}: {error}") from error


def _welded(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Vertices without a second one at the same place, sorted, and the triangles of them.

    Several times as fast for a million triangles as `numpy.unique` by rows.
    """
    order = np.lexsort(vertices.T[::-1])
    ahead = vertices[order]
    is_new = np.r_[True, (ahead[1:] != ahead[:-1]).any(axis=1)]
    number = np.empty(len(vertices), dtype=np.int64)
    number[order] = np.cumsum(is_new) - 1
    return ahead[is_new], number[faces]


@known_keywords
def read_height_map(
    path: str | Path,
    pitch_mm: float,
    height_mm: float = 1.0,
    smooth_below_deg: float = SMOOTH_BELOW_DEG,
    edge_radius_mm: float = 0.0,
) -> Surface:
    """Read a map of heights towards the skin, centred on the indenter's axis.

    Rows run across the finger and columns along it.

    Parameters
    ----------
    path : str or Path
        PNG or TIFF, 8 or 16 bit or float, in shades of grey; NPY or CSV with numbers.
    pitch_mm : float
        Distance between neighbouring heights. [mm]
    height_mm : float
        Height of one unit of NPY, CSV and float TIFF; of white above black in the other images. [mm]
    smooth_below_deg : float
        Hollow creases between triangles of a smaller angle are rounded; see `Surface`. [degrees]

    Returns
    -------
    Surface
        Open: it has no sides and no back.

    Raises
    ------
    InputError
        If the file cannot be read, is no plane of finite numbers, has more than 2,000,000 heights, or is an
        image of one shade.
    """
    file = path_of("path", path)
    positive("pitch_mm", pitch_mm, "mm")
    positive("height_mm", height_mm, "mm")
    _check_file(file, MAPS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            heights = _heights(file)
    except InputError:
        raise
    except Exception as error:  # a file of unknown content may fail in any way
        raise InputError(f"{file.name} cannot be read as a height map: {_said(error)}.") from error
    if heights.ndim != 2:
        raise InputError(f"{file.name} must hold rows and columns of heights: got shape {heights.shape}.")
    _check_size(file, heights.size)
    side_mm = pitch_mm * (max(heights.shape) - 1)
    if side_mm and not SMALLEST_MM <= side_mm <= LARGEST_MM:
        raise InputError(
            f"{file.name} must be {SMALLEST_MM:g} to {LARGEST_MM:g} mm long or wide: got {side_mm:.4g} mm; "
            "check pitch_mm."
        )
    wrong = np.argwhere(~np.isfinite(heights))
    if len(wrong):
        raise InputError(
            f"{file.name} must hold finite heights: {len(wrong)} are not, first in row {wrong[0][0] + 1} and "
            f"column {wrong[0][1] + 1}."
        )
    if heights.size > 1 and file.suffix.lower() in IMAGES and not np.ptp(heights):
        raise InputError(
            f"{file.name} must have shades that differ, which are heights: all are equal; for a flat body "
            "take a FlatPunch or a Bar."
        )
    if np.abs(heights).max(initial=0.0) * height_mm > LARGEST_MM:
        raise InputError(
            f"{file.name} must have heights within {LARGEST_MM:g} mm: the largest is "
            f"{np.abs(heights).max():.4g} times {height_mm:g} mm; check height_mm."
        )
    try:
        return height_surface(height_mm * heights, pitch_mm, smooth_below_deg, edge_radius_mm)
    except InputError as error:
        raise InputError(f"{file.name}: {error}") from error


def _heights(file: Path) -> FloatArray:
    """Numbers of a file, from 0 to 1 for the shades of an image."""
    if file.suffix.lower() == ".npy":
        with file.open("rb") as content:
            if content.read(6) != b"\x93NUMPY":
                raise InputError(f"{file.name} must be an array that numpy.save wrote: it is not.")
        stored = np.load(file, mmap_mode="r", allow_pickle=False)
        _check_size(file, stored.size)
        if stored.dtype.kind not in "buif":
            raise InputError(f"{file.name} must hold real numbers: got {stored.dtype}.")
        return np.array(stored, dtype=np.float64)
    if file.suffix.lower() == ".csv":
        try:
            return np.loadtxt(
                file, delimiter=",", ndmin=2, dtype=np.float64, comments=None, encoding="utf-8-sig"
            )
        except ValueError as error:
            raise InputError(
                f"{file.name} must hold rows of numbers with commas between: {_fault(file)}."
            ) from error
    from PIL import Image, UnidentifiedImageError

    try:
        opened = Image.open(file)
    except UnidentifiedImageError as error:
        raise InputError(
            f"{file.name} cannot be read as a PNG or TIFF image: its content is of no known kind."
        ) from error
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
        return _shades(file, np.array(image.convert("RGBA"), dtype=np.float64)) / 255.0


def _shades(file: Path, pixels: FloatArray) -> FloatArray:
    """Shades of pixels (n_rows, n_columns, 4) that are red, green, blue and opacity, if they are grey."""
    for what, wrong in (
        ("opaque", pixels[..., 3] < 255.0),
        ("grey", np.ptp(pixels[..., :3], axis=2) > 0.0),
    ):
        if wrong.any():
            row, column = np.argwhere(wrong)[0] + 1
            raise InputError(
                f"{file.name} must have {what} pixels, whose shades are heights: {wrong.sum():,} are not, "
                f"first in row {row} and column {column}."
            )
    return pixels[..., 0]


def _fault(file: Path) -> str:
    """Say what is wrong in the first bad line of a CSV file."""
    columns = 0
    for number, line in enumerate(file.read_text(encoding="utf-8-sig", errors="replace").splitlines(), 1):
        cells = line.split(",") if line.strip() else []
        for column, cell in enumerate(cells, 1):
            try:
                float(cell)
            except ValueError:
                return f"got {cell[:40]!r} in line {number} and column {column}"
        columns = columns or len(cells)
        if cells and len(cells) != columns:
            return f"line {number} has {len(cells)} of them instead of {columns}"
    return "it does not"


def _check_length(file: Path) -> None:
    """Raise an error if a binary STL file is not as long as its number of triangles says."""
    size = file.stat().st_size
    with file.open("rb") as opened:
        begin = opened.read(84)
    if file.suffix.lower() != ".stl" or begin.lstrip()[:5].lower() == b"solid":
        return
    if size < 84:
        raise InputError(
            f"{file.name} is no STL file: one of text begins with 'solid', any other has 84 bytes or more; "
            f"got {size} bytes, save it again as STL."
        )
    count = int.from_bytes(begin[80:84], "little")
    if size != 84 + 50 * count:
        raise InputError(
            f"{file.name} must be an STL file of text that begins with 'solid', or have "
            f"{84 + 50 * count:,} bytes for {count:,} triangles: got {size:,} bytes."
        )


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
