"""A discrimination task: which stimuli, which afferents, which codes and which noise.

Each class is a part of the file that `task_stimuli.read_task` reads. docs/discriminate.md explains every key.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, Strict

from fingerpad.core.values import (
    Count,
    NotNegative,
    Pair,
    Positive,
    Seed,
    Several,
    Share,
    Text,
    choice,
    limits,
    some_of,
)
from fingerpad.data import psychophysics
from fingerpad.experiments.descriptions.parts import DEFAULT, AfferentChoice, PopulationSettings
from fingerpad.experiments.descriptions.stimuli import StimulusSet
from fingerpad.experiments.descriptions.values import LevelOrName, Part, with_message
from fingerpad.psychophysics.discrimination import CRITERION_MOVES, Experiment
from fingerpad.psychophysics.functions import SIGMOIDS
from fingerpad.psychophysics.noisy_responses import LARGEST_NOISE

IDEAL = "ideal"
CODES = ("gradient_sum", "euclidean", IDEAL)
MEASURES = ("static", "dynamic", "latency")
FREE = "free"
FITTED = "fitted"  # Value of `noise` where it is fitted to observed hit rates.
_REPETITIONS = int(psychophysics.REPETITIONS.value)


class WindowSettings(Part):
    """Windows in which spikes count."""

    dynamic: Pair | None = None
    static: Pair | None = None
    """Start and end of the windows of the two rates; without them they follow the phases of each stimulus, as
    in `fingerpad.neuron.spikes`. [ms]"""
    latency: Positive | None = None
    """Latest first spike that counts; a later one, or none, counts as this time. Without it, receptors that
    are silent under one stimulus are left out. [ms]"""


class ExperimentSettings(Part):
    """Repetitions, decision criterion and seed."""

    seed: Seed = 0  # Of every random number.
    criterion: Share = psychophysics.DECISION_CRITERION.value
    """Decision point, as a fraction of the way from the standard to the comparison."""
    criterion_sigma: NotNegative = 0.0  # Spread of the criterion from one hit rate to the next.
    criterion_moves: Annotated[str, choice(CRITERION_MOVES)] = CRITERION_MOVES[0]
    """What that spread multiplies: the decision point itself, or the fraction."""
    presentations: Several = _REPETITIONS
    distributions: Several = _REPETITIONS
    pairs: Several = _REPETITIONS
    hit_rates: Several = _REPETITIONS  # As of `fingerpad.psychophysics.discrimination.Experiment`.
    presentations_varied: Several = int(psychophysics.REPETITIONS_VARIED_CRITERION.value)
    """Presentations of each stimulus when the criterion varies."""
    trials: Count = _REPETITIONS
    """Judgements per comparison of an experiment with people: intervals of the psychometric curve are those
    that such an experiment would have."""

    @property
    def plan(self) -> Experiment:
        own = dict(self)
        return Experiment(**{name: own[name] for name in own if name not in ("seed", "trials")})


class CurveSettings(Part):
    """The psychometric curve through the hit rates."""

    sigmoid: Annotated[str, choice(SIGMOIDS)] = "weibull"
    """Its shape over the distance from the standard, by the names of `fingerpad.psychophysics`."""
    lapse: Annotated[
        Annotated[float, Field(ge=0, lt=0.5)] | Annotated[str, choice((FREE,))],
        with_message(f"a number within 0 ... 0.5, or {FREE}"),
    ] = 0.0
    """What is missing to 1 far above threshold, or that it shall be fitted. [0-1]"""
    proportion: Annotated[float, Field(gt=0.5, lt=1.0), with_message("a number between 0.5 and 1")] = 0.75
    """Where the threshold is read. [0-1]"""


class ObservedPoint(Part):
    """How often people discriminated one stimulus from the standard."""

    at: LevelOrName  # Level or name of the stimulus; a level may lie between those that are pressed.
    hit_rate: Share  # Fraction of trials. [0-1]
    trials: Count | None = None  # How many there were, for the interval.


class ObservedSettings(Part):
    """Observations in people."""

    points: Annotated[tuple[ObservedPoint, ...], Strict(False), Field(min_length=1)]  # One per stimulus.
    source: Text = "people"  # Who observed it.


class DiscriminationTask(StimulusSet):
    """All that a file of a task holds."""

    question: Text  # In words: the title of the page.
    axis: Text | None = None  # What the levels are, for the axes of figures; by default the key that varies.
    standard: LevelOrName  # Level or name of the stimulus that all others are compared with.
    population: PopulationSettings = PopulationSettings()  # The afferents.
    afferent: AfferentChoice = DEFAULT
    """"default", a type by its name (SAI, RA, PC, SAII), a file of results (`fit.json` of `fingerpad fit`,
    `results.json` of `fingerpad reproduce`), or numbers."""
    code: Annotated[tuple[str, ...], some_of(CODES)] = ("gradient_sum",)
    """How the population is decoded, by the names of `CODES`; the first is the main one."""
    measure: Annotated[tuple[str, ...], some_of(MEASURES)] = ("static",)
    """What is measured of each afferent, by the names of `MEASURES`; the first is the main one."""
    windows_ms: WindowSettings = WindowSettings()  # When spikes count.
    noise: Annotated[
        Annotated[float, limits(0.0, LARGEST_NOISE)] | Annotated[str, choice((FITTED,))],
        with_message(f"a number from 0 to {LARGEST_NOISE:g}, or {FITTED}"),
    ]
    """Standard deviation of the multiplicative noise, or "fitted": that which brings the main code and
    measure closest to the observed hit rates."""
    experiment: ExperimentSettings = ExperimentSettings()  # Repetitions, criterion and seed.
    curve: CurveSettings = CurveSettings()  # The psychometric curve.
    observed: ObservedSettings | None = None  # Hit rates of people.
