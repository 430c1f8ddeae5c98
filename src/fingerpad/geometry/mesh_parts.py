"""A finger from nodes, bricks and wedges with named sets, as files of meshes hold them.

Sets of nodes name the skin and what is fixed; sets of elements name the layers. All else is found: faces of
the skin, depth of the layers, the elements around the end organs, the middle of the pad.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from fingerpad.core.errors import InputError
from fingerpad.core.units import LENGTHS_MM
from fingerpad.core.values import FloatArray, IntArray, instance, one_of, pair, positive
from fingerpad.data import fingertip as published
from fingerpad.geometry.fingertip import SIZES_MM
from fingerpad.geometry.free_mesh import FACES, FingerMesh, FreeMesh
from fingerpad.geometry.mesh import CORNERS, LAYERS
from fingerpad.geometry.mesh_checks import PLANE_TOLERANCE, check_mesh, element_place, jacobian_at_gauss

SKIN, BONE, NAIL, FIXED, SYMMETRY = "skin", "bone", "nail", "fixed", "symmetry"
SETS = (SKIN, BONE, NAIL, FIXED, SYMMETRY, *LAYERS)
"""Names of sets; a file may write them with other capitals, and with _ or - for a space."""

_SAME_PLACE = 1e-7  # Distance of two nodes that lie at the same place, over the size of the mesh.
_FLAT_SHARE = 0.05  # Area of a flat side, over that of the skin, from which on it is a plane of symmetry.

_OF_CONTACT = 8
"""Number of nodes of a border nearest to the middle of the pad whose depth is that of the border."""


@dataclass(frozen=True)
class MeshParts:
    """What a file holds: nodes, bricks and wedges, and named sets."""

    source: str  # Name of the file, for errors.
    nodes: FloatArray  # Coordinates, in the file's unit, (n_nodes, 3).
    elements: IntArray
    """Rows of `nodes`; a wedge repeats its third and sixth: 0, 1, 2, 2, 3, 4, 5, 5, (n_elements, 8)."""
    labels: IntArray  # Numbers of the elements in the file, (n_elements,).
    node_sets: Mapping[str, IntArray]
    element_sets: Mapping[str, IntArray]  # Rows of `nodes` and of `elements`.


def plain_name(name: str) -> str:
    """Write the name of a set in small letters with single spaces."""
    return " ".join("".join(c if c.isalnum() else " " for c in name.lower()).split())


def finger_from(
    parts: MeshParts,
    unit: str = "mm",
    axes: str = "x y z",
    names: Mapping[str, str] | None = None,
    contact_mm: tuple[float, float] | None = None,
    receptor_depth_mm: float | None = None,
) -> FingerMesh:
    """Make a finger from nodes, elements and sets; parameters as of `read_finger`."""
    return _Making(parts, names or {}).finger(unit, axes, contact_mm, receptor_depth_mm)


@dataclass(frozen=True)
class _Making:
    """Makes a finger from parts and puts the file's name in front of what is wrong."""

    parts: MeshParts
    names: Mapping[str, str]

    def wrong(self, sentence: str) -> NoReturn:
        raise InputError(f"{self.parts.source}: {sentence}")

    def finger(
        self, unit: str, axes: str, contact_mm: tuple[float, float] | None, receptor_depth_mm: float | None
    ) -> FingerMesh:
        for name in instance("names", self.names, Mapping):
            one_of("names", name, SETS)
        used, elements = np.unique(self.parts.elements, return_inverse=True)
        elements = elements.reshape(-1, 8)
        nodes = self.nodes(used, unit, axes)
        layer = self.layers()
        sets = {name: self.node_set(name, used) for name in (SKIN, BONE, NAIL, FIXED, SYMMETRY)}
        if not sets[SKIN].size:
            self.missing(SKIN, self.parts.node_sets, "nodes")
        bone = sets[BONE] if sets[BONE].size else np.setdiff1d(sets[FIXED], sets[NAIL])
        if not (bone.size or sets[NAIL].size):
            self.missing(f"{BONE}, {NAIL} or {FIXED}", self.parts.node_sets, "nodes")
        symmetry = sets[SYMMETRY]
        if symmetry.size:
            flat = np.flatnonzero(np.abs(nodes[:, 2]) <= PLANE_TOLERANCE * np.ptp(nodes, axis=0).max())
            symmetry = np.union1d(symmetry, flat)
        elements = _wedges_up(nodes, elements)
        faces, owners = self.boundary(elements)
        on_skin = np.isin(faces, sets[SKIN]).all(axis=1)
        if not on_skin.any():
            self.wrong("set skin must hold all corners of faces on the outside of the mesh: it holds none.")
        elements = _skin_up(elements, faces[on_skin], owners[on_skin])
        none = np.empty(0, dtype=np.int64)
        mesh = FreeMesh(
            nodes, elements, layer, (len(elements), 1, 1), not symmetry.size, faces[on_skin], bone,
            sets[NAIL], symmetry, none, none, owners[on_skin], 0.0,
        )  # fmt: skip
        self.check_shape(mesh)
        self.check_open(mesh)
        self.check_cut(mesh, faces, np.concatenate([bone, sets[NAIL]]))
        try:
            check_mesh(mesh)
        except InputError as error:
            self.wrong(str(error))
        contact_mm = self.middle(mesh) if contact_mm is None else pair("contact_mm", contact_mm)
        depths = self.depths(mesh, contact_mm)
        border = _above_dermis(mesh)
        if receptor_depth_mm is None:
            receptor_depth_mm = depths[1] if border.size else published.RECEPTOR_DEPTH.value
            around = border if border.size else self.around(mesh, receptor_depth_mm)
        else:
            around = self.around(mesh, positive("receptor_depth_mm", receptor_depth_mm, "mm"))
        depth = float(receptor_depth_mm)
        midline = _midline(mesh, contact_mm[1])
        whole = replace(mesh, midline_nodes=midline, living_epidermis=around, receptor_depth_mm=depth)
        made = FingerMesh(whole, contact_mm, depths)
        made.skin_point(*contact_mm)
        return made

    def nodes(self, used: IntArray, unit: str, axes: str) -> FloatArray:
        """Nodes of elements in our axes and unit."""
        factor = LENGTHS_MM[one_of("unit", unit, tuple(LENGTHS_MM))]
        signs = {
            f"{sign}{axis}": (n, -1.0 if sign else 1.0) for n, axis in enumerate("xyz") for sign in ("", "-")
        }
        ways = [signs[one_of("each of axes", axis, tuple(signs))] for axis in axes.split()]
        turn = np.zeros((3, 3))
        for row, (column, sign) in enumerate(ways[:3]):
            turn[row, column] = sign
        if len(ways) != 3 or round(float(np.linalg.det(turn))) != 1:
            raise InputError(
                "axes",
                "must name the axes of the file that point to the tip, to the nail and to the side, and "
                "must not mirror it, as 'x y z' or 'z y -x'",
                repr(axes),
            )
        raw = self.parts.nodes[used]
        if not np.isfinite(raw).all():
            self.wrong("nodes must have finite coordinates: some have not.")
        nodes = factor * raw @ turn.T
        extent = np.ptp(nodes, axis=0)
        smallest, largest = SIZES_MM
        if extent.max() > largest or extent.min() < smallest / 2:
            self.wrong(
                f"a finger must extend over {smallest / 2:g} to {largest:g} mm each way: got "
                f"{extent[0]:.3g}, {extent[1]:.3g} and {extent[2]:.3g} mm with unit {unit!r}; give the "
                "unit of the file."
            )
        pairs = cKDTree(nodes).query_pairs(_SAME_PLACE * float(extent.max()), output_type="ndarray")
        if len(pairs):
            x, y, z = nodes[pairs[0, 0]]
            self.wrong(
                f"the mesh is open where two nodes lie at the same place, ({x:.4g}, {y:.4g}, {z:.4g}) mm, "
                f"one of {len(pairs)} pairs: merge them."
            )
        return nodes

    def missing(self, name: str, sets: Mapping[str, IntArray], what: str) -> NoReturn:
        there = ", ".join(sets) or "none"
        self.wrong(
            f"set {name} of {what} is missing: the file has {there}; name it so, or say what it is called "
            f"with names={{{name.split(',')[0]!r}: ...}}."
        )

    def found(self, name: str, sets: Mapping[str, IntArray]) -> IntArray | None:
        """Set of a name, or of the name that the caller gave for it."""
        called = plain_name(self.names.get(name, name))
        for each, members in sets.items():
            if plain_name(each) == called:
                return members
        return None

    def node_set(self, name: str, used: IntArray) -> IntArray:
        members = self.found(name, self.parts.node_sets)
        if members is None:
            if name in self.names:
                self.missing(self.names[name], self.parts.node_sets, "nodes")
            return np.empty(0, dtype=np.int64)
        place = np.searchsorted(used, members)
        there = (place < used.size) & (used[np.minimum(place, used.size - 1)] == members)
        return np.unique(place[there])

    def layers(self) -> IntArray:
        layer = np.full(len(self.parts.elements), -1, dtype=np.int64)
        for number, name in enumerate(LAYERS):
            members = self.found(name, self.parts.element_sets)
            if members is None:
                if name in self.names:
                    self.missing(self.names[name], self.parts.element_sets, "elements")
                continue
            twice = members[layer[members] >= 0]
            if twice.size:
                self.wrong(
                    f"an element must be in one layer: element {self.parts.labels[twice[0]]} is in "
                    f"{LAYERS[layer[twice[0]]]} and in {name}."
                )
            layer[members] = number
        if (layer < 0).all():
            self.missing(
                f"{LAYERS[0]}, {LAYERS[1]}, {LAYERS[2]} or {LAYERS[3]}", self.parts.element_sets, "elements"
            )
        without = np.flatnonzero(layer < 0)
        if without.size:
            self.wrong(
                f"every element must be in the set of a layer: element {self.parts.labels[without[0]]} is in "
                f"none, one of {without.size}."
            )
        return layer

    def boundary(self, elements: IntArray) -> tuple[IntArray, IntArray]:
        """Faces of one element only, and that element."""
        faces = elements[:, FACES].reshape(-1, 4)
        owners = np.repeat(np.arange(len(elements)), len(FACES))
        faces = _triangles_last(faces)
        real = (np.diff(np.sort(faces, axis=1), axis=1) == 0).sum(axis=1) < 2
        faces, owners = faces[real], owners[real]
        _, which, counts = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
        often = counts[which.ravel()]
        if often.max() > 2:
            owner = owners[int(often.argmax())]
            self.wrong(
                f"a face must belong to one or two elements: one of element {self.parts.labels[owner]} has "
                "three."
            )
        return faces[often == 1], owners[often == 1]

    def check_shape(self, mesh: FreeMesh) -> None:
        smallest = jacobian_at_gauss(mesh).min(axis=1)
        inverted = np.flatnonzero(~(smallest > 0.0))
        if inverted.size:
            worst = int(inverted[smallest[inverted].argmin()])
            where = element_place(mesh, worst).partition(" (")[2][:-1]
            self.wrong(
                f"element {self.parts.labels[worst]} is turned inside out (Jacobian {smallest[worst]:.3g} "
                f"mm³), one of {inverted.size} such elements, {where}: move its nodes or reverse their order."
            )
        present = np.unique(mesh.layer)
        corners = [mesh.nodes_mm[mesh.elements[mesh.layer == number]] for number in present]
        middle = [float(np.median(self.depth_of(mesh, each.mean(axis=1)))) for each in corners]
        for number in range(len(present) - 1):
            if middle[number] >= middle[number + 1]:
                self.wrong(
                    f"layers must lie below each other in the order {', '.join(LAYERS)}: "
                    f"{LAYERS[present[number]]} lies {middle[number]:.3g} mm deep and "
                    f"{LAYERS[present[number + 1]]} {middle[number + 1]:.3g} mm."
                )

    def depth_of(self, mesh: FreeMesh, points: FloatArray) -> FloatArray:
        return np.linalg.norm(points - mesh.on_skin(points)[0], axis=1)

    def check_open(self, mesh: FreeMesh) -> None:
        """Check that the skin is one sheet that ends only at the cut, a support or a plane of symmetry."""
        faces = mesh.skin_faces
        edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
        edges = np.sort(edges[edges[:, 0] != edges[:, 1]], axis=1)
        pairs, counts = np.unique(edges, axis=0, return_counts=True)
        if counts.max() > 2:
            x, y, z = mesh.nodes_mm[pairs[counts.argmax()]].mean(axis=0)
            self.wrong(
                f"the skin must be one sheet: more than two faces meet at ({x:.3g}, {y:.3g}, {z:.3g}) mm."
            )
        _, part = _joined(pairs, len(mesh.nodes_mm))
        parts = np.unique(part[mesh.skin_nodes])
        if parts.size > 1:
            first, second = (
                mesh.nodes_mm[mesh.skin_nodes[part[mesh.skin_nodes] == p]].mean(axis=0) for p in parts[:2]
            )
            self.wrong(
                f"set skin must be one piece: it has {parts.size}, about ({_place(first)}) and "
                f"({_place(second)}) mm."
            )
        rim = pairs[counts == 1]
        held = np.zeros(len(mesh.nodes_mm), dtype=bool)
        held[mesh.fixed_nodes] = held[mesh.symmetry_nodes] = True
        rim = rim[~held[rim].all(axis=1)]
        if not rim.size:
            return
        _, loop = _joined(rim, len(mesh.nodes_mm))
        ends = np.unique(rim)
        loops = [ends[loop[ends] == number] for number in np.unique(loop[ends])]
        # The cut is the rim at the proximal end.
        loops.sort(key=lambda nodes: mesh.nodes_mm[nodes, 0].mean())
        if len(loops) > 1:
            self.wrong(
                f"the skin is open: its set has a hole of {loops[1].size} nodes about "
                f"({_place(mesh.nodes_mm[loops[1]].mean(axis=0))}) mm."
            )

    def check_cut(self, mesh: FreeMesh, faces: IntArray, held: IntArray) -> None:
        """Check that a finger with a flat side has named its plane of symmetry."""
        if mesh.symmetry_nodes.size:
            return
        z = mesh.nodes_mm[:, 2]
        tolerance = PLANE_TOLERANCE * float(np.ptp(mesh.nodes_mm, axis=0).max())
        flat = []
        for side in (z.min(), z.max()):
            chosen = faces[(np.abs(z[faces] - side) <= tolerance).all(axis=1)]
            chosen = chosen[
                ~np.isin(chosen, held).all(axis=1) & ~np.isin(chosen, mesh.skin_nodes).all(axis=1)
            ]
            a, b, c, d = (mesh.nodes_mm[chosen[:, corner]] for corner in range(4))
            area = 0.5 * np.linalg.norm(np.cross(c - a, d - b), axis=1).sum()
            if area > _FLAT_SHARE * mesh.skin_area_mm2.sum():
                flat.append(side)
        # A block is flat on both sides.
        if len(flat) == 1:
            self.wrong(
                f"the side at z = {flat[0]:.3g} mm is flat, so half a finger seems to be meant: give the set "
                "symmetry with its nodes, at z = 0."
            )

    def middle(self, mesh: FreeMesh) -> tuple[float, float]:
        """Middle of the pad: the share of the length that it has on the paper's finger."""
        low, high = mesh.nodes_mm.min(axis=0), mesh.nodes_mm.max(axis=0)
        share = published.CONTACT_POINT.value[0] / published.LENGTH.value
        z = 0.0 if not mesh.full or low[2] == -high[2] else 0.5 * (low[2] + high[2])
        return float(low[0] + share * (high[0] - low[0])), float(z)

    def depths(self, mesh: FreeMesh, contact_mm: tuple[float, float]) -> tuple[float, float, float]:
        """Depth of the lower borders of the outer three layers at the middle of the pad."""
        depths: list[float] = []
        for number in range(len(LAYERS) - 1):
            above, below = (mesh.elements[chosen] for chosen in (mesh.layer <= number, mesh.layer > number))
            border = np.intersect1d(above, below)
            border = (
                border[mesh.nodes_mm[border, 1] < np.median(mesh.nodes_mm[:, 1])] if border.size else border
            )
            before = depths[-1] if depths else 0.0
            if not border.size:
                depths.append(before)
                continue
            away = np.hypot(*(mesh.nodes_mm[border][:, [0, 2]] - contact_mm).T)
            near = border[np.argsort(away)[:_OF_CONTACT]]
            depths.append(max(before, float(np.median(self.depth_of(mesh, mesh.nodes_mm[near])))))
        return depths[0], depths[1], depths[2]

    def around(self, mesh: FreeMesh, depth_mm: float) -> IntArray:
        """Elements of one sheet just above the depth of the end organs, all around."""
        chosen = mesh.elements_at(depth_mm)
        if not chosen.size:
            self.wrong(
                f"end organs {depth_mm:g} mm below the skin must lie in the mesh, which is "
                f"{mesh.node_depth_mm.max():.3g} mm deep: give receptor_depth_mm."
            )
        return chosen


def _place(point: FloatArray) -> str:
    return ", ".join(f"{value:.3g}" for value in point)


def _joined(edges: IntArray, n_nodes: int) -> tuple[int, IntArray]:
    """Return the number of parts that edges join nodes to, and the part of each node."""
    graph = coo_array((np.ones(len(edges), dtype=np.int8), edges.T), shape=(n_nodes, n_nodes))
    count, part = connected_components(graph, directed=False)
    return int(count), part


def _triangles_last(faces: IntArray) -> IntArray:
    """Turn faces with two equal neighbours so that these are the last two corners."""
    turned = faces.copy()
    for corner in range(3):
        same = faces[:, corner] == faces[:, corner + 1]
        turned[same] = np.roll(faces[same], 2 - corner, axis=1)
    # First and last are neighbours too.
    same = (faces[:, 3] == faces[:, 0]) & (faces[:, 0] != faces[:, 1])
    turned[same] = np.roll(faces[same], -1, axis=1)
    return turned


def _wedges_up(nodes: FloatArray, elements: IntArray) -> IntArray:
    """Exchange both ends of all wedges if all are turned inside out: a file may count them the other way."""
    wedges = elements[:, 2] == elements[:, 3]
    if not wedges.any():
        return elements
    first, second, third, above = (nodes[elements[wedges, n]] for n in (0, 1, 2, 4))
    volume = (np.cross(second - first, third - first) * (above - first)).sum(axis=1)
    turned = elements.copy()
    if (volume < 0.0).all():
        turned[wedges] = elements[wedges][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    return turned


def _skin_up(elements: IntArray, faces: IntArray, owners: IntArray) -> IntArray:
    """Turn elements so that their last four nodes are a face of the skin, as in other meshes."""
    turned = elements.copy()
    neighbours = {a: [b for b in range(8) if np.abs(CORNERS[a] - CORNERS[b]).sum() == 2.0] for a in range(8)}
    for face, owner in zip(faces, owners, strict=True):
        element = elements[owner]
        if len(set(face)) == 4 and len(set(element)) == 6:
            continue  # a wedge with its side on the skin stays as it is: its triangles are its ends
        for corners in FACES:
            if sorted(element[corners]) != sorted(face):
                continue
            opposite = [next(b for b in neighbours[a] if b not in corners) for a in corners]
            turned[owner] = np.concatenate([element[opposite], element[corners]])
            break
    return turned


def _above_dermis(mesh: FreeMesh) -> IntArray:
    faces = np.sort(mesh.elements[:, FACES], axis=2)
    above, below = (np.flatnonzero(mesh.layer == LAYERS.index(name)) for name in LAYERS[1:3])
    standing = {tuple(face) for element in faces[below].tolist() for face in element if len(set(face)) > 2}
    return above[[any(tuple(face) in standing for face in element) for element in faces[above].tolist()]]


def _midline(mesh: FreeMesh, z_mm: float) -> IntArray:
    """Nodes of the volar skin next to the line of the pad's middle, x increasing."""
    nodes, normals = mesh.skin_nodes, mesh.skin_normals
    volar = nodes[normals[nodes, 1] < 0.0]
    away = np.abs(mesh.nodes_mm[volar, 2] - z_mm)
    sides = mesh.nodes_mm[mesh.skin_triangles]
    near = volar[away <= 0.25 * np.median(np.linalg.norm(sides - np.roll(sides, 1, axis=1), axis=2))]
    return near[np.argsort(mesh.nodes_mm[near, 0], kind="stable")]
