"""Whole presses: what stays fixed, limits in time, the same bits twice, and failure."""

import re
from dataclasses import replace

import numpy as np
import pytest

from fingerpad import ConvergenceError, FlatPunch, Plate, PressSettings, RampAndHold, Sphere
from fingerpad.geometry.bodies import Line
from fingerpad.geometry.mesh import block_mesh
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.configuration import Body, Load
from fingerpad.mechanics.contact import Contact, place
from fingerpad.mechanics.linear import KeptFactor, LinearSolver, free_degrees_of_freedom
from fingerpad.mechanics.materials import MaterialTable
from fingerpad.mechanics.newton import NewtonSettings, find_equilibrium
from fingerpad.mechanics.viscoelastic import StepCoefficients
from presses import ELASTIC, RELAXING, block, press_into
from refusals import refusals

BALL = Sphere(curvature_per_m=1000.0 / 2.0)
MOTION = RampAndHold(depth_mm=0.4, ramp_ms=50.0, hold_ms=500.0)
STEPS = PressSettings(ramp_steps=4, hold_steps=3)
TIGHT = NewtonSettings(residual_tolerance=1e-6, penetration_tolerance=2e-4)
"""For comparing presses by different ways: within its usual tolerance, penetration depends on the way."""


def pressed(mesh, materials=ELASTIC, indenter=BALL, motion=MOTION, settings=STEPS):
    return press_into(mesh, materials, indenter, motion, settings)


def test_fixed_nodes_stay_and_an_elastic_body_does_not_change_in_the_hold():
    mesh = block()
    done = pressed(mesh)
    assert not done.displacement_mm[:, mesh.fixed_nodes].any()
    assert not done.displacement_mm[:, mesh.symmetry_nodes, 2].any()
    assert done.displacement_mm[:, mesh.symmetry_nodes, 1].any()
    np.testing.assert_allclose(done.force_mn[5:], done.force_mn[4], rtol=1e-4)
    np.testing.assert_allclose(
        done.sed_kpa[5:], done.sed_kpa[[4] * 3], rtol=0, atol=1e-4 * done.sed_kpa.max()
    )


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


def test_force_rises_and_relaxes_and_the_same_press_twice_is_the_same_to_the_last_bit():
    done = pressed(block(), RELAXING)
    change = np.diff(done.force_mn)
    assert (change[: STEPS.ramp_steps] > 0).all()
    assert (change[STEPS.ramp_steps :] < 0).all()
    assert done.force_mn[0] == 0.0
    assert not done.sed_kpa[0].any()
    assert (done.sed_kpa >= 0).all()
    again = pressed(block(), RELAXING)
    for name in ("times_ms", "force_mn", "displacement_mm", "sed_kpa"):
        np.testing.assert_array_equal(getattr(again, name), getattr(done, name))


def coarse_block():
    """A small block, the living epidermis its second layer, for presses of many steps."""
    lines = np.array([0.0, 0.5, 1.1, 2.5])
    both = np.concatenate([-lines[:0:-1], lines])
    return block_mesh(both, [0.0, 0.3, 0.6, 1.3, 2.5], lines, layers=[0, 1, 2, 3], symmetric=True)


def test_error_of_sed_in_time_is_within_its_tolerance():
    """At the steps and between them, in ramp and hold, of a body that relaxes; the same steps each time."""
    mesh = coarse_block()
    fine = pressed(mesh, RELAXING, settings=PressSettings(60, 90, TIGHT))
    truth = fine.sed_kpa[:, mesh.living_epidermis.ravel()]
    found = {}
    for tolerance in (0.04, 0.01):
        done = pressed(mesh, RELAXING, settings=PressSettings(sed_tolerance=tolerance))
        sheet = done.sed_kpa[:, mesh.living_epidermis.ravel()].T
        between = np.array([np.interp(fine.times_ms, done.times_ms, trace) for trace in sheet]).T
        error = np.abs(between - truth).max(axis=1) / truth.max()
        assert 0.02 * tolerance < error.max() < tolerance  # it is not met by needless steps
        assert MOTION.ramp_ms in done.times_ms
        assert done.times_ms[-1] == MOTION.end_ms
        found[tolerance] = done
    assert found[0.04].times_ms.size < found[0.01].times_ms.size
    again = pressed(mesh, RELAXING, settings=PressSettings(sed_tolerance=0.04))
    np.testing.assert_array_equal(again.times_ms, found[0.04].times_ms)
    np.testing.assert_array_equal(again.sed_kpa, found[0.04].sed_kpa)


def test_adaptive_press_that_does_not_converge_is_an_error_with_its_history():
    settings = PressSettings(sed_tolerance=0.1, newton=NewtonSettings(most_iterations=1))
    with pytest.raises(
        ConvergenceError, match=r"The press stopped at 0 ms.* try a smaller depth or more ramp steps"
    ) as failure:
        pressed(coarse_block(), settings=settings)
    assert all(line.startswith("step from 0 to") for line in failure.value.history)


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
def test_press_that_does_not_converge_is_one_error_with_its_history_and_the_squeezed_element(
    indenter, depth_mm, settings
):
    with pytest.raises(ConvergenceError, match=r"The press stopped at .*; try .*\.$") as failure:
        pressed(block(), indenter=indenter, motion=RampAndHold(depth_mm, 50.0, 100.0), settings=settings)
    said, history = str(failure.value), failure.value.history
    assert len(history) >= 6  # the whole step and its cuts down to 1/32
    assert all(line.startswith("step from") for line in history)
    assert history[-1].split(": ")[1].split(".")[0] in said  # the cause
    assert "\n" not in said
    assert failure.value.__cause__ is None
    assert failure.value.__suppress_context__
    if indenter == Plate():
        assert re.search(
            r"The press stopped at .* ms, depth .* mm, on the way to 2.9 mm, where element \d+ "
            r"\(.+, about x = .* mm\) has \d+% of its volume at a point: .*; try a smaller depth",
            said,
        )


test_what_cannot_be_pressed_is_refused_before_anything_is_solved = refusals(
    *((lambda tolerance=tolerance: PressSettings(sed_tolerance=tolerance), "sed_tolerance must be")
      for tolerance in (0.0, 1.0, -0.1, np.nan, "1 %")),
    *((lambda body=body: pressed(block(), indenter=body, motion=RampAndHold(3.1, 50.0, 100.0)),
       f"depth_mm must stay below 3 mm, where the {type(body).__name__} meets the bone: got 3.1")
      for body in (Plate(), BALL, FlatPunch(2.0, 0.3))),
    (lambda: pressed(replace(block(), bone_nodes=np.empty(0, dtype=np.int64))), "nothing holds the body"),
    (lambda: pressed(block(), materials=ELASTIC[:2]), "layer must be an index below 2"),
)  # fmt: skip


class Astray:
    """A linear solver that sends every free node through the body and out on the other side."""

    number_type = np.float64

    def solve(self, blocks, residual, relative_tolerance):
        return np.tile([0.0, 1e4, 0.0], residual.size // 3)


def test_body_turned_inside_out_is_never_an_equilibrium():
    """Far off there is no contact and the forces of a body inside out are not summed: nothing is balanced."""
    mesh = block_mesh([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], layers=[0])
    table, sparsity = MaterialTable.of(ELASTIC), Sparsity.of(mesh.elements, 8)
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
