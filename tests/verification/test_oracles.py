"""CalculiX and FElupe on our job: run where they are installed, and required where CI says so.

`.ci/run` installs CalculiX and sets FINGERPAD_REQUIRE_ORACLES; `make test` on a machine without it says in
the list of skipped tests how to get it. `make verification` alone presses the fine block, which takes 90 s;
here FElupe presses a coarse one.
"""

import importlib.util
import os
import re

import numpy as np
import pytest

from fingerpad.export.decks import calculix_deck
from fingerpad.mechanics.contact import PlacedIndenter
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.mechanics.press import Specimen, press
from fingerpad.mechanics.press_settings import PressSettings

from . import calculix, oracles
from .case import CASES
from .oracle_block import BACK, BALL, MOTION, coarse_job, job

REQUIRED = os.environ.get("FINGERPAD_REQUIRE_ORACLES", "") not in ("", "0")
MISSING = {
    "calculix": None if calculix.PROGRAM else "CalculiX is not installed: apt-get install calculix-ccx",
    "felupe": None if importlib.util.find_spec("felupe") else "FElupe is not installed: pip install felupe",
}


ON_THE_FINE_BLOCK = ("calculix_block", "felupe_block", "felupe_release")
QUICK = [case for case in CASES if case.theme == oracles.THEME and case.name not in ON_THE_FINE_BLOCK]


def require(solver):
    missing = MISSING[solver]
    if missing and REQUIRED:
        pytest.fail(f"{missing} (FINGERPAD_REQUIRE_ORACLES asks for it)")
    if missing:
        pytest.skip(missing)


@pytest.mark.parametrize("case", QUICK, ids=lambda case: case.name)
def test_another_solver_agrees(case):
    require("calculix")
    assert case.rows
    assert [row for row in case.rows if not row.passes] == []


@pytest.mark.parametrize(
    ("motion", "end_ms"), [(MOTION, 40.0), (BACK, 80.0)], ids=["press", "press and release"]
)
def test_felupe_agrees_on_a_coarse_block(motion, end_ms):
    """Force at every step, and SED at the end, where the skin is pressed or free again."""
    require("felupe")
    from . import felupe_press  # GPL: only tests import it

    times = np.arange(0.0, end_ms + 1.0, 20.0)
    there = coarse_job(times, motion.prescribed_at(times))
    force, sed = felupe_press.press(there)
    settings = PressSettings(2, 1, NewtonSettings(penetration_tolerance=5e-4))
    ours = press(
        Specimen(there.mesh, there.materials), PlacedIndenter(BALL, there.placement), motion, settings
    )
    of_force, of_field = oracles.SAME_ELEMENT
    scale = ours.force_mn.max()
    np.testing.assert_allclose(ours.force_mn[1 : times.size], 2.0 * force, rtol=of_force, atol=1e-5 * scale)
    np.testing.assert_allclose(
        ours.sed_kpa[times.size - 1], sed, rtol=0, atol=of_field * max(sed.max(), 1e-5)
    )


def test_the_deck_that_calculix_runs_is_the_job():
    """Fixed and moving nodes, steps and materials of the oracle's deck, since agreement rests on them."""
    deck = calculix_deck(job())
    assert deck.count("*STEP") == 1
    assert re.search(r"^5, 40, ", deck, re.M)
    assert len(re.findall(r"^\*HYPERELASTIC, NEO HOOKE$", deck, re.M)) == 4
    assert "INDENTER, 2, 2, 0.8" in deck


def test_printed_results_are_read_by_time_and_element(tmp_path):
    """Means over the points of an element, sets after one another, totals of the indenter."""
    printed = """
 total force (fx,fy,fz) for set INDENTER and time  0.5000000E+01

        1.000000E+00  2.000000E+00 -3.000000E-01

 internal energy density (elem, integ.pnt.,eigenvalue) for set A and time  0.5000000E+01

         1   1  1.000000E+00
         1   2  3.000000E+00

 internal energy density (elem, integ.pnt.,eigenvalue) for set B and time  0.5000000E+01

         3   1  5.000000E+00
"""
    found = calculix.read(printed, n_elements=3, sets=("a", "b"))
    assert found.times_ms.tolist() == [5.0]
    assert found.force_mn.tolist() == [[1.0, 2.0, -0.3]]
    assert found.sed_kpa.tolist() == [[2.0, 0.0, 5.0]]
