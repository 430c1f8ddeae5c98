"""A reproduction in a few plain numbers: the block `summary` of `results.json`, one set beside the other."""

from __future__ import annotations

from fingerpad.core.results import Number, result_class
from fingerpad.experiments.gerling2014.curvature_thresholds import CurvatureThresholds
from fingerpad.experiments.gerling2014.response_maps import resting_response
from fingerpad.experiments.gerling2014.single_unit import SingleUnitResult
from fingerpad.experiments.gerling2014.skin_force import SkinForce
from fingerpad.experiments.gerling2014.sphere_discrimination import SphereDiscrimination
from fingerpad.neuron.afferent import Afferent


@result_class
class Summary:
    """One number per quantity, at the tissues, the afferent and the noise of the run."""

    deflection_r2: Number
    """R² of the deflection under the cylinder at 1.0 mm."""
    force_plate_1mm_n: Number
    force_plate_2mm_n: Number
    force_disc_1mm_n: Number
    """Force at the end of the hold of a flat plate 1.0 and 2.0 mm deep, and of a disc of 6.35 mm. [N]"""
    fss_out_of_sample: Number
    fss_in_sample: Number
    """Fractional sum of squares of the rates under the bar: mean of the folds, and all shifts."""
    dynamic_flat_hz: Number
    dynamic_max_hz: Number
    """Smallest dynamic rate under the flat face of the bar, and the largest. [spikes/s]"""
    static_difference_hz: Number
    """Largest static rate less the smallest under the flat face. [spikes/s]"""
    resting_rate_hz: Number
    """Rate without a touch. [spikes/s]"""
    noise_sigma: Number
    """Noise that fits people's two points best."""
    euclidean_rms_same_noise: Number
    """Root mean square distance of the Euclidean Distance to these points at that noise. [0-1]"""
    hit_rate_296: tuple[Number, Number]
    hit_rate_365: tuple[Number, Number]
    """Hit rates of the static Gradient Sum at that noise, spheres at 0.0 and at 0.2 mm. [0-1]"""
    weber_144: Number
    weber_287: Number
    """Curvature threshold at 75 % over the standard; NaN where it was not asked for or does not exist."""
    wall_s: float = 0.0
    peak_memory_mb: float = 0.0
    """Of the whole run, both sets. [s, MB]"""


@result_class
class Summaries:
    """Numbers of both sets, and time and memory of the whole run."""

    paper: Summary
    human: Summary
    wall_s: float
    peak_memory_mb: float


def summary(
    force: SkinForce,
    unit: SingleUnitResult,
    afferent: Afferent,
    discrimination: SphereDiscrimination,
    thresholds: CurvatureThresholds | None,
) -> Summary:
    """Collect the numbers of one set; time and memory are known when the run ends."""
    dynamic, static = unit.modulation.dynamic.ours, unit.modulation.static.ours
    centred, shifted = (place.at_goodwin for place in discrimination.statistics.targets)
    at_296, at_365 = ((here.value, aside.value) for here, aside in zip(centred, shifted, strict=True))
    return Summary(
        deflection_r2=force.deflection_r2,
        force_plate_1mm_n=force.plate_1mm_n,
        force_plate_2mm_n=force.plate_2mm_n,
        force_disc_1mm_n=force.disc_1mm_n,
        fss_out_of_sample=unit.fss_out_of_sample,
        fss_in_sample=unit.fss_in_sample,
        dynamic_flat_hz=dynamic.minimum_hz,
        dynamic_max_hz=dynamic.maximum_hz,
        static_difference_hz=static.difference_hz,
        resting_rate_hz=resting_response(afferent).static_rate_hz,
        noise_sigma=discrimination.noise_sigma,
        euclidean_rms_same_noise=discrimination.statistics.misfit["euclidean"].value,
        hit_rate_296=at_296,
        hit_rate_365=at_365,
        weber_144=weber_fraction(thresholds, 144.0),
        weber_287=weber_fraction(thresholds, 287.0),
    )


def weber_fraction(thresholds: CurvatureThresholds | None, standard_per_m: float) -> float:
    """Weber fraction of the paper's population at one standard, NaN without one."""
    if thresholds is None:
        return float("nan")
    found = {one.standard_per_m: one.weber_fraction for one in thresholds.populations[0].standards}
    return found.get(standard_per_m, float("nan"))
