"""Vertices and triangles of STL, OBJ and PLY files, as they are written; polygons become fans of triangles.

What does not hold together is refused: a file that is cut off, counts that do not fit, vertices that do not
exist. Other files that a file names, such as materials, are never opened.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fingerpad.core.errors import InputError, shown
from fingerpad.core.values import FloatArray, IntArray

Mesh = tuple[FloatArray, IntArray]

_FACET = "facet normal . . . outer loop vertex . . . vertex . . . vertex . . . endloop endfacet"
"""Words of a facet in an STL file of text; a point stands for a number."""

_PLY_NUMBERS = {
    **{"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I"},
    **{"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"},
    **{"float": "f", "double": "d", "float32": "f", "float64": "d"},
}


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

_Take = Callable[[int, str], tuple[Any, ...]]  # So many numbers of one type, in the order of the file.


def _ply(content: bytes) -> Mesh:
    """Vertices and faces of a PLY file, text or binary of either order."""
    end = re.search(rb"end_header[ \t]*(\r\n|\n|\r)", content)
    if not content.startswith(b"ply") or end is None:
        raise InputError("a PLY file must begin with 'ply' and have an end_header: it does not.")
    order, elements = _ply_header(_text(content[: end.start()]))
    body = content[end.end() :]
    promise = " and ".join(f"{count:,} of {name}" for name, count, _ in elements)
    read = _ply_binary(body, elements, order, promise) if order else _ply_text(_text(body), elements, promise)
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


def _ply_row(properties: list[tuple[str, str, str]], columns: dict[str, list[Any]], take: _Take) -> None:
    for column, size, kind in properties:
        columns[column].append(take(int(take(1, size)[0]) if size else 1, kind))


def _popped(words: list[str], count: int, _: str) -> tuple[str, ...]:
    return tuple(words.pop() for _ in range(count))


def _ply_text(text: str, elements: list[_Element], promise: str) -> dict[str, dict[str, Any]]:
    """Columns of each element of a PLY file of text, one row a line."""
    lines = [line for line in text.splitlines() if line.strip()]
    expected = sum(count for _, count, _ in elements)
    if len(lines) != expected:
        raise InputError(
            f"it must have {expected:,} lines after its header, which promises {promise}: got "
            f"{len(lines):,}; save it again as PLY."
        )
    read: dict[str, dict[str, Any]] = {}
    for name, count, properties in elements:
        read[name] = {column: [] for column, _, _ in properties}
        for line in lines[:count]:
            words = line.split()[::-1]
            try:
                _ply_row(properties, read[name], partial(_popped, words))
                # MeshLab writes more numbers behind the vertices of a face than its header says.
                whole = not words or (name == "face" and not properties[-1][1])
            except (IndexError, ValueError):
                whole = False
            if not whole:
                raise InputError(f"a {name} must have as many numbers as the header says: got {shown(line)}.")
        lines = lines[count:]
    return read


def _ply_binary(body: bytes, elements: list[_Element], order: str, promise: str) -> dict[str, dict[str, Any]]:
    """Columns of each element of a binary PLY file, which must be as long as its counts say."""
    used = 0

    def take(count: int, kind: str) -> tuple[Any, ...]:
        nonlocal used
        form = f"{order}{count}{kind}"
        used += struct.calcsize(form)
        return struct.unpack_from(form, body, used - struct.calcsize(form))

    read: dict[str, dict[str, Any]] = {}
    try:
        for name, count, properties in elements:
            columns: dict[str, Any] = {column: [] for column, _, _ in properties}
            if any(size for _, size, _ in properties):
                for _ in range(count):
                    _ply_row(properties, columns, take)
                read[name] = columns
            else:
                row = np.dtype([(column, order + kind) for column, _, kind in properties])
                table = np.frombuffer(body, row, count, used)
                read[name] = {column: table[column] for column in columns}
                used += table.nbytes
    except (struct.error, ValueError) as error:
        raise InputError(
            f"it must hold {promise}, as its header says: it is cut off or its counts are wrong; save it "
            "again as PLY."
        ) from error
    if body[used:].strip():
        raise InputError(
            f"it must have {used:,} bytes after its header, which promises {promise}: got {len(body):,}; "
            "save it again as PLY."
        )
    return read
