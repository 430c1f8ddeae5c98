"""Meshes of fingers from files: Abaqus .inp, Gmsh .msh (2.2 and 4.1, text) and VTU, with named sets."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, read_text
from fingerpad.core.values import Finite, IntArray, Pair
from fingerpad.geometry.free_mesh import FingerMesh, MeshParts, finger_from, plain_name
from fingerpad.geometry.mesh import LAYERS
from fingerpad.geometry.mesh_checks import FACES

_REFUSED = (
    "bricks of 8 and wedges of 6 nodes are read: tetrahedra with linear displacements lock in tissue that "
    "hardly changes its volume, and elements of higher order have no kernel here; mesh with bricks or wedges"
)
_AS_BRICK = {8: np.arange(8), 6: np.array([0, 1, 2, 2, 3, 4, 5, 5])}
"""Nodes of a brick or a wedge as those of a brick."""

Row = tuple[int, list[str]]  # A line's number and its words.


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
    """Nodes, elements and sets by their numbers while a file is read."""

    source: str
    nodes: dict[int, Sequence[float]] = field(default_factory=dict)
    elements: dict[int, Sequence[int]] = field(default_factory=dict)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)

    def wrong(self, sentence: str, line: int | None = None) -> NoReturn:
        where = "" if line is None else f", line {line}"
        raise InputError(f"{self.source}{where}: {sentence}.")

    def whole(self, line: int, words: Iterable[str]) -> list[int]:
        words = list(words)
        for word in words:
            if not re.fullmatch(r"[+-]?\d+", word):
                self.wrong(f"a whole number must stand here: got {word!r}", line)
        return [int(word) for word in words]

    def node(self, line: int, number: int, words: Sequence[str]) -> None:
        if number in self.nodes:
            self.wrong(f"node {number} must be defined once", line)
        try:
            self.nodes[number] = [float(word) for word in words]
        except ValueError:
            self.wrong(f"numbers must stand here: got {' '.join(words)[:60]!r}", line)

    def element(self, line: int, number: int, nodes: Sequence[int], sets: Iterable[str]) -> None:
        if number in self.elements:
            self.wrong(f"element {number} must be defined once", line)
        self.elements[number] = nodes
        for name in sets:
            self.element_sets.setdefault(name, []).append(number)

    def parts(self) -> MeshParts:
        if not self.elements:
            self.wrong(f"the mesh has no bricks or wedges; {_REFUSED}")
        rows = {
            what: {number: row for row, number in enumerate(numbers)}
            for what, numbers in (("node", self.nodes), ("element", self.elements))
        }

        def rows_of(owner: str, members: Iterable[int], what: str) -> IntArray:
            try:
                return np.array([rows[what][member] for member in members], dtype=np.int64)
            except KeyError as error:
                self.wrong(f"{owner} must name {what}s that exist: there is no {what} {error}")

        node_sets, element_sets = (
            {name: rows_of(f"set {name}", members, what) for name, members in sets.items()}
            for what, sets in (("node", self.node_sets), ("element", self.element_sets))
        )
        elements = [
            rows_of(f"element {number}", nodes, "node")[_AS_BRICK[len(nodes)]]
            for number, nodes in self.elements.items()
        ]
        nodes = np.array(list(self.nodes.values()), dtype=np.float64).reshape(-1, 3)
        numbers = np.array(list(self.elements), dtype=np.int64)
        return MeshParts(self.source, nodes, np.stack(elements), numbers, node_sets, element_sets)


def _read_inp(file: Path) -> MeshParts:
    """Read an Abaqus input file: one part, without *INCLUDE."""
    read = _Read(file.name)
    surfaces: dict[str, list[Row]] = {}
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
                label = read.whole(line, words[:1])[0]
                read.node(line, label, words[1:4])
                if name:
                    read.node_sets.setdefault(name, []).append(label)
        elif keyword == "ELEMENT":
            _inp_elements(read, number, options, rows)
        elif keyword in ("NSET", "ELSET"):
            sets = read.node_sets if keyword == "NSET" else read.element_sets
            sets.setdefault(name, []).extend(_inp_members(read, options, rows, sets))
        elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT") == "ELEMENT":
            surfaces[name] = rows
    for name, rows in surfaces.items():
        members = _inp_surface(read, name, rows)
        if plain_name(name) not in map(plain_name, read.node_sets):
            read.node_sets[name] = members
    return read.parts()


def _cards(read: _Read, text: str) -> Iterator[tuple[int, str, dict[str, str], list[Row]]]:
    """Line, keyword, options and data lines of each card; an element may go on after a comma."""
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
            options = {
                key.strip().upper(): value.strip().strip('"').upper()
                for key, _, value in (part.partition("=") for part in given)
            }
            card, continued = (number, keyword.upper(), options, []), False
            continue
        if card is None:
            read.wrong("a keyword such as *NODE must come first", number)
        words = [word.strip() for word in line.split(",") if word.strip()]
        if continued and card[1] == "ELEMENT":
            card[3][-1][1].extend(words)
        else:
            card[3].append((number, words))
        continued = line.endswith(",")
    if card:
        yield card


def _inp_elements(read: _Read, number: int, options: Mapping[str, str], rows: Sequence[Row]) -> None:
    kind = options.get("TYPE", "")
    if re.match(r"(S[34]|STRI|R3D|M3D|SFM|CPS|CPE|T3D|B3|MASS|SPRING|DCOUP)", kind):
        return  # shells, rigid facets and the like are no tissue
    tissue = re.match(r"(C3D|F3D|SC)([68])(?!\d)", kind)
    if not tissue:
        read.wrong(f"elements must be C3D8, C3D6 or variants of them, got {kind}: {_REFUSED}", number)
    size = int(tissue[2])
    for line, words in rows:
        if len(words) != size + 1:
            read.wrong(
                f"an element {kind} must have a number and {size} nodes: got {len(words)} numbers", line
            )
        label, *nodes = read.whole(line, words)
        read.element(line, label, nodes, [options["ELSET"]] if "ELSET" in options else [])


def _inp_members(
    read: _Read, options: Mapping[str, str], rows: Sequence[Row], sets: Mapping[str, list[int]]
) -> Iterator[int]:
    for line, words in rows:
        if "GENERATE" in options:
            first, last, *step = read.whole(line, words)
            yield from range(first, last + 1, step[0] if step else 1)
            continue
        for word in words:
            yield from sets[word.upper()] if word.upper() in sets else read.whole(line, [word])


def _inp_surface(read: _Read, name: str, rows: Sequence[Row]) -> list[int]:
    found: set[int] = set()
    for line, (owner, *sides) in rows:
        side = sides[0] if sides else ""
        labels = [int(owner)] if owner.isdigit() else read.element_sets.get(owner.upper(), [])
        for label in labels:
            nodes = read.elements.get(label)
            if nodes is None:
                continue  # an element that is not read, such as a rigid facet
            # Abaqus numbers faces as `FACES`, S1 and so on, without the side of a wedge that is an edge.
            faces = _AS_BRICK[len(nodes)][FACES[np.arange(6) != 4] if len(nodes) == 6 else FACES]
            if not re.fullmatch(rf"S[1-{len(faces)}]", side.upper()):
                read.wrong(
                    f"surface {name} must name faces S1 to S{len(faces)} of element {label}: got {side!r}",
                    line,
                )
            found.update(nodes[n] for n in faces[int(side[1]) - 1])
    return sorted(found)


def _read_msh(file: Path) -> MeshParts:
    """Read a Gmsh file, format 2.2 or 4.1 in text."""
    read = _Read(file.name)
    if file.is_file() and b"$MeshFormat" in (start := file.read_bytes()[:64]) and b"\0" in start:
        read.wrong("Gmsh's format must be text: got binary; save with Mesh.Binary=0")
    blocks = _sections(read, read_text(file))
    version, *flavour = blocks.get("MeshFormat", [(1, ["?"])])[0][1]
    if version not in ("2.2", "4.1") or flavour[:1] != ["0"]:
        read.wrong(
            f"Gmsh's format must be 2.2 or 4.1 in text: got {version}"
            f"{', binary' if flavour[:1] == ['1'] else ''}; save with Mesh.Binary=0 and "
            "Mesh.MshFileVersion=4.1"
        )
    names = {
        (int(words[0]), int(words[1])): " ".join(words[2:]).strip('"')
        for _, words in blocks.get("PhysicalNames", [])[1:]
    }
    if not names:
        read.wrong(
            "physical groups with names must label the skin, what is fixed and the layers: the file has none"
        )
    (_msh_22 if version == "2.2" else _msh_41)(read, blocks, names)
    return read.parts()


def _sections(read: _Read, text: str) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    inside: list[Row] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        if words and words[0].startswith("$"):
            inside = [] if words[0].startswith("$End") else found.setdefault(words[0][1:], [])
        elif words:
            inside.append((number, words))
    for name in ("Nodes", "Elements"):
        if name not in found:
            read.wrong(f"section ${name} is missing")
    return found


def _msh_element(read: _Read, line: int, kind: int, row: Sequence[int], groups: Sequence[str]) -> None:
    """Take an element of Gmsh: a brick or wedge of layers, a face of the skin or a support."""
    label, *nodes = row
    if kind in (5, 6):
        read.element(line, label, nodes, groups)
    elif kind in (2, 3, 9, 10, 16):  # triangles and quadrilaterals
        for name in groups:
            read.node_sets.setdefault(name, []).extend(nodes)
    elif kind not in (1, 8, 15):  # lines and points
        read.wrong(f"elements must be of Gmsh's types 5 and 6, element {label} has {kind}: {_REFUSED}", line)


def _msh_22(read: _Read, blocks: Mapping[str, list[Row]], names: Mapping[tuple[int, int], str]) -> None:
    for line, words in blocks["Nodes"][1:]:
        read.node(line, read.whole(line, words[:1])[0], words[1:4])
    for line, words in blocks["Elements"][1:]:
        label, kind, n_tags, group, *rest = read.whole(line, words)
        name = names.get((3 if kind in (5, 6) else 2, group))
        _msh_element(read, line, kind, [label, *rest[n_tags - 1 :]], [name] if name else [])


def _msh_41(read: _Read, blocks: Mapping[str, list[Row]], names: Mapping[tuple[int, int], str]) -> None:
    groups: dict[tuple[int, int], list[str]] = {}
    entities = iter(blocks.get("Entities", []))
    counts = read.whole(*next(entities, (0, [])))
    for dimension, count in enumerate(counts):
        for line, words in (next(entities) for _ in range(count)):
            # Tag, place or box, number of physical groups, and these.
            tag, n_groups, *members = read.whole(line, [words[0], *words[4 if dimension == 0 else 7 :]])
            known = ((dimension, abs(member)) for member in members[:n_groups])
            groups[dimension, tag] = [names[each] for each in known if each in names]
    nodes = iter(blocks["Nodes"][1:])
    for line, words in nodes:
        count = read.whole(line, words)[3]
        numbers = [read.whole(at, row[:1])[0] for at, row in (next(nodes) for _ in range(count))]
        for number in numbers:
            at, row = next(nodes)
            read.node(at, number, row[:3])
    elements = iter(blocks["Elements"][1:])
    for line, words in elements:
        dimension, entity, kind, count = read.whole(line, words)
        for at, row in (next(elements) for _ in range(count)):
            _msh_element(read, at, kind, read.whole(at, row), groups.get((dimension, entity), []))


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
    cells = grid.GetCells()
    offsets, members = (vtk_to_numpy(each()) for each in (cells.GetOffsetsArray, cells.GetConnectivityArray))
    kinds = np.array([grid.GetCellType(n) for n in range(grid.GetNumberOfCells())])
    tissue = np.isin(kinds, (12, 13))
    strange = kinds[(kinds >= 10) & ~tissue]
    if strange.size:
        read.wrong(f"cells must be VTK's kinds 12 and 13, got {strange[0]}: {_REFUSED}")
    read.nodes = dict(enumerate(vtk_to_numpy(grid.GetPoints().GetData()).astype(np.float64)))
    read.elements = {
        n: members[offsets[n] : offsets[n + 1]].tolist() for n in np.flatnonzero(tissue).tolist()
    }
    every = np.ones(len(read.nodes), dtype=bool)
    for data, sets, kept in (
        (grid.GetPointData(), read.node_sets, every),
        (grid.GetCellData(), read.element_sets, tissue),
    ):
        for number in range(data.GetNumberOfArrays()):
            array = data.GetArray(number)
            if array is None or array.GetNumberOfComponents() != 1:
                continue
            name, values = data.GetArrayName(number), vtk_to_numpy(array)
            if kept is tissue and plain_name(name) == "layer":
                sets |= {
                    called: np.flatnonzero(kept & (values == n)).tolist() for n, called in enumerate(LAYERS)
                }
            elif np.issubdtype(values.dtype, np.integer):
                sets[name] = np.flatnonzero(kept & (values != 0)).tolist()
    read.element_sets = {name: chosen for name, chosen in read.element_sets.items() if chosen}
    return read.parts()


_READERS: dict[str, Callable[[Path], MeshParts]] = {".inp": _read_inp, ".msh": _read_msh, ".vtu": _read_vtu}
MESH_FILES = tuple(_READERS)  # Ends of the names of files that `read_finger` reads.
