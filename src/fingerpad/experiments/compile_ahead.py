"""Compile what a first press and its first response need last, while another process compiles the rest.

`python -m fingerpad.experiments.compile_ahead` fills the cache that both processes read. Nothing is pressed:
invented values make it call the same kernels with arrays of the same types.
"""

from __future__ import annotations

import numpy as np

from fingerpad.data import fingertip
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.geometry.bodies import Sphere
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.fields import FieldState, Watched
from fingerpad.mechanics.materials import MaterialTable
from fingerpad.mechanics.moments import tissue_after
from fingerpad.mechanics.tissues import named_tissues
from fingerpad.mechanics.viscoelastic import StepCoefficients, StressHistory
from fingerpad.neuron.population import Population
from fingerpad.skin.fields import stored_fields, watched_elements
from fingerpad.skin.indentation import Touch

COARSE = Grading(
    fingertip.CONTACT_POINT.value[0], 4.0, 1.5, 1.0, 0.75, stratum_corneum=1, dermis=2, subcutis=2
)

STRESS_KPA = 100.0  # Of all skin: every afferent fires.


def respond_to_stress(touch: Touch) -> None:
    """Call the kernels of receptors and neurons."""
    times_ms = touch.steps_ms()
    sizes = touch.mesh, times_ms.size, watched_elements(touch.mesh).size
    fields = {field.name: np.full(field.shape(*sizes), STRESS_KPA) for field in stored_fields()}
    nothing_solved = dict.fromkeys(
        ("force_imbalance", "energy_imbalance", "penetration_mm", "newton_steps", "factorisations"), 0
    )
    skin = touch.response(fields | {"times_ms": times_ms}, linear_solver="", **nothing_solved)
    Population.grid(density_per_cm2=100).respond(skin)


def relax_skin_at_rest(touch: Touch) -> None:
    """Call the kernels of what follows a solved step."""
    mesh, table = touch.mesh, MaterialTable.of(touch.tissues.layers)
    chosen = watched_elements(mesh)
    watched = Watched.of(mesh, table, chosen)
    history = StressHistory.unloaded(len(mesh.elements), table.shares.shape[1])
    at_rest = FieldState.unloaded(len(mesh.nodes_mm), chosen.size)
    nowhere_mm = np.zeros_like(mesh.nodes_mm)
    step = StepCoefficients.of(table, step_ms=1.0)
    tissue_after(mesh, watched, history, at_rest, (nowhere_mm, nowhere_mm), step)


def main() -> None:
    touch = Touch(Fingertip(), Sphere(), RampAndHold(), named_tissues(DEFAULT_TISSUES), COARSE)
    respond_to_stress(touch)
    relax_skin_at_rest(touch)


if __name__ == "__main__":
    main()
