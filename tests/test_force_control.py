"""Force control: the depth that is found agrees with depth control, and the skin creeps."""

import numpy as np
import pytest

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.geometry.bodies import Bar, Cylinder, Edge, FlatPunch, Gap, Line, Plate, Sphere
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold
from fingerpad.mechanics import press as press_module
from fingerpad.mechanics.linear import free_degrees_of_freedom
from fingerpad.mechanics.materials import Material, Prony
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.mechanics.tissues import named_tissues
from fingerpad.skin.indentation import Touch
from fingerpad.skin.store import Store, touch_key
from presses import ELASTIC, block, press_into
from refusals import refused

BALL = Sphere(curvature_per_m=500.0)
BODIES = [Line(), Cylinder(3.0), Bar(2.0, 0.3), BALL, FlatPunch(2.0, 0.3), Plate(), Edge(0.3), Gap(0.8, 4.0)]
TIGHT = NewtonSettings(residual_tolerance=1e-6, penetration_tolerance=2e-4)
STEPS = PressSettings(2, 1, TIGHT)


def pressed(mesh, stimulus, indenter=BALL, materials=ELASTIC, settings=STEPS, **limits):
    return press_into(mesh, materials, indenter, stimulus, settings, **limits)


@pytest.mark.parametrize("indenter", BODIES, ids=lambda body: type(body).__name__)
def test_force_that_a_depth_needs_gives_that_depth_back(indenter):
    """An elastic answer does not depend on the way there, so the whole field must come back."""
    by_depth = pressed(block(), RampAndHold(0.2, 50.0, 100.0), indenter)
    by_force = pressed(block(), ForceRampAndHold(by_depth.force_mn[-1], 50.0, 100.0), indenter)
    np.testing.assert_allclose(by_force.depth_mm[-2:], 0.2, rtol=1e-3)
    wanted = by_depth.force_mn[-1] * np.array([0.5, 1.0, 1.0])
    np.testing.assert_allclose(by_force.force_mn[1:], wanted, rtol=1e-5)
    scale = by_depth.sed_kpa.max()
    np.testing.assert_allclose(by_force.sed_kpa[-1], by_depth.sed_kpa[-1], rtol=0, atol=2e-3 * scale)
    assert by_force.force_imbalance <= 1e-4
    assert by_force.penetration_mm <= 2e-4 * 0.2 * (1 + 1e-3)


def test_force_is_that_on_the_whole_body_also_when_half_of_it_is_solved():
    motion = ForceRampAndHold(20.0, 50.0, 100.0)
    half, whole = pressed(block(), motion), pressed(block(symmetric=False), motion)
    np.testing.assert_allclose(half.depth_mm, whole.depth_mm, rtol=2e-4)
    np.testing.assert_allclose(half.force_mn[-1], 20.0, rtol=1e-5)
    np.testing.assert_allclose(whole.force_mn[-1], 20.0, rtol=1e-5)


def test_creep_in_uniaxial_strain_follows_the_closed_form(monkeypatch):
    """One element held at its sides: F / A = M e with M(t) = K + 4/3 G(t), from M_0 at once to M_e at last.

    The creep compliance is J(t) = 1/M_e - (1/M_e - 1/M_0) exp(-t / T), T = tau M_0 / M_e.
    """
    shear, bulk, share, tau = 10.0, 20.0, 0.5, 60.0
    material = Material.neo_hooke(shear, 2 / 7, Prony((share,), (tau,)))  # K = 2 G (1 + nu) / (3 (1 - 2 nu))
    column = block_mesh([0.0, 10.0], [0.0, 1.0], [0.0, 10.0], layers=[0])  # 100 mm²

    def only_up_and_down(*sets):
        free = free_degrees_of_freedom(*sets)
        return free[free % 3 == 1]

    monkeypatch.setattr(press_module, "free_degrees_of_freedom", only_up_and_down)
    ramp, hold, force_per_area = 50.0, 400.0, 0.02
    settings = PressSettings(20, 20, NewtonSettings(1e-7, 1e-5))
    motion = ForceRampAndHold(100.0 * force_per_area, ramp, hold)
    done = pressed(column, motion, Plate(), (material,) * 4, settings)
    at_once, in_the_end = bulk + 4 / 3 * shear / (1 - share), bulk + 4 / 3 * shear
    slow = tau * at_once / in_the_end

    def ramped(time):
        """Integral of J over the time since the ramp began."""
        return time / in_the_end - (1 / in_the_end - 1 / at_once) * slow * (1 - np.exp(-time / slow))

    since = np.maximum(done.times_ms - ramp, 0.0)
    strain = force_per_area / ramp * (ramped(done.times_ms) - ramped(since))
    np.testing.assert_allclose(done.depth_mm[1:], strain[1:], rtol=2e-3)
    assert done.depth_mm[-1] > 1.2 * done.depth_mm[20]


COARSE = Grading(
    17.37, 1.2, 1.2, 0.8, 0.8, largest_mm=6.0, stratum_corneum=1, living_epidermis=1, dermis=1, subcutis=1
)


def touch(stimulus):
    ball, tissues = Sphere(curvature_per_m=287.0), named_tissues("trial3")
    return Touch(Fingertip(), ball, stimulus, tissues, COARSE, PressSettings(2, 2))


def test_finger_creeps_under_a_constant_force_and_the_store_keeps_its_depth(tmp_path):
    pressing = touch(ForceRampAndHold(force_mn=60.0))
    skin = pressing.solve()
    np.testing.assert_allclose(skin.force_mn, [0.0, 30.0, 60.0, 60.0, 60.0], rtol=1e-5)
    assert (np.diff(skin.depth_mm) > 0).all()
    assert skin.force_imbalance <= 1e-4
    assert skin.penetration_mm <= 0.005 * skin.depth_mm[-1]
    store = Store(tmp_path)
    store.save(pressing, skin)
    np.testing.assert_array_equal(store.load(pressing).depth_mm, skin.depth_mm)
    others = (touch(ForceRampAndHold(61.0)), touch(RampAndHold()))
    assert len({touch_key(each) for each in (pressing, *others)}) == 3


def test_force_that_reaches_the_bone_is_refused_while_solving():
    for force_mn, steps in ((20.0, 4), (2000.0, 1)):  # in a whole step, and in one that was cut
        motion, settings = ForceRampAndHold(force_mn, 50.0, 100.0), PressSettings(steps, 1)
        with pytest.raises(InputError, match=r"deeper than 0.15 mm") as refusal:
            pressed(block(), motion, settings=settings, deepest_mm=0.15)
        assert f"of {force_mn:g} mN" in str(refusal.value)
    finger = touch(ForceRampAndHold(60.0))
    assert 1.5 < finger.deepest_mm < Fingertip().depth_available_mm(17.37, 0.0)


def test_force_beyond_the_limit_of_the_mesh_is_an_error_that_advises_less_force():
    with pytest.raises(ConvergenceError, match="try a smaller force") as failure:
        pressed(block(), ForceRampAndHold(1e5, 50.0, 100.0), settings=PressSettings(1, 1))
    assert len(failure.value.history) >= 6


@pytest.mark.parametrize("name", ["force_mn", "ramp_ms", "hold_ms"])
def test_impossible_forces_are_refused_in_one_sentence(name):
    for value in (0.0, -1.0, np.nan, np.inf, "1 N", True):
        with pytest.raises(InputError, match=name) as refusal:
            ForceRampAndHold(**({"force_mn": 1.0} | {name: value}))
        assert str(refusal.value).endswith(".")
    with refused("stimulus"):
        touch(60.0)
