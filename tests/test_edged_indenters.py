"""Edge, gap and grating against densely drawn sections, and against the bars that they must become."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fingerpad as fp
from fingerpad.export.outline import outline_of
from fingerpad.skin.indentation import Touch
from refusals import refusals

EDGE, GAP, GRATING = fp.Edge(0.3), fp.Gap(1.0, 6.0, 0.4, 0.2), fp.Grating(0.9, 0.7, 0.2)
SHARP = [fp.Edge(0.0), fp.Gap(1.0, 6.0, 0.0, 0.0), fp.Grating(0.9, 0.7, 0.0)]
ROUNDED = [EDGE, GAP, GRATING, fp.Gap(0.2, 6.0, 0.4, 0.3)]
ALONG, UP, ACROSS = np.eye(3)
NAMES = ["edge", "gap", "grating", "narrow gap", "sharp edge", "sharp gap", "sharp grating"]


def points_about(seed=0, n=400):
    return np.random.default_rng(seed).uniform([-4.0, -1.2, -3.0], [4.0, 0.8, 3.0], (n, 3))


def drawn_section(body):
    """Points closer than 1 µm along the face of a body, from corners and arcs that are written down here."""
    turn = np.linspace(0.0, 0.5 * np.pi, 2001)[:, None]

    def flat(start, end):
        count = max(2, int(np.hypot(*np.subtract(end, start)) / 0.001))
        return np.linspace(start, end, count)

    def side(x, outwards, radius):
        """From the end of the flat round the edge and down the wall that stands at x."""
        centre = np.array([x - outwards * radius, -radius])
        arc = centre + radius * np.hstack([outwards * np.sin(turn), np.cos(turn)])
        return [arc, flat((x, -radius), (x, -6.0))]

    def ridge(left, right, left_radius, right_radius):
        top = flat((left + left_radius, 0.0), (right - right_radius, 0.0))
        return [top, *side(left, -1.0, left_radius), *side(right, 1.0, right_radius)]

    if isinstance(body, fp.Edge):
        parts = [flat((-9.0, 0.0), (-body.fillet_mm, 0.0)), *side(0.0, 1.0, body.fillet_mm)]
    elif isinstance(body, fp.Gap):
        half, end = body.gap_mm / 2, body.width_mm / 2
        lip = min(body.lip_mm, half)
        parts = ridge(half, end, lip, body.fillet_mm) + ridge(-end, -half, body.fillet_mm, lip)
    else:
        parts = []
        for n in range(-4, 5):
            middle = n * (body.ridge_mm + body.groove_mm)
            half = body.ridge_mm / 2
            parts += ridge(middle - half, middle + half, body.lip_mm, body.lip_mm)
    return np.concatenate(parts)


@pytest.mark.parametrize("body", ROUNDED + SHARP, ids=NAMES)
def test_gap_is_the_distance_to_the_face_and_negative_behind_it(body):
    points = points_about(n=60)
    section = drawn_section(body)
    gap, _ = body.gap(points)
    distance = np.array([np.hypot(*(section - point).T).min() for point in points[:, :2]])
    # Half a spacing h beside the foot of a point, the drawing is h²/2d too far: 6e-6 mm at d = 0.02 mm.
    far = distance > 0.02
    np.testing.assert_allclose(np.abs(gap[far]), distance[far], rtol=0, atol=1e-5)
    inside = points[:, 1] < body.front(points)
    np.testing.assert_array_equal(gap < 0.0, inside)
    assert 0.1 < inside.mean() < 0.9
    np.testing.assert_array_equal(gap, body.gap(points + 40.0 * ACROSS)[0])  # bodies do not end in z
    line = outline_of(body, reach_mm=6.0).points(lowest_mm=-0.5)
    outline = np.column_stack([line, np.zeros(len(line))])
    on_face = outline[outline[:, 1] > -5.0]  # below it, only the floors that close grooves for a drawing
    np.testing.assert_allclose(body.gap(on_face)[0], 0.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize("body", ROUNDED, ids=NAMES[:4])
@given(seed=st.integers(0, 10_000))
def test_normal_is_the_slope_of_the_gap_and_of_unit_length(body, seed):
    points, step = points_about(seed, 20), 1e-6
    _, normal = body.gap(points)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-14)
    ahead, behind = (
        np.stack([body.gap(points + sign * offset)[0] for offset in step * np.eye(3)]) for sign in (1.0, -1.0)
    )
    here = body.gap(points)[0]
    # Halfway between two faces the slope jumps, and is that of no single one.
    smooth = (np.abs(ahead + behind - 2 * here) < 1e-9).all(axis=0)
    assert smooth.mean() > 0.8
    np.testing.assert_allclose(normal[smooth], ((ahead - behind) / (2 * step)).T[smooth], rtol=0, atol=1e-6)


@pytest.mark.parametrize("body", ROUNDED + SHARP, ids=NAMES)
def test_front_is_where_the_gap_changes_sign_and_nowhere_over_a_groove(body):
    points = points_about(3, 200)
    height = body.front(points)
    over = np.isfinite(height)
    assert 0.2 < over.mean() < 1.0
    face = points[over].copy()
    face[:, 1] = height[over]
    np.testing.assert_allclose(body.gap(face)[0], 0.0, rtol=0, atol=1e-14)
    assert (body.gap(face + 1e-3 * UP)[0] > 0.0).all()
    deep = points[~over] * [1.0, 0.0, 1.0] - 3.0 * UP
    assert (body.gap(deep)[0] > 0.0).all()


test_impossible_bodies_are_refused_in_one_sentence = refusals(
    (lambda: fp.Edge(-0.1), "fillet_mm"),
    (lambda: fp.Gap(-0.5), "gap_mm must"),
    (lambda: fp.Gap(1.0, 0.0), ("width_mm",)),
    (lambda: fp.Gap(1.0, 8.0, 4.5), "half of width_mm, 4 mm: got 4.5 mm"),
    (lambda: fp.Gap(1.0, 8.0, 0.3, -0.1), "lip_mm must"),
    (lambda: fp.Gap(7.5, 8.0), "two flat ridges of the bar, so be below 7 mm: got 7.5 mm"),
    (lambda: fp.Grating(0.0), ("ridge_mm",)),
    (lambda: fp.Grating(1.0, 0.0), ("groove_mm",)),
    (lambda: fp.Grating(1.0, 1.0, 0.6), "half of ridge_mm, 0.5 mm: got 0.6 mm"),
)  # fmt: skip


def pressed(body):
    """A shallow press into a coarse half finger, its lines 0.25 mm apart where the edges are."""
    grading = fp.Grading(
        17.37, 2.5, 1.2, 0.5, 0.8, 5.0, 1.3, stratum_corneum=1, dermis=1, subcutis=2,
        finer_along=((16.17, 18.57, 0.25),),
    )  # fmt: skip
    tissues, motion = fp.named_tissues("trial3"), fp.RampAndHold(depth_mm=0.4)
    return Touch(
        fp.Fingertip(), body, motion, tissues, grading, fp.PressSettings(2, 1), tilt_deg=LEVEL_DEG
    ).solve()


LEVEL_DEG = 7.97
"""Slope of the pad at the point that is pressed. [degrees]"""


@pytest.fixture(scope="module")
def bulges():
    return {gap_mm: pressed(fp.Gap(gap_mm, 5.0)) for gap_mm in (0.0, 1.0, 1.8)}


def test_a_press_with_a_gap_owes_what_every_press_owes(bulges):
    for skin in bulges.values():
        assert skin.force_imbalance <= 1e-4
        assert skin.penetration_mm <= 0.005 * 0.4
        assert (np.diff(skin.force_mn[:3]) > 0.0).all()
    with_bar = pressed(fp.Bar(5.0))
    np.testing.assert_array_equal(bulges[0.0].force_mn, with_bar.force_mn)
    np.testing.assert_array_equal(bulges[0.0].sed_kpa, with_bar.sed_kpa)


def test_skin_rises_into_a_gap_and_energy_gathers_under_the_lips(bulges):
    flat, narrow, wide = (skin.surface_profile() for skin in bulges.values())
    assert flat.at(0.0) > narrow.at(0.0) + 0.02 > wide.at(0.0) + 0.04
    for profile in (narrow, wide):
        np.testing.assert_allclose(profile.at(1.3), flat.at(1.3), rtol=0, atol=0.03)
    flat, wide = (bulges[gap].sed([[17.37, 0.0], [17.37 + 0.9, 0.0]]).values[-1] for gap in (0.0, 1.8))
    assert wide[1] > 1.3 * wide[0]
    assert wide[1] > 1.1 * flat[1]
