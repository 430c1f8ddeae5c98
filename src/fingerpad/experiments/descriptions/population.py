"""The afferents that a file describes, and where they end in the skin."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.core.layouts import PATTERNS
from fingerpad.core.random_streams import seed_of
from fingerpad.core.values import IntArray
from fingerpad.data.afferents import TYPES
from fingerpad.experiments.afferent_files import fitted_afferent
from fingerpad.experiments.descriptions.parts import (
    DEFAULT,
    GRID,
    NAIL_ROWS,
    AfferentSettings,
    PopulationSettings,
    file_of,
)
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.neuron.afferent import Afferent, AnyAfferent
from fingerpad.neuron.afferent_types import afferent_types
from fingerpad.neuron.population import Population, sensitivities
from fingerpad.psychophysics.encoding import neighbours_of

_OF_LAYOUT = {
    "rows": (GRID, NAIL_ROWS),
    "columns": (GRID,),
    "region": PATTERNS,
    "offset_mm": (GRID, *PATTERNS),
    "jitter": ("jittered",),
    "separation": ("poisson-disc",),
}


def afferent_of(chosen: AfferentSettings | str, tissues: str, beside: Path = Path()) -> AnyAfferent:
    """Make the afferent of a file."""
    fitted = Afferent.for_tissues(tissues)
    if isinstance(chosen, AfferentSettings):
        return replace(fitted, **chosen.given)
    if file := file_of(chosen):
        return fitted_afferent(Path(beside) / file, tissues)
    return fitted if chosen == DEFAULT else afferent_types(tissues)[chosen]


def population_of(
    settings: PopulationSettings,
    chosen: AfferentSettings | str,
    tissues: str,
    beside: Path = Path(),
    place: str = "population",
    finger: Finger | None = None,
) -> Population:
    """Lay out the afferents of a file."""
    for key, layouts in _OF_LAYOUT.items():
        if key in settings.given and settings.layout not in layouts:
            raise InputError(
                f"{place}.{key} must not be given: it belongs to the layout {' or '.join(layouts)}, and "
                f"this one is {settings.layout}."
            )
    afferent = afferent_of(chosen, tissues, beside)
    if settings.densities_per_cm2 is None:
        return _laid(settings, afferent, place, finger)
    if "density_per_cm2" in settings.given or chosen in TYPES:
        raise InputError(
            place,
            "must have density_per_cm2 and the type of one afferent, or densities_per_cm2 of several",
            "both",
            "leave one out",
        )
    types = afferent_types(tissues) | ({} if chosen == DEFAULT else {"SAI": afferent})
    parts = {}
    for number, (name, density) in enumerate(settings.densities_per_cm2.items()):
        one = {"density_per_cm2": density, "seed": seed_of(settings.seed, number)}
        parts[name] = _laid(settings.model_copy(update=one), types[name], place, finger)
    return Population.mixed(parts)


def _laid(
    settings: PopulationSettings, afferent: AnyAfferent, place: str, finger: Finger | None
) -> Population:
    """Lay out the afferents of one type."""
    lay = _grid
    if settings.layout != GRID:  # only what needs them loads the modules that unroll the skin
        from fingerpad.experiments.descriptions.skin_layouts import lay
    laid = lay(settings, afferent, place, finger or Fingertip())
    if settings.sensitivity_spread == 0.0:
        return laid
    return replace(laid, sensitivity=sensitivities(len(laid), settings.sensitivity_spread, settings.seed))


def population_neighbours(settings: PopulationSettings, population: Population) -> IntArray:
    """Return who is whose neighbour in a population that was laid out by `settings`, (n_pairs, 2).

    Afferents of a mixed population have neighbours of their own type.
    """
    if population.parts:
        parts = list(population.parts.values())
        starts = np.cumsum([0, *map(len, parts)])
        return np.concatenate(
            [
                start + population_neighbours(settings, part)
                for start, part in zip(starts, parts, strict=False)
            ]
        )
    pattern = "rectangular" if settings.layout in (GRID, NAIL_ROWS) else settings.layout
    return neighbours_of(np.asarray(population.places_mm), population.pitch_mm, pattern)


def _grid(settings: PopulationSettings, afferent: AnyAfferent, place: str, finger: Finger) -> Population:
    """Lay the paper's rows and columns."""
    (x, z), (along, across) = finger.contact_mm, settings.offset_mm
    return Population.grid(
        settings.density_per_cm2,
        **settings.chosen("rows", "columns"),
        centre_mm=(x + along, z + across),
        afferent=afferent,
    )
