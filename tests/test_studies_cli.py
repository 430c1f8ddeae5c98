"""`python -m studies NAME`: options that reach a study, files that it writes, and refused options."""

import json
from functools import partial

import pytest

import studies
from fingerpad import cli
from fingerpad.core.checked import result_class
from fingerpad.experiments import runner
from studies import __main__ as command
from studies.pages import DOCS
from studies.study import Study, command_of


@pytest.fixture
def call(monkeypatch, run_program):
    """Run a study in this process, in an empty folder; an indentation fails the test."""
    monkeypatch.setattr(runner, "solve_missing", pytest.fail)
    return partial(run_program, command.main, "studies")


@result_class
class Found:
    """What a study found."""

    rate_hz: float


@pytest.mark.parametrize(
    ("has_conditions", "chosen", "conditions"),
    [(True, ("--seed", "5", "--resolution", "standard"), ("standard", 5)), (False, (), ("standard", 0))],
)
def test_a_study_is_run_with_what_was_asked_and_writes_page_and_numbers(
    monkeypatch, capsys, tmp_path, has_conditions, chosen, conditions
):
    asked = []

    def run(runner, conditions):
        asked.append((conditions.resolution, conditions.seed, runner.folder, runner.jobs))
        return Found(rate_hz=63.0)

    (tmp_path / "rates.md").write_text("# Rates\n\n<!-- begin rates -->\nold\n<!-- end rates -->\n")
    monkeypatch.setattr("studies.study.DOCS", tmp_path)

    def blocks(found):
        return {"rates": f"{found.rate_hz:g} spikes/s"}

    written = Study("rates", "Fire.", run, blocks, "rates.md", has_conditions)
    program = cli.Program("studies", "Research.", {"rates": command_of(written)})
    out = tmp_path / "found"
    with pytest.raises(SystemExit) as ended:
        cli.main(["rates", "--out", str(out), "--jobs", "2", *chosen], program)
    assert not ended.value.code
    assert asked == [(*conditions, out, 2)]
    assert capsys.readouterr().out == f"Page: {out / 'rates.md'}\nResults: {out / 'rates.json'}\n"
    page = "# Rates\n\n<!-- begin rates -->\n63 spikes/s\n<!-- end rates -->\n"
    assert (out / "rates.md").read_text() == page
    assert json.loads((out / "rates.json").read_text()) == {"rate_hz": 63.0}


def test_every_study_has_a_command_and_a_line_of_help(call):
    _, said, _ = call("--help")
    names = [study.name for study in command.STUDIES]
    assert len(names) == len(set(names)) == 3
    assert all(f" {name} " in said for name in (*names, "results"))
    assert all(f"`{name}`" in studies.__doc__ for name in (*names, "results"))
    for page in {study.page for study in command.STUDIES} - {None}:
        assert "<!-- begin " in (DOCS / page).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "named", "came"),
    [
        (["held-out", "--jobs", "0"], "jobs must be a whole number of at least 1", "0"),
        (["held-out", "--out", "--jobs", "2"], "--out: expected one argument", ""),
        (["mesh-refinement", "--resolution", "quick"], "No such option", "--resolution"),
        (["results", "none.json"], "none.json must be a file that can be read", "No such file"),
        (["meshes"], "No such command", "'meshes'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_misuse_is_one_sentence_and_status_2_and_nothing_is_written(call, is_refused, arguments, named, came):
    is_refused(call(*arguments), "studies", named, came)
