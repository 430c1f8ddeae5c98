"""Picture of sliding in docs/mechanics.md: friction and slip over time, shear at onset, an afferent.

`python -m studies.sliding_picture` draws it again.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.core.signals import SpikeTrains
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.trajectory import Trajectory
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.neuron.afferent import Afferent
from fingerpad.report.style import BLACK, BLUE, GREEN, ORANGE, new_figure, write_png
from fingerpad.skin.indentation import touch_of
from fingerpad.skin.sampling import SkinResponse
from studies.mechanics_pictures import BALL, IMAGES

FRICTION, SPEED_MM_PER_MS = 0.5, 0.01
WAYS_MM = np.array([0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2, 0.4, 0.6, 0.9, 1.2])
START_MS = 150.0
MOTION = Trajectory(
    (0.0, 50.0, START_MS, *(START_MS + WAYS_MM / SPEED_MM_PER_MS).tolist()),
    depth_mm=(0.0, *(0.6 for _ in range(2 + WAYS_MM.size))),
    x_mm=(0.0, 0.0, 0.0, *WAYS_MM.tolist()),
)
FINE = PressSettings(ramp_steps=6, hold_steps=2)
PLACE_MM = (14.0, 0.0)
SITE_MM = (PLACE_MM[0] + 0.6, 0.0)
SLIPPED_MM = 0.01
"""Slip from which skin counts as slipped; skin that sticks yields by a micron or two. [mm]"""


def stroked() -> tuple[SkinResponse, SpikeTrains]:
    """Stroke the pad with a sphere, and let an afferent on its way respond."""
    skin = touch_of(Fingertip(), BALL, MOTION, at_mm=PLACE_MM, friction=FRICTION, settings=FINE).solve()
    afferent = Afferent()
    return skin, afferent.spikes(skin.sed([SITE_MM], afferent.dynamic_quantity, afferent.static_quantity))


def slipped_share(skin: SkinResponse) -> FloatArray:
    """Share of the pressed nodes that have slipped, (n_times,)."""
    pressed = skin.fields["contact_pressure_kpa"] > 0.0
    return ((skin.slip_mm > SLIPPED_MM) & pressed).sum(axis=1) / np.maximum(pressed.sum(axis=1), 1)


def draw(stroked: tuple[SkinResponse, SpikeTrains]) -> Figure:
    """Draw friction and slip over time beside the shear at onset, and SED with spikes below."""
    skin, trains = stroked
    spikes = trains[0]
    figure = new_figure(9.0, 5.6)
    (force, shear), (slip, density) = figure.subplots(2, 2, width_ratios=(1.0, 1.0))
    force.plot(skin.times_ms, skin.contact_force_mn[:, 0], color=BLUE, marker=".", label="along the finger")
    limit = FRICTION * skin.contact_force_mn[:, 1]
    force.plot(skin.times_ms, limit, color=BLACK, linestyle="--", label="0.5 times the normal force")
    force.set(xlabel="time [ms]", ylabel="force on the skin [mN]")
    force.set_ylim(top=17.5)
    force.legend(loc="upper left", fontsize="small")
    force.axvline(START_MS, color=BLACK, linewidth=0.6, linestyle=":")
    slip.plot(skin.times_ms, 100.0 * slipped_share(skin), color=ORANGE, marker=".")
    slip.set(xlabel="time [ms]", ylabel="share of the contact\nthat has slipped [%]")
    _draw_shear(shear, skin)
    sed = skin.sed([SITE_MM]).sed_kpa[:, 0]
    density.plot(skin.times_ms, sed, color=GREEN)
    density.vlines(spikes, 1.08 * sed.max(), 1.2 * sed.max(), color=BLACK, linewidth=0.8)
    density.set(xlabel="time [ms]", ylabel="stored energy\ndensity [kPa]")
    slip.set_xlim(START_MS - 5.0, START_MS + 30.0)
    return figure


def _draw_shear(axes: Axes, skin: SkinResponse) -> None:
    """Draw the shear on the skin when about half of the contact has slipped."""
    share = slipped_share(skin)
    sliding = skin.times_ms > START_MS
    onset = int(np.flatnonzero(sliding)[np.argmin(np.abs(share[sliding] - 0.5))])
    place = skin.mesh.nodes_mm[skin.mesh.skin_nodes]
    pressed = skin.fields["contact_pressure_kpa"][onset] > 0.0
    place, traction = place[pressed], skin.shear_kpa[onset][pressed]
    slips = skin.slip_mm[onset][pressed] > SLIPPED_MM
    size = np.linalg.norm(traction, axis=1)
    image = axes.scatter(place[:, 0], place[:, 2], c=size, cmap="viridis", s=36.0, zorder=2)
    axes.scatter(
        place[slips, 0],
        place[slips, 2],
        s=80.0,
        facecolors="none",
        edgecolors=BLACK,
        linewidths=0.8,
        label="slipped",
    )
    axes.quiver(place[:, 0], place[:, 2], traction[:, 0], traction[:, 2], color=BLACK, width=0.004, zorder=3)
    bar = axes.figure.colorbar(image, ax=axes)
    bar.set_label("shear [kPa]")
    axes.set(
        aspect="equal",
        xlabel="along the finger, x [mm]",
        ylabel="across it, z [mm]",
        title=f"onset, {skin.times_ms[onset]:.0f} ms",
    )
    axes.legend(loc="upper right", fontsize="small")
    axes.margins(0.12)


if __name__ == "__main__":
    write_png(draw, stroked(), IMAGES / "sliding.png")
