"""Beyond the paper: the least curvature told apart, from standard to standard, and how good each code is.

    JND(s) = c - s,    where the comparison c is told from the standard s in 75 % of trials
    Weber fraction = JND / s

A few spheres are pressed; between them the rates of every receptor are interpolated in the logarithm of the
curvature (monotone cubic), so that any sphere can be a standard or a comparison.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from fingerpad.afferent import Afferent
from fingerpad.checks import FloatArray
from fingerpad.encoding import distance, gradient_sum, neighbour_pairs
from fingerpad.errors import ConvergenceError
from fingerpad.indenters import Sphere
from fingerpad.noise_fit import expected_hit_rates
from fingerpad.parameters import protocol, psychophysics
from fingerpad.population import Population
from fingerpad.psychophysics import (
    PoissonResponses,
    Presentation,
    ResponseModel,
    d_prime_of_proportion,
    efficiency,
    fit_psychometric,
    gaussian_information,
    goodness_of_fit,
    multiplied_responses,
    posterior,
    present,
    yes_no,
)
from fingerpad.random_streams import Purpose, normals
from fingerpad.sampling import SkinResponse
from fingerpad.studies.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.studies.sphere_discrimination import MEASURES, NOISE_DRAWS

STANDARDS_PER_M = (144.0, 200.0, 287.0, 400.0)
PRESSED_PER_M = (144.0, 165.0, 190.0, 218.0, 250.0, 400.0, 445.0, 495.0)
"""Beside the paper's spheres: they reach from the least standard to beyond what the greatest is told from."""

STEPS = (0.03, 0.06, 0.09, 0.12, 0.16, 0.21)
"""Comparisons of an experiment: how much more curved than the standard, as a share of it."""

PROPORTION = 0.75
JUDGEMENTS = 100
"""Per comparison of an experiment; those of people are not known."""

LEFT_OUT_PER_M = (296.0, 305.0, 316.0, 328.0, 340.0)
"""Spheres that are also foretold from the others, to see what interpolation is worth."""

EFFICIENCY_PAIR_PER_M = (287.0, 316.0)
"""Two spheres near the threshold of people, at which codes are measured."""

TRIALS = 4000
"""Presentations of each sphere to the observers whose efficiency is measured."""

SESSION, REFERENCE_SESSION = 11, 12
"""Of the random numbers; other studies have others."""


def touches(conditions: Conditions) -> dict[float, Touch]:
    """Spheres that the paper does not have, pressed like its own at 0.0 mm; keys are curvatures."""
    return {
        curvature: conditions.touch(
            Sphere(curvature), RECEPTOR_X_MM, conditions.sphere_grading(), tilt_deg=conditions.skin_tilt_deg
        )
        for curvature in PRESSED_PER_M
    }


def result(
    responses: Mapping[float, SkinResponse], afferent: Afferent, noise_sigma: float, seed: int
) -> dict[str, Any]:
    """Thresholds of the static Gradient Sum at several standards, and the efficiency of every code.

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
    population = Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0))
    curvatures = np.array(sorted(responses))
    answers = [population.respond(responses[curvature]) for curvature in curvatures.tolist()]
    tables = {name: np.array([measure(answer) for answer in answers]) for name, measure in MEASURES.items()}
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
    draws = normals(seed, 1, len(population.positions_mm), Purpose.RESPONSE, NOISE_DRAWS)[0].T
    rates = interpolated(curvatures, tables["static"])
    observer = Observer(rates, neighbours, noise_sigma, draws)
    thresholds = [threshold_at(observer, standard, seed) for standard in STANDARDS_PER_M]
    return {
        "seed": seed,
        "noise_sigma": noise_sigma,
        "proportion": PROPORTION,
        "judgements": JUDGEMENTS,
        "pressed_per_m": curvatures,
        "standards": thresholds,
        "literature": {
            "standard_per_m": psychophysics.THRESHOLD_STANDARDS.value,
            "comparison_per_m": psychophysics.THRESHOLD_COMPARISONS.value,
            "weber_fractions": psychophysics.WEBER_FRACTIONS.value,
        },
        "interpolation": interpolation_errors(curvatures, tables["static"], neighbours),
        "efficiency": efficiencies(curvatures, tables, neighbours, noise_sigma, seed),
    }


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


def threshold_at(observer: Observer, standard_per_m: float, seed: int) -> dict[str, Any]:
    """Just noticeable difference at a standard, and what an experiment would find there.

    Parameters
    ----------
    observer : Observer
        Who judges.
    standard_per_m : float
        Curvature of the standard. [1/m]
    seed : int
        Of the goodness of fit.

    Returns
    -------
    dict
        The model's own threshold, and threshold, interval and goodness of fit of a psychometric function of
        the difference (Weibull's) through the counts of an experiment. The ideal observer's threshold is that
        of Fisher's information.

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
    nearest = 1.001 * standard_per_m
    jnd_per_m = float(brentq(missing, nearest, farthest, xtol=1e-3)) - standard_per_m

    steps = np.array([step for step in STEPS if standard_per_m * (1.0 + step) <= farthest])
    hit_rate = np.array([observer.hit_rate(standard_per_m, standard_per_m * (1.0 + step)) for step in steps])
    counts = np.round(JUDGEMENTS * hit_rate)
    fit = fit_psychometric(steps, counts, np.full(steps.size, JUDGEMENTS), sigmoid="weibull", lapse=0.0)
    at = np.linspace(0.0, 1.05 * steps[-1], 61)[1:]
    information = gaussian_information(
        observer.responses(standard_per_m), observer.slopes(standard_per_m), observer.noise_sigma
    )
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
        "fit_p_value": goodness_of_fit(fit, seed, 400).p_value,
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
                "error_per_m": float((foretold - sums[row]) / rise[row]),
            }
        )
    return found


def efficiencies(
    curvature_per_m: FloatArray,
    tables: Mapping[str, FloatArray],
    neighbours: np.ndarray,
    noise_sigma: float,
    seed: int,
) -> list[dict[str, Any]]:
    """Measure codes against the ideal observer of the same responses, on two spheres near people's threshold.

    Parameters
    ----------
    curvature_per_m : array (n_spheres,)
        Increasing, both spheres of `EFFICIENCY_PAIR_PER_M` among them. [1/m]
    tables : mapping of str to array (n_spheres, n_receptors)
        Static and dynamic rates, and latencies. [spikes/s or ms]
    neighbours : int array (n_pairs, 2)
        Of the population.
    noise_sigma : float
        Standard deviation of the multiplicative noise.
    seed : int
        Of the random numbers.

    Returns
    -------
    list of dict
        One row per code, measure and kind of noise. A receptor that is silent under one of the spheres has no
        noise that multiplies, and would tell them apart for certain: it is left out, for all observers.
    """
    rows = [int(np.flatnonzero(curvature_per_m == curvature)[0]) for curvature in EFFICIENCY_PAIR_PER_M]
    found = []
    for measure, table in tables.items():
        standard, comparison = table[rows]
        heard = (standard > 0.0) & (comparison > 0.0)
        if not heard.any():
            continue
        models = [multiplied_responses(rates[heard], noise_sigma) for rates in (standard, comparison)]
        found += _observed(measure, "multiplied", models, heard, neighbours, seed)
    window_ms = protocol.STATIC_WINDOW.value
    seconds = (window_ms[1] - window_ms[0]) / 1000.0
    counts = [PoissonResponses(tables["static"][row] * seconds) for row in rows]
    everyone = np.ones(len(tables["static"][0]), dtype=bool)
    return found + _observed("static", "Poisson", counts, everyone, neighbours, seed)


def _observed(
    measure: str,
    noise: str,
    models: list[Any],
    heard: np.ndarray,
    neighbours: np.ndarray,
    seed: int,
) -> list[dict[str, Any]]:
    """Measure both codes on responses with one kind of noise."""
    standard: ResponseModel = models[0]
    comparison: ResponseModel = models[1]
    shown = present(standard, comparison, seed, TRIALS, SESSION)
    # The standard again, which Euclidean Distance compares every look with.
    reference = present(standard, standard, seed, TRIALS, REFERENCE_SESSION).standard
    codes = {
        "Gradient Sum": lambda responses: gradient_sum(_placed(responses, heard), neighbours),
        "Euclidean Distance": lambda responses: distance(responses, reference),
    }
    return [_row(code, measure, noise, shown, statistic, heard) for code, statistic in codes.items()]


def _placed(responses: FloatArray, heard: np.ndarray) -> FloatArray:
    """Responses (n_trials, n_receptors) of all receptors, 0 for those that are left out."""
    everyone = np.zeros((len(responses), heard.size))
    everyone[:, heard] = responses
    return everyone


def _row(
    code: str, measure: str, noise: str, shown: Presentation, statistic: Any, heard: np.ndarray
) -> dict[str, Any]:
    judged, ideal = shown.of(statistic), shown.ideal()
    share, error = efficiency(judged, ideal)
    return {
        "code": code,
        "measure": measure,
        "noise": noise,
        "receptors": int(heard.sum()),
        "proportion_correct": judged.proportion_correct,
        "d_prime": judged.d_prime,
        "d_prime_error": judged.d_prime_error,
        "ideal_proportion_correct": ideal.proportion_correct,
        "ideal_d_prime": ideal.d_prime,
        "ideal_d_prime_error": ideal.d_prime_error,
        "efficiency": share,
        "efficiency_error": error,
    }
