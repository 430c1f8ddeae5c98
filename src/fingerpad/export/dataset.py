"""The result of a touch as one labelled data set, in NetCDF or Zarr.

Every variable has named dimensions, a unit and a `long_name`. Fields of the press are those of
`skin.fields.FIELDS` under their names there, so that a field that is added there is written here. Mesh,
object and afferents are declared once, in `PARTS`; `read_touch` checks a file against both declarations.

Dimensions: `time`; `axis` (x distal, y towards the back, z lateral); `node`, `skin_node`, `element` and
`sheet` (elements of the living epidermis above the dermis) of the mesh; `facet`, the faces of the skin;
`component` of tensors (xx, yy, zz, xy, yz, xz); `receptor` and `spike`. Spike times are a contiguous ragged
array of the CF conventions: those of the first receptor, then those of the second; `spike_count` says how
many each has. The indenter is a height map of its face in its own frame, with its position at each time.

Units are as UDUNITS reads them: "mm2" and "uJ". The extra `fingerpad[netcdf]` is required.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from secrets import token_hex
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.files import path_of, write_atomically
from fingerpad.core.signals import ResponseMap, SpikeTrains
from fingerpad.core.values import Whole, one_of
from fingerpad.geometry.mesh import LAYERS, Mesh
from fingerpad.skin.fields import FIELDS, Field, Place, Times, stored_fields
from fingerpad.skin.sampling import SkinResponse

if TYPE_CHECKING:
    import xarray

    from fingerpad.geometry.indenters import Indenter
    from fingerpad.skin.indentation import Touch

FORMAT, FORMAT_VERSION = "fingerpad touch", 1

FILE_NAMES = ("touch.nc", "touch.zarr")  # Names under which a folder of results holds a touch.

SUFFIXES = (".nc", ".zarr")

_PLACES = {
    Place.PRESS: (),
    Place.NODE: ("node",),
    Place.SKIN_NODE: ("skin_node",),
    Place.ELEMENT: ("element",),
    Place.WATCHED: ("sheet",),
}
_COMPONENTS: dict[int, tuple[str, ...]] = {1: (), 3: ("axis",), 6: ("component",)}
_UDUNITS = {
    "": "1", "mm²": "mm2", "mm³": "mm3", "µJ": "uJ", "degrees": "degree", "spikes/s": "s-1", "Hz": "s-1",
    "1/m": "m-1", "1/mm": "mm-1", "1/cm²": "cm-2", "mm/s": "mm s-1",
}  # fmt: skip
"""Units that UDUNITS spells otherwise."""

Attributes = dict[str, str | float | list[float] | np.ndarray]
"""Attributes of a variable or of the whole data set."""

_LONGEST_LIST = 200
"""Longer lists of numbers in a description are given by their length alone: an attribute is not for data."""

_OBJECT_REACH_MM, _OBJECT_STEPS = (14.0, 10.0), 240
"""Half-extent along x and z of the height map of an indenter, and its number of steps along each."""


@dataclass(frozen=True)
class Variable:
    """One variable that is no field of the press."""

    unit: str  # Unit, "1" for a pure number; empty for numbers of nodes or elements, which have none.
    dims: tuple[str, ...]
    long_name: str
    points_into: str = ""  # Dimension of which it holds numbers, from 0.
    holes: bool = False  # Whether it may be NaN.


MESH_PARTS = {
    "node_mm": Variable("mm", ("node", "axis"), "undeformed nodes"),
    "element_nodes": Variable("", ("element", "corner"), "nodes of each brick, bone side first", "node"),
    "layer": Variable("", ("element",), "layer of the skin"),
    "skin_node": Variable("", ("skin_node",), "nodes of the skin", "node"),
    "facet_nodes": Variable("", ("facet", "facet_corner"), "nodes of the faces of the skin", "node"),
    "facet_element": Variable("", ("facet",), "outermost element below each face", "element"),
    "sheet": Variable("", ("sheet",), "elements of the living epidermis above the dermis", "element"),
    "bone": Variable("", ("bone_node",), "nodes on the bone", "node"),
    "nail": Variable("", ("nail_node",), "nodes under the nail", "node"),
}
OBJECT_PARTS = {
    "object_x": Variable("mm", ("object_x",), "x in the frame of the indenter"),
    "object_z": Variable("mm", ("object_z",), "z in the frame of the indenter"),
    "object_front_mm": Variable(
        "mm", ("object_x", "object_z"), "height y of its face towards the skin", holes=True
    ),
    "object_tip_mm": Variable("mm", ("time", "axis"), "tip of the indenter"),
    "object_axes": Variable(
        "1", ("time", "axis", "object_axis"), "axes x, y and z of the indenter as columns"
    ),
}
RESPONSE_PARTS = {
    "receptor_mm": Variable("mm", ("receptor", "coordinate"), "place of each end organ"),
    "dynamic_rate_hz": Variable("s-1", ("receptor",), "firing rate in the ramp"),
    "static_rate_hz": Variable("s-1", ("receptor",), "firing rate in the hold"),
    "dynamic_count_hz": Variable("s-1", ("receptor",), "spikes in the ramp over its window", holes=True),
    "static_count_hz": Variable("s-1", ("receptor",), "spikes in the hold over its window", holes=True),
    "first_spike_latency_ms": Variable(
        "ms", ("receptor",), "time from first touch to the first spike", holes=True
    ),
    "spike_count": Variable("1", ("receptor",), "number of spikes of each receptor"),
    "spike_time_ms": Variable("ms", ("spike",), "spike times, receptor by receptor"),
}
PARTS = {**MESH_PARTS, **OBJECT_PARTS, **RESPONSE_PARTS}  # Variables beside the fields of the press, by name.


@checked
def touch_dataset(
    skin: SkinResponse,
    response: ResponseMap | None = None,
    *,
    quantities: Sequence[str] = (),
    seed: Whole | None = None,
) -> xarray.Dataset:
    """Put the result of a touch into one labelled data set.

    Parameters
    ----------
    skin : SkinResponse
        From `indent` or `Touch.solve`. With its deformation (`whole=True`) the displacement of all nodes is
        there at all times, else at the last time; that of the skin always is.
    response : ResponseMap, optional
        Response of a population to it.
    quantities : sequence of str
        Further fields of `skin.fields.FIELDS`, such as "stress", in all elements; they need the deformation.
    seed : int, optional
        Seed behind the population, if it had one; kept as an attribute.

    Returns
    -------
    xarray.Dataset
        What is at nodes and elements is in single precision, all else in double.

    Examples
    --------
    >>> import fingerpad as fp
    >>> skin = fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.3))
    >>> touch = touch_dataset(skin)
    >>> touch.contact_pressure_kpa.dims, touch.contact_pressure_kpa.units
    (('time', 'skin_node'), 'kPa')
    >>> f"{touch.depth_mm[-1].item():g} {touch.depth_mm.units}"
    '0.3 mm'
    """
    xarray = library("xarray")
    for name in quantities:
        one_of("quantity", name, tuple(FIELDS))
        if skin.deformation is None and name not in skin.fields:
            raise InputError(
                f"quantity {name} needs stress and strain of all elements: solve the touch with whole=True."
            )
    variables = dict(_fields(skin, quantities))
    coordinates = {"time": variables.pop("times_ms")}
    values = _mesh_values(skin.mesh, skin.watched_elements)
    if skin.touch is not None:
        values |= _object_values(skin.touch, skin)
    if response is not None:
        values |= response_values(response)
    for name, value in values.items():
        (coordinates if PARTS[name].dims == (name,) else variables)[name] = part_variable(name, value)
    variables["layer"][2].update(
        flag_values=np.arange(len(LAYERS), dtype=np.int32),
        flag_meanings=" ".join(name.replace(" ", "_") for name in LAYERS),
    )
    if response is not None:
        variables["spike_count"][2]["sample_dimension"] = "spike"
    return xarray.Dataset(variables, coordinates, _attributes(skin, response, seed))


@checked
def write_touch(
    path: str | Path,
    skin: SkinResponse,
    response: ResponseMap | None = None,
    *,
    quantities: Sequence[str] = (),
    seed: Whole | None = None,
) -> tuple[Path, ...]:
    """Write the result of a touch as NetCDF (.nc) or Zarr (.zarr).

    Parameters
    ----------
    path : str or Path
        The file, or the folder of a Zarr store, written as a whole or not at all; an older one is replaced.
    skin, response, quantities, seed
        As in `touch_dataset`.

    Raises
    ------
    StoreError
        If it cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import fingerpad as fp
    >>> skin = fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.3))
    >>> with TemporaryDirectory() as folder:
    ...     write_touch(Path(folder) / "touch.nc", skin)[0].name
    ...     read_touch(folder).depth_mm.values[-1].item()
    'touch.nc'
    0.3
    """
    path = path_of("path", path)
    if path.suffix not in SUFFIXES:
        raise InputError(f"A touch is written as {' or '.join(SUFFIXES)}: got {path.name}.")
    library("h5netcdf" if path.suffix == ".nc" else "zarr")
    data = touch_dataset(skin, response, quantities=quantities, seed=seed)
    if path.suffix == ".zarr":
        _write_zarr(path, data)
        return (path,)
    packed = {name: {"zlib": True, "complevel": 4} for name, values in data.variables.items() if values.ndim}
    with TemporaryDirectory() as folder:
        unfinished = Path(folder) / "touch.nc"
        data.to_netcdf(unfinished, engine="h5netcdf", encoding=packed)
        write_atomically(path, unfinished.read_bytes())
    return (path,)


@checked
def read_touch(path: str | Path) -> xarray.Dataset:
    """Read the result of a touch into memory, and check it.

    Parameters
    ----------
    path : str or Path
        A file or folder of `write_touch`, or a folder that holds `touch.nc` or `touch.zarr`.

    Raises
    ------
    InputError
        If it cannot be read, or is not what `write_touch` writes: another format or version, a variable that
        is missing or has another unit, other dimensions, numbers that are not finite, or numbers of nodes and
        elements that do not exist.
    """
    found = touch_file(path_of("path", path))
    if found.suffix not in SUFFIXES:
        raise InputError(
            found,
            f"must be a touch that fingerpad wrote, as {' or '.join(SUFFIXES)}",
            remedy="its name has another ending",
        )
    xarray = library("xarray")
    engine = "zarr" if found.is_dir() else "h5netcdf"
    library(engine)
    options = {"consolidated": False} if engine == "zarr" else {}
    try:
        with xarray.open_dataset(found, engine=engine, decode_times=False, **options) as opened:
            data = opened.load()
    except Exception as error:  # a file of unknown content may fail in any way
        raise InputError(
            found,
            f"must be a touch that fingerpad wrote, as {' or '.join(SUFFIXES)}",
            remedy=f"it cannot be read ({first_line(error)})",
        ) from error
    check_touch(str(found), data)
    return data


def touch_file(path: Path) -> Path:
    """Return the file of a touch: `path` itself, or the one in this folder."""
    try:
        path.stat()
        held = [path / name for name in FILE_NAMES if (path / name).exists()]
    except FileNotFoundError as error:
        raise InputError(
            path, "must be a touch that fingerpad wrote", remedy="there is no such file"
        ) from error
    except (OSError, ValueError) as error:  # no right to look, or no possible name
        said = getattr(error, "strerror", None) or error
        raise InputError(f"{str(path)[:200]!r} must be a file or folder that can be read: {said}.") from error
    if path.is_dir() and path.suffix != ".zarr":
        if not held:
            raise InputError(path, f"must hold {' or '.join(FILE_NAMES)}", remedy="there is neither")
        return held[0]
    if not (path.is_dir() or path.is_file()):
        raise InputError(path, "must be a file or a folder", remedy="it is neither")
    return path


def spike_trains(data: xarray.Dataset) -> SpikeTrains:
    """Spike trains of the receptors of a data set."""
    offsets = np.concatenate([[0], np.cumsum(data["spike_count"].values)])
    return SpikeTrains(data["spike_time_ms"].values, offsets)


def _fields(
    skin: SkinResponse, quantities: Sequence[str]
) -> Iterator[tuple[str, tuple[tuple[str, ...], np.ndarray, Attributes]]]:
    """Variables of the fields of a press: dimensions, values and attributes, by name."""
    n_times, deformation = skin.times_ms.size, skin.deformation
    names = dict.fromkeys([*(field.name for field in stored_fields()), *quantities])
    for name in (name for name in names if name in skin.fields or name in quantities):
        field = FIELDS[name]
        place, values = _PLACES[field.place], skin.fields.get(name)
        if deformation is not None and (values is None or field.stored is Times.LAST):
            values = field.of(deformation, skin.mesh)
            place = ("element",) if field.place is Place.WATCHED else place
            values = values if len(values) == n_times else values[-1]
        assert values is not None
        attributes: Attributes = {"long_name": field.long_name, "units": udunits(field.unit)}
        dims = (*place, *_COMPONENTS[field.components])
        if values.ndim > len(dims):
            dims = ("time", *dims)
        else:
            attributes["at_time_ms"] = float(skin.times_ms[-1])
        yield name, (dims, values if field.place is Place.PRESS else values.astype(np.float32), attributes)


def _mesh_values(mesh: Mesh, watched: np.ndarray) -> dict[str, np.ndarray]:
    numbers = {
        "element_nodes": mesh.elements,
        "layer": mesh.layer,
        "skin_node": mesh.skin_nodes,
        "facet_nodes": mesh.skin_faces,
        "facet_element": mesh.skin_elements,
        "sheet": watched,
        "bone": mesh.bone_nodes,
        "nail": mesh.nail_nodes,
    }
    return {"node_mm": mesh.nodes_mm, **{name: ids.astype(np.int32) for name, ids in numbers.items()}}


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


def part_variable(name: str, value: np.ndarray) -> tuple[tuple[str, ...], np.ndarray, Attributes]:
    part = PARTS[name]
    attributes: Attributes = {"long_name": part.long_name}
    attributes |= {"units": part.unit} if part.unit else {}
    return part.dims, value, attributes


def response_values(response: ResponseMap) -> dict[str, np.ndarray]:
    others: dict[str, np.ndarray] = {
        "receptor_mm": response.positions_mm,
        "spike_count": response.spike_count.astype(np.int32),
        "spike_time_ms": response.spikes.times_ms,
    }
    return {name: others[name] if name in others else getattr(response, name) for name in RESPONSE_PARTS}


def _attributes(skin: SkinResponse, response: ResponseMap | None, seed: int | None) -> Attributes:
    """Attributes of the whole data set; descriptions are JSON."""
    attributes: Attributes = {
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
    if skin.touch is not None:
        touch = skin.touch
        attributes |= {
            "indenter": _json(touch.indenter),
            "motion": _json(touch.stimulus),
            "tissues": _json(touch.tissues),
            "finger": _json(touch.finger),
            "grading": _json(touch.grading),
            "at_mm": list(touch.at_mm),
            "tilt_deg": touch.tilt_deg,
            "spin_deg": touch.spin_deg,
            "friction": touch.friction,
        }
    if response is not None:
        attributes["receptor_pitch_mm"] = response.pitch_mm
    if seed is not None:
        attributes["seed"] = seed
    return attributes


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


def _write_zarr(path: Path, data: xarray.Dataset) -> None:
    """Write a Zarr store beside its place and rename it: what was there is replaced at once."""
    beside = [path.with_name(f".{path.name}.{token_hex(8)}.{what}") for what in ("part", "old")]
    unfinished, replaced = beside
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        data.to_zarr(unfinished, mode="w", consolidated=False)
        if path.exists():
            path.rename(replaced)
        unfinished.rename(path)
    except OSError as error:
        raise StoreError(
            f"{path} cannot be written ({error.strerror or error}): free it or choose another."
        ) from error
    finally:
        if replaced.exists() and not path.exists():
            replaced.rename(path)
        for leftover in beside:
            shutil.rmtree(leftover, ignore_errors=True)


def check_touch(path: str, data: xarray.Dataset) -> None:
    """Raise `InputError` unless a data set is what `touch_dataset` makes; `path` says where it came from."""
    if data.attrs.get("format") != FORMAT:
        raise InputError(
            path, "must be a touch that fingerpad wrote", remedy="another program wrote this file"
        )
    if data.attrs.get("format_version") != FORMAT_VERSION:
        raise InputError(
            path,
            f"must have format_version {FORMAT_VERSION}",
            str(data.attrs.get("format_version")),
            "read it with the version of fingerpad that wrote it",
        )
    if data.attrs.get("half_finger") not in (0, 1):
        raise InputError(
            f"{path}, attribute half_finger must be 0 or 1: got {data.attrs.get('half_finger')}."
        )
    groups = [MESH_PARTS] + [
        part for part in (OBJECT_PARTS, RESPONSE_PARTS) if set(part) & set(data.variables)
    ]
    needed = ["time", *(field.name for field in stored_fields()), *(name for part in groups for name in part)]
    for name in needed:
        if name not in data.variables and name != "times_ms":
            raise InputError(path, f"must hold the variable {name}", remedy="it is missing")
    for key, values in data.variables.items():
        _check_variable(f"{path}, variable {key}", key, values, data)
    times = data["time"].values
    if times.size < 2 or times[0] != 0.0 or not (np.diff(times) > 0.0).all():
        raise InputError(f"{path}, variable time must increase from 0: it does not.")
    if "spike_count" in data:
        count, n_spikes = data["spike_count"].values, data.sizes["spike"]
        if count.min(initial=0) < 0 or count.sum() != n_spikes:
            raise InputError(
                f"{path}, variable spike_count must add up to the {n_spikes} of spike: it does not."
            )
        try:
            spike_trains(data)
        except InputError as error:
            raise InputError(
                f"{path}, variable spike_time_ms must increase per receptor: it does not."
            ) from error


def _check_variable(where: str, name: Hashable, values: xarray.Variable, data: xarray.Dataset) -> None:
    """Check unit, dimensions and values of one variable."""
    field = FIELDS.get("times_ms" if name == "time" else str(name))
    part = PARTS.get(str(name))
    if field is not None:
        unit, holes = udunits(field.unit), False
        ends = (*_PLACES[field.place], *_COMPONENTS[field.components])
        allowed = {ends, ("time", *ends)}
        if field.place is Place.WATCHED:
            allowed.add(("time", "element", *ends[1:]))
    elif part is not None:
        unit, holes, allowed = part.unit, part.holes, {part.dims}
    else:
        return  # a variable that somebody added
    if values.dims not in allowed:
        raise InputError(where, f"must have the dimensions {sorted(allowed)[0]}", str(values.dims))
    if values.attrs.get("units", "") != unit:
        raise InputError(where, f"must have the unit {unit!r}", repr(values.attrs.get("units", "")))
    numbers = values.values
    if numbers.dtype.kind not in "fiu":
        raise InputError(where, "must hold numbers", str(numbers.dtype))
    if numbers.dtype.kind == "f" and not (np.isnan(numbers) & holes | np.isfinite(numbers)).all():
        raise InputError(where, "must be finite everywhere", remedy="some values are not")
    if part is not None and part.points_into and numbers.size:
        count = data.sizes[part.points_into]
        if numbers.dtype.kind == "f" or numbers.min() < 0 or numbers.max() >= count:
            raise InputError(where, f"must hold whole numbers from 0 to {count - 1}", remedy="some are not")


def udunits(unit: str) -> str:
    """Return a unit as UDUNITS reads it."""
    return _UDUNITS.get(unit, unit)


def field_dimensions(field: Field) -> tuple[str, ...]:
    time = ("time",) if field.stored is Times.ALL else ()
    return (*time, *_PLACES[field.place], *_COMPONENTS[field.components])


def first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0].strip().rstrip(".")[:200]


def require_netcdf() -> None:
    """Raise `InputError` if a library that writes data sets is not installed."""
    for name in ("xarray", "h5netcdf", "zarr"):
        library(name)


def library(name: str, needed: str = "", extra: str = "netcdf") -> Any:
    """Import a library of an extra, or raise an `InputError` that says how to install it."""
    try:
        return import_module(name)
    except ImportError as error:
        raise InputError(
            f"{needed or f'A labelled data set needs {name}'}: install the extra, pip install "
            f"'fingerpad[{extra}]'."
        ) from error
