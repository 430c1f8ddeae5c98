"""Figures of afferents: trains and maps of a population, rates of one afferent, and fits to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from fingerpad.core.signals import COUNT, CURRENT, RECEPTOR_COLUMNS, ResponseMap, SpikeTrains, Traces
from fingerpad.core.units import unit_of
from fingerpad.core.values import FloatArray, one_of
from fingerpad.data import paper, protocol
from fingerpad.experiments.fit.results import CredibleInterval, FitResult, ParameterProfile, UncertaintyResult
from fingerpad.experiments.gerling2014.nerve import PopulationMaps, SingleUnitResult
from fingerpad.experiments.receptive_field import ReceptiveField
from fingerpad.experiments.scan import ScanResult, TactileImage
from fingerpad.inference.spike_likelihood import SpikeFit
from fingerpad.report.page import DRAW, DRAWINGS, ROWS, Rows, enter
from fingerpad.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREY,
    MAP_AXES,
    NANOAMPERE_PER_MA,
    NO_MARKER,
    ORANGE,
    PALE,
    SERIES,
    draw_rates,
    fill_band,
    new_figure,
    quantity_label,
    say_nothing_to_draw,
    shared_legend,
)
from fingerpad.report.tables import ABSENT, IDENTIFIABLE_SYMBOLS, PHASE_LABELS, fixed, plain

LARGEST_MARK, SILENT_MARK = 60.0, 4.0  # Areas: most active afferent of a type, silent. [points²]
ROW_DRAWN = 0.85  # Length of the mark of a spike, over the height of the row of its afferent.


def draw_raster_by_type(axes: Axes, maps: Mapping[str, ResponseMap]) -> None:
    """Draw all spikes over time, in a band per type that the afferents which fire divide among them."""
    labels = []
    for band, ((name, response), style) in enumerate(zip(maps.items(), cycle(SERIES), strict=False)):
        counts = response.spike_count
        middle = response.positions_mm.mean(axis=0)
        order = np.argsort(np.linalg.norm(response.positions_mm - middle, axis=1))
        firing = order[counts[order] > 0]
        top_of = np.zeros(order.size)
        top_of[firing] = band + np.arange(firing.size) / max(firing.size, 1)
        tops = np.repeat(top_of, counts)
        ends = tops + ROW_DRAWN / max(firing.size, 1)
        axes.vlines(response.spikes.times_ms, tops, ends, color=style["color"], linewidth=0.6)
        axes.axhline(band, color=GREY, linewidth=0.5)
        labels.append(f"{name}\n{firing.size} of {order.size}")
    axes.set(xlabel="time [ms]", ylabel="afferents that fire, nearest on top", ylim=(len(maps), 0.0))
    axes.set_yticks(0.5 + np.arange(len(maps)), labels)
    axes.grid(visible=False)


def draw_map_by_type(axes: Axes, maps: Mapping[str, ResponseMap]) -> None:
    """Draw where the afferents lie, with larger marks for more spikes."""
    for (name, response), style in zip(maps.items(), cycle(SERIES), strict=False):
        counts, (x, z) = response.spike_count, response.positions_mm[:, [0, -1]].T
        fires = counts > 0
        axes.scatter(x[~fires], z[~fires], SILENT_MARK, color=style["color"], marker=".", linewidths=0.0)
        area = SILENT_MARK + LARGEST_MARK * counts[fires] / max(counts.max(initial=1), 1)
        hollow: Any = {"facecolors": "none", "edgecolors": style["color"], "linewidths": 0.9}
        axes.scatter(x[fires], z[fires], area, label=name, marker=style["marker"], **hollow)
    axes.set(**MAP_AXES)


def draw_trains(axes: Axes, trains: Sequence[FloatArray], on_top: str) -> None:
    """Draw the spikes of the afferents that fire, a row each from the top, or say that none does."""
    firing = [train for train in trains if train.size]
    if not firing:
        say_nothing_to_draw(axes, "no afferent fires a spike")
        return
    rows = list(range(1, len(firing) + 1))
    axes.eventplot(firing, lineoffsets=rows, linelengths=0.75, linewidths=1.0, colors=BLACK)
    axes.set(xlabel="time [ms]", ylim=(len(firing) + 0.75, 0.25), yticks=[])
    axes.set_ylabel(f"{len(firing)} of {len(trains)} afferents fire,\n{on_top} on top")


# Place of a legend that must not lie on what is drawn.
BESIDE: Any = {"fontsize": "small", "loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}

QUANTITIES = {
    "dynamic_rate_hz": ("dynamic ramp", "rate [spikes/s]", "viridis", Normalize),
    "static_rate_hz": ("static hold", "rate [spikes/s]", "viridis", Normalize),
    # Most first spikes come within a few tens of milliseconds, those at the rim after hundreds.
    "first_spike_latency_ms": ("first spike", "latency [ms]", "viridis_r", LogNorm),
}
"""Quantities of an afferent: when, what with its unit, colours and scale."""


@enter(DRAWINGS, ("ResponseMap", "raster"))
@enter(DRAWINGS, ("SpikeTrains", "raster"))
def draw_raster(axes: Axes, spikes: SpikeTrains | ResponseMap) -> None:
    """Draw the spikes of the afferents that fire, in their order from the top; in a band per type."""
    if isinstance(spikes, ResponseMap) and spikes.parts:
        draw_raster_by_type(axes, spikes.parts)
        return
    draw_trains(axes, list(spikes.spikes if isinstance(spikes, ResponseMap) else spikes), "first")


@enter(DRAWINGS, ("ResponseMap", "map"))
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


ON_OBJECT: Any = {"xlabel": "along the object [mm]", "ylabel": "across [mm]", "aspect": "equal"}


@enter(DRAWINGS, ("ScanResult", "events"))
def draw_events(axes: Axes, found: ScanResult, name: str | None = None) -> None:
    """Draw the spikes of a type of afferents where they lay on the object: the spatial event plot."""
    name = one_of("name", name or next(iter(found.of_type)), tuple(found.of_type))
    places = np.concatenate([event[-1] for event in found.events(name)])
    if not len(places):
        say_nothing_to_draw(axes, f"no {name} afferent fires")
        return
    axes.plot(*places.T, ".", color=BLACK, markersize=1.5, markeredgewidth=0.0)
    axes.set(title=f"{name}, {len(places)} spikes", **ON_OBJECT)


@enter(DRAWINGS, ("TactileImage", "image"))
def draw_image(axes: Axes, image: TactileImage, largest_hz: float | None = None) -> None:
    """Draw the firing rate of a type of afferents by where they lie on the object."""
    rates_hz = np.ma.masked_invalid(image.rate_hz.T)
    drawn = axes.pcolormesh(
        image.along_mm,
        image.across_mm,
        rates_hz,
        cmap="viridis",
        shading="nearest",
        vmin=0.0,
        vmax=largest_hz,
    )
    axes.figure.colorbar(drawn, ax=axes, label="rate [spikes/s]", shrink=0.6)
    axes.set(title=image.type, **ON_OBJECT)


ROOM_IN, HIGHEST_PANEL = 0.8, 1.2  # Of a panel: room for its title and labels [in], height over width.


@enter(DRAW, "scan_events")
def figure_of_events(found: ScanResult) -> Figure:
    images = [found.image(name) for name in found.of_type]
    first = images[0]
    along_mm, across_mm = (np.ptp(axis) + first.pixel_mm for axis in (first.along_mm, first.across_mm))
    panel_in = 0.5 * COLUMN_IN
    height_in = ROOM_IN + panel_in * min(across_mm / along_mm, HIGHEST_PANEL)
    figure = new_figure(len(images) * panel_in, 2.0 * height_in)
    panels = figure.subplots(2, len(images), squeeze=False, sharex=True, sharey=True)
    for image, (events, rates) in zip(images, panels.T, strict=True):
        draw_events(events, found, image.type)
        draw_image(rates, image)
    return figure


@enter(DRAW, "scan_course")
def figure_of_course(found: ScanResult) -> Figure:
    figure = new_figure(COLUMN_IN, 4.0)
    force, depth = figure.subplots(2, 1, sharex=True)
    for number, skin in enumerate(found.skins):
        shade = {"color": BLACK, "alpha": 1.0 if number == 0 else 0.3, "linewidth": 1.0}
        force.plot(skin.times_ms, skin.force_mn, **shade)
        depth.plot(skin.times_ms, skin.depth_mm, **shade)
    force.set(ylabel="force [mN]", ylim=(0.0, None))
    depth.set(ylabel="depth [mm]", xlabel="time [ms]")
    return figure


@enter(DRAWINGS, ("ReceptiveField", "field"))
def draw_field(axes: Axes, field: ReceptiveField) -> None:
    """Draw the spikes by the place of the probe, the border of the field and its hot spots."""
    drawn = axes.pcolormesh(field.x_mm, field.z_mm, field.spike_count.T, cmap="viridis", shading="nearest")
    axes.figure.colorbar(drawn, ax=axes, label="spikes of the whole touch")
    axes.contour(field.x_mm, field.z_mm, field.within.T, levels=[0.5], colors="white", linewidths=1.5)
    axes.plot(*field.hot_spots_mm.T, "o", color="white", markeredgecolor=BLACK, markersize=6.0)
    area = f"{'at least ' if field.is_cut_off else ''}{field.area_mm2:.1f} mm²"
    axes.set(title=f"{field.depth_mm:.2g} mm deep: {area}", aspect="equal")
    axes.set(xlabel="probe along the finger [mm]", ylabel="probe across [mm]")
    axes.grid(visible=False)


@enter(DRAWINGS, ("Traces", "traces"))
def draw_traces(axes: Axes, traces: Traces) -> None:
    """Draw the quantity over time, a current in nA: a few sites have a key, many are thin black lines."""
    factor, label = (NANOAMPERE_PER_MA, "current [nA]") if traces.quantity == CURRENT else (1.0, None)
    values = factor * traces.values
    axes.set(xlabel="time [ms]", ylabel=label or quantity_label(traces.quantity))
    if not 1 < values.shape[1] <= len(SERIES):
        axes.plot(traces.times_ms, values, color=BLACK, linewidth=0.8)
        return
    for site, (column, style) in enumerate(zip(values.T, SERIES, strict=False), start=1):
        axes.plot(traces.times_ms, column, label=f"site {site}", linewidth=1.2, **style | NO_MARKER)
    axes.legend(**BESIDE)


TICKS_MS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)


@enter(DRAW, "figure_6_population")
def draw_population(section: PopulationMaps) -> Figure:
    drawn = new_figure(COLUMN_IN, 3.5)
    panels = drawn.subplots(1, len(QUANTITIES), sharey=True)
    for axes, letter, key in zip(panels, "abc", QUANTITIES, strict=True):
        phase, label, colours, scaling = QUANTITIES[key]
        axes.set_title(f"({letter}) {phase}")
        values = getattr(section, key).T
        if np.isnan(values).all():
            say_nothing_to_draw(axes, "no afferent fires")
            continue
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        scale = scaling(low, max(high, 1.001 * low, 1e-3), clip=True)  # apart, as logarithms need it
        # Skin that does not respond.
        axes.patch.set(facecolor=PALE, hatch="//", edgecolor=GREY, linewidth=0.0)
        shown = np.ma.masked_where(~(values > 0.0), values)
        cells: Any = {"cmap": colours, "norm": scale, "shading": "nearest"}
        picture = axes.pcolormesh(section.x_mm, section.z_mm, shown, **cells)
        dots: Any = {"markersize": 3.0, "color": "white", "markeredgecolor": "black", "markeredgewidth": 0.6}
        axes.plot(*section.receptors_mm.T, "o", **dots)
        axes.set(**MAP_AXES)
        axes.grid(visible=False)
        bar = drawn.colorbar(picture, ax=axes, label=label, location="bottom")
        if scaling is LogNorm:
            bar.set_ticks([tick for tick in TICKS_MS if low <= tick <= high])
            bar.minorticks_off()
            bar.ax.xaxis.set_major_formatter("{x:g}")
    for axes in panels[1:]:
        axes.set_ylabel("")
    return drawn


BAR_HALF_WIDTH_MM = protocol.BAR_WIDTH.value / 2.0
STATIC_MARK_MM = 2.9  # Position at which the paper's static difference is drawn, where no rates are. [mm]
ALONG = "place of the bar, distal [mm]"  # Figures have the distal side on the right; results do not.


@enter(DRAW, "figure_5_single_unit")
def draw_single_unit(section: SingleUnitResult) -> Figure:
    drawn = new_figure(COLUMN_IN, 4.0)
    dynamic, static = drawn.subplots(1, 2)
    for axes, letter, phase in ((dynamic, "a", "dynamic"), (static, "b", "static")):
        rate_hz, observed_hz = (getattr(section, f"{of}{phase}_rate_hz") for of in ("", "observed_"))
        fss = fixed(getattr(section, f"fss_in_sample_{phase}"), 2)
        axes.axvspan(-BAR_HALF_WIDTH_MM, BAR_HALF_WIDTH_MM, color="#f3f1ea", zorder=0)
        draw_rates(axes, -section.shift_mm, rate_hz, observed_hz, "model (fitted)")
        axes.set_title(f"({letter}) {PHASE_LABELS[phase]}, FSS = {fss}", fontsize=10.0)
        axes.set_xlabel(ALONG)
    # The rates under the flat face and at the edge that the paper predicts, and the observed ones.
    observed = section.modulation["dynamic"]["observed"]
    printed = (paper.DYNAMIC_RATE_MINIMUM.value, paper.DYNAMIC_RATE_MAXIMUM.value)
    for levels, colour, dashes, label in (
        (printed, ORANGE, (6, 3), "predicted by the paper, lowest and highest"),
        ((observed.minimum_hz, observed.maximum_hz), BLACK, (1, 2), "observed, lowest and highest"),
    ):
        for level in levels:
            line: Any = {"color": colour, "linestyle": (0, dashes), "linewidth": 1.2, "zorder": 1}
            dynamic.axhline(level, label=label, **line)
    dynamic.set_ylim(top=1.1 * max(*printed, dynamic.get_ylim()[1] / 1.05))
    # The difference that the paper predicts, from our lowest rate: it prints no static rates.
    bar = 0.5 * paper.STATIC_RATE_DIFFERENCE.value
    middle = section.modulation["static"]["ours"].minimum_hz + bar
    label = "difference predicted by the paper"
    static.errorbar(STATIC_MARK_MM, middle, bar, color=ORANGE, capsize=5.0, elinewidth=1.8, label=label)
    shared_legend(drawn, drawn.axes, columns=2)
    return drawn


LONGEST_LABEL = 12  # Names of stimuli are cut to so many letters at an axis.
LARGEST_LOSS = 5.0  # Losses of log likelihood that are drawn.
ALLOWED_LOSS = 1.92  # Loss at the ends of a 95 % interval: half the quantile of chi-square, 1 degree.


def recorded(found: FitResult) -> list[str]:
    return [phase for phase in PHASE_LABELS if found.phases[phase].observed_hz is not None]


@enter(DRAW, "fit")
def draw_fit(found: FitResult) -> Figure:
    drawn, phases = new_figure(10.0, 4.5), recorded(found)
    for axes, phase in zip(np.ravel(drawn.subplots(1, len(phases))), phases, strict=True):
        draw_phase(axes, found, phase)
    shared_legend(drawn, [axes], columns=4)
    return drawn


def draw_phase(axes: Axes, found: FitResult, phase: str) -> None:
    """Draw the observed rates of one phase, the fitted ones, and those predicted without each fold."""
    # Stimuli without a place on an axis have no order: no line joins them.
    has_axis, count = found.shift_mm is not None, len(found.stimulus)
    places = np.arange(count, dtype=np.float64) if found.shift_mm is None else -found.shift_mm
    order = np.argsort(places, kind="stable")
    where, rates = places[order], found.phases[phase]
    assert rates.observed_hz is not None
    if found.posterior and phase in found.posterior.rates:
        band, label = found.posterior.rates[phase], f"{found.posterior.level:.0%} credible"
        fill_band(axes, where, band.low_hz[order], band.high_hz[order], BLUE, 0.2, label)
    without = rates.out_of_sample_hz[order]
    axes.plot(where, without, "x", color=ORANGE, zorder=3, label="predicted without its fold")
    observed_hz = rates.observed_hz[order]
    draw_rates(axes, where, rates.fitted_hz[order], observed_hz, "fitted to all", line=has_axis)
    axes.set_title(f"{PHASE_LABELS[phase]}, FSS = {rates.fss_in_sample:.2f}")
    axes.set_xlabel("shift, distal [mm]" if has_axis else "stimulus")
    if not has_axis:
        axes.set_xticks(where, [name[:LONGEST_LABEL] for name in found.stimulus], rotation=90)


@enter(DRAWINGS, ("FitResult", "rates"))
def draw_fitted(axes: Axes, fit: FitResult, phase: str | None = None) -> None:
    """Draw observed, fitted and predicted rates."""
    phases = recorded(fit)
    draw_phase(axes, fit, one_of("phase", phase or phases[-1], phases))  # the static one where there is one
    axes.legend(fontsize="small")


@enter(DRAWINGS, ("SpikeFit", "parameters"))
def draw_parameters(axes: Axes, fit: SpikeFit) -> None:
    """Draw the standard error of each parameter, as a share of its value."""
    relative = fit.standard_errors / np.abs(fit.parameters)
    rows = np.arange(relative.size)
    names = [f"{name} = {value:.3g}" for name, value in zip(fit.names, fit.parameters, strict=True)]
    axes.errorbar(np.ones(rows.size), rows, xerr=relative, fmt="o", color=BLUE, capsize=3.0)
    axes.set_yticks(rows, names)
    axes.set(xlabel="over the estimate, ± one standard error", ylabel="parameter")
    axes.set_ylim(rows.size - 0.5, -0.5)


@enter(ROWS, "fit_rates")
def rows_of_rates(found: FitResult) -> Rows:
    """Return the rates of every stimulus: observed, fitted, and predicted without its fold."""
    presentations, rows = found.presentations or [None] * len(found.stimulus), []
    phases = [found.phases[phase] for phase in PHASE_LABELS]
    rates = [each for one in phases for each in (one.observed_hz, one.fitted_hz, one.out_of_sample_hz)]
    for place, (name, presented) in enumerate(zip(found.stimulus, presentations, strict=True)):
        shown = (ABSENT if each is None else fixed(each[place], 1) for each in rates)
        rows.append((name, str(found.fold[place]), plain(presented), *shown))
    return rows


def draw_profile(
    axes: Axes, profile: ParameterProfile, unit: str, fitted: float, credible: CredibleInterval | None
) -> None:
    """Draw one profile: its points, the level of the interval, the fit, the posterior's interval."""
    axes.plot(profile.values, profile.losses, ".-", color=BLACK, linewidth=1.2)
    axes.axhline(ALLOWED_LOSS, color=GREY, linestyle="--", linewidth=1.0)
    axes.axvline(fitted, color=ORANGE, linestyle="-.", linewidth=1.4)
    if credible is not None:
        ends = [credible.low, credible.high]
        axes.plot(ends, [-0.25, -0.25], color=BLUE, linewidth=4.0, solid_capstyle="butt")
    axes.set(ylim=(-0.5, LARGEST_LOSS), xlabel=f"{IDENTIFIABLE_SYMBOLS[profile.name]} [{unit}]")


@enter(DRAW, "profiles")
def draw_profiles(found: FitResult) -> Figure:
    drawn, profiles = new_figure(10.0, 3.2), found.profiles or ()
    intervals = found.posterior.numbers if found.posterior else {}
    panels = drawn.subplots(1, len(profiles), sharey=True)
    for axes, profile in zip(panels, profiles, strict=True):
        unit, fitted = found.identifiable_units[profile.name], found.identifiable[profile.name]
        draw_profile(axes, profile, unit, fitted, intervals.get(profile.name))
    panels[0].set_ylabel("loss of log likelihood")
    return drawn


@enter(DRAW, "offset")
def draw_offset(found: FitResult) -> Figure:
    drawn, offset = new_figure(6.5, 3.8), found.offset
    assert offset is not None
    axes = drawn.subplots()
    axes.axvline(0.0, color=GREY, linewidth=1.0)
    axes.plot(offset.held.offset_mm, offset.held.fss_in_sample, "o-", color=BLACK, label="held there")
    best: Any = {"color": ORANGE, "markersize": 7.0, "label": "fitted to all"}
    axes.plot([offset.offset_mm], [offset.fss_in_sample], "D", **best)
    low = axes.get_ylim()[0]
    ticks: Any = {"color": BLUE, "markersize": 14.0, "markeredgewidth": 2.0, "clip_on": False}
    axes.plot(offset.folds_mm, [low] * len(offset.folds_mm), "|", label="fitted without a fold", **ticks)
    axes.set_ylim(bottom=low)
    axes.set(xlabel="offset of the receptor, distal positive [mm]", ylabel="FSS in sample [1]")
    axes.legend()
    return drawn


@enter(DRAW, "figure_11_uncertainty")
def draw_uncertainty(section: UncertaintyResult) -> Figure:
    drawn = new_figure(COLUMN_IN, 7.5)
    panels = drawn.subplots(3, 2).ravel()
    for axes, letter, (phase, rates) in zip(panels, "ab", section.rates.items(), strict=False):
        where = -section.shift_mm
        fill_band(axes, where, rates.new_low_hz, rates.new_high_hz, PALE, 1.0, "new recording")
        fill_band(axes, where, rates.low_hz, rates.high_hz, BLUE, 0.45, "prediction")
        draw_rates(axes, where, rates.median_hz, rates.observed_hz, "median")
        axes.set(title=f"({letter}) {PHASE_LABELS[phase]}", xlabel=ALONG)
    drawn.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    for axes, letter, profile in zip(panels[2:], "cdef", section.profiles, strict=True):
        name = profile.name
        draw_profile(axes, profile, section.units[name], section.fit[name], section.posterior[name])
        axes.set_title(f"({letter}) {IDENTIFIABLE_SYMBOLS[name]}")
    for axes in panels[2::2]:
        axes.set_ylabel("loss of log likelihood")
    return drawn
