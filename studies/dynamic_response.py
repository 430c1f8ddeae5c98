"""What the dynamic rates lack: explanations side by side, each with the numbers that it adds.

Under the flat middle of the bar the observed afferent fires in the ramp, where strain energy density (SED)
hardly moves. An end organ with several branches, a place that is not where we think, a compressive law, skin
or membrane that is slow, and another quantity could each make up for that. Every explanation here turns its
own numbers into a drive; four numbers of the afferent are fitted besides, in the same way for all.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.signals import STORED_ENERGY, SedTraces
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.inference.closed_form import ClosedFormModel
from fingerpad.inference.identifiable import identifiable
from fingerpad.inference.rate_model import AfferentModel, Rates, evaluate_rows
from fingerpad.neuron.transduction import Drive, drive
from fingerpad.skin.sampling import SkinResponse
from studies.drive_fits import RELATIVE_NAMES, scaled_starts, six_of_relative
from studies.drive_quantities import EXTENDED

ALONG_MM = tuple(round(0.1 * step, 1) for step in range(-15, 16))
"""Sites along the finger about the receptor. [mm]"""

ACROSS_MM = tuple(round(0.25 * step, 2) for step in range(7))
"""Sites across the finger; the other side is their mirror image. [mm]"""

STRESS = EXTENDED.dynamic
PATCH_QUANTITIES = (STORED_ENERGY, STRESS, "von_mises")


@dataclass(frozen=True)
class Patch:
    """Quantities on a patch of skin about the receptor, under every shift of the bar.

    Parameters
    ----------
    times_ms : array (n_times,)
        From the onset. [ms]
    kinks_ms : array (n_kinks,)
        Where the motion changes abruptly. [ms]
    along_mm, across_mm : array (n_along,), (n_across,)
        Offsets from the receptor, the second from 0 on. [mm]
    values : dict of str to array (n_times, n_shifts, n_along, n_across)
        By the names of `SkinResponse.sample`.
    """

    times_ms: FloatArray
    kinks_ms: FloatArray
    along_mm: FloatArray
    across_mm: FloatArray
    values: dict[str, FloatArray]

    def at(self, quantity: str, offset_mm: float = 0.0) -> FloatArray:
        """Quantity at one place along the finger, linear between sites, (n_times, n_shifts)."""
        place = float(np.clip(offset_mm, self.along_mm[0], self.along_mm[-1]))
        left = min(int(np.searchsorted(self.along_mm, place, side="right")) - 1, self.along_mm.size - 2)
        share = (place - self.along_mm[left]) / (self.along_mm[left + 1] - self.along_mm[left])
        row = self.values[quantity][..., 0]
        return (1.0 - share) * row[..., left] + share * row[..., left + 1]

    def mean(self, quantity: str, along_mm: float, across_mm: float = 0.0) -> FloatArray:
        """Mean over a cluster of end organs, normally distributed with these standard deviations."""
        weights_along = _normal(self.along_mm, along_mm)
        weights_across = _normal(self.across_mm, across_mm) * np.where(self.across_mm > 0.0, 2.0, 1.0)
        weights = np.outer(weights_along, weights_across)
        return np.tensordot(self.values[quantity], weights / weights.sum(), axes=2)

    def largest(self, quantity: str, reach_mm: float) -> FloatArray:
        """Largest value within a reach along the finger: the branch that is driven hardest sets the pace."""
        within = np.abs(self.along_mm) <= reach_mm + 1e-9
        return self.values[quantity][..., within, 0].max(axis=-1)

    def drive(self, static: FloatArray, dynamic: FloatArray | None = None) -> Drive:
        """Drive of traces (n_times, n_shifts), the dynamic term following others if given."""
        driven = drive(SedTraces(self.times_ms, static, self.kinks_ms))
        return driven if dynamic is None else self.following(dynamic, driven)

    def following(self, dynamic: FloatArray, static: Drive | None = None) -> Drive:
        """Let the dynamic term follow traces (n_times, n_shifts), the static one the receptor's energy."""
        followed = drive(SedTraces(self.times_ms, dynamic, self.kinks_ms))
        return replace(static or self.energy, rate_kpa_per_ms=followed.rate_kpa_per_ms)

    @cached_property
    def energy(self) -> Drive:
        """What the paper's model feels, made once."""
        return self.drive(self.at(STORED_ENERGY))


def _normal(offsets_mm: FloatArray, width_mm: float) -> FloatArray:
    # A cluster narrower than the sites stand apart is the site in its middle.
    if width_mm <= 0.0:
        return (offsets_mm == 0.0).astype(np.float64)
    return np.exp(-0.5 * (offsets_mm / width_mm) ** 2)


def sampled_patch(responses: Sequence[SkinResponse]) -> Patch:
    """Read the patch from one response per shift of the bar."""
    along, across = np.array(ALONG_MM), np.array(ACROSS_MM)
    x, z = np.meshgrid(RECEPTOR_X_MM + along, across, indexing="ij")
    sites = np.column_stack([x.ravel(), z.ravel()])
    shape = (-1, along.size, across.size)
    values = {
        name: np.stack([skin.sample(name, sites).reshape(shape) for skin in responses], axis=1)
        for name in PATCH_QUANTITIES
    }
    first = responses[0]
    return Patch(first.times_ms, np.array(first.kinks_ms), along, across, values)


@dataclass(frozen=True)
class Added:
    """A number that an explanation adds to the four of the afferent.

    Parameters
    ----------
    name : str
        With its unit.
    start : float
        Where a fit begins.
    most : float
        A fit goes no farther.
    signed : bool
        Whether it may be negative; if not, it is `start` times an exponential and stays positive.
    """

    name: str
    start: float
    most: float
    signed: bool = False

    def value(self, relative: float) -> float:
        """Return the number for a relative one, which is 0 at the start."""
        if self.signed:
            return self.start + float(np.clip(relative, -self.most, self.most))
        return min(self.start * math.exp(min(relative, 50.0)), self.most)


@dataclass(frozen=True)
class Explanation:
    """One way to make up for what the dynamic rates lack.

    Parameters
    ----------
    name : str
        What tables call it.
    added : tuple of Added
        Its own numbers.
    driven : callable
        From a patch and these numbers to a drive.
    by_formula : bool, optional
        Take rates from the closed form for a steady current instead of spikes, as if a window could not cut
        intervals off.
    """

    name: str
    added: tuple[Added, ...]
    driven: Callable[[Patch, FloatArray], Drive]
    by_formula: bool = False


def _powered(values: FloatArray, exponent: float) -> FloatArray:
    """Power law that leaves the largest value as it is, so that the gains keep their meaning."""
    largest = values.max()
    return largest * (values / largest) ** exponent


def low_passed(driven: Drive, time_constant_ms: float) -> Drive:
    """Let the rate of change pass a filter of first order, tau_r dy/dt = |Q'| - y, from y = 0.

    Exact at the knots for a rate that is linear between them. With energies that are proportional to each
    other in space this is also what a fast branch of the skin's relaxation would do, whose stress is the
    filtered rate times its modulus and tau_r.

    Parameters
    ----------
    driven : Drive
        Its rate is filtered.
    time_constant_ms : float
        tau_r. [ms]

    Returns
    -------
    Drive

    Examples
    --------
    A rate that steps to 1 is followed by 1 - exp(-t/tau_r):

    >>> step = Drive([0.0, 0.0, 10.0, 20.0], np.zeros((4, 1)), [[0.0], [1.0], [1.0], [1.0]])
    >>> low_passed(step, 10.0).rate_kpa_per_ms[:, 0].round(4).tolist()
    [0.0, 0.0, 0.6321, 0.8647]
    """
    rate, x = driven.rate_kpa_per_ms, np.diff(driven.times_ms)[:, np.newaxis] / time_constant_ms
    gone = -np.expm1(-x)
    # Over a jump no time passes and nothing is gained.
    slope = np.divide(np.diff(rate, axis=0), x, out=np.zeros_like(rate[1:]), where=x > 0.0)
    gained = rate[:-1] * gone + slope * (x - gone)
    filtered = np.zeros_like(rate)
    for knot, (kept, more) in enumerate(zip(1.0 - gone, gained, strict=True)):
        filtered[knot + 1] = filtered[knot] * kept + more
    return replace(driven, rate_kpa_per_ms=filtered)


_OFFSET = Added("offset_mm", 0.0, 1.0, signed=True)
_WIDTH = Added("width_along_mm", 0.2, 1.5)
_ACROSS = Added("width_across_mm", 0.2, 1.5)
_REACH = Added("reach_mm", 0.2, 1.5)
_EXPONENT = Added("exponent", 0.7, 3.0)
_FILTER = Added("time_constant_ms", 10.0, 500.0)


def _energy_powered(patch: Patch, numbers: FloatArray) -> Drive:
    return patch.drive(_powered(patch.at(STORED_ENERGY), numbers[0]))


def _rate_powered(patch: Patch, numbers: FloatArray) -> Drive:
    driven = patch.energy
    return replace(driven, rate_kpa_per_ms=_powered(driven.rate_kpa_per_ms, numbers[0]))


EXPLANATIONS: tuple[Explanation, ...] = (
    Explanation("the paper's model", (), lambda patch, _: patch.energy),
    Explanation(
        "rate by formula, without intervals",
        (),
        lambda patch, _: patch.energy,
        by_formula=True,
    ),
    Explanation(
        "offset of the receptor", (_OFFSET,), lambda patch, n: patch.drive(patch.at(STORED_ENERGY, n[0]))
    ),
    Explanation(
        "mean of a cluster along the finger",
        (_WIDTH,),
        lambda patch, n: patch.drive(patch.mean(STORED_ENERGY, n[0])),
    ),
    Explanation(
        "mean of a cluster along and across",
        (_WIDTH, _ACROSS),
        lambda patch, n: patch.drive(patch.mean(STORED_ENERGY, *n)),
    ),
    Explanation(
        "mean of a cluster, dynamic term alone",
        (_WIDTH,),
        lambda patch, n: patch.following(patch.mean(STORED_ENERGY, n[0])),
    ),
    Explanation(
        "maximum over a cluster",
        (_REACH,),
        lambda patch, n: patch.drive(patch.largest(STORED_ENERGY, n[0])),
    ),
    Explanation(
        "slow dynamic term or fast relaxation",
        (_FILTER,),
        lambda patch, n: low_passed(patch.energy, n[0]),
    ),
    Explanation("power law of both terms", (_EXPONENT,), _energy_powered),
    Explanation("power law of the dynamic term", (_EXPONENT,), _rate_powered),
    Explanation(
        "dynamic term follows von Mises stress",
        (),
        lambda patch, _: patch.following(patch.at("von_mises")),
    ),
    Explanation(
        "dynamic term follows compressive stress",
        (),
        lambda patch, _: patch.following(patch.at(STRESS)),
    ),
    Explanation(
        "compressive stress, power law",
        (replace(_EXPONENT, start=1.0),),
        lambda patch, n: patch.following(_powered(patch.at(STRESS), n[0])),
    ),
    Explanation(
        "compressive stress, cluster",
        (_WIDTH,),
        lambda patch, n: patch.following(patch.mean(STRESS, n[0])),
    ),
    Explanation(
        "compressive stress, offset of the receptor",
        (_OFFSET,),
        lambda patch, n: patch.drive(patch.at(STORED_ENERGY, n[0]), patch.at(STRESS, n[0])),
    ),
)
"""From the paper's model on; each adds as many numbers as it names."""


@dataclass(frozen=True)
class ExplainedModel:
    """Rates by an explanation: four numbers of the afferent near a start, then the explanation's own.

    Parameters
    ----------
    explanation : Explanation
        What makes the drive.
    patch : Patch
        From what.
    start : array (6,)
        Parameters of the afferent where the relative numbers are 0.
    """

    explanation: Explanation
    patch: Patch
    start: FloatArray

    @classmethod
    def from_start(cls, explanation: Explanation, patch: Patch) -> ExplainedModel:
        """Begin at the paper's first start, its gains rescaled to the drive with which a fit begins."""
        numbers = np.array([added.start for added in explanation.added])
        return cls(explanation, patch, scaled_starts(explanation.driven(patch, numbers), patch.energy)[0])

    @property
    def names(self) -> tuple[str, ...]:
        """The four relative numbers of the afferent, and those added."""
        return (*RELATIVE_NAMES, *(added.name for added in self.explanation.added))

    @property
    def n_stimuli(self) -> int:
        """Number of shifts."""
        return self.patch.values[STORED_ENERGY].shape[1]

    def numbers(self, parameters: FloatArray) -> FloatArray:
        """Return the added numbers in their units."""
        return np.array(
            [
                added.value(relative)
                for added, relative in zip(
                    self.explanation.added, parameters[len(RELATIVE_NAMES) :], strict=True
                )
            ]
        )

    def evaluate(self, parameters: FloatArray) -> Rates:
        """Dynamic and static rates. [spikes/s]"""
        driven = AfferentModel.of_drive(self._drive(self.numbers(parameters)))
        six = six_of_relative(parameters[: len(RELATIVE_NAMES)], self.start)
        if self.explanation.by_formula:
            return ClosedFormModel(driven, bend=0.0).evaluate(identifiable(six))
        return driven.evaluate(six)

    def evaluate_batch(self, points: FloatArray) -> Rates:
        """Rates (n_points, n_stimuli) for rows of parameters, bit-equal to `evaluate`. [spikes/s]"""
        return evaluate_rows(self, points)

    def _drive(self, numbers: FloatArray) -> Drive:
        """Drive for the added numbers; the last one is kept, since slopes mostly leave these as they are."""
        key = numbers.tobytes()
        if key not in self._last:
            self._last.clear()
            self._last[key] = self.explanation.driven(self.patch, numbers)
        return self._last[key]

    @cached_property
    def _last(self) -> dict[bytes, Drive]:
        return {}
