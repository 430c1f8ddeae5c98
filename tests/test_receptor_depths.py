"""End organs at any depth: closed forms on blocks and fingers, own meshes, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import fingerpad as fp
from fingerpad.core.signals import traces_below
from fingerpad.geometry.free_mesh import MeshParts, finger_from
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import finger_mesh
from fingerpad.skin.fields import FIELDS, watched_elements
from fingerpad.skin.store import Store, solve_missing
from sections import SphereSkin, layered_block
from test_sampling import SITES, response

FINGER = fp.Fingertip()
FULL = finger_mesh(FINGER, replace(resolution_grading("quick", 17.37), full=True))
HALF = finger_mesh(FINGER, resolution_grading("quick", 17.37))
ALL_DEPTHS = [1e-3, 0.1, 0.25, 0.371, 0.4, 0.471, 0.48, 0.9, 1.2, 1.624, 1.7, 3.0, 4.9]
PAD = np.random.default_rng(3).uniform([15.0, -2.5], [20.0, 2.5], (40, 2))
BALL = fp.Sphere(radius_mm=4.0)
COARSE = fp.Grading(17.37, 2.0, 2.0, 0.6, 0.6, 3.0, stratum_corneum=1, dermis=2, subcutis=2)


def refused(make):
    with pytest.raises(fp.InputError) as error:
        make()
    return str(error.value)


def free_block(symmetric=True):
    """The block of layers as a mesh of one's own, its elements in no order."""
    return free_mesh(layered_block(symmetric=symmetric))


def free_mesh(mesh, seed=5):
    order = np.random.default_rng(seed).permutation(len(mesh.elements))
    names = ("stratum_corneum", "living_epidermis", "dermis", "subcutis")
    sets = {name: np.flatnonzero(mesh.layer[order] == number) for number, name in enumerate(names)}
    nodes = {"skin": mesh.skin_nodes, "bone": mesh.bone_nodes}
    if mesh.symmetry_nodes.size:
        nodes["symmetry"] = mesh.symmetry_nodes
    parts = MeshParts("block", mesh.nodes_mm, mesh.elements[order], np.arange(len(order)), nodes, sets)
    return finger_from(parts, contact_mm=(0.0, 0.0) if mesh.shape[2] == 6 else FINGER.contact_mm).mesh


@pytest.fixture(scope="module", params=["grid", "own"])
def block(request):
    return layered_block(symmetric=False) if request.param == "grid" else free_block(symmetric=False)


@pytest.mark.parametrize("depth_mm", ALL_DEPTHS)
def test_what_is_the_same_everywhere_is_read_at_all_depths(block, depth_mm):
    skin = response(block, lambda centre: np.full(len(centre), 3.0))
    assert_allclose(
        skin.sed(SITES, depth_mm=depth_mm).values, np.outer([0.0, 1.5, 3.0], np.ones(60)), rtol=1e-9
    )


@pytest.mark.parametrize("depth_mm", [0.1, 0.15, 0.2, 0.28, 0.74, 0.8, 1.1, 1.3])
def test_what_is_linear_in_a_layer_is_read_exactly_between_middles(block, depth_mm):
    """Middles lie 0.1 and 0.2855 mm deep in the stratum corneum, 0.7355 and 1.312 mm in the dermis."""

    def linear(centre):
        return 9.0 + 0.7 * centre[:, 0] + 2.0 * centre[:, 1] - 0.4 * centre[:, 2]

    points = np.column_stack([SITES[:, 0], np.full(60, depth_mm), SITES[:, 1]])
    skin = response(block, linear)
    for sites in (SITES, points * [1.0, 0.0, 1.0]):
        assert_allclose(skin.sed(sites, depth_mm=depth_mm).values[-1], linear(points), rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("depth_mm", "middle_mm"), [(0.05, 0.1), (0.371, 0.2855), (0.48, 0.7355), (5.0, 3.312)]
)
def test_values_are_constant_from_the_last_middle_to_the_border(block, depth_mm, middle_mm):
    skin = response(block, lambda centre: centre[:, 1])
    assert_allclose(skin.sed(SITES, depth_mm=depth_mm).values[-1], middle_mm, rtol=0, atol=1e-6)


def test_layers_never_mix_and_a_border_belongs_to_the_layer_above(block):
    values = np.array([100.0, 3.0, 40.0, 7.0])
    skin = response(block, lambda centre: values[block.layer])
    layers = np.searchsorted([0.371, 0.471, 1.624], np.array(ALL_DEPTHS))
    sites = np.repeat(SITES[:1], len(ALL_DEPTHS), axis=0)
    assert_allclose(skin.sed(sites, depth_mm=ALL_DEPTHS).values[-1], values[layers], rtol=1e-9)
    assert layers.tolist() == [0, 0, 0, 0, 1, 1, 2, 2, 2, 2, 3, 3, 3]


def test_the_default_is_the_border_and_one_number_per_site_is_taken():
    skin = response(HALF, lambda centre: 20.0 + centre[:, 0] + 0.3 * centre[:, 1])
    default, border = skin.sed(PAD).values, skin.sed(PAD, depth_mm=0.471).values
    # x and z of an end organ are those of the middles above the border without a depth, 0.05 mm higher.
    assert_allclose(border, default, rtol=0, atol=0.02)
    points = FINGER.skin_point(*PAD.T)
    assert_allclose(skin.sed(points, depth_mm=0.471).values, skin.sed(points).values, rtol=0, atol=1e-3)
    depths = np.linspace(0.2, 4.0, len(PAD))
    each = [skin.sed([site], depth_mm=depth).values[:, 0] for site, depth in zip(PAD, depths, strict=True)]
    assert_allclose(skin.sed(PAD, depth_mm=depths).values.T, each, rtol=1e-12)


@pytest.mark.parametrize("depth_mm", [0.2, 0.5, 1.0, 1.5, 2.5, 4.0])
def test_depth_is_measured_along_the_normal_of_the_finger(depth_mm):
    """A field that is linear in space is read at the end organ's place."""

    def linear(centre):
        return 20.0 + centre @ [0.7, 0.5, 0.3]

    skin, points = response(FULL, linear), FINGER.skin_point(*PAD.T)
    organs = FINGER.subsurface(points, depth_mm)
    beyond = 0.0 if depth_mm not in (0.5, 1.5) else 0.1  # between a border and the middle of an element
    assert_allclose(
        skin.sed(points, depth_mm=depth_mm).values[-1], linear(organs), rtol=0, atol=0.01 + beyond
    )
    by_place = skin.sed(organs[:, [0, 2]], depth_mm=depth_mm).values
    assert_allclose(by_place, skin.sed(points, depth_mm=depth_mm).values, rtol=0, atol=0.01)


def test_half_and_whole_fingers_agree():
    def even(centre):
        return 5.0 + np.cos(0.4 * centre[:, 2]) + 0.2 * centre[:, 1] + np.sin(0.3 * centre[:, 0])

    half, full = response(HALF, even), response(FULL, even)
    for depth_mm in (0.3, 1.0, 3.0):
        assert_allclose(
            half.sed(PAD, depth_mm=depth_mm).values, full.sed(PAD, depth_mm=depth_mm).values, atol=1e-5
        )
        mirrored = half.sed(PAD * [1.0, -1.0], depth_mm=depth_mm).values
        assert_array_equal(half.sed(PAD, depth_mm=depth_mm).values, mirrored)


def test_a_mesh_of_one_s_own_reads_what_ours_reads():
    mesh = finger_mesh(FINGER, replace(resolution_grading("quick", 17.37), dermis=2))

    def smooth(centre):
        return 2.0 * np.exp(
            -0.1 * ((centre[:, 0] - 17.4) ** 2 + (centre[:, 1] + 9.9) ** 2 + centre[:, 2] ** 2)
        )

    ours, own = response(mesh, smooth), response(free_mesh(mesh), smooth)
    points = FINGER.skin_point(*PAD.T)
    for depth_mm in (0.2, 0.9, 1.3, 3.0):
        for sites in (PAD, points):
            read = own.sed(sites, depth_mm=depth_mm).values
            assert_allclose(read, ours.sed(sites, depth_mm=depth_mm).values, rtol=0, atol=0.02)


@pytest.fixture(scope="module")
def pressed():
    motion, steps = fp.RampAndHold(depth_mm=0.6, hold_ms=50.0), fp.PressSettings(ramp_steps=2, hold_steps=1)
    touch = fp.touch_of(FINGER, BALL, motion, grading=COARSE, settings=steps, receptor_depths_mm=[1.2, 1.2])
    return touch, touch.solve()


def test_a_press_keeps_all_quantities_in_the_layers_of_its_receptor_depths(pressed, tmp_path):
    touch, skin = pressed
    plain, whole = replace(touch, receptor_depths_mm=()).solve(), touch.solve(whole=True)
    assert touch.receptor_depths_mm == (1.2,)
    sheet = skin.mesh.living_epidermis.size
    for name, values in plain.fields.items():
        watched = FIELDS[name].place.name == "WATCHED"
        assert_array_equal(skin.fields[name][:, :sheet] if watched else skin.fields[name], values)
        assert_array_equal(whole.fields[name], skin.fields[name])
    watched = skin.watched_elements
    assert set(skin.mesh.layer[watched]) == {1, 2}
    assert_array_equal(skin.fields["von_mises"], whole.deformation.fields.von_mises_kpa[:, watched])
    assert plain.caveats == skin.caveats
    sites = [(17.37, 0.0), (18.0, 0.4)]
    assert_array_equal(skin.sample("von_mises", sites), plain.sample("von_mises", sites))
    assert (skin.sample("von_mises", sites, depth_mm=0.9)[-1] > 0.0).all()
    assert_array_equal(
        skin.sample("stored", sites, depth_mm=3.0), plain.sample("stored", sites, depth_mm=3.0)
    )
    says = "one at which the press kept von_mises: got 1.2 mm; press with receptor_depths_mm=(1.2,)."
    assert refused(lambda: plain.sample("von_mises", sites, depth_mm=1.2)) == f"depth_mm must be {says}"
    assert "receptor_depths_mm=(3,)" in refused(lambda: skin.sample("von_mises", sites, depth_mm=3.0))
    store = Store(tmp_path)
    solve_missing(store.missing([touch]), jobs=1)
    stored = store.load(touch)
    assert_allclose(
        stored.sample("von_mises", sites, depth_mm=0.9),
        skin.sample("von_mises", sites, depth_mm=0.9),
        rtol=1e-6,
    )
    assert store.path(touch) != store.path(plain.touch)
    assert skin.to_dataset()["sheet"].size == watched.size


def test_energy_below_a_sphere_is_that_of_its_elements_and_decays_in_the_subcutis(pressed):
    _, skin = pressed
    mesh, column = skin.mesh, np.abs(skin.mesh.nodes_mm[skin.mesh.midline_nodes, 0] - 17.37).argmin()
    numbers = np.arange(len(mesh.elements)).reshape(mesh.shape)[column, 0]
    middles = mesh.nodes_mm[mesh.elements[numbers]].mean(axis=1)
    feet = FINGER.skin_point(middles[:, 0], middles[:, 2])
    for _ in range(20):  # the point of the skin whose normal meets a middle
        depths = np.linalg.norm(feet - middles, axis=1)
        off = middles - feet + depths[:, None] * FINGER.skin_normal(feet)
        feet = FINGER.skin_point(*(feet + off)[:, [0, 2]].T)
    read = skin.sed(feet, depth_mm=depths).values[-1]
    assert_allclose(read, skin.sed_kpa[-1, numbers], rtol=0.01)
    deep = skin.sed([(17.37, 0.0)] * 20, depth_mm=np.linspace(1.7, 5.0, 20)).values[-1]
    assert (np.diff(deep) <= 0.0).all()
    assert deep[-1] < deep[0]


def test_what_has_no_depth_or_lies_in_no_tissue_is_refused(pressed):
    touch, skin = pressed
    site = [(17.37, 0.0)]
    for depth_mm, says in (
        (0.0, "depth_mm must be greater than 0: got 0 mm."),
        (5.8, "depth_mm must lie in the tissue, between the skin and the bone: got 5.8 mm at (17.37, 0) mm."),
        ([1.0, 1.0], "depth_mm must be one number or one per site, 1: got shape (2,)."),
    ):
        assert refused(lambda depth_mm=depth_mm: skin.sed(site, depth_mm=depth_mm)) == says
    for quantity in ("skin_displacement", "deep_displacement", "skin_stretch"):
        says = f"depth_mm must be left out for {quantity}, which is that of the surface."
        assert refused(lambda quantity=quantity: skin.sample(quantity, site, depth_mm=1.0)) == says
    says = "receptor_depths_mm must be depths of the tissue, which is at most"
    assert refused(lambda: replace(touch, receptor_depths_mm=(30.0,))).startswith(says)
    assert "receptor_depths_mm must be greater than 0" in refused(
        lambda: replace(touch, receptor_depths_mm=(-1.0,))
    )
    own = response(free_block(symmetric=False))
    assert "between the skin and the bone" in refused(lambda: own.sed(SITES, depth_mm=6.0))
    assert watched_elements(own.mesh, (0.3,)).size == own.mesh.living_epidermis.size + 2 * 256


def test_a_depth_is_passed_to_skins_that_take_one():
    skin = response(layered_block(), lambda centre: centre[:, 1])
    assert_allclose(traces_below(skin, SITES, "stored", "stored", 0.8).values[-1], 0.8, atol=1e-6)
    says = refused(lambda: traces_below(SphereSkin(0.0, 300.0), SITES, "stored", "stored", 0.8))
    assert says.startswith(
        "skin.sed must accept depth_mm, since end organs have a depth: got SphereSkin.sed(sites)"
    )
