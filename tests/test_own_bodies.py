"""Bodies of a user's own: only `gap` is written; symmetry, face and key of a stored press follow from it."""

from dataclasses import dataclass

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.geometry.bodies import Dots
from fingerpad.geometry.probing import check_gap, mirrored, traced_front
from fingerpad.skin.indentation import Touch
from fingerpad.skin.store import touch_key

BODIES = [fp.Sphere(), fp.Cylinder(), fp.Bar(), fp.FlatPunch(), fp.Edge(), fp.Gap(), fp.Grating(), fp.Plate()]
COARSE = fp.Grading(17.37, 3.0, 3.0, 0.8, 0.8, 6.0, 1.3, 1, 1, 1, 1)


@dataclass(frozen=True)
class Dot(fp.Indenter):
    """A plate, 3 mm behind the top of one ball beside the midline."""

    z_mm: float = 1.25
    radius_mm: float = 1.5

    def gap(self, points_mm):
        offsets = points_mm - np.array([0.0, -self.radius_mm, self.z_mm])
        distance = np.linalg.norm(offsets, axis=1)
        ball, plate = distance - self.radius_mm, points_mm[:, 1] + 3.0
        is_ball = (ball < plate)[:, None]
        return np.minimum(ball, plate), np.where(is_ball, offsets / distance[:, None], [0.0, 1.0, 0.0])


@dataclass(frozen=True, eq=False)
class Balls(fp.Indenter):
    """Balls in a row, their places in an array."""

    places_mm: np.ndarray
    radius_mm: float = 1.0

    def gap(self, points_mm):
        offsets = points_mm[:, None, :] - np.array([0.0, -self.radius_mm, 0.0]) - self.places_mm
        distance = np.linalg.norm(offsets, axis=2)
        nearest = distance.argmin(axis=1), np.arange(len(points_mm))
        closest = distance[nearest[1], nearest[0]]
        return closest - self.radius_mm, offsets[nearest[1], nearest[0]] / closest[:, None]


def body_of(gap_text, **more):
    """A class named Own, its gap written as text, as in a script that was edited."""
    names = {"Indenter": fp.Indenter, "dataclass": dataclass, "np": np, "__name__": "__main__"} | more
    exec(
        "@dataclass(frozen=True)\n"
        "class Own(Indenter):\n"
        "    size_mm: float = 1.0\n"
        "    def gap(self, points):\n"
        f"        {gap_text}\n",
        names,
    )
    return names["Own"]


PLATE = "return points[:, 1] + {} * points[:, 0] ** 2 * 0, np.tile([0.0, 1.0, 0.0], (len(points), 1))"


def key(body):
    touch = Touch(fp.Fingertip(), body, fp.RampAndHold(depth_mm=0.3), TISSUES, COARSE, fp.PressSettings(1, 1))
    return touch_key(touch)


TISSUES = fp.touch_of(fp.Fingertip(), fp.Plate()).tissues


@pytest.mark.parametrize("body", BODIES, ids=lambda body: type(body).__name__)
def test_symmetry_and_face_found_from_the_gap_are_those_in_closed_form(body):
    for spin_deg in (0.0, 30.0, 90.0, 180.0):
        assert mirrored(body.gap, spin_deg) == body.mirrors(spin_deg)
    points = np.random.default_rng(3).uniform(-3.0, 3.0, (300, 3))
    traced, exact = traced_front(body.gap, points), body.front(points)
    both = np.isfinite(traced) & np.isfinite(exact)
    assert both.sum() > 100
    np.testing.assert_allclose(traced[both], exact[both], rtol=0, atol=2e-3)
    # Both end at the same walls, but for rays that run along one.
    assert (np.isfinite(traced) != np.isfinite(exact)).mean() < 0.15
    check_gap(body.gap, type(body).__name__)


def test_a_dot_beside_the_midline_is_pressed_on_a_whole_finger():
    for z_mm, is_half in ((1.25, False), (-1.25, False), (0.0, True)):
        assert Dot(z_mm).mirrors(0.0) == is_half
        assert fp.touch_of(fp.Fingertip(), Dot(z_mm)).grading.full != is_half
    with pytest.raises(fp.InputError, match="leaves Dot without symmetry"):
        Touch(fp.Fingertip(), Dot(), fp.RampAndHold(depth_mm=0.3), TISSUES, COARSE, fp.PressSettings(1, 1))


def test_a_derived_class_with_another_gap_is_not_trusted():
    @dataclass(frozen=True)
    class Slanted(fp.Sphere):
        def gap(self, points_mm):
            return super().gap(points_mm - [0.0, 0.0, 0.5])

    assert not Slanted().mirrors(0.0)
    assert type("Ball", (fp.Sphere,), {})().mirrors(0.0)


def test_arrays_are_fields_and_every_number_of_them_counts():
    row = Balls(np.array([[0.0, 0.0, -2.0], [0.0, 0.0, 2.0]]))
    same = Balls(np.array([[0.0, -0.0, -2.0], [0.0, 0.0, 2.0]]))
    other = Balls(np.nextafter(row.places_mm, 9.0))
    assert key(row) == key(same) != key(other)
    assert row == same
    assert row != other
    assert len({row, same, other}) == 2


def test_a_body_of_ones_own_is_stored_under_its_own_key(caplog):
    unnamed = body_of(PLATE.format(1))
    assert key(unnamed()) == key(unnamed())  # within one run
    assert key(unnamed()) != key(body_of(PLATE.format(1))())  # as in another run
    assert "Each run computes the presses of Own again" in caplog.text
    named = [body_of(PLATE.format(1), store_key=None) for _ in range(3)]
    for kind, store_key in zip(named, ("flat 1", "flat 1", "flat 2"), strict=True):
        kind.store_key = store_key
    first, same, other = (key(kind()) for kind in named)
    assert first == same != other


@pytest.mark.parametrize(
    ("gap", "said"),
    [
        ("return points[:, 1], 2.0 * np.eye(3)[np.ones(len(points), int)]", "length 1: got length 2"),
        ("return points[:, 1], np.eye(3)[np.zeros(len(points), int)]", "its own gradient as the normal"),
        ("return points[:, 1]", "must return"),
        ("return points[:, 1:2], points", "must return gap"),
        ("return np.nan * points[:, 1], points", "finite numbers"),
    ],
)
def test_a_gap_that_breaks_its_contract_is_refused_in_one_sentence(gap, said):
    with pytest.raises(fp.InputError, match=said) as raised:
        key(body_of(gap)())
    assert "\n" not in str(raised.value)
    assert "Own" in str(raised.value)


@pytest.mark.parametrize("body", [Dots([(0.0, 0.0)]), Dots([(0.0, -1.25), (0.5, 1.25)]), fp.braille("k")])
def test_the_normal_of_dots_is_the_gradient_of_their_gap(body):
    check_gap(body.gap, "Dots")
    points = np.random.default_rng(4).uniform([-3, -0.4, -3], [3, 0.6, 3], (300, 3))
    steps = 1e-6 * np.eye(3)
    slope = [(body.gap(points + step)[0] - body.gap(points - step)[0]) / 2e-6 for step in steps]
    differs = np.abs(np.stack(slope, axis=1) - body.gap(points)[1]).max(axis=1) > 1e-4
    assert differs.mean() < 0.02  # only where a creased seam lies within a step


def test_braille_cells_have_their_dots_and_distances():
    np.testing.assert_allclose(fp.braille("a").at_mm, [[0.0, 0.0]])
    cell = np.array(fp.braille("q", along_finger=False).at_mm)  # dots 1 to 5
    np.testing.assert_allclose(np.ptp(cell, axis=0), [2.34, 4.68])
    two = np.array(fp.braille("aa", along_finger=False).at_mm)
    assert np.ptp(two[:, 0]) == pytest.approx(6.2)
    with pytest.raises(fp.InputError, match=r"letters a to z and spaces: got 'A7'\.$"):
        fp.braille("A7")
    with pytest.raises(fp.InputError, match="got 'L a'; write 'l a'"):
        fp.braille("L a")


@pytest.mark.parametrize("along_finger", [True, False])
def test_braille_is_not_its_mirror_image(along_finger):
    # Dots 1, 4 and 5: from the first to the others is a turn to the right, which "f" (1, 2, 4) lacks.
    first, beside, below = np.array(fp.braille("d", along_finger).at_mm)
    (along, across), (along_down, across_down) = beside - first, below - beside
    assert along * across_down - across * along_down > 0.0  # clockwise as seen by the skin, x up and z right


def test_a_mesh_resolves_dots_and_their_distances():
    grading = fp.touch_of(fp.Fingertip(), fp.braille("c")).grading
    assert not grading.full  # two dots side by side, mirror images of each other
    assert max(grading.finest_x_mm, grading.finest_z_mm) <= (2.34 - 1.44) / 4
    with pytest.raises(fp.InputError, match="height_mm must not exceed"):
        Dots([(0.0, 0.0)], height_mm=1.0)
