"""The page of `python -m studies tissue-posterior`: marginals, what informs them, bands, calibration."""

from __future__ import annotations

from functools import partial
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.data import bar_firing_rates, psychophysics
from fingerpad.experiments.gerling2014.discrimination_statistics import goodwin_hit_rates_at
from fingerpad.experiments.gerling2014.single_unit_uncertainty import CredibleInterval
from fingerpad.report.formatting import fixed, joined
from fingerpad.report.manifest import edition
from fingerpad.report.parts import Chapter, Drawing, Page, Part
from fingerpad.report.style import BLACK, BLUE, GREY, new_figure
from studies.finger_levels import deflection_distances_mm
from studies.finger_posterior import PARAMETERS, Observations
from studies.pages.markdown import parts_of, share, table
from studies.posterior_calibration import LEVELS as COVERED
from studies.posterior_calibration import Calibration
from studies.tissue_candidates import LEVELS
from studies.tissue_design import RANGES
from studies.tissue_posterior import (
    CURVATURES_PER_M,
    REPEATED,
    STANDARD_PER_M,
    Band,
    TissuePosterior,
)
from studies.tissue_search import plate_range_n

STRONG = 0.5
"""Correlations from this size on are listed."""

DIGITS = 3

INFORMED = 1.2
"""Without a level that informs a parameter, its interval is at least so many times as wide."""


def tissue_posterior_page(results: TissuePosterior) -> Page:
    """Return the page of `python -m studies tissue-posterior`."""
    manifest = results.manifest
    drawing = Drawing(
        "tissue_posterior",
        "All figures of the chain with their bands",
        partial(draw, results),
        "Line: median of the draws; dark and pale bands: 50 % and 95 % of the draws. Circles: observed, with "
        "the range of four subjects in (b) and binomial 95 % intervals of 100 trials (assumed) in (f) and "
        "(g). The bands are those of predicted means: residuals, differences between people and the scatter "
        "of trials are not in them. (g), (h) and the population in (e) were not fitted.",
    )
    return Page(
        "Posterior of tissues, afferent and noise",
        f"Written by `python -m studies tissue-posterior` on {manifest.started[:10]}: {edition(manifest)}, "
        f"mechanical code {manifest.code_hash}. "
        "Choices are on [posterior over tissues](decisions/posterior-over-tissues.md).",
        [_in_short(results)],
        [
            Chapter("", [drawing]),
            Chapter("Parameters", _parameters(results)),
            Chapter("What each level informs", _informs(results)),
            Chapter("Targets", _targets(results)),
            Chapter("Emulator", _emulator(results)),
            Chapter("Calibration", _calibration(results)),
        ],
    )


def _in_short(results: TissuePosterior) -> str:
    wrong = results.calibration.wrong()
    verdict = (
        f"{len(results.calibration.shares_below)} synthetic experiments find no wrong coverage; so few show "
        "gross errors only."
        if not wrong
        else f"The coverage is wrong for {joined(wrong)}."
    )
    return (
        f"**All {len(results.targets)} targets of the set `human` hold at once with probability "
        f"{fixed(results.all_targets, 2)}.** {verdict} {_beside(results)}"
    )


def _beside(results: TissuePosterior) -> str:
    """Say which numbers of `human` lie outside of their intervals."""
    names = [
        _short(one.name)
        for one in results.marginals
        if not one.posterior.low <= one.human <= one.posterior.high
    ]
    if not names:
        return "All numbers of `human` lie within their 95 % intervals."
    return f"Of the numbers of `human` these lie outside of their 95 % intervals: {joined(names)}."


def draw(results: TissuePosterior) -> Figure:
    """Draw the bands of all figures in the paper's order, observations in them.

    Parameters
    ----------
    results : TissuePosterior

    Returns
    -------
    Figure
    """
    figure = new_figure(12.0, 10.0)
    first, second, third = figure.subplots(3, 3)
    bands, observed, rates = results.bands, Observations.published(), bar_firing_rates()
    deflection, force, dynamic = first
    _band(deflection, bands.deflection)
    _circles(deflection, deflection_distances_mm(), observed.deflection_mm)
    deflection.set(
        title="(a) skin under the cylinder", xlabel="distance [mm]", ylabel="deflection at 1 mm [mm]"
    )
    _intervals(force, bands.force)
    _whiskers(force, bands.force.at + 0.08, plate_range_n(), None)
    force.set(
        title="(b) flat plate", xlabel="depth [mm]", ylabel="force [N]", xlim=(0.5, 2.5), ylim=(0.0, None)
    )
    static, population, gradient = second
    for axes, letter, phase, values in (
        (dynamic, "c", "dynamic", rates.dynamic_rate_hz),
        (static, "d", "static", rates.static_rate_hz),
    ):
        _band(axes, getattr(bands, phase))
        _circles(axes, rates.shift_mm, values)
        axes.set(title=f"({letter}) {phase} rate", xlabel="shift of the bar [mm]", ylabel="rate [spikes/s]")
    _band(population, bands.population)
    population.set(
        title=f"(e) population, sphere of {STANDARD_PER_M:g} /m",
        xlabel="across the finger [mm]",
        ylabel="static rate [spikes/s]",
    )
    euclidean, weber, widths = third
    people = goodwin_hit_rates_at(CURVATURES_PER_M)
    for axes, title, one in (
        (gradient, "(f) Gradient Sum", bands.gradient),
        (euclidean, "(g) Euclidean Distance", bands.euclidean),
    ):
        _band(axes, one)
        _whiskers(axes, people.curvature_per_m, np.column_stack([people.low, people.high]), people.hit_rate)
        axes.set(title=title, xlabel="curvature of the comparison [1/m]", ylabel="hit rate", ylim=(0.4, 1.02))
    _intervals(weber, bands.weber)
    lowest, highest = psychophysics.WEBER_FRACTIONS.value
    _whiskers(weber, bands.weber.at + 8.0, np.array([[lowest, highest]]), None)
    weber.set(
        title="(h) Weber fraction",
        xlabel="standard [1/m]",
        ylabel="fraction",
        xlim=(STANDARD_PER_M - 60.0, STANDARD_PER_M + 60.0),
        ylim=(0.0, None),
    )
    _draw_widths(widths, results)
    return figure


def _band(axes: Axes, band: Band) -> None:
    axes.fill_between(band.at, band.low, band.high, color=BLUE, alpha=0.22, linewidth=0.0)
    axes.fill_between(band.at, band.inner_low, band.inner_high, color=BLUE, alpha=0.45, linewidth=0.0)
    axes.plot(band.at, band.median, color=BLUE)


def _intervals(axes: Axes, band: Band) -> None:
    """Draw a band at a few places as vertical bars."""
    axes.vlines(band.at, band.low, band.high, color=BLUE, linewidth=5.0, alpha=0.35)
    axes.vlines(band.at, band.inner_low, band.inner_high, color=BLUE, linewidth=5.0, alpha=0.7)
    axes.plot(band.at, band.median, "_", color=BLACK, markersize=9.0)


def _circles(axes: Axes, at: FloatArray, values: FloatArray) -> None:
    axes.plot(at, values, "o", color=BLACK, markerfacecolor="white", markersize=4.0, linestyle="none")


def _whiskers(axes: Axes, at: FloatArray, ends: FloatArray, values: FloatArray | None) -> None:
    """Draw observed ranges, (n, 2)."""
    axes.vlines(at, ends[:, 0], ends[:, 1], color=BLACK, linewidth=1.2)
    axes.plot(np.repeat(at, 2), ends.ravel(), "_", color=BLACK, markersize=7.0)
    if values is not None:
        _circles(axes, at, values)


def _draw_widths(axes: Axes, results: TissuePosterior) -> None:
    """Draw the width of every marginal relative to its prior."""
    place = np.arange(len(results.marginals))[::-1]
    axes.barh(place, [one.width for one in results.marginals], color=GREY, height=0.7)
    axes.set_yticks(place, [_short(one.name) for one in results.marginals], fontsize=7.0)
    axes.set(title="(i) posterior / prior", xlabel="width of the 95 % interval", xlim=(0.0, 1.1))


def _short(name: str) -> str:
    """Return a name without its unit, long words abbreviated.

    Examples
    --------
    >>> _short("dynamic gain k_d/(C v) [1/kPa]"), _short("stratum corneum / living epidermis")
    ('dynamic gain', 'corneum / epidermis')
    """
    text = name.split(" [")[0].replace("stratum corneum", "corneum").replace("living epidermis", "epidermis")
    return text.split(" k_")[0].replace("modulus of the subcutis", "subcutis modulus")


def _interval(found: CredibleInterval, digits: int = DIGITS) -> tuple[str, str]:
    return _number(found.median, digits), f"{_number(found.low, digits)} to {_number(found.high, digits)}"


def _number(value: float, digits: int = DIGITS) -> str:
    """Significant digits, with a typographic minus."""
    return "–" if not np.isfinite(value) else f"{value:.{digits}g}".replace("-", "−")


def _parameters(results: TissuePosterior) -> list[Part]:
    rows = [
        (one.name, *_interval(one.prior), *_interval(one.posterior), _number(one.human))
        for one in results.marginals
    ]
    columns = ("parameter", "prior", "95 %", "posterior", "95 %", "`human`")
    found = results.convergence
    strong = [
        f"{_short(PARAMETERS[a])} and {_short(PARAMETERS[b])} {_number(results.correlations[a, b], 2)}"
        for a, b in combinations(range(len(PARAMETERS)), 2)
        if abs(results.correlations[a, b]) >= STRONG
    ]
    return parts_of(
        table(columns, rows),
        f"The prior of the first {len(RANGES)} is uniform (of ratios, in the logarithm); ranges and widths "
        "of all priors are assumed. Medians of the prior of the subcutis and of the afferent are those of "
        "the set `human`, that of the noise is the paper's. The gains belong to compressive stress in kPa. "
        f"Correlations of at least {STRONG:g} in size: {'; '.join(strong) or 'none'}.",
        f"{found.draws} draws of {found.ensembles} ensembles of {found.walkers} walkers, "
        f"{found.evaluations} evaluations: R-hat at most {fixed(found.r_hat, 3)}, effective sample sizes at "
        f"least {found.effective_draws:.0f} and {found.effective_draws_of_tails:.0f} in the tails, one "
        f"effective draw per {found.draws_per_effective_draw:.0f}, accepted proposals "
        f"{share(found.acceptance, 0)}. Draws that have not converged are not stored.",
    )


def _informs(results: TissuePosterior) -> list[Part]:
    rows = [
        (
            one.name,
            fixed(one.width, 2),
            *(fixed(one.width_without[level], 2) if level in one.width_without else "–" for level in LEVELS),
            ", ".join(level for level, wide in one.width_without.items() if wide >= INFORMED * one.width)
            or "–",
        )
        for one in results.marginals
    ]
    columns = ("parameter", "all levels", *(f"without {level}" for level in LEVELS), "informed by")
    return parts_of(
        table(columns, rows),
        "Width of the 95 % interval of the posterior over that of the prior. A level informs a parameter "
        f"if the interval is at least {INFORMED:g} times as wide without it. The posteriors without a level "
        f"stop at R-hat {REPEATED.largest_r_hat:g}; a missing one has not converged.",
        *_residuals(results),
    )


def _residuals(results: TissuePosterior) -> list[str]:
    units = {"deflection": "mm", "dynamic": "spikes/s", "static": "spikes/s"}
    texts = [
        f"{name}: {_number(deviation.median)} {units[name]} ({_number(deviation.low)} to "
        f"{_number(deviation.high)}), correlated over {_number(length.median)} mm"
        for name, (deviation, length) in results.residuals.items()
    ]
    return [
        "Deviation of the residuals, median and 95 % interval, and median correlation length: "
        f"{'; '.join(texts)}. With this length the {len(deflection_distances_mm())} points of the deflection "
        f"inform its mean as {_number(results.effective_points, 2)} independent ones do."
    ]


def _targets(results: TissuePosterior) -> list[Part]:
    rows = [(one.name, fixed(one.probability, 2), *_interval(one.interval)) for one in results.targets]
    rows.append(("all at once", fixed(results.all_targets, 2), "", ""))
    return parts_of(
        table(("quantity and target", "probability", "posterior", "95 %"), rows),
        "Quick resolution, one bar read at shifted sites. The FSS is that in sample, where the target of the "
        "set `human` is out of sample. A Weber fraction that lies beyond the most curved pressed sphere "
        "counts as missed.",
    )


def _emulator(results: TissuePosterior) -> list[Part]:
    rows = [
        (
            one.quantity,
            _number(one.rms, 2),
            _number(one.largest, 2),
            _number(one.human, 2),
            _number(one.residual, 2),
        )
        for one in results.errors
    ]
    columns = ("quantity", "rms error", "largest", "rms error at `human`", "deviation of observations")
    parts = ", ".join(f"{name} {count}" for name, count in results.components.items())
    return parts_of(
        table(columns, rows),
        f"{results.n_tissues} tissues were pressed; {results.n_unsolved} more could not be. Errors are those "
        "of tissues that the emulator has not seen: parts of the design are left out in turn, and `human` is "
        "no point of it. Gains are scaled so that every tissue causes the currents of `human`; the stress of "
        "the emulator has its own error, which the gains of a posterior take up. "
        f"Components of each output: {parts}.",
    )


def _calibration(results: TissuePosterior) -> list[Part]:
    found: Calibration = results.calibration
    n = len(found.shares_below)
    inside = [found.inside(level) for level in COVERED]
    rows = [
        (name, *(f"{round(one[number] * n)} of {n}" for one in inside), fixed(float(mean), 2))
        for number, (name, mean) in enumerate(zip(found.names, found.shares_below.mean(axis=0), strict=True))
    ]
    rows.append(
        ("all", *(share(float(one.mean()), 0) for one in inside), fixed(found.shares_below.mean(), 2))
    )
    columns = ("parameter", *(f"inside {level:.0%}" for level in COVERED), "mean share of draws below")
    wrong = found.wrong()
    verdict = (
        f"Not that of the level, by binomial tests: {joined(wrong)}."
        if wrong
        else "No coverage differs from its level by a binomial test at 1 %, shared by all rows."
    )
    return parts_of(
        table(columns, rows),
        "Synthetic experiments: tissues of the design, computed from their presses; residuals of the size "
        "and correlation given above. The posterior uses an emulator that has not seen the tissue. Tissues "
        "are uniform in the prior's ranges; the afferent is drawn near that of `human`, so that rates and "
        f"hit rates resemble the observed ones. {results.unsolved} further experiments have not converged. "
        f"{verdict}",
    )
