"""One trial configuration: potential, out-of-balance forces and tangent of a body below an indenter.

The incremental potential of a step is that of the tissue, in which the history of relaxation is fixed, and
that of the contact, in which the multipliers are, and with friction the anchors.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fingerpad.core.values import FloatArray, IntArray
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.assembly import Sparsity, assemble
from fingerpad.mechanics.contact import Contact, ContactState
from fingerpad.mechanics.friction import Anchors, Friction
from fingerpad.mechanics.materials import MaterialTable
from fingerpad.mechanics.mixed import Pressures, exchange_pressure
from fingerpad.mechanics.viscoelastic import StepCoefficients

SMALLEST_FORCE_MN = 1e-6  # Below it residuals are no longer taken relative to the force of contact. [mN]

LEAST_SHARE_OF_FORCE = 1e-3
"""Least force that residuals are compared to, over the largest force of the press so far."""

LEAST_DEPTH_MM = 0.02
"""Depth that a penetration is compared to under an indenter that presses at a depth of 0 or less, since it
has turned or moved aside. [mm]"""

CURVATURE_BELOW_RESIDUAL = 0.1
"""Residual over contact force below which the indenter's curvature is part of the tangent."""


@dataclass(frozen=True)
class Body:
    """The discretised tissue with what its equations need."""

    mesh: Mesh  # Nodes, bricks and node sets.
    table: MaterialTable
    sparsity: Sparsity
    free: np.ndarray  # Degrees of freedom that move, (n_free,).
    is_mixed: bool = False  # Whether Newton's method treats pressure as an unknown of its own (see `mixed`).


@dataclass(frozen=True)
class Reached:
    """Largest force and depth of a press so far.

    Force and depth fall to 0 when the indenter is withdrawn. Tolerances relative to them would then ask for
    more than round-off allows, so these are the least that a tolerance refers to.
    """

    force_mn: float = 0.0  # Largest contact force on the body as it is meshed. [mN]
    depth_mm: float = 0.0

    @property
    def least_force_mn(self) -> float:
        """Smallest force that residuals are compared to. [mN]"""
        return LEAST_SHARE_OF_FORCE * self.force_mn

    def after(self, force_mn: float, depth_mm: float) -> Reached:
        """Return the largest of both after one more step."""
        presses_above_0 = force_mn > SMALLEST_FORCE_MN and depth_mm <= 0.0
        depth_mm = LEAST_DEPTH_MM if presses_above_0 else depth_mm
        return Reached(max(self.force_mn, force_mn), max(self.depth_mm, depth_mm))

    def deepest_mm(self, depth_mm: float) -> float:
        """Depth to which a penetration at `depth_mm` is compared. [mm]"""
        deepest_mm = max(self.depth_mm, depth_mm)
        return deepest_mm if deepest_mm > 0.0 else LEAST_DEPTH_MM


@dataclass(frozen=True)
class Load:
    """What acts on the body in one time step."""

    contact: Contact
    depth_mm: float
    """How far it has advanced since first touch; under a given force, where its search begins. [mm]"""
    step: StepCoefficients  # Relaxation coefficients of the step.
    carried: FloatArray  # H, the history that the step starts from, (n_elements, 8, 6). [kPa]
    force_mn: float | None = None
    """Force along the indenter's axis on the body as it is meshed; the depth is then found. [mN]"""
    anchors: Anchors | None = None
    """Where the skin holds on to the indenter at the start of the step; without friction nothing."""
    pressure_kpa: FloatArray | None = None
    """Pressures at the start of the step, for a mixed method, (n_elements,). [kPa]"""
    reached: Reached = Reached()  # Largest force and depth before the step.
    pressed_before: np.ndarray | None = None  # Points that were pressed before the step, (n_points,).
    moves_aside: bool = False  # Whether the indenter moves other than along its axis in this step.

    def force_scale_mn(self, force_mn: float) -> float:
        """Force to which a force that is out of balance is compared. [mN]"""
        return max(force_mn, self.reached.least_force_mn, SMALLEST_FORCE_MN)


@dataclass(frozen=True)
class Balance:
    """The force of the indenter against the reaction of everything that holds the body.

    Bone and nail hold every direction. The plane of symmetry holds z, and a strip of skin that does not slide
    is held along x by the indenter; these two count as supports in the direction that they hold.
    """

    reaction_mn: FloatArray  # Force of the body on bone and nail, (3,). [mN]
    nail_mn: FloatArray  # Its part on the nail, (3,). [mN]
    imbalance: float
    """Contact force minus the force on all supports, over the contact force along the indenter's axis."""


@dataclass(frozen=True)
class Lagging:
    """What lags behind Newton's method and is renewed between its runs."""

    multipliers_mn: FloatArray  # Normal contact forces of earlier augmentations, (n_points,). [mN]
    anchors: Anchors | None = None
    """Where the skin holds on to the indenter, and how strongly; without friction nothing."""


@dataclass(frozen=True)
class Configuration:
    """A trial configuration; its tangent is in the blocks that `evaluate` was given."""

    displacement_mm: FloatArray
    depth_mm: float  # How far the indenter has advanced. [mm]
    positions_mm: FloatArray  # Where the points are that may touch, (n_points, 3). [mm]
    contact: ContactState
    contact_stiffness: FloatArray  # Its part of the tangent, (n_points, 3, 3). [mN/mm]
    potential_uj: float  # Incremental potential, NaN if an element is turned inside out. [µJ]
    out_of_balance_mn: FloatArray
    """Contact forces minus internal forces; on held nodes, what supports take, (n_nodes, 3). [mN]"""
    residual_mn: FloatArray  # The same of the free degrees of freedom, (n_free,). [mN]
    residual_norm_mn: float  # Norm of the residual, infinite if an element is turned inside out. [mN]
    relative_residual: float  # This norm over the contact force.
    has_tangent: bool
    is_curved: bool  # Whether the indenter's curvature is part of it.
    pressures: Pressures | None = None  # Of the elements, for a mixed method.

    @property
    def whole(self) -> bool:
        """Whether no element is turned inside out."""
        return not np.isnan(self.potential_uj)

    def balance(self, body: Body, load: Load) -> Balance:
        """Compare the force of the indenter with what the supports take: nothing new is assembled."""
        taken = self.out_of_balance_mn.copy()
        taken.ravel()[body.free] = 0.0
        given = self.contact.force_mn.sum(axis=0)
        missing = float(np.linalg.norm(given - taken.sum(axis=0)))
        scale = load.force_scale_mn(float(given @ load.contact.placement.axis))
        reaction, nail = (
            self.out_of_balance_mn[nodes].sum(axis=0)
            for nodes in (body.mesh.fixed_nodes, body.mesh.nail_nodes)
        )
        return Balance(reaction, nail, missing / scale)

    def missing_force_mn(self, load: Load) -> float:
        """Force that the indenter still lacks, 0 at a given depth. [mN]"""
        if load.force_mn is None:
            return 0.0
        return load.force_mn - float(self.contact.force_mn.sum(axis=0) @ load.contact.placement.axis)


@dataclass
class Equations:
    """Potential, out-of-balance forces and tangent in one time step; tissue is assembled once per place."""

    body: Body
    load: Load
    blocks: np.ndarray  # Room for the tangent, (n_blocks, 3, 3). [mN/mm]
    _places: IntArray = field(init=False)  # Blocks to which contact adds.
    _force_of: FloatArray | None = field(default=None, init=False)
    _force_mn: FloatArray = field(init=False)
    _internal_uj: float = field(init=False)
    """Displacements at which the tissue was assembled last, its forces and its energy."""
    _tangent_of: FloatArray | None = field(default=None, init=False)
    _below_contact: np.ndarray = field(init=False)
    """Displacements of which the tangent of the tissue is in `blocks`, and its part where contact acts."""

    def __post_init__(self) -> None:
        self._places = self.load.contact.tangent_places(self.body.sparsity.diagonal)

    def at(
        self,
        displacement_mm: FloatArray,
        depth_mm: float,
        lagging: Lagging,
        with_tangent: bool = True,
        before: Friction | None = None,
        pressure_kpa: FloatArray | None = None,
        curved: bool = True,
        closed: bool = False,
    ) -> Configuration:
        """Evaluate one configuration."""
        body, load, contact = self.body, self.load, self.load.contact
        internal, tissue_mn = self._tissue(displacement_mm, with_tangent)
        pressures = None
        if body.is_mixed and not np.isnan(internal):
            pressures = Pressures.of(body.mesh, displacement_mm, body.table.law)
            if pressure_kpa is not None and with_tangent:
                change = pressure_kpa - pressures.pressure_kpa
                exchange_pressure(body.mesh, displacement_mm, change, body.sparsity, self.blocks)
                self.forget_tangent()
        positions = contact.points_mm(body.mesh.nodes_mm + displacement_mm)
        touch = contact.state(positions, depth_mm, lagging.multipliers_mn, lagging.anchors, before)
        force = -tissue_mn
        contact.add_to_nodes(force, touch.force_mn)
        residual = force.ravel()[body.free]
        pressed = float(np.linalg.norm(touch.force_mn.sum(axis=0)))
        # Of a folded element forces were left half summed, and could look balanced.
        residual_norm_mn = np.inf if np.isnan(internal) else float(np.linalg.norm(residual))
        relative_residual = residual_norm_mn / load.force_scale_mn(pressed)
        stiffness = touch.stiffness
        is_curved = curved and relative_residual < CURVATURE_BELOW_RESIDUAL
        if is_curved:
            stiffness = stiffness + contact.curvature_stiffness(touch, positions, depth_mm)
        if closed and load.pressed_before is not None:
            stiffness = stiffness + contact.closed_stiffness(touch, load.pressed_before)
        if with_tangent:
            contact.add_to_tangent(self.blocks, body.sparsity.diagonal, stiffness)
        return Configuration(
            displacement_mm=displacement_mm,
            depth_mm=depth_mm,
            positions_mm=positions,
            contact=touch,
            contact_stiffness=stiffness,
            potential_uj=internal + touch.potential,
            out_of_balance_mn=force,
            residual_mn=residual,
            residual_norm_mn=residual_norm_mn,
            relative_residual=relative_residual,
            has_tangent=with_tangent,
            is_curved=is_curved,
            pressures=pressures,
        )

    def forget_tangent(self) -> None:
        """Assemble anew when a tangent is asked for next: `blocks` hold more than tissue and contact."""
        self._tangent_of = None

    def _tissue(self, displacement_mm: FloatArray, with_tangent: bool) -> tuple[float, FloatArray]:
        """Energy and forces of the tissue, and its tangent in `blocks`; nothing is assembled twice."""
        body, load = self.body, self.load
        kept = not with_tangent or self._tangent_of is displacement_mm
        if self._force_of is not displacement_mm or not kept:
            self._force_of, self._force_mn = displacement_mm, np.empty_like(displacement_mm)
            blocks = self.blocks if with_tangent else self.blocks[:0]
            self._internal_uj = assemble(
                body.mesh, displacement_mm, body.table.law, load.step.s, load.carried, body.sparsity,
                with_tangent, self._force_mn, blocks,
            )  # fmt: skip
            if with_tangent:
                self._tangent_of, self._below_contact = displacement_mm, self.blocks[self._places]
        elif with_tangent:
            self.blocks[self._places] = self._below_contact
        return self._internal_uj, self._force_mn
