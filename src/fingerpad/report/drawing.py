"""One drawing per question to a result: what `plot` of results draws, and their pictures in notebooks."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from html import escape
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from fingerpad.core.displayed import Displayed
from fingerpad.core.errors import InputError
from fingerpad.core.signals import (
    COUNT,
    CURRENT,
    RECEPTOR_COLUMNS,
    HitRates,
    ResponseMap,
    SpikeTrains,
    Traces,
)
from fingerpad.core.units import unit_of, with_unit
from fingerpad.core.values import one_of
from fingerpad.experiments.discrimination.analysis import TaskResult
from fingerpad.experiments.fit.results import FitResult
from fingerpad.report.fit import draw_phase, recorded
from fingerpad.report.nerve import QUANTITIES, draw_map_by_type, draw_raster_by_type, draw_trains
from fingerpad.report.skin import BONE, BONE_INSIDE, draw_section
from fingerpad.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    MAP_AXES,
    NANOAMPERE_PER_MA,
    ORANGE,
    new_figure,
    png,
)
from fingerpad.report.task import draw_curves_of_measure, main_decoding

if TYPE_CHECKING:
    from fingerpad.geometry.fingertip import Fingertip
    from fingerpad.inference.spike_likelihood import SpikeFit
    from fingerpad.psychophysics.curve_fit import PsychometricFit
    from fingerpad.reduction.streaming import ReducedSample
    from fingerpad.skin.sampling import SkinResponse, SurfaceProfile

CURVE_POINTS = 200

BESIDE: Any = {"fontsize": "small", "loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
"""Place of a legend that must not lie on what is drawn."""

SITE_STYLES: tuple[tuple[str, Any], ...] = (
    (BLACK, "-"),
    (BLUE, "--"),
    (ORANGE, ":"),
    (GREEN, "-."),
    (GREY, "-"),
    (BLUE, (0, (8, 2, 1, 2, 1, 2))),
)
"""Colour and dashes of the lines of a few sites."""

QUANTITY_LABELS = {"stored": "strain energy density", "work": "work of the stress"}
"""Names of quantities in words, where these are not those of `SkinResponse.sample`."""

IN_NOTEBOOKS = {"SkinResponse": "section"}  # Drawings in notebooks that are not the default.

Draw = Callable[..., None]

DRAWINGS: dict[str, dict[str, Draw]] = {}
"""Drawings by the name of a result's class, the default first."""


def drawing(kind: str, what: str) -> Callable[[Draw], Draw]:
    """Enter the function below into `DRAWINGS`."""

    def enter(draw: Draw) -> Draw:
        DRAWINGS.setdefault(kind, {})[what] = draw
        return draw

    return enter


def _label(quantity: str) -> str:
    """Name a quantity at an end organ in words, with its unit."""
    return with_unit(QUANTITY_LABELS.get(quantity, quantity.replace("_", " ")), quantity)


@drawing("SkinResponse", "force")
def draw_force(axes: Axes, skin: SkinResponse) -> None:
    axes.plot(skin.times_ms, skin.force_mn, color=BLACK)
    axes.set(xlabel="time [ms]", ylabel="force [mN]")


drawing("SkinResponse", "section")(draw_section)


@drawing("SkinResponse", "profile")
def draw_profile(axes: Axes, skin: SkinResponse) -> None:
    draw_surface_profile(axes, skin.surface_profile())


@drawing("SurfaceProfile", "profile")
def draw_surface_profile(axes: Axes, profile: SurfaceProfile) -> None:
    axes.plot(profile.distance_mm, profile.deflection_mm, color=BLACK)
    axes.set(xlabel="distance from the object's axis [mm]", ylabel="deflection towards the bone [mm]")


@drawing("SkinResponse", "pad")
def draw_pad(axes: Axes, skin: SkinResponse, quantity: str = "stored", reach_mm: float = 6.0) -> None:
    """Draw a quantity at the end organs below the pad, at the last time."""
    z = np.linspace(-reach_mm, reach_mm, 61)
    x = skin.axis_x_mm + skin.pose.x_mm + z
    sites = np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1).reshape(-1, 2)
    values = skin.sample(quantity, sites)[-1].reshape(x.size, z.size)
    drawn = axes.pcolormesh(x, z, values.T, cmap="viridis", shading="gouraud")
    axes.figure.colorbar(drawn, ax=axes, label=_label(quantity))
    axes.set(**MAP_AXES)
    axes.grid(visible=False)


@drawing("SkinResponse", "depth")
def draw_depth(axes: Axes, skin: SkinResponse) -> None:
    """Draw the depth from first touch over time."""
    axes.plot(skin.times_ms, skin.depth_mm, color=BLACK)
    axes.set(xlabel="time [ms]", ylabel="depth [mm]")


@drawing("ResponseMap", "raster")
@drawing("SpikeTrains", "raster")
def draw_raster(axes: Axes, spikes: SpikeTrains | ResponseMap) -> None:
    """Draw the spikes of the afferents that fire, in their order from the top; in a band per type."""
    if isinstance(spikes, ResponseMap) and spikes.parts:
        draw_raster_by_type(axes, spikes.parts)
        return
    draw_trains(axes, list(spikes.spikes if isinstance(spikes, ResponseMap) else spikes), "first")


@drawing("ResponseMap", "map")
def draw_map(axes: Axes, response: ResponseMap, quantity: str | None = None) -> None:
    """Draw a quantity of every afferent at its place, seen onto the pad; by type, larger for more spikes."""
    if response.parts and quantity is None:
        draw_map_by_type(axes, response.parts)
        axes.legend(**BESIDE)
        return
    quantity = quantity or ("spike_count" if response.rate_measure == COUNT else "static_rate_hz")
    mapped = {
        name: (column.long_name, unit_of(name) or "number", "viridis", Normalize)
        for name, column in RECEPTOR_COLUMNS.items()
    }
    mapped |= {**QUANTITIES, "spike_count": ("whole touch", "spikes", "viridis", Normalize)}
    phase, label, colours, _ = mapped[one_of("quantity", quantity, tuple(mapped))]
    dots: Any = {"cmap": colours, "s": 60.0, "edgecolors": GREY, "clip_on": False}
    x, z = response.positions_mm[:, [0, -1]].T
    drawn = axes.scatter(x, z, c=getattr(response, quantity), **dots)
    axes.figure.colorbar(drawn, ax=axes, label=f"{phase}: {label}")
    axes.set(**MAP_AXES)


@drawing("Traces", "traces")
def draw_traces(axes: Axes, traces: Traces) -> None:
    """Draw the quantity over time, a current in nA: a few sites have a key, many are thin black lines."""
    factor, label = (NANOAMPERE_PER_MA, "current [nA]") if traces.quantity == CURRENT else (1.0, None)
    values = factor * traces.values
    axes.set(xlabel="time [ms]", ylabel=label or _label(traces.quantity))
    if not 1 < values.shape[1] <= len(SITE_STYLES):
        axes.plot(traces.times_ms, values, color=BLACK, linewidth=0.8)
        return
    for site, (column, (colour, dashes)) in enumerate(zip(values.T, SITE_STYLES, strict=False), start=1):
        style: Any = {"color": colour, "linestyle": dashes, "linewidth": 1.2}
        axes.plot(traces.times_ms, column, label=f"site {site}", **style)
    axes.legend(**BESIDE)


@drawing("HitRates", "hit_rates")
def draw_hit_rates(axes: Axes, rates: HitRates) -> None:
    comparison = np.arange(1, rates.hit_rate.size + 1)
    axes.errorbar(comparison, rates.hit_rate, rates.hit_rate_sd, fmt="o", color=BLUE, capsize=3.0)
    axes.set(xlabel="comparison", ylabel="hit rate [fraction]", ylim=(0.0, 1.05), xticks=comparison)


@drawing("PsychometricFit", "curve")
def draw_curve(axes: Axes, fit: PsychometricFit) -> None:
    """Draw the observed proportions, the curve through them, and its threshold."""
    levels = fit.counts.levels
    room = 0.1 * float(np.ptp(levels))
    at = np.linspace(levels.min() - room, levels.max() + room, CURVE_POINTS)
    axes.plot(at, fit.predict(at), color=BLUE)
    axes.plot(levels, fit.counts.proportion, "o", color=BLACK)
    axes.axvline(fit.threshold(), color=GREY, linestyle=":")
    axes.set(xlabel=f"level; threshold {fit.threshold_label}", ylabel="proportion correct", ylim=(0.0, 1.05))


@drawing("FitResult", "rates")
def draw_rates(axes: Axes, fit: FitResult, phase: str | None = None) -> None:
    """Draw observed, fitted and predicted rates."""
    phases = tuple(recorded(fit))
    draw_phase(axes, fit, one_of("phase", phase or phases[-1], phases))  # the static one where there is one
    axes.legend(fontsize="small")


@drawing("SpikeFit", "parameters")
def draw_parameters(axes: Axes, fit: SpikeFit) -> None:
    """Draw the standard error of each parameter, as a share of its value."""
    relative = fit.standard_errors / np.abs(fit.parameters)
    rows = np.arange(relative.size)
    names = [f"{name} = {value:.3g}" for name, value in zip(fit.names, fit.parameters, strict=True)]
    axes.errorbar(np.ones(rows.size), rows, xerr=relative, fmt="o", color=BLUE, capsize=3.0)
    axes.set_yticks(rows, names)
    axes.set(xlabel="over the estimate, ± one standard error", ylabel="parameter")
    axes.set_ylim(rows.size - 0.5, -0.5)


@drawing("TaskResult", "curves")
def draw_task(axes: Axes, task: TaskResult, measure: str | None = None) -> None:
    """Draw hit rates and psychometric curves of all codes."""
    measures = tuple(dict.fromkeys(decoding.measure for decoding in task.decodings))
    draw_curves_of_measure(axes, task, one_of("measure", measure or main_decoding(task).measure, measures))
    axes.legend(fontsize="small")


@drawing("ReducedSample", "quantity")
def draw_sample(axes: Axes, sample: ReducedSample) -> None:
    """Draw the first quantity at each receptor, with the error of the reduced touch."""
    name, values = next(iter(sample.fields.items()))
    bars: Any = {"fmt": "o", "color": BLUE, "markersize": 3.0}
    axes.errorbar(np.arange(values.size), values, sample.field_errors[name], **bars)
    axes.set(xlabel="receptor", ylabel=_label(name))


@drawing("Fingertip", "outline")
def draw_finger(axes: Axes, finger: Fingertip) -> None:
    """Draw the outline of a finger in its middle plane, with skin, bone and nail."""
    # A square root of the way to the tip, where the outline is round.
    x = finger.length_mm * (1.0 - np.linspace(1.0, 0.0, CURVE_POINTS) ** 2)
    volar, dorsal, _ = finger.section(x)
    outline = np.concatenate([x, x[::-1]]), np.concatenate([-volar, dorsal[::-1]])
    axes.fill(*outline, facecolor="#f7ece1", edgecolor=BLACK, linewidth=1.0)
    start, tip = finger.spine_end_x_mm, finger.bone_tip_x_mm
    way = np.linspace(0.0, np.pi, CURVE_POINTS)
    bone_x = np.concatenate([[0.0], start + (tip - start) * np.sin(way), [0.0]])
    bone_y = finger.spine_y_mm + finger.bone_height_mm * np.concatenate([[1.0], np.cos(way), [-1.0]])
    axes.fill(bone_x, bone_y, facecolor=BONE_INSIDE, edgecolor=BONE, linewidth=1.2)
    nail = np.linspace(finger.nail_x_mm[0], finger.nail_x_mm[1], CURVE_POINTS)
    axes.plot(nail, finger.section(nail)[1], color=BONE, linewidth=4.0)
    for depth in finger.layer_depths_mm:
        below = np.where(volar > 2.0 * depth, depth - volar, np.nan)  # layers turn upright at the tip
        axes.plot(x, below, color=GREY, linewidth=0.5)
    axes.plot([finger.contact_mm[0]], [-float(finger.section(finger.contact_mm[0])[0])], "v", color=BLUE)
    axes.set(xlabel="along, x [mm]", ylabel="towards the back, y [mm]", aspect="equal")
    axes.grid(visible=False)


def plot(result: Displayed, axes: Axes | None = None, what: str | None = None, **options: Any) -> Axes:
    """Draw a result; see `Displayed.plot`."""
    drawings = DRAWINGS[type(result).__name__]
    name = one_of("what", next(iter(drawings)) if what is None else what, tuple(drawings))
    draw = drawings[name]
    known = list(signature(draw).parameters)[2:]
    for option in options.keys() - known:
        allowed = ", ".join(known) or "none"
        raise InputError(f"Options of the drawing {name} are: {allowed}; got {option}.")
    if axes is not None and not isinstance(axes, Axes):
        raise InputError("axes", "must be axes of Matplotlib", f"{axes!r:.60}", "name a drawing by what=")
    if axes is None:
        # Only a figure of pyplot is shown by a notebook or a window.
        from matplotlib import pyplot

        axes = pyplot.subplots(layout="constrained")[1]
    draw(axes, result, **options)
    return axes


def html(result: Displayed) -> str:
    """Return a picture and the line of `repr` in HTML; see `Displayed`."""

    def draw() -> Figure:
        figure = new_figure(4.5, 2.6)
        plot(result, figure.add_subplot(), IN_NOTEBOOKS.get(type(result).__name__))
        return figure

    picture = b64encode(png(draw)).decode()
    return (
        f'<figure style="margin:0"><img width="450" alt="" src="data:image/png;base64,{picture}">'
        f"<figcaption>{escape(repr(result))}</figcaption></figure>"
    )
