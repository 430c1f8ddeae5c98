"""Meshes of fingers from files: Abaqus .inp, Gmsh .msh (2.2 and 4.1, text) and VTU, with named sets."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, read_text
from fingerpad.core.values import Finite, IntArray, Pair
from fingerpad.geometry.free_mesh import FingerMesh
from fingerpad.geometry.mesh import LAYERS
from fingerpad.geometry.mesh_parts import MeshParts, finger_from, plain_name

_WEDGE = [0, 1, 2, 2, 3, 4, 5, 5]
_REFUSED = (
    "bricks of 8 and wedges of 6 nodes are read: tetrahedra with linear displacements lock in tissue that "
    "hardly changes its volume, and elements of higher order have no kernel here; mesh with bricks or wedges"
)

_GMSH = {5: 8, 6: 6}  # Nodes of Gmsh's types that are read: brick and wedge.

_GMSH_FLAT = (2, 3, 9, 10, 16)
_GMSH_SMALL = (1, 8, 15)

_INP_WEDGE_FACES = ([0, 1, 2], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5])
_INP_BRICK_FACES = ([0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7])
"""Nodes of the faces S1, S2, ... of Abaqus."""


@checked
def read_finger(
    path: Path | str,
    unit: str = "mm",
    axes: str = "x y z",
    names: Mapping[str, str] | None = None,
    contact_mm: Pair | None = None,
    receptor_depth_mm: Finite | None = None,
) -> FingerMesh:
    """Read a finger from a file of a mesh; it takes the place of a `Fingertip`.

    The mesh consists of bricks and wedges. Sets of nodes are "skin", what is fixed ("bone" and "nail", or
    "fixed") and, for half a finger at z >= 0, "symmetry"; sets of elements are the layers "stratum corneum",
    "living epidermis", "dermis" and "subcutis", one of them at least. Capitals, _ and - do not matter. What
    a file gives as a set:

    ==== ======================================================================================
    .inp ``*NSET``, ``*ELSET`` and, for the skin and what is fixed, ``*SURFACE``
    .msh physical groups: volumes for the layers, surfaces for the skin and what is fixed
    .vtu arrays of points and cells that are not 0 on the members; or ``layer`` of cells, 0 to 3
    ==== ======================================================================================

    Parameters
    ----------
    path : str or Path
        The file.
    unit : {"mm", "um", "cm", "m", "inch"}
        Unit of its coordinates.
    axes : str
        Axes of the file that point to the tip, to the nail and to the side, such as "z y -x".
    names : mapping of str to str, optional
        Name in the file of a set, by its name here.
    contact_mm : (float, float), optional
        x and z of the middle of the pad; by default at the same share of the length as on the paper's finger,
        in the middle of the width. [mm]
    receptor_depth_mm : float, optional
        Depth of the end organs below the skin; by default that of the border between living epidermis and
        dermis at the middle of the pad or, without these layers, the paper's. [mm]

    Raises
    ------
    InputError
        If the file cannot be read, has elements of another kind, or a mesh that is inverted, open, without
        the sets or in another unit; with file, set and element.

    Examples
    --------
    >>> read_finger("finger.stl")
    Traceback (most recent call last):
    fingerpad.core.errors.InputError: finger.stl: a mesh must be a file .inp, .msh or .vtu.
    """
    file = path_of("path", path)
    reader = _READERS.get(file.suffix.lower())
    if reader is None:
        raise InputError(f"{file.name}: a mesh must be a file .inp, .msh or .vtu.")
    try:
        parts = reader(file)
    except InputError:
        raise
    except (StopIteration, IndexError, KeyError, ValueError) as error:
        raise InputError(
            f"{file.name}: the file is cut short or not in the form of {file.suffix}."
        ) from error
    return finger_from(parts, unit, axes, names, contact_mm, receptor_depth_mm)


@dataclass
class _Read:
    """Numbered nodes, elements and sets while a file is read."""

    source: str
    node_numbers: list[int] = field(default_factory=list)
    nodes: list[Sequence[float]] = field(default_factory=list)
    element_numbers: list[int] = field(default_factory=list)
    elements: list[Sequence[int]] = field(default_factory=list)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)

    def wrong(self, sentence: str, line: int | None = None) -> NoReturn:
        where = "" if line is None else f", line {line}"
        raise InputError(f"{self.source}{where}: {sentence}.")

    def parts(self) -> MeshParts:
        if not self.elements:
            self.wrong(f"the mesh has no bricks or wedges; {_REFUSED}")
        for what, numbers in (("node", self.node_numbers), ("element", self.element_numbers)):
            known, counts = np.unique(numbers, return_counts=True)
            if (counts > 1).any():
                self.wrong(
                    f"{what} {known[counts.argmax()]} must be defined once: it is there {counts.max()} times"
                )
        rows = np.array(
            [row if len(row) == 8 else [row[n] for n in _WEDGE] for row in self.elements], dtype=np.int64
        )
        lost = np.flatnonzero(~np.isin(rows, self.node_numbers).all(axis=1))
        if lost.size:
            missing = np.setdiff1d(rows[lost[0]], self.node_numbers)[0]
            self.wrong(
                f"element {self.element_numbers[lost[0]]} must name nodes that exist: there is no {missing}"
            )
        return MeshParts(
            self.source,
            np.array(self.nodes, dtype=np.float64).reshape(-1, 3),
            self._rows("element", rows.ravel(), self.node_numbers, "node").reshape(-1, 8),
            np.array(self.element_numbers, dtype=np.int64),
            self._sets(self.node_sets, self.node_numbers, "node"),
            self._sets(self.element_sets, self.element_numbers, "element"),
        )

    def _sets(self, sets: Mapping[str, list[int]], numbers: list[int], what: str) -> dict[str, IntArray]:
        return {
            name: self._rows(f"set {name}", np.array(members, dtype=np.int64), numbers, what)
            for name, members in sets.items()
        }

    def _rows(self, owner: str, members: IntArray, numbers: list[int], what: str) -> IntArray:
        known = np.array(numbers, dtype=np.int64)
        order = np.argsort(known, kind="stable")
        place = np.minimum(np.searchsorted(known[order], members), max(known.size - 1, 0))
        if members.size and (not known.size or (known[order][place] != members).any()):
            strange = members[known[order][place] != members][0] if known.size else members[0]
            self.wrong(f"{owner} must name {what}s that exist: there is no {what} {strange}")
        return order[place] if members.size else members


def _numbers(
    read: _Read, line: int, words: Sequence[str], kind: Callable[[str], float] = float
) -> list[float]:
    try:
        return [kind(word) for word in words]
    except ValueError:
        read.wrong(f"numbers must stand here: got {' '.join(words)[:60]!r}", line)


def _read_inp(file: Path) -> MeshParts:
    """Read an Abaqus input file: one part, without *INCLUDE."""
    read = _Read(file.name)
    surfaces: dict[str, list[tuple[str, str]]] = {}
    parts = 0
    for number, keyword, options, rows in _cards(read, read_text(file)):
        name = options.get("NSET") or options.get("ELSET") or options.get("NAME") or ""
        if keyword == "INCLUDE":
            read.wrong("*INCLUDE is not read: put the mesh into one file", number)
        elif keyword in ("PART", "INSTANCE"):
            parts += keyword == "PART"
            if parts > 1 or (keyword == "INSTANCE" and rows):
                read.wrong("one part that is not moved is read: write the mesh as one part", number)
        elif keyword == "NODE":
            for line, words in rows:
                if len(words) < 4:
                    read.wrong("a node must have a number, x, y and z", line)
                read.node_numbers.append(_whole(read, line, words[0]))
                read.nodes.append(_numbers(read, line, words[1:4]))
            if name:
                read.node_sets.setdefault(name, []).extend(
                    _whole(read, line, words[0]) for line, words in rows
                )
        elif keyword == "ELEMENT":
            _inp_elements(read, number, options, rows)
        elif keyword in ("NSET", "ELSET"):
            sets = read.node_sets if keyword == "NSET" else read.element_sets
            sets.setdefault(name, []).extend(_inp_members(read, options, rows, sets))
        elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT") == "ELEMENT":
            surfaces[name] = [(words[0], words[1] if len(words) > 1 else "") for _, words in rows]
    for name, faces in surfaces.items():
        members = _inp_surface(read, name, faces)
        if plain_name(name) not in map(plain_name, read.node_sets):
            read.node_sets[name] = members
    return read.parts()


Row = tuple[int, list[str]]


def _cards(read: _Read, text: str) -> Iterator[tuple[int, str, dict[str, str], list[Row]]]:
    """Keyword, options and data lines of each card; lines that end in a comma continue."""
    card: tuple[int, str, dict[str, str], list[Row]] | None = None
    continued = False
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*"):
            if card:
                yield card
            keyword, *given = (part.strip() for part in line[1:].split(","))
            options = {}
            for part in given:
                key, _, value = part.partition("=")
                options[key.strip().upper()] = value.strip().strip('"').upper()
            card, continued = (number, keyword.upper(), options, []), False
            continue
        if card is None:
            read.wrong("a keyword such as *NODE must come first", number)
        words = [word.strip() for word in line.split(",")]
        open_line = words[-1] == ""
        words = [word for word in words if word]
        long = card[1] == "ELEMENT"
        if continued and long:
            card[3][-1][1].extend(words)
        else:
            card[3].append((number, words))
        continued = open_line
    if card:
        yield card


def _whole(read: _Read, line: int, word: str) -> int:
    if not re.fullmatch(r"[+-]?\d+", word):
        read.wrong(f"a whole number must stand here: got {word!r}", line)
    return int(word)


def _inp_elements(read: _Read, number: int, options: Mapping[str, str], rows: Sequence[Row]) -> None:
    kind = options.get("TYPE", "")
    size = 8 if re.match(r"C3D8|F3D8|SC8", kind) else 6
    if not re.match(r"(C3D|F3D|SC)[68]", kind):
        if re.match(r"(S[34]|STRI|R3D|M3D|SFM|CPS|CPE|T3D|B3|MASS|SPRING|DCOUP)", kind):
            return  # shells, rigid facets and the like are no tissue
        read.wrong(f"elements must be C3D8, C3D6 or variants of them, got {kind}: {_REFUSED}", number)
    for line, words in rows:
        if len(words) != size + 1:
            read.wrong(
                f"an element {kind} must have a number and {size} nodes: got {len(words)} numbers", line
            )
        label, *nodes = (_whole(read, line, word) for word in words)
        read.element_numbers.append(label)
        read.elements.append(nodes)
        if "ELSET" in options:
            read.element_sets.setdefault(options["ELSET"], []).append(label)


def _inp_members(
    read: _Read, options: Mapping[str, str], rows: Sequence[Row], sets: Mapping[str, list[int]]
) -> Iterator[int]:
    for line, words in rows:
        if "GENERATE" in options:
            first, last, *step = (_whole(read, line, word) for word in words)
            yield from range(first, last + 1, step[0] if step else 1)
            continue
        for word in words:
            if word.upper() in sets:
                yield from sets[word.upper()]
            else:
                yield _whole(read, line, word)


def _inp_surface(read: _Read, name: str, faces: Sequence[tuple[str, str]]) -> list[int]:
    rows = dict(zip(read.element_numbers, read.elements, strict=True))
    found: set[int] = set()
    for owner, side in faces:
        labels = read.element_sets.get(owner.upper()) if not owner.isdigit() else [int(owner)]
        tables = {8: _INP_BRICK_FACES, 6: _INP_WEDGE_FACES}
        for label in labels or ():
            if label not in rows:
                continue  # of an element that is not read, such as a rigid facet
            table = tables[len(rows[label])]
            if not re.fullmatch(rf"S[1-{len(table)}]", side.upper()):
                read.wrong(
                    f"surface {name} must name faces S1 to S{len(table)} of element {label}: got {side!r}"
                )
            found.update(rows[label][n] for n in table[int(side[1]) - 1])
    return sorted(found)


def _read_msh(file: Path) -> MeshParts:
    """Read a Gmsh file, format 2.2 or 4.1 in text."""
    read = _Read(file.name)
    blocks = _sections(read, _text_of(read, file))
    version, *flavour = blocks.get("MeshFormat", [(1, ["?"])])[0][1]
    if version not in ("2.2", "4.1") or flavour[:1] != ["0"]:
        read.wrong(
            f"Gmsh's format must be 2.2 or 4.1 in text: got {version}"
            f"{', binary' if flavour[:1] == ['1'] else ''}; save with Mesh.Binary=0 and "
            "Mesh.MshFileVersion=4.1"
        )
    names = {}
    for _, words in blocks.get("PhysicalNames", [])[1:]:
        names[int(words[0]), int(words[1])] = " ".join(words[2:]).strip('"')
    if not names:
        read.wrong(
            "physical groups with names must label the skin, what is fixed and the layers: the file has none"
        )
    (_msh_22 if version == "2.2" else _msh_41)(read, blocks, names)
    return read.parts()


def _text_of(read: _Read, file: Path) -> str:
    try:
        return read_text(file)
    except InputError:
        if file.exists() and b"$MeshFormat" in file.read_bytes()[:64]:
            read.wrong("Gmsh's format must be text: got binary; save with Mesh.Binary=0")
        raise


def _sections(read: _Read, text: str) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    inside: list[Row] | None = None
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if line.startswith("$End"):
            inside = None
        elif line.startswith("$"):
            inside = found.setdefault(line[1:], [])
        elif line and inside is not None:
            inside.append((number, line.split()))
    for name in ("Nodes", "Elements"):
        if name not in found:
            read.wrong(f"section ${name} is missing")
    return found


def _msh_element(
    read: _Read, line: int, kind: int, label: int, nodes: Sequence[int], groups: Sequence[str]
) -> None:
    """Take an element of Gmsh: a brick or wedge of layers, a face of the skin or a support."""
    if kind in _GMSH:
        read.element_numbers.append(label)
        read.elements.append(nodes)
        for name in groups:
            read.element_sets.setdefault(name, []).append(label)
    elif kind in _GMSH_FLAT:
        for name in groups:
            read.node_sets.setdefault(name, []).extend(nodes)
    elif kind not in _GMSH_SMALL:
        read.wrong(f"elements must be of Gmsh's types 5 and 6, element {label} has {kind}: {_REFUSED}", line)


def _msh_22(read: _Read, blocks: Mapping[str, list[Row]], names: Mapping[tuple[int, int], str]) -> None:
    for line, words in blocks["Nodes"][1:]:
        read.node_numbers.append(_whole(read, line, words[0]))
        read.nodes.append(_numbers(read, line, words[1:4]))
    for line, words in blocks["Elements"][1:]:
        label, kind, n_tags, group, *rest = (_whole(read, line, word) for word in words)
        nodes = rest[n_tags - 1 :]
        dimension = 3 if kind in _GMSH else 2
        name = names.get((dimension, group))
        _msh_element(read, line, kind, label, nodes, [name] if name else [])


def _msh_41(read: _Read, blocks: Mapping[str, list[Row]], names: Mapping[tuple[int, int], str]) -> None:
    groups = _msh_entities(read, blocks.get("Entities", []), names)
    lines = iter(blocks["Nodes"][1:])
    for line, words in lines:
        count = _whole(read, line, words[3])
        tags = [_whole(read, at, words[0]) for at, words in [next(lines) for _ in range(count)]]
        read.node_numbers += tags
        read.nodes += [_numbers(read, at, row[:3]) for at, row in [next(lines) for _ in range(count)]]
    lines = iter(blocks["Elements"][1:])
    for line, words in lines:
        dimension, entity, kind, count = (_whole(read, line, word) for word in words)
        for _ in range(count):
            at, row = next(lines)
            label, *nodes = (_whole(read, at, word) for word in row)
            _msh_element(read, at, kind, label, nodes, groups.get((dimension, entity), []))


def _msh_entities(
    read: _Read, rows: Sequence[Row], names: Mapping[tuple[int, int], str]
) -> dict[tuple[int, int], list[str]]:
    """Names of the physical groups of each entity, by dimension and tag."""
    groups: dict[tuple[int, int], list[str]] = {}
    if not rows:
        return groups
    counts = [_whole(read, rows[0][0], word) for word in rows[0][1]]
    dimensions = [dimension for dimension, count in enumerate(counts) for _ in range(count)]
    for dimension, (line, words) in zip(dimensions, rows[1:], strict=False):
        tag = _whole(read, line, words[0])
        after = 4 if dimension == 0 else 7
        count = _whole(read, line, words[after])
        members = [abs(_whole(read, line, word)) for word in words[after + 1 : after + 1 + count]]
        groups[dimension, tag] = [names[dimension, each] for each in members if (dimension, each) in names]
    return groups


def _read_vtu(file: Path) -> MeshParts:
    """Read a VTK unstructured grid with the package vtk."""
    read = _Read(file.name)
    try:
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
    except ImportError as error:
        raise InputError(
            "Reading VTU files needs the package vtk, which is not installed: pip install 'fingerpad[vtk]'."
        ) from error
    head = file.read_bytes()[:2000] if file.is_file() else b""
    if b"UnstructuredGrid" not in head:
        read.wrong(
            "an XML file of a VTK unstructured grid must be here" if head else "the file cannot be read"
        )
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.Update()
    grid = reader.GetOutput()
    if not grid.GetNumberOfCells():
        read.wrong("the grid has no cells")
    points = vtk_to_numpy(grid.GetPoints().GetData()).astype(np.float64)
    cells = grid.GetCells()
    offsets, members = (vtk_to_numpy(each()) for each in (cells.GetOffsetsArray, cells.GetConnectivityArray))
    kinds = np.array([grid.GetCellType(n) for n in range(grid.GetNumberOfCells())])
    kept = np.flatnonzero(np.isin(kinds, (12, 13)))
    strange = kinds[(kinds >= 10) & ~np.isin(kinds, (12, 13))]
    if strange.size:
        read.wrong(f"cells must be VTK's kinds 12 and 13, got {strange[0]}: {_REFUSED}")
    read.node_numbers, read.nodes = list(range(len(points))), list(points)
    read.element_numbers = kept.tolist()
    read.elements = [members[offsets[n] : offsets[n + 1]].tolist() for n in kept]
    for data, sets in ((grid.GetPointData(), read.node_sets), (grid.GetCellData(), read.element_sets)):
        for number in range(data.GetNumberOfArrays()):
            array = data.GetArray(number)
            if array is None or array.GetNumberOfComponents() != 1:
                continue
            name, values = data.GetArrayName(number), vtk_to_numpy(array)
            if sets is read.element_sets and plain_name(name) == "layer":
                for layer, called in enumerate(LAYERS):
                    chosen = np.flatnonzero(values == layer)
                    sets[called] = chosen[np.isin(chosen, kept)].tolist()
            elif np.issubdtype(values.dtype, np.integer):
                chosen = np.flatnonzero(values)
                sets[name] = (chosen if sets is read.node_sets else chosen[np.isin(chosen, kept)]).tolist()
    read.element_sets = {name: chosen for name, chosen in read.element_sets.items() if chosen}
    return read.parts()


_READERS: dict[str, Callable[[Path], MeshParts]] = {".inp": _read_inp, ".msh": _read_msh, ".vtu": _read_vtu}
MESH_FILES = tuple(_READERS)  # Ends of the names of files that `read_finger` reads.
