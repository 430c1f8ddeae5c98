"""Frictionless contact of skin nodes with a rigid indenter: penalty with augmented multipliers.

A node that penetrates by -g is pushed out along the indenter's normal n with

    lambda = <lambda_k - epsilon A g>,   f = lambda n,   potential = lambda² / (2 epsilon A),

A being the node's tributary area in the undeformed skin, lambda_k its multiplier from earlier augmentations
and <> the positive part (Laursen & Simo 1993). The exact stiffness is epsilon A n n' - lambda dn/dx. Its
second part, the curvature of the indenter, makes the tangent indefinite while nodes still penetrate deeply,
so it is taken along only near the solution, where it keeps Newton's method quadratic.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.checks import FloatArray
from fingerpad.errors import InputError
from fingerpad.indenters import Indenter

PENALTY_KPA_PER_MM = 15_000.0
"""Contact stiffness per area; skin pressures of 10-100 kPa then penetrate by a few microns. [kPa/mm]"""

CURVATURE_STEP_MM = 1e-5
"""Step of the differences behind the indenter's curvature; small beside any fillet. [mm]"""


@dataclass(frozen=True)
class Placement:
    """Where an indenter stands and which way it presses.

    Parameters
    ----------
    origin_mm : array (3,)
        Position of the indenter's tip at first touch. [mm]
    rotation : array (3, 3)
        Columns are the indenter's x, y (direction of pressing) and z axes in the finger's frame.
    """

    origin_mm: FloatArray
    rotation: FloatArray

    @property
    def axis(self) -> FloatArray:
        """Unit direction of pressing, (3,)."""
        return self.rotation[:, 1]

    def to_local(self, points_mm: FloatArray, depth_mm: float) -> FloatArray:
        """Points (n, 3) in the frame of the indenter that has advanced by `depth_mm`. [mm]"""
        return (points_mm - self.origin_mm - depth_mm * self.axis) @ self.rotation


def place(indenter: Indenter, skin_mm: FloatArray, at_mm: FloatArray, rotation: FloatArray) -> Placement:
    """Advance an indenter along its axis through `at_mm` until it first touches the undeformed skin.

    Parameters
    ----------
    indenter : Indenter
        The rigid body.
    skin_mm : array (n, 3)
        Points of the undeformed skin. [mm]
    at_mm : array (3,)
        A point on the indenter's axis. [mm]
    rotation : array (3, 3)
        See `Placement`.

    Raises
    ------
    InputError
        If the indenter passes by the skin without touching a node of it.
    """
    local = Placement(at_mm, rotation).to_local(skin_mm, 0.0)
    advance = float((local[:, 1] - indenter.front(local)).min())
    if not np.isfinite(advance):
        raise InputError(
            f"{type(indenter).__name__} at x = {at_mm[0]:g}, z = {at_mm[2]:g} mm never touches a node of the "
            "skin: place it over the finger, or refine the mesh under a thin indenter."
        )
    return Placement(at_mm + advance * rotation[:, 1], rotation)


@dataclass(frozen=True)
class ContactState:
    """Contact at one configuration.

    Parameters
    ----------
    gap_mm : array (n,)
        Signed gap of every candidate node. [mm]
    force_mn : array (n, 3)
        Force of the indenter on each node. [mN]
    stiffness : array (n, 3, 3)
        epsilon A n n' of the nodes in contact, without the curvature of the indenter. [mN/mm]
    potential : float
        Energy of the penalty. [µJ]
    """

    gap_mm: FloatArray
    force_mn: FloatArray
    stiffness: FloatArray
    potential: float

    @property
    def penetration_mm(self) -> float:
        """Deepest penetration of any node. [mm]"""
        return float(max(0.0, -self.gap_mm.min()))

    @property
    def misfit_mm(self) -> float:
        """Largest distance from the indenter's surface of a node that penetrates or is pressed. [mm]

        A pressed node may also hover above the surface: while the skin relaxes, its multiplier is too large.
        """
        touching = (self.gap_mm < 0.0) | self.force_mn.any(axis=1)
        return float(np.abs(self.gap_mm[touching]).max(initial=0.0))


@dataclass(frozen=True)
class Contact:
    """Skin nodes that may touch one placed indenter.

    Parameters
    ----------
    indenter : Indenter
        The rigid body.
    placement : Placement
        Where it stands at first touch.
    nodes : int array (n,)
        Candidate nodes.
    area_mm2 : array (n,)
        Their tributary areas. [mm²]
    penalty : float
        epsilon. [kPa/mm]
    """

    indenter: Indenter
    placement: Placement
    nodes: np.ndarray
    area_mm2: FloatArray
    penalty: float = PENALTY_KPA_PER_MM

    def state(self, positions_mm: FloatArray, depth_mm: float, multipliers_mn: FloatArray) -> ContactState:
        """Contact of the nodes at `positions_mm` (n, 3) with multipliers (n,)."""
        gap, local_normal = self.indenter.gap(self.placement.to_local(positions_mm, depth_mm))
        normal = local_normal @ self.placement.rotation.T
        stiffness = self.penalty * self.area_mm2
        pressed = np.maximum(multipliers_mn - stiffness * gap, 0.0)
        active = np.where(pressed > 0.0, stiffness, 0.0)
        return ContactState(
            gap_mm=gap,
            force_mn=pressed[:, None] * normal,
            stiffness=active[:, None, None] * normal[:, :, None] * normal[:, None, :],
            potential=float(0.5 * (pressed**2 / stiffness).sum()),
        )

    def curvature_stiffness(
        self, state: ContactState, positions_mm: FloatArray, depth_mm: float
    ) -> FloatArray:
        """Second part of the stiffness, -lambda dn/dx by central differences, (n, 3, 3). [mN/mm]"""
        pressed = np.linalg.norm(state.force_mn, axis=1)
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

    def augmented(self, state: ContactState) -> FloatArray:
        """Multipliers after an augmentation: the pressures found. [mN]"""
        return np.linalg.norm(state.force_mn, axis=1)
