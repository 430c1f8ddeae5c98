"""A touch as one labelled data set: variables with named dimensions, units and words, declared once.

Fields of the press are those of `skin.fields.FIELDS` under their names there, so that a field that is added
there is here; mesh and object are declared in `PARTS`, what receptors answer in `core.signals.ResponseMap`.

Dimensions: `time`; `axis` (x distal, y towards the back, z lateral); `node`, `skin_node`, `element` and
`sheet` (elements of the living epidermis above the dermis) of the mesh; `facet`, the faces of the skin;
`component` of tensors (xx, yy, zz, xy, yz, xz); `receptor` and `spike`. Spike times are a contiguous ragged
array of the CF conventions: those of the first receptor, then those of the second; `spike_count` says how
many each has. The indenter is a height map of its face in its own frame, with its position at each time.

Units are as UDUNITS reads them: "mm2" and "uJ".
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from importlib.metadata import version
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerpad.core.displayed import Attributes, Variable, udunits
from fingerpad.core.errors import InputError
from fingerpad.core.signals import ResponseMap
from fingerpad.core.values import one_of
from fingerpad.geometry.mesh import LAYERS, Mesh
from fingerpad.skin.fields import FIELDS, Field, Place, Times, stored_fields

if TYPE_CHECKING:
    from fingerpad.geometry.indenters import Indenter
    from fingerpad.skin.indentation import Touch
    from fingerpad.skin.sampling import SkinResponse

FORMAT, FORMAT_VERSION = "fingerpad touch", 1

PLACES: Mapping[Place, tuple[str, ...]] = {
    Place.PRESS: (),
    Place.NODE: ("node",),
    Place.SKIN_NODE: ("skin_node",),
    Place.ELEMENT: ("element",),
    Place.WATCHED: ("sheet",),
}
"""Dimension of the values of a field by their place."""

_COMPONENTS: Mapping[int, tuple[str, ...]] = {1: (), 3: ("axis",), 6: ("component",)}

_LONGEST_LIST = 200
"""Longer lists of numbers in a description are given by their length alone: an attribute is not for data."""

_OBJECT_REACH_MM, _OBJECT_STEPS = (14.0, 10.0), 240
"""Half-extent along x and z of the height map of an indenter, and its number of steps along each."""


@dataclass(frozen=True)
class Part:
    """One variable of the mesh or the object."""

    unit: str  #: Unit, "1" for a pure number; empty for numbers of nodes or elements, which have none.
    dims: tuple[str, ...]
    long_name: str
    of: Callable[[Mesh], np.ndarray] | None = None  #: Reads it from a mesh.
    points_into: str = ""  #: Dimension of which it holds numbers, from 0.
    holes: bool = False  #: Whether it may be NaN.

    def variable(self, values: np.ndarray) -> Variable:
        stored = values.astype(np.int32) if values.dtype.kind in "iu" else values
        return self.dims, stored, {"long_name": self.long_name} | ({"units": self.unit} if self.unit else {})


MESH_PARTS: Mapping[str, Part] = {
    "node_mm": Part("mm", ("node", "axis"), "undeformed nodes", attrgetter("nodes_mm")),
    "element_nodes": Part(
        "", ("element", "corner"), "nodes of each brick, bone side first", attrgetter("elements"), "node"
    ),
    "layer": Part("", ("element",), "layer of the skin", attrgetter("layer")),
    "skin_node": Part("", ("skin_node",), "nodes of the skin", attrgetter("skin_nodes"), "node"),
    "facet_nodes": Part(
        "", ("facet", "facet_corner"), "nodes of the faces of the skin", attrgetter("skin_faces"), "node"
    ),
    "facet_element": Part(
        "", ("facet",), "outermost element below each face", attrgetter("skin_elements"), "element"
    ),
    "sheet": Part(
        "", ("sheet",), "elements whose fields are kept, those of the living epidermis first",
        lambda mesh: mesh.living_epidermis.ravel(), "element",
    ),
    "bone": Part("", ("bone_node",), "nodes on the bone", attrgetter("bone_nodes"), "node"),
    "nail": Part("", ("nail_node",), "nodes under the nail", attrgetter("nail_nodes"), "node"),
}  # fmt: skip
OBJECT_PARTS: Mapping[str, Part] = {
    "object_x": Part("mm", ("object_x",), "x in the frame of the indenter"),
    "object_z": Part("mm", ("object_z",), "z in the frame of the indenter"),
    "object_front_mm": Part(
        "mm", ("object_x", "object_z"), "height y of its face towards the skin", holes=True
    ),
    "object_tip_mm": Part("mm", ("time", "axis"), "tip of the indenter"),
    "object_axes": Part("1", ("time", "axis", "object_axis"), "axes x, y and z of the indenter as columns"),
}
PARTS = {**MESH_PARTS, **OBJECT_PARTS}


def variables(
    skin: SkinResponse, response: ResponseMap | None, quantities: Sequence[str]
) -> dict[str, Variable]:
    for name in quantities:
        one_of("quantity", name, tuple(FIELDS))
        if skin.deformation is None and name not in skin.fields:
            raise InputError(
                f"quantity {name} needs stress and strain of all elements: solve the touch with whole=True."
            )
    found = dict(_fields(skin, quantities))
    found["time"] = found.pop("times_ms")
    found |= {name: part.variable(part.of(skin.mesh)) for name, part in MESH_PARTS.items() if part.of}
    found["sheet"] = MESH_PARTS["sheet"].variable(skin.watched_elements)
    found["layer"][2].update(
        flag_values=np.arange(len(LAYERS), dtype=np.int32),
        flag_meanings=" ".join(name.replace(" ", "_") for name in LAYERS),
    )
    if skin.touch is not None:
        placed = _object_values(skin.touch, skin)
        found |= {name: part.variable(placed[name]) for name, part in OBJECT_PARTS.items()}
    return found if response is None else found | response.contents()[0]


def field_variable(field: Field, values: np.ndarray, place: tuple[str, ...] | None = None) -> Variable:
    """Variable of a field, over time or at the end; `place` if its values are elsewhere than declared."""
    about: Attributes = {"long_name": field.long_name, "units": udunits(field.unit)}
    dims = (*(PLACES[field.place] if place is None else place), *_COMPONENTS[field.components])
    dims = ("time", *dims) if values.ndim > len(dims) else dims
    return dims, values if field.place is Place.PRESS else values.astype(np.float32), about


def dimensions_of(field: Field) -> set[tuple[str, ...]]:
    """Return the dimensions that the variable of a field may have."""
    ends = (*PLACES[field.place], *_COMPONENTS[field.components])
    watched = {("time", "element", *ends[1:])} if field.place is Place.WATCHED else set()
    return {ends, ("time", *ends)} | watched


def _fields(skin: SkinResponse, quantities: Sequence[str]) -> Iterator[tuple[str, Variable]]:
    n_times, deformation = skin.times_ms.size, skin.deformation
    names = dict.fromkeys([*(field.name for field in stored_fields()), *quantities])
    for name in (name for name in names if name in skin.fields or name in quantities):
        field, place = FIELDS[name], None
        values = skin.fields.get(name)
        if deformation is not None and (values is None or field.stored is Times.LAST):
            values = field.of(deformation, skin.mesh)
            place = ("element",) if field.place is Place.WATCHED else None
            values = values if len(values) == n_times else values[-1]
        assert values is not None
        variable = field_variable(field, values, place)
        if "time" not in variable[0]:
            variable[2]["at_time_ms"] = float(skin.times_ms[-1])
        yield name, variable


def _object_values(touch: Touch, skin: SkinResponse) -> dict[str, np.ndarray]:
    """Values of `OBJECT_PARTS`: the face as far as the finger reaches, and where it is at each time."""
    *lines, front = _face(touch.body, _OBJECT_REACH_MM)
    # A small body is mapped as finely as a large one, with its side.
    widest = [np.abs(line[np.isfinite(front).any(axis=1 - axis)]).max(initial=0.0)
              for axis, line in enumerate(lines)]  # fmt: skip
    if min(widest) > 0.0:
        reach = [min(width + 2 * (line[1] - line[0]), line[-1])
                 for width, line in zip(widest, lines, strict=True)]  # fmt: skip
        *lines, front = _face(touch.body, reach)
    placement, motion = touch.placement, touch.stimulus
    placed = [placement.moved(motion.pose_at(float(time))) for time in skin.times_ms]
    tips = [place.tip_mm(float(depth)) for place, depth in zip(placed, skin.depth_mm, strict=True)]
    return {
        "object_x": lines[0],
        "object_z": lines[1],
        "object_front_mm": np.where(np.isfinite(front), front, np.nan),
        "object_tip_mm": np.array(tips),
        "object_axes": np.array([place.rotation for place in placed]),
    }


def _face(body: Indenter, reach_mm: Sequence[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Height map of the face of a body in its own frame: x, z and y (n_x, n_z), -inf beside it. [mm]"""
    x, z = (np.linspace(-reach, reach, _OBJECT_STEPS + 1) for reach in reach_mm)
    points = np.stack(np.meshgrid(x, [0.0], z, indexing="ij"), axis=-1).reshape(-1, 3)
    return x, z, body.front(points).reshape(x.size, z.size)


def attributes(skin: SkinResponse, response: ResponseMap | None, seed: int | None) -> Attributes:
    found: Attributes = {
        "Conventions": "CF-1.11",
        "title": "Touch of a fingertip",
        "source": f"fingerpad {version('fingerpad')}",
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "axes": "x distal, y towards the back of the finger, z lateral",
        "half_finger": int(not skin.mesh.full),
        "phases": _json(skin.phases),
        "linear_solver": skin.linear_solver,
        "force_imbalance": skin.force_imbalance,
        "energy_imbalance": skin.energy_imbalance,
    }
    if (touch := skin.touch) is not None:
        described = ("indenter", "tissues", "finger", "grading")
        found |= {name: _json(getattr(touch, name)) for name in described}
        found |= {"motion": _json(touch.stimulus), "at_mm": list(touch.at_mm)}
        found |= {name: getattr(touch, name) for name in ("tilt_deg", "spin_deg", "friction")}
    if response is not None:
        found["receptor_pitch_mm"] = response.pitch_mm
    return found if seed is None else {**found, "seed": seed}


def _json(value: Any) -> str:
    return json.dumps(_described(value))


def _described(value: Any) -> Any:
    """Return a description as JSON holds it; long lists by their length."""
    if is_dataclass(value) and not isinstance(value, type):
        parts = {part.name: _described(getattr(value, part.name)) for part in fields(value) if part.repr}
        return {"class": type(value).__name__, **parts}
    if isinstance(value, np.ndarray):
        return _described(value.tolist()) if value.size <= _LONGEST_LIST else {"shape": list(value.shape)}
    if isinstance(value, list | tuple):
        longer = len(value) > _LONGEST_LIST
        return {"length": len(value)} if longer else [_described(item) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value if isinstance(value, str | int | float | bool) or value is None else type(value).__name__
