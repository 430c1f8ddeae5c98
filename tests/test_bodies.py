"""New primitives and combinators: distances to densely drawn surfaces, gradients, symmetry, one press."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import fingerpad as fp
from fingerpad.experiments.requests.stimulus import indenter_named, object_of
from fingerpad.experiments.requests.touch import TouchRequest
from fingerpad.geometry.bodies import (
    Bar,
    Box,
    Capsule,
    Cone,
    Cylinder,
    Difference,
    Dots,
    Edge,
    Extruded,
    FlatPunch,
    Grating,
    Intersection,
    Offset,
    Pattern,
    Plate,
    Revolved,
    Sphere,
    Torus,
    Transformed,
    Union,
)
from fingerpad.geometry.probing import check_gap
from refusals import refusals

SPACING_MM = 0.012
ALONG, UP, ACROSS = np.eye(3)


def grid(*ends):
    """Two parameters on a grid, from the ends of each and its length in space."""
    lines = [np.linspace(low, high, int(np.ceil(length / SPACING_MM)) + 1) for low, high, length in ends]
    return [each.ravel() for each in np.meshgrid(*lines, indexing="ij")]


def ball(radius, centre=(0.0, 0.0, 0.0)):
    turn, height = grid((0, 2 * np.pi, 2 * np.pi * radius), (0, np.pi, np.pi * radius))
    unit = [np.sin(height) * np.cos(turn), np.cos(height), np.sin(height) * np.sin(turn)]
    return radius * np.stack(unit, axis=1) + centre


def turned(section):
    """Points of a section (n, 2), right of the axis, turned about it."""
    angle = np.linspace(0.0, 2 * np.pi, int(2 * np.pi * section[:, 0].max() / SPACING_MM))[:, None]
    u, y = section.T
    around = [u * np.cos(angle), np.broadcast_to(y, (len(angle), len(u))), u * np.sin(angle)]
    return np.stack(around, axis=-1).reshape(-1, 3)


def line(start, end):
    length = np.linalg.norm(np.subtract(end, start))
    return np.linspace(start, end, int(length / SPACING_MM) + 2)


def arc(centre, radius, first=0.0, last=2 * np.pi):
    angle = np.linspace(first, last, int(np.ceil((last - first) * radius / SPACING_MM)) + 2)
    return centre + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def side(half, fillet, depth):
    """From the middle of a flat face round its edge and down the wall, right of the axis."""
    flat, wall = line((0.0, 0.0), (half - fillet, 0.0)), line((half, -fillet), (half, -depth))
    return np.concatenate([flat, arc((half - fillet, -fillet), fillet, 0.0, np.pi / 2), wall])


def block(width, height, length, fillet):
    """Closed block with rounded edges, its face at y = 0: six faces, moved out of a smaller block."""
    core = np.array([width, height, length]) / 2 - fillet
    found = []
    for axis in range(3):
        beside = [other for other in range(3) if other != axis]
        ends = [(-core[other] - fillet, core[other] + fillet, 2 * (core[other] + fillet)) for other in beside]
        for sign in (-1.0, 1.0):
            at = np.zeros((len(grid(*ends)[0]), 3))
            at[:, beside] = np.stack(grid(*ends), axis=1)
            at[:, axis] = sign * (core[axis] + fillet)
            inner = np.clip(at, -core, core)
            away = at - inner
            found.append(inner + fillet * away / np.maximum(np.linalg.norm(away, axis=1), 1e-300)[:, None])
    return np.concatenate(found) - [0.0, height / 2, 0.0]


def swept(section, length):
    """Section (n, 2) of x and y, swept along z, with both ends filled by chords from its middle line."""
    z = np.linspace(-length / 2, length / 2, int(length / SPACING_MM) + 1)
    walls = [np.column_stack([section, np.full(len(section), at)]) for at in z]
    inner = np.concatenate([section * [share, 1.0] for share in np.linspace(0.0, 1.0, 150)])
    ends = [np.column_stack([inner, np.full(len(inner), at)]) for at in z[[0, -1]]]
    return np.concatenate([*walls, *ends])


FLANK = np.radians(35.0)
TIP = arc((0.0, -0.4), 0.4, FLANK, np.pi / 2)
CONE = turned(np.concatenate([TIP, line(TIP[0], TIP[0] + 6.0 * np.array([np.sin(FLANK), -np.cos(FLANK)]))]))
MIDDLE = arc((0.0, -0.5), 0.5)
ENDS = ball(0.5)
CAPSULE = np.concatenate(
    [ENDS + np.sign(ENDS[:, 2:]) * ACROSS - 0.5 * UP]
    + [np.column_stack([MIDDLE, np.full(len(MIDDLE), z)]) for z in np.linspace(-1.0, 1.0, 170)]
)
LEANING = Rotation.from_matrix(
    # About z from x to y, of about y from x to z, of about x from y to z.
    Rotation.from_rotvec([0, 0, 0.5]).as_matrix()
    @ Rotation.from_rotvec([0, -0.7, 0]).as_matrix()
    @ Rotation.from_rotvec([0.3, 0, 0]).as_matrix()
)
DEGREES = np.degrees(1.0)

EXACT = {
    "box": (Box(2.0, 3.0, 0.3, height_mm=1.6), block(2.0, 1.6, 3.0, 0.3)),
    "sharp box": (Box(1.0, 2.0, 0.0, height_mm=1.5), block(1.0, 1.5, 2.0, 0.0)),
    "capsule": (Capsule(1.0, 3.0), CAPSULE),
    "torus": (Torus(3.0, 0.8), turned(arc((1.5, -0.4), 0.4))),
    "cone": (Cone(2 * np.degrees(FLANK), 0.4), CONE),
    "offset": (Offset(Box(1.0, 2.0, 0.0, height_mm=1.0), 0.3), block(1.6, 1.6, 2.6, 0.3)),
    "revolved": (Revolved(Sphere(radius_mm=0.5), radius_mm=1.2), turned(arc((1.2, -0.5), 0.5))),
    "punch": (Revolved(Bar(2.0, 0.3)), turned(side(1.0, 0.3, 6.0))),
    "extruded": (
        Extruded(Sphere(radius_mm=0.6), length_mm=2.0),
        swept(arc((0.0, -0.6), 0.6), 2.0),
    ),
    "along": (
        Extruded(Cylinder(1.2), length_mm=2.0, along_finger=True),
        swept(arc((0.0, -0.6), 0.6), 2.0)[:, [2, 1, 0]],
    ),
    "pattern": (
        Pattern(Sphere(radius_mm=0.4), pitch_x_mm=1.0, pitch_z_mm=1.4, count_x=3, count_z=2),
        np.concatenate([ball(0.4, (x, -0.4, z)) for x in (-1.0, 0.0, 1.0) for z in (-0.7, 0.7)]),
    ),
    "union": (
        Union([Sphere(radius_mm=0.5), Torus(2.0, 0.4)]),
        np.concatenate([ball(0.5, (0.0, -0.5, 0.0)), turned(arc((1.0, -0.2), 0.2))]),
    ),
    "transformed": (
        Transformed(Capsule(1.0, 3.0), (0.2, -0.3, 0.1), DEGREES * np.array([0.3, 0.7, 0.5]), "x", 1.3),
        np.array([0.2, -0.3, 0.1]) + LEANING.apply(1.3 * CAPSULE * [-1.0, 1.0, 1.0]),
    ),
}  # fmt: skip
"""Bodies whose closed gap is the distance outside, with points on all of their surface."""

LENS = Intersection([Transformed(Sphere(radius_mm=1.0), (x, 0.0, 0.0)) for x in (-0.6, 0.6)])
DIMPLE = Difference(Plate(), Transformed(Sphere(radius_mm=2.0), (0.0, 3.0, 0.0)))
FLOOR = np.insert(np.stack(grid((-4, 4, 8), (-4, 4, 8)), axis=1), 1, 0.0, axis=1)
BOUNDS = {
    "lens": (LENS, np.concatenate([ball(1.0, (x, -1.0, 0.0)) for x in (-0.6, 0.6)])),
    "dimple": (
        DIMPLE,
        np.concatenate([ball(2.0, (0.0, 1.0, 0.0)), FLOOR]),
    ),
}  # fmt: skip
"""Bodies whose closed gap is the distance inside and less outside; points on and beside the surface."""


def points_about(n=600, seed=0):
    return np.random.default_rng(seed).uniform([-2.5, -2.2, -2.5], [2.5, 0.8, 2.5], (n, 3))


@pytest.mark.parametrize("name", EXACT)
def test_gap_is_the_distance_to_the_nearest_of_many_points_of_the_surface(name):
    body, surface = EXACT[name]
    np.testing.assert_allclose(body.closed_gap(surface)[0], 0.0, atol=1e-9)
    points = points_about()
    gap, drawn = body.closed_gap(points)[0], cKDTree(surface).query(points)[0]
    outside = gap > 0.05
    assert outside.sum() > 200
    # A drawn distance d is never too small, and h^2 / 2d too large at a point h beside the foot.
    assert (drawn[outside] - gap[outside]).min() > -1e-9
    assert (drawn[outside] - gap[outside]).max() < SPACING_MM**2 / 2 / 0.05
    assert (gap[gap < 0.0] >= -drawn[gap < 0.0] - 1e-9).all()  # inside it is at most as deep as it is


@pytest.mark.parametrize("name", BOUNDS)
def test_gap_of_an_intersection_and_a_difference_is_exact_inside_and_at_most_the_distance_outside(name):
    body, drawn = BOUNDS[name]
    surface = drawn[np.abs(body.closed_gap(drawn)[0]) < 1e-9]
    assert 0.1 < len(surface) / len(drawn) < 0.9
    points = points_about(6000, seed=1)
    gap, distance = body.closed_gap(points)[0], cKDTree(surface).query(points)[0]
    assert (gap <= distance + 1e-9).all()
    deep = gap < -0.05
    assert deep.sum() > 20
    np.testing.assert_allclose(-gap[deep], distance[deep], rtol=0, atol=SPACING_MM**2 / 2 / 0.05)
    assert (distance - gap)[gap > 0.05].max() > 0.05  # beside edges it is less


ALL = {name: body for name, (body, _) in (EXACT | BOUNDS).items()} | {
    "seam": Union([Sphere(radius_mm=1.0), Plate()], [(0, 0, 0), (0, -0.6, 0)], seam_mm=0.4),
    "ridge": Extruded(Cone(90.0, 0.2), along_finger=True),
    "ring": Revolved(Bar(1.0, 0.2), 2.0),
    "endless": Pattern(Bar(0.8, 0.1), pitch_x_mm=1.5),
}


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("closed", [False, True])
def test_normal_is_the_slope_of_the_gap_and_of_unit_length(name, closed):
    body, points, step = ALL[name], points_about(2000, 2), 1e-6
    gap_of = body.closed_gap if closed else body.gap
    here, normal = gap_of(points)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-14)
    ahead, behind = (
        np.stack([gap_of(points + way)[0] for way in sign * step * np.eye(3)], 1) for sign in (1, -1)
    )
    smooth = np.abs(ahead + behind - 2 * here[:, None]).max(axis=1) < 1e-9
    if name == "seam":  # in a seam a gap is a distance at the face only
        smooth &= np.abs(here) < 0.02
    assert smooth.sum() > 10
    tolerance = 0.02 if name == "seam" else 1e-6
    np.testing.assert_allclose(
        normal[smooth], ((ahead - behind) / (2 * step))[smooth], rtol=0, atol=tolerance
    )


@pytest.mark.parametrize("name", ALL)
def test_a_body_keeps_the_contract_of_a_user_and_its_mirror_image(name):
    body = ALL[name]
    check_gap(body.gap, name)
    points = points_about(2000, 3)
    for spin_deg, axes in ((0.0, np.eye(3)), (90.0, np.array([-ACROSS, UP, ALONG]))):
        here, there = (body.gap(at @ axes)[0] for at in (points, points * [1.0, 1.0, -1.0]))
        assert np.allclose(here, there, atol=1e-9) == body.mirrors(spin_deg)
    assert body.mirrors(0.0) == (name != "transformed")


@pytest.mark.parametrize(
    "body", [Capsule(1.0, 3.0), Torus(3.0, 1.0), Box(2.0, 3.0, 0.2, 3.0), Extruded(Sphere(radius_mm=0.5))]
)
def test_a_body_goes_on_with_straight_sides_below_its_widest_section_where_it_is_not_closed(body):
    points = points_about() - 3.0 * UP
    gap, normal = body.gap(points)
    np.testing.assert_allclose(gap, body.gap(points - 7.0 * UP)[0])
    assert not normal[gap > 0.0, 1].any()
    above = points * [1.0, 0.0, 1.0] - 0.3 * UP
    np.testing.assert_array_equal(body.gap(above)[0], body.closed_gap(above)[0])
    assert (body.closed_gap(points - 7.0 * UP)[0] > 0.0).all()


def test_bodies_are_what_they_are_made_of():
    points = points_about(4000, 4)
    half, bar = Edge(0.2), Bar(2.0, 0.2)
    for made, known in [
        (Revolved(Bar(2.0, 0.3)), FlatPunch(2.0, 0.3)),
        (Extruded(Sphere(radius_mm=0.7)), Cylinder(1.4)),
        (Extruded(Cylinder(1.4), along_finger=True), Transformed(Cylinder(1.4), turn_deg=(0.0, 90.0, 0.0))),
        (Pattern(Bar(0.8, 0.1), pitch_x_mm=1.5), Grating(0.8, 0.7, 0.1)),
        (Intersection([Transformed(half, (1, 0, 0)), Transformed(half, (-1, 0, 0), mirror="x")]), bar),
        (Transformed(Transformed(Cone(), turn_deg=(0, 0, 40)), turn_deg=(0, 0, -40)), Cone()),
        (Offset(Bar(2.0, 0.1), 0.2), Bar(2.4, 0.3)),
        (Transformed(bar, scale=1.5), Bar(3.0, 0.3)),
    ]:
        for ours, theirs in zip(made.gap(points), known.gap(points), strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12)
    dots = Dots([(0.0, -0.9), (0.0, 0.9)], 1.2, 0.3)
    top = Pattern(Sphere(radius_mm=dots.radius_mm), pitch_z_mm=1.8, count_z=2)
    made = Union([top, Plate()], [(0.0, 0.0, 0.0), (0.0, -0.3, 0.0)])
    np.testing.assert_allclose(made.closed_gap(points)[0], dots.gap(points)[0], rtol=0, atol=1e-12)


def test_one_capsule_is_a_cylinder_in_its_middle_and_files_know_the_new_bodies():
    assert indenter_named("box:2:4:0.3") == Box(2.0, 4.0, 0.3)
    assert indenter_named("capsule:radius_mm=1.5") == Capsule(diameter_mm=3.0)
    assert indenter_named("torus:5:1") == Torus(5.0, 1.0)
    assert indenter_named("cone:60") == Cone(angle_deg=60.0)
    block = {"object": {"kind": "cone", "angle_deg": 60.0, "radius_mm": 0.2}, "motion": {"depth_mm": 0.5}}
    assert object_of(TouchRequest.model_validate(block).object) == Cone(60.0, 0.2)
    grading = fp.Grading(17.37, 2.0, 2.0, 0.5, 0.8, 5.0, 1.3, stratum_corneum=1, dermis=1, subcutis=2)
    rod, endless = (
        fp.indent(fp.Fingertip(), body, fp.RampAndHold(depth_mm=0.4), grading=grading)
        for body in (Capsule(3.17, 30.0), Cylinder(3.17))
    )
    np.testing.assert_allclose(rod.force_mn, endless.force_mn, rtol=1e-6)


def test_bodies_are_values_with_names_of_their_own():
    assert Transformed(Box(), (1, 2, 3)) == Transformed(Box(), (1.0, 2.0, 3.0))
    assert hash(Pattern(Torus(), 7.0)) == hash(Pattern(Torus(), 7.0))
    assert fp.bodies.Union is Union
    assert fp.bodies.ridges([0.0], [1.0]) == Union([Bar(1.0, 0.1), Plate()], [(0, 0, 0), (0, -1, 0)])


test_impossible_bodies_are_refused_in_one_sentence = refusals(
    (lambda: Capsule(3.0, 2.0), "diameter_mm must not exceed length_mm, 2 mm: got 3 mm"),
    (lambda: Torus(1.0, 2.0), "diameter_mm must not exceed ring_mm, 1 mm: got 2 mm"),
    (lambda: Box(2.0, 4.0, 1.5), "fillet_mm must not exceed half of width_mm, 1 mm: got 1.5 mm"),
    (lambda: Box(2.0, 4.0, 0.5, height_mm=0.8), "half of height_mm, 0.4 mm"),
    (lambda: Cone(angle_deg=180.0), "angle_deg must lie within 1 to 179"),
    (lambda: Offset(Box(), -0.1), "radius_mm must not be negative"),
    (lambda: Intersection([]), "parts must have at least one entry"),
    (lambda: Union([]), "A union needs one"),
    (lambda: Pattern(Box(), count_x=3), "pitch_x_mm must be given with count_x"),
    (lambda: Transformed(Box(), mirror="xy"), "mirror must be one of"),
    (lambda: Revolved(Transformed(Box(), (0.0, 0.0, 1.0))), "its own mirror image across z = 0"),
    (lambda: Extruded("bar"), "profile must be of type Indenter"),
)  # fmt: skip
