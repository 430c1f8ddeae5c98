"""Mesh refinement: strain energy density on all meshes, and tables of what their errors lead to."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from typing import Any

from matplotlib.figure import Figure

from fingerpad.data import protocol
from fingerpad.report.formatting import ABSENT, fixed, number
from fingerpad.report.parts import Part
from fingerpad.report.style import BLACK, BLUE, GREEN, ORANGE, new_figure
from studies.mesh_refinement import AgainstFiner, Convergence, LevelMeshes, MeshRefinement
from studies.pages.markdown import PERCENT, parts_of, signed, table
from studies.pages.mesh_comparison import ERROR_COLUMNS, MeshComparison, error_cells

BAR_HALF_WIDTH_MM = protocol.BAR_WIDTH.value / 2.0
LINES: dict[str, dict[str, Any]] = {
    "coarse": {"color": GREEN, "linestyle": "", "marker": "v"},
    "quick": {"color": ORANGE, "linestyle": "--", "marker": ""},
    "standard": {"color": BLUE, "linestyle": "-", "marker": ""},
    "fine": {"color": BLACK, "linestyle": "", "marker": "o", "markerfacecolor": "white"},
}


def draw(results: MeshRefinement) -> Figure:
    """Draw strain energy density and firing rates against the bar's shift, on every mesh.

    Parameters
    ----------
    results : MeshRefinement

    Returns
    -------
    Figure
    """
    figure = new_figure(10.0, 7.5)
    panels = figure.subplots(2, 2)
    profiles = results.bars.profiles
    columns = (
        ("sed_ramp_kpa", "(a) energy density, end of the ramp", "[kPa]"),
        ("sed_hold_kpa", "(b) energy density, end of the hold", "[kPa]"),
        ("dynamic_rate_hz", "(c) dynamic firing rate", "[spikes/s]"),
        ("static_rate_hz", "(d) static firing rate", "[spikes/s]"),
    )
    for axes, (name, title, unit) in zip(panels.ravel(), columns, strict=True):
        axes.axvspan(-BAR_HALF_WIDTH_MM, BAR_HALF_WIDTH_MM, color="#f3f1ea", zorder=0)
        for level, profile in profiles.items():
            axes.plot(
                profile.shift_mm,
                getattr(profile, name),
                label=level,
                markersize=5.0,
                **LINES[level],
            )
        axes.set_title(f"{title} {unit}")
        axes.set_xlabel("position of the bar, proximal positive [mm]")
        axes.set_ylim(bottom=0.0)
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(profiles))
    return figure


def parts(results: MeshRefinement) -> list[Part]:
    """Return the meshes and their errors: tables and the sentences that introduce them."""
    finest, similar = results.levels[-1].name, _similar(results)
    bars, spheres = results.bars, results.spheres
    few, many = results.step_counts
    return parts_of(
        table(
            (
                "mesh",
                "under the bar along × across [mm]",
                "nodes",
                "under spheres [mm]",
                "nodes",
                "elements through corneum, living, dermis, subcutis",
            ),
            [_mesh(level) for level in results.levels],
        ),
        f"Bar, one receptor, against {finest}; strain energy density (SED) as a share of its largest value:",
        _errors(bars.against_finer),
        f"Spheres, 18 receptors, against {finest}:",
        _errors(spheres.against_finer),
        "Largest SED of a touch at the end of the ramp on the similar meshes, order of convergence and limit "
        "(Richardson); no order where the values do not settle:",
        table(
            ("touch", *(f"{name} [kPa]" for name in similar), "order", "limit [kPa]", "standard less limit"),
            [row for touches in (bars, spheres) for row in _orders(touches.convergence, similar)],
        ),
        "Goodness of fit at the common shifts, parameters unchanged:",
        table(
            ("mesh", "against", "touches", "weighted FSS", "on the finer mesh"),
            [
                (
                    row.mesh,
                    row.against,
                    str(row.errors.touches),
                    fixed(row.fss, 3),
                    fixed(row.fss_against, 3),
                )
                for row in bars.against_finer
            ],
        ),
        "Hit rates of Gradient Sum at the paper's noise, sphere at 0.0 mm, the same random numbers:",
        table(
            (
                "mesh",
                *(
                    f"{measure}, {curvature:g} /m"
                    for measure in spheres.hit_rates[finest]
                    for curvature in spheres.comparisons_per_m
                ),
            ),
            [
                (name, *(fixed(PERCENT * rate, 1) + " %" for measure in rates for rate in rates[measure]))
                for name, rates in spheres.hit_rates.items()
            ],
        ),
        "One change of the standard mesh at a time; bar shifted to the highest peak, standard sphere:",
        table(
            ("touch", "change", "largest SED, ramp", "hold", "force"),
            [
                (name, change, signed(found.sed_ramp), signed(found.sed_hold), signed(found.force))
                for name, changes in results.one_at_a_time.items()
                for change, found in changes.items()
            ],
        ),
        "Few steps against many in ramp and in hold, on the quick mesh:",
        table(
            ("touch", "steps", *ERROR_COLUMNS),
            [(name, f"{few} against {many}", *error_cells(row)) for name, row in results.steps.items()],
        ),
    )


def _mesh(level: LevelMeshes) -> Sequence[str]:
    bar, sphere = (
        (f"{number(size.size_x_mm)} × {number(size.size_z_mm)}", number(size.nodes))
        for size in (level.bar, level.sphere)
    )
    return level.name, *bar, *sphere, ", ".join(str(count) for count in level.bar.counts)


def _errors(rows: Sequence[AgainstFiner]) -> Part:
    return table(
        ("mesh", "against", "touches", *ERROR_COLUMNS),
        [(row.mesh, row.against, str(row.errors.touches), *error_cells(row.errors)) for row in rows],
    )


def _similar(results: MeshRefinement) -> list[str]:
    """Names of the meshes that differ by one factor."""
    return [level.name for level in results.levels if level.resolution == "standard"]


def _orders(rows: Sequence[Convergence], names: Sequence[str]) -> list[Sequence[str]]:
    """Rows of the orders; the distance from the limit is a share of the largest SED on the finest mesh."""
    peak = max(row.sed_kpa[-1] for row in rows)
    return [
        (
            row.touch,
            *(fixed(value, 3) for value in row.sed_kpa),
            fixed(row.order, 1),
            fixed(row.limit_kpa, 3),
            ABSENT
            if isnan(row.limit_kpa)
            else signed((row.sed_kpa[names.index("standard")] - row.limit_kpa) / peak),
        )
        for row in rows
    ]


MESH_REFINEMENT = MeshComparison(
    name="mesh_refinement",
    result=MeshRefinement,
    title="Mesh refinement",
    about="""\
There is no closed-form solution for a fingertip. The meshes of every resolution are therefore compared
with a finer one. Compared are the strain energy density (SED) at the receptor under the shifted bar and at
the receptors of the population under spheres, and the firing rates, goodness of fit and hit rates computed
from it. Afferent, noise and random numbers are the same on every mesh. The coarse, standard and fine
meshes differ by one factor in every direction. `python -m studies mesh-refinement` computes these tables;
the ones below come from mechanical code {code_hash}. Conclusions about the choice of a mesh are on [mesh
resolutions](decisions/mesh-resolutions.md).""",
    caption="SED at the receptor and its firing rates against the shift of the bar, on every mesh",
    draw=draw,
    parts=parts,
)
"""The page of `python -m studies mesh-refinement`."""
