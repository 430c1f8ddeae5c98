"""The kept factor against SciPy's direct solver, and systems without a solution."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.geometry.mesh import block_mesh
from fingerpad.mechanics import linear
from fingerpad.mechanics.assembly import Sparsity, assemble
from fingerpad.mechanics.linear import (
    KeptFactor,
    LinearSolver,
    NotPositiveDefiniteError,
    SmoothedAggregation,
    SuperLuFactor,
    choose_preconditioner,
    free_degrees_of_freedom,
)
from fingerpad.mechanics.materials import Material, MaterialTable
from fingerpad.mechanics.multigrid import Multigrid

BLOCK = block_mesh(np.arange(7.0), np.arange(5.0), np.arange(5.0), layers=[0, 1, 2, 3], symmetric=True)
SPARSITY = Sparsity.of(BLOCK.elements, len(BLOCK.nodes_mm))
FREE = free_degrees_of_freedom(len(BLOCK.nodes_mm), BLOCK.fixed_nodes, BLOCK.symmetry_nodes)


def tangent(shift=0.0, poisson=0.45, mesh=BLOCK, sparsity=SPARSITY):
    """Blocks of a layered block's tangent; `shift` is taken from every diagonal entry."""
    table = MaterialTable.of([Material.neo_hooke(shear, poisson) for shear in (40.0, 40.0, 20.0, 5.0)])
    nothing = np.zeros_like(mesh.nodes_mm)
    blocks, force = np.empty((sparsity.column.size, 3, 3)), np.empty_like(nothing)
    assemble(
        mesh, nothing, table.law, np.ones(4),
        np.zeros((len(mesh.elements), 8, 6)), sparsity, True, force, blocks,
    )  # fmt: skip
    blocks[sparsity.diagonal] -= shift * np.eye(3)
    return blocks


def direct(blocks, residual):
    matrix = SPARSITY.matrix(blocks).tocsc()[FREE][:, FREE]
    return spsolve(matrix, residual)


def residual_of(seed=0):
    return np.random.default_rng(seed).normal(size=FREE.size)


def test_pattern_holds_every_pair_of_an_element_once():
    pairs = {(a, b) for element in BLOCK.elements for a in element for b in element}
    rows = np.repeat(np.arange(len(BLOCK.nodes_mm)), np.diff(SPARSITY.row_start))
    assert list(zip(rows.tolist(), SPARSITY.column.tolist(), strict=True)) == sorted(pairs)
    np.testing.assert_array_equal(rows[SPARSITY.diagonal], SPARSITY.column[SPARSITY.diagonal])
    for element, position in zip(BLOCK.elements, SPARSITY.position, strict=True):
        np.testing.assert_array_equal(rows[position], np.repeat(element[:, None], 8, axis=1))
        np.testing.assert_array_equal(SPARSITY.column[position], np.repeat(element[None], 8, axis=0))


def test_free_degrees_of_freedom_by_hand():
    free = free_degrees_of_freedom(3, fixed_nodes=np.array([1]), symmetry_nodes=np.array([1, 2]))
    assert free.tolist() == [0, 1, 2, 6, 7]
    gripped = free_degrees_of_freedom(3, np.array([1]), np.array([1, 2]), gripped_nodes=np.array([0, 2]))
    assert gripped.tolist() == [1, 2, 7]


def test_factor_and_solver_solve_to_double_precision():
    blocks, residual = tangent(), residual_of()
    factor = SuperLuFactor(*SPARSITY.entries(FREE))
    factor.renew(blocks)
    exact = direct(blocks, residual)
    np.testing.assert_allclose(factor.solve(residual), exact, rtol=0, atol=1e-11 * np.abs(exact).max())
    solver = LinearSolver(KeptFactor(SPARSITY, FREE))
    solution = solver.solve(blocks, residual, relative_tolerance=1e-12)
    np.testing.assert_allclose(solution, exact, rtol=0, atol=1e-9 * np.abs(exact).max())


def test_factor_is_kept_while_it_serves_and_renewed_when_not():
    solver = LinearSolver(KeptFactor(SPARSITY, FREE))
    blocks = tangent()
    for scale in (1.0, 1.05, 0.95):
        solver.solve(scale * blocks, residual_of(), 1e-8)
    assert solver.renewals == 1
    other = blocks.copy()
    size = residual_of(1)[: len(BLOCK.nodes_mm), None, None] ** 2
    other[SPARSITY.diagonal] += np.diag([500.0, 0.0, 5.0]) * size
    exact = direct(other, residual_of(2))
    found = [solver.solve(other, residual_of(2), 1e-10) for _ in range(2)]
    assert solver.renewals == 2
    for solution in found:
        np.testing.assert_allclose(solution, exact, rtol=0, atol=1e-7 * np.abs(exact).max())


def test_indefinite_tangent_is_refused_at_once_and_under_a_kept_factor():
    everything = np.arange(3 * len(BLOCK.nodes_mm))
    fresh, kept = (LinearSolver(KeptFactor(SPARSITY, FREE)) for _ in range(2))
    kept.solve(tangent(), residual_of(), 1e-8)
    for solver in (fresh, kept):
        with pytest.raises(ConvergenceError):
            solver.solve(tangent(shift=60.0), residual_of(), 1e-8)
    # Nothing holds the body: no displacement balances a net force.
    with pytest.raises(ConvergenceError):
        LinearSolver(KeptFactor(SPARSITY, everything)).solve(tangent(), np.ones(everything.size), 1e-8)
    with pytest.raises(ConvergenceError, match="SuperLU could not factor"):
        KeptFactor(SPARSITY, FREE).renew(np.zeros_like(tangent()))


@pytest.mark.parametrize("stage", ["renew", "follow"])
def test_a_node_without_stiffness_of_its_own_is_an_indefinite_tangent(stage):
    """Multigrid inverts the block of every node, which may be exactly singular once it is rounded."""

    class Singular(KeptFactor):
        def renew(self, blocks):
            super().renew(blocks)
            if stage == "renew":
                raise ZeroDivisionError

        def follow(self, blocks):
            if stage == "follow" and blocks is not started:
                raise ZeroDivisionError
            super().follow(blocks)

    started = tangent()
    solver = LinearSolver(Singular(SPARSITY, FREE))
    if stage == "follow":
        solver.solve(started, residual_of(), 1e-8)
    with pytest.raises(NotPositiveDefiniteError, match="The tangent is not positive definite"):
        solver.solve(tangent(), residual_of(), 1e-8)


class Useless(KeptFactor):
    """A preconditioner that does nothing."""

    def renew(self, blocks):
        self.follow(blocks)

    def apply(self, residual):
        return residual


@pytest.mark.parametrize("wrong", [np.nan, 1e200])
def test_a_kept_factor_that_diverges_is_renewed_without_a_warning(wrong):
    class Diverges(KeptFactor):
        def apply(self, residual):
            return super().apply(residual) * (wrong if solver.renewals == 1 and solver.iterations else 1.0)

    blocks, residual = tangent(), residual_of()
    solver = LinearSolver(Diverges(SPARSITY, FREE))
    exact = solver.solve(blocks, residual, 1e-12)
    np.testing.assert_allclose(solver.solve(blocks, residual, 1e-12), exact, rtol=1e-9)
    assert solver.renewals == 2


def test_solution_that_is_not_reached_is_refused():
    """Stiffness over ten decades: plain conjugate gradients do not get through in their iterations."""
    blocks = tangent()
    blocks[SPARSITY.diagonal] += np.logspace(0, 10, len(BLOCK.nodes_mm))[:, None, None] * np.eye(3)
    solver = LinearSolver(Useless(SPARSITY, FREE))
    with pytest.raises(ConvergenceError, match="without converging"):
        solver.solve(blocks, residual_of(), 1e-8)
    assert solver.renewals == 1


def chosen(poisson):
    return choose_preconditioner(SPARSITY, FREE, BLOCK, poisson)


def test_factor_or_multigrid_is_chosen_by_size_depth_and_ratio(monkeypatch):
    preconditioner, reason = chosen(0.4999)
    assert isinstance(preconditioner, KeptFactor)
    assert reason == (
        "SuperLU's factor of the whole tangent: 175 nodes are within 20000, and Poisson's ratio 0.4999 is "
        "within 0.4999."
    )
    with pytest.raises(InputError, match=r"must not exceed 0.4999: got 0.49995; use 0.4999, where"):
        chosen(0.49995)
    monkeypatch.setattr(linear, "MULTIGRID_NODES", 100)
    monkeypatch.setattr(linear, "DIRECT_NODES", 100)
    preconditioner, reason = chosen(Material.neo_hooke(7.0, 0.499).poisson)
    assert isinstance(preconditioner, Multigrid)
    assert reason == (
        "geometric multigrid, levels: 1, the coarsest by SuperLU: 175 nodes are at least 100, and Poisson's "
        "ratio 0.499 is within 0.499."
    )
    said = r"must not exceed 0.499 for a mesh of more than 100 nodes: got 0.4995 and 175 nodes; use a smaller"
    with pytest.raises(InputError, match=said):
        chosen(0.4995)
    monkeypatch.setattr(linear, "DIRECT_NODES", 1000)
    monkeypatch.setattr(linear, "MOST_LANES", BLOCK.grid.shape[2] - 1)  # too deep for the kernels
    assert isinstance(chosen(0.48)[0], KeptFactor)


LARGE = block_mesh(
    np.arange(13.0), np.arange(9.0), np.arange(9.0), layers=[0, 0, 1, 1, 2, 2, 3, 3], symmetric=True
)


def test_large_mesh_without_rows_is_solved_by_algebraic_multigrid(monkeypatch):
    sparsity = Sparsity.of(LARGE.elements, len(LARGE.nodes_mm))
    free = free_degrees_of_freedom(len(LARGE.nodes_mm), LARGE.fixed_nodes, LARGE.symmetry_nodes)
    mesh = SimpleNamespace(nodes_mm=LARGE.nodes_mm, is_grid=False)
    monkeypatch.setattr(linear, "DIRECT_NODES", 1000)
    preconditioner, reason = choose_preconditioner(sparsity, free, mesh, 0.48)
    assert isinstance(preconditioner, SmoothedAggregation)
    assert reason == (
        "algebraic multigrid by smoothed aggregation (PyAMG): 1053 nodes without rows and columns are more "
        "than 1000, and Poisson's ratio 0.48 is within 0.499."
    )
    blocks = tangent(poisson=0.48, mesh=LARGE, sparsity=sparsity)
    residual = np.random.default_rng(0).normal(size=free.size)
    solver = LinearSolver(preconditioner)
    solution = solver.solve(blocks, residual, relative_tolerance=1e-10)
    back = sparsity.matrix(blocks).tocsr()[free][:, free] @ solution
    np.testing.assert_allclose(back, residual, rtol=0, atol=1e-8)
    assert solver.iterations < 50
    # A stiffer tangent is solved with the hierarchy of the first.
    halved = solver.solve(2.0 * blocks, residual, 1e-10)
    np.testing.assert_allclose(halved, 0.5 * solution, rtol=0, atol=1e-8 * np.abs(solution).max())
    assert solver.renewals == 1
    again = LinearSolver(SmoothedAggregation(sparsity, free, LARGE.nodes_mm))
    np.testing.assert_array_equal(again.solve(blocks, residual, 1e-10), solution)
    with pytest.raises(InputError, match=r"must not exceed 0.499 for a mesh of more than 1000 nodes"):
        choose_preconditioner(sparsity, free, mesh, 0.4995)
    monkeypatch.setitem(sys.modules, "pyamg", None)
    with pytest.raises(InputError, match=r"1,053 nodes needs PyAMG: pip install 'fingerpad\[meshes\]'"):
        choose_preconditioner(sparsity, free, mesh, 0.48)


def test_an_indefinite_matrix_is_refused_by_superlu():
    """Its factor solves it as well, but a Newton step along that solution may lead to no minimum."""
    places = np.indices((3, 3))
    factor = SuperLuFactor(*places)
    matrix = np.array([[4.0, 1.0, 0.0], [1.0, 3.0, 1.0], [0.0, 1.0, 2.0]])
    factor.renew(matrix)
    np.testing.assert_allclose(factor.solve(matrix @ [1.0, 2.0, 3.0]), [1.0, 2.0, 3.0], rtol=1e-12)
    crossed = np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    for indefinite in (matrix - 3.5 * np.eye(3), crossed):
        with pytest.raises(NotPositiveDefiniteError):
            factor.renew(indefinite)
