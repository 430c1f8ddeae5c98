"""Checks of a mesh before a solution; each error names the node or element and its place.

Meshes from `block_mesh` and `finger_mesh` pass all checks; they are for meshes made or changed by hand.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.geometry.mesh import CORNERS, LAYERS, Mesh


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
    wedge = (np.diff(np.sort(mesh.elements, axis=1), axis=1) == 0).any(axis=1)
    quality = np.empty(len(mesh.elements))
    for chosen, points in ((~wedge, CORNERS), (wedge, CORNERS / np.sqrt(3.0))):
        jacobian = _jacobians(mesh, mesh.elements[chosen], points)
        scaled = np.linalg.det(jacobian) / np.linalg.norm(jacobian, axis=2).prod(axis=2)
        quality[chosen] = scaled.min(axis=1, initial=1.0)
    return quality


def element_place(mesh: Mesh, element: int) -> str:
    layer = int(mesh.layer[element])
    name = LAYERS[layer] if 0 <= layer < len(LAYERS) else f"layer {layer}"
    x, y, z = mesh.nodes_mm[mesh.elements[element]].mean(axis=0)
    return f"element {element} ({name}, about x = {x:.3g}, y = {y:.3g}, z = {z:.3g} mm)"


def squeezed_most(mesh: Mesh, displacement_mm: FloatArray) -> tuple[int, float]:
    """Find the element with the smallest ratio of present to undeformed volume."""
    deformed = replace(mesh, nodes_mm=mesh.nodes_mm + displacement_mm)
    ratio = (jacobian_at_gauss(deformed) / jacobian_at_gauss(mesh)).min(axis=1)
    element = int(ratio.argmin())
    return element, float(ratio[element])


def rigid_motions(nodes_mm: FloatArray) -> FloatArray:
    """Three translations and three rotations of the nodes about their middle."""
    centred = nodes_mm - nodes_mm.mean(axis=0)
    x, y, z = (centred / (np.ptp(nodes_mm, axis=0).max() or 1.0)).T
    zero, one = np.zeros_like(x), np.ones_like(x)
    translations = [(one, zero, zero), (zero, one, zero), (zero, zero, one)]
    rotations = [(-y, x, zero), (zero, -z, y), (z, zero, -x)]
    return np.stack([np.stack(motion, axis=1) for motion in translations + rotations], axis=2)


PLANE_TOLERANCE = 1e-6
"""Largest distance of a node of the plane of symmetry from z = 0, over the size of the mesh."""

JOINING_NODES = 3
"""Nodes that two elements must share to be joined: a face of a brick or a wedge, not an edge."""

_RIGID_MOTIONS = 6


def check_mesh(mesh: Mesh, n_materials: int = len(LAYERS)) -> None:
    _check_arrays(mesh)
    _check_elements(mesh, n_materials)
    _check_sets(mesh)
    _check_jacobians(mesh)
    _check_held(mesh)


def _node_place(mesh: Mesh, node: int) -> str:
    x, y, z = mesh.nodes_mm[node]
    return f"node {node} (x = {x:.3g}, y = {y:.3g}, z = {z:.3g} mm)"


def _check_arrays(mesh: Mesh) -> None:
    nodes, elements = mesh.nodes_mm, mesh.elements
    if nodes.ndim != 2 or nodes.shape[1] != 3 or not len(nodes):
        raise InputError("nodes_mm", "needs one row of x, y and z per node", f"shape {nodes.shape}")
    astray = np.flatnonzero(~np.isfinite(nodes).all(axis=1))
    if astray.size:
        raise InputError(
            "nodes_mm",
            "must hold finite numbers",
            remedy=f"node {astray[0]} is at {nodes[astray[0]].tolist()}, one of {astray.size} such nodes",
        )
    if elements.ndim != 2 or elements.shape[1] != len(CORNERS) or not len(elements):
        raise InputError("elements", "needs one row of 8 nodes per element", f"shape {elements.shape}")
    if mesh.layer.shape != (len(elements),):
        raise InputError(
            "layer", "needs one entry per element", f"{mesh.layer.size} for {len(elements)} elements"
        )


def _check_elements(mesh: Mesh, n_materials: int) -> None:
    """Check that nodes exist and are used, elements are bricks or wedges, and layers have a material."""
    n_nodes = len(mesh.nodes_mm)
    outside = np.flatnonzero(((mesh.elements < 0) | (mesh.elements >= n_nodes)).any(axis=1))
    if outside.size:
        raise InputError(
            "elements",
            f"must refer to nodes 0 to {n_nodes - 1}",
            remedy=f"element {outside[0]} has {mesh.elements[outside[0]].tolist()}",
        )
    without = np.flatnonzero((mesh.layer < 0) | (mesh.layer >= n_materials))
    if without.size:
        raise InputError(
            "layer",
            f"must be an index below {n_materials}, the number of materials",
            remedy=f"{element_place(mesh, without[0])} has {mesh.layer[without[0]]}",
        )
    repeated = np.flatnonzero((np.diff(np.sort(mesh.elements, axis=1), axis=1) == 0).any(axis=1))
    wrong = repeated[~_is_wedge(mesh.elements[repeated])]
    if wrong.size:
        raise InputError(
            "An element may repeat nodes only as a wedge, a brick with one side collapsed to an edge: "
            f"{element_place(mesh, wrong[0])} has nodes {mesh.elements[wrong[0]].tolist()}."
        )
    used = np.zeros(n_nodes, dtype=bool)
    used[mesh.elements] = True
    if not used.all():
        raise InputError(
            f"Every node must belong to an element: {_node_place(mesh, int(np.argmin(used)))} does not, "
            f"one of {np.count_nonzero(~used)} such nodes; leave them out."
        )


def _is_wedge(elements: IntArray) -> np.ndarray:
    """Whether each element (n, 8) has six nodes, two parallel edges of one side being collapsed."""
    edges = [(a, b) for a, b in combinations(range(8), 2) if np.abs(CORNERS[a] - CORNERS[b]).sum() == 2]
    wedge = np.zeros(len(elements), dtype=bool)
    for (a, b), (c, d) in combinations(edges, 2):
        parallel = np.abs(np.cross(CORNERS[b] - CORNERS[a], CORNERS[d] - CORNERS[c])).sum() == 0
        if parallel and min(np.abs(CORNERS[a] - CORNERS[other]).sum() for other in (c, d)) == 2:
            wedge |= (elements[:, a] == elements[:, b]) & (elements[:, c] == elements[:, d])
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
    tolerance_mm = PLANE_TOLERANCE * float(np.ptp(mesh.nodes_mm, axis=0).max())
    z = mesh.nodes_mm[:, 2]
    listed = np.zeros(len(z), dtype=bool)
    listed[mesh.symmetry_nodes] = True
    off = np.flatnonzero(listed & (np.abs(z) > tolerance_mm))
    if off.size:
        raise InputError(
            "symmetry_nodes", "must lie at z = 0", remedy=f"{_node_place(mesh, off[0])} does not"
        )
    beyond = np.flatnonzero(z < -tolerance_mm)
    if beyond.size:
        raise InputError(f"Half a body must lie at z >= 0: {_node_place(mesh, beyond[0])} does not.")
    missing = np.flatnonzero(~listed & (np.abs(z) <= tolerance_mm))
    if missing.size:
        raise InputError(
            "symmetry_nodes",
            "must hold every node at z = 0",
            remedy=f"{_node_place(mesh, missing[0])} is missing",
        )


def _check_jacobians(mesh: Mesh) -> None:
    smallest = jacobian_at_gauss(mesh).min(axis=1)
    inverted = np.flatnonzero(~(smallest > 0.0))
    if inverted.size:
        worst = int(inverted[smallest[inverted].argmin()])
        raise InputError(
            "The Jacobian of an element must be above 0 at its Gauss points: that of "
            f"{element_place(mesh, worst)} is {smallest[worst]:.3g} mm³, one of {inverted.size} such "
            "elements; move its nodes or reverse their order."
        )


def _check_held(mesh: Mesh) -> None:
    """Check that fixed nodes and the plane of symmetry prevent every rigid motion of each part."""
    n_elements, n_nodes = len(mesh.elements), len(mesh.nodes_mm)
    rows = np.repeat(np.arange(n_elements), len(CORNERS))
    incidence = coo_array(
        (np.ones(rows.size, dtype=np.int32), (rows, mesh.elements.ravel())), shape=(n_elements, n_nodes)
    ).tocsr()
    incidence.sum_duplicates()
    incidence.data[:] = 1
    shared = (incidence @ incidence.T).tocoo()
    joined = shared.data >= JOINING_NODES
    neighbours = coo_array(
        (np.ones(np.count_nonzero(joined), dtype=np.int8), (shared.row[joined], shared.col[joined])),
        shape=(n_elements, n_elements),
    )
    n_parts, part_of = connected_components(neighbours, directed=False)
    motions = rigid_motions(mesh.nodes_mm)
    held = np.zeros((n_nodes, 3), dtype=bool)
    held[mesh.symmetry_nodes, 2] = True
    held[mesh.fixed_nodes] = True
    for part in range(n_parts):
        members = np.flatnonzero(part_of == part)
        nodes = np.unique(mesh.elements[members])
        rows_held = motions[nodes][held[nodes]]
        if np.linalg.matrix_rank(rows_held.T @ rows_held) == _RIGID_MOTIONS:
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
