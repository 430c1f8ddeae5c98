"""Level 3, Figure 6: responses of a sheet of afferents to one sphere, as height, on the finger and flat."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LogNorm, Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from fingerpad.core.checks import FloatArray
from fingerpad.data import protocol
from fingerpad.experiments.gerling2014.response_maps import FingerMap, PopulationMaps, RestingResponse
from fingerpad.report.formatting import number
from fingerpad.report.style import GREY, PALE, new_figure, say_nothing_to_draw

QUANTITIES = {
    "dynamic_rate_hz": ("dynamic ramp", "rate [spikes/s]", "viridis", Normalize),
    "static_rate_hz": ("static hold", "rate [spikes/s]", "viridis", Normalize),
    # Most first spikes come within a few tens of milliseconds, those at the rim after hundreds.
    "first_spike_latency_ms": ("first spike", "latency [ms]", "viridis_r", LogNorm),
}

TICKS_MS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)

PAD_FROM_MM, PAD_BELOW_MM = 9.0, -1.0
"""The picture of the finger shows skin distal of the first x and below the second y. [mm]"""

LIGHT = np.array([0.8, 0.3, -0.52])
"""Where the light on the finger comes from: distal, a little from the side, mostly from below (x, z, y)."""


def draw_population(section: PopulationMaps) -> Figure:
    """Draw Figure 6: each quantity as a surface, on the pressed finger, and flat with the receptors."""
    figure = new_figure(14.0, 11.0)
    grid = figure.add_gridspec(3, 3, width_ratios=(1.05, 1.1, 1.0))
    finger = _faces(section.finger)
    x, z, receptors = section.x_mm, section.z_mm, section.receptors_mm
    for row, (key, (phase, label, colours, scaling)) in enumerate(QUANTITIES.items()):
        values = getattr(section, key)
        surface = figure.add_subplot(grid[row, 0], projection="3d")
        surface.set_title(f"({'abc'[row]}) {phase}")
        solid = figure.add_subplot(grid[row, 1], projection="3d")
        plane = figure.add_subplot(grid[row, 2])
        if np.isnan(values).all():
            say_nothing_to_draw(plane, "no afferent fires")
            surface.set_axis_off()
            solid.set_axis_off()
            continue
        scale = scaling(*_span(values), clip=True)
        _surface(surface, x, z, values, label, colours, scale)
        _on_the_finger(solid, finger, key, colours, scale)
        _map(plane, x, z, values, label, colours, scale, receptors)
        for axes in (surface, solid):
            # Until it is drawn, Matplotlib 3.11.0 lays a surface out as if it filled the figure.
            axes.draw(figure.canvas.get_renderer())  # type: ignore[attr-defined]
    return figure


def _span(values: FloatArray) -> tuple[float, float]:
    """Lowest and highest value; apart from each other, as logarithms need it."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    return low, max(high, 1.001 * low, 1e-3)


def round_ticks(scale: Normalize) -> list[float]:
    """Return the round numbers within a logarithmic scale.

    Examples
    --------
    >>> round_ticks(LogNorm(4.0, 60.0))
    [5.0, 10.0, 20.0, 50.0]
    """
    return [tick for tick in TICKS_MS if 0.0 <= float(scale(tick, clip=False)) <= 1.0]


def with_round_ticks(bar: Colorbar, scale: Normalize) -> None:
    """Put round numbers beside the colours of a logarithmic scale."""
    if isinstance(scale, LogNorm):
        bar.set_ticks(round_ticks(scale))
        bar.minorticks_off()
        bar.ax.yaxis.set_major_formatter("{x:g}")


def _surface(
    axes: Any,
    x: FloatArray,
    z: FloatArray,
    values: FloatArray,
    label: str,
    colours: str,
    scale: Normalize,
) -> None:
    along, lateral = np.meshgrid(x, z, indexing="ij")
    # Surfaces have no logarithmic axis: the heights are logarithms, and the ticks show the values.
    logarithmic = isinstance(scale, LogNorm)
    axes.plot_surface(
        along,
        lateral,
        np.log10(values) if logarithmic else values,
        facecolors=colormaps[colours](scale(values)),
        rcount=60,
        ccount=60,
        edgecolor="#00000030",
        linewidth=0.3,
        shade=False,
    )
    axes.locator_params(nbins=5)
    if logarithmic:
        shown = round_ticks(scale)
        axes.set_zticks(np.log10(shown), labels=[f"{tick:g}" for tick in shown])
    axes.set_xlabel("along, x [mm]", labelpad=6.0)
    axes.set_ylabel("across, z [mm]", labelpad=6.0)
    axes.set_zlabel(label, labelpad=6.0)
    axes.view_init(elev=28.0, azim=-58.0)
    axes.set_box_aspect((1.25, 1.05, 0.85), zoom=1.0)


def _faces(finger: FingerMap) -> dict[str, FloatArray]:
    """Corners of the deformed faces, (n_faces, 4, 3) in the order x, z, y, and the responses below each."""
    corners = np.stack([finger.x_mm, finger.z_mm, finger.y_mm], axis=-1)
    around = (corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:])
    faces = np.stack(around, axis=2).reshape(-1, 4, 3)
    middle = faces.mean(axis=1)
    pad = (middle[:, 0] > PAD_FROM_MM) & (middle[:, 2] < PAD_BELOW_MM)
    values = {key: getattr(finger, key).ravel()[pad] for key in QUANTITIES}
    faces = faces[pad]
    if finger.half:
        faces = np.concatenate([faces, faces * [1.0, -1.0, 1.0]])
        values = {key: np.tile(entries, 2) for key, entries in values.items()}
    return {"corners_mm": faces} | values


def _on_the_finger(
    axes: Any, finger: dict[str, FloatArray], key: str, colours: str, scale: Normalize
) -> None:
    """Colour the pressed skin, seen from below and from the side of the tip, with light on its relief."""
    corners, values = finger["corners_mm"], finger[key]
    silent = ~(values > 0.0)
    paint = colormaps[colours](scale(np.where(silent, np.nanmax(values), values)))[:, :3]
    paint[silent] = to_rgb(PALE)
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    # The pad looks down, whichever way round the corners of a face are listed.
    normal *= -np.sign(normal[:, 2:]) / np.linalg.norm(normal, axis=1, keepdims=True)
    brightness = np.maximum(normal @ LIGHT, 0.0)
    shaded = paint * (0.45 + 0.55 * brightness)[:, np.newaxis]
    polygons = Poly3DCollection(corners, facecolors=shaded, edgecolors="#00000028", linewidths=0.4)
    axes.add_collection3d(polygons)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=1.5)
    axes.view_init(elev=-62.0, azim=-75.0)
    axes.set_axis_off()


def _map(
    axes: Axes,
    x: FloatArray,
    z: FloatArray,
    values: FloatArray,
    label: str,
    colours: str,
    scale: Normalize,
    receptors: FloatArray,
) -> None:
    picture = axes.pcolormesh(
        x, z, np.ma.masked_where(~(values.T > 0.0), values.T), cmap=colours, norm=scale, shading="nearest"
    )
    silent = Rectangle((0, 0), 1, 1, transform=axes.transAxes, facecolor=PALE, hatch="//", edgecolor=GREY)
    silent.set(zorder=0, linewidth=0.0)
    axes.add_patch(silent)
    axes.plot(
        receptors[:, 0],
        receptors[:, 1],
        "o",
        markersize=6.0,
        color="white",
        markeredgecolor="black",
        label=f"{len(receptors)} receptors",
    )
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_xlabel("along the finger, x [mm]")
    axes.set_ylabel("across, z [mm]")
    with_round_ticks(axes.figure.colorbar(picture, ax=axes, label=label, shrink=0.85), scale)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1)


def caption_population(section: PopulationMaps) -> str:
    """Caption of Figure 6."""
    return (
        f"Predicted response of afferents all over the pad to a sphere of {number(section.curvature_per_m)} "
        f"1/m, at a depth of {protocol.DEPTH.value} mm. Left: the quantity as a height, as in the paper, but "
        "latencies on a logarithmic scale. Middle: the same on the deformed skin at the end of the hold, "
        f"seen from below, from x = {number(PAD_FROM_MM)} mm on the left to the tip on the right, in the "
        "colours of the scale on the right; afferents in grey skin do not respond. Right: seen from above; "
        "circles are the receptors of Figures 7 and 8, hatched skin does not respond. All afferents have "
        f"the parameters of the fitted afferent; nothing here was observed.{_resting(section.at_rest)}"
    )


def _resting(rest: RestingResponse) -> str:
    """Describe the response of afferents without touch, if there is one."""
    if np.isnan(rest.first_spike_latency_ms):
        return ""
    return (
        f" This afferent also fires without touch, {number(rest.static_rate_hz)} spikes/s from "
        f"{number(rest.first_spike_latency_ms)} ms on; in grey skin its latency is more than half of that."
    )
