"""A small block of skin, its tissues, presses into it, and a coarse finger: what tests that press share."""

import numpy as np

from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.mesh import block_mesh
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.materials import Material, Prony
from fingerpad.mechanics.press import Specimen, press

PRONY = Prony(shares=(0.2, 0.3), times_ms=(30.0, 400.0))
ELASTIC = tuple(Material.neo_hooke(shear, 0.45) for shear in (40.0, 40.0, 20.0, 8.0))
RELAXING = tuple(layer.with_prony(PRONY) for layer in ELASTIC)


class Coarse(Conditions):
    """A mesh of a few hundred elements for every press."""

    def deflection_grading(self, indenter=None):
        return Grading(RECEPTOR_X_MM, 4.0, 1.5, 1.0, 0.75, stratum_corneum=1, dermis=2, subcutis=2)

    bar_grading = sphere_grading = deflection_grading


def block(symmetric=True, layers=(0, 1, 2, 3, 3)):
    """Half of 6 mm x 6 mm, or all of it, and 3 mm deep."""
    lines = np.array([0.0, 0.4, 0.8, 1.3, 2.0, 3.0])
    both, depth = np.concatenate([-lines[:0:-1], lines]), [0.0, 0.3, 0.6, 1.2, 2.0, 3.0]
    return block_mesh(both, depth, lines if symmetric else both, list(layers), symmetric=symmetric)


def press_into(mesh, materials, indenter, motion, settings, at_mm=(0.0, 0.0, 0.0), **options):
    """Press from the first touch at a place, along y."""
    placement = place(indenter, mesh.nodes_mm[mesh.skin_nodes], np.array(at_mm), np.eye(3))
    return press(Specimen(mesh, materials), PlacedIndenter(indenter, placement, **options), motion, settings)
