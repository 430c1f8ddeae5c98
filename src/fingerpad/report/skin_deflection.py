"""Level 1, Figure 4: how the skin's surface yields under a line and a cylinder."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.data import protocol
from fingerpad.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, new_figure, numbers

UM_PER_MM = 1000.0
TRIALS = {
    "trial1": ("Trial 1", BLUE, (0, (5, 2))),
    "trial2": ("Trial 2", ORANGE, (0, (1, 1.2))),
    "trial3": ("Trial 3", GREEN, "-"),
}
INDENTERS = {
    "line": f"{protocol.LINE_DIAMETER.value * UM_PER_MM:.0f} µm line",
    "cylinder": f"{protocol.CYLINDER_DIAMETER.value} mm cylinder",
}
NEAR_MM = 2.5


def draw(section: dict[str, Any]) -> Figure:
    """Draw Figure 4: both indenters, the whole profile on the left and the middle enlarged on the right.

    Parameters
    ----------
    section : dict
        `results["skin_deflection"]`.

    Returns
    -------
    Figure
    """
    figure = new_figure(10.0, 7.0)
    panels = figure.subplots(2, 2, width_ratios=(1.7, 1.0), sharey="row")
    for row, (indenter, name) in enumerate(INDENTERS.items()):
        whole, near = panels[row]
        for axes in (whole, near):
            _profiles(axes, section, indenter)
            if indenter == "cylinder":
                _observed(axes, section.get("observed"))
        whole.set_title(f"({'ab'[row]}) {name}, {protocol.DEPTH.value} mm deep")
        whole.margins(x=0.01)
        whole.set_ylabel("deflection towards the bone [mm]")
        near.set_title("the middle, enlarged")
        near.set_xlim(-NEAR_MM, NEAR_MM)
        whole.legend(loc="lower left")
        whole.invert_yaxis()  # Skin that yields goes down; the row shares this axis.
    for axes in panels[-1]:
        axes.set_xlabel("distance from the indenter's axis along the finger, proximal positive [mm]")
    panels[-1, 1].set_xlabel("distance [mm]")
    return figure


def _profiles(axes: Axes, section: dict[str, Any], indenter: str) -> None:
    for trial, (name, colour, style) in TRIALS.items():
        if trial not in section or indenter not in section[trial]:
            continue
        profile = section[trial][indenter]
        fit = profile.get("r2")
        axes.plot(
            numbers(profile["distance_mm"]),
            numbers(profile["deflection_mm"]),
            color=colour,
            linestyle=style,
            label=name if fit is None else f"{name}, $R^2$ = {fit:.2f}",
        )


def _observed(axes: Axes, observed: dict[str, Any] | None) -> None:
    if not observed:
        return
    distance, deflection = numbers(observed["distance_mm"]), numbers(observed["deflection_mm"])
    artefact = numbers(observed["is_artefact"]).astype(bool)
    axes.plot(
        distance[~artefact],
        deflection[~artefact],
        "o",
        markersize=4.5,
        color=BLACK,
        markerfacecolor="none",
        label="observed",
    )
    if artefact.any():
        axes.plot(
            distance[artefact],
            deflection[artefact],
            "x",
            markersize=6.0,
            color=GREY,
            label="observed, artefact (left out)",
        )


def caption(_: dict[str, Any]) -> str:
    """Say what Figure 4 shows and what the paper found."""
    return (
        "Deflection of the skin along the midline of the fingertip at the end of the indentation, drawn "
        "downwards as the skin goes. Points: a living human fingertip under the cylinder; the cross is a "
        "step that digitising left at the end of the curve and is left out of R². No observations under the "
        "line are available to us. The paper found that Trial 1 overshoots, Trial 2 undershoots and Trial "
        "3, which combines the two, matches."
    )
