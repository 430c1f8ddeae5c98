"""From responses and judgements to thresholds: codes, observers, ideal observer, psychometric functions."""

from fingerpad.psychophysics.code_efficiency import (
    CodeEfficiency,
    code_efficiency,
    code_statistic,
    noisy_presentations,
)
from fingerpad.psychophysics.functions import JudgementCounts, PsychometricFunction
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
    present,
)
from fingerpad.psychophysics.psychometric import PsychometricFit, fit_psychometric
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
from fingerpad.psychophysics.uncertainty import (
    FunctionCloud,
    GoodnessOfFit,
    bootstrap,
    goodness_of_fit,
    posterior,
)

__all__ = [
    "TASKS", "CodeEfficiency", "Discriminability", "FunctionCloud", "GaussianResponses", "GoodnessOfFit",
    "JudgementCounts", "Presentation", "PsychometricFit", "PsychometricFunction", "ResponseModel",
    "Sensitivity", "Statistic", "bootstrap", "code_efficiency", "code_statistic", "d_prime_of_proportion",
    "discriminability", "efficiency", "fit_psychometric", "forced_choice", "gaussian_information",
    "goodness_of_fit", "multiplied_responses", "noisy_presentations", "posterior", "present",
    "same_different_by_difference", "same_different_by_looks", "sensitivity", "yes_no",
]  # fmt: skip
