"""An indentation for other solvers: elements, sets of nodes, faces that may touch, and steps in time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fingerpad import __version__
from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Finite, FiniteVector, IntArray, TimesMs, Whole
from fingerpad.export.outline import Outline, RigidMesh, face_mesh, outline_of, rigid_mesh
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import LAYERS, Mesh
from fingerpad.geometry.size_field import half_width_mm
from fingerpad.mechanics.contact import Placement, check_friction
from fingerpad.mechanics.materials import Material
from fingerpad.skin.code_hash import code_hash
from fingerpad.skin.indentation import Touch

CONTACT_KPA_PER_MM = 50_000.0
"""Penalty of the exported contact: 50 kPa penetrate by 1 µm. Other solvers do not augment it. [kPa/mm]"""

BESIDE_INDENTER_MM = 2.0
"""How far beside the indenter, beyond its depth, the skin may still come to touch it. [mm]"""

BESIDE_FACETS_MM = 0.1
"""Extent of the facets of an indenter beyond the undeformed skin that it passes through. [mm]"""

NO_NODES: IntArray = np.empty(0, dtype=np.int64)


@dataclass(frozen=True)
class Phase:
    """Consecutive steps of equal length at constant speed."""

    start_ms: float
    end_ms: float  #: Begin and end. [ms]
    steps: int
    depth_mm: float  #: Depth at its end. [mm]


@dataclass(frozen=True)
class Support:
    """Nodes that are held."""

    name: str  #: Name of their set in a deck.
    nodes: IntArray
    axes: tuple[int, int]  #: First and last axis along which they are held, 1 for x to 3 for z.


@value_class
class Job:
    """One indentation, described for another solver."""

    mesh: Mesh  #: The body; its bone and nail are fixed.
    materials: tuple[Material, ...]  #: One per layer of the mesh.
    indenter: Indenter
    placement: Placement  #: Its position at first touch.
    times_ms: TimesMs  #: Steps, from 0, (n_times,). [ms]
    depths_mm: FiniteVector  #: How far the indenter has advanced at each, from 0, (n_times,). [mm]
    friction: Finite = 0.0  #: Coulomb's coefficient between skin and indenter.

    def __post_init__(self) -> None:
        times, depths = self.times_ms, self.depths_mm
        if times.size < 2 or times[0] != 0.0 or depths.shape != times.shape or depths[0] != 0.0:
            raise InputError(
                "times_ms and depths_mm must begin with 0 and have one length of at least 2: "
                f"got {times.size} times from {times[:1]} and {depths.size} depths from {depths[:1]}."
            )
        if depths.max() <= 0.0:
            raise InputError(
                "depths_mm", "must exceed 0 at some time", remedy=f"the largest is {depths.max():g} mm"
            )
        if len(self.materials) <= self.mesh.layer.max():
            raise InputError(
                "materials", "needs one per layer", f"{len(self.materials)} for layer {self.mesh.layer.max()}"
            )
        check_friction(self.friction, self.indenter)

    @property
    def phases(self) -> tuple[Phase, ...]:
        """Steps of equal length and speed, joined; the growing steps of the hold are single phases."""
        found: list[Phase] = []
        for n in range(1, self.times_ms.size):
            start, end = float(self.times_ms[n - 1]), float(self.times_ms[n])
            speed = (self.depths_mm[n] - self.depths_mm[n - 1]) / (end - start)
            steps = 1
            if found and self._continues(found[-1], end - start, speed):
                start, steps = found[-1].start_ms, found.pop().steps + 1
            found.append(Phase(start, end, steps, float(self.depths_mm[n])))
        return tuple(found)

    def _continues(self, phase: Phase, step_ms: float, speed: float) -> bool:
        before = float(np.interp(phase.start_ms, self.times_ms, self.depths_mm))
        length = phase.end_ms - phase.start_ms
        same_speed = np.isclose(speed * length, phase.depth_mm - before, rtol=1e-9, atol=1e-12)
        return bool(same_speed and np.isclose(step_ms * phase.steps, length, rtol=1e-9))

    @property
    def layer_names(self) -> dict[int, str]:
        """Names of the layers that have elements, fit for a set in a deck."""
        return {int(index): LAYERS[index].replace(" ", "_") for index in np.unique(self.mesh.layer)}

    @cached_property
    def wedges(self) -> IntArray:
        return wedge_nodes(self.mesh)

    @property
    def is_wedge(self) -> np.ndarray:
        """Which elements are wedges, bool (n_elements,)."""
        return self.wedges[:, 0] >= 0

    @cached_property
    def reach_mm(self) -> float:
        """A length beyond the whole body: half extent of what has no edge of its own. [mm]"""
        return float(np.ptp(self.mesh.nodes_mm, axis=0).max() + 2 * self.depths_mm.max())

    @property
    def outline(self) -> Outline | None:
        """Section of the indenter, if it has one of lines and arcs."""
        return outline_of(self.indenter, self.reach_mm)

    @cached_property
    def rigid(self) -> RigidMesh:
        """Facets of the indenter where it may touch, at first touch in the frame of the body."""
        deepest = float(self.depths_mm.max())
        skin = self.placement.to_local(self.mesh.nodes_mm[self.mesh.skin_nodes], deepest)
        # Undeformed skin reaches further up the sides of the indenter than skin that gives way.
        reached = skin[self.indenter.gap(skin)[0] < BESIDE_FACETS_MM]
        lowest = min(-2.0 * deepest, float(reached[:, 1].min(initial=0.0))) - BESIDE_FACETS_MM
        beyond = deepest + BESIDE_INDENTER_MM
        outline = self.outline
        if outline is None:
            low, high = reached.min(axis=0, initial=0.0) - 1.0, reached.max(axis=0, initial=0.0) + 1.0
            local = face_mesh(self.indenter, lowest, (low[0], high[0]), (low[2], high[2]))
        else:
            extent = float(skin[:, 2].min() - beyond), float(skin[:, 2].max() + beyond)
            local = rigid_mesh(outline, lowest, extent)
        nodes = self.placement.origin_mm + local.nodes_mm @ self.placement.rotation.T
        return RigidMesh(nodes, local.quads, local.triangles)

    @cached_property
    def touching_elements(self) -> IntArray:
        """Elements whose skin face may come to touch the indenter; all of an element that is gripped."""
        mesh = self.mesh
        top, faces = mesh.skin_elements, mesh.skin_faces
        strange = top[(np.sort(faces, axis=1) != np.sort(mesh.elements[top, 4:], axis=1)).any(axis=1)]
        if strange.size:
            raise InputError(
                f"A deck needs skin on one face of an element, and a triangle of a wedge: element "
                f"{strange[0]} has another; export vtu, csv or npz."
            )
        local = self.placement.to_local(mesh.nodes_mm[faces].reshape(-1, 3), depth_mm=0.0)
        local = local.reshape(*faces.shape, 3)
        if self.indenter.grips:
            may = self.indenter.may_touch(local.reshape(-1, 3)).reshape(faces.shape).all(axis=1)
        else:
            across = np.abs(local[..., 0])
            outline = self.outline
            if outline is not None and outline.revolved:
                across = np.hypot(local[..., 0], local[..., 2])
            beyond = half_width_mm(self.indenter) + self.depths_mm.max() + BESIDE_INDENTER_MM
            normal = np.cross(local[:, 2] - local[:, 0], local[:, 3] - local[:, 1])
            may = (across.min(axis=1) < beyond) & (normal[:, 1] < 0.0)
        may &= ~np.isin(faces, mesh.fixed_nodes).all(axis=1)
        if not may.any():
            raise InputError(f"{type(self.indenter).__name__} never touches a face of the skin: move it.")
        return top[may]

    @property
    def touching_nodes(self) -> IntArray:
        return np.setdiff1d(self.mesh.elements[self.touching_elements, 4:], self.mesh.fixed_nodes)

    @property
    def supports(self) -> tuple[Support, ...]:
        """Sets of nodes that are held: bone and nail, plane of symmetry, skin that a wire grips.

        No node is in the first two sets at once: Abaqus would refuse that as an overconstraint.
        """
        fixed, gripped = self.mesh.fixed_nodes, self.touching_nodes if self.indenter.grips else NO_NODES
        sets = (
            Support("FIXED", fixed, (1, 3)),
            Support("SYMMETRY", np.setdiff1d(self.mesh.symmetry_nodes, fixed), (3, 3)),
            Support("GRIPPED", gripped, (1, 1)),
        )
        return tuple(each for each in sets if each.nodes.size)

    def parts(self, layer: Whole) -> Iterator[tuple[bool, IntArray, IntArray]]:
        """Elements of a layer by shape: whether they are wedges, their numbers, and their nodes."""
        for wedges, nodes in ((False, self.mesh.elements), (True, self.wedges)):
            numbers = np.flatnonzero((self.is_wedge == wedges) & (self.mesh.layer == layer))
            if numbers.size:
                yield wedges, numbers, nodes[numbers]

    @property
    def summary(self) -> tuple[str, ...]:
        mesh, half = self.mesh, " of a body symmetric about z = 0 (forces are of this half)"
        return (
            f"Written by fingerpad {__version__}, mechanics {code_hash()}.",
            "Units: mm, ms, kPa, mN (1 kPa mm2 = 1 mN); energy in microjoule.",
            f"{type(self.indenter).__name__} pressed {self.depths_mm.max():g} mm deep into "
            f"{len(mesh.nodes_mm)} nodes and {len(mesh.elements)} elements"
            f"{half if mesh.symmetry_nodes.size else ''}.",
            f"{self.times_ms.size - 1} steps from 0 to {self.times_ms[-1]:g} ms.",
        )


def wedge_nodes(mesh: Mesh) -> IntArray:
    """Nodes of each wedge (n_elements, 6), lower triangle first; -1 where the element is a brick."""
    elements = mesh.elements
    wedges = np.full((len(elements), 6), -1, dtype=np.int64)
    lower, upper = elements[:, :4], elements[:, 4:]
    for corner in range(4):
        after = (corner + 1) % 4
        collapsed = (lower[:, corner] == lower[:, after]) & (upper[:, corner] == upper[:, after])
        kept = [n for n in range(4) if n != after]
        wedges[collapsed] = np.concatenate([lower[:, kept], upper[:, kept]], axis=1)[collapsed]
    is_wedge = wedges[:, 0] >= 0
    nodes = np.where(is_wedge[:, None], np.pad(wedges, ((0, 0), (0, 2)), mode="edge"), elements)
    different = (np.diff(np.sort(nodes, axis=1), axis=1) > 0).sum(axis=1) + 1
    strange = np.flatnonzero(different != np.where(is_wedge, 6, 8))
    if strange.size:
        raise InputError(
            "mesh",
            "must consist of bricks and of wedges, bricks with one collapsed side, to be exported",
            remedy=f"element {strange[0]} has the nodes {elements[strange[0]].tolist()}",
        )
    return wedges


@checked
def job_of(touch: Touch, times_ms: ArrayLike | None = None, depths_mm: ArrayLike | None = None) -> Job:
    """Describe an indentation for other solvers."""
    stimulus, settings = touch.stimulus, touch.settings
    if not stimulus.stays:
        raise InputError(
            f"{type(stimulus).__name__} moves its indenter aside or turns it, and a deck moves its indenter "
            "only along its axis: leave out x_mm, z_mm, tilt_deg and spin_deg, or export vtu, csv or npz."
        )
    if times_ms is None:
        if settings.sed_tolerance is not None:
            raise InputError(
                "A tolerance chooses the steps of this touch while it is solved: give times_ms, for example "
                "those of its response."
            )
        times_ms = settings.steps_ms(stimulus)
    if depths_mm is None:
        if stimulus.by_force:
            raise InputError(
                f"{type(stimulus).__name__} sets forces, and a deck moves its indenter: give times_ms "
                "and depths_mm, those of its response."
            )
        depths_mm = stimulus.prescribed_at(times_ms)
    return Job(
        touch.mesh,
        touch.tissues.layers,
        touch.body,
        touch.placement,
        np.asarray(times_ms, dtype=float),
        np.asarray(depths_mm, dtype=float),
        touch.friction,
    )
