"""A discrimination task: which stimuli, which afferents, which codes and which noise.

Each class is a part of the file that `task_files` reads. docs/discriminate.md explains every key.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Discriminator, Field, Strict, Tag

from fingerpad.data import psychophysics
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments.descriptions.parts import DEFAULT, AfferentChoice, PopulationSettings
from fingerpad.experiments.descriptions.values import (
    LISTED,
    VARIED,
    Count,
    FiniteNumber,
    LevelOrName,
    NotNegative,
    Pair,
    Part,
    Positive,
    Seed,
    Several,
    Share,
    Text,
    as_list,
    choice_of,
    with_message,
)
from fingerpad.geometry.fingertip import FINGERS
from fingerpad.geometry.grading import RESOLUTIONS
from fingerpad.geometry.motion import MOTION_UNITS
from fingerpad.geometry.names import INDENTERS, SIZE_UNITS
from fingerpad.mechanics.tissues import TISSUES
from fingerpad.psychophysics.discrimination import CRITERION_MOVES
from fingerpad.psychophysics.functions import SIGMOIDS

IDEAL = "ideal"
CODES = ("gradient_sum", "euclidean", IDEAL)
MEASURES = ("static", "dynamic", "latency")
FREE = "free"
FITTED = "fitted"
"""Value of `noise` where it is fitted to observed hit rates."""

UNITS = SIZE_UNITS | MOTION_UNITS | {"spin_deg": "degrees", "tilt_deg": "degrees", "friction": ""}
"""What can be varied from stimulus to stimulus, and in which unit."""

_REPETITIONS = int(psychophysics.REPETITIONS.value)


class SkinSettings(Part):
    """The finger that is pressed.

    Parameters
    ----------
    finger : str
        Whose, by the name of a preset of `fingerpad.Fingertip.of`.
    materials : str
        A set of tissues by name, as of `fingerpad.indent`.
    resolution : {"quick", "standard", "paper"}
        How fine mesh and steps are.
    reach_mm : float
        How far to either side of the middle, along the finger and across, the mesh is fine at most; without
        it, as far as the indenters need. [mm]
    """

    finger: Annotated[str, choice_of(FINGERS)] = "adult"
    materials: Annotated[str, choice_of(TISSUES)] = DEFAULT_TISSUES
    resolution: Annotated[str, choice_of(RESOLUTIONS)] = "standard"
    reach_mm: Positive | None = None


class StimulusSettings(Part):
    """One stimulus, or what all have in common. What is absent is the paper's.

    Parameters
    ----------
    name : str
        Of a listed stimulus.
    level : float
        Where a listed stimulus stands on the axis of the psychometric curve.
    indenter : str
        Body that is pressed in.
    curvature_per_m, radius_mm, diameter_mm, width_mm, gap_mm, ridge_mm, groove_mm, period_mm, duty : float
    fillet_mm, edge_radius_mm, lip_mm, lip_radius_mm : float
        Sizes, those that the indenter has. [1/m, mm, 1]
    spin_deg : float
        Turn about the direction of pressing: the orientation of a bar, an edge, a gap or a grating. [degrees]
    tilt_deg : float
        As of `fingerpad.Touch`; without it the indenter presses perpendicular to the skin. [degrees]
    offset_mm : (float, float)
        Where its axis meets the skin, from the middle of the pad: along the finger, distal positive, and
        across. [mm]
    depth_mm, force_mn : float
        How far or how hard it is pressed; one of them. [mm, mN]
    ramp_ms, hold_ms : float
        Durations. [ms]
    friction : float
        Coulomb's coefficient.
    """

    name: Text | None = None
    level: FiniteNumber | None = None
    indenter: Annotated[str, choice_of(INDENTERS)] | None = None
    curvature_per_m: Positive | None = None
    radius_mm: Positive | None = None
    diameter_mm: Positive | None = None
    width_mm: Positive | None = None
    gap_mm: NotNegative | None = None
    ridge_mm: Positive | None = None
    groove_mm: Positive | None = None
    period_mm: Positive | None = None
    duty: Positive | None = None
    fillet_mm: NotNegative | None = None
    edge_radius_mm: NotNegative | None = None
    lip_mm: NotNegative | None = None
    lip_radius_mm: NotNegative | None = None
    spin_deg: FiniteNumber | None = None
    tilt_deg: FiniteNumber | None = None
    offset_mm: Pair | None = None
    depth_mm: Positive | None = None
    force_mn: Positive | None = None
    ramp_ms: Positive | None = None
    hold_ms: Positive | None = None
    friction: NotNegative | None = None


VARIABLE = tuple(name for name in StimulusSettings.model_fields if name in UNITS)
"""What may differ from stimulus to stimulus by a number."""


class VariedStimuli(Part):
    """Stimuli that differ in one number.

    Parameters
    ----------
    vary : str
        Which of `VARIABLE`.
    values : list of float
        One per stimulus. [unit of what varies]
    """

    vary: Annotated[str, choice_of(VARIABLE)]
    values: Annotated[tuple[FiniteNumber, ...], Strict(False)]


class WindowSettings(Part):
    """Windows in which spikes count.

    Parameters
    ----------
    dynamic, static : (float, float)
        Start and end of the windows of the two rates; without them they follow the phases of each stimulus,
        as in `fingerpad.neuron.rate_windows`. [ms]
    latency : float
        Latest first spike that counts; a later one, or none, counts as this time. Without it, receptors that
        are silent under one stimulus are left out. [ms]
    """

    dynamic: Pair | None = None
    static: Pair | None = None
    latency: Positive | None = None


class ExperimentSettings(Part):
    """Repetitions, decision criterion and seed.

    Parameters
    ----------
    seed : int
        Of every random number.
    criterion : float
        Decision point, as a fraction of the way from the standard to the comparison.
    criterion_sigma : float
        Spread of the criterion from one hit rate to the next.
    criterion_moves : {"point", "fraction", "likelihood"}
        What that spread multiplies: the decision point itself, or the fraction.
    presentations, distributions, pairs, hit_rates : int
        As of `fingerpad.psychophysics.discrimination.Experiment`.
    presentations_varied : int
        Presentations of each stimulus when the criterion varies.
    trials : int
        Judgements per comparison of an experiment with people: intervals of the psychometric curve are those
        that such an experiment would have.
    """

    seed: Seed = 0
    criterion: Share = psychophysics.DECISION_CRITERION.value
    criterion_sigma: NotNegative = 0.0
    criterion_moves: Annotated[str, choice_of(CRITERION_MOVES)] = CRITERION_MOVES[0]
    presentations: Several = _REPETITIONS
    distributions: Several = _REPETITIONS
    pairs: Several = _REPETITIONS
    hit_rates: Several = _REPETITIONS
    presentations_varied: Several = int(psychophysics.REPETITIONS_VARIED_CRITERION.value)
    trials: Count = _REPETITIONS


class CurveSettings(Part):
    """The psychometric curve through the hit rates.

    Parameters
    ----------
    sigmoid : str
        Its shape over the distance from the standard, by the names of `fingerpad.psychophysics`.
    lapse : float or "free"
        What is missing to 1 far above threshold, or that it shall be fitted. [0-1]
    proportion : float
        Where the threshold is read. [0-1]
    """

    sigmoid: Annotated[str, choice_of(SIGMOIDS)] = "weibull"
    lapse: Annotated[
        Annotated[float, Field(ge=0, lt=0.5)] | Annotated[str, choice_of((FREE,))],
        with_message(f"a number within 0 ... 0.5, or {FREE}"),
    ] = 0.0
    proportion: Annotated[float, Field(gt=0.5, lt=1.0), with_message("a number between 0.5 and 1")] = 0.75


class ObservedPoint(Part):
    """How often people discriminated one stimulus from the standard.

    Parameters
    ----------
    at : float or str
        Level or name of the stimulus; a level may lie between those that are pressed.
    hit_rate : float
        Fraction of trials. [0-1]
    trials : int
        How many there were, for the interval.
    """

    at: LevelOrName
    hit_rate: Share
    trials: Count | None = None


class ObservedSettings(Part):
    """Observations in people.

    Parameters
    ----------
    points : list of ObservedPoint
        One per stimulus.
    source : str
        Who observed it.
    """

    points: Annotated[tuple[ObservedPoint, ...], Strict(False), Field(min_length=1)]
    source: Text = "people"


class DiscriminationTask(Part):
    """All that a file of a task holds.

    Parameters
    ----------
    question : str
        In words: the title of the page.
    axis : str
        What the levels are, for the axes of figures; by default the parameter that varies.
    skin : SkinSettings
        The finger.
    common : StimulusSettings
        What all stimuli share, unless they say otherwise.
    stimuli : VariedStimuli or list of StimulusSettings
        Which are discriminated.
    standard : float or str
        Level or name of the stimulus that all others are compared with.
    population : PopulationSettings
        The afferents.
    afferent : AfferentSettings or str
        "default", a file of results (`fit.json` of `fingerpad fit`, `results.json` of
        `fingerpad reproduce`), or numbers.
    code : str or list of str
        How the population is decoded, by the names of `CODES`; the first is the main one.
    measure : str or list of str
        What is measured of each afferent, by the names of `MEASURES`; the first is the main one.
    windows_ms : WindowSettings
        When spikes count.
    noise : float or "fitted"
        Standard deviation of the multiplicative noise, or "fitted": that which brings the main code and
        measure closest to the observed hit rates.
    experiment : ExperimentSettings
        Repetitions, criterion and seed.
    curve : CurveSettings
        The psychometric curve.
    observed : ObservedSettings
        Hit rates of people.
    """

    question: Text
    axis: Text | None = None
    skin: SkinSettings = SkinSettings()
    common: StimulusSettings = StimulusSettings()
    stimuli: Annotated[
        Annotated[tuple[StimulusSettings, ...], Strict(False), Tag(LISTED)]
        | Annotated[VariedStimuli, Tag(VARIED)],
        Discriminator(lambda value: LISTED if isinstance(value, list | tuple) else VARIED),
    ]
    standard: LevelOrName
    population: PopulationSettings = PopulationSettings()
    afferent: AfferentChoice = DEFAULT
    code: Annotated[
        tuple[Annotated[str, choice_of(CODES)], ...],
        Strict(False),
        Field(min_length=1),
        BeforeValidator(as_list),
    ] = ("gradient_sum",)
    measure: Annotated[
        tuple[Annotated[str, choice_of(MEASURES)], ...],
        Strict(False),
        Field(min_length=1),
        BeforeValidator(as_list),
    ] = ("static",)
    windows_ms: WindowSettings = WindowSettings()
    noise: Annotated[
        NotNegative | Annotated[str, choice_of((FITTED,))], with_message(f"a number not below 0, or {FITTED}")
    ]
    experiment: ExperimentSettings = ExperimentSettings()
    curve: CurveSettings = CurveSettings()
    observed: ObservedSettings | None = None
