"""Height maps as surfaces: from arrays, and from PNG, TIFF, NPY and CSV."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of
from fingerpad.core.values import Finite, FloatArray, Positive, float_array
from fingerpad.geometry.surface import LARGEST_MM, SMALLEST_MM, SMOOTH_BELOW_DEG, Surface
from fingerpad.geometry.surface_files import check_ending

MOST_HEIGHTS = 2_000_000  # Heights of a map that become a body within about 20 s.

IMAGES = (".png", ".tif", ".tiff")
MAPS = (*IMAGES, ".npy", ".csv")

_END_OF_PNG = b"IEND\xaeB`\x82"
_BITS, _PHOTOMETRIC, _SAMPLE_FORMAT = 258, 262, 339
"""Tags of a TIFF image: bits of a sample; 0 for white as zero; 2 for signed numbers."""

LEAST_POINTS = 50  # From this length on a table of three columns is taken for points.


def check_heights(name: str, heights: int) -> None:
    """Raise `InputError` if a map has more heights than become a body in reasonable time."""
    if heights > MOST_HEIGHTS:
        raise InputError(
            name,
            f"must have at most {MOST_HEIGHTS:,} heights",
            f"{heights:,}",
            "crop it or take every second row and column with twice the pitch",
        )


@checked
def height_surface(
    heights_mm: FloatArray,
    pitch_mm: Positive,
    smooth_below_deg: Finite = SMOOTH_BELOW_DEG,
    edge_radius_mm: Finite = 0.0,
) -> Surface:
    """Surface through heights on a regular grid, centred on the indenter's axis.

    Parameters
    ----------
    heights_mm : array (n_rows, n_columns)
        Heights towards the skin; rows run across the finger (z), columns along it (x). [mm]
    pitch_mm : float
        Distance between neighbouring heights. [mm]
    smooth_below_deg, edge_radius_mm : float
        As of `Surface`. [degrees], [mm]

    Examples
    --------
    >>> ripples = 0.2 * np.cos(np.arange(-5, 5.01, 0.1) * 2 * np.pi / 2.5) * np.ones((101, 1))
    >>> rippled = height_surface(ripples, pitch_mm=0.1)
    >>> rippled.front(np.array([[0.0, 0.0, 0.0], [1.25, 0.0, 3.0]])).round(2).tolist()
    [0.0, -0.4]
    """
    heights = float_array("heights_mm", heights_mm, 2)
    rows, columns = heights.shape
    if min(rows, columns) < 2:
        raise InputError("heights_mm", "must have at least 2 rows and 2 columns", f"{rows} and {columns}")
    check_heights("heights_mm", heights.size)
    z, x = ((np.arange(count) - (count - 1) / 2) * pitch_mm for count in (rows, columns))
    vertices = np.stack([*np.broadcast_arrays(x[None, :], heights, z[:, None])], axis=-1).reshape(-1, 3)
    corner = np.arange(rows * columns).reshape(rows, columns)
    # Diagonals alternate, so that a symmetric map has symmetric triangles.
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    even = np.add.outer(np.arange(rows - 1), np.arange(columns - 1)) % 2 == 0
    one, other = np.where(even, [a, b, c], [a, b, d]), np.where(even, [a, c, d], [b, c, d])
    faces = np.concatenate([each.reshape(3, -1).T for each in (one, other)])
    return Surface(vertices, faces, smooth_below_deg, edge_radius_mm)


@checked
def read_height_map(
    path: str | Path,
    pitch_mm: Positive,
    height_mm: Positive = 1.0,
    smooth_below_deg: Finite = SMOOTH_BELOW_DEG,
    edge_radius_mm: Finite = 0.0,
) -> Surface:
    """Read a map of heights towards the skin, without sides or back, centred on the indenter's axis.

    Rows run across the finger and columns along it.

    Parameters
    ----------
    path : str or Path
        PNG or one-page TIFF, grey of up to 16 bits or of signed or float numbers; NPY or CSV with numbers.
    pitch_mm : float
        Distance between neighbouring heights. [mm]
    height_mm : float
        Height of one unit of NPY, CSV, and TIFF of signed or float numbers; of white above black in the other
        images, whichever of them is stored as 0. [mm]
    smooth_below_deg : float
        Hollow creases between triangles of a smaller angle are rounded; see `Surface`. [degrees]
    """
    file = path_of("path", path)
    check_ending(file, MAPS)
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
    check_heights(file.name, heights.size)
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
    if heights.size > 1 and not np.ptp(heights):
        raise InputError(
            f"{file.name} must have heights that differ: all are equal; for a flat body take a FlatPunch or "
            "a Bar."
        )
    _check_no_points(file, heights)
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
        check_heights(file.name, stored.size)
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
    return _image(file)


def _image(file: Path) -> FloatArray:
    """Heights of an image: shades from 0 to 1 for white; signed whole numbers and floats as they are."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        opened = Image.open(file, formats=("PNG", "TIFF"))
    except UnidentifiedImageError as error:
        raise InputError(
            f"{file.name} cannot be read as a PNG or TIFF image: its content is of no known kind."
        ) from error
    except Image.DecompressionBombError as error:
        raise InputError(
            f"{file.name} must have at most {MOST_HEIGHTS:,} heights: got far more; crop it."
        ) from error
    with opened as image:
        check_heights(file.name, image.width * image.height)
        pages = getattr(image, "n_frames", 1)
        if pages > 1:
            raise InputError(f"{file.name} must have one page: got {pages}; save the one with the heights.")
        if image.format == "PNG" and _END_OF_PNG not in file.read_bytes():
            raise InputError(f"{file.name} must end as a PNG image does: it is cut off, save it again.")
        layout = image.tile[0].args
        stored = layout if isinstance(layout, str) else str((layout or ("",))[0])
        if "16" in stored and image.mode[0] != "I":
            raise InputError(
                f"{file.name} must be grey without opacity to have 16 bits: it is {stored.split(';')[0]}, of "
                "which 8 bits would be lost; save it as grey of 16 bits."
            )
        tags = getattr(image, "tag_v2", {})
        signed, bits = 2 in tags.get(_SAMPLE_FORMAT, ()), tags.get(_BITS, (16,))[0]
        turned = ImageOps.exif_transpose(image)
        pixels = np.array(turned)
        if signed and turned.mode == "L":
            pixels = pixels.view(np.int8)
        if signed or turned.mode == "F":
            return pixels.astype(np.float64)
        if turned.mode[0] != "I":
            return _shades(file, np.array(turned.convert("RGBA"), dtype=np.float64)) / 255.0
        shares = (pixels.astype(np.uint32) if bits == 32 else pixels) / (2.0**bits - 1.0)
        # Pillow turns white as zero only where a pixel has 8 bits or less.
        return 1.0 - shares if tags.get(_PHOTOMETRIC) == 0 else shares


def _shades(file: Path, pixels: FloatArray) -> FloatArray:
    """Shades of pixels (n_rows, n_columns, 4) that are red, green, blue and opacity, if they are grey."""
    for what, wrong in (("opaque", pixels[..., 3] < 255.0), ("grey", np.ptp(pixels[..., :3], axis=2) > 0.0)):
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


def _check_no_points(file: Path, heights: FloatArray) -> None:
    """Raise an error if the rows, or the columns, look like points x, y, z instead of heights on a grid."""
    for table in (heights, heights.T):
        if table.shape[1] != 3:
            continue
        x, y = (len(np.unique(table[:, axis])) for axis in (0, 1))
        is_grid = x * y == len(table) == len(np.unique(table[:, :2], axis=0)) and min(x, y) > 1
        if is_grid or len(table) >= LEAST_POINTS:
            raise InputError(
                f"{file.name} must hold heights on a grid, row by row: {len(table):,} times 3 numbers look "
                "like points x, y, z; write their z as rows and columns (a map that is so narrow can go "
                "to fp.height_surface)."
            )


def _said(error: Exception) -> str:
    return " ".join(str(error).split())[:200].rstrip(".") or type(error).__name__
