"""A discrimination task: which stimuli, which afferents, which codes and which noise.

Each class is a part of the file of a task. docs/discriminate.md explains every key.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

from pydantic import Field, Strict

from fingerpad.core.errors import InputError, closest
from fingerpad.core.files import path_of, read_text
from fingerpad.core.signals import ResponseMap, Skin
from fingerpad.core.units import name_and_unit
from fingerpad.core.values import (
    Count,
    IntArray,
    NotNegative,
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
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.examples import tasks
from fingerpad.experiments.requests.afferents import (
    AFFERENT_OBJECTS,
    Afferents,
    AfferentsSettings,
    check_windows,
    files_of,
    population_neighbours,
    population_of,
    respond_to,
)
from fingerpad.experiments.requests.parts import Content, LevelOrName, Part, at, with_message
from fingerpad.experiments.requests.stimuli import (
    NamedStimulus,
    StimulusSet,
    VariedStimuli,
    named_stimuli,
    touches_of,
)
from fingerpad.experiments.requests.stimulus import FINGER_OBJECTS, FingerRequest
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import Windows, rate_windows_ms
from fingerpad.psychophysics.curve import SIGMOIDS
from fingerpad.psychophysics.encoding import LARGEST_NOISE
from fingerpad.psychophysics.observer import CRITERION_MOVES, Experiment
from fingerpad.skin.indentation import Touch

IDEAL = "ideal"
CODES: tuple[str, ...] = ("gradient_sum", "euclidean", IDEAL)
MEASURES: tuple[str, ...] = ("static", "dynamic", "latency")
FREE = "free"
FITTED = "fitted"  # Value of `noise` where it is fitted to observed hit rates.
_REPETITIONS = int(psychophysics.REPETITIONS.value)


class ExperimentSettings(Part):
    """Repetitions, decision criterion and seed."""

    seed: Seed = 0  #: Of every random number.
    criterion: Share = psychophysics.DECISION_CRITERION.value
    """Decision point, as a fraction of the way from the standard to the comparison."""
    criterion_sigma: NotNegative = 0.0  #: Spread of the criterion from one hit rate to the next.
    criterion_moves: Annotated[str, choice(CRITERION_MOVES)] = CRITERION_MOVES[0]
    """What that spread multiplies: the decision point itself, or the fraction."""
    presentations: Several = _REPETITIONS
    distributions: Several = _REPETITIONS
    pairs: Several = _REPETITIONS
    hit_rates: Several = _REPETITIONS  #: As of `fingerpad.psychophysics.observer.Experiment`.
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
    ] = 0.0  #: What is missing to 1 far above threshold, or that it shall be fitted. [0-1]
    proportion: Annotated[float, Field(gt=0.5, lt=1.0), with_message("a number between 0.5 and 1")] = 0.75
    """Where the threshold is read. [0-1]"""


class ObservedPoint(Part):
    """How often people discriminated one stimulus from the standard."""

    at: LevelOrName  #: Level or name of the stimulus; a level may lie between those that are pressed.
    hit_rate: Share  #: Fraction of trials. [0-1]
    trials: Count | None = None  #: How many there were, for the interval.


class ObservedSettings(Part):
    """Observations in people."""

    points: Annotated[tuple[ObservedPoint, ...], Strict(False), Field(min_length=1)]  #: One per stimulus.
    source: Text = "people"  #: Who observed it.


class DiscriminationRequest(StimulusSet, FingerRequest):
    """A discrimination task, as `fingerpad.discriminate` runs it and a file describes it.

    Examples
    --------
    >>> spheres = {"vary": "object.curvature_per_m", "values": [287, 340]}
    >>> task = {"question": "Which?", "object": "sphere", "stimuli": spheres, "standard": 287, "noise": 0.1}
    >>> DiscriminationRequest.read(task).pressed[1].indenter
    Sphere(curvature_per_m=340.0)
    >>> DiscriminationRequest.read(task, {"noise": -0.1})
    Traceback (most recent call last):
    fingerpad.core.errors.InputError: task, noise must be a number from 0 to 1000, or fitted: got -0.1.
    """

    word: ClassVar[str] = "task"
    python: ClassVar[tuple[str, ...]] = (*FINGER_OBJECTS, "object", "motion", *AFFERENT_OBJECTS)

    question: Text = "Which stimuli can be told apart?"  #: In words: the title of the page.
    axis: Text | None = None  #: What the levels are, for the axes of figures; by default the key that varies.
    standard: LevelOrName  #: Level or name of the stimulus that all others are compared with.
    afferents: Afferents = AfferentsSettings()  #: Who responds, as of a touch.
    code: Annotated[tuple[str, ...], some_of(CODES)] = ("gradient_sum",)
    measure: Annotated[tuple[str, ...], some_of(MEASURES)] = ("static",)
    """How the population is decoded, and what is measured of each afferent, by the names of `CODES` and
    `MEASURES`; the first are the main ones."""
    latest_ms: Positive | None = None
    """Latest first spike that counts; a later one, or none, counts as this time. Without it, receptors that
    are silent under one stimulus are left out. [ms]"""
    noise: Annotated[
        Annotated[float, limits(0.0, LARGEST_NOISE)] | Annotated[str, choice((FITTED,))],
        with_message(f"a number from 0 to {LARGEST_NOISE:g}, or {FITTED}"),
    ]
    """Standard deviation of the multiplicative noise, or that which brings the main code and measure closest
    to the observed hit rates."""
    experiment: ExperimentSettings = ExperimentSettings()  #: Repetitions, criterion and seed.
    curve: CurveSettings = CurveSettings()  #: The psychometric curve.
    observed: ObservedSettings | None = None  #: Hit rates of people.

    @classmethod
    def read(cls, source: Any = None, given: Any = MappingProxyType({}), *args: Any, **more: Any) -> Any:
        """Make a task from a file, a mapping, the name of an example, or a request; as of `Request.read`."""
        if isinstance(source, str | Path) and "text" not in more:
            more["text"] = task_text(source)
        return super().read(source, given, *args, **more)

    @classmethod
    def named_objects(cls, content: Content, beside: Path, allow_python: bool) -> Content:
        """Refuse the keys of the first version of the files, with how they are written now."""
        for key in ("population", "afferent", "windows_ms"):
            if key in content:
                within = "" if key == "population" else f"{key} within "
                raise InputError(
                    key, f"is written as {within}afferents since version 2 of tasks", remedy="move it there"
                )
        return super().named_objects(content, beside, allow_python)

    @cached_property
    def settings(self) -> Conditions:
        """Finger, tissues, accuracy and seed."""
        with self.origin.located():
            depths_mm = self.population.kept_depths_mm
            return self.conditions(self.pressed_finger, self.experiment.seed, depths_mm)

    @cached_property
    def pressed(self) -> tuple[NamedStimulus, ...]:
        """The stimuli: the standard, then the comparisons in the order of the file."""
        with self.origin.located():
            found = named_stimuli(self, self.beside)
            if len(found) < 2:
                raise InputError("stimuli", "must be two or more to be discriminated", str(len(found)))
            with_level = [stimulus.level is not None for stimulus in found]
            if any(with_level) and not all(with_level):
                raise InputError(
                    "level",
                    "must be given for all stimuli or for none",
                    remedy=f"{found[with_level.index(False)].name!r} has none",
                )
            row = stimulus_index(found, self.standard, "standard")
            return (found[row], *found[:row], *found[row + 1 :])

    @cached_property
    def population(self) -> Population:
        """The afferents."""
        with self.origin.located():
            return population_of(self.afferents, self.tissues, self.beside, self.pressed_finger)

    @cached_property
    def touches(self) -> dict[str, Touch]:
        """One touch per stimulus, all on one mesh."""
        with self.origin.located():
            return touches_of(self.pressed, self.settings, self.reach_mm)

    def check(self) -> None:
        """Raise `InputError` if the task is impossible; before anything is solved."""
        with self.origin.located():
            self._check()
        self.touches  # noqa: B018

    def _check(self) -> None:
        for key, names in (("code", self.code), ("measure", self.measure)):
            for name, count in Counter(names).items():
                if count > 1:
                    raise InputError(key, "must name each once", remedy=f"{name} is given {count} times")
        stimuli = self.pressed
        self.population  # noqa: B018
        with at("afferents"):
            for stimulus in stimuli:
                check_windows(self.windows_of(stimulus), stimulus.motion.end_ms, repr(stimulus.name))
        for number, point in enumerate(self.observed.points if self.observed else (), start=1):
            if isinstance(point.at, str) or stimuli[0].level is None:
                stimulus_index(stimuli, point.at, f"observed.points[{number}].at")
        if self.noise == FITTED and not self.observed_comparisons:
            raise InputError(
                "noise can only be fitted to observed hit rates of the comparisons, "
                f"{', '.join(stimulus.name for stimulus in stimuli[1:])}: observed.points has none."
            )
        if IDEAL in self.code and self.noise == 0.0:
            raise InputError("noise", "must be greater than 0 where code has ideal", "0")
        if self.noise == FITTED and self.code[0] == IDEAL:
            raise InputError(
                "code", "must not begin with ideal where noise is fitted", remedy="put another first"
            )
        if self.experiment.criterion_sigma > 0.0 and "euclidean" in self.code:
            raise InputError(
                "experiment.criterion_sigma",
                "must be 0 where code has euclidean, whose decision point does not vary",
                f"{self.experiment.criterion_sigma:g}",
            )

    def windows_of(self, stimulus: NamedStimulus) -> Windows:
        """Windows of the two rates under a stimulus. [ms]"""
        return rate_windows_ms(stimulus.motion.phases, *self.afferents.windows_ms.both)

    @cached_property
    def observed_comparisons(self) -> dict[int, float]:
        """Observed hit rates of comparisons that are pressed, by their row among the stimuli."""
        points = self.observed.points if self.observed else ()
        return {
            row: point.hit_rate
            for point in points
            for row, stimulus in enumerate(self.pressed[1:], start=1)
            if point.at in (stimulus.name, stimulus.level)
        }

    @cached_property
    def neighbours(self) -> IntArray:
        """Who is whose neighbour, (n_pairs, 2)."""
        return population_neighbours(self.afferents, self.population)

    @property
    def said_axis(self) -> str:
        """Say what the levels are."""
        if self.axis or not isinstance(self.stimuli, VariedStimuli):
            return self.axis or "level"
        name, unit = name_and_unit(self.stimuli.vary.rpartition(".")[2])
        return name.replace("_", " ") + (f" [{unit}]" if unit else "")

    def responses(self, skins: Mapping[str, Skin]) -> list[ResponseMap]:
        """Responses of the population to every stimulus."""
        return [
            respond_to(self.afferents, self.population, skins[stimulus.name], self.windows_of(stimulus))
            for stimulus in self.pressed
        ]

    def further_files(self) -> list[Path]:
        """Files of the stimuli and of the afferent."""
        of_stimuli = [path for stimulus in self.pressed for path in stimulus.files]
        return [*of_stimuli, *files_of(self.afferents.afferent, self.beside)]


def stimulus_index(stimuli: Sequence[NamedStimulus], place: float | str, key: str) -> int:
    """Index of the stimulus that a level or a name means, else raise `InputError` that names the key."""
    for row, stimulus in enumerate(stimuli):
        if place == stimulus.name or (stimulus.level is not None and place == stimulus.level):
            return row
    names = ", ".join(stimulus.name for stimulus in stimuli)
    raise InputError(key, f"must be one of the stimuli, {names}", repr(place))


def task_text(source: str | Path) -> str:
    """Text of a task, from a file or from the package."""
    name, path, known = str(source), path_of("source", source), tasks()
    if name in known and not path.is_file():
        return known[name]
    if path.suffix or path.exists():
        return read_text(path)
    near = closest(name, known)
    raise InputError(
        f"{name} must be a YAML file or one of the example tasks, {', '.join(known)}: it is neither"
        + (f", did you mean {near}?" if near else ".")
    )
