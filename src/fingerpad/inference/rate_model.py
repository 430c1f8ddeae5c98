"""Rate models: parameters of an afferent -> its dynamic and static rate under every stimulus; their problem.

All rate models follow one contract, `RateModel`. `AfferentModel` is the paper's model with six parameters.
`Reparametrised` is the same model in other parameters.

`closed_form_rates` is an approximation with derivatives. In the four identifiable parameters
(`fingerpad.inference.identifiable`) the membrane is driven by g = b + k_d U' + k_s U [1/ms], and its
threshold is 1. Under a constant g the potential rises from 0 to the threshold in
tau ln(x / (x - 1)), with the steady potential x = tau g. With the refractory period t_r the rate is

    f = 1 / (t_r + tau ln(x / (x - 1)))    for x > 1, else 0.

Rates counted from spikes jump when a spike enters or leaves a window; f is smooth. At x = 1 its derivative is
infinite, so x - 1 is replaced by s ln(1 + e^((x - 1)/s)) with a width s.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike
from pydantic import SkipValidation

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.signals import Traces
from fingerpad.core.threads import in_blocks
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import Count, Finite, FloatArray, IntArray, Many, NotNegative, Positive
from fingerpad.data import neuron, protocol
from fingerpad.inference.fitting.methods import fractional_sum_of_squares
from fingerpad.inference.identifiable import six_parameters
from fingerpad.inference.recordings import RateRecordings
from fingerpad.neuron.afferent import PARAMETER_NAMES, Afferent, adapted_drive
from fingerpad.neuron.exact_spikes import exact_trains
from fingerpad.neuron.spikes import Windows, check_windows, common_rate_windows_ms, window_rates_hz
from fingerpad.neuron.transduction import PIECES_PER_INTERVAL, Drive, drive, saturated

Rates = tuple[FloatArray, FloatArray]  # Dynamic and static rates, one column per stimulus. [spikes/s]
ROWS_PER_BLOCK = 4  # Rows of parameters that a thread evaluates at a time.


@runtime_checkable
class RateModel(Protocol):
    """Contract of a model that predicts the dynamic and the static rate under every stimulus."""

    @property
    def n_stimuli(self) -> int: ...

    def evaluate(self, parameters: FloatArray) -> Rates:
        """Rates (n_stimuli,) for one set of parameters (n_parameters,). [spikes/s]"""


def evaluate_rows(model: RateModel, points: ArrayLike) -> Rates:
    """Rates (n_points, n_stimuli) for rows of parameters, on all threads. [spikes/s]"""
    rows = np.asarray(points, dtype=np.float64)
    rates = np.empty((2, len(rows), model.n_stimuli))

    def work(block: slice) -> None:
        for row in range(block.start, block.stop):
            rates[:, row] = model.evaluate(rows[row])

    in_blocks(work, len(rows), ROWS_PER_BLOCK)
    return rates[0], rates[1]


@value_class
class AfferentModel:
    """The paper's model of one afferent in its six parameters.

    Examples
    --------
    >>> short = Traces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> longer = Traces([0.0, 50.0, 2000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> model = AfferentModel.of_traces([short, longer, short])
    >>> [drive.n_sites for drive in model.drives]
    [2, 1]
    >>> model.evaluate(Afferent.for_tissues("trial3").parameters)[1].round().tolist()
    [63.0, 63.0, 63.0]
    """

    drives: Many[Drive]  #: One per group of stimuli with the same times, simulated at once.
    stimuli: Many[IntArray]  #: Stimulus number of each column of each drive; every stimulus once.
    windows_ms: Windows | None = None
    """Windows of the dynamic and of the static rate; by default those of the phases of the stimuli. [ms]"""
    refractory_ms: NotNegative = neuron.REFRACTORY.value  #: Refractory period, which is not fitted. [ms]
    initial_mv: Finite | None = None
    """Potential at the start, as of `Afferent`: that at rest by default. [mV]"""
    saturation_per_ma: NotNegative = 0.0  #: As of `Afferent`. [1/mA]

    def __post_init__(self) -> None:
        if self.windows_ms is not None:
            object.__setattr__(self, "windows_ms", check_windows(self.windows_ms, np.inf))
        end = max(bound for window in self.used_windows_ms for bound in window)
        for group, columns in zip(self.drives, self.stimuli, strict=True):
            if group.times_ms[-1] < end:
                said = f"one ends at {end:g} ms, stimulus {columns[0] + 1} at {group.times_ms[-1]:g} ms"
                raise InputError("windows_ms", "must end with the stimuli", remedy=said)

    @classmethod
    def of_traces(
        cls,
        traces: Traces | Sequence[Traces],
        windows_ms: Windows | None = None,
        refractory_ms: Finite = neuron.REFRACTORY.value,
        initial_mv: Finite | None = None,
        pieces: Count = PIECES_PER_INTERVAL,
        like: Afferent | None = None,
    ) -> AfferentModel:
        """Make the model for what drives the afferent, stimuli grouped by their times.

        Parameters
        ----------
        traces : Traces or sequence of Traces
            One column per stimulus; the columns of several traces are numbered consecutively.
        windows_ms, refractory_ms, initial_mv
            As of the class.
        pieces : int, optional
            As of `drive`.
        like : Afferent, optional
            The model adapts and saturates as it does; by default it does neither, as in the paper.
        """
        parts = [traces] if isinstance(traces, Traces) else list(traces)
        quantities = sorted({f"{part.dynamic_quantity} and {part.static_quantity}" for part in parts})
        if len(quantities) != 1:
            wanted = "must bring one dynamic_quantity and one static_quantity"
            raise InputError("traces", wanted, str(", ".join(quantities) or "no traces"))
        groups: dict[tuple[object, ...], list[tuple[int, Traces]]] = {}
        first = 0
        for trace in parts:
            key = trace.times_ms.tobytes(), trace.kinks_ms.tobytes(), trace.phases, trace.onset_ms
            groups.setdefault(key, []).append((first, trace))
            first += trace.n_sites
        drives, columns = [], []
        for group in groups.values():
            driven = drive(Traces.joined([trace for _, trace in group]), pieces=pieces)
            drives.append(driven if like is None else adapted_drive(like, driven))
            columns.append(np.concatenate([start + np.arange(trace.n_sites) for start, trace in group]))
        saturation = 0.0 if like is None else like.saturation_per_ma
        return cls(tuple(drives), tuple(columns), windows_ms, refractory_ms, initial_mv, saturation)

    @cached_property
    def used_windows_ms(self) -> Windows:
        """Windows of the two rates: the given ones, or those of the phases. [ms]"""
        return self.windows_ms or common_rate_windows_ms([group.phases for group in self.drives])

    @property
    def names(self) -> tuple[str, ...]:
        """Full names of beta, k_d, k_s, tau, C, v."""
        return PARAMETER_NAMES

    @property
    def n_stimuli(self) -> int:
        """Number of stimuli."""
        return sum(group.n_sites for group in self.drives)

    def evaluate(self, parameters: FloatArray) -> Rates:
        """Rates (n_stimuli,) for six parameters, bit-equal to `Afferent.rates`. [spikes/s]"""
        six = np.asarray(parameters, dtype=np.float64)
        if not (six.shape == (len(PARAMETER_NAMES),) and np.isfinite(six).all() and (six[3:] > 0.0).all()):
            # It raises the error that names the parameter.
            Afferent.from_parameters(six, refractory_ms=self.refractory_ms, initial_mv=self.initial_mv)
        intercept, dynamic_gain, static_gain, tau, capacitance, threshold = six.tolist()
        initial = np.nan if self.initial_mv is None else self.initial_mv
        membrane = tau, capacitance, threshold, self.refractory_ms, initial
        rates = np.empty((2, self.n_stimuli))
        for driven, columns in zip(self.drives, self.stimuli, strict=True):
            # I = beta + G, in the order of `current_of`.
            current = dynamic_gain * driven.rate_per_ms
            current += static_gain * driven.values
            if self.saturation_per_ma:
                current = saturated(current, self.saturation_per_ma)
            current += intercept
            trains = exact_trains(driven.times_ms, current, membrane)
            rates[:, columns] = [window_rates_hz(*trains, *window) for window in self.used_windows_ms]
        return rates[0], rates[1]


@dataclass(frozen=True)
class Reparametrised:
    """A rate model in other parameters."""

    model: SkipValidation[RateModel]
    transform: Callable[[FloatArray], FloatArray]  #: From the new parameters to those of `model`.

    @property
    def n_stimuli(self) -> int:
        return self.model.n_stimuli

    def evaluate(self, parameters: FloatArray) -> Rates:
        return self.model.evaluate(self.transform(parameters))


def four_number_model(model: RateModel) -> Reparametrised:
    """Express a model of the paper's six parameters in the four identifiable ones."""
    return Reparametrised(model, six_parameters)


BEND = 0.05  # Width s over which the rate sets in, relative to the threshold. [1]
SAMPLES = 16  # Times in each window at which the rate under a constant drive is computed.


@checked
def constant_drive_rate(
    drive_per_ms: ArrayLike,
    time_constant_ms: Positive,
    refractory_ms: NotNegative = neuron.REFRACTORY.value,
    bend: NotNegative = 0.0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rate under a constant drive, and its derivatives along the drive and the time constant."""
    tau = time_constant_ms
    g = np.asarray(drive_per_ms, dtype=np.float64)
    above, slope = _bent(tau * g - 1.0, bend)
    fires = above > 0.0
    above = np.where(fires, above, 1.0)
    x = above + 1.0
    log = np.log1p(1.0 / above)
    rate = 1.0 / (refractory_ms + tau * log)
    # dT/dx = -tau / (x (x - 1)), dT/dtau = ln(x / (x - 1)) at given x; x itself moves with g and with tau.
    per_x = rate**2 * tau / (x * above) * slope
    found = rate, per_x * tau, per_x * g - rate**2 * log
    rates = [MS_PER_S * np.where(fires, values, 0.0) for values in found]
    return rates[0], rates[1], rates[2]


def _bent(excess: FloatArray, bend: float) -> tuple[FloatArray, FloatArray]:
    """Return the smoothed x - 1, which is above 0, and its derivative."""
    if bend == 0.0:
        return excess, np.ones_like(excess)
    return bend * np.logaddexp(0.0, excess / bend), np.exp(-np.logaddexp(0.0, -excess / bend))


def closed_form_rates(stimuli: AfferentModel, four: FloatArray) -> tuple[Rates, Rates]:
    """Mean over each window of the rate under a constant drive, and its derivatives (n_stimuli, 4).

    The charging from rest and single spikes are neglected. The rates are inaccurate in the ramp, but smooth,
    and their derivatives are cheap.
    """
    intercept, dynamic_gain, static_gain, tau = four
    saturation = stimuli.saturation_per_ma * neuron.CAPACITANCE.value * neuron.THRESHOLD.value
    rates, slopes = np.empty((2, stimuli.n_stimuli)), np.empty((2, stimuli.n_stimuli, 4))
    for phase, window_ms in enumerate(stimuli.used_windows_ms):
        for driven, columns in zip(stimuli.drives, stimuli.stimuli, strict=True):
            speed, value = _samples(driven, window_ms)
            both = dynamic_gain * speed + static_gain * value
            passed = 1.0 / (1.0 + saturation * np.abs(both))
            g = intercept + both * passed
            rate, per_drive, per_tau = constant_drive_rate(g, float(tau), stimuli.refractory_ms, BEND)
            rates[phase, columns] = rate.mean(axis=0)
            per_both = per_drive * passed**2
            for number, slope in enumerate((per_drive, per_both * speed, per_both * value, per_tau)):
                slopes[phase, columns, number] = slope.mean(axis=0)
    return (rates[0], rates[1]), (slopes[0], slopes[1])


def _samples(drive: Drive, window_ms: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """U' and U at the centres of equal parts of a window, (SAMPLES, n_stimuli) each."""
    start, end = window_ms
    times = start + (end - start) * (np.arange(SAMPLES) + 0.5) / SAMPLES
    before = np.searchsorted(drive.times_ms, times, "right") - 1
    before = np.clip(before, 0, drive.times_ms.size - 2)
    knots = drive.times_ms[before], drive.times_ms[before + 1]
    share = ((times - knots[0]) / (knots[1] - knots[0]))[:, np.newaxis]
    speed, value = (
        values[before] + share * (values[before + 1] - values[before])
        for values in (drive.rate_per_ms, drive.values)
    )
    return speed, value


@value_class
class RateProblem:
    """Recorded rates and the model that is fitted to them.

    Gerling et al. 2014, Eqs. 12-14. The sums run over the chosen stimuli.
    """

    model: SkipValidation[RateModel]  #: Predicts the rates under all stimuli, in the order of the recordings.
    recordings: RateRecordings  #: Observed rates. A phase that was not recorded does not enter the score.
    dynamic_weight: NotNegative = protocol.DYNAMIC_WEIGHT.value
    static_weight: NotNegative = protocol.STATIC_WEIGHT.value
    """Weights of the two phases where both were recorded, Eq. 12. [1]"""

    def __post_init__(self) -> None:
        self.recordings.check_stimuli(self.model.n_stimuli)

    @property
    def n_observations(self) -> int:
        """Number of stimuli, whether one or two rates were recorded under each."""
        return self.model.n_stimuli

    def residuals(self, parameters: FloatArray, chosen: IntArray) -> FloatArray:
        """Differences of the recorded phases, scaled so that FSS = 1 - residuals @ residuals.

        r_i = sqrt(w / sum f^2) (f_i - p_i), with the weight w, observed f and predicted p of each phase.
        """
        parts = self._recorded(chosen, self.model.evaluate(parameters))
        return np.concatenate(
            [_scale(weight, observed) * (observed - predicted) for weight, observed, predicted in parts]
        )

    def jacobian_of(
        self, slopes: Callable[[FloatArray], Rates]
    ) -> Callable[[FloatArray, IntArray], FloatArray]:
        """Return a function for the Jacobian of the residuals, from derivatives of the rates.

        Its result has the shape (n_residuals, n_parameters).
        """

        def jacobian(parameters: FloatArray, chosen: IntArray) -> FloatArray:
            parts = self._recorded(chosen, slopes(parameters))
            return np.concatenate([-_scale(weight, observed) * fall for weight, observed, fall in parts])

        return jacobian

    def score(self, parameters: FloatArray, chosen: IntArray) -> float:
        """FSS of Eqs. 12-14 over the chosen stimuli, weighted where both phases were recorded."""
        return self._score_of(self.model.evaluate(parameters), chosen)

    def score_batch(self, points: FloatArray) -> FloatArray:
        """FSS over all stimuli for rows of parameters, (n_points,), bit-equal to `score`."""
        everything = np.arange(self.n_observations)
        rates = zip(*evaluate_rows(self.model, points), strict=True)
        return np.array([self._score_of(row, everything) for row in rates])

    def _score_of(self, rates: Rates, chosen: IntArray) -> float:
        return sum(
            weight * fractional_sum_of_squares(observed, predicted)
            for weight, observed, predicted in self._recorded(chosen, rates)
        )

    def score_by_phase(self, parameters: FloatArray, chosen: IntArray) -> dict[str, float]:
        """FSS of each recorded phase, "dynamic" and "static", Eqs. 13 and 14."""
        parts = self._recorded(chosen, self.model.evaluate(parameters))
        scores = (fractional_sum_of_squares(observed, predicted) for _, observed, predicted in parts)
        return dict(zip(self.recordings.phases, scores, strict=True))

    def _recorded(self, chosen: IntArray, of_phases: Rates) -> Iterator[tuple[float, FloatArray, FloatArray]]:
        """Weight, observed rates and entry of `of_phases` of each recorded phase, chosen stimuli only."""
        alone = len(self.recordings.phases) == 1
        weights = (self.dynamic_weight, self.static_weight)
        observed = (self.recordings.dynamic_rate_hz, self.recordings.static_rate_hz)
        for weight, rates, given in zip(weights, observed, of_phases, strict=True):
            if rates is not None:
                yield 1.0 if alone else weight, rates[chosen], given[chosen]


def _scale(weight: float, observed: FloatArray) -> float:
    return float(np.sqrt(weight / (observed @ observed)))
