"""Surfaces from STL, OBJ and PLY; polygons become fans of triangles.

What does not hold together is refused: a file that is cut off, counts that do not fit, vertices that do not
exist. Other files that a file names, such as materials, are never opened.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError, shown
from fingerpad.core.files import LARGEST_TEXT_MB, check_file, path_of
from fingerpad.core.units import LENGTHS_MM
from fingerpad.core.values import Finite, FloatArray, IntArray, Pair, Positive, choice, float_array
from fingerpad.geometry.surface import SMOOTH_BELOW_DEG, Surface

Mesh = tuple[FloatArray, IntArray]

_FACET = "facet normal . . . outer loop vertex . . . vertex . . . vertex . . . endloop endfacet"
"""Words of a facet in an STL file of text; a point stands for a number."""

_PLY_NUMBERS = {
    **{"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I"},
    **{"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"},
    **{"float": "f", "double": "d", "float32": "f", "float64": "d"},
}

_AXES = {
    sign + axis: (number, 1.0 if sign == "+" else -1.0)
    for number, axis in enumerate("xyz")
    for sign in ("+", "-")
}


@checked
def read_surface(
    path: str | Path,
    unit: Annotated[str, choice(LENGTHS_MM)] = "mm",
    scale: Positive = 1.0,
    up: Annotated[str, choice(_AXES)] = "+z",
    at_mm: Pair = (0, 0),
    smooth_below_deg: Finite = SMOOTH_BELOW_DEG,
    edge_radius_mm: Finite = 0.0,
) -> Surface:
    """Read a rigid body of triangles, watertight or open.

    Only the file itself is opened, not what it names, such as materials.

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
    """
    file = path_of("path", path)
    factor = LENGTHS_MM[unit] * scale
    number, sign = _AXES[up]
    at = float_array("at_mm", at_mm, 1)
    if at.shape != (2,):
        raise InputError("at_mm", "must be two numbers, along and across the finger in mm", repr(at_mm))
    check_ending(file, (".stl", ".obj", ".ply"))
    try:
        vertices, faces = read_triangles(file)
    except InputError as error:
        raise InputError(f"{file.name}: {error}") from error
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
    """Vertices without a second one at the same place, sorted, and the triangles of them."""
    # Several times as fast for a million triangles as `numpy.unique` by rows.
    order = np.lexsort(vertices.T[::-1])
    ahead = vertices[order]
    is_new = np.r_[True, (ahead[1:] != ahead[:-1]).any(axis=1)]
    number = np.empty(len(vertices), dtype=np.int64)
    number[order] = np.cumsum(is_new) - 1
    return ahead[is_new], number[faces]


def check_ending(file: Path, endings: tuple[str, ...]) -> None:
    if file.suffix.lower() not in endings:
        raise InputError(f"The file must end in {', '.join(endings)}: got {file.name}.")
    check_file(file, LARGEST_TEXT_MB)
    if not file.stat().st_size:
        raise InputError(f"{file.name} is empty.")


def read_triangles(file: Path) -> Mesh:
    """Vertices (n, 3) and corners of triangles (m, 3) of a file that ends in .stl, .obj or .ply."""
    content = file.read_bytes()
    vertices, faces = {".stl": _stl, ".obj": _obj, ".ply": _ply}[file.suffix.lower()](content)
    if not len(faces):
        raise InputError("it must hold at least one triangle: got none.")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(
            f"it must have triangles of its vertices, 0 to {len(vertices) - 1}: got numbers {faces.min()} to "
            f"{faces.max()}."
        )
    return vertices, faces


def _text(content: bytes) -> str:
    if b"\0" in content:
        raise InputError("it must be text in UTF-8: it has zero bytes, as in UTF-16; save it as UTF-8.")
    return content.decode("utf-8-sig", errors="replace")


def _points(words: Any) -> FloatArray:
    try:
        return np.array(words, dtype=np.float64).reshape(-1, 3)
    except ValueError as error:
        raise InputError("vertices", "must have three numbers each", remedy=str(error)) from error


def _stl(content: bytes) -> Mesh:
    """Triangles of an STL file, each with vertices of its own."""
    # Any binary file has a zero byte up to its count, unless it has 16 million triangles.
    if content.lstrip()[:5].lower() == b"solid" and b"\0" not in content[:84]:
        vertices = _text_stl(_text(content))
    else:
        size, count = len(content), int.from_bytes(content[80:84], "little")
        if size < 84:
            raise InputError(
                "it is no STL file: one of text begins with 'solid', any other has 84 bytes or more; got "
                f"{size} bytes, save it again as STL."
            )
        if size != 84 + 50 * count:
            fault = "it is cut off" if size < 84 + 50 * count else "its count is wrong"
            raise InputError(
                f"an STL file that is no text must have {84 + 50 * count:,} bytes for {count:,} triangles: "
                f"got {size:,} bytes; {fault}, save it again as STL."
            )
        facets = np.frombuffer(content, np.dtype([("numbers", "<f4", (4, 3)), ("_", "<u2")]), offset=84)
        vertices = facets["numbers"][:, 1:].astype(np.float64).reshape(-1, 3)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def _text_stl(text: str) -> FloatArray:
    solid = r"(?im)^[ \t]*(end)?solid\b.*$"
    ends, words = re.findall(solid, text), re.sub(solid, "", text).split()
    pattern = _FACET.split()
    whole = len(words) // len(pattern)
    table = np.array(words[: whole * len(pattern)], dtype=object).reshape(whole, len(pattern))
    for column, expected in enumerate(pattern):
        wrong = [row for row in range(whole) if expected not in (".", table[row, column].lower())]
        if wrong:
            raise InputError(
                f"facet {wrong[0] + 1} must have a normal and three vertices of three numbers: got "
                f"{shown(table[wrong[0], column])} instead of {expected!r}."
            )
    if len(words) % len(pattern) or 2 * ends.count("end") != len(ends):
        raise InputError(
            f"it must end with 'endsolid' after a whole facet: it is cut off after {whole:,} facets; save it "
            "again as STL."
        )
    return _points(table[:, [8, 9, 10, 12, 13, 14, 16, 17, 18]])


def _obj(content: bytes) -> Mesh:
    """Vertices and faces of an OBJ file; textures, normals, materials and lines are passed over."""
    vertices: list[list[str]] = []
    polygons: list[list[int]] = []
    for number, line in enumerate(re.sub(r"\\\r?\n", " ", _text(content)).split("\n"), 1):
        kind, *words = line.partition("#")[0].split() or [""]
        if kind == "v":
            if len(words) < 3:
                raise InputError(f"line {number}: a vertex must have three numbers: got {shown(line)}.")
            vertices.append(words[:3])
        elif kind == "f":
            try:
                named = [int(word.partition("/")[0]) for word in words]
            except ValueError as error:
                raise InputError(
                    f"line {number}: a face must name its vertices: got {shown(line)}."
                ) from error
            if 0 in named or len(named) < 3:
                raise InputError(
                    f"line {number}: a face must name three vertices or more, the first vertex as 1: got "
                    f"{shown(line)}."
                )
            polygons.append([each - 1 if each > 0 else len(vertices) + each for each in named])
    points = _points(vertices)
    return points, _fans(polygons, points)


def _fans(polygons: list[list[int]], vertices: FloatArray) -> IntArray:
    """Triangles of polygons, as fans from their first corner whose triangles all turn the same side out."""
    faces = [np.zeros((0, 3), dtype=np.int64)]
    for size in sorted(set(map(len, polygons))):
        corners = np.array([polygon for polygon in polygons if len(polygon) == size], dtype=np.int64)
        if size < 3:
            raise InputError(f"a face must have three vertices or more: one has {size}.")
        if size > 3 and corners.min() >= 0 and corners.max() < len(vertices):
            todo = np.arange(len(corners))
            for _ in range(size):
                at = vertices[corners[todo]]
                normal = np.cross(at[:, 1:-1] - at[:, :1], at[:, 2:] - at[:, :1])
                total = normal.sum(axis=1, keepdims=True)
                folded = ((normal * total).sum(axis=2) < -1e-9 * (total * total).sum(axis=2)).any(axis=1)
                todo = todo[folded]
                corners[todo] = np.roll(corners[todo], 1, axis=1)
            if todo.size:
                raise InputError(
                    "faces",
                    "must be triangles, or polygons that a fan of triangles fills",
                    remedy=f"{todo.size:,} of {size} vertices are not; divide them into triangles",
                )
        faces.extend(corners[:, [0, k, k + 1]] for k in range(1, size - 1))
    return np.concatenate(faces)


_Element = tuple[str, int, list[tuple[str, str, str]]]
"""Name, count and properties of an element: name, type of the count of a list or "", type."""


def _ply(content: bytes) -> Mesh:
    """Vertices and faces of a PLY file, text or binary of either order."""
    end = re.search(rb"end_header[ \t]*(\r\n|\n|\r)", content)
    if not content.startswith(b"ply") or end is None:
        raise InputError("a PLY file must begin with 'ply' and have an end_header: it does not.")
    order, elements = _ply_header(_text(content[: end.start()]))
    read = _ply_columns(content[end.end() :], elements, order)
    vertices, faces = read.get("vertex", {}), read.get("face", {})
    if not {"x", "y", "z"} <= set(vertices):
        raise InputError("a PLY file must have vertices with x, y and z: it has none.")
    points = _points(np.transpose([np.ravel(vertices[axis]) for axis in "xyz"]))
    try:
        polygons = faces.get("vertex_indices", faces.get("vertex_index", []))
        return points, _fans([[int(corner) for corner in polygon] for polygon in polygons], points)
    except ValueError as error:
        raise InputError(
            "faces", "must be lists of whole numbers, their vertices", remedy=str(error)
        ) from error


def _ply_header(text: str) -> tuple[str, list[_Element]]:
    """Order of the bytes, "" for text, and the elements."""
    orders = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
    order: str | None = None
    elements: list[_Element] = []
    for line in text.splitlines()[1:]:
        match line.split():
            case ["format", kind, _] if kind in orders:
                order = orders[kind]
            case ["element", name, count] if count.isdecimal():
                elements.append((name, int(count), []))
            case ["property", "list", size, kind, name] if {size, kind} <= set(_PLY_NUMBERS) and elements:
                elements[-1][2].append((name, _PLY_NUMBERS[size], _PLY_NUMBERS[kind]))
            case ["property", kind, name] if kind in _PLY_NUMBERS and elements:
                elements[-1][2].append((name, "", _PLY_NUMBERS[kind]))
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise InputError(f"the header of a PLY file must not have the line {shown(line)}.")
    if order is None:
        raise InputError(f"a PLY file must have a format, {', '.join(orders)}: it has none.")
    return order, elements


def _ply_columns(body: bytes, elements: list[_Element], order: str) -> dict[str, dict[str, Any]]:
    """Columns of each element of a PLY file, text (one row a line) or binary, as many as its header says."""
    lines = [] if order else [line.split() for line in _text(body).splitlines() if line.strip()]
    lines.reverse()
    words: list[str] = []
    used = 0

    def take(count: int, kind: str) -> tuple[Any, ...]:
        nonlocal used
        if not order:
            return tuple(words.pop(0) for _ in range(count))
        form = f"{order}{count}{kind}"
        used += struct.calcsize(form)
        return struct.unpack_from(form, body, used - struct.calcsize(form))

    read: dict[str, dict[str, Any]] = {}
    try:
        for name, count, properties in elements:
            columns: dict[str, Any] = {column: [] for column, _, _ in properties}
            read[name] = columns
            if order and not any(size for _, size, _ in properties):
                row = np.dtype([(column, order + kind) for column, _, kind in properties])
                table = np.frombuffer(body, row, count, used)
                columns.update((column, table[column]) for column in columns)
                used += table.nbytes
                continue
            for _ in range(count):
                words = words if order else lines.pop()
                for column, size, kind in properties:
                    columns[column].append(take(int(take(1, size)[0]) if size else 1, kind))
                # MeshLab writes more numbers behind the vertices of a face than its header says.
                if words and (name != "face" or properties[-1][1]):
                    raise IndexError
        fits = not (body[used:].strip() if order else lines)
    except (IndexError, ValueError, struct.error):
        fits = False
    if not fits:
        promise = " and ".join(f"{count:,} of {name}" for name, count, _ in elements)
        raise InputError(
            f"it must hold {promise}, as its header says: it is cut off or its counts are wrong; save it "
            "again as PLY."
        )
    return read
