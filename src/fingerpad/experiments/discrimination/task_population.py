"""The afferents of a discrimination task, and where they end in the skin."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from pkgutil import resolve_name

from fingerpad.core.errors import InputError
from fingerpad.core.layouts import PATTERNS
from fingerpad.experiments.afferent_files import fitted_afferent
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.experiments.discrimination.task import (
    DEFAULT,
    GRID,
    NAIL_ROWS,
    AfferentSettings,
    DiscriminationTask,
    PopulationSettings,
)
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population, sensitivities

_OF_LAYOUT = {
    "rows": (GRID, NAIL_ROWS),
    "columns": (GRID,),
    "region": PATTERNS,
    "offset_mm": (GRID, *PATTERNS),
    "jitter": ("jittered",),
    "separation": ("poisson-disc",),
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
    chosen, fitted = task.afferent, Afferent.for_tissues(task.skin.materials)
    if isinstance(chosen, AfferentSettings):
        return replace(fitted, **chosen.given)
    return fitted if chosen == DEFAULT else fitted_afferent(Path(beside) / chosen)


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
    laid = _grid(settings, afferent) if settings.layout == GRID else _on_skin(settings, afferent)
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


def _on_skin(settings: PopulationSettings, afferent: Afferent) -> Population:
    """Lay afferents along the nail or in a region; only such tasks load the modules that unroll the skin."""
    lay = resolve_name("fingerpad.experiments.discrimination.skin_layouts:lay")
    laid: Population = lay(settings, afferent)
    return laid
