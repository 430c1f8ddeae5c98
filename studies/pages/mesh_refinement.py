"""Mesh refinement: strain energy density on all meshes, and tables of what their errors lead to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from matplotlib.figure import Figure

from fingerpad.data import protocol
from fingerpad.report.formatting import ABSENT, fixed, number
from fingerpad.report.parts import Chapter, Drawing, Page, Part
from fingerpad.report.style import BLACK, BLUE, GREEN, ORANGE, new_figure, numbers
from studies.pages.markdown import PERCENT, parts_of, section, share, signed, table

BAR_HALF_WIDTH_MM = protocol.BAR_WIDTH.value / 2.0
LINES: dict[str, dict[str, Any]] = {
    "coarse": {"color": GREEN, "linestyle": "", "marker": "v"},
    "quick": {"color": ORANGE, "linestyle": "--", "marker": ""},
    "standard": {"color": BLUE, "linestyle": "-", "marker": ""},
    "fine": {"color": BLACK, "linestyle": "", "marker": "o", "markerfacecolor": "white"},
}
PHASES = ("ramp", "hold")
RATES = ("dynamic", "static")


NUMBERS, FIGURE = "mesh_refinement.json", "mesh_refinement.png"


def mesh_refinement_page(results: dict[str, Any]) -> Page:
    """Return the page of `python -m studies mesh-refinement`, from `studies.mesh_refinement.run`."""
    drawing = Drawing(
        "mesh_refinement",
        "Strain energy density and firing rates on every mesh",
        partial(draw, results),
        "Strain energy density and firing rates on every mesh.",
    )
    subtitle = f"Bars and spheres on meshes of four sizes. Mechanical code {results['code_hash']}."
    return Page("Mesh errors", subtitle, [], [Chapter("", [drawing, *parts(results)])])


def draw(results: Mapping[str, Any]) -> Figure:
    """Draw strain energy density and firing rates against the bar's shift, on every mesh.

    Parameters
    ----------
    results : dict
        From `studies.mesh_refinement.run`.

    Returns
    -------
    Figure
    """
    figure = new_figure(10.0, 7.5)
    panels = figure.subplots(2, 2)
    profiles = results["bars"]["profiles"]
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
                numbers(profile["shift_mm"]),
                numbers(profile[name]),
                label=level,
                markersize=5.0,
                **LINES[level],
            )
        axes.set_title(f"{title} {unit}")
        axes.set_xlabel("position of the bar, proximal positive [mm]")
        axes.set_ylim(bottom=0.0)
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(profiles))
    return figure


def markdown(results: Mapping[str, Any]) -> str:
    """Return the section of the verification page as Markdown without a title."""
    return section(parts(results))


def parts(results: Mapping[str, Any]) -> list[Part]:
    """Return the meshes and their errors: tables and the sentences that introduce them.

    Parameters
    ----------
    results : dict
        From `studies.mesh_refinement.run`.

    Returns
    -------
    list of Paragraph and Table
    """
    finest = results["levels"][-1]["name"]
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
            [_mesh(level) for level in results["levels"]],
        ),
        f"Bar, one receptor, against {finest}; strain energy density (SED) as a share of its largest value:",
        table(ERROR_COLUMNS, _error_rows(results["bars"], finest)),
        f"Spheres, 18 receptors, against {finest}:",
        table(ERROR_COLUMNS, _error_rows(results["spheres"], finest)),
        "Largest SED of a touch at the end of the ramp on the similar meshes, order of convergence and limit "
        "(Richardson); no order where the values do not settle:",
        table(
            (
                "touch",
                *(f"{name} [kPa]" for name in _similar(results)),
                "order",
                "limit [kPa]",
                "standard less limit",
            ),
            [row for name in ("bars", "spheres") for row in _order_rows(results[name], _similar(results))],
        ),
        "Goodness of fit at the common shifts, parameters unchanged:",
        table(
            ("mesh", "against", "touches", "weighted FSS", "on the finer mesh"),
            [
                (
                    name,
                    row["against"],
                    str(row["touches"]),
                    fixed(row["fss"], 3),
                    fixed(row["fss_finest"], 3),
                )
                for name, row in _against(results["bars"], finest)
            ],
        ),
        "Hit rates of Gradient Sum at the paper's noise, sphere at 0.0 mm, the same random numbers:",
        table(
            (
                "mesh",
                *(f"{measure}, {curvature:g} /m" for measure, curvature in _measures(results["spheres"])),
            ),
            [
                (name, *(fixed(PERCENT * rate, 1) + " %" for measure in rates for rate in rates[measure]))
                for name, rates in results["spheres"]["hit_rates"].items()
            ],
        ),
        "One change of the standard mesh at a time; bar shifted to the highest peak, standard sphere:",
        table(
            ("touch", "change", "largest SED, ramp", "hold", "force"),
            [
                (name, change, *(signed(does[key]) for key in ("sed_ramp", "sed_hold", "force")))
                for name, changes in results["one_at_a_time"].items()
                for change, does in changes.items()
            ],
        ),
        "Few steps against many in ramp and in hold, on the quick mesh:",
        table(
            ("touch", "steps", *ERROR_COLUMNS[3:]),
            [
                (name, f"{row['steps'][0]} against {row['steps'][1]}", *errors(row))
                for name, row in results["steps"].items()
            ],
        ),
    )


ERROR_COLUMNS = (
    "mesh", "against", "touches", "SED, ramp: max", "RMS", "SED, hold: max", "RMS",
    "dynamic rate: max [spikes/s]", "RMS", "static rate: max [spikes/s]", "RMS",
)  # fmt: skip


def _mesh(level: Mapping[str, Any]) -> Sequence[str]:
    sizes = [
        f"{number(level[name]['size_x_mm'])} × {number(level[name]['size_z_mm'])}"
        for name in ("bar", "sphere")
    ]
    nodes = [number(level[name]["nodes"]) for name in ("bar", "sphere")]
    counts = ", ".join(str(count) for count in level["bar"]["counts"])
    return level["name"], sizes[0], nodes[0], sizes[1], nodes[1], counts


def _against(section: Mapping[str, Any], finest: str) -> list[tuple[str, Mapping[str, Any]]]:
    """Pairs of meshes that were compared; the last one is at every touch."""
    rows = [(name, {**row, "against": finest}) for name, row in section["errors"].items()]
    return [*rows, ("quick", {**section["quick_to_standard"], "against": "standard"})]


def _error_rows(section: Mapping[str, Any], finest: str) -> list[Sequence[str]]:
    return [
        (
            name,
            row["against"],
            str(row["touches"]),
            *errors(row),
        )
        for name, row in _against(section, finest)
    ]


def errors(row: Mapping[str, Any]) -> list[str]:
    """Return the cells of `ERROR_COLUMNS` after the third, from what `mesh_errors.compare` found."""
    shares = [share(row["sed"][phase][key]) for phase in PHASES for key in ("max", "rms")]
    return shares + [fixed(row["rate"][phase][key], 1) for phase in RATES for key in ("max", "rms")]


def _similar(results: Mapping[str, Any]) -> list[str]:
    """Names of the meshes that differ by one factor."""
    return [level["name"] for level in results["levels"] if level["resolution"] == "standard"]


def _order_rows(section: Mapping[str, Any], names: Sequence[str]) -> list[Sequence[str]]:
    """Rows of the orders; the distance from the limit is a share of the largest SED on the finest mesh."""
    peak = max(row["sed_kpa"][-1] for row in section["orders"])
    return [
        (
            row["touch"],
            *(fixed(value, 3) for value in row["sed_kpa"]),
            fixed(row["order"], 1),
            fixed(row["limit_kpa"], 3),
            ABSENT
            if row["limit_kpa"] is None
            else signed((row["sed_kpa"][names.index("standard")] - row["limit_kpa"]) / peak),
        )
        for row in section["orders"]
    ]


def _measures(section: Mapping[str, Any]) -> list[tuple[str, float]]:
    rates = next(iter(section["hit_rates"].values()))
    return [(measure, curvature) for measure in rates for curvature in section["comparisons_per_m"]]
