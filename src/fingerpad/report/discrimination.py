"""Level 3, Figures 7 and 8: how often spheres are told from the standard."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerpad.core.checks import FloatArray
from fingerpad.data import psychophysics
from fingerpad.report.formatting import number
from fingerpad.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    new_figure,
    numbers,
    say_nothing_to_draw,
)

CHANCE = 0.5
POSITIONS: tuple[tuple[str, dict[str, Any], str], ...] = (
    ("", {"color": BLUE, "linestyle": "-", "marker": "o"}, "predicted, sphere at 0.0 mm"),
    ("_shifted", {"color": ORANGE, "linestyle": ":", "marker": "s"}, "predicted, sphere at 0.2 mm"),
)
CODES = {
    "static": "Gradient Sum, static",
    "dynamic": "Gradient Sum, dynamic",
    "latency": "Gradient Sum, latency",
    "euclidean": "Euclidean, static",
}
CODE_STYLES: tuple[dict[str, Any], ...] = (
    {"color": BLUE, "linestyle": "-"},
    {"color": ORANGE, "linestyle": "--"},
    {"color": GREEN, "linestyle": "-."},
    {"color": BLACK, "linestyle": ":"},
)
Panel = tuple[str, dict[str, Any] | None]


def draw_observers(section: dict[str, Any]) -> Figure:
    """Draw Figure 7: codes, noise levels and repetitions, one panel each.

    Parameters
    ----------
    section : dict
        `results["discrimination"]`.

    Returns
    -------
    Figure
    """
    return _draw(section, observer_panels(section), columns=4)


def draw_criterion(section: dict[str, Any]) -> Figure:
    """Draw Figure 8: the decision criterion varies from trial to trial.

    Parameters
    ----------
    section : dict
        `results["discrimination"]`.

    Returns
    -------
    Figure
    """
    return _draw(section, criterion_panels(section), columns=2)


def draw_noise(section: dict[str, Any]) -> Figure:
    """Draw how well each code meets people over the noise, and the sweep of the paper's range.

    Parameters
    ----------
    section : dict
        `results["discrimination"]`.

    Returns
    -------
    Figure
    """
    figure = new_figure(11.0, 4.4)
    codes, sweep = figure.subplots(1, 2, sharey=True)
    curve = section["reasons"]["misfit_curve"]
    for (name, label), style in zip(CODES.items(), CODE_STYLES, strict=True):
        if name in curve["misfit"]:
            codes.plot(numbers(curve["noise_sigma"]), numbers(curve["misfit"][name]), label=label, **style)
    codes.set_title("(a) each code, both positions together, expected")
    swept = section["statistics"]["sweep"]
    for misfit, (_, style, label) in zip(swept["misfit"], POSITIONS, strict=True):
        sweep.errorbar(
            numbers(swept["noise_sigma"]),
            numbers([one["value"] for one in misfit]),
            yerr=np.nan_to_num(numbers([one["error"] for one in misfit])),
            markersize=5.0,
            capsize=3.0,
            label=label.removeprefix("predicted, "),
            **style,
        )
    sweep.set_title("(b) static Gradient Sum, whole protocol")
    marked = {"paper's best": section["noise_sigma_paper"], "our fit": section["noise_sigma"]}
    for axes in (codes, sweep):
        for (label, sigma), dashes in zip(marked.items(), ((6, 3), (1, 1)), strict=True):
            if sigma is not None:
                axes.axvline(float(sigma), color=GREY, linewidth=1.4, linestyle=(0, dashes), label=label)
        axes.set_xlabel("noise σ₁ [fraction of the response]")
        axes.set_ylim(bottom=0.0)
    codes.set_ylabel("distance to people's hit rates, rms [fraction]")
    sweep.set_xlim(left=0.0)
    codes.legend(loc="upper right")
    sweep.legend()
    return figure


def caption_noise(section: dict[str, Any]) -> str:
    """Say what the sweep of the noise shows, and why ours is larger."""
    rise, needed = (section["reasons"][key]["static"][0] for key in ("rise", "rise_for_paper_noise"))
    people = (
        f"; with σ₁ = {number(section['noise_sigma_paper'])}, {_percent(needed)} would do for people's 0.95"
        if needed is not None
        else ""
    )
    return (
        "Root mean square distance of predicted hit rates to people's at 296 and 365 1/m over the noise. "
        "(a) Every code has a noise of its own that fits people best. (b) The range that the paper tried, in "
        f"{number(section['sessions'])} sessions of the whole protocol; bars are Monte-Carlo errors. The "
        "best noise makes up for how steeply a code rises with curvature: our static Gradient Sum rises by "
        f"{_percent(rise)} from 287 to 365 1/m{people}."
    )


def _percent(share: float | None) -> str:
    return "an unknown share" if share is None else f"{100.0 * share:.0f} %"


def observer_panels(section: dict[str, Any]) -> list[Panel]:
    r"""Return titles and hit rates of Figure 7, in the paper's order; a panel it does not have comes last.

    Examples
    --------
    >>> variants = {"ten_matrices": {}, "sigma_0.055": {}, "sigma_0.025": {}}
    >>> section = {"noise_sigma": 0.12, "variants": variants}
    >>> [title for title, _ in observer_panels(section)][4:]
    ['Gradient Sum, static\nσ₁ = 0.025', 'Gradient Sum, static\nσ₁ = 0.12, 10 matrices',
     'Gradient Sum, static\nσ₁ = 0.055']
    """
    sums, variants = section.get("gradient_sum", {}), section.get("variants", {})
    best = f"σ₁ = {number(section.get('noise_sigma'))}"
    printed = f"sigma_{section.get('noise_sigma_paper') or psychophysics.NOISE_SIGMA.value}"
    shown = [f"sigma_{sigma:g}" for sigma in psychophysics.NOISE_SIGMA_SHOWN.value]
    levels = [name for name in shown if name in variants and name != printed]
    panels: list[Panel] = [
        (f"Gradient Sum, static\n{best}", sums.get("static")),
        (f"Gradient Sum, dynamic\n{best}", sums.get("dynamic")),
        (f"Gradient Sum, latency\n{best}", sums.get("latency")),
        (f"Euclidean, static\n{best}", section.get("euclidean", {}).get("static")),
    ]
    panels += [
        (f"Gradient Sum, static\nσ₁ = {name.removeprefix('sigma_')}", variants[name]) for name in levels
    ]
    if "ten_matrices" in variants:
        panels.append((f"Gradient Sum, static\n{best}, 10 matrices", variants["ten_matrices"]))
    if printed in variants:
        panels.append((f"Gradient Sum, static\nσ₁ = {printed.removeprefix('sigma_')}", variants[printed]))
    return panels


def criterion_panels(section: dict[str, Any]) -> list[Panel]:
    """Return titles and hit rates of Figure 8."""
    variants = section.get("variants", {})
    names = sorted(name for name in variants if name.startswith("criterion_"))
    return [(f"β varies by {name.removeprefix('criterion_')}", variants[name]) for name in names]


def _draw(section: dict[str, Any], panels: list[Panel], columns: int) -> Figure:
    rows = max(1, -(-len(panels) // columns))
    figure = new_figure(11.0 if columns > 2 else 10.0, 3.1 * rows + 0.5)
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    comparison = numbers(section["curvature_per_m"])[1:]
    for index, axes in enumerate(grid.flat):
        if index >= len(panels):
            axes.set_axis_off()
            continue
        title, rates = panels[index]
        axes.set_title(f"({'abcdefghijklmnop'[index]}) {title}", fontsize=10.0)
        if not rates:
            say_nothing_to_draw(axes, "not computed")
            continue
        axes.axhline(CHANCE, color=GREY, linewidth=1.0, linestyle=(0, (6, 3)), label="chance")
        _curves(axes, comparison, rates)
        _people(axes, section.get("goodwin"))
    _label(figure, grid, len(panels))
    return figure


def _curves(axes: Axes, comparison: FloatArray, rates: dict[str, Any]) -> None:
    for suffix, style, label in POSITIONS:
        if rates.get(f"hit_rate{suffix}") is None:
            continue
        axes.errorbar(
            comparison,
            numbers(rates[f"hit_rate{suffix}"]),
            yerr=_spread(rates.get(f"hit_rate{suffix}_sd"), comparison.size),
            markersize=4.0,
            linewidth=1.5,
            elinewidth=1.0,
            capsize=3.0,
            label=label,
            **style,
        )


def _spread(values: Any, size: int) -> FloatArray:
    """Lengths of the error bars: none where no spread is known."""
    return np.nan_to_num(numbers(values)) if values is not None else np.zeros(size)


def _people(axes: Axes, observed: dict[str, Any] | None) -> None:
    if observed:
        rates = numbers(observed["hit_rate"])
        axes.errorbar(
            numbers(observed["curvature_per_m"]),
            rates,
            yerr=[rates - numbers(observed["low"]), numbers(observed["high"]) - rates],
            fmt="D",
            elinewidth=1.2,
            capsize=4.0,
            markersize=7.5,
            color=BLACK,
            markerfacecolor="none",
            markeredgewidth=1.6,
            zorder=5,
            label="people (Goodwin et al. 1991)",
        )


def _interval(observed: dict[str, Any]) -> str:
    """Say what the bars of people are."""
    return f"binomial 95 % intervals as of {number(observed['trials'])} trials, a number that is assumed"


def _label(figure: Figure, grid: np.ndarray, n_panels: int) -> None:
    for axes in grid[:, 0]:
        axes.set_ylabel("hit rate [fraction]")
    for index, axes in enumerate(grid.flat):
        if n_panels - grid.shape[1] <= index < n_panels:
            axes.set_xlabel("comparison curvature [1/m]")
            axes.tick_params(labelbottom=True)
    lowest, highest = grid[0, 0].get_ylim()
    grid[0, 0].set_ylim(min(lowest, 0.4), max(highest, 1.05))
    handles: dict[str, Any] = {}
    for axes in grid.flat:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    if handles:
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=len(handles))


def caption_observers(section: dict[str, Any]) -> str:
    """Say what Figure 7 shows and what the paper found."""
    ours, theirs = (
        section.get("noise_sigma"),
        section.get("noise_sigma_paper") or psychophysics.NOISE_SIGMA.value,
    )
    return (
        "Fraction of trials in which a sphere is told from the standard of "
        f"{number(section['curvature_per_m'][0])} 1/m; bars are one standard deviation. Solid: sphere over "
        "the middle of the receptors; dotted: 0.2 mm away. Diamonds: people, with "
        f"{_interval(section['goodwin'])}. (a-c) Gradient Sum of static "
        "rates, dynamic rates and first-spike latencies, (d) Euclidean Distance of static rates, all with "
        f"noise σ₁ = {number(ours)}; the paper's best noise is {number(theirs)}. The following panels vary "
        "the noise or the number of noise matrices, as their titles say. The paper found that the static "
        "Gradient Sum fits people best and hardly minds the shift, that dynamic rates and latencies do mind "
        "it, that more noise lowers the curve, and that fewer matrices widen the bars."
    )


def caption_criterion(section: dict[str, Any]) -> str:
    """Say what Figure 8 shows and what the paper found."""
    return (
        "Gradient Sum of static rates once more, but for each hit rate the decision point is multiplied by "
        "a new normal variable with mean 1 and the standard deviation in the title. The paper found that "
        "the wider distribution lengthens the error bars and leaves the means alone. Noise σ₁ = "
        f"{number(section.get('noise_sigma'))}. Diamonds: people, with {_interval(section['goodwin'])}."
    )
