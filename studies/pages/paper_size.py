"""The paper's size: deflection, energy density and hit rates on three meshes, and their differences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.report.formatting import fixed, joined, number
from fingerpad.report.page import markdown_table
from fingerpad.report.parts import Chapter, Drawing, Page, Part, Table
from fingerpad.report.style import BLACK, BLUE, ORANGE, new_figure, numbers
from studies.pages.markdown import PERCENT, parts_of, section, share, signed, table
from studies.pages.mesh_refinement import ERROR_COLUMNS, RATES, errors

NUMBERS, FIGURE = "paper_size.json", "paper_size.png"
REFERENCE = "paper"
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
COLUMNS = (*ERROR_COLUMNS[3:], "latency: max [ms]", "RMS", "force: max")


def paper_size_page(results: dict[str, Any]) -> Page:
    """Return the page of `python -m studies paper-size`, from `studies.paper_size.run`."""
    drawing = Drawing(
        "paper_size",
        "Deflection, strain energy density and hit rates on three meshes",
        partial(draw, results),
        "Deflection, strain energy density and hit rates on three meshes.",
    )
    subtitle = f"Quick and standard against the paper's size. Mechanical code {results['code_hash']}."
    return Page("The paper's size of mesh", subtitle, [], [Chapter("", [drawing, *parts(results)])])


def draw(results: Mapping[str, Any]) -> Figure:
    """Draw deflection, energy density under the bar, and hit rates, on every mesh.

    Parameters
    ----------
    results : dict
        From `studies.paper_size.run`.

    Returns
    -------
    Figure
    """
    figure = new_figure(9.4, 7.1)
    panels = figure.subplots(2, 2)
    _deflections(panels[0, 0], results["deflection"])
    _errors_of_profiles(panels[0, 1], results["deflection"])
    _bars(panels[1, 0], results["bars"])
    _hit_rates(panels[1, 1], results["spheres"])
    handles, labels = panels[0, 0].get_legend_handles_labels()
    known = dict(zip(labels, handles, strict=True))
    figure.legend(known.values(), known.keys(), loc="outside lower center", ncols=len(known))
    return figure


def _deflections(axes: Axes, section: Mapping[str, Any]) -> None:
    distance = numbers(section["distance_mm"])
    for name, profiles in section["deflection_mm"].items():
        for indenter in ("line", "cylinder"):
            deflection = numbers(profiles[f"{SHOWN_TRIAL}, {indenter}"])
            axes.plot(distance, deflection, label=name, markersize=4.0, markevery=10, **LINES[name])
    axes.set_title("(a) deflection under line and cylinder, Trial 3 [mm]")
    axes.set_xlabel("distance from the indenter, proximal positive [mm]")
    axes.invert_yaxis()  # skin that yields goes down


def _errors_of_profiles(axes: Axes, section: Mapping[str, Any]) -> None:
    distance, profiles = numbers(section["distance_mm"]), section["deflection_mm"]
    for name, of_mesh in profiles.items():
        if name == REFERENCE:
            continue
        for touch, profile in of_mesh.items():
            difference = UM_PER_MM * (numbers(profile) - numbers(profiles[REFERENCE][touch]))
            style = LINES[name] | {"marker": "", "linewidth": 1.0}
            axes.plot(distance, difference, label=name, **style)
    axes.set_title("(b) all six deflections, less the paper's size [µm]")
    axes.set_xlabel("distance from the indenter, proximal positive [mm]")


def _bars(axes: Axes, section: Mapping[str, Any]) -> None:
    for name, profile in section["profiles"].items():
        values = numbers(profile["sed_ramp_kpa"])
        axes.plot(numbers(section["shift_mm"]), values, label=name, **LINES[name] | {"linestyle": ""})
    axes.set_title("(c) energy density under the bar, end of the ramp [kPa]")
    axes.set_xlabel("position of the bar, proximal positive [mm]")
    axes.set_ylim(bottom=0.0)


def _hit_rates(axes: Axes, section: Mapping[str, Any]) -> None:
    for name, positions in section["hit_rates"].items():
        rates = positions["0"]
        for measure, alpha in (("static", 1.0), ("dynamic", 0.4)):
            axes.plot(
                numbers(section["comparisons_per_m"]),
                PERCENT * numbers(rates[measure]),
                label=name,
                alpha=alpha,
                **LINES[name],
            )
    axes.set_title("(d) hit rates at 0.0 mm, static; pale: dynamic [%]")
    axes.set_xlabel("curvature of the comparison [1/m]")


def summary(results: Mapping[str, Any]) -> str:
    """Return one table of how far each mesh is from the paper's size, over all touches.

    Parameters
    ----------
    results : dict
        From `studies.paper_size.run`.

    Returns
    -------
    str
        A table in Markdown, as it stands on the page of the decision.
    """
    columns = {name: _summed(results, name) for name in results["meshes"] if name != REFERENCE}
    quantities = next(iter(columns.values()))
    fss = results["bars"]["fss"]
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


def _summed(results: Mapping[str, Any], name: str) -> dict[str, str]:
    """Largest differences of one mesh, by quantity."""
    deflection = results["deflection"]["errors"][name].values()
    bar, spheres = results["bars"]["errors"][name], results["spheres"]["errors"][name].values()
    found = {
        "skin, six deflections [µm]": fixed(UM_PER_MM * max(row["profile"]["max"] for row in deflection), 0),
        "their force": share(max(abs(row["force"]) for row in deflection)),
        "energy density at the receptor, bar": share(bar["sed"]["ramp"]["max"]),
        "the same at 18 receptors under spheres": share(max(row["sed"]["ramp"]["max"] for row in spheres)),
    }
    for rate in RATES[::-1]:
        largest = max(row["rate"][rate]["max"] for row in (bar, *spheres))
        found[f"{rate} rate, bar and spheres [spikes/s]"] = fixed(largest, 1)
    found["first spike, bar and spheres [ms]"] = fixed(
        max(row["latency"]["max"] for row in (bar, *spheres)), 1
    )
    for measure in ("static", "dynamic"):
        found[f"hit rate, {measure} [points]"] = fixed(
            PERCENT * _farthest(results["spheres"], name, measure), 1
        )
    return found


def _farthest(spheres: Mapping[str, Any], name: str, measure: str) -> float:
    """Largest difference of a hit rate from that at the paper's size, over comparisons and positions."""
    ours, theirs = (
        numbers([rates[measure] for rates in spheres["hit_rates"][mesh].values()])
        for mesh in (name, REFERENCE)
    )
    return float(abs(ours - theirs).max())


def markdown(results: Mapping[str, Any]) -> str:
    """Return the section of the verification page as Markdown without a title."""
    return section(parts(results))


def parts(results: Mapping[str, Any]) -> list[Part]:
    """Return the meshes and their errors: tables and the sentences that introduce them.

    Parameters
    ----------
    results : dict
        From `studies.paper_size.run`.

    Returns
    -------
    list of Paragraph and Table
    """
    deflection, bars, spheres = (results[name] for name in ("deflection", "bars", "spheres"))
    against = [name for name in results["meshes"] if name != REFERENCE]
    return parts_of(
        "The preset, both halves of the finger; edges over an oval of 11 by 9 mm of the pad:",
        _preset(results["preset"]),
        "Nodes of the meshes used here, half of the finger:",
        table(
            ("mesh", *next(iter(results["meshes"].values()))),
            [
                (name, *(number(size["nodes"]) for size in sizes.values()))
                for name, sizes in results["meshes"].items()
            ],
        ),
        "Deflection of the skin within 10 mm of the indenter, 1.0 mm deep; R² against the observed profile:",
        table(
            DEFLECTION_COLUMNS,
            [
                (touch, name, *_deflection(deflection["errors"][name][touch]))
                for touch in deflection["errors"][against[0]]
                for name in against
            ],
        ),
        "Bar, one receptor; strain energy density (SED) and force as shares of their largest values:",
        table(("mesh", *COLUMNS), [(name, *_errors(bars["errors"][name])) for name in against]),
        "The same, shift by shift; rates in spikes/s:",
        table(
            (
                "shift [mm]",
                *(f"{name}: SED, ramp [kPa]" for name in results["meshes"]),
                *(f"{name}: {rate} rate" for rate in RATES for name in results["meshes"]),
            ),
            [_shift(bars, row, shift) for row, shift in enumerate(bars["shift_mm"])],
        ),
        "Weighted FSS of these shifts, parameters unchanged: "
        + joined([f"{name} {fixed(value, 3)}" for name, value in bars["fss"].items()])
        + ".",
        "Spheres of "
        + joined([number(curvature) for curvature in dict.fromkeys(spheres["curvature_per_m"])])
        + " /m, 18 receptors:",
        table(
            ("mesh", "position [mm]", *COLUMNS),
            [
                (name, position, *_errors(row))
                for name in against
                for position, row in spheres["errors"][name].items()
            ],
        ),
        "Hit rates of Gradient Sum at the paper's noise, the same random numbers:",
        table(
            (
                "mesh",
                "position [mm]",
                *(f"{measure}, {number(c)} /m" for measure in MEASURES for c in spheres["comparisons_per_m"]),
            ),
            [
                (name, position, *(share(rate) for measure in MEASURES for rate in rates[measure]))
                for name, positions in spheres["hit_rates"].items()
                for position, rates in positions.items()
            ],
        ),
        "The paper's size against itself with twice the elements through dermis and subcutis, bar at the "
        "highest peak and standard sphere:",
        table(
            ("touch", "largest SED, ramp", "hold", "force"),
            [
                (name, *(signed(does[key]) for key in ("sed_ramp", "sed_hold", "force")))
                for name, does in results["twice_as_deep"].items()
            ],
        ),
        f"Half of the finger against both, standard sphere at 18 receptors: {_halves(results)}.",
    )


def _errors(row: Mapping[str, Any]) -> list[str]:
    waits = [fixed(row["latency"][key], 1) for key in ("max", "rms")]
    return [*errors(row), *waits, share(row["force"]["max"])]


def _preset(preset: Mapping[str, Any]) -> Table:
    def lengths(edges: Mapping[str, float]) -> str:
        smallest, median, largest = (fixed(edges[key], 3) for key in ("smallest", "median", "largest"))
        return f"{smallest} to {largest}, median {median}"

    return table(
        ("quantity", "the paper", "preset"),
        [
            ("nodes", "about 232 000", number(preset["nodes"])),
            ("elements", "about 276 000, bricks and wedges", f"{number(preset['elements'])}, bricks"),
            (
                "elements if each brick of the subcutis were two wedges",
                "",
                number(preset["elements_with_subcutis_of_wedges"]),
            ),
            ("edges on the skin [mm]", "0.1", lengths(preset["skin_edges"])),
            ("edges on the epidermal-dermal border [mm]", "0.1", lengths(preset["border_edges"])),
        ],
    )


def _deflection(row: Mapping[str, Any]) -> Sequence[str]:
    profile = [fixed(UM_PER_MM * row["profile"][key], 1) for key in ("max", "rms")]
    r2 = [fixed(row[key], 3) for key in ("r2", "r2_reference")]
    return *profile, signed(row["peak_force"]), signed(row["force"]), *r2


def _shift(bars: Mapping[str, Any], row: int, shift: float) -> Sequence[str]:
    profiles = bars["profiles"].values()
    sed = [fixed(profile["sed_ramp_kpa"][row], 3) for profile in profiles]
    rates = [fixed(profile[f"{rate}_rate_hz"][row], 1) for rate in RATES for profile in profiles]
    return fixed(shift, 1), *sed, *rates


def _halves(results: Mapping[str, Any]) -> str:
    found = results["half_against_whole"]
    return (
        f"SED {number(found['sed']['ramp']['max'], 2)} of its largest value, "
        f"force {number(found['force']['max'], 2)} of itself"
    )
