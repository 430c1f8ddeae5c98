"""Beyond the paper: the least curvature told apart, from standard to standard.

    JND(s) = c - s,    where the comparison c is told from the standard s in 75 % of trials
    Weber fraction = JND / s

A few spheres are pressed; between them the rates of every receptor are interpolated in the logarithm of the
curvature (monotone cubic), so that any sphere can be a standard or a comparison.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import ConvergenceError
from fingerpad.core.random_streams import Purpose, normals
from fingerpad.data import psychophysics
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.gerling2014.claim_row import MATERIALS, ClaimRow, claim_row
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.psychophysics import (
    d_prime_of_proportion,
    fit_psychometric,
    gaussian_information,
    posterior,
    yes_no,
)
from fingerpad.psychophysics.encoding import gradient_sum, neighbour_pairs
from fingerpad.psychophysics.noise_fit import NOISE_DRAWS, expected_hit_rates, fit_noise_sigma
from fingerpad.skin.sampling import SkinResponse

STANDARDS_PER_M = (144.0, 200.0, 287.0, 400.0)
PRESSED_PER_M = (144.0, 165.0, 190.0, 218.0, 250.0, 400.0, 445.0, 540.0)
"""Beside the paper's spheres: they reach from the least standard to beyond what the greatest is told from."""

LAYOUTS = {"paper": (3, 6), "square": (6, 6)}
"""Receptors along the finger and across: the paper's 18, and as many along as across, which see all sides of
a sphere that is flat and touches more skin."""

STEPS = (0.03, 0.06, 0.09, 0.12, 0.16, 0.21)
"""Comparisons of an experiment: how much more curved than the standard, as a share of it."""

PROPORTION = 0.75
JUDGEMENTS = int(psychophysics.GOODWIN_TRIALS.value)
"""Per comparison of an experiment."""

LEFT_OUT_PER_M = (296.0, 305.0, 316.0, 328.0, 340.0)
"""Spheres that are also foretold from the others, to see what interpolation is worth."""


def touches(conditions: Conditions) -> dict[float, Touch]:
    """Spheres that the paper does not have; keys are curvatures. [1/m]"""
    return sphere_touches(conditions, PRESSED_PER_M)


def sphere_touches(conditions: Conditions, curvatures_per_m: Sequence[float]) -> dict[float, Touch]:
    """Spheres pressed like the paper's own at 0.0 mm; keys are curvatures. [1/m]"""
    return {curvature: conditions.sphere_touch(curvature) for curvature in curvatures_per_m}


def result(
    responses: Mapping[float, SkinResponse], afferent: Afferent, noise_sigma: float, seed: int
) -> dict[str, Any]:
    """Thresholds of the static Gradient Sum at several standards.

    Parameters
    ----------
    responses : mapping
        From curvature to solved touch at 0.0 mm: `touches`, and the paper's spheres. [1/m]
    afferent : Afferent
        All of the population.
    noise_sigma : float
        Standard deviation of the multiplicative noise, as fitted to Goodwin's two points.
    seed : int
        Of the random numbers.

    Returns
    -------
    dict
        Plain numbers, units in the names.
    """
    curvatures = np.array(sorted(responses))
    populations = [
        _thresholds_of(name, responses, curvatures, afferent, noise_sigma if name == "paper" else None, seed)
        for name in LAYOUTS
    ]
    population = _population("paper", afferent)
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
    static = np.array([population.respond(responses[at]).static_rate_hz for at in curvatures.tolist()])
    return {
        "seed": seed,
        "proportion": PROPORTION,
        "judgements": JUDGEMENTS,
        "pressed_per_m": curvatures,
        "populations": populations,
        "literature": {
            "standard_per_m": psychophysics.THRESHOLD_STANDARDS.value,
            "comparison_per_m": psychophysics.THRESHOLD_COMPARISONS.value,
            "weber_fractions": psychophysics.WEBER_FRACTIONS.value,
        },
        "interpolation": interpolation_errors(curvatures, static, neighbours),
    }


def _population(name: str, afferent: Afferent) -> Population:
    rows, columns = LAYOUTS[name]
    return Population.grid(rows=rows, columns=columns, centre_mm=(RECEPTOR_X_MM, 0.0), afferent=afferent)


def _thresholds_of(
    name: str,
    responses: Mapping[float, SkinResponse],
    curvatures: FloatArray,
    afferent: Afferent,
    noise_sigma: float | None,
    seed: int,
) -> dict[str, Any]:
    """Thresholds of one population at every standard; its noise is fitted to people unless it is given."""
    population = _population(name, afferent)
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
    static = np.array([population.respond(responses[c]).static_rate_hz for c in curvatures.tolist()])
    draws = normals(seed, 1, len(population.positions_mm), Purpose.RESPONSE, NOISE_DRAWS)[0].T
    found: list[dict[str, Any]] = []
    missed: list[dict[str, Any]] = []
    try:
        noise = _fitted_noise(curvatures, static, neighbours, draws) if noise_sigma is None else noise_sigma
    except ConvergenceError as error:
        noise, missed = math.nan, [{"standard_per_m": None, "why_not": _first_line(error)}]
    observer = Observer(interpolated(curvatures, static), neighbours, noise, draws)
    for standard in STANDARDS_PER_M if math.isfinite(noise) else ():
        try:
            found.append(threshold_at(observer, standard))
        except ConvergenceError as error:
            missed.append({"standard_per_m": standard, "why_not": _first_line(error)})
    return {
        "layout": name,
        "rows": LAYOUTS[name][0],
        "columns": LAYOUTS[name][1],
        "noise_sigma": noise,
        "gradient_sum": gradient_sum(static, neighbours),
        "standards": found,
        "without_threshold": missed,
    }


def _fitted_noise(
    curvatures: FloatArray, static: FloatArray, neighbours: np.ndarray, draws: FloatArray
) -> float:
    """Noise with which a population meets Goodwin's two points."""
    spheres = (psychophysics.SPHERE_287.value, *psychophysics.GOODWIN_CURVATURES.value)
    table = static[[int(np.flatnonzero(curvatures == sphere)[0]) for sphere in spheres]]
    return fit_noise_sigma(lambda sigma: expected_hit_rates(table, neighbours, sigma, draws)).noise_sigma


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0]


def weber_rows(section: Mapping[str, Any] | None) -> list[ClaimRow]:
    """Hold Weber fractions beside people's, a row per population; none where nothing was pressed."""
    if not section:
        return []
    low, high = section["literature"]["weber_fractions"]
    rows = []
    for population in section["populations"]:
        found = [entry["weber_fraction"] for entry in population["standards"]]
        at = ", ".join(f"{entry['standard_per_m']:g}" for entry in population["standards"])
        missed = [entry["why_not"] for entry in population["without_threshold"]]
        rows.append(
            claim_row(
                f"Curvature told apart in 75 %, {population['rows']} by {population['columns']} receptors",
                f"people: {low:.0%} to {high:.0%} of the standard",
                ", ".join(f"{fraction:.1%}" for fraction in found),
                "",
                MATERIALS + "; people's fractions recalled",
                bool(found) and not missed and all(low <= round(share, 2) <= high for share in found),
                "; ".join([f"static Gradient Sum, standards {at} /m; judged in whole per cent", *missed]),
            )
        )
    return rows


def interpolated(curvature_per_m: FloatArray, table: FloatArray) -> PchipInterpolator:
    """Rates (n_receptors,) as a function of the logarithm of the curvature."""
    return PchipInterpolator(np.log(curvature_per_m), table)


class Observer:
    """Tells spheres apart by the Gradient Sum of interpolated rates.

    Parameters
    ----------
    rates : callable
        From the logarithm of the curvature to rates (n_receptors,).
    neighbours : int array (n_pairs, 2)
        Of the population.
    noise_sigma : float
        Standard deviation of the multiplicative noise.
    draws : array (n_draws, n_receptors)
        Standard normal numbers that serve every sphere.
    """

    def __init__(
        self, rates: PchipInterpolator, neighbours: np.ndarray, noise_sigma: float, draws: FloatArray
    ):
        self.rates, self.neighbours, self.noise_sigma, self.draws = rates, neighbours, noise_sigma, draws

    def responses(self, curvature_per_m: float) -> FloatArray:
        """Rates (n_receptors,) under a sphere. [spikes/s]"""
        return self.rates(np.log(curvature_per_m))

    def slopes(self, curvature_per_m: float) -> FloatArray:
        """Return the derivatives of the rates (n_receptors,) by the curvature. [spikes/s m]"""
        return self.rates(np.log(curvature_per_m), 1) / curvature_per_m

    def hit_rate(self, standard_per_m: float, comparison_per_m: float) -> float:
        """How often the comparison is told from the standard."""
        pair = [self.responses(standard_per_m), self.responses(comparison_per_m)]
        return float(expected_hit_rates(pair, self.neighbours, self.noise_sigma, self.draws)[0])


def threshold_at(observer: Observer, standard_per_m: float) -> dict[str, Any]:
    """Just noticeable difference at a standard, and what an experiment would find there.

    Parameters
    ----------
    observer : Observer
        Who judges.
    standard_per_m : float
        Curvature of the standard. [1/m]

    Returns
    -------
    dict
        The model's own threshold, and threshold and interval of a psychometric function of the difference
        (Weibull's) through the counts of an experiment. The ideal observer's threshold is that of Fisher's
        information.

    Raises
    ------
    ConvergenceError
        If no pressed sphere is told from the standard often enough.
    """
    farthest = float(np.exp(observer.rates.x[-1]))

    def missing(comparison_per_m: float) -> float:
        return observer.hit_rate(standard_per_m, comparison_per_m) - PROPORTION

    if missing(farthest) <= 0.0:
        raise ConvergenceError(
            f"No sphere up to {farthest:g} /m is told from {standard_per_m:g} /m in {PROPORTION:.0%} of "
            "trials: press spheres that are more curved, or lower the noise."
        )
    jnd_per_m = float(brentq(missing, standard_per_m, farthest, xtol=1e-3)) - standard_per_m

    steps = np.array([step for step in STEPS if standard_per_m * (1.0 + step) <= farthest])
    hit_rate = np.array([observer.hit_rate(standard_per_m, standard_per_m * (1.0 + step)) for step in steps])
    counts = np.round(JUDGEMENTS * hit_rate)
    fit = fit_psychometric(steps, counts, np.full(steps.size, JUDGEMENTS), sigmoid="weibull", lapse=0.0)
    at = np.linspace(0.0, 1.05 * steps[-1], 61)[1:]
    rates, slopes = observer.responses(standard_per_m), observer.slopes(standard_per_m)
    heard = rates > 0.0  # noise that multiplies silence is none: docs/decisions/ideal-observer.md
    information = gaussian_information(rates[heard], slopes[heard], observer.noise_sigma)
    ideal_jnd_per_m = d_prime_of_proportion(PROPORTION, yes_no) / np.sqrt(information)
    return {
        "standard_per_m": standard_per_m,
        "jnd_per_m": jnd_per_m,
        "weber_fraction": jnd_per_m / standard_per_m,
        "ideal_weber_fraction": float(ideal_jnd_per_m) / standard_per_m,
        "step": steps,
        "hit_rate": hit_rate,
        "fitted_weber_fraction": fit.threshold(PROPORTION),
        "fitted_interval": posterior(fit).threshold_interval(PROPORTION),
        "curve": {"step": at, "hit_rate": fit.predict(at)},
    }


def interpolation_errors(
    curvature_per_m: FloatArray, table: FloatArray, neighbours: np.ndarray
) -> list[dict[str, float]]:
    """Say what the Gradient Sum of some pressed spheres would be if they had been interpolated.

    Parameters
    ----------
    curvature_per_m : array (n_spheres,)
        Increasing. [1/m]
    table : array (n_spheres, n_receptors)
        Rates. [spikes/s]
    neighbours : int array (n_pairs, 2)
        Of the population.

    Returns
    -------
    list of dict
        `curvature_per_m`, the sum as `pressed` and `foretold` [spikes/s], and the error as a curvature, by
        the rise of the sum there: `error_per_m`.
    """
    sums = gradient_sum(table, neighbours)
    rise = np.gradient(sums, curvature_per_m)
    found = []
    for row in np.flatnonzero(np.isin(curvature_per_m, LEFT_OUT_PER_M)):
        others = np.arange(curvature_per_m.size) != row
        rates = interpolated(curvature_per_m[others], table[others])(np.log(curvature_per_m[row]))
        foretold = float(gradient_sum(rates, neighbours))
        found.append(
            {
                "curvature_per_m": float(curvature_per_m[row]),
                "pressed": float(sums[row]),
                "foretold": foretold,
                "error_per_m": float((foretold - sums[row]) / rise[row]) if rise[row] else math.nan,
            }
        )
    return found
