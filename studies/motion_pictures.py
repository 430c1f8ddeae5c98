"""Pictures of docs/motions.md: the ready-made motions, and a recorded motion that is played.

`python -m studies.motion_pictures` draws them again.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.signals import SedTraces, SpikeTrains
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import Sphere
from fingerpad.geometry.motions import chirp, repeated, sine, staircase, stroke
from fingerpad.geometry.trajectory import Trajectory
from fingerpad.geometry.trajectory_files import reduced
from fingerpad.neuron.afferent import Afferent
from fingerpad.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, new_figure, write_png
from fingerpad.skin.indentation import CONTACT_POINT_MM, indent
from fingerpad.skin.sampling import SkinResponse

IMAGES = Path(__file__).parents[1] / "docs" / "images"
READY_MADE = {
    "sine": sine(0.8, 0.1, 20.0, cycles=8, hold_ms=200.0),
    "chirp": chirp(0.8, 0.1, (5.0, 50.0), sweep_ms=500.0, hold_ms=200.0),
    "repeated": repeated(0.8, touches=3, ramp_ms=40.0, hold_ms=120.0, pause_ms=60.0),
    "staircase": staircase(forces_mn=[50.0, 100.0, 20.0], ramp_ms=50.0, hold_ms=150.0),
    "stroke": stroke(0.5, speed_mm_per_s=20.0, x_mm=3.0, strokes=3, hold_ms=150.0),
}
CORNERS_MS = (0.0, 60.0, 300.0, 600.0, 660.0, 900.0)
NOISE_MM = 0.002
WAY_MM = 2.0
SITES_MM = [(CONTACT_POINT_MM[0] + along_mm, 0.0) for along_mm in (0.0, WAY_MM)]
BAND = "#f1f1ee"


@dataclass(frozen=True)
class Played:
    """A recorded motion, what was played of it, and the response.

    Parameters
    ----------
    recorded, motion : Trajectory
        All samples, and those that were kept.
    skin : SkinResponse
        Of the played motion.
    traces : SedTraces
        What drives the two afferents.
    trains : SpikeTrains
        Their spikes.
    """

    recorded: Trajectory
    motion: Trajectory
    skin: SkinResponse
    traces: SedTraces
    trains: SpikeTrains


def recording(seed: int = 1) -> Trajectory:
    """Record a press, a way of 2 mm and a release at 1 kHz, with noise."""
    times_ms = np.arange(CORNERS_MS[-1])
    noise_mm = NOISE_MM * np.random.default_rng(seed).normal(size=(2, times_ms.size))
    noise_mm[:, 0] = 0.0
    depth_mm = np.interp(times_ms, CORNERS_MS, (0.0, 0.8, 0.8, 0.8, -0.2, -0.2)) + noise_mm[0]
    x_mm = np.interp(times_ms, CORNERS_MS, (0.0, 0.0, 0.0, WAY_MM, WAY_MM, WAY_MM)) + noise_mm[1]
    return Trajectory(tuple(times_ms), tuple(depth_mm), x_mm=tuple(x_mm))


def play(recorded: Trajectory) -> Played:
    """Press with the recorded motion and let two afferents respond."""
    motion, afferent = reduced(recorded, tolerance=0.02), Afferent()
    skin = indent(Fingertip(), Sphere(curvature_per_m=287.0), motion)
    traces = skin.sed(SITES_MM, afferent.dynamic_quantity, afferent.static_quantity)
    return Played(recorded, motion, skin, traces, afferent.spikes(traces))


def draw_ready_made(motions: dict[str, Trajectory]) -> Figure:
    """Draw depth or force and the way of each motion, and bands for its phases."""
    figure = new_figure(8.0, 4.6)
    panels = figure.subplots(2, 3).ravel()
    for axes, (name, motion) in zip(panels, motions.items(), strict=False):
        axes.plot(motion.times_ms, motion.prescribed, color=BLUE)
        axes.set(title=name, ylabel="force [mN]" if motion.by_force else "depth [mm]", xlabel="time [ms]")
        if motion.x_mm is not None:
            way: Axes = axes.twinx()
            way.plot(motion.times_ms, motion.x_mm, color=ORANGE, linestyle="--")
            way.set_ylabel("way [mm]", color=ORANGE)
            way.grid(visible=False)
        for phase in motion.phases[1::2]:
            axes.axvspan(*phase.window_ms, color=BAND, zorder=0)
    panels[-1].set_axis_off()
    return figure


def draw_played(played: Played) -> Figure:
    """Draw motion, force, stress and spikes of a recorded motion."""
    recorded, motion, skin = played.recorded, played.motion, played.skin
    figure = new_figure(7.0, 6.0)
    course, force, drive, spikes = figure.subplots(4, 1, sharex=True, height_ratios=(1.4, 1.0, 1.0, 0.7))
    for values, kept, label, colour, line in (
        (recorded.depth_mm, motion.depth_mm, "depth", BLUE, "-"),
        (recorded.x_mm, motion.x_mm, "way to the tip", ORANGE, "--"),
    ):
        assert values is not None
        assert kept is not None
        course.plot(recorded.times_ms, values, color=GREY, linewidth=3.0, alpha=0.4)
        course.plot(
            motion.times_ms, kept, color=colour, linestyle=line, marker="o", markersize=4.0, label=label
        )
    course.set_ylabel("motion [mm]")
    course.legend(loc="upper left")
    force.plot(skin.times_ms, skin.force_mn, color=BLACK, marker=".", markersize=4.0)
    force.set_ylabel("force [mN]")
    names = ("first touch", f"{WAY_MM:g} mm distal")
    for column, name, colour, line in zip(
        played.traces.sed_kpa.T, names, (BLACK, GREEN), ("-", "--"), strict=True
    ):
        drive.plot(skin.times_ms, column, color=colour, linestyle=line, label=name)
    drive.set_ylabel("compressive\nstress [kPa]")
    drive.legend(loc="upper right")
    spikes.eventplot(
        [played.trains[n] for n in (1, 0)], lineoffsets=[1, 2], linelengths=0.7, linewidths=1.0, colors=BLACK
    )
    spikes.set(xlabel="time [ms]", yticks=[1, 2], yticklabels=names[::-1], ylim=(0.4, 2.6))
    for axes in (course, force, drive, spikes):
        for phase in motion.phases[1::2]:
            axes.axvspan(*phase.window_ms, color=BAND, zorder=0)
    return figure


if __name__ == "__main__":
    write_png(draw_ready_made, READY_MADE, IMAGES / "ready-made-motions.png")
    write_png(draw_played, play(recording()), IMAGES / "recorded-motion.png")
