"""Parts that files have in common: a population of afferents, and the afferent."""

from __future__ import annotations

from typing import Annotated

from pydantic import Discriminator, Field, Strict, Tag

from fingerpad.core.layouts import PATTERNS
from fingerpad.data import psychophysics
from fingerpad.data.afferents import TYPES
from fingerpad.experiments.descriptions.values import (
    NAMED,
    SPELLED,
    Count,
    FiniteNumber,
    NotNegative,
    Pair,
    Part,
    Positive,
    Seed,
    Text,
    choice_of,
    with_message,
)
from fingerpad.skin.fields import sampled_fields

DEFAULT = "default"
"""Value of `afferent` for the one that was fitted with the tissues."""

GRID = "grid"
NAIL_ROWS = "nail rows"
LAYOUT_NAMES = (GRID, *PATTERNS, NAIL_ROWS)
PAD = "pad"
SHAPES = ("rectangle", "ellipse", "polygon", PAD)


class RegionSettings(Part):
    """Part of the skin that afferents lie in, unrolled; an area there is the same area of skin.

    Parameters
    ----------
    shape : {"rectangle", "ellipse", "polygon", "pad"}
        Kind of shape.
    length_mm, width_mm : float
        Extent of a rectangle or an ellipse along the finger and across. [mm]
    corners_mm : list of (float, float)
        Of a polygon: along the finger, distal positive, and across, from the middle of the pad. [mm]
    """

    shape: Annotated[str, choice_of(SHAPES)]
    length_mm: Positive | None = None
    width_mm: Positive | None = None
    corners_mm: Annotated[tuple[Pair, ...], Strict(False)] | None = None


class PopulationSettings(Part):
    """The afferents.

    Parameters
    ----------
    layout : str
        "grid": the paper's rows and columns; a pattern that fills a region; or "nail rows", along the edge of
        the nail.
    density_per_cm2 : float
        Afferents per area of skin. [1/cm2]
    rows, columns : int
        Of a grid: along the finger and across, the paper's by default; or how many rows along the nail.
    region : RegionSettings
        What any other layout fills.
    offset_mm : (float, float)
        Middle of grid, rectangle or ellipse from the middle of the pad, along the finger and across. [mm]
    jitter : float
        Displacement of afferents in a jittered layout: standard deviation over the pitch.
    separation : float
        Least distance in a Poisson-disc layout over 1/sqrt(density).
    seed : int
        Of random places and sensitivities; another one is another finger.
    densities_per_cm2 : dict of str to float
        Instead of one density, that of each type of a mixed population, which all have this layout. [1/cm2]
    sensitivity_spread : float
        How much afferents differ in their gains, as of `fingerpad.neuron.population.sensitivities`.
    """

    layout: Annotated[str, choice_of(LAYOUT_NAMES)] = GRID
    density_per_cm2: Positive = psychophysics.RECEPTOR_DENSITY.value
    densities_per_cm2: (
        Annotated[
            dict[Annotated[str, choice_of(TYPES)], Positive],
            Field(min_length=1),
            with_message(f"a density above 0 of each type, {', '.join(TYPES)}"),
        ]
        | None
    ) = None
    rows: Count | None = None
    columns: Count | None = None
    region: RegionSettings | None = None
    offset_mm: Pair = (0.0, 0.0)
    jitter: NotNegative | None = None
    separation: NotNegative | None = None
    seed: Seed = 0
    sensitivity_spread: NotNegative = 0.0


class AfferentSettings(Part):
    """The afferent by its numbers; what is absent is as in the afferent of the tissues.

    Parameters
    ----------
    intercept_ma, dynamic_gain, static_gain, time_constant_ms, capacitance_mf, threshold_mv : float
        As of `fingerpad.Afferent`.
    refractory_ms : float
        Rest after each spike. [ms]
    dynamic_quantity, static_quantity : str
        What the two terms follow.
    """

    intercept_ma: FiniteNumber | None = None
    dynamic_gain: FiniteNumber | None = None
    static_gain: FiniteNumber | None = None
    time_constant_ms: Positive | None = None
    capacitance_mf: Positive | None = None
    threshold_mv: Positive | None = None
    refractory_ms: NotNegative | None = None
    dynamic_quantity: Annotated[str, choice_of(sampled_fields())] | None = None
    static_quantity: Annotated[str, choice_of(sampled_fields())] | None = None


AfferentChoice = Annotated[
    Annotated[Text, Tag(NAMED)] | Annotated[AfferentSettings, Tag(SPELLED)],
    Discriminator(lambda value: NAMED if isinstance(value, str) else SPELLED),
]
"""The default, a type of afferents by its name, a file of results, or numbers."""


def file_of(chosen: AfferentSettings | str) -> str | None:
    """Name of the file of results that an afferent is read from; None if it is from none."""
    return chosen if isinstance(chosen, str) and chosen not in (DEFAULT, *TYPES) else None
