"""From responses and judgements to thresholds: codes, observers, ideal observer, psychometric functions."""

from fingerpad.psychophysics.curve import JudgementCounts, PsychometricFunction
from fingerpad.psychophysics.curve_fit import PsychometricFit, fit_psychometric
from fingerpad.psychophysics.curve_uncertainty import (
    FunctionCloud,
    GoodnessOfFit,
    bootstrap,
    goodness_of_fit,
    posterior,
)
from fingerpad.psychophysics.encoding import Noise, delaunay_pairs, gradient_sum, neighbour_pairs
from fingerpad.psychophysics.ideal_observer import (
    Discriminability,
    GaussianResponses,
    Presentation,
    ResponseModel,
    Statistic,
    discriminability,
    efficiency,
    gaussian_information,
    multiplied_responses,
    noisy_presentations,
    present,
)
from fingerpad.psychophysics.observer import (
    EuclideanDistance,
    Experiment,
    GradientSum,
    discriminate_by,
    fit_noise_sigma,
)
from fingerpad.psychophysics.sensitivity import (
    TASKS,
    Sensitivity,
    d_prime_of_proportion,
    forced_choice,
    same_different_by_difference,
    same_different_by_looks,
    sensitivity,
    yes_no,
)

__all__ = [
    "TASKS", "Discriminability", "EuclideanDistance", "Experiment", "FunctionCloud",
    "GaussianResponses", "GoodnessOfFit", "GradientSum", "JudgementCounts", "Noise", "Presentation",
    "PsychometricFit", "PsychometricFunction", "ResponseModel", "Sensitivity", "Statistic", "bootstrap",
    "d_prime_of_proportion", "delaunay_pairs", "discriminability", "discriminate_by",
    "efficiency", "fit_noise_sigma", "fit_psychometric", "forced_choice", "gaussian_information",
    "goodness_of_fit", "gradient_sum", "multiplied_responses", "neighbour_pairs", "noisy_presentations",
    "posterior", "present", "same_different_by_difference", "same_different_by_looks", "sensitivity",
    "yes_no",
]  # fmt: skip
