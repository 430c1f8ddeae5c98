"""Press an indenter into a body by ramp and hold, and keep what the later stages need."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fingerpad.checks import FloatArray, whole
from fingerpad.errors import ConvergenceError, InputError
from fingerpad.indenters import Indenter
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.contact import Contact, Placement
from fingerpad.mechanics.linear import NO_NODES, LinearSolver, free_degrees_of_freedom, preconditioner
from fingerpad.mechanics.materials import Material, MaterialTable
from fingerpad.mechanics.newton import (
    FIRST_DEPTH_MM,
    Body,
    Equilibrium,
    Load,
    NewtonSettings,
    find_equilibrium,
)
from fingerpad.mechanics.viscoelastic import (
    StepCoefficients,
    StressHistory,
    instantaneous_state,
    stored_energy_density,
)
from fingerpad.mesh import Mesh
from fingerpad.stimulus import ForceRampAndHold, Stimulus

SMALLEST_CUT = 1.0 / 32


@dataclass(frozen=True)
class PressSettings:
    """Steps in time and tolerances of a press.

    Parameters
    ----------
    ramp_steps, hold_steps : int
        Steps in the two phases.
    newton : NewtonSettings
        Tolerances of each step.
    """

    ramp_steps: int = 8
    hold_steps: int = 8
    newton: NewtonSettings = field(default_factory=NewtonSettings)

    def __post_init__(self) -> None:
        whole("ramp_steps", self.ramp_steps, at_least=1)
        whole("hold_steps", self.hold_steps, at_least=1)


@dataclass(frozen=True)
class Deformation:
    """What a press did to a body.

    Parameters
    ----------
    times_ms : array (n_times,)
        From 0, the unloaded state. [ms]
    force_mn : array (n_times,)
        Force of the indenter along its axis; that of the whole body also when half of it is solved. [mN]
    displacement_mm : array (n_times, n_nodes, 3)
        Displacements. [mm]
    sed_kpa : array (n_times, n_elements)
        Stored strain energy density, element mean. [kPa]
    depth_mm : array (n_times,)
        How far the indenter has advanced since first touch. [mm]
    reaction_mn : array (n_times, 3)
        Force of the body on bone and nail, of the whole body also when half of it is solved. [mN]
    force_imbalance : float
        Largest difference at any time between the indenter's force and the reaction of the supports, over
        that force.
    penetration_mm : float
        Deepest penetration at any time. [mm]
    newton_steps, factorisations : int
        Work done.
    """

    times_ms: FloatArray
    force_mn: FloatArray
    displacement_mm: FloatArray
    sed_kpa: FloatArray
    depth_mm: FloatArray
    reaction_mn: FloatArray
    force_imbalance: float
    penetration_mm: float
    newton_steps: int
    factorisations: int


@dataclass
class _March:
    """State carried from step to step."""

    time_ms: float
    depth_mm: float
    depth_rate: float
    displacement: FloatArray
    velocity: FloatArray
    multipliers: FloatArray
    history: StressHistory
    newton_steps: int = 0


def press(
    mesh: Mesh,
    materials: tuple[Material, ...],
    indenter: Indenter,
    placement: Placement,
    stimulus: Stimulus,
    settings: PressSettings | None = None,
    deepest_mm: float = np.inf,
) -> Deformation:
    """Solve a whole ramp and hold.

    Parameters
    ----------
    mesh : Mesh
        The body; its bone and nail nodes stay where they are.
    materials : tuple of Material
        One per layer of the mesh.
    indenter : Indenter
        The rigid body.
    placement : Placement
        Where it stands at first touch.
    stimulus : RampAndHold or ForceRampAndHold
        Its motion.
    settings : PressSettings, optional
        Steps and tolerances.
    deepest_mm : float
        Depth that a force must not exceed. [mm]

    Returns
    -------
    Deformation
        Only of a press in which every step converged.

    Raises
    ------
    InputError
        If a force pushes the indenter deeper than `deepest_mm`.
    ConvergenceError
        If a step fails even when it is cut; the history tells each attempt.
    """
    settings = settings or PressSettings()
    table = MaterialTable.of(materials)
    undeformed = placement.to_local(mesh.nodes_mm[mesh.skin_nodes], depth_mm=0.0)
    candidates = indenter.may_touch(undeformed) & ~np.isin(mesh.skin_nodes, mesh.fixed_nodes)
    contact = Contact(indenter, placement, mesh.skin_nodes[candidates], mesh.skin_area_mm2[candidates])
    gripped = contact.nodes if indenter.grips else NO_NODES
    free = free_degrees_of_freedom(len(mesh.nodes_mm), mesh.fixed_nodes, mesh.symmetry_nodes, gripped)
    sparsity = Sparsity.of(mesh.elements, len(mesh.nodes_mm))
    body = Body(mesh, table, sparsity, free)
    solver = LinearSolver(sparsity, free, preconditioner(sparsity, free, mesh.nodes_mm))

    times = stimulus.times_ms(settings.ramp_steps, settings.hold_steps)
    march = _March(
        0.0,
        0.0,
        0.0,
        np.zeros_like(mesh.nodes_mm),
        np.zeros_like(mesh.nodes_mm),
        np.zeros(contact.nodes.size),
        StressHistory.unloaded(len(mesh.elements), table.shares.shape[1]),
    )
    whole_body = 2.0 if mesh.symmetry_nodes.size else 1.0
    # Across the plane of symmetry the reactions of the two halves cancel.
    both_halves = np.array([2.0, 2.0, 0.0]) if mesh.symmetry_nodes.size else np.ones(3)
    displacement = np.zeros((times.size, *mesh.nodes_mm.shape))
    force, sed = np.zeros(times.size), np.zeros((times.size, len(mesh.elements)))
    depth, reaction, imbalance, deepest = np.zeros(times.size), np.zeros((times.size, 3)), 0.0, 0.0
    for n in range(1, times.size):
        found, sed[n] = _advance(body, contact, stimulus, solver, march, times[n], settings)
        if found.depth_mm > deepest_mm and isinstance(stimulus, ForceRampAndHold):
            raise InputError(
                f"force_mn must not push the indenter deeper than {deepest_mm:.2f} mm: it is there after "
                f"{times[n]:.4g} ms, at {stimulus.force_at(times[n]):.4g} of {stimulus.force_mn:g} mN."
            )
        displacement[n], depth[n] = found.displacement_mm, found.depth_mm
        force[n] = whole_body * found.contact.force_mn.sum(axis=0) @ placement.axis
        reaction[n] = both_halves * found.balance.reaction_mn
        imbalance = max(imbalance, found.balance.imbalance)
        deepest = max(deepest, found.contact.penetration_mm)
    return Deformation(
        times_ms=times,
        force_mn=force,
        displacement_mm=displacement,
        sed_kpa=sed,
        depth_mm=depth,
        reaction_mn=reaction,
        force_imbalance=imbalance,
        penetration_mm=deepest,
        newton_steps=march.newton_steps,
        factorisations=solver.renewals,
    )


def _advance(
    body: Body,
    contact: Contact,
    stimulus: Stimulus,
    solver: LinearSolver,
    march: _March,
    until_ms: float,
    settings: PressSettings,
) -> tuple[Equilibrium, FloatArray]:
    """Go on to `until_ms`, in one step if it converges, else in halves, quarters ... of it."""
    whole_step = until_ms - march.time_ms
    share, attempts = 1.0, []
    while True:
        step_ms = min(share * whole_step, until_ms - march.time_ms)
        last = march.time_ms + step_ms >= until_ms - 1e-9 * whole_step
        target = until_ms if last else march.time_ms + step_ms
        try:
            found, sed = _one_step(body, contact, stimulus, solver, march, target, settings)
        except ConvergenceError as error:
            attempts.append(
                f"step from {march.time_ms:.4g} to {target:.4g} ms: {error.args[0]} "
                f"Last: {error.history[-1] if error.history else 'no iteration'}."
            )
            share /= 2
            if share < SMALLEST_CUT:
                less = "force" if isinstance(stimulus, ForceRampAndHold) else "depth"
                raise ConvergenceError(
                    f"The press stopped at {march.time_ms:.4g} ms, depth {march.depth_mm:.4g} mm: "
                    f"try a smaller {less}, a finer mesh or more ramp steps.",
                    tuple(attempts),
                ) from error
            continue
        if last:
            return found, sed


def _one_step(
    body: Body,
    contact: Contact,
    stimulus: Stimulus,
    solver: LinearSolver,
    march: _March,
    target_ms: float,
    settings: PressSettings,
) -> tuple[Equilibrium, FloatArray]:
    """Solve one step and move `march` to its end."""
    mesh = body.mesh
    step_ms = target_ms - march.time_ms
    load = _load(body, contact, stimulus, march, target_ms)
    # Motion goes on as before inside a phase; at the end of the ramp it stops, and so does the guess.
    ramps = target_ms <= stimulus.ramp_ms
    guess = march.displacement + (step_ms * march.velocity if ramps else 0.0)
    found = find_equilibrium(body, load, solver, guess, march.multipliers, settings.newton)
    instantaneous, energies, volumetric = instantaneous_state(
        mesh.nodes_mm, mesh.elements, found.displacement_mm, mesh.layer, body.table
    )
    march.history = march.history.advanced(load.step, mesh.layer, instantaneous)
    march.velocity = (found.displacement_mm - march.displacement) / step_ms
    march.displacement, march.multipliers = found.displacement_mm, found.multipliers_mn
    march.depth_rate = (found.depth_mm - march.depth_mm) / step_ms
    march.depth_mm = found.depth_mm
    march.time_ms = target_ms
    march.newton_steps += found.iterations
    sed = stored_energy_density(
        mesh.nodes_mm, mesh.elements, found.displacement_mm, mesh.layer, body.table,
        march.history, energies, volumetric,
    )  # fmt: skip
    return found, sed


def _load(body: Body, contact: Contact, stimulus: Stimulus, march: _March, target_ms: float) -> Load:
    """Indenter at the end of a step: at its depth, or with its force on the body as it is meshed."""
    step_ms = target_ms - march.time_ms
    step = StepCoefficients.of(body.table, step_ms)
    carried = march.history.carried(step, body.mesh.layer)
    if isinstance(stimulus, ForceRampAndHold):
        parts = 2.0 if body.mesh.symmetry_nodes.size else 1.0
        force_mn = float(stimulus.force_at(target_ms)) / parts
        ramps = target_ms <= stimulus.ramp_ms
        depth_mm = march.depth_mm + (step_ms * march.depth_rate if ramps else 0.0)
        return Load(contact, depth_mm or FIRST_DEPTH_MM, step, carried, force_mn)
    return Load(contact, float(stimulus.depth_at(target_ms)), step, carried)
