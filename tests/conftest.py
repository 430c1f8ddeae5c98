"""Order of the test files, and the fixture that runs a command line in this process.

The longest files come first, so that no process works alone at the end.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

# An example may take long while other processes have the cores: that is no failure. Every run tries the same
# examples, so that a commit passes or fails for good; `--hypothesis-profile=search` tries new ones.
settings.register_profile("fingerpad", deadline=None, derandomize=True)
settings.register_profile("search", deadline=None)
settings.load_profile("fingerpad")

LONGEST = (
    "test_reproduction.py",
    "test_readme.py",
    "verification/test_oracles.py",
    "verification/test_verification.py",
    "studies/test_tissue_posterior.py",
    "test_pose.py",
    "test_surfaces.py",
    "test_recording_fit.py",
    "studies/test_tissue_search.py",
    "test_report.py",
    "test_own_mesh.py",
    "test_validation.py",
    "test_store.py",
    "test_discrimination_task.py",
    "test_estimation_afferent_posterior.py",
    "test_psychometric.py",
    "test_compilation.py",
    "test_behaviour.py",
    "test_small_bodies.py",
)
"""Files by their processor time, the longest first; all others follow in the order of their names."""

HERE = Path(__file__).parent


@pytest.fixture
def run_program(monkeypatch, capsys, tmp_path) -> Callable[..., tuple[int, str, str]]:
    """Run a main function with words of a command line in an empty folder: status, output and errors."""
    monkeypatch.chdir(tmp_path)

    def run(main: Callable[[], None], *words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", [str(word) for word in words])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr()
        return ended.value.code or 0, said.out, said.err

    return run


@pytest.fixture
def is_refused(tmp_path) -> Callable[..., None]:
    """Check the outcome of a misused command: status 2, one sentence of errors, and no file written."""

    def check(outcome: tuple[int, str, str], program: str, named: str, came: str) -> None:
        status, said, errors = outcome
        assert (status, said) == (2, "")
        assert errors.startswith(f"{program}: ")
        assert errors.endswith(".\n")
        assert not errors.endswith("..\n")  # no sentence within a sentence
        assert errors.count("\n") == 1
        assert named in errors
        assert came in errors.removeprefix(f"{program}: ")
        assert list(tmp_path.iterdir()) == []

    return check


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort the tests of whole files; within a file they keep their order."""
    if missing := [name for name in LONGEST if not (HERE / name).exists()]:
        raise pytest.UsageError(f"LONGEST of tests/conftest.py must name test files: {', '.join(missing)}.")
    rank = {HERE / name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.path, len(LONGEST)))
