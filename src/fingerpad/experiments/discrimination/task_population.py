"""The afferents of a discrimination task, and where they end in the skin."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.files import read_text
from fingerpad.core.layouts import PATTERNS, Layout, hexagonal, jittered, poisson_disc, rectangular, uniform
from fingerpad.core.regions import Ellipse, Polygon, Rectangle, Region
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.experiments import schemas
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.experiments.discrimination.task import (
    DEFAULT,
    GRID,
    NAIL_ROWS,
    PAD,
    AfferentSettings,
    DiscriminationTask,
    PopulationSettings,
    RegionSettings,
)
from fingerpad.neuron.afferent import PARAMETER_NAMES, Afferent
from fingerpad.neuron.population import Population, sensitivities
from fingerpad.skin.nail_edge import NailEdge
from fingerpad.skin.unrolled_skin import UnrolledSkin

_OF_LAYOUT = {
    "rows": (GRID, NAIL_ROWS),
    "columns": (GRID,),
    "region": PATTERNS,
    "offset_mm": (GRID, *PATTERNS),
    "jitter": ("jittered",),
    "separation": ("poisson-disc",),
}
_OF_SHAPE = {
    "rectangle": ("length_mm", "width_mm"),
    "ellipse": ("length_mm", "width_mm"),
    "polygon": ("corners_mm",),
    PAD: (),
}


def task_afferent(task: DiscriminationTask, beside: Path = Path()) -> Afferent:
    """Make the afferent of a task.

    Parameters
    ----------
    task : DiscriminationTask
        From `read_task`.
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
    chosen = task.afferent
    if isinstance(chosen, AfferentSettings):
        return Afferent(**chosen.given)
    return Afferent() if chosen == DEFAULT else _fitted(Path(beside) / chosen)


def _fitted(path: Path) -> Afferent:
    """Afferent of a file of results: `fit.json`, or `results.json` of a reproduction."""
    try:
        read_text(path)  # names a file that cannot be read
        values = schemas.read(path, "fingerpad fit", "fingerpad reproduction")
    except (InputError, StoreError) as error:
        raise InputError(f"afferent: {error}") from error
    is_fit = "fit" in values
    parameters = values["fit" if is_fit else "single_unit"]["parameters"]
    quantity = values["dynamic_quantity"] if is_fit else STORED_ENERGY
    return Afferent.from_parameters([parameters[name] for name in PARAMETER_NAMES], dynamic_quantity=quantity)


def task_population(task: DiscriminationTask, beside: Path = Path()) -> Population:
    """Lay out the afferents of a task.

    Parameters
    ----------
    task : DiscriminationTask
        From `read_task`.
    beside : Path, optional
        As in `task_afferent`.

    Returns
    -------
    Population

    Raises
    ------
    InputError
        As `task_afferent`, or if a key is given that the layout does not have, the region is missing or
        has no area, or no receptor falls into it.
    """
    settings, afferent = task.population, task_afferent(task, beside)
    for key, layouts in _OF_LAYOUT.items():
        if key in settings.given and settings.layout not in layouts:
            raise InputError(
                f"population.{key} must not be given: it belongs to the layout {' or '.join(layouts)}, and "
                f"this one is {settings.layout}."
            )
    laid = _LAID.get(settings.layout, _in_region)(settings, afferent)
    if settings.sensitivity_spread == 0.0:
        return laid
    return replace(laid, sensitivity=sensitivities(len(laid), settings.sensitivity_spread, settings.seed))


def _grid(settings: PopulationSettings, afferent: Afferent) -> Population:
    """Lay the paper's rows and columns."""
    along, across = settings.offset_mm
    return Population.grid(
        settings.density_per_cm2,
        **settings.chosen("rows", "columns"),
        centre_mm=(RECEPTOR_X_MM + along, across),
        afferent=afferent,
    )


def _along_nail(settings: PopulationSettings, afferent: Afferent) -> Population:
    """Lay rows along the edge of the nail."""
    nail = NailEdge()
    with _placed("population"):
        rows = nail.rows(settings.rows or 1, settings.density_per_cm2)
    return Population.of_layout(rows, nail.points, afferent)


def _in_region(settings: PopulationSettings, afferent: Afferent) -> Population:
    """Fill a region of the unrolled skin."""
    if settings.region is None:
        raise InputError(f"population.region must be given for the layout {settings.layout}: it is missing.")
    skin = UnrolledSkin(origin_x_mm=RECEPTOR_X_MM)
    region = _region(settings.region, settings.offset_mm, skin)
    with _placed("population"):
        return Population.of_layout(_layout(settings, region, skin), skin.points, afferent)


def _region(settings: RegionSettings, offset_mm: tuple[float, ...], skin: UnrolledSkin) -> Region:
    """Part of the unrolled skin that is meant."""
    wanted = _OF_SHAPE[settings.shape]
    for key in wanted:
        if key not in settings.given:
            raise InputError(f"population.region.{key} must be given for a {settings.shape}: it is missing.")
    for key in settings.given:
        if key not in ("shape", *wanted):
            raise InputError(
                f"population.region.{key} must not be given: a {settings.shape} has "
                f"{', '.join(wanted) or 'no size'}."
            )
    along, across = offset_mm
    length, width = settings.length_mm or 0.0, settings.width_mm or 0.0
    with _placed("population.region"):
        if settings.shape == PAD:
            return skin.pad()
        if settings.shape == "polygon":
            corners = [(along + x, across + z) for x, z in settings.corners_mm or ()]
            return Polygon(tuple(corners))
        if settings.shape == "ellipse":
            return Ellipse(0.5 * length, 0.5 * width, (along, across))
        return Rectangle(length, width, (along, across))


def _layout(settings: PopulationSettings, region: Region, skin: UnrolledSkin) -> Layout:
    """Places in a region."""
    density, seed = settings.density_per_cm2, settings.seed
    if settings.layout == "rectangular":
        return rectangular(region, density)
    if settings.layout == "hexagonal":
        return hexagonal(region, density)
    if settings.layout == "uniform":
        return uniform(region, density, seed)
    if settings.layout == "jittered":
        return jittered(region, density, seed, **settings.chosen("jitter"))
    return poisson_disc(region, density, seed, **settings.chosen("separation"), place=skin.points)


_LAID = {GRID: _grid, NAIL_ROWS: _along_nail}


@contextmanager
def _placed(key: str) -> Iterator[None]:
    """Put the key in front of an `InputError` from within."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{key}: {error}") from error
