"""Level 2, beyond the paper: other methods of fitting on its folds, and what limits each of them.

Every method fits the four numbers that firing can tell, on the same folds and in the same bounds; the paper's
own fits its six. Then the model itself is let loose piece by piece, to see which piece the residual hangs on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import isotonic_regression

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Number, Vector, result_class
from fingerpad.core.signals import SedTraces
from fingerpad.data import protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014 import single_unit
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.inference.afferent_methods import (
    OFFSETS_MM,
    along_slopes,
    and_offset,
    bounds_of,
    by_differences,
    five_number_problem,
    four_number_problem,
    search_from,
)
from fingerpad.inference.closed_form import ClosedFormModel
from fingerpad.inference.fitting.covariance_adaptation import CovarianceAdaptation
from fingerpad.inference.fitting.cross_validation import CrossValidation, cross_validate, interleaved_folds
from fingerpad.inference.fitting.fractional_sum_of_squares import fractional_sum_of_squares
from fingerpad.inference.fitting.least_squares import LeastSquares
from fingerpad.inference.fitting.methods import Continued, Fit, Method
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.receptor_offset import ReceptorOffset
from fingerpad.inference.recordings import PHASES, RateRecordings
from fingerpad.neuron.transduction import Drive, drive
from fingerpad.skin.sampling import SkinResponse
from studies import fit_starts
from studies.drive_quantities import EXTENDED
from studies.fitted_bars import fit_bars


def traces_beside(responses: Sequence[SkinResponse]) -> dict[float, SedTraces]:
    """Strain energy density at each of `OFFSETS_MM` from the receptor, one column per shift of the bar."""
    sites = [[RECEPTOR_X_MM + offset, 0.0] for offset in OFFSETS_MM]
    found = [skin.sed(sites) for skin in responses]
    return {
        offset: SedTraces(
            found[0].times_ms,
            np.column_stack([trace.sed_kpa[:, number] for trace in found]),
            found[0].kinks_ms,
        )
        for number, offset in enumerate(OFFSETS_MM)
    }


@result_class
class MethodRow:
    """One method on all shifts and on the folds.

    Parameters
    ----------
    method : str
        Its name.
    free_numbers : int
        How many numbers it fits.
    fss_in_sample, fss_training_mean, fss_out_of_sample : float
        Over all shifts, and means of the folds. [1]
    fss_train, fss_test : array (n_folds,)
        Of each fold. [1]
    runs : int
        Runs of the model in all folds.
    """

    method: str
    free_numbers: int
    fss_in_sample: Number
    fss_training_mean: Number
    fss_out_of_sample: Number
    fss_train: Vector
    fss_test: Vector
    runs: int


@result_class
class ModelRow:
    """One model, fitted by the same method as the others.

    Parameters
    ----------
    model : str
        Its name.
    fss_in_sample, fss_in_sample_dynamic, fss_in_sample_static, fss_out_of_sample : float
        Over all shifts, of each phase, and mean of the folds. [1]
    fss_test : array (n_folds,)
        Of each fold. [1]
    residual_share : dict of str to float
        Of `residual_shares`. [1]
    parameters : dict of str to float
        By name.
    """

    model: str
    fss_in_sample: Number
    fss_in_sample_dynamic: Number
    fss_in_sample_static: Number
    fss_out_of_sample: Number
    fss_test: Vector
    residual_share: dict[str, Number]
    parameters: dict[str, Number]


@result_class
class Ceiling:
    """Best FSS in sample that a family of models could reach, by phase and weighted. [1]"""

    dynamic: Number
    static: Number
    weighted: Number


@result_class
class FitMethods:
    """Methods on the same folds, models on the same method, and what any model could reach.

    Parameters
    ----------
    methods : tuple of MethodRow
        The paper's first.
    models : tuple of ModelRow
        The paper's first.
    models_fitted_by : str
        Name of the method.
    ceilings : dict of str to Ceiling
        By family of models, see `ceilings`.
    """

    methods: tuple[MethodRow, ...]
    models: tuple[ModelRow, ...]
    models_fitted_by: str
    ceilings: dict[str, Ceiling]


def methods(problem: RateProblem, driven: Drive) -> tuple[Method, ...]:
    """Return the methods beside the paper's, all with the same bounds.

    Parameters
    ----------
    problem : RateProblem
        From `fingerpad.inference.afferent_methods.four_number_problem`.
    driven : Drive
        Its drive.
    """
    bounds = bounds_of(driven)
    return by_differences(bounds), by_formula(problem, driven), evolution(problem, driven)


def by_formula(problem: RateProblem, driven: Drive) -> LeastSquares:
    """Least squares along the slopes of the rate in closed form; parameters as of `methods`."""
    return along_slopes(ClosedFormModel(AfferentModel.of_drive(driven)), problem, bounds_of(driven))


def evolution(problem: RateProblem, driven: Drive, offset: bool = False) -> Continued:
    """CMA-ES from where the slopes in closed form lead; parameters as of `methods`.

    Parameters
    ----------
    problem : RateProblem
        Of the four numbers, with the receptor in its place.
    driven : Drive
        Its drive.
    offset : bool
        Whether the place of the receptor is a fifth number, which begins at 0.
    """
    bounds = bounds_of(driven)

    def search(begun: FloatArray) -> CovarianceAdaptation:
        return (
            search_from(np.append(begun, 0.0), and_offset(bounds)) if offset else search_from(begun, bounds)
        )

    return Continued(by_formula(problem, driven), search, problem, name="CMA-ES")


def result(
    traces: Mapping[float, SedTraces],
    extended: SedTraces,
    recordings: RateRecordings,
    surface: tuple[Fit, CrossValidation],
) -> FitMethods:
    """Methods on the same folds, models on the same method, and what any model could reach.

    Parameters
    ----------
    traces : dict of float to SedTraces
        Strain energy density at places beside the receptor, from `traces_beside`.
    extended : SedTraces
        At the receptor, with another quantity for the dynamic term.
    recordings : RateRecordings
        What was observed.
    surface : Fit and CrossValidation
        The paper's method, from `fingerpad.experiments.gerling2014.single_unit.fit`.

    Returns
    -------
    FitMethods
    """
    driven, otherwise = drive(traces[0.0]), drive(extended)
    problem = four_number_problem(AfferentModel.of_drive(driven), recordings)
    fits = {method.name: _fitted(problem, method) for method in methods(problem, driven)}
    searched = evolution(problem, driven).name
    offset = five_number_problem(ReceptorOffset.of_traces(traces), recordings)
    other = four_number_problem(AfferentModel.of_drive(otherwise), recordings)
    models = {
        "the paper's model": (problem, fits[searched]),
        "offset of the receptor": (offset, _fitted(offset, evolution(problem, driven, offset=True))),
        f"dynamic term: {extended.dynamic_quantity.replace('_', ' ')}": (
            other,
            _fitted(other, evolution(other, otherwise)),
        ),
    }
    return FitMethods(
        methods=tuple(_method(name, *fit) for name, fit in {"response surface": surface, **fits}.items()),
        models=tuple(_model(name, problem, *fit) for name, (problem, fit) in models.items()),
        models_fitted_by=searched,
        ceilings=ceilings(traces[0.0], recordings),
    )


def _fitted(problem: RateProblem, method: Method) -> tuple[Fit, CrossValidation]:
    """Fit all shifts, and each fold."""
    everything = np.arange(problem.n_observations)
    folds = interleaved_folds(problem.n_observations)
    return method.fit(problem, everything), cross_validate(problem, method, folds)


def _method(name: str, best: Fit, crossed: CrossValidation) -> MethodRow:
    return MethodRow(
        method=name,
        free_numbers=best.parameters.size,
        fss_in_sample=best.score,
        fss_training_mean=crossed.score_train,
        fss_out_of_sample=crossed.score_test,
        fss_train=np.array([fold.score_train for fold in crossed.folds]),
        fss_test=np.array([fold.score_test for fold in crossed.folds]),
        runs=sum(fold.fit.n_evaluations for fold in crossed.folds),
    )


def _model(name: str, problem: RateProblem, best: Fit, crossed: CrossValidation) -> ModelRow:
    by_phase = problem.score_by_phase(best.parameters, np.arange(problem.n_observations))
    return ModelRow(
        model=name,
        fss_in_sample=best.score,
        fss_in_sample_dynamic=by_phase["dynamic"],
        fss_in_sample_static=by_phase["static"],
        fss_out_of_sample=crossed.score_test,
        fss_test=np.array([fold.score_test for fold in crossed.folds]),
        residual_share=residual_shares(problem, best.parameters),
        parameters=dict(zip(problem.names, best.parameters.tolist(), strict=True)),
    )


def residual_shares(problem: RateProblem, parameters: FloatArray) -> dict[str, float]:
    """Where 1 - FSS lies: in which phase, and whether the flat face of the bar was over the receptor.

    Returns
    -------
    dict
        `dynamic_flat`, `dynamic_elsewhere`, `static_flat`, `static_elsewhere`; they add up to 1.
    """
    shift_mm = np.array(protocol.BAR_SHIFTS.value)
    flat = np.abs(shift_mm) < protocol.BAR_WIDTH.value / 2 - protocol.BAR_FILLET.value
    squares = problem.residuals(parameters, np.arange(problem.n_observations)).reshape(2, -1) ** 2
    return {
        f"{phase}_{place}": float(squares[row, where].sum() / squares.sum())
        for row, phase in enumerate(PHASES)
        for place, where in (("flat", flat), ("elsewhere", ~flat))
    }


def ceilings(traces: SedTraces, recordings: RateRecordings) -> dict[str, Ceiling]:
    """Best FSS in sample that whole families of models could reach.

    Returns
    -------
    dict of str to Ceiling
        `symmetric`: any prediction that is the same on both sides; `rising`: any rate that rises with strain
        energy density, in each phase with that of its own window.
    """
    felt = {
        phase: np.array([np.interp(np.mean(window), traces.times_ms, site) for site in traces.sed_kpa.T])
        for phase, window in zip(
            PHASES, (protocol.DYNAMIC_WINDOW.value, protocol.STATIC_WINDOW.value), strict=True
        )
    }
    found: dict[str, dict[str, float]] = {"symmetric": {}, "rising": {}}
    for phase in PHASES:
        observed = getattr(recordings, f"{phase}_rate_hz")
        order = np.argsort(felt[phase])
        risen = np.empty_like(observed)
        risen[order] = isotonic_regression(observed[order]).x
        mirrored = (observed + observed[::-1]) / 2.0
        found["symmetric"][phase] = fractional_sum_of_squares(observed, mirrored)
        found["rising"][phase] = fractional_sum_of_squares(observed, risen)
    weights = protocol.DYNAMIC_WEIGHT.value, protocol.STATIC_WEIGHT.value
    return {
        family: Ceiling(
            **by_phase,
            weighted=sum(weight * by_phase[phase] for weight, phase in zip(weights, PHASES, strict=True)),
        )
        for family, by_phase in found.items()
    }


@result_class
class MethodsStudy:
    """Result of `python -m studies methods`.

    Parameters
    ----------
    starts : FitStarts
        Where the fit starts.
    methods : FitMethods
        How it is done, and what limits it.
    manifest : Manifest
        What ran.
    """

    starts: fit_starts.FitStarts
    methods: FitMethods
    manifest: Manifest


def run(runner: Runner, conditions: Conditions) -> MethodsStudy:
    """Press the bar at all shifts, and compare starts, methods and models.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.
    conditions : Conditions
        Finger, tissues, accuracy and seed.

    Returns
    -------
    MethodsStudy
    """
    fitted = fit_bars(runner, conditions)
    with runner.stage("starts and methods", 2) as advance:
        von_mises = single_unit.receptor_traces(fitted.bars, "von_mises")
        starts = fit_starts.result(fitted.problem, von_mises)
        advance()
        extended = single_unit.receptor_sed(fitted.bars, EXTENDED.dynamic)
        surface = fitted.best, fitted.folds
        methods = result(traces_beside(fitted.bars), extended, fitted.problem.recordings, surface)
        advance()
    return MethodsStudy(starts=starts, methods=methods, manifest=runner.manifest(conditions))
