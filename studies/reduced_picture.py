"""Picture of docs/reduced.md: a reduced touch beside a full one that it does not know.

`python -m studies.reduced_picture` makes a reduced touch (two minutes) and draws docs/images/reduced.png.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import Sphere
from fingerpad.geometry.trajectory import Trajectory
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.afferent_stream import AfferentStream
from fingerpad.reduction.building import reduce_touch
from fingerpad.reduction.streaming import ReducedTouch
from fingerpad.reduction.training import ReducedRange, ReducedTraining
from fingerpad.report.style import BLACK, BLUE, ORANGE, new_figure, write_png
from fingerpad.skin.indentation import touch_of

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "reduced.png"
SITES = [(17.37, 0.0), (19.37, 0.0)]
MOTION = Trajectory(
    (0.0, 60.0, 250.0, 650.0, 800.0, 850.0, 1000.0),
    depth_mm=(0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0),
    x_mm=(0.0, 0.0, 0.0, 1.7, 1.7, 1.7, 1.7),
)


def draw() -> None:
    """Press, reduce, stream and draw."""
    touch = touch_of(Fingertip(), Sphere(curvature_per_m=287.0))
    training = ReducedTraining(touch, ReducedRange(1.5, x_mm=(-2.0, 2.0)))
    model = reduce_touch(training, calibration=0)
    full = training.touch_with((), MOTION).solve()
    afferent = Afferent()
    quantity = afferent.static_quantity
    stream, responding = ReducedTouch(model, SITES), AfferentStream(afferent, len(SITES))
    times = np.arange(1.0, MOTION.end_ms + 1.0)
    forces, values = np.empty(times.size), np.empty((times.size, len(SITES)))
    spikes: list[list[float]] = [[] for _ in SITES]
    for number, time in enumerate(times.tolist()):
        pose = MOTION.pose_at(time)
        sample = stream.step(time, depth_mm=float(MOTION.prescribed_at(time)), x_mm=pose.x_mm)
        forces[number], values[number] = sample.force_mn, sample.fields[quantity]
        found = responding.step(time, values[number])
        for site, train in enumerate(spikes):
            train.extend(found[site].tolist())

    figure = new_figure(7.0, 6.0)
    motion, force, stress, raster = figure.subplots(
        4, 1, sharex=True, gridspec_kw={"height_ratios": [1, 1.4, 1.4, 0.6]}
    )
    motion.plot(times, MOTION.prescribed_at(times), color=BLACK, label="depth")
    motion.plot(times, [MOTION.pose_at(time).x_mm for time in times], "--", color=BLACK, label="way")
    motion.set_ylabel("depth, way\n[mm]")
    force.plot(full.times_ms, full.force_mn, "o", ms=4, mfc="none", color=BLACK, label="full solution")
    force.plot(times, forces, color=BLUE, label="reduced, every 1 ms")
    force.set_ylabel("force\n[mN]")
    known = full.sample(quantity, SITES)
    for site, (colour, style) in enumerate(((BLUE, "-"), (ORANGE, "--"))):
        stress.plot(full.times_ms, known[:, site], "o", ms=4, mfc="none", color=BLACK)
        label = f"x = {SITES[site][0]:g} mm"
        stress.plot(times, values[:, site], style, color=colour, label=label)
        raster.plot(spikes[site], np.full(len(spikes[site]), site), "|", ms=10, color=colour)
    stress.set_ylabel("compressive\nstress [kPa]")
    raster.set_yticks([0, 1], [f"{x:g} mm" for x, _ in SITES])
    raster.set_ylim(-0.6, 1.6)
    raster.set_ylabel("spikes")
    raster.set_xlabel("time [ms]")
    for axes, place in ((motion, "center right"), (force, "upper right"), (stress, "upper right")):
        axes.legend(loc=place, fontsize="small")
    write_png(lambda _: figure, None, PICTURE)


if __name__ == "__main__":
    draw()
