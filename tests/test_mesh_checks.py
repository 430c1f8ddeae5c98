"""Unusable meshes are refused, each with its reason."""

import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from fingerpad import Fingertip, Grading, InputError
from fingerpad.geometry.mesh import CORNERS, block_mesh, finger_mesh
from fingerpad.geometry.mesh_checks import check_mesh

NONE = np.empty(0, dtype=np.int64)
COARSE = Grading(
    17.37, 1.2, 1.2, 0.6, 0.6, largest_mm=4.0, stratum_corneum=1, dermis=1, subcutis=2, living_epidermis=1
)


def block(symmetric=True):
    return block_mesh([0, 1, 2, 3], [0, 1, 2], [0, 1, 2], layers=[0, 1], symmetric=symmetric)


BLOCK = block()


def changed(array, index, value):
    copy = np.array(array)
    copy[index] = value
    return copy


def node_at(x, y, z):
    return int(np.flatnonzero((BLOCK.nodes_mm == [x, y, z]).all(axis=1))[0])


@pytest.mark.parametrize("full", [False, True])
def test_meshes_made_here_are_fit(full):
    check_mesh(block(symmetric=not full))
    check_mesh(finger_mesh(Fingertip(), replace(COARSE, full=full)))


def with_extra_block(offset, shared=()):
    """The block and a second one beside it; `shared` pairs (node of the second, node of the first)."""
    n_nodes = len(BLOCK.nodes_mm)
    elements = BLOCK.elements + n_nodes
    for own, other in shared:
        elements = np.where(elements == own + n_nodes, other, elements)
    nodes = np.vstack([BLOCK.nodes_mm, BLOCK.nodes_mm + offset])
    used = np.unique(np.vstack([BLOCK.elements, elements]))
    number = np.full(len(nodes), -1)
    number[used] = np.arange(used.size)
    sets = {"layer": np.tile(BLOCK.layer, 2), "symmetry_nodes": np.flatnonzero(nodes[used][:, 2] == 0.0)}
    elements = number[np.vstack([BLOCK.elements, elements])]
    return replace(BLOCK, nodes_mm=nodes[used], elements=elements, **sets)


FAR = np.array([10.0, 0.0, 0.0])
TWISTED = BLOCK.elements[:, [4, 5, 6, 7, 0, 1, 2, 3]]

UNFIT = {
    "nodes without z": ({"nodes_mm": BLOCK.nodes_mm[:, :2]},
        "nodes_mm needs one row of x, y and z per node: got shape (36, 2)."),
    "node nowhere": ({"nodes_mm": changed(BLOCK.nodes_mm, (5, 1), np.nan)},
        "nodes_mm must hold finite numbers: node 5 is at ["),
    "elements of four": ({"elements": BLOCK.elements[:, :4]},
        "elements needs one row of 8 nodes per element: got shape (12, 4)."),
    "too few layers": ({"layer": BLOCK.layer[:3]},
        "layer needs one entry per element: got 3 for 12 elements."),
    "node that does not exist": ({"elements": changed(BLOCK.elements, (7, 2), 99)},
        "elements must refer to nodes 0 to 35: element 7 has ["),
    "layer without material": ({"layer": changed(BLOCK.layer, 4, 3)},
        "layer must be an index below 2, the number of materials: element 4 (subcutis, about x = 1.5, "
        "y = 0.5, z = 0.5 mm) has 3."),
    "pyramid": ({"elements": changed(BLOCK.elements, (0, [5, 6, 7]), BLOCK.elements[0, 4])},
        "elements may repeat nodes only as a wedge, a brick with one side collapsed to an edge: element 0 "
        "(stratum corneum, about"),
    "node in no element": ({"nodes_mm": np.vstack([BLOCK.nodes_mm, [[7.0, 8.0, 9.0]]])},
        "nodes_mm must each belong to an element: node 36 (x = 7, y = 8, z = 9 mm) does not, one of 1 such"),
    "inside out": ({"elements": np.where(np.arange(12)[:, None] == 2, TWISTED, BLOCK.elements)},
        "elements must have a Jacobian above 0 at their Gauss points: element 2 (stratum corneum, about x = "
        "0.5, y = 0.5, z = 1.5 mm) is turned inside out (-0.125 mm³), one of 1 such elements; move its"),
    "no skin": ({"skin_grid": np.empty((0, 0), dtype=np.int64)},
        "skin_grid must name the nodes of the skin, where the indenter touches: it is empty."),
    "no bone": ({"bone_nodes": NONE},
        "bone_nodes and nail_nodes are empty, so nothing holds the body: give the nodes that are fixed."),
    "no plane of symmetry": ({"symmetry_nodes": NONE},
        "symmetry_nodes must be given for half a body and only then: got full=False with 0 of them."),
    "plane of symmetry of a whole body": ({"full": True},
        "symmetry_nodes must be given for half a body and only then: got full=True with 12 of them."),
    "node off the plane": ({"symmetry_nodes": np.append(BLOCK.symmetry_nodes, node_at(3, 0, 2))},
        f"symmetry_nodes must lie at z = 0: node {node_at(3, 0, 2)} (x = 3, y = 0, z = 2 mm) does not fit."),
    "node missing in the plane": (
        {"symmetry_nodes": BLOCK.symmetry_nodes[BLOCK.symmetry_nodes != node_at(2, 1, 0)]},
        f"symmetry_nodes must hold every node at z = 0: node {node_at(2, 1, 0)} (x = 2, y = 1, z = 0 mm)"),
    "half a body on the wrong side": ({"nodes_mm": BLOCK.nodes_mm * [1.0, 1.0, -1.0]},
        "nodes_mm of half a body must lie at z >= 0: node 3 (x = 0, y = 0,"),
    "held along a line": (
        {"bone_nodes": np.array([node_at(x, 2, 0) for x in range(4)]), "symmetry_nodes": NONE, "full": True},
        "A part of the body must be held in all directions: 12 element(s) with element 0 (stratum corneum, "
        "about x = 0.5, y = 0.5, z = 0.5 mm) can still move as a whole; fix three or more nodes",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("changes", "said"), UNFIT.values(), ids=UNFIT)
def test_unfit_mesh_is_refused_in_a_sentence_that_names_the_place(changes, said):
    with pytest.raises(InputError, match=re.escape(said)):
        check_mesh(replace(BLOCK, **changes), n_materials=2)


@pytest.mark.parametrize(
    "name", ["skin_grid", "bone_nodes", "nail_nodes", "symmetry_nodes", "midline_nodes", "living_epidermis"]
)
def test_sets_hold_numbers_in_range(name):
    last = len(BLOCK.elements if name == "living_epidermis" else BLOCK.nodes_mm) - 1
    for number in (-1, 36):
        numbers = np.full([1] * getattr(BLOCK, name).ndim, number)
        with pytest.raises(InputError, match=f"{name} must hold numbers from 0 to {last}: got {number}"):
            check_mesh(replace(BLOCK, **{name: numbers}))


def test_part_that_floats_or_hangs_by_an_edge_is_refused_unless_something_holds_it():
    floating = with_extra_block(FAR)
    with pytest.raises(InputError, match=r"bone or nail: 12 element\(s\) with element 12 \(.*\) is not"):
        check_mesh(floating)
    bone = np.flatnonzero(floating.nodes_mm[:, 1] == 2.0)
    check_mesh(replace(floating, bone_nodes=bone))
    beside = np.array([3.0, 0.0, 0.0])
    edge = [(node_at(0, y, 0), node_at(3, y, 0)) for y in (0, 1)]
    face = [(node_at(0, y, z), node_at(3, y, z)) for y, z in product((0, 1, 2), (0, 1, 2))]
    with pytest.raises(InputError, match="joined face to face to bone or nail"):
        check_mesh(with_extra_block(beside, edge))
    check_mesh(with_extra_block(beside, face))
    whole = {"symmetry_nodes": NONE, "full": True}
    corners = np.array([node_at(0, 2, 0), node_at(3, 2, 0), node_at(0, 2, 2)])
    check_mesh(replace(BLOCK, bone_nodes=corners, **whole))
    line = np.array([node_at(x, 2, 0) for x in (0, 3)])
    check_mesh(replace(BLOCK, bone_nodes=line))


def opposite_on_a_side(a, b, c, d):
    """Whether a-b and c-d are opposite edges of one of the cube's sides."""
    four = CORNERS[[a, b, c, d]]
    same_side = (np.ptp(four, axis=0) == 0).sum() == 1
    return same_side and not np.abs(np.cross(four[1] - four[0], four[3] - four[2])).any()


def test_wedges_may_collapse_any_side_to_an_edge_and_nothing_else():
    """One cube, every pair of its edges collapsed in turn: twelve of them make a wedge."""
    single = block_mesh([0, 1], [0, 1], [0, 1], layers=[0])
    edges = [(a, b) for a in range(8) for b in range(a) if np.abs(CORNERS[a] - CORNERS[b]).sum() == 2]
    fit = 0
    for first, (a, b) in enumerate(edges):
        for c, d in edges[:first]:
            if len({a, b, c, d}) < 4:
                continue
            elements, nodes = np.array(single.elements), np.array(single.nodes_mm)
            for gone, stays in ((a, b), (c, d)):
                elements[0, gone] = elements[0, stays]
            kept, numbers = np.unique(elements, return_inverse=True)
            sets = {"skin_grid": np.array([[0]]), "bone_nodes": np.arange(3), "midline_nodes": NONE}
            wedge = replace(single, nodes_mm=nodes[kept], elements=numbers.reshape(1, 8), **sets)
            if opposite_on_a_side(a, b, c, d):
                check_mesh(wedge)
                fit += 1
            else:
                with pytest.raises(InputError, match="only as a wedge"):
                    check_mesh(wedge)
    assert fit == 12
