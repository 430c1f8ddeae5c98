"""Functions that users do not call, each with a number or a word that is easily checked by hand."""

from importlib import import_module

import numpy as np
import pytest

from fingerpad import Bar, Material, RampAndHold, Sphere, named_tissues, sine
from fingerpad.geometry.mesh import block_mesh
from refusals import refused


def called(dotted, *arguments):
    module, name = dotted.split(":")
    return getattr(import_module(f"fingerpad.{module}"), name)(*arguments)


SOFT = [Material.neo_hooke(shear_kpa=5.0, poisson=0.48)]
LINES = np.array([4.0, 2.0, 1.0, 1.0, 1.0, 1.0, 3.0])
SILENT = [[20.0, np.nan], [30.0, 40.0]]
COURSE = np.array([[0.0], [0.9], [2.0], [2.0]])

NUMBERS = [
    ("core.regions:mean_spacing_mm", (25.0,), 2.0),
    ("core.regions:around_zero", (2,), [-0.5, 0.5]),
    ("core.regions:around_zero", (3,), [-1.0, 0.0, 1.0]),
    ("core.threads:even_chunks", (300,), [(0, 128), (128, 256), (256, 300)]),
    ("core.threads:run_kernel", (lambda size, first, last: size * (last - first), 200, 10), [1280, 720]),
    ("experiments.gerling2014.percept:goodwin_misfit", (np.array([0.58, 0, 0, 0, 0, 0.93]),), 0.0141),
    ("geometry.courses:samples_of_line", (np.arange(4.0), COURSE, 0.2), [True, False, True, True]),
    ("mechanics.fields:largest_compression", (np.array([1.0, -3.0, 0.0, 0.0, 0.0, 0.0]),), 3.0),
    ("mechanics.inertia:share_of_force", (sine(0.5, 0.01, 183.0, cycles=4), SOFT, [5.0]), 0.0189),
    ("mechanics.multigrid:kept_lines", (LINES, 1.0), [0, 1, 3, 5, 7]),
    ("mechanics.moments:length_ms", (500.1, 500.4), 0.3),
    ("mechanics.press_settings:steps_of_advance", (0.4, 0.05), 8),
    ("mechanics.press_settings:steps_of_advance", (0.4, float("inf")), 1),
    ("mechanics.press_settings:steps_of_slide", (0.1, Bar(fillet_mm=0.3), 0.1, True), 2),
    ("mechanics.press_settings:steps_of_slide", (0.1, Bar(fillet_mm=0.0), 0.05, True), 12),
    ("mechanics.press_settings:steps_of_slide", (0.1, Sphere(), 0.1, True), 1),
    ("mechanics.press_settings:steps_of_slide", (0.2, Bar(fillet_mm=0.3), 0.05, False), 2),
    ("mechanics.press_settings:steps_of_slide", (0.2, Bar(fillet_mm=0.0), 0.05, False), 4),
    ("psychophysics.observer:checked_responses", (SILENT, 50.0), [[20, 50], [30, 40]]),
    ("reduction.model:filter_step", (100.0, np.array([100.0])), [[0.3679], [0.2642], [0.3679]]),
]  # fmt: skip


@pytest.mark.parametrize(("dotted", "arguments", "expected"), NUMBERS)
def test_numbers(dotted, arguments, expected):
    np.testing.assert_allclose(called(dotted, *arguments), expected, rtol=5e-3)


WORDS = [
    ("core.units:with_unit", ("displacement", "deep_displacement"), "displacement [mm]"),
    ("core.units:with_unit", ("0.1", "skin_stretch", " {}"), "0.1"),
    ("experiments.requests.parts:merged", ("bar", {"width_mm": 3}), {"kind": "bar", "width_mm": 3}),
    ("experiments.requests.parts:merged", ({"kind": "bar"}, {"kind": "sphere"}), {"kind": "sphere"}),
    ("core.displayed:udunits", ("spikes/s",), "s-1"),
    ("geometry.free_mesh:plain_name", ("LIVING-EPIDERMIS",), "living epidermis"),
    ("geometry.mesh_checks:element_place", (block_mesh([0, 1], [0, 1], [0, 1], layers=[2]), 0),
     "element 0 (dermis, about x = 0.5, y = 0.5, z = 0.5 mm)"),
    ("mechanics.tissues:name_of_tissues", (named_tissues("paper"),), "paper"),
    ("mechanics.tissues:name_of_tissues", (named_tissues("paper").scaled(1.1),), ""),
    ("report.tables:spelled", ("largest_contact_mm2",), "largest contact [mm²]"),
    ("report.tables:spelled", ("worst_scaled_jacobian",), "worst scaled jacobian"),
]  # fmt: skip


@pytest.mark.parametrize(("dotted", "arguments", "expected"), WORDS)
def test_words(dotted, arguments, expected):
    assert called(dotted, *arguments) == expected


def test_a_window_beyond_the_end_is_refused():
    with refused("static_window_ms"):
        called("neuron.spikes:check_windows", ((30.0, 50.0), (600.0, 9500.0)), RampAndHold().end_ms)
