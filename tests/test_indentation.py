"""One touch from its arguments to the skin response: properties and refused arguments."""

from dataclasses import replace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.geometry.size_field import grading_below
from fingerpad.mechanics.assembly import Sparsity, assemble
from fingerpad.mechanics.contact import place
from fingerpad.mechanics.materials import MaterialTable
from fingerpad.skin.fields import FIELDS, Place, sampled_fields
from fingerpad.skin.indentation import Touch, settings_of
from refusals import refusals

FINGER, BALL = fp.Fingertip(), fp.Sphere(curvature_per_m=287)
NAMES = ["Sphere", "Cylinder", "Bar", "Line", "Plate"]
SHALLOW = fp.RampAndHold(depth_mm=0.05)
COARSE = fp.Grading(17.37, 1.2, 1.2, 0.6, 0.6, largest_mm=4.0, stratum_corneum=1, dermis=1, subcutis=2)


def coarse_touch(**changes):
    settings, motion = fp.PressSettings(ramp_steps=2, hold_steps=2), fp.RampAndHold(depth_mm=0.5)
    return replace(Touch(FINGER, BALL, motion, fp.named_tissues("trial3"), COARSE, settings), **changes)


@pytest.fixture(scope="module")
def skin():
    return coarse_touch().solve()


def test_skin_moves_with_the_indenter_and_only_there(skin):
    profile = skin.surface_profile()
    mesh = skin.mesh
    placement = place(BALL, mesh.nodes_mm[mesh.skin_nodes], FINGER.skin_point(17.37, 0.0), np.eye(3))
    on_axis = np.abs(profile.distance_mm).argmin()
    tip_mm = placement.origin_mm[1] + 0.5 - mesh.nodes_mm[mesh.midline_nodes[on_axis], 1]
    np.testing.assert_allclose(profile.distance_mm[on_axis], 0.0, atol=1e-9)
    np.testing.assert_allclose(profile.deflection_mm[on_axis], tip_mm, rtol=0, atol=0.005 * 0.5)
    assert 0.45 < tip_mm < 0.5  # the pad is inclined: the ball touches first beside its axis
    assert abs(profile.at(10.0)) < 0.1 * 0.5
    assert not skin.surface_profile(0).deflection_mm.any()


def test_all_that_is_known_of_a_touch_agrees_with_what_the_skin_keeps(skin):
    touch = coarse_touch()
    both, sheet = touch.solve(whole=True), touch.mesh.living_epidermis.ravel()
    done = both.deformation
    assert skin.deformation is None
    for name, values in skin.fields.items():
        np.testing.assert_array_equal(both.fields[name], values, err_msg=name)
    assert done.fields.elements.tolist() == list(range(len(touch.mesh.elements)))
    np.testing.assert_array_equal(done.sed_kpa, skin.sed_kpa)
    np.testing.assert_array_equal(done.fields.von_mises_kpa[-1], skin.von_mises_kpa)
    pressed = done.fields.compressive_stress_kpa[-1]
    np.testing.assert_array_equal(pressed, skin.fields["compressive_stress_kpa"])
    kept = {name: field for name, field in FIELDS.items() if field.place is Place.WATCHED and field.sampled}
    assert set(kept) == set(sampled_fields()) - {"stored"}
    for name, field in kept.items():
        np.testing.assert_array_equal(field.of(done, touch.mesh)[:, sheet], skin.fields[name])
    np.testing.assert_array_equal(skin.contact_area_mm2, done.contact.area_mm2)
    np.testing.assert_array_equal(skin.contact_pressure_kpa, done.contact.pressure_kpa)
    np.testing.assert_array_equal(skin.reaction_mn, done.reaction_mn)
    np.testing.assert_array_equal(skin.fields["external_uj"], done.energy.external_uj)
    assert skin.energy_imbalance == done.energy.relative_imbalance > 0.0
    # What presses on the skin is the force, all of it below the ball and along its radius.
    area = np.array([touch.mesh.skin_area_of(touch.mesh.nodes_mm + moved) for moved in done.displacement_mm])
    pressing = 2 * (done.contact.pressure_kpa * area).sum(axis=1)
    assert (pressing >= done.force_mn).all()
    np.testing.assert_allclose(pressing, done.force_mn, rtol=0.1)
    assert (np.diff(done.contact.area_mm2[:3]) > 0.0).all()


def test_the_nail_takes_its_share_of_the_reaction():
    """Internal forces of an elastic finger at the nodes of the nail, assembled anew."""
    elastic = fp.Tissues(*(fp.Material.neo_hooke(shear, 0.48) for shear in (30.0, 30.0, 20.0, 8.0)))
    touch = coarse_touch(tissues=elastic)
    mesh, done, table = touch.mesh, touch.solve(whole=True).deformation, MaterialTable.of(elastic.layers)
    sparsity = Sparsity.of(mesh.elements, len(mesh.nodes_mm))
    force, blocks = np.empty_like(mesh.nodes_mm), np.empty((sparsity.column.size, 3, 3))
    assemble(
        mesh, done.displacement_mm[-1], table.law, np.ones(4),
        np.zeros((len(mesh.elements), 8, 6)), sparsity, False, force, blocks,
    )  # fmt: skip
    expected = [-2.0, -2.0, 0.0] * force[mesh.nail_nodes].sum(axis=0)  # both halves, whose z cancels
    np.testing.assert_allclose(done.nail_reaction_mn[-1], expected, rtol=1e-9, atol=1e-12)
    assert 0.0 < done.nail_reaction_mn[-1, 1] < 0.1 * done.reaction_mn[-1, 1]
    assert not done.nail_reaction_mn[0].any()


def test_quantities_that_may_drive_an_afferent_peak_below_the_indenter(skin):
    x = np.linspace(12.0, 23.0, 45)
    for name in sampled_fields():
        course = skin.sample(name, np.column_stack([x, np.zeros(45)]))
        assert course.shape == (skin.times_ms.size, 45)
        assert abs(x[course[2].argmax()] - 17.37) < 1.5
    energy = skin.sed(np.column_stack([x, np.zeros(45)])).values
    assert abs(x[energy[2].argmax()] - 17.37) < 1.0
    assert energy[2].max() > 10 * energy[2, [0, -1]].max()


def test_a_touch_is_that_which_its_arguments_describe():
    """The named resolution and tissues, spelt out."""
    described = fp.touch_of(FINGER, BALL, SHALLOW, tissues="trial1", resolution="quick", at_mm=(16.0, 0.0))
    tissues, grading = fp.named_tissues("trial1"), grading_below(FINGER, BALL, "quick", (16.0, 0.0), SHALLOW)
    touch = Touch(FINGER, BALL, SHALLOW, tissues, grading, settings_of("quick"), at_mm=(16.0, 0.0))
    assert described == touch
    softer = coarse_touch(stimulus=SHALLOW).solve()  # stiffer tissues need more force
    assert coarse_touch(stimulus=SHALLOW, tissues=tissues).solve().force_mn[-1] > 1.1 * softer.force_mn[-1]


def test_touches_are_values_and_settings_of_your_own_replace_those_of_the_resolution():
    adaptive = fp.PressSettings(sed_tolerance=0.1)
    assert fp.touch_of(FINGER, BALL, settings=adaptive).settings == adaptive
    assert fp.touch_of(FINGER, BALL, resolution="standard").settings == settings_of("standard")
    assert coarse_touch(at_mm=[17.37, 0]) == coarse_touch()
    assert hash(coarse_touch()) == hash(coarse_touch())
    assert coarse_touch(indenter=fp.Cylinder()) != coarse_touch()


test_unusable_arguments_are_refused = refusals(
    ({"tissues": "steel"}, "gerling2014_fit: got 'steel'"),
    ({"tissues": None}, ("tissues",)),
    ({"resolution": "fine"}, ("resolution",)),
    ({"stimulus": fp.RampAndHold(depth_mm=6.0)}, ("depth_mm",)),
    ({"at_mm": (np.nan, 0.0)}, ("at_mm", 0)),
    ({"at_mm": 17.37}, ("at_mm",)),
    ({"at_mm": (50.0, 0.0)}, "x = 50"),
    ({"at_mm": (17.37, 12.0)}, "z = 12"),
    ({"at_mm": (-1.0, 0.0)}, "x = -1"),
    call=lambda changes: fp.indent(**{"finger": FINGER, "indenter": BALL, "stimulus": SHALLOW} | changes),
)


test_half_a_finger_is_touched_on_its_midline_within_a_limit_of_tilt = refusals(
    ({"at_mm": (17.37, 1.0)}, "full=True"),
    ({"tilt_deg": 50.0}, "tilt_deg"),
    ({"tilt_deg": np.nan}, "tilt_deg"),
    call=lambda changes: coarse_touch(**changes),
)  # fmt: skip


def test_tilted_indenter_presses_along_its_axis_and_meets_its_point():
    """A tilt by the slope of the skin puts a ball's first touch on its axis."""
    skin_slope = np.diff(FINGER.skin_point([17.36, 17.38], 0.0)[:, 1])[0] / 0.02
    touch = coarse_touch(tilt_deg=np.rad2deg(np.arctan(skin_slope)))
    skin = touch.solve()
    np.testing.assert_allclose(np.linalg.norm(skin.direction), 1.0, rtol=1e-14)
    inward = np.array([-skin_slope, 1.0, 0.0]) / np.hypot(skin_slope, 1.0)
    np.testing.assert_allclose(skin.direction, inward, rtol=1e-12)
    profile = skin.surface_profile()
    np.testing.assert_allclose(profile.deflection_mm.max(), 0.5, rtol=0, atol=0.005)


def test_force_of_a_grating_is_that_of_a_mesh_that_is_fine_everywhere():
    """It first touches where the pad is highest; ridges passed between coarse nodes, with 43 % less force."""
    few_steps = fp.PressSettings(ramp_steps=3, hold_steps=1)
    motion = fp.RampAndHold(depth_mm=0.3, ramp_ms=50, hold_ms=1)
    touch = fp.touch_of(FINGER, fp.Grating(1.5, 1.5), motion, at_mm=(25.0, 0.0), settings=few_steps)
    everywhere = replace(touch, grading=replace(touch.grading, centre_mm=15.0, half_length_mm=14.0))
    force_mn = touch.solve().force_mn.max()
    assert force_mn == pytest.approx(everywhere.solve().force_mn.max(), rel=0.01)
