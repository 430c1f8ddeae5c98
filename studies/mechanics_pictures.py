"""Pictures of docs/mechanics.md: a whole result, a silent afferent, a small probe and a press that stops.

`python -m studies.mechanics_pictures` draws them again.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from fingerpad.core.signals import SpikeTrains
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import Cylinder, FlatPunch, Line, Sphere
from fingerpad.geometry.motion import RampAndHold
from fingerpad.geometry.motions import repeated
from fingerpad.geometry.trajectory import Trajectory
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.neuron.afferent import Afferent
from fingerpad.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, new_figure, write_png
from fingerpad.skin.indentation import CONTACT_POINT_MM, indent
from fingerpad.skin.sampling import SkinResponse

IMAGES = Path(__file__).parents[1] / "docs" / "images"
BALL = Sphere(curvature_per_m=287.0)
PRESSED = Trajectory((0.0, 40.0, 300.0, 340.0, 500.0), (0.0, 1.0, 1.0, 0.0, 0.0))
PROBE = FlatPunch(diameter_mm=1.0, fillet_mm=0.1)
PROBED = RampAndHold(depth_mm=1.0, ramp_ms=50.0, hold_ms=20.0)
FINE = PressSettings(ramp_steps=20, hold_steps=6)
CUT = RampAndHold(depth_mm=2.6, ramp_ms=50.0, hold_ms=20.0)  # 3 mm stop at 2.66 mm
DEEP = RampAndHold(depth_mm=3.0, ramp_ms=50.0, hold_ms=20.0)
TOUCHES = repeated(0.8, touches=2, ramp_ms=50.0, hold_ms=400.0, pause_ms=200.0)
SITES_MM = [(CONTACT_POINT_MM[0] + along_mm, 0.0) for along_mm in (0.0, 1.0, 2.0)]


def pressed() -> SkinResponse:
    """Press a sphere and release it."""
    return indent(Fingertip(), BALL, PRESSED, settings=FINE)


def touched_twice() -> tuple[SkinResponse, SpikeTrains]:
    """Touch twice with a pause, and let three afferents respond."""
    skin, afferent = indent(Fingertip(), BALL, TOUCHES), Afferent()
    return skin, afferent.spikes(skin.sed(SITES_MM, afferent.dynamic_quantity, afferent.static_quantity))


def probed() -> SkinResponse:
    """Press a small flat probe."""
    return indent(Fingertip(), PROBE, PROBED, settings=PressSettings(ramp_steps=10, hold_steps=1))


def stopped() -> tuple[SkinResponse, SkinResponse]:
    """Press a wire until shortly before it stops, and what the error advises."""
    steps = PressSettings(ramp_steps=13, hold_steps=1)
    advised = indent(Fingertip(), Cylinder(diameter_mm=0.5), DEEP, friction=0.5, settings=steps)
    return indent(Fingertip(), Line(), CUT, settings=steps), advised


def draw_stopped(presses: tuple[SkinResponse, SkinResponse]) -> Figure:
    """Draw the deformed mesh below the wire with its energy density, and both forces over depth."""
    wire, cylinder = presses
    figure = new_figure(8.0, 3.6)
    section, curve = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    _draw_section(section, wire, least_kpa=0.1, largest_kpa=100.0)
    section.set(xlim=(16.5, 18.3), ylim=(-6.5, -8.9))
    for skin, label, colour, line in ((wire, "Line", BLUE, "-"), (cylinder, "Cylinder 0.5 mm", ORANGE, "--")):
        ramp = skin.times_ms <= CUT.ramp_ms
        curve.plot(
            skin.depth_mm[ramp], skin.force_mn[ramp], color=colour, linestyle=line, marker=".", label=label
        )
    curve.set(xlabel="depth [mm]", ylabel="force [mN]")
    curve.legend()
    return figure


def _draw_section(axes: Axes, skin: SkinResponse, least_kpa: float, largest_kpa: float) -> None:
    """Draw the deformed mesh along the midline at the end, coloured by energy density."""
    mesh = skin.mesh
    nodes = (mesh.nodes_mm + skin.displacement_mm)[mesh.grid[:, 0]]
    sed = skin.sed_kpa[-1].reshape(mesh.shape)[:, 0]
    shown = axes.pcolormesh(
        nodes[..., 0], nodes[..., 1], sed, norm=LogNorm(least_kpa, largest_kpa), cmap="cividis",
        edgecolors="white", linewidth=0.2,
    )  # fmt: skip
    axes.figure.colorbar(shown, ax=axes, label="stored energy density [kPa]")
    axes.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    axes.grid(visible=False)


def draw_small_probe(skin: SkinResponse) -> Figure:
    """Draw the deformed mesh below the probe with its energy density, and force over depth."""
    figure = new_figure(8.0, 3.6)
    section, curve = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    _draw_section(section, skin, least_kpa=0.01, largest_kpa=10.0)
    section.set(xlim=(15.6, 19.2), ylim=(-7.2, -10.0))
    ramp = skin.times_ms <= PROBED.ramp_ms
    curve.plot(skin.depth_mm[ramp], skin.force_mn[ramp], color=BLUE, marker=".")
    curve.set(xlabel="depth [mm]", ylabel="force [mN]")
    return figure


def draw_one_result(skin: SkinResponse) -> Figure:
    """Draw depth, force, area of contact and energies over time."""
    figure = new_figure(8.0, 4.6)
    (depth, force), (area, energy) = figure.subplots(2, 2, sharex=True)
    for axes, values, label in (
        (depth, skin.depth_mm, "depth [mm]"),
        (force, skin.force_mn, "force [mN]"),
        (area, skin.contact_area_mm2, "area of contact [mm²]"),
    ):
        axes.plot(skin.times_ms, values, color=BLUE, marker=".", markersize=4.0)
        axes.set_ylabel(label)
    for name, label, colour, line in (
        ("external_uj", "work done", BLACK, "-"),
        ("stored_uj", "stored", BLUE, "--"),
        ("dissipated_uj", "dissipated", ORANGE, ":"),
    ):
        energy.plot(skin.times_ms, skin.fields[name], color=colour, linestyle=line, label=label)
    energy.set_ylabel("energy [µJ]")
    energy.legend(loc="center left", bbox_to_anchor=(0.1, 0.45))
    for axes in (area, energy):
        axes.set_xlabel("time [ms]")
    return figure


def draw_released(touched: tuple[SkinResponse, SpikeTrains]) -> Figure:
    """Draw depth and force, energy density at the afferents, and their spikes."""
    skin, trains = touched
    figure = new_figure(7.0, 5.2)
    motion, density, spikes = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.2, 1.0))
    motion.plot(skin.times_ms, skin.depth_mm, color=BLUE)
    motion.set_ylabel("depth [mm]", color=BLUE)
    force: Axes = motion.twinx()
    force.plot(skin.times_ms, skin.force_mn, color=ORANGE, linestyle="--")
    force.set_ylabel("force [mN]", color=ORANGE)
    force.grid(visible=False)
    names = ["below the sphere", "1 mm distal", "2 mm distal"]
    sed = skin.sed(SITES_MM).sed_kpa
    for column, name, colour, line in zip(sed.T, names, (BLACK, GREEN, GREY), ("-", "--", ":"), strict=True):
        density.plot(skin.times_ms, column, color=colour, linestyle=line, label=name)
    density.set_ylabel("stored energy\ndensity [kPa]")
    density.set_ylim(top=1.05)
    density.legend(loc="upper center", ncols=3)
    spikes.eventplot(
        [trains[n] for n in (2, 1, 0)], lineoffsets=[1, 2, 3], linelengths=0.7, linewidths=1.0, colors=BLACK
    )
    spikes.set(xlabel="time [ms]", yticks=[1, 2, 3], yticklabels=names[::-1], ylim=(0.4, 3.6))
    for axes in (motion, density, spikes):
        for start, end in _phases():
            axes.axvspan(start, end, color="#f1f1ee", zorder=0)
    return figure


def _phases() -> list[tuple[float, float]]:
    """List the times without indentation. [ms]"""
    times, depth = np.array(TOUCHES.times_ms), np.array(TOUCHES.prescribed)
    return [
        (start, end)
        for start, end, first, last in zip(times, times[1:], depth, depth[1:], strict=False)
        if first == last == 0.0
    ]


if __name__ == "__main__":
    write_png(draw_one_result, pressed(), IMAGES / "one-result.png")
    write_png(draw_released, touched_twice(), IMAGES / "released-afferent.png")
    write_png(draw_small_probe, probed(), IMAGES / "small-probe.png")
    write_png(draw_stopped, stopped(), IMAGES / "stopped-press.png")
