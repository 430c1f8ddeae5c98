"""Fits of one afferent that are compared with each other: the same parameters, methods and folds for all.

For every drive four parameters are fitted to all shifts of the bar and to six folds, from start points that
give the same currents. The gain of one drive over another has a bootstrap interval.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fingerpad.core.checks import FloatArray, IntArray, whole
from fingerpad.core.results import Number, Vector, result_class
from fingerpad.data import protocol
from fingerpad.inference.fitting.covariance_adaptation import CovarianceAdaptation
from fingerpad.inference.fitting.cross_validation import cross_validate, interleaved_folds
from fingerpad.inference.fitting.least_squares import LeastSquares
from fingerpad.inference.fitting.methods import Bounds, Fit, Method, Problem, best_of
from fingerpad.inference.identifiable import identifiable, six_parameters
from fingerpad.inference.rate_model import RateModel, Reparametrised
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import PHASES, RateRecordings
from fingerpad.inference.start_points import start_points
from fingerpad.neuron.afferent import PARAMETER_NAMES
from fingerpad.neuron.transduction import Drive

RESAMPLED_SHIFTS = 3
"""Neighbouring shifts drawn together by the bootstrap: residuals under neighbouring edges are alike."""

RESAMPLES = 2000
INTERVAL = (0.025, 0.975)


def scaled_starts(driven: Drive, reference: Drive) -> FloatArray:
    """Both start points of the paper, their gains rescaled to another drive.

    A gain is multiplied by the largest value that its term sees with SED, over the largest one that it sees
    with this drive, over all shifts and times: at the start every quantity gives the same largest currents.

    Parameters
    ----------
    driven : Drive
        What is to be fitted.
    reference : Drive
        SED, for which the start points were chosen.

    Returns
    -------
    array (2, 6)
        In the order of `fingerpad.neuron.afferent.PARAMETER_NAMES`.

    Examples
    --------
    >>> from fingerpad.core.signals import SedTraces
    >>> from fingerpad.neuron.transduction import drive
    >>> sed = SedTraces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> tenfold = SedTraces(sed.times_ms, 10.0 * sed.sed_kpa, sed.kinks_ms)
    >>> scaled, usual = (scaled_starts(drive(each), drive(sed))[0, 1:3] for each in (tenfold, sed))
    >>> (scaled / usual).round(6).tolist()
    [0.1, 0.1]
    """
    starts = start_points()
    starts[:, PARAMETER_NAMES.index("dynamic_gain")] *= (
        reference.rate_kpa_per_ms.max() / driven.rate_kpa_per_ms.max()
    )
    starts[:, PARAMETER_NAMES.index("static_gain")] *= reference.sed_kpa.max() / driven.sed_kpa.max()
    return starts


RELATIVE_NAMES = ("intercept_share", "log_dynamic_gain", "log_static_gain", "log_time_constant")
"""Four numbers of order 1 in the place of the four that spikes determine."""


def six_of_relative(relative: FloatArray, start: FloatArray) -> FloatArray:
    """Return the paper's six parameters for four numbers that are 0 near a start point.

    p = (beta tau/(C v), ln k_d/k_d0, ln k_s/k_s0, ln tau/tau0): a share of the current that just fires, and
    logarithms of the other three numbers that spikes determine, over those of the start. Gains and tau stay
    positive for any p, and a step of 0.1 means alike in all.

    Parameters
    ----------
    relative : array (4,)
        p, in the order of `RELATIVE_NAMES`.
    start : array (6,)
        Where k_d0, k_s0 and tau0 are taken from.

    Returns
    -------
    array (6,)
        With the capacitance and the threshold of the paper's start.

    Examples
    --------
    >>> start = start_points()[0]
    >>> six = six_of_relative(np.array([0.0, 0.0, np.log(2.0), 0.0]), start)
    >>> (six[1:] / start[1:]).round(6).tolist()
    [1.0, 2.0, 1.0, 1.0, 1.0]
    """
    _, dynamic, static, time_constant_ms = identifiable(start)
    tau = time_constant_ms * np.exp(relative[3])
    gains = np.exp(relative[1:3]) * (dynamic, static)
    return six_parameters([relative[0] / tau, *gains, tau])


def relative_model(model: RateModel, start: FloatArray) -> RateModel:
    """Restate a model of the paper's six parameters in the four relative ones."""
    return Reparametrised(model, RELATIVE_NAMES, lambda relative: six_of_relative(relative, start))


START_GRID = tuple(product((0.0, 0.8), (0.0, 0.7), (0.0, 0.7), (-0.8, 0.0)))
"""Relative numbers from which fits may start: without and with a current of its own that almost fires, at the
scaled start and twice its gains, at tau of the start and less than half of it."""


def quick_method(n_added: int = 0) -> LeastSquares:
    """Return least squares from the two best points of `START_GRID`: a second or two for all folds.

    Parameters
    ----------
    n_added : int, optional
        Numbers of a model besides the four relative ones; they start at 0.

    Returns
    -------
    Method
    """
    starts = np.hstack([START_GRID, np.zeros((len(START_GRID), n_added))])
    return LeastSquares(starts, Bounds(np.ones(starts.shape[1])), n_refined=2, difference_steps=(0.1, 0.03))


@dataclass(frozen=True)
class BestOf:
    """Several methods on the same observations, the best score kept: no quantity depends on one's luck.

    Parameters
    ----------
    methods : tuple of Method
        All are tried.
    name : str
        What tables call them together.
    """

    methods: tuple[Method, ...]
    name: str

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit by every method."""
        return best_of(tuple(method.fit(problem, chosen) for method in self.methods))


def thorough_method(seed: int, n_added: int = 0) -> Method:
    """Return the better of least squares from four points and an evolution strategy.

    Parameters
    ----------
    seed : int
        Of the evolution strategy.
    n_added : int, optional
        Numbers of a model besides the four relative ones.

    Returns
    -------
    Method
    """
    quick = quick_method(n_added)
    start = np.zeros(len(RELATIVE_NAMES) + n_added)
    return BestOf(
        (
            replace(quick, n_refined=4),
            CovarianceAdaptation(start, Bounds(np.ones(start.size)), most_evaluations=800, seed=seed),
        ),
        "least squares and CMA-ES, the better",
    )


@dataclass(frozen=True)
class Judged:
    """A fit to all shifts and six that each left some out.

    Parameters
    ----------
    fit : Fit
        To all shifts.
    in_sample : dict of str to float
        FSS "total", "dynamic" and "static" over all shifts.
    folds : tuple of dict
        The same per fold, over the shifts that it left out.
    predicted_hz : array (2, n_shifts)
        Dynamic and static rates by the fit to all shifts. [spikes/s]
    left_out_hz : array (2, n_shifts)
        Rates under each shift by the fit that did not use it. [spikes/s]
    """

    fit: Fit
    in_sample: dict[str, float]
    folds: tuple[dict[str, float], ...]
    predicted_hz: FloatArray
    left_out_hz: FloatArray

    @property
    def out_of_sample(self) -> dict[str, float]:
        """Mean of the folds."""
        return {key: float(np.mean([fold[key] for fold in self.folds])) for key in self.in_sample}


def judge(problem: RateProblem, method: Method, memberships: IntArray | None = None) -> Judged:
    """Fit a problem to all shifts and to each fold, and judge what was left out.

    Parameters
    ----------
    problem : RateProblem
        With dynamic and static rates.
    method : Method
        How to fit.
    memberships : int array (n_shifts,), optional
        Fold of each shift; interleaved by default.

    Returns
    -------
    Judged
    """
    everything = np.arange(problem.n_observations)
    folds = interleaved_folds(everything.size) if memberships is None else memberships
    best = method.fit(problem, everything)
    validation = cross_validate(problem, method, folds)
    left_out = np.empty((len(PHASES), everything.size))
    for fold in validation.folds:
        predicted = np.array(problem.model.evaluate(fold.fit.parameters))
        left_out[:, fold.testing] = predicted[:, fold.testing]
    return Judged(
        best,
        _scores(problem, best.parameters, everything),
        tuple(_scores(problem, fold.fit.parameters, fold.testing) for fold in validation.folds),
        np.array(problem.model.evaluate(best.parameters)),
        left_out,
    )


def _scores(problem: RateProblem, parameters: FloatArray, chosen: IntArray) -> dict[str, float]:
    return {"total": problem.score(parameters, chosen), **problem.score_by_phase(parameters, chosen)}


def gain_interval(
    recordings: RateRecordings,
    better_hz: FloatArray,
    reference_hz: FloatArray,
    generator: np.random.Generator,
    resamples: int = RESAMPLES,
) -> tuple[float, float]:
    """Interval of what one prediction gains in FSS over another, by a bootstrap over shifts.

    Blocks of `RESAMPLED_SHIFTS` neighbouring shifts are drawn with replacement, the same for both
    predictions, and FSS is taken over what was drawn (Künsch 1989; the first shift follows on the last). It
    describes how much the gain depends on single shifts, not the variation between afferents.

    Parameters
    ----------
    recordings : RateRecordings
        Observed dynamic and static rates.
    better_hz, reference_hz : array (2, n_shifts)
        Dynamic and static rates by the two predictions, under shifts they were not fitted to. [spikes/s]
    generator : numpy.random.Generator
        Draws the blocks.
    resamples : int, optional
        How often.

    Returns
    -------
    (float, float)
        From the 2.5 to the 97.5 percentile.

    Examples
    --------
    >>> observed = RateRecordings(tuple("abcdef"), [9.0, 8, 7, 6, 5, 4], [3.0, 3, 2, 2, 1, 1])
    >>> truth = np.array([observed.dynamic_rate_hz, observed.static_rate_hz])
    >>> low, high = gain_interval(observed, truth, np.zeros((2, 6)), np.random.default_rng(0))
    >>> low == high == 1.0  # from a rate of 0 to the observed rates, for every draw
    True
    """
    n_shifts = len(recordings.stimuli)
    n_blocks = -(-n_shifts // RESAMPLED_SHIFTS)
    first = generator.integers(n_shifts, size=(whole("resamples", resamples, 1), n_blocks, 1))
    drawn = ((first + np.arange(RESAMPLED_SHIFTS)) % n_shifts).reshape(resamples, -1)[:, :n_shifts]
    observed_hz = np.array([recordings.dynamic_rate_hz, recordings.static_rate_hz])
    weights = np.array([protocol.DYNAMIC_WEIGHT.value, protocol.STATIC_WEIGHT.value])

    def lost(predicted_hz: FloatArray) -> FloatArray:
        squares = ((observed_hz - predicted_hz) ** 2)[:, drawn].sum(axis=-1)
        observed = (observed_hz**2)[:, drawn].sum(axis=-1)
        # A draw of shifts without spikes in a phase does not count for that phase.
        return weights @ np.divide(squares, observed, out=np.zeros_like(squares), where=observed > 0.0)

    low, high = np.quantile(lost(reference_hz) - lost(better_hz), INTERVAL)
    return float(low), float(high)


@result_class
class DriveFit:
    """Fit of one drive and its cross-validation.

    Parameters
    ----------
    fss_in_sample, fss_in_sample_dynamic, fss_in_sample_static : float
        Fractional sum of squares over all shifts, weighted and by phase. [1]
    fss_out_of_sample, fss_out_of_sample_dynamic, fss_out_of_sample_static : float
        Mean over the folds, each on the shifts that it left out. [1]
    fss_folds : array (n_folds,)
        Of each fold, on the shifts that it left out. [1]
    gain_interval : (float, float)
        Interval of the gain out of sample over the reference, see `gain_interval`. [1]
    evaluations : int
        Of the model.
    """

    fss_in_sample: Number
    fss_in_sample_dynamic: Number
    fss_in_sample_static: Number
    fss_out_of_sample: Number
    fss_out_of_sample_dynamic: Number
    fss_out_of_sample_static: Number
    fss_folds: Vector
    gain_interval: tuple[Number, Number]
    evaluations: int


def drive_fit(
    judged: Judged, reference: Judged, recordings: RateRecordings, generator: np.random.Generator
) -> DriveFit:
    """Summarise a fit.

    Parameters
    ----------
    judged : Judged
        The fit.
    reference : Judged
        What its gain is measured against.
    recordings : RateRecordings
        Observed rates.
    generator : numpy.random.Generator
        Draws the bootstrap.
    """
    inside, outside = judged.in_sample, judged.out_of_sample
    return DriveFit(
        fss_in_sample=inside["total"],
        fss_in_sample_dynamic=inside["dynamic"],
        fss_in_sample_static=inside["static"],
        fss_out_of_sample=outside["total"],
        fss_out_of_sample_dynamic=outside["dynamic"],
        fss_out_of_sample_static=outside["static"],
        fss_folds=np.array([fold["total"] for fold in judged.folds]),
        gain_interval=gain_interval(recordings, judged.left_out_hz, reference.left_out_hz, generator),
        evaluations=judged.fit.n_evaluations,
    )


def information(fss: float, n_rates: int, n_parameters: int) -> dict[str, float]:
    """Akaike's and the Bayesian information criterion of a least-squares fit; smaller is better.

    With normal residuals whose variances stand in the ratio that the weights of FSS imply, and one unknown
    scale, -2 ln L = n ln(1 - FSS) + constant, so that

        AIC = n ln(1 - FSS) + 2 k,    BIC = n ln(1 - FSS) + k ln n.

    Parameters
    ----------
    fss : float
        In sample.
    n_rates : int
        Observed rates, n.
    n_parameters : int
        Free numbers that firing can tell, k.

    Returns
    -------
    dict
        "aic" and "bic", to be compared among fits to the same rates.

    Examples
    --------
    >>> one, two = information(0.9, 72, 4), information(0.9, 72, 5)
    >>> two["aic"] - one["aic"], round(two["bic"] - one["bic"], 2)
    (2.0, 4.28)
    """
    misfit = n_rates * float(np.log1p(-fss))
    return {"aic": misfit + 2.0 * n_parameters, "bic": misfit + n_parameters * float(np.log(n_rates))}
