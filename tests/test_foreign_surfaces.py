"""Surfaces of other programs, and with faults that such files have: each is read as one body, or refused."""

import numpy as np
import pytest

import fingerpad as fp
from benchmarks.foreign_surfaces import BODIES, read

REFUSED = {
    "airplane": "two triangles at most along each edge: 1 edges have more",
    "boxes side by side": "leave out inner walls, for example by the Boolean union",
    "boxes almost side by side": "walls of two are 0.002 mm apart",
    "fin": "two triangles at most along each edge",
    "Möbius strip": "must have two sides",
    "hole above": "close it, turn it over, or reverse the order of the corners",
    "in metres as mm": "got 0.004 mm; check the unit of its file",
}

POINTS = np.random.default_rng(46).uniform([-3.0, -0.6, -3.0], [3.0, 1.5, 3.0], (1000, 3))


def ball(radius_mm=2.0, x_mm=0.0):
    return np.linalg.norm(POINTS - [x_mm, -radius_mm, 0.0], axis=1) - radius_mm


def box(*half):
    beyond = np.abs(POINTS - [0.0, -half[1], 0.0]) - half
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)


def torus():
    ring = np.hypot(POINTS[:, 0], POINTS[:, 2]) - 4.0
    return np.hypot(ring, POINTS[:, 1] + 1.5) - 1.5


BALLS = [
    "ball", "ball of text", "ball in a ball", "soup", "shaken soup", "inside out", "some triangles turned",
    "triangles twice", "slivers", "hole below", "in inches", "in micrometres",
]  # fmt: skip
PAIR = np.minimum(ball(1.0, -1.5), ball(1.0, 1.5))
EXACT = {
    **{name: (ball(), 6e-3) for name in BALLS},
    "two balls": (np.minimum(ball(2.0, -1.0), ball(2.0, 1.0)), 6e-3),
    "balls apart": (PAIR, 3e-3),
    "one part inside out": (PAIR, 3e-3),
    "box": (box(2.0, 1.0, 2.0), 1e-12),
    "T-junctions": (box(2.0, 1.0, 2.0), 1e-12),
    "torus": (torus(), 0.03),
    "cylinder": (np.hypot(POINTS[:, 0], POINTS[:, 1] + 2.0) - 2.0, 0.02),
}
"""Closed forms, and how far the triangles of such a body lie from it. [mm]"""


@pytest.mark.filterwarnings("ignore:PolyData mesh is not valid")
@pytest.mark.parametrize("name", BODIES)
def test_a_foreign_surface_is_one_body_or_refused(name, tmp_path):
    if name in REFUSED:
        with pytest.raises(fp.InputError, match=REFUSED[name]):
            read(name, tmp_path)
        return
    body = read(name, tmp_path)
    low, high = body.vertices_mm.min(axis=0), body.vertices_mm.max(axis=0)
    face = np.random.default_rng(2).uniform(low, high, (2000, 3))
    face[:, 1] = body.front(face)
    face = face[face[:, 1] > -3.0]
    assert len(face) > 10
    # Above the face is outside, below it inside, also where walls of parts cross.
    above, below = (body.gap(face - [0.0, step, 0.0])[0] for step in (-1e-3, 1e-3))
    assert (above > 0.0).all()
    assert (below < 0.0).mean() > 0.99
    # Far away the gap is the distance to something within the box of the body.
    far = 40.0 * POINTS + [0.0, 30.0, 0.0]
    apart = np.linalg.norm(far - np.clip(far, low, high), axis=1)
    found = body.gap(far)[0]
    assert (found >= apart - 1e-9).all()
    assert (found <= apart + np.linalg.norm(high - low)).all()
    # The normal has the length 1 and is the direction in which the gap rises.
    near = face + np.random.default_rng(1).uniform(-0.01, 0.2, face.shape)
    normal = body.gap(near)[1]
    slope = np.stack([body.gap(near + d)[0] - body.gap(near - d)[0] for d in 1e-6 * np.eye(3)], axis=1) / 2e-6
    length = np.linalg.norm(slope, axis=1, keepdims=True)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=0, atol=1e-9)
    assert (np.abs(length[:, 0] - 1.0) < 0.1).mean() > 0.95  # more in filled creases
    assert (np.abs(slope / length - normal).max(axis=1) < 1e-4).mean() > 0.98
    if name in EXACT:
        expected, error = EXACT[name]
        gap = body.gap(POINTS)[0]
        shown = expected > -0.3  # within a body of parts the gap is that of the deepest one
        np.testing.assert_allclose(gap[shown], expected[shown], rtol=0, atol=error)
