"""`python -m studies NAME` as a shell meets it: what each study is asked for, and what it refuses."""

import json
import sys
from pathlib import Path

import pytest

from studies import __main__ as command
from studies import drive_study, mesh_refinement, paper_size
from studies.pages import drive_study as drives_report
from studies.pages import mesh_refinement as report
from studies.pages import paper_size as paper_report


@pytest.fixture
def call(monkeypatch, capsys, tmp_path):
    """Run a study in this process, in an empty folder; a press would fail the test."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(mesh_refinement, "run", pytest.fail)
    monkeypatch.setattr(paper_size, "run", pytest.fail)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["studies", *arguments])
        with pytest.raises(SystemExit) as ended:
            command.main()
        said = capsys.readouterr()
        return ended.value.code or 0, said.out, said.err

    return run


@pytest.mark.parametrize(
    ("chosen", "study", "name"),
    [
        ((), mesh_refinement, "mesh_refinement.md"),
        (("--against", "fine"), mesh_refinement, "mesh_refinement.md"),
        (("--against", "paper"), paper_size, "paper_size.md"),
    ],
    ids=["default", "fine", "paper"],
)
def test_refine_writes_its_page_numbers_and_figure(call, monkeypatch, tmp_path, chosen, study, name):
    asked = []
    page = {mesh_refinement: report, paper_size: paper_report}[study]
    monkeypatch.setattr(study, "run", lambda *arguments: asked.append(arguments[:2]) or {})
    monkeypatch.setattr(page, "documents", lambda results: {name: b"errors"})
    status, said, _ = call("refine", "--out", "meshes", "--jobs", "3", *chosen)
    assert (status, asked) == (0, [(Path("meshes"), 3)])
    assert said == f"Report: {Path('meshes') / name}\n"
    assert (tmp_path / "meshes" / name).read_bytes() == b"errors"


def test_drives_writes_its_page_and_numbers_for_the_conditions_given(call, monkeypatch, tmp_path):
    asked = []

    def study(task, on_finished):
        asked.append((task.conditions.resolution, task.conditions.seed, task.folder, task.jobs))
        return {"candidates": []}

    def write(results, folder, command):
        (folder / "page.md").write_text(command)
        return folder / "page.md"

    monkeypatch.setattr(drive_study, "study_drives", study)
    monkeypatch.setattr(drives_report, "write_drive_page", write)
    status, said, _ = call("drives", "--resolution", "quick", "--out", "found", "--jobs", "2", "--seed", "5")
    assert (status, asked) == (0, [("quick", 5, Path("found"), 2)])
    assert said == f"Page: {Path('found/page.md')}\nResults: {Path('found/drive_quantities.json')}\n"
    assert (tmp_path / "found" / "page.md").read_text() == "python -m studies drives --resolution quick"
    assert json.loads((tmp_path / "found" / "drive_quantities.json").read_text()) == {"candidates": []}


@pytest.mark.parametrize(
    ("arguments", "named", "came"),
    [
        (["drives", "--jobs", "0"], "jobs must be a whole number of at least 1", "0"),
        (["drives", "--seed", "-1"], "seed must be a whole number of at least 0", "-1"),
        (["drives", "--resolution", "fine"], "resolution must be one of quick, standard, paper", "'fine'"),
        (["refine", "--jobs", "0"], "jobs must be a whole number of at least 1", "0"),
        (["refine", "--against", "coarse"], "against must be one of fine, paper", "'coarse'"),
        (["refine", "--resolution", "quick"], "No such option", "--resolution"),
        (["results", "none.json"], "none.json cannot be read as JSON", "No such file"),
        (["meshes"], "No such command", "'meshes'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_misuse_is_one_sentence_and_status_2_and_nothing_is_written(call, tmp_path, arguments, named, came):
    status, said, errors = call(*arguments)
    assert (status, said) == (2, "")
    assert errors.startswith("studies: ")
    assert errors.count("\n") == 1
    assert named in errors
    assert came in errors.removeprefix("studies: ")
    assert list(tmp_path.iterdir()) == []
