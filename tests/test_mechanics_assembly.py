"""The threaded sum over elements against a plain loop, and the same bits on any number of threads."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from fingerpad.core.threads import FEWEST_IN_CHUNK, MANY_CHUNKS, available_threads, compiled_threads
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import block_mesh, finger_mesh
from fingerpad.mechanics.assembly import Sparsity, assemble, coloured_chunks
from fingerpad.mechanics.element import N_COLUMNS, add_tangent, element_system
from fingerpad.mechanics.materials import Hyperfoam, Material, MaterialTable, Ogden, Polynomial

TABLE = MaterialTable.of([
    Material(Polynomial(c10=4.0, c01=1.5, c20=2.5, c11=0.7, c02=0.9, bulk_linear=130.0, bulk_cubic=400.0)),
    Material(Ogden(moduli_kpa=(3.0, 4.0, 5.0), exponents=(-2.0, 3.5, 1.5), bulk_kpa=260.0)),
    Material(Hyperfoam(moduli_kpa=(2.0, 3.0, 6.0), exponents=(-3.0, 7.0, 4.5), poisson=0.4)),
    Material.neo_hooke(shear_kpa=11.0, poisson=0.48),
])  # fmt: skip
S = np.array([0.9, 0.8, 0.95, 1.0])
needs_two_threads = pytest.mark.skipif(
    available_threads() < 2, reason="this machine has one core: nothing can run side by side"
)


@cache
def mesh(name):
    if name == "block":
        lines = np.linspace(0.0, 3.0, 11)
        return block_mesh(lines, lines[:5], lines, layers=[0, 1, 2, 3])
    return finger_mesh(Fingertip(), replace(resolution_grading("quick", 17.37), full=name == "full finger"))


MESHES = pytest.mark.parametrize("name", ["block", "half finger", "full finger"])


def assembled(name, displacement, history, precision=np.float64):
    """Potential, forces and blocks of a mesh."""
    body = mesh(name)
    sparsity = Sparsity.of(body.elements, len(body.nodes_mm))
    force = np.full_like(displacement, 7.0)
    blocks = np.full((sparsity.column.size, 3, 3), 7.0, dtype=precision)
    potential = assemble(
        body, displacement, TABLE.law, S, history, sparsity, True,
        force, blocks,
    )  # fmt: skip
    return potential, force, sparsity.matrix(blocks)


def state(name, seed=0):
    """Displacements that stretch a mesh evenly and crumple it a little, and a history."""
    rng = np.random.default_rng(seed)
    nodes = mesh(name).nodes_mm
    displacement = 0.05 * nodes @ rng.normal(size=(3, 3)) + 1e-4 * rng.normal(size=nodes.shape)
    return displacement, 0.1 * rng.normal(size=(len(mesh(name).elements), 8, 6))


def slow_sum(name, displacement, history):
    """Potential, forces and sparse tangent, one element after the other."""
    body, force, tangent = mesh(name), np.empty((8, 3)), np.empty((8, N_COLUMNS))
    potential, forces, entries = 0.0, np.zeros(displacement.size), []
    for e, nodes in enumerate(body.elements):
        law, s = TABLE.law[body.layer[e]], S[body.layer[e]]
        potential += element_system(
            body.nodes_mm[nodes], displacement[nodes], law, s, history[e], True, force, tangent
        )
        blocks = np.zeros((64, 3, 3))
        add_tangent(tangent, np.arange(64).reshape(8, 8), blocks)
        numbers = (3 * nodes[:, None] + np.arange(3)).ravel()
        np.add.at(forces, numbers, force.ravel())
        values = blocks.reshape(8, 8, 3, 3).transpose(0, 2, 1, 3).ravel()
        entries.append((values, np.repeat(numbers, 24), np.tile(numbers, 24)))
    values, rows, columns = (np.concatenate(parts) for parts in zip(*entries, strict=True))
    matrix = sparse.coo_matrix((values, (rows, columns)), shape=2 * (displacement.size,)).tocsr()
    return potential, forces.reshape(-1, 3), matrix


@pytest.mark.parametrize("name", ["block", "half finger"])
def test_sum_equals_that_of_a_plain_loop(name):
    found, wanted = assembled(name, *state(name)), slow_sum(name, *state(name))
    assert found[0] == pytest.approx(wanted[0], rel=1e-13)
    np.testing.assert_allclose(found[1], wanted[1], rtol=0, atol=1e-14 * np.abs(wanted[1]).max())
    assert abs(found[2] - wanted[2]).max() <= 1e-14 * abs(wanted[2]).max()


def test_single_precision_blocks_hold_the_same_tangent_and_an_element_inside_out_has_no_potential():
    double, single = (
        assembled("block", *state("block"), precision) for precision in (np.float64, np.float32)
    )
    assert single[2].dtype == np.float32
    assert single[0] == double[0]
    np.testing.assert_array_equal(single[1], double[1])
    assert abs(single[2] - double[2]).max() <= 1e-6 * abs(double[2]).max()
    displacement, history = state("block")
    displacement = displacement.copy()
    displacement[mesh("block").elements[150, 0]] += 50.0
    assert np.isnan(assembled("block", displacement, history)[0])


@needs_two_threads
@MESHES
def test_bits_do_not_depend_on_the_number_of_threads(name):
    where = state(name)
    with compiled_threads(1):
        alone = assembled(name, *where)
    for _ in range(3):
        with compiled_threads(2):
            together = assembled(name, *where)
        assert together[0] == alone[0]
        np.testing.assert_array_equal(together[1], alone[1])
        np.testing.assert_array_equal(together[2].data, alone[2].data)


def check_chunks(elements, n_nodes):
    """Every element is in one chunk, and chunks of one colour share no node."""
    colours = coloured_chunks(elements, n_nodes)
    order = np.concatenate([np.arange(*ends) for chunks in colours for ends in chunks])
    np.testing.assert_array_equal(np.sort(order), np.arange(len(elements)))
    for chunks in colours:
        nodes = np.concatenate([np.unique(elements[first:last]) for first, last in chunks])
        assert np.unique(nodes).size == nodes.size
    return colours


@MESHES
def test_chunks_of_one_colour_share_no_node(name):
    colours = check_chunks(mesh(name).elements, len(mesh(name).nodes_mm))
    assert 1 < sum(len(chunks) for chunks in colours) <= MANY_CHUNKS
    assert len(colours) <= 8  # few colours, so that every thread has its share of each


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 5 * FEWEST_IN_CHUNK), st.integers(8, 2000), st.integers(0, 100))
def test_chunks_of_any_mesh_share_no_node(n_elements, n_nodes, seed):
    """Elements of nodes drawn at random: even a mesh whose numbers say nothing is added up rightly."""
    elements = np.random.default_rng(seed).integers(0, n_nodes, size=(n_elements, 8))
    check_chunks(elements, n_nodes)
