"""Methods that fit one afferent to firing rates: bounds, scales, starts and parameters.

All but the paper's method (`response_surface`) fit four numbers, optionally
with the offset of the receptor along the finger, within the same bounds. The four are the identifiable ones
with the potential at rest over the threshold, beta tau/(C v), in the place of beta/(C v): its bound keeps the
afferent silent at rest (docs/decisions.md#silent-at-rest).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.signals import INTERVAL, Traces
from fingerpad.core.values import FloatArray, IntArray, finite, float_array, increasing, one_of, positive
from fingerpad.data import neuron
from fingerpad.inference.fitting.methods import (
    Bounds,
    CovarianceAdaptation,
    CrossValidation,
    Fit,
    LeastSquares,
    Method,
    Problem,
    ResponseSurface,
    cross_validate,
    interleaved_folds,
)
from fingerpad.inference.identifiable import (
    LARGEST_RESTING_SHARE,
    identifiable,
    silent_at_rest,
    six_parameters,
)
from fingerpad.inference.rate_model import (
    AfferentModel,
    RateProblem,
    Rates,
    Reparametrised,
    closed_form_rates,
)
from fingerpad.inference.recordings import RateRecordings
from fingerpad.neuron.afferent import AnyAfferent, type_of
from fingerpad.neuron.spikes import RATE_OF, Windows, rate_windows_ms
from fingerpad.neuron.transduction import Drive

OFFSET_NAME = "offset_mm"  # Name of the parameter; positive is distal. [mm]


@dataclass(frozen=True)
class ReceptorOffset:
    """The paper's model with the offset of the receptor as a seventh parameter; a `RateModel`.

    Between two sampled offsets the drive is interpolated linearly.
    """

    offsets_mm: FloatArray
    """Offsets at which the drive is sampled, distal positive, increasing, (n_offsets,). [mm]"""
    models: Sequence[AfferentModel]  #: The model at each offset, all with the same stimuli and times.

    def __post_init__(self) -> None:
        offsets = increasing("offsets_mm", float_array("offsets_mm", self.offsets_mm, 1))
        kinds = {
            tuple(
                (columns.tobytes(), driven.times_ms.tobytes())
                for columns, driven in zip(model.stimuli, model.drives, strict=True)
            )
            for model in self.models
        }
        if offsets.size < 2 or offsets.size != len(self.models) or len(kinds) > 1:
            raise InputError(
                "ReceptorOffset needs at least two offsets, each with a model of the same stimuli and times: "
                f"got {offsets.size} offsets and {len(self.models)} models of {len(kinds)} kinds."
            )
        object.__setattr__(self, "offsets_mm", offsets)

    @classmethod
    def of_traces(
        cls, traces: Mapping[float, Traces | Sequence[Traces]], windows_ms: Windows | None = None
    ) -> ReceptorOffset:
        """Make the model from what drives the afferent at each offset."""
        return cls(
            np.array(list(traces), dtype=np.float64),
            [AfferentModel.of_traces(each, windows_ms) for each in traces.values()],
        )

    @property
    def n_stimuli(self) -> int:
        return self.models[0].n_stimuli

    def at(self, offset_mm: float) -> AfferentModel:
        offset = finite(OFFSET_NAME, offset_mm, "mm")
        if not self.offsets_mm[0] <= offset <= self.offsets_mm[-1]:
            raise InputError(
                f"{OFFSET_NAME} must lie within {self.offsets_mm[0]:g} ... {self.offsets_mm[-1]:g} mm, "
                f"where the skin was sampled: got {offset:g}."
            )
        before = min(int(np.searchsorted(self.offsets_mm, offset, "right")) - 1, len(self.models) - 2)
        share = (offset - self.offsets_mm[before]) / (self.offsets_mm[before + 1] - self.offsets_mm[before])
        near, far = self.models[before], self.models[before + 1]
        return replace(
            near, drives=tuple(_between(*pair, share) for pair in zip(near.drives, far.drives, strict=True))
        )

    def evaluate(self, parameters: FloatArray) -> Rates:
        return self.at(parameters[-1]).evaluate(parameters[:-1])


def _between(near: Drive, far: Drive, share: float) -> Drive:
    """Drive interpolated linearly: `near` for a share of 0, `far` for 1."""
    return replace(
        near,
        values=(1.0 - share) * near.values + share * far.values,
        rate_per_ms=(1.0 - share) * near.rate_per_ms + share * far.rate_per_ms,
    )


INCREMENT = 0.01
"""Coding increment over the start value; the paper's are "typically two orders of magnitude smaller"."""

LOWEST_SHARE = 0.05  # Lower bound of time constant, capacitance and threshold over their start.
START_WIDTH = 0.5  # Width of the threshold over the threshold at the start of fits to spikes. [1]


def start_points() -> FloatArray:
    """Both start points of the paper, (2, 6), with rescaled gains.

    One factor of k_d and one of k_s hold for both, see docs/decisions.md#dynamic-gain-rescaled.
    """
    first = neuron.DYNAMIC_GAIN_START_1.value, neuron.STATIC_GAIN_START_1.value
    second = neuron.DYNAMIC_GAIN_START_2.value, neuron.STATIC_GAIN_START_2.value
    gains = np.array([first, second]) * [neuron.DYNAMIC_GAIN_SCALE.value, neuron.STATIC_GAIN_SCALE.value]
    shared = neuron.TIME_CONSTANT.value, neuron.CAPACITANCE.value, neuron.THRESHOLD.value
    return np.array([[neuron.INTERCEPT_START.value, *pair, *shared] for pair in gains])


def spike_start() -> FloatArray:
    """Start of every fit to spikes: the paper's first start point with a soft threshold."""
    return np.array([*identifiable(start_points()[0]), START_WIDTH])


def response_surface() -> ResponseSurface:
    """Return the paper's method, silent at rest, with gains and parameters of the membrane bounded below."""
    starts = start_points()
    time_constant, capacitance, threshold = starts[0, 3:]
    # Both intercepts start at 0: their increment is a share of the rheobase.
    rheobase = capacitance * threshold / time_constant
    increments = np.where(starts == 0.0, INCREMENT * rheobase, INCREMENT * np.abs(starts))
    bounds = np.array([-np.inf, 0.0, 0.0, *(LOWEST_SHARE * starts[0, 3:])])
    return ResponseSurface(starts, increments, bounds, restrict=silent_at_rest)


OFFSETS_MM = (-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3)
"""Offsets from the receptor at which the drive is sampled. The paper's bar moves in steps of 0.2 mm. [mm]"""

LOWEST = (-1.5, 0.0, 0.0, 3.0)
HIGHEST = (LARGEST_RESTING_SHARE, 0.6, 0.2, 300.0)
SCALES = (0.3, 0.05, 0.02, 20.0)
"""Bounds and scales of a fit: the potential at rest over the threshold [1], the largest values of the dynamic
and the static term under all stimuli [1/ms], and tau [ms]. A drive of 0.2/ms elicits up to 200 spikes/s,
three times the largest static rate."""

OFFSET_SCALE_MM = 0.1

N_STARTS, N_REFINED = 32, 8
"""Starts that are scored, and starts from which least squares continues: two of them end up to 0.003 of FSS
below the best, since intercept and time constant of a membrane at rest trade off along a valley."""

MOST_EVALUATIONS = 600


def fitted_four(numbers: FloatArray) -> FloatArray:
    return np.array([numbers[0] / numbers[3], *numbers[1:]])


def fitted_six(numbers: FloatArray) -> FloatArray:
    return six_parameters(fitted_four(numbers))


def bounds_of(*drives: Drive) -> Bounds:
    """Bounds of the four numbers of a fit: those of `LOWEST`, `HIGHEST` and `SCALES`."""
    rate, value = (
        max(float(getattr(driven, name).max()) for driven in drives) for name in ("rate_per_ms", "values")
    )
    strongest = np.array([1.0, rate, value, 1.0])
    return Bounds(*(np.array(terms) / strongest for terms in (SCALES, LOWEST, HIGHEST)))


@dataclass(frozen=True)
class Search:
    """A problem in some numbers of an afferent, their bounds, and from how many starts to search."""

    problem: RateProblem
    bounds: Bounds
    n_starts: int = N_STARTS
    n_refined: int = N_REFINED

    def by_differences(self) -> LeastSquares:
        return LeastSquares(self.bounds.spread(self.n_starts), self.bounds, n_refined=self.n_refined)

    def along_slopes(self) -> LeastSquares:
        """Least squares with the derivatives of the closed form; of the four numbers only."""
        stimuli = cast(Any, self.problem.model).model

        def slopes(numbers: FloatArray) -> Rates:
            # By the chain rule: beta/(C v) is the first number over the last, tau.
            share, _, _, tau = numbers
            four_by_numbers = np.diag([1.0 / tau, 1.0, 1.0, 1.0])
            four_by_numbers[0, 3] = -share / tau**2
            _, (dynamic, static) = closed_form_rates(stimuli, fitted_four(numbers))
            return dynamic @ four_by_numbers, static @ four_by_numbers

        jacobian = self.problem.jacobian_of(slopes)
        return replace(self.by_differences(), jacobian=jacobian, name="slopes in closed form")

    def by_evolution(self, begun: FloatArray, seed: int = 0) -> CovarianceAdaptation:
        """CMA-ES from the result of a faster method."""
        return CovarianceAdaptation(begun, self.bounds, most_evaluations=MOST_EVALUATIONS, seed=seed)


def four_numbers(model: AfferentModel, recordings: RateRecordings) -> Search:
    """Search beta tau/(C v) [1], k_d/(C v), k_s/(C v) and tau."""
    problem = RateProblem(Reparametrised(model, fitted_six), recordings)
    return Search(problem, bounds_of(*model.drives))


def four_numbers_and_offset(model: ReceptorOffset, recordings: RateRecordings) -> Search:
    """Search the four numbers of `four_numbers` and the offset of the receptor."""

    def seven(numbers: FloatArray) -> FloatArray:
        return np.append(fitted_six(numbers[:4]), numbers[4])

    problem = RateProblem(Reparametrised(model, seven), recordings)
    low_mm, high_mm = model.offsets_mm[[0, -1]].tolist()
    return Search(problem, bounds_of(*model.at(0.0).drives).and_one(OFFSET_SCALE_MM, low_mm, high_mm))


def validated(
    problem: Problem, method: Method, memberships: ArrayLike | None = None
) -> tuple[Fit, CrossValidation]:
    """Fit all observations, and without each fold; folds are by default assigned in turn."""
    everything = np.arange(problem.n_observations)
    folds = interleaved_folds(everything.size) if memberships is None else memberships
    return method.fit(problem, everything), cross_validate(problem, method, folds)


LARGEST_FACTOR = 30.0  # How far a chosen number may lie from that of the afferent given, as a factor.
N_STARTS_CHOSEN, N_REFINED_CHOSEN = 16, 3  # As `N_STARTS` and `N_REFINED`, of chosen numbers.


@dataclass(frozen=True)
class TypedModel:
    """Rates of an afferent under stimuli, in the logarithms of some of its numbers over those given."""

    afferent: AnyAfferent
    names: tuple[str, ...]
    traces: Sequence[Traces]
    windows_ms: Windows | None = None

    @property
    def n_stimuli(self) -> int:
        return sum(traces.n_sites for traces in self.traces)

    def at(self, parameters: FloatArray) -> AnyAfferent:
        factors = zip(self.names, np.exp(parameters).tolist(), strict=True)
        numbers = {name: getattr(self.afferent, name) * factor for name, factor in factors}
        return cast(AnyAfferent, replace(cast(Any, self.afferent), **numbers))

    def evaluate(self, parameters: FloatArray) -> Rates:
        """Dynamic and static rate under each stimulus, as the type measures them. [spikes/s]"""
        measure = getattr(self.afferent, "rate_measure", INTERVAL)
        given, afferent = self.windows_ms or (None, None), self.at(parameters)
        rates = []
        for traces in self.traces:
            spikes = afferent.spikes(traces)
            windows = rate_windows_ms(traces.phases, given[0], given[1], traces.times_ms[-1], measure)
            rates.append([RATE_OF[measure](spikes, window) for window in windows])
        dynamic, static = (np.concatenate(phase) for phase in zip(*rates, strict=True))
        return dynamic, static


@dataclass(frozen=True)
class TypedFit:
    """An afferent of any type as it was fitted to recorded rates."""

    afferent: AnyAfferent  #: With the fitted numbers.
    free: tuple[str, ...]
    fss_in_sample: float
    fss_out_of_sample: float
    """Fractional sum of squares of the fit to all stimuli, and its mean over stimuli left out of folds."""
    dynamic_rate_hz: FloatArray
    static_rate_hz: FloatArray  #: Rates of the afferent under all stimuli, (n_stimuli,). [spikes/s]


def _largest_factor(afferent: AnyAfferent, name: str) -> float:
    """Return by how much a number can grow: a share of the response only to 1."""
    try:
        replace(cast(Any, afferent), **{name: getattr(afferent, name) * LARGEST_FACTOR})
    except InputError:
        return max(1.0 / float(getattr(afferent, name)), 1.0 + 1e-9)
    return LARGEST_FACTOR


def check_free(afferent: AnyAfferent, free: Sequence[str]) -> None:
    """Raise `InputError` unless these are numbers of an afferent, at least one and all above zero."""
    known = tuple(getattr(afferent, "__dataclass_fields__", ()))
    if not free:
        words = f"must name at least one number of {type_of(afferent)}, one of {', '.join(known)}"
        raise InputError("free", words, "none")
    for name in free:
        positive(one_of("free", name, known), getattr(afferent, name))


def chosen_numbers(
    afferent: AnyAfferent,
    free: Sequence[str],
    traces: Traces | Sequence[Traces],
    recordings: RateRecordings,
    windows_ms: Windows | None = None,
) -> Search:
    """Search the logarithms of chosen numbers of any afferent over those given."""
    check_free(afferent, free)
    parts = (traces,) if isinstance(traces, Traces) else tuple(traces)
    problem = RateProblem(TypedModel(afferent, tuple(free), parts, windows_ms), recordings)
    low = np.full(len(free), -np.log(LARGEST_FACTOR))
    high = np.log([_largest_factor(afferent, name) for name in free])
    bounds = Bounds(np.minimum(np.log(2.0), 0.5 * high), low, high)
    return Search(problem, bounds, N_STARTS_CHOSEN, N_REFINED_CHOSEN)


@checked
def fit_afferent(
    afferent: AnyAfferent,
    free: Sequence[str],
    traces: Traces | Sequence[Traces],
    recordings: RateRecordings,
    memberships: ArrayLike | None = None,
    windows_ms: Windows | None = None,
) -> TypedFit:
    """Fit chosen numbers of an RA, PC, SAII or SAI afferent, or of one's own, to recorded rates.

    The method is least squares in the logarithms of the numbers, about those of the afferent given. RA and PC
    are judged by spikes per window, SAI and SAII by one over the mean interval.

    Parameters
    ----------
    afferent : AnyAfferent
        Its type, and about which numbers is searched; a dataclass.
    free : sequence of str
        Names of the numbers that are fitted, such as "threshold" and "retraction"; each above 0.
    traces : Traces or sequence of Traces
        What the afferent follows, one column per stimulus of `recordings`.
    recordings : RateRecordings
        Observed rates; a phase that is silent in all stimuli is left out as None.
    memberships : int array (n_stimuli,), optional
        Fold of each stimulus from 0; by default in turn to six, or one per stimulus where there are fewer.
    windows_ms : ((float, float), (float, float)), optional
        Windows of the dynamic and of the static rate; by default those of `rate_windows_ms`. [ms]

    Examples
    --------
    Five ramps of different heights, and an RA whose threshold is to be found again:

    >>> import fingerpad as fp
    >>> course, heights = np.array([0.0, 1.0, 1.0]), np.array([4.0, 6.0, 9.0, 13.0, 18.0])
    >>> stress = fp.Traces([0.0, 50.0, 1000.0], np.outer(course, heights), kinks_ms=[50.0],
    ...     quantity="compressive_stress")
    >>> known = TypedModel(fp.RA(threshold=0.2), (), [stress]).evaluate(np.empty(0))
    >>> recordings = RateRecordings(("a", "b", "c", "d", "e"), known[0], None)
    >>> found = fit_afferent(fp.RA(), ["threshold"], stress, recordings)
    >>> 0.15 < found.afferent.threshold < 0.25, found.fss_in_sample > 0.95
    (True, True)
    """
    search = chosen_numbers(afferent, free, traces, recordings, windows_ms)
    best, validation = validated(search.problem, search.by_differences(), memberships)
    model = cast(TypedModel, search.problem.model)
    dynamic, static = model.evaluate(best.parameters)
    return TypedFit(
        model.at(best.parameters), model.names, best.score, validation.score_test, dynamic, static
    )


@dataclass(frozen=True)
class FourOfSix:
    """Method that fits the paper's six parameters: least squares in the four numbers that rates determine."""

    name: str = "least squares in four numbers"

    def fit(self, problem: Problem, chosen: IntArray) -> Fit:
        """Fit the chosen rates."""
        if not (isinstance(problem, RateProblem) and isinstance(problem.model, AfferentModel)):
            raise InputError("problem", "must have the paper's six parameters", type(problem).__name__)
        search = four_numbers(problem.model, problem.recordings)
        found = search.by_differences().fit(search.problem, chosen)
        history = tuple(replace(step, parameters=fitted_six(step.parameters)) for step in found.history)
        fit = replace(found, parameters=fitted_six(found.parameters), history=history)
        return replace(fit, attempts=(fit,))
