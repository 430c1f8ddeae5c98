"""Afferents along the edge of the nail, or in a region of the unrolled skin."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fingerpad.core.errors import InputError
from fingerpad.core.layouts import Layout
from fingerpad.core.regions import (
    Ellipse,
    Polygon,
    Rectangle,
    Region,
    hexagonal,
    jittered,
    poisson_disc,
    rectangular,
    uniform,
)
from fingerpad.experiments.descriptions.parts import NAIL_ROWS, PAD, PopulationSettings, RegionSettings
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.neuron.afferent import AnyAfferent
from fingerpad.neuron.population import Population
from fingerpad.skin.nail_edge import NailEdge
from fingerpad.skin.unrolled_skin import UnrolledSkin

_OF_SHAPE = {
    "rectangle": ("length_mm", "width_mm"),
    "ellipse": ("length_mm", "width_mm"),
    "polygon": ("corners_mm",),
    PAD: (),
}


def lay(settings: PopulationSettings, afferent: AnyAfferent, place: str, finger: Finger) -> Population:
    """Lay out afferents by any layout but the paper's grid."""
    if not isinstance(finger, Fingertip):
        raise InputError(
            f"{place}.layout must be grid on a mesh, whose skin has no plane: got {settings.layout}."
        )
    return (_along_nail if settings.layout == NAIL_ROWS else _in_region)(settings, afferent, place, finger)


def _along_nail(
    settings: PopulationSettings, afferent: AnyAfferent, place: str, finger: Fingertip
) -> Population:
    """Lay rows along the edge of the nail."""
    nail = NailEdge(finger)
    with _placed(place):
        rows = nail.rows(settings.rows or 1, settings.density_per_cm2)
    return Population.of_layout(rows, nail.points, afferent)


def _in_region(
    settings: PopulationSettings, afferent: AnyAfferent, place: str, finger: Fingertip
) -> Population:
    """Fill a region of the unrolled skin."""
    if settings.region is None:
        raise InputError(f"{place}.region must be given for the layout {settings.layout}: it is missing.")
    skin = UnrolledSkin(finger)
    region = _region(settings.region, settings.offset_mm, skin, place)
    with _placed(place):
        return Population.of_layout(_layout(settings, region, skin), skin.points, afferent)


def _region(settings: RegionSettings, offset_mm: tuple[float, ...], skin: UnrolledSkin, place: str) -> Region:
    """Part of the unrolled skin that is meant."""
    wanted = _OF_SHAPE[settings.shape]
    for key in wanted:
        if key not in settings.given:
            raise InputError(f"{place}.region.{key} must be given for a {settings.shape}: it is missing.")
    for key in settings.given:
        if key not in ("shape", *wanted):
            raise InputError(
                f"{place}.region.{key} must not be given: a {settings.shape} has "
                f"{', '.join(wanted) or 'no size'}."
            )
    along, across = offset_mm
    length, width = settings.length_mm or 0.0, settings.width_mm or 0.0
    with _placed(f"{place}.region"):
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


@contextmanager
def _placed(key: str) -> Iterator[None]:
    """Put the key in front of an `InputError` from within."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{key}: {error}") from error
