"""Pages that show numbers of a run or options of a command are those that the code writes."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from fingerpad.core.errors import InputError, StoreError
from fingerpad.core.result_files import from_json
from studies.pages import with_blocks
from studies.results_page import (
    README_END,
    README_START,
    Excerpt,
    paper_page,
    read_excerpt,
    results_page,
    with_table,
)
from studies.tissue_page import set_blocks

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def shown():
    return from_json(Excerpt, (ROOT / "docs" / "results.json").read_bytes())


def page(name):
    return (ROOT / name).read_text(encoding="utf-8")


def test_the_page_of_results_is_written_from_its_numbers(shown):
    assert page("docs/results.md") == results_page(shown)


def test_the_table_of_the_readme_is_written_from_the_same_numbers(shown):
    assert with_table(page("README.md"), shown) == page("README.md")


def test_the_page_of_tissues_is_written_from_their_numbers():
    assert with_blocks(page("docs/tissues.md"), set_blocks()) == page("docs/tissues.md")


def test_the_page_of_the_paper_has_every_statement_and_every_section(shown):
    written = page("docs/paper.md")
    assert written == paper_page(shown)
    assert all(f"| {each.statement} |" in written for each in shown.statements)


def test_a_changed_number_changes_the_table_and_nothing_else_of_the_readme(shown):
    first, *others = shown.statements
    readme = f"before\n{README_START}\n| old |\n{README_END}\nafter\n"
    written = with_table(readme, replace(shown, statements=(replace(first, human="changed"), *others)))
    assert written.startswith(f"before\n{README_START}\n| section |")
    assert written.endswith(f"{README_END}\nafter\n")
    assert "| changed |" in written
    assert "| old |" not in written


def test_a_readme_without_its_marks_is_refused(shown):
    with pytest.raises(InputError, match="page must hold"):
        with_table("no marks", shown)


def test_files_that_are_missing_or_of_another_kind_are_refused(tmp_path):
    with pytest.raises(StoreError, match=r"none\.json must be a file that can be read"):
        read_excerpt(tmp_path / "none.json")
    (tmp_path / "other.json").write_text(json.dumps({"format": "fingerpad fit", "format_version": 1}))
    with pytest.raises(StoreError, match="must have the format fingerpad reproduction"):
        read_excerpt(tmp_path / "other.json")
