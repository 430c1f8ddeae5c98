"""Checks of a mesh before a solution; each error names the node or element and its place.

Meshes from `block_mesh` and `finger_mesh` pass all checks; they are for meshes made or changed by hand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse import coo_array

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.geometry.mesh import CORNERS, LAYERS, Mesh
from fingerpad.geometry.triangles import groups

FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
"""Corners of the faces of a brick, counter-clockwise seen from outside."""


def _jacobians(mesh: Mesh, elements: IntArray, points: FloatArray) -> FloatArray:
    """Jacobian matrices (n_elements, n_points, 3, 3), columns along the local axes, at local `points`."""
    factors = 1.0 + points[:, None, :] * CORNERS
    gradients = np.stack(
        [CORNERS[:, axis] * np.delete(factors, axis, axis=2).prod(axis=2) / 8.0 for axis in range(3)], axis=-1
    )
    return np.einsum("mad,qac->mqdc", mesh.nodes_mm[elements], gradients, optimize=True)


def jacobian_at_gauss(mesh: Mesh) -> FloatArray:
    """Compute the Jacobian determinant at the 2 x 2 x 2 Gauss points, (n_elements, 8) [mm³].

    An element's volume is the sum of its row.
    """
    return np.linalg.det(_jacobians(mesh, mesh.elements, CORNERS / np.sqrt(3.0)))


def scaled_jacobian(mesh: Mesh) -> FloatArray:
    """Smallest Jacobian of each element over the product of its edges' lengths, (n_elements,); 1 is a box.

    Bricks are evaluated at their corners. Wedges have no Jacobian at the collapsed side and are evaluated at
    the Gauss points.
    """
    wedge = repeats_nodes(mesh.elements)
    quality = np.empty(len(mesh.elements))
    for chosen, points in ((~wedge, CORNERS), (wedge, CORNERS / np.sqrt(3.0))):
        jacobian = _jacobians(mesh, mesh.elements[chosen], points)
        scaled = np.linalg.det(jacobian) / np.linalg.norm(jacobian, axis=2).prod(axis=2)
        quality[chosen] = scaled.min(axis=1, initial=1.0)
    return quality


def faces_of(elements: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Faces of elements, (n, 4), their elements, and numbers that are equal where two share a face.

    A triangle repeats its last corner. Sides of wedges that are collapsed to an edge are left out.
    """
    faces = elements[:, FACES].reshape(-1, 4)
    turned = faces.copy()
    for corner in range(4):
        same = faces[:, corner] == faces[:, (corner + 1) % 4]
        turned[same] = np.roll(faces[same], 2 - corner, axis=1)
    corners = np.sort(faces, axis=1)
    corners[:, 1:][np.diff(corners, axis=1) == 0] = -1  # Elements may repeat different corners of a triangle.
    real = (corners >= 0).sum(axis=1) >= 3
    _, number = np.unique(np.sort(corners[real], axis=1), axis=0, return_inverse=True)
    return turned[real], np.repeat(np.arange(len(elements)), len(FACES))[real], number.ravel()


def repeats_nodes(elements: IntArray) -> np.ndarray:
    """Whether each element or face names a node more than once, (n,)."""
    return (np.diff(np.sort(elements, axis=1), axis=1) == 0).any(axis=1)


def element_place(mesh: Mesh, element: int) -> str:
    """Name an element by its number, that of its file if it has one, its layer and its place."""
    layer = int(mesh.layer[element])
    name = LAYERS[layer] if 0 <= layer < len(LAYERS) else f"layer {layer}"
    number = element if mesh.numbers is None else mesh.numbers[element]
    return f"element {number} ({name}, about {place(mesh.nodes_mm[mesh.elements[element]].mean(axis=0))})"


def place(point_mm: FloatArray) -> str:
    x, y, z = point_mm
    return f"x = {x:.3g}, y = {y:.3g}, z = {z:.3g} mm"


def squeezed_most(mesh: Mesh, displacement_mm: FloatArray) -> tuple[int, float]:
    """Find the element with the smallest ratio of present to undeformed volume."""
    deformed = replace(mesh, nodes_mm=mesh.nodes_mm + displacement_mm)
    ratio = (jacobian_at_gauss(deformed) / jacobian_at_gauss(mesh)).min(axis=1)
    element = int(ratio.argmin())
    return element, float(ratio[element])


def near_plane(mesh: Mesh, z_mm: float = 0.0) -> np.ndarray:
    """Whether each node lies on a plane of equal z, within 1e-6 of the size of the mesh, (n_nodes,)."""
    return np.abs(mesh.nodes_mm[:, 2] - z_mm) <= 1e-6 * float(np.ptp(mesh.nodes_mm, axis=0).max())


def check_mesh(mesh: Mesh, n_materials: int = len(LAYERS)) -> None:
    _check_arrays(mesh)
    _check_elements(mesh, n_materials)
    _check_sets(mesh)
    _check_jacobians(mesh)
    _check_held(mesh)


def _refuse(bad: Any, name: str, must: str, first: Callable[[int], str]) -> None:
    """Refuse an array in which an entry is bad, with a word about the first that is."""
    if bad.any():
        raise InputError(name, must, remedy=first(int(bad.argmax())))


def _node_place(mesh: Mesh, node: int) -> str:
    return f"node {node} ({place(mesh.nodes_mm[node])})"


def _check_arrays(mesh: Mesh) -> None:
    nodes, elements = mesh.nodes_mm, mesh.elements
    for name, rows, columns, row in (
        ("nodes_mm", nodes, 3, "x, y and z per node"),
        ("elements", elements, 8, "8 nodes per element"),
    ):
        if rows.ndim != 2 or rows.shape[1] != columns or not len(rows):
            raise InputError(name, f"needs one row of {row}", f"shape {rows.shape}")
    if mesh.layer.shape != (len(elements),):
        raise InputError(
            "layer", "needs one entry per element", f"{mesh.layer.size} for {len(elements)} elements"
        )
    astray = ~np.isfinite(nodes).all(axis=1)
    _refuse(
        astray, "nodes_mm", "must hold finite numbers",
        lambda node: f"node {node} is at {nodes[node].tolist()}, one of {astray.sum()} such nodes",
    )  # fmt: skip


def _check_elements(mesh: Mesh, n_materials: int) -> None:
    """Check that nodes exist and are used, elements are bricks or wedges, and layers have a material."""
    n_nodes, elements = len(mesh.nodes_mm), mesh.elements
    _refuse(
        ((elements < 0) | (elements >= n_nodes)).any(axis=1),
        "elements", f"must refer to nodes 0 to {n_nodes - 1}",
        lambda element: f"element {element} has {elements[element].tolist()}",
    )  # fmt: skip
    _refuse(
        (mesh.layer < 0) | (mesh.layer >= n_materials),
        "layer", f"must be an index below {n_materials}, the number of materials",
        lambda element: f"{element_place(mesh, element)} has {mesh.layer[element]}",
    )  # fmt: skip
    _refuse(
        repeats_nodes(elements) & ~_is_wedge(elements),
        "elements", "may repeat nodes only as a wedge, a brick with one side collapsed to an edge",
        lambda element: f"{element_place(mesh, element)} has nodes {elements[element].tolist()}",
    )  # fmt: skip
    unused = ~np.isin(np.arange(n_nodes), elements)
    _refuse(
        unused, "nodes_mm", "must each belong to an element",
        lambda node: f"{_node_place(mesh, node)} does not, one of {unused.sum()} such nodes; leave them out",
    )  # fmt: skip


def _is_wedge(elements: IntArray) -> np.ndarray:
    """Whether each element (n, 8) has six nodes, two opposite edges of one side being collapsed."""
    wedge = np.zeros(len(elements), dtype=bool)
    for a, b, c, d in FACES:
        for pairs in (((a, b), (c, d)), ((b, c), (d, a))):
            wedge |= np.all([elements[:, one] == elements[:, other] for one, other in pairs], axis=0)
    n_different = 1 + (np.diff(np.sort(elements, axis=1), axis=1) != 0).sum(axis=1)
    return wedge & (n_different == 6)


def _check_sets(mesh: Mesh) -> None:
    """Check that sets are valid, that skin and supports exist, and the plane of symmetry of half a body."""
    n_nodes, n_elements = len(mesh.nodes_mm), len(mesh.elements)
    of_nodes = ("skin_grid", "bone_nodes", "nail_nodes", "symmetry_nodes", "midline_nodes")
    for name, last in (*((name, n_nodes) for name in of_nodes), ("living_epidermis", n_elements)):
        numbers = getattr(mesh, name).ravel()
        wrong = numbers[(numbers < 0) | (numbers >= last)]
        if wrong.size:
            raise InputError(name, f"must hold numbers from 0 to {last - 1}", str(wrong[0]))
    if not mesh.skin_grid.size:
        raise InputError(
            "skin_grid", "must name the nodes of the skin, where the indenter touches", remedy="it is empty"
        )
    if not mesh.fixed_nodes.size:
        raise InputError(
            "bone_nodes and nail_nodes are empty, so nothing holds the body: give the nodes that are fixed."
        )
    if mesh.full != (not mesh.symmetry_nodes.size):
        raise InputError(
            "symmetry_nodes",
            "must be given for half a body and only then",
            f"full={mesh.full} with {mesh.symmetry_nodes.size} of them",
        )
    if not mesh.full:
        _check_plane(mesh)


def _check_plane(mesh: Mesh) -> None:
    """Half a body lies at z >= 0, and its nodes at z = 0 are those of the plane of symmetry."""
    z = mesh.nodes_mm[:, 2]
    on_plane, listed = near_plane(mesh), np.isin(np.arange(z.size), mesh.symmetry_nodes)
    for bad, name, must in (
        (listed & ~on_plane, "symmetry_nodes", "must lie at z = 0"),
        (~on_plane & (z < 0.0), "nodes_mm", "of half a body must lie at z >= 0"),
        (on_plane & ~listed, "symmetry_nodes", "must hold every node at z = 0"),
    ):
        _refuse(bad, name, must, lambda node: f"{_node_place(mesh, node)} does not fit")


def _check_jacobians(mesh: Mesh) -> None:
    smallest = jacobian_at_gauss(mesh).min(axis=1)
    worst, count = int(smallest.argmin()), np.count_nonzero(smallest <= 0.0)
    if count:
        raise InputError(
            "elements",
            "must have a Jacobian above 0 at their Gauss points",
            remedy=f"{element_place(mesh, worst)} is turned inside out ({smallest[worst]:.3g} mm³), one of "
            f"{count} such elements; move its nodes or reverse their order",
        )


def _check_held(mesh: Mesh) -> None:
    """Check that fixed nodes and the plane of symmetry prevent every rigid motion of each part."""
    n_elements, n_nodes = len(mesh.elements), len(mesh.nodes_mm)
    rows = np.repeat(np.arange(n_elements), len(CORNERS))
    holds = coo_array((np.ones(rows.size, dtype=np.int32), (rows, mesh.elements.ravel())),
                      shape=(n_elements, n_nodes)).tocsr()  # fmt: skip
    holds.sum_duplicates()
    holds.data[:] = 1
    shared = (holds @ holds.T).tocoo()
    # Elements are joined by a face of a brick or a wedge, three nodes or more, not by an edge.
    part_of = groups(np.array(shared.coords)[:, shared.data >= 3], n_elements)
    motions = _rigid_motions(mesh.nodes_mm)
    held = np.zeros((n_nodes, 3), dtype=bool)
    held[mesh.symmetry_nodes, 2] = True
    held[mesh.fixed_nodes] = True
    for part in range(part_of.max() + 1):
        members = np.flatnonzero(part_of == part)
        nodes = np.unique(mesh.elements[members])
        rows_held = motions[nodes][held[nodes]]
        if np.linalg.matrix_rank(rows_held.T @ rows_held) == motions.shape[2]:
            continue
        which = f"{members.size} element(s) with {element_place(mesh, int(members[0]))}"
        if np.isin(nodes, mesh.fixed_nodes).any():
            raise InputError(
                f"A part of the body must be held in all directions: {which} can still move as a whole; "
                "fix three or more nodes that do not lie on one line."
            )
        raise InputError(
            f"Every part of the body must be joined face to face to bone or nail: {which} is not."
        )


def _rigid_motions(nodes_mm: FloatArray) -> FloatArray:
    """Three translations and three rotations of the nodes about their middle, (n_nodes, 3, 6)."""
    centred = nodes_mm - nodes_mm.mean(axis=0)
    turns = np.cross(np.eye(3)[:, None], centred / (np.ptp(nodes_mm, axis=0).max() or 1.0))
    shifts = np.broadcast_to(np.eye(3)[:, None], turns.shape)
    return np.concatenate([shifts, turns]).transpose(1, 2, 0)


def check_skin(mesh: Mesh, outside: IntArray) -> None:
    """Check that layers follow each other, that the skin is one sheet, and that half a finger says so."""
    _check_order(mesh)
    _check_sheet(mesh)
    _check_cut(mesh, outside)


def _check_order(mesh: Mesh) -> None:
    """Check that layers lie below each other."""
    depth = mesh.node_depth_mm[mesh.elements].mean(axis=1)
    present = np.unique(mesh.layer)
    usual = [float(np.median(depth[mesh.layer == number])) for number in present]
    for above, below, upper, lower in zip(present, present[1:], usual, usual[1:], strict=False):
        if upper >= lower:
            raise InputError(
                f"layers must lie below each other in the order {', '.join(LAYERS)}: {LAYERS[above]} lies "
                f"{upper:.3g} mm deep and {LAYERS[below]} {lower:.3g} mm."
            )


def _check_sheet(mesh: Mesh) -> None:
    """Check that the skin is one sheet that ends only at the cut, a support or a plane of symmetry."""
    faces, nodes = mesh.skin_faces, mesh.nodes_mm
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    pairs, counts = np.unique(np.sort(edges[edges[:, 0] != edges[:, 1]], axis=1), axis=0, return_counts=True)
    if counts.max() > 2:
        where = place(nodes[pairs[counts.argmax()]].mean(axis=0))
        raise InputError(f"the skin must be one sheet: more than two faces meet at {where}.")
    pieces = _pieces(pairs, mesh.skin_nodes, mesh)
    if len(pieces) > 1:
        first, second = (place(nodes[piece].mean(axis=0)) for piece in pieces[:2])
        raise InputError(
            f"set skin must be one piece: it has {len(pieces)}, about {first}, and about {second}."
        )
    held = np.union1d(mesh.fixed_nodes, mesh.symmetry_nodes)
    rim = pairs[counts == 1]
    rim = rim[~np.isin(rim, held).all(axis=1)]
    loops = _pieces(rim, np.unique(rim), mesh)
    # The cut is the rim at the proximal end.
    loops.sort(key=lambda loop: nodes[loop, 0].mean())
    if len(loops) > 1:
        raise InputError(
            f"the skin is open: its set has a hole of {loops[1].size} nodes about "
            f"{place(nodes[loops[1]].mean(axis=0))}."
        )


def _pieces(edges: IntArray, among: IntArray, mesh: Mesh) -> list[IntArray]:
    """Nodes that edges join, each piece an array."""
    part = groups(edges.T, len(mesh.nodes_mm))
    return [among[part[among] == number] for number in np.unique(part[among])]


def _check_cut(mesh: Mesh, outside: IntArray) -> None:
    """Check that a finger with a flat side has named its plane of symmetry; a block is flat on both sides."""
    if mesh.symmetry_nodes.size:
        return
    free = ~np.isin(outside, mesh.fixed_nodes).all(axis=1) & ~np.isin(outside, mesh.skin_nodes).all(axis=1)
    flat = []
    for side in (mesh.nodes_mm[:, 2].min(), mesh.nodes_mm[:, 2].max()):
        chosen = outside[free & near_plane(mesh, side)[outside].all(axis=1)]
        a, b, c, d = mesh.nodes_mm[chosen.T]
        area = 0.5 * np.linalg.norm(np.cross(c - a, d - b), axis=1).sum()
        if area > 0.05 * mesh.skin_area_mm2.sum():
            flat.append(side)
    if len(flat) == 1:
        raise InputError(
            f"the side at z = {flat[0]:.3g} mm is flat, so half a finger seems to be meant: give the set "
            "symmetry with its nodes, at z = 0."
        )
