"""From responses and judgements to thresholds: psychometric functions, observers and the ideal one."""

from fingerpad.psychophysics.counts import JudgementCounts
from fingerpad.psychophysics.functions import PsychometricFunction
from fingerpad.psychophysics.goodness_of_fit import GoodnessOfFit, goodness_of_fit
from fingerpad.psychophysics.psychometric import PsychometricFit, fit_psychometric
from fingerpad.psychophysics.uncertainty import FunctionCloud, bootstrap, posterior

__all__ = [
    "FunctionCloud",
    "GoodnessOfFit",
    "JudgementCounts",
    "PsychometricFit",
    "PsychometricFunction",
    "bootstrap",
    "fit_psychometric",
    "goodness_of_fit",
    "posterior",
]
