"""Press an indenter into a body by ramp and hold, and keep what the later stages need."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from fingerpad.core.errors import InputError
from fingerpad.core.progress import share_done
from fingerpad.core.values import FloatArray
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import Mesh
from fingerpad.geometry.mesh_checks import check_mesh
from fingerpad.geometry.motion import STILL, Motion
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.balance import EnergyBalance, energy_balance
from fingerpad.mechanics.configuration import SMALLEST_FORCE_MN, Body
from fingerpad.mechanics.contact import Contact, PlacedIndenter, Placement, check_friction
from fingerpad.mechanics.cycles import CycleJumps
from fingerpad.mechanics.fields import (
    ElementFields,
    SkinContact,
    Watched,
    cauchy_stress,
    fields_over_time,
    skin_contact,
)
from fingerpad.mechanics.linear import NO_NODES, LinearSolver, choose_preconditioner, free_degrees_of_freedom
from fingerpad.mechanics.materials import Material, MaterialTable
from fingerpad.mechanics.mixed import MIXED_POISSON
from fingerpad.mechanics.moments import Moment, Press
from fingerpad.mechanics.press_settings import MOST_SOLVED, SAME_TIME, PressSettings, contact_about
from fingerpad.mechanics.steps import Phase, adaptive_steps, steps_at

LOGGER = logging.getLogger(__name__)


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
class Specimen:
    """What is pressed: a mesh and its tissues."""

    mesh: Mesh
    materials: tuple[Material, ...]  # Of each layer of the mesh.
    watched: np.ndarray | None = None  # Elements whose fields are kept; all by default.


def press(
    specimen: Specimen, indenter: PlacedIndenter, stimulus: Motion, settings: PressSettings | None = None
) -> Deformation:
    settings = settings or PressSettings()
    mesh, materials, watched = specimen.mesh, specimen.materials, specimen.watched
    body, placement, friction = indenter.body, indenter.placement, indenter.friction
    check_mesh(mesh, len(materials))
    _check_bone(mesh, body, placement, stimulus)
    table = MaterialTable.of(materials)
    undeformed = placement.to_local(mesh.nodes_mm[mesh.skin_nodes], depth_mm=0.0)
    candidates = body.may_touch(undeformed) & ~np.isin(mesh.skin_nodes, mesh.fixed_nodes)
    nodes, area_mm2 = mesh.skin_nodes[candidates], mesh.skin_area_mm2[candidates]
    sparsity = Sparsity.of(mesh.elements, len(mesh.nodes_mm))
    contact = Contact(body, placement, nodes, area_mm2, friction=check_friction(friction, body))
    if np.isfinite(indenter.finest_mm):
        contact = contact_about(contact, mesh, sparsity, indenter.finest_mm, stimulus)
    gripped = nodes if body.grips else NO_NODES
    free = free_degrees_of_freedom(len(mesh.nodes_mm), mesh.fixed_nodes, mesh.symmetry_nodes, gripped)
    poisson = max(materials[layer].poisson for layer in np.unique(mesh.layer))
    discretised = Body(mesh, table, sparsity, free, is_mixed=poisson > MIXED_POISSON)
    approximate, reason = choose_preconditioner(sparsity, free, mesh, poisson)
    solver = LinearSolver(approximate)

    chosen = np.arange(len(mesh.elements)) if watched is None else watched
    follow = Watched.of(mesh, table, chosen)
    newton = settings.newton_about(indenter.finest_mm)
    limits_mm = indenter.finest_mm, indenter.deepest_mm
    job = Press(discretised, contact, stimulus, solver, newton, follow, *limits_mm)
    moment = job.unloaded()
    reached, slips, values = [], [], [moment.fields.values]
    planned_ms = settings.steps_ms(stimulus, sticks=friction > 0.0)
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
            f"{type(body).__name__} meets no resistance, the nearest node of the skin is "
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


def _moments(job: Press, settings: PressSettings, times: FloatArray) -> Iterator[Moment]:
    """Solved times after the unloaded one, which without a bound on the error of SED are `times`."""
    start, waits_ms = job.unloaded(), times[times <= job.stimulus.onset_ms]
    if all(job.stimulus.pose_at(time_ms) == STILL for time_ms in waits_ms.tolist()):
        waits = list(job.in_the_air(waits_ms))
        if len(waits) == waits_ms.size:
            yield from waits
            start, times = (waits or [start])[-1], times[waits_ms.size :]
    yield from _solved(job, settings, times, start)


def _solved(job: Press, settings: PressSettings, times: FloatArray, start: Moment) -> Iterator[Moment]:
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


def _cycle_times(job: Press, settings: PressSettings, times: FloatArray) -> FloatArray:
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
    job: Press,
    moment: Moment,
    times: FloatArray,
    cycle_times: FloatArray,
    tolerance: float,
    where: np.ndarray,
) -> Iterator[Moment]:
    """Solved and interpolated times of a motion with many equal cycles."""
    body = job.body
    first, last = np.searchsorted(times, [cycle_times[0, 0], cycle_times[-1, -1]])
    jumps = CycleJumps(cycle_times, tolerance, where, body.table, body.mesh.layer, job.step, job.stopped)
    for before in steps_at(moment, times[:first], job.step, job.stopped):
        yield (moment := before)
    for vibrated in jumps.moments(moment):
        yield (moment := vibrated)
    yield from steps_at(moment, times[last + 1 :], job.step, job.stopped)
