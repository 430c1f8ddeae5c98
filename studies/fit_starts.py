"""Level 2, where the fit starts: what the printed gains mean, and the paper's session, fold 3, start 2."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Matrix, Number, Vector, result_class
from fingerpad.core.signals import SedTraces
from fingerpad.core.units import MS_PER_S
from fingerpad.data import neuron, paper
from fingerpad.inference.fitting.cross_validation import interleaved_folds
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.start_points import printed_starts, response_surface

PER_KPA = {"MPa": 1.0e-3, "kPa": 1.0, "Pa": 1.0e3}
"""Energy density in each unit for one in kPa."""

SESSION_FOLD, SESSION_START = 3, 2
"""The session of the paper's Table 4, counted from 1."""

PRINTED = np.array([1.0, 1.0])
ENERGY_SCALES = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)
DYNAMIC_RATIOS = (1.0, 1.0e3, 2.5e3, 5.0e3, 1.0e4, 1.5e4, 2.5e4)
"""Factors on energy density, which multiply both gains, and further factors on k_d. [1]"""

SEARCHED_SCALES = np.arange(1.0, 12.01, 0.1)
"""Factors on energy density among which the one is sought that gives the paper's FSS at the start."""


@result_class
class StartRates:
    """What the afferent does at a start point.

    Parameters
    ----------
    fss : float
        Over all shifts. [1]
    largest_dynamic_hz, largest_static_hz : float
        Largest predicted rates. [spikes/s]
    """

    fss: Number
    largest_dynamic_hz: Number
    largest_static_hz: Number


@result_class
class UnitOfDrive:
    """Both printed start points with the drive in one unit.

    Parameters
    ----------
    quantity, unit : str
        What drives the afferent, and its unit.
    start_1, start_2 : StartRates
        At each start point.
    """

    quantity: str
    unit: str
    start_1: StartRates
    start_2: StartRates


@result_class
class ScaledStarts:
    """FSS at the first start point with its gains rescaled.

    Parameters
    ----------
    energy_scale, dynamic_ratio : array (n_scales,), (n_ratios,)
        Factors on both gains, and further factors on k_d. [1]
    fss_start_1 : array (n_scales, n_ratios)
        Over all shifts. [1]
    """

    energy_scale: Vector
    dynamic_ratio: Vector
    fss_start_1: Matrix


@result_class
class Session:
    """One fit of fold 3 from the second start point.

    Parameters
    ----------
    start : str
        How the gains of the start are rescaled.
    static_scale, dynamic_scale : float
        Factors on the printed k_s and k_d. [1]
    fss_start, fss_train, fss_test : float
        At the start and at the end, over training and testing shifts. [1]
    iterations, runs : int
        Steps of the fit, and runs of the model.
    largest_dynamic_hz, largest_static_hz : float
        Largest predicted rates of the fit. [spikes/s]
    """

    start: str
    static_scale: Number
    dynamic_scale: Number
    fss_start: Number
    fss_train: Number
    fss_test: Number
    iterations: int
    runs: int
    largest_dynamic_hz: Number
    largest_static_hz: Number


@result_class
class FitStarts:
    """Where the fit starts.

    Parameters
    ----------
    units : tuple of UnitOfDrive
        The printed start points in each unit.
    scales : ScaledStarts
        The first start point rescaled.
    sessions : tuple of Session
        The paper's session from several starts.
    """

    units: tuple[UnitOfDrive, ...]
    scales: ScaledStarts
    sessions: tuple[Session, ...]


def result(problem: RateProblem, von_mises: SedTraces) -> FitStarts:
    """Try the printed starts in each unit, and the paper's session from several starts.

    Parameters
    ----------
    problem : RateProblem
        Observed rates under the bar, and the paper's model driven by strain energy density.
    von_mises : SedTraces
        Von Mises stress at the receptor in place of the energy density. [kPa]

    Returns
    -------
    FitStarts
    """
    stress = replace(problem, model=AfferentModel.of_traces(von_mises))
    driven = {"strain energy density": problem, "von Mises stress": stress}
    return FitStarts(
        units=tuple(_in_unit(name, one, unit) for name, one in driven.items() for unit in PER_KPA),
        scales=_scales(problem),
        sessions=tuple(_session(problem, name, scales) for name, scales in _session_scales(problem).items()),
    )


def scaled_start(start: int, static_scale: float, dynamic_scale: float) -> FloatArray:
    """One of the paper's start points, its gains multiplied.

    Parameters
    ----------
    start : int
        1 or 2.
    static_scale, dynamic_scale : float
        Factors on the printed k_s and k_d. [1]
    """
    printed = printed_starts()[start - 1]
    return printed * [1.0, dynamic_scale, static_scale, 1.0, 1.0, 1.0]


def _in_unit(quantity: str, problem: RateProblem, unit: str) -> UnitOfDrive:
    """FSS and largest rates at the printed starts if the drive is counted in `unit`."""
    first, second = (
        _at_start(problem, scaled_start(start, PER_KPA[unit], PER_KPA[unit])) for start in (1, 2)
    )
    return UnitOfDrive(quantity=quantity, unit=unit, start_1=first, start_2=second)


def _at_start(problem: RateProblem, parameters: FloatArray) -> StartRates:
    dynamic, static = problem.model.evaluate(parameters)
    return StartRates(
        fss=problem.score(parameters, np.arange(problem.n_observations)),
        largest_dynamic_hz=dynamic.max(),
        largest_static_hz=static.max(),
    )


def _scales(problem: RateProblem) -> ScaledStarts:
    """FSS of the first start over all shifts, (n_energy_scales, n_dynamic_ratios)."""
    everything = np.arange(problem.n_observations)
    fss = [
        [problem.score(scaled_start(1, scale, scale * ratio), everything) for ratio in DYNAMIC_RATIOS]
        for scale in ENERGY_SCALES
    ]
    return ScaledStarts(
        energy_scale=np.array(ENERGY_SCALES),
        dynamic_ratio=np.array(DYNAMIC_RATIOS),
        fss_start_1=np.array(fss),
    )


def _session_scales(problem: RateProblem) -> dict[str, FloatArray]:
    """Factors on k_s and k_d of the sessions to be run."""
    training = _training(problem)

    def at_start(scale: float) -> float:
        return problem.score(scaled_start(SESSION_START, scale, scale * MS_PER_S), training)

    reached = np.array([at_start(scale) for scale in SEARCHED_SCALES])
    nearest = float(SEARCHED_SCALES[np.argmin(np.abs(reached - paper.FOLD_3_FSS_START.value))])
    defaults = np.array([neuron.STATIC_GAIN_SCALE.value, neuron.DYNAMIC_GAIN_SCALE.value])
    return {
        "as printed, in kPa and ms": PRINTED,
        "k_d per second, energy scaled to the paper's start": nearest * np.array([1.0, MS_PER_S]),
        "the starts used here": defaults,
    }


def _session(problem: RateProblem, name: str, scales: FloatArray) -> Session:
    """Fold 3 from start 2, both gains scaled."""
    training = _training(problem)
    testing = np.setdiff1d(np.arange(problem.n_observations), training)
    method = response_surface(np.array([scaled_start(SESSION_START, *scales)]))
    fit = method.fit(problem, training)
    dynamic, static = problem.model.evaluate(fit.parameters)
    return Session(
        start=name,
        static_scale=scales[0],
        dynamic_scale=scales[1],
        fss_start=fit.history[0].score,
        fss_train=fit.score,
        fss_test=problem.score(fit.parameters, testing),
        iterations=len(fit.history) - 1,
        runs=fit.n_evaluations,
        largest_dynamic_hz=dynamic.max(),
        largest_static_hz=static.max(),
    )


def _training(problem: RateProblem) -> np.ndarray:
    folds = interleaved_folds(problem.n_observations)
    return np.flatnonzero(folds != SESSION_FOLD - 1)
