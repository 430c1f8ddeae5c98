"""Fingers of other sizes: measures, presets, similarity, and what follows the finger."""

from dataclasses import replace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.experiments.conditions import Conditions
from fingerpad.geometry.bodies import Sphere
from fingerpad.geometry.fingertip import FINGERS, Fingertip
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh_checks import check_mesh, scaled_jacobian
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.laws import Energy, Hencky, Hyperfoam, Ogden, Polynomial
from fingerpad.mechanics.materials import Material, Prony
from fingerpad.mechanics.tissues import named_tissues
from fingerpad.skin.indentation import touch_of
from fingerpad.skin.unrolled_skin import PAD_X_MM, UnrolledSkin
from refusals import refusals

PAPER = Fingertip()
CHILD = Fingertip.of("child")


def test_the_paper_s_finger_is_unchanged():
    assert Fingertip.of() == Fingertip.of("adult") == PAPER.scaled(1.0) == PAPER
    assert PAPER.contact_mm == (17.37, 0.0)
    assert PAPER.relative_size == 1.0
    touch = touch_of(PAPER, Sphere(curvature_per_m=287.0))
    assert touch.at_mm == (17.37, 0.0)
    assert (touch.grading.size_x_mm, touch.grading.largest_mm) == (0.45, 3.0)
    skin = UnrolledSkin()
    assert skin.origin_x_mm == 17.37
    assert skin.pad() == skin.pad(PAD_X_MM)
    assert Conditions().receptor_x_mm == 17.37


def test_measures_are_those_that_were_asked_for():
    finger = Fingertip.of(length_mm=22.0, width_mm=16.0, height_mm=13.0, dermis_mm=0.9)
    assert finger.measures_mm == pytest.approx((22.0, 16.0, 13.0))
    assert (finger.dermis_mm, finger.stratum_corneum_mm) == (0.9, PAPER.stratum_corneum_mm)
    assert finger.bone_width_mm / PAPER.bone_width_mm == pytest.approx(16.0 / PAPER.measures_mm[1])
    assert finger.bone_height_mm / PAPER.bone_height_mm == pytest.approx(13.0 / PAPER.measures_mm[2])
    assert finger.nail_x_mm[1] / PAPER.nail_x_mm[1] == pytest.approx(22.0 / 25.0)
    partly = Fingertip.of(length_mm=20.0, width_mm=PAPER.measures_mm[1])
    assert partly.measures_mm[2] / PAPER.measures_mm[2] == pytest.approx(0.8**0.5)


@pytest.mark.parametrize("name", FINGERS)
def test_every_preset_makes_a_sound_mesh(name):
    finger = Fingertip.of(name)
    touch = touch_of(finger, Sphere(curvature_per_m=287.0), RampAndHold(depth_mm=0.3))
    check_mesh(touch.mesh)
    assert scaled_jacobian(touch.mesh).min() > 0.3
    assert touch.at_mm == finger.contact_mm
    assert touch.grading.size_x_mm == pytest.approx(0.45 * min(finger.relative_size, 1.0))


def test_presets_have_the_sizes_of_their_sources():
    widths = {name: Fingertip.of(name).measures_mm[1] for name in FINGERS}
    assert widths == pytest.approx(
        {"adult": 19.83, "small": 16.0, "large": 22.0, "child": 15.0, "macaque": 9.0, "aged": 19.83}, abs=0.01
    )
    assert CHILD.layer_depths_mm == PAPER.layer_depths_mm
    assert Fingertip.of("macaque").dermis_mm / PAPER.dermis_mm == pytest.approx(9.0 / 19.8314, rel=1e-4)
    aged = Fingertip.of("aged")
    assert aged.volar_readings_mm == PAPER.volar_readings_mm
    assert aged.living_epidermis_mm == pytest.approx(0.1 * (1 - 4 * 0.0645))
    assert aged.dermis_mm == pytest.approx(1.153 * 0.76)


def test_force_grows_with_the_square_of_the_size():
    """k times the lengths, k² times the force, the same energy density, but for microns of penetration."""
    grading = replace(resolution_grading("quick", 17.37, 2.0, 2.0), size_x_mm=0.8, size_z_mm=0.8)
    factor = 0.6
    sizes = ("centre_mm", "half_length_mm", "half_width_mm", "size_x_mm", "size_z_mm", "largest_mm")
    smaller = replace(grading, **{name: factor * getattr(grading, name) for name in sizes})
    ball, motion = Sphere(radius_mm=4.0), RampAndHold(depth_mm=0.5, hold_ms=50)
    small_ball, small_motion = Sphere(radius_mm=4.0 * factor), RampAndHold(depth_mm=0.5 * factor, hold_ms=50)
    here = touch_of(PAPER, ball, motion, grading=grading)
    there = touch_of(PAPER.scaled(factor), small_ball, small_motion, grading=smaller)
    large, small = here.solve(), there.solve()
    np.testing.assert_allclose(small.force_mn, factor**2 * large.force_mn, rtol=2e-3, atol=1e-9)
    density = small.sed([there.at_mm]).values
    np.testing.assert_allclose(density, large.sed([here.at_mm]).values, rtol=5e-3, atol=1e-6)


def test_place_population_and_pad_follow_the_finger():
    x = CHILD.contact_mm[0]
    assert x == pytest.approx(17.37 * CHILD.length_mm / PAPER.length_mm)
    population = fp.Population.grid(finger=CHILD)
    assert population.positions_mm.mean(axis=0) == pytest.approx([x, 0.0])
    aside = fp.Population.grid(centre_mm=(5.0, 1.0), finger=CHILD)
    assert aside.positions_mm.mean(axis=0) == pytest.approx([5.0, 1.0])
    half = PAPER.scaled(0.5)
    assert UnrolledSkin(half).origin_x_mm == pytest.approx(0.5 * 17.37)
    assert UnrolledSkin(half).pad().area_mm2 == pytest.approx(0.25 * UnrolledSkin().pad().area_mm2, rel=1e-6)
    conditions = Conditions("quick", finger=CHILD)
    assert conditions.sphere_touch(287.0).at_mm == (x, 0.0)
    assert conditions.bar_grading().centre_mm == conditions.sphere_grading().centre_mm == x


def test_a_description_takes_a_preset_measures_or_an_outline():
    ball = {"object": "sphere"}
    assert fp.TouchRequest.read(ball | {"finger": "child"}).touch.finger == CHILD
    child = fp.TouchRequest.read(ball | {"finger": "child:dermis_mm=1"})
    assert child.pressed_finger == Fingertip.of("child", dermis_mm=1.0)
    by_measures = fp.TouchRequest.read(ball | {"finger": {"like": "aged", "width_mm": 18}})
    assert by_measures.touch.finger == Fingertip.of("aged", width_mm=18.0)
    outline = fp.TouchRequest.read(ball | {"finger": {"kind": "outline", "nail_half_width_mm": 5.5}})
    assert outline.pressed_finger == Fingertip(nail_half_width_mm=5.5)
    child = fp.TouchRequest.read(ball | {"finger": "child", "place": {"x_mm": 1}})
    assert child.touch.at_mm == (CHILD.contact_mm[0] + 1.0, 0.0)
    laid = ball | {"finger": "child", "afferents": {"layout": "hexagonal", "region": {"shape": "pad"}}}
    points = fp.TouchRequest.read(laid).population.positions_mm
    assert np.abs(CHILD.level(points)).max() < 1e-9
    nail = ball | {"finger": "child", "afferents": {"layout": "nail rows"}}
    assert np.abs(CHILD.level(fp.TouchRequest.read(nail).population.positions_mm)).max() < 1e-9


test_impossible_fingers_are_refused_in_one_sentence = refusals(
    (lambda: Fingertip.of(length_mm=20_000.0), "length_mm must lie within 2 to 100 mm"),
    (lambda: Fingertip.of(width_mm=0.016), "width_mm .* got 0.016; check its unit"),
    (lambda: PAPER.scaled(-1.0), ("factor",)),
    (lambda: Fingertip.of("baby"), ("like",)),
    (lambda: Fingertip.of(widht_mm=16.0), "did you mean width_mm"),
    (lambda: Fingertip.of(height_mm=4.0), "Bone and skin layers of 1.624 mm must fit"),
    (lambda: fp.TouchRequest.read({"object": "sphere", "finger": "giant"}).touch, "like must be one of"),
    (lambda: fp.TouchRequest.read({"object": "sphere", "finger": "adult:18"}).touch, "as adult:width_mm=18"),
    (lambda: fp.TouchRequest.read({"object": "sphere", "finger": "adult:width_mm=x"}).touch, "width_mm must"),
    (lambda: fp.TouchRequest.read({"object": "sphere", "finger": {"kind": "toe"}}), ("finger", "kind")),
)  # fmt: skip


@pytest.mark.parametrize(
    "law",
    [
        Polynomial(3.0, 1.0, 2.0, 0.5, 0.1, 200.0, 10.0),
        Ogden((8.0, 2.0), (2.0, 8.0), 240.0),
        Hyperfoam((3.0, 1.0), (8.0, -2.0), 0.4),
        Hencky(27.0, 600.0),
        Energy("b / 2 * (exp(I1 - 3) - 1) + k / 2 * (J - 1)**2", (("b", 12.0), ("k", 600.0))),
    ],
    ids=lambda law: type(law).__name__,
)
def test_scaled_laws_have_scaled_energies(law):
    logs = [0.2, -0.05, -0.15, 0.02]
    scaled = law.scaled(2.5).energy.derivatives(logs)
    np.testing.assert_allclose(scaled, 2.5 * law.energy.derivatives(logs), rtol=1e-12)
    relaxing = Material(law, Prony((0.2,), (100.0,)))
    assert relaxing.scaled(2.5).prony == relaxing.prony
    assert relaxing.scaled(2.5).poisson == pytest.approx(relaxing.poisson)
    tissues = named_tissues("human")
    for layer, stiffer in zip(tissues.layers, tissues.scaled(1.3).layers, strict=True):
        assert stiffer.shear_modulus_kpa == pytest.approx(1.3 * layer.shear_modulus_kpa)
