"""Parts that files have in common: a population of afferents, and the afferent."""

from __future__ import annotations

from typing import Annotated

from pydantic import Discriminator, Field, Strict, Tag

from fingerpad.core.layouts import PATTERNS
from fingerpad.core.values import Count, Finite, NotNegative, Pair, Positive, Seed, Text, choice
from fingerpad.data import psychophysics
from fingerpad.data.afferents import TYPES
from fingerpad.experiments.descriptions.values import NAMED, SPELLED, Part, with_message
from fingerpad.skin.fields import sampled_fields

DEFAULT = "default"
"""Value of `afferent` for the one that was fitted with the tissues."""

GRID = "grid"
NAIL_ROWS = "nail rows"
LAYOUT_NAMES = (GRID, *PATTERNS, NAIL_ROWS)
PAD = "pad"
SHAPES = ("rectangle", "ellipse", "polygon", PAD)


class RegionSettings(Part):
    """Part of the skin that afferents lie in, unrolled; an area there is the same area of skin."""

    shape: Annotated[str, choice(SHAPES)]
    """Kind of shape."""
    length_mm: Positive | None = None
    """Extent of a rectangle or an ellipse along the finger and across. [mm]"""
    width_mm: Positive | None = None
    """Extent of a rectangle or an ellipse along the finger and across. [mm]"""
    corners_mm: Annotated[tuple[Pair, ...], Strict(False)] | None = None
    """Of a polygon: along the finger, distal positive, and across, from the middle of the pad. [mm]"""


class PopulationSettings(Part):
    """The afferents."""

    layout: Annotated[str, choice(LAYOUT_NAMES)] = GRID
    """"grid": the paper's rows and columns; a pattern that fills a region; or "nail rows", along the edge of
    the nail."""
    density_per_cm2: Positive = psychophysics.RECEPTOR_DENSITY.value
    """Afferents per area of skin. [1/cm2]"""
    densities_per_cm2: (
        Annotated[
            dict[Annotated[str, choice(TYPES)], Positive],
            Field(min_length=1),
            with_message(f"a density above 0 of each type, {', '.join(TYPES)}"),
        ]
        | None
    ) = None
    """Instead of one density, that of each type of a mixed population, which all have this layout. [1/cm2]"""
    rows: Count | None = None
    """Of a grid: along the finger and across, the paper's by default; or how many rows along the nail."""
    columns: Count | None = None
    """Of a grid: along the finger and across, the paper's by default; or how many rows along the nail."""
    region: RegionSettings | None = None
    """What any other layout fills."""
    offset_mm: Pair = (0.0, 0.0)
    """Middle of grid, rectangle or ellipse from the middle of the pad, along the finger and across. [mm]"""
    jitter: NotNegative | None = None
    """Displacement of afferents in a jittered layout: standard deviation over the pitch."""
    separation: NotNegative | None = None
    """Least distance in a Poisson-disc layout over 1/sqrt(density)."""
    seed: Seed = 0
    """Of random places and sensitivities; another one is another finger."""
    sensitivity_spread: NotNegative = 0.0
    """How much afferents differ in their gains, as of `fingerpad.neuron.population.sensitivities`."""


class AfferentSettings(Part):
    """The afferent by its numbers; what is absent is as in the afferent of the tissues."""

    intercept_ma: Finite | None = None
    """As of `fingerpad.Afferent`."""
    dynamic_gain: Finite | None = None
    """As of `fingerpad.Afferent`."""
    static_gain: Finite | None = None
    """As of `fingerpad.Afferent`."""
    time_constant_ms: Positive | None = None
    """As of `fingerpad.Afferent`."""
    capacitance_mf: Positive | None = None
    """As of `fingerpad.Afferent`."""
    threshold_mv: Positive | None = None
    """As of `fingerpad.Afferent`."""
    refractory_ms: NotNegative | None = None
    """Rest after each spike. [ms]"""
    dynamic_quantity: Annotated[str, choice(sampled_fields())] | None = None
    """What the two terms follow."""
    static_quantity: Annotated[str, choice(sampled_fields())] | None = None
    """What the two terms follow."""


AfferentChoice = Annotated[
    Annotated[Text, Tag(NAMED)] | Annotated[AfferentSettings, Tag(SPELLED)],
    Discriminator(lambda value: NAMED if isinstance(value, str) else SPELLED),
]
"""The default, a type of afferents by its name, a file of results, or numbers."""


def file_of(chosen: AfferentSettings | str) -> str | None:
    """Name of the file of results that an afferent is read from; None if it is from none."""
    return chosen if isinstance(chosen, str) and chosen not in (DEFAULT, *TYPES) else None
