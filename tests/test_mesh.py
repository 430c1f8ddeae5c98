"""Meshes against volumes, areas and distances known without a mesh, and against each other."""

from dataclasses import replace

import numpy as np
import pytest

from fingerpad import Fingertip, Grading
from fingerpad.geometry.grading import graded_lines, lines_of_sizes, resolution_grading
from fingerpad.geometry.mesh import LAYERS, Mesh, block_mesh, finger_mesh
from fingerpad.geometry.mesh_checks import jacobian_at_gauss, scaled_jacobian
from refusals import refusals

FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
FINGER = Fingertip()
CONTACT_X = 17.37


@pytest.fixture(scope="module")
def quick() -> Mesh:
    return finger_mesh(FINGER, resolution_grading("quick", CONTACT_X))


@pytest.fixture(scope="module")
def standard() -> Mesh:
    return finger_mesh(FINGER, resolution_grading("standard", CONTACT_X))


@pytest.fixture(scope="module")
def paper() -> Mesh:
    return finger_mesh(FINGER, resolution_grading("paper", CONTACT_X))


def block() -> Mesh:
    return block_mesh([0, 1, 3, 4], [0, 0.371, 0.471, 2], [0, 0.5, 2], layers=[0, 1, 2], symmetric=True)


def boundary_faces(mesh: Mesh) -> np.ndarray:
    """Faces of only one element, as rows of sorted nodes, collapsed faces left out."""
    faces = np.sort(mesh.elements[:, FACES].reshape(-1, 4), axis=1)
    faces = faces[(np.diff(faces, axis=1) == 0).sum(axis=1) < 2]
    rows, counts = np.unique(faces, axis=0, return_counts=True)
    assert counts.max() == 2
    return rows[counts == 1]


def test_a_block_has_its_volume_its_skin_and_its_layers():
    mesh = block()
    assert mesh.shape == (3, 2, 3)
    volumes = jacobian_at_gauss(mesh).sum(axis=1)
    by_layer = [volumes[mesh.layer == layer].sum() for layer in range(len(LAYERS))]
    np.testing.assert_allclose(by_layer, np.array([0.371, 0.1, 1.529, 0.0]) * 4 * 2)
    np.testing.assert_allclose(scaled_jacobian(mesh), 1.0)
    assert (mesh.nodes_mm[mesh.skin_nodes, 1] == 0).all()
    assert (mesh.nodes_mm[mesh.fixed_nodes, 1] == 2).all()
    assert mesh.fixed_nodes.size == mesh.skin_nodes.size == 12
    assert (mesh.nodes_mm[mesh.symmetry_nodes, 2] == 0).all()
    assert mesh.symmetry_nodes.size == 16
    assert mesh.nodes_mm[mesh.midline_nodes].tolist() == [[x, 0, 0] for x in (0, 1, 3, 4)]
    assert (mesh.layer[mesh.living_epidermis] == 1).all()
    assert mesh.living_epidermis.shape == (3, 2)
    along, across = np.array([0.5, 1.5, 1.5, 0.5]), np.array([0.25, 1.0, 0.75])
    np.testing.assert_allclose(mesh.skin_area_mm2, np.outer(along, across).ravel())
    corners = mesh.nodes_mm[mesh.elements[:, 4:]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    assert (normal[:, 1] < 0).all()  # upper faces look out of the skin
    np.testing.assert_allclose(normal[:, [0, 2]], 0.0, atol=1e-15)


def test_scaled_jacobian_of_a_sheared_box_is_the_cosine_of_its_shear():
    mesh = block_mesh([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], layers=[2])
    sheared = replace(mesh, nodes_mm=mesh.nodes_mm @ np.array([[1, 0, 0], [np.tan(0.6), 1, 0], [0, 0, 1.0]]))
    np.testing.assert_allclose(scaled_jacobian(sheared), np.cos(0.6))
    np.testing.assert_allclose(jacobian_at_gauss(sheared), 1 / 8)


@pytest.mark.parametrize("resolution", ["quick", "standard", "paper"])
def test_every_brick_is_sound(resolution, request):
    mesh = request.getfixturevalue(resolution)
    assert (jacobian_at_gauss(mesh) > 0).all()
    quality = scaled_jacobian(mesh)
    assert quality.min() > 0.5
    assert np.quantile(quality, 0.01) > 0.6
    middle = mesh.nodes_mm[mesh.elements].mean(axis=1)
    near = (np.linalg.norm(middle[:, [0, 2]] - [CONTACT_X, 0], axis=1) < 2) & (middle[:, 1] < -6)
    assert near.sum() > 100
    assert quality[near].min() > 0.95


@pytest.mark.parametrize("resolution", ["quick", "standard", "paper"])
def test_the_finger_is_no_visible_polygon(resolution, request):
    """From the side, over the tip, and at the contact, the skin turns by 30 degrees a line at most."""
    mesh = request.getfixturevalue(resolution)
    skin = mesh.nodes_mm[mesh.skin_grid]
    volar = skin.shape[1] // 2 if mesh.full else 0
    side = np.concatenate([skin[:, volar], skin[-2::-1, -1]])
    section = skin[np.abs(skin[:, volar, 0] - CONTACT_X).argmin(), volar:]
    assert side[-1, 1] > 0.0
    for outline in (side, section):
        normals = FINGER.skin_normal(outline)
        turns = np.degrees(np.arccos(np.clip((normals[1:] * normals[:-1]).sum(axis=1), -1.0, 1.0)))
        assert 10.0 < turns.max() < 30.0


def test_sizes_are_those_of_the_presets(quick, standard, paper):
    assert 4_000 < len(quick.nodes_mm) < 8_000
    assert 12_000 < len(standard.nodes_mm) < 20_000
    assert len(paper.nodes_mm) >= 232_000
    assert paper.full
    assert not quick.full
    assert not standard.full


def test_paper_edges_are_a_tenth_of_a_millimetre_over_the_pad(paper):
    """Over an oval pad; edges around the finger shorten inwards and where its girth is smaller."""
    x, y, z = np.moveaxis(paper.nodes_mm[paper.skin_grid], -1, 0)
    pad = (((x - CONTACT_X) / 5.5) ** 2 + (z / 4.5) ** 2 < 1.0) & (y < -5)
    for layers in (0, 5):  # skin, and epidermal-dermal border below four and one elements
        points = paper.nodes_mm[paper.skin_grid + layers]
        along = np.linalg.norm(np.diff(points, axis=0), axis=-1)[pad[:-1] & pad[1:]]
        around = np.linalg.norm(np.diff(points, axis=1), axis=-1)[pad[:, :-1] & pad[:, 1:]]
        for edges in (along, around):
            assert edges.size > 5_000
            assert edges.max() < 0.106
            assert 0.094 < np.median(edges) < 0.101


def test_neighbours_share_whole_faces_and_wedges_have_two_pairs_of_equal_nodes(quick):
    along, around, through = quick.shape
    # skin and bone, the cut, and the plane of symmetry on the volar and on the dorsal side
    assert len(boundary_faces(quick)) == 2 * along * around + around * through + 2 * along * through
    np.testing.assert_array_equal(np.unique(quick.elements), np.arange(len(quick.nodes_mm)))
    distinct = np.array([len(set(row)) for row in quick.elements])
    wedges = distinct == 6
    assert wedges.sum() == quick.shape[1] * quick.shape[2]
    assert (distinct[~wedges] == 8).all()


def test_a_full_finger_closes_around(quick):
    full = finger_mesh(FINGER, replace(resolution_grading("quick", CONTACT_X), full=True))
    along, around, through = full.shape
    assert around == 2 * quick.shape[1]
    assert len(boundary_faces(full)) == 2 * along * around + around * through
    assert full.symmetry_nodes.size == 0
    assert jacobian_at_gauss(full).sum() == pytest.approx(2 * jacobian_at_gauss(quick).sum(), rel=1e-12)
    assert full.skin_area_mm2.sum() == pytest.approx(2 * quick.skin_area_mm2.sum(), rel=1e-12)
    np.testing.assert_array_equal(full.nodes_mm[full.midline_nodes], quick.nodes_mm[quick.midline_nodes])
    points = {tuple(point) for point in full.nodes_mm.round(9) + 0.0}
    assert points == {tuple(point) for point in (full.nodes_mm * [1, 1, -1]).round(9) + 0.0}


def test_nodes_of_skin_bone_symmetry_midline_and_sheet_lie_where_they_belong(standard):
    nodes = standard.nodes_mm
    np.testing.assert_allclose(FINGER.level(nodes[standard.skin_nodes]), 0.0, atol=1e-12)
    x, y, z = nodes[standard.bone_nodes].T
    past = np.maximum(x - 20.0, 0.0) / 5.1
    np.testing.assert_allclose(past**2 + ((y + 2) / 2.3) ** 2 + (z / 2.6) ** 2, 1.0)
    assert (nodes[standard.symmetry_nodes, 2] == 0).all()
    np.testing.assert_array_equal(np.flatnonzero(nodes[:, 2] == 0), standard.symmetry_nodes)
    assert (nodes[:, 2] >= 0).all()
    assert set(standard.nail_nodes) <= set(standard.skin_nodes)
    assert FINGER.is_under_nail(nodes[standard.nail_nodes]).all()
    np.testing.assert_array_equal(
        standard.fixed_nodes, sorted({*standard.bone_nodes.tolist(), *standard.nail_nodes.tolist()})
    )
    points = standard.nodes_mm[standard.midline_nodes]
    assert (np.diff(points[:, 0]) > 0).all()
    assert (points[:, 1] < -1.9).all()
    assert np.abs(points[:, 0] - CONTACT_X).min() < 1e-4
    fine = np.abs(points[:, 0] - CONTACT_X) < 4.5
    steps = np.linalg.norm(np.diff(points[fine], axis=0), axis=1)
    np.testing.assert_allclose(steps, 0.25, rtol=1e-3)
    sheet = standard.living_epidermis
    assert sheet.shape == standard.shape[:2]
    assert (standard.layer[sheet] == 1).all()
    lower = standard.nodes_mm[standard.elements[sheet][..., :4]].mean(axis=2)
    expected = FINGER.subsurface(FINGER.skin_point(CONTACT_X, 0.0), 0.471)
    assert np.linalg.norm(lower - expected, axis=-1).min() < 0.2


@pytest.mark.parametrize(("layer", "depth"), [(0, 0.371), (1, 0.471), (2, 1.624)])
def test_layers_end_at_their_depth_along_the_volar_normal(standard, layer, depth):
    ends = {0: 4, 1: 5, 2: 9}[layer]
    skin = standard.nodes_mm[standard.skin_grid]
    below = standard.nodes_mm[standard.skin_grid + ends]
    volar = skin[..., 1] < FINGER.spine_y_mm
    np.testing.assert_allclose(below[volar], FINGER.subsurface(skin[volar], depth), rtol=0, atol=1e-12)
    across = ((skin - below) * FINGER.skin_normal(skin)).sum(axis=-1)
    np.testing.assert_allclose(across, depth, rtol=1e-12)


@pytest.mark.parametrize("full", [False, True])
def test_grid_holds_the_corners_of_every_brick_in_columns_of_consecutive_nodes(full):
    mesh = finger_mesh(FINGER, replace(resolution_grading("quick", CONTACT_X), full=full))
    for body in (mesh, block()):
        corners = body.elements.reshape(*body.shape, 8)
        np.testing.assert_array_equal(body.grid[:-1, :-1, :-1], corners[..., 4])
        np.testing.assert_array_equal(body.grid[1:, 1:, 1:], corners[..., 2])
        np.testing.assert_array_equal(np.unique(body.grid), np.arange(len(body.nodes_mm)))
        assert (body.grid[:, :, 0] % body.grid.shape[2] == 0).all()


@pytest.mark.parametrize("fine", [0.1, 1.0, 4.9, 7.0])
@pytest.mark.parametrize("length", [3.3, 5.0, 17.2])
@pytest.mark.parametrize("size", [0.05, 0.22, 2.0])
def test_graded_lines_keep_their_growth_their_limit_and_their_end(fine, length, size):
    lines = graded_lines(fine, size, length, growth=1.3, largest=2.5)
    steps = np.diff(lines)
    assert lines[0] == 0.0
    assert lines[-1] == length
    assert steps.size % 2 == 0
    assert steps.max() <= 2.5 + 1e-9
    assert (steps[1:] / steps[:-1]).max() <= 1.3 + 1e-9
    n_fine = int(min(fine, length) / size)
    assert (steps[:n_fine] <= size + 1e-12).all()


test_what_cannot_be_meshed_is_refused = refusals(
    (lambda: finger_mesh(FINGER, resolution_grading("quick", 40.0)), "centre_mm must lie between"),
    (lambda: resolution_grading("coarse", 10.0), "resolution must be one of quick"),
    (lambda: Grading(10.0, 1.0, 1.0, 0.2, 0.2, growth=1.5), "growth must be above 1"),
    (lambda: Grading(10.0, 1.0, 1.0, 0.2, 0.2, dermis=0), "dermis must be a whole number"),
    (lambda: block_mesh([0, 1], [1, 2], [0, 1], layers=[0]), "y_edges starting at the skin"),
    (lambda: block_mesh([0, 1], [0, 2], [0, 1], layers=[0, 1]), "for each interval of y_edges"),
    (lambda: block_mesh([0, 1], [0, 2], [1, 2], layers=[0], symmetric=True), "must start at 0"),
    (lambda: replace(Grading(10.0, 1.0, 1.0, 0.2, 0.2), finer_along=((2.0, 1.0, 0.1),)),
     "finer_along needs strips of from, to and size"),
)  # fmt: skip


@pytest.mark.parametrize("length", [3.3, 6.0, 17.2])
def test_strips_are_finer_and_sizes_grow_from_them(length):
    """Between two strips and beyond them; the steps are even in number and end where they must."""
    strips = [(0.4, 0.6, 0.05), (2.0, 2.2, 0.1), (20.0, 21.0, 0.01)]
    lines = lines_of_sizes(3.0, 0.45, length, growth=1.3, largest=3.0, strips=strips)
    steps, middles = np.diff(lines), 0.5 * (lines[1:] + lines[:-1])
    assert lines[0] == 0.0
    assert lines[-1] == length
    assert steps.size % 2 == 0
    for begin, end, size in strips[:2]:
        within = (middles > begin) & (middles < end)
        assert within.sum() >= (end - begin) / size - 1
        assert steps[within].max() <= 1.05 * size
    assert steps[middles < 3.0].max() <= 0.45
    assert np.maximum(steps[1:] / steps[:-1], steps[:-1] / steps[1:]).max() <= 1.35
    plain = lines_of_sizes(3.0, 0.45, length, 1.3, 3.0, ())
    assert plain.size <= graded_lines(3.0, 0.45, length, 1.3, 3.0).size


def test_a_mesh_is_fine_in_strips_and_only_there():
    """By x and z of the skin, on the side that was asked for; the mesh without strips keeps its bits."""
    plain = Grading(CONTACT_X, 2.0, 2.0, 0.45, 0.45, full=True)
    finer = replace(plain, finer_along=((16.0, 16.4, 0.1),), finer_across=((1.0, 1.5, 0.1),))
    mesh = finger_mesh(FINGER, finer)
    x = mesh.nodes_mm[mesh.midline_nodes, 0]
    assert np.diff(x)[(x[1:] > 16.0) & (x[:-1] < 16.4)].max() <= 0.13
    assert np.diff(x)[(x[:-1] > 17.3) & (x[1:] < 18.3)].min() > 0.3
    ring = mesh.nodes_mm[mesh.skin_grid[np.abs(x - CONTACT_X).argmin()]]
    z = np.sort(ring[ring[:, 1] < 0.0, 2])
    assert np.diff(z)[(z[1:] > 1.0) & (z[:-1] < 1.5)].max() <= 0.13
    assert np.count_nonzero((z > -1.5) & (z < -1.0)) <= 2
    assert (finer.finest_x_mm, finer.finest_z_mm, finer.finest_strip_mm) == (0.1, 0.1, 0.1)
    assert plain.finest_strip_mm == np.inf
