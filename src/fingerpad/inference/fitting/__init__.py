"""Fit any function of a few parameters; nothing here knows a model.

Goodness of fit (Eqs. 12-14), the response surface method and cross validation of the paper's section 2.2.2,
and other methods beside it. A method fits a `Problem` and gives a `Fit`.
"""

from fingerpad.inference.fitting.cross_validation import (
    CrossValidation,
    FoldFit,
    cross_validate,
    folds_of,
    interleaved_folds,
)
from fingerpad.inference.fitting.fractional_sum_of_squares import (
    fractional_sum_of_squares,
    weighted_fractional_sum_of_squares,
)
from fingerpad.inference.fitting.methods import Continued, Fit, FitStep, Method, ResponseSurface, best_of
from fingerpad.inference.fitting.problem import Problem
from fingerpad.inference.fitting.response_surface import (
    Iteration,
    ResponseSurfaceFit,
    coding_increments,
    factorial_design,
    maximise,
    regression_slopes,
)

__all__ = [
    "Continued",
    "CrossValidation",
    "Fit",
    "FitStep",
    "FoldFit",
    "Iteration",
    "Method",
    "Problem",
    "ResponseSurface",
    "ResponseSurfaceFit",
    "best_of",
    "coding_increments",
    "cross_validate",
    "factorial_design",
    "folds_of",
    "fractional_sum_of_squares",
    "interleaved_folds",
    "maximise",
    "regression_slopes",
    "weighted_fractional_sum_of_squares",
]
