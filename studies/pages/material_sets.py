"""The page of `python -m studies materials`: a figure and tables of the sets on three levels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from math import isnan

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.data import paper, psychophysics
from fingerpad.report.formatting import fixed
from fingerpad.report.manifest import edition
from fingerpad.report.parts import Chapter, Drawing, Page, Part
from fingerpad.report.style import BLACK, BLUE, GREY, ORANGE, PALE, new_figure
from studies.material_sets import EvaluatedSet, UnsolvedSet
from studies.material_study import LevelsMet, MaterialStudy, Targets
from studies.pages.markdown import parts_of, table
from studies.trial_order import TrialDifference, TrialOrder

_SIGMA = psychophysics.NOISE_SIGMA.value
_FSS = paper.FSS_OUT_OF_SAMPLE.value
ONE_BAR = (
    "The bar was indented once and sampled at shifted sites. With an indentation at each of the 36 shifts "
    "(`--shifted-bars`) the FSS of two sets changed by -0.01 and +0.05. A set whose FSS is closer to the "
    "criterion than that may lie on the other side of it."
)
_LETTERS = {"deflection": "d", "firing": "f", "discrimination": "p"}
_REGIONS = ("within 0.5 mm", "0.5 to 5 mm")


def draw(section: MaterialStudy) -> Figure:
    """Draw FSS and noise against R²; each set has its number in the table.

    Parameters
    ----------
    section : MaterialStudy

    Returns
    -------
    Figure
    """
    figure = new_figure(10.0, 4.6)
    left, middle, right = figure.subplots(1, 3)
    rows, front = _numbered(section), set(section.pareto)

    def r2(row: EvaluatedSet) -> float:
        return row.deflection.r2

    def fss(row: EvaluatedSet) -> float:
        return row.firing.fss

    def sigma(row: EvaluatedSet) -> float:
        return row.firing.noise_sigma

    _cloud(left, rows, front, r2, fss)
    _cloud(middle, rows, front, r2, sigma)
    _cloud(right, rows, front, fss, sigma)
    for axes in (left, middle):
        axes.axvspan(section.targets.r2, 1.0, color=PALE, zorder=0)
        axes.set_xlim(right=1.0)
        axes.set_xlabel("deflection: $R^2$ under the cylinder")
    left.axhline(_FSS, color=GREY, linewidth=1.0)
    left.set_ylabel("firing: FSS in sample")
    right.axvline(_FSS, color=GREY, linewidth=1.0)
    right.set_xlabel("firing: FSS in sample")
    for axes in (middle, right):
        axes.axhline(_SIGMA, color=GREY, linewidth=1.0)
        axes.set_ylabel(r"discrimination: fitted noise $\sigma_1$")
    for axes, title in ((left, "(a) deflection, firing"), (middle, "(b) deflection, discrimination")):
        axes.set_title(title)
    right.set_title("(c) firing, discrimination")
    return figure


def materials_page(results: MaterialStudy) -> Page:
    """Return the page of `python -m studies materials`: sets, levels, and order of the trials."""
    manifest, targets = results.manifest, results.targets
    bars = (
        "36 indentations of the bar"
        if results.shifted_bars
        else "one indentation of the bar, sampled at 36 shifted sites"
    )
    drawing = Drawing(
        "material_sets",
        "R², FSS and noise of every set",
        partial(draw, results),
        "Orange: Pareto front; no other set is at least as good on all three levels and better on one. "
        f"Shaded: R² of {targets.r2:g} or more. Lines: the paper's {_FSS:g} and {_SIGMA:g}. Labels: "
        "numbers of the sets in the table.",
    )
    return Page(
        "Material sets on three levels",
        f"Written by `python -m studies materials` on {manifest.started[:10]}: {edition(manifest)}, {bars}, "
        f"mechanical code {manifest.code_hash}. Conclusions are on "
        "[substitutes for the lost hyperelastic coefficients](decisions/lost-hyperelastic-coefficients.md), "
        "[order of the three trials in deflection](decisions/order-of-the-trials.md) and "
        "[one material set for three levels](decisions/one-set-for-three-levels.md).",
        [_met(results), *([] if results.shifted_bars else [ONE_BAR])],
        [
            Chapter("", [drawing]),
            Chapter(
                "Material sets",
                parts_of(
                    table(
                        ("", "set", "epidermis", "dermis", "subcutis", "basis and status"),
                        [_moduli(number, row) for number, row in enumerate(results.sets, start=1)],
                    ),
                    "Initial shear moduli in kPa. All layers relax by the same Prony series (recalled).",
                ),
            ),
            Chapter(
                "Results on three levels",
                parts_of(
                    table(
                        (
                            "",
                            "R²",
                            "deflection at 1, 2, 3, 4, 5 mm [mm]",
                            "force [mN]",
                            "FSS (dynamic, static)",
                            "fitted noise",
                            "hit rates at 0.055",
                            "joint FSS",
                            "joint hit rates",
                            "meets",
                        ),
                        [_levels(number, row, results.meets[row.name]) for number, row in _numbered(results)],
                    ),
                    _legend(targets),
                    *_unsolved(results),
                ),
            ),
            Chapter(
                "Deflection of further sets",
                parts_of(
                    table(
                        ("set", "epidermis", "dermis", "subcutis", "R²", "force [mN]"),
                        [
                            (
                                row.name,
                                *(f"{value:.4g}" for value in row.shear_kpa.values()),
                                fixed(row.deflection.r2, 3),
                                fixed(row.deflection.force_mn, 0),
                            )
                            for row in results.deflection_only
                        ],
                    ),
                    "Cylinder only. Initial shear moduli in kPa, all assumed except Wu's (recalled).",
                ),
            ),
            Chapter(
                "Order of the trials",
                parts_of(
                    *_order(results.order),
                ),
            ),
            Chapter(
                "Wu's tissues as polynomials",
                parts_of(
                    table(
                        (
                            "layer",
                            "nu",
                            "fitted up to",
                            "C10, C01, C20, C11, C02 [kPa]",
                            "rms error / largest stress",
                        ),
                        [
                            (
                                row.layer,
                                f"{row.poisson:.2f}",
                                f"{row.compression:.0%}",
                                ", ".join(f"{value:.4f}" for value in row.coefficients_kpa),
                                f"{row.misfit:.2%}",
                            )
                            for row in results.polynomials
                        ],
                    ),
                ),
            ),
        ],
    )


def _legend(targets: Targets) -> str:
    return (
        "R² and deflection (mean of both sides) are under the 3.17 mm cylinder at a depth of 1 mm; the force "
        "is that at the end of the hold. FSS is in sample, over all 36 shifts, of the best free fit of four "
        'parameters. "Fitted noise" is the sigma_1 for which the hit rates of that afferent are closest to '
        f"Goodwin's 0.58 and 0.95; hit rates are at the paper's {_SIGMA:g}. "
        '"Joint" is an afferent fitted to FSS minus the root mean square error of the hit rates at '
        f"{_SIGMA:g}. "
        f"Criteria of the levels: R² of {targets.r2:g} or more (d), a joint FSS of {_FSS:g} or more (f), "
        f"both joint hit rates within {targets.hit_rate_error:g} of Goodwin's (p)."
    )


def _numbered(results: MaterialStudy) -> list[tuple[int, EvaluatedSet]]:
    rows = enumerate(results.sets, start=1)
    return [(number, row) for number, row in rows if isinstance(row, EvaluatedSet)]


def _cloud(
    axes: Axes,
    rows: Sequence[tuple[int, EvaluatedSet]],
    front: set[str],
    across: Callable[[EvaluatedSet], float],
    up: Callable[[EvaluatedSet], float],
) -> None:
    for number, row in rows:
        x, y = across(row), up(row)
        if isnan(y):
            continue
        colour = ORANGE if row.name in front else BLUE
        axes.plot(x, y, "o", markersize=5.0, color=colour)
        axes.annotate(
            str(number), (x, y), xytext=(4, 3), textcoords="offset points", fontsize=8.0, color=BLACK
        )


def _met(results: MaterialStudy) -> str:
    all_three = [name for name, levels in results.meets.items() if levels.all]
    if not all_three:
        return "**No set meets all three levels.**"
    return f"**Sets that meet all three levels: {', '.join(all_three)}.**"


def _moduli(number: int, row: EvaluatedSet | UnsolvedSet) -> tuple[str, ...]:
    shear_kpa = row.shear_kpa if isinstance(row, EvaluatedSet) else {}
    values = [f"{value:.4g}" for value in shear_kpa.values()] or ["-"] * 3
    return (str(number), row.name, *values, row.basis)


def _levels(number: int, row: EvaluatedSet, levels: LevelsMet) -> tuple[str, ...]:
    deflection, firing, joint = row.deflection, row.firing, row.joint
    met = [_LETTERS[level] for level, reached in asdict(levels).items() if reached]
    return (
        str(number),
        fixed(deflection.r2, 3),
        ", ".join(fixed(value, 2) for value in deflection.deflection_mm),
        fixed(deflection.force_mn, 0),
        f"{fixed(firing.fss, 3)} ({fixed(firing.fss_dynamic, 2)}, {fixed(firing.fss_static, 2)})",
        fixed(firing.noise_sigma, 3),
        ", ".join(fixed(rate, 2) for rate in firing.hit_rate),
        fixed(joint.fss, 3),
        ", ".join(fixed(rate, 2) for rate in joint.hit_rate),
        " ".join(met) or "-",
    )


def _unsolved(results: MaterialStudy) -> list[str]:
    return [
        f"Set {number} could not be solved: {row.unsolved}"
        for number, row in enumerate(results.sets, start=1)
        if isinstance(row, UnsolvedSet)
    ]


def _order(order: TrialOrder) -> list[str | Part]:
    def cells(found: TrialDifference) -> tuple[str, ...]:
        depth, force = found.same_depth, found.same_force
        lengths = (depth.near_mm, depth.far_mm, force.near_mm, force.far_mm)
        return (*(fixed(length, 3) for length in lengths), fixed(found.force_ratio, 2))

    observed = table(
        ("inner layers and epidermis", *(f"{region} [mm]" for region in _REGIONS)),
        [(name, fixed(found.near_mm, 3), fixed(found.far_mm, 3)) for name, found in order.observed.items()],
    )
    columns = (
        "inner layers of Trials 2 and 3",
        *(f"{region}, same depth [mm]" for region in _REGIONS),
        *(f"{region}, same force [mm]" for region in _REGIONS),
        "force ratio at 1 mm",
    )
    stiff = table(columns, [(name, *cells(found)) for name, found in order.stiff_epidermis.items()])
    inner = table(columns, [(name, *cells(found)) for name, found in order.inner_layers.items()])
    return [
        "Mean deflection under the cylinder minus the observed one, at a depth of 1 mm:",
        observed,
        "Trial 2 minus Trial 3: stiff minus soft epidermis over the same inner layers.",
        stiff,
        "Trial 1 minus Trial 3: Maeno's inner layers minus others, under the same soft epidermis.",
        inner,
    ]
