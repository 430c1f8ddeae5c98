"""One equilibrium: Newton's method with a line search on the incremental potential, contact included.

At a given depth d of the indenter the unknowns are the displacements u, and the potential that falls is

    Pi(u) = internal(u) + contact(u, d).

Under a given force F the depth is one unknown more, and what falls is Pi(u, d) - F d. Every step is solved
for the points that are pressed after it: otherwise each skin node that the advancing indenter touches for the
first time raises the potential, and a line search over both takes very short steps.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from fingerpad.core.checked import value_class
from fingerpad.core.errors import ConvergenceError
from fingerpad.core.values import Count, Finite, Flag, FloatArray, Positive
from fingerpad.geometry.mesh_checks import element_place, squeezed_most
from fingerpad.mechanics.configuration import Balance, Body, Configuration, Equations, Lagging, Load
from fingerpad.mechanics.contact import ContactState
from fingerpad.mechanics.friction import Anchors, by_secants, slid_mm
from fingerpad.mechanics.linear import LinearSolver, NotPositiveDefiniteError

SUFFICIENT_DECREASE = 1e-4
SHORTEST_STEP, SHORTEST_NEAR_REST = 1.0 / 64, 2.0**-15
"""Shortest share of a Newton step that is tried, and that of a persistent search near rest: the tangent at a
node that has only just left the indenter lacks its stiffness, and drives it in a thousand times too far."""

REMEMBERED_POTENTIALS = 6

FORCING, FORCING_RANGE = 0.1, (1e-4, 5e-3)
"""Tolerance of a linear solve over the residual. Looser ones let stiff contact overshoot: at 0.05 a press
took three times the evaluations."""

ENOUGH = 0.05
"""Share of the tolerance of the residual that a linear solve may leave: more would be solved for nothing."""

LAST_STEP = 5e-3
"""Residual over contact force from which one Newton step mostly ends the search. The tangent after it is
assembled only if it is needed after all."""

RENEW_AT = 0.2
"""Residual, over that right after the last renewal, at which the limits of friction are renewed. Each renewal
changes the equilibrium by about a fifth of what the last one did, so more accuracy between them is wasted."""

MOST_FREE = 0.5
"""Share of the points pressed before that a guess may set free: beyond it a Newton step drives skin into the
indenter. A slide of 2 mm takes 690 assemblies, and 874 if such steps are tried first."""

CONTACT_FORCING, MOST_CONTACT_CHANGES = 0.02, 8
"""Force, over the residual, of points on the wrong side after a Newton step with which it is taken, and most
solutions for one step, each for the points that the one before presses."""

MOST_STRAIGHT = 5
"""Newton steps of one search without the curvature of the indenter; then the tangent is shifted."""

FIRST_SHIFT, CHANGE_SHIFT = 1e-6, 10.0
"""Smallest shift of a tangent, over its diagonal, and the factor by which it rises until the tangent is
positive definite and falls after a step. The diagonal is that of single nodes; where many nodes slide
together the negative stiffness is a millionth of it, and with a shift of 1e-4 the steps were too short."""

LARGEST_SHIFTS = {True: 0.05, False: 2.0}
"""Largest shifts of a tangent with and without the curvature of the indenter."""

LONGEST_SHIFTED_STEP = 16.0  # Largest multiple of a step with a shifted tangent that is tried.

MOST_FULL_AUGMENTATIONS = 5
"""Augmentations after which multipliers change by half: nodes at a rim may alternate between two places."""

MOST_PLAIN_RENEWALS, SECANTS = 7, 3
"""Renewals of friction after which its limits and normals follow secants, and the number of these: near the
limit of jamming a plain renewal changes them by as much as the one before, or more."""

DEPTH_FORCING = 1e-4
"""Tolerance of the linear solve for the body's response to the indenter's displacement. Contact at an edge is
a thousand times as stiff as the body; at 1e-3 the body seemed twice as stiff as it is, and each step towards
a force went half of the way."""
FIRST_DEPTH_MM, MOST_ADVANCE = 0.05, 4.0
"""Where the search for the depth of a force begins, and the factor by which one step may change it. [mm]"""


@value_class
class NewtonSettings:
    """When an equilibrium counts as found."""

    residual_tolerance: Positive = 1e-5  # Norm of the out-of-balance nodal forces over the contact force.
    penetration_tolerance: Positive = 5e-3
    """Largest distance of pressed skin to the indenter, over the depth: contact is augmented until then."""
    most_iterations: Count = 40  # Newton steps before the attempt is given up.
    balance_tolerance: Positive = 1e-4
    """Difference between the force of the indenter and the reaction of the supports, over that force. A small
    residual does not imply it: many small nodal forces of one sign add up."""
    persistent: Flag = False
    """Whether the search goes on through an indefinite tangent and insists on a falling potential, as skin
    about a small body or a sharp edge needs. Elsewhere a shorter step in time is the faster remedy."""
    least_penetration_mm: Finite = 0.0
    """Penetration accepted at any depth after two augmentations: about a small body. [mm]"""


@dataclass(frozen=True)
class Equilibrium:
    """A converged configuration."""

    displacement_mm: FloatArray
    depth_mm: float  # How far the indenter has advanced since first touch. [mm]
    contact: ContactState
    multipliers_mn: FloatArray  # Contact multipliers to start the next step from, (n_points,). [mN]
    iterations: int
    balance: Balance
    anchors: Anchors | None = None  # Where the skin holds on to the indenter when the next step starts.
    slid_mm: FloatArray | None = None
    """How far each point slid over the indenter in this step, with friction, (n_points,). [mm]"""
    rubbed_uj: float = 0.0  # Energy that friction has turned into heat in this step. [µJ]
    pressure_kpa: FloatArray | None = None
    """Pressures for the next step of a mixed method, (n_elements,). [kPa]"""
    was_shifted: bool = False
    """Whether an indefinite tangent was shifted on the way: the skin may have snapped to another state."""


def find_equilibrium(
    body: Body,
    load: Load,
    solver: LinearSolver,
    guess_mm: FloatArray,
    multipliers_mn: FloatArray,
    settings: NewtonSettings,
    before_mm: FloatArray | None = None,
) -> Equilibrium:
    search = _Search(body, load, solver, Lagging(multipliers_mn, load.anchors), settings.persistent)
    try:
        return search.run(guess_mm, settings, before_mm)
    except ConvergenceError as error:
        raise ConvergenceError(error.args[0], tuple(search.history)) from None


Step = tuple[Configuration, FloatArray, float]
"""A configuration, the change of its free degrees of freedom, and the advance of the indenter. [mm]"""


@dataclass
class _Search:
    """One search for an equilibrium: what stays, what lags behind Newton's method, and how it went."""

    body: Body
    load: Load
    solver: LinearSolver
    lagging: Lagging
    persistent: bool
    equations: Equations = field(init=False)
    history: list[str] = field(default_factory=list)
    response: FloatArray | None = None  # Of the free degrees of freedom to an advance, the last one found.
    straightened: int = 0
    shift: float = 0.0
    was_shifted: bool = False
    augmentations: int = 0
    renewals: deque[tuple[Anchors, Anchors]] = field(
        default_factory=partial(deque, maxlen=MOST_PLAIN_RENEWALS + 1)
    )

    def __post_init__(self) -> None:
        blocks = np.empty((self.body.sparsity.column.size, 3, 3), self.solver.number_type)
        self.equations = Equations(self.body, self.load, blocks)

    def run(
        self, guess_mm: FloatArray, settings: NewtonSettings, before_mm: FloatArray | None
    ) -> Equilibrium:
        """Repeat Newton steps, and renew what lags behind whenever the body is at rest."""
        load, rubs = self.load, self.load.anchors is not None
        now = self.beginning(guess_mm)
        if not now.whole and before_mm is not None:
            now = self.beginning(before_mm)
        if not now.whole:
            raise ConvergenceError(f"The starting guess turns {self.folded(now.displacement_mm)} inside out.")
        potentials = [self.potential_uj(now)]
        # Whether the limits of friction are those of the contact found, and the unrest after their renewal.
        settled, renewed_at = not rubs, self.unrest(now)
        for iteration in range(settings.most_iterations):
            balance = now.balance(self.body, load)
            self.history.append(
                f"iteration {iteration}: residual {now.relative_residual:.2e}, "
                f"imbalance {balance.imbalance:.2e}, misfit {1e3 * now.contact.misfit_mm:.3f} µm"
            )
            balanced = balance.imbalance <= settings.balance_tolerance
            if self.unrest(now) <= settings.residual_tolerance and balanced:
                deepest_mm = load.reached.deepest_mm(now.depth_mm)
                accepted_mm = settings.penetration_tolerance * deepest_mm
                if self.augmentations > 1:
                    accepted_mm = max(accepted_mm, settings.least_penetration_mm)
                close = now.contact.misfit_mm <= accepted_mm
                if close and settled:
                    return self.found(now, iteration, balance)
                now = self.renew(now, augmented=not close)
                potentials, settled, renewed_at = [self.potential_uj(now)], True, self.unrest(now)
                if close:
                    continue  # only friction was renewed: the body may still be at rest
            elif rubs and not settled and self.unrest(now) < RENEW_AT * renewed_at:
                now = self.renew(now, augmented=False)
                potentials, renewed_at = [self.potential_uj(now)], self.unrest(now)
            settled = not rubs
            enough = ENOUGH * settings.residual_tolerance / self.unrest(now)
            forcing = float(np.clip(max(FORCING * self.unrest(now), enough), *FORCING_RANGE))
            now = self.better(now, forcing, potentials)
            potentials.append(self.potential_uj(now))
        raise ConvergenceError(f"No equilibrium after {settings.most_iterations} Newton steps.")

    def missing(self, now: Configuration) -> float:
        """Force that the indenter lacks, over the prescribed one; 0 at a given depth."""
        return abs(now.missing_force_mn(self.load)) / self.load.force_scale_mn(self.load.force_mn or 0.0)

    def potential_uj(self, now: Configuration) -> float:
        """Potential that falls, with that of the given force. [µJ]"""
        return now.potential_uj - (self.load.force_mn or 0.0) * now.depth_mm

    def out_of_balance_mn(self, now: Configuration) -> float:
        """Norm of what is out of balance, skin and indenter. [mN]"""
        return float(np.hypot(now.residual_norm_mn, now.missing_force_mn(self.load)))

    def unrest(self, now: Configuration) -> float:
        """Residual over contact force, or the share of the force that is missing if that is larger."""
        return max(now.relative_residual, self.missing(now))

    def beginning(self, displacement_mm: FloatArray) -> Configuration:
        where = displacement_mm, self.load.depth_mm, self.lagging
        return self.equations.at(*where, pressure_kpa=self.load.pressure_kpa)

    def with_tangent(self, now: Configuration, curved: bool | None = None) -> Configuration:
        """Return the same configuration with its tangent in `blocks`, with the body's curvature or not."""
        if now.has_tangent and curved is None:
            return now
        where = now.displacement_mm, now.depth_mm, self.lagging
        return self.equations.at(*where, curved=curved is not False)

    def better(self, now: Configuration, forcing: float, potentials: list[float]) -> Configuration:
        """Take a Newton step, and where no part of it helps, one that is solved for in another way."""
        # Skin at the brink of a snap has next to no stiffness, and the step is far too long for the quadratic
        # model behind it. A larger shift of the tangent makes it shorter and turns it downhill, as in a trust
        # region (Nocedal & Wright 2006, section 4.1).
        while True:
            try:
                moves_aside = self.load.moves_aside and self.load.force_mn is None
                if len(self.history) == 1 and moves_aside and self.is_set_free(now, MOST_FREE):
                    return self.line_search(*self.closed_step(now, forcing), potentials)
                return self.line_search(*self.step_from(now, forcing), potentials)
            except NotPositiveDefiniteError:  # even with the largest shift
                raise
            except ConvergenceError:
                if self.is_set_free(now):
                    return self.line_search(*self.closed_step(now, forcing), potentials)
                if not self.persistent:
                    raise
                self.raise_shift()

    def raise_shift(self) -> None:
        """Let the next tangent be shifted more."""
        self.shift = CHANGE_SHIFT * max(CHANGE_SHIFT * self.shift, FIRST_SHIFT)

    def step_from(self, now: Configuration, forcing: float) -> Step:
        """Solve for a Newton step; towards a force or persistently for the points in contact after it."""
        while True:
            now, direction = self.newton_direction(self.with_tangent(now), forcing)
            if not self.persistent and self.load.force_mn is None:
                return now, direction, 0.0
            try:
                return now, *self.contact_step(now, direction, forcing)
            except NotPositiveDefiniteError:
                # What is indefinite may show for one of two right-hand sides only.
                if self.persistent:
                    self.raise_shift()
                elif now.is_curved:
                    now = self.with_tangent(now, curved=False)
                else:
                    raise

    def contact_step(
        self, now: Configuration, direction: FloatArray, forcing: float
    ) -> tuple[FloatArray, float]:
        """Repeat a Newton step for the points that it presses, until they are those it was solved for."""
        # A Newton step takes the points that are pressed now as those that will be. At an edge many change
        # sides, and points that are set free in one step are driven deep into the indenter in the next. To
        # second order the potential is piecewise quadratic: its minimum, not that of one piece, is the step
        # (primal-dual active set strategy; Hintermüller, Ito & Kunisch 2002). A given force makes the depth
        # one unknown more: half balls at 600 mN took 102 Newton steps with the depth moved by itself, now 35.
        contact, touch, free = self.load.contact, now.contact, self.body.free
        assumed, along = touch.pressed_mn > 0.0, touch.normal @ contact.placement.axis
        stiffness = contact.stiffness[:, None, None] * touch.normal[:, :, None] * touch.normal[:, None]
        stiffness[assumed] += (now.contact_stiffness - touch.stiffness)[assumed]  # the curvature
        here_mn = self.lagging.multipliers_mn - contact.stiffness * touch.gap_mm
        lacking_mn = missing_mn = now.missing_force_mn(self.load)
        enough_mn = CONTACT_FORCING * max(now.residual_norm_mn, abs(lacking_mn))
        found = at_depth = direction
        residual_mn, acting = now.residual_mn, now.contact_stiffness
        best, least, advance_mm = (direction, 0.0), np.inf, 0.0
        seen: set[bytes] = set()
        while assumed.tobytes() not in seen:
            try:
                if self.load.force_mn is not None:
                    found, advance_mm = self.advanced(now, at_depth, residual_mn, missing_mn, acting)
            except ConvergenceError:
                if not seen:
                    raise
                break
            seen.add(assumed.tobytes())
            step = np.zeros_like(now.displacement_mm)
            step.ravel()[free] = found
            closing_mm = (contact.points_mm(step) * touch.normal).sum(axis=1) - advance_mm * along
            there_mn = here_mn - contact.stiffness * closing_mm
            changed = (there_mn > 0.0) != assumed
            wrong_mn = float(np.linalg.norm(there_mn[changed]))
            falls = found @ now.residual_mn + advance_mm * lacking_mn > 0.0
            if wrong_mn < least and falls:
                best, least = (found, advance_mm), wrong_mn
            if wrong_mn <= enough_mn or len(seen) > MOST_CONTACT_CHANGES:
                break
            assumed = there_mn > 0.0
            sign = np.where(assumed, 1.0, -1.0) * changed
            blocks, more = self.equations.blocks, sign[:, None, None] * stiffness
            contact.add_to_tangent(blocks, self.body.sparsity.diagonal, more)
            acting = acting + more
            more_mn = np.where(assumed, here_mn, 0.0) - touch.pressed_mn
            missing_mn = lacking_mn - float(more_mn @ along)
            forces = np.zeros_like(now.displacement_mm)
            contact.add_to_nodes(forces, more_mn[:, None] * touch.normal)
            residual_mn = now.residual_mn + forces.ravel()[free]
            try:
                found = at_depth = self.solver.solve(blocks, residual_mn, forcing, at_depth)
            except ConvergenceError:
                break
        return best

    def advanced(
        self,
        now: Configuration,
        direction: FloatArray,
        residual_mn: FloatArray,
        missing_mn: float,
        acting: FloatArray,
    ) -> tuple[FloatArray, float]:
        """Add the advance of the indenter towards the given force to a Newton step at one depth."""
        # With r the residuals and K, b, c the second derivatives of the potential by uu, ud and dd, the exact
        # step lies in the plane of (x, 0) and t = (-y, 1), where K x = r_u and K y = b. The step along t
        # minimises the quadratic model after x, however loosely x and y are solved. The usual c - b'y for the
        # stiffness along t would not do: contact is so stiff that the two nearly cancel.
        contact = self.load.contact
        on_axis = acting @ contact.placement.axis
        coupling = np.zeros_like(now.displacement_mm)
        contact.add_to_nodes(coupling, -on_axis)
        b = coupling.ravel()[self.body.free]
        c = float(contact.placement.axis @ on_axis.sum(axis=0))
        self.response = y = self.solver.solve(self.equations.blocks, b, DEPTH_FORCING, self.response)
        force = missing_mn - b @ direction - y @ (residual_mn - self.solver.multiply(direction))
        stiffness = y @ self.solver.multiply(y) - 2.0 * (b @ y) + c
        if not stiffness > 0.0:
            raise ConvergenceError("The indenter meets no resistance.")
        # More and more skin resists an indenter that advances: a tangent from a light touch leads too deep.
        # Middles of facets may touch at depth 0, of which no multiple leads deeper.
        shallowest = now.depth_mm / MOST_ADVANCE
        deepest = max(now.depth_mm * MOST_ADVANCE, FIRST_DEPTH_MM)
        advance = float(np.clip(now.depth_mm + force / stiffness, shallowest, deepest)) - now.depth_mm
        return direction - advance * y, advance

    def newton_direction(self, now: Configuration, forcing: float) -> tuple[Configuration, FloatArray]:
        """Solve for a Newton step, and return the configuration with the tangent that could be solved."""
        # Skin that is about to slide round a sharp edge has no stiffness along it. Without the curvature of
        # the indenter the tangent still leads downhill, but slowly. After some such steps, and where tissue
        # alone has no stiffness in some direction, the tangent is shifted along its diagonal.
        if self.shift > 0.0:
            return self.shifted_direction(now, forcing)
        most_straight = MOST_STRAIGHT if self.persistent else np.inf
        try:
            try:
                return now, self.solver.solve(self.equations.blocks, now.residual_mn, forcing)
            except NotPositiveDefiniteError:
                if not now.is_curved or self.straightened >= most_straight:
                    raise
            self.straightened += 1
            now = self.with_tangent(now, curved=False)
            return now, self.solver.solve(self.equations.blocks, now.residual_mn, forcing)
        except ConvergenceError:
            if not self.persistent:
                raise
            return self.shifted_direction(now, forcing)

    def shifted_direction(self, now: Configuration, forcing: float) -> tuple[Configuration, FloatArray]:
        """Solve with the smallest of some shifts of the tangent that makes it positive definite."""
        # The step leads downhill, and `line_search` takes it only as far as the potential falls. Without the
        # curvature of the indenter a smaller shift suffices, but the step is further from Newton's.
        first = FIRST_SHIFT if self.shift == 0.0 else self.shift / CHANGE_SHIFT
        if first < FIRST_SHIFT:
            first = 0.0
        where, axes = self.body.sparsity.diagonal, np.arange(3)
        for curved, largest in LARGEST_SHIFTS.items():
            now = self.with_tangent(now, curved)
            blocks = self.equations.blocks
            own, shift = blocks[where], first
            self.equations.forget_tangent()
            stiffness = np.abs(own[:, axes, axes])
            while shift <= largest:
                shifted = own.copy()
                shifted[:, axes, axes] += shift * stiffness
                blocks[where] = shifted
                try:
                    direction = self.solver.solve(blocks, now.residual_mn, forcing)
                except ConvergenceError:
                    shift = max(CHANGE_SHIFT * shift, FIRST_SHIFT)
                    continue
                self.shift = shift
                self.was_shifted |= shift > 0.0
                return now, direction
        raise NotPositiveDefiniteError

    def is_set_free(self, now: Configuration, share: float = 0.0) -> bool:
        """Whether more than a share of the points pressed before the step carry no force now."""
        before = self.load.pressed_before
        if before is None:
            return False
        return bool((before & (now.contact.pressed_mn == 0.0)).sum() > share * before.sum())

    def closed_step(self, now: Configuration, forcing: float) -> Step:
        """Solve for a Newton step in which the skin does not fly into an indenter that moves aside."""
        # An indenter that slides by more than the penetration sets most nodes free for one iteration. Without
        # their stiffness a Newton step drives the skin deep into the indenter.
        where = now.displacement_mm, now.depth_mm, self.lagging
        closed = self.equations.at(*where, curved=False, closed=True)
        return closed, self.solver.solve(self.equations.blocks, closed.residual_mn, forcing), 0.0

    def renew(self, now: Configuration, augmented: bool) -> Configuration:
        """Take multipliers and anchors from the contact found; return the configuration under them."""
        contact, anchors = self.load.contact, self.load.anchors
        multipliers = contact.augmented(now.contact) if augmented else self.lagging.multipliers_mn
        self.augmentations += augmented
        if self.persistent and self.augmentations > MOST_FULL_AUGMENTATIONS:
            multipliers = 0.5 * (multipliers + self.lagging.multipliers_mn)
        if anchors is not None and self.lagging.anchors is not None:
            anchors = contact.renewed(anchors, now.contact, now.depth_mm)
            self.renewals.append((self.lagging.anchors, anchors))
            if len(self.renewals) > MOST_PLAIN_RENEWALS:
                anchors = by_secants([*self.renewals][-SECANTS - 1 :])
        self.lagging = Lagging(multipliers, anchors)
        return self.equations.at(now.displacement_mm, now.depth_mm, self.lagging)

    def found(self, now: Configuration, iterations: int, balance: Balance) -> Equilibrium:
        """Gather the equilibrium, its anchors ready for the next step."""
        carried, slid, heat_uj = None, None, 0.0
        if self.load.anchors is not None and self.lagging.anchors is not None:
            anchors = self.lagging.anchors
            carried = self.load.contact.carried(anchors, now.contact, now.positions_mm, now.depth_mm)
            slid = slid_mm(anchors, carried, self.load.contact.gap(anchors.anchor_mm)[1])
            heat_uj = float(0.5 * (self.load.anchors.limit_mn + anchors.limit_mn) @ slid)
        return Equilibrium(
            displacement_mm=now.displacement_mm,
            depth_mm=now.depth_mm,
            contact=now.contact,
            multipliers_mn=self.lagging.multipliers_mn,
            iterations=iterations,
            balance=balance,
            anchors=carried,
            slid_mm=slid,
            rubbed_uj=heat_uj,
            pressure_kpa=None if now.pressures is None else now.pressures.pressure_kpa,
            was_shifted=self.was_shifted,
        )

    def moved(self, start: Configuration, step: FloatArray, advance_mm: float = 0.0) -> Configuration:
        """Go by a step of the free degrees of freedom and of the indenter."""
        displacement = start.displacement_mm.copy()
        displacement.ravel()[self.body.free] += step
        depth_mm, before, pressure = start.depth_mm + advance_mm, start.contact.friction, None
        if self.persistent:
            displacement.ravel()[self.body.free] += self.along_surface(start, displacement, depth_mm)
        if start.pressures is not None:
            pressure = start.pressures.after(self.body.mesh.elements, displacement - start.displacement_mm)
        # Friction and mixed methods carry more than the displacements over to the tangent.
        carries = self.load.anchors is not None or self.body.is_mixed or self.load.force_mn is not None
        with_tangent = carries or start.relative_residual > LAST_STEP
        return self.equations.at(displacement, depth_mm, self.lagging, with_tangent, before, pressure)

    def along_surface(self, start: Configuration, displacement_mm: FloatArray, depth_mm: float) -> FloatArray:
        """Displacements that keep pressed nodes as deep in the indenter as the linear step leaves them."""
        # A node that moves straight on leaves a curved surface, or enters it, by the square of its step over
        # twice the radius. The penalty turns this into a large force, so that steps along an edge had to be
        # short (the effect of Maratos and its correction; Nocedal & Wright 2006, sections 15.5 and 15.6).
        contact, n_nodes = self.load.contact, self.load.contact.nodes.size
        positions_mm = contact.points_mm(self.body.mesh.nodes_mm + displacement_mm)
        gap_mm, normal = contact.gap(contact.placement.to_local(positions_mm, depth_mm))
        touch, rotation = start.contact, contact.placement.rotation
        advance_mm = (depth_mm - start.depth_mm) * contact.placement.axis
        moved_mm = positions_mm - start.positions_mm - advance_mm
        linear_mm = touch.gap_mm + (moved_mm * touch.normal).sum(axis=1)
        pressed = self.lagging.multipliers_mn - contact.stiffness * linear_mm > 0.0
        error_mm = np.where(pressed, gap_mm - linear_mm, 0.0)[:n_nodes]
        # A node that moves by more than the radius has passed the edge.
        error_mm[2.0 * np.abs(error_mm) > np.linalg.norm(moved_mm[:n_nodes], axis=1)] = 0.0
        correction = np.zeros_like(displacement_mm)
        correction[contact.nodes] = -error_mm[:, None] * (normal[:n_nodes] @ rotation.T)
        return correction.ravel()[self.body.free]

    def line_search(
        self, start: Configuration, direction: FloatArray, advance_mm: float, potentials: list[float]
    ) -> Configuration:
        """Go along a step, halving it until the potential falls below the highest remembered one."""
        # Nodes that come into contact raise the potential for a step or two until the next steps push them
        # out again; a comparison with several earlier potentials allows this (Grippo, Lampariello & Lucidi
        # 1986).
        is_shifted = self.shift > 0.0
        highest_uj = max(potentials[-(1 if is_shifted else REMEMBERED_POTENTIALS) :])
        slope = -float(direction @ start.residual_mn) - advance_mm * start.missing_force_mn(self.load)
        at_rest, unbalanced_mn = self.unrest(start) < LAST_STEP, self.out_of_balance_mn(start)
        shortest = SHORTEST_NEAR_REST if self.persistent and at_rest else SHORTEST_STEP
        length = 1.0
        while length >= shortest:
            trial = self.moved(start, length * direction, length * advance_mm)
            falls = self.potential_uj(trial) <= highest_uj + SUFFICIENT_DECREASE * length * slope
            # Near the solution the decrease of the potential is below round-off: compare residuals. They are
            # not compared relative to the contact force of each: a retreat sets all nodes free at first, and
            # any step that drives skin into the indenter would then count as better. With a shifted tangent
            # a smaller residual may be that of a saddle, so only the potential counts until near the end.
            near = not is_shifted or at_rest
            if falls and length == 1.0 and is_shifted:
                return self.lengthened(start, direction, advance_mm, trial)
            if falls or (near and self.out_of_balance_mn(trial) < 0.9 * unbalanced_mn):
                return trial
            length /= 2
        folds = "" if trial.whole else f": it turns {self.folded(trial.displacement_mm)} inside out"
        raise ConvergenceError(f"The line search found no better configuration{folds}.")

    def lengthened(
        self, start: Configuration, direction: FloatArray, advance_mm: float, trial: Configuration
    ) -> Configuration:
        """Double a step with a shifted tangent while the potential falls."""
        # Away from an unstable state each step is a multiple of the one before, which a shift much larger
        # than the negative stiffness makes little more than one.
        length = 1.0
        while self.load.anchors is None and length < LONGEST_SHIFTED_STEP:
            further = self.moved(start, 2.0 * length * direction, 2.0 * length * advance_mm)
            if not self.potential_uj(further) < self.potential_uj(trial):
                return replace(trial, has_tangent=False)  # the tangent is now that of the step refused
            trial, length = further, 2.0 * length
        return trial

    def folded(self, displacement_mm: FloatArray) -> str:
        """Name the element that a displacement turns inside out, the worst of them."""
        return element_place(self.body.mesh, squeezed_most(self.body.mesh, displacement_mm)[0])
