"""Fields of an indentation, each declared once: name, unit, place, how it is stored, sampled and exported.

`Touch.solve` computes, `Store` writes and reads, `SkinResponse.sample` interpolates and `export_touch` writes
the entries of `FIELDS`. To add a field, add one entry. Files stored before are not found any more, because
the key of a touch depends on this file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from fingerpad.core.errors import InputError

# Only for types: the command line reads the names of the quantities here, without compiling anything.
if TYPE_CHECKING:
    from fingerpad.core.values import FloatArray, IntArray
    from fingerpad.geometry.mesh import Mesh
    from fingerpad.mechanics.press import Deformation


class Place(Enum):
    """Where a field has values."""

    PRESS = "one value for the whole press"
    NODE = "nodes"
    SKIN_NODE = "nodes of `mesh.skin_nodes`"
    ELEMENT = "elements"
    WATCHED = "elements that are watched: `watched_elements` when stored, all when exported"


class Times(Enum):
    """At which times a field is stored."""

    NONE = "not stored"
    ALL = "all times"
    LAST = "last time"


@dataclass(frozen=True)
class Field:
    """One field of an indentation."""

    name: str  # Name in `SkinResponse.fields` and in stored files.
    unit: str
    long_name: str  # What it is, in words for an axis or a legend.
    place: Place
    of: Callable[[Deformation, Mesh], FloatArray]
    """Computes it from a `Deformation` and its mesh: array (n_times, n_places, n_components), without an axis
    of places for `Place.PRESS` and without one of components for a scalar."""
    components: int = 1  # Number of components: 1 of a scalar, 3 of a vector, 6 of a symmetric tensor.
    stored: Times = Times.NONE
    """Times at which it is stored. Fields at places are stored in single precision."""
    sampled: str = ""
    """Name under which receptors sample it, see `SkinResponse.sample`; empty if they do not. It needs a
    scalar of elements that is stored at all times and is never negative."""
    exported: str = ""  # Name in VTU files; empty if it is not exported.

    def shape(self, mesh: Mesh, n_times: int, n_watched: int) -> tuple[int, ...]:
        sizes = {
            Place.PRESS: (),
            Place.NODE: (len(mesh.nodes_mm),),
            Place.SKIN_NODE: (mesh.skin_nodes.size,),
            Place.ELEMENT: (len(mesh.elements),),
            Place.WATCHED: (n_watched,),
        }
        times = (n_times,) if self.stored is Times.ALL else ()
        return (*times, *sizes[self.place], *((self.components,) if self.components > 1 else ()))

    def stored_values(self, deformation: Deformation, mesh: Mesh) -> FloatArray:
        """Array to store, from a press that watched `watched_elements`."""
        values = self.of(deformation, mesh)
        return values[-1] if self.stored is Times.LAST else values


def _by(path: str) -> Callable[[Deformation, Mesh], FloatArray]:
    """Return an attribute of a deformation, as `Field.of` does."""
    return lambda deformation, _: attrgetter(path)(deformation)


def _at_last_time(function: str) -> Callable[[Deformation, Mesh], FloatArray]:
    """Values of a function of `mechanics.fields` of the stress at the last time."""

    def of(deformation: Deformation, _: Mesh) -> FloatArray:
        from fingerpad.mechanics import fields as computed  # only who samples them loads its kernels

        values: FloatArray = getattr(computed, function)(deformation.stress_kpa)
        return values[None]

    return of


def _over_time(
    place: Place, name: str, unit: str, words: str, path: str = "", components: int = 1, exported: str = ""
) -> Field:
    """Field over time, stored and exported."""
    of = _by(path or name)
    return Field(name, unit, words, place, of, components, Times.ALL, exported=exported or name)


_of_press, _at_skin = partial(_over_time, Place.PRESS), partial(_over_time, Place.SKIN_NODE)


def _watched(
    name: str, unit: str, long_name: str, attribute: str, components: int = 1, exported: str = ""
) -> Field:
    """Field of elements that `ElementFields` computes, exported."""
    of = _by(f"fields.{attribute}")
    return Field(name, unit, long_name, Place.WATCHED, of, components, exported=exported or attribute)


def _sampled(name: str, unit: str, long_name: str, attribute: str, exported: str = "") -> Field:
    """Field of elements that `ElementFields` computes, exported, stored and sampled."""
    return replace(
        _watched(name, unit, long_name, attribute, exported=exported), stored=Times.ALL, sampled=name
    )


FIELDS: dict[str, Field] = {
    field.name: field
    for field in (
        _of_press("times_ms", "ms", "time", exported="TimeValue"),
        _of_press("force_mn", "mN", "force of the indenter along its axis, on the whole finger"),
        _of_press("depth_mm", "mm", "advance of the indenter since first touch"),
        _of_press(
            "contact_area_mm2", "mm²", "undeformed skin that the indenter touches, on the whole finger",
            "contact.area_mm2",
        ),
        _of_press("contact_force_mn", "mN", "force of the indenter on the skin, with friction", components=3),
        _of_press("reaction_mn", "mN", "force of the tissue on bone and nail", components=3),
        _of_press("external_uj", "µJ", "work of the indenter", "energy.external_uj"),
        _of_press("stored_uj", "µJ", "stored energy", "energy.stored_uj"),
        _of_press(
            "dissipated_uj", "µJ", "energy dissipated by relaxation and friction", "energy.dissipated_uj"
        ),
        _of_press("contact_uj", "µJ", "energy in the springs of the contact", "energy.contact_uj"),
        Field(
            "skin_displacement_mm", "mm", "displacement of the skin", Place.SKIN_NODE,
            lambda d, mesh: d.displacement_mm[:, mesh.skin_nodes], components=3, stored=Times.ALL,
        ),
        Field(
            "displacement_mm", "mm", "displacement", Place.NODE, _by("displacement_mm"), components=3,
            stored=Times.LAST, exported="displacement_mm",
        ),
        _at_skin(
            "contact_pressure_kpa", "kPa", "pressure of the indenter on the skin", "contact.pressure_kpa"
        ),
        _at_skin(
            "shear_kpa", "kPa", "friction over the area of the skin", "contact.shear_kpa", components=3,
            exported="contact_shear_kpa",
        ),
        _at_skin("slip_mm", "mm", "way that skin in contact has slid", "contact.slip_mm"),
        Field(
            "sed_kpa", "kPa", "strain energy density", Place.ELEMENT, _by("sed_kpa"), stored=Times.ALL,
            sampled="stored", exported="sed_stored_kpa",
        ),
        Field(
            "von_mises_kpa", "kPa", "von Mises stress at the last time", Place.ELEMENT,
            _at_last_time("von_mises"), stored=Times.LAST,
        ),
        Field(
            "compressive_stress_kpa", "kPa", "largest compressive stress at the last time", Place.ELEMENT,
            _at_last_time("largest_compression"), stored=Times.LAST,
        ),
        _sampled(
            "instantaneous", "kPa", "strain energy density without relaxation", "instantaneous_kpa",
            exported="sed_instantaneous_kpa",
        ),
        _sampled("work", "kPa", "work of the stress per volume", "work_kpa", exported="sed_work_kpa"),
        _sampled("von_mises", "kPa", "von Mises stress", "von_mises_kpa"),
        _sampled("compressive_strain", "", "largest compressive logarithmic strain", "compressive_strain"),
        _sampled("compressive_stress", "kPa", "largest compressive stress", "compressive_stress_kpa"),
        _watched("stress", "kPa", "Cauchy stress", "stress_kpa", components=6),
        _watched("strain", "", "logarithmic strain", "strain", components=6),
        _watched("green_lagrange_strain", "", "Green-Lagrange strain", "green_lagrange_strain", components=6),
        _watched(
            "principal_stress", "kPa", "principal Cauchy stresses, smallest first", "principal_stress_kpa",
            components=3,
        ),
        _watched(
            "principal_strain", "", "principal logarithmic strains, smallest first", "principal_strain",
            components=3,
        ),
        _watched("pressure", "kPa", "mean compressive stress", "pressure_kpa"),
    )
}  # fmt: skip


def watched_elements(mesh: Mesh, depths_mm: Sequence[float] = ()) -> IntArray:
    """Elements of `Place.WATCHED`: the sheet of the living epidermis, then the layers that hold depths."""
    sheet = mesh.living_epidermis.ravel()
    if not len(depths_mm):
        return sheet
    layers = [mesh.layer[mesh.elements_at(depth_mm)] for depth_mm in depths_mm]
    if empty := [depth for depth, found in zip(depths_mm, layers, strict=True) if not found.size]:
        wanted = f"must be depths of the tissue, which is at most {mesh.node_depth_mm.max():.3g} mm thick"
        raise InputError("receptor_depths_mm", wanted, f"{empty[0]:g} mm")
    held = np.flatnonzero(np.isin(mesh.layer, np.concatenate(layers)))
    return np.concatenate([sheet, np.setdiff1d(held, sheet)])


def stored_fields() -> tuple[Field, ...]:
    return tuple(field for field in FIELDS.values() if field.stored is not Times.NONE)


def sampled_fields() -> dict[str, Field]:
    """Fields that may drive an afferent, by the names under which receptors sample them."""
    return {field.sampled: field for field in FIELDS.values() if field.sampled}
