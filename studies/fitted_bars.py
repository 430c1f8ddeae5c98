"""The afferent of the reproduction: pressed with the bar at all shifts, and fitted by the paper's method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fingerpad.core.signals import SedTraces
from fingerpad.experiments.conditions import Conditions, Touch
from fingerpad.experiments.gerling2014 import single_unit
from fingerpad.experiments.runner import Runner
from fingerpad.inference.fitting.cross_validation import CrossValidation
from fingerpad.inference.fitting.methods import Fit
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.neuron.afferent import Afferent
from fingerpad.skin.sampling import SkinResponse


@dataclass(frozen=True)
class FittedBars:
    """The bar at all shifts, the fit to them, and what else was pressed.

    Parameters
    ----------
    bars : list of SkinResponse
        One per shift.
    sed : SedTraces
        At the receptor, one column per shift.
    problem : RateProblem
        Observed rates and the paper's model.
    best : Fit
        To all shifts.
    folds : CrossValidation
        The six folds.
    others : dict of str to dict of key to SkinResponse
        What was pressed besides, by its group.
    """

    bars: list[SkinResponse]
    sed: SedTraces
    problem: RateProblem
    best: Fit
    folds: CrossValidation
    others: dict[str, dict[Any, SkinResponse]]

    @property
    def afferent(self) -> Afferent:
        """The afferent of the best fit."""
        return Afferent.from_parameters(
            self.best.parameters,
            dynamic_quantity=self.sed.dynamic_quantity,
            static_quantity=self.sed.static_quantity,
        )


def fit_bars(
    runner: Runner, conditions: Conditions, others: Mapping[str, Mapping[Any, Touch]] | None = None
) -> FittedBars:
    """Press the bar at all shifts, and fit the afferent by the paper's method, SED in both terms.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.
    conditions : Conditions
        Finger, tissues and accuracy.
    others : mapping of str to mapping of key to Touch, optional
        What is pressed besides, by group.

    Returns
    -------
    FittedBars
    """
    group = "bar, 36 shifts"
    pressed = {group: dict(enumerate(single_unit.bar_touches(conditions))), **(others or {})}
    responses = runner.responses(pressed)
    bars = list(responses.pop(group).values())
    with runner.stage("fit", 1) as advance:
        sed = single_unit.receptor_sed(bars)
        problem = single_unit.rate_problem(sed)
        best, folds = single_unit.fit(problem)
        advance()
    return FittedBars(bars, sed, problem, best, folds, responses)
