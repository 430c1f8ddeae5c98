"""Results of a fit to recordings, and of the parts that can be asked for with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.displayed import Columns, Result
from fingerpad.core.values import Matrix, Number, Vector, WholeVector
from fingerpad.inference.fitting.methods import FoldFit
from fingerpad.inference.fitting.sensitivity import SobolIndices
from fingerpad.inference.rate_model import RateProblem
from fingerpad.neuron.afferent import PARAMETER_NAMES

if TYPE_CHECKING:
    from fingerpad.inference.fitting.posterior import Chains


@result_class
class SpikeFitSummary:
    """Maximum likelihood of spike trains under a soft threshold."""

    n_spikes: int  #: How many were fitted.
    log_likelihood: float
    log_likelihood_out_of_sample: float  #: Of all spikes, and of each fold's spikes fitted without it.
    escape_width: float
    escape_width_standard_error: Number  #: Width of the threshold over the threshold.
    time_rescaling_distance: float
    time_rescaling_p_value: float  #: Kolmogorov-Smirnov test of the rescaled intervals.


@result_class
class ParameterProfile:
    """Profile likelihood of one of the four identifiable numbers."""

    name: str
    values: Vector  #: Where it was held, (n_values,).
    losses: Vector  #: Loss of log likelihood there, the other three numbers fitted, (n_values,).
    low: float | None
    high: float | None  #: Ends of the interval, None where the rates set none.


@result_class
class CredibleInterval:
    """Posterior median and ends of the credible interval of one number, in its unit."""

    median: Number
    low: Number
    high: Number


@result_class
class ParameterIdentifiability:
    """Directions of the six parameters that the rates determine."""

    rank: int  #: Singular values of the Jacobian of the rates that are not zero.
    relative_singular_values: Vector  #: Over the largest, (6,). [1]


@result_class
class PosteriorConvergence:
    """Size and convergence of the MCMC ensembles."""

    ensembles: int
    walkers: int  #: Independent ensembles, and walkers of each.
    draws: int
    evaluations: int  #: Draws kept, and evaluations of the likelihood.
    acceptance: Number  #: Share of accepted proposals. [1]
    r_hat: Number  #: Largest split R-hat. [1]
    effective_draws: Number
    effective_draws_of_tails: Number  #: Smallest effective sample sizes.
    draws_per_effective_draw: Number  #: Largest autocorrelation time, in draws.

    @classmethod
    def of(cls, chains: Chains) -> PosteriorConvergence:
        """Convergence of ensembles, the worst of all coordinates."""
        return cls(
            ensembles=chains.draws.shape[0],
            walkers=chains.draws.shape[2],
            draws=len(chains.flat),
            evaluations=chains.n_evaluations,
            acceptance=chains.acceptance,
            r_hat=chains.r_hat.max(),
            effective_draws=chains.effective_sizes.min(),
            effective_draws_of_tails=chains.tail_effective_sizes.min(),
            draws_per_effective_draw=chains.autocorrelation_steps.max(),
        )


@result_class
class PhasePrediction:
    """Posterior prediction of the rates of one phase, stimulus by stimulus."""

    observed_hz: Vector
    median_hz: Vector
    low_hz: Vector
    high_hz: Vector  #: Observed; median and credible band of predicted rates, (n_stimuli,). [spikes/s]
    new_low_hz: Vector
    new_high_hz: Vector  #: Credible band of a new recording, (n_stimuli,). [spikes/s]
    share_within_new: Number  #: Share of the observed rates within that band. [1]
    residual_deviation_hz: CredibleInterval
    residual_length_mm: CredibleInterval  #: Of the residuals; length: of their correlation.
    probability_of_independence: Number  #: That residuals of neighbouring shifts are independent. [1]


@result_class
class RatePosterior:
    """Posterior of the four identifiable numbers."""

    level: float  #: Probability within each interval and band.
    seed: int  #: Of the random numbers.
    numbers: dict[str, CredibleInterval]
    covariance: Matrix  #: Of the draws of the four numbers, (4, 4).
    convergence: PosteriorConvergence
    rates: dict[str, PhasePrediction]


@result_class
class UncertaintyResult:
    """Uncertainty of a fit to rates whose residuals may be alike where stimuli are neighbours."""

    level: Number  #: Probability within each interval and band.
    seed: int  #: Of the random numbers.
    units: dict[str, str]
    fit: dict[str, Number]  #: By the names of the four identifiable numbers.
    capacitance_mf: Number
    threshold_mv: Number  #: Of the fit; they set the common scale of the gains in `posterior`. [mF], [mV]
    identifiability: ParameterIdentifiability  #: Of the six parameters.
    posterior: dict[str, CredibleInterval]  #: Of numbers, gains, and resting potential over threshold.
    convergence: PosteriorConvergence
    shift_mm: Vector  #: Places of the stimuli along a line, (n_stimuli,). [mm]
    rates: dict[str, PhasePrediction]
    evidence_for_alike_residuals: Number  #: Gain of the largest log likelihood by correlated residuals.
    profiles: tuple[ParameterProfile, ...]  #: Of the four numbers.
    sensitivity: SobolIndices  #: Of FSS to the four numbers.


@result_class
class HeldOffset:
    """Best FSS in sample with the receptor held at each offset [mm], (n_offsets,)."""

    offset_mm: Vector
    fss_in_sample: Vector


@result_class
class OffsetFit:
    """Fit of the four numbers and the receptor's offset."""

    offset_mm: float
    standard_error_mm: Number  #: Distal positive; its error is NaN where not known. [mm]
    folds_mm: Vector  #: Offsets that the folds give, (n_folds,). [mm]
    identifiable: dict[str, float]
    fss_in_sample: float
    fss_out_of_sample: float  #: Fractional sum of squares over all stimuli, and mean over the folds.
    fss_by_phase: dict[str, float]  #: In sample, "dynamic" and "static".
    n_evaluations: int  #: Evaluations of the model.
    seconds: float  #: Time on the clock. [s]
    held: HeldOffset  #: Fits with the receptor held.


@result_class
class PhaseRates:
    """Rates of one phase, in the ramp or in the hold."""

    fss_in_sample: float | None  #: Over all stimuli; absent where the phase was not recorded.
    observed_hz: Vector | None  #: Recorded rates, (n_stimuli,). [spikes/s]
    fitted_hz: Vector  #: Rates of the afferent that is fitted to all stimuli, (n_stimuli,). [spikes/s]
    out_of_sample_hz: Vector  #: Rates predicted by the fit without its fold, (n_stimuli,). [spikes/s]


@result_class
class FittedFold:
    """One fold of the cross validation."""

    fold: int
    stimuli: tuple[str, ...]  #: Left out of the fit.
    fss_train: float
    fss_test: float  #: Fractional sum of squares over the other stimuli and over these.
    n_evaluations: int  #: Evaluations of the model.
    seconds: float  #: Time on the clock. [s]
    parameters: dict[str, float]
    identifiable: dict[str, float]  #: The paper's six parameters, and the four that rates identify.


@result_class
class SearchStep:
    """One step of a search."""

    iteration: int  #: From 0, the start point.
    fss: Number  #: Fractional sum of squares of the training set. [1]
    parameters: dict[str, Number]  #: By name.


@result_class
class Search:
    """Search of one fold from one start point, in the paper's six parameters."""

    start: int  #: Number of the start point, from 1.
    fss_train: Number
    fss_test: Number  #: Fractional sum of squares of the training and of the testing set. [1]
    runs: int  #: Evaluations of the model.
    history: tuple[SearchStep, ...]  #: Steps from the start point to the end.

    @classmethod
    def of(cls, problem: RateProblem, fold: FoldFit) -> tuple[Search, ...]:
        """Return the searches of a fold, one per start point."""
        return tuple(
            cls(
                start=number,
                fss_train=search.score,
                fss_test=problem.score(search.parameters, fold.testing),
                runs=search.n_evaluations,
                history=tuple(
                    SearchStep(
                        iteration=iteration,
                        fss=step.score,
                        parameters=dict(zip(PARAMETER_NAMES, step.parameters.tolist(), strict=True)),
                    )
                    for iteration, step in enumerate(search.history)
                ),
            )
            for number, search in enumerate(fold.fit.attempts, start=1)
        )


@result_class
class FitResult(Result):
    """Result of a fit to recordings."""

    whole_as_json: ClassVar[bool] = True
    method: str
    source: str  #: How it was fitted, and where the recordings come from.
    n_evaluations: int  #: Evaluations of the model.
    seconds: float  #: Time on the clock. [s]
    parameters: dict[str, float]
    identifiable: dict[str, float]  #: The paper's six parameters, and the four that rates identify.
    units: dict[str, str]
    identifiable_units: dict[str, str]  #: Their units.
    identifiable_standard_error: dict[str, Number]  #: NaN where there is no covariance.
    identifiable_covariance: Matrix | None  #: Of the four numbers.
    fss_in_sample: float
    fss_training_mean: float
    fss_out_of_sample: float  #: Over all stimuli; over training sets and testing sets, mean of the folds.
    stimulus: tuple[str, ...]  #: Names.
    fold: WholeVector  #: Fold of each stimulus, from 1.
    phases: dict[str, PhaseRates]  #: Rates by phase, "dynamic" and "static".
    folds: tuple[FittedFold, ...]  #: The cross validation.
    spikes: SpikeFitSummary | None  #: Of the likelihood of spikes.
    posterior: RatePosterior | None
    profiles: tuple[ParameterProfile, ...] | None
    sensitivity: SobolIndices | None
    offset: OffsetFit | None
    """Credible intervals, profile likelihoods, Sobol indices, and the fit with the receptor's offset as a
    further parameter, where they were asked for."""
    shift_mm: Vector | None = None
    """Shift of each stimulus, proximal positive, where stimuli differ in nothing else. [mm]"""
    presentations: tuple[int, ...] = ()  #: Presentations of each stimulus.
    spikes_after_hold: int = 0  #: Spikes that were left out because they came after the hold.

    def columns(self) -> Columns:
        """Rates that were observed, fitted and predicted out of the fold, by stimulus and phase."""
        n_phases, n_stimuli = len(self.phases), len(self.stimulus)
        unknown = np.full(n_stimuli, np.nan)
        parts = self.phases.values()
        observed = [unknown if part.observed_hz is None else part.observed_hz for part in parts]
        return {
            "stimulus": np.tile(self.stimulus, n_phases),
            "phase": np.repeat(list(self.phases), n_stimuli),
            "fold": np.tile(self.fold, n_phases),
            "observed_hz": np.concatenate(observed),
            "fitted_hz": np.concatenate([part.fitted_hz for part in parts]),
            "out_of_sample_hz": np.concatenate([part.out_of_sample_hz for part in parts]),
        }

    def __repr__(self) -> str:
        return (
            f"FitResult({self.method} on {len(self.stimulus)} stimuli, fractional sum of squares "
            f"{self.fss_in_sample:.3g} in sample and {self.fss_out_of_sample:.3g} out of sample)"
        )
