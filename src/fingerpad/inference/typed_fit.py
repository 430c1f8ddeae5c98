"""Fit chosen numbers of an afferent of any type, such as the threshold of an RA, to recorded rates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.signals import INTERVAL, Traces
from fingerpad.core.values import FloatArray, one_of, positive
from fingerpad.data import protocol
from fingerpad.inference.fitting.cross_validation import cross_validate, interleaved_folds
from fingerpad.inference.fitting.least_squares import LeastSquares
from fingerpad.inference.fitting.methods import Bounds
from fingerpad.inference.rate_model import Rates, evaluate_rows
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import RateRecordings
from fingerpad.neuron.afferent import AnyAfferent, type_of
from fingerpad.neuron.spikes import RATE_OF, Windows, rate_windows_ms

LARGEST_FACTOR = 30.0  # How far a fitted number may lie from that of the afferent given, as a factor.
N_STARTS, N_REFINED = 16, 3  # Starts that are scored, and starts from which least squares continues.


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
        numbers: dict[str, Any] = {name: getattr(self.afferent, name) * factor for name, factor in factors}
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

    def evaluate_batch(self, points: FloatArray) -> Rates:
        """Rates for rows of parameters, (n_points, n_stimuli) each."""
        return evaluate_rows(self, points)


@dataclass(frozen=True)
class TypedFit:
    """An afferent of any type as it was fitted to recorded rates."""

    afferent: AnyAfferent  # With the fitted numbers.
    free: tuple[str, ...]
    fss_in_sample: float
    fss_out_of_sample: float
    """Fractional sum of squares of the fit to all stimuli, and its mean over stimuli left out of folds."""
    dynamic_rate_hz: FloatArray
    static_rate_hz: FloatArray  # Rates of the afferent under all stimuli, (n_stimuli,). [spikes/s]


def _largest_factor(afferent: AnyAfferent, name: str) -> float:
    """Return by how much a number can grow: a share of the response only to 1."""
    try:
        replace(cast(Any, afferent), **{name: getattr(afferent, name) * LARGEST_FACTOR})
    except InputError:
        return max(1.0 / float(getattr(afferent, name)), 1.0 + 1e-9)
    return LARGEST_FACTOR


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
    known = tuple(getattr(afferent, "__dataclass_fields__", ()))
    for name in free:
        positive(one_of("free", name, known), getattr(afferent, name))
    model = TypedModel(
        afferent, tuple(free), (traces,) if isinstance(traces, Traces) else tuple(traces), windows_ms
    )
    if not model.names:
        raise InputError("free", f"must name at least one number of {type_of(afferent)}", "none")
    problem = RateProblem(model, recordings)
    low = np.full(len(model.names), -np.log(LARGEST_FACTOR))
    high = np.log([_largest_factor(afferent, name) for name in model.names])
    bounds = Bounds(np.minimum(np.log(2.0), 0.5 * high), low, high)
    method = LeastSquares(bounds.spread(N_STARTS), bounds, n_refined=N_REFINED)
    everything = np.arange(problem.n_observations)
    folds = interleaved_folds(len(everything), min(int(protocol.FOLDS.value), len(everything)))
    best = method.fit(problem, everything)
    validation = cross_validate(problem, method, folds if memberships is None else memberships)
    dynamic, static = model.evaluate(best.parameters)
    return TypedFit(
        cast(Any, model.at(best.parameters)), model.names, best.score, validation.score_test, dynamic, static
    )
