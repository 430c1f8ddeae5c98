"""The page of `python -m studies tissue-search`: candidates on four levels, and effects of parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import isfinite

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FixedLocator, NullLocator

from fingerpad.core.checks import FloatArray
from fingerpad.data import paper, psychophysics
from fingerpad.report.formatting import fixed, joined
from fingerpad.report.manifest import edition
from fingerpad.report.parts import Chapter, Drawing, Page, Part
from fingerpad.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PALE, new_figure
from studies.pages.markdown import parts_of, table
from studies.tissue_candidates import CHANGE, LEVELS, SED, STRESS
from studies.tissue_search import (
    MOVED_EUCLIDEAN,
    MOVED_FORCE,
    MOVED_FSS,
    MOVED_NOISE,
    MOVED_R2,
    MOVED_RATE_HZ,
    Levels,
    Row,
    Targets,
    TissueSearch,
    met,
    moved,
)
from studies.trial_order import TrialDifference, TrialOrder

SIGMA = psychophysics.NOISE_SIGMA.value
PAPER_DYNAMIC_HZ = (paper.DYNAMIC_RATE_MINIMUM.value, paper.DYNAMIC_RATE_MAXIMUM.value)

LETTERS = dict(zip(LEVELS, "dfrp", strict=True))
"""One letter per level: deflection, force, rates, percept."""

ONE_BAR = (
    "The bar of a candidate without * is pressed once and read at 36 shifted sites; with * it is pressed at "
    "all 36 shifts. {comparison}"
)
FEW = 4
"""Numbers of a shared label from which on only the first and the last are written."""

MARKS = {str(SED): (BLUE, "o"), str(STRESS): (ORANGE, "s")}
"""Colour and marker by the drive; others are green triangles."""

FORCES_N = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0)
SCORES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.93, 0.95, 0.96, 0.97, 0.98, 0.99)
BEST_SCORE = 1.005
"""Score at which the scale of the scores would end."""

LABEL_PT, MARK_PT, POINTS_PER_INCH = 7.0, 2.5, 72.0
RADII_PT = (4.0, 8.0, 13.0, 20.0, 29.0, 40.0, 54.0, 70.0)
"""Distances of a label from its point that are tried. [1/72 inch]"""

_REGIONS = ("within 0.5 mm", "0.5 to 5 mm")


def tissue_search_page(results: TissueSearch) -> Page:
    """Return the page of `python -m studies tissue-search`."""
    manifest = results.manifest
    drawing = Drawing(
        "tissue_search",
        "Levels of every candidate",
        partial(draw, results),
        "Each point is a candidate of the table below, labelled by its number. Blue circles: driven by "
        "strain energy density (SED); orange squares: by compressive stress; green triangles: by another "
        "quantity. Shaded: targets. The scales of R² and FSS are logarithmic in their distance from 1. "
        "Cross in (c): the "
        f"paper's {PAPER_DYNAMIC_HZ[0]:g} and {PAPER_DYNAMIC_HZ[1]:g} spikes/s.",
    )
    return Page(
        "Search for tissues on four levels",
        f"Written by `python -m studies tissue-search` on {manifest.started[:10]}: {edition(manifest)}, "
        f"mechanical code {manifest.code_hash}. Conclusions are on "
        "[two sets: paper and human](decisions/paper-and-human.md), "
        "[substitutes for the lost hyperelastic coefficients](decisions.md#lost-hyperelastic-coefficients), "
        "[order of the three trials in deflection](decisions.md#order-of-the-trials) and "
        "[one material set for three levels](decisions.md#one-set-for-three-levels).",
        [_meet_all(results), ONE_BAR.format(comparison=_one_bar_error(results))],
        [
            Chapter("", [drawing]),
            Chapter("Candidates", _candidates(results)),
            Chapter("Levels", _levels(results)),
            Chapter("Sensitivities", _sensitivities(results)),
            Chapter("Order of the trials", parts_of(*_order(results.order))),
            Chapter("Wu's tissues as polynomials", _polynomials(results)),
        ],
    )


def draw(results: TissueSearch) -> Figure:
    """Draw deflection against force, firing against noise, dynamic rates, and both codes at one noise.

    Parameters
    ----------
    results : TissueSearch

    Returns
    -------
    Figure
    """
    figure = new_figure(12.0, 9.0)
    (force, firing), (rates, codes) = figure.subplots(2, 2)
    wanted = results.targets
    (_, _), (low, high) = wanted.plate_force_n
    clouds = (
        (force, lambda found: (found.deflection.plate_force_n[1], found.deflection.r2)),
        (firing, lambda found: (found.percept.noise_sigma, found.firing.fss_out_of_sample)),
        (rates, lambda found: found.firing.dynamic_hz),
        (codes, lambda found: (found.percept.noise_sigma, found.percept.euclidean_rms)),
    )
    force.set_xscale("log")
    force.xaxis.set_major_locator(FixedLocator(FORCES_N))
    force.xaxis.set_major_formatter("{x:g}")
    force.xaxis.set_minor_locator(NullLocator())
    for axes in (force, firing):
        # Scores lie close together near 1: the scale is logarithmic in what they miss.
        axes.set_yscale("function", functions=(_from_score, _to_score))
        axes.yaxis.set_major_locator(FixedLocator(SCORES))
    labels = [_cloud(axes, results, point) for axes, point in clouds]
    _shade(force, (low, high), (wanted.r2, 1.0))
    force.set(
        title="(a) deflection, force",
        xlabel="force of the plate at 2 mm [N]",
        ylabel="R² under the cylinder",
    )
    _shade(firing, wanted.noise_sigma, (wanted.fss, 1.0))
    firing.set(title="(b) percept, firing", xlabel="fitted noise σ₁", ylabel="FSS out of sample")
    rates.plot(*PAPER_DYNAMIC_HZ, "+", color=BLACK, markersize=12.0)
    rates.set(title="(c) dynamic rates", xlabel="under the flat face [spikes/s]", ylabel="largest [spikes/s]")
    _shade(codes, wanted.noise_sigma, (0.0, wanted.euclidean_rms))
    codes.set(
        title="(d) both codes at one noise",
        xlabel="noise σ₁ fitted to the Gradient Sum",
        ylabel="rms error of the Euclidean Distance",
    )
    figure.draw_without_rendering()  # which gives the panels their final sizes
    for (axes, _), named in zip(clouds, labels, strict=True):
        _write_labels(axes, named)
    return figure


def _from_score(score: FloatArray) -> FloatArray:
    return -np.log(np.maximum(BEST_SCORE - np.asarray(score), BEST_SCORE - 1.0))


def _to_score(place: FloatArray) -> FloatArray:
    return BEST_SCORE - np.exp(-np.asarray(place))


def _cloud(
    axes: Axes, results: TissueSearch, point: Callable[[Levels], Sequence[float]]
) -> dict[tuple[float, float], str]:
    """Draw one point per candidate that has both numbers, and return labels; one point has one label."""
    numbers: dict[tuple[float, float], list[str]] = {}
    for number, row in enumerate(results.rows, start=1):
        if row.levels is None or not all(isfinite(value) for value in point(row.levels)):
            continue
        x, y = point(row.levels)
        colour, marker = MARKS.get(row.drive, (GREEN, "^"))
        axes.plot(x, y, marker, markersize=5.0, color=colour)
        numbers.setdefault((x, y), []).append(str(number))
    return {
        place: ", ".join(group) if len(group) < FEW else f"{group[0]} ... {group[-1]}"
        for place, group in numbers.items()
    }


def _write_labels(axes: Axes, labels: Mapping[tuple[float, float], str]) -> None:
    """Write each label where it covers no label and no point; a line leads to a point that is far."""
    if not labels:
        return
    points = axes.transData.transform(list(labels)) * POINTS_PER_INCH / axes.figure.dpi
    frame = axes.bbox.get_points() * POINTS_PER_INCH / axes.figure.dpi
    boxes = [(point - MARK_PT, point + MARK_PT) for point in points]
    angles = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False) + 0.5
    for (place, text), point in zip(labels.items(), points, strict=True):
        half = 0.5 * np.array([0.62 * LABEL_PT * len(text), 1.05 * LABEL_PT])
        offsets = [
            (half + radius) * (np.cos(angle), np.sin(angle)) for radius in RADII_PT for angle in angles
        ]

        def covered(offset: FloatArray, half: FloatArray = half, point: FloatArray = point) -> float:
            low, high = point + offset - half, point + offset + half
            outside = float(np.maximum(frame[0] - low, high - frame[1]).clip(0.0).sum())
            shared = (np.minimum(high, other[1]) - np.maximum(low, other[0]) for other in boxes)
            return outside + sum(float(side.prod()) for side in shared if (side > 0.0).all())

        # The nearest of the places that cover least.
        offset = min(offsets, key=covered)
        boxes.append((point + offset - half, point + offset + half))
        far = np.abs(offset).max() > half.max() + 2.0 * RADII_PT[0]
        axes.annotate(
            text,
            place,
            xytext=tuple(offset),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=LABEL_PT,
            color=BLACK,
            arrowprops={"arrowstyle": "-", "linewidth": 0.4, "color": GREY, "shrinkB": 2.0} if far else None,
        ).set_in_layout(False)


def _shade(axes: Axes, across: Sequence[float], up: Sequence[float]) -> None:
    """Shade the targets of both axes, and keep the limits that the points set."""
    limits = (axes.get_xlim(), axes.get_ylim())
    corner = (across[0], up[0])
    axes.add_patch(Rectangle(corner, across[1] - across[0], up[1] - up[0], color=PALE, zorder=0))
    axes.set(xlim=limits[0], ylim=limits[1])


def _meet_all(results: TissueSearch) -> str:
    """Candidates that meet the targets of all levels, in a sentence."""
    names = [
        f"{row.name} ({row.drive})"
        for row in results.rows
        if row.levels is not None and met(row.levels, results.targets) == LEVELS
    ]
    return (
        f"**Candidates that meet all targets: {joined(names)}.**"
        if names
        else "**No candidate meets all targets.**"
    )


def _one_bar_error(results: TissueSearch) -> str:
    """Return what one bar changes for the candidate that has both."""
    once = results.base.levels
    shifted = next((row.levels for row in results.rows if row.name == results.base.name), None)
    if once is None or shifted is None:
        return ""
    return (
        f"Of {results.base.name} the FSS in sample is {fixed(once.firing.fss, 3)} from one bar and "
        f"{fixed(shifted.firing.fss, 3)} from 36."
    )


def _label(row: Row) -> str:
    return f"{row.name}*" if row.shifted_bars else row.name


def _shared(values: FloatArray, decimals: int) -> str:
    """Values of four layers, once if all are equal."""
    texts = [fixed(value, decimals) for value in values]
    return texts[0] if len(set(texts)) == 1 else " / ".join(texts)


def _candidates(results: TissueSearch) -> list[Part]:
    rows = []
    for number, row in enumerate(results.rows, start=1):
        predicted = [level for level in LEVELS if level not in row.chosen_by]
        rows.append(
            (
                str(number),
                _label(row),
                row.drive,
                " / ".join(f"{value:.3g}" for value in row.shear_kpa),
                _shared(row.poisson, 2),
                fixed(row.long_term_share, 2),
                row.basis,
                ", ".join(row.chosen_by) or "–",
                ", ".join(predicted) or "–",
            )
        )
    columns = (
        "",
        "candidate",
        "drive of both terms",
        "shear moduli [kPa]",
        "nu",
        "long-term share",
        "basis and status",
        "chosen in sample by",
        "predicted",
    )
    return parts_of(
        table(columns, rows),
        "Shear moduli and nu are initial and long-term, of stratum corneum, living epidermis, dermis and "
        "subcutis. Only the deviator relaxes, so that a long-term nu of 0.40 is 0.34 at once. The "
        "long-term share is what remains of the deviatoric stress. SED is read in the living epidermis "
        "above its border to the dermis unless a depth is given. In every row four numbers of the "
        "afferent are fitted to the firing rates and to people's two hit rates (both codes, both "
        f"positions, at a noise of {SIGMA:g}), bounded to silence at rest; then the noise is fitted. "
        "Tissues and drive were chosen by the levels of the last but one column; on the others the "
        "choice of tissues and drive used no observation. Weber fractions are predictions in every row.",
    )


def _levels(results: TissueSearch) -> list[Part]:
    rows = []
    for number, row in enumerate(results.rows, start=1):
        if row.levels is None:
            rows.append((str(number), _label(row), "not solved", *[""] * 12))
            continue
        found, firing, percept = row.levels.deflection, row.levels.firing, row.levels.percept
        rows.append(
            (
                str(number),
                _label(row),
                fixed(found.r2, 3),
                ", ".join(fixed(force, 2) for force in found.plate_force_n),
                _span(found.factor_range, 2),
                f"{fixed(firing.fss, 3)} / {fixed(firing.fss_out_of_sample, 3)}",
                fixed(firing.fss_rates_alone, 3),
                _span(firing.dynamic_hz, 0),
                _span(firing.static_hz, 0),
                fixed(percept.noise_sigma, 3),
                ", ".join(fixed(rate, 2) for rate in percept.hit_rates[0]),
                fixed(percept.shift_effect, 3),
                fixed(percept.euclidean_rms, 3),
                ", ".join(fixed(fraction, 3) for fraction in percept.weber_fractions),
                " ".join(LETTERS[level] for level in met(row.levels, results.targets)) or "–",
            )
        )
    columns = (
        "",
        "candidate",
        "R²",
        "plate, 1 and 2 mm [N]",
        "factor for people's force",
        "FSS in / out of sample",
        "FSS, rates alone",
        "dynamic, flat–largest [spikes/s]",
        "static, flat–largest [spikes/s]",
        "noise",
        f"hit rates at {SIGMA:g}",
        "effect of 0.2 mm",
        "Euclidean rms",
        "Weber, 144 and 287 /m",
        "meets",
    )
    return parts_of(table(columns, rows), _legend(results.targets), *_unsolved(results))


def _span(values: Sequence[float], decimals: int) -> str:
    return "–".join(fixed(value, decimals) for value in values) if isfinite(values[0]) else "none"


def _legend(wanted: Targets) -> str:
    (low, high), (deeper_low, deeper_high) = wanted.plate_force_n
    quiet, loud = wanted.noise_sigma
    return (
        "R² is that of the deflection under the 3.17 mm cylinder at 1 mm. The plate is pressed without "
        "tilt; its force is that at the end of the 1 s hold. A common factor on all moduli multiplies "
        "forces; gains of the afferent compensate for it, so that all other columns stay. The factors "
        "given put both forces into people's ranges. FSS belongs to the afferent fitted to rates and hit "
        "rates, and to one fitted to the rates alone. Rates are the smallest under the flat face of the "
        "bar and the largest. The noise fits the Gradient Sum to people's 0.58 and 0.95, mean of both "
        "positions. The effect of 0.2 mm is the largest difference of a hit rate between both positions. "
        "The error of the Euclidean Distance is that at the same noise. Weber fractions at 287 /m are "
        "interpolated between 287, 296 and 365 /m without *, and between seven spheres with *. Targets: "
        f"R² of {wanted.r2:g} or more (d), {low:g}–{high:g} N and {deeper_low:g}–{deeper_high:g} N (f), "
        f"FSS out of sample of {wanted.fss:g} or more (r), a noise of {quiet:g}–{loud:g} and a Euclidean "
        f"Distance within {wanted.euclidean_rms:g} (p)."
    )


def _unsolved(results: TissueSearch) -> list[str]:
    return [
        f"{row.name} could not be solved: {row.unsolved}"
        for row in (*results.rows, *results.variations)
        if row.levels is None
    ]


def _sensitivities(results: TissueSearch) -> list[Part]:
    base = results.base.levels
    if base is None:
        return parts_of("The set `human` could not be solved.")
    rows = [(results.base.name, *_effects(base), "")]
    for row in results.variations:
        if row.levels is None:
            rows.append((row.name, *["–"] * 8, "not solved"))
        else:
            rows.append((row.name, *_effects(row.levels), ", ".join(moved(base, row.levels)) or "none"))
    columns = (
        "changed",
        "R²",
        "plate, 1 and 2 mm [N]",
        "FSS in sample",
        "dynamic, flat–largest [spikes/s]",
        "static, flat–largest [spikes/s]",
        "noise",
        "Euclidean rms",
        "Weber, 287 /m",
        "moves",
    )
    return parts_of(
        f"One parameter of `human` at a time is changed, moduli by a factor of {CHANGE:g}; the afferent "
        "is fitted again. The bar is pressed once.",
        table(columns, rows),
        f"A change moves deflection from {MOVED_R2:g} of R² on, force from {MOVED_FORCE:.0%}, firing from "
        f"{MOVED_FSS:g} of FSS or {MOVED_RATE_HZ:g} spikes/s of a rate, and percept from {MOVED_NOISE:g} "
        f"of the noise or {MOVED_EUCLIDEAN:g} of the Euclidean rms.",
    )


def _effects(levels: Levels) -> tuple[str, ...]:
    found, firing, percept = levels.deflection, levels.firing, levels.percept
    return (
        fixed(found.r2, 3),
        ", ".join(fixed(force, 2) for force in found.plate_force_n),
        fixed(firing.fss, 3),
        _span(firing.dynamic_hz, 0),
        _span(firing.static_hz, 0),
        fixed(percept.noise_sigma, 3),
        fixed(percept.euclidean_rms, 3),
        fixed(percept.weber_fractions[1], 3),
    )


def _polynomials(results: TissueSearch) -> list[Part]:
    rows = [
        (
            found.layer,
            f"{found.poisson:.2f}",
            f"{found.compression:.0%}",
            ", ".join(f"{value:.4f}" for value in found.coefficients_kpa),
            f"{found.misfit:.2%}",
        )
        for found in results.polynomials
    ]
    columns = ("layer", "nu", "fitted up to", "C10, C01, C20, C11, C02 [kPa]", "rms error / largest stress")
    return parts_of(table(columns, rows))


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
