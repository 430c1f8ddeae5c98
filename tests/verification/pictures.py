"""Pictures of the page, drawn from the same runs as its rows."""

from __future__ import annotations

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from . import half_space, manufactured
from .page import IMAGES

BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "#777777"
PICTURES = """\
![Errors against element size](images/verification_orders.png)

*A manufactured solution: errors of displacement and stress against element size, with slopes 2 and 1.*

![Pressure and energy density against Hertz](images/verification_contact.png)

*Pressure under a sphere and a cylinder, and strain energy density (SED) below them, against Hertz.*
"""


def draw_all() -> None:
    """Draw every picture."""
    for draw in (orders, contact):
        figure = draw()
        figure.savefig(IMAGES / f"verification_{draw.__name__}.png", dpi=110, metadata={"Software": None})
        plt.close(figure)


def orders() -> plt.Figure:
    """Errors of the manufactured solution."""
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.4), layout="constrained", sharey=True)
    meshes = np.array([4, 8, 12])
    for axis, poisson in zip(axes, (0.3, 0.49), strict=True):
        found = np.array([manufactured.errors(n, poisson) for n in meshes])
        for column, (what, colour, slope) in enumerate((("displacement", BLUE, 2), ("stress", ORANGE, 1))):
            axis.loglog(1 / meshes, found[:, column], "o-", color=colour, label=what)
            line = 0.7 * found[-1, column] * (meshes[-1] / meshes) ** slope
            axis.loglog(1 / meshes, line, "--", color=GREY, lw=1)
            axis.annotate(
                f"slope {slope}", (1 / meshes[0], line[0]), textcoords="offset points", xytext=(-36, -14)
            )
        axis.set(title=f"nu = {poisson}", xlabel="element size [mm]")
    axes[0].set_ylabel("relative error in L2")
    axes[0].legend()
    return figure


def contact() -> plt.Figure:
    """Pressure on the surface and energy density below."""
    figure, axes = plt.subplots(1, 2, figsize=(8.5, 3.4), layout="constrained")
    fine = np.linspace(0.0, 1.0, 200)
    ball, roll = half_space.hertz_sphere(0.3), half_space.hertz_cylinder(0.3)
    half_width = np.sqrt(4 * roll.force_mn * half_space.RADIUS_MM / (np.pi * half_space.reduced_modulus(0.3)))
    for done, name, colour, reach, peak, distance in (
        (
            ball,
            "sphere",
            BLUE,
            1.0,
            3 * ball.force_mn / np.pi,
            np.hypot(ball.skin_mm[:, 0], ball.skin_mm[:, 2]),
        ),
        (
            roll,
            "cylinder",
            ORANGE,
            half_width,
            2 * roll.force_mn / (np.pi * half_width),
            np.abs(roll.skin_mm[:, 0]),
        ),
    ):
        near = distance < 1.6 * reach
        axes[0].plot(distance[near] / reach, done.pressure_kpa[near], ".", color=colour, label=name)
        axes[0].plot(fine, peak * np.sqrt(1 - fine**2), "-", color=colour, lw=1)
        depths = np.linspace(0.1, 3.0, 60) * reach
        axes[1].plot(
            depths / reach, [1e3 * done.sed_below(depth) for depth in depths], ".", ms=3, color=colour
        )
        expected = half_space.below(name, depths / reach, peak, 0.3)
        axes[1].plot(depths / reach, 1e3 * expected, "-", color=colour, lw=1)
    axes[0].set(xlabel="distance from the axis over contact radius", ylabel="pressure [kPa]")
    axes[1].set(xlabel="depth over contact radius", ylabel="SED [Pa]")
    axes[0].legend(title="dots: fingerpad; lines: Hertz")
    return figure
