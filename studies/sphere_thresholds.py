"""Curvature thresholds under spheres pressed to a depth or by a force, and what changes them.

    Weber fraction = (c - s) / s,   c is discriminated from the standard s in 75 % of trials
                   ~ 2 z (spread / G) / elasticity,   elasticity = d ln G / d ln curvature

with G the Gradient Sum of the static rates, its spread under noise, and z of the normal distribution at 75 %.
The noise of every row is fitted anew to people's two hit rates at 287 /m, so that the rows differ in one
cause only and not in how well 287 /m is discriminated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import ConvergenceError
from fingerpad.core.random_streams import Purpose, normals
from fingerpad.core.results import Number, Vector, result_class
from fingerpad.core.units import MN_PER_N
from fingerpad.data import psychophysics
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.gerling2014.curvature_thresholds import (
    LAYOUTS,
    Observer,
    interpolated,
    just_noticeable_difference,
)
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.motion import ForceRampAndHold, RampAndHold
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.discrimination import decision_point, hit_probability, moments, side
from fingerpad.psychophysics.encoding import gradient_sum, neighbour_pairs
from fingerpad.psychophysics.noise_fit import NOISE_DRAWS, fit_noise_sigma
from fingerpad.skin.sampling import SkinResponse

STANDARDS_PER_M = (144.0, 200.0, 287.0)
STANDARD_PER_M = psychophysics.SPHERE_287.value
PRESSED_PER_M = (144.0, 165.0, 190.0, 218.0, 250.0, STANDARD_PER_M, 296.0, 328.0, 365.0)
"""Spheres of every row, of those that `fingerpad reproduce --extended` presses. [1/m]"""

DEEPER_MM = 2.3
FORCES_N = (0.1, 0.2)
"""Forces besides that of the 287 /m sphere at the paper's depth; at the larger one it is `DEEPER_MM` deep."""

PAPER, WHOLE = LAYOUTS["paper"], (10, 10)
"""Receptors along and across: the paper's, and so many that they lie under and around the whole contact."""

CONSTANT_HZ = 100.0
"""Rate by which noise of 1 is multiplied where it does not grow with the rate. [spikes/s]"""

PLACE_SD_MM = 0.3
"""Standard deviation of the place of the sphere from trial to trial, in the row with a varying place. [mm]"""

PLACES = 200
"""Places that the trials of this row take turns in."""

SPARSE_PER_CM2 = psychophysics.HUMAN_RECEPTOR_DENSITY.value


@result_class
class Threshold:
    """Threshold at one standard.

    Parameters
    ----------
    standard_per_m : float
        Curvature of the standard. [1/m]
    weber_fraction : float
        Threshold over standard; NaN if no pressed sphere is discriminated.
    gradient_sum : float
        Of the static rates without noise. [spikes/s]
    elasticity : float
        Relative change of the sum over that of the curvature, from the standard to a sphere 5 % more curved.
    relative_spread : float
        Standard deviation of the noisy sum over its mean.
    depth_mm, force_n : float
        At the end of the hold, of the sphere at the standard or the nearest pressed one. [mm, N]
    """

    standard_per_m: float
    weber_fraction: Number
    gradient_sum: float
    elasticity: float
    relative_spread: float
    depth_mm: float
    force_n: float


@result_class
class ThresholdRow:
    """One way to press spheres, one population and one kind of noise.

    Parameters
    ----------
    pressed, noise, receptors : str
        Depth or force, name in `NOISES`, and population.
    changed : int
        Number of causes that differ from the first row.
    noise_sigma : float
        Fitted to people's two hit rates at 287 /m; NaN if none fits.
    thresholds : tuple of Threshold
        One per standard; empty without a noise.
    """

    pressed: str
    noise: str
    receptors: str
    changed: int
    noise_sigma: Number
    thresholds: tuple[Threshold, ...]

    def weber(self, standard_per_m: float) -> float:
        """Weber fraction at a standard; NaN without a noise."""
        found = {each.standard_per_m: each.weber_fraction for each in self.thresholds}
        return found.get(standard_per_m, np.nan)


@result_class
class SphereThresholds:
    """Thresholds of all rows.

    Parameters
    ----------
    rows : tuple of ThresholdRow
        The first is the paper's: depth, multiplicative noise, 3 by 6 receptors.
    people : array (2,)
        Smallest and largest Weber fraction of people.
    """

    rows: tuple[ThresholdRow, ...]
    people: Vector

    def within(self, row: ThresholdRow, standard_per_m: float) -> bool:
        """Whether a row's fraction lies in people's range, both in whole per cent."""
        low, high = self.people
        return bool(low <= round(row.weber(standard_per_m), 2) <= high)


Noise = Callable[[FloatArray, float, FloatArray], FloatArray]
"""From rates (n_draws or 1, n_receptors), sigma and normal numbers (n_draws, n_receptors) to noisy rates."""


def proportional(rates: FloatArray, sigma: float, draws: FloatArray) -> FloatArray:
    """Noise of the paper: independent, proportional to the rate."""
    return rates * (1.0 + sigma * draws)


def constant(rates: FloatArray, sigma: float, draws: FloatArray) -> FloatArray:
    """Independent noise of the same size at every rate above 0, in units of `CONSTANT_HZ`."""
    return rates + np.where(rates > 0.0, sigma * CONSTANT_HZ * draws, 0.0)


def shared(rates: FloatArray, sigma: float, draws: FloatArray) -> FloatArray:
    """One factor for all afferents in each presentation."""
    return rates * (1.0 + sigma * draws[:, :1])


NOISES: dict[str, Noise] = {
    "proportional to the rate": proportional,
    "independent of the rate": constant,
    "one factor for all": shared,
}
"""Kinds of noise, that of the paper first."""


class NoisyObserver(Observer):
    """Discriminates spheres by the Gradient Sum of interpolated rates, under any noise.

    Parameters
    ----------
    rates : callable
        From the logarithm of the curvature to rates (n_receptors,) or (n_draws, n_receptors).
    neighbours : int array (n_pairs, 2)
        Of the population.
    noise_sigma : float
        Size of the noise.
    draws : array (n_draws, n_receptors)
        Standard normal numbers that serve every sphere.
    noise : callable
        Makes rates noisy.
    """

    def __init__(
        self,
        rates: PchipInterpolator,
        neighbours: np.ndarray,
        noise_sigma: float,
        draws: FloatArray,
        noise: Noise = proportional,
    ):
        super().__init__(rates, neighbours, noise_sigma, draws)
        self.noise = noise

    def with_noise(self, noise_sigma: float) -> NoisyObserver:
        """Return the same observer with another size of the noise."""
        return NoisyObserver(self.rates, self.neighbours, noise_sigma, self.draws, self.noise)

    def sums(self, curvature_per_m: float) -> FloatArray:
        """Noisy Gradient Sums of a sphere, (n_draws,). [spikes/s]"""
        noisy = self.noise(np.atleast_2d(self.responses(curvature_per_m)), self.noise_sigma, self.draws)
        return gradient_sum(noisy, self.neighbours)

    def clean_sum(self, curvature_per_m: float) -> float:
        """Gradient Sum of a sphere without noise, mean over places. [spikes/s]"""
        return float(np.mean(gradient_sum(self.responses(curvature_per_m), self.neighbours)))

    def hit_rate(self, standard_per_m: float, comparison_per_m: float) -> float:
        """Hit rate of the comparison against the standard. [0-1]"""
        means, spreads = moments(np.stack([self.sums(standard_per_m), self.sums(comparison_per_m)]))
        point = decision_point(means[0], means[1:], psychophysics.DECISION_CRITERION.value)
        return float(hit_probability(point, means[1:], spreads[1:], side(means[np.newaxis]))[0])


@dataclass(frozen=True)
class Variant:
    """One row: how spheres are pressed and who judges them.

    Parameters
    ----------
    stimulus : RampAndHold or ForceRampAndHold, optional
        Motion of all spheres.
    noise : str, optional
        Name in `NOISES`.
    layout : (int, int), optional
        Receptors along the finger and across.
    density_per_cm2 : float, optional
        Of the receptors. [1/cm2]
    place_sd_mm : float, optional
        Standard deviation of the place of the sphere from trial to trial, along and across. [mm]
    """

    stimulus: RampAndHold | ForceRampAndHold = field(default_factory=RampAndHold)
    noise: str = "proportional to the rate"
    layout: tuple[int, int] = PAPER
    density_per_cm2: float = psychophysics.RECEPTOR_DENSITY.value
    place_sd_mm: float = 0.0

    @property
    def pressed(self) -> str:
        """How spheres are pressed, in words."""
        motion = self.stimulus
        by = (
            f"{motion.force_mn / MN_PER_N:.3g} N"
            if isinstance(motion, ForceRampAndHold)
            else f"{motion.depth_mm:g} mm"
        )
        return f"{by}, place varies by {self.place_sd_mm:g} mm" if self.place_sd_mm else by

    @property
    def receptors(self) -> str:
        """The population, in words."""
        return f"{self.layout[0]} by {self.layout[1]}, {self.density_per_cm2:g} per cm²"

    @property
    def changed(self) -> int:
        """Number of causes that differ from the paper's."""
        own = (getattr(self, each.name) for each in fields(self))
        paper = (getattr(Variant(), each.name) for each in fields(self))
        return sum(mine != theirs for mine, theirs in zip(own, paper, strict=True))


def variants(force_n: float) -> tuple[Variant, ...]:
    """All rows: the paper's, one cause changed, then force with each noise and two populations.

    Parameters
    ----------
    force_n : float
        Force of the 287 /m sphere at the paper's depth. [N]
    """
    paper, (_, independent, common) = Variant(), NOISES
    single = (
        replace(paper, noise=independent),
        replace(paper, noise=common),
        replace(paper, place_sd_mm=PLACE_SD_MM),
        replace(paper, layout=LAYOUTS["square"]),
        replace(paper, layout=WHOLE),
        replace(paper, density_per_cm2=SPARSE_PER_CM2),
        replace(paper, stimulus=RampAndHold(depth_mm=DEEPER_MM)),
    )
    by_force = tuple(
        Variant(ForceRampAndHold(force_mn=MN_PER_N * newton), noise, layout)
        for newton in (force_n, *FORCES_N)
        for layout in (PAPER, WHOLE)
        for noise in (paper.noise, independent)
    )
    return (paper, *single, *by_force)


def touches(variant: Variant, conditions: Conditions) -> dict[float, Touch]:
    """Spheres of one row, by curvature. [1/m]"""
    return {
        curvature: replace(conditions.sphere_touch(curvature), stimulus=variant.stimulus)
        for curvature in PRESSED_PER_M
    }


def run(runner: Runner, conditions: Conditions, afferent: Afferent) -> SphereThresholds:
    """Press what is missing, and compute the thresholds of all rows.

    Parameters
    ----------
    runner : Runner
        Stores the presses.
    conditions : Conditions
        Finger, tissues, resolution and seed.
    afferent : Afferent
        Of all receptors.

    Returns
    -------
    SphereThresholds

    Raises
    ------
    ConvergenceError, InputError
        If a sphere cannot be pressed.
    """
    paper = conditions.sphere_touch(STANDARD_PER_M)
    runner.solve([paper], "sphere at the paper's depth")
    force_n = float(runner.store.load(paper).force_mn[-1]) / MN_PER_N
    rows = []
    for variant in variants(round(force_n, 3)):
        pressed = touches(variant, conditions)
        runner.solve(pressed.values(), f"spheres, {variant.pressed}")
        skins = {curvature: runner.store.load(touch) for curvature, touch in pressed.items()}
        rows.append(threshold_row(variant, skins, afferent, conditions.seed))
    return SphereThresholds(rows=tuple(rows), people=np.array(psychophysics.WEBER_FRACTIONS.value))


def threshold_row(
    variant: Variant, skins: Mapping[float, SkinResponse], afferent: Afferent, seed: int
) -> ThresholdRow:
    """Fit the noise of one row to people, and compute its thresholds.

    Parameters
    ----------
    variant : Variant
        Population and noise.
    skins : mapping of float to SkinResponse
        Presses by curvature, people's three spheres among them. [1/m]
    afferent : Afferent
        Of all receptors.
    seed : int
        Of the random numbers.
    """
    curvatures = np.array(sorted(skins))
    grid = Population.grid(variant.density_per_cm2, *variant.layout, (RECEPTOR_X_MM, 0.0), afferent)
    draws = normals(seed, 1, len(grid), Purpose.RESPONSE, NOISE_DRAWS)[0].T
    table = static_rates(grid, [skins[at] for at in curvatures.tolist()], variant.place_sd_mm, seed)
    quiet = NoisyObserver(
        interpolated(curvatures, table),
        neighbour_pairs(grid.positions_mm, grid.pitch_mm),
        0.0,
        draws,
        NOISES[variant.noise],
    )
    thresholds: tuple[Threshold, ...] = ()
    try:
        sigma = fit_noise_sigma(lambda noise: _people(quiet.with_noise(noise))).noise_sigma
    except ConvergenceError:
        sigma = np.nan
    else:
        observer = quiet.with_noise(sigma)
        thresholds = tuple(_threshold(observer, standard, skins) for standard in STANDARDS_PER_M)
    return ThresholdRow(
        pressed=variant.pressed,
        noise=variant.noise,
        receptors=variant.receptors,
        changed=variant.changed,
        noise_sigma=sigma,
        thresholds=thresholds,
    )


def static_rates(
    grid: Population, skins: Sequence[SkinResponse], place_sd_mm: float = 0.0, seed: int = 0
) -> FloatArray:
    """Compute the static rates of a population under each press.

    Parameters
    ----------
    grid : Population
        Receptors about the middle of the spheres.
    skins : sequence of SkinResponse
        Presses.
    place_sd_mm : float, optional
        Standard deviation of the place of the sphere; receptors are moved instead of it. [mm]
    seed : int, optional
        Of the places.

    Returns
    -------
    array (n_presses, n_receptors) or (n_presses, NOISE_DRAWS, n_receptors)
        The latter if the place varies: `PLACES` places take turns. [spikes/s]
    """
    if place_sd_mm == 0.0:
        return np.array([grid.respond(skin).static_rate_hz for skin in skins])
    moves_mm = place_sd_mm * normals(seed, 2, 1, Purpose.PICK, PLACES)[:, 0].T
    moved = grid.positions_mm + moves_mm[:, None]
    everywhere = replace(grid, positions_mm=moved.reshape(-1, 2), places_mm=None)
    rates = np.array([everywhere.respond(skin).static_rate_hz for skin in skins])
    by_place = rates.reshape(len(skins), PLACES, len(grid))
    return by_place[:, np.arange(NOISE_DRAWS) % PLACES]


def _people(observer: NoisyObserver) -> FloatArray:
    """Hit rates of the spheres for which people's are known."""
    return np.array([
        observer.hit_rate(STANDARD_PER_M, curvature) for curvature in psychophysics.GOODWIN_CURVATURES.value
    ])  # fmt: skip


def _threshold(observer: NoisyObserver, standard: float, skins: Mapping[float, SkinResponse]) -> Threshold:
    try:
        weber = just_noticeable_difference(observer, standard) / standard
    except ConvergenceError:
        weber = np.nan
    at, beyond = observer.clean_sum(standard), observer.clean_sum(1.05 * standard)
    mean, spread = moments(observer.sums(standard))
    nearest = skins[min(skins, key=lambda curvature: abs(curvature - standard))]
    return Threshold(
        standard_per_m=standard,
        weber_fraction=weber,
        gradient_sum=at,
        elasticity=float(np.log(beyond / at) / np.log(1.05)),
        relative_spread=float(spread / mean),
        depth_mm=float(nearest.depth_mm[-1]),
        force_n=float(nearest.force_mn[-1]) / MN_PER_N,
    )
