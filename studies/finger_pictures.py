"""Picture of docs/finger.md: a child's and an adult's finger under one force, from skin to percept.

`python -m studies.finger_pictures` draws it again and prints its numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.core.patterns import hexagonal
from fingerpad.core.regions import Ellipse
from fingerpad.core.signals import ResponseMap
from fingerpad.data import psychophysics
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.indenters import Sphere
from fingerpad.geometry.motion import ForceRampAndHold
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.discrimination import discriminate_gradient_sum
from fingerpad.psychophysics.encoding import neighbour_pairs
from fingerpad.psychophysics.psychometric import fit_psychometric
from fingerpad.report.style import BLUE, ORANGE, new_figure, write_png
from fingerpad.skin.indentation import touch_of
from fingerpad.skin.sampling import SkinResponse

IMAGES = Path(__file__).parents[1] / "docs" / "images"
FORCE_MN = 200.0
FINGERS = ("adult", "child")
COLOURS = {"adult": (BLUE, "-", "o"), "child": (ORANGE, "--", "s")}
CURVATURES_PER_M = (287.0, 305.0, 328.0, 365.0, 410.0)
RADIUS_MM = 4.0
PROFILE_MM = 5.0
SEED, TRIALS = 1, 1000
MEASURES = {"dynamic_rate_hz": ("", "ramp"), "static_rate_hz": ("white", "hold")}
"""Responses that the observer uses: fill of their markers, and phase."""


@dataclass(frozen=True)
class Pressed:
    """One finger under all spheres.

    Parameters
    ----------
    finger : Fingertip
        The finger.
    skins : tuple of SkinResponse
        One per sphere.
    responses : tuple of ResponseMap
        Of the afferents, one per sphere.
    hit_rate : mapping of str to array (n_spheres - 1,)
        Share of trials in which the observer tells each comparison from the standard, by measure.
    threshold_per_m : mapping of str to float
        Curvature at which it is 0.75. [1/m]
    """

    finger: Fingertip
    skins: tuple[SkinResponse, ...]
    responses: tuple[ResponseMap, ...]
    hit_rate: dict[str, FloatArray]
    threshold_per_m: dict[str, float]

    def along_mm(self, reach_mm: float = PROFILE_MM) -> tuple[FloatArray, FloatArray]:
        """Places along the midline from the middle of the pad, and sites there. [mm]"""
        along, (x, z) = np.linspace(-reach_mm, reach_mm, 101), self.finger.contact_mm
        return along, np.stack([x + along, np.full_like(along, z)], axis=1)


def pressed(name: str, resolution: str = "quick") -> Pressed:
    """Press the spheres into one finger by force and let one population respond.

    Parameters
    ----------
    name : str
        A preset of `fingerpad.geometry.fingertip.FINGERS`.
    resolution : str, optional
        Of the presses, all into one mesh.
    """
    finger, motion = Fingertip.of(name), ForceRampAndHold(force_mn=FORCE_MN)
    disc = Ellipse(RADIUS_MM, RADIUS_MM, centre_mm=finger.contact_mm)
    population = Population.of_layout(hexagonal(disc, psychophysics.RECEPTOR_DENSITY.value))
    grading = touch_of(
        finger, Sphere(curvature_per_m=CURVATURES_PER_M[0]), motion, resolution=resolution
    ).grading
    skins = tuple(
        touch_of(finger, Sphere(curvature_per_m=k), motion, resolution=resolution, grading=grading).solve()
        for k in CURVATURES_PER_M
    )
    responses = tuple(population.respond(skin) for skin in skins)
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
    hit_rate, threshold = {}, {}
    for measure in MEASURES:
        values = [getattr(response, measure) for response in responses]
        judged = discriminate_gradient_sum(values, neighbours, psychophysics.NOISE_SIGMA.value, SEED)
        hit_rate[measure] = judged.hit_rate
        n_correct = np.round(TRIALS * judged.hit_rate)
        fitted = fit_psychometric(CURVATURES_PER_M[1:], n_correct, [TRIALS] * len(n_correct), guess=0.0)
        threshold[measure] = float(fitted.threshold(0.75))
    return Pressed(finger, skins, responses, hit_rate, threshold)


def draw(fingers: dict[str, Pressed]) -> Figure:
    """Draw outline, energy, rates and hit rates of the fingers."""
    figure = new_figure(9.0, 6.4)
    (shape, energy), (rates, percept) = figure.subplots(2, 2)
    quantity = Afferent().static_quantity
    for name, found in fingers.items():
        colour, line, marker = COLOURS[name]
        style = {"color": colour, "linestyle": line}
        x = np.linspace(0.0, found.finger.length_mm, 300)
        volar, dorsal, _ = found.finger.section(x)
        shape.plot(x - found.finger.contact_mm[0], -volar, label=name, **style)
        shape.plot(x - found.finger.contact_mm[0], dorsal, **style)
        along, sites = found.along_mm()
        energy.plot(along, found.skins[0].sample(quantity, sites)[-1], label=name, **style)
        response = found.responses[0]
        away = np.hypot(*(response.positions_mm - found.finger.contact_mm).T)
        for measure, filled, what in (
            (response.dynamic_rate_hz, colour, "ramp"),
            (response.static_rate_hz, "white", "hold"),
        ):
            rates.plot(
                away,
                measure,
                marker,
                color=colour,
                markerfacecolor=filled,
                markersize=5.0,
                label=f"{name}, {what}",
            )
        for code, (face, phase) in MEASURES.items():
            label = f"{name}, {phase}: 75 % at {found.threshold_per_m[code]:.0f} /m"
            marks = {"marker": marker, "markerfacecolor": face or colour}
            percept.plot(CURVATURES_PER_M[1:], found.hit_rate[code], label=label, **style, **marks)
    percept.axhline(0.75, color="grey", linewidth=0.8)
    shape.set(
        xlabel="along the finger, from the middle of the pad [mm]", ylabel="height [mm]", aspect="equal"
    )
    energy.set(xlabel="along the midline [mm]", ylabel=f"{quantity.replace('_', ' ')} in the hold [kPa]")
    rates.set(xlabel="distance from the middle of the pad [mm]", ylabel="rate [spikes/s]")
    percept.set(
        xlabel="curvature of the comparison [1/m]",
        ylabel="told from 287 /m [share of trials]",
        ylim=(0.3, 1.02),
    )
    for axes, title in zip((shape, energy, rates, percept), ("(a)", "(b)", "(c)", "(d)"), strict=True):
        axes.set_title(title, loc="left")
        axes.legend(fontsize=8.0)
    return figure


def main() -> None:
    """Press, print and draw."""
    fingers = {name: pressed(name) for name in FINGERS}
    for name, found in fingers.items():
        skin, response, afferent = found.skins[0], found.responses[0], Afferent()
        sites = [found.finger.contact_mm]
        print(
            f"{name}: depth {skin.depth_mm[-1]:.2f} mm, contact {skin.contact_area_mm2[-1]:.1f} mm2, "
            f"SED {skin.sample('stored', sites)[-1, 0]:.3f} kPa, "
            f"{afferent.static_quantity} {skin.sample(afferent.static_quantity, sites)[-1, 0]:.2f} kPa, "
            f"rates {response.dynamic_rate_hz.max():.0f} and {response.static_rate_hz.max():.0f} spikes/s, "
            f"{np.count_nonzero(response.static_rate_hz)} of {len(response.static_rate_hz)} in the hold, "
            f"hit rates {found.hit_rate}, thresholds {found.threshold_per_m} /m"
        )
    write_png(draw, fingers, IMAGES / "child_and_adult.png")


if __name__ == "__main__":
    main()
