"""A finger that is a mesh of one's own: bricks and wedges in any order with named sets, as files hold them.

Sets of nodes name the skin and what is fixed; sets of elements name the layers. All else is found: faces of
the skin, depth of the layers, the elements around the end organs, the middle of the pad.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from fingerpad.core.checked import value_class
from fingerpad.core.errors import InputError
from fingerpad.core.units import LENGTHS_MM
from fingerpad.core.values import Finite, FloatArray, IntArray, instance, one_of, pair, positive
from fingerpad.data import fingertip as published
from fingerpad.geometry.fingertip import SIZES_MM, Finger
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.mesh import LAYERS, Mesh
from fingerpad.geometry.mesh_checks import (
    FACES,
    check_mesh,
    check_skin,
    faces_of,
    near_plane,
    place,
    repeats_nodes,
)
from fingerpad.geometry.triangles import Triangles

SETS = ("skin", "bone", "nail", "fixed", "symmetry", *LAYERS)
"""Names of sets; a file may write them with other capitals, and with _ or - for a space."""

UPTURNED = np.array([1.0, -1.0, 1.0])

# The corners across the element from those of each of `FACES`.
_OPPOSITE = [[4, 7, 6, 5], [0, 1, 2, 3], [3, 2, 6, 7], [0, 3, 7, 4], [1, 0, 4, 5], [2, 1, 5, 6]]


@dataclass(frozen=True)
class FreeMesh(Mesh):
    """Bricks and wedges in any order.

    `skin_grid` holds the corners of the faces of the skin, and `living_epidermis` the elements around the end
    organs.
    """

    outer_elements: IntArray
    """Element of each face of the skin; its last four nodes lie on the skin where possible, (n_faces,)."""
    receptor_depth_mm: float  #: Depth of the end organs below the skin, along its normal. [mm]
    numbers: IntArray | None = None  #: Of the elements in their file, for errors, (n_elements,).

    @property
    def is_grid(self) -> bool:
        return False

    @cached_property
    def skin_faces(self) -> IntArray:
        return self.skin_grid

    @property
    def skin_elements(self) -> IntArray:
        return self.outer_elements

    @cached_property
    def skin_triangles(self) -> IntArray:
        """Each face of the skin cut in two, without empty halves, (n_triangles, 3)."""
        a, b, c, d = self.skin_faces.T
        cut = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
        return cut[(cut != np.roll(cut, 1, axis=1)).all(axis=1)]

    @cached_property
    def skin_normals(self) -> FloatArray:
        """Outward unit normal at every node, (n_nodes, 3), weighted by area; 0 off the skin."""
        a, b, c = (self.nodes_mm[self.skin_triangles[:, n]] for n in range(3))
        normals = np.zeros_like(self.nodes_mm)
        for corner in range(3):
            np.add.at(normals, self.skin_triangles[:, corner], np.cross(b - a, c - a))
        if self.symmetry_nodes.size:
            normals[self.symmetry_nodes, 2] = 0.0
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return normals / np.where(length > 0.0, length, 1.0)

    @cached_property
    def node_depth_mm(self) -> FloatArray:
        """Distance of each node from the skin, (n_nodes,). [mm]"""
        return np.linalg.norm(self.nodes_mm - self.on_skin(self.nodes_mm)[0], axis=1)

    @cached_property
    def upturned_skin(self) -> Triangles:
        """The skin turned over, so that the pad is its top."""
        return Triangles.of(self.nodes_mm * UPTURNED, self.skin_triangles)

    def on_skin(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Find the closest points of the skin."""
        triangle, feet = self.upturned_skin.closest(points_mm * UPTURNED)
        feet = feet * UPTURNED
        nodes = self.skin_triangles[triangle]
        corners = self.nodes_mm[nodes]
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        # The weight of a corner is the area of the triangle of the others and the foot.
        ahead, behind = (np.roll(corners, -step, axis=1) - feet[:, None] for step in (1, 2))
        weights = np.linalg.norm(np.cross(ahead, behind), axis=2)
        normals = (weights[..., None] * self.skin_normals[nodes]).sum(axis=1)
        return feet, normals / np.linalg.norm(normals, axis=1, keepdims=True), sides.max(axis=1)


@value_class(eq=False)
class FingerMesh(Finger):
    """A finger that is a mesh of one's own, from `read_finger` or `finger_from`.

    It takes the place of a `Fingertip` in `indent`, `touch_of` and `Touch`. Resolutions choose the steps in
    time only.

    Parameters
    ----------
    mesh : FreeMesh
        The body, x towards the tip, y towards the nail. [mm]
    pad_mm : (float, float)
        x and z of the middle of the pad, `contact_mm`. [mm]
    borders_mm : (float, float, float)
        Depth of the lower borders of the outer three layers below the middle of the pad. [mm]
    """

    mesh: FreeMesh
    pad_mm: tuple[float, float]
    borders_mm: tuple[float, float, float]

    def __repr__(self) -> str:
        counts = f"{len(self.mesh.nodes_mm)} nodes, {len(self.mesh.elements)} elements"
        return f"FingerMesh({counts}, pad_mm={self.pad_mm})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, FingerMesh) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @cached_property
    def _content(self) -> tuple[object, ...]:
        values = [getattr(self.mesh, item.name) for item in fields(self.mesh)]
        plain = tuple(value.tobytes() if isinstance(value, np.ndarray) else value for value in values)
        return (*plain, self.pad_mm, self.borders_mm)

    @property
    def contact_mm(self) -> tuple[float, float]:
        return self.pad_mm

    @property
    def layer_depths_mm(self) -> tuple[float, float, float]:
        return self.borders_mm

    @property
    def relative_size(self) -> float:
        """1: no elements are made."""
        return 1.0

    @property
    def own_mesh(self) -> Mesh:
        return self.mesh

    @cached_property
    def _upturned_bone(self) -> Triangles | None:
        """Faces of the bone turned over, if they are known."""
        mesh = self.mesh
        faces = mesh.elements[:, FACES].reshape(-1, 4)
        held = faces[np.isin(faces, mesh.bone_nodes).all(axis=1)]
        cut = np.concatenate([held[:, [0, 1, 2]], held[:, [0, 2, 3]]])
        return Triangles.of(mesh.nodes_mm * UPTURNED, cut) if len(cut) else None

    def _upturned(self, x: FloatArray, z: FloatArray) -> FloatArray:
        return np.stack([x, np.zeros_like(x), z if self.mesh.full else np.abs(z)], axis=-1).reshape(-1, 3)

    def skin_point(self, x_mm: ArrayLike, z_mm: ArrayLike) -> FloatArray:
        x, z = np.broadcast_arrays(np.asarray(x_mm, dtype=np.float64), np.asarray(z_mm, dtype=np.float64))
        y = -self.mesh.upturned_skin.top(self._upturned(x, z))[0].reshape(x.shape)
        if np.isinf(y).any():
            here = np.isinf(y).argmax()
            raise InputError(
                "position",
                "must lie on the finger, on the skin of its mesh",
                f"x = {x.flat[here]:g}, z = {z.flat[here]:g} mm",
            )
        return np.stack([x, y, z], axis=-1)

    def skin_normal(self, points_mm: ArrayLike) -> FloatArray:
        points = np.asarray(points_mm, dtype=np.float64)
        return self.mesh.on_skin(points.reshape(-1, 3))[1].reshape(points.shape)

    def depth_available_mm(self, x_mm: ArrayLike, z_mm: ArrayLike) -> FloatArray:
        x, y, z = np.moveaxis(self.skin_point(x_mm, z_mm), -1, 0)
        points, bone = self._upturned(x, z), self._upturned_bone
        # A mesh may end at the bone without a face there, or have no back.
        ends = [] if bone is None else [-bone.top(points)[0]]
        ends.append(Triangles.of(self.mesh.nodes_mm, self.mesh.skin_triangles).top(points)[0])
        depth = np.full(x.shape, float(np.ptp(self.mesh.nodes_mm[:, 1])))
        for end in reversed(ends):
            way = end.reshape(x.shape) - y
            depth = np.where((way > 1e-9) & np.isfinite(way), way, depth)
        return depth

    def own_grading(self, x_mm: Finite, z_mm: Finite) -> Grading:
        corners = self.mesh.nodes_mm[self.mesh.skin_triangles]
        away = np.linalg.norm(corners.mean(axis=1) - self.skin_point(x_mm, z_mm), axis=1)
        # The longest side of half a square face is its diagonal. The nearest 32 tell the size.
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        size = float(np.median(longest[np.argsort(away)[:32]]) / np.sqrt(2))
        extent = np.ptp(self.mesh.nodes_mm, axis=0)
        return Grading(x_mm, extent[0], extent[2], size, size, float(extent.max()), full=self.mesh.full)


@dataclass(frozen=True)
class MeshParts:
    """What a file holds: nodes, bricks and wedges, and named sets."""

    source: str  #: Name of the file, for errors.
    nodes: FloatArray  #: Coordinates, in the file's unit, (n_nodes, 3).
    elements: IntArray
    """Rows of `nodes`; a wedge repeats its third and sixth: 0, 1, 2, 2, 3, 4, 5, 5, (n_elements, 8)."""
    labels: IntArray  #: Numbers of the elements in the file, (n_elements,).
    node_sets: Mapping[str, IntArray]
    element_sets: Mapping[str, IntArray]  #: Rows of `nodes` and of `elements`.


def finger_from(
    parts: MeshParts,
    unit: str = "mm",
    axes: str = "x y z",
    names: Mapping[str, str] | None = None,
    contact_mm: tuple[float, float] | None = None,
    receptor_depth_mm: float | None = None,
) -> FingerMesh:
    """Make a finger from nodes, elements and sets; parameters as of `read_finger`."""
    names = instance("names", names or {}, Mapping)
    for name in names:
        one_of("names", name, SETS)
    turn = LENGTHS_MM[one_of("unit", unit, tuple(LENGTHS_MM))] * _axes(axes)
    pad = None if contact_mm is None else pair("contact_mm", contact_mm)
    depth = None if receptor_depth_mm is None else positive("receptor_depth_mm", receptor_depth_mm, "mm")
    try:
        mesh = _mesh(parts, turn, unit, names)
        pad = pad or _middle(mesh)
        borders = _borders(mesh, pad)
        mesh = _with_end_organs(mesh, pad, borders, depth)
    except InputError as error:
        raise InputError(f"{parts.source}: {error}") from error
    made = FingerMesh(mesh, pad, borders)
    made.skin_point(*pad)
    return made


def _axes(axes: str) -> FloatArray:
    """Rows of the axes of a finger in those of a file, (3, 3)."""
    known = {sign + axis: way for sign, side in (("", 1.0), ("-", -1.0))
             for axis, way in zip("xyz", side * np.eye(3), strict=True)}  # fmt: skip
    turn = np.array([known[one_of("each of axes", axis, tuple(known))] for axis in axes.split()])
    if len(turn) != 3 or round(float(np.linalg.det(turn))) != 1:
        raise InputError(
            "axes",
            "must name the axes of the file that point to the tip, to the nail and to the side, and "
            "must not mirror it, as 'x y z' or 'z y -x'",
            repr(axes),
        )
    return turn


def _mesh(parts: MeshParts, turn: FloatArray, unit: str, names: Mapping[str, str]) -> FreeMesh:
    """Nodes, elements and sets of a file, checked, without end organs."""
    used, elements = np.unique(parts.elements, return_inverse=True)
    nodes = parts.nodes[used] @ turn.T
    _check_nodes(nodes, unit)
    layer = _layers(parts, names)
    skin, bone, nail, fixed, symmetry = (
        np.flatnonzero(np.isin(used, _set(name, names, parts.node_sets, "nodes"))) for name in SETS[:5]
    )
    bone = bone if bone.size else np.setdiff1d(fixed, nail)
    for name, members in (("skin", skin), ("bone, nail or fixed", np.union1d(bone, nail))):
        if not members.size:
            raise _missing(name, parts.node_sets, "nodes")
    elements = _wedges_up(nodes, elements.reshape(-1, 8))
    faces, owners, number = faces_of(elements)
    times = np.bincount(number)[number]
    if times.max() > 2:
        label = parts.labels[owners[times.argmax()]]
        raise InputError(f"a face must belong to one or two elements: one of element {label} has three.")
    outside = faces[times == 1]
    of_skin = (times == 1) & np.isin(faces, skin).all(axis=1)
    if not of_skin.any():
        raise InputError("set skin must hold all corners of faces on the outside of the mesh: it holds none.")
    faces, owners = faces[of_skin], owners[of_skin]
    elements = _skin_up(elements, faces, owners)
    none = np.empty(0, dtype=np.int64)
    mesh = FreeMesh(
        nodes, elements, layer, (len(elements), 1, 1), not symmetry.size, faces, bone, nail, symmetry, none,
        none, owners, 0.0, parts.labels,
    )  # fmt: skip
    if symmetry.size:
        mesh = replace(mesh, symmetry_nodes=np.union1d(symmetry, np.flatnonzero(near_plane(mesh))))
    check_mesh(mesh)
    check_skin(mesh, outside)
    return mesh


def _check_nodes(nodes: FloatArray, unit: str) -> None:
    if not np.isfinite(nodes).all():
        raise InputError("nodes must have finite coordinates: some have not.")
    extent = np.ptp(nodes, axis=0)
    smallest, largest = SIZES_MM[0] / 2, SIZES_MM[1]
    if extent.max() > largest or extent.min() < smallest:
        raise InputError(
            f"a finger must extend over {smallest:g} to {largest:g} mm each way: got "
            f"{extent[0]:.3g}, {extent[1]:.3g} and {extent[2]:.3g} mm with unit {unit!r}; give the "
            "unit of the file."
        )
    pairs = cKDTree(nodes).query_pairs(1e-7 * float(extent.max()), output_type="ndarray")
    if len(pairs):
        raise InputError(
            f"the mesh is open where two nodes lie at the same place, {place(nodes[pairs[0, 0]])}, "
            f"one of {len(pairs)} pairs: merge them."
        )


def plain_name(name: str) -> str:
    """Write the name of a set in small letters with single spaces."""
    return " ".join("".join(c if c.isalnum() else " " for c in name.lower()).split())


def _set(name: str, names: Mapping[str, str], sets: Mapping[str, IntArray], what: str) -> IntArray:
    """Members of a set, by its name or the one that the caller gave for it; none without it."""
    called = names.get(name, name)
    for each, members in sets.items():
        if plain_name(each) == plain_name(called):
            return members
    if name in names:
        raise _missing(called, sets, what)
    return np.empty(0, dtype=np.int64)


def _missing(name: str, sets: Mapping[str, IntArray], what: str) -> InputError:
    return InputError(
        f"set {name} of {what} is missing: the file has {', '.join(sets) or 'none'}; name it so, or say what "
        f"it is called with names={{{name.split(',')[0]!r}: ...}}."
    )


def _layers(parts: MeshParts, names: Mapping[str, str]) -> IntArray:
    layer = np.full(len(parts.elements), -1, dtype=np.int64)
    for number, name in enumerate(LAYERS):
        members = _set(name, names, parts.element_sets, "elements")
        twice = members[layer[members] >= 0]
        if twice.size:
            raise InputError(
                f"an element must be in one layer: element {parts.labels[twice[0]]} is in "
                f"{LAYERS[layer[twice[0]]]} and in {name}."
            )
        layer[members] = number
    without = np.flatnonzero(layer < 0)
    if without.size == layer.size:
        raise _missing(", ".join(LAYERS[:3]) + f" or {LAYERS[3]}", parts.element_sets, "elements")
    if without.size:
        raise InputError(
            f"every element must be in the set of a layer: element {parts.labels[without[0]]} is in none, "
            f"one of {without.size}."
        )
    return layer


def _wedges_up(nodes: FloatArray, elements: IntArray) -> IntArray:
    """Exchange both ends of all wedges if all are turned inside out: a file may count them the other way."""
    wedges = elements[:, 2] == elements[:, 3]
    first, second, third, above = (nodes[elements[wedges, n]] for n in (0, 1, 2, 4))
    turned = elements.copy()
    if ((np.cross(second - first, third - first) * (above - first)).sum(axis=1) < 0.0).all():
        turned[wedges] = np.roll(elements[wedges], 4, axis=1)
    return turned


def _skin_up(elements: IntArray, faces: IntArray, owners: IntArray) -> IntArray:
    """Turn elements so that their last four nodes are a face of the skin, as in other meshes."""
    turned = elements.copy()
    # A wedge with its side on the skin stays as it is: its triangles are its ends.
    ends = repeats_nodes(faces) | ~repeats_nodes(elements[owners])
    faces, owners = np.sort(faces[ends], axis=1), owners[ends]
    for corners, opposite in zip(FACES, _OPPOSITE, strict=True):
        up = owners[(np.sort(elements[owners][:, corners], axis=1) == faces).all(axis=1)]
        turned[up] = elements[up][:, [*opposite, *corners]]
    return turned


def _middle(mesh: FreeMesh) -> tuple[float, float]:
    """Middle of the pad: the share of the length that it has on the paper's finger."""
    low, high = mesh.nodes_mm.min(axis=0), mesh.nodes_mm.max(axis=0)
    share = published.CONTACT_POINT.value[0] / published.LENGTH.value
    z = 0.0 if not mesh.full or low[2] == -high[2] else 0.5 * (low[2] + high[2])
    return float(low[0] + share * (high[0] - low[0])), float(z)


def _borders(mesh: FreeMesh, pad_mm: tuple[float, float]) -> tuple[float, float, float]:
    """Depth of the lower borders of the outer three layers at the middle of the pad."""
    depths = [0.0]
    for number in range(len(LAYERS) - 1):
        border = np.intersect1d(mesh.elements[mesh.layer <= number], mesh.elements[mesh.layer > number])
        border = border[mesh.nodes_mm[border, 1] < np.median(mesh.nodes_mm[:, 1])]
        away = np.hypot(*(mesh.nodes_mm[border][:, [0, 2]] - pad_mm).T)
        near = mesh.node_depth_mm[border[np.argsort(away)[:8]]]
        depths.append(max(depths[-1], float(np.median(near)) if near.size else 0.0))
    return depths[1], depths[2], depths[3]


def _with_end_organs(
    mesh: FreeMesh, pad_mm: tuple[float, float], borders_mm: tuple[float, ...], depth_mm: float | None
) -> FreeMesh:
    """Add the elements around the end organs, and the midline."""
    _, owners, number = faces_of(mesh.elements)
    below = number[mesh.layer[owners] == LAYERS.index("dermis")]
    above = (mesh.layer[owners] == LAYERS.index("living epidermis")) & np.isin(number, below)
    sheet = np.unique(owners[above])
    if depth_mm is None and sheet.size:
        depth_mm = borders_mm[1]
    else:
        depth_mm = depth_mm or published.RECEPTOR_DEPTH.value
        sheet = mesh.elements_at(depth_mm)
    if not sheet.size:
        raise InputError(
            f"end organs {depth_mm:g} mm below the skin must lie in the mesh, which is "
            f"{mesh.node_depth_mm.max():.3g} mm deep: give receptor_depth_mm."
        )
    # Next to the line of the pad's middle, x increasing.
    volar = mesh.skin_nodes[mesh.skin_normals[mesh.skin_nodes, 1] < 0.0]
    corners = mesh.nodes_mm[mesh.skin_triangles]
    usual = np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2))
    midline = volar[np.abs(mesh.nodes_mm[volar, 2] - pad_mm[1]) <= 0.25 * usual]
    midline = midline[np.argsort(mesh.nodes_mm[midline, 0], kind="stable")]
    return replace(mesh, midline_nodes=midline, living_epidermis=sheet, receptor_depth_mm=float(depth_mm))
