"""The answer to a question: the population under every stimulus, read by every code and measure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.core.random_streams import IntArray
from fingerpad.core.signals import ResponseMap, Skin
from fingerpad.experiments.discrimination.decoding import (
    curves,
    fitted_noise,
    hit_rates,
    responses,
    silent_stimuli,
    statistic,
    taking_part,
)
from fingerpad.experiments.discrimination.efficiencies import efficiencies, ideal_observer, presentations
from fingerpad.experiments.discrimination.task import (
    FITTED,
    GRID,
    IDEAL,
    NAIL_ROWS,
    UNITS,
    Question,
    VariedStimuli,
)
from fingerpad.experiments.discrimination.task_stimuli import Presented, which
from fingerpad.experiments.gerling2014.goodwin import binomial_interval
from fingerpad.neuron.population import Population
from fingerpad.psychophysics import Presentation
from fingerpad.psychophysics.discrimination import Experiment
from fingerpad.psychophysics.encoding import neighbours_of

Taken = tuple[FloatArray, np.ndarray]
"""A measure of all receptors under every stimulus, and the pairs of neighbours that take part."""


@dataclass(frozen=True)
class Asked:
    """A question with the stimuli and the population that it means.

    Parameters
    ----------
    question : Question
        As it was read.
    stimuli : tuple of Presented
        From `presented`, the standard first.
    population : Population
        From `population_of`.

    Raises
    ------
    InputError
        If the windows do not end with the stimuli, an observed point means none of them, or noise shall be
        fitted to no point.
    """

    question: Question
    stimuli: tuple[Presented, ...]
    population: Population

    def __post_init__(self) -> None:
        question = self.question
        for key in ("dynamic", "static"):
            self._check_window(key, *getattr(question.windows_ms, key))
        for number, point in enumerate(question.observed.points if question.observed else (), start=1):
            if isinstance(point.at, str) or self.stimuli[0].level is None:
                which(self.stimuli, point.at, f"observed.points[{number}].at")
        if question.noise == FITTED and not self.observed_comparisons:
            raise InputError(
                "noise can only be fitted to observed hit rates of the comparisons, "
                f"{', '.join(stimulus.name for stimulus in self.stimuli[1:])}: observed.points has none."
            )
        if IDEAL in question.code and question.noise == 0.0:
            raise InputError("noise must be greater than 0 where code has ideal: got 0.")
        if question.noise == FITTED and question.code[0] == IDEAL:
            raise InputError("code must not begin with ideal where noise is fitted: put another first.")
        if question.experiment.criterion_sigma > 0.0 and "euclidean" in question.code:
            raise InputError(
                "experiment.criterion_sigma must be 0 where code has euclidean, whose decision point "
                f"does not vary: got {question.experiment.criterion_sigma:g}."
            )

    def _check_window(self, key: str, start: float, end: float) -> None:
        if not 0.0 <= start < end:
            raise InputError(
                f"windows_ms.{key} must be a start from 0 on and a later end: got {start:g}, {end:g}."
            )
        for stimulus in self.stimuli:
            if stimulus.motion.end_ms < end:
                raise InputError(
                    f"windows_ms.{key} must end with the stimuli, not at {end:g} ms: {stimulus.name!r} ends "
                    f"at {stimulus.motion.end_ms:g} ms."
                )

    @cached_property
    def observed_comparisons(self) -> dict[int, float]:
        """Observed hit rates of comparisons that are pressed, by their row among the stimuli."""
        points = self.question.observed.points if self.question.observed else ()
        return {
            row: point.hit_rate
            for point in points
            for row, stimulus in enumerate(self.stimuli[1:], start=1)
            if point.at in (stimulus.name, stimulus.level)
        }

    @cached_property
    def neighbours(self) -> IntArray:
        """Who is whose neighbour, (n_pairs, 2)."""
        layout = self.question.population.layout
        pattern = "rectangular" if layout in (GRID, NAIL_ROWS) else layout
        return neighbours_of(np.asarray(self.population.places_mm), self.population.pitch_mm, pattern)

    @property
    def plan(self) -> Experiment:
        """Repetitions and criterion."""
        return Experiment(**self.question.experiment.model_dump(exclude={"seed", "trials"}))

    @property
    def axis(self) -> str:
        """Say what the levels are."""
        if self.question.axis or not isinstance(self.question.stimuli, VariedStimuli):
            return self.question.axis or "level"
        name, unit = self.question.stimuli.vary, UNITS[self.question.stimuli.vary]
        words = name.split("_per_")[0] if "_per_" in name else name.rsplit("_", 1)[0] if unit else name
        return f"{words} [{unit}]" if unit else words

    def answers(self, skins: Mapping[str, Skin]) -> list[ResponseMap]:
        """Let the population answer every stimulus."""
        windows = self.question.windows_ms
        return [
            self.population.respond(skins[stimulus.name], windows.dynamic, windows.static)
            for stimulus in self.stimuli
        ]


def result(asked: Asked, skins: Mapping[str, Skin]) -> dict[str, Any]:
    """Let the population answer pressed stimuli, and read it by every code and measure.

    Parameters
    ----------
    asked : Asked
        The question.
    skins : mapping of str to Skin
        What each stimulus did to the skin, by its name.

    Returns
    -------
    dict
        Stimuli, responses by measure, noise, and one reading per code and measure: hit rates, the statistic
        behind them, and psychometric curves.

    Raises
    ------
    InputError
        If the population stays silent under a stimulus, whatever is measured.
    ConvergenceError
        If no noise meets the observed hit rates.
    """
    question, stimuli, patience_ms = asked.question, asked.stimuli, asked.question.windows_ms.latency
    answers = asked.answers(skins)
    tables = {measure: responses(answers, measure, patience_ms) for measure in question.measure}
    silent = {measure: silent_stimuli(table, measure, patience_ms) for measure, table in tables.items()}
    if all(rows.size for rows in silent.values()):
        raise InputError(
            f"The population stays silent: by {' or '.join(silent)} none of its {len(asked.population)} "
            f"afferents answers {_named(stimuli, next(iter(silent.values())))}, and there is no hit rate "
            "from zeros; press deeper, or place it below the stimuli."
        )
    taken = {measure: taking_part(table, asked.neighbours) for measure, table in tables.items()}
    noise = _noise(asked, taken, silent)
    return {
        "question": question.question,
        "axis": asked.axis,
        "stimulus": [stimulus.name for stimulus in stimuli],
        "level": None if stimuli[0].level is None else [stimulus.level for stimulus in stimuli],
        "population": _population(asked),
        "noise": noise,
        "responses": tables,
        "readings": [
            reading
            for measure in question.measure
            for reading in _readings(asked, measure, taken[measure], silent[measure], noise["sigma"])
        ],
        "observed": _observed(asked),
    }


def _named(stimuli: Sequence[Presented], rows: Sequence[int] | IntArray) -> str:
    """Say under which stimuli, as a sentence has it."""
    if len(rows) == len(stimuli):
        return "any stimulus"
    return f"the stimulus {', '.join(stimuli[row].name for row in rows)}"


def _population(asked: Asked) -> dict[str, Any]:
    settings, population = asked.question.population, asked.population
    return {
        "layout": settings.layout,
        "n_receptors": len(population),
        "pitch_mm": population.pitch_mm,
        "density_per_cm2": settings.density_per_cm2,
        "positions_mm": population.positions_mm,
        "sensitivity": population.sensitivity,
    }


def _noise(asked: Asked, taken: Mapping[str, Taken], silent: Mapping[str, IntArray]) -> dict[str, Any]:
    """Find the noise: as it is given, or as the first code and measure need it for the observed hit rates."""
    question, points = asked.question, asked.observed_comparisons
    if question.noise != FITTED:
        return {"sigma": question.noise, "fitted_to": None, "root_mean_square_error": None}
    code, measure = question.code[0], question.measure[0]
    if silent[measure].size:
        raise InputError(
            f"noise cannot be fitted: by the measure {measure} the population stays silent under "
            f"{_named(asked.stimuli, silent[measure])}; give a number, or another measure first."
        )
    fit = fitted_noise(
        code,
        *taken[measure],
        [row - 1 for row in points],
        list(points.values()),
        question.experiment.seed,
        asked.plan,
    )
    return {
        "sigma": fit.noise_sigma,
        "fitted_to": {
            "code": code,
            "measure": measure,
            "stimulus": [asked.stimuli[row].name for row in points],
            "observed": list(points.values()),
            "hit_rate": fit.hit_rates,
        },
        "root_mean_square_error": fit.root_mean_square_error,
    }


def _readings(asked: Asked, measure: str, taken: Taken, silent: IntArray, sigma: float) -> list[dict]:
    """Read one measure by every code; there is no hit rate from zeros."""
    names, seed = [asked.stimuli[row].name for row in silent], asked.question.experiment.seed
    shown = presentations(taken[0], sigma, seed) if sigma > 0.0 and not names else []
    return [
        {"code": code, "measure": measure, "silent": names, "hit_rate": None}
        | ({} if names else _reading(asked, code, taken, sigma, shown))
        for code in asked.question.code
    ]


def _reading(
    asked: Asked, code: str, taken: Taken, sigma: float, shown: list[Presentation]
) -> dict[str, Any]:
    """Hit rates, what is behind them, and their curves."""
    settings, (table, neighbours) = asked.question.experiment, taken
    if code == IDEAL:
        told = ideal_observer(shown)
    else:
        rates = hit_rates(code, table, neighbours, sigma, settings.seed, asked.plan)
        told = {
            "hit_rate": rates.hit_rate,
            "hit_rate_sd": rates.hit_rate_sd,
            "statistic": statistic(code, table, neighbours, sigma, settings.seed),
            **efficiencies(code, shown, table, neighbours, sigma, settings.seed),
        }
    levels = [stimulus.level for stimulus in asked.stimuli if stimulus.level is not None]
    found = (
        curves(levels, told["hit_rate"], settings.trials, asked.question.curve, settings.seed)
        if levels
        else []
    )
    return told | {"curves": found}


def _observed(asked: Asked) -> dict[str, Any] | None:
    """Observed points with their levels, and binomial intervals where the trials are known."""
    observed = asked.question.observed
    if observed is None:
        return None
    return {
        "source": observed.source,
        "points": [
            {
                "at": point.at,
                "level": (
                    asked.stimuli[which(asked.stimuli, point.at, "at")].level
                    if isinstance(point.at, str)
                    else point.at
                ),
                "hit_rate": point.hit_rate,
                "trials": point.trials,
                "interval": point.trials and binomial_interval(point.hit_rate, point.trials),
            }
            for point in observed.points
        ],
    }
