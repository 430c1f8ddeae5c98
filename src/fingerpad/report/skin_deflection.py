"""Level 1, Figure 4: deflection of the skin under a line load and a cylinder."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.data import protocol
from fingerpad.experiments.gerling2014.skin_deflection import (
    CylinderDeflection,
    IndenterDeflection,
    SkinDeflectionResult,
)
from fingerpad.report.formatting import fixed
from fingerpad.report.parts import Row, Table
from fingerpad.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, new_figure

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
