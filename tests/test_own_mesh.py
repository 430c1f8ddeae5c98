"""Fingers that are meshes of one's own: our own sent out and read in, one made by Gmsh, and bad files."""

from dataclasses import replace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.experiments.requests.stimuli import read_stimuli
from fingerpad.export.decks import abaqus_deck
from fingerpad.export.job import job_of
from fingerpad.geometry.free_mesh import FreeMesh, MeshParts, finger_from
from fingerpad.geometry.mesh import LAYERS
from fingerpad.geometry.mesh_checks import FACES, faces_of, jacobian_at_gauss
from fingerpad.geometry.mesh_files import _read_inp, _read_msh
from fingerpad.skin.free_receptors import FreeReceptors
from fingerpad.skin.section import SURFACE_QUANTITIES, middle_section
from fingerpad.skin.store import touch_key
from tests import gmsh_finger

BALL, MOTION = fp.Sphere(radius_mm=4.0), fp.RampAndHold(depth_mm=0.6, hold_ms=50.0)
STEPS = fp.PressSettings(ramp_steps=2, hold_steps=1)
COARSE = fp.Grading(17.37, 2.0, 2.0, 0.6, 0.6, 3.0, stratum_corneum=1, dermis=2, subcutis=2)


@pytest.fixture(scope="module")
def sent(tmp_path_factory):
    """Our own finger, pressed, with its files."""
    folder = tmp_path_factory.mktemp("sent")
    touch = fp.touch_of(fp.Fingertip(), BALL, MOTION, grading=COARSE, settings=STEPS)
    skin = touch.solve(whole=True)
    skin.save(folder / "finger.pvd")
    (folder / "finger.inp").write_text(abaqus_deck(job_of(touch)))
    return folder, skin


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Half a finger made by Gmsh."""
    path = tmp_path_factory.mktemp("gmsh") / "finger.msh"
    gmsh_finger.write_gmsh_finger(path)
    return path


@pytest.fixture(scope="module")
def parts(made):
    return _read_msh(made)


@pytest.mark.parametrize("name", ["finger_0000.vtu", "finger.inp"])
def test_our_own_finger_comes_back_with_its_numbers(sent, name):
    folder, skin = sent
    own = fp.read_finger(folder / name)
    mesh = own.mesh
    assert len(mesh.nodes_mm) == len(skin.mesh.nodes_mm)
    assert sorted(mesh.layer) == sorted(skin.mesh.layer)
    for held in ("skin_nodes", "bone_nodes", "nail_nodes", "symmetry_nodes"):
        assert getattr(mesh, held).size == getattr(skin.mesh, held).size
    assert mesh.living_epidermis.size == skin.mesh.living_epidermis.size
    assert mesh.skin_area_mm2.sum() == pytest.approx(skin.mesh.skin_area_mm2.sum(), rel=1e-9)
    assert own.layer_depths_mm == pytest.approx((0.371, 0.471, 1.624), abs=2e-3)
    assert mesh.receptor_depth_mm == pytest.approx(0.471, abs=1e-3)
    assert float(own.depth_available_mm(17.37, 0.0)) == pytest.approx(5.549, abs=1e-3)
    if name != "finger.inp":  # the same nodes and elements have the same numbers
        deck = fp.read_finger(folder / "finger.inp").mesh
        order, deck_order = (np.lexsort(np.round(each.nodes_mm, 6).T) for each in (mesh, deck))
        np.testing.assert_allclose(mesh.nodes_mm[order], deck.nodes_mm[deck_order], rtol=0, atol=1e-6)
        place = np.empty(len(order), dtype=int)
        place[order] = deck_order
        ours, theirs = place[mesh.elements], deck.elements
        np.testing.assert_array_equal(ours[np.lexsort(ours.T)], theirs[np.lexsort(theirs.T)])
        return
    read = fp.touch_of(own, BALL, MOTION, at_mm=(17.37, 0.0), settings=STEPS).solve()
    np.testing.assert_allclose(read.force_mn, skin.force_mn, rtol=2e-6, atol=1e-9)
    np.testing.assert_allclose(read.contact_area_mm2, skin.contact_area_mm2, rtol=1e-5)
    np.testing.assert_allclose(np.sort(read.sed_kpa), np.sort(skin.sed_kpa), rtol=1e-3, atol=1e-5)
    # The same elements, interpolated otherwise: by a cubic spline on the grid there.
    sites = [[17.37, 0.0], [18.0, 0.5], [16.5, -0.5], [17.37, 1.0]]
    np.testing.assert_allclose(read.sed(sites).values, skin.sed(sites).values, rtol=0.03, atol=2e-3)
    for quantity in SURFACE_QUANTITIES:
        values = skin.sample(quantity, sites)
        np.testing.assert_allclose(read.sample(quantity, sites), values, atol=0.06 * values.max())
    on_skin = fp.Fingertip().skin_point(*np.transpose(sites))
    np.testing.assert_allclose(read.sed(on_skin).values, skin.sed(on_skin).values, rtol=0.03, atol=2e-3)


def test_a_finger_of_gmsh_is_a_finger(made, parts):
    own = fp.read_finger(made)
    mesh = own.mesh
    assert isinstance(mesh, FreeMesh)
    wedges = (np.diff(np.sort(mesh.elements, axis=1), axis=1) == 0).any(axis=1)
    assert (len(mesh.elements), wedges.sum()) == (16 * 12 * 6, 12 * 6)
    # A tube and half a ball, of which half is meshed, less the bone.
    tube, ball = np.pi * 16.0 * (8.0**2 - 2.5**2), 2.0 / 3.0 * np.pi * (8.0**3 - 2.5**3)
    assert jacobian_at_gauss(mesh).sum() == pytest.approx(0.5 * (tube + ball), rel=0.02)
    assert mesh.skin_area_mm2.sum() == pytest.approx(0.5 * (2 * np.pi * 8 * 16 + 2 * np.pi * 64), rel=0.02)
    bone = mesh.nodes_mm[mesh.bone_nodes] - [16.0, 0.0, 0.0]
    bone[:, 0] = np.maximum(bone[:, 0], 0.0)
    np.testing.assert_allclose(np.linalg.norm(bone, axis=1), gmsh_finger.BONE_MM)
    assert own.contact_mm == pytest.approx((24.0 * 17.37 / 31.78, 0.0))
    assert own.layer_depths_mm == pytest.approx(gmsh_finger.DEPTHS_MM, rel=0.02)
    assert mesh.living_epidermis.size == 16 * 12
    assert float(own.depth_available_mm(10.0, 0.0)) == pytest.approx(5.5, rel=0.01)
    assert own.skin_normal(own.skin_point(10.0, 4.0)).round(2).tolist() == pytest.approx(
        [0.0, -0.87, 0.5], abs=0.03
    )
    skin = fp.touch_of(own, BALL, MOTION).solve()
    assert skin.force_imbalance < 1e-3
    assert skin.energy_imbalance < 5e-3


def test_the_finger_of_gmsh_yields_as_ours_of_the_same_shape(tmp_path):
    """Two generators of meshes, one body: a tube of radius 8 mm with a round tip about a bone of 2.5 mm."""
    path = tmp_path / "fine.msh"
    gmsh_finger.write_gmsh_finger(path, along=24, cap=8, around=24, through=(1, 1, 2, 4))
    stations = np.concatenate([np.linspace(0.0, 15.5, 32), 16.0 + 8.0 * np.sin(np.linspace(0.0, 1.4, 30))])
    radius = np.sqrt(64.0 - np.maximum(stations - 16.0, 0.0) ** 2)
    readings = tuple(zip(stations.tolist(), radius.tolist(), strict=True))
    ours = fp.Fingertip(
        24.0, readings, readings, readings, *np.diff([0.0, *gmsh_finger.DEPTHS_MM]), -1e-6, 16.0, 2.5, 2.5,
        18.5, (0.1, 0.2), 0.01,
    )  # fmt: skip
    own, place = fp.read_finger(path), (10.0, 0.0)
    grading = fp.Grading(10.0, 6.0, 6.0, 0.66, 1.05, 2.0, stratum_corneum=1, dermis=2, subcutis=4)
    here = fp.touch_of(own, BALL, MOTION, at_mm=place, settings=STEPS).solve()
    there = fp.touch_of(ours, BALL, MOTION, at_mm=place, settings=STEPS, grading=grading).solve()
    assert here.force_mn[-1] == pytest.approx(there.force_mn[-1], rel=0.005)
    assert here.sed([place]).values[-1] == pytest.approx(there.sed([place]).values[-1], rel=0.015)


def test_older_files_units_and_axes_give_the_same_finger(made, parts, tmp_path):
    own = fp.read_finger(made)
    gmsh_finger.write_gmsh_finger(tmp_path / "old.msh", version=2.2, scale=1e-3, skin="Outer surface")
    old = fp.read_finger(tmp_path / "old.msh", unit="m", names={"skin": "outer_surface"})
    order = np.lexsort(np.round(own.mesh.nodes_mm, 6).T), np.lexsort(np.round(old.mesh.nodes_mm, 6).T)
    np.testing.assert_allclose(old.mesh.nodes_mm[order[1]], own.mesh.nodes_mm[order[0]], atol=1e-9)
    assert old.mesh.living_epidermis.size == own.mesh.living_epidermis.size
    turned = finger_from(replace(parts, nodes=parts.nodes[:, [2, 1, 0]] * [-1.0, 1.0, 1.0]), axes="z y -x")
    assert turned == finger_from(parts)
    assert hash(turned) == hash(finger_from(parts))
    assert turned != old


def test_a_whole_finger_of_gmsh_gives_the_force_of_the_half(tmp_path):
    gmsh_finger.write_gmsh_finger(tmp_path / "coarse.msh", along=9, cap=4, around=8, through=(1, 1, 1, 2))
    parts = _read_msh(tmp_path / "coarse.msh")
    half, whole = finger_from(parts), finger_from(mirrored(parts))
    assert whole.mesh.full
    place = (10.0, 0.0)
    one, both = (fp.touch_of(own, BALL, MOTION, at_mm=place, settings=STEPS).solve() for own in (half, whole))
    np.testing.assert_allclose(both.force_mn, one.force_mn, rtol=1e-4, atol=1e-9)
    sites = [[10.0, 0.0], [11.0, 1.0], [10.0, -2.0]]
    np.testing.assert_allclose(both.sed(sites).values, one.sed(sites).values, rtol=1e-3, atol=1e-6)
    # A body of revolution yields alike on every side.
    turned = fp.touch_of(
        finger_from(mirrored(parts), axes="x z -y"), BALL, MOTION, at_mm=place, settings=STEPS
    )
    np.testing.assert_allclose(turned.solve().force_mn, both.force_mn, rtol=1e-4, atol=1e-9)


def test_a_mesh_without_faces_on_the_middle_plane_is_drawn_too(parts):
    whole = mirrored(parts)
    aside = finger_from(replace(whole, nodes=whole.nodes + np.array([0.0, 0.0, 0.7]))).mesh
    section = middle_section(aside, np.zeros_like(aside.nodes_mm))
    assert section.elements.size >= 16 * 6 * 2
    assert np.ptp(section.corners_mm[..., 0]) == pytest.approx(24.0, abs=0.5)
    assert len(section.skin_mm) > 20


def mirrored(parts: MeshParts) -> MeshParts:
    """Both halves of half a finger."""
    flat = np.abs(parts.nodes[:, 2]) < 1e-9
    other = np.where(flat, np.arange(len(flat)), len(flat) + np.cumsum(~flat) - 1)
    # A mirrored brick is turned inside out unless its lower and upper face change places.
    swapped = other[parts.elements][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    count = len(parts.elements)
    return MeshParts(
        parts.source,
        np.concatenate([parts.nodes, parts.nodes[~flat] * [1.0, 1.0, -1.0]]),
        np.concatenate([parts.elements, swapped]),
        np.concatenate([parts.labels, parts.labels + 10_000]),
        {name: np.union1d(rows, other[rows]) for name, rows in parts.node_sets.items() if name != "symmetry"},
        {name: np.concatenate([rows, rows + count]) for name, rows in parts.element_sets.items()},
    )


def test_end_organs_stay_in_their_sheet_and_skin_faces_look_outwards(parts):
    own = finger_from(parts)
    receptors, mesh = FreeReceptors(own.mesh), own.mesh
    middles = mesh.nodes_mm[mesh.elements[mesh.living_epidermis]].mean(axis=1)
    found = receptors.below(np.array([[8.0, 0.0], [9.5, 1.3], [12.0, -2.0]]))
    np.testing.assert_allclose(receptors.read(found, np.ones((1, len(middles)))), 1.0)
    np.testing.assert_allclose(
        receptors.read(found, middles[None, :, 0] * 2.0 + 1.0)[0], [17.0, 20.0, 25.0], atol=1e-6
    )
    deeper = finger_from(parts, receptor_depth_mm=1.0)
    assert set(deeper.mesh.layer[deeper.mesh.living_epidermis]) == {LAYERS.index("dermis")}
    for sites, says in (([[40.0, 0.0]], "volar skin"), ([[10.0, 0.0, 0.0]], "mm beside it")):
        with pytest.raises(fp.InputError, match=says):
            receptors.below(np.array(sites))
    mesh = finger_from(parts).mesh
    middle = mesh.nodes_mm[mesh.skin_faces].mean(axis=1) - np.array([8.0, 0.0, 0.0])
    corners = mesh.nodes_mm[mesh.skin_faces]
    outward = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    assert ((outward * middle).sum(axis=1) > 0.0).all()
    np.testing.assert_array_equal(
        np.sort(mesh.elements[mesh.skin_elements, 4:], axis=1), np.sort(mesh.skin_faces, axis=1)
    )


def test_wedges_share_a_triangle_whichever_corner_each_repeats():
    faces, owners, number = faces_of(np.array([[0, 1, 2, 2, 3, 4, 5, 5], [4, 5, 3, 3, 7, 8, 6, 6]]))
    assert np.bincount(owners).tolist() == [5, 5]
    times = np.bincount(number)[number]
    assert np.count_nonzero(times == 1) == 8
    assert [sorted(set(face)) for face in faces[times == 2].tolist()] == [[3, 4, 5], [3, 4, 5]]


def test_exports_take_a_mesh_of_one_s_own(parts, tmp_path):
    touch = fp.touch_of(finger_from(parts), BALL, MOTION, tissues="trial1", settings=STEPS)
    for kind in ("vtu", "csv", "npz", "netcdf", "abaqus", "calculix", "febio"):
        moduli = "long_term" if kind == "calculix" else None
        for file in fp.export_touch(tmp_path / kind, touch, kind, moduli):
            assert file.stat().st_size > 300
    again = finger_from(_read_inp(next((tmp_path / "abaqus").glob("*.inp"))))
    assert again.mesh.skin_area_mm2.sum() == pytest.approx(touch.mesh.skin_area_mm2.sum())


def test_a_population_and_a_file_of_a_touch_use_it(made, tmp_path):
    described = fp.TouchRequest.read(
        {
            "finger": {"kind": "mesh", "path": str(made), "receptor_depth_mm": 0.5},
            "object": {"kind": "sphere", "radius_mm": 4},
            "motion": {"depth_mm": 0.6, "hold_ms": 50},
            "afferents": {"rows": 3, "columns": 3},
            "outputs": ["figures", "csv", "spikes"],
        }
    )
    assert described.touch.finger == fp.read_finger(made, receptor_depth_mm=0.5)
    assert fp.TouchRequest.read({"finger": str(made), "object": "sphere"}).pressed_finger == fp.read_finger(
        made
    )
    assert described.population.positions_mm.mean(axis=0) == pytest.approx(
        described.pressed_finger.contact_mm, abs=1e-9
    )
    assert touch_key(described.touch) != touch_key(replace(described.touch, finger=fp.read_finger(made)))
    pressed = fp.touch(described, out=tmp_path / "touch")
    assert pressed.summary.largest_force_mn > 5.0
    assert (tmp_path / "touch" / "figures" / "touch.png").exists()
    laid = {"layout": "hexagonal", "region": {"shape": "pad"}}
    elsewhere = fp.TouchRequest.read({"finger": str(made), "object": "sphere", "afferents": laid})
    with pytest.raises(fp.InputError, match="layout must be grid on a mesh"):
        _ = elsewhere.population
    with pytest.raises(fp.InputError, match="finger must be of type Fingertip: got FingerMesh"):
        fp.UnrolledSkin(described.pressed_finger)


def without(parts, *sets):
    return replace(
        parts,
        node_sets={name: rows for name, rows in parts.node_sets.items() if name not in sets},
        element_sets={name: rows for name, rows in parts.element_sets.items() if name not in sets},
    )


def moved(parts, node, by):
    nodes = parts.nodes.copy()
    nodes[node] += by
    return replace(parts, nodes=nodes)


def inside_out(parts):
    elements = parts.elements.copy()
    elements[7] = elements[7][[4, 5, 6, 7, 0, 1, 2, 3]]
    return replace(parts, elements=elements)


def torn(parts):
    """An element with nodes of its own."""
    elements, count = parts.elements.copy(), len(parts.nodes)
    own = np.unique(elements[100])
    elements[100] = count + np.searchsorted(own, elements[100])
    return replace(parts, nodes=np.concatenate([parts.nodes, parts.nodes[own]]), elements=elements)


def holed(parts):
    """Without the outer elements of a place of the pad."""
    middle = parts.nodes[parts.elements].mean(axis=1)
    hole = (np.hypot(middle[:, 0] - 8.0, middle[:, 2] - 3.5) < 2.0) & (middle[:, 1] < 0.0)
    layer = np.zeros(len(parts.elements), dtype=bool)
    layer[parts.element_sets["stratum corneum"]] = True
    kept = np.flatnonzero(~(hole & layer))
    row = np.full(len(parts.elements), -1)
    row[kept] = np.arange(kept.size)
    sets = {name: row[rows][row[rows] >= 0] for name, rows in parts.element_sets.items()}
    return replace(parts, elements=parts.elements[kept], labels=parts.labels[kept], element_sets=sets)


def swapped_layers(parts):
    sets = dict(parts.element_sets)
    sets["dermis"], sets["subcutis"] = sets["subcutis"], sets["dermis"]
    return replace(parts, element_sets=sets)


@pytest.mark.parametrize(
    ("change", "given", "says"),
    [
        (inside_out, {}, "element .* is turned inside out"),
        (torn, {}, "open where two nodes lie at the same place"),
        (holed, {}, "the skin is open: its set has a hole of"),
        (swapped_layers, {}, "layers must lie below each other .*: dermis lies"),
        (lambda p: without(p, "skin"), {}, "set skin of nodes is missing: the file has symmetry, bone"),
        (lambda p: without(p, "bone"), {}, "set bone, nail or fixed of nodes is missing"),
        (lambda p: without(p, "dermis"), {}, "every element must be in the set of a layer: element"),
        (lambda p: without(p, *LAYERS), {},
         "set stratum corneum, .* of elements is missing: the file has none"),
        (lambda p: without(p, "symmetry"), {}, "is flat, so half a finger seems to be meant"),
        (lambda p: p, {"unit": "um"}, "with unit 'um'; give the unit of the file"),
        (lambda p: p, {"unit": "furlong"}, "unit must be one of mm, um, cm, m, inch"),
        (lambda p: p, {"axes": "x y"}, "axes must name the axes"),
        (lambda p: p, {"axes": "x y -z"}, "must not mirror it"),
        (lambda p: p, {"names": {"hide": "skin"}}, "names must be one of skin, bone"),
        (lambda p: p, {"names": {"dermis": "corium"}}, "set corium of elements is missing"),
        (lambda p: p, {"receptor_depth_mm": 30.0}, "end organs 30 mm below the skin must lie in the mesh"),
        (lambda p: p, {"receptor_depth_mm": -1.0}, "receptor_depth_mm must be greater than 0"),
        (lambda p: p, {"contact_mm": 10.0}, r"contact_mm must be a pair \[mm\]: got 10.0"),
        (lambda p: p, {"names": ["skin"]}, r"names must be of type Mapping: got \['skin'\]"),
        (lambda p: p, {"contact_mm": (90.0, 0.0)}, "position must lie on the finger"),
        (lambda p: moved(p, 5, np.nan), {}, "nodes must have finite coordinates"),
        (lambda p: replace(p, element_sets=p.element_sets | {"dermis": p.element_sets["stratum corneum"]}),
         {}, "an element must be in one layer: element .* is in stratum corneum and in dermis"),
        (lambda p: replace(p, node_sets=p.node_sets | {"skin": np.array([1, 2])}), {},
         "set skin must hold all corners"),
    ],
)  # fmt: skip
def test_bad_meshes_are_refused_with_file_set_and_element(parts, change, given, says):
    with pytest.raises(fp.InputError, match=says) as refused:
        finger_from(change(parts), **given)
    assert "\n" not in str(refused.value)
    if given.keys() <= {"receptor_depth_mm"} and "greater" not in says:
        assert str(refused.value).startswith("finger.msh: ")


CUBE = "*NODE\n" + "\n".join(
    f"{n}, {x}, {y}, {z}"
    for n, (x, y, z) in enumerate(
        [(0, 9, 0), (9, 9, 0), (9, 9, 9), (0, 9, 9), (0, 0, 0), (9, 0, 0), (9, 0, 9), (0, 0, 9)], start=1
    )
)
BRICK = "*ELEMENT, TYPE=C3D8, ELSET=DERMIS\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
WHOLE = CUBE + "\n" + BRICK
EMPTY = "\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n$Elements\n0\n$EndElements"


def test_a_deck_of_abaqus_may_use_every_way_to_name_a_set(tmp_path):
    path = tmp_path / "cube.inp"
    path.write_text(
        f"** a cube\n*Heading\n a cube\n{CUBE}\n"
        "*Element, type=C3D8R, elset=Part-1\n1, 1, 2, 3, 4,\n 5, 6, 7, 8\n"
        "*Elset, elset=Dermis\nPart-1\n*Nset, nset=held, generate\n1, 4, 1\n*Nset, nset=Bone\nheld\n"
        "*Surface, type=ELEMENT, name=Skin\nDermis, S2\n*Material, name=x\n*Elastic\n1., 0.3\n"
    )
    read = _read_inp(path)
    assert {name: rows.tolist() for name, rows in read.node_sets.items()} == {
        "HELD": [0, 1, 2, 3], "BONE": [0, 1, 2, 3], "SKIN": [4, 5, 6, 7],
    }  # fmt: skip
    own = finger_from(read, contact_mm=(4.0, 4.0))
    assert own.mesh.skin_area_mm2.sum() == pytest.approx(81.0)
    assert own.mesh.receptor_depth_mm == 0.471
    assert FACES.shape == (6, 4)


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.stl", "", "a mesh must be a file .inp, .msh or .vtu"),
        ("none.inp", None, "none.inp"),
        ("a.inp", "", "has no bricks or wedges"),
        ("a.inp", "1, 2, 3\n", "line 1: a keyword such as \\*NODE must come first"),
        ("a.inp", "*NODE\n1, 0, 0\n", "line 2: a node must have a number, x, y and z"),
        ("a.inp", "*NODE\n1, 0, 0, up\n", "line 2: numbers must stand here: got"),
        ("a.inp", "*NODE\na, 0, 0, 0\n", "line 2: a whole number must stand here: got 'a'"),
        ("a.inp", CUBE + "\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n", "line 10: .* got C3D4: .*lock"),
        ("a.inp", CUBE + "\n*ELEMENT, TYPE=C3D8\n1, 1, 2, 3\n", "line 11: an element C3D8 must have"),
        ("a.inp", WHOLE.replace("7, 8", "7, 80"), "element 1 must name nodes .* no node 80"),
        ("a.inp", WHOLE + BRICK, "line 13: element 1 must be defined once"),
        ("a.inp", WHOLE + "*NSET, NSET=SKIN\n99\n", "set SKIN must name nodes .* no node 99"),
        ("a.inp", WHOLE + "*SURFACE, NAME=SKIN\nDERMIS, S9\n", "surface SKIN must name faces S1 to S6"),
        ("a.inp", "*INCLUDE, INPUT=b.inp\n", "line 1: \\*INCLUDE is not read"),
        ("a.inp", "*PART, NAME=A\n*PART, NAME=B\n", "one part that is not moved"),
        ("a.msh", "hello", "section \\$Nodes is missing"),
        ("a.msh", "$MeshFormat\n3 0 8" + EMPTY, "must be 2.2 or 4.1"),
        ("a.msh", "$MeshFormat\n4.1 1 8" + EMPTY, "4.1, binary"),
        ("a.msh", "$MeshFormat\n2.2 0 8" + EMPTY, "physical groups"),
        (
            "a.msh",
            '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 "dermis"\n$EndPhysicalNames\n'
            "$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 4 2 1 1 1 1 1 1\n$EndElements",
            "line 14: elements must be of Gmsh's types 5 and 6, element 1 has 4: .*lock",
        ),
        ("a.vtu", "<html>", "an XML file of a VTK unstructured grid must be here"),
        ("none.vtu", None, "none.vtu: the file cannot be read"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_with_their_line(tmp_path, name, text, says):
    path = tmp_path / name
    if text is not None:
        path.write_text(text)
    with pytest.raises(fp.InputError, match=says) as refused:
        fp.read_finger(path)
    assert "\n" not in str(refused.value)
    assert name in str(refused.value)


BALLS = """\
question: Can two balls be told apart?
finger: finger.inp
resolution: quick
object: {kind: sphere}
stimuli: {vary: object.radius_mm, values: [3.0, 4.0]}
standard: 3.0
noise: 0.05
"""


def test_a_task_presses_all_stimuli_into_the_mesh(sent):
    folder, skin = sent
    path = folder / "task.yaml"
    path.write_text(BALLS)
    task = fp.DiscriminationRequest.read(path)
    meshes = [touch.mesh for touch in task.touches.values()]
    assert meshes[0] is meshes[1]
    assert len(meshes[0].nodes_mm) == len(skin.mesh.nodes_mm)
    assert str(folder / "finger.inp") in task.input_hashes()
    path.write_text(BALLS + "reach_mm: 3\n")
    with pytest.raises(fp.InputError, match="reach_mm must not be given: the finger has a mesh of its own"):
        fp.DiscriminationRequest.read(path).check()


def test_stimuli_of_a_fit_are_pressed_into_the_mesh(sent):
    folder, skin = sent
    path = folder / "stimuli.yaml"
    path.write_text("finger: finger.inp\nobject: sphere\nstimuli: [{name: probe}]\n")
    read = read_stimuli(path)
    assert read.finger_files == (folder / "finger.inp",)
    (touch,) = read.touches([read.named("probe")], read.conditions).values()
    assert len(touch.mesh.nodes_mm) == len(skin.mesh.nodes_mm)
