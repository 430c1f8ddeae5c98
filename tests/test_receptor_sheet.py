"""Receptors below any point of the skin: positions, sampled values, and continuity around the finger."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fingerpad import Fingertip, Grading, InputError
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import block_mesh, finger_mesh
from fingerpad.skin.receptor_sheet import ReceptorSheet

FINGER = Fingertip()
EVEN = Grading(
    17.37, 30.0, 30.0, 0.6, 0.6, 0.6, stratum_corneum=1, living_epidermis=1, dermis=1, subcutis=1, full=True
)
"""As fine on the back of the finger as on the pad."""

FULL = finger_mesh(FINGER, EVEN)
HALF = finger_mesh(FINGER, replace(EVEN, full=False))
SHEETS = {"full": ReceptorSheet(FULL), "half": ReceptorSheet(HALF)}
MIDDLE_DEPTH_MM = 0.421


def skin_at(x, angle):
    """Points of the skin by x and the angle around a section: 0 volar, pi dorsal."""
    volar, dorsal, half_width = FINGER.section(x)
    height = np.where(np.cos(angle) > 0.0, volar, dorsal)
    return np.stack([x, -height * np.cos(angle), half_width * np.sin(angle)], axis=-1)


def random_skin(count, seed, ends_mm=(2.0, 29.0)):
    rng = np.random.default_rng(seed)
    return skin_at(rng.uniform(*ends_mm, count), rng.uniform(-np.pi, np.pi, count))


def on_tight_ridge(points):
    """Where the skin turns within less than 3 mm, about y = 0 on the back: elements there cut corners."""
    return (points[:, 1] > -0.5) & (points[:, 1] < 2.0)


def centres(mesh):
    return mesh.nodes_mm[mesh.elements[mesh.living_epidermis.ravel()]].mean(axis=1)


@pytest.mark.parametrize("name", SHEETS)
def test_a_linear_field_is_read_all_around_the_finger(name):
    """Every direction of the field, every side of the finger; half a finger knows even fields only."""
    sheet, points = SHEETS[name], random_skin(400, 1)
    organs = FINGER.subsurface(points, MIDDLE_DEPTH_MM)
    fields, known = centres(sheet.mesh).T, organs.T.copy()
    if name == "half":
        known[2] = np.abs(known[2])
    read = sheet.read(sheet.below(points), fields)
    off = np.linalg.norm(read - known, axis=0)
    # Beside the midline of half a finger |z| has a kink, which a cubic rounds off.
    smooth = ~on_tight_ridge(points) & ((name == "full") | (np.abs(points[:, 2]) > 1.2))
    assert smooth.sum() > 250
    # Elements are 0.6 mm wide: their middles lie up to 0.6^2/(8 R) inside a skin of radius R.
    assert off[smooth].max() < 0.025
    assert off[smooth & (points[:, 1] < -2.0) & (points[:, 0] < 27.0)].max() < 0.01


def test_end_organs_lie_on_the_normal_and_on_the_border():
    sheet, points = SHEETS["full"], random_skin(300, 2)
    organs = sheet._border(sheet.below(points))[0]
    off = np.linalg.norm(organs - FINGER.subsurface(points, 0.471), axis=1)
    assert np.median(off) < 0.003
    assert off[~on_tight_ridge(points)].max() < 0.012
    assert off.max() < 0.12


@pytest.mark.parametrize("name", SHEETS)
@pytest.mark.parametrize("angle", [0.0, np.pi, 0.7])
def test_no_seam_shows(name, angle):
    """Across the midlines, where halves meet and columns close, neither values nor slopes jump."""
    sheet = SHEETS[name]
    x, y, z = centres(sheet.mesh).T
    field = (np.sin(x) + np.cos(1.1 * z) + 0.3 * y)[None]
    steps = 1e-5 * np.array([-2.0, -1.0, -1e-3, 1e-3, 1.0, 2.0])
    read = sheet.read(sheet.below(skin_at(np.full(6, 14.2), angle + steps)), field)[0]
    before, after = read[1] - read[0], read[5] - read[4]
    assert abs(read[3] - read[2]) < 1e-5
    assert abs(after - before) < 1e-7
    far = sheet.read(sheet.below(skin_at(np.full(2, 14.2), angle + np.array([0.0, 0.3]))), field)[0]
    assert abs(far[1] - far[0]) > 0.01


def test_every_element_is_read_exactly_at_its_middle():
    sheet = SHEETS["full"]
    values = np.random.default_rng(7).random((3, FULL.living_epidermis.size))
    middles = np.argwhere(np.ones(FULL.living_epidermis.shape, dtype=bool)).astype(float)
    assert_allclose(sheet.read(middles, values), values, rtol=0, atol=1e-13)


def test_the_way_to_the_tip_has_no_gap():
    """Through the last rows to the pole: what depends on x alone is followed from any side."""
    sheet = SHEETS["full"]
    for angle in (0.0, 1.0, 3.0):
        points = skin_at(np.linspace(29.0, 31.6, 14), np.full(14, angle))
        organs = FINGER.subsurface(points, MIDDLE_DEPTH_MM)
        read = sheet.read(sheet.below(points), centres(FULL).T[:1])[0]
        assert_allclose(read, organs[:, 0], rtol=0, atol=0.12)


def test_the_tip_is_skin_and_points_beside_the_skin_are_refused():
    assert SHEETS["full"].below(np.array([[FINGER.length_mm, 0.0, 0.0]])).shape == (1, 2)
    for site, side in (((17.37, -9.0, 0.0), 0.8), ((17.37, -12.0, 0.0), 2.1), ((40.0, 0.0, 0.0), 8.0)):
        with pytest.raises(InputError, match="must lie on the skin of the mesh") as refusal:
            SHEETS["full"].below(np.array([[17.37, -9.85, 0.0], site]))
        away = float(str(refusal.value).split(" mm is ")[1].split(" mm")[0])
        assert abs(away - side) < 0.15 * side
    with pytest.raises(InputError, match="must lie on the skin"):
        SHEETS["half"].below(np.array([[-0.05, -9.7, 0.0]]))  # before the cut
    block = block_mesh([0.0, 1.0], [0.0, 0.4, 0.5], [0.0, 1.0, 2.0], layers=[0, 1])
    with pytest.raises(InputError, match=r"two elements along and around, or more: got \(1, 2\)"):
        ReceptorSheet(block)


def test_a_block_is_read_up_to_its_rim_and_no_farther():
    edges = np.cumsum([0.0, 0.5, 0.6, 0.7, 0.8])
    block = block_mesh(edges, [0.0, 0.371, 0.471, 2.0], edges, layers=[0, 1, 2])
    sheet, rim = ReceptorSheet(block), edges[-1]
    sites = np.array([[0.0, 0.0, 0.0], [rim, 0.0, rim], [0.0, 0.0, rim], [1.0, 0.0, 0.3]])
    x, _, z = centres(block).T
    expected = 2.0 * sites[:, 0] - sites[:, 2]
    assert_allclose(sheet.read(sheet.below(sites), [2.0 * x - z])[0], expected, rtol=0, atol=1e-8)
    for beyond in ([-0.01, 0.0, 1.0], [1.0, 0.0, rim + 0.01]):
        with pytest.raises(InputError, match="must lie on the skin"):
            sheet.below(np.array([beyond]))


@pytest.mark.parametrize(("z", "proximal", "inwards"), [(0.0, 0.07, 0.0), (2.5, 0.06, 0.12)])
def test_straight_down_is_not_along_the_normal(z, proximal, inwards):
    """Sites of two numbers and of three differ, because the pad is inclined."""
    sheet = SHEETS["full"]
    organ = sheet._border(sheet.below(FINGER.skin_point([17.37], [z])))[0][0]
    assert_allclose([17.37 - organ[0], z - organ[2]], [proximal, inwards], rtol=0, atol=0.006)


@pytest.mark.parametrize("name", ["full", "half", "coarse"])
def test_columns_agree_at_the_pole(name):
    """On the mean of their last elements, however much these differ; skin around the pole lies above it."""
    sheet = SHEETS.get(name) or ReceptorSheet(finger_mesh(FINGER, resolution_grading("quick", 17.37)))
    n_along, n_around = sheet.mesh.living_epidermis.shape
    values = np.random.default_rng(8).random((1, sheet.mesh.living_epidermis.size))
    last = values.reshape(n_along, n_around)[-1]
    assert last.std() > 0.2
    columns = np.linspace(0.0, n_around - 1.0, 101)
    read = sheet.read(np.stack([np.full(101, n_along - 0.5), columns], axis=1), values)
    assert_allclose(read[0], last.mean(), rtol=0, atol=1e-9)
    pole = sheet.mesh.nodes_mm[sheet.mesh.skin_grid[-1, 0]]
    angles = np.linspace(-np.pi, np.pi, 101)
    sideways = np.array([0.0, 0.0, 1.0])
    around = np.outer(np.cos(angles), np.cross(FINGER.skin_normal(pole), sideways))
    ring = pole + 0.003 * (around + np.outer(np.sin(angles), sideways))
    assert_allclose(sheet.below(ring)[:, 0], n_along - 0.5, rtol=0, atol=0.03)
