"""The fast cases hold, and the committed pages show the stored rows of all cases and no failure."""

from dataclasses import replace

import numpy as np
import pytest

from fingerpad.geometry.fingertip import Fingertip
from fingerpad.geometry.grading import resolution_grading
from fingerpad.geometry.mesh import finger_mesh

from . import press_table
from .case import at_least, at_most, equal, near
from .cases import ORDERED, THEMES
from .page import PAGE, page_text, read_rows, used
from .pictures import PICTURES
from .stored_runs import closing, stored

FAST = [case for case in ORDERED if not case.slow]
STORED = read_rows()


@pytest.mark.parametrize("case", FAST, ids=lambda case: case.name)
def test_every_number_holds(case):
    assert case.rows
    assert [row for row in case.rows if not row.passes] == []


@pytest.mark.parametrize("case", FAST, ids=lambda case: case.name)
def test_the_stored_rows_are_what_is_measured(case):
    """Quantities, bounds and tolerances as they are; only the numbers got may differ in their last digits."""
    for row, kept in zip(case.rows, STORED[case.name], strict=True):
        assert (row.quantity, row.unit, row.judged) == (kept.quantity, kept.unit, kept.judged)
        assert kept.tolerance == pytest.approx(row.tolerance, rel=1e-5)
        if row.judged in ("at most", "at least"):
            assert kept.expected == pytest.approx(row.expected, rel=1e-5)


def test_every_case_is_stored_and_every_stored_number_holds():
    assert list(STORED) == [case.name for case in ORDERED]
    assert [row for rows in STORED.values() for row in rows if not row.passes] == []


def test_the_pages_show_the_stored_rows():
    assert PAGE.read_text(encoding="utf-8") == page_text(ORDERED, STORED, PICTURES, closing())
    presses = press_table.page_text(press_table.read_rows())
    assert press_table.TABLE_PAGE.read_text(encoding="utf-8") == presses


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


def test_stored_errors_of_meshes_are_those_of_the_stored_profiles():
    """Largest differences of SED and rates under the bar again from the profiles."""
    refined, sized = stored("mesh_refinement")["bars"], stored("paper_size")["bars"]
    rows = [(refined, each["mesh"], each["against"], each["errors"]) for each in refined["against_finer"]]
    rows += [(sized, mesh, "paper", errors) for mesh, errors in sized["errors"].items()]
    assert len(rows) == 6
    columns = {"sed": ("sed_ramp_kpa", "sed_hold_kpa"), "rate_hz": ("dynamic_rate_hz", "static_rate_hz")}
    for run, mesh, against, errors in rows:
        ours, finest = run["profiles"][mesh], run["profiles"][against]
        chosen = [ours["shift_mm"].index(shift) for shift in finest["shift_mm"]]
        for kind, names in columns.items():
            for phase, column in zip(errors[kind].values(), names, strict=True):
                finer = np.array(finest[column])
                unit = finer.max() if kind == "sed" else 1.0
                largest = np.abs(np.array(ours[column])[chosen] - finer).max() / unit
                assert phase["max"] == pytest.approx(largest, rel=1e-12)


def test_names_and_titles_of_cases_are_their_own():
    assert len({case.name for case in ORDERED}) == len(ORDERED)
    assert len({(case.theme, case.title) for case in ORDERED}) == len(ORDERED)
    assert {case.theme for case in ORDERED} == set(THEMES)
    assert all(case.source for case in ORDERED)


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
    assert np.isnan(row.got) or (used(row) <= 1.0) is holds


def test_a_failure_is_marked_on_the_page():
    case = FAST[0]
    text = page_text([case], {case.name: [near("a", 1.0, 2.0, relative=0.1)]}, "", "")
    assert "| 0/1 **fails** | a | 1 ± 10 % | 2 |" in text
