"""Rates for many sets of parameters at once, as samplers and sensitivity analyses ask for them.

Rows are shared out to threads; the bits are those of `RateModel.rates`, row by row.
"""

from __future__ import annotations

import numpy as np

from fingerpad.core.blocks import in_blocks
from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.inference.quick_rates import Rates, rates_under
from fingerpad.inference.rate_problem import AfferentModel, RateModel, RateProblem, Reparametrised

ROWS_PER_TURN = 4
"""Rows that a thread takes at a time."""


def rates_of_each(model: RateModel, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Dynamic and static rates for every row of parameters.

    Parameters
    ----------
    model : RateModel
        What predicts.
    points : array (n_points, n_parameters)
        One set of parameters per row.

    Returns
    -------
    dynamic_hz, static_hz : array (n_points, n_stimuli)
        Rates, to the bits those of `model.rates`. [spikes/s]

    Raises
    ------
    InputError
        If a row is no set of parameters of the model.

    Examples
    --------
    >>> from fingerpad.neuron.afferent import Afferent
    >>> from fingerpad.core.signals import SedTraces
    >>> from fingerpad.neuron.transduction import drive
    >>> sed = SedTraces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> points = Afferent().parameters * np.array([[1.0], [1.2]])
    >>> dynamic_hz, static_hz = rates_of_each(AfferentModel(drive(sed)), points)
    >>> dynamic_hz.round().tolist(), static_hz.round().tolist()
    ([[217.0], [188.0]], [[63.0], [53.0]])
    """
    rows = np.asarray(points, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != len(model.names):
        raise InputError(f"points must have {len(model.names)} columns: got shape {rows.shape}.")
    rates = np.empty((2, len(rows), model.n_stimuli))

    def work(turn: slice) -> None:
        one = _prepared(model)
        for row in range(turn.start, turn.stop):
            rates[0, row], rates[1, row] = one(rows[row])

    in_blocks(work, len(rows), ROWS_PER_TURN)
    return rates[0], rates[1]


def scores_of_each(problem: RateProblem, points: FloatArray) -> FloatArray:
    """FSS of Eqs. 12-14 over all stimuli, for every row of parameters.

    Parameters
    ----------
    problem : RateProblem
        What predicts, and what was observed.
    points : array (n_points, n_parameters)
        One set of parameters per row.

    Returns
    -------
    array (n_points,)
        `problem.score` of each row.

    Examples
    --------
    >>> from fingerpad.neuron.afferent import Afferent
    >>> from fingerpad.inference.recordings import RateRecordings
    >>> from fingerpad.core.signals import SedTraces
    >>> from fingerpad.neuron.transduction import drive
    >>> sed = SedTraces([0.0, 50.0, 1000.0], [[0.0], [2.0], [2.0]], kinks_ms=[50.0])
    >>> problem = RateProblem(AfferentModel(drive(sed)), RateRecordings(("flat",), [217.0], [63.0]))
    >>> scores_of_each(problem, Afferent().parameters * np.array([[1.0], [1.2]])).round(2).tolist()
    [1.0, 0.98]
    """
    dynamic_hz, static_hz = rates_of_each(problem.model, points)
    everything = np.arange(problem.n_observations)
    return np.array(
        [problem.score_of(rates, everything) for rates in zip(dynamic_hz, static_hz, strict=True)]
    )


def _prepared(model: RateModel) -> Rates:
    """Return what gives the rates of one row, its memory made once."""
    if isinstance(model, Reparametrised):
        inner = _prepared(model.model)
        return lambda row: inner(model.translated(row))
    if isinstance(model, AfferentModel):
        return rates_under(model.drive, model.refractory_ms)
    return model.rates
