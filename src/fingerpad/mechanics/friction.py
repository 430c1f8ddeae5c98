"""Coulomb friction of skin on a rigid indenter: a regularised law with a potential, its limit lagged.

A node in contact is anchored where it first touched the indenter, at a in the indenter's frame. Its slip g
from there, at x, costs

    g = P (x - a),   P = I - n n',   s = |g|,
    phi(s) = k s² / 2             while s <= L / k   (it sticks),
           = L (s - L / (2 k))    beyond             (it slips),
    f = -phi'(s) g / s,           |f| = min(k s, L) <= L = mu lambda,

with the stiffness k of skin that sticks, which moves by a few microns. At the end of a step the anchor of a
node that slipped is moved until |f| = k s (return mapping).

Coulomb's law has no potential, since the limit L depends on the normal force lambda: its tangent is not
symmetric. Here L, n and a stay as they are while Newton's method runs, which keeps the tangent symmetric and
not indefinite; they are renewed between its runs until the equilibrium no longer changes
(docs/decisions/friction.md); after some renewals by the secants of the last few.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fingerpad.core.values import FloatArray

LEAST_SECANT = 1e-6  # Size below which a combination of secants counts as none, over that of the largest.

MOST_EXPECTED = 4.0
"""Largest factor by which the last step of free skin is extended to where it is expected next."""


@dataclass(frozen=True)
class Approach:
    """Skin and indenter at the end of the step before, and how they moved in it."""

    local_mm: FloatArray  # Nodes in the indenter's frame of then, (n, 3). [mm]
    skin_mm: FloatArray
    skin_step_mm: FloatArray  # Nodes in the finger's frame, and their motion in that step, (n, 3). [mm]
    tip_mm: FloatArray
    tip_step_mm: FloatArray  # The indenter's tip, and its motion, (3,). [mm]

    @classmethod
    def at_rest(cls, local_mm: FloatArray, skin_mm: FloatArray, tip_mm: FloatArray) -> Approach:
        """Nothing has moved yet."""
        return cls(local_mm, skin_mm, np.zeros_like(skin_mm), tip_mm, np.zeros(3))

    def after(self, local_mm: FloatArray, skin_mm: FloatArray, tip_mm: FloatArray) -> Approach:
        return Approach(local_mm, skin_mm, skin_mm - self.skin_mm, tip_mm, tip_mm - self.tip_mm)

    def expected_mm(self, tip_mm: FloatArray) -> FloatArray:
        """Nodes in the finger's frame, had they gone on with the tip as in the step before. [mm]

        Only as far as the tip goes on in the same direction: after a change of direction free skin is
        expected to stay.
        """
        before = float(self.tip_step_mm @ self.tip_step_mm)
        further = float((tip_mm - self.tip_mm) @ self.tip_step_mm)
        ratio = float(np.clip(further / before, 0.0, MOST_EXPECTED)) if before > 0.0 else 0.0
        return self.skin_mm + ratio * self.skin_step_mm


@dataclass(frozen=True)
class Anchors:
    """Where each node of skin holds on to the indenter, and how strongly."""

    anchor_mm: FloatArray  # a, in the indenter's frame; meaningless where a node is not held, (n, 3). [mm]
    normal: FloatArray  # n, in the indenter's frame, (n, 3).
    limit_mn: FloatArray  # L, the largest friction, (n,). [mN]
    pull_mn: FloatArray  # t, where the search for the pull begins, see `friction`, (n, 3). [mN]
    held: np.ndarray  # Nodes that were in contact at the end of the step before, (n,).
    approach: Approach  # Motion of skin and indenter in the step before.

    @classmethod
    def none_held(cls, approach: Approach) -> Anchors:
        n, zero = len(approach.local_mm), np.zeros_like(approach.local_mm)
        return cls(approach.local_mm, zero, np.zeros(n), zero, np.zeros(n, dtype=bool), approach)

    @property
    def cone_mn(self) -> FloatArray:
        """L n, the cone of friction of each node: its axis, as long as its radius, (n, 3). [mN]"""
        return self.limit_mn[:, None] * self.normal

    def with_cones(self, cone_mn: FloatArray) -> Anchors:
        """Return anchors with the limits and normals of other cones.

        A node that is free, or whose normal would turn by more than 60 degrees, keeps its own.
        """
        limit = np.linalg.norm(cone_mn, axis=1)
        fits = (self.limit_mn > 0.0) & ((cone_mn * self.normal).sum(axis=1) > 0.5 * limit)
        normal = cone_mn / np.where(fits, limit, 1.0)[:, None]
        return replace(
            self,
            normal=np.where(fits[:, None], normal, self.normal),
            limit_mn=np.where(fits, limit, self.limit_mn),
        )


@dataclass(frozen=True)
class Friction:
    """Friction at one configuration, in the indenter's frame."""

    force_mn: FloatArray  # Friction on each node, (n, 3). [mN]
    stiffness: FloatArray
    """Its tangent, or a stiffer one far from the solution; no negative eigenvalues, (n, 3, 3). [mN/mm]"""
    potential: float
    slip_mm: FloatArray
    pull_mn: FloatArray  # t, the pull towards which the linearised law leads, within the limit, (n, 3). [mN]


def friction(
    anchors: Anchors, local_mm: FloatArray, stiffness: FloatArray, before: Friction | None = None
) -> Friction:
    """Friction on nodes that have slipped from their anchors.

    With m = max(s, L / k) the law reads m t = L g, f = -t. Newton's method on g alone swings to and fro,
    since a node that slips resists no further slip and overshoots its place of rest. Linearising the law for
    g and t together, as for total variation (Chan, Golub & Mulet 1999), gives

        t_new = (L g_new - t e'(g_new - g)) / m,   e = g / s, or 0 where it sticks,
        stiffness = (L P - sym(t e')) / m,

    with t kept within L. At the solution t = L e and the tangent is exact. A search that begins with t = 0
    takes a stiffer tangent, that of the paraboloid that touches phi from above.
    """
    n, limit, k = anchors.normal, anchors.limit_mn, stiffness
    g, s, m, e = _slip(anchors, local_mm, k)
    pull = (limit / m)[:, None] * g
    energy = np.where(k * s > limit, limit * (s - limit / (2.0 * k)), 0.5 * k * s**2)
    t = anchors.pull_mn - n * (n * anchors.pull_mn).sum(axis=1)[:, None]
    if before is not None:
        _, _, m_before, e_before = _slip(anchors, before.slip_mm + anchors.anchor_mm, k)
        further = (e_before * (g - before.slip_mm)).sum(axis=1)[:, None]
        t = (limit[:, None] * g - before.pull_mn * further) / m_before[:, None]
    length = np.linalg.norm(t, axis=1)
    t = t * np.where(length > limit, limit / np.where(length > 0.0, length, 1.0), 1.0)[:, None]
    projection = np.eye(3) - n[:, :, None] * n[:, None, :]
    along = t[:, :, None] * e[:, None, :]
    symmetric = 0.5 * (along + along.transpose(0, 2, 1))
    tangent = (limit[:, None, None] * projection - symmetric) / m[:, None, None]
    return Friction(-pull, tangent, float(energy.sum()), g, t)


def _slip(
    anchors: Anchors, local_mm: FloatArray, stiffness: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Slip g (n, 3), its length s, m = max(s, L / k) and its direction e, 0 where a node sticks."""
    n, limit = anchors.normal, anchors.limit_mn
    g = local_mm - anchors.anchor_mm
    g = g - n * (n * g).sum(axis=1)[:, None]
    s = np.linalg.norm(g, axis=1)
    slips = stiffness * s > limit
    # A node whose limit is 0 has no friction, whatever m is.
    m = np.where(limit > 0.0, np.maximum(s, limit / stiffness), 1.0)
    return g, s, m, np.where(slips[:, None], g / np.where(s > 0.0, s, 1.0)[:, None], 0.0)


def dragged(anchors: Anchors, local_mm: FloatArray, stiffness: FloatArray, touching: np.ndarray) -> Anchors:
    """Anchors with which the next step starts: of nodes that slip they follow, of nodes set free they go."""
    pull = np.where(touching[:, None], -friction(anchors, local_mm, stiffness).force_mn, 0.0)
    return replace(
        anchors,
        anchor_mm=local_mm - pull / stiffness[:, None],
        limit_mn=np.where(touching, anchors.limit_mn, 0.0),
        pull_mn=pull,
        held=touching,
    )


def by_secants(tried: Sequence[tuple[Anchors, Anchors]]) -> Anchors:
    """Anchors that are likely to be those of the equilibrium that they lead to (Anderson 1965).

    With x the cones given and g(x) those found, the next guess is the combination of the latest g whose rest
    g - x is smallest, were g linear. Repeating x = g(x) converges only if a change of x changes g by less. At
    the sides of a ball that is drawn in deep, more friction presses the skin by more than itself.
    """
    found = np.array([after.cone_mn.ravel() for _, after in tried])
    rest = found - np.array([before.cone_mn.ravel() for before, _ in tried])
    shares, *_ = np.linalg.lstsq((rest[-1] - rest[:-1]).T, rest[-1], rcond=LEAST_SECANT)
    likely = found[-1] - shares @ (found[-1] - found[:-1])
    return tried[-1][1].with_cones(likely.reshape(-1, 3))


def slid_mm(found: Anchors, after: Anchors, normal_before: FloatArray) -> FloatArray:
    """How far each node slid over the indenter in a step: the way that its anchor was dragged, (n,). [mm]

    Between two normals that differ by the angle t the way is an arc. Its chord, projected along the face at
    its end, is shorter by sin(t) / t.
    """
    n = found.normal
    way = after.anchor_mm - found.anchor_mm
    projected_mm = np.linalg.norm(way - n * (n * way).sum(axis=1)[:, None], axis=1)
    turned = np.arccos(np.clip((n * normal_before).sum(axis=1), 0.0, 1.0))
    return projected_mm / np.sinc(turned / np.pi)
