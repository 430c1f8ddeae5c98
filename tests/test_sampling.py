"""Sampling of the skin: exact for linear fields, mirrored in z, refused beside the finger."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import CloughTocher2DInterpolator

from fingerpad import Fingertip, InputError
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import LAYERS, block_mesh, finger_mesh
from fingerpad.skin.receptor_sheet import ReceptorSheet
from fingerpad.skin.sampling import SkinResponse
from sections import DEPTHS_MM, LAYER_OF_INTERVAL, layered_block

TIMES_MS = np.array([0.0, 50.0, 1000.0])


@cache
def mesh_of(resolution):
    return finger_mesh(Fingertip(), resolution_grading(resolution, 17.37))


QUICK = mesh_of("quick")
MIDDLE_DEPTH_MM = 0.421
"""Depth of the middles of the living epidermis' elements, whose means are read."""

SITES = np.random.default_rng(0).uniform(-2.0, 2.0, (60, 2))


def response(mesh, field=None, displacement=None, axis_x_mm=0.0):
    """Skin whose SED is `field` (centres (n, 3) -> (n,)) at the end and half of it at the end of the ramp."""
    centres = mesh.nodes_mm[mesh.elements].mean(axis=1)
    sed = np.zeros((3, len(mesh.elements)))
    if field is not None:
        sed[1:] = np.outer([0.5, 1.0], field(centres))
    moved = np.zeros_like(mesh.nodes_mm) if displacement is None else displacement(mesh.nodes_mm)
    fields = {
        "times_ms": TIMES_MS,
        "skin_displacement_mm": np.array([0.0, 0.5, 1.0])[:, None, None] * moved[mesh.skin_nodes],
        "sed_kpa": sed,
        "von_mises": 7.0 * sed[:, mesh.living_epidermis.ravel()],
    }
    return SkinResponse(
        mesh=mesh, kinks_ms=(50.0,), axis_x_mm=axis_x_mm, direction=np.array([0.0, 1.0, 0.0]), fields=fields,
        force_imbalance=0.0, energy_imbalance=0.0, penetration_mm=0.0, newton_steps=0, factorisations=0,
        linear_solver="none",
    )  # fmt: skip


@pytest.mark.parametrize("symmetric", [True, False])
def test_linear_field_is_read_exactly_at_every_time(symmetric):
    slope_z = 0.0 if symmetric else -0.4
    skin = response(
        layered_block(symmetric=symmetric), lambda centre: 9.0 + 0.7 * centre[:, 0] + slope_z * centre[:, 2]
    )
    traces = skin.sed(SITES)
    expected = 9.0 + SITES @ [0.7, slope_z]
    # SciPy estimates the slopes of its cubic to a relative 1e-6.
    np.testing.assert_allclose(traces.values, np.outer([0.0, 0.5, 1.0], expected), rtol=0, atol=1e-6)
    assert traces.times_ms.tolist() == TIMES_MS.tolist()
    assert traces.kinks_ms.tolist() == [50.0]


def test_only_the_living_epidermis_is_read():
    """A field that differs from layer to layer: no element of another layer may leak in."""
    mesh = layered_block()
    values = np.array([100.0, 3.0, 100.0, 100.0])
    skin = response(mesh, lambda centre: values[mesh.layer])
    np.testing.assert_allclose(skin.sed(SITES).values[-1], 3.0, rtol=1e-12)
    assert LAYERS[1] == "living epidermis"


def bump(centre):
    """Peak beside the middle, even in z."""
    return 0.1 + np.exp(-((centre[:, 0] - 0.2) ** 2 + centre[:, 2] ** 2))


def test_sites_are_found_once_on_equal_meshes_and_anew_on_others(monkeypatch):
    found, below = [], ReceptorSheet.below

    def watched(sheet, organs):
        found.append(sheet.mesh)
        return below(sheet, organs)

    monkeypatch.setattr(ReceptorSheet, "below", watched)
    sites = SITES + np.array([0.125, 0.0])
    mesh = layered_block()
    same = replace(mesh, nodes_mm=mesh.nodes_mm.copy())
    moved = replace(mesh, nodes_mm=mesh.nodes_mm + np.array([0.5, 0.0, 0.0]))
    read = [response(each, bump).sed(sites).values for each in (mesh, same, moved)]
    assert [each is moved for each in found] == [False, True]
    np.testing.assert_array_equal(read[0], read[1])
    assert not np.allclose(read[0], read[2])


def test_energy_never_falls_below_zero_beside_a_steep_front():
    skin = response(layered_block(), lambda centre: np.where(centre[:, 0] > 0.0, 5.0, 0.0))
    assert (skin.sed(SITES).values >= 0.0).all()


@pytest.mark.parametrize("symmetric", [True, False])
def test_other_quantities_are_read_like_the_stored_energy_and_may_take_its_place(symmetric):
    skin = response(layered_block(symmetric=symmetric), bump)
    stored = skin.sample("stored", SITES)
    np.testing.assert_array_equal(stored, skin.sed(SITES).values)
    np.testing.assert_allclose(skin.sample("von_mises", SITES), 7.0 * stored, rtol=1e-5)
    traces = skin.sed(SITES, dynamic_quantity="von_mises")
    np.testing.assert_array_equal(traces.values, skin.sed(SITES).values)
    np.testing.assert_array_equal(traces.dynamic.values, skin.sample("von_mises", SITES))
    assert traces.dynamic_quantity == "von_mises"
    assert skin.sed(SITES).dynamic is None
    energy, stress = stored, skin.sample("von_mises", SITES)
    static = skin.sed(SITES, static_quantity="von_mises")
    np.testing.assert_array_equal(static.values, stress)
    np.testing.assert_array_equal(static.dynamic.values, energy)
    both = skin.sed(SITES, "von_mises", "von_mises")
    np.testing.assert_array_equal(both.values, stress)
    assert both.dynamic is None
    assert both.static_quantity == both.dynamic_quantity == "von_mises"


def test_a_point_of_the_skin_is_read_where_its_end_organ_lies():
    """Given by its own x and z or by the point of the skin above it, an end organ reads the same."""
    finger = Fingertip()

    def bump(centre):
        return 2.0 * np.exp(-0.3 * ((centre[:, 0] - 17.0) ** 2 + centre[:, 2] ** 2))

    skin = response(QUICK, bump)
    sites = np.random.default_rng(2).uniform([14.0, -3.0], [20.0, 3.0], (200, 2))
    points = finger.skin_point(*sites.T)
    organs = finger.subsurface(points, MIDDLE_DEPTH_MM)
    from_points, from_organs = skin.sed(points), skin.sed(organs[:, [0, 2]])
    np.testing.assert_allclose(from_points.values[-1], bump(organs), rtol=0, atol=0.02)
    np.testing.assert_allclose(from_points.values, from_organs.values, rtol=0, atol=0.02)
    straight_below = skin.sed(sites).values[-1]
    assert np.abs(straight_below - from_points.values[-1]).max() > 0.06


def test_every_quantity_is_read_below_points_of_the_skin():
    skin = response(QUICK, lambda centre: 50.0 + centre[:, 1])
    points = Fingertip().skin_point([15.0, 18.0], [1.0, -2.0]) * [1.0, 1.0, 1.0]
    traces = skin.sed(points, dynamic_quantity="von_mises")
    np.testing.assert_allclose(traces.dynamic.values, 7.0 * traces.values, rtol=1e-12)
    np.testing.assert_array_equal(skin.sample("von_mises", points), traces.dynamic.values)
    with pytest.raises(InputError, match="must lie on the skin of the mesh"):
        skin.sed(points - [0.0, 3.0, 0.0])


FIELDS_IN_SPACE = {
    "as below a sphere": lambda x, z: 2.0 * np.exp(-0.3 * ((x - 17.37) ** 2 + z**2)),
    "as below a small sphere": lambda x, z: 2.0 * np.exp(-((x - 17.37) ** 2) - z**2),
    "as below edges": lambda x, z: np.exp(-(((np.abs(x - 17.37) - 1.5) / 0.4) ** 2) - 0.05 * z**2),
    "waves": lambda x, z: np.cos(1.3 * x) * np.cos(0.9 * z),
}


def by_triangles(mesh, values, organs):
    """Another cubic for the same purpose: Clough-Tocher on triangles over x and z, by SciPy."""
    corners = mesh.nodes_mm[mesh.elements[mesh.living_epidermis.ravel()]]
    volar = np.cross(corners[:, 6] - corners[:, 4], corners[:, 7] - corners[:, 5])[:, 1] < 0.0
    plane, known = corners.mean(axis=1)[volar][:, [0, 2]], values[volar]
    both = np.vstack([plane, plane * [1.0, -1.0]])
    return CloughTocher2DInterpolator(both, np.tile(known, 2))(organs[:, 0], np.abs(organs[:, 1]))


@pytest.mark.parametrize("resolution", ["quick", "standard"])
@pytest.mark.parametrize(
    ("field", "quick", "standard"),
    [
        ("as below a sphere", 0.0008, 0.0003),
        ("as below a small sphere", 0.007, 0.0006),
        ("as below edges", 0.09, 0.01),
        ("waves", 0.0008, 0.0004),
    ],
)
def test_smooth_fields_are_read_better_than_by_triangles(resolution, field, quick, standard):
    """The errors behind docs/decisions.md#sampling-between-elements."""
    mesh = mesh_of(resolution)
    sites = np.random.default_rng(1).uniform([14.0, -3.0], [20.5, 3.0], (1000, 2))
    sheet, truth = ReceptorSheet(mesh), FIELDS_IN_SPACE[field]
    x, _, z = mesh.nodes_mm[mesh.elements[mesh.living_epidermis.ravel()]].mean(axis=1).T
    read = sheet.read(sheet.below(sites), truth(x, z)[None])[0]
    off = np.abs(read - truth(*sites.T))
    beside = np.abs(by_triangles(mesh, truth(x, z), sites) - truth(*sites.T))
    assert off.max() < (quick if resolution == "quick" else standard)
    assert off.max() < beside.max()
    assert np.mean(off**2) < np.mean(beside**2)


def test_the_error_falls_with_the_fourth_power_of_the_size_of_the_elements():
    errors = []
    for size in (0.3, 0.15, 0.075):
        lines = np.arange(-2.4, 2.4 + 0.5 * size, size)
        mesh = block_mesh(lines, DEPTHS_MM, lines, LAYER_OF_INTERVAL, symmetric=False)
        sheet = ReceptorSheet(mesh)
        x, _, z = mesh.nodes_mm[mesh.elements[mesh.living_epidermis.ravel()]].mean(axis=1).T
        sites = np.random.default_rng(4).uniform(-0.8, 0.8, (400, 2))
        read = sheet.read(sheet.below(sites), (np.sin(2.0 * x) * np.cos(1.5 * z))[None])[0]
        errors.append(np.abs(read - np.sin(2.0 * sites[:, 0]) * np.cos(1.5 * sites[:, 1])).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > 3.7).all()
    assert (orders < 4.5).all()


@pytest.mark.parametrize("full", [False, True])
def test_every_place_of_the_volar_side_is_found(full):
    """From the cut to the tip and to where the flank turns up, where x and z follow from a unique (u, v)."""
    finger = Fingertip()
    mesh = finger_mesh(finger, replace(resolution_grading("quick", 17.37), full=full))
    rng = np.random.default_rng(3)
    x = rng.uniform(0.5, 29.0, 2000)
    organs = np.stack([x, 0.9 * rng.uniform(-1.0, 1.0, 2000) * finger.section(x)[2]], axis=1)
    sheet = ReceptorSheet(mesh)
    found = sheet.below(organs)
    inside = organs if mesh.full else np.abs(organs)
    np.testing.assert_allclose(sheet._centre(found)[0][:, [0, 2]], inside, rtol=0, atol=1e-8)
    assert (sheet._centre(found)[0][:, 1] < 0.0).mean() > 0.99


@pytest.mark.parametrize("site", [(17.37, 12.0), (40.0, 0.0), (-1.0, 0.0), (31.0, 8.0)])
def test_site_beside_the_finger_is_refused(site):
    said = re.escape(f"({site[0]:g}, {site[1]:g})")
    with pytest.raises(InputError, match=f"must lie on the volar skin.*{said}"):
        response(QUICK).sed([(17.37, 0.0), site])


def test_what_cannot_be_read_is_refused():
    skin = response(layered_block())
    for sites in ([1.0, 2.0], [[1.0, 2.0, 3.0, 4.0]], [[np.nan, 0.0]], "middle"):
        with pytest.raises(InputError, match="sites"):
            skin.sed(sites)
    with pytest.raises(InputError, match=r"must be a list of places, such as \[\(x, z\)\] .*shape \(2,\)"):
        skin.sed((1.0, 0.0))
    known = "stored, von_mises, skin_displacement, deep_displacement, skin_stretch"
    with pytest.raises(InputError, match=f"quantity must be one of {known}: got"):
        skin.sample("heat", SITES)
    bare = block_mesh([0.0, 1.0, 2.0], [0.0, 1.0], [0.0, 1.0], layers=[2])
    with pytest.raises(InputError, match="no living epidermis"):
        response(bare).sed([(1.0, 0.5)])


def test_profile_is_the_deflection_towards_the_bone_along_the_midline():
    """A displacement with a known y component; x and z components must not show."""
    mesh = layered_block()
    axis_x = 0.5

    def dent(nodes):
        x, _, z = nodes.T
        return np.stack([0.3 * x, np.exp(-((x - axis_x) ** 2)) - z, -z], axis=1)

    skin = response(mesh, displacement=dent, axis_x_mm=axis_x)
    profile = skin.surface_profile()
    assert profile.distance_mm.shape == profile.deflection_mm.shape == mesh.midline_nodes.shape
    assert (np.diff(profile.distance_mm) > 0).all()
    np.testing.assert_allclose(profile.deflection_mm, np.exp(-(profile.distance_mm**2)), rtol=1e-12)
    np.testing.assert_allclose(skin.surface_profile(1).deflection_mm, 0.5 * profile.deflection_mm, rtol=1e-15)
    assert not skin.surface_profile(0).deflection_mm.any()


@pytest.mark.parametrize(
    ("gradient", "stretch"),
    [
        (np.diag([0.1, 0.0, -0.05]), np.log(1.1)),
        (np.diag([-0.1, 0.3, -0.05]), 0.0),
        # A simple shear by g within the surface: squares of the stretches are roots of s² - (2 + g²) s + 1.
        (0.4 * np.outer([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]), 0.5 * np.log(1.08 + np.sqrt(1.08**2 - 1.0))),
        # A rotation by 90 degrees about z stretches nothing.
        (np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 0.0]]), 0.0),
    ],
)
def test_stretch_of_the_surface_is_exact_under_uniform_deformation(gradient, stretch):
    skin = response(layered_block(symmetric=False), displacement=lambda nodes: nodes @ gradient.T)
    assert skin.sample("skin_stretch", SITES)[-1] == pytest.approx(stretch, abs=1e-12)
    assert not skin.sample("skin_stretch", SITES)[0].any()


def test_displacement_of_the_surface_is_its_length():
    skin = response(layered_block(), displacement=lambda nodes: 0.0 * nodes + [0.3, -0.4, 0.0])
    assert skin.sample("skin_displacement", SITES)[:, 0] == pytest.approx([0.0, 0.25, 0.5])
    traces = skin.sed(SITES, "skin_displacement", "skin_displacement")
    assert traces.dynamic_quantity == "skin_displacement"


def test_deep_displacement_is_the_mean_of_the_skin_within_reach_in_half_and_in_whole_bodies():
    def pressed(nodes):
        return np.exp(-(nodes[:, [0]] ** 2) - nodes[:, [2]] ** 2) * [0.0, 0.5, 0.0]

    half, whole = (response(layered_block(symmetric=each), displacement=pressed) for each in (True, False))
    sites = np.array([[0.0, 0.0], [0.8, 0.3], [-1.0, 1.2]])
    found = half.sample("deep_displacement", sites)[-1]
    np.testing.assert_allclose(whole.sample("deep_displacement", sites)[-1], found, rtol=1e-6)
    # Mean of the bell over a disc of 3 mm about its middle.
    assert found[0] == pytest.approx(0.5 * (1.0 - np.exp(-9.0)) / 9.0, rel=0.05)
