"""Level 1, Figure 4: deflection of the skin under a line load and a cylinder."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from fingerpad.core.values import FloatArray
from fingerpad.data import protocol
from fingerpad.experiments.gerling2014.nail_border import NailBorder, StressProfile
from fingerpad.experiments.gerling2014.skin_deflection import (
    CylinderDeflection,
    IndenterDeflection,
    SkinDeflectionResult,
)
from fingerpad.report.formatting import fixed, number
from fingerpad.report.mesh_picture import corners
from fingerpad.report.parts import Row, Table
from fingerpad.report.style import BLACK, BLUE, COLUMN_IN, GREEN, GREY, ORANGE, PALE, new_figure

DECADES = 4.0
LABEL = "von Mises stress [kPa]"
NEAR_NAIL = "the same near the nail [kPa]"


def draw_nail(section: NailBorder) -> Figure:
    """Draw Figure 9: the pressed finger on a logarithmic scale, the border of the nail on a linear one."""
    figure = new_figure(COLUMN_IN, 7.4)
    grid = figure.add_gridspec(3, 2, height_ratios=(1.0, 1.0, 1.1))
    below, cut, above, beside = (figure.add_subplot(grid[panel // 2, panel % 2]) for panel in range(4))
    profile = figure.add_subplot(grid[2, :])
    middle, across, nail = section.middle, section.across, section.nail_mm
    stress = section.von_mises_kpa.ravel()
    shown = np.concatenate([stress, middle.von_mises_kpa])
    peak = float(shown[np.isfinite(shown)].max(initial=0.0)) or 1.0
    # Values below these decades have the darkest colour.
    wide = LogNorm(vmin=peak / 10.0**DECADES, vmax=peak, clip=True)
    near = Normalize(0.0, section.border_kpa or 1.0)
    x, y, z = (corners(grid) for grid in (section.x_mm, section.y_mm, section.z_mm))
    both = np.concatenate([np.stack([x, sign * z], axis=-1) for sign in (1.0, -1.0)])
    _seen(below, both, -y, stress, wide)
    _paint(cut, np.stack([middle.x_mm, middle.y_mm], axis=-1), middle.von_mises_kpa, wide)
    _seen(above, both, y, stress, near)
    for sign in (1.0, -1.0):
        edges = list(nail[..., [0, 2]] * [1.0, sign])
        above.add_collection(LineCollection(edges, colors="white", linewidths=1.2))
    half = np.stack([across.z_mm, across.y_mm], axis=-1)
    _paint(beside, np.concatenate([half, half * [-1.0, 1.0]]), np.tile(across.von_mises_kpa, 2), near)
    _profiles(profile, section.profile)
    beyond = f"(e) border of the nail: {number(section.ratio)} times the stress of skin 2 to 3 mm away"
    for axes, title, right, up in (
        (below, "(a) from below: the pad", "x, distal [mm]", "z, lateral [mm]"),
        (cut, "(b) middle section, z = 0", "x, distal [mm]", "y, dorsal [mm]"),
        (above, "(c) from above: the nail", "x, distal [mm]", "z, lateral [mm]"),
        (beside, f"(d) across, x = {number(across.x_mm)} mm", "z, lateral [mm]", "y, dorsal [mm]"),
        (profile, beyond, "distance from the nail [mm]", LABEL),
    ):
        axes.set_title(title, fontsize=10.0)
        axes.set(xlabel=right, ylabel=up)
    for row, text, ends in (((below, cut), LABEL, "min"), ((above, beside), NEAR_NAIL, "max")):
        bar = figure.colorbar(row[0].collections[0], ax=row, extend=ends, pad=0.02, aspect=15)
        bar.set_label(text, fontsize=9.0)
    return figure


def _seen(axes: Axes, both: FloatArray, near: FloatArray, stress: FloatArray, scale: Normalize) -> None:
    """Draw the skin as seen from far away: nearer faces are drawn later and hide the others."""
    order = np.argsort(np.tile(near.mean(axis=1), 2), kind="stable")
    _paint(axes, both[order], np.tile(stress, 2)[order], scale)


def _paint(axes: Axes, outlines: FloatArray, stress: FloatArray, scale: Normalize) -> None:
    # A lighter ground than the darkest colour keeps the outline of the finger visible.
    axes.set_facecolor(PALE)
    polygons = PolyCollection(
        list(outlines),
        array=np.ma.masked_invalid(stress),
        cmap=colormaps["inferno"].with_extremes(bad=GREY),
        norm=scale,
        edgecolors="face",
        linewidths=0.3,
    )
    axes.add_collection(polygons)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.grid(visible=False)


def _profiles(axes: Axes, profile: StressProfile) -> None:
    """Stress over distance from the nail: median and middle 80 % of the sections that cross its border."""
    for stress_kpa, name, colour, style in (
        (profile.surface_kpa, "surface of the skin", ORANGE, "-"),
        (profile.living_epidermis_kpa, "living epidermis", BLUE, "--"),
    ):
        low, median, high = stress_kpa.T
        axes.fill_between(profile.distance_mm, low, high, color=colour, alpha=0.2, linewidth=0.0)
        axes.plot(profile.distance_mm, median, style, color=colour, label=name)
    axes.axvline(0.0, color=BLACK, linewidth=0.8)
    axes.set_ylim(bottom=0.0)
    place: Any = {"transform": axes.get_xaxis_transform(), "ha": "right", "va": "top"}
    axes.text(-0.1, 0.95, "under\nthe nail", color=BLACK, size=9, **place)
    axes.legend(loc="upper right")


def caption_nail(section: NailBorder) -> str:
    return (
        "Predicted von Mises stress at the end of the hold, on the finger that the standard sphere deforms; "
        "nothing here was observed: (a) in the outermost elements of the skin and (b) in the middle section, "
        f"on a logarithmic scale of {number(DECADES)} decades; (c) the back of the finger and (d) the "
        "section with the highest ratio, on a linear scale up to the highest stress at the border of the "
        "nail (its outline in white); (e) median and middle 80 % of all sections that cross that border. "
        "The paper shows high stresses at the border of the nail."
    )


UM_PER_MM = 1000.0
TRIAL_STYLES = {"Trial 1": (BLUE, (0, (5, 2))), "Trial 2": (ORANGE, (0, (1, 1.2))), "Trial 3": (GREEN, "-")}
LINE = f"{protocol.LINE_DIAMETER.value * UM_PER_MM:.0f} µm line"
CYLINDER = f"{protocol.CYLINDER_DIAMETER.value} mm cylinder"
ALONG = "distance from the indenter's axis, distal [mm]"
"""Results count distances proximal positive; all figures have the distal side on the right."""


def _trials(section: SkinDeflectionResult) -> dict[str, dict[str, IndenterDeflection]]:
    """Deflections by trial and indenter, as they are named on the page."""
    trials = (section.trial1, section.trial2, section.trial3)
    return {
        name: {LINE: trial.line, CYLINDER: trial.cylinder}
        for name, trial in zip(TRIAL_STYLES, trials, strict=True)
    }


def draw_skin_deflection(section: SkinDeflectionResult) -> Figure:
    figure = new_figure(11.0, 4.2)
    panels = figure.subplots(1, 2, sharey=True)
    for letter, axes, indenter in zip("ab", panels, (LINE, CYLINDER), strict=True):
        draw_profiles(axes, section, indenter)
        axes.set_title(f"({letter}) {indenter}, {protocol.DEPTH.value} mm deep")
        axes.set_xlabel(ALONG)
        axes.legend(loc="lower left")
    panels[0].set_ylabel("deflection towards the bone [mm]")
    panels[0].invert_yaxis()  # Deflection is drawn downwards; the panels share this axis.
    return figure


def draw_profiles(axes: Axes, section: SkinDeflectionResult, indenter: str) -> None:
    """Draw the deflection of each trial under an indenter, and what was observed under it."""
    for name, trial in _trials(section).items():
        profile, (colour, style) = trial[indenter], TRIAL_STYLES[name]
        fit = f", R² = {fixed(profile.r2, 2)}" if isinstance(profile, CylinderDeflection) else ""
        axes.plot(
            -profile.distance_mm, profile.deflection_mm, color=colour, linestyle=style, label=name + fit
        )
    if indenter == CYLINDER:
        observed, artefact = section.observed, section.observed.is_artefact
        x, y, kept = -observed.distance_mm, observed.deflection_mm, ~artefact
        open_circle: Any = {"color": BLACK, "markerfacecolor": "none", "markersize": 4.5}
        axes.plot(x[kept], y[kept], "o", label="observed", **open_circle)
        if artefact.any():
            label = "observed, artefact (left out)"
            axes.plot(x[artefact], y[artefact], "x", color=GREY, markersize=6.0, label=label)
    axes.margins(x=0.01)


def caption_skin_deflection(_: SkinDeflectionResult) -> str:
    return (
        "Deflection of the skin along the midline of the fingertip at the end of the indentation, drawn "
        "downwards, under (a) a line load and (b) a cylinder. Lines: the model with the paper's three "
        "trials, which are the sets of tissues trial1, trial2 and trial3 whatever the tissues of the run "
        "are. Circles: observed under the cylinder on a living human fingertip (Dandekar 1995); the cross "
        "is an artefact of digitising at the end of the curve and is left out of R². No observations under "
        "the line are available. The inner moduli of Trials 2 and 3 were identified from these circles. In "
        "the paper Trial 1 overshoots, Trial 2 undershoots and Trial 3, which combines the two, matches."
    )


def skin_deflection_tables(section: SkinDeflectionResult) -> list[Table]:
    rows = []
    for name, trial in _trials(section).items():
        for indenter, profile in trial.items():
            compared = profile if isinstance(profile, CylinderDeflection) else None
            fits = (compared.r2, compared.r2_mirrored) if compared else (None, None)
            cells = (f"{name}, {indenter}", *(fixed(fit, 3) for fit in fits), fixed(profile.force_mn, 1))
            rows.append(Row(cells))
    note = "R², mirrored: with the proximal and the distal side of the observations exchanged."
    return [Table("Fit and force", ("trial", "R²", "R², mirrored", "force [mN]"), rows, note)]
