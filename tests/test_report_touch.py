"""The picture of one touch shows the pressed finger, the body that presses it, and the spikes."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.collections import EventCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.patches import Polygon
from numpy.testing import assert_allclose, assert_array_equal

import fingerpad as fp
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import Pose
from fingerpad.geometry.surface import Surface
from fingerpad.report import skin as touch_figure
from fingerpad.report.style import new_figure
from fingerpad.skin.section import middle_section

MOTION = fp.RampAndHold(depth_mm=0.4)
FEW_STEPS = fp.PressSettings(ramp_steps=2, hold_steps=1)


@pytest.fixture(scope="module")
def touch():
    return fp.touch_of(fp.Fingertip(), fp.Sphere(curvature_per_m=287), MOTION, settings=FEW_STEPS)


@pytest.fixture(scope="module")
def skin(touch):
    return touch.solve()


def area(quads):
    """Area of polygons by the shoelace formula."""
    x, y = quads[..., 0], quads[..., 1]
    return 0.5 * np.abs((x * np.roll(y, -1, -1) - y * np.roll(x, -1, -1)).sum(-1))


def test_the_section_of_a_block_is_one_of_its_sides_and_a_body_without_its_plane_has_none():
    mesh = block_mesh([0.0, 1.0, 3.0], [0.0, 2.0], [0.0, 1.0], layers=[0], symmetric=True)
    section = middle_section(mesh, np.zeros_like(mesh.nodes_mm))
    assert_allclose(area(section.corners_mm), [2.0, 4.0])
    assert section.bone_mm[..., 1].tolist() == [[2.0, 2.0]] * 2
    assert section.skin_mm[..., 1].tolist() == [[0.0, 0.0]] * 2
    assert section.nail_mm.shape == (0, 2, 2)
    mesh = block_mesh([0.0, 1.0], [0.0, 1.0], [1.0, 2.0], layers=[0])
    with pytest.raises(fp.InputError, match="face on the plane z = 0"):
        middle_section(mesh, np.zeros_like(mesh.nodes_mm))


def test_skin_and_nail_go_once_around_the_section_and_lie_on_the_mesh(skin):
    section, mesh = skin.section(), skin.mesh
    outside = np.concatenate([section.skin_mm, section.nail_mm])
    ends, count = np.unique(outside.reshape(-1, 2).round(9), axis=0, return_counts=True)
    assert sorted(count) == [1, 1, *[2] * (len(ends) - 2)]
    moved = (mesh.nodes_mm + skin.displacement_mm)[np.abs(mesh.nodes_mm[:, 2]) < 1e-9]
    assert {tuple(end) for end in ends} <= {tuple(node) for node in moved[:, :2].round(9)}


@pytest.mark.parametrize(
    ("quantity", "field", "name"),
    [
        ("stored", "sed_kpa", "strain energy density"),
        ("compressive_stress", "compressive_stress_kpa", "compressive stress"),
    ],
)
def test_faces_have_the_colour_of_what_the_afferents_follow(skin, quantity, field, name):
    afferent = fp.Afferent(dynamic_quantity=quantity, static_quantity=quantity)
    with warnings.catch_warnings(action="ignore"):
        response = fp.Population.grid(density_per_cm2=20, afferent=afferent).respond(skin)
    figure = touch_figure.draw_touch(skin, response)
    faces, bone = (part for part in figure.axes[0].collections if isinstance(part, PolyCollection))
    assert_array_equal(faces.get_array(), np.atleast_2d(skin.fields[field])[-1][skin.section().elements])
    assert any(axes.get_ylabel() == f"{name} [kPa]" for axes in figure.axes)
    # The bone differs from the paper, and lies within the section.
    assert to_hex(bone.get_facecolor()[0]) == touch_figure.BONE_INSIDE
    (outline,) = bone.get_paths()
    assert area(outline.vertices[:-1]) == pytest.approx(4.3 * 25.0, rel=0.1)


def test_the_colours_grow_darker_all_the_way():
    red, green, blue, _ = touch_figure.SKIN(np.linspace(0.0, 1.0, 256)).T
    assert (np.diff(0.2126 * red + 0.7152 * green + 0.0722 * blue) < 0.0).all()


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0])
def test_the_body_is_drawn_where_it_was_pressed(touch, skin, tilt_deg):
    if tilt_deg:
        touch = fp.touch_of(touch.finger, touch.indenter, MOTION, tilt_deg=tilt_deg, settings=FEW_STEPS)
        skin = touch.solve()
    axes = new_figure(4.0, 3.0).subplots()
    touch_figure.draw_section(axes, skin, touch.indenter)
    (body,) = axes.patches
    assert isinstance(body, Polygon)
    placement = touch.placement
    moved = placement.origin_mm + skin.depth_mm[-1] * placement.axis
    points = np.column_stack([body.get_xy()[:-3], np.zeros(len(body.get_xy()) - 3)])
    gap, _ = touch.indenter.gap((points - moved) @ placement.rotation)
    # Between two nodes the skin spans the sphere as a chord.
    assert_allclose(gap, 0.0, atol=0.03)


def test_a_body_that_moved_is_drawn_where_it_is_at_the_end_if_that_is_on_the_middle_plane(touch, skin):
    def drawn(pose):
        axes = new_figure(4.0, 3.0).subplots()
        touch_figure.draw_section(axes, replace(skin, pose=pose), touch.indenter)
        return axes

    moved = map(drawn, (Pose(), Pose(x_mm=2.0, tilt_deg=3.0)))
    middles = [axes.patches[0].get_xy()[:-3, 0].mean() for axes in moved]
    # A tilt of 3 degrees lays the body of the sphere over by a little.
    assert middles[1] - middles[0] == pytest.approx(2.0, abs=0.6)
    assert not drawn(Pose(z_mm=1.0)).patches
    assert drawn(Pose(x_mm=2.0)).get_xlim()[0] == pytest.approx(drawn(Pose()).get_xlim()[0] + 2.0)


def test_a_hole_through_a_body_is_drawn_as_a_hole(skin):
    """A ring of triangles: two parts in the section, 2 mm apart, and nothing between them."""
    angle = np.arange(48) * 2 * np.pi / 48
    flat = [[r * np.cos(a), 0.0, r * np.sin(a)] for r in (1.0, 2.0) for a in angle]
    near = np.arange(48)
    after, outer = (near + 1) % 48, near + 48
    quads = np.stack([near, after, after + 48, outer], axis=1)
    ring = Surface(np.array(flat), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))
    axes = new_figure(4.0, 3.0).subplots()
    touch_figure._draw_indenter(axes, skin, skin.section(), ring)
    left, right = (patch.get_xy()[:, 0] for patch in axes.patches)
    assert right.min() - left.max() == pytest.approx(2.0, abs=0.15)


def test_trains_stand_in_the_order_of_their_distance_and_silent_ones_are_counted(skin):
    trains = {2.0: [3.0, 9.0], 0.5: [1.0], 9.0: [], 4.0: [7.0]}
    places, spikes = [[skin.axis_x_mm, -z] for z in trains], [np.array(train) for train in trains.values()]
    response = SimpleNamespace(types=(), positions_mm=np.array(places), spikes=spikes)
    axes = new_figure(4.0, 3.0).subplots()
    touch_figure.draw_spikes(axes, skin, response)
    rows = sorted(
        (drawn.get_lineoffset(), list(drawn.get_positions()))
        for drawn in axes.collections
        if isinstance(drawn, EventCollection)
    )
    assert rows == [(1, [1.0]), (2, [3.0, 9.0]), (3, [7.0])]
    assert axes.get_ylabel().startswith("3 of 4 afferents")
    silent = SimpleNamespace(types=(), positions_mm=np.zeros((1, 2)), spikes=[np.empty(0)])
    axes = new_figure(4.0, 3.0).subplots()
    touch_figure.draw_spikes(axes, skin, silent)
    assert [text.get_text() for text in axes.texts] == ["no afferent fires a spike"]


def test_the_picture_is_saved_with_folders_on_the_way_or_nothing_is_written(skin, tmp_path):
    response = fp.Population.grid(density_per_cm2=10).respond(skin)
    for name, given, said in (
        ("a.png", (response, skin), "skin must be of type SkinResponse: got ResponseMap"),
        ("a.png", (skin, fp.Sphere(), response), "response must be of type ResponseMap"),
        ("a.png", (skin, response, response), "indenter must be of type Indenter"),
        ("a.xyz", (skin, response), r"A figure is written as \.png: got a\.xyz\."),
        ("a", (skin, response), r"A figure is written as \.png: got a\."),
    ):
        with pytest.raises(fp.InputError, match=said):
            fp.save_figure(tmp_path / name, *given)
    assert list(tmp_path.iterdir()) == []
    saved = fp.save_figure(tmp_path / "new" / "touch.png", skin, response)
    assert saved.read_bytes().startswith(b"\x89PNG")
