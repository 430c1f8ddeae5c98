"""Contact and steps about a small body or a sharp edge, scaled by the smallest elements of its mesh.

Skin is stretched several times there, lies on few nodes and slides round the edge node by node. What each
number is good for is measured in docs/decisions/small-bodies.md.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fingerpad.geometry.indenter_grading import SHARPEST_MM
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import Mesh
from fingerpad.mechanics.assembly import Sparsity
from fingerpad.mechanics.contact import Contact
from fingerpad.mechanics.middles import Middles
from fingerpad.mechanics.newton import NewtonSettings

LONGEST_STEP = 1.0
"""Largest advance of the indenter in one step, over the smallest elements. In longer steps, skin at the rim
of a punch of 1 mm slid off it where shorter ones hold it."""

LONGEST_SLIDE = 1.0 / 6
"""Longest way aside of an edge in one step, over its radius. The force on a node rises and falls as it passes
the edge, and with longer steps the heat of friction there is not found."""

LEAST_PENETRATION = 0.1
"""Penetration that is accepted at any depth, over the smallest elements."""

SAGS, SAG_OF_WIDTH = (0.125, 0.5), 1.0 / 60
"""Least and largest sag of a facet that follows the body, over the smallest elements, and the sag over the
half-width. The least is that of a chord as long as the radius. With the least everywhere, nodes and middles
at the edge of a wide body take turns in contact, and each turn loses a little work."""

STIFFNESS_KPA = 20_000.0
"""Penalty of contact, times the smallest elements. Such a body presses with 300 kPa and more on skin that is
stretched. Each augmentation that corrects a penetration sets points there free, so they may not penetrate by
more than a few percent of these elements. [kPa]"""

STICK_PENALTY = 60_000.0
"""Stiffness per area of skin that sticks. Softer skin yields by a good part of an element under 1 MPa; with a
stiffer one the renewal of friction finds no end. [kPa/mm]"""

MORE_NEWTON_STEPS = 3
"""Newton steps of one search, over those of others: nodes find their place one after the other, and friction
is renewed after each."""


def contact_about(contact: Contact, mesh: Mesh, sparsity: Sparsity, finest_mm: float) -> Contact:
    """Let contact act between nodes too, and as stiffly as small elements need."""
    middles = Middles.of(mesh, sparsity, contact.nodes, sag_mm(contact.indenter, finest_mm))
    penalty = STIFFNESS_KPA / finest_mm
    return replace(contact, penalty=penalty, stick_penalty=STICK_PENALTY, middles=middles)


def sag_mm(indenter: Indenter, finest_mm: float) -> float:
    """How deep the middle of a facet may lie within a small body. [mm]"""
    narrowest_mm = min(indenter.half_width_mm, indenter.narrowest_mm / 2)
    least, most = SAGS
    return float(np.clip(SAG_OF_WIDTH * narrowest_mm, least * finest_mm, most * finest_mm))


def newton_about(newton: NewtonSettings, finest_mm: float) -> NewtonSettings:
    """Let a search go on through indefinite tangents, for longer, to a penetration that points can reach."""
    return replace(
        newton,
        persistent=True,
        most_iterations=MORE_NEWTON_STEPS * newton.most_iterations,
        least_penetration_mm=LEAST_PENETRATION * finest_mm,
    )


def steps_of_advance(advance_mm: float, finest_mm: float) -> int:
    """Return the number of equal steps of an advance, none of them longer than allowed."""
    return _steps(advance_mm, LONGEST_STEP * finest_mm)


def steps_of_slide(way_mm: float, indenter: Indenter) -> int:
    """Return the number of equal steps of a way aside, none of them longer than the edges allow.

    Edges that are sharper than any mesh made for them count as round as the sharpest of these.
    """
    return _steps(way_mm, LONGEST_SLIDE * max(indenter.sharpest_mm, SHARPEST_MM))


def _steps(way_mm: float, longest_mm: float) -> int:
    return max(1, int(np.ceil(way_mm / longest_mm - 1e-9)))
