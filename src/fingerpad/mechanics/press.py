"""Press an indenter into a body by ramp and hold, and keep what the later stages need."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.progress import share_done
from fingerpad.core.values import FloatArray
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import Mesh
from fingerpad.geometry.mesh_checks import check_mesh, element_place, squeezed_most
from fingerpad.geometry.motion import STILL, Motion
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.balance import (
    EnergyBalance,
    Entry,
    TissueEnergies,
    contact_energy,
    energy_balance,
    instantaneous_energy,
    relaxed_work,
)
from fingerpad.mechanics.configuration import SMALLEST_FORCE_MN, Balance, Body, Load, Reached
from fingerpad.mechanics.contact import Contact, Placement, check_friction
from fingerpad.mechanics.fields import (
    ElementFields,
    FieldState,
    SkinContact,
    Watched,
    cauchy_stress,
    fields_over_time,
    skin_contact,
)
from fingerpad.mechanics.friction import Anchors
from fingerpad.mechanics.linear import NO_NODES, LinearSolver, choose_preconditioner, free_degrees_of_freedom
from fingerpad.mechanics.materials import Material, MaterialTable
from fingerpad.mechanics.mixed import MIXED_POISSON
from fingerpad.mechanics.newton import FIRST_DEPTH_MM, Equilibrium, NewtonSettings, find_equilibrium
from fingerpad.mechanics.press_settings import (
    MOST_SOLVED,
    SAME_TIME,
    PressSettings,
    contact_about,
    steps_of_advance,
    steps_of_slide,
)
from fingerpad.mechanics.steps import Phase, adaptive_steps, steps_at
from fingerpad.mechanics.viscoelastic import (
    StepCoefficients,
    StressHistory,
    instantaneous_state,
    stored_energy_density,
)

LOGGER = logging.getLogger(__name__)

MOST_CONTINUED = 4.0  # Largest factor by which the last step of the skin is extended for the next guess.
LARGEST_DROP = 0.1  # Largest share by which the force may fall in a step that drives the indenter deeper.

SAME_DIGITS = 9
"""Decimals of depths [mm], forces [mN] and lengths of steps [ms]: the same touch later has the same bits."""

AIR_TOLERANCE_MM = 1e-6
"""Overlap at first touch from which skin counts as touched; a placement has rounding errors. [mm]"""

LIFT_MM = 100.0  # How far an indenter without force is lifted while the skin below it is solved. [mm]


@dataclass(frozen=True)
class Deformation:
    """What a press did to a body."""

    times_ms: FloatArray  # From 0, the unloaded state, (n_times,). [ms]
    force_mn: FloatArray
    """Force of the indenter along its axis on the whole body, also if half is solved, (n_times,). [mN]"""
    displacement_mm: FloatArray  # Displacements, (n_times, n_nodes, 3). [mm]
    sed_kpa: FloatArray  # Stored strain energy density, element mean, (n_times, n_elements). [kPa]
    depth_mm: FloatArray  # How far the indenter has advanced since first touch, (n_times,). [mm]
    contact_force_mn: FloatArray
    """Whole force of the indenter on the skin, with friction, of the whole body also when half of it is
    solved, (n_times, 3). [mN]"""
    reaction_mn: FloatArray
    """Force on bone and nail of the whole body, also if half of it is solved, (n_times, 3). [mN]"""
    nail_reaction_mn: FloatArray  # Its part on the nail, (n_times, 3). [mN]
    force_imbalance: float
    """Largest difference of the indenter's force to the reaction of the supports, over that force."""
    stress_kpa: FloatArray
    """Cauchy stress of all elements at the last time, as in `ElementFields`, (n_elements, 6). [kPa]"""
    fields: ElementFields  # Stress, strain and energies over time of the elements that were watched.
    contact: SkinContact  # Pressure on the skin and area of contact over time.
    energy: EnergyBalance  # Where the work of the indenter went.
    penetration_mm: float  # Deepest penetration at any time. [mm]
    newton_steps: int
    factorisations: int
    linear_solver: str  # Which one was chosen, and why.


@dataclass(frozen=True)
class _Moment:
    """The press at one time: what the next step starts from."""

    # `step_mm`, `step_depth_mm` and `advance` are the changes of displacements, of depth and of the
    # prescribed course in the step that ends here. `slip_mm` is how far each point has slid since it touched.

    time_ms: float
    found: Equilibrium
    step_mm: FloatArray
    step_depth_mm: float
    advance: FloatArray
    reached: Reached
    history: StressHistory
    sed_kpa: FloatArray
    fields: FieldState
    ledger: tuple[Entry, ...]
    slip_mm: FloatArray


@dataclass
class _Press:
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

    def unloaded(self) -> _Moment:
        mesh, table = self.body.mesh, self.body.table
        nowhere, no_force = np.zeros_like(mesh.nodes_mm), np.zeros(self.contact.stiffness.size)
        touch = self.contact.state(self.contact.points_mm(mesh.nodes_mm), 0.0, no_force)
        rest = Equilibrium(
            nowhere, 0.0, touch, no_force, 0, Balance(np.zeros(3), np.zeros(3), 0.0), self.free_skin()
        )
        history = StressHistory.unloaded(len(mesh.elements), table.shares.shape[1])
        unstrained = FieldState.unloaded(len(mesh.nodes_mm), len(self.watched.elements))
        return _Moment(
            0.0, rest, nowhere, 0.0, np.zeros(5), Reached(), history, np.zeros(len(mesh.elements)),
            unstrained, (Entry(),), no_force,
        )  # fmt: skip

    def in_the_air(self, times_ms: FloatArray) -> Iterator[_Moment]:
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

    def step(self, start: _Moment, target_ms: float, persistent: bool = False) -> _Moment:
        """Solve one step; `start` stays as it is, so a step that fails or is too long can be repeated."""
        mesh, table = self.body.mesh, self.body.table
        step_ms = length_ms(start.time_ms, target_ms)
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
        where = mesh, found.displacement_mm, table
        now = instantaneous_state(*where)
        unspent = relaxed_work(
            mesh, start.found.displacement_mm, found.displacement_mm, table, step_ms, start.history, now
        )
        history = start.history.advanced(load.step, mesh.layer, now.stress_kpa)
        sed_kpa = stored_energy_density(*where, history, now)
        moved_mm = found.displacement_mm - start.found.displacement_mm
        depth_mm = found.depth_mm - start.found.depth_mm
        fields = self.watched.after(start.fields, found.displacement_mm, history, now, sed_kpa)
        energies = TissueEnergies(
            float(now.energies[:, :, 0].sum(axis=1) @ sed_kpa), instantaneous_energy(now), unspent
        )
        slip = np.zeros_like(start.slip_mm)
        if found.slid_mm is not None:
            slip = np.where(found.contact.pressed_mn > 0.0, start.slip_mm + found.slid_mm, 0.0)
        ledger = (*start.ledger, self.entry(start, target_ms, load.contact, found, energies))
        force_mn = float(np.linalg.norm(found.contact.force_mn.sum(axis=0)))
        return _Moment(
            target_ms, found, moved_mm, depth_mm, self.advance(start, target_ms),
            start.reached.after(force_mn, found.depth_mm), history, sed_kpa, fields, ledger, slip,
        )  # fmt: skip

    def last_resort(self, start: _Moment, target_ms: float) -> _Moment:
        """Solve a step as `step` does, through states in which the tangent is indefinite."""
        return self.step(start, target_ms, persistent=True)

    def check_depth(self, time_ms: float, depth_mm: float) -> None:
        """Refuse a force as soon as it has pushed the indenter too deep."""
        if depth_mm > self.deepest_mm and self.stimulus.by_force and self.stimulus.stays:
            raise InputError(
                "force_mn",
                f"must not push the indenter deeper than {self.deepest_mm:.2f} mm",
                remedy=f"it is there after {time_ms:.4g} ms, at {self.stimulus.prescribed_at(time_ms):.4g} "
                f"of {self.stimulus.largest:g} mN; give less force, in mN",
            )

    def check_that_it_holds(self, start: _Moment, found: Equilibrium) -> None:
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

    def advance(self, start: _Moment, target_ms: float) -> FloatArray:
        """Change of the prescribed course in a step, as in `Motion.course_at`."""
        return self.stimulus.course_at(target_ms) - self.stimulus.course_at(start.time_ms)

    def parts(self, begin_ms: float, end_ms: float) -> int:
        """Return the number of equal steps between two times, none of them longer than allowed."""
        before, after = self.stimulus.pose_at(begin_ms), self.stimulus.pose_at(end_ms)
        aside_mm = float(np.hypot(after.x_mm - before.x_mm, after.z_mm - before.z_mm))
        slide = steps_of_slide(aside_mm, self.contact.indenter) if aside_mm > 0.0 and self.is_sharp else 1
        if self.stimulus.by_force:
            return slide
        before_mm, after_mm = self.stimulus.prescribed_at([begin_ms, end_ms])
        return max(slide, steps_of_advance(abs(after_mm - before_mm), self.finest_mm))

    def continued(self, start: _Moment, target_ms: float) -> float:
        """Advance of the indenter in a step over that in the step before."""
        # It is 0 in a hold and negative after a reversal; of another direction only the part along the old
        # one counts.
        before = float(start.advance @ start.advance)
        if before == 0.0:
            return 0.0
        further = float(self.advance(start, target_ms) @ start.advance)
        return round(float(np.clip(further / before, -MOST_CONTINUED, MOST_CONTINUED)), SAME_DIGITS)

    def entry(
        self, start: _Moment, target_ms: float, contact: Contact, found: Equilibrium, tissue: TissueEnergies
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

    def load(self, start: _Moment, target_ms: float) -> Load:
        """Indenter at the end of a step: at its depth, or with its force on the body as it is meshed."""
        step_ms = length_ms(start.time_ms, target_ms)
        step = StepCoefficients.of(self.body.table, step_ms)
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
            further_mm = self.continued(start, target_ms) * start.step_depth_mm
            depth_mm = start.found.depth_mm + (further_mm if touches else FIRST_DEPTH_MM)
        return Load(
            self.contact_at(target_ms), depth_mm, step, carried, force_mn, start.found.anchors,
            start.found.pressure_kpa, start.reached, start.found.contact.pressed_mn > 0.0,
            self.stimulus.pose_at(target_ms) != self.stimulus.pose_at(start.time_ms),
        )  # fmt: skip

    def stopped(self, last: _Moment, attempts: tuple[str, ...], cause: str) -> ConvergenceError:
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


def press(
    mesh: Mesh,
    materials: tuple[Material, ...],
    indenter: Indenter,
    placement: Placement,
    stimulus: Motion,
    settings: PressSettings | None = None,
    deepest_mm: float = np.inf,
    watched: np.ndarray | None = None,
    friction: float = 0.0,
    finest_mm: float = np.inf,
) -> Deformation:
    settings = settings or PressSettings()
    check_mesh(mesh, len(materials))
    _check_bone(mesh, indenter, placement, stimulus)
    table = MaterialTable.of(materials)
    undeformed = placement.to_local(mesh.nodes_mm[mesh.skin_nodes], depth_mm=0.0)
    candidates = indenter.may_touch(undeformed) & ~np.isin(mesh.skin_nodes, mesh.fixed_nodes)
    nodes, area_mm2 = mesh.skin_nodes[candidates], mesh.skin_area_mm2[candidates]
    sparsity = Sparsity.of(mesh.elements, len(mesh.nodes_mm))
    contact = Contact(indenter, placement, nodes, area_mm2, friction=check_friction(friction, indenter))
    if np.isfinite(finest_mm):
        contact = contact_about(contact, mesh, sparsity, finest_mm)
    gripped = nodes if indenter.grips else NO_NODES
    free = free_degrees_of_freedom(len(mesh.nodes_mm), mesh.fixed_nodes, mesh.symmetry_nodes, gripped)
    poisson = max(materials[layer].poisson for layer in np.unique(mesh.layer))
    body = Body(mesh, table, sparsity, free, is_mixed=poisson > MIXED_POISSON)
    approximate, reason = choose_preconditioner(sparsity, free, mesh, poisson)
    solver = LinearSolver(approximate)

    chosen = np.arange(len(mesh.elements)) if watched is None else watched
    follow = Watched(chosen, mesh.nodes_mm, mesh.elements[chosen], mesh.layer[chosen], table)
    newton = settings.newton_about(finest_mm)
    job = _Press(body, contact, stimulus, solver, newton, follow, finest_mm, deepest_mm)
    moment = job.unloaded()
    reached, slips, values = [], [], [moment.fields.values]
    planned_ms = settings.steps_ms(stimulus)
    for moment in _moments(job, settings, planned_ms[1:]):
        share_done(float(np.searchsorted(planned_ms, moment.time_ms)) / (planned_ms.size - 1))
        LOGGER.debug(
            "%.4g of %.4g ms: depth %.4g mm, %d Newton steps so far",
            moment.time_ms, stimulus.end_ms, moment.found.depth_mm, job.newton_steps,
        )  # fmt: skip
        # Without its history, which is as large as all else together.
        reached.append((moment.time_ms, moment.found, moment.sed_kpa))
        slips.append(moment.slip_mm)
        values.append(moment.fields.values)
    times = _from_rest(time_ms for time_ms, _, _ in reached)
    found = [equilibrium for _, equilibrium, _ in reached]
    along_axis_mn = [float(each.contact.force_mn.sum(axis=0) @ placement.axis) for each in found]
    if max(along_axis_mn) <= SMALLEST_FORCE_MN:
        nearest_mm = min(float(each.contact.gap_mm.min()) for each in found)
        raise InputError(
            f"{type(indenter).__name__} meets no resistance, the nearest node of the skin is "
            f"{nearest_mm:.2g} mm away: press deeper, or take a grading with elements smaller than it, so "
            "that it does not go between nodes."
        )
    whole_body = 2.0 if mesh.symmetry_nodes.size else 1.0
    # Across the plane of symmetry the reactions of the two halves cancel.
    both_halves = np.array([2.0, 2.0, 0.0]) if mesh.symmetry_nodes.size else np.ones(3)
    displacement = _from_rest(each.displacement_mm for each in found)
    pressed, slip = np.zeros((2, times.size, mesh.skin_nodes.size))
    rubbed, gap = np.zeros((*pressed.shape, 3)), np.full_like(pressed, np.inf)
    pressed[1:, candidates] = [contact.on_nodes(each.contact.pressed_mn) for each in found]
    slip[1:, candidates] = [each[: nodes.size] for each in slips]
    if friction > 0.0:
        rubbed[1:, candidates] = [contact.on_nodes(each.contact.friction_mn) for each in found]
    gap[1:, candidates] = [each.contact.gap_mm[: nodes.size] for each in found]
    e_star_kpa = materials[mesh.layer[0]].contact_modulus_kpa
    return Deformation(
        times_ms=times,
        force_mn=whole_body * _from_rest(along_axis_mn),
        displacement_mm=displacement,
        sed_kpa=_from_rest(sed_kpa for _, _, sed_kpa in reached),
        depth_mm=_from_rest(each.depth_mm for each in found),
        contact_force_mn=_from_rest(both_halves * each.contact.force_mn.sum(axis=0) for each in found),
        reaction_mn=_from_rest(both_halves * each.balance.reaction_mn for each in found),
        nail_reaction_mn=_from_rest(both_halves * each.balance.nail_mn for each in found),
        force_imbalance=max(each.balance.imbalance for each in found),
        stress_kpa=cauchy_stress(mesh, displacement[-1], table, moment.history),
        fields=fields_over_time(chosen, values),
        contact=skin_contact(mesh, displacement, pressed, rubbed, slip, gap, e_star_kpa),
        energy=energy_balance(moment.ledger, kinks_ms=stimulus.corners_ms).at(times),
        penetration_mm=max(each.contact.penetration_mm for each in found),
        newton_steps=job.newton_steps,
        factorisations=solver.renewals,
        linear_solver=reason,
    )


def _from_rest(values: Iterable[FloatArray | float]) -> FloatArray:
    """Values over time, (n_times, ...), from the unloaded state, in which they are 0."""
    later = [np.asarray(value, dtype=np.float64) for value in values]
    return np.stack([np.zeros_like(later[0]), *later])


def _check_bone(mesh: Mesh, indenter: Indenter, placement: Placement, stimulus: Motion) -> None:
    """Bone does not move, so no mesh survives an indenter that reaches it or, under a force, starts in it."""
    bone_mm = mesh.nodes_mm[mesh.bone_nodes]
    depths = np.zeros(len(stimulus.poses)) if stimulus.by_force else stimulus.depths_mm
    for time_ms, pose, depth_mm in zip(stimulus.looks_ms, stimulus.poses, depths, strict=False):
        there = placement.moved(pose)

        def clearance_mm(depth_mm: float, there: Placement = there) -> float:
            return float(indenter.gap(there.to_local(bone_mm, depth_mm))[0].min(initial=np.inf))

        if clearance_mm(depth_mm) > 0.0:
            continue
        reaches = clearance_mm(0.0) > 0.0
        deepest_mm = brentq(clearance_mm, 0.0, depth_mm, xtol=1e-6) if reaches else 0.0
        at = "" if stimulus.stays else f" at {time_ms:.4g} ms"
        raise InputError(
            "depth_mm",
            f"must stay below {deepest_mm:.4g} mm{at}, where the {type(indenter).__name__} meets the bone",
            f"{depth_mm:g} mm",
        )


def _moments(job: _Press, settings: PressSettings, times: FloatArray) -> Iterator[_Moment]:
    """Solved times after the unloaded one, which without a bound on the error of SED are `times`."""
    start, waits_ms = job.unloaded(), times[times <= job.stimulus.onset_ms]
    if all(job.stimulus.pose_at(time_ms) == STILL for time_ms in waits_ms.tolist()):
        waits = list(job.in_the_air(waits_ms))
        if len(waits) == waits_ms.size:
            yield from waits
            start, times = (waits or [start])[-1], times[waits_ms.size :]
    yield from _solved(job, settings, times, start)


def _solved(job: _Press, settings: PressSettings, times: FloatArray, start: _Moment) -> Iterator[_Moment]:
    stimulus, mesh = job.stimulus, job.body.mesh
    receptors = mesh.living_epidermis.ravel()
    where = receptors if receptors.size else np.arange(len(mesh.elements))
    if settings.sed_tolerance is None:
        cycle_times = _cycle_times(job, settings, times)
        if settings.cycle_tolerance is not None and cycle_times.size:
            return _with_jumps(job, start, times, cycle_times, settings.cycle_tolerance, where)
        return steps_at(start, times, job.step, job.stopped, job.parts, job.last_resort)
    relaxing = job.body.table.times_ms[job.body.table.shares > 0.0]
    phases, begin_ms = [], start.time_ms
    for end_ms in settings.smooth_ends_ms(stimulus).tolist():
        if end_ms <= start.time_ms:
            continue
        before, after = stimulus.course_at(begin_ms), stimulus.course_at(end_ms)
        first_ms = times[np.searchsorted(times, begin_ms, side="right")] - begin_ms
        if (before == after).all():
            # A first step much longer than a relaxation would not see that the relaxation is curved.
            first_ms = relaxing.min(initial=first_ms)
        phases.append(Phase(end_ms, first_ms=first_ms, loading=bool(after[0] > before[0])))
        begin_ms = end_ms
    return adaptive_steps(start, phases, settings.sed_tolerance, where, job.step, job.stopped)


def _cycle_times(job: _Press, settings: PressSettings, times: FloatArray) -> FloatArray:
    """List the times of many equal cycles of which not all are solved, (n_cycles, n_steps); else (0, 0)."""
    # Skin that slides may creep from cycle to cycle, so that with friction all are solved.
    cycles = job.stimulus.cycles
    if cycles is None or settings.cycle_tolerance is None or job.contact.friction > 0.0:
        return np.empty((0, 0))
    near_ms = SAME_TIME * job.stimulus.end_ms
    inside = times[(times > cycles.start_ms + near_ms) & (times < cycles.end_ms + near_ms)]
    if cycles.count <= MOST_SOLVED or inside.size % cycles.count:
        return np.empty((0, 0))
    rows = inside.reshape(cycles.count, -1)
    since = rows - cycles.period_ms * np.arange(cycles.count)[:, None]
    # Wanted times may lie in some cycles only.
    return rows if np.ptp(since, axis=0).max() <= near_ms else np.empty((0, 0))


def _with_jumps(
    job: _Press,
    moment: _Moment,
    times: FloatArray,
    cycle_times: FloatArray,
    tolerance: float,
    where: np.ndarray,
) -> Iterator[_Moment]:
    """Solved and interpolated times of a motion with many equal cycles."""
    # Loaded when it is asked for: most presses have no cycles.
    from fingerpad.mechanics.cycles import CycleJumps

    body = job.body
    first, last = np.searchsorted(times, [cycle_times[0, 0], cycle_times[-1, -1]])
    jumps = CycleJumps(cycle_times, tolerance, where, body.table, body.mesh.layer, job.step, job.stopped)
    for before in steps_at(moment, times[:first], job.step, job.stopped):
        yield (moment := before)
    for vibrated in jumps.moments(moment):
        yield (moment := vibrated)
    yield from steps_at(moment, times[last + 1 :], job.step, job.stopped)
