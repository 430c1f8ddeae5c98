"""A touch in three dimensions and through time: finger, object, field and afferents.

The picture is drawn from the labelled data set of `fingerpad.skin.dataset`, in memory or from a file.
PyVista renders it without a window, in parallel projection, so that lengths can be measured; Matplotlib adds
the colour bar, three arrows of known length, afferents, motion and spikes. A field of elements is shown on
the plane of symmetry, one of the skin from below, through the object. The extra `fingerpad[view]` is needed.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image
from scipy.spatial import cKDTree

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import path_of, write_atomically
from fingerpad.core.progress import NoProgress, Progress
from fingerpad.core.values import Finite, FloatArray, count_from, instance, one_of
from fingerpad.export.results import library
from fingerpad.export.touch_file import check_touch, read_touch, spike_trains
from fingerpad.report.skin import BONE, DECADES, SKIN
from fingerpad.report.style import BLACK, BLUE, new_figure, png, say_nothing_to_draw
from fingerpad.skin.sampling import SkinResponse

if TYPE_CHECKING:
    import xarray

SHORT_NAMES = {
    "sed": "sed_kpa",
    "displacement": "displacement_mm",
    "pressure": "contact_pressure_kpa",
    "shear": "shear_kpa",
    "slip": "slip_mm",
}
"""Short names of fields; any other variable at nodes or elements goes by its own."""

SHOWN_DIMS = (("node",), ("node", "axis"), ("element",), ("skin_node",), ("skin_node", "axis"))
"""Dimensions of the fields that can be shown, beside time."""

SUFFIXES = (".png", ".gif", ".mp4")

RECENT_MS = 25.0  # An afferent is drawn dark if it fired a spike at most so long ago. [ms]
THICKNESS_MM = 3.0  # How much of the object is drawn behind the foremost point of its face. [mm]
ARROW_MM = 5.0  # Length of the three arrows that give the scale. [mm]

FRAMES_PER_S, MOST_FRAMES = 12, 2000
PIXELS, VIEW_HEIGHT_MM = (1240, 820), 22.5
OBJECT, NAIL = "#8fa3b5", "#e6e0b8"

_NAIL_MM = 0.6
_ON_PLANE_MM = 1e-6
_FROM_THE_SIDE = (np.array([0.35, -0.5, 1.0]), np.array([0.0, 1.0, 0.0]))
"""Offset of the camera and its upward direction where the plane of symmetry is shown."""
_FROM_BELOW = (np.array([0.10, -1.0, -0.22]), np.array([0.0, 0.0, 1.0]))  # The same where the skin is shown.


@checked
def save_view(
    path: str | Path,
    touch: xarray.Dataset | SkinResponse | str | Path,
    *,
    field: str = "sed",
    time_ms: Finite | None = None,
    frames: Annotated[int, count_from(2, MOST_FRAMES)] = 40,
    progress: Progress | None = None,
) -> tuple[Path, ...]:
    """Draw a touch in three dimensions: a picture at one time, or a film.

    Parameters
    ----------
    path : str or Path
        The file: .png, .gif, or .mp4, which the program ffmpeg has to be installed for.
    touch : xarray.Dataset, SkinResponse, str or Path
        From `SkinResponse.to_dataset`, a file of it, or a response of the skin, drawn without afferents.
    field : str
        "sed", "displacement" (on the plane of symmetry), "pressure", "shear", "slip" (on the skin), or the
        name of another variable at nodes or elements. Of a vector its length is shown.
    time_ms : float, optional
        Time of a picture; by default that of the largest depth. [ms]
    frames : int
        Number of pictures of a film. They follow the steps of the press, which are short where much happens.
    progress : Progress, optional
        Shown how many pictures of a film are drawn, such as `fp.notebook_progress()`.

    Raises
    ------
    StoreError
        If the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> import fingerpad as fp
    >>> skin = fp.indent(fp.Fingertip(), fp.Sphere(), fp.RampAndHold(depth_mm=0.5), whole=True)
    >>> (picture,) = save_view(Path(mkdtemp()) / "touch.png", skin, time_ms=50.0)
    >>> picture.name
    'touch.png'
    """
    path = path_of("path", path)
    one_of("ending of the file", path.suffix.lower(), SUFFIXES)
    film = path.suffix.lower() != ".png"
    if film and time_ms is not None:
        raise InputError(f"time_ms belongs to a picture: leave it out for {path.name}, or write a .png.")
    if path.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        raise InputError("A film as .mp4 needs the program ffmpeg, which is not installed: write a .gif.")
    _pyvista()
    if isinstance(touch, str | Path):
        data = read_touch(touch)
    elif isinstance(touch, SkinResponse):
        data = touch.to_dataset()
    else:
        data = instance("touch", touch, library("xarray").Dataset)
        check_touch("touch", data)
    view, times = _View(data, _variable(data, field)), data["time"].values
    if not film:
        deepest_ms = float(times[data["depth_mm"].values.argmax()])
        write_atomically(path, png(view.figure, view.checked(deepest_ms if time_ms is None else time_ms)))
        return (path,)
    steps = np.linspace(0.0, times.size - 1.0, frames)
    shown = np.interp(steps, np.arange(times.size), times)
    view.checked(float(times[0]))
    as_film = _gif if path.suffix.lower() == ".gif" else _mp4
    with (progress or NoProgress()).stage("pictures", frames) as advance:
        write_atomically(path, as_film(_pictures(view, shown.tolist(), advance)))
    return (path,)


def _pictures(view: _View, times_ms: list[float], advance: Callable[[], None]) -> Iterator[Image.Image]:
    for time_ms in times_ms:
        yield Image.open(io.BytesIO(png(view.figure, time_ms))).convert("RGB")
        advance()


def fields_of(data: xarray.Dataset) -> tuple[str, ...]:
    """Names of the fields of a data set that can be shown, short ones where there are."""
    short = {name: alias for alias, name in SHORT_NAMES.items()}
    dims = {name: tuple(dim for dim in data[name].dims if dim != "time") for name in map(str, data.data_vars)}
    shown = [name for name in dims if dims[name] in SHOWN_DIMS and name not in ("node_mm", "layer")]
    return tuple(short.get(name, name) for name in shown)


def _variable(data: xarray.Dataset, field: str) -> str:
    one_of("field", field, tuple(dict.fromkeys([*fields_of(data), *SHORT_NAMES.values()])))
    return SHORT_NAMES.get(field, field) if field not in data else field


@dataclass(frozen=True)
class _View:
    """A data set and the variable of it that is shown."""

    data: xarray.Dataset
    variable: str

    def checked(self, time_ms: float) -> float:
        times = self.data["time"].values
        if not 0.0 <= time_ms <= times[-1]:
            raise InputError("time_ms", f"must lie within 0 ... {times[-1]:g} ms", f"{time_ms:g} ms")
        lacking = [
            name
            for name in {self.variable, *(() if self.on_skin else ("displacement_mm",))}
            if "time" not in self.data[name].dims
        ]
        if lacking and time_ms != times[-1]:
            raise InputError(
                f"{lacking[0]} is known at {times[-1]:g} ms only: choose that time, pressure, shear or slip, "
                "or write the touch after solving it with whole=True."
            )
        return time_ms

    @property
    def on_skin(self) -> bool:
        """Whether the field belongs to the skin."""
        return "skin_node" in self.data[self.variable].dims

    @property
    def _half(self) -> bool:
        return bool(self.data.attrs["half_finger"])

    @cached_property
    def norm(self) -> Normalize:
        """Scale of the field, one for all times; energies span orders of magnitude."""
        largest = float(np.abs(self._lengths(self.data[self.variable].values)).max())
        if largest <= 0.0:
            return Normalize(0.0, 1.0)
        if self.variable.startswith("sed"):
            return LogNorm(largest / 10.0**DECADES, largest)
        return Normalize(0.0, largest)

    def _lengths(self, values: FloatArray) -> FloatArray:
        """Values of the field as they are shown: of a vector its length."""
        return np.linalg.norm(values, axis=-1) if "axis" in self.data[self.variable].dims else values

    def at(self, name: str, time_ms: float) -> FloatArray:
        """Values of a variable at a time, linear between those that were solved."""
        values = self.data[name]
        if "time" not in values.dims:
            return np.asarray(values.values, dtype=np.float64)
        times = self.data["time"].values
        later = int(np.clip(np.searchsorted(times, time_ms), 1, times.size - 1))
        share = (time_ms - times[later - 1]) / (times[later] - times[later - 1])
        return (1.0 - share) * values.values[later - 1] + share * values.values[later]

    @cached_property
    def _plotter(self) -> Any:
        return _pyvista().Plotter(off_screen=True, window_size=PIXELS)

    @cached_property
    def _camera(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Focal point, unit offset of the camera, and upward direction."""
        offset, up = _FROM_BELOW if self.on_skin else _FROM_THE_SIDE
        points = self.data["node_mm"].values
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        focus = np.array([middle[0], middle[1] - (0.0 if self.on_skin else 3.0), 0.0])
        return focus, offset / np.linalg.norm(offset), up

    def _screen(self, vectors: FloatArray) -> FloatArray:
        """Vectors of the finger's frame [mm] on the picture, right and down, in pixels."""
        _, offset, up = self._camera
        right = np.cross(up, offset)
        right /= np.linalg.norm(right)
        return vectors @ np.column_stack([right, np.cross(right, offset)]) * PIXELS[1] / VIEW_HEIGHT_MM

    def _spots(self, points: FloatArray) -> FloatArray:
        """Points of the finger's frame [mm] on the picture, from its upper left corner, in pixels."""
        return self._screen(points - self._camera[0]) + 0.5 * np.array(PIXELS)

    def scene(self, time_ms: float) -> np.ndarray:
        """Render finger, object and afferents, (height, width, 3)."""
        plotter = self._plotter
        plotter.clear_actors()
        plotter.set_background("white")
        self._add_finger(plotter, time_ms)
        if "object_front_mm" in self.data:
            solid = self._object(time_ms)
            plotter.add_mesh(
                solid, color=OBJECT, opacity=0.16 if self.on_skin else 1.0, smooth_shading=False, specular=0.1
            )
        focus, offset, up = self._camera
        plotter.camera.parallel_projection = True
        plotter.camera.focal_point = focus
        plotter.camera.position = focus + 100.0 * offset
        plotter.camera.up = up
        plotter.camera.parallel_scale = VIEW_HEIGHT_MM / 2
        plotter.renderer.ResetCameraClippingRange()
        return np.asarray(plotter.screenshot(return_img=True))

    def _add_finger(self, plotter: Any, time_ms: float) -> None:
        pyvista = _pyvista()
        data, points = self.data, self.data["node_mm"].values.copy()
        shades = {"cmap": SKIN, "clim": (self.norm.vmin, self.norm.vmax), "show_scalar_bar": False,
                  "log_scale": isinstance(self.norm, LogNorm), "ambient": 0.35, "diffuse": 0.7}  # fmt: skip
        values = np.clip(self._lengths(self.at(self.variable, time_ms)), self.norm.vmin, self.norm.vmax)
        if self.on_skin:
            skin_nodes = data["skin_node"].values
            points[skin_nodes] += self.at("skin_displacement_mm", time_ms)
            shown = np.zeros(len(points))
            shown[skin_nodes] = values
            skin = pyvista.PolyData.from_regular_faces(points, data["facet_nodes"].values)
            skin.point_data["shown"] = shown
            for each in [skin, self._mirrored(skin)] if self._half else [skin]:
                plotter.add_mesh(
                    each, scalars="shown", smooth_shading=True, split_sharp_edges=False, **shades
                )
        else:
            points += self.at("displacement_mm", time_ms)
            bricks = data["element_nodes"].values
            body = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: bricks}, points)
            by_node = "node" in data[self.variable].dims
            (body.point_data if by_node else body.cell_data)["shown"] = values
            body = self._mirrored(body) if self._half else body.clip("z", origin=(0.0, 0.0, 0.0))
            plotter.add_mesh(body.extract_surface(algorithm="dataset_surface"), scalars="shown", **shades)
            plotter.add_mesh(self._bone(points), color=BONE, ambient=0.4)
        if not self.data["nail"].size:
            return
        nail = self._nail(points)
        plotter.add_mesh(self._mirrored(nail) if self._half else nail, color=NAIL, ambient=0.3)
        if self._half and self.on_skin:
            plotter.add_mesh(nail, color=NAIL, ambient=0.3)

    @staticmethod
    def _mirrored(mesh: Any) -> Any:
        copied = mesh.copy()
        copied.points[:, 2] *= -1.0
        return copied

    def _nail(self, points: FloatArray) -> Any:
        """Plate on the faces of the skin that are held by the nail; of a finger that is cut, on one half."""
        faces = self.data["facet_nodes"].values
        held = np.isin(faces, self.data["nail"].values).all(axis=1)
        if not (self._half or self.on_skin):
            held &= points[faces][..., 2].mean(axis=1) <= 0.0
        plate = _pyvista().PolyData.from_regular_faces(points, faces[held])
        return plate.extrude((0.0, _NAIL_MM, 0.0), capping=True)

    def _bone(self, points: FloatArray) -> Any:
        """Section of the bone on the plane of symmetry."""
        section = points[self.data["bone"].values]
        section = section[np.abs(section[:, 2]) < _ON_PLANE_MM][:, :2]
        around = section - section.mean(axis=0)
        section = section[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
        flat = np.column_stack([section, np.zeros(len(section))])
        return _pyvista().PolyData(flat, faces=[len(flat), *range(len(flat))]).triangulate()

    def _object(self, time_ms: float) -> Any:
        """Object as a solid behind its face, on the plane of symmetry cut in two."""
        data = self.data
        x, z = data["object_x"].values[::2], data["object_z"].values[::2]
        front = np.nan_to_num(data["object_front_mm"].values[::2, ::2], nan=-np.inf)
        floor = float(front.max()) - THICKNESS_MM
        top = np.maximum(front, floor)
        heights = np.stack([np.full_like(top, floor), top], axis=-1)
        wide = np.broadcast_arrays(x[:, None, None], heights, z[None, :, None])
        placed = np.stack(wide, axis=-1) @ self.at("object_axes", time_ms).T
        placed += self.at("object_tip_mm", time_ms)
        solid = _pyvista().StructuredGrid(*np.moveaxis(placed, -1, 0))
        high = np.maximum.reduce([top[:-1, :-1], top[1:, :-1], top[:-1, 1:], top[1:, 1:]]) > floor
        solid = solid.extract_cells(np.flatnonzero(high.ravel(order="F")))
        solid = solid if self.on_skin else solid.clip("z", origin=(0.0, 0.0, 0.0))
        return solid.extract_surface(algorithm="dataset_surface")

    @cached_property
    def _sites(self) -> tuple[FloatArray, np.ndarray]:
        """Points of the undeformed skin above the receptors, and the face of the skin that each lies on."""
        data = self.data
        corners = data["node_mm"].values[data["facet_nodes"].values]
        middles = corners.mean(axis=1)
        receptors = data["receptor_mm"].values
        side = np.where(self._half & (receptors[:, -1] < 0.0), -1.0, 1.0)
        target = receptors.copy()
        target[:, -1] *= side
        volar, columns = np.arange(len(middles)), [0, 1, 2]
        if receptors.shape[1] == 2:
            normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
            volar, columns = np.flatnonzero(normal[:, 1] < 0.0), [0, 2]
        facets = volar[cKDTree(middles[volar][:, columns]).query(target)[1]]
        points = middles[facets].copy()
        points[:, columns] = target
        points[:, 2] *= side
        return points, facets

    def _draw_afferents(self, axes: Any, time_ms: float) -> None:
        """Draw the skin above each receptor, on the near half, through what is before it."""
        if "receptor_mm" not in self.data:
            return
        data, (points, facets) = self.data, self._sites
        moved = np.zeros_like(data["node_mm"].values)
        moved[data["skin_node"].values] = self.at("skin_displacement_mm", time_ms)
        shift = moved[data["facet_nodes"].values[facets]].mean(axis=1)
        shift[:, 2] *= np.where(self._half & (points[:, 2] < 0.0), -1.0, 1.0)
        near = self.on_skin | (points[:, 2] <= _ON_PLANE_MM)
        spots = self._spots((points + shift)[near])
        colours = np.where(self._fires(time_ms)[near], BLACK, "white")
        axes.scatter(*spots.T, s=8.0 if self.on_skin else 14.0, c=colours, edgecolors=BLACK, linewidths=0.7)

    def _fires(self, time_ms: float) -> np.ndarray:
        """Which receptors fired a spike within `RECENT_MS`, bool (n_receptors,)."""
        recent = [(train <= time_ms) & (train > time_ms - RECENT_MS) for train in self._trains]
        return np.array([spikes.any() for spikes in recent])

    @property
    def _trains(self) -> list[FloatArray]:
        trains = spike_trains(self.data)
        return [trains[receptor] for receptor in range(len(trains))]

    def figure(self, time_ms: float) -> Figure:
        """Draw the scene with colour bar, scale, motion and spikes."""
        figure = new_figure(9.6, 4.4)
        grid = figure.add_gridspec(2, 2, width_ratios=(2.1, 1.0), height_ratios=(1.0, 1.6))
        scene = figure.add_subplot(grid[:, 0])
        scene.imshow(self.scene(time_ms), interpolation="antialiased")
        scene.autoscale(enable=False)
        scene.set_axis_off()
        self._draw_arrows(scene)
        self._draw_names(scene, time_ms)
        self._draw_afferents(scene, time_ms)
        values = self.data[self.variable]
        vector = " (length)" if "axis" in values.dims else ""
        bar = figure.colorbar(
            ScalarMappable(self.norm, SKIN), ax=scene, orientation="horizontal", shrink=0.6,
            aspect=30, pad=0.01, extend="min" if isinstance(self.norm, LogNorm) else "neither",
        )  # fmt: skip
        unit = "-" if values.units == "1" else values.units
        bar.set_label(f"{values.long_name}{vector} [{unit}]")
        bar.ax.xaxis.set_major_formatter("{x:g}")
        motion = figure.add_subplot(grid[0, 1])
        motion.plot(self.data["time"], self.data["depth_mm"], color=BLUE)
        motion.set(ylabel="depth [mm]", title=f"{time_ms:.0f} ms")
        motion.tick_params(labelbottom=False)
        spikes = figure.add_subplot(grid[1, 1], sharex=motion)
        self._draw_spikes(spikes)
        for axes in (motion, spikes):
            axes.axvline(time_ms, color=BLACK, linewidth=1.0, linestyle=":")
            axes.grid(visible=False)
        return figure

    def _draw_arrows(self, axes: Any) -> None:
        """Three arrows of `ARROW_MM` along the axes of the finger: the scale of the picture."""
        start = np.array([0.03, 0.90]) * PIXELS
        arrow = {"arrowstyle": "-|>", "color": BLACK, "shrinkA": 0, "shrinkB": 0}
        vectors = self._screen(ARROW_MM * np.eye(3))
        for label, vector in zip(("distal", "dorsal", "lateral"), vectors, strict=True):
            if np.linalg.norm(vector) < 0.05 * PIXELS[0]:
                continue  # it points at the camera
            axes.annotate("", start + vector, start, arrowprops=arrow)
            axes.annotate(label, start + vector, fontsize=7.5, ha="left", va="bottom", color=BLACK)
        below = start + np.array([0.0, 0.055 * PIXELS[1]])
        axes.annotate(f"arrows: {ARROW_MM:g} mm", below, fontsize=8.0, color=BLACK)

    def _draw_names(self, axes: Any, time_ms: float) -> None:
        """Name bone, nail and object where they are seen."""
        data, places = self.data, {}
        if not self.on_skin:
            for name, beside in (("bone", [0.0, 0.0, 0.0]), ("nail", [0.0, 1.8, 0.0])):
                nodes = data["node_mm"].values[data[name].values]
                if not len(nodes):
                    continue  # a mesh of one's own may lack it
                places[name] = 0.5 * (nodes.min(axis=0) + nodes.max(axis=0)) * [1.0, 1.0, 0.0] + beside
        if "object_tip_mm" in data and "indenter" in data.attrs:
            name = _named(data.attrs["indenter"])
            tip, axes_now = self.at("object_tip_mm", time_ms), self.at("object_axes", time_ms)
            behind = axes_now[:, 2] if self.on_skin else axes_now[:, 1]
            places[name] = tip - (THICKNESS_MM + 2.4) * behind
        for name, place in places.items():
            axes.annotate(name, self._spots(place), fontsize=8.0, ha="center", va="center", color=BLACK)

    def _draw_spikes(self, axes: Any) -> None:
        if "spike_count" not in self.data:
            axes.plot(self.data["time"], self.data["force_mn"], color=BLUE)
            axes.set(xlabel="time [ms]", ylabel="force [mN]")
            return
        trains = [train for train in self._trains if train.size]
        if trains:
            axes.eventplot(trains, colors=BLACK, linewidths=0.8, linelengths=0.8)
        else:
            say_nothing_to_draw(axes, "no afferent fires a spike")
        count = self.data.sizes["receptor"]
        axes.set(xlabel="time [ms]", ylabel=f"{len(trains)} of {count} afferents fire", yticks=[])
        fires, silent = (
            Line2D([], [], marker="o", linestyle="", color=colour, markeredgecolor=BLACK, markersize=4.0)
            for colour in (BLACK, "white")
        )
        axes.legend(
            [fires, silent], [f"spike in the last {RECENT_MS:g} ms", "none"], loc="upper center",
            bbox_to_anchor=(0.5, -0.32), ncols=2, handletextpad=0.1, columnspacing=0.8,
        )  # fmt: skip


def _named(description: str) -> str:
    """Class of an indenter, from its description."""
    try:
        return str(json.loads(description)["class"])
    except (ValueError, TypeError, KeyError):  # somebody has changed it
        return "object"


def _gif(pictures: Iterator[Image.Image]) -> bytes:
    first, *others = (picture.quantize(128) for picture in pictures)
    buffer = io.BytesIO()
    first.save(
        buffer, "GIF", save_all=True, append_images=others, duration=round(1000 / FRAMES_PER_S), loop=0,
        optimize=True,
    )  # fmt: skip
    return buffer.getvalue()


def _mp4(pictures: Iterator[Image.Image]) -> bytes:
    with TemporaryDirectory() as folder:
        for number, picture in enumerate(pictures):
            width, height = (size // 2 * 2 for size in picture.size)  # encoders ask for even sizes
            picture.crop((0, 0, width, height)).save(Path(folder) / f"{number:05d}.png")
        film = Path(folder) / "film.mp4"
        taken = ["-loglevel", "error", "-framerate", str(FRAMES_PER_S), "-i", f"{folder}/%05d.png"]
        command = ["ffmpeg", *taken, "-pix_fmt", "yuv420p", str(film)]
        done = subprocess.run(command, capture_output=True, check=False)
        if done.returncode or not film.exists():
            said = done.stderr.decode(errors="replace").strip().splitlines() or ["no reason given"]
            raise InputError(f"ffmpeg could not write the film ({said[-1].rstrip('.')}): write a .gif.")
        return film.read_bytes()


def _pyvista() -> Any:
    """Return PyVista, which draws without a window and without messages about missing displays."""
    needed = "A view in three dimensions needs pyvista", "view"
    pyvista = library("pyvista", *needed)
    logger = library("vtkmodules.vtkCommonCore", *needed).vtkLogger
    if not os.environ.get("DISPLAY"):
        logger.SetStderrVerbosity(logger.VERBOSITY_OFF)
    return pyvista
