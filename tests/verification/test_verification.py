"""The fast cases hold, and the committed page shows all cases, the rows that are measured, and no failure."""

from dataclasses import replace

import numpy as np
import pytest

from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import finger_mesh

from . import press_table
from .case import at_least, at_most, equal, near
from .cases import ORDERED, THEMES
from .page import PAGE, allowance, case_text, expectation, page_text, rows_shown
from .stored_runs import closing, results

FAST = [case for case in ORDERED if not case.slow]
SHOWN = rows_shown(PAGE.read_text(encoding="utf-8"))


@pytest.mark.parametrize("case", FAST, ids=lambda case: case.name)
def test_every_number_holds(case):
    assert case.rows
    assert [row for row in case.rows if not row.passes] == []


def test_the_page_shows_every_case_in_order():
    assert list(SHOWN) == [case.name for case in ORDERED]
    assert all(SHOWN.values())


@pytest.mark.parametrize("case", ORDERED, ids=lambda case: case.name)
def test_every_number_on_the_page_holds(case):
    assert {cells[-1] for cells in SHOWN[case.name]} == {"holds"}


@pytest.mark.parametrize("case", FAST, ids=lambda case: case.name)
def test_the_page_shows_what_is_measured(case):
    """Quantities, bounds and tolerances as they are; only the numbers got may differ in their last digits."""
    measured = [(row.quantity, row.unit, allowance(row)) for row in case.rows]
    assert [(cells[0], cells[1], cells[5]) for cells in SHOWN[case.name]] == measured
    bounds = [(row.quantity, expectation(row)) for row in case.rows if "≤" in expectation(row)]
    assert [(cells[0], cells[2]) for cells in SHOWN[case.name] if "≤" in cells[2]] == bounds


def test_the_page_of_presses_shows_the_stored_rows():
    assert press_table.TABLE_PAGE.read_text(encoding="utf-8") == press_table.page_text(
        press_table.read_rows()
    )


def test_a_mean_through_the_epidermis_is_at_the_same_depth_with_any_number_of_elements():
    """Heights of elements stand for SED that changes with depth."""
    means = []
    for elements in (1, 2, 3):
        grading = replace(resolution_grading("quick", 17.37), living_epidermis=elements)
        mesh = finger_mesh(Fingertip(), grading)
        heights_mm = mesh.nodes_mm[mesh.elements].mean(axis=1)[None, :, 1]
        means.append(press_table.through_epidermis(mesh, heights_mm))
    np.testing.assert_allclose(means[1], means[0], atol=1e-4)
    np.testing.assert_allclose(means[2], means[0], atol=1e-4)


def test_the_page_ends_with_the_stored_run_which_belongs_to_no_case():
    text = PAGE.read_text(encoding="utf-8")
    assert text.endswith("\n\n" + closing())
    assert rows_shown(page_text(FAST[:1], {}, "", closing())) == rows_shown(page_text(FAST[:1], {}, ""))


def test_stored_errors_are_those_of_the_stored_profiles():
    """Largest differences of SED and rates again from the profiles, so that none on the page is stale."""
    stored = results()
    columns = [
        *(("sed", phase, f"sed_{phase}_kpa") for phase in ("ramp", "hold")),
        *(("rate_hz", phase, f"{phase}_rate_hz") for phase in ("dynamic", "static")),
    ]
    assert len(stored.bars) == 4
    for row in stored.bars:
        profile, finest = stored.profiles[row.mesh], stored.profiles[row.against]
        rows = [profile.shift_mm.tolist().index(shift) for shift in finest.shift_mm]
        assert row.touches == len(rows)
        for kind, phase, column in columns:
            finer = getattr(finest, column)
            unit = finer.max() if kind == "sed" else 1.0
            largest = np.abs(getattr(profile, column)[rows] - finer).max() / unit
            assert getattr(row, kind)[phase].max == pytest.approx(largest, rel=1e-12)


def test_names_and_titles_of_cases_are_their_own():
    assert len({case.name for case in ORDERED}) == len(ORDERED)
    assert len({(case.theme, case.title) for case in ORDERED}) == len(ORDERED)
    assert {case.theme for case in ORDERED} == set(THEMES)
    assert all(case.about and case.source for case in ORDERED)


@pytest.mark.parametrize(
    ("row", "holds"),
    [
        (near("a", 2.0, 2.019, relative=0.01), True),
        (near("a", -2.0, -2.021, relative=0.01), False),
        (near("a", 2.0, float("nan"), relative=0.01), False),
        (equal("a", 0.0, 0.1, absolute=0.1), True),
        (equal("a", 0.0, -0.11, absolute=0.1), False),
        (at_most("a", 1.0, 1.0), True),
        (at_most("a", 1.0, 1.1), False),
        (at_most("a", 1.0, float("nan")), False),
        (at_least("a", 1.0, 0.9), False),
        (at_least("a", 1.0, float("inf")), True),
    ],
)
def test_judgement_of_a_row(row, holds):
    assert row.passes is holds


def test_a_failure_is_marked_on_the_page():
    failing = replace(FAST[0], measure=lambda: [near("a", 1.0, 2.0, relative=0.1)])
    shown = rows_shown(page_text([failing], {}, ""))
    assert shown == {failing.name: [["a", "", "1", "2", "+100.00 %", "10 %", "**fails**"]]}
    assert "| **fails** |" in case_text(failing)
