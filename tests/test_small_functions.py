"""Functions that users do not call, each with a number or a word that is easily checked by hand."""

from importlib import import_module

import numpy as np
import pytest

from fingerpad import Bar, Grading, InputError, Material, RampAndHold, Sphere, named_tissues, sine
from fingerpad.core.phases import ramp_and_hold_phases
from fingerpad.geometry.mesh import block_mesh
from fingerpad.mechanics.balance import Entry
from fingerpad.psychophysics.discrimination import (
    Experiment,
    compare_euclidean_observers,
    compare_gradient_sum_observers,
    discriminate_euclidean,
    discriminate_gradient_sum,
)


def called(dotted, *arguments):
    module, name = dotted.split(":")
    return getattr(import_module(f"fingerpad.{module}"), name)(*arguments)


SOFT = [Material.neo_hooke(shear_kpa=5.0, poisson=0.48)]
PAIR = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
LINES = np.array([4.0, 2.0, 1.0, 1.0, 1.0, 1.0, 3.0])
SILENT = [[20.0, np.nan], [30.0, 40.0]]
COURSE = np.array([[0.0], [0.9], [2.0], [2.0]])

NUMBERS = [
    ("core.layouts:mean_spacing_mm", (25.0,), 2.0),
    ("core.layouts:around_zero", (2,), [-0.5, 0.5]),
    ("core.layouts:around_zero", (3,), [-1.0, 0.0, 1.0]),
    ("core.threads:even_chunks", (300,), [(0, 128), (128, 256), (256, 300)]),
    ("core.threads:run_kernel", (lambda size, first, last: size * (last - first), 200, 10), [1280, 720]),
    ("experiments.gerling2014.discrimination_statistics:goodwin_misfit", (np.array([0.58, 0.93]),), 0.0141),
    ("geometry.grading:lines_across", (Grading(17.0, 0.5, 1.0, 0.2, 0.5, 0.5), 2.0), [0, 0.5, 1, 1.5, 2]),
    ("geometry.trajectory:samples_of_line", (np.arange(4.0), COURSE, 0.2), [True, False, True, True]),
    ("mechanics.fields:largest_compression", (np.array([1.0, -3.0, 0.0, 0.0, 0.0, 0.0]),), 3.0),
    ("mechanics.inertia:share_of_force", (sine(0.5, 0.01, 183.0, cycles=4), SOFT, [5.0]), 0.0189),
    ("mechanics.multigrid:kept_lines", (LINES, 1.0), [0, 1, 3, 5, 7]),
    ("mechanics.press:length_ms", (500.1, 500.4), 0.3),
    ("mechanics.press_settings:steps_of_advance", (0.4, 0.05), 8),
    ("mechanics.press_settings:steps_of_advance", (0.4, float("inf")), 1),
    ("mechanics.press_settings:steps_of_slide", (0.1, Bar(fillet_mm=0.3)), 2),
    ("mechanics.press_settings:steps_of_slide", (0.1, Bar(fillet_mm=0.0)), 12),
    ("mechanics.press_settings:steps_of_slide", (0.1, Sphere()), 1),
    ("psychophysics.discrimination:checked_responses", (SILENT, 50.0), [[20, 50], [30, 40]]),
    ("reduction.relaxation:filter_step", (100.0, np.array([100.0])), [[0.3679], [0.2642], [0.3679]]),
]  # fmt: skip


@pytest.mark.parametrize(("dotted", "arguments", "expected"), NUMBERS)
def test_numbers(dotted, arguments, expected):
    np.testing.assert_allclose(called(dotted, *arguments), expected, rtol=5e-3)


WORDS = [
    ("core.units:with_unit", ("displacement", "deep_displacement"), "displacement [mm]"),
    ("core.units:with_unit", ("0.1", "skin_stretch", " {}"), "0.1"),
    ("experiments.descriptions.reading:merged", ("bar", {"width_mm": 3}), {"kind": "bar", "width_mm": 3}),
    ("experiments.descriptions.reading:merged", ({"kind": "bar"}, {"kind": "sphere"}), {"kind": "sphere"}),
    ("export.dataset:udunits", ("spikes/s",), "s-1"),
    ("geometry.mesh_parts:plain_name", ("LIVING-EPIDERMIS",), "living epidermis"),
    ("geometry.mesh_checks:element_place", (block_mesh([0, 1], [0, 1], [0, 1], layers=[2]), 0),
     "element 0 (dermis, about x = 0.5, y = 0.5, z = 0.5 mm)"),
    ("mechanics.tissues:name_of_tissues", (named_tissues("paper"),), "paper"),
    ("mechanics.tissues:name_of_tissues", (named_tissues("paper").scaled(1.1),), ""),
    ("report.formatting:spelled", ("largest_contact_mm2",), "largest contact [mm²]"),
    ("report.formatting:spelled", ("worst_scaled_jacobian",), "worst scaled jacobian"),
]  # fmt: skip


@pytest.mark.parametrize(("dotted", "arguments", "expected"), WORDS)
def test_words(dotted, arguments, expected):
    assert called(dotted, *arguments) == expected


def test_parts_of_results():
    assert called("core.phases:from_onset", ramp_and_hold_phases(150.0, 1100.0), 100.0)[0].window_ms == (
        100,
        150,
    )
    assert (
        called("mechanics.cycles:blended", Entry(stored_uj=1.0), Entry(stored_uj=3.0), 0.25).stored_uj == 1.5
    )
    turned = called("geometry.mesh_checks:rigid_motions", PAIR)[:, 1, 3]  # along y, about z
    assert turned.tolist() == [-0.5, 0.5]
    block = block_mesh([0.0, 1.0], [0.0, 1.0, 2.0], [0.0, 1.0], layers=[2, 3])
    squeezed = called("geometry.mesh_checks:squeezed_most", block, -0.1 * block.nodes_mm**2 * [0.0, 1.0, 0.0])
    assert squeezed == (1, pytest.approx(0.7))


def test_cubic_interpolation_is_exact_for_a_cubic():
    u, v = np.indices((41, 41)) - 20.0
    known = called("skin.receptor_sheet:coefficients", (u * u * v)[:, :, None])
    found = called("skin.receptor_sheet:values_and_slopes_at", known, np.array([[1.5, 2.0]]), 20)
    np.testing.assert_allclose(np.ravel(found), [4.5, 6.0, 2.25], rtol=1e-6)


def test_observers_side_by_side_are_those_that_judge_alone():
    responses, plan, sigmas = [[50.0, 60.0], [50.0, 64.0]], Experiment(), (0.02, 0.2)
    noises = [(sigma, plan) for sigma in sigmas]
    sums = compare_gradient_sum_observers(responses, [[0, 1]], noises, seed=1)
    distances = compare_euclidean_observers(responses, noises, seed=1)
    for sigma, by_sum, by_distance in zip(sigmas, sums, distances, strict=True):
        alone = discriminate_gradient_sum(responses, [[0, 1]], sigma, 1, plan)
        assert by_sum.hit_rate.tolist() == alone.hit_rate.tolist()
        alone = discriminate_euclidean(responses, sigma, 1, plan)
        assert by_distance.hit_rate.tolist() == alone.hit_rate.tolist()


def test_a_window_beyond_the_end_is_refused():
    with pytest.raises(InputError, match="static_window_ms must be a start from 0 on and a later end"):
        called("neuron.spikes:check_windows", ((30.0, 50.0), (600.0, 9500.0)), RampAndHold().end_ms)
