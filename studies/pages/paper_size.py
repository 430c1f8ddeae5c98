"""The paper's size: deflection, energy density and hit rates on three meshes, and their differences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.report.formatting import fixed, joined, number
from fingerpad.report.parts import Part, Table
from fingerpad.report.style import BLACK, BLUE, ORANGE, new_figure
from studies.mesh_errors import MeshErrors
from studies.pages.markdown import PERCENT, markdown_table, parts_of, share, signed, table
from studies.pages.mesh_comparison import ERROR_COLUMNS, RATES, MeshComparison, error_cells
from studies.paper_size import (
    REFERENCE,
    BarErrors,
    DeflectionErrors,
    Deflections,
    Edges,
    PaperSize,
    Preset,
    SphereErrors,
)

LINES: dict[str, dict[str, Any]] = {
    "quick": {"color": ORANGE, "linestyle": "--", "marker": "v", "markerfacecolor": "white"},
    "standard": {"color": BLUE, "linestyle": "-", "marker": "o", "markerfacecolor": "white"},
    "paper": {"color": BLACK, "linestyle": "", "marker": "x"},
}
SHOWN_TRIAL = "trial 3"
"""Tissues of the other levels too."""

MEASURES = ("dynamic", "static", "latency")
UM_PER_MM = 1000.0

DEFLECTION_COLUMNS = (
    "touch", "mesh", "profile: max [µm]", "RMS [µm]", "force, end of ramp", "end of hold",
    "R²", "R² at the paper's size",
)  # fmt: skip
COLUMNS = (*ERROR_COLUMNS, "latency: max [ms]", "RMS", "force: max")


def draw(results: PaperSize) -> Figure:
    """Draw deflection, energy density under the bar, and hit rates, on every mesh.

    Parameters
    ----------
    results : PaperSize

    Returns
    -------
    Figure
    """
    figure = new_figure(9.4, 7.1)
    panels = figure.subplots(2, 2)
    _deflections(panels[0, 0], results.deflection)
    _errors_of_profiles(panels[0, 1], results.deflection)
    _bars(panels[1, 0], results.bars)
    _hit_rates(panels[1, 1], results.spheres)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    known = dict(zip(labels, handles, strict=True))
    figure.legend(known.values(), known.keys(), loc="outside lower center", ncols=len(known))
    return figure


def _deflections(axes: Axes, section: Deflections) -> None:
    for name, profiles in section.deflection_mm.items():
        for indenter in ("line", "cylinder"):
            deflection = profiles[f"{SHOWN_TRIAL}, {indenter}"]
            axes.plot(
                section.distance_mm, deflection, label=name, markersize=4.0, markevery=10, **LINES[name]
            )
    axes.set_title("(a) deflection under line and cylinder, Trial 3 [mm]")
    axes.set_xlabel("distance from the indenter, proximal positive [mm]")
    axes.invert_yaxis()  # skin that yields goes down


def _errors_of_profiles(axes: Axes, section: Deflections) -> None:
    profiles = section.deflection_mm
    for name, of_mesh in profiles.items():
        if name == REFERENCE:
            continue
        for touch, profile in of_mesh.items():
            difference = UM_PER_MM * (profile - profiles[REFERENCE][touch])
            style = LINES[name] | {"marker": "", "linewidth": 1.0}
            axes.plot(section.distance_mm, difference, label=name, **style)
    axes.set_title("(b) all six deflections, less the paper's size [µm]")
    axes.set_xlabel("distance from the indenter, proximal positive [mm]")


def _bars(axes: Axes, section: BarErrors) -> None:
    for name, profile in section.profiles.items():
        style = LINES[name] | {"linestyle": ""}
        axes.plot(profile.shift_mm, profile.sed_ramp_kpa, label=name, **style)
    axes.set_title("(c) energy density under the bar, end of the ramp [kPa]")
    axes.set_xlabel("position of the bar, proximal positive [mm]")
    axes.set_ylim(bottom=0.0)


def _hit_rates(axes: Axes, section: SphereErrors) -> None:
    for name, positions in section.hit_rates.items():
        rates = positions["0"]
        for measure, alpha in (("static", 1.0), ("dynamic", 0.4)):
            axes.plot(
                section.comparisons_per_m,
                PERCENT * rates[measure],
                label=name,
                alpha=alpha,
                **LINES[name],
            )
    axes.set_title("(d) hit rates at 0.0 mm, static; pale: dynamic [%]")
    axes.set_xlabel("curvature of the comparison [1/m]")


def summary(results: PaperSize) -> str:
    """Return one table of how far each mesh is from the paper's size, over all touches.

    Parameters
    ----------
    results : PaperSize

    Returns
    -------
    str
        A table in Markdown, as it stands on the page of the decision.
    """
    columns = {name: _summed(results, name) for name in results.meshes if name != REFERENCE}
    quantities = next(iter(columns.values()))
    fss = results.bars.fss
    return markdown_table(
        ("largest difference from the paper's size", *columns),
        [
            *((quantity, *(column[quantity] for column in columns.values())) for quantity in quantities),
            (
                f"weighted FSS of the bar's shifts; {fixed(fss[REFERENCE], 3)} at the paper's size",
                *(fixed(fss[name], 3) for name in columns),
            ),
        ],
    )


def _summed(results: PaperSize, name: str) -> dict[str, str]:
    """Largest differences of one mesh, by quantity."""
    deflection = results.deflection.errors[name].values()
    bar, spheres = results.bars.errors[name], results.spheres.errors[name].values()
    found = {
        "skin, six deflections [µm]": fixed(UM_PER_MM * max(row.profile_mm.max for row in deflection), 0),
        "their force": share(max(abs(row.force) for row in deflection)),
        "energy density at the receptor, bar": share(bar.sed["ramp"].max),
        "the same at 18 receptors under spheres": share(max(row.sed["ramp"].max for row in spheres)),
    }
    for rate in RATES[::-1]:
        largest = max(row.rate_hz[rate].max for row in (bar, *spheres))
        found[f"{rate} rate, bar and spheres [spikes/s]"] = fixed(largest, 1)
    found["first spike, bar and spheres [ms]"] = fixed(max(row.latency_ms.max for row in (bar, *spheres)), 1)
    for measure in ("static", "dynamic"):
        found[f"hit rate, {measure} [points]"] = fixed(PERCENT * _farthest(results.spheres, name, measure), 1)
    return found


def _farthest(spheres: SphereErrors, name: str, measure: str) -> float:
    """Largest difference of a hit rate from that at the paper's size, over comparisons and positions."""
    ours, theirs = (
        np.array([rates[measure] for rates in spheres.hit_rates[mesh].values()]) for mesh in (name, REFERENCE)
    )
    return float(abs(ours - theirs).max())


def parts(results: PaperSize) -> list[Part]:
    """Return the meshes and their errors: tables and the sentences that introduce them."""
    deflection, bars, spheres = results.deflection, results.bars, results.spheres
    changes, halves = results.twice_as_deep, results.half_against_whole
    against = [name for name in results.meshes if name != REFERENCE]
    return parts_of(
        "The preset, both halves of the finger; edges over an oval of 11 by 9 mm of the pad:",
        _preset(results.preset),
        "Nodes of the meshes used here, half of the finger:",
        table(
            ("mesh", *next(iter(results.meshes.values()))),
            [
                (name, *(number(size.nodes) for size in sizes.values()))
                for name, sizes in results.meshes.items()
            ],
        ),
        "Deflection of the skin within 10 mm of the indenter, 1.0 mm deep; R² against the observed profile:",
        table(
            DEFLECTION_COLUMNS,
            [
                (touch, name, *_deflection(deflection.errors[name][touch]))
                for touch in deflection.errors[against[0]]
                for name in against
            ],
        ),
        "Bar, one receptor; strain energy density (SED) and force as shares of their largest values:",
        table(("mesh", *COLUMNS), [(name, *_errors(bars.errors[name])) for name in against]),
        "The same, shift by shift; rates in spikes/s:",
        table(
            (
                "shift [mm]",
                *(f"{name}: SED, ramp [kPa]" for name in results.meshes),
                *(f"{name}: {rate} rate" for rate in RATES for name in results.meshes),
            ),
            [_shift(bars, row, shift) for row, shift in enumerate(bars.profiles[REFERENCE].shift_mm)],
        ),
        "Weighted FSS of these shifts, parameters unchanged: "
        + joined([f"{name} {fixed(value, 3)}" for name, value in bars.fss.items()])
        + ".",
        "Spheres of "
        + joined([number(curvature) for curvature in dict.fromkeys(spheres.curvature_per_m)])
        + " /m, 18 receptors:",
        table(
            ("mesh", "position [mm]", *COLUMNS),
            [
                (name, position, *_errors(row))
                for name in against
                for position, row in spheres.errors[name].items()
            ],
        ),
        "Hit rates of Gradient Sum at the paper's noise, the same random numbers:",
        table(
            (
                "mesh",
                "position [mm]",
                *(f"{measure}, {number(c)} /m" for measure in MEASURES for c in spheres.comparisons_per_m),
            ),
            [
                (name, position, *(share(rate) for measure in MEASURES for rate in rates[measure]))
                for name, positions in spheres.hit_rates.items()
                for position, rates in positions.items()
            ],
        ),
        "The paper's size against itself with twice the elements through dermis and subcutis, bar at the "
        "highest peak and standard sphere:",
        table(
            ("touch", "largest SED, ramp", "hold", "force"),
            [
                (name, signed(found.sed_ramp), signed(found.sed_hold), signed(found.force))
                for name, found in changes.items()
            ],
        ),
        "Half of the finger against both, standard sphere at 18 receptors: "
        f"SED {number(halves.sed['ramp'].max, 2)} of its largest value, "
        f"force {number(halves.force.max, 2)} of itself.",
    )


def _errors(row: MeshErrors) -> list[str]:
    latency = row.latency_ms
    return [*error_cells(row), fixed(latency.max, 1), fixed(latency.rms, 1), share(row.force.max)]


def _preset(preset: Preset) -> Table:
    def lengths(edges: Edges) -> str:
        smallest, median, largest = (
            fixed(value, 3) for value in (edges.smallest_mm, edges.median_mm, edges.largest_mm)
        )
        return f"{smallest} to {largest}, median {median}"

    return table(
        ("quantity", "the paper", "preset"),
        [
            ("nodes", "about 232 000", number(preset.nodes)),
            ("elements", "about 276 000, bricks and wedges", f"{number(preset.elements)}, bricks"),
            (
                "elements if each brick of the subcutis were two wedges",
                "",
                number(preset.elements_with_subcutis_of_wedges),
            ),
            ("edges on the skin [mm]", "0.1", lengths(preset.skin_edges)),
            ("edges on the epidermal-dermal border [mm]", "0.1", lengths(preset.border_edges)),
        ],
    )


def _deflection(row: DeflectionErrors) -> Sequence[str]:
    profile = [fixed(UM_PER_MM * value, 1) for value in (row.profile_mm.max, row.profile_mm.rms)]
    return *profile, signed(row.peak_force), signed(row.force), fixed(row.r2, 3), fixed(row.r2_reference, 3)


def _shift(bars: BarErrors, row: int, shift: float) -> Sequence[str]:
    profiles = bars.profiles.values()
    sed = [fixed(profile.sed_ramp_kpa[row], 3) for profile in profiles]
    rates = [fixed(getattr(profile, f"{rate}_rate_hz")[row], 1) for rate in RATES for profile in profiles]
    return fixed(shift, 1), *sed, *rates


PAPER_SIZE = MeshComparison(
    name="paper_size",
    result=PaperSize,
    title="Comparison with the paper's mesh size",
    about="""\
The same indentations on the quick mesh, the standard mesh and a mesh of the paper's size: line and
cylinder with the materials of three trials, the bar at its edges, at its centre and beside it, four
spheres at both positions. The meshes differ along the skin only. The standard mesh and the mesh of the
paper's size have the same elements through the depth; a mesh with twice as many elements through dermis
and subcutis shows the remaining error. `python -m studies paper-size` computes these tables;
the ones below come from mechanical code {code_hash}. The preset and the conclusions are on [the mesh of
the paper's size](decisions.md#paper-size).""",
    caption="Deflection, SED under the bar and hit rates on every mesh, and differences of the deflections",
    draw=draw,
    parts=parts,
)
"""The page of `python -m studies paper-size`."""
