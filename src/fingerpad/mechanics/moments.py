"""One step in time of a press: from a solved moment to the next."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.values import FloatArray
from fingerpad.geometry.mesh import Mesh
from fingerpad.geometry.mesh_checks import element_place, squeezed_most
from fingerpad.geometry.motion import STILL, Motion
from fingerpad.mechanics.balance import (
    Entry,
    TissueEnergies,
    contact_energy,
    instantaneous_energy,
    relaxed_work,
)
from fingerpad.mechanics.configuration import SMALLEST_FORCE_MN, Balance, Body, Load, Reached
from fingerpad.mechanics.contact import Contact
from fingerpad.mechanics.fields import FieldState, Watched
from fingerpad.mechanics.friction import Anchors
from fingerpad.mechanics.linear import LinearSolver
from fingerpad.mechanics.newton import FIRST_DEPTH_MM, Equilibrium, NewtonSettings, find_equilibrium
from fingerpad.mechanics.press_settings import steps_of_advance, steps_of_slide
from fingerpad.mechanics.viscoelastic import (
    StepCoefficients,
    StressHistory,
    instantaneous_state,
    stored_energy_density,
)

MOST_CONTINUED = 4.0  # Largest factor by which the last step of the skin is extended for the next guess.
LARGEST_DROP = 0.1  # Largest share by which the force may fall in a step that drives the indenter deeper.

SAME_DIGITS = 9
"""Decimals of depths [mm], forces [mN] and lengths of steps [ms]: the same touch later has the same bits."""

AIR_TOLERANCE_MM = 1e-6
"""Overlap at first touch from which skin counts as touched; a placement has rounding errors. [mm]"""

LIFT_MM = 100.0  # How far an indenter without force is lifted while the skin below it is solved. [mm]


@dataclass(frozen=True)
class Moment:
    """The press at one time: what the next step starts from."""

    # `step_mm` and `advance` are the changes of displacements and of the prescribed course in the step that
    # ends here. `slip_mm` is how far each point has slid since it touched.

    time_ms: float
    found: Equilibrium
    step_mm: FloatArray
    advance: FloatArray
    reached: Reached
    history: StressHistory
    sed_kpa: FloatArray
    fields: FieldState
    ledger: tuple[Entry, ...]
    slip_mm: FloatArray


class TissueAfter(NamedTuple):
    """What the tissue holds after a step."""

    history: StressHistory
    sed_kpa: FloatArray
    fields: FieldState
    energies: TissueEnergies


def tissue_after(
    mesh: Mesh,
    watched: Watched,
    before: StressHistory,
    fields: FieldState,
    way_mm: tuple[FloatArray, FloatArray],
    step: StepCoefficients,
) -> TissueAfter:
    """Relax the stress over a step between two displacements, and find the energies and fields after it."""
    table, (start_mm, end_mm) = watched.table, way_mm
    now = instantaneous_state(mesh, end_mm, table)
    unspent_uj = relaxed_work(mesh, start_mm, end_mm, table, step.step_ms, before, now)
    history = before.advanced(step, mesh.layer, now.stress_kpa)
    sed_kpa = stored_energy_density(mesh, end_mm, table, history, now)
    held_uj = float(now.energies[:, :, 0].sum(axis=1) @ sed_kpa)
    energies = TissueEnergies(held_uj, instantaneous_energy(now), unspent_uj)
    return TissueAfter(history, sed_kpa, watched.after(fields, end_mm, history, now, sed_kpa), energies)


@dataclass
class Press:
    """What stays the same over all steps, and a count of the work."""

    body: Body
    contact: Contact
    stimulus: Motion
    solver: LinearSolver
    newton: NewtonSettings
    watched: Watched
    finest_mm: float = np.inf
    deepest_mm: float = np.inf
    newton_steps: int = 0

    def contact_at(self, time_ms: float) -> Contact:
        if self.stimulus.stays:
            return self.contact
        return replace(self.contact, placement=self.contact.placement.moved(self.stimulus.pose_at(time_ms)))

    def unloaded(self) -> Moment:
        mesh, table = self.body.mesh, self.body.table
        nowhere, no_force = np.zeros_like(mesh.nodes_mm), np.zeros(self.contact.stiffness.size)
        touch = self.contact.state(self.contact.points_mm(mesh.nodes_mm), 0.0, no_force)
        rest = Equilibrium(
            nowhere, 0.0, touch, no_force, 0, Balance(np.zeros(3), np.zeros(3), 0.0), self.free_skin()
        )
        history = StressHistory.unloaded(len(mesh.elements), table.shares.shape[1])
        unstrained = FieldState.unloaded(len(mesh.nodes_mm), len(self.watched.elements))
        return Moment(
            0.0, rest, nowhere, np.zeros(5), Reached(), history, np.zeros(len(mesh.elements)),
            unstrained, (Entry(),), no_force,
        )  # fmt: skip

    def in_the_air(self, times_ms: FloatArray) -> Iterator[Moment]:
        """Yield moments until skin is touched, in which nothing is solved because nothing happens."""
        moment = self.unloaded()
        skin_mm = self.contact.points_mm(self.body.mesh.nodes_mm)
        for time_ms in times_ms.tolist():
            depth_mm = 0.0
            if not self.stimulus.by_force and time_ms < self.stimulus.onset_ms:
                depth_mm = float(self.stimulus.prescribed_at(time_ms))
            touch = self.contact.state(skin_mm, depth_mm, np.zeros(self.contact.stiffness.size))
            if touch.gap_mm.min() < -AIR_TOLERANCE_MM:
                return
            entry = Entry(time_ms=time_ms, way=(depth_mm, 0.0, 0.0, 0.0, 0.0))
            found = replace(moment.found, depth_mm=depth_mm, contact=touch)
            moment = replace(moment, time_ms=time_ms, found=found, ledger=(*moment.ledger, entry))
            yield moment

    def free_skin(self) -> Anchors | None:
        """Skin that does not yet hold on to the indenter, if there is friction."""
        if self.contact.friction == 0.0:
            return None
        return self.contact.free_anchors(self.contact.points_mm(self.body.mesh.nodes_mm))

    def step(self, start: Moment, target_ms: float, persistent: bool = False) -> Moment:
        """Solve one step; `start` stays as it is, so a step that fails or is too long can be repeated."""
        load = self.load(start, target_ms)
        guess = start.found.displacement_mm + self.continued(start, target_ms) * start.step_mm
        newton = replace(self.newton, persistent=True) if persistent else self.newton
        before = start.found.multipliers_mn, newton, start.found.displacement_mm
        found = find_equilibrium(self.body, load, self.solver, guess, *before)
        self.check_depth(target_ms, found.depth_mm)
        self.check_that_it_holds(start, found)
        if self.stimulus.by_force and load.force_mn is None:
            found = replace(found, depth_mm=self.touching_mm(load.contact, found.displacement_mm))
        self.newton_steps += found.iterations
        way_mm = start.found.displacement_mm, found.displacement_mm
        history, sed_kpa, fields, energies = tissue_after(
            self.body.mesh, self.watched, start.history, start.fields, way_mm, load.step
        )
        moved_mm = found.displacement_mm - start.found.displacement_mm
        slip = np.zeros_like(start.slip_mm)
        if found.slid_mm is not None:
            slip = np.where(found.contact.pressed_mn > 0.0, start.slip_mm + found.slid_mm, 0.0)
        ledger = (*start.ledger, self.entry(start, target_ms, load.contact, found, energies))
        force_mn = float(np.linalg.norm(found.contact.force_mn.sum(axis=0)))
        return Moment(
            target_ms, found, moved_mm, self.advance(start, target_ms),
            start.reached.after(force_mn, found.depth_mm), history, sed_kpa, fields, ledger, slip,
        )  # fmt: skip

    def last_resort(self, start: Moment, target_ms: float) -> Moment:
        """Solve a step as `step` does, through states in which the tangent is indefinite."""
        return self.step(start, target_ms, persistent=True)

    def check_depth(self, time_ms: float, depth_mm: float) -> None:
        """Refuse a force as soon as it has pushed the indenter too deep."""
        # It is that at the place of first touch; aside the finger may be thicker.
        is_there = self.stimulus.pose_at(time_ms) == STILL
        if depth_mm > self.deepest_mm and self.stimulus.by_force and is_there:
            raise InputError(
                "force_mn",
                f"must not push the indenter deeper than {self.deepest_mm:.2f} mm",
                remedy=f"it is there after {time_ms:.4g} ms, at {self.stimulus.prescribed_at(time_ms):.4g} "
                f"of {self.stimulus.largest:g} mN; give less force, in mN",
            )

    def check_that_it_holds(self, start: Moment, found: Equilibrium) -> None:
        """Refuse a step after which no force, or with a shifted tangent less, drives the indenter deeper."""
        # Skin may lie beside or behind the indenter then. A shift leads through an unstable state.
        deeper = found.depth_mm > start.found.depth_mm
        forces_mn = [each.contact.force_mn.sum(axis=0) for each in (start.found, found)]
        # Skin beside the indenter may press on its sides.
        along_mn = [float(force_mn @ self.contact.placement.axis) for force_mn in forces_mn]
        whole_mn = [float(np.linalg.norm(force_mn)) for force_mn in forces_mn]
        is_lost = along_mn[1] <= SMALLEST_FORCE_MN < along_mn[0]
        drops = found.was_shifted and whole_mn[1] < (1.0 - LARGEST_DROP) * whole_mn[0]
        if self.stimulus.stays and deeper and (is_lost or drops):
            before_mn, after_mn = along_mn if is_lost else whole_mn
            raise ConvergenceError(
                f"The skin slips past the indenter: its force falls from {before_mn:.3g} to {after_mn:.3g} "
                "mN as it advances."
            )

    def touching_mm(self, contact: Contact, displacement_mm: FloatArray) -> float:
        """Depth at which the indenter just touches the deformed skin. [mm]"""
        skin_mm = (self.body.mesh.nodes_mm + displacement_mm)[contact.nodes]
        local_mm = contact.placement.to_local(skin_mm, depth_mm=0.0)
        return float((local_mm[:, 1] - contact.indenter.front(local_mm)).min())

    def advance(self, start: Moment, target_ms: float) -> FloatArray:
        """Change of the prescribed course in a step, as in `Motion.course_at`."""
        return self.stimulus.course_at(target_ms) - self.stimulus.course_at(start.time_ms)

    def parts(self, begin_ms: float, end_ms: float) -> int:
        """Return the number of equal steps between two times, none of them longer than allowed."""
        before, after = self.stimulus.pose_at(begin_ms), self.stimulus.pose_at(end_ms)
        aside_mm = float(np.hypot(after.x_mm - before.x_mm, after.z_mm - before.z_mm))
        slide, sticks = 1, self.contact.friction > 0.0
        if aside_mm > 0.0 and self.is_sharp:
            slide = steps_of_slide(aside_mm, self.contact.indenter, self.finest_mm, sticks)
        if self.stimulus.by_force:
            return slide
        before_mm, after_mm = self.stimulus.prescribed_at([begin_ms, end_ms])
        return max(slide, steps_of_advance(abs(after_mm - before_mm), self.finest_mm))

    def moves(self, start: Moment, target_ms: float) -> bool:
        """Whether the indenter goes aside or turns in a step."""
        return self.stimulus.pose_at(target_ms) != self.stimulus.pose_at(start.time_ms)

    def continued(self, start: Moment, target_ms: float) -> float:
        """Advance of the indenter in a step over that in the step before."""
        # It is 0 in a hold and negative after a reversal; of another direction only the part along the old
        # one counts. The last state is the better guess for a given force, which does not tell the depth, and
        # for skin that an edge passes without friction, which falls back: bar with friction at 300 mN, 133
        # Newton steps, now 107; half balls that move by 1 mm, 235 and 198.
        before = float(start.advance @ start.advance)
        falls_back = self.is_sharp and self.contact.friction == 0.0 and self.moves(start, target_ms)
        if before == 0.0 or self.stimulus.by_force or falls_back:
            return 0.0
        further = float(self.advance(start, target_ms) @ start.advance)
        return round(float(np.clip(further / before, -MOST_CONTINUED, MOST_CONTINUED)), SAME_DIGITS)

    def entry(
        self, start: Moment, target_ms: float, contact: Contact, found: Equilibrium, tissue: TissueEnergies
    ) -> Entry:
        """Energies of the whole body at the end of a step, from those of the body as it is meshed."""
        parts = 2.0 if self.body.mesh.symmetry_nodes.size else 1.0
        last, before, now = start.ledger[-1], start.found.contact, found.contact
        relaxes = self.body.table.shares.any()
        lost_uj = parts * (tissue.instantaneous_uj - tissue.stored_uj) if relaxes else 0.0
        spent_uj = lost_uj - last.lost_uj + parts * (found.rubbed_uj - tissue.relaxed_work_uj)
        squeezed = contact_energy(before.gap_mm, before.pressed_mn, now.gap_mm, now.pressed_mn)
        pose = self.stimulus.pose_at(target_ms)
        skin_mm = contact.points_mm(self.body.mesh.nodes_mm + found.displacement_mm)
        force = contact.placement.generalised_force(now.force_mn, skin_mm, found.depth_mm)
        return Entry(
            time_ms=target_ms,
            way=(found.depth_mm, pose.x_mm, pose.z_mm, *np.deg2rad([pose.tilt_deg, pose.spin_deg])),
            force=tuple(parts * force),
            stored_uj=parts * tissue.stored_uj,
            dissipated_uj=last.dissipated_uj + spent_uj,
            contact_uj=last.contact_uj + parts * squeezed,
            lost_uj=lost_uj,
        )

    def load(self, start: Moment, target_ms: float) -> Load:
        """Indenter at the end of a step: at its depth, or with its force on the body as it is meshed."""
        step = StepCoefficients.of(self.body.table, length_ms(start.time_ms, target_ms))
        carried = start.history.carried(step, self.body.mesh.layer)
        force_mn, prescribed = None, round(float(self.stimulus.prescribed_at(target_ms)), SAME_DIGITS)
        if not self.stimulus.by_force:
            depth_mm = prescribed
        elif prescribed == 0.0:
            depth_mm = start.found.depth_mm - LIFT_MM
        else:
            force_mn = prescribed / (2.0 if self.body.mesh.symmetry_nodes.size else 1.0)
            # The first node to touch may lie in the indenter by round-off.
            touches = start.found.contact.pressed_mn.sum() > SMALLEST_FORCE_MN
            depth_mm = start.found.depth_mm + (0.0 if touches else FIRST_DEPTH_MM)
        return Load(
            self.contact_at(target_ms), depth_mm, step, carried, force_mn, start.found.anchors,
            start.found.pressure_kpa, start.reached, start.found.contact.pressed_mn > 0.0,
            self.moves(start, target_ms),
        )  # fmt: skip

    def stopped(self, last: Moment, attempts: tuple[str, ...], cause: str) -> ConvergenceError:
        """Error for a press that gets no further than `last`: cause, place and time, and a remedy."""
        less = "force" if self.stimulus.by_force else "depth"
        element, ratio = squeezed_most(self.body.mesh, last.found.displacement_mm)
        place = f"{element_place(self.body.mesh, element)} has {ratio:.0%} of its volume at a point"
        aim = f"{self.stimulus.largest:g} {'mN' if self.stimulus.by_force else 'mm'}"
        if last.time_ms == 0.0:
            remedy = f"try a smaller {less} or more ramp steps, and check the moduli of the tissues, in kPa"
        elif self.contact.indenter.grips:
            remedy = (
                "the skin below a wire cannot slide and is cut by its edges: "
                f"try a thin Cylinder with friction=0.5, or a smaller {less}"
            )
        elif self.contact.friction == 0.0 and self.is_sharp:
            remedy = (
                "without friction skin slides round a small body or an edge: "
                f"try friction=0.5, a larger fillet or a smaller {less}"
            )
        else:
            remedy = f"try a smaller {less} or more ramp steps"
        return ConvergenceError(
            f"The press stopped at {last.time_ms:.4g} ms, depth {last.found.depth_mm:.4g} mm, on the way to "
            f"{aim}{f', where {place}' if last.time_ms > 0.0 else ''}: {cause.rstrip('.')}; {remedy}.",
            attempts,
        )

    @property
    def is_sharp(self) -> bool:
        """Whether the indenter is small or has an edge, round which skin slides."""
        return np.isfinite(self.finest_mm)


def length_ms(start_ms: float, end_ms: float) -> float:
    return round(end_ms - start_ms, SAME_DIGITS)
