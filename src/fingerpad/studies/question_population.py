"""The afferents of a question: what each of them is, and where they end in the skin."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from fingerpad.afferent import PARAMETER_NAMES, Afferent
from fingerpad.errors import InputError
from fingerpad.estimation.tables import read_text
from fingerpad.layouts import Layout, hexagonal, jittered, poisson_disc, rectangular, uniform
from fingerpad.population import Population, sensitivities
from fingerpad.regions import Ellipse, Polygon, Rectangle, Region
from fingerpad.signals import STORED_ENERGY
from fingerpad.studies.conditions import RECEPTOR_X_MM
from fingerpad.studies.question import (
    DEFAULT,
    GRID,
    AfferentSettings,
    PopulationSettings,
    Question,
    RegionSettings,
)

_OF_LAYOUT = {"rows": GRID, "columns": GRID, "jitter": "jittered", "separation": "poisson-disc"}
_OF_SHAPE = {
    "rectangle": ("length_mm", "width_mm"),
    "ellipse": ("length_mm", "width_mm"),
    "polygon": ("corners_mm",),
}


def afferent_of(question: Question, beside: Path = Path()) -> Afferent:
    """Make the afferent of a question.

    Parameters
    ----------
    question : Question
        From `read_question`.
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
    chosen = question.afferent
    if isinstance(chosen, AfferentSettings):
        return Afferent(**{name: value for name, value in chosen.given.items() if value is not None})
    return Afferent() if chosen == DEFAULT else _fitted(Path(beside) / chosen)


def _fitted(path: Path) -> Afferent:
    """Afferent of a file of results: `fit.json`, or `results.json` of a reproduction."""
    try:
        results = json.loads(read_text(path))
    except ValueError as error:
        if isinstance(error, InputError):
            raise InputError(f"afferent: {error}") from error
        raise InputError(f"afferent: {path} cannot be read as JSON ({error}): take another file.") from error
    content = results if isinstance(results, dict) else {}
    section = content.get("fit") or content.get("single_unit") or {}
    parameters = section.get("parameters") if isinstance(section, dict) else None
    if not isinstance(parameters, dict) or not set(PARAMETER_NAMES) <= parameters.keys():
        raise InputError(
            f"afferent must be {DEFAULT}, or a file with fitted parameters such as fit.json of fingerpad "
            f"fit: {path} holds none."
        )
    quantity = (content.get("manifest") or {}).get("dynamic_quantity", STORED_ENERGY)
    six = [parameters[name] for name in PARAMETER_NAMES]
    return Afferent.from_parameters(six, dynamic_quantity=quantity)


def population_of(question: Question, beside: Path = Path()) -> Population:
    """Lay out the afferents of a question.

    Parameters
    ----------
    question : Question
        From `read_question`.
    beside : Path, optional
        As in `afferent_of`.

    Returns
    -------
    Population

    Raises
    ------
    InputError
        As `afferent_of`, or if something is given that the layout has no use for, the region is missing or
        has no area, or no receptor falls into it.
    """
    settings, afferent = question.population, afferent_of(question, beside)
    for key, layout in _OF_LAYOUT.items():
        if key in settings.given and settings.layout != layout:
            raise InputError(
                f"population.{key} must not be given: it belongs to the layout {layout}, and this one is "
                f"{settings.layout}."
            )
    along, across = settings.offset_mm
    if settings.layout == GRID:
        if settings.region is not None:
            raise InputError("population.region must not be given: a grid has rows and columns.")
        laid = Population.grid(
            settings.density_per_cm2,
            **settings.chosen("rows", "columns"),
            centre_mm=(RECEPTOR_X_MM + along, across),
            afferent=afferent,
        )
    else:
        laid = _in_region(settings, afferent)
    if settings.sensitivity_spread == 0.0:
        return laid
    return replace(laid, sensitivity=sensitivities(len(laid), settings.sensitivity_spread, settings.seed))


def _in_region(settings: PopulationSettings, afferent: Afferent) -> Population:
    """Fill the region of any layout but the grid."""
    if settings.region is None:
        raise InputError(f"population.region must be given for the layout {settings.layout}: it is missing.")
    centre = RECEPTOR_X_MM + settings.offset_mm[0], settings.offset_mm[1]
    layout = _layout(settings, _region(settings.region, centre))
    return Population.of_layout(layout, None, afferent)


def _region(settings: RegionSettings, centre_mm: tuple[float, float]) -> Region:
    """Part of the plane that a region means."""
    wanted = _OF_SHAPE[settings.shape]
    for key in wanted:
        if key not in settings.given:
            raise InputError(f"population.region.{key} must be given for a {settings.shape}: it is missing.")
    for key in settings.given:
        if key not in ("shape", *wanted):
            raise InputError(
                f"population.region.{key} must not be given: a {settings.shape} has {', '.join(wanted)}."
            )
    with _placed("population.region"):
        if settings.shape == "polygon":
            corners = [(centre_mm[0] + x, centre_mm[1] + z) for x, z in settings.corners_mm or ()]
            return Polygon(tuple(corners))
        length, width = settings.length_mm or 0.0, settings.width_mm or 0.0
        if settings.shape == "ellipse":
            return Ellipse(0.5 * length, 0.5 * width, centre_mm)
        return Rectangle(length, width, centre_mm)


def _layout(settings: PopulationSettings, region: Region) -> Layout:
    """Places in a region."""
    density, seed = settings.density_per_cm2, settings.seed
    with _placed("population"):
        if settings.layout == "rectangular":
            return rectangular(region, density)
        if settings.layout == "hexagonal":
            return hexagonal(region, density)
        if settings.layout == "uniform":
            return uniform(region, density, seed)
        if settings.layout == "jittered":
            return jittered(region, density, seed, **settings.chosen("jitter"))
        return poisson_disc(region, density, seed, **settings.chosen("separation"))


@contextmanager
def _placed(key: str) -> Iterator[None]:
    """Put the key in front of an `InputError` from within."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{key}: {error}") from error
