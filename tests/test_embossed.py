"""Raised shapes against closed forms: distance, walls, edges, orientation of letters, widths, refusals."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from fingerpad import Bar, Fingertip, FlatPunch, Grading, embossed_text, touch_of
from fingerpad.geometry.embossed import MOST_CORNERS, Embossed, joined_outlines
from fingerpad.geometry.probing import check_gap
from fingerpad.skin.store import touch_key
from refusals import refusals, refused

COARSE = Grading(17.37, 3.0, 3.0, 0.8, 0.8, 6.0, 1.3, 1, 1, 1, 1, full=True)


def rectangle(half_x, half_z, x=0.0, z=0.0):
    return [(x + a * half_x, z + b * half_z) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]


def circle(radius, corners=400, x=0.0):
    angle = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
    return np.column_stack([x + radius * np.cos(angle), radius * np.sin(angle)])


def points_about(count=400, seed=3):
    return np.random.default_rng(seed).uniform([-3.0, -0.6, -3.0], [3.0, 0.6, 3.0], (count, 3))


def is_raised(body, x, z):
    return body.front(np.array([[x, 0.0, z]]))[0] > -0.5 * body.height_mm


def test_a_long_rectangle_is_the_bar_and_a_circle_the_flat_punch():
    ridge, bar, points = Embossed([rectangle(1.5, 40.0)], 4.0, 0.3), Bar(3.0, 0.3), points_about()
    for found, expected, atol in zip(ridge.gap(points), bar.gap(points), (1e-12, 1e-9), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=atol)
    assert ridge.stroke_mm == pytest.approx(3.0)
    disc, punch = Embossed([circle(2.0)], 4.0, 0.3), FlatPunch(4.0, 0.3)
    np.testing.assert_allclose(disc.gap(points)[0], punch.gap(points)[0], rtol=0, atol=1e-4)
    assert disc.stroke_mm == pytest.approx(4.0, rel=1e-3)


def test_an_outline_within_another_is_a_hole():
    ring = Embossed([rectangle(2.0, 2.0), rectangle(1.2, 1.2)], 0.5, 0.1)
    for turned in (ring, replace(ring, outlines_mm=[rectangle(2.0, 2.0), rectangle(1.2, 1.2)[::-1]])):
        assert is_raised(turned, 1.6, 0.0)
        assert not is_raised(turned, 0.0, 0.0)
        assert turned.stroke_mm == pytest.approx(0.8)
    narrow = replace(ring, outlines_mm=[rectangle(2.0, 2.0), rectangle(1.8, 1.8)])
    assert narrow.stroke_mm == pytest.approx(0.2)
    pair = Embossed([rectangle(0.5, 2.0, x=-0.7), rectangle(0.5, 2.0, x=0.7)], 0.5, 0.1)
    assert pair.stroke_mm == pytest.approx(1.0)


@pytest.mark.parametrize("text", ["S", "a8", "i"])
def test_the_normal_is_the_gradient_of_the_gap(text):
    body = embossed_text(text)
    check_gap(body.gap, text)
    points = points_about()
    slope = [(body.gap(points + d)[0] - body.gap(points - d)[0]) / 2e-6 for d in 1e-6 * np.eye(3)]
    differs = np.abs(np.stack(slope, axis=1) - body.gap(points)[1]).max(axis=1) > 1e-4
    assert differs.mean() < 0.02  # only where a crease lies within a step


def test_edges_are_rounded_as_far_as_height_and_stroke_allow():
    letter = embossed_text("I", capital_mm=6.0)  # 1.5 mm wide, 0.5 mm high
    assert letter.rounded_to(0.3).edge_radius_mm == 0.3
    assert letter.rounded_to(0.05) == letter
    assert letter.rounded_to(2.0).edge_radius_mm == letter.height_mm
    ridge = Embossed([rectangle(0.2, 3.0)], 0.5, 0.1)
    assert ridge.rounded_to(0.4).edge_radius_mm == pytest.approx(ridge.stroke_mm / 2)


def test_letters_are_read_by_a_finger_that_points_up():
    across = embossed_text("L")  # as seen from the skin: x up, z to the right
    assert is_raised(across, -2.6, 1.2)
    assert not is_raised(across, 2.6, 1.2)
    assert is_raised(across, 2.6, -1.6)
    along = embossed_text("L", along_finger=True)  # the line runs up: its top lies to the left, at -z
    assert is_raised(along, 1.2, 2.6)
    assert not is_raised(along, 1.2, -2.6)
    assert is_raised(along, -1.6, -2.6)


def test_letters_have_their_strokes_height_and_symmetry():
    for text, stroke in (("H", 1.17), ("i", 1.17), ("n", 1.44)):
        letter = embossed_text(text)
        assert letter.stroke_mm == pytest.approx(stroke, abs=0.01)
    letter = np.concatenate(embossed_text("H", capital_mm=7.0).outlines_mm)
    assert np.ptp(letter[:, 0]) == pytest.approx(7.0)
    np.testing.assert_allclose(letter.min(axis=0), -letter.max(axis=0), atol=1e-8)
    for along, turned_deg in ((False, 0.0), (True, 90.0)):
        letter = embossed_text("U", along_finger=along)
        assert letter.mirrors(turned_deg)
        assert not letter.mirrors(90.0 - turned_deg)


def test_a_mesh_must_resolve_the_strokes():
    letter = embossed_text("i", capital_mm=5.0)
    assert touch_of(Fingertip(), letter).grading.finest_x_mm <= letter.stroke_mm / 4
    with refused("grading"):
        touch_of(Fingertip(), letter, grading=COARSE)


def test_equal_letters_are_one_body():
    one, same, other = embossed_text("ab"), embossed_text("ab"), embossed_text("ba")
    one.gap(points_about(3))
    assert one == same == pickle.loads(pickle.dumps(one))
    assert hash(one) == hash(same)
    assert one != other
    keys = [touch_key(touch_of(Fingertip(), body)) for body in (one, same, other)]
    assert keys[0] == keys[1] != keys[2]


SQUARE = rectangle(1.0, 1.0)


test_outlines_and_text_that_cannot_be_embossed_are_refused = refusals(
    (([], {}), "at least one outline: got none"),
    (([SQUARE[:2]], {}), ("outlines_mm", 0)),
    (([SQUARE, [SQUARE[0], *SQUARE]], {}), ("outlines_mm", 1)),
    (([[(0.0, 0.0), (1.0, np.nan), (1.0, 1.0)]], {}), r"outlines_mm\[0\]"),
    (([[("a", "b"), ("c", "d"), ("e", "f")]], {}), r"outlines_mm\[0\]"),
    (([[(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)]], {}), "must be a pair"),
    (([[SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]]], {}), "must not touch or cross"),
    (([SQUARE, rectangle(1.0, 1.0, x=0.5)], {}), "must not touch or cross"),
    (([SQUARE, rectangle(1.0, 1.0, x=2.0)], {}), "must not touch or cross"),
    (([SQUARE, SQUARE], {}), "must not touch or cross"),
    (([SQUARE, [(1.0, 0.3), (2.0, 0.0), (2.0, 0.5)]], {}), "must not touch or cross"),
    (([[*SQUARE[:2], (3.0, -1.0), (2.0, -1.0), *SQUARE[2:]]], {}), "must not touch or cross"),
    (([[(0.0, 0.0), (1.0, 0.0), (3.0, 0.0)]], {}), "must not touch or cross"),
    (([[(-3.0, 0.0), (2.0, 0.0), (0.0, 0.0), (3.0, 0.0), (0.0, 2.0)]], {}), "must not touch or cross"),
    (([circle(3.0, MOST_CORNERS + 1)], {}), f"at most {MOST_CORNERS} corners"),
    (([SQUARE], {"height_mm": "high"}), ("height_mm",)),
    (([SQUARE], {"edge_radius_mm": -0.1}), "edge_radius_mm must be greater than 0"),
    (([SQUARE], {"height_mm": 0.2, "edge_radius_mm": 0.3}), "must not exceed height_mm, 0.2 mm"),
    (([rectangle(0.1, 2.0)], {"edge_radius_mm": 0.2}), "half of the narrowest stroke, 0.1 mm"),
    (("  ", {}), "at least one letter"),
    ((7, {}), "text must be a text: got 7"),
    (("a\nb", {}), r"characters of DejaVu Sans: got '\\n'"),
    (("a\U0001f984", {}), "characters of DejaVu Sans"),
    (("a", {"weight": "heavy"}), ("weight",)),
    (("a", {"capital_mm": -1.0}), ("capital_mm",)),
    (("a", {"capital_mm": 0.5}), "half of the narrowest stroke"),
    (("x" * 340, {}), "must have at most 4000 corners"),
    call=lambda given: (Embossed if isinstance(given[0], list) else embossed_text)(given[0], **given[1]),
)  # fmt: skip


def area(outlines):
    """Area within outlines that turn counter-clockwise, holes clockwise."""
    lines = [np.array(line).T for line in outlines]
    return 0.5 * sum((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() for x, y in lines)


def test_outlines_that_overlap_become_their_union():
    square = np.array(rectangle(1.0, 1.0))
    assert area(joined_outlines([square, square + 1.0])) == pytest.approx(7.0, abs=1e-9)
    assert area(joined_outlines([square, np.add(square, [2.0, 0.5])])) == pytest.approx(8.0, abs=1e-9)
    ring = [square, 0.5 * square[::-1], np.add(square, [0.75, 0.0])]
    assert area(joined_outlines(ring)) == pytest.approx(5.5 - 0.25, abs=1e-9)
    assert [len(line) for line in joined_outlines([square, square])] == [4]
    wheel = [np.add(circle(1.0, 60), [np.cos(turn), np.sin(turn)]) for turn in np.arange(5) * 2.0 * np.pi / 5]
    points = np.random.default_rng(5).uniform(-2.2, 2.2, (4000, 2))
    away = np.array([np.hypot(*(points - part.mean(axis=0)).T) for part in wheel])
    within = (away < 1.0).any(axis=0).mean()
    assert area(joined_outlines(wheel)) == pytest.approx(within * 4.4**2, rel=0.03)
    for text, count in (("\u00c7", 1), ("\u00c5", 3), ("\u0118", 1)):  # letters whose outlines overlap
        letter = embossed_text(text, edge_radius_mm=0.05)
        assert len(letter.outlines_mm) == count
        check_gap(letter.gap, "letter")
