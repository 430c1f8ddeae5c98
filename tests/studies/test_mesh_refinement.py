"""Mesh refinement: what is pressed, differences between meshes, and one run on skins given by a formula."""

from dataclasses import replace

import numpy as np
import pytest

from fingerpad.core.result_files import from_json, to_json
from fingerpad.data import bar_firing_rates
from fingerpad.experiments import runner
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.geometry.bodies import Sphere
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import Grading
from fingerpad.geometry.mesh import finger_mesh
from fingerpad.geometry.motion import RampAndHold
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.report.tables import number
from fingerpad.skin.indentation import touch_of
from studies import mesh_refinement
from studies.mesh_refinement import (
    MeshRefinement,
    Reading,
    blocks,
    goodness_of_fit,
    observed_order,
    over_thickness,
)

COARSE = Grading(RECEPTOR_X_MM, 1.0, 1.0, 1.0, 1.0, stratum_corneum=1, dermis=1, subcutis=1)


@pytest.fixture(scope="module")
def pressed():
    """A real answer of a very coarse finger, for its shape: tests put their own energies into it."""
    touch = touch_of(Fingertip(), Sphere(curvature_per_m=287.0), RampAndHold(depth_mm=0.2), grading=COARSE)
    return replace(touch, settings=PressSettings(1, 1)).solve()


def skin_with(pressed, sed_kpa, mesh=None):
    """Skin with a SED of our own, (n_times, n_elements)."""
    over_time = {name: pressed.fields[name] for name in ("times_ms", "force_mn", "depth_mm")}
    return replace(pressed, fields={**over_time, "sed_kpa": sed_kpa}, mesh=mesh or pressed.mesh)


# How differences are summed up


def test_a_receptor_reads_the_mean_over_the_living_epidermis(pressed):
    mesh = finger_mesh(Fingertip(), replace(COARSE, living_epidermis=2))
    by_depth = np.array([5.0, 1.0, 4.0, 7.0, 7.0])  # corneum, two sheets of living epidermis, the rest
    skin = skin_with(pressed, np.tile(by_depth, (3, mesh.shape[0] * mesh.shape[1])), mesh)
    place = [[RECEPTOR_X_MM, 0.0]]
    assert skin.sed(place).values[-1, 0] == pytest.approx(4.0)
    assert over_thickness(skin, 2).sed(place).values[-1, 0] == pytest.approx(2.5)
    assert np.array_equal(over_thickness(skin, 1).sed_kpa, skin.sed_kpa)


def test_rates_as_observed_fit_perfectly_at_any_shifts():
    observed, shifts = bar_firing_rates(), [4, 20, 31]
    rates = {
        "dynamic": observed.dynamic_rate_hz[shifts, None],
        "static": observed.static_rate_hz[shifts, None],
    }
    assert goodness_of_fit(Reading(tuple(shifts), {}, rates)) == 1.0
    silent = {phase: 0.0 * rate for phase, rate in rates.items()}
    assert goodness_of_fit(Reading(tuple(shifts), {}, silent)) == 0.0


@pytest.mark.parametrize("order", [0.5, 2.0, 3.7])
def test_order_and_limit_of_a_power_are_found(order):
    factors = np.array([0.5, 1.0, 1.5])
    found, limit = observed_order(2.0 - 0.3 * factors**-order, factors)
    assert found == pytest.approx(order, rel=1e-8)
    assert limit == pytest.approx(2.0, rel=1e-8)


# A whole run, and what is shown of it

ERROR = 0.1
"""Made-up error of the standard mesh; it falls with the square of the elements' size."""


@pytest.fixture(scope="module")
def results(pressed, tmp_path_factory):
    """Results of a run whose skin is a formula, wide bumps below the indenter with a known error."""
    mesh = pressed.mesh
    # The same through the thickness, so that its mean over any sheets is the formula itself.
    column = np.repeat(mesh.living_epidermis.ravel(), mesh.shape[2])
    x, _, z = mesh.nodes_mm[mesh.elements].mean(axis=1)[column].T
    over_time = np.array([0.0, 1.0, 0.9])[:, None]

    class Formula:
        def __init__(self, folder):
            pass

        def missing(self, touches):
            return {touch: touch for touch in touches}

        def load(self, touch):
            sphere = isinstance(touch.indenter, Sphere)
            size = touch.grading.size_x_mm / (0.25 if sphere else 0.1)
            width = 1000.0 / touch.indenter.curvature_per_m if sphere else 3.0
            bump = 5.0 / width * np.exp(-(((x - touch.at_mm[0]) / width) ** 2) - (z / width) ** 2)
            return skin_with(pressed, over_time * bump * (1.0 + ERROR * size**2))

    solved = []
    few = (24, 18)
    levels = tuple(replace(level, shifts=few) for level in mesh_refinement.LEVELS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mesh_refinement, "LEVELS", levels)
        patch.setattr(runner, "Store", Formula)
        patch.setattr(runner, "solve_missing", lambda missing, *rest: solved.extend(missing.values()))
        found = mesh_refinement.run(runner.Runner(tmp_path_factory.mktemp("mesh")), Conditions())
    return found, solved, levels


def test_a_run_presses_every_mesh_and_finds_the_known_error_and_order(results):
    found, solved, levels = results
    assert len(solved) == sum(len(level.shifts) + len(level.spheres) for level in levels)
    fine = 1.0 + ERROR / 1.5**2
    expected = {
        "coarse": (1.0 + 4.0 * ERROR) / fine - 1.0,
        "quick": (1.0 + 4.0 * ERROR) / fine - 1.0,  # 0.2 mm against 0.1 mm
        "standard": (1.0 + ERROR) / fine - 1.0,
    }
    *rows, last = found.bars
    assert {row.mesh: row.sed["ramp"].max for row in rows} == pytest.approx(expected, rel=1e-6)
    assert (last.mesh, last.against) == ("quick", "standard")
    assert last.sed["ramp"].max == pytest.approx((1.0 + 4.0 * ERROR) / (1.0 + ERROR) - 1.0, rel=1e-6)
    assert found.spheres[2].sed["hold"].max == pytest.approx(expected["standard"])
    assert found.convergence[0].touch == "bar, shift 1.3 mm"
    for row in found.convergence:
        assert row.order == pytest.approx(2.0, rel=1e-6)
        assert row.limit_kpa == pytest.approx(row.sed_kpa[-1] / fine, rel=1e-6)


def test_the_table_shows_the_errors_of_every_mesh(results):
    found = results[0]
    assert to_json(from_json(MeshRefinement, to_json(found))) == to_json(found)
    (block,) = blocks(found).values()
    error = 100.0 * found.bars[2].sed["ramp"].max
    nodes = number(found.meshes[2].bar_nodes)
    assert f"| bar | standard | {nodes} | fine | {error:.1f} %" in block
    assert "order of 2.0 (median of 5 of 5 touches)" in block
