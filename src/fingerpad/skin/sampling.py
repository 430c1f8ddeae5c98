"""Response of the skin to an indentation: surface profile, and strain energy density at the receptors."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checked import value_class
from fingerpad.core.displayed import Columns, Contents, Result, dataset_of
from fingerpad.core.errors import InputError
from fingerpad.core.phases import Phase
from fingerpad.core.signals import STORED_ENERGY, ResponseMap, Traces
from fingerpad.core.values import (
    Check,
    FiniteVector,
    FloatArray,
    IntArray,
    Many,
    Number,
    Numbers,
    Whole,
    float_array,
    increasing,
    one_of,
)
from fingerpad.geometry.mesh import Mesh
from fingerpad.geometry.motion import STILL, Pose
from fingerpad.mechanics.tissues import name_of_tissues
from fingerpad.skin.caveats import Caveat, caveats_of
from fingerpad.skin.dataset import attributes, variables
from fingerpad.skin.fields import FIELDS, Place, sampled_fields, stored_fields, watched_elements
from fingerpad.skin.receptor_sheet import Part, ReceptorSheet
from fingerpad.skin.section import SURFACE_QUANTITIES, Section, SurfaceMotion, middle_section

if TYPE_CHECKING:
    import xarray

    from fingerpad.geometry.free_mesh import FreeMesh
    from fingerpad.mechanics.press import Deformation
    from fingerpad.skin.free_receptors import FreeReceptors
    from fingerpad.skin.indentation import Touch
else:  # both are set by a press alone, whose modules a stored touch does not need
    Deformation = Touch = Any


Receptors: TypeAlias = "ReceptorSheet | FreeReceptors"  # Places of end organs in a mesh, and values there.

_PLACES_KEPT = 4  # Sets of sites whose end organs are remembered.


@value_class
class SurfaceProfile(Result):
    """Deflection of the skin along the midline of the finger."""

    distance_mm: Annotated[FloatArray, Check(increasing, {})]
    """Position of the undeformed skin relative to the indenter's axis, distal positive, (n_nodes,). [mm]"""
    deflection_mm: FiniteVector
    """Displacement along the direction of pressing, towards the bone positive, (n_nodes,). [mm]"""

    def __post_init__(self) -> None:
        distance, deflection = self.distance_mm, self.deflection_mm
        if not distance.size or distance.shape != deflection.shape:
            got = f"{deflection.size} for {distance.size} distances"
            raise InputError(f"SurfaceProfile needs one deflection per distance: got {got}.")

    def __repr__(self) -> str:
        return (
            f"SurfaceProfile({self.distance_mm.size} nodes from {self.distance_mm[0]:.3g} to "
            f"{self.distance_mm[-1]:.3g} mm, deflected by at most {self.deflection_mm.max():.3g} mm)"
        )

    def at(self, distance_mm: ArrayLike) -> FloatArray:
        """Deflection at other distances, linear between nodes. [mm]"""
        return np.interp(np.asarray(distance_mm, dtype=float), self.distance_mm, self.deflection_mm)


def _stored(name: str) -> property:
    """Make a property of a stored field, whose words are those of `FIELDS`."""
    unit = FIELDS[name].unit

    def values(self: SkinResponse) -> FloatArray:
        return self.fields[name]

    said = FIELDS[name].long_name.capitalize()
    return property(values, doc=f"{said}. [{unit}]" if unit else f"{said}.")


@value_class
class SkinResponse(Result):
    """Response of the skin to one indentation; the end of the mechanical half of the chain."""

    mesh: Mesh  #: The undeformed body.
    kinks_ms: Numbers  #: Times at which the speed of the motion jumps: the end of the ramp. [ms]
    axis_x_mm: Number  #: x at which the indenter's axis meets the midline. [mm]
    direction: FloatArray  #: Unit direction of pressing, (3,).
    fields: Mapping[str, FloatArray]  #: Stored fields by their names in `skin.fields.FIELDS`.
    force_imbalance: Number
    """Largest difference of the indenter's force to the reaction of bone and nail, over that force."""
    energy_imbalance: Number
    """Largest difference at any time between the indenter's work and what was stored, dissipated and held by
    the contact, over that work."""
    penetration_mm: Number  #: Deepest penetration of the indenter by any node at any time. [mm]
    newton_steps: Whole
    factorisations: Whole
    linear_solver: str  #: The linear solver, and why it was chosen.
    deformation: Deformation | None = None
    """All nodes and elements over time, of `Touch.solve(whole=True)`; stored files do not hold it."""
    phases: Many[Phase] = ()  #: Named phases of the motion.
    pose: Pose = STILL  #: How far the indenter has moved aside and turned since first touch, at the end.
    touch: Touch | None = None  #: What was solved: indenter, motion, tissues.
    onset_ms: Number = 0.0  #: Time of first touch. [ms]
    receptor_depths_mm: Numbers = ()
    """Depths at which all quantities are kept beside the border of epidermis and dermis. [mm]"""

    times_ms = _stored("times_ms")  # From 0, the unloaded state, (n_times,).
    force_mn = _stored("force_mn")  # Along the axis, (n_times,).
    depth_mm = _stored("depth_mm")  # (n_times,)
    contact_area_mm2 = _stored("contact_area_mm2")  # (n_times,)
    contact_force_mn = _stored("contact_force_mn")  # (n_times, 3)
    contact_pressure_kpa = _stored("contact_pressure_kpa")  # On `mesh.skin_nodes`, (n_times, n_skin_nodes).
    shear_kpa = _stored("shear_kpa")  # (n_times, n_skin_nodes, 3)
    slip_mm = _stored("slip_mm")  # Since the skin came to touch, (n_times, n_skin_nodes).
    reaction_mn = _stored("reaction_mn")  # Of the whole finger, (n_times, 3).
    skin_displacement_mm = _stored("skin_displacement_mm")  # (n_times, n_skin_nodes, 3)
    displacement_mm = _stored("displacement_mm")  # Of all nodes at the last time, (n_nodes, 3).
    sed_kpa = _stored("sed_kpa")  # Stored, element mean, (n_times, n_elements).
    von_mises_kpa = _stored("von_mises_kpa")  # (n_elements,)

    def __post_init__(self) -> None:
        declared = {field.name: field for field in stored_fields()}
        for name, values in self.fields.items():
            field = declared[one_of("field", name, tuple(declared))]
            shape = field.shape(self.mesh, self.times_ms.size, self.watched_elements.size)
            if values.shape != shape:
                raise InputError(f"Field {name} must have the shape {shape}: got {values.shape}.")
            if not np.isfinite(values).all():
                raise InputError(f"Field {name} must be finite everywhere: some values are not.")

    @cached_property
    def watched_elements(self) -> IntArray:
        """Elements in which all quantities are kept: the sheet of the living epidermis first."""
        return watched_elements(self.mesh, self.receptor_depths_mm)

    @cached_property
    def caveats(self) -> tuple[Caveat, ...]:
        """Where this result lies outside of what was verified; empty if nowhere."""
        return caveats_of(self)

    def __repr__(self) -> str:
        body = "" if self.touch is None else f"{self.touch.indenter!r}, "
        return (
            f"SkinResponse({body}{self.times_ms.size} times to {self.times_ms[-1]:g} ms, at most "
            f"{self.depth_mm.max():.3g} mm and {self.force_mn.max():.3g} mN)"
        )

    def columns(self) -> Columns:
        """Every quantity of the whole press by time; a vector has one column per axis."""
        found: Columns = {}
        for field in stored_fields():
            if field.place is Place.PRESS and field.name in self.fields:
                axes = ("",) if field.components == 1 else ("_x", "_y", "_z")
                values = self.fields[field.name].reshape(self.times_ms.size, -1)
                found |= {field.name + axis: column for axis, column in zip(axes, values.T, strict=True)}
        return found

    def contents(
        self, response: ResponseMap | None = None, quantities: Sequence[str] = (), seed: Whole | None = None
    ) -> Contents:
        """Fields of the press, mesh, object and afferents, and what was pressed; see `to_dataset`."""
        return variables(self, response, quantities), attributes(self, response, seed)

    def to_dataset(
        self,
        response: ResponseMap | None = None,
        *,
        quantities: Sequence[str] = (),
        seed: Whole | None = None,
    ) -> xarray.Dataset:
        """Return this result, and the response of a population to it, as one labelled data set.

        Parameters
        ----------
        response : ResponseMap, optional
            Response of a population to it.
        quantities : sequence of str
            Further fields of `skin.fields.FIELDS`, such as "stress", in all elements; they need the
            deformation (`whole=True`).
        seed : int, optional
            Seed behind the population, if it had one; kept as an attribute.

        Returns
        -------
        xarray.Dataset
            What is at nodes and elements is in single precision, all else in double. With the deformation
            the displacement of all nodes is there at all times, else at the last; that of the skin always is.

        Examples
        --------
        >>> import fingerpad as fp
        >>> skin = fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.3))
        >>> touch = skin.to_dataset()
        >>> touch.contact_pressure_kpa.dims, touch.contact_pressure_kpa.units
        (('time', 'skin_node'), 'kPa')
        >>> f"{touch.depth_mm[-1].item():g} {touch.depth_mm.units}"
        '0.3 mm'
        """
        return dataset_of(self.contents(response, quantities, seed))

    def with_fields(self, **fields: FloatArray) -> SkinResponse:
        """Return the same response with other values of some fields."""
        return replace(self, fields={**self.fields, **fields})

    @property
    def pad_mm(self) -> tuple[float, float] | None:
        """X and z of the middle of the pad of the finger, None if `touch` is not known. [mm]"""
        return None if self.touch is None else self.touch.finger.contact_mm

    @cached_property
    def tissues_name(self) -> str:
        """Name of the set of tissues; empty for tissues of your own, or if `touch` is not known."""
        return "" if self.touch is None else name_of_tissues(self.touch.tissues)

    def at_end(self, quantity: str) -> tuple[str, FloatArray]:
        """Return a quantity of `sample` in words, and its values in all elements at the last time. [kPa]

        Strain energy density stands for quantities that are not kept in all elements.
        """
        kept = {"von_mises": "von_mises_kpa", "compressive_stress": "compressive_stress_kpa"}
        last = kept.get(quantity, "")
        if last in self.fields:
            return quantity.replace("_", " ").replace("mises", "Mises stress"), self.fields[last]
        return "strain energy density", self.sed_kpa[-1]

    def surface_profile(self, time_index: Whole = -1) -> SurfaceProfile:
        """Deflection along the midline of the volar skin at one of `times_ms` (paper, section 2.2.1)."""
        row = np.searchsorted(self.mesh.skin_nodes, self.mesh.midline_nodes)
        distance = self.mesh.nodes_mm[self.mesh.midline_nodes, 0] - self.axis_x_mm
        return SurfaceProfile(distance, self.skin_displacement_mm[time_index, row] @ self.direction)

    def section(self) -> Section:
        """Middle plane of the finger, z = 0, as it lies at the last time."""
        return middle_section(self.mesh, self.displacement_mm)

    def sed(
        self,
        sites: ArrayLike,
        dynamic_quantity: str = STORED_ENERGY,
        static_quantity: str = STORED_ENERGY,
        depth_mm: ArrayLike | None = None,
    ) -> Traces:
        """Strain energy density at end organs below points of the undeformed skin.

        End organs lie on the epidermal-dermal border, or `depth_mm` deep, and move with the tissue. A pair
        gives an organ's own x and z, a triple the point of the skin from which it lies 0.471 mm or `depth_mm`
        deep along the normal. The means of the elements just above the border (0.371 to 0.471 mm deep) are
        interpolated along it by a cubic spline, and never across it, where SED jumps. At other depths the
        value is linear between the middles of the elements of one layer, and constant from the last middle to
        the border. A depth on a border belongs to the layer above it.

        Parameters
        ----------
        sites : array (n_sites, 2) or (n_sites, 3)
            x and z of end organs on the volar side, or x, y and z of the skin above them on any side. [mm]
        dynamic_quantity, static_quantity : str, optional
            What drives the dynamic and the static response, names of `sample`. Default: SED, as in the paper.
        depth_mm : float or array (n_sites,), optional
            Depth of the end organs below the undeformed skin, along its normal, from the surface to the bone.
            By default they lie on the border of epidermis and dermis. [mm]

        Returns
        -------
        Traces
            One column per site, with the end of the ramp as kink.

        Examples
        --------
        >>> import fingerpad as fp
        >>> skin = fp.indent(fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.3))
        >>> deep = skin.sed([(17.37, 0.0)], depth_mm=1.2)
        >>> bool(deep.values[-1, 0] < skin.sed([(17.37, 0.0)]).values[-1, 0])
        True
        """
        static, *other = self._read(dict.fromkeys((static_quantity, dynamic_quantity)), sites, depth_mm)
        dynamic = Traces(self.times_ms, other[0], quantity=dynamic_quantity) if other else None
        motion = self.phases, self.onset_ms
        return Traces(self.times_ms, static, np.array(self.kinks_ms), static_quantity, dynamic, *motion)

    def sample(self, quantity: str, sites: ArrayLike, depth_mm: ArrayLike | None = None) -> FloatArray:
        """Sample a quantity that may drive an afferent below points of the skin, (n_times, n_sites).

        The interpolation is that of `sed`; the stored energy density is one of the quantities. It is kept at
        all depths. The other quantities of the tissue are kept on the border of epidermis and dermis and in
        the layers of the depths that `receptor_depths_mm` gave to `indent`.

        Parameters
        ----------
        quantity : str
            One of `skin.fields.sampled_fields`: "stored", "instantaneous" or "work" (energy densities by
            their three definitions), "von_mises", "compressive_stress" [all kPa] or "compressive_strain"
            (logarithmic); or of `skin.surface_motion.SURFACE_QUANTITIES`: "skin_displacement" (how far the
            skin above has moved, in mm), "deep_displacement" (its mean within 3 mm) or
            "skin_stretch" (largest tensile strain within the surface).
        sites : array (n_sites, 2) or (n_sites, 3)
            x and z of end organs on the volar side, or x, y and z of the skin above them on any side. [mm]
        depth_mm : float or array (n_sites,), optional
            As of `sed`. Quantities of the surface have no depth: they are those of the skin above. [mm]
        """
        return self._read([quantity], sites, depth_mm)[0]

    def _read(
        self, quantities: Iterable[str], sites: ArrayLike, depth_mm: ArrayLike | None
    ) -> list[FloatArray]:
        """Several quantities at the same sites, (n_times, n_sites) each."""
        held = {name: field.name for name, field in sampled_fields().items() if field.name in self.fields}
        for quantity in quantities:
            one_of("quantity", quantity, (*held, *SURFACE_QUANTITIES))
            if depth_mm is not None and quantity in SURFACE_QUANTITIES:
                raise InputError("depth_mm", f"must be left out for {quantity}, which is that of the surface")
        parts = places_below(self._receptors, sites, depth_mm)
        read = []
        for quantity in quantities:
            values = np.zeros((self.times_ms.size, len(np.asarray(sites))))
            for part in parts:
                known = self._in_elements(quantity, held.get(quantity, ""), part.elements, depth_mm)
                values[:, part.organs] += part.weights * self._receptors.read(part.places, known)
            # A spline may dip below zero beside a steep front; no quantity can.
            np.maximum(values, 0.0, out=values)
            values.setflags(write=False)
            read.append(values)
        return read

    def _in_elements(
        self, quantity: str, name: str, elements: IntArray, depth_mm: ArrayLike | None
    ) -> FloatArray:
        """One quantity in elements, or above those of the living epidermis, (n_times, n_elements)."""
        if quantity in SURFACE_QUANTITIES:
            return self._surface.below(quantity)
        if FIELDS[name].place is not Place.WATCHED:
            return self.fields[name][:, elements]
        row = np.full(len(self.mesh.elements), -1)
        row[self.watched_elements] = np.arange(self.watched_elements.size)
        if (row[elements] < 0).any():
            lacking = ", ".join(f"{each:g}" for each in np.unique(np.asarray(depth_mm, dtype=float))[:3])
            raise InputError(
                "depth_mm",
                f"must be one at which the press kept {quantity}",
                f"{lacking} mm",
                f"press with receptor_depths_mm=({lacking},)",
            )
        return self.fields[name][:, row[elements]]

    @cached_property
    def _surface(self) -> SurfaceMotion:
        return SurfaceMotion(self.mesh, self.skin_displacement_mm)

    @cached_property
    def _receptors(self) -> Receptors:
        return receptors_of(self.mesh)


def receptors_of(mesh: Mesh) -> Receptors:
    """Return what finds end organs in a mesh and reads fields there."""
    if mesh.is_grid:
        return ReceptorSheet(mesh)
    # Loaded for those who have a mesh of their own.
    from fingerpad.skin.free_receptors import FreeReceptors

    return FreeReceptors(cast("FreeMesh", mesh))


def places_below(receptors: Receptors, sites: ArrayLike, depth_mm: ArrayLike | None = None) -> Sequence[Part]:
    """Find end organs by their x and z on the volar side, or below x, y and z of the skin."""
    points = float_array("sites", sites, None)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        wanted = "must be a list of places, such as [(x, z)] or [(x, y, z)], in mm"
        raise InputError("sites", wanted, f"shape {points.shape}")
    if depth_mm is None:
        return _places_of(_Sites(receptors, points))
    depths = float_array("depth_mm", depth_mm, None)
    if depths.shape not in ((), (len(points),)):
        raise InputError(
            "depth_mm", f"must be one number or one per site, {len(points)}", f"shape {depths.shape}"
        )
    if (depths <= 0.0).any():
        raise InputError("depth_mm", "must be greater than 0", f"{depths.min():g} mm")
    return _places_of(_Sites(receptors, points, np.broadcast_to(depths, len(points))))


class _Sites:
    """Sites on a mesh, equal to those of another response if both have the same numbers."""

    # Presses of one object at several depths or stiffnesses have equal meshes.

    def __init__(self, receptors: Receptors, points: FloatArray, depths: FloatArray | None = None):
        self.receptors, self.points, self.depths, mesh = receptors, points, depths, receptors.mesh
        parts = [mesh.nodes_mm, mesh.elements, mesh.living_epidermis, mesh.symmetry_nodes, points]
        parts += [] if depths is None else [mesh.layer, depths]
        content = hashlib.blake2b(repr((mesh.full, [part.shape for part in parts])).encode())
        for part in parts:
            content.update(np.ascontiguousarray(part).tobytes())
        self._digest = content.digest()

    def __hash__(self) -> int:
        return hash(self._digest)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Sites) and self._digest == other._digest


@lru_cache(maxsize=_PLACES_KEPT)
def _places_of(sites: _Sites) -> Sequence[Part]:
    """Find the end organs, which takes longer than to read their values."""
    receptors, points = sites.receptors, sites.points
    if sites.depths is not None:
        return receptors.at(points, sites.depths)
    return [Part(receptors.mesh.living_epidermis.ravel(), slice(None), receptors.below(points), 1.0)]
