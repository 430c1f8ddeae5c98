"""The afferents that a file describes, and where they end in the skin."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from pkgutil import resolve_name

import numpy as np

from fingerpad.core.checks import IntArray
from fingerpad.core.errors import InputError
from fingerpad.core.layouts import PATTERNS
from fingerpad.experiments.afferent_files import fitted_afferent
from fingerpad.experiments.descriptions.parts import (
    DEFAULT,
    GRID,
    NAIL_ROWS,
    AfferentSettings,
    PopulationSettings,
)
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population, sensitivities
from fingerpad.psychophysics.encoding import neighbours_of

ELSEWHERE = ("RA", "PC", "SAII")
"""Types of afferents that no file describes."""

_OF_LAYOUT = {
    "rows": (GRID, NAIL_ROWS),
    "columns": (GRID,),
    "region": PATTERNS,
    "offset_mm": (GRID, *PATTERNS),
    "jitter": ("jittered",),
    "separation": ("poisson-disc",),
}


def afferent_of(chosen: AfferentSettings | str, tissues: str, beside: Path = Path()) -> Afferent:
    """Make the afferent of a file.

    Parameters
    ----------
    chosen : AfferentSettings or str
        Numbers, "default", or a file of results.
    tissues : str
        Tissues by name: the default afferent was fitted with them.
    beside : Path, optional
        Folder from which a file of results is named.

    Returns
    -------
    Afferent

    Raises
    ------
    InputError
        If the file cannot be read or holds no fitted parameters.
    """
    if chosen in ELSEWHERE:
        raise InputError(
            f"afferent must be SAI's, as default, numbers or a file of a fit: got {chosen}, which is "
            "simulated in Python, by fingerpad.MixedPopulation."
        )
    fitted = Afferent.for_tissues(tissues)
    if isinstance(chosen, AfferentSettings):
        return replace(fitted, **chosen.given)
    return fitted if chosen == DEFAULT else fitted_afferent(Path(beside) / chosen, tissues)


def population_of(
    settings: PopulationSettings,
    afferent: Afferent,
    place: str = "population",
    finger: Finger | None = None,
) -> Population:
    """Lay out the afferents of a file.

    Parameters
    ----------
    settings : PopulationSettings
        Layout, density, region.
    afferent : Afferent
        Each of them.
    place : str, optional
        Key of the settings in the file, for errors.
    finger : Fingertip or FingerMesh, optional
        The finger in which they lie; by default the paper's.

    Returns
    -------
    Population

    Raises
    ------
    InputError
        If a key is given that the layout does not have, the region is missing or has no area, or no receptor
        falls into it.
    """
    for key, layouts in _OF_LAYOUT.items():
        if key in settings.given and settings.layout not in layouts:
            raise InputError(
                f"{place}.{key} must not be given: it belongs to the layout {' or '.join(layouts)}, and "
                f"this one is {settings.layout}."
            )
    # Only what needs them loads the modules that unroll the skin.
    lay = _grid if settings.layout == GRID else resolve_name(f"{__package__}.skin_layouts:lay")
    laid: Population = lay(settings, afferent, place, finger or Fingertip())
    if settings.sensitivity_spread == 0.0:
        return laid
    return replace(laid, sensitivity=sensitivities(len(laid), settings.sensitivity_spread, settings.seed))


def population_neighbours(settings: PopulationSettings, population: Population) -> IntArray:
    """Return who is whose neighbour in a population that was laid out by `settings`, (n_pairs, 2)."""
    pattern = "rectangular" if settings.layout in (GRID, NAIL_ROWS) else settings.layout
    return neighbours_of(np.asarray(population.places_mm), population.pitch_mm, pattern)


def _grid(settings: PopulationSettings, afferent: Afferent, place: str, finger: Finger) -> Population:
    """Lay the paper's rows and columns."""
    (x, z), (along, across) = finger.contact_mm, settings.offset_mm
    return Population.grid(
        settings.density_per_cm2,
        **settings.chosen("rows", "columns"),
        centre_mm=(x + along, z + across),
        afferent=afferent,
    )
