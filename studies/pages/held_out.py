"""The page of `python -m studies held-out`: predictions that no search has used, inside or outside."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.data import paper
from fingerpad.report.formatting import ABSENT, fixed, number
from fingerpad.report.manifest import edition
from fingerpad.report.parts import Chapter, Drawing, Page, Part
from fingerpad.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PALE, LineStyle, new_figure
from studies import held_out_facts as facts
from studies.held_out import IN_VIVO_MM, PREDICTED, Check, HeldOut, Score
from studies.pages.markdown import parts_of, share, table
from studies.sphere_thresholds import STANDARDS_PER_M, SphereThresholds, ThresholdRow

LINES: tuple[LineStyle, ...] = (
    {"color": BLUE, "linestyle": "-", "marker": "o"},
    {"color": ORANGE, "linestyle": "--", "marker": "s"},
    {"color": GREEN, "linestyle": ":", "marker": "^"},
    {"color": BLACK, "linestyle": "-.", "marker": "D"},
)


def held_out_page(results: HeldOut) -> Page:
    """Return the page of `python -m studies held-out`."""
    manifest = results.manifest
    drawing = Drawing(
        "held_out",
        "Predictions that no search has used",
        partial(draw, results),
        "(a) Force of indenters; bars: range of four subjects under the plate, crosses: their mean. "
        "(b) Static rate under spheres pressed by force. (c) Static rate beside the middle of spheres. "
        "(d) Modulation index of gratings with grooves as wide as ridges; crosses: in vivo, in two readings. "
        "(e) Rates in successive windows over that in the first; crosses: after 12 s in vivo. (f) Weber "
        "fractions at 144 /m by force, for noise that is proportional to the rate or independent of it; "
        "shaded: people.",
    )
    return Page(
        "Predictions that no search has used",
        f"Written by `python -m studies held-out` on {manifest.started[:10]}: {edition(manifest)}, tissues "
        f"`{manifest.materials}`, mechanical code {manifest.code_hash}.",
        [_summary(results.checks), _roles()],
        [
            Chapter("", [drawing]),
            Chapter("Inside or outside", _checks(results.checks)),
            Chapter("Files of observations", _scores(results.scores)),
            Chapter("Force and deflection", [*_forces(results), *_deflections(results)]),
            Chapter("Spheres pressed by force", _spheres(results)),
            Chapter("Gratings", _gratings(results)),
            Chapter("Adaptation", _adaptation(results)),
            Chapter("Volume", _volumes(results)),
            Chapter("Weber fractions by depth and by force", _thresholds(results.thresholds)),
        ],
    )


def _summary(checks: Sequence[Check]) -> str:
    judged = [check for check in checks if check.role == PREDICTED and check.inside is not None]
    inside = sum(bool(check.inside) for check in judged)
    outside = sorted({check.subject for check in judged if not check.inside})
    beyond = f" Predictions outside are of: {', '.join(outside)}." if outside else ""
    return f"{inside} of {len(judged)} predictions lie inside what was published.{beyond}"


def _roles() -> str:
    return (
        "Chosen in sample, with the tissues `human`: the force of a plate at 1 and 2 mm, the deflection "
        "under the cylinder at 1 mm, the rates under the bar, and two hit rates at 287 /m. All else on this "
        "page is predicted. Statuses are those of `fingerpad.data`."
    )


def _verdict(inside: bool | None) -> str:
    return ABSENT if inside is None else "inside" if inside else "**outside**"


def _range(check: Check) -> str:
    low, high = (number(value) if np.isfinite(value) else "" for value in (check.low, check.high))
    if not high:
        return "above 0" if check.low < 1e-9 else f"from {low}"
    return f"up to {high}" if not low else f"{low}–{high}"


def _checks(checks: Sequence[Check]) -> list[Part]:
    rows = [
        (
            check.subject,
            check.statement,
            f"{number(check.predicted)} {'' if check.unit == '1' else check.unit}".strip(),
            _range(check),
            _verdict(check.inside),
            check.role,
            f"{check.source} ({check.status})",
        )
        for check in checks
    ]
    columns = ("of", "what", "predicted", "published", "verdict", "role", "source (status)")
    return parts_of(
        table(columns, rows),
        "A direction that a source states in words is met if the smallest of all changes is above 0. Where "
        "only a mean or one number is published, the range is assumed as the row says. A dash: the press is "
        "impossible, because the indenter comes too near to the bone.",
    )


def _scores(scores: Sequence[Score]) -> list[Part]:
    rows = [
        (
            f"`{score.file}.csv`",
            score.loading.replace("_", " "),
            score.role,
            str(score.n_rows),
            fixed(score.r2, 3),
            fixed(score.correlation, 3),
            fixed(score.gain, 2),
            ABSENT if score.inside_range is None else str(score.inside_range).lower(),
            share(score.share_inside, 0) if np.isfinite(score.share_inside) else ABSENT,
        )
        for score in scores
    ]
    columns = ("file", "loading", "role", "rows", "r2", "correlation", "gain", "inside_range", "share_inside")
    return parts_of(
        "Scores of `fingerpad validate` for the files in `studies/observations`:", table(columns, rows)
    )


def _forces(results: HeldOut) -> list[Part]:
    found = results.forces
    depths = [f"{depth:g} mm" for depth in found.depth_mm]
    rows = [
        (name, *(fixed(force, 3) for force in row))
        for name, row in zip(found.indenter, found.force_n, strict=True)
    ]
    rows.append(("plate, quasi-static", *(fixed(force, 3) for force in found.slow_plate_n)))
    rows.append(("people under a plate, mean", *(fixed(force, 2) for force in found.people_n)))
    return parts_of(
        "Force at the end of the hold [N]. People were pressed slowly, so that their force lies between the "
        "two rows of the plate. With both, the ratio of the force to people's falls with the depth: the "
        "tissues stiffen less than fingers do. Except for the plate no numbers that can be cited were at "
        "hand; `fingerpad validate` scores a file with the header `indenter,depth_mm,force_n`.",
        table(("indenter", *depths), rows),
    )


def _deflections(results: HeldOut) -> list[Part]:
    found = results.deflections
    rows = [
        (f"`{name}`, {depth:g} mm", *(fixed(value, 2) for value in row))
        for name, depth, row in zip(found.indenter, found.depth_mm, found.share, strict=True)
    ]
    return parts_of(
        "Deflection over the depth, mean of both sides, by the distance from the axis. The profile of the "
        "cylinder at 1 mm was used to choose the tissues; the others are predictions without numbers that "
        "can be cited (header `indenter,depth_mm,distance_mm,deflection_mm`).",
        table(("indenter", *(f"{distance:g} mm" for distance in found.distance_mm)), rows),
    )


def _spheres(results: HeldOut) -> list[Part]:
    found = results.spheres
    middle = [
        (f"{force:g} N", *(fixed(rate, 0) for rate in row))
        for force, row in zip(found.force_n, found.rate_hz, strict=True)
    ]
    beside = [
        (f"{curvature:g} /m", *(fixed(rate, 0) for rate in row), fixed(width, 1))
        for curvature, row, width in zip(
            found.profile_per_m, found.profile_hz, found.half_widths_mm(), strict=True
        )
    ]
    return parts_of(
        "Static rate [spikes/s] in the middle of spheres, with the forces and curvatures of Goodwin, "
        "Macefield & Bisley 1997 and a smaller force. Their abstract states directions, no rates; a file "
        "with the header `force_n,curvature_per_m,rate_hz` can be scored. A dash: the sphere would come "
        "nearer to the bone than a fifth of the way, which the model refuses. Fingers bear these spheres: "
        "the same lack of stiffening.",
        table(("force", *(f"{curvature:g} /m" for curvature in found.curvature_per_m)), middle),
        f"Static rate [spikes/s] beside the middle, {found.profile_force_n:g} N, by the position of the "
        "receptor towards the proximal end (header `force_n,curvature_per_m,position_mm,rate_hz`):",
        table(("sphere", *(f"{position:g} mm" for position in found.position_mm), "half-width [mm]"), beside),
    )


def _gratings(results: HeldOut) -> list[Part]:
    found = results.gratings
    rows = [
        (
            f"{ridge:g} mm",
            "along the finger" if spin else "across the finger",
            f"{fixed(rates.min(), 0)}–{fixed(rates.max(), 0)}",
            fixed(static, 2),
            fixed(dynamic, 2),
        )
        for ridge, spin, rates, static, dynamic in zip(
            found.ridge_mm,
            found.spin_deg,
            found.static_hz,
            found.static_index,
            found.dynamic_index,
            strict=True,
        )
    ]
    forced = [
        (f"{force:g} N", *(fixed(index, 2) for index in row))
        for force, row in zip(found.force_n, found.forced_index, strict=True)
    ]
    return parts_of(
        "Gratings 1.0 mm deep; grooves are as wide as ridges. Our source does not say whether the 3 and 5 mm "
        "in vivo are the width of a ridge or a period, nor which phase they belong to. An index of 1 means "
        "that the receptor is silent over a groove; it cannot increase with the period or the amplitude. "
        "Recorded afferents keep firing there, so that the model is too selective for edges in the hold.",
        table(("ridge", "ridges", "static [spikes/s]", "static index", "dynamic index"), rows),
        "Static index by force, from the rates of kind `grating` (header "
        "`force_n,ridge_mm,groove_mm,position_mm,rate_hz`):",
        table(("force", *(f"ridge {ridge:g} mm" for ridge in found.forced_ridge_mm)), forced),
        f"People detect a gap of {facts.GAP_THRESHOLD.value:g} mm in 75 % of trials "
        f"({facts.GAP_THRESHOLD.source}; {facts.GAP_THRESHOLD.status}); the task itself is on "
        "[discrimination](discriminate.md).",
    )


def _adaptation(results: HeldOut) -> list[Part]:
    rows = [
        (
            found.name,
            ", ".join(f"{start:.3g}–{end:.3g}" for start, end in found.window_s),
            ", ".join(fixed(rate, 1) for rate in found.rate_hz),
            share(found.decline, 0) if np.isfinite(found.decline) else ABSENT,
        )
        for found in results.adaptation
    ]
    return parts_of(
        "Rate below the middle of the contact in successive windows:",
        table(("touch", "windows [s]", "rate [spikes/s]", "decline"), rows),
        "All decline of the model is relaxation of the tissues (time constants of 2 and 9 s) and of the "
        "membrane. It has no current that inactivates and no adaptation of the spike generator, which would "
        "add a fast decline. For the first second no number that can be cited was at hand.",
    )


def _volumes(results: HeldOut) -> list[Part]:
    found = results.volumes
    rows = [
        (name, *(share(value) for value in row))
        for name, row in zip(found.indenter, found.decrease, strict=True)
    ]
    return parts_of(
        "Decrease of the volume of the soft tissue in the modelled 32 mm of the finger. The observed one is "
        "of the whole fingertip with its bone, so that the same decrease is a smaller share there.",
        table(("indenter", *(f"{depth:g} mm" for depth in found.depth_mm)), rows),
    )


def _thresholds(found: SphereThresholds) -> list[Part]:
    low, high = found.people
    ends = (STANDARDS_PER_M[0], STANDARDS_PER_M[-1])
    columns = (
        "spheres pressed",
        "noise",
        "receptors",
        "changed",
        "fitted noise",
        *(f"Weber {standard:g} /m" for standard in STANDARDS_PER_M),
        f"inside at {STANDARDS_PER_M[0]:g} /m",
        *(f"elasticity {standard:g} /m" for standard in ends),
        *(f"spread {standard:g} /m" for standard in ends),
    )
    return parts_of(
        f"Threshold over standard (people: {low:.2f}–{high:.2f}) of the static Gradient Sum. The noise of "
        "each row is fitted to people's two hit rates at 287 /m, so that the fraction there is nearly the "
        "same in all rows, and that at 144 /m differs. The first row is the paper's experiment; `changed` is "
        "the number of causes that differ from it. Elasticity: relative change of the sum over that of the "
        "curvature. Spread: standard deviation of the noisy sum over its mean. The fraction is about 1.35 "
        "times spread over elasticity. Noise independent of the rate is in units of 100 spikes/s. Between "
        "pressed spheres rates are interpolated; another choice of spheres moves a fraction by up to 0.02.",
        table(columns, [_threshold_row(found, row) for row in found.rows]),
        "[Curvature thresholds](decisions.md#curvature-thresholds) has the conclusion.",
    )


def _threshold_row(found: SphereThresholds, row: ThresholdRow) -> tuple[str, ...]:
    named = (row.pressed, row.noise, row.receptors, str(row.changed))
    if not row.thresholds:
        return (*named, "none fits", *[ABSENT] * (len(STANDARDS_PER_M) + 5))
    ends = (row.thresholds[0], row.thresholds[-1])
    return (
        *named,
        fixed(row.noise_sigma, 3),
        *(fixed(threshold.weber_fraction, 3) for threshold in row.thresholds),
        _verdict(found.within(row, STANDARDS_PER_M[0])),
        *(fixed(threshold.elasticity, 2) for threshold in ends),
        *(fixed(threshold.relative_spread, 3) for threshold in ends),
    )


def draw(results: HeldOut) -> Figure:
    """Draw forces, rates under spheres, gratings, adaptation and Weber fractions.

    Parameters
    ----------
    results : HeldOut

    Returns
    -------
    Figure
    """
    figure = new_figure(12.0, 7.5)
    panels = figure.subplots(2, 3)
    _draw_forces(panels[0, 0], results)
    spheres = results.spheres
    _lines(
        panels[0, 1],
        spheres.curvature_per_m,
        spheres.rate_hz,
        [f"{force:g} N" for force in spheres.force_n],
    )
    panels[0, 1].set(title="(b) spheres by force", xlabel="curvature [1/m]", ylabel="static rate [spikes/s]")
    _lines(
        panels[0, 2],
        spheres.position_mm,
        spheres.profile_hz,
        [f"{curvature:g} /m" for curvature in spheres.profile_per_m],
    )
    panels[0, 2].set(
        title=f"(c) beside the middle, {spheres.profile_force_n:g} N",
        xlabel="position of the receptor [mm]",
        ylabel="static rate [spikes/s]",
    )
    _draw_gratings(panels[1, 0], results)
    _draw_adaptation(panels[1, 1], results)
    _draw_thresholds(panels[1, 2], results.thresholds)
    return figure


def _lines(axes: Axes, x: FloatArray, rows: FloatArray, labels: Sequence[str]) -> None:
    for line, label, values in zip(LINES, labels, rows, strict=False):
        axes.plot(x, values, **line, label=label, markersize=4.0)
    axes.set_ylim(bottom=0.0)
    axes.legend()


def _draw_forces(axes: Axes, results: HeldOut) -> None:
    found = results.forces
    low, high = found.people_range_n.T
    known = np.isfinite(low)
    axes.vlines(found.depth_mm[known], low[known], high[known], color=PALE, linewidth=9.0)
    axes.plot(found.depth_mm, found.people_n, "x", color=GREY, label="people, plate")
    _lines(axes, found.depth_mm, found.force_n, found.indenter)
    axes.plot(found.depth_mm, found.slow_plate_n, color=GREY, linestyle="--", label="plate, relaxed")
    axes.legend()
    axes.set(title="(a) force", xlabel="depth [mm]", ylabel="force [N]")


def _draw_gratings(axes: Axes, results: HeldOut) -> None:
    found = results.gratings
    for line, spin, label in zip(LINES, (0.0, 90.0), ("across the finger", "along it"), strict=False):
        chosen = found.spin_deg == spin
        axes.plot(found.ridge_mm[chosen], found.static_index[chosen], **line, label=label, markersize=4.0)
    in_vivo = paper.GRATING_MODULATION_IN_VIVO.value
    axes.plot(IN_VIVO_MM, in_vivo, "x", color=GREY, label="in vivo, ridge")
    axes.plot(np.divide(IN_VIVO_MM, 2.0), in_vivo, "+", color=GREY, label="in vivo, period")
    axes.set(
        title="(d) gratings",
        xlabel="width of ridges and grooves [mm]",
        ylabel="static modulation index",
        ylim=(0.0, 1.05),
    )
    axes.legend()


def _draw_adaptation(axes: Axes, results: HeldOut) -> None:
    for line, found in zip(LINES, results.adaptation, strict=False):
        rates = found.rate_hz / found.rate_hz[0]
        axes.plot(found.window_s.mean(axis=1), rates, **line, label=found.name, markersize=4.0)
    for found, observed in zip(
        results.adaptation[-len(facts.DECLINES.value) :], facts.DECLINES.value, strict=False
    ):
        axes.plot(found.window_s[-1].mean(), 1.0 - observed, "x", color=GREY)
    axes.set_xscale("log")
    axes.set(
        title="(e) adaptation", xlabel="time from the first touch [s]", ylabel="rate over that of the first"
    )
    axes.set_ylim(0.0, 1.1)
    axes.legend(fontsize=7.5, loc="lower left")


def _draw_thresholds(axes: Axes, found: SphereThresholds) -> None:
    """Fractions at the smallest standard by force, of each noise and population."""
    standard = STANDARDS_PER_M[0]
    by_force = [row for row in found.rows if row.pressed.endswith(" N") and row.thresholds]
    kinds = dict.fromkeys((row.noise, row.receptors) for row in by_force)
    axes.axhspan(*found.people, color=PALE)
    for line, kind in zip(LINES, kinds, strict=False):
        chosen = [row for row in by_force if (row.noise, row.receptors) == kind]
        axes.plot(
            [row.thresholds[-1].force_n for row in chosen],
            [row.weber(standard) for row in chosen],
            **line,
            label=f"{kind[0].partition(' ')[0]}, {kind[1].partition(',')[0]}",
            markersize=4.0,
        )
    axes.set(
        title=f"(f) Weber fraction at {standard:g} /m",
        xlabel="force of the spheres [N]",
        ylabel="threshold over standard",
    )
    axes.set_ylim(0.0, 0.4)
    axes.legend(title="noise, receptors", fontsize=8.0, loc="upper left")
