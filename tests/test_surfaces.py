"""Surfaces, height maps and compositions against closed forms and against bodies that are exact."""

import os
import struct
import time
from dataclasses import dataclass, replace

import numpy as np
import pytest
import trimesh
from PIL import Image

import fingerpad as fp
from fingerpad.geometry.bodies import ridges
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.height_maps import MOST_HEIGHTS
from fingerpad.geometry.probing import check_gap
from fingerpad.geometry.size_field import grading_below
from fingerpad.geometry.surface import Surface
from fingerpad.geometry.triangles import Triangles
from fingerpad.skin.store import touch_key
from refusals import refusals

CUBE = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-2.0, 0.0) for z in (-1.5, 1.5)])
SIDES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6],
     [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
COARSE = fp.Grading(17.37, 3.0, 3.0, 0.8, 0.8, 6.0, 1.3, 1, 1, 1, 1)


def map_of(body, half_mm=2.6, pitch_mm=0.05, floor_mm=-2.0):
    """Heights of a body's face on a grid."""
    line = np.arange(-half_mm, half_mm + pitch_mm / 2, pitch_mm)
    x, z = np.meshgrid(line, line)
    points = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])
    return np.maximum(body.front(points), floor_mm).reshape(x.shape)


@pytest.fixture(scope="module")
def ball():
    return fp.height_surface(map_of(fp.Sphere(curvature_per_m=400.0), 2.2), 0.05)


def test_distance_to_a_box_is_the_closed_form():
    points = np.random.default_rng(1).uniform(-4.0, 4.0, (2000, 3))
    beyond = np.abs(points - [0.0, -1.0, 0.0]) - [1.0, 1.0, 1.5]
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    expected = np.where(outside > 0.0, outside, beyond.max(axis=1))
    assert (expected < 0.0).sum() > 10
    triangles = Triangles.of(CUBE, SIDES)
    gap, normal = triangles.gap(points)
    np.testing.assert_allclose(gap, expected, rtol=0, atol=1e-12)
    out = np.maximum(beyond, 0.0)[outside > 0.0] * np.sign(points - [0.0, -1.0, 0.0])[outside > 0.0]
    np.testing.assert_allclose(normal[outside > 0.0] * outside[outside > 0.0, None], out, rtol=0, atol=1e-12)


def test_a_surface_is_as_near_as_the_ball_that_it_follows(ball):
    exact, generator = fp.Sphere(curvature_per_m=400.0), np.random.default_rng(2)
    radius = exact.radius_mm
    way = generator.normal(size=(500, 3)) * [0.6, 0.0, 0.6] + [0.0, 1.0, 0.0]
    way /= np.linalg.norm(way, axis=1)[:, None]
    points = way * generator.uniform(radius - 0.05, radius + 0.2, (500, 1)) - [0.0, radius, 0.0]
    points = points[(np.abs(points[:, [0, 2]]) < 1.6).all(axis=1)]
    gap, normal = ball.gap(points)
    expected, direction = exact.gap(points)
    np.testing.assert_allclose(gap, expected, rtol=0, atol=2e-3)
    np.testing.assert_allclose(normal, direction, rtol=0, atol=2e-2)
    check_gap(ball.gap, "ball")


def cup(half_mm, pitch_mm=0.1, radius_mm=12.0, **options):
    """Map of a hollow paraboloid."""
    line = np.arange(-half_mm, half_mm + pitch_mm / 2, pitch_mm)
    return fp.height_surface((line**2 + line[:, None] ** 2) / (2 * radius_mm), pitch_mm, **options)


def slope_of(body, points):
    """Gradient of the gap by central differences."""
    rise = [body.gap(points + step)[0] - body.gap(points - step)[0] for step in 1e-6 * np.eye(3)]
    return np.stack(rise, axis=1) / 2e-6


def test_closest_points_lie_on_the_triangles():
    generator = np.random.default_rng(1)
    points, corners = generator.normal(size=(200, 3)), generator.normal(size=(20, 3, 3))
    faces = np.append(np.arange(60).reshape(20, 3), [[0, 1, 1]], axis=0)  # the last one is a line
    row, found = Triangles.of(corners.reshape(-1, 3), faces).closest(points)
    shares = np.linalg.solve(corners[row].transpose(0, 2, 1), found[..., None])[..., 0]
    assert (shares >= -1e-9).all()
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    tried = generator.dirichlet([1.0, 1.0, 1.0], size=700)
    sampled = np.einsum("ka,tad->tkd", tried, corners).reshape(-1, 3)
    nearest = np.linalg.norm(points[:, None] - sampled, axis=2).min(axis=1)
    away = np.linalg.norm(found - points, axis=1)
    assert (away <= nearest + 1e-12).all()
    assert (nearest - away).max() < 0.2


def test_the_middle_of_a_bowl_is_far_from_it_without_looking_at_all_of_its_triangles():
    line = np.linspace(-11.8, 11.8, 160)
    bowl = fp.height_surface(-np.sqrt(12.0**2 - np.minimum(line**2 + line[:, None] ** 2, 140.0)), 0.1484)
    middle = bowl.vertices_mm[:, 1].min() + 12.0
    points = np.random.default_rng(1).uniform(-0.3, 0.3, (5000, 3)) + np.array([0.0, middle, 0.0])
    bowl.gap(points[:1])
    began = time.process_time()
    gap = bowl.gap(points)[0]
    assert time.process_time() - began < 3.0  # all triangles of all points take 8 s
    assert np.abs(gap - 12.0).max() < 0.6
    below = points - [0.0, 10.5, 0.0]
    there = np.linalg.norm(below - [0.0, middle, 0.0], axis=1)
    np.testing.assert_allclose(bowl.gap(below)[0], 12.0 - there, rtol=0, atol=2e-3)


def test_the_normal_in_a_hollow_is_the_gradient_of_the_gap_and_does_not_jump():
    hollow, generator = cup(3.0), np.random.default_rng(6)
    points = generator.uniform([-2.5, 0.0, -2.5], [2.5, 0.0, 2.5], (400, 3))
    points[:, 1] = hollow.front(points) + generator.uniform(-0.02, 0.02, 400)
    slope, normal = slope_of(hollow, points), hollow.gap(points)[1]
    np.testing.assert_allclose(np.linalg.norm(slope, axis=1), 1.0, rtol=0, atol=1e-3)
    slope /= np.linalg.norm(slope, axis=1)[:, None]
    np.testing.assert_allclose(normal, slope, rtol=0, atol=1e-6)
    way = np.linspace([-2.0, 0.0, 0.37], [2.0, 0.0, 0.9], 40_001)
    way[:, 1] = hollow.front(way)
    jump = {
        below: np.abs(np.diff(cup(3.0, smooth_below_deg=below).gap(way)[1], axis=0)).max()
        for below in (0.0, 30.0)
    }
    assert jump[30.0] < 5e-5 < 5e-3 < jump[0.0]


@dataclass(frozen=True)
class Trough(fp.Indenter):
    """A parabolic valley along the finger; its gap is a distance at the face."""

    symmetry_deg = 180.0
    radius_mm: float = 9.0

    def gap(self, points_mm):
        _, y, z = points_mm.T
        slope = z / self.radius_mm
        length = np.sqrt(1.0 + slope**2)
        gap = (y - 0.5 * slope * z) / length
        normal = np.column_stack(
            [0.0 * z, 1.0 / length, -slope / length - gap * slope / length**2 / self.radius_mm]
        )
        return gap, normal / np.linalg.norm(normal, axis=1)[:, None]


def test_skin_in_a_trough_of_triangles_is_pressed_as_in_the_smooth_one():
    """Newton's method takes 16 steps; 34 where the normal jumps at the creases."""
    touch = fp.touch_of(
        fp.Fingertip(), Trough(), fp.RampAndHold(depth_mm=1.2), settings=fp.PressSettings(2, 1),
        grading=resolution_grading("quick", 17.37),
    )  # fmt: skip
    heights = np.tile((np.linspace(-12.0, 12.0, 241) ** 2 / 18.0)[:, None], (1, 401))
    exact, found = touch.solve(), replace(touch, indenter=fp.height_surface(heights, 0.1)).solve()
    assert found.newton_steps <= 25
    np.testing.assert_allclose(found.force_mn, exact.force_mn, rtol=0, atol=5e-3 * exact.force_mn.max())
    np.testing.assert_allclose(found.sed_kpa, exact.sed_kpa, rtol=0, atol=0.02 * exact.sed_kpa.max())


def test_only_hollow_creases_below_the_angle_are_rounded():
    """A valley of 20 degrees is filled by microns within 0.1 mm; one of 40 and a ridge of 20 stay."""
    beside = np.column_stack([np.linspace(-0.3, 0.3, 61), np.zeros(61), np.zeros(61)])
    for angle, filled in ((20.0, True), (40.0, False), (-20.0, False)):
        x = np.array([-3.0, 0.0, 3.0])
        side = np.tan(np.radians(angle / 2)) * 3.0
        vertices = np.array([[a, side * abs(a) / 3.0, z] for a in x for z in (-5.0, 5.0)])
        faces = np.array([[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]])
        bent, flat = (Surface(vertices, faces, below).front(beside) for below in (30.0, 0.0))
        rise = bent - flat
        np.testing.assert_allclose(rise[np.abs(beside[:, 0]) > 0.11], 0.0, rtol=0, atol=1e-8)
        assert rise.min() > -1e-8
        assert 5e-3 < rise.max() < 7e-3 if filled else rise.max() < 1e-8


def profile_surface(body, fillet_mm, step_deg, path):
    """Face of a body that is the same all along z, every few degrees of its edges, from a file."""
    flat = np.linspace(-4.0, 4.0, 33)
    round_mm = fillet_mm * (1 - np.cos(np.radians(np.arange(0.0, 90.1, step_deg))))
    edges = [
        ridge + side * (width / 2 - round_mm) for ridge, width in RIDGES[type(body)] for side in (-1.0, 1.0)
    ]
    x = np.unique(np.concatenate([flat, *edges, *(edge + np.sign(edge) * 1e-6 for edge in edges)]).round(9))
    y = np.maximum(body.front(np.column_stack([x, 0 * x, 0 * x])), -1.0)
    ends = [np.column_stack([x, np.full(x.size, z), -y]) for z in (-8.0, 8.0)]
    near = np.arange(x.size - 1)
    far = near + x.size
    faces = np.concatenate(
        [np.column_stack([near, far, far + 1]), np.column_stack([near, far + 1, near + 1])]
    )
    trimesh.Trimesh(np.concatenate(ends), faces, process=False).export(path)
    return fp.read_surface(path, up="-z")


GRATING = ridges([-2.5, 0.0, 2.5], [1.5, 1.5, 1.5], fillet_mm=0.2)
RIDGES = {fp.Bar: ((0.0, 3.0),), fp.bodies.Union: ((-2.5, 1.5), (0.0, 1.5), (2.5, 1.5))}


@pytest.mark.parametrize(
    ("body", "size_mm"),
    [(fp.Sphere(curvature_per_m=287.0), 0.3), (fp.Bar(), 0.27), (GRATING, 0.3)],
    ids=["sphere", "bar", "grating"],
)
def test_a_body_from_triangles_presses_as_its_analytic_twin(body, size_mm, tmp_path):
    """Triangles of a file and of a map: force within 0.5 %, SED within 2 % of its peak.

    No row of nodes stands on an edge: there the last µm of the shape decide which nodes touch.
    """
    if isinstance(body, fp.Sphere):
        path = tmp_path / "a.stl"
        trimesh.creation.icosphere(subdivisions=5, radius=body.radius_mm).export(path)
        from_file = fp.read_surface(path)
    else:
        fillet_mm = body.fillet_mm if isinstance(body, fp.Bar) else 0.2
        from_file = profile_surface(body, fillet_mm, 3.0, tmp_path / "a.ply")
    touch = fp.touch_of(
        fp.Fingertip(), body, fp.RampAndHold(depth_mm=0.6), settings=fp.PressSettings(2, 1),
        grading=replace(COARSE, full=True, size_x_mm=size_mm, size_z_mm=0.6),
    )  # fmt: skip
    exact = touch.solve()
    for surface in (from_file, fp.height_surface(map_of(body, 3.4, 0.05), 0.05)):
        twin = replace(touch, indenter=surface).solve()
        np.testing.assert_allclose(twin.force_mn, exact.force_mn, rtol=0, atol=5e-3 * exact.force_mn.max())
        np.testing.assert_allclose(twin.sed_kpa, exact.sed_kpa, rtol=0, atol=0.02 * exact.sed_kpa.max())


@pytest.mark.parametrize("radius_mm", [0.1, 0.6])
@pytest.mark.parametrize("kind", ["surface", "map", "union"])
def test_rounded_edges_are_those_of_the_analytic_bar(radius_mm, kind):
    """Sharp bars of triangles, of heights and of parts, against the bar with fillets: gap to rounding errors.

    Walls of a map lean by its pitch, so that one with a fine pitch near the edges is taken.
    """
    if kind == "surface":
        body = Surface(CUBE * [1.5, 2.0, 10.0], SIDES, edge_radius_mm=radius_mm)
    elif kind == "union":
        halves = fp.Bar(2.5, 0.0), fp.Bar(2.5, 0.0)
        body = fp.bodies.Union(halves, [(-0.25, 0.0, 0.0), (0.25, 0.0, 0.0)], edge_radius_mm=radius_mm)
    else:
        heights = np.where(np.abs(np.arange(-2.0, 2.0005, 0.001)) < 1.5, 0.0, -4.0) * np.ones((2, 1))
        wide = fp.height_surface(heights, 0.001)
        body = Surface(wide.vertices_mm * [1.0, 1.0, 2e4], wide.faces, edge_radius_mm=radius_mm)
    points = np.random.default_rng(2).uniform([-2.2, -1.5, -6.0], [2.2, 0.8, 6.0], (3000, 3))
    gap, normal = fp.Bar(3.0, radius_mm).gap(points)
    near = (gap > -radius_mm) & (gap < 0.7)
    found = body.gap(points[near])
    exact = 1e-3 if kind == "map" else 1e-11
    np.testing.assert_allclose(found[0], gap[near], rtol=0, atol=exact)
    if kind != "map":
        np.testing.assert_allclose(found[1], normal[near], rtol=0, atol=1e-9)


def test_corners_are_rounded_as_a_ball_and_hollows_stay():
    cube = Surface(CUBE, SIDES, edge_radius_mm=0.4)
    points = np.random.default_rng(3).uniform([-1.6, -2.6, -2.1], [1.6, 0.6, 2.1], (4000, 3))
    core = points - np.clip(points, [-0.6, -1.6, -1.1], [0.6, -0.4, 1.1])
    exact = np.linalg.norm(core, axis=1) - 0.4
    outside = exact > -0.4 + 1e-9
    np.testing.assert_allclose(cube.gap(points[outside])[0], exact[outside], rtol=0, atol=1e-11)
    check_gap(cube.gap, "cube")
    steps = ridges([-1.0, 1.0], [1.0, 1.0], fillet_mm=0.0, height_mm=0.5)
    round_ones = replace(steps, edge_radius_mm=0.2)
    foot, top = np.array([[-0.45, -0.47, 0.0]]), np.array([[-0.5, 0.0, 0.0]])
    assert round_ones.gap(foot)[0] == steps.gap(foot)[0]
    assert round_ones.gap(top)[0] == pytest.approx(0.2 * (np.sqrt(2.0) - 1.0), abs=1e-12)


FINER = replace(COARSE, full=True, size_x_mm=0.6, size_z_mm=0.6)


def test_the_content_of_a_surface_is_its_key():
    same, other = CUBE.copy(), CUBE.copy()
    other[3, 0] = np.nextafter(other[3, 0], 9.0)
    keys = [
        touch_key(fp.touch_of(fp.Fingertip(), Surface(vertices, SIDES), grading=FINER))
        for vertices in (CUBE, same, other)
    ]
    assert keys[0] == keys[1] != keys[2]


def test_fine_relief_asks_for_a_mesh_that_resolves_it():
    rippled = fp.height_surface(map_of(fp.Grating(ridge_mm=0.8, groove_mm=0.8, lip_mm=0.1), 2.4, 0.05), 0.05)
    grading = grading_below(fp.Fingertip(), rippled, "quick", (17.37, 0.0), fp.RampAndHold(depth_mm=0.5))
    assert grading.finest_x_mm <= 0.8 / 4
    with pytest.raises(fp.InputError, match="grading must have elements of at most"):
        fp.touch_of(fp.Fingertip(), rippled, grading=replace(COARSE, full=True))


def test_two_balls_are_meshed_for_what_touches_and_not_for_the_seam():
    """They needed 700,000 to 980,000 nodes: between them their gap becomes as narrow as one likes."""
    at = [(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)]
    pair = fp.bodies.Union([fp.Sphere(radius_mm=2.0), fp.Sphere(radius_mm=2.0)], at)
    from_file = fp.height_surface(map_of(pair, 4.0, 0.1), 0.1)
    for body in (pair, from_file):
        assert len(fp.touch_of(fp.Fingertip(), body).mesh.nodes_mm) < 30_000


def _together(*parts):
    """Vertices and faces of parts, each a box of these low and high corners, its sides turned or left out."""
    vertices, faces = [], []
    for low, high, sides in parts:
        faces.append(np.asarray(sides) + 8 * len(vertices))
        vertices.append(np.where(CUBE > [0.0, -1.0, 0.0], high, low))
    return np.concatenate(vertices), np.concatenate(faces)


def _shaken(by_mm):
    """Every triangle of the block with corners of its own, moved at random."""
    corners = CUBE[SIDES].reshape(-1, 3)
    return corners + np.random.default_rng(7).uniform(-by_mm, by_mm, (36, 3)), np.arange(36).reshape(12, 3)


LOW, HIGH = [-1.0, -2.0, -1.5], [1.0, 0.0, 1.5]
TOP, BOTTOM = [6, 7], [4, 5]


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        (_shaken(0.0), ""),
        (_shaken(1e-6), "vertices joined within 0.01 mm, moved by up to"),
        ((CUBE, SIDES[:, ::-1]), "normals pointed inwards, turned: 1"),
        (_together((LOW, [-5e-5, 0, 1.5], SIDES), ([5e-5, -2, -1.5], HIGH, SIDES)),
         "triangles of walls between parts, left out: 4"),
        (_together((LOW, [0.3, 0, 1.5], SIDES), ([-0.3, -2, -1.5], HIGH, SIDES)), ""),
        (_together((LOW, HIGH, SIDES), ([-0.5] * 3, [0.5, -0.2, 0.5], SIDES)), ""),
        (_together((LOW, HIGH, SIDES), ([-0.5] * 3, [0.5, -0.2, 0.5], SIDES[:, ::-1])), "turned: 1"),
    ],
    ids=["soup", "shaken", "inwards", "halves", "overlap", "nested", "cavity"],
)  # fmt: skip
def test_parts_of_a_block_are_one_block_and_what_was_done_is_told(parts, told, caplog):
    points = np.random.default_rng(1).uniform(-3.0, 1.5, (2000, 3))
    gap, expected = Surface(*parts).gap(points)[0], Surface(CUBE, SIDES).gap(points)[0]
    # Within a body of parts that overlap the gap is that of the deepest one.
    shallow = expected > -0.25
    np.testing.assert_allclose(gap[shallow], expected[shallow], rtol=0, atol=3e-6)
    assert ((gap < 0.0) == (expected < 0.0))[np.abs(expected) > 1e-5].all()
    assert (told in caplog.text and told in repr(Surface(*parts))) if told else not caplog.text


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
@pytest.mark.parametrize("side", [TOP, BOTTOM], ids=["top", "bottom"])
def test_an_open_box_is_refused_where_its_opening_faces_the_skin(side, turned):
    faces = np.delete(SIDES, side, axis=0)
    faces = faces[:, ::-1] if turned else faces
    box = CUBE, faces
    if side == BOTTOM and not turned:
        assert Surface(*box).front(np.zeros((1, 3))) == pytest.approx(0.0, abs=1e-9)
    else:
        with pytest.raises(fp.InputError, match="is open there or its sides are reversed"):
            Surface(*box)


SHUT_AT_2 = _together((LOW, [-5e-5, 0, 1.5], SIDES), ([5e-5, -1.5, -1.5], HIGH, SIDES))
NEAR_WALLS = _together((LOW, [-5e-5, 0, 1.5], SIDES), ([5e-5, -1, -0.5], [1, 1, 2.5], SIDES))
FACING_AWAY = CUBE[:3] * [1, 0, 1] + [[0, 0, 0], [0, 0, 3], [3, 0, 0]]
TOO_ROUND = "edge_radius_mm must not exceed half of the narrowest part"


test_a_surface_that_cannot_be_pressed_is_refused_in_one_sentence = refusals(
    (lambda: Surface(CUBE * [0.3, 1.0, 1.0], SIDES, edge_radius_mm=0.5), TOO_ROUND),
    (lambda: fp.bodies.Union([fp.Bar(0.5, 0.0), fp.Plate()], [(0, 0, 0), (0, -1, 0)], edge_radius_mm=0.3),
     TOO_ROUND),
    (lambda: Surface(*SHUT_AT_2), "must overlap or stand apart by more than 0.01 mm"),
    (lambda: Surface(*NEAR_WALLS), "walls of two are 0.0001 mm apart"),
    (lambda: Surface(CUBE * np.nan, SIDES), "finite numbers"),
    (lambda: Surface(CUBE, np.zeros((0, 3), int)), "at least one triangle"),
    (lambda: Surface(CUBE * [1.0, 0.0, 0.0], SIDES), "triangles with an area"),
    (lambda: Surface(CUBE * 1e-4, SIDES), "check the unit"),
    (lambda: Surface(CUBE * 1e4, SIDES), "check the unit"),
    (lambda: Surface(CUBE, SIDES + 1), "numbers of vertices, 0 to 7"),
    (lambda: Surface(FACING_AWAY, np.array([[0, 2, 1]])), "outer side"),
    (lambda: fp.height_surface(np.zeros((1500, 1500)), 0.01),
     f"heights_mm must have at most {MOST_HEIGHTS:,} heights"),
)  # fmt: skip


@pytest.mark.parametrize("ending", ["stl", "obj", "ply"])
def test_a_file_is_read_in_its_unit_and_turned_to_the_skin(tmp_path, ending):
    path = tmp_path / f"block.{ending}"
    upright = trimesh.Trimesh(CUBE[:, [0, 2, 1]] * [0.1, -0.1, 0.1], SIDES, process=False)
    upright.export(path)
    read = fp.read_surface(path, unit="cm", up="+z", at_mm=(0.5, 0.0))
    np.testing.assert_allclose(read.vertices_mm.min(axis=0), [-0.5, -2.0, -1.5], atol=1e-6)
    np.testing.assert_allclose(read.vertices_mm.max(axis=0), [1.5, 0.0, 1.5], atol=1e-6)
    assert len(read.vertices_mm) == 8
    assert read.front(np.array([[0.5, 0.0, 0.2]])) == pytest.approx(0.0, abs=1e-3)


def test_every_kind_of_file_holds_the_same_triangles(tmp_path):
    """Quads, negative numbers, both orders of bytes, and materials whose file would never end."""
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    upright = CUBE[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    rows = "".join(f"v {x} {y} {z}\n" for x, y, z in upright)
    os.mkfifo(tmp_path / "endless.mtl")
    named = "".join("f " + " ".join(f"{k - 8}//1" for k in quad) + "\n" for quad in quads)
    (tmp_path / "a.obj").write_text("\ufeffmtllib endless.mtl\n" + rows + "usemtl x\n" + named, "utf-8")
    head = (
        "ply\r\nformat binary_{} 1.0\r\ncomment TextureFile endless.mtl\r\nelement face 6\r\nproperty list "
        "uchar uint vertex_index\r\nelement vertex 8\r\nproperty double x\r\nproperty double y\r\nproperty "
        "double z\r\nproperty uchar red\r\nend_header\r\n"
    )
    for name, order in (("little_endian", "<"), ("big_endian", ">")):
        body = b"".join(struct.pack(f"{order}B4I", 4, *quad) for quad in quads)
        body += b"".join(struct.pack(f"{order}3dB", *corner, 7) for corner in upright)
        (tmp_path / f"{name}.ply").write_bytes(head.format(name).encode() + body)
    expected = Surface(CUBE, SIDES)
    points = np.random.default_rng(1).uniform(-3.0, 3.0, (50, 3))
    for name in ("a.obj", "little_endian.ply", "big_endian.ply"):
        read = fp.read_surface(tmp_path / name)
        assert len(read.faces) == 12
        np.testing.assert_allclose(read.gap(points)[0], expected.gap(points)[0], rtol=0, atol=1e-12)
    (tmp_path / "pipe.stl").symlink_to(tmp_path / "endless.mtl")
    with pytest.raises(fp.InputError, match="it is a device or a pipe"):
        fp.read_surface(tmp_path / "pipe.stl")


def test_height_maps_of_all_formats_agree(tmp_path):
    heights = np.rint(map_of(fp.Bar(1.6, 0.3), 1.5, 0.1, -1.0) * 255) / 255 + 1.0
    Image.fromarray((heights * 255).astype(np.uint8)).save(tmp_path / "a.png")
    np.save(tmp_path / "a.npy", heights)
    np.savetxt(tmp_path / "a.csv", heights, delimiter=",")
    png, npy, csv = (
        fp.read_height_map(tmp_path / f"a.{end}", 0.1, 0.5).vertices_mm for end in ("png", "npy", "csv")
    )
    np.testing.assert_allclose(png, npy, rtol=0, atol=1e-6)
    np.testing.assert_allclose(csv, npy, rtol=0, atol=1e-6)
    assert np.ptp(png[:, 1]) == pytest.approx(0.5)


def test_shades_of_every_depth_are_shares_of_white_and_signed_numbers_are_numbers(tmp_path):
    """The heights of one image in each format that a TIFF or PNG stores, against the array itself."""
    share = np.outer(np.hanning(9), np.hanning(7))
    grey = np.rint(share * 65535).astype(np.uint16)
    whole = np.rint(share * 900 - 450).astype(np.int16)
    kinds = {
        "grey.png": (grey, {}, grey / 65535.0),
        "grey.tif": (grey, {}, grey / 65535.0),
        "white-is-zero.tif": (65535 - grey, {"tiffinfo": {262: 0}}, grey / 65535.0),
        "packed.tif": (65535 - grey, {"tiffinfo": {262: 0}, "compression": "tiff_deflate"}, grey / 65535.0),
        "byte.tif": ((grey >> 8).astype(np.uint8), {}, (grey >> 8) / 255.0),
        # Pillow turns shades of a byte when it writes white as zero.
        "white-is-zero-byte.tif": ((grey >> 8).astype(np.uint8), {"tiffinfo": {262: 0}}, (grey >> 8) / 255.0),
        "signed.tif": (whole.view(np.uint16), {"tiffinfo": {339: 2}}, whole),
        "long.tif": (whole.astype(np.int32) * 1000, {}, whole * 1000.0),
        "float.tif": (share.astype(np.float32), {}, share),
    }  # fmt: skip
    for name, (pixels, options, heights) in kinds.items():
        Image.fromarray(pixels).save(tmp_path / name, **options)
        read = fp.read_height_map(tmp_path / name, 0.5, 1e-3)
        expected = fp.height_surface(np.float64(heights) * 1e-3, 0.5)
        np.testing.assert_allclose(read.vertices_mm, expected.vertices_mm, rtol=0, atol=1e-9, err_msg=name)


RIDGE_ROW = ridges([-2.0, 0.0, 1.4], [1.0, 0.6, 0.8])
BALL_IN_A_PLATE = fp.bodies.Union(
    [fp.Sphere(curvature_per_m=1000.0), fp.Plate()], [(0.2, 0.0, 0.0), (0.0, -0.6, 0.0)], seam_mm=0.4
)


@pytest.mark.parametrize("body", [RIDGE_ROW, BALL_IN_A_PLATE], ids=["ridges", "seam"])
def test_the_normal_of_a_composed_body_is_the_gradient_of_its_gap(body):
    check_gap(body.gap, type(body).__name__)
    points = np.random.default_rng(4).uniform([-3, -0.4, -3], [3, 0.6, 3], (300, 3))
    if body is BALL_IN_A_PLATE:  # its gap is a distance on the face alone
        points[:, 1] = body.front(points)
    slope, normal = slope_of(body, points), body.gap(points)[1]
    assert (np.abs(slope - normal).max(axis=1) < 1e-4).mean() > 0.98


def test_ridges_at_equal_distances_are_the_grating():
    even = ridges(np.arange(-8, 9) * 2.0, np.ones(17), fillet_mm=0.1, height_mm=3.0)
    points = np.random.default_rng(5).uniform([-4, -1.0, -4], [4, 0.5, 4], (200, 3))
    np.testing.assert_allclose(even.gap(points)[0], fp.Grating(1.0, 1.0, 0.1).gap(points)[0], atol=1e-12)
