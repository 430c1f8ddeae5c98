"""Whole presses: what stays fixed, limits in time, the same bits twice, and failure."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.geometry.indenters import FlatPunch, Line, Plate, Sphere
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.mesh_quality import jacobian_at_gauss
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics import linear
from fingerpad.mechanics import press as press_module
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.configuration import Body, Load
from fingerpad.mechanics.contact import Contact, place
from fingerpad.mechanics.linear import KeptFactor, LinearSolver, free_degrees_of_freedom
from fingerpad.mechanics.materials import Material, MaterialTable, Prony
from fingerpad.mechanics.newton import NewtonSettings, find_equilibrium
from fingerpad.mechanics.press import _Press, press
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.mechanics.viscoelastic import StepCoefficients

PRONY = Prony(shares=(0.2, 0.3), times_ms=(30.0, 400.0))
LAYERS = tuple(Material.neo_hooke(shear, 0.45) for shear in (40.0, 40.0, 20.0, 8.0))
RELAXING = tuple(layer.with_prony(PRONY) for layer in LAYERS)
BALL = Sphere(curvature_per_m=1000.0 / 2.0)
MOTION = RampAndHold(depth_mm=0.4, ramp_ms=50.0, hold_ms=500.0)
STEPS = PressSettings(ramp_steps=4, hold_steps=3)
TIGHT = NewtonSettings(residual_tolerance=1e-6, penetration_tolerance=2e-4)
"""For comparing presses by different ways: within its usual tolerance, penetration depends on the way."""


def block(symmetric=True):
    lines = np.array([0.0, 0.4, 0.8, 1.3, 2.0, 3.0])
    both = np.concatenate([-lines[:0:-1], lines])
    depth = np.array([0.0, 0.3, 0.6, 1.2, 2.0, 3.0])
    return block_mesh(both, depth, lines if symmetric else both, layers=[0, 1, 2, 3, 3], symmetric=symmetric)


def pressed(mesh, materials=LAYERS, indenter=BALL, motion=MOTION, settings=STEPS):
    placement = place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    return press(mesh, materials, indenter, placement, motion, settings)


def test_fixed_nodes_stay_and_the_plane_of_symmetry_stays_plane():
    mesh = block()
    done = pressed(mesh)
    assert not done.displacement_mm[:, mesh.fixed_nodes].any()
    assert not done.displacement_mm[:, mesh.symmetry_nodes, 2].any()
    assert done.displacement_mm[:, mesh.symmetry_nodes, 1].any()


def test_skin_under_a_wire_goes_down_with_it_and_does_not_slide():
    mesh = block()
    motion = RampAndHold(0.2, 50.0, 100.0)
    done = pressed(mesh, indenter=Line(), motion=motion)
    under = mesh.skin_nodes[mesh.nodes_mm[mesh.skin_nodes, 0] == 0.0]
    assert not done.displacement_mm[:, under, 0].any()
    deepest = done.displacement_mm[:, under, 1].max(axis=1)
    np.testing.assert_allclose(deepest, motion.prescribed_at(done.times_ms), rtol=0, atol=0.005 * 0.2)
    beside = mesh.skin_nodes[np.abs(mesh.nodes_mm[mesh.skin_nodes, 0] - 0.4) < 1e-9]
    assert done.displacement_mm[-1, beside, 0].any()


def test_penetration_is_within_its_tolerance_and_the_tip_lies_at_its_depth():
    for tolerance in (5e-3, 5e-4):
        settings = replace(STEPS, newton=NewtonSettings(penetration_tolerance=tolerance))
        mesh = block()
        done = pressed(mesh, settings=settings)
        assert done.penetration_mm <= tolerance * MOTION.depth_mm
        under_tip = mesh.skin_nodes[np.linalg.norm(mesh.nodes_mm[mesh.skin_nodes], axis=1).argmin()]
        depths = MOTION.prescribed_at(done.times_ms)
        np.testing.assert_allclose(
            done.displacement_mm[:, under_tip, 1], depths, rtol=0, atol=tolerance * MOTION.depth_mm
        )


def test_force_rises_in_the_ramp_and_relaxes_in_the_hold():
    done = pressed(block(), RELAXING)
    change = np.diff(done.force_mn)
    assert (change[: STEPS.ramp_steps] > 0).all()
    assert (change[STEPS.ramp_steps :] < 0).all()
    assert done.force_mn[0] == 0.0
    assert not done.sed_kpa[0].any()
    assert (done.sed_kpa >= 0).all()


def test_elastic_body_does_not_change_in_the_hold():
    done = pressed(block())
    np.testing.assert_allclose(done.force_mn[5:], done.force_mn[4], rtol=1e-4)
    np.testing.assert_allclose(
        done.sed_kpa[5:], done.sed_kpa[[4] * 3], rtol=0, atol=1e-4 * done.sed_kpa.max()
    )


def stiffer(factor):
    """The elastic layers with their shear modulus, not their bulk modulus, times a factor."""
    return tuple(replace(layer, law=replace(layer.law, c10=factor * layer.law.c10)) for layer in LAYERS)


def test_slow_press_ends_elastic_with_long_term_and_fast_ramp_with_instantaneous_moduli():
    steps = replace(STEPS, newton=TIGHT)
    slow = pressed(block(), RELAXING, motion=RampAndHold(0.4, 50.0, 1e6), settings=steps)
    long_term = pressed(block(), LAYERS, settings=steps)
    np.testing.assert_allclose(slow.force_mn[-1], long_term.force_mn[-1], rtol=2e-4)
    scale = 2e-4 * long_term.sed_kpa.max()
    np.testing.assert_allclose(slow.sed_kpa[-1], long_term.sed_kpa[-1], rtol=0, atol=scale)
    fast = pressed(block(), RELAXING, motion=RampAndHold(0.4, 1e-4, 1.0), settings=steps)
    instantaneous = pressed(block(), stiffer(1 / PRONY.long_term_share), settings=steps)
    np.testing.assert_allclose(fast.force_mn[4], instantaneous.force_mn[4], rtol=2e-4)
    scale = 2e-4 * instantaneous.sed_kpa.max()
    np.testing.assert_allclose(fast.sed_kpa[4], instantaneous.sed_kpa[4], rtol=0, atol=scale)


def test_same_press_twice_is_the_same_to_the_last_bit():
    one, other = pressed(block(), RELAXING), pressed(block(), RELAXING)
    for name in ("times_ms", "force_mn", "displacement_mm", "sed_kpa"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def coarse_block():
    """A small block, the living epidermis its second layer, for presses of many steps."""
    lines = np.array([0.0, 0.5, 1.1, 2.5])
    both = np.concatenate([-lines[:0:-1], lines])
    return block_mesh(both, [0.0, 0.3, 0.6, 1.3, 2.5], lines, layers=[0, 1, 2, 3], symmetric=True)


FINE = NewtonSettings(residual_tolerance=1e-6, penetration_tolerance=2e-4)


@pytest.fixture(scope="module")
def very_fine():
    """Times and SED of the epidermis in a relaxing block pressed in very many steps."""
    mesh = coarse_block()
    done = pressed(mesh, RELAXING, settings=PressSettings(60, 90, FINE))
    return done.times_ms, done.sed_kpa[:, mesh.living_epidermis.ravel()]


@pytest.mark.parametrize("tolerance", [0.04, 0.01])
def test_error_of_sed_in_time_is_within_its_tolerance(very_fine, tolerance):
    """At the steps and between them, in ramp and hold, of a body that relaxes."""
    fine_times, truth = very_fine
    mesh = coarse_block()
    done = pressed(mesh, RELAXING, settings=PressSettings(sed_tolerance=tolerance))
    sheet = done.sed_kpa[:, mesh.living_epidermis.ravel()].T
    found = np.array([np.interp(fine_times, done.times_ms, trace) for trace in sheet]).T
    error = np.abs(found - truth).max(axis=1) / truth.max()
    assert error.max() < tolerance
    assert error.max() > 0.02 * tolerance  # it is not met by needless steps
    assert MOTION.ramp_ms in done.times_ms
    assert done.times_ms[-1] == MOTION.end_ms


def test_looser_tolerance_takes_fewer_steps_and_the_same_ones_each_time():
    mesh = coarse_block()
    loose, tight, again = (
        pressed(mesh, RELAXING, settings=PressSettings(sed_tolerance=tolerance))
        for tolerance in (0.1, 0.02, 0.02)
    )
    assert loose.times_ms.size < tight.times_ms.size
    np.testing.assert_array_equal(tight.times_ms, again.times_ms)
    np.testing.assert_array_equal(tight.sed_kpa, again.sed_kpa)


@pytest.mark.parametrize("tolerance", [0.0, 1.0, -0.1, np.nan, "1 %"])
def test_tolerance_of_sed_is_a_small_positive_number(tolerance):
    with pytest.raises(InputError, match="sed_tolerance must be"):
        PressSettings(sed_tolerance=tolerance)


def test_adaptive_press_that_does_not_converge_is_an_error_with_its_history():
    settings = PressSettings(sed_tolerance=0.1, newton=NewtonSettings(most_iterations=1))
    with pytest.raises(
        ConvergenceError, match=r"The press stopped at 0 ms.* try a smaller depth or more ramp steps"
    ) as failure:
        pressed(coarse_block(), settings=settings)
    assert all(line.startswith("step from 0 to") for line in failure.value.history)


def test_moment_is_the_same_to_the_last_bit_after_a_step_from_it_failed(monkeypatch):
    """Every step that fails, or is too long, leaves what it started from untouched."""
    before, failed = {}, []

    def arrays(moment):
        found, history = moment.found, moment.history
        return (
            found.displacement_mm, found.multipliers_mn, found.contact.force_mn, moment.step_mm,
            history.instantaneous, history.relaxed, moment.sed_kpa,
        )  # fmt: skip

    step = press_module._Press.step

    def watched(job, start, target_ms):
        copies = before.setdefault(start.time_ms, [array.copy() for array in arrays(start)])
        for array, copy in zip(arrays(start), copies, strict=True):
            np.testing.assert_array_equal(array, copy)
        try:
            return step(job, start, target_ms)
        except ConvergenceError:
            failed.append(start.time_ms)
            raise

    monkeypatch.setattr(press_module._Press, "step", watched)
    whole = pressed(coarse_block(), RELAXING, settings=PressSettings(1, 1, TIGHT))
    assert not failed
    before.clear()
    too_few = replace(TIGHT, most_iterations=7)
    cut = pressed(coarse_block(), RELAXING, settings=PressSettings(1, 1, too_few))
    assert failed
    np.testing.assert_allclose(
        cut.force_mn, whole.force_mn, rtol=0.02
    )  # steps of other lengths relax otherwise


def test_press_with_multigrid_gives_the_answer_of_a_factor(monkeypatch):
    """As near to incompressible as multigrid reaches."""
    materials = tuple(Material.neo_hooke(shear, 0.499, PRONY) for shear in (40.0, 40.0, 20.0, 8.0))
    direct = pressed(block(), materials)
    assert direct.linear_solver.startswith("SuperLU's factor")
    monkeypatch.setattr(linear, "MULTIGRID_NODES", 10)
    iterative = pressed(block(), materials)
    assert iterative.linear_solver.startswith("geometric multigrid")
    np.testing.assert_allclose(iterative.force_mn, direct.force_mn, rtol=1e-4)
    scale = 1e-4 * direct.sed_kpa.max()
    np.testing.assert_allclose(iterative.sed_kpa, direct.sed_kpa, rtol=0, atol=scale)


def mean_pressures(mesh, displacement, poisson, shear):
    """Pressure K (Jbar - 1) of each element of one material. [kPa]"""
    deformed = jacobian_at_gauss(replace(mesh, nodes_mm=mesh.nodes_mm + displacement)).sum(axis=1)
    bulk = 2 * shear * (1 + poisson) / (3 * (1 - 2 * poisson))
    return bulk * (deformed / jacobian_at_gauss(mesh).sum(axis=1) - 1)


def alternation(pressure, shape):
    """Largest alternating part of a pressure in any 2 x 2 (x 2) elements, over the largest pressure.

    A checkerboard of one amplitude gives 1; a smooth field its mixed differences, which are small.
    """
    largest = 0.0
    for alternates in ((1, 1, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1)):
        field = pressure.reshape(shape)
        for axis, sign in enumerate(alternates):
            first, second = np.split(np.stack([field, np.roll(field, -1, axis)]), 2)
            field = np.delete((first - second if sign else first + second)[0] / 2, -1, axis)
        largest = max(largest, np.abs(field).max())
    return largest / np.abs(pressure).max()


def test_tissue_that_hardly_changes_its_volume_neither_locks_nor_shows_a_checkerboard():
    """K grows 500-fold from nu = 0.45, tenfold from 0.499; force and pressure stay, and are as smooth."""
    mesh, shear, done, pressure = block(), 20.0, {}, {}
    settings = PressSettings(4, 1, NewtonSettings(penetration_tolerance=5e-4))
    for poisson in (0.45, 0.499, 0.4999):
        done[poisson] = pressed(mesh, (Material.neo_hooke(shear, poisson),) * 4, settings=settings)
        pressure[poisson] = mean_pressures(mesh, done[poisson].displacement_mm[-1], poisson, shear)
    force = {poisson: press_.force_mn[-1] for poisson, press_ in done.items()}
    assert 1.0 < force[0.4999] / force[0.499] < 1.002
    scale = np.abs(pressure[0.499]).max()
    np.testing.assert_allclose(pressure[0.4999], pressure[0.499], rtol=0, atol=5e-3 * scale)
    assert alternation(pressure[0.4999], mesh.shape) < alternation(pressure[0.45], mesh.shape) < 0.07


def test_alternation_finds_a_checkerboard():
    i, j, k = np.meshgrid(*(np.arange(4.0),) * 3, indexing="ij")
    assert alternation(((-1.0) ** (i + j + k)).ravel(), (4, 4, 4)) == 1.0
    assert alternation(((-1.0) ** (j + k)).ravel(), (4, 4, 4)) == 1.0
    assert alternation((5.0 + i - 2.0 * j).ravel(), (4, 4, 4)) == 0.0


def test_step_that_fails_is_cut_and_the_answer_stays():
    """One Newton step too few for the whole ramp at once: parts of it are taken, and the times are kept."""
    whole = pressed(block(), settings=PressSettings(1, 1, TIGHT))
    too_few = replace(TIGHT, most_iterations=whole.newton_steps - 1)
    cut = pressed(block(), settings=PressSettings(1, 1, too_few))
    assert cut.newton_steps > whole.newton_steps
    np.testing.assert_array_equal(cut.times_ms, whole.times_ms)
    np.testing.assert_allclose(cut.force_mn, whole.force_mn, rtol=1e-4)


@pytest.mark.parametrize(
    ("indenter", "depth_mm", "settings"),
    [
        (BALL, 0.4, PressSettings(4, 3, NewtonSettings(most_iterations=1))),
        (Plate(), 2.9, PressSettings(2, 1, NewtonSettings(most_iterations=8))),
    ],
    ids=["too few iterations", "nearly through the block"],
)
def test_press_that_does_not_converge_is_an_error_with_its_history(indenter, depth_mm, settings):
    with pytest.raises(ConvergenceError, match=r"The press stopped at .*; try .*\.$") as failure:
        pressed(block(), indenter=indenter, motion=RampAndHold(depth_mm, 50.0, 100.0), settings=settings)
    assert len(failure.value.history) >= 6  # the whole step and its cuts down to 1/32
    assert all(line.startswith("step from") for line in failure.value.history)
    assert failure.value.history[-1].split(": ")[1].split(".")[0] in str(failure.value)  # the cause


def test_press_that_does_not_converge_is_one_error_of_one_line_without_a_chain():
    settings = PressSettings(4, 3, NewtonSettings(most_iterations=1))
    with pytest.raises(ConvergenceError) as failure:
        pressed(block(), indenter=BALL, motion=RampAndHold(0.4, 50.0, 100.0), settings=settings)
    assert "\n" not in str(failure.value)
    assert failure.value.__cause__ is None
    assert failure.value.__suppress_context__


@pytest.mark.parametrize(
    ("indenter", "friction", "is_sharp", "remedy"),
    [
        (FlatPunch(1.0, 0.1), 0.0, True, "an edge: try friction=0.5, a larger fillet or a smaller depth."),
        (FlatPunch(1.0, 0.1), 0.5, True, "; try a smaller depth or more ramp steps."),
        (BALL, 0.0, False, "; try a smaller depth or more ramp steps."),
        (Line(), 0.0, False, "try a thin Cylinder with friction=0.5, or a smaller depth."),
    ],
)
def test_the_remedy_depends_on_what_stopped_the_press(indenter, friction, is_sharp, remedy):
    mesh = block()
    job = SimpleNamespace(
        stimulus=RampAndHold(0.4), contact=SimpleNamespace(friction=friction, indenter=indenter),
        is_sharp=is_sharp, body=SimpleNamespace(mesh=mesh),
    )  # fmt: skip
    found = SimpleNamespace(displacement_mm=np.zeros_like(mesh.nodes_mm), depth_mm=0.2)
    error = _Press.stopped(job, SimpleNamespace(time_ms=10.0, found=found), (), "No equilibrium.")
    assert str(error).endswith(remedy)
    assert "The press stopped at 10 ms, depth 0.2 mm, on the way to 0.4 mm, where element" in str(error)


def test_hopeless_press_names_the_element_that_it_squeezes_most():
    settings = PressSettings(2, 1, NewtonSettings(most_iterations=8))
    with pytest.raises(ConvergenceError) as failure:
        pressed(block(), indenter=Plate(), motion=RampAndHold(2.9, 50.0, 100.0), settings=settings)
    assert re.search(
        r"The press stopped at .* ms, depth .* mm, on the way to 2.9 mm, where element \d+ "
        r"\(.+, about x = .*, y = .*, z = .* mm\) has \d+% of its volume at a point: .*; try a smaller depth",
        str(failure.value),
    )


@pytest.mark.parametrize(
    ("indenter", "deepest"),
    [(Plate(), "3"), (BALL, "3"), (FlatPunch(2.0, 0.3), "3")],
    ids=lambda value: type(value).__name__ if not isinstance(value, str) else value,
)
def test_depth_that_reaches_the_bone_is_refused_before_anything_is_solved(indenter, deepest):
    said = (
        f"depth_mm must stay below {deepest} mm, where the {type(indenter).__name__} meets the bone: got 3.1"
    )
    with pytest.raises(InputError, match=re.escape(said)):
        pressed(block(), indenter=indenter, motion=RampAndHold(3.1, 50.0, 100.0))


def test_bad_mesh_is_refused_before_anything_is_solved():
    mesh = replace(block(), bone_nodes=np.empty(0, dtype=np.int64))
    with pytest.raises(InputError, match="nothing holds the body"):
        pressed(mesh)
    with pytest.raises(InputError, match="layer must be an index below 2"):
        pressed(block(), materials=LAYERS[:2])


class Astray:
    """A linear solver that sends every free node through the body and out on the other side."""

    number_type = np.float64

    def solve(self, blocks, residual, relative_tolerance):
        return np.tile([0.0, 1e4, 0.0], residual.size // 3)


def test_body_turned_inside_out_is_never_an_equilibrium():
    """Far off there is no contact and the forces of a body inside out are not summed: nothing is balanced."""
    mesh = block_mesh([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], layers=[0])
    table, sparsity = MaterialTable.of(LAYERS), Sparsity.of(mesh.elements, 8)
    body = Body(mesh, table, sparsity, free_degrees_of_freedom(8, mesh.fixed_nodes, mesh.symmetry_nodes))
    placement = place(Plate(), mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    contact = Contact(Plate(), placement, mesh.skin_nodes, mesh.skin_area_mm2)
    load = Load(contact, 0.1, StepCoefficients.of(table, 1.0), np.zeros((1, 8, 6)))
    said = (
        r"line search .* turns element 0 \(stratum corneum, about x = 0.5, y = 0.5, z = 0.5 mm\) inside out"
    )
    with pytest.raises(ConvergenceError, match=said):
        find_equilibrium(body, load, Astray(), np.zeros((8, 3)), np.zeros(4), NewtonSettings())
    inverted = mesh.nodes_mm * [0.0, -3.0, 0.0] + np.array([0.0, 3.0, 0.0])
    with pytest.raises(ConvergenceError, match=r"starting guess turns element 0 \(.*\) inside out"):
        find_equilibrium(body, load, Astray(), inverted, np.zeros(4), NewtonSettings())
    solver = LinearSolver(KeptFactor(sparsity, body.free))
    found = find_equilibrium(body, load, solver, np.zeros((8, 3)), np.zeros(4), NewtonSettings())
    assert found.contact.penetration_mm <= 0.005 * 0.1
