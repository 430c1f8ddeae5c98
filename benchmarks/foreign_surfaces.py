"""Surfaces that other programs made, and the faults that their files have: 30 bodies of one kind each.

They are written as files by trimesh, PyVista and VTK, or shipped with PyVista and Matplotlib. Tests read them
(tests/test_foreign_surfaces.py).
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

import fingerpad as fp
from fingerpad.core.values import FloatArray
from fingerpad.geometry.surface import Surface

SEED = 46


def read(name: str, folder: Path) -> Surface:
    """Write one of `BODIES` to a file in a folder and read it."""
    make, ending, options = BODIES[name]
    path = folder / f"{name.replace(' ', '-')}{ending}"
    made = make()
    if isinstance(made, Path):
        return fp.read_surface(made, **options)
    if ending == ".npy":
        np.save(path, made)
        return fp.read_height_map(path, **options)
    made.export(path)
    return fp.read_surface(path, **options)


def _trimesh() -> Any:
    import trimesh

    return trimesh


def _mesh(vertices: Any, faces: Any) -> Any:
    return _trimesh().Trimesh(vertices, faces, process=False)


def _of(dataset: Any) -> Any:
    """Return the triangles of a PyVista data set."""
    surface = dataset.extract_surface(algorithm="dataset_surface").triangulate()
    return _mesh(surface.points, surface.faces.reshape(-1, 4)[:, 1:])


def _together(*parts: Any) -> Any:
    return _trimesh().util.concatenate(parts)


def _at(part: Any, *place: float) -> Any:
    return part.apply_translation(place)


def _ball(radius_mm: float = 2.0) -> Any:
    return _trimesh().creation.icosphere(subdivisions=4, radius=radius_mm)


def _box(*size: float) -> Any:
    return _trimesh().creation.box(size)


def _pins() -> Any:
    pin = _trimesh().creation.capsule(height=2.0, radius=0.5, count=[24, 24])
    places = [(2.0 * i, 2.0 * k, 0.5) for i in (-1, 0, 1) for k in (-1, 0, 1)]
    return _together(_box(6.0, 6.0, 1.0), *(_at(pin.copy(), *place) for place in places))


def _fingertip() -> Any:
    """Make a robot's fingertip, a capsule that a link enters, in metres."""
    tip = _at(_trimesh().creation.capsule(height=8.0, radius=6.0, count=[48, 48]), 0.0, 0.0, -14.0)
    return _together(tip, _at(_box(10.0, 10.0, 8.0), 0.0, 0.0, -14.0)).apply_scale(1e-3)


def _gear() -> Any:
    """Make a gear of twelve teeth that lies on its side, closed by fans."""
    turn = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    radius = np.where(np.arange(48) % 4 < 2, 4.0, 3.2)
    rim = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])
    vertices = [[0, 0, -1.0], *([x, y, -1.0] for x, y in rim), [0, 0, 1.0], *([x, y, 1.0] for x, y in rim)]
    k = np.arange(48)
    a, b = 1 + k, 1 + (k + 1) % 48
    sides = [[a, b, b + 49], [a, b + 49, a + 49], [0 * a, b, a], [0 * a + 49, a + 49, b + 49]]
    return _mesh(vertices, np.concatenate([np.column_stack(side) for side in sides]))


def _text() -> Any:
    import pyvista

    return _of(pyvista.Text3D("R", depth=0.3, height=5.0))


def _terrain() -> FloatArray:
    from matplotlib.cbook import get_sample_data

    data: Any = get_sample_data("jacksboro_fault_dem.npz")
    with data:
        return data["elevation"][:240:2, :240:2].astype(np.float64)


def _noise() -> FloatArray:
    """Heights of a rough surface whose spectrum falls with the square of the frequency."""
    random = np.random.default_rng(SEED)
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(128), np.fft.fftfreq(128)))
    spectrum = np.fft.fft2(random.normal(size=(128, 128))) / np.maximum(frequency, 0.03) ** 2
    return np.fft.ifft2(spectrum * (frequency > 0)).real


def _shaken(mesh: Any, by_mm: float) -> Any:
    """Each triangle with corners of its own, moved at random."""
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    moved = corners + np.random.default_rng(SEED).uniform(-by_mm, by_mm, corners.shape)
    return _mesh(moved, np.arange(len(corners)).reshape(-1, 3))


def _flipped(mesh: Any, share: float) -> Any:
    turned = np.random.default_rng(SEED).random(len(mesh.faces)) < share
    return _mesh(mesh.vertices, np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces))


def _without(mesh: Any, which: Callable[[FloatArray], Any]) -> Any:
    """Leave out the triangles whose middles are so."""
    return _mesh(mesh.vertices, mesh.faces[~which(mesh.triangles_center)])


def _divided_sides() -> Any:
    """Make a box whose top has twice as many triangles along its border as the sides."""
    box = _box(4.0, 4.0, 2.0)
    top = _without(box, lambda middle: middle[:, 2] < 0.99).subdivide()
    return _together(_without(box, lambda middle: middle[:, 2] > 0.99), top)


def _with_slivers() -> Any:
    ball = _ball()
    return _mesh(ball.vertices, np.concatenate([ball.faces, ball.faces[:40, [0, 1, 1]]]))


def _pyvista(name: str) -> Callable[[], Path]:
    return lambda: Path(str(files("pyvista.examples"))) / name


def _parametric(name: str, *sizes: float) -> Callable[[], Any]:
    def make() -> Any:
        import pyvista

        return _of(getattr(pyvista, name)(*sizes).clean())

    return make


UP = {"up": "+z"}

BODIES: dict[str, tuple[Callable[[], Any], str, dict[str, Any]]] = {
    "ball": (_ball, ".stl", UP),
    "ball of text": (lambda: _ball(), ".obj", UP),
    "box": (lambda: _box(4.0, 4.0, 2.0), ".ply", UP),
    "torus": (lambda: _trimesh().creation.torus(4.0, 1.5), ".stl", UP),
    "cone": (lambda: _trimesh().creation.cone(3.0, 3.0), ".stl", UP),
    "cylinder": (lambda: _trimesh().creation.cylinder(2.0, 12.0), ".obj", {"up": "+x"}),
    "ring": (lambda: _trimesh().creation.annulus(2.0, 4.0, 2.0), ".ply", UP),
    "two balls": (lambda: _together(_at(_ball(), -1.0, 0, 0), _at(_ball(), 1.0, 0, 0)), ".stl", UP),
    "balls apart": (lambda: _together(_at(_ball(1.0), -1.5, 0, 0), _at(_ball(1.0), 1.5, 0, 0)), ".stl", UP),
    "ball in a ball": (lambda: _together(_ball(), _ball(1.0)), ".stl", UP),
    "boxes side by side": (
        lambda: _together(_at(_box(2, 4, 2), -1, 0, 0), _at(_box(2, 4, 2), 1, 0, 0)), ".stl", UP,
    ),
    "nine pins": (_pins, ".stl", UP),
    "fingertip of a robot": (_fingertip, ".stl", {"unit": "m", "up": "+z"}),
    "gear": (_gear, ".stl", UP),
    "letter": (_text, ".stl", UP),
    "terrain": (_terrain, ".npy", {"pitch_mm": 0.1, "height_mm": 0.004}),
    "rough": (_noise, ".npy", {"pitch_mm": 0.08, "height_mm": 0.002}),
    "soup": (lambda: _shaken(_ball(), 0.0), ".obj", UP),
    "shaken soup": (lambda: _shaken(_ball(), 1e-6), ".obj", UP),
    "inside out": (lambda: _mesh(_ball().vertices, _ball().faces[:, ::-1]), ".stl", UP),
    "one part inside out": (
        lambda: _together(_at(_ball(1.0), -1.5, 0, 0), _flipped(_at(_ball(1.0), 1.5, 0, 0), 1.0)), ".stl", UP,
    ),
    "some triangles turned": (lambda: _flipped(_ball(), 0.2), ".stl", UP),
    "triangles twice": (lambda: _together(_ball(), _ball()), ".stl", UP),
    "slivers": (_with_slivers, ".obj", UP),
    "hole below": (lambda: _without(_ball(), lambda middle: middle[:, 2] < -1.0), ".stl", UP),
    "T-junctions": (_divided_sides, ".stl", UP),
    "in inches": (lambda: _ball(2.0 / 25.4), ".stl", {"unit": "inch", "up": "+z"}),
    "in micrometres": (lambda: _ball(2000.0), ".stl", {"unit": "um", "up": "+z"}),
    "airplane": (_pyvista("airplane.ply"), "", {"scale": 0.01, "up": "+z"}),
    "ant": (_pyvista("ant.ply"), "", {"scale": 0.5, "up": "+z"}),
    "nut": (_pyvista("nut.ply"), "", {"scale": 0.3, "up": "+z"}),
    "sphere of PyVista": (_pyvista("sphere.ply"), "", {"scale": 0.02, "up": "+z"}),
    "superellipsoid": (_parametric("ParametricSuperEllipsoid", 3.0, 3.0, 2.0), ".stl", UP),
    "superquadric": (_parametric("Superquadric"), ".stl", {"scale": 5.0, "up": "+z"}),
    # Those below cannot be a body.
    "Möbius strip": (_parametric("ParametricMobius"), ".stl", {"scale": 3.0, "up": "+z"}),
    "hole above": (lambda: _without(_ball(), lambda middle: middle[:, 2] > 1.0), ".stl", UP),
    "in metres as mm": (lambda: _ball(2e-3), ".stl", UP),
    "fin": (lambda: _mesh([[0, 0, 0], [5, 0, 0], [0, 5, 0], [5, 5, 0], [2, 2, 5]],
                          [[0, 1, 2], [2, 1, 3], [2, 1, 4]]), ".obj", UP),
    "boxes almost side by side": (
        lambda: _together(_at(_box(2, 4, 2), -1.002, 0, 0), _at(_box(2, 3, 2), 1, 0, 0)), ".stl", UP,
    ),
}  # fmt: skip
"""What makes each, the ending of its file, and how it is read."""
