"""One equilibrium: Newton's method with a line search on the incremental potential, contact included.

At a given depth d of the indenter the unknowns are the displacements u, and the potential that falls is

    Pi(u) = internal(u) + contact(u, d).

Under a given force F the depth is unknown as well. Whenever u is nearly at rest, one Newton step on

    Pi(u, d) = internal(u) + contact(u, d) - F d

moves both; then u comes to rest again at the new depth. A line search over both would crawl: every skin node
that the advancing indenter meets for the first time raises the potential.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerpad.checks import FloatArray, positive, whole
from fingerpad.errors import ConvergenceError
from fingerpad.mechanics.assembly import Sparsity, assemble
from fingerpad.mechanics.contact import Contact, ContactState
from fingerpad.mechanics.friction import Anchors, Friction, rubbing_heat
from fingerpad.mechanics.linear import LinearSolver
from fingerpad.mechanics.materials import MaterialTable
from fingerpad.mechanics.viscoelastic import StepCoefficients
from fingerpad.mesh import Mesh
from fingerpad.mesh_quality import element_place, squeezed_most

SMALLEST_FORCE_MN = 1e-6
SUFFICIENT_DECREASE = 1e-4
SHORTEST_STEP = 1.0 / 64
CURVATURE_BELOW_RESIDUAL = 0.1
REMEMBERED_POTENTIALS = 6

FORCING, FORCING_RANGE = 0.1, (1e-4, 5e-3)
"""Tolerance of a linear solve over the residual. Looser ones let stiff contact overshoot: at 0.05 a press
took three times the evaluations."""

AT_REST = 1e-2
"""Residual over contact force below which the depth is moved towards the given force."""
DEPTH_FORCING = 1e-3
"""Tolerance of the linear solve for the body's answer to the indenter's advance."""
FIRST_DEPTH_MM, MOST_ADVANCE = 0.01, 4.0
"""Where the search for the depth of a force begins, and the factor by which one step may change it. [mm]"""


@dataclass(frozen=True)
class NewtonSettings:
    """When an equilibrium counts as found.

    Parameters
    ----------
    residual_tolerance : float
        Norm of the out-of-balance nodal forces over the contact force.
    penetration_tolerance : float
        Largest distance between pressed skin and indenter, over the depth of indentation; contact is
        augmented until it is met.
    most_iterations : int
        Newton steps before the attempt is given up.
    balance_tolerance : float
        Difference between the force of the indenter and the reaction of the supports, over that force. A
        small residual does not imply it: many small nodal forces of one sign add up.
    """

    residual_tolerance: float = 1e-5
    penetration_tolerance: float = 5e-3
    most_iterations: int = 40
    balance_tolerance: float = 1e-4

    def __post_init__(self) -> None:
        positive("residual_tolerance", self.residual_tolerance)
        positive("balance_tolerance", self.balance_tolerance)
        positive("penetration_tolerance", self.penetration_tolerance)
        whole("most_iterations", self.most_iterations, at_least=1)


@dataclass(frozen=True)
class Body:
    """The discretised tissue with what its equations need.

    Parameters
    ----------
    mesh : Mesh
        Nodes, bricks and node sets.
    table : MaterialTable
        Laws, one row per layer.
    sparsity : Sparsity
        Pattern of the tangent.
    free : int array (n_free,)
        Degrees of freedom that move.
    """

    mesh: Mesh
    table: MaterialTable
    sparsity: Sparsity
    free: np.ndarray


@dataclass(frozen=True)
class Load:
    """What acts on the body in one time step.

    Parameters
    ----------
    contact : Contact
        The indenter.
    depth_mm : float
        How far it has advanced since first touch; under a given force, where its search begins. [mm]
    step : StepCoefficients
        Relaxation coefficients of the step.
    carried : array (n_elements, 8, 6)
        H, the history that the step starts from. [kPa]
    force_mn : float, optional
        Force along the indenter's axis on the body as it is meshed, half of it or whole; the depth is then
        found. [mN]
    anchors : Anchors, optional
        Where the skin holds on to the indenter at the start of the step; without friction nothing.
    """

    contact: Contact
    depth_mm: float
    step: StepCoefficients
    carried: FloatArray
    force_mn: float | None = None
    anchors: Anchors | None = None


@dataclass(frozen=True)
class Balance:
    """The force of the indenter against the reaction of everything that holds the body.

    Bone and nail hold every direction. The plane of symmetry holds z, and a strip of skin that does not slide
    is held along x by the indenter; these two count as supports in the direction that they hold.

    Parameters
    ----------
    reaction_mn : array (3,)
        Force of the body on bone and nail. [mN]
    imbalance : float
        Contact force minus the force on all supports, over the contact force along the indenter's axis.
    """

    reaction_mn: FloatArray
    imbalance: float


@dataclass(frozen=True)
class Equilibrium:
    """A converged configuration.

    Parameters
    ----------
    displacement_mm : array (n_nodes, 3)
        Displacements. [mm]
    depth_mm : float
        How far the indenter has advanced since first touch. [mm]
    contact : ContactState
        Contact there.
    multipliers_mn : array (n_candidates,)
        Contact multipliers to start the next step from. [mN]
    iterations : int
        Newton steps taken.
    balance : Balance
        Reaction of the supports.
    anchors : Anchors, optional
        Where the skin holds on to the indenter when the next step starts.
    rubbed_uj : float
        Energy that friction has turned into heat in this step. [µJ]
    """

    displacement_mm: FloatArray
    depth_mm: float
    contact: ContactState
    multipliers_mn: FloatArray
    iterations: int
    balance: Balance
    anchors: Anchors | None = None
    rubbed_uj: float = 0.0


class _Evaluation:
    """Potential, residual and tangent at one trial configuration."""

    def __init__(
        self,
        body: Body,
        load: Load,
        displacement: FloatArray,
        depth_mm: float,
        multipliers: FloatArray,
        anchors: Anchors | None,
        blocks: FloatArray,
        before: Friction | None = None,
    ):
        mesh, contact = body.mesh, load.contact
        force = np.empty_like(displacement)
        internal = assemble(
            mesh.nodes_mm, mesh.elements, displacement, mesh.layer, body.table.law, load.step.s, load.carried,
            body.sparsity.position, True, force, blocks,
        )  # fmt: skip
        self.displacement = displacement
        positions = mesh.nodes_mm[contact.nodes] + displacement[contact.nodes]
        self.depth_mm, self.positions = depth_mm, positions
        self.contact = contact.state(positions, depth_mm, multipliers, anchors, before)
        self.potential = internal + self.contact.potential
        np.negative(force, out=force)
        force[contact.nodes] += self.contact.force_mn
        self.out_of_balance = force
        self.residual = force.ravel()[body.free]
        pressed = float(np.linalg.norm(self.contact.force_mn.sum(axis=0)))
        self.relative_residual = float(np.linalg.norm(self.residual)) / max(pressed, SMALLEST_FORCE_MN)
        if np.isnan(internal):
            # Forces were left half summed, and could look balanced.
            self.relative_residual = np.inf
        self.stiffness = self.contact.stiffness
        if self.relative_residual < CURVATURE_BELOW_RESIDUAL:
            curvature = contact.curvature_stiffness(self.contact, positions, depth_mm)
            self.stiffness = self.stiffness + curvature
        blocks[body.sparsity.diagonal[contact.nodes]] += self.stiffness
        wanted = load.force_mn
        given = float(self.contact.force_mn.sum(axis=0) @ contact.placement.axis)
        self.missing_force_mn = 0.0 if wanted is None else wanted - given

    def balance(self, body: Body, load: Load) -> Balance:
        """Compare the force of the indenter with what the supports take: nothing new is assembled."""
        taken = self.out_of_balance.copy()
        taken.ravel()[body.free] = 0.0
        given = self.contact.force_mn.sum(axis=0)
        missing = float(np.linalg.norm(given - taken.sum(axis=0)))
        scale = max(float(given @ load.contact.placement.axis), SMALLEST_FORCE_MN)
        return Balance(self.out_of_balance[body.mesh.fixed_nodes].sum(axis=0), missing / scale)


def find_equilibrium(
    body: Body,
    load: Load,
    solver: LinearSolver,
    guess_mm: FloatArray,
    multipliers_mn: FloatArray,
    settings: NewtonSettings,
) -> Equilibrium:
    """Newton's method from a guess.

    Parameters
    ----------
    body : Body
        The tissue.
    load : Load
        What acts in this step.
    solver : LinearSolver
        Keeps its preconditioner from call to call.
    guess_mm : array (n_nodes, 3)
        Displacements to start from; fixed nodes must be at their place. [mm]
    multipliers_mn : array (n_candidates,)
        Contact multipliers to start from. [mN]
    settings : NewtonSettings
        When to stop.

    Raises
    ------
    ConvergenceError
        If no equilibrium is found; its history has one line per Newton step.
    """
    blocks = np.empty((body.sparsity.column.size, 3, 3))
    multipliers = multipliers_mn
    history: list[str] = []
    # Whether friction is that of the contact found: its limit lags behind while Newton's method runs.
    anchors, settled = load.anchors, load.anchors is None
    state = _Evaluation(body, load, guess_mm, load.depth_mm, multipliers, anchors, blocks)
    if np.isnan(state.potential):
        raise ConvergenceError(f"The starting guess turns {_folded(body, guess_mm)} inside out.")
    potentials = [state.potential]
    accepted_mn = settings.residual_tolerance * (load.force_mn or 0.0)
    for iteration in range(settings.most_iterations):
        balance = state.balance(body, load)
        history.append(
            f"iteration {iteration}: residual {state.relative_residual:.2e}, "
            f"imbalance {balance.imbalance:.2e}, misfit {1e3 * state.contact.misfit_mm:.3f} µm"
        )
        if abs(state.missing_force_mn) > accepted_mn and state.relative_residual <= AT_REST:
            try:
                state = _advance_indenter(body, load, solver, state, multipliers, anchors, blocks)
            except ConvergenceError as error:
                raise ConvergenceError(str(error), tuple(history)) from error
            potentials, settled = [state.potential], load.anchors is None
            continue
        balanced = balance.imbalance <= settings.balance_tolerance
        if state.relative_residual <= settings.residual_tolerance and balanced:
            close = state.contact.misfit_mm <= settings.penetration_tolerance * state.depth_mm
            if close and settled:
                return _found(load, state, multipliers, anchors, iteration, balance)
            if not close:
                multipliers = load.contact.augmented(state.contact)
            if load.anchors is not None:
                anchors = load.contact.renewed(load.anchors, state.contact, state.positions, state.depth_mm)
            depth_mm = state.depth_mm
            state = _Evaluation(body, load, state.displacement, depth_mm, multipliers, anchors, blocks)
            potentials, settled = [state.potential], True
            if close:
                continue  # only friction was renewed: the body may still be at rest
        forcing = float(np.clip(FORCING * state.relative_residual, *FORCING_RANGE))
        try:
            direction = solver.solve(blocks, state.residual, forcing)
        except ConvergenceError as error:
            raise ConvergenceError(str(error), tuple(history)) from error
        highest = max(potentials[-REMEMBERED_POTENTIALS:])
        state = _line_search(body, load, state, direction, highest, multipliers, anchors, blocks, history)
        potentials.append(state.potential)
        settled = load.anchors is None
    raise ConvergenceError(f"No equilibrium after {settings.most_iterations} Newton steps.", tuple(history))


def _found(
    load: Load,
    state: _Evaluation,
    multipliers: FloatArray,
    anchors: Anchors | None,
    iterations: int,
    balance: Balance,
) -> Equilibrium:
    """Gather the equilibrium, its anchors ready for the next step."""
    carried, heat_uj = None, 0.0
    if anchors is not None:
        carried = load.contact.carried(anchors, state.contact, state.positions, state.depth_mm)
        heat_uj = rubbing_heat(load.anchors or anchors, anchors, carried)
    return Equilibrium(
        displacement_mm=state.displacement,
        depth_mm=state.depth_mm,
        contact=state.contact,
        multipliers_mn=multipliers,
        iterations=iterations,
        balance=balance,
        anchors=carried,
        rubbed_uj=heat_uj,
    )


def _advance_indenter(
    body: Body,
    load: Load,
    solver: LinearSolver,
    start: _Evaluation,
    multipliers: FloatArray,
    anchors: Anchors | None,
    blocks: FloatArray,
) -> _Evaluation:
    """Newton step of displacements and depth together, towards the given force.

    With r the residuals and K, b, c the second derivatives of the potential by uu, ud and dd, the exact step
    lies in the plane of (x, 0) and t = (-y, 1), where K x = r_u and K y = b. The step along t minimises the
    quadratic model after x, however loosely x and y are solved. The usual c - b'y for the stiffness along t
    would not do: contact is so stiff that the two nearly cancel.
    """
    axis = load.contact.placement.axis
    coupling = np.zeros_like(start.displacement)
    coupling[load.contact.nodes] = -start.stiffness @ axis
    b = coupling.ravel()[body.free]
    c = float(axis @ start.stiffness.sum(axis=0) @ axis)
    x = solver.solve(blocks, start.residual, FORCING_RANGE[1])
    y = solver.solve(blocks, b, DEPTH_FORCING)

    def tangent_times(direction: FloatArray) -> FloatArray:
        full = np.zeros(start.displacement.size)
        full[body.free] = direction
        return (body.sparsity.matrix(blocks) @ full)[body.free]

    slope = (start.missing_force_mn - b @ x) - y @ (start.residual - tangent_times(x))
    stiffness = y @ tangent_times(y) - 2.0 * (b @ y) + c
    if not stiffness > 0.0:
        raise ConvergenceError("The indenter meets no resistance.")
    # More and more skin resists an indenter that advances: a tangent from a light touch leads far too deep.
    shallowest, deepest = start.depth_mm / MOST_ADVANCE, start.depth_mm * MOST_ADVANCE
    advance = float(np.clip(start.depth_mm + slope / stiffness, shallowest, deepest)) - start.depth_mm
    length = 1.0
    while length >= SHORTEST_STEP:
        displacement = start.displacement.copy()
        displacement.ravel()[body.free] += length * (x - advance * y)
        depth_mm = start.depth_mm + length * advance
        before = start.contact.friction
        trial = _Evaluation(body, load, displacement, depth_mm, multipliers, anchors, blocks, before)
        if not np.isnan(trial.potential):
            return trial
        length /= 2
    raise ConvergenceError("No step of the indenter towards the force leaves the elements whole.")


def _line_search(
    body: Body,
    load: Load,
    start: _Evaluation,
    direction: FloatArray,
    highest: float,
    multipliers: FloatArray,
    anchors: Anchors | None,
    blocks: FloatArray,
    history: list[str],
) -> _Evaluation:
    """Go along `direction`, halving until the potential falls below the highest remembered one.

    Nodes that come into contact raise the potential for a step or two before the next steps push them
    out again; a memory of some steps lets them (Grippo, Lampariello & Lucidi 1986).
    """
    slope = -float(direction @ start.residual)
    length = 1.0
    while length >= SHORTEST_STEP:
        displacement = start.displacement.copy()
        displacement.ravel()[body.free] += length * direction
        before, depth_mm = start.contact.friction, start.depth_mm
        trial = _Evaluation(body, load, displacement, depth_mm, multipliers, anchors, blocks, before)
        falls = trial.potential <= highest + SUFFICIENT_DECREASE * length * slope
        # Near the solution the fall of the potential drowns in round-off and the residual decides.
        if falls or trial.relative_residual < 0.9 * start.relative_residual:
            return trial
        length /= 2
    folds = f": it turns {_folded(body, displacement)} inside out" if np.isnan(trial.potential) else ""
    raise ConvergenceError(f"The line search found no better configuration{folds}.", tuple(history))


def _folded(body: Body, displacement: FloatArray) -> str:
    """Name the element that a displacement turns inside out, the worst of them."""
    return element_place(body.mesh, squeezed_most(body.mesh, displacement)[0])
