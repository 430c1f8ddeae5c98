"""Response of the skin to an indentation: surface profile, and strain energy density at the receptors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, float_array, one_of
from fingerpad.core.errors import InputError
from fingerpad.core.phases import Phase
from fingerpad.core.signals import STORED_ENERGY, SedTraces
from fingerpad.geometry.mesh import Mesh
from fingerpad.geometry.motion import STILL, Pose
from fingerpad.skin.fields import Place, sampled_fields, stored_fields
from fingerpad.skin.receptor_sheet import ReceptorSheet
from fingerpad.skin.section import Section, middle_section
from fingerpad.skin.surface_motion import SURFACE_QUANTITIES, SurfaceMotion

if TYPE_CHECKING:
    from fingerpad.mechanics.press import Deformation
    from fingerpad.skin.indentation import Touch


class Receptors(Protocol):
    """Places of end organs in a mesh, and values there."""

    def below(self, sites_mm: FloatArray) -> Any:
        """Find end organs below points of the skin, (n_sites, 3)."""
        ...

    def under(self, organs_mm: FloatArray) -> Any:
        """Find end organs by their own x and z on the volar side, (n_sites, 2)."""
        ...

    def read(self, places: Any, values: FloatArray) -> FloatArray:
        """Interpolate values of `mesh.living_epidermis`, (n_times, n_sheet), at places found."""
        ...


@dataclass(frozen=True)
class SurfaceProfile:
    """Deflection of the skin along the midline of the finger.

    Parameters
    ----------
    distance_mm : array (n_nodes,)
        Position of the undeformed skin relative to the indenter's axis, distal positive. [mm]
    deflection_mm : array (n_nodes,)
        Displacement along the direction of pressing, towards the bone positive. [mm]
    """

    distance_mm: FloatArray
    deflection_mm: FloatArray

    def at(self, distance_mm: ArrayLike) -> FloatArray:
        """Deflection at other distances, linear between nodes. [mm]"""
        return np.interp(np.asarray(distance_mm, dtype=float), self.distance_mm, self.deflection_mm)


@dataclass(frozen=True)
class SkinResponse:
    """Response of the skin to one indentation; the end of the mechanical half of the chain.

    Parameters
    ----------
    mesh : Mesh
        The undeformed body.
    kinks_ms : tuple of float
        Times at which the speed of the motion jumps: the end of the ramp. [ms]
    axis_x_mm : float
        x at which the indenter's axis meets the midline. [mm]
    direction : array (3,)
        Unit direction of pressing.
    fields : mapping of str to array
        Values of stored fields by their names in `skin.fields.FIELDS`, "times_ms" among them.
    force_imbalance : float
        Largest difference at any time between the indenter's force and the reaction of bone and nail, over
        that force.
    energy_imbalance : float
        Largest difference at any time between the indenter's work and what was stored, dissipated and held
        by the contact, over that work.
    penetration_mm : float
        Deepest penetration of the indenter by any node at any time. [mm]
    newton_steps, factorisations : int
        Numbers of Newton steps and of factorisations.
    linear_solver : str
        The linear solver, and why it was chosen.
    deformation : Deformation, optional
        All nodes and elements over time, of `Touch.solve(whole=True)`; stored files do not hold it.
    phases : tuple of Phase
        Named phases of the motion.
    pose : Pose
        How far the indenter has moved aside and turned since first touch, at the last time.
    touch : Touch, optional
        What was solved: indenter, motion, tissues.

    Raises
    ------
    InputError
        If a field is not declared as stored, has the wrong shape or holds a value that is not finite.
    """

    mesh: Mesh
    kinks_ms: tuple[float, ...]
    axis_x_mm: float
    direction: FloatArray
    fields: Mapping[str, FloatArray]
    force_imbalance: float
    energy_imbalance: float
    penetration_mm: float
    newton_steps: int
    factorisations: int
    linear_solver: str
    deformation: Deformation | None = None
    phases: tuple[Phase, ...] = ()
    pose: Pose = STILL
    touch: Touch | None = None

    def __post_init__(self) -> None:
        declared = {field.name: field for field in stored_fields()}
        for name, values in self.fields.items():
            shape = declared[one_of("field", name, tuple(declared))].shape(self.mesh, self.times_ms.size)
            if values.shape != shape:
                raise InputError(f"Field {name} must have the shape {shape}: got {values.shape}.")
            if not np.isfinite(values).all():
                raise InputError(f"Field {name} must be finite everywhere: some values are not.")

    def with_fields(self, **fields: FloatArray) -> SkinResponse:
        """Return the same response with other values of some fields."""
        return replace(self, fields={**self.fields, **fields})

    @property
    def times_ms(self) -> FloatArray:
        """Times from 0, the unloaded state, (n_times,). [ms]"""
        return self.fields["times_ms"]

    @property
    def force_mn(self) -> FloatArray:
        """Force of the indenter along its axis, on the whole finger, (n_times,). [mN]"""
        return self.fields["force_mn"]

    @property
    def depth_mm(self) -> FloatArray:
        """Advance of the indenter since first touch, (n_times,). [mm]"""
        return self.fields["depth_mm"]

    @property
    def contact_area_mm2(self) -> FloatArray:
        """Undeformed skin that the indenter touches, on the whole finger, (n_times,). [mm²]"""
        return self.fields["contact_area_mm2"]

    @property
    def contact_pressure_kpa(self) -> FloatArray:
        """Pressure of the indenter on `mesh.skin_nodes`, (n_times, n_skin_nodes). [kPa]"""
        return self.fields["contact_pressure_kpa"]

    @property
    def contact_force_mn(self) -> FloatArray:
        """Whole force of the indenter on the skin, with friction, (n_times, 3). [mN]"""
        return self.fields["contact_force_mn"]

    @property
    def shear_kpa(self) -> FloatArray:
        """Friction over the area of each of `mesh.skin_nodes`, (n_times, n_skin_nodes, 3). [kPa]"""
        return self.fields["shear_kpa"]

    @property
    def slip_mm(self) -> FloatArray:
        """How far skin in contact has slid since it came to touch, (n_times, n_skin_nodes). [mm]"""
        return self.fields["slip_mm"]

    @property
    def reaction_mn(self) -> FloatArray:
        """Force of the tissue on bone and nail, of the whole finger, (n_times, 3). [mN]"""
        return self.fields["reaction_mn"]

    @property
    def skin_displacement_mm(self) -> FloatArray:
        """Displacement of `mesh.skin_nodes`, (n_times, n_skin_nodes, 3). [mm]"""
        return self.fields["skin_displacement_mm"]

    @property
    def displacement_mm(self) -> FloatArray:
        """Displacement of all nodes at the last time, (n_nodes, 3). [mm]"""
        return self.fields["displacement_mm"]

    @property
    def sed_kpa(self) -> FloatArray:
        """Stored strain energy density, element mean, (n_times, n_elements). [kPa]"""
        return self.fields["sed_kpa"]

    @property
    def von_mises_kpa(self) -> FloatArray:
        """Equivalent stress after von Mises at the last time, (n_elements,). [kPa]"""
        return self.fields["von_mises_kpa"]

    def surface_profile(self, time_index: int = -1) -> SurfaceProfile:
        """Deflection along the midline of the volar skin (paper, section 2.2.1).

        Parameters
        ----------
        time_index : int
            Index into `times_ms`; the last by default.

        Returns
        -------
        SurfaceProfile
            One entry per node of the midline, from proximal to distal.
        """
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
    ) -> SedTraces:
        """Strain energy density in the living epidermis below points of the undeformed skin.

        End organs lie on the epidermal-dermal border and move with the tissue. A pair gives an organ's own x
        and z, a triple the point of the skin from which it lies 0.471 mm deep along the normal. The means of
        the elements just above the border (0.371 to 0.471 mm deep) are interpolated along it by a cubic
        spline, and never across it, where SED jumps.

        Parameters
        ----------
        sites : array (n_sites, 2) or (n_sites, 3)
            x and z of end organs on the volar side, or x, y and z of the skin above them on any side. [mm]
        dynamic_quantity, static_quantity : str, optional
            Quantities that drive the dynamic and the static response, names of `sample`. Default: SED, as in
            the paper.

        Returns
        -------
        SedTraces
            One column per site, with the end of the ramp as kink. [kPa]

        Raises
        ------
        InputError
            If `sites` is not an array of pairs or triples, a site is not on the skin, or the quantity is
            unknown.
        """
        static, *dynamic = self._read(dict.fromkeys((static_quantity, dynamic_quantity)), sites)
        return SedTraces(
            self.times_ms,
            static,
            np.array(self.kinks_ms),
            dynamic[0] if dynamic else None,
            dynamic_quantity,
            static_quantity,
            self.phases,
        )

    def sample(self, quantity: str, sites: ArrayLike) -> FloatArray:
        """Sample a quantity that may drive an afferent, below points of the undeformed skin.

        The interpolation is that of `sed`; the stored energy density is one of the quantities.

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

        Returns
        -------
        array (n_times, n_sites)
            Never negative.

        Raises
        ------
        InputError
            If the quantity is unknown, `sites` is not an array of pairs or triples, or a site is not on the
            skin.
        """
        return self._read([quantity], sites)[0]

    def _read(self, quantities: Iterable[str], sites: ArrayLike) -> list[FloatArray]:
        """Several quantities at the same sites, (n_times, n_sites) each."""
        known = [self._of_sheet(quantity) for quantity in quantities]
        points = float_array("sites", sites, 2)
        if points.shape[1] not in (2, 3):
            raise InputError(f"sites needs columns x and z, or x, y and z, in mm: got shape {points.shape}.")
        places = self._receptors.under(points) if points.shape[1] == 2 else self._receptors.below(points)
        # A spline may dip below zero beside a steep front; none of the quantities can.
        return [np.maximum(self._receptors.read(places, values), 0.0) for values in known]

    def _of_sheet(self, quantity: str) -> FloatArray:
        """One quantity in the elements `mesh.living_epidermis` or above them, (n_times, n_sheet)."""
        held = {name: field for name, field in sampled_fields().items() if field.name in self.fields}
        one_of("quantity", quantity, (*held, *SURFACE_QUANTITIES))
        if quantity in SURFACE_QUANTITIES:
            return self._surface.below(quantity)
        field = held[quantity]
        values = self.fields[field.name]
        return values if field.place is Place.WATCHED else values[:, self.mesh.living_epidermis.ravel()]

    @cached_property
    def _surface(self) -> SurfaceMotion:
        return SurfaceMotion(self.mesh, self.skin_displacement_mm)

    @cached_property
    def _receptors(self) -> Receptors:
        if self.mesh.is_grid:
            return ReceptorSheet(self.mesh)
        # Loaded for those who have a mesh of their own.
        free: Receptors = resolve_name("fingerpad.skin.free_receptors:FreeReceptors")(self.mesh)
        return free
