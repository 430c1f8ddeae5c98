"""Contact of skin with a rigid indenter: penalty with augmented multipliers, frictionless or not.

Contact is found at points: nodes of the skin, and about small bodies middles of its facets and edges. A point
that penetrates by -g is pushed out along the indenter's normal n with

    lambda = <lambda_k - epsilon A g>,   f = lambda n,   potential = lambda² / (2 epsilon A),

A being the point's tributary area in the undeformed skin, lambda_k its multiplier from earlier augmentations
and <> the positive part (Laursen & Simo 1993). The exact stiffness is epsilon A n n' - lambda dn/dx. Its
second part, the curvature of the indenter, makes the tangent indefinite while points still penetrate deeply,
so it is taken along only near the solution, where it keeps Newton's method quadratic. Friction adds a
potential of its own (`fingerpad.mechanics.friction`).

Skin is stretched under a small ball and at a rim, where its nodes end up further apart than the body is wide.
If contact acted at nodes alone, a facet between them could cut through the body, and each node that leaves it
would release energy: skin would seem to slide off. So the middles of facets and of their edges are pushed out
of the body too. A middle may lie within the body by the sag of a chord that is as long as the radius, which
facets that follow a round body have by themselves.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.units import cosine_and_sine
from fingerpad.core.values import FloatArray, IntArray, NotNegative
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import Mesh
from fingerpad.geometry.motion import STILL, Pose
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.friction import Anchors, Approach, Friction, dragged, friction

N_CORNERS = 4


@dataclass(frozen=True)
class Middles:
    """Middles of facets of the skin and of the edges of facets."""

    corners: IntArray
    """Nodes whose mean a middle is: those of a facet, or both ends of an edge twice, (n, 4)."""
    blocks: IntArray  # Block of the tangent of each pair of these nodes, (n, 4, 4).
    area_mm2: FloatArray  # Undeformed area that belongs to each middle, (n,). [mm²]
    sag_mm: float  # How deep a middle lies within the indenter before it is pushed out. [mm]

    @classmethod
    def none(cls) -> Middles:
        shape = (0, N_CORNERS)
        return cls(np.empty(shape, np.int64), np.empty((*shape, N_CORNERS), np.int64), np.empty(0), 0.0)

    @classmethod
    def of(cls, mesh: Mesh, sparsity: Sparsity, nodes: IntArray, sag_mm: float) -> Middles:
        """Middles of all facets, and of their edges, whose corners are among `nodes`."""
        facets = mesh.skin_faces[np.isin(mesh.skin_faces, nodes).all(axis=1)]
        first, second, third, fourth = np.moveaxis(mesh.nodes_mm[facets], 1, 0)
        area_mm2 = 0.5 * np.linalg.norm(np.cross(third - first, fourth - second), axis=1)
        ends = np.stack([facets, np.roll(facets, -1, axis=1)], axis=-1).reshape(-1, 2)
        edges, edge = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
        edge_mm2 = 0.5 * np.bincount(edge.ravel(), np.repeat(area_mm2, N_CORNERS), len(edges))
        is_edge = edges[:, 0] != edges[:, 1]  # a triangle repeats a corner
        corners = np.concatenate([facets, np.tile(edges[is_edge], 2)])
        blocks = sparsity.blocks_of(corners[:, :, None], corners[:, None, :])
        return cls(corners, blocks, np.concatenate([area_mm2, edge_mm2[is_edge]]), sag_mm)

    def add_to_nodes(self, at_nodes: FloatArray, at_middles: FloatArray) -> None:
        """Add a quarter of each value (n, ...) to each corner's value (n_nodes, ...)."""
        np.add.at(at_nodes, self.corners, at_middles[:, None] / N_CORNERS)

    def add_to_tangent(self, tangent: np.ndarray, stiffness: FloatArray) -> None:
        """Add stiffnesses (n, 3, 3) to the blocks (n_blocks, 3, 3) of all pairs of corners."""
        stiff = np.flatnonzero(stiffness.any(axis=(1, 2)))
        share = (stiffness[stiff] / N_CORNERS**2).astype(tangent.dtype)
        np.add.at(tangent, self.blocks[stiff], share[:, None, None])


PENALTY_KPA_PER_MM = 15_000.0
"""Contact stiffness per area; skin pressures of 10-100 kPa then penetrate by a few microns. [kPa/mm]"""

CURVATURE_STEP_MM = 1e-5
"""Step of the differences behind the indenter's curvature; small beside any fillet. [mm]"""


@dataclass(frozen=True)
class Placement:
    """Where an indenter stands and which way it presses."""

    origin_mm: FloatArray  # Position of the indenter's tip at first touch, (3,). [mm]
    rotation: FloatArray  # Columns are the indenter's x, y and z axes in the finger's frame, (3, 3).
    pressing: FloatArray | None = None
    """Unit direction of pressing; by default the indenter's y axis, as it is until it tilts, (3,)."""

    @property
    def axis(self) -> FloatArray:
        """Unit direction of pressing, (3,)."""
        return self.rotation[:, 1] if self.pressing is None else self.pressing

    def tip_mm(self, depth_mm: float) -> FloatArray:
        """Position of the tip of the indenter that has advanced by `depth_mm`, (3,). [mm]"""
        return self.origin_mm + depth_mm * self.axis

    def to_local(self, points_mm: FloatArray, depth_mm: float) -> FloatArray:
        return (points_mm - self.origin_mm - depth_mm * self.axis) @ self.rotation

    def moved(self, pose: Pose) -> Placement:
        """Where the indenter of this first touch stands in a later pose."""
        if pose == STILL:
            return self
        tilt, spin = rotation_of(pose.tilt_deg, 0.0), rotation_of(0.0, pose.spin_deg)
        origin_mm = self.origin_mm + np.array([pose.x_mm, 0.0, pose.z_mm])
        return Placement(origin_mm, tilt @ self.rotation @ spin, self.axis)

    def generalised_force(self, force_mn: FloatArray, points_mm: FloatArray, depth_mm: float) -> FloatArray:
        """Return the forces that do work on the advance, the ways along x and z, the tilt and the spin."""
        force = force_mn.sum(axis=0)
        torque = np.cross(points_mm - self.tip_mm(depth_mm), force_mn).sum(axis=0)
        # A positive tilt turns about the finger's z axis, a positive spin about the indenter's -y axis.
        return np.array([force @ self.axis, force[0], force[2], torque[2], -(torque @ self.rotation[:, 1])])


@dataclass(frozen=True)
class PlacedIndenter:
    """What presses: an indenter, where it stands, and how it touches."""

    body: Indenter
    placement: Placement  # At first touch.
    friction: float = 0.0  # Coulomb's coefficient between skin and indenter.
    finest_mm: float = np.inf  # Size of the elements below a small body or an edge, see `contact_about`. [mm]
    deepest_mm: float = np.inf  # How deep a force may push it. [mm]


def rotation_of(tilt_deg: float, spin_deg: float) -> FloatArray:
    """Axes of an indenter tilted about z and then turned about its own y, as columns."""
    cosine, sine = np.cos(np.deg2rad(tilt_deg)), np.sin(np.deg2rad(tilt_deg))
    tilt = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    along, towards = cosine_and_sine(spin_deg)
    return tilt @ np.array([[along, 0.0, -towards], [0.0, 1.0, 0.0], [towards, 0.0, along]])


def place(indenter: Indenter, skin_mm: FloatArray, at_mm: FloatArray, rotation: FloatArray) -> Placement:
    """Advance an indenter along its axis through `at_mm` until it first touches the undeformed skin."""
    local = Placement(at_mm, rotation).to_local(skin_mm, 0.0)
    advance = float((local[:, 1] - indenter.front(local)).min())
    if not np.isfinite(advance):
        raise InputError(
            f"{type(indenter).__name__} at x = {at_mm[0]:g}, z = {at_mm[2]:g} mm never touches a node of the "
            "skin: place it over the finger, or refine the mesh under a thin indenter."
        )
    return Placement(at_mm + advance * rotation[:, 1], rotation)


@checked
def check_friction(friction: NotNegative, indenter: Indenter) -> float:
    """Return the coefficient if it is not negative, and 0 for an indenter that grips the skin anyway."""
    if friction > 0.0 and indenter.grips:
        raise InputError(
            "friction",
            f"must be 0 for {type(indenter).__name__}, under which skin does not slide along the "
            "finger at all",
            f"{friction:g}",
        )
    return float(friction)


@dataclass(frozen=True)
class ContactState:
    """Contact at one configuration."""

    gap_mm: FloatArray  # Signed gap of every point; of a middle, with the sag that it may have, (n,). [mm]
    normal: FloatArray  # Outward normal of the indenter at every point, (n, 3).
    pressed_mn: FloatArray  # lambda, the normal force on each point, (n,). [mN]
    force_mn: FloatArray  # Whole force of the indenter on each point: lambda n and friction, (n, 3). [mN]
    stiffness: FloatArray
    """epsilon A n n' in contact and that of friction, without the indenter's curvature, (n, 3, 3). [mN/mm]"""
    potential: float  # Energy of the penalty and of friction. [µJ]
    friction: Friction | None = None  # Friction in the indenter's frame, if there is any.

    @property
    def friction_mn(self) -> FloatArray:
        return self.force_mn - self.pressed_mn[:, None] * self.normal

    @property
    def penetration_mm(self) -> float:
        return float(max(0.0, -self.gap_mm.min()))

    @property
    def misfit_mm(self) -> float:
        """Largest distance from the indenter's surface of a point that penetrates or is pressed. [mm]

        A pressed point may also hover above the surface: while the skin relaxes, its multiplier is too large.
        """
        touching = (self.gap_mm < 0.0) | (self.pressed_mn > 0.0)
        return float(np.abs(self.gap_mm[touching]).max(initial=0.0))


@dataclass(frozen=True)
class Contact:
    """Skin that may touch one placed indenter."""

    indenter: Indenter
    placement: Placement  # Where it stands at first touch.
    nodes: np.ndarray  # Candidate nodes, the first of the points, (n_nodes,).
    area_mm2: FloatArray  # Their tributary areas, (n_nodes,). [mm²]
    penalty: float = PENALTY_KPA_PER_MM  # epsilon. [kPa/mm]
    friction: float = 0.0  # mu, Coulomb's coefficient.
    stick_penalty: float = PENALTY_KPA_PER_MM  # Stiffness per area of skin that sticks. [kPa/mm]
    middles: Middles = field(default_factory=Middles.none)  # The other points; none by default.

    @property
    def stiffness(self) -> FloatArray:
        """Penalty of every point, epsilon A, (n,). [mN/mm]"""
        return self.penalty * self._points_mm2

    @property
    def stick_stiffness(self) -> FloatArray:
        return self.stick_penalty * self._points_mm2

    @cached_property
    def _points_mm2(self) -> FloatArray:
        return np.concatenate([self.area_mm2, self.middles.area_mm2])

    def points_mm(self, nodes_mm: FloatArray) -> FloatArray:
        """Points, (n, 3), of a mesh whose nodes are at `nodes_mm` (n_mesh_nodes, 3). [mm]"""
        return np.concatenate([nodes_mm[self.nodes], nodes_mm[self.middles.corners].mean(axis=1)])

    def add_to_nodes(self, at_nodes: FloatArray, at_points: FloatArray) -> None:
        """Add values of the points (n, ...) to those of the nodes of the mesh (n_mesh_nodes, ...)."""
        n_nodes = self.nodes.size
        at_nodes[self.nodes] += at_points[:n_nodes]
        self.middles.add_to_nodes(at_nodes, at_points[n_nodes:])

    def on_nodes(self, at_points: FloatArray) -> FloatArray:
        """Sum values of the points (n, ...) at the candidate nodes, (n_nodes, ...)."""
        at_nodes = np.zeros((self.nodes.max() + 1, *at_points.shape[1:]))
        self.add_to_nodes(at_nodes, at_points)
        return at_nodes[self.nodes]

    def add_to_tangent(self, tangent: np.ndarray, diagonal: np.ndarray, stiffness: FloatArray) -> None:
        """Add stiffnesses of the points (n, 3, 3) to a tangent; `diagonal` as of `Sparsity`."""
        n_nodes = self.nodes.size
        tangent[diagonal[self.nodes]] += stiffness[:n_nodes]
        self.middles.add_to_tangent(tangent, stiffness[n_nodes:])

    def tangent_places(self, diagonal: IntArray) -> IntArray:
        """Blocks of the tangent to which contact adds; `diagonal` as of `Sparsity`."""
        return np.unique(np.concatenate([diagonal[self.nodes], self.middles.blocks.ravel()]))

    def gap(self, local_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gap of each point (n,) [mm] and normal (n, 3), in the indenter's frame."""
        gap, normal = self.indenter.gap(local_mm)
        n_nodes = self.nodes.size
        return np.concatenate([gap[:n_nodes], gap[n_nodes:] + self.middles.sag_mm]), normal

    def state(
        self,
        positions_mm: FloatArray,
        depth_mm: float,
        multipliers_mn: FloatArray,
        anchors: Anchors | None = None,
        before: Friction | None = None,
    ) -> ContactState:
        """Contact of the points at `positions_mm` (n, 3) with multipliers (n,), with friction if anchored."""
        local = self.placement.to_local(positions_mm, depth_mm)
        rotation = self.placement.rotation
        gap, local_normal = self.gap(local)
        normal = local_normal @ rotation.T
        pressed = np.maximum(multipliers_mn - self.stiffness * gap, 0.0)
        active = np.where(pressed > 0.0, self.stiffness, 0.0)
        state = ContactState(
            gap_mm=gap,
            normal=normal,
            pressed_mn=pressed,
            force_mn=pressed[:, None] * normal,
            stiffness=active[:, None, None] * normal[:, :, None] * normal[:, None, :],
            potential=float(0.5 * (pressed**2 / self.stiffness).sum()),
        )
        if anchors is None:
            return state
        rubbed = friction(anchors, local, self.stick_stiffness, before)
        return replace(
            state,
            force_mn=state.force_mn + rubbed.force_mn @ rotation.T,
            stiffness=state.stiffness + rotation @ rubbed.stiffness @ rotation.T,
            potential=state.potential + rubbed.potential,
            friction=rubbed,
        )

    def free_anchors(self, skin_mm: FloatArray) -> Anchors:
        """Anchors of the points at rest, `skin_mm` (n, 3), before anything touches them."""
        local_mm = self.placement.to_local(skin_mm, depth_mm=0.0)
        return Anchors.none_held(Approach.at_rest(local_mm, skin_mm, self.placement.tip_mm(0.0)))

    def renewed(self, start: Anchors, state: ContactState, depth_mm: float) -> Anchors:
        """Anchors with the normals and limits of the contact found.

        A point that was free at the start of the step is anchored where it would have met the indenter, had
        it gone on as in the step before; if it would not have met it, where it would be at the end of the
        step. Both do not depend on the search: an anchor that followed its point would let it creep at each
        renewal.
        """
        expected_mm = start.approach.expected_mm(self.placement.tip_mm(depth_mm))
        before = start.approach.local_mm
        way = self.placement.to_local(expected_mm, depth_mm) - before
        gap_before = np.maximum(self.gap(before)[0], 0.0)
        gap_after = self.gap(before + way)[0]
        met = gap_after < 0.0
        share = np.where(met, gap_before / np.where(met, gap_before - gap_after, 1.0), 1.0)
        first_touch = before + share[:, None] * way
        return replace(
            start,
            anchor_mm=np.where(start.held[:, None], start.anchor_mm, first_touch),
            normal=state.normal @ self.placement.rotation,
            limit_mn=self.friction * state.pressed_mn,
            pull_mn=start.pull_mn if state.friction is None else state.friction.pull_mn,
        )

    def carried(
        self, anchors: Anchors, state: ContactState, positions_mm: FloatArray, depth_mm: float
    ) -> Anchors:
        """Anchors with which the next step starts."""
        local = self.placement.to_local(positions_mm, depth_mm)
        after = dragged(anchors, local, self.stick_stiffness, state.pressed_mn > 0.0)
        approach = anchors.approach.after(local, positions_mm, self.placement.tip_mm(depth_mm))
        return replace(after, approach=approach)

    def curvature_stiffness(
        self, state: ContactState, positions_mm: FloatArray, depth_mm: float
    ) -> FloatArray:
        """Second part of the stiffness, -lambda dn/dx by central differences, (n, 3, 3). [mN/mm]"""
        pressed = state.pressed_mn
        touching = np.flatnonzero(pressed)
        local = self.placement.to_local(positions_mm[touching], depth_mm)
        slope = np.empty((touching.size, 3, 3))
        for axis, offset in enumerate(CURVATURE_STEP_MM * np.eye(3)):
            change = self.indenter.gap(local + offset)[1] - self.indenter.gap(local - offset)[1]
            slope[:, :, axis] = change / (2 * CURVATURE_STEP_MM)
        slope = 0.5 * (slope + slope.transpose(0, 2, 1))
        rotation = self.placement.rotation
        stiffness = np.zeros((len(pressed), 3, 3))
        stiffness[touching] = -pressed[touching, None, None] * (rotation @ slope @ rotation.T)
        return stiffness

    def closed_stiffness(self, state: ContactState, closed: np.ndarray) -> FloatArray:
        """Penalty of the `closed` points that carry no force, as if they were pressed, (n, 3, 3). [mN/mm]"""
        apart = np.where(closed & (state.pressed_mn == 0.0), self.stiffness, 0.0)
        return apart[:, None, None] * state.normal[:, :, None] * state.normal[:, None, :]

    def augmented(self, state: ContactState) -> FloatArray:
        return state.pressed_mn
