"""Tables and pictures of docs/afferents.md and docs/vibration.md.

`python -m studies.afferents_page` presses a probe, balls, a stroke and vibrations, and writes them anew (half
an hour); with the names of parts only those.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from scipy.interpolate import interp1d

import fingerpad as fp
from fingerpad.core.errors import InertiaWarning
from fingerpad.core.regions import Ellipse
from fingerpad.core.signals import ResponseMap
from fingerpad.core.values import FloatArray
from fingerpad.data import afferents as published
from fingerpad.geometry.motion import Cycles
from fingerpad.neuron.afferent import AnyAfferent
from fingerpad.neuron.afferent_types import afferent_types
from fingerpad.neuron.end_organs import EndOrgans
from fingerpad.neuron.tuning import tuning_curve
from fingerpad.report.nerve import draw_map_by_type, draw_raster_by_type
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, SERIES, new_figure, write_png
from fingerpad.skin.indentation import settings_of
from fingerpad.skin.sampling import SkinResponse
from studies.pages import DOCS, IMAGES, table, write_blocks

PAGE = DOCS / "afferents.md"
STYLES = [(style["color"], style["marker"]) for style in SERIES]
X_MM = 17.37
DISC = Ellipse(5.0, 5.0, centre_mm=(X_MM, 0.0))
BALL, PROBE = fp.Sphere(curvature_per_m=287), fp.FlatPunch(diameter_mm=1.0, fillet_mm=0.2)
TOUCHES = {
    "press of 1 mm": fp.RampAndHold(depth_mm=1.0, hold_ms=350.0),
    "vibration of 40 Hz, amplitude 50 µm": fp.sine(
        depth_mm=0.5, amplitude_mm=0.05, frequency_hz=40.0, cycles=8, hold_ms=100.0
    ),
    "stroke of 20 mm/s": fp.stroke(depth_mm=0.5, speed_mm_per_s=20.0, x_mm=3.0, strokes=1, hold_ms=100.0),
}
SITES = {"SAI": 0.0, "RA": 0.0, "PC": 0.0, "SAII": 1.0}
"""Distance of the end organ from the middle of the probe at which a type is most sensitive. [mm]"""

SLOW_TYPES = ("SAI", "SAII")
"""Types whose hold is taken to be 0, since they fire in that of the probe."""

OBSERVED = {
    "SAI": (published.SAI_TUNING_FREQUENCIES, published.SAI_TUNING),
    "RA": (published.RA_TUNING_FREQUENCIES, published.RA_TUNING),
    "PC": (published.PC_TUNING_FREQUENCIES, published.PC_TUNING),
}
FREQUENCIES_HZ = np.array([1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0, 100.0, 150.0, 200.0, 300.0, 400.0])
SLOW_MM_PER_S = 4.0
SPEEDS_MM_PER_S = (4.0, 20.0, 100.0)
PROBING_MM_PER_S = 20.0
"""Speed at which receptive fields are probed."""

DEEPEST_MM = 1.6
"""Depth of the slow ramp, five times the largest threshold."""

DEPTHS_UM = np.geomspace(2.0, 1e3 * DEEPEST_MM, 96)
SPEEDS_OF_THRESHOLDS = np.geomspace(0.1, 100.0, 61)
TIMES_THRESHOLD = (4.0, 5.0)
BRANCHES = {"RA": (14, 1.2)}
"""End organs per afferent and the radius of the disc in which they are scattered, instead of its own. [mm]"""


def indented(indenter: fp.Indenter, motion: Any, tissues: str = "human", **more: Any) -> SkinResponse:
    """Press at quick resolution, without the warning of inertia, about which the page speaks."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        return fp.indent(fp.Fingertip(), indenter, motion, tissues, **more)


def draw_mixed_responses(touches: Mapping[str, Mapping[str, ResponseMap]]) -> Figure:
    """Draw the responses to touches by type, one touch per row: all spikes over time, and the places.

    In the map the area of a mark grows with the number of spikes over the largest of its type.
    """
    drawn = new_figure(9.5, 3.4 * len(touches))
    grid = drawn.subplots(len(touches), 2, squeeze=False, width_ratios=(1.7, 1.0))
    for (raster, places), (name, maps) in zip(grid, touches.items(), strict=True):
        raster.set_title(name)
        draw_raster_by_type(raster, maps)
        draw_map_by_type(places, maps)
    grid[0, 1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return drawn


def mixed() -> None:
    """Draw a mixed population under a press, a vibration and a stroke."""
    population = fp.Population.at_densities(DISC, seed=1)
    windows = (0.0, 50.0), (100.0, 300.0)
    maps = {
        name: population.respond(indented(BALL, motion), *windows).parts for name, motion in TOUCHES.items()
    }
    write_png(IMAGES / "mixed_responses.png", draw_mixed_responses, maps)


@cache
def step_on_hold() -> SkinResponse:
    """Press the probe 0.5 mm deep, and after 550 ms 10 µm more and less within 1 ms each."""
    motion = fp.Trajectory((0, 50, 600, 601, 602, 603), (0, 0.5, 0.5, 0.51, 0.5, 0.49))
    return indented(PROBE, motion)


@cache
def slow_ramp() -> SkinResponse:
    """Press the probe at 4 mm/s, and hold it."""
    end_ms = 1e3 * DEEPEST_MM / SLOW_MM_PER_S
    times_ms = np.round(np.geomspace(2.5, end_ms, 28), 3)
    motion = fp.Trajectory((0, end_ms, end_ms + 500.0), (0, DEEPEST_MM, DEEPEST_MM))
    return indented(PROBE, motion, times_ms=times_ms.tolist())


Pair = tuple[float, float]


def linear_response(name: str, afferent: AnyAfferent) -> tuple[Pair, Pair]:
    """Return holds and changes per µm of what the two terms of a type follow, at its most sensitive place."""
    skin = step_on_hold()
    at = [int(np.argmin(np.abs(skin.times_ms - time_ms))) for time_ms in (600.0, 601.0, 603.0)]
    holds, slopes = [], []
    for quantity in (afferent.dynamic_quantity, afferent.static_quantity):
        values = skin.sample(quantity, [(X_MM, SITES.get(name, 0.0))])[:, 0]
        holds.append(0.0 if name in SLOW_TYPES else float(values[at[0]]))
        slopes.append(float((values[at[1]] - values[at[2]]) / 20.0))
    return (holds[0], holds[1]), (slopes[0], slopes[1])


def tuning() -> None:
    """Write the table and the figure of the tuning curves."""
    curves, rows = {}, []
    for name, afferent in afferent_types().items():
        hold, per_um = linear_response(name, afferent)
        curves[name] = tuning_curve(afferent, FREQUENCIES_HZ, per_um, hold)
    ratios = {name: curves[name] / observed_um(name) for name in OBSERVED}
    levels = {name: float(np.exp(np.nanmean(np.log(ratio)))) for name, ratio in ratios.items()}
    for number, frequency_hz in enumerate(FREQUENCIES_HZ):
        cells = [f"{frequency_hz:g}"]
        for name, curve in curves.items():
            known = name in ratios and np.isfinite(ratios[name][number])
            shape = f" ({ratios[name][number] / levels[name]:.2f})" if known else ""
            cells.append(f"{_micrometres(curve[number])}{shape}")
        rows.append(cells)
    rows.append(["level", *(f"{levels[name]:.2g}" if name in levels else "" for name in curves)])
    _write_table("tuning", ["frequency [Hz]", *(f"{name} [µm]" for name in curves)], rows)
    write_png(IMAGES / "afferent_tuning.png", draw_tuning, curves)


def observed_um(name: str) -> FloatArray:
    """Return recorded thresholds at `FREQUENCIES_HZ`, NaN beyond those that were recorded. [µm]"""
    at_hz, thresholds_um = (np.log(each.value) for each in OBSERVED[name])
    outside = {"left": np.nan, "right": np.nan}
    return np.exp(np.interp(np.log(FREQUENCIES_HZ), at_hz, thresholds_um, **outside))


def draw_tuning(curves: dict[str, FloatArray]) -> Figure:
    """Draw thresholds over frequency, and the recorded ones."""
    figure = new_figure(7.0, 4.6)
    axes = figure.subplots()
    for (name, curve), (colour, marker) in zip(curves.items(), STYLES, strict=False):
        axes.loglog(FREQUENCIES_HZ, curve, color=colour, label=f"{name}, model")
        if name in OBSERVED:
            at_hz, thresholds_um = (each.value for each in OBSERVED[name])
            axes.plot(
                at_hz, thresholds_um, marker, color=colour, markerfacecolor="white", markersize=5.5,
                linestyle=":", linewidth=0.8, label=f"{name}, recorded",
            )  # fmt: skip
    axes.set(xlabel="frequency [Hz]", ylabel="amplitude for one impulse per cycle [µm]", ylim=(0.02, 3000.0))
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


DISTANCES_MM = np.arange(0.0, 8.01, 0.1)


def indented_by(traces: fp.Traces, depth_um: float, speed_mm_per_s: float) -> fp.Traces:
    """Traces under an indentation to a depth at a speed, and a hold, from those of the slow ramp.

    Stress and strain at a depth hardly depend on the speed: relaxation takes seconds.
    """
    ramp_ms = depth_um / speed_mm_per_s
    known_um = np.minimum(SLOW_MM_PER_S * traces.times_ms, 1e3 * DEEPEST_MM)
    rises = known_um < 1e3 * DEEPEST_MM
    times_ms = np.append(np.linspace(0.0, ramp_ms, 17), ramp_ms + 200.0)
    wanted_um = np.minimum(speed_mm_per_s * times_ms, depth_um)
    rises[np.argmax(~rises)] = True

    def resampled(term: fp.Traces, dynamic: fp.Traces | None = None) -> fp.Traces:
        values = interp1d(known_um[rises], term.values[rises], axis=0)(wanted_um)
        return fp.Traces(times_ms, values, np.array([ramp_ms]), term.quantity, dynamic)

    return resampled(traces, None if traces.dynamic is None else resampled(traces.dynamic))


def threshold_depths_um(afferent: AnyAfferent, traces: fp.Traces, speed_mm_per_s: float) -> FloatArray:
    """Smallest depth of an indentation that elicits a spike at every site, inf if none does. [µm]"""
    depths = np.full(traces.n_sites, np.inf)
    for depth_um in DEPTHS_UM[::-1]:
        fires = np.diff(afferent.spikes(indented_by(traces, depth_um, speed_mm_per_s)).offsets) > 0
        depths[fires] = depth_um
    return depths


def ramp_traces(afferent: AnyAfferent, sites: Any) -> fp.Traces:
    """Traces of the slow ramp at sites."""
    return fp.Population(np.array(sites), 1.0, afferent).followed(slow_ramp())


def field_area_mm2(depths_um: FloatArray, times: float) -> float:
    """Area of skin from which a depth of so many times the smallest one elicits a spike, from a profile."""
    inside = DISTANCES_MM[: depths_um.size][depths_um <= times * depths_um.min()]
    return float(np.pi * inside.max() ** 2) if inside.size else float("nan")


def profile_sites() -> list[list[tuple[float, float]]]:
    """Sites at `DISTANCES_MM` from the probe across the finger and towards its base."""
    across = [(X_MM, float(z)) for z in DISTANCES_MM if z < 6.55]
    return [across, [(X_MM - float(x), 0.0) for x in DISTANCES_MM]]


def branched_area_mm2(name: str, times: float, seed: int) -> float:
    """Area of the field of one afferent with several end organs, probed on a grid of 0.25 mm.

    By the profile across the finger, the probe at a place acts on an end organ as by their distance.
    """
    afferent = afferent_types()[name]
    count, reach_mm = BRANCHES[name]
    ends = EndOrgans.scattered(np.zeros((seed + 1, 2)), count, reach_mm, seed=17).positions_mm[seed]
    grid = np.arange(-4.0, 4.01, 0.25)
    places = np.array(list(product(grid, grid)))
    away = np.linalg.norm(places[:, None] - ends, axis=2)
    profile = ramp_traces(afferent, profile_sites()[0])
    known = DISTANCES_MM[: profile.n_sites]
    values = np.array([np.interp(away, known, row).max(axis=1) for row in profile.values])
    depths = threshold_depths_um(afferent, replace(profile, values=values), PROBING_MM_PER_S)
    return float((depths <= times * depths.min()).sum() * 0.25**2)


def fields() -> None:
    """Write thresholds of indentation and areas of receptive fields, and their figure."""
    depths: dict[str, list[FloatArray]] = {}
    rows = []
    for name, afferent in afferent_types().items():
        profiles = [ramp_traces(afferent, sites) for sites in profile_sites()]
        best = []
        for speed in SPEEDS_MM_PER_S:
            found = [threshold_depths_um(afferent, traces, speed) for traces in profiles]
            best.append(min(each.min() for each in found))
            if speed == PROBING_MM_PER_S:
                depths[name] = found
        observed = published.INDENTATION_THRESHOLDS.value[list(published.TYPES).index(name)]
        rows.append([name, *(_micrometres(each) for each in best), f"{observed:g}"])
    _write_table(
        "indentation", ["type", "4 mm/s [µm]", "20 mm/s [µm]", "100 mm/s [µm]", "median of units [µm]"], rows
    )
    rows = []
    for name, units in (("RA", published.RA_VELOCITIES), ("PC", published.PC_VELOCITIES)):
        slowest = velocity_threshold(afferent_types()[name], SITES.get(name, 0.0))
        rows.append([name, f"{slowest:.1f}", "{:g} to {:g}".format(*units.value)])
    _write_table("velocity", ["type", "model [mm/s]", "units [mm/s]"], rows)
    rows, areas_of = [], {}
    for name, along in depths.items():
        low, high = (np.mean([field_area_mm2(each, times) for each in along]) for times in TIMES_THRESHOLD)
        areas_of[name], branched = [(low, high)], "–"
        if name in BRANCHES:
            areas = [[branched_area_mm2(name, times, seed) for seed in range(8)] for times in TIMES_THRESHOLD]
            areas_of[name].append((np.median(areas[0]), np.median(areas[1])))
            branched = f"{np.median(areas[0]):.0f} to {np.median(areas[1]):.0f}"
        observed = published.FIELD_AREAS.value[list(published.TYPES).index(name)]
        rows.append([name, f"{low:.1f} to {high:.1f}", branched, f"{observed:g}"])
    head = ["type", "model [mm²]", "with scattered end organs [mm²]", "median of units [mm²]"]
    _write_table("fields", head, rows)
    write_png(IMAGES / "afferent_fields.png", draw_fields, depths, areas_of)


def velocity_threshold(afferent: AnyAfferent, site_mm: float) -> float:
    """Smallest speed of an indentation to 1 mm that elicits a spike. [mm/s]"""
    traces = ramp_traces(afferent, [(X_MM, site_mm)])
    fires = (
        afferent.spikes(indented_by(traces, 1000.0, speed)).offsets[-1] > 0 for speed in SPEEDS_OF_THRESHOLDS
    )
    return float(next(speed for speed, spike in zip(SPEEDS_OF_THRESHOLDS, fires, strict=True) if spike))


def draw_fields(depths: dict[str, list[FloatArray]], areas: dict[str, list[tuple[float, float]]]) -> Figure:
    """Draw the threshold over the distance of the probe, and areas of fields beside the published medians."""
    figure = new_figure(9.5, 3.8)
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 1.1))
    middle.sharey(left)
    for row, (name, found) in enumerate(areas.items()):
        colour, marker = STYLES[row]
        for branched, (low, high) in enumerate(found):
            right.plot(
                (low, high), (row + 0.15 * branched,) * 2, color=colour, linestyle="-", marker=marker,
                markersize=5.0, markerfacecolor="white" if branched else colour,
            )  # fmt: skip
        median = published.FIELD_AREAS.value[list(published.TYPES).index(name)]
        right.plot((median / 2.0, 2.0 * median), (row - 0.15,) * 2, color=GREY, linewidth=6.0, alpha=0.35)
        right.plot(median, row - 0.15, "x", color=BLACK, markersize=8.0)
    right.set(
        xlabel="area of the field [mm²]", title="4 and 5 times the threshold", xscale="log",
        xlim=(2.0, 250.0), yticks=range(len(areas)), yticklabels=list(areas), ylim=(len(areas) - 0.5, -0.5),
    )  # fmt: skip
    for axes, which, title in ((left, 0, "across"), (middle, 1, "towards the base")):
        for (name, profiles), (colour, marker) in zip(depths.items(), STYLES, strict=False):
            axes.semilogy(
                DISTANCES_MM[: profiles[which].size], profiles[which], color=colour, marker=marker,
                markevery=5, markersize=4.0, label=name,
            )  # fmt: skip
        axes.set(xlabel="distance of the probe [mm]", title=title, ylim=(8.0, 1e3 * DEEPEST_MM))
        medians = published.INDENTATION_THRESHOLDS.value
        for median, (colour, marker) in zip(medians, STYLES, strict=False):
            axes.plot(-0.4, median, marker, color=colour, markerfacecolor="white", clip_on=False)
    left.set_ylabel("threshold depth [µm]")
    left.legend(loc="center right", bbox_to_anchor=(1.0, 0.4))
    return figure


FIRST_MS, LAST_MS = (50.0, 1050.0), (12000.0, 13000.0)
"""Windows of the decline in 12 s of a hold."""


def adaptation() -> None:
    """Write spikes in the ramp and in parts of a hold of 13 s, and their figure."""
    skin = indented(BALL, fp.RampAndHold(depth_mm=1.0, hold_ms=12950.0))
    sites = [(X_MM + x, z) for x, z in product((-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5), (0.0, 0.5, 1.0, 1.5))]
    found = {}
    for name, afferent in afferent_types().items():
        trains = afferent.spikes(fp.Population(np.array(sites), 1.0, afferent).followed(skin))
        found[name] = max((trains[n] for n in range(len(sites))), key=len)
    parts = ((0.0, 60.0), (60.0, 1000.0), (1000.0, 2500.0), (2500.0, 5000.0), FIRST_MS, LAST_MS)
    rows = [
        [
            name,
            *(
                f"{1e3 * np.count_nonzero((train > low) & (train <= high)) / (high - low):.1f}"
                for low, high in parts
            ),
        ]
        for name, train in found.items()
    ]
    _write_table("adaptation", ["type", *(f"{low:g}-{high:g} ms" for low, high in parts)], rows)


def _micrometres(value: float) -> str:
    return "none" if not np.isfinite(value) else f"{value:.0f}" if value >= 20.0 else f"{value:.1f}"


def _write_table(name: str, head: Sequence[str], rows: Iterable[Sequence[str]], page: Path = PAGE) -> None:
    write_blocks(page, {name: table(head, rows, rule="---:")})


@dataclass(frozen=True)
class Vibrated:
    """One vibration and how it was solved."""

    cycles: Cycles
    skin: SkinResponse
    seconds: float


def vibrated(frequency_hz: float, amplitude_mm: float, cycles: int, all_cycles: bool = False) -> Vibrated:
    """Press a sphere at quick and let it vibrate."""
    motion = fp.sine(0.8, amplitude_mm, frequency_hz, cycles, hold_ms=450.0)
    settings = settings_of("quick")
    if all_cycles:
        settings = replace(settings, cycle_tolerance=None)
    started = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InertiaWarning)
        skin = fp.touch_of(fp.Fingertip(), BALL, motion, settings=settings).solve()
    assert motion.cycles is not None
    return Vibrated(motion.cycles, skin, time.perf_counter() - started)


def spikes_of(done: Vibrated) -> np.ndarray:
    """Spike times of an afferent below the sphere during the vibration. [ms]"""
    afferent = fp.Afferent()
    spikes = afferent.spikes(
        done.skin.sed([(X_MM, 0.0)], afferent.dynamic_quantity, afferent.static_quantity)
    )[0]
    return spikes[spikes > done.cycles.start_ms]


def error_rows() -> Iterable[Sequence[str]]:
    """Twelve cycles with some interpolated against all of them solved."""
    for frequency, amplitude in ((20.0, 0.1), (100.0, 0.1), (100.0, 0.5)):
        some, full = vibrated(frequency, amplitude, 12), vibrated(frequency, amplitude, 12, all_cycles=True)
        errors = [
            np.abs(got - expected).max() / np.abs(expected).max()
            for got, expected in (
                (getattr(some.skin, name), getattr(full.skin, name))
                for name in ("sed_kpa", "force_mn", "contact_area_mm2")
            )
        ]
        different = np.setdiff1d(spikes_of(some).round(1), spikes_of(full).round(1)).size
        yield (
            f"{frequency:g}", f"{1e3 * amplitude:g}", *(f"{error:.1e}" for error in errors),
            f"{different} of {spikes_of(full).size}",
        )  # fmt: skip


def draw_vibrations(runs: Sequence[Vibrated]) -> Figure:
    """Draw the loop of force over depth, energy density over time, spikes, and spikes per cycle."""
    shown = runs[2]
    figure = new_figure(8.0, 5.4)
    (loop, density), (counts, raster) = figure.subplots(2, 2)
    skin, cycles, afferent = shown.skin, shown.cycles, fp.Afferent()
    vibrates = skin.times_ms >= cycles.start_ms
    loop.plot(
        skin.depth_mm[~vibrates], skin.force_mn[~vibrates], color=GREY, linestyle="--", label="ramp and hold"
    )
    loop.plot(skin.depth_mm[vibrates], skin.force_mn[vibrates], color=BLUE, label="vibration")
    loop.set(xlabel="depth [mm]", ylabel="force [mN]")
    loop.legend(loc="upper left")
    traces = skin.sed([(X_MM, 0.0)], afferent.dynamic_quantity, afferent.static_quantity)
    density.plot(skin.times_ms, skin.sed([(X_MM, 0.0)]).values[:, 0], color=BLUE)
    density.set(xlabel="time [ms]", ylabel="stored energy density [kPa]")
    spikes = afferent.spikes(traces)[0]
    for time_ms in spikes:
        density.axvline(time_ms, ymax=0.06, color=BLACK, linewidth=0.6)
    frequencies = [1e3 / run.cycles.period_ms for run in runs]
    names = [f"{frequency:g}" for frequency in frequencies]
    per_cycle = [spikes_of(run).size / run.cycles.count for run in runs]
    counts.loglog(frequencies, per_cycle, color=ORANGE, marker="o")
    counts.set(xlabel="frequency [Hz]", ylabel="spikes per cycle")
    counts.set_xticks(frequencies, names)
    counts.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    counts.yaxis.set_major_formatter("{x:g}")
    counts.minorticks_off()
    for row, run in enumerate(runs):
        period = run.cycles.period_ms
        raster.plot(
            (spikes_of(run) - run.cycles.start_ms) % period / period,
            np.full(spikes_of(run).size, row), color=BLACK, marker="|", linestyle="none", markersize=9.0,
        )  # fmt: skip
    raster.set(xlabel="phase of the cycle", ylabel="frequency [Hz]", xlim=(0.0, 1.0))
    raster.set_yticks(range(len(runs)), names)
    return figure


def vibration() -> None:
    """Write the error of interpolated cycles, and the picture."""
    head = (
        "frequency [Hz]",
        "amplitude [µm]",
        "SED",
        "force",
        "contact area",
        "spikes that differ by 0.1 ms",
    )
    _write_table("errors", head, error_rows(), DOCS / "vibration.md")
    runs = [vibrated(frequency, 0.1, 12) for frequency in (5.0, 10.0, 20.0, 40.0, 100.0, 200.0)]
    write_png(IMAGES / "vibration.png", draw_vibrations, runs)


PARTS = {"mixed": mixed, "tuning": tuning, "fields": fields, "adaptation": adaptation, "vibration": vibration}


def main(names: Sequence[str]) -> None:
    """Make all parts, or the named ones."""
    for name in names or PARTS:
        PARTS[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
