"""An indenter that moves aside and turns while it presses: same place, same answer; mirror images; work."""

import numpy as np
import pytest

from fingerpad import (
    Bar,
    Cylinder,
    Fingertip,
    InputError,
    PressSettings,
    Sphere,
    Trajectory,
    stroke,
    touch_of,
)
from fingerpad.geometry.bodies import Line
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import Pose, RampAndHold
from fingerpad.mechanics.contact import PlacedIndenter, Placement, place, rotation_of
from fingerpad.mechanics.press import Specimen, press
from presses import ELASTIC, RELAXING
from refusals import refused

STEPS = PressSettings(4, 2)
PITCH_MM = 0.4


def block(half_length=2.4):
    """Both halves, with even lines along x and z within 2.4 mm."""
    along = np.arange(-half_length, half_length + 0.01, PITCH_MM)
    across = np.arange(-2.0, 2.01, PITCH_MM)
    return block_mesh(along, [0.0, 0.3, 0.6, 1.2, 2.0], across, layers=[0, 1, 2, 3])


def touching(indenter, mesh):
    return place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))


@pytest.mark.parametrize(
    ("indenter", "pose"),
    [
        (Sphere(curvature_per_m=500.0), Pose(x_mm=0.4, z_mm=-0.8)),
        (Cylinder(2.0), Pose(tilt_deg=20.0)),
        (Bar(1.6, 0.4), Pose(x_mm=0.4, tilt_deg=-10.0, spin_deg=30.0)),
    ],
    ids=["moved", "tilted", "all"],
)
def test_indenter_that_moves_and_turns_before_it_touches_presses_as_if_placed_there(indenter, pose):
    mesh = block()
    first = touching(indenter, mesh)
    # A turned body touches above the depth 0, which is counted from the first touch of the unturned one.
    times_ms, depth_mm = (0.0, *np.linspace(50.0, 100.0, 13)), (-0.6, *np.linspace(-0.6, 0.3, 13))
    way = {name: (0.0, *[getattr(pose, name)] * 13) for name in vars(pose)}
    motion = Trajectory(times_ms, depth_mm=depth_mm, **way)
    moved = press(Specimen(mesh, ELASTIC), PlacedIndenter(indenter, first, friction=0.3), motion, STEPS)
    rotation = rotation_of(pose.tilt_deg, pose.spin_deg)
    origin_mm = first.origin_mm + np.array([pose.x_mm, 0.0, pose.z_mm])
    there = Placement(origin_mm, rotation, np.array([0.0, 1.0, 0.0]))
    down = Trajectory(times_ms, depth_mm=depth_mm)
    placed = press(Specimen(mesh, ELASTIC), PlacedIndenter(indenter, there, friction=0.3), down, STEPS)
    assert placed.force_mn[-1] > 1.0
    np.testing.assert_allclose(moved.force_mn[-4:], placed.force_mn[-4:], rtol=1e-6)
    np.testing.assert_allclose(moved.sed_kpa[-1], placed.sed_kpa[-1], atol=1e-5 * placed.sed_kpa.max())


def sliding(way_mm, mu, materials=RELAXING, **aside):
    """Press, then slide the sphere along x at constant depth."""
    mesh, indenter = block(), Sphere(curvature_per_m=500.0)
    times_ms, x_mm = (0.0, 50.0, 100.0, 300.0), (0.0, 0.0, 0.0, way_mm)
    motion = Trajectory(times_ms, (0.0, 0.3, 0.3, 0.3), x_mm=x_mm, **aside)
    first = touching(indenter, mesh)
    return press(
        Specimen(mesh, materials), PlacedIndenter(indenter, first, friction=mu), motion, PressSettings(16, 2)
    )


@pytest.mark.parametrize("mu", [0.0, 0.8])
def test_sliding_is_resisted_by_friction_times_force_and_balances_its_energy(mu):
    done = sliding(1.2, mu, materials=ELASTIC)
    normal, aside = done.contact_force_mn[-1, 1], done.contact_force_mn[-1, 0]
    # The pressure of a sphere that slides is not symmetric, which adds to the force along x.
    assert aside == pytest.approx(mu * normal, abs=0.05 * normal)
    assert done.energy.relative_imbalance < 2e-3
    np.testing.assert_allclose(done.contact_force_mn, done.reaction_mn, atol=1e-4 * done.force_mn.max())
    slip = done.contact.slip_mm[-1]
    assert (slip.max() > 0.2) if mu else not slip.any()
    limit = mu * done.contact.pressure_kpa
    shear = np.linalg.norm(done.contact.shear_kpa, axis=2)
    assert (shear <= limit * (1.0 + 1e-3) + 1e-9).all()


def test_spin_of_a_sphere_meets_a_torque_within_its_limit():
    done = sliding(0.0, 0.3, spin_deg=(0.0, 0.0, 0.0, 40.0))
    work = done.energy.external_uj
    during = done.times_ms >= 100.0
    assert work[during][-1] > work[during][0]
    # The torque of pressure p within radius a is at most mu times the integral of p r, below mu F a.
    radius_mm = np.sqrt(done.contact.area_mm2[-1] / np.pi)
    assert work[during][-1] - work[during][0] < 0.3 * done.force_mn.max() * radius_mm * np.deg2rad(40.0)
    assert done.energy.relative_imbalance < 5e-3


def test_half_a_finger_and_a_wire_are_refused_what_they_cannot_do_and_bone_on_the_way_is_named():
    aside = Trajectory((0.0, 50.0, 100.0), (0.0, 0.5, 0.5), z_mm=(0.0, 0.0, 1.0))
    assert touch_of(Fingertip(), Sphere(), aside).grading.full
    half = touch_of(Fingertip(), Sphere(), RampAndHold(0.5)).grading
    with pytest.raises(InputError, match="z_mm = 1 mm of the motion needs a grading with full=True"):
        touch_of(Fingertip(), Sphere(), aside, grading=half)
    # A bar mirrors itself at 0 and at 90 degrees, and not between; skin under a ball is twisted by friction.
    for body in (Bar(1.7, 0.3), Sphere()):
        turned = stroke(0.5, spin_deg=90.0, speed_deg_per_s=90.0)
        assert touch_of(Fingertip(), body, turned).grading.full
        with pytest.raises(InputError, match="spin_deg of the motion needs a grading with full=True"):
            touch_of(Fingertip(), body, turned, grading=half)
    along = Trajectory((0.0, 50.0, 100.0), (0.0, 0.5, 0.5), x_mm=(0.0, 0.0, 1.0))
    with pytest.raises(InputError, match="Line may only be moved up and down"):
        touch_of(Fingertip(), Line(), along)
    covered = touch_of(Fingertip(), Sphere(), along).grading
    assert covered.centre_mm + covered.half_length_mm > half.centre_mm + half.half_length_mm + 0.4
    mesh = block()
    indenter = Bar(1.6, 0.4)
    deep = Trajectory((0.0, 50.0, 100.0), (0.0, 0.5, 1.9), tilt_deg=(0.0, 0.0, 30.0))
    with refused("depth_mm"):
        press(Specimen(mesh, ELASTIC), PlacedIndenter(indenter, touching(indenter, mesh)), deep, STEPS)


def test_force_slides_a_sphere_whose_first_touch_is_off_its_axis():
    """The node that touches first may lie in the sphere by round-off, which is no contact."""
    mesh = block()
    indenter = Sphere(curvature_per_m=500.0)
    placement = place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.array([0.15, 0.0, 0.07]), np.eye(3))
    inside = Placement(placement.origin_mm + np.array([0.0, 4e-16, 0.0]), placement.rotation)
    aside = {"x_mm": (0.0, 0.0, 0.8), "z_mm": (0.0, 0.0, -0.4)}
    motion = Trajectory((0.0, 50.0, 100.0), force_mn=(0.0, 10.0, 10.0), **aside)
    done = press(
        Specimen(mesh, RELAXING), PlacedIndenter(indenter, inside, friction=0.5), motion, PressSettings(4, 2)
    )
    np.testing.assert_allclose(done.force_mn[done.times_ms >= 50.0], 10.0, rtol=1e-4)
    aside = np.linalg.norm(done.contact_force_mn[-1, [0, 2]])
    assert 0.35 < aside / done.contact_force_mn[-1, 1] < 0.6


def test_a_ball_that_spins_under_constant_force_meets_the_torque_of_a_sliding_hertz_contact():
    """M = 3 pi / 16 mu F a, with a from the area of contact."""
    mesh, indenter, mu = block(), Sphere(curvature_per_m=250.0), 0.3
    motion = stroke(force_mn=40.0, spin_deg=60.0, speed_deg_per_s=600.0, hold_ms=0.0)
    first = touching(indenter, mesh)
    done = press(
        Specimen(mesh, ELASTIC), PlacedIndenter(indenter, first, friction=mu), motion, PressSettings(4, 2)
    )
    work_uj = np.diff(done.energy.external_uj)[-3:]
    torque = work_uj / np.deg2rad(np.diff(np.interp(done.times_ms, motion.times_ms, motion.spin_deg))[-3:])
    radius_mm = np.sqrt(done.contact.area_mm2[-1] / np.pi)
    np.testing.assert_allclose(done.force_mn[done.times_ms >= 50.0], 40.0, rtol=1e-4)
    assert torque == pytest.approx(3.0 * np.pi / 16.0 * mu * 40.0 * radius_mm, rel=0.03)
